//! Text of the stepping results for the terminal.

use super::wall_time::WallTime;
use super::{Draws, LOOPS, Nominal, REPORTED, Reported, Stepped, SteppedFacility};
use softdock_analysis::number::{significant, with_unit};
use softdock_analysis::{cause_sentence, table};
use softdock_campaign::overlap::{keys, millimetres};
use softdock_kernels::contact::overlap::Overlap;
use softdock_kernels::metrics::flags;
use softdock_results::runs::{Cause, LoopRow, OUTCOME_WORDS, Outcome};

/// Causes listed for each loop.
const MOST_CAUSES: usize = 4;

impl Stepped {
    /// All of it, facility by facility, and the wall time of the campaign.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for facility in &self.facilities {
            if let Some(name) = &facility.name {
                text += &format!("\nvariant {name}\n");
            }
            text += &start(facility);
            text += &nominal(facility);
            text += &draws(&facility.draws);
            text += &overlaps(&facility.draws);
        }
        text + &self.wall_time()
    }

    /// The expected wall time, its device and what it is extrapolated from.
    fn wall_time(&self) -> String {
        let times = || self.facilities.iter().map(|facility| &facility.wall_time);
        let sum = |part: fn(&WallTime) -> f64| times().map(part).sum::<f64>();
        let mut devices: Vec<&str> = times().map(|time| time.device.as_str()).collect();
        devices.dedup();
        let events = match sum(|time| time.contact_events) {
            0.0 => String::new(),
            seconds => format!(", contact events {}", duration(seconds)),
        };
        let mut text = format!(
            "\nexpected wall time  {} on {}\n  runs {}, repetitions in f64 {}, time histories {}{}; files not included\n",
            duration(sum(WallTime::total)),
            devices.join(" and "),
            duration(sum(|time| time.runs)),
            duration(sum(|time| time.repetitions)),
            duration(sum(|time| time.traces)),
            events,
        );
        let draws: usize = self.facilities.iter().map(|facility| facility.draws.rows.len()).sum();
        let seconds: f64 = self.facilities.iter().map(|facility| facility.draws.seconds).sum();
        text += &format!("  extrapolated from {draws} draws in {}", duration(seconds));
        text += match self.asked {
            Some(_) => "; more draws give a better estimate\n",
            None => ", one round of the CPU's lanes; `--step N` steps N draws and gives a better estimate\n",
        };
        if self.is_other_device {
            text += "  the campaign's backend may be a GPU: `--step N` steps the draws there\n";
        }
        text
    }
}

/// Whether the parts overlap at the nominal start.
fn start(facility: &SteppedFacility) -> String {
    let line = match &facility.start {
        Some(pair) if pair.depth > 0.0 => format!(
            "the parts overlap: {} by {} (more than task.max_depth, {}, is refused)",
            pair_text(pair, "in"),
            millimetres(pair.depth),
            millimetres(facility.max_depth)
        ),
        Some(pair) => {
            format!("no parts overlap; least distance {}, {}", millimetres(-pair.depth), pair_text(pair, "to"))
        }
        None => "there are no parts that could touch".to_owned(),
    };
    format!("\nnominal start\n  {line}\n")
}

/// A contact point and a solid by their keys.
fn pair_text(pair: &Overlap, word: &str) -> String {
    let [point, solid] = keys(pair);
    format!("{point} {word} {solid}")
}

/// A place in part B's frame.
fn place(pair: &Overlap) -> String {
    let tenths = |length: f64| format!("{:.1}", (length * 1e4).round() / 10.0 + 0.0);
    format!("({}, {}, {}) mm", tenths(pair.place.x), tenths(pair.place.y), tenths(pair.place.z))
}

/// The nominal case: a table of both loops, then outcome and cause.
fn nominal(facility: &SteppedFacility) -> String {
    let nominal = &facility.nominal;
    let loops = nominal.loops();
    let cells = |of: &dyn Fn(&LoopRow, Option<&Overlap>) -> String| loops.map(|(_, side, touch)| of(side, touch));
    let mut rows = vec![["".to_owned(), "space".to_owned(), "facility".to_owned()]];
    let mut push = |words: &str, [space, facility]: [String; 2]| rows.push([words.to_owned(), space, facility]);
    for reported in &REPORTED {
        push(reported.words, cells(&|side, _| value(side, reported)));
        if reported.name == "touch_time" {
            let none = || "-".to_owned();
            push("  parts", cells(&|_, touch| touch.map_or_else(none, |pair| pair_text(pair, "on"))));
            push("  place in part B's frame", cells(&|_, touch| touch.map_or_else(none, place)));
        }
    }
    push("outcome", cells(&|side, _| side.outcome.word().to_owned()));
    let mut text = "\nnominal case, stepped in f64\n".to_owned();
    table(&mut text, &rows);
    for (name, side, _) in loops {
        if let (Some(cause), true) = (&side.cause, side.outcome != Outcome::Invalid) {
            text += &format!("  {name}: {}, {}\n", side.outcome.word(), cause_sentence(cause));
        }
    }
    text + &flag_lines(nominal, facility.max_depth)
}

/// Why a run is invalid, and what else its flags report.
fn flag_lines(nominal: &Nominal, max_depth: f64) -> String {
    let mut text = String::new();
    for (bit, name, meaning) in nominal.flags(flags::INVALID) {
        let side = match *bit {
            flags::SPACE_PENETRATION => Some(&nominal.row.space),
            flags::HIL_PENETRATION => Some(&nominal.row.hil),
            _ => None,
        };
        let more = side.map_or_else(String::new, |side| {
            format!(", {} with task.max_depth {}", millimetres(side.metrics.peak_depth), millimetres(max_depth))
        });
        text += &format!("  invalid by the flag {name}: {meaning}{more}\n");
    }
    for (_, name, meaning) in nominal.flags(!flags::INVALID) {
        text += &format!("  flag {name}: {meaning}\n");
    }
    text
}

/// A metric of a loop with its time.
fn value(side: &LoopRow, reported: &Reported) -> String {
    let Some(value) = side.metrics.available(reported.name) else { return "none".to_owned() };
    let time = reported.time.filter(|_| value > 0.0).and_then(|time| side.metrics.available(time));
    let time = time.map_or_else(String::new, |time| format!(" at {}", with_unit(time, "s")));
    format!("{}{time}", with_unit(value, reported.unit))
}

/// Outcomes, causes and ranges of the draws.
fn draws(draws: &Draws) -> String {
    let mut text = format!(
        "\n{} draws spread over the campaign, stepped on {} in {}\n",
        draws.rows.len(),
        draws.device,
        duration(draws.seconds)
    );
    let mut rows = vec![[""; 5].map(str::to_owned)];
    rows[0][1..].iter_mut().zip(OUTCOME_WORDS).for_each(|(cell, word)| *cell = word.to_owned());
    for (name, side) in LOOPS.iter().zip(&draws.loops) {
        let [pass, fail, aborted, invalid] = side.outcomes.map(|count| count.to_string());
        rows.push([(*name).to_owned(), pass, fail, aborted, invalid]);
    }
    table(&mut text, &rows);
    for (name, side) in LOOPS.iter().zip(&draws.loops) {
        for (cause, outcome, count) in side.causes.iter().take(MOST_CAUSES) {
            text += &format!("  {name}: {count} {}, {}\n", outcome.word(), cause_words(cause));
        }
    }
    let mut rows = vec![["valid draws", "", "min", "median", "max"].map(str::to_owned)];
    for (at, reported) in REPORTED.iter().enumerate() {
        for (index, (name, side)) in LOOPS.iter().zip(&draws.loops).enumerate() {
            let Some(Some(range)) = side.ranges.get(at) else { continue };
            let words = if index == 0 { reported.words } else { "" };
            let [min, median, max] = range.map(|value| format!("{} {}", significant(value, 4), reported.unit));
            rows.push([words.to_owned(), (*name).to_owned(), min, median, max]);
        }
    }
    table(&mut text, &rows);
    text
}

/// What a cause is, without the numbers of a single run.
pub(super) fn cause_words(cause: &Cause) -> String {
    cause_sentence(&Cause { time: None, value: None, phase: None, ..cause.clone() })
}

/// In how many draws the parts overlap at the start.
fn overlaps(draws: &Draws) -> String {
    let of = format!("in {} of {} draws", draws.overlapping, draws.rows.len());
    match &draws.deepest {
        Some((run, pair)) if pair.depth > 0.0 => format!(
            "  parts overlap at the start {of}; deepest {}, {} (run {run})\n",
            millimetres(pair.depth),
            pair_text(pair, "in")
        ),
        _ => format!("  parts overlap at the start {of}\n"),
    }
}

/// A wall time as people read it.
fn duration(seconds: f64) -> String {
    match seconds {
        _ if seconds < 60.0 => with_unit((seconds * 1e3).round() / 1e3, "s"),
        _ if seconds < 3600.0 => format!("{} min {:.0} s", (seconds / 60.0).floor(), (seconds % 60.0).floor()),
        _ => format!("{} h {:.0} min", (seconds / 3600.0).floor(), (seconds % 3600.0 / 60.0).floor()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wall_times_are_given_in_seconds_minutes_or_hours() {
        assert_eq!([0.0, 1.25, 75.0, 7_300.0].map(duration), ["0 s", "1.25 s", "1 min 15 s", "2 h 1 min"]);
    }
}
