//! Hidden errors of a robot as a whole, in torques from inverse dynamics.

use super::*;
use crate::verdict::answer::DiagnosisVerdict;
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use softdock_kernels::manipulator::{AxisCoupling, RobotErrors, rigid_torques};
use softdock_kernels::philox::uniform;
use std::path::Path;

fn robot() -> RobotRig {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/rigs/kr300.toml");
    match Rig::load(&file).expect("the shipped rig").plant {
        RigModel::Robot(rig) => *rig,
        _ => panic!("a robot"),
    }
}

/// Recordings of a robot: two motions, one held out; friction 10 % beyond the model's on every other axis, noise of 1 % of
/// the torque, and slow torques that no term describes.
fn recordings(truth: &RobotRig, coupling: Option<AxisCoupling<f64>>) -> Recordings {
    let (step, count) = (0.004, 3000);
    let piece = |name: &str, number: usize| {
        let swing = |axis: usize, time: f64, order: i32| {
            let term = |k: usize| {
                let omega = 0.9 + 0.35 * axis as f64 + 0.8 * k as f64 + 0.2 * number as f64;
                let phase = (axis + 2 * k + number) as f64 + f64::from(order) * std::f64::consts::FRAC_PI_2;
                0.25 * omega.powi(order) * (omega * time + phase).sin()
            };
            term(0) + term(1)
        };
        let mut piece = Piece {
            experiment: name.to_owned(),
            repeat: 1,
            offset: 0.0,
            start: 0.0,
            step,
            signals: Default::default(),
        };
        for axis in 0..6 {
            piece
                .signals
                .insert(format!("q.{}", axis + 1), (0..count).map(|k| swing(axis, k as f64 * step, 0)).collect());
            piece.signals.insert(format!("tau.{}", axis + 1), Vec::new());
        }
        for k in 0..count {
            let at = |order| -> [f64; 6] { std::array::from_fn(|axis| swing(axis, k as f64 * step, order)) };
            let [angle, rate, acceleration] = [at(0), at(1), at(2)];
            let mut torque = rigid_torques(&truth.model, angle, rate, acceleration);
            for axis in 0..6 {
                let (own, factor) = (&truth.drives[axis].values, if axis % 2 == 0 { 1.1 } else { 1.0 });
                torque[axis] += own.motor_inertia * acceleration[axis] + own.offset;
                torque[axis] += factor * own.coulomb * (rate[axis] / 0.005).tanh() + own.viscous * rate[axis];
                torque[axis] -= crate::plants::robot::links::helped(&truth.model, axis, angle[axis]);
            }
            if let Some(own) = coupling {
                let both = rate[5] + own.coupling_ratio * rate[4];
                let sign = |rate: f64| (rate / 0.005).tanh();
                torque[5] += own.coupling_viscous * own.coupling_ratio * rate[4];
                torque[5] += own.coupling_coulomb * (sign(both) - sign(rate[5]));
                torque[4] += own.coupling_ratio * (own.coupling_viscous * both + own.coupling_coulomb * sign(both));
            }
            for (axis, torque) in torque.into_iter().enumerate() {
                let scale = 0.02 * truth.drives[axis].values.coulomb;
                let slow = scale * (1.7 * angle[axis] + 2.3 * angle[(axis + 1) % 6]).sin();
                let noise = 0.2 * scale * (2.0 * uniform(3, &format!("{name} {axis}"), 0, k as u32) - 1.0);
                piece.signals.get_mut(&format!("tau.{}", axis + 1)).expect("inserted").push(torque + slow + noise);
            }
        }
        piece
    };
    let pieces = vec![piece("a", 0), piece("b", 3)];
    Recordings { pieces, held_out: ["b".to_owned()].into() }
}

fn answer(coupling: Option<AxisCoupling<f64>>, errors: RobotErrors<f64>, without: &[String]) -> Option<BlockAnswer> {
    let rig = robot();
    let truth = RobotRig { model: rig.model.with_errors(&errors), ..rig.clone() };
    Whole::of(&rig, &recordings(&truth, coupling), without).answer
}

fn named(coupling: Option<AxisCoupling<f64>>, errors: RobotErrors<f64>) -> BlockAnswer {
    let found = answer(coupling, errors, &[]).expect("a cause");
    assert_eq!((found.answer, found.effects.len()), (DiagnosisVerdict::Named, 1), "{found:?}");
    found
}

#[test]
fn nothing_hidden_gives_no_name() {
    let answer = answer(None, RobotErrors::null(), &[]);
    let answer = answer.expect("long recordings");
    assert_eq!((answer.answer, answer.effects.len()), (DiagnosisVerdict::NoEffect, 0), "{answer:?}");
}

#[test]
fn load_at_the_flange_is_found_with_its_place() {
    let errors = RobotErrors { payload: 40.0, payload_place_x: 0.1, payload_place_z: 0.2, ..RobotErrors::null() };
    let found = named(None, errors);
    assert_eq!(found.effects[0].id, "J14_payload");
    for (name, truth, least) in [("payload", 40.0, 8.0), ("payload_place_x", 0.1, 0.05), ("payload_place_z", 0.2, 0.1)]
    {
        let own = &found.effects[0].parameters[name];
        assert!((own.lo..=own.hi).contains(&truth) && (own.value - truth).abs() < least, "{name}: {own:?}");
    }
    let without = answer(None, errors, &["J14_payload".to_owned()]);
    assert!(without.is_none_or(|answer| answer.effects.iter().all(|effect| effect.id != "J14_payload")));
}

#[test]
fn tilted_base_is_found() {
    let errors = RobotErrors { tilt_x: 0.06, tilt_y: -0.04, ..RobotErrors::null() };
    let found = named(None, errors);
    let [x, y] = ["tilt_x", "tilt_y"].map(|name| found.effects[0].parameters[name].value);
    assert!((x - 0.06).abs() < 0.02 && (y + 0.04).abs() < 0.02, "{x} {y}");
}

#[test]
fn coupled_motor_of_the_wrist_is_found() {
    let own = &robot().drives[5].values;
    let coupling = AxisCoupling {
        coupling_ratio: -1.0,
        coupling_viscous: own.viscous,
        coupling_coulomb: own.coulomb,
        ..AxisCoupling::null()
    };
    let found = named(Some(coupling), RobotErrors::null());
    let effect = &found.effects[0];
    assert_eq!((effect.id, effect.block), ("J22_axis_coupling", "R3 coupling of axes 5 and 6"));
    assert_eq!(effect.parameters["coupling_ratio"].value, -1.0);
    let coulomb = effect.parameters["coupling_coulomb"].value;
    assert!((coulomb / own.coulomb - 1.0).abs() < 0.15, "{coulomb}");
}
