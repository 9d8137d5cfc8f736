//! The facility of a scenario as written.

use super::joint_level::JointLevelTable;
use super::{At, Quantities, Quantity, file_table};
use schemars::JsonSchema;
use serde::Deserialize;
use softdock_kernels::params::Params;

file_table! {
    /// The HIL facility.
    #[derive(Default)]
    FacilityTable of Params {
        /// Facility file whose rules end and stop a session, relative to this file.
        file: Option<At<String>>,
        /// In place of `file`: "none", no rule stops a session.
        session_rules: Option<At<String>>,
        /// Whole effective dead time of the loop; default the least that the loop can have.
        loop_delay: Option<Quantity>,
        /// Standard deviation of the command delay, per packet.
        delay_jitter: Option<Quantity> => delay_jitter,
        /// Probability that a command packet is lost.
        drop_probability: Option<Quantity> => drop_probability,
        /// Growth of the command delay with time: clocks of unequal rate; default zero.
        clock_skew: Option<Quantity> => clock_skew,
        /// Period over which the robots hold a command instead of interpolating; default zero: they interpolate.
        command_hold: Option<Quantity> => command_hold,
        /// Ticks during which a lost command is extrapolated along its twist; default 2.
        drop_hold_ticks: Option<At<u32>>,
        /// Share of the relative translation that robot 1 (part A) makes; default 1/2.
        robot1_share: Option<Quantity>,
        /// Speed limit of the tools, per axis.
        max_speed: Option<Quantity> => tool_speed_limit,
        /// Rate limit of the tools, per axis.
        max_rate: Option<Quantity> => tool_rotation_limit,
        /// The HIL loop counts as diverged above this relative speed of the parts; must be written.
        unstable_speed: Option<Quantity>,
        /// Response of the robot with part A.
        #[serde(default)]
        robot1: ResponseTable,
        /// Response of the robot with part B.
        #[serde(default)]
        robot2: ResponseTable,
        /// Admittance of robot 1: its motion under the measured wrench.
        impedance: Option<At<ImpedanceTable>>,
        /// A known motion that is added to the robots' reference.
        test_motion: Option<TestMotionTable>,
        /// Both robots joint by joint, in place of their responses.
        joint_level: Option<At<JointLevelTable>>,
        /// The rail under robot 1.
        rail: Option<RailTable>,
        /// The force/torque sensor.
        #[serde(default)]
        sensor: SensorTable,
        /// What the facility does against its own delay; default nothing.
        compensator: Option<CompensatorTable>,
        /// Differences between facility and space.
        #[serde(default)]
        errors: ErrorsTable,
        /// Part B's mount on robot 2; default rigid.
        #[serde(default)]
        fixture: FixtureTable,
        /// A mass that sways in the simulated target; default none.
        #[serde(default)]
        slosh: ModeTable,
        /// A flexible appendage of the simulated target; default none.
        #[serde(default)]
        appendage: ModeTable,
    }

    /// A known motion added to part A's command; the metrics `tracking_...` measure how the robots follow it.
    TestMotionTable of Params {
        /// Direction in the laboratory, three numbers.
        axis: At<Vec<At<f64>>>,
        /// "sine"; "run": out at constant speed for half a period, then standing; "trapezoid": the same with ramps of speed.
        waveform: At<String>,
        /// Amplitude of the sine, or length of the run or trapezoid.
        amplitude: Quantity => test_amplitude,
        /// Frequency of the sine; a run or trapezoid takes half a period.
        frequency: Quantity => test_frequency,
        /// Time at which it begins; default at once.
        begin: Option<Quantity>,
        /// Gain, lag and error count from so long after the beginning, over whole periods; default at once.
        settle: Option<Quantity>,
    }

    /// Delay compensation between the measured wrench and the simulated bodies; each kind takes its own keys.
    CompensatorTable of Params {
        /// none, first_order_lead, second_order_lead, smith, virtual_damping, passivity or lead_passivity.
        kind: At<String>,
        /// Delay that it assumes: of the lead, of the prediction, of the virtual damping.
        delay: Option<Quantity> => compensator_delay,
        /// Time constant of the low-pass on the derivative of a lead; default none.
        lag: Option<Quantity> => compensator_lag,
        /// Contact stiffness that it assumes.
        stiffness: Option<Quantity> => compensator_stiffness,
        /// Share by which virtual damping, or a lead that was switched up, exceeds what the delay asks for; default 0.
        margin: Option<Quantity> => compensator_margin,
        /// Contact damping whose loss the energy observer allows for; default none.
        damping: Option<Quantity> => compensator_damping,
        /// Energy that the facility may have given in a contact before damping is injected.
        energy: Option<Quantity> => compensator_energy,
        /// Measured force above which the parts are taken to touch; default zero.
        threshold: Option<Quantity> => compensator_threshold,
        /// Whether the compensated force may pull parts that only push each other; default false.
        pulls: Option<At<bool>>,
    }

    /// w^2 (1 + T_z s) / (s^2 + 2 z w s + w^2).
    #[derive(Default)]
    ResponseTable of Params {
        /// 1/w; default zero: ideal.
        lag: Option<Quantity> => robot1_lag | robot2_lag,
        /// z; default 1.
        damping: Option<Quantity> => robot1_lag_damping | robot2_lag_damping,
        /// T_z; default zero.
        zero: Option<Quantity> => robot1_lag_zero | robot2_lag_zero,
    }

    /// A linear axis.
    RailTable of Params {
        /// Direction in the laboratory.
        axis: At<Vec<At<f64>>>,
        /// Share of robot 1's displacement along the axis.
        share: Quantity,
        /// 1/w of its response; default zero: ideal.
        lag: Option<Quantity> => rail_lag,
        /// z of its response; default 1.
        damping: Option<Quantity> => rail_lag_damping,
    }

    /// The force/torque sensor; vectors in its own axes, which are part A's.
    #[derive(Default)]
    SensorTable of Params {
        /// Sampling period, a whole number of substeps; default one substep.
        period: Option<Quantity>,
        /// Delay of the measured wrench, a part of the loop delay.
        delay: Option<Quantity> => sensor_delay,
        /// Time constant of the low-pass.
        lag: Option<Quantity> => sensor_lag,
        /// Standard deviation of the force noise.
        noise_force: Option<Quantity> => sensor_noise_force,
        /// Standard deviation of the moment noise.
        noise_moment: Option<Quantity> => sensor_noise_moment,
        /// Force bias.
        bias_force: Option<Quantities> => sensor_bias_force,
        /// Moment bias.
        bias_moment: Option<Quantities> => sensor_bias_moment,
        /// Drift of the force from the start on.
        drift_force: Option<Quantities> => sensor_drift_force,
        /// Drift of the moment from the start on.
        drift_moment: Option<Quantities> => sensor_drift_moment,
        /// Whether it is tared at the start pose before each run; default false.
        tared: Option<At<bool>>,
        /// Error of the tare, force.
        tare_error_force: Option<Quantities> => tare_error_force,
        /// Error of the tare, moment.
        tare_error_moment: Option<Quantities> => tare_error_moment,
        /// Its load besides the contact; default none.
        load: Option<LoadTable>,
        /// Relative gain error of the force.
        gain_force: Option<Quantities> => sensor_gain_force,
        /// Relative gain error of the moment.
        gain_moment: Option<Quantities> => sensor_gain_moment,
        /// Factor on the crosstalk pattern.
        crosstalk: Option<Quantity> => sensor_crosstalk,
        /// 6 x 6 pattern (fx fy fz mx my mz, SI); default: ones between the forces and between the moments.
        crosstalk_pattern: Option<At<Vec<Vec<f64>>>>,
        /// Force quantisation.
        resolution_force: Option<Quantity> => sensor_resolution_force,
        /// Moment quantisation.
        resolution_moment: Option<Quantity> => sensor_resolution_moment,
        /// Force at which it saturates.
        range_force: Option<Quantity> => sensor_range_force,
        /// Moment at which it saturates.
        range_moment: Option<Quantity> => sensor_range_moment,
    }

    /// Part A behind the sensor, a point mass in the laboratory's gravity, and the facility's errors about it.
    LoadTable of Params {
        /// Mass.
        mass: Quantity,
        /// Centre in part A's frame.
        centre: Quantities,
        /// Gravity in the laboratory's axes, which are those of the contact frame.
        gravity: Quantities,
        /// Whether the facility subtracts the inertia force too; default true.
        inertia_compensated: Option<bool>,
        /// Relative error of the mass that the facility assumes.
        mass_error: Option<Quantity> => load_mass_error,
        /// Error of the centre that the facility assumes.
        centre_error: Option<Quantities> => load_centre_error,
    }

    /// Differences between facility and space; relative ones, but for the place.
    #[derive(Default)]
    ErrorsTable of Params {
        /// Target mass in the facility's simulation.
        mass: Option<Quantity> => mass_error,
        /// Target inertia in the facility's simulation.
        inertia: Option<Quantity> => inertia_error,
        /// Centre of mass of the target in the facility's simulation, target's body axes.
        centre_of_mass: Option<Quantities> => target_com_error,
        /// Stiffness of the mounted parts.
        contact_stiffness: Option<Quantity> => contact_stiffness_error,
        /// Damping of the mounted parts.
        contact_damping: Option<Quantity> => contact_damping_error,
        /// Friction of the mounted parts.
        contact_friction: Option<Quantity> => contact_friction_error,
        /// Exponent of force over depth of the mounted parts: the spring times (d / 1 mm)^e.
        contact_exponent: Option<Quantity> => contact_exponent_error,
        /// Share s of the mounted parts' friction mu (1 + s exp(-|v| / v_s)) that falls with the sliding speed.
        contact_stribeck: Option<Quantity> => contact_stribeck,
        /// The speed v_s of it; default 10 mm/s.
        contact_stribeck_speed: Option<Quantity> => contact_stribeck_speed,
        /// Share a of the mounted parts' friction mu (1 + a cos 2 theta), theta from part B's y axis.
        contact_anisotropy: Option<Quantity> => contact_anisotropy,
        /// Tension of each contact point of the mounted parts before it separates.
        contact_adhesion: Option<Quantity> => contact_adhesion,
        /// Place of part A on its robot, laboratory axes.
        place: Option<Quantities> => place_error,
        /// Delay of the measured wrench beyond the sensor's own, which the loop's delay does not hold.
        sensor_delay: Option<Quantity> => sensor_delay_error,
    }

    /// A mass on a spring and damper under part B, three equal translations.
    #[derive(Default)]
    FixtureTable of Params {
        /// Displacement per force; default zero: rigid.
        compliance: Option<Quantity> => fixture_compliance,
        /// Frequency; default 40 Hz.
        frequency: Option<Quantity> => fixture_frequency,
        /// Damping ratio; default 0.02.
        damping: Option<Quantity> => fixture_damping,
    }

    /// A hidden mass on a spring at the simulated target's centre of mass.
    #[derive(Default)]
    ModeTable of Params {
        /// Its share of the target's mass; default zero: none.
        share: Option<Quantity> => slosh_share | appendage_share,
        /// Its frequency in a fixed target; default 0.5 Hz (slosh), 3 Hz (appendage).
        frequency: Option<Quantity> => slosh_frequency | appendage_frequency,
        /// Damping ratio; default 0.02 (slosh), 0.005 (appendage).
        damping: Option<Quantity> => slosh_damping | appendage_damping,
    }
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
