//! Files of a session: the log as MCAP and Parquet, the evidence before a stop, `drive.json`.

use crate::answer::{EndedSession, SessionAnswer};
use crate::error::{Result, SessionError};
use crate::plan::{SessionPlan, since_epoch};
use serde::Serialize;
use serde_json::json;
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::params::Params;
use softdock_realtime::drive::core::Unprepared;
use softdock_realtime::log::evidence::{Circumstances, EvidenceBuffer};
use softdock_realtime::log::export::{Cells, cells};
use softdock_realtime::log::mcap::{Attachment, Setup};
use softdock_realtime::log::reader::read_log;
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::log::scene::LoggedScene;
use softdock_realtime::log::topics::default_names;
use softdock_results::Values;
use softdock_results::drive_log::{signal, write_drive_log};
use std::collections::BTreeMap;
use std::fs;
use std::io::BufWriter;
use std::path::Path;

/// Rows of a Parquet part.
const PART: usize = 8192;

/// Returns the parameters of a draw by their names.
pub(crate) fn parameters(params: &Params<f64>) -> serde_json::Map<String, serde_json::Value> {
    let fields = fields::<f64, Params<f64>>().into_iter().zip(to_vec(params));
    fields.map(|(field, value)| (field.name, value.into())).collect()
}

/// Formats a value as indented JSON, its keys in order.
pub(crate) fn readable(value: &impl Serialize) -> Result<String> {
    let value = serde_json::to_value(value).map_err(std::io::Error::from)?;
    Ok(serde_json::to_string_pretty(&value).map_err(std::io::Error::from)?)
}

/// Returns the static contents of the log: scene, files, provenance.
pub(crate) fn log_setup(plan: &SessionPlan) -> Result<Setup> {
    let SessionPlan { campaign, task, options, .. } = plan;
    let started = since_epoch()?;
    let draw = json!({ "run": task.run, "seed": campaign.seed, "parameters": parameters(&task.params) });
    let file =
        |name: &str, data: Vec<u8>| Attachment { name: name.to_owned(), media_type: "text/plain".to_owned(), data };
    let mut provenance = BTreeMap::new();
    for (key, value) in [
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("campaign_id", campaign.id.clone()),
        ("campaign_hash", campaign.hash.clone()),
        ("seed", campaign.seed.to_string()),
        ("run", task.run.to_string()),
        ("repeat", options.repeat.to_string()),
        ("cycle_ns", plan.addresses.cycle()?.0.to_string()),
        ("to_start", task.to_start.to_string()),
        ("armed", task.armed.to_string()),
        ("check_only", task.check_only.to_string()),
        ("retract_m", task.retract.to_string()),
        ("clock", plan.clock_text().to_owned()),
        ("campaign", options.campaign.display().to_string()),
        ("facility", task.station.path().display().to_string()),
    ] {
        provenance.insert(key.to_owned(), value);
    }
    provenance.extend(options.model.iter().map(|model| ("model".to_owned(), model.display().to_string())));
    let axis_names = default_names();
    let scene = LoggedScene::new(&task.plant, &task.station, &axis_names).map_err(Unprepared::from)?;
    Ok(Setup {
        started,
        scene: Some(scene),
        axis_names,
        attachments: vec![
            file("scenario.toml", campaign.scenario.text().as_bytes().to_vec()),
            file("facility.toml", task.station.text().as_bytes().to_vec()),
            file("draw.json", readable(&draw)?.into_bytes()),
        ],
        provenance,
    })
}

/// Writes the last seconds of all signals.
pub(crate) fn write_evidence(plan: &SessionPlan, ended: &EndedSession, evidence: EvidenceBuffer) -> Result<()> {
    let remarks = ended.refusal.map(|refusal| refusal.to_string()).or_else(|| ended.stop_text(plan));
    let circumstances = Circumstances {
        limits: plan.limits_text(),
        clock: plan.clock_text().to_owned(),
        remarks: remarks.unwrap_or_default(),
    };
    let mut file = BufWriter::new(fs::File::create(plan.out.join("evidence.csv"))?);
    Ok(evidence.write(&mut file, &circumstances)?)
}

/// Writes the answer of a session as `drive.json`.
pub(crate) fn write_answer(folder: &Path, answer: &SessionAnswer) -> Result<()> {
    Ok(fs::write(folder.join("drive.json"), readable(answer)?)?)
}

/// Writes a log's records as Parquet, one row per cycle.
pub(crate) fn export(log: &Path, parquet: &Path) -> Result<()> {
    let log = read_log(log)?;
    if log.records.is_empty() {
        let remedy = "the session did not begin: see the evidence";
        return Err(SessionError::refused("the log holds no cycle", remedy));
    }
    let metadata: Vec<(String, String)> = log.prologue.provenance.into_iter().collect();
    write_records(parquet, &log.records, &metadata)
}

/// Writes records as Parquet with metadata.
pub(crate) fn write_records(parquet: &Path, records: &[CycleRecord], metadata: &[(String, String)]) -> Result<()> {
    let parts = records.chunks(PART).map(|records| Ok(table(records)));
    write_drive_log(parquet, parts, metadata)?;
    Ok(())
}

fn table(records: &[CycleRecord]) -> softdock_results::Table {
    let columns = cells(records).into_iter().map(|(column, cells)| {
        let values = match cells {
            Cells::Real(cells) => Values::F64(cells.into_iter().map(|v| v.is_finite().then_some(v)).collect()),
            Cells::Signed(cells) => Values::I64(cells),
            Cells::Whole(cells) => Values::U64(cells),
            Cells::Word(cells) => Values::U32(cells),
            Cells::Code(words, cells) => Values::words(words, cells),
        };
        signal(&column.name, column.unit, &column.meaning, values)
    });
    softdock_results::Table { columns: columns.collect() }
}
