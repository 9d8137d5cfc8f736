//! A scenario's constants, prepared for the stages: what can be computed once is computed here.

use crate::chain::Chain;
use crate::contact::NEAR_MIDDLE;
use crate::contact::features::{Feature, features};
use crate::contact::profile::Surface;
use crate::effects::EffectSet;
use crate::manipulator::cell::{Cell, Misplaced};
use crate::material::{NormalLaw, Pair};
use crate::mesh::{Ball, SHELL_WORDS, ShellPoint};
use crate::model::{Contact, ContactPoint, JointLevel, MaterialPair, Members, Model, PartShape, Shape, Side, Solid};
use crate::robot::{command, robots_at};
use crate::session::{SessionRobot, Workspace};
use crate::space::{Motion, Parts};
use crate::stewart::PreparedRing;
use crate::vector::{Mat3, Pose, Sym3, Vec3};
use std::collections::BTreeSet;
use std::ops::Deref;

/// A model with its derived constants; dereferences to the model.
#[derive(Clone, Debug)]
pub struct Plant {
    model: Model,
    /// The base with its arm; joint coordinates count from the start posture.
    pub chain: Chain,
    /// Pose of part A at the start posture, from the base's centre of mass in body axes.
    pub tool_start: Pose<f64>,
    /// Inverse of the target's nominal inertia.
    pub target_inverse_inertia: Sym3<f64>,
    /// Laboratory motions of the parts at the start of an undispersed run, at rest.
    pub start: Parts<f64>,
    /// The ring that part B rides on, if there is one.
    pub capture_ring: Option<PreparedRing>,
    /// Solids of parts A and B, their surfaces prepared.
    pub solids: [Vec<PreparedSolid>; 2],
    /// Laws of contact, each with the solids that it is for.
    pub pairs: Vec<ContactPair>,
    /// The contact points with the laws that they meet: those of part A, then those of part B.
    pub contacts: Vec<PointOfPair>,
    /// The shells of meshes with the laws that they meet: those of part A, then those of part B.
    pub shells: Vec<ShellOfPair>,
    /// Robots 1 and 2 in their places, at the joint level.
    pub cells: Option<[Cell; 2]>,
    /// The robots that a session drives, in their places.
    pub session_robots: Option<[SessionRobot; 2]>,
    /// What these keep out of; none without a rule that needs it.
    pub workspace: Option<Workspace>,
    /// The effects that a run may have; the stages leave out the terms of all others.
    pub effects: EffectSet,
}

/// A solid with its placement as a matrix and its surface, prepared for distances.
#[derive(Clone, Debug)]
pub struct PreparedSolid {
    /// The solid as given.
    pub solid: Solid,
    /// Index among the solids of its part.
    pub index: usize,
    /// Its rotation in the part's frame.
    pub rotation: Mat3<f64>,
    /// Its surface, in its own frame.
    pub surface: Surface,
}

/// A law of contact, the part that has the points, and the solids of the other part whose union they meet.
#[derive(Clone, Debug)]
pub struct ContactPair {
    /// The normal force.
    pub law: NormalLaw,
    /// Its properties; none for those of the run's parameters.
    pub properties: Option<Pair<f64>>,
    /// Radius of the contact patch of its points; 0 = no friction against spinning \[m\].
    pub patch_radius: f64,
    /// The part with the points.
    pub points_of: Side,
    /// Whether its points have a share of the stiffness.
    pub shares: bool,
    /// Whether a solid is a mesh.
    pub has_mesh: bool,
    /// Whether a point may come near the middle of a solid before the depth makes a run invalid.
    pub is_thin: bool,
    /// The solids.
    pub solids: Vec<PreparedSolid>,
    /// Finger of part A that its members of part A belong to, if they are of one.
    pub finger: Option<usize>,
}

/// What a contact point belongs to, by its index in the [`PartShape`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointSource {
    /// A point of the part.
    Point(usize),
    /// A solid of the part.
    Solid(usize),
}

/// A contact point and a law that it meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointOfPair {
    /// The point, in the frame of its part.
    pub point: ContactPoint,
    /// Share of the pair's stiffness and damping.
    pub share: f64,
    /// What it belongs to.
    pub source: PointSource,
    /// Index in [`Plant::pairs`].
    pub pair: usize,
}

/// The contact points of a mesh and a law that they meet.
#[derive(Clone, Debug, PartialEq)]
pub struct ShellOfPair {
    /// The points, in the frame of their part, with their shares of the pair's stiffness and damping.
    pub points: Vec<ShellPoint<f64>>,
    /// Contains the points, in the frame of their part.
    pub ball: Ball,
    /// A distance to the solids may be that much too great \[m\].
    pub slack: f64,
    /// What they belong to.
    pub source: PointSource,
    /// Index in [`Plant::pairs`].
    pub pair: usize,
    /// Place of the first point in the kernels' tables.
    pub offset: usize,
}

impl PartialEq for Plant {
    /// All the rest is made of the model and the effects.
    fn eq(&self, other: &Self) -> bool {
        self.model == other.model && self.effects == other.effects
    }
}

impl Plant {
    /// Prepares a model.
    pub fn new(model: Model) -> Self {
        let started: Vec<_> = model.start_angles.iter().enumerate().map(|(i, a)| model.link_pose(i, *a)).collect();
        let tool_start = started.iter().fold(Pose::identity(), |pose, link| pose.compose(*link)).compose(model.tool);
        let mut words = 0;
        let solids = Side::BOTH.map(|side| {
            let solids = model.contact.part(side).solids.iter().enumerate();
            solids.map(|(index, solid)| PreparedSolid::new(index, solid, &mut words)).collect::<Vec<_>>()
        });
        let (mut pairs, contacts) = contacts(&model, &solids);
        let shells = shells(&model, &solids, &mut pairs, &mut words);
        let pairs = pairs.into_iter().map(|(_, pair)| pair).collect();
        let mut chain = Chain::new(&model.links, &started, model.tool, model.base_inertia);
        chain.links.iter_mut().enumerate().for_each(|(i, link)| link.slides = model.slides(i));
        let target_inverse_inertia = model.target_inertia.inverse();
        let start = start(&model, tool_start);
        let capture_ring = model.ring.map(PreparedRing::new);
        let mut plant = Self {
            model,
            chain,
            tool_start,
            start,
            target_inverse_inertia,
            capture_ring,
            solids,
            pairs,
            contacts,
            shells,
            cells: None,
            session_robots: None,
            workspace: None,
            effects: EffectSet::ALL,
        };
        let placed = |level: &JointLevel| {
            place(&plant, level)
                .unwrap_or_else(|(robot, why)| panic!("robot {robot}: {why:?}, which the loader refuses"))
        };
        let facility = &plant.model.facility;
        let cells = facility.joint_level.as_ref().map(placed);
        let session_robots = facility.session_robots.as_ref().map(|robots| {
            let [cell1, cell2] = placed(&robots.level);
            let robot = |robot: usize, cell| {
                SessionRobot::new(cell, &robots.limits, robots.correction[robot], robots.tool_radius[robot])
            };
            [robot(0, cell1), robot(1, cell2)]
        });
        let workspace =
            session_robots.as_ref().and_then(|robots| Workspace::new(&facility.rules, robots, &plant.start));
        (plant.cells, plant.session_robots, plant.workspace) = (cells, session_robots, workspace);
        plant
    }

    /// The same for runs that have none but these effects: the parameters of the others are ignored.
    ///
    /// At its null value an effect changes no bit, so that a run gives the same in f64 whether its terms are left out
    /// or not.
    #[must_use]
    pub fn with_effects(mut self, effects: EffectSet) -> Self {
        self.effects = effects;
        self.cells.iter_mut().flatten().for_each(|cell| cell.effects = effects);
        self
    }

    /// Robots 1 and 2 in their places; only the joint level has them.
    pub fn robots(&self) -> &[Cell; 2] {
        self.cells.as_ref().expect("only the joint level has robots")
    }

    /// Laws of all that keeps a contact state: of the contact points, then of the shells.
    pub fn touching_pairs(&self) -> impl Iterator<Item = &ContactPair> {
        let of_points = self.contacts.iter().map(|contact| contact.pair);
        of_points.chain(self.shells.iter().map(|shell| shell.pair)).map(|pair| &self.pairs[pair])
    }

    /// Number of contact states of a loop.
    pub fn contact_states(&self) -> usize {
        self.contacts.len() + self.shells.len()
    }

    /// The numbers that the kernels read by computed indices: grids of the meshes, then their shells.
    pub fn tables(&self) -> Vec<f32> {
        let mut out = Vec::new();
        for surface in self.solids.iter().flatten().map(|solid| &solid.surface) {
            if let Surface::Mesh(grid) = surface {
                out.extend_from_slice(&grid.table.values);
            }
        }
        for point in self.shells.iter().flat_map(|shell| &shell.points) {
            let numbers = crate::fields::to_vec::<f64, _>(point);
            let filled = numbers.into_iter().chain(std::iter::repeat(0.0)).take(SHELL_WORDS);
            out.extend(filled.map(|number| number as f32));
        }
        out
    }

    /// Number of arm joints.
    pub fn joints(&self) -> usize {
        self.model.links.len()
    }
}

/// Places both robots at the start of their parts, or returns the number of the one that cannot reach it.
///
/// # Errors
/// The number of the robot and why it cannot reach its start.
pub fn place(m: &Plant, level: &JointLevel) -> Result<[Cell; 2], (usize, Misplaced)> {
    let start = robots_at(m, &m.start);
    let cell = |robot: usize, motion: Motion<f64>| {
        let home = Pose { position: motion.position, attitude: motion.attitude };
        let rail = m.facility.rail.zip(level.carriage.clone()).filter(|_| robot == 0);
        Cell::new(&level.robot, &level.mounts[robot], &level.servo, rail, home, &m.timing)
            .map_err(|why| (robot + 1, why))
    };
    Ok([cell(0, start.robot1.motion)?, cell(1, start.robot2.motion)?])
}

/// The laws that the points meet: for each point the rest of the solids under the common law, then its material pairs.
fn contacts(model: &Model, prepared: &[Vec<PreparedSolid>; 2]) -> (KeyedPairs, Vec<PointOfPair>) {
    let contact = &model.contact;
    let mut pairs: KeyedPairs = Vec::new();
    let mut contacts = Vec::new();
    for side in Side::BOTH {
        let solids = &prepared[side.other() as usize];
        for (source, feature) in part_points(contact.part(side)) {
            let row = |solid: &usize| {
                contact
                    .pairs
                    .iter()
                    .position(|row| row.has(side, source) && row.has(side.other(), PointSource::Solid(*solid)))
            };
            let met: Vec<usize> = (0..solids.len()).filter(|solid| contact.meets(side, source, *solid)).collect();
            let finger = |solid: &usize| contact.finger(side, source, *solid);
            let rows: BTreeSet<_> = met.iter().map(|solid| (row(solid), finger(solid))).collect();
            for number in rows {
                let own: Vec<usize> =
                    met.iter().copied().filter(|solid| (row(solid), finger(solid)) == number).collect();
                let (row, finger) = number;
                let key = PairKey { side, row, finger, solids: own, shares: feature.share != 1.0 };
                let pair = place_of(&mut pairs, key, model, solids);
                contacts.push(PointOfPair { point: feature.point, share: feature.share, source, pair });
            }
        }
    }
    (pairs, contacts)
}

type KeyedPairs = Vec<(PairKey, ContactPair)>;

/// The laws that the shells of the meshes meet, as [`contacts`] has those of the points; new laws join `pairs`.
///
/// Of two meshes with shells both have half the stiffness: each place of contact has points of both.
fn shells(
    model: &Model,
    prepared: &[Vec<PreparedSolid>; 2],
    pairs: &mut KeyedPairs,
    words: &mut usize,
) -> Vec<ShellOfPair> {
    let contact = &model.contact;
    let mut shells = Vec::new();
    for side in Side::BOTH {
        let others = &prepared[side.other() as usize];
        for (index, solid) in contact.part(side).solids.iter().enumerate() {
            let Shape::Mesh(mesh) = &solid.shape else { continue };
            let source = PointSource::Solid(index);
            let has_shell = |other: usize| others[other].solid.shape.has_shell();
            let row = |other: usize| {
                let has =
                    |row: &MaterialPair| row.has(side, source) && row.has(side.other(), PointSource::Solid(other));
                contact.pairs.iter().position(has)
            };
            let met: Vec<usize> = (0..others.len()).filter(|other| contact.meets(side, source, *other)).collect();
            let of = |other: usize| (row(other), contact.finger(side, source, other), has_shell(other));
            let groups: BTreeSet<_> = met.iter().map(|other| of(*other)).collect();
            for group in groups.into_iter().filter(|_| !mesh.shell.is_empty()) {
                let own: Vec<usize> = met.iter().copied().filter(|other| of(*other) == group).collect();
                let key = PairKey { side, row: group.0, finger: group.1, solids: own, shares: true };
                let pair = place_of(pairs, key, model, others);
                let half = if group.2 { 0.5 } else { 1.0 };
                let placed = |place: Vec3<f64>| solid.frame.position + solid.frame.attitude.rotate(place);
                let point = |point: &ShellPoint<f64>| ShellPoint {
                    position: placed(point.position),
                    normal: solid.frame.attitude.rotate(point.normal),
                    share: half * point.share,
                };
                let slack = pairs[pair].1.solids.iter().map(PreparedSolid::slack).fold(0.0, f64::max);
                let points: Vec<_> = mesh.shell.iter().map(point).collect();
                let ball = Ball { centre: placed(mesh.ball.centre), ..mesh.ball };
                shells.push(ShellOfPair { points, ball, slack, source, pair, offset: *words });
                *words += SHELL_WORDS * mesh.shell.len();
            }
        }
    }
    shells
}

/// The index of a law, which joins the others if it is new.
fn place_of(pairs: &mut KeyedPairs, key: PairKey, model: &Model, solids: &[PreparedSolid]) -> usize {
    pairs.iter().position(|(other, _)| *other == key).unwrap_or_else(|| {
        let pair = key.pair(model, solids);
        pairs.push((key, pair));
        pairs.len() - 1
    })
}

/// What makes a [`ContactPair`]: the part with the points, the material pair if any, solids, whether points have shares.
#[derive(Clone, PartialEq)]
struct PairKey {
    side: Side,
    row: Option<usize>,
    finger: Option<usize>,
    solids: Vec<usize>,
    shares: bool,
}

impl PairKey {
    fn pair(&self, model: &Model, prepared: &[PreparedSolid]) -> ContactPair {
        let row = self.row.map(|row| &model.contact.pairs[row]);
        let solids: Vec<_> = self.solids.iter().map(|solid| prepared[*solid].clone()).collect();
        let is_thin = |own: &PreparedSolid| NEAR_MIDDLE * own.solid.shape.half_thickness() < model.task.max_depth;
        ContactPair {
            law: row.map_or(model.contact.law, |row| row.law),
            properties: row.map(|row| row.properties),
            patch_radius: row.map_or(model.contact.patch_radius, |row| row.patch_radius),
            points_of: self.side,
            shares: self.shares,
            has_mesh: solids.iter().any(|own| matches!(own.surface, Surface::Mesh(_))),
            is_thin: solids.iter().any(is_thin),
            solids,
            finger: self.finger,
        }
    }
}

/// Returns the points of a part with what they belong to: its own, then those of its solids.
pub fn part_points(part: &PartShape) -> Vec<(PointSource, Feature)> {
    let own = part.points.iter().enumerate();
    let own = own.map(|(index, point)| (PointSource::Point(index), Feature { point: *point, share: 1.0 }));
    let of_solids = part.solids.iter().enumerate().flat_map(|(index, solid)| {
        features(&solid.shape).into_iter().map(move |feature| {
            let position = solid.frame.position + solid.frame.attitude.rotate(feature.point.position);
            let point = ContactPoint { position, ..feature.point };
            (PointSource::Solid(index), Feature { point, ..feature })
        })
    });
    own.chain(of_solids).collect()
}

impl MaterialPair {
    /// Whether it has something of a part.
    pub fn has(&self, side: Side, source: PointSource) -> bool {
        self.members(side).has(source)
    }
}

impl Members {
    /// Whether it has a point or solid.
    pub fn has(&self, source: PointSource) -> bool {
        match source {
            PointSource::Point(index) => self.points.contains(&index),
            PointSource::Solid(index) => self.solids.contains(&index),
        }
    }
}

impl Contact {
    /// The finger that something of a part and a solid of the other belong to, one of them being of part A.
    fn finger(&self, side: Side, source: PointSource, solid: usize) -> Option<usize> {
        let of_a = match side {
            Side::A => source,
            Side::B => PointSource::Solid(solid),
        };
        self.fingers.iter().position(|finger| finger.members.has(of_a))
    }

    /// Whether a point of a part meets a solid of the other. Of two solids the points of the round one meet the other's
    /// surface, of two round ones those of part A, so that no place of contact counts twice. The shell of a mesh has its
    /// whole surface, too: of other solids only a round one has points that meet it, or another mesh.
    fn meets(&self, side: Side, source: PointSource, solid: usize) -> bool {
        let PointSource::Solid(own) = source else { return true };
        let (own, other) = (&self.part(side).solids[own].shape, &self.part(side.other()).solids[solid].shape);
        match (own.is_round(), other.is_round()) {
            (true, true) => side == Side::A,
            (true, false) => true,
            (false, true) => false,
            (false, false) => own.has_shell() || !other.has_shell(),
        }
    }
}

/// Laboratory motions of the parts at the start, at rest.
fn start(model: &Model, tool_start: Pose<f64>) -> Parts<f64> {
    let at = |place: Pose<f64>| Motion {
        position: place.position,
        attitude: place.attitude,
        velocity: Vec3::zero(),
        omega: Vec3::zero(),
    };
    let a = at(model.base_pose.compose(tool_start));
    let b = at(model.target_pose.compose(model.seat));
    command(model, &Parts { a, b })
}

impl PreparedSolid {
    /// `words` are those of the kernels' tables so far.
    fn new(index: usize, solid: &Solid, words: &mut usize) -> Self {
        let mut surface = Surface::of(&solid.shape);
        if let Surface::Mesh(grid) = &mut surface {
            grid.table.offset = *words;
            *words += grid.table.values.len();
        }
        Self { solid: solid.clone(), index, rotation: solid.frame.attitude.matrix(), surface }
    }

    /// So much too great its distance may be \[m\]: the interpolation across an edge is off by less than a cell's diagonal.
    fn slack(&self) -> f64 {
        match &self.surface {
            Surface::Mesh(grid) => 2.0 * grid.cell,
            _ => 0.0,
        }
    }

    /// A point of the part's frame in the solid's own frame.
    #[inline(always)]
    pub fn to_local<R: crate::real::Real>(&self, point: Vec3<R>) -> Vec3<R> {
        Mat3::<R>::lit(self.rotation).transposed_times(point - Vec3::lit(self.solid.frame.position))
    }

    /// A direction of the solid's frame in the part's frame.
    #[inline(always)]
    pub fn to_part<R: crate::real::Real>(&self, direction: Vec3<R>) -> Vec3<R> {
        Mat3::<R>::lit(self.rotation).times(direction)
    }
}

impl Deref for Plant {
    type Target = Model;
    fn deref(&self) -> &Model {
        &self.model
    }
}
