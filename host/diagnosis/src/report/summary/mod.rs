//! Summary of a diagnosis: headline, tables and next steps, the same for the terminal and for the page.

pub mod details;
mod headline;
pub mod identifiability;
mod tables;

pub use headline::headline;

use crate::diagnosis::Diagnosis;
use crate::model::place::place;
use serde::Serialize;

/// Table of a report: a title, a row of heads, rows of cells, and a note.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ReportTable {
    /// Title.
    pub title: &'static str,
    /// Heads of the columns.
    pub head: Vec<&'static str>,
    /// Rows with a cell for each column.
    pub rows: Vec<Vec<String>>,
    /// Note below the table; may be empty.
    pub note: String,
}

/// Summary of a diagnosis in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DiagnosisSummary {
    /// The answer in a sentence that a reader can act on.
    pub headline: String,
    /// Why the answer is provisional.
    pub reasons: Vec<String>,
    /// Findings: place or recording, and what was found.
    pub findings: Vec<[String; 2]>,
    /// Tables with at least one row.
    pub tables: Vec<ReportTable>,
    /// What to do and to measure next.
    pub next: Vec<String>,
}

impl DiagnosisSummary {
    /// Summarises a diagnosis.
    pub fn of(diagnosis: &Diagnosis) -> Self {
        let findings = diagnosis.findings.iter();
        Self {
            headline: headline(diagnosis),
            reasons: diagnosis.reasons.clone(),
            findings: findings.map(|own| [place(&own.recording).to_owned(), own.what.clone()]).collect(),
            tables: tables::all(diagnosis),
            next: tables::next(diagnosis),
        }
    }

    /// Returns the summary for the terminal.
    pub fn text(&self) -> String {
        let mut out = self.headline.clone();
        for reason in &self.reasons {
            out += &format!("\n  provisional: {reason}");
        }
        for [place, what] in &self.findings {
            out += &format!("\n  {place}: {what}");
        }
        for table in &self.tables {
            out += &format!("\n\n{}", table.text());
        }
        if !self.next.is_empty() {
            out += "\n\nNext";
        }
        for step in &self.next {
            out += &format!("\n  {step}");
        }
        out
    }
}

impl ReportTable {
    /// Returns the table as text with aligned columns.
    pub fn text(&self) -> String {
        let head: Vec<String> = self.head.iter().map(|head| (*head).to_owned()).collect();
        let lines: Vec<&Vec<String>> = std::iter::once(&head).chain(&self.rows).collect();
        let widths = (0..head.len()).map(|column| lines.iter().map(|line| line[column].chars().count()).max());
        let widths: Vec<usize> = widths.map(Option::unwrap_or_default).collect();
        let mut out = self.title.to_owned();
        for line in lines {
            let cells = line.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
            out += &format!("\n  {}", cells.collect::<Vec<_>>().join("  ").trim_end());
        }
        if !self.note.is_empty() {
            out += &format!("\n  {}", self.note);
        }
        out
    }
}
