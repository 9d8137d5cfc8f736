//! The blocks of a robot: each axis from its torque to its motion, against the load that gravity and the others put on it.

use super::MeasuredBlock;
use super::drive::{Carried, loaded_block};
use crate::recording::grid::Piece;
use crate::recording::smooth::{Motion, motion};
use softdock_campaign::rig::{AXIS_SIGNALS, RobotRig};
use softdock_kernels::manipulator::{Manipulator, counterweight_torque, rigid_torques};
use softdock_kernels::model::{Link, MAX_JOINTS};
use softdock_kernels::vector::{Sym3, Vec3};
use softdock_kernels::with_joints;

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
/// Cut-off of the motion by which the axes load one another \[Hz\]: they follow no faster, and the noise of an encoder
/// is no acceleration.
const COUPLING: f64 = 20.0;
/// Share of a recording's Nyquist frequency that the cut-off stays below.
const BAND: f64 = 0.8;

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
        pieces.iter().map(|piece| with_joints!(rig.drives.len(), carried(&rig.model, piece))).collect();
    let block = |axis: usize| {
        let own: Vec<Piece> = pieces.iter().map(|piece| of_axis(piece, axis)).collect();
        let carrying = |piece: usize, motion: &Motion| between(&carried[piece][axis], motion.value.len());
        loaded_block(NAMES[axis], &rig.drives[axis], &own, held_out, finer, &[], &carrying)
    };
    (0..rig.drives.len()).map(block).collect()
}

/// An axis' signals by the names that they have on a rig of one drive.
pub(crate) fn of_axis(piece: &Piece, axis: usize) -> Piece {
    let own = |name: &&str| piece.signals.get(&format!("{name}.{}", axis + 1)).map(|x| ((*name).to_owned(), x.clone()));
    Piece { signals: AXIS_SIGNALS.iter().filter_map(own).collect(), ..piece.clone() }
}

/// What each axis carries at each sample: `[axis][sample]`.
fn carried<const N: usize>(robot: &Manipulator, piece: &Piece) -> Vec<Vec<Carried>> {
    let cutoff = COUPLING.min(BAND * 0.5 / piece.step);
    let of_joint = |axis: usize| motion(&piece.signals[&format!("q.{}", axis + 1)], piece.step, cutoff, 1);
    let motions: [Motion; N] = std::array::from_fn(of_joint);
    let weightless = Manipulator { gravity: Vec3::zero(), ..robot.clone() };
    let laden = laden(robot);
    let laden_weightless = Manipulator { gravity: Vec3::zero(), ..laden.clone() };
    let mut all = vec![Vec::with_capacity(piece.samples()); N];
    for k in 0..piece.samples() {
        let at = |of: fn(&Motion) -> &Vec<f64>| -> [f64; N] { std::array::from_fn(|axis| of(&motions[axis])[k]) };
        let [angle, rate, acceleration] = [at(|m| &m.value), at(|m| &m.rate), at(|m| &m.acceleration)];
        let torques = |robot: &Manipulator| rigid_torques(robot, angle, rate, acceleration);
        let (whole, laden_whole) = (torques(robot), torques(&laden));
        for (axis, all) in all.iter_mut().enumerate() {
            let unit = std::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
            let inertia = |robot: &Manipulator| rigid_torques(robot, angle, [0.0; N], unit)[axis];
            let own = inertia(&weightless);
            let payload_inertia = inertia(&laden_weightless) - own;
            let helped = robot.joints[axis].counterweight.map_or(0.0, |c| counterweight_torque(&c, angle[axis]));
            let without = |torque: f64, inertia: f64| torque - inertia * acceleration[axis];
            all.push(Carried {
                load: without(whole[axis], own) - helped,
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

/// What is carried at each sample, at so many instants along the same time: straight between samples.
fn between(samples: &[Carried], count: usize) -> Vec<Carried> {
    let last = samples.len() - 1;
    let at = |i: usize| {
        let place = i as f64 * last as f64 / (count - 1) as f64;
        let before = (place as usize).min(last - 1);
        let (from, to, share) = (&samples[before], &samples[before + 1], place - before as f64);
        let mixed = |of: fn(&Carried) -> f64| of(from) + share * (of(to) - of(from));
        Carried {
            load: mixed(|c| c.load),
            inertia: mixed(|c| c.inertia),
            payload_weight: mixed(|c| c.payload_weight),
            payload_inertia: mixed(|c| c.payload_inertia),
        }
    };
    (0..count).map(at).collect()
}
