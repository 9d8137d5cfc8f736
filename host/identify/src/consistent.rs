//! Physically consistent solution: a convex problem over the parameters of physically possible robots.
//!
//! `1/2 sum w |y - x theta|^2 / rows + lambda * distance to the a-priori robot`, where the distance of a link is the
//! log-det divergence of its pseudo-inertia: it grows without bound towards masses and inertias that no body has, does
//! not depend on units or axes, and leads unexcited directions to the a-priori values. Lee, Wensing, Park, Geometric
//! robot dynamic identification: a convex programming approach, IEEE T-RO 36 (2020); Wensing, Kim, Slotine (2018).

use crate::layout::{INERTIAL, Layout};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix3, Matrix4};
use softdock_campaign::Robot;
use softdock_kernels::vector::Sym3;

/// Weight of friction beside inertia: published friction values are an order of magnitude less certain.
const FRICTION_WEIGHT: f64 = 0.1;

/// A torque offset that is plausible, as a share of the torque limit.
const OFFSET_SHARE: f64 = 0.01;

/// A counterbalance that is plausible, as a share of the torque limit.
const BALANCE_SHARE: f64 = 0.2;

/// Smallest a-priori friction and rotor inertia, as a share of the torque limit: the distance needs a scale.
const LEAST_SHARE: f64 = 1e-3;

/// Smallest second moment of mass of an a-priori link, as a share of its greatest: a sheet of 3 % of its length.
const LEAST_THICKNESS: f64 = 1e-3;

/// Newton steps; the problem is convex and takes about ten.
const MOST_STEPS: usize = 100;

/// Prior of a robot's parameters.
#[derive(Clone, Debug)]
pub struct RobotPrior {
    /// The a-priori parameters.
    pub theta: DVector<f64>,
    /// Inverse pseudo-inertias of the links.
    links: Vec<Matrix4<f64>>,
    /// First parameter of each link.
    places: Vec<usize>,
    /// Parameters that must be positive: place, a-priori value, weight.
    positive: Vec<(usize, f64, f64)>,
    /// Parameters of either sign: place, a-priori value, scale.
    free: Vec<(usize, f64, f64)>,
}

impl RobotPrior {
    /// Builds the prior from a robot model.
    pub fn of(robot: &Robot) -> Self {
        let layout = Layout::of(robot);
        let mut theta = DVector::from_vec(layout.values(robot));
        let places: Vec<usize> = (0..layout.joints).map(|joint| layout.inertial(joint)).collect();
        for (place, joint) in places.iter().zip(&robot.model.joints) {
            let raise = 2.0 * missing_thickness(joint.link.inertia);
            [0, 3, 5].into_iter().for_each(|moment| theta[place + moment] += raise);
        }
        let inverse = |place: &usize| {
            let pseudo = pseudo_inertia(&theta.as_slice()[*place..*place + INERTIAL]);
            pseudo.try_inverse().expect("a body with thickness in every direction")
        };
        let links = places.iter().map(inverse).collect();
        let (mut positive, mut free) = (Vec::new(), Vec::new());
        for (i, joint) in robot.model.joints.iter().enumerate() {
            let limit = joint.drive.torque_limit;
            let rows = [
                (layout.rotor(i), 1.0),
                (layout.coulomb(i), FRICTION_WEIGHT),
                (layout.viscous(i), FRICTION_WEIGHT),
                (layout.stribeck(i), FRICTION_WEIGHT),
            ];
            for (place, weight) in rows {
                theta[place] = theta[place].max(LEAST_SHARE * limit);
                positive.push((place, theta[place], weight));
            }
            free.push((layout.offset(i), theta[layout.offset(i)], OFFSET_SHARE * limit));
            if let Some(place) = layout.counterweight(i) {
                free.extend([place, place + 1].map(|place| (place, theta[place], BALANCE_SHARE * limit)));
            }
        }
        Self { theta, links, places, positive, free }
    }

    /// Distance of a parameter vector from the a-priori one; infinite outside what can exist.
    fn distance(&self, theta: &DVector<f64>) -> f64 {
        let mut sum = 0.0;
        for (inverse, place) in self.links.iter().zip(&self.places) {
            let ratio = pseudo_inertia(&theta.as_slice()[*place..*place + INERTIAL]);
            let Some(factor) = Cholesky::new(ratio) else { return f64::INFINITY };
            let log_det = 2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
            sum += (inverse * ratio).trace() - log_det;
        }
        for (place, prior, weight) in &self.positive {
            let ratio = theta[*place] / prior;
            if ratio <= 0.0 {
                return f64::INFINITY;
            }
            sum += weight * (ratio - ratio.ln());
        }
        sum + self.free.iter().map(|(place, mean, scale)| 0.5 * ((theta[*place] - mean) / scale).powi(2)).sum::<f64>()
    }

    /// Adds `lambda` times the distance's gradient and Hessian.
    fn add_slopes(&self, theta: &DVector<f64>, lambda: f64, gradient: &mut DVector<f64>, hessian: &mut DMatrix<f64>) {
        let units = pseudo_units();
        for (prior, place) in self.links.iter().zip(&self.places) {
            let pseudo = pseudo_inertia(&theta.as_slice()[*place..*place + INERTIAL]);
            let Some(inverse) = pseudo.try_inverse() else { continue };
            let turned: Vec<Matrix4<f64>> = units.iter().map(|unit| inverse * unit).collect();
            for (a, unit) in units.iter().enumerate() {
                gradient[place + a] += lambda * ((prior * unit).trace() - turned[a].trace());
                for (b, other) in turned.iter().enumerate() {
                    hessian[(place + a, place + b)] += lambda * (turned[a] * other).trace();
                }
            }
        }
        for (place, prior, weight) in &self.positive {
            let value = theta[*place];
            gradient[*place] += lambda * weight * (1.0 / prior - 1.0 / value);
            hessian[(*place, *place)] += lambda * weight / (value * value);
        }
        for (place, mean, scale) in &self.free {
            gradient[*place] += lambda * (theta[*place] - mean) / (scale * scale);
            hessian[(*place, *place)] += lambda / (scale * scale);
        }
    }

    /// Minimises `1/2 theta' H theta - g' theta + lambda * distance`, from a start inside.
    ///
    /// Newton's method with backtracking; the parameters are scaled by the Hessian's diagonal.
    pub fn solve(&self, h: &DMatrix<f64>, g: &DVector<f64>, lambda: f64, start: &DVector<f64>) -> DVector<f64> {
        let cost = |theta: &DVector<f64>| 0.5 * theta.dot(&(h * theta)) - g.dot(theta) + lambda * self.distance(theta);
        let mut theta = start.clone();
        let mut value = cost(&theta);
        for _ in 0..MOST_STEPS {
            let (mut gradient, mut hessian) = (h * &theta - g, h.clone());
            self.add_slopes(&theta, lambda, &mut gradient, &mut hessian);
            let Some(step) = scaled_solve(&hessian, &gradient) else { break };
            let decrement = gradient.dot(&step);
            if decrement <= 1e-12 * value.abs().max(1e-6) {
                break;
            }
            let mut length = 1.0;
            let taken = loop {
                let tried = &theta - &step * length;
                let there = cost(&tried);
                if there <= value - 1e-4 * length * decrement {
                    break Some((tried, there));
                }
                length *= 0.5;
                if length < 1e-10 {
                    break None;
                }
            };
            let Some((tried, there)) = taken else { break };
            (theta, value) = (tried, there);
        }
        theta
    }
}

/// `hessian^-1 gradient` with unit diagonal; `None` if the matrix is not positive definite.
fn scaled_solve(hessian: &DMatrix<f64>, gradient: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = hessian.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
    let mut scaled = hessian.clone();
    for (i, mut column) in scaled.column_iter_mut().enumerate() {
        column.component_mul_assign(&scale);
        column *= scale[i];
    }
    let solution = Cholesky::new(scaled)?.solve(&gradient.component_mul(&scale));
    Some(solution.component_mul(&scale))
}

/// Second moment of mass that a thin rod or plate lacks to be a body with some thickness in every direction \[kg m^2\].
///
/// Published tensors of such bodies stand on the limit of what can exist, rounded ones a little beyond.
fn missing_thickness(inertia: Sym3<f64>) -> f64 {
    let half = 0.5 * (inertia.xx + inertia.yy + inertia.zz);
    let Sym3 { xx, yy, zz, xy, xz, yz } = inertia;
    let moments = Matrix3::new(half - xx, -xy, -xz, -xy, half - yy, -yz, -xz, -yz, half - zz).symmetric_eigenvalues();
    (LEAST_THICKNESS * moments.max() - moments.min()).max(0.0)
}

/// Returns the pseudo-inertia: the 4 x 4 matrix of second, first and zeroth moments of mass, positive definite for
/// every real body.
pub fn pseudo_inertia(p: &[f64]) -> Matrix4<f64> {
    let half = 0.5 * (p[0] + p[3] + p[5]);
    #[rustfmt::skip]
    let matrix = Matrix4::new(
        half - p[0], -p[1],       -p[2],       p[6],
        -p[1],       half - p[3], -p[4],       p[7],
        -p[2],       -p[4],       half - p[5], p[8],
        p[6],        p[7],        p[8],        p[9],
    );
    matrix
}

/// The pseudo-inertia's change per inertial parameter.
fn pseudo_units() -> [Matrix4<f64>; INERTIAL] {
    std::array::from_fn(|k| {
        let mut unit = [0.0; INERTIAL];
        unit[k] = 1.0;
        pseudo_inertia(&unit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pseudo_inertia_of_point_masses_is_their_moments() {
        // Unit masses at (1, 0, 0) and (0, 2, 0): Ixx = 4, Iyy = 1, Izz = 5.
        let pseudo = pseudo_inertia(&[4.0, 0.0, 0.0, 1.0, 0.0, 5.0, 1.0, 2.0, 0.0, 2.0]);
        assert_eq!(pseudo.diagonal().as_slice(), [1.0, 4.0, 0.0, 2.0]);
        assert_eq!((pseudo[(0, 3)], pseudo[(1, 3)]), (1.0, 2.0));
    }

    /// A plate stands on the limit of what can exist; the search must be able to start from it.
    #[test]
    fn a_plate_can_be_a_priori() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../campaigns/models/kr300_r2500.toml");
        let mut robot = Robot::load(&path).expect("the shipped robot");
        let plate = Sym3 { xx: 1.0, yy: 2.0, zz: 3.0, xy: 0.0, xz: 0.0, yz: 0.0 };
        robot.model.joints[2].link.inertia = plate;
        let prior = RobotPrior::of(&robot);
        assert!(prior.distance(&prior.theta).is_finite());
        // Second moments 2, 1 and 0 kg m^2: a thousandth of the greatest is added to each.
        assert!((missing_thickness(plate) - 2e-3).abs() < 1e-12);
        assert_eq!(missing_thickness(Sym3 { zz: 2.0, ..plate }), 0.0, "a thick body stays as it is");
    }
}
