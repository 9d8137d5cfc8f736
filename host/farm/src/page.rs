//! Campaign data of the report page.

use crate::error::Result;
use crate::folder::ResultsFolder;
use softdock_analysis::number::{significant, with_unit};
use softdock_analysis::{Content, Fact, ReportInput, ReportedDispersion, Summary, report_page, write_report};
use softdock_campaign::Campaign;
use softdock_campaign::criteria::sentences;
use softdock_campaign::dispersion::Class;
use softdock_campaign::distribution::Distribution;
use softdock_campaign::rules;
use softdock_kernels::plant::Plant;
use softdock_results::columns;
use softdock_results::runs::input_fields;

/// Writes `report.html`.
pub(crate) fn write_page(folder: &ResultsFolder, content: &Content, summary: &Summary) -> Result<()> {
    write_report(&input(folder, content, summary), summary)?;
    Ok(())
}

/// The text of `report.html`.
pub(crate) fn page_text(folder: &ResultsFolder, content: &Content, summary: &Summary) -> Result<String> {
    Ok(report_page(&input(folder, content, summary), summary)?)
}

fn input<'a>(folder: &'a ResultsFolder, content: &'a Content, summary: &Summary) -> ReportInput<'a> {
    ReportInput {
        campaign: folder.facts(),
        content,
        plant: Some(Plant::new(folder.campaign.scenario.model.clone())),
        author_units: folder.author_units(),
        outcome_maps: &folder.campaign.outcome_maps,
        dispersions: dispersions(&folder.campaign),
        configuration: configuration(&folder.campaign, summary),
        commands: commands(folder),
        criteria: sentences(&folder.campaign.scenario.model.task),
        rules: rules::in_force(&folder.campaign.scenario.model.facility),
    }
}

fn dispersions(campaign: &Campaign) -> Vec<ReportedDispersion> {
    let fields = input_fields();
    let given = campaign.cases().is_some();
    let named = |field: usize| match campaign.key_of(field) {
        Some(key) => (key.path.clone(), key.column()),
        None => (fields[field].name.clone(), columns::input(&fields[field]).into_name()),
    };
    let row =
        |(target, column): (String, String), distribution, class: &str, source: Option<&String>| ReportedDispersion {
            target,
            column,
            distribution,
            class: class.to_owned(),
            source: source.cloned().unwrap_or_default(),
        };
    // A variable of the campaign is no column; what is derived from it is.
    let columns = campaign.dispersions.iter().filter(|dispersion| campaign.input_place(dispersion.field).is_some());
    let drawn = columns.map(|dispersion| {
        let class = match dispersion.class {
            Class::Aleatory => "aleatory",
            Class::Epistemic => "epistemic",
        };
        match &dispersion.distribution {
            Distribution::Table { values } if given => {
                let cases = format!("given, {} cases", values.len());
                row(named(dispersion.field), cases, "given", dispersion.source.as_ref())
            }
            distribution => {
                row(named(dispersion.field), in_words(distribution, dispersion.unit), class, dispersion.source.as_ref())
            }
        }
    });
    let derived = campaign
        .derived
        .iter()
        .map(|derived| row(named(derived.field), format!("= {}", derived.text), "derived", None));
    drawn.chain(derived).collect()
}

/// A distribution with its figures.
fn in_words(distribution: &Distribution, unit: &str) -> String {
    let show = |value: &f64| with_unit(*value, unit);
    match distribution {
        Distribution::Constant { value } => format!("always {}", show(value)),
        Distribution::Normal { mean, sigma } => format!("normal, mean {}, sigma {}", show(mean), show(sigma)),
        Distribution::Uniform { min, max } => format!("uniform, {} to {}", show(min), show(max)),
        Distribution::TruncatedNormal { mean, sigma, min, max } => {
            format!("normal, mean {}, sigma {}, cut at {} and {}", show(mean), show(sigma), show(min), show(max))
        }
        Distribution::LogUniform { min, max } => format!("log-uniform, {} to {}", show(min), show(max)),
        Distribution::Triangular { min, mode, max } => {
            format!("triangular, {} to {}, mode {}", show(min), show(max), show(mode))
        }
        Distribution::Beta { a, b, min, max } => {
            format!("beta, a {}, b {}, {} to {}", significant(*a, 4), significant(*b, 4), show(min), show(max))
        }
        Distribution::Weibull { scale, shape, min } => {
            format!("Weibull, scale {}, shape {}, above {}", show(scale), significant(*shape, 4), show(min))
        }
        Distribution::Arcsine { min, max } => format!("arcsine, {} to {}", show(min), show(max)),
        Distribution::Discrete { values, .. } if values.len() > 6 => {
            format!("one of {} given values, {} to {}", values.len(), show(&values[0]), show(&values[values.len() - 1]))
        }
        Distribution::Discrete { .. } => {
            let weighted = distribution.weights().into_iter();
            let each: Vec<String> = weighted
                .map(|(value, share)| format!("{} ({} %)", show(&value), significant(100.0 * share, 3)))
                .collect();
            format!("discrete, {}", each.join(", "))
        }
        Distribution::Table { values } => format!("one of {} measured values", values.len()),
    }
}

fn configuration(campaign: &Campaign, summary: &Summary) -> Vec<Fact> {
    let timing = &campaign.scenario.model.timing;
    let devices = summary.completeness.devices.iter();
    let devices: Vec<String> = devices.map(|made| format!("{} ({} shards)", made.device, made.shards)).collect();
    let limit = f64::from(timing.max_ticks) * timing.tick();
    let facts = [
        ("scenario", format!("{}: {}", campaign.scenario.id, campaign.scenario.title)),
        ("arm", format!("{} joints", campaign.scenario.joints.len())),
        ("tick of the simulation computer", with_unit(timing.tick(), "s")),
        ("substep of bodies and contact", with_unit(timing.substep, "s")),
        ("time limit of a run", with_unit(limit, "s")),
        ("delay of the frame itself, contained in the loop delay", with_unit(timing.own_delay(), "s")),
        ("made on", devices.join("; ")),
        ("blake3 of campaign, scenario and models", campaign.hash.clone()),
    ];
    facts.map(|(name, value)| Fact { name: name.to_owned(), value }).into()
}

/// Relative to the folder, so that the page contains no path of the machine.
fn commands(folder: &ResultsFolder) -> Vec<String> {
    let c = &folder.campaign;
    let variant = c.id.split_once('/').map_or(String::new(), |(_, name)| format!(" --variant {name}"));
    let model = folder.model.as_ref().map_or(String::new(), |model| format!(" --model campaign/{model}"));
    let sample = match c.cases() {
        Some(cases) => format!("--cases {}", cases.file_name()),
        None => format!("--runs {}", c.runs),
    };
    vec![
        format!("softdock run campaign/{}{variant}{model} {sample} --seed {} --out again", folder.file, c.seed),
        "softdock replay . 0".to_owned(),
        "softdock report .".to_owned(),
    ]
}
