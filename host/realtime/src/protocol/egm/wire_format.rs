//! The subset of the protobuf wire format that EGM needs; allocates nothing, no recursion.

/// Greatest length of a written message.
pub const MAX_MESSAGE: usize = 1024;

/// The bytes are not the expected protobuf message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProtobufError;

/// A field's value on the wire.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum WireValue<'a> {
    /// Whole numbers, flags, enumerations.
    Varint(u64),
    /// A double, as bits.
    Fixed64(u64),
    /// Four bytes; EGM has none.
    Fixed32(u32),
    /// A message, or packed numbers.
    Bytes(&'a [u8]),
}

impl<'a> WireValue<'a> {
    /// Returns an integer of 32 bits.
    ///
    /// # Errors
    /// If the value has another type.
    pub fn u32(self) -> Result<u32, ProtobufError> {
        match self {
            Self::Varint(value) => u32::try_from(value).map_err(|_| ProtobufError),
            _ => Err(ProtobufError),
        }
    }

    /// Returns a finite number.
    ///
    /// # Errors
    /// If the value has another type, is infinite or not a number.
    pub fn f64(self) -> Result<f64, ProtobufError> {
        match self {
            Self::Fixed64(bits) => Some(f64::from_bits(bits)).filter(|value| value.is_finite()).ok_or(ProtobufError),
            _ => Err(ProtobufError),
        }
    }

    /// Returns the fields of an embedded message.
    ///
    /// # Errors
    /// If the value has another type.
    pub fn message(self) -> Result<Fields<'a>, ProtobufError> {
        match self {
            Self::Bytes(bytes) => Ok(Fields(bytes)),
            _ => Err(ProtobufError),
        }
    }
}

/// Iterates over the fields of a message.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    /// Returns the next field's number and value; `None` at the end.
    ///
    /// # Errors
    /// If the bytes are truncated or invalid.
    pub fn field(&mut self) -> Result<Option<(u32, WireValue<'a>)>, ProtobufError> {
        if self.0.is_empty() {
            return Ok(None);
        }
        let key = self.varint()?;
        let number = u32::try_from(key >> 3).ok().filter(|&number| number > 0).ok_or(ProtobufError)?;
        let value = match key & 7 {
            0 => WireValue::Varint(self.varint()?),
            1 => WireValue::Fixed64(u64::from_le_bytes(self.word()?)),
            2 => {
                let length = usize::try_from(self.varint()?).map_err(|_| ProtobufError)?;
                WireValue::Bytes(self.take(length)?)
            }
            5 => WireValue::Fixed32(u32::from_le_bytes(self.word()?)),
            // Protobuf has deprecated groups.
            _ => return Err(ProtobufError),
        };
        Ok(Some((number, value)))
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], ProtobufError> {
        let (taken, rest) = self.0.split_at_checked(length).ok_or(ProtobufError)?;
        self.0 = rest;
        Ok(taken)
    }

    fn word<const N: usize>(&mut self) -> Result<[u8; N], ProtobufError> {
        self.take(N)?.try_into().map_err(|_| ProtobufError)
    }

    fn varint(&mut self) -> Result<u64, ProtobufError> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let [byte] = self.word()?;
            let part = u64::from(byte & 0x7F);
            // The tenth byte holds one bit.
            if shift == 63 && part > 1 {
                return Err(ProtobufError);
            }
            value |= part << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(ProtobufError)
    }
}

/// A few numbers: the `repeated double` of a message, up to `N`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers<const N: usize> {
    values: [f64; N],
    length: usize,
}

impl<const N: usize> Default for Numbers<N> {
    fn default() -> Self {
        Self { values: [0.0; N], length: 0 }
    }
}

impl<const N: usize> Numbers<N> {
    /// Creates a list; drops numbers beyond `N`.
    pub fn of(values: &[f64]) -> Self {
        let length = values.len().min(N);
        let values = std::array::from_fn(|index| values.get(index).copied().unwrap_or(0.0));
        Self { values, length }
    }

    /// Returns the numbers.
    pub fn as_slice(&self) -> &[f64] {
        &self.values[..self.length]
    }

    /// Adds one number, or a packed run of them.
    ///
    /// # Errors
    /// If there are more than `N`, or one is not finite.
    pub fn take(&mut self, value: WireValue) -> Result<(), ProtobufError> {
        match value {
            WireValue::Bytes(packed) => {
                let (words, rest) = packed.as_chunks::<8>();
                for &word in words {
                    self.push(WireValue::Fixed64(u64::from_le_bytes(word)))?;
                }
                if rest.is_empty() { Ok(()) } else { Err(ProtobufError) }
            }
            single => self.push(single),
        }
    }

    fn push(&mut self, value: WireValue) -> Result<(), ProtobufError> {
        let place = self.values.get_mut(self.length).ok_or(ProtobufError)?;
        *place = value.f64()?;
        self.length += 1;
        Ok(())
    }
}

/// A message under construction.
pub struct Message {
    bytes: [u8; MAX_MESSAGE],
    length: usize,
    overflown: bool,
}

impl Default for Message {
    fn default() -> Self {
        Self { bytes: [0; MAX_MESSAGE], length: 0, overflown: false }
    }
}

impl Message {
    /// Returns the bytes to send; `None` if they do not fit.
    pub fn as_bytes(&self) -> Option<&[u8]> {
        (!self.overflown).then(|| &self.bytes[..self.length])
    }

    fn put(&mut self, bytes: &[u8]) {
        match self.bytes.get_mut(self.length..self.length + bytes.len()) {
            Some(place) => {
                place.copy_from_slice(bytes);
                self.length += bytes.len();
            }
            None => self.overflown = true,
        }
    }

    fn put_varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.put(&[value as u8 | 0x80]);
            value >>= 7;
        }
        self.put(&[value as u8]);
    }

    fn put_key(&mut self, number: u32, kind: u64) {
        self.put_varint(u64::from(number) << 3 | kind);
    }

    /// Adds an integer, flag or enumeration.
    pub fn number(&mut self, number: u32, value: u64) {
        self.put_key(number, 0);
        self.put_varint(value);
    }

    /// Adds a double.
    pub fn double(&mut self, number: u32, value: f64) {
        self.put_key(number, 1);
        self.put(&value.to_le_bytes());
    }

    /// Adds doubles one by one, as proto2 writes them.
    pub fn doubles(&mut self, number: u32, values: &[f64]) {
        values.iter().for_each(|&value| self.double(number, value));
    }

    /// Adds an embedded message.
    pub fn message(&mut self, number: u32, fill: impl FnOnce(&mut Self)) {
        let mut inner = Self::default();
        fill(&mut inner);
        self.put_key(number, 2);
        self.put_varint(inner.length as u64);
        self.put(&inner.bytes[..inner.length]);
        self.overflown |= inner.overflown;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_fields() {
        let mut message = Message::default();
        message.number(1, 300);
        message.message(2, |inner| inner.doubles(1, &[1.0]));
        let golden = [0x08, 0xAC, 0x02, 0x12, 9, 0x09, 0, 0, 0, 0, 0, 0, 0xF0, 0x3F];
        assert_eq!(message.as_bytes(), Some(&golden[..]));
        let mut fields = Fields(&golden);
        assert_eq!(fields.field(), Ok(Some((1, WireValue::Varint(300)))));
        assert_eq!(fields.field(), Ok(Some((2, WireValue::Bytes(&golden[5..])))));
        assert_eq!(fields.field(), Ok(None));
    }

    #[test]
    fn truncated_and_invalid_fields_are_refused() {
        for bytes in [&[0x08][..], &[0x09, 1], &[0x12, 5, 1], &[0x00, 1], &[0x0B], &[0x08, 0x80], &[0xFF; 12]] {
            assert_eq!(Fields(bytes).field(), Err(ProtobufError), "{bytes:?}");
        }
        let longest = [0x08, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x01];
        assert_eq!(Fields(&longest).field(), Ok(Some((1, WireValue::Varint(u64::MAX)))));
    }

    #[test]
    fn surplus_and_non_finite_numbers_are_refused() {
        let mut numbers = Numbers::<2>::default();
        assert_eq!(numbers.take(WireValue::Bytes(&[0; 16])), Ok(()));
        assert_eq!(numbers.take(WireValue::Fixed64(0)), Err(ProtobufError));
        assert_eq!(Numbers::<2>::default().take(WireValue::Bytes(&[0; 15])), Err(ProtobufError));
        assert_eq!(Numbers::<2>::default().take(WireValue::Fixed64(f64::NAN.to_bits())), Err(ProtobufError));
    }

    proptest! {
        #[test]
        fn numbers_return(number in 1..100_000u32, value: u64, double: f64) {
            let mut message = Message::default();
            message.number(number, value);
            message.double(number, double);
            let mut fields = Fields(message.as_bytes().unwrap());
            prop_assert_eq!(fields.field(), Ok(Some((number, WireValue::Varint(value)))));
            prop_assert_eq!(fields.field(), Ok(Some((number, WireValue::Fixed64(double.to_bits())))));
        }
    }
}
