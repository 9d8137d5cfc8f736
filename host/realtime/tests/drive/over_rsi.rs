//! A docking over the real protocols in virtual time.

use crate::fixture::{Rig, Setting};
use softdock_campaign::criteria::succeeds;
use softdock_realtime::log::codes::StopCause;
use softdock_realtime::wire::relay::Relay;

#[test]
fn docking_over_rsi_and_net_ft_ends_in_capture() {
    let mut rig = Rig::new(&Setting::docking(), Relay::default());
    let last = *rig.finish();
    assert_eq!(rig.session.core().refusal(), None);
    assert_eq!(last.cause, StopCause::Completed, "{:?} {:?}", last.phase, last.contact_energy);
    let metrics = rig.session.core().metrics();
    assert!(succeeds(&Setting::docking().plant.task, &metrics));
    let link = last.robot_1.link;
    assert_eq!((link.lost, link.stale, link.malformed, link.foreign, link.unsent), (0, 0, 0, 0, 0));
    assert_eq!((last.robot_1.late_answers, last.robot_2.late_answers), (0, 0));
}
