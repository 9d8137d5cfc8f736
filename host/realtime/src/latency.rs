//! Measures this machine's real-time performance in a cycle of 1 ms: lateness and round trip of a session, in process
//! and over loopback.

use crate::clock::{Clock, Monotonic};
use crate::drive::core::{SessionTask, Unprepared};
use crate::drive::session::Session;
use crate::emulation::facility::EmulatedFacility;
use crate::emulation::in_process::{InProcessRig, links};
use crate::emulation::loopback;
use crate::emulation::server::{self, Sockets};
use crate::emulation::world::World;
use crate::histogram::Histogram;
use crate::log::codes::robot_flags;
use crate::process::{Realtime, Warning};
use crate::signals::LinkFault;
use crate::time::Nanos;
use softdock_campaign::Station;
use softdock_campaign::station::{LinkRules, Tracking};
use softdock_kernels::space::Wrench;
use std::fmt;
use std::io;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

/// The cycle.
const CYCLE: Nanos = Nanos::from_millis(1);
/// Threshold of a late cycle.
const LATE: Nanos = Nanos::from_millis(1);
/// Cycles before the measurement begins.
const SETTLED: u64 = 100;

/// A time in the unreachable future.
const FOREVER: Nanos = Nanos(i64::MAX);

/// Transport between the session and its robots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Between {
    /// None: emulated robots in the session's own thread, paced by its timer. Their computation is part of the
    /// lateness.
    Nothing,
    /// RSI and Net F/T on loopback, the facility in another thread, paced by its packets.
    Loopback,
}

/// Measured configuration.
#[derive(Debug)]
pub struct Latency {
    /// Transport.
    pub between: Between,
    /// Delay of a cycle's start after its timer, or after the arrival of the packet that began it.
    pub lateness: Histogram,
    /// Time from a report's arrival until its answer was sent.
    pub round_trip: Histogram,
    /// Delay of the emulated facility's work; empty in process.
    pub facility: Histogram,
    /// Cycles more than 1 ms late.
    pub late: u64,
    /// Cycles whose work took more than 1 ms.
    pub overruns: u64,
    /// Cycles without a report of robot 1.
    pub missed: u64,
    /// Rights that the operating system has not granted, and other warnings.
    pub warnings: Vec<Warning>,
}

/// Error of the measurement.
#[derive(Debug, thiserror::Error)]
pub enum Unmeasured {
    /// The run cannot be driven.
    #[error(transparent)]
    Unprepared(#[from] Unprepared),
    /// No link could be opened.
    #[error(transparent)]
    Link(#[from] LinkFault),
    /// No thread or socket is available.
    #[error("the operating system refuses a thread or a socket: {0}")]
    Machine(#[from] io::Error),
    /// A requested right was not granted.
    #[error(transparent)]
    Refused(#[from] Warning),
    /// A thread has panicked.
    #[error("a thread of the measurement has failed")]
    Panicked,
}

/// Measures sessions on an emulated facility for a time \[s\], one tick per cycle, on a separate thread.
///
/// `key` seeds the facility's noise. Lateness stops no session here: silent links and old samples are tolerated.
///
/// # Errors
/// If the run cannot be driven, or the machine has no thread or socket for it.
pub fn measure(
    task: &SessionTask,
    key: [u32; 2],
    between: Between,
    seconds: f64,
    realtime: Realtime,
) -> Result<Latency, Unmeasured> {
    let task = SessionTask { station: Arc::new(patient(&task.station)), armed: true, to_start: true, ..task.clone() };
    let thread = thread::Builder::new().name("cycle".to_owned());
    let thread = thread.spawn(move || {
        let mut latency = Latency::new(between, realtime.apply()?);
        let end = Monotonic.now() + Nanos::from_seconds(seconds);
        while Monotonic.now() < end {
            session(&task, key, end, realtime, &mut latency)?;
        }
        Ok(latency)
    })?;
    thread.join().map_err(|_| Unmeasured::Panicked)?
}

/// Returns a facility whose rules tolerate a late machine.
pub fn patient(station: &Station) -> Station {
    let mut station = station.clone();
    station.links = LinkRules {
        hold_cycles: 1_000,
        stop_cycles: 2_000,
        window_cycles: 10_000,
        catch_up: 10.0,
        tracking: Tracking { distance: 1.0, angle: 1.0, time: 1.0 },
        sensor_age: 1.0,
        ..station.links
    };
    station
}

/// Runs one session to its end, or to the end of the measurement.
fn session(
    task: &SessionTask,
    key: [u32; 2],
    end: Nanos,
    realtime: Realtime,
    latency: &mut Latency,
) -> Result<(), Unmeasured> {
    let world = World::new(&task.plant, &task.station, key, task.run, &task.params, Wrench::zero());
    let world = world.map_err(Unprepared::from)?;
    let clock: Rc<dyn Clock> = Rc::new(Monotonic);
    if latency.between == Between::Nothing {
        // Prepared first: missed timer ticks count from the next one on.
        let bench = InProcessRig::new(world, Rc::clone(&clock), CYCLE);
        return cycles(Session::new(task.clone(), links(&bench), None, clock)?, end, latency);
    }
    let (facility, sockets, links) = loopback::rsi(world, CYCLE)?;
    let stop = Arc::new(AtomicBool::new(false));
    let facility = serve(facility, sockets, realtime, Arc::clone(&stop))?;
    let done = Session::new(task.clone(), links, None, clock).map_err(Unmeasured::from);
    let done = done.and_then(|session| cycles(session, end, latency));
    stop.store(true, Ordering::Relaxed);
    latency.facility.merge(&facility.join().map_err(|_| Unmeasured::Panicked)??);
    done
}

/// Runs the facility in a thread of the same rights; returns its lateness.
fn serve(
    mut facility: EmulatedFacility,
    mut sockets: Sockets,
    realtime: Realtime,
    stop: Arc<AtomicBool>,
) -> io::Result<thread::JoinHandle<io::Result<Histogram>>> {
    thread::Builder::new().name("facility".to_owned()).spawn(move || {
        // The thread stands for another machine: the cycle's thread has reported refused rights already.
        let _ = Realtime { core: None, strict: false, ..realtime }.apply();
        let mut lateness = Histogram::default();
        server::serve(&mut facility, &mut sockets, &stop, FOREVER, &mut lateness)?;
        Ok(lateness)
    })
}

fn cycles(mut session: Session, end: Nanos, latency: &mut Latency) -> Result<(), Unmeasured> {
    session.go();
    for _ in 0..SETTLED {
        session.cycle(None);
    }
    let before = session.record().overruns;
    while !session.cycle(None) && Monotonic.now() < end {
        let robot = &session.record().robot_1;
        if robot.flags & robot_flags::FRESH == 0 {
            latency.missed += 1;
            continue;
        }
        latency.lateness.add(robot.lateness);
        latency.round_trip.add(robot.round_trip);
        latency.late += u64::from(robot.lateness > LATE);
    }
    latency.overruns += session.record().overruns - before;
    Ok(())
}

impl Latency {
    fn new(between: Between, warnings: Vec<Warning>) -> Self {
        let [lateness, round_trip, facility] = [(); 3].map(|()| Histogram::default());
        Self { between, lateness, round_trip, facility, late: 0, overruns: 0, missed: 0, warnings }
    }
}

impl fmt::Display for Latency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { lateness, round_trip, facility, late, overruns, missed, .. } = self;
        writeln!(
            f,
            "cycles      {}, {late} more than 1 ms late, {overruns} overruns, {missed} without a report",
            lateness.total()
        )?;
        writeln!(f, "lateness    {lateness}")?;
        writeln!(f, "round trip  {round_trip}")?;
        if facility.total() > 0 {
            writeln!(f, "facility    {facility} late itself")?;
        }
        for (name, histogram) in [("lateness", lateness), ("round trip", round_trip)] {
            write!(f, "{name}, cycles below")?;
            histogram
                .doublings()
                .try_for_each(|(time, count)| write!(f, " {:.0} us: {count}", time.0 as f64 * 1e-3))?;
            writeln!(f)?;
        }
        self.warnings.iter().try_for_each(|warning| writeln!(f, "warning: {warning}"))
    }
}
