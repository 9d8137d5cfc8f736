//! Contacts of known laws, simulated by an integrator of the test's own: each parameter is found, or reported as not determined.

use softdock_analysis::PageOrigin;
use softdock_campaign::Rig;
use softdock_identify::contact::estimate::{ContactDetermination, ContactEstimate};
use softdock_identify::contact::identification::{
    ContactIdentification, ContactOptions, FoundContact, identify_contact,
};
use softdock_identify::contact::law::FittedLaw;
use softdock_identify::contact::report::contact_files;
use softdock_kernels::philox::uniform;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A law of the test: force over depth and its rate, given the speed of approach.
type Force = dyn Fn(f64, f64, f64) -> f64;

fn origin(command: &str) -> PageOrigin<'_> {
    PageOrigin { version: "0", commit: "unknown", command }
}

/// Sampling period \[s\].
const STEP: f64 = 1e-4;
/// Integration steps in it.
const FINER: usize = 20;

/// Depth and force of a mass that strikes at some speed and flies back, or is pressed by a slow force: classical Runge-Kutta.
fn impact(force: &Force, mass: f64, speed: f64, seconds: f64) -> Vec<[f64; 2]> {
    let law = |[x, v]: [f64; 2]| if x > 0.0 { force(x, v, speed).max(0.0) } else { 0.0 };
    let slope = |state: [f64; 2]| [state[1], -law(state) / mass];
    let mut state = [-0.01 * speed, speed];
    let mut rows = Vec::new();
    let h = STEP / FINER as f64;
    for step in 0..(seconds / h) as usize {
        if step % FINER == 0 {
            rows.push([state[0], law(state)]);
        }
        let at = |k: [f64; 2], share: f64| [state[0] + share * h * k[0], state[1] + share * h * k[1]];
        let k1 = slope(state);
        let k2 = slope(at(k1, 0.5));
        let k3 = slope(at(k2, 0.5));
        let k4 = slope(at(k3, 1.0));
        for i in 0..2 {
            state[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    rows
}

/// Depth and force of a press along a given way.
fn press(force: &Force, depth: f64, seconds: f64) -> Vec<[f64; 2]> {
    let rate = TAU / seconds;
    let row = |i: usize| {
        let phase = rate * i as f64 * STEP;
        let (x, v) = (depth * (0.45 - 0.55 * phase.cos()), 0.55 * depth * rate * phase.sin());
        [x, if x > 0.0 { force(x, v, 0.55 * depth * rate).max(0.0) } else { 0.0 }]
    };
    (0..(seconds / STEP) as usize).map(row).collect()
}

/// A normal deviate (Box and Muller).
fn normal(name: &str, index: usize) -> f64 {
    let [u, v] = [0, 1].map(|part| uniform(9, name, index as u64, part));
    (-2.0 * u.ln()).sqrt() * (TAU * v).cos()
}

/// Writes recordings with noise of depth \[m\] and force \[N\], and an unknown tare.
fn write(folder: &Path, name: &str, rows: &[[f64; 2]], noise: [f64; 2]) -> PathBuf {
    let mut text = "t_s,depth_mm,force_n\n".to_owned();
    for (i, [depth, force]) in rows.iter().enumerate() {
        let depth = 1e3 * (depth + noise[0] * normal(&format!("{name} depth"), i));
        let force = force + 0.7 + noise[1] * normal(&format!("{name} force"), i);
        writeln!(text, "{:.5},{depth:.7},{force:.5}", i as f64 * STEP).expect("a text");
    }
    let path = folder.join(format!("{name}.csv"));
    std::fs::write(&path, text).expect("written");
    path
}

fn rig() -> Rig {
    Rig::load(&crate::root().join("campaigns/rigs/plate_press.toml")).expect("the shipped rig")
}

fn identified(logs: &[PathBuf], law: Option<FittedLaw>) -> ContactIdentification {
    let logs: Vec<&Path> = logs.iter().map(PathBuf::as_path).collect();
    let options = ContactOptions { hold_out: 0.25, law, seed: 1 };
    identify_contact(&rig(), &logs, &options).expect("an answer")
}

fn estimate<'a>(found: &'a ContactIdentification, key: &str) -> &'a ContactEstimate {
    found.estimates().iter().find(|estimate| estimate.key == key).expect("an estimate")
}

/// Asserts that a parameter is determined, its interval covers the truth and its value is within a share of it.
fn assert_found(found: &ContactIdentification, key: &str, truth: f64, share: f64) {
    let estimate = estimate(found, key);
    assert_eq!(estimate.determination, ContactDetermination::Determined, "{key}: {estimate:?}");
    let (value, [low, high]) = (estimate.value.expect("a value"), estimate.interval.expect("an interval"));
    assert!((value / truth - 1.0).abs() < share, "{key}: {value}, true {truth}");
    assert!((low..=high).contains(&truth), "{key}: {low} to {high}, true {truth}");
}

fn assert_open(found: &ContactIdentification, key: &str) {
    let estimate = estimate(found, key);
    assert!(estimate.value.is_none() && !estimate.reason.is_empty(), "{key} is not determined: {estimate:?}");
    let block = contact_files(found, &origin("command")).expect("files").files;
    let text = &block[0].text;
    let has_number = text.lines().any(|line| line.starts_with(key) && !line.contains("fill in"));
    assert!(!has_number, "{key} has no number in the table:\n{text}");
}

const SPEEDS: [f64; 8] = [0.1, 0.14, 0.2, 0.25, 0.3, 0.35, 0.42, 0.5];

/// Impacts at the given speeds on a law, one recording each.
fn impacts(folder: &Path, force: &Force, speeds: &[f64], noise: [f64; 2]) -> Vec<PathBuf> {
    let one = |(number, speed): (usize, &f64)| {
        write(folder, &format!("impact{number}"), &impact(force, 2.0, *speed, 0.06), noise)
    };
    speeds.iter().enumerate().map(one).collect()
}

#[test]
fn hunt_crossley_impacts_give_stiffness_exponent_and_dissipation() {
    let folder = tempfile::tempdir().expect("a folder");
    let (k, n, a) = (4e7, 1.5, 0.6);
    let law = move |x: f64, v: f64, _: f64| k * x.powf(n) * (1.0 + a * v);
    let mut logs = impacts(folder.path(), &law, &SPEEDS, [2e-7, 1.0]);
    logs.push(write(folder.path(), "press", &press(&law, 5e-4, 0.5), [2e-7, 1.0]));
    let found = identified(&logs, None);
    assert_eq!(found.law(), "power");
    assert_found(&found, "stiffness", k, 0.1);
    assert_found(&found, "exponent", n, 0.01);
    assert_found(&found, "dissipation", a, 0.05);
    // Nothing moves along the plate.
    ["friction", "bristle_stiffness", "bristle_damping"].iter().for_each(|key| assert_open(&found, key));
    let FoundContact::Touches(own) = &found.found else { panic!("touches") };
    let held = own.predicted(true);
    assert!(held.len() >= 2 && held.iter().all(|touch| touch.error() < 0.02), "held out touches are predicted");
    assert!(own.rivals().is_empty(), "eight speeds distinguish the laws");
}

#[test]
fn spring_and_damper_are_found_and_preferred() {
    let folder = tempfile::tempdir().expect("a folder");
    let (k, b) = (2e5, 150.0);
    let law = move |x: f64, v: f64, _: f64| k * x + b * v;
    let logs = impacts(folder.path(), &law, &SPEEDS[..6], [2e-7, 0.5]);
    let found = identified(&logs, None);
    assert_eq!(found.law(), "linear");
    assert_found(&found, "stiffness", k, 0.03);
    assert_found(&found, "damping", b, 0.08);
}

#[test]
fn restitution_that_is_the_same_at_every_speed_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let (k, n, d) = (1e6, 1.2, 0.8);
    let law = move |x: f64, v: f64, speed: f64| k * x.powf(n) * (1.0 + d * v / speed);
    let logs = impacts(folder.path(), &law, &SPEEDS, [2e-7, 0.5]);
    // The restitution of this law by the integrator itself, not by a formula.
    let rows = impact(&law, 2.0, 0.2, 0.2);
    let restitution = (rows[rows.len() - 2][0] - rows[rows.len() - 1][0]) / STEP / 0.2;
    let found = identified(&logs, None);
    assert_eq!(found.law(), "rebound");
    assert_found(&found, "restitution", restitution, 0.03);
    assert_found(&found, "exponent", n, 0.02);
}

#[test]
fn damping_is_not_determined_by_slow_presses() {
    let folder = tempfile::tempdir().expect("a folder");
    let law = |x: f64, v: f64, _: f64| 2e5 * x + 5.0 * v;
    let one = |number: usize| {
        write(folder.path(), &format!("press{number}"), &press(&law, 1e-3 + 1e-4 * number as f64, 2.0), [5e-7, 1.0])
    };
    let found = identified(&(0..4).map(one).collect::<Vec<_>>(), Some(FittedLaw::Linear));
    assert_found(&found, "stiffness", 2e5, 0.01);
    assert_open(&found, "damping");
}

#[test]
fn the_table_is_read_by_a_scenario() {
    let folder = tempfile::tempdir().expect("a folder");
    let law = |x: f64, v: f64, _: f64| 4e7 * x.powf(1.5) * (1.0 + 0.6 * v);
    let found = identified(&impacts(folder.path(), &law, &SPEEDS, [2e-7, 1.0]), Some(FittedLaw::Power));
    let files = contact_files(&found, &origin("softdock identify contact")).expect("files").files;
    let block = &files[0].text;
    assert_eq!(files[0].name, "contact.toml");
    let bad = crate::root().join("tests/data/bad");
    std::fs::copy(bad.join("arm.urdf"), folder.path().join("arm.urdf")).expect("copied");
    let scenario = std::fs::read_to_string(bad.join("scenario.toml")).expect("a scenario");
    let start = scenario.find("[contact]").expect("a table");
    let end = scenario[start + 1..].find("\n[").map_or(scenario.len(), |end| start + 1 + end);
    let replaced = format!("{}{block}{}", &scenario[..start], &scenario[end..]);
    // Such a stiff contact needs a short substep, as the reader of a scenario states.
    let replaced = replaced.replace("substep = \"0.25 ms\"", "substep = \"0.02 ms\"");
    std::fs::write(folder.path().join("scenario.toml"), replaced).expect("written");
    let scenario = softdock_campaign::Scenario::load(&folder.path().join("scenario.toml"))
        .unwrap_or_else(|problems| panic!("{problems}\n{block}"));
    let stiffness = scenario.model.nominal.contact_stiffness;
    assert!((stiffness / 4e7 - 1.0).abs() < 0.1, "{stiffness}\n{block}");
}

/// Rows of a tip that is pressed and slid to and fro: time, lateral and normal position, its rate, lateral and normal force.
/// The tangential spring is bent by the slip and holds at most the friction (elastic, ideally plastic).
fn slides(friction: f64, bristle: f64, travel: f64) -> String {
    let mut text = "t_s,x_mm,z_mm,vz_mm_s,fx_n,fz_n\n".to_owned();
    let (mut bent, mut before) = (0.0, 0.0);
    for i in 0..20_000 {
        let t = i as f64 * STEP;
        let press = TAU * 1.0 * t;
        let (depth, rate) = (5e-4 * (0.4 - 0.6 * press.cos()), 5e-4 * 0.6 * TAU * press.sin());
        let x = travel * (TAU * 7.0 * t).sin();
        let force = if depth > 0.0 { (2e5 * depth + 100.0 * rate).max(0.0) } else { 0.0 };
        bent = if force > 0.0 { bent + x - before } else { 0.0 };
        let most: f64 = friction * force / bristle;
        bent = f64::clamp(bent, -most, most);
        before = x;
        let noise = |name: &str| 0.2 * normal(name, i);
        let cells = [1e3 * x, -1e3 * depth, -1e3 * rate, -bristle * bent + noise("fx"), force + noise("fz")];
        let cells: Vec<String> = cells.iter().map(|cell| format!("{cell:.6}")).collect();
        writeln!(text, "{t:.5},{}", cells.join(",")).expect("a text");
    }
    text
}

const SLIDING_RIG: &str = "schema = \"rig/1\"\nkind = \"contact\"\nid = \"slides\"\n[contact]\nstiffness = \"1e5 N/m\"\n[log]\n\
    \"t\" = { column = \"t_s\", unit = \"s\" }\n\"position.x\" = { column = \"x_mm\", unit = \"mm\" }\n\
    \"position.z\" = { column = \"z_mm\", unit = \"mm\" }\n\"rate.z\" = { column = \"vz_mm_s\", unit = \"mm/s\" }\n\
    \"force.x\" = { column = \"fx_n\", unit = \"N\" }\n\"force.z\" = { column = \"fz_n\", unit = \"N\" }\n";

/// Friction is found where the tip slides; where it only bends the bristles, their stiffness is found and friction is not.
#[test]
fn friction_is_found_where_the_tip_slides_and_only_there() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("rig.toml"), SLIDING_RIG).expect("written");
    let rig = Rig::load(&folder.path().join("rig.toml")).unwrap_or_else(|problems| panic!("{problems}"));
    let found = |name: &str, travel: f64| {
        let path = folder.path().join(name);
        std::fs::write(&path, slides(0.25, 1e5, travel)).expect("written");
        let options = ContactOptions { hold_out: 0.0, law: Some(FittedLaw::Linear), seed: 1 };
        identify_contact(&rig, &[&path], &options).expect("an answer")
    };
    let sliding = found("sliding.csv", 2e-3);
    assert_found(&sliding, "friction", 0.25, 0.02);
    assert_found(&sliding, "stiffness", 2e5, 0.02);
    assert_found(&sliding, "damping", 100.0, 0.1);
    let stuck = found("stuck.csv", 2e-6);
    assert_open(&stuck, "friction");
}

/// A force that grows on the way back, which no law does: the answer states that the model is inadequate.
#[test]
fn force_that_follows_no_law_is_reported_as_inadequate() {
    let folder = tempfile::tempdir().expect("a folder");
    let law = |x: f64, v: f64, _: f64| 2e5 * x * if v > 0.0 { 0.3 } else { 1.0 };
    let one = |number: usize| write(folder.path(), &format!("odd{number}"), &press(&law, 1e-3, 0.5), [1e-7, 0.5]);
    let found = identified(&(0..4).map(one).collect::<Vec<_>>(), None);
    assert!(found.inadequate().is_some_and(|error| error > 0.1));
    let files = contact_files(&found, &origin("command")).expect("files").files;
    assert!(files.iter().all(|file| file.text.contains("nadequate") || file.text.contains("\"adequate\": false")));
}

/// A position in the wrong direction is an error, not a negative stiffness.
#[test]
fn wrong_sign_of_the_position_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let law = |x: f64, _: f64, _: f64| 2e5 * x;
    let rows: Vec<[f64; 2]> = press(&law, 1e-3, 0.5).into_iter().map(|[x, f]| [-x, f]).collect();
    let log = write(folder.path(), "press", &rows, [1e-7, 0.5]);
    let options = ContactOptions { hold_out: 0.0, law: None, seed: 1 };
    let error = identify_contact(&rig(), &[&log], &options).err().expect("an error");
    assert!(error.to_string().contains("out of the plate") && error.remedy().contains("scale = -1"), "{error}");
}
