//! EGM: the client ABBRobotEGM against our emulated robot.

use super::{PythonPeer, Served, alone, assert_near, at_rest, loopback, numbers, serve_controller};
use softdock_kernels::space::Wrench;
use softdock_kernels::vector::{Pose, Quat, vec3};
use softdock_realtime::protocol::egm::controller::{EgmController, EgmSettings};
use softdock_realtime::signals::{AXES, RAIL, RobotState};
use softdock_realtime::wire::udp::UdpPort;

const START: [f64; AXES] = [0.1, -0.5, 0.4, 0.0, 0.5, -0.3, 1.2];

#[test]
#[ignore = "needs ABBRobotEGM: SOFTDOCK_PEER_PYTHON"]
fn abb_robot_egm_moves_our_robot() {
    let _alone = alone();
    let mut client = PythonPeer::start("egm_client.py", &["1000"]);
    let settings =
        EgmSettings { rail: true, ..EgmSettings::new(loopback(PythonPeer::port(&client.next_line(), "port"))) };
    let mut robot = EgmController::new(settings);
    robot.set_force(Some(Wrench { force: vec3(1.0, 2.0, 3.0), moment: vec3(4.0, 5.0, 6.0) }));
    let start = RobotState {
        pose: Some(Pose { position: vec3(1.0, 0.25, 1.5), attitude: Quat::identity() }),
        torque: Some([10.0; AXES]),
        ..at_rest(START)
    };
    let port = UdpPort::bind(loopback(0)).unwrap();
    let served = Served::start(move |over| serve_controller(port, robot, start, over));
    let result = client.next_line();
    std::thread::sleep(std::time::Duration::from_millis(50));
    let end = served.end();
    assert_eq!((result["missed"].as_u64(), result["mci_state"].as_u64()), (Some(0), Some(3)));
    assert_eq!((result["motors_on"].as_bool(), result["rapid_running"].as_bool()), (Some(true), Some(true)));
    assert_eq!(result["last"].as_u64().unwrap() - result["first"].as_u64().unwrap(), 999);
    assert_near(&numbers(&result["position"]), &[1000.0, 250.0, 1500.0], 1e-9);
    assert_near(&numbers(&result["force"]), &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 0.0);
    assert_near(&numbers(&result["torque"]), &[10.0; 6], 0.0);
    // The last report is two cycles behind the last target; the robot has arrived there since.
    let target = numbers(&result["target"]);
    assert_near(&numbers(&result["joints"]), &target, 0.2);
    let joints: Vec<_> = end.position[..RAIL].iter().map(|angle| angle.to_degrees()).collect();
    assert_near(&joints, &target, 1e-9);
    assert_near(&[end.position[RAIL] * 1e3], &numbers(&result["external_target"]), 1e-9);
    assert_near(&numbers(&result["external"]), &numbers(&result["external_target"]), 0.1);
}
