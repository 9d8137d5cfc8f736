//! FANUC's Remote Motion Interface, as far as arming needs it: sessions of JSON lines over TCP that clear faults and
//! start the program which follows the stream.

use serde_json::{Value, json};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// Name of the controller's program that follows Stream Motion.
pub const STREAM_PROGRAM: &str = "STREAM_MOTN";
/// Greatest length of a line.
const MAX_LINE: usize = 64 * 1024;
/// Greatest number of other lines (pushed faults, late acknowledgements) before a reply.
const MAX_PUSHED: usize = 64;

/// Greatest number of alarms that are read.
const MAX_ALARMS: i64 = 5;
/// Period of polling a controller while its servos are being enabled.
const LOOK: Duration = Duration::from_millis(50);

/// Error of arming a robot over RMI.
#[derive(Debug, thiserror::Error)]
pub enum RmiError {
    /// The controller does not answer in time, or the connection breaks.
    #[error("the FANUC controller does not answer {request}: {error}")]
    Io {
        /// Request.
        request: &'static str,
        /// Error of the operating system.
        #[source]
        error: io::Error,
    },
    /// The controller refuses.
    #[error("the FANUC controller refuses {request} with error {code}: {words}")]
    Refused {
        /// Request.
        request: &'static str,
        /// Error number of the controller.
        code: i64,
        /// Its alarms, or the meaning of the number.
        words: String,
    },
    /// The controller cannot move its robot now.
    #[error("the FANUC controller cannot move its robot, {problem}: {words}")]
    NotReady {
        /// Reason in its status.
        problem: &'static str,
        /// Its alarms.
        words: String,
    },
    /// The reply lacks a required field.
    #[error("the FANUC controller answers {request} without {field}")]
    Reply {
        /// Request.
        request: &'static str,
        /// Missing field.
        field: &'static str,
    },
}

/// Returns the meaning of an error number, by FANUC's manual.
fn meaning(code: i64) -> &'static str {
    match code {
        2_556_934 | 2_556_936 => "Cannot Execute TP program",
        2_556_935 => "Controller Servo is Off",
        2_556_937 => "RMI is Not Running",
        2_556_940 => "Cannot Reset Controller",
        2_556_943 => "Invalid Controller State",
        2_556_944 => "Please Cycle Power",
        2_556_952 => "RMI is In HOLD State",
        2_556_954 => "Robot is Already Connected",
        2_556_971 => "Robot in Single Step Mode",
        2_556_981 => "Invalid Call Program Name",
        _ => "see this number in the manual of FANUC's Remote Motion Interface",
    }
}

/// A session with a controller; on drop it aborts the program that follows the stream, and ends.
pub struct RmiSession {
    lines: Lines,
    /// Alarms at its opening: a reset removes them from the list even if their cause persists.
    alarms: String,
}

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
        // The first connection only returns the port of the session.
        let port = {
            let mut first = Lines::connect(controller, limit, request)?;
            let reply = first.ask("Communication", request)?;
            let port = reply.get("PortNumber").and_then(Value::as_u64).and_then(|port| u16::try_from(port).ok());
            port.filter(|&port| port > 0).ok_or(RmiError::Reply { request, field: "PortNumber" })?
        };
        let lines = Lines::connect(SocketAddr::new(controller.ip(), port), limit, request)?;
        let mut session = Self { lines, alarms: String::new() };
        session.alarms = session.read_alarms();
        session.initialize().map_err(|error| session.explained(error))?;
        Ok(session)
    }

    /// Returns the controller's alarms, newest first; empty without any.
    fn read_alarms(&mut self) -> String {
        let request = json!({"Command": "FRC_ReadError", "Count": MAX_ALARMS});
        // Alarms that cannot be read are no error.
        let Ok(reply) = self.lines.exchange("Command", "FRC_ReadError", &request) else {
            return String::new();
        };
        let keys = ["ErrorData", "ErrorData2", "ErrorData3", "ErrorData4", "ErrorData5"];
        let texts = keys.iter().filter_map(|key| reply.get(*key).and_then(Value::as_str)).map(str::trim);
        texts.filter(|text| !text.is_empty()).collect::<Vec<_>>().join("; ")
    }

    /// Returns the controller's present alarms, or else the previous ones.
    pub(super) fn words(&mut self) -> String {
        let now = self.read_alarms();
        match (now.is_empty(), self.alarms.is_empty()) {
            (false, _) => now,
            (true, false) => self.alarms.clone(),
            (true, true) => "it lists no alarm".to_owned(),
        }
    }

    /// Creates a refusal that quotes the controller.
    fn explained(&mut self, error: RmiError) -> RmiError {
        match error {
            RmiError::Refused { request, code, words } => {
                let alarms = self.read_alarms();
                let alarms = if alarms.is_empty() { self.alarms.clone() } else { alarms };
                let words = if alarms.is_empty() { words } else { format!("{words}; {alarms}") };
                RmiError::Refused { request, code, words }
            }
            other => other,
        }
    }

    /// Waits until the servos are on, as long as a reply may take.
    ///
    /// # Errors
    /// If the teach pendant is on, or the servos stay off; the error quotes the controller.
    pub fn wait_for_servos(&mut self) -> Result<(), RmiError> {
        let request = "FRC_GetStatus";
        let end = Instant::now() + self.lines.limit;
        loop {
            let status = self.lines.ask("Command", request)?;
            let flag = |field: &'static str| {
                status.get(field).and_then(Value::as_i64).ok_or(RmiError::Reply { request, field })
            };
            if flag("TPMode")? != 0 {
                let words = self.words();
                return Err(RmiError::NotReady { problem: "its teach pendant is on or it is in T1", words });
            }
            if flag("ServoReady")? != 0 {
                return Ok(());
            }
            if Instant::now() >= end {
                let words = self.words();
                return Err(RmiError::NotReady { problem: "its servos are off", words });
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Resets and initialises; repeats after an abort, if a program of an earlier session still runs.
    fn initialize(&mut self) -> Result<(), RmiError> {
        self.tolerated("FRC_Reset")?;
        if self.lines.ask("Command", "FRC_Initialize").is_ok() {
            return Ok(());
        }
        self.tolerated("FRC_Abort")?;
        self.tolerated("FRC_Reset")?;
        self.lines.ask("Command", "FRC_Initialize").map(|_| ())
    }

    /// Sends a command whose refusal has no consequence.
    fn tolerated(&mut self, request: &'static str) -> Result<(), RmiError> {
        match self.lines.ask("Command", request) {
            Ok(_) | Err(RmiError::Refused { .. }) => Ok(()),
            Err(other) => Err(other),
        }
    }

    /// Starts the program that follows the stream. Only the stream's status shows whether the program runs: the
    /// acknowledgement may be late or "wait".
    ///
    /// # Errors
    /// If the controller does not answer.
    pub fn start_stream_program(&mut self) -> Result<(), RmiError> {
        let status = self.lines.ask("Command", "FRC_GetStatus")?;
        // The controller continues its count over sessions, and drops a call with an older number silently.
        let next = status.get("NextSequenceID").and_then(Value::as_u64);
        let sequence = next.ok_or(RmiError::Reply { request: "FRC_GetStatus", field: "NextSequenceID" })?;
        let call = json!({"Instruction": "FRC_Call", "SequenceID": sequence, "ProgramName": STREAM_PROGRAM});
        self.lines.write("FRC_Call", &call)
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

    /// Sends a request and waits for the reply of its name.
    fn ask(&mut self, kind: &'static str, request: &'static str) -> Result<Value, RmiError> {
        self.exchange(kind, request, &json!({ kind: request }))
    }

    /// Sends a request with further fields and waits for its reply.
    fn exchange(&mut self, kind: &'static str, request: &'static str, message: &Value) -> Result<Value, RmiError> {
        self.write(request, message)?;
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
                code => Err(RmiError::Refused { request, code, words: meaning(code).to_owned() }),
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
        // Waits for the reply, which also reads pending data: closing with unread bytes would reset the connection
        // before the controller has read this request. A missing reply is no error.
        self.lines.limit = self.lines.limit.min(Duration::from_secs(1));
        let _ = self.lines.ask("Command", "FRC_Abort");
        let _ = self.lines.ask("Communication", "FRC_Disconnect");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};
    use std::net::TcpListener;

    /// Serves a connection with the replies of `answer`; returns the requests.
    fn serve(listener: &TcpListener, mut answer: impl FnMut(&Value) -> Vec<Value>) -> Vec<Value> {
        let (mut stream, _) = listener.accept().unwrap();
        let mut asked = Vec::new();
        for line in BufReader::new(stream.try_clone().unwrap()).lines().map_while(Result::ok) {
            let request: Value = serde_json::from_str(&line).unwrap();
            for reply in answer(&request) {
                // The client may be gone.
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
    fn blocked_controller_is_reset_and_program_is_called_with_its_number() {
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
        let opening = ["FRC_ReadError", "FRC_Reset", "FRC_Initialize", "FRC_Abort", "FRC_Reset", "FRC_Initialize"];
        assert_eq!(names[..6], opening);
        assert_eq!(names[6..], ["FRC_GetStatus", "FRC_Abort"]);
        let call = json!({"Instruction": "FRC_Call", "SequenceID": 7, "ProgramName": "STREAM_MOTN"});
        assert_eq!(asked[7], call);
        assert_eq!(asked[9], json!({"Communication": "FRC_Disconnect"}));
    }

    #[test]
    fn refusal_and_silence_are_errors() {
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
