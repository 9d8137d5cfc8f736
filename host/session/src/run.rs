//! Runs a session: the cycle in its own thread, the operator in the calling one; locks, links, files.

use crate::addresses::OpenedLinks;
use crate::answer::EndedSession;
use crate::error::{Result, SessionError};
use crate::files::{export, log_setup, write_answer, write_evidence};
use crate::operator::{Operator, SessionNotice};
use crate::plan::{SessionPlan, since_epoch};
use crate::rights::lock_robots;
use softdock_kernels::philox;
use softdock_kernels::space::Wrench;
use softdock_realtime::clock::{Clock, Monotonic, Virtual};
use softdock_realtime::drive::controls::Controls;
use softdock_realtime::drive::feed::{Feed, feed};
use softdock_realtime::drive::runner::{Alarms, Keeping, run};
use softdock_realtime::drive::session::Session;
use softdock_realtime::emulation::world::World;
use softdock_realtime::log::evidence::EvidenceBuffer;
use softdock_realtime::log::writer::LogWriter;
use softdock_realtime::time::Nanos;
use softdock_realtime::view::model::Budgets;
use std::fs;
use std::rc::Rc;

/// Recorded time before a stop in the evidence.
const EVIDENCE_SPAN: Nanos = Nanos::from_millis(2000);

impl SessionPlan {
    /// Runs the session: locks, links, checks, run, stop, log, evidence, `drive.json`, Parquet.
    ///
    /// `operator` watches it in the calling thread; GO and stops reach the cycle through `controls`. `alarms` counts
    /// the caller's signals and panics: each causes a controlled stop. If nothing was driven, no file remains.
    ///
    /// # Errors
    /// If the results folder holds a log, another process drives a robot, a link cannot be opened, the run cannot be
    /// driven on these robots, or a file cannot be written.
    pub fn run(&self, operator: &dyn Operator, controls: &Controls, alarms: &Alarms) -> Result<EndedSession> {
        self.check_folder()?;
        // One process drives a robot; the locks end with this function.
        let _locks =
            if self.addresses.any_real() { lock_robots(&self.task.station, &self.addresses)? } else { Vec::new() };
        fs::create_dir_all(&self.out)?;
        let ended = self.run_to_the_end(operator, controls, alarms).inspect_err(|_| {
            // Nothing was driven: an empty log is useless. Other files of the folder stay.
            let _ = fs::remove_file(self.out.join("log.mcap"));
            let _ = fs::remove_dir(&self.out);
        })?;
        export(&self.out.join("log.mcap"), &self.out.join("log.parquet"))?;
        Ok(ended)
    }

    fn run_to_the_end(&self, operator: &dyn Operator, controls: &Controls, alarms: &Alarms) -> Result<EndedSession> {
        let (samples_in, samples) = feed();
        // The log's thread first: it must not inherit the cycle's priority.
        let log = LogWriter::create(&self.out.join("log.mcap"), &log_setup(self)?)?;
        let rules = &self.task.station.rules;
        let budgets = Budgets { force_n: rules.force, energy_j: rules.injected_energy };
        std::thread::scope(|scope| {
            let cycle = scope.spawn(move || {
                let ended = self.cycle_thread(log, samples_in, operator, controls, alarms);
                if let Ok(ended) = &ended {
                    operator.answered(&ended.answer(self));
                }
                controls.end();
                ended
            });
            operator.watch(samples, budgets, controls);
            let failed = |_| SessionError::refused("the cycle's thread has failed", "report this with the log");
            cycle.join().map_err(failed)?
        })
    }

    fn cycle_thread(
        &self,
        log: LogWriter,
        samples: Feed,
        operator: &dyn Operator,
        controls: &Controls,
        alarms: &Alarms,
    ) -> Result<EndedSession> {
        let is_virtual = self.options.virtual_time;
        let clock: Rc<dyn Clock> = if is_virtual { Rc::new(Virtual::default()) } else { Rc::new(Monotonic) };
        let task = &self.task;
        // The first repeat has the farm's own noise.
        let key = philox::key(self.campaign.seed.wrapping_add((self.options.repeat - 1) << 32));
        let world = || {
            World::new(&self.emulated.0, &task.station, key, task.run, &self.emulated.1, Wrench::zero()).map_err(
                |(robot, why)| {
                    SessionError::refused(
                        format!("robot {robot} cannot hold its part at the start: {why:?}"),
                        "move its base",
                    )
                },
            )
        };
        if !is_virtual {
            self.options.rights.apply(|warning| operator.notice(&SessionNotice::Rights(warning)))?;
        }
        let report = |notice| operator.notice(&SessionNotice::Link(notice));
        let OpenedLinks { moved, exercised } =
            self.addresses.open(task.armed, &task.station, world, Rc::clone(&clock), &report)?;
        let cycle = moved.robots[0].capabilities().cycle;
        let evidence = EvidenceBuffer::new(EVIDENCE_SPAN, cycle);
        let mut session = Session::new(task.clone(), moved, exercised, clock)?;
        session.begun_at(since_epoch()?);
        if self.options.go_after_check {
            session.go();
        }
        let mut keeping = Keeping { log: Some(log), evidence, feed: Some(samples) };
        run(&mut session, &mut keeping, controls, alarms);
        let Keeping { log, evidence, .. } = keeping;
        let totals = log.expect("the log exists until here").finish()?;
        let core = session.core();
        let ended = EndedSession {
            last: *session.record(),
            refusal: core.refusal(),
            checklist: *core.checklist(),
            retracted: core.retracted(),
            faults: session.faults(),
            metrics: core.metrics(),
            stop: core.rule_met(),
            stopped: core.stopped(),
            worst_tracking: core.worst_tracking(),
            worst_torques: core.worst_torques(),
            log_records: totals.written.records,
            log_records_lost: totals.dropped,
        };
        // Written at once: the files exist even if the operator keeps the view open or ends the process there.
        write_evidence(self, &ended, evidence)?;
        write_answer(&self.out, &ended.answer(self))?;
        Ok(ended)
    }
}
