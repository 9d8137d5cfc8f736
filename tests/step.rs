//! `check` steps the model: overlap at the start, touch, forces, outcomes, expected wall time, scene.

use crate::cli::{Bench, text};
use serde_json::Value;
use softdock_engine::{Job, RunInput, cpu};
use softdock_kernels::metrics::flags;
use softdock_kernels::plant::Plant;
use softdock_results::traces::NOMINAL_RUN;
use std::fs;

/// Rewrites a part of the scenario file.
fn edit_scenario(bench: &Bench, old: &str, new: &str) {
    let path = bench.path("c/scenarios/smoke.toml");
    let scenario = fs::read_to_string(&path).expect("the scenario");
    assert!(scenario.contains(old), "`{old}`");
    fs::write(path, scenario.replace(old, new)).expect("written");
}

fn stepped(bench: &Bench, words: &str) -> Value {
    let words = format!("check c/smoke.toml --json {words}");
    let answer: Value = serde_json::from_str(&bench.expect(0, words.trim_end())).expect("JSON");
    answer["stepped"].clone()
}

fn is_near(value: f64, expected: f64) -> bool {
    (value - expected).abs() <= 1e-12 * expected.abs()
}

/// A message without the line breaks of the terminal.
fn flowing(bytes: &[u8]) -> String {
    let signs = |c: char| c.is_whitespace() || c == '│';
    text(bytes).split(signs).filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" ")
}

/// A face 70 mm before the drogue's bottom is 110 mm deep in the probe's head: every run would be invalid.
#[test]
fn overlap_beyond_the_penetration_limit_is_rejected() {
    let bench = Bench::new();
    // The head's front is at x = 15 mm, and the face at x = -95 mm.
    let solid = "[[part_b.solid]]\nshape = \"plane\"\nposition = [\"-95 mm\", \"0 mm\", \"0 mm\"]\n\n[contact]";
    edit_scenario(&bench, "[contact]", solid);
    for words in ["check c/smoke.toml", "run c/smoke.toml --backend cpu --out refused"] {
        let output = bench.softdock(words);
        let printed = flowing(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words}: {printed}");
        for part in [
            "`part_a.point[1]` overlaps `part_b.solid[2]` by 110 mm",
            "start.gap",
            "30 mm",
            "write gap = \"120 mm\" or more",
        ] {
            assert!(printed.contains(part), "`{part}` of {words} in\n{printed}");
        }
    }
    assert!(!bench.path("refused").exists(), "nothing is written");
    // The proposed gap removes the overlap.
    edit_scenario(&bench, "gap = \"10 mm\"", "gap = \"120 mm\"");
    let start = &stepped(&bench, "")["facilities"][0]["start"];
    assert!(start["depth_m"].as_f64().expect("a depth").abs() < 1e-9, "{start}");
}

#[test]
fn a_task_may_start_in_contact_and_check_reports_the_overlap() {
    let bench = Bench::new();
    let solid = "[[part_b.solid]]\nshape = \"plane\"\nposition = [\"12 mm\", \"0 mm\", \"0 mm\"]\n\n[contact]";
    edit_scenario(&bench, "[contact]", solid);
    let printed = bench.expect(0, "check c/smoke.toml --step 20");
    let part =
        "the parts overlap: part_a.point[1] in part_b.solid[2] by 3 mm (more than task.max_depth, 30 mm, is refused)";
    assert!(printed.contains(part), "{printed}");
    let draws = &stepped(&bench, "--step 20")["facilities"][0]["draws"];
    // The offset along the approach has a standard deviation of 1 mm.
    assert!(draws["overlapping_starts"].as_u64().expect("a count") >= 18, "{draws}");
    let deepest = &draws["deepest_start"];
    assert!((1e-3..8e-3).contains(&deepest["depth_m"].as_f64().expect("a depth")), "{deepest}");
    assert_eq!(
        (&deepest["point"], &deepest["solid"]),
        (&Value::from("part_a.point[1]"), &Value::from("part_b.solid[2]"))
    );
    assert!(deepest["run"].as_u64().expect("a run") < 64);
}

#[test]
fn check_reports_the_nominal_run_of_the_engine() {
    let bench = Bench::new();
    let printed = bench.expect(0, "check c/smoke.toml");
    for part in [
        "first touch",
        "part_a.point[1] on part_b.solid[1]",
        "peak contact force",
        "peak latch force",
        "peak interface force",
        "capture",
        "outcome",
        "expected wall time",
        "on cpu f64",
        "extrapolated from",
    ] {
        assert!(printed.contains(part), "`{part}` in\n{printed}");
    }
    let campaign = softdock_campaign::load(&bench.path("c/smoke.toml")).expect("the campaign");
    let plant = Plant::new(campaign.scenario.model.clone()).with_effects(campaign.effects());
    let job = Job::new(plant, campaign.seed, true);
    let run = cpu::replay(&job, RunInput::new(NOMINAL_RUN, campaign.nominal()), &mut |_| {});
    assert_eq!(run.flags & flags::INVALID, 0);
    let nominal = &stepped(&bench, "")["facilities"][0]["nominal"];
    for (name, metrics) in [("space", &run.space), ("facility", &run.hil)] {
        let row = &nominal[name];
        for (key, value) in [
            ("touch_time_s", metrics.touch_time),
            ("peak_contact_force_n", metrics.peak_contact_force),
            ("peak_contact_force_time_s", metrics.peak_contact_force_time),
            ("peak_latch_force_n", metrics.peak_latch_force),
            ("peak_interface_force_n", metrics.peak_interface_force),
            ("capture_time_s", metrics.capture_time),
            ("end_time_s", metrics.end_time),
        ] {
            // The parser of JSON rounds the last digit.
            assert!(is_near(row[key].as_f64().expect("a number"), value), "{key} {name}: {row}");
        }
        assert_eq!(row["outcome"], "pass");
        // The head rests on the drogue's bottom, 80 mm deep on the axis.
        let touch = &row["touch"];
        assert_eq!(
            (&touch["point"], &touch["solid"]),
            (&Value::from("part_a.point[1]"), &Value::from("part_b.solid[1]"))
        );
        assert!((touch["place_in_b_m"][0].as_f64().expect("a place") - 0.08).abs() < 1e-3, "{touch}");
    }
}

#[test]
fn an_invalid_nominal_run_is_reported_with_its_flag() {
    let bench = Bench::new();
    edit_scenario(&bench, "max_depth = \"30 mm\"", "max_depth = \"0.01 mm\"");
    let printed = bench.expect(0, "check c/smoke.toml");
    assert!(
        printed.contains("invalid by the flag space_penetration: the space loop passed the penetration limit"),
        "{printed}"
    );
    assert!(printed.contains("with task.max_depth 0.01 mm"), "{printed}");
    assert_eq!(stepped(&bench, "")["facilities"][0]["nominal"]["invalid_flags"][0], "space_penetration");
}

#[test]
fn counts_of_stepped_draws_add_up_and_are_those_of_the_run() {
    let bench = Bench::new();
    bench.edit("parity = \"25 %\"", "backend = \"cpu\"\nparity = \"0 %\"");
    let answer = stepped(&bench, "--step 10");
    assert_eq!(answer["is_asked"], true);
    let facility = &answer["facilities"][0];
    let counts = |draws: &Value, side: &str| -> Vec<u64> {
        let outcomes = &draws[side]["outcomes"];
        ["pass", "fail", "aborted", "invalid"].map(|word| outcomes[word].as_u64().expect("a count")).to_vec()
    };
    for side in ["space", "facility"] {
        assert_eq!(counts(&facility["draws"], side).iter().sum::<u64>(), 10);
        let failed: u64 = facility["draws"][side]["causes"]
            .as_array()
            .expect("causes")
            .iter()
            .filter_map(|cause| cause["runs"].as_u64())
            .sum();
        assert_eq!(failed, 10 - counts(&facility["draws"], side)[0], "every loop that does not pass has a cause");
        let range = &facility["draws"][side]["ranges"]["peak_contact_force_n"];
        let [min, median, max] = ["min", "median", "max"].map(|end| range[end].as_f64().expect("a force"));
        assert!(0.0 <= min && min <= median && median <= max, "{range}");
    }
    let time = &facility["wall_time"];
    let sum: f64 =
        ["runs_s", "repetitions_s", "traces_s", "contact_events_s"].iter().filter_map(|part| time[part].as_f64()).sum();
    assert!((sum - time["expected_s"].as_f64().expect("a time")).abs() < 1e-9 && sum > 0.0, "{time}");
    assert_eq!(answer["expected_wall_time_s"], time["expected_s"]);
    // More draws than the campaign has: all of its runs, as `run` makes them.
    let all = &stepped(&bench, "--step 1000")["facilities"][0]["draws"];
    bench.softdock("run c/smoke.toml --out r");
    let summary: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("r/summary.json")).expect("it")).expect("JSON");
    assert_eq!(all["count"], 64);
    let runs_of = |side: &str| -> u64 {
        let causes = summary["causes"][side].as_array().expect("causes");
        causes.iter().filter_map(|cause| cause["runs"].as_u64()).sum()
    };
    for side in ["space", "facility"] {
        assert_eq!(64 - counts(all, side)[0], runs_of(side), "{side}");
    }
}

#[test]
fn every_variant_is_stepped_on_the_same_space() {
    let bench = Bench::new();
    bench.edit("[traces]", "[[variant]]\nname = \"slow\"\nset = { \"facility.loop_delay\" = \"30 ms\" }\n[[variant]]\nname = \"own\"\n[traces]");
    let answer = stepped(&bench, "");
    let [slow, own] = [0, 1].map(|index| &answer["facilities"][index]);
    assert_eq!((&slow["variant"], &own["variant"]), (&Value::from("slow"), &Value::from("own")));
    assert_eq!(slow["nominal"]["space"], own["nominal"]["space"]);
    assert_ne!(slow["nominal"]["facility"], own["nominal"]["facility"]);
    let sum: f64 = [slow, own].iter().filter_map(|one| one["wall_time"]["expected_s"].as_f64()).sum();
    assert!(is_near(answer["expected_wall_time_s"].as_f64().expect("a time"), sum), "{answer}");
    assert!(bench.expect(0, "check c/smoke.toml").contains("variant slow"));
}

#[test]
fn the_scene_is_a_well_formed_file_with_every_contact_point() {
    let bench = Bench::new();
    bench.expect(0, "check c/smoke.toml --scene start.svg");
    let svg = fs::read_to_string(bench.path("start.svg")).expect("the scene");
    let mut open: Vec<&str> = Vec::new();
    for tag in
        svg.split('<').skip(1).map(|rest| rest.split('>').next().expect("a tag")).filter(|tag| !tag.starts_with('?'))
    {
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().expect("a name");
        match (tag.starts_with('/'), tag.ends_with('/')) {
            (true, _) => assert_eq!(open.pop(), Some(name)),
            (false, true) => assert_eq!(tag.matches('"').count() % 2, 0, "{tag}"),
            (false, false) => open.push(name),
        }
    }
    assert!(open.is_empty() && svg.contains("xmlns=\"http://www.w3.org/2000/svg\""), "{open:?}");
    for view in ["side view", "top view", "the two parts"] {
        assert!(svg.contains(view), "{view}");
    }
    for point in ["class=\"A1\"", "class=\"A2\""] {
        assert_eq!(svg.matches(point).count(), 3, "{point} in each view");
    }
    assert!(svg.contains("<title>smoke: A short docking") && svg.contains("x [m]") && !svg.contains("NaN"));
    bench.expect(2, "check c/smoke.toml --scene c/smoke.toml/start.svg");
}
