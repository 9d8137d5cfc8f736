//! The subset of HTTP for a calibration: fetches one file at the start; the emulated box serves it.

use super::calibration::{CalibrationError, NetFtCalibration};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Path of a Net Box's configuration.
const PATH: &str = "/netftapi2.xml";
/// Greatest length of a reply: a real one has a few kilobytes.
const MAX_REPLY: usize = 256 * 1024;
/// Greatest length of a request to the emulated box.
const MAX_REQUEST: usize = 8 * 1024;

/// Error of reading a calibration.
#[derive(Debug, thiserror::Error)]
pub enum FetchError {
    /// The box does not answer in time, or the connection breaks.
    #[error("the sensor's configuration at http://{address}{PATH} cannot be read")]
    Io {
        /// Address of the box.
        address: SocketAddr,
        /// Error of the operating system.
        #[source]
        error: io::Error,
    },
    /// The reply is not a configuration.
    #[error("the sensor answers \"{0}\" when asked for its configuration")]
    Status(String),
    /// The file cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// Reads the calibration of the box whose HTTP server is at `address`; blocks for about `limit` at most.
///
/// # Errors
/// If the box does not answer in time, or the reply is no calibration.
pub fn fetch_calibration(address: SocketAddr, limit: Duration) -> Result<NetFtCalibration, FetchError> {
    let reply = get(address, limit).map_err(|error| FetchError::Io { address, error })?;
    let reply = String::from_utf8_lossy(&reply);
    let (head, body) = reply.split_once("\r\n\r\n").unwrap_or((&reply, ""));
    let status = head.lines().next().unwrap_or_default();
    let code = status.strip_prefix("HTTP/1.").and_then(|rest| rest.split_whitespace().nth(1));
    if code != Some("200") {
        return Err(FetchError::Status(status.chars().take(80).collect()));
    }
    Ok(NetFtCalibration::from_xml(body)?)
}

fn get(address: SocketAddr, limit: Duration) -> io::Result<Vec<u8>> {
    let end = Instant::now() + limit;
    let mut stream = TcpStream::connect_timeout(&address, limit)?;
    stream.set_write_timeout(Some(limit))?;
    // One write: a simple server may read once.
    stream.write_all(format!("GET {PATH} HTTP/1.0\r\nHost: {address}\r\nConnection: close\r\n\r\n").as_bytes())?;
    read_until(&mut stream, end, MAX_REPLY, |_| false)
}

/// Reads until `done`, the end of the stream or `limit` bytes.
fn read_until(stream: &mut TcpStream, end: Instant, limit: usize, done: impl Fn(&[u8]) -> bool) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut chunk = [0; 4096];
    while bytes.len() < limit && !done(&bytes) {
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut chunk)? {
            0 => break,
            length => bytes.extend_from_slice(&chunk[..length]),
        }
    }
    Ok(bytes)
}

/// The HTTP server of an emulated box: a thread that serves `netftapi2.xml` until dropped.
pub struct CalibrationServer {
    address: SocketAddr,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl CalibrationServer {
    /// Serves a calibration at a local address; port 0 takes any free one.
    ///
    /// # Errors
    /// If the address is taken or does not belong to this machine.
    pub fn start(address: SocketAddr, calibration: &NetFtCalibration) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        let address = listener.local_addr()?;
        let over = Arc::new(AtomicBool::new(false));
        let (xml, ended) = (calibration.to_xml(), Arc::clone(&over));
        let thread = std::thread::Builder::new().name("netft-http".to_owned()).spawn(move || {
            for stream in listener.incoming() {
                if ended.load(Ordering::Acquire) {
                    return;
                }
                // A client that disconnects is no error.
                let _ = stream.and_then(|stream| serve(stream, &xml));
            }
        })?;
        Ok(Self { address, over, thread: Some(thread) })
    }

    /// Returns the listening address.
    pub fn local_address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for CalibrationServer {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Release);
        // Wakes the thread that waits for a client.
        let woken = TcpStream::connect_timeout(&self.address, Duration::from_secs(1)).is_ok();
        if let Some(thread) = self.thread.take().filter(|_| woken) {
            let _ = thread.join();
        }
    }
}

fn serve(mut stream: TcpStream, xml: &str) -> io::Result<()> {
    let limit = Duration::from_secs(1);
    stream.set_write_timeout(Some(limit))?;
    let is_whole = |bytes: &[u8]| bytes.windows(4).any(|window| window == b"\r\n\r\n");
    let request = read_until(&mut stream, Instant::now() + limit, MAX_REQUEST, is_whole)?;
    let (status, body) = match request.strip_prefix(format!("GET {PATH} ").as_bytes()) {
        Some(_) => ("200 OK", xml),
        None => ("404 Not Found", ""),
    };
    write!(
        stream,
        "HTTP/1.0 {status}\r\nContent-Type: text/xml\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
        body.len()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_secs(5);

    fn any() -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], 0))
    }

    #[test]
    fn served_calibration_is_fetched() {
        let calibration = NetFtCalibration::with_units("Net F/T", 1e6, 1e5, "lbf", "lbf-ft").unwrap();
        let server = CalibrationServer::start(any(), &calibration).unwrap();
        for _ in 0..3 {
            assert_eq!(fetch_calibration(server.local_address(), LIMIT).unwrap(), calibration);
        }
    }

    #[test]
    fn other_replies_are_errors() {
        let listener = TcpListener::bind(any()).unwrap();
        let address = listener.local_addr().unwrap();
        let served = std::thread::spawn(move || {
            for reply in ["HTTP/1.1 404 Not Found\r\n\r\n", "HTTP/1.0 200 OK\r\n\r\n<netft/>", "garbage", ""] {
                let (mut stream, _) = listener.accept().unwrap();
                let mut request = [0; 256];
                let _ = stream.read(&mut request).unwrap();
                stream.write_all(reply.as_bytes()).unwrap();
            }
            // Listens on and never answers.
            listener
        });
        assert!(matches!(fetch_calibration(address, LIMIT), Err(FetchError::Status(_))));
        assert!(matches!(fetch_calibration(address, LIMIT), Err(FetchError::Calibration(_))));
        assert!(matches!(fetch_calibration(address, LIMIT), Err(FetchError::Status(_))));
        assert!(matches!(fetch_calibration(address, LIMIT), Err(FetchError::Status(_))));
        let listener = served.join().unwrap();
        let silent = fetch_calibration(address, Duration::from_millis(50));
        assert!(matches!(silent, Err(FetchError::Io { .. })));
        drop(listener);
    }
}
