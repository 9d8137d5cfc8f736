//! Requirements of a campaign and the statements that its runs can demonstrate, before any run: text and JSON.

use crate::error::Result;
use serde_json::{Value, json};
use softdock_analysis::exact::{allowed_failures, smallest_runs};
use softdock_analysis::number::with_unit;
use softdock_analysis::plan::plan_line;
use softdock_campaign::arm_notes::arm_lines;
use softdock_campaign::campaign::Method;
use softdock_campaign::contact_notes::contact_lines;
use softdock_campaign::criteria::sentences;
use softdock_campaign::requirement::{AgreementRequirement, Requirement};
use softdock_campaign::ring_notes::ring_lines;
use softdock_campaign::rules;
use softdock_campaign::{Campaign, histograms};
use softdock_kernels::model::Model;
use softdock_kernels::plant::Plant;

/// Statement for a sample that is not independent.
const EXPLORING: &str = "exploring only, no verdict: write sampling.method = \"random\" for one";

/// Draws, requirements, criteria and rules of a campaign as text; the histograms have `draws` draws.
///
/// # Errors
/// See [`Campaign::draw`].
pub fn check_text(campaign: &Campaign, draws: u64) -> Result<String> {
    let mut text = format!("{}  {}\n\n{}\n", campaign.id, campaign.title, histograms(campaign, draws)?);
    text += &variants(campaign);
    let own = campaign.scenario.model.timing.own_delay();
    text += &format!(
        "delay\n  the frame itself delays by {}; it is part of loop_delay, which cannot be less (with sensor_delay)\n",
        with_unit(own, "s")
    );
    text += "\ncontact\n";
    contact_lines(&campaign.scenario.model).iter().for_each(|line| text += &format!("  {line}\n"));
    let tables = [
        ("arm", arm_lines(&campaign.scenario)),
        ("soft capture ring", ring_lines(&campaign.scenario.model)),
        ("meshes", campaign.scenario.mesh_lines()),
    ];
    for (title, lines) in tables {
        if !lines.is_empty() {
            text += &format!("\n{title}\n");
        }
        lines.iter().for_each(|line| text += &format!("  {line}\n"));
    }
    text += &robots(&campaign.scenario.model);
    text += &judged(&campaign.scenario.model);
    text += "\nrequirements\n";
    for requirement in &campaign.requirements {
        let line = match campaign.method {
            Method::Random => plan_line(requirement.probability, requirement.confidence, runs_per_draw(campaign)),
            Method::Sobol | Method::LatinHypercube => EXPLORING.to_owned(),
        };
        text += &format!("  {}  {}\n    {}\n    {line}\n", requirement.id, requirement.text, requirement.sentence());
    }
    for requirement in &campaign.agreement {
        let fewest = smallest_runs(0, 1.0 - requirement.at_most, requirement.confidence);
        let fewest = fewest.map_or("more than can be run".to_owned(), |fewest| fewest.to_string());
        text += &format!(
            "  {}  {}\n    {}\n    needs at least {fewest} cases, if none of them counts\n",
            requirement.id,
            requirement.text,
            requirement.sentence()
        );
    }
    if campaign.requirements.is_empty() && campaign.agreement.is_empty() {
        text += "  none: the campaign states no verdict\n";
    }
    text += &custom_metrics(campaign);
    if let (Some(draws), Method::Random) = (campaign.outer_draws, campaign.method) {
        text += &format!("  each of the {draws} outer draws is judged on its own {} runs\n", runs_per_draw(campaign));
    }
    Ok(text)
}

/// The criteria of the task and the rules of a session, as sentences.
fn judged(model: &Model) -> String {
    let criteria = sentences(&model.task);
    let mut text = "\na run passes the task if\n".to_owned();
    criteria.iter().for_each(|criterion| text += &format!("  {criterion}\n"));
    if criteria.is_empty() {
        text += "  it is valid: the scenario writes no criterion\n";
    }
    text += "\na session on the facility is aborted by\n";
    rules::in_force(&model.facility).iter().for_each(|rule| text += &format!("  {rule}\n"));
    let [space, facility] = model.task.end_after_capture;
    for (place, hold) in [("in space", space), ("on the facility", facility)] {
        if hold.is_finite() {
            text += &format!("  a run {place} ends {} after capture\n", with_unit(hold, "s"));
        }
    }
    text
}

/// Returns the demands of the start on robots with joints, with their ratings.
fn robots(model: &Model) -> String {
    let Some(level) = &model.facility.joint_level else {
        return String::new();
    };
    let workspace = &level.robot.workspace;
    let mut text = "\nrobots at the start\n".to_owned();
    let plant = Plant::new(model.clone());
    for (index, (cell, mount)) in plant.robots().iter().zip(&level.mounts).enumerate() {
        let rated = level.robot.joints.iter().map(|joint| joint.drive.static_torque);
        let uses = cell.start_torques().into_iter().zip(rated).enumerate().filter(|(_, (_, rated))| *rated > 0.0);
        let uses: Vec<String> = uses
            .map(|(axis, (torque, rated))| format!("A{} {:.0} %", axis + 1, 100.0 * torque.abs() / rated))
            .collect();
        text += &format!(
            "  robot {}  tool {:.2} of {:.2} m from axis 1, load {} of {} kg\n           of the rated static torque: {}\n",
            index + 1,
            cell.start_distance(),
            workspace.reach,
            mount.payload.mass,
            workspace.payload,
            uses.join(", ")
        );
    }
    text
}

/// The facilities on which these draws are run.
fn variants(campaign: &Campaign) -> String {
    let mut text = String::new();
    for variant in &campaign.variants {
        text += &format!("  {}  {}\n", variant.name, variant.title);
        text.extend(variant.changes.iter().map(|(key, value)| format!("    {key} {value}\n")));
    }
    if text.is_empty() { text } else { format!("variants of the facility, each on all of these draws\n{text}\n") }
}

fn custom_metrics(campaign: &Campaign) -> String {
    let lines = campaign.metrics.iter().map(|m| format!("  {} [{}] = {}\n", m.name, m.unit, m.formula));
    let lines: String = lines.collect();
    if lines.is_empty() { lines } else { format!("\ncustom metrics\n{lines}") }
}

/// Returns the number of runs that judge a requirement: an outer draw has only its share of the runs.
fn runs_per_draw(campaign: &Campaign) -> u64 {
    campaign.runs / u64::from(campaign.outer_draws.unwrap_or(1)).max(1)
}

/// The same as JSON, in SI units.
///
/// # Errors
/// See [`Campaign::draw`].
pub fn check_json(campaign: &Campaign, draws: u64) -> Result<Value> {
    let (judged, independent) = (runs_per_draw(campaign), campaign.method == Method::Random);
    let requirement = |r: &Requirement| {
        json!({
            "id": r.id, "text": r.text, "sentence": r.sentence(), "subject": r.subject.word(),
            "metric": r.metric.name, "unit": r.unit(), "at_most": r.limits.at_most, "at_least": r.limits.at_least,
            "probability": r.probability, "confidence": r.confidence,
            "allowed_failures": allowed_failures(judged, r.probability, r.confidence).filter(|_| independent),
            "smallest_runs": smallest_runs(0, r.probability, r.confidence),
        })
    };
    let rate = |r: &AgreementRequirement| {
        json!({
            "id": r.id, "text": r.text, "sentence": r.sentence(), "rate": r.rate.word(), "at_most": r.at_most,
            "confidence": r.confidence, "smallest_cases": smallest_runs(0, 1.0 - r.at_most, r.confidence),
        })
    };
    Ok(json!({
        "id": campaign.id, "title": campaign.title, "hash": campaign.hash, "seed": campaign.seed,
        "runs": campaign.runs, "outer_draws": campaign.outer_draws, "judged_runs": judged, "independent_runs": independent,
        "own_delay_s": campaign.scenario.model.timing.own_delay(),
        "contact": contact_lines(&campaign.scenario.model),
        "arm": arm_lines(&campaign.scenario),
        "soft_capture": ring_lines(&campaign.scenario.model),
        "meshes": campaign.scenario.mesh_lines(),
        "requirements": campaign.requirements.iter().map(requirement).collect::<Vec<_>>(),
        "agreement_requirements": campaign.agreement.iter().map(rate).collect::<Vec<_>>(),
        "metrics": campaign.metrics.iter().map(|m| json!({ "name": m.name, "unit": m.unit, "text": m.text, "expr": m.formula })).collect::<Vec<_>>(),
        "variants": campaign.variants.iter().map(|v| json!({ "name": v.name, "title": v.title, "changes": v.changes })).collect::<Vec<_>>(),
        "inputs": inputs(campaign, draws.min(campaign.runs))?,
    }))
}

/// Mean and ends of every dispersed and derived input over runs spread over the campaign.
fn inputs(campaign: &Campaign, draws: u64) -> Result<Vec<Value>> {
    let run = |index: u64| (u128::from(index) * u128::from(campaign.runs) / u128::from(draws)) as u64;
    let drawn = (0..draws).map(|index| Ok(campaign.draw(run(index))?.inputs()));
    let drawn: Vec<Vec<f64>> = drawn.collect::<Result<_>>()?;
    let placed = campaign.dispersions.iter().filter_map(|d| Some((campaign.input_place(d.field)?, d)));
    let dispersed = placed.map(|(place, d)| (place, &d.name, d.unit));
    let derived = campaign.derived.iter().map(|d| (d.field, &d.name, d.unit));
    let row = |(field, name, unit): (usize, &String, &str)| {
        let values = drawn.iter().map(|draw| draw[field]);
        let ends = values.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), v| (min.min(v), max.max(v)));
        json!({ "name": name, "unit": unit, "draws": draws, "min": ends.0, "max": ends.1, "mean": values.sum::<f64>() / draws as f64 })
    };
    Ok(dispersed.chain(derived).map(row).collect())
}
