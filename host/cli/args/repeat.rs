//! The commands that repeat a piece of work, from the arguments that it had.

use super::{BenchDiagnosisArgs, BenchSize, RobotArgs};
use softdock_bench::plan::Extent;
use softdock_diagnosis::result_files::{file_name, file_names};

impl BenchSize {
    /// The extent of the plan.
    pub(crate) fn extent(self) -> Extent {
        match self {
            Self::Ci => Extent::Ci,
            Self::Full => Extent::Full,
        }
    }

    /// The size as it is typed.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Ci => "ci",
            Self::Full => "full",
        }
    }
}

impl BenchDiagnosisArgs {
    /// The command that repeats the work, without the folder.
    pub(crate) fn command(&self) -> String {
        let mut text = format!("softdock bench diagnosis --size {}", self.size.word());
        if !self.plants.is_empty() {
            text += &format!(" --plants {}", self.plants.join(","));
        }
        text + &self.draws.map_or_else(String::new, |draws| format!(" --draws {draws}"))
    }
}

impl RobotArgs {
    /// The command that repeats an identification, with file names alone: no path of the machine stands in a result.
    pub(crate) fn command(&self) -> String {
        let mut text = format!("softdock identify robot {}{}", file_name(&self.model), file_names(&self.logs));
        if !self.validate.is_empty() {
            text += &format!(" --validate{}", file_names(&self.validate));
        }
        text += &self.marks.as_ref().map_or_else(String::new, |path| format!(" --marks {}", file_name(path)));
        text += &format!(" --cutoff {}", self.cutoff);
        text += &self.period.map_or_else(String::new, |period| format!(" --period {period}"));
        text + &self.weight.map_or_else(String::new, |weight| format!(" --weight {weight}"))
    }

    /// The command that repeats the design of a motion of this period \[s\].
    pub(crate) fn design_command(&self, period: f64) -> String {
        let name = file_name(&self.model);
        format!("softdock identify robot {name} --design --period {period} --seed {}", self.seed)
    }
}
