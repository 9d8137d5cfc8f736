//! The scenario file as written.

use super::campaign::OneOrMore;
use super::effect::EffectTable;
use super::facility::FacilityTable;
use super::{At, Quantities, Quantity, file_table};
use schemars::JsonSchema;
use serde::Deserialize;
use softdock_kernels::params::Params;
use std::collections::BTreeMap;

/// A contact task and the facility on which it is tested: bodies, arm, parts, rates, controllers, success.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "softdock scenario")]
pub(crate) struct ScenarioFile {
    /// Format and version of this file: "scenario/1".
    pub(crate) schema: At<String>,
    /// Name of the scenario: letters, digits, - and _.
    pub(crate) id: At<String>,
    /// One line for people.
    pub(crate) title: At<String>,
    /// Step, command period and end.
    pub(crate) timing: TimingTable,
    /// The chaser's body.
    pub(crate) base: BaseTable,
    /// The manipulator; without it part A is mounted on the base.
    pub(crate) arm: Option<ArmTable>,
    /// The part on the end-effector.
    pub(crate) part_a: PartATable,
    /// The body with part B.
    pub(crate) target: TargetTable,
    /// The part on the target.
    pub(crate) part_b: PartBTable,
    /// How the parts push.
    pub(crate) contact: At<ContactTable>,
    /// Soft capture ring between part B and the target; without it part B is fixed to the target.
    pub(crate) soft_capture: Option<At<SoftCaptureTable>>,
    /// The capture latch, if there is one.
    pub(crate) latch: Option<LatchTable>,
    /// Motion at the start.
    pub(crate) start: StartTable,
    /// What the chaser does before the first touch.
    #[serde(default)]
    pub(crate) guidance: GuidanceTable,
    /// Relative gravity (Clohessy-Wiltshire); without it there is none.
    pub(crate) orbit: Option<OrbitTable>,
    /// A constant acceleration of the chaser, as a test field.
    pub(crate) field: Option<FieldTable>,
    /// The facility that closes the HIL loop; beside the rules of its sessions an ideal one by default.
    pub(crate) facility: At<FacilityTable>,
    /// Success and end of a run.
    pub(crate) task: TaskTable,
    /// Effects that a diagnosis found, and that the facility has from now on.
    #[serde(default)]
    pub(crate) effect: Vec<EffectTable>,
}

/// Rates of the loop.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TimingTable {
    /// Integration step; default "0.25 ms".
    pub(crate) substep: Option<Quantity>,
    /// Command period, a whole number of substeps; default "1 ms".
    pub(crate) tick: Option<Quantity>,
    /// A run ends after this.
    pub(crate) time_limit: Quantity,
}

/// Moments of inertia about the centre of mass; off-diagonal ones are matrix elements and default to zero.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct InertiaTable {
    pub(crate) ixx: Quantity,
    pub(crate) iyy: Quantity,
    pub(crate) izz: Quantity,
    pub(crate) ixy: Option<Quantity>,
    pub(crate) ixz: Option<Quantity>,
    pub(crate) iyz: Option<Quantity>,
}

/// The chaser's body, without the arm.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct BaseTable {
    /// The base stands on a mount that does not move, whatever pushes it; before it a free target moves at
    /// `start.closing_speed`. Default false: it floats freely.
    pub(crate) held: Option<At<bool>>,
    /// Mass; required of a free base, refused of a held one. Without an arm it and the inertia may follow from
    /// the density of part A's meshes instead.
    pub(crate) mass: Option<Quantity>,
    /// Inertia about the centre of mass, body axes; as the mass.
    pub(crate) inertia: Option<At<InertiaTable>>,
    /// Start position of the centre of mass in the contact frame; only without `start.gap`.
    pub(crate) position: Option<Quantities>,
    /// Start attitude in the contact frame as roll, pitch, yaw; only without `start.gap`.
    pub(crate) rotation: Option<Quantities>,
    /// Thrusters that hold the attitude of the start; without them the base turns freely.
    pub(crate) thrusters: Option<At<ThrustersTable>>,
}

/// Attitude control by thruster pulses, each body axis for itself.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ThrustersTable {
    /// Torque about each body axis while it fires.
    pub(crate) torque: Quantities,
    /// A pulse begins where error + lead x rate leaves this.
    pub(crate) deadband: Quantity,
    /// Lead, which damps.
    pub(crate) lead: Quantity,
    /// Time of a pulse, a whole number of ticks.
    pub(crate) pulse: Quantity,
    /// true: they are off from the first touch; default false.
    pub(crate) off_at_touch: Option<bool>,
}

/// The manipulator.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ArmTable {
    /// URDF file, relative to this file; its root link is the base's body frame.
    pub(crate) urdf: At<String>,
    /// Place of the URDF's root link in the base's body frame; default its origin.
    pub(crate) position: Option<Quantities>,
    /// Attitude of the root link as roll, pitch, yaw.
    pub(crate) rotation: Option<Quantities>,
    /// Start angle of each joint on the chain to part A, from the base outwards; without phases also the posture that is
    /// held. A length for a joint that slides.
    pub(crate) angles: Quantities,
    /// Joints off that chain by their names, with the angle or length at which they are held; the others are held at 0.
    pub(crate) held: Option<BTreeMap<String, Quantity>>,
    /// The controller, of every phase without one of its own.
    pub(crate) controller: Option<At<ControllerTable>>,
    /// Phases of the arm's motion, in order; the run starts with the first. Without any the arm holds its start posture.
    #[serde(default)]
    pub(crate) phase: Vec<At<PhaseTable>>,
    /// Camera that measures part B, for moves relative to it.
    pub(crate) camera: Option<At<CameraTable>>,
    /// Fingers of part A: what of it has a way to `closes`.
    pub(crate) grip: Option<At<GripTable>>,
    /// The arm's own force sensor, for guards and compliance; default without lag.
    pub(crate) sensor: Option<At<ArmSensorTable>>,
    /// Motors, gears, friction, stops and brakes; without this table the controller's torques act on the joints
    /// themselves, without limits.
    pub(crate) drive: Option<At<ArmDriveTable>>,
}

/// A phase of the arm's motion: a controller, a move, and what ends it.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PhaseTable {
    /// Its name.
    pub(crate) name: At<String>,
    /// Its controller; default that of [arm.controller].
    pub(crate) controller: Option<At<ControllerTable>>,
    /// Where it moves the arm, from rest to rest; default: it holds what was wanted when it began.
    pub(crate) to: Option<At<GoalTable>>,
    /// Greatest speed of the move: of part A, or of each joint.
    pub(crate) speed: Option<Quantity>,
    /// Greatest acceleration of the move.
    pub(crate) acceleration: Option<Quantity>,
    /// Greatest jerk of the move; default the acceleration within 0.1 s.
    pub(crate) jerk: Option<Quantity>,
    /// Greatest angular speed of part A; default "5 deg/s". Its acceleration and jerk keep the same proportion to it.
    pub(crate) turn_speed: Option<Quantity>,
    /// How the wanted pose gives way to the measured force: admittance or force control.
    pub(crate) compliance: Option<At<ComplianceTable>>,
    /// "close" or "open": what the fingers do in it; default: they stay as they are, or go on.
    pub(crate) grip: Option<At<String>>,
    /// What ends the phase; of several that hold, the first. Without any it lasts to the end of the run.
    #[serde(default)]
    pub(crate) until: Vec<At<GuardTable>>,
}

/// Where a phase moves the arm: joint angles, or a pose of part A's frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct GoalTable {
    /// Angle of each joint.
    pub(crate) angles: Option<Quantities>,
    /// Frame of the pose: "base" (body frame of the base) or "part_b" (as the camera sees part B).
    pub(crate) frame: Option<At<String>>,
    /// Origin of part A's frame; default the frame's origin.
    pub(crate) position: Option<Quantities>,
    /// Attitude of part A's frame as roll, pitch, yaw; default none.
    pub(crate) rotation: Option<Quantities>,
}

/// How the wanted pose of part A gives way: M x'' + D x' + K x = force on part A + press, in part A's wanted axes.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ComplianceTable {
    /// Axes that give way, of "x", "y", "z" (along) and "rx", "ry", "rz" (about); the others stay as they are wanted.
    pub(crate) axes: Vec<At<String>>,
    /// Virtual mass M of the axes x, y, z.
    pub(crate) mass: Option<Quantity>,
    /// Damping D of them.
    pub(crate) damping: Option<Quantity>,
    /// Stiffness K of them; default 0: they yield as long as the force lasts.
    pub(crate) stiffness: Option<Quantity>,
    /// Virtual inertia of the axes rx, ry, rz.
    pub(crate) rotation_inertia: Option<Quantity>,
    /// Damping of them.
    pub(crate) rotation_damping: Option<Quantity>,
    /// Stiffness of them; default 0.
    pub(crate) rotation_stiffness: Option<Quantity>,
    /// Force that part A shall exert on part B, part A's axes; default none.
    pub(crate) press: Option<Quantities>,
    /// Moment that part A shall exert on part B, about part A's origin; default none.
    pub(crate) press_moment: Option<Quantities>,
}

/// What ends a phase: all that is written must hold.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct GuardTable {
    /// true: the move has ended.
    pub(crate) arrived: Option<At<bool>>,
    /// true: the latch has closed.
    pub(crate) captured: Option<At<bool>>,
    /// true: the fingers have come to the end of their way.
    pub(crate) gripped: Option<At<bool>>,
    /// The arm's sensor shows at least this force.
    pub(crate) force: Option<Quantity>,
    /// The arm's sensor shows less than this force.
    pub(crate) force_below: Option<Quantity>,
    /// The phase has lasted so long.
    pub(crate) after: Option<Quantity>,
    /// Phase that follows; default the next one in the file.
    pub(crate) go_to: Option<At<String>>,
}

file_table! {
    /// A camera that measures the pose of part B relative to part A.
    CameraTable of Params {
        /// Time between two images, a whole number of ticks.
        period: Quantity,
        /// Time from an image to its result, a whole number of ticks, at most three periods.
        delay: Quantity,
        /// Noise of the position in each image: standard deviation per axis; default none.
        noise_position: Option<Quantity>,
        /// Noise of the attitude in each image: standard deviation per axis; default none.
        noise_rotation: Option<Quantity>,
        /// Constant error of part B's place, part A's axes; default none. Dispersed as `camera_offset`.
        offset: Option<Quantities> => camera_offset,
        /// Constant error of part B's attitude, a rotation vector in part A's axes; default none. Dispersed as `camera_tilt`.
        tilt: Option<Quantities> => camera_tilt,
        /// Time constant with which the results are smoothed; default none.
        smoothing: Option<Quantity>,
    }
}

/// Fingers of part A, which move in its frame whatever pushes them.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct GripTable {
    /// Time in which they close, at a constant speed.
    pub(crate) time: Quantity,
}

/// The force sensor at the arm's end; it shows the contact's wrench on part A.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ArmSensorTable {
    /// Time constant of its low-pass filter.
    pub(crate) lag: Quantity,
}

/// Drives of an arm's joints: for each key one value for all joints, or a list with one for each. Those of a joint that slides
/// are in m, N and kg in place of rad, N m and kg m^2.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ArmDriveTable {
    /// Inertia of rotor and gear input, at the motor's side of the gear.
    pub(crate) rotor_inertia: At<OneOrMore>,
    /// Motor angle per joint angle; default 1.
    pub(crate) gear_ratio: Option<At<OneOrMore>>,
    /// Torsional stiffness of the gear, at the joint's side; default rigid.
    pub(crate) stiffness: Option<At<OneOrMore>>,
    /// Torsional damping of the gear, at the joint's side; default none.
    pub(crate) damping: Option<At<OneOrMore>>,
    /// Whole backlash, at the joint's side; default none.
    pub(crate) backlash: Option<At<OneOrMore>>,
    /// Coulomb friction; default `<dynamics friction>` of the URDF, else none.
    pub(crate) coulomb_friction: Option<At<OneOrMore>>,
    /// Viscous friction; default `<dynamics damping>` of the URDF, else none.
    pub(crate) viscous_friction: Option<At<OneOrMore>>,
    /// Static friction beyond Coulomb's; default none.
    pub(crate) static_friction: Option<At<OneOrMore>>,
    /// Speed at which the static part has fallen to 1/e; default "0.01 rad/s".
    pub(crate) static_speed: Option<At<OneOrMore>>,
    /// Travel in which dry friction comes 1/e closer to its whole size; default "0.1 mrad".
    pub(crate) presliding_travel: Option<At<OneOrMore>>,
    /// Greatest torque of the motor, at the joint's side; default `<limit effort>` of the URDF, else none.
    pub(crate) torque_limit: Option<At<OneOrMore>>,
    /// Speed of the joint beyond which the motor only slows down; default `<limit velocity>` of the URDF, else none.
    pub(crate) speed_limit: Option<At<OneOrMore>>,
    /// Stiffness of the stops at `<limit lower>` and `<limit upper>` of the URDF; default: the joints have no stops.
    pub(crate) stop_stiffness: Option<At<OneOrMore>>,
    /// Damping of the stops; default none.
    pub(crate) stop_damping: Option<At<OneOrMore>>,
    /// Dry friction of the closed brakes.
    pub(crate) brake_torque: Option<At<OneOrMore>>,
    /// When the brakes close, and the motors are off: "closed" (from the start) or "close_at_touch".
    pub(crate) brakes: Option<At<String>>,
}

/// The arm's controller; which keys it takes depends on its law.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ControllerTable {
    /// "joint_pd", "computed_torque" or "cartesian_impedance".
    pub(crate) law: At<String>,
    /// joint_pd: stiffness of each joint; in N/m of one that slides.
    pub(crate) joint_stiffness: Option<Quantities>,
    /// joint_pd: damping of each joint; in N s/m of one that slides.
    pub(crate) joint_damping: Option<Quantities>,
    /// computed_torque: bandwidth.
    pub(crate) bandwidth: Option<Quantity>,
    /// computed_torque: damping ratio.
    pub(crate) damping_ratio: Option<Quantity>,
    /// cartesian_impedance: translational stiffness.
    pub(crate) stiffness: Option<Quantity>,
    /// cartesian_impedance: translational damping.
    pub(crate) damping: Option<Quantity>,
    /// cartesian_impedance: rotational stiffness.
    pub(crate) rotation_stiffness: Option<Quantity>,
    /// cartesian_impedance: rotational damping.
    pub(crate) rotation_damping: Option<Quantity>,
    /// cartesian_impedance: damping of every joint, for motions that the end-effector does not show.
    pub(crate) null_space_damping: Option<Quantity>,
}

/// The part on the end-effector; its frame's +x axis looks towards part B.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PartATable {
    /// URDF link that carries the part; default the last link of the only chain. Joints off the chain to it are held. Without
    /// an arm: the base.
    pub(crate) link: Option<At<String>>,
    /// Origin of part A's frame in that link.
    pub(crate) position: Option<Quantities>,
    /// Attitude of part A's frame in that link as roll, pitch, yaw.
    pub(crate) rotation: Option<Quantities>,
    /// Contact points besides those of its solids.
    #[serde(default)]
    pub(crate) point: Vec<PointTable>,
    /// Solids; the part is their union.
    #[serde(default)]
    pub(crate) solid: Vec<SolidTable>,
}

/// A contact point: a sphere, or a point if the radius is zero.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointTable {
    /// Name in the pairs of [[contact.pair]]; points may share one.
    pub(crate) name: Option<At<String>>,
    /// Centre in the part's frame.
    pub(crate) position: Quantities,
    /// Radius; default zero.
    pub(crate) radius: Option<Quantity>,
    /// part_a with [arm.grip]: way of the point as the grip closes, part A's axes; default: it does not move.
    pub(crate) closes: Option<Quantities>,
}

/// The free body.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TargetTable {
    /// The target stands on a mount that does not move, whatever pushes it. Default false: it floats freely.
    pub(crate) held: Option<At<bool>>,
    /// Mass; required of a free target, refused of a held one. It and the inertia may follow from the density of part B's
    /// meshes instead.
    pub(crate) mass: Option<Quantity>,
    /// Inertia about the centre of mass, body axes; as the mass.
    pub(crate) inertia: Option<At<InertiaTable>>,
    /// Start position of the centre of mass in the contact frame; default: part B's frame at the origin.
    pub(crate) position: Option<Quantities>,
    /// Start attitude in the contact frame as roll, pitch, yaw.
    pub(crate) rotation: Option<Quantities>,
}

/// The part on the target; its frame's +x axis looks into the part, away from part A.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct PartBTable {
    /// Origin of part B's frame in the target's body frame.
    pub(crate) position: Option<Quantities>,
    /// Attitude of part B's frame in the target's body frame as roll, pitch, yaw.
    pub(crate) rotation: Option<Quantities>,
    /// Contact points besides those of its solids.
    #[serde(default)]
    pub(crate) point: Vec<PointTable>,
    /// Solids; the part is their union.
    #[serde(default)]
    pub(crate) solid: Vec<SolidTable>,
}

/// A solid; which keys it takes depends on its shape.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SolidTable {
    /// Name in the pairs of [[contact.pair]]; solids may share one.
    pub(crate) name: Option<At<String>>,
    /// "plane" (x >= 0), "sphere", "box", "capsule", "cylinder", "frustum" (solid, from x = 0), "ring" (round tube about x),
    /// "cone" (hollow, opening to -x), "bore" (blind hole along +x) or "mesh" (a closed surface of triangles).
    pub(crate) shape: At<String>,
    /// Origin of the solid's frame in the part's frame.
    pub(crate) position: Option<Quantities>,
    /// Attitude of the solid's frame as roll, pitch, yaw.
    pub(crate) rotation: Option<Quantities>,
    /// sphere, capsule, cylinder, ring (of the tube's centre), bore: radius.
    pub(crate) radius: Option<Quantity>,
    /// box: edge lengths.
    pub(crate) size: Option<Quantities>,
    /// cone: radius of the mouth.
    pub(crate) mouth: Option<Quantity>,
    /// cone: radius of the bottom.
    pub(crate) bottom: Option<Quantity>,
    /// cone, bore: depth.
    pub(crate) depth: Option<Quantity>,
    /// bore: width of the 45 degree chamfer; default zero.
    pub(crate) chamfer: Option<Quantity>,
    /// mesh: STL or OBJ file, relative to this one.
    pub(crate) file: Option<At<String>>,
    /// mesh: unit of length of the file, "mm", "cm", "m" or "in".
    pub(crate) unit: Option<At<String>>,
    /// mesh: edge of a cell of its distance grid; default the longest edge of the mesh over 160.
    pub(crate) resolution: Option<Quantity>,
    /// mesh: area whose contact points together have the pair's stiffness and damping; without it the mesh has no contact
    /// points of its own.
    pub(crate) patch: Option<Quantity>,
    /// mesh: density, for the mass properties that `check` states. A body without mass and inertia has those of its part's
    /// meshes, and its frame is in their centre of mass.
    pub(crate) density: Option<Quantity>,
    /// part_a with [arm.grip]: way of the solid as the grip closes, part A's axes; default: it does not move.
    pub(crate) closes: Option<Quantities>,
    /// capsule (between the centres of its ends), cylinder, frustum: length along x.
    pub(crate) length: Option<Quantity>,
    /// frustum: radius at x = 0.
    pub(crate) front: Option<Quantity>,
    /// frustum: radius at x = length.
    pub(crate) back: Option<Quantity>,
    /// ring: radius of the tube.
    pub(crate) tube: Option<Quantity>,
    /// cylinder, frustum (each rim), ring: contact points, default 16, that share the stiffness of four. capsule: contact
    /// points along the axis, default 2. mesh with a patch: about so many, default 500.
    pub(crate) points: Option<At<u64>>,
}

/// Declares the tables that have a contact law, each with its own keys behind those of the law.
macro_rules! law_tables {
    (
        @table { $($(#[$key_doc:meta])* $key:ident: $ty:ty,)* }
        $(#[$doc:meta])* $name:ident { $($(#[$own_doc:meta])* $own:ident: $own_ty:ty,)* }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub(crate) struct $name {
            $($(#[$key_doc])* pub(crate) $key: $ty,)*
            $($(#[$own_doc])* pub(crate) $own: $own_ty,)*
        }

        impl $name {
            /// The keys of its law.
            pub(crate) fn law(&self) -> LawKeys<'_> {
                LawKeys { $($key: &self.$key,)* }
            }
        }
    };
    (@keys { $($(#[$key_doc:meta])* $key:ident: $ty:ty,)* }) => {
        /// The keys of a contact law, of whichever table.
        #[derive(Clone, Copy)]
        pub(crate) struct LawKeys<'a> {
            $(pub(crate) $key: &'a $ty,)*
        }
    };
    (
        $law:tt
        $($(#[$doc:meta])* $name:ident { $($(#[$own_doc:meta])* $own:ident: $own_ty:ty,)* })*
    ) => {
        $(law_tables! { @table $law $(#[$doc])* $name { $($(#[$own_doc])* $own: $own_ty,)* } })*
        law_tables! { @keys $law }
    };
}

law_tables! {
    {
        /// "linear" (F = K d + b d'), "power" (F = K d^n (1 + a d')), "hertz" (power 1.5, K from the moduli),
        /// "lankarani_nikravesh", "flores" or "rebound" (power, damped by the restitution at the speed of each touch),
        /// "impact" (F = K d^n + b s d', s rising from 0 to 1 over `damping_depth`) or "stop" (linear up to a stroke,
        /// then a stop beside it).
        law: At<String>,
        /// All but hertz: K; for an exponent n in N/m^n, written as "N/m".
        stiffness: Option<Quantity>,
        /// All but linear, hertz and stop: the exponent n; default 1.5.
        exponent: Option<Quantity>,
        /// hertz: Young's moduli of the point of part A and of the solid of part B.
        youngs_modulus: Option<Quantities>,
        /// hertz: Poisson's ratios of both.
        poisson: Option<Quantities>,
        /// hertz: effective radius R of 1 / R = 1 / R_a + 1 / R_b; for a sphere on a plane the sphere's.
        radius: Option<Quantity>,
        /// linear, impact, stop: b.
        damping: Option<Quantity>,
        /// power, hertz: a.
        dissipation: Option<Quantity>,
        /// Coefficient of restitution without delay. linear, power, hertz, stop: instead of damping or dissipation, at the
        /// start's closing speed; lankarani_nikravesh (0.8 to 1), flores, rebound: at the speed of each touch.
        restitution: Option<Quantity>,
        /// lankarani_nikravesh, flores, rebound: a slower touch is damped as one of this speed; default a tenth of the
        /// start's closing speed.
        slowest_touch: Option<Quantity>,
        /// impact: depth of the full damping.
        damping_depth: Option<Quantity>,
        /// stop: travel before the stop is met.
        stroke: Option<Quantity>,
        /// stop: stiffness of the stop, for an exponent m in N/m^m.
        stop_stiffness: Option<Quantity>,
        /// stop: the exponent m; default 1.
        stop_exponent: Option<Quantity>,
        /// Coulomb friction coefficient; default zero.
        friction: Option<Quantity>,
        /// Tangential stiffness before slip; default 2/3 of the stiffness.
        bristle_stiffness: Option<Quantity>,
        /// Tangential damping before slip; default near critical for the parts' effective mass.
        bristle_damping: Option<Quantity>,
        /// Radius a of the contact patch of a point, for friction against spinning: 2/3 mu F a at most, for a uniform
        /// pressure; default 0, no such friction. Not of the points of meshes.
        patch_radius: Option<Quantity>,
    }

    /// The contact law and its nominal values, for every point and solid that are in no pair.
    ContactTable {
        /// The contact may pull and never opens (for linear oracles); default false.
        bilateral: Option<bool>,
        /// Points and solids with a law of their own; no point and solid may meet in two pairs.
        #[serde(default)]
        pair: Vec<PairTable>,
    }

    /// A law of contact between named points of part A and named solids of part B.
    PairTable {
        /// Names of points of part A; default all points.
        a: Option<Vec<At<String>>>,
        /// Names of solids of part B; default all solids.
        b: Option<Vec<At<String>>>,
        /// Share s by which friction is higher at rest: mu (1 + s exp(-|v| / v_s)); default 0.
        stribeck: Option<Quantity>,
        /// Sliding speed v_s at which that share has fallen to 1/e; default "10 mm/s".
        stribeck_speed: Option<Quantity>,
        /// Share a by which friction is higher along part B's y axis and lower across it: mu (1 + a cos 2 theta); default 0.
        anisotropy: Option<Quantity>,
        /// Tension of a point before it separates; default 0.
        adhesion: Option<Quantity>,
    }
}

/// A ring that part B rides on, and the six legs of a Stewart mechanism between ring and target.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct SoftCaptureTable {
    /// Mass of the ring with all that moves with it; no part of the target's mass.
    pub(crate) mass: Quantity,
    /// Its inertia about its centre of mass, part B's axes.
    pub(crate) inertia: At<InertiaTable>,
    /// Its centre of mass in part B's frame; default the origin.
    pub(crate) centre: Option<Quantities>,
    /// Radius of the legs' joints on the ring, then of those on the mount, about part B's x axis.
    pub(crate) radius: Quantities,
    /// Half the angle between the two joints of a pair on the ring, then on the mount.
    pub(crate) half_angle: Quantities,
    /// Place of the joints along part B's x axis on the ring, then on the mount, at the start.
    pub(crate) place: Quantities,
    /// Angle of the ring's first pair of joints from part B's y axis; default 0.
    pub(crate) turn: Option<Quantity>,
    /// Commanded force of a leg per shortening.
    pub(crate) stiffness: Quantity,
    /// Commanded force of a leg per rate of shortening.
    pub(crate) damping: Quantity,
    /// Greatest commanded force of a leg; default none.
    pub(crate) force_limit: Option<Quantity>,
    /// Time constant with which a leg's force follows its command; default at once.
    pub(crate) lag: Option<Quantity>,
    /// Shortening of a leg from the start at which it meets its stop.
    pub(crate) shortening: Quantity,
    /// Lengthening of a leg from the start at which it meets its stop.
    pub(crate) lengthening: Quantity,
    /// Stiffness of the stops.
    pub(crate) stop_stiffness: Quantity,
}

/// One of several latches that close and hold together.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct HookTable {
    /// Its point in part A's frame.
    pub(crate) point: Quantities,
    /// Its seat in part B's frame.
    pub(crate) seat: Quantities,
}

file_table! {
    /// Gate and hold of the capture latch.
    LatchTable of Params {
        /// Latch point in part A's frame.
        point: Quantities,
        /// Seat in part B's frame.
        seat: Quantities,
        /// It closes within this axial distance of the seat,
        depth: Quantity,
        /// this radial distance of the seat's axis,
        offset: Quantity,
        /// this angle between the parts' axes,
        angle: Quantity,
        /// and below this speed of the latch point relative to the seat.
        speed: Quantity,
        /// Translational stiffness of the closed latch.
        stiffness: Quantity => latch_stiffness,
        /// Translational damping of the closed latch.
        damping: Quantity => latch_damping,
        /// Rotational stiffness of the closed latch.
        rotation_stiffness: Quantity => latch_rotation_stiffness,
        /// Rotational damping of the closed latch.
        rotation_damping: Quantity => latch_rotation_damping,
        /// Latches at places of their own, each with the translational stiffness and damping; they close at the same time, when
        /// each that works is within `hook_reach` of its seat. Default one latch at `point`.
        #[serde(default)]
        hook: Vec<HookTable>,
        /// Greatest distance of a hook from its seat at which it closes.
        hook_reach: Option<Quantity>,
        /// Number of the hook that neither closes nor holds; default 0: all work. Dispersed as `latch_failed`.
        failed: Option<Quantity>,
    }

    /// Motion at the start; vectors in the contact frame.
    StartTable of Params {
        /// Distance along the approach axis from part A's origin to part B's; places the chaser by its arm's angles.
        gap: Option<Quantity>,
        /// Speed of part A towards part B; 0 where base and target are held.
        closing_speed: Quantity => closing_speed,
        /// Additional velocity of part A relative to part B.
        drift: Option<Quantities> => drift,
        /// Displacement of part A.
        offset: Option<Quantities> => offset,
        /// Rotation vector of the chaser about part A.
        tilt: Option<Quantities> => tilt,
        /// Angular velocity of the chaser; only of a free base.
        chaser_rate: Option<Quantities> => chaser_rate,
        /// Angular velocity of the target; only of a free one.
        target_rate: Option<Quantities> => target_rate,
    }
}

/// What the chaser does before the first touch.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct GuidanceTable {
    /// Base thrust; without it the chaser coasts.
    pub(crate) approach: Option<At<ApproachTable>>,
}

/// PD on part A's speed along the approach axis, place across it, and attitude; ends at the first touch.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ApproachTable {
    /// Force per error of the closing speed.
    pub(crate) speed_gain: Quantity,
    /// Force per lateral offset.
    pub(crate) lateral_stiffness: Quantity,
    /// Force per lateral speed.
    pub(crate) lateral_damping: Quantity,
    /// Torque per attitude error.
    pub(crate) attitude_stiffness: Quantity,
    /// Torque per rate error.
    pub(crate) attitude_damping: Quantity,
    /// Force limit per axis.
    pub(crate) max_force: Quantity,
    /// Torque limit per axis.
    pub(crate) max_torque: Quantity,
}

/// Relative gravity on a circular orbit.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct OrbitTable {
    /// Orbital rate.
    pub(crate) rate: Quantity,
    /// LVLH axes (x radial, y along-track, z cross-track) in the contact frame, as roll, pitch, yaw.
    pub(crate) rotation: Option<Quantities>,
}

/// A constant field on the chaser.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FieldTable {
    /// Acceleration of the chaser, contact frame; on a held base it acts on the links of the arm.
    pub(crate) acceleration: Quantities,
}

/// Success and end of a run; a limit that is not given does not count.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct TaskTable {
    /// Whether success needs a closed latch.
    pub(crate) capture: At<bool>,
    /// Whether success needs a first touch.
    pub(crate) touch: bool,
    /// Success needs a peak contact force, latch excluded, of at most this; not written: no criterion.
    pub(crate) max_contact_force: Option<Quantity>,
    /// Success needs a peak interface force, contact and latch together, of at most this; not written: no criterion.
    pub(crate) max_interface_force: Option<Quantity>,
    /// Success needs capture (or the end of contact) by this time; not written: no criterion.
    pub(crate) max_time: Option<Quantity>,
    /// Success needs a restitution of at most this; not written: no criterion.
    pub(crate) max_restitution: Option<Quantity>,
    /// Success needs part A's origin to come beyond part B's by at least this, along part B's x axis; not written: no criterion.
    /// Parts that stand between opposite contacts are called jammed or wedged.
    pub(crate) min_insertion: Option<Quantity>,
    /// A run is over this long after the parts have separated.
    pub(crate) end_after_separation: Option<Quantity>,
    /// The loop in space is over this long after capture.
    pub(crate) end_after_capture: Option<Quantity>,
    /// The loop on the facility is over this long after capture; only where the facility file does not end a session at
    /// capture. Not written: as in space.
    pub(crate) facility_end_after_capture: Option<Quantity>,
    /// Deeper contact is a numerical failure.
    pub(crate) max_depth: Quantity,
}
