//! The EEPROM of a device (ETG.2010): identity, mailbox, and the categories for its configuration.

use super::drive::DriveModel;
use super::mailbox;

/// Address of process data in the controller's memory \[byte\].
const OUTPUTS: u16 = 0x1100;
const INPUTS: u16 = 0x1180;
/// Words before the first category.
const FIRST_CATEGORY: usize = 0x40;

/// Categories.
const STRINGS: u16 = 10;
const GENERAL: u16 = 30;
const FMMU: u16 = 40;
const SYNC_MANAGER: u16 = 41;
const END: u16 = 0xFFFF;

/// Returns the EEPROM as bytes; `place` becomes its serial number.
pub(super) fn image(drive: &DriveModel, place: u32) -> Vec<u8> {
    let mut image = vec![0; 2 * FIRST_CATEGORY];
    let mut word = |at: usize, value: u16| image[2 * at..2 * at + 2].copy_from_slice(&value.to_le_bytes());
    // An unassigned vendor number; product 402.
    for (at, value) in [(0x08, 0xFFF0_0000u32), (0x0A, 402), (0x0C, 1), (0x0E, place)] {
        word(at, value as u16);
        word(at + 1, (value >> 16) as u16);
    }
    let length = mailbox::LENGTH as u16;
    for (at, value) in [(0x18, mailbox::RECEIVE as u16), (0x19, length), (0x1A, mailbox::SEND as u16), (0x1B, length)] {
        word(at, value);
    }
    // CoE; 16 kbit.
    word(0x1C, 0x0004);
    word(0x3E, 0x000F);
    word(0x3F, 1);
    category(&mut image, STRINGS, b"\x01\x09DRIVE-402");
    // Order and name are string 1; SDO, PDO assignment readable; two ports of type MII.
    category(&mut image, GENERAL, &[0, 0, 1, 1, 0, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0x11, 0, 0, 0]);
    category(&mut image, FMMU, &[1, 2]);
    category(&mut image, SYNC_MANAGER, &sync_managers(drive));
    image.extend(END.to_le_bytes());
    image.extend([0xFF; 16]);
    image
}

fn category(image: &mut Vec<u8>, kind: u16, data: &[u8]) {
    let words = data.len().div_ceil(2);
    image.extend(kind.to_le_bytes());
    image.extend((words as u16).to_le_bytes());
    image.extend(data);
    image.resize(image.len() + 2 * words - data.len(), 0);
}

/// Start, length, control, enable and use of each.
fn sync_managers(drive: &DriveModel) -> Vec<u8> {
    let bytes = |entries: &[super::super::mapping::PdoEntry]| {
        entries.iter().map(|entry| u16::from(entry.bits)).sum::<u16>().div_ceil(8)
    };
    let mailbox = mailbox::LENGTH as u16;
    let managers = [
        (mailbox::RECEIVE as u16, mailbox, 0x26, 1),
        (mailbox::SEND as u16, mailbox, 0x22, 2),
        (OUTPUTS, bytes(&drive.objects.outputs), if drive.watched { 0x64 } else { 0x24 }, 3),
        (INPUTS, bytes(&drive.objects.inputs), 0x20, 4),
    ];
    let bytes = managers.into_iter().flat_map(|(start, length, control, usage)| {
        let [s, t] = start.to_le_bytes();
        let [l, m] = length.to_le_bytes();
        [s, t, l, m, control, 0, 1, usage]
    });
    bytes.collect()
}
