//! Joints that slide: their units.

/// The unit that a joint which slides has in place of one that turns.
pub(crate) fn of_sliding(unit: &'static str) -> &'static str {
    match unit {
        "rad" => "m",
        "rad/s" => "m/s",
        "N m" => "N",
        "N m/rad" => "N/m",
        "N m s/rad" => "N s/m",
        "kg m^2" => "kg",
        other => other,
    }
}

/// The units of all joints, from that of a joint which turns.
pub(crate) fn units(slides: &[bool], unit: &'static str) -> Vec<&'static str> {
    slides.iter().map(|slides| if *slides { of_sliding(unit) } else { unit }).collect()
}
