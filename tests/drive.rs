//! `softdock drive` and `emulate` as processes: rehearsals, replays, rejections, and a killed process.

use softdock_kernels::fields::fields;
use softdock_kernels::metrics::Metrics;
use softdock_session::prediction::is_measured;
use softdock_test_size::sized;
use std::fs;
use std::net::{Ipv4Addr, TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn command(words: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
    command.current_dir(root()).args(words.split_whitespace()).stdin(Stdio::null());
    command
}

/// Runs a command that must end with this exit code and returns its output on both streams.
fn expect(code: i32, words: &str) -> String {
    outcome(code, &mut command(words))
}

/// Runs a command with its own environment.
fn outcome(code: i32, command: &mut Command) -> String {
    let output = command.output().expect("softdock starts");
    let printed = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{command:?}\n{printed}");
    printed
}

/// Returns a port that is free for UDP and TCP, each time another one.
///
/// It is below the ports that the system gives to outgoing connections, so that none of them takes it meanwhile.
pub(crate) fn free_port() -> u16 {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    for _ in 0..10_000 {
        let step = std::process::id().wrapping_add(NEXT.fetch_add(1, Ordering::Relaxed)) % 10_000;
        let port = 20_000 + u16::try_from(step).expect("a small number");
        let address = (Ipv4Addr::LOCALHOST, port);
        if UdpSocket::bind(address).is_ok() && TcpListener::bind(address).is_ok() {
            return port;
        }
    }
    panic!("no free port from 20000 to 29999");
}

/// Returns the answer of a drive.
fn answer_in(out: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(out.join("drive.json")).expect("an answer")).expect("JSON")
}

const DRIVE: &str = "drive campaigns/probe_drogue.toml --run 1244";

#[test]
fn rehearsal_log_replays_bit_identically() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("drive");
    let printed = expect(0, &format!("{DRIVE} --virtual --band-runs 20 --out {}", out.display()));
    assert!(printed.contains("PASS") && printed.contains("stopped by completed"), "{printed}");
    for file in ["log.mcap", "log.parquet", "evidence.csv", "drive.json"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let answer = answer_in(&out);
    assert_eq!(answer["success"], true);
    let rows = fields::<f64, Metrics<f64>>();
    let measured: Vec<&str> = rows.iter().map(|row| row.name.as_str()).filter(|name| is_measured(name)).collect();
    let given: Vec<&str> =
        answer["metrics"].as_array().into_iter().flatten().filter_map(|metric| metric["name"].as_str()).collect();
    assert_eq!(given, measured);
    let printed = expect(0, &format!("replay --log {}", out.join("log.mcap").display()));
    assert!(printed.contains("equal, bit for bit") && printed.contains("dead time"), "{printed}");
    // A log is never written over.
    let printed = expect(2, &format!("{DRIVE} --virtual --no-band --out {}", out.display()));
    assert!(printed.contains("already holds the log of a session"), "{printed}");
}

#[test]
fn session_stopped_by_a_rule_exits_with_3_and_reports_the_cause() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("drive");
    let words = "drive campaigns/probe_drogue.toml --run 2 --virtual --no-band";
    let printed = expect(3, &format!("{words} --out {}", out.display()));
    assert!(
        printed.contains("stopped by energy_budget") && printed.contains("more than 0.5 J of energy injected"),
        "{printed}"
    );
    let answer = answer_in(&out);
    assert_eq!((&answer["outcome"], &answer["success"]), (&"not_completed".into(), &false.into()));
    let stop = &answer["stop"];
    assert!(stop["value"].as_f64() > stop["limit"].as_f64() && stop["unit"] == "J", "{stop}");
    assert!(answer["began_unix_s"].as_f64() > Some(1.7e9), "{answer}");
    // The same, compared with what the model expects.
    let out = folder.path().join("compared");
    expect(3, &format!("drive campaigns/probe_drogue.toml --run 2 --virtual --band-runs 20 --out {}", out.display()));
}

#[test]
fn dry_run_without_controllers_does_not_pass() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("drive");
    let links = format!("--robot1 rsi://127.0.0.1:{} --robot2 rsi://127.0.0.1:{}", free_port(), free_port());
    let words = format!("{DRIVE} {links} --no-band --out {}", out.display());
    let printed = outcome(3, command(&words).env("TMPDIR", folder.path()));
    assert!(printed.contains("robot 1: reports received: 0 reports"), "{printed}");
    let answer = answer_in(&out);
    assert_eq!((&answer["outcome"], &answer["cause"]), (&"refused".into(), &"start_refused".into()));
}

#[test]
fn wrong_arguments_are_rejected_and_write_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("never");
    let cases = [
        ("--arm", "all links are emulated"),
        (
            "--arm --robot1 rsi://127.0.0.1:59152 --robot2 rsi://127.0.0.1:59153 --ft netft://127.0.0.1",
            "an armed session needs a terminal or a page for GO",
        ),
        ("--robot1 rsi://127.0.0.1:1?spin=3", "has no option `spin`"),
        ("--robot1 modbus://127.0.0.1", "is not a robot protocol"),
        ("--robot1 rsi://nowhere.invalid:59152", "is not a resolvable"),
        ("--robot2 ethercat://nothing0", "does not state the drive counts"),
        ("--ft serial://ttyS0", "is not a sensor protocol"),
        ("--virtual --robot1 rsi://127.0.0.1:59152", "virtual time"),
        ("--facility campaigns/smoke.toml", "there is no key `seed`"),
        ("--facility campaigns/none.toml", "none.toml"),
    ];
    for (words, reason) in cases {
        let words = format!("{DRIVE} {words} --no-band --out {}", out.display());
        // The robots' locks lie there: another test may hold them.
        let printed = outcome(2, command(&words).env("TMPDIR", folder.path()));
        assert!(printed.contains(reason), "{words}\n{printed}");
        assert!(!out.exists(), "{words}: nothing is left");
    }
    let printed = expect(2, "drive campaigns/probe_drogue.toml --run 2000 --virtual");
    assert!(printed.contains("take one of 0 to 1999"), "{printed}");
}

#[test]
fn damaged_facility_and_effects_files_report_the_key() {
    let folder = tempfile::tempdir().expect("a folder");
    let shipped = fs::read_to_string(root().join("campaigns/facilities/reference.toml")).expect("the facility");
    let robot = root().join("campaigns/models/kr300_r2500.toml");
    let shipped = shipped.replace("../models/kr300_r2500.toml", &robot.display().to_string());
    let cases = [
        ("speed = [\"70 deg/s\"", "speed = [\"71 deg/s\"", "joint 1 may not move at"),
        ("stop_cycles = 10", "stop_cycles = 3", "is dead after 3"),
        ("tool_mass = \"12 kg\"", "tool_mass = 12", "kg"),
        ("force = \"1 kN\"", "force = \"-1 kN\"", "force"),
        ("margin = \"1 deg\"", "margim = \"1 deg\"", "margim"),
        ("jerk = [\"560e3 deg/s^3\", ", "jerk = [", "6"),
    ];
    for (old, new, reason) in cases {
        assert!(shipped.contains(old), "{old}");
        let path = folder.path().join("facility.toml");
        fs::write(&path, shipped.replace(old, new)).expect("a file");
        let printed = expect(2, &format!("{DRIVE} --virtual --facility {}", path.display()));
        assert!(printed.contains(reason) && printed.contains("facility.toml"), "{new}\n{printed}");
    }
    let effects = folder.path().join("effects.toml");
    for (text, reason) in [
        ("schema = \"effects/1\"\n[set]\n\"facility.loop_dely\" = \"9 ms\"\n", "loop_dely"),
        ("schema = \"effects/1\"\n[set]\n\"facility.loop_delay\" = 9\n", "facility.loop_delay"),
        ("schema = \"effects/2\"\n[set]\n", "effects/1"),
    ] {
        fs::write(&effects, text).expect("a file");
        let printed = expect(
            2,
            &format!("emulate campaigns/scenarios/probe_drogue.toml --effects {} --seconds 1", effects.display()),
        );
        assert!(printed.contains(reason), "{text}\n{printed}");
    }
    let printed = expect(2, "emulate campaigns/probe_drogue.toml --run 70000000 --seconds 1");
    assert!(printed.contains("run 70000000 of a campaign of"), "{printed}");
}

#[test]
fn kuka_configuration_files_are_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let words = format!("--robot1 rsi://10.0.0.1:59152 --rsi-config {}", folder.path().display());
    expect(0, &format!("{DRIVE} {words}"));
    let text = fs::read_to_string(folder.path().join("robot1_rsi_ethernet.xml")).expect("the file");
    assert!(text.contains("<IP_NUMBER>10.0.0.1</IP_NUMBER>") && text.contains("TAG=\"EK.E1\""), "{text}");
}

#[test]
fn tag_map_is_read_from_the_ethernet_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name);
    let write = |tags: &str, to: &str| {
        format!("{DRIVE} --robot1 rsi://10.0.0.1:59152?{tags} --rsi-config {}", file(to).display())
    };
    expect(0, &write("type=KROSHU", "first"));
    let written = fs::read_to_string(file("first/robot1_rsi_ethernet.xml")).expect("the file");
    let tags = format!("tags={}", file("first/robot1_rsi_ethernet.xml").display());
    expect(0, &write(&tags, "second"));
    assert_eq!(fs::read_to_string(file("second/robot1_rsi_ethernet.xml")).expect("the file"), written);
    // A configuration that lets the robot move after a lost answer is rejected, by drive and by emulate.
    fs::write(file("bad.xml"), written.replacen("INDX=\"3\" HOLDON=\"1\"", "INDX=\"3\" HOLDON=\"0\"", 1))
        .expect("written");
    let tags = format!("tags={}", file("bad.xml").display());
    let emulate = format!("emulate campaigns/probe_drogue.toml --run 1244 --robot1 rsi://127.0.0.1:59152?{tags}");
    for words in [write(&tags, "third"), emulate] {
        let printed = expect(2, &words);
        assert!(printed.contains("bad.xml") && printed.contains("ELEMENT TAG=\"AK.A2\": HOLDON is 0"), "{printed}");
    }
    let printed = expect(2, &write(&format!("{tags}&type=KROSHU"), "fourth"));
    assert!(printed.contains("SENTYPE of the file"), "{printed}");
}

#[test]
fn unarmable_fanuc_robot_is_rejected_with_the_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    let (stream, rmi) = (free_port(), free_port());
    let words = format!("--robot2 fanuc://127.0.0.1:{stream}?rmi={rmi} --arm --go-after-check --priority 0");
    let mut drive = command(&format!("{DRIVE} {words} --out {}", folder.path().join("drive").display()));
    // Its robots' locks are apart from those of other tests.
    let printed = outcome(2, drive.env("TMPDIR", folder.path()));
    // Long lines are broken.
    let printed = printed.replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(printed.contains(&format!("robot 2 at 127.0.0.1:{rmi} cannot be armed")), "{printed}");
    assert!(printed.contains("does not answer FRC_Connect_STMO: Connection refused"), "{printed}");
    assert!(!folder.path().join("drive").exists(), "nothing was driven");
}

/// Waits until a log has been flushed.
fn until_there(path: &PathBuf, bytes: u64) {
    let begin = Instant::now();
    while fs::metadata(path).map_or(0, |file| file.len()) < bytes {
        assert!(begin.elapsed() < Duration::from_secs(30), "{} stays small", path.display());
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Returns the replay of a log whose session was killed; `None` if it ended first, or had no cycle yet.
fn replay_of_a_killed_drive() -> Option<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("drive");
    // Real time, so that there is time to kill it.
    let words = format!("{DRIVE} --no-band --priority 0 --out {}", out.display());
    let mut child = command(&words).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("softdock starts");
    // Beyond the first chunk, before which a log holds no cycle.
    until_there(&out.join("log.mcap"), 300_000);
    child.kill().expect("killed");
    let killed = child.wait().expect("ended").code().is_none();
    let replay =
        command(&format!("replay --log {}", out.join("log.mcap").display())).output().expect("softdock starts");
    let printed = format!("{}{}", String::from_utf8_lossy(&replay.stdout), String::from_utf8_lossy(&replay.stderr));
    // On a slow machine the models alone may be in the file by then.
    if printed.contains("the log holds no cycle") {
        return None;
    }
    assert!(replay.status.success() && printed.contains("equal, bit for bit"), "{printed}");
    (killed && printed.contains("ends early")).then_some(printed)
}

#[test]
fn log_of_a_killed_drive_is_readable() {
    // A machine that stalls the session for longer than its rules allow ends it, and its log, before the kill.
    assert!((0..3).any(|_| replay_of_a_killed_drive().is_some()), "no session was killed before its end");
}

/// Returns the truth of a dry run on loopback against an emulated facility, or its output if it did not run to its end.
fn dry_run_against_an_emulated_facility() -> Result<serde_json::Value, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let (out, truth) = (folder.path().join("drive"), folder.path().join("truth.json"));
    let (one, two, http, rdt) = (free_port(), free_port(), free_port(), free_port());
    let links = format!(
        "--robot1 rsi://127.0.0.1:{one} --robot2 rsi://127.0.0.1:{two} --ft netft://127.0.0.1:{rdt}?http={http}"
    );
    // The drive starts after one second and takes eight; a link that falls silent before its end is noticed.
    let seconds = sized(12, 20);
    let words = format!(
        "emulate campaigns/probe_drogue.toml --run 1244 {links} --seconds {seconds} --truth {}",
        truth.display()
    );
    let emulator = command(&words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("softdock starts");
    std::thread::sleep(Duration::from_secs(1));
    let mut drive = command(&format!("{DRIVE} {links} --no-band --out {}", out.display()));
    let drive = drive.env("TMPDIR", folder.path()).output().expect("softdock starts");
    let output = format!("{}{}", String::from_utf8_lossy(&drive.stdout), String::from_utf8_lossy(&drive.stderr));
    let ended = emulator.wait_with_output().expect("the emulator ends by itself");
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
    if drive.status.code() != Some(0) {
        return Err(output);
    }
    assert!(output.contains("dry run") && output.contains("stopped by completed"), "{output}");
    Ok(serde_json::from_str(&fs::read_to_string(&truth).expect("the truth")).expect("JSON"))
}

#[test]
fn dry_run_sends_no_motion_to_an_emulated_robot() {
    // Both programs run in real time: a machine that stalls one of them for longer than the links allow ends the
    // session, which is correct. Only three stalls in a row are a finding of this test.
    let mut stalled = Vec::new();
    for _ in 0..3 {
        match dry_run_against_an_emulated_facility() {
            // Only the emulated robots of the dry run have met.
            Ok(truth) => return assert_eq!(truth["peak_contact_force"], 0.0),
            Err(output) => stalled.push(output),
        }
    }
    panic!("no dry run ended by itself:\n{}", stalled.join("\n"));
}

#[test]
fn every_protocol_is_in_the_help_and_rejects_foreign_options() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("never");
    let [drive, emulate] = ["drive --help", "emulate --help"].map(|words| expect(0, words));
    for row in softdock_realtime::links::PROTOCOLS {
        row.usage_lines().iter().for_each(|line| assert!(drive.contains(line.as_str()), "{line}\n{drive}"));
        row.emulated_usage_lines()
            .iter()
            .for_each(|line| assert!(emulate.contains(line.as_str()), "{line}\n{emulate}"));
        let device = if row.robot.is_some() { "--robot1" } else { "--ft" };
        let words = format!("{DRIVE} {device} {}://127.0.0.1?spin=3 --no-band --out {}", row.scheme, out.display());
        let printed = outcome(2, command(&words).env("TMPDIR", folder.path()));
        assert!(printed.contains("has no option `spin`"), "{}\n{printed}", row.scheme);
        assert!(!out.exists(), "{}: nothing is left", row.scheme);
    }
}
