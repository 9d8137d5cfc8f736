//! Texts of users as cells of CSV files.

/// A text as a cell of a CSV file: quoted if it holds a separator, and with an apostrophe before a character at which a
/// spreadsheet begins a formula (`=`, `+`, `-`, `@`). Numbers stay as they are.
pub fn csv_cell(text: &str) -> String {
    let is_formula = text.trim_start().starts_with(['=', '+', '-', '@']) && text.trim().parse::<f64>().is_err();
    let text = if is_formula { format!("'{text}") } else { text.to_owned() };
    let needs_quotes = text.contains([',', '"', ';']) || text.contains(char::is_control);
    if needs_quotes { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_cell_begins_a_formula() {
        let cases = [
            ("q_1_rad", "q_1_rad"),
            ("-1.5e3", "-1.5e3"),
            ("=HYPERLINK(\"x\")", "\"'=HYPERLINK(\"\"x\"\")\""),
            ("+cmd|' /C calc'!A0", "'+cmd|' /C calc'!A0"),
            (" @SUM(1)", "' @SUM(1)"),
            ("-x", "'-x"),
            ("a,b", "\"a,b\""),
            ("a\r\n=b", "\"a\r\n=b\""),
        ];
        for (text, cell) in cases {
            assert_eq!(csv_cell(text), cell);
        }
    }
}
