//! Binary block of the page: arrays of numbers one behind the other, compressed and written as text.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::Serialize;
use std::io::Write;

/// Mantissa bits of a number that are kept: five significant decimal digits, which halve the size of the block.
const KEPT_BITS: u32 = 16;

/// Place of an array in the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Array {
    /// `f32`, `u8`, `f64` or `i16`; little-endian.
    kind: &'static str,
    /// First byte; a multiple of 8.
    offset: usize,
    /// Number of elements.
    length: usize,
}

/// Arrays one behind the other.
#[derive(Debug, Default)]
pub(crate) struct Block {
    bytes: Vec<u8>,
}

impl Block {
    fn push(&mut self, kind: &'static str, length: usize, bytes: impl IntoIterator<Item = u8>) -> Array {
        let offset = self.bytes.len().next_multiple_of(8);
        self.bytes.resize(offset, 0);
        self.bytes.extend(bytes);
        Array { kind, offset, length }
    }

    /// Appends numbers, rounded to five significant digits; NaN stands for a missing value.
    pub(crate) fn numbers(&mut self, values: &[f32]) -> Array {
        self.push("f32", values.len(), values.iter().flat_map(|value| rounded(*value).to_le_bytes()))
    }

    /// Appends numbers as they are.
    pub(crate) fn exact(&mut self, values: &[f32]) -> Array {
        self.push("f32", values.len(), values.iter().flat_map(|value| value.to_le_bytes()))
    }

    /// Appends whole numbers below 2^53.
    pub(crate) fn whole(&mut self, values: &[u64]) -> Array {
        self.push("f64", values.len(), values.iter().flat_map(|value| (*value as f64).to_le_bytes()))
    }

    /// Appends codes.
    pub(crate) fn codes(&mut self, values: &[u8]) -> Array {
        self.push("u8", values.len(), values.iter().copied())
    }

    /// Appends 16-bit integers.
    pub(crate) fn short(&mut self, values: &[i16]) -> Array {
        self.push("i16", values.len(), values.iter().flat_map(|value| value.to_le_bytes()))
    }

    /// Returns the block as gzip in base64; the same arrays give the same text.
    pub(crate) fn text(&self) -> String {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::new(7));
        let compressed = gzip.write_all(&self.bytes).and_then(|()| gzip.finish());
        STANDARD.encode(compressed.expect("a vector takes every byte"))
    }
}

/// Rounds to [`KEPT_BITS`] bits of mantissa, half up; what is not finite stays.
fn rounded(value: f32) -> f32 {
    const CUT: u32 = 23 - KEPT_BITS;
    if !value.is_finite() {
        return f32::NAN;
    }
    let bits = value.to_bits().saturating_add(1 << (CUT - 1)) & !((1 << CUT) - 1);
    let rounded = f32::from_bits(bits);
    if rounded.is_finite() { rounded } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_five_digits_and_missing_ones_are_nan() {
        for value in [1.0_f32, -0.123_456_79, 3.4e38, 1.2e-30, 0.0, 123_456.7] {
            let error = (rounded(value) - value).abs();
            assert!(error <= value.abs() * 1e-5, "{value}: {}", rounded(value));
        }
        assert!(rounded(f32::NAN).is_nan() && rounded(f32::INFINITY).is_nan());
    }

    #[test]
    fn arrays_begin_at_multiples_of_eight_bytes() {
        let mut block = Block::default();
        block.codes(&[1, 2, 3]);
        let whole = block.whole(&[7]);
        assert_eq!((whole.offset, whole.length), (8, 1));
        assert_eq!(block.bytes[8..], 7.0_f64.to_le_bytes());
        assert!(block.text().starts_with("H4sI"), "gzip");
    }
}
