//! The segment in OP through ethercrab: one exchange of process data per cycle.

use super::cia402::mode;
use super::config::{EtherCatConfig, OpenError};
use super::mapping::{DriveInputs, DriveOutputs, Report, ServoCommand};
use super::opening::{Opened, open};
use super::pump::{Passed, Pump};
use super::watchdog::StopOptions;
use crate::clock::{Clock, Monotonic};
use crate::signals::AXES;
use crate::time::Nanos;
use ethercrab::error::Error;
use ethercrab::subdevice_group::{HasDc, HasPdi, NoDc, Op};
use ethercrab::{DefaultLock, MainDevice, SubDeviceGroup};
use std::io;

/// Greatest number of devices in a segment: drives, and couplers between them. ethercrab requires a power of 2.
pub(super) const DEVICES: usize = 16;
/// Size of a segment's process data: the bytes of one frame.
pub(super) const IMAGE: usize = 1024;
pub(super) type Group<S, D> = SubDeviceGroup<DEVICES, IMAGE, DefaultLock, S, D>;

/// A group in OP, with or without SYNC0.
pub(super) enum Operating {
    Free(Group<Op, NoDc>),
    Synced(Group<Op, HasDc>),
}

/// Calls the same method of either group.
macro_rules! either {
    ($operating:expr, $group:ident => $what:expr) => {
        match $operating {
            Operating::Free($group) => $what,
            Operating::Synced($group) => $what,
        }
    };
}

/// A drive's mapping and its position in the segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) station: usize,
    pub(super) outputs: DriveOutputs,
    pub(super) inputs: DriveInputs,
    pub(super) stops: StopOptions,
}

/// Result of an exchange.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Exchange {
    /// Whether the working counter is the expected one: all drives have read and written.
    pub(super) whole: bool,
    /// Whether all devices are in OP.
    pub(super) operational: bool,
    /// Time of the distributed clock when the frame passed the reference, if SYNC0 is in use.
    pub(super) clock: Option<Nanos>,
}

/// A segment in OP.
pub(super) struct Bus {
    pump: Pump,
    main: &'static MainDevice<'static>,
    operating: Option<Operating>,
    places: Vec<Place>,
    expected: u16,
}

impl Bus {
    /// Brings the segment of an interface to OP; drives stay off, their targets at their positions.
    pub(super) fn open(interface: &str, config: &EtherCatConfig) -> Result<Self, OpenError> {
        let Opened { pump, main, operating, places, expected } = open(interface, config)?;
        Ok(Self { pump, main, operating: Some(operating), places, expected })
    }

    /// Returns the working counter of a complete exchange.
    pub(super) fn expected(&self) -> u16 {
        self.expected
    }

    /// Returns the stop options of each drive, in the order of the axes in use.
    pub(super) fn stops(&self) -> impl Iterator<Item = StopOptions> {
        self.places.iter().map(|place| place.stops)
    }

    /// Whether SYNC0 is in use.
    pub(super) fn synced(&self) -> bool {
        matches!(self.operating, Some(Operating::Synced(_)))
    }

    pub(super) fn passed(&self) -> Passed {
        self.pump.passed()
    }

    /// Sets the outputs of the next exchange.
    pub(super) fn write(&mut self, commands: &[ServoCommand; AXES]) {
        let Some(operating) = &self.operating else { return };
        either!(operating, group => write_group(group, self.main, &self.places, commands));
    }

    /// Returns the reports of the last exchange.
    pub(super) fn read(&self, reports: &mut [Report; AXES]) {
        let Some(operating) = &self.operating else { return };
        either!(operating, group => read_group(group, self.main, &self.places, reports));
    }

    /// Sends the outputs and takes the inputs; `None` if the frame has not returned by the deadline.
    ///
    /// # Errors
    /// If the interface fails.
    pub(super) fn exchange(&mut self, deadline: Nanos) -> io::Result<Option<Exchange>> {
        let Some(operating) = &self.operating else { return Ok(None) };
        let synced = self.synced();
        let transfer = either!(operating, group => self.pump.run(transfer(group, self.main, synced), deadline))?;
        Ok(transfer.and_then(Result::ok).map(|transfer| Exchange {
            whole: transfer.working_counter == self.expected,
            operational: transfer.operational,
            clock: transfer.clock.map(|time| Nanos(time as i64)),
        }))
    }

    /// Takes the segment from OP to SAFE-OP, if it still answers.
    pub(super) fn close(&mut self) {
        let until = Monotonic.now() + Nanos::from_millis(1000);
        // A failure here has no further consequence: the watchdogs stop the drives.
        match self.operating.take() {
            Some(Operating::Free(group)) => drop(self.pump.run(group.into_safe_op(self.main), until)),
            Some(Operating::Synced(group)) => drop(self.pump.run(group.into_safe_op(self.main), until)),
            None => {}
        }
    }
}

/// Result of a transfer of process data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Transfer {
    pub(super) working_counter: u16,
    pub(super) operational: bool,
    pub(super) clock: Option<u64>,
}

/// Transfers process data and AL states once, and distributes the reference clock if there is one.
pub(super) async fn transfer<S, D>(group: &Group<S, D>, main: &MainDevice<'_>, clocked: bool) -> Result<Transfer, Error>
where
    S: HasPdi,
{
    // `tx_rx_sync_system_time` blocks on its own lock without a reference clock (ethercrab 0.7.1).
    if clocked {
        let response = group.tx_rx_sync_system_time(main).await?;
        let (working_counter, operational) = (response.working_counter, response.all_op());
        return Ok(Transfer { working_counter, operational, clock: response.extra });
    }
    let response = group.tx_rx(main).await?;
    Ok(Transfer { working_counter: response.working_counter, operational: response.all_op(), clock: None })
}

pub(super) fn write_group<S, D>(
    group: &Group<S, D>,
    main: &MainDevice<'_>,
    places: &[Place],
    commands: &[ServoCommand; AXES],
) where
    S: HasPdi,
{
    for (place, command) in places.iter().zip(commands) {
        if let Ok(device) = group.subdevice(main, place.station) {
            // The start-up has compared the lengths.
            let _ = place.outputs.write(device.io_raw_mut().outputs(), command, mode::CSP);
        }
    }
}

pub(super) fn read_group<S, D>(
    group: &Group<S, D>,
    main: &MainDevice<'_>,
    places: &[Place],
    reports: &mut [Report; AXES],
) where
    S: HasPdi,
{
    for (place, report) in places.iter().zip(reports) {
        let device = group.subdevice(main, place.station).ok();
        if let Some(read) = device.and_then(|device| place.inputs.read(device.io_raw().inputs())) {
            *report = read;
        }
    }
}
