//! The drive's effects as its recordings show them.

use crate::support::{Recording, set};
use softdock_gauntlet::{Hidden, Rig, fresh};

const RIG: Rig = Rig::Drive { link_encoder: true };

/// The noise-free motion with and without one effect.
fn pair(id: &'static str, size: f64) -> (Recording, Recording) {
    let fresh = fresh(RIG, &[Hidden { id, size }], 21).expect(id);
    (Recording::read(&fresh.with_effect), Recording::read(&fresh.without_effect))
}

/// A true parameter of the effect hidden alone.
fn parameter(id: &'static str, size: f64, name: &str) -> f64 {
    let truth = set(RIG, &[Hidden { id, size }], 21).truth;
    truth.hidden[0].parameters.iter().find(|parameter| parameter.name == name).expect(name).value
}

/// Delay \[s\] of a record against another over a stretch of rows: projection of the difference on the rate.
fn delay(late: &Recording, early: &Recording, rows: std::ops::Range<usize>) -> f64 {
    let (late, early) = (late.column("q_rad"), early.column("q_rad"));
    let rate = |row: usize| (early[row + 1] - early[row - 1]) / 0.008;
    let sums = rows.fold((0.0, 0.0), |(cross, power), row| {
        (cross - (late[row] - early[row]) * rate(row), power + rate(row).powi(2))
    });
    sums.0 / sums.1
}

#[test]
fn a_transport_delay_moves_the_whole_record() {
    let (late, early) = pair("C1_transport_delay", 0.008);
    let (late, early) = (late.column("q_rad"), early.column("q_rad"));
    // The brake opens at t = 0 in both; a second later the start is forgotten.
    for row in 250..late.len() {
        assert!((late[row] - early[row - 2]).abs() < 2e-6, "{row}");
    }
}

#[test]
fn timing_effects_delay_by_their_size() {
    for (id, size, expected) in
        [("C1_transport_delay", 0.003, 0.003), ("C2_lag", 0.003, 0.003), ("C6_hold", 0.004, 0.0015)]
    {
        let (late, early) = pair(id, size);
        // A hold of four ticks is late by 0, 1, 2 and 3 of them: 1.5 ms at the controller's clock.
        let found = delay(&late, &early, 250..1450);
        assert!((found - expected).abs() < 2e-4, "{id}: {found}");
    }
    let (late, early) = pair("C5_skew", 0.001);
    for rows in [250..450, 1250..1450] {
        let expected = 0.001 * 0.004 * (rows.start + rows.end) as f64 / 2.0;
        let found = delay(&late, &early, rows);
        assert!((found - expected).abs() < 3e-4, "{found} instead of {expected}");
    }
}

#[test]
fn a_gap_shows_between_the_encoders() {
    let (with, without) = pair("J7_backlash", 0.0005);
    let twist = |record: &Recording| -> Vec<f64> {
        record.column("q_rad").iter().zip(record.column("ql_rad")).map(|(motor, link)| motor - link).collect()
    };
    assert!(twist(&without).iter().all(|twist| twist.abs() < 1e-12));
    let twist = twist(&with);
    let on = |sign: f64| twist.iter().filter(|twist| **twist * sign > 0.0005).count();
    let inside = twist.iter().filter(|twist| twist.abs() < 0.00045).count();
    assert!(on(1.0) > 100 && on(-1.0) > 20 && inside > 10, "{} {} {inside}", on(1.0), on(-1.0));
    assert!(twist.iter().all(|twist| twist.abs() < 0.0008));
}

#[test]
fn a_transmission_error_shows_between_the_encoders_at_its_period() {
    let (id, size) = ("J10_transmission_error", 0.0003);
    let (number, phase) = (parameter(id, size, "periods"), parameter(id, size, "phase"));
    let (with, _) = pair(id, size);
    for (motor, link) in with.column("q_rad").into_iter().zip(with.column("ql_rad")) {
        assert!((link - motor - size * (number * motor + phase).sin()).abs() < 1e-10);
    }
}

#[test]
fn ripple_is_a_line_over_the_angle() {
    let (id, size) = ("J9_torque_ripple", 3.0);
    let number = parameter(id, size, "periods");
    let (with, without) = pair(id, size);
    let torque: Vec<f64> =
        with.column("tau_nm").iter().zip(without.column("tau_nm")).map(|(with, without)| with - without).collect();
    let angle = with.column("q_rad");
    let line = |number: f64| {
        let sum = torque.iter().zip(&angle).fold([0.0; 2], |sum, (torque, angle)| {
            let (sin, cos) = (number * angle).sin_cos();
            [sum[0] + torque * sin, sum[1] + torque * cos]
        });
        2.0 * sum[0].hypot(sum[1]) / torque.len() as f64
    };
    let highest = (0..1200).map(|i| 15.0 + 0.05 * f64::from(i)).max_by(|a, b| line(*a).total_cmp(&line(*b)));
    assert!((highest.expect("a line") - number).abs() < 1.0, "{highest:?} instead of {number}");
    assert!(line(number) > 0.5 && line(number) < 4.0, "{}", line(number));
}

#[test]
fn warm_up_continues_from_record_to_record() {
    let hidden = Hidden { id: "J6_warm_up", size: 0.4 };
    let (warm, cold) = (set(RIG, &[hidden], 3), set(RIG, &[], 3));
    // Torque against speed in the sweeps, by their start on the session's clock: what viscous friction has lost.
    let mut lost: Vec<(f64, f64)> = warm
        .logs
        .iter()
        .zip(&cold.logs)
        .filter(|((name, _), _)| name.starts_with("multisine"))
        .map(|((_, warm), (_, cold))| {
            let (warm, cold) = (Recording::read(warm), Recording::read(cold));
            let (q, t) = (cold.column("q_rad"), cold.column("t_s"));
            let (warm, cold) = (warm.column("tau_nm"), cold.column("tau_nm"));
            let rate = |row: usize| (q[row + 1] - q[row - 1]) / 0.008;
            let sums = (1..q.len() - 1).fold((0.0, 0.0), |(cross, power), row| {
                (cross + (warm[row] - cold[row]) * rate(row), power + rate(row).powi(2))
            });
            (t[0], sums.0 / sums.1)
        })
        .collect();
    lost.sort_by(|a, b| a.0.total_cmp(&b.0));
    for &(start, lost) in &lost {
        let warmth = 1.0 - (-(start + 3.0) / 40.0_f64).exp();
        let expected = 30.0 * ((-0.4 * warmth).exp() - 1.0);
        assert!((lost - expected).abs() < 1.0, "at {start} s: {lost} instead of {expected}");
    }
    assert!(lost[0].1 - lost[2].1 > 2.0, "{lost:?}");
}
