//! The blocks of a robot: each axis from its torque to its motion, against the load that gravity and the others put on it.

use super::MeasuredBlock;
use super::drive::{Carried, loaded_block, resampled};
use crate::recording::grid::Piece;
use crate::recording::smooth::{Motion, motion};
use softdock_campaign::rig::{AXIS_SIGNALS, RobotRig};
use softdock_kernels::manipulator::{Manipulator, counterweight_torque, rigid_torques};
use softdock_kernels::model::{Link, MAX_JOINTS};
use softdock_kernels::vector::{Sym3, Vec3};
use softdock_kernels::with_joints;
use std::f64::consts::TAU;

/// The blocks' names, axis by axis.
const NAMES: [&str; MAX_JOINTS] = [
    "R3 torque to motion, axis 1",
    "R3 torque to motion, axis 2",
    "R3 torque to motion, axis 3",
    "R3 torque to motion, axis 4",
    "R3 torque to motion, axis 5",
    "R3 torque to motion, axis 6",
    "R3 torque to motion, axis 7",
];
/// Cut-off of the motion by which the axes load one another \[Hz\]: above it the noise of an encoder is no acceleration,
/// far below it a reversal, where friction turns about at once, reaches the other axes too early and too late.
const COUPLING: f64 = 40.0;
/// Share of a recording's Nyquist frequency that the cut-off stays below.
const BAND: f64 = 0.8;
/// Up to this share of the frequency with which a link swings on its gear, the motor held, links are told from motors;
/// nearer to it the noise of an encoder would be magnified.
const SWING: f64 = 0.6;
/// Passes in which links are told from motors; each leaves at most `SWING^2` of what the one before left.
const PASSES: usize = 3;

/// The axis of a block, from 1; `None` for blocks of other plants.
pub fn axis(block: &str) -> Option<usize> {
    NAMES.iter().position(|name| *name == block).map(|axis| axis + 1)
}

/// The block of every axis; `held_out` of an experiment's name.
pub fn robot_blocks(
    rig: &RobotRig,
    pieces: &[Piece],
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
) -> Vec<MeasuredBlock> {
    let carried: Vec<Vec<Vec<Carried>>> =
        pieces.iter().map(|piece| with_joints!(rig.drives.len(), carried(rig, piece))).collect();
    let block = |axis: usize| {
        let own: Vec<Piece> = pieces.iter().map(|piece| of_axis(piece, axis)).collect();
        let carrying = |piece: usize, motion: &Motion| resampled(&carried[piece][axis], motion.value.len(), between);
        loaded_block(NAMES[axis], &rig.drives[axis], &own, held_out, finer, &[], &carrying)
    };
    (0..rig.drives.len()).map(block).collect()
}

/// An axis' signals by the names that they have on a rig of one drive.
pub(crate) fn of_axis(piece: &Piece, axis: usize) -> Piece {
    let own = |name: &&str| piece.signals.get(&format!("{name}.{}", axis + 1)).map(|x| ((*name).to_owned(), x.clone()));
    Piece { signals: AXIS_SIGNALS.iter().filter_map(own).collect(), ..piece.clone() }
}

/// The motion of every link: of every motor less the windup of its gear under what it carries.
fn links<const N: usize>(rig: &RobotRig, piece: &Piece) -> [Motion; N] {
    let cutoff = COUPLING.min(BAND * 0.5 / piece.step);
    let motors: [Motion; N] =
        std::array::from_fn(|axis| motion(&piece.signals[&format!("q.{}", axis + 1)], piece.step, cutoff, 1));
    let gears: [(f64, f64); N] = std::array::from_fn(|axis| {
        let (compliance, inertia) = (rig.drives[axis].values.compliance, rig.drives[axis].link_inertia);
        (compliance, cutoff.min(SWING / (TAU * (compliance * inertia).sqrt())))
    });
    let mut links = motors.clone();
    if gears.iter().all(|(compliance, _)| *compliance == 0.0) {
        return links;
    }
    for _ in 0..PASSES {
        let through_gears = |k: usize| {
            let now = |of| at(&links, k, of);
            let angle = now(|m| &m.value);
            let torques = rigid_torques(&rig.model, angle, now(|m| &m.rate), now(|m| &m.acceleration));
            std::array::from_fn(|axis| torques[axis] - helped(&rig.model, axis, angle[axis]))
        };
        let torques: Vec<[f64; N]> = (0..piece.samples()).map(through_gears).collect();
        links = std::array::from_fn(|axis| {
            let (compliance, cutoff) = gears[axis];
            let windup: Vec<f64> = torques.iter().map(|torques| compliance * torques[axis]).collect();
            less(&motors[axis], &motion(&windup, piece.step, cutoff, 1))
        });
    }
    links
}

/// A number of each axis' motion at a sample.
fn at<const N: usize>(motions: &[Motion; N], sample: usize, of: fn(&Motion) -> &Vec<f64>) -> [f64; N] {
    std::array::from_fn(|axis| of(&motions[axis])[sample])
}

/// What a counterweight takes off an axis \[N m\].
fn helped(robot: &Manipulator, axis: usize, angle: f64) -> f64 {
    robot.joints[axis].counterweight.map_or(0.0, |counterweight| counterweight_torque(&counterweight, angle))
}

/// The difference of two motions.
fn less(a: &Motion, b: &Motion) -> Motion {
    let of = |of: fn(&Motion) -> &Vec<f64>| of(a).iter().zip(of(b)).map(|(a, b)| a - b).collect();
    Motion { value: of(|m| &m.value), rate: of(|m| &m.rate), acceleration: of(|m| &m.acceleration) }
}

/// What each axis carries at each sample: `[axis][sample]`.
fn carried<const N: usize>(rig: &RobotRig, piece: &Piece) -> Vec<Vec<Carried>> {
    let robot = &rig.model;
    let motions: [Motion; N] = links(rig, piece);
    let weightless = Manipulator { gravity: Vec3::zero(), ..robot.clone() };
    let laden = laden(robot);
    let laden_weightless = Manipulator { gravity: Vec3::zero(), ..laden.clone() };
    let mut all = vec![Vec::with_capacity(piece.samples()); N];
    for k in 0..piece.samples() {
        let now = |of| at(&motions, k, of);
        let [angle, rate, acceleration] = [now(|m| &m.value), now(|m| &m.rate), now(|m| &m.acceleration)];
        let torques = |robot: &Manipulator| rigid_torques(robot, angle, rate, acceleration);
        let (whole, laden_whole) = (torques(robot), torques(&laden));
        for (axis, all) in all.iter_mut().enumerate() {
            let unit = std::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
            let inertia = |robot: &Manipulator| rigid_torques(robot, angle, [0.0; N], unit)[axis];
            let own = inertia(&weightless);
            let payload_inertia = inertia(&laden_weightless) - own;
            let without = |torque: f64, inertia: f64| torque - inertia * acceleration[axis];
            all.push(Carried {
                load: without(whole[axis], own) - helped(robot, axis, angle[axis]),
                inertia: own,
                payload_weight: without(laden_whole[axis] - whole[axis], payload_inertia),
                payload_inertia,
            });
        }
    }
    all
}

/// The robot with a kilogram more at its flange.
fn laden(robot: &Manipulator) -> Manipulator {
    let mut laden = robot.clone();
    if let Some(joint) = laden.joints.last_mut() {
        let Link { mass, com, inertia, .. } = joint.link;
        let flange = robot.flange.position;
        let whole = mass + 1.0;
        let centre = (com * mass + flange) * (1.0 / whole);
        let moved = Sym3::point_mass(mass, com - centre) + Sym3::point_mass(1.0, flange - centre);
        joint.link = Link { mass: whole, com: centre, inertia: inertia + moved, ..joint.link };
    }
    laden
}

/// What is carried on the straight way from one sample to the next.
fn between(from: &Carried, to: &Carried, share: f64) -> Carried {
    let mixed = |of: fn(&Carried) -> f64| of(from) + share * (of(to) - of(from));
    Carried {
        load: mixed(|c| c.load),
        inertia: mixed(|c| c.inertia),
        payload_weight: mixed(|c| c.payload_weight),
        payload_inertia: mixed(|c| c.payload_inertia),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_campaign::Rig;
    use softdock_campaign::rig::Plant;
    use softdock_kernels::manipulator::inverse_dynamics;
    use std::path::Path;

    /// The shipped robot with axes that slide without friction on rigid gears, and its drives.
    fn robot() -> RobotRig {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/rigs/kr300.toml");
        let Plant::Robot(mut rig) = Rig::load(&file).expect("the shipped rig").plant else { panic!("a robot") };
        for joint in &mut rig.model.joints {
            let friction = &mut joint.friction;
            (friction.coulomb, friction.stribeck, friction.viscous, friction.load_coefficient) = (0.0, 0.0, 0.0, 0.0);
        }
        rig.drives.iter_mut().for_each(|drive| drive.values.compliance = 0.0);
        *rig
    }

    /// Every axis of six swings at its own pace.
    fn swings(step: f64) -> Piece {
        let swing = |axis: usize, i: usize| 0.4 * ((1.0 + 0.3 * axis as f64) * i as f64 * step + axis as f64).sin();
        let signal = |axis: usize| (format!("q.{}", axis + 1), (0..1500).map(|i| swing(axis, i)).collect());
        let signals = (0..6).map(signal).collect();
        Piece { experiment: "swing".to_owned(), repeat: 1, start: 0.0, step, signals }
    }

    #[test]
    fn what_an_axis_carries_and_what_its_own_inertias_take_is_the_torque_of_the_whole_robot() {
        let (rig, step) = (robot(), 0.004);
        let piece = swings(step);
        let motions = links::<6>(&rig, &piece);
        for (model, kilograms) in [(rig.model.clone(), 0.0), (laden(&rig.model), 1.0)] {
            let carried = carried::<6>(&rig, &piece);
            for k in (300..1200).step_by(50) {
                let (angle, rate) = (at(&motions, k, |m| &m.value), at(&motions, k, |m| &m.rate));
                let acceleration = at(&motions, k, |m| &m.acceleration);
                let whole = inverse_dynamics(&model, angle, rate, acceleration, [0.0; 6]);
                for (axis, whole) in whole.iter().enumerate() {
                    let (own, values) = (&carried[axis][k], &rig.drives[axis].values);
                    let inertia = values.motor_inertia + own.inertia + kilograms * own.payload_inertia;
                    let load = own.load + kilograms * own.payload_weight + values.offset;
                    let torque = inertia * acceleration[axis] + load;
                    assert!(
                        (torque - whole).abs() < 1e-8 * whole.abs().max(1e3),
                        "axis {}: {torque} {whole}",
                        axis + 1
                    );
                }
            }
        }
    }

    #[test]
    fn links_are_where_motors_are_less_what_their_gears_wind_up() {
        let (mut rig, step) = (robot(), 0.004);
        let mut piece = swings(step);
        let truth = links::<6>(&rig, &piece);
        rig.drives.iter_mut().for_each(|drive| drive.values.compliance = 1e-7);
        for k in 0..piece.samples() {
            let now = |of| at(&truth, k, of);
            let angle = now(|m| &m.value);
            let torques = rigid_torques(&rig.model, angle, now(|m| &m.rate), now(|m| &m.acceleration));
            for (axis, torque) in torques.iter().enumerate() {
                let windup = 1e-7 * (torque - helped(&rig.model, axis, angle[axis]));
                piece.signals.get_mut(&format!("q.{}", axis + 1)).expect("its angle")[k] += windup;
            }
        }
        let found = links::<6>(&rig, &piece);
        for k in (300..1200).step_by(50) {
            for (found, truth) in found.iter().zip(&truth) {
                assert!((found.value[k] - truth.value[k]).abs() < 1e-7, "{} {}", found.value[k], truth.value[k]);
                let (own, right) = (found.acceleration[k], truth.acceleration[k]);
                assert!((own - right).abs() < 1e-3, "{own} {right}");
            }
        }
    }
}
