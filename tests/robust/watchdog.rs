//! Ends the test with the name of an input that takes too long.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Longest time that an input may take.
pub(crate) const LIMIT: Duration = Duration::from_secs(20);

/// Inputs under way, by worker.
#[derive(Clone, Default)]
pub(crate) struct Watchdog {
    under_way: Arc<Mutex<BTreeMap<usize, (String, Instant)>>>,
    is_over: Arc<AtomicBool>,
}

impl Watchdog {
    /// Starts to watch.
    pub(crate) fn start() -> Self {
        let watchdog = Self::default();
        let watching = watchdog.clone();
        std::thread::spawn(move || {
            while !watching.is_over.load(Ordering::Relaxed) {
                std::thread::sleep(Duration::from_millis(200));
                let under_way = watching.under_way.lock().expect("no panic while it is held");
                if let Some((name, begin)) = under_way.values().find(|(_, begin)| begin.elapsed() > LIMIT) {
                    eprintln!("{name}: not done after {:.1} s", begin.elapsed().as_secs_f64());
                    std::process::abort();
                }
            }
        });
        watchdog
    }

    /// A worker begins with an input.
    pub(crate) fn begin(&self, worker: usize, name: String) {
        self.under_way.lock().expect("no panic while it is held").insert(worker, (name, Instant::now()));
    }

    /// A worker is done with its input.
    pub(crate) fn end(&self, worker: usize) {
        self.under_way.lock().expect("no panic while it is held").remove(&worker);
    }
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        // The copy of the watching thread is one of two.
        if Arc::strong_count(&self.is_over) <= 2 {
            self.is_over.store(true, Ordering::Relaxed);
        }
    }
}
