//! Time histories: selection of runs, and their repetition in f64 with recorded signals.

use crate::error::Result;
use crate::folder::ResultsFolder;
use crate::repetitions::is_chosen;
use crate::rows::{RowBuilder, params_of};
use crate::signals::signals;
use rayon::prelude::*;
use softdock_campaign::Campaign;
use softdock_campaign::campaign::Keep;
use softdock_engine::{RunInput, cpu};
use softdock_kernels::outcome::Finished;
use softdock_kernels::params::Params;
use softdock_results::runs::{RunRow, Status};
use softdock_results::shards::{Provenance, ShardIndex};
use softdock_results::traces::{NOMINAL_RUN, Signal, Trace, write_trace};
use std::collections::BTreeMap;

/// A run with the parameters that were applied.
pub(crate) type AppliedRun = (u64, Params<f64>);

/// A run whose time history is kept, and why.
pub(crate) type KeptTrace = (AppliedRun, String);

/// Looks at all rows and picks the runs that the campaign keeps.
pub(crate) struct TraceSelection<'a> {
    campaign: &'a Campaign,
    picked: BTreeMap<u64, KeptTrace>,
    /// Per requirement and loop the runs of least margin, in ascending order.
    worst: Vec<[Vec<(f64, AppliedRun)>; 2]>,
}

impl<'a> TraceSelection<'a> {
    /// Nothing picked but the nominal run, if it is wanted.
    pub(crate) fn new(campaign: &'a Campaign) -> Self {
        let mut picked = BTreeMap::new();
        if campaign.traces.keep.contains(&Keep::Nominal) {
            picked.insert(NOMINAL_RUN, ((NOMINAL_RUN, campaign.nominal()), "nominal".to_owned()));
        }
        let worst = campaign.requirements.iter().map(|_| [Vec::new(), Vec::new()]).collect();
        Self { campaign, picked, worst }
    }

    /// Looks at a row at its place among the campaign's runs.
    pub(crate) fn see(&mut self, place: u64, row: &RunRow) {
        for keep in &self.campaign.traces.keep {
            let reason = match keep {
                Keep::Failed if row.status == Status::Fail => "failed",
                Keep::Invalid if row.status == Status::Invalid => "invalid",
                Keep::Random(count) if is_chosen(place, u64::from(*count), self.campaign.runs) => "random",
                Keep::Worst(count) => {
                    Self::see_margins(&mut self.worst, row, *count as usize);
                    continue;
                }
                _ => continue,
            };
            self.picked.entry(row.run).or_insert_with(|| ((row.run, params_of(row)), reason.to_owned()));
        }
    }

    fn see_margins(worst: &mut [[Vec<(f64, AppliedRun)>; 2]], row: &RunRow, count: usize) {
        for (at, worst) in worst.iter_mut().enumerate() {
            for (worst, side) in worst.iter_mut().zip([&row.space, &row.hil]) {
                let Some(margin) = side.requirements[at].margin else { continue };
                // Rows come in order of their runs: of equal margins the first run stays.
                let place = worst.partition_point(|(other, _)| *other <= margin);
                if place < count {
                    worst.insert(place, (margin, (row.run, params_of(row))));
                    worst.truncate(count);
                }
            }
        }
    }

    /// The picked runs; the least margin is the strongest reason.
    pub(crate) fn kept(self) -> Vec<KeptTrace> {
        let mut picked = self.picked;
        for (requirement, worst) in self.campaign.requirements.iter().zip(self.worst).rev() {
            let [in_space, on_facility] = worst;
            for (place, worst) in [(" on the facility", on_facility), ("", in_space)] {
                for (_, run) in worst {
                    picked.insert(run.0, (run, format!("worst {}{place}", requirement.id)));
                }
            }
        }
        picked.into_values().collect()
    }
}

/// Steps the kept runs again and writes their time histories.
pub(crate) fn write_traces(
    folder: &ResultsFolder,
    builder: &RowBuilder,
    provenance: &Provenance,
    index: &ShardIndex,
    kept: Vec<KeptTrace>,
) -> Result<()> {
    kept.into_par_iter().try_for_each(|((run, params), kept_as)| {
        let input = builder.input(run, Some(params))?;
        let (_, trace) = record(builder, folder.campaign.traces.every_ticks, input, kept_as);
        Ok(write_trace(&folder.path, &trace, provenance, index)?)
    })
}

/// Steps one run in f64 and writes down its signals every so many ticks.
pub(crate) fn record(builder: &RowBuilder, every_ticks: u32, input: RunInput, kept_as: String) -> (Finished, Trace) {
    let channels = signals();
    let every = u64::from(every_ticks.max(1));
    let run = input.run;
    let (mut time, mut values, mut tick) = (Vec::new(), vec![Vec::new(); channels.len()], 0);
    let finished = cpu::replay(&builder.job, input, &mut |signals| {
        tick += 1;
        if tick % every == 0 {
            time.push(signals.time);
            for (values, channel) in values.iter_mut().zip(&channels) {
                values.push(Some((channel.of)(signals)));
            }
        }
    });
    let signals = channels.into_iter().zip(values).map(|(channel, values)| Signal {
        name: channel.name,
        unit: channel.unit.to_owned(),
        description: channel.description,
        values,
    });
    (finished, Trace { run, kept_as, time, signals: signals.collect() })
}
