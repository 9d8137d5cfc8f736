//! Output, exit codes and errors of the command.

use clap::Args;
use miette::{IntoDiagnostic, Report, miette};
use serde_json::Value;
use softdock_campaign::Problems;
use softdock_farm::FarmError;
use softdock_results::{ResultFile, write_files};
use softdock_session::SessionError;
use std::fmt::Display;
use std::io::Write;
use std::path::Path;

/// Exit code of a command; the numbers are part of the interface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Exit {
    /// Every requirement is verified; for commands without a verdict, all went well.
    Done = 0,
    /// Some requirement is not verified; for `replay`, the row differs.
    NotVerified = 1,
    /// The input is wrong.
    BadInput = 2,
    /// The campaign is incomplete, a file could not be written, or a session on robots was stopped or refused.
    Incomplete = 3,
}

impl Exit {
    /// Returns the exit that a summary or a comparison states as a number.
    pub(crate) fn of_code(code: u8) -> Self {
        match code {
            0 => Self::Done,
            1 => Self::NotVerified,
            _ => Self::Incomplete,
        }
    }
}

/// An error of a command: its report, and the exit code.
#[derive(Debug)]
pub(crate) struct Failure {
    report: Report,
    exit: Exit,
}

/// Result of a command.
pub(crate) type Outcome = Result<Exit, Failure>;

impl Failure {
    /// Creates a failure with a remedy.
    pub(crate) fn new(message: impl Display, remedy: impl Display) -> Self {
        miette!(help = remedy.to_string(), "{message}").into()
    }

    /// Returns the full report with its remedy.
    pub(crate) fn detail(&self) -> String {
        format!("{:?}", self.report)
    }

    fn with_remedy(message: impl Display, remedy: Option<impl Display>) -> Self {
        remedy.map_or_else(|| miette!("{message}").into(), |remedy| Self::new(&message, remedy))
    }

    /// Creates a failure of an error of another library, with its causes.
    pub(crate) fn of(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        Err::<(), _>(error).into_diagnostic().expect_err("an error").into()
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.report.fmt(f)
    }
}

impl From<Report> for Failure {
    fn from(report: Report) -> Self {
        Self { report, exit: Exit::BadInput }
    }
}

impl From<Problems> for Failure {
    /// Prints all problems but the last, which becomes the failure.
    fn from(problems: Problems) -> Self {
        let mut reports: Vec<Report> = problems.into_iter().map(Report::new).collect();
        let last = reports.pop().unwrap_or_else(|| miette!("the file cannot be used"));
        reports.into_iter().for_each(|report| warn(format!("{report:?}")));
        last.into()
    }
}

impl From<FarmError> for Failure {
    fn from(error: FarmError) -> Self {
        let exit = if error.is_write_failure() { Exit::Incomplete } else { Exit::BadInput };
        match error {
            FarmError::Campaign(problems) => problems.into(),
            error => Self { exit, ..Self::with_remedy(&error, error.remedy()) },
        }
    }
}

impl From<SessionError> for Failure {
    fn from(error: SessionError) -> Self {
        match error {
            SessionError::Files(problems) => problems.into(),
            error if error.remedy().is_some() => Self::with_remedy(&error, error.remedy()),
            error => Self::of(error),
        }
    }
}

impl From<softdock_diagnosis::DiagnosisError> for Failure {
    fn from(error: softdock_diagnosis::DiagnosisError) -> Self {
        Self::new(&error, error.remedy())
    }
}

impl From<softdock_bench::GauntletError> for Failure {
    fn from(error: softdock_bench::GauntletError) -> Self {
        Self::new(&error, error.remedy())
    }
}

/// Prints the error, if there is one; returns the exit code.
pub(crate) fn end(outcome: Outcome) -> u8 {
    let exit = outcome.unwrap_or_else(|failure| {
        warn(failure.detail());
        failure.exit
    });
    exit as u8
}

/// Prints to standard output; ignores a closed pipe (`| head`).
pub(crate) fn print(text: impl Display) {
    let _ = writeln!(std::io::stdout(), "{}", text.to_string().trim_end());
}

/// Prints to standard error.
pub(crate) fn warn(text: impl Display) {
    let _ = writeln!(std::io::stderr(), "{}", text.to_string().trim_end());
}

/// Format of a command's answer.
#[derive(Args, Debug)]
pub(crate) struct Format {
    /// Print the answer as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Format {
    /// Prints the answer as JSON or as text; an empty text is not printed.
    pub(crate) fn print(&self, json: impl FnOnce() -> Value, text: impl FnOnce() -> String) {
        let answer = if self.json { readable(&json()) } else { text() };
        if !answer.is_empty() {
            print(answer);
        }
    }
}

/// Writes the files of a result into a folder; returns their paths, one per line.
pub(crate) fn write(folder: &Path, files: &[ResultFile]) -> Result<String, Failure> {
    let written = write_files(folder, files);
    let written = written.map_err(|error| Failure::new(error, "name a folder that can be written"))?;
    Ok(written.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join("\n"))
}

/// Formats a value as indented JSON.
pub(crate) fn readable(value: &Value) -> String {
    serde_json::to_string_pretty(value).expect("a value has string keys")
}
