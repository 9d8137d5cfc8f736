//! A link to a robot of CiA 402 drives: positions in SI units, targets, one exchange per cycle.

use super::bus::{Bus, Exchange};
use super::config::{EtherCatConfig, OpenError};
use super::drives::{Aim, BringUpPhase, Drives, Trip};
use super::mapping::Report;
use super::scale::AxisScale;
use super::watchdog::StopOptions;
use crate::clock::{Clock, Monotonic};
use crate::signals::{AXES, Capabilities, LinkCounters, LinkFault, Order, RobotLink, RobotState};
use crate::time::Nanos;

/// Share of its distance to the middle between two SYNC0 that a cycle corrects at once, and the greatest correction.
const STEERING_SHARE: i64 = 32;
const STEERING_MAX: Nanos = Nanos::from_micros(10);
/// Time that the drives have to stop when the robot is dropped.
const CLOSING: Nanos = Nanos::from_millis(4000);

/// An axis that has a drive.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Its number among the axes.
    number: usize,
    scale: AxisScale,
}

/// Six axes and a rail on EtherCAT, in cyclic synchronous position.
///
/// This machine is the clock master: [`RobotLink::receive`] waits for an absolute time, exchanges the process data with
/// the last targets, and returns the report. An answer to a report is sent with the next cycle's frame. A frame that
/// has not returned in time, or whose working counter shows a missing drive, makes a lost cycle: counted in `lost`, not
/// reported, the targets stay. Cycles that were not requested in time count in `unsent`; cycles that repeat their
/// targets without an answer, in `late_answers` of the reports. [`Order::Hold`] never enables a drive. The first
/// [`Order::Move`] starts the enabling; during it, and in the first cycle of following, the targets are the present
/// positions.
///
/// On drop, enabled drives make a quick stop first.
pub struct EtherCatRobot {
    bus: Bus,
    config: EtherCatConfig,
    axes: Vec<Axis>,
    drives: Drives,
    reports: [Report; AXES],
    aim: Aim,
    /// Whether the reports are of the last cycle, not of one before a lost one.
    fresh: bool,
    answered: bool,
    late_answers: u32,
    due: Nanos,
    round_trip: Nanos,
    operational: bool,
    counters: LinkCounters,
}

impl EtherCatRobot {
    /// Opens the segment of an interface: finds devices, reads and checks mapping and stop options, sets watchdogs and
    /// reads them back, reaches OP with drives off.
    ///
    /// # Errors
    /// If the segment or one of its drives differs from the configuration; the error states drive and reason.
    pub fn open(interface: &str, config: &EtherCatConfig) -> Result<Self, OpenError> {
        let bus = Bus::open(interface, config)?;
        let axes = config.axes.iter().enumerate();
        let axes: Vec<_> =
            axes.filter_map(|(number, axis)| axis.map(|axis| Axis { number, scale: axis.scale })).collect();
        let steps: Vec<_> = axes.iter().map(|axis| axis.scale.step(config.cycle.seconds())).collect();
        let mut reports = [Report::default(); AXES];
        bus.read(&mut reports);
        Ok(Self {
            bus,
            config: *config,
            axes,
            drives: Drives::new(&steps, config.reset_faults),
            reports,
            aim: Aim::Rest,
            fresh: true,
            answered: true,
            late_answers: 0,
            due: Monotonic.now() + config.cycle,
            round_trip: Nanos(0),
            operational: true,
            counters: LinkCounters::default(),
        })
    }

    /// Returns the phase of the drives.
    pub fn phase(&self) -> BringUpPhase {
        self.drives.phase()
    }

    /// Returns the working counter of a complete exchange: 3 for each drive.
    pub fn working_counter(&self) -> u16 {
        self.bus.expected()
    }

    /// Whether the drives latch their targets by SYNC0 of the distributed clocks.
    pub fn synced(&self) -> bool {
        self.bus.synced()
    }

    /// Returns the stop options of each drive, with the number of its axis from 0.
    pub fn stop_options(&self) -> impl Iterator<Item = (usize, StopOptions)> {
        self.axes.iter().map(|axis| axis.number).zip(self.bus.stops())
    }

    /// Returns the round-trip time of the last frame.
    pub fn round_trip(&self) -> Nanos {
        self.round_trip
    }

    /// Returns the time of the next frame.
    pub fn due(&self) -> Nanos {
        self.due
    }

    /// Returns the error codes (object 603F) of the axes, where drives map them; 0 without a fault.
    pub fn error_codes(&self) -> [u16; AXES] {
        let mut codes = [0; AXES];
        for (axis, report) in self.axes.iter().zip(&self.reports) {
            codes[axis.number] = report.error.unwrap_or(0);
        }
        codes
    }

    /// Returns why the drives are off, with the number of the axis from 0, if they have tripped.
    pub fn trip(&self) -> Option<(usize, &'static str)> {
        let BringUpPhase::Tripped(trip) = self.drives.phase() else { return None };
        let (Trip::Drive(drive) | Trip::Mode(drive) | Trip::NotEnabled(drive) | Trip::Jump(drive)) = trip;
        Some((self.axes.get(drive).map_or(drive, |axis| axis.number), trip.text()))
    }

    /// Returns the counts of all drives for a command in SI units.
    fn counts(&self, axes: &[f64; AXES]) -> Result<[i32; AXES], LinkFault> {
        let mut counts = [0; AXES];
        for (axis, counts) in self.axes.iter().zip(&mut counts) {
            let target = axis.scale.counts(axes[axis.number]);
            *counts =
                target.ok_or(LinkFault::Unsendable("a target is not a number, or exceeds the counts of its drive"))?;
        }
        Ok(counts)
    }

    /// Sets the commands of the cycle as outputs; after a lost cycle the last ones stay.
    fn command(&mut self) {
        if !self.answered {
            self.late_answers = self.late_answers.wrapping_add(1);
            self.answered = true;
        }
        if self.fresh {
            let commands = self.drives.step(&self.aim, &self.reports);
            self.bus.write(&commands);
        }
    }

    /// Exchanges process data now; `None` for a lost cycle.
    fn exchange(&mut self) -> Result<Option<Exchange>, LinkFault> {
        let begun = Monotonic.now();
        let exchange = self.bus.exchange(begun + self.config.answer)?;
        self.round_trip = Monotonic.now() - begun;
        self.pace(begun, exchange.and_then(|exchange| exchange.clock));
        let whole = exchange.filter(|exchange| exchange.whole);
        self.fresh = whole.is_some();
        match whole {
            Some(exchange) => {
                self.counters.received += 1;
                self.operational = exchange.operational;
                self.bus.read(&mut self.reports);
                self.answered = false;
            }
            None => self.counters.lost += 1,
        }
        let passed = self.bus.passed();
        (self.counters.stale, self.counters.foreign) = (passed.stale, passed.foreign);
        Ok(whole)
    }

    /// Advances to the next cycle, steered so that frames pass in the middle between two SYNC0. Cycles that were not
    /// requested in time have no frame.
    fn pace(&mut self, begun: Nanos, clock: Option<Nanos>) {
        let cycle = self.config.cycle.0;
        let missed = (begun - self.due).0.max(0) / cycle;
        self.counters.unsent += missed as u64;
        let from_middle = clock.map_or(0, |clock| clock.0.rem_euclid(cycle) - cycle / 2);
        let steering = (from_middle / STEERING_SHARE).clamp(-STEERING_MAX.0, STEERING_MAX.0);
        self.due += Nanos(cycle * (missed + 1) - steering);
    }

    fn state(&self, exchange: &Exchange, received: Nanos) -> RobotState {
        let mut position = [0.0; AXES];
        let mut asked = [0.0; AXES];
        let mut torque = Some([0.0; AXES]);
        let targets = self.drives.targets();
        for ((axis, report), target) in self.axes.iter().zip(&self.reports).zip(targets) {
            position[axis.number] = axis.scale.position(report.position);
            asked[axis.number] = axis.scale.position(target);
            let measured = report.torque.and_then(|per_mille| axis.scale.torque(per_mille));
            torque = torque.zip(measured).map(|(mut torque, measured)| {
                torque[axis.number] = measured;
                torque
            });
        }
        RobotState {
            stamp: exchange.clock.unwrap_or(received),
            received,
            position,
            reported_set_point: Some(asked),
            torque,
            pose: None,
            late_answers: self.late_answers,
            ready: self.operational && self.drives.ready(&self.reports),
        }
    }
}

impl RobotLink for EtherCatRobot {
    fn capabilities(&self) -> Capabilities {
        Capabilities {
            cycle: self.config.cycle,
            // This machine is the clock master: no report arrives on its own.
            master: false,
            rail: self.config.rail(),
            torque: self
                .axes
                .iter()
                .zip(&self.reports)
                .all(|(axis, report)| report.torque.and_then(|per_mille| axis.scale.torque(per_mille)).is_some()),
            pose: false,
        }
    }

    fn receive(&mut self, deadline: Nanos) -> Result<Option<RobotState>, LinkFault> {
        if self.due > deadline.max(Monotonic.now()) {
            Monotonic.sleep_until(deadline);
            return Ok(None);
        }
        Monotonic.sleep_until(self.due);
        self.command();
        let exchange = self.exchange()?;
        Ok(exchange.map(|exchange| self.state(&exchange, Monotonic.now())))
    }

    fn send(&mut self, order: &Order) -> Result<(), LinkFault> {
        let aim = match order {
            Order::Hold => Aim::Rest,
            Order::Move(axes) => Aim::Follow(self.counts(axes)?),
            Order::End(axes) => Aim::Finish(self.counts(axes)?),
        };
        if let Aim::Follow(targets) | Aim::Finish(targets) = &aim
            && self.drives.jump(targets).is_some()
        {
            return Err(LinkFault::Unsendable("a target exceeds the greatest step of its axis per cycle"));
        }
        (self.aim, self.answered) = (aim, true);
        Ok(())
    }

    fn counters(&self) -> LinkCounters {
        self.counters
    }
}

impl Drop for EtherCatRobot {
    /// Stops enabled drives, and takes the segment out of OP.
    fn drop(&mut self) {
        let until = Monotonic.now() + CLOSING;
        self.aim = Aim::Finish(self.drives.targets());
        loop {
            Monotonic.sleep_until(self.due);
            self.command();
            let failed = self.exchange().is_err();
            let over = !matches!(self.drives.phase(), BringUpPhase::Finishing(..)) && self.drives.off(&self.reports);
            if failed || over || Monotonic.now() >= until {
                break;
            }
        }
        self.bus.close();
    }
}
