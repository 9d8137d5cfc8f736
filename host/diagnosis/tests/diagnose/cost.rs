//! What a judgement costs by the size of its library; run on demand.

use super::bench::Bench;
use softdock_diagnosis::diagnosis::DiagnosisOptions;
use softdock_diagnosis::judge;
use softdock_diagnosis::model::hypothesis::Hypothesis;
use std::time::Instant;

/// Effects of the larger library.
const FIFTY: usize = 50;

/// So many effects: those of a library, and the same in other forms.
fn enlarged(library: &[Hypothesis], count: usize) -> Vec<Hypothesis> {
    let other = |(number, hypothesis): (usize, &Hypothesis)| {
        let factor = 1.0 + 0.2 * (number / library.len()) as f64;
        let forms = hypothesis.forms.iter().map(|form| form.iter().map(|z| factor * z).collect()).collect();
        Hypothesis { forms, ..hypothesis.clone() }
    };
    library.iter().cycle().take(count).enumerate().map(other).collect()
}

/// Three motions of 6 s, three times each, and as many of one that is held out.
#[test]
#[ignore = "a benchmark: prints seconds"]
fn a_judgement_takes_seconds_in_proportion_to_its_library() {
    let bench = Bench::drive(&[("J3_stribeck", 8.0)], 2);
    let prepared = bench.prepared(&DiagnosisOptions::default()).expect("good recordings");
    let place = prepared.blocks(1).iter().position(|(block, _)| block.name == "R3 torque to motion").expect("a drive");
    let [(block, library), (finer, _)] = [1, 2].map(|finer| prepared.blocks(finer).swap_remove(place));
    for library in [library.clone(), enlarged(&library, FIFTY)] {
        let begin = Instant::now();
        let judgement = judge(&block, &finer, &library).expect("repeats");
        let best = &library[judgement.ranking[0].hypotheses[0]];
        println!("{} effects: {:.2} s, {}", library.len(), begin.elapsed().as_secs_f64(), best.effect.id);
        assert_eq!(best.effect.id, "J3_stribeck");
    }
}
