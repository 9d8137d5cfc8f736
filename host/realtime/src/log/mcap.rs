//! Writes records to an MCAP file that ROS 2 tools open; after a kill it is readable up to the last chunk.
//!
//! Profile `ros2`, messages in CDR, definitions in `ros2msg`; the run's configuration as attachments, its provenance as
//! the metadata record `softdock`. Each flush closes a chunk, which is then complete at the operating system.

use super::cdr::Encoder;
use super::record::CycleRecord;
use super::scene::LoggedScene;
use super::schemas;
use super::table::{LogValue, store};
use super::topics::{DESCRIPTION_TOPIC, FIXED_FRAMES_TOPIC, Topics, default_names, fixed_frames};
use crate::signals::AXES;
use crate::time::Nanos;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Compression, WriteOptions, Writer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

/// Name of the metadata record with the provenance.
pub const PROVENANCE: &str = "softdock";

/// Size at which a chunk is closed even before its second is over: readers hold a chunk in memory.
const CHUNK_BYTES: u64 = 4 << 20;

/// Error of writing or reading a log.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The operating system reports an error.
    #[error("the log's file: {0}")]
    Io(#[from] io::Error),
    /// The file is absent, not regular, or too large.
    #[error("the log: {0}")]
    Input(#[from] softdock_input::InputError),
    /// Not an MCAP file, or one that cannot be written.
    #[error("the log is not a valid MCAP file: {0}")]
    Mcap(#[from] mcap::McapError),
    /// An MCAP file without a session's log.
    #[error("the MCAP file is not the log of a session: {0}")]
    Foreign(&'static str),
    /// The writing thread has failed.
    #[error("the thread that writes the log has failed: {0}")]
    Panicked(String),
}

/// A file stored in the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Its name (`campaign.toml`).
    pub name: String,
    /// Its media type (`application/toml`).
    pub media_type: String,
    /// Its bytes.
    pub data: Vec<u8>,
}

/// Static contents of a log, written at its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// Start of the session since the Unix epoch.
    pub started: Nanos,
    /// Robots, sensor and parts, for tools that draw them.
    pub scene: Option<LoggedScene>,
    /// Names of the axes of robots 1 and 2, rail last, as the URDF has them.
    pub axis_names: [[String; AXES]; 2],
    /// Campaign, draw, facility file.
    pub attachments: Vec<Attachment>,
    /// Versions, hashes, seed, clock: keys and values.
    pub provenance: BTreeMap<String, String>,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            started: Nanos(0),
            scene: None,
            axis_names: default_names(),
            attachments: Vec::new(),
            provenance: BTreeMap::new(),
        }
    }
}

/// Statistics of a written log.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Records.
    pub records: u64,
    /// Messages of all topics.
    pub messages: u64,
}

/// An open log.
pub struct LogFile<W: Write + Seek> {
    writer: Writer<W>,
    topics: Topics,
    channels: Vec<u16>,
    values: Vec<LogValue>,
    message: Encoder,
    unflushed: u64,
    totals: Totals,
}

impl LogFile<BufWriter<File>> {
    /// Creates a log's file; an existing one is not changed.
    ///
    /// # Errors
    /// If the file exists or cannot be written.
    pub fn create(path: &Path, setup: &Setup) -> Result<Self, LogError> {
        Self::new(BufWriter::with_capacity(1 << 20, File::create_new(path)?), setup)
    }
}

impl<W: Write + Seek> LogFile<W> {
    /// Creates a log on any medium, with its start written and flushed.
    ///
    /// # Errors
    /// If the medium cannot be written.
    pub fn new(medium: W, setup: &Setup) -> Result<Self, LogError> {
        // Level 1 takes half the time of the default level for 1 % more bytes, and less than writing uncompressed. No
        // worker threads in addition to the cycle.
        let options = WriteOptions::new()
            .profile("ros2")
            .library(concat!("softdock ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(1)
            .compression_threads(0)
            .chunk_size(None)
            .disable_seeking(true);
        let mut writer = options.create(medium)?;
        let topics = Topics::new(setup.axis_names.clone(), setup.scene.clone());
        let channels = topics.list().map(|(name, schema)| channel(&mut writer, name, &schema, false));
        let channels = channels.collect::<Result<_, _>>()?;
        let values = topics.blank();
        let mut log = Self {
            writer,
            topics,
            channels,
            values,
            message: Encoder::default(),
            unflushed: 0,
            totals: Totals::default(),
        };
        log.prologue(setup)?;
        Ok(log)
    }

    fn prologue(&mut self, setup: &Setup) -> Result<(), LogError> {
        let time = setup.started.0.max(0) as u64;
        if let Some(scene) = &setup.scene {
            self.message.start();
            self.message.string(&scene.urdf);
            self.latch(DESCRIPTION_TOPIC, &schemas::string(), time)?;
            fixed_frames(&mut self.message, setup.started.0, scene);
            self.latch(FIXED_FRAMES_TOPIC, &schemas::tf_message(), time)?;
        }
        let provenance = Metadata { name: PROVENANCE.to_owned(), metadata: setup.provenance.clone() };
        self.writer.write_metadata(&provenance)?;
        for attachment in &setup.attachments {
            self.writer.attach(&mcap::Attachment {
                log_time: time,
                create_time: time,
                name: attachment.name.clone(),
                media_type: attachment.media_type.clone(),
                data: Cow::Borrowed(&attachment.data),
            })?;
        }
        self.flush()
    }

    /// Writes the message of a latched topic, once.
    fn latch(&mut self, topic: &str, schema: &schemas::Schema, time: u64) -> Result<(), LogError> {
        let id = channel(&mut self.writer, topic, schema, true)?;
        let header = MessageHeader { channel_id: id, sequence: 0, log_time: time, publish_time: time };
        Ok(self.writer.write_to_known_channel(&header, self.message.bytes())?)
    }

    /// Adds a record.
    ///
    /// # Errors
    /// If the medium cannot be written.
    pub fn write(&mut self, record: &CycleRecord) -> Result<(), LogError> {
        store(record, &mut self.values);
        let time = record.time.0.wrapping_add(record.wall_offset.0).max(0) as u64;
        for (topic, id) in self.channels.iter().enumerate() {
            if self.topics.encode(topic, &self.values, &mut self.message) {
                let sequence = self.totals.records as u32;
                let header = MessageHeader { channel_id: *id, sequence, log_time: time, publish_time: time };
                self.writer.write_to_known_channel(&header, self.message.bytes())?;
                self.totals.messages += 1;
                self.unflushed += self.message.bytes().len() as u64;
            }
        }
        self.totals.records += 1;
        if self.unflushed > CHUNK_BYTES {
            self.flush()?;
        }
        Ok(())
    }

    /// Closes the chunk: all records so far survive the end of the program.
    ///
    /// # Errors
    /// If the medium cannot be written.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.unflushed = 0;
        Ok(self.writer.flush()?)
    }

    /// Closes the log with its summary and index.
    ///
    /// # Errors
    /// If the medium cannot be written.
    pub fn finish(mut self) -> Result<(Totals, W), LogError> {
        self.writer.finish()?;
        let mut medium = self.writer.into_inner();
        medium.flush()?;
        Ok((self.totals, medium))
    }
}

/// Registers a topic; a latched one is delivered to late subscribers.
///
/// # Errors
/// If the medium cannot be written.
pub fn channel<W: Write + Seek>(
    writer: &mut Writer<W>,
    topic: &str,
    schema: &schemas::Schema,
    latched: bool,
) -> Result<u16, LogError> {
    let id = writer.add_schema(schema.name, "ros2msg", schema.text.as_bytes())?;
    // As written by rosbag2: durability 1 is transient local, 2 volatile; reliability 1 is reliable; history 1 is keep
    // last.
    let durability = if latched { 1 } else { 2 };
    let profile = format!("- history: 1\n  depth: 1\n  reliability: 1\n  durability: {durability}\n");
    let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), profile)]);
    Ok(writer.add_channel(id, topic, "cdr", &metadata)?)
}
