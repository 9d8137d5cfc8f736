//! Nesting depth of a text, computed without recursion: before a recursive parser reads it.

use std::fmt;

/// Greatest accepted nesting: files of softdock and URDF need fewer than ten levels.
pub const MAX_DEPTH: usize = 64;

/// The position at which a text is nested deeper than [`MAX_DEPTH`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooDeep {
    /// Byte offset in the text.
    pub offset: usize,
}

impl fmt::Display for TooDeep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "nested more than {MAX_DEPTH} levels deep")
    }
}

impl std::error::Error for TooDeep {}

/// Checks the nesting of the elements of an XML text; returns the deepest level.
///
/// # Errors
/// At the first element that is nested too deep. Invalid XML is no error here.
pub fn xml_depth(text: &str) -> Result<usize, TooDeep> {
    let bytes = text.as_bytes();
    let (mut at, mut depth, mut deepest) = (0, 0_usize, 0);
    while let Some(start) = find(bytes, at, b"<") {
        let rest = &bytes[start..];
        let (end, step) = if rest.starts_with(b"<!--") {
            (find(bytes, start + 4, b"-->").map(|end| end + 3), 0)
        } else if rest.starts_with(b"<![CDATA[") {
            (find(bytes, start + 9, b"]]>").map(|end| end + 3), 0)
        } else if rest.starts_with(b"<?") {
            (find(bytes, start + 2, b"?>").map(|end| end + 2), 0)
        } else if rest.starts_with(b"<!") {
            (find(bytes, start + 2, b">").map(|end| end + 1), 0)
        } else {
            let end = tag_end(bytes, start + 1);
            let step = match end {
                _ if rest.starts_with(b"</") => -1,
                Some(end) if bytes[end - 2] == b'/' => 0,
                _ => 1,
            };
            (end, step)
        };
        match step {
            1 => depth += 1,
            -1 => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
        if depth > MAX_DEPTH {
            return Err(TooDeep { offset: start });
        }
        let Some(end) = end else { break };
        at = end;
    }
    Ok(deepest)
}

/// Returns the first position of a mark at or after a byte.
fn find(bytes: &[u8], from: usize, mark: &[u8]) -> Option<usize> {
    let rest = bytes.get(from..)?;
    rest.windows(mark.len()).position(|window| window == mark).map(|at| from + at)
}

/// Returns the position after the `>` of a tag; one inside quotes does not end it.
fn tag_end(bytes: &[u8], from: usize) -> Option<usize> {
    let mut quote = None;
    for (at, byte) in bytes.iter().enumerate().skip(from) {
        match (quote, byte) {
            (None, b'>') => return Some(at + 1),
            (None, b'"' | b'\'') => quote = Some(*byte),
            (Some(open), byte) if open == *byte => quote = None,
            _ => {}
        }
    }
    None
}

/// Checks the nesting of brackets, braces and dotted keys of a TOML text; returns the deepest level.
///
/// # Errors
/// At the first position that is nested too deep. Invalid TOML is no error here.
pub fn toml_depth(text: &str) -> Result<usize, TooDeep> {
    let bytes = text.as_bytes();
    let (mut at, mut open, mut dots, mut deepest) = (0, 0_usize, 0_usize, 0);
    while at < bytes.len() {
        match bytes[at] {
            b'#' => {
                at = find(bytes, at, b"\n").unwrap_or(bytes.len());
                continue;
            }
            quote @ (b'"' | b'\'') => {
                at = text_end(bytes, at, quote);
                continue;
            }
            b'[' | b'{' => (open, dots) = (open + 1, 0),
            b']' | b'}' => open = open.saturating_sub(1),
            b'=' | b',' | b'\n' => dots = 0,
            b'.' => dots += 1,
            _ => {}
        }
        deepest = deepest.max(open + dots);
        if open + dots > MAX_DEPTH {
            return Err(TooDeep { offset: at });
        }
        at += 1;
    }
    Ok(deepest)
}

/// Returns the position after a quoted text; an unclosed one ends with its line, or with the file.
fn text_end(bytes: &[u8], start: usize, quote: u8) -> usize {
    let long = [quote; 3];
    let is_long = bytes[start..].starts_with(&long);
    let mut at = start + if is_long { 3 } else { 1 };
    while at < bytes.len() {
        match bytes[at] {
            b'\\' if quote == b'"' => at += 1,
            b'\n' if !is_long => return at,
            byte if byte == quote && !is_long => return at + 1,
            byte if byte == quote && bytes[at..].starts_with(&long) => return at + 3,
            _ => {}
        }
        at += 1;
    }
    bytes.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_in_comments_quotes_and_sections_do_not_count() {
        let text = "<?xml?><!-- <a><a> --><r a='>' b=\"<\"><e/><f><![CDATA[<a><a>]]><g></g></f></r>";
        assert_eq!(xml_depth(text), Ok(3));
        assert_eq!(xml_depth("no < xml"), Ok(1));
        let deep = "<a>".repeat(100_000);
        assert_eq!(xml_depth(&deep), Err(TooDeep { offset: 3 * MAX_DEPTH }));
        assert!(xml_depth(&"<a x='".repeat(100_000)).is_ok());
    }

    #[test]
    fn brackets_in_texts_and_comments_do_not_count() {
        let text = "# [[[[\na = [[1], {b = \"[[[[\\\"[\"}]\nc = '''\n[[[['''\n[[d.e.f]]\n";
        assert_eq!(toml_depth(text), Ok(4));
        assert_eq!(toml_depth("a = 1.5\nb = 2.5\nc = [1.5, 2.5, 3.5]"), Ok(2));
        for deep in ["[".repeat(100_000), format!("a = {}", "[".repeat(100_000)), "a.".repeat(100_000) + "a = 1"] {
            assert!(toml_depth(&deep).is_err());
        }
        assert!(toml_depth(&format!("a = \"{}\"", "[.".repeat(100_000))).is_ok());
    }
}
