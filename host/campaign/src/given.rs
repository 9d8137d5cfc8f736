//! Campaigns on given cases in the place of their draws.

use crate::campaign::{Campaign, Method};
use crate::cases::{Cases, LISTED, holds};
use crate::derived::with_derived;
use crate::dispersion::{Class, Dispersion};
use crate::distribution::Distribution;
use crate::problem::{Problem, Problems};
use crate::ranges::{in_words, legal};
use crate::stability::Extremes;
use crate::units::show;
use softdock_kernels::fields::{fields, from_slice, to_vec};
use softdock_kernels::params::Params;

impl Campaign {
    /// The same campaign on given cases in the place of its draws: as many runs as cases, no outer loop.
    ///
    /// The cases are no sample, so that nothing can be concluded from them on the campaign's dispersions.
    ///
    /// # Errors
    /// If a case needs a finer substep than the scenario's, has less delay than the loop has by itself, or a derived
    /// value beyond its legal range.
    pub fn with_cases(mut self, cases: Cases) -> Result<Self, Problems> {
        let table = fields::<f64, Params<f64>>();
        let nominal = self.undispersed();
        let variables = self.dispersions.iter().filter(|dispersion| dispersion.field >= table.len());
        let variables = variables.map(|variable| Dispersion {
            distribution: Distribution::Constant { value: nominal[variable.field] },
            ..variable.clone()
        });
        let source = cases.file_name().to_owned();
        // A column of the nominal value alone disperses nothing: its effects are not computed for it.
        let varied = cases.columns().filter(|(field, _, values)| values.iter().any(|value| *value != nominal[*field]));
        let given = varied.map(|(field, _, values)| {
            let mut values = values.to_vec();
            values.sort_by(f64::total_cmp);
            Dispersion {
                field,
                name: table[field].name.clone(),
                unit: table[field].unit,
                distribution: Distribution::Table { values },
                class: Class::Aleatory,
                source: Some(source.clone()),
                place: 0..0,
            }
        });
        self.dispersions = variables.chain(given).collect();
        self.correlations.clear();
        self.derived.retain(|derived| !cases.has(derived.field));
        (self.outer_draws, self.method, self.runs) = (None, Method::Random, cases.len());
        let plain = self.cases.take().map_or_else(|| self.hash.clone(), |(_, plain)| plain);
        let text = format!("{plain} cases {}", cases.hash());
        self.hash = blake3::hash(text.as_bytes()).to_hex().to_string();
        self.cases = Some((cases.clone(), plain));
        self.check_cases(&cases)?;
        Ok(self)
    }

    /// The given cases, if there are any.
    pub fn cases(&self) -> Option<&Cases> {
        self.cases.as_ref().map(|(cases, _)| cases)
    }

    /// Number of the run at a place among the campaign's runs, from 0: the place itself, unless given cases number their runs.
    pub fn run_at(&self, place: u64) -> u64 {
        self.cases().and_then(|cases| cases.runs().get(place as usize).copied()).unwrap_or(place)
    }

    /// Place of a run among the campaign's runs; `None` if it is none of them.
    pub fn place_of(&self, run: u64) -> Option<u64> {
        match self.cases() {
            Some(cases) => cases.runs().binary_search(&run).ok().map(|place| place as u64),
            None => (run < self.runs).then_some(run),
        }
    }

    /// The inputs of a given case; those of the nominal run for a number that the table does not have.
    pub(crate) fn given(&self, cases: &Cases, run: u64) -> Params<f64> {
        let mut values = self.undispersed();
        if let Ok(row) = cases.runs().binary_search(&run) {
            for (field, _, column) in cases.columns() {
                values[field] = column[row];
            }
        }
        with_derived(values, &self.derived)
    }

    fn check_cases(&self, cases: &Cases) -> Result<(), Problems> {
        let table = fields::<f64, Params<f64>>();
        let mut least = vec![f64::INFINITY; table.len()];
        let mut greatest = vec![f64::NEG_INFINITY; table.len()];
        let mut problems = Vec::new();
        for run in cases.runs() {
            let values = to_vec(&self.given(cases, *run));
            for (field, value) in values.iter().enumerate() {
                (least[field], greatest[field]) = (least[field].min(*value), greatest[field].max(*value));
            }
            for derived in self.derived.iter().filter(|derived| derived.field < table.len()) {
                let (value, range) = (values[derived.field], legal(&derived.name));
                if !holds(&range, value) && problems.len() < LISTED {
                    let message = format!(
                        "{}: run {run}: `{} = {}` is {}, out of range",
                        cases.path().display(),
                        derived.name,
                        derived.text,
                        show(value, derived.unit)
                    );
                    let words = in_words(range, derived.unit);
                    let remedy = format!("add a column `{}` with values {words}, or change the row", derived.name);
                    problems.push(Problem::with_file(cases.path().to_owned(), message).expected(words).remedy(remedy));
                }
            }
        }
        Problems::check(problems)?;
        let extremes = Extremes { least: from_slice(&least), greatest: from_slice(&greatest) };
        let column = |parameter: &str| cases.columns().find(|(field, ..)| table[*field].name == parameter);
        self.scenario.check_steps(&extremes, |parameter| {
            column(parameter).map(|(_, span, _)| (cases.source().clone(), span.clone()))
        })
    }
}
