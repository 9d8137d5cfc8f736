//! The emulated drive of a device: CiA 402 states, a first-order lag behind its target, a fault when a target jumps.

use super::super::cia402::mode;
use super::super::mapping::{PdoEntry, object};
use super::dictionary::Dictionary;

/// Positions and targets at an enabling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Enabling {
    /// Actual position \[counts\].
    pub position: i32,
    /// Target \[counts\].
    pub target: i32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    SwitchOnDisabled,
    ReadyToSwitchOn,
    SwitchedOn,
    OperationEnabled,
    /// Frames left of the quick-stop ramp.
    QuickStopActive(u32),
    Fault,
}

/// Frames of a quick stop.
const RAMP: u32 = 10;
/// Error code of a following error.
const FOLLOWING_ERROR: u16 = 0x8611;
/// Frames per second assumed for velocities.
const RATE: f64 = 1000.0;

/// A drive in cyclic synchronous position, stepped by the passing frames.
#[derive(Clone, Debug)]
pub struct DriveModel {
    /// Whether it supports distributed clocks.
    pub clocks: bool,
    /// Divider and steps of the outputs' watchdog after power-up.
    pub watchdog: (u16, u16),
    /// Whether these are read-only.
    pub watchdog_fixed: bool,
    /// Whether frames trigger that watchdog (bit 6 of the sync manager's control byte).
    pub watched: bool,
    /// Actual position \[counts\].
    pub position: f64,
    /// Share of the distance to the target that it moves per frame.
    pub share: f64,
    /// Distance between successive targets that causes a fault \[counts\].
    pub window: i32,
    /// Sag per frame without torque \[counts\].
    pub sag: f64,
    /// Whether its next mailbox message is an unrequested emergency.
    pub emergency: bool,
    /// All enablings so far.
    pub enablings: Vec<Enabling>,
    /// Largest step between two targets while enabled \[counts\].
    pub largest_step: u32,
    pub(super) objects: Dictionary,
    state: State,
    control: u16,
    edge: u16,
    mode: i8,
    target: i32,
    led: i32,
    velocity: f64,
    error: u16,
}

impl DriveModel {
    /// Creates a drive at a position \[counts\], off, with the usual mapping.
    pub fn new(position: i32) -> Self {
        Self {
            clocks: false,
            // 100 us and 100 ms.
            watchdog: (2498, 1000),
            watchdog_fixed: false,
            watched: true,
            position: f64::from(position),
            share: 0.3,
            window: 20_000,
            sag: 0.0,
            emergency: false,
            enablings: Vec::new(),
            largest_step: 0,
            objects: Dictionary::new(),
            state: State::SwitchOnDisabled,
            control: 0,
            edge: 0,
            mode: 0,
            target: 0,
            led: position,
            velocity: 0.0,
            error: 0,
        }
    }

    /// Replaces the objects in its process data.
    pub fn with_mapping(mut self, outputs: &[u32], inputs: &[u32]) -> Self {
        let entries = |words: &[u32]| words.iter().map(|word| PdoEntry::from_word(*word)).collect();
        (self.objects.outputs, self.objects.inputs) = (entries(outputs), entries(inputs));
        self
    }

    /// Removes an object.
    pub fn without(mut self, index: u16, subindex: u8) -> Self {
        self.objects.remove(index, subindex);
        self
    }

    /// Replaces the value of a parameter.
    pub fn with_object(mut self, index: u16, subindex: u8, value: u32) -> Self {
        self.objects.set(index, subindex, value);
        self
    }

    /// Returns an object as last written by SDO, if it exists.
    pub fn object(&self, index: u16, subindex: u8) -> Option<u32> {
        self.objects.read(index, subindex).map(|(value, _)| value)
    }

    /// Whether operation is enabled.
    pub fn enabled(&self) -> bool {
        self.state == State::OperationEnabled
    }

    /// Whether it is in fault.
    pub fn faulted(&self) -> bool {
        self.state == State::Fault
    }

    /// Enters the fault state with an error code.
    pub fn fault(&mut self, error: u16) {
        (self.state, self.error) = (State::Fault, error);
    }

    /// Switches off because its outputs are not valid any more.
    pub(super) fn stop(&mut self) {
        if self.state != State::Fault {
            self.state = State::SwitchOnDisabled;
        }
        self.control = 0;
    }

    /// Takes the outputs of a frame.
    pub(super) fn take_outputs(&mut self, bytes: &[u8]) {
        let mut at = 0;
        for i in 0..self.objects.outputs.len() {
            let entry = self.objects.outputs[i];
            let length = usize::from(entry.bits / 8);
            let mut word = [0; 4];
            if let Some(field) = bytes.get(at..at + length).filter(|field| field.len() <= 4) {
                word[..length].copy_from_slice(field);
                self.take_object(entry.index, u32::from_le_bytes(word));
            }
            at += length;
        }
        if !self.objects.outputs.iter().any(|entry| entry.index == object::MODE) {
            self.mode = self.object(object::MODE, 0).unwrap_or(0) as i8;
        }
    }

    fn take_object(&mut self, index: u16, value: u32) {
        match index {
            object::CONTROLWORD => (self.edge, self.control) = (self.edge | value as u16 & !self.control, value as u16),
            object::TARGET_POSITION => self.target = value as i32,
            object::MODE => self.mode = value as i8,
            _ => {}
        }
    }

    /// Writes the inputs of a frame.
    pub(super) fn put_inputs(&self, bytes: &mut [u8]) {
        let mut at = 0;
        for entry in &self.objects.inputs {
            let length = usize::from(entry.bits / 8);
            if let Some(field) = bytes.get_mut(at..at + length).filter(|field| field.len() <= 4) {
                field.copy_from_slice(&self.input(entry.index).to_le_bytes()[..length]);
            }
            at += length;
        }
    }

    fn input(&self, index: u16) -> u32 {
        match index {
            object::STATUSWORD => u32::from(self.statusword()),
            object::POSITION => self.counts() as u32,
            object::VELOCITY => (self.velocity.round() as i32) as u32,
            object::TORQUE => {
                let torque = if self.enabled() { (f64::from(self.target) - self.position) * 0.1 } else { 0.0 };
                u32::from(torque.clamp(-1000.0, 1000.0) as i16 as u16)
            }
            object::MODE_DISPLAY => u32::from(self.mode as u8),
            object::ERROR_CODE => u32::from(self.error),
            _ => 0,
        }
    }

    fn counts(&self) -> i32 {
        self.position.round() as i32
    }

    fn statusword(&self) -> u16 {
        // Remote and voltage enabled, whatever the state.
        0x0210
            | match self.state {
                State::SwitchOnDisabled => 0x40,
                State::ReadyToSwitchOn => 0x21,
                State::SwitchedOn => 0x23,
                State::OperationEnabled => 0x1027,
                State::QuickStopActive(_) => 0x07,
                State::Fault => 0x08,
            }
    }

    /// Steps by one frame: at most one change of state, then the motion.
    pub(super) fn tick(&mut self) {
        let before = self.state;
        self.state = self.next_state();
        if self.state == State::OperationEnabled && before != self.state {
            self.led = self.counts();
            self.enablings.push(Enabling { position: self.counts(), target: self.target });
        }
        if before == State::Fault && self.state != before {
            self.error = 0;
        }
        self.edge = 0;
        self.travel();
    }

    fn next_state(&self) -> State {
        let word = self.control;
        let voltage = word & 0x02 != 0;
        let running = word & 0x04 != 0;
        match self.state {
            State::Fault if self.edge & 0x80 != 0 => State::SwitchOnDisabled,
            State::Fault => State::Fault,
            State::SwitchOnDisabled if word & 0x07 == 0x06 => State::ReadyToSwitchOn,
            State::OperationEnabled if voltage && !running => State::QuickStopActive(RAMP),
            State::QuickStopActive(left @ 1..) if voltage => State::QuickStopActive(left - 1),
            _ if !voltage || !running => State::SwitchOnDisabled,
            State::ReadyToSwitchOn if word & 0x07 == 0x07 => State::SwitchedOn,
            State::SwitchedOn if word & 0x0F == 0x0F && self.mode == mode::CSP => State::OperationEnabled,
            State::SwitchedOn | State::OperationEnabled if word & 0x07 == 0x06 => State::ReadyToSwitchOn,
            State::OperationEnabled if word & 0x0F == 0x07 => State::SwitchedOn,
            state => state,
        }
    }

    fn travel(&mut self) {
        let before = self.position;
        match self.state {
            State::OperationEnabled => {
                let step = self.target.abs_diff(self.led);
                self.largest_step = self.largest_step.max(step);
                if step > self.window.unsigned_abs() {
                    return self.fault(FOLLOWING_ERROR);
                }
                self.led = self.target;
                self.position += (f64::from(self.target) - self.position) * self.share;
            }
            State::QuickStopActive(_) => self.position += self.velocity / RATE * 0.5,
            _ => self.position += self.sag,
        }
        self.velocity = (self.position - before) * RATE;
    }
}
