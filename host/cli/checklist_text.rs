//! The checks of the start-up as a table.

use softdock_realtime::drive::checklist::{Answer, Check, Checklist};
use std::io::IsTerminal;

/// One line a check, failed ones with their remedy; in colours on a terminal.
pub(crate) fn checklist_text(list: &Checklist) -> String {
    let colours = std::io::stdout().is_terminal();
    let mark = |answer: Answer| match (answer, colours) {
        (Answer::Passed, true) => "\x1b[32mok    \x1b[0m",
        (Answer::Failed, true) => "\x1b[31mFAILED\x1b[0m",
        (Answer::Passed, false) => "ok    ",
        (Answer::Failed, false) => "FAILED",
        (Answer::Open, _) => "-     ",
    };
    let line = |check: &Check| {
        let (row, answer) = (check.what.row(), check.answer());
        let remedy = if answer == Answer::Failed { format!("\n       {}", row.remedy) } else { String::new() };
        let [value, limit] = [check.value_text(), check.limit_text()];
        format!("{} {:<16} {:<66} {value:>14}   {limit}{remedy}", mark(answer), check.subject(), row.title)
    };
    list.checks().iter().map(line).collect::<Vec<_>>().join("\n")
}
