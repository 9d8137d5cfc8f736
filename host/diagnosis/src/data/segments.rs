//! Segments of recordings with gaps: separate experiments, with free initial states and shared parameters.

use crate::data::clock::FEWEST_BETWEEN_GAPS;
use crate::data::grid::{Finding, Piece};
use std::collections::BTreeMap;

/// What separates the name of an experiment from the number of a segment.
const PART: &str = ", part ";
/// Share of the shortest repeat that segments common to all repeats have at least.
const LEAST_COMMON: f64 = 0.9;

/// Returns the name of the experiment that a segment belongs to.
pub(crate) fn whole_name(experiment: &str) -> &str {
    experiment.split(PART).next().unwrap_or(experiment)
}

/// Recording by its file, its experiment and its repeat: its pieces with their first samples.
struct Cut {
    repeat: usize,
    pieces: Vec<(usize, Piece)>,
}

/// Gives the pieces of recordings with gaps separate names: averaged as repeats, they would contradict each other.
///
/// Where segments between the gaps of all repeats retain nearly everything, all repeats are cut there and remain repeats.
/// `pieces` has the number of each piece's file.
pub(crate) fn separate_segments(pieces: Vec<(usize, Piece)>) -> (Vec<Piece>, Vec<Finding>) {
    let mut order: Vec<String> = Vec::new();
    let mut recordings: BTreeMap<String, BTreeMap<(usize, usize), Cut>> = BTreeMap::new();
    for (file, piece) in pieces {
        if !order.contains(&piece.experiment) {
            order.push(piece.experiment.clone());
        }
        let own = recordings.entry(piece.experiment.clone()).or_default().entry((piece.repeat, file));
        let cut = own.or_insert_with(|| Cut { repeat: piece.repeat, pieces: Vec::new() });
        cut.pieces.push(((piece.offset / piece.step).round() as usize, piece));
    }
    let (mut all, mut findings) = (Vec::new(), Vec::new());
    for name in order {
        let cuts: Vec<Cut> = recordings.remove(&name).into_iter().flat_map(BTreeMap::into_values).collect();
        if cuts.iter().all(|cut| cut.pieces.len() < 2) {
            all.extend(cuts.into_iter().flat_map(|cut| cut.pieces).map(|(_, piece)| piece));
            continue;
        }
        let common = common(&cuts);
        let what = match (&common, cuts.len()) {
            (_, 1) => "segments between the gaps have initial states of their own and share the parameters",
            (Some(_), _) => "all repeats are cut at the gaps of each of them: their segments are compared as repeats",
            (None, _) => "segments of repeats do not coincide: each is an experiment of its own",
        };
        findings.push(Finding { recording: name.clone(), what: what.to_owned() });
        match common.filter(|_| cuts.len() > 1) {
            Some(common) => all.extend(cuts.iter().flat_map(|cut| at(&name, cut, &common))),
            None => all.extend(apart(&name, cuts)),
        }
    }
    (all, findings)
}

/// Samples that all repeats have, without what is too short; `None` if much would be lost.
fn common(cuts: &[Cut]) -> Option<Vec<[usize; 2]>> {
    let own = |cut: &Cut| cut.pieces.iter().map(|(from, piece)| [*from, from + piece.samples()]).collect::<Vec<_>>();
    let mut common = vec![[0, usize::MAX]];
    for cut in cuts {
        let own = own(cut);
        let with = |a: &[usize; 2]| {
            let both = |b: &[usize; 2]| [a[0].max(b[0]), a[1].min(b[1])];
            let is_long = |both: &[usize; 2]| both[0] + FEWEST_BETWEEN_GAPS <= both[1];
            own.iter().map(both).filter(is_long).collect::<Vec<_>>()
        };
        common = common.iter().flat_map(with).collect();
    }
    let count = |spans: &[[usize; 2]]| spans.iter().map(|span| span[1] - span[0]).sum::<usize>();
    let least = cuts.iter().map(|cut| count(&own(cut))).min()?;
    (count(&common) as f64 >= LEAST_COMMON * least as f64).then_some(common)
}

/// The segments of a repeat at common samples.
fn at(name: &str, cut: &Cut, common: &[[usize; 2]]) -> Vec<Piece> {
    let segment = |(number, [from, to]): (usize, &[usize; 2])| {
        let holds = |(start, piece): &&(usize, Piece)| start <= from && *to <= start + piece.samples();
        let (start, piece) = cut.pieces.iter().find(holds).expect("common samples");
        let (from, to) = (from - start, to - start);
        Piece {
            experiment: format!("{name}{PART}{}", number + 1),
            start: piece.start + from as f64 * piece.step,
            offset: piece.offset + from as f64 * piece.step,
            signals: piece.signals.iter().map(|(name, values)| (name.clone(), values[from..to].to_vec())).collect(),
            ..*piece
        }
    };
    common.iter().enumerate().map(segment).collect()
}

/// Every segment as an experiment; whole recordings remain repeats of each other.
fn apart(name: &str, cuts: Vec<Cut>) -> Vec<Piece> {
    let (mut whole, is_alone) = (0, cuts.len() == 1);
    let mut all = Vec::new();
    for cut in cuts {
        let is_whole = cut.pieces.len() == 1;
        whole += usize::from(is_whole);
        let own = if is_alone { name.to_owned() } else { format!("{name}_{}", cut.repeat) };
        for (number, (_, piece)) in cut.pieces.into_iter().enumerate() {
            let (experiment, repeat) =
                if is_whole { (name.to_owned(), whole) } else { (format!("{own}{PART}{}", number + 1), 1) };
            all.push(Piece { experiment, repeat, ..piece });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of the samples of one recording, whose values are their places.
    fn pieces(file: usize, repeat: usize, spans: &[[usize; 2]]) -> Vec<(usize, Piece)> {
        let piece = |[from, to]: &[usize; 2]| {
            let offset = *from as f64 * 0.01;
            let signals = BTreeMap::from([("q".to_owned(), (*from..*to).map(|i| i as f64).collect())]);
            (file, Piece { experiment: "x".to_owned(), repeat, start: 5.0 + offset, offset, step: 0.01, signals })
        };
        spans.iter().map(piece).collect()
    }

    fn names(pieces: &[Piece]) -> Vec<(&str, usize, f64, usize)> {
        let of = |piece: &Piece| (piece.signals["q"][0], piece.samples());
        pieces.iter().map(|piece| (piece.experiment.as_str(), piece.repeat, of(piece).0, of(piece).1)).collect()
    }

    #[test]
    fn segments_of_one_recording_are_experiments() {
        let (all, findings) = separate_segments(pieces(0, 1, &[[0, 300], [310, 1000]]));
        assert_eq!(names(&all), [("x, part 1", 1, 0.0, 300), ("x, part 2", 1, 310.0, 690)]);
        assert_eq!((findings.len(), whole_name("x, part 2"), whole_name("x")), (1, "x", "x"));
    }

    #[test]
    fn repeats_are_cut_where_any_of_them_has_a_gap() {
        let cut = [pieces(0, 1, &[[0, 300], [310, 1000]]), pieces(1, 2, &[[0, 1000]])].concat();
        let expected = [
            ("x, part 1", 1, 0.0, 300),
            ("x, part 2", 1, 310.0, 690),
            ("x, part 1", 2, 0.0, 300),
            ("x, part 2", 2, 310.0, 690),
        ];
        assert_eq!(names(&separate_segments(cut).0), expected);
    }

    #[test]
    fn repeats_without_common_segments_stay_apart_and_whole_ones_stay_repeats() {
        let holes: Vec<[usize; 2]> = (0..10).map(|i| [100 * i, 100 * i + 60]).collect();
        let other: Vec<[usize; 2]> = (0..10).map(|i| [100 * i + 40 * i.min(1), 100 * i + 95]).collect();
        let cut = [pieces(0, 1, &holes), pieces(1, 2, &other), pieces(2, 3, &[[0, 1000]]), pieces(3, 4, &[[0, 1000]])];
        let (all, _) = separate_segments(cut.concat());
        assert_eq!(all.len(), 22);
        assert!(all[..20].iter().all(|piece| piece.repeat == 1 && piece.experiment.contains(", part ")));
        assert_eq!(names(&all[20..]), [("x", 1, 0.0, 1000), ("x", 2, 0.0, 1000)]);
    }

    #[test]
    fn whole_recordings_are_untouched() {
        let whole = [pieces(0, 1, &[[0, 300]]), pieces(1, 2, &[[0, 290]])].concat();
        let expected: Vec<Piece> = whole.iter().map(|piece| piece.1.clone()).collect();
        assert_eq!(separate_segments(whole), (expected, Vec::new()));
    }
}
