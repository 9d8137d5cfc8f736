//! The contact pair: points, solids, law, latch, and the nominal values that follow from others.

use super::{GATE_ANGLE, GATE_SIZE};
use crate::check::{Checker, span_of, take_parameters};
use crate::mobility::effective_mass;
use crate::written::scenario::{ContactTable, LatchTable, PointTable, ScenarioFile, SolidTable, StartTable};
use softdock_kernels::model::{Contact, ContactPoint, Latch, Model, NormalLaw, Shape, Solid};
use softdock_kernels::params::Params;
use softdock_kernels::range::{LENGTH, Range, SPEED};
use softdock_kernels::vector::vec3;

/// Most contact points and solids: every point meets every solid in every substep.
const MOST_POINTS: usize = 256;
const MOST_SOLIDS: usize = 16;

/// Bristle stiffness over normal stiffness: Mindlin's ratio 2 (1 - nu) / (2 - nu), 0.67 to 1, at its soft end.
const BRISTLE_RATIO: f64 = 2.0 / 3.0;
/// Damping ratio of an unstated bristle: near critical, so that a stuck contact does not ring.
const BRISTLE_DAMPING_RATIO: f64 = 0.7;

pub(crate) fn read(c: &mut Checker, file: &ScenarioFile, p: &mut Params<f64>) -> Contact {
    let table = &file.contact.value;
    let law = law(c, table);
    take_parameters!(c, p;
        contact_stiffness = table.stiffness;
        contact_damping = table.damping;
        contact_dissipation = table.dissipation;
        contact_friction = table.friction;
    );
    p.bristle_stiffness =
        c.parameter_or(&table.bristle_stiffness, "bristle_stiffness", BRISTLE_RATIO * p.contact_stiffness);
    take_parameters!(c, p; bristle_damping = table.bristle_damping;);
    let (points, solids) = (&file.part_a.point, &file.part_b.solid);
    for (span, count, most, what) in [
        (&points.span, points.value.len(), MOST_POINTS, "contact points"),
        (&solids.span, solids.value.len(), MOST_SOLIDS, "solids"),
    ] {
        if !(1..=most).contains(&count) {
            c.refuse(span, format!("{count} {what}"), format!("give 1 to {most} {what}"));
        }
    }
    Contact {
        points: points.value.iter().map(|table| point(c, table)).collect(),
        solids: solids.value.iter().map(|table| solid(c, table)).collect(),
        law,
        bilateral: table.bilateral.unwrap_or(false),
        latch: file.latch.as_ref().map(|table| latch(c, table, p)),
    }
}

fn law(c: &mut Checker, table: &ContactTable) -> NormalLaw {
    let power = c.choice(&table.law, &[("linear", false), ("power", true)]);
    let keys = [
        ("exponent", span_of(&table.exponent), power, false),
        ("damping", span_of(&table.damping), !power, false),
        ("dissipation", span_of(&table.dissipation), power, false),
        ("restitution", span_of(&table.restitution), true, false),
    ];
    c.keys_of_kind(&table.law, &keys);
    let damped = table.damping.as_ref().or(table.dissipation.as_ref());
    if let (Some(damped), Some(_)) = (damped, &table.restitution) {
        c.refuse(&damped.span, "damping is given twice: here and by `restitution`", "remove one of them");
    }
    if power {
        NormalLaw::Power { exponent: c.number_or(&table.exponent, 1.5, "1", Range::within(1.0, 5.0)) }
    } else {
        NormalLaw::Linear
    }
}

fn point(c: &mut Checker, table: &PointTable) -> ContactPoint {
    ContactPoint {
        position: c.vector(&table.position, "m", Range::size(LENGTH)),
        radius: c.number_or(&table.radius, 0.0, "m", Range::within(0.0, LENGTH)),
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Plane,
    Sphere,
    Box,
    Cone,
    Bore,
}

fn solid(c: &mut Checker, table: &SolidTable) -> Solid {
    let kind = c.choice(
        &table.shape,
        &[
            ("plane", Kind::Plane),
            ("sphere", Kind::Sphere),
            ("box", Kind::Box),
            ("cone", Kind::Cone),
            ("bore", Kind::Bore),
        ],
    );
    let is = |kinds: &[Kind]| kinds.contains(&kind);
    let needs = |name, span, kinds: &[Kind]| (name, span, is(kinds), is(kinds));
    let keys = [
        needs("radius", span_of(&table.radius), &[Kind::Sphere, Kind::Bore]),
        needs("size", span_of(&table.size), &[Kind::Box]),
        needs("mouth", span_of(&table.mouth), &[Kind::Cone]),
        needs("bottom", span_of(&table.bottom), &[Kind::Cone]),
        needs("depth", span_of(&table.depth), &[Kind::Cone, Kind::Bore]),
        ("chamfer", span_of(&table.chamfer), is(&[Kind::Bore]), false),
    ];
    let complete = c.keys_of_kind(&table.shape, &keys);
    let frame = c.pose(&table.position, &table.rotation);
    let size = Range::above(0.0, LENGTH / 2.0);
    let mut number = |written| c.number_or(written, 1.0, "m", size);
    let (radius, mouth, bottom, depth) =
        (number(&table.radius), number(&table.mouth), number(&table.bottom), number(&table.depth));
    let chamfer = c.number_or(&table.chamfer, 0.0, "m", Range::within(0.0, depth));
    if let (true, Kind::Cone, Some(written)) = (complete && bottom >= mouth, kind, &table.bottom) {
        let message = "the bottom is not narrower than the mouth";
        c.refuse(&written.span, message, "write a bottom below the mouth, or a bore for a cylinder");
    }
    let shape = match kind {
        Kind::Plane => Shape::Plane,
        Kind::Sphere => Shape::Sphere { radius },
        Kind::Box => {
            let half = table.size.as_ref().map_or(vec3(0.5, 0.5, 0.5), |edges| c.vector(edges, "m", size) * 0.5);
            Shape::Box { half }
        }
        Kind::Cone => Shape::Cone { mouth, bottom, depth },
        Kind::Bore => Shape::Bore { radius, depth, chamfer },
    };
    Solid { frame, shape }
}

fn latch(c: &mut Checker, table: &LatchTable, p: &mut Params<f64>) -> Latch {
    take_parameters!(c, p;
        latch_stiffness = table.stiffness;
        latch_damping = table.damping;
        latch_rotation_stiffness = table.rotation_stiffness;
        latch_rotation_damping = table.rotation_damping;
    );
    Latch {
        point: c.vector(&table.point, "m", Range::size(LENGTH)),
        seat: c.vector(&table.seat, "m", Range::size(LENGTH)),
        depth: c.number(&table.depth, "m", GATE_SIZE),
        offset: c.number(&table.offset, "m", GATE_SIZE),
        angle: c.number(&table.angle, "rad", GATE_ANGLE),
        speed: c.number(&table.speed, "m/s", Range::above(0.0, SPEED)),
    }
}

/// Damping from restitution, and the bristle's damping: both need the effective mass of the finished model.
pub(crate) fn complete(c: &mut Checker, table: &ContactTable, start: &StartTable, m: &mut Model) {
    let Some(mass) = effective_mass(m, m.nominal.base_mass, m.nominal.target_mass) else {
        return;
    };
    let p = &mut m.nominal;
    if table.bristle_damping.is_none() {
        p.bristle_damping = 2.0 * BRISTLE_DAMPING_RATIO * (p.bristle_stiffness * mass).sqrt();
    }
    let Some(written) = &table.restitution else { return };
    let restitution = c.number(written, "1", Range::within(0.01, 1.0));
    match m.contact.law {
        NormalLaw::Linear => {
            p.contact_damping = 2.0 * damping_ratio(restitution) * (p.contact_stiffness * mass).sqrt();
        }
        NormalLaw::Power { .. } if p.closing_speed > 0.0 => {
            p.contact_dissipation = scaled_dissipation(restitution) / p.closing_speed;
        }
        NormalLaw::Power { .. } => {
            let span = &start.closing_speed.span;
            c.refuse(
                span,
                "a restitution needs a closing speed above 0 m/s",
                "raise it, or write `dissipation` instead",
            );
        }
    }
}

/// Damping ratio of a linear contact without adhesion that gives a restitution (Kelvin-Voigt, exit at zero force).
fn damping_ratio(restitution: f64) -> f64 {
    bisect(0.0, 1e3, |zeta| linear_restitution(zeta) - restitution)
}

/// Restitution of m x'' + b x' + k x = 0, left when the force first vanishes.
fn linear_restitution(zeta: f64) -> f64 {
    let root = (1.0 - zeta * zeta).abs().sqrt();
    if root < 1e-9 {
        return (-2.0_f64).exp();
    }
    if zeta > 1.0 {
        return (-(zeta / root) * ((zeta + root) / (zeta - root)).ln()).exp();
    }
    let angle = (2.0 * zeta * root).atan2(2.0 * zeta * zeta - 1.0);
    (-(zeta / root) * angle).exp()
}

/// D = a v of F = K d^n (1 + a d') that gives a restitution e: D (1 + e) = ln((1 + D) / (1 - e D)), for any n.
fn scaled_dissipation(e: f64) -> f64 {
    bisect(1e-9, (1.0 - 1e-12) / e, |d| d * (1.0 + e) - ((1.0 + d) / (1.0 - e * d)).ln())
}

/// The zero of a function that falls from positive to negative.
fn bisect(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of the exact relations: Kelvin-Voigt without adhesion, and F = K d^n (1 + a d').
    #[test]
    fn damping_follows_from_restitution() {
        for (zeta, e) in [(0.05, 0.858_758), (0.1, 0.744_079), (0.4, 0.363_527), (0.8, 0.179_783), (1.5, 0.075_588_3)] {
            assert!((linear_restitution(zeta) - e).abs() < 1e-6, "{zeta}");
            assert!((damping_ratio(e) - zeta).abs() < 1e-4, "{e}");
        }
        for (e, d) in [(0.95, 0.07893), (0.8, 0.37315), (0.5, 1.43275), (0.1, 9.99816)] {
            assert!((scaled_dissipation(e) - d).abs() < 1e-5, "{e}: {}", scaled_dissipation(e));
        }
    }
}
