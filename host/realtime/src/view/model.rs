//! Values of the operator's view, accumulated from the cycles.

use crate::drive::feed::{Notice, Sample};
use crate::log::codes::LimitKind;
use crate::log::record::{LimitFlags, TOOL};
use crate::time::Nanos;
use std::collections::VecDeque;

/// Limits that stop the session; from the facility file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budgets {
    /// Force \[N\].
    pub force_n: f64,
    /// Energy injected by the facility \[J\].
    pub energy_j: f64,
}

/// Number of cycles behind the percentiles: the last ten seconds at 1 kHz.
const WINDOW: usize = 10_000;
/// Time of one bar of the force history; a bar shows its greatest force.
const BAR: Nanos = Nanos::from_millis(100);
/// Number of bars: the columns of a wide terminal.
const BARS: usize = 400;

/// Median, 99th percentile and maximum of a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Percentiles {
    /// Median of the last ten seconds.
    pub p50: Nanos,
    /// 99th percentile of the last ten seconds.
    pub p99: Nanos,
    /// Greatest since the start.
    pub max: Nanos,
}

/// The newest values of a time, and the greatest of all.
#[derive(Clone, Debug, Default)]
struct Times {
    newest: VecDeque<i64>,
    max: i64,
}

impl Times {
    fn push(&mut self, time: Nanos) {
        if self.newest.len() == WINDOW {
            self.newest.pop_front();
        }
        self.newest.push_back(time.0);
        self.max = self.max.max(time.0);
    }

    fn percentiles(&self) -> Percentiles {
        let mut sorted: Vec<i64> = self.newest.iter().copied().collect();
        sorted.sort_unstable();
        // Nearest rank.
        let at = |share: f64| {
            let rank = (share * sorted.len() as f64).ceil() as usize;
            Nanos(sorted.get(rank.max(1) - 1).copied().unwrap_or(0))
        };
        Percentiles { p50: at(0.5), p99: at(0.99), max: Nanos(self.max) }
    }
}

/// State of the view.
#[derive(Clone, Debug)]
pub struct View {
    /// Limits that stop the session.
    pub budgets: Budgets,
    /// The newest cycle.
    pub newest: Sample,
    /// The newest notice.
    pub notice: Notice,
    /// Number of stop requests.
    pub stops: u32,
    /// Whether the session is over.
    pub over: bool,
    /// Greatest measured force since the start \[N\].
    pub peak_measured_force: f64,
    lateness: [Times; 2],
    round_trip: [Times; 2],
    bars: VecDeque<f64>,
    bar_began: Nanos,
    met: [LimitFlags; 2],
}

impl View {
    /// Creates the view before the first cycle.
    pub fn new(budgets: Budgets) -> Self {
        Self {
            budgets,
            newest: Sample::default(),
            notice: Notice::default(),
            stops: 0,
            over: false,
            peak_measured_force: 0.0,
            lateness: Default::default(),
            round_trip: Default::default(),
            bars: VecDeque::from([0.0]),
            bar_began: Nanos(0),
            met: Default::default(),
        }
    }

    /// Takes a cycle's sample.
    pub fn take(&mut self, sample: &Sample) {
        self.newest = *sample;
        self.peak_measured_force = self.peak_measured_force.max(sample.force);
        if sample.time.0.saturating_sub(self.bar_began.0) >= BAR.0 {
            self.bar_began = sample.time;
            if self.bars.len() == BARS {
                self.bars.pop_front();
            }
            self.bars.push_back(0.0);
        }
        if let Some(bar) = self.bars.back_mut() {
            *bar = bar.max(sample.force);
        }
        for (place, robot) in sample.robots.iter().enumerate().filter(|(_, robot)| robot.present) {
            self.lateness[place].push(robot.lateness);
            self.round_trip[place].push(robot.round_trip);
            self.met[place].0 |= robot.limits.0;
        }
    }

    /// Takes the state of the controls.
    pub(super) fn set_controls(&mut self, stops: u32, over: bool) {
        self.stops = stops;
        self.over = over;
    }

    /// Returns the lateness of our cycles for robot 0 or 1.
    pub fn lateness(&self, robot: usize) -> Percentiles {
        self.lateness[robot].percentiles()
    }

    /// Returns the times from a report of robot 0 or 1 to our answer.
    pub fn round_trip(&self, robot: usize) -> Percentiles {
        self.round_trip[robot].percentiles()
    }

    /// Returns the greatest forces \[N\] of the last intervals, the newest last, at most this many.
    pub fn force_history(&self, bars: usize) -> impl Iterator<Item = f64> {
        self.bars.iter().skip(self.bars.len().saturating_sub(bars)).copied()
    }

    /// Returns the kinds of limits that clamped robot 0 or 1 on an axis (or the [`TOOL`]) since the start.
    pub fn met(&self, robot: usize, axis: usize) -> impl Iterator<Item = LimitKind> {
        let met = self.met[robot];
        LimitKind::ALL.iter().copied().filter(move |kind| met.has(*kind, axis.min(TOOL)))
    }
}
