//! `softdock serve`: the results folders below a folder in a browser on this machine.
//!
//! Only folders that were found below the served one can be named, by their place in it, and only the pages and figures
//! that softdock writes there can be read.

mod folders;
mod live;
mod pages;

pub use folders::{FoundFolder, found_folders};
pub use pages::ResultsServer;
