//! The runs of a results folder that failed, as given cases of a campaign.

use crate::cases::read_cases;
use crate::error::{FarmError, Result, writing};
use crate::folder::ResultsFolder;
use crate::observer::{Context, Note};
use crate::paths::normal;
use softdock_campaign::Campaign;
use softdock_campaign::requirement::{Requirement, Subject};
use softdock_results::runs::requirement_columns;
use softdock_results::shards::ShardIndex;
use softdock_results::{Column, Kind, Table, Values, write_table};
use std::path::{Path, PathBuf};

/// Returns the failed and invalid runs of a finished results folder as a campaign on given cases; `None` if there are
/// none.
///
/// # Errors
/// If the folder cannot be read, holds variants, or is not complete.
pub fn failed_runs(results: &Path, context: Context) -> Result<Option<Campaign>> {
    let folder = ResultsFolder::open(results)?;
    folder.refuse_variants()?;
    let index = folder.shards()?;
    if !index.is_complete() {
        let (done, planned) = (index.complete.len(), index.plan.shards());
        let message = format!("`{}` has {done} of {planned} shards", results.display());
        return Err(FarmError::refused(message, "finish the campaign first, with the command that began it"));
    }
    let (table, counts) = failed_table(&index, &folder.campaign.requirements)?;
    let (campaign, all) = (folder.campaign.id.clone(), folder.campaign.runs);
    context.note(Note::FailedRuns { campaign, all, repeated: table.rows(), counts });
    if table.rows() == 0 {
        return Ok(None);
    }
    let temporary = tempfile::tempdir().map_err(writing(&std::env::temp_dir()))?;
    let file = temporary.path().join("cases.parquet");
    write_table(&file, &table, &[])?;
    Ok(Some(folder.campaign.with_cases(read_cases(&file)?)?))
}

/// Results folder of the failed runs of another one, if none is named: `DIR_failed` beside `DIR`.
///
/// # Errors
/// If the folder that is named is the one whose runs are repeated.
pub fn failed_results(results: &Path, out: Option<&Path>) -> Result<PathBuf> {
    let name = results.file_name().map_or_else(|| "results".to_owned(), |name| name.to_string_lossy().into_owned());
    let out = out.map_or_else(|| results.with_file_name(format!("{name}_failed")), Path::to_owned);
    if normal(&out) == normal(results) {
        let message = format!("`{}` holds the runs that are to be repeated", out.display());
        return Err(FarmError::refused(message, "write --out DIR with a folder of its own"));
    }
    Ok(out)
}

/// Numbers and inputs of the runs that did not pass, and how many failed in space, on the facility, or are invalid.
fn failed_table(index: &ShardIndex, requirements: &[Requirement]) -> Result<(Table, [u64; 3])> {
    let all = index.columns()?;
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
        let batch = batch?;
        let word = |name: &str, row| batch.column(name).and_then(|column| column.values.word(row)).unwrap_or_default();
        for (row, run) in batch.u64s("run").unwrap_or_default().iter().enumerate() {
            let invalid = word("status", row) == "invalid";
            let holds = |name: &String| batch.bools(name).is_some_and(|passes| passes[row] == Some(true));
            let agreement = word("agreement", row);
            // The requirements decide; without any, the task does.
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
