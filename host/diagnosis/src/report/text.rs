//! Texts of proposed experiments and of free runs.

use crate::propose::experiment::ProposedExperiment;
use crate::verdict::free_run::{ErrorReduction, FreeRun, Median};
use softdock_analysis::number::significant;

/// Returns the text of a proposed experiment: a motion to record, or a run to drive.
pub fn proposed(experiment: &ProposedExperiment) -> String {
    let odds = significant(experiment.expected_log_odds, 2);
    let ProposedExperiment { motion, repeats, run, .. } = experiment;
    let (file, tried) = (experiment.file(), if run.is_some() { "runs" } else { "motions" });
    let times = if *repeats == 1 { "once".to_owned() } else { format!("{repeats} repeats") };
    match experiment.separates() {
        true => format!("{motion}, {times} ({file}), expected log-odds {odds}"),
        false => format!(
            "none of the {tried} tried, with these sensors; {repeats} repeats of {motion} would bring log-odds of {odds}"
        ),
    }
}

/// Returns the text of the errors of free runs.
pub fn free_run(run: &FreeRun) -> String {
    let listed = |compared: &ErrorReduction, scale: f64, unit: &str| {
        let of = |median: &Median| {
            let [value, lo, hi] = [median.value, median.lo, median.hi].map(|value| significant(scale * value, 3));
            format!("{value} {unit} ({lo} to {hi})")
        };
        format!("{} before, {} after", of(&compared.before), of(&compared.after))
    };
    let seen = if run.held_out { "that were held out" } else { "that were fitted" };
    let names: Vec<String> = run.with.iter().map(|effect| format!("{} ({})", effect.name, effect.id)).collect();
    let with = if names.is_empty() { "nothing".to_owned() } else { names.join(" and ") };
    format!(
        "free runs of tosses {seen}, medians: error of the speed after the first impact {}, of its velocity vector {} ({} \
         tosses); error of the rest position {} ({} tosses); after: with {with}",
        listed(&run.rebound_speed, 100.0, "%"),
        listed(&run.rebound_velocity, 100.0, "%"),
        run.tosses[0],
        listed(&run.rest_position, 1e3, "mm"),
        run.tosses[1]
    )
}
