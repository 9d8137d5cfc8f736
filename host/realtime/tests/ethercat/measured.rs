//! Measurements without thresholds: round trips on this machine, and a real segment.

use super::rig::{RATIO, Rig, largest, swing};
use softdock_realtime::protocol::ethercat::cia402::control;
use softdock_realtime::protocol::ethercat::drives::BringUpPhase;
use softdock_realtime::protocol::ethercat::{AxisScale, EtherCatConfig, EtherCatRobot};
use softdock_realtime::signals::{Order, RobotLink};
use softdock_realtime::time::Nanos;

/// Percentiles of round trip and lateness over 15,000 cycles of motion; without a threshold.
fn measure(rig: &mut Rig, cycles: u32) {
    let start = rig.enable();
    let before = rig.robot().counters();
    let (mut trips, mut lateness) = (Vec::new(), Vec::new());
    let mut cycle = 0;
    for _ in 0..cycles {
        let due = rig.robot().due();
        let state = rig.cycle();
        let trip = rig.robot().round_trip();
        trips.push(trip.0);
        if let Some(state) = state {
            lateness.push((state.received - due - trip).0);
            cycle += 1;
            rig.send(Order::Move(swing(&start, cycle)));
        }
    }
    let after = rig.robot().counters();
    let (lost, unsent) = (after.lost - before.lost, after.unsent - before.unsent);
    for (name, values) in [("round trip", &mut trips), ("lateness", &mut lateness)] {
        values.sort_unstable();
        let at = |share: f64| values[((values.len() - 1) as f64 * share) as usize] as f64 * 1e-3;
        let [p50, p99, p999, max] = [0.5, 0.99, 0.999, 1.0].map(at);
        println!("{name}: p50 {p50:.1} us, p99 {p99:.1} us, p99.9 {p999:.1} us, max {max:.1} us");
    }
    let counter = rig.robot().working_counter();
    println!("{cycles} cycles, working counter {counter}, {lost} lost, {unsent} not begun in time");
}

#[test]
#[ignore = "a measurement of 15 s"]
fn measure_round_trips_over_15000_cycles() {
    for fifo in [false, true] {
        let Some(mut rig) = Rig::usual("the measurement") else { return };
        if !fifo {
            let parameters = libc::sched_param { sched_priority: 0 };
            // SAFETY: the parameters outlive the call; 0 is the calling thread.
            unsafe { libc::sched_setscheduler(0, libc::SCHED_OTHER, &raw const parameters) };
        }
        println!("{}", if fifo { "with SCHED_FIFO" } else { "with the ordinary scheduler" });
        measure(&mut rig, 15_000);
    }
}

/// `SOFTDOCK_PEER_ETHERCAT=eth1`: a real segment, whose first one to seven devices are drives. Nothing is enabled.
#[test]
#[ignore = "needs a real segment: SOFTDOCK_PEER_ETHERCAT=<interface> [SOFTDOCK_PEER_ETHERCAT_DRIVES=<1 to 7>]"]
fn real_segment_reaches_op_and_holds() {
    let Ok(interface) = std::env::var("SOFTDOCK_PEER_ETHERCAT") else {
        println!("ignored: SOFTDOCK_PEER_ETHERCAT names no interface");
        return;
    };
    let drives = std::env::var("SOFTDOCK_PEER_ETHERCAT_DRIVES").ok().and_then(|text| text.parse().ok()).unwrap_or(7);
    let scales = vec![AxisScale::new(RATIO); drives];
    let mut robot = EtherCatRobot::open(&interface, &EtherCatConfig::new(&scales)).expect("the segment opens");
    let first = loop {
        if let Some(state) = robot.receive(robot.due() + Nanos(1)).expect("the link works") {
            break state;
        }
    };
    for _ in 0..10_000 {
        robot.send(&Order::Hold).expect("sent");
        if let Some(state) = robot.receive(robot.due() + Nanos(1)).expect("the link works") {
            assert!(largest(&state.position, &first.position) < 0.01, "an axis moves though nothing is enabled");
        }
    }
    assert_eq!(robot.phase(), BringUpPhase::Resting);
    println!("{:?}, controlword {:#06x} all the time", robot.counters(), control::DISABLE_VOLTAGE);
}
