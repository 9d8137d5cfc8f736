//! The tag map of a controller, read from its `rsi_ethernet.xml`: tolerant to how the file is written, strict on what
//! it says.

mod parsing;

use super::tags::{Correction, RsiGroup, TagMap, is_xml_name};
use crate::time::Nanos;
use parsing::{Document, Element, Kind, parse};
use std::fmt;

/// Elements that the controller fills by itself are written `DEF_NAME` there, and sent as `NAME`.
const INTERNAL_PREFIX: &str = "DEF_";
/// Words by which an element of our own names is taken for torques of the axes.
const TORQUE_WORDS: [&str; 4] = ["torque", "trq", "moment", "eff"];

/// What the file does not say.
#[derive(Clone, Copy, Debug)]
pub struct RsiExpectation<'a> {
    /// Whether corrections are offsets or increments (`RSI_ON`).
    pub mode: Correction,
    /// Cycle of the controller.
    pub cycle: Nanos,
    /// The robot stands on a rail.
    pub rail: bool,
    /// The element that carries the torques; `None`: the one of `SEND` whose name says so, if there is one.
    pub torque: Option<&'a str>,
}

/// A controller's `rsi_ethernet.xml`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EthernetFile {
    /// Which elements carry which signals.
    pub tags: TagMap,
    /// Host that the controller sends to, as it is written there.
    pub host: String,
    /// Port that it sends to.
    pub port: u16,
}

/// What is wrong with the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FileError {
    /// Line, from 1; 0 if it is not about one line.
    pub line: usize,
    /// Element, as it is written there.
    pub element: String,
    /// What is wrong, with value and legal range.
    pub problem: String,
    /// What to do.
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

/// Reads an `rsi_ethernet.xml`.
///
/// Sent: `AIPos` and `Delay` must be there, and `EIPos` (or another element with `E1`) if there is a rail. `RIst`,
/// `RSol`, `ASPos`, `ESPos` and torques are used where they are. Received: an element with `A1` to `A6`, and one with
/// `E1` if there is a rail. Other elements are left alone.
///
/// # Errors
/// What is wrong, with line and element: no XML, a missing or doubled element, a type or channel that cannot be,
/// `ONLYSEND`, Cartesian corrections, and corrections whose `HOLDON` would move the robot when an answer is lost.
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
        // Without their measurement external axes are none of ours.
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
        .map_err(|problem| FileError::new(0, "ROOT", problem, "compare the file with what --rsi-config writes"))?;
    Ok(EthernetFile { tags, host, port })
}

/// Host, port and `SENTYPE`.
fn config(document: &Document) -> Result<(String, u16, String), FileError> {
    let value = |key: &str, example: &str| {
        let found = document.config.iter().find(|entry| entry.key == key && !entry.value.is_empty());
        found.ok_or_else(|| {
            FileError::new(0, &format!("CONFIG/{key}"), "is missing", format!("write <{key}>{example}</{key}>"))
        })
    };
    let (sen_type, only_send) = (value("SENTYPE", "ImFree")?, value("ONLYSEND", "FALSE")?);
    if !is_xml_name(&sen_type.value) {
        let problem = format!("`{}` is no name of at most 32 letters, digits, _ and -", sen_type.value);
        return Err(FileError::new(sen_type.line, "CONFIG/SENTYPE", problem, "write <SENTYPE>ImFree</SENTYPE>"));
    }
    if !only_send.value.eq_ignore_ascii_case("false") {
        let problem = format!("`{}`: the controller takes no corrections unless it is FALSE", only_send.value);
        return Err(FileError::new(only_send.line, "CONFIG/ONLYSEND", problem, "write <ONLYSEND>FALSE</ONLYSEND>"));
    }
    if let Some(protocol) = document.config.iter().find(|entry| entry.key == "PROTOCOL")
        && !protocol.value.eq_ignore_ascii_case("udp")
    {
        let problem = format!("`{}`: only UDP is spoken here", protocol.value);
        return Err(FileError::new(protocol.line, "CONFIG/PROTOCOL", problem, "write <PROTOCOL>UDP</PROTOCOL>"));
    }
    let (host, port) = (value("IP_NUMBER", "192.168.1.10")?, value("PORT", "59152")?);
    let number = port.value.parse().ok().filter(|number| *number > 0_u16).ok_or_else(|| {
        let problem = format!("`{}` is no port of 1 to 65535", port.value);
        FileError::new(port.line, "CONFIG/PORT", problem, "write <PORT>59152</PORT>")
    })?;
    Ok((host.value.clone(), number, sen_type.value.clone()))
}

/// The elements of one direction.
struct Direction<'a> {
    name: &'static str,
    elements: &'a [Element],
}

impl<'a> Direction<'a> {
    /// Refuses a tag or a channel that is there twice.
    fn new(name: &'static str, elements: &'a [Element]) -> Result<Self, FileError> {
        for (place, element) in elements.iter().enumerate() {
            let before = &elements[..place];
            if let Some(other) = before.iter().find(|other| other.tag == element.tag) {
                let problem = format!("this tag stands in line {} already", other.line);
                return Err(element.error(problem, "remove one of both"));
            }
            if let Some(other) =
                before.iter().find(|other| element.channel.is_some() && other.channel == element.channel)
            {
                let problem = format!("INDX is that of {} in line {}", other.tag, other.line);
                return Err(element.error(problem, "number the channels of a direction from 1 to 64, each once"));
            }
        }
        Ok(Self { name, elements })
    }

    fn missing(&self, tag: &str, problem: &str, remedy: &str) -> FileError {
        FileError::new(0, &format!("{}/ELEMENTS, TAG=\"{tag}\"", self.name), format!("is missing: {problem}"), remedy)
    }

    /// The element that carries one attribute of a name.
    fn attribute(&self, name: &str, attribute: &str) -> Option<&'a Element> {
        self.elements.iter().find(|element| element.name == name && element.attribute.as_deref() == Some(attribute))
    }

    /// The element that the controller fills by itself.
    fn internal(&self, name: &str) -> Option<&'a Element> {
        self.elements.iter().find(|element| element.tag.strip_prefix(INTERNAL_PREFIX) == Some(name))
    }

    /// Whether a name has any of these attributes.
    fn has_any(&self, name: &str, attributes: &[&str]) -> bool {
        attributes.iter().any(|attribute| self.attribute(name, attribute).is_some())
    }

    /// Names that are wired channel by channel, in the order of the file.
    fn wired(&self) -> Vec<&'a str> {
        let mut names: Vec<&str> = Vec::new();
        for element in self.elements.iter().filter(|element| element.attribute.is_some()) {
            if !names.contains(&element.name.as_str()) {
                names.push(&element.name);
            }
        }
        names
    }

    /// The name of a group, if it is sent at all; every attribute that a report needs must be there.
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

    /// Elements of all these attributes of a name, of type DOUBLE.
    fn all(&self, name: &str, attributes: &[&str]) -> Result<Vec<&'a Element>, FileError> {
        let one = |attribute: &&str| {
            let element = self.attribute(name, attribute).ok_or_else(|| {
                let remedy = format!("add an element for each of {}", attributes.join(", "));
                self.missing(&format!("{name}.{attribute}"), "the other attributes are there", &remedy)
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

/// Elements of the corrections of axes and rail.
fn corrections(received: &Direction, mode: Correction) -> Result<(String, Option<String>), FileError> {
    let (axes, rail) = (RsiGroup::Axes.attributes(), "E1");
    let names = received.wired();
    let with = |attributes: &[&str], usual: &str| -> Result<Option<String>, FileError> {
        let found: Vec<&str> = names.iter().copied().filter(|name| received.has_any(name, attributes)).collect();
        match found[..] {
            [] => Ok(None),
            [one] => Ok(Some(one.to_owned())),
            [first, second, ..] if !found.contains(&usual) => {
                let problem = format!("{first} and {second} both have {}: which one is the correction?", attributes[0]);
                Err(received.missing(usual, &problem, &format!("call the correction {usual}")))
            }
            _ => Ok(Some(usual.to_owned())),
        }
    };
    let Some(correction) = with(&axes, "AK")? else {
        let cartesian = names.iter().find(|name| received.has_any(name, &RsiGroup::Pose.attributes()));
        let problem = match cartesian {
            Some(name) => format!("{name} corrects the Cartesian pose, and axes are corrected here"),
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

/// Whether a lost answer leaves the robot where it is.
fn holds(element: &Element, mode: Correction) -> Result<(), FileError> {
    let (wanted, why) = match mode {
        Correction::Absolute => (true, "an offset that falls back to 0 with a lost answer is a jump to the start"),
        Correction::Relative => {
            (false, "an increment that is repeated with a lost answer is motion that nobody asked for")
        }
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
        format!("write HOLDON=\"{word}\" for mode={mode}, or give the mode of the controller's RSI_ON"),
    ))
}

/// The element of the late answers.
fn delay(sent: &Direction) -> Result<String, FileError> {
    let element = sent.internal("Delay").or_else(|| sent.attribute("Delay", "D")).ok_or_else(|| {
        let problem = "answers that the controller has not taken would go unseen";
        sent.missing("DEF_Delay", problem, "add <ELEMENT TAG=\"DEF_Delay\" TYPE=\"LONG\" INDX=\"INTERNAL\"/>")
    })?;
    element.must_be(Kind::Long)?;
    Ok("Delay".to_owned())
}

/// The element that carries torques of the axes.
fn torque(sent: &Direction, named: Option<&str>) -> Result<Option<String>, FileError> {
    let axes = RsiGroup::Axes.attributes();
    let own = sent.wired().into_iter().filter(|name| !matches!(*name, "AIPos" | "ASPos"));
    let candidates: Vec<&str> = own.filter(|name| sent.has_any(name, &axes)).collect();
    let name = match named {
        Some(name) if !candidates.contains(&name) => {
            let others = if candidates.is_empty() { "none".to_owned() } else { candidates.join(", ") };
            let problem = format!("torques are to be read there; elements with A1 to A6 are: {others}");
            return Err(sent.missing(&format!("{name}.A1"), &problem, "give torque=NAME one of these"));
        }
        Some(name) => name,
        None => {
            let says_so = |name: &str| TORQUE_WORDS.iter().any(|word| name.to_ascii_lowercase().contains(word));
            match candidates.into_iter().filter(|name| says_so(name)).collect::<Vec<_>>()[..] {
                [] => return Ok(None),
                [one] => one,
                [first, second, ..] => {
                    let problem = format!("{first} and {second} both look like torques");
                    return Err(sent.missing(&format!("{first}.A1"), &problem, "say which one with torque=NAME"));
                }
            }
        }
    };
    sent.all(name, &axes)?;
    Ok(Some(name.to_owned()))
}

/// The element of our request to end the session, if the context has it.
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
