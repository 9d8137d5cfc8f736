//! Seeded mutations of valid messages: noise, bugs and malicious input.

/// SplitMix64: the same sequence on every machine.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        word ^ (word >> 31)
    }

    /// Returns a number below `end`; 0 if that is 0.
    pub(super) fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }

    /// Returns arbitrary bits as a number, occasionally a small one.
    pub(super) fn wild_number(&mut self) -> f64 {
        let word = self.next();
        if word & 1 == 0 { f64::from_bits(self.next()) } else { (word >> 32) as i32 as f64 * 1e-6 }
    }
}

/// Greatest length of a mutated message; exceeds the length that a port takes.
const MAX_LENGTH: usize = 4096;

const TEXTS: [&[u8]; 22] = [
    b"nan",
    b"NaN",
    b"inf",
    b"-Infinity",
    b"1e999",
    b"-1e308",
    b"1e-999",
    b"99999999999999999999999999999999",
    b"18446744073709551615",
    b"9223372036854775807",
    b"-1",
    b"0x10",
    b"",
    b".",
    b"--1",
    b"1,5",
    b"<a>",
    b"</Rob>",
    b"\"",
    b"<!--",
    b"&lt;",
    b"\xF0\x28\x8C\x28",
];

const WORDS: [[u8; 8]; 12] = [
    [0x7F, 0xC0, 0, 0, 0x7F, 0xC0, 0, 0],
    [0x7F, 0x80, 0, 0, 0xFF, 0x80, 0, 0],
    [0x7F, 0xF8, 0, 0, 0, 0, 0, 0],
    [0x7F, 0xF0, 0, 0, 0, 0, 0, 0],
    [0, 0, 0, 0, 0, 0, 0xF8, 0x7F],
    [0, 0, 0, 0, 0, 0, 0xF0, 0xFF],
    [0x7F, 0x7F, 0xFF, 0xFF, 0x7F, 0xEF, 0xFF, 0xFF],
    [0xFF; 8],
    [0; 8],
    [0x7F, 0xFF, 0xFF, 0xFF, 0x80, 0, 0, 0],
    [0x0A, 0x7F, 0x0A, 0x7E, 0x0A, 0x7D, 0x0A, 0x7C],
    [0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x01],
];

/// Returns a mutation of one of the valid messages.
pub(super) fn mutate(message: &mut Vec<u8>, valid: &[Vec<u8>], random: &mut Random) {
    message.clear();
    message.extend_from_slice(&valid[random.below(valid.len())]);
    for _ in 0..=random.below(3) {
        change(message, valid, random);
    }
    message.truncate(MAX_LENGTH);
}

fn change(message: &mut Vec<u8>, valid: &[Vec<u8>], random: &mut Random) {
    let place = random.below(message.len() + 1);
    let until = (place + random.below(24)).min(message.len());
    match random.below(12) {
        0 | 1 => {
            if let Some(byte) = message.get_mut(place) {
                *byte ^= 1 << random.below(8);
            }
        }
        2 => {
            if let Some(byte) = message.get_mut(place) {
                *byte = random.next() as u8;
            }
        }
        3 => message.truncate(place),
        4 => drop(message.drain(place..until)),
        5 => {
            let part = message[place..until].to_vec();
            let times = 1 + random.below(3);
            (0..times).for_each(|_| drop(message.splice(place..place, part.iter().copied())));
        }
        6 => {
            // The begin of this message and the end of another.
            let other = &valid[random.below(valid.len())];
            message.truncate(place);
            message.extend_from_slice(&other[random.below(other.len())..]);
        }
        7 | 8 => change_digits(message, random),
        9 => {
            let text = TEXTS[random.below(TEXTS.len())];
            message.splice(place..until, text.iter().copied());
        }
        10 => {
            let word = WORDS[random.below(WORDS.len())];
            let end = (place + [4, 8][random.below(2)]).min(message.len());
            message[place..end].iter_mut().zip(word).for_each(|(byte, new)| *byte = new);
        }
        _ => {
            // Deep or long repetition: the same few bytes a thousand times.
            let part = [&b"<a>"[..], b"9", b"\x0A\xFF", b" ", b"<a b=\"1\">", b"\x80"][random.below(6)];
            let times = random.below(1000);
            message.splice(place..place, part.iter().copied().cycle().take(times * part.len()));
        }
    }
}

/// Replaces a decimal number of the text, or one of its digits.
fn change_digits(message: &mut Vec<u8>, random: &mut Random) {
    let start = random.below(message.len());
    let is_number = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-');
    let Some(begin) = message[start..].iter().position(is_number).map(|offset| start + offset) else {
        return;
    };
    let end = message[begin..].iter().position(|byte| !is_number(byte)).map_or(message.len(), |offset| begin + offset);
    if random.below(2) == 0 {
        message[begin] = b'0' + random.below(10) as u8;
    } else {
        let text = TEXTS[random.below(TEXTS.len())];
        message.splice(begin..end, text.iter().copied());
    }
}
