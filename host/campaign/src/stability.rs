//! Whether the explicit step can be stable: contact, latch, controllers and lags against substep and tick.
//!
//! Semi-implicit Euler is stable up to w dt = 2; half a radian leaves room for sixteen points in contact at once.

use crate::mobility::{Chaser, effective_mass, greatest, leg_mobilities, target_about_com, target_at_point};
use nalgebra::{DMatrix, DVector, Matrix3};
use softdock_kernels::arm_plan::ArmPhase;
use softdock_kernels::contact::mesh::ShellPoint;
use softdock_kernels::contact::{REFERENCE_DEPTH, common_pair};
use softdock_kernels::material::{NormalLaw, Pair};
use softdock_kernels::model::{ArmControl, CompensatorKind, MaterialPair, Model, Shape, Side, Thrust};
use softdock_kernels::params::Params;
use softdock_kernels::plant::{PointSource, part_points};
use softdock_kernels::vector::{Vec3, vec3};

/// Greatest angle per step, w dt.
const ANGLE: f64 = 0.5;
/// Share of the stiffness, all in one place, for which the angle leaves room with a factor of two to spare.
const CROWD: f64 = 4.0;
/// Greatest decay per step of a damper that acts with every substep, b dt / m.
const DECAY: f64 = 1.0;
/// Greatest decay per tick of a controller that is held over a tick, k_d T / I.
const HELD_DECAY: f64 = 2.0;

/// The parameters' least and greatest values over a campaign (equal in a scenario alone).
#[derive(Clone, Debug)]
pub(crate) struct Extremes {
    pub(crate) least: Params<f64>,
    pub(crate) greatest: Params<f64>,
}

/// Something that the step cannot follow.
pub(crate) struct Fault {
    /// Key of the scenario file that states it.
    pub(crate) key: String,
    /// Parameter of a campaign that drives it, if any.
    pub(crate) parameter: Option<&'static str>,
    pub(crate) message: String,
    pub(crate) remedy: String,
}

/// A spring and damper between bodies: the numbers that the step must follow.
struct Spring {
    what: String,
    key: String,
    parameter: Option<&'static str>,
    stiffness: f64,
    damping: f64,
    /// Inverse inertia in the direction that is easiest to move.
    mobility: f64,
    /// Unit of that inertia.
    unit: &'static str,
    /// Held over a tick or acting with every substep.
    held: bool,
}

/// All faults of a model over the given extremes.
pub(crate) fn faults(m: &Model, extremes: &Extremes) -> Vec<Fault> {
    // The facility's target may be lighter by its error.
    let mut low = extremes.least;
    low.target_mass *= 1.0 + low.mass_error.min(0.0);
    low.target_inertia_scale *= 1.0 + low.inertia_error.min(0.0);
    let extremes = &Extremes { least: low, greatest: extremes.greatest };
    let Some(chaser) = Chaser::new(m, low.base_mass, low.base_inertia_scale) else {
        return vec![Fault {
            key: "base.inertia".to_owned(),
            parameter: None,
            message: "base and arm together have no invertible mass matrix".to_owned(),
            remedy: "check the masses and inertias of base and links: they differ by too many orders".to_owned(),
        }];
    };
    if effective_mass(m, low.base_mass, low.target_mass).is_none() {
        return vec![Fault {
            key: "base.held".to_owned(),
            parameter: None,
            message: "base and target are held, and no joint moves part A along the approach axis at the start"
                .to_owned(),
            remedy: "write other arm.angles, or remove base.held or target.held".to_owned(),
        }];
    }
    let mut springs = contact(m, extremes, &chaser);
    springs.extend(arm(m, &chaser));
    springs.extend(drives(m, &chaser));
    springs.extend(approach(m, &chaser));
    springs.extend(compensator(m, extremes, &chaser));
    springs.extend(servos(m, extremes));
    springs.push(fixture(m, extremes));
    springs.extend(capture_legs(m));
    let mut faults: Vec<Fault> = springs.iter().filter_map(|spring| spring.fault(m)).collect();
    faults.extend(lags(m, extremes));
    faults
}

impl Spring {
    fn fault(&self, m: &Model) -> Option<Fault> {
        let (step, step_name) = if self.held { (m.timing.tick(), "tick") } else { (m.timing.substep, "substep") };
        let most_decay = if self.held { HELD_DECAY } else { DECAY };
        let frequency = (self.stiffness * self.mobility).sqrt();
        let decay = self.damping * self.mobility;
        let inertia = format!("{:.4} {}", 1.0 / self.mobility, self.unit);
        let message = if frequency * step >= ANGLE {
            format!(
                "{}: stiffness {:.4e} on {inertia} turns by {:.3} rad in a {step_name} of {:.4} ms, the most is {ANGLE}",
                self.what,
                self.stiffness,
                frequency * step,
                step * 1e3
            )
        } else if decay * step >= most_decay {
            format!(
                "{}: damping {:.4e} on {inertia} decays by {:.3} in a {step_name} of {:.4} ms, the most is {most_decay}",
                self.what,
                self.damping,
                decay * step,
                step * 1e3
            )
        } else {
            return None;
        };
        let largest = (ANGLE / frequency).min(most_decay / decay);
        let remedy = format!("write timing.{step_name} = \"{:.3e} ms\" or less, or soften it", floor3(largest * 1e3));
        Some(Fault { key: self.key.clone(), parameter: self.parameter, message, remedy })
    }
}

/// Rounded down to four significant digits, so that the printed step is small enough.
fn floor3(value: f64) -> f64 {
    let scale = 10_f64.powf(3.0 - value.log10().floor());
    (value * scale).floor() / scale * (1.0 - 1e-3)
}

/// Inverse mass of the pair at a lever from part A in the contact frame (contact happens with part A at part B).
fn pair_mobility(m: &Model, low: &Params<f64>, chaser: &Chaser, lever: Vec3<f64>) -> f64 {
    let target = target_at_point(m, low.target_mass, low.target_inertia_scale, lever);
    greatest(&(chaser.at_point(chaser.part_a + lever) + target))
}

/// Greatest inverse mass of the pair at the contact points that belong to it.
fn greatest_mobility(
    m: &Model,
    low: &Params<f64>,
    chaser: &Chaser,
    belongs: impl Fn(Side, PointSource) -> bool,
) -> f64 {
    let of = |side: Side| {
        let points = part_points(m.contact.part(side)).into_iter();
        let shells = shells(m, side).filter(|(source, _)| belongs(side, *source));
        points
            .filter(|(source, _)| belongs(side, *source))
            .map(|(_, feature)| feature.point.position)
            .chain(shells.flat_map(|(_, shell)| shell.into_iter().map(|point| point.position)))
            .collect::<Vec<_>>()
    };
    // Part B's frame is the contact frame at the start.
    let levers = of(Side::A).into_iter().map(|point| chaser.axes.times(point)).chain(of(Side::B));
    levers.map(|lever| pair_mobility(m, low, chaser, lever)).fold(0.0, f64::max)
}

/// The shells of a part, in its frame.
fn shells(m: &Model, side: Side) -> impl Iterator<Item = (PointSource, Vec<ShellPoint<f64>>)> {
    let solids = m.contact.part(side).solids.iter().enumerate();
    solids.filter_map(|(index, solid)| {
        let Shape::Mesh(mesh) = &solid.shape else { return None };
        let placed = |point: &ShellPoint<f64>| ShellPoint {
            position: solid.frame.position + solid.frame.attitude.rotate(point.position),
            normal: solid.frame.attitude.rotate(point.normal),
            ..*point
        };
        Some((PointSource::Solid(index), mesh.shell.iter().map(placed).collect()))
    })
}

/// Greatest share of the stiffness that a shell has in contact: of the points that face a direction; at least 1.
pub(crate) fn crowd(m: &Model, belongs: impl Fn(Side, PointSource) -> bool) -> f64 {
    let facing = |shell: &[ShellPoint<f64>], direction: Vec3<f64>| -> f64 {
        shell.iter().map(|point| point.share * point.normal.dot(direction).max(0.0)).sum()
    };
    let axes = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
    let of = |side: Side| {
        let shells = shells(m, side).filter(|(source, _)| belongs(side, *source));
        let most = |shell: Vec<ShellPoint<f64>>| {
            axes.iter().map(|axis| facing(&shell, *axis).max(facing(&shell, -*axis))).fold(0.0, f64::max)
        };
        shells.map(|(_, shell)| most(shell)).fold(0.0, f64::max)
    };
    Side::BOTH.into_iter().map(of).fold(1.0, f64::max)
}

/// The contact pairs, their bristles, and the latch.
fn contact(m: &Model, extremes: &Extremes, chaser: &Chaser) -> Vec<Spring> {
    let common = MaterialPair {
        a: m.contact.a.members(),
        b: m.contact.b.members(),
        law: m.contact.law,
        properties: common_pair(&extremes.greatest),
        patch_radius: m.contact.patch_radius,
    };
    let damping = if m.contact.law.is_viscous() { "contact_damping" } else { "contact_dissipation" };
    let parameters = ["contact_stiffness", damping, "bristle_stiffness", "bristle_damping"].map(Some);
    let mut springs = pair_springs(m, extremes, chaser, &common, ("", "contact", parameters));
    for (number, row) in m.contact.pairs.iter().enumerate() {
        let (name, table) = (format!(" {}", number + 1), format!("contact.pair[{}]", number + 1));
        springs.extend(pair_springs(m, extremes, chaser, row, (&name, &table, [None; 4])));
    }
    springs.extend(latch(m, extremes, chaser));
    springs
}

/// Normal and tangential springs and dampers of a pair, given its name, its table in the scenario file, and the parameters
/// of a campaign that drive stiffness and damping of both.
fn pair_springs(
    m: &Model,
    extremes: &Extremes,
    chaser: &Chaser,
    row: &MaterialPair,
    (name, table, parameters): (&str, &str, [Option<&'static str>; 4]),
) -> Vec<Spring> {
    let (low, high, pair) = (&extremes.least, &extremes.greatest, &row.properties);
    let mobility = greatest_mobility(m, low, chaser, |side, source| row.has(side, source));
    let crowd = crowd(m, |side, source| row.has(side, source));
    let [slope, damping] = mounted_slope_and_damping(m, high, row.law, pair);
    // The limit of the angle leaves room for sixteen points, that of the decay for two.
    let (stiff, damped) = ((crowd / CROWD).max(1.0), crowd);
    let (slope, damping) = (slope * stiff, damping * damped);
    let damping_key = if row.law.is_viscous() { "damping" } else { "dissipation" };
    let springs = [
        ("contact pair", "stiffness", slope, 0.0),
        ("contact pair", damping_key, 0.0, damping),
        ("contact bristle", "bristle_stiffness", pair.bristle_stiffness * stiff, 0.0),
        ("contact bristle", "bristle_damping", 0.0, pair.bristle_damping * damped),
    ];
    let count = if pair.friction > 0.0 { 4 } else { 2 };
    let spring = |((what, key, stiffness, damping), parameter): ((&str, &str, f64, f64), _)| Spring {
        parameter,
        held: false,
        ..held(format!("{what}{name}"), &format!("{table}.{key}"), stiffness, damping, mobility, "kg")
    };
    springs.into_iter().zip(parameters).take(count).map(spring).collect()
}

/// Greatest slope \[N/m\] and damping \[N s/m\] of the mounted parts' normal force: at the deepest contact that is
/// allowed.
fn mounted_slope_and_damping(m: &Model, high: &Params<f64>, law: NormalLaw, pair: &Pair<f64>) -> [f64; 2] {
    let errors = |value: f64| 1.0 + value.max(0.0);
    let depth = m.task.max_depth;
    // K d^n (d / d_ref)^e has the exponent n + e, and n + e is at most n (1 + e).
    let bent = high.contact_exponent_error.max(0.0);
    let bend = (depth / REFERENCE_DEPTH).max(1.0).powf(bent);
    let stiffness = pair.stiffness * errors(high.contact_stiffness_error) * bend;
    let [slope, damping] = law.slope_and_damping(&Pair { stiffness, ..*pair }, depth);
    [slope * (1.0 + bent), damping * errors(high.contact_damping_error)]
}

/// The greatest of all pairs.
fn greatest_slope_and_damping(m: &Model, high: &Params<f64>) -> [f64; 2] {
    let rows = m.contact.pairs.iter().map(|row| mounted_slope_and_damping(m, high, row.law, &row.properties));
    let common = mounted_slope_and_damping(m, high, m.contact.law, &common_pair(high));
    rows.fold(common, |[slope, damping], own| [slope.max(own[0]), damping.max(own[1])])
}

/// Legs of a soft capture ring: the spring that goes on in a stop, and the damper, which a lag of its force softens.
fn capture_legs(m: &Model) -> Vec<Spring> {
    let Some(ring) = &m.ring else { return Vec::new() };
    let mobility = leg_mobilities(ring)[5];
    let row = |key: &str, stiffness, damping| Spring {
        held: false,
        ..held("soft capture ring".to_owned(), &format!("soft_capture.{key}"), stiffness, damping, mobility, "kg")
    };
    vec![row("stop_stiffness", ring.stiffness + ring.stop_stiffness, 0.0), row("damping", 0.0, ring.damping)]
}

/// Part B on its mount, pushed by the contact: a mass of 1 / (c w^2) between two springs.
fn fixture(m: &Model, extremes: &Extremes) -> Spring {
    let high = &extremes.greatest;
    let rate = std::f64::consts::TAU * high.fixture_frequency;
    let [slope, damping] = greatest_slope_and_damping(m, high);
    let (what, key) = ("part B on its mount".to_owned(), "facility.fixture.compliance");
    let spring = held(what, key, slope, damping, rate * rate * high.fixture_compliance, "kg");
    Spring { parameter: Some("fixture_compliance"), held: false, ..spring }
}

/// The closed latch.
fn latch(m: &Model, extremes: &Extremes, chaser: &Chaser) -> Vec<Spring> {
    let Some(latch) = &m.contact.latch else {
        return Vec::new();
    };
    let (low, high) = (&extremes.least, &extremes.greatest);
    let places = latch.hooks.iter().map(|hook| hook.point).chain([latch.point]);
    let linear = places.map(|place| pair_mobility(m, low, chaser, chaser.axes.times(place))).fold(0.0, f64::max);
    let hooks = latch.hooks.len().max(1) as f64;
    let angular = greatest(&(chaser.about_part_a() + target_about_com(m, low.target_inertia_scale)));
    let rows = [
        ("latch.stiffness", "latch_stiffness", hooks * high.latch_stiffness, 0.0, linear, "kg"),
        ("latch.damping", "latch_damping", 0.0, hooks * high.latch_damping, linear, "kg"),
        ("latch.rotation_stiffness", "latch_rotation_stiffness", high.latch_rotation_stiffness, 0.0, angular, "kg m^2"),
        ("latch.rotation_damping", "latch_rotation_damping", 0.0, high.latch_rotation_damping, angular, "kg m^2"),
    ];
    rows.map(|(key, parameter, stiffness, damping, mobility, unit)| Spring {
        parameter: Some(parameter),
        held: false,
        ..held("latch".to_owned(), key, stiffness, damping, mobility, unit)
    })
    .into()
}

/// The approach's thrust, held over a tick.
fn approach(m: &Model, chaser: &Chaser) -> Vec<Spring> {
    let Thrust::Approach {
        speed_gain, lateral_stiffness, lateral_damping, attitude_stiffness, attitude_damping, ..
    } = m.guidance.thrust
    else {
        return Vec::new();
    };
    let (linear, angular) = chaser.at_base();
    let held = |what: &str, stiffness, damping, mobility: &Matrix3<f64>, unit| {
        held(what.to_owned(), "guidance.approach", stiffness, damping, greatest(mobility), unit)
    };
    vec![
        held("closing speed", 0.0, speed_gain, &linear, "kg"),
        held("lateral thrust", lateral_stiffness, lateral_damping, &linear, "kg"),
        held("attitude control", attitude_stiffness, attitude_damping, &angular, "kg m^2"),
    ]
}

/// The model of a compensator, held over a tick: a spring or a damper of its own on the undelayed motion.
fn compensator(m: &Model, extremes: &Extremes, chaser: &Chaser) -> Option<Spring> {
    let (low, high) = (&extremes.least, &extremes.greatest);
    let mobility = greatest_mobility(m, low, chaser, |_, _| true);
    let stiffness = high.compensator_stiffness;
    let (stiffness, damping) = match m.facility.compensator.kind {
        CompensatorKind::Smith => (stiffness, 0.0),
        CompensatorKind::VirtualDamping => (0.0, stiffness * high.compensator_delay * (1.0 + high.compensator_margin)),
        _ => return None,
    };
    let key = "facility.compensator.stiffness";
    let parameter = Some("compensator_stiffness");
    Some(Spring { parameter, ..held("compensator".to_owned(), key, stiffness, damping, mobility, "kg") })
}

/// The loops of the robots' drives: velocity with every substep, on the rotor alone; position held over a tick.
fn servos(m: &Model, extremes: &Extremes) -> Vec<Spring> {
    let Some(level) = &m.facility.joint_level else {
        return Vec::new();
    };
    let (low, high) = (&extremes.least, &extremes.greatest);
    let robots = [
        ("robot 1", "robot1_velocity_gain", "robot1_position_gain", &low.robot1, &high.robot1),
        ("robot 2", "robot2_velocity_gain", "robot2_position_gain", &low.robot2, &high.robot2),
    ];
    let mut springs = Vec::new();
    for (index, (robot, velocity_gain, position_gain, low, high)) in robots.into_iter().enumerate() {
        let carriage = level.carriage.as_ref().filter(|_| index == 0);
        let joints = level.robot.joints.iter().zip(&level.servo.velocity);
        let joints = joints.enumerate().map(|(i, axis)| (format!("joint {} of {robot}", i + 1), axis));
        let rail = carriage.map(|carriage| ("the rail".to_owned(), (&carriage.joint, &carriage.velocity)));
        for (axis, (joint, velocity)) in joints.chain(rail) {
            let rotor = low.gear_ratio * low.gear_ratio * joint.drive.reflected_inertia();
            let damping = velocity.gain * high.velocity_gain + joint.friction.viscous * (1.0 + high.viscous_error);
            let key = "facility.joint_level.servo.velocity_gain";
            let loops = held(format!("velocity loop of {axis}"), key, 0.0, damping, 1.0 / rotor, "kg m^2");
            springs.push(Spring { parameter: Some(velocity_gain), held: false, ..loops });
        }
        let key = "facility.joint_level.servo.position_gain";
        let what = format!("position loops of {robot}");
        let loops = held(what, key, 0.0, high.position_gain, 1.0, "(per unit inertia)");
        springs.push(Spring { parameter: Some(position_gain), ..loops });
    }
    springs
}

/// A controller that is held over a tick.
fn held(what: String, key: &str, stiffness: f64, damping: f64, mobility: f64, unit: &'static str) -> Spring {
    Spring { what, key: key.to_owned(), parameter: None, stiffness, damping, mobility, unit, held: true }
}

/// The arm's controllers, held over a tick: its own, or those of its phases.
fn arm(m: &Model, chaser: &Chaser) -> Vec<Spring> {
    if m.links.is_empty() {
        return Vec::new();
    }
    let Some(plan) = &m.guidance.plan else {
        return controller(m, chaser, m.guidance.arm, "arm.controller");
    };
    let of = |(index, phase): (usize, &ArmPhase)| {
        let springs = controller(m, chaser, phase.control, &format!("arm.phase[{}].controller", index + 1));
        let named =
            springs.into_iter().map(|own| Spring { what: format!("{} of phase `{}`", own.what, phase.name), ..own });
        named.collect::<Vec<_>>()
    };
    plan.phases.iter().enumerate().flat_map(of).collect()
}

/// One controller, held over a tick.
fn controller(m: &Model, chaser: &Chaser, control: ArmControl, key: &str) -> Vec<Spring> {
    let count = m.links.len();
    let held = |what, stiffness, damping, mobility, unit| held(what, key, stiffness, damping, mobility, unit);
    match control {
        ArmControl::JointPd { stiffness, damping } => [(stiffness, true), (damping, false)]
            .into_iter()
            .map(|(gains, is_stiffness)| {
                let (value, joint) = joint_gain(&at_motors(m, chaser), &gains[..count]);
                let mobility = if gains[joint] > 0.0 { value / gains[joint] } else { 0.0 };
                let (k, b) = if is_stiffness { (gains[joint], 0.0) } else { (0.0, gains[joint]) };
                held(format!("controller of joint {}", joint + 1), k, b, mobility, inertia_unit(m, joint))
            })
            .collect(),
        ArmControl::ComputedTorque { bandwidth, damping_ratio } => {
            let damping = 2.0 * damping_ratio * bandwidth;
            vec![held(
                "computed-torque controller".to_owned(),
                bandwidth * bandwidth,
                damping,
                1.0,
                "(per unit inertia)",
            )]
        }
        ArmControl::CartesianImpedance { stiffness, damping, rotation_stiffness, rotation_damping, joint_damping } => {
            let linear = greatest(&chaser.at_point(chaser.part_a));
            let angular = greatest(&chaser.about_part_a());
            let (value, joint) = joint_gain(&chaser.at_joints(), &vec![joint_damping; count]);
            let mobility = if joint_damping > 0.0 { value / joint_damping } else { 0.0 };
            vec![
                held("translational impedance".to_owned(), stiffness, damping, linear, "kg"),
                held("rotational impedance".to_owned(), rotation_stiffness, rotation_damping, angular, "kg m^2"),
                held(format!("damping of joint {}", joint + 1), 0.0, joint_damping, mobility, inertia_unit(m, joint)),
            ]
        }
    }
}

/// Unit of what a joint's torque, or the force of one that slides, moves.
fn inertia_unit(m: &Model, joint: usize) -> &'static str {
    if m.slides(joint) { "kg" } else { "kg m^2" }
}

/// Mobility of what the controller's torques act on: the joints, or their motors, of which each has its rotor at least.
fn at_motors(m: &Model, chaser: &Chaser) -> DMatrix<f64> {
    let rotors = m.drives.iter().map(|own| 1.0 / own.drive.reflected_inertia());
    match m.drives.is_empty() {
        true => chaser.at_joints(),
        false => DMatrix::from_diagonal(&DVector::from_iterator(m.drives.len(), rotors)),
    }
}

/// Gears, friction and stops of the arm's joints, which act with every substep.
fn drives(m: &Model, chaser: &Chaser) -> Vec<Spring> {
    let mobility = chaser.at_joints();
    let mut springs = Vec::new();
    for (i, own) in m.drives.iter().enumerate() {
        let mut add = |what: &str, key: &str, stiffness: f64, damping: f64, mobility: f64| {
            let what = format!("{what} of joint {}", i + 1);
            let spring = held(what, key, stiffness, damping, mobility, inertia_unit(m, i));
            springs.push(Spring { held: false, ..spring });
        };
        let (joint, rotor) = (mobility[(i, i)], 1.0 / own.drive.reflected_inertia());
        // A gear too stiff for the substep is stepped implicitly.
        let reflected = own.drive.reflected_inertia();
        if own.drive.gear_stiffness * m.timing.substep.powi(2) < reflected / 16.0 {
            add("gear", "arm.drive.stiffness", own.drive.gear_stiffness, 0.0, joint);
        }
        let dry = own.friction.coulomb + own.friction.stribeck + own.brake;
        let friction = (dry / own.presliding_travel, own.friction.viscous);
        add("friction", "arm.drive.presliding_travel", friction.0, friction.1, rotor);
        if let Some(stops) = &own.stops {
            add("stop", "arm.drive.stop_stiffness", stops.stiffness, stops.damping, joint);
        }
    }
    springs
}

/// Greatest eigenvalue of gains times joint mobility, and the joint that moves most in it.
///
/// All joints together: neighbours of one joint give way, so that it feels less than its own composite inertia.
fn joint_gain(mobility: &DMatrix<f64>, gains: &[f64]) -> (f64, usize) {
    let root = DMatrix::from_diagonal(&DVector::from_iterator(gains.len(), gains.iter().map(|gain| gain.sqrt())));
    let eigen = (&root * mobility * &root).symmetric_eigen();
    let (index, value) = eigen.eigenvalues.argmax();
    (value, eigen.eigenvectors.column(index).iamax())
}

/// Responses of robots and rail, integrated with every substep.
fn lags(m: &Model, extremes: &Extremes) -> Vec<Fault> {
    let (low, high) = (&extremes.least, &extremes.greatest);
    let rows = [
        ("robot 1", "facility.robot1.lag", "robot1_lag", low.robot1_lag, high.robot1_lag, high.robot1_lag_damping),
        ("robot 2", "facility.robot2.lag", "robot2_lag", low.robot2_lag, high.robot2_lag, high.robot2_lag_damping),
        ("rail", "facility.rail.lag", "rail_lag", low.rail_lag, high.rail_lag, high.rail_lag_damping),
    ];
    let dt = m.timing.substep;
    rows.into_iter()
        .filter_map(|(what, key, parameter, least, most, damping)| {
            let shortest = dt / ANGLE * damping.max(1.0);
            (most > 0.0 && least < shortest).then(|| Fault {
                key: key.to_owned(),
                parameter: Some(parameter),
                message: format!(
                    "{what}: a lag of {:.4} ms is too short for a substep of {:.4} ms",
                    least * 1e3,
                    dt * 1e3
                ),
                remedy: format!("write a lag of at least {:.4} ms, or 0 s for an ideal one", shortest * 1e3),
            })
        })
        .collect()
}
