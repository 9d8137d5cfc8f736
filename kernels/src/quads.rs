//! Numbers of a lane in the kernel's buffers: four to a vector, the vectors of neighbouring lanes side by side.
//!
//! A GPU fetches 16 bytes at once, and lavapipe makes branches of every access: LLVM's passes for coroutines, as which
//! that driver compiles a kernel, take a time that grows faster than the number of branches.

use std::fmt::Write;

/// Numbers in a vector.
const WIDTH: usize = 4;

/// Vectors that hold so many numbers.
pub fn quads(numbers: usize) -> usize {
    numbers.div_ceil(WIDTH)
}

/// Words that so many numbers take with what fills their last vector.
pub fn words(numbers: usize) -> usize {
    WIDTH * quads(numbers)
}

/// The word of a buffer that holds number `index` of a lane.
pub fn word(index: usize, lanes: usize, lane: usize) -> usize {
    WIDTH * (index / WIDTH * lanes + lane) + index % WIDTH
}

/// Statements that read numbers one after the other; `place` is the WGSL of a vector's place before the lane's.
pub fn reads(buffer: &str, numbers: usize, place: impl Fn(usize) -> String) -> String {
    let read = |quad| format!("    let quad_{quad} = {buffer}[({}) * batch.lanes + lane];\n", place(quad));
    (0..quads(numbers)).map(read).collect()
}

/// Number `index` of those that were [read](reads).
pub fn read(index: usize) -> String {
    format!("quad_{}.{}", index / WIDTH, ["x", "y", "z", "w"][index % WIDTH])
}

/// Statements that store values one after the other, with zeros behind the last.
pub fn stores(buffer: &str, values: &[String], place: impl Fn(usize) -> String) -> String {
    let mut out = String::new();
    for (quad, values) in values.chunks(WIDTH).enumerate() {
        let rest = ", 0.0".repeat(WIDTH - values.len());
        let _ =
            writeln!(out, "    {buffer}[({}) * batch.lanes + lane] = vec4f({}{rest});", place(quad), values.join(", "));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_every_lane_has_a_word_of_its_own() {
        let (numbers, lanes) = (10, 3);
        let mut taken = vec![false; words(numbers) * lanes];
        for (index, lane) in (0..numbers).flat_map(|index| (0..lanes).map(move |lane| (index, lane))) {
            assert!(!std::mem::replace(&mut taken[word(index, lanes, lane)], true), "{index} {lane}");
        }
        assert_eq!(taken.iter().filter(|taken| !**taken).count(), (words(numbers) - numbers) * lanes);
    }
}
