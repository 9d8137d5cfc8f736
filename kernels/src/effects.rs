//! The effect table: every named phenomenon by which the facility may differ from space, one row each.
//!
//! Ids, groups and forms are those of the catalogue of effects. At its null value an effect changes nothing,
//! bit for bit; a test walks the table and proves it. A new effect is one row here and one term in its stage.

/// The block of the loop that an effect belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Block {
    /// Between the simulation computer and the robots.
    Command,
    /// Robots and rail.
    Robot,
    /// Force/torque sensor.
    Sensor,
    /// The parts mounted on the robots.
    Contact,
    /// The simulated bodies.
    Space,
}

/// The value of a parameter that removes its effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Null {
    /// This number.
    Value(f64),
    /// The loop's own dead time, which no parameter can undercut ([`Timing::own_delay`](crate::model::Timing::own_delay)).
    OwnDelay,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    /// Field of [`Params`](crate::params::Params); a vector's components are listed one by one.
    pub field: &'static str,
    /// The value that removes the effect.
    pub null: Null,
    /// A plausible size, in the field's unit.
    pub scale: f64,
}

/// One named phenomenon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect {
    /// Catalogue id (`C1_transport_delay`).
    pub id: &'static str,
    /// Where it acts.
    pub block: Block,
    /// What it is, in a few words.
    pub name: &'static str,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
    /// Where the plausible size comes from.
    pub source: &'static str,
    /// Effects of one group look alike in data (`G1`..`G10`, `own`).
    pub group: &'static str,
}

const fn at(field: &'static str, scale: f64) -> EffectParameter {
    EffectParameter { field, null: Null::Value(0.0), scale }
}

/// All effects that the loop has.
pub const EFFECTS: &[Effect] = &[
    Effect {
        id: "C1_transport_delay",
        block: Block::Command,
        name: "transport delay of the loop",
        parameters: &[EffectParameter { field: "loop_delay", null: Null::OwnDelay, scale: 0.016 }],
        source: "EPOS about 16 ms; EGM and RSI logs 40-120 ms",
        group: "G1",
    },
    Effect {
        id: "C2_lag",
        block: Block::Robot,
        name: "lag of the robots and the rail",
        parameters: &[at("robot1_lag", 0.02), at("robot2_lag", 0.02), at("rail_lag", 0.05)],
        source: "position loops of 2-20 Hz",
        group: "G1",
    },
    Effect {
        id: "C3_jitter",
        block: Block::Command,
        name: "jitter of the command transport",
        parameters: &[at("delay_jitter", 0.001)],
        source: "0.25-2 ms on industrial command links",
        group: "G9",
    },
    Effect {
        id: "C4_drops",
        block: Block::Command,
        name: "dropped command packets",
        parameters: &[at("drop_probability", 0.01)],
        source: "engineering judgement",
        group: "G9",
    },
    Effect {
        id: "J1_coulomb",
        block: Block::Robot,
        name: "Coulomb friction of the drives",
        parameters: &[at("robot1_coulomb_error", 0.2), at("robot2_coulomb_error", 0.2)],
        source: "friction moves by tens of per cent with load and temperature",
        group: "G3",
    },
    Effect {
        id: "J2_viscous",
        block: Block::Robot,
        name: "viscous friction of the drives",
        parameters: &[at("robot1_viscous_error", 0.3), at("robot2_viscous_error", 0.3)],
        source: "cold against warm grease",
        group: "G3",
    },
    Effect {
        id: "J3_stribeck",
        block: Block::Robot,
        name: "static friction beyond Coulomb's",
        parameters: &[at("robot1_stribeck", 1.0), at("robot2_stribeck", 1.0)],
        source: "half of Coulomb's, assumed in the robot model",
        group: "G3",
    },
    Effect {
        id: "J4_presliding",
        block: Block::Robot,
        name: "travel before sliding",
        parameters: &[at("robot1_presliding", 1.0), at("robot2_presliding", 1.0)],
        source: "1e-4 rad, assumed in the robot model",
        group: "G3",
    },
    Effect {
        id: "J5_load_friction",
        block: Block::Robot,
        name: "friction that grows with the load",
        parameters: &[at("robot1_load_friction", 0.02), at("robot2_load_friction", 0.02)],
        source: "engineering judgement",
        group: "G3",
    },
    Effect {
        id: "J7_backlash",
        block: Block::Robot,
        name: "backlash of the gears",
        parameters: &[at("robot1_backlash", 1.0), at("robot2_backlash", 1.0)],
        source: "0.5 arcmin, assumed in the robot model",
        group: "G4",
    },
    Effect {
        id: "J8_elasticity",
        block: Block::Robot,
        name: "elasticity of the gears",
        parameters: &[at("robot1_gear_compliance", 1.0), at("robot2_gear_compliance", 1.0)],
        source: "gear stiffness in the controller's parameters of a KR 300",
        group: "G2",
    },
    Effect {
        id: "J9_torque_ripple",
        block: Block::Robot,
        name: "torque ripple of the motors",
        parameters: &[at("robot1_torque_ripple", 0.01), at("robot2_torque_ripple", 0.01)],
        source: "1 % of the greatest torque, engineering judgement",
        group: "G7",
    },
    Effect {
        id: "J10_transmission_error",
        block: Block::Robot,
        name: "transmission error of the gears",
        parameters: &[at("robot1_transmission_error", 0.0001), at("robot2_transmission_error", 0.0001)],
        source: "20 arcsec, data sheets of cycloidal gears",
        group: "G7",
    },
    Effect {
        id: "J11_torque_constant",
        block: Block::Robot,
        name: "torque constant of the motors",
        parameters: &[at("robot1_torque_constant_error", 0.05), at("robot2_torque_constant_error", 0.05)],
        source: "5 % over temperature",
        group: "G5",
    },
    Effect {
        id: "J12_current_loop",
        block: Block::Robot,
        name: "lag of the current loops",
        parameters: &[at("robot1_current_lag", 0.000265), at("robot2_current_lag", 0.000265)],
        source: "600 Hz",
        group: "G1",
    },
    Effect {
        id: "J15_link_inertia",
        block: Block::Robot,
        name: "inertia error of the feedforward",
        parameters: &[at("robot1_model_inertia_error", 0.1), at("robot2_model_inertia_error", 0.1)],
        source: "reference facility: torque model within 10 %",
        group: "G5",
    },
    Effect {
        id: "J16_gravity_compensation",
        block: Block::Robot,
        name: "gravity error of the feedforward",
        parameters: &[at("robot1_model_gravity_error", 0.1), at("robot2_model_gravity_error", 0.1)],
        source: "reference facility: torque model within 10 %",
        group: "G5",
    },
    Effect {
        id: "J19_friction_compensation",
        block: Block::Robot,
        name: "friction error of the feedforward; not in the catalogue, which counts it with J1 to J3",
        parameters: &[at("robot1_model_friction_error", 0.2), at("robot2_model_friction_error", 0.2)],
        source: "as J1",
        group: "G3",
    },
    Effect {
        id: "S1_bias",
        block: Block::Sensor,
        name: "sensor bias",
        parameters: &[
            at("sensor_bias_force_x", 2.0),
            at("sensor_bias_force_y", 2.0),
            at("sensor_bias_force_z", 2.0),
            at("sensor_bias_moment_x", 0.2),
            at("sensor_bias_moment_y", 0.2),
            at("sensor_bias_moment_z", 0.2),
        ],
        source: "0.1 % of full scale",
        group: "G6",
    },
    Effect {
        id: "S2_drift",
        block: Block::Sensor,
        name: "sensor drift",
        parameters: &[
            at("sensor_drift_force_x", 0.05),
            at("sensor_drift_force_y", 0.05),
            at("sensor_drift_force_z", 0.05),
            at("sensor_drift_moment_x", 0.005),
            at("sensor_drift_moment_y", 0.005),
            at("sensor_drift_moment_z", 0.005),
        ],
        source: "engineering judgement: newtons in the minutes after switching on",
        group: "G6",
    },
    Effect {
        id: "S3_gain",
        block: Block::Sensor,
        name: "sensor gain error",
        parameters: &[
            at("sensor_gain_force_x", 0.02),
            at("sensor_gain_force_y", 0.02),
            at("sensor_gain_force_z", 0.02),
            at("sensor_gain_moment_x", 0.02),
            at("sensor_gain_moment_y", 0.02),
            at("sensor_gain_moment_z", 0.02),
        ],
        source: "calibration certificates, 1-2 %",
        group: "G5",
    },
    Effect {
        id: "S4_crosstalk",
        block: Block::Sensor,
        name: "sensor crosstalk",
        parameters: &[at("sensor_crosstalk", 0.02)],
        source: "calibration certificates, 1-2 %",
        group: "G6",
    },
    Effect {
        id: "S5_low_pass",
        block: Block::Sensor,
        name: "low-pass of the sensor",
        parameters: &[at("sensor_lag", 0.002)],
        source: "JR3 filters 31-500 Hz",
        group: "G1",
    },
    Effect {
        id: "S6_quantisation",
        block: Block::Sensor,
        name: "quantisation and saturation of the sensor",
        parameters: &[
            at("sensor_resolution_force", 0.5),
            at("sensor_resolution_moment", 0.05),
            EffectParameter { field: "sensor_range_force", null: Null::Value(crate::params::UNLIMITED), scale: 2000.0 },
            EffectParameter { field: "sensor_range_moment", null: Null::Value(crate::params::UNLIMITED), scale: 200.0 },
        ],
        source: "data sheets of 2 kN class sensors",
        group: "own",
    },
    Effect {
        id: "S7_noise",
        block: Block::Sensor,
        name: "sensor noise",
        parameters: &[at("sensor_noise_force", 1.0), at("sensor_noise_moment", 0.1)],
        source: "0.1-0.5 % of full scale",
        group: "G9",
    },
    Effect {
        id: "S8_load",
        block: Block::Sensor,
        name: "error of the load compensation: weight and inertia of part A behind the sensor",
        parameters: &[
            at("load_mass_error", 0.02),
            at("load_centre_error_x", 0.005),
            at("load_centre_error_y", 0.005),
            at("load_centre_error_z", 0.005),
        ],
        source: "engineering judgement: a weighing to 2 %, a balance to 5 mm",
        group: "G6",
    },
    Effect {
        id: "S9_tare",
        block: Block::Sensor,
        name: "error of the tare before the run",
        parameters: &[
            at("tare_error_force_x", 0.1),
            at("tare_error_force_y", 0.1),
            at("tare_error_force_z", 0.1),
            at("tare_error_moment_x", 0.01),
            at("tare_error_moment_y", 0.01),
            at("tare_error_moment_z", 0.01),
        ],
        source: "noise of a sample over the root of a hundred samples",
        group: "G6",
    },
    Effect {
        id: "K1_stiffness",
        block: Block::Contact,
        name: "stiffness error of the mounted parts",
        parameters: &[at("contact_stiffness_error", 0.2)],
        source: "engineering judgement",
        group: "G10",
    },
    Effect {
        id: "K3_damping",
        block: Block::Contact,
        name: "damping error of the mounted parts",
        parameters: &[at("contact_damping_error", 0.3)],
        source: "engineering judgement",
        group: "G10",
    },
    Effect {
        id: "K4_friction",
        block: Block::Contact,
        name: "friction error of the mounted parts",
        parameters: &[at("contact_friction_error", 0.3)],
        source: "MoS2 in air against dry nitrogen, 0.12-0.48 against 0.04-0.41",
        group: "G3",
    },
    Effect {
        id: "K7_surface_offset",
        block: Block::Contact,
        name: "place of the parts on the robots",
        parameters: &[at("place_error_x", 2e-4), at("place_error_y", 2e-4), at("place_error_z", 2e-4)],
        source: "reference facility: repeatability of a robot, plus or minus 0.2 mm",
        group: "G6",
    },
    Effect {
        id: "P1_mass",
        block: Block::Space,
        name: "mass and inertia error of the simulated target",
        parameters: &[at("mass_error", 0.05), at("inertia_error", 0.1)],
        source: "mass properties known to 5 %",
        group: "G5",
    },
];
