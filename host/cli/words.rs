//! How the command ends, and how it speaks.

use miette::{Report, miette};
use softdock_campaign::Problems;
use std::fmt::Display;
use std::io::Write;
use std::process::ExitCode;

/// How a command ended; the numbers are part of the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Exit {
    /// Every requirement is verified; for commands without a verdict, all went well.
    Done = 0,
    /// Some requirement is not verified; for `replay`, the row differs.
    NotVerified = 1,
    /// The input is at fault.
    BadInput = 2,
    /// The campaign is incomplete, or a file could not be written; a session on robots was stopped, or not begun.
    Incomplete = 3,
}

impl Exit {
    /// The end of a number that a summary or a comparison states.
    pub(crate) fn of_code(code: u8) -> Self {
        match code {
            0 => Self::Done,
            1 => Self::NotVerified,
            _ => Self::Incomplete,
        }
    }
}

/// Prints what went wrong, if anything did, and gives the exit code.
pub(crate) fn leave(answer: miette::Result<Exit>) -> ExitCode {
    let exit = answer.unwrap_or_else(|report| {
        warn(format!("{report:?}"));
        if report.downcast_ref::<WriteFailure>().is_some() { Exit::Incomplete } else { Exit::BadInput }
    });
    ExitCode::from(exit as u8)
}

/// Writes the answer; a reader that has seen enough (`| head`) is no error.
pub(crate) fn say(text: impl Display) {
    let _ = writeln!(std::io::stdout(), "{}", text.to_string().trim_end());
}

/// Writes beside the answer.
pub(crate) fn warn(text: impl Display) {
    let _ = writeln!(std::io::stderr(), "{}", text.to_string().trim_end());
}

/// An error with its remedy.
pub(crate) fn refuse(message: impl Display, remedy: impl Display) -> Report {
    miette!(help = remedy.to_string(), "{message}")
}

/// A file that cannot be written: the disk is at fault, not the input.
#[derive(Debug)]
pub(crate) struct WriteFailure {
    message: String,
    remedy: String,
}

impl WriteFailure {
    /// As an error of a command, which then ends with 3.
    pub(crate) fn report(message: impl Display, remedy: impl Display) -> Report {
        Report::new(Self { message: message.to_string(), remedy: remedy.to_string() })
    }
}

impl Display for WriteFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for WriteFailure {}

impl miette::Diagnostic for WriteFailure {
    fn help<'a>(&'a self) -> Option<Box<dyn Display + 'a>> {
        Some(Box::new(&self.remedy))
    }
}

/// All that is wrong with a campaign's files, each with its place; the last one ends the command.
pub(crate) fn explain(problems: Problems) -> Report {
    let mut reports: Vec<Report> = problems.into_iter().map(Report::new).collect();
    let last = reports.pop().unwrap_or_else(|| miette!("the file cannot be used"));
    reports.into_iter().for_each(|report| warn(format!("{report:?}")));
    last
}

/// A value as readable JSON.
pub(crate) fn json(value: &serde_json::Value) -> String {
    serde_json::to_string_pretty(value).expect("a value has string keys")
}
