//! The `[contact]` table of a scenario file from an identification.

use super::estimate::{ContactDetermination, ContactEstimate};
use super::identification::{ContactIdentification, FoundContact};
use softdock_analysis::PageOrigin;
use softdock_analysis::number::{significant, unit_text};
use softdock_campaign::FILL_IN;

/// Returns the table as TOML, with its source in comments.
///
/// A required key that the data do not determine has the value `"fill in"`, which every reader of a scenario rejects.
pub fn contact_block(found: &ContactIdentification, origin: &PageOrigin) -> String {
    let mut text = format!(
        "# Contact of {}, identified by softdock {}:\n#   {}\n# Source: {}\n[contact]\nlaw = \"{}\"\n",
        found.title,
        origin.version,
        origin.command,
        source(found),
        found.law()
    );
    if let Some(error) = found.inadequate() {
        text += &format!("# Model inadequate: relative error of the force {} %.\n", significant(100.0 * error, 3));
    }
    if let FoundContact::Tosses(_) = &found.found {
        text += "exponent = 1   # the corners of a tossed body are linear springs\n";
    }
    found.estimates().iter().for_each(|estimate| text += &line(estimate));
    if let FoundContact::Touches(touches) = &found.found
        && found.law() == "rebound"
    {
        text += &format!("slowest_touch = {}\n", quantity(touches.best().slowest, "m/s"));
    }
    text
}

/// Keys without which a law cannot be read.
const REQUIRED: [&str; 2] = ["stiffness", "restitution"];

fn line(estimate: &ContactEstimate) -> String {
    let (key, unit) = (estimate.key, estimate.unit);
    match (estimate.value, estimate.interval) {
        (Some(value), Some([low, high])) => {
            let range = format!("{} to {}", significant(low, 4), significant(high, 4));
            format!("{key} = {}   # 95 %: {range}\n", quantity(value, unit))
        }
        _ if REQUIRED.contains(&key) => {
            format!("{key} = \"{FILL_IN}\"   # {}: {}\n", words(estimate), estimate.reason)
        }
        _ => format!("# {key}: {}: {}\n", words(estimate), estimate.reason),
    }
}

/// Returns the verdict on a parameter in words.
pub fn words(estimate: &ContactEstimate) -> String {
    match (estimate.determination, estimate.interval) {
        (ContactDetermination::Determined, _) => "determined".to_owned(),
        (ContactDetermination::Bounded, Some([_, high])) if estimate.key != "restitution" => {
            format!("not determined, at most {}", with_si(high, estimate.unit))
        }
        (ContactDetermination::Bounded, Some([low, _])) => format!("not determined, at least {}", significant(low, 3)),
        _ => "not determined".to_owned(),
    }
}

fn with_si(value: f64, unit: &str) -> String {
    let number = significant(value, 3);
    if unit == "1" { number } else { format!("{number} {}", unit_text(unit)) }
}

fn quantity(value: f64, unit: &str) -> String {
    let number = significant(value, 6);
    if unit == "1" { number } else { format!("\"{number} {unit}\"") }
}

/// Returns what the values come from, in one line.
pub fn source(found: &ContactIdentification) -> String {
    match &found.found {
        FoundContact::Touches(own) => {
            let percent = |held_out: bool| {
                let all = own.predicted(held_out);
                let mean = all.iter().map(|touch| touch.error()).sum::<f64>() / all.len().max(1) as f64;
                (all.len(), significant(100.0 * mean, 3))
            };
            let ((fitted, error), (held, held_error)) = (percent(false), percent(true));
            let held = match held {
                0 => "none held out".to_owned(),
                held => format!("{held_error} % on {held} held out"),
            };
            format!("{fitted} touches; relative error of the normal force {error} %, {held}")
        }
        FoundContact::Tosses(own) => {
            let mean = |errors: &[super::toss::OpenLoopError]| {
                let count = errors.len().max(1) as f64;
                let position = errors.iter().map(|error| error.position_m).sum::<f64>() / count;
                let rotation = errors.iter().map(|error| error.rotation_rad).sum::<f64>() / count;
                format!("{} mm and {} deg", significant(1e3 * position, 3), significant(rotation.to_degrees(), 3))
            };
            let held = match own.held_out[1].len() {
                0 => "none held out".to_owned(),
                count => format!("{} on {count} held out", mean(&own.held_out[1])),
            };
            format!("{} tosses; open-loop error {}, {held}", own.fit.fitted, mean(&own.fitted[1]))
        }
    }
}
