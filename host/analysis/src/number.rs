//! Formats of numbers in tables, on axes and in sentences.

use crate::exact::Interval;

/// Formats a number with `digits` significant digits, without trailing zeros; powers of ten below 1e-4 and from 1e6.
pub fn significant(value: f64, digits: usize) -> String {
    let text = digits_of(value, digits);
    match text.split_once('e') {
        Some((mantissa, exponent)) => format!("{}e{exponent}", trimmed(mantissa)),
        None => trimmed(&text).to_owned(),
    }
}

/// Formats as [`significant`] does, with trailing zeros: for rates and bounds, whose digits state their precision.
pub fn digits_of(value: f64, digits: usize) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "-".to_owned();
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent: i32 = scientific.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0);
    if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        scientific
    }
}

fn trimmed(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

/// Formats a unit with raised exponents (`kg m²/s`).
pub fn unit_text(unit: &str) -> String {
    unit.replace("^2", "²")
}

/// Formats a value with its unit, if it has one.
pub fn with_unit(value: f64, unit: &str) -> String {
    let number = significant(value, 4);
    if unit == "1" { number } else { format!("{number} {}", unit_text(unit)) }
}

/// Unit symbols that take a prefix.
const PREFIXED: [&str; 6] = ["rad", "s", "m", "N", "V", "A"];

/// Returns the factor and the unit, with a prefix for small values, in which a value reads without leading zeros
/// (0.0008 rad: 1000 and `mrad`). Units without a prefix, such as squares and kilograms, have the factor 1.
pub fn prefixed(value: f64, unit: &str) -> (f64, String) {
    let symbol = unit.split([' ', '/']).next().unwrap_or_default();
    let size = value.abs();
    match PREFIXED.contains(&symbol) && size > 0.0 && size < 0.1 {
        true if size < 5e-4 => (1e6, format!("\u{b5}{}", unit_text(unit))),
        true => (1e3, format!("m{}", unit_text(unit))),
        false => (1.0, if unit == "1" { String::new() } else { unit_text(unit) }),
    }
}

/// Formats a posterior probability in per cent; no evidence makes it exactly 0 or 1.
pub fn posterior(p: f64) -> String {
    match p {
        p if p > 0.999 => "> 99.9 %".to_owned(),
        p if p < 0.001 => "< 0.1 %".to_owned(),
        p => format!("{} %", significant(100.0 * p, 3)),
    }
}

/// Formats a probability in per cent, with all its digits (`99.865 %`).
pub fn percent(share: f64) -> String {
    format!("{} %", significant(share * 100.0, 8))
}

/// Formats an interval of a share: `1.2 % to 3.4 % (95 %)`.
pub fn interval(interval: &Interval) -> String {
    let end = |share: f64| digits_of(share * 100.0, 3);
    format!("{} to {} % ({} confidence)", end(interval.lo), end(interval.hi), percent(interval.confidence))
}

/// Formats an integer with thin spaces between groups of three: `20 000`.
pub fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut out = String::new();
    for (position, digit) in digits.chars().enumerate() {
        // Four digits read well without a gap.
        if digits.len() > 4 && position > 0 && (digits.len() - position).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// Name and unit of an axis; pure numbers have no unit.
pub(crate) fn axis_label(name: &str, unit: &str) -> String {
    if unit == "1" { name.to_owned() } else { format!("{name} [{}]", unit_text(unit)) }
}

/// Milliseconds for short times: factor and unit in which a quantity is shown.
pub(crate) fn shown_in(unit: &'static str, greatest: f64) -> (f64, &'static str) {
    if unit == "s" && greatest < 1.0 { (1e3, "ms") } else { (1.0, unit) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_to_significant_digits() {
        assert_eq!(
            [0.0, 250.0, 0.00012, 1.234_56e-5, -0.170_4, 2.0e6].map(|value| significant(value, 3)),
            ["0", "250", "0.00012", "1.23e-5", "-0.17", "2e6"]
        );
        assert_eq!([0.17, 13.0, 1.0e-6].map(|value| digits_of(value, 3)), ["0.170", "13.0", "1.00e-6"]);
        assert_eq!((percent(0.998_65).as_str(), with_unit(3.0, "kg m^2/s").as_str()), ("99.865 %", "3 kg m²/s"));
        assert_eq!([4_000, 20_000, 1_234_567].map(grouped), ["4000", "20\u{202f}000", "1\u{202f}234\u{202f}567"]);
    }
}
