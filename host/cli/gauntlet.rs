//! `softdock bench diagnosis`: runs the missing cases of the gauntlet, then scores all finished ones.

use crate::progress::{Terminal, stopped};
use crate::terminal::{Exit, Format, Outcome, warn, write};
use crate::values::named;
use clap::Args;
use serde_json::json;
use softdock_bench::cases::{count_missing, lay_out_case, run_missing, score_files, selected};
use softdock_bench::plan::{Case, Extent, MachineKind, WantedCases, plan, shard};
use softdock_bench::real::cases::{RealCase, cases};
use softdock_bench::real::sets::{MeasuredSet, SETS};
use softdock_bench::real::trial::RealRecord;
use softdock_bench::real::{self, trial};
use softdock_bench::record::Ledger;
use softdock_bench::score::{score, scored};
use softdock_bench::{GauntletError, summary_text};
use softdock_diagnosis::report::command_line::CommandLine;
use softdock_farm::{Part, default_results, page_origin};
use std::path::{Path, PathBuf};

/// Environment variable with the folder of the measured data.
const DATA: &str = "SOFTDOCK_DATA";

/// Score the diagnosis on recordings with known causes: correct names, false alarms, intervals, cost.
#[derive(Args, Debug)]
#[command(after_help = "\
Effects are hidden in recordings of simulated rigs, in multiples of s*, the smallest size that an oracle detects in the
same data. The truth is sealed (BLAKE3) before the diagnosis gets model and recordings, and opened to score it.

A perturbed machine (--machine perturbed) differs from its model in 3 to 8 further ways, each of 0.3 to 1 s* or of the
model's tolerance: effects of the catalogue, other friction laws, elastic parts. Its s* is that in the same machine. A
perturbation that is named at about its true size is neither a right nor a wrong name.

A demand is met if the exact 95 % interval is within it, and NOT MET if the exact intervals of all demands, which hold
jointly with 99 %, exclude it. Otherwise it is not refuted: more cases would decide.

Each finished case is one line of answers-*.jsonl in the folder, and is not run again, nor is s* (scales-*.jsonl): the
same command resumes. Workers share a folder by --shard; the score counts the finished cases of all. Seconds of one
core that a case takes: command 3, body 5, sensor, drive and contact 7, robot 30, facility 60 to 150. The full
size has 5280 cases of the drive, 2280 of the sensor, 2700 of the contact, 1760 of the command, 1180 of the body, and
324 of the facility. Each perturbation of a perturbed machine needs its s* once a plant: about 7 s, a few minutes in all.

Exit codes: 0 no demand is refuted, 1 some demand is NOT MET, 2 bad input, 3 cases are missing.

Examples:
  softdock bench diagnosis
  softdock bench diagnosis --size full --plants drive --shard 2/8 --out /data/score    (the second of eight workers)
  softdock bench diagnosis --size full --only null --out /data/score                   (cases without an effect)
  softdock bench diagnosis --size full --only effect --multiples 2,4 --out /data/score (effects that must be named)
  softdock bench diagnosis --size full --machine perturbed --plants drive --draws 2 --out /data/perturbed
  softdock bench diagnosis --size full --out /data/score --score
  softdock bench diagnosis --real --data /data/measured --out /data/real               (effects planted in measured recordings)
  softdock bench diagnosis --size full --lay-out drive.pair.J6_warm_up+C6_hold.x4.0 --out case    (inspect one case)")]
pub(crate) struct BenchDiagnosisArgs {
    /// Number of cases.
    #[arg(long, value_name = "SIZE", value_parser = named(&Extent::NAMED), default_value = "ci")]
    size: Extent,
    /// Machine in which the effects are hidden.
    #[arg(long, value_name = "KIND", value_parser = named(&MachineKind::NAMED), default_value = "exact")]
    machine: MachineKind,
    /// Plants, separated by commas; by default all of the full size, the drive of the small one.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    plants: Vec<String>,
    /// Draws of every effect and size, in place of the size's own.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=10_000))]
    draws: Option<u64>,
    /// Run only the I-th of N parts of the cases.
    #[arg(long, value_name = "I/N", default_value = "1/1", hide_default_value = true)]
    shard: Part,
    /// Run only cases whose name contains this text: `null`, `drive.pair`, `C1_transport_delay.x2`.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Run only cases of these sizes, in multiples of s*, separated by commas.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',')]
    multiples: Vec<f64>,
    /// Run nothing: score the finished cases.
    #[arg(long)]
    score: bool,
    /// Run nothing: write model and recordings of one case into the results folder, ready for `softdock diagnose`.
    #[arg(long, value_name = "CASE", conflicts_with_all = ["score", "shard", "only", "multiples"])]
    lay_out: Option<String>,
    /// Plant effects in measured recordings, whose true errors besides are real.
    #[arg(long, conflicts_with_all = ["size", "machine", "plants", "draws", "multiples"])]
    real: bool,
    /// Folder of the measured data; `SOFTDOCK_DATA`, or `tests/data`, if not given.
    #[arg(long, value_name = "DIR", requires = "real")]
    data: Option<PathBuf>,
    /// Results folder; `results/bench_diagnosis_SIZE` if not given.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn bench_diagnosis(args: &BenchDiagnosisArgs, format: &Format) -> Outcome {
    if args.real {
        return bench_real(args, format);
    }
    let wanted =
        WantedCases { extent: args.size, machine: args.machine, plants: args.plants.clone(), draws: args.draws };
    let all = plan(&wanted)?;
    let folder = args.out.clone().unwrap_or_else(|| default_results(&format!("bench_diagnosis_{}", args.size.word())));
    if let Some(id) = &args.lay_out {
        let command = lay_out_case(&all, id, &folder)?;
        let text = || format!("{id}; its truth is in {}/sealed\n\n  {command}", folder.display());
        format.print(|| json!({ "case": id, "folder": folder, "command": command }), text);
        return Ok(Exit::Done);
    }
    if !args.score {
        run(&all, args, &folder)?;
    }
    let score = score(&scored(&folder)?);
    let plants = Some(args.plants.join(",")).filter(|_| !args.plants.is_empty());
    let command = CommandLine::new("bench diagnosis", &[] as &[&Path]).option("size", Some(args.size.word()));
    let machine = Some(args.machine.word()).filter(|_| args.machine != MachineKind::default());
    let command = command.option("machine", machine).option("plants", plants).option("draws", args.draws).text();
    let (figures, files) = score_files(&score, &page_origin(&command))?;
    let written = write(&folder, &files)?;
    format.print(|| figures, || format!("{}\n{written}", summary_text::text(&score)));
    let missing = count_missing(&all, &folder)?;
    if missing > 0 {
        warn(format!("{missing} of {} cases are missing; the same command resumes", all.len()));
        return Ok(Exit::Incomplete);
    }
    Ok(if score.is_met() { Exit::Done } else { Exit::NotVerified })
}

/// Runs the selected part of the cases; prints nothing of a truth before the score.
fn run(all: &[Case], args: &BenchDiagnosisArgs, folder: &Path) -> Result<(), GauntletError> {
    let (number, of) = (args.shard.index as usize + 1, args.shard.count as usize);
    let own = shard(selected(all, args.only.as_deref().unwrap_or(""), &args.multiples)?, number, of);
    let ledger = Ledger::open(folder, number, of)?;
    let _clock = Terminal::new("bench diagnosis");
    run_missing(own, &ledger, &stopped, &mut |case| warn(case.text()))
}

/// Runs the missing cases in measured recordings, then scores all finished ones.
fn bench_real(args: &BenchDiagnosisArgs, format: &Format) -> Outcome {
    let data = args.data.clone().or_else(|| std::env::var_os(DATA).map(PathBuf::from));
    let data = data.unwrap_or_else(|| PathBuf::from("tests/data"));
    let folder = args.out.clone().unwrap_or_else(|| default_results("bench_diagnosis_real"));
    if let Some(id) = &args.lay_out {
        let command = trial::lay_out_case(id, &data, &folder)?;
        let json = || json!({ "case": id, "folder": folder, "command": command });
        format.print(json, || format!("{id}\n\n  {command}"));
        return Ok(Exit::Done);
    }
    let (present, absent): (Vec<&MeasuredSet>, Vec<&MeasuredSet>) = SETS.iter().partition(|set| set.is_in(&data));
    let text = args.only.as_deref().unwrap_or("");
    let mut all = cases(|set| present.iter().any(|own| own.name == set.name));
    all.retain(|case| case.id().contains(text));
    if all.is_empty() {
        let what = format!("no case in the sets below {} has `{text}` in its name", data.display());
        return Err(GauntletError::Unknown { what }.into());
    }
    if !args.score {
        let (number, of) = (args.shard.index as usize, args.shard.count as usize);
        let ledger = Ledger::open(&folder, number + 1, of)?;
        let _clock = Terminal::new("bench diagnosis");
        let own: Vec<RealCase> = all.iter().copied().skip(number).step_by(of).collect();
        let mut report = |done: usize, all: usize, record: &RealRecord| {
            warn(format!("{done} of {all}  {}: {:.1} s", record.case, record.seconds));
        };
        trial::run_missing(&own, &data, &ledger, &stopped, &mut report)?;
    }
    let records = trial::finished(&folder)?;
    let score = real::score::score(&records);
    let written = write(&folder, &real::score::files(&score)?)?;
    format.print(
        || serde_json::to_value(&score).expect("string keys"),
        || format!("{}\n{written}", real::score::text(&score)),
    );
    for set in &absent {
        warn(format!("set {} is not below {}: not run", set.name, data.display()));
    }
    let missing = all.iter().filter(|case| !records.iter().any(|record| record.case == case.id())).count();
    if missing > 0 || !absent.is_empty() {
        warn(format!("{missing} of {} cases are missing; the same command resumes", all.len()));
        return Ok(Exit::Incomplete);
    }
    Ok(if score.is_met() { Exit::Done } else { Exit::NotVerified })
}
