//! Recordings with gaps: their segments retain the evidence.

use crate::bench::{Bench, Kind};
use crate::dialects::MODEL;
use softdock_campaign::Rig;
use softdock_diagnosis::DiagnosisError;
use softdock_diagnosis::diagnosis::{Diagnosis, DiagnosisOptions, prepare};
use softdock_diagnosis::verdict::answer::DiagnosisVerdict;
use softdock_kernels::philox;
use softdock_test_size::first;
use std::path::{Path, PathBuf};

/// Gaps of each recording, and their rows.
const GAPS: usize = 10;
const MISSING: usize = 6;

/// The text with ten gaps of six rows.
fn with_gaps(text: &str) -> String {
    let every = (text.lines().count() - 1) / (GAPS + 1);
    let last = GAPS * every + MISSING;
    let is_kept = |(row, _): &(usize, &str)| *row < every || *row > last || (row - 1) % every >= MISSING;
    text.lines().enumerate().filter(is_kept).map(|(_, line)| format!("{line}\n")).collect()
}

/// Value and interval of the first parameter of an effect that is named alone or with others.
fn size(diagnosis: &Diagnosis, id: &str) -> [f64; 3] {
    assert_eq!(diagnosis.answer, DiagnosisVerdict::Named, "{:?} {:?}", diagnosis.effects, diagnosis.findings);
    let effect = diagnosis.effects.iter().find(|effect| effect.id == id);
    let effect = effect.unwrap_or_else(|| panic!("{id} is not among {:?}", diagnosis.effects));
    let estimate = effect.parameters.values().next().expect("a parameter");
    [estimate.value, estimate.lo, estimate.hi]
}

/// Asserts that an answer from recordings with gaps is that of the whole ones.
fn assert_alike(id: &str, whole: &Diagnosis, cut: &Diagnosis) {
    assert!(cut.findings.iter().any(|finding| finding.what.contains("gaps into")), "{:?}", cut.findings);
    let (whole, [value, lo, hi]) = (size(whole, id), size(cut, id));
    assert!(whole[1] <= value && value <= whole[2], "{id}: {value} beside {whole:?}");
    assert!(hi - lo < 1.5 * (whole[2] - whole[1]), "{id}: {lo} to {hi} beside {whole:?}");
}

/// Rows of a joint with 12 N m of Coulomb friction and 20 N m s/rad of viscous friction, 0.01 s apart; `motion` selects
/// the frequencies.
pub(crate) fn friction_log(motion: u64, rows: u32) -> String {
    let row = |i: u32| {
        let t = f64::from(i) * 0.01;
        let (mut q, mut v, mut a) = (0.0, 0.0, 0.0);
        for k in 0..4 {
            let omega = 0.7 + 0.9 * f64::from(k) + 0.31 * motion as f64;
            let (sin, cos) = (omega * t + f64::from(k)).sin_cos();
            let size = 0.4 / omega;
            (q, v, a) = (q + size * sin, v + size * omega * cos, a - size * omega * omega * sin);
        }
        let noise = |of: &str| philox::uniform(motion, of, u64::from(i), 0) - 0.5;
        let tau = 5.4 * a + 20.0 * v + 12.0 * (v / 1e-3).tanh() + 1.5 * noise("tau");
        format!("{t:.7},{:.9},{tau:.7}\n", q + 2e-5 * noise("q"))
    };
    "t,q1,i1\n".to_owned() + &(0..rows).map(row).collect::<String>()
}

fn friction(change: impl Fn(&str) -> String) -> Diagnosis {
    let logs = [1, 2].map(|motion| change(&friction_log(motion, 4000)));
    diagnosed(&logs, &DiagnosisOptions::default()).expect("an answer")
}

/// The diagnosis of a joint by one recording to learn from and one to judge by.
pub(crate) fn diagnosed(logs: &[String; 2], options: &DiagnosisOptions) -> Result<Diagnosis, DiagnosisError> {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| -> PathBuf {
        let file = folder.path().join(name);
        std::fs::write(&file, text).expect("writable");
        file
    };
    let rig = Rig::load(&write("rig.toml", MODEL)).expect("a legal model");
    let (learn, test) = (write("m1.csv", &logs[0]), write("m2.csv", &logs[1]));
    let (learn, test): ([&Path; 1], [&Path; 1]) = ([&learn], [&test]);
    Ok(prepare(rig, &learn, &test, options)?.diagnose()?.0)
}

#[test]
fn ten_gaps_do_not_change_the_friction_of_a_drive() {
    assert_alike("J1_coulomb", &friction(str::to_owned), &friction(with_gaps));
}

#[test]
fn ten_gaps_do_not_change_the_answer_of_other_benches() {
    let cases = [(Kind::Contact, "K1_stiffness", 4e4), (Kind::Sensor, "S1_bias", 8.0)];
    for (kind, id, hidden) in first(1, cases) {
        let of = || Bench::long(kind, &[(id, hidden)], 3);
        assert_alike(id, &of().diagnose(), &of().with_recordings(with_gaps).diagnose());
    }
}
