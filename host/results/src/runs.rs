//! One run as a row: its status, inputs, metrics of both loops and the outcome of every requirement.

use softdock_kernels::metrics::Metrics;

pub use crate::schema::{RequirementColumn, RunsSchema, input_fields, metric_fields};

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// Every requirement holds in space.
    Pass,
    /// Some requirement does not hold in space.
    Fail,
    /// The numbers of the run cannot be trusted.
    Invalid,
}

/// Words of the `status` column, in the order of [`Status`].
pub const STATUS_WORDS: [&str; 3] = ["pass", "fail", "invalid"];

impl Status {
    const ALL: [Self; 3] = [Self::Pass, Self::Fail, Self::Invalid];

    /// The word in the file.
    pub fn word(self) -> &'static str {
        STATUS_WORDS[self as usize]
    }

    /// The status of a word.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.word() == word)
    }
}

/// The facility's verdict on the task against the verdict of space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Agreement {
    /// Both pass.
    TruePass,
    /// The facility passes what fails in space.
    FalsePass,
    /// Both fail.
    TrueFail,
    /// The facility fails what passes in space.
    FalseFail,
    /// The run is invalid.
    Invalid,
}

/// Words of the `agreement` column, in the order of [`Agreement`].
pub const AGREEMENT_WORDS: [&str; 5] = ["true_pass", "false_pass", "true_fail", "false_fail", "invalid"];

impl Agreement {
    const ALL: [Self; 5] = [Self::TruePass, Self::FalsePass, Self::TrueFail, Self::FalseFail, Self::Invalid];

    /// The agreement of two verdicts.
    pub fn of(space_passes: bool, facility_passes: bool) -> Self {
        match (space_passes, facility_passes) {
            (true, true) => Self::TruePass,
            (false, true) => Self::FalsePass,
            (false, false) => Self::TrueFail,
            (true, false) => Self::FalseFail,
        }
    }

    /// The word in the file.
    pub fn word(self) -> &'static str {
        AGREEMENT_WORDS[self as usize]
    }

    /// The agreement of a word.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|agreement| agreement.word() == word)
    }
}

/// How one loop of a run stands to one requirement; `None` where the run is invalid or the metric not available.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Outcome {
    /// Distance to the limit in the requirement's unit, positive inside.
    pub margin: Option<f64>,
    /// Whether the requirement holds.
    pub pass: Option<bool>,
}

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunRow {
    /// Run number.
    pub run: u64,
    /// Number of the outer (epistemic) draw.
    pub outer: u32,
    /// What became of it.
    pub status: Status,
    /// The facility against space.
    pub agreement: Agreement,
    /// Flag bits ([`softdock_kernels::metrics::flags`]).
    pub flags: u32,
    /// The applied parameters, in the order of the field table of `Params`.
    pub inputs: Vec<f64>,
    /// Effective mass along the contact normal at first touch, kg.
    pub effective_mass: Option<f64>,
    /// Metrics of the loop in space.
    pub space: Metrics<f64>,
    /// Metrics of the loop on the facility.
    pub hil: Metrics<f64>,
    /// Each requirement in space, in the schema's order.
    pub space_outcomes: Vec<Outcome>,
    /// Each requirement on the facility, in the schema's order.
    pub hil_outcomes: Vec<Outcome>,
}
