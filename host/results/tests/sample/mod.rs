//! Made-up runs with every kind of row: passing, failing, invalid, without capture.

use std::path::Path;

use softdock_kernels::fields::from_slice;
use softdock_kernels::metrics::flags;
use softdock_results::runs::{
    Agreement, Cause, CustomMetricColumn, KeyColumn, LoopRow, Outcome, Phase, RequirementColumn, RequirementResult,
    RunRow, RunsSchema, Status, input_fields, metric_fields,
};
use softdock_results::shards::{Origin, Provenance, ShardPlan, write_shard};

/// 25 runs in shards of 10: the last shard is shorter.
pub(crate) const PLAN: ShardPlan = ShardPlan { runs: 25, shard_runs: 10 };

/// One requirement on a force.
pub(crate) fn schema() -> RunsSchema {
    let own = CustomMetricColumn { column: "share".to_owned(), unit: "1".to_owned(), meaning: "a share".to_owned() };
    let key = KeyColumn {
        column: "in_scenario_latch_depth_m".to_owned(),
        unit: "m".to_owned(),
        meaning: "`scenario.latch.depth`".to_owned(),
    };
    RunsSchema::new(vec![key], vec![own], vec![RequirementColumn { id: "dck_010".to_owned(), unit: "N".to_owned() }])
}

/// Where the made-up runs come from.
pub(crate) fn origin() -> Origin {
    let [campaign_hash, version, commit] = ["abc", "0.1.0", "0123456789ab"].map(str::to_owned);
    Origin { campaign_hash, seed: 7, version, commit }
}

/// Where the files say they come from.
pub(crate) fn provenance() -> Provenance {
    Provenance {
        origin: origin(),
        backend: "cpu".to_owned(),
        device: "test lanes".to_owned(),
        more: vec![("campaign_toml".to_owned(), "id = \"test\"".to_owned())],
    }
}

/// A run whose every number depends on its run number.
pub(crate) fn row(run: u64) -> RunRow {
    let number = |at: usize| (run as f64 + 1.0) / (at as f64 + 3.0);
    let metrics: Vec<f64> = (0..metric_fields().len()).map(number).collect();
    let hil: softdock_kernels::metrics::Metrics<f64> = from_slice(&metrics);
    let mut space = softdock_kernels::metrics::Metrics { injected_energy: 0.0, ..hil };
    if run.is_multiple_of(5) {
        space.capture_time = -1.0;
    }
    let (invalid, aborted) = (run == 6, run % 7 == 3);
    let (space_pass, hil_pass) = (!run.is_multiple_of(3), !run.is_multiple_of(4));
    let result = |pass: Option<bool>| match pass {
        Some(pass) if !invalid => RequirementResult { margin: Some(number(1)), pass: Some(pass) },
        _ => RequirementResult::default(),
    };
    let ended = |outcome: Outcome, metrics, pass| {
        let id = if outcome == Outcome::Aborted { "injected_energy" } else { "capture" };
        let cause = Cause {
            id: id.to_owned(),
            time: Some(number(3)),
            value: (outcome == Outcome::Aborted).then_some(number(4)),
            limit: Some(number(5)),
            phase: Some(Phase::Contact),
        };
        let outcome = if invalid { Outcome::Invalid } else { outcome };
        let cause = (outcome != Outcome::Pass).then_some(cause);
        LoopRow { outcome, cause, metrics, custom_metrics: vec![Some(number(6))], requirements: vec![result(pass)] }
    };
    let judged = |pass| if pass { Outcome::Pass } else { Outcome::Fail };
    let answer = (!aborted).then_some(hil_pass);
    let status = if space_pass { Status::Pass } else { Status::Fail };
    RunRow {
        run,
        outer: (run / 10) as u32,
        status: if invalid { Status::Invalid } else { status },
        agreement: if invalid { Agreement::Invalid } else { Agreement::of(space_pass, answer) },
        flags: if invalid { flags::SPACE_NON_FINITE } else { 0 },
        inputs: (0..=input_fields().len()).map(number).collect(),
        effective_mass: (!invalid).then_some(number(2)),
        space: ended(judged(space_pass), space, Some(space_pass)),
        hil: ended(answer.map_or(Outcome::Aborted, judged), hil, answer),
    }
}

/// Writes some shards of the made-up campaign.
pub(crate) fn fill(results: &Path, shards: &[u32]) {
    for shard in shards {
        let rows = PLAN.range(*shard).map(row).collect();
        write_shard(results, *shard, &schema(), rows, &provenance()).expect("a shard");
    }
}
