//! Overdetermined equations of all samples, joint by joint: measured torque = regressor row * parameters.

use crate::layout::Layout;
use crate::motion::RecordedMotion;
use crate::regressor::rigid_regressor;
use nalgebra::{DMatrix, DVector};
use softdock_campaign::Robot;

/// Friction parameters of a joint that are not linear in the torque.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionShape {
    /// Presliding travel \[rad\].
    pub travel: f64,
    /// Stribeck speed \[rad/s\].
    pub speed: f64,
}

/// Returns the friction shapes of a robot's joints.
pub fn shapes(robot: &Robot) -> Vec<FrictionShape> {
    let shape = |joint: &softdock_kernels::manipulator::Joint| FrictionShape {
        travel: joint.friction.presliding_travel().max(1e-9),
        speed: joint.friction.stribeck_speed,
    };
    robot.model.joints.iter().map(shape).collect()
}

/// Equations of one joint: `y = x theta`.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Regressor, passed through the torques' filter; samples x parameters.
    pub x: DMatrix<f64>,
    /// Measured torque \[N m\].
    pub y: DVector<f64>,
}

/// Equations of all joints; the rows of all motions stand one after the other.
#[derive(Clone, Debug)]
pub struct System {
    /// Layout of the columns.
    pub layout: Layout,
    /// Equations per joint.
    pub joints: Vec<Rows>,
    /// Number of rows of each motion.
    pub lengths: Vec<usize>,
}

impl System {
    /// Builds the equations of motions for these friction shapes.
    pub fn new(robot: &Robot, motions: &[RecordedMotion], shapes: &[FrictionShape]) -> Self {
        let layout = Layout::of(robot);
        let lengths: Vec<usize> = motions.iter().map(RecordedMotion::rows).collect();
        let rows = lengths.iter().sum();
        let empty = Rows { x: DMatrix::zeros(rows, layout.len()), y: DVector::zeros(rows) };
        let mut system = Self { joints: vec![empty; layout.joints], layout, lengths };
        let mut start = 0;
        for motion in motions {
            system.rigid(robot, motion, start);
            start += motion.rows();
        }
        for (joint, shape) in shapes.iter().enumerate() {
            system.set_shape(motions, joint, *shape);
        }
        system
    }

    /// Columns that do not depend on a friction's shape, and the torques.
    fn rigid(&mut self, robot: &Robot, motion: &RecordedMotion, start: usize) {
        let n = self.layout.joints;
        let mut raw = vec![vec![vec![0.0; motion.rows()]; 10 * n]; n];
        for k in 0..motion.rows() {
            let at = |columns: &[Vec<f64>]| columns.iter().map(|column| column[k]).collect::<Vec<f64>>();
            let rows = rigid_regressor(&robot.model, &at(&motion.angle), &at(&motion.rate), &at(&motion.acceleration));
            for (columns, row) in raw.iter_mut().zip(&rows) {
                columns.iter_mut().zip(row).for_each(|(column, value)| column[k] = *value);
            }
        }
        for (j, columns) in raw.iter().enumerate() {
            for (index, column) in columns.iter().enumerate().skip(10 * j) {
                let place = self.layout.inertial(index / 10) + index % 10;
                self.fill(j, place, start, &motion.smooth(column));
            }
            self.fill(j, self.layout.rotor(j), start, &motion.smooth(&motion.acceleration[j]));
            self.fill(j, self.layout.viscous(j), start, &motion.smooth(&motion.rate[j]));
            self.fill(j, self.layout.offset(j), start, &vec![1.0; motion.rows()]);
            if let Some(place) = self.layout.counterweight(j) {
                let wave = |f: fn(f64) -> f64| motion.angle[j].iter().map(|q| f(*q)).collect::<Vec<f64>>();
                self.fill(j, place, start, &motion.smooth(&wave(f64::sin)));
                self.fill(j, place + 1, start, &motion.smooth(&wave(f64::cos)));
            }
            self.joints[j].y.rows_mut(start, motion.rows()).copy_from_slice(&motion.torque[j]);
        }
    }

    /// Recomputes the columns of dry friction for another shape.
    pub fn set_shape(&mut self, motions: &[RecordedMotion], joint: usize, shape: FrictionShape) {
        let mut start = 0;
        for motion in motions {
            let slip = motion.slip(joint, shape.travel);
            let weakened = slip.iter().zip(&motion.rate[joint]).map(|(z, v)| z * (-v.abs() / shape.speed).exp());
            let weakened: Vec<f64> = weakened.collect();
            self.fill(joint, self.layout.coulomb(joint), start, &motion.smooth(&slip));
            self.fill(joint, self.layout.stribeck(joint), start, &motion.smooth(&weakened));
            start += motion.rows();
        }
    }

    fn fill(&mut self, joint: usize, column: usize, start: usize, values: &[f64]) {
        self.joints[joint].x.column_mut(column).rows_mut(start, values.len()).copy_from_slice(values);
    }

    /// Returns the residuals of a joint \[N m\].
    pub fn residual(&self, joint: usize, theta: &DVector<f64>) -> DVector<f64> {
        &self.joints[joint].y - &self.joints[joint].x * theta
    }
}

/// Returns the root mean square.
pub fn rms<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt()
}
