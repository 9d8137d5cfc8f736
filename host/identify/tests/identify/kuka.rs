//! Real recordings of a KUKA KR 300 R2500 ultra: fitted on motion A, judged on motion B.

use crate::{kr300, root};
use softdock_campaign::Robot;
use softdock_identify::consistent::pseudo_inertia;
use softdock_identify::layout::INERTIAL;
use softdock_identify::log::Recording;
use softdock_identify::model::predicted;
use softdock_identify::motion::RecordedMotion;
use softdock_identify::published_errors::read_published_errors;
use softdock_identify::{IdentificationOptions, identify};

/// Relative errors in per cent that a good model of these recordings reaches.
const GOAL: [f64; 6] = [50.0, 38.0, 13.0, 42.0, 17.0, 25.0];

#[test]
fn the_model_of_one_motion_predicts_another() {
    let robot = kr300();
    let data = root().join("tests/data/kuka-kr300-recordings");
    let (a, b) = (data.join("traj_A.csv"), data.join("traj_B.csv"));
    let found = identify(&robot, &[&a], &[&b], &IdentificationOptions::default()).expect("identified");
    let ridge = read_published_errors(&data.join("marks.csv"), 6).expect("marks").pop().expect("a ridge").percent;
    let errors: Vec<f64> = found.validated[0].joints.iter().map(|joint| 100.0 * joint.relative_error).collect();
    for (joint, error) in errors.iter().enumerate() {
        assert!(*error <= ridge[joint] && *error <= GOAL[joint], "axis {}: {errors:.1?} %", joint + 1);
    }
    for (joint, compared) in found.fitted[0].joints.iter().enumerate() {
        assert!(compared.relative_error < 0.2, "axis {}: {}", joint + 1, compared.relative_error);
        assert!(compared.whiteness.p_value < 1e-3, "real residuals are not white");
    }

    // Every link is a body: positive mass, positive definite pseudo-inertia.
    for joint in 0..6 {
        let at = found.layout.inertial(joint);
        let pseudo = pseudo_inertia(&found.theta.as_slice()[at..at + INERTIAL]);
        assert!(pseudo.symmetric_eigenvalues().min() > 0.0, "link {}", joint + 1);
    }

    // The written file alone predicts the same.
    let again = Robot::from_text("robot.toml".as_ref(), &found.robot.to_toml(&[])).expect("a valid model");
    let recording = Recording::read(&b, &again).expect("the written map reads the recording");
    let motion = RecordedMotion::new(&recording, &IdentificationOptions::default().preparation).expect("a motion");
    for (joint, series) in predicted(&again.model, &motion).iter().enumerate() {
        let shown = &found.validated[0].joints[joint].predicted;
        let difference = series.iter().zip(shown).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(difference < 1e-6, "axis {}: {difference} N m", joint + 1);
    }
}

/// The difference of the encoders is the recorder's lag, not the gear's wind-up.
#[test]
fn second_encoders_are_three_milliseconds_late() {
    let data = root().join("tests/data/kuka-kr300-recordings");
    let options =
        IdentificationOptions { choose_shapes: false, lambda: Some(1e-3), ..IdentificationOptions::default() };
    let found = identify(&kr300(), &[&data.join("traj_A.csv")], &[], &options).expect("identified");
    assert_eq!(found.elasticity.len(), 3);
    for row in &found.elasticity {
        assert!((row.lag_s - 0.003).abs() < 2e-4 && row.explained_by_lag > 0.97, "{row:?}");
    }
}
