//! Delay lines: rings of bundles that each lane reads at its own age.

use crate::fields::{Bundle, Sink, Source, fields};
use crate::lanes::{Lane, MOST_LANES};
use crate::plant::Plant;
use crate::quads::words;
use crate::range::MAX_DELAY_S;
use crate::space::{Parts, Wrench};
use std::marker::PhantomData;

/// Slots of a delay line: the span in ticks, and what interpolation and the newest entry need.
pub fn line_slots(plant: &Plant) -> usize {
    (MAX_DELAY_S / plant.timing.tick()).ceil() as usize + 4
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

/// A slot that is read by all lanes.
///
/// Here and in [`Mixed`] no closures: they would be functions of their own, without the instruction set of the lanes.
struct Stored<'a, L> {
    places: std::slice::Iter<'a, L>,
}

impl<L: Lane> Source<L> for Stored<'_, L> {
    #[inline(always)]
    fn next(&mut self) -> L {
        *self.places.next().expect("a slot as wide as the bundle")
    }
}

/// Slots that each lane reads on its own.
struct Mixed<'a, L> {
    values: &'a [L],
    slots: [usize; MOST_LANES],
    width: usize,
    field: usize,
}

impl<L: Lane> Source<L> for Mixed<'_, L> {
    #[inline(always)]
    fn next(&mut self) -> L {
        let mut own = [0.0; MOST_LANES];
        for (lane, own) in own.iter_mut().enumerate().take(L::WIDTH) {
            *own = self.values[self.slots[lane] * self.width + self.field].lane(lane);
        }
        self.field += 1;
        L::gather(|lane| own[lane])
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

    /// Reads the slot that is `back` slots before slot `newest`.
    #[inline(always)]
    pub(crate) fn at(&self, newest: usize, back: usize) -> B {
        let slot = (newest + self.slots - back) % self.slots;
        B::read(&mut Stored { places: self.values[slot * self.width..].iter() })
    }

    /// Reads for each lane the slot that is `back` slots, a whole number of 0 or more, before slot `newest`.
    #[inline(always)]
    pub(crate) fn recall(&self, newest: usize, back: L) -> B {
        let mut slots = [0; MOST_LANES];
        let mut same = true;
        for lane in 0..L::WIDTH {
            slots[lane] = (newest + self.slots - back.lane(lane) as usize) % self.slots;
            same &= slots[lane] == slots[0];
        }
        if same {
            return B::read(&mut Stored { places: self.values[slots[0] * self.width..].iter() });
        }
        B::read(&mut Mixed { values: &self.values, slots, width: self.width, field: 0 })
    }
}
