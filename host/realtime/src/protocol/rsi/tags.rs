//! Maps signals to XML elements, as configured in the controller's RSI context and `rsi_ethernet.xml`.

use super::CYCLE;
use crate::time::Nanos;

/// Meaning of the numbers of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Correction {
    /// Offsets from the set-points at `RSI_ON(#ABSOLUTE)`.
    Absolute,
    /// Increments of the set-points per cycle, `RSI_ON(#RELATIVE)`.
    Relative,
}

/// A group of up to six values that share an element of the controller's message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RsiGroup {
    /// Measured axes A1 to A6 \[deg\].
    Axes,
    /// Set-points of the axes \[deg\].
    AxesAsked,
    /// Measured external axes E1 to E6; the rail is E1 \[mm\].
    External,
    /// Set-points of the external axes.
    ExternalAsked,
    /// Pose of the tool in the base: X, Y, Z \[mm\], A, B, C \[deg\].
    Pose,
    /// Set-points of that pose.
    PoseAsked,
    /// Torques of the axes A1 to A6 \[N m\].
    Torque,
}

impl RsiGroup {
    /// All groups, in message order.
    pub const ALL: [Self; 7] =
        [Self::Pose, Self::PoseAsked, Self::Axes, Self::AxesAsked, Self::External, Self::ExternalAsked, Self::Torque];

    /// Returns the names of the attributes.
    pub fn attributes(self) -> [&'static str; 6] {
        match self {
            Self::Axes | Self::AxesAsked | Self::Torque => ["A1", "A2", "A3", "A4", "A5", "A6"],
            Self::External | Self::ExternalAsked => ["E1", "E2", "E3", "E4", "E5", "E6"],
            Self::Pose | Self::PoseAsked => ["X", "Y", "Z", "A", "B", "C"],
        }
    }
}

/// Elements of both messages. `None`: the controller does not send or take it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TagMap {
    /// `SENTYPE` of the context, `Type` of our answers.
    pub sen_type: String,
    /// Measured axes; required.
    pub axes: String,
    /// Set-points of the axes.
    pub axes_asked: Option<String>,
    /// Whether the robot has a rail: E1 of the external axes. Without one, mapped external axes are zero in both
    /// directions.
    pub rail: bool,
    /// External axes.
    pub external: Option<String>,
    /// Set-points of the external axes.
    pub external_asked: Option<String>,
    /// Pose of the tool.
    pub pose: Option<String>,
    /// Set-points of that pose.
    pub pose_asked: Option<String>,
    /// Torques, mapped to a separate element by the context.
    pub torque: Option<String>,
    /// Late answers, attribute `D`.
    pub delay: Option<String>,
    /// Our corrections of the axes, attributes A1 to A6 \[deg\].
    pub correction: String,
    /// Our correction of the rail, attribute E1 \[mm\].
    pub external_correction: Option<String>,
    /// Our request to end the session.
    pub stop: Option<String>,
    /// Meaning of our numbers.
    pub mode: Correction,
    /// Cycle of the controller: 4 ms (`IPO_FAST`) or 12 ms (`IPO`).
    pub cycle: Nanos,
}

impl TagMap {
    /// Returns the tags of the open ROS driver for plain arms, with corrections as offsets at 4 ms.
    pub fn im_free() -> Self {
        let tag = |name: &str| Some(name.to_owned());
        Self {
            sen_type: "ImFree".to_owned(),
            axes: "AIPos".to_owned(),
            axes_asked: tag("ASPos"),
            rail: false,
            external: None,
            external_asked: None,
            pose: tag("RIst"),
            pose_asked: tag("RSol"),
            torque: None,
            delay: tag("Delay"),
            correction: "AK".to_owned(),
            external_correction: None,
            stop: tag("Stop"),
            mode: Correction::Absolute,
            cycle: CYCLE,
        }
    }

    /// Returns the tags that KUKA's own client library reads by fixed offset (pose, axes, external axes, delay, IPOC),
    /// at 4 ms. External axes are present there with or without a rail.
    pub fn kroshu() -> Self {
        let (external, external_correction) = (Some("EIPos".to_owned()), Some("EK".to_owned()));
        let plain = Self { sen_type: "KROSHU".to_owned(), axes_asked: None, pose_asked: None, ..Self::im_free() };
        Self { external, external_correction, ..plain }
    }

    /// Adds a rail: measured in `EIPos`, corrected by `EK`.
    pub fn with_rail(self) -> Self {
        let external_asked = self.axes_asked.is_some().then(|| "ESPos".to_owned());
        let (external, external_correction) = (Some("EIPos".to_owned()), Some("EK".to_owned()));
        Self { rail: true, external, external_asked, external_correction, ..self }
    }

    /// Returns the element of a group.
    pub fn element(&self, group: RsiGroup) -> Option<&str> {
        match group {
            RsiGroup::Axes => Some(&self.axes),
            RsiGroup::AxesAsked => self.axes_asked.as_deref(),
            RsiGroup::External => self.external.as_deref(),
            RsiGroup::ExternalAsked => self.external_asked.as_deref(),
            RsiGroup::Pose => self.pose.as_deref(),
            RsiGroup::PoseAsked => self.pose_asked.as_deref(),
            RsiGroup::Torque => self.torque.as_deref(),
        }
    }

    /// Checks the map.
    ///
    /// # Errors
    /// States the problem: an invalid XML name, a rail that is not measured or not corrected, a fractional cycle.
    pub fn check(&self) -> Result<(), &'static str> {
        let sent = RsiGroup::ALL.iter().filter_map(|&group| self.element(group));
        let others = [&self.delay, &self.external_correction, &self.stop];
        let mut names = sent.chain(others.into_iter().flatten().map(String::as_str)).chain([self.correction.as_str()]);
        if names.any(|name| !is_xml_name(name)) || !is_xml_name(&self.sen_type) {
            return Err("a tag is not an XML name");
        }
        if self.external_correction.is_some() && self.external.is_none() {
            return Err("corrected external axes are not measured");
        }
        if self.rail && self.external_correction.is_none() {
            return Err("the rail has no element for its correction");
        }
        if self.cycle.0 <= 0 || self.cycle.0 % 1_000_000 != 0 {
            return Err("the RSI cycle is not a whole number of milliseconds");
        }
        Ok(())
    }

    /// Returns the cycle in whole milliseconds, the growth of a real controller's IPOC.
    pub fn cycle_millis(&self) -> u64 {
        (self.cycle.0 / 1_000_000).max(1) as u64
    }

    /// Whether a mapped element has all attributes of a state: of the external axes only the rail.
    pub(super) fn is_complete(&self, present: &[u8; RsiGroup::ALL.len()]) -> bool {
        RsiGroup::ALL.iter().all(|&group| {
            let needed = if matches!(group, RsiGroup::External | RsiGroup::ExternalAsked) { 0b1 } else { 0b11_1111 };
            self.element(group).is_none() || present[group as usize] & needed == needed
        })
    }
}

/// Whether a name is short, consists of letters, digits, `_` and `-`, and begins with a letter.
pub(super) fn is_xml_name(name: &str) -> bool {
    let letters = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-');
    name.len() <= 32 && name.starts_with(|first: char| first.is_ascii_alphabetic()) && name.bytes().all(letters)
}
