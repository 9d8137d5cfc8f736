//! Limits commands: position, speed, acceleration and jerk of every axis, cycle by cycle.
//!
//! A request passes only if the axis could still stop from there, within its jerk and acceleration, before its range
//! ends. Otherwise the axis makes one step of that stop, which the previous cycle has ensured to be feasible. No
//! command exceeds the limits, whatever the request; nor do differences of sent positions.

use crate::signals::AXES;
use softdock_campaign::station::AxisLimits;

/// Relative tolerance for rounding.
const SLACK: f64 = 1e-9;
/// Greatest number of cycles of a stop.
const LONGEST_STOP: usize = 20_000;

/// Limits that clamped a request, one bit per axis in each word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cut {
    /// Position: beyond the range, or the axis could not have stopped before its end.
    pub position: u8,
    /// Speed.
    pub speed: u8,
    /// Acceleration.
    pub acceleration: u8,
    /// Jerk.
    pub jerk: u8,
    /// Not a number.
    pub not_finite: u8,
}

impl Cut {
    /// Whether any limit clamped the request.
    pub fn any(&self) -> bool {
        *self != Self::default()
    }
}

/// State of one axis as sent: position and its last differences \[1/s, 1/s^2\].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sent {
    position: f64,
    speed: f64,
    acceleration: f64,
}

impl Sent {
    /// Returns the state after one more cycle with an acceleration.
    fn after(self, acceleration: f64, cycle: f64) -> Self {
        let speed = acceleration.mul_add(cycle, self.speed);
        Self { position: speed.mul_add(cycle, self.position), speed, acceleration }
    }

    fn at_rest(&self) -> bool {
        self.speed == 0.0 && self.acceleration == 0.0
    }
}

/// Limits the commands of one robot.
#[derive(Clone, Debug)]
pub struct Limiter {
    limits: [AxisLimits; AXES],
    cycle: f64,
    sent: [Sent; AXES],
}

impl Limiter {
    /// Creates a limiter at rest at these axes; `cycle` \[s\]. An axis outside its range may only move back.
    pub fn new(limits: [AxisLimits; AXES], cycle: f64, position: [f64; AXES]) -> Self {
        let sent = position.map(|position| Sent { position, speed: 0.0, acceleration: 0.0 });
        let limits = std::array::from_fn(|i| {
            let (lower, upper) = (limits[i].lower.min(position[i]), limits[i].upper.max(position[i]));
            AxisLimits { lower, upper, ..limits[i] }
        });
        Self { limits, cycle, sent }
    }

    /// Returns the last sent positions.
    pub fn position(&self) -> [f64; AXES] {
        self.sent.map(|sent| sent.position)
    }

    /// Resets to rest at the last sent positions: the robot has held that set-point.
    pub fn rest(&mut self) {
        self.sent = self.sent.map(|sent| Sent { speed: 0.0, acceleration: 0.0, ..sent });
    }

    /// Whether the last commands are at rest.
    pub fn at_rest(&self) -> bool {
        self.sent.iter().all(Sent::at_rest)
    }

    /// Returns the next command towards a request, and the limits that clamped it.
    pub fn approach(&mut self, request: &[f64; AXES]) -> ([f64; AXES], Cut) {
        let mut cut = Cut::default();
        for (i, request) in request.iter().enumerate() {
            let (next, met) = toward(&self.limits[i], self.cycle, self.sent[i], *request);
            self.sent[i] = next;
            let bit = 1 << i;
            let marks = [&mut cut.position, &mut cut.speed, &mut cut.acceleration, &mut cut.jerk, &mut cut.not_finite];
            marks.into_iter().zip(met).filter(|(_, met)| *met).for_each(|(mark, _)| *mark |= bit);
        }
        (self.position(), cut)
    }

    /// Returns the next command of a controlled stop: every axis ramps to rest within its own limits.
    pub fn stop(&mut self) -> [f64; AXES] {
        for (sent, limits) in self.sent.iter_mut().zip(&self.limits) {
            *sent = sent.after(braking(limits, self.cycle, *sent), self.cycle);
            settle(sent, limits, self.cycle);
        }
        self.position()
    }
}

/// Clamped limits: position, speed, acceleration, jerk, not a number.
type Met = [bool; 5];

/// Limits one axis towards a request.
fn toward(limits: &AxisLimits, cycle: f64, sent: Sent, request: f64) -> (Sent, Met) {
    if !request.is_finite() {
        return (stopped(limits, cycle, sent), [false, false, false, false, true]);
    }
    let speed = (request - sent.position) / cycle;
    let allowed = speed.clamp(-limits.speed, limits.speed);
    let asked = (allowed - sent.speed) / cycle;
    let within = asked.clamp(-limits.acceleration, limits.acceleration);
    let change = limits.jerk * cycle;
    let acceleration = within.clamp(sent.acceleration - change, sent.acceleration + change);
    let beyond = |one: f64, two: f64, limit: f64| (one - two).abs() > SLACK * limit;
    let mut met = [
        false,
        beyond(speed, allowed, limits.speed),
        beyond(asked, within, limits.acceleration),
        beyond(within, acceleration, change),
        false,
    ];
    let mut next = sent.after(acceleration, cycle);
    if met == [false; 5] {
        // Without a limit the request passes bit for bit.
        next.position = request;
    }
    if can_stop(limits, cycle, next) {
        return (next, met);
    }
    met[0] = true;
    (stopped(limits, cycle, sent), met)
}

/// Makes one step of a stop.
fn stopped(limits: &AxisLimits, cycle: f64, sent: Sent) -> Sent {
    let mut next = sent.after(braking(limits, cycle, sent), cycle);
    settle(&mut next, limits, cycle);
    next
}

/// A speed within rounding of zero is zero.
fn settle(sent: &mut Sent, limits: &AxisLimits, cycle: f64) {
    let quantum = limits.jerk * cycle * cycle;
    if sent.speed.abs() <= 1e-6 * quantum && sent.acceleration.abs() <= 1e-3 * limits.jerk * cycle {
        (sent.speed, sent.acceleration) = (0.0, 0.0);
    }
}

/// Returns the next acceleration of the fastest stop: the hardest braking that the jerk can still release in time.
///
/// Braking with b now and releasing by q = jerk * cycle in every cycle after reduces the speed by `cycle ((n + 1) b - q
/// n (n + 1) / 2)`, n = floor(b / q); solved for b.
fn braking(limits: &AxisLimits, cycle: f64, sent: Sent) -> f64 {
    let change = limits.jerk * cycle;
    let side = if sent.speed < 0.0 || (sent.speed == 0.0 && sent.acceleration < 0.0) { -1.0 } else { 1.0 };
    let need = side * sent.speed / cycle;
    let whole = (0.5 * ((1.0 + 8.0 * need / change).sqrt() - 1.0)).floor().max(0.0);
    let brake = (need + 0.5 * change * whole * (whole + 1.0)) / (whole + 1.0);
    let request = -side * brake.min(limits.acceleration);
    request.clamp(sent.acceleration - change, sent.acceleration + change)
}

/// Whether a stop from this state stays inside range and speed.
fn can_stop(limits: &AxisLimits, cycle: f64, from: Sent) -> bool {
    let inside = |sent: &Sent| {
        let reach = SLACK * (limits.upper - limits.lower).max(1e-3);
        sent.position >= limits.lower - reach
            && sent.position <= limits.upper + reach
            && sent.speed.abs() <= limits.speed * (1.0 + SLACK)
    };
    if !inside(&from) {
        return false;
    }
    // Far from every end a bound suffices: twice the stopping distance with all its ramps.
    let top =
        from.speed.abs() + 0.5 * from.acceleration * from.acceleration / limits.jerk + limits.jerk * cycle * cycle;
    let ramp = limits.acceleration / limits.jerk + 4.0 * cycle;
    let way = top * (top / limits.acceleration + 3.0 * ramp);
    if top <= limits.speed && from.position - way >= limits.lower && from.position + way <= limits.upper {
        return true;
    }
    let mut at = from;
    for _ in 0..LONGEST_STOP {
        if at.at_rest() {
            return true;
        }
        at = stopped(limits, cycle, at);
        if !inside(&at) {
            return false;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: AxisLimits = AxisLimits { lower: -1.0, upper: 1.0, speed: 1.0, acceleration: 2.0, jerk: 20.0 };

    /// Pseudo-random numbers.
    struct Dice(u64);
    impl Dice {
        fn unit(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Sends requests and checks every sent position against the limits by its own differences.
    fn check(cycle: f64, requests: impl Iterator<Item = f64>) {
        let mut limiter = Limiter::new([LIMITS; AXES], cycle, [0.0; AXES]);
        let mut past = [0.0f64; 4];
        for request in requests {
            let (sent, _) = limiter.approach(&[request; AXES]);
            past = [sent[0], past[0], past[1], past[2]];
            let speed = (past[0] - past[1]) / cycle;
            let acceleration = (past[0] - 2.0 * past[1] + past[2]) / (cycle * cycle);
            let jerk = (past[0] - 3.0 * past[1] + 3.0 * past[2] - past[3]) / cycle.powi(3);
            assert!(past[0].abs() <= LIMITS.upper + 1e-8, "position {}", past[0]);
            assert!(speed.abs() <= LIMITS.speed + 1e-7, "speed {speed}");
            assert!(acceleration.abs() <= LIMITS.acceleration + 1e-5, "acceleration {acceleration}");
            assert!(jerk.abs() <= LIMITS.jerk + 2e-2, "jerk {jerk}");
        }
    }

    #[test]
    fn limiter_never_exceeds_any_limit() {
        for (seed, cycle) in [(1, 1e-3), (2, 4e-3), (3, 8e-3), (4, 12e-3)] {
            let mut dice = Dice(seed);
            let (mut target, mut wanders) = (0.0, 0.0);
            let requests = (0..20_000).map(|i| {
                if i % 40 == 0 {
                    target = 6.0 * dice.unit() - 3.0;
                    wanders = 0.02 * dice.unit();
                }
                match dice.unit() {
                    u if u < 0.02 => f64::NAN,
                    u if u < 0.04 => 1e300 * (u - 0.03),
                    u => target + wanders * (u - 0.5),
                }
            });
            check(cycle, requests);
        }
    }

    #[test]
    fn requests_within_limits_pass_bit_for_bit() {
        let cycle = 4e-3;
        let mut limiter = Limiter::new([LIMITS; AXES], cycle, [0.0; AXES]);
        for k in 1..5000 {
            // A sine that grows from rest: speed 0.63, acceleration 0.8 at most.
            let t = f64::from(k) * cycle;
            let request = 0.5 * (1.0 - (-t * t * 0.2).exp()) * (1.26 * t).sin();
            let (sent, cut) = limiter.approach(&[request; AXES]);
            assert!(!cut.any(), "{cut:?} at {t} s");
            assert_eq!(sent, [request; AXES]);
        }
    }

    #[test]
    fn stop_is_as_fast_as_the_limits_allow() {
        for cycle in [1e-3, 4e-3, 12e-3] {
            let mut limiter = Limiter::new([LIMITS; AXES], cycle, [-0.9; AXES]);
            while limiter.sent[0].speed < 0.5 {
                limiter.approach(&[1.0; AXES]);
            }
            let mut cycles = 0;
            while !limiter.at_rest() {
                limiter.stop();
                cycles += 1;
            }
            // From full acceleration: release (0.1 s, to 0.6 1/s), then 0.1 s of ramps beyond v/a.
            let least = 0.1 + (0.6 / 2.0 + 0.1);
            let took = f64::from(cycles) * cycle;
            assert!((took - least).abs() < 6.0 * cycle, "{took} s, {least} s");
        }
    }

    #[test]
    fn clamped_limits_are_reported() {
        let mut limiter = Limiter::new([LIMITS; AXES], 4e-3, [0.0; AXES]);
        let mut request = [0.0; AXES];
        request[2] = f64::NAN;
        request[4] = 0.5;
        let (sent, cut) = limiter.approach(&request);
        assert_eq!((cut.not_finite, cut.speed), (1 << 2, 1 << 4));
        assert_eq!(sent[2], 0.0);
    }
}
