//! Time histories: runs repeated in f64 with recorded signals.

use crate::error::Result;
use crate::folder::ResultsFolder;
use crate::rows::RowBuilder;
use crate::run_selection::KeptRun;
use crate::signals::signals;
use rayon::prelude::*;
use softdock_engine::{RunInput, cpu};
use softdock_kernels::outcome::Finished;
use softdock_results::shards::{Provenance, ShardIndex};
use softdock_results::traces::{Signal, Trace, write_trace};

/// Steps the kept runs again and writes their time histories.
pub(crate) fn write_traces(
    folder: &ResultsFolder,
    builder: &RowBuilder,
    provenance: &Provenance,
    index: &ShardIndex,
    kept: Vec<KeptRun>,
) -> Result<()> {
    kept.into_par_iter().try_for_each(|((run, params), kept_as)| {
        let input = builder.input(run, Some(params))?;
        let (_, trace) = record(builder, folder.campaign.traces.every_ticks, input, kept_as);
        Ok(write_trace(&folder.path, &trace, provenance, index)?)
    })
}

/// Steps one run in f64 and writes down its signals every so many ticks.
pub(crate) fn record(builder: &RowBuilder, every_ticks: u32, input: RunInput, kept_as: String) -> (Finished, Trace) {
    let channels = signals(input.plant.as_deref().unwrap_or(&builder.job.plant));
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
