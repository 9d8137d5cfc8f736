//! The free body.

use super::{Recorded, Said, said};
use softdock_diagnosis::library::body::effects;
use softdock_gauntlet::{Hidden, Rig as Bench};

fn diagnosed(hidden: &[Hidden], seed: u64) -> Said {
    let block = Recorded::of(Bench::Body, hidden, seed).block();
    said(&block, &effects(&block))
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    let said = diagnosed(&[], 1);
    assert!(said.log_odds < 5.0 && said.misfit < 1.1, "{said:?}");
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
        let said = diagnosed(&[Hidden { id, size }], 11);
        assert!(
            said.ids == [named] && said.log_odds > 20.0 && said.gap > 10.0 && said.held_out < 1.3,
            "{id}: {said:?}"
        );
    }
}
