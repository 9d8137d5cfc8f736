//! `softdock diagnose` as a process: messages, output files, rejections.

use softdock_gauntlet::{Hidden, NoiseColour, Rig, generate};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

fn softdock(folder: &Path, words: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
    command.current_dir(folder).arg("diagnose").args(words).stdin(Stdio::null());
    command.output().expect("softdock starts")
}

/// Returns the recordings of a rig, by name from its folder.
fn recordings(folder: &Path, name: &str) -> Vec<String> {
    let files = folder.join(name).read_dir().expect("a folder");
    let mut names: Vec<String> =
        files.map(|file| format!("{name}/{}", file.expect("a file").file_name().to_string_lossy())).collect();
    names.sort();
    names
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn page_figures_and_terminal_agree_and_the_extended_model_is_valid() {
    let folder = tempfile::tempdir().expect("a folder");
    let hidden = [Hidden { id: "J14_payload", size: 1.5 }];
    let set = generate(Rig::Drive { link_encoder: false }, &hidden, NoiseColour::FirstOrder, 3).expect("a legal size");
    set.write(folder.path()).expect("writable");
    let (learn, test) = (recordings(folder.path(), "training"), recordings(folder.path(), "holdout"));
    let words = |model: &'static str, out: &'static str| -> Vec<String> {
        let mut words = vec![model.to_owned()];
        words.extend(learn.iter().cloned());
        words.push("--holdout".to_owned());
        words.extend(test.iter().cloned());
        words.extend(["--out".to_owned(), out.to_owned()]);
        words
    };
    let run = |words: Vec<String>| softdock(folder.path(), &words.iter().map(String::as_str).collect::<Vec<_>>());

    let output = run(words("model.toml", "first"));
    let (printed, beside) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{beside}");
    assert!(beside.contains("R3 torque to motion: tau -> q") && beside.contains("J14_payload"), "{beside}");
    assert!(beside.starts_with("Data quality of") && beside.contains("250 Hz, no jitter; no gaps"), "{beside}");
    assert!(printed.starts_with("Drive, flange: mass beyond the model's "), "{printed}");
    let headline = printed.lines().next().expect("a headline");
    assert!(headline.contains(" kg (") && headline.ends_with("> 99.9 %."), "{headline}");
    let figures: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("first/diagnosis.json")).expect("figures"))
            .expect("JSON");
    assert_eq!((&figures["answer"], &figures["provisional"]), (&"named".into(), &false.into()));
    let payload = figures["effects"][0]["parameters"]["payload"]["value"].as_f64().expect("a number");
    assert!((payload - 1.5).abs() < 0.15, "{payload}");
    assert_eq!(figures["headline"], headline);
    for key in ["ruled_out", "gain", "residual", "not_visible", "experiment", "data_quality"] {
        assert!(figures.get(key).is_some(), "{key}");
    }
    let page = fs::read_to_string(folder.path().join("first/diagnosis.html")).expect("a page");
    let shown = softdock_analysis::number::significant(payload, 4);
    assert!(printed.contains(&shown) && page.contains(&shown) && page.contains("<svg"), "{shown}");
    assert!(page.contains("<h2>Data quality</h2>"), "the page states the quality");
    assert!(!page.replace("http-equiv", "").contains("http"), "the page opens offline");

    let output = run(words("first/extended.toml", "second"));
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).starts_with("No model error:"), "{}", text(&output.stdout));
    assert!(!folder.path().join("second/extended.toml").exists(), "nothing to add");
}

#[test]
fn bad_input_exits_with_2_and_writes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = "schema = \"rig/1\"\nkind = \"drive\"\nid = \"x\"\n[drive]\nmotion = \"revolute\"\nmotor_inertia = \"1 kg m^2\"\n";
    let log = "[log]\n\"t\" = { column = \"t\", unit = \"s\" }\n\"q\" = { column = \"q\", unit = \"rad\" }\n\"tau\" = { column = \"u\", unit = \"N m\" }\n";
    fs::write(folder.path().join("good.toml"), format!("{model}{log}")).expect("writable");
    fs::write(folder.path().join("unit.toml"), format!("{model}{}", log.replace("N m", "kg"))).expect("writable");
    fs::write(
        folder.path().join("effect.toml"),
        format!("{model}[[effect]]\nid = \"J3_stribek\"\nparameters = {{}}\n{log}"),
    )
    .expect("writable");
    fs::write(
        folder.path().join("parameter.toml"),
        format!("{model}[[effect]]\nid = \"J3_stribeck\"\nparameters = {{ stribek = \"1 N m\" }}\n{log}"),
    )
    .expect("writable");
    fs::write(folder.path().join("short.csv"), "t,q,u\n0,0,1\n0.1,0,1\n").expect("writable");
    fs::write(
        folder.path().join("still.csv"),
        (0..300).fold(String::from("t,q,u\n"), |all, i| all + &format!("{},{},5\n", f64::from(i) * 0.01, i)),
    )
    .expect("writable");
    for (words, expected) in [
        (&["missing.toml", "short.csv"][..], "missing.toml"),
        (&["unit.toml", "short.csv"], "unit"),
        (&["effect.toml", "short.csv"], "J3_stribeck"),
        (&["parameter.toml", "short.csv"], "stribeck"),
        (&["good.toml", "short.csv"], "2 rows are too few"),
        (&["good.toml", "still.csv"], "`tau` is constant"),
        (&["good.toml", "none.csv"], "none.csv"),
    ] {
        let output = softdock(folder.path(), words);
        let beside = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {beside}");
        assert!(beside.contains(expected), "{words:?}: {beside}");
        assert!(!folder.path().join("results").exists(), "{words:?} wrote something");
    }
}

#[test]
fn signals_are_listed_without_a_model() {
    let output = softdock(Path::new("."), &["--signals"]);
    let printed = text(&output.stdout);
    assert!(
        output.status.success() && ["drive:", "tau", "sensor:", "contact:"].iter().all(|word| printed.contains(word)),
        "{printed}"
    );
}
