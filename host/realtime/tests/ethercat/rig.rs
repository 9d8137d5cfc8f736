//! A robot and a segment of emulated drives at the two ends of a veth pair.

use assert_no_alloc::assert_no_alloc;
use softdock_realtime::protocol::ethercat::drives::BringUpPhase;
use softdock_realtime::protocol::ethercat::segment::{DriveModel, EthercatSegment, Responder};
use softdock_realtime::protocol::ethercat::{AxisScale, EtherCatConfig, EtherCatRobot, OpenError};
use softdock_realtime::signals::{AXES, Order, RobotLink, RobotState};
use softdock_realtime::time::Nanos;
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A small machine runs one segment at 1 kHz at a time only.
static TURN: Mutex<()> = Mutex::new(());
static PAIRS: AtomicU32 = AtomicU32::new(0);

/// Counts per radian or metre of the test's axes.
pub(crate) const RATIO: f64 = 1e5;

/// A pair of connected interfaces, removed on drop.
pub(crate) struct Veth {
    /// The robot's interface.
    pub(crate) ours: String,
    /// The drives' interface.
    pub(crate) theirs: String,
    _turn: MutexGuard<'static, ()>,
}

impl Veth {
    /// Creates the pair; reports and returns `None` where it cannot be created.
    pub(crate) fn new(test: &str) -> Option<Self> {
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: no arguments, never fails.
        let root = unsafe { libc::geteuid() } == 0;
        let name = format!("sd{}n{}", std::process::id(), PAIRS.fetch_add(1, Ordering::Relaxed));
        let pair = Self { ours: format!("{name}a"), theirs: format!("{name}b"), _turn: turn };
        let (ours, theirs) = (pair.ours.as_str(), pair.theirs.as_str());
        let made = root
            && ip(&["link", "add", ours, "type", "veth", "peer", "name", theirs])
            && ip(&["link", "set", ours, "up"])
            && ip(&["link", "set", theirs, "up"]);
        if !made {
            println!("ignored: {test} needs root and `ip` to create a veth pair");
        }
        made.then_some(pair)
    }
}

impl Drop for Veth {
    fn drop(&mut self) {
        ip(&["link", "del", &self.ours]);
    }
}

/// Whether `ip` succeeded.
pub(crate) fn ip(arguments: &[&str]) -> bool {
    Command::new("ip").args(arguments).output().is_ok_and(|done| done.status.success())
}

/// Raises the thread's priority where permitted, as a drive with its own cycle; returns whether it is raised.
fn raise_priority() -> bool {
    let parameters = libc::sched_param { sched_priority: 50 };
    // SAFETY: the parameters outlive the call; 0 is the calling thread. A refusal changes nothing.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) == 0 }
}

/// A robot with one axis per drive, and its emulated segment.
pub(crate) struct Rig {
    /// `Some` until a test drops it.
    pub(crate) robot: Option<EtherCatRobot>,
    responder: Option<Responder>,
    /// The pair of interfaces.
    pub(crate) veth: Veth,
}

pub(crate) fn config(drives: usize) -> EtherCatConfig {
    let scales: Vec<_> = (0..drives)
        .map(|i| AxisScale {
            reversed: i % 2 == 1,
            zero: 500 * i as i32,
            rated_torque: Some(100.0),
            following_window: Some(0.05),
            ..AxisScale::new(RATIO)
        })
        .collect();
    EtherCatConfig { clocks: false, answer: Nanos::from_millis(1), ..EtherCatConfig::new(&scales) }
}

/// Returns drives at angles other than zero.
pub(crate) fn models(count: usize) -> Vec<DriveModel> {
    (0..count).map(|i| DriveModel::new(10_000 + 3000 * i as i32)).collect()
}

impl Rig {
    pub(crate) fn open(
        test: &str,
        drives: Vec<DriveModel>,
        config: &EtherCatConfig,
    ) -> Option<Result<Self, OpenError>> {
        let veth = Veth::new(test)?;
        raise_priority();
        let responder = Responder::start(&veth.theirs, EthercatSegment::new(drives)).expect("responder");
        let robot = EtherCatRobot::open(&veth.ours, config);
        Some(robot.map(|robot| Self { robot: Some(robot), responder: Some(responder), veth }))
    }

    pub(crate) fn new(test: &str, drives: Vec<DriveModel>, config: &EtherCatConfig) -> Option<Self> {
        Some(Self::open(test, drives, config)?.expect("the segment opens"))
    }

    pub(crate) fn usual(test: &str) -> Option<Self> {
        Self::new(test, models(7), &config(7))
    }

    pub(crate) fn robot(&mut self) -> &mut EtherCatRobot {
        self.robot.as_mut().expect("open")
    }

    pub(crate) fn segment(&self) -> MutexGuard<'_, EthercatSegment> {
        self.responder.as_ref().expect("answering").segment()
    }

    /// Runs one cycle without allocation; `None` if it was lost.
    pub(crate) fn cycle(&mut self) -> Option<RobotState> {
        let robot = self.robot();
        let deadline = robot.due() + Nanos::from_micros(1);
        assert_no_alloc(|| robot.receive(deadline)).expect("the link works")
    }

    /// Runs cycles until one is not lost.
    pub(crate) fn report(&mut self) -> RobotState {
        (0..2000).find_map(|_| self.cycle()).expect("a cycle that is not lost")
    }

    pub(crate) fn send(&mut self, order: Order) {
        assert_no_alloc(|| self.robot().send(&order)).expect("sent");
    }

    /// Commands the present positions until the drives follow; returns these positions.
    pub(crate) fn enable(&mut self) -> [f64; AXES] {
        for _ in 0..500 {
            let at = self.report().reported_set_point.expect("targets");
            if self.robot().phase() == BringUpPhase::Following {
                return at;
            }
            self.send(Order::Move(at));
        }
        panic!("the drives are not enabled: {:?}", self.robot().phase());
    }
}

/// Returns a raised cosine in every axis about its position: no step in position or velocity \[rad\], \[m\].
pub(crate) fn swing(start: &[f64; AXES], cycle: u32) -> [f64; AXES] {
    let swing = 0.05 * (1.0 - (std::f64::consts::TAU * f64::from(cycle) * 1e-3).cos());
    start.map(|at| at + swing)
}

pub(crate) fn largest(one: &[f64; AXES], two: &[f64; AXES]) -> f64 {
    one.iter().zip(two).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
