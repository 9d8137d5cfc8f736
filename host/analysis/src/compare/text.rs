//! The comparison as aligned plain text for the terminal.

use std::fmt::Write;

use crate::compare::{Band, Compared, Factor, MapAxis};
use crate::exact::Share;
use crate::number::shown_in;
use crate::number::{digits_of, interval};
use crate::terminal::table;

/// Verdicts, rates and factors of every variant.
pub fn compare_text(compared: &Compared) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{}  {}  {} variants on the same draws",
        compared.campaign,
        compared.verdict.word(),
        compared.variants.len()
    );
    out.push_str("  the verdict is the worst of the variants'; requirements on space are the same for all\n");
    out.push_str("\nfalse verdicts of the facility, and aborted sessions\n");
    let rows: Vec<[String; 6]> = compared
        .variants
        .iter()
        .map(|variant| {
            let wrong = &variant.wrong;
            [
                variant.name.clone(),
                format!("{} of {}", wrong.share.count, wrong.share.cases),
                interval(&wrong.share.interval),
                format!(
                    "{} false pass, {} false fail",
                    variant.agreement.false_pass.count, variant.agreement.false_fail.count
                ),
                format!("{} aborted of {}", variant.agreement.abort_rate.count, variant.agreement.abort_rate.cases),
                wrong.factor.as_ref().map_or("-".to_owned(), |factor| format!("{} fewer", times(factor))),
            ]
        })
        .collect();
    table(&mut out, &rows);
    let causes = compared.abort_causes();
    if !causes.is_empty() {
        out.push_str("\nrules that aborted sessions, runs\n");
        let head =
            std::iter::once("rule".to_owned()).chain(compared.variants.iter().map(|variant| variant.name.clone()));
        let rows =
            causes.into_iter().map(|(id, runs)| std::iter::once(id).chain(runs.iter().map(u64::to_string)).collect());
        table(&mut out, &std::iter::once(head.collect()).chain(rows).collect::<Vec<Vec<String>>>());
    }
    if let Some(along) = &compared.along {
        let tables: [(&str, bool, Pick); 2] = [
            ("wrong verdicts, of those that are given,", compared.any_wrong(), |band| &band.wrong.share),
            ("aborted sessions", compared.any_aborted(), |band| &band.aborted),
        ];
        for (what, _, pick) in tables.into_iter().filter(|(_, any, _)| *any) {
            band_lines(&mut out, compared, along, what, pick);
        }
    }
    out
}

/// A share of a band.
type Pick = fn(&Band) -> &Share;

fn band_lines(out: &mut String, compared: &Compared, along: &MapAxis, what: &str, pick: Pick) {
    let (factor, unit) = shown_in(along.unit, along.edges[along.edges.len() - 1]);
    let _ = writeln!(out, "\nshare of {what} along {} [{unit}]", along.parameter);
    let band = |pair: &[f64]| format!("{} to {}", digits_of(factor * pair[0], 3), digits_of(factor * pair[1], 3));
    let head = std::iter::once("band".to_owned()).chain(compared.variants.iter().map(|variant| variant.name.clone()));
    let mut rows = vec![head.collect::<Vec<_>>()];
    for (index, pair) in along.edges.windows(2).enumerate() {
        let shares = compared.variants.iter().map(|variant| percent_of(pick(&variant.bands[index])));
        rows.push(std::iter::once(band(pair)).chain(shares).collect());
    }
    table(out, &rows);
}

fn percent_of(share: &Share) -> String {
    match share.cases {
        0 => "-".to_owned(),
        cases => format!("{:.1} %", 100.0 * share.count as f64 / cases as f64),
    }
}

/// `2.10 (1.81 to 2.52) times`.
pub(crate) fn times(factor: &Factor) -> String {
    format!("{} times", with_digits(factor, 3))
}

/// `2.1 (1.8 to 2.5)`.
pub(crate) fn short_times(factor: &Factor) -> String {
    with_digits(factor, 2)
}

fn with_digits(factor: &Factor, digits: usize) -> String {
    let number = |value: f64| digits_of(value, digits);
    match (factor.value, factor.hi) {
        (Some(value), Some(hi)) => format!("{} ({} to {})", number(value), number(factor.lo), number(hi)),
        (Some(value), None) => format!("{} ({} or more)", number(value), number(factor.lo)),
        (None, _) => format!("{} or more", number(factor.lo)),
    }
}
