//! Searches beside the end points of fits: effects that jump from sample to sample have narrow minima.

use super::climb::{Climb, GAIN, MUCH, cost};
use super::{HOPELESS, Simulate, simulated};
use crate::model::unknown::Role;

/// How far one looks to either side, in `z`.
const BESIDE: [f64; 4] = [0.1, 0.03, 0.01, 0.003];

/// Searches beside the end points of one-parameter fits with a large misfit that are not ruled out. Effects that jump
/// from sample to sample, such as a hold or a limit, have adjacent narrow minima that no derivative shows. Returns
/// whether any fit continues from a better point.
pub(super) fn probe(climbs: &mut [Climb], base: &[f64], simulate: &Simulate) -> bool {
    let best = climbs.iter().map(|climb| climb.at.cost()).fold(f64::INFINITY, f64::min);
    let beside = |climb: &Climb| {
        let at = &climb.at;
        let own: Vec<usize> = (0..at.z.len()).filter(|i| at.unknowns[*i].role != Role::Nuisance).collect();
        let leaves_much = at.mean_square() > MUCH && at.cost() < best + HOPELESS * at.mean_square();
        let [place] = own[..] else { return Vec::new() };
        let moved = |way: f64| {
            let mut z = at.z.clone();
            z[place] = at.unknowns[place].prior.allowed(z[place] + way);
            z
        };
        let ways = BESIDE.iter().flat_map(|way| [*way, -way]);
        ways.filter(|_| leaves_much).map(moved).collect::<Vec<_>>()
    };
    let trials: Vec<Vec<Vec<f64>>> = climbs.iter().map(beside).collect();
    let residuals = simulated(climbs, &trials, base, simulate);
    let mut any = false;
    for ((climb, own), residuals) in climbs.iter_mut().zip(trials).zip(residuals) {
        let tried = own.into_iter().zip(residuals).map(|(z, residual)| (cost(&residual, &z), z, residual));
        let Some((least, z, residual)) = tried.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if least < climb.at.cost() - GAIN {
            climb.resume(z, residual);
            any = true;
        }
    }
    any
}
