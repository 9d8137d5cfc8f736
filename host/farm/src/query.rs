//! Questions to the runs of a results folder: the answers are tables.

use crate::error::{FarmError, Result};
use crate::folder::ResultsFolder;
use crate::replay::replay_run;
use softdock_analysis::summary::AgreementSummary;
use softdock_analysis::{AnalysisError, Judge, Share, agreement_of, cause_text};
use softdock_campaign::requirement::{Requirement, Subject};
use softdock_campaign::suggest::likely;
use softdock_results::arrow_table::ArrowTable;
use softdock_results::columns::{self, AGREEMENT, Loop, NO_CAUSE, RUN};
use softdock_results::runs::{AGREEMENT_WORDS, Agreement, input_fields};
use softdock_results::shards::ShardIndex;
use softdock_results::{Column, ColumnKind, Table, Values};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Groups of runs of [`Runs::agreement_by`], at most.
pub const MOST_BINS: usize = 1000;

/// File of the time history of a run: the kept one, or one that is made again in f64 below `replays/`.
///
/// # Errors
/// If the folder does not contain the run.
pub fn run_trace(folder: &ResultsFolder, run: u64) -> Result<PathBuf> {
    let name = format!("run={run:09}.parquet");
    let kept = ["traces", "replays"].map(|place| folder.path.join(place).join(&name));
    let found = kept.into_iter().find(|path| path.is_file());
    found.map_or_else(|| replay_run(&folder.path, run, None).map(|replayed| replayed.history), Ok)
}

/// The runs of a results folder.
pub struct Runs<'a> {
    folder: &'a ResultsFolder,
    index: ShardIndex,
}

/// Units of the numbers in an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// SI.
    Si,
    /// Those in which the campaign file writes its quantities; SI where it writes none.
    Author,
}

impl<'a> Runs<'a> {
    /// Opens the runs of a folder; every byte of every shard is verified.
    ///
    /// # Errors
    /// If the folder holds variants, or no whole shard.
    pub fn of(folder: &'a ResultsFolder) -> Result<Self> {
        folder.refuse_variants()?;
        let index = folder.shards()?;
        if index.complete.is_empty() {
            let message = format!("`{}` holds no complete shard yet", folder.path.display());
            return Err(FarmError::refused(message, "run the campaign first, or wait for its first shard"));
        }
        Ok(Self { folder, index })
    }

    /// The table of the runs: all columns; without inputs that are the same in every run; or the named ones.
    ///
    /// # Errors
    /// If a shard cannot be read, or there is no column of a name.
    pub fn table(&self, names: Option<&[String]>, only_varied: bool, units: Units) -> Result<ArrowTable> {
        let known = self.index.columns()?;
        let names: Vec<String> = match names {
            Some(names) => {
                let unknown = names.iter().find(|name| known.column(name).is_none());
                if let Some(name) = unknown {
                    let remedy =
                        near(name, &known.columns.iter().map(|column| column.name.as_str()).collect::<Vec<_>>());
                    return Err(FarmError::refused(format!("the runs have no column `{name}`"), remedy));
                }
                names.to_vec()
            }
            None => {
                let constant = if only_varied { self.constant_inputs(&known)? } else { Vec::new() };
                known.columns.into_iter().map(|column| column.name).filter(|name| !constant.contains(name)).collect()
            }
        };
        let table = ArrowTable::of_runs(&self.index, &names)?;
        Ok(match units {
            Units::Si => table,
            Units::Author => table.in_units(&self.folder.author_units()),
        })
    }

    /// One run as a table of one row, SI.
    ///
    /// # Errors
    /// If a shard cannot be read, or there is no such run.
    pub fn row(&self, run: u64) -> Result<Table> {
        let row = self.index.read_run(run)?.ok_or_else(|| self.folder.no_run(run))?;
        Ok(Judge::of(&self.folder.campaign).schema().table(&[row]))
    }

    /// Inputs with one value in all runs.
    fn constant_inputs(&self, known: &Table) -> Result<Vec<String>> {
        let inputs = known.columns.iter().filter(|column| column.kind == ColumnKind::Input);
        let mut constant: Vec<(String, Option<Option<f64>>)> =
            inputs.map(|column| (column.name.clone(), None)).collect();
        let names: Vec<String> = constant.iter().map(|(name, _)| name.clone()).collect();
        for batch in self.index.read_columns(&names) {
            let batch = batch?;
            constant.retain_mut(|(name, first)| {
                let values = batch.f64s(name).unwrap_or_default();
                let first = *first.get_or_insert_with(|| values.first().copied().flatten());
                values.iter().all(|value| *value == first)
            });
        }
        Ok(constant.into_iter().map(|(name, _)| name).collect())
    }

    fn view<T>(&self, column: std::result::Result<T, columns::ColumnError>) -> Result<T> {
        Ok(column.map_err(|error| AnalysisError::of_column(&self.folder.path, &error))?)
    }

    /// Why runs of one agreement (`false_fail`) do not pass, most frequent first: on the facility; of false passes, in
    /// space. A loop that passes the task but not a requirement has the requirement as its cause.
    ///
    /// # Errors
    /// If a shard cannot be read, or the word is no agreement.
    pub fn causes(&self, agreement: &str) -> Result<Table> {
        let wanted = Agreement::from_word(agreement).ok_or_else(|| {
            let message = format!("`{agreement}` is no agreement of the facility with space");
            FarmError::refused(message, format!("write one of: {}", AGREEMENT_WORDS.join(", ")))
        })?;
        let side = if wanted == Agreement::FalsePass { Loop::Space } else { Loop::Hil };
        let requirements: Vec<&Requirement> =
            self.folder.campaign.requirements.iter().filter(|one| one.subject == Subject::Space).collect();
        let passes: Vec<_> = requirements.iter().map(|one| side.pass(&one.column_id())).collect();
        let mut names = vec![RUN.name().to_owned(), AGREEMENT.name().to_owned()];
        names.extend([side.cause().into_name(), side.cause_phase().into_name()]);
        names.extend(passes.iter().map(|column| column.name().to_owned()));
        let mut counts: BTreeMap<(String, &'static str), (u64, u64)> = BTreeMap::new();
        let mut all = 0;
        for batch in self.index.read_columns(&names) {
            let batch = batch?;
            let (run, agreements) = (self.view(batch.get(&RUN))?, self.view(batch.get(&AGREEMENT))?);
            let (cause, phase) = (self.view(batch.get(&side.cause()))?, self.view(batch.get(&side.cause_phase()))?);
            let passed = passes.iter().map(|name| self.view(batch.get(name))).collect::<Result<Vec<_>>>()?;
            for row in (0..batch.rows()).filter(|row| agreements.at(*row) == wanted) {
                let failed = || requirements.iter().zip(&passed).find(|(_, passed)| passed[row] == Some(false));
                let id = match cause.at(row) {
                    NO_CAUSE => failed().map_or(NO_CAUSE.to_owned(), |(requirement, _)| requirement.id.clone()),
                    cause => cause.to_owned(),
                };
                let phase = phase.at(row).map_or("none", |phase| phase.word());
                counts.entry((id, phase)).or_insert((0, run[row])).0 += 1;
                all += 1;
            }
        }
        let mut counts: Vec<_> = counts.into_iter().collect();
        counts.sort_by_key(|(_, (runs, _))| std::cmp::Reverse(*runs));
        let meaning = |id: &str| match requirements.iter().find(|requirement| requirement.id == id) {
            Some(requirement) => format!("requirement not met: {}", requirement.text),
            None => cause_text(id, None),
        };
        let meanings: Vec<String> = counts.iter().map(|((id, _), _)| meaning(id)).collect();
        let share = |runs: u64| runs as f64 / all as f64;
        Ok(Table {
            columns: vec![
                words("cause", "criterion, rule, flag or requirement", counts.iter().map(|((id, _), _)| id.as_str())),
                words("meaning", "what it means", meanings.iter().map(String::as_str)),
                words("phase", "phase of the run", counts.iter().map(|((_, phase), _)| *phase)),
                whole("runs", "runs with this cause", counts.iter().map(|(_, (runs, _))| *runs)),
                real("share", "1", "of the runs of this agreement", counts.iter().map(|(_, (runs, _))| share(*runs))),
                whole("first_run", "number of the first such run", counts.iter().map(|(_, (_, first))| *first)),
            ],
        })
    }

    /// Agreement of the facility with space along one input, in groups of equally many runs: counts, and the rates of
    /// false passes, false fails and aborted sessions with their exact 95 % intervals. Without cases a rate is missing.
    ///
    /// # Errors
    /// If a shard cannot be read, the name is no input, or the number of bins is out of range.
    pub fn agreement_by(&self, name: &str, bins: usize, units: Units) -> Result<Table> {
        if !(1..=MOST_BINS).contains(&bins) {
            return Err(FarmError::refused(format!("{bins} bins"), format!("write 1 to {MOST_BINS}")));
        }
        let known = self.index.columns()?;
        let (input, si) =
            self.folder.input_column(name).filter(|(input, _)| known.column(input).is_some()).ok_or_else(|| {
                let fields = input_fields();
                let remedy = near(name, &fields.iter().map(|field| field.name.as_str()).collect::<Vec<_>>());
                FarmError::refused(format!("the runs have no input `{name}`"), remedy)
            })?;
        let author = self.folder.author_units().into_iter().find(|unit| units == Units::Author && unit.column == input);
        let (unit, in_si) = author.map_or((si, 1.0), |author| (author.unit, author.in_si));
        let mut rows: Vec<(f64, Agreement)> = Vec::new();
        for batch in self.index.read_columns(&[input.clone(), AGREEMENT.name().to_owned()]) {
            let batch = batch?;
            let agreements = self.view(batch.get(&AGREEMENT))?;
            let values = batch.f64s(&input).unwrap_or_default();
            rows.extend(values.iter().enumerate().filter_map(|(row, value)| Some(((*value)?, agreements.at(row)))));
        }
        rows.sort_by(|one, two| one.0.total_cmp(&two.0));
        let groups = groups(&rows, bins);
        let counts: Vec<[u64; AGREEMENT_WORDS.len()]> = groups
            .iter()
            .map(|group| {
                let mut counts = [0; AGREEMENT_WORDS.len()];
                group.iter().for_each(|(_, agreement)| counts[*agreement as usize] += 1);
                counts
            })
            .collect();
        let ends = groups.iter().filter_map(|group| Some((group.first()?.0 / in_si, group.last()?.0 / in_si)));
        let (from, to): (Vec<f64>, Vec<f64>) = ends.unzip();
        let mut columns = vec![
            real("from", &unit, &format!("least `{name}` of the group"), from),
            real("to", &unit, &format!("greatest `{name}` of the group"), to),
            whole("runs", "runs of the group", groups.iter().map(|group| group.len() as u64)),
        ];
        for (at, word) in AGREEMENT_WORDS.iter().enumerate() {
            columns.push(whole(word, "runs of the group with this agreement", counts.iter().map(|count| count[at])));
        }
        let agreements: Vec<AgreementSummary> = counts.iter().map(agreement_of).collect();
        for (rate, of) in RATES {
            let shares: Vec<Option<Share>> =
                agreements.iter().map(|agreement| Some(of(agreement)).filter(|share| share.cases > 0)).collect();
            let column = |suffix: &str, meaning: &str, value: fn(Share) -> f64| Column {
                values: Values::F64(shares.iter().map(|share| share.map(value)).collect()),
                ..real(&format!("{rate}{suffix}"), "1", meaning, [])
            };
            columns.push(column("", "share of the cases", |share| share.count as f64 / share.cases as f64));
            columns.push(column("_lo", "lower end of its exact 95 % interval", |share| share.interval.lo));
            columns.push(column("_hi", "upper end of its exact 95 % interval", |share| share.interval.hi));
        }
        Ok(Table { columns })
    }

    /// The runs of least margin of a requirement in one loop, worst first; runs without a margin are left out.
    ///
    /// # Errors
    /// If a shard cannot be read, or the campaign has no such requirement on single runs.
    pub fn worst(&self, requirement: &str, side: Loop, most: usize, units: Units) -> Result<Table> {
        let requirements = &self.folder.campaign.requirements;
        let found = requirements.iter().find(|one| one.id.eq_ignore_ascii_case(requirement)).ok_or_else(|| {
            let ids: Vec<&str> = requirements.iter().map(|one| one.id.as_str()).collect();
            let remedy = match ids.is_empty() {
                true => "the campaign has none".to_owned(),
                false => format!("write one of: {}", ids.join(", ")),
            };
            FarmError::refused(format!("there is no requirement `{requirement}` on single runs"), remedy)
        })?;
        let margin = side.margin(&found.column_id());
        let value = found.metric.column.as_ref().filter(|_| side.has_metric(&found.metric.name));
        let value = value.map(|column| side.metric_column(column));
        let mut names = vec![RUN.name().to_owned(), AGREEMENT.name().to_owned()];
        names.extend([margin.name().to_owned(), side.cause().into_name()]);
        names.extend(value.iter().map(|column| column.name().to_owned()));
        let mut rows: Vec<(f64, u64, Option<f64>, Agreement, String)> = Vec::new();
        for batch in self.index.read_columns(&names) {
            let batch = batch?;
            let (run, agreements) = (self.view(batch.get(&RUN))?, self.view(batch.get(&AGREEMENT))?);
            let (margins, cause) = (self.view(batch.get(&margin))?, self.view(batch.get(&side.cause()))?);
            let values = value.as_ref().map(|name| self.view(batch.get(name))).transpose()?;
            for row in 0..batch.rows() {
                let Some(margin) = margins[row] else { continue };
                let value = values.and_then(|values| values[row]);
                rows.push((margin, run[row], value, agreements.at(row), cause.at(row).to_owned()));
            }
            rows.sort_by(|one, two| one.0.total_cmp(&two.0).then(one.1.cmp(&two.1)));
            rows.truncate(most);
        }
        let author =
            self.folder.author_units().into_iter().find(|one| units == Units::Author && one.column == margin.name());
        let (unit, in_si) = author.map_or((found.unit().to_owned(), 1.0), |author| (author.unit, author.in_si));
        let place = if side == Loop::Space { "in space" } else { "on the facility" };
        let mut columns = vec![
            whole("run", "run number", rows.iter().map(|row| row.1)),
            real("margin", &unit, "distance to the limit, positive inside", rows.iter().map(|row| row.0 / in_si)),
        ];
        if value.is_some() {
            let values = rows.iter().map(|row| row.2.map(|value| value / in_si)).collect();
            let meaning = format!("`{}` {place}", found.metric.name);
            columns.push(Column { values: Values::F64(values), ..real("value", &unit, &meaning, []) });
        }
        columns.push(words("agreement", "of the facility with space", rows.iter().map(|row| row.3.word())));
        columns.push(words("cause", &format!("why the task fails {place}"), rows.iter().map(|row| row.4.as_str())));
        Ok(Table { columns })
    }
}

/// A rate of a group of runs: its name, and its place in the summary, which defines it.
type RateRow = (&'static str, fn(&AgreementSummary) -> Share);

const RATES: [RateRow; 3] = [
    ("false_pass_rate", |agreement| agreement.false_pass_rate),
    ("false_fail_rate", |agreement| agreement.false_fail_rate),
    ("abort_rate", |agreement| agreement.abort_rate),
];

/// Sorted runs in groups of equally many; equal values are in one group.
fn groups(rows: &[(f64, Agreement)], bins: usize) -> Vec<&[(f64, Agreement)]> {
    let mut groups = Vec::new();
    let mut start = 0;
    for bin in 1..=bins {
        let mut end = (rows.len() * bin / bins).max(start);
        while end > start && end < rows.len() && rows[end].0 == rows[end - 1].0 {
            end += 1;
        }
        if end > start {
            groups.push(&rows[start..end]);
            start = end;
        }
    }
    groups
}

/// A remedy with the names that a wrong one may mean.
fn near(name: &str, known: &[&str]) -> String {
    let found: Vec<String> = likely(name, known).into_iter().map(|name| format!("`{name}`")).collect();
    match found.is_empty() {
        true => "`softdock params` lists the parameters, `softdock metrics` the metrics".to_owned(),
        false => format!("did you mean {}?", found.join(" or ")),
    }
}

fn answer(name: &str, unit: &str, description: &str, kind: ColumnKind, values: Values) -> Column {
    let [name, unit, description] = [name, unit, description].map(str::to_owned);
    Column { name, unit, description, source: "query".to_owned(), kind, values }
}

fn words<'w>(name: &str, description: &str, values: impl Iterator<Item = &'w str> + Clone) -> Column {
    answer(name, "1", description, ColumnKind::Status, Values::words_of(values))
}

fn whole(name: &str, description: &str, values: impl Iterator<Item = u64>) -> Column {
    answer(name, "1", description, ColumnKind::Metric, Values::U64(values.collect()))
}

fn real(name: &str, unit: &str, description: &str, values: impl IntoIterator<Item = f64>) -> Column {
    answer(name, unit, description, ColumnKind::Metric, Values::F64(values.into_iter().map(Some).collect()))
}
