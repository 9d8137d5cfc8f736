//! Hand-written datagrams with the working counters of ETG.1000.4, and frames of arbitrary bytes.

use super::*;
use proptest::prelude::*;

/// Builds a frame of datagrams: command, address, data.
fn frame(datagrams: &[(u8, u32, &[u8])]) -> Vec<u8> {
    let mut body = Vec::new();
    for (i, (command, address, data)) in datagrams.iter().enumerate() {
        let more = if i + 1 < datagrams.len() { 0x8000 } else { 0 };
        body.extend([*command, 7]);
        body.extend(address.to_le_bytes());
        body.extend((data.len() as u16 | more).to_le_bytes());
        body.extend([0, 0]);
        body.extend(*data);
        body.extend([0, 0]);
    }
    let mut frame = vec![0xFF; 6];
    frame.extend([0x10; 6]);
    frame.extend([0x88, 0xA4]);
    frame.extend((body.len() as u16 | 0x1000).to_le_bytes());
    frame.extend(body);
    frame
}

/// Returns data and working counter of the only datagram.
fn send(segment: &mut EthercatSegment, command: u8, address: u32, data: &[u8]) -> (Vec<u8>, u16) {
    let mut frame = frame(&[(command, address, data)]);
    assert!(segment.pass(Nanos(1_000), &mut frame));
    assert_eq!(frame[6], 0x12, "the first device marks the source address");
    let counter = u16::from_le_bytes([frame[frame.len() - 2], frame[frame.len() - 1]]);
    (frame[26..frame.len() - 2].to_vec(), counter)
}

fn physical(device: u16, register: u16) -> u32 {
    u32::from(register) << 16 | u32::from(device)
}

fn segment(count: usize) -> EthercatSegment {
    EthercatSegment::new((0..count).map(|i| DriveModel::new(100 * i as i32)).collect())
}

/// Sets stations 0x1000, 0x1001, .. by position.
fn addressed(count: usize) -> EthercatSegment {
    let mut segment = segment(count);
    for i in 0..count as u16 {
        let (_, counter) = send(&mut segment, 2, physical(0u16.wrapping_sub(i), 0x0010), &(0x1000 + i).to_le_bytes());
        assert_eq!(counter, 1);
    }
    segment
}

#[test]
fn broadcast_counts_all_devices_and_ors_their_answers() {
    let mut segment = segment(7);
    assert_eq!(send(&mut segment, 7, physical(0, 0), &[0]), (vec![0x11], 7));
    // DL status: link at port 1 of all but the last.
    assert_eq!(send(&mut segment, 7, physical(0, 0x0110), &[0, 0]).0, [0x31, 0]);
}

#[test]
fn device_is_addressed_by_position_and_station() {
    let mut segment = addressed(3);
    assert_eq!(send(&mut segment, 4, physical(0x1002, 0x0010), &[0, 0]), (vec![0x02, 0x10], 1));
    assert_eq!(send(&mut segment, 1, physical(0u16.wrapping_sub(1), 0x0010), &[0, 0]), (vec![0x01, 0x10], 1));
    assert_eq!(send(&mut segment, 4, physical(0x1003, 0x0010), &[0, 0]).1, 0);
    assert_eq!(send(&mut segment, 6, physical(0x1000, 0x0600), &[5]).1, 3);
}

#[test]
fn states_change_one_at_a_time_and_refusals_have_a_code() {
    let mut segment = addressed(1);
    let state = |segment: &mut EthercatSegment, asked: u8| {
        send(segment, 5, physical(0x1000, 0x0120), &[asked, 0]);
        let (status, _) = send(segment, 4, physical(0x1000, 0x0130), &[0; 6]);
        (status[0], u16::from_le_bytes([status[4], status[5]]))
    };
    assert_eq!(state(&mut segment, 8), (0x11, 0x0011));
    assert_eq!(state(&mut segment, 0x11), (1, 0));
    for asked in [2, 4, 8] {
        assert_eq!(state(&mut segment, asked), (asked, 0));
    }
    assert_eq!(state(&mut segment, 2), (2, 0));
}

#[test]
fn process_data_count_three_per_responding_drive() {
    let mut segment = addressed(2);
    for (i, station) in [0x1000u16, 0x1001].into_iter().enumerate() {
        for state in [2, 4] {
            send(&mut segment, 5, physical(station, 0x0120), &[state, 0]);
        }
        // FMMU 0: 11 bytes of outputs at 0x1100; FMMU 1: 15 bytes of inputs at 0x1180.
        let window = |logical: u32, length: u16, physical: u16, kind: u8| {
            let mut bytes = logical.to_le_bytes().to_vec();
            bytes.extend(length.to_le_bytes());
            bytes.extend([0, 7]);
            bytes.extend(physical.to_le_bytes());
            bytes.extend([0, kind, 1, 0, 0, 0]);
            bytes
        };
        let (outputs, inputs) = (30 + 11 * i as u32, 15 * i as u32);
        send(&mut segment, 5, physical(station, 0x0600), &window(outputs, 11, 0x1100, 2));
        send(&mut segment, 5, physical(station, 0x0610), &window(inputs, 15, 0x1180, 1));
    }
    let (data, counter) = send(&mut segment, 12, 0, &[0; 52]);
    assert_eq!(counter, 6);
    // Statusword and position of the second drive.
    assert_eq!(data[15..21], [0x50, 0x02, 100, 0, 0, 0]);
    segment.devices[1].deaf_for = 1;
    assert_eq!(send(&mut segment, 12, 0, &[0; 52]).1, 3);
    assert_eq!(send(&mut segment, 10, 0, &[0; 52]).1, 2);
    assert_eq!(send(&mut segment, 11, 0, &[0; 52]).1, 2);
}

#[test]
fn outputs_stop_when_the_watchdog_expires() {
    let mut segment = addressed(1);
    assert_eq!(send(&mut segment, 4, physical(0x1000, 0x0400), &[0; 2]).0, 2498u16.to_le_bytes());
    assert_eq!(send(&mut segment, 4, physical(0x1000, 0x0420), &[0; 2]).0, 1000u16.to_le_bytes());
    assert_eq!(segment.devices[0].watchdog(), None, "no sync manager yet");
    // Sync manager 2: 11 bytes of outputs at 0x1100, triggers the watchdog.
    send(&mut segment, 5, physical(0x1000, 0x0810), &[0x00, 0x11, 11, 0, 0x64, 0, 1, 0]);
    assert_eq!(segment.devices[0].watchdog(), Some(Nanos::from_millis(100)));
    send(&mut segment, 5, physical(0x1000, 0x0420), &50u16.to_le_bytes());
    for state in [2, 4, 8] {
        send(&mut segment, 5, physical(0x1000, 0x0120), &[state, 0]);
    }
    segment.idle(Nanos::from_millis(5));
    assert!(segment.devices[0].operational());
    assert_eq!(send(&mut segment, 4, physical(0x1000, 0x0440), &[0; 2]).0, [1, 0]);
    segment.idle(Nanos(5_001_001));
    assert_eq!(segment.devices[0].state(), 0x14, "SAFE-OP with an error");
    assert_eq!(send(&mut segment, 4, physical(0x1000, 0x0440), &[0; 2]).0, [0, 0]);
    assert_eq!(send(&mut segment, 4, physical(0x1000, 0x0134), &[0; 2]).0, [0x1B, 0]);
    // Steps of 0 switch it off; some devices do not allow setting it.
    send(&mut segment, 5, physical(0x1000, 0x0420), &[0, 0]);
    assert_eq!(segment.devices[0].watchdog(), None);
    segment.devices[0].drive.watchdog_fixed = true;
    send(&mut segment, 5, physical(0x1000, 0x0420), &[9, 0]);
    assert_eq!(segment.devices[0].watchdog(), None);
}

#[test]
fn reference_clock_is_read_from_one_and_written_to_others() {
    let mut drive = DriveModel::new(0);
    drive.clocks = true;
    let mut segment = EthercatSegment::new(vec![drive; 3]);
    for i in 0..3u16 {
        send(&mut segment, 2, physical(0u16.wrapping_sub(i), 0x0010), &(0x1000 + i).to_le_bytes());
    }
    let (time, counter) = send(&mut segment, 14, physical(0x1000, 0x0910), &[0; 8]);
    assert_eq!((time, counter), (1_000u64.to_le_bytes().to_vec(), 3));
}

#[test]
fn object_is_read_through_the_mailbox() {
    let mut segment = addressed(1);
    send(&mut segment, 5, physical(0x1000, 0x0120), &[2, 0]);
    let mut request = [0; 0x80];
    request[..12].copy_from_slice(&[10, 0, 0, 0, 0, 0x13, 0, 0x20, 0x40, 0x12, 0x1C, 1]);
    assert_eq!(send(&mut segment, 4, physical(0x1000, 0x1080), &[0; 0x80]).1, 0, "nothing to read yet");
    assert_eq!(send(&mut segment, 5, physical(0x1000, 0x1000), &request).1, 1);
    assert_eq!(send(&mut segment, 4, physical(0x1000, 0x080D), &[0]).0, [0x08]);
    let (answer, counter) = send(&mut segment, 4, physical(0x1000, 0x1080), &[0; 0x80]);
    // Expedited, two bytes: 0x1600.
    assert_eq!((&answer[5..16], counter), (&[0x13, 0, 0x30, 0x4B, 0x12, 0x1C, 1, 0x00, 0x16, 0, 0][..], 1));
    assert_eq!(send(&mut segment, 4, physical(0x1000, 0x080D), &[0]).0, [0]);
}

proptest! {
    #[test]
    fn no_frame_panics(
        datagrams in prop::collection::vec((0..16u8, any::<u32>(), prop::collection::vec(any::<u8>(), 0..200)), 1..5),
        places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        registers in prop::collection::vec(0..0x1200u16, 4),
    ) {
        let mut segment = addressed(2);
        let mut datagrams: Vec<_> = datagrams.iter().map(|(c, a, d)| (*c, *a, d.as_slice())).collect();
        // Half of them reach a register of the first device.
        for (datagram, register) in datagrams.iter_mut().zip(&registers).step_by(2) {
            datagram.1 = physical(0x1000, *register);
        }
        let mut bytes = frame(&datagrams);
        segment.pass(Nanos(5), &mut bytes.clone());
        for (place, byte) in places {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        segment.pass(Nanos(6), &mut bytes);
        segment.garble = 3;
        for length in [0, 10, 15, 16, 20, bytes.len() / 2] {
            segment.pass(Nanos(7), &mut bytes[..length]);
        }
        segment.idle(Nanos::from_millis(1000));
    }
}
