//! Inputs beyond every limit: rejected with exit code 2, a place and a remedy, without output.

use crate::workshop::Workshop;
use softdock_results::{Column, ColumnKind, Table, Values, write_table};
use std::fs;
use std::path::Path;

/// The commands that read a campaign.
const CHECK: &str = "check b/campaign.toml";
const RUN: &str = "run b/campaign.toml --backend cpu --runs 8 --out o";

/// Damages one place of a file and expects both commands to reject it.
fn rejected(file: &str, old: &str, new: &str, parts: &[&str]) {
    let workshop = Workshop::new();
    workshop.edit(file, old, new);
    workshop.rejected(CHECK, parts);
    workshop.rejected(RUN, parts);
}

#[test]
fn texts_beyond_their_length_are_rejected() {
    let long = "x".repeat(70_000);
    let limit = ["at most 10000 characters", "shorten it"];
    let with = |place: &'static str| [&[place][..], &limit].concat();
    rejected("b/campaign.toml", "A valid campaign that the tests spoil", &long, &with("campaign.toml:3:9"));
    rejected("b/campaign.toml", "\"REQ-1\"", &format!("\"{long}\""), &with("requirement[1].id"));
    rejected("b/campaign.toml", "Peak force stays below 80 N.", &long, &with("requirement[1].text"));
    rejected("b/campaign.toml", "\"cpu\"", &format!("\"{long}\""), &with("execution.backend"));
    rejected("b/campaign.toml", "seed = 7", &format!("seed = 7\n{long} = 1"), &["the key has 70000 characters"]);
    rejected("b/scenario.toml", "title = \"", &format!("title = \"{long}"), &with("title"));
    rejected("b/campaign.toml", "file = \"delays.csv\"", &format!("file = \"{long}\""), &with("dist.file"));
}

#[test]
fn expressions_beyond_their_length_or_depth_are_rejected() {
    let old = "2/3 * contact_stiffness";
    let part = ["derived[1].expr", "at most 10000 characters"];
    rejected("b/campaign.toml", old, &format!("1{}", "+1".repeat(100_000)), &part);
    rejected("b/campaign.toml", old, &"(".repeat(100_000), &part);
    let part = ["campaign.toml:37", "derived[1].expr", "more than 500 terms"];
    rejected("b/campaign.toml", old, &format!("1{}", "+1".repeat(4_000)), &part);
    rejected("b/campaign.toml", old, &format!("2{}", "^1*1".repeat(2_000)), &part);
    let part = ["derived[1].expr", "more than 64 nested parentheses or signs"];
    for nested in ["(".repeat(5_000), "-".repeat(5_000), "sqrt(".repeat(1_900), "2^".repeat(4_000)] {
        rejected("b/campaign.toml", old, &nested, &part);
    }
}

#[test]
fn nesting_beyond_64_levels_is_rejected() {
    let part = ["at most 64 levels", "nested more than 64 levels deep"];
    let deep = 100_000;
    for value in ["[".repeat(deep), "{a=".repeat(deep), format!("{}1{}", "[".repeat(deep), "]".repeat(deep))] {
        rejected("b/campaign.toml", "seed = 7", &format!("seed = {value}"), &part);
    }
    rejected("b/scenario.toml", "title = ", &format!("{}a = 1\ntitle = ", "a.".repeat(deep)), &part);
    rejected("b/arm.urdf", "</robot>", &format!("{}</robot>", "<link>".repeat(deep)), &part);
    let closed = format!("{}{}</robot>", "<a>".repeat(deep), "</a>".repeat(deep));
    rejected("b/arm.urdf", "</robot>", &closed, &part);
    let many = (0..2_000).map(|n| format!("<link name=\"l{n}\"/>")).collect::<String>();
    rejected("b/arm.urdf", "</robot>", &format!("{many}</robot>"), &["at most 1000", "links"]);
}

#[test]
fn files_beyond_their_size_are_rejected_before_they_are_read() {
    for (file, limit) in [("campaign.toml", "4.0 MiB"), ("scenario.toml", "4.0 MiB"), ("delays.csv", "256.0 MiB")] {
        let workshop = Workshop::new();
        // Sparse: it occupies nothing.
        let made = fs::File::options().write(true).open(workshop.path(&format!("b/{file}")));
        made.and_then(|file| file.set_len(1 << 30)).expect("a file of 1 GiB");
        workshop.rejected(RUN, &["has 1.0 GiB, the limit is", limit, "name a smaller file"]);
    }
}

#[test]
fn thousands_of_problems_are_counted_and_not_listed() {
    let wrong =
        "[[dispersion]]\ntarget = \"nonsense\"\ndist = { kind = \"uniform\", min = \"1 m\", max = \"2 m\" }\n\n";
    let many = format!("{}[[correlation]]", wrong.repeat(2_000));
    rejected("b/campaign.toml", "[[correlation]]", &many, &["more problems are not listed"]);
}

#[test]
fn a_campaign_of_more_than_a_million_shards_is_rejected() {
    let cut = "runs = 1000000000\nexecution = { backend = \"cpu\", shard_runs = 999 }\n#";
    let parts = ["execution.shard_runs", "1001002 shards", "write shard_runs = 1000 or more"];
    let workshop = Workshop::new();
    workshop.edit("b/campaign.toml", "execution", "# execution");
    workshop.edit("b/campaign.toml", "runs = 100", cut);
    workshop.rejected(CHECK, &parts);
}

#[cfg(unix)]
#[test]
fn links_in_a_results_folder_are_followed_once_and_never_deleted_through() {
    let workshop = Workshop::new();
    workshop.ended(&[0, 1], "run c/smoke.toml --backend cpu --runs 16 --out r");
    workshop.ended(&[0, 1], "run c/smoke.toml --backend cpu --runs 16 --out other");
    let traces = workshop.path("r/traces");
    fs::remove_dir_all(&traces).expect("removed");
    std::os::unix::fs::symlink(workshop.path("other/traces"), &traces).expect("a link");
    workshop.rejected("run c/smoke.toml --backend cpu --runs 16 --out r --fresh", &["leads out of the folder"]);
    fs::remove_file(&traces).expect("removed");
    for name in ["one", "two", "three"] {
        std::os::unix::fs::symlink(workshop.path("r"), workshop.path("r").join(name)).expect("a link in a circle");
    }
    let ended = workshop.run("verify r", crate::watchdog::LIMIT);
    assert!(matches!(ended.code, Some(0..=3)), "{:?}: {}", ended.code, ended.printed);
}

/// A Parquet file of a few megabytes whose column would take gigabytes.
fn bomb(path: &Path, parts: u64) {
    let column = |rows| Column {
        name: "in_loop_delay_s".to_owned(),
        unit: "s".to_owned(),
        description: "constant".to_owned(),
        source: "test".to_owned(),
        kind: ColumnKind::Input,
        values: Values::F64(vec![Some(0.004); rows]),
    };
    let rows = usize::try_from(parts).expect("small") * 1_000_000;
    write_table(path, &Table { columns: vec![column(rows)] }, &[]).expect("written");
}

#[test]
fn tables_that_expand_beyond_the_limit_are_rejected() {
    // A file of some megabytes can reach the whole limit of 134,217,728 values; that takes a while to write.
    let (parts, workshop) = (softdock_test_size::sized(1, 140), Workshop::new());
    let path = workshop.path("cases.parquet");
    bomb(&path, parts);
    let bytes = fs::metadata(&path).expect("a file").len();
    assert!(bytes < 16 << 20, "{bytes} bytes");
    let command = "run b/campaign.toml --backend cpu --out o --cases cases.parquet";
    match softdock_test_size::is_full() {
        true => workshop.rejected(command, &["140000000 rows of 1 columns: more than 134217728 values"]),
        false => {
            let columns = softdock_results::foreign::number_columns(&path, &["in_loop_delay_s"]).expect("in the limit");
            assert_eq!(columns[0].len(), 1_000_000);
        }
    }
}

#[cfg(unix)]
#[test]
fn pipes_devices_and_folders_in_the_place_of_files_are_rejected_at_once() {
    let workshop = Workshop::new();
    workshop.ended(&[0, 1], "run c/smoke.toml --backend cpu --runs 16 --out r");
    let replaced = |file: &str, commands: &[&str], parts: &[&str]| {
        let (path, kept) = (workshop.path(file), workshop.path("kept"));
        fs::rename(&path, &kept).expect("put aside");
        let made = std::process::Command::new("mkfifo").arg(&path).status();
        assert!(made.expect("mkfifo").success());
        for command in commands {
            workshop.rejected(command, parts);
        }
        fs::remove_file(&path).expect("removed");
        std::os::unix::fs::symlink("/dev/zero", &path).expect("a link");
        for command in commands {
            workshop.rejected(command, &["is no regular file but a device"]);
        }
        fs::remove_file(&path).expect("removed");
        fs::rename(&kept, &path).expect("put back");
    };
    let pipe = ["is no regular file but a named pipe", "name a regular file"];
    for file in ["b/campaign.toml", "b/scenario.toml", "b/arm.urdf", "b/delays.csv"] {
        replaced(file, &[CHECK, RUN], &pipe);
    }
    fs::write(workshop.path("cases.csv"), "loop_delay\n0.004\n").expect("written");
    fs::write(workshop.path("cases.parquet"), "PAR1").expect("written");
    for file in ["cases.csv", "cases.parquet"] {
        replaced(file, &[&format!("run c/smoke.toml --backend cpu --out o --cases {file}")], &pipe);
    }
    let again = "run c/smoke.toml --backend cpu --runs 16 --out r";
    replaced("r/campaign.json", &["status r", "report r", "verify r", "judge r", "merge m r", again], &pipe);
    fs::write(workshop.path("log.mcap"), "").expect("written");
    replaced("log.mcap", &["replay --log log.mcap"], &["is no regular file but a named pipe"]);
    // Recordings.
    let pipe = workshop.path("pipe.csv");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
    let rig = softdock_campaign::Rig::load(&workshop.path("c/rigs/cube_toss.toml")).expect("shipped");
    let robot = softdock_campaign::Robot::load(&workshop.path("c/models/kr300_r2500.toml")).expect("shipped");
    let answers = [
        softdock_diagnosis::data::grid::read(&pipe, &rig).err(),
        softdock_identify::log::Recording::read(&pipe, &robot).err(),
        softdock_identify::published_errors::read_published_errors(&pipe, 6).err(),
    ];
    for error in answers {
        let error = error.expect("a pipe");
        assert!(error.to_string().contains("is no regular file but a named pipe"), "{error}");
        assert!(error.remedy().contains("name a regular file"), "{}", error.remedy());
    }
    // A shard: it counts for nothing, is kept aside, and is made again.
    let shard = workshop.path("r/runs/shard=00000.parquet");
    let whole = fs::read(&shard).expect("a shard");
    fs::remove_file(&shard).expect("removed");
    assert!(std::process::Command::new("mkfifo").arg(&shard).status().expect("mkfifo").success());
    workshop.ended(&[3], "status r");
    workshop.ended(&[0, 1], again);
    assert_eq!(fs::read(&shard).expect("made again"), whole);
    assert!(workshop.path("r/runs/shard=00000.parquet.damaged-1").exists(), "the pipe is kept");
}

#[test]
fn a_manifest_that_was_edited_by_hand_is_rejected() {
    let workshop = Workshop::new();
    workshop.ended(&[0, 1], "run c/smoke.toml --backend cpu --runs 16 --out r");
    let text = fs::read_to_string(workshop.path("r/campaign.json")).expect("a manifest");
    let cases = [
        ("\"runs\": 16", "\"runs\": 1000000000000000000", "from 1 to 1000000000"),
        ("\"runs\": 16", "\"runs\": 0", "from 1 to 1000000000"),
        ("\"campaign\": \"smoke.toml\"", "\"campaign\": \"../../etc/passwd\"", "without `..`"),
        ("\"campaign\": \"smoke.toml\"", "\"campaign\": \"/etc/passwd\"", "a relative path below"),
        ("\"seed\"", "\"model\": \"../../x.toml\", \"seed\"", "without `..`"),
        ("\"seed\"", "\"cases\": \"/etc/passwd\", \"seed\"", "`cases.csv` or `cases.parquet`"),
    ];
    for (old, new, part) in cases {
        assert!(text.contains(old), "{old} in {text}");
        fs::write(workshop.path("r/campaign.json"), text.replacen(old, new, 1)).expect("written");
        for command in ["status r", "report r", "verify r", "judge r", "run c/smoke.toml --backend cpu --out r"] {
            workshop.rejected(command, &["campaign.json:", part, "restore the file"]);
        }
    }
    for text in ["", "{", "[]", &"[".repeat(100_000)] {
        fs::write(workshop.path("r/campaign.json"), text).expect("written");
        workshop.rejected("status r", &["campaign.json"]);
    }
}
