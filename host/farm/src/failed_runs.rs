//! The runs of a results folder that failed, as given cases of a campaign.

use crate::cases::read_cases;
use crate::error::{FarmError, Result, writing};
use crate::folder::ResultsFolder;
use crate::observer::{Context, Note};
use crate::paths::normal;
use softdock_campaign::Campaign;
use softdock_campaign::requirement::{Requirement, Subject};
use softdock_results::columns::{AGREEMENT, ColumnError, ColumnHandle, Loop, RUN, STATUS};
use softdock_results::runs::Status;
use softdock_results::shards::ShardIndex;
use softdock_results::{Column, ColumnKind, Table, Values, write_table};
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
    let on_space = requirements.iter().filter(|requirement| requirement.subject == Subject::Space);
    let on_facility = all.columns.iter().filter_map(|column| match Loop::of_pass(&column.name) {
        Some((Loop::Hil, id)) => Some(Loop::Hil.pass(id)),
        Some((Loop::Space, _)) | None => None,
    });
    let passes: [Vec<ColumnHandle<bool>>; 2] =
        [on_space.map(|requirement| Loop::Space.pass(&requirement.column_id())).collect(), on_facility.collect()];
    let inputs = all.columns.iter().filter(|column| column.kind == ColumnKind::Input);
    let inputs: Vec<ColumnHandle<f64>> = inputs.map(|column| ColumnHandle::named(column.name.clone())).collect();
    let fixed = [RUN.name(), STATUS.name(), AGREEMENT.name()].into_iter();
    let names =
        fixed.chain(passes.iter().flatten().map(ColumnHandle::name)).chain(inputs.iter().map(ColumnHandle::name));
    let names: Vec<String> = names.map(str::to_owned).collect();
    let (mut runs, mut values, mut counts) = (Vec::new(), vec![Vec::new(); inputs.len()], [0; 3]);
    for batch in index.read_columns(&names) {
        let batch = batch?;
        let misfit = |error: ColumnError| FarmError::refused(error.to_string(), "make the folder again");
        let (run, status) = (batch.get(&RUN).map_err(misfit)?, batch.get(&STATUS).map_err(misfit)?);
        let agreement = batch.get(&AGREEMENT).map_err(misfit)?;
        let read = |columns: &[ColumnHandle<bool>]| columns.iter().map(|column| batch.get(column)).collect();
        let [in_space, on_facility]: [std::result::Result<Vec<_>, _>; 2] = [read(&passes[0]), read(&passes[1])];
        let verdicts = [in_space.map_err(misfit)?, on_facility.map_err(misfit)?];
        let numbers = inputs.iter().map(|column| batch.get(column)).collect::<std::result::Result<Vec<_>, _>>();
        let numbers = numbers.map_err(misfit)?;
        for (row, run) in run.iter().enumerate() {
            let invalid = status.at(row) == Status::Invalid;
            // The requirements decide; without any, the task does.
            let task = [agreement.at(row).space_passes(), agreement.at(row).facility_passes()];
            let [space, facility] = [0, 1].map(|side: usize| match verdicts[side].as_slice() {
                [] => task[side] == Some(true),
                verdicts => verdicts.iter().all(|passes| passes[row] == Some(true)),
            });
            if space && facility && !invalid {
                continue;
            }
            counts[0] += u64::from(!space && !invalid);
            counts[1] += u64::from(!facility && !invalid);
            counts[2] += u64::from(invalid);
            runs.push(*run);
            for (values, column) in values.iter_mut().zip(&numbers) {
                values.push(column[row]);
            }
        }
    }
    let described = |name: &str, values| {
        let column = all.column(name).expect("a column of the table");
        Column { values, ..column.clone() }
    };
    let columns = std::iter::once(described(RUN.name(), Values::U64(runs)));
    let inputs = inputs.iter().zip(values).map(|(name, values)| described(name.name(), Values::F64(values)));
    Ok((Table { columns: columns.chain(inputs).collect() }, counts))
}
