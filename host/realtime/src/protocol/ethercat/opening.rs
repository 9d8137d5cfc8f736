//! Start-up of a segment: finds devices, reads and checks mappings, sets parameters, goes from INIT to OP.

use super::bus::{DEVICES, Group, IMAGE, Operating, Place, read_group, transfer, write_group};
use super::cia402::{control, mode};
use super::config::{AxisConfig, EtherCatConfig, OpenError};
use super::mapping::{DriveInputs, DriveOutputs, PdoEntry, Report, ServoCommand, object};
use super::pump::Pump;
use super::raw::RawSocket;
use super::watchdog::{self, StopOptions, Watchdog};
use crate::clock::{Clock, Monotonic};
use crate::signals::AXES;
use crate::time::Nanos;
use ethercrab::error::{Error, MailboxError};
use ethercrab::subdevice_group::{DcConfiguration, HasPdi, NoDc, Op, PreOp, PreOpPdi};
use ethercrab::{
    DcSync, EtherCrabWireWrite, MainDevice, MainDeviceConfig, PduStorage, RetryBehaviour, SubDevice, SubDeviceRef,
    Timeouts,
};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

/// Number of frames in transit, and data size of each.
const FRAMES: usize = 8;
const FRAME_DATA: usize = PduStorage::element_size(1100);
/// Time-outs of the start-up's steps \[s\].
const DISCOVERY_SECONDS: i64 = 120;
const STATE_SECONDS: i64 = 25;
/// Delay of SYNC0 after its set-up, so that all drives are configured.
const SYNC_START: Duration = Duration::from_millis(100);
/// Frames that align the distributed clocks before the cycle, whose frames continue the alignment.
const ALIGNING_FRAMES: u32 = 4000;

/// A segment in OP with the drives off.
pub(super) struct Opened {
    pub(super) pump: Pump,
    pub(super) main: &'static MainDevice<'static>,
    pub(super) operating: Operating,
    pub(super) places: Vec<Place>,
    pub(super) expected: u16,
}

/// Brings the segment of an interface to OP; drives stay off, their targets at their positions.
pub(super) fn open(interface: &str, config: &EtherCatConfig) -> Result<Opened, OpenError> {
    config.check()?;
    let socket = RawSocket::open(interface).map_err(|error| OpenError::Interface(interface.to_owned(), error))?;
    // ethercrab's futures borrow its store and its main device; both live for the rest of the process: 20 kB for each
    // opened robot.
    let storage: &'static PduStorage<FRAMES, FRAME_DATA> = Box::leak(Box::new(PduStorage::new()));
    let Ok((tx, rx, pdus)) = storage.try_split() else {
        return Err(OpenError::Bus("the store of frames", "it is in use".to_owned()));
    };
    let settings = MainDeviceConfig {
        dc_static_sync_iterations: if config.clocks { ALIGNING_FRAMES } else { 0 },
        retry_behaviour: RetryBehaviour::Count(2),
    };
    let main: &'static _ = Box::leak(Box::new(MainDevice::new(pdus, timeouts(), settings)));
    let mut opening = Opening { pump: Pump::new(socket, tx, rx), main, config, clocked: false };
    let group = opening.discover(interface)?;
    let (group, places) = opening.set_up(group)?;
    let (operating, expected) = opening.operate(group, &places)?;
    Ok(Opened { pump: opening.pump, main, operating, places, expected })
}

/// Longer than ethercrab's own, for segments of many drives and loaded machines.
fn timeouts() -> Timeouts {
    Timeouts {
        state_transition: Duration::from_secs(20),
        pdu: Duration::from_millis(100),
        eeprom: Duration::from_secs(2),
        wait_loop_delay: Duration::ZERO,
        mailbox_echo: Duration::from_secs(1),
        mailbox_response: Duration::from_secs(3),
    }
}

/// Facts that a drive reports.
struct Facts {
    name: String,
    outputs: Vec<PdoEntry>,
    inputs: Vec<PdoEntry>,
    modes: Option<u32>,
    clocks: bool,
    stops: StopOptions,
}

/// A segment on its way to OP.
struct Opening<'a> {
    pump: Pump,
    main: &'static MainDevice<'static>,
    config: &'a EtherCatConfig,
    /// Whether all drives have distributed clocks and shall use them.
    clocked: bool,
}

impl Opening<'_> {
    /// Runs one step of the start-up, with its name and its time-out.
    fn step<T>(
        &mut self,
        name: &'static str,
        seconds: i64,
        future: impl Future<Output = Result<T, Error>>,
    ) -> Result<T, OpenError> {
        let deadline = Monotonic.now() + Nanos::from_millis(1000 * seconds);
        // ethercrab 0.7 asserts that no emergency message waits in a mailbox: nothing moves yet, so refuse instead.
        match catch_unwind(AssertUnwindSafe(|| self.pump.run(future, deadline))) {
            Ok(Ok(Some(Ok(done)))) => Ok(done),
            Ok(Ok(Some(Err(error)))) => Err(OpenError::Bus(name, error.to_string())),
            Ok(Ok(None)) => Err(OpenError::Late(name, seconds)),
            Ok(Err(error)) => Err(error.into()),
            Err(_) => Err(OpenError::Bus(name, "a device sent an unrequested message".to_owned())),
        }
    }

    /// Goes from INIT to PRE-OP.
    fn discover(&mut self, interface: &str) -> Result<Group<PreOp, NoDc>, OpenError> {
        let now = || Monotonic.now().0 as u64;
        let found = self.main.init_single_group::<DEVICES, IMAGE>(now);
        match self.step("finding the devices", DISCOVERY_SECONDS, found) {
            Ok(group) if group.is_empty() => Err(OpenError::Silent(interface.to_owned())),
            // A dead interface and an empty segment have the same remedy.
            Err(OpenError::Bus(_, text)) if self.main.num_subdevices() == 0 && text.contains("imeout") => {
                Err(OpenError::Silent(interface.to_owned()))
            }
            found => found,
        }
    }

    /// Reads the mappings of the drives and sets their parameters, in PRE-OP.
    fn set_up(&mut self, mut group: Group<PreOp, NoDc>) -> Result<(Group<PreOp, NoDc>, Vec<Place>), OpenError> {
        let (main, config) = (self.main, *self.config);
        let mut places = Vec::with_capacity(AXES);
        let mut clocks = config.clocks;
        for (i, axis) in axes(&config) {
            let Ok(device) = group.subdevice(main, axis.station) else {
                return Err(OpenError::NoDevice(i + 1, axis.station, group.len()));
            };
            let facts = self.step("reading what a drive maps", STATE_SECONDS, facts(&device))?;
            places.push(place(axis.station, &facts)?);
            clocks &= facts.clocks;
        }
        for ((_, axis), place) in axes(&config).zip(&places) {
            let Ok(device) = group.subdevice(main, axis.station) else { continue };
            let name = device.name().to_owned();
            let set = watchdog::set(&device, config.watchdog);
            let found = self.step("setting the watchdog of a drive", STATE_SECONDS, set)?;
            check_watchdog(place.station, &name, found, &config)?;
            let mapped = place.outputs.mode.is_some();
            let set = parameters(&device, axis, config.cycle, clocks, mapped);
            self.step("setting the parameters of a drive", STATE_SECONDS, set)?;
        }
        if clocks {
            let stations: Vec<_> = places.iter().map(|place| place.station).collect();
            let drives = group.iter_mut(main).enumerate().filter(|(station, _)| stations.contains(station));
            drives.for_each(|(_, mut device)| device.set_dc_sync(DcSync::Sync0));
        }
        self.clocked = clocks;
        Ok((group, places))
    }

    /// Goes from PRE-OP to OP, with SYNC0 where all drives have it.
    fn operate(&mut self, group: Group<PreOp, NoDc>, places: &[Place]) -> Result<(Operating, u16), OpenError> {
        let main = self.main;
        let group = self.step("mapping the process data", STATE_SECONDS, group.into_pre_op_pdi(main))?;
        for place in places {
            let Ok(device) = group.subdevice(main, place.station) else { continue };
            let found = (device.outputs_raw().len(), device.inputs_raw().len());
            let due = (place.outputs.length, place.inputs.length);
            if found != due {
                let text =
                    format!("its process data are {found:?} bytes long instead of {due:?}, as it has mapped them");
                return Err(OpenError::Drive(place.station, device.name().to_owned(), text));
            }
        }
        let expected = group
            .iter(main)
            .map(|device| u16::from(!device.inputs_raw().is_empty()) + 2 * u16::from(!device.outputs_raw().is_empty()));
        let expected = expected.sum();
        if !self.clocked {
            return Ok((Operating::Free(self.reach_op(group, places, expected)?), expected));
        }
        let sync = DcConfiguration {
            start_delay: SYNC_START,
            sync0_period: Duration::from_nanos(self.config.cycle.0 as u64),
            sync0_shift: Duration::from_nanos(self.config.cycle.0 as u64 / 2),
        };
        let group = self.step("starting SYNC0", STATE_SECONDS, group.configure_dc_sync(main, sync))?;
        Ok((Operating::Synced(self.reach_op(group, places, expected)?), expected))
    }

    /// After the configuration of the drives, checks that their watchdogs are unchanged and triggered by frames.
    fn check_watchdogs<S: HasPdi, D>(&mut self, group: &Group<S, D>, places: &[Place]) -> Result<(), OpenError> {
        let (main, config) = (self.main, *self.config);
        for place in places {
            let Ok(device) = group.subdevice(main, place.station) else { continue };
            let name = device.name().to_owned();
            let found = self.step("reading back the watchdog of a drive", STATE_SECONDS, watchdog::read(&device))?;
            check_watchdog(place.station, &name, found, &config)?;
            let trigger = watchdog::triggers(&device);
            let (triggers, control) = self.step("reading the sync managers of a drive", STATE_SECONDS, trigger)?;
            if !triggers {
                let text = format!(
                    "the sync manager of its outputs triggers no watchdog (bit 6 of its control byte, {control:02X})"
                );
                return Err(OpenError::Drive(place.station, name, text));
            }
        }
        Ok(())
    }

    /// Goes to SAFE-OP, reads the inputs, then to OP with targets at the axis positions and drives off.
    fn reach_op<D>(
        &mut self,
        group: Group<PreOpPdi, D>,
        places: &[Place],
        expected: u16,
    ) -> Result<Group<Op, D>, OpenError> {
        let (main, cycle, clocked) = (self.main, self.config.cycle, self.clocked);
        let group = self.step("the change to SAFE-OP", STATE_SECONDS, group.into_safe_op(main))?;
        let mut reports = [Report::default(); AXES];
        for _ in 0..3 {
            self.step("reading the first inputs", STATE_SECONDS, transfer(&group, main, clocked))?;
        }
        self.check_watchdogs(&group, places)?;
        read_group(&group, main, places, &mut reports);
        write_group(&group, main, places, &reports.map(at_rest));
        let group = self.step("asking for OP", STATE_SECONDS, group.request_into_op(main))?;
        let (mut due, until) = (Monotonic.now(), Monotonic.now() + Nanos::from_millis(1000 * STATE_SECONDS));
        loop {
            let passed = self.step("the change to OP", STATE_SECONDS, transfer(&group, main, clocked))?;
            if passed.operational && passed.working_counter == expected {
                for place in places {
                    let Ok(device) = group.subdevice(main, place.station) else { continue };
                    let name = device.name().to_owned();
                    if !self.step("reading the state of a watchdog", STATE_SECONDS, watchdog::runs(&device))? {
                        let text = "the watchdog of its outputs has expired already (bit 0 of 0440)".to_owned();
                        return Err(OpenError::Drive(place.station, name, text));
                    }
                    self.step("the first cycles in OP", STATE_SECONDS, transfer(&group, main, clocked))?;
                }
                return Ok(group);
            }
            if Monotonic.now() >= until {
                let states = format!(
                    "all devices in OP: {}, working counter {} instead of {expected}",
                    passed.operational, passed.working_counter
                );
                return Err(OpenError::Bus("the change to OP", states));
            }
            read_group(&group, main, places, &mut reports);
            write_group(&group, main, places, &reports.map(at_rest));
            due = (due + cycle).max(Monotonic.now());
            Monotonic.sleep_until(due);
        }
    }
}

/// Returns an error for a watchdog that is off, or expires too late or too early.
fn check_watchdog(station: usize, name: &str, found: Watchdog, config: &EtherCatConfig) -> Result<(), OpenError> {
    let flaw = found.flaw(config.watchdog, config.cycle);
    flaw.map_or(Ok(()), |flaw| Err(OpenError::Drive(station, name.to_owned(), flaw)))
}

fn at_rest(report: Report) -> ServoCommand {
    ServoCommand { controlword: control::DISABLE_VOLTAGE, target: report.position }
}

/// Returns the axes in use with their numbers from 0.
fn axes(config: &EtherCatConfig) -> impl Iterator<Item = (usize, &AxisConfig)> {
    config.axes.iter().enumerate().filter_map(|(i, axis)| axis.as_ref().map(|axis| (i, axis)))
}

type Device<'a> = SubDeviceRef<'a, &'a SubDevice>;

/// Locates the objects, or returns why the drive cannot be used.
fn place(station: usize, facts: &Facts) -> Result<Place, OpenError> {
    let refuse = |flaw| OpenError::Mapping(station, facts.name.clone(), flaw);
    if facts.modes.is_some_and(|modes| modes & mode::CSP_SUPPORTED == 0) {
        let text = "it does not support cyclic synchronous position (bit 7 of 6502)".to_owned();
        return Err(OpenError::Drive(station, facts.name.clone(), text));
    }
    if let Some(flaw) = facts.stops.flaw() {
        return Err(OpenError::Drive(station, facts.name.clone(), flaw.to_owned()));
    }
    let outputs = DriveOutputs::find(&facts.outputs).map_err(refuse)?;
    let inputs = DriveInputs::find(&facts.inputs).map_err(refuse)?;
    Ok(Place { station, outputs, inputs, stops: facts.stops })
}

async fn facts(device: &Device<'_>) -> Result<Facts, Error> {
    let modes = match device.sdo_read::<u32>(object::SUPPORTED_MODES, 0).await {
        Err(Error::Mailbox(MailboxError::Aborted { .. })) => None,
        read => Some(read?),
    };
    Ok(Facts {
        name: device.name().to_owned(),
        outputs: entries(device, object::OUTPUT_ASSIGNMENT).await?,
        inputs: entries(device, object::INPUT_ASSIGNMENT).await?,
        modes,
        clocks: device.dc_support().enhanced(),
        stops: watchdog::stop_options(device).await?,
    })
}

/// Returns all mapped entries of the PDOs assigned to one direction, in their order.
async fn entries(device: &Device<'_>, assignment: u16) -> Result<Vec<PdoEntry>, Error> {
    let mut entries = Vec::new();
    for i in 1..=device.sdo_read::<u8>(assignment, 0).await? {
        let pdo = device.sdo_read::<u16>(assignment, i).await?;
        for j in 1..=device.sdo_read::<u8>(pdo, 0).await? {
            entries.push(PdoEntry::from_word(device.sdo_read::<u32>(pdo, j).await?));
        }
    }
    Ok(entries)
}

/// Writes an object; returns `false` if the drive lacks it or refuses the value.
async fn offer(device: &Device<'_>, index: u16, subindex: u8, value: impl EtherCrabWireWrite) -> Result<bool, Error> {
    match device.sdo_write(index, subindex, value).await {
        Err(Error::Mailbox(MailboxError::Aborted { .. })) => Ok(false),
        written => written.map(|()| true),
    }
}

/// Sets mode, interpolation period, following error window and synchronisation, as far as the drive has them.
async fn parameters(
    device: &Device<'_>,
    axis: &AxisConfig,
    cycle: Nanos,
    clocks: bool,
    mode_mapped: bool,
) -> Result<(), Error> {
    if !mode_mapped {
        // Without the mode in its outputs and without the object the drive's mode cannot be set.
        device.sdo_write(object::MODE, 0, mode::CSP).await?;
    }
    if let Some((value, exponent)) = interpolation_period(cycle) {
        offer(device, object::INTERPOLATION_PERIOD, 1, value).await?;
        offer(device, object::INTERPOLATION_PERIOD, 2, exponent).await?;
    }
    if let Some(window) = axis.scale.following_window {
        let counts = (window * axis.scale.counts_per_unit).round().clamp(1.0, f64::from(u32::MAX)) as u32;
        offer(device, object::FOLLOWING_WINDOW, 0, counts).await?;
    }
    // Synchronisation type of outputs and inputs: SYNC0, or free run with the frames.
    for manager in [0x1C32, 0x1C33] {
        offer(device, manager, 1, if clocks { 2u16 } else { 1u16 }).await?;
    }
    Ok(())
}

/// Encodes a cycle as object 60C2: value and power of ten of seconds; `None` if not expressible.
fn interpolation_period(cycle: Nanos) -> Option<(u8, i8)> {
    [(-3i8, 1_000_000i64), (-4, 100_000), (-5, 10_000), (-6, 1000)].into_iter().find_map(|(exponent, unit)| {
        let value = u8::try_from(cycle.0 / unit).ok()?;
        (cycle.0 % unit == 0 && value > 0).then_some((value, exponent))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cycles_are_encoded_in_the_largest_exact_unit() {
        let period = |micros| interpolation_period(Nanos::from_micros(micros));
        assert_eq!(period(1000), Some((1, -3)));
        assert_eq!(period(4000), Some((4, -3)));
        assert_eq!(period(250), Some((25, -5)));
        assert_eq!(period(125), Some((125, -6)));
        assert_eq!(interpolation_period(Nanos(333_333)), None);
    }
}
