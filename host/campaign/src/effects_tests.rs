//! Effects in campaign files: their parameters are dispersion targets, what they shape needs them.

use crate::problem::Problems;
use crate::{Campaign, load};
use softdock_kernels::effects::{EFFECTS, Effect, EffectParameter};
use softdock_kernels::fields::fields;
use softdock_kernels::params::Params;
use std::fmt::Write;
use std::path::Path;

/// A campaign over a shipped scenario that disperses the given parameters about their scales.
fn dispersing<'a>(scenario: &str, parameters: impl Iterator<Item = &'a EffectParameter>) -> Result<Campaign, Problems> {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/scenarios").join(scenario);
    let mut text = format!(
        "schema = \"campaign/2\"\nid = \"test\"\ntitle = \"t\"\nseed = 42\nruns = 10\nscenario = '{}'\n",
        scenario.display()
    );
    let table = fields::<f64, Params<f64>>();
    for EffectParameter { field, scale, .. } in parameters {
        let unit = table.iter().find(|row| row.name == *field).expect("a field of Params").unit;
        let number = |share: f64| format!("\"{} {}\"", share * scale, if unit == "1" { "" } else { unit });
        let (min, max) = (number(0.5).replace(" \"", "\""), number(1.5).replace(" \"", "\""));
        let _ = writeln!(
            text,
            "[[dispersion]]\ntarget = \"{field}\"\ndist = {{ kind = \"uniform\", min = {min}, max = {max} }}"
        );
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("c.toml"), text).expect("written");
    load(&folder.path().join("c.toml"))
}

/// Effects that the shipped scenarios leave something to act on.
fn acting(effect: &&Effect) -> bool {
    let needs_more = ["C2_lag", "J15_link_inertia", "J19_friction_compensation", "S8_load", "S9_tare"];
    !needs_more.contains(&effect.id)
}

#[test]
fn the_parameters_of_an_effect_are_dispersion_targets_and_switch_it_on() {
    for effect in EFFECTS.iter().filter(acting) {
        let scenario = if effect.id.starts_with('J') { "smoke_joint.toml" } else { "probe_drogue.toml" };
        let campaign = dispersing(scenario, effect.parameters.iter());
        let campaign = campaign.unwrap_or_else(|problems| panic!("{}: {problems}", effect.id));
        assert!(campaign.effects().iter().any(|other| other == effect), "{}", effect.id);
    }
}

#[test]
fn shape_of_an_absent_effect_is_refused() {
    for (effect, shape) in [("K5_stribeck", 1), ("K10_fixture", 1), ("P2_slosh", 2)] {
        let effect = EFFECTS.iter().find(|row| row.id == effect).expect("a row");
        let problems = dispersing("smoke.toml", effect.parameters[shape..][..1].iter());
        let problems = problems.map(|_| ()).expect_err("it shapes nothing");
        assert!(problems.to_string().contains("it shapes an effect that no run has"), "{problems}");
    }
}
