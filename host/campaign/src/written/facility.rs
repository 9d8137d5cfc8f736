//! The facility of a scenario as written.

use super::joint_level::JointLevelTable;
use super::{At, Quantities, Quantity};
use schemars::JsonSchema;
use serde::Deserialize;

/// The HIL facility.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FacilityTable {
    /// Facility file whose rules end and stop a session, relative to this file.
    pub(crate) file: Option<At<String>>,
    /// In place of `file`: "none", no rule stops a session.
    pub(crate) session_rules: Option<At<String>>,
    /// Whole effective dead time of the loop; default the least that the loop can have.
    pub(crate) loop_delay: Option<Quantity>,
    /// Standard deviation of the command delay, per packet.
    pub(crate) delay_jitter: Option<Quantity>,
    /// Probability that a command packet is lost.
    pub(crate) drop_probability: Option<Quantity>,
    /// Growth of the command delay with time: clocks of unequal rate; default zero.
    pub(crate) clock_skew: Option<Quantity>,
    /// Period over which the robots hold a command instead of interpolating; default zero: they interpolate.
    pub(crate) command_hold: Option<Quantity>,
    /// Ticks during which a lost command is extrapolated along its twist; default 2.
    pub(crate) drop_hold_ticks: Option<At<u32>>,
    /// Share of the relative translation that robot 1 (part A) makes; default 1/2.
    pub(crate) robot1_share: Option<Quantity>,
    /// Speed limit of the tools, per axis.
    pub(crate) max_speed: Option<Quantity>,
    /// Rate limit of the tools, per axis.
    pub(crate) max_rate: Option<Quantity>,
    /// The HIL loop counts as diverged above this relative speed of the parts; must be written.
    pub(crate) unstable_speed: Option<Quantity>,
    /// Response of the robot with part A.
    #[serde(default)]
    pub(crate) robot1: ResponseTable,
    /// Response of the robot with part B.
    #[serde(default)]
    pub(crate) robot2: ResponseTable,
    /// Admittance of robot 1: its motion under the measured wrench.
    pub(crate) impedance: Option<At<ImpedanceTable>>,
    /// A known motion that is added to the robots' reference.
    pub(crate) test_motion: Option<TestMotionTable>,
    /// Both robots joint by joint, in place of their responses.
    pub(crate) joint_level: Option<At<JointLevelTable>>,
    /// The rail under robot 1.
    pub(crate) rail: Option<RailTable>,
    /// The force/torque sensor.
    #[serde(default)]
    pub(crate) sensor: SensorTable,
    /// What the facility does against its own delay; default nothing.
    pub(crate) compensator: Option<CompensatorTable>,
    /// Differences between facility and space.
    #[serde(default)]
    pub(crate) errors: ErrorsTable,
    /// Part B's mount on robot 2; default rigid.
    #[serde(default)]
    pub(crate) fixture: FixtureTable,
    /// A mass that sways in the simulated target; default none.
    #[serde(default)]
    pub(crate) slosh: ModeTable,
    /// A flexible appendage of the simulated target; default none.
    #[serde(default)]
    pub(crate) appendage: ModeTable,
}

/// M X'' + B X' + K X = measured wrench on part A; X is added to robot 1's command. Laboratory axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ImpedanceTable {
    /// Mass along x, y, z.
    pub(crate) mass: Quantities,
    /// Inertia about x, y, z.
    pub(crate) inertia: Quantities,
    /// Damping along x, y, z.
    pub(crate) damping: Quantities,
    /// Damping about x, y, z.
    pub(crate) rotation_damping: Quantities,
    /// Stiffness along x, y, z.
    pub(crate) stiffness: Quantities,
    /// Stiffness about x, y, z.
    pub(crate) rotation_stiffness: Quantities,
    /// Off-diagonal elements of the mass, 6 x 6 in SI units; default none.
    pub(crate) mass_coupling: Option<At<Vec<Vec<f64>>>>,
    /// Off-diagonal elements of the damping.
    pub(crate) damping_coupling: Option<At<Vec<Vec<f64>>>>,
    /// Off-diagonal elements of the stiffness.
    pub(crate) stiffness_coupling: Option<At<Vec<Vec<f64>>>>,
}

/// A known motion added to part A's command; the metrics `tracking_...` measure how the robots follow it.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TestMotionTable {
    /// Direction in the laboratory, three numbers.
    pub(crate) axis: At<Vec<At<f64>>>,
    /// "sine"; "run": out at constant speed for half a period, then standing; "trapezoid": the same with ramps of speed.
    pub(crate) waveform: At<String>,
    /// Amplitude of the sine, or length of the run or trapezoid.
    pub(crate) amplitude: Quantity,
    /// Frequency of the sine; a run or trapezoid takes half a period.
    pub(crate) frequency: Quantity,
    /// Time at which it begins; default at once.
    pub(crate) begin: Option<Quantity>,
    /// Gain, lag and error count from so long after the beginning, over whole periods; default at once.
    pub(crate) settle: Option<Quantity>,
}

/// Delay compensation between the measured wrench and the simulated bodies; each kind takes its own keys.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct CompensatorTable {
    /// none, first_order_lead, second_order_lead, smith, virtual_damping, passivity or lead_passivity.
    pub(crate) kind: At<String>,
    /// Delay that it assumes: of the lead, of the prediction, of the virtual damping.
    pub(crate) delay: Option<Quantity>,
    /// Time constant of the low-pass on the derivative of a lead; default none.
    pub(crate) lag: Option<Quantity>,
    /// Contact stiffness that it assumes.
    pub(crate) stiffness: Option<Quantity>,
    /// Share by which virtual damping, or a lead that was switched up, exceeds what the delay asks for; default 0.
    pub(crate) margin: Option<Quantity>,
    /// Contact damping whose loss the energy observer allows for; default none.
    pub(crate) damping: Option<Quantity>,
    /// Energy that the facility may have given in a contact before damping is injected.
    pub(crate) energy: Option<Quantity>,
    /// Measured force above which the parts are taken to touch; default zero.
    pub(crate) threshold: Option<Quantity>,
    /// Whether the compensated force may pull parts that only push each other; default false.
    pub(crate) pulls: Option<At<bool>>,
}

/// w^2 (1 + T_z s) / (s^2 + 2 z w s + w^2).
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ResponseTable {
    /// 1/w; default zero: ideal.
    pub(crate) lag: Option<Quantity>,
    /// z; default 1.
    pub(crate) damping: Option<Quantity>,
    /// T_z; default zero.
    pub(crate) zero: Option<Quantity>,
}

/// A linear axis.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RailTable {
    /// Direction in the laboratory.
    pub(crate) axis: At<Vec<At<f64>>>,
    /// Share of robot 1's displacement along the axis.
    pub(crate) share: Quantity,
    /// 1/w of its response; default zero: ideal.
    pub(crate) lag: Option<Quantity>,
    /// z of its response; default 1.
    pub(crate) damping: Option<Quantity>,
}

/// The force/torque sensor; vectors in its own axes, which are part A's.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SensorTable {
    /// Sampling period, a whole number of substeps; default one substep.
    pub(crate) period: Option<Quantity>,
    /// Delay of the measured wrench, a part of the loop delay.
    pub(crate) delay: Option<Quantity>,
    /// Time constant of the low-pass.
    pub(crate) lag: Option<Quantity>,
    /// Standard deviation of the force noise.
    pub(crate) noise_force: Option<Quantity>,
    /// Standard deviation of the moment noise.
    pub(crate) noise_moment: Option<Quantity>,
    /// Force bias.
    pub(crate) bias_force: Option<Quantities>,
    /// Moment bias.
    pub(crate) bias_moment: Option<Quantities>,
    /// Drift of the force from the start on.
    pub(crate) drift_force: Option<Quantities>,
    /// Drift of the moment from the start on.
    pub(crate) drift_moment: Option<Quantities>,
    /// Whether it is tared at the start pose before each run; default false.
    pub(crate) tared: Option<At<bool>>,
    /// Error of the tare, force.
    pub(crate) tare_error_force: Option<Quantities>,
    /// Error of the tare, moment.
    pub(crate) tare_error_moment: Option<Quantities>,
    /// Its load besides the contact; default none.
    pub(crate) load: Option<LoadTable>,
    /// Relative gain error of the force.
    pub(crate) gain_force: Option<Quantities>,
    /// Relative gain error of the moment.
    pub(crate) gain_moment: Option<Quantities>,
    /// Factor on the crosstalk pattern.
    pub(crate) crosstalk: Option<Quantity>,
    /// 6 x 6 pattern (fx fy fz mx my mz, SI); default: ones between the forces and between the moments.
    pub(crate) crosstalk_pattern: Option<At<Vec<Vec<f64>>>>,
    /// Force quantisation.
    pub(crate) resolution_force: Option<Quantity>,
    /// Moment quantisation.
    pub(crate) resolution_moment: Option<Quantity>,
    /// Force at which it saturates.
    pub(crate) range_force: Option<Quantity>,
    /// Moment at which it saturates.
    pub(crate) range_moment: Option<Quantity>,
}

/// Part A behind the sensor, a point mass in the laboratory's gravity, and the facility's errors about it.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct LoadTable {
    /// Mass.
    pub(crate) mass: Quantity,
    /// Centre in part A's frame.
    pub(crate) centre: Quantities,
    /// Gravity in the laboratory's axes, which are those of the contact frame.
    pub(crate) gravity: Quantities,
    /// Whether the facility subtracts the inertia force too; default true.
    pub(crate) inertia_compensated: Option<bool>,
    /// Relative error of the mass that the facility assumes.
    pub(crate) mass_error: Option<Quantity>,
    /// Error of the centre that the facility assumes.
    pub(crate) centre_error: Option<Quantities>,
}

/// Differences between facility and space; relative ones, but for the place.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ErrorsTable {
    /// Target mass in the facility's simulation.
    pub(crate) mass: Option<Quantity>,
    /// Target inertia in the facility's simulation.
    pub(crate) inertia: Option<Quantity>,
    /// Centre of mass of the target in the facility's simulation, target's body axes.
    pub(crate) centre_of_mass: Option<Quantities>,
    /// Stiffness of the mounted parts.
    pub(crate) contact_stiffness: Option<Quantity>,
    /// Damping of the mounted parts.
    pub(crate) contact_damping: Option<Quantity>,
    /// Friction of the mounted parts.
    pub(crate) contact_friction: Option<Quantity>,
    /// Exponent of force over depth of the mounted parts: the spring times (d / 1 mm)^e.
    pub(crate) contact_exponent: Option<Quantity>,
    /// Share s of the mounted parts' friction mu (1 + s exp(-|v| / v_s)) that falls with the sliding speed.
    pub(crate) contact_stribeck: Option<Quantity>,
    /// The speed v_s of it; default 10 mm/s.
    pub(crate) contact_stribeck_speed: Option<Quantity>,
    /// Share a of the mounted parts' friction mu (1 + a cos 2 theta), theta from part B's y axis.
    pub(crate) contact_anisotropy: Option<Quantity>,
    /// Tension of each contact point of the mounted parts before it separates.
    pub(crate) contact_adhesion: Option<Quantity>,
    /// Place of part A on its robot, laboratory axes.
    pub(crate) place: Option<Quantities>,
    /// Delay of the measured wrench beyond the sensor's own, which the loop's delay does not hold.
    pub(crate) sensor_delay: Option<Quantity>,
}

/// A mass on a spring and damper under part B, three equal translations.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FixtureTable {
    /// Displacement per force; default zero: rigid.
    pub(crate) compliance: Option<Quantity>,
    /// Frequency; default 40 Hz.
    pub(crate) frequency: Option<Quantity>,
    /// Damping ratio; default 0.02.
    pub(crate) damping: Option<Quantity>,
}

/// A hidden mass on a spring at the simulated target's centre of mass.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ModeTable {
    /// Its share of the target's mass; default zero: none.
    pub(crate) share: Option<Quantity>,
    /// Its frequency in a fixed target; default 0.5 Hz (slosh), 3 Hz (appendage).
    pub(crate) frequency: Option<Quantity>,
    /// Damping ratio; default 0.02 (slosh), 0.005 (appendage).
    pub(crate) damping: Option<Quantity>,
}
