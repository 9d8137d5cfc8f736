//! Commanded trajectory of an axis, and its response behind a robot's lag.

/// A robot's own lag with unit gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lag {
    /// `1 / (1 + T s)`.
    First {
        /// T \[s\].
        time: f64,
    },
    /// `w^2 (1 + T_z s) / (s^2 + 2 z w s + w^2)`, as in a scenario's robots.
    Second {
        /// 1/w \[s\].
        time: f64,
        /// z.
        damping: f64,
        /// T_z \[s\].
        zero: f64,
    },
}

/// Two states `x' = a x + b u` and the output `c x`.
struct States {
    a: [[f64; 2]; 2],
    b: [f64; 2],
    c: [f64; 2],
}

impl Lag {
    /// Returns the delay at low frequency \[s\]: T, or 2 z / w - T_z.
    pub fn delay(self) -> f64 {
        match self {
            Self::First { time } => time,
            Self::Second { time, damping, zero } => 2.0 * damping * time - zero,
        }
    }

    fn states(self) -> States {
        match self {
            Self::First { time } => {
                States { a: [[-1.0 / time, 0.0], [0.0, -1.0]], b: [1.0 / time, 0.0], c: [1.0, 0.0] }
            }
            Self::Second { time, damping, zero } => {
                let w = 1.0 / time;
                States { a: [[0.0, 1.0], [-w * w, -2.0 * damping * w]], b: [0.0, w * w], c: [1.0, zero] }
            }
        }
    }
}

/// Commanded positions of an axis over time: linear between nodes, at rest before the first one.
pub(super) struct Course {
    time: Vec<f64>,
    place: Vec<f64>,
}

impl Course {
    /// Creates a trajectory from nodes in order of time.
    pub(super) fn new(nodes: impl Iterator<Item = (f64, f64)>) -> Self {
        let (time, place) = nodes.unzip();
        Self { time, place }
    }

    /// Returns the range of the positions.
    pub(super) fn span(&self) -> f64 {
        let bounds = |(low, high): (f64, f64), place: &f64| (low.min(*place), high.max(*place));
        let (low, high) = self.place.iter().fold((f64::INFINITY, f64::NEG_INFINITY), bounds);
        high - low
    }

    /// Returns position and rate behind a lag at every node; exact for linear inputs between nodes.
    pub(super) fn behind(&self, lag: Option<Lag>) -> Output<'_> {
        let Some(lag) = lag else {
            return Output { time: &self.time, place: self.place.clone(), rate: None };
        };
        let States { a, b, c } = lag.states();
        let mut x = [self.place.first().copied().unwrap_or(0.0), 0.0];
        let (mut place, mut rate) = (Vec::with_capacity(self.time.len()), Vec::with_capacity(self.time.len()));
        let (mut last, mut cached) = (None, (f64::INFINITY, [[0.0; 4]; 4]));
        for (time, u) in self.time.iter().zip(&self.place) {
            if let Some((before, was)) = last {
                let step: f64 = time - before;
                // Cycles that differ by rounding only are equal.
                if (step - cached.0).abs() > 1e-9 {
                    cached = (step, transition(a, b, step));
                }
                let (e, slope) = (&cached.1, (u - was) / step);
                x = [0, 1].map(|i: usize| e[i][0] * x[0] + e[i][1] * x[1] + e[i][2] * was + e[i][3] * slope);
            }
            let [d0, d1] = [0, 1].map(|i: usize| a[i][0] * x[0] + a[i][1] * x[1] + b[i] * u);
            place.push(c[0] * x[0] + c[1] * x[1]);
            rate.push(c[0] * d0 + c[1] * d1);
            last = Some((*time, *u));
        }
        Output { time: &self.time, place, rate: Some(rate) }
    }
}

/// Returns the transition of states, input and input slope over a step: the matrix exponential of all four.
fn transition(a: [[f64; 2]; 2], b: [f64; 2], step: f64) -> [[f64; 4]; 4] {
    let rows = [[a[0][0], a[0][1], b[0], 0.0], [a[1][0], a[1][1], b[1], 0.0], [0.0, 0.0, 0.0, 1.0], [0.0; 4]];
    let size = rows.iter().flatten().fold(0.0f64, |most, entry| most.max((entry * step).abs()));
    let halvings = size.max(1.0).log2().ceil() as i32 + 4;
    let scale = step * 0.5f64.powi(halvings);
    let m = rows.map(|row| row.map(|entry| entry * scale));
    let mut sum = std::array::from_fn(|i| std::array::from_fn(|k| if i == k { 1.0 } else { 0.0 }));
    let mut term = sum;
    for order in 1..=8 {
        term = product(&term, &m).map(|row| row.map(|entry| entry / f64::from(order)));
        sum = std::array::from_fn(|i| std::array::from_fn(|k| sum[i][k] + term[i][k]));
    }
    (0..halvings).fold(sum, |power, _| product(&power, &power))
}

fn product(one: &[[f64; 4]; 4], two: &[[f64; 4]; 4]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|k| (0..4).map(|j| one[i][j] * two[j][k]).sum()))
}

/// A trajectory behind a lag.
pub(super) struct Output<'a> {
    time: &'a [f64],
    place: Vec<f64>,
    /// Output within a cycle, where it bends.
    rate: Option<Vec<f64>>,
}

impl Output<'_> {
    /// Returns the positions at times in order, each less a dead time.
    pub(super) fn delayed(&self, times: impl Iterator<Item = f64>, dead_time: f64) -> impl Iterator<Item = f64> {
        let mut after = 0;
        times.map(move |time| {
            let at = time - dead_time;
            while after < self.time.len() && self.time[after] <= at {
                after += 1;
            }
            match after {
                0 => self.place[0],
                _ if after == self.time.len() => self.place[after - 1],
                _ => self.between(after, at),
            }
        })
    }

    /// Returns the position between the nodes before and at `after`: linear, or cubic with the rates at its ends.
    fn between(&self, after: usize, at: f64) -> f64 {
        let (begin, end) = (self.time[after - 1], self.time[after]);
        let (from, to, step) = (self.place[after - 1], self.place[after], end - begin);
        let u = (at - begin) / step;
        let line = u.mul_add(to - from, from);
        let Some(rate) = &self.rate else {
            return line;
        };
        let (v, chord) = (1.0 - u, to - from);
        let bends = [rate[after - 1].mul_add(step, -chord), rate[after].mul_add(step, -chord)];
        line + u * v * (v * bends[0] - u * bends[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares a step of the lag with the closed form of its overdamped response.
    #[test]
    fn lag_matches_its_closed_form() {
        let (time, damping, zero) = (26.73e-3, 2.766, 64.29e-3);
        let w: f64 = 1.0 / time;
        let root = (damping * damping - 1.0f64).sqrt();
        let (p, q) = (w * (damping - root), w * (damping + root));
        // Ramp u = t from rest: y = t - d + A e^(-p t) + B e^(-q t).
        let d = 2.0 * damping / w - zero;
        let slow = p * q * (1.0 - zero * p) / (p * p * (q - p));
        let fast = p * q * (1.0 - zero * q) / (q * q * (p - q));
        for step in [1e-3, 4e-3, 12e-3] {
            let course = Course::new((0..100).map(|k| (f64::from(k) * step, f64::from(k) * step)));
            let out = course.behind(Some(Lag::Second { time, damping, zero }));
            let times = (0..170).map(|k| (f64::from(k) + 0.37) * 0.5 * step);
            for (t, found) in times.clone().zip(out.delayed(times, 0.0)) {
                let expected = t - d + slow * (-p * t).exp() + fast * (-q * t).exp();
                let slack = 1e-6 + (q * step).powi(4) / 384.0 * 2e-3;
                assert!((found - expected).abs() < slack, "{t} s in steps of {step} s: {found}, {expected}");
            }
        }
    }

    #[test]
    fn trajectory_without_lag_is_linear() {
        let course = Course::new([(0.0, 1.0), (1.0, 3.0), (2.0, 2.0)].into_iter());
        let found: Vec<f64> = course.behind(None).delayed([0.0, 0.75, 1.5, 9.0].into_iter(), 0.25).collect();
        assert_eq!(found, [1.0, 2.0, 2.75, 2.0]);
    }
}
