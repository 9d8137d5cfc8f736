//! HTML page of a diagnosis: one self-contained file that starts with the answer.

use crate::Result;
use crate::data::quality;
use crate::diagnosis::Diagnosis;
use crate::inference::identifiability::BlockIdentifiability;
use crate::inference::judge::NoiseFrom;
use crate::model::isolability;
use crate::model::place::place;
use crate::report::figures::drawings;
use crate::report::summary::{DiagnosisSummary, ReportTable, details, identifiability};
use crate::report::text;
use crate::report::wording::{residual, verdict};
use crate::verdict::answer::BlockAnswer;
use crate::verdict::judged::Judged;
use serde::Serialize;
use softdock_analysis::number::significant;
use softdock_analysis::{PageOrigin, render_page};

#[derive(Serialize)]
struct Page<'a> {
    title: &'a str,
    summary: DiagnosisSummary,
    comparison: Option<&'a str>,
    data_quality: Vec<String>,
    isolability: String,
    blocks: Vec<BlockSection>,
    numbers: Vec<(&'static str, String)>,
}

/// Section of the page about a block.
#[derive(Serialize)]
struct BlockSection {
    place: &'static str,
    name: &'static str,
    answer: &'static str,
    residual: String,
    free_run: String,
    tables: Vec<ReportTable>,
    has_after: bool,
    drawings: Vec<(String, String)>,
}

/// Renders the page as HTML; `command` is the command that reproduces it, `comparison` the verdicts of a campaign with
/// and without the extended model.
///
/// # Errors
/// A figure that cannot be drawn.
pub fn page(
    title: &str,
    diagnosis: &Diagnosis,
    judged: &[Judged],
    origin: &PageOrigin,
    comparison: Option<&str>,
) -> Result<String> {
    // Answers that need no fit of a block have no judgement.
    let of = |answer: &BlockAnswer| {
        let identified = diagnosis.identifiability.iter().find(|own| own.block == answer.block);
        section(answer, identified, judged.iter().find(|own| own.block.name == answer.block))
    };
    let mut blocks: Vec<&BlockAnswer> = diagnosis.blocks.iter().collect();
    // The most severe verdict first.
    blocks.sort_by_key(|answer| std::cmp::Reverse(answer.answer));
    let page = Page {
        title,
        summary: DiagnosisSummary::of(diagnosis),
        comparison,
        data_quality: quality::lines(&diagnosis.data_quality),
        isolability: isolability::text(&diagnosis.isolability),
        blocks: blocks.into_iter().map(of).collect::<Result<_>>()?,
        numbers: numbers(diagnosis, judged),
    };
    Ok(render_page("diagnosis.html", include_str!("page/diagnosis.html"), origin, &page)?)
}

fn section(
    answer: &BlockAnswer,
    identified: Option<&BlockIdentifiability>,
    judged: Option<&Judged>,
) -> Result<BlockSection> {
    Ok(BlockSection {
        place: place(answer.block),
        name: answer.block,
        answer: verdict(answer.answer),
        residual: residual(answer),
        free_run: answer.free_run.as_ref().map_or_else(String::new, text::free_run),
        tables: details::all(answer)
            .into_iter()
            .chain(identified.into_iter().flat_map(identifiability::tables))
            .collect(),
        has_after: judged.is_some_and(|judged| judged.found(answer).is_some()),
        drawings: judged.map_or(Ok(Vec::new()), |judged| drawings(answer, judged))?,
    })
}

/// How the noise was found and how exact the simulation is, block by block.
fn numbers(diagnosis: &Diagnosis, judged: &[Judged]) -> Vec<(&'static str, String)> {
    let of = |(judged, error): (&Judged, &f64)| {
        let judgement = &judged.judgement;
        let noise = match judgement.noise_from {
            NoiseFrom::Repeats => "repeats",
            NoiseFrom::Quiet => "contact-free stretches",
            NoiseFrom::Richest => "the residual of the richest hypothesis",
        };
        let text = format!(
            "{} whitened samples; noise from {noise}, autoregression of order {}; halving the step changes the residual by {} \
             of the noise power; detection threshold: log-odds {}",
            judgement.samples,
            judgement.noise.order(),
            significant(*error, 2),
            significant(judgement.threshold, 3)
        );
        (place(judgement.block), text)
    };
    judged.iter().zip(&diagnosis.numerical_error).map(of).collect()
}
