//! Identifiability in words: the short text before the computation, and the tables of the page.

use super::ReportTable;
use crate::inference::identifiability::{BlockIdentifiability, ConfoundedPair, Determination, IdentifiabilityRow};
use crate::model::place::place;
use crate::report::wording::words_and_id;
use softdock_analysis::number::{significant, with_unit};
use softdock_kernels::effects::{GROUPS, Group, row_of};
use std::collections::BTreeSet;

/// Returns the identifiability as text: what is weakly or not determined and what is confounded by name, the rest counted.
pub fn text(blocks: &[BlockIdentifiability]) -> String {
    let mut out = String::from("Identifiability: what these motions determine of tolerances and plausible sizes\n");
    for block in blocks {
        let of = |determination: Determination| {
            let rows = block.rows.iter().filter(move |row| row.determination == determination);
            rows.map(words).collect::<BTreeSet<String>>()
        };
        let determined = block.rows.iter().filter(|row| row.determination == Determination::Determined).count();
        out += &format!("  {}: {determined} of {} determined\n", place(block.block), block.rows.len());
        for determination in [Determination::Weakly, Determination::Not] {
            let names: Vec<String> = of(determination).into_iter().collect();
            if !names.is_empty() {
                out += &format!("    {}: {}\n", determination_words(determination), names.join(", "));
            }
        }
        for (session, names) in sessions(&block.rows) {
            out += &format!("    to determine {names}: {session}\n");
        }
        if !block.confounded.is_empty() {
            let pairs: Vec<String> = block.confounded.iter().map(|pair| pair_words(block, pair)).collect();
            out += &format!("    confounded: {}\n", pairs.join(", "));
        }
    }
    out
}

/// Returns the tables of a block: all rows, and the confounded pairs.
pub fn tables(block: &BlockIdentifiability) -> Vec<ReportTable> {
    let row = |row: &IdentifiabilityRow| {
        vec![
            words(row),
            row.parameter.clone(),
            with_unit(row.plausible, row.unit),
            with_unit(row.deviation, row.unit),
            significant(row.log_odds, 3),
            determination_words(row.determination).to_owned(),
        ]
    };
    let rows = ReportTable {
        title: "Identifiability",
        head: vec![
            "parameter or effect",
            "size",
            "tolerance or plausible size",
            "standard deviation of these recordings",
            "expected log-odds",
            "determination",
        ],
        rows: block.rows.iter().map(row).collect(),
        note: "Effects that are weakly or not determined may be present at a plausible size: their absence from the answer is \
               no evidence against them."
            .to_owned(),
    };
    let pair = |pair: &ConfoundedPair| {
        let [a, b] = pair.rows.each_ref().map(|key| key_words(block, key));
        vec![a, b, significant(pair.correlation, 3)]
    };
    let confounded = ReportTable {
        title: "Confounded in these motions",
        head: vec!["parameter or effect", "with", "correlation"],
        rows: block.confounded.iter().map(pair).collect(),
        note: String::new(),
    };
    [rows, confounded].into_iter().filter(|table| !table.rows.is_empty()).collect()
}

/// Returns the sessions and motions that determine what these recordings do not: those of the plant, then group by group.
pub(super) fn motions(blocks: &[BlockIdentifiability]) -> Vec<String> {
    let rows = || blocks.iter().flat_map(|block| &block.rows);
    let line = |names: String, how: &str| format!("To determine {names}: {how}.");
    let own = sessions(rows()).into_iter().map(|(session, names)| line(names, session));
    let open = || rows().filter(|row| is_open(row) && row.session.is_none()).filter_map(|row| row.id);
    let step = |group: &Group| {
        // Each effect once, in the group that it belongs to first.
        let is_own = |id: &&'static str| row_of(id).is_some_and(|effect| effect.groups[0] == group.id);
        let names: BTreeSet<String> = open().filter(is_own).map(words_and_id).collect();
        (!names.is_empty()).then(|| line(joined(names), group.splits))
    };
    own.chain(GROUPS.iter().filter_map(step)).collect()
}

/// The plant's own sessions for what is not determined, each with the names of the effects.
fn sessions<'r>(rows: impl IntoIterator<Item = &'r IdentifiabilityRow>) -> Vec<(&'static str, String)> {
    let mut all: Vec<(&'static str, BTreeSet<String>)> = Vec::new();
    for row in rows.into_iter().filter(|row| is_open(row)) {
        let (Some(session), Some(id)) = (row.session, row.id) else { continue };
        match all.iter_mut().find(|own| own.0 == session) {
            Some(own) => own.1.extend([words_and_id(id)]),
            None => all.push((session, BTreeSet::from([words_and_id(id)]))),
        }
    }
    all.into_iter().map(|(session, names)| (session, joined(names))).collect()
}

fn is_open(row: &IdentifiabilityRow) -> bool {
    row.determination == Determination::Not
}

fn joined(names: BTreeSet<String>) -> String {
    names.into_iter().collect::<Vec<_>>().join(", ")
}

fn determination_words(determination: Determination) -> &'static str {
    match determination {
        Determination::Not => "not",
        Determination::Weakly => "weakly",
        Determination::Determined => "determined",
    }
}

fn words(row: &IdentifiabilityRow) -> String {
    match row.id.and_then(row_of) {
        // Several hypotheses of a plant may be forms of one effect.
        Some(effect) => format!("{}: {} ({})", effect.component, row.name, effect.id),
        None => format!("{} ({})", row.name, row.parameter),
    }
}

fn key_words(block: &BlockIdentifiability, key: &str) -> String {
    block.rows.iter().find(|row| row.key() == key).map_or_else(|| key.to_owned(), words)
}

fn pair_words(block: &BlockIdentifiability, pair: &ConfoundedPair) -> String {
    let [a, b] = pair.rows.each_ref().map(|key| key_words(block, key));
    format!("{a} with {b}")
}
