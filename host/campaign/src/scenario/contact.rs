//! Contact: points, solids, laws of the pairs, latch, and the nominal values that follow from others.

use super::{GATE_ANGLE, GATE_SIZE};
use crate::check::{Checker, span_of};
use crate::mesh::{self, MeshFile};
use crate::mobility::effective_mass;
use crate::stability::crowd;
use crate::written::scenario::{ContactTable, LatchTable, LawKeys, PointTable, ScenarioFile, SolidTable, StartTable};
use crate::written::{At, Quantities};
use softdock_kernels::contact::common_pair;
use softdock_kernels::material::{NormalLaw, Pair};
use softdock_kernels::model::{
    Contact, ContactPoint, Finger, Hook, Latch, MaterialPair, Members, Model, PartShape, Shape, Solid,
};
use softdock_kernels::params::Params;
use softdock_kernels::plant::{PointSource, part_points};
use softdock_kernels::range::{LENGTH, MOST_HOOKS, Range, SPEED};
use softdock_kernels::vector::vec3;
use std::collections::BTreeSet;

/// Most contact points and solids of a part: every point meets every solid of the other in every substep.
const MOST_POINTS: usize = 256;
const MOST_SOLIDS: usize = 16;

/// Bristle stiffness over normal stiffness: Mindlin's ratio 2 (1 - nu) / (2 - nu), 0.67 to 1, at its soft end.
const BRISTLE_RATIO: f64 = 2.0 / 3.0;
/// Damping ratio of an unstated bristle: near critical, so that a stuck contact does not ring.
const BRISTLE_DAMPING_RATIO: f64 = 0.7;

/// Exponent of a law that states none, and the restitution that one may state.
const HERTZ: f64 = 1.5;
const RESTITUTION: Range = Range::within(0.01, 1.0);
const EXPONENT: Range = Range::within(1.0, 5.0);
/// The closing speed at the start over the slowest touch that is damped at its own speed, and that touch without a
/// closing speed \[m/s\].
const SLOWER: f64 = 10.0;
const SLOWEST: f64 = 1e-3;

pub(crate) fn read(c: &mut Checker, file: &ScenarioFile, p: &mut Params<f64>) -> (Contact, Vec<MeshFile>) {
    let table = &file.contact.value;
    let (law, pair) = law(c, table.law(), p.closing_speed);
    store(&pair, p);
    let mut a = part(c, "part_a", &file.part_a.point, &file.part_a.solid);
    let mut b = part(c, "part_b", &file.part_b.point, &file.part_b.solid);
    let (bilateral, solids) = (table.bilateral.unwrap_or(false), [&*file.part_a.solid, &*file.part_b.solid]);
    let meshes = mesh::read(c, solids, [&mut a, &mut b]);
    mesh::refuse_sizes(c, solids, [&a, &b]);
    mesh::refuse_bilateral(c, solids, bilateral);
    let pairs = pairs(c, file, [&a, &b], p.closing_speed);
    let latch = file.latch.as_ref().map(|table| latch(c, table, p));
    let fingers = fingers(c, file);
    let is_shell = |solid: &SolidTable| solid.patch.is_some();
    let patch_radius = patch_radius(c, table.law(), solids.into_iter().flatten().any(is_shell));
    (Contact { a, b, pairs, law, patch_radius, bilateral, latch, fingers }, meshes)
}

/// What of part A moves as the grip closes: all with the same way are one finger.
fn fingers(c: &mut Checker, file: &ScenarioFile) -> Vec<Finger> {
    let (points, solids) = (file.part_a.point.iter(), file.part_a.solid.iter());
    let points = points.enumerate().map(|(index, own)| (PointSource::Point(index), &own.closes));
    let solids = solids.enumerate().map(|(index, own)| (PointSource::Solid(index), &own.closes));
    let mut fingers: Vec<Finger> = Vec::new();
    for (source, written) in points.chain(solids) {
        let Some(written) = written else { continue };
        let travel = c.vector(written, "m", Range::size(LENGTH));
        let has_grip = file.arm.as_ref().is_some_and(|arm| arm.grip.is_some());
        if !has_grip {
            let remedy = "add grip = { time = \"1 s\" } to [arm] and grip = \"close\" to a phase, or remove it";
            c.refuse(&written.span, "this does nothing: the arm has no grip", remedy);
        }
        let index = fingers.iter().position(|own| own.travel == travel).unwrap_or_else(|| {
            fingers.push(Finger { members: Members::default(), travel });
            fingers.len() - 1
        });
        match source {
            PointSource::Point(point) => fingers[index].members.points.push(point),
            PointSource::Solid(solid) => fingers[index].members.solids.push(solid),
        }
    }
    let of_b = file.part_b.point.iter().filter_map(|own| own.closes.as_ref());
    for own in of_b.chain(file.part_b.solid.iter().filter_map(|own| own.closes.as_ref())) {
        c.refuse(&own.span, "only what belongs to part A moves with the grip", "remove it");
    }
    fingers
}

fn part(c: &mut Checker, table: &str, points: &[PointTable], solids: &[SolidTable]) -> PartShape {
    let part = PartShape {
        points: points.iter().map(|table| point(c, table)).collect(),
        solids: solids.iter().map(|table| solid(c, table)).collect(),
    };
    let all = part_points(&part).len();
    for (count, most, what) in [(all, MOST_POINTS, "contact points"), (part.solids.len(), MOST_SOLIDS, "solids")] {
        if count > most {
            let span = c.source.span_of(table);
            c.refuse(
                &span,
                format!("{count} {what}, those of the solids among them"),
                format!("{most} {what} at most"),
            );
        }
    }
    part
}

/// The material pairs. Damping by restitution and the default of the bristle's damping follow in [`complete`].
fn pairs(c: &mut Checker, file: &ScenarioFile, parts: [&PartShape; 2], closing_speed: f64) -> Vec<MaterialPair> {
    let (a, b) = (&file.part_a, &file.part_b);
    let (a, b) = (Names::of("part_a", &a.point, &a.solid), Names::of("part_b", &b.point, &b.solid));
    let of = |c: &mut Checker, names: &Names, written: &Option<Vec<At<String>>>, part: &PartShape| match written {
        Some(written) => names.members(c, written),
        None => part.members(),
    };
    let mut pairs: Vec<MaterialPair> = Vec::new();
    for table in &file.contact.value.pair {
        let (law, pair) = law(c, table.law(), closing_speed);
        let mut take = |written, field, default| c.parameter_or(written, field, default);
        let properties = Pair {
            stribeck: take(&table.stribeck, "contact_stribeck", 0.0),
            stribeck_speed: take(&table.stribeck_speed, "contact_stribeck_speed", pair.stribeck_speed),
            anisotropy: take(&table.anisotropy, "contact_anisotropy", 0.0),
            adhesion: take(&table.adhesion, "contact_adhesion", 0.0),
            ..pair
        };
        let (members_a, members_b) = (of(c, &a, &table.a, parts[0]), of(c, &b, &table.b, parts[1]));
        let has_shell = |members: &Members, solids: &[SolidTable]| {
            members.solids.iter().any(|index| solids[*index].patch.is_some())
        };
        let shells = has_shell(&members_a, &file.part_a.solid) || has_shell(&members_b, &file.part_b.solid);
        let patch_radius = patch_radius(c, table.law(), shells);
        let row = MaterialPair { a: members_a, b: members_b, law, properties, patch_radius };
        if let Some(other) = pairs.iter().position(|other| meet(&row.a, &other.a) && meet(&row.b, &other.b)) {
            let message = format!("what this pair names is together in `[[contact.pair]]` {} too", other + 1);
            c.refuse(&table.law.span, message, "name other points or solids in `a` or `b`");
        }
        pairs.push(row);
    }
    pairs
}

/// Radius of the patch of a law's points. The points of a mesh resolve their patch themselves.
fn patch_radius(c: &mut Checker, keys: LawKeys<'_>, has_shell: bool) -> f64 {
    let Some(written) = keys.patch_radius else { return 0.0 };
    let radius = c.number(written, "m", Range::within(0.0, LENGTH));
    if radius > 0.0 && has_shell {
        let remedy = "remove it, or give the solids contact points of their own instead of `patch`";
        c.refuse(&written.span, "the points of a mesh have no patch of this radius", remedy);
    }
    radius
}

fn meet(one: &Members, other: &Members) -> bool {
    let any = |one: &[usize], other: &[usize]| one.iter().any(|own| other.contains(own));
    any(&one.points, &other.points) || any(&one.solids, &other.solids)
}

/// Names of a part's points and solids.
struct Names<'a> {
    table: &'static str,
    points: Vec<Option<&'a At<String>>>,
    solids: Vec<Option<&'a At<String>>>,
}

impl<'a> Names<'a> {
    fn of(table: &'static str, points: &'a [PointTable], solids: &'a [SolidTable]) -> Self {
        Self {
            table,
            points: points.iter().map(|point| point.name.as_ref()).collect(),
            solids: solids.iter().map(|solid| solid.name.as_ref()).collect(),
        }
    }

    /// What has one of the names.
    fn members(&self, c: &mut Checker, names: &[At<String>]) -> Members {
        let is_named = |own: &Option<&At<String>>, name: &str| own.is_some_and(|own| own.value == name);
        for name in names {
            if self.points.iter().chain(&self.solids).any(|own| is_named(own, &name.value)) {
                continue;
            }
            let known: BTreeSet<&str> =
                self.points.iter().chain(&self.solids).flatten().map(|own| &*own.value).collect();
            let known = known.into_iter().collect::<Vec<_>>().join(", ");
            let remedy = match known.is_empty() {
                true => format!("write name = \"{}\" in a point or solid of {}", name.value, self.table),
                false => format!("write one of: {known}"),
            };
            c.refuse(&name.span, format!("nothing of {} has the name `{}`", self.table, name.value), remedy);
        }
        let of = |all: &[Option<&At<String>>]| -> Vec<usize> {
            (0..all.len()).filter(|index| names.iter().any(|name| is_named(&all[*index], &name.value))).collect()
        };
        Members { points: of(&self.points), solids: of(&self.solids) }
    }
}

/// Writes the properties that the parameters of a run have.
fn store(pair: &Pair<f64>, p: &mut Params<f64>) {
    (p.contact_stiffness, p.contact_damping, p.contact_dissipation) = (pair.stiffness, pair.damping, pair.dissipation);
    (p.contact_friction, p.bristle_stiffness, p.bristle_damping) =
        (pair.friction, pair.bristle_stiffness, pair.bristle_damping);
}

#[derive(Clone, Copy, PartialEq)]
enum Law {
    Linear,
    Power,
    Hertz,
    LankaraniNikravesh,
    Flores,
    Rebound,
    Impact,
    Stop,
}

/// Reads a law and its properties; damping that needs the finished model follows in [`complete`].
fn law(c: &mut Checker, keys: LawKeys<'_>, closing_speed: f64) -> (NormalLaw, Pair<f64>) {
    let law = c.choice(
        keys.law,
        &[
            ("linear", Law::Linear),
            ("power", Law::Power),
            ("hertz", Law::Hertz),
            ("lankarani_nikravesh", Law::LankaraniNikravesh),
            ("flores", Law::Flores),
            ("rebound", Law::Rebound),
            ("impact", Law::Impact),
            ("stop", Law::Stop),
        ],
    );
    let is = |laws: &[Law]| laws.contains(&law);
    let (hertz, per_touch) = (law == Law::Hertz, is(&[Law::LankaraniNikravesh, Law::Flores, Law::Rebound]));
    let (impact, stop) = (law == Law::Impact, law == Law::Stop);
    let rows = [
        ("stiffness", span_of(keys.stiffness), !hertz, !hertz),
        ("exponent", span_of(keys.exponent), !is(&[Law::Linear, Law::Hertz, Law::Stop]), false),
        ("youngs_modulus", span_of(keys.youngs_modulus), hertz, hertz),
        ("poisson", span_of(keys.poisson), hertz, hertz),
        ("radius", span_of(keys.radius), hertz, hertz),
        ("damping", span_of(keys.damping), is(&[Law::Linear, Law::Impact, Law::Stop]), impact),
        ("dissipation", span_of(keys.dissipation), is(&[Law::Power, Law::Hertz]), false),
        ("restitution", span_of(keys.restitution), !impact, per_touch),
        ("slowest_touch", span_of(keys.slowest_touch), per_touch, false),
        ("damping_depth", span_of(keys.damping_depth), impact, impact),
        ("stroke", span_of(keys.stroke), stop, stop),
        ("stop_stiffness", span_of(keys.stop_stiffness), stop, stop),
        ("stop_exponent", span_of(keys.stop_exponent), stop, false),
    ];
    c.keys_of_kind(keys.law, &rows);
    let damped = keys.damping.as_ref().or(keys.dissipation.as_ref());
    if let (Some(damped), Some(_)) = (damped, keys.restitution) {
        c.refuse(&damped.span, "damping is given twice: here and by `restitution`", "remove one of them");
    }
    let stiffness = match hertz {
        true => hertz_stiffness(c, keys),
        false => c.parameter_or(keys.stiffness, "contact_stiffness", 1.0),
    };
    let exponent = c.number_or(keys.exponent, HERTZ, "1", EXPONENT);
    let slowest = if closing_speed > 0.0 { closing_speed / SLOWER } else { SLOWEST };
    let slowest = c.number_or(keys.slowest_touch, slowest, "m/s", Range::above(0.0, SPEED));
    let mut length = |written| c.number_or(written, 1.0, "m", Range::above(0.0, LENGTH));
    let (ramp, stroke) = (length(keys.damping_depth), length(keys.stroke));
    let restitution = c.number_or(keys.restitution, 1.0, "1", RESTITUTION);
    // D of F = K d^n (1 + D d' / v): the two of the literature are approximations, of which the first holds near 1.
    let scaled = match law {
        Law::LankaraniNikravesh => Some(0.75 * (1.0 - restitution * restitution)),
        Law::Flores => Some(1.6 * (1.0 - restitution) / restitution),
        Law::Rebound => Some(scaled_dissipation(restitution)),
        _ => None,
    };
    let normal = match law {
        Law::Linear => NormalLaw::Linear,
        Law::Power | Law::Hertz => NormalLaw::Power { exponent },
        Law::LankaraniNikravesh | Law::Flores | Law::Rebound => NormalLaw::Rebound { exponent, slowest },
        Law::Impact => NormalLaw::Impact { exponent, ramp },
        Law::Stop => NormalLaw::Stop {
            stroke,
            stiffness: c.parameter_or(keys.stop_stiffness, "contact_stiffness", 1.0),
            exponent: c.number_or(keys.stop_exponent, 1.0, "1", EXPONENT),
        },
    };
    let mut take = |written, field, default| c.parameter_or(written, field, default);
    let pair = Pair {
        stiffness,
        damping: take(keys.damping, "contact_damping", 0.0),
        dissipation: take(keys.dissipation, "contact_dissipation", scaled.map_or(0.0, |scaled| scaled / slowest)),
        friction: take(keys.friction, "contact_friction", 0.0),
        bristle_stiffness: take(keys.bristle_stiffness, "bristle_stiffness", BRISTLE_RATIO * stiffness),
        bristle_damping: take(keys.bristle_damping, "bristle_damping", 0.0),
        ..common_pair(&Params::null())
    };
    (normal, pair)
}

/// Stiffness 4/3 E* sqrt(R) of two elastic bodies with round surfaces (Johnson, Contact Mechanics, 1985, ch. 4).
fn hertz_stiffness(c: &mut Checker, keys: LawKeys<'_>) -> f64 {
    let mut both = |written: &Option<Quantities>, unit, range| match written {
        Some(written) => c.list(written, 2, unit, range),
        None => vec![1.0; 2],
    };
    let moduli = both(keys.youngs_modulus, "Pa", Range::within(1e3, 2e12));
    let ratios = both(keys.poisson, "1", Range::within(0.0, 0.5));
    let radius = c.number_or(keys.radius, 1.0, "m", Range::above(0.0, LENGTH));
    let compliance: f64 = moduli.iter().zip(&ratios).map(|(modulus, ratio)| (1.0 - ratio * ratio) / modulus).sum();
    4.0 / 3.0 / compliance * radius.sqrt()
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
    Capsule,
    Cylinder,
    Frustum,
    Ring,
    Cone,
    Bore,
    Mesh,
}

/// Contact points of a rim or a ring, unless stated, and of a capsule; the most of one.
const RIM_POINTS: usize = 16;
const CAPSULE_POINTS: usize = 2;
const MOST_RIM_POINTS: u64 = 64;

fn solid(c: &mut Checker, table: &SolidTable) -> Solid {
    let kind = c.choice(
        &table.shape,
        &[
            ("plane", Kind::Plane),
            ("sphere", Kind::Sphere),
            ("box", Kind::Box),
            ("capsule", Kind::Capsule),
            ("cylinder", Kind::Cylinder),
            ("frustum", Kind::Frustum),
            ("ring", Kind::Ring),
            ("cone", Kind::Cone),
            ("bore", Kind::Bore),
            ("mesh", Kind::Mesh),
        ],
    );
    let is = |kinds: &[Kind]| kinds.contains(&kind);
    let needs = |name, span, kinds: &[Kind]| (name, span, is(kinds), is(kinds));
    let keys = [
        needs("radius", span_of(&table.radius), &[Kind::Sphere, Kind::Capsule, Kind::Cylinder, Kind::Ring, Kind::Bore]),
        needs("length", span_of(&table.length), &[Kind::Capsule, Kind::Cylinder, Kind::Frustum]),
        needs("front", span_of(&table.front), &[Kind::Frustum]),
        needs("back", span_of(&table.back), &[Kind::Frustum]),
        needs("tube", span_of(&table.tube), &[Kind::Ring]),
        (
            "points",
            span_of(&table.points),
            is(&[Kind::Capsule, Kind::Cylinder, Kind::Frustum, Kind::Ring, Kind::Bore, Kind::Mesh]),
            false,
        ),
        needs("file", span_of(&table.file), &[Kind::Mesh]),
        needs("unit", span_of(&table.unit), &[Kind::Mesh]),
        ("resolution", span_of(&table.resolution), is(&[Kind::Mesh]), false),
        ("patch", span_of(&table.patch), is(&[Kind::Mesh]), false),
        ("density", span_of(&table.density), is(&[Kind::Mesh]), false),
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
    let (length, front, back, tube) =
        (number(&table.length), number(&table.front), number(&table.back), number(&table.tube));
    let least = if kind == Kind::Capsule { 2 } else { 4 };
    let stated = table.points.as_ref().filter(|_| kind != Kind::Mesh);
    let points = stated.map(|written| c.count(written, least, MOST_RIM_POINTS) as usize);
    let points = points.unwrap_or(if kind == Kind::Capsule { CAPSULE_POINTS } else { RIM_POINTS });
    if let (Kind::Ring, Some(written)) = (kind, table.tube.as_ref().filter(|_| complete && tube >= radius)) {
        c.refuse(&written.span, "the tube is not thinner than the ring", "write a tube below the radius");
    }
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
        Kind::Capsule => Shape::Capsule { radius, length, points },
        Kind::Cylinder => Shape::Cylinder { radius, length, points },
        Kind::Frustum => Shape::Frustum { front, back, length, points },
        Kind::Ring => Shape::Ring { radius, tube, points },
        Kind::Cone => Shape::Cone { mouth, bottom, depth },
        Kind::Bore => Shape::Bore { radius, depth, chamfer, points },
        // Its file is read when the other part's points are known.
        Kind::Mesh => Shape::Plane,
    };
    Solid { frame, shape }
}

fn latch(c: &mut Checker, table: &LatchTable, p: &mut Params<f64>) -> Latch {
    c.take(table.parameters(0), p);
    latch_hooks(c, table, p);
    Latch {
        hooks: table
            .hook
            .iter()
            .map(|hook| Hook {
                point: c.vector(&hook.point, "m", Range::size(LENGTH)),
                seat: c.vector(&hook.seat, "m", Range::size(LENGTH)),
            })
            .collect(),
        hook_reach: c.number_or(&table.hook_reach, 0.0, "m", GATE_SIZE),
        point: c.vector(&table.point, "m", Range::size(LENGTH)),
        seat: c.vector(&table.seat, "m", Range::size(LENGTH)),
        depth: c.number(&table.depth, "m", GATE_SIZE),
        offset: c.number(&table.offset, "m", GATE_SIZE),
        angle: c.number(&table.angle, "rad", GATE_ANGLE),
        speed: c.number(&table.speed, "m/s", Range::above(0.0, SPEED)),
    }
}

/// Number of the hook that fails, and keys that are missing or have no effect.
fn latch_hooks(c: &mut Checker, table: &LatchTable, p: &mut Params<f64>) {
    let count = table.hook.len();
    if count > MOST_HOOKS {
        c.refuse(&table.hook[0].point.span, format!("{count} hooks"), format!("write {MOST_HOOKS} at most"));
    }
    if let (0, Some(written)) = (count, table.hook_reach.as_ref().or(table.failed.as_ref())) {
        c.refuse(&written.span, "this does nothing: the latch has no hooks", "add latch.hook, or remove it");
    }
    if count > 0 && table.hook_reach.is_none() {
        let remedy = "add hook_reach = \"10 mm\" to [latch]";
        c.refuse(&table.hook[0].point.span, "`hook_reach` is missing: how near its seat a hook closes", remedy);
    }
    p.latch_failed = c.number_or(&table.failed, 0.0, "1", Range::within(0.0, count as f64));
    if let Some(written) = table.failed.as_ref().filter(|_| p.latch_failed.fract() != 0.0) {
        c.refuse(
            &written.span,
            format!("{} is no number of a hook", p.latch_failed),
            format!("write 0 (all work) to {count}"),
        );
    }
}

/// Damping from restitution, and the bristle's damping: both need the effective mass of the finished model.
pub(crate) fn complete(c: &mut Checker, table: &ContactTable, start: &StartTable, m: &mut Model) {
    let Some(mass) = effective_mass(m, m.nominal.base_mass, m.nominal.target_mass) else {
        return;
    };
    // A bristle of a shell is that of all its points in contact.
    let bristle_mass = mass / crowd(m, |_, _| true);
    let p = &mut m.nominal;
    let mut common = common_pair(p);
    complete_pair(c, table.law(), (m.contact.law, &mut common), start, [mass, bristle_mass, p.closing_speed]);
    store(&common, p);
    for (row, table) in m.contact.pairs.iter_mut().zip(&table.pair) {
        complete_pair(c, table.law(), (row.law, &mut row.properties), start, [mass, bristle_mass, p.closing_speed]);
    }
}

/// Completes the damping of a pair, for an effective mass, the same for each share of its bristle \[kg\], and a closing
/// speed \[m/s\].
fn complete_pair(
    c: &mut Checker,
    keys: LawKeys<'_>,
    (law, pair): (NormalLaw, &mut Pair<f64>),
    start: &StartTable,
    [mass, bristle_mass, closing_speed]: [f64; 3],
) {
    if keys.bristle_damping.is_none() {
        pair.bristle_damping = 2.0 * BRISTLE_DAMPING_RATIO * (pair.bristle_stiffness * bristle_mass).sqrt();
    }
    let Some(written) = keys.restitution else { return };
    let restitution = c.number(written, "1", RESTITUTION);
    match law {
        NormalLaw::Rebound { .. } => {}
        law if law.is_viscous() => {
            pair.damping = 2.0 * damping_ratio(restitution) * (pair.stiffness * mass).sqrt();
        }
        _ if closing_speed > 0.0 => {
            pair.dissipation = scaled_dissipation(restitution) / closing_speed;
        }
        _ => {
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

/// D = a v of F = K d^n (1 + a d') that gives a restitution e, for any n.
fn scaled_dissipation(e: f64) -> f64 {
    bisect(1e-9, (1.0 - 1e-12) / e, |d| rebound_residual(d, e))
}

/// Restitution e that D = a v of F = K d^n (1 + a d') gives.
pub fn rebound_restitution(d: f64) -> f64 {
    bisect(0.0, ((1.0 - 1e-12) / d.max(1e-12)).min(1.0), |e| rebound_residual(d, e))
}

/// Zero where D gives e: D (1 + e) = ln((1 + D) / (1 - e D)).
fn rebound_residual(d: f64, e: f64) -> f64 {
    d * (1.0 + e) - ((1.0 + d) / (1.0 - e * d)).ln()
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
