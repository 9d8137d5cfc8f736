//! A few runs of the shipped docking campaign: touch, capture and validity.

use softdock_engine::cpu::CpuEngine;
use softdock_engine::{Engine, Job, RunInput, is_noisy};
use softdock_kernels::metrics::flags;
use softdock_kernels::outcome::Finished;
use softdock_kernels::plant::Plant;
use std::path::Path;

/// The first 32 runs of a shipped campaign.
fn runs_of(file: &str) -> Vec<Finished> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns").join(file);
    let campaign = softdock_campaign::load(&file).expect("the shipped campaign is good");
    let runs: Vec<_> = (0..32).map(|run| RunInput::new(run, campaign.draw(run).expect("a draw").params)).collect();
    let noisy = runs.iter().any(|input| is_noisy(&input.params));
    let job = Job::new(Plant::new(campaign.scenario.model.clone()), campaign.seed, noisy);
    CpuEngine::new().run(&job, &runs, &|_| true).expect("nobody stops the batch")
}

/// Checks that contacts and latch leave linear and angular momentum, of some 10 to 200 kg m/s, to rounding.
fn assert_momentum(row: &Finished) {
    for side in [row.space, row.hil] {
        // The facility's wrench is exactly opposite on its two bodies, too.
        assert!(side.linear_momentum_error < 2e-8, "run {}: linear {}", row.run, side.linear_momentum_error);
        assert!(side.angular_momentum_error < 2e-8, "run {}: angular {}", row.run, side.angular_momentum_error);
    }
}

/// A cube on a plate with four bumpers: points of both parts, two laws, seven joints.
#[test]
fn berthing_campaign_sits_on_its_bumpers_and_keeps_momentum() {
    let rows = runs_of("berth.toml");
    for row in &rows {
        assert_eq!(row.flags & flags::INVALID, 0, "run {}", row.run);
        assert!(row.space.touch_time > 2.0 && row.hil.touch_time > 2.0, "run {}: {:?}", row.run, row.space);
        // Four bumpers of 4 kN/m and a moving mass of some 100 kg at 20 mm/s: far from the stroke of 20 mm.
        assert!(row.space.peak_depth < 0.02, "run {}: {:?}", row.run, row.space);
        assert_momentum(row);
    }
    let captured = rows.iter().filter(|row| row.space.capture_time > 0.0).count();
    assert!((20..32).contains(&captured), "{captured} of 32 captured");
}

#[test]
fn the_docking_campaign_touches_captures_and_stays_valid() {
    let rows = runs_of("probe_drogue.toml");
    let count = |holds: &dyn Fn(&Finished) -> bool| rows.iter().filter(|row| holds(row)).count();

    assert_eq!(count(&|row| row.flags & flags::INVALID != 0), 0, "invalid runs");
    // Loose bounds on purpose: they catch a broken start, cone or latch, not a change of the campaign.
    assert!(count(&|row| row.space.touch_time >= 0.0) >= 28, "nearly all runs touch");
    assert!((20..32).contains(&count(&|row| row.space.capture_time >= 0.0)), "most runs capture, some do not");
    assert!(count(&|row| row.stop.is_some()) > 0, "long dead times inject energy, and a rule stops the session");
    for row in &rows {
        assert!(row.space.peak_contact_force < 1e3 && row.space.peak_depth < 0.02, "run {}: {:?}", row.run, row.space);
        assert_momentum(row);
    }
}
