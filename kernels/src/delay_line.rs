//! Delay lines: rings of bundles that each lane reads at its own age.

use crate::fields::{Bundle, Sink, fields};
use crate::lanes::{Lane, MOST_LANES};
use crate::plant::Plant;
use crate::quads::words;
use crate::space::{Parts, Wrench};
use std::marker::PhantomData;

/// The longest dead time that the delay lines hold \[s\].
pub const LINE_SPAN: f64 = 0.128;

/// Slots of a delay line: the span in ticks, and what interpolation and the newest entry need.
pub fn line_slots(plant: &Plant) -> usize {
    (LINE_SPAN / plant.timing.tick()).ceil() as usize + 4
}

/// Where the numbers of so many slots lie in a lane's share of the kernel's delay lines: commands slot by slot, then
/// wrenches, each slot in vectors of its own.
pub fn line_places(slots: usize) -> Vec<usize> {
    let (command, wrench) = (fields::<f64, Parts<f64>>().len(), fields::<f64, Wrench<f64>>().len());
    let line = |from: usize, width: usize| {
        (0..slots).flat_map(move |slot| (0..width).map(move |number| from + slot * words(width) + number))
    };
    line(0, command).chain(line(slots * words(command), wrench)).collect()
}

/// A ring of bundles, one value per lane, that each lane may read at its own age.
pub(crate) struct Line<L, B> {
    values: Vec<L>,
    slots: usize,
    width: usize,
    bundle: PhantomData<B>,
}

/// A slot that is written where the mask holds.
struct Slot<'a, L: Lane> {
    places: std::slice::IterMut<'a, L>,
    mask: L::Mask,
}

impl<L: Lane> Sink<L> for Slot<'_, L> {
    #[inline(always)]
    fn put(&mut self, value: L) {
        let place = self.places.next().expect("a slot as wide as the bundle");
        *place = L::select(self.mask, value, *place);
    }
}

impl<L: Lane, B: Bundle<L>> Line<L, B> {
    /// An empty ring.
    pub(crate) fn new(slots: usize) -> Self {
        let width = fields::<L, B>().len();
        Self { values: vec![L::lit(0.0); slots * width], slots, width, bundle: PhantomData }
    }

    /// Writes slot `slot` where the mask holds.
    #[inline(always)]
    pub(crate) fn put(&mut self, slot: usize, value: &B, mask: L::Mask) {
        let places = self.values[slot * self.width..].iter_mut();
        value.write(&mut Slot { places, mask });
    }

    /// Reads for each lane the slot that is `back(lane)` slots before slot `newest`.
    #[inline(always)]
    pub(crate) fn recall(&self, newest: usize, back: impl Fn(usize) -> usize) -> B {
        let mut slots = [0; MOST_LANES];
        for (lane, slot) in slots.iter_mut().enumerate().take(L::WIDTH) {
            *slot = (newest + self.slots - back(lane)) % self.slots;
        }
        let first = slots[0];
        let mut field = 0;
        if slots[..L::WIDTH].iter().all(|slot| *slot == first) {
            return B::read(&mut || {
                field += 1;
                self.values[first * self.width + field - 1]
            });
        }
        B::read(&mut || {
            let value = L::gather(|lane| self.values[slots[lane] * self.width + field].lane(lane));
            field += 1;
            value
        })
    }
}
