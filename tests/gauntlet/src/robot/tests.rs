//! Robot rig against its model and experiments.

use super::*;
use crate::catalogue::{Hidden, Rig};
use crate::session::exact;

fn columns(text: &str) -> Vec<Vec<f64>> {
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect())
        .collect();
    (0..COLUMNS.len()).map(|column| rows.iter().map(|row| row[column]).collect()).collect()
}

/// Root mean square of what a hidden effect changes in a column of the multisine.
fn change(hidden: &[Hidden], column: usize) -> f64 {
    let of = |hidden: &[Hidden]| {
        let set = exact(Rig::Robot, hidden, 3).expect("a set");
        columns(&set.logs.iter().find(|log| log.0 == "multisine_1.csv").expect("an experiment").1)
    };
    let (with, without) = (of(hidden), of(&[]));
    let squares = with[column].iter().zip(&without[column]).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f64>() / with[column].len() as f64).sqrt()
}

#[test]
fn the_robot_follows_its_motions() {
    let set = exact(Rig::Robot, &[], 3).expect("a set");
    assert_eq!((set.logs.len(), set.holdout.len(), set.beside[0].0.as_str()), (9, 3, "robot.toml"));
    for (name, text) in set.logs.iter().chain(&set.holdout) {
        let columns = columns(text);
        let motions = motions::motions(name.split('_').next().expect("a name"));
        let start = columns[0][0];
        for (axis, motion) in motions.iter().enumerate() {
            let off = columns[0].iter().zip(&columns[1 + axis]).map(|(t, q)| (motion.at(t - start)[0] - q).abs());
            let worst = off.fold(0.0, f64::max);
            assert!(worst < 5e-3, "{name}, axis {}: {worst}", axis + 1);
        }
        let peak = columns[5].iter().fold(0.0_f64, |peak, torque| peak.max(torque.abs()));
        assert!((100.0..1500.0).contains(&peak), "{name}: {peak} N m at the shoulder");
    }
}

#[test]
fn shoulder_friction_changes_the_shoulder_torque() {
    let hidden = [Hidden { id: "J2_viscous", size: 8.0 }];
    let (base, shoulder, elbow) = (change(&hidden, 4), change(&hidden, 5), change(&hidden, 6));
    assert!(shoulder > 1.0 && base < 0.1 * shoulder && elbow < 0.1 * shoulder, "{base} {shoulder} {elbow}");
}
