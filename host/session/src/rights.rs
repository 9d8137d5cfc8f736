//! Real-time rights of the cycle's thread, and locks that give a robot one master.

use crate::addresses::FacilityAddresses;
use crate::error::{Result, SessionError};
use softdock_campaign::Station;
use softdock_realtime::process::{Lock, Realtime, Warning, single_owner};

/// Real-time rights that a thread asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CycleRights {
    /// Priority under SCHED_FIFO, 1 to 99; 0 asks for none.
    pub priority: u8,
    /// Processor core that the thread keeps to.
    pub core: Option<usize>,
}

impl CycleRights {
    /// Asks for the rights, for the calling thread; `warn` takes what is refused.
    ///
    /// # Errors
    /// If the thread must not go on without them.
    pub fn apply(self, warn: impl FnMut(Warning)) -> Result<()> {
        let Self { priority, core } = self;
        let wanted = Realtime { priority: (priority > 0).then_some(priority), core, strict: false };
        let warnings = wanted.apply().map_err(|warning| {
            SessionError::refused(warning, "give the program its rights, or leave the option away")
        })?;
        // The kernel's limit for threads that spin does not concern a cycle that sleeps.
        warnings.into_iter().filter(|warning| !matches!(warning, Warning::Throttled(_))).for_each(warn);
        Ok(())
    }
}

/// Locks both robots of a facility, by their names and by the places of all real links: no other process drives them
/// under any name, or takes the sensor's stream. The locks end with the process at the latest.
///
/// # Errors
/// If another process has one of the locks.
pub fn lock_robots(station: &Station, addresses: &FacilityAddresses) -> Result<Vec<Lock>> {
    let folder = std::env::temp_dir().join("softdock-robots");
    let names = station.robots.iter().map(|robot| robot.name.clone()).chain(addresses.real());
    let locks = names.map(|name| single_owner(&folder, &name));
    locks
        .map(|lock| lock.map_err(|taken| SessionError::refused(taken, "one process drives a robot, no more")))
        .collect()
}
