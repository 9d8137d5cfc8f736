//! What a campaign's keys of the scenario can make of a run: checked when the campaign is read.

use crate::campaign::Campaign;
use crate::check::Checker;
use crate::dispersion::Dispersion;
use crate::problem::{Problem, Problems};
use crate::scenario_key::ScenarioKey;
use crate::units::show;
use softdock_kernels::fields::{fields, to_vec};
use softdock_kernels::params::Params;

/// First draws that are tried when a campaign is read: keys may fit alone and not together.
const TRIED: u64 = 8;

impl Campaign {
    /// The campaign with the parameters that its keys can give a run. Refused are keys that change nothing, values that the
    /// scenario's reader refuses, and keys that set a parameter which is dispersed as well.
    pub(crate) fn with_key_ends(mut self, c: &mut Checker) -> Self {
        let noted = c.problems.len();
        let ends = self.dispersions.iter().filter_map(|dispersion| Some((dispersion, self.key_of(dispersion.field)?)));
        let ends: Vec<Params<f64>> = ends.flat_map(|(dispersion, key)| self.ends_of(c, dispersion, key)).collect();
        if self.has_keys() && c.problems.len() == noted {
            let tried = (0..self.runs.min(TRIED)).find_map(|run| self.draw(run).err());
            c.problems.extend(tried.into_iter().flatten());
        }
        self.key_ends = ends;
        self
    }

    /// Refuses a campaign for `user`, which has one scenario for all runs and robots that hold rigid parts.
    ///
    /// # Errors
    /// If the campaign disperses keys of the scenario, part A has fingers, or part B rides on a ring.
    pub fn refuse_for(&self, user: &str) -> Result<(), Problems> {
        let file = || self.files()[0].clone();
        if let Some(key) = self.keys().next() {
            let message =
                format!("this campaign gives each run a `{}` of its own, and {user} has one scenario", key.path);
            let remedy = "use a campaign without dispersions of `scenario.` keys";
            return Err(Problem::with_file(file(), message).remedy(remedy).into());
        }
        if !self.scenario.model.contact.fingers.is_empty() {
            let message = format!("part A of this campaign has fingers, and {user} commands no gripper");
            let remedy = "use a scenario whose solids have no `closes`";
            return Err(Problem::with_file(file(), message).remedy(remedy).into());
        }
        if self.scenario.model.ring.is_some() {
            let message = format!("part B of this campaign rides on a soft capture ring, and {user} measures no ring");
            let remedy = "use a scenario without [soft_capture]";
            return Err(Problem::with_file(file(), message).remedy(remedy).into());
        }
        Ok(())
    }

    /// Parameters of the scenario with a key at either end.
    fn ends_of(&self, c: &mut Checker, dispersion: &Dispersion, key: &ScenarioKey) -> Vec<Params<f64>> {
        let path = &key.path;
        let (least, greatest) = dispersion.distribution.reach();
        let mut ends = Vec::new();
        for value in [least, greatest] {
            let values: Vec<_> =
                self.keys().map(|own| (own, if own.path == *path { value } else { own.nominal })).collect();
            match self.scenario.with_keys(&values) {
                Ok(scenario) => ends.push(scenario),
                Err(problems) => {
                    let why = problems.iter().next().map_or(String::new(), |problem| problem.message.clone());
                    let message = format!("`{path}` reaches {}: {why}", show(value, key.unit));
                    let remedy = "narrow the distribution, or use one with ends: uniform, truncnormal, triangular";
                    c.refuse(&dispersion.place, message, remedy);
                    return Vec::new();
                }
            }
        }
        let [first, second] = [&ends[0].model, &ends[1].model];
        if first == second && least != greatest {
            let message = format!("`{path}` does nothing here: the scenario is the same at both ends");
            c.refuse(&dispersion.place, message, "remove it, or disperse a key that the task uses");
        }
        let (first, second) = (to_vec(&first.nominal), to_vec(&second.nominal));
        for (field, row) in fields::<f64, Params<f64>>().iter().enumerate().filter(|(at, _)| first[*at] != second[*at])
        {
            let dispersed = self.dispersions.iter().any(|other| other.field == field);
            if dispersed || self.derived.iter().any(|other| other.field == field) {
                let message = format!("`{path}` gives each run its `{}`, which is set in this file too", row.name);
                c.refuse(&dispersion.place, message, format!("remove this dispersion, or that of `{}`", row.name));
            }
        }
        for scenario in &ends {
            let at_end = Self { scenario: scenario.clone(), ..self.clone() };
            if let Err(problems) = at_end.check_steps(&c.source) {
                c.problems.extend(problems.before(&format!("with `{path}` at an end: ")));
                break;
            }
        }
        ends.into_iter().map(|scenario| scenario.model.nominal).collect()
    }
}

#[cfg(test)]
mod tests;
