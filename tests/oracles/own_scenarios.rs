//! Runs whose campaign disperses keys of the scenario: the same as runs of a scenario that has their values written in.

use super::lanes::bits;
use softdock_campaign::{Campaign, Scenario};
use softdock_engine::cpu::CpuEngine;
use softdock_engine::{Engine, Job, RunInput, is_noisy};
use softdock_kernels::plant::Plant;
use std::fs::write;
use std::path::Path;
use std::sync::Arc;

const DISPERSIONS: &str = r#"
[[dispersion]]
target = "loop_delay"
dist = { kind = "uniform", min = "3 ms", max = "20 ms" }
[[dispersion]]
target = "scenario.contact.pair[1].stiffness"
dist = { kind = "uniform", min = "3 N/mm", max = "5 N/mm" }
[[dispersion]]
target = "scenario.part_b.solid[bumper].radius"
dist = { kind = "uniform", min = "24 mm", max = "26 mm" }
[[dispersion]]
target = "scenario.arm.angles[4]"
dist = { kind = "uniform", min = "88 deg", max = "92 deg" }
"#;

#[test]
fn run_has_the_scenario_that_its_values_write() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/scenarios");
    let absolute = |text: String, file: &str| {
        let path = shipped.join(file).canonicalize().expect("a shipped file");
        text.replace(file, path.to_str().expect("a plain path"))
    };
    let text = std::fs::read_to_string(shipped.join("berth.toml")).expect("the shipped scenario");
    let text = absolute(absolute(text, "../models/seven_joint_arm.urdf"), "../facilities/reference.toml");
    let text = text
        .replace("time_limit = \"9 s\"", "time_limit = \"6 s\"")
        .replace("max_time = \"8 s\"", "max_time = \"5 s\"");
    write(folder.path().join("s.toml"), &text).expect("written");
    let head =
        "schema = \"campaign/2\"\nid = \"own\"\ntitle = \"t\"\nseed = 5\nruns = 6\nscenario = \"s.toml\"\n".to_owned();
    write(folder.path().join("c.toml"), head + DISPERSIONS).expect("written");
    let campaign = Campaign::load(&folder.path().join("c.toml")).unwrap_or_else(|problems| panic!("{problems}"));

    let plant = |model| Plant::new(model).with_effects(campaign.effects());
    let noisy = is_noisy(&campaign.nominal());
    let draws: Vec<_> = (0..campaign.runs).map(|run| campaign.draw(run).expect("legal")).collect();
    let inputs = draws.iter().zip(0..).map(|(draw, run)| {
        let own = draw.own.as_ref().expect("the campaign disperses keys");
        RunInput { plant: Some(Arc::new(plant(own.model.clone()))), ..RunInput::new(run, draw.params) }
    });
    let job = Job::new(plant(campaign.scenario.model.clone()), campaign.seed, noisy);
    let together = CpuEngine::new().run(&job, &inputs.collect::<Vec<_>>(), &|_| true).expect("nobody stops it");

    let mut touched = 0;
    for (row, draw) in together.iter().zip(&draws) {
        let [stiffness, radius, angle] = draw.own.as_ref().expect("keys").keys[..] else { panic!("three keys") };
        let own = text
            .replace("stiffness = \"4 N/mm\"", &format!("stiffness = \"{stiffness} N/m\""))
            .replace("radius = \"25 mm\"", &format!("radius = \"{radius} m\""))
            .replace(
                "\"90 deg\", \"0 deg\", \"-30 deg\", \"0 deg\"]",
                &format!("\"{angle} rad\", \"0 deg\", \"-30 deg\", \"0 deg\"]"),
            );
        let path = folder.path().join(format!("{}.toml", row.run));
        write(&path, own).expect("written");
        let scenario = Scenario::load(&path).unwrap_or_else(|problems| panic!("{problems}"));
        assert_ne!(scenario.model, campaign.scenario.model);
        let job = Job::new(plant(scenario.model), campaign.seed, noisy);
        let alone = CpuEngine::new().run(&job, &[RunInput::new(row.run, draw.params)], &|_| true);
        let alone = alone.expect("nobody stops it");
        assert!(bits(&alone[0]) == bits(row), "run {} differs", row.run);
        touched += usize::from(row.space.touch_time > 0.0);
    }
    assert_eq!(touched, 6, "all runs touch");
}
