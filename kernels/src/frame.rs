//! The frame: ticks, substeps, contact points, delay lines and random numbers around the stage functions.
//!
//! The WGSL twin is `wgsl/frame.wgsl`, function for function. A [`Tile`] steps as many runs as the scalar has lanes;
//! what a lane computes depends on its own run alone.

mod arms;
pub mod facility;
mod kept;
mod runs;
pub mod single;
pub mod tile_state;

use crate::compensator::{Compensation, look_back, new_compensation};
use crate::contact::{Pair, Point, hil_pair, space_pair};
use crate::delay_line::{Line, line_slots};
use crate::fields::Bundle;
use crate::fixture::gives_way;
use crate::impedance::{Yielding, not_yielding};
use crate::lanes::{Lane, MOST_LANES};
use crate::load::{Load, loaded};
use crate::model::CompensatorKind;
use crate::monitor::{self, Touch, Watch};
use crate::noise::{LINK, SENSOR, uniforms};
use crate::outcome::Signals;
use crate::params::Params;
use crate::plant::Plant;
use crate::robot::Robots;
use crate::sensor::Sensor;
use crate::space::{Actuation, Bodies, Kinematics, Masses, Parts, Wrench, hil_masses, settle_in_place, space_masses};
use crate::staged::{
    advance_in_place, command, compensate, contact_point, displaced, feed_back, felt, followed, guide, in_place,
    interpolate, kinematics, latch, metrics, normals, set_where, start, substitute, update_kinematics, with_test,
};
use crate::test_motion::{Tracking, no_tracking};
use crate::vector::Vec3;
use arms::Arms;

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
    /// The ideal twin alone; what a run then says of the facility means nothing.
    SpaceOnly,
}

/// One loop of the pair: bodies, what they are taken to weigh, what touches, what was seen.
#[derive(Clone)]
struct Loop<L: Lane, const N: usize> {
    masses: Masses<L>,
    pair: Pair<L>,
    bodies: Bodies<L, N>,
    /// Of the bodies as they are in the substep under way.
    kinematics: Kinematics<L, N>,
    watch: Watch<L>,
    bristles: Vec<Vec3<L>>,
}

/// Several runs stepped together, one per lane.
pub struct Tile<L: Lane, const N: usize> {
    batch: Batch,
    runs: Vec<Option<u64>>,
    params: Params<L>,
    tick: L,
    step: usize,
    slots: usize,
    space: Loop<L, N>,
    hil: Loop<L, N>,
    robots: Robots<L>,
    /// The robots' joints, at the joint level.
    arms: Option<Box<Arms<L>>>,
    sensor: Sensor<L>,
    load: Load<L>,
    held: Wrench<L>,
    compensation: Compensation<L>,
    lost: L,
    dropped: L,
    tracking: Tracking<L>,
    yielding: Yielding<L>,
    commands: Line<L, Parts<L>>,
    wrenches: Line<L, Wrench<L>>,
}

#[inline(always)]
fn still<L: Lane, const N: usize>() -> Actuation<L, N> {
    Actuation { thrust: Vec3::zero(), torque: Vec3::zero(), joint: [L::lit(0.0); N] }
}

#[inline(always)]
fn zero_wrench<L: Lane>() -> Wrench<L> {
    Wrench::zero()
}

/// All contact points of a pair of parts, and the bristles they move.
#[inline(always)]
fn touch_points<L: Lane>(
    m: &Plant,
    pair: &Pair<L>,
    parts: &Parts<L>,
    bristles: &mut [Vec3<L>],
    live: L::Mask,
) -> Touch<L> {
    let mut sum = monitor::no_touch();
    for (point, bristle) in m.contact.points.iter().zip(bristles) {
        let point = Point { position: Vec3::lit(point.position), radius: L::lit(point.radius) };
        let c = contact_point(m, pair, parts, point, *bristle);
        *bristle = Vec3::select(live, c.bristle, *bristle);
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
        let params = Params::<L>::read(&mut {
            let mut nominal = crate::fields::to_vec(&m.nominal).into_iter();
            move || L::lit(nominal.next().expect("one value per field"))
        });
        let zero = L::lit(0.0);
        let masses = space_masses(&params);
        let space = Loop {
            masses,
            pair: space_pair(&params),
            bodies: start(m, &params, &masses),
            kinematics: crate::fields::filled(zero),
            watch: monitor::new_watch(),
            bristles: vec![Vec3::zero(); m.contact.points.len()],
        };
        let parts = kinematics(m, &masses, &space.bodies).parts;
        Self {
            batch,
            runs: vec![None; L::WIDTH],
            params,
            tick: zero,
            step: 0,
            slots: line_slots(m),
            hil: space.clone(),
            space,
            robots: crate::robot::robots_at(m, &command(m, &parts)),
            arms: m.cells.as_ref().map(|_| Box::new(Arms::idle())),
            sensor: Sensor { filtered: zero_wrench(), output: zero_wrench(), saturated: zero },
            load: crate::fields::filled(zero),
            held: zero_wrench(),
            compensation: new_compensation(),
            lost: zero,
            dropped: zero,
            tracking: no_tracking(),
            yielding: not_yielding(),
            commands: Line::new(line_slots(m)),
            wrenches: Line::new(line_slots(m)),
        }
    }

    /// One tick of both loops: the facility catches up to now, then the simulation goes on from its answer.
    #[inline(always)]
    pub fn step(&mut self, m: &Plant) {
        let now = self.tick * L::lit(m.timing.tick());
        let last = L::select(L::lit(f64::from(m.timing.max_ticks) - 1.0).le(self.tick), L::lit(1.0), L::lit(0.0));
        self.tick_space(m, now, last);
        self.tick_hil(m, now, last);
        self.tick = self.tick + L::lit(1.0);
        self.step = (self.step + 1) % self.slots;
    }

    /// The ideal twin: contact and space closed directly, every substep.
    #[inline(always)]
    fn tick_space(&mut self, m: &Plant, now: L, last: L) {
        let s = &mut self.space;
        let live = s.watch.done.le(L::lit(0.0));
        if !any::<L>(live) {
            return;
        }
        let before = if all::<L>(live) { None } else { Some((s.bodies, s.watch)) };
        let mut u = still();
        for substep in 0..m.timing.substeps {
            let (k, bodies, seen) = (&mut s.kinematics, &mut s.bodies, &mut s.watch);
            update_kinematics(m, &s.masses, bodies, k);
            if substep == 0 {
                u = guide(m, &self.params, &s.masses, &bodies.arm, bodies.chaser.attitude, k, monitor::touched(seen));
            }
            let time = L::lit(f64::from(substep) * m.timing.substep) + now;
            let touch = touch_points(m, &s.pair, &k.parts, &mut s.bristles, live);
            let latch = latch(m, &self.params, &k.parts, seen.closed);
            in_place::observe(m, seen, time, &k.parts, &k.parts, &touch, &latch);
            advance_in_place(m, &s.masses, bodies, k, &u, monitor::total_wrench(&touch, &latch));
        }
        settle_in_place(&mut s.bodies);
        if let Some((bodies, watch)) = before {
            set_where(!live, &mut s.bodies, &bodies);
            set_where(!live, &mut s.watch, &watch);
        }
        in_place::finish(m, &mut s.watch, now + L::lit(m.timing.tick()), &s.kinematics.parts, last);
    }

    /// The HIL loop: command, robots, contact and sensor up to now; then the simulation under the fed-back wrench.
    #[inline(always)]
    fn tick_hil(&mut self, m: &Plant, now: L, last: L) {
        let live = self.hil.watch.done.le(L::lit(0.0));
        if !any::<L>(live) {
            return;
        }
        update_kinematics(m, &self.hil.masses, &self.hil.bodies, &mut self.hil.kinematics);
        let parts = self.hil.kinematics.parts;
        let jitter = self.send_command(m, &parts, now, live);
        self.tick_facility(m, &parts, now, jitter, live);
        self.receive_wrench(m, &parts, live);
        self.tick_simulation(m, live);
        let s = &mut self.hil;
        in_place::finish(m, &mut s.watch, now + L::lit(m.timing.tick()), &s.kinematics.parts, last);
    }

    /// Sends the command of this tick, or loses it; gives the jitter of its packet \[s\].
    #[inline(always)]
    fn send_command(&mut self, m: &Plant, parts: &Parts<L>, now: L, live: L::Mask) -> L {
        let sent = with_test(m, &self.params, &command(m, parts), now);
        self.transmit(m, &sent, live)
    }

    /// A command on its way to the robots.
    #[inline(always)]
    fn transmit(&mut self, m: &Plant, sent: &Parts<L>, live: L::Mask) -> L {
        let zero = L::lit(0.0);
        if !self.batch.noisy {
            self.commands.put(self.step, sent, live);
            return zero;
        }
        let draws = self.uniforms(LINK);
        let lost = draws[2].lt(self.params.drop_probability) & zero.lt(self.tick);
        let before = self.commands.recall(self.step, |_| 1);
        let mut command = *sent;
        set_where(lost, &mut command, &substitute(m, &before, self.lost));
        self.commands.put(self.step, &command, live);
        self.lost = L::select(lost, self.lost + L::lit(1.0), zero);
        self.dropped = L::select(lost & live, L::lit(1.0), self.dropped);
        normals(draws[0], draws[1]).first * self.params.delay_jitter
    }

    /// Robots, contact and sensor over the tick that ends now.
    #[inline(always)]
    fn tick_facility(&mut self, m: &Plant, simulated: &Parts<L>, now: L, jitter: L, live: L::Mask) {
        let substeps = f64::from(m.timing.substeps);
        let delay =
            (crate::robot::transport(m, &self.params, now) + jitter * L::lit(1.0 / m.timing.tick())).max(L::lit(0.0));
        // The oldest pair of commands of this tick, and how many slots back it is.
        let oldest = (L::lit(1.0 / substeps) - delay).floor().max(L::lit(3.0 - self.slots as f64));
        let [first, second, third] = self.recall_commands(oldest);
        let before = if all::<L>(live) { None } else { Some(self.facility()) };
        let begin = (L::lit(1.0 / substeps) - delay) - oldest;
        self.take_command(m, &displaced(m, &interpolate(m, &first, &second, &third, begin), &self.yielding));
        for substep in 1..=m.timing.substeps {
            let share = crate::robot::progress(m, &self.params, L::lit(f64::from(substep) / substeps));
            let place = (share - delay) - oldest;
            self.move_robots(m, &displaced(m, &interpolate(m, &first, &second, &third, place), &self.yielding));
            let parts = crate::robot::mounted_parts(m, &self.params, &self.robots);
            let time = now - L::lit(f64::from(m.timing.substeps - substep) * m.timing.substep);
            let touch = touch_points(m, &self.hil.pair, &parts, &mut self.hil.bristles, live);
            let latch = latch(m, &self.params, &parts, self.hil.watch.closed);
            in_place::observe(m, &mut self.hil.watch, time, &parts, simulated, &touch, &latch);
            let pushed = monitor::total_wrench(&touch, &latch);
            self.push_robots(pushed);
            if gives_way(m) {
                in_place::push_fixture(m, &self.params, &mut self.robots, pushed);
            }
            let mut wrench = crate::sensor::to_sensor(parts.a, pushed);
            if loaded(m) {
                in_place::carry(m, &mut self.load, parts.a);
                wrench = felt(m, &self.load, parts.a, wrench);
            }
            in_place::low_pass(m, &self.params, &mut self.sensor, wrench);
            if substep % m.facility.sensor_substeps.min(m.timing.substeps) == 0 {
                let noise = self.sensor_noise();
                in_place::sample(m, &self.params, &mut self.sensor, time, noise);
                if loaded(m) {
                    in_place::relieved(m, &self.params, &self.load, parts.a, &mut self.sensor);
                }
            }
            in_place::yield_to(m, &mut self.yielding, parts.a, self.sensor.output);
        }
        if m.facility.test_motion.is_some() {
            let parts = crate::robot::mounted_parts(m, &self.params, &self.robots);
            in_place::track(m, &self.params, &mut self.tracking, &parts, now);
        }
        if let Some(before) = before {
            self.keep_facility(live, &before);
        }
    }

    /// Three neighbouring commands per lane, the first `oldest` ticks (0 or negative) before the last tick's.
    #[inline(always)]
    fn recall_commands(&self, oldest: L) -> [Parts<L>; 3] {
        let at =
            |offset: f64| self.commands.recall(self.step, |lane| (1.0 - oldest.lane(lane) - offset).max(0.0) as usize);
        [at(0.0), at(1.0), at(2.0)]
    }

    /// The sensor's output as it arrives: delayed, between two samples.
    #[inline(always)]
    fn arriving_wrench(&mut self, m: &Plant, live: L::Mask) -> Wrench<L> {
        self.wrenches.put(self.step, &self.sensor.output, live);
        let age = crate::sensor::wrench_age(m, &self.params);
        let whole = age.floor();
        let at = |more: usize| self.wrenches.recall(self.step, |lane| whole.lane(lane) as usize + more);
        crate::sensor::blend(at(0), at(1), age - whole)
    }

    /// The measured wrench as it arrives, and what the compensator makes of it.
    #[inline(always)]
    fn receive_wrench(&mut self, m: &Plant, parts: &Parts<L>, live: L::Mask) {
        let measured = self.arriving_wrench(m, live);
        let held = self.compensated_wrench(m, parts, measured, live);
        // Half a substep of the port's energy ends under the old wrench and begins under the new.
        let half = L::lit(0.5 * m.timing.substep);
        let power = |w| monitor::port_power(parts, feed_back(parts.a, w));
        let correction = (power(self.held) - power(held)) * half;
        self.hil.watch.port_energy =
            L::select(live, self.hil.watch.port_energy + correction, self.hil.watch.port_energy);
        set_where(live, &mut self.held, &held);
    }

    /// What acts on the simulated bodies for a measured wrench.
    #[inline(always)]
    fn compensated_wrench(&mut self, m: &Plant, parts: &Parts<L>, measured: Wrench<L>, live: L::Mask) -> Wrench<L> {
        let kind = m.facility.compensator.kind;
        if kind == CompensatorKind::None {
            return measured;
        }
        let mut past = *parts;
        if kind == CompensatorKind::Smith {
            let back = look_back(m, &self.params);
            let whole = back.floor();
            let at = |more: usize| self.commands.recall(self.step, |lane| whole.lane(lane) as usize + more);
            let newer = at(0);
            past = interpolate(m, &at(1), &newer, &newer, (whole - back) + L::lit(1.0));
        }
        let next = compensate(m, &self.params, &self.compensation, parts, &past, measured);
        set_where(live, &mut self.compensation, &next);
        next.output
    }

    /// The simulation computer's tick: guidance, then the bodies under the held wrench.
    #[inline(always)]
    fn tick_simulation(&mut self, m: &Plant, live: L::Mask) {
        let s = &mut self.hil;
        let before = if all::<L>(live) { None } else { Some(s.bodies) };
        let (k, bodies, mut energy) = (&mut s.kinematics, &mut s.bodies, s.watch.port_energy);
        let touched = monitor::touched(&s.watch);
        let u = guide(m, &self.params, &s.masses, &bodies.arm, bodies.chaser.attitude, k, touched);
        for substep in 0..m.timing.substeps {
            if substep > 0 {
                update_kinematics(m, &s.masses, bodies, k);
            }
            let fed = feed_back(k.parts.a, self.held);
            energy = monitor::port_power(&k.parts, fed).mul_add(L::lit(m.timing.substep), energy);
            advance_in_place(m, &s.masses, bodies, k, &u, fed);
        }
        settle_in_place(bodies);
        if let Some(before) = before {
            set_where(!live, &mut s.bodies, &before);
        }
        s.watch.port_energy = L::select(live, energy, s.watch.port_energy);
    }

    /// Four uniforms of a channel for this tick, per lane.
    #[inline(always)]
    fn uniforms(&self, channel: u32) -> [L; 4] {
        let mut draws = [[0.0; 4]; MOST_LANES];
        for (lane, draw) in draws.iter_mut().enumerate().take(L::WIDTH) {
            let run = self.runs[lane].unwrap_or(0);
            *draw = uniforms(self.batch.key, run, self.tick.lane(lane) as u32, channel);
        }
        let at = |i: usize| L::gather(|lane| draws[lane][i]);
        [at(0), at(1), at(2), at(3)]
    }

    /// Six normal deviates for a sample of the sensor.
    #[inline(always)]
    fn sensor_noise(&self) -> Wrench<L> {
        if !self.batch.noisy {
            return zero_wrench();
        }
        let (a, b) = (self.uniforms(SENSOR[0]), self.uniforms(SENSOR[1]));
        let (p, q, r) = (normals(a[0], a[1]), normals(a[2], a[3]), normals(b[0], b[1]));
        Wrench {
            force: crate::vector::vec3(p.first, p.second, q.first),
            moment: crate::vector::vec3(q.second, r.first, r.second),
        }
    }

    /// The signals of one lane.
    pub fn signals(&self, m: &Plant, lane: usize) -> Signals {
        let simulated = |s: &Loop<L, N>| kinematics(m, &s.masses, &s.bodies).parts;
        let (space, hil) = (simulated(&self.space), simulated(&self.hil));
        let mut bristles = self.space.bristles.clone();
        let nobody = L::lit(1.0).lt(L::lit(0.0));
        let touch = touch_points(m, &self.space.pair, &space, &mut bristles, nobody);
        let latched = latch(m, &self.params, &space, self.space.watch.closed);
        Signals {
            time: self.tick.lane(lane) * m.timing.tick(),
            parts: [one(&space, lane), one(&hil, lane)],
            wrench: [
                one(&monitor::total_wrench(&touch, &latched), lane),
                one(&self.sensor.filtered, lane),
                one(&self.held, lane),
            ],
            closed: [self.space.watch.closed.lane(lane), self.hil.watch.closed.lane(lane)],
        }
    }
}

/// One lane of a bundle.
fn one<L: Lane, B: Bundle<L>, S: Bundle<f64>>(bundle: &B, lane: usize) -> S {
    let mut values = Vec::new();
    bundle.write(&mut |value: L| values.push(value.lane(lane)));
    crate::fields::from_slice(&values)
}

#[inline(always)]
fn any<L: Lane>(mask: L::Mask) -> bool {
    (0..L::WIDTH).any(|lane| L::holds(mask, lane))
}

#[inline(always)]
fn all<L: Lane>(mask: L::Mask) -> bool {
    (0..L::WIDTH).all(|lane| L::holds(mask, lane))
}
