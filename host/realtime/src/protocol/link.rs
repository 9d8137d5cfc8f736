//! What all drivers share: whose datagrams count, and the newest of several that wait.

use crate::signals::LinkCounters;
use crate::time::Nanos;
use crate::wire::{MAX_DATAGRAM, Port};
use std::io;
use std::net::{IpAddr, SocketAddr};

/// A deadline long gone: take what is there, wait for nothing.
pub(crate) const AT_ONCE: Nanos = Nanos(i64::MIN / 2);

/// Most datagrams taken in one call, so that a flood cannot hold the cycle; more than a socket's default queue holds.
const MAX_QUEUED: usize = 1024;

/// The other side: who it may be, and who it is since its first good datagram.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Peer {
    expected: Option<IpAddr>,
    address: Option<SocketAddr>,
}

impl Peer {
    /// Anybody, or only the host at `expected`.
    pub(crate) fn new(expected: Option<IpAddr>) -> Self {
        Self { expected, address: None }
    }

    /// Only this address.
    pub(crate) fn at(address: SocketAddr) -> Self {
        Self { expected: None, address: Some(address) }
    }

    /// Whether a datagram from there counts.
    pub(crate) fn admits(&self, from: SocketAddr) -> bool {
        self.address.map_or(self.expected.is_none_or(|host| host == from.ip()), |known| known == from)
    }

    /// From now on it is nobody else.
    pub(crate) fn settle(&mut self, address: SocketAddr) {
        self.address.get_or_insert(address);
    }

    /// Where to answer.
    pub(crate) fn address(&self) -> Option<SocketAddr> {
        self.address
    }
}

/// The newest datagram that `accept` takes, waiting for the first until `deadline`, and how many it has taken.
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

/// How far a 32-bit count has come since an earlier one; negative if it has gone back. Right across the wrap.
pub(crate) fn progress(from: u32, to: u32) -> i32 {
    to.wrapping_sub(from) as i32
}

/// Largest gap in a count of messages that is believed: 40 s at 4 ms, longer than any session waits.
const MAX_GAP: i32 = 10_000;

/// The count and the time that a robot's messages carry, followed message by message.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Succession {
    /// Count and time \[ms\] of the last message.
    last: Option<(u32, u32)>,
    /// Time of the controller, unwrapped.
    pub(crate) stamp: Nanos,
}

impl Succession {
    /// Whether a message is newer than the last one and believable; counts those that are not, and those between.
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
