//! Settings in files: places, kinds of values, messages.

use super::*;
use crate::Campaign;
use std::path::Path;

fn settings(texts: &[&str]) -> Settings {
    Settings::new(texts.iter().map(|text| text.parse().expect("KEY=VALUE")).collect()).expect("distinct keys")
}

fn load(texts: &[&str]) -> Result<Campaign, Problems> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/probe_drogue.toml");
    Campaign::load_set(&file, None, &settings(texts))
}

#[test]
fn a_set_value_counts_as_written() {
    let plain = load(&[]).expect("the shipped campaign");
    let set = load(&[
        "runs=200",
        "title=a title",
        "execution.backend=cpu",
        "dispersion[loop_delay].dist.max=25 ms",
        "scenario.contact.friction=0.25",
        "station.safety.force=900 N",
    ]);
    let set = set.expect("legal values");
    assert_eq!((set.runs, set.title.as_str()), (200, "a title"));
    assert_eq!(set.execution.backend, crate::campaign::Backend::Cpu);
    assert_eq!(set.scenario.model.nominal.contact_friction, 0.25);
    assert_ne!(set.hash, plain.hash);
    let lines = ["# --set \"runs=200\"", "# --set \"title=a title\""];
    assert!(lines.iter().all(|line| set.text.contains(line)), "{}", set.text);
    let edited = set.files().iter().filter(|file| set.edited_text(file).is_some()).count();
    assert_eq!(edited, 3, "campaign, scenario, facility");
    assert!(plain.files().iter().all(|file| plain.edited_text(file).is_none()));
}

#[test]
fn a_problem_with_a_set_value_names_the_setting() {
    for (text, message, remedy) in [
        ("runs=0", "out of range", ""),
        ("rums=3", "there is no key `rums`", "did you mean `runs`?"),
        ("friction=3", "there is no key `friction`", "begin with `scenario.`"),
        ("exection.backend=cpu", "there is no key `exection`", "did you mean `execution`?"),
        ("scenario.contact.friction=3 kg", "not a pure number", ""),
        ("scenario.contact.frction=3", "there is no key `frction`", "`friction`"),
        ("dispersion[loop_dely].dist.max=3 ms", "no item has the name", "did you mean `loop_delay`?"),
        ("dispersion[99].class=epistemic", "there is no item 99", "from 1 to"),
        ("runs.x=1", "has no keys", "end the path"),
        ("station.safety.forc=3 N", "there is no key `forc`", "`force`"),
    ] {
        let problems = load(&[text]).map(|_| ()).expect_err(text);
        let problem = problems.iter().next().expect("never empty");
        assert_eq!(problem.file, Path::new("--set"), "{text}: {problems}");
        let shown = problems.to_string();
        assert!(shown.contains(message) && shown.contains(remedy), "{text}: {shown}");
    }
}

#[test]
fn malformed_and_repeated_settings_are_refused() {
    for text in ["runs", "=3", "runs=", "a..b=3", "a[=3", "a[0]=3"] {
        text.parse::<Setting>().map(|_| ()).expect_err(text);
    }
    let twice = ["runs=3", "runs = 4"].map(|text| text.parse().expect("KEY=VALUE"));
    assert!(Settings::new(twice.to_vec()).expect_err("twice").to_string().contains("is set twice"));
}
