//! Inputs that are given instead of drawn: tables of the user, and the failed runs of a results folder.

use crate::args::RunArgs;
use crate::folder::{Folder, normal};
use crate::variants::refuse_whole;
use crate::words::{explain, refuse, warn};
use miette::IntoDiagnostic;
use softdock_campaign::requirement::{Requirement, Subject};
use softdock_campaign::{Campaign, Cases};
use softdock_results::foreign::{column_names, number_columns};
use softdock_results::runs::requirement_columns;
use softdock_results::shards::ShardIndex;
use softdock_results::{Column, Kind, Table, Values, write_table};
use std::path::{Path, PathBuf};

/// Reads a table of cases: Parquet by its extension, else CSV.
pub(crate) fn read(path: &Path) -> miette::Result<Cases> {
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("parquet")) {
        return Cases::of_csv(path).map_err(explain);
    }
    let unreadable =
        |error: &dyn std::fmt::Display| refuse(error, "name a CSV or Parquet file with a column per parameter");
    let bytes =
        softdock_input::read(path, softdock_input::MAX_BINARY).map_err(|error| refuse(&error, error.remedy()))?;
    let names = column_names(path).map_err(|error| unreadable(&error))?;
    let columns = |names: &[&str]| number_columns(path, names).map_err(|error| error.to_string());
    Cases::of_columns(path, bytes, &names, columns).map_err(explain)
}

/// Reports what a table gives.
pub(crate) fn tell(cases: &Cases) {
    let names = cases.parameters();
    let aside = match cases.left_aside() {
        0 => String::new(),
        count => format!("; {count} columns of results are left aside"),
    };
    let numbers = if cases.is_numbered() { "run numbers of the table" } else { "run numbers from 0" };
    warn(format!("given cases  {} runs, {} parameters, {numbers}{aside}", cases.len(), names.len()));
}

/// The failed runs of `--only-failed` as a campaign on given cases, with its results folder; `None` if no run failed.
pub(crate) fn failed_runs(args: &RunArgs) -> miette::Result<Option<(Campaign, PathBuf)>> {
    let Some(results) = &args.only_failed else {
        return Err(refuse("no campaign is named", "write softdock run CAMPAIGN, or --only-failed DIR"));
    };
    let folder = Folder::open(results)?;
    refuse_whole(&folder)?;
    let index = folder.shards()?;
    if !index.is_complete() {
        let (done, planned) = (index.complete.len(), index.plan.shards());
        let message = format!("`{}` has {done} of {planned} shards", results.display());
        return Err(refuse(message, "finish the campaign first, with the command that began it"));
    }
    let name = results.file_name().map_or_else(|| "results".to_owned(), |name| name.to_string_lossy().into_owned());
    let out = args.out.clone().unwrap_or_else(|| results.with_file_name(format!("{name}_failed")));
    if normal(&out) == normal(results) {
        let message = format!("`{}` holds the runs that are to be repeated", out.display());
        return Err(refuse(message, "write --out DIR with a folder of its own"));
    }
    let (table, counts) = failed_table(&index, &folder.campaign.requirements)?;
    let all = folder.campaign.runs;
    if table.rows() == 0 {
        warn(format!("{}  none of {all} runs failed: nothing to repeat", folder.campaign.id));
        return Ok(None);
    }
    let [space, facility, invalid] = counts;
    warn(format!(
        "{}  {} of {all} runs are repeated: {space} failed in space, {facility} on the facility, {invalid} invalid",
        folder.campaign.id,
        table.rows()
    ));
    let temporary = tempfile::tempdir().into_diagnostic()?;
    let file = temporary.path().join("cases.parquet");
    write_table(&file, &table, &[]).into_diagnostic()?;
    let campaign = folder.campaign.with_cases(read(&file)?).map_err(explain)?;
    Ok(Some((campaign, out)))
}

/// Numbers and inputs of the runs that did not pass, and how many failed in space, on the facility, or are invalid.
fn failed_table(index: &ShardIndex, requirements: &[Requirement]) -> miette::Result<(Table, [u64; 3])> {
    let all = index.columns().into_diagnostic()?;
    let named = |is: &dyn Fn(&Column) -> bool| -> Vec<String> {
        all.columns.iter().filter(|column| is(column)).map(|column| column.name.clone()).collect()
    };
    let on_space = requirements.iter().filter(|requirement| requirement.subject == Subject::Space);
    let passes = [
        on_space
            .map(|requirement| {
                let [_, pass] = requirement_columns("space", &requirement.column_id());
                pass
            })
            .collect::<Vec<_>>(),
        named(&|c| c.kind == Kind::Verdict && c.name.starts_with("hil_")),
    ];
    let inputs = named(&|column| column.kind == Kind::Input);
    let fixed = ["run", "status", "agreement"].map(str::to_owned);
    let names: Vec<String> = fixed.iter().chain(passes.iter().flatten()).chain(&inputs).cloned().collect();
    let (mut runs, mut values, mut counts) = (Vec::new(), vec![Vec::new(); inputs.len()], [0; 3]);
    for batch in index.read_columns(&names) {
        let batch = batch.into_diagnostic()?;
        let word = |name: &str, row| batch.column(name).and_then(|column| column.values.word(row)).unwrap_or_default();
        for (row, run) in batch.u64s("run").unwrap_or_default().iter().enumerate() {
            let invalid = word("status", row) == "invalid";
            let holds = |name: &String| batch.bools(name).is_some_and(|passes| passes[row] == Some(true));
            let agreement = word("agreement", row);
            // With requirements they decide; the task itself does where there are none.
            let task = [&["true_pass", "false_fail", "aborted_pass"][..], &["true_pass", "false_pass"][..]];
            let [space, facility] = [0, 1].map(|side: usize| match passes[side].as_slice() {
                [] => task[side].contains(&agreement),
                passes => passes.iter().all(holds),
            });
            if space && facility && !invalid {
                continue;
            }
            counts[0] += u64::from(!space && !invalid);
            counts[1] += u64::from(!facility && !invalid);
            counts[2] += u64::from(invalid);
            runs.push(*run);
            for (values, name) in values.iter_mut().zip(&inputs) {
                values.push(batch.f64s(name).and_then(|column| column[row]));
            }
        }
    }
    let described = |name: &str, values| {
        let column = all.column(name).expect("a column of the table");
        Column { values, ..column.clone() }
    };
    let columns = std::iter::once(described("run", Values::U64(runs)));
    let inputs = inputs.iter().zip(values).map(|(name, values)| described(name, Values::F64(values)));
    Ok((Table { columns: columns.chain(inputs).collect() }, counts))
}
