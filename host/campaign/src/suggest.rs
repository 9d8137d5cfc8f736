//! The nearest known word to a mistyped one.

/// The candidate that is most like `word`, if one is near enough to be a slip.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // No name is longer: the comparison of a whole file with each name would take minutes.
    if word.len() > 200 {
        return None;
    }
    // Jaro-Winkler above 0.8: "stifness" finds "stiffness", "mass" does not find "max_depth". In short words it is
    // low after any slip, but one changed letter of three or more is a slip.
    let likeness = |candidate: &str| {
        let (word, candidate) = (word.to_lowercase(), candidate.to_lowercase());
        let slip = candidate.len() >= 3 && strsim::osa_distance(&word, &candidate) <= 1;
        strsim::jaro_winkler(&word, &candidate).max(if slip { 0.9 } else { 0.0 })
    };
    candidates
        .into_iter()
        .map(|candidate| (likeness(candidate), candidate))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
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
    let former = FORMER.iter().find(|(old, new, _)| *old == word && candidates.contains(new));
    if let Some((.., now)) = former {
        return format!("write {now}");
    }
    match nearest(word, candidates.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("write one of: {}", candidates.join(", ")),
    }
}
