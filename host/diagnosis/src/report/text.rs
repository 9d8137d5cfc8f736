//! Text of a diagnosis for the terminal.

use crate::diagnosis::Diagnosis;
use crate::inference::torque_error::TorqueError;
use crate::propose::experiment::ProposedExperiment;
use crate::verdict::answer::{
    BlockAnswer, Bounds, DiagnosisVerdict, EffectFound, FormFound, FormTerm, ParameterEstimate, RuledOut,
};
use crate::verdict::free_run::{ErrorReduction, FreeRun, Median};
use softdock_analysis::number::significant;

/// Largest number of listed causes; the rest is counted.
const MOST_LISTED: usize = 5;

/// Returns the answer in one sentence.
pub fn headline(diagnosis: &Diagnosis) -> String {
    let of = |verdict: DiagnosisVerdict, joint: &str| {
        let blocks = diagnosis.blocks.iter().filter(|block| block.answer == verdict);
        blocks.flat_map(|block| &block.effects).map(named).collect::<Vec<_>>().join(joint)
    };
    let names = |joint: &str| of(diagnosis.answer, joint);
    // A named cause in one block is reported beside an open verdict in another.
    let beside = match (diagnosis.answer, of(DiagnosisVerdict::Named, " and ")) {
        (DiagnosisVerdict::Ambiguous | DiagnosisVerdict::NotInLibrary | DiagnosisVerdict::ModelInadequate, named)
            if !named.is_empty() =>
        {
            format!(" It also lacks {named}.")
        }
        _ => String::new(),
    };
    let answer = match diagnosis.answer {
        DiagnosisVerdict::NoEffect => format!("These recordings show no model error{}.", off_tolerance(diagnosis)),
        DiagnosisVerdict::Withheld => "No block has a verdict.".to_owned(),
        DiagnosisVerdict::NoPracticalEffect => {
            format!("Statistically significant, but without practical effect: {}.", names(" and "))
        }
        DiagnosisVerdict::Named => format!("The model lacks {}.", names(" and ")),
        DiagnosisVerdict::Ambiguous => {
            format!("The model lacks {}: these recordings do not discriminate between them.{beside}", names(" or "))
        }
        DiagnosisVerdict::NotInLibrary => {
            let blocks = blocks(diagnosis, DiagnosisVerdict::NotInLibrary).join(" and ");
            format!("The model error in {blocks} has no cause in the library{}.{beside}", likeness(diagnosis))
        }
        DiagnosisVerdict::ModelInadequate => {
            let blocks = blocks(diagnosis, DiagnosisVerdict::ModelInadequate).join(" and ");
            format!("The model is inadequate in {blocks}: no physically possible cause is named there.{beside}")
        }
    };
    match diagnosis.provisional {
        true => format!("Provisional: {}{}", answer[..1].to_lowercase(), &answer[1..]),
        false => answer,
    }
}

/// Returns the parameters beyond their tolerances.
fn off_tolerance(diagnosis: &Diagnosis) -> String {
    let all = diagnosis.blocks.iter().flat_map(|block| &block.nuisances_beyond_prior);
    let all: Vec<String> = all.map(|(name, z)| format!("{name} is {} tolerances off", significant(*z, 2))).collect();
    if all.is_empty() { String::new() } else { format!(", but {}", all.join(" and ")) }
}

/// Returns the form of a model error outside the library, if it holds.
fn likeness(diagnosis: &Diagnosis) -> String {
    let forms = diagnosis.blocks.iter().filter_map(|block| block.form.as_ref()).filter(|form| form.holds);
    let names: Vec<&str> = forms.flat_map(|form| &form.terms).map(|term| term.name).collect();
    if names.is_empty() { String::new() } else { format!("; it behaves like {}", names.join(" and ")) }
}

fn named(effect: &EffectFound) -> String {
    format!("{} ({})", effect.name, effect.id)
}

fn blocks(diagnosis: &Diagnosis, verdict: DiagnosisVerdict) -> Vec<&'static str> {
    diagnosis.blocks.iter().filter(|block| block.answer == verdict).map(|block| block.block).collect()
}

/// Returns the complete answer for the terminal.
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut out = headline(diagnosis);
    for reason in &diagnosis.reasons {
        out += &format!("\n  provisional: {reason}");
    }
    for finding in &diagnosis.findings {
        out += &format!("\n  {}: {}", finding.recording, finding.what);
    }
    for block in &diagnosis.blocks {
        out += &format!("\n\n{}", block_text(block));
    }
    if let Some(experiment) = &diagnosis.experiment {
        out += &format!("\n\nDiscriminating experiment: {experiment}.");
    }
    out +=
        &diagnosis.proposed.as_ref().map_or_else(String::new, |e| format!("\nMost discriminating: {}.", proposed(e)));
    out
}

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

/// Returns the answer for a block.
fn block_text(block: &BlockAnswer) -> String {
    let mut lines = vec![format!("{}: {}", block.block, verdict(block.answer))];
    for effect in &block.effects {
        lines.push(format!("  {}, probability {}", named(effect), significant(effect.p, 3)));
        lines.extend(effect.parameters.iter().map(|(name, estimate)| format!("    {name} {}", estimated(estimate))));
    }
    lines.extend(block.inadequate.iter().map(|reason| format!("  inadequate: {reason}")));
    for effect in &block.possible {
        let estimates: Vec<String> =
            effect.parameters.iter().map(|(name, estimate)| format!("{name} {}", estimated(estimate))).collect();
        lines.push(format!("  possible, but not sufficient: {}, {}", named(effect), estimates.join(", ")));
    }
    lines.extend(block.form.as_ref().map(|form| format!("  {}", behaviour(form))));
    lines.push(format!("  {}", residual(block)));
    lines.extend(block.torque_error.as_ref().map(|error| format!("  {}", torque_error(error))));
    lines.extend(block.free_run.as_ref().map(|run| format!("  {}", free_run(run))));
    if !block.partner_missing.is_empty() {
        let listed = block.partner_missing.join(", ");
        lines.push(format!("  confounded, not in the library, possible cause: {listed}"));
    }
    for (name, z) in &block.nuisances_beyond_prior {
        lines.push(format!("  nuisance parameter beyond its prior: {name}, z-score {}", significant(*z, 2)));
    }
    if !block.ruled_out.is_empty() {
        let listed = block.ruled_out.iter().take(MOST_LISTED);
        let listed: Vec<String> = listed.map(|out| format!("{} by {}", out.id, ruled_out_by(out))).collect();
        lines.push(format!("  ruled out (log-odds): {}{}", listed.join(", "), more(block.ruled_out.len())));
    }
    if !block.not_visible.is_empty() {
        let listed: Vec<&str> = block.not_visible.iter().map(|effect| effect.id).collect();
        lines.push(format!("  not detectable with these data at a plausible size: {}", listed.join(", ")));
    }
    if !block.confounded.is_empty() {
        let listed: Vec<String> = block.confounded.iter().map(|[a, b]| format!("{a} and {b}")).collect();
        lines.push(format!("  confounded in these motions: {}", listed.join(", ")));
    }
    lines.join("\n")
}

/// Returns the log-odds against a cause, or that its parameters are implausible.
pub(crate) fn ruled_out_by(out: &RuledOut) -> String {
    let odds = significant(out.log_odds, 3);
    match (out.implausible, out.log_odds > 0.0) {
        (false, _) => odds,
        (true, true) => format!("{odds} (with implausible parameters)"),
        (true, false) => "implausible parameters".to_owned(),
    }
}

/// Returns the text of a form outside the library.
pub fn behaviour(form: &FormFound) -> String {
    let numbers = |term: &FormTerm| term.parameters.values().map(estimated).collect::<Vec<_>>().join(", ");
    let terms: Vec<String> = form.terms.iter().map(|term| format!("{}: {}", term.name, numbers(term))).collect();
    let left =
        form.residual.map_or_else(String::new, |left| format!("; residual {} times the noise", significant(left, 3)));
    let strength = if form.holds { "behaves like" } else { "weakly resembles" };
    format!("{strength} {}{left}", terms.join(" and "))
}

/// Returns the text of a relative torque error.
pub fn torque_error(error: &TorqueError) -> String {
    let percent = |error: f64| significant(100.0 * error, 3);
    let what =
        format!("relative torque error below {} Hz: {} %", significant(error.cutoff_hz, 3), percent(error.before));
    match error.before == error.after {
        true => what,
        false => format!("{what} before, {} % after", percent(error.after)),
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

fn more(count: usize) -> String {
    if count > MOST_LISTED { format!(" and {} more by larger odds", count - MOST_LISTED) } else { String::new() }
}

/// Returns the name of a verdict.
pub fn verdict(verdict: DiagnosisVerdict) -> &'static str {
    match verdict {
        DiagnosisVerdict::NoEffect => "no effect",
        DiagnosisVerdict::Withheld => "no verdict",
        DiagnosisVerdict::NoPracticalEffect => "no practical effect",
        DiagnosisVerdict::Named => "named",
        DiagnosisVerdict::Ambiguous => "ambiguous",
        DiagnosisVerdict::NotInLibrary => "not in the library",
        DiagnosisVerdict::ModelInadequate => "model inadequate",
    }
}

/// Returns an estimate with its interval and unit.
pub fn estimated(estimate: &ParameterEstimate) -> String {
    let [value, lo, hi] = [estimate.value, estimate.lo, estimate.hi].map(|value| significant(value, 4));
    let unit = if estimate.unit == "1" { "" } else { &estimate.unit };
    format!("{value} {unit} ({lo} to {hi})").replace("  ", " ")
}

/// Returns the text of the residual and the gain.
pub fn residual(block: &BlockAnswer) -> String {
    let (before, after) = (significant(block.residual.before, 3), significant(block.residual.after, 3));
    let place = if block.held_out { "on held-out motion" } else { "on the motion that was fitted" };
    let percent = |share: f64| significant(100.0 * share, 3);
    let is_open = block.answer.is_open();
    let is_spoken = !is_open || block.form.as_ref().is_some_and(|form| form.holds);
    match block.gain.filter(|_| is_spoken) {
        None if is_open => {
            format!("residual {before} times the noise, {after} with the nearest possible cause, {place}")
        }
        None => format!("residual {before} times the noise {place}"),
        Some(gain) => {
            let range = |lo: f64, hi: f64| format!("{} to {} %", percent(lo), percent(hi));
            let elsewhere = gain.elsewhere.map(|Bounds { lo, hi }| format!("; on other motion {}", range(lo, hi)));
            format!(
                "residual {before} times the noise before, {after} after, {place}: gain {} % ({}){}",
                percent(gain.value),
                range(gain.lo, gain.hi),
                elsewhere.unwrap_or_default()
            )
        }
    }
}
