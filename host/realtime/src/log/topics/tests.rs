//! Every column has one topic; messages of other versions and arbitrary bytes are handled.

use super::*;
use crate::log::sample;
use crate::log::table::store;
use proptest::prelude::*;

fn topics() -> Topics {
    Topics::new(default_names(), None)
}

#[test]
fn every_column_has_one_topic() {
    let topics = topics();
    let mut topic_counts = vec![0; topics.columns.len()];
    for place in topics.topics.iter().flat_map(Topic::places) {
        topic_counts[place] += 1;
    }
    for (count, column) in topic_counts.iter().zip(&topics.columns) {
        assert_eq!(*count, 1, "{}", column.name);
    }
}

#[test]
fn schemas_match_ros() {
    let schemas: Vec<(&str, Schema)> = topics().list().collect();
    let text = |topic: &str| &schemas.iter().find(|(name, _)| *name == topic).expect("a topic").1.text;
    assert!(text("/robot_1/joint_states").starts_with("std_msgs/Header header\nstring[] name\nfloat64[] position\n"));
    for needed in ["MSG: std_msgs/Header\n", "MSG: builtin_interfaces/Time\n", "MSG: geometry_msgs/Quaternion\n"] {
        assert!(text("/tf").contains(needed), "{needed}");
    }
    let cycle = text("/hil/cycle");
    for line in [
        "uint64 cycle  # [1] cycle of the master since the start of the session",
        "int64 robot_1_lateness_ns  # [ns] robot 1: delay of our cycle's start after its due time",
        "float64 emulated_2_computed_rail_m  # [m] emulated robot 2: command computed by the loop, limited; sent if armed: rail",
    ] {
        assert!(cycle.lines().any(|found| found == line), "no `{line}` in\n{cycle}");
    }
    assert!(!cycle.contains("robot_1_position_1_rad"), "columns of standard messages are not repeated");
}

/// A message of `/hil/cycle` with the given schema's fields; numbers are the fields' positions.
fn foreign(schema: &str) -> Vec<u8> {
    let mut out = Encoder::default();
    out.start();
    header(&mut out, 0, "");
    for (place, (kind, _)) in schemas::cycle_fields(schema).enumerate() {
        match kind {
            "float64" => out.f64(place as f64),
            "int64" => out.i64(place as i64),
            "uint64" => out.u64(place as u64),
            _ => out.u32(place as u32),
        }
    }
    out.bytes().to_vec()
}

#[test]
fn log_of_another_version_is_read_by_column_names() {
    let mut topics = topics();
    let schema = "std_msgs/Header header
uint64 tick  # moved forward
float64 wind_speed_m_per_s  # a column that this version does not know
uint64 cycle
float64 contact_energy_j
";
    assert!(topics.adapt(schema));
    let mut values = topics.blank();
    let cycle = topics.position(CYCLE_TOPIC).expect("the cycle's topic");
    topics.decode(cycle, &foreign(schema), &mut values).expect("a message");
    let record: CycleRecord = crate::log::table::load(&values);
    assert_eq!((record.tick, record.cycle, record.contact_energy), (0, 2, 3.0));
    assert_eq!(record.time, Logged::BLANK, "a column that the file lacks");
    assert!(!topics.adapt("std_msgs/Header header\nfloat64 cycle\n"), "a column of another type");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Bytes with a valid checksum may still be invalid.
    #[test]
    fn arbitrary_bytes_are_decoded_or_refused(
        seed in any::<u64>(),
        cut in any::<prop::sample::Index>(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let topics = topics();
        let (mut values, mut out) = (topics.blank(), Encoder::default());
        store(&sample::any(seed), &mut values);
        for topic in 0..topics.topics.len() {
            topics.encode(topic, &values, &mut out);
            let mut message = out.bytes().to_vec();
            for (place, byte) in &changes {
                let place = place.index(message.len());
                message[place] = *byte;
            }
            message.truncate(cut.index(message.len() + 1));
            for other in [topic, (topic + 1) % topics.topics.len()] {
                let mut read = topics.blank();
                let _ = topics.decode(other, &message, &mut read);
                prop_assert_eq!(read.len(), values.len());
            }
        }
    }
}
