//! Impedance control: the correction against 1 / (M s^2 + B s + K), axis by axis and coupled, and an ideal robot's motion.

use super::bench::{job, two_bodies};
use nalgebra::{Complex, Matrix6, Vector6};
use softdock_kernels::frame::lane_state::state_fields;
use softdock_kernels::frame::{Batch, Tile};
use softdock_kernels::impedance::{no_admittance, step_admittance};
use softdock_kernels::model::{ImpedanceLaw, Model};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::space::{Motion, Wrench};
use softdock_kernels::vector::{Quat, Vec3, vec3};
use std::f64::consts::TAU;

type Matrix = [[f64; 6]; 6];

/// Diagonals for translation and rotation, and as much of them as couples neighbouring axes.
fn matrix(shift: f64, turn: f64, coupled: f64) -> Matrix {
    let size = |i: usize| if i < 3 { shift } else { turn };
    std::array::from_fn(|i| {
        std::array::from_fn(|j| match i.abs_diff(j) {
            0 => size(i),
            1 => coupled * size(i).min(size(j)),
            _ => 0.0,
        })
    })
}

fn model(coupled: f64) -> (Model, [Matrix; 3]) {
    let mut model = two_bodies(0.25e-3, 8.0, 0.5);
    model.timing.substeps = 4;
    model.timing.max_ticks = 8000;
    let matrices = [matrix(200.0, 30.0, coupled), matrix(3000.0, 400.0, coupled), matrix(2e4, 3e3, coupled)];
    model.facility.impedance = ImpedanceLaw::new(matrices[0], matrices[1], matrices[2]);
    (model, matrices)
}

/// (K + j w B - w^2 M)^-1 E.
fn exact([mass, damping, stiffness]: &[Matrix; 3], w: f64, wrench: Vector6<f64>) -> Vector6<Complex<f64>> {
    let dynamic = Matrix6::from_fn(|i, j| Complex::new(stiffness[i][j] - w * w * mass[i][j], w * damping[i][j]));
    dynamic.lu().solve(&wrench.map(|e| Complex::new(e, 0.0))).expect("a damped law")
}

#[test]
fn the_correction_is_that_of_mass_damper_and_spring() {
    for coupled in [0.0, 0.3] {
        let (model, matrices) = model(coupled);
        let plant = Plant::new(model);
        let at =
            Motion { position: Vec3::zero(), attitude: Quat::identity(), velocity: Vec3::zero(), omega: Vec3::zero() };
        let wrench = Vector6::new(50.0, -20.0, 10.0, 3.0, 5.0, -4.0);
        for frequency in [0.5, 1.0, 2.0, 5.0] {
            let (w, dt) = (TAU * frequency, plant.timing.substep);
            let (mut s, mut sums) = (no_admittance::<f64>(), Vector6::<Complex<f64>>::zeros());
            let (settle, whole) = ((4.0 / dt) as usize, (2.0 / dt) as usize);
            for step in 0..settle + whole {
                let e = wrench * (w * step as f64 * dt).cos();
                let measured = Wrench { force: vec3(e[0], e[1], e[2]), moment: vec3(e[3], e[4], e[5]) };
                s = step_admittance(&plant, &s, at, measured);
                if step >= settle {
                    // The correction belongs to the end of the substep.
                    let phase = Complex::from_polar(2.0 * dt / 2.0, -w * (step + 1) as f64 * dt);
                    let x = Vector6::new(s.shift.x, s.shift.y, s.shift.z, s.turn.x, s.turn.y, s.turn.z);
                    sums += x.map(|x| phase * x);
                }
            }
            let expected = exact(&matrices, w, wrench);
            let error = (sums - expected).norm() / expected.norm();
            println!("coupled {coupled}, {frequency} Hz: {error:.2e}");
            assert!(error < 0.01, "coupled {coupled}, {frequency} Hz: {error}");
        }
    }
}

/// A constant bias of the sensor pushes an ideal robot as a step of force pushes mass, damper and spring.
#[test]
fn ideal_robot_moves_as_its_impedance() {
    let (model, [mass, damping, stiffness]) = model(0.0);
    let force = 40.0;
    let params =
        Params { sensor_bias_force: vec3(force, 0.0, 0.0), base_mass: 1e9, target_mass: 1e9, ..Params::null() };
    let plant = job(model, &[params]).plant;
    let names = state_fields::<0>(&plant);
    let row = names.iter().position(|f| f.name == "robot_robot1_motion_position_x").expect("a row of the state");
    let mut tile = Tile::<f64, 0>::new(&plant, Batch::whole());
    tile.load(&plant, &[(0, 0, params)]);
    let start = tile.lane_state(&plant).state[row];
    let (m, b, k) = (mass[0][0], damping[0][0], stiffness[0][0]);
    let (decay, turn) = (0.5 * b / m, (k / m - (0.5 * b / m).powi(2)).sqrt());
    for tick in 1..=2000 {
        tile.step(&plant);
        if tick % 100 == 0 {
            // The tick under way moved the robots up to its own beginning; the first sample came a substep in.
            let t = f64::from(tick - 1) * plant.timing.tick() + 0.5 * plant.timing.substep;
            let swing = (-decay * t).exp() * ((turn * t).cos() + decay / turn * (turn * t).sin());
            let (moved, expected) = (tile.lane_state(&plant).state[row] - start, force / k * (1.0 - swing));
            assert!((moved - expected).abs() < 0.01 * force / k, "tick {tick}: {moved} for {expected}");
        }
    }
}
