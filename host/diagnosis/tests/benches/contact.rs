//! The contact bench.

use super::{Recorded, assert_nothing_found};
use softdock_gauntlet::Rig as Bench;

#[test]
fn null_recordings_give_no_effect() {
    assert_nothing_found(Bench::Contact);
}

#[test]
fn diverging_simulation_gives_bounded_residuals() {
    let block = Recorded::of(Bench::Contact, &[], 4).block();
    let part = block.part(false);
    let noise = part.noise(&block.base).expect("repeats");
    let sets = [block.base.clone(), vec![f64::NAN; block.base.len()]];
    let shortcut = part.shortcut(&noise, &block.base);
    for whitened in [part.whitened(&noise, &sets), shortcut.whitened(&sets), part.whitened_deviations(&noise, &sets)] {
        let powers: Vec<f64> = whitened.iter().map(|own| own.norm_squared()).collect();
        assert!(powers[1].is_finite() && powers[1] > 1e9 * powers[0], "{powers:?}");
    }
}
