//! Blocks of a robot: each axis from its torque to its motion, under the load from gravity and the other axes.

use crate::data::grid::Piece;
use crate::data::smooth::SmoothedSignal;
use crate::model::block::MeasuredBlock;
use crate::model::place::AXES;
use crate::plants::drive::block::{Carried, loaded_block, resampled};
use crate::plants::robot::coupling::{Instant, coupled};
use crate::plants::robot::links::{at, helped, links, weightless};
use softdock_campaign::rig::{AXIS_SIGNALS, RobotRig};
use softdock_kernels::block::drive::DriveValues;
use softdock_kernels::manipulator::{Manipulator, rigid_torques};
use softdock_kernels::vector::Vec3;
use softdock_kernels::with_joints;

/// Cut-off of the low-pass for the relative torque error \[Hz\].
const TORQUE_CUTOFF: f64 = 10.0;
/// Load of each axis: `[recording][axis][sample]`.
pub(crate) type Loads = Vec<Vec<Vec<Carried>>>;

/// Returns the loads of the axes along their recorded motion, with the gears of `drives`.
pub(crate) fn loads(rig: &RobotRig, pieces: &[Piece], drives: &[DriveValues<f64>]) -> Loads {
    pieces.iter().map(|piece| with_joints!(rig.drives.len(), carried(rig, piece, drives))).collect()
}

/// The block of an axis, counted from 0; `held_out` of an experiment's name.
pub(crate) fn robot_block(
    rig: &RobotRig,
    axis: usize,
    pieces: &[Piece],
    loads: &Loads,
    held_out: &dyn Fn(&str) -> bool,
    finer: usize,
) -> MeasuredBlock {
    let own: Vec<Piece> = pieces.iter().map(|piece| of_axis(piece, axis)).collect();
    let carrying = |piece: usize, motion: &SmoothedSignal| resampled(&loads[piece][axis], motion.value.len(), between);
    let loaded = loaded_block(AXES[axis].name, &rig.drives[axis], &own, held_out, finer, &[], &carrying);
    MeasuredBlock { torque_cutoff: Some(TORQUE_CUTOFF), ..loaded }
}

/// An axis' signals by the names that they have on a rig of one drive.
pub(crate) fn of_axis(piece: &Piece, axis: usize) -> Piece {
    let own = |name: &&str| piece.signals.get(&format!("{name}.{}", axis + 1)).map(|x| ((*name).to_owned(), x.clone()));
    Piece { signals: AXIS_SIGNALS.iter().filter_map(own).collect(), ..piece.clone() }
}

/// What each axis carries at each sample: `[axis][sample]`.
fn carried<const N: usize>(rig: &RobotRig, piece: &Piece, drives: &[DriveValues<f64>]) -> Vec<Vec<Carried>> {
    let robot = &rig.model;
    let motions: [SmoothedSignal; N] = links(rig, piece, drives);
    let unladen_weightless = weightless(robot);
    let laden = robot.with_load(1.0, Vec3::zero());
    let laden_weightless = weightless(&laden);
    let is_coupled = rig.couplings.iter().any(|own| own.coupling_ratio != 0.0);
    let mut all = vec![Vec::with_capacity(piece.samples()); N];
    for k in 0..piece.samples() {
        let now = |of| at(&motions, k, of);
        let [angle, rate, acceleration] = [now(|m| &m.value), now(|m| &m.rate), now(|m| &m.acceleration)];
        let torques = |robot: &Manipulator| rigid_torques(robot, angle, rate, acceleration);
        let (whole, laden_whole) = (torques(robot), torques(&laden));
        let held = rigid_torques(robot, angle, [0.0; N], [0.0; N]);
        let coupled = match is_coupled {
            true => {
                let torque = std::array::from_fn(|axis| piece.signals[&format!("tau.{}", axis + 1)][k]);
                couplings(rig, &Instant { angle, rate, acceleration, torque })
            }
            false => [0.0; N],
        };
        for (axis, all) in all.iter_mut().enumerate() {
            let unit = std::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
            let inertia = |robot: &Manipulator| rigid_torques(robot, angle, [0.0; N], unit)[axis];
            let own = inertia(&unladen_weightless);
            let payload_inertia = inertia(&laden_weightless) - own;
            let without = |torque: f64, inertia: f64| torque - inertia * acceleration[axis];
            all.push(Carried {
                weight: held[axis] - helped(robot, axis, angle[axis]),
                coupling: without(whole[axis] - held[axis], own) + coupled[axis],
                inertia: own,
                payload_weight: without(laden_whole[axis] - whole[axis], payload_inertia),
                payload_inertia,
            });
        }
    }
    all
}

/// Rate over which the friction of a coupled motor changes sign \[rad/s\].
const REVERSAL: f64 = 0.005;

/// Torque on each axis from the couplings of a robot.
fn couplings<const N: usize>(rig: &RobotRig, now: &Instant<N>) -> [f64; N] {
    let mut all = [0.0; N];
    for (axis, own) in rig.couplings.iter().enumerate().filter(|(axis, own)| *axis > 0 && own.coupling_ratio != 0.0) {
        let terms = coupled(now, axis, own.coupling_ratio, |rate| (rate / REVERSAL).tanh());
        let sizes = [own.coupling_inertia, own.coupling_viscous, own.coupling_coulomb, own.coupling_torque];
        for (size, term) in sizes.into_iter().zip(terms) {
            (0..N).for_each(|place| all[place] += size * term[place]);
        }
    }
    all
}

/// What is carried on the straight way from one sample to the next.
fn between(from: &Carried, to: &Carried, share: f64) -> Carried {
    let mixed = |of: fn(&Carried) -> f64| of(from) + share * (of(to) - of(from));
    Carried {
        weight: mixed(|c| c.weight),
        coupling: mixed(|c| c.coupling),
        inertia: mixed(|c| c.inertia),
        payload_weight: mixed(|c| c.payload_weight),
        payload_inertia: mixed(|c| c.payload_inertia),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_campaign::Rig;
    use softdock_campaign::rig::RigModel;
    use softdock_kernels::manipulator::inverse_dynamics;
    use std::path::Path;

    /// The shipped robot with axes that slide without friction, and its drives.
    fn robot() -> RobotRig {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/rigs/kr300.toml");
        let RigModel::Robot(mut rig) = Rig::load(&file).expect("the shipped rig").plant else { panic!("a robot") };
        for joint in &mut rig.model.joints {
            let friction = &mut joint.friction;
            (friction.coulomb, friction.stribeck, friction.viscous, friction.load_coefficient) = (0.0, 0.0, 0.0, 0.0);
        }
        *rig
    }

    /// The robot's drives, all with such gears.
    fn drives(rig: &RobotRig, compliance: f64, gear_damping: f64) -> Vec<DriveValues<f64>> {
        rig.drives.iter().map(|drive| DriveValues { compliance, gear_damping, ..drive.values }).collect()
    }

    /// Every axis of six swings at its own pace.
    fn swings(step: f64) -> Piece {
        let swing = |axis: usize, i: usize| 0.4 * ((1.0 + 0.3 * axis as f64) * i as f64 * step + axis as f64).sin();
        let signal = |axis: usize| (format!("q.{}", axis + 1), (0..1500).map(|i| swing(axis, i)).collect());
        let signals = (0..6).map(signal).collect();
        Piece { experiment: "swing".to_owned(), repeat: 1, start: 0.0, offset: 0.0, step, signals }
    }

    #[test]
    fn load_plus_own_inertia_equals_the_robot_torque() {
        let (rig, step) = (robot(), 0.004);
        let piece = swings(step);
        let rigid = drives(&rig, 0.0, 0.0);
        let motions = links::<6>(&rig, &piece, &rigid);
        for (model, kilograms) in [(rig.model.clone(), 0.0), (rig.model.with_load(1.0, Vec3::zero()), 1.0)] {
            let carried = carried::<6>(&rig, &piece, &rigid);
            for k in (300..1200).step_by(50) {
                let (angle, rate) = (at(&motions, k, |m| &m.value), at(&motions, k, |m| &m.rate));
                let acceleration = at(&motions, k, |m| &m.acceleration);
                let whole = inverse_dynamics(&model, angle, rate, acceleration, [0.0; 6]);
                for (axis, whole) in whole.iter().enumerate() {
                    let (own, values) = (&carried[axis][k], &rig.drives[axis].values);
                    let inertia = values.motor_inertia + own.inertia + kilograms * own.payload_inertia;
                    let load = own.weight + own.coupling + kilograms * own.payload_weight + values.offset;
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
    fn weight_and_coupling_of_an_axis_are_separated() {
        let (rig, piece) = (robot(), swings(0.004));
        let rigid = drives(&rig, 0.0, 0.0);
        let motions = links::<6>(&rig, &piece, &rigid);
        let carried = carried::<6>(&rig, &piece, &rigid);
        for k in (300..1200).step_by(50) {
            let held = inverse_dynamics(&rig.model, at(&motions, k, |m| &m.value), [0.0; 6], [0.0; 6], [0.0; 6]);
            for (axis, held) in held.iter().enumerate() {
                let weight = carried[axis][k].weight + rig.drives[axis].values.offset;
                assert!((weight - held).abs() < 1e-8 * held.abs().max(1e3), "axis {}: {weight} {held}", axis + 1);
            }
        }
        let most = |of: fn(&Carried) -> f64| carried[1].iter().map(of).fold(0.0_f64, |most, x| most.max(x.abs()));
        assert!(most(|c| c.coupling) > 0.05 * most(|c| c.weight), "{}", most(|c| c.coupling));
    }

    #[test]
    fn link_angle_is_motor_angle_minus_windup() {
        let (rig, step, compliance, damping) = (robot(), 0.004, 1e-7, 0.3);
        let mut piece = swings(step);
        let truth = links::<6>(&rig, &piece, &drives(&rig, 0.0, 0.0));
        let last = piece.samples() - 1;
        for axis in 0..6 {
            let wound = |k: usize| {
                let now = |of| at(&truth, k, of);
                let angle = now(|m| &m.value);
                let torques = rigid_torques(&rig.model, angle, now(|m| &m.rate), now(|m| &m.acceleration));
                compliance * (torques[axis] - helped(&rig.model, axis, angle[axis]))
            };
            // A gear with a damper, e + T e' = w, has wound up by e = w - T w' + T^2 w''.
            let (motor, link) = (rig.drives[axis].values.motor_inertia, rig.drives[axis].link_inertia);
            let late = 2.0 * damping * (motor * link / (motor + link) * compliance).sqrt();
            let wound: Vec<f64> = (0..=last).map(wound).collect();
            let windup = |k: usize| {
                let [before, now, after] = [k.saturating_sub(1), k, (k + 1).min(last)].map(|k| wound[k]);
                now - late * (after - before) / (2.0 * step) + (late / step).powi(2) * (after - 2.0 * now + before)
            };
            let windups: Vec<f64> = (0..=last).map(windup).collect();
            let angle = piece.signals.get_mut(&format!("q.{}", axis + 1)).expect("its angle");
            angle.iter_mut().zip(windups).for_each(|(angle, windup)| *angle += windup);
        }
        let found = links::<6>(&rig, &piece, &drives(&rig, compliance, damping));
        // Two seconds in, the links have swung out from having been wound up at rest.
        for k in (500..1200).step_by(50) {
            for (found, truth) in found.iter().zip(&truth) {
                assert!((found.value[k] - truth.value[k]).abs() < 1e-9, "{k} {} {}", found.value[k], truth.value[k]);
                let (own, right) = (found.acceleration[k], truth.acceleration[k]);
                assert!((own - right).abs() < 1e-5, "{k} {own} {right}");
            }
        }
    }
}
