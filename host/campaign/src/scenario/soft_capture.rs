//! The soft capture ring: its legs, stops and load control, checked.

use super::bodies::inertia;
use crate::check::Checker;
use crate::written::scenario::{ScenarioFile, SoftCaptureTable};
use softdock_kernels::range::{DAMPING, FORCE, HALF_TURN, LENGTH, MASS, Range, STIFFNESS};
use softdock_kernels::stewart::{CaptureRing, Leg, stewart_legs};
use softdock_kernels::vector::{Quat, vec3};

/// Shortest leg and greatest share of its length that it may shorten by, so that no leg passes its own joint \[m, 1\].
const SHORTEST_LEG: f64 = 1e-3;
const MOST_SHORTENING: f64 = 0.9;
/// Half angle of a pair of joints: pairs do not overlap \[rad\].
const HALF_ANGLE: Range = Range::within(0.0, HALF_TURN / 3.0);

pub(super) fn read(c: &mut Checker, file: &ScenarioFile) -> Option<CaptureRing> {
    let table = file.soft_capture.as_ref()?;
    if let Some(orbit) = &file.orbit {
        let message = "relative gravity does not act on a soft capture ring: the ring would fall behind its target";
        c.refuse(&orbit.rate.span, message, "remove [orbit], or remove [soft_capture]");
    }
    let t = &table.value;
    let legs = legs(c, t);
    let ring = CaptureRing {
        mass: c.number(&t.mass, "kg", Range::above(0.0, MASS)),
        inertia: inertia(c, &t.inertia),
        centre: c.vector_or_zero(&t.centre, "m", Range::size(LENGTH)),
        legs,
        stiffness: c.number(&t.stiffness, "N/m", Range::within(0.0, STIFFNESS)),
        damping: c.number(&t.damping, "N s/m", Range::within(0.0, DAMPING)),
        force_limit: c.number_or(&t.force_limit, f64::INFINITY, "N", Range::above(0.0, FORCE)),
        lag: c.number_or(&t.lag, 0.0, "s", Range::within(0.0, 10.0)),
        strokes: [&t.shortening, &t.lengthening].map(|way| c.number(way, "m", Range::within(0.0, LENGTH))),
        stop_stiffness: c.number(&t.stop_stiffness, "N/m", Range::above(0.0, STIFFNESS)),
    };
    let shortest = ring.legs.iter().map(Leg::start_length).fold(f64::INFINITY, f64::min);
    if ring.strokes[0] > MOST_SHORTENING * shortest {
        let message = format!("legs of {:.1} mm cannot shorten by {:.1} mm", shortest * 1e3, ring.strokes[0] * 1e3);
        let remedy = format!("write at most \"{:.1} mm\", or lengthen the legs", MOST_SHORTENING * shortest * 1e3);
        c.refuse(&t.shortening.span, message, remedy);
    }
    Some(ring)
}

/// The legs; harmless ones where they are refused.
fn legs(c: &mut Checker, t: &SoftCaptureTable) -> [Leg; 6] {
    let mut both = |written, unit, range| -> [f64; 2] {
        let list: Vec<f64> = c.list(written, 2, unit, range);
        [list[0], list[1]]
    };
    let radii = both(&t.radius, "m", Range::above(0.0, LENGTH));
    let half_angles = both(&t.half_angle, "rad", HALF_ANGLE);
    let places = both(&t.place, "m", Range::size(LENGTH));
    let turn = c.number_or(&t.turn, 0.0, "rad", Range::size(HALF_TURN));
    let attitude = Quat { w: (0.5 * turn).cos(), v: vec3((0.5 * turn).sin(), 0.0, 0.0) };
    let turned = |leg: Leg| Leg { mount: attitude.rotate(leg.mount), ring: attitude.rotate(leg.ring) };
    let legs = stewart_legs(radii, half_angles, places).map(turned);
    if legs[0].start_length() < SHORTEST_LEG {
        let message = format!("the legs are {:.3} mm long at the start", legs[0].start_length() * 1e3);
        c.refuse(&t.place.span, message, "write another place, radius or half_angle of the mount: at least 1 mm away");
    }
    legs
}
