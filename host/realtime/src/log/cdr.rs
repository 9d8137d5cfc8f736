//! Common Data Representation, little-endian: the serialisation of ROS 2 messages (OMG DDS-RTPS 10, XCDR1).
//!
//! A number is aligned to a multiple of its size, counted from the end of the encapsulation header of four bytes.

/// Encapsulation header: little-endian, no options.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Writes messages into one reused buffer.
#[derive(Debug, Default)]
pub struct Encoder {
    bytes: Vec<u8>,
}

impl Encoder {
    /// Starts a message; the buffer keeps its capacity.
    pub fn start(&mut self) {
        self.bytes.clear();
        self.bytes.extend_from_slice(&HEADER);
    }

    /// Returns the message so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let filled = (self.bytes.len() - HEADER.len()).next_multiple_of(N) + HEADER.len();
        self.bytes.resize(filled, 0);
        self.bytes.extend_from_slice(&bytes);
    }

    /// Writes a `uint32`, or the length of a sequence.
    pub fn u32(&mut self, value: u32) {
        self.number(value.to_le_bytes());
    }

    /// Writes an `int32`.
    pub fn i32(&mut self, value: i32) {
        self.number(value.to_le_bytes());
    }

    /// Writes a `uint64`.
    pub fn u64(&mut self, value: u64) {
        self.number(value.to_le_bytes());
    }

    /// Writes an `int64`.
    pub fn i64(&mut self, value: i64) {
        self.number(value.to_le_bytes());
    }

    /// Writes a `float64`, bit by bit.
    pub fn f64(&mut self, value: f64) {
        self.number(value.to_le_bytes());
    }

    /// Writes a `string`: its length with the closing zero, its bytes, the zero.
    pub fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
    }
}

/// Reads a message; returns `None` instead of reading past the end of arbitrary bytes.
#[derive(Clone, Debug)]
pub struct Decoder<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Decoder<'a> {
    /// Opens a message of little-endian bytes.
    pub fn new(message: &'a [u8]) -> Option<Self> {
        let (header, body) = message.split_at_checked(HEADER.len())?;
        (header[..2] == HEADER[..2]).then_some(Self { body, at: 0 })
    }

    fn number<const N: usize>(&mut self) -> Option<[u8; N]> {
        let start = self.at.next_multiple_of(N);
        let bytes = self.body.get(start..start.checked_add(N)?)?;
        self.at = start + N;
        bytes.try_into().ok()
    }

    /// Reads a `uint32`, or the length of a sequence.
    pub fn u32(&mut self) -> Option<u32> {
        self.number().map(u32::from_le_bytes)
    }

    /// Reads an `int32`.
    pub fn i32(&mut self) -> Option<i32> {
        self.number().map(i32::from_le_bytes)
    }

    /// Reads a `uint64`.
    pub fn u64(&mut self) -> Option<u64> {
        self.number().map(u64::from_le_bytes)
    }

    /// Reads an `int64`.
    pub fn i64(&mut self) -> Option<i64> {
        self.number().map(i64::from_le_bytes)
    }

    /// Reads a `float64`, bit by bit.
    pub fn f64(&mut self) -> Option<f64> {
        self.number().map(f64::from_le_bytes)
    }

    /// Reads a `string`, without its closing zero.
    pub fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let bytes = self.body.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        std::str::from_utf8(bytes.strip_suffix(&[0])?).ok()
    }

    /// Whether the message is read to its end.
    pub fn is_empty(&self) -> bool {
        self.at == self.body.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A WrenchStamped as serialised by `rclcpp`: header, padding after the string, six doubles.
    #[test]
    fn golden_bytes() {
        let mut message = Encoder::default();
        message.start();
        message.i32(1_700_000_000);
        message.u32(5);
        message.string("ft");
        message.f64(1.0);
        message.f64(-0.0);
        let expected: [&[u8]; 7] = [
            &[0x00, 0x01, 0x00, 0x00],
            &[0x00, 0xf1, 0x53, 0x65],
            &[0x05, 0x00, 0x00, 0x00],
            &[0x03, 0x00, 0x00, 0x00, b'f', b't', 0x00],
            &[0x00],
            &[0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0xf0, 0x3f],
            &[0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80],
        ];
        assert_eq!(message.bytes(), expected.concat());
    }

    #[test]
    fn written_values_are_read_back() {
        let mut message = Encoder::default();
        message.start();
        message.string("a string");
        message.u64(u64::MAX);
        message.u32(7);
        message.i64(i64::MIN);
        message.i32(-3);
        message.f64(f64::MIN_POSITIVE);
        let mut read = Decoder::new(message.bytes()).expect("a header");
        assert_eq!(read.string(), Some("a string"));
        assert_eq!(read.u64(), Some(u64::MAX));
        assert_eq!(read.u32(), Some(7));
        assert_eq!(read.i64(), Some(i64::MIN));
        assert_eq!(read.i32(), Some(-3));
        assert!(!read.is_empty());
        assert_eq!(read.f64(), Some(f64::MIN_POSITIVE));
        assert!(read.is_empty());
        assert_eq!(read.f64(), None);
    }

    #[test]
    fn truncated_message_and_false_length_give_none() {
        let mut message = Encoder::default();
        message.start();
        message.string("text");
        for end in 0..message.bytes().len() {
            let text = Decoder::new(&message.bytes()[..end]).and_then(|mut read| read.string());
            assert_eq!(text, None, "{end} bytes");
        }
        assert_eq!(Decoder::new(&[0, 0, 0, 0]).map(|_| ()), None, "big-endian");
        let liar = [0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff];
        assert_eq!(Decoder::new(&liar).expect("a header").string(), None);
        let no_zero = [0, 1, 0, 0, 1, 0, 0, 0, b'x'];
        assert_eq!(Decoder::new(&no_zero).expect("a header").string(), None);
        let empty = [0, 1, 0, 0, 0, 0, 0, 0];
        assert_eq!(Decoder::new(&empty).expect("a header").string(), None);
    }
}
