//! Numbers as people read them in tables, on axes and in sentences.

use crate::exact::Interval;

/// A number with so many significant digits, without trailing zeros; powers of ten below 1e-4 and from 1e6.
pub fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".to_owned() } else { "-".to_owned() };
    }
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        trimmed(&format!("{value:.decimals$}"))
    } else {
        format!("{}e{exponent}", trimmed(mantissa))
    }
}

fn trimmed(text: &str) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text.to_owned() }
}

/// A value with its unit; pure numbers stay alone.
pub fn with_unit(value: f64, unit: &str) -> String {
    let number = significant(value, 4);
    if unit == "1" { number } else { format!("{number} {unit}") }
}

/// A probability in per cent, with all its digits (`99.865 %`).
pub fn percent(share: f64) -> String {
    format!("{} %", significant(share * 100.0, 8))
}

/// An interval of a share: `1.2 % to 3.4 % (95 %)`.
pub fn interval(interval: &Interval) -> String {
    let end = |share: f64| significant(share * 100.0, 3);
    format!("{} to {} % ({} confidence)", end(interval.lo), end(interval.hi), percent(interval.confidence))
}

/// A whole number with thin groups of three: `20 000`.
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
