//! The contact bench.

use super::{assert_named, assert_nothing_found};
use softdock_gauntlet::Rig as Bench;

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    assert_nothing_found(Bench::Contact);
}

#[test]
#[ignore = "minutes: the full size"]
fn what_is_hidden_is_named() {
    for (id, size) in [("K3_damping", 3e5), ("K6_anisotropy", 0.15), ("K8_adhesion", 10.0)] {
        assert_named(Bench::Contact, id, size, id);
    }
}
