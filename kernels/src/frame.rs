//! The frame: ticks, substeps, contact points, delay lines and random numbers around the stage functions.
//!
//! The WGSL twin is `wgsl/frame.wgsl`, function for function. A [`Tile`] steps as many runs as the scalar has lanes;
//! what a lane computes depends on its own run alone.

mod arms;
pub mod facility;
mod facility_lanes;
pub mod functions;
mod kept;
pub mod lane_state;
pub mod observer;
mod runs;
pub mod single;

use crate::arm_motion::{ArmMotion, no_motion};
use crate::arm_plan::Camera;
use crate::capture_ring::{Ring, has_ring};
use crate::compensator::Compensation;
use crate::contact::{Point, PointState, space_pair};
use crate::delay_line::Line;
use crate::fields::Bundle;
use crate::grip::{Grip, grip_after, no_grip};
use crate::impedance::Admittance;
use crate::lanes::Lane;
use crate::load::Load;
use crate::material::Pair;
use crate::monitor::{self, Touch, Watch};
use crate::outcome::Signals;
use crate::params::Params;
use crate::plant::Plant;
use crate::robot::{LinkCounts, Robots};
use crate::sensor::Sensor;
use crate::session::Session;
use crate::space::{Actuation, Bodies, Kinematics, Masses, Parts, Wrench, settle_in_place, space_masses};
use crate::staged::{
    advance_in_place, command, contact_point, feed_back, finger_power, followed, guide, in_place, kinematics, latch,
    metrics, of_finger, on_ring, point_on_exact, set_where, start, touch_shell, update_kinematics, with_finger,
};
use crate::test_motion::Tracking;
use crate::thrusters::{Firing, no_firing};
use crate::vector::Vec3;
use arms::Arms;
use facility_lanes::TickFacility;
use observer::{ContactObserver, Unobserved};

/// What a batch has in common besides the plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// Philox key of the campaign's seed.
    pub key: [u32; 2],
    /// Whether any run has noise, jitter or drops; if not, no random numbers are made in the loop.
    pub noisy: bool,
    /// Which loops are stepped.
    pub loops: Loops,
}

/// Which loops of a run are stepped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loops {
    /// The ideal twin and the HIL loop.
    Both,
    /// The ideal twin alone; metrics of the facility are invalid.
    SpaceOnly,
}

/// One loop of the pair: bodies, their masses, and the interface between the parts.
#[derive(Clone)]
struct Loop<L: Lane, const N: usize> {
    masses: Masses<L>,
    bodies: Bodies<L, N>,
    /// Of the bodies as they are in the substep under way.
    kinematics: Kinematics<L, N>,
    interface: Interface<L>,
    /// What the arm's plan wants, if it has one.
    motion: ArmMotion<L, N>,
    /// Thrusters of the base, if it has any.
    firing: Firing<L>,
    /// What the arm's own force sensor shows, if it has a plan.
    felt: Wrench<L>,
}

/// The interface between the parts of a loop: properties of its laws, what was observed, states of the contact points.
#[derive(Clone)]
struct Interface<L: Lane> {
    /// Properties of each law of the plant.
    pairs: Vec<Pair<L>>,
    watch: Watch<L>,
    states: Vec<PointState<L>>,
    /// Fingers of part A at the begin of the tick.
    grip: Grip<L>,
    /// The ring that part B rides on, if there is one: in space a body, on the facility hardware on robot 2.
    ring: Ring<L>,
}

/// Several runs stepped together, one per lane.
pub struct Tile<L: Lane, const N: usize> {
    space: Loop<L, N>,
    hil: Loop<L, N>,
    facility: FacilityLanes<L>,
}

/// The part of a tile that does not depend on the arm's number of joints: clock, links, robots, sensor, compensator.
///
/// Kept apart so that it is compiled once per instruction set, not once per number of joints.
struct FacilityLanes<L: Lane> {
    batch: Batch,
    runs: Vec<Option<u64>>,
    params: Params<L>,
    tick: L,
    step: usize,
    slots: usize,
    robots: Robots<L>,
    /// The robots' joints, at the joint level.
    arms: Option<Box<Arms<L>>>,
    sensor: Sensor<L>,
    load: Load<L>,
    held: Wrench<L>,
    compensation: Compensation<L>,
    link: LinkCounts<L>,
    tracking: Tracking<L>,
    admittance: Admittance<L>,
    session: Session<L>,
    commands: Line<L, Parts<L>>,
    wrenches: Line<L, Wrench<L>>,
}

#[inline(always)]
fn still<L: Lane, const N: usize>() -> Actuation<L, N> {
    Actuation { braked: L::lit(0.0), thrust: Vec3::zero(), torque: Vec3::zero(), joint: [L::lit(0.0); N] }
}

#[inline(always)]
fn zero_wrench<L: Lane>() -> Wrench<L> {
    Wrench::zero()
}

/// Whether the arm has a plan to follow.
#[inline(always)]
pub fn has_plan(m: &Plant) -> bool {
    m.guidance.plan.is_some()
}

/// Whether the arm has a camera whose images are noisy.
pub fn has_noisy_camera(m: &Plant) -> bool {
    let camera = m.guidance.plan.as_ref().and_then(|plan| plan.camera.as_ref());
    camera.is_some_and(Camera::is_noisy)
}

/// All contacts of the parts at given motions, fingers open, with the properties of each law; where `live`, they go on by a
/// substep.
#[inline(always)]
pub fn touch_points<L: Lane>(
    m: &Plant,
    pairs: &[Pair<L>],
    parts: &Parts<L>,
    states: &mut [PointState<L>],
    live: L::Mask,
) -> Touch<L> {
    touch_observed(m, pairs, parts, &no_grip(), states, live, &mut Unobserved)
}

/// [`touch_points`] that shows each contact to an observer.
#[inline(always)]
fn touch_observed<L: Lane, O: ContactObserver<L>>(
    m: &Plant,
    pairs: &[Pair<L>],
    parts: &Parts<L>,
    grip: &Grip<L>,
    states: &mut [PointState<L>],
    live: L::Mask,
    observer: &mut O,
) -> Touch<L> {
    let (mut sum, mut index) = (monitor::no_touch(), 0);
    let (of_points, of_shells) = states.split_at_mut(m.contacts.len());
    for (contact, state) in m.contacts.iter().zip(of_points) {
        let (point, share) = (&contact.point, L::lit(contact.share));
        let point = Point { position: Vec3::lit(point.position), radius: L::lit(point.radius), share };
        let of = &m.pairs[contact.pair];
        let pair = &pairs[contact.pair];
        let moved;
        let own = match of.finger {
            None => parts,
            Some(finger) => {
                moved = with_finger(&m.contact.fingers[finger], parts, grip);
                &moved
            }
        };
        let mut c = match of.has_mesh {
            true => contact_point(m, of, pair, own, point, *state),
            false => point_on_exact(m, of, pair, own, point, *state),
        };
        if let Some(finger) = of.finger.map(|finger| &m.contact.fingers[finger]) {
            c = of_finger(finger, parts, grip, &c);
            sum.finger_power = sum.finger_power + finger_power(finger, parts, grip, &c);
        }
        observer.contact(index, state, &c);
        index += 1;
        state.bristle = Vec3::select(live, c.state.bristle, state.bristle);
        if of.law.needs_approach() {
            state.approach = L::select(live, c.state.approach, state.approach);
        }
        in_place::gather(&mut sum, &c);
    }
    for (shell, state) in m.shells.iter().zip(of_shells) {
        let finger = m.pairs[shell.pair].finger.map(|finger| &m.contact.fingers[finger]);
        let moved;
        let own = match finger {
            None => parts,
            Some(finger) => {
                moved = with_finger(finger, parts, grip);
                &moved
            }
        };
        let mut c = touch_shell(m, shell, &pairs[shell.pair], own, state);
        if let Some(finger) = finger {
            c = of_finger(finger, parts, grip, &c);
            sum.finger_power = sum.finger_power + finger_power(finger, parts, grip, &c);
        }
        observer.contact(index, state, &c);
        index += 1;
        state.set_where(live, &c.state);
        in_place::gather(&mut sum, &c);
    }
    sum
}

impl Batch {
    /// Both loops with everything that they may do.
    pub fn whole() -> Self {
        Self { key: [0; 2], noisy: true, loops: Loops::Both }
    }
}

impl<L: Lane, const N: usize> Tile<L, N> {
    /// An empty tile.
    #[inline(never)]
    pub fn new(m: &Plant, batch: Batch) -> Self {
        let mut facility = FacilityLanes::new(m, batch);
        let masses = space_masses(&facility.params);
        let space = Loop {
            masses,
            bodies: start(m, &facility.params, &masses),
            kinematics: crate::fields::filled(L::lit(0.0)),
            interface: Interface::new(m, &facility.params, space_pair),
            motion: no_motion(),
            firing: no_firing(),
            felt: zero_wrench(),
        };
        let parts = kinematics(m, &masses, &space.bodies).parts;
        facility.robots = crate::robot::robots_at(m, &command(m, &parts));
        Self { hil: space.clone(), space, facility }
    }

    /// One tick of both loops: the facility catches up to now, then the simulation goes on from its answer.
    #[inline(always)]
    pub fn step(&mut self, m: &Plant) {
        self.step_observed(m, &mut Unobserved, &mut Unobserved);
    }

    /// [`step`](Self::step) that shows the contacts of every substep to an observer of each loop.
    #[inline(always)]
    pub fn step_observed<O: ContactObserver<L>>(&mut self, m: &Plant, in_space: &mut O, on_facility: &mut O) {
        let now = self.facility.now(m);
        let last = self.facility.is_last(m);
        self.tick_space(m, now, last, in_space);
        self.tick_hil(m, now, last, on_facility);
        self.facility.end_tick();
    }

    /// The ideal twin: contact and space closed directly, every substep.
    #[inline(always)]
    fn tick_space<O: ContactObserver<L>>(&mut self, m: &Plant, now: L, last: L, observer: &mut O) {
        let (s, p) = (&mut self.space, &self.facility.params);
        let live = s.interface.watch.done.le(L::lit(0.0));
        if !any::<L>(live) {
            return;
        }
        let before = if all::<L>(live) { None } else { Some((s.bodies, s.interface.watch, s.interface.ring)) };
        let noise = self.facility.camera_noise(m);
        let mut u = still();
        for substep in 0..m.timing.substeps {
            let (k, bodies) = (&mut s.kinematics, &mut s.bodies);
            let Interface { pairs, watch: seen, states, grip, ring } = &mut s.interface;
            update_kinematics(m, &s.masses, bodies, k);
            if substep == 0 {
                let Bodies { arm, drives, chaser, .. } = &*bodies;
                if has_plan(m) {
                    let captured = seen.closed;
                    in_place::follow(m, p, &mut s.motion, arm, drives, chaser.attitude, k, &s.felt, captured, &noise);
                    *grip = s.motion.grip;
                }
                if m.guidance.thrusters.is_some() {
                    in_place::fire(m, &mut s.firing, chaser.attitude, k, monitor::touched(seen));
                }
                u = guide(
                    m,
                    p,
                    &s.masses,
                    arm,
                    drives,
                    chaser.attitude,
                    k,
                    monitor::touched(seen),
                    &s.motion,
                    &s.firing,
                );
            }
            let elapsed = L::lit(f64::from(substep) * m.timing.substep);
            let (time, now_gripped) = (elapsed + now, grip_after(grip, elapsed));
            let on_it;
            let parts = match has_ring(m) {
                false => &k.parts,
                true => {
                    on_it = on_ring(m, ring, &k.parts);
                    &on_it
                }
            };
            let touch = touch_observed(m, pairs, parts, &now_gripped, states, live, observer);
            observer.substep(m, pairs, time, parts);
            let latch = latch(m, p, parts, seen.closed, now_gripped.share);
            in_place::observe(m, seen, time, parts, &k.parts, &touch, &latch);
            let pushed = monitor::total_wrench(&touch, &latch);
            if has_plan(m) {
                in_place::feel(m, &mut s.felt, k.parts.a, pushed);
            }
            let mut back = pushed;
            if has_ring(m) {
                in_place::push_ring(m, ring, &k.parts, pushed);
                back = ring.back;
            }
            advance_in_place(m, &s.masses, bodies, k, &u, pushed, back);
        }
        settle_in_place(&mut s.bodies);
        if has_ring(m) {
            in_place::settle_ring(m, &mut s.interface.ring);
        }
        if let Some((bodies, watch, ring)) = before {
            if has_ring(m) {
                set_where(!live, &mut s.interface.ring, &ring);
            }
            set_where(!live, &mut s.bodies, &bodies);
            set_where(!live, &mut s.interface.watch, &watch);
        }
        let end = now + L::lit(m.timing.tick());
        in_place::finish(m, &mut s.interface.watch, end, &s.kinematics.parts, last, L::lit(0.0));
    }

    /// The HIL loop: command, robots, contact and sensor up to now; then the simulation under the fed-back wrench.
    #[inline(always)]
    fn tick_hil<O: ContactObserver<L>>(&mut self, m: &Plant, now: L, last: L, observer: &mut O) {
        let live = self.hil.interface.watch.done.le(L::lit(0.0));
        if !any::<L>(live) {
            return;
        }
        update_kinematics(m, &self.hil.masses, &self.hil.bodies, &mut self.hil.kinematics);
        let parts = self.hil.kinematics.parts;
        let interface = &mut self.hil.interface;
        L::stage(TickFacility { facility: &mut self.facility, m, interface, simulated: &parts, now, live, observer });
        // A session that a rule has stopped just now goes no further.
        let live = self.hil.interface.watch.done.le(L::lit(0.0));
        self.tick_simulation(m, live);
        let (s, end) = (&mut self.hil, now + L::lit(m.timing.tick()));
        in_place::finish(m, &mut s.interface.watch, end, &s.kinematics.parts, last, L::lit(1.0));
    }

    /// The simulation computer's tick: guidance, then the bodies under the held wrench.
    #[inline(always)]
    fn tick_simulation(&mut self, m: &Plant, live: L::Mask) {
        let (s, p, held) = (&mut self.hil, &self.facility.params, self.facility.held);
        let before = if all::<L>(live) { None } else { Some(s.bodies) };
        let (k, bodies, mut energy) = (&mut s.kinematics, &mut s.bodies, s.interface.watch.port_energy);
        let touched = monitor::touched(&s.interface.watch);
        let Bodies { arm, drives, chaser, .. } = &*bodies;
        if has_plan(m) {
            let (captured, noise) = (s.interface.watch.closed, self.facility.camera_noise(m));
            in_place::follow(m, p, &mut s.motion, arm, drives, chaser.attitude, k, &s.felt, captured, &noise);
            s.interface.grip = s.motion.grip;
        }
        if m.guidance.thrusters.is_some() {
            in_place::fire(m, &mut s.firing, chaser.attitude, k, touched);
        }
        let u = guide(m, p, &s.masses, arm, drives, chaser.attitude, k, touched, &s.motion, &s.firing);
        for substep in 0..m.timing.substeps {
            if substep > 0 {
                update_kinematics(m, &s.masses, bodies, k);
            }
            let fed = feed_back(k.parts.a, held);
            energy = monitor::port_power(&k.parts, fed).mul_add(L::lit(m.timing.substep), energy);
            if has_plan(m) {
                in_place::feel(m, &mut s.felt, k.parts.a, fed);
            }
            advance_in_place(m, &s.masses, bodies, k, &u, fed, fed);
        }
        settle_in_place(bodies);
        if let Some(before) = before {
            set_where(!live, &mut s.bodies, &before);
        }
        s.interface.watch.port_energy = L::select(live, energy, s.interface.watch.port_energy);
    }

    /// The signals of one lane.
    pub fn signals(&self, m: &Plant, lane: usize) -> Signals {
        let simulated = |s: &Loop<L, N>| kinematics(m, &s.masses, &s.bodies).parts;
        let (space, hil) = (on_ring(m, &self.space.interface.ring, &simulated(&self.space)), simulated(&self.hil));
        let mut states = self.space.interface.states.clone();
        let nobody = L::lit(1.0).lt(L::lit(0.0));
        let grips = [&self.space, &self.hil].map(|side| grip_after(&side.interface.grip, L::lit(m.timing.tick())));
        let pairs = &self.space.interface.pairs;
        let touch = touch_observed(m, pairs, &space, &grips[0], &mut states, nobody, &mut Unobserved);
        let (facility, watch) = (&self.facility, &self.hil.interface.watch);
        let mounted = crate::robot::mounted_parts(m, &facility.params, &facility.robots);
        let mounted = on_ring(m, &self.hil.interface.ring, &mounted);
        let legs = if has_ring(m) { self.hil.interface.ring.work } else { L::lit(0.0) };
        let latched = latch(m, &facility.params, &space, self.space.interface.watch.closed, grips[0].share).wrench;
        let held = latch(m, &facility.params, &mounted, watch.closed, grips[1].share).wrench;
        Signals {
            time: facility.tick.lane(lane) * m.timing.tick(),
            parts: [one(&space, lane), one(&hil, lane)],
            mounted: one(&mounted, lane),
            contact: [one(&touch.wrench, lane), one(&watch.push, lane)],
            latch: [one(&latched, lane), one(&held, lane)],
            measured: one(&facility.sensor.output, lane),
            fed_back: one(&facility.held, lane),
            injected_energy: (watch.port_energy - watch.hardware_energy - legs).lane(lane),
            closed: [self.space.interface.watch.closed.lane(lane), self.hil.interface.watch.closed.lane(lane)],
            phase: [&self.space, &self.hil].map(|side| match has_plan(m) {
                true => side.motion.phase.lane(lane) + 1.0,
                false => 0.0,
            }),
            joints: [&self.space, &self.hil].map(|side| {
                let angle = |joint: usize| side.bodies.arm.angle[joint].lane(lane) + m.start_angles[joint];
                std::array::from_fn(|joint| if joint < N { angle(joint) } else { 0.0 })
            }),
        }
    }
}

/// One lane of a bundle.
fn one<L: Lane, B: Bundle<L>, S: Bundle<f64>>(bundle: &B, lane: usize) -> S {
    let mut values = Vec::new();
    bundle.write(&mut |value: L| values.push(value.lane(lane)));
    crate::fields::from_slice(&values)
}

// Loops, no closures: these would be functions of their own, without the instruction set of the lanes.
#[inline(always)]
fn any<L: Lane>(mask: L::Mask) -> bool {
    let mut any = false;
    for lane in 0..L::WIDTH {
        any |= L::holds(mask, lane);
    }
    any
}

#[inline(always)]
fn all<L: Lane>(mask: L::Mask) -> bool {
    let mut all = true;
    for lane in 0..L::WIDTH {
        all &= L::holds(mask, lane);
    }
    all
}
