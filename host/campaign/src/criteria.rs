//! The criteria of a task, one row each: how they read, whether a loop meets them, and what broke them first.

use crate::units::show;
use softdock_kernels::metrics::Metrics;
use softdock_kernels::model::Task;

/// One row of the table of criteria.
#[derive(Clone, Copy, Debug)]
pub struct Criterion {
    /// Its id in result files, also its key in the scenario's `[task]`.
    pub id: &'static str,
    /// Unit of value and limit.
    pub unit: &'static str,
    /// What it asks for, as the subject and verb of a sentence; the limit follows, if there is one.
    pub asks: fn(&Task) -> &'static str,
    /// What it means that it is broken.
    pub broken: &'static str,
    /// Its limit in a task, none if it is not in force; a criterion without a number has the limit 1.
    pub limit: fn(&Task) -> Option<f64>,
    /// When and by which value a loop breaks it.
    breach: fn(&Task, &Metrics<f64>) -> Option<Breach>,
}

/// What broke a criterion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breach {
    /// When \[s\].
    pub time: f64,
    /// By which value, in the criterion's unit; none where nothing was measured.
    pub value: Option<f64>,
}

/// All criteria that a task can have.
pub const CRITERIA: [Criterion; 9] = [
    Criterion {
        id: "capture",
        unit: "1",
        asks: |_| "the latch closes",
        broken: "no capture",
        limit: |task| task.capture.then_some(1.0),
        breach: |_, m| (m.capture_time < 0.0).then_some(Breach { time: m.end_time, value: None }),
    },
    Criterion {
        id: "touch",
        unit: "1",
        asks: |_| "the parts touch",
        broken: "no touch",
        limit: |task| task.touch.then_some(1.0),
        breach: |_, m| (m.touch_time < 0.0).then_some(Breach { time: m.end_time, value: None }),
    },
    Criterion {
        id: "max_contact_force",
        unit: "N",
        asks: |_| "the contact force, latch excluded, is at most",
        broken: "contact force above its limit",
        limit: |task| finite(task.max_contact_force),
        breach: |task, m| beyond(task.max_contact_force, m.peak_contact_force, m.peak_contact_force_time),
    },
    Criterion {
        id: "max_interface_force",
        unit: "N",
        asks: |_| "the interface force, contact and latch together, is at most",
        broken: "interface force above its limit",
        limit: |task| finite(task.max_interface_force),
        breach: |task, m| beyond(task.max_interface_force, m.peak_interface_force, m.peak_interface_force_time),
    },
    Criterion {
        id: "max_time",
        unit: "s",
        asks: |task| if task.capture { "capture comes by" } else { "the contact, if there is any, ends by" },
        broken: "too late",
        limit: |task| finite(task.max_time),
        breach: late,
    },
    Criterion {
        id: "max_restitution",
        unit: "1",
        asks: |_| "the restitution of the first contact is at most",
        broken: "restitution above its limit",
        limit: |task| finite(task.max_restitution),
        breach: |task, m| beyond(task.max_restitution, m.restitution, m.separation_time),
    },
    Criterion {
        id: "min_insertion",
        unit: "m",
        asks: |_| "part A goes into part B by at least",
        broken: "not inserted",
        limit: inserts,
        breach: |task, m| not_inserted(task, m, None),
    },
    Criterion {
        id: "jam",
        unit: "1",
        asks: |_| "part A does not jam on its way",
        broken: "jammed: friction of opposite contacts balances the load",
        limit: |task| inserts(task).map(|_| 1.0),
        breach: |task, m| not_inserted(task, m, Some(Stand::Jammed)),
    },
    Criterion {
        id: "wedge",
        unit: "1",
        asks: |_| "part A does not wedge on its way",
        broken: "wedged: opposite contacts hold it without a load",
        limit: |task| inserts(task).map(|_| 1.0),
        breach: |task, m| not_inserted(task, m, Some(Stand::Wedged)),
    },
];

/// How a part stands that has not gone in.
#[derive(Clone, Copy, PartialEq)]
enum Stand {
    /// Opposite contacts hold it against a force or a moment.
    Jammed,
    /// Opposite contacts hold it, and nothing loads it.
    Wedged,
}

/// Shortest time that a part which jams stands \[s\].
const JAM_TIME: f64 = 0.1;

/// Load of a wedged part as a share of the force that squeezes it, at most: its push, and its moment over the insertion.
const WEDGE_LOAD: f64 = 0.1;

fn inserts(task: &Task) -> Option<f64> {
    finite(task.min_insertion)
}

/// A part that has not gone in, by how it stands at last; `None`: it does not stand.
fn not_inserted(task: &Task, m: &Metrics<f64>, stand: Option<Stand>) -> Option<Breach> {
    let is_in = m.insertion >= task.min_insertion;
    let load = m.jam_push.max(m.jam_moment / m.insertion.max(1e-3));
    let found = match load <= WEDGE_LOAD * m.jam_squeeze {
        _ if m.jam_duration < JAM_TIME => None,
        true => Some(Stand::Wedged),
        false => Some(Stand::Jammed),
    };
    (!is_in && found == stand).then_some(Breach { time: m.end_time, value: Some(m.insertion) })
}

fn finite(limit: f64) -> Option<f64> {
    limit.is_finite().then_some(limit)
}

/// A value above its limit, or no number, and when it was.
fn beyond(limit: f64, value: f64, time: f64) -> Option<Breach> {
    let holds = value <= limit;
    (!holds).then_some(Breach { time, value: Some(value) })
}

/// Capture, or the end of contact, after its time. A capture that never comes breaks its own criterion.
fn late(task: &Task, m: &Metrics<f64>) -> Option<Breach> {
    let limit = task.max_time;
    let event = if task.capture { m.capture_time } else { m.separation_time };
    if event < 0.0 {
        let still_in_contact = !task.capture && m.touch_time >= 0.0 && m.end_time > limit;
        return still_in_contact.then_some(Breach { time: m.end_time, value: None });
    }
    beyond(limit, event, event)
}

impl Criterion {
    /// The criterion of an id.
    pub fn of(id: &str) -> Option<&'static Self> {
        CRITERIA.iter().find(|criterion| criterion.id == id)
    }

    /// The criterion as a sentence with its number; none if it is not in force.
    pub fn sentence(&self, task: &Task) -> Option<String> {
        let limit = (self.limit)(task)?;
        let has_number = self.id.starts_with("max_") || self.id.starts_with("min_");
        let asks = (self.asks)(task);
        Some(if has_number { format!("{asks} {}", show(limit, self.unit)) } else { asks.to_owned() })
    }
}

/// The criteria of a task as sentences.
pub fn sentences(task: &Task) -> Vec<String> {
    CRITERIA.iter().filter_map(|criterion| criterion.sentence(task)).collect()
}

/// The criterion that a loop breaks first, and by what; none if all hold.
pub fn first_breach(task: &Task, metrics: &Metrics<f64>) -> Option<(&'static Criterion, Breach)> {
    let in_force = CRITERIA.iter().filter(|criterion| (criterion.limit)(task).is_some());
    let broken = in_force.filter_map(|criterion| Some((criterion, (criterion.breach)(task, metrics)?)));
    broken.min_by(|(_, one), (_, two)| one.time.total_cmp(&two.time))
}

/// Whether a loop meets every criterion of its task.
pub fn succeeds(task: &Task, metrics: &Metrics<f64>) -> bool {
    first_breach(task, metrics).is_none()
}

#[cfg(test)]
mod tests {
    use super::*;
    use softdock_kernels::fields::filled;

    const TASK: Task = Task { capture: true, max_contact_force: 250.0, max_time: 11.0, ..Task::OPEN };

    fn docked() -> Metrics<f64> {
        Metrics {
            touch_time: 1.0,
            capture_time: 2.0,
            peak_contact_force: 100.0,
            peak_contact_force_time: 1.5,
            end_time: 3.0,
            ..filled(-1.0)
        }
    }

    #[test]
    fn a_criterion_is_broken_by_its_own_quantity_at_its_own_time() {
        assert!(succeeds(&TASK, &docked()));
        let cases = [
            (Metrics { capture_time: -1.0, ..docked() }, "capture", 3.0, None),
            (Metrics { peak_contact_force: 251.0, ..docked() }, "max_contact_force", 1.5, Some(251.0)),
            (Metrics { peak_contact_force: f64::NAN, ..docked() }, "max_contact_force", 1.5, Some(f64::NAN)),
            (Metrics { capture_time: 11.5, end_time: 12.0, ..docked() }, "max_time", 11.5, Some(11.5)),
        ];
        for (metrics, id, time, value) in cases {
            let (criterion, breach) = first_breach(&TASK, &metrics).expect("a breach");
            assert_eq!((criterion.id, breach.time), (id, time));
            assert_eq!(breach.value.map(f64::to_bits), value.map(f64::to_bits));
        }
    }

    #[test]
    fn the_first_breach_in_time_is_the_cause() {
        let metrics = Metrics { peak_contact_force: 300.0, capture_time: -1.0, ..docked() };
        assert_eq!(first_breach(&TASK, &metrics).expect("two breaches").0.id, "max_contact_force");
    }

    #[test]
    fn a_criterion_that_is_not_written_is_not_judged() {
        let metrics = Metrics { touch_time: -1.0, peak_interface_force: 1e6, restitution: 2.0, ..docked() };
        assert!(succeeds(&TASK, &metrics), "touch, interface force and restitution are no criteria of this task");
        let asked = Task { touch: true, ..TASK };
        assert_eq!(first_breach(&asked, &metrics).expect("no touch").0.id, "touch");
        assert_eq!(sentences(&TASK).len(), 3);
    }

    #[test]
    fn part_that_does_not_go_in_is_named_by_how_it_stands() {
        let task = Task { min_insertion: 0.05, ..Task::OPEN };
        let stands = |insertion: f64, duration: f64, push: f64, moment: f64| {
            let (jam_duration, jam_push, jam_moment, jam_squeeze) = (duration, push, moment, 100.0);
            let metrics = Metrics { insertion, jam_duration, jam_push, jam_moment, jam_squeeze, ..docked() };
            first_breach(&task, &metrics).map(|(criterion, breach)| (criterion.id, breach.value))
        };
        assert_eq!(stands(0.06, 2.0, 30.0, 1.0), None, "in is in, however it stands");
        assert_eq!(stands(0.03, 0.01, 30.0, 1.0), Some(("min_insertion", Some(0.03))));
        assert_eq!(stands(0.03, 2.0, 30.0, 0.0), Some(("jam", Some(0.03))));
        assert_eq!(stands(0.03, 2.0, 1.0, 1.0), Some(("jam", Some(0.03))), "a moment is a load too");
        assert_eq!(stands(0.03, 2.0, 1.0, 0.1), Some(("wedge", Some(0.03))));
        assert_eq!(sentences(&task).len(), 3);
    }

    #[test]
    fn without_capture_the_end_of_contact_is_what_must_come_in_time() {
        let task = Task { capture: false, ..TASK };
        let bounced = Metrics { separation_time: 12.0, end_time: 13.0, ..docked() };
        assert_eq!(first_breach(&task, &bounced).expect("late").1.value, Some(12.0));
        let stuck = Metrics { separation_time: -1.0, end_time: 13.0, ..docked() };
        assert_eq!(first_breach(&task, &stuck).expect("still in contact").1.value, None);
        assert!(succeeds(&task, &Metrics { touch_time: -1.0, ..stuck }), "no contact, no end of it");
    }
}
