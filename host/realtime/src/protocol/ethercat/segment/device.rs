//! An emulated device: the memory of its EtherCAT controller, and the effects of writing to it.

use super::drive::DriveModel;
use super::{mailbox, sii};
use crate::time::Nanos;

/// Registers of an EtherCAT controller (ETG.1000.4).
mod register {
    pub(super) const SUPPORT: usize = 0x0008;
    pub(super) const STATION: usize = 0x0010;
    pub(super) const DL_STATUS: usize = 0x0110;
    pub(super) const AL_CONTROL: usize = 0x0120;
    pub(super) const AL_STATUS: usize = 0x0130;
    pub(super) const AL_STATUS_CODE: usize = 0x0134;
    pub(super) const WATCHDOG_DIVIDER: usize = 0x0400;
    pub(super) const WATCHDOG_STEPS: usize = 0x0420;
    pub(super) const WATCHDOG_STATUS: usize = 0x0440;
    pub(super) const SII_CONTROL: usize = 0x0502;
    pub(super) const SII_ADDRESS: usize = 0x0504;
    pub(super) const SII_DATA: usize = 0x0508;
    pub(super) const FMMU: usize = 0x0600;
    pub(super) const SYNC_MANAGER: usize = 0x0800;
    pub(super) const PORT_TIMES: usize = 0x0900;
    pub(super) const SYSTEM_TIME: usize = 0x0910;
    pub(super) const RECEIVE_TIME: usize = 0x0918;
    pub(super) const TIME_OFFSET: usize = 0x0920;
    pub(super) const SYNC_ACTIVE: usize = 0x0981;
    pub(super) const SYNC0_PERIOD: usize = 0x09A0;
}

/// AL states.
pub(super) mod al {
    pub(crate) const INIT: u8 = 1;
    pub(crate) const PRE_OP: u8 = 2;
    pub(crate) const SAFE_OP: u8 = 4;
    pub(crate) const OP: u8 = 8;
    pub(super) const ERROR: u8 = 0x10;
}

/// Codes of refused or lost AL states (ETG.1020).
const INVALID_STATE_CHANGE: u16 = 0x0011;
const UNKNOWN_STATE: u16 = 0x0012;
const SYNC_MANAGER_WATCHDOG: u16 = 0x001B;
/// Control byte of the outputs' sync manager, and its bit that lets frames trigger the watchdog.
const OUTPUTS_CONTROL: usize = register::SYNC_MANAGER + 2 * 8 + 4;
const WATCHED: u8 = 0x40;
/// FMMUs and sync managers of this controller.
const FMMUS: usize = 8;
/// Memory of the controller up to the end of its process data.
const MEMORY: usize = 0x2000;
/// Support flags: distributed clocks of 64 bit with SYNC0.
const CLOCKS: u16 = 0x010C;
/// Delay of a frame from port to port \[ns\].
const HOP: u32 = 300;

/// An emulated device with its drive.
#[derive(Debug)]
pub struct EmulatedDevice {
    memory: Vec<u8>,
    sii: Vec<u8>,
    /// The drive behind the controller.
    pub drive: DriveModel,
    /// Number of further frames that it ignores: an injected fault.
    pub deaf_for: u32,
    /// Time of the last output refresh.
    refreshed: Nanos,
}

impl EmulatedDevice {
    /// Creates a device in INIT at a position of the segment.
    pub fn new(drive: DriveModel, place: u32, last: bool) -> Self {
        let mut memory = vec![0; MEMORY];
        memory[0] = 0x11;
        if drive.clocks {
            memory[register::SUPPORT..][..2].copy_from_slice(&CLOCKS.to_le_bytes());
        }
        // Local application running; links at port 0, and at port 1 unless the segment ends here.
        let links: u16 = if last { 0x0011 } else { 0x0031 };
        memory[register::DL_STATUS..][..2].copy_from_slice(&links.to_le_bytes());
        memory[register::AL_STATUS] = al::INIT;
        let (divider, steps) = drive.watchdog;
        memory[register::WATCHDOG_DIVIDER..][..2].copy_from_slice(&divider.to_le_bytes());
        memory[register::WATCHDOG_STEPS..][..2].copy_from_slice(&steps.to_le_bytes());
        memory[register::WATCHDOG_STATUS] = 1;
        Self { memory, sii: sii::image(&drive, place), drive, deaf_for: 0, refreshed: Nanos(0) }
    }

    /// Returns its AL state with the error bit.
    pub fn state(&self) -> u8 {
        self.memory[register::AL_STATUS] & 0x1F
    }

    /// Whether it is in OP: its outputs are valid.
    pub fn operational(&self) -> bool {
        self.state() == al::OP
    }

    /// Returns the time after which outputs without a frame stop the drive; `None`: never.
    pub fn watchdog(&self) -> Option<Nanos> {
        let word = |at: usize| i64::from(u16::from_le_bytes([self.memory[at], self.memory[at + 1]]));
        let (divider, steps) = (word(register::WATCHDOG_DIVIDER), word(register::WATCHDOG_STEPS));
        let watched = self.memory[OUTPUTS_CONTROL] & WATCHED != 0;
        (watched && steps > 0).then_some(Nanos(40 * (divider + 2) * steps))
    }

    /// Returns the period of SYNC0, if it is active.
    pub fn sync0(&self) -> Option<Nanos> {
        let period: [u8; 4] = std::array::from_fn(|i| self.memory[register::SYNC0_PERIOD + i]);
        // Cyclic operation and SYNC0.
        (self.memory[register::SYNC_ACTIVE] & 3 == 3).then_some(Nanos(i64::from(u32::from_le_bytes(period))))
    }

    /// Executes a command with a device address; returns the increment of the working counter.
    pub(super) fn physical(&mut self, now: Nanos, command: u8, place: u16, offset: u16, data: &mut [u8]) -> u16 {
        let station = u16::from_le_bytes([self.memory[register::STATION], self.memory[register::STATION + 1]]);
        let here = if matches!(command, 4..=6 | 14) { place == station } else { place == 0 };
        let (reads, writes) = match command {
            1 | 4 => (here, false),
            2 | 5 => (false, here),
            3 | 6 => (here, here),
            7 => (true, false),
            8 => (false, true),
            9 => (true, true),
            // Read from the addressed one, written to all others.
            13 | 14 => (here, !here),
            _ => (false, false),
        };
        let before: Vec<u8> = data.to_vec();
        let mut count = 0;
        if reads && self.read(now, usize::from(offset), data) {
            count += 1;
            if matches!(command, 7 | 9) {
                data.iter_mut().zip(&before).for_each(|(byte, before)| *byte |= before);
            }
        }
        if writes && self.write(now, usize::from(offset), &before) {
            count += if reads { 2 } else { 1 };
        }
        count
    }

    fn read(&mut self, now: Nanos, at: usize, data: &mut [u8]) -> bool {
        if covers(at, data.len(), register::SYSTEM_TIME) && self.drive.clocks {
            let time = self.system_time(now);
            self.memory[register::SYSTEM_TIME..][..8].copy_from_slice(&time.to_le_bytes());
        }
        if at == mailbox::SEND && !self.full(1) {
            return false;
        }
        let Some(memory) = self.memory.get(at..at + data.len()) else { return false };
        data.copy_from_slice(memory);
        if at == mailbox::SEND {
            self.set_full(1, false);
        }
        true
    }

    fn write(&mut self, now: Nanos, at: usize, data: &[u8]) -> bool {
        let length = data.len();
        if at == register::PORT_TIMES && length <= 4 {
            return self.drive.clocks && self.latch(now);
        }
        if covers(at, length, register::SYSTEM_TIME) {
            // The clocks of this segment run alike: no steering.
            return self.drive.clocks;
        }
        if at + length > MEMORY || (register::AL_STATUS..register::AL_STATUS + 8).contains(&at) {
            return false;
        }
        let fixed = [register::WATCHDOG_DIVIDER, register::WATCHDOG_STEPS].contains(&at) && self.drive.watchdog_fixed;
        if fixed || at == register::WATCHDOG_STATUS {
            return true;
        }
        let status = self.memory[register::SYNC_MANAGER + 13];
        self.memory[at..at + length].copy_from_slice(data);
        match at {
            register::AL_CONTROL => self.change_state(now),
            register::SII_CONTROL if length >= 4 => self.read_sii(),
            // The status of a sync manager is read-only.
            _ if at == register::SYNC_MANAGER + 8 => self.memory[register::SYNC_MANAGER + 13] = status,
            mailbox::RECEIVE if self.state() & 0x0F != al::INIT => self.answer_mailbox(),
            _ => {}
        }
        true
    }

    fn full(&self, manager: usize) -> bool {
        self.memory[register::SYNC_MANAGER + 8 * manager + 5] & 0x08 != 0
    }

    fn set_full(&mut self, manager: usize, full: bool) {
        let status = &mut self.memory[register::SYNC_MANAGER + 8 * manager + 5];
        *status = if full { *status | 0x08 } else { *status & !0x08 };
    }

    fn answer_mailbox(&mut self) {
        let request: [u8; mailbox::LENGTH] =
            std::array::from_fn(|i| self.memory.get(mailbox::RECEIVE + i).copied().unwrap_or(0));
        if let Some(answer) = mailbox::answer(&request, &mut self.drive) {
            self.memory[mailbox::SEND..][..mailbox::LENGTH].copy_from_slice(&answer);
            self.set_full(1, true);
        }
    }

    fn read_sii(&mut self) {
        let word = |at: usize| u16::from_le_bytes([self.memory[at], self.memory[at + 1]]);
        let (control, address) = (word(register::SII_CONTROL), usize::from(word(register::SII_ADDRESS)));
        if control & 0x0100 != 0 {
            for i in 0..8 {
                self.memory[register::SII_DATA + i] = self.sii.get(2 * address + i).copied().unwrap_or(0xFF);
            }
        }
        // Ready at once; bit 6: reads return 8 bytes.
        self.memory[register::SII_CONTROL..][..2].copy_from_slice(&0x0040u16.to_le_bytes());
    }

    fn latch(&mut self, now: Nanos) -> bool {
        let local = now.0 as u64;
        for port in 0..4 {
            let time = (local as u32).wrapping_add(HOP * port as u32);
            self.memory[register::PORT_TIMES + 4 * port..][..4].copy_from_slice(&time.to_le_bytes());
        }
        self.memory[register::RECEIVE_TIME..][..8].copy_from_slice(&local.to_le_bytes());
        true
    }

    /// Returns the time of the distributed clock: the local one plus the written offset.
    pub fn system_time(&self, now: Nanos) -> u64 {
        let offset: [u8; 8] = std::array::from_fn(|i| self.memory[register::TIME_OFFSET + i]);
        (now.0 as u64).wrapping_add(u64::from_le_bytes(offset))
    }

    /// A state is reached from its neighbours only; downwards always.
    fn change_state(&mut self, now: Nanos) {
        let asked = self.memory[register::AL_CONTROL];
        let (state, acknowledged) = (asked & 0x0F, asked & al::ERROR != 0);
        let now_in = self.state();
        if now_in & al::ERROR != 0 && !acknowledged {
            return;
        }
        let entered_from = match state {
            al::INIT => 0,
            al::PRE_OP => al::INIT,
            al::SAFE_OP => al::PRE_OP,
            al::OP => al::SAFE_OP,
            _ => return self.refuse(UNKNOWN_STATE),
        };
        let current = now_in & 0x0F;
        if state > current && current != entered_from {
            return self.refuse(INVALID_STATE_CHANGE);
        }
        if state < al::OP {
            self.drive.stop();
        }
        if state == al::INIT {
            self.set_full(1, false);
        }
        self.refreshed = now;
        self.memory[register::AL_STATUS] = state;
        self.memory[register::AL_STATUS_CODE..][..2].fill(0);
    }

    fn refuse(&mut self, code: u16) {
        self.memory[register::AL_STATUS] |= al::ERROR;
        self.memory[register::AL_STATUS_CODE..][..2].copy_from_slice(&code.to_le_bytes());
    }

    /// Executes a command with a process data address; returns the increment of the working counter.
    pub(super) fn logical(&mut self, now: Nanos, command: u8, address: u32, data: &mut [u8]) -> u16 {
        let state = self.state() & 0x0F;
        if self.deaf_for > 0 || state < al::SAFE_OP {
            self.deaf_for = self.deaf_for.saturating_sub(1);
            return 0;
        }
        self.watch(now);
        let (reads, writes) = (command != 11, command != 10);
        let mut count = 0;
        // Inputs are those before this frame's outputs.
        let outputs = data.to_vec();
        for i in 0..FMMUS {
            let Some(fmmu) = Fmmu::read(&self.memory[register::FMMU + 16 * i..][..16]) else { continue };
            let Some((place, physical, length)) = fmmu.overlap(address, data.len()) else { continue };
            if fmmu.inputs && reads {
                self.drive.put_inputs(&mut self.memory[physical..physical + length]);
                data[place..place + length].copy_from_slice(&self.memory[physical..physical + length]);
                count += 1;
            } else if fmmu.outputs && writes {
                self.memory[physical..physical + length].copy_from_slice(&outputs[place..place + length]);
                self.refreshed = now;
                self.memory[register::WATCHDOG_STATUS] = 1;
                if self.operational() {
                    self.drive.take_outputs(&outputs[place..place + length]);
                }
                count += if reads { 2 } else { 1 };
            }
        }
        self.drive.tick();
        count
    }

    /// Expired watchdog: the drive stops, the state falls back.
    pub(super) fn watch(&mut self, now: Nanos) {
        let expired = self.watchdog().is_some_and(|limit| (now - self.refreshed).0 > limit.0);
        if self.operational() && expired {
            self.memory[register::WATCHDOG_STATUS] = 0;
            self.drive.stop();
            self.memory[register::AL_STATUS] = al::SAFE_OP;
            self.refuse(SYNC_MANAGER_WATCHDOG);
        }
    }
}

fn covers(at: usize, length: usize, register: usize) -> bool {
    (at..at + length).contains(&register)
}

/// Maps a window of the logical process data onto the memory of the device.
#[derive(Clone, Copy, Debug)]
struct Fmmu {
    logical: u32,
    length: usize,
    physical: usize,
    inputs: bool,
    outputs: bool,
}

impl Fmmu {
    fn read(bytes: &[u8]) -> Option<Self> {
        let word = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
        let (length, physical) = (usize::from(word(4)), usize::from(word(8)));
        (bytes[12] & 1 != 0 && physical + length <= MEMORY).then(|| Self {
            logical: u32::from(word(2)) << 16 | u32::from(word(0)),
            length,
            physical,
            inputs: bytes[11] & 1 != 0,
            outputs: bytes[11] & 2 != 0,
        })
    }

    /// Returns the window in a datagram's data: offset there, offset in memory, length. Only whole windows count.
    fn overlap(&self, address: u32, length: usize) -> Option<(usize, usize, usize)> {
        let place = self.logical.checked_sub(address)? as usize;
        (place + self.length <= length).then_some((place, self.physical, self.length))
    }
}
