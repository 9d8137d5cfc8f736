//! A program killed at any moment: repeating the command gives the same bytes as an undisturbed one.

use crate::mutations::Stream;
use crate::workshop::{Workshop, assert_same, copy};
use softdock_test_size::sized;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// Command with its initial folder and number of kills.
struct Work {
    command: &'static str,
    /// Folder whose copy the command changes; empty: it begins with nothing.
    begin: &'static str,
    /// Folder that the command writes.
    out: &'static str,
    kills: usize,
}

/// Parts of a campaign, a finished one, one to extend: what the commands begin with.
fn prepared() -> Workshop {
    let workshop = Workshop::new();
    workshop.edit("c/smoke.toml", "shard_runs = 32", "shard_runs = 8");
    workshop.edit("c/smoke.toml", "parity = \"25 %\"", "half_step = \"25 %\"");
    // Without the outer loop the draws do not depend on the number of runs, so that the campaign can be extended.
    workshop.edit(
        "c/smoke.toml",
        "class = \"epistemic\"                # fixed but unknown: one value per outer draw\n",
        "",
    );
    workshop.edit("c/smoke.toml", "[outer]                            # only with epistemic dispersions\n", "");
    workshop.edit("c/smoke.toml", "draws = 4                          # 4 x 16 runs\n", "");
    workshop.ended(&[0, 1], "run c/smoke.toml --backend cpu --runs 64 --out finished");
    workshop.ended(&[0, 1], "run c/smoke.toml --backend cpu --runs 28 --out small");
    workshop.ended(&[3], "run c/smoke.toml --backend cpu --runs 64 --shard 1/2 --out one");
    workshop.ended(&[3], "run c/smoke.toml --backend cpu --runs 64 --shard 2/2 --out two");
    copy(&workshop.path("c"), &workshop.path("j"));
    workshop.edit("j/smoke.toml", "at_most = \"400 N\"", "at_most = \"90 N\"");
    workshop
}

/// Gives a folder the state before a command.
fn reset(workshop: &Workshop, work: &Work) {
    let _ = fs::remove_dir_all(workshop.path(work.out));
    if !work.begin.is_empty() {
        copy(&workshop.path(work.begin), &workshop.path(work.out));
    }
}

/// Starts a command and kills it after a time; whether it was still running.
fn killed_after(workshop: &Workshop, command: &str, time: Duration) -> bool {
    let begin = Instant::now();
    let mut child = workshop.start(command);
    while begin.elapsed() < time {
        if child.try_wait().expect("a process").is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    child.kill().expect("kill -9");
    child.wait().expect("its end").code().is_none()
}

/// Returns the last phase of a command with traces in a folder.
fn phase(out: &Path) -> &'static str {
    let order = ["report.html", "summary.json", "half_step.parquet", "traces", "runs", "campaign.json"];
    order.into_iter().find(|name| out.join(name).exists()).unwrap_or("nothing")
}

#[test]
fn repeated_killed_commands_give_the_same_bytes() {
    let workshop = prepared();
    let works = [
        Work { command: "run c/smoke.toml --backend cpu --runs 64 --out o", begin: "", out: "o", kills: sized(2, 48) },
        Work { command: "judge o j/smoke.toml", begin: "finished", out: "o", kills: sized(2, 32) },
        Work { command: "merge o one two", begin: "", out: "o", kills: sized(1, 20) },
        Work {
            command: "run c/smoke.toml --backend cpu --runs 64 --out o",
            begin: "small",
            out: "o",
            kills: sized(1, 20),
        },
    ];
    let mut stream = Stream::new(20_261_128);
    let mut phases = std::collections::BTreeMap::<String, usize>::new();
    for work in works {
        reset(&workshop, &work);
        let begin = Instant::now();
        let code = workshop.ended(&[0, 1], work.command).code;
        let whole = begin.elapsed();
        let undisturbed = workshop.path("undisturbed");
        let _ = fs::remove_dir_all(&undisturbed);
        copy(&workshop.path(work.out), &undisturbed);
        for kill in 0..work.kills {
            reset(&workshop, &work);
            let time = whole.mul_f64(stream.below(1_000) as f64 / 950.0);
            let was_running = killed_after(&workshop, work.command, time);
            let phase = if was_running { phase(&workshop.path(work.out)) } else { "done" };
            let context = format!("{} from `{}`, kill {kill} after {time:?} at {phase}", work.command, work.begin);
            *phases.entry(format!("{} ({}): {phase}", &work.command[..5], work.begin)).or_default() += 1;
            // Sometimes once more.
            if stream.below(4) == 0 {
                killed_after(&workshop, work.command, whole.mul_f64(stream.below(1_000) as f64 / 1_000.0));
            }
            let again = workshop.run(work.command, Duration::from_secs(120));
            assert_eq!(again.code, code, "{context}\n{}\n{}", again.answer, again.printed);
            assert_same(&undisturbed, &workshop.path(work.out), &context);
        }
    }
    println!("kills by phase: {phases:#?}");
}
