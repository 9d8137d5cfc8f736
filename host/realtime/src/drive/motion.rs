//! Motions other than the run's own: to the start pose in joint space, and from rest to the run's first motion.

use crate::signals::AXES;
use softdock_campaign::station::AxisLimits;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::extrapolate;
use softdock_kernels::space::{Motion, Parts};

/// Share of the axes' limits that a move to the start uses.
const START_SHARE: f64 = 0.1;
/// Greatest speed, acceleration and jerk of a unit move in unit time along 6 u^5 - 15 u^4 + 10 u^3.
const PEAKS: [f64; 3] = [1.875, 5.773_502_691_896_258, 60.0];

/// A straight move in joint space, from rest to rest.
#[derive(Clone, Copy, Debug)]
pub struct JointMove {
    from: [[f64; AXES]; 2],
    to: [[f64; AXES]; 2],
    duration: f64,
}

impl JointMove {
    /// Plans the move of both robots within a tenth of every limit.
    pub fn new(from: [[f64; AXES]; 2], to: [[f64; AXES]; 2], limits: &[AxisLimits; AXES]) -> Self {
        let needs = |way: f64, limit: &AxisLimits| {
            let bounds = [limit.speed, limit.acceleration, limit.jerk];
            let time = |order: usize| {
                let rate = PEAKS[order] * way / (START_SHARE * bounds[order]);
                rate.powf(1.0 / (order + 1) as f64)
            };
            if way == 0.0 { 0.0 } else { time(0).max(time(1)).max(time(2)) }
        };
        let mut duration = 0.0f64;
        for (robot, from) in from.iter().enumerate() {
            for (i, limit) in limits.iter().enumerate() {
                duration = duration.max(needs((to[robot][i] - from[i]).abs(), limit));
            }
        }
        Self { from, to, duration }
    }

    /// Returns the axes at a time after the begin \[s\].
    pub fn at(&self, time: f64) -> [[f64; AXES]; 2] {
        let u = if self.duration > 0.0 { (time / self.duration).clamp(0.0, 1.0) } else { 1.0 };
        let share = unit_move(u);
        let place = |from: f64, to: f64| if u >= 1.0 { to } else { (to - from).mul_add(share, from) };
        std::array::from_fn(|r| std::array::from_fn(|i| place(self.from[r][i], self.to[r][i])))
    }

    /// Returns the duration \[s\].
    pub fn duration(&self) -> f64 {
        self.duration
    }
}

/// Returns the path share of a move from rest to rest at a time share: 6 u^5 - 15 u^4 + 10 u^3.
pub(super) fn unit_move(time: f64) -> f64 {
    let u = time.clamp(0.0, 1.0);
    u * u * u * (u * (6.0 * u - 15.0) + 10.0)
}

/// Motion from rest to the first motion of a run: along its twist, speed rising as u^2 (3 - 2 u), then at constant
/// speed for the same time, in which the robots' lag settles.
#[derive(Clone, Copy, Debug)]
pub struct RunIn {
    first: Parts<f64>,
    duration: f64,
}

impl RunIn {
    /// Plans a run-in of a duration \[s\] to the first commanded motion.
    pub fn new(first: Parts<f64>, duration: f64) -> Self {
        Self { first, duration }
    }

    /// Returns the motion of the parts at a time after the begin \[s\]; at the end, the first motion of the run.
    pub fn at(&self, m: &Plant, time: f64) -> Parts<f64> {
        let rise = 0.5 * self.duration;
        let u = (time / rise).clamp(0.0, 1.0);
        let coast = (time.min(self.duration) - rise).max(0.0);
        let ahead = rise * (u * u * u * (1.0 - 0.5 * u) - 0.5) + coast - rise;
        let speed = u * u * (3.0 - 2.0 * u);
        let there = extrapolate(m, &self.first, ahead / m.timing.tick());
        let slow =
            |motion: Motion<f64>| Motion { velocity: motion.velocity * speed, omega: motion.omega * speed, ..motion };
        Parts { a: slow(there.a), b: slow(there.b) }
    }

    /// Returns the duration \[s\].
    pub fn duration(&self) -> f64 {
        self.duration
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn move_to_start_reaches_a_tenth_of_one_limit_and_exceeds_none() {
        let limit = AxisLimits { lower: -3.0, upper: 3.0, speed: 1.0, acceleration: 2.0, jerk: 20.0 };
        let (mut to, from) = ([[0.0; AXES]; 2], [[0.0; AXES]; 2]);
        (to[0][3], to[1][6]) = (1.2, -0.3);
        let way = JointMove::new(from, to, &[limit; AXES]);
        let h = way.duration() / 4000.0;
        let at = |k: i32| way.at(f64::from(k) * h)[0][3];
        let mut peaks = [0.0f64; 3];
        for k in 2..3998 {
            let differences = [
                (at(k + 1) - at(k - 1)) / (2.0 * h),
                (at(k + 1) - 2.0 * at(k) + at(k - 1)) / (h * h),
                (at(k + 2) - 2.0 * at(k + 1) + 2.0 * at(k - 1) - at(k - 2)) / (2.0 * h * h * h),
            ];
            peaks.iter_mut().zip(differences).for_each(|(peak, d)| *peak = peak.max(d.abs()));
        }
        let shares = [peaks[0] / limit.speed, peaks[1] / limit.acceleration, peaks[2] / limit.jerk];
        assert!(shares.iter().all(|share| *share < 0.1001), "{shares:?}");
        assert!(shares.iter().any(|share| *share > 0.0995), "{shares:?}");
        assert_eq!(way.at(way.duration()), to);
    }
}
