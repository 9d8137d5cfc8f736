//! The object dictionary of a drive: its mapping and its writable parameters.

use super::super::cia402::mode;
use super::super::mapping::{PdoEntry, object};
use std::collections::BTreeMap;

/// SDO abort codes.
pub(super) mod abort {
    pub(crate) const NO_OBJECT: u32 = 0x0602_0000;
    pub(crate) const NO_SUBINDEX: u32 = 0x0609_0011;
    pub(crate) const READ_ONLY: u32 = 0x0601_0002;
    pub(crate) const LENGTH: u32 = 0x0607_0010;
}

/// PDOs of the process data.
const OUTPUT_PDO: u16 = 0x1600;
const INPUT_PDO: u16 = 0x1A00;

/// Objects of a drive.
#[derive(Clone, Debug)]
pub(super) struct Dictionary {
    pub(super) outputs: Vec<PdoEntry>,
    pub(super) inputs: Vec<PdoEntry>,
    /// Writable objects: value and length in bytes.
    parameters: BTreeMap<(u16, u8), (u32, u8)>,
}

impl Dictionary {
    /// Creates the usual objects: 6040, 607A, 60FF, 6060 out; 6041, 6064, 606C, 6061, 6077, 603F in.
    pub(super) fn new() -> Self {
        let entries = |words: &[u32]| words.iter().map(|word| PdoEntry::from_word(*word)).collect();
        let parameters = [
            ((object::MODE, 0), (0, 1)),
            ((object::FOLLOWING_WINDOW, 0), (20_000, 4)),
            ((object::INTERPOLATION_PERIOD, 1), (2, 1)),
            ((object::INTERPOLATION_PERIOD, 2), (0xFD, 1)),
            ((object::QUICK_STOP_OPTION, 0), (2, 2)),
            ((object::SHUTDOWN_OPTION, 0), (0, 2)),
            ((object::DISABLE_OPTION, 0), (1, 2)),
            ((object::FAULT_OPTION, 0), (2, 2)),
            ((object::SUPPORTED_MODES, 0), (mode::CSP_SUPPORTED | 1, 4)),
        ];
        Self {
            outputs: entries(&[0x6040_0010, 0x607A_0020, 0x60FF_0020, 0x6060_0008]),
            inputs: entries(&[0x6041_0010, 0x6064_0020, 0x606C_0020, 0x6061_0008, 0x6077_0010, 0x603F_0010]),
            parameters: parameters.into_iter().collect(),
        }
    }

    /// Returns value and length in bytes of an object.
    pub(super) fn read(&self, index: u16, subindex: u8) -> Option<(u32, u8)> {
        let list = |entries: &[PdoEntry]| match usize::from(subindex) {
            0 => Some((entries.len() as u32, 1)),
            place => entries.get(place - 1).map(|entry| (entry.to_word(), 4)),
        };
        let one = |pdo: u16| match subindex {
            0 => Some((1, 1)),
            1 => Some((u32::from(pdo), 2)),
            _ => None,
        };
        match index {
            object::OUTPUT_ASSIGNMENT => one(OUTPUT_PDO),
            object::INPUT_ASSIGNMENT => one(INPUT_PDO),
            OUTPUT_PDO => list(&self.outputs),
            INPUT_PDO => list(&self.inputs),
            _ => self.parameters.get(&(index, subindex)).copied(),
        }
    }

    /// Returns the abort code for an object that could not be read.
    pub(super) fn absent(&self, index: u16) -> u32 {
        let known = self.read(index, 0).is_some() || self.parameters.keys().any(|(other, _)| *other == index);
        if known { abort::NO_SUBINDEX } else { abort::NO_OBJECT }
    }

    /// Writes an object, or returns the abort code.
    pub(super) fn write(&mut self, index: u16, subindex: u8, value: u32, length: u8) -> Result<(), u32> {
        let Some((_, due)) = self.read(index, subindex) else { return Err(self.absent(index)) };
        if due != length {
            return Err(abort::LENGTH);
        }
        match self.parameters.get_mut(&(index, subindex)) {
            Some((old, _)) if index != object::SUPPORTED_MODES => *old = value,
            _ => return Err(abort::READ_ONLY),
        }
        Ok(())
    }

    /// Sets the initial value of a parameter.
    pub(super) fn set(&mut self, index: u16, subindex: u8, value: u32) {
        if let Some((old, _)) = self.parameters.get_mut(&(index, subindex)) {
            *old = value;
        }
    }

    /// Removes an object.
    pub(super) fn remove(&mut self, index: u16, subindex: u8) {
        self.parameters.remove(&(index, subindex));
    }
}
