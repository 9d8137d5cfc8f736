//! Impedance control of robot 1: an outer loop that turns the measured wrench into a motion (an admittance).
//!
//! M X'' + B X' + K X = E with the measured wrench E on part A, laboratory axes about A's origin; X is added to the
//! commanded pose, and the robot's own loops follow the sum (position-based impedance).

use crate::bundle;
use crate::model::ImpedanceLaw;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Motion, Parts, Wrench};
use crate::vector::{Quat, Vec3, vec3};

bundle! {
    /// How far robot 1 has given way; written by the impedance stage.
    Admittance {
        shift: Vec3<R>, "m", "displacement of the command, laboratory";
        turn: Vec3<R>, "rad", "rotation vector of the command, laboratory";
        velocity: Vec3<R>, "m/s", "rate of the displacement";
        omega: Vec3<R>, "rad/s", "rate of the rotation";
    }
}

/// Nothing has given way.
#[inline(always)]
pub fn no_admittance<R: Real>() -> Admittance<R> {
    crate::fields::filled(R::lit(0.0))
}

/// One substep under the measured wrench (part A's axes); semi-implicit, so that the newest wrench acts at once.
#[inline(always)]
pub fn step_admittance<R: Real>(m: &Plant, s: &Admittance<R>, a: Motion<R>, measured: Wrench<R>) -> Admittance<R> {
    let Some(law) = &m.facility.impedance else {
        return *s;
    };
    let force = a.attitude.rotate(measured.force);
    let moment = a.attitude.rotate(measured.moment);
    let (place, rate) = (stack(s.shift, s.turn), stack(s.velocity, s.omega));
    let (brake, pull) = (times(&law.damping, &rate), times(&law.stiffness, &place));
    let mut rest = stack(force, moment);
    for i in 0..6 {
        rest[i] = rest[i] - brake[i] - pull[i];
    }
    let (velocity, omega) = split(times(&law.inverse_mass, &rest));
    let dt = R::lit(m.timing.substep);
    let (velocity, omega) = (velocity.scale_add(dt, s.velocity), omega.scale_add(dt, s.omega));
    Admittance { shift: velocity.scale_add(dt, s.shift), turn: omega.scale_add(dt, s.turn), velocity, omega }
}

/// A command with what has given way added to part A's.
#[inline(always)]
pub fn displaced<R: Real>(m: &Plant, reference: &Parts<R>, s: &Admittance<R>) -> Parts<R> {
    if m.facility.impedance.is_none() {
        return *reference;
    }
    let a = Motion {
        position: reference.a.position + s.shift,
        attitude: Quat::from_rotation_vector(s.turn).compose(reference.a.attitude),
        velocity: reference.a.velocity + s.velocity,
        omega: reference.a.omega + s.omega,
    };
    Parts { a, ..*reference }
}

#[inline(always)]
fn stack<R: Real>(a: Vec3<R>, b: Vec3<R>) -> [R; 6] {
    [a.x, a.y, a.z, b.x, b.y, b.z]
}

#[inline(always)]
fn split<R: Real>(v: [R; 6]) -> (Vec3<R>, Vec3<R>) {
    (vec3(v[0], v[1], v[2]), vec3(v[3], v[4], v[5]))
}

#[inline(always)]
fn times<R: Real>(matrix: &[[f64; 6]; 6], v: &[R; 6]) -> [R; 6] {
    let mut out = [R::lit(0.0); 6];
    for i in 0..6 {
        for j in 0..6 {
            // What is not coupled costs nothing.
            if matrix[i][j] != 0.0 {
                out[i] = v[j].mul_add(R::lit(matrix[i][j]), out[i]);
            }
        }
    }
    out
}

impl ImpedanceLaw {
    /// A law from its 6 x 6 matrices (SI; rows and columns x y z, then rotations); none if the mass has no inverse.
    pub fn new(mass: [[f64; 6]; 6], damping: [[f64; 6]; 6], stiffness: [[f64; 6]; 6]) -> Option<Self> {
        Some(Self { inverse_mass: inverse(mass)?, damping, stiffness })
    }
}

/// Gauss-Jordan with pivoting.
fn inverse(mut a: [[f64; 6]; 6]) -> Option<[[f64; 6]; 6]> {
    let mut out: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for column in 0..6 {
        let pivot = (column..6).max_by(|i, j| a[*i][column].abs().total_cmp(&a[*j][column].abs()))?;
        a.swap(column, pivot);
        out.swap(column, pivot);
        let scale = 1.0 / a[column][column];
        if !scale.is_finite() {
            return None;
        }
        (a[column], out[column]) = (a[column].map(|v| v * scale), out[column].map(|v| v * scale));
        for row in (0..6).filter(|row| *row != column) {
            let factor = a[row][column];
            for j in 0..6 {
                a[row][j] -= factor * a[column][j];
                out[row][j] -= factor * out[column][j];
            }
        }
    }
    Some(out)
}
