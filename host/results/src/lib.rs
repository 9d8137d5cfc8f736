//! The Parquet contract: files of a campaign, written and read; the only crate that names arrow and parquet.
//!
//! Files hold no time stamp, host or path, so that equal work gives equal bytes; they appear whole or not at all,
//! so that two writers of one shard and a killed writer are normal cases.

pub mod arrow_table;
mod atomic;
pub mod contact_events;
pub mod drive_log;
mod error;
pub mod foreign;
pub mod merge;
pub mod parity;
pub mod partial;
mod read;
pub mod runs;
mod seal;
pub mod shards;
mod table;
pub mod traces;
mod write;

pub use atomic::{ResultFile, is_temporary, remove_abandoned, write_file, write_files};
pub(crate) use error::Result;
pub use error::ResultsError;
pub use read::TableReader;
pub use runs::columns;
pub use seal::{FILE_HASH, hash_files};
pub use table::{Column, ColumnKind, Table, Values};
pub use write::{Metadata, content_hash, write_table};
