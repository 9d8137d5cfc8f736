//! Variants: the same draws on facilities that differ in stated keys of the scenario.

use crate::campaign::Campaign;
use crate::check::Checker;
use crate::derived;
use crate::idle::{self, IdleTarget};
use crate::overlay::Overlay;
use crate::problem::Problems;
use crate::scenario::Scenario;
use crate::written::campaign::{CampaignFile, DerivedTable};
use crate::written::compare::VariantTable;
use softdock_kernels::fields::Field;

/// What a results folder holds besides variants.
const TAKEN: [&str; 5] = ["campaign", "partial", "runs", "traces", "replays"];

/// One facility, and the campaign that is run on it.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Name, also of its folder in the campaign's results folder.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// The keys of the scenario that it replaces, each with what stands in its place.
    pub changes: Vec<(String, String)>,
    /// The campaign on this facility: the same draws, without variants of its own.
    pub campaign: Campaign,
}

/// Reads the variants of a campaign that is sound in itself; `fields` are the parameters and its variables.
pub(crate) fn read(c: &mut Checker, file: &CampaignFile, whole: &Campaign, fields: &[Field]) -> Vec<Variant> {
    let mut variants: Vec<Variant> = Vec::new();
    for (index, table) in file.variant.iter().enumerate() {
        let noted = c.problems.len();
        let name = c.name(&table.name);
        let taken = TAKEN.contains(&name.to_lowercase().as_str());
        if taken || variants.iter().any(|other| other.name.eq_ignore_ascii_case(&name)) {
            let message = if taken { "the results folder holds this name already" } else { "two variants of one name" };
            c.refuse(&table.name.span, message, "choose another name: it is that of the variant's results folder");
        }
        check_keys(c, table);
        if c.problems.len() > noted {
            continue;
        }
        match scenario(c, table, index, &whole.scenario) {
            Ok(scenario) => {
                variants.push(variant(c, file, table, index, Campaign { scenario, ..whole.clone() }, fields))
            }
            Err(problems) => c.problems.extend(problems),
        }
    }
    variants
}

/// Refuses what would change space: what both loops share must be the same for all.
fn check_keys(c: &mut Checker, table: &VariantTable) {
    for key in &table.set.0 {
        if !key.value.starts_with("facility.") || key.value.ends_with('.') || key.value.contains("..") {
            let message = format!("a variant replaces keys of the facility, and `{}` is none", key.value);
            let remedy = "write a key of the scenario's [facility] in quotes: \"facility.loop_delay\" = \"8 ms\"; what \
                          space shares is dispersed, or stands in a scenario of its own";
            c.refuse(&key.span, message, remedy);
        }
    }
}

fn scenario(c: &Checker, table: &VariantTable, index: usize, base: &Scenario) -> Result<Scenario, Problems> {
    if table.set.0.is_empty() {
        return Ok(base.clone());
    }
    let keys = table.set.0.iter().map(|key| key.value.clone()).collect();
    Scenario::from_source(base.source().with(Overlay::new(&c.source, index, keys)))
}

fn variant(
    c: &mut Checker,
    file: &CampaignFile,
    table: &VariantTable,
    index: usize,
    whole: Campaign,
    fields: &[Field],
) -> Variant {
    let own = |shared: &&DerivedTable| table.derived.iter().any(|own| own.target.value == shared.target.value);
    let tables: Vec<&DerivedTable> = file.derived.iter().filter(|shared| !own(shared)).chain(&table.derived).collect();
    let name = table.name.value.clone();
    let title = table.title.as_ref().map_or(&name, |title| &title.value).clone();
    let text = |key: &str| {
        let span = c.source.span_of(&format!("variant[{}].set.{key}", index + 1));
        c.source.text().get(span).unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let changes: Vec<_> = table.set.0.iter().map(|key| (key.value.clone(), text(&key.value))).collect();
    let own_derived = table.derived.iter().map(|own| (own.target.value.clone(), format!("= {}", own.expr.value)));
    let changes = changes.into_iter().chain(own_derived).collect();
    let derived = derived::read(c, fields, &tables, &whole.dispersions);
    let campaign = Campaign {
        id: format!("{}/{name}", whole.id),
        title: format!("{}: {title}", whole.title),
        hash: blake3::hash(format!("{} {name} {}", whole.hash, whole.scenario.robot_text().unwrap_or("")).as_bytes())
            .to_hex()
            .to_string(),
        derived,
        ..whole
    };
    Variant { name, title, changes, campaign }
}

/// Refuses what can do nothing in any variant that has it.
pub(crate) fn refuse_idle(c: &mut Checker, variants: &[Variant]) {
    let mut all: Vec<(IdleTarget, usize)> = Vec::new();
    for variant in variants {
        let bounds = variant.campaign.bounds(c);
        for target in idle::targets(&variant.campaign, &bounds) {
            match all.iter_mut().find(|(other, _)| other.place == target.place) {
                Some((_, count)) => *count += 1,
                None => all.push((target, 1)),
            }
        }
    }
    for (target, count) in all {
        let holders = variants.iter().filter(|variant| variant.campaign.sets_at(&target.place)).count();
        if count == holders {
            target.refuse(c);
        }
    }
}
