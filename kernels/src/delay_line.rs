//! Delay lines: rings of bundles that each lane reads at its own age.

use crate::fields::{Bundle, fields};
use crate::lanes::Lane;
use crate::plant::Plant;

/// More lanes than any lane type has.
const MOST_LANES: usize = 64;

/// The longest dead time that the delay lines hold \[s\].
pub const LINE_SPAN: f64 = 0.128;

/// Slots of a delay line: the span in ticks, and what interpolation and the newest entry need.
pub fn line_slots(plant: &Plant) -> usize {
    (LINE_SPAN / plant.timing.tick()).ceil() as usize + 4
}

/// A ring of bundles, one value per lane, that each lane may read at its own age.
pub(crate) struct Line<B> {
    values: Vec<f64>,
    slots: usize,
    width: usize,
    bundle: std::marker::PhantomData<B>,
}

impl<B> Line<B> {
    /// An empty ring.
    pub(crate) fn new<L: Lane>(slots: usize) -> Self
    where
        B: Bundle<L>,
    {
        let width = fields::<L, B>().len();
        Self { values: vec![0.0; slots * width * L::WIDTH], slots, width, bundle: std::marker::PhantomData }
    }

    /// Writes slot `slot` where the mask holds.
    #[inline(always)]
    pub(crate) fn put<L: Lane>(&mut self, slot: usize, value: &B, mask: L::Mask)
    where
        B: Bundle<L>,
    {
        let mut index = slot * self.width * L::WIDTH;
        value.write(&mut |scalar: L| {
            for lane in 0..L::WIDTH {
                if L::holds(mask, lane) {
                    self.values[index + lane] = scalar.lane(lane);
                }
            }
            index += L::WIDTH;
        });
    }

    /// Reads for each lane the slot that is `back(lane)` slots before slot `newest`.
    #[inline(always)]
    pub(crate) fn recall<L: Lane>(&self, newest: usize, back: impl Fn(usize) -> usize) -> B
    where
        B: Bundle<L>,
    {
        let mut starts = [0; MOST_LANES];
        for (lane, start) in starts.iter_mut().enumerate().take(L::WIDTH) {
            *start = (newest + self.slots - back(lane)) % self.slots * self.width;
        }
        let mut field = 0;
        B::read(&mut || {
            let value = L::gather(|lane| self.values[(starts[lane] + field) * L::WIDTH + lane]);
            field += 1;
            value
        })
    }
}
