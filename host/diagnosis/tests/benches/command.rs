//! The command's way.

use super::{assert_named, assert_nothing_found};
use softdock_gauntlet::Rig as Bench;

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    assert_nothing_found(Bench::Command);
}

#[test]
#[ignore = "minutes: the full size"]
fn what_is_hidden_is_named() {
    let cases = [
        ("C1_transport_delay", 0.003, "C1_transport_delay"),
        ("C2_lag", 0.003, "C2_lag"),
        ("C5_skew", 0.0003, "C5_clock_skew"),
        ("C6_hold", 0.004, "C6_hold"),
        ("C7_rate_limit", 0.5, "C7_rate_limit"),
    ];
    for (id, size, named) in cases {
        assert_named(Bench::Command, id, size, named);
    }
}
