//! Dialect of a CSV file, detected from its text: separator, decimal mark, comments, header, units.

use jiff::Timestamp;
use jiff::civil::DateTime;
use jiff::tz::TimeZone;

/// Rows that the separator is detected from.
const SAMPLE: usize = 60;
/// Smallest share of cells with a number that a separator is believed by.
const LEAST_NUMBERS: f64 = 0.3;
/// Words for a missing number.
const MISSING: [&str; 6] = ["", "nan", "null", "na", "n/a", "none"];

/// What separates the cells of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Separator {
    /// One character.
    Character(char),
    /// Any number of spaces or tabs.
    Spaces,
}

/// Separators in the order of preference, with their names.
const SEPARATORS: [(Separator, &str); 5] = [
    (Separator::Character(','), "`,`"),
    (Separator::Character(';'), "`;`"),
    (Separator::Character('\t'), "tab"),
    (Separator::Character('|'), "`|`"),
    (Separator::Spaces, "spaces"),
];

/// Dialect of a CSV file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Dialect {
    separator: Separator,
    /// Whether the decimal mark is a comma.
    decimal_comma: bool,
    /// Line of the header, from 1, and its names; `None` if the first row has numbers.
    pub(crate) header: Option<(usize, Vec<String>)>,
    /// Number of columns.
    pub(crate) columns: usize,
    /// Number of lines before the first row of numbers.
    pub(crate) skipped: usize,
    /// Whether every row ends with a separator that no column follows.
    pub(crate) is_trailed: bool,
    /// Statements about everything that differs from a header, commas and decimal points.
    pub(crate) assumed: Vec<String>,
}

impl Dialect {
    /// Detects the dialect of a text; `None` if there is no row at all.
    ///
    /// A text without any numbers is taken for one with commas, so that its header can be compared with the columns
    /// that are wanted.
    pub(crate) fn of(text: &str) -> Option<Self> {
        let rows: Vec<(usize, &str)> = content(text).take(SAMPLE).collect();
        let ((separator, name), decimal_comma) = separator(&rows).unwrap_or((SEPARATORS[0], false));
        let mut found = Self::with(separator, decimal_comma);
        let (first, line) = *rows.first()?;
        let names = found.names(line);
        let second = rows.get(1).map(|(_, line)| found.cells(line));
        let of_second = second.as_ref().map_or(0, Vec::len);
        if separator != SEPARATORS[0].0 {
            found.assumed.push(format!("columns are separated by {name}"));
        }
        if decimal_comma {
            found.assumed.push("the decimal mark is a comma".to_owned());
        }
        found.skipped = first;
        if found.has_number(line) {
            found.columns = found.cells(line).len();
            found.header = found.commented_header(text, first);
            let comments = first - usize::from(found.header.is_some());
            found.note_comments(text, comments);
            if let Some((line, _)) = &found.header {
                found.assumed.push(format!("line {line}, a comment, has the names of the columns"));
            }
            return Some(found);
        }
        found.note_comments(text, first);
        found.columns = names.len();
        found.header = Some((first + 1, names));
        found.skipped += 1;
        found.is_trailed =
            of_second == found.columns + 1 && second.is_some_and(|cells| cells[found.columns].is_empty());
        if found.is_trailed {
            found.assumed.push("rows end with a separator that no column follows".to_owned());
        }
        if let Some((line, row)) = rows.get(1).filter(|(_, row)| found.is_units(row)) {
            found.assumed.push(format!(
                "line {} has units ({}) and is ignored: [log] of the model file has the units",
                line + 1,
                found.names(row).join(", ")
            ));
            found.skipped = line + 1;
        }
        Some(found)
    }

    /// The dialect by its marks alone.
    fn with(separator: Separator, decimal_comma: bool) -> Self {
        let (header, assumed) = (None, Vec::new());
        Self { separator, decimal_comma, header, columns: 0, skipped: 0, is_trailed: false, assumed }
    }

    /// Returns the rows of numbers, each with its line from 1.
    pub(crate) fn rows<'a>(&self, text: &'a str) -> impl Iterator<Item = (usize, &'a str)> + use<'a> {
        let skipped = self.skipped;
        content(text).filter(move |(line, _)| *line >= skipped).map(|(line, row)| (line + 1, row))
    }

    /// Returns the cells of a row without spaces and quotes around them. A separator within quotes separates nothing.
    pub(crate) fn cells<'a>(&self, row: &'a str) -> Vec<&'a str> {
        let Separator::Character(separator) = self.separator else {
            return row.split_whitespace().map(clean).collect();
        };
        let mut quoted = false;
        let is_end = |c: char| {
            quoted ^= c == '"';
            c == separator && !quoted
        };
        row.split(is_end).map(clean).collect()
    }

    /// Returns the number in a cell: NaN where it is missing, seconds since 1970 for a date with a time; `None` if the
    /// cell has anything else.
    pub(crate) fn number(&self, cell: &str) -> Option<f64> {
        if MISSING.iter().any(|word| cell.eq_ignore_ascii_case(word)) {
            return Some(f64::NAN);
        }
        self.decimal(cell).or_else(|| seconds(cell))
    }

    /// Returns the number in a cell that is no date: NaN where it is missing.
    pub(crate) fn number_or_missing(&self, cell: &str) -> Option<f64> {
        self.number(cell).filter(|_| !is_date(cell))
    }

    /// Returns what to do about a row with too many or too few cells.
    pub(crate) fn remedy_of_width(&self) -> &'static str {
        match self.separator {
            Separator::Character(',') => {
                "complete or remove the row; where the decimal mark is a comma, separate the columns by `;`"
            }
            _ => "complete or remove the row",
        }
    }

    /// Returns the number in a cell that is neither missing nor a date.
    fn decimal(&self, cell: &str) -> Option<f64> {
        match self.decimal_comma {
            // A point beside a decimal comma groups thousands, which nothing confirms.
            true if cell.contains('.') => None,
            true => cell.replacen(',', ".", 1).parse().ok(),
            false => cell.parse().ok(),
        }
    }

    fn names(&self, row: &str) -> Vec<String> {
        self.cells(row).into_iter().map(str::to_owned).collect()
    }

    /// Whether any cell of a row has a number: a header has none.
    fn has_number(&self, row: &str) -> bool {
        self.cells(row).iter().any(|cell| self.number(cell).is_some_and(|number| !number.is_nan()))
    }

    /// Whether a row below the header has units: as many cells, no number, and a word that is not one for missing.
    fn is_units(&self, row: &str) -> bool {
        let cells = self.cells(row);
        let is_word = |cell: &&str| self.number(cell).is_none();
        cells.len() == self.columns && cells.iter().any(is_word) && !self.has_number(row)
    }

    /// The names of the columns from the last comment before the numbers.
    fn commented_header(&self, text: &str, first: usize) -> Option<(usize, Vec<String>)> {
        let (line, comment) = text.lines().enumerate().take(first).filter(|(_, line)| is_comment(line)).last()?;
        let comment = comment.trim_start_matches('\u{feff}').trim_start().trim_start_matches('#').trim();
        let names = self.names(comment);
        (names.len() == self.columns && !self.has_number(comment)).then_some((line + 1, names))
    }

    fn note_comments(&mut self, text: &str, before: usize) {
        let count = text.lines().take(before).filter(|line| is_comment(line)).count();
        if count > 0 {
            self.assumed.push(format!("comment lines at the start are ignored: {count}"));
        }
    }
}

/// Lines that are neither empty nor comments, with their numbers from 0.
fn content(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty() && !is_comment(line))
}

fn is_comment(line: &str) -> bool {
    line.trim_start_matches('\u{feff}').trim_start().starts_with('#')
}

/// A separator with its name, and whether the decimal mark is a comma.
type Marks = ((Separator, &'static str), bool);

/// The separator and decimal mark by which most cells have numbers; `None` if hardly any cell has one.
fn separator(rows: &[(usize, &str)]) -> Option<Marks> {
    let mut best: Option<(f64, Marks)> = None;
    for decimal_comma in [false, true] {
        for entry in SEPARATORS {
            if decimal_comma && entry.0 == Separator::Character(',') {
                continue;
            }
            let share = share_of_numbers(rows, &Dialect::with(entry.0, decimal_comma));
            if share > best.map_or(LEAST_NUMBERS, |best| best.0) {
                best = Some((share, (entry, decimal_comma)));
            }
        }
    }
    best.map(|best| best.1)
}

/// Share of the cells that have a number, in the rows below the first one; 0 if most rows have one cell.
fn share_of_numbers(rows: &[(usize, &str)], dialect: &Dialect) -> f64 {
    let (mut numbers, mut cells, mut single) = (0_usize, 0_usize, 0);
    let below = if rows.len() > 1 { &rows[1..] } else { rows };
    for (_, row) in below {
        let own = dialect.cells(row);
        single += usize::from(own.len() < 2);
        cells += own.len();
        numbers += own.iter().filter(|cell| dialect.number(cell).is_some()).count();
    }
    if 2 * single >= below.len() { 0.0 } else { numbers as f64 / cells as f64 }
}

/// A cell without spaces and quotes.
fn clean(cell: &str) -> &str {
    cell.trim().trim_start_matches('\u{feff}').trim_matches('"').trim()
}

/// Returns the seconds since 1970-01-01 00:00 UTC of a date with a time by ISO 8601, such as
/// `2024-03-05T10:00:00.010Z` or `2024-03-05 10:00:00,010+01:00`; without a zone it is taken for UTC.
fn seconds(cell: &str) -> Option<f64> {
    // A date alone is no time stamp.
    cell.get(10..11).filter(|mark| ["T", "t", " "].contains(mark))?;
    let in_utc = || TimeZone::UTC.to_timestamp(cell.parse::<DateTime>().ok()?).ok();
    let stamp = cell.parse::<Timestamp>().ok().or_else(in_utc)?;
    Some(stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9)
}

/// Whether a cell has a date with a time.
pub(crate) fn is_date(cell: &str) -> bool {
    seconds(cell).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dialect(text: &str) -> Dialect {
        Dialect::of(text).expect("rows")
    }

    /// Every row as numbers.
    fn numbers(text: &str) -> Vec<Vec<f64>> {
        let dialect = dialect(text);
        let of = |row: &str| dialect.cells(row).iter().map(|cell| dialect.number(cell).expect("a number")).collect();
        dialect.rows(text).map(|(_, row)| of(row)).collect()
    }

    #[test]
    fn separators_and_decimal_marks_are_detected() {
        let plain = "t,q,i\n0.00,-0.5,14.25\n0.01,-0.25,-3.5\n";
        let expected = [[0.0, -0.5, 14.25], [0.01, -0.25, -3.5]];
        assert_eq!(numbers(plain), expected);
        assert!(dialect(plain).assumed.is_empty());
        for (separator, name) in [(";", "`;`"), ("\t", "tab"), (" ", "spaces"), ("  ", "spaces"), ("|", "`|`")] {
            for mark in [".", ","] {
                let text = plain.replace(',', "\u{1}").replace('.', mark).replace('\u{1}', separator);
                assert_eq!(numbers(&text), expected, "{text}");
                let assumed = dialect(&text).assumed;
                assert!(assumed[0].contains(name), "{assumed:?}");
                assert_eq!(assumed.len(), if mark == "," { 2 } else { 1 }, "{assumed:?}");
                assert_eq!(dialect(&text).header, Some((1, ["t", "q", "i"].map(str::to_owned).to_vec())));
            }
        }
    }

    #[test]
    fn missing_numbers_and_words_do_not_hide_the_separator() {
        let text = "t;mode;q\n0,00;on, slow;\n0,01;off;0,5\n0,02;off;nan\n";
        let found = dialect(text);
        assert_eq!(found.cells("0,00;on, slow;"), ["0,00", "on, slow", ""]);
        assert!(found.decimal_comma && found.number("").is_some_and(f64::is_nan) && found.number("off").is_none());
        assert_eq!(found.skipped, 1);
    }

    #[test]
    fn quoted_separators_comments_units_and_trailing_separators_are_understood() {
        assert_eq!(dialect("\"x, y\",t\n0,0.5\n0,1.5\n").header, Some((1, vec!["x, y".to_owned(), "t".to_owned()])));
        let commented = dialect("# drive log, 100 Hz\nt,q\n0,0.5\n");
        assert_eq!((commented.header.expect("names").0, commented.skipped), (2, 2));
        assert!(commented.assumed[0].contains("comment lines"), "{:?}", commented.assumed);
        let units = dialect("t,q\ns,rad\n0,0.5\n");
        assert!(units.skipped == 2 && units.assumed[0].contains("s, rad"), "{:?}", units.assumed);
        assert_eq!(dialect("t,q\nnan,\n0,0.5\n").skipped, 1, "missing numbers are no units");
        let trailed = dialect("t,q\n0,0.5,\n1,0.5,\n");
        assert!(trailed.is_trailed && trailed.columns == 2);
        assert!(!dialect("t,q,\n0,0.5,\n").is_trailed, "the header ends with it, too");
    }

    #[test]
    fn first_row_of_numbers_is_no_header() {
        let none = dialect("0.0,1.5\n0.1,2.5\n");
        assert_eq!((none.header, none.columns, none.skipped), (None, 2, 0));
        let commented = dialect("# made by hand\n# t q\n0.0 1.5\n0.1 2.5\n");
        assert_eq!(commented.header, Some((2, vec!["t".to_owned(), "q".to_owned()])));
        assert!(Dialect::of("\n \n").is_none());
        assert_eq!(dialect("t,q\n").header.map(|header| header.0), Some(1), "a header alone");
    }

    #[test]
    fn dates_are_seconds() {
        assert_eq!(seconds("1970-01-01T00:00:00"), Some(0.0));
        assert_eq!(seconds("2024-03-05T10:00:00.250Z"), Some(1_709_632_800.25));
        assert_eq!(seconds("2024-03-05 10:00:00,250+01:30"), Some(1_709_632_800.25 - 5400.0));
        assert_eq!(seconds("2024-02-29T23:59:59-0030"), Some(1_709_251_199.0 + 1800.0));
        for wrong in ["2024-13-05T10:00:00", "2024-03-05", "2024-03-05T10:00:00.1x", "1.5", "2024-03-05T10:00:00+1:0"] {
            assert_eq!(seconds(wrong), None, "{wrong}");
        }
        let text = "t,q\n2024-03-05T10:00:00.000,0.5\n2024-03-05T10:00:00.010,0.75\n";
        assert_eq!(numbers(text)[1][1], 0.75);
    }
}
