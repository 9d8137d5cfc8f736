//! The two messages of RSI: `<Rob>` from the controller and `<Sen>` from us, in the controller's units (deg, mm).

use super::scan::{Event, RsiFormatError, Scan};
use super::tags::{RsiGroup, TagMap};
use crate::protocol::text::Text;
use std::fmt::{self, Write};

/// Greatest length of a written message: public simulators read 1024 bytes.
pub const MAX_MESSAGE: usize = 1024;

/// A message under construction.
pub(crate) type Message = Text<MAX_MESSAGE>;

/// A controller's report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rob {
    groups: [[f64; 6]; RsiGroup::ALL.len()],
    /// Present values of each group, one bit each.
    present: [u8; RsiGroup::ALL.len()],
    /// Late answers counted by the controller.
    pub delay: u32,
    /// Its time, which an answer must repeat.
    pub ipoc: u64,
}

impl Rob {
    /// Creates a report without values.
    pub fn new(ipoc: u64, delay: u32) -> Self {
        Self { groups: [[0.0; 6]; RsiGroup::ALL.len()], present: [0; RsiGroup::ALL.len()], delay, ipoc }
    }

    /// Returns the values of a group \[deg, mm, N m\]; zeros if absent.
    pub fn group(&self, group: RsiGroup) -> [f64; 6] {
        self.groups[group as usize]
    }

    /// Sets the values of a group.
    pub fn set(&mut self, group: RsiGroup, values: [f64; 6]) {
        self.groups[group as usize] = values;
        self.present[group as usize] = 0b11_1111;
    }

    /// Whether every mapped group is present (of the external axes, the rail).
    pub fn is_complete(&self, tags: &TagMap) -> bool {
        tags.is_complete(&self.present)
    }

    /// Parses a report. Skips unknown elements and attributes: contexts may send more.
    ///
    /// # Errors
    /// If the bytes are another message, lack the IPOC, or contain a duplicate or non-finite value.
    pub fn read(datagram: &[u8], tags: &TagMap) -> Result<Self, RsiFormatError> {
        let mut rob = Self::new(0, 0);
        let mut ipoc = None;
        let mut scan = Scan::new(datagram);
        while let Some(event) = scan.next()? {
            match event {
                Event::Begin { element, depth: 0 } if element != b"Rob" => return Err(RsiFormatError),
                Event::Attribute { element, name, value } => rob.take_attribute(tags, element, name, value)?,
                Event::Text { element: b"IPOC", text } => set_once(&mut ipoc, whole(text)?)?,
                _ => {}
            }
        }
        rob.ipoc = ipoc.ok_or(RsiFormatError)?;
        Ok(rob)
    }

    fn take_attribute(
        &mut self,
        tags: &TagMap,
        element: &[u8],
        name: &[u8],
        value: &[u8],
    ) -> Result<(), RsiFormatError> {
        if name == b"D" && tags.delay.as_ref().is_some_and(|tag| tag.as_bytes() == element) {
            self.delay = u32::try_from(whole(value)?).map_err(|_| RsiFormatError)?;
            return Ok(());
        }
        for group in RsiGroup::ALL {
            if tags.element(group).is_some_and(|tag| tag.as_bytes() == element) {
                if let Some(index) = group.attributes().iter().position(|known| known.as_bytes() == name) {
                    let bit = 1 << index;
                    if self.present[group as usize] & bit != 0 {
                        return Err(RsiFormatError);
                    }
                    self.present[group as usize] |= bit;
                    self.groups[group as usize][index] = number(value)?;
                }
                return Ok(());
            }
        }
        Ok(())
    }

    /// Serialises the report for KUKA's client library: groups in fixed order, no blanks, six decimals.
    ///
    /// # Errors
    /// If it does not fit.
    pub(crate) fn write(&self, tags: &TagMap, message: &mut Message) -> fmt::Result {
        message.clear();
        message.write_str("<Rob Type=\"KUKA\">")?;
        for group in RsiGroup::ALL {
            if let Some(element) = tags.element(group) {
                write_group(message, element, group.attributes(), &self.group(group))?;
            }
        }
        if let Some(element) = &tags.delay {
            write!(message, "<{element} D=\"{}\"/>", self.delay)?;
        }
        write!(message, "<IPOC>{}</IPOC></Rob>", self.ipoc)
    }
}

/// Our answer, or a client's answer as parsed by an emulated controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sen {
    /// Corrections of the axes \[deg\]; `None` if absent.
    pub axes: [Option<f64>; 6],
    /// Correction of the rail \[mm\].
    pub rail: Option<f64>,
    /// Whether the client requests the end.
    pub stop: bool,
    /// The answered IPOC.
    pub ipoc: u64,
}

impl Sen {
    /// Parses an answer of the right `SENTYPE`.
    ///
    /// # Errors
    /// If the bytes are another message or type, lack the IPOC, or contain a non-finite value.
    pub fn read(datagram: &[u8], tags: &TagMap) -> Result<Self, RsiFormatError> {
        let mut sen = Self { axes: [None; 6], rail: None, stop: false, ipoc: 0 };
        let (mut ipoc, mut of_type) = (None, false);
        let mut scan = Scan::new(datagram);
        while let Some(event) = scan.next()? {
            match event {
                Event::Begin { element, depth: 0 } if element != b"Sen" => return Err(RsiFormatError),
                Event::Attribute { element: b"Sen", name, value } if name.eq_ignore_ascii_case(b"type") => {
                    of_type = value == tags.sen_type.as_bytes();
                }
                Event::Attribute { element, name, value } => sen.take_attribute(tags, element, name, value)?,
                Event::Text { element: b"IPOC", text } => set_once(&mut ipoc, whole(text)?)?,
                Event::Text { element, text } if tags.stop.as_ref().is_some_and(|tag| tag.as_bytes() == element) => {
                    sen.stop = whole(text)? != 0;
                }
                _ => {}
            }
        }
        sen.ipoc = ipoc.ok_or(RsiFormatError)?;
        if of_type { Ok(sen) } else { Err(RsiFormatError) }
    }

    fn take_attribute(
        &mut self,
        tags: &TagMap,
        element: &[u8],
        name: &[u8],
        value: &[u8],
    ) -> Result<(), RsiFormatError> {
        let external = tags.external_correction.as_ref().is_some_and(|tag| tag.as_bytes() == element);
        if name == b"E1" && external {
            set_once(&mut self.rail, number(value)?)?;
        } else if element == tags.correction.as_bytes()
            && let Some(index) = RsiGroup::Axes.attributes().iter().position(|known| known.as_bytes() == name)
        {
            set_once(&mut self.axes[index], number(value)?)?;
        }
        Ok(())
    }

    /// Serialises the answer: internal axes before external ones, six decimals.
    ///
    /// # Errors
    /// If it does not fit, or a value is not finite.
    pub(crate) fn write(&self, tags: &TagMap, message: &mut Message) -> fmt::Result {
        message.clear();
        write!(message, "<Sen Type=\"{}\">", tags.sen_type)?;
        let axes = self.axes.map(|value| value.unwrap_or(0.0));
        let rail = self.rail.unwrap_or(0.0);
        match &tags.external_correction {
            // One element for all of them.
            Some(element) if *element == tags.correction => {
                let [a1, a2, a3, a4, a5, a6] = axes;
                let names = ["A1", "A2", "A3", "A4", "A5", "A6", "E1"];
                write_group(message, element, names, &[a1, a2, a3, a4, a5, a6, rail])?;
            }
            external => {
                write_group(message, &tags.correction, RsiGroup::Axes.attributes(), &axes)?;
                if let Some(element) = external {
                    write_group(message, element, ["E1"], &[rail])?;
                }
            }
        }
        if let Some(element) = &tags.stop {
            write!(message, "<{element}>{}</{element}>", u8::from(self.stop))?;
        }
        write!(message, "<IPOC>{}</IPOC></Sen>", self.ipoc)
    }
}

fn write_group<const N: usize>(
    message: &mut Message,
    element: &str,
    attributes: [&str; N],
    values: &[f64; N],
) -> fmt::Result {
    write!(message, "<{element}")?;
    for (name, &value) in attributes.iter().zip(values) {
        if !value.is_finite() {
            return Err(fmt::Error);
        }
        // No "-0.000000": a value that rounds to zero is zero.
        let value = if value.abs() < 5e-7 { 0.0 } else { value };
        write!(message, " {name}=\"{value:.6}\"")?;
    }
    message.write_str("/>")
}

fn set_once<T>(place: &mut Option<T>, value: T) -> Result<(), RsiFormatError> {
    if place.replace(value).is_some() { Err(RsiFormatError) } else { Ok(()) }
}

/// Parses a finite decimal number; refuses `inf`, `nan` and overflow.
fn number(text: &[u8]) -> Result<f64, RsiFormatError> {
    let text = std::str::from_utf8(text.trim_ascii()).map_err(|_| RsiFormatError)?;
    let value: f64 = text.parse().map_err(|_| RsiFormatError)?;
    if value.is_finite() { Ok(value) } else { Err(RsiFormatError) }
}

fn whole(text: &[u8]) -> Result<u64, RsiFormatError> {
    let text = std::str::from_utf8(text.trim_ascii()).map_err(|_| RsiFormatError)?;
    text.parse().map_err(|_| RsiFormatError)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::rsi::tags::Correction;
    use proptest::prelude::*;

    const ROS: &str = "<Rob Type=\"KUKA\"><RIst X=\"1000.0\" Y=\"0.0\" Z=\"1500.5\" A=\"10.0\" B=\"-20.0\" C=\"30.0\" />\
        <RSol X=\"1000.0\" Y=\"0.0\" Z=\"1500.5\" A=\"10.0\" B=\"-20.0\" C=\"30.0\" />\
        <AIPos A1=\"1.5\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"45.0\" A6=\"-0.25\" />\
        <ASPos A1=\"1.5\" A2=\"-90.0\" A3=\"90.0\" A4=\"0.0\" A5=\"45.0\" A6=\"-0.25\" />\
        <EIPos E1=\"1200.0\" E2=\"0.0\" E3=\"0.0\" E4=\"0.0\" E5=\"0.0\" E6=\"0.0\" />\
        <MACur A1=\"0.1\" /><Delay D=\"3\" /><IPOC>4208163634</IPOC></Rob>";

    fn tags() -> TagMap {
        TagMap { external_asked: None, ..TagMap::im_free().with_rail() }
    }

    #[test]
    fn message_of_the_ros_driver_is_parsed() {
        let rob = Rob::read(ROS.as_bytes(), &tags()).unwrap();
        assert!(rob.is_complete(&tags()));
        assert_eq!((rob.ipoc, rob.delay), (4_208_163_634, 3));
        assert_eq!(rob.group(RsiGroup::Axes), [1.5, -90.0, 90.0, 0.0, 45.0, -0.25]);
        assert_eq!(rob.group(RsiGroup::External)[0], 1200.0);
        assert_eq!(rob.group(RsiGroup::Pose), [1000.0, 0.0, 1500.5, 10.0, -20.0, 30.0]);
    }

    #[test]
    fn other_messages_are_refused() {
        for (good, bad) in [
            ("A1=\"1.5\"", "A1=\"nan\""),
            ("A1=\"1.5\"", "A1=\"1e999\""),
            ("A1=\"1.5\"", "A1=\"inf\""),
            ("A1=\"1.5\"", "A1=\"\""),
            ("A1=\"1.5\"", "A2=\"1.5\""),
            ("4208163634", "99999999999999999999999"),
            ("4208163634", "-1"),
            ("<IPOC>", "<IPOX>"),
            ("<Rob ", "<Sen "),
        ] {
            assert_eq!(Rob::read(ROS.replacen(good, bad, 1).as_bytes(), &tags()), Err(RsiFormatError), "{bad}");
        }
        let other = Rob::read(ROS.replace("ASPos", "ABPos").as_bytes(), &tags()).unwrap();
        assert!(!other.is_complete(&tags()));
    }

    #[test]
    fn answer_matches_reference_bytes() {
        let sen = Sen {
            axes: [0.0, -1e-9, 0.5, -0.000_001, 12.345_678_9, 0.0].map(Some),
            rail: Some(-2.5),
            stop: false,
            ipoc: 4_208_163_634,
        };
        let mut message = Message::new();
        sen.write(&TagMap::kroshu().with_rail(), &mut message).unwrap();
        let golden = "<Sen Type=\"KROSHU\"><AK A1=\"0.000000\" A2=\"0.000000\" A3=\"0.500000\" A4=\"-0.000001\" \
            A5=\"12.345679\" A6=\"0.000000\"/><EK E1=\"-2.500000\"/><Stop>0</Stop><IPOC>4208163634</IPOC></Sen>";
        assert_eq!(std::str::from_utf8(message.as_bytes()), Ok(golden));
        let nan = Sen { rail: Some(f64::NAN), ..sen };
        assert!(nan.write(&tags(), &mut message).is_err());
    }

    #[test]
    fn emulated_controller_writes_fixed_order() {
        let mut rob = Rob::new(8, 0);
        rob.set(RsiGroup::Axes, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let mut message = Message::new();
        rob.write(&TagMap::kroshu().with_rail(), &mut message).unwrap();
        let golden = "<Rob Type=\"KUKA\"><RIst X=\"0.000000\" Y=\"0.000000\" Z=\"0.000000\" A=\"0.000000\" \
            B=\"0.000000\" C=\"0.000000\"/><AIPos A1=\"1.000000\" A2=\"2.000000\" A3=\"3.000000\" A4=\"4.000000\" \
            A5=\"5.000000\" A6=\"6.000000\"/><EIPos E1=\"0.000000\" E2=\"0.000000\" E3=\"0.000000\" E4=\"0.000000\" \
            E5=\"0.000000\" E6=\"0.000000\"/><Delay D=\"0\"/><IPOC>8</IPOC></Rob>";
        assert_eq!(std::str::from_utf8(message.as_bytes()), Ok(golden));
    }

    #[test]
    fn external_axes_have_fixed_offsets_without_a_rail() {
        let mut rob = Rob::new(357, 15);
        rob.set(RsiGroup::Axes, [5.32, 6.4, 111.3, 12.2, 0.0, 12.5]);
        let mut message = Message::new();
        rob.write(&TagMap::kroshu(), &mut message).unwrap();
        let text = std::str::from_utf8(message.as_bytes()).unwrap();
        // The order of its own tests, with fixed offsets.
        let places = ["<RIst X=", "<AIPos A1=", "/><EIPos E1=", "/><Delay D=\"15\"/><IPOC>357</IPOC></Rob>"];
        let found: Vec<_> = places.iter().map(|place| text.find(place)).collect();
        assert!(found.iter().all(Option::is_some) && found.is_sorted(), "{text}");
        let sen = Sen { axes: [Some(0.0); 6], rail: None, stop: false, ipoc: 357 };
        sen.write(&TagMap::kroshu(), &mut message).unwrap();
        let text = std::str::from_utf8(message.as_bytes()).unwrap();
        assert!(text.contains("/><EK E1=\"0.000000\"/><Stop>0</Stop><IPOC>357</IPOC></Sen>"), "{text}");
        // The library's own answer for six axes: Stop first, no external axes.
        let theirs = "<Sen Type=\"KROSHU\"><Stop>0</Stop><AK A1=\"-1.000000\" A2=\"-1.000000\" A3=\"-1.000000\" \
            A4=\"-1.000000\" A5=\"-1.000000\" A6=\"-1.000000\"/><IPOC>0</IPOC></Sen>";
        let read = Sen::read(theirs.as_bytes(), &TagMap::kroshu()).unwrap();
        assert_eq!((read.axes, read.rail, read.stop), ([Some(-1.0); 6], None, false));
    }

    #[test]
    fn axes_and_rail_may_share_an_element() {
        let tags = TagMap { external_correction: Some("AK".to_owned()), ..TagMap::im_free().with_rail() };
        let sen = Sen { axes: [1.0; 6].map(Some), rail: Some(-2.5), stop: false, ipoc: 9 };
        let mut message = Message::new();
        sen.write(&tags, &mut message).unwrap();
        let text = std::str::from_utf8(message.as_bytes()).unwrap();
        assert!(text.contains(" A6=\"1.000000\" E1=\"-2.500000\"/><Stop>"), "{text}");
        assert_eq!(Sen::read(message.as_bytes(), &tags), Ok(sen));
    }

    #[test]
    fn answer_of_another_type_is_refused() {
        let text = b"<Sen Type=\"ImFree\"><Stop>0</Stop><AK A1=\"1.0\"/><IPOC>7</IPOC></Sen>";
        assert_eq!(Sen::read(text, &TagMap::im_free()).map(|sen| (sen.axes[0], sen.ipoc)), Ok((Some(1.0), 7)));
        assert_eq!(Sen::read(text, &TagMap::kroshu()), Err(RsiFormatError));
    }

    proptest! {
        #[test]
        fn reports_return(axes in prop::array::uniform6(-360.0..360.0f64), rail in -1e4..1e4f64,
            ipoc: u64, delay: u32) {
            let tags = TagMap { mode: Correction::Relative, ..TagMap::im_free().with_rail() };
            let mut rob = Rob::new(ipoc, delay);
            for group in RsiGroup::ALL {
                rob.set(group, axes);
            }
            rob.set(RsiGroup::External, [rail; 6]);
            let mut message = Message::new();
            let tags = TagMap { pose: None, pose_asked: None, external_asked: None, ..tags };
            rob.write(&tags, &mut message).unwrap();
            let back = Rob::read(message.as_bytes(), &tags).unwrap();
            prop_assert!(back.is_complete(&tags));
            prop_assert_eq!((back.ipoc, back.delay), (ipoc, delay));
            for (a, b) in back.group(RsiGroup::Axes).iter().zip(axes) {
                prop_assert!((a - b).abs() <= 5.1e-7);
            }
            prop_assert!((back.group(RsiGroup::External)[0] - rail).abs() <= 5.1e-7);
        }

        #[test]
        fn answers_return(axes in prop::array::uniform6(-360.0..360.0f64), rail in -1e4..1e4f64, stop: bool,
            ipoc: u64) {
            let tags = TagMap::kroshu().with_rail();
            let sen = Sen { axes: axes.map(Some), rail: Some(rail), stop, ipoc };
            let mut message = Message::new();
            sen.write(&tags, &mut message).unwrap();
            let back = Sen::read(message.as_bytes(), &tags).unwrap();
            prop_assert_eq!((back.ipoc, back.stop), (ipoc, stop));
            for (a, b) in back.axes.iter().zip(axes) {
                prop_assert!((a.unwrap() - b).abs() <= 5.1e-7);
            }
        }
    }
}
