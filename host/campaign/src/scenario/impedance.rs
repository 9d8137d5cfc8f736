//! The impedance of robot 1: axis by axis, or as coupled matrices.

use crate::check::Checker;
use crate::written::At;
use crate::written::facility::ImpedanceTable;
use nalgebra::Matrix6;
use softdock_kernels::model::ImpedanceLaw;
use softdock_kernels::range::{DAMPING, INERTIA, MASS, Range, STIFFNESS};

type Matrix = [[f64; 6]; 6];

pub(crate) fn read(c: &mut Checker, table: &At<ImpedanceTable>) -> Option<ImpedanceLaw> {
    let t = &table.value;
    let axes = |c: &mut Checker, written: &_, unit, range| c.list(written, 3, unit, range);
    let rows = [
        (
            axes(c, &t.mass, "kg", Range::above(0.0, MASS)),
            axes(c, &t.inertia, "kg m^2", Range::above(0.0, INERTIA)),
            &t.mass_coupling,
        ),
        (
            axes(c, &t.damping, "N s/m", Range::within(0.0, DAMPING)),
            axes(c, &t.rotation_damping, "N m s/rad", Range::within(0.0, DAMPING)),
            &t.damping_coupling,
        ),
        (
            axes(c, &t.stiffness, "N/m", Range::within(0.0, STIFFNESS)),
            axes(c, &t.rotation_stiffness, "N m/rad", Range::within(0.0, STIFFNESS)),
            &t.stiffness_coupling,
        ),
    ];
    let noted = c.problems.len();
    let [mass, damping, stiffness] = rows.map(|(shift, turn, coupling)| matrix(c, &shift, &turn, coupling.as_ref()));
    if c.problems.len() > noted {
        return None;
    }
    for (name, matrix, definite) in [("mass", mass, true), ("damping", damping, false), ("stiffness", stiffness, false)]
    {
        let least = Matrix6::from_fn(|i, j| matrix[i][j]).symmetric_eigenvalues().min();
        if least < 0.0 || definite && least <= 0.0 {
            let remedy = format!("make {name}_coupling smaller: the matrix must not generate energy in any direction");
            c.refuse(&table.span, format!("the {name} of the impedance has the eigenvalue {least:.4e}"), remedy);
            return None;
        }
    }
    ImpedanceLaw::new(mass, damping, stiffness)
}

/// Diagonal and coupling together.
fn matrix(c: &mut Checker, shift: &[f64], turn: &[f64], coupling: Option<&At<Vec<Vec<f64>>>>) -> Matrix {
    let diagonal: Vec<f64> = shift.iter().chain(turn).copied().collect();
    let mut out: Matrix = std::array::from_fn(|i| {
        std::array::from_fn(|j| if i == j { diagonal.get(i).copied().unwrap_or(0.0) } else { 0.0 })
    });
    if let Some(written) = coupling {
        let rows = &written.value;
        let square = rows.len() == 6 && rows.iter().all(|row| row.len() == 6);
        let symmetric = || (0..6).all(|i| (0..6).all(|j| rows[i][j].is_finite() && rows[i][j] == rows[j][i]));
        if !square || !symmetric() || (0..6).any(|i| rows[i][i] != 0.0) {
            let remedy = "write six rows of six numbers in SI units, symmetric, with zeros on the diagonal";
            c.refuse(&written.span, "this is not a coupling", remedy);
            return out;
        }
        for i in 0..6 {
            for j in 0..6 {
                out[i][j] += rows[i][j];
            }
        }
    }
    out
}
