//! The log of a drive: every signal of the loop, written beside the cycle and readable up to the last second.
//!
//! The cycle fills a [`record::CycleRecord`] and hands it to a [`writer::LogWriter`], which never blocks it; a thread
//! of normal priority writes MCAP ([`mcap`]), and [`reader`] gives the same records back bit for bit. What a record
//! holds is declared once, in [`record`]: the message of the topic `/hil/cycle`, the columns of the Parquet export and
//! the reader follow from it. An [`evidence::EvidenceBuffer`] ring keeps the last seconds apart from all of that.

#[macro_use]
pub mod table;
pub mod cdr;
pub mod codes;
pub mod evidence;
pub mod export;
pub mod mcap;
pub mod reader;
pub mod record;
#[cfg(test)]
pub(crate) mod sample;
pub mod scene;
mod schemas;
pub mod topics;
pub mod writer;
