//! Selection of held-out data within the given recordings: later parts, or experiments by number.

use crate::data::grid::Piece;
use crate::data::segments::whole_name;
use crate::{DiagnosisError, Result};
use std::fmt;
use std::str::FromStr;

/// Rule that holds out experiments whose number modulo `divisor` is `rest`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Every {
    /// Divisor.
    pub divisor: u64,
    /// Remainder.
    pub rest: u64,
}

impl fmt::Display for Every {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.divisor, self.rest)
    }
}

impl FromStr for Every {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let parts = text.split_once(':').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
        match parts {
            Some((divisor, rest)) if divisor >= 2 && rest < divisor => Ok(Self { divisor, rest }),
            _ => {
                Err("write EVERY:REST, such as 4:1 for the numbers 1, 5, 9 and so on; EVERY at least 2, REST below it"
                    .into())
            }
        }
    }
}

impl Every {
    /// Splits recordings into held-out and training recordings.
    ///
    /// # Errors
    /// An experiment whose name ends with no number.
    pub(crate) fn split(self, pieces: Vec<Piece>) -> Result<(Vec<Piece>, Vec<Piece>)> {
        if let Some(piece) = pieces.iter().find(|piece| number(&piece.experiment).is_none()) {
            let what = format!(
                "the experiment `{}` has no number, so --hold-out-experiments cannot select it",
                piece.experiment
            );
            let remedy = "name its column \"experiment\" in [log], or name held-out recordings with --holdout";
            return Err(DiagnosisError::unfit(what, remedy));
        }
        let held = |piece: &Piece| number(&piece.experiment).is_some_and(|number| number % self.divisor == self.rest);
        Ok(pieces.into_iter().partition(held))
    }
}

/// The number that the name of an experiment ends with.
fn number(name: &str) -> Option<u64> {
    let name = whole_name(name);
    let digits = name.len() - name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    name[name.len() - digits..].parse().ok()
}

/// Time after which the last third of the longest recording lies.
pub(crate) fn last_third(pieces: &[Piece]) -> f64 {
    pieces.iter().map(|piece| piece.start + piece.samples() as f64 * piece.step * 2.0 / 3.0).fold(0.0, f64::max)
}

/// Recordings cut at a time: what lies before, and what lies after.
pub(crate) fn split(pieces: &[Piece], from: f64) -> (Vec<Piece>, Vec<Piece>) {
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for piece in pieces {
        let count = ((from - piece.start) / piece.step).ceil().clamp(0.0, piece.samples() as f64) as usize;
        before.extend(piece.between(0, count));
        after.extend(piece.between(count, piece.samples()));
    }
    (before, after)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(name: &str) -> Piece {
        Piece { experiment: name.into(), repeat: 1, start: 0.0, offset: 0.0, step: 0.01, signals: Default::default() }
    }

    #[test]
    fn experiments_are_held_out_by_number_modulo() {
        let every: Every = "4:1".parse().expect("a rest");
        let (held, rest) = every.split(["1", "2", "toss 13", "16, part 3"].map(piece).into()).expect("numbers");
        let names = |pieces: &[Piece]| pieces.iter().map(|piece| piece.experiment.clone()).collect::<Vec<_>>();
        assert_eq!(
            (names(&held), names(&rest)),
            (vec!["1".into(), "toss 13".into()], vec!["2".into(), "16, part 3".into()])
        );
        assert!(every.split(vec![piece("bounce")]).is_err());
        assert!(["4", "4:4", "1:0", "a:1", "4:-1"].iter().all(|text| text.parse::<Every>().is_err()));
    }
}
