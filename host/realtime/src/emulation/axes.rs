//! The axes of an emulated robot: they follow their targets with the commands' dead time and the scenario's tool
//! response.

use crate::arms::Arms;
use crate::signals::{AXES, RAIL};
use softdock_kernels::params::Params;
use softdock_kernels::plant::Plant;
use softdock_kernels::robot::transport;
use softdock_kernels::space::Motion;
use std::collections::VecDeque;

/// Tolerance of joints from their following positions in the commanded configuration \[rad\].
const SAME_POSTURE: f64 = 0.1;
/// Greatest number of Newton iterations.
const STEPS: usize = 8;
/// Remaining distance \[m\] and angle \[rad\] at which the iteration ends.
const CLOSE: f64 = 1e-12;
/// Damping of the iterations near singular postures.
const DAMPING: f64 = 1e-10;

/// w^2 (1 + T_z s) / (s^2 + 2 z w s + w^2), as in the kernels' robots.
#[derive(Clone, Copy, Debug)]
struct Response {
    /// 1/w \[s\]; 0: none.
    lag: f64,
    damping: f64,
    /// T_z \[s\].
    zero: f64,
}

/// Targets, positions and rates of one robot's axes: joints \[rad\], rail \[m\].
#[derive(Clone, Debug)]
pub(super) struct LateAxes {
    response: Response,
    /// Dead time of the commands \[ticks\].
    delay: f64,
    tick: f64,
    substeps: u32,
    /// Targets of the last ticks, newest first.
    targets: VecDeque<[f64; AXES]>,
    position: [f64; AXES],
    rate: [f64; AXES],
}

impl LateAxes {
    /// Creates the axes of robot 0 or 1 of a facility, with the response and the dead time of a draw.
    pub(super) fn new(plant: &Plant, params: &Params<f64>, robot: usize) -> Self {
        let p = params;
        let (lag, damping, zero) = match robot {
            0 => (p.robot1_lag, p.robot1_lag_damping, p.robot1_lag_zero),
            _ => (p.robot2_lag, p.robot2_lag_damping, p.robot2_lag_zero),
        };
        let delay = transport(plant, p, 0.0).clamp(0.0, 10_000.0);
        Self {
            response: Response { lag, damping, zero },
            delay,
            tick: plant.timing.tick(),
            substeps: plant.timing.substeps,
            targets: VecDeque::from(vec![[0.0; AXES]; delay.ceil() as usize + 3]),
            position: [0.0; AXES],
            rate: [0.0; AXES],
        }
    }

    /// Sets all axes to rest at these positions.
    pub(super) fn set_axes(&mut self, position: [f64; AXES]) {
        self.targets.iter_mut().for_each(|target| *target = position);
        (self.position, self.rate) = (position, [0.0; AXES]);
    }

    /// Steps by one tick towards targets.
    pub(super) fn tick(&mut self, target: [f64; AXES]) {
        self.targets.pop_back();
        self.targets.push_front(target);
        let (before, now) = (self.delayed(self.delay + 1.0), self.delayed(self.delay));
        let dt = self.tick / f64::from(self.substeps);
        for axis in 0..AXES {
            let speed = (now[axis] - before[axis]) / self.tick;
            if self.response.lag <= 0.0 {
                (self.position[axis], self.rate[axis]) = (now[axis], speed);
                continue;
            }
            for substep in 1..=self.substeps {
                let share = f64::from(substep) / f64::from(self.substeps);
                let target = before[axis] + share * (now[axis] - before[axis]);
                self.substep(axis, target, speed, dt);
            }
        }
    }

    /// Steps one axis by a substep, semi-implicit.
    fn substep(&mut self, axis: usize, target: f64, speed: f64, dt: f64) {
        let Response { lag, damping, zero } = self.response;
        let w = 1.0 / lag;
        let acceleration = w * w * (target - self.position[axis] + zero * speed) - 2.0 * damping * w * self.rate[axis];
        self.rate[axis] += acceleration * dt;
        self.position[axis] += self.rate[axis] * dt;
    }

    /// Returns the targets this number of ticks ago, linearly interpolated.
    fn delayed(&self, ago: f64) -> [f64; AXES] {
        let last = self.targets.len() - 1;
        let (newer, share) = ((ago as usize).min(last), ago.fract());
        let (one, two) = (&self.targets[newer], &self.targets[(newer + 1).min(last)]);
        std::array::from_fn(|axis| one[axis] + share * (two[axis] - one[axis]))
    }

    /// Returns the axes at a time after the last tick \[s\].
    fn after(&self, since: f64) -> [f64; AXES] {
        std::array::from_fn(|axis| self.rate[axis].mul_add(since, self.position[axis]))
    }

    /// Returns the axes that hold a part at its pose, at a time after the last tick \[s\]: the rail where it has
    /// followed to, the joints in their commanded configuration.
    ///
    /// The kernels model the tool's dynamics and errors, so that a session agrees with the farm; they displace the
    /// joints from the positions that would follow from the targets alone.
    pub(super) fn holding(&self, arms: &Arms, robot: usize, part: &Motion<f64>, since: f64) -> [f64; AXES] {
        let near = self.after(since);
        if let Some(found) = arms.axes_on_rail(robot, part, near[RAIL]) {
            let same = found[..RAIL].iter().zip(&near).all(|(found, near)| (found - near).abs() < SAME_POSTURE);
            if same {
                return found;
            }
        }
        solved(arms, robot, part, near)
    }
}

/// Solves for joints near given ones that hold a part, by Newton's method; the rail stays.
fn solved(arms: &Arms, robot: usize, part: &Motion<f64>, near: [f64; AXES]) -> [f64; AXES] {
    let mut axes = near;
    for _ in 0..STEPS {
        let at = arms.part_on(robot, &axes, &[0.0; AXES]);
        let way = part.position - at.position;
        let turn = part.attitude.compose(at.attitude.conjugate()).small_rotation_vector();
        if way.norm().max(turn.norm()) < CLOSE {
            break;
        }
        let error = [way.x, way.y, way.z, turn.x, turn.y, turn.z];
        let mut jacobian = [[0.0; RAIL]; RAIL];
        for (joint, column) in jacobian.iter_mut().enumerate() {
            let mut rate = [0.0; AXES];
            rate[joint] = 1.0;
            let twist = arms.part_on(robot, &axes, &rate);
            let (v, o) = (twist.velocity, twist.omega);
            *column = [v.x, v.y, v.z, o.x, o.y, o.z];
        }
        let step = damped_step(&jacobian, &error);
        axes.iter_mut().zip(step).for_each(|(axis, step)| *axis += step);
    }
    axes
}

/// Solves (J' J + d)^-1 J' e for the columns of J by Cholesky factors.
fn damped_step(columns: &[[f64; RAIL]; RAIL], error: &[f64; RAIL]) -> [f64; RAIL] {
    let dot = |a: &[f64; RAIL], b: &[f64; RAIL]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut factor = [[0.0; RAIL]; RAIL];
    for i in 0..RAIL {
        for j in 0..=i {
            let damping = if i == j { DAMPING } else { 0.0 };
            let left = dot(&columns[i], &columns[j]) + damping - dot(&factor[i], &factor[j]);
            factor[i][j] = if i == j { left.max(DAMPING).sqrt() } else { left / factor[j][j] };
        }
    }
    let mut step: [f64; RAIL] = std::array::from_fn(|i| dot(&columns[i], error));
    for i in 0..RAIL {
        let known: f64 = (0..i).map(|j| factor[i][j] * step[j]).sum();
        step[i] = (step[i] - known) / factor[i][i];
    }
    for i in (0..RAIL).rev() {
        let known: f64 = (i + 1..RAIL).map(|j| factor[j][i] * step[j]).sum();
        step[i] = (step[i] - known) / factor[i][i];
    }
    step
}
