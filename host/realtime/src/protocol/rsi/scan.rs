//! A scanner of small XML messages without allocation: attributes, texts and ends of elements in byte order.
//!
//! Accepts the output of RSI controllers and simulators (blanks between attributes, either quote, declarations and
//! comments) and refuses everything else: entities, unbalanced or deep elements, bytes after the root.

/// Greatest nesting: the messages have two levels.
const DEPTH: usize = 4;

/// The bytes are not a valid message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RsiFormatError;

/// Event of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event<'a> {
    /// An element begins; `depth` is 0 for the root.
    Begin { element: &'a [u8], depth: usize },
    /// An attribute of the last begun element.
    Attribute { element: &'a [u8], name: &'a [u8], value: &'a [u8] },
    /// Trimmed text inside an element, if not empty.
    Text { element: &'a [u8], text: &'a [u8] },
}

/// The scan of one message.
pub(super) struct Scan<'a> {
    rest: &'a [u8],
    open: [&'a [u8]; DEPTH],
    depth: usize,
    in_tag: bool,
    root_over: bool,
}

fn is_name(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'.')
}

impl<'a> Scan<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, open: [&[]; DEPTH], depth: 0, in_tag: false, root_over: false }
    }

    /// Returns the next event; `None` once the root element has ended and nothing follows it.
    pub(super) fn next(&mut self) -> Result<Option<Event<'a>>, RsiFormatError> {
        loop {
            let found = if self.in_tag { self.attribute()? } else { self.content()? };
            if found.is_some() {
                return Ok(found);
            }
            if self.root_over && self.rest.is_empty() {
                return Ok(None);
            }
        }
    }

    fn element(&self) -> &'a [u8] {
        self.open[self.depth - 1]
    }

    fn skip_blanks(&mut self) {
        self.rest = self.rest.trim_ascii_start();
    }

    fn take_while(&mut self, take: impl Fn(u8) -> bool) -> &'a [u8] {
        let end = self.rest.iter().position(|&byte| !take(byte)).unwrap_or(self.rest.len());
        let (taken, rest) = self.rest.split_at(end);
        self.rest = rest;
        taken
    }

    fn expect(&mut self, text: &[u8]) -> Result<(), RsiFormatError> {
        self.rest = self.rest.strip_prefix(text).ok_or(RsiFormatError)?;
        Ok(())
    }

    fn name(&mut self) -> Result<&'a [u8], RsiFormatError> {
        let name = self.take_while(is_name);
        if name.is_empty() { Err(RsiFormatError) } else { Ok(name) }
    }

    /// Scans inside a tag: its next attribute, or its end.
    fn attribute(&mut self) -> Result<Option<Event<'a>>, RsiFormatError> {
        self.skip_blanks();
        match self.rest.first() {
            Some(b'>') => {
                self.expect(b">")?;
                self.in_tag = false;
                Ok(None)
            }
            Some(b'/') => {
                self.expect(b"/>")?;
                self.in_tag = false;
                self.close();
                Ok(None)
            }
            _ => {
                let name = self.name()?;
                self.skip_blanks();
                self.expect(b"=")?;
                self.skip_blanks();
                let value = self.quoted()?;
                Ok(Some(Event::Attribute { element: self.element(), name, value }))
            }
        }
    }

    fn quoted(&mut self) -> Result<&'a [u8], RsiFormatError> {
        let quote = match self.rest.first() {
            Some(&quote @ (b'"' | b'\'')) => quote,
            _ => return Err(RsiFormatError),
        };
        self.rest = &self.rest[1..];
        let value = self.take_while(|byte| byte != quote && byte != b'<' && byte != b'&');
        self.expect(&[quote])?;
        Ok(value)
    }

    /// Scans between tags: text, begin or end of an element.
    fn content(&mut self) -> Result<Option<Event<'a>>, RsiFormatError> {
        let text = self.take_while(|byte| byte != b'<' && byte != b'&').trim_ascii();
        if !text.is_empty() {
            // Some simulators send the whole buffer: ignore zeros after the message.
            if self.root_over && text.iter().all(|&byte| byte == 0) {
                return Ok(None);
            }
            if self.depth == 0 {
                return Err(RsiFormatError);
            }
            return Ok(Some(Event::Text { element: self.element(), text }));
        }
        if self.rest.is_empty() {
            return if self.root_over { Ok(None) } else { Err(RsiFormatError) };
        }
        self.expect(b"<")?;
        match self.rest.first() {
            Some(b'?') => self.skip_past(b"?>"),
            Some(b'!') => {
                self.expect(b"!--")?;
                self.skip_past(b"-->")
            }
            Some(b'/') => self.end(),
            _ => self.begin(),
        }
    }

    fn skip_past(&mut self, end: &[u8]) -> Result<Option<Event<'a>>, RsiFormatError> {
        let start = self.rest.windows(end.len()).position(|window| window == end).ok_or(RsiFormatError)?;
        self.rest = &self.rest[start + end.len()..];
        Ok(None)
    }

    fn begin(&mut self) -> Result<Option<Event<'a>>, RsiFormatError> {
        if self.root_over || self.depth == DEPTH {
            return Err(RsiFormatError);
        }
        let element = self.name()?;
        self.open[self.depth] = element;
        self.depth += 1;
        self.in_tag = true;
        Ok(Some(Event::Begin { element, depth: self.depth - 1 }))
    }

    fn end(&mut self) -> Result<Option<Event<'a>>, RsiFormatError> {
        self.expect(b"/")?;
        let name = self.name()?;
        self.skip_blanks();
        self.expect(b">")?;
        if self.depth == 0 || self.element() != name {
            return Err(RsiFormatError);
        }
        self.close();
        Ok(None)
    }

    fn close(&mut self) {
        self.depth -= 1;
        self.root_over = self.depth == 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(text: &str) -> Result<usize, RsiFormatError> {
        let mut scan = Scan::new(text.as_bytes());
        let mut events = 0;
        while scan.next()?.is_some() {
            events += 1;
        }
        Ok(events)
    }

    #[test]
    fn other_formatting_is_accepted() {
        for text in [
            "<Rob Type=\"KUKA\"><Delay D=\"0\"/><IPOC>1</IPOC></Rob>",
            "<?xml version=\"1.0\"?>\n<Rob TYPE='KUKA' >\n <Delay  D = \"0\" />\r\n<IPOC> 1 </IPOC >\n</Rob>\n",
            "<Rob Type=\"KUKA\"><!-- a < b --><Delay D=\"0\"></Delay><IPOC>1</IPOC></Rob>\0\0\0",
        ] {
            assert_eq!(count(text), Ok(6), "{text}");
        }
    }

    #[test]
    fn invalid_xml_is_refused() {
        for text in [
            "",
            "Rob",
            "<Rob",
            "<Rob>",
            "<Rob></Sen>",
            "<Rob/><Rob/>",
            "<Rob/>x",
            "x<Rob/>",
            "</Rob>",
            "<Rob A=1/>",
            "<Rob A=\"1/>",
            "<Rob>&lt;</Rob>",
            "<a><b><c><d><e/></d></c></b></a>",
            "<Rob><!-- </Rob>",
        ] {
            assert_eq!(count(text), Err(RsiFormatError), "{text}");
        }
    }
}
