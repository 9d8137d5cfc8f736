//! Sensitivity of a block's residuals to a signal added to its late input, knot by knot.

use crate::inference::noise::{Noise, mean};
use crate::inference::recordings::{BlockRecordings, cut};
use nalgebra::{DMatrix, DVector};
use softdock_kernels::block::Recorded;

/// Residual of an experiment and its sensitivity to an added signal.
#[derive(Clone, Debug)]
pub struct KnotResponse {
    /// The experiment's first recording.
    pub recorded: Recorded,
    /// Name of the experiment.
    pub experiment: String,
    /// Instants of the recording at which the added signal has its knots.
    pub knots: Vec<usize>,
    /// Whitened residual, averaged over the repeats.
    pub residual: DVector<f64>,
    /// Change of the residual per unit at each knot, one column per knot; the signal is piecewise linear.
    pub response: DMatrix<f64>,
}

/// Knots whose recordings are held at once.
const MOST_KNOTS: usize = 32;

impl BlockRecordings<'_> {
    /// Returns the responses of all experiments to a signal added to the first late input; `apart` is the spacing of
    /// the knots \[s\].
    pub fn responses(&self, noise: &Noise, set: &[f64], apart: f64) -> Vec<KnotResponse> {
        let trials = self.of_trials(&self.all(), &[set.to_vec()]).remove(0);
        let of = |(name, members): &(&str, Vec<usize>)| {
            let recorded = self.recordings[members[0]];
            let whiten = |residual: DMatrix<f64>| DVector::from_vec(self.white(noise, residual, members.len()));
            let own = mean(&cut(members, &trials));
            let knots = knots(recorded, apart);
            let columns = self.columns(recorded, set, &knots).into_iter();
            let columns: Vec<DVector<f64>> =
                columns.map(|column| whiten(column.columns(0, own.ncols()).into())).collect();
            KnotResponse {
                recorded: recorded.clone(),
                experiment: (*name).to_owned(),
                knots,
                residual: whiten(own),
                response: DMatrix::from_columns(&columns),
            }
        };
        self.experiments.iter().map(of).collect()
    }

    /// What a unit at each knot takes from the residual of a recording.
    fn columns(&self, recorded: &Recorded, set: &[f64], knots: &[usize]) -> Vec<DMatrix<f64>> {
        let sets = [set.to_vec()];
        let without = self.block.simulate(&[recorded], &sets).remove(0).remove(0);
        let mut all = Vec::with_capacity(knots.len());
        let places: Vec<usize> = (0..knots.len()).collect();
        for some in places.chunks(MOST_KNOTS) {
            let with: Vec<Recorded> = some.iter().map(|place| added(recorded, knots, *place)).collect();
            let outputs = self.block.simulate(&with.iter().collect::<Vec<_>>(), &sets);
            all.extend(outputs.iter().map(|sets| self.of_channels(&without) - self.of_channels(&sets[0])));
        }
        all
    }
}

/// Instants of the knots, the first and the last of a recording among them.
fn knots(recorded: &Recorded, apart: f64) -> Vec<usize> {
    let last = recorded.instants - 1;
    let count = ((last as f64 * recorded.step / apart).round() as usize).max(1);
    (0..=count).map(|k| k * last / count).collect()
}

/// A recording with a unit at one knot, which falls to nothing at its neighbours.
fn added(recorded: &Recorded, knots: &[usize], place: usize) -> Recorded {
    let mut with = recorded.clone();
    let width = recorded.late.len() / recorded.instants;
    let knot = knots[place];
    let mut add = |from: usize, to: usize, share: &dyn Fn(usize) -> f64| {
        (from..to).for_each(|i| with.late[i * width] += share(i));
    };
    if place > 0 {
        let before = knots[place - 1];
        add(before, knot, &|i| (i - before) as f64 / (knot - before) as f64);
    }
    add(knot, knot + 1, &|_| 1.0);
    if let Some(after) = knots.get(place + 1) {
        add(knot + 1, *after, &|i| (after - i) as f64 / (after - knot) as f64);
    }
    with
}
