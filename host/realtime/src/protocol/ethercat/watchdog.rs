//! Reaction of a drive to missing frames: the watchdog of its outputs, and its stop options.

use super::mapping::object;
use crate::time::Nanos;
use ethercrab::error::{Error, MailboxError};
use ethercrab::{SubDevice, SubDeviceRef};

/// Default of the longest time without a frame.
pub const WATCHDOG: Nanos = Nanos::from_millis(100);

/// Registers of an EtherCAT controller (ETG.1000.4, table 21 ff.).
pub(super) mod register {
    /// Divider of the watchdogs' clock, u16: a step takes 40 ns times (this value + 2).
    pub(crate) const DIVIDER: u16 = 0x0400;
    /// Steps without a frame after which the outputs' watchdog expires, u16; 0 switches it off.
    pub(crate) const STEPS: u16 = 0x0420;
    /// Bit 0: the outputs' watchdog has not expired, u16.
    pub(crate) const STATUS: u16 = 0x0440;
    /// The first of the sync managers, 8 bytes each.
    pub(crate) const SYNC_MANAGERS: u16 = 0x0800;
}

/// Period of the clock that is divided.
const CLOCK: Nanos = Nanos(40);
/// Divider after a reset: steps of 100 us.
const USUAL_DIVIDER: u16 = 2498;
/// Number of sync managers that are read; process data use the third and the fourth.
const MANAGERS: usize = 4;

/// Registers of the watchdog of a drive's outputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Watchdog {
    divider: u16,
    steps: u16,
}

impl Watchdog {
    /// Returns the watchdog that expires no later than this time: with the present divider, if it suffices.
    fn of(span: Nanos, divider: u16) -> Self {
        let steps =
            |divider| Some(span.0 / step(divider).0).filter(|steps| *steps > 0).and_then(|n| u16::try_from(n).ok());
        match steps(divider) {
            Some(steps) => Self { divider, steps },
            None => Self { divider: USUAL_DIVIDER, steps: steps(USUAL_DIVIDER).unwrap_or(u16::MAX) },
        }
    }

    /// Returns the time-out.
    fn span(self) -> Nanos {
        Nanos(step(self.divider).0 * i64::from(self.steps))
    }

    /// Returns the problem, if it does not expire within `longest` or does not outlive two cycles.
    pub(super) fn flaw(self, longest: Nanos, cycle: Nanos) -> Option<String> {
        let ms = |time: Nanos| time.0 as f64 * 1e-6;
        let registers = format!("registers 0400 and 0420 are {} and {}", self.divider, self.steps);
        if self.steps == 0 {
            return Some(format!(
                "the watchdog of its outputs is off and cannot be set ({registers}): the drive would continue to its last target when frames stop"
            ));
        }
        let span = self.span();
        if span.0 > longest.0 {
            return Some(format!(
                "the watchdog of its outputs expires after {:.1} ms and cannot be set ({registers}); {:.1} ms are allowed",
                ms(span),
                ms(longest)
            ));
        }
        (span.0 < 2 * cycle.0).then(|| {
            format!("the watchdog of its outputs expires after {:.1} ms ({registers}), less than two cycles", ms(span))
        })
    }
}

fn step(divider: u16) -> Nanos {
    CLOCK * (i64::from(divider) + 2)
}

/// Sets the watchdog and reads it back.
pub(super) async fn set<S>(device: &SubDeviceRef<'_, S>, span: Nanos) -> Result<Watchdog, Error> {
    let before = read(device).await?;
    let wanted = Watchdog::of(span, before.divider);
    if wanted.divider != before.divider {
        device.register_write(register::DIVIDER, wanted.divider).await?;
    }
    if wanted != before {
        device.register_write(register::STEPS, wanted.steps).await?;
    }
    read(device).await
}

/// Reads the watchdog.
pub(super) async fn read<S>(device: &SubDeviceRef<'_, S>) -> Result<Watchdog, Error> {
    let divider = device.register_read(register::DIVIDER).await?;
    Ok(Watchdog { divider, steps: device.register_read(register::STEPS).await? })
}

/// Reads the control byte of the outputs' sync manager: whether it triggers the watchdog.
pub(super) async fn triggers<S>(device: &SubDeviceRef<'_, S>) -> Result<(bool, u8), Error> {
    let managers: [u8; 8 * MANAGERS] = device.register_read(register::SYNC_MANAGERS).await?;
    let outputs = managers.chunks_exact(8).find(|manager| is_outputs(manager));
    let control = outputs.map_or(0, |manager| manager[4]);
    Ok((control & 0x40 != 0, control))
}

/// Enabled, buffered (three buffers), written by the master.
fn is_outputs(manager: &[u8]) -> bool {
    manager[6] & 1 != 0 && manager[4] & 0x0F == 0x04
}

/// Whether the watchdog has not expired.
pub(super) async fn runs<S>(device: &SubDeviceRef<'_, S>) -> Result<bool, Error> {
    let status: u16 = device.register_read(register::STATUS).await?;
    Ok(status & 1 != 0)
}

/// Stop options of a drive, by its option codes (CiA 402): 0 coasts, 1 ramps down, 2 uses the quick-stop ramp, 3 and 4
/// use current and voltage limits, 5 to 8 likewise and stay in *quick stop active*; negative ones are vendor-specific.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StopOptions {
    /// Quick stop, object 605A.
    pub quick_stop: Option<i16>,
    /// Shutdown, object 605B.
    pub shutdown: Option<i16>,
    /// Disable operation, object 605C.
    pub disable: Option<i16>,
    /// Fault reaction, object 605E.
    pub fault: Option<i16>,
}

impl StopOptions {
    /// Returns the reason why a controlled stop is impossible.
    pub(super) fn flaw(self) -> Option<&'static str> {
        (self.quick_stop == Some(0)).then_some(
            "its quick stop switches it off without a ramp (605A is 0): the axis would coast; set 605A to 2, or 1 to 8",
        )
    }
}

/// Reads the existing option codes of a drive.
pub(super) async fn stop_options(device: &SubDeviceRef<'_, &SubDevice>) -> Result<StopOptions, Error> {
    Ok(StopOptions {
        quick_stop: option(device, object::QUICK_STOP_OPTION).await?,
        shutdown: option(device, object::SHUTDOWN_OPTION).await?,
        disable: option(device, object::DISABLE_OPTION).await?,
        fault: option(device, object::FAULT_OPTION).await?,
    })
}

async fn option(device: &SubDeviceRef<'_, &SubDevice>, index: u16) -> Result<Option<i16>, Error> {
    match device.sdo_read::<i16>(index, 0).await {
        Err(Error::Mailbox(MailboxError::Aborted { .. })) => Ok(None),
        read => read.map(Some),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE: Nanos = Nanos::from_millis(1);

    #[test]
    fn present_divider_is_kept_if_it_suffices() {
        assert_eq!(Watchdog::of(WATCHDOG, 2498), Watchdog { divider: 2498, steps: 1000 });
        assert_eq!(Watchdog::of(WATCHDOG, 998), Watchdog { divider: 998, steps: 2500 });
        // One that cannot count so long, and one with longer steps.
        assert_eq!(Watchdog::of(WATCHDOG, 0), Watchdog { divider: 2498, steps: 1000 });
        assert_eq!(Watchdog::of(Nanos::from_millis(2), u16::MAX), Watchdog { divider: 2498, steps: 20 });
        assert_eq!(Watchdog::of(WATCHDOG, 2498).span(), WATCHDOG);
    }

    #[test]
    fn watchdog_off_too_long_or_too_short_is_refused() {
        let flaw = |divider, steps| Watchdog { divider, steps }.flaw(WATCHDOG, CYCLE);
        assert_eq!(flaw(2498, 1000), None);
        assert_eq!(flaw(2498, 20), None);
        assert!(flaw(2498, 0).unwrap().contains("is off"));
        assert!(flaw(2498, 1001).unwrap().contains("100.1 ms"));
        assert!(flaw(2498, 19).unwrap().contains("less than two cycles"));
    }

    #[test]
    fn drive_that_coasts_at_quick_stop_is_refused() {
        let options = StopOptions { quick_stop: Some(0), shutdown: Some(0), disable: Some(1), fault: None };
        assert!(options.flaw().unwrap().contains("605A is 0"));
        for quick_stop in [None, Some(1), Some(2), Some(6), Some(-3)] {
            assert_eq!(StopOptions { quick_stop, ..options }.flaw(), None);
        }
    }
}
