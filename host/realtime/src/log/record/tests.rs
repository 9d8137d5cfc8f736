//! The table of the log: fixed names, units, and reports that round-trip.

use super::*;
use crate::log::sample;
use crate::log::table::columns;
use softdock_kernels::vector::{Quat, vec3};
use std::collections::BTreeSet;

#[test]
fn names_are_unique_and_legal_in_ros() {
    let columns = columns::<CycleRecord>();
    let names: BTreeSet<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names.len(), columns.len());
    for name in names {
        let legal = name.chars().all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '_');
        let starts = name.starts_with(|letter: char| letter.is_ascii_lowercase());
        assert!(legal && starts && !name.contains("__") && !name.ends_with('_'), "{name}");
    }
}

#[test]
fn published_names_and_units_are_stable() {
    let columns = columns::<CycleRecord>();
    for (name, unit, meaning) in [
        ("robot_1_position_1_rad", "rad", "robot 1: measured axis: joint"),
        ("robot_2_position_rail_m", "m", "robot 2: measured axis: rail"),
        ("emulated_1_torque_6_n_m", "N m", "emulated robot 1: torque or force of the axis: joint"),
        ("emulated_1_torque_rail_n", "N", "emulated robot 1: torque or force of the axis: rail"),
        ("robot_1_limit_used_rail", "1", "robot 1: share of the axis' nearest limit in use, 1 at the limit: rail"),
        (
            "robot_1_tool_attitude_w",
            "1",
            "robot 1: pose of the tool in the robot's base, as it reports it: rotation from its axes",
        ),
        ("robot_1_link_lost", "1", "robot 1: link: lost datagrams, by the sender's own count"),
        ("ft_raw_force_x_n", "N", "sensor: measured wrench, sensor axes and origin: force"),
        ("simulated_part_b_omega_z_rad_per_s", "rad/s", "simulated part B, contact frame: angular velocity"),
        ("time_ns", "ns", "start of the cycle since the start of the session, our monotonic clock"),
        ("contact_energy_j", "J", "energy injected by the facility so far, as observed at the port"),
    ] {
        let column = columns.iter().find(|column| column.name == name).unwrap_or_else(|| panic!("no `{name}`"));
        assert_eq!((column.unit, column.meaning.as_str()), (unit, meaning), "{name}");
    }
    assert!(columns.iter().all(|column| !column.meaning.is_empty()));
}

#[test]
fn meaning_of_an_enumeration_lists_its_words() {
    let columns = columns::<CycleRecord>();
    let phase = columns.iter().find(|column| column.name == "phase").expect("the phase");
    assert!(phase.meaning.starts_with("phase: 0 start_up, 1 to_start, 2 taring"), "{}", phase.meaning);
    assert_eq!(phase.kind, Type::Code(Phase::WORDS));
    assert_eq!(StopCause::from_code(StopCause::Tracking.code()), StopCause::Tracking);
    assert_eq!(StopCause::from_code(u32::MAX), StopCause::None);
    assert_eq!((Phase::Captured.word(), Phase::WORDS.len()), ("captured", Phase::ALL.len()));
}

#[test]
fn blank_record_has_no_values() {
    for (value, column) in sample::values(&CycleRecord::BLANK).into_iter().zip(columns::<CycleRecord>()) {
        assert_eq!(value, LogValue::blank(column.kind), "{}", column.name);
    }
}

#[test]
fn limit_flags_keep_axis_and_kind_apart() {
    let mut flags = LimitFlags::default();
    assert!(!flags.any());
    flags.set(LimitKind::NonFinite, TOOL);
    flags.set(LimitKind::Velocity, 2);
    assert!(flags.any() && flags.has(LimitKind::NonFinite, TOOL) && flags.has(LimitKind::Velocity, 2));
    assert_eq!(flags.0.count_ones(), 2);
    assert_eq!(flags.0, 1 << 63 | 1 << 10);
}

#[test]
fn report_round_trips() {
    let start = Nanos(5_000);
    let report = RobotState {
        stamp: Nanos(17),
        received: Nanos(9_000),
        position: [0.5; AXES],
        reported_set_point: None,
        torque: Some([f64::NAN; AXES]),
        pose: Some(Pose { position: vec3(1.0, 2.0, 3.0), attitude: Quat { w: 1.0, v: vec3(0.0, 0.0, 0.0) } }),
        late_answers: 3,
        ready: true,
    };
    let mut record = RobotRecord::BLANK;
    assert_eq!(record.report(start), None);
    record.take(Some(&report), start);
    assert_eq!(record.received, Nanos(4_000));
    let back = record.report(start).expect("a report");
    assert_eq!(format!("{back:?}"), format!("{report:?}"));
    record.take(None, start);
    assert_eq!(record.report(start), None);
    assert!(record.present() && record.position == report.position, "the last report is repeated");
}

#[test]
fn sample_round_trips() {
    let start = Nanos(1);
    let wrench = Wrench { force: vec3(1.0, 2.0, 3.0), moment: vec3(4.0, 5.0, 6.0) };
    let sample = ForceSample { received: Nanos(2), sequence: 9, wrench, peak: wrench, saturated: true, invalid: false };
    let mut record = ForceRecord::BLANK;
    record.take(Some(&sample), start);
    assert_eq!(record.sample(start), Some(sample));
    record.take(None, start);
    assert_eq!((record.sample(start), record.sequence), (None, 9));
}

#[test]
fn commands_are_recorded() {
    let mut record = RobotRecord::BLANK;
    record.set_command(Some(&Order::Move([0.25; AXES])));
    assert_eq!((record.order, record.command), (OrderKind::Move, [0.25; AXES]));
    record.set_command(Some(&Order::Hold));
    assert_eq!(record.order, OrderKind::Hold);
    assert!(record.command[0].is_nan());
}
