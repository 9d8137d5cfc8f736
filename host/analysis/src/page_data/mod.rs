//! Data of the interactive part of `report.html`: a head of JSON and a block of numbers.

mod block;
mod counts;
pub(crate) mod pass;
mod scene;
mod strata;
mod traces;
mod units;

use serde::Serialize;
use softdock_campaign::outcome_map::OutcomeMap;
use softdock_kernels::metrics::flags;
use softdock_kernels::plant::Plant;
use softdock_results::arrow_table::OtherUnit;
use softdock_results::columns::{Loop, input};
use softdock_results::runs::{AGREEMENT_WORDS, OUTCOME_WORDS, PHASE_WORDS};
use softdock_results::traces::Trace;

use crate::causes::{cause_text, cause_unit};
use crate::facts::CampaignFacts;
use crate::page_data::block::{Array, Block};
use crate::page_data::counts::{COUNTED, Curve, Histogram, Maps};
use crate::page_data::pass::{Group, NumberColumn, PageRuns};
use crate::page_data::scene::Scene;
use crate::page_data::strata::{CODES, Stratum};
use crate::page_data::traces::{ShownQuantity, ShownTrace};
use crate::page_data::units::ShownUnit;
use crate::summary::Summary;
use crate::tally::metric_column;

/// Version of the page's data.
const PAGE_SCHEMA: &str = "page/1";

/// What the page's data are made of.
pub(crate) struct PageInput<'a> {
    pub(crate) facts: &'a CampaignFacts<'a>,
    pub(crate) summary: &'a Summary,
    pub(crate) traces: &'a [Trace],
    pub(crate) author_units: &'a [OtherUnit],
    pub(crate) outcome_maps: &'a [OutcomeMap],
    pub(crate) plant: Option<&'a Plant>,
}

/// Head and block of the page.
pub(crate) struct PageData {
    /// JSON without a `<`, to stand inside a script element.
    pub(crate) head: String,
    /// Arrays of numbers, as gzip in base64.
    pub(crate) block: String,
}

#[derive(Serialize)]
struct Head<'a> {
    schema: &'static str,
    campaign: &'a str,
    runs: u64,
    shown: usize,
    strata: Vec<ShownStratum>,
    words: Vocabulary,
    flags: Vec<(u32, &'static str, &'static str)>,
    columns: Vec<ShownColumn<'a>>,
    run: Array,
    flag_bits: Array,
    /// Agreement; outcome, cause and phase in space; the same on the facility.
    codes: Vec<Array>,
    requirements: Vec<ShownRequirement<'a>>,
    counted: [(&'static str, &'static str); COUNTED.len()],
    curves: Vec<Curve>,
    maps: Maps,
    outcome_maps: Vec<ShownMap>,
    quantities: Vec<ShownQuantity>,
    traces: Vec<ShownTrace>,
    /// Runs whose time histories are in the results folder.
    traced: Vec<u64>,
    scene: Option<Scene>,
}

#[derive(Serialize)]
struct ShownStratum {
    id: &'static str,
    text: &'static str,
    total: u64,
    shown: usize,
}

#[derive(Serialize)]
struct Vocabulary {
    agreement: [&'static str; AGREEMENT_WORDS.len()],
    outcome: [&'static str; OUTCOME_WORDS.len()],
    phase: [&'static str; PHASE_WORDS.len()],
    causes: Vec<ShownCause>,
}

#[derive(Serialize)]
struct ShownCause {
    id: String,
    text: String,
    unit: &'static str,
}

#[derive(Serialize)]
struct ShownColumn<'a> {
    name: &'a str,
    label: &'a str,
    unit: &'a str,
    /// The author's unit, or one of a readable size.
    shown: Option<ShownUnit>,
    meaning: &'a str,
    group: Group,
    /// `space` or `facility`; none of an input.
    side: Option<&'static str>,
    /// Whether it is dispersed.
    dispersed: bool,
    /// Least and greatest value in the sample; none without a value.
    range: Option<[f32; 2]>,
    values: Array,
}

#[derive(Serialize)]
struct ShownRequirement<'a> {
    id: &'a str,
    text: &'a str,
    subject: &'a str,
    metric: String,
    unit: &'a str,
    at_least: Option<f64>,
    at_most: Option<f64>,
    /// Columns of the margin: space, facility.
    margin: [Option<usize>; 2],
    /// Columns of the metric.
    value: [Option<usize>; 2],
    worst: [Option<u64>; 2],
    /// Tolerance limit in space.
    tolerance: Option<f64>,
    histogram: Option<Histogram>,
}

/// A map of outcomes over two inputs.
#[derive(Serialize)]
struct ShownMap {
    title: String,
    /// Columns of the axes.
    columns: [Option<usize>; 2],
    ranges: [[f64; 2]; 2],
    logarithmic: [bool; 2],
    lines: Vec<(String, Vec<(f64, f64)>)>,
}

/// Id of a loop on the page.
fn side_word(side: Loop) -> &'static str {
    match side {
        Loop::Space => "space",
        Loop::Hil => "facility",
    }
}

/// Data of the page.
pub(crate) fn page_data(input: &PageInput, runs: &PageRuns) -> PageData {
    let mut block = Block::default();
    let chosen = traces::chosen(input.traces, input.summary);
    let columns = columns(runs, input, &mut block);
    let code =
        |at: usize, block: &mut Block| block.codes(&runs.sample.iter().map(|run| run.codes[at]).collect::<Vec<_>>());
    let cause = |id: &String| ShownCause { id: id.clone(), text: cause_text(id, None), unit: cause_unit(id) };
    let head = Head {
        schema: PAGE_SCHEMA,
        campaign: input.facts.id,
        runs: input.summary.completeness.runs_done,
        shown: runs.sample.len(),
        strata: strata(runs),
        words: Vocabulary {
            agreement: AGREEMENT_WORDS,
            outcome: OUTCOME_WORDS,
            phase: PHASE_WORDS,
            causes: runs.causes.iter().map(cause).collect(),
        },
        flags: flags::TABLE.to_vec(),
        run: block.whole(&runs.sample.iter().map(|run| run.run).collect::<Vec<_>>()),
        flag_bits: block.whole(&runs.sample.iter().map(|run| u64::from(run.flags)).collect::<Vec<_>>()),
        codes: (0..CODES).map(|at| code(at, &mut block)).collect(),
        columns,
        requirements: requirements(input, runs),
        counted: COUNTED,
        curves: runs.counts.curves(runs.dispersed(), &mut block),
        maps: runs.counts.maps(runs.dispersed(), &mut block),
        outcome_maps: input.outcome_maps.iter().map(|map| shown_map(map, runs)).collect(),
        quantities: traces::quantities(&chosen, input.facts.requirements),
        traces: chosen.iter().map(|trace| traces::shown(trace, &mut block)).collect(),
        traced: input.traces.iter().map(|trace| trace.run).filter(|run| *run < 1 << 53).collect(),
        scene: input.plant.map(scene::scene),
    };
    let head = serde_json::to_string(&head).expect("the head has string keys only");
    // Inside a script element only `<` can end it or begin a comment.
    PageData { head: head.replace('<', "\\u003c"), block: block.text() }
}

fn strata(runs: &PageRuns) -> Vec<ShownStratum> {
    let shown = |stratum: Stratum| {
        let agreement = |code: u8| softdock_results::runs::Agreement::from_word(AGREEMENT_WORDS[usize::from(code)]);
        let of = runs.sample.iter().filter(|run| agreement(run.codes[0]).map(Stratum::of) == Some(stratum));
        of.count()
    };
    let row = |stratum: Stratum| {
        let (id, text) = stratum.words();
        ShownStratum { id, text, total: runs.strata[stratum as usize], shown: shown(stratum) }
    };
    Stratum::ALL.map(row).into()
}

fn columns<'a>(runs: &'a PageRuns, input: &PageInput, block: &mut Block) -> Vec<ShownColumn<'a>> {
    let shown = |(at, own): (usize, &'a NumberColumn)| {
        let values: Vec<f32> = runs.sample.iter().map(|run| run.numbers[at]).collect();
        let finite = values.iter().copied().filter(|value| value.is_finite());
        let range = finite.fold(None, |range: Option<[f32; 2]>, value| {
            let [lo, hi] = range.unwrap_or([value; 2]);
            Some([lo.min(value), hi.max(value)])
        });
        let largest = range.map_or(0.0, |[lo, hi]| lo.abs().max(hi.abs()));
        let author = input.author_units.iter().find(|unit| unit.column == own.name);
        let unit = units::shown(&own.unit, author, f64::from(largest));
        ShownColumn {
            name: &own.name,
            label: &own.label,
            unit: &own.unit,
            shown: unit,
            meaning: &own.meaning,
            group: own.group,
            side: own.side.map(side_word),
            dispersed: at < runs.inputs,
            range,
            values: block.numbers(&values),
        }
    };
    runs.columns.iter().enumerate().map(shown).collect()
}

fn requirements<'a>(input: &PageInput<'a>, runs: &PageRuns) -> Vec<ShownRequirement<'a>> {
    let judged = input.facts.requirements.iter().zip(&input.summary.requirements);
    let histograms = runs.counts.histograms().into_iter().chain(std::iter::repeat_with(|| None));
    let shown = |((own, judged), histogram): ((&softdock_campaign::requirement::Requirement, &'a _), _)| {
        let judged: &'a crate::summary::RequirementSummary = judged;
        ShownRequirement {
            id: &judged.id,
            text: &judged.text,
            subject: &judged.subject,
            metric: own.metric.name.replace('_', " "),
            unit: &judged.unit,
            at_least: judged.at_least,
            at_most: judged.at_most,
            margin: Loop::BOTH.map(|side| runs.column(side.margin(&own.column_id()).name())),
            value: Loop::BOTH.map(|side| metric_column(side, own).and_then(|column| runs.column(column.name()))),
            worst: [&judged.loops.space, &judged.loops.facility].map(|side| side.worst.map(|worst| worst.run)),
            tolerance: judged.loops.space.tolerance_limit.map(|limit| limit.margin),
            histogram,
        }
    };
    judged.zip(histograms).map(shown).collect()
}

fn shown_map(map: &OutcomeMap, runs: &PageRuns) -> ShownMap {
    let axes = [&map.x, &map.y];
    ShownMap {
        title: map.title.clone(),
        columns: axes.map(|bands| runs.column(input(&bands.field).name())),
        ranges: axes.map(|bands| [bands.edges[0], bands.edges[bands.edges.len() - 1]]),
        logarithmic: axes.map(|bands| bands.logarithmic),
        lines: map.lines.iter().map(|line| (line.name.clone(), line.points.clone())).collect(),
    }
}
