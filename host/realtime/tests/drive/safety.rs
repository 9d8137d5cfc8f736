//! The safety behaviours, each tested with its own fault.

use crate::fixture::{CYCLE, Rig, Setting, rule, tags};
use softdock_campaign::station::AxisLimits;
use softdock_kernels::model::{KeepOut, SessionRules};
use softdock_kernels::plant::Plant;
use softdock_kernels::session::axes_asked;
use softdock_kernels::vector::{Pose, vec3};
use softdock_realtime::drive::checklist::{Check, CheckKind};
use softdock_realtime::emulation::facility::Ailment;
use softdock_realtime::log::codes::{LimitKind, OrderKind, Phase, StopCause, robot_flags};
use softdock_realtime::log::record::CycleRecord;
use softdock_realtime::protocol::rsi::codec::Sen;
use softdock_realtime::signals::AXES;
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::relay::{Direction, Endpoint, Fault, Relay, RelayRule};
use std::sync::Arc;

/// Until the end of the session.
const FOREVER: Nanos = Nanos(i64::MAX);

/// Returns the corrections sent to a robot: joints \[rad\], rail \[m\].
fn corrections(rig: &Rig, endpoint: Endpoint) -> Vec<[f64; AXES]> {
    let tags = tags(endpoint);
    let network = rig.network.borrow();
    let answers = network.answers.iter().filter(|(_, to, _)| *to == endpoint);
    answers
        .map(|(_, _, bytes)| {
            let sen = Sen::read(bytes, &tags).expect("our own answers can be read");
            let mut axes = [0.0; AXES];
            axes[..6].copy_from_slice(&sen.axes.map(|axis| axis.expect("a correction").to_radians()));
            axes[6] = sen.rail.unwrap_or(0.0) * 1e-3;
            axes
        })
        .collect()
}

/// Asserts that no step of a robot's set-point exceeds its limits.
fn assert_within(rig: &Rig, limits: &[AxisLimits; AXES]) {
    let share = rig.greatest_share(limits);
    assert!(share > 0.01 && share <= 1.0 + 1e-6, "{share} of a limit");
}

/// Returns the record of the stop's begin.
fn stop_of(rig: &Rig) -> &CycleRecord {
    rig.records.iter().find(|record| record.cause != StopCause::None).expect("a stop")
}

/// Whether all commands to robot 1 after the stop ramp to rest: no speed grows after the first few cycles.
fn assert_ramped_down(rig: &Rig) {
    let sent: Vec<&CycleRecord> =
        rig.records.iter().filter(|r| r.cause != StopCause::None && r.robot_1.order != OrderKind::None).collect();
    let last = sent.last().expect("commands after the stop");
    assert_eq!(last.robot_1.order, OrderKind::End, "{:?}", last.phase);
    let before = &sent[sent.len() - 2];
    assert_eq!(last.robot_1.command, before.robot_1.command, "at rest at the end");
}

#[test]
fn behaviour_1_dry_run_commands_no_motion_of_real_robots() {
    let setting = Setting { armed: false, ..Setting::docking() };
    let mut rig = Rig::new(&setting, Relay::default());
    let last = *rig.finish();
    assert_eq!(last.cause, StopCause::Completed, "{:?}", rig.session.core().refusal());
    for endpoint in [Endpoint::Robot1, Endpoint::Robot2] {
        let sent = corrections(&rig, endpoint);
        assert!(sent.len() > 500, "the protocol runs: {} answers", sent.len());
        assert!(sent.iter().all(|axes| *axes == [0.0; AXES]), "and commands no motion");
    }
    assert!(rig.records.iter().all(|record| record.robot_1.order != OrderKind::Move));
    let moved = rig.records.iter().filter(|record| record.emulated_1.order == OrderKind::Move).count();
    assert!(moved > 500, "the emulated robots move: {moved} cycles");
    let logged =
        rig.records.iter().filter(|record| record.robot_1.computed.iter().all(|axis| axis.is_finite())).count();
    assert!(logged > 500, "unsent commands are logged: {logged} cycles");
}

/// Returns the refusal of a session that must not begin.
fn refused(setting: &Setting, relay: Relay, prepare: impl FnOnce(&mut Rig)) -> Check {
    let mut rig = Rig::new(setting, relay);
    prepare(&mut rig);
    let last = *rig.finish();
    assert_eq!(last.cause, StopCause::StartRefused);
    for endpoint in [Endpoint::Robot1, Endpoint::Robot2] {
        assert!(corrections(&rig, endpoint).iter().all(|axes| *axes == [0.0; AXES]), "nothing has moved");
    }
    rig.session.core().refusal().expect("a reason")
}

#[test]
fn behaviour_2_no_motion_before_every_check_has_passed() {
    let setting = Setting::docking();
    let always = |endpoint, every, fault| {
        Relay::new([RelayRule { endpoint, direction: Direction::Report, from: Nanos(0), until: FOREVER, every, fault }])
    };
    let lost = |endpoint, every| of(&refused(&setting, always(endpoint, every, Fault::Lose), |_| ()));
    assert_eq!(lost(Endpoint::Robot1, 1), (CheckKind::Reports, Some(0)));
    assert_eq!(lost(Endpoint::Robot2, 1), (CheckKind::Reports, Some(1)));
    assert_eq!(lost(Endpoint::Sensor, 1), (CheckKind::SensorLink, None));
    assert_eq!(lost(Endpoint::Robot1, 50), (CheckKind::Loss, Some(0)));
    let ill = |rig: &mut Rig| rig.network.borrow_mut().facility().ail(Ailment::Invalid);
    assert_eq!(of(&refused(&setting, Relay::default(), ill)), (CheckKind::Status, None));

    // A tool frame with an error of 3 mm: the robot's own pose and ours differ by it.
    let mut other = setting.clone();
    other.station.robots[1].tool.position.z += 3e-3;
    let refusal = refused_pose(&setting, &other);
    assert_eq!(of(&refusal), (CheckKind::ToolPosition, Some(1)));
    assert!((refusal.value - 3e-3).abs() < 1e-5, "{refusal}");

    let away = Setting { to_start: false, ..setting.clone() };
    assert_eq!(of(&refused(&away, Relay::default(), |_| ())), (CheckKind::StartPosition, Some(0)));

    let mut narrow = setting;
    narrow.station.limits[2].upper = -3.0;
    let refusal = refused(&narrow, Relay::default(), |_| ());
    assert_eq!((of(&refusal), refusal.axis), ((CheckKind::Range, Some(0)), Some(2)));
}

/// Returns kind and robot of a failed check.
fn of(check: &Check) -> (CheckKind, Option<usize>) {
    (check.kind, check.robot)
}

/// Returns the refusal of a session whose facility file differs from the facility.
fn refused_pose(facility: &Setting, file: &Setting) -> Check {
    let mut rig = Rig::with(facility, file, Relay::default());
    rig.finish();
    rig.session.core().refusal().expect("a reason")
}

#[test]
fn behaviour_3_no_command_exceeds_the_limits() {
    // Slower than the run needs: all commands are clamped, and finally the session stops.
    let mut setting = Setting::docking();
    setting.with_rules(|rules| rules.clamp_time = 0.1);
    setting.station.sensor.weighing_turn = 0.0;
    setting.station.limits.iter_mut().for_each(|limit| {
        limit.speed *= 0.02;
        limit.acceleration *= 0.02;
    });
    let mut rig = Rig::new(&setting, Relay::default());
    let cause = rig.finish().cause;
    assert_eq!(cause, StopCause::AxisLimit);
    assert!(rig.records.iter().any(|record| record.robot_1.limits.any() || record.robot_2.limits.any()));
    assert_within(&rig, &setting.station.limits);
    // A range that ends on the path.
    let mut setting = Setting::docking();
    let mut free = Rig::new(&setting, Relay::default());
    free.finish();
    let path: Vec<f64> = free.records.iter().filter(|r| r.tick > 0).map(|r| r.robot_1.position[1]).collect();
    let (first, last) = (path[0], path[path.len() - 1]);
    let end = first + 0.5 * (last - first) + setting.station.zero[1];
    let limit = &mut setting.station.limits[1];
    if last > first {
        limit.upper = end
    } else {
        limit.lower = end
    }
    let mut rig = Rig::new(&setting, Relay::default());
    rig.finish();
    assert_eq!(stop_of(&rig).cause, StopCause::AxisLimit);
    assert!(stop_of(&rig).robot_1.limits.has(LimitKind::Position, 1));
    assert_within(&rig, &setting.station.limits);
    assert_ramped_down(&rig);
}

#[test]
fn workspace_rule_ends_the_session_in_a_ramp() {
    let docking = Setting::docking();
    let angle = axes_asked(&docking.plant, &docking.plant.start).least_sine.asin();
    // A thin box between the parts, which both approach.
    let sheet = KeepOut { name: "sheet".to_owned(), frame: Pose::identity(), half: vec3(5e-3, 0.3, 0.3) };
    type Change = Box<dyn Fn(&mut SessionRules)>;
    let cases: [(StopCause, Change); 4] = [
        (StopCause::ToolSpeed, Box::new(|rules| rules.tool_speed = 0.02)),
        (StopCause::KeepOut, Box::new(move |rules| rules.keep_out = vec![sheet.clone()])),
        (StopCause::ArmDistance, Box::new(|rules| rules.arm_distance = 0.38)),
        (StopCause::Singularity, Box::new(move |rules| rules.singularity = angle - 0.2_f64.to_radians())),
    ];
    for (cause, change) in cases {
        let mut setting = Setting::docking();
        let mut model = (**setting.plant).clone();
        model.facility.session_robots.as_mut().expect("the robots of its facility").tool_radius = [5e-3; 2];
        setting.plant = Arc::new(Plant::new(model));
        setting.with_rules(change);
        let mut rig = Rig::new(&setting, Relay::default());
        rig.finish();
        assert_eq!(stop_of(&rig).cause, cause);
        let stop = rig.session.core().rule_met().expect("a rule of the session");
        let limit = (stop.rule.row().limit)(&setting.plant.facility);
        assert!((stop.value - limit).abs() < 0.01, "{stop:?} with a limit of {limit}");
        assert_within(&rig, &setting.station.limits);
        assert_ramped_down(&rig);
    }
}

#[test]
fn path_to_the_start_through_a_box_or_too_near_is_refused() {
    let setting = Setting::docking();
    // The robots are at the nominal start, away from that of this run: a box around part A there.
    let frame = Pose { position: setting.plant.start.a.position, attitude: setting.plant.start.a.attitude };
    let around = KeepOut { name: "around".to_owned(), frame, half: vec3(1e-3, 1e-3, 1e-3) };
    let mut boxed = setting.clone();
    let mut model = (**boxed.plant).clone();
    model.facility.session_robots.as_mut().expect("the robots of its facility").tool_radius = [5e-3; 2];
    boxed.plant = Arc::new(Plant::new(model));
    boxed.with_rules(|rules| rules.keep_out = vec![around.clone()]);
    let refusal = refused(&boxed, Relay::default(), |_| ());
    assert!(refusal.kind == CheckKind::KeepOut && refusal.value > 0.0, "{refusal}");
    let mut near = setting;
    near.with_rules(|rules| rules.arm_distance = 0.6);
    let refusal = refused(&near, Relay::default(), |_| ());
    assert!(
        refusal.kind == CheckKind::ArmDistance && refusal.value < refusal.limit && refusal.limit == 0.6,
        "{refusal}"
    );
}

#[test]
fn behaviour_4_force_limit_and_sensor_fault_stop_the_run() {
    let mut setting = Setting::docking();
    setting.with_rules(|rules| rules.force = 10.0);
    let mut rig = Rig::new(&setting, Relay::default());
    rig.finish();
    let stop = stop_of(&rig);
    assert_eq!((stop.cause, stop.phase), (StopCause::ForceLimit, Phase::Stopping));
    let force = stop.ft.compensated.force.norm();
    assert!(force > 10.0 && force < 60.0, "{force} N: stopped in the cycle that saw it");
    assert_ramped_down(&rig);

    let mut setting = Setting::docking();
    setting.with_rules(|rules| rules.force_rate = 500.0);
    let mut rig = Rig::new(&setting, Relay::default());
    rig.finish();
    assert_eq!(stop_of(&rig).cause, StopCause::ForceRate);

    for (ailment, cause, cycles) in [
        (Ailment::Saturated, StopCause::SensorFault, 1),
        (Ailment::Invalid, StopCause::SensorFault, 1),
        (Ailment::Silent, StopCause::SensorStale, 2),
    ] {
        let mut rig = Rig::new(&Setting::docking(), Relay::default());
        rig.run_for(0.5);
        let at = rig.session.record().cycle;
        rig.network.borrow_mut().facility().ail(ailment);
        rig.finish();
        let stop = stop_of(&rig);
        let fault = if cause == StopCause::SensorStale { StopCause::LinkFault } else { cause };
        assert!(stop.cause == cause || stop.cause == fault, "{ailment:?}: {:?}", stop.cause);
        assert!(stop.cycle <= at + 1 + cycles, "{ailment:?}: {} cycles", stop.cycle - at);
        assert_ramped_down(&rig);
    }
}

#[test]
fn behaviour_5_lost_packets_hold_then_stop_then_the_controller_times_out() {
    for (lost, cause) in [(1, StopCause::Completed), (3, StopCause::Completed), (4, StopCause::LostPackets)] {
        let mut rig = Rig::new(&Setting::docking(), Relay::default());
        rig.run_for(0.5);
        let now = rig.session.record().time;
        let fault = rule(Endpoint::Robot1, Direction::Report, now, lost, Fault::Lose);
        rig.network.borrow_mut().relay.add(fault);
        rig.finish();
        assert_eq!(stop_of(&rig).cause, cause, "{lost} cycles lost");
        assert_within(&rig, &Setting::docking().station.limits);
        let limit = rig.session.record().robot_1.late_answers;
        assert!(i64::from(limit) <= lost, "{limit} late answers");
        if cause == StopCause::LostPackets {
            let missed = (stop_of(&rig).time - now).seconds() / CYCLE.seconds();
            assert!(missed <= 4.5, "{missed} cycles until the stop");
        }
    }
    // A link that dies: after ten cycles nothing is sent any more, and robot 2 has been stopped.
    let mut rig = Rig::new(&Setting::docking(), Relay::default());
    rig.run_for(0.5);
    let now = rig.session.record().time;
    rig.network
        .borrow_mut()
        .relay
        .add(RelayRule { until: FOREVER, ..rule(Endpoint::Robot1, Direction::Report, now, 1, Fault::Lose) });
    rig.finish();
    assert_eq!(stop_of(&rig).cause, StopCause::LostPackets);
    let silent_from = now + CYCLE;
    let sent =
        rig.network.borrow().answers.iter().filter(|(at, to, _)| *to == Endpoint::Robot1 && *at > silent_from).count();
    assert_eq!(sent, 0, "no answer without a report");
    let end = rig.records.last().expect("records");
    assert_eq!(end.robot_2.order, OrderKind::None);
    assert!(rig.records.iter().any(|r| r.cause != StopCause::None && r.robot_2.order == OrderKind::End));
}

#[test]
fn behaviour_5_late_repeated_reordered_and_damaged_packets_are_safe() {
    let faults = [
        Fault::Delay(Nanos::from_millis(6)),
        Fault::Duplicate(Nanos::from_millis(1)),
        Fault::Exchange,
        Fault::Corrupt,
        Fault::Impostor,
    ];
    for fault in faults {
        let mut rig = Rig::new(&Setting::docking(), Relay::default());
        rig.run_for(0.3);
        let now = rig.session.record().time;
        // One packet in sixty, for the rest of the run: fewer than the window allows.
        let rule = RelayRule {
            endpoint: Endpoint::Robot1,
            direction: Direction::Report,
            from: now,
            until: FOREVER,
            every: 60,
            fault,
        };
        rig.network.borrow_mut().relay.add(rule);
        let last = *rig.finish();
        assert_eq!(last.cause, StopCause::Completed, "{fault:?}");
        assert_within(&rig, &Setting::docking().station.limits);
        let link = last.robot_1.link;
        let counted = match fault {
            Fault::Delay(_) | Fault::Duplicate(_) | Fault::Exchange => link.stale + link.lost,
            Fault::Corrupt => link.malformed + link.lost + link.stale,
            _ => link.foreign,
        };
        assert!(counted > 5, "{fault:?}: {link:?}");
    }
}

#[test]
fn behaviour_6_signal_ends_in_a_ramp_and_the_protocol_end() {
    for cause in [StopCause::Operator, StopCause::Signal, StopCause::Panic] {
        let mut rig = Rig::new(&Setting::docking(), Relay::default());
        rig.run_for(1.0);
        rig.session.cycle(Some(cause));
        rig.records.push(*rig.session.record());
        assert_eq!(rig.session.record().phase, Phase::Stopping, "the ramp begins in the same cycle");
        rig.finish();
        assert_eq!(stop_of(&rig).cause, cause);
        assert_ramped_down(&rig);
        assert_within(&rig, &Setting::docking().station.limits);
        let stops = rig
            .network
            .borrow()
            .answers
            .iter()
            .filter(|(_, to, bytes)| *to != Endpoint::Sensor && Sen::read(bytes, &tags(*to)).is_ok_and(|sen| sen.stop))
            .count();
        assert!(stops >= 2, "both controllers receive the end: {stops}");
    }
}

#[test]
fn behaviour_7_injected_energy_has_a_budget() {
    let mut setting = Setting::docking();
    setting.with_rules(|rules| rules.injected_energy = 0.01);
    let mut rig = Rig::new(&setting, Relay::default());
    rig.finish();
    let stop = stop_of(&rig);
    assert_eq!(stop.cause, StopCause::EnergyBudget);
    assert!(stop.contact_energy > 0.0);
    assert_ramped_down(&rig);
}

#[test]
fn behaviour_8_no_automatic_resume() {
    let mut rig = Rig::new(&Setting::docking(), Relay::default());
    rig.run_for(0.5);
    let now = rig.session.record().time;
    rig.network.borrow_mut().relay.add(rule(Endpoint::Robot2, Direction::Report, now, 6, Fault::Lose));
    rig.finish();
    assert_eq!(stop_of(&rig).cause, StopCause::LostPackets);
    // The link has recovered, and gets no commands.
    let (before, last) = (rig.network.borrow().answers.len(), rig.session.record().tick);
    for _ in 0..50 {
        assert!(rig.cycle(), "over for good");
    }
    let after = rig.network.borrow().answers[before..].iter().filter(|(_, to, _)| *to != Endpoint::Sensor).count();
    assert_eq!((after, rig.session.record().tick), (0, last));
    assert!(rig.session.record().robot_1.flags & robot_flags::PRESENT != 0);
}
