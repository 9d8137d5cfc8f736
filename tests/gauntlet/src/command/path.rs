//! Transmission of the command from the simulation computer to the robot, tick by tick of the receiver.

use super::TICK;
use crate::catalogue::Sizes;
use crate::motion::Motion;
use crate::random::Stream;

/// Transport delay that the model knows \[s\].
pub(crate) const KNOWN_DELAY: f64 = 0.002;
/// Exponent of the long tail, and the longest delay it makes \[s\].
pub(crate) const TAIL_EXPONENT: f64 = 1.5;
const LONGEST_TAIL: f64 = 0.05;
/// Period of the beat of two bus cycles \[s\].
pub(crate) const BEAT_S: f64 = 0.7;
/// Steps of a tick in which the lag follows the command: straight lines from tick to tick would be a lag of their own.
const STEPS: usize = 20;
/// Keeps a time that is a whole number of periods from falling just short of it.
const ENOUGH: f64 = 1e-9;

/// The path with its hidden effects and its memory.
pub(crate) struct Path {
    delay: f64,
    lag: f64,
    jitter: f64,
    drops: f64,
    skew: f64,
    hold: f64,
    rate_limit: f64,
    tail: f64,
    rate_delay: f64,
    beat: f64,
    /// Draws of jitter and losses.
    stream: Stream,
    /// Last packet's number, when what it held was asked for \[s\], and the value \[rad\].
    packet: i64,
    sent: Option<f64>,
    held: f64,
    /// Input and output of the lag, output of the limit \[rad\].
    before: f64,
    lagged: f64,
    limited: f64,
}

/// What the receiver has at one of its ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Received {
    /// Number of the last packet.
    pub(crate) packet: i64,
    /// Command in force \[rad\].
    pub(crate) value: f64,
}

impl Path {
    /// At rest at a command \[rad\].
    pub(crate) fn new(sizes: &Sizes, at: f64, stream: Stream) -> Self {
        Self {
            delay: KNOWN_DELAY + sizes.of("C1_transport_delay"),
            lag: sizes.of("C2_lag"),
            jitter: sizes.of("C3_jitter"),
            drops: sizes.of("C4_drops"),
            skew: sizes.of("C5_skew"),
            hold: sizes.of("C6_hold"),
            rate_limit: sizes.limit("C7_rate_limit"),
            tail: sizes.of("long_tail_jitter"),
            rate_delay: sizes.of("rate_dependent_delay"),
            beat: sizes.of("beating_delay"),
            stream,
            packet: -1,
            sent: None,
            held: at,
            before: at,
            lagged: at,
            limited: at,
        }
    }

    /// Delay \[s\] of what arrives at a time \[s\]; never negative.
    fn delay_at(&mut self, motion: &Motion, time: f64, disturbance: f64) -> f64 {
        let (normal, uniform) = (self.stream.normal(), self.stream.uniform());
        let tail = (self.tail * (uniform.powf(-1.0 / TAIL_EXPONENT) - 1.0)).min(LONGEST_TAIL);
        let phase = (time / BEAT_S).fract();
        let beat = self.beat * (1.0 - (2.0 * phase - 1.0).abs());
        let rate = self.rate_delay * motion.at(time)[1].abs();
        (self.delay + disturbance + self.jitter * normal + tail + beat + rate).max(0.0)
    }

    /// What is in force at a tick of the receiver, whose clock is off by an offset \[s\]; a disturbance \[s\] adds to the delay.
    pub(crate) fn receive(&mut self, motion: &Motion, tick: usize, offset: f64, disturbance: f64) -> Received {
        let time = tick as f64 * TICK * (1.0 - self.skew) + offset;
        let mut sent = time - self.delay_at(motion, time, disturbance);
        if self.hold > 0.0 {
            sent = (sent / self.hold + ENOUGH).floor() * self.hold;
        }
        // A loss is drawn whether or not losses are hidden, so that the draws of the jitter stay what they are.
        let lost = self.stream.uniform() < self.drops;
        let before = self.sent.unwrap_or(sent);
        if !lost {
            self.packet = (sent / TICK + ENOUGH).floor().max(-1.0) as i64;
            self.sent = Some(sent);
            self.held = motion.at(sent)[0];
        }
        if self.lag > 0.0 {
            self.lag_behind(motion, [before, if lost { before } else { sent }]);
        }
        let value = if self.lag > 0.0 { self.lagged } else { self.held };
        let step = self.rate_limit * TICK;
        self.limited += (value - self.limited).clamp(-step, step);
        Received { packet: self.packet, value: self.limited }
    }

    /// The lag over a tick in which arrives what was sent between two times \[s\]; exact for a command that is linear
    /// over a step.
    fn lag_behind(&mut self, motion: &Motion, [from, to]: [f64; 2]) {
        let step = TICK / STEPS as f64;
        for number in 1..=STEPS {
            let value = motion.at(from + (to - from) * number as f64 / STEPS as f64)[0];
            let (keep, behind) = ((-step / self.lag).exp(), self.lag * (value - self.before) / step);
            self.lagged = value - behind + keep * (self.lagged - self.before + behind);
            self.before = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue::{Hidden, Rig};
    use crate::motion::sine;
    use std::f64::consts::TAU;

    fn motion() -> Motion {
        Motion { centre: 0.2, waves: vec![sine(0.1, 1.0, 0.0)] }
    }

    fn received(id: &'static str, size: f64) -> Vec<Received> {
        let sizes = Sizes::check(Rig::Command, &[Hidden { id, size }]).expect("an effect");
        let mut path = Path::new(&sizes, 0.2, Stream::new(4, "a path", 0));
        (0..4000).map(|tick| path.receive(&motion(), tick, 0.0, 0.0)).collect()
    }

    /// Delay \[s\] of every received value where the command moves fast, beyond the known one.
    fn delays(id: &'static str, size: f64) -> Vec<(f64, f64)> {
        let values = received(id, size);
        let fast = (500..values.len()).filter(|tick| motion().at(*tick as f64 * TICK)[1].abs() > 0.5);
        fast.map(|tick| {
            let time = tick as f64 * TICK;
            let mut delay = 0.0;
            // Newton's method on motion(time - delay) = value.
            for _ in 0..6 {
                let [at, rate, _] = motion().at(time - delay);
                delay += (at - values[tick].value) / rate;
            }
            (time, delay - KNOWN_DELAY)
        })
        .collect()
    }

    fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
        values.clone().sum::<f64>() / values.count() as f64
    }

    #[test]
    fn delays_match_the_effects() {
        for (time, delay) in delays("C1_transport_delay", 0.0037) {
            assert!((delay - 0.0037).abs() < 1e-9, "{time}: {delay}");
        }
        for (time, delay) in delays("C5_skew", 0.0003) {
            assert!((delay - 0.0003 * time).abs() < 1e-9, "{time}: {delay}");
        }
        for (time, delay) in delays("rate_dependent_delay", 0.003) {
            assert!((delay - 0.003 * motion().at(time)[1].abs()).abs() < 1e-9, "{time}: {delay}");
        }
        let held = delays("C6_hold", 0.004);
        assert!((mean(held.iter().map(|(_, delay)| *delay)) - 0.0015).abs() < 1e-4);
        let beating = delays("beating_delay", 0.004);
        assert!(beating.iter().all(|(_, delay)| (-1e-9..0.004 + 1e-9).contains(delay)));
        // A lag is late by its time constant where the command is steep.
        assert!((mean(delays("C2_lag", 0.003).into_iter().map(|(_, delay)| delay)) - 0.003).abs() < 1e-4);
    }

    #[test]
    fn lag_attenuates_a_sine_by_its_time_constant() {
        let quick = Motion { centre: 0.0, waves: vec![sine(0.1, 25.0, 0.0)] };
        let sizes = Sizes::check(Rig::Command, &[Hidden { id: "C2_lag", size: 0.001 }]).expect("an effect");
        let mut path = Path::new(&sizes, 0.0, Stream::new(4, "a path", 0));
        let values: Vec<f64> = (0..4000).map(|tick| path.receive(&quick, tick, 0.0, 0.0).value).collect();
        let power = mean(values[1000..].iter().map(|value| value * value));
        let share = 1.0 + (0.001 * TAU * 25.0_f64).powi(2);
        assert!(((2.0 * power).sqrt() / 0.1 * share.sqrt() - 1.0).abs() < 1e-4, "{power}");
    }

    #[test]
    fn jitter_and_long_tail_have_their_distributions() {
        let jitter = delays("C3_jitter", 0.0003);
        let power = mean(jitter.iter().map(|(_, delay)| delay * delay));
        assert!((power.sqrt() - 0.0003).abs() < 2e-5, "{}", power.sqrt());
        let tail = delays("long_tail_jitter", 0.0002);
        let beyond = |bound: f64| tail.iter().filter(|(_, delay)| *delay > bound).count() as f64 / tail.len() as f64;
        // P(delay > x) = (1 + x / scale)^-1.5.
        assert!((beyond(0.0006) - 0.125).abs() < 0.03 && beyond(0.003) > 0.003, "{} {}", beyond(0.0006), beyond(0.003));
    }

    #[test]
    fn lost_packets_hold_value_and_packet_number() {
        let values = received("C4_drops", 0.1);
        let lost = values.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert!((lost as f64 / values.len() as f64 - 0.1).abs() < 0.02, "{lost}");
        for (tick, value) in values.iter().enumerate().skip(100) {
            let late = tick as i64 - 2 - value.packet;
            assert!((0..8).contains(&late), "{tick}: {late}");
            assert!((value.value - motion().at(value.packet as f64 * TICK)[0]).abs() < 1e-9);
        }
    }

    #[test]
    fn rate_limit_limits_the_rate() {
        let values = received("C7_rate_limit", 0.3);
        let fastest = values.windows(2).map(|pair| (pair[1].value - pair[0].value).abs() / TICK).fold(0.0, f64::max);
        assert!((fastest - 0.3).abs() < 1e-9, "{fastest}");
    }
}
