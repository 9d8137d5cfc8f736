//! The command's way.

use super::{Recorded, Said, said};
use softdock_diagnosis::library::command::effects;
use softdock_gauntlet::{Hidden, Rig as Bench};

fn diagnosed(hidden: &[Hidden], seed: u64) -> Said {
    let block = Recorded::of(Bench::Command, hidden, seed).block();
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
        ("C1_transport_delay", 0.003, "C1_transport_delay"),
        ("C2_lag", 0.003, "C2_lag"),
        ("C5_skew", 0.0003, "C5_clock_skew"),
        ("C6_hold", 0.004, "C6_hold"),
        ("C7_rate_limit", 0.5, "C7_rate_limit"),
    ];
    for (id, size, named) in cases {
        let said = diagnosed(&[Hidden { id, size }], 11);
        assert!(
            said.ids == [named] && said.log_odds > 20.0 && said.gap > 10.0 && said.held_out < 1.3,
            "{id}: {said:?}"
        );
    }
}
