//! Sign-off statistics, plots and the report.
//!
//! Sign-off is exact: one-sided Clopper-Pearson bounds and allowed failures, invalid runs counted as failures.
//! Early fail, never early pass. No share without its interval.

mod causes;
pub mod compare;
mod compare_page;
pub mod compare_results;
mod content;
mod error;
pub mod exact;
pub mod facts;
pub mod judgement;
mod moments;
pub mod number;
mod page_data;
pub mod parity;
pub mod plan;
pub mod plots;
pub mod proportions;
mod reading;
pub mod report;
mod running;
mod summarise;
pub mod summary;
mod tally;
mod templates;
mod terminal;
mod tracking;

pub use causes::{cause_sentence, cause_text};
pub use compare::{Compared, VariantInput, compare, compare_text};
pub use compare_page::{compare_page, write_compare};
pub use compare_results::{ResultsComparison, ResultsInput, compare_results, compare_results_text};
pub use content::Content;
pub use error::AnalysisError;
pub(crate) use error::Result;
pub use exact::{READING_CONFIDENCE, Share, clopper_pearson};
pub use facts::{CampaignFacts, InvalidRuns};
pub use judgement::Judge;
pub use plots::map::{MapCurve, map_page, map_text};
pub use plots::scene::scene_svg;
pub use report::{Fact, ReportInput, ReportedDispersion, report_page, summary_text, write_report, write_summary};
pub use running::RunningSummary;
pub use summarise::{agreement_of, summarise, summarise_folder};
pub use summary::{Extension, Judgement, Summary, Verdict};
pub use templates::{PageOrigin, STYLE, render_page};
pub use terminal::{table, verdict_text};
