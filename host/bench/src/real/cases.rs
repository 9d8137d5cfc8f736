//! Cases of the gauntlet in measured recordings.

use crate::real::sets::{MeasuredSet, PlantedForm, PlantedJoint, PlantedModel, SETS};
use crate::real::untouched::UntouchedChange;

/// Task of a case.
#[derive(Clone, Copy, Debug)]
pub enum RealTask {
    /// The set as it is.
    Base,
    /// Effects in the recordings of a joint, of a size.
    Forms(&'static PlantedJoint, &'static [PlantedForm], Places, f64),
    /// Effect in the model.
    Model(&'static PlantedModel),
    /// Change of the form of the data alone.
    Untouched(UntouchedChange),
}

/// Places of one or two forms in a set's list.
#[derive(Clone, Copy, Debug)]
pub enum Places {
    /// One form.
    One(usize),
    /// Two forms at once.
    Two([usize; 2]),
}

impl Places {
    /// The forms of a list.
    pub(crate) fn of(self, forms: &'static [PlantedForm]) -> Vec<&'static PlantedForm> {
        match self {
            Self::One(place) => vec![&forms[place]],
            Self::Two(places) => places.iter().map(|place| &forms[*place]).collect(),
        }
    }
}

/// Case of the gauntlet in measured recordings.
#[derive(Clone, Copy, Debug)]
pub struct RealCase {
    /// Recordings and model.
    pub set: &'static MeasuredSet,
    /// Task.
    pub task: RealTask,
}

impl RealCase {
    /// Returns the unique name.
    pub fn id(&self) -> String {
        let what = match self.task {
            RealTask::Base => "base".to_owned(),
            RealTask::Forms(joint, forms, places, multiple) => {
                let names: Vec<String> =
                    places.of(forms).iter().map(|form| format!("{}:{}", form.id, form.field)).collect();
                format!("planted{}.{}.x{multiple:?}", joint.end, names.join("+"))
            }
            RealTask::Model(model) => format!("model.{}.{}", model.id, model.replaced[1].replace(' ', "")),
            RealTask::Untouched(change) => format!("untouched.{}", change.word()),
        };
        format!("{}.{what}", self.set.name)
    }
}

/// Returns all cases of the sets that `is_wanted`, the unchanged set first.
pub fn cases(is_wanted: impl Fn(&MeasuredSet) -> bool) -> Vec<RealCase> {
    SETS.iter().filter(|set| is_wanted(set)).flat_map(of_set).collect()
}

fn of_set(set: &'static MeasuredSet) -> Vec<RealCase> {
    let mut tasks = vec![RealTask::Base];
    tasks.extend(UntouchedChange::of(set).into_iter().map(RealTask::Untouched));
    for joint in set.joints {
        for multiple in set.multiples {
            let one = |place| RealTask::Forms(joint, set.forms, Places::One(place), *multiple);
            tasks.extend((0..set.forms.len()).map(one));
        }
        let largest = set.multiples.iter().copied().fold(0.0, f64::max);
        tasks.extend(set.pairs.iter().map(|pair| RealTask::Forms(joint, set.forms, Places::Two(*pair), largest)));
    }
    tasks.extend(set.models.iter().map(RealTask::Model));
    tasks.into_iter().map(|task| RealCase { set, task }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn names_are_unique_and_the_plan_has_its_extent() {
        let all = cases(|_| true);
        let names: BTreeSet<String> = all.iter().map(RealCase::id).collect();
        assert_eq!(names.len(), all.len());
        let untouched = all.iter().filter(|case| matches!(case.task, RealTask::Untouched(_))).count();
        let planted = all.len() - untouched - SETS.len();
        assert!(planted >= 200 && untouched >= 60, "{planted} planted, {untouched} untouched");
    }
}
