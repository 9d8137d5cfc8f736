//! Deterministic damage to bytes.

/// A stream of numbers that is the same on every machine (SplitMix64).
pub(crate) struct Stream(u64);

impl Stream {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0xD1B5_4A32_D192_ED03)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A whole number below a bound; 0 if the bound is 0.
    pub(crate) fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound.max(1) as u64) as usize
    }

    pub(crate) fn choose<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }
}

/// What stands in the place of a number.
const NUMBERS: [&str; 22] = [
    "0",
    "-1",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "9223372036854775807",
    "18446744073709551616",
    "-9223372036854775808",
    "1e400",
    "0.0000000001",
    "4294967296",
    "65536",
    "1000000000",
    "true",
    "\"\"",
    "[]",
    "{}",
    "1_0",
    "0x7fffffffffffffff",
];

/// Damages bytes in one to three ways.
pub(crate) fn mutate(bytes: &[u8], stream: &mut Stream) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..1 + stream.below(3) {
        out = once(out, stream);
    }
    out
}

fn once(mut bytes: Vec<u8>, stream: &mut Stream) -> Vec<u8> {
    let length = bytes.len();
    let span = |stream: &mut Stream| {
        let start = stream.below(length + 1);
        let most = stream.choose(&[4, 40, 400, 4000]);
        let size = 1 + stream.below(most);
        start..(start + size).min(length)
    };
    match stream.below(10) {
        0 | 1 if length > 0 => {
            for _ in 0..1 + stream.below(4) {
                let at = stream.below(length);
                bytes[at] ^= 1 << stream.below(8);
            }
            bytes
        }
        2 => {
            bytes.truncate(stream.below(length + 1));
            bytes
        }
        3 => {
            let copied = bytes[span(stream)].to_vec();
            let at = stream.below(length + 1);
            bytes.splice(at..at, copied);
            bytes
        }
        4 => {
            bytes.drain(span(stream));
            bytes
        }
        5 | 6 => number_replaced(bytes, stream),
        7 => {
            let depth = stream.choose(&[1, 3, 70, 1_000, 20_000]);
            let opening = stream.choose(&["[", "{", "{a=", "(", "<a>", "\"", "[[", "-", "a.", "{\"a\":", "\n", ","]);
            let at = stream.below(length + 1);
            bytes.splice(at..at, opening.repeat(depth).into_bytes());
            bytes
        }
        8 => lines_swapped(&bytes, stream),
        _ => {
            let span = span(stream);
            for at in span {
                bytes[at] = stream.choose(&[0, 0xFF, b'"', b'\n', b'9', b'\\', 0x80, b' ']);
            }
            bytes
        }
    }
}

/// Puts an extreme in the place of a number of a text; changes a byte where there is none.
fn number_replaced(mut bytes: Vec<u8>, stream: &mut Stream) -> Vec<u8> {
    let starts: Vec<usize> = (0..bytes.len())
        .filter(|at| bytes[*at].is_ascii_digit() && (*at == 0 || !bytes[at - 1].is_ascii_alphanumeric()))
        .collect();
    if starts.is_empty() {
        return bytes;
    }
    let start = stream.choose(&starts);
    let is_number = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'e' | b'-' | b'+');
    let end = start + bytes[start..].iter().take_while(|byte| is_number(byte)).count();
    bytes.splice(start..end, stream.choose(&NUMBERS).bytes());
    bytes
}

fn lines_swapped(bytes: &[u8], stream: &mut Stream) -> Vec<u8> {
    let mut lines: Vec<&[u8]> = bytes.split(|byte| *byte == b'\n').collect();
    for _ in 0..1 + stream.below(3) {
        let (one, two) = (stream.below(lines.len()), stream.below(lines.len()));
        lines.swap(one, two);
    }
    lines.join(&b'\n')
}

/// States the hash of its own bytes in a Parquet file of softdock again, so that readers get behind that check.
pub(crate) fn sealed_again(mut bytes: Vec<u8>) -> Vec<u8> {
    const DIGITS: usize = 64;
    let key = softdock_results::FILE_HASH.as_bytes();
    let Some(at) = bytes.windows(key.len()).rposition(|window| window == key) else { return bytes };
    let from = at + key.len();
    let is_hash = |start: &usize| {
        bytes.get(*start..start + DIGITS).is_some_and(|digits| digits.iter().all(u8::is_ascii_hexdigit))
    };
    let Some(place) = (from..from + 8).find(is_hash) else { return bytes };
    bytes[place..place + DIGITS].fill(b'0');
    let hash = blake3::hash(&bytes).to_hex();
    bytes[place..place + DIGITS].copy_from_slice(hash.as_bytes());
    bytes
}
