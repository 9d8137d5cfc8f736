//! Regressor times parameters against inverse dynamics, and base parameters against what a change leaves unseen.

use crate::kr300;
use nalgebra::{DMatrix, DVector};
use softdock_identify::base::Base;
use softdock_identify::layout::{INERTIAL, Layout};
use softdock_identify::model::identified;
use softdock_identify::regressor::rigid_regressor;
use softdock_identify::system::shapes;
use softdock_kernels::manipulator::rigid_torques;
use softdock_kernels::philox;

fn state(k: u64, what: &str) -> [f64; 6] {
    std::array::from_fn(|joint| 4.0 * philox::uniform(3, what, k, joint as u32) - 2.0)
}

#[test]
fn regressor_times_parameters_is_inverse_dynamics() {
    let robot = kr300();
    let layout = Layout::of(&robot);
    let theta = layout.values(&robot);
    for k in 0..50 {
        let (angle, rate, acceleration) = (state(k, "q"), state(k, "v"), state(k, "a"));
        let torques = rigid_torques(&robot.model, angle, rate, acceleration);
        let rows = rigid_regressor(&robot.model, &angle, &rate, &acceleration);
        for (joint, (row, torque)) in rows.iter().zip(torques).enumerate() {
            let value: f64 =
                row.iter().enumerate().map(|(at, x)| x * theta[layout.inertial(at / INERTIAL) + at % INERTIAL]).sum();
            assert!((value - torque).abs() < 1e-9 * torque.abs().max(1.0), "{k} {joint}: {value} {torque}");
        }
    }
}

#[test]
fn parameters_survive_a_round_trip_through_a_model() {
    let robot = kr300();
    let layout = Layout::of(&robot);
    let theta = DVector::from_vec(layout.values(&robot));
    let again = identified(&robot, &theta, &shapes(&robot), "a test");
    let values = DVector::from_vec(layout.values(&again));
    let difference = (&values - &theta).amax();
    assert!(difference < 1e-9, "{difference}");
}

/// Six revolute joints with the first one vertical and the second across it have 36 base parameters of links and 4 of
/// rotors (Mayeda, Yoshida, Osuka 1990); each joint adds friction (3) and an offset, the counterbalance 2.
/// What the map cannot see, no torque shows.
#[test]
fn base_parameters_span_the_torques() {
    let robot = kr300();
    let (layout, base) = (Layout::of(&robot), Base::of(&robot));
    assert_eq!(base.len(), 36 + 4 + 4 * 6 + 2);
    // Any change in the null space of the map changes no torque.
    let svd = base.map.clone().svd(false, true);
    let rows = svd.v_t.expect("asked for");
    let project = |theta: &DVector<f64>| theta - rows.transpose() * (&rows * theta);
    let unseen = project(&DVector::from_fn(layout.len(), |i, _| philox::uniform(9, "theta", i as u64, 0) - 0.5));
    assert!(unseen.norm() > 0.1 && (&base.map * &unseen).amax() < 1e-9);
    let (angle, rate, acceleration) = (state(1, "q"), state(1, "v"), state(1, "a"));
    let w = rigid_regressor(&robot.model, &angle, &rate, &acceleration);
    let w = DMatrix::from_fn(6, 60, |joint, at| w[joint][at]);
    let links = DVector::from_fn(60, |at, _| unseen[layout.inertial(at / INERTIAL) + at % INERTIAL]);
    let rigid = &w * &links;
    for joint in 0..6 {
        let mut torque =
            rigid[joint] + acceleration[joint] * unseen[layout.rotor(joint)] + unseen[layout.offset(joint)];
        if let Some(place) = layout.counterweight(joint) {
            torque += angle[joint].sin() * unseen[place] + angle[joint].cos() * unseen[place + 1];
        }
        assert!(torque.abs() < 1e-8, "joint {joint}: {torque}");
        for place in [layout.coulomb(joint), layout.viscous(joint), layout.stribeck(joint)] {
            assert!(unseen[place].abs() < 1e-9, "friction is seen");
        }
    }
}
