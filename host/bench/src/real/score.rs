//! Score of the gauntlet in measured recordings: answers with and without a change, counted by set.

use crate::Result;
use crate::real::grade::{RealGrade, is_effect, named, planted_grade, same_in, untouched_grade};
use crate::real::trial::{PlantedEffect, RealRecord};
use crate::record::{RecordedAnswer, RecordedVerdict};
use crate::summary_text::shared;
use serde::Serialize;
use softdock_analysis::Share;
use softdock_analysis::number::significant;
use softdock_results::ResultFile;
use std::collections::BTreeMap;

/// Error of the size of an effect that was named right.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RealSize {
    /// The case.
    pub case: String,
    /// Id of the effect.
    pub id: String,
    /// Planted size, SI.
    pub planted: f64,
    /// Difference of the answer to the planted size over that size.
    pub relative: f64,
    /// Whether the 95 % interval contains the planted size.
    pub held: bool,
}

/// The sizes of planted effects that an answer names.
fn sizes(base: &RecordedAnswer, record: &RealRecord) -> Vec<RealSize> {
    let of = |planted: &PlantedEffect| {
        let size = planted.size?;
        let cause = named(&record.answer).find(|cause| is_effect(planted, cause))?;
        let own = cause.parameters.get(&planted.field)?;
        let before = same_in(base, cause).and_then(|own| own.parameters.get(&planted.field));
        let before = before.map_or(if planted.on_nominal { own.nominal } else { 0.0 }, |before| before.value);
        let (relative, truth) = ((own.value - before) / size - 1.0, before + size);
        let held = (own.lo..=own.hi).contains(&truth);
        Some(RealSize { case: record.case.clone(), id: planted.id.clone(), planted: size, relative, held })
    };
    record.planted.iter().filter_map(of).collect()
}

/// Graded case.
#[derive(Clone, Debug, Serialize)]
pub struct GradedRealCase {
    /// The case.
    pub case: String,
    /// Grade.
    pub grade: RealGrade,
    /// Named or listed effects, with block and verdict of the answer, in words.
    pub answer: String,
}

/// Row of the score: a set.
#[derive(Clone, Debug, Serialize)]
pub struct RealRow {
    /// The set.
    pub set: String,
    /// Answer for the unchanged set.
    pub base: String,
    /// Number of planted cases by grade, in the order of [`RealGrade::ALL`].
    pub planted: [usize; RealGrade::ALL.len()],
    /// Number of untouched cases with the answer of the unchanged set, and of all.
    pub untouched: [usize; 2],
    /// Median relative error of sizes.
    pub size_error: Option<f64>,
    /// Number of intervals that contain the planted size, and of all.
    pub held: [usize; 2],
    /// Computing time of a diagnosis, mean \[s\].
    pub seconds: f64,
}

/// Score of the gauntlet in measured recordings.
#[derive(Clone, Debug, Serialize)]
pub struct RealScore {
    /// Planted effects that were named or listed.
    pub right: Share,
    /// Wrong names.
    pub wrong: Share,
    /// Untouched cases with the answer of the unchanged set.
    pub unchanged: Share,
    /// Rows by set.
    pub rows: Vec<RealRow>,
    /// Sizes of effects that were named.
    pub sizes: Vec<RealSize>,
    /// Cases that are neither right nor listed.
    pub others: Vec<GradedRealCase>,
}

/// Least share of right names or lists, and greatest share of wrong names.
pub const LEAST_RIGHT: f64 = 0.75;
/// Greatest share of wrong names.
pub const MOST_WRONG: f64 = 0.03;

impl RealScore {
    /// Returns whether the demands are met.
    pub fn is_met(&self) -> bool {
        let share = |share: &Share| share.count as f64 / (share.cases as f64).max(1.0);
        let unchanged = self.unchanged.count == self.unchanged.cases;
        share(&self.right) >= LEAST_RIGHT && share(&self.wrong) <= MOST_WRONG && unchanged
    }
}

/// Scores finished cases; those of a set whose unchanged answer is missing are not counted.
pub fn score(records: &[RealRecord]) -> RealScore {
    let bases: BTreeMap<&str, &RealRecord> = records
        .iter()
        .filter(|record| record.case == format!("{}.base", record.set))
        .map(|record| (record.set.as_str(), record))
        .collect();
    let mut rows: BTreeMap<&str, RealRow> = BTreeMap::new();
    let (mut all_sizes, mut others) = (Vec::new(), Vec::new());
    for record in records {
        let Some(base) = bases.get(record.set.as_str()) else { continue };
        let row = rows.entry(&record.set).or_insert_with(|| RealRow {
            set: record.set.clone(),
            base: words(&base.answer),
            planted: [0; RealGrade::ALL.len()],
            untouched: [0; 2],
            size_error: None,
            held: [0; 2],
            seconds: 0.0,
        });
        row.seconds += record.seconds;
        if record.case == base.case {
            continue;
        }
        let is_planted = !record.planted.is_empty();
        let grade = match is_planted {
            true => planted_grade(&base.answer, record),
            false => untouched_grade(&base.answer, &record.answer),
        };
        if is_planted {
            row.planted[grade as usize] += 1;
            all_sizes.extend(sizes(&base.answer, record));
        } else {
            row.untouched[0] += usize::from(grade == RealGrade::Right);
            row.untouched[1] += 1;
        }
        if !matches!(grade, RealGrade::Right | RealGrade::Listed) {
            others.push(GradedRealCase { case: record.case.clone(), grade, answer: words(&record.answer) });
        }
    }
    let mut rows: Vec<RealRow> = rows.into_values().collect();
    for row in &mut rows {
        let own: Vec<&RealSize> =
            all_sizes.iter().filter(|size| size.case.starts_with(&format!("{}.", row.set))).collect();
        row.size_error = crate::score::median(own.iter().map(|size| size.relative.abs()));
        row.held = [own.iter().filter(|size| size.held).count(), own.len()];
        row.seconds /= (row.planted.iter().sum::<usize>() + row.untouched[1] + 1) as f64;
    }
    let planted = |grades: &[RealGrade]| {
        let count: usize = rows.iter().flat_map(|row| grades.iter().map(|grade| row.planted[*grade as usize])).sum();
        Share::of(count as u64, rows.iter().flat_map(|row| row.planted).sum::<usize>() as u64)
    };
    let untouched = |place: usize| rows.iter().map(|row| row.untouched[place]).sum::<usize>() as u64;
    RealScore {
        right: planted(&[RealGrade::Right, RealGrade::Listed]),
        wrong: planted(&[RealGrade::Wrong]),
        unchanged: Share::of(untouched(0), untouched(1)),
        rows,
        sizes: all_sizes,
        others,
    }
}

/// An answer in words: verdicts of the blocks and causes.
fn words(answer: &RecordedAnswer) -> String {
    if let Some(refusal) = &answer.refusal {
        return format!("refused: {refusal}");
    }
    let block = |(block, verdict): &(String, RecordedVerdict)| {
        let causes: Vec<&str> =
            answer.effects.iter().filter(|cause| cause.block == *block).map(|cause| cause.id.as_str()).collect();
        let code = block.split(' ').next().unwrap_or("");
        let verdict = serde_json::to_value(verdict).expect("a word");
        format!("{code} {} {}", verdict.as_str().unwrap_or(""), causes.join(", ")).trim_end().to_owned()
    };
    answer.blocks.iter().map(block).collect::<Vec<_>>().join("; ")
}

/// Returns the score as text for the terminal.
pub fn text(score: &RealScore) -> String {
    let mut out = String::new();
    let demands = [
        ("right name, or the right one in a list: at least 75 %", &score.right),
        ("wrong names: at most 3 %", &score.wrong),
        ("the same answer where nothing was changed but the form: 100 %", &score.unchanged),
    ];
    for (demand, share) in demands {
        out += &format!("{demand}: {}\n", shared(share));
    }
    out += &format!("\n{:<14} {:>26}", "set", "same answer, form changed");
    RealGrade::ALL.iter().for_each(|(_, word)| out += &format!(" {word:>9}"));
    out += &format!(" {:>10} {:>10} {:>8}\n", "size error", "intervals", "s");
    for row in &score.rows {
        out += &format!("{:<14} {:>26}", row.set, format!("{} of {}", row.untouched[0], row.untouched[1]));
        row.planted.iter().for_each(|count| out += &format!(" {count:>9}"));
        let error = row.size_error.map_or("-".to_owned(), |error| format!("{} %", significant(100.0 * error, 2)));
        let held = format!("{} of {}", row.held[0], row.held[1]);
        out += &format!(" {error:>10} {held:>10} {:>8}\n", significant(row.seconds, 2));
    }
    out += "\nUnchanged sets\n";
    score.rows.iter().for_each(|row| out += &format!("  {}: {}\n", row.set, row.base));
    if !score.others.is_empty() {
        out += "\nOther answers\n";
        for case in &score.others {
            let word = RealGrade::ALL.iter().find(|(grade, _)| *grade == case.grade).map_or("", |(_, word)| word);
            out += &format!("  {word:<9} {}: {}\n", case.case, case.answer);
        }
    }
    out
}

/// Returns the files of a score.
///
/// # Errors
/// None but those of a file.
pub fn files(score: &RealScore) -> Result<Vec<ResultFile>> {
    let figures = serde_json::to_string_pretty(score).expect("a score has string keys") + "\n";
    Ok(vec![ResultFile::new("real_score.json", figures), ResultFile::new("real_score.txt", text(score))])
}
