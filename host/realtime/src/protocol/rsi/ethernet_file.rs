//! Reads the tag map of a controller from its `rsi_ethernet.xml`: tolerant of formatting, strict on contents.

mod parsing;

use super::tags::{Correction, RsiGroup, TagMap, is_xml_name};
use crate::time::Nanos;
use parsing::{Document, Element, Kind, parse};
use std::fmt;

/// Elements that the controller fills by itself are written `DEF_NAME` there, and sent as `NAME`.
const INTERNAL_PREFIX: &str = "DEF_";
/// Words that identify a user-named element as torques of the axes.
const TORQUE_WORDS: [&str; 4] = ["torque", "trq", "moment", "eff"];

/// Information that the file lacks.
#[derive(Clone, Copy, Debug)]
pub struct RsiExpectation<'a> {
    /// Whether corrections are offsets or increments (`RSI_ON`).
    pub mode: Correction,
    /// Cycle of the controller.
    pub cycle: Nanos,
    /// Whether the robot has a rail.
    pub rail: bool,
    /// Element of the torques; `None`: the one of `SEND` with a name for torques, if there is one.
    pub torque: Option<&'a str>,
}

/// A controller's `rsi_ethernet.xml`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EthernetFile {
    /// Elements of the signals.
    pub tags: TagMap,
    /// Host that the controller sends to, as written.
    pub host: String,
    /// Port that it sends to.
    pub port: u16,
}

/// An error in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    /// Line, from 1; 0 if no single line is concerned.
    pub line: usize,
    /// Element, as written.
    pub element: String,
    /// Problem, with value and legal range.
    pub problem: String,
    /// Remedy.
    pub remedy: String,
}

impl FileError {
    fn new(line: usize, element: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { line, element: element.to_owned(), problem: problem.into(), remedy: remedy.into() }
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        if self.line > 0 {
            write!(out, "line {}, ", self.line)?;
        }
        write!(out, "{}: {}", self.element, self.problem)
    }
}

impl std::error::Error for FileError {}

/// Parses an `rsi_ethernet.xml`.
///
/// Sent: `AIPos` and `Delay` are required, and `EIPos` (or another element with `E1`) with a rail. `RIst`, `RSol`,
/// `ASPos`, `ESPos` and torques are optional. Received: an element with `A1` to `A6`, and one with `E1` with a rail.
/// Other elements are ignored.
///
/// # Errors
/// States line and element: no XML, a missing or duplicate element, an invalid type or channel, `ONLYSEND`, Cartesian
/// corrections, and corrections whose `HOLDON` would move the robot when an answer is lost.
pub fn read_rsi_ethernet(text: &str, expected: &RsiExpectation) -> Result<EthernetFile, FileError> {
    let document = parse(text)?;
    let (host, port, sen_type) = config(&document)?;
    let (sent, received) = (Direction::new("SEND", &document.sent)?, Direction::new("RECEIVE", &document.received)?);
    let axes = sent.group(RsiGroup::Axes, "AIPos")?.ok_or_else(|| {
        sent.missing(
            "AIPos",
            "measured axes are not sent",
            "add <ELEMENT TAG=\"DEF_AIPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"/>",
        )
    })?;
    let (correction, external_correction) = corrections(&received, expected.mode)?;
    let external = sent.group(RsiGroup::External, "EIPos")?;
    if expected.rail && external.is_none() {
        let remedy = "add <ELEMENT TAG=\"DEF_EIPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"/>";
        return Err(sent.missing("EIPos", "the rail is not sent", remedy));
    }
    if expected.rail && external_correction.is_none() {
        let remedy = "add <ELEMENT TAG=\"EK.E1\" TYPE=\"DOUBLE\" INDX=\"...\" HOLDON=\"1\"/>";
        return Err(received.missing("EK.E1", "the rail has no correction", remedy));
    }
    let tags = TagMap {
        sen_type,
        axes,
        axes_asked: sent.group(RsiGroup::AxesAsked, "ASPos")?,
        rail: expected.rail,
        // External axes without a measurement are not used.
        external_correction: external_correction.filter(|_| external.is_some()),
        external_asked: sent.group(RsiGroup::ExternalAsked, "ESPos")?.filter(|_| external.is_some()),
        external,
        pose: sent.group(RsiGroup::Pose, "RIst")?,
        pose_asked: sent.group(RsiGroup::PoseAsked, "RSol")?,
        torque: torque(&sent, expected.torque)?,
        delay: Some(delay(&sent)?),
        correction,
        stop: stop(&received)?,
        mode: expected.mode,
        cycle: expected.cycle,
    };
    tags.check()
        .map_err(|problem| FileError::new(0, "ROOT", problem, "compare the file with the output of --rsi-config"))?;
    Ok(EthernetFile { tags, host, port })
}

/// Reads host, port and `SENTYPE`.
fn config(document: &Document) -> Result<(String, u16, String), FileError> {
    let value = |key: &str, example: &str| {
        let found = document.config.iter().find(|entry| entry.key == key && !entry.value.is_empty());
        found.ok_or_else(|| {
            FileError::new(0, &format!("CONFIG/{key}"), "is missing", format!("write <{key}>{example}</{key}>"))
        })
    };
    let (sen_type, only_send) = (value("SENTYPE", "ImFree")?, value("ONLYSEND", "FALSE")?);
    if !is_xml_name(&sen_type.value) {
        let problem = format!("`{}` is not a name of at most 32 letters, digits, _ and -", sen_type.value);
        return Err(FileError::new(sen_type.line, "CONFIG/SENTYPE", problem, "write <SENTYPE>ImFree</SENTYPE>"));
    }
    if !only_send.value.eq_ignore_ascii_case("false") {
        let problem = format!("`{}`: the controller takes no corrections unless it is FALSE", only_send.value);
        return Err(FileError::new(only_send.line, "CONFIG/ONLYSEND", problem, "write <ONLYSEND>FALSE</ONLYSEND>"));
    }
    if let Some(protocol) = document.config.iter().find(|entry| entry.key == "PROTOCOL")
        && !protocol.value.eq_ignore_ascii_case("udp")
    {
        let problem = format!("`{}`: only UDP is supported", protocol.value);
        return Err(FileError::new(protocol.line, "CONFIG/PROTOCOL", problem, "write <PROTOCOL>UDP</PROTOCOL>"));
    }
    let (host, port) = (value("IP_NUMBER", "192.168.1.10")?, value("PORT", "59152")?);
    let number = port.value.parse().ok().filter(|number| *number > 0_u16).ok_or_else(|| {
        let problem = format!("`{}` is not a port of 1 to 65535", port.value);
        FileError::new(port.line, "CONFIG/PORT", problem, "write <PORT>59152</PORT>")
    })?;
    Ok((host.value.clone(), number, sen_type.value.clone()))
}

/// Elements of one direction.
struct Direction<'a> {
    name: &'static str,
    elements: &'a [Element],
}

impl<'a> Direction<'a> {
    /// Refuses duplicate tags and channels.
    fn new(name: &'static str, elements: &'a [Element]) -> Result<Self, FileError> {
        for (place, element) in elements.iter().enumerate() {
            let before = &elements[..place];
            if let Some(other) = before.iter().find(|other| other.tag == element.tag) {
                let problem = format!("duplicate of the tag in line {}", other.line);
                return Err(element.error(problem, "remove one of them"));
            }
            if let Some(other) =
                before.iter().find(|other| element.channel.is_some() && other.channel == element.channel)
            {
                let problem = format!("INDX is used by {} in line {}", other.tag, other.line);
                return Err(element.error(problem, "number the channels of a direction from 1 to 64, each once"));
            }
        }
        Ok(Self { name, elements })
    }

    fn missing(&self, tag: &str, problem: &str, remedy: &str) -> FileError {
        FileError::new(0, &format!("{}/ELEMENTS, TAG=\"{tag}\"", self.name), format!("is missing: {problem}"), remedy)
    }

    /// Returns the element of one attribute of a name.
    fn attribute(&self, name: &str, attribute: &str) -> Option<&'a Element> {
        self.elements.iter().find(|element| element.name == name && element.attribute.as_deref() == Some(attribute))
    }

    /// Returns the element that the controller fills by itself.
    fn internal(&self, name: &str) -> Option<&'a Element> {
        self.elements.iter().find(|element| element.tag.strip_prefix(INTERNAL_PREFIX) == Some(name))
    }

    /// Whether a name has any of these attributes.
    fn has_any(&self, name: &str, attributes: &[&str]) -> bool {
        attributes.iter().any(|attribute| self.attribute(name, attribute).is_some())
    }

    /// Returns the names that are wired channel by channel, in the order of the file.
    fn wired(&self) -> Vec<&'a str> {
        let mut names: Vec<&str> = Vec::new();
        for element in self.elements.iter().filter(|element| element.attribute.is_some()) {
            if !names.contains(&element.name.as_str()) {
                names.push(&element.name);
            }
        }
        names
    }

    /// Returns the name of a group, if it is sent; every attribute that a report needs must exist.
    fn group(&self, group: RsiGroup, name: &str) -> Result<Option<String>, FileError> {
        if let Some(internal) = self.internal(name) {
            internal.must_be(Kind::Double)?;
            return Ok(Some(name.to_owned()));
        }
        let attributes = group.attributes();
        if !self.has_any(name, &attributes) {
            return Ok(None);
        }
        let needed = if matches!(group, RsiGroup::External | RsiGroup::ExternalAsked) { 1 } else { attributes.len() };
        self.all(name, &attributes[..needed])?;
        Ok(Some(name.to_owned()))
    }

    /// Returns the elements of all these attributes of a name, of type DOUBLE.
    fn all(&self, name: &str, attributes: &[&str]) -> Result<Vec<&'a Element>, FileError> {
        let one = |attribute: &&str| {
            let element = self.attribute(name, attribute).ok_or_else(|| {
                let remedy = format!("add an element for each of {}", attributes.join(", "));
                self.missing(&format!("{name}.{attribute}"), "the other attributes exist", &remedy)
            })?;
            element.must_be(Kind::Double)?;
            Ok(element)
        };
        attributes.iter().map(one).collect()
    }
}

impl Element {
    fn error(&self, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        FileError::new(self.line, &format!("ELEMENT TAG=\"{}\"", self.tag), problem, remedy)
    }

    fn must_be(&self, kind: Kind) -> Result<(), FileError> {
        if self.kind == kind {
            return Ok(());
        }
        let problem = format!("TYPE is {}, must be {}", self.kind.word(), kind.word());
        Err(self.error(problem, format!("write TYPE=\"{}\"", kind.word())))
    }
}

/// Returns the elements of the corrections of axes and rail.
fn corrections(received: &Direction, mode: Correction) -> Result<(String, Option<String>), FileError> {
    let (axes, rail) = (RsiGroup::Axes.attributes(), "E1");
    let names = received.wired();
    let with = |attributes: &[&str], usual: &str| -> Result<Option<String>, FileError> {
        let found: Vec<&str> = names.iter().copied().filter(|name| received.has_any(name, attributes)).collect();
        match found[..] {
            [] => Ok(None),
            [one] => Ok(Some(one.to_owned())),
            [first, second, ..] if !found.contains(&usual) => {
                let problem = format!("{first} and {second} both have {}: the correction is ambiguous", attributes[0]);
                Err(received.missing(usual, &problem, &format!("name the correction {usual}")))
            }
            _ => Ok(Some(usual.to_owned())),
        }
    };
    let Some(correction) = with(&axes, "AK")? else {
        let cartesian = names.iter().find(|name| received.has_any(name, &RsiGroup::Pose.attributes()));
        let problem = match cartesian {
            Some(name) => format!("{name} corrects the Cartesian pose; softdock corrects axes"),
            None => "no element has A1 to A6: the axes cannot be corrected".to_owned(),
        };
        let remedy = "wire an AXISCORR object: <ELEMENT TAG=\"AK.A1\" TYPE=\"DOUBLE\" INDX=\"1\" HOLDON=\"1\"/>, A2 to A6 likewise";
        return Err(received.missing("AK.A1", &problem, remedy));
    };
    for element in received.all(&correction, &axes)? {
        holds(element, mode)?;
    }
    let external = with(&[rail], "EK")?;
    if let Some(name) = &external {
        for element in received.all(name, &[rail])? {
            holds(element, mode)?;
        }
    }
    Ok((correction, external))
}

/// Checks that a lost answer does not move the robot.
fn holds(element: &Element, mode: Correction) -> Result<(), FileError> {
    let (wanted, why) = match mode {
        Correction::Absolute => (true, "an offset that falls back to 0 at a lost answer jumps to the start"),
        Correction::Relative => (false, "an increment that is repeated at a lost answer is uncommanded motion"),
    };
    let word = u8::from(wanted);
    let problem = match element.hold_on {
        Some(hold_on) if hold_on == wanted => return Ok(()),
        Some(hold_on) => format!("HOLDON is {}, must be {word}: {why}", u8::from(hold_on)),
        None => format!("HOLDON is missing, must be {word}: {why}"),
    };
    let mode = if wanted { "absolute" } else { "relative" };
    Err(element.error(
        problem,
        format!("write HOLDON=\"{word}\" for mode={mode}, or state the mode of the controller's RSI_ON"),
    ))
}

/// Returns the element of the late answers.
fn delay(sent: &Direction) -> Result<String, FileError> {
    let element = sent.internal("Delay").or_else(|| sent.attribute("Delay", "D")).ok_or_else(|| {
        let problem = "untaken answers could not be detected";
        sent.missing("DEF_Delay", problem, "add <ELEMENT TAG=\"DEF_Delay\" TYPE=\"LONG\" INDX=\"INTERNAL\"/>")
    })?;
    element.must_be(Kind::Long)?;
    Ok("Delay".to_owned())
}

/// Returns the element of the torques of the axes.
fn torque(sent: &Direction, named: Option<&str>) -> Result<Option<String>, FileError> {
    let axes = RsiGroup::Axes.attributes();
    let own = sent.wired().into_iter().filter(|name| !matches!(*name, "AIPos" | "ASPos"));
    let candidates: Vec<&str> = own.filter(|name| sent.has_any(name, &axes)).collect();
    let name = match named {
        Some(name) if !candidates.contains(&name) => {
            let others = if candidates.is_empty() { "none".to_owned() } else { candidates.join(", ") };
            let problem = format!("torques are configured there; elements with A1 to A6 are: {others}");
            return Err(sent.missing(&format!("{name}.A1"), &problem, "set torque=NAME to one of these"));
        }
        Some(name) => name,
        None => {
            let says_so = |name: &str| TORQUE_WORDS.iter().any(|word| name.to_ascii_lowercase().contains(word));
            match candidates.into_iter().filter(|name| says_so(name)).collect::<Vec<_>>()[..] {
                [] => return Ok(None),
                [one] => one,
                [first, second, ..] => {
                    let problem = format!("{first} and {second} both have names for torques");
                    return Err(sent.missing(&format!("{first}.A1"), &problem, "select one with torque=NAME"));
                }
            }
        }
    };
    sent.all(name, &axes)?;
    Ok(Some(name.to_owned()))
}

/// Returns the element of our request to end the session, if the context has one.
fn stop(received: &Direction) -> Result<Option<String>, FileError> {
    let Some(element) = received.elements.iter().find(|element| element.tag == "Stop") else {
        return Ok(None);
    };
    if element.kind != Kind::Long {
        element.must_be(Kind::Bool)?;
    }
    Ok(Some("Stop".to_owned()))
}

#[cfg(test)]
mod tests;
