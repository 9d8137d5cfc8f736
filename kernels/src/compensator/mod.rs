//! Compensator stage: what the facility does against its own delay, between the measured wrench as it arrives and the
//! wrench that acts on the simulated bodies.
//!
//! Once per tick, on what a facility has: the measured wrench, the simulated motion and estimates. The *contact line*
//! is the line of action of the measured wrench; every added force acts along it, and pulls only where that is allowed.

pub mod lead;
pub mod lead_passivity;
pub mod passivity;
pub mod smith;
pub mod virtual_damping;

use crate::bundle;
use crate::contact::sliding_velocity;
use crate::model::CompensatorKind;
use crate::params::Params;
use crate::plant::Plant;
use crate::real::Real;
use crate::space::{Parts, Wrench};
use crate::vector::Vec3;

bundle! {
    /// The compensator between two ticks: the wrench that it gives, and what it remembers.
    Compensation {
        output: Wrench<R>, "1", "wrench that acts on the simulated part A, part A's axes";
        measured: Wrench<R>, "1", "measured wrench of the last tick, part A's axes";
        rate: Wrench<R>, "1", "filtered derivative of the measured wrench, per second";
        touching: R, "1", "1 while the measured force is above the threshold";
        push: R, "N", "force along the contact line that has acted since the last tick";
        speed: R, "m/s", "speed along the contact line at the last tick, positive when parting";
        energy: R, "J", "observed energy: taken from the simulated bodies, less what the contact's own damping accounts for";
        least: R, "J", "least observed energy so far";
    }
}

/// The line of action of the measured wrench, part A's axes; means nothing while nothing touches.
#[derive(Clone, Copy)]
pub(crate) struct ContactLine<R: Real> {
    /// Whether the measured force is above the threshold.
    pub(crate) touching: R::Mask,
    /// Direction of the force on part A.
    pub(crate) normal: Vec3<R>,
    /// Point of the line nearest to part A's origin.
    pub(crate) lever: Vec3<R>,
    /// Simulated speed of part A relative to part B at the line, along the normal: positive when parting.
    pub(crate) speed: R,
}

/// Whether a facility has a compensator at all: without one a lane's state has no numbers of it.
pub fn compensates(m: &Plant) -> bool {
    m.facility.compensator.kind != CompensatorKind::None
}

/// A compensator before the start.
#[inline(always)]
pub fn new_compensation<R: Real>() -> Compensation<R> {
    crate::fields::filled(R::lit(0.0))
}

/// How many ticks back the simulated parts stood as they stand in the measurement that arrives now, as far as the
/// assumed delay is right; the frame's own part of it is half a hold and no age.
#[inline(always)]
pub fn prediction_horizon<R: Real>(m: &Plant, p: &Params<R>) -> R {
    let age = p.compensator_delay - R::lit(m.timing.own_delay());
    (age * R::lit(1.0 / m.timing.tick())).max(R::lit(0.0))
}

/// One tick: the measured wrench in, the acting wrench out; `past` are the simulated parts as many ticks ago as
/// [`prediction_horizon`] says.
#[inline(always)]
pub fn compensate<R: Real>(
    m: &Plant,
    p: &Params<R>,
    s: &Compensation<R>,
    now: &Parts<R>,
    past: &Parts<R>,
    measured: Wrench<R>,
) -> Compensation<R> {
    let line = contact_line(p, now, measured);
    let mut next = Compensation {
        output: measured,
        measured,
        rate: lead::rate(m, p, s, measured),
        touching: R::select(line.touching, R::lit(1.0), R::lit(0.0)),
        ..*s
    };
    let along = |force| along_line(m, &line, measured, force);
    match m.facility.compensator.kind {
        CompensatorKind::None => next = *s,
        CompensatorKind::FirstOrderLead => next.output = lead::first(m, &line, &next, p.compensator_delay),
        CompensatorKind::SecondOrderLead => next.output = lead::second(m, p, &line, s, &next),
        CompensatorKind::Smith => next.output = along(smith::force(p, &line, now, past)),
        CompensatorKind::VirtualDamping => next.output = along(virtual_damping::force(p, &line)),
        CompensatorKind::Passivity => next = passivity::control(m, p, s, &line, next),
        CompensatorKind::LeadPassivity => next = lead_passivity::control(m, p, s, &line, next),
    }
    next
}

/// The line of action of the measured wrench and the simulated speed along it.
#[inline(always)]
fn contact_line<R: Real>(p: &Params<R>, parts: &Parts<R>, measured: Wrench<R>) -> ContactLine<R> {
    let size = measured.force.norm();
    let touching = p.compensator_threshold.lt(size);
    let inverse = R::lit(1.0) / R::select(touching, size, R::lit(1.0));
    let normal = measured.force * inverse;
    let lever = normal.cross(measured.moment) * inverse;
    let slide = parts.a.attitude.rotate_back(sliding_velocity(&parts.a, &parts.b, Vec3::zero()));
    let turn = parts.a.attitude.rotate_back(parts.a.omega - parts.b.omega);
    ContactLine { touching, normal, lever, speed: (slide + turn.cross(lever)).dot(normal) }
}

/// The measured wrench and, in contact, a force along its line.
#[inline(always)]
fn along_line<R: Real>(m: &Plant, line: &ContactLine<R>, measured: Wrench<R>, force: R) -> Wrench<R> {
    let force = R::select(line.touching, force, R::lit(0.0));
    never_pulling(m, line, add_along(line, measured, force))
}

/// A wrench and a force along the contact line.
#[inline(always)]
pub(crate) fn add_along<R: Real>(line: &ContactLine<R>, w: Wrench<R>, force: R) -> Wrench<R> {
    Wrench {
        force: line.normal.scale_add(force, w.force),
        moment: line.lever.cross(line.normal).scale_add(force, w.moment),
    }
}

/// Removes tension from a wrench: a unilateral pair does not adhere, whatever a compensator computes.
#[inline(always)]
pub(crate) fn never_pulling<R: Real>(m: &Plant, line: &ContactLine<R>, w: Wrench<R>) -> Wrench<R> {
    if may_pull(m) {
        return w;
    }
    let zero = R::lit(0.0);
    let pull = (-(w.force.dot(line.normal))).max(zero);
    add_along(line, w, R::select(line.touching, pull, zero))
}

/// Whether the acting force may be tensile: in a bilateral contact, or if the facility allows it.
pub(crate) fn may_pull(m: &Plant) -> bool {
    m.contact.bilateral || m.facility.compensator.pulls
}
