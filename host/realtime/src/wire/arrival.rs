//! Kernel time stamps of received datagrams, which also hold if the process was late.

use crate::time::Nanos;
use std::os::fd::RawFd;

/// The `SIOCGSTAMPNS` request of `<asm-generic/sockios.h>`: time of the last received datagram on the wall clock.
const SIOCGSTAMPNS: libc::c_ulong = 0x8907;

/// Oldest accepted time stamp: the wall clock may be set while a datagram waits.
const OLDEST: Nanos = Nanos::from_millis(1000);

fn calendar() -> Nanos {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a local timespec; the call writes it and stores nothing.
    unsafe { libc::clock_gettime(libc::CLOCK_REALTIME, &raw mut time) };
    Nanos(time.tv_sec * 1_000_000_000 + time.tv_nsec)
}

/// Returns the arrival of a socket's last datagram on the monotonic clock whose time is `now`, or `now` if the kernel
/// has no stamp. The first call on a socket enables its time stamps; the kernel may need a moment for this.
pub(super) fn of_last_datagram(socket: RawFd, now: Nanos) -> Nanos {
    let mut stamp = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a local timespec, which is the type that the request writes on 64-bit Linux.
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
    fn time_stamp_of_a_waiting_datagram_is_its_arrival() {
        let local = "127.0.0.1:0".parse().unwrap();
        let (mut here, mut there) = (UdpPort::bind(local).unwrap(), UdpPort::bind(local).unwrap());
        let mut wait_for_one = || {
            let sent = there.now();
            there.send(b"x", here.local_address().unwrap()).unwrap();
            std::thread::sleep(Duration::from_millis(20));
            assert!(here.receive(&mut [0; 8], Nanos(0)).unwrap().is_some());
            here.arrived() - sent
        };
        // The kernel needs a moment to enable time stamps for the first socket, and a busy machine may stop the test
        // between two readings of the clock.
        let is_stamped = (0..50).any(|_| (-1_000_000..10_000_000).contains(&wait_for_one().0));
        assert!(is_stamped, "the kernel gave no time stamp");
    }
}
