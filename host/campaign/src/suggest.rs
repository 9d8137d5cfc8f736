//! The known words that an unknown one may mean: by spelling, then by meaning.

use softdock_kernels::fields::fields;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::params::Params;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Most words that one message suggests.
const MOST: usize = 3;

/// Longest word that is compared: no name is longer, and the comparison of a whole file would take minutes.
const LONGEST: usize = 200;

/// Words of the field, and the names of this program that they stand for, the most usual one first.
///
/// A row serves every list of names: of a row only those count that the list has. A name without `_` is also a part of
/// longer names: `latency` finds `sensor_delay` by `delay`.
const SYNONYMS: &[(&str, &[&str])] = &[
    // parameters
    ("friction", &["contact_friction"]),
    ("mu", &["contact_friction", "friction"]),
    ("stiffness", &["contact_stiffness"]),
    ("spring", &["contact_stiffness", "stiffness"]),
    ("rigidity", &["contact_stiffness", "stiffness"]),
    ("compliance", &["fixture_compliance", "stiffness"]),
    ("damping", &["contact_damping"]),
    ("damper", &["contact_damping", "damping"]),
    ("delay", &["loop_delay"]),
    ("latency", &["loop_delay", "delay"]),
    ("deadtime", &["loop_delay", "delay"]),
    ("dead_time", &["loop_delay", "delay"]),
    ("jitter", &["delay_jitter"]),
    ("mass", &["target_mass", "base_mass"]),
    ("weight", &["target_mass", "mass"]),
    ("payload", &["robot1_payload_error", "mass"]),
    ("inertia", &["target_inertia_scale", "base_inertia_scale"]),
    ("speed", &["closing_speed", "approach_speed", "rebound_speed"]),
    ("velocity", &["closing_speed", "approach_speed", "speed"]),
    ("approach", &["closing_speed", "approach_speed"]),
    ("misalignment", &["offset", "offset_y", "tilt"]),
    ("position", &["offset", "offset_x", "offset_y"]),
    ("lateral", &["offset_y", "offset_z"]),
    ("angle", &["tilt", "tilt_y"]),
    ("attitude", &["tilt", "camera_tilt"]),
    ("orientation", &["tilt", "camera_tilt"]),
    ("rotation", &["tilt", "target_rate"]),
    ("tumble", &["target_rate", "target_rate_x"]),
    ("spin", &["target_rate", "target_rate_x"]),
    ("angular_velocity", &["target_rate", "chaser_rate"]),
    ("noise", &["sensor_noise_force", "sensor_noise_moment"]),
    ("bias", &["sensor_bias_force", "sensor_bias_moment"]),
    ("quantization", &["sensor_resolution_force", "resolution"]),
    ("quantisation", &["sensor_resolution_force", "resolution"]),
    ("packet_loss", &["drop_probability"]),
    ("loss", &["drop_probability"]),
    ("dropout", &["drop_probability"]),
    ("bandwidth", &["robot1_lag", "robot2_lag"]),
    ("filter", &["sensor_lag", "compensator_lag"]),
    ("backlash", &["robot1_backlash", "robot2_backlash"]),
    ("play", &["robot1_backlash", "backlash"]),
    ("slosh", &["slosh_share"]),
    ("restitution", &["restitution", "max_restitution"]),
    // metrics and criteria
    ("force", &["peak_contact_force", "max_contact_force"]),
    ("force_limit", &["max_contact_force", "max_interface_force", "force"]),
    ("load", &["peak_interface_force", "max_interface_force"]),
    ("moment", &["peak_contact_moment", "moment"]),
    ("torque", &["peak_contact_moment", "moment"]),
    ("penetration", &["peak_depth", "max_depth"]),
    ("depth", &["peak_depth", "max_depth"]),
    ("energy", &["injected_energy"]),
    ("captured", &["capture_time", "capture"]),
    ("docked", &["capture_time", "capture"]),
    ("latched", &["capture_time", "capture"]),
    ("bounce", &["restitution", "rebound_speed"]),
    ("momentum", &["linear_momentum_error", "angular_momentum_error"]),
    ("jam", &["jam_duration", "jam_push"]),
    ("stroke", &["peak_leg_stroke"]),
    ("overshoot", &["tracking_overshoot"]),
    ("duration", &["contact_duration", "max_time", "time_limit"]),
    ("time", &["capture_time", "max_time", "time_limit"]),
    // keys of files
    ("samples", &["runs"]),
    ("iterations", &["runs"]),
    ("trials", &["runs"]),
    ("count", &["runs"]),
    ("number", &["runs"]),
    ("name", &["id"]),
    ("description", &["title"]),
    ("random_seed", &["seed"]),
    ("parameter", &["target", "parameters"]),
    ("variable", &["target", "variable"]),
    ("distribution", &["dist"]),
    ("std", &["sigma"]),
    ("stddev", &["sigma"]),
    ("mu_mean", &["mean"]),
    ("average", &["mean"]),
    ("lower", &["min", "at_least"]),
    ("upper", &["max", "at_most"]),
    ("minimum", &["min", "at_least"]),
    ("max", &["at_most", "peak"]),
    ("maximum", &["max", "at_most", "peak"]),
    ("largest", &["max", "at_most", "peak"]),
    ("limit", &["at_most", "max"]),
    ("threshold", &["at_most", "threshold"]),
    ("gaussian", &["normal", "truncnormal"]),
    ("reliability", &["probability"]),
    ("device", &["backend"]),
    ("hardware", &["backend", "facility"]),
    ("timestep", &["substep", "timing"]),
    ("dt", &["substep", "timing"]),
    ("plant", &["scenario"]),
    ("requirements", &["requirement"]),
    ("dispersions", &["dispersion"]),
    ("metrics", &["metric"]),
    ("variants", &["variant"]),
    // commands
    ("simulate", &["run"]),
    ("start", &["run", "init"]),
    ("execute", &["run"]),
    ("montecarlo", &["run"]),
    ("resume", &["run"]),
    ("continue", &["run"]),
    ("validate", &["check", "verify"]),
    ("lint", &["check"]),
    ("new", &["init"]),
    ("create", &["init"]),
    ("template", &["init", "examples"]),
    ("tasks", &["examples", "init"]),
    ("list", &["examples", "params", "metrics"]),
    ("parameters", &["params"]),
    ("variables", &["params"]),
    ("columns", &["signals", "metrics"]),
    ("channels", &["signals"]),
    ("html", &["report"]),
    ("page", &["report"]),
    ("plot", &["report"]),
    ("diff", &["compare"]),
    ("join", &["merge"]),
    ("combine", &["merge"]),
    ("stability", &["map"]),
    ("gpu", &["devices"]),
    ("benchmark", &["bench"]),
    ("speedtest", &["bench"]),
    ("fit", &["identify"]),
    ("calibrate", &["identify"]),
    ("explain", &["diagnose"]),
    ("robot", &["drive", "identify"]),
    ("slurm", &["submit"]),
    ("manual", &["man"]),
    ("completion", &["completions"]),
    ("progress", &["status"]),
    ("rerun", &["replay"]),
    ("repeat", &["replay"]),
];

/// The candidate that is spelled most like `word`, if one is near enough to be a slip.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if word.len() > LONGEST {
        return None;
    }
    // Jaro-Winkler above 0.8: "stifness" finds "stiffness", "mass" does not find "max_depth". In short words it is
    // low after any slip, but one changed letter of three or more is a slip.
    let likeness = |candidate: &str| {
        let slip = is_slip(word, candidate);
        let (word, candidate) = (word.to_lowercase(), candidate.to_lowercase());
        strsim::jaro_winkler(&word, &candidate).max(if slip { 0.9 } else { 0.0 })
    };
    candidates
        .into_iter()
        .map(|candidate| (likeness(candidate), candidate))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Whether one changed letter, of three or more, leads from a word to a candidate.
fn is_slip(word: &str, candidate: &str) -> bool {
    // A letter has at most four bytes: most candidates need no distance.
    let is_near = candidate.len() >= 3 && word.len().abs_diff(candidate.len()) <= 4;
    is_near && strsim::osa_distance(&word.to_lowercase(), &candidate.to_lowercase()) <= 1
}

/// Names of older versions, and what to write now.
const FORMER: [(&str, &str, &str); 7] = [
    ("max_force", "max_contact_force", "max_contact_force (latch excluded) or max_interface_force (contact and latch)"),
    (
        "peak_force",
        "peak_contact_force",
        "peak_contact_force (latch excluded) or peak_interface_force (contact and latch)",
    ),
    ("peak_moment", "peak_contact_moment", "peak_interface_moment (contact and latch) or peak_contact_moment"),
    ("created_energy", "injected_energy", "injected_energy"),
    ("contact_energy", "injected_energy", "injected_energy"),
    ("rail_following_error", "following_error", "following_error, a distance at the tool, rail included"),
    ("end_at_capture", "end_after_capture", "end_after_capture, or end_at_capture in the facility file"),
];

/// "did you mean `x`?" or a list of what may be written.
pub(crate) fn suggestion(word: &str, candidates: &[&str]) -> String {
    did_you_mean(word, candidates).unwrap_or_else(|| format!("write one of: {}", candidates.join(", ")))
}

/// "did you mean `x` or `y`?"; `None` if no candidate is like the word in spelling or meaning.
pub fn did_you_mean(word: &str, candidates: &[&str]) -> Option<String> {
    let former = FORMER.iter().find(|(old, new, _)| *old == word && candidates.contains(new));
    if let Some((.., now)) = former {
        return Some(format!("write {now}"));
    }
    let quoted: Vec<String> = likely(word, candidates).into_iter().map(|near| format!("`{near}`")).collect();
    match quoted.as_slice() {
        [] => None,
        [only] => Some(format!("did you mean {only}?")),
        [first @ .., last] => Some(format!("did you mean {} or {last}?", first.join(", "))),
    }
}

/// The candidates that an unknown word may mean, the likeliest first; at most three.
pub fn likely<'a>(word: &str, candidates: &[&'a str]) -> Vec<&'a str> {
    if word.len() > LONGEST {
        return Vec::new();
    }
    let parts = parts_of(word);
    let mut found: Vec<&str> = names_for(word).iter().filter_map(|name| listed(name, candidates)).collect();
    if found.is_empty() {
        found.extend(candidates.iter().filter(|candidate| is_slip(word, candidate)));
    }
    if found.is_empty() {
        found = by_parts(&parts, candidates, parts_of);
    }
    if found.is_empty() {
        found.extend(nearest(word, candidates.iter().copied()));
    }
    if found.is_empty() {
        found = by_parts(&parts, candidates, |name| meanings().get(name).cloned().unwrap_or_default());
    }
    found.dedup();
    found.truncate(MOST);
    found
}

/// The names that a word of the field stands for; empty for other words.
pub fn names_for(word: &str) -> &'static [&'static str] {
    let phrase = parts_of(word).join("_");
    SYNONYMS.iter().find(|(own, _)| *own == phrase).map_or(&[], |row| row.1)
}

/// The candidate with a name.
fn listed<'a>(name: &str, candidates: &[&'a str]) -> Option<&'a str> {
    candidates.iter().find(|candidate| **candidate == name).copied()
}

/// The candidates whose words hold every part, or what it stands for; those with the fewest other words first.
fn by_parts<'a>(parts: &[String], candidates: &[&'a str], words_of: impl Fn(&str) -> Vec<String>) -> Vec<&'a str> {
    // Of one or two letters nearly everything begins with.
    if parts.is_empty() || parts.iter().any(|part| part.len() < 3) {
        return Vec::new();
    }
    let wanted: Vec<Vec<&str>> = parts.iter().map(|part| alternatives(part)).collect();
    let holds =
        |words: &[String]| wanted.iter().all(|any| any.iter().any(|part| words.iter().any(|w| begins(w, part))));
    let mut found: Vec<(usize, &str)> = candidates
        .iter()
        .map(|name| (words_of(name), *name))
        .filter(|(words, _)| holds(words))
        .map(|(words, name)| (words.len(), name))
        .collect();
    found.sort_by_key(|(count, _)| *count);
    found.into_iter().map(|(_, name)| name).collect()
}

/// A part, and the words that it stands for.
fn alternatives(part: &str) -> Vec<&str> {
    let row = SYNONYMS.iter().find(|(own, _)| *own == part).map_or(&[][..], |row| row.1);
    std::iter::once(part).chain(row.iter().copied().filter(|name| !name.contains('_'))).collect()
}

/// Whether two words begin alike: one is the other's beginning, of four letters at least, or they are equal.
fn begins(word: &str, part: &str) -> bool {
    word == part || (word.len().min(part.len()) >= 4 && (word.starts_with(part) || part.starts_with(word)))
}

/// The words of a name or a text, in small letters.
fn parts_of(text: &str) -> Vec<String> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect()
}

/// The words of the meaning of every parameter and metric.
fn meanings() -> &'static HashMap<String, Vec<String>> {
    static MEANINGS: OnceLock<HashMap<String, Vec<String>>> = OnceLock::new();
    MEANINGS.get_or_init(|| {
        let rows = fields::<f64, Params<f64>>().into_iter().chain(fields::<f64, Metrics<f64>>());
        rows.map(|row| (row.name, parts_of(row.meaning))).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::effects::EFFECTS;

    fn names(of: &str) -> Vec<String> {
        let rows = if of == "metrics" { fields::<f64, Metrics<f64>>() } else { fields::<f64, Params<f64>>() };
        rows.into_iter().map(|row| row.name).collect()
    }

    #[test]
    fn a_word_of_the_field_finds_its_name() {
        let cases = [
            ("params", "friction", "contact_friction"),
            ("params", "delay", "loop_delay"),
            ("params", "latency", "loop_delay"),
            ("params", "mass", "target_mass"),
            ("params", "stiffness", "contact_stiffness"),
            ("params", "contact_stifness", "contact_stiffness"),
            ("params", "friction_coefficient", "contact_friction"),
            ("params", "sensor_latency", "sensor_delay"),
            ("params", "packet loss", "drop_probability"),
            ("params", "compensator stiff", "compensator_stiffness"),
            ("metrics", "force", "peak_contact_force"),
            ("metrics", "max_force", "peak_contact_force"),
            ("metrics", "penetration", "peak_depth"),
            ("metrics", "energy", "injected_energy"),
        ];
        for (of, word, expected) in cases {
            let names = names(of);
            let candidates: Vec<&str> = names.iter().map(String::as_str).collect();
            assert_eq!(likely(word, &candidates).first(), Some(&expected), "{word}: {:?}", likely(word, &candidates));
        }
        let effects: Vec<&str> = EFFECTS.iter().map(|effect| effect.id).collect();
        assert_eq!(likely("transport_delay", &effects), ["C1_transport_delay"]);
        assert_eq!(likely("gaussian", &["normal", "uniform"]), ["normal"]);
        assert_eq!(likely("simulate", &["run", "check"]), ["run"]);
    }

    #[test]
    fn an_unlike_word_finds_nothing() {
        for word in ["", "x", "qqqqqq", "\u{1b}[31m", &"a".repeat(1_000_000)] {
            assert!(did_you_mean(word, &["contact_friction", "loop_delay"]).is_none(), "{word:.20}");
        }
    }

    #[test]
    fn every_synonym_is_written_once() {
        for (at, (word, names)) in SYNONYMS.iter().enumerate() {
            assert!(!names.is_empty() && SYNONYMS[at + 1..].iter().all(|(other, _)| other != word), "{word}");
        }
    }
}
