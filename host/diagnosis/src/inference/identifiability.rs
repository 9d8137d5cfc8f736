//! Identifiability: which parameters and effects the recorded motions determine, before any answer.
//!
//! Each nuisance parameter within its tolerance and each effect at a plausible size is a column: the change that it makes
//! to the whitened residuals. What the other nuisance parameters explain within their priors is projected out; a nuisance
//! parameter that is itself free in an effect is no rival of that effect. The remaining power gives the standard deviation
//! that these recordings allow and the expected log-odds at a plausible size; the remaining products of two columns give
//! the correlation by which they are confounded.

use super::bank::{Bank, Gram};
use super::evidence::regular;
use super::fit::Fitted;
use super::judge::threshold;
use super::noise::Noise;
use crate::model::block::MeasuredBlock;
use crate::model::hypothesis::Hypothesis;
use crate::model::unknown::Unknown;
use nalgebra::DMatrix;
use serde::Serialize;
use std::collections::BTreeSet;
use std::ops::Range;

/// Correlation from which two columns are confounded.
const CONFOUNDED: f64 = 0.95;

/// How well these recordings determine a parameter or an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Determination {
    /// The standard deviation is not below the tolerance or the plausible size: the recordings add nothing.
    Not,
    /// The standard deviation is below it, but a plausible size stays below the detection threshold.
    Weakly,
    /// A plausible size is detected.
    Determined,
}

/// Parameter or effect with what these recordings determine of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdentifiabilityRow {
    /// Catalogue id; `None` for a nuisance parameter of the model.
    pub id: Option<&'static str>,
    /// Description of the effect in its plant, or meaning of the parameter.
    pub name: &'static str,
    /// Name of the parameter: of an effect, that of its size.
    pub parameter: String,
    /// SI unit.
    pub unit: &'static str,
    /// Prior tolerance of the parameter, or plausible size of the effect.
    pub plausible: f64,
    /// Standard deviation that the recordings alone allow; infinite, in JSON null, where no signal shows the effect.
    pub deviation: f64,
    /// Expected log-odds at the plausible size, natural logarithm.
    pub log_odds: f64,
    /// How well it is determined.
    pub determination: Determination,
    /// Session by which this plant determines it; `None` for the experiment of the effect's group.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub session: Option<&'static str>,
}

/// Pair of rows that are confounded.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConfoundedPair {
    /// Both rows: catalogue id of an effect, name of a parameter.
    pub rows: [String; 2],
    /// Correlation of their changes, 0 to 1.
    pub correlation: f64,
}

/// Identifiability of a block.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlockIdentifiability {
    /// The block.
    pub block: &'static str,
    /// Nuisance parameters first, then effects.
    pub rows: Vec<IdentifiabilityRow>,
    /// Confounded pairs of rows that are at least weakly determined.
    pub confounded: Vec<ConfoundedPair>,
}

impl IdentifiabilityRow {
    /// Returns the name by which pairs refer to the row: catalogue id, or name of the parameter.
    pub fn key(&self) -> &str {
        self.id.unwrap_or(&self.parameter)
    }
}

impl Determination {
    /// Returns the determination from the standard deviation in units of the plausible size, and the expected log-odds.
    pub(crate) fn of(share: f64, log_odds: f64, threshold: f64) -> Self {
        match (log_odds >= threshold, share < 1.0) {
            (true, _) => Self::Determined,
            (false, true) => Self::Weakly,
            (false, false) => Self::Not,
        }
    }
}

/// Returns the identifiability of a block, with the noise that is known before any hypothesis is fitted; `None` if it is
/// not identifiable.
pub(crate) fn identifiability(block: &MeasuredBlock, library: &[Hypothesis]) -> Option<BlockIdentifiability> {
    let noise = prior_noise(block)?;
    let learn = block.part(false);
    let shortcut = learn.shortcut(&noise, &block.base);
    let null = shortcut.null();
    let bank = Bank::simulate(library, &null, &block.base, &|sets| shortcut.whitened(sets));
    let columns = Columns::of(&null, &bank);
    let gram = Gram::of(columns.remaining(&BTreeSet::new(), columns.signatures()));
    let threshold = threshold(&bank, &gram, library.len());
    let subjects = columns.subjects(block, library, &bank, &null, threshold);
    let confounded = columns.confounded(&subjects);
    let rows = subjects.into_iter().map(|subject| subject.row).collect();
    Some(BlockIdentifiability { block: block.name, rows, confounded })
}

/// Noise before any hypothesis: from repeats or quiet stretches, or else from the residual of the nuisance parameters.
fn prior_noise(block: &MeasuredBlock) -> Option<Noise> {
    if let Some(noise) = Noise::above(&block.noise_alone(), &block.floor) {
        return Some(noise);
    }
    let learn = block.part(false);
    let rough = Noise::rough(&learn.means(&block.base), &block.floor)?;
    let null = learn.shortcut(&rough, &block.base).null();
    Noise::above(&learn.means(&null.values(&block.base)), &block.floor)
}

/// Products of all columns: nuisance parameters first, then signatures.
struct Columns {
    products: DMatrix<f64>,
    nuisances: usize,
}

/// Row with its columns and with the nuisance parameters that are no rivals of it.
struct Subject {
    row: IdentifiabilityRow,
    columns: Range<usize>,
    own: BTreeSet<usize>,
}

impl Columns {
    fn of(null: &Fitted, bank: &Bank) -> Self {
        let nuisances = null.jacobian.ncols();
        let all: Vec<_> = null.jacobian.column_iter().chain(bank.all().column_iter()).collect();
        let all = if all.is_empty() { DMatrix::zeros(0, 0) } else { DMatrix::from_columns(&all) };
        Self { products: all.transpose() * &all, nuisances }
    }

    fn signatures(&self) -> Range<usize> {
        self.nuisances..self.products.ncols()
    }

    /// Products of some columns less what the nuisance parameters explain, but for `own`.
    fn remaining(&self, own: &BTreeSet<usize>, columns: Range<usize>) -> DMatrix<f64> {
        let explained = self.explained(own, &columns);
        let (start, count) = (columns.start, columns.len());
        self.products.view((start, start), (count, count)) - explained.transpose() * explained
    }

    /// What the nuisance parameters but for `own` explain of columns: products of two columns lose the products of these.
    fn explained(&self, own: &BTreeSet<usize>, columns: &Range<usize>) -> DMatrix<f64> {
        let rivals: Vec<usize> = (0..self.nuisances).filter(|place| !own.contains(place)).collect();
        let normal = DMatrix::from_fn(rivals.len(), rivals.len(), |i, j| {
            self.products[(rivals[i], rivals[j])] + if i == j { 1.0 } else { 0.0 }
        });
        let mixed = DMatrix::from_fn(rivals.len(), columns.len(), |i, j| self.products[(rivals[i], columns.start + j)]);
        let factor = regular(normal);
        factor.l_dirty().solve_lower_triangular(&mixed).unwrap_or(mixed)
    }

    /// Nuisance parameters and effects with what is determined of them.
    fn subjects(
        &self,
        block: &MeasuredBlock,
        library: &[Hypothesis],
        bank: &Bank,
        null: &Fitted,
        threshold: f64,
    ) -> Vec<Subject> {
        let fields = block.section.parameters();
        let parameters = null.unknowns.iter().enumerate().map(|(place, unknown)| {
            let own = BTreeSet::from([place]);
            let power = self.remaining(&own, place..place + 1)[(0, 0)].max(0.0);
            let log_odds = 0.5 * (power * power / (power + 1.0) - power.ln_1p());
            let row = row(None, fields[unknown.field].meaning, unknown, (log_odds, power.sqrt().recip()), threshold);
            Subject { row, columns: place..place + 1, own }
        });
        let effects = library.iter().enumerate().map(|(number, hypothesis)| {
            let own = hypothesis.unknowns.iter().filter_map(|unknown| null.place(unknown.field)).collect();
            let signatures = bank.columns(number);
            let columns = self.nuisances + signatures.start..self.nuisances + signatures.end;
            let explained = self.explained(&own, &columns);
            let power = |signature: usize| {
                let column = self.nuisances + signature;
                (self.products[(column, column)] - explained.column(signature - signatures.start).norm_squared())
                    .max(0.0)
            };
            let expected = bank.expected(number, &power);
            let size = &hypothesis.unknowns[hypothesis.sizes[0]];
            let row = row(Some(hypothesis.effect.id), hypothesis.name, size, expected, threshold);
            Subject { row, columns, own }
        });
        parameters.chain(effects).collect()
    }

    /// Pairs of subjects that are confounded. Two forms of one effect, or an effect and its own parameter, are no pair.
    fn confounded(&self, subjects: &[Subject]) -> Vec<ConfoundedPair> {
        let known: Vec<&Subject> =
            subjects.iter().filter(|subject| subject.row.determination > Determination::Not).collect();
        let mut all: Vec<ConfoundedPair> = Vec::new();
        for (number, a) in known.iter().enumerate() {
            for b in &known[number + 1..] {
                let is_same = a.row.key() == b.row.key() || a.row.id.is_none() && a.own.is_subset(&b.own);
                let correlation = if is_same { 0.0 } else { self.correlation(a, b) };
                let rows = [a, b].map(|subject| subject.row.key().to_owned());
                // Two forms of one effect may both be like a third.
                if correlation > CONFOUNDED && all.iter().all(|pair| pair.rows != rows) {
                    all.push(ConfoundedPair { rows, correlation });
                }
            }
        }
        all
    }

    /// Greatest correlation of the columns of two subjects, after the projection of all other nuisance parameters.
    fn correlation(&self, a: &Subject, b: &Subject) -> f64 {
        let own: BTreeSet<usize> = a.own.union(&b.own).copied().collect();
        let of = [a, b].map(|subject| self.explained(&own, &subject.columns));
        let power = |which: usize, subject: &Subject, k: usize| {
            let column = subject.columns.start + k;
            (self.products[(column, column)] - of[which].column(k).norm_squared()).max(f64::MIN_POSITIVE)
        };
        let mixed = of[0].transpose() * &of[1];
        let powers = [(0, a), (1, b)]
            .map(|(which, subject)| (0..subject.columns.len()).map(|k| power(which, subject, k)).collect::<Vec<f64>>());
        let pairs = (0..mixed.nrows()).flat_map(|i| (0..mixed.ncols()).map(move |j| (i, j)));
        let correlation = |(i, j): (usize, usize)| {
            let product = self.products[(a.columns.start + i, b.columns.start + j)] - mixed[(i, j)];
            product.abs() / (powers[0][i] * powers[1][j]).sqrt()
        };
        pairs.map(correlation).fold(0.0, f64::max).min(1.0)
    }
}

/// Row of a parameter from its expected log-odds and its standard deviation in `z`.
fn row(
    id: Option<&'static str>,
    name: &'static str,
    unknown: &Unknown,
    (log_odds, deviation): (f64, f64),
    threshold: f64,
) -> IdentifiabilityRow {
    let plausible = unknown.prior.slope(0.0).abs();
    IdentifiabilityRow {
        id,
        name,
        parameter: unknown.name.clone(),
        unit: unknown.unit,
        plausible,
        deviation: plausible * deviation,
        log_odds,
        determination: Determination::of(deviation, log_odds, threshold),
        session: None,
    }
}
