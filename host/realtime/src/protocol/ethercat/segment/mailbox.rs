//! The mailbox of a device: CANopen over EtherCAT, expedited SDO uploads and downloads (ETG.1000.6).

use super::drive::DriveModel;

/// Address of requests \[byte\].
pub(super) const RECEIVE: usize = 0x1000;
/// Address of answers \[byte\].
pub(super) const SEND: usize = 0x1080;
/// Length of either \[byte\].
pub(super) const LENGTH: usize = 0x80;
/// Type of the mailbox protocol.
const COE: u8 = 3;
/// Services of CoE, in the upper bits of its header.
const EMERGENCY: u8 = 1;
const SDO_REQUEST: u8 = 2;
const SDO_RESPONSE: u8 = 3;

/// Returns the answer to a request; `None` for other messages.
pub(super) fn answer(request: &[u8; LENGTH], drive: &mut DriveModel) -> Option<[u8; LENGTH]> {
    let [_, _, _, _, _, kind, _, service, command, low, high, subindex, data @ ..] = *request;
    if kind & 0x0F != COE || service >> 4 != SDO_REQUEST {
        return None;
    }
    if std::mem::take(&mut drive.emergency) {
        let mut message = [0; LENGTH];
        // Error code 2340: short circuit.
        (message[0], message[5], message[7]) = (10, kind, EMERGENCY << 4);
        message[8..10].copy_from_slice(&0x2340u16.to_le_bytes());
        return Some(message);
    }
    let index = u16::from_le_bytes([low, high]);
    let value = u32::from_le_bytes([data[0], data[1], data[2], data[3]]);
    let (service, command, value) = match command >> 5 {
        // Upload: answered expedited, with the number of unused bytes.
        2 => match drive.objects.read(index, subindex) {
            Some((value, length)) => (SDO_RESPONSE, 0x43 | (4 - length) << 2, value),
            None => (SDO_REQUEST, 0x80, drive.objects.absent(index)),
        },
        // Download, expedited.
        1 if command & 0x02 != 0 => {
            let length = 4 - (command >> 2 & 0x03);
            match drive.objects.write(index, subindex, value, length) {
                Ok(()) => (SDO_RESPONSE, 0x60, 0),
                Err(code) => (SDO_REQUEST, 0x80, code),
            }
        }
        // Command specifier not valid.
        _ => (SDO_REQUEST, 0x80, 0x0504_0001),
    };
    let mut answer = [0; LENGTH];
    answer[0] = 10;
    answer[5] = kind;
    answer[7] = service << 4;
    answer[8..12].copy_from_slice(&[command, low, high, subindex]);
    answer[12..16].copy_from_slice(&value.to_le_bytes());
    Some(answer)
}
