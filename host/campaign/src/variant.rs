//! Variants: the same draws on facilities that differ in stated keys of the scenario.

use crate::check::Checker;
use crate::derived::{self, Derived};
use crate::dispersion::Dispersion;
use crate::problem::Problems;
use crate::scenario::Scenario;
use crate::source::overlay::Overlay;
use crate::written::campaign::{CampaignFile, DerivedTable};
use crate::written::compare::VariantTable;
use softdock_kernels::fields::Field;
use softdock_kernels::params::Params;

/// What a results folder holds besides variants.
const TAKEN: [&str; 5] = ["campaign", "partial", "runs", "traces", "replays"];

/// One facility on which a campaign is run.
#[derive(Clone, Debug)]
pub struct Variant {
    /// Name, also of its folder in the campaign's results folder.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// The keys of the scenario that it replaces, each with its value here.
    pub changes: Vec<(String, String)>,
    /// The task with this facility.
    pub(crate) scenario: Scenario,
    /// The derived values with those of the variant.
    pub(crate) derived: Vec<Derived>,
    /// Parameters of its scenario with each dispersed key at its ends.
    pub(crate) key_ends: Vec<Params<f64>>,
}

/// Reads the variants of a campaign; `fields` are the parameters and its variables.
pub(crate) fn read(
    c: &mut Checker,
    file: &CampaignFile,
    base: &Scenario,
    dispersions: &[Dispersion],
    fields: &[Field],
) -> Vec<Variant> {
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
        match scenario(c, table, index, base) {
            Ok(scenario) => variants
                .push(variant(c, file, index, scenario, |c, tables| derived::read(c, fields, tables, dispersions))),
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
    index: usize,
    scenario: Scenario,
    read_derived: impl Fn(&mut Checker, &[&DerivedTable]) -> Vec<Derived>,
) -> Variant {
    let table = &file.variant[index];
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
    let derived = read_derived(c, &tables);
    Variant { name, title, changes, scenario, derived, key_ends: Vec::new() }
}
