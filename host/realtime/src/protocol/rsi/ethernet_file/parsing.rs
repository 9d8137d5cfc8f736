//! The file as lists of entries and elements, each with its line.

use super::FileError;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// Channels of a direction.
const MAX_CHANNEL: u32 = 64;

/// Type of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Bool,
    Text,
    Long,
    Double,
}

impl Kind {
    fn of(word: &str) -> Option<Self> {
        [Self::Bool, Self::Text, Self::Long, Self::Double]
            .into_iter()
            .find(|kind| word.eq_ignore_ascii_case(kind.word()))
    }

    /// Returns the word in the file.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Bool => "BOOL",
            Self::Text => "STRING",
            Self::Long => "LONG",
            Self::Double => "DOUBLE",
        }
    }
}

/// An `ELEMENT` of `SEND` or `RECEIVE`.
#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) line: usize,
    /// `TAG` as written.
    pub(super) tag: String,
    /// XML element.
    pub(super) name: String,
    /// Attribute; without one, the text of the element or all of its attributes.
    pub(super) attribute: Option<String>,
    pub(super) kind: Kind,
    /// `INDX`; `None`: the controller fills it by itself.
    pub(super) channel: Option<u32>,
    pub(super) hold_on: Option<bool>,
}

/// A key of `CONFIG`, in capitals.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) line: usize,
    pub(super) key: String,
    pub(super) value: String,
}

/// Contents of the file.
#[derive(Clone, Debug, Default)]
pub(super) struct Document {
    pub(super) config: Vec<Entry>,
    pub(super) sent: Vec<Element>,
    pub(super) received: Vec<Element>,
}

/// Parses the file.
pub(super) fn parse(text: &str) -> Result<Document, FileError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = Reader::from_str(text);
    let (mut open, mut document): (Vec<String>, _) = (Vec::new(), Document::default());
    let line_at = |place: u64| 1 + text.bytes().take(place as usize).filter(|byte| *byte == b'\n').count();
    loop {
        let line = line_at(reader.buffer_position());
        let event = reader.read_event().map_err(|error| no_xml(line_at(reader.error_position()), error.to_string()))?;
        match event {
            Event::Start(start) => {
                let name = begin(&mut document, &open, &start, line)?;
                open.push(name);
            }
            Event::Empty(start) => {
                begin(&mut document, &open, &start, line)?;
            }
            Event::End(_) => {
                open.pop();
            }
            Event::Text(value) => {
                let value = value.decode().map_err(|error| no_xml(line, error.to_string()))?;
                text_of(&mut document, &open, value.trim());
            }
            Event::Eof if open.is_empty() && is_whole(&document) => return Ok(document),
            Event::Eof if open.is_empty() => {
                return Err(no_xml(line, "there is no ROOT with CONFIG, SEND and RECEIVE".to_owned()));
            }
            Event::Eof => return Err(no_xml(line, format!("{} is not closed", open.join("/")))),
            Event::GeneralRef(_) | Event::CData(_) => {
                return Err(no_xml(line, "entities and CDATA are not supported".to_owned()));
            }
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
        }
    }
}

fn is_whole(document: &Document) -> bool {
    !document.config.is_empty()
}

fn no_xml(line: usize, problem: String) -> FileError {
    FileError::new(line, "XML", problem, "provide the rsi_ethernet.xml of the controller's RSI context")
}

/// Begins an element; returns its name in capitals.
fn begin(document: &mut Document, open: &[String], start: &BytesStart, line: usize) -> Result<String, FileError> {
    let name = String::from_utf8_lossy(start.name().as_ref()).to_ascii_uppercase();
    let path: Vec<&str> = open.iter().map(String::as_str).collect();
    match (path.as_slice(), name.as_str()) {
        ([], "ROOT") => {}
        ([], other) => return Err(no_xml(line, format!("the outermost element is {other}, must be ROOT"))),
        (["ROOT", "CONFIG"], _) => document.config.push(Entry { line, key: name.clone(), value: String::new() }),
        (["ROOT", "SEND", "ELEMENTS"], "ELEMENT") => document.sent.push(element(start, line)?),
        (["ROOT", "RECEIVE", "ELEMENTS"], "ELEMENT") => document.received.push(element(start, line)?),
        (_, "ELEMENT") => {
            let remedy = "put it between <ELEMENTS> and </ELEMENTS> of SEND or RECEIVE";
            return Err(FileError::new(line, "ELEMENT", format!("is in {}", path.join("/")), remedy));
        }
        _ => {}
    }
    Ok(name)
}

fn text_of(document: &mut Document, open: &[String], value: &str) {
    if let [root, config, _] = open
        && (root.as_str(), config.as_str()) == ("ROOT", "CONFIG")
        && let Some(entry) = document.config.last_mut()
    {
        // A comment may interrupt the text.
        entry.value.push_str(value);
    }
}

/// Reads the attributes of an `ELEMENT`; ignores others (`UNIT`).
fn element(start: &BytesStart, line: usize) -> Result<Element, FileError> {
    let mut values: [Option<String>; 4] = [const { None }; 4];
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| no_xml(line, error.to_string()))?;
        let key = String::from_utf8_lossy(attribute.key.as_ref()).to_ascii_uppercase();
        if let Some(place) = ["TAG", "TYPE", "INDX", "HOLDON"].iter().position(|known| *known == key) {
            values[place] = Some(String::from_utf8_lossy(&attribute.value).trim().to_owned());
        }
    }
    let [tag, kind, index, hold_on] = values;
    let tag = tag.filter(|tag| !tag.is_empty()).ok_or_else(|| {
        FileError::new(line, "ELEMENT", "TAG is missing", "write TAG=\"NAME.ATTRIBUTE\" or TAG=\"DEF_NAME\"")
    })?;
    let error =
        |problem: String, remedy: &str| FileError::new(line, &format!("ELEMENT TAG=\"{tag}\""), problem, remedy);
    let written = |value: &Option<String>| value.clone().unwrap_or_default();
    let kind = Kind::of(&written(&kind)).ok_or_else(|| {
        error(format!("TYPE is `{}`", written(&kind)), "write TYPE=\"BOOL\", \"STRING\", \"LONG\" or \"DOUBLE\"")
    })?;
    let channel =
        match written(&index).as_str() {
            word if word.eq_ignore_ascii_case("internal") => None,
            word => Some(word.parse().ok().filter(|channel| (1..=MAX_CHANNEL).contains(channel)).ok_or_else(|| {
                error(format!("INDX is `{word}`"), "write INDX=\"INTERNAL\" or a channel of 1 to 64")
            })?),
        };
    let internal = tag.starts_with(super::INTERNAL_PREFIX);
    if internal && channel.is_some() {
        return Err(error(
            "INDX is a channel, but the controller fills DEF_ elements".to_owned(),
            "write INDX=\"INTERNAL\"",
        ));
    }
    if !internal && channel.is_none() {
        return Err(error(
            "INDX is INTERNAL, but the controller fills only DEF_ elements".to_owned(),
            "write its channel",
        ));
    }
    let hold_on = match hold_on.as_deref() {
        None => None,
        Some("0") => Some(false),
        Some("1") => Some(true),
        Some(other) => return Err(error(format!("HOLDON is `{other}`"), "write HOLDON=\"0\" or HOLDON=\"1\"")),
    };
    let (name, attribute) = match tag.split_once('.') {
        Some((name, attribute)) => (name.to_owned(), Some(attribute.to_owned())),
        None => (tag.clone(), None),
    };
    Ok(Element { line, tag, name, attribute, kind, channel, hold_on })
}
