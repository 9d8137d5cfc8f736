//! The frame's functions one by one, by name.

use super::*;
use crate::fields::to_vec;
use crate::noise::SENSOR;

/// A frame function on a tile: gives the scalars that its WGSL twin returns.
pub type FrameFunction<const N: usize> = fn(&mut Tile<f64, N>, &Plant) -> Vec<f64>;

/// The frame's functions by their names in `wgsl/frame.wgsl`.
///
/// What they take besides the state is made from the state: the parts are those that the facility's simulation has,
/// the jitter of a packet is a tenth of a millisecond for every tick beyond a multiple of seven.
pub fn frame_functions<const N: usize>() -> Vec<(&'static str, FrameFunction<N>)> {
    vec![
        ("zero_wrench", |_, _| to_vec(&zero_wrench::<f64>())),
        ("touch_space", |tile, m| {
            let parts = simulated(m, &tile.space).parts;
            let Interface { pairs, states, grip, .. } = &mut tile.space.interface;
            to_vec(&touch_observed(m, pairs, &parts, grip, states, true, &mut Unobserved))
        }),
        ("touch_facility", |tile, m| {
            let mounted = crate::robot::mounted_parts(m, &tile.facility.params, &tile.facility.robots);
            let Interface { pairs, states, grip, .. } = &mut tile.hil.interface;
            to_vec(&touch_observed(m, pairs, &mounted, grip, states, true, &mut Unobserved))
        }),
        ("reset_contacts", |tile, _| {
            let states = tile.space.interface.states.iter_mut().chain(&mut tile.hil.interface.states);
            states.for_each(|state| *state = crate::fields::filled(0.0));
            Vec::new()
        }),
        ("tick_space", |tile, m| {
            let (now, last) = (tile.facility.now(m), tile.facility.is_last(m));
            tile.tick_space(m, now, last, &mut Unobserved);
            Vec::new()
        }),
        ("tick_hil", |tile, m| {
            let (now, last) = (tile.facility.now(m), tile.facility.is_last(m));
            tile.tick_hil(m, now, last, &mut Unobserved);
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
            tile.facility.tick_facility(m, &mut tile.hil.interface, &parts, now, jitter, true, &mut Unobserved);
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
        ("camera_noise", |tile, m| to_vec(&tile.facility.camera_noise(m))),
        ("deviates", |tile, _| to_vec(&tile.facility.deviates(SENSOR))),
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
    let mut out = to_vec(&metrics(m, &space.interface.watch, &space.bodies, &space.interface.ring, &seen, 0.0));
    out.extend(to_vec(&metrics(m, &hil.interface.watch, &hil.bodies, &hil.interface.ring, &seen, 1.0)));
    out.extend(to_vec::<f64, _>(&tile.end_state()));
    out
}

/// Kinematics of a loop's bodies.
fn simulated<const N: usize>(m: &Plant, side: &Loop<f64, N>) -> Kinematics<f64, N> {
    kinematics(m, &side.masses, &side.bodies)
}
