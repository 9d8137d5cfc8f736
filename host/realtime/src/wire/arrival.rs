//! When a datagram reached the machine: the kernel's own time stamp, so that a process that was late knows it.

use crate::time::Nanos;
use std::os::fd::RawFd;

/// The `SIOCGSTAMPNS` request of `<asm-generic/sockios.h>`: time of the datagram taken last, on the calendar's clock.
const SIOCGSTAMPNS: libc::c_ulong = 0x8907;

/// Oldest time stamp that is believed: the calendar's clock may be set while a datagram waits.
const OLDEST: Nanos = Nanos::from_millis(1000);

fn calendar() -> Nanos {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a timespec of ours; the call writes it and keeps nothing.
    unsafe { libc::clock_gettime(libc::CLOCK_REALTIME, &raw mut time) };
    Nanos(time.tv_sec * 1_000_000_000 + time.tv_nsec)
}

/// When the datagram that was taken last from a socket arrived, on the monotonic clock whose time is `now`; `now` itself
/// if the kernel does not tell. The first call on a socket switches its time stamps on;
/// that may take the kernel a moment, in which it does not tell.
pub(super) fn of_last_datagram(socket: RawFd, now: Nanos) -> Nanos {
    let mut stamp = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a timespec of ours, which is what the request writes on 64-bit Linux.
    if unsafe { libc::ioctl(socket, SIOCGSTAMPNS as _, &raw mut stamp) } != 0 {
        return now;
    }
    let age = calendar() - Nanos(stamp.tv_sec * 1_000_000_000 + stamp.tv_nsec);
    if (0..=OLDEST.0).contains(&age.0) { now - age } else { now }
}

#[cfg(test)]
mod tests {
    use crate::time::Nanos;
    use crate::wire::{Port, udp::UdpPort};
    use std::time::Duration;

    #[test]
    fn a_datagram_that_waited_tells_when_it_came() {
        let local = "127.0.0.1:0".parse().unwrap();
        let (mut here, mut there) = (UdpPort::bind(local).unwrap(), UdpPort::bind(local).unwrap());
        let mut wait_for_one = || {
            let sent = there.now();
            there.send(b"x", here.local_address().unwrap()).unwrap();
            std::thread::sleep(Duration::from_millis(20));
            assert!(here.receive(&mut [0; 8], Nanos(0)).unwrap().is_some());
            here.arrived() - sent
        };
        // The kernel takes a moment to switch its time stamps on for the first socket that wants them, and a busy
        // machine may stop the test between two looks at the clock.
        let told = (0..50).any(|_| (-1_000_000..10_000_000).contains(&wait_for_one().0));
        assert!(told, "the kernel does not tell when a datagram came");
    }
}
