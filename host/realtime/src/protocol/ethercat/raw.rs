//! EtherCAT frames on an Ethernet interface: a raw socket that blocks only until a given deadline.

use crate::clock::{Clock, Monotonic};
use crate::time::Nanos;
use std::ffi::CString;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};

/// EtherType of EtherCAT.
pub const ETHERTYPE: u16 = 0x88A4;
/// Largest Ethernet frame without its check sequence.
pub const MAX_FRAME: usize = 1514;

/// A socket that takes and sends whole EtherCAT frames on one interface.
#[derive(Debug)]
pub struct RawSocket {
    socket: OwnedFd,
}

impl RawSocket {
    /// Opens an interface by its name.
    ///
    /// # Errors
    /// If the interface does not exist, or the process may not open raw sockets (`CAP_NET_RAW`).
    pub fn open(interface: &str) -> io::Result<Self> {
        let name = CString::new(interface).map_err(|_| io::Error::from(io::ErrorKind::InvalidInput))?;
        // SAFETY: a local C string that outlives the call.
        let index = unsafe { libc::if_nametoindex(name.as_ptr()) };
        let index = i32::try_from(index).ok().filter(|index| *index > 0).ok_or_else(io::Error::last_os_error)?;
        let kind = libc::SOCK_RAW | libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC;
        // SAFETY: no pointers.
        let raw = unsafe { libc::socket(libc::AF_PACKET, kind, i32::from(ETHERTYPE.to_be())) };
        if raw < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: a file descriptor that was just opened and has no other owner.
        let socket = unsafe { OwnedFd::from_raw_fd(raw) };
        // SAFETY: a structure of integers, for which zeroes are a value.
        let mut address: libc::sockaddr_ll = unsafe { std::mem::zeroed() };
        address.sll_family = libc::AF_PACKET as u16;
        address.sll_protocol = ETHERTYPE.to_be();
        address.sll_ifindex = index;
        let length = size_of::<libc::sockaddr_ll>() as libc::socklen_t;
        // SAFETY: pointer and length are those of the address, which outlives the call.
        if unsafe { libc::bind(socket.as_raw_fd(), (&raw const address).cast(), length) } < 0 {
            return Err(io::Error::last_os_error());
        }
        Ok(Self { socket })
    }

    /// Sends a frame; returns `false` if the interface's queue is full.
    ///
    /// # Errors
    /// If the interface fails.
    pub fn send(&self, frame: &[u8]) -> io::Result<bool> {
        // SAFETY: pointer and length are those of the frame.
        let sent = unsafe { libc::send(self.socket.as_raw_fd(), frame.as_ptr().cast(), frame.len(), 0) };
        match sent {
            -1 => would_block(io::Error::last_os_error()).map(|()| false),
            _ => Ok(true),
        }
    }

    /// Returns the next received frame, without waiting.
    ///
    /// # Errors
    /// If the interface fails.
    pub fn receive(&self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        // SAFETY: pointer and length are those of the buffer.
        let taken = unsafe { libc::recv(self.socket.as_raw_fd(), buffer.as_mut_ptr().cast(), buffer.len(), 0) };
        match usize::try_from(taken) {
            Ok(length) => Ok(Some(length)),
            Err(_) => would_block(io::Error::last_os_error()).map(|()| None),
        }
    }

    /// Waits for a frame or the deadline.
    ///
    /// # Errors
    /// If the operating system reports an error.
    pub fn wait(&self, deadline: Nanos) -> io::Result<()> {
        let left = (deadline - Monotonic.now()).0.max(0);
        let timeout = libc::timespec { tv_sec: left / 1_000_000_000, tv_nsec: left % 1_000_000_000 };
        let mut poll = libc::pollfd { fd: self.socket.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        // SAFETY: one pollfd and one timespec, both local and alive over the call; no signal mask.
        match unsafe { libc::ppoll(&raw mut poll, 1, &raw const timeout, std::ptr::null()) } {
            -1 => would_block(io::Error::last_os_error()),
            _ => Ok(()),
        }
    }
}

/// Treats *would block* as no error.
fn would_block(error: io::Error) -> io::Result<()> {
    match error.kind() {
        io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => Ok(()),
        // ENOBUFS: the transmit queue of the interface is full.
        _ if error.raw_os_error() == Some(libc::ENOBUFS) => Ok(()),
        _ => Err(error),
    }
}
