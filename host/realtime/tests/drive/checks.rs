//! Every start-up check alone: one value beyond its limit fails that check, and no other.

use crate::fixture::{CYCLE, Setting};
use softdock_kernels::space::Parts;
use softdock_kernels::vector::{Quat, vec3};
use softdock_realtime::arms::Arms;
use softdock_realtime::drive::checklist::{Check, CheckKind, CheckOutcome, Checklist};
use softdock_realtime::drive::start::{CheckedLinks, StartUp, StartUpContext};
use softdock_realtime::log::codes::{force_flags, robot_flags};
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::log::table::Logged;
use softdock_realtime::sensing::Sensing;
use softdock_realtime::signals::{AXES, Capabilities};
use softdock_realtime::time::Nanos;

/// Changes of a case: the setting, the start of the run, and the record of a cycle.
#[derive(Clone)]
struct Case {
    kind: CheckKind,
    robot: Option<usize>,
    setting: fn(&mut Setting),
    start: fn(&mut Parts<f64>),
    to_start: bool,
    record: fn(&mut CycleRecord, u64),
    /// Failed links.
    broken: [bool; 3],
}

impl Case {
    fn new(kind: CheckKind, robot: Option<usize>, record: fn(&mut CycleRecord, u64)) -> Self {
        Self { kind, robot, setting: |_| (), start: |_| (), to_start: true, record, broken: [false; 3] }
    }
}

/// Returns the final list of a start-up, in at most 2,600 cycles of two robots at rest at the start.
fn list(case: &Case) -> Checklist {
    let mut setting = Setting::docking();
    (case.setting)(&mut setting);
    let arms = Arms::new(&setting.plant, &setting.station).expect("in reach");
    let mut start = setting.plant.start;
    let (home, _) = arms.positions_for(&start);
    (case.start)(&mut start);
    let (limits, sensing) = (arms.limits(&setting.station), Sensing::new(&setting.station));
    let robots = [Capabilities { cycle: CYCLE, master: true, rail: true, torque: false, pose: true }; 2];
    let (mut start_up, mut record) = (StartUp::default(), CycleRecord::BLANK);
    for n in 1..=2_600_u64 {
        let now = CYCLE * n as i64;
        for (r, robot) in [&mut record.robot_1, &mut record.robot_2].into_iter().enumerate() {
            robot.flags = robot_flags::PRESENT
                | robot_flags::FRESH
                | robot_flags::READY
                | robot_flags::ASKED
                | robot_flags::POSE
                | robot_flags::TORQUE;
            (robot.stamp, robot.received, robot.link.received) = (now, now, n);
            (robot.position, robot.asked) = (home[r], home[r]);
            robot.tool = arms.tool_pose(r, &home[r]);
        }
        let a = arms.part_on(0, &home[0], &[0.0; AXES]);
        record.ft.flags = force_flags::PRESENT | force_flags::FRESH;
        (record.ft.raw, record.ft.received) = (sensing.weight(&a), now);
        (case.record)(&mut record, n);
        let cell = StartUpContext {
            arms: &arms,
            limits: &limits,
            robots: &robots,
            station: &setting.station,
            plant: &setting.plant,
            sensing: &sensing,
            start: &start,
            to_start: case.to_start,
            now,
        };
        let found = start_up.check(&CheckedLinks::moved(&record, case.broken), &cell);
        if let Some(found) = found.filter(|found| found.decides) {
            return found.list;
        }
    }
    panic!("{:?}: no answer", case.kind)
}

/// Makes the path to the start lead part A 0.3 m further, through part B.
fn overlapping(parts: &mut Parts<f64>) {
    let towards = parts.b.position - parts.a.position;
    parts.a.position = parts.a.position + towards * (0.3 / towards.norm());
}

fn cases() -> Vec<Case> {
    let new = Case::new;
    vec![
        new(CheckKind::Reports, Some(1), |r, _| r.robot_2.flags = 0),
        new(CheckKind::Samples, None, |r, _| r.ft.flags = 0),
        Case { broken: [true, false, false], ..new(CheckKind::Link, Some(0), |_, _| ()) },
        Case { broken: [false, false, true], ..new(CheckKind::SensorLink, None, |_, _| ()) },
        new(CheckKind::Foreign, Some(0), |r, n| r.robot_1.link.foreign = u64::from(n > 50)),
        new(CheckKind::Still, Some(1), |r, n| {
            let by = if n > 60 { 2e-3 } else { 0.0 };
            (r.robot_2.asked[4], r.robot_2.position[4]) = (r.robot_2.asked[4] + by, r.robot_2.position[4] + by);
        }),
        // Half of its reports are missing, and it does not count them as lost: it sends at another rate.
        new(CheckKind::Period, Some(0), |r, n| {
            r.robot_1.received = Nanos(r.robot_1.received.0 / 10 * 11);
            r.robot_1.stamp = r.robot_1.received;
            r.robot_1.link.received = n;
        }),
        new(CheckKind::Loss, Some(0), |r, n| {
            if n % 40 == 0 {
                r.robot_1.flags &= !robot_flags::FRESH;
                r.robot_1.link.lost += 1;
                r.robot_1.received = r.robot_1.received - CYCLE;
            }
        }),
        new(CheckKind::Late, Some(1), |r, n| r.robot_2.late_answers = n as u32 / 10),
        new(CheckKind::Clock, Some(0), |r, _| r.robot_1.stamp = Nanos(r.robot_1.stamp.0 / 20 * 21)),
        new(CheckKind::Ready, Some(1), |r, _| r.robot_2.flags &= !robot_flags::READY),
        new(CheckKind::Servo, Some(0), |r, _| r.robot_1.asked[3] += 0.02),
        Case {
            setting: |s| s.station.limits[1].upper = s.station.limits[1].lower + 0.01,
            ..new(CheckKind::Range, Some(0), |_, _| ())
        },
        new(CheckKind::ToolPosition, Some(1), |r, _| r.robot_2.tool.position.y += 2e-3),
        new(CheckKind::ToolRotation, Some(0), |r, _| {
            let turn = Quat { w: 1.0, v: vec3(0.01, 0.0, 0.0) };
            r.robot_1.tool.attitude = r.robot_1.tool.attitude.compose(turn);
        }),
        Case {
            setting: |s| s.station.torques.limits = Some([100.0; 6]),
            ..new(CheckKind::Torques, Some(0), |r, _| r.robot_1.flags &= !robot_flags::TORQUE)
        },
        Case { start: |parts| parts.b.position.z += 9.0, ..new(CheckKind::Reach, Some(1), |_, _| ()) },
        Case {
            start: |parts| parts.b.position.z += 2e-3,
            to_start: false,
            ..new(CheckKind::StartPosition, Some(1), |_, _| ())
        },
        Case {
            start: |parts| {
                let turn = Quat { w: 1.0, v: vec3(0.0, 0.0, 0.01) };
                parts.a.attitude = parts.a.attitude.compose(turn);
            },
            to_start: false,
            ..new(CheckKind::StartRotation, Some(0), |_, _| ())
        },
        new(CheckKind::Status, None, |r, _| r.ft.flags |= force_flags::SATURATED),
        new(CheckKind::Age, None, |r, _| r.ft.received = r.ft.received - Nanos::from_millis(9)),
        new(CheckKind::RestSpread, None, |r, n| r.ft.raw.force.x += if n % 2 == 0 { 30.0 } else { 0.0 }),
        new(CheckKind::RestForce, None, |r, _| r.ft.raw.force.y += 120.0),
        new(CheckKind::RestMoment, None, |r, _| r.ft.raw.moment.z += 11.0),
        Case { start: overlapping, ..new(CheckKind::Clearance, None, |_, _| ()) },
        Case {
            setting: |s| s.with_rules(|rules| rules.arm_distance = 2.5),
            ..new(CheckKind::ArmDistance, None, |_, _| ())
        },
        Case {
            setting: |s| {
                s.with_rules(|rules| {
                    rules.keep_out.iter_mut().for_each(|keep_out| keep_out.half = vec3(3.0, 3.0, 3.0))
                });
            },
            ..new(CheckKind::KeepOut, None, |_, _| ())
        },
    ]
}

#[test]
fn each_check_fails_only_for_its_own_value() {
    for case in cases() {
        let list = list(&case);
        let failed: Vec<&Check> = list.checks().iter().filter(|check| check.answer() == CheckOutcome::Failed).collect();
        let of: Vec<(CheckKind, Option<usize>)> = failed.iter().map(|check| (check.kind, check.robot)).collect();
        assert!(of.contains(&(case.kind, case.robot)), "{:?}: {of:?}", case.kind);
        assert_eq!(list.failed().map(|check| check.kind), Some(case.kind), "the first that fails: {of:?}");
        // A missing robot, or one a quarter of a circle away, has no other values.
        assert!(of.iter().all(|(kind, _)| *kind == case.kind || may_fail_too(case.kind, *kind)), "{of:?}");
    }
}

/// Checks that also fail when another one does.
fn may_fail_too(kind: CheckKind, other: CheckKind) -> bool {
    matches!(
        (kind, other),
        (CheckKind::Reports, CheckKind::Loss)
            | (CheckKind::Period, CheckKind::Loss | CheckKind::Clock)
            | (CheckKind::Range, CheckKind::Range | CheckKind::Reach)
    )
}

#[test]
fn every_check_has_a_case() {
    let cases = cases();
    // A moving session measures the second attitude: `tool_is_weighed_in_two_attitudes_before_an_armed_run`.
    let elsewhere = [CheckKind::TurnedForce, CheckKind::TurnedMoment];
    for kind in CheckKind::ALL {
        assert!(elsewhere.contains(kind) || cases.iter().any(|case| case.kind == *kind), "{}", kind.row().id);
    }
    let whole = list(&Case::new(CheckKind::Reports, None, |_, _| ()));
    assert_eq!(whole.failed(), None, "robots at rest at the start pass");
}
