//! The free body.

use super::{assert_named, assert_nothing_found};
use softdock_gauntlet::Rig as Bench;

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    assert_nothing_found(Bench::Body);
}

#[test]
#[ignore = "minutes: the full size"]
fn what_is_hidden_is_named() {
    let cases = [
        ("P1_mass", 9.0, "P1_mass"),
        ("P1_centre", 0.02, "P1_mass"),
        ("P2_slosh", 12.0, "P2_slosh"),
        ("P3_appendage", 3.0, "P3_appendage"),
    ];
    for (id, size, named) in cases {
        assert_named(Bench::Body, id, size, named);
    }
}
