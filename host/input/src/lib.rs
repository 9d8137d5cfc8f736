//! Reads user files within bounds: no pipe, device or endless file blocks the program, and no nesting exhausts its
//! stack.
//!
//! Every reader of user input in `host/` opens its files here.

mod cell;
mod depth;
mod error;
mod file;

pub use cell::csv_cell;
pub use depth::{MAX_DEPTH, TooDeep, toml_depth, xml_depth};
pub use error::InputError;
pub(crate) use error::Result;
pub use file::{check_regular, decode_text, open, read, read_text};

/// Greatest size of a hand-written text file: campaigns, scenarios, facilities, robots, URDF \[bytes\].
///
/// Parsing TOML needs up to 130 times its size.
pub const MAX_TEXT: u64 = 4 << 20;

/// Greatest size of a table of numbers as text \[bytes\].
pub const MAX_TABLE: u64 = 256 << 20;

/// Greatest size of a binary file: a shard, a recording, a log \[bytes\].
pub const MAX_BINARY: u64 = 4 << 30;
