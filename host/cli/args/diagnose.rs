//! Arguments of `diagnose`.

use super::BackendArg;
use clap::Args;
use softdock_diagnosis::hold_out::Every;
use softdock_diagnosis::result_files::{file_name, file_names};
use std::path::{Path, PathBuf};

/// Arguments of `diagnose`.
#[derive(Args, Debug)]
#[command(after_help = "\
Recordings are CSV or Parquet; the model file's [log] says which column is what. Files that share a name up to the last
underscore (sine_1.csv, sine_2.csv) are repeats of one command: three of each, and another motion held out, make an
answer that can be signed. Without, it is provisional, and says so. DIR gets the page, the figures as JSON, the extended
model where causes are named, and the experiment that would tell them apart where they look alike: a path for a joint
(experiment.csv), the run of its campaign to drive next for a facility (experiment.toml).

Exit codes: 0 answered, whatever the answer; 2 bad input.

Examples:
  softdock diagnose model.toml training/*.csv --holdout validation/*.csv --out results/joint
  softdock diagnose model.toml recording.csv --hold-out-from 6.21
  softdock diagnose model.toml tosses.csv --hold-out-experiments 4:1
  softdock diagnose campaigns/probe_drogue.toml logs/*/log.parquet --compare campaigns/probe_drogue.toml
  softdock diagnose --signals")]
pub(crate) struct DiagnoseArgs {
    /// Model file of the rig: what is known of it, and how well. Of a whole facility: the scenario that it follows, or
    /// the campaign whose runs were driven.
    #[arg(required_unless_present = "signals")]
    pub(crate) model: Option<PathBuf>,
    /// Recordings to learn from.
    #[arg(value_name = "LOG", required_unless_present = "signals")]
    pub(crate) logs: Vec<PathBuf>,
    /// Recordings of another motion, to judge by.
    #[arg(long, value_name = "LOG", num_args = 1..)]
    pub(crate) holdout: Vec<PathBuf>,
    /// Judge by what each recording has from this time on, in seconds of its own clock.
    #[arg(long, value_name = "SECONDS", conflicts_with = "holdout")]
    pub(crate) hold_out_from: Option<f64>,
    /// Judge by the experiments whose number leaves REST when divided by EVERY: 4:1 holds out 1, 5, 9 and so on.
    #[arg(long, value_name = "EVERY:REST", conflicts_with_all = ["holdout", "hold_out_from"])]
    pub(crate) hold_out_experiments: Option<Every>,
    /// Leave a cause of the catalogue out of the library.
    #[arg(long, value_name = "ID")]
    pub(crate) without: Vec<String>,
    /// Simulate in steps half as long as usual: to see that the answer does not depend on them.
    #[arg(long)]
    pub(crate) half_step: bool,
    /// Who simulates.
    #[arg(long, value_name = "BACKEND", default_value = "cpu")]
    pub(crate) backend: BackendArg,
    /// Campaign whose verdicts are compared: with the model as it is, and with what was found; for whole facilities.
    #[arg(long, value_name = "CAMPAIGN")]
    pub(crate) compare: Option<PathBuf>,
    /// Runs of that comparison, instead of the campaign's.
    #[arg(long, value_name = "N", requires = "compare", value_parser = clap::value_parser!(u64).range(100..=1_000_000_000))]
    pub(crate) compare_runs: Option<u64>,
    /// Facility file on which the runs of a campaign are rehearsed to propose the next drive.
    #[arg(long, value_name = "FILE", default_value = "campaigns/facilities/reference.toml")]
    pub(crate) facility: PathBuf,
    /// Results folder; `results/diagnose_ID` if not given.
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Answer in JSON.
    #[arg(long)]
    pub(crate) json: bool,
    /// Print the kinds of plants with the names of their signals, and judge nothing.
    #[arg(long, exclusive = true)]
    pub(crate) signals: bool,
}

impl DiagnoseArgs {
    /// The command that repeats the work, with file names alone: no path of the machine stands in a result.
    pub(crate) fn command(&self, model: &Path) -> String {
        let mut text = format!("softdock diagnose {}{}", file_name(model), file_names(&self.logs));
        if !self.holdout.is_empty() {
            text += &format!(" --holdout{}", file_names(&self.holdout));
        }
        text += &self.hold_out_from.map_or_else(String::new, |from| format!(" --hold-out-from {from}"));
        text += &self.hold_out_experiments.map_or_else(String::new, |every| format!(" --hold-out-experiments {every}"));
        text += if self.half_step { " --half-step" } else { "" };
        text + &self.without.iter().map(|id| format!(" --without {id}")).collect::<String>()
    }
}
