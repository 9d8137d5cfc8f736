//! FANUC's Remote Motion Interface, as far as arming needs it: a session of JSON lines over TCP that clears faults and
//! starts the program which follows the stream.

use serde_json::{Value, json};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// The program on the controller that follows Stream Motion.
pub const STREAM_PROGRAM: &str = "STREAM_MOTN";
/// Longest line that is read.
const MAX_LINE: usize = 64 * 1024;
/// Lines of others (faults pushed, late acknowledgements) that may come before a reply.
const MAX_PUSHED: usize = 64;

/// Why a robot could not be armed.
#[derive(Debug, thiserror::Error)]
pub enum RmiError {
    /// The controller does not answer in time, or the connection breaks.
    #[error("the FANUC controller does not answer {request}")]
    Io {
        /// What it was asked.
        request: &'static str,
        /// What the operating system says.
        #[source]
        error: io::Error,
    },
    /// It refuses.
    #[error("the FANUC controller refuses {request}: error {code}")]
    Refused {
        /// What it was asked.
        request: &'static str,
        /// Its number for the reason.
        code: i64,
    },
    /// Its reply lacks what it must tell.
    #[error("the FANUC controller answers {request} without {field}")]
    Reply {
        /// What it was asked.
        request: &'static str,
        /// What is missing.
        field: &'static str,
    },
}

/// A session with a controller; ends when dropped, and with it the program that follows the stream.
pub struct RmiSession(Lines);

/// A connection of JSON lines.
struct Lines {
    stream: TcpStream,
    limit: Duration,
    unread: Vec<u8>,
}

impl RmiSession {
    /// Opens a session at the controller's RMI address and clears recoverable faults; each reply may take up to
    /// `limit`.
    ///
    /// # Errors
    /// If the controller does not answer or refuses.
    pub fn open(controller: SocketAddr, limit: Duration) -> Result<Self, RmiError> {
        let request = "FRC_Connect_STMO";
        // The first connection only tells the port of the session.
        let port = {
            let mut first = Lines::connect(controller, limit, request)?;
            let reply = first.ask("Communication", request)?;
            let port = reply.get("PortNumber").and_then(Value::as_u64).and_then(|port| u16::try_from(port).ok());
            port.filter(|&port| port > 0).ok_or(RmiError::Reply { request, field: "PortNumber" })?
        };
        let mut session = Self(Lines::connect(SocketAddr::new(controller.ip(), port), limit, request)?);
        session.initialize()?;
        Ok(session)
    }

    /// Resets and initialises; once more after an abort, if a program of an earlier session is in the way.
    fn initialize(&mut self) -> Result<(), RmiError> {
        self.tolerated("FRC_Reset")?;
        if self.0.ask("Command", "FRC_Initialize").is_ok() {
            return Ok(());
        }
        self.tolerated("FRC_Abort")?;
        self.tolerated("FRC_Reset")?;
        self.0.ask("Command", "FRC_Initialize").map(|_| ())
    }

    /// A command whose refusal is no matter.
    fn tolerated(&mut self, request: &'static str) -> Result<(), RmiError> {
        match self.0.ask("Command", request) {
            Ok(_) | Err(RmiError::Refused { .. }) => Ok(()),
            Err(other) => Err(other),
        }
    }

    /// Starts the program that follows the stream. Whether it runs, the stream's status tells: the acknowledgement may
    /// come late or as "wait".
    ///
    /// # Errors
    /// If the controller does not answer.
    pub fn start_stream_program(&mut self) -> Result<(), RmiError> {
        let status = self.0.ask("Command", "FRC_GetStatus")?;
        // The controller goes on counting over sessions, and drops a call of an older number without a word.
        let next = status.get("NextSequenceID").and_then(Value::as_u64);
        let sequence = next.ok_or(RmiError::Reply { request: "FRC_GetStatus", field: "NextSequenceID" })?;
        let call = json!({"Instruction": "FRC_Call", "SequenceID": sequence, "ProgramName": STREAM_PROGRAM});
        self.0.write("FRC_Call", &call)
    }
}

impl Lines {
    fn connect(address: SocketAddr, limit: Duration, request: &'static str) -> Result<Self, RmiError> {
        let io = |error| RmiError::Io { request, error };
        let stream = TcpStream::connect_timeout(&address, limit).map_err(io)?;
        stream.set_nodelay(true).map_err(io)?;
        stream.set_write_timeout(Some(limit)).map_err(io)?;
        Ok(Self { stream, limit, unread: Vec::new() })
    }

    /// Sends a request and waits for the reply that repeats its name.
    fn ask(&mut self, kind: &'static str, request: &'static str) -> Result<Value, RmiError> {
        self.write(request, &json!({ kind: request }))?;
        let end = Instant::now() + self.limit;
        for _ in 0..MAX_PUSHED {
            let line = self.read_line(end).map_err(|error| RmiError::Io { request, error })?;
            let Ok(reply) = serde_json::from_slice::<Value>(&line) else {
                continue;
            };
            if reply.get(kind).and_then(Value::as_str) != Some(request) {
                continue;
            }
            return match reply.get("ErrorID").and_then(Value::as_i64).unwrap_or(0) {
                0 => Ok(reply),
                code => Err(RmiError::Refused { request, code }),
            };
        }
        Err(RmiError::Io { request, error: io::ErrorKind::InvalidData.into() })
    }

    fn write(&mut self, request: &'static str, message: &Value) -> Result<(), RmiError> {
        self.stream.write_all(format!("{message}\r\n").as_bytes()).map_err(|error| RmiError::Io { request, error })
    }

    fn read_line(&mut self, end: Instant) -> io::Result<Vec<u8>> {
        let mut chunk = [0; 1024];
        loop {
            if let Some(length) = self.unread.iter().position(|&byte| byte == b'\n') {
                return Ok(self.unread.drain(..=length).collect());
            }
            if self.unread.len() > MAX_LINE {
                return Err(io::ErrorKind::InvalidData.into());
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(io::ErrorKind::TimedOut.into());
            }
            self.stream.set_read_timeout(Some(left))?;
            match self.stream.read(&mut chunk)? {
                0 => return Err(io::ErrorKind::UnexpectedEof.into()),
                length => self.unread.extend_from_slice(&chunk[..length]),
            }
        }
    }
}

impl Drop for RmiSession {
    fn drop(&mut self) {
        // Waiting for the reply also reads what else has come: closed with bytes unread, the connection would break off
        // before the controller has read this. A controller that is gone needs no farewell.
        self.0.limit = self.0.limit.min(Duration::from_secs(1));
        let _ = self.0.ask("Communication", "FRC_Disconnect");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};
    use std::net::TcpListener;

    /// Serves a connection with the replies that `answer` makes; ends with it, returning what was asked.
    fn serve(listener: &TcpListener, mut answer: impl FnMut(&Value) -> Vec<Value>) -> Vec<Value> {
        let (mut stream, _) = listener.accept().unwrap();
        let mut asked = Vec::new();
        for line in BufReader::new(stream.try_clone().unwrap()).lines().map_while(Result::ok) {
            let request: Value = serde_json::from_str(&line).unwrap();
            for reply in answer(&request) {
                // The client may have gone.
                let _ = stream.write_all(format!("{reply}\r\n").as_bytes());
            }
            asked.push(request);
        }
        asked
    }

    fn echo(request: &Value, code: i64) -> Value {
        let mut reply = request.clone();
        reply["ErrorID"] = code.into();
        reply
    }

    #[test]
    fn a_stuck_controller_is_reset_and_the_program_called_with_its_own_number() {
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let (first, second) = (TcpListener::bind(any).unwrap(), TcpListener::bind(any).unwrap());
        let (address, port) = (first.local_addr().unwrap(), second.local_addr().unwrap().port());
        let served = std::thread::spawn(move || {
            let connect = |request: &Value| {
                let mut reply = echo(request, 0);
                reply["PortNumber"] = port.into();
                vec![reply]
            };
            serve(&first, connect);
            let mut stuck = true;
            serve(&second, |request| match request["Command"].as_str() {
                Some("FRC_Initialize") => {
                    vec![
                        json!({"Communication": "FRC_SystemFault"}),
                        echo(request, i64::from(std::mem::take(&mut stuck))),
                    ]
                }
                Some("FRC_GetStatus") => vec![json!({"Command": "FRC_GetStatus", "ErrorID": 0, "NextSequenceID": 7})],
                _ => vec![echo(request, 0)],
            })
        });
        let mut session = RmiSession::open(address, Duration::from_secs(5)).unwrap();
        session.start_stream_program().unwrap();
        drop(session);
        let asked = served.join().unwrap();
        let names: Vec<_> = asked.iter().filter_map(|request| request["Command"].as_str()).collect();
        let expected = ["FRC_Reset", "FRC_Initialize", "FRC_Abort", "FRC_Reset", "FRC_Initialize", "FRC_GetStatus"];
        assert_eq!(names, expected);
        let call = json!({"Instruction": "FRC_Call", "SequenceID": 7, "ProgramName": "STREAM_MOTN"});
        assert_eq!(asked[6], call);
        assert_eq!(asked[7], json!({"Communication": "FRC_Disconnect"}));
    }

    #[test]
    fn a_refusal_and_silence_are_errors() {
        let listener = TcpListener::bind(SocketAddr::from(([127, 0, 0, 1], 0))).unwrap();
        let address = listener.local_addr().unwrap();
        let served = std::thread::spawn(move || {
            serve(&listener, |request| vec![echo(request, 2_556_954)]);
            serve(&listener, |request| vec![echo(request, 0)]);
            serve(&listener, |_| vec![]);
        });
        let open = |limit| RmiSession::open(address, Duration::from_millis(limit)).map(|_| ());
        assert!(matches!(open(5000), Err(RmiError::Refused { code: 2_556_954, .. })));
        assert!(matches!(open(5000), Err(RmiError::Reply { field: "PortNumber", .. })));
        assert!(matches!(open(50), Err(RmiError::Io { .. })));
        served.join().unwrap();
    }
}
