//! Selection of the runs whose time histories or contact events are kept.

use crate::repetitions::is_chosen;
use crate::rows::params_of;
use softdock_campaign::Campaign;
use softdock_campaign::campaign::Keep;
use softdock_kernels::params::Params;
use softdock_results::runs::{RunRow, Status};
use softdock_results::traces::NOMINAL_RUN;
use std::collections::BTreeMap;

/// A run with the parameters that were applied.
pub(crate) type AppliedRun = (u64, Params<f64>);

/// A run that is kept, and why.
pub(crate) type KeptRun = (AppliedRun, String);

/// Looks at all rows and picks the runs that the campaign keeps.
pub(crate) struct RunSelection<'a> {
    campaign: &'a Campaign,
    keep: &'a [Keep],
    picked: BTreeMap<u64, KeptRun>,
    /// Per requirement and loop the runs of least margin, in ascending order.
    worst: Vec<[Vec<(f64, AppliedRun)>; 2]>,
}

impl<'a> RunSelection<'a> {
    /// Nothing picked but the nominal run, if it is wanted.
    ///
    /// [`Keep::All`] picks no run: whoever keeps all needs no selection.
    pub(crate) fn new(campaign: &'a Campaign, keep: &'a [Keep]) -> Self {
        let mut picked = BTreeMap::new();
        if keep.contains(&Keep::Nominal) {
            picked.insert(NOMINAL_RUN, ((NOMINAL_RUN, campaign.nominal()), "nominal".to_owned()));
        }
        let worst = campaign.requirements.iter().map(|_| [Vec::new(), Vec::new()]).collect();
        Self { campaign, keep, picked, worst }
    }

    /// Looks at a row at its place among the campaign's runs.
    pub(crate) fn see(&mut self, place: u64, row: &RunRow) {
        for keep in self.keep {
            let reason = match keep {
                Keep::Failed if row.status == Status::Fail => "failed",
                Keep::Invalid if row.status == Status::Invalid => "invalid",
                Keep::Random(count) if is_chosen(place, u64::from(*count), self.campaign.runs) => "random",
                Keep::Worst(count) => {
                    Self::see_margins(&mut self.worst, row, *count as usize);
                    continue;
                }
                _ => continue,
            };
            self.picked.entry(row.run).or_insert_with(|| ((row.run, params_of(row)), reason.to_owned()));
        }
    }

    fn see_margins(worst: &mut [[Vec<(f64, AppliedRun)>; 2]], row: &RunRow, count: usize) {
        for (at, worst) in worst.iter_mut().enumerate() {
            for (worst, side) in worst.iter_mut().zip([&row.space, &row.hil]) {
                let Some(margin) = side.requirements[at].margin else { continue };
                // Rows come in order of their runs: of equal margins the first run stays.
                let place = worst.partition_point(|(other, _)| *other <= margin);
                if place < count {
                    worst.insert(place, (margin, (row.run, params_of(row))));
                    worst.truncate(count);
                }
            }
        }
    }

    /// The picked runs; the least margin is the strongest reason.
    pub(crate) fn kept(self) -> Vec<KeptRun> {
        let mut picked = self.picked;
        for (requirement, worst) in self.campaign.requirements.iter().zip(self.worst).rev() {
            let [in_space, on_facility] = worst;
            for (place, worst) in [(" on the facility", on_facility), ("", in_space)] {
                for (_, run) in worst {
                    picked.insert(run.0, (run, format!("worst {}{place}", requirement.id)));
                }
            }
        }
        picked.into_values().collect()
    }
}
