//! The shipped campaigns, and the statistics of whole draws.

use crate::campaign::{ContactEventPlan, Keep, Method};
use crate::contact_names::{ContactNames, pair_key};
use crate::scenario::tests::FREE_BODY;
use crate::{Campaign, SCHEMA_KINDS, histograms, load};
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::model::Side;
use softdock_kernels::params::Params;
use softdock_kernels::plant::{Plant, PointSource};
use std::path::{Path, PathBuf};

fn campaigns() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns")
}

fn shipped(name: &str) -> Campaign {
    load(&campaigns().join(name)).unwrap_or_else(|problems| panic!("{problems}"))
}

/// A campaign on the free ball, with the given entries.
fn campaign(runs: u64, entries: &str) -> Campaign {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let head = format!(
        "schema = \"campaign/2\"\nid = \"test\"\ntitle = \"t\"\nseed = 42\nruns = {runs}\nscenario = \"s.toml\"\n"
    );
    std::fs::write(folder.path().join("s.toml"), FREE_BODY).expect("written");
    std::fs::write(folder.path().join("delays.csv"), "delay_ms\n4\n8\n40\n").expect("written");
    std::fs::write(folder.path().join("offsets.csv"), COVARIANCE).expect("written");
    std::fs::write(folder.path().join("c.toml"), head + entries).expect("written");
    load(&folder.path().join("c.toml")).unwrap_or_else(|problems| panic!("{problems}"))
}

/// All draws of one parameter.
fn drawn(campaign: &Campaign, name: &str) -> Vec<f64> {
    let field = fields::<f64, Params<f64>>().iter().position(|field| field.name == name).expect(name);
    (0..campaign.runs).map(|run| to_vec(&campaign.draw(run).expect("a draw").params)[field]).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Pearson's correlation.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (ma, mb) = (mean(a), mean(b));
    let product =
        |x: &[f64], mx: f64, y: &[f64], my: f64| x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>();
    product(a, ma, b, mb) / (product(a, ma, a, ma) * product(b, mb, b, mb)).sqrt()
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    for (rank, index) in order.into_iter().enumerate() {
        ranks[index] = rank as f64;
    }
    ranks
}

/// Standard deviations 1, 2 and 3 mm, correlations 0.5, -0.3 and 0.2, in mm².
const COVARIANCE: &str = "offset_x,offset_y,offset_z\n1,1,-0.9\n1,4,1.2\n-0.9,1.2,9\n";

const MASS: &str = "[[dispersion]]\ntarget = \"target_mass\"\n\
                    dist = { kind = \"uniform\", min = \"300 kg\", max = \"500 kg\" }\n";
const FRICTION: &str = "[[dispersion]]\ntarget = \"contact_friction\"\n\
                        dist = { kind = \"truncnormal\", mean = 0.2, sigma = 0.1, min = 0.05, max = 0.5 }\n";
const STIFFNESS: &str = "[[dispersion]]\ntarget = \"contact_stiffness\"\n\
                         dist = { kind = \"loguniform\", min = \"1e4 N/m\", max = \"1e6 N/m\" }\n";

#[test]
fn shipped_campaigns_are_valid_and_described() {
    for (name, runs) in [
        ("smoke.toml", 64),
        ("plate_impact.toml", 4000),
        ("probe_drogue.toml", 2000),
        ("berth.toml", 400),
        ("insert.toml", 200),
        ("jamming.toml", 400),
        ("wedging.toml", 400),
        ("servo.toml", 200),
        ("grapple.toml", 200),
        ("adapter_ring.toml", 200),
        ("soft_capture.toml", 10_000),
    ] {
        let campaign = shipped(name);
        assert_eq!(campaign.runs, runs);
        assert_eq!(campaign.hash.len(), 64);
        let text = histograms(&campaign, 500).expect("no keys");
        for dispersion in &campaign.dispersions {
            assert!(text.contains(&dispersion.name), "{name}: {}", dispersion.name);
        }
        assert!(text.contains("C1_transport_delay"));
    }
}

#[test]
fn every_shipped_campaign_loads() {
    let files = std::fs::read_dir(campaigns()).expect("a folder").map(|entry| entry.expect("an entry").path());
    let names: Vec<PathBuf> = files.filter(|path| path.extension().is_some_and(|e| e == "toml")).collect();
    assert!(names.len() > 5, "{names:?}");
    for path in names {
        let campaign = load(&path).unwrap_or_else(|problems| panic!("{problems}"));
        let plant = Plant::new(campaign.scenario.model);
        assert!(
            plant == plant.clone(),
            "{}: without a number in it that is none a kernel serves every batch",
            path.display()
        );
    }
}

const VARIANTS: &str = "[[dispersion]]\nvariable = \"knowledge\"\n\
                        dist = { kind = \"uniform\", min = 0.9, max = 1.1 }\n\
                        [[variant]]\nname = \"none\"\n\
                        [[variant]]\nname = \"smith\"\n\
                        set = { \"facility.compensator\" = { kind = \"smith\", delay = \"4 ms\", stiffness = \"1e4 N/m\" } }\n\
                        [[variant.derived]]\ntarget = \"compensator_stiffness\"\n\
                        expr = \"contact_stiffness * knowledge\"\n";

#[test]
fn variants_share_their_draws_and_differ_in_the_facility_alone() {
    let alone = campaign(50, STIFFNESS);
    let whole = campaign(50, &format!("{STIFFNESS}{VARIANTS}"));
    let [none, smith] = &[0, 1].map(|variant: usize| whole.on_variant(&whole.variants[variant]));
    let stiffness = drawn(&alone, "contact_stiffness");
    assert_eq!(drawn(none, "contact_stiffness"), stiffness, "a variable moves no other draw");
    assert_eq!(drawn(smith, "contact_stiffness"), stiffness);
    assert_eq!((none.id.as_str(), smith.id.as_str()), ("test/none", "test/smith"));
    assert!(none.hash != smith.hash && none.hash != whole.hash);
    for (known, true_value) in drawn(smith, "compensator_stiffness").iter().zip(&stiffness) {
        assert!((0.9..1.1).contains(&(known / true_value)), "{known} of {true_value}");
    }
    assert!(drawn(none, "compensator_stiffness").iter().all(|stiffness| *stiffness == 0.0));
    assert_ne!(none.scenario.model.facility, smith.scenario.model.facility);
    let mut same = smith.scenario.model.clone();
    (same.facility, same.nominal) = (none.scenario.model.facility.clone(), none.scenario.model.nominal);
    assert_eq!(same, none.scenario.model);
    assert_eq!(smith.nominal().compensator_stiffness, smith.scenario.model.nominal.contact_stiffness);
    assert_eq!(whole.variants[1].changes[0].0, "facility.compensator");
    assert_eq!(
        whole.variants[1].changes[1],
        ("compensator_stiffness".into(), "= contact_stiffness * knowledge".into())
    );
}

#[test]
fn a_comparison_is_cut_as_the_draws_are() {
    let map = "[compare]\nalong = \"contact_stiffness\"\n[[compare.map]]\nx = \"contact_stiffness\"\ny = \"target_mass\"\n\
               cells = [4, 2]\nslice = \"target_mass\"\nslices = 2\nline = \"target_mass + 0 * contact_stiffness\"\n";
    let plan = campaign(50, &format!("{STIFFNESS}{MASS}{VARIANTS}{map}")).comparison;
    let along = plan.along.expect("bands");
    assert!(along.logarithmic && along.edges.len() == 9);
    assert!((along.edges[0], along.edges[8]) == (1e4, 1e6) && (along.edges[4] - 1e5).abs() < 1.0);
    let [low, high] = [0, 1].map(|slice| &plan.maps[slice]);
    assert_eq!((low.x.edges.len(), low.y.edges.len(), plan.maps.len()), (5, 3, 2));
    // Slices of 300 to 400 and of 400 to 500 kg; the line stands in their middle.
    assert!(low.line.iter().all(|point| point.1 == 350.0) && high.line.iter().all(|point| point.1 == 450.0));
}

#[test]
fn the_probe_stands_before_the_drogue() {
    let model = shipped("probe_drogue.toml").scenario.model;
    let tool = crate::placement::end_frame(&model.links, &model.slides, &model.start_angles, model.tool);
    let part_a = model.base_pose.compose(tool);
    assert!((part_a.position.x + 0.04).abs() < 1e-12 && part_a.position.y.abs() + part_a.position.z.abs() < 1e-12);
    assert!(part_a.attitude.v.norm() < 1e-12);
    let mass: f64 = model.links.iter().map(|link| link.mass).sum();
    assert!((mass - 140.4).abs() < 1e-9, "{mass}");
    let effective = crate::mobility::effective_mass(&model, 2550.0, 410.0).expect("invertible");
    assert!((10.0..100.0).contains(&effective), "the arm's tip is light: {effective}");
}

/// Means, deviations and correlations of a whole vector, within five standard errors.
#[test]
fn multivariate_normals_have_their_covariance() {
    let draws = |figures: &str| {
        let mean = "mean = [\"0 m\", \"1 mm\", \"-2 mm\"]";
        let kind = "[[dispersion]]\ntarget = \"offset\"\ndist = { kind = \"mvnormal\"";
        let c = campaign(40_000, &format!("{kind}, {mean}, {figures} }}\n"));
        ["offset_x", "offset_y", "offset_z"].map(|name| drawn(&c, name))
    };
    let stated =
        draws("sigma = [\"1 mm\", \"2 mm\", \"3 mm\"], corr = [[1, 0.5, -0.3], [0.5, 1, 0.2], [-0.3, 0.2, 1]]");
    let [x, y, z] = &stated;
    let error = 5.0 / 200.0;
    for (values, center, sigma) in [(x, 0.0, 1e-3), (y, 1e-3, 2e-3), (z, -2e-3, 3e-3)] {
        let deviation = (values.iter().map(|v| (v - center).powi(2)).sum::<f64>() / 40_000.0).sqrt();
        assert!((mean(values) - center).abs() < error * sigma, "{}", mean(values));
        assert!((deviation / sigma - 1.0).abs() < error, "{deviation}");
    }
    for (a, b, expected) in [(x, y, 0.5), (x, z, -0.3), (y, z, 0.2)] {
        assert!((correlation(a, b) - expected).abs() < error, "{expected}: {}", correlation(a, b));
    }
    let from_file = draws("covariance = \"offsets.csv\", unit = \"mm\"");
    for (one, other) in stated.iter().flatten().zip(from_file.iter().flatten()) {
        assert!((one - other).abs() < 1e-15, "the same matrix from a file gives the same draws: {one} {other}");
    }
}

/// A discrete parameter has the share of each value, to one run where the draws are stratified.
#[test]
fn discrete_values_have_their_shares() {
    let dist = "[[dispersion]]\ntarget = \"target_mass\"\ndist = { kind = \"discrete\", \
                values = [\"500 kg\", \"300 kg\", \"400 kg\"], weights = [1, \"20 %\", 0.8] }\n";
    let counts = |sampling: &str| {
        let c = campaign(1000, &format!("{sampling}{dist}{STIFFNESS}"));
        let masses = drawn(&c, "target_mass");
        [300.0, 400.0, 500.0].map(|mass| masses.iter().filter(|drawn| **drawn == mass).count() as i64)
    };
    for sampling in ["[sampling]\nmethod = \"lhs\"\n", "[sampling]\nmethod = \"sobol\"\n"] {
        let found = counts(sampling);
        let most = if sampling.contains("lhs") { 1 } else { 4 };
        assert_eq!(found.iter().sum::<i64>(), 1000);
        assert!(found.iter().zip([100, 400, 500]).all(|(found, due)| (found - due).abs() <= most), "{found:?}");
    }
    // Random: within four binomial standard deviations, and not stratified.
    let found = counts("");
    assert_eq!(found.iter().sum::<i64>(), 1000);
    for (found, share) in found.iter().zip([0.1, 0.4, 0.5]) {
        let sd = (1000.0 * share * (1.0_f64 - share)).sqrt();
        assert!((*found as f64 - 1000.0 * share).abs() < 4.0 * sd, "{found} of {share}");
    }
}

/// Every one of n equal strata of the quantile is met once, whatever the distribution.
#[test]
fn new_distributions_are_stratified_and_described() {
    let entries = "[[dispersion]]\ntarget = \"target_mass\"\n\
                   dist = { kind = \"triangular\", min = \"300 kg\", mode = \"300 kg\", max = \"500 kg\" }\n\
                   [[dispersion]]\ntarget = \"contact_friction\"\n\
                   dist = { kind = \"arcsine\", min = 0.1, max = 0.3 }\n\
                   [[dispersion]]\ntarget = \"contact_stiffness\"\n\
                   dist = { kind = \"weibull\", scale = \"1e4 N/m\", shape = 2, min = \"1e4 N/m\" }\n\
                   [[dispersion]]\ntarget = \"loop_delay\"\n\
                   dist = { kind = \"beta\", a = 1, b = 2, min = \"4 ms\", max = \"24 ms\" }\n";
    let c = campaign(400, &format!("[sampling]\nmethod = \"lhs\"\n{entries}"));
    // Distribution functions in closed form.
    let shares: [(&str, &dyn Fn(f64) -> f64); 4] = [
        ("target_mass", &|m| 1.0 - ((500.0 - m) / 200.0).powi(2)),
        ("contact_friction", &|f| ((f - 0.1) / 0.2).sqrt().asin() / std::f64::consts::FRAC_PI_2),
        ("contact_stiffness", &|k| 1.0 - (-((k - 1e4) / 1e4).powi(2)).exp()),
        ("loop_delay", &|d| 1.0 - (1.0 - (d - 4e-3) / 20e-3).powi(2)),
    ];
    for (name, share) in shares {
        let mut strata: Vec<i64> = drawn(&c, name).iter().map(|x| (400.0 * share(*x)).floor() as i64).collect();
        strata.sort_unstable();
        assert!(strata.iter().enumerate().all(|(at, stratum)| (stratum - at as i64).abs() <= 1), "{name}");
    }
    let text = histograms(&c, 400).expect("no keys");
    ["triangular", "arcsine", "weibull", "beta"].iter().for_each(|kind| assert!(text.contains(kind), "{text}"));
}

#[test]
fn rank_correlation_is_as_stated_and_leaves_the_margins() {
    let free = campaign(20_000, &format!("{STIFFNESS}{MASS}{FRICTION}"));
    let group =
        "[[correlation]]\ntargets = [\"contact_stiffness\", \"target_mass\"]\nmatrix = [[1, -0.7], [-0.7, 1]]\n";
    let tied = campaign(20_000, &format!("{STIFFNESS}{MASS}{FRICTION}{group}"));
    let (k, m) = (drawn(&tied, "contact_stiffness"), drawn(&tied, "target_mass"));
    let spearman = correlation(&ranks(&k), &ranks(&m));
    assert!((spearman + 0.7).abs() < 0.015, "{spearman}");
    assert!((mean(&m) - 400.0).abs() < 2.0 && m.iter().all(|mass| (300.0..=500.0).contains(mass)));
    // The first of the group and everything outside it stay as they were, but for the last digits of the copula.
    let before = drawn(&free, "contact_stiffness");
    assert!(k.iter().zip(&before).all(|(a, b)| (a / b - 1.0).abs() < 1e-9));
    assert_eq!(drawn(&tied, "contact_friction"), drawn(&free, "contact_friction"));
}

#[test]
fn adding_a_dispersion_moves_no_other_draw() {
    let alone = campaign(100, MASS);
    let with_others = campaign(100, &format!("{FRICTION}{MASS}{STIFFNESS}"));
    assert_eq!(drawn(&alone, "target_mass"), drawn(&with_others, "target_mass"));
    let longer = campaign(1000, MASS);
    assert_eq!(drawn(&alone, "target_mass"), drawn(&longer, "target_mass")[..100], "nor does adding runs");
}

/// Pinned: a change of these numbers breaks the promise that a run is campaign, seed and run number.
#[test]
fn known_answers_of_draws() {
    let c = campaign(100, &format!("{MASS}{STIFFNESS}"));
    let uniform = softdock_kernels::philox::uniform(42, "target_mass", 7, 0);
    assert_eq!(c.draw(7).expect("a draw").params.target_mass, 300.0 + 200.0 * uniform);
    let pinned: Vec<f64> = [0, 1, 99].iter().map(|run| c.draw(*run).expect("a draw").params.target_mass).collect();
    assert_eq!(pinned, PINNED);
    assert_eq!(c.draw(3).expect("a draw"), c.draw(3).expect("a draw"));
}

const PINNED: [f64; 3] = [490.28550611666526, 422.41043951585226, 401.8079059914785];

#[test]
fn derived_values_follow_in_any_order() {
    let c = campaign(
        50,
        &format!(
            "{STIFFNESS}{FRICTION}[[derived]]\ntarget = \"bristle_damping\"\nexpr = \"bristle_stiffness / 1e3\"\n\
             [[derived]]\ntarget = \"bristle_stiffness\"\nexpr = \"2/3 * contact_stiffness\"\n"
        ),
    );
    for run in 0..50 {
        let p = c.draw(run).expect("a draw").params;
        assert_eq!(p.bristle_stiffness, 2.0 / 3.0 * p.contact_stiffness);
        assert_eq!(p.bristle_damping, p.bristle_stiffness / 1e3);
    }
    assert_eq!(c.nominal().bristle_stiffness, 2.0 / 3.0 * 1e5);
}

#[test]
fn epistemic_values_hold_for_a_block_of_runs() {
    let class = "class = \"epistemic\"\n";
    let c = campaign(100, &format!("{FRICTION}{class}{MASS}[outer]\ndraws = 4\n"));
    let friction = drawn(&c, "contact_friction");
    for run in 0..100_u64 {
        assert_eq!(u64::from(c.draw(run).expect("a draw").outer), run / 25);
        assert_eq!(friction[run as usize], friction[run as usize / 25 * 25]);
    }
    let mut blocks: Vec<f64> = friction.iter().step_by(25).copied().collect();
    blocks.dedup();
    assert_eq!(blocks.len(), 4);
    let mass = drawn(&c, "target_mass");
    assert!(mass[0] != mass[1], "aleatory values still vary");
}

/// Every one of n equal strata is met once.
#[test]
fn latin_hypercubes_fill_their_strata() {
    let c = campaign(200, &format!("[sampling]\nmethod = \"lhs\"\n{MASS}{FRICTION}"));
    assert_eq!(c.method, Method::LatinHypercube);
    let mass = drawn(&c, "target_mass");
    let mut strata: Vec<u64> = mass.iter().map(|mass| (mass - 300.0).floor() as u64).collect();
    assert!(correlation(&mass, &drawn(&c, "contact_friction")).abs() < 0.3, "the columns are shuffled apart");
    strata.sort_unstable();
    assert!(strata.iter().enumerate().all(|(index, stratum)| *stratum == index as u64));
}

/// Every one of n equal strata is met once by each input, and every cell of a square grid once by each pair.
#[test]
fn sobol_sequences_fill_all_inputs_together() {
    let entries = format!("[sampling]\nmethod = \"sobol\"\n{MASS}{STIFFNESS}");
    let c = campaign(256, &entries);
    assert_eq!(c.method, Method::Sobol);
    let (mass, stiffness) = (drawn(&c, "target_mass"), drawn(&c, "contact_stiffness"));
    let shares: Vec<(f64, f64)> =
        mass.iter().zip(&stiffness).map(|(m, k)| ((m - 300.0) / 200.0, (k / 1e4).ln() / 100_f64.ln())).collect();
    let once = |cells: &dyn Fn(&(f64, f64)) -> usize| {
        let mut met: Vec<usize> = shares.iter().map(cells).collect();
        met.sort_unstable();
        met.into_iter().eq(0..256)
    };
    assert!(once(&|(m, _)| (m * 256.0) as usize) && once(&|(_, k)| (k * 256.0) as usize), "strata");
    assert!(once(&|(m, k)| (m * 16.0) as usize * 16 + (k * 16.0) as usize), "cells");
    assert!(shares.iter().all(|(m, k)| *m > 0.0 && *k > 0.0 && *m < 1.0 && *k < 1.0));
    // A run is campaign, seed and run number: more runs or one more dispersion behind move none.
    let longer = campaign(1000, &format!("{entries}{FRICTION}"));
    assert_eq!(drawn(&longer, "target_mass")[..256], mass);
    let mut other = c.clone();
    other.seed = 43;
    assert_ne!(drawn(&other, "target_mass"), mass, "the seed scrambles");
}

#[test]
fn tables_are_drawn_as_measured() {
    let c = campaign(
        3000,
        "[[dispersion]]\ntarget = \"loop_delay\"\n\
         dist = { kind = \"table\", file = \"delays.csv\", column = \"delay_ms\", unit = \"ms\" }\n",
    );
    let delays = drawn(&c, "loop_delay");
    for value in [0.004, 0.008, 0.04] {
        let share = delays.iter().filter(|delay| **delay == value).count();
        assert!((880..1120).contains(&share), "{value}: {share}");
    }
}

#[test]
fn settings_and_requirements_are_read() {
    let c = campaign(
        10,
        "[execution]\nbackend = \"cpu\"\nparity = \"2 %\"\n[[requirement]]\nid = \"A-1\"\ntext = \"t\"\nsubject = \"space\"\n\
         metric = \"peak_contact_force\"\nat_most = \"0.5 kN\"\nprobability = \"99.73 %\"\nconfidence = 0.9\n\
         [traces]\nrate = \"250 Hz\"\nkeep = [\"nominal\", \"worst:20\"]\n",
    );
    assert_eq!((c.execution.parity, c.execution.shard_runs), (0.02, 1000));
    let r = &c.requirements[0];
    assert_eq!((r.limits.at_most, r.limits.at_least, r.unit()), (Some(500.0), None, "N"));
    assert_eq!((r.probability, r.confidence), (0.9973, 0.9));
    assert_eq!((c.traces.every_ticks, &c.traces.keep[..]), (4, &[Keep::Nominal, Keep::Worst(20)][..]));
}

#[test]
fn contact_events_are_kept_of_the_runs_that_the_table_names() {
    let c = campaign(10, "[contact_events]\nkeep = [\"all\", \"worst:3\"]\nmerge_gap = \"2 ms\"\n");
    assert_eq!(c.contact_events, ContactEventPlan { merge_gap: 2e-3, keep: vec![Keep::All, Keep::Worst(3)] });
    assert_eq!(campaign(10, "").contact_events, ContactEventPlan::default());
}

#[test]
fn what_touches_has_its_key_and_its_name() {
    let names = ContactNames::of(&shipped("berth.toml").scenario);
    let cube = names.member(Side::A, PointSource::Solid(0));
    assert_eq!(cube, ["part_a.solid[1]", "cube"]);
    assert_eq!(names.member(Side::B, PointSource::Solid(3)), ["part_b.solid[4]", "bumper"]);
    let unnamed = ContactNames::of(&shipped("smoke.toml").scenario);
    assert_eq!(unnamed.member(Side::A, PointSource::Point(1)), ["part_a.point[2]", ""]);
    assert_eq!([pair_key(None), pair_key(Some(1))], ["contact", "contact.pair[2]"]);
}

#[test]
fn a_campaign_knows_the_files_that_it_was_read_from() {
    let names = |c: &Campaign| -> Vec<String> {
        c.files().iter().map(|file| file.file_name().expect("a file").to_string_lossy().into_owned()).collect()
    };
    let all = ["probe_drogue.toml", "probe_drogue.toml", "ets_vii_arm.urdf", "reference.toml", "kr300_r2500.toml"];
    assert_eq!(names(&shipped("probe_drogue.toml")), all);
    let table = "[[dispersion]]\ntarget = \"loop_delay\"\n\
                 dist = { kind = \"table\", file = \"delays.csv\", column = \"delay_ms\", unit = \"ms\" }\n";
    assert_eq!(names(&campaign(10, table)), ["c.toml", "s.toml", "delays.csv"]);
}

#[test]
fn half_the_substep_leaves_the_periods() {
    let c = shipped("smoke.toml");
    let (whole, half) = (c.scenario.model.clone(), c.at_half_step().scenario.model);
    assert_eq!((half.timing.substep, half.timing.tick()), (0.5 * whole.timing.substep, whole.timing.tick()));
    let period = |m: &softdock_kernels::model::Model| m.timing.substep * f64::from(m.facility.sensor_substeps);
    assert_eq!(period(&half), period(&whole));
    assert_eq!(c.half_step_runs(), 16, "a quarter, as parity");
    assert_eq!(campaign(100_000, MASS).half_step_runs(), 200, "unasked, a few");
    assert_eq!(campaign(100_000, "[execution]\nhalf_step = \"1 %\"\n").half_step_runs(), 1000);
    assert_eq!(campaign(100_000, "[execution]\nhalf_step = 0\n").half_step_runs(), 0);
}

#[test]
fn the_hash_covers_every_text() {
    let (one, two) = (campaign(10, MASS), campaign(11, MASS));
    assert_ne!(one.hash, two.hash);
    assert_eq!(one.hash, campaign(10, MASS).hash);
    assert_ne!(one.scenario.text(), one.text);
}

#[test]
fn schemas_describe_every_key() {
    for (kind, keys) in [
        ("campaign", &["dispersion", "shard_runs", "at_most", "epistemic"][..]),
        ("scenario", &["closing_speed", "robot1_share", "max_depth"][..]),
    ] {
        let schema = SCHEMA_KINDS.iter().find(|own| own.word == kind).expect("a kind").text();
        let value: serde_json::Value = serde_json::from_str(&schema).expect("JSON");
        assert_eq!(value["additionalProperties"], false, "unknown keys are errors in the editor too");
        for key in keys {
            assert!(schema.contains(key), "{key}");
        }
    }
}

/// A shipped campaign on its own scenario with an effect that a diagnosis found.
fn extended(name: &str, effect: &str) -> Result<Campaign, crate::Problems> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (text, beside) = shipped(name).scenario.gathered();
    for (name, text) in beside {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let model = folder.path().join("extended.toml");
    std::fs::write(&model, format!("{text}\n{effect}")).expect("written");
    Campaign::load_with(&campaigns().join(name), Some(&model))
}

const DELAY: &str = "[[effect]]\nid = \"C1_transport_delay\"\ncovariance = [[1e-6]]\n\
                     [effect.parameters]\nloop_delay = \"9 ms\"\n";

#[test]
fn what_a_diagnosis_found_stands_before_what_a_campaign_draws() {
    let found = extended("probe_drogue.toml", DELAY).expect("a legal model").with_sample(4000, 1);
    assert!(drawn(&found, "loop_delay").iter().all(|delay| *delay == 9e-3));
    assert_ne!(found.hash, shipped("probe_drogue.toml").hash, "another facility is another campaign");
    let delays = drawn(&found.clone().over_posterior(400), "loop_delay");
    let middle = mean(&delays);
    let sd = mean(&delays.iter().map(|delay| (delay - middle).powi(2)).collect::<Vec<_>>()).sqrt();
    assert!((middle - 9e-3).abs() < 2e-4 && (sd - 1e-3).abs() < 1e-4, "{middle} {sd}");
    assert!(delays.chunks(10).all(|draw| draw.iter().all(|delay| *delay == draw[0])), "one value an outer draw");
    let others = drawn(&found, "target_mass");
    assert_eq!(others, drawn(&shipped("probe_drogue.toml").with_sample(4000, 1), "target_mass"), "no other draw moves");
}

#[test]
fn a_found_effect_that_cannot_be_is_refused() {
    let refused = |effect: &str| extended("probe_drogue.toml", effect).expect_err("something is wrong").to_string();
    for (old, new, reason) in [
        ("C1_transport_delay", "C1_delay", "there is no effect `C1_delay`"),
        ("loop_delay", "loop_dely", "has no parameter `loop_dely`"),
        ("9 ms", "-9 ms", "out of range"),
        ("[[1e-6]]", "[[1e-6, 0.0], [0.0, 1e-6]]", "no covariance of the 1 parameters"),
        ("[[1e-6]]", "[[-1e-6]]", "no covariance of the 1 parameters"),
    ] {
        assert!(DELAY.contains(old));
        let said = refused(&DELAY.replace(old, new));
        assert!(said.contains(reason), "{new}\n{said}");
    }
}
