//! RSI: our driver against a controller that runs elsewhere, in hold; and against our emulated one over UDP.

use super::{Served, alone, at_rest, loopback, now, serve_controller};
use softdock_realtime::protocol::rsi::controller::{Krc, KrcSettings};
use softdock_realtime::protocol::rsi::driver::RsiRobot;
use softdock_realtime::protocol::rsi::tags::TagMap;
use softdock_realtime::signals::{AXES, LinkCounters, Order, RobotLink};
use softdock_realtime::time::Nanos;
use softdock_realtime::wire::udp::UdpPort;
use std::net::SocketAddr;

const START: [f64; AXES] = [0.1, -0.5, 0.4, 0.0, 0.5, -0.3, 0.0];

/// The minimum that any controller sends: axes and IPOC.
fn least() -> TagMap {
    TagMap { axes_asked: None, pose: None, pose_asked: None, delay: None, ..TagMap::im_free() }
}

/// Holds the robot that sends to `port` for some of its cycles; returns the counters, and its greatest motion \[rad,
/// m\].
fn hold(port: UdpPort, tags: TagMap, cycles: usize) -> (LinkCounters, f64) {
    let mut robot = RsiRobot::new(port, tags, None).unwrap();
    let mut start = None;
    let mut moved = 0.0_f64;
    for cycle in 0..cycles {
        let patience = Nanos::from_millis(if cycle == 0 { 10_000 } else { 1000 });
        let state = robot.receive(now() + patience).unwrap();
        let state = state.unwrap_or_else(|| panic!("no message after {cycle} cycles"));
        robot.send(&Order::Hold).unwrap();
        let from = start.get_or_insert(state.position);
        moved = state.position.iter().zip(from).fold(moved, |moved, (a, b)| moved.max((a - *b).abs()));
    }
    (robot.counters(), moved)
}

#[test]
#[ignore = "needs a running controller: SOFTDOCK_PEER_RSI, the local address that it sends to"]
fn running_controller_is_held() {
    let Ok(address) = std::env::var("SOFTDOCK_PEER_RSI") else {
        println!("ignored: SOFTDOCK_PEER_RSI is not set");
        return;
    };
    let _alone = alone();
    let address: SocketAddr = address.parse().expect("SOFTDOCK_PEER_RSI is an address and port");
    let (counters, moved) = hold(UdpPort::bind(address).unwrap(), least(), 250);
    println!("RSI at {address}: {counters:?}, moved {moved:.2e}");
    assert_eq!((counters.lost, counters.malformed, counters.stale), (0, 0, 0));
    // Six decimals of a degree, and the servo's own noise.
    assert!(moved < 1e-3, "the robot has moved by {moved} while it was held");
}

#[test]
#[ignore = "needs undisturbed time: 1 s at 4 ms"]
fn our_controller_is_held_over_udp() {
    let _alone = alone();
    let port = UdpPort::bind(loopback(0)).unwrap();
    let krc = Krc::new(KrcSettings::new(TagMap::kroshu(), port.local_address().unwrap()));
    let theirs = UdpPort::bind(loopback(0)).unwrap();
    let served = Served::start(move |over| serve_controller(theirs, krc, at_rest(START), over));
    let (counters, moved) = hold(port, TagMap::kroshu(), 250);
    served.end();
    println!("our KRC over UDP: {counters:?}");
    assert_eq!((counters.lost, counters.malformed, counters.stale), (0, 0, 0));
    assert!(moved < 1e-6);
}
