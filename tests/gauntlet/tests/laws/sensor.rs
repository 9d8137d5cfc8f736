//! The sensor's effects as its recordings show them.

use crate::support::{Recording, distance, set};
use softdock_gauntlet::{Hidden, Rig, fresh};

const RIG: Rig = Rig::Sensor;

/// The noise-free motion with and without one effect.
fn pair(id: &'static str, size: f64) -> (Recording, Recording) {
    let fresh = fresh(RIG, &[Hidden { id, size }], 21).expect(id);
    (Recording::read(&fresh.with_effect), Recording::read(&fresh.without_effect))
}

/// Change of a column by an effect.
fn change(pair: &(Recording, Recording), name: &str) -> Vec<f64> {
    pair.0.column(name).iter().zip(pair.1.column(name)).map(|(with, without)| with - without).collect()
}

#[test]
fn the_healthy_sensor_reads_the_reference() {
    let (_, healthy) = pair("S1_bias", 1.0);
    for (reading, reference, bound) in
        [("f_x_n", "f_ref_x_n", 1.5), ("f_z_n", "f_ref_z_n", 1.5), ("m_y_nm", "m_ref_y_nm", 0.3)]
    {
        // Within the tolerances: bias 0.2 N and 0.02 N m, gain 0.2 %, tool 5 g, clock 0.2 ms on blows of 150 N.
        let apart = distance(&healthy.column(reading), &healthy.column(reference));
        assert!(apart < bound, "{reading}: {apart}");
    }
}

#[test]
fn a_heavier_tool_shows_with_gravity_and_acceleration() {
    let pair = pair("S8_load", 0.15);
    let [x, y, z] = ["f_x_n", "f_y_n", "f_z_n"].map(|name| change(&pair, name));
    for row in (0..x.len()).step_by(100) {
        let at = |name: &str| pair.1.column(name)[row];
        // Sensor axes to world axes, for the weight along -z of the world.
        let [qw, qx, qy, qz] = ["qw", "qx", "qy", "qz"].map(at);
        let down = [2.0 * (qx * qz - qw * qy), 2.0 * (qy * qz + qw * qx), 1.0 - 2.0 * (qx * qx + qy * qy)];
        let acceleration = ["ax_m_per_s2", "ay_m_per_s2", "az_m_per_s2"].map(at);
        for (axis, change) in [&x, &y, &z].into_iter().enumerate() {
            let expected = 0.15 * (-9.80665 * down[axis] - acceleration[axis]);
            // What the tool's centre, 9 cm off, adds when it turns.
            assert!((change[row] - expected).abs() < 0.3, "{row} {axis}: {} instead of {expected}", change[row]);
        }
    }
}

#[test]
fn low_pass_delays_by_its_time_constant() {
    let pair = pair("S5_low_pass", 0.001);
    // The third blow, 150 N along -z at 1.4 s for 4 ms: a filter moves its centroid by T, whatever its shape.
    let late = change(&pair, "f_z_n");
    let moment: f64 = (1396..1416).map(|row| late[row] * (row as f64 - 1405.5) * 1e-3).sum::<f64>() * 1e-3;
    let impulse = -150.0 * 0.004 * 2.0 / std::f64::consts::PI;
    assert!((moment / impulse - 0.001).abs() < 5e-5, "{}", moment / impulse);
}

#[test]
fn hidden_noise_has_its_size_and_no_mean() {
    let change = change(&pair("S7_noise", 1.0), "f_x_n");
    let mean = change.iter().sum::<f64>() / change.len() as f64;
    let deviation = distance(&change, &vec![mean; change.len()]);
    assert!(mean.abs() < 0.5 && (deviation - 1.0).abs() < 0.3, "{mean} {deviation}");
    let slow = change.windows(2).map(|pair| (pair[1] - pair[0]).powi(2)).sum::<f64>() / change.len() as f64;
    assert!(slow < 0.1, "neighbours differ by {slow}");
}

#[test]
fn a_drift_grows_over_the_session() {
    let (with, without) = (set(RIG, &[Hidden { id: "S2_drift", size: 0.02 }], 3), set(RIG, &[], 3));
    for ((name, with), (_, without)) in with.logs.iter().zip(&without.logs) {
        let pair = (Recording::read(with), Recording::read(without));
        let time = pair.0.column("t_s")[0] + 2.0;
        let mean = |axis: &str| change(&pair, axis).iter().sum::<f64>() / pair.0.len() as f64;
        let grown = ["f_x_n", "f_y_n", "f_z_n"].map(mean).iter().map(|mean| mean * mean).sum::<f64>().sqrt();
        assert!((grown - 0.02 * time).abs() < 0.01, "{name}: {grown} at {time} s");
    }
}
