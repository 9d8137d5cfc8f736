//! The view without a terminal: one line of text per second.

use super::model::View;
use crate::log::codes::StopCause;
use crate::time::Nanos;

/// A time in microseconds.
pub(super) fn micros(time: Nanos) -> String {
    format!("{:.0}", time.0 as f64 * 1e-3)
}

/// Returns the state of a session in one line.
pub fn line(view: &View) -> String {
    let now = &view.newest;
    let mut parts = vec![
        format!("{:9.3} s", now.time.seconds()),
        format!("{} ({})", now.phase.word(), if now.armed { "armed" } else { "dry run" }),
        if now.force.is_nan() {
            "no measured force yet".to_owned()
        } else {
            format!("measured force {:.1} N, peak {:.1} N", now.force, view.peak_measured_force)
        },
        format!("tracking error {:.3} and {:.3} mm", now.tracking[0] * 1e3, now.tracking[1] * 1e3),
        format!("contact energy {:.4} of {} J", now.energy, view.budgets.energy_j),
    ];
    for (place, robot) in now.robots.iter().enumerate().filter(|(_, robot)| robot.present) {
        let (late, trip) = (view.lateness(place), view.round_trip(place));
        parts.push(format!(
            "robot {}: late p99 {} max {} us, round trip p99 {} max {} us, lost {}, late {}",
            place + 1,
            micros(late.p99),
            micros(late.max),
            micros(trip.p99),
            micros(trip.max),
            robot.lost,
            robot.late,
        ));
    }
    if now.log_dropped > 0 {
        parts.push(format!("log lost {} records", now.log_dropped));
    }
    if now.cause != StopCause::None {
        parts.push(format!("stop: {}", now.cause.meaning()));
    }
    parts.join("; ")
}
