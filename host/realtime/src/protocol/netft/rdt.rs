//! The two messages of RDT, big-endian: a request of 8 bytes and a record of 36.

/// First word of a request.
const MAGIC: u16 = 0x1234;
/// Length of a request.
pub const REQUEST: usize = 8;
/// Length of a record.
pub const RECORD: usize = 36;

/// Status: an error bit is set.
pub const STATUS_ERROR: u32 = 0x8000_0000;
/// Status: a gauge is saturated.
pub const STATUS_SATURATED: u32 = 0x0002_0000;
/// Status: a threshold of the user was crossed; no error.
pub const STATUS_THRESHOLD: u32 = 0x0001_0000;

/// Command of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RdtCommand {
    /// Stop the stream.
    Stop,
    /// Stream records as they are measured.
    Stream,
    /// Stream records in batches.
    StreamBuffered,
    /// Reset crossed thresholds.
    ResetThresholds,
    /// Set the present load as zero.
    Bias,
}

impl RdtCommand {
    const CODES: [(Self, u16); 5] = [
        (Self::Stop, 0x0000),
        (Self::Stream, 0x0002),
        (Self::StreamBuffered, 0x0003),
        (Self::ResetThresholds, 0x0041),
        (Self::Bias, 0x0042),
    ];

    fn code(self) -> u16 {
        Self::CODES.iter().find(|(command, _)| *command == self).map_or(0, |&(_, code)| code)
    }
}

/// A request: a command, and the number of records after which the stream stops (0: never).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RdtRequest {
    /// Command.
    pub command: RdtCommand,
    /// Number of records; 0: endless.
    pub count: u32,
}

impl RdtRequest {
    /// Serialises the request.
    pub fn bytes(&self) -> [u8; REQUEST] {
        let mut bytes = [0; REQUEST];
        bytes[..2].copy_from_slice(&MAGIC.to_be_bytes());
        bytes[2..4].copy_from_slice(&self.command.code().to_be_bytes());
        bytes[4..].copy_from_slice(&self.count.to_be_bytes());
        bytes
    }

    /// Parses a request; `None` for other bytes or an unknown command.
    pub fn read(datagram: &[u8]) -> Option<Self> {
        let bytes: &[u8; REQUEST] = datagram.try_into().ok()?;
        let [m0, m1, c0, c1, count @ ..] = *bytes;
        let code = u16::from_be_bytes([c0, c1]);
        let (command, _) = RdtCommand::CODES.into_iter().find(|&(_, known)| known == code)?;
        (u16::from_be_bytes([m0, m1]) == MAGIC).then_some(Self { command, count: u32::from_be_bytes(count) })
    }
}

/// A record of the stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RdtRecord {
    /// Count of sent records: a gap is a lost datagram.
    pub rdt_sequence: u32,
    /// Count of measured samples: increases from record to record, usually by more than one.
    pub ft_sequence: u32,
    /// Status bits.
    pub status: u32,
    /// Fx, Fy, Fz, Tx, Ty, Tz \[counts\].
    pub counts: [i32; 6],
}

impl RdtRecord {
    /// Serialises the record.
    pub fn bytes(&self) -> [u8; RECORD] {
        let mut bytes = [0; RECORD];
        let header = [self.rdt_sequence, self.ft_sequence, self.status];
        let words = header.into_iter().map(u32::to_be_bytes).chain(self.counts.into_iter().map(i32::to_be_bytes));
        for (place, word) in bytes.chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word);
        }
        bytes
    }

    /// Parses a record; `None` if its length is wrong.
    pub fn read(datagram: &[u8]) -> Option<Self> {
        let bytes: &[u8; RECORD] = datagram.try_into().ok()?;
        let word = |index: usize| [bytes[4 * index], bytes[4 * index + 1], bytes[4 * index + 2], bytes[4 * index + 3]];
        Some(Self {
            rdt_sequence: u32::from_be_bytes(word(0)),
            ft_sequence: u32::from_be_bytes(word(1)),
            status: u32::from_be_bytes(word(2)),
            counts: std::array::from_fn(|axis| i32::from_be_bytes(word(3 + axis))),
        })
    }

    /// Whether a gauge is saturated.
    pub fn is_saturated(&self) -> bool {
        self.status & STATUS_SATURATED != 0
    }

    /// Whether the box reports an error other than saturation and a crossed threshold, each of which may set the bit of
    /// all errors too.
    pub fn is_invalid(&self) -> bool {
        let known = STATUS_SATURATED | STATUS_THRESHOLD;
        let explained = if self.status & known != 0 { known | STATUS_ERROR } else { 0 };
        self.status & !explained != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_requests() {
        let bytes = |command, count| RdtRequest { command, count }.bytes();
        assert_eq!(bytes(RdtCommand::Stream, 0), [0x12, 0x34, 0, 2, 0, 0, 0, 0]);
        assert_eq!(bytes(RdtCommand::Stop, 0), [0x12, 0x34, 0, 0, 0, 0, 0, 0]);
        assert_eq!(bytes(RdtCommand::Bias, 1), [0x12, 0x34, 0, 0x42, 0, 0, 0, 1]);
        assert_eq!(RdtRequest::read(&[0x12, 0x34, 0, 9, 0, 0, 0, 0]), None);
        assert_eq!(RdtRequest::read(&[0x12, 0x35, 0, 2, 0, 0, 0, 0]), None);
        assert_eq!(RdtRequest::read(&[0x12, 0x34, 0, 2]), None);
    }

    #[test]
    fn golden_record() {
        let record = RdtRecord { rdt_sequence: 1, ft_sequence: 0x0102_0304, status: 0, counts: [1, -1, 256, 0, 0, -2] };
        let golden = [
            0, 0, 0, 1, 1, 2, 3, 4, 0, 0, 0, 0, 0, 0, 0, 1, 255, 255, 255, 255, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0,
            255, 255, 255, 254,
        ];
        assert_eq!(record.bytes(), golden);
        assert_eq!(RdtRecord::read(&golden), Some(record));
        assert_eq!(RdtRecord::read(&golden[..35]), None);
    }

    #[test]
    fn status_bits() {
        let of = |status| RdtRecord { rdt_sequence: 0, ft_sequence: 0, status, counts: [0; 6] };
        let seen = |status| (of(status).is_saturated(), of(status).is_invalid());
        assert_eq!(seen(0), (false, false));
        assert_eq!(seen(STATUS_THRESHOLD), (false, false));
        assert_eq!(seen(STATUS_THRESHOLD | STATUS_ERROR), (false, false));
        assert_eq!(seen(STATUS_SATURATED | STATUS_ERROR), (true, false));
        assert_eq!(seen(STATUS_ERROR), (false, true));
        assert_eq!(seen(0x0010_0000 | STATUS_ERROR | STATUS_SATURATED), (true, true));
    }

    proptest! {
        #[test]
        fn records_return(rdt_sequence: u32, ft_sequence: u32, status: u32, counts: [i32; 6]) {
            let record = RdtRecord { rdt_sequence, ft_sequence, status, counts };
            prop_assert_eq!(RdtRecord::read(&record.bytes()), Some(record));
        }
    }
}
