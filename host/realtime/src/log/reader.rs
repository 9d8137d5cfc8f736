//! Reads a log: restores the same records bit for bit, also from a file whose writer was killed.

use super::mcap::{Attachment, LogError, PROVENANCE};
use super::record::CycleRecord;
use super::table::{LogValue, load};
use super::topics::{CYCLE_TOPIC, DESCRIPTION_TOPIC, Topics, default_names};
use mcap::McapError;
use mcap::records::{Record, SchemaHeader};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::{BTreeMap, HashMap};
use std::io::{BufReader, Read};
use std::path::Path;

/// Greatest length of a record in the file; a longer one is damage.
const LONGEST: usize = 256 << 20;
/// Greatest size of a log that is read into memory: hours of a session \[bytes\].
const MAX_LOG: u64 = 64 << 30;
/// Greatest number of cycles that are read into memory: four hours at 250 Hz; a small file can expand to far more.
const MOST_CYCLES: usize = 4_000_000;
/// Bytes read at a time: a damaged length must not allocate at once.
const READ_BYTES: usize = 1 << 20;

/// Static contents of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Prologue {
    /// URDF of the robots.
    pub robot_description: Option<String>,
    /// Campaign, draw, facility file.
    pub attachments: Vec<Attachment>,
    /// Versions, hashes, seed, clock.
    pub provenance: BTreeMap<String, String>,
}

/// A whole log in memory.
#[derive(Clone, Debug)]
pub struct Log {
    /// Static contents.
    pub prologue: Prologue,
    /// Its records, in the order of the cycles.
    pub records: Vec<CycleRecord>,
    /// Why the file ends early, if it does: the records are those of all chunks before that position.
    pub ends_early: Option<String>,
}

/// Destination of a channel's messages.
#[derive(Clone, Copy)]
enum Target {
    Topic(usize),
    Description,
}

/// Reads a log record by record, in constant memory.
pub struct LogReader<R> {
    source: R,
    linear: LinearReader,
    topics: Topics,
    cycle: usize,
    schemas: HashMap<u16, String>,
    channels: HashMap<u16, Target>,
    blank: Vec<LogValue>,
    values: Vec<LogValue>,
    prologue: Prologue,
    begun: bool,
    over: bool,
    ends_early: Option<String>,
}

/// Reads a whole log.
///
/// # Errors
/// If the file cannot be read or is not the log of a session; a file that ends early is no error.
pub fn read_log(path: &Path) -> Result<Log, LogError> {
    let mut reader = LogReader::new(BufReader::new(softdock_input::open(path, MAX_LOG)?));
    let records = reader.by_ref().take(MOST_CYCLES + 1).collect::<Result<Vec<_>, _>>()?;
    if records.len() > MOST_CYCLES {
        return Err(LogError::Foreign("it holds more than 4,000,000 cycles"));
    }
    Ok(Log { prologue: reader.prologue, records, ends_early: reader.ends_early })
}

impl<R: Read> LogReader<R> {
    /// Opens a log from its bytes.
    pub fn new(source: R) -> Self {
        let options =
            LinearReaderOptions::default().with_prevalidate_chunk_crcs(true).with_record_length_limit(LONGEST);
        let topics = Topics::new(default_names(), None);
        let blank = topics.blank();
        Self {
            source,
            linear: LinearReader::new_with_options(options),
            cycle: topics.position(CYCLE_TOPIC).expect("the cycle's topic"),
            topics,
            schemas: HashMap::new(),
            channels: HashMap::new(),
            values: blank.clone(),
            blank,
            prologue: Prologue::default(),
            begun: false,
            over: false,
            ends_early: None,
        }
    }

    /// Returns the static contents, as far as read; complete once the first record is read.
    pub fn prologue(&self) -> &Prologue {
        &self.prologue
    }

    /// Returns why the file ended early, once all records are read.
    pub fn ends_early(&self) -> Option<&str> {
        self.ends_early.as_deref()
    }

    fn advance(&mut self) -> Result<Option<CycleRecord>, LogError> {
        while !self.over {
            let Some(event) = self.linear.next_event() else {
                self.over = true;
                break;
            };
            match event {
                Ok(LinearReadEvent::ReadRequest(wanted)) => {
                    let count = self.source.read(self.linear.insert(wanted.min(READ_BYTES)))?;
                    self.linear.notify_read(count);
                }
                Ok(LinearReadEvent::Record { data, opcode }) => {
                    self.begun = true;
                    match mcap::parse_record(opcode, data).map(Record::into_owned) {
                        Ok(Record::Message { header, data }) => {
                            if self.message(header.channel_id, &data)? {
                                return Ok(Some(load(&self.values)));
                            }
                        }
                        Ok(other) => self.other(other)?,
                        Err(error) => self.end(error)?,
                    }
                }
                Err(error) => self.end(error)?,
            }
        }
        Ok(None)
    }

    /// Ends at an unreadable position; a file without any MCAP record is an error.
    fn end(&mut self, error: McapError) -> Result<(), LogError> {
        self.over = true;
        if !self.begun && matches!(error, McapError::BadMagic) {
            return Err(error.into());
        }
        self.ends_early = Some(error.to_string());
        Ok(())
    }

    /// Takes a message; returns true if it closes a record.
    fn message(&mut self, channel: u16, data: &[u8]) -> Result<bool, LogError> {
        let damaged = LogError::Foreign("a message does not have the form of its topic");
        match self.channels.get(&channel) {
            Some(Target::Topic(topic)) => {
                self.topics.decode(*topic, data, &mut self.values).ok_or(damaged)?;
                Ok(*topic == self.cycle)
            }
            Some(Target::Description) => {
                let text = super::cdr::Decoder::new(data).and_then(|mut read| read.string()).ok_or(damaged)?;
                self.prologue.robot_description = Some(text.to_owned());
                Ok(false)
            }
            None => Ok(false),
        }
    }

    fn other(&mut self, record: Record) -> Result<(), LogError> {
        match record {
            Record::Schema { header: SchemaHeader { id, .. }, data } => {
                self.schemas.insert(id, String::from_utf8_lossy(&data).into_owned());
            }
            Record::Channel(channel) if channel.topic == DESCRIPTION_TOPIC => {
                self.channels.insert(channel.id, Target::Description);
            }
            Record::Channel(channel) => {
                let Some(topic) = self.topics.position(&channel.topic) else {
                    return Ok(());
                };
                let schema = self.schemas.get(&channel.schema_id).map_or("", String::as_str);
                if topic == self.cycle && !self.topics.adapt(schema) {
                    return Err(LogError::Foreign("a column of /hil/cycle has another type than in this version"));
                }
                self.channels.insert(channel.id, Target::Topic(topic));
            }
            Record::Metadata(metadata) if metadata.name == PROVENANCE => {
                self.prologue.provenance = metadata.metadata;
            }
            Record::Attachment { header, data, .. } => {
                let (name, media_type) = (header.name, header.media_type);
                self.prologue.attachments.push(Attachment { name, media_type, data: data.into_owned() });
            }
            _ => {}
        }
        Ok(())
    }
}

impl<R: Read> Iterator for LogReader<R> {
    type Item = Result<CycleRecord, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.values.copy_from_slice(&self.blank);
        match self.advance() {
            Ok(record) => record.map(Ok),
            Err(error) => {
                self.over = true;
                Some(Err(error))
            }
        }
    }
}

#[cfg(test)]
mod tests;
