//! Sessions with faulty links, from the robots' side: no step beyond their limits, whatever is lost, late or reordered.

use crate::fixture::{CYCLE, Rig, Setting, campaign, rule};
use softdock_kernels::philox::uniform;
use softdock_kernels::vector::{Quat, vec3};
use softdock_realtime::drive::checklist::{Check, CheckKind, CheckOutcome};
use softdock_realtime::emulation::facility::Ailment;
use softdock_realtime::log::codes::{OrderKind, Phase, StopCause};
use softdock_realtime::signals::AXES;
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::relay::{Direction, Endpoint, Fault, Relay, RelayRule};
use softdock_test_size::sized;
use std::thread;

/// Virtual time of a fault script \[s\].
const SCRIPT: f64 = 20.0;
/// Latest begin of faults in a session \[s\]: checks, weighing, motion to the start, run.
const SPAN: f64 = 14.0;

#[test]
fn link_recovery_never_exceeds_robot_limits() {
    let setting = Setting::docking();
    for (lost, endpoint) in [(13, Endpoint::Robot1), (88, Endpoint::Robot1), (88, Endpoint::Robot2)] {
        let mut rig = Rig::new(&setting, Relay::default());
        rig.run_for(0.5);
        let from = rig.session.record().time;
        rig.network.borrow_mut().relay.add(rule(endpoint, Direction::Answer, from, lost, Fault::Lose));
        let cause = rig.finish().cause;
        assert_eq!(cause, StopCause::UntakenAnswers, "{lost} answers lost");
        let stop = rig.records.iter().find(|record| record.cause != StopCause::None).expect("a stop");
        let cycles = (stop.time - from).seconds() / CYCLE.seconds();
        assert!(cycles <= 5.0, "stopped after {cycles} cycles");
        let share = rig.greatest_share(&setting.station.limits);
        assert!(share <= 1.05, "{lost} answers lost: {share} of a limit");
    }
}

#[test]
fn robot_with_a_shorter_cycle_gets_no_more_commands() {
    let setting = Setting::docking();
    for (robot, cycle) in [(0, 2), (0, 1), (1, 2), (0, 3)] {
        let mut rig = Rig::new(&setting, Relay::default());
        rig.run_for(0.5);
        rig.change_cycle(robot, Nanos::from_millis(cycle));
        let cause = rig.finish().cause;
        let share = rig.greatest_share(&setting.station.limits);
        assert!(share <= 1.05, "{cycle} ms: {share} of a limit");
        assert_eq!(cause, StopCause::Rate, "robot {}, {cycle} ms", robot + 1);
    }
}

#[test]
fn controller_that_repeats_its_ipoc_survives_a_stall() {
    let setting = Setting::docking();
    for (stall, cause) in [(10, StopCause::Completed), (22, StopCause::UntakenAnswers)] {
        let mut rig = Rig::repeating(&setting);
        rig.run_for(0.5);
        rig.stall(Nanos::from_millis(stall));
        assert_eq!(rig.finish().cause, cause, "a stall of {stall} ms");
        let last = rig.session.record();
        assert!(last.robot_1.late_answers > 0 && last.robot_2.late_answers > 0);
        for robot in [0, 1] {
            let end = rig.network.borrow_mut().facility().fault(robot);
            assert_eq!(end, Some("RSI was ended by the client"), "robot {} still accepts the end", robot + 1);
        }
        let share = rig.greatest_share(&setting.station.limits);
        assert!(share <= 1.05, "a stall of {stall} ms: {share} of a limit");
    }
}

/// Random numbers of one script.
struct Dice(u64, u32);

impl Dice {
    /// Returns a number from 0 to 1.
    fn unit(&mut self) -> f64 {
        self.1 += 1;
        uniform(46, "faults", self.0, self.1)
    }

    /// Returns one element of a list.
    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[((self.unit() * of.len() as f64) as usize).min(of.len() - 1)]
    }
}

fn random_rule(dice: &mut Dice) -> RelayRule {
    let late = Nanos::from_micros((200.0 + 12_000.0 * dice.unit()) as i64);
    let fault = dice.one(&[Fault::Lose, Fault::Lose, Fault::Delay(late), Fault::Duplicate(late), Fault::Exchange]);
    let from = Nanos::from_micros((SPAN * 1e6 * dice.unit()) as i64);
    // Most faults are short, some are long.
    let lasts = Nanos::from_micros((4e3 * 500.0_f64.powf(dice.unit())) as i64);
    RelayRule {
        endpoint: dice.one(&[Endpoint::Robot1, Endpoint::Robot2]),
        direction: dice.one(&[Direction::Report, Direction::Answer]),
        from,
        until: from + lasts,
        every: dice.one(&[1, 1, 2, 3, 10]),
        fault,
    }
}

/// Runs sessions under random faults for a time; returns their ends, and the greatest share of a limit.
fn script(number: u64) -> (Vec<StopCause>, f64) {
    let (mut dice, mut time, mut share, mut causes) = (Dice(number, 0), 0.0, 0.0_f64, Vec::new());
    let setting = Setting::docking();
    while time < SCRIPT {
        let rules = (0..1 + (3.0 * dice.unit()) as usize).map(|_| random_rule(&mut dice)).collect::<Vec<_>>();
        let stall = (dice.unit() < 0.3).then(|| (SPAN * dice.unit(), Nanos::from_micros((2e5 * dice.unit()) as i64)));
        // A controller that ends, is jogged by up to 3 degrees or not at all, and begins again.
        let again = (dice.unit() < 0.3).then(|| {
            let by = dice.one(&[0.0, 5e-4, 0.05]) * dice.unit();
            (
                SPAN * dice.unit(),
                dice.one(&[0, 1]),
                dice.one(&[0, 1, 2, 3, 4, 5]),
                by,
                26 + (100.0 * dice.unit()) as u64,
            )
        });
        // A controller whose cycle changes, and that continues its count.
        let other =
            (dice.unit() < 0.2).then(|| (SPAN * dice.unit(), dice.one(&[0, 1]), dice.one(&[1, 2, 3, 5, 8, 12])));
        let mut rig = Rig::new(&setting, Relay::new(rules.clone()));
        let (mut stalled, mut begun_again, mut changed) = (false, false, false);
        for _ in 0..40_000 {
            if rig.cycle() {
                break;
            }
            let now = rig.session.record().time;
            if let Some((_, lasts)) = stall.filter(|(at, _)| !stalled && now.seconds() > *at) {
                rig.stall(lasts);
                stalled = true;
            }
            if let Some((_, robot, axis, by, cycles)) = again.filter(|(at, ..)| !begun_again && now.seconds() > *at) {
                share = share.max(rig.greatest_share(&setting.station.limits));
                rig.jog(robot, axis, by, cycles);
                begun_again = true;
            }
            if let Some((_, robot, cycle)) = other.filter(|(at, ..)| !changed && now.seconds() > *at) {
                share = share.max(rig.greatest_share(&setting.station.limits));
                rig.change_cycle(robot, Nanos::from_millis(cycle));
                changed = true;
            }
        }
        let last = rig.session.record();
        causes.push(last.cause);
        time += last.time.seconds();
        let found = rig.greatest_share(&setting.station.limits);
        assert!(
            found <= 1.05,
            "script {number}: {found} of a limit under {rules:?}, stall {stall:?}, again {again:?}, cycle {other:?}"
        );
        share = share.max(found);
    }
    (causes, share)
}

#[test]
fn no_link_fault_exceeds_robot_limits() {
    let scripts: u64 = sized(24, 1000);
    // Half of the scripts each: a session stays on its thread.
    let half = |first: u64| {
        let (mut stopped, mut share) = (0, 0.0_f64);
        for number in (first..scripts).step_by(2) {
            let (causes, found) = script(number);
            share = share.max(found);
            stopped += causes.iter().filter(|cause| **cause != StopCause::Completed).count();
        }
        (stopped, share)
    };
    let ((one, first), (two, second)) = thread::scope(|scope| {
        let other = scope.spawn(|| half(1));
        (half(0), other.join().expect("the other half"))
    });
    let (stopped, share) = (one + two, first.max(second));
    println!("{scripts} scripts: {stopped} sessions stopped, at most {share:.3} of a limit as the robots see it");
    assert!(stopped > scripts as usize / 2, "faults that stop nothing: {stopped}");
}

/// Returns the check that refuses a session.
fn refused(mut rig: Rig) -> Check {
    assert_eq!(rig.finish().cause, StopCause::StartRefused);
    rig.session.core().refusal().expect("a reason")
}

#[test]
fn sensor_with_bias_or_wrong_tool_is_refused() {
    let refusal = |change: fn(&mut Setting)| {
        let (mut there, setting) = (Setting::docking(), Setting::docking());
        change(&mut there);
        refused(Rig::with(&there, &setting, Relay::default()))
    };
    let heavy = refusal(|there| there.station.sensor.tool_mass = 60.0);
    assert!(heavy.kind == CheckKind::RestForce && heavy.value > 400.0, "{heavy:?}");
    let biased = refusal(|there| there.bias.force.x += 1500.0);
    assert!(biased.kind == CheckKind::RestForce && biased.value > 1400.0, "{biased:?}");
    let reversed = refusal(|there| turn_sensor(there, Quat { w: 0.0, v: vec3(0.0, 0.0, 1.0) }));
    assert!(reversed.kind == CheckKind::RestForce && reversed.value > 150.0, "{reversed:?}");
    let permuted = refusal(|there| turn_sensor(there, Quat { w: 0.5, v: vec3(0.5, 0.5, 0.5) }));
    assert!(permuted.kind == CheckKind::RestForce && permuted.value > 120.0, "{permuted:?}");
}

#[test]
fn sensor_axes_exchanged_about_the_vertical_are_refused() {
    // At the start the sensor's +z axis is horizontal and its +x axis vertical, up or down: a quarter turn about it
    // does not change the reading at rest.
    let quarter = std::f64::consts::FRAC_PI_4;
    let (mut there, setting) = (Setting::docking(), Setting::docking());
    turn_sensor(&mut there, Quat { w: quarter.cos(), v: vec3(quarter.sin(), 0.0, 0.0) });
    let mut rig = Rig::with(&there, &setting, Relay::default());
    rig.finish();
    let refusal = rig.session.core().refusal().expect("a refusal");
    assert_eq!(refusal.kind, CheckKind::TurnedForce, "{refusal}");
    // The weight of 12 kg turned by 15 degrees: 30.5 N expected on one axis, measured on another.
    assert!((refusal.value - 43.2).abs() < 3.0, "{refusal}");
    let list = rig.session.core().checklist();
    let first = list.checks().iter().find(|check| check.kind == CheckKind::RestForce).expect("a check");
    assert_eq!(first.answer(), CheckOutcome::Passed, "the first attitude does not reveal it: {first}");
    assert!(rig.greatest_share(&rig.session.core().limits()) < 0.11, "the tool is turned at a tenth of the limits");
}

#[test]
fn tool_is_weighed_in_two_attitudes_before_an_armed_run() {
    let mut rig = Rig::new(&Setting::docking(), Relay::default());
    assert_eq!(rig.finish().cause, StopCause::Completed);
    let checks = rig.session.core().checklist().checks();
    assert!(checks.iter().all(|check| check.answer() != CheckOutcome::Failed));
    for what in [CheckKind::TurnedForce, CheckKind::TurnedMoment] {
        let check = checks.iter().find(|check| check.kind == what).expect("a check");
        assert_eq!(check.answer(), CheckOutcome::Passed, "{check}");
    }
    // Robot 1 returns before the run.
    let phase = |phase: Phase| rig.records.iter().filter(move |record| record.phase == phase);
    let (before, after) = (phase(Phase::StartUp).next_back(), phase(Phase::Weighing).next_back());
    let direction =
        |i: usize| (before.expect("a start").robot_1.position[i] - after.expect("an end").robot_1.position[i]).abs();
    assert!((0..AXES).all(|i| direction(i) < 1e-4), "{:?}", std::array::from_fn::<f64, AXES, _>(direction));
}

#[test]
fn check_mode_moves_nothing_and_lists_every_check() {
    for armed in [true, false] {
        let setting = Setting { check_only: true, armed, ..Setting::docking() };
        let mut rig = Rig::new(&setting, Relay::default());
        let cause = rig.finish().cause;
        assert_eq!(cause, StopCause::Checked, "{:?}", rig.session.core().refusal());
        assert!(rig.records.iter().all(|record| record.robot_1.order != OrderKind::Move));
        let checks = rig.session.core().checklist().checks();
        assert!(checks.iter().all(|check| check.answer() != CheckOutcome::Failed));
        for what in CheckKind::ALL {
            let known = checks.iter().filter(|check| check.kind == *what && !check.value.is_nan()).count();
            let turned = matches!(what, CheckKind::TurnedForce | CheckKind::TurnedMoment);
            // This facility compares no torques.
            assert_eq!(known > 0, !turned && *what != CheckKind::Torques, "{}", what.row().id);
        }
    }
}

#[test]
fn retraction_after_a_stop_in_contact_removes_the_force() {
    let limits = Setting::docking().station.limits;
    for (retract, least_distance) in [(0.0, f64::NEG_INFINITY), (0.03, 0.02)] {
        let mut setting = Setting { retract, ..Setting::docking() };
        setting.with_rules(|rules| rules.force = 10.0);
        let mut rig = Rig::new(&setting, Relay::default());
        let last = *rig.finish();
        assert_eq!(last.cause, StopCause::ForceLimit);
        let direction = rig.session.core().retracted();
        assert_eq!(direction.is_some(), retract > 0.0);
        assert!((direction.unwrap_or(0.0) - retract).abs() < 1e-9, "{direction:?}");
        let force = last.ft.compensated.force.norm();
        assert!(retract == 0.0 || force < 5.0, "{force} N remain");
        let stop = rig.records.iter().find(|record| record.cause != StopCause::None).expect("a stop");
        let back = stop.part_a.position - last.part_a.position;
        assert!(back.norm() >= least_distance, "{back:?}");
        assert!(rig.greatest_share(&limits) <= 1.0 + 1e-6);
    }
}

#[test]
fn stopped_retraction_ramps_down() {
    let mut setting = Setting { retract: 0.3, ..Setting::docking() };
    setting.with_rules(|rules| rules.force = 10.0);
    let mut rig = Rig::new(&setting, Relay::default());
    let stopped = |rig: &Rig| rig.session.core().stopped().map(|(time, _)| time);
    // Longer after the stop than a ramp may take, in the middle of the retraction.
    while stopped(&rig).is_none_or(|time| (rig.session.record().time - time).seconds() < 15.0) {
        assert!(!rig.cycle(), "{:?}", rig.session.record().cause);
    }
    assert_eq!(rig.session.record().phase, Phase::Retracting);
    rig.session.cycle(Some(StopCause::Operator));
    rig.records.push(*rig.session.record());
    rig.finish();
    let ramp: Vec<_> = rig.records.iter().skip_while(|r| r.phase != Phase::Retracting).collect();
    let ramp: Vec<_> = ramp.into_iter().skip_while(|r| r.phase == Phase::Retracting).collect();
    let ends = ramp.iter().position(|r| r.robot_1.order == OrderKind::End).expect("the protocol's end");
    assert!(ends > 1, "a ramp before the end: {ends} cycles");
    assert_eq!(ramp[ends].robot_1.command, ramp[ends - 1].robot_1.command, "at rest at the end");
    assert!(rig.session.core().retracted().is_some_and(|direction| direction > 0.05 && direction < 0.29));
    assert!(rig.greatest_share(&setting.station.limits) <= 1.0 + 1e-6);
}

/// The sensor is mounted differently than the file states.
fn turn_sensor(there: &mut Setting, by: Quat<f64>) {
    let frame = &mut there.station.sensor.frame;
    frame.attitude = frame.attitude.compose(by);
}

#[test]
fn foreign_motion_ends_the_start_up() {
    let mut rig = Rig::new(&Setting::docking(), Relay::default());
    for _ in 0..40 {
        assert!(!rig.cycle());
    }
    // RSI ends, axis 2 is jogged by 3 degrees, RSI begins again from the same address.
    rig.jog(0, 1, 3.0_f64.to_radians(), 30);
    let refusal = refused(rig);
    assert_eq!((refusal.kind, refusal.robot, refusal.axis), (CheckKind::Still, Some(0), Some(1)));
    assert!((refusal.value.to_degrees() - 3.0).abs() < 0.1, "{refusal}");
}

#[test]
fn blocked_robot_is_detected_by_its_tool_error() {
    let mut rig = Rig::new(&Setting::docking(), Relay::default());
    rig.run_for(0.2);
    rig.network.borrow_mut().facility().hold_axis(0, Some(1));
    let cause = rig.finish().cause;
    assert_eq!(cause, StopCause::Tracking);
    let (_, alarm) = rig.session.core().stopped().expect("a stop");
    let found = alarm.violation.expect("a value beyond its limit");
    assert_eq!((found.robot, found.unit), (Some(0), "m"));
    assert!(found.value < 0.02, "stopped {} m away", found.value);
}

#[test]
fn force_peak_between_two_cycles_stops_the_session() {
    for before_the_tare in [false, true] {
        let mut rig = Rig::new(&Setting::docking(), Relay::default());
        if before_the_tare {
            while rig.session.record().phase == Phase::StartUp {
                assert!(!rig.cycle());
            }
        } else {
            rig.run_for(0.2);
        }
        rig.network.borrow_mut().facility().knock(3000.0);
        rig.cycle();
        assert_eq!(rig.session.record().cause, StopCause::ForceLimit, "before the tare: {before_the_tare}");
        rig.finish();
    }
}

#[test]
fn blind_sensor_stops_the_session_before_deep_overlap() {
    let campaign = campaign("probe_drogue.toml");
    for run in [2, 6, 9] {
        let setting = Setting::draw(&campaign, run);
        let mut rig = Rig::new(&setting, Relay::default());
        rig.run_for(0.1);
        rig.network.borrow_mut().facility().ail(Ailment::Blind);
        let cause = rig.finish().cause;
        assert_eq!(cause, StopCause::BlindSensor, "run {run}");
        let watch = rig.network.borrow_mut().facility().world().watch();
        let (depth, force) = (watch.peak_depth, watch.contact_force.value());
        assert!(depth < 20e-3 && force < 500.0, "run {run}: {depth} m, {force} N");
    }
}

#[test]
fn force_without_contact_stops_the_session() {
    let mut rig = Rig::new(&Setting::docking(), Relay::default());
    rig.run_for(0.1);
    rig.network.borrow_mut().facility().knock(80.0);
    while rig.session.record().cause == StopCause::None {
        rig.cycle();
    }
    assert_eq!(rig.session.record().cause, StopCause::FreeForce);
}

#[test]
fn armed_robots_wait_for_go_under_continued_checks() {
    let waiting = || {
        let mut rig = Rig::waiting(&Setting::docking());
        while rig.session.record().phase != Phase::Ready {
            assert!(!rig.cycle());
        }
        rig
    };
    // A minute: nothing moves, and a lost packet is tolerated.
    let mut rig = waiting();
    let from = rig.session.record().time;
    rig.network.borrow_mut().relay.add(rule(Endpoint::Robot1, Direction::Report, from, 1, Fault::Lose));
    for _ in 0..15_000 {
        assert!(!rig.cycle());
    }
    assert_eq!(rig.session.record().phase, Phase::Ready);
    assert_eq!(rig.greatest_share(&Setting::docking().station.limits), 0.0, "nothing has moved");
    rig.session.go();
    assert_eq!(rig.finish().cause, StopCause::Completed);
    // A later change ends the start-up.
    let mut rig = waiting();
    rig.jog(1, 3, 0.02, 20);
    let refusal = refused(rig);
    assert_eq!((refusal.kind, refusal.robot, refusal.axis), (CheckKind::Still, Some(1), Some(3)));
}

#[test]
fn robot_with_another_cycle_is_named() {
    for robot in [0, 1] {
        let mut rig = Rig::waiting(&Setting::docking());
        rig.with_cycle(robot, Nanos::from_millis(12));
        let refusal = refused(rig);
        assert_eq!(refusal.kind, CheckKind::Period, "{refusal}");
        let (number, measured, wanted) = (refusal.robot.expect("a robot") + 1, refusal.value, refusal.limit);
        assert_eq!(number, robot + 1);
        assert!((measured - 12e-3).abs() < 1e-4 && wanted == 4e-3, "{refusal:?}");
    }
}
