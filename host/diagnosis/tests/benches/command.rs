//! The command's way.

use super::{Recorded, assert_nothing_found};
use softdock_gauntlet::{Hidden, Rig as Bench};

#[test]
fn null_recordings_give_no_effect() {
    assert_nothing_found(Bench::Command);
}

#[test]
fn row_weights_are_equal_in_all_repeats() {
    let block = Recorded::of(Bench::Command, &[Hidden { id: "C4_drops", size: 0.01 }], 4).block();
    let width = block.section.inputs().len();
    let weights = |number: usize| block.trials[number].recorded.inputs.iter().step_by(width);
    let (count, mut silent) = (block.trials.len(), 0);
    for (a, b) in (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b))) {
        if block.trials[a].experiment == block.trials[b].experiment {
            assert!(weights(a).zip(weights(b)).all(|(own, other)| (own - other).abs() <= 1e-9 * own));
            silent += weights(a).filter(|weight| **weight == 0.0).count();
        }
    }
    assert!(silent > 2 * 150 * count, "ends and losses weigh nothing: {silent}");
}
