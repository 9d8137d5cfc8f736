//! The CPU farm: tiles of eight f64 lanes on all cores; the instruction set is chosen at run time.

use crate::contact_events::ContactRecorder;
use crate::instructions::{InstructionSet, OnLanes};
use crate::{Engine, EngineError, Job, RunInput, all_of};
use rayon::prelude::*;
use softdock_kernels::frame::Tile;
use softdock_kernels::lanes::Lane;
use softdock_kernels::outcome::{ContactEvent, Finished, Signals};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::with_joints;
use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Ticks between two looks for finished lanes: short against a run, long against the look.
const SLICE_TICKS: usize = 32;

/// The CPU engine.
#[derive(Debug)]
pub struct CpuEngine {
    instructions: InstructionSet,
}

impl CpuEngine {
    /// With the widest instruction set of this machine.
    pub fn new() -> Self {
        Self { instructions: InstructionSet::detect() }
    }

    /// With a given instruction set; one that the machine lacks becomes [`InstructionSet::OneLane`].
    pub fn with(instructions: InstructionSet) -> Self {
        Self { instructions: if instructions.supported() { instructions } else { InstructionSet::OneLane } }
    }
}

impl Default for CpuEngine {
    fn default() -> Self {
        Self::new()
    }
}

impl Engine for CpuEngine {
    fn device(&self) -> String {
        let note = match self.instructions {
            InstructionSet::OneLane if InstructionSet::detect() == InstructionSet::OneLane => {
                " (no fused multiply-add: exact but slow)"
            }
            _ => "",
        };
        format!("cpu f64 {:?}{note}", self.instructions)
    }

    fn lanes(&self) -> usize {
        rayon::current_num_threads() * self.instructions.lanes()
    }

    fn run(
        &mut self,
        job: &Job,
        runs: &[RunInput],
        progress: &(dyn Fn(&[Finished]) -> bool + Sync),
    ) -> Result<Vec<Finished>, EngineError> {
        if runs.iter().any(|run| run.plant.is_some()) {
            return with_own_plants(job, runs, progress);
        }
        let queue = Queue { runs, next: AtomicUsize::new(0), stopped: AtomicBool::new(false), progress };
        let instructions = self.instructions;
        // A tile ends early only where the user stops the batch.
        let finished: Vec<Finished> = (0..rayon::current_num_threads())
            .into_par_iter()
            .with_max_len(1)
            .flat_map_iter(|_| by_joints(instructions, job, &queue, None))
            .collect();
        all_of(runs, finished)
    }
}

/// Runs that have plants of their own, one by one: the lanes of a tile share a plant.
fn with_own_plants(
    job: &Job,
    runs: &[RunInput],
    progress: &(dyn Fn(&[Finished]) -> bool + Sync),
) -> Result<Vec<Finished>, EngineError> {
    let stopped = AtomicBool::new(false);
    let finished = runs.par_iter().filter_map(|run| {
        if stopped.load(Ordering::Relaxed) {
            return None;
        }
        let finished = alone(job, run, None);
        stopped.fetch_or(!progress(&[finished]), Ordering::Relaxed);
        Some(finished)
    });
    all_of(runs, finished.collect())
}

/// Makes one run in one lane.
fn alone(job: &Job, run: &RunInput, see: See) -> Finished {
    let job = &*job_of(job, run);
    let runs = std::slice::from_ref(run);
    let queue = Queue { runs, next: AtomicUsize::new(0), stopped: AtomicBool::new(false), progress: &|_| true };
    by_joints(InstructionSet::OneLane, job, &queue, see)[0]
}

/// The job with the plant of a run.
fn job_of<'a>(job: &'a Job, run: &RunInput) -> Cow<'a, Job> {
    match &run.plant {
        Some(plant) => Cow::Owned(Job { plant: Plant::clone(plant), batch: job.batch }),
        None => Cow::Borrowed(job),
    }
}

/// Runs waiting for a free lane.
struct Queue<'a> {
    runs: &'a [RunInput],
    next: AtomicUsize,
    stopped: AtomicBool,
    progress: &'a (dyn Fn(&[Finished]) -> bool + Sync),
}

impl Queue<'_> {
    fn take(&self) -> Option<&RunInput> {
        self.runs.get(self.next.fetch_add(1, Ordering::Relaxed))
    }

    fn report(&self, ended: &[Finished]) -> bool {
        if !ended.is_empty() && !(self.progress)(ended) {
            self.stopped.store(true, Ordering::Relaxed);
        }
        !self.stopped.load(Ordering::Relaxed)
    }
}

/// Who watches the signals of a tile's first lane, tick by tick.
type See<'s> = Option<&'s mut dyn FnMut(&Signals)>;

/// Steps tiles until the queue is empty; `see` is handed the signals of the first lane after every tick.
#[inline(always)]
fn work<L: Lane, const N: usize>(job: &Job, queue: &Queue, mut see: See) -> Vec<Finished> {
    let mut tile = Tile::<L, N>::new(&job.plant, job.batch);
    let mut out = Vec::new();
    // A watcher sees no tick after the end of its run.
    let slice = if see.is_some() { 1 } else { SLICE_TICKS };
    loop {
        let free: Vec<usize> = tile.free_lanes().collect();
        let entering: Vec<(usize, u64, Params<f64>)> =
            free.iter().map_while(|lane| queue.take().map(|r| (*lane, r.run, r.params))).collect();
        if !entering.is_empty() {
            tile.load(&job.plant, &entering);
        } else if free.len() == L::WIDTH {
            return out;
        }
        for _ in 0..slice {
            tile.step(&job.plant);
        }
        if let Some(see) = &mut see {
            see(&tile.signals(&job.plant, 0));
        }
        let before = out.len();
        tile.take_finished(&job.plant, &mut out);
        if !queue.report(&out[before..]) {
            return out;
        }
    }
}

/// A worker of the farm.
struct Worker<'a, 's, const N: usize> {
    job: &'a Job,
    queue: &'a Queue<'a>,
    see: See<'s>,
}

impl<const N: usize> OnLanes for Worker<'_, '_, N> {
    type Output = Vec<Finished>;
    #[inline(always)]
    fn execute<L: Lane>(self) -> Vec<Finished> {
        work::<L, N>(self.job, self.queue, self.see)
    }
}

fn dispatch<const N: usize>(instructions: InstructionSet, job: &Job, queue: &Queue, see: See<'_>) -> Vec<Finished> {
    instructions.run(Worker::<N> { job, queue, see })
}

fn by_joints(instructions: InstructionSet, job: &Job, queue: &Queue, see: See<'_>) -> Vec<Finished> {
    with_joints!(job.plant.joints(), dispatch(instructions, job, queue, see))
}

/// Repeats one run in f64, one lane, and shows its signals after every tick \[`see`\]; the same bits as in any tile.
pub fn replay(job: &Job, input: RunInput, see: &mut dyn FnMut(&Signals)) -> Finished {
    alone(job, &input, Some(see))
}

/// Repeats one run in f64, one lane, with the contact events of both loops: in space, on the facility; the same bits as in
/// any tile.
///
/// Separations of at most `merge_gap` \[s\] do not end an event.
pub fn contact_events(job: &Job, input: &RunInput, merge_gap: f64) -> (Finished, [Vec<ContactEvent>; 2]) {
    let job = &*job_of(job, input);
    let mut recorders = [ContactRecorder::new(merge_gap), ContactRecorder::new(merge_gap)];
    let finished = with_joints!(job.plant.joints(), observed(job, input, &mut recorders));
    (finished, recorders.map(ContactRecorder::into_events))
}

fn observed<const N: usize>(job: &Job, input: &RunInput, recorders: &mut [ContactRecorder; 2]) -> Finished {
    let mut tile = Tile::<f64, N>::new(&job.plant, job.batch);
    tile.load(&job.plant, &[(0, input.run, input.params)]);
    let ([in_space, on_facility], mut finished) = (recorders, Vec::new());
    loop {
        for _ in 0..SLICE_TICKS {
            tile.step_observed(&job.plant, in_space, on_facility);
        }
        tile.take_finished(&job.plant, &mut finished);
        if let Some(finished) = finished.pop() {
            return finished;
        }
    }
}
