//! The facility in lanes: clock, links, robots, sensor and compensator of a tile, whatever number of joints the arm has.

use super::{Batch, FacilityLanes, Interface, all, has_noisy_camera, touch_observed, zero_wrench};
use crate::capture_ring::{has_ring, no_ring};
use crate::compensator::{compensates, new_compensation, prediction_horizon};
use crate::delay_line::{Line, line_slots};
use crate::fields::Bundle;
use crate::fields::filled;
use crate::fixture::is_compliant;
use crate::frame::arms::Arms;
use crate::frame::observer::ContactObserver;
use crate::grip::{grip_after, no_grip};
use crate::impedance::no_admittance;
use crate::lanes::{Lane, MOST_LANES, Stage};
use crate::load::{load_at, loaded, sensor_at};
use crate::material::Pair;
use crate::model::CompensatorKind;
use crate::monitor::{self, Watch};
use crate::noise::{CAMERA, LINK, SENSOR, uniforms};
use crate::params::Params;
use crate::plant::ContactPair;
use crate::plant::Plant;
use crate::robot::{commands_poses, mounted_parts, parts_by_axes};
use crate::sensor::Sensor;
use crate::session::{Observed, new_session, supervised};
use crate::space::{Parts, Wrench, hil_masses};
use crate::staged::{
    axes_asked, by_differences, clearance, command, compensate, displaced, extrapolate, feed_back, felt, in_place,
    interpolate, kinematics, latch, normals, on_course, on_ring, range_used, ring_at, set_where, start, substitute,
    with_test,
};
use crate::test_motion::no_tracking;

/// A run that enters a lane: the lane, the run's number, its parameters.
pub(super) type Entering = (usize, u64, Params<f64>);

/// One tick of the facility under the simulation's command, as a function of its own.
pub(super) struct TickFacility<'a, L: Lane, O> {
    pub(super) facility: &'a mut FacilityLanes<L>,
    pub(super) m: &'a Plant,
    pub(super) interface: &'a mut Interface<L>,
    pub(super) simulated: &'a Parts<L>,
    pub(super) now: L,
    pub(super) live: L::Mask,
    pub(super) observer: &'a mut O,
}

impl<L: Lane, O: ContactObserver<L>> Stage for TickFacility<'_, L, O> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { facility, m, interface, simulated, now, live, observer } = self;
        let reference = facility.reference(m, simulated, now);
        let jitter = facility.send_command(m, &reference, live);
        facility.tick_facility(m, interface, simulated, now, jitter, live, observer);
        let measured = facility.arriving_wrench(m, live);
        let live = facility.watch_session(m, &mut interface.watch, &reference, measured, now, live);
        facility.receive_wrench(m, &mut interface.watch, simulated, measured, live);
    }
}

/// [`FacilityLanes::reset`], compiled for the lanes.
pub(super) struct ResetFacility<'a, L: Lane> {
    pub(super) facility: &'a mut FacilityLanes<L>,
    pub(super) m: &'a Plant,
    pub(super) parts: &'a Parts<L>,
    pub(super) fresh: L::Mask,
}

impl<L: Lane> Stage for ResetFacility<'_, L> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.facility.reset(self.m, self.parts, self.fresh);
    }
}

/// Properties of a law in one of the loops.
pub(super) type SidePair<L> = fn(&ContactPair, &Params<L>) -> Pair<L>;

impl<L: Lane> Interface<L> {
    /// Before the first contact.
    pub(super) fn new(m: &Plant, p: &Params<L>, side: SidePair<L>) -> Self {
        let pairs = m.pairs.iter().map(|of| side(of, p)).collect();
        let states = vec![filled(L::lit(0.0)); m.contact_states()];
        Self { pairs, watch: monitor::new_watch(), states, grip: no_grip(), ring: no_ring() }
    }

    /// Starts the runs of the lanes in the mask.
    #[inline(always)]
    pub(super) fn reset(&mut self, m: &Plant, p: &Params<L>, side: SidePair<L>, fresh: L::Mask) {
        let pairs = self.pairs.iter_mut().zip(&m.pairs);
        pairs.for_each(|(pair, of)| pair.set_where(fresh, &side(of, p)));
        self.watch.set_where(fresh, &monitor::new_watch());
        self.states.iter_mut().for_each(|state| state.set_where(fresh, &filled(L::lit(0.0))));
    }
}

/// Motions of the parts at the start of a facility's run.
fn start_parts<const N: usize>(m: &Plant, p: &Params<f64>) -> Parts<f64> {
    let masses = hil_masses(p);
    kinematics(m, &masses, &start::<f64, N>(m, p, &masses)).parts
}

impl<L: Lane> FacilityLanes<L> {
    /// A facility without a run; its robots are not placed.
    #[inline(never)]
    pub(super) fn new(m: &Plant, batch: Batch) -> Self {
        let params = Params::<L>::read(&mut {
            let mut nominal = crate::fields::to_vec(&m.nominal).into_iter();
            move || L::lit(nominal.next().expect("one value per field"))
        });
        let zero = L::lit(0.0);
        Self {
            batch,
            runs: vec![None; L::WIDTH],
            params,
            tick: zero,
            step: 0,
            slots: line_slots(m),
            robots: crate::fields::filled(zero),
            arms: m.cells.as_ref().map(|_| Box::new(Arms::idle())),
            sensor: Sensor { filtered: zero_wrench(), output: zero_wrench(), saturated: zero },
            load: crate::fields::filled(zero),
            held: zero_wrench(),
            compensation: new_compensation(),
            link: crate::fields::filled(zero),
            tracking: no_tracking(),
            admittance: no_admittance(),
            session: new_session(),
            commands: Line::new(line_slots(m)),
            wrenches: Line::new(line_slots(m)),
        }
    }

    /// A facility without the bodies in space, at the start of a run in every lane.
    ///
    /// `entering` has one run per lane.
    pub(super) fn alone(m: &Plant, batch: Batch, entering: &[Entering]) -> (Self, Interface<L>) {
        let mut facility = Self::new(m, batch);
        let fresh = facility.enter(entering);
        let of = |(_, _, p): &Entering| crate::fields::to_vec(&crate::with_joints!(m.joints(), start_parts(m, p)));
        let starts: Vec<Vec<f64>> = entering.iter().map(of).collect();
        let mut field = 0..;
        let parts = Parts::read(&mut || {
            let field = field.next().expect("an endless count");
            L::gather(|lane| starts[lane][field])
        });
        let mut interface = Interface::new(m, &facility.params, crate::contact::hil_pair);
        L::stage(ResetFacility { facility: &mut facility, m, parts: &parts, fresh });
        interface.ring = ring_at(m, &mounted_parts(m, &facility.params, &facility.robots));
        (facility, interface)
    }

    /// Time at which this tick begins \[s\].
    #[inline(always)]
    pub(super) fn now(&self, m: &Plant) -> L {
        self.tick * L::lit(m.timing.tick())
    }

    /// 1 in the last tick of the run.
    #[inline(always)]
    pub(super) fn is_last(&self, m: &Plant) -> L {
        L::select(L::lit(f64::from(m.timing.max_ticks) - 1.0).le(self.tick), L::lit(1.0), L::lit(0.0))
    }

    /// Ends the tick.
    #[inline(always)]
    pub(super) fn end_tick(&mut self) {
        self.tick = self.tick + L::lit(1.0);
        self.step = (self.step + 1) % self.slots;
    }

    /// Takes over the parameters of runs that enter; gives the mask of their lanes.
    #[inline(never)]
    pub(super) fn enter(&mut self, entering: &[Entering]) -> L::Mask {
        let (mut fresh, mut values) = ([0.0; MOST_LANES], [const { Vec::new() }; MOST_LANES]);
        for (lane, run, params) in entering {
            self.runs[*lane] = Some(*run);
            (fresh[*lane], values[*lane]) = (1.0, crate::fields::to_vec(params));
        }
        let mut old = crate::fields::to_vec::<L, _>(&self.params).into_iter().enumerate();
        self.params = Params::read(&mut || {
            let (field, old) = old.next().expect("as many as before");
            L::gather(|lane| values[lane].get(field).copied().unwrap_or_else(|| old.lane(lane)))
        });
        L::lit(0.5).lt(L::gather(|lane| fresh[lane]))
    }

    /// Starts the runs of the lanes in the mask, whose parts have these motions.
    #[inline(always)]
    fn reset(&mut self, m: &Plant, parts: &Parts<L>, fresh: L::Mask) {
        let zero = L::lit(0.0);
        let reference = command(m, parts);
        // The line holds the start, extrapolated backwards; the newest entry is one tick old.
        for age in 1..self.slots {
            let past = extrapolate(m, &reference, L::lit(-(age as f64)));
            self.commands.put((self.step + self.slots - age) % self.slots, &past, fresh);
        }
        self.place_robots(m, &on_course(m, &self.params, &reference), fresh);
        self.begin_readings(m, fresh);
        self.held.set_where(fresh, &zero_wrench());
        self.compensation.set_where(fresh, &new_compensation());
        self.tracking.set_where(fresh, &no_tracking());
        self.admittance.set_where(fresh, &no_admittance());
        self.session.set_where(fresh, &new_session());
        self.tick = L::select(fresh, zero, self.tick);
    }

    /// Sensor, its line and the counts of lost commands as before the first tick, in the lanes of the mask.
    #[inline(always)]
    pub(super) fn begin_readings(&mut self, m: &Plant, fresh: L::Mask) {
        for age in 1..self.slots {
            self.wrenches.put((self.step + self.slots - age) % self.slots, &zero_wrench(), fresh);
        }
        let a = mounted_parts(m, &self.params, &self.robots).a;
        let load = load_at(m, &self.params, a);
        let sensor = sensor_at(m, &load, a);
        self.load.set_where(fresh, &load);
        self.sensor.set_where(fresh, &sensor);
        self.link.set_where(fresh, &crate::fields::filled(L::lit(0.0)));
    }

    /// References of the robots at a time, for a motion of the simulated parts.
    #[inline(always)]
    pub(super) fn reference(&self, m: &Plant, simulated: &Parts<L>, now: L) -> Parts<L> {
        with_test(m, &self.params, &command(m, simulated), now)
    }

    /// Sends the command of this tick, or loses it; gives the jitter of its packet \[s\].
    #[inline(always)]
    pub(super) fn send_command(&mut self, m: &Plant, reference: &Parts<L>, live: L::Mask) -> L {
        let mut sent = *reference;
        if commands_poses(m) {
            let (first, second) = (self.commands.at(self.step, 2), self.commands.at(self.step, 1));
            sent = by_differences(m, &first, &second, &sent);
        }
        self.transmit(m, &sent, live)
    }

    /// A command on its way to the robots.
    #[inline(always)]
    pub(super) fn transmit(&mut self, m: &Plant, sent: &Parts<L>, live: L::Mask) -> L {
        let zero = L::lit(0.0);
        if !self.batch.noisy {
            self.commands.put(self.step, sent, live);
            return zero;
        }
        let draws = self.uniforms(LINK);
        let lost = draws[2].lt(self.params.drop_probability) & zero.lt(self.tick);
        let before = self.commands.at(self.step, 1);
        let mut command = *sent;
        set_where(lost, &mut command, &substitute(m, &before, self.link.lost));
        self.commands.put(self.step, &command, live);
        self.link.lost = L::select(lost, self.link.lost + L::lit(1.0), zero);
        self.link.dropped = L::select(lost & live, L::lit(1.0), self.link.dropped);
        normals(draws[0], draws[1]).first * self.params.delay_jitter
    }

    /// Robots, contact and sensor over the tick that ends now.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "a tick names all that it reads")]
    pub(super) fn tick_facility<O: ContactObserver<L>>(
        &mut self,
        m: &Plant,
        interface: &mut Interface<L>,
        simulated: &Parts<L>,
        now: L,
        jitter: L,
        live: L::Mask,
        observer: &mut O,
    ) {
        let substeps = f64::from(m.timing.substeps);
        let delay =
            (crate::robot::transport(m, &self.params, now) + jitter * L::lit(1.0 / m.timing.tick())).max(L::lit(0.0));
        // The oldest pair of commands of this tick, and how many slots back it is.
        let oldest = (L::lit(1.0 / substeps) - delay).floor().max(L::lit(3.0 - self.slots as f64));
        let [first, second, third] = self.recall_commands(oldest);
        let before = if all::<L>(live) { None } else { Some(self.snapshot(interface)) };
        let begin = (L::lit(1.0 / substeps) - delay) - oldest;
        self.take_command(m, &displaced(m, &interpolate(m, &first, &second, &third, begin), &self.admittance));
        for substep in 1..=m.timing.substeps {
            let share = crate::robot::progress(m, &self.params, L::lit(f64::from(substep) / substeps));
            let place = (share - delay) - oldest;
            self.move_robots(m, &displaced(m, &interpolate(m, &first, &second, &third, place), &self.admittance));
            let mount = crate::robot::mounted_parts(m, &self.params, &self.robots);
            let on_it;
            let parts = match has_ring(m) {
                false => &mount,
                true => {
                    on_it = on_ring(m, &interface.ring, &mount);
                    &on_it
                }
            };
            let time = now - L::lit(f64::from(m.timing.substeps - substep) * m.timing.substep);
            // The fingers go on from the simulation's last tick.
            let grip = grip_after(&interface.grip, L::lit(f64::from(substep) * m.timing.substep));
            let touch = touch_observed(m, &interface.pairs, parts, &grip, &mut interface.states, live, observer);
            observer.substep(m, &interface.pairs, time, parts);
            let latch = latch(m, &self.params, parts, interface.watch.closed, grip.share);
            in_place::observe(m, &mut interface.watch, time, parts, simulated, &touch, &latch);
            let pushed = monitor::total_wrench(&touch, &latch);
            let mut back = pushed;
            if has_ring(m) {
                in_place::push_ring(m, &mut interface.ring, &mount, pushed);
                back = interface.ring.back;
            }
            self.push_robots(pushed);
            if is_compliant(m) {
                in_place::push_fixture(m, &self.params, &mut self.robots, back);
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
                    in_place::without_load(m, &self.params, &self.load, parts.a, &mut self.sensor);
                }
            }
            in_place::step_admittance(m, &mut self.admittance, parts.a, self.sensor.output);
        }
        if has_ring(m) {
            in_place::settle_ring(m, &mut interface.ring);
        }
        if m.facility.test_motion.is_some() {
            let parts = crate::robot::mounted_parts(m, &self.params, &self.robots);
            in_place::track(m, &self.params, &mut self.tracking, &parts, now);
        }
        if let Some(before) = before {
            self.keep(m, live, interface, &before);
        }
    }

    /// Three neighbouring commands per lane, the first `oldest` ticks (0 or negative) before the last tick's.
    #[inline(always)]
    fn recall_commands(&self, oldest: L) -> [Parts<L>; 3] {
        let newest = L::lit(1.0) - oldest;
        let [second, third] = [1.0, 2.0].map(|offset| (newest - L::lit(offset)).max(L::lit(0.0)));
        let line = &self.commands;
        [line.recall(self.step, newest.max(L::lit(0.0))), line.recall(self.step, second), line.recall(self.step, third)]
    }

    /// The sensor's output as it arrives: delayed, between two samples.
    #[inline(always)]
    pub(super) fn arriving_wrench(&mut self, m: &Plant, live: L::Mask) -> Wrench<L> {
        self.wrenches.put(self.step, &self.sensor.output, live);
        let age = crate::sensor::wrench_age(m, &self.params);
        let whole = age.floor();
        let newer = self.wrenches.recall(self.step, whole);
        let older = self.wrenches.recall(self.step, whole + L::lit(1.0));
        crate::sensor::blend(newer, older, age - whole)
    }

    /// Applies the session's rules for one cycle to the reference at its beginning; returns the lanes whose session continues.
    #[inline(always)]
    pub(super) fn watch_session(
        &mut self,
        m: &Plant,
        watch: &mut Watch<L>,
        reference: &Parts<L>,
        measured: Wrench<L>,
        now: L,
        live: L::Mask,
    ) -> L::Mask {
        if !supervised(m) {
            return live;
        }
        let commanded = displaced(m, reference, &self.admittance);
        let asked = axes_asked(m, &commanded);
        let seen = Observed {
            parts: parts_by_axes(m, &self.robots),
            commanded,
            wrench: measured,
            saturated: self.sensor.saturated,
            cut: L::lit(0.0),
            asked,
            range_used: range_used(m, &asked, &commanded),
            clearance: clearance(m, &asked, &commanded),
            port_energy: watch.port_energy,
        };
        let before = if all::<L>(live) { None } else { Some(self.session) };
        in_place::supervise(m, &mut self.session, &seen, L::lit(m.timing.tick()));
        if let Some(before) = before {
            set_where(!live, &mut self.session, &before);
        }
        let stops = live & L::lit(0.0).lt(self.session.rule);
        watch.done = L::select(stops, L::lit(1.0), watch.done);
        watch.end_time = L::select(stops, now, watch.end_time);
        live & !stops
    }

    /// What the compensator makes of the measured wrench that has arrived.
    #[inline(always)]
    pub(super) fn receive_wrench(
        &mut self,
        m: &Plant,
        watch: &mut Watch<L>,
        parts: &Parts<L>,
        measured: Wrench<L>,
        live: L::Mask,
    ) {
        let held = self.compensated_wrench(m, parts, measured, live);
        // Half a substep of the port's energy ends under the old wrench and begins under the new.
        let half = L::lit(0.5 * m.timing.substep);
        let power = |w| monitor::port_power(parts, feed_back(parts.a, w));
        let correction = (power(self.held) - power(held)) * half;
        watch.port_energy = L::select(live, watch.port_energy + correction, watch.port_energy);
        set_where(live, &mut self.held, &held);
    }

    /// What acts on the simulated bodies for a measured wrench.
    #[inline(always)]
    pub(super) fn compensated_wrench(
        &mut self,
        m: &Plant,
        parts: &Parts<L>,
        measured: Wrench<L>,
        live: L::Mask,
    ) -> Wrench<L> {
        if !compensates(m) {
            return measured;
        }
        let mut past = *parts;
        if m.facility.compensator.kind == CompensatorKind::Smith {
            let back = prediction_horizon(m, &self.params);
            let whole = back.floor();
            let newer = self.commands.recall(self.step, whole);
            let older = self.commands.recall(self.step, whole + L::lit(1.0));
            past = interpolate(m, &older, &newer, &newer, (whole - back) + L::lit(1.0));
        }
        let next = compensate(m, &self.params, &self.compensation, parts, &past, measured);
        set_where(live, &mut self.compensation, &next);
        next.output
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
    pub(super) fn sensor_noise(&self) -> Wrench<L> {
        self.deviates(SENSOR)
    }

    /// Six normal deviates for an image of the arm's camera; both loops have the same.
    #[inline(always)]
    pub(super) fn camera_noise(&self, m: &Plant) -> Wrench<L> {
        if has_noisy_camera(m) { self.deviates(CAMERA) } else { zero_wrench() }
    }

    /// Six normal deviates of two channels.
    #[inline(always)]
    pub(super) fn deviates(&self, channels: [u32; 2]) -> Wrench<L> {
        if !self.batch.noisy {
            return zero_wrench();
        }
        let (a, b) = (self.uniforms(channels[0]), self.uniforms(channels[1]));
        let (p, q, r) = (normals(a[0], a[1]), normals(a[2], a[3]), normals(b[0], b[1]));
        Wrench {
            force: crate::vector::vec3(p.first, p.second, q.first),
            moment: crate::vector::vec3(q.second, r.first, r.second),
        }
    }
}
