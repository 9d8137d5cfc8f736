//! Files from users, read within bounds: no pipe, device or endless file blocks the program, and no nesting exhausts its stack.
//!
//! Every reader of user input in `host/` opens its files here.

mod depth;
mod error;
mod file;

pub use depth::{MAX_DEPTH, TooDeep, toml_depth, xml_depth};
pub use error::InputError;
pub(crate) use error::Result;
pub use file::{check_regular, decode_text, open, read, read_text};

/// Largest text file that is written by hand: campaigns, scenarios, facilities, robots, URDF \[bytes\].
///
/// TOML takes up to 130 times its size while it is read.
pub const MAX_TEXT: u64 = 4 << 20;

/// Largest table of numbers as text \[bytes\].
pub const MAX_TABLE: u64 = 256 << 20;

/// Largest binary file: a shard, a recording, a log \[bytes\].
pub const MAX_BINARY: u64 = 4 << 30;
