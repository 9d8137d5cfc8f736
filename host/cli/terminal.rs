//! Output, exit codes and errors of the command.

use anstyle::{AnsiColor, Style};
use indicatif::ProgressBar;
use miette::{IntoDiagnostic, MietteHandler, MietteHandlerOpts, Report, ReportHandler, miette};
use serde_json::Value;
use softdock_campaign::Problems;
use softdock_farm::FarmError;
use softdock_results::{ResultFile, write_files};
use softdock_session::SessionError;
use std::fmt::Display;
use std::io::Write;
use std::path::Path;
use std::sync::Mutex;

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
        report_text(&self.report)
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
        reports.iter().for_each(|report| warn(report_text(report)));
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

/// Formats a report with its source lines and its remedy, without colours: those come with the printing.
pub fn report_text(report: &Report) -> String {
    struct Shown<'a>(MietteHandler, &'a Report);
    impl std::fmt::Debug for Shown<'_> {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            self.0.debug(self.1.as_ref(), f)
        }
    }
    let handler = MietteHandlerOpts::new().color(false).terminal_links(false).build();
    format!("{:?}", Shown(handler, report))
}

/// The progress bar on the terminal, if there is one: what is printed stands above it.
pub(crate) static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Prints while no progress bar is drawn.
fn above_bar(print: impl FnOnce()) {
    let bar = BAR.lock().map(|bar| bar.clone()).unwrap_or_default();
    match bar {
        Some(bar) => bar.suspend(print),
        None => print(),
    }
}

const GREEN: Style = AnsiColor::Green.on_default().bold();
const RED: Style = AnsiColor::Red.on_default().bold();
const YELLOW: Style = AnsiColor::Yellow.on_default().bold();
const CYAN: Style = AnsiColor::Cyan.on_default();

/// Words of answers that are coloured on a terminal, the longer ones first.
const VERDICTS: [(&str, Style); 9] = [
    ("NOT VERIFIED", RED),
    ("NOT MET", RED),
    ("INCOMPLETE", YELLOW),
    ("DIFFERENT", RED),
    ("VERIFIED", GREEN),
    ("DIFFERS", RED),
    ("FAILED", RED),
    ("FAIL", RED),
    ("PASS", GREEN),
];

/// Beginnings of the lines of an error that are coloured on a terminal.
const MARKS: [(&str, Style); 5] = [("\u{d7}", RED), ("error:", RED), ("help:", CYAN), ("tip:", CYAN), ("Usage:", CYAN)];

/// Replaces the control characters of a text, so that no escape sequence of a file or an argument reaches the terminal.
///
/// Line breaks and tabs stay. A control character becomes `\u001b`, which JSON reads as that character again.
fn escaped(text: &str) -> String {
    let is_unsafe = |c: char| {
        // Controls of the direction of writing reorder a line.
        let reorders = matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
        reorders || (c.is_control() && c != '\n' && c != '\t')
    };
    let text = text.replace("\r\n", "\n");
    if !text.contains(is_unsafe) {
        return text;
    }
    let shown = |c: char| if is_unsafe(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    text.chars().map(shown).collect()
}

/// Colours the verdicts of an answer.
fn with_verdicts(text: &str) -> String {
    let (mut out, mut rest) = (String::new(), text);
    while let Some(at) = rest.find(|c: char| c.is_ascii_uppercase()) {
        let (before, word) = rest.split_at(at);
        let is_part = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        let is_begun = before.chars().last().or(out.chars().last()).is_some_and(is_part);
        let found = VERDICTS.iter().find(|(verdict, _)| {
            word.strip_prefix(verdict).is_some_and(|rest| !rest.starts_with(is_part)) && !is_begun
        });
        out += before;
        rest = match found {
            Some((verdict, style)) => {
                out += &format!("{style}{verdict}{style:#}");
                &word[verdict.len()..]
            }
            None => {
                out += &word[..1];
                &word[1..]
            }
        };
    }
    out + rest
}

/// Colours the beginnings of the lines of an error.
fn with_marks(text: &str) -> String {
    let line = |line: &str| {
        let begin = line.trim_start();
        match MARKS.iter().find(|(mark, _)| begin.starts_with(mark)) {
            Some((mark, style)) => line.replacen(mark, &format!("{style}{mark}{style:#}"), 1),
            None => line.to_owned(),
        }
    };
    text.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

/// Prints an answer to standard output; ignores a closed pipe (`| head`). Verdicts have colours on a terminal.
pub(crate) fn print(text: impl Display) {
    let text = with_verdicts(&escaped(text.to_string().trim_end()));
    above_bar(|| drop(writeln!(anstream::stdout(), "{text}")));
}

/// Prints a file to standard output as it is.
pub(crate) fn print_bytes(bytes: &[u8]) {
    above_bar(|| drop(std::io::stdout().write_all(bytes)));
}

/// Prints to standard error; an error has colours on a terminal.
pub(crate) fn warn(text: impl Display) {
    let text = with_marks(&escaped(text.to_string().trim_end()));
    above_bar(|| drop(writeln!(anstream::stderr(), "{text}")));
}

/// Format of a command's answer.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(crate) struct Format {
    /// Print the answer as JSON.
    #[arg(long, global = true, display_order = 900)]
    pub(crate) json: bool,
}

impl Format {
    /// Prints the answer as JSON or as text; an empty text is not printed.
    pub(crate) fn print(&self, json: impl FnOnce() -> Value, text: impl FnOnce() -> String) {
        if self.json {
            let answer = escaped(&readable(&json()));
            above_bar(|| drop(writeln!(std::io::stdout(), "{answer}")));
            return;
        }
        let answer = text();
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

/// Writes one file, and the folders above it that are missing.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    softdock_results::write_file(path, bytes).map_err(|error| Failure::new(error, "name a file that can be written"))
}

/// Formats a value as indented JSON.
pub(crate) fn readable(value: &Value) -> String {
    serde_json::to_string_pretty(value).expect("a value has string keys")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_shown_escaped() {
        let cases = [
            ("a\u{1b}[31mb", "a\\u001b[31mb"),
            ("\u{9b}2J\u{7}\r", "\\u009b2J\\u0007\\u000d"),
            ("two\r\nlines\tand a tab", "two\nlines\tand a tab"),
            ("\u{202e}abc", "\\u202eabc"),
            ("m\u{fc} \u{d7}", "m\u{fc} \u{d7}"),
        ];
        for (text, shown) in cases {
            assert_eq!(escaped(text), shown);
        }
        let json = escaped(&readable(&serde_json::json!({ "title": "\u{1b}[2J\u{9b}\u{7f}" })));
        assert!(!json.contains(|c: char| c.is_control() && c != '\n'), "{json}");
        let read: Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(read["title"], "\u{1b}[2J\u{9b}\u{7f}");
    }

    #[test]
    fn whole_words_of_a_verdict_are_coloured() {
        let coloured = with_verdicts("a  NOT VERIFIED, b VERIFIED; UNVERIFIED PASSED DOCK-FAIL");
        assert_eq!(coloured.matches("\u{1b}[0m").count(), 2, "{coloured:?}");
        assert_eq!(
            anstream::adapter::strip_str(&coloured).to_string(),
            "a  NOT VERIFIED, b VERIFIED; UNVERIFIED PASSED DOCK-FAIL"
        );
        assert!(with_marks("  \u{d7} wrong\n  help: write").contains("\u{1b}["));
    }
}
