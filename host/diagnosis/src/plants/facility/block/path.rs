//! Paths of the parts in the laboratory frame, from the log of a drive: commanded and measured.

use crate::data::drive_log::{Cycle, DriveLog};
use crate::inference::white_noise::by_differences;
use nalgebra::DMatrix;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::command;
use softdock_kernels::space::{Motion, Parts};
use softdock_kernels::vector::{Pose, Quat, Vec3};

/// Cycles of the parabola that estimates the initial velocity: the difference of two readings is too noisy, and a
/// longer stretch is no parabola.
const STRETCH: usize = 20;
/// Longest time to either side over which motions are taken for parabolas \[s\].
const LONGEST_REACH: f64 = 8e-3;
/// A parabola strays that misses more than so large a share of the samples by more than so many deviations of their noise.
const RARE: f64 = 1e-3;
const FAR: f64 = 4.0;

/// Returns the commanded motions of the parts in the laboratory frame, tick by tick, preceded by the initial measured
/// poses.
///
/// A command is to be reached by the end of its cycle. It is what the robots received where the log has that, else what
/// the simulation asked for. Links transmit positions only: the rates are three-point backward differences of the path,
/// and two-point at its start, from which the path is extrapolated backwards.
pub(super) fn commanded_rows(plant: &Plant, log: &DriveLog) -> Vec<Parts<f64>> {
    let is_received = log.cycles.iter().all(|cycle| cycle.commanded.is_some());
    let of = |cycle: &Cycle| match cycle.commanded.filter(|_| is_received) {
        Some(received) => in_laboratory(plant, cycle, &received),
        None => shared(plant, cycle),
    };
    let commanded: Vec<Parts<f64>> = log.cycles.iter().map(of).collect();
    let path = by_ticks(&commanded[..commanded.len() - 1], log.ticks);
    let tick = log.cycle / log.ticks as f64;
    let begin = &held(plant, log)[..STRETCH];
    let mut rows = vec![on_parabola(begin, 0, &parabola(0, STRETCH), log.cycle)];
    rows.extend((1..path.len()).map(|i| match i.checked_sub(2) {
        Some(older) => moving(&path[i], &[(&path[i - 1], -4.0), (&path[older], 1.0)], 0.5 / tick),
        None => moving(&path[i], &[(&path[i - 1], -1.0)], 1.0 / tick),
    }));
    rows
}

/// Returns the measured motions of the parts in the laboratory frame, tick by tick, smoothed by parabolas: noise of the
/// axes causes force in a stiff contact, and a lag that suppresses it would be attributed to the sensor.
pub(super) fn measured_rows(plant: &Plant, log: &DriveLog) -> Vec<Parts<f64>> {
    let held = held(plant, log);
    let reach = log.ticks * reach(&held, log.cycle);
    let (path, tick) = (by_ticks(&held, log.ticks), log.cycle / log.ticks as f64);
    let inside = parabola(reach, 2 * reach + 1);
    let row = |i: usize| {
        let (first, last) = (i.saturating_sub(reach), (i + reach).min(path.len() - 1));
        let (at, near) = (i - first, &path[first..=last]);
        match near.len() == inside[0].len() {
            true => on_parabola(near, at, &inside, tick),
            false => on_parabola(near, at, &parabola(at, near.len()), tick),
        }
    };
    (0..path.len()).map(row).collect()
}

/// Returns the half-width in cycles of the parabola that follows poses as closely as their noise permits: a longer one
/// loses motion, a shorter one keeps noise.
fn reach(held: &[Parts<f64>], cycle: f64) -> usize {
    let noisy = coordinates(held).into_iter().map(|series| (noise(&series), series)).filter(|(noise, _)| *noise > 0.0);
    let channels: Vec<(f64, Vec<f64>)> = noisy.collect();
    let longest = (LONGEST_REACH / cycle) as usize;
    let mut reach = 1;
    while 2 * reach <= longest && !channels.iter().any(|(noise, series)| strays(series, *noise, 2 * reach)) {
        reach *= 2;
    }
    reach
}

/// Places \[m\] and turns \[rad\] of both parts from the first of some poses, a series each.
fn coordinates(held: &[Parts<f64>]) -> Vec<Vec<f64>> {
    let from_first = |of: fn(&Parts<f64>) -> Motion<f64>, parts: &Parts<f64>| {
        let (first, own) = (of(&held[0]), of(parts));
        [own.position - first.position, turn(first.attitude, own.attitude)].map(|way| [way.x, way.y, way.z]).concat()
    };
    let rows: Vec<Vec<f64>> =
        held.iter().map(|parts| [from_first(|p| p.a, parts), from_first(|p| p.b, parts)].concat()).collect();
    (0..12).map(|channel| rows.iter().map(|row| row[channel]).collect()).collect()
}

/// Whether parabolas over so many samples to either side of each miss more of a series than its noise explains.
fn strays(series: &[f64], noise: f64, reach: usize) -> bool {
    let [value, _] = parabola(reach, 2 * reach + 1);
    let miss = |near: &[f64]| near.iter().zip(&value).map(|(x, weight)| x * weight).sum::<f64>() - near[reach];
    let misses = series.windows(2 * reach + 1).map(miss).filter(|miss| miss.abs() > FAR * noise).count();
    misses as f64 > RARE * series.len() as f64
}

/// Standard deviation of a series' noise from sample to sample: to its sixth differences motion gives nothing.
fn noise(series: &[f64]) -> f64 {
    by_differences(std::iter::once(series), 6)
}

/// Where the parts were held when each cycle of the run began, laboratory, at rest.
pub(super) fn held(plant: &Plant, log: &DriveLog) -> Vec<Parts<f64>> {
    log.cycles.windows(2).map(|pair| in_laboratory(plant, &pair[0], &pair[1].held)).collect()
}

/// Logged poses of the parts, laboratory, at rest: the log lays the share of the simulated motion that each robot makes
/// back onto the parts.
fn in_laboratory(plant: &Plant, cycle: &Cycle, poses: &[Pose<f64>; 2]) -> Parts<f64> {
    let (simulated, commanded) = (cycle.simulated, shared(plant, cycle));
    let carried = |pose: &Pose<f64>, simulated: &Motion<f64>, commanded: &Motion<f64>| {
        at_rest(pose.position - (simulated.position - commanded.position), pose.attitude)
    };
    Parts { a: carried(&poses[0], &simulated[0], &commanded.a), b: carried(&poses[1], &simulated[1], &commanded.b) }
}

/// Laboratory motions that a simulated pair of parts asks for.
fn shared(plant: &Plant, cycle: &Cycle) -> Parts<f64> {
    let [a, b] = cycle.simulated;
    command(plant, &Parts { a, b })
}

fn at_rest(position: Vec3<f64>, attitude: Quat<f64>) -> Motion<f64> {
    Motion { position, attitude, velocity: Vec3::zero(), omega: Vec3::zero() }
}

/// A path of one pose a cycle as one pose a tick, on straight lines.
fn by_ticks(path: &[Parts<f64>], ticks: usize) -> Vec<Parts<f64>> {
    let between = |from: &Motion<f64>, to: &Motion<f64>, share: f64| {
        let position = from.position + (to.position - from.position) * share;
        at_rest(position, from.attitude.turned(turn(from.attitude, to.attitude) * share))
    };
    let mut out = vec![path[0]];
    for pair in path.windows(2) {
        out.extend((1..=ticks).map(|tick| {
            let share = tick as f64 / ticks as f64;
            Parts { a: between(&pair[0].a, &pair[1].a, share), b: between(&pair[0].b, &pair[1].b, share) }
        }));
    }
    out
}

/// Returns the weights of a parabola through `points` equidistant points for its value and its slope at one of them.
fn parabola(at: usize, points: usize) -> [Vec<f64>; 2] {
    let time = DMatrix::from_fn(points, 3, |i, power| (i as f64 - at as f64).powi(power as i32));
    let inverse = time.pseudo_inverse(1e-12).expect("a tolerance above nothing");
    [0, 1].map(|row| inverse.row(row).iter().copied().collect())
}

/// Where the parts are at one of some poses, a time \[s\] apart, and how they move there, by the weights of a parabola.
fn on_parabola(poses: &[Parts<f64>], at: usize, [value, slope]: &[Vec<f64>; 2], apart: f64) -> Parts<f64> {
    let weighted = |weights: &[f64]| -> Vec<(&Parts<f64>, f64)> { poses.iter().zip(weights.iter().copied()).collect() };
    let moved = moving(&poses[at], &weighted(value), 1.0);
    let moving = moving(&poses[at], &weighted(slope), 1.0 / apart);
    let part = |at: &Motion<f64>, moved: &Motion<f64>, moving: &Motion<f64>| Motion {
        position: at.position + moved.velocity,
        attitude: at.attitude.turned(moved.omega),
        ..*moving
    };
    Parts { a: part(&poses[at].a, &moved.a, &moving.a), b: part(&poses[at].b, &moved.b, &moving.b) }
}

/// Returns the parts at a pose, with the velocity from weighted neighbours on the path.
fn moving(at: &Parts<f64>, neighbours: &[(&Parts<f64>, f64)], scale: f64) -> Parts<f64> {
    let part = |of: fn(&Parts<f64>) -> Motion<f64>| {
        let own = of(at);
        let mut motion = at_rest(own.position, own.attitude);
        for (parts, weight) in neighbours {
            let other = of(parts);
            motion.velocity = motion.velocity + (other.position - own.position) * (weight * scale);
            motion.omega = motion.omega + turn(own.attitude, other.attitude) * (weight * scale);
        }
        motion
    };
    Parts { a: part(|parts| parts.a), b: part(|parts| parts.b) }
}

/// Rotation vector from one attitude to another nearby, inertial axes.
fn turn(from: Quat<f64>, to: Quat<f64>) -> Vec3<f64> {
    let way = to.compose(from.conjugate());
    way.v * (2.0 * way.w.signum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::philox;

    const CYCLE: f64 = 1e-3;
    const NOISE: f64 = 2e-6;

    fn normal(i: usize) -> f64 {
        (0..12).map(|k| philox::uniform(5, "axes", i as u64, k)).sum::<f64>() - 6.0
    }

    /// A part that approaches at 50 mm/s and is pushed back with 0.6 m/s^2 from 0.5 s on, over such a time \[s\]; the other
    /// one stands.
    fn pushed(over: f64, noise: f64) -> Vec<Parts<f64>> {
        let at = |i: usize| {
            let (time, blow) = (i as f64 * CYCLE, (i as f64 * CYCLE - 0.5).max(0.0));
            // Second integral of 0.6 (1 - exp(-t / over)).
            let back = 0.6 * (0.5 * blow * blow - over * blow + over * over * (1.0 - (-blow / over).exp()));
            let place = |x: f64, i: usize| at_rest(Vec3 { x: x + noise * normal(i), y: 0.0, z: 0.0 }, Quat::identity());
            Parts { a: place(0.05 * time - back, 2 * i), b: place(0.0, 2 * i + 1) }
        };
        (0..1000).map(at).collect()
    }

    #[test]
    fn noise_estimate_is_independent_of_motion() {
        let commanded = noise(&coordinates(&pushed(0.014, NOISE))[0]);
        assert!((commanded / NOISE - 1.0).abs() < 0.1, "{commanded}");
        assert!(noise(&coordinates(&pushed(0.014, 0.0))[0]) < 1e-3 * NOISE);
    }

    #[test]
    fn parabola_length_grows_with_noise() {
        let of = |over: f64, noise: f64| reach(&pushed(over, noise), CYCLE);
        assert_eq!(of(0.014, NOISE), 8);
        // What begins within a cycle is missed by more than the noise of fine axes, and by all where there is none.
        assert_eq!([of(1e-3, 0.03 * NOISE), of(1e-3, 0.0)], [4, 1]);
    }
}
