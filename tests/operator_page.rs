//! The operator's page of a session on emulated robots, in a headless browser.

use crate::drive::free_port;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

/// A process that ends with the test.
struct Running(Option<Child>);

impl Running {
    fn start(words: &str) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_softdock"));
        command.current_dir(env!("CARGO_MANIFEST_DIR")).args(words.split_whitespace());
        let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        Self(Some(command.spawn().expect("softdock starts")))
    }

    /// Reads what it prints until the address of its page; [`Self::output`] returns the rest.
    fn page(&mut self) -> String {
        let stdout = self.0.as_mut().and_then(|child| child.stdout.as_mut()).expect("a pipe");
        let (mut printed, mut byte) = (String::new(), [0]);
        // Byte by byte: a buffer would keep what belongs to the rest.
        while stdout.read(&mut byte).expect("what it prints") == 1 {
            printed.push(char::from(byte[0]));
            let address = printed.lines().last().and_then(|line| line.trim().strip_prefix("page "));
            if let Some(address) = address.filter(|_| byte[0] == b'\n') {
                return address.trim().to_owned();
            }
        }
        let stderr = self.0.as_mut().and_then(|child| child.stderr.as_mut()).expect("a pipe");
        stderr.read_to_string(&mut printed).expect("what it prints");
        panic!("no page:\n{printed}");
    }

    fn output(mut self) -> Output {
        self.0.take().expect("a process").wait_with_output().expect("its output")
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

#[test]
#[ignore = "needs a browser: SOFTDOCK_BROWSER=chromium"]
fn browser_shows_checks_starts_and_stops() {
    let browser = std::env::var("SOFTDOCK_BROWSER").expect("SOFTDOCK_BROWSER names a Chromium");
    let folder = tempfile::tempdir().expect("a folder");
    let [one, two, ft, http] = [(); 4].map(|()| free_port());
    let links = format!(
        "--robot1 rsi://127.0.0.1:{one} --robot2 rsi://127.0.0.1:{two} --ft netft://127.0.0.1:{ft}?http={http}"
    );
    let out = folder.path().join("drive");
    let _emulated = Running::start(&format!("emulate campaigns/probe_drogue.toml --run 1244 {links} --seconds 120"));
    let mut drive = Running::start(&format!(
        "drive campaigns/probe_drogue.toml --run 1244 {links} --to-start --arm --serve 127.0.0.1:0 --no-band --out {}",
        out.display()
    ));
    let page = drive.page();
    let shown = Command::new("python3")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/operator_page.py"))
        .args([&browser, &page])
        .arg(folder.path().join("page.png"))
        .output()
        .expect("python3 starts");
    let printed = String::from_utf8_lossy(&shown.stderr).into_owned();
    if !shown.status.success() {
        drop(_emulated);
        let output = drive.output();
        panic!("{printed}\n{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    }
    let shown: serde_json::Value = serde_json::from_slice(&shown.stdout).expect("JSON");
    assert_eq!(shown["foreign"], 403, "a command without the page's token is refused");
    let checks = shown["checks"].as_array().expect("a list");
    assert!(checks.len() > 40, "{checks:?}");
    assert!(checks.iter().all(|row| row[0] == "ok" || row[0] == "-"), "{checks:?}");
    let rest = checks.iter().find(|row| row[2] == "force at rest without the weight of its tool").expect("a row");
    assert_eq!((&rest[1], &rest[4]), (&"sensor".into(), &"at most 100.0 N".into()));
    assert_eq!(shown["wide"], false, "nothing is wider than the window");
    let result = shown["result"].as_str().expect("words");
    assert!(result.contains("stopped by operator"), "{result}");
    assert_eq!(shown["over"], "stopped");

    let output = drive.output();
    assert_eq!(output.status.code(), Some(3), "{}", String::from_utf8_lossy(&output.stdout));
    let answer = std::fs::read_to_string(out.join("drive.json")).expect("an answer");
    let answer: serde_json::Value = serde_json::from_str(&answer).expect("JSON");
    assert_eq!((&answer["cause"], &answer["outcome"]), (&"operator".into(), &"not_completed".into()));
    if let Some(kept) = std::env::var_os("SOFTDOCK_KEEP_PICTURE") {
        std::fs::copy(folder.path().join("page.png"), kept).expect("a picture");
    }
}

#[test]
fn page_is_served_on_loopback_only() {
    let drive = "drive campaigns/probe_drogue.toml --run 1244 --no-band";
    for (address, printed) in [("0.0.0.0:0", "reachable from other machines"), ("here", "no address of a page")] {
        let output =
            Running::start(&format!("{drive} --serve {address} --out {}", std::env::temp_dir().join("x").display()));
        let output = output.output();
        assert_eq!(output.status.code(), Some(2), "{address}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(printed), "{address}: {output:?}");
    }
}
