//! Process data of a drive by its own mapping: the byte of each object is read from the device and never assumed.

use std::fmt;

/// Objects of CiA 402 that the process data may hold.
pub mod object {
    /// Error code, u16.
    pub const ERROR_CODE: u16 = 0x603F;
    /// Controlword, u16.
    pub const CONTROLWORD: u16 = 0x6040;
    /// Statusword, u16.
    pub const STATUSWORD: u16 = 0x6041;
    /// Quick stop option code, i16.
    pub const QUICK_STOP_OPTION: u16 = 0x605A;
    /// Shutdown option code, i16.
    pub const SHUTDOWN_OPTION: u16 = 0x605B;
    /// Disable operation option code, i16.
    pub const DISABLE_OPTION: u16 = 0x605C;
    /// Fault reaction option code, i16.
    pub const FAULT_OPTION: u16 = 0x605E;
    /// Modes of operation, i8.
    pub const MODE: u16 = 0x6060;
    /// Modes of operation display, i8.
    pub const MODE_DISPLAY: u16 = 0x6061;
    /// Position actual value, i32 \[counts\].
    pub const POSITION: u16 = 0x6064;
    /// Following error window, u32 \[counts\].
    pub const FOLLOWING_WINDOW: u16 = 0x6065;
    /// Velocity actual value, i32 \[counts/s\].
    pub const VELOCITY: u16 = 0x606C;
    /// Torque actual value, i16 \[1/1000 of the rated torque\].
    pub const TORQUE: u16 = 0x6077;
    /// Target position, i32 \[counts\].
    pub const TARGET_POSITION: u16 = 0x607A;
    /// Interpolation time period: value and power of ten.
    pub const INTERPOLATION_PERIOD: u16 = 0x60C2;
    /// Supported drive modes, u32.
    pub const SUPPORTED_MODES: u16 = 0x6502;
    /// PDOs assigned to the outputs (sync manager 2).
    pub const OUTPUT_ASSIGNMENT: u16 = 0x1C12;
    /// PDOs assigned to the inputs (sync manager 3).
    pub const INPUT_ASSIGNMENT: u16 = 0x1C13;
}

/// An entry of a PDO mapping object (0x1600.., 0x1A00..): index, subindex and length in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PdoEntry {
    /// Index of the object; 0 in a gap.
    pub index: u16,
    /// Its subindex.
    pub subindex: u8,
    /// Its length \[bit\].
    pub bits: u8,
}

impl PdoEntry {
    /// Decodes the word of the mapping object.
    pub fn from_word(word: u32) -> Self {
        Self { index: (word >> 16) as u16, subindex: (word >> 8) as u8, bits: word as u8 }
    }

    /// Encodes the word of the mapping object.
    pub fn to_word(self) -> u32 {
        u32::from(self.index) << 16 | u32::from(self.subindex) << 8 | u32::from(self.bits)
    }
}

/// Error in a mapping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unusable {
    /// A required object is not mapped; its index.
    Missing(u16),
    /// An object has another length than in CiA 402: index, bits found, bits due.
    Length(u16, u8, u8),
    /// An object does not begin at a byte boundary; its index.
    Unaligned(u16),
    /// The process data exceed the greatest length \[bit\].
    TooLong(usize),
}

impl fmt::Display for Unusable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing(index) => {
                let (side, assignment) = if matches!(*index, object::CONTROLWORD | object::TARGET_POSITION) {
                    ("outputs", object::OUTPUT_ASSIGNMENT)
                } else {
                    ("inputs", object::INPUT_ASSIGNMENT)
                };
                write!(
                    f,
                    "object {index:04X} ({}) is not mapped in its {side}: choose a PDO with it in {assignment:04X}",
                    name(*index)
                )
            }
            Self::Length(index, found, due) => {
                write!(f, "object {index:04X} ({}) is mapped with {found} bit instead of {due}", name(*index))
            }
            Self::Unaligned(index) => {
                write!(f, "object {index:04X} ({}) does not begin at a byte boundary", name(*index))
            }
            Self::TooLong(bits) => write!(f, "{bits} bit of process data exceed the limit of {MAX_BITS} bit"),
        }
    }
}

fn name(index: u16) -> &'static str {
    match index {
        object::ERROR_CODE => "error code",
        object::CONTROLWORD => "controlword",
        object::STATUSWORD => "statusword",
        object::MODE => "modes of operation",
        object::MODE_DISPLAY => "modes of operation display",
        object::POSITION => "position actual value",
        object::VELOCITY => "velocity actual value",
        object::TORQUE => "torque actual value",
        object::TARGET_POSITION => "target position",
        _ => "unknown",
    }
}

/// Greatest length of process data of one direction \[bit\].
const MAX_BITS: usize = 64 * 8;

/// Offsets of a drive's outputs \[byte\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriveOutputs {
    /// Controlword.
    pub controlword: usize,
    /// Target position.
    pub target: usize,
    /// Modes of operation; where it is not mapped it is written once by SDO.
    pub mode: Option<usize>,
    /// Length of all outputs.
    pub length: usize,
}

/// Offsets of a drive's inputs \[byte\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DriveInputs {
    /// Statusword.
    pub statusword: usize,
    /// Position actual value.
    pub position: usize,
    /// Velocity actual value, if mapped.
    pub velocity: Option<usize>,
    /// Torque actual value, if mapped.
    pub torque: Option<usize>,
    /// Modes of operation display, if mapped.
    pub mode: Option<usize>,
    /// Error code, if mapped.
    pub error: Option<usize>,
    /// Length of all inputs.
    pub length: usize,
}

/// Report of a drive in a cycle, in wire units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Statusword.
    pub statusword: u16,
    /// Position actual value \[counts\].
    pub position: i32,
    /// Velocity actual value \[counts/s\], if mapped.
    pub velocity: Option<i32>,
    /// Torque actual value \[1/1000 of the rated torque\], if mapped.
    pub torque: Option<i16>,
    /// Mode in force, if mapped.
    pub mode: Option<i8>,
    /// Error code, if mapped; 0 without a fault.
    pub error: Option<u16>,
}

/// Command to a drive in a cycle, in wire units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServoCommand {
    /// Controlword.
    pub controlword: u16,
    /// Target position \[counts\].
    pub target: i32,
}

impl DriveOutputs {
    /// Locates the objects in the mapped entries, in the order of their assignment.
    ///
    /// # Errors
    /// If controlword or target position are missing, or an object crosses bytes.
    pub fn find(entries: &[PdoEntry]) -> Result<Self, Unusable> {
        Ok(Self {
            controlword: required(entries, object::CONTROLWORD, 16)?,
            target: required(entries, object::TARGET_POSITION, 32)?,
            mode: optional(entries, object::MODE, 8)?,
            length: length(entries)?,
        })
    }

    /// Writes a command; returns `false` if the outputs are shorter than mapped.
    pub fn write(&self, bytes: &mut [u8], command: &ServoCommand, mode: i8) -> bool {
        let mut put =
            |at: usize, value: &[u8]| bytes.get_mut(at..at + value.len()).map(|to| to.copy_from_slice(value)).is_some();
        put(self.controlword, &command.controlword.to_le_bytes())
            && put(self.target, &command.target.to_le_bytes())
            && self.mode.is_none_or(|at| put(at, &mode.to_le_bytes()))
    }
}

impl DriveInputs {
    /// Locates the objects in the mapped entries, in the order of their assignment.
    ///
    /// # Errors
    /// If statusword or actual position are missing, or an object crosses bytes.
    pub fn find(entries: &[PdoEntry]) -> Result<Self, Unusable> {
        Ok(Self {
            statusword: required(entries, object::STATUSWORD, 16)?,
            position: required(entries, object::POSITION, 32)?,
            velocity: optional(entries, object::VELOCITY, 32)?,
            torque: optional(entries, object::TORQUE, 16)?,
            mode: optional(entries, object::MODE_DISPLAY, 8)?,
            error: optional(entries, object::ERROR_CODE, 16)?,
            length: length(entries)?,
        })
    }

    /// Reads a report; `None` if the inputs are shorter than mapped.
    pub fn read(&self, bytes: &[u8]) -> Option<Report> {
        Some(Report {
            statusword: u16::from_le_bytes(bytes_at(bytes, self.statusword)?),
            position: i32::from_le_bytes(bytes_at(bytes, self.position)?),
            velocity: self.velocity.and_then(|at| bytes_at(bytes, at)).map(i32::from_le_bytes),
            torque: self.torque.and_then(|at| bytes_at(bytes, at)).map(i16::from_le_bytes),
            mode: self.mode.and_then(|at| bytes_at(bytes, at)).map(i8::from_le_bytes),
            error: self.error.and_then(|at| bytes_at(bytes, at)).map(u16::from_le_bytes),
        })
    }
}

fn bytes_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..at.checked_add(N)?)?.try_into().ok()
}

fn required(entries: &[PdoEntry], index: u16, bits: u8) -> Result<usize, Unusable> {
    optional(entries, index, bits)?.ok_or(Unusable::Missing(index))
}

/// Returns the byte offset of an object, if it is mapped.
fn optional(entries: &[PdoEntry], index: u16, bits: u8) -> Result<Option<usize>, Unusable> {
    let Some(place) = entries.iter().position(|entry| entry.index == index && entry.subindex == 0) else {
        return Ok(None);
    };
    let before: usize = entries[..place].iter().map(|entry| usize::from(entry.bits)).sum();
    if entries[place].bits != bits {
        Err(Unusable::Length(index, entries[place].bits, bits))
    } else if !before.is_multiple_of(8) {
        Err(Unusable::Unaligned(index))
    } else {
        Ok(Some(before / 8))
    }
}

fn length(entries: &[PdoEntry]) -> Result<usize, Unusable> {
    let bits: usize = entries.iter().map(|entry| usize::from(entry.bits)).sum();
    if bits > MAX_BITS { Err(Unusable::TooLong(bits)) } else { Ok(bits.div_ceil(8)) }
}

#[cfg(test)]
#[path = "mapping_tests.rs"]
mod tests;
