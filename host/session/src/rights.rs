//! Real-time rights of the cycle's thread, and locks that give a robot a single master.

use crate::addresses::FacilityAddresses;
use crate::error::{Result, SessionError};
use softdock_campaign::Station;
use softdock_realtime::process::{Lock, Realtime, Warning, single_owner};

/// Requested real-time rights of a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CycleRights {
    /// Priority under SCHED_FIFO, 1 to 99; 0: none.
    pub priority: u8,
    /// Processor core to which the thread is pinned.
    pub core: Option<usize>,
}

impl CycleRights {
    /// Requests the rights for the calling thread; `warn` receives the refused ones.
    ///
    /// # Errors
    /// If a required right is refused.
    pub fn apply(self, warn: impl FnMut(Warning)) -> Result<()> {
        let Self { priority, core } = self;
        let wanted = Realtime { priority: (priority > 0).then_some(priority), core, strict: false };
        let warnings = wanted
            .apply()
            .map_err(|warning| SessionError::refused(warning, "grant the program this right, or remove the option"))?;
        // The kernel's limit for spinning threads does not concern a cycle that sleeps.
        warnings.into_iter().filter(|warning| !matches!(warning, Warning::Throttled(_))).for_each(warn);
        Ok(())
    }
}

/// Locks both robots of a facility, by their names and by the addresses of all real links: no other process drives them
/// under any name, or takes the sensor's stream. The locks end with the process at the latest.
///
/// # Errors
/// If another process holds one of the locks.
pub fn lock_robots(station: &Station, addresses: &FacilityAddresses) -> Result<Vec<Lock>> {
    let folder = std::env::temp_dir().join("softdock-robots");
    let names = station.robots.iter().map(|robot| robot.name.clone()).chain(addresses.real());
    let locks = names.map(|name| single_owner(&folder, &name));
    locks.map(|lock| lock.map_err(|taken| SessionError::refused(taken, "only one process may drive a robot"))).collect()
}
