//! Real recordings of a KUKA KR 300 R2500 ultra: fitted on one, judged on the other.

use softdock_campaign::Robot;
use softdock_diagnosis::{Options, identify};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Relative errors in per cent that are known for fitting A and predicting B: a ridge over 13 parameters and an offset.
const RIDGE: [f64; 6] = [67.0, 43.0, 14.0, 48.0, 18.0, 27.0];

#[test]
fn the_model_of_one_motion_predicts_another() {
    let robot = Robot::load(&root().join("campaigns/models/kr300_r2500.toml")).expect("the shipped robot");
    let data = root().join("tests/data/kuka-kr300-recordings");
    let (a, b) = (data.join("traj_A.csv"), data.join("traj_B.csv"));
    let found = identify(&robot, &[&a], &[&b], &Options::default()).expect("identified");
    for compared in found.fitted.iter().chain(&found.validated) {
        let shown = |f: &dyn Fn(&softdock_diagnosis::Comparison) -> f64| {
            compared.joints.iter().map(|joint| format!("{:.1}", 100.0 * f(joint))).collect::<Vec<_>>().join(" ")
        };
        println!("{}: {}   plain {}", compared.name, shown(&|j| j.relative_error), shown(&|j| j.plain_error));
    }
    for score in &found.scores {
        println!("{} {:.1} {:.0?}", score.lambda, 100.0 * score.mean(), score.errors.iter().map(|e| 100.0 * e).collect::<Vec<_>>());
    }
    println!("{:?}\ncondition {}", found.shapes, found.least_squares.condition);
    println!("{:?}", found.elasticity);
    for joint in &found.robot.model.joints { println!("{:.1} kg, J {:.5}, fc {:.0} fs {:.0} fv {:.0} off {:.0} {:?}", joint.link.mass, joint.drive.rotor_inertia, joint.friction.coulomb, joint.friction.stribeck, joint.friction.viscous, joint.drive.torque_offset, joint.counterweight); }
    for (joint, (compared, known)) in found.validated[0].joints.iter().zip(RIDGE).enumerate() {
        let error = 100.0 * compared.relative_error;
        assert!(error <= known, "axis {}: {error:.1} % where a ridge leaves {known} %", joint + 1);
    }
}
