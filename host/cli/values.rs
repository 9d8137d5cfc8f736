//! Parsers of argument values.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

/// Parses a word of a table of words, meanings and values; `--help` lists the table.
pub(crate) fn named<T: Copy + Send + Sync + 'static>(
    table: &'static [(&'static str, &'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let words = table.iter().map(|(word, meaning, _)| PossibleValue::new(*word).help(*meaning));
    PossibleValuesParser::new(words).map(|word| {
        let (_, _, value) = table.iter().find(|(name, ..)| *name == word).expect("clap accepts words of the table");
        *value
    })
}

/// Parses a number of runs.
pub(crate) fn runs() -> clap::builder::RangedU64ValueParser<u64> {
    clap::value_parser!(u64).range(1..=1_000_000_000)
}

/// Parses a share from 0 to below 1.
pub(crate) fn share_below_one(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| (0.0..1.0).contains(number));
    number.ok_or_else(|| "write a number from 0 to below 1".to_owned())
}

/// Parses a finite number above 0.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| *number > 0.0 && number.is_finite());
    number.ok_or_else(|| "write a number above 0".to_owned())
}
