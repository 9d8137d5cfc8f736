//! Prediction of a session: the same session on an emulated facility, in process and in virtual time.

use super::core::{SessionTask, Unprepared};
use super::session::Session;
use crate::clock::Virtual;
use crate::emulation::in_process::{InProcessRig, links};
use crate::emulation::world::World;
use crate::log::record::CycleRecord;
use crate::time::Nanos;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::outcome::Stop;
use softdock_kernels::params::Params;
use softdock_kernels::space::Wrench;
use std::rc::Rc;

/// More cycles than any session has.
const MOST_CYCLES: u64 = 10_000_000;

/// End of a predicted session.
#[derive(Clone, Copy, Debug)]
pub struct PredictedRun {
    /// Metrics as measured by that facility.
    pub metrics: Metrics<f64>,
    /// The session rule that was met, with its value; `None` if no rule stopped the session.
    pub stop: Option<Stop>,
    /// Time of the run at its end \[s\].
    pub run_time: f64,
    /// The last cycle.
    pub last: CycleRecord,
}

/// Predicts a session on a facility with the parameters of another draw; `cycle` is that of the robots.
///
/// # Errors
/// If the run cannot be driven on these robots.
pub fn expect(
    task: &SessionTask,
    key: [u32; 2],
    facility: &Params<f64>,
    cycle: Nanos,
) -> Result<PredictedRun, Unprepared> {
    rehearse(task, key, facility, cycle, &mut |_| ())
}

/// Predicts a session, and passes each cycle to `watch`.
///
/// # Errors
/// As [`expect`].
pub fn rehearse(
    task: &SessionTask,
    key: [u32; 2],
    facility: &Params<f64>,
    cycle: Nanos,
    see: &mut dyn FnMut(&CycleRecord),
) -> Result<PredictedRun, Unprepared> {
    let world = World::new(&task.plant, &task.station, key, task.run, facility, Wrench::zero())?;
    let clock = Rc::new(Virtual::default());
    let bench = InProcessRig::new(world, clock.clone(), cycle);
    let task = SessionTask { armed: false, to_start: true, ..task.clone() };
    let mut session = Session::new(task, links(&bench), None, clock)?;
    for _ in 0..MOST_CYCLES {
        if session.core().begins() {
            bench.borrow_mut().begin_run(session.core().tare_found());
        }
        let is_over = session.cycle(None);
        see(session.record());
        if is_over {
            break;
        }
    }
    let core = session.core();
    Ok(PredictedRun {
        metrics: core.metrics(),
        stop: core.rule_met(),
        run_time: core.progress().time,
        last: *session.record(),
    })
}
