//! What is wrong with a file: where, which key, which value, what was expected, and what to do about it.

use crate::source::Source;
use miette::{Diagnostic, LabeledSpan, MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};
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
    /// Dotted key (`contact.stiffness`, `dispersion[2].dist.min`; entries count from 1); empty if there is none.
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
    /// In the place of the whole source where its lines there are too long for a message.
    window: Option<Window>,
}

/// Most problems of one check that are kept: a message for each takes milliseconds and a screen.
pub(crate) const LISTED: usize = 50;

/// Longest lines, in bytes, that a message shows around a place.
const LONGEST_LINES: usize = 2_000;

/// Bytes that a message shows of longer lines, before and behind a place.
const SHOWN: (usize, usize) = (60, 140);

/// A short piece of a text with its place in the file.
#[derive(Clone, Debug)]
struct Window {
    file: String,
    text: String,
    span: SourceSpan,
    /// Line and column of its first byte, from 0.
    place: (usize, usize),
    /// Line and column of the problem, from 0.
    problem: (usize, usize),
}

impl Window {
    /// The piece around a span; `None` if the lines there are short enough to be shown.
    fn around(source: &Source, span: &Range<usize>) -> Option<Self> {
        let text = source.text();
        let line_start = |at: usize| text[..at].rfind('\n').map_or(0, |end| end + 1);
        let line_end = |at: usize| text[at..].find('\n').map_or(text.len(), |end| at + end);
        let boundary = |mut at: usize| {
            while !text.is_char_boundary(at) {
                at -= 1;
            }
            at
        };
        let (start, end) = (boundary(span.start.min(text.len())), boundary(span.end.min(text.len())));
        let (first, last) = (line_start(start), line_end(end.max(start)));
        let (before, after) = (line_start(first.saturating_sub(1)), line_end((last + 1).min(text.len())));
        if after - before <= LONGEST_LINES {
            return None;
        }
        let from = boundary(start.saturating_sub(SHOWN.0)).max(first);
        let until = boundary((start + SHOWN.1).min(text.len())).min(line_end(start));
        let place = |at| {
            let (line, column) = source.line_column(at);
            (line - 1, column - 1)
        };
        Some(Self {
            file: source.path().display().to_string(),
            text: text[from..until].to_owned(),
            span: (from, until - from).into(),
            place: place(from),
            problem: place(start),
        })
    }
}

impl SourceCode for Window {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        // Without lines around it the place of the problem itself is asked for.
        let is_place = lines_before + lines_after == 0;
        let (line, column) = if is_place { self.problem } else { self.place };
        let from = if is_place { span.offset().saturating_sub(self.span.offset()).min(self.text.len()) } else { 0 };
        let rest = (self.span.offset() + from, self.text.len() - from).into();
        let text = &self.text.as_bytes()[from..];
        Ok(Box::new(MietteSpanContents::new_named(self.file.clone(), text, rest, line, column, 1)))
    }
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
            window: Window::around(&source, &span),
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
            window: None,
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
        let whole = self.source.as_ref().map(|source| source.named() as &dyn SourceCode);
        self.window.as_ref().map(|window| window as &dyn SourceCode).or(whole)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.source.as_ref()?;
        let label = match self.expected.as_str() {
            "" => "here".to_owned(),
            expected => format!("expected {expected}"),
        };
        let shown = self.window.as_ref().map_or(usize::MAX, |window| window.span.offset() + window.span.len());
        let length = self.span.len().min(shown.saturating_sub(self.span.start));
        let span = SourceSpan::new(self.span.start.into(), length);
        Some(Box::new(std::iter::once(LabeledSpan::new_with_span(Some(label), span))))
    }
}

/// Everything that was found wrong; never empty.
#[derive(Clone, Debug)]
pub struct Problems(Vec<Problem>);

impl Problems {
    /// `Err` if there are any problems.
    ///
    /// Of very many the first [`LISTED`] are kept, with the number of the others.
    pub(crate) fn check(mut problems: Vec<Problem>) -> Result<(), Self> {
        let others = problems.len().saturating_sub(LISTED);
        if let Some(file) = problems.get(LISTED).map(|problem| problem.file.clone()) {
            problems.truncate(LISTED);
            let message = format!("{others} more problems are not listed");
            problems.push(Problem::with_file(file, message).remedy("correct the listed ones first"));
        }
        if problems.is_empty() { Ok(()) } else { Err(Self(problems)) }
    }

    /// The same with a text before each message.
    pub(crate) fn before(mut self, text: &str) -> Self {
        self.0.iter_mut().for_each(|problem| problem.message.insert_str(0, text));
        self
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
    fn of_a_long_line_a_message_shows_the_place_alone() {
        let text = format!("a = 1\n# {0}\nb = \"{0}\" # {0}\n", "ä".repeat(100_000));
        let source = Source::new("c.toml".into(), text);
        let places = source.span_of("b");
        for span in [places.clone(), places.start + 1..places.start + 2, 4..5, 0..0, places.end..source.text().len()] {
            let problems = Problems::from(Problem::at(&source, span.clone(), "this is wrong").value(""));
            let shown = format!("{:?}", Shown(&miette::NarratableReportHandler::new(), &problems));
            assert!(shown.len() < 5_000 && shown.contains("c.toml"), "{span:?}: {} bytes\n{shown}", shown.len());
        }
        let problems = Problems::from(Problem::at(&source, places, "this is wrong").value(""));
        let shown = format!("{:?}", Shown(&miette::NarratableReportHandler::new(), &problems));
        assert!(shown.contains("line 3, columns 5 to"), "{shown}");
    }

    #[test]
    fn of_many_problems_the_first_are_listed_and_the_others_counted() {
        let source = Source::new("c.toml".into(), "runs = 0\n".to_owned());
        let problem = || Problem::at(&source, 7..8, "0 is out of range");
        let problems = Problems::check((0..5_000).map(|_| problem()).collect()).expect_err("problems");
        assert_eq!(problems.iter().count(), LISTED + 1);
        assert!(problems.to_string().contains("4950 more problems are not listed"), "{problems}");
        assert_eq!(
            Problems::check((0..LISTED).map(|_| problem()).collect()).expect_err("problems").iter().count(),
            LISTED
        );
    }

    /// A report as a handler shows it.
    struct Shown<'a>(&'a dyn miette::ReportHandler, &'a Problems);

    impl fmt::Debug for Shown<'_> {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            self.0.debug(self.1, f)
        }
    }

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
