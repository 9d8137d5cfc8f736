//! Identification of a contact from recordings: data, fits, choice of the law, errors on held-out data.

use super::estimate::{ContactDetermination, ContactEstimate};
use super::law::{FittedLaw, LawFit, PredictedTouch, fit_law, predicted};
use super::population::PopulationSize;
use super::search::SearchSize;
use super::toss::{OpenLoopError, OpenLoopToss, TossFit, Tosses, fit_toss, open_loop};
use super::touches::Touches;
use crate::Result;
use softdock_campaign::Rig;
use softdock_campaign::rig::RigModel;
use softdock_diagnosis::DiagnosisError;
use softdock_kernels::fields::to_vec;
use std::path::Path;

/// Difference of the Bayes information criterion from which a law counts as better than another (Kass and Raftery 1995).
const CLEARLY_BETTER: f64 = 6.0;

/// Relative error of the force from which no law describes the contact.
const INADEQUATE: f64 = 0.1;

/// Options of the identification of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactOptions {
    /// Share of the touches or tosses that is held out.
    pub hold_out: f64,
    /// Law that is fitted; `None` compares all.
    pub law: Option<FittedLaw>,
    /// Seed of the starts.
    pub seed: u64,
}

/// Identification of a contact.
pub struct ContactIdentification {
    /// Id of the rig.
    pub id: String,
    /// Title of the rig.
    pub title: String,
    /// What was found.
    pub found: FoundContact,
}

/// What was found, by the kind of recordings.
pub enum FoundContact {
    /// From forces over depth.
    Touches(FoundLaw),
    /// From tosses.
    Tosses(Box<FoundToss>),
}

/// Law of contact found in presses and impacts.
pub struct FoundLaw {
    /// The touches.
    pub touches: Touches,
    /// Fits, the best first.
    pub fits: Vec<LawFit>,
    /// Whether the law was given.
    pub is_given: bool,
}

impl FoundLaw {
    /// Returns the fit of the best or of the given law.
    pub fn best(&self) -> &LawFit {
        &self.fits[0]
    }

    /// Returns the laws that these data do not distinguish from the best one.
    pub fn rivals(&self) -> Vec<&LawFit> {
        let least = self.best().criterion;
        self.fits[1..].iter().filter(|fit| fit.criterion - least < CLEARLY_BETTER).collect()
    }

    /// Returns the predictions of a part of the touches.
    pub fn predicted(&self, held_out: bool) -> Vec<PredictedTouch<'_>> {
        predicted(self.best(), &self.touches, held_out)
    }
}

/// Contact found in tosses.
pub struct FoundToss {
    /// The tosses.
    pub tosses: Tosses,
    /// The fit.
    pub fit: TossFit,
    /// Errors of the fitted tosses: with the rig's values, and with the fitted ones.
    pub fitted: [Vec<OpenLoopError>; 2],
    /// The same of the held-out tosses.
    pub held_out: [Vec<OpenLoopError>; 2],
}

impl ContactIdentification {
    /// Returns the estimates of the contact.
    pub fn estimates(&self) -> &[ContactEstimate] {
        match &self.found {
            FoundContact::Touches(found) => &found.best().estimates,
            FoundContact::Tosses(found) => &found.fit.estimates,
        }
    }

    /// Returns the word of the law that `[contact]` has.
    pub fn law(&self) -> &'static str {
        match &self.found {
            FoundContact::Touches(found) => found.best().law.word(),
            FoundContact::Tosses(_) => FittedLaw::Rebound.word(),
        }
    }

    /// Returns statements about the recordings.
    pub fn notes(&self) -> &[String] {
        match &self.found {
            FoundContact::Touches(found) => &found.touches.notes,
            FoundContact::Tosses(found) => &found.tosses.notes,
        }
    }

    /// Returns the relative error of the force, if it is too large for the law to describe the contact.
    pub fn inadequate(&self) -> Option<f64> {
        match &self.found {
            FoundContact::Touches(found) => Some(found.best().error).filter(|error| *error > INADEQUATE),
            FoundContact::Tosses(_) => None,
        }
    }

    /// Returns whether every parameter has a value.
    pub fn is_complete(&self) -> bool {
        self.estimates().iter().all(|estimate| estimate.determination == ContactDetermination::Determined)
    }
}

/// Identifies the contact of a rig from recordings.
///
/// # Errors
/// A rig of another kind, a recording that cannot be read, too few touches or tosses.
pub fn identify_contact(rig: &Rig, logs: &[&Path], options: &ContactOptions) -> Result<ContactIdentification> {
    let found = match &rig.plant {
        RigModel::Contact(_) => FoundContact::Touches(found_law(rig, logs, options)?),
        RigModel::Toss(own) => {
            if let Some(law) = options.law {
                let what = format!("tosses do not show a law: --law {} needs force recordings", law.word());
                return Err(DiagnosisError::unfit(what, "remove --law"));
            }
            let tosses = Tosses::read(rig, own, logs, options.hold_out)?;
            let fit = fit_toss(&tosses, PopulationSize { seed: options.seed, ..PopulationSize::default() })?;
            let sets = [to_vec(&own.values), fit.values.clone()];
            let errors = |held_out: bool| -> [Vec<OpenLoopError>; 2] {
                let errors = open_loop(&OpenLoopToss::of(&tosses, held_out), &sets);
                errors.try_into().expect("two sets")
            };
            let (fitted, held_out) = (errors(false), errors(true));
            FoundContact::Tosses(Box::new(FoundToss { fitted, held_out, fit, tosses }))
        }
        _ => {
            let what = format!("{} is no rig of kind \"contact\" or \"toss\"", rig.file);
            let remedy =
                "write a rig file of kind \"contact\" (force and position) or \"toss\" (poses of a thrown body)";
            return Err(DiagnosisError::unfit(what, remedy));
        }
    };
    Ok(ContactIdentification { id: rig.id.clone(), title: rig.title.clone(), found })
}

fn found_law(rig: &Rig, logs: &[&Path], options: &ContactOptions) -> Result<FoundLaw> {
    let touches = Touches::read(rig, logs, options.hold_out)?;
    let size = SearchSize { seed: options.seed, ..SearchSize::default() };
    let laws = FittedLaw::NAMED.iter().map(|row| row.1);
    let laws = laws.filter(|law| options.law.is_none_or(|given| given == *law));
    let mut fits: Vec<LawFit> = laws.map(|law| fit_law(law, &touches, size)).collect();
    fits.sort_by(|one, other| one.criterion.total_cmp(&other.criterion));
    Ok(FoundLaw { touches, fits, is_given: options.law.is_some() })
}
