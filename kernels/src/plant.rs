//! A scenario's constants, prepared for the stages: what can be computed once is computed here.

use crate::chain::Chain;
use crate::contact::profile::Surface;
use crate::effects::EffectSet;
use crate::manipulator::cell::{Cell, Misplaced};
use crate::material::{NormalLaw, Pair};
use crate::model::{Contact, JointLevel, Model, Solid};
use crate::robot::{command, robots_at};
use crate::session::{SessionRobot, Workspace};
use crate::space::{Motion, Parts};
use crate::vector::{Mat3, Pose, Quat, Sym3, Vec3, vec3};
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
    /// Solids of part B, their surfaces prepared.
    pub solids: Vec<PreparedSolid>,
    /// Laws of contact, each with the solids that it is for.
    pub pairs: Vec<ContactPair>,
    /// The points of part A with the laws that they meet, in the order of the points.
    pub contacts: Vec<PointOfPair>,
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
    /// Its rotation in part B's frame.
    pub rotation: Mat3<f64>,
    /// Its surface, in its own frame.
    pub surface: Surface,
}

/// A law of contact and the solids of part B that it is for; their union meets a point.
#[derive(Clone, Debug)]
pub struct ContactPair {
    /// The normal force.
    pub law: NormalLaw,
    /// Its properties; none for those of the run's parameters.
    pub properties: Option<Pair<f64>>,
    /// The solids.
    pub solids: Vec<PreparedSolid>,
}

/// A point of part A and a law that it meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointOfPair {
    /// Index in the model's `contact.points`.
    pub point: usize,
    /// Index in [`Plant::pairs`].
    pub pair: usize,
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
        let turn = |angle: f64| Quat { w: (0.5 * angle).cos(), v: vec3(0.0, 0.0, (0.5 * angle).sin()) };
        let link_attitudes: Vec<_> =
            model.links.iter().zip(&model.start_angles).map(|(l, a)| l.origin.attitude.compose(turn(*a))).collect();
        let tool_start = tool_start(&model, &link_attitudes);
        let solids: Vec<_> = model.contact.solids.iter().map(PreparedSolid::new).collect();
        let (pairs, contacts) = contacts(&model.contact, &solids);
        let chain = Chain::new(&model.links, &link_attitudes, model.tool, model.base_inertia);
        let target_inverse_inertia = model.target_inertia.inverse();
        let start = start(&model, tool_start);
        let mut plant = Self {
            model,
            chain,
            tool_start,
            start,
            target_inverse_inertia,
            solids,
            pairs,
            contacts,
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
fn contacts(contact: &Contact, prepared: &[PreparedSolid]) -> (Vec<ContactPair>, Vec<PointOfPair>) {
    let mut keys: Vec<(Option<usize>, Vec<usize>)> = Vec::new();
    let mut contacts = Vec::new();
    for point in 0..contact.points.len() {
        let rows = contact.pairs.iter().enumerate().filter(|(_, row)| row.points.contains(&point));
        let rows: Vec<_> = rows.map(|(number, row)| (Some(number), row.solids.clone())).collect();
        let is_left = |solid: &usize| rows.iter().all(|(_, solids)| !solids.contains(solid));
        let common = (None, (0..prepared.len()).filter(is_left).collect::<Vec<_>>());
        for key in std::iter::once(common).chain(rows).filter(|(_, solids)| !solids.is_empty()) {
            let pair = keys.iter().position(|own| *own == key).unwrap_or(keys.len());
            if pair == keys.len() {
                keys.push(key);
            }
            contacts.push(PointOfPair { point, pair });
        }
    }
    let of = |(row, solids): (Option<usize>, Vec<usize>)| {
        let row = row.map(|row| &contact.pairs[row]);
        ContactPair {
            law: row.map_or(contact.law, |row| row.law),
            properties: row.map(|row| row.properties),
            solids: solids.into_iter().map(|solid| prepared[solid].clone()).collect(),
        }
    };
    (keys.into_iter().map(of).collect(), contacts)
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

/// Forward kinematics of the start posture.
fn tool_start(model: &Model, link_attitudes: &[Quat<f64>]) -> Pose<f64> {
    let base = Pose::identity();
    let last = model.links.iter().zip(link_attitudes).fold(base, |pose, (link, attitude)| {
        pose.compose(Pose { position: link.origin.position, attitude: *attitude })
    });
    last.compose(model.tool)
}

impl PreparedSolid {
    fn new(solid: &Solid) -> Self {
        Self { solid: *solid, rotation: solid.frame.attitude.matrix(), surface: Surface::of(&solid.shape) }
    }

    /// A point of part B's frame in the solid's own frame.
    #[inline(always)]
    pub fn to_local<R: crate::real::Real>(&self, point: Vec3<R>) -> Vec3<R> {
        Mat3::<R>::lit(self.rotation).transposed_times(point - Vec3::lit(self.solid.frame.position))
    }

    /// A direction of the solid's frame in part B's frame.
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
