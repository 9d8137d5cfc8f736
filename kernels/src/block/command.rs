//! Transport of a command from the computer that sends it to the receiver that echoes it.
//!
//! The command is delayed, held between packets, followed with a lag outside a dead band, and limited in rate. The delay has jitter: the output is the
//! received command over the rate at which it was sent, so that jitter is the same noise in fast and in slow phases.
//! For a prismatic axis read m for rad.

use super::Block;
use super::low_pass::LowPass;
use super::stairs::stepped;
use crate::bundle;
use crate::fields::filled;
use crate::range::UNLIMITED;
use crate::real::Real;

bundle! {
    /// What may happen to a command, and what may differ unnoticed.
    CommandValues {
        transport_delay: R, "s", "transport delay that the model knows";
        delay: R, "s", "transport delay beyond it";
        clock_offset: R, "s", "how much later the receiver's stamps are than the sender's, for want of a common clock";
        clock_skew: R, "1", "growth of the delay with the recording's time: the receiver's clock is fast by it";
        hold: R, "s", "period after which the command is taken anew";
        hold_phase: R, "s", "when it is taken anew, on the receiver's clock from the recording's start";
        hold_share: R, "1", "1 if it is zero-order held, 0 if the period has no effect";
        blur: R, "s", "half the width over which jitter blurs an edge of the hold";
        lag: R, "s", "time constant of a lag of the command";
        dead_band: R, "rad", "error of a servo that is not corrected, to either side: static friction over its gain";
        position_offset: R, "rad", "error in which a servo settles: its load over its gain";
        rate_limit: R, "rad/s", "greatest rate of the command";
        limit_lag: R, "s", "additional lag of a limited command: jitter takes it to the limit early";
    }
}

impl CommandValues<f64> {
    /// A command that arrives at once and as it was sent.
    pub fn null() -> Self {
        Self { rate_limit: UNLIMITED, ..filled(0.0) }
    }
}

bundle! {
    /// What is known at a tick of the receiver.
    CommandTick {
        weight: R, "s/rad", "one over the rate at which what arrives was sent; nothing where that is not known";
        time: R, "s", "time since the recording began";
    }
}

bundle! {
    /// A command as it was sent.
    Sent {
        command: R, "rad", "command";
        bend: R, "rad", "half its second derivative times the square of a step";
    }
}

bundle! {
    /// What is hidden in a command's way.
    CommandHidden {
        arrived: R, "rad", "command after delay and hold";
        filtered: R, "rad", "the same behind the lag";
        limited: R, "rad", "the same behind the limit";
        behind: R, "rad", "by how much the command in force is behind that";
    }
}

bundle! {
    /// Echo of a receiver.
    CommandOutput {
        received: R, "s", "command in force over the rate at which it was sent";
    }
}

/// A command's way, from sender to receiver.
#[derive(Clone, Copy, Debug, Default)]
pub struct CommandBlock;

impl Block for CommandBlock {
    type Params<R: Real> = CommandValues<R>;
    type State<R: Real> = CommandHidden<R>;
    type Input<R: Real> = CommandTick<R>;
    type Late<R: Real> = Sent<R>;
    type Output<R: Real> = CommandOutput<R>;

    #[inline(always)]
    fn lateness<R: Real>(&self, p: &CommandValues<R>, time: R) -> R {
        let late = p.clock_skew.mul_add(time, p.transport_delay + p.delay + p.clock_offset);
        let since = time - p.hold_phase;
        let waited = since - stepped(since - p.hold * R::lit(0.5), p.hold, p.blur);
        p.hold_share.mul_add(waited, late)
    }

    #[inline(always)]
    fn start<R: Real>(&self, p: &CommandValues<R>, _u: &CommandTick<R>, late: &Sent<R>) -> CommandHidden<R> {
        let arrived = late.command + p.position_offset;
        CommandHidden { arrived, filtered: arrived, limited: arrived, behind: R::lit(0.0) }
    }

    #[inline(always)]
    fn advance<R: Real>(
        &self,
        step: f64,
        p: &CommandValues<R>,
        s: &CommandHidden<R>,
        u: &CommandTick<R>,
        late: &Sent<R>,
    ) -> CommandHidden<R> {
        let steps = self.lateness(p, u.time) * R::lit(1.0 / step);
        let share = steps - steps.floor();
        // What a straight line between two instants lacks.
        let arrived = late.bend.mul_add(share * (share - R::lit(1.0)), late.command) + p.position_offset;
        // Inside the band the target is where the servo is.
        let target = |command: R| command - (command - s.filtered).min(p.dead_band).max(-p.dead_band);
        let filtered = LowPass::of(step, p.lag).after(target(s.arrived), target(arrived), late.bend, s.filtered);
        let reach = p.rate_limit * R::lit(step);
        let limited = (filtered - s.limited).min(reach).max(-reach) + s.limited;
        let most = p.rate_limit * p.limit_lag;
        let behind = (filtered - limited).min(most).max(-most);
        CommandHidden { arrived, filtered, limited, behind }
    }

    #[inline(always)]
    fn output<R: Real>(
        &self,
        _p: &CommandValues<R>,
        s: &CommandHidden<R>,
        u: &CommandTick<R>,
        _late: &Sent<R>,
    ) -> CommandOutput<R> {
        CommandOutput { received: (s.limited - s.behind) * u.weight }
    }
}
