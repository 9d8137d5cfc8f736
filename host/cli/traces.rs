//! Time histories: which runs are kept, and a run stepped again in f64 with its signals written down.

use crate::folder::Folder;
use crate::parity::spread;
use crate::rows::Ledger;
use miette::IntoDiagnostic;
use rayon::prelude::*;
use softdock_campaign::Campaign;
use softdock_campaign::campaign::Keep;
use softdock_engine::{RunInput, cpu};
use softdock_kernels::fields::from_slice;
use softdock_kernels::outcome::{Finished, Signals};
use softdock_results::runs::{RunRow, Status};
use softdock_results::shards::Provenance;
use softdock_results::traces::{NOMINAL_RUN, Signal, Trace, write_trace};
use std::collections::BTreeMap;

/// A run whose time history is kept, and why.
pub(crate) type Kept = (RunInput, String);

/// Looks at all rows and picks the runs that the campaign keeps.
pub(crate) struct Keeper<'a> {
    campaign: &'a Campaign,
    picked: BTreeMap<u64, Kept>,
    /// Per requirement the runs of least margin, in ascending order.
    worst: Vec<Vec<(f64, RunInput)>>,
}

impl<'a> Keeper<'a> {
    /// Nothing picked but the nominal run, if it is wanted.
    pub(crate) fn new(campaign: &'a Campaign) -> Self {
        let mut picked = BTreeMap::new();
        if campaign.traces.keep.contains(&Keep::Nominal) {
            let input = RunInput { run: NOMINAL_RUN, params: campaign.nominal() };
            picked.insert(NOMINAL_RUN, (input, "nominal".to_owned()));
        }
        Self { campaign, picked, worst: vec![Vec::new(); campaign.requirements.len()] }
    }

    /// Looks at a row at its place among the campaign's runs.
    pub(crate) fn see(&mut self, place: u64, row: &RunRow) {
        for keep in &self.campaign.traces.keep {
            let reason = match keep {
                Keep::Failed if row.status == Status::Fail => "failed",
                Keep::Invalid if row.status == Status::Invalid => "invalid",
                Keep::Random(count) if spread(place, u64::from(*count), self.campaign.runs) => "random",
                Keep::Worst(count) => {
                    Self::see_margins(&mut self.worst, row, *count as usize);
                    continue;
                }
                _ => continue,
            };
            self.picked.entry(row.run).or_insert_with(|| (input_of(row), reason.to_owned()));
        }
    }

    fn see_margins(worst: &mut [Vec<(f64, RunInput)>], row: &RunRow, count: usize) {
        for (worst, outcome) in worst.iter_mut().zip(&row.space_outcomes) {
            let Some(margin) = outcome.margin else { continue };
            // Rows come in order of their runs: of equal margins the first run stays.
            let place = worst.partition_point(|(other, _)| *other <= margin);
            if place < count {
                worst.insert(place, (margin, input_of(row)));
                worst.truncate(count);
            }
        }
    }

    /// The picked runs; the least margin is the strongest reason.
    pub(crate) fn kept(self) -> Vec<Kept> {
        let mut picked = self.picked;
        for (requirement, worst) in self.campaign.requirements.iter().zip(self.worst).rev() {
            for (_, input) in worst {
                picked.insert(input.run, (input, format!("worst {}", requirement.id)));
            }
        }
        picked.into_values().collect()
    }
}

/// A row's run with exactly the inputs that were applied.
pub(crate) fn input_of(row: &RunRow) -> RunInput {
    RunInput { run: row.run, params: from_slice(&row.inputs) }
}

/// Steps the kept runs again and writes their time histories.
pub(crate) fn write_traces(
    folder: &Folder,
    ledger: &Ledger,
    provenance: &Provenance,
    kept: Vec<Kept>,
) -> miette::Result<()> {
    kept.into_par_iter().try_for_each(|(input, kept_as)| {
        let (_, trace) = record(ledger, folder.campaign.traces.every_ticks, input, kept_as);
        write_trace(&folder.path, &trace, provenance).into_diagnostic()
    })
}

/// Name, unit and meaning of a signal, and where it is found.
type Channel = (String, &'static str, String, Box<dyn Fn(&Signals) -> f64>);

/// Steps one run in f64 and writes down its signals every so many ticks.
pub(crate) fn record(ledger: &Ledger, every_ticks: u32, input: RunInput, kept_as: String) -> (Finished, Trace) {
    let channels = channels();
    let every = u64::from(every_ticks.max(1));
    let (mut time, mut values, mut tick) = (Vec::new(), vec![Vec::new(); channels.len()], 0);
    let finished = cpu::replay(&ledger.job, input, &mut |signals| {
        tick += 1;
        if tick % every == 0 {
            time.push(signals.time);
            for (values, channel) in values.iter_mut().zip(&channels) {
                values.push(Some((channel.3)(signals)));
            }
        }
    });
    let signals = channels.into_iter().zip(values).map(|((name, unit, description, _), values)| Signal {
        name,
        unit: unit.to_owned(),
        description,
        values,
    });
    (finished, Trace { run: input.run, kept_as, time, signals: signals.collect() })
}

/// All signals of a trace.
fn channels() -> Vec<Channel> {
    let mut all: Vec<Channel> = Vec::new();
    for (index, (prefix, place)) in
        [("space", "in space"), ("hil", "on the facility's hardware"), ("fed_back", "as fed back to the simulation")]
            .into_iter()
            .enumerate()
    {
        let axes = if index == 2 { "part A's axes" } else { "inertial axes" };
        let force = format!("magnitude of the force of contact and latch on part A, {place}");
        all.push((format!("{prefix}_force_n"), "N", force, Box::new(move |s| s.wrench[index].force.norm())));
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let force = format!("{letter} of the force on part A, {axes}, {place}");
            let moment = format!("{letter} of the moment on part A about its origin, {axes}, {place}");
            let of = move |v: softdock_kernels::vector::Vec3<f64>| [v.x, v.y, v.z][axis];
            all.push((format!("{prefix}_force_{letter}_n"), "N", force, Box::new(move |s| of(s.wrench[index].force))));
            all.push((
                format!("{prefix}_moment_{letter}_n_m"),
                "N m",
                moment,
                Box::new(move |s| of(s.wrench[index].moment)),
            ));
        }
    }
    for (index, (prefix, place)) in
        [("space", "in space"), ("hil", "in the facility's simulation")].into_iter().enumerate()
    {
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let of = move |v: softdock_kernels::vector::Vec3<f64>| [v.x, v.y, v.z][axis];
            let from = format!("part A's origin from part B's, {letter}, inertial axes, {place}");
            let speed = format!("velocity of part A's origin less part B's, {letter}, inertial axes, {place}");
            let position = move |s: &Signals| of(s.parts[index].a.position - s.parts[index].b.position);
            let velocity = move |s: &Signals| of(s.parts[index].a.velocity - s.parts[index].b.velocity);
            all.push((format!("{prefix}_relative_position_{letter}_m"), "m", from, Box::new(position)));
            all.push((format!("{prefix}_relative_velocity_{letter}_m_per_s"), "m/s", speed, Box::new(velocity)));
        }
        let latch = format!("1 while the latch is closed, {place}");
        all.push((format!("{prefix}_latched"), "1", latch, Box::new(move |s| s.closed[index])));
    }
    all
}
