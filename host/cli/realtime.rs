//! Real-time rights and robots' locks, as commands ask for them.

use crate::links::Addresses;
use crate::words::{refuse, warn};
use softdock_campaign::Station;
use softdock_realtime::process::{Lock, Realtime, Warning, single_owner};

/// Asks for real-time rights for the calling thread; what is refused is a warning with its remedy.
pub(crate) fn apply(priority: u8, core: Option<usize>) -> miette::Result<()> {
    let wanted = Realtime { priority: (priority > 0).then_some(priority), core, strict: false };
    match wanted.apply() {
        // The kernel's limit for threads that spin is nothing to a cycle that sleeps.
        Ok(warnings) => {
            let refused = warnings.iter().filter(|warning| !matches!(warning, Warning::Throttled(_)));
            refused.for_each(|warning| warn(format!("warning: {warning}")));
        }
        Err(warning) => return Err(refuse(warning, "give the program its rights, or leave the option away")),
    }
    Ok(())
}

/// Locks both robots of a facility, by their names and by what they and the sensor are reached at: nobody else drives
/// them, under whatever name, or takes the sensor's stream.
pub(crate) fn own(station: &Station, addresses: &Addresses) -> miette::Result<Vec<Lock>> {
    let folder = std::env::temp_dir().join("softdock-robots");
    let names = station.robots.iter().map(|robot| robot.name.clone()).chain(addresses.real());
    let locks = names.map(|name| single_owner(&folder, &name));
    locks.map(|lock| lock.map_err(|taken| refuse(taken, "one process drives a robot, no more"))).collect()
}
