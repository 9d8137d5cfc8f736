//! Names of what touches in a contact event, as the scenario file writes them.

use crate::overlap::key;
use crate::read;
use crate::scenario::{FORMAT, Scenario};
use crate::written::At;
use crate::written::scenario::ScenarioFile;
use softdock_kernels::model::Side;
use softdock_kernels::plant::PointSource;

/// Names of the points and solids of both parts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ContactNames {
    /// Names of the points, then of the solids, of each part; empty where the file writes none.
    parts: [[Vec<String>; 2]; 2],
}

impl ContactNames {
    /// The names that a scenario's file writes.
    pub fn of(scenario: &Scenario) -> Self {
        // The file was read before: it can be read again.
        let Ok(file) = read::parse::<ScenarioFile>(scenario.source(), FORMAT) else { return Self::default() };
        let text = |name: &Option<At<String>>| name.as_ref().map_or_else(String::new, |name| name.value.clone());
        let (a, b) = (&file.part_a, &file.part_b);
        let parts = [(&a.point, &a.solid), (&b.point, &b.solid)].map(|(points, solids)| {
            [points.iter().map(|own| text(&own.name)).collect(), solids.iter().map(|own| text(&own.name)).collect()]
        });
        Self { parts }
    }

    /// Key of a point or solid of a part (`part_a.solid[1]`, entries count from 1), and its name, empty without one.
    pub fn member(&self, side: Side, source: PointSource) -> [String; 2] {
        let [points, solids] = &self.parts[side as usize];
        let name = match source {
            PointSource::Point(index) => points.get(index),
            PointSource::Solid(index) => solids.get(index),
        };
        [key(side, source), name.cloned().unwrap_or_default()]
    }
}

/// Key of a material pair in the scenario, by its index: `contact.pair[1]`, or `contact` for the common law.
pub fn pair_key(pair: Option<usize>) -> String {
    pair.map_or_else(|| "contact".to_owned(), |index| format!("contact.pair[{}]", index + 1))
}
