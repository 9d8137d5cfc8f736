//! Classical Runge-Kutta steps with event location at the kinks of the right-hand side.

/// A system of N ordinary differential equations, smooth between the zeros of its E surfaces.
pub(crate) trait System<const N: usize, const E: usize> {
    /// Derivative of the state.
    fn rate(&self, state: &[f64; N]) -> [f64; N];

    /// Functions of the state whose sign changes where the right-hand side has a kink or a jump.
    fn surfaces(&self, state: &[f64; N]) -> [f64; E];
}

/// Events taken one by one in a step; what chatters faster is integrated across.
const EVENTS_PER_STEP: usize = 8;
/// How closely an event is met, as a share of the step: 1.5 ps of 0.1 ms.
const CLOSE: f64 = 1.5e-8;
/// One in so many trials halves the bracket of an event, whatever the surfaces' slopes promise.
const HALVED: usize = 3;

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
        if !crossed(&system.surfaces(&state), &system.surfaces(&end)) {
            return end;
        }
        let (high, behind) = first_event(system, &state, end, left);
        state = behind;
        left -= high;
    }
    runge_kutta(system, &state, left)
}

/// Returns the end of the shortest step known to contain an event, and the state there. Trial steps follow from secants
/// of the surfaces, alternately slightly behind and before the predicted event, so that both ends of the bracket
/// converge.
fn first_event<const N: usize, const E: usize>(
    system: &impl System<N, E>,
    state: &[f64; N],
    end: [f64; N],
    step: f64,
) -> (f64, [f64; N]) {
    let before = system.surfaces(state);
    let (mut low, mut at_low) = (0.0, before);
    let (mut high, mut at_high, mut behind) = (step, system.surfaces(&end), end);
    let close = CLOSE * step;
    for trial in 1.. {
        if high - low <= close {
            break;
        }
        let beside = if trial % 2 == 0 { -0.4 * close } else { 0.4 * close };
        let share = if trial % HALVED == 0 { 0.5 } else { first_zero(&at_low, &at_high) };
        let tried = (low + share * (high - low) + beside).clamp(low + 0.2 * close, high - 0.2 * close);
        let there = runge_kutta(system, state, tried);
        let surfaces = system.surfaces(&there);
        if crossed(&before, &surfaces) {
            (high, at_high, behind) = (tried, surfaces, there);
        } else {
            (low, at_low) = (tried, surfaces);
        }
    }
    (high, behind)
}

/// Share of a bracket after which the first of the surfaces that change their sign in it would be zero were they straight.
fn first_zero<const E: usize>(low: &[f64; E], high: &[f64; E]) -> f64 {
    let crossing = low.iter().zip(high).filter(|(low, high)| *low * *high < 0.0);
    crossing.map(|(low, high)| low / (low - high)).fold(1.0, f64::min)
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

    #[test]
    fn event_is_located_closely_in_few_trials() {
        let trials = std::cell::Cell::new(0);
        struct Counted<'a>(&'a std::cell::Cell<usize>);
        impl System<2, 2> for Counted<'_> {
            fn rate(&self, [_, v]: &[f64; 2]) -> [f64; 2] {
                self.0.set(self.0.get() + 1);
                [*v, -9.81]
            }
            fn surfaces(&self, [x, v]: &[f64; 2]) -> [f64; 2] {
                [*x, v + 20.0]
            }
        }
        let (drop, step) = (1e-5, 2e-3);
        let end = runge_kutta(&Counted(&trials), &[drop, 0.0], step);
        trials.set(0);
        let (at, _) = first_event(&Counted(&trials), &[drop, 0.0], end, step);
        let fall = f64::sqrt(2.0 * drop / 9.81);
        assert!(at >= fall && at - fall <= CLOSE * step, "{at} and {fall}");
        assert!(trials.get() / 4 <= 14, "{} trials", trials.get() / 4);
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
