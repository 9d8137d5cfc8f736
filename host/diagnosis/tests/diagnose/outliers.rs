//! Recordings with damaged cells: the answer is that of the whole ones, or an honest refusal.

use crate::gaps::{diagnosed, friction_log};
use softdock_diagnosis::diagnosis::DiagnosisOptions;
use softdock_diagnosis::verdict::answer::DiagnosisVerdict;
use softdock_kernels::philox;
use softdock_test_size::sized;

/// Rows of each recording.
const ROWS: u32 = 1500;
/// Coulomb friction of the joint \[N m\].
const COULOMB: f64 = 12.0;

/// What a logger, a bus or a hand leaves in a cell.
fn damage(value: f64, kind: u64, u: f64) -> String {
    match kind {
        0 => "0".to_owned(),
        1 => format!("{:e}", value * 10f64.powf(1.0 + 5.0 * u)),
        2 => format!("{:e}", -value),
        3 => "-999".to_owned(),
        4 => "1e30".to_owned(),
        5 => format!("{}", value + (u - 0.5) * 20.0),
        6 => "nan".to_owned(),
        _ => String::new(),
    }
}

/// The text with damaged cells of position and torque.
fn damaged(text: &str, case: u64, cells: u64) -> String {
    let mut rows: Vec<Vec<String>> =
        text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>()).collect();
    for number in 0..cells {
        let draw = |what: &str| philox::uniform(case, what, number, 0);
        let row = 1 + (draw("row") * f64::from(ROWS)) as usize;
        let column = 1 + (draw("column") * 2.0) as usize;
        let cell = &mut rows[row][column];
        if let Ok(value) = cell.parse::<f64>()
            && value.abs() < 1e3
        {
            *cell = damage(value, (draw("kind") * 8.0) as u64, draw("size"));
        }
    }
    rows.iter().map(|row| row.join(",") + "\n").collect()
}

#[test]
fn up_to_twenty_damaged_cells_change_no_answer_or_are_refused() {
    let options = DiagnosisOptions::default();
    let mut refused = 0;
    let cases = sized(4, 100);
    for case in 0..cases {
        let cells = 1 + (philox::uniform(case, "cells", 0, 0) * 20.0) as u64;
        let logs = [1, 2].map(|motion| damaged(&friction_log(motion, ROWS), 2 * case + motion, cells));
        let diagnosis = match diagnosed(&logs, &options) {
            Ok(diagnosis) => diagnosis,
            Err(error) => {
                assert!(!error.to_string().is_empty(), "case {case}");
                refused += 1;
                continue;
            }
        };
        let names: Vec<&str> = diagnosis.effects.iter().map(|effect| effect.id).collect();
        let is_named = diagnosis.answer == DiagnosisVerdict::Named;
        if !is_named {
            let denied = [DiagnosisVerdict::NoEffect, DiagnosisVerdict::NoPracticalEffect];
            assert!(
                !denied.contains(&diagnosis.answer),
                "case {case}, {cells} cells: {:?} {names:?}",
                diagnosis.answer
            );
            refused += 1;
            continue;
        }
        assert!(
            names.iter().all(|id| ["J1_coulomb", "J2_viscous"].contains(id)),
            "case {case}, {cells} cells: {names:?}"
        );
        let coulomb = diagnosis.effects.iter().find(|effect| effect.id == "J1_coulomb");
        let coulomb = coulomb.and_then(|effect| effect.parameters.values().next());
        let coulomb = coulomb.unwrap_or_else(|| panic!("case {case}, {cells} cells: {names:?}"));
        assert!((coulomb.value - COULOMB).abs() < 0.1 * COULOMB, "case {case}, {cells} cells: {coulomb:?}");
    }
    // Refusing everything would be honest, and of no use.
    assert!(10 * refused <= cases.max(10), "{refused} of {cases} refused");
}
