//! Contact events of kept runs: `contact_events.parquet`, one row per event of either loop.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use softdock_kernels::outcome::ContactEvent;
use softdock_kernels::vector::Vec3;

use crate::read::TableReader;
use crate::shards::{Provenance, ShardIndex};
use crate::table::{Column, ColumnKind, Table, Values};
use crate::traces::NOMINAL_RUN;
use crate::write::write_batches;
use crate::{Result, ResultsError};

/// Version of the table.
pub const CONTACT_EVENTS_SCHEMA: &str = "contact_events/1";

/// Name of the file below a results folder.
pub const CONTACT_EVENTS_FILE: &str = "contact_events.parquet";

/// Words of the column `loop`: in space, on the facility.
pub const LOOP_WORDS: [&str; 2] = ["space", "hil"];

/// One contact event of a kept run.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactEventRow {
    /// Run number, or [`NOMINAL_RUN`].
    pub run: u64,
    /// Why the run was kept: `failed`, `worst ARM-CON-110`, `random`, `all` ...
    pub kept_as: String,
    /// The loop, as an index of [`LOOP_WORDS`].
    pub side: usize,
    /// Number of the event in its run and loop, from 1, in the order of the touches.
    pub number: u32,
    /// Key and name in the scenario of what touches, of part A and of part B; the name is empty without one.
    pub members: [[String; 2]; 2],
    /// Key of the material pair in the scenario.
    pub pair: String,
    /// What happened.
    pub event: ContactEvent,
}

/// What a file states of its content besides the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEventFacts {
    /// Number of runs that were kept, those without a contact among them.
    pub kept_runs: u64,
    /// Separations of at most this time did not end an event \[s\].
    pub merge_gap: f64,
}

/// Path of the contact events below a results folder.
pub fn contact_events_path(results: &Path) -> PathBuf {
    results.join(CONTACT_EVENTS_FILE)
}

/// The table of events; without any it has the columns alone.
pub fn contact_event_table(rows: &[ContactEventRow]) -> Table {
    let mut columns = Columns { rows, columns: Vec::new() };
    columns.names();
    columns.numbers();
    Table { columns: columns.columns }
}

/// The columns of a table under construction.
struct Columns<'a> {
    rows: &'a [ContactEventRow],
    columns: Vec<Column>,
}

impl Columns<'_> {
    fn push(&mut self, name: &str, unit: &str, description: &str, kind: ColumnKind, values: Values) {
        let (name, unit, description) = (name.to_owned(), unit.to_owned(), description.to_owned());
        self.columns.push(Column { name, unit, description, source: "engine".to_owned(), kind, values });
    }

    fn words(&mut self, name: &str, description: &str, kind: ColumnKind, of: fn(&ContactEventRow) -> &str) {
        let values = Values::words_of(self.rows.iter().map(of));
        self.push(name, "1", description, kind, values);
    }

    fn number(&mut self, name: &str, unit: &str, description: &str, of: impl Fn(&ContactEvent) -> f64) {
        let values = Values::F64(self.rows.iter().map(|row| Some(of(&row.event))).collect());
        self.push(name, unit, description, ColumnKind::Metric, values);
    }

    fn vector(&mut self, [name, suffix]: [&str; 2], unit: &str, description: &str, of: fn(&ContactEvent) -> Vec3<f64>) {
        for (index, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let (name, description) = (format!("{name}_{axis}{suffix}"), format!("{axis} of {description}"));
            self.number(&name, unit, &description, move |event| {
                let v = of(event);
                [v.x, v.y, v.z][index]
            });
        }
    }

    /// What names a row, and why it is there.
    fn names(&mut self) {
        let rows = self.rows;
        let run = format!("run number; {NOMINAL_RUN} is the nominal case");
        self.push("run", "1", &run, ColumnKind::Key, Values::U64(rows.iter().map(|row| row.run).collect()));
        let sides = Values::words(&LOOP_WORDS, rows.iter().map(|row| row.side as u32).collect());
        self.push("loop", "1", "space, or hil: the loop on the facility", ColumnKind::Key, sides);
        let number = "number of the event in its run and loop, from 1, in the order of the touches";
        self.push("event", "1", number, ColumnKind::Key, Values::U32(rows.iter().map(|row| row.number).collect()));
        let key = |part: &str| {
            format!("point or solid of part {part} that touches, by its key in the scenario file; entries count from 1")
        };
        let name = "its name in the scenario file; empty without one";
        self.words("part_a", &key("A"), ColumnKind::Key, |row| &row.members[0][0]);
        self.words("part_a_name", name, ColumnKind::Key, |row| &row.members[0][1]);
        self.words("part_b", &key("B"), ColumnKind::Key, |row| &row.members[1][0]);
        self.words("part_b_name", name, ColumnKind::Key, |row| &row.members[1][1]);
        let pair =
            "law of the contact, by its key in the scenario file: contact.pair[N], or contact for the common law";
        self.words("pair", pair, ColumnKind::Key, |row| &row.pair);
        self.words("kept_as", "why the run was kept", ColumnKind::Status, |row| &row.kept_as);
    }

    /// What happened.
    fn numbers(&mut self) {
        self.number("start_s", "s", "time of the first substep with a contact force", |event| event.start);
        self.number("duration_s", "s", "from the start to the end of the last substep with a contact force", |event| {
            event.duration
        });
        self.number("peak_time_s", "s", "time of the greatest contact force", |event| event.peak_time);
        let place = "the most loaded point's place at that time, from part B's origin; frame: part B's axes";
        self.vector(["place", "_m"], "m", place, |event| event.place);
        let normal = "the unit normal there, out of part B; frame: part B's axes";
        self.vector(["normal", ""], "1", normal, |event| event.normal);
        let force = "greatest magnitude of the contact force, friction included, latch excluded";
        self.number("peak_force_n", "N", force, |event| event.peak_force);
        let force = "greatest sum of the normal forces of the event's points; positive pushes the parts apart";
        self.number("peak_normal_force_n", "N", force, |event| event.peak_normal_force);
        let impulse = "the integral of the contact force on part A; frame: inertial axes in space, laboratory axes on the \
                       facility, which are parallel to them";
        self.vector(["impulse", "_n_s"], "N s", impulse, |event| event.impulse);
        let slip = "path of sliding beyond the deflection of the bristle; of several points their mean, weighted by the \
                    normal forces";
        self.number("slip_m", "m", slip, |event| event.slip);
        let work = "work of the contact force on both parts; negative: energy that the contact has taken";
        self.number("work_j", "J", work, |event| event.work);
        self.number("depth_m", "m", "greatest overlap", |event| event.depth);
        let speed = "speed at which the touching parts approach along the normal in the first substep";
        self.number("closing_speed_m_per_s", "m/s", speed, |event| event.closing_speed);
        let open = Values::Bool(self.rows.iter().map(|row| Some(row.event.is_open)).collect());
        self.push("open", "1", "the parts still touched when the loop ended", ColumnKind::Status, open);
    }
}

/// Writes the contact events of kept runs of the shards of a results folder, part by part, so that memory stays flat.
///
/// # Errors
/// The first error among the parts, and then no file is written; or if the file cannot be written.
pub fn write_contact_events<E: From<ResultsError>>(
    results: &Path,
    facts: ContactEventFacts,
    parts: impl Iterator<Item = std::result::Result<Vec<ContactEventRow>, E>>,
    provenance: &Provenance,
    index: &ShardIndex,
) -> std::result::Result<(), E> {
    let path = contact_events_path(results);
    let mut metadata = provenance.metadata(CONTACT_EVENTS_SCHEMA);
    metadata.push(("softdock.kept_runs".to_owned(), facts.kept_runs.to_string()));
    metadata.push(("softdock.merge_gap_s".to_owned(), facts.merge_gap.to_string()));
    metadata.extend(index.stated_rows());
    let mut failed = None;
    let tables = parts.map(|part| match part {
        Ok(rows) => Ok(Cow::Owned(contact_event_table(&rows))),
        Err(error) => {
            failed = Some(error);
            Err(ResultsError::contract(&path, "the events of a run are missing"))
        }
    });
    // The columns are there without any event.
    let first = std::iter::once(Ok(Cow::Owned(contact_event_table(&[]))));
    let written = write_batches(&path, first.chain(tables), &metadata);
    match failed {
        Some(error) => Err(error),
        None => Ok(written?),
    }
}

/// The contact events of a results folder, if it has any; see [`contact_event_table`] for the columns.
///
/// # Errors
/// If the file is damaged, or was made from other runs than those of the index.
pub fn read_contact_events(results: &Path, index: &ShardIndex) -> Result<Option<Table>> {
    verified(results, index)?.map(TableReader::read).transpose()
}

/// Verifies the file of contact events of a results folder, if it has one: its bytes and its origin.
///
/// # Errors
/// If the file is damaged, or was made from other runs than those of the index.
pub fn check_contact_events(results: &Path, index: &ShardIndex) -> Result<()> {
    verified(results, index).map(drop)
}

fn verified(results: &Path, index: &ShardIndex) -> Result<Option<TableReader>> {
    let path = contact_events_path(results);
    if !path.exists() {
        return Ok(None);
    }
    let reader = TableReader::open(&path)?;
    index.check_origin(&path, &reader.metadata(), CONTACT_EVENTS_SCHEMA)?;
    Ok(Some(reader))
}
