//! Common parts of all drivers: acceptance of senders, and selection of the newest waiting datagram.

use crate::signals::LinkCounters;
use crate::time::Nanos;
use crate::wire::{MAX_DATAGRAM, Port};
use std::io;
use std::net::{IpAddr, SocketAddr};

/// A past deadline: takes waiting datagrams without waiting for others.
pub(crate) const AT_ONCE: Nanos = Nanos(i64::MIN / 2);

/// Greatest number of datagrams taken in one call, so that a flood cannot block the cycle; exceeds a socket's default
/// queue.
const MAX_QUEUED: usize = 1024;

/// The other side: the accepted host, and the address of its first valid datagram.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer {
    expected: Option<IpAddr>,
    address: Option<SocketAddr>,
}

impl Peer {
    /// Accepts any host, or only `expected`.
    pub(crate) fn new(expected: Option<IpAddr>) -> Self {
        Self { expected, address: None }
    }

    /// Accepts this address only.
    pub(crate) fn at(address: SocketAddr) -> Self {
        Self { expected: None, address: Some(address) }
    }

    /// Whether a datagram from this address is accepted.
    pub(crate) fn admits(&self, from: SocketAddr) -> bool {
        self.address.map_or(self.expected.is_none_or(|host| host == from.ip()), |known| known == from)
    }

    /// Fixes the sender: from now on only this address is accepted.
    pub(crate) fn settle(&mut self, address: SocketAddr) {
        self.address.get_or_insert(address);
    }

    /// Returns the address for answers.
    pub(crate) fn address(&self) -> Option<SocketAddr> {
        self.address
    }
}

/// Returns the newest datagram that `accept` takes, waiting for the first until `deadline`, and the number taken.
///
/// # Errors
/// If the network interface fails.
pub(crate) fn newest<T>(
    port: &mut impl Port,
    deadline: Nanos,
    mut accept: impl FnMut(&[u8], SocketAddr, Nanos) -> Option<T>,
) -> io::Result<(Option<T>, u64)> {
    let mut buffer = [0; MAX_DATAGRAM];
    let (mut newest, mut taken) = (None, 0);
    for _ in 0..MAX_QUEUED {
        let until = if taken == 0 { deadline } else { AT_ONCE };
        let Some((length, from)) = port.receive(&mut buffer, until)? else {
            break;
        };
        if let Some(message) = accept(&buffer[..length], from, port.arrived()) {
            newest = Some(message);
            taken += 1;
        }
    }
    Ok((newest, taken))
}

/// Returns the increase of a 32-bit count since an earlier one, negative for a decrease; handles the wrap.
pub(crate) fn progress(from: u32, to: u32) -> i32 {
    to.wrapping_sub(from) as i32
}

/// Greatest accepted gap in a message count: 40 s at 4 ms, longer than any session waits.
const MAX_GAP: i32 = 10_000;

/// Message count and time of a robot, tracked message by message.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Succession {
    /// Count and time \[ms\] of the last message.
    last: Option<(u32, u32)>,
    /// Unwrapped time of the controller.
    pub(crate) stamp: Nanos,
}

impl Succession {
    /// Whether a message is newer than the last one and plausible; counts the others, and the gaps.
    pub(crate) fn admits(&mut self, sequence: u32, time_ms: u32, counters: &mut LinkCounters) -> bool {
        let Some((last, time)) = self.last else {
            (self.last, self.stamp) = (Some((sequence, time_ms)), Nanos::from_millis(i64::from(time_ms)));
            return true;
        };
        let gap = progress(last, sequence);
        if gap <= 0 {
            counters.stale += 1;
            return false;
        }
        if gap > MAX_GAP {
            counters.malformed += 1;
            return false;
        }
        counters.lost += gap as u64 - 1;
        self.stamp += Nanos::from_millis(i64::from(progress(time, time_ms)));
        self.last = Some((sequence, time_ms));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_wrap() {
        assert_eq!(progress(u32::MAX, 2), 3);
        assert_eq!(progress(2, u32::MAX), -3);
        assert_eq!(progress(7, 7), 0);
    }
}
