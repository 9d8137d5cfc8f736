//! One emulated facility, several sessions one after the other.

use crate::fixture::{Rig, Setting};
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::relay::Relay;
use std::sync::atomic::Ordering;

/// Time without clients before new sessions are offered.
const PAUSE: Nanos = Nanos::from_millis(1000);

#[test]
fn second_session_needs_no_new_facility() {
    let setting = Setting::docking();
    let mut rig = Rig::new(&setting, Relay::default());
    let over = rig.network.borrow_mut().facility().renew_sessions(PAUSE);
    for drive in 1..=3 {
        let last = *rig.finish();
        assert_eq!(last.cause, StopCause::Completed, "drive {drive}: {:?}", rig.session.core().refusal());
        let share = rig.greatest_share(&setting.station.limits);
        assert!(share <= 1.05, "drive {drive}: {share} of a limit");
        let mut network = rig.network.borrow_mut();
        assert_eq!(over.load(Ordering::Relaxed), drive - 1, "the parts were released before each further drive");
        assert!(network.facility().watch().closed > 0.0, "drive {drive} has captured");
        assert_eq!(network.facility().last_end(0), Some("RSI was ended by the client"));
        drop(network);
        rig = rig.again(&setting);
    }
}

#[test]
fn facility_is_ready_after_a_client_disconnects() {
    let setting = Setting::docking();
    let mut rig = Rig::new(&setting, Relay::default());
    rig.network.borrow_mut().facility().renew_sessions(PAUSE);
    rig.run_for(1.0);
    // The controllers detect its silence after 100 cycles.
    rig.stall(Nanos::from_millis(5000));
    let mut rig = rig.again(&setting);
    let last = *rig.finish();
    assert_eq!(last.cause, StopCause::Completed, "{:?}", rig.session.core().refusal());
    // The end of the second session is the last one; the first one was a silence.
    assert_eq!(rig.network.borrow_mut().facility().last_end(1), Some("RSI was ended by the client"));
    let held = last.robot_1.late_answers;
    assert_eq!(held, 0, "a new session counts its own late answers");
}

#[test]
fn facility_without_renewal_has_one_session() {
    let setting = Setting::docking();
    let mut rig = Rig::new(&setting, Relay::default());
    rig.finish();
    let mut rig = rig.again(&setting);
    assert_eq!(rig.finish().cause, StopCause::StartRefused);
}
