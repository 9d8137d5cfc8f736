//! Files of controllers, files with one error each, and files of our own parsed again.

use super::super::context::rsi_ethernet;
use super::*;
use proptest::prelude::*;

const PLAIN: RsiExpectation =
    RsiExpectation { mode: Correction::Absolute, cycle: Nanos::from_millis(4), rail: false, torque: None };

/// A file with other formatting: header, comments, capitals, blanks, further channels, a unit.
const THEIRS: &str = r#"<?xml version="1.0"?>
<root>
  <config>
    <IP_NUMBER>pc.of.the.cell</IP_NUMBER> <!-- where to -->
    <PORT> 49152 </PORT>
    <Protocol>udp</Protocol>
    <SENTYPE>Cell<!-- of our own -->7</SENTYPE>
    <OnlySend>false</OnlySend>
  </config>
  <send>
    <Elements>
      <element INDX="internal" TAG="DEF_RIst" TYPE="double"/>
      <ELEMENT TAG='DEF_AIPos' TYPE='DOUBLE' INDX='INTERNAL' UNIT='0' />
      <ELEMENT TAG="DEF_EIPos" TYPE="DOUBLE" INDX="INTERNAL"></ELEMENT>
      <ELEMENT TAG="DEF_Tech.C1" TYPE="DOUBLE" INDX="INTERNAL"/>
      <ELEMENT TAG="DEF_Delay" TYPE="LONG" INDX="INTERNAL"/>
      <ELEMENT TAG="AIVel.A1" TYPE="DOUBLE" INDX="1"/>
      <ELEMENT TAG="AITrq.A1" TYPE="DOUBLE" INDX="11"/>
      <ELEMENT TAG="AITrq.A2" TYPE="DOUBLE" INDX="12"/>
      <ELEMENT TAG="AITrq.A3" TYPE="DOUBLE" INDX="13"/>
      <ELEMENT TAG="AITrq.A4" TYPE="DOUBLE" INDX="14"/>
      <ELEMENT TAG="AITrq.A5" TYPE="DOUBLE" INDX="15"/>
      <ELEMENT TAG="AITrq.A6" TYPE="DOUBLE" INDX="16"/>
      <ELEMENT TAG="STAT.VER" TYPE="LONG" INDX="25"/>
    </Elements>
  </send>
  <receive>
    <Elements>
      <ELEMENT TAG="AK.A1" TYPE="DOUBLE" INDX="1" HOLDON="1"/>
      <ELEMENT TAG="AK.A2" TYPE="DOUBLE" INDX="2" HOLDON="1"/>
      <ELEMENT TAG="AK.A3" TYPE="DOUBLE" INDX="3" HOLDON="1"/>
      <ELEMENT TAG="AK.A4" TYPE="DOUBLE" INDX="4" HOLDON="1"/>
      <ELEMENT TAG="AK.A5" TYPE="DOUBLE" INDX="5" HOLDON="1"/>
      <ELEMENT TAG="AK.A6" TYPE="DOUBLE" INDX="6" HOLDON="1"/>
      <ELEMENT TAG="AK.E1" TYPE="DOUBLE" INDX="7" HOLDON="1"/>
      <ELEMENT TAG="Stop" TYPE="BOOL" INDX="8" HOLDON="0"/>
      <ELEMENT TAG="Out.01" TYPE="BOOL" INDX="9" HOLDON="1"/>
      <ELEMENT TAG="DEF_EStr" TYPE="STRING" INDX="INTERNAL"/>
    </Elements>
  </receive>
</root>
"#;

fn name(text: &str) -> Option<String> {
    Some(text.to_owned())
}

#[test]
fn file_with_other_formatting_gives_its_tag_map() {
    let expected = RsiExpectation { rail: true, ..PLAIN };
    let file = read_rsi_ethernet(THEIRS, &expected).unwrap();
    let tags = TagMap {
        sen_type: "Cell7".to_owned(),
        rail: true,
        external: name("EIPos"),
        external_correction: name("AK"),
        torque: name("AITrq"),
        axes_asked: None,
        pose_asked: None,
        ..TagMap::im_free()
    };
    assert_eq!(file, EthernetFile { tags: tags.clone(), host: "pc.of.the.cell".to_owned(), port: 49152 });
    // The same file for a facility without a rail.
    let still = read_rsi_ethernet(THEIRS, &PLAIN).unwrap().tags;
    assert_eq!(still, TagMap { rail: false, ..tags });
}

#[test]
fn every_error_states_line_and_element() {
    let flaws = [
        (
            "HOLDON=\"1\"/>\n      <ELEMENT TAG=\"AK.A3\"",
            "HOLDON=\"0\"/>\n      <ELEMENT TAG=\"AK.A3\"",
            "line 30, ELEMENT TAG=\"AK.A2\": HOLDON is 0, must be 1: an offset that falls back",
        ),
        ("INDX=\"1\" HOLDON=\"1\"", "INDX=\"1\"", "line 29, ELEMENT TAG=\"AK.A1\": HOLDON is missing, must be 1"),
        ("INDX=\"7\" HOLDON=\"1\"", "INDX=\"7\" HOLDON=\"0\"", "line 35, ELEMENT TAG=\"AK.E1\": HOLDON is 0"),
        ("HOLDON=\"0\"", "HOLDON=\"yes\"", "line 36, ELEMENT TAG=\"Stop\": HOLDON is `yes`"),
        ("\"AK.A4\"", "\"AK.A7\"", "RECEIVE/ELEMENTS, TAG=\"AK.A4\": is missing"),
        ("\"AK.E1\"", "\"AK.E2\"", "RECEIVE/ELEMENTS, TAG=\"EK.E1\": is missing: the rail has no correction"),
        ("DEF_EIPos", "DEF_MECur", "SEND/ELEMENTS, TAG=\"EIPos\": is missing: the rail is not sent"),
        ("DEF_AIPos", "DEF_AIPOS", "SEND/ELEMENTS, TAG=\"AIPos\": is missing: measured axes are not sent"),
        (
            "DEF_Delay",
            "DEF_Late",
            "SEND/ELEMENTS, TAG=\"DEF_Delay\": is missing: untaken answers could not be detected",
        ),
        (
            "TYPE=\"LONG\" INDX=\"INTERNAL\"",
            "TYPE=\"DOUBLE\" INDX=\"INTERNAL\"",
            "line 16, ELEMENT TAG=\"DEF_Delay\": TYPE is DOUBLE, must be LONG",
        ),
        ("TYPE='DOUBLE'", "TYPE='STRING'", "line 13, ELEMENT TAG=\"DEF_AIPos\": TYPE is STRING, must be DOUBLE"),
        ("TYPE='DOUBLE'", "TYPE='FLOAT'", "line 13, ELEMENT TAG=\"DEF_AIPos\": TYPE is `FLOAT`"),
        ("INDX='INTERNAL'", "INDX='3'", "line 13, ELEMENT TAG=\"DEF_AIPos\": INDX is a channel"),
        ("INDX=\"16\"", "INDX=\"INTERNAL\"", "line 23, ELEMENT TAG=\"AITrq.A6\": INDX is INTERNAL"),
        ("INDX=\"16\"", "INDX=\"65\"", "line 23, ELEMENT TAG=\"AITrq.A6\": INDX is `65`"),
        ("INDX=\"16\"", "INDX=\"15\"", "line 23, ELEMENT TAG=\"AITrq.A6\": INDX is used by AITrq.A5 in line 22"),
        ("\"AITrq.A6\"", "\"AITrq.A5\"", "line 23, ELEMENT TAG=\"AITrq.A5\": duplicate of the tag in line 22"),
        ("\"AITrq.A6\"", "\"AITrq.E1\"", "SEND/ELEMENTS, TAG=\"AITrq.A6\": is missing"),
        ("TAG=\"STAT.VER\" ", "", "line 24, ELEMENT: TAG is missing"),
        ("<OnlySend>false", "<OnlySend>TRUE", "line 8, CONFIG/ONLYSEND: `TRUE`"),
        ("    <OnlySend>false</OnlySend>\n", "", "CONFIG/ONLYSEND: is missing"),
        ("<Protocol>udp", "<Protocol>TCP", "line 6, CONFIG/PROTOCOL: `TCP`"),
        (" 49152 ", "0", "line 5, CONFIG/PORT: `0` is not a port"),
        ("Cell<!-- of our own -->7", "Cell 7", "line 7, CONFIG/SENTYPE: `Cell 7` is not a name"),
        ("</receive>", "</send>", "line 40, XML: "),
        ("</root>\n", "", "XML: ROOT is not closed"),
        ("<root>", "<Rob>", "line 2, XML: the outermost element is ROB, must be ROOT"),
        ("<SENTYPE>", "<SENTYPE>&amp;", "line 7, XML: entities and CDATA"),
    ];
    let expected = RsiExpectation { rail: true, ..PLAIN };
    for (good, bad, message) in flaws {
        let text = THEIRS.replacen(good, bad, 1);
        assert_ne!(text, THEIRS, "{good}");
        let error = read_rsi_ethernet(&text, &expected).expect_err(bad);
        assert!(error.to_string().contains(message), "{bad}: {error}, not {message}");
        assert!(!error.remedy.is_empty());
    }
    assert!(read_rsi_ethernet("", &expected).is_err());
    assert!(read_rsi_ethernet("<ROOT></ROOT>", &expected).is_err());
}

#[test]
fn cartesian_corrections_are_refused() {
    let pose = ["X", "Y", "Z", "A", "B", "C"];
    let text = (0..6)
        .fold(THEIRS.to_owned(), |text, i| text.replace(&format!("AK.A{}", i + 1), &format!("RKorr.{}", pose[i])));
    let error = read_rsi_ethernet(&text, &PLAIN).unwrap_err().to_string();
    assert!(error.contains("RKorr corrects the Cartesian pose"), "{error}");
    // Together with corrections of the axes they stay at zero.
    let both = THEIRS.replace("Out.01\" TYPE=\"BOOL\"", "RKorr.X\" TYPE=\"DOUBLE\"");
    assert!(read_rsi_ethernet(&both, &PLAIN).is_ok());
}

#[test]
fn increments_must_not_be_held() {
    let relative = RsiExpectation { mode: Correction::Relative, ..PLAIN };
    let error = read_rsi_ethernet(THEIRS, &relative).unwrap_err().to_string();
    assert!(error.contains("line 29, ELEMENT TAG=\"AK.A1\": HOLDON is 1, must be 0: an increment"), "{error}");
    assert!(read_rsi_ethernet(&THEIRS.replace("HOLDON=\"1\"", "HOLDON=\"0\""), &relative).is_ok());
}

#[test]
fn torques_need_an_option_if_their_name_is_not_known() {
    let text = THEIRS.replace("AITrq", "AILoad");
    assert_eq!(read_rsi_ethernet(&text, &PLAIN).unwrap().tags.torque, None);
    let named = |torque| read_rsi_ethernet(&text, &RsiExpectation { torque: Some(torque), ..PLAIN });
    assert_eq!(named("AILoad").unwrap().tags.torque, name("AILoad"));
    let error = named("AIEff").unwrap_err().to_string();
    assert!(error.contains("elements with A1 to A6 are: AIVel, AILoad"), "{error}");
    assert!(named("AIVel").unwrap_err().to_string().contains("AIVel.A2"));
}

/// Tag maps that a file can express.
fn maps() -> impl Strategy<Value = TagMap> {
    let names = ("[A-Za-z][A-Za-z0-9_-]{0,20}", prop::sample::select(vec!["AK", "JointCmd", "Corr-1"]));
    let rail = (any::<bool>(), any::<bool>(), prop::sample::select(vec!["EK", "Carriage", "same"]));
    let sent = (any::<[bool; 5]>(), prop::sample::select(vec![None, Some("GearTorque"), Some("AITrq")]));
    (names, rail, sent, any::<[bool; 2]>(), any::<bool>()).prop_map(
        |((sen_type, correction), (rail, external, carriage), (sent, torque), [relative, slow], stop)| {
            let tag = |there: bool, name: &str| there.then(|| name.to_owned());
            let external = rail || external;
            let carriage = if carriage == "same" { correction } else { carriage };
            TagMap {
                sen_type,
                axes: "AIPos".to_owned(),
                axes_asked: tag(sent[0], "ASPos"),
                rail,
                external: tag(external, "EIPos"),
                external_asked: tag(external && sent[1], "ESPos"),
                pose: tag(sent[2], "RIst"),
                pose_asked: tag(sent[3], "RSol"),
                torque: torque.map(str::to_owned),
                delay: name("Delay"),
                correction: correction.to_owned(),
                external_correction: tag(rail || external && sent[4], carriage),
                stop: tag(stop, "Stop"),
                mode: if relative { Correction::Relative } else { Correction::Absolute },
                cycle: Nanos::from_millis(if slow { 12 } else { 4 }),
            }
        },
    )
}

proptest! {
    #[test]
    fn written_file_parses_to_its_tag_map(tags in maps(), port in 1..=u16::MAX) {
        prop_assume!(tags.check().is_ok());
        let text = rsi_ethernet(&tags, format!("192.168.1.10:{port}").parse().unwrap());
        let expected = RsiExpectation { mode: tags.mode, cycle: tags.cycle, rail: tags.rail, torque: None };
        let file = read_rsi_ethernet(&text, &expected);
        prop_assert_eq!(file, Ok(EthernetFile { tags, host: "192.168.1.10".to_owned(), port }));
    }

    #[test]
    fn no_text_panics(place in any::<prop::sample::Index>(), length in 0..40usize, new in ".{0,8}") {
        let places: Vec<usize> = THEIRS.char_indices().map(|(place, _)| place).collect();
        let start = places[place.index(places.len())];
        let end = (start + length).min(THEIRS.len());
        let mut text = THEIRS.to_owned();
        text.replace_range(start..end, &new);
        let _ = read_rsi_ethernet(&text, &PLAIN);
    }
}
