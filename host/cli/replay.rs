//! `softdock replay`: one row made again in f64, from exactly the inputs that stand in it.

use crate::args::ReplayArgs;
use crate::farm::Farm;
use crate::folder::Folder;
use crate::traces::{input_of, record};
use crate::variants::refuse_whole;
use crate::words::{Exit, refuse, say};
use miette::IntoDiagnostic;
use softdock_analysis::number::with_unit;
use softdock_engine::Choice;
use softdock_kernels::metrics::flags;
use softdock_results::runs::{RunRow, RunsSchema};
use softdock_results::traces::write_trace_to;
use softdock_results::{Column, Table, Values, content_hash};

/// Repeats a run.
pub(crate) fn replay(args: &ReplayArgs) -> miette::Result<Exit> {
    let (Some(results), Some(run)) = (&args.results, args.run) else {
        return crate::replay_log::replay_log(args);
    };
    let folder = Folder::open(results)?;
    refuse_whole(&folder)?;
    let row = folder.shards()?.read_run(run).into_diagnostic()?.ok_or_else(|| {
        let message = format!("`{}` holds no run {}", folder.path.display(), run);
        let remedy = match folder.campaign.cases() {
            Some(_) => "its table of cases names the runs".to_owned(),
            None => format!("the campaign has the runs 0 to {}", folder.campaign.runs - 1),
        };
        refuse(message, remedy)
    })?;
    let in_f64 = row.flags & flags::RETRIED != 0 || made_on_cpu(&folder, run)?;
    let truth = Farm::open(&folder.campaign, Choice::Cpu).map_err(crate::run::unusable)?;
    let (finished, trace) =
        record(&truth.ledger, folder.campaign.traces.every_ticks, input_of(&row), "replay".to_owned());
    let mut again = truth.ledger.row(&finished);
    again.flags |= row.flags & flags::RETRIED;
    let differences = differences(&truth.ledger.schema, &row, &again);
    let name = format!("run={:09}.parquet", run);
    let path = args.out.clone().unwrap_or_else(|| folder.path.join("replays").join(name));
    write_trace_to(&path, &trace, &truth.provenance()).into_diagnostic()?;
    match (differences.is_empty(), in_f64) {
        (true, _) => say(format!("run {}: equal, bit for bit", run)),
        (false, true) => say(format!("run {}: DIFFERENT from what the same f64 code gave before", run)),
        (false, false) => say(format!("run {}: made in f32, here beside f64", run)),
    }
    differences.iter().for_each(say);
    say(format!("time history  {}", path.display()));
    Ok(if in_f64 && !differences.is_empty() { Exit::NotVerified } else { Exit::Done })
}

fn made_on_cpu(folder: &Folder, run: u64) -> miette::Result<bool> {
    let place = folder.campaign.place_of(run).unwrap_or(run);
    let shard = (place / folder.campaign.execution.shard_runs) as u32;
    Ok(folder.shards()?.complete.get(&shard).is_some_and(|file| file.backend == "cpu"))
}

/// The columns whose bits differ, each with both values.
fn differences(schema: &RunsSchema, row: &RunRow, again: &RunRow) -> Vec<String> {
    let [one, two] = [row, again].map(|row| schema.table(std::slice::from_ref(row)));
    let bits = |column: &Column| content_hash(&Table { columns: vec![column.clone()] });
    let pairs = one.columns.iter().zip(&two.columns).filter(|(one, two)| bits(one) != bits(two));
    pairs.map(|(one, two)| format!("  {}: {} in the row, {} now", one.name, shown(one), shown(two))).collect()
}

/// The only value of a column.
fn shown(column: &Column) -> String {
    match &column.values {
        Values::F64(values) => values[0].map_or("none".to_owned(), |value| with_unit(value, &column.unit)),
        Values::Bool(values) => format!("{:?}", values[0]),
        Values::U32(values) => values[0].to_string(),
        Values::U64(values) => values[0].to_string(),
        Values::I64(values) => values[0].to_string(),
        Values::Words { .. } => column.values.word(0).unwrap_or_default().to_owned(),
    }
}
