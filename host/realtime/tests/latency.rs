//! Real-time performance of the machine: reports lateness and round trip at 1 kHz, without a threshold.

use softdock_campaign::{Campaign, Station};
use softdock_kernels::philox;
use softdock_kernels::plant::Plant;
use softdock_realtime::drive::core::SessionTask;
use softdock_realtime::latency::{Between, Latency, measure};
use softdock_realtime::process::Realtime;
use std::path::PathBuf;
use std::sync::Arc;

fn shipped(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../campaigns").join(file)
}

/// A docking of the shipped campaign for a time \[s\].
fn measured(between: Between, seconds: f64, realtime: Realtime) -> Latency {
    let campaign: Campaign = softdock_campaign::load(&shipped("probe_drogue.toml")).expect("a shipped campaign");
    let station = Station::load(&shipped("facilities/reference.toml")).expect("the shipped facility");
    let run = 1244;
    let params = campaign.draw(run).expect("a draw").params;
    let plant = Arc::new(Plant::new(campaign.scenario.model.clone()));
    let task = SessionTask { armed: true, ..SessionTask::new(plant, Arc::new(station), run, params) };
    measure(&task, philox::key(campaign.seed), between, seconds, realtime).expect("a measurement")
}

const ORDINARY: Realtime = Realtime { priority: None, core: None, strict: false };

#[test]
fn session_runs_in_process_and_over_loopback() {
    for between in [Between::Nothing, Between::Loopback] {
        let latency = measured(between, 2.0, ORDINARY);
        println!("{between:?}\n{latency}");
        // No threshold on times: a machine under test may be busy.
        assert!(latency.lateness.total() > 100, "{latency}");
        assert_eq!(latency.lateness.total(), latency.round_trip.total());
    }
}

/// `cargo test --release -p softdock-realtime --test latency -- --ignored --nocapture`
#[test]
#[ignore = "a measurement of four minutes"]
fn measure_one_minute_each() {
    for between in [Between::Nothing, Between::Loopback] {
        for realtime in [ORDINARY, Realtime::default()] {
            let policy = if realtime.priority.is_some() { "SCHED_FIFO 80" } else { "SCHED_OTHER" };
            println!("{between:?}, {policy}, 60 s at 1 kHz\n{}", measured(between, 60.0, realtime));
        }
    }
}
