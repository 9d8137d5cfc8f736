//! A UDP socket as a port, on the machine's monotonic clock, with kernel time stamps of received datagrams.

use super::Port;
use crate::clock::{Clock, Monotonic};
use crate::time::Nanos;
use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::{AsRawFd, RawFd};

/// A bound UDP socket that blocks only until a given deadline.
pub struct UdpPort {
    socket: UdpSocket,
    arrived: Nanos,
}

impl UdpPort {
    /// Binds a local address.
    ///
    /// # Errors
    /// If the address is taken or does not belong to this machine.
    pub fn bind(address: SocketAddr) -> io::Result<Self> {
        let socket = UdpSocket::bind(address)?;
        socket.set_nonblocking(true)?;
        let arrived = arrival(&socket);
        Ok(Self { socket, arrived })
    }

    /// Returns the bound address.
    ///
    /// # Errors
    /// If the operating system reports none.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }
}

/// Waits for a datagram on one of these ports, or the deadline; returns whether one has arrived.
///
/// # Errors
/// If the network interface fails.
pub fn wait_for_any<const N: usize>(ports: &[UdpPort; N], deadline: Nanos) -> io::Result<bool> {
    wait(ports.each_ref().map(|port| port.socket.as_raw_fd()), deadline)
}

/// Waits for sockets in the same way; a signal ends the wait.
fn wait<const N: usize>(sockets: [RawFd; N], deadline: Nanos) -> io::Result<bool> {
    let left = deadline - Monotonic.now();
    if left.0 <= 0 {
        return Ok(false);
    }
    let timeout = libc::timespec { tv_sec: left.0 / 1_000_000_000, tv_nsec: left.0 % 1_000_000_000 };
    let mut polls = sockets.map(|fd| libc::pollfd { fd, events: libc::POLLIN, revents: 0 });
    // SAFETY: N pollfds and one timespec, all local and alive over the call; no signal mask.
    match unsafe { libc::ppoll(polls.as_mut_ptr(), N as libc::nfds_t, &raw const timeout, std::ptr::null()) } {
        0 => Ok(false),
        -1 => match io::Error::last_os_error() {
            error if error.kind() == io::ErrorKind::Interrupted => Ok(true),
            error => Err(error),
        },
        _ => Ok(true),
    }
}

/// Returns the arrival of the last received datagram.
fn arrival(socket: &UdpSocket) -> Nanos {
    of_last_datagram(socket.as_raw_fd(), Monotonic.now())
}

impl Port for UdpPort {
    fn now(&self) -> Nanos {
        Monotonic.now()
    }

    fn receive(&mut self, buffer: &mut [u8], deadline: Nanos) -> io::Result<Option<(usize, SocketAddr)>> {
        loop {
            match self.socket.recv_from(buffer) {
                Ok(taken) => {
                    self.arrived = arrival(&self.socket);
                    return Ok(Some(taken));
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    if !wait([self.socket.as_raw_fd()], deadline)? {
                        return Ok(None);
                    }
                }
                // The other side was unreachable at our last sending; it may start later.
                Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn arrived(&self) -> Nanos {
        self.arrived
    }

    fn send(&mut self, datagram: &[u8], to: SocketAddr) -> io::Result<()> {
        match self.socket.send_to(datagram, to) {
            Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => Ok(()),
            sent => sent.map(|_| ()),
        }
    }
}

/// The `SIOCGSTAMPNS` request of `<asm-generic/sockios.h>`: time of the last received datagram on the wall clock.
const SIOCGSTAMPNS: libc::c_ulong = 0x8907;

/// Oldest accepted time stamp: the wall clock may be set while a datagram waits.
const OLDEST: Nanos = Nanos::from_millis(1000);

fn wall_clock() -> Nanos {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a local timespec; the call writes it and stores nothing.
    unsafe { libc::clock_gettime(libc::CLOCK_REALTIME, &raw mut time) };
    Nanos(time.tv_sec * 1_000_000_000 + time.tv_nsec)
}

/// Returns the arrival of a socket's last datagram on the monotonic clock whose time is `now`, or `now` if the kernel
/// has no stamp. The first call on a socket enables its time stamps; the kernel may need a moment for this.
fn of_last_datagram(socket: RawFd, now: Nanos) -> Nanos {
    let mut stamp = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the pointer is to a local timespec, which is the type that the request writes on 64-bit Linux.
    if unsafe { libc::ioctl(socket, SIOCGSTAMPNS as _, &raw mut stamp) } != 0 {
        return now;
    }
    let age = wall_clock() - Nanos(stamp.tv_sec * 1_000_000_000 + stamp.tv_nsec);
    if (0..=OLDEST.0).contains(&age.0) { now - age } else { now }
}

#[cfg(test)]
mod tests {
    use super::*;
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
