//! Diagnosed model: a rig, or a whole facility by its scenario or campaign; from its file to the files of the answer.

use crate::Result;
use crate::diagnosis::{Diagnosis, DiagnosisOptions, Prepared, prepare, prepare_facility};
use crate::plants::facility::block::FacilityModel;
use crate::propose::experiment::ProposedExperiment;
use crate::propose::next_drive::next_drive;
use crate::report::result_files::{FiguresAndFiles, readable};
use crate::report::summary::headline;
use crate::report::{extend, missing_torque, page};
use crate::verdict::judged::Judged;
use softdock_analysis::PageOrigin;
use softdock_campaign::{Campaign, FileKind, Problems, Rig, Scenario};
use softdock_results::ResultFile;
use std::path::Path;

/// Name of the extended model in a results folder.
pub const EXTENDED: &str = "extended.toml";

/// Model whose deviations from recordings are diagnosed.
pub enum DiagnosedModel {
    /// A rig.
    Rig(Box<Rig>),
    /// A whole facility.
    Facility(FacilityModel),
}

impl DiagnosedModel {
    /// Reads a rig's model file, a scenario or a campaign.
    ///
    /// # Errors
    /// If the file cannot be used.
    pub fn load(path: &Path) -> std::result::Result<Self, Problems> {
        Ok(match softdock_campaign::kind(path)? {
            FileKind::Campaign => {
                let campaign = Campaign::load(path)?;
                campaign.refuse_for("a diagnosis")?;
                Self::Facility(FacilityModel::Campaign(Box::new(campaign)))
            }
            FileKind::Scenario => Self::Facility(FacilityModel::Scenario(Box::new(Scenario::load(path)?))),
            FileKind::Other => Self::Rig(Box::new(Rig::load(path)?)),
        })
    }

    /// Returns the title for users.
    pub fn title(&self) -> &str {
        match self {
            Self::Rig(rig) => &rig.title,
            Self::Facility(facility) => &facility.scenario().title,
        }
    }

    /// Returns the name.
    pub fn id(&self) -> &str {
        match self {
            Self::Rig(rig) => &rig.id,
            Self::Facility(facility) => &facility.scenario().id,
        }
    }

    /// Returns the campaign, if its runs were driven.
    pub fn campaign(&self) -> Option<&Campaign> {
        match self {
            Self::Rig(_) => None,
            Self::Facility(facility) => facility.campaign(),
        }
    }

    /// Reads training and held-out recordings.
    ///
    /// # Errors
    /// If a recording cannot be used.
    pub fn prepare(&self, logs: &[&Path], held_out: &[&Path], options: &DiagnosisOptions) -> Result<Prepared> {
        match self {
            Self::Rig(rig) => prepare(rig.as_ref().clone(), logs, held_out, options),
            Self::Facility(facility) => prepare_facility(facility.clone(), logs, held_out, options),
        }
    }

    /// Returns the run to drive next, from rehearsed runs (number and log); `None` for a rig.
    ///
    /// # Errors
    /// If a log cannot be used.
    pub fn next_drive(
        &self,
        diagnosis: &Diagnosis,
        judged: &[Judged],
        rehearsed: &[(u64, &Path)],
    ) -> Result<Option<ProposedExperiment>> {
        match self {
            Self::Rig(_) => Ok(None),
            Self::Facility(facility) => next_drive(facility, &diagnosis.blocks, judged, rehearsed),
        }
    }

    /// Returns the page of a diagnosis, with the verdicts of a campaign that were compared.
    ///
    /// # Errors
    /// If a figure cannot be drawn.
    pub fn page(
        &self,
        diagnosis: &Diagnosis,
        judged: &[Judged],
        origin: &PageOrigin,
        comparison: Option<&str>,
    ) -> Result<ResultFile> {
        let page = page::page(self.title(), diagnosis, judged, origin, comparison)?;
        Ok(ResultFile::new("diagnosis.html", page))
    }

    /// Returns page, figures, extended model, experiment and missing torques of a diagnosis.
    ///
    /// # Errors
    /// If a figure of the page cannot be drawn.
    pub fn files(&self, diagnosis: &Diagnosis, judged: &[Judged], origin: &PageOrigin) -> Result<FiguresAndFiles> {
        let mut figures = serde_json::to_value(diagnosis).expect("a diagnosis has string keys");
        figures["headline"] = headline(diagnosis).into();
        let mut files =
            vec![self.page(diagnosis, judged, origin, None)?, ResultFile::new("diagnosis.json", readable(&figures))];
        let (is_facility, (text, beside)) = match self {
            Self::Rig(rig) => (false, rig.gathered()),
            Self::Facility(facility) => (true, facility.scenario().gathered()),
        };
        if let Some(text) = extend::extended(&text, diagnosis, is_facility) {
            files.push(ResultFile::new(EXTENDED, text));
            files.extend(beside.into_iter().map(|(name, text)| ResultFile { name, text }));
        }
        files.extend(diagnosis.proposed.as_ref().map(|experiment| {
            let asked = experiment.run.zip(self.campaign()).map(|(run, campaign)| {
                let why = format!("{} Made by `{}`.", headline(diagnosis), origin.command);
                campaign.experiment_text(&why, run, experiment.repeats)
            });
            ResultFile::new(experiment.file(), asked.unwrap_or_else(|| experiment.csv()))
        }));
        let outside = judged.iter().filter_map(|judged| judged.outside.as_ref());
        files.extend(missing_torque::table(outside).map(|text| ResultFile::new("missing_torque.csv", text)));
        Ok(FiguresAndFiles { figures, files })
    }
}
