//! Excitation design: a periodic motion within all limits with a minimal condition number of the base-parameter
//! regressor.
//!
//! Limits are kept by construction (angle, speed, acceleration) or by a penalty (torque, workspace); the condition
//! number of the base-parameter regressor is lowered by random starts and an evolution strategy with one parent.

use crate::base::Base;
use crate::layout::{INERTIAL, Layout};
use crate::regressor::rigid_regressor;
use crate::series::Series;
use crate::{DiagnosisError, Result};
use nalgebra::DMatrix;
use softdock_analysis::number::significant;
use softdock_campaign::Robot;
use softdock_kernels::manipulator::{flange, inverse_dynamics, link_frames};
use softdock_kernels::vector::Vec3;
use softdock_kernels::{philox, with_joints};

/// Options of the design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignOptions {
    /// Period of the motion \[s\].
    pub period: f64,
    /// Harmonics of the series.
    pub harmonics: usize,
    /// Number of random motions, the best of which is improved.
    pub starts: u32,
    /// Steps of the improvement.
    pub steps: u32,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Default for DesignOptions {
    fn default() -> Self {
        Self { period: 20.0, harmonics: 6, starts: 100, steps: 2000, seed: 1 }
    }
}

/// Share of every limit that a motion may use.
const SHARE: f64 = 0.9;

/// Instants at which a motion is checked while it is designed.
const INSTANTS: usize = 80;

/// Instants at which the finished motion is checked.
const FINE_INSTANTS: usize = 2000;

/// Wrist and flange stay above the floor by this share of the reach, and as far from axis 1 while they are low.
const CLEARANCE: f64 = 0.15;

/// Below this share of the reach the column stands in the way.
const COLUMN_HEIGHT: f64 = 0.4;

/// Designed motion.
#[derive(Clone, Debug)]
pub struct Excitation {
    /// Motion of each joint.
    pub joints: Vec<Series>,
    /// Period \[s\].
    pub period: f64,
    /// Condition number of the base-parameter regressor, columns of equal norm, rows in units of the torque limits.
    pub condition: f64,
    /// Median of the same over the random starts within all limits.
    pub random_condition: f64,
    /// Greatest use of each limit.
    pub uses: Uses,
}

impl Excitation {
    /// Returns condition numbers and use of the limits for a terminal.
    pub fn text(&self) -> String {
        let [own, random] = [self.condition, self.random_condition].map(|condition| significant(condition, 3));
        format!(
            "condition number {own}, {random} for a random motion inside the limits\n\
             greatest use of a limit {:.0} %",
            100.0 * self.uses.greatest()
        )
    }
}

/// Greatest share of each limit over all joints and instants; 1 = the limit itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uses {
    /// Angle: distance from the middle of the range.
    pub angle: f64,
    /// Speed.
    pub speed: f64,
    /// Acceleration.
    pub acceleration: f64,
    /// Torque.
    pub torque: f64,
    /// Reach, floor and column.
    pub workspace: f64,
}

impl Uses {
    /// Returns the greatest of all.
    pub fn greatest(&self) -> f64 {
        [self.angle, self.speed, self.acceleration, self.torque, self.workspace].into_iter().fold(0.0, f64::max)
    }

    fn join(&mut self, other: &Self) {
        self.angle = self.angle.max(other.angle);
        self.speed = self.speed.max(other.speed);
        self.acceleration = self.acceleration.max(other.acceleration);
        self.torque = self.torque.max(other.torque);
        self.workspace = self.workspace.max(other.workspace);
    }
}

/// Designs a motion.
///
/// # Errors
/// If none of the starts keeps all limits.
pub fn design(robot: &Robot, options: &DesignOptions) -> Result<Excitation> {
    if options.harmonics < 2 {
        return Err(DiagnosisError::unfit("one harmonic cannot start at rest", "set --harmonics to 2 or more"));
    }
    let base = Base::of(robot);
    let length = robot.joints.len() * (2 * options.harmonics - 1);
    let mut draws = Draws { seed: options.seed, next: 0 };
    let judge = |genes: &[f64]| {
        let joints = decode(robot, options, genes);
        let (uses, condition) = judged(robot, &base, &joints, options.period, INSTANTS);
        // A broken limit costs more than any condition number can win.
        (condition.log10() + 100.0 * (uses.greatest() - SHARE).max(0.0), condition)
    };
    let (mut best, mut cost, mut kept) = (Vec::new(), f64::INFINITY, Vec::new());
    for _ in 0..options.starts {
        let genes: Vec<f64> = (0..length).map(|_| draws.normal()).collect();
        let (found, condition) = judge(&genes);
        if (found - condition.log10()).abs() < 1e-12 {
            kept.push(condition);
        }
        if found < cost {
            (best, cost) = (genes, found);
        }
    }
    // One parent, one child; the step grows with success and shrinks without (one-fifth rule).
    let mut size = 0.3;
    for _ in 0..options.steps {
        let child: Vec<f64> = best.iter().map(|gene| gene + size * draws.normal()).collect();
        let (found, _) = judge(&child);
        let better = found < cost;
        if better {
            (best, cost) = (child, found);
        }
        size = f64::clamp(size * if better { 1.5 } else { 0.9 }, 1e-3, 1.0);
    }
    let joints = decode(robot, options, &best);
    let (uses, condition) = judged(robot, &base, &joints, options.period, FINE_INSTANTS);
    if uses.greatest() > 1.0 {
        let what = "no motion within all limits was found";
        return Err(DiagnosisError::unfit(what, "increase the starts or the period, or use fewer harmonics"));
    }
    kept.sort_by(f64::total_cmp);
    let random_condition = kept.get(kept.len() / 2).copied().unwrap_or(f64::NAN);
    Ok(Excitation { joints, period: options.period, condition, random_condition, uses })
}

/// Standard normal numbers from the counter-based generator.
struct Draws {
    seed: u64,
    next: u64,
}

impl Draws {
    fn normal(&mut self) -> f64 {
        let uniform = |index| philox::uniform(self.seed, "excitation", self.next, index);
        let (u, v) = (uniform(0), uniform(1));
        self.next += 1;
        (-2.0 * u.ln()).sqrt() * (2.0 * std::f64::consts::PI * v).cos()
    }
}

/// A motion that keeps angles, speeds and accelerations: amplitudes are scaled, means are moved.
fn decode(robot: &Robot, options: &DesignOptions, genes: &[f64]) -> Vec<Series> {
    let per_joint = 2 * options.harmonics - 1;
    let joint = |(index, genes): (usize, &[f64])| {
        let limits = &robot.model.joints[index].limits;
        // Turning further than half a turn shows nothing new.
        let (lower, upper) = (limits.lower.max(-std::f64::consts::PI), limits.upper.min(std::f64::consts::PI));
        let free: Vec<(f64, f64)> = genes[1..].chunks(2).map(|pair| (pair[0], pair[1])).collect();
        let plain = Series::at_rest(options.period, 0.0, &free);
        let (mut ends, mut rate, mut acceleration) = ((f64::INFINITY, f64::NEG_INFINITY), 0.0, 0.0);
        for k in 0..4 * INSTANTS {
            let [q, v, a] = plain.at(options.period * k as f64 / (4 * INSTANTS) as f64);
            ends = (f64::min(ends.0, q), f64::max(ends.1, q));
            rate = f64::max(rate, v.abs());
            acceleration = f64::max(acceleration, a.abs());
        }
        let span = SHARE * (upper - lower);
        let factors =
            [span / (ends.1 - ends.0), SHARE * limits.speed / rate, SHARE * limits.acceleration / acceleration];
        let factor = factors.into_iter().fold(f64::INFINITY, f64::min);
        // The gene of the mean selects a value in the remaining range.
        let margin = 0.5 * (upper - lower - span);
        let (least, greatest) = (lower + margin - factor * ends.0, upper - margin - factor * ends.1);
        let place = 0.5 + 0.5 * genes[0].tanh();
        Series { mean: least + place * (greatest - least).max(0.0), ..plain.scaled(factor) }
    };
    genes.chunks(per_joint).enumerate().map(joint).collect()
}

/// Use of the limits and condition number of a motion.
fn judged(robot: &Robot, base: &Base, joints: &[Series], period: f64, instants: usize) -> (Uses, f64) {
    let layout = Layout::of(robot);
    // The Stribeck column differs from Coulomb's only near standstill: no motion of this kind shows it well.
    let shown: Vec<usize> = base
        .independent
        .iter()
        .copied()
        .filter(|place| (0..layout.joints).all(|j| layout.stribeck(j) != *place))
        .collect();
    let mut w = DMatrix::zeros(layout.joints * instants, shown.len());
    let mut uses = Uses::default();
    for k in 0..instants {
        let states: Vec<[f64; 3]> = joints.iter().map(|joint| joint.at(period * k as f64 / instants as f64)).collect();
        let of = |order: usize| states.iter().map(|state| state[order]).collect::<Vec<f64>>();
        let (angle, rate, acceleration) = (of(0), of(1), of(2));
        uses.join(&with_joints!(layout.joints, uses_at(robot, &states)));
        let rows = rigid_regressor(&robot.model, &angle, &rate, &acceleration);
        for (j, row) in rows.iter().enumerate() {
            let weight = 1.0 / robot.model.joints[j].drive.torque_limit;
            for (column, place) in shown.iter().enumerate() {
                let value = match place {
                    place if *place >= 13 * layout.joints => extra(&layout, *place, j, angle[j]),
                    place if place % 13 < INERTIAL => row[INERTIAL * (place / 13) + place % 13],
                    place if place / 13 == j => [acceleration[j], rate[j].signum(), rate[j]][place % 13 - INERTIAL],
                    _ => 0.0,
                };
                w[(layout.joints * k + j, column)] = weight * value;
            }
        }
    }
    (uses, condition(w))
}

/// Column of an offset or of a counterbalance.
fn extra(layout: &Layout, place: usize, joint: usize, angle: f64) -> f64 {
    if place == layout.offset(joint) {
        return 1.0;
    }
    match layout.counterweight(joint) {
        Some(own) if place == own => angle.sin(),
        Some(own) if place == own + 1 => angle.cos(),
        _ => 0.0,
    }
}

/// Condition number with columns of equal norm; infinite if a column is empty.
fn condition(mut w: DMatrix<f64>) -> f64 {
    for mut column in w.column_iter_mut() {
        let norm = column.norm();
        if norm < 1e-12 {
            return f64::INFINITY;
        }
        column /= norm;
    }
    let eigenvalues = w.tr_mul(&w).symmetric_eigenvalues();
    (eigenvalues.max() / eigenvalues.min().max(f64::MIN_POSITIVE)).sqrt()
}

/// Use of the limits at one instant.
fn uses_at<const N: usize>(robot: &Robot, states: &[[f64; 3]]) -> Uses {
    let of = |order: usize| -> [f64; N] { std::array::from_fn(|joint| states[joint][order]) };
    let (angle, rate, acceleration) = (of(0), of(1), of(2));
    let torque = inverse_dynamics(&robot.model, angle, rate, acceleration, rate.map(f64::signum));
    let mut uses = Uses { workspace: workspace_use(robot, angle), ..Uses::default() };
    for (i, joint) in robot.model.joints.iter().enumerate() {
        let limits = &joint.limits;
        let middle = 0.5 * (limits.lower + limits.upper);
        uses.join(&Uses {
            angle: (angle[i] - middle).abs() / (limits.upper - middle),
            speed: rate[i].abs() / limits.speed,
            acceleration: acceleration[i].abs() / limits.acceleration,
            torque: torque[i].abs() / joint.drive.torque_limit,
            workspace: 0.0,
        });
    }
    uses
}

/// Greatest of: distance by reach; and 1 plus what is missing from floor and column.
fn workspace_use<const N: usize>(robot: &Robot, angle: [f64; N]) -> f64 {
    let reach = robot.model.workspace.reach;
    let flange = flange(&robot.model, angle).position;
    // The wrist: the frame before the last.
    let wrist = link_frames(&robot.model, angle).get(N.saturating_sub(2)).map_or(flange, |frame| frame.position);
    let radius = |at: Vec3<f64>| at.x.hypot(at.y);
    let mut uses = radius(flange) / reach;
    for at in [flange, wrist] {
        let clear = CLEARANCE * reach;
        uses = uses.max(SHARE + (clear - at.z) / reach);
        if at.z < COLUMN_HEIGHT * reach {
            uses = uses.max(SHARE + (2.0 * clear - radius(at)) / reach);
        }
    }
    uses
}
