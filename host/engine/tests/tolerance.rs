//! What of a block's outputs is beyond the tolerance of what was read.

use softdock_engine::blocks::{BlockKind, Reading, Tolerance, beyond, simulate};
use softdock_engine::decimator::Decimator;
use softdock_kernels::block::Recorded;

#[test]
fn what_is_beyond_a_tolerance_is_that_of_the_whole_outputs_low_passed() {
    let (inputs, outputs) = (BlockKind::Sensor.inputs().len(), BlockKind::Sensor.outputs().len());
    let wave = |i: usize| (0.37 * i as f64).sin() + (0.011 * i as f64).cos();
    let instants = 300;
    let recorded = Recorded {
        step: 1e-3,
        instants,
        stride: 1,
        inputs: (0..instants * inputs).map(wave).collect(),
        late: (0..instants * BlockKind::Sensor.late_inputs().len()).map(wave).collect(),
        offsets: Vec::new(),
    };
    // More sets than lanes.
    let sets: Vec<Vec<f64>> =
        (0..11).map(|set| vec![1.0 + 0.1 * f64::from(set); BlockKind::Sensor.parameters().len()]).collect();
    let reading = Reading { recorded: &recorded, outputs: (0..instants * outputs).map(|i| wave(3 * i)).collect() };
    let tolerance = Tolerance { half: (0..outputs).map(|output| 0.2 * output as f64).collect(), within: 0.1 };
    let decimator = Decimator::new(4);
    let simulated = simulate(BlockKind::Sensor, &[&recorded], &sets).remove(0);
    let found = beyond(BlockKind::Sensor, std::slice::from_ref(&reading), &sets, &decimator, &tolerance).remove(0);
    assert_eq!(found.len(), sets.len());
    for (own, simulated) in found.iter().zip(simulated) {
        let residuals = reading.outputs.iter().zip(simulated).enumerate();
        let left = residuals.map(|(i, (read, own))| tolerance.beyond(i % outputs, read - own)).collect();
        assert_eq!(*own, decimator.pass::<f64>(left, outputs));
        assert!(own.iter().all(|value| value.is_finite()) && own.iter().any(|value| *value != 0.0));
    }
}
