//! Unfinished shards: what was finished comes back to its own campaign and device, and nobody takes it for a shard.

mod sample;

use std::fs;

use sample::{PLAN, fill, origin, provenance, row, schema};
use softdock_results::merge::{MergeError, check_merge};
use softdock_results::partial::{
    PartialShard, partial_path, partial_runs, read_partial, remove_partial, reopen_shard, write_partial,
};
use softdock_results::shards::{Origin, Provenance, ShardIndex, ShardPlan, shard_path};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn read(results: &std::path::Path, own: &Provenance) -> PartialShard {
    read_partial(results, 1, |run| PLAN.range(1).contains(&run), &schema(), own)
}

#[test]
fn finished_runs_come_back_bit_for_bit_and_are_no_shard() {
    let results = folder();
    assert_eq!(read(results.path(), &provenance()), PartialShard::Absent);
    // In any order, one of them twice, and one that is not of this shard.
    let rows = [17, 11, 12, 11, 3].map(row).to_vec();
    write_partial(results.path(), 1, &schema(), rows, &provenance()).expect("written");
    let kept = [11, 12, 17].map(row).to_vec();
    assert_eq!(read(results.path(), &provenance()), PartialShard::Usable(kept));
    assert_eq!(partial_runs(results.path()).expect("a folder"), 4);
    let scan = || ShardIndex::scan(results.path(), PLAN, &origin()).expect("a folder");
    assert!(scan().complete.is_empty() && scan().foreign.is_empty());
    // Not even in the place of a shard.
    fs::create_dir(results.path().join("runs")).expect("made");
    fs::copy(partial_path(results.path(), 1), shard_path(results.path(), 1)).expect("copied");
    assert!(scan().complete.is_empty() && scan().foreign[0].1.contains("schema is `partial/1`"));
    remove_partial(results.path(), 1).expect("removed");
    remove_partial(results.path(), 1).expect("it is gone already");
    assert!(!results.path().join("partial").exists());
}

#[test]
fn rows_of_another_campaign_seed_version_or_device_are_not_used() {
    let results = folder();
    write_partial(results.path(), 1, &schema(), vec![row(11)], &provenance()).expect("written");
    let other_cpu = Provenance { device: "other lanes".to_owned(), ..provenance() };
    assert!(matches!(read(results.path(), &other_cpu), PartialShard::Usable(_)), "all CPUs give equal rows");
    let of = |origin: Origin| Provenance { origin, ..provenance() };
    let others = [
        ("campaign_hash", of(Origin { campaign_hash: "other".to_owned(), ..origin() })),
        ("seed", of(Origin { seed: 8, ..origin() })),
        ("version", of(Origin { version: "0.2.0".to_owned(), ..origin() })),
        ("commit", of(Origin { commit: "another".to_owned(), ..origin() })),
        ("backend", Provenance { backend: "gpu".to_owned(), ..provenance() }),
    ];
    for (key, own) in others {
        let PartialShard::Unusable(reason) = read(results.path(), &own) else { panic!("{key}") };
        assert!(reason.starts_with(&format!("{key} is `")), "{reason}");
    }
    let gpu = Provenance { backend: "gpu".to_owned(), ..provenance() };
    write_partial(results.path(), 1, &schema(), vec![row(11)], &gpu).expect("written");
    let other_gpu = Provenance { device: "other".to_owned(), ..gpu.clone() };
    assert!(matches!(read(results.path(), &gpu), PartialShard::Usable(_)));
    assert!(matches!(read(results.path(), &other_gpu), PartialShard::Unusable(_)));
    fs::write(partial_path(results.path(), 1), "PAR1 not quite").expect("damaged");
    assert!(matches!(read(results.path(), &gpu), PartialShard::Unusable(_)));
}

#[test]
fn the_last_shard_of_a_campaign_that_gets_more_runs_is_reopened() {
    let results = folder();
    fill(results.path(), &[0, 1, 2]);
    let index = ShardIndex::scan(results.path(), PLAN, &origin()).expect("a folder");
    reopen_shard(results.path(), 2, &index.complete[&2]).expect("reopened");
    let grown = ShardPlan { runs: 40, ..PLAN };
    let range = grown.range(2);
    let kept = read_partial(results.path(), 2, |run| range.contains(&run), &schema(), &provenance());
    assert_eq!(kept, PartialShard::Usable((20..25).map(row).collect()));
    assert!(shard_path(results.path(), 2).is_file(), "its caller removes it");
}

#[test]
fn a_merge_takes_no_unfinished_shard() {
    let results = folder();
    fill(results.path(), &[0, 2]);
    write_partial(results.path(), 1, &schema(), (10..20).map(row).collect(), &provenance()).expect("written");
    let gaps = check_merge(&[results.path().to_owned()], PLAN, &origin());
    assert!(matches!(gaps, Err(MergeError::Gaps { missing, .. }) if missing == [1]));
}
