//! The constants of one scenario: bodies, arm, parts, rates, controllers, facility, task; plain f64 in SI.
//!
//! A stage reads them as literals: on the CPU they are broadcast, in a trace they fold into the WGSL.
//! What may vary from run to run is not here but in [`Params`].

use crate::arm_plan::ArmPlan;
pub use crate::arm_plan::{ArmControl, MAX_JOINTS};
pub use crate::chain::Link;
pub use crate::contact_parts::{
    Contact, ContactPoint, ENDLESS, Finger, Hook, Latch, MaterialPair, Members, PartShape, Shape, Side, Solid,
};
use crate::manipulator::cell::{AXES, Carriage, Mount, Servo};
use crate::manipulator::{ArmDrive, Manipulator};
pub use crate::material::NormalLaw;
use crate::params::Params;
pub use crate::stewart::{CaptureRing, Leg};
pub use crate::timing::Timing;
use crate::vector::{Pose, Quat, Sym3, Vec3, vec3};

/// Calls a function that is generic in the joint count with the plant's own.
#[macro_export]
macro_rules! with_joints {
    ($count:expr, $function:ident($($argument:expr),*)) => {
        match $count {
            0 => $function::<0>($($argument),*),
            1 => $function::<1>($($argument),*),
            2 => $function::<2>($($argument),*),
            3 => $function::<3>($($argument),*),
            4 => $function::<4>($($argument),*),
            5 => $function::<5>($($argument),*),
            6 => $function::<6>($($argument),*),
            7 => $function::<7>($($argument),*),
            8 => $function::<8>($($argument),*),
            more => unreachable!("the loader refuses {more} joints"),
        }
    };
}
/// Everything that the kernels need to know of a scenario.
///
/// The *contact frame* has its origin at the nominal contact point and is inertial; `+x` is the
/// approach axis, from part A towards part B. All poses below are given in it unless stated otherwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Ticks, substeps and the end of a run.
    pub timing: Timing,
    /// The chaser's base: inertia about its centre of mass, body axes; nominal mass is in `nominal`.
    pub base_inertia: Sym3<f64>,
    /// Nominal start pose of the base (its centre of mass and body axes).
    pub base_pose: Pose<f64>,
    /// Links from the base to the end-effector; each turns about its own z axis, or slides along it.
    pub links: Vec<Link>,
    /// Which joints slide; empty: all turn. Their coordinates are in m, their torques forces in N, and so on.
    pub slides: Vec<bool>,
    /// Pose of part A in the last link's frame (in the base's body frame if there is no link).
    pub tool: Pose<f64>,
    /// Drives of the joints; none: the controller's torques act on the joints themselves.
    pub drives: Vec<ArmDrive>,
    /// When the arm's brakes close.
    pub brakes: Brakes,
    /// Start angles of the joints, also the posture that the arm controllers hold \[rad, m\].
    pub start_angles: Vec<f64>,
    /// The target: inertia about its centre of mass, body axes; nominal mass is in `nominal`.
    pub target_inertia: Sym3<f64>,
    /// Nominal start pose of the target (its centre of mass and body axes).
    pub target_pose: Pose<f64>,
    /// Pose of part B in the target's body frame.
    pub seat: Pose<f64>,
    /// Soft capture ring between part B and the target; none: part B is fixed to the target.
    pub ring: Option<CaptureRing>,
    /// Which bodies stand still in the contact frame.
    pub held: Held,
    /// The contact pair.
    pub contact: Contact,
    /// What the chaser does.
    pub guidance: Guidance,
    /// Orbital rate for Clohessy-Wiltshire relative gravity \[rad/s\]; 0 = none. Contact-frame axes are read as
    /// LVLH: x radial, y along-track, z cross-track, rotated by `orbit_axes`.
    pub orbit_rate: f64,
    /// Rotation from LVLH axes to the contact frame.
    pub orbit_axes: Quat<f64>,
    /// Constant acceleration of the chaser alone, a test field (a block that rests on part B's incline) \[m/s^2\].
    pub field: Vec3<f64>,
    /// The facility that closes the HIL loop.
    pub facility: Facility,
    /// When a run counts as a success, and when it is over.
    pub task: Task,
    /// Parameters of the undispersed run.
    pub nominal: Params<f64>,
}

impl Model {
    /// Whether a joint, counted from the base, slides along its z axis.
    pub fn slides(&self, joint: usize) -> bool {
        self.slides.get(joint).copied().unwrap_or(false)
    }

    /// Pose of a link in its parent's frame at a joint angle \[rad\], or a travel \[m\].
    pub fn link_pose(&self, joint: usize, angle: f64) -> Pose<f64> {
        self.links[joint].origin.compose(joint_motion(self.slides(joint), angle))
    }

    /// Two free bodies of unit inertia on an ideal facility: a point of part A `gap` \[m\] before a plane of part B, along
    /// x. Both parts are at their body's centre of mass; all parameters are null.
    pub fn two_bodies(timing: Timing, gap: f64) -> Self {
        let inertia = Sym3::diagonal(vec3(1.0, 1.0, 1.0));
        let joints = [0.0; MAX_JOINTS];
        Self {
            timing,
            base_inertia: inertia,
            base_pose: Pose { position: vec3(-gap, 0.0, 0.0), attitude: Quat::identity() },
            links: Vec::new(),
            slides: Vec::new(),
            tool: Pose::identity(),
            drives: Vec::new(),
            brakes: Brakes::Open,
            start_angles: Vec::new(),
            target_inertia: inertia,
            target_pose: Pose::identity(),
            seat: Pose::identity(),
            ring: None,
            held: Held::NONE,
            contact: Contact {
                a: PartShape { points: vec![ContactPoint { position: Vec3::zero(), radius: 0.0 }], solids: Vec::new() },
                b: PartShape {
                    points: Vec::new(),
                    solids: vec![Solid { frame: Pose::identity(), shape: Shape::Plane }],
                },
                law: NormalLaw::Linear,
                pairs: Vec::new(),
                patch_radius: 0.0,
                bilateral: false,
                latch: None,
                fingers: Vec::new(),
            },
            guidance: Guidance {
                thrust: Thrust::Off,
                thrusters: None,
                arm: ArmControl::JointPd { stiffness: joints, damping: joints },
                plan: None,
            },
            orbit_rate: 0.0,
            orbit_axes: Quat::identity(),
            field: Vec3::zero(),
            facility: Facility::IDEAL,
            task: Task::OPEN,
            nominal: Params::null(),
        }
    }
}

/// Motion of a joint from its zero: a turn about z by an angle \[rad\], or a travel along z \[m\].
pub fn joint_motion(slides: bool, place: f64) -> Pose<f64> {
    match slides {
        true => Pose { position: vec3(0.0, 0.0, place), attitude: Quat::identity() },
        false => {
            let attitude = Quat { w: (0.5 * place).cos(), v: vec3(0.0, 0.0, (0.5 * place).sin()) };
            Pose { position: Vec3::zero(), attitude }
        }
    }
}

/// The bodies that stand on a mount which does not move, whatever pushes them.
///
/// A held body has neither mass nor momentum: its mount takes every wrench. The links of an arm on a held base move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Held {
    /// The chaser's base; with it all that the arm does not move.
    pub base: bool,
    /// The target.
    pub target: bool,
}

impl Held {
    /// Both bodies float freely.
    pub const NONE: Self = Self { base: false, target: false };
}

/// When the brakes of an arm are closed; its motors are off then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Brakes {
    /// Never.
    Open,
    /// From the start.
    Closed,
    /// From the first touch, as the loop has it.
    CloseAtTouch,
}

/// What the chaser does: thrust on the base, torques at the joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Guidance {
    /// Thrust during the approach; ends at first touch.
    pub thrust: Thrust,
    /// Attitude control of the base by thruster pulses, if it has any.
    pub thrusters: Option<Thrusters>,
    /// The arm's controller, where the arm has no plan.
    pub arm: ArmControl,
    /// The phases of the arm's motion; none: its controller holds the start posture.
    pub plan: Option<ArmPlan>,
}

/// Thrusters that hold the base's attitude of the start, each body axis for itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thrusters {
    /// Torque of each axis \[N m\].
    pub torque: Vec3<f64>,
    /// A pulse begins where error + lead x rate leaves this \[rad\].
    pub deadband: f64,
    /// Lead \[s\].
    pub lead: f64,
    /// Ticks of a pulse, at least 1.
    pub pulse: u32,
    /// They are off from the first touch.
    pub off_at_touch: bool,
}

/// Base thrust during a docking approach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thrust {
    /// The chaser coasts.
    Off,
    /// PD on part A's velocity along the approach axis and position across it, and on the base's attitude rate.
    Approach {
        /// Velocity gain along the approach axis \[N s/m\].
        speed_gain: f64,
        /// Lateral position gain \[N/m\].
        lateral_stiffness: f64,
        /// Lateral velocity gain \[N s/m\].
        lateral_damping: f64,
        /// Attitude gain \[N m/rad\].
        attitude_stiffness: f64,
        /// Rate gain \[N m s/rad\].
        attitude_damping: f64,
        /// Force limit per axis \[N\].
        max_force: f64,
        /// Torque limit per axis \[N m\].
        max_torque: f64,
    },
}

/// The hardware-in-the-loop facility.
#[derive(Clone, Debug, PartialEq)]
pub struct Facility {
    /// Share of the relative translation that robot 1 (part A) makes, the rest is robot 2's (part B).
    pub robot1_share: f64,
    /// The rail under robot 1: its axis in the laboratory and its share of robot 1's motion along it.
    pub rail: Option<Rail>,
    /// Ticks during which a lost command is replaced by the last pose, extrapolated along its twist;
    /// after that the pose alone is held.
    pub drop_hold_ticks: u32,
    /// The sensor samples every this many substeps.
    pub sensor_substeps: u32,
    /// Crosstalk pattern C: measured = true + crosstalk * C true; rows and columns fx fy fz mx my mz (SI).
    pub crosstalk: [[f64; 6]; 6],
    /// The HIL loop counts as diverged above this relative speed of the simulated parts \[m/s\].
    pub unstable_speed: f64,
    /// The rules that stop a session on the robots.
    pub rules: SessionRules,
    /// The robots that a session drives, and what their axes may do; none: no axis limits a command.
    pub session_robots: Option<SessionRobots>,
    /// What the facility does against its own delay.
    pub compensator: Compensator,
    /// Load of the sensor besides the contact; none for a part without weight.
    pub load: Option<SensorLoad>,
    /// The sensor is tared at the start pose before each run.
    pub tared: bool,
    /// Admittance of robot 1 under the measured wrench; without one it follows its command alone.
    pub impedance: Option<ImpedanceLaw>,
    /// A motion that is added to the robots' reference.
    pub test_motion: Option<TestMotion>,
    /// Both robots joint by joint; without it they follow their commands with the lag of `Params`.
    pub joint_level: Option<JointLevel>,
}

impl Facility {
    /// Half the motion on each robot, nothing besides, and no rule that stops a session.
    pub const IDEAL: Self = Self {
        robot1_share: 0.5,
        rail: None,
        drop_hold_ticks: 3,
        sensor_substeps: 1,
        crosstalk: [[0.0; 6]; 6],
        unstable_speed: 1e6,
        rules: SessionRules::NONE,
        session_robots: None,
        compensator: Compensator::NONE,
        load: None,
        tared: false,
        impedance: None,
        test_motion: None,
        joint_level: None,
    };
}

/// The rules that stop a session on the robots; a limit that is not in force is infinite.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionRules {
    /// Measured force \[N\].
    pub force: f64,
    /// Measured moment about part A's origin \[N m\].
    pub moment: f64,
    /// Change of the measured force from cycle to cycle \[N/s\].
    pub force_rate: f64,
    /// A saturated channel of the sensor stops the session.
    pub sensor_saturation: bool,
    /// Energy injected by the facility: through the port on the simulated side, less the work of the measured wrench on
    /// the reported motion \[J\].
    pub injected_energy: f64,
    /// Distance of a tool from its command \[m\].
    pub following_error: f64,
    /// Angle between a tool and its command \[rad\].
    pub following_rotation: f64,
    /// Distance of a commanded tool from the start of the run \[m\].
    pub tool_reach: f64,
    /// Angle of a commanded tool from the start of the run \[rad\].
    pub tool_rotation: f64,
    /// Time during which commands may be cut without a pause \[s\].
    pub clamp_time: f64,
    /// Speed of a commanded tool \[m/s\].
    pub tool_speed: f64,
    /// Boxes that no link and no tool may enter; at most [`MAX_KEEP_OUT`].
    pub keep_out: Vec<KeepOut>,
    /// Least distance between the arms, without the links that hold the parts \[m\].
    pub arm_distance: f64,
    /// Least angle of wrist, elbow and shoulder from their singular postures \[rad\].
    pub singularity: f64,
}

/// The most keep-out boxes that a facility may have.
pub const MAX_KEEP_OUT: usize = 4;

/// A box of the laboratory that no link and no tool may enter.
#[derive(Clone, Debug, PartialEq)]
pub struct KeepOut {
    /// Its name.
    pub name: String,
    /// Its centre and axes in the laboratory.
    pub frame: Pose<f64>,
    /// Half edge lengths \[m\].
    pub half: Vec3<f64>,
}

/// The robots that a session drives, and what it may ask of their axes.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionRobots {
    /// Both robots in their places; only where their joints stand counts, not how they are driven.
    pub level: JointLevel,
    /// Limits of the joints of both robots, in the model's angles, and of the rail.
    pub limits: [AxisRange; AXES],
    /// Greatest way of a joint from the start of the run, of robots 1 and 2 \[rad\].
    pub correction: [f64; 2],
    /// Radius of each robot's tool about the line from the last link's frame to the part's origin \[m\].
    pub tool_radius: [f64; 2],
}

/// What a session may ask of an axis; rad for joints, m for the rail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisRange {
    /// Least position.
    pub lower: f64,
    /// Greatest position.
    pub upper: f64,
    /// Greatest speed \[1/s\].
    pub speed: f64,
    /// Greatest acceleration \[1/s^2\].
    pub acceleration: f64,
}

/// Impedance of robot 1: M X'' + B X' + K X = measured wrench; SI, laboratory axes, x y z and rotations about them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpedanceLaw {
    /// Inverse of M.
    pub inverse_mass: [[f64; 6]; 6],
    /// B.
    pub damping: [[f64; 6]; 6],
    /// K.
    pub stiffness: [[f64; 6]; 6],
}

/// A known motion added to part A's command; its amplitude and frequency are parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestMotion {
    /// Along a unit vector in the laboratory.
    pub axis: Vec3<f64>,
    /// How it goes.
    pub waveform: Waveform,
    /// It begins at this time of the run \[s\].
    pub begin: f64,
    /// Gain, lag and error count from so long after that, over whole periods \[s\].
    pub settle: f64,
}

/// The form of a test motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Waveform {
    /// A sine.
    Sine,
    /// Out by the amplitude at constant speed in half a period, then standing.
    Run,
    /// Out at constant speed for half a period, with a quarter of it to rise and a quarter to fall.
    Trapezoid,
}

/// Two robots of one make, with their drives and controllers.
#[derive(Clone, Debug, PartialEq)]
pub struct JointLevel {
    /// The robot.
    pub robot: Manipulator,
    /// Where robot 1 (part A) and robot 2 (part B) stand, and what they hold.
    pub mounts: [Mount; 2],
    /// The controllers of their joints.
    pub servo: Servo,
    /// What robot 1 stands on, if there is a rail.
    pub carriage: Option<Carriage>,
}

/// Part A as the sensor carries it: a point mass in the laboratory's gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorLoad {
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre in the part's frame \[m\].
    pub centre: Vec3<f64>,
    /// Gravity, laboratory axes \[m/s^2\].
    pub gravity: Vec3<f64>,
    /// The facility subtracts the inertia force too, not the weight alone.
    pub inertia_compensated: bool,
}

/// The delay compensation between the measured wrench and the simulated bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Compensator {
    /// Its kind; its numbers are parameters.
    pub kind: CompensatorKind,
    /// Whether the compensated force may pull parts that only push each other.
    pub pulls: bool,
}

/// Kinds of delay compensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompensatorKind {
    /// The measured wrench acts as it arrives.
    None,
    /// F + c F'.
    FirstOrderLead,
    /// F + c F' + c^2/2 F''.
    SecondOrderLead,
    /// A spring model bridges the delay.
    Smith,
    /// A damper on the undelayed velocity.
    VirtualDamping,
    /// Energy observer and damping injection.
    Passivity,
    /// Lead with a gain that an energy observer switches, and damping injection.
    LeadPassivity,
}

impl Compensator {
    /// No compensation.
    pub const NONE: Self = Self { kind: CompensatorKind::None, pulls: false };
}

impl CompensatorKind {
    /// The kinds by their names in scenario files.
    pub const NAMES: [(&'static str, Self); 7] = [
        ("none", Self::None),
        ("first_order_lead", Self::FirstOrderLead),
        ("second_order_lead", Self::SecondOrderLead),
        ("smith", Self::Smith),
        ("virtual_damping", Self::VirtualDamping),
        ("passivity", Self::Passivity),
        ("lead_passivity", Self::LeadPassivity),
    ];

    /// The parameters that a kind reads, without their prefix `compensator_`.
    pub fn parameters(self) -> &'static [&'static str] {
        match self {
            Self::None => &[],
            Self::FirstOrderLead | Self::SecondOrderLead => &["delay", "lag", "threshold"],
            Self::Smith => &["delay", "stiffness", "threshold"],
            Self::VirtualDamping => &["delay", "stiffness", "margin", "threshold"],
            Self::Passivity => &["damping", "energy", "threshold"],
            Self::LeadPassivity => &["delay", "lag", "margin", "damping", "energy", "threshold"],
        }
    }
}

/// A linear axis under robot 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rail {
    /// Unit vector in the laboratory.
    pub axis: Vec3<f64>,
    /// Share of robot 1's displacement along the axis, 0..1.
    pub share: f64,
}

/// Success and end of a run; a limit that is not used is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Task {
    /// Success needs a closed latch.
    pub capture: bool,
    /// Success needs a first touch.
    pub touch: bool,
    /// Success needs a peak contact force, latch excluded, of at most this \[N\].
    pub max_contact_force: f64,
    /// Success needs a peak interface force, contact and latch together, of at most this \[N\].
    pub max_interface_force: f64,
    /// Success needs capture (or the end of contact) by this time \[s\].
    pub max_time: f64,
    /// Success needs a restitution of at most this.
    pub max_restitution: f64,
    /// Success needs an insertion of at least this \[m\]; minus infinity = none.
    pub min_insertion: f64,
    /// A run is over this long after the parts have separated \[s\]; infinite = never.
    pub end_after_separation: f64,
    /// A loop is over this long after capture, in space and on the facility \[s\]; infinite = never.
    pub end_after_capture: [f64; 2],
    /// A contact deeper than this is a numerical failure (penetration limit), in space and on the facility \[m\].
    pub max_depth: f64,
}

impl Task {
    /// No criterion, and no end but the run's last tick.
    pub const OPEN: Self = Self {
        capture: false,
        touch: false,
        max_contact_force: f64::INFINITY,
        max_interface_force: f64::INFINITY,
        max_time: f64::INFINITY,
        max_restitution: f64::INFINITY,
        min_insertion: f64::NEG_INFINITY,
        end_after_separation: f64::INFINITY,
        end_after_capture: [f64::INFINITY; 2],
        max_depth: 1e6,
    };
}
