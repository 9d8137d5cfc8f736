//! The sensor bench.

use super::{Recorded, assert_named, assert_nothing_found};
use softdock_campaign::rig::Plant;
use softdock_diagnosis::variance::excess_noise;
use softdock_gauntlet::{Hidden, Rig as Bench};

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    assert_nothing_found(Bench::Sensor);
}

#[test]
#[ignore = "minutes: the full size"]
fn what_is_hidden_is_named() {
    for (id, size) in [("S2_drift", 0.02), ("S4_crosstalk", 0.02), ("S5_low_pass", 0.001), ("S8_load", 0.15)] {
        assert_named(Bench::Sensor, id, size, id);
    }
}

#[test]
fn more_noise_shows_in_the_repeats_and_not_in_their_mean() {
    let odds = |hidden: &[Hidden]| {
        let recorded = Recorded::of(Bench::Sensor, hidden, 4);
        let Plant::Sensor(rig) = &recorded.rig.plant else { unreachable!("a sensor bench") };
        excess_noise(rig, &recorded.block()).expect("healthy noise is known")
    };
    assert!(odds(&[]).log_odds < 0.0, "{:?}", odds(&[]));
    let more = odds(&[Hidden { id: "S7_noise", size: 1.0 }]);
    assert!(more.log_odds > 20.0 && (more.deviation[0].value - 1.0).abs() < 0.15, "{more:?}");
    assert!((more.deviation[1].value - 0.1).abs() < 0.015 && (more.correlation_time - 0.05).abs() < 0.02, "{more:?}");
}
