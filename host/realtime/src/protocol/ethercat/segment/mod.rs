//! Emulates an EtherCAT segment of CiA 402 drives at the level of frames, for tests and demonstrations.
//!
//! Frames as in ETG.1000.4: datagrams with commands that read and write the memory of one, some or all devices and
//! increment a working counter. Without clock and socket, except in [`Responder`].

mod device;
mod dictionary;
mod drive;
mod mailbox;
mod responder;
mod sii;

pub use device::EmulatedDevice;
pub use drive::{DriveModel, Enabling};
pub use responder::Responder;

use crate::time::Nanos;

/// Length of Ethernet and EtherCAT headers \[byte\].
const HEADERS: usize = 16;
/// Length of a datagram's header and of its working counter \[byte\].
const DATAGRAM_HEADER: usize = 10;
const WORKING_COUNTER: usize = 2;

/// Devices in the order in which a frame passes them.
#[derive(Debug)]
pub struct EthercatSegment {
    /// The devices.
    pub devices: Vec<EmulatedDevice>,
    /// Number of passed frames with process data.
    pub exchanges: u64,
    /// State of the random number generator; if not 0, one frame in eight returns with a wrong byte.
    pub garble: u64,
}

/// Header of a datagram.
#[derive(Clone, Copy, Debug)]
struct Datagram {
    command: u8,
    /// Position or station address; with logical commands the low half of the address.
    device: u16,
    /// Register or memory address; with logical commands the high half of the address.
    offset: u16,
    length: usize,
    more: bool,
}

impl Datagram {
    fn read(bytes: &[u8]) -> Option<Self> {
        let header: &[u8; DATAGRAM_HEADER] = bytes.first_chunk()?;
        let word = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
        Some(Self {
            command: header[0],
            device: word(2),
            offset: word(4),
            length: usize::from(word(6) & 0x07FF),
            more: word(6) & 0x8000 != 0,
        })
    }
}

impl EthercatSegment {
    /// Creates a segment of drives.
    pub fn new(drives: Vec<DriveModel>) -> Self {
        let last = drives.len().saturating_sub(1);
        let devices = drives.into_iter().enumerate().map(|(i, drive)| EmulatedDevice::new(drive, i as u32, i == last));
        Self { devices: devices.collect(), exchanges: 0, garble: 0 }
    }

    /// Passes a frame through all devices; returns whether the segment sends it back (it drops frames of another kind).
    pub fn pass(&mut self, now: Nanos, frame: &mut [u8]) -> bool {
        let Some((headers, mut rest)) = frame.split_at_mut_checked(HEADERS) else { return false };
        // Type 1 of the EtherCAT header: datagrams.
        if headers[12..14] != super::raw::ETHERTYPE.to_be_bytes() || headers[15] >> 4 != 1 {
            return false;
        }
        loop {
            let Some(datagram) = Datagram::read(rest) else { return false };
            let whole = DATAGRAM_HEADER + datagram.length + WORKING_COUNTER;
            let Some((bytes, behind)) = rest.split_at_mut_checked(whole) else { return false };
            self.datagram(now, datagram, bytes);
            if !datagram.more {
                break;
            }
            rest = behind;
        }
        // The first device of a segment sets the locally-administered bit of the source address.
        headers[6] |= 0x02;
        self.spoil(frame);
        true
    }

    /// Changes one byte after the Ethernet header of some frames, if configured.
    fn spoil(&mut self, frame: &mut [u8]) {
        if self.garble == 0 {
            return;
        }
        // xorshift64 (Marsaglia): never 0 again.
        self.garble ^= self.garble << 13;
        self.garble ^= self.garble >> 7;
        self.garble ^= self.garble << 17;
        let (chance, place, byte) = (self.garble & 7, self.garble >> 16, (self.garble >> 8) as u8);
        if chance == 0 {
            let place = 14 + place as usize % (frame.len() - 14);
            frame[place] ^= byte;
        }
    }

    /// Advances the time without frames: outputs that are not refreshed stop their drives.
    pub fn idle(&mut self, now: Nanos) {
        self.devices.iter_mut().for_each(|device| device.watch(now));
    }

    fn datagram(&mut self, now: Nanos, datagram: Datagram, bytes: &mut [u8]) {
        let (header, rest) = bytes.split_at_mut(DATAGRAM_HEADER);
        let (data, counter) = rest.split_at_mut(datagram.length);
        let mut count = u16::from_le_bytes([counter[0], counter[1]]);
        let mut place = datagram.device;
        let logical = matches!(datagram.command, 10..=12);
        // Each passed device increments position addresses and broadcasts.
        let counted = matches!(datagram.command, 1..=3 | 7..=9 | 13);
        self.exchanges += u64::from(logical);
        // FRMW and ARMW write the data read from one device to those behind it; a BRD ors all answers.
        for device in &mut self.devices {
            count = count.wrapping_add(if logical {
                let address = u32::from(datagram.offset) << 16 | u32::from(datagram.device);
                device.logical(now, datagram.command, address, data)
            } else {
                device.physical(now, datagram.command, place, datagram.offset, data)
            });
            place = place.wrapping_add(u16::from(counted));
        }
        header[2..4].copy_from_slice(&place.to_le_bytes());
        counter.copy_from_slice(&count.to_le_bytes());
    }
}

#[cfg(test)]
mod tests;
