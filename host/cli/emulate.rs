//! `softdock emulate`: the other side of the protocols, two robots and a sensor that exchange their contact forces.

use crate::args::EmulateArgs;
use crate::reports::session_failed;
use crate::words::{Exit, json, say, warn};
use miette::IntoDiagnostic;
use softdock_session::emulated::{EmulationNotice, FacilityEmulator};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Serves an emulated facility.
pub(crate) fn emulate(args: &EmulateArgs) -> miette::Result<Exit> {
    let report = |notice: EmulationNotice| if notice.is_warning() { warn(notice) } else { say(notice) };
    let facility = FacilityEmulator::open(&args.options(), &report).map_err(session_failed)?;
    let stop = Arc::new(AtomicBool::new(false));
    let heard = Arc::clone(&stop);
    ctrlc::set_handler(move || heard.store(true, Ordering::Relaxed)).into_diagnostic()?;
    say("the emulated facility runs; Ctrl-C ends it");
    let summary = facility.serve(args.rights(), args.seconds, &stop, &report).map_err(session_failed)?;
    say(format!("the facility's own lateness: {}", summary.lateness));
    for (robot, end) in summary.ends.iter().enumerate() {
        if let Some(end) = end {
            say(format!("robot {} stopped: {end}", robot + 1));
        }
    }
    say(format!("peak force {:.1} N  captured {}", summary.truth.peak_contact_force, summary.captured));
    if let Some(path) = &args.truth {
        let truth = serde_json::to_value(&summary.truth).into_diagnostic()?;
        std::fs::write(path, json(&truth)).into_diagnostic()?;
    }
    Ok(Exit::Done)
}
