//! Answers that take longer than a request: computed on a thread, kept, and renewed when they are old.

use serde_json::{Value, json};
use std::collections::HashMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Time in which a request waits for its first answer.
const FIRST: Duration = Duration::from_millis(700);

/// An answer is renewed when it is this old, and at least this many times the time that it took.
const RENEWED: (Duration, u32) = (Duration::from_secs(2), 1);

/// Answers kept; the oldest is dropped.
const MOST: usize = 64;

/// An answer and its making.
#[derive(Default)]
struct Job {
    answer: Option<Arc<Value>>,
    made: Option<Instant>,
    took: Duration,
    is_running: bool,
}

/// Answers by their question.
#[derive(Clone, Default)]
pub(crate) struct Answers(Arc<(Mutex<HashMap<String, Job>>, Condvar)>);

impl Answers {
    /// The newest answer to a question with its age: `{"pending": true}` until there is one. `work` makes a new one on a
    /// thread of its own if the present one is old; requests never wait for a renewal.
    pub(crate) fn ask(&self, question: &str, work: impl FnOnce() -> Value + Send + 'static) -> Value {
        let mut jobs = self.lock();
        if jobs.len() >= MOST && !jobs.contains_key(question) {
            let idle = jobs.iter().filter(|(_, job)| !job.is_running).min_by_key(|(_, job)| job.made);
            if let Some(oldest) = idle.map(|(question, _)| question.clone()) {
                jobs.remove(&oldest);
            }
        }
        let job = jobs.entry(question.to_owned()).or_default();
        let (least, times) = RENEWED;
        let is_old = job.made.is_none_or(|made| made.elapsed() > least.max(times * job.took));
        if is_old && !job.is_running {
            job.is_running = true;
            let (answers, question) = (self.clone(), question.to_owned());
            std::thread::spawn(move || answers.make(&question, work));
        }
        let is_first = |jobs: &mut HashMap<String, Job>| {
            jobs.get(question).is_some_and(|job| job.answer.is_none() && job.is_running)
        };
        let waited = self.0.1.wait_timeout_while(jobs, FIRST, is_first);
        let (jobs, _) = waited.unwrap_or_else(PoisonError::into_inner);
        let job = jobs.get(question);
        match job.and_then(|job| Some((job.answer.clone()?, job.made?))) {
            Some((answer, made)) => json!({ "answer": *answer, "age_s": made.elapsed().as_secs_f64() }),
            None => json!({ "pending": true }),
        }
    }

    fn make(&self, question: &str, work: impl FnOnce() -> Value) {
        let begun = Instant::now();
        let answer = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work))
            .unwrap_or_else(|_| json!({ "error": "an internal error; the terminal of the server has its message" }));
        let mut jobs = self.lock();
        let job = jobs.entry(question.to_owned()).or_default();
        *job = Job {
            answer: Some(Arc::new(answer)),
            made: Some(Instant::now()),
            took: begun.elapsed(),
            is_running: false,
        };
        self.0.1.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<String, Job>> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_never_wait_for_slow_work() {
        let answers = Answers::default();
        let begun = Instant::now();
        let slow = || {
            std::thread::sleep(Duration::from_secs(2));
            json!(1)
        };
        assert_eq!(answers.ask("slow", slow)["pending"], true);
        assert!(begun.elapsed() < Duration::from_millis(1500));
        let again = std::iter::repeat_with(|| {
            std::thread::sleep(Duration::from_millis(100));
            answers.ask("slow", || json!(2))
        });
        let first = again.take(100).find(|answer| answer["pending"].is_null()).expect("an answer");
        // The question was asked once: the work under way answers it.
        assert_eq!(first["answer"], 1);
        assert_eq!(
            answers.ask("broken", || panic!("a test"))["answer"]["error"].as_str().map(str::is_empty),
            Some(false)
        );
    }
}
