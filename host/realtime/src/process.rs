//! Operating-system rights of the cycle's thread.

mod owner;

pub use owner::{Lock, NotOwner, single_owner};

use std::fmt;
use std::fs;
use std::hint::black_box;
use std::io;

/// Stack locked for the cycle \[bytes\]; a quarter of a standard library thread's stack.
const STACK: usize = 512 << 10;

/// Limits the time of all real-time threads in a second.
const THROTTLE: &str = "/proc/sys/kernel/sched_rt_runtime_us";

/// Requested rights of the cycle's thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Realtime {
    /// Priority under SCHED_FIFO, 1 to 99; `None`: the default time-sharing policy.
    pub priority: Option<u8>,
    /// Processor core to which the thread is pinned.
    pub core: Option<usize>,
    /// Whether a refused right is an error.
    pub strict: bool,
}

impl Default for Realtime {
    /// Priority 80: above the kernel's interrupt threads (50), below its watchdogs (99). No core.
    fn default() -> Self {
        Self { priority: Some(80), core: None, strict: false }
    }
}

/// Rights that the operating system has not granted, and other warnings.
#[derive(Debug)]
pub enum Warning {
    /// Memory can be paged out.
    Memory(io::Error),
    /// The thread has no real-time priority.
    Priority(u8, io::Error),
    /// The thread may be moved to another core.
    Core(usize, io::Error),
    /// The kernel may delay wake-ups by up to 50 us.
    TimerSlack(io::Error),
    /// The kernel stops real-time threads that do not sleep for a part of each second; runtime per period \[us\].
    Throttled(i64),
}

impl Warning {
    /// Whether a right was refused.
    fn refused(&self) -> bool {
        !matches!(self, Self::Throttled(_))
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Memory(why) => write!(
                f,
                "memory is not locked ({why}), so that a page fault can delay the cycle: allow it with `ulimit -l \
                 unlimited` (memlock in /etc/security/limits.conf) or the capability CAP_IPC_LOCK"
            ),
            Self::Priority(priority, why) => write!(
                f,
                "no real-time priority {priority} ({why}), so that any program can delay the cycle: allow it with \
                 `@GROUP - rtprio {priority}` in /etc/security/limits.conf, or with `setcap cap_sys_nice=ep` on the program"
            ),
            Self::Core(core, why) => write!(
                f,
                "the cycle is not pinned to core {core} ({why}): name one that this machine has and that this process may \
                 use (`taskset -p`, the cpuset of its container)"
            ),
            Self::TimerSlack(why) => write!(
                f,
                "the timer slack is unchanged ({why}): wake-ups may be 50 us late; a real-time priority avoids this"
            ),
            Self::Throttled(runtime) => write!(
                f,
                "the kernel stops real-time threads that have run for {runtime} us of a period ({THROTTLE}): one that spins \
                 instead of sleeping stands still for the rest of it; -1 there switches that off"
            ),
        }
    }
}

impl std::error::Error for Warning {}

impl Realtime {
    /// Requests all rights for the calling thread: locked memory of the process, priority, core, exact timers, a stack
    /// in memory. Returns the refused ones as warnings with their remedies.
    ///
    /// Threads started later do not inherit the priority, but do inherit the core.
    ///
    /// # Errors
    /// The first refusal, if `strict`.
    pub fn apply(&self) -> Result<Vec<Warning>, Warning> {
        let mut warnings = Vec::new();
        warnings.extend(lock_memory().err().map(Warning::Memory));
        warnings.extend(exact_timers().err().map(Warning::TimerSlack));
        if let Some(core) = self.core {
            warnings.extend(keep_to(core).err().map(|why| Warning::Core(core, why)));
        }
        if let Some(priority) = self.priority {
            match take_priority(priority) {
                Ok(()) => warnings.extend(throttled().map(Warning::Throttled)),
                Err(why) => warnings.push(Warning::Priority(priority, why)),
            }
        }
        touch_stack();
        match warnings.iter().position(Warning::refused) {
            Some(first) if self.strict => Err(warnings.swap_remove(first)),
            _ => Ok(warnings),
        }
    }
}

/// Converts the result of a C library call.
fn answer(code: i32) -> io::Result<()> {
    if code == 0 { Ok(()) } else { Err(io::Error::last_os_error()) }
}

fn lock_memory() -> io::Result<()> {
    // SAFETY: takes flags only.
    answer(unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) })
}

fn exact_timers() -> io::Result<()> {
    let slack: libc::c_ulong = 1;
    // SAFETY: sets the slack [ns] of the calling thread's timers.
    answer(unsafe { libc::prctl(libc::PR_SET_TIMERSLACK, slack) })
}

fn keep_to(core: usize) -> io::Result<()> {
    if core >= libc::CPU_SETSIZE as usize {
        return Err(io::Error::from_raw_os_error(libc::EINVAL));
    }
    // SAFETY: an all-zero set is an empty one; the core is within it; the set outlives the call.
    answer(unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(core, &mut set);
        libc::sched_setaffinity(0, size_of_val(&set), &raw const set)
    })
}

fn take_priority(priority: u8) -> io::Result<()> {
    let parameters = libc::sched_param { sched_priority: i32::from(priority) };
    // Threads started later (a library's, a log's) must not compete with the cycle.
    let policy = libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK;
    // SAFETY: 0 is the calling thread; the parameters outlive the call.
    answer(unsafe { libc::sched_setscheduler(0, policy, &raw const parameters) })
}

/// Returns the runtime of real-time threads per period \[us\], if it is limited.
fn throttled() -> Option<i64> {
    let runtime = fs::read_to_string(THROTTLE).ok()?.trim().parse().ok()?;
    (runtime != -1).then_some(runtime)
}

/// Touches the stack, so that the cycle meets no page fault there.
#[inline(never)]
fn touch_stack() {
    let mut stack = [0u8; STACK];
    for page in stack.chunks_mut(4096) {
        page[0] = 1;
    }
    black_box(&stack);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns policy and priority of the calling thread.
    fn policy() -> (i32, i32) {
        let mut parameters = libc::sched_param { sched_priority: 0 };
        // SAFETY: 0 is the calling thread; the parameters are local.
        let policy = unsafe {
            assert_eq!(libc::sched_getparam(0, &raw mut parameters), 0);
            libc::sched_getscheduler(0)
        };
        (policy & !libc::SCHED_RESET_ON_FORK, parameters.sched_priority)
    }

    /// Runs on a separate thread, so that the rights end with it.
    fn on_a_thread<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
        std::thread::spawn(work).join().expect("no panic")
    }

    /// Removes all capabilities of the calling thread only.
    fn powerless() {
        #[repr(C)]
        struct Header {
            version: u32,
            pid: i32,
        }
        let header = Header { version: 0x2008_0522, pid: 0 };
        let none = [0u32; 6];
        // SAFETY: version 3 of the call reads a header and six words.
        assert_eq!(unsafe { libc::syscall(libc::SYS_capset, &raw const header, &raw const none) }, 0);
    }

    #[test]
    fn granted_rights_are_in_force_and_refused_ones_are_reported() {
        let (warnings, policy, child) = on_a_thread(|| {
            let warnings = Realtime { core: Some(0), ..Realtime::default() }.apply().expect("not strict");
            (warnings, policy(), on_a_thread(policy))
        });
        let refused = warnings.iter().any(|warning| matches!(warning, Warning::Priority(..)));
        assert_eq!(policy == (libc::SCHED_FIFO, 80), !refused, "{policy:?}: {warnings:?}");
        assert_eq!(child, (libc::SCHED_OTHER, 0), "threads begun later share time like any other");
        // SAFETY: undoes the lock of the process' memory for the tests after this one.
        unsafe { libc::munlockall() };
    }

    #[test]
    fn every_refused_right_has_a_remedy() {
        let (warnings, strict) = on_a_thread(|| {
            powerless();
            let wanted = Realtime { core: Some(1000), ..Realtime::default() };
            (wanted.apply().expect("not strict"), Realtime { strict: true, ..wanted }.apply())
        });
        let text: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        let assert_reported =
            |remedy: &str| assert!(text.iter().any(|text| text.contains(remedy)), "{remedy}: {text:?}");
        assert_reported("core 1000");
        // Limits may grant an ordinary user the same as the capabilities.
        if warnings.iter().any(|warning| matches!(warning, Warning::Priority(..))) {
            assert_reported("rtprio 80");
            assert_reported("cap_sys_nice");
        }
        if warnings.iter().any(|warning| matches!(warning, Warning::Memory(_))) {
            assert_reported("ulimit -l");
        }
        assert!(strict.is_err_and(|first| first.refused()));
    }

    #[test]
    fn throttling_is_reported_only_if_it_has_an_effect() {
        assert!(!Warning::Throttled(950_000).refused());
        assert!(Warning::Throttled(950_000).to_string().contains("950000 us"));
    }
}
