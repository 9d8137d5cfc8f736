//! A few runs of the shipped docking campaign: touch, capture and validity.

use softdock_engine::cpu::CpuEngine;
use softdock_engine::{Engine, Job, RunInput, is_noisy};
use softdock_kernels::metrics::flags;
use softdock_kernels::plant::Plant;
use std::path::Path;

#[test]
fn the_docking_campaign_touches_captures_and_stays_valid() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/probe_drogue.toml");
    let campaign = softdock_campaign::load(&file).expect("the shipped campaign is good");
    let runs: Vec<_> = (0..32).map(|run| RunInput { run, params: campaign.draw(run).params }).collect();
    let noisy = runs.iter().any(|input| is_noisy(&input.params));
    let job = Job::new(Plant::new(campaign.scenario.model.clone()), campaign.seed, noisy);
    let rows = CpuEngine::new().run(&job, &runs, &|_| true).expect("nobody stops the batch");
    let count =
        |holds: &dyn Fn(&softdock_kernels::outcome::Finished) -> bool| rows.iter().filter(|row| holds(row)).count();

    assert_eq!(count(&|row| row.flags & flags::INVALID != 0), 0, "invalid runs");
    // Loose bounds on purpose: they catch a broken start, cone or latch, not a change of the campaign.
    assert!(count(&|row| row.space.touch_time >= 0.0) >= 28, "nearly all runs touch");
    assert!((20..32).contains(&count(&|row| row.space.capture_time >= 0.0)), "most runs capture, some do not");
    assert!(count(&|row| row.stop.is_some()) > 0, "long dead times inject energy, and a rule stops the session");
    for row in &rows {
        assert!(row.space.peak_contact_force < 1e3 && row.space.peak_depth < 0.02, "run {}: {:?}", row.run, row.space);
        for side in [row.space, row.hil] {
            // Of some 200 kg m/s; the facility's wrench is exactly opposite on its two bodies, too.
            assert!(
                side.linear_momentum_error < 2e-8,
                "run {}: linear momentum {}",
                row.run,
                side.linear_momentum_error
            );
            assert!(
                side.angular_momentum_error < 2e-8,
                "run {}: angular momentum {}",
                row.run,
                side.angular_momentum_error
            );
        }
    }
}
