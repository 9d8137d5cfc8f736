//! The emulated controller's Remote Motion Interface: clients clear faults and start the program that follows the
//! stream.

use super::controller::Remote;
use super::rmi::STREAM_PROGRAM;
use serde_json::{Value, json};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Greatest length of a line.
const MAX_LINE: u64 = 16 * 1024;
/// Period at which a thread checks whether it must end.
const LOOK: Duration = Duration::from_millis(20);

/// The RMI server of an emulated controller: one session at a time, until dropped.
pub struct RmiServer {
    address: SocketAddr,
    remote: Arc<Remote>,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl RmiServer {
    /// Serves at a local address; port 0 takes any free one.
    ///
    /// # Errors
    /// If the address is taken or does not belong to this machine.
    pub fn start(address: SocketAddr) -> io::Result<Self> {
        let first = TcpListener::bind(address)?;
        let address = first.local_addr()?;
        let session = TcpListener::bind(SocketAddr::new(address.ip(), 0))?;
        first.set_nonblocking(true)?;
        session.set_nonblocking(true)?;
        let (remote, over) = (Arc::new(Remote::default()), Arc::new(AtomicBool::new(false)));
        let port = session.local_addr()?.port();
        let (served, ended) = (Arc::clone(&remote), Arc::clone(&over));
        let thread = std::thread::Builder::new().name("fanuc-rmi".to_owned()).spawn(move || {
            let mut controller = Controller { port, next_sequence: 1, remote: served };
            while !ended.load(Ordering::Acquire) {
                // Errors of a session concern the client only; the program ends with the session.
                for listener in [&first, &session] {
                    if let Ok((stream, _)) = listener.accept() {
                        let _ = controller.serve(stream, &ended);
                        controller.remote.run_program(false);
                    }
                }
                std::thread::sleep(LOOK);
            }
        })?;
        Ok(Self { address, remote, over, thread: Some(thread) })
    }

    /// Returns the listening address.
    pub fn local_address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the requests of its clients: for [`obey`](super::controller::FanucController::obey).
    pub fn remote(&self) -> Arc<Remote> {
        Arc::clone(&self.remote)
    }
}

impl Drop for RmiServer {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Controller {
    /// Port of sessions.
    port: u16,
    /// Number of the next instruction; outlives broken sessions.
    next_sequence: u64,
    remote: Arc<Remote>,
}

impl Controller {
    fn serve(&mut self, stream: TcpStream, over: &AtomicBool) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(LOOK))?;
        stream.set_write_timeout(Some(Duration::from_secs(1)))?;
        let mut writer = stream.try_clone()?;
        let mut reader = BufReader::new(stream);
        let mut line = Vec::new();
        while !over.load(Ordering::Acquire) {
            let remaining = MAX_LINE.saturating_sub(line.len() as u64);
            match reader.by_ref().take(remaining).read_until(b'\n', &mut line) {
                Ok(0) => break,
                Ok(_) if line.ends_with(b"\n") => {}
                Ok(_) => continue,
                Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => continue,
                Err(error) => return Err(error),
            }
            if let Some(reply) = serde_json::from_slice(&line).ok().and_then(|request| self.reply(&request)) {
                writer.write_all(format!("{reply}\r\n").as_bytes())?;
            }
            line.clear();
        }
        Ok(())
    }

    /// Returns the reply to a request; `None` if there is none.
    fn reply(&mut self, request: &Value) -> Option<Value> {
        if request["Instruction"] == "FRC_Call" {
            return self.call(request);
        }
        let kind = ["Communication", "Command"].into_iter().find(|&kind| request[kind].is_string())?;
        let mut reply = json!({ kind: request[kind], "ErrorID": 0 });
        match request[kind].as_str()? {
            "FRC_Connect_STMO" => reply["PortNumber"] = self.port.into(),
            "FRC_Disconnect" => {
                self.next_sequence = 1;
                self.remote.run_program(false);
            }
            "FRC_Abort" => self.remote.run_program(false),
            "FRC_Reset" => self.remote.reset(),
            "FRC_GetStatus" => self.write_status(&mut reply),
            "FRC_GetExtStatus" => {
                let powered = u8::from(!self.remote.is_stopped());
                let fields =
                    [("DrivesPowered", json!(powered)), ("GenOverride", json!(100)), ("SpeedClampLimit", json!(100))];
                fields.into_iter().for_each(|(field, value)| reply[field] = value);
            }
            "FRC_ReadError" => {
                let alarms: &[&str] = if self.remote.is_stopped() { &["SRVO-001 Operator panel E-stop"] } else { &[] };
                (reply["Count"], reply["ErrorData"]) = (json!(alarms.len()), json!(alarms.first().unwrap_or(&"")));
            }
            _ => {}
        }
        Some(reply)
    }

    fn write_status(&self, reply: &mut Value) {
        let runs = u64::from(self.remote.runs_program());
        let fields = [
            ("ServoReady", u64::from(!self.remote.is_stopped())),
            ("TPMode", u64::from(self.remote.is_taught())),
            ("RMIMotionStatus", 0),
            ("ProgramStatus", runs),
            ("Override", 100),
            ("NextSequenceID", self.next_sequence),
        ];
        fields.into_iter().for_each(|(field, value)| reply[field] = value.into());
    }

    /// Starts a program; like the real controller, silently drops a call with an old number.
    fn call(&mut self, request: &Value) -> Option<Value> {
        let sequence = request["SequenceID"].as_u64().filter(|&sequence| sequence >= self.next_sequence)?;
        self.next_sequence = sequence.saturating_add(1);
        if request["ProgramName"] == STREAM_PROGRAM {
            self.remote.run_program(true);
        }
        Some(json!({"Instruction": "FRC_Call", "SequenceID": sequence, "ErrorID": 0}))
    }
}

#[cfg(test)]
mod tests {
    use super::super::rmi::RmiSession;
    use super::*;

    #[test]
    fn session_starts_and_ends_the_program() {
        let server = RmiServer::start(SocketAddr::from(([127, 0, 0, 1], 0))).unwrap();
        for _ in 0..2 {
            let mut session = RmiSession::open(server.local_address(), Duration::from_secs(5)).unwrap();
            assert!(!server.remote().runs_program());
            session.start_stream_program().unwrap();
            let started = (0..200).any(|_| {
                std::thread::sleep(Duration::from_millis(10));
                server.remote().runs_program()
            });
            assert!(started);
            drop(session);
            assert!(!server.remote().runs_program());
        }
    }

    #[test]
    fn garbage_and_old_numbers_are_ignored() {
        let remote = Arc::new(Remote::default());
        let mut controller = Controller { port: 1, next_sequence: 5, remote: Arc::clone(&remote) };
        for request in [json!(null), json!([1]), json!({"Command": 7}), json!({"Instruction": "FRC_Call"})] {
            assert_eq!(controller.reply(&request), None, "{request}");
        }
        let call =
            |sequence: u64| json!({"Instruction": "FRC_Call", "SequenceID": sequence, "ProgramName": "STREAM_MOTN"});
        assert_eq!(controller.reply(&call(4)), None);
        assert!(!remote.runs_program());
        assert!(controller.reply(&call(u64::MAX)).is_some() && remote.runs_program());
    }
}
