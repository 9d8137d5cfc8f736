//! Clock of a recording: usual step, jitter and gaps of each signal, and the signals at equal steps between the gaps.

use std::collections::BTreeMap;

/// A pause of a signal longer than this many of its steps is a gap; a shorter one is bridged.
const LONGEST_GAP: f64 = 3.5;
/// Steps that differ from the usual one by this share of it are uneven.
const JITTER: f64 = 0.02;
/// Signals whose steps differ by this share have different rates.
const OTHER_RATE: f64 = 0.02;
/// Share of missing cells above which a signal has instants of its own.
const SPARSE: f64 = 0.3;
/// Fewest samples of a segment that gaps leave.
pub const FEWEST_BETWEEN_GAPS: usize = 50;

/// Signals by name.
pub type SignalTable = BTreeMap<String, Vec<f64>>;

/// Clock of one signal: the rows in which it has a number.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignalClock {
    /// Rows with a number, cut at gaps.
    pub spans: Vec<Vec<usize>>,
    /// Usual step \[s\].
    pub step: f64,
    /// Number of steps, without gaps.
    pub steps: usize,
    /// Number of steps that differ from the usual one by more than 2 %.
    pub uneven: usize,
    /// Standard deviation of the steps from the nearest multiple of the usual one \[s\].
    pub jitter: f64,
    /// Number of rows without a number.
    pub missing: usize,
}

/// Stretch of a recording without gaps, at equal steps.
#[derive(Clone, Debug, PartialEq)]
pub struct EvenSegment {
    /// Clock at the first sample \[s\].
    pub start: f64,
    /// Signals by name.
    pub signals: SignalTable,
}

/// Recording at equal steps.
#[derive(Clone, Debug, PartialEq)]
pub struct EvenRecording {
    /// Sampling period \[s\].
    pub step: f64,
    /// Segments between the gaps, on one grid.
    pub segments: Vec<EvenSegment>,
    /// Clock of each signal as recorded.
    pub clocks: BTreeMap<String, SignalClock>,
    /// Statements about everything that was changed.
    pub notes: Vec<String>,
}

/// Reason why a clock cannot be used, and the remedy.
pub type ClockProblem = (String, String);

impl SignalClock {
    /// Determines the clock of a signal, whose rows are ordered by time; `None` with fewer than two numbers.
    fn of(time: &[f64], values: &[f64]) -> Option<Self> {
        let rows: Vec<usize> = (0..time.len()).filter(|row| values[*row].is_finite()).collect();
        let steps: Vec<f64> = rows.windows(2).map(|pair| time[pair[1]] - time[pair[0]]).collect();
        let usual = *sorted(&steps).get(steps.len() / 2)?;
        let regular: Vec<f64> = steps.iter().copied().filter(|step| *step < LONGEST_GAP * usual).collect();
        // A missing row makes a step of two.
        let multiple = |step: f64| (step / usual).round();
        let step = regular.iter().sum::<f64>() / regular.iter().map(|step| multiple(*step)).sum::<f64>();
        let off = |own: &f64| own - multiple(*own) * step;
        let jitter = (regular.iter().map(|own| off(own).powi(2)).sum::<f64>() / regular.len() as f64).sqrt();
        let mut clock = Self {
            spans: Vec::new(),
            step,
            steps: regular.len(),
            uneven: regular.iter().filter(|own| (*own - step).abs() > JITTER * step).count(),
            jitter,
            missing: time.len() - rows.len(),
        };
        for row in rows {
            match clock.spans.last_mut() {
                Some(span) if time[row] - time[span[span.len() - 1]] < LONGEST_GAP * step => span.push(row),
                _ => clock.spans.push(vec![row]),
            }
        }
        Some(clock)
    }

    /// Whether the signal has instants of its own: most rows belong to others.
    fn is_sparse(&self, rows: usize) -> bool {
        self.missing as f64 > SPARSE * rows as f64
    }
}

impl EvenRecording {
    /// Resamples signals to equal steps: those of the slowest signal, on one grid, cut where any signal pauses. Each
    /// signal is interpolated between its own numbers.
    ///
    /// # Errors
    /// Fewer than `fewest` rows, a time that does not increase, a signal with fewer than `fewest` numbers.
    pub fn of(time: &[f64], signals: &SignalTable, fewest: usize) -> Result<Self, ClockProblem> {
        if time.len() < fewest {
            let what = format!("{} rows are too few to separate effects from noise", time.len());
            return Err((what, format!("record at least {fewest} rows, better several seconds")));
        }
        let backward = |pair: &[f64]| pair[0].is_nan() || pair[1].is_nan() || pair[1] <= pair[0];
        if let Some(row) = time.windows(2).position(backward) {
            let what = format!("the time does not increase after row {}: {} s", row + 1, time[row]);
            return Err((what, "sort the rows by time and remove duplicates".to_owned()));
        }
        let mut clocks = BTreeMap::new();
        for (name, values) in signals {
            let clock = SignalClock::of(time, values).filter(|clock| time.len() - clock.missing >= fewest);
            let few = values.iter().filter(|value| value.is_finite()).count();
            let what = format!("the signal `{name}` has {few} numbers in {} rows, too few", time.len());
            let clock = clock.ok_or_else(|| (what, format!("record at least {fewest} numbers of each signal")))?;
            clocks.insert(name.clone(), clock);
        }
        let step = clocks.values().map(|clock| clock.step).fold(0.0, f64::max);
        let mut even = Self { step, segments: Vec::new(), notes: Vec::new(), clocks };
        even.note_rates(time.len());
        even.cut(time, signals, fewest);
        Ok(even)
    }

    /// Whether any signal has instants of its own.
    fn is_mixed(&self, rows: usize) -> bool {
        self.clocks.values().any(|clock| clock.is_sparse(rows))
    }

    fn note_rates(&mut self, rows: usize) {
        let Some(worst) = self.clocks.values().max_by_key(|clock| clock.uneven) else { return };
        if worst.uneven > 0 {
            self.notes.push(format!(
                "{} of {} time steps differ from {:.6} s by more than 2 %: resampled to equal steps",
                worst.uneven, worst.steps, worst.step
            ));
        }
        if self.is_mixed(rows) {
            let mut rates: BTreeMap<u64, Vec<&str>> = BTreeMap::new();
            for (name, clock) in &self.clocks {
                let known = rates.keys().copied().find(|other| {
                    let other = f64::from_bits(*other);
                    (other - clock.step).abs() < OTHER_RATE * other
                });
                rates.entry(known.unwrap_or(clock.step.to_bits())).or_default().push(name);
            }
            let of = |(step, names): (&u64, &Vec<&str>)| {
                let more = if names.len() > 3 { format!(" and {} more", names.len() - 3) } else { String::new() };
                let shown = names[..names.len().min(3)].join("`, `");
                format!("`{shown}`{more} at {:.4} Hz", f64::from_bits(*step).recip())
            };
            let rates: Vec<String> = rates.iter().map(of).collect();
            let slowest = self.step.recip();
            self.notes.push(format!(
                "signals have rates or instants of their own ({}): resampled to {slowest:.4} Hz",
                rates.join("; ")
            ));
            return;
        }
        let most = self.clocks.values().map(|clock| clock.missing).max().unwrap_or(0);
        if most > 0 {
            self.notes.push(format!("{most} of {rows} rows have missing numbers and are treated as gaps"));
        }
    }

    /// Cuts the recording into segments in which every signal goes on.
    fn cut(&mut self, time: &[f64], signals: &SignalTable, fewest: usize) {
        let slack = if self.is_mixed(time.len()) { 0.01 } else { 0.5 };
        let Some(intervals) = self.common(time) else { return };
        let gaps = intervals.len() - 1;
        if gaps > 0 {
            self.notes.push(format!("cut at {gaps} gaps into {} pieces", intervals.len()));
        }
        let fewest = fewest.min(if gaps > 0 { FEWEST_BETWEEN_GAPS } else { fewest });
        let origin = self.origin(time, signals, intervals[0][0]);
        for [from, to] in intervals {
            // Instants of one grid, so that repeats are comparable after a gap, too.
            let first = ((from - origin) / self.step - 0.01).ceil();
            let last = ((to - origin) / self.step + slack).floor();
            let (count, start) = ((last - first) as usize + 1, origin + first * self.step);
            if last < first || count < fewest {
                let count = if last < first { 0 } else { count };
                self.notes.push(format!("{count} samples from {from:.3} s on are too few and were ignored"));
                continue;
            }
            let even = |(name, values): (&String, &Vec<f64>)| {
                let holds = |span: &&Vec<usize>| time[span[0]] <= from && to <= time[span[span.len() - 1]];
                let span = self.clocks[name].spans.iter().find(holds).expect("a common interval");
                (name.clone(), resampled(time, values, span, start, self.step, count))
            };
            self.segments.push(EvenSegment { start, signals: signals.iter().map(even).collect() });
        }
    }

    /// Instant of the grid at or after `from`: one of the roughest signal where signals have instants of their own. A
    /// position is interpolated better than a torque that jumps.
    fn origin(&self, time: &[f64], signals: &SignalTable, from: f64) -> f64 {
        if !self.is_mixed(time.len()) {
            return from;
        }
        let rough = |name: &&String| roughness(&signals[*name]);
        let roughest = self.clocks.keys().max_by(|a, b| rough(a).total_cmp(&rough(b)));
        let instants = roughest
            .and_then(|name| self.clocks[name].spans.iter().flatten().map(|row| time[*row]).find(|t| *t >= from));
        instants.unwrap_or(from)
    }

    /// Intervals of time in which every signal goes on; `None` if there are none.
    fn common(&self, time: &[f64]) -> Option<Vec<[f64; 2]>> {
        let mut common = vec![[f64::NEG_INFINITY, f64::INFINITY]];
        for clock in self.clocks.values() {
            let ends = |span: &Vec<usize>| [time[span[0]], time[span[span.len() - 1]]];
            let own: Vec<[f64; 2]> = clock.spans.iter().map(ends).collect();
            let with = |a: &[f64; 2]| {
                let both = |b: &[f64; 2]| [a[0].max(b[0]), a[1].min(b[1])];
                own.iter().map(both).filter(|both| both[0] < both[1]).collect::<Vec<_>>()
            };
            common = common.iter().flat_map(with).collect();
        }
        Some(common).filter(|common| common.first().is_some_and(|first| first[0].is_finite()))
    }
}

/// Returns the mean square of the second differences of a signal's numbers relative to their variance.
fn roughness(values: &[f64]) -> f64 {
    let numbers: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
    let bends: f64 = numbers.windows(3).map(|near| (near[0] - 2.0 * near[1] + near[2]).powi(2)).sum();
    let spread: f64 = numbers.iter().map(|value| (value - mean).powi(2)).sum();
    if spread > 0.0 { bends / spread } else { 0.0 }
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values
}

/// A signal at equal steps from `start` on: cubic between its neighbours (Catmull-Rom for unequal steps).
fn resampled(time: &[f64], values: &[f64], rows: &[usize], start: f64, step: f64, count: usize) -> Vec<f64> {
    if rows.len() < 2 {
        return vec![values[rows[0]]; count];
    }
    let last = rows.len() - 1;
    let slope = |k: usize| {
        let (before, after) = (rows[k.saturating_sub(1)], rows[(k + 1).min(last)]);
        (values[after] - values[before]) / (time[after] - time[before])
    };
    let mut k = 0;
    let at = |i: usize| {
        let t = start + i as f64 * step;
        while k + 2 < rows.len() && time[rows[k + 1]] <= t {
            k += 1;
        }
        let (a, b) = (rows[k], rows[k + 1]);
        let width = time[b] - time[a];
        let u = ((t - time[a]) / width).clamp(0.0, 1.0);
        let (p, q) = (slope(k) * width, slope(k + 1) * width);
        let way = values[b] - values[a];
        values[a] + u * (p + u * (3.0 * way - 2.0 * p - q + u * (p + q - 2.0 * way)))
    };
    (0..count).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sine(time: &[f64]) -> Vec<f64> {
        time.iter().map(|t| (3.0 * t).sin()).collect()
    }

    fn off(segment: &EvenSegment, name: &str, step: f64) -> f64 {
        let expected = |i: usize| (3.0 * (segment.start + i as f64 * step)).sin();
        segment.signals[name].iter().enumerate().map(|(i, value)| (value - expected(i)).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn gaps_leave_segments_on_one_grid_without_loss() {
        let time: Vec<f64> = (0..1000).filter(|i| i % 100 < 94).map(|i| f64::from(i) * 0.01).collect();
        let signals = SignalTable::from([("q".to_owned(), sine(&time))]);
        let even = EvenRecording::of(&time, &signals, 200).expect("even");
        let counts: Vec<usize> = even.segments.iter().map(|segment| segment.signals["q"].len()).collect();
        assert_eq!(counts, [94; 10]);
        assert!(even.segments.iter().all(|segment| off(segment, "q", even.step) < 1e-4), "{:?}", even.notes);
        assert!((even.step - 0.01).abs() < 1e-12 && even.notes.iter().any(|note| note.contains("9 gaps")));
    }

    #[test]
    fn signals_at_two_rates_are_resampled_to_the_slower_one() {
        let time: Vec<f64> = (0..2000).map(|i| f64::from(i) * 0.002 + if i % 4 == 1 { 1e-4 } else { 0.0 }).collect();
        let only = |rest: usize, every: usize| {
            let value = |(row, value): (usize, f64)| if row % every == rest { value } else { f64::NAN };
            sine(&time).into_iter().enumerate().map(value).collect::<Vec<f64>>()
        };
        let signals = SignalTable::from([("force".to_owned(), only(0, 2)), ("pose".to_owned(), only(1, 4))]);
        let even = EvenRecording::of(&time, &signals, 200).expect("even");
        assert!((even.step - 0.008).abs() < 1e-9 && even.segments.len() == 1, "{} {:?}", even.step, even.notes);
        assert!(["force", "pose"].iter().all(|name| off(&even.segments[0], name, even.step) < 1e-4));
        assert!(even.notes.iter().any(|note| note.contains("250") && note.contains("125")), "{:?}", even.notes);
    }

    #[test]
    fn jitter_and_single_missing_rows_do_not_change_the_step() {
        let stamp = |i: u32| f64::from(i) * 0.01 + 0.002 * (f64::from(i) * 12.9898).sin();
        let time: Vec<f64> = (0..1000).filter(|i| i % 90 != 7).map(stamp).collect();
        let even = EvenRecording::of(&time, &SignalTable::from([("q".to_owned(), sine(&time))]), 200).expect("even");
        assert!((even.step - 0.01).abs() < 1e-5 && even.segments.len() == 1, "{}", even.step);
        assert!(off(&even.segments[0], "q", even.step) < 1e-3);
    }
}
