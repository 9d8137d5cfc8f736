//! A diagnosis in plain words.

use crate::answer::{BlockAnswer, Bounds, EffectFound, Estimate, FormFound, FormTerm, RuledOut, Verdict};
use crate::diagnosis::Diagnosis;
use crate::experiment::Experiment;
use crate::free_run::{Compared, FreeRun, Median};
use crate::torque_error::TorqueError;
use softdock_analysis::number::significant;

/// Causes that are told before the rest is only counted.
const MOST_TOLD: usize = 5;

/// The answer in one sentence.
pub fn headline(diagnosis: &Diagnosis) -> String {
    let of = |verdict: Verdict, joint: &str| {
        let blocks = diagnosis.blocks.iter().filter(|block| block.answer == verdict);
        blocks.flat_map(|block| &block.effects).map(named).collect::<Vec<_>>().join(joint)
    };
    let names = |joint: &str| of(diagnosis.answer, joint);
    // What another block lacks for certain stands beside what one block leaves open.
    let beside = match (diagnosis.answer, of(Verdict::Named, " and ")) {
        (Verdict::Ambiguous | Verdict::NotInLibrary, named) if !named.is_empty() => {
            format!(" It lacks {named} besides.")
        }
        _ => String::new(),
    };
    let answer = match diagnosis.answer {
        Verdict::NoEffect => "Nothing is wrong with the model that these recordings could show.".to_owned(),
        Verdict::NoPracticalEffect => {
            format!("Statistically there, but hardly worth an extension of the model: {}.", names(" and "))
        }
        Verdict::Named => format!("The model lacks {}.", names(" and ")),
        Verdict::Ambiguous => format!("The model lacks {}: these recordings cannot tell which.{beside}", names(" or ")),
        Verdict::NotInLibrary => {
            let blocks = blocks(diagnosis, Verdict::NotInLibrary).join(" and ");
            format!("Something is wrong in {blocks} that no known cause explains{}.{beside}", likeness(diagnosis))
        }
    };
    match diagnosis.provisional {
        true => format!("Provisional: {}{}", answer[..1].to_lowercase(), &answer[1..]),
        false => answer,
    }
}

/// What something outside the library behaves like, where that holds.
fn likeness(diagnosis: &Diagnosis) -> String {
    let forms = diagnosis.blocks.iter().filter_map(|block| block.form.as_ref()).filter(|form| form.holds);
    let names: Vec<&str> = forms.flat_map(|form| &form.terms).map(|term| term.name).collect();
    if names.is_empty() { String::new() } else { format!("; it behaves like {}", names.join(" and ")) }
}

fn named(effect: &EffectFound) -> String {
    format!("{} ({})", effect.name, effect.id)
}

fn blocks(diagnosis: &Diagnosis, verdict: Verdict) -> Vec<&'static str> {
    diagnosis.blocks.iter().filter(|block| block.answer == verdict).map(|block| block.block).collect()
}

/// The whole answer for a terminal.
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
        out += &format!("\n\nWhat would tell them apart: {experiment}.");
    }
    out += &diagnosis.proposed.as_ref().map_or_else(String::new, |e| format!("\nBest of all: {}.", proposed(e)));
    out
}

/// A motion to record, or a run to drive.
pub fn proposed(experiment: &Experiment) -> String {
    let odds = significant(experiment.expected_log_odds, 2);
    let Experiment { motion, repeats, run, .. } = experiment;
    let (file, tried) = (experiment.file(), if run.is_some() { "runs" } else { "motions" });
    let times = if *repeats == 1 { "once".to_owned() } else { format!("{repeats} repeats") };
    match experiment.separates() {
        true => format!("{motion}, {times} ({file}), which should bring log-odds of {odds}"),
        false => format!(
            "none of the {tried} tried, with these sensors; {repeats} repeats of {motion} would bring log-odds of {odds}"
        ),
    }
}

/// The answer for a block.
fn block_text(block: &BlockAnswer) -> String {
    let mut lines = vec![format!("{}: {}", block.block, verdict(block.answer))];
    for effect in &block.effects {
        lines.push(format!("  {}, probability {}", named(effect), significant(effect.p, 3)));
        lines.extend(effect.parameters.iter().map(|(name, estimate)| format!("    {name} {}", estimated(estimate))));
    }
    lines.extend(block.form.as_ref().map(|form| format!("  {}", behaviour(form))));
    lines.push(format!("  {}", residual(block)));
    lines.extend(block.torque_error.as_ref().map(|error| format!("  {}", torque_error(error))));
    lines.extend(block.free_run.as_ref().map(|run| format!("  {}", free_run(run))));
    if !block.partner_missing.is_empty() {
        let told = block.partner_missing.join(", ");
        lines.push(format!("  looks alike, was not in the library and may be the cause: {told}"));
    }
    for (name, z) in &block.strained {
        lines.push(format!("  {name} is {} tolerances off its nominal value", significant(*z, 2)));
    }
    if !block.ruled_out.is_empty() {
        let told = block.ruled_out.iter().take(MOST_TOLD);
        let told: Vec<String> = told.map(|out| format!("{} by {}", out.id, ruled_out_by(out))).collect();
        lines.push(format!("  ruled out (log-odds): {}{}", told.join(", "), more(block.ruled_out.len())));
    }
    if !block.not_visible.is_empty() {
        let told: Vec<&str> = block.not_visible.iter().map(|effect| effect.id).collect();
        lines.push(format!("  could not have shown at a plausible size: {}", told.join(", ")));
    }
    if !block.alike.is_empty() {
        let told: Vec<String> = block.alike.iter().map(|[a, b]| format!("{a} and {b}")).collect();
        lines.push(format!("  hardly differ in these motions: {}", told.join(", ")));
    }
    lines.join("\n")
}

/// Log-odds by which a cause is ruled out, or that it cannot be what its best numbers make it.
pub(crate) fn ruled_out_by(out: &RuledOut) -> String {
    let odds = significant(out.log_odds, 3);
    match (out.implausible, out.log_odds > 0.0) {
        (false, _) => odds,
        (true, true) => format!("{odds} (and its numbers are implausible)"),
        (true, false) => "implausible numbers".to_owned(),
    }
}

/// What something outside the library behaves like.
pub fn behaviour(form: &FormFound) -> String {
    let numbers = |term: &FormTerm| term.parameters.values().map(estimated).collect::<Vec<_>>().join(", ");
    let terms: Vec<String> = form.terms.iter().map(|term| format!("{}: {}", term.name, numbers(term))).collect();
    let left =
        form.residual.map_or_else(String::new, |left| format!("; it leaves {} times the noise", significant(left, 3)));
    let strength = if form.holds { "behaves like" } else { "resembles, though not closely," };
    format!("{strength} {}{left}", terms.join(" and "))
}

/// How much of a drive's torque the model gets wrong.
pub fn torque_error(error: &TorqueError) -> String {
    let percent = |error: f64| significant(100.0 * error, 3);
    let what =
        format!("relative torque error below {} Hz: {} %", significant(error.cutoff_hz, 3), percent(error.before));
    match error.before == error.after {
        true => what,
        false => format!("{what} before, {} % after", percent(error.after)),
    }
}

/// What free runs of a tossed body get wrong.
pub fn free_run(run: &FreeRun) -> String {
    let told = |compared: &Compared, scale: f64, unit: &str| {
        let of = |median: &Median| {
            let [value, lo, hi] = [median.value, median.lo, median.hi].map(|value| significant(scale * value, 3));
            format!("{value} {unit} ({lo} to {hi})")
        };
        format!("{} before, {} after", of(&compared.before), of(&compared.after))
    };
    let seen = if run.held_out { "that no fit has seen" } else { "that were fitted" };
    let names: Vec<String> = run.with.iter().map(|effect| format!("{} ({})", effect.name, effect.id)).collect();
    let with = if names.is_empty() { "nothing".to_owned() } else { names.join(" and ") };
    format!(
        "free runs of tosses {seen}, medians: speed after the first blow off by {}, its velocity as a vector by {} ({} \
         tosses); place of rest off by {} ({} tosses); after: with {with}",
        told(&run.rebound_speed, 100.0, "%"),
        told(&run.rebound_velocity, 100.0, "%"),
        run.tosses[0],
        told(&run.rest_position, 1e3, "mm"),
        run.tosses[1]
    )
}

fn more(count: usize) -> String {
    if count > MOST_TOLD { format!(" and {} more by more", count - MOST_TOLD) } else { String::new() }
}

/// An answer in words.
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::NoEffect => "no effect",
        Verdict::NoPracticalEffect => "no practical effect",
        Verdict::Named => "named",
        Verdict::Ambiguous => "ambiguous",
        Verdict::NotInLibrary => "not in the library",
    }
}

/// A number with its interval and unit.
pub fn estimated(estimate: &Estimate) -> String {
    let [value, lo, hi] = [estimate.value, estimate.lo, estimate.hi].map(|value| significant(value, 4));
    let unit = if estimate.unit == "1" { "" } else { &estimate.unit };
    format!("{value} {unit} ({lo} to {hi})").replace("  ", " ")
}

/// What the model leaves, and what the answer makes of it.
pub fn residual(block: &BlockAnswer) -> String {
    let (before, after) = (significant(block.residual.before, 3), significant(block.residual.after, 3));
    let place = if block.held_out { "on motion that no fit has seen" } else { "on the motion that was fitted" };
    let percent = |share: f64| significant(100.0 * share, 3);
    let is_spoken = block.answer != Verdict::NotInLibrary || block.form.as_ref().is_some_and(|form| form.holds);
    match block.gain.filter(|_| is_spoken) {
        None if block.answer == Verdict::NotInLibrary => {
            format!("residual {before} times the noise, {after} with the nearest cause of the library, {place}")
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
