//! The contact bench.

use super::{Recorded, Said, said};
use softdock_diagnosis::library::contact::effects;
use softdock_gauntlet::{Hidden, Rig as Bench};

fn diagnosed(hidden: &[Hidden], seed: u64) -> Said {
    let block = Recorded::of(Bench::Contact, hidden, seed).block();
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
    for (id, size) in [("K3_damping", 3e5), ("K6_anisotropy", 0.15), ("K8_adhesion", 10.0)] {
        let said = diagnosed(&[Hidden { id, size }], 11);
        assert!(said.ids == [id] && said.log_odds > 20.0 && said.gap > 10.0 && said.held_out < 1.3, "{id}: {said:?}");
    }
}
