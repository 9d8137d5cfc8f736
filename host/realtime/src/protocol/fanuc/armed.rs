//! An armed robot: the controller's program that follows the stream is started over RMI, and ends with the link.

use super::driver::FanucRobot;
use super::rmi::{RmiError, RmiSession};
use crate::signals::{Capabilities, LinkCounters, LinkFault, Order, RobotLink, RobotState};
use crate::time::Nanos;
use crate::wire::Port;
use std::net::SocketAddr;
use std::time::Duration;

/// Longest single wait for a status.
const LOOK: Nanos = Nanos::from_millis(20);

/// Error of arming a robot.
#[derive(Debug, thiserror::Error)]
pub enum ArmError {
    /// The Remote Motion Interface refuses or fails.
    #[error(transparent)]
    Rmi(#[from] RmiError),
    /// The stream fails.
    #[error(transparent)]
    Link(#[from] LinkFault),
    /// The controller sends no status.
    #[error(
        "the FANUC controller sends no Stream Motion status: check that option J519 is installed and the port is open"
    )]
    NoStatus,
    /// The program was started, but the robot is not ready for commands.
    #[error("the FANUC controller is not ready for commands after the start of its program STREAM_MOTN: {0}")]
    NotFollowing(String),
}

/// A link to a Stream Motion robot whose program was started.
///
/// On drop, the stream ends with a last command; then the program is aborted and the session ended.
pub struct ArmedFanuc<P: Port> {
    robot: FanucRobot<P>,
    // Dropped after the robot.
    _session: RmiSession,
}

impl<P: Port> ArmedFanuc<P> {
    /// Opens a session at the controller's RMI address, clears faults, starts the program that follows the stream, and
    /// waits until the robot is ready for commands; each step may take up to `limit`. Sends no command: the cycle sends
    /// the first one.
    ///
    /// # Errors
    /// If the controller does not answer, refuses, or cannot move its robot; the error quotes the controller.
    pub fn arm(mut robot: FanucRobot<P>, controller: SocketAddr, limit: Duration) -> Result<Self, ArmError> {
        let mut session = RmiSession::open(controller, limit)?;
        session.wait_for_servos()?;
        if !wait(&mut robot, limit, |_| true)? {
            return Err(ArmError::NoStatus);
        }
        session.start_stream_program()?;
        if !wait(&mut robot, limit, |state| state.ready)? {
            return Err(ArmError::NotFollowing(session.words()));
        }
        Ok(Self { robot, _session: session })
    }
}

/// Waits for a report that satisfies a condition; returns whether one came in time.
fn wait<P: Port>(
    robot: &mut FanucRobot<P>,
    limit: Duration,
    wanted: impl Fn(&RobotState) -> bool,
) -> Result<bool, LinkFault> {
    let end = robot.now() + Nanos::from_seconds(limit.as_secs_f64());
    while robot.now() < end {
        let until = (robot.now() + LOOK).min(end);
        if robot.receive(until)?.is_some_and(|state| wanted(&state)) {
            return Ok(true);
        }
    }
    Ok(false)
}

impl<P: Port> RobotLink for ArmedFanuc<P> {
    fn capabilities(&self) -> Capabilities {
        self.robot.capabilities()
    }

    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault> {
        self.robot.receive(deadline)
    }

    fn send(&mut self, order: &Order) -> Result<(), LinkFault> {
        self.robot.send(order)
    }

    fn counters(&self) -> LinkCounters {
        self.robot.counters()
    }
}

#[cfg(test)]
mod tests {
    use super::super::controller::FanucController;
    use super::super::rmi_server::RmiServer;
    use super::*;
    use crate::clock::{Clock, Monotonic};
    use crate::protocol::EmulatedController;
    use crate::protocol::link::AT_ONCE;
    use crate::protocol::memory::state_at;
    use crate::signals::AXES;
    use crate::wire::udp::UdpPort;
    use std::sync::atomic::{AtomicBool, Ordering};

    use crate::protocol::fanuc::CYCLE;
    const LIMIT: Duration = Duration::from_millis(400);
    const START: [f64; AXES] = [0.1, -1.5, 1.4, 0.0, 0.5, -0.3, 0.0];

    fn loopback() -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], 0))
    }

    /// Serves a controller and its interface while `client` runs; returns its result and the controller.
    fn beside<T>(client: impl FnOnce(SocketAddr, &RmiServer) -> T) -> (T, FanucController) {
        let rmi = RmiServer::start(loopback()).unwrap();
        let mut controller = FanucController::new(CYCLE, 3);
        controller.obey(rmi.remote());
        let mut port = UdpPort::bind(loopback()).unwrap();
        let (stream, over) = (port.local_address().unwrap(), AtomicBool::new(false));
        std::thread::scope(|scope| {
            let served = scope.spawn(|| {
                let (mut next, mut buffer) = (Monotonic.now(), [0; 1500]);
                while !over.load(Ordering::Relaxed) {
                    let state = state_at(controller.line_at(next).unwrap_or(START), next);
                    controller.report(next, &state, &mut |to, datagram| port.send(datagram, to).unwrap());
                    next += CYCLE;
                    while let Some((length, from)) = port.receive(&mut buffer, next).unwrap() {
                        let now = Monotonic.now();
                        controller.take(now, from, &buffer[..length], &mut |to, reply| port.send(reply, to).unwrap());
                    }
                }
                // Last command of the client.
                while let Some((length, from)) = port.receive(&mut buffer, AT_ONCE).unwrap() {
                    controller.take(next, from, &buffer[..length], &mut |_, _| {});
                }
                controller
            });
            let answer = client(stream, &rmi);
            over.store(true, Ordering::Relaxed);
            (answer, served.join().unwrap())
        })
    }

    fn arm(stream: SocketAddr, rmi: SocketAddr) -> Result<ArmedFanuc<UdpPort>, ArmError> {
        let robot = FanucRobot::open(UdpPort::bind(loopback()).unwrap(), stream, CYCLE).unwrap();
        ArmedFanuc::arm(robot, rmi, LIMIT)
    }

    #[test]
    fn armed_robot_follows_and_its_program_ends_with_the_link() {
        let (moved, controller) = beside(|stream, rmi| {
            let mut last = 0.0;
            for turn in 1..=2 {
                let mut robot = arm(stream, rmi.local_address()).unwrap();
                assert!(rmi.remote().runs_program());
                let mut sent = 0;
                while sent < 30 {
                    let Some(state) = robot.receive(Monotonic.now() + Nanos::from_millis(500)).unwrap() else {
                        continue;
                    };
                    assert!(state.ready, "turn {turn}, command {sent}");
                    let mut target = START;
                    target[0] += 1e-3 * f64::from(turn - 1) * 30.0 + 1e-3 * f64::from(sent);
                    robot.send(&Order::Move(target)).unwrap();
                    (last, sent) = (target[0], sent + 1);
                }
                drop(robot);
                assert!(!rmi.remote().runs_program(), "aborted with the robot");
            }
            last
        });
        let at = controller.line_at(Nanos(i64::MAX / 4)).unwrap();
        assert_eq!(controller.fault(), None);
        assert!((at[0] - moved).abs() < 2e-3 && at[0] > START[0] + 0.05, "{} {moved}", at[0]);
    }

    #[test]
    fn refusals_quote_the_controller() {
        let (errors, controller) = beside(|stream, rmi| {
            let mut errors = Vec::new();
            rmi.remote().press_emergency_stop(true);
            errors.push(arm(stream, rmi.local_address()).err().expect("an emergency stop").to_string());
            rmi.remote().press_emergency_stop(false);
            rmi.remote().teach(true);
            errors.push(arm(stream, rmi.local_address()).err().expect("a teach pendant").to_string());
            rmi.remote().teach(false);
            errors.push(arm(unused_port(), rmi.local_address()).err().expect("no stream").to_string());
            errors.push(arm(stream, SocketAddr::from(([127, 0, 0, 1], 1))).err().expect("no RMI").to_string());
            assert!(!rmi.remote().runs_program());
            errors
        });
        assert!(errors[0].contains("its servos are off: SRVO-001 Operator panel E-stop"), "{}", errors[0]);
        assert!(errors[1].contains("teach pendant is on"), "{}", errors[1]);
        assert!(errors[2].contains("no Stream Motion status"), "{}", errors[2]);
        assert!(errors[3].contains("does not answer FRC_Connect_STMO: Connection refused"), "{}", errors[3]);
        assert_eq!(controller.line_at(Nanos(0)), Some(START), "nothing has moved");
    }

    /// An unused port.
    fn unused_port() -> SocketAddr {
        UdpPort::bind(loopback()).unwrap().local_address().unwrap()
    }

    #[test]
    fn dry_run_starts_no_program_and_is_ready() {
        let ((), controller) = beside(|stream, rmi| {
            let robot = FanucRobot::open(UdpPort::bind(loopback()).unwrap(), stream, CYCLE).unwrap();
            let mut robot = robot.watched();
            assert!(wait(&mut robot, LIMIT, |state| state.ready).unwrap());
            robot.send(&Order::Hold).unwrap();
            rmi.remote().press_emergency_stop(true);
            assert!(wait(&mut robot, LIMIT, |state| !state.ready).unwrap());
            assert!(!rmi.remote().runs_program());
        });
        assert_eq!(controller.line_at(Nanos(0)), Some(START), "nothing has moved");
    }
}
