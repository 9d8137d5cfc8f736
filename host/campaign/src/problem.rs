//! What is wrong with a file: where, which key, which value, what was expected, and what to do about it.

use crate::source::Source;
use miette::{Diagnostic, LabeledSpan, SourceCode, SourceSpan};
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;

/// One mistake in one file.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Dotted key (`contact.stiffness`, `dispersion[2].dist.min`; entries count from 1); empty if none can be told.
    pub key: String,
    /// The value as written, shortened if long; empty if there is none.
    pub value: String,
    /// What is wrong.
    pub message: String,
    /// What may stand here.
    pub expected: String,
    /// What to do.
    pub remedy: String,
    source: Option<Source>,
    span: Range<usize>,
}

impl Problem {
    /// A problem at a place in a file that could be read.
    pub(crate) fn at(source: &Source, span: Range<usize>, message: impl Into<String>) -> Self {
        let (source, span) = source.resolve(span);
        let (line, column) = source.line_column(span.start);
        Self {
            file: source.path().to_owned(),
            line,
            column,
            key: source.key_at(&span),
            value: source.excerpt(&span),
            message: message.into(),
            expected: String::new(),
            remedy: String::new(),
            source: Some(source),
            span,
        }
    }

    /// A problem with a file that could not be read at all.
    pub(crate) fn with_file(file: PathBuf, message: impl Into<String>) -> Self {
        Self {
            file,
            line: 1,
            column: 1,
            key: String::new(),
            value: String::new(),
            message: message.into(),
            expected: String::new(),
            remedy: String::new(),
            source: None,
            span: 0..0,
        }
    }

    pub(crate) fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = expected.into();
        self
    }

    pub(crate) fn remedy(mut self, remedy: impl Into<String>) -> Self {
        self.remedy = remedy.into();
        self
    }

    pub(crate) fn key(mut self, key: impl Into<String>) -> Self {
        self.key = key.into();
        self
    }

    pub(crate) fn value(mut self, value: impl Into<String>) -> Self {
        self.value = value.into();
        self
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.key.as_str(), self.value.as_str()) {
            ("", _) => f.write_str(&self.message),
            (key, "") => write!(f, "`{key}`: {}", self.message),
            (key, value) => write!(f, "`{key}` = {value}: {}", self.message),
        }
    }
}

impl std::error::Error for Problem {}

impl Diagnostic for Problem {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        (!self.remedy.is_empty()).then(|| Box::new(&self.remedy) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|source| source.named() as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.source.as_ref()?;
        let label = match self.expected.as_str() {
            "" => "here".to_owned(),
            expected => format!("expected {expected}"),
        };
        let span = SourceSpan::new(self.span.start.into(), self.span.len());
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(Some(label), span))))
    }
}

/// Everything that was found wrong; never empty.
#[derive(Clone, Debug)]
pub struct Problems(Vec<Problem>);

impl Problems {
    /// `Err` if there are any problems.
    pub(crate) fn check(problems: Vec<Problem>) -> Result<(), Self> {
        if problems.is_empty() { Ok(()) } else { Err(Self(problems)) }
    }

    /// The problems, in the order in which they were found.
    pub fn iter(&self) -> impl Iterator<Item = &Problem> {
        self.0.iter()
    }
}

impl IntoIterator for Problems {
    type Item = Problem;
    type IntoIter = std::vec::IntoIter<Problem>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl From<Problem> for Problems {
    fn from(problem: Problem) -> Self {
        Self(vec![problem])
    }
}

/// Plain text, one problem after the other, for logs and programs.
impl fmt::Display for Problems {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, problem) in self.0.iter().enumerate() {
            let separator = if index == 0 { "" } else { "\n" };
            write!(f, "{separator}{}:{}:{}: {problem}", problem.file.display(), problem.line, problem.column)?;
            if !problem.expected.is_empty() {
                write!(f, "\n  expected {}", problem.expected)?;
            }
            if !problem.remedy.is_empty() {
                write!(f, "\n  help: {}", problem.remedy)?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for Problems {}

/// Rendered by `miette`: the first problem in full, the others as related ones.
impl Diagnostic for Problems {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.0[0].help()
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0[0].source_code()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.0[0].labels()
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        (self.0.len() > 1).then(|| {
            Box::new(self.0[1..].iter().map(|problem| problem as &dyn Diagnostic)) as Box<dyn Iterator<Item = _>>
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_is_shown_with_its_label_and_help() {
        let source = Source::new("c.toml".into(), "runs = 0\n".to_owned());
        let problem = Problem::at(&source, 7..8, "0 is out of range").expected("1 or more").remedy("write 1 or more");
        let problems = Problems::from(problem);
        assert_eq!(
            problems.to_string(),
            "c.toml:1:8: `runs` = 0: 0 is out of range\n  expected 1 or more\n  help: write 1 or more"
        );
        let mut shown = String::new();
        let handler = miette::NarratableReportHandler::new();
        handler.render_report(&mut shown, &problems).expect("rendered");
        for part in ["c.toml", "line 1, column 8", "expected 1 or more", "write 1 or more", "runs = 0"] {
            assert!(shown.contains(part), "{part} in\n{shown}");
        }
    }
}
