//! Classical Runge-Kutta steps that stop at the kinks of a right-hand side and go on behind them.

/// A system of N ordinary differential equations, smooth between the zeros of its E surfaces.
pub(crate) trait System<const N: usize, const E: usize> {
    /// Derivative of the state.
    fn rate(&self, state: &[f64; N]) -> [f64; N];

    /// Functions of the state whose sign changes where the right-hand side has a kink or a jump.
    fn surfaces(&self, state: &[f64; N]) -> [f64; E];
}

/// Events taken one by one in a step; what chatters faster is integrated across.
const EVENTS_PER_STEP: usize = 8;
/// Halvings of a step in search of an event: 2^-26 of 0.1 ms is 1.5 ps.
const HALVINGS: usize = 26;

fn along<const N: usize>(state: &[f64; N], rate: &[f64; N], step: f64) -> [f64; N] {
    std::array::from_fn(|i| state[i] + step * rate[i])
}

/// One classical fourth-order step.
fn runge_kutta<const N: usize, const E: usize>(system: &impl System<N, E>, state: &[f64; N], step: f64) -> [f64; N] {
    let k1 = system.rate(state);
    let k2 = system.rate(&along(state, &k1, 0.5 * step));
    let k3 = system.rate(&along(state, &k2, 0.5 * step));
    let k4 = system.rate(&along(state, &k3, step));
    std::array::from_fn(|i| state[i] + step / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}

fn crossed<const E: usize>(before: &[f64; E], after: &[f64; E]) -> bool {
    before.iter().zip(after).any(|(before, after)| before * after < 0.0)
}

/// The state one step \[s\] later, the step being cut at every event.
pub(crate) fn advance<const N: usize, const E: usize>(
    system: &impl System<N, E>,
    state: &[f64; N],
    step: f64,
) -> [f64; N] {
    let (mut state, mut left) = (*state, step);
    for _ in 0..EVENTS_PER_STEP {
        let end = runge_kutta(system, &state, left);
        let before = system.surfaces(&state);
        if !crossed(&before, &system.surfaces(&end)) {
            return end;
        }
        let (mut low, mut high, mut behind) = (0.0, left, end);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let tried = runge_kutta(system, &state, middle);
            if crossed(&before, &system.surfaces(&tried)) {
                (high, behind) = (middle, tried);
            } else {
                low = middle;
            }
        }
        state = behind;
        left -= high;
    }
    runge_kutta(system, &state, left)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body on a table spring: force -k x while x < 0, nothing above; and a constant pull.
    struct Bouncer;

    impl System<2, 1> for Bouncer {
        fn rate(&self, [x, v]: &[f64; 2]) -> [f64; 2] {
            [*v, if *x < 0.0 { -1e6 * x } else { 0.0 } - 10.0]
        }

        fn surfaces(&self, [x, _]: &[f64; 2]) -> [f64; 1] {
            [*x]
        }
    }

    #[test]
    fn energy_survives_a_hundred_hits() {
        let mut state = [0.01, 0.0];
        let energy = |[x, v]: [f64; 2]| 0.5 * v * v + 10.0 * x + 0.5e6 * x.min(0.0).powi(2);
        let before = energy(state);
        for _ in 0..100_000 {
            state = advance(&Bouncer, &state, 1e-4);
        }
        assert!((energy(state) / before - 1.0).abs() < 1e-4, "{}", energy(state) / before);
    }

    struct Oscillator;

    impl System<2, 0> for Oscillator {
        fn rate(&self, [x, v]: &[f64; 2]) -> [f64; 2] {
            [*v, -x]
        }

        fn surfaces(&self, _: &[f64; 2]) -> [f64; 0] {
            []
        }
    }

    #[test]
    fn the_step_is_of_fourth_order() {
        let error = |step: f64| {
            let steps = (1.0 / step).round() as usize;
            let end = (0..steps).fold([1.0, 0.0], |state, _| advance(&Oscillator, &state, step));
            (end[0] - 1.0_f64.cos()).abs()
        };
        let order = (error(0.1) / error(0.05)).log2();
        assert!((order - 4.0).abs() < 0.3, "{order}");
    }
}
