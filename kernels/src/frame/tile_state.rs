//! A tile of one run as the flat numbers that the GPU keeps of a lane; and the frame's functions one by one, by name.

use super::*;
use crate::fields::{Field, fields, from_slice, join, to_vec};
use crate::lane_layout::{bristle_names, compensates, moves};
use crate::manipulator::cell::{Drives, SetPoint};
use crate::session::supervised;

/// One run between two ticks, as the GPU's buffers hold a lane.
#[derive(Clone, Debug, PartialEq)]
pub struct LaneState {
    /// Bodies, watches, robots, sensor, held wrench, link, tracking, admittance, load, compensation, the joint level's and bristles,
    /// in the order of [`state_fields`].
    pub state: Vec<f64>,
    /// Commands slot by slot, then wrenches slot by slot.
    pub lines: Vec<f64>,
}

impl LaneState {
    /// The bristles of the facility's loop, or of the one in space, with so many contact points: three numbers each.
    pub fn bristles(&self, facility: bool, points: usize) -> &[f64] {
        let from = self.state.len() - 3 * points * if facility { 1 } else { 2 };
        &self.state[from..][..3 * points]
    }
}

/// A frame function on a tile: gives the scalars that its WGSL twin returns.
pub type FrameFunction<const N: usize> = fn(&mut Tile<f64, N>, &Plant) -> Vec<f64>;

/// The rows of a lane's state, in the order of the kernel's state buffer.
pub fn state_fields<const N: usize>(m: &Plant) -> Vec<Field> {
    all_fields::<N>(m).into_iter().filter_map(|(kept, field)| kept.then_some(field)).collect()
}

/// Every row that a lane may have, and whether it is kept ([`moves`]).
fn all_fields<const N: usize>(m: &Plant) -> Vec<(bool, Field)> {
    let mut variables = vec![
        ("space", fields::<f64, Bodies<f64, N>>()),
        ("space_watch", fields::<f64, Watch<f64>>()),
        ("hil", fields::<f64, Bodies<f64, N>>()),
        ("hil_watch", fields::<f64, Watch<f64>>()),
        ("robot", fields::<f64, Robots<f64>>()),
        ("sensed", fields::<f64, Sensor<f64>>()),
        ("held", fields::<f64, Wrench<f64>>()),
        ("link", fields::<f64, Vec3<f64>>()),
        ("tracking", fields::<f64, Tracking<f64>>()),
        ("admittance", fields::<f64, Admittance<f64>>()),
    ];
    if loaded(m) {
        variables.push(("load", fields::<f64, Load<f64>>()));
    }
    if supervised(m) {
        variables.push(("session", fields::<f64, Session<f64>>()));
    }
    if compensates(m) {
        variables.push(("compensation", fields::<f64, Compensation<f64>>()));
    }
    if m.cells.is_some() {
        variables.extend([
            ("drives_a", fields::<f64, Drives<f64>>()),
            ("drives_b", fields::<f64, Drives<f64>>()),
            ("set_a", fields::<f64, SetPoint<f64>>()),
            ("set_b", fields::<f64, SetPoint<f64>>()),
            ("push", fields::<f64, Wrench<f64>>()),
        ]);
    }
    let named = |(variable, fields): (String, Vec<Field>)| {
        fields.into_iter().map(move |field| {
            let kept = moves(m, &field.name);
            (kept, Field { name: join(&variable, &field.name), ..field })
        })
    };
    let variables = variables.into_iter().map(|(variable, fields)| (variable.to_owned(), fields));
    let bristles = bristle_names(m.contact.points.len()).into_iter().map(|name| (name, fields::<f64, Vec3<f64>>()));
    variables.chain(bristles).flat_map(named).collect()
}

/// The first `fields` numbers of a list as a bundle; the list goes on behind them.
fn take<B: Bundle<f64>>(values: &mut &[f64]) -> B {
    let (own, rest) = values.split_at(fields::<f64, B>().len());
    *values = rest;
    from_slice(own)
}

impl<const N: usize> Tile<f64, N> {
    /// A tile in the middle of a run.
    pub fn resume(m: &Plant, batch: Batch, run: u64, tick: u32, params: Params<f64>, lane: &LaneState) -> Self {
        let mut tile = Self::new(m, batch);
        tile.facility.runs[0] = Some(run);
        (tile.facility.params, tile.facility.tick, tile.facility.step) =
            (params, f64::from(tick), tick as usize % tile.facility.slots);
        let mut kept = lane.state.iter();
        let mut whole = Vec::with_capacity(lane.state.len());
        // What is not kept is at rest.
        let at_rest = |is_kept: bool| if is_kept { kept.next().copied() } else { Some(0.0) };
        whole.extend(all_fields::<N>(m).into_iter().map(|(is_kept, _)| is_kept).map_while(at_rest));
        let mut state = &whole[..];
        let sides = [(space_masses(&params), space_pair(&params)), (hil_masses(&params), hil_pair(&params))];
        for (index, (masses, pair)) in sides.into_iter().enumerate() {
            let bristles = lane.bristles(index == 1, m.contact.points.len()).chunks(3).map(from_slice).collect();
            let (bodies, watch) = (take(&mut state), take(&mut state));
            let kinematics = kinematics(m, &masses, &bodies);
            *[&mut tile.space, &mut tile.hil][index] =
                Loop { masses, bodies, kinematics, interface: Interface { pair, watch, bristles } };
        }
        (tile.facility.robots, tile.facility.sensor, tile.facility.held) =
            (take(&mut state), take(&mut state), take(&mut state));
        let link: Vec3<f64> = take(&mut state);
        [tile.facility.lost, tile.facility.dropped] = [link.x, link.y];
        tile.facility.tracking = take(&mut state);
        tile.facility.admittance = take(&mut state);
        if loaded(m) {
            tile.facility.load = take(&mut state);
        }
        if supervised(m) {
            tile.facility.session = take(&mut state);
        }
        if compensates(m) {
            tile.facility.compensation = take(&mut state);
        }
        if let Some(arms) = &mut tile.facility.arms {
            arms.drives = [take(&mut state), take(&mut state)];
            arms.set = [take(&mut state), take(&mut state)];
            arms.push = take(&mut state);
        }
        let (commands, wrenches) = lane.lines.split_at(tile.facility.slots * fields::<f64, Parts<f64>>().len());
        for (slot, values) in commands.chunks(commands.len() / tile.facility.slots).enumerate() {
            tile.facility.commands.put(slot, &from_slice(values), true);
        }
        for (slot, values) in wrenches.chunks(wrenches.len() / tile.facility.slots).enumerate() {
            tile.facility.wrenches.put(slot, &from_slice(values), true);
        }
        tile
    }

    /// What [`resume`](Self::resume) needs to go on from here, besides run, tick and parameters.
    pub fn lane_state(&self, m: &Plant) -> LaneState {
        let mut state = Vec::new();
        for side in [&self.space, &self.hil] {
            state.extend(to_vec::<f64, _>(&side.bodies));
            state.extend(to_vec::<f64, _>(&side.interface.watch));
        }
        state.extend(to_vec::<f64, _>(&self.facility.robots));
        state.extend(to_vec::<f64, _>(&self.facility.sensor));
        state.extend(to_vec::<f64, _>(&self.facility.held));
        state.extend([self.facility.lost, self.facility.dropped, 0.0]);
        state.extend(to_vec::<f64, _>(&self.facility.tracking));
        state.extend(to_vec::<f64, _>(&self.facility.admittance));
        if loaded(m) {
            state.extend(to_vec::<f64, _>(&self.facility.load));
        }
        if supervised(m) {
            state.extend(to_vec::<f64, _>(&self.facility.session));
        }
        if compensates(m) {
            state.extend(to_vec::<f64, _>(&self.facility.compensation));
        }
        if let Some(arms) = &self.facility.arms {
            state.extend(arms.drives.iter().flat_map(to_vec::<f64, _>));
            state.extend(arms.set.iter().flat_map(to_vec::<f64, _>));
            state.extend(to_vec::<f64, _>(&arms.push));
        }
        let commands = (0..self.facility.slots).flat_map(|slot| to_vec(&self.facility.commands.at(slot, 0)));
        let wrenches = (0..self.facility.slots).flat_map(|slot| to_vec(&self.facility.wrenches.at(slot, 0)));
        state.extend(
            self.space.interface.bristles.iter().chain(&self.hil.interface.bristles).flat_map(to_vec::<f64, _>),
        );
        let kept = all_fields::<N>(m).into_iter().zip(state).filter_map(|((kept, _), value)| kept.then_some(value));
        LaneState { state: kept.collect(), lines: commands.chain(wrenches).collect() }
    }
}

/// The frame's functions by their names in `wgsl/frame.wgsl`.
///
/// What they take besides the state is made from the state: the parts are those that the facility's simulation has,
/// the jitter of a packet is a tenth of a millisecond for every tick beyond a multiple of seven.
pub fn frame_functions<const N: usize>() -> Vec<(&'static str, FrameFunction<N>)> {
    vec![
        ("zero_wrench", |_, _| to_vec(&zero_wrench::<f64>())),
        ("touch_space", |tile, m| {
            let (parts, pair) = (simulated(m, &tile.space).parts, tile.space.interface.pair);
            to_vec(&touch_points(m, &pair, &parts, &mut tile.space.interface.bristles, true))
        }),
        ("touch_facility", |tile, m| {
            let (mounted, pair) =
                (crate::robot::mounted_parts(m, &tile.facility.params, &tile.facility.robots), tile.hil.interface.pair);
            to_vec(&touch_points(m, &pair, &mounted, &mut tile.hil.interface.bristles, true))
        }),
        ("reset_bristles", |tile, _| {
            let bristles = tile.space.interface.bristles.iter_mut().chain(&mut tile.hil.interface.bristles);
            bristles.for_each(|bristle| *bristle = Vec3::zero());
            Vec::new()
        }),
        ("tick_space", |tile, m| {
            let (now, last) = (tile.facility.now(m), tile.facility.is_last(m));
            tile.tick_space(m, now, last);
            Vec::new()
        }),
        ("tick_hil", |tile, m| {
            let (now, last) = (tile.facility.now(m), tile.facility.is_last(m));
            tile.tick_hil(m, now, last);
            Vec::new()
        }),
        ("take_command", |tile, m| {
            let reference = command(m, &simulated(m, &tile.hil).parts);
            tile.facility.take_command(m, &reference);
            Vec::new()
        }),
        ("move_robots", |tile, m| {
            let reference = command(m, &simulated(m, &tile.hil).parts);
            tile.facility.move_robots(m, &reference);
            Vec::new()
        }),
        ("push_robots", |tile, _| {
            tile.facility.push_robots(tile.facility.held);
            Vec::new()
        }),
        ("place_robots", |tile, m| {
            let reference = command(m, &simulated(m, &tile.hil).parts);
            tile.facility.place_robots(m, &reference, true);
            Vec::new()
        }),
        ("send_command", |tile, m| {
            let (parts, now) = (simulated(m, &tile.hil).parts, tile.facility.now(m));
            let reference = tile.facility.reference(m, &parts, now);
            vec![tile.facility.send_command(m, &reference, true)]
        }),
        ("tick_facility", |tile, m| {
            let parts = simulated(m, &tile.hil).parts;
            tile.facility.commands.put(tile.facility.step, &command(m, &parts), true);
            let jitter = tile.facility.tick % 7.0 * 1e-4;
            let now = tile.facility.now(m);
            tile.facility.tick_facility(m, &mut tile.hil.interface, &parts, now, jitter, true);
            Vec::new()
        }),
        ("receive_wrench", |tile, m| {
            let parts = simulated(m, &tile.hil).parts;
            let measured = tile.facility.arriving_wrench(m, true);
            tile.facility.receive_wrench(m, &mut tile.hil.interface.watch, &parts, measured, true);
            Vec::new()
        }),
        ("arriving_wrench", |tile, m| to_vec(&tile.facility.arriving_wrench(m, true))),
        ("watch_session", |tile, m| {
            let (parts, measured, now) = (simulated(m, &tile.hil).parts, tile.facility.held, tile.facility.now(m));
            let reference = tile.facility.reference(m, &parts, now);
            tile.facility.watch_session(m, &mut tile.hil.interface.watch, &reference, measured, now, true);
            Vec::new()
        }),
        ("compensated_wrench", |tile, m| {
            let (parts, held) = (simulated(m, &tile.hil).parts, tile.facility.held);
            to_vec(&tile.facility.compensated_wrench(m, &parts, held, true))
        }),
        ("tick_simulation", |tile, m| {
            tile.hil.kinematics = simulated(m, &tile.hil);
            tile.tick_simulation(m, true);
            Vec::new()
        }),
        ("sensor_noise", |tile, _| to_vec(&tile.facility.sensor_noise())),
        ("reset", from_the_start),
        ("enter", |_, _| vec![1.0]),
        ("begin", from_the_start),
        ("slice", |tile, m| {
            tile.step(m);
            Vec::new()
        }),
        ("end", outcome),
    ]
}

/// Puts the run at its start.
fn from_the_start<const N: usize>(tile: &mut Tile<f64, N>, m: &Plant) -> Vec<f64> {
    tile.facility.step = 0;
    tile.reset(m, true);
    Vec::new()
}

/// Numbers of a finished run, in the order of the kernel's outcome buffer.
fn outcome<const N: usize>(tile: &mut Tile<f64, N>, m: &Plant) -> Vec<f64> {
    let (space, hil) = (&tile.space, &tile.hil);
    let seen = followed(m, &tile.facility.params, &tile.facility.tracking);
    let mut out = to_vec(&metrics(m, &space.interface.watch, &space.bodies, &seen, 0.0));
    out.extend(to_vec(&metrics(m, &hil.interface.watch, &hil.bodies, &seen, 1.0)));
    out.extend([
        space.interface.watch.unstable,
        space.interface.watch.contact_work,
        space.interface.watch.absorbed,
        hil.interface.watch.unstable,
        hil.interface.watch.end_speed,
    ]);
    out.extend([tile.facility.session.rule, tile.facility.session.value]);
    out.extend([tile.facility.sensor.saturated, tile.facility.robots.limited, tile.facility.dropped]);
    out.extend(to_vec::<f64, _>(&space.interface.watch.normal));
    out.extend(to_vec::<f64, _>(&space.interface.watch.lever));
    out
}

/// Kinematics of a loop's bodies.
fn simulated<const N: usize>(m: &Plant, side: &Loop<f64, N>) -> Kinematics<f64, N> {
    kinematics(m, &side.masses, &side.bodies)
}
