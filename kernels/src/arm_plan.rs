//! What the arm in space shall do: its controllers, and the phases of its motion with the guards that end them.

use crate::vector::Pose;

/// The most arm joints that a scenario may have.
pub const MAX_JOINTS: usize = 8;

/// The arm's joint controller, about a posture or pose that it holds or that a phase's move leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArmControl {
    /// Torque = kp (q0 - q) + kd (q0' - q').
    JointPd {
        /// Stiffness per joint \[N m/rad\].
        stiffness: [f64; MAX_JOINTS],
        /// Damping per joint \[N m s/rad\].
        damping: [f64; MAX_JOINTS],
    },
    /// Inverse dynamics of the free-floating arm with q'' = q0'' + w^2 (q0 - q) + 2 z w (q0' - q').
    ComputedTorque {
        /// Bandwidth w \[rad/s\].
        bandwidth: f64,
        /// Damping ratio z.
        damping_ratio: f64,
    },
    /// End-effector spring and damper to its wanted pose relative to the base, joint damping for the null space.
    CartesianImpedance {
        /// Translational stiffness \[N/m\].
        stiffness: f64,
        /// Translational damping \[N s/m\].
        damping: f64,
        /// Rotational stiffness \[N m/rad\].
        rotation_stiffness: f64,
        /// Rotational damping \[N m s/rad\].
        rotation_damping: f64,
        /// Joint damping \[N m s/rad\].
        joint_damping: f64,
    },
}

impl ArmControl {
    /// Whether it leads the end-effector, not the joints.
    pub fn is_cartesian(&self) -> bool {
        matches!(self, Self::CartesianImpedance { .. })
    }
}

/// The arm's motion: phases one after the other, what the arm measures of contact and target.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmPlan {
    /// The phases; the run starts with the first. At least one.
    pub phases: Vec<ArmPhase>,
    /// What sees part B, if there is a camera.
    pub camera: Option<Camera>,
    /// Time in which the fingers close or open \[s\]; 0 = there are none.
    pub grip_time: f64,
    /// Time constant of the arm's own force sensor \[s\]; 0 = none.
    pub sensor_lag: f64,
}

/// One phase: a controller, where it leads the arm, and what ends it.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmPhase {
    /// Its name.
    pub name: String,
    /// The controller.
    pub control: ArmControl,
    /// Where it moves the arm.
    pub goal: Goal,
    /// How fast.
    pub pace: Pace,
    /// How the wanted pose gives way to the measured wrench; only under a Cartesian controller.
    pub compliance: Option<Compliance>,
    /// Whether the fingers close in it, or open; none: they stay as they are wanted.
    pub closes: Option<bool>,
    /// What ends it; of several that hold, the first.
    pub guards: Vec<ArmGuard>,
}

/// Where a phase moves the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// Nowhere: it holds what was wanted when it began.
    Hold,
    /// To joint angles, from the start posture \[rad\].
    Joints([f64; MAX_JOINTS]),
    /// Part A's frame to a pose in the base's body frame.
    Base(Pose<f64>),
    /// Part A's frame to a pose in part B's frame, as the camera sees part B.
    PartB(Pose<f64>),
}

/// Limits of a move from rest to rest; for joint goals in rad instead of m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Greatest speed \[m/s\].
    pub speed: f64,
    /// Greatest acceleration \[m/s^2\].
    pub acceleration: f64,
    /// Greatest jerk \[m/s^3\].
    pub jerk: f64,
    /// Greatest angular speed of part A; its acceleration and jerk are limited in the same proportion \[rad/s\].
    pub turn_speed: f64,
}

/// How the wanted pose gives way: M x'' + D x' + K x = measured + pressed, in part A's wanted axes; x y z and the
/// rotations about them. Where the inverse of M is 0 it does not give way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compliance {
    /// Inverse of M \[1/kg\], \[1/(kg m^2)\].
    pub inverse_mass: [f64; 6],
    /// D \[N s/m\], \[N m s/rad\].
    pub damping: [f64; 6],
    /// K \[N/m\], \[N m/rad\].
    pub stiffness: [f64; 6],
    /// Force and moment that part A shall exert on part B \[N\], \[N m\].
    pub press: [f64; 6],
}

/// What ends a phase: all that it names must hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmGuard {
    /// The move has ended.
    pub arrived: bool,
    /// The latch has closed.
    pub captured: bool,
    /// The fingers have closed, or opened, as the phase wants.
    pub gripped: bool,
    /// The measured contact force is at least this \[N\].
    pub force: Option<f64>,
    /// The measured contact force is below this \[N\].
    pub force_below: Option<f64>,
    /// The phase has lasted at least this long \[s\].
    pub after: Option<f64>,
    /// Index of the phase that follows.
    pub next: usize,
}

impl ArmGuard {
    /// One that holds at once.
    pub const fn to(next: usize) -> Self {
        Self { arrived: false, captured: false, gripped: false, force: None, force_below: None, after: None, next }
    }
}

/// The most images of a camera that are under way: its delay is at most one period less than this.
pub const IMAGES: usize = 4;

/// A camera that measures part B's pose relative to part A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Ticks between two images, at least 1.
    pub period: u32,
    /// Ticks from an image to its result, at most `(IMAGES - 1) * period`.
    pub delay: u32,
    /// Standard deviation of the position in each image, per axis \[m\].
    pub noise_position: f64,
    /// Standard deviation of the attitude in each image, per axis \[rad\].
    pub noise_rotation: f64,
    /// Time constant with which the images are smoothed \[s\]; 0 = none.
    pub smoothing: f64,
}

impl Camera {
    /// Whether its images are noisy.
    pub fn is_noisy(&self) -> bool {
        self.noise_position > 0.0 || self.noise_rotation > 0.0
    }
}
