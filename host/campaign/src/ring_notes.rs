//! The soft capture ring of a scenario in words: legs, strokes, natural frequencies, largest force.

use crate::mobility::leg_mobilities;
use crate::overlap::millimetres;
use softdock_kernels::model::Model;
use softdock_kernels::stewart::{CaptureRing, Leg};
use std::f64::consts::TAU;

/// Returns lines about the ring that part B rides on; none without one.
pub fn ring_lines(model: &Model) -> Vec<String> {
    model.ring.as_ref().map_or(Vec::new(), lines)
}

fn lines(ring: &CaptureRing) -> Vec<String> {
    let lengths = ring.legs.iter().map(Leg::start_length);
    let (shortest, longest) = (lengths.clone().fold(f64::INFINITY, f64::min), lengths.fold(0.0, f64::max));
    let [shorter, longer] = ring.strokes;
    let mut lines = vec![format!(
        "six legs of {} at the start, {} to {} between their stops",
        millimetres(shortest),
        millimetres(shortest - shorter),
        millimetres(longest + longer)
    )];
    let rates = leg_mobilities(ring).map(|mobility| format!("{:.3}", (ring.stiffness * mobility).sqrt() / TAU));
    lines.push(format!("natural frequencies on a held mount: {} Hz", rates.join(", ")));
    // The stiffness along x is that of the legs' shares; a stroke of the ring along x shortens a leg by its share.
    let share = |leg: &Leg| (leg.ring - leg.mount).x / leg.start_length();
    let along: f64 = ring.legs.iter().map(|leg| ring.stiffness * share(leg).powi(2)).sum();
    let travel = shorter / share(&ring.legs[0]).abs().max(1e-9);
    lines.push(format!(
        "along x: stiffness {along:.0} N/m, {:.0} N at about {} where the legs meet their stops",
        along * travel,
        millimetres(travel)
    ));
    lines
}
