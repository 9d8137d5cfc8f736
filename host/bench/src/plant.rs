//! Plants of the gauntlet: mapping of effects and parameters between generator and diagnosis.
//!
//! A new plant is one more row: its rig, the blocks of its effects, and the comparable parameters.

use softdock_gauntlet::{EffectCase, Rig, effects, outside};
use softdock_kernels::effects::{GROUPS, code};

/// Plant of the gauntlet.
#[derive(Debug)]
pub struct GauntletPlant {
    /// Name on the command line and in case ids.
    pub name: &'static str,
    /// Generator of its recordings.
    pub rig: Rig,
    /// Prefixes of effect ids with their block; the first match counts.
    blocks: &'static [(&'static str, &'static str)],
    /// Effects of the generator's catalogue that are outside the library of the diagnosis.
    unknown: &'static [&'static str],
    /// Forms outside the generator's catalogue that a hypothesis of the library describes.
    close: &'static [(&'static str, &'static str)],
    /// Forms outside the catalogue that grow while a machine is recorded, and the effect whose size they add to.
    pub(crate) grows: &'static [(&'static str, &'static str)],
    /// Comparable parameters.
    aliases: &'static [Alias],
    /// Whether baseline methods run on it.
    pub baselines: bool,
    /// Whether a case takes minutes: the full extent then has few of them.
    pub slow: bool,
}

/// Parameter of the generator with its names in the diagnosis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alias {
    /// The generator's id of the effect.
    pub effect: &'static str,
    /// The generator's name of the parameter.
    pub parameter: &'static str,
    /// Names in the diagnosis; the parameter is the norm of several.
    pub fields: &'static [&'static str],
    /// Reference of the parameter.
    pub from: From,
}

/// Reference of a hidden parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum From {
    /// Nothing.
    Zero,
    /// The nominal value, which no data set changes: the true value is their sum.
    Model,
    /// The nominal value times the factor that the data set drew: the true value is their sum.
    Nominal(&'static str),
    /// The factor that the data set drew: the true share is (1 + share) factor - 1.
    Factor(&'static str),
    /// The share that the data set drew: the same with 1 + that share for the factor.
    Share(&'static str),
    /// The nominal value and what the data set drew besides: the true value is the sum of all.
    Drawn(&'static str),
    /// The nominal value times the factor that the data set drew: a share of that, so that the true value is
    /// (1 + share) factor times the nominal one.
    Scaled(&'static str),
    /// A further parameter of the effect times this one, a component of what has a length, and what the data set drew
    /// besides; nothing if it has no name.
    Along(&'static str, &'static str),
}

const fn same(effect: &'static str, parameter: &'static str, fields: &'static [&'static str]) -> Alias {
    Alias { effect, parameter, fields, from: From::Zero }
}

const fn on_nominal(
    effect: &'static str,
    parameter: &'static str,
    fields: &'static [&'static str],
    factor: &'static str,
) -> Alias {
    Alias { effect, parameter, fields, from: From::Nominal(factor) }
}

const fn alias(effect: &'static str, parameter: &'static str, fields: &'static [&'static str], from: From) -> Alias {
    Alias { effect, parameter, fields, from }
}

const fn on_model(effect: &'static str, parameter: &'static str, fields: &'static [&'static str]) -> Alias {
    Alias { effect, parameter, fields, from: From::Model }
}

/// All plants.
pub const PLANTS: &[GauntletPlant] = &[
    GauntletPlant {
        name: "drive",
        rig: Rig::Drive { link_encoder: false },
        blocks: &[
            ("C", "R2 reference to torque"),
            ("load_dependent_delay", "R2 reference to torque"),
            ("", "R3 torque to motion"),
        ],
        unknown: &[],
        close: &[("stribeck_squared", "J3_stribeck")],
        grows: &[("temperature_load", "J5_load_friction")],
        aliases: &[
            on_nominal("J1_coulomb", "level", &["coulomb"], "coulomb_factor"),
            on_nominal("J2_viscous", "viscous", &["viscous"], "viscous_factor"),
            same("J3_stribeck", "level", &["stribeck"]),
            same("J3_stribeck", "speed", &["stribeck_speed"]),
            on_nominal("J4_presliding", "travel", &["presliding_travel"], "presliding_travel_factor"),
            same("J5_load_friction", "share", &["load_coefficient"]),
            same("J7_backlash", "half_gap", &["half_backlash"]),
            same("J8_elasticity", "compliance", &["compliance"]),
            same("J9_torque_ripple", "amplitude", &["ripple_sin", "ripple_cos"]),
            same("J9_torque_ripple", "periods", &["ripple_cycles"]),
            same("J10_transmission_error", "amplitude", &["wave_sin", "wave_cos"]),
            same("J10_transmission_error", "periods", &["wave_cycles"]),
            alias("J11_torque_constant", "share", &["torque_constant_error"], From::Factor("torque_constant_factor")),
            same("J12_current_loop", "time_constant", &["current_lag"]),
            same("J13_saturation", "limit", &["torque_limit"]),
            same("J14_payload", "mass", &["payload"]),
            same("J15_link_inertia", "inertia", &["inertia_error"]),
            same("J16_gravity_compensation", "torque", &["gravity_cos"]),
            same("J17_cable", "stiffness", &["cable_stiffness"]),
            same("J18_direction_friction", "half_difference", &["coulomb_asymmetry"]),
            same("C1_transport_delay", "delay", &["delay"]),
            same("C2_lag", "time_constant", &["lag"]),
            same("C5_skew", "skew", &["clock_skew"]),
            same("C6_hold", "period", &["hold"]),
            same("C7_rate_limit", "rate", &["rate_limit"]),
        ],
        baselines: true,
        slow: false,
    },
    GauntletPlant {
        name: "robot",
        rig: Rig::Robot,
        blocks: &[("", "R3 torque to motion, axis 2")],
        unknown: &[],
        close: &[],
        grows: &[],
        aliases: &[
            on_nominal("J1_coulomb", "level", &["coulomb"], "coulomb_factor"),
            on_nominal("J2_viscous", "viscous", &["viscous"], "viscous_factor"),
            same("J3_stribeck", "level", &["stribeck"]),
            same("J3_stribeck", "speed", &["stribeck_speed"]),
            same("J5_load_friction", "share", &["load_coefficient"]),
            alias("J11_torque_constant", "share", &["torque_constant_error"], From::Factor("torque_constant_factor")),
            same("J15_link_inertia", "inertia", &["inertia_error"]),
            same("J16_gravity_compensation", "torque", &["gravity_cos"]),
            same("J17_cable", "stiffness", &["cable_stiffness"]),
            same("J18_direction_friction", "half_difference", &["coulomb_asymmetry"]),
        ],
        baselines: false,
        slow: true,
    },
    GauntletPlant {
        name: "sensor",
        rig: Rig::Sensor,
        blocks: &[("", "R5 force to reading")],
        unknown: &[],
        close: &[],
        grows: &[],
        aliases: &[
            alias("S1_bias", "force", &["bias_force_x"], From::Along("unit_x", "bias_force_x")),
            alias("S1_bias", "force", &["bias_force_y"], From::Along("unit_y", "bias_force_y")),
            alias("S1_bias", "force", &["bias_force_z"], From::Along("unit_z", "bias_force_z")),
            alias("S1_bias", "force", &["bias_moment_x"], From::Along("unit_moment_x", "bias_moment_x")),
            alias("S1_bias", "force", &["bias_moment_y"], From::Along("unit_moment_y", "bias_moment_y")),
            alias("S1_bias", "force", &["bias_moment_z"], From::Along("unit_moment_z", "bias_moment_z")),
            same("S2_drift", "rate", &["drift_force_x", "drift_force_y", "drift_force_z"]),
            alias("S2_drift", "rate", &["drift_force_x"], From::Along("unit_x", "")),
            alias("S2_drift", "rate", &["drift_force_y"], From::Along("unit_y", "")),
            alias("S2_drift", "rate", &["drift_force_z"], From::Along("unit_z", "")),
            alias("S2_drift", "rate", &["drift_moment_x"], From::Along("unit_moment_x", "")),
            alias("S2_drift", "rate", &["drift_moment_y"], From::Along("unit_moment_y", "")),
            alias("S2_drift", "rate", &["drift_moment_z"], From::Along("unit_moment_z", "")),
            alias("S3_gain", "share", &["fx_of_force_x"], From::Share("gain")),
            alias("S3_gain", "share", &["fy_of_force_y"], From::Share("gain")),
            alias("S3_gain", "share", &["fz_of_force_z"], From::Share("gain")),
            alias("S3_gain", "share", &["mx_of_moment_x"], From::Share("gain")),
            alias("S3_gain", "share", &["my_of_moment_y"], From::Share("gain")),
            alias("S3_gain", "share", &["mz_of_moment_z"], From::Share("gain")),
            same("S5_low_pass", "time_constant", &["lag"]),
            same("S6_quantisation", "quantum", &["resolution"]),
            same("S7_noise", "deviation", &["noise_force"]),
            alias("S8_load", "mass", &["tool_mass"], From::Drawn("tool_mass")),
        ],
        baselines: false,
        slow: false,
    },
    GauntletPlant {
        name: "contact",
        rig: Rig::Contact,
        blocks: &[("", "R5 motion to force")],
        unknown: &["K9_plastic"],
        close: &[],
        grows: &[],
        aliases: &[
            on_nominal("K1_stiffness", "stiffness", &["stiffness"], "stiffness_factor"),
            on_model("K2_exponent", "exponent_excess", &["exponent"]),
            same("K3_damping", "coefficient", &["depth_damping"]),
            on_nominal("K4_friction", "coefficient", &["friction"], "friction_factor"),
            same("K5_stick_slip", "coefficient", &["stribeck"]),
            same("K5_stick_slip", "speed", &["stribeck_speed"]),
            same("K6_anisotropy", "share", &["anisotropy"]),
            alias("K7_surface_offset", "offset", &["surface"], From::Drawn("surface")),
            same("K8_adhesion", "force", &["adhesion"]),
            same("K8_adhesion", "range", &["adhesion_range"]),
            same("K10_fixture", "compliance", &["fixture_compliance"]),
            same("S5_low_pass", "time_constant", &["lag"]),
        ],
        baselines: false,
        slow: false,
    },
    GauntletPlant {
        name: "command",
        rig: Rig::Command,
        blocks: &[("", "R1 command sent to command received")],
        unknown: &[],
        close: &[],
        grows: &[],
        aliases: &[
            same("C1_transport_delay", "delay", &["delay"]),
            same("C2_lag", "time_constant", &["lag"]),
            same("C3_jitter", "deviation", &["delay_jitter"]),
            same("C4_drops", "probability", &["drop_probability"]),
            same("C5_skew", "skew", &["clock_skew"]),
            same("C6_hold", "period", &["hold"]),
            same("C7_rate_limit", "rate", &["rate_limit"]),
        ],
        baselines: false,
        slow: false,
    },
    GauntletPlant {
        name: "body",
        rig: Rig::Body,
        blocks: &[("", "R6 wrench to motion")],
        unknown: &[],
        close: &[],
        grows: &[],
        aliases: &[
            on_nominal("P1_mass", "mass", &["mass"], "mass_factor"),
            alias("P1_centre", "offset", &["centre_x"], From::Drawn("centre_x")),
            alias("P1_inertia", "share", &["inertia_x"], From::Scaled("inertia_factor_x")),
            alias("P1_inertia", "share", &["inertia_y"], From::Scaled("inertia_factor_y")),
            alias("P1_inertia", "share", &["inertia_z"], From::Scaled("inertia_factor_z")),
            same("P2_slosh", "mass", &["slosh_mass"]),
            same("P2_slosh", "frequency", &["slosh_frequency"]),
            same("P2_slosh", "damping_ratio", &["slosh_damping"]),
            same("P2_slosh", "place_x", &["slosh_place_x"]),
            same("P2_slosh", "place_y", &["slosh_place_y"]),
            same("P2_slosh", "place_z", &["slosh_place_z"]),
            same("P3_appendage", "mass", &["appendage_mass"]),
            same("P3_appendage", "frequency", &["appendage_frequency"]),
            same("P3_appendage", "damping_ratio", &["appendage_damping"]),
            same("P3_appendage", "place_x", &["appendage_place_x"]),
            same("P3_appendage", "place_z", &["appendage_place_z"]),
        ],
        baselines: false,
        slow: false,
    },
    GauntletPlant {
        name: "facility",
        rig: Rig::Facility,
        blocks: &[("C", "R2 command to motion"), ("robot_", "R2 command to motion"), ("", "R5 motion to wrench")],
        unknown: &[],
        close: &[],
        grows: &[],
        aliases: &[
            on_nominal("C1_transport_delay", "delay", &["loop_delay"], "loop_delay_factor"),
            on_model("C2_lag", "lag", &["robot1_lag"]),
            same("S3_gain", "share", &["sensor_gain_force_x"]),
            same("S4_crosstalk", "share", &["sensor_crosstalk"]),
            on_model("S5_low_pass", "time_constant", &["sensor_lag"]),
            same("S5_delay", "delay", &["sensor_delay_error"]),
            same("K1_stiffness", "share", &["contact_stiffness_error"]),
            same("K2_exponent", "excess", &["contact_exponent_error"]),
            same("K3_damping", "share", &["contact_damping_error"]),
            same("K4_friction", "share", &["contact_friction_error"]),
            same("K7_surface_offset", "offset", &["place_error_x"]),
            same("K10_fixture", "compliance", &["fixture_compliance"]),
        ],
        baselines: false,
        slow: true,
    },
];

impl GauntletPlant {
    /// Returns the effects in the library.
    pub fn effects(&self) -> impl Iterator<Item = &'static EffectCase> + use<'_> {
        effects(self.rig).iter().filter(|effect| !self.unknown.contains(&effect.id))
    }

    /// Returns the effects outside the library.
    pub fn outside(&self) -> impl Iterator<Item = &'static EffectCase> + use<'_> {
        effects(self.rig).iter().filter(|effect| self.unknown.contains(&effect.id)).chain(outside(self.rig))
    }

    /// Returns the block in which a hidden effect acts.
    pub fn block(&self, hidden: &str) -> &'static str {
        self.blocks.iter().find(|(start, _)| hidden.starts_with(start)).map_or("", |(_, block)| block)
    }

    /// Returns whether a named effect is right for a hidden one: same catalogue number or same form.
    pub fn is_right(&self, hidden: &str, named: &str) -> bool {
        let own = self.effects().any(|effect| effect.id == hidden) && code(hidden) == code(named);
        own || self.close.iter().any(|(form, name)| *form == hidden && code(name) == code(named))
    }

    /// Returns the comparable parameters of a hidden effect.
    pub fn aliases(&self, hidden: &str) -> impl Iterator<Item = &'static Alias> + use<'_> {
        let hidden = hidden.to_owned();
        self.aliases.iter().filter(move |alias| alias.effect == hidden)
    }
}

/// Returns the plant of a name.
pub fn plant(name: &str) -> Option<&'static GauntletPlant> {
    PLANTS.iter().find(|plant| plant.name == name)
}

/// Returns the sort key of an effect: letter and number, forms without a number last.
pub fn order(id: &str) -> (bool, String, u32, String) {
    let code = code(id);
    let letters: String = code.chars().take_while(char::is_ascii_alphabetic).collect();
    let number = code[letters.len()..].parse().ok();
    (number.is_none(), letters, number.unwrap_or(0), id.to_owned())
}

/// Returns whether an effect has zero mean, so that differences of recordings do not show it.
pub fn is_random(id: &str) -> bool {
    GROUPS.iter().any(|group| group.id == "G9" && group.has(id))
}

/// Returns whether an effect masks others: noise and quantisation.
pub fn hides_others(id: &str) -> bool {
    is_random(id) || code(id) == "S6"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recordings_folder::{RecordingsFolder, read};
    use softdock_diagnosis::diagnosis::DiagnosisOptions;
    use softdock_diagnosis::model::block::MeasuredBlock;
    use softdock_diagnosis::model::hypothesis::Hypothesis;
    use softdock_gauntlet::{NoiseColour, generate};
    use softdock_kernels::effects::share_group;

    /// The blocks of a plant with their libraries.
    fn blocks(plant: &GauntletPlant) -> Vec<(MeasuredBlock, Vec<Hypothesis>)> {
        let healthy = generate(plant.rig, &[], NoiseColour::FirstOrder, 1).expect("nothing hidden");
        let recordings = RecordingsFolder::of(&healthy).expect("writable");
        read(recordings.path(), &[], &DiagnosisOptions::default()).expect("good recordings").blocks(1)
    }

    #[test]
    fn plant_table_matches_the_libraries() {
        for plant in PLANTS {
            let blocks = blocks(plant);
            let library = |hidden: &str| {
                let own = blocks.iter().find(|(block, _)| block.name == plant.block(hidden));
                own.unwrap_or_else(|| panic!("{}: no block of {hidden}", plant.name))
            };
            // What has no mean is judged by the repeats, not by a library.
            for effect in plant.effects().filter(|effect| !is_random(effect.id)) {
                let (block, hypotheses) = library(effect.id);
                let own = || hypotheses.iter().filter(|own| plant.is_right(effect.id, own.effect.id));
                assert!(own().next().is_some(), "{} is not in the library", effect.id);
                for field in plant.aliases(effect.id).flat_map(|alias| alias.fields) {
                    let has = |own: &Hypothesis| own.unknowns.iter().any(|unknown| unknown.name == *field);
                    assert!(own().any(has), "{}: {field}", effect.id);
                    block.field(field);
                }
            }
            for form in plant.outside() {
                let named = |own: &Hypothesis| code(own.effect.id) == code(form.id);
                assert!(!library(form.id).1.iter().any(named), "{} is in the library", form.id);
            }
        }
    }

    #[test]
    fn right_names_are_compared_by_catalogue_number() {
        assert_eq!(["J3_stribeck", "K10_fixture", "quadratic_drag"].map(code), ["J3", "K10", "quadratic"]);
        assert!(share_group("J6_warm_up", "J2_viscous") && !share_group("J7_backlash", "C6_hold"));
        assert!(share_group("K4_friction", "S3_gain") && !share_group("K4_friction", "K1_stiffness"));
        assert!(is_random("C3_jitter") && !is_random("C2_lag"));
        assert!(hides_others("S7_noise") && hides_others("S6_quantisation") && !hides_others("S1_bias"));
    }
}
