//! `softdock serve`: results folders on loopback.

use serde_json::Value;
use softdock_farm::{Cancel, Context, RunOptions, Selection, Silent, load_campaign, run};
use softdock_serve::ResultsServer;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::time::{Duration, Instant};

/// Status, head and body of an answer.
fn get_as(address: SocketAddr, path: &str, host: &str) -> (u16, String, String) {
    let mut stream = TcpStream::connect(address).expect("the server");
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").expect("a request");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    let (head, body) = answer.split_once("\r\n\r\n").expect("head and body");
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).expect("a status");
    (status, head.to_lowercase(), body.to_owned())
}

pub(crate) fn get(address: SocketAddr, path: &str) -> (u16, String, String) {
    get_as(address, path, &address.to_string())
}

fn json(address: SocketAddr, path: &str) -> Value {
    let (status, _, body) = get(address, path);
    assert_eq!(status, 200, "{path}: {body}");
    serde_json::from_str(&body).unwrap_or_else(|error| panic!("{path}: {error}: {body}"))
}

/// Asks until the answer is there.
fn answered(address: SocketAddr, path: &str) -> Value {
    let begun = Instant::now();
    loop {
        let answer = json(address, path);
        if answer["pending"].is_null() {
            return answer["answer"].clone();
        }
        assert!(begun.elapsed() < Duration::from_secs(60), "{path}: {answer}");
    }
}

fn make(out: &Path, seed: u64) {
    let (observer, cancel) = (Silent, Cancel::default());
    let context = Context { observer: &observer, cancel: &cancel };
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("campaigns/smoke.toml");
    let selection = Selection { runs: Some(24), seed: Some(seed), ..Selection::default() };
    let campaign = load_campaign(&file, &selection, context).expect("a campaign");
    run(campaign, out, &RunOptions::default(), context).expect("results");
}

#[test]
fn results_are_listed_shown_and_compared_and_nothing_else_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().join("results");
    make(&root.join("one"), 1);
    make(&root.join("deep/two"), 2);
    std::fs::write(folder.path().join("secret.html"), "secret").expect("a file");
    std::fs::write(root.join("one/notes.html"), "no page of softdock").expect("a file");
    let server = ResultsServer::start(&root, "127.0.0.1:0").expect("a server");
    let address = server.address();

    let (status, head, index) = get(address, "/");
    assert_eq!(status, 200);
    assert!(
        index.contains("<h1>Results</h1>") && head.contains("content-security-policy: default-src 'none'"),
        "{head}"
    );

    let listed = json(address, "/api/folders");
    let folders = listed["folders"].as_array().expect("a list");
    let mut names: Vec<&str> = folders.iter().map(|folder| folder["name"].as_str().expect("a name")).collect();
    names.sort_unstable();
    assert_eq!(names, ["deep/two", "one"]);
    for found in folders {
        assert_eq!(
            (&found["campaign"], &found["runs_done"], &found["runs_planned"]),
            (&"smoke".into(), &24.into(), &24.into())
        );
        assert_eq!((&found["pages"][0], &found["is_growing"]), (&"report.html".into(), &false.into()));
        assert!(["verified", "not_verified"].contains(&found["verdict"].as_str().expect("a word")), "{found}");
    }

    let live = answered(address, "/api/live/deep%2Ftwo");
    assert_eq!((&live["kind"], &live["partial_runs"]), (&"campaign".into(), &0.into()));
    assert_eq!(live["summary"]["completeness"]["runs_done"], 24);
    assert!(live["notes"].to_string().contains("summary.json"), "{live}");
    let compared = answered(address, "/api/compare/one/deep%2Ftwo");
    assert!(compared["text"].as_str().expect("a text").contains("keys that differ"), "{compared}");

    let (status, head, page) = get(address, "/page/one/report.html");
    assert!(status == 200 && head.contains("text/html") && page.contains("Verification report"));

    for path in [
        "/page/one/notes.html",
        "/page/one/campaign.json",
        "/page/..%2F/secret.html",
        "/page/one/..%2F..%2Fsecret.html",
        "/page/one%2F..%2F..%2F/report.html",
        "/page/three/report.html",
        "/api/live/..",
        "/api/compare/one/%2Fetc",
    ] {
        assert_eq!(get(address, path).0, 404, "{path}");
    }
    // The written summary of a folder that has lost runs is not shown.
    std::fs::remove_file(root.join("one/runs/shard=00000.parquet")).expect("a shard");
    assert_eq!(answered(address, "/api/live/one")["summary"]["completeness"]["runs_done"], 0);
    // A page elsewhere reaches this address under another name.
    assert_eq!(get_as(address, "/api/folders", "evil.example:80").0, 403);
}

#[test]
fn only_loopback_addresses_are_served() {
    let folder = tempfile::tempdir().expect("a folder");
    for (address, reason) in [("0.0.0.0:0", "reachable from other machines"), ("here", "no address of a page")] {
        let error = ResultsServer::start(folder.path(), address).map(|_| ()).expect_err("a refusal").to_string();
        assert!(error.contains(reason), "{error}");
    }
}
