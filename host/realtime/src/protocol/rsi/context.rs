//! Writes the controller's configuration (`rsi_ethernet.xml`) from the tag map, so that both sides agree.

use super::tags::{Correction, RsiGroup, TagMap};
use std::fmt::Write;
use std::net::SocketAddr;

/// Elements that the controller fills by itself; the RSI context wires all others, channel by channel.
const INTERNAL: [&str; 9] = ["RIst", "RSol", "AIPos", "ASPos", "EIPos", "ESPos", "MACur", "MECur", "Delay"];

/// Returns the `rsi_ethernet.xml` of a controller that sends to `address`.
///
/// Offsets keep their last value over a lost answer (`HOLDON="1"`): falling back to 0 would be a jump to the start
/// pose. Increments fall back to 0: a repeated increment would be an uncommanded motion.
pub fn rsi_ethernet(tags: &TagMap, address: SocketAddr) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_config(&mut text, tags, address);
    text
}

fn write_config(text: &mut String, tags: &TagMap, address: SocketAddr) -> std::fmt::Result {
    writeln!(text, "<ROOT>\n  <CONFIG>")?;
    writeln!(text, "    <IP_NUMBER>{}</IP_NUMBER>\n    <PORT>{}</PORT>", address.ip(), address.port())?;
    writeln!(text, "    <SENTYPE>{}</SENTYPE>\n    <ONLYSEND>FALSE</ONLYSEND>\n  </CONFIG>", tags.sen_type)?;
    writeln!(text, "  <SEND>\n    <ELEMENTS>")?;
    let mut channel = 1;
    for group in RsiGroup::ALL {
        if let Some(element) = tags.element(group) {
            write_sent(text, element, &group.attributes(), "DOUBLE", &mut channel)?;
        }
    }
    if let Some(element) = &tags.delay {
        write_sent(text, element, &["D"], "LONG", &mut channel)?;
    }
    writeln!(text, "    </ELEMENTS>\n  </SEND>\n  <RECEIVE>\n    <ELEMENTS>")?;
    write_received(text, tags)?;
    writeln!(text, "    </ELEMENTS>\n  </RECEIVE>\n</ROOT>")
}

fn write_sent(
    text: &mut String,
    element: &str,
    attributes: &[&str],
    kind: &str,
    channel: &mut u32,
) -> std::fmt::Result {
    if INTERNAL.contains(&element) {
        return writeln!(text, "      <ELEMENT TAG=\"DEF_{element}\" TYPE=\"{kind}\" INDX=\"INTERNAL\"/>");
    }
    for attribute in attributes {
        writeln!(text, "      <ELEMENT TAG=\"{element}.{attribute}\" TYPE=\"{kind}\" INDX=\"{channel}\"/>")?;
        *channel += 1;
    }
    Ok(())
}

fn write_received(text: &mut String, tags: &TagMap) -> std::fmt::Result {
    let hold = u8::from(tags.mode == Correction::Absolute);
    let mut channel = 1;
    if let Some(element) = &tags.stop {
        writeln!(text, "      <ELEMENT TAG=\"{element}\" TYPE=\"BOOL\" INDX=\"{channel}\" HOLDON=\"0\"/>")?;
        channel += 1;
    }
    let axes = RsiGroup::Axes.attributes().map(|axis| (tags.correction.as_str(), axis));
    let rail = tags.external_correction.as_ref().map(|element| (element.as_str(), "E1"));
    for (element, axis) in axes.into_iter().chain(rail) {
        writeln!(
            text,
            "      <ELEMENT TAG=\"{element}.{axis}\" TYPE=\"DOUBLE\" INDX=\"{channel}\" HOLDON=\"{hold}\"/>"
        )?;
        channel += 1;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn configuration_matches_the_tag_map() {
        let tags = TagMap { torque: Some("GearTorque".to_owned()), ..TagMap::kroshu().with_rail() };
        let text = rsi_ethernet(&tags, "192.168.1.10:59152".parse().unwrap());
        for line in [
            "<IP_NUMBER>192.168.1.10</IP_NUMBER>",
            "<PORT>59152</PORT>",
            "<SENTYPE>KROSHU</SENTYPE>",
            "<ELEMENT TAG=\"DEF_AIPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"/>",
            "<ELEMENT TAG=\"DEF_Delay\" TYPE=\"LONG\" INDX=\"INTERNAL\"/>",
            "<ELEMENT TAG=\"GearTorque.A6\" TYPE=\"DOUBLE\" INDX=\"6\"/>",
            "<ELEMENT TAG=\"Stop\" TYPE=\"BOOL\" INDX=\"1\" HOLDON=\"0\"/>",
            "<ELEMENT TAG=\"AK.A1\" TYPE=\"DOUBLE\" INDX=\"2\" HOLDON=\"1\"/>",
            "<ELEMENT TAG=\"EK.E1\" TYPE=\"DOUBLE\" INDX=\"8\" HOLDON=\"1\"/>",
        ] {
            assert_eq!(text.matches(line).count(), 1, "{line}\n{text}");
        }
        let relative = TagMap { mode: Correction::Relative, ..TagMap::im_free() };
        assert_eq!(rsi_ethernet(&relative, "10.0.0.1:1".parse().unwrap()).matches("HOLDON=\"1\"").count(), 0);
    }
}
