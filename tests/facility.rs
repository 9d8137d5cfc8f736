//! A whole facility with a secret: its drives are diagnosed, the model is extended, and the campaign's verdicts follow.

use softdock_campaign::load;
use softdock_engine::section::Section;
use softdock_kernels::block::Recorded;
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::frame::facility::{Readings, readings};
use softdock_kernels::frame::single::emulated_facility;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::Parts;
use std::path::Path;
use std::sync::Arc;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Part A goes from rest into part B and out again, aside as it goes.
fn told(start: &Parts<f64>, tick: usize) -> Parts<f64> {
    let time = tick as f64 * 1e-3;
    let (mut told, omega) = (*start, 3.0);
    let way = 0.06 * (1.0 - (omega * time).cos());
    told.a.position.x += way;
    told.a.position.y += 0.2 * way;
    told.a.velocity.x = 0.06 * omega * (omega * time).sin();
    told.a.velocity.y = 0.2 * told.a.velocity.x;
    told
}

#[test]
fn a_facility_alone_gives_the_bits_of_the_emulated_one() {
    let campaign = load(&root().join("campaigns/probe_drogue.toml")).expect("it loads");
    let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
    let quiet = |run: u64| {
        let mut params = campaign.draw(run).params;
        (params.delay_jitter, params.sensor_noise_force, params.sensor_noise_moment) = (0.0, 0.0, 0.0);
        params
    };
    let sets: Vec<_> = (0..9).map(quiet).collect();
    let rows: Vec<Parts<f64>> = (0..1500).map(|tick: usize| told(&plant.start(), tick.saturating_sub(1))).collect();
    let recorded = Recorded {
        step: 1e-3,
        instants: rows.len(),
        stride: 1,
        inputs: rows.iter().flat_map(to_vec::<f64, _>).collect(),
        late: Vec::new(),
        offsets: Vec::new(),
    };
    let all: Vec<Vec<f64>> = sets.iter().map(to_vec).collect();
    let alone = Section::Facility(Arc::clone(&plant)).simulate(&[&recorded], &all).remove(0);
    let width = fields::<f64, Readings<f64>>().len();
    let mut touched = false;
    for (run, (params, alone)) in sets.iter().zip(&alone).enumerate() {
        let mut facility = emulated_facility(&plant, [0; 2], run as u64, params);
        facility.stand(&rows[0]);
        for (row, told) in rows.iter().enumerate().skip(1) {
            let measured = facility.tick(told);
            let emulated = to_vec(&readings(&plant.start(), &measured.parts, measured.wrench));
            touched |= measured.wrench.force.norm() > 20.0;
            assert_eq!(alone[row * width..][..width], emulated[..], "run {run}, tick {row}");
        }
    }
    assert!(touched, "the parts touch");
}
