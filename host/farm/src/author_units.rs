//! Columns of the runs in the units of the campaign's author.

use crate::folder::ResultsFolder;
use softdock_kernels::fields::unit_suffix;
use softdock_results::arrow_table::OtherUnit;
use softdock_results::columns::{self, Loop};
use softdock_results::runs::input_fields;

impl ResultsFolder {
    /// The author's units of the columns of its runs.
    pub fn author_units(&self) -> Vec<OtherUnit> {
        let campaign = &self.campaign;
        let mut units = Vec::new();
        for author in campaign.author_units() {
            let mut add = |column: String, si: &str| {
                let stem = column.strip_suffix(&format!("_{}", unit_suffix(si))).unwrap_or(&column).to_owned();
                let name = format!("{stem}_{}", slug(&author.unit));
                units.push(OtherUnit { column, name, unit: author.unit.clone(), in_si: author.in_si });
            };
            if !author.is_metric {
                if let Some((column, si)) = self.input_column(&author.name) {
                    add(column, &si);
                }
                continue;
            }
            for requirement in campaign.requirements.iter().filter(|requirement| requirement.metric.name == author.name)
            {
                for side in Loop::BOTH {
                    if let Some(column) = &requirement.metric.column {
                        add(side.metric_column(column).into_name(), requirement.unit());
                    }
                    add(side.margin(&requirement.column_id()).into_name(), "1");
                }
            }
        }
        units
    }

    /// Column and SI unit of an input by the name of its parameter, its key of the scenario, or its column.
    pub(crate) fn input_column(&self, name: &str) -> Option<(String, String)> {
        let key = self.campaign.keys().find(|key| key.path == name || key.column() == name);
        let field = || {
            let mut fields = input_fields().into_iter();
            fields.find(|field| field.name == name || columns::input(field).name() == name)
        };
        key.map(|key| (key.column(), key.unit.to_owned()))
            .or_else(|| field().map(|field| (columns::input(&field).into_name(), field.unit.to_owned())))
    }
}

/// A unit as a suffix of a column's name: `mm/s` is `mm_per_s`, `%` is `percent`.
fn slug(unit: &str) -> String {
    let text = unit.replace('%', "percent").replace('‰', "permille").replace('°', "deg").replace('µ', "u");
    let text = text.replace('/', " per ").to_lowercase();
    let words = text.split(|letter: char| !letter.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.collect::<Vec<_>>().join("_")
}
