//! `softdock replay --log`: a session decided again from what its links brought, and the dead times of its robots.

use crate::args::ReplayArgs;
use crate::reports::session_failed;
use crate::words::{Exit, say};
use softdock_realtime::drive::delay::Delay;
use softdock_session::replay::{ReplayFiles, SessionLog};

/// Plays a log again.
pub(crate) fn replay_log(args: &ReplayArgs) -> miette::Result<Exit> {
    let log = SessionLog::read(args.log.as_ref().expect("clap asks for it")).map_err(session_failed)?;
    if let Some(why) = log.ends_early() {
        say(format!("the log ends early ({why}): {} cycles up to there", log.cycles()));
    }
    let files =
        ReplayFiles { campaign: args.campaign.clone(), model: args.model.clone(), facility: args.facility.clone() };
    let replay = log.replay(&files).map_err(session_failed)?;
    for (robot, delay) in replay.delays.iter().enumerate() {
        say_delay(robot + 1, delay.as_ref());
    }
    let replayed = &replay.replayed;
    Ok(match &replayed.first {
        None => {
            say(format!("{} cycles: equal, bit for bit", replayed.cycles));
            Exit::Done
        }
        Some(difference) => {
            say(format!("{} of {} cycles equal; the first that is not: {difference}", replayed.equal, replayed.cycles));
            Exit::NotVerified
        }
    })
}

/// Dead time between command and motion, without what the protocol states.
fn say_delay(robot: usize, delay: Option<&Delay>) {
    let Some(delay) = delay else { return };
    say(format!(
        "robot {robot}    dead time {:.2} +- {:.2} ms beyond one cycle; slow motion comes {:.2} ms late",
        delay.dead_time * 1e3,
        delay.error * 1e3,
        delay.of_slow_motion() * 1e3
    ));
}
