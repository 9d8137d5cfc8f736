//! One run as a row: its status, inputs, outcome and metrics of both loops, and the result of every requirement.

use softdock_kernels::metrics::Metrics;

pub mod columns;
mod schema;

pub use schema::{
    CUSTOM_SOURCE, CustomMetricColumn, KeyColumn, RequirementColumn, RunsSchema, input_fields, metric_fields,
};

/// What became of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// Every requirement on space holds; without any, the task succeeds in space.
    Pass,
    /// Some of these does not hold.
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

/// How a loop ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Outcome {
    /// Every criterion of the task holds.
    Pass,
    /// Some criterion does not hold.
    Fail,
    /// A rule stopped the session: the facility gives no answer.
    Aborted,
    /// The numbers cannot be trusted.
    Invalid,
}

/// Words of the outcome columns, in the order of [`Outcome`].
pub const OUTCOME_WORDS: [&str; 4] = ["pass", "fail", "aborted", "invalid"];

impl Outcome {
    const ALL: [Self; 4] = [Self::Pass, Self::Fail, Self::Aborted, Self::Invalid];

    /// The word in the file.
    pub fn word(self) -> &'static str {
        OUTCOME_WORDS[self as usize]
    }

    /// The outcome of a word.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|outcome| outcome.word() == word)
    }
}

/// Where in a run something was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Phase {
    /// Before the first touch.
    Approach,
    /// From the first touch to capture.
    Contact,
    /// From capture on.
    Latch,
}

/// Words of the phase columns, in the order of [`Phase`]; the last one stands for none.
pub const PHASE_WORDS: [&str; 4] = ["approach", "contact", "latch", "none"];

impl Phase {
    /// The phase at a time of a loop \[s\].
    pub fn at(time: f64, metrics: &Metrics<f64>) -> Self {
        let since = |event: f64| event >= 0.0 && time >= event;
        match (since(metrics.touch_time), since(metrics.capture_time)) {
            (_, true) => Self::Latch,
            (true, _) => Self::Contact,
            _ => Self::Approach,
        }
    }

    /// The word in the file.
    pub fn word(self) -> &'static str {
        PHASE_WORDS[self as usize]
    }

    /// The phase in a column, where the last word stands for none; the outer `None` is an unknown word.
    pub(crate) fn of_column(word: &str) -> Option<Option<Self>> {
        let phase = Self::from_word(word);
        (phase.is_some() || word == PHASE_WORDS[3]).then_some(phase)
    }

    /// The phase of a word.
    pub fn from_word(word: &str) -> Option<Self> {
        [Self::Approach, Self::Contact, Self::Latch].into_iter().find(|phase| phase.word() == word)
    }
}

/// Why a loop did not pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    /// Id of the criterion that was broken, of the rule that was met, or of the flag that makes the run invalid.
    pub id: String,
    /// When \[s\]; none for an invalid run.
    pub time: Option<f64>,
    /// The value, in the unit of the limit; none where nothing was measured.
    pub value: Option<f64>,
    /// The limit; none where there is no number.
    pub limit: Option<f64>,
    /// In which phase of the run.
    pub phase: Option<Phase>,
}

/// The facility's verdict against the verdict of space: the task's criteria and every requirement on space.
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
    /// The facility gives no answer to what passes in space.
    AbortedPass,
    /// The facility gives no answer to what fails in space.
    AbortedFail,
    /// The run is invalid.
    Invalid,
}

/// Words of the `agreement` column, in the order of [`Agreement`].
pub const AGREEMENT_WORDS: [&str; 7] =
    ["true_pass", "false_pass", "true_fail", "false_fail", "aborted_pass", "aborted_fail", "invalid"];

impl Agreement {
    const ALL: [Self; 7] = [
        Self::TruePass,
        Self::FalsePass,
        Self::TrueFail,
        Self::FalseFail,
        Self::AbortedPass,
        Self::AbortedFail,
        Self::Invalid,
    ];

    /// The agreement of two verdicts; the facility's is `None` if its session was aborted.
    pub fn of(space_passes: bool, facility_passes: Option<bool>) -> Self {
        match (space_passes, facility_passes) {
            (true, Some(true)) => Self::TruePass,
            (false, Some(true)) => Self::FalsePass,
            (false, Some(false)) => Self::TrueFail,
            (true, Some(false)) => Self::FalseFail,
            (true, None) => Self::AbortedPass,
            (false, None) => Self::AbortedFail,
        }
    }

    /// Whether the run passes in space; `None` if it is invalid.
    pub fn space_passes(self) -> Option<bool> {
        match self {
            Self::TruePass | Self::FalseFail | Self::AbortedPass => Some(true),
            Self::FalsePass | Self::TrueFail | Self::AbortedFail => Some(false),
            Self::Invalid => None,
        }
    }

    /// Whether the facility passes the run; `None` if it gives no answer or the run is invalid.
    pub fn facility_passes(self) -> Option<bool> {
        match self {
            Self::TruePass | Self::FalsePass => Some(true),
            Self::TrueFail | Self::FalseFail => Some(false),
            Self::AbortedPass | Self::AbortedFail | Self::Invalid => None,
        }
    }

    /// Whether the facility's session was aborted.
    pub fn is_aborted(self) -> bool {
        matches!(self, Self::AbortedPass | Self::AbortedFail)
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

/// How one loop of a run meets one requirement; `None` where the run is invalid or the session was aborted, the margin
/// also where the metric is not available.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct RequirementResult {
    /// Distance to the limit in the requirement's unit, positive inside.
    pub margin: Option<f64>,
    /// Whether the requirement holds.
    pub pass: Option<bool>,
}

/// One loop of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopRow {
    /// How it ended.
    pub outcome: Outcome,
    /// Why it did not pass; none if it did.
    pub cause: Option<Cause>,
    /// Its metrics.
    pub metrics: Metrics<f64>,
    /// The custom metrics of the campaign, in the schema's order; `None` where one has no value.
    pub custom_metrics: Vec<Option<f64>>,
    /// Each requirement, in the schema's order.
    pub requirements: Vec<RequirementResult>,
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
    /// The loop in space.
    pub space: LoopRow,
    /// The loop on the facility.
    pub hil: LoopRow,
}
