//! The state machine of a CiA 402 drive on the controller side: statusword in, controlword out.

/// Modes of operation, object 6060.
pub mod mode {
    /// Cyclic synchronous position.
    pub const CSP: i8 = 8;
    /// Bit of cyclic synchronous position in the supported drive modes, object 6502.
    pub const CSP_SUPPORTED: u32 = 1 << 7;
}

/// Controlwords, object 6040.
pub mod control {
    /// No voltage: the drive is off.
    pub const DISABLE_VOLTAGE: u16 = 0x00;
    /// Bit 2 low with voltage on: quick stop.
    pub const QUICK_STOP: u16 = 0x02;
    /// To *ready to switch on*.
    pub const SHUTDOWN: u16 = 0x06;
    /// To *switched on*.
    pub const SWITCH_ON: u16 = 0x07;
    /// To *operation enabled*.
    pub const ENABLE_OPERATION: u16 = 0x0F;
    /// Its rising edge acknowledges a fault.
    pub const FAULT_RESET: u16 = 0x80;
}

/// State of a drive, from its statusword (object 6041).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriveState {
    /// Initialising; also any other pattern.
    NotReady,
    /// Initialised, off.
    SwitchOnDisabled,
    /// Off, voltage may be applied.
    ReadyToSwitchOn,
    /// Voltage applied, no torque.
    SwitchedOn,
    /// Torque on, follows its target.
    OperationEnabled,
    /// Stopping or stopped by a quick stop, torque on.
    QuickStopActive,
    /// Stopping because of a fault.
    FaultReaction,
    /// Fault, off.
    Fault,
}

impl DriveState {
    /// Decodes a statusword (CiA 402-2, statusword patterns).
    pub fn of(statusword: u16) -> Self {
        match statusword & 0x4F {
            0x40 => return Self::SwitchOnDisabled,
            0x0F => return Self::FaultReaction,
            0x08 => return Self::Fault,
            _ => {}
        }
        match statusword & 0x6F {
            0x21 => Self::ReadyToSwitchOn,
            0x23 => Self::SwitchedOn,
            0x27 => Self::OperationEnabled,
            0x07 => Self::QuickStopActive,
            _ => Self::NotReady,
        }
    }

    /// Whether a drive in this state can be enabled.
    pub fn sound(self) -> bool {
        !matches!(self, Self::NotReady | Self::FaultReaction | Self::Fault)
    }
}

/// Requested state of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Off; from motion by a quick stop.
    Off,
    /// Operation enabled.
    On,
}

/// Stage of an enabling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
enum Stage {
    #[default]
    Off,
    Shutdown,
    SwitchOn,
    Enable,
    On,
}

/// Cycles of a fault reset before it counts as refused.
const RESET_CYCLES: u16 = 1000;
/// Cycles after which a drive that stays in *quick stop active* (option code 605A of 5 and more) is switched off.
const QUICK_STOP_CYCLES: u16 = 1000;

/// Controls one drive through the sequence of states.
///
/// Sends *enable operation* only after *shutdown* and *switch on* were sent and answered in this enabling: a drive
/// left on by another controller is first switched off. A drive that has switched off by itself has tripped, and stays
/// off until [`Sequence::rearm`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Sequence {
    stage: Stage,
    tripped: bool,
    /// Whether a fault may be acknowledged once, before the first enabling.
    may_reset: bool,
    reset_for: u16,
    quick_for: u16,
}

impl Sequence {
    /// Creates the sequence of a drive that is off. With `may_reset`, a fault before its first enabling is acknowledged
    /// once.
    pub fn new(may_reset: bool) -> Self {
        Self { may_reset, ..Self::default() }
    }

    /// Whether the drive was on and has switched off by itself.
    pub fn tripped(&self) -> bool {
        self.tripped
    }

    /// Whether this sequence has enabled operation.
    pub fn on(&self) -> bool {
        self.stage == Stage::On
    }

    /// Whether *enable operation* was sent: from its next cycle on the drive may follow its target.
    pub fn enabling(&self) -> bool {
        self.stage >= Stage::Enable
    }

    /// Permits enabling again after an operator has checked a tripped drive.
    pub fn rearm(&mut self) {
        *self = Self::new(true);
    }

    /// Returns the controlword for a statusword.
    pub fn step(&mut self, wish: Wish, statusword: u16) -> u16 {
        let state = DriveState::of(statusword);
        if self.on() && wish == Wish::On && state != DriveState::OperationEnabled {
            self.tripped = true;
        }
        match wish {
            Wish::On if !self.tripped => self.towards_on(state),
            Wish::On | Wish::Off => self.towards_off(state),
        }
    }

    fn towards_on(&mut self, state: DriveState) -> u16 {
        use control::{DISABLE_VOLTAGE, ENABLE_OPERATION, SHUTDOWN, SWITCH_ON};
        if !matches!(state, DriveState::Fault | DriveState::FaultReaction) {
            self.reset_for = 0;
        }
        let (stage, word) = match state {
            DriveState::ReadyToSwitchOn if self.stage >= Stage::Shutdown => (Stage::SwitchOn, SWITCH_ON),
            DriveState::SwitchedOn if self.stage >= Stage::SwitchOn => (Stage::Enable, ENABLE_OPERATION),
            DriveState::OperationEnabled if self.stage >= Stage::Enable => {
                self.may_reset = false;
                (Stage::On, ENABLE_OPERATION)
            }
            DriveState::SwitchOnDisabled
            | DriveState::ReadyToSwitchOn
            | DriveState::SwitchedOn
            | DriveState::OperationEnabled => (Stage::Shutdown, SHUTDOWN),
            DriveState::Fault => (Stage::Off, self.reset()),
            DriveState::NotReady | DriveState::QuickStopActive | DriveState::FaultReaction => {
                (Stage::Off, DISABLE_VOLTAGE)
            }
        };
        self.stage = stage;
        word
    }

    fn towards_off(&mut self, state: DriveState) -> u16 {
        self.stage = Stage::Off;
        self.quick_for = if state == DriveState::QuickStopActive { self.quick_for.saturating_add(1) } else { 0 };
        match state {
            DriveState::OperationEnabled => control::QUICK_STOP,
            DriveState::QuickStopActive if self.quick_for < QUICK_STOP_CYCLES => control::QUICK_STOP,
            DriveState::Fault => self.reset(),
            DriveState::NotReady
            | DriveState::SwitchOnDisabled
            | DriveState::ReadyToSwitchOn
            | DriveState::SwitchedOn
            | DriveState::QuickStopActive
            | DriveState::FaultReaction => control::DISABLE_VOLTAGE,
        }
    }

    /// A low cycle, then the edge, held until the drive answers or the time-out.
    fn reset(&mut self) -> u16 {
        if !self.may_reset {
            return control::DISABLE_VOLTAGE;
        }
        self.reset_for += 1;
        self.may_reset = self.reset_for < RESET_CYCLES;
        if self.reset_for == 1 { control::DISABLE_VOLTAGE } else { control::FAULT_RESET }
    }
}

#[cfg(test)]
#[path = "cia402_tests.rs"]
mod tests;
