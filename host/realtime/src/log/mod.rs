//! The log of a session: every signal of the loop, written in parallel to the cycle and readable up to the last second.
//!
//! The cycle fills a [`record::CycleRecord`] and passes it to a [`writer::LogWriter`], which never blocks it; a thread
//! of normal priority writes MCAP ([`mcap`]), and [`reader`] restores the same records bit for bit. [`record`] declares
//! the signals once: the message of the topic `/hil/cycle`, the columns of the Parquet export and the reader follow
//! from it. An [`evidence::EvidenceBuffer`] keeps the last seconds independently of these.

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
pub mod schemas;
pub mod topics;
pub mod writer;
