//! A relay that injects network faults into a stream of datagrams: loss, delay, reordering, duplication, corruption.

use crate::time::Nanos;

/// The links of a facility.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// Robot 1.
    Robot1,
    /// Robot 2.
    Robot2,
    /// The sensor.
    Sensor,
}

/// Direction of a datagram.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the facility to us.
    Report,
    /// From us to the facility.
    Answer,
}

/// Fault of a datagram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Loss.
    Lose,
    /// Delay.
    Delay(Nanos),
    /// Duplication, the copy delayed.
    Duplicate(Nanos),
    /// Reordering: sent after the next one.
    Exchange,
    /// Corruption of some bits.
    Corrupt,
    /// Forged sender.
    Impostor,
}

/// A fault of a link for a time; applies to every n-th datagram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelayRule {
    /// The link.
    pub endpoint: Endpoint,
    /// The direction.
    pub direction: Direction,
    /// Begin.
    pub from: Nanos,
    /// End.
    pub until: Nanos,
    /// Period n, at least 1.
    pub every: u32,
    /// Fault.
    pub fault: Fault,
}

/// A datagram in transit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Passing {
    /// Transit time.
    pub delay: Nanos,
    /// Its content.
    pub bytes: Vec<u8>,
    /// Whether its sender is forged.
    pub impostor: bool,
}

/// The relay.
#[derive(Clone, Debug, Default)]
pub struct Relay {
    rules: Vec<(RelayRule, u32)>,
    waiting: Vec<(Endpoint, Direction, Vec<u8>)>,
    dice: u64,
}

impl Relay {
    /// Creates a relay with scheduled faults.
    pub fn new(rules: impl IntoIterator<Item = RelayRule>) -> Self {
        Self { rules: rules.into_iter().map(|rule| (rule, 0)).collect(), waiting: Vec::new(), dice: 1 }
    }

    /// Adds a fault.
    pub fn add(&mut self, rule: RelayRule) {
        self.rules.push((rule, 0));
    }

    /// Returns the datagrams that follow from one: none, one or two.
    pub fn pass(&mut self, now: Nanos, endpoint: Endpoint, direction: Direction, datagram: &[u8]) -> Vec<Passing> {
        let plain = |bytes: Vec<u8>| Passing { delay: Nanos(0), bytes, impostor: false };
        let fault = self.due(now, endpoint, direction);
        if fault == Some(Fault::Exchange) {
            self.waiting.push((endpoint, direction, datagram.to_vec()));
            return Vec::new();
        }
        let mut out = match fault {
            Some(Fault::Lose) => Vec::new(),
            Some(Fault::Delay(delay)) => vec![Passing { delay, ..plain(datagram.to_vec()) }],
            Some(Fault::Duplicate(delay)) => {
                vec![plain(datagram.to_vec()), Passing { delay, ..plain(datagram.to_vec()) }]
            }
            Some(Fault::Corrupt) => vec![plain(self.damaged(datagram))],
            Some(Fault::Impostor) => vec![Passing { impostor: true, ..plain(datagram.to_vec()) }],
            Some(Fault::Exchange) | None => vec![plain(datagram.to_vec())],
        };
        while let Some(i) = self.waiting.iter().position(|(e, w, _)| (*e, *w) == (endpoint, direction)) {
            out.push(plain(self.waiting.remove(i).2));
        }
        out
    }

    /// Returns the fault that applies to a link now.
    fn due(&mut self, now: Nanos, endpoint: Endpoint, direction: Direction) -> Option<Fault> {
        let mut due = None;
        for (rule, count) in &mut self.rules {
            if (rule.endpoint, rule.direction) == (endpoint, direction) && (rule.from..rule.until).contains(&now) {
                if *count % rule.every == 0 {
                    due = due.or(Some(rule.fault));
                }
                *count += 1;
            }
        }
        due
    }

    /// Corrupts bits of a datagram; deterministic for a relay.
    fn damaged(&mut self, datagram: &[u8]) -> Vec<u8> {
        let mut bytes = datagram.to_vec();
        for _ in 0..3 {
            self.dice = self.dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let place = (self.dice >> 33) as usize;
            if let Some(byte) = bytes.get_mut(place % datagram.len().max(1)) {
                *byte ^= 1 << ((self.dice >> 29) & 7);
            }
        }
        bytes
    }
}
