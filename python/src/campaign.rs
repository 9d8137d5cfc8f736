//! Campaigns: loaded, checked, run.

use crate::error::{SoftdockError, of_farm};
use crate::interrupt::interruptible;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use softdock_campaign::{Setting, Settings};
use softdock_engine::Choice;
use softdock_farm::check::{check_json, check_text};
use softdock_farm::step::step;
use softdock_farm::{Cancel, Context, RunOptions, Selection, Silent, choice_of, load_campaign, load_campaign_text};
use std::path::PathBuf;

/// A checked campaign.
#[pyclass(frozen, module = "softdock._softdock")]
pub(crate) struct NativeCampaign {
    campaign: softdock_campaign::Campaign,
    selection: Selection,
}

#[pymethods]
impl NativeCampaign {
    #[new]
    #[pyo3(signature = (path, text, settings, *, runs=None, seed=None, variant=None, model=None, cases=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        text: Option<String>,
        settings: Vec<String>,
        runs: Option<u64>,
        seed: Option<u64>,
        variant: Option<String>,
        model: Option<PathBuf>,
        cases: Option<PathBuf>,
    ) -> PyResult<Self> {
        let settings = settings.iter().map(|setting| setting.parse::<Setting>()).collect::<Result<_, _>>();
        let settings = Settings::new(settings.map_err(SoftdockError::new_err)?);
        let settings = settings.map_err(|problems| of_farm(problems.into()))?;
        let selection = Selection { model, runs, seed, variant, cases, settings };
        py.detach(|| {
            let cancel = Cancel::default();
            let context = Context { observer: &Silent, cancel: &cancel };
            let campaign = match text {
                Some(text) => load_campaign_text(&path, text, &selection, context),
                None => load_campaign(&path, &selection, context),
            };
            Ok(Self { campaign: campaign.map_err(of_farm)?, selection })
        })
    }

    #[getter]
    fn id(&self) -> &str {
        &self.campaign.id
    }

    #[getter]
    fn title(&self) -> &str {
        &self.campaign.title
    }

    #[getter]
    fn runs(&self) -> u64 {
        self.campaign.runs
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.campaign.seed
    }

    #[getter]
    fn hash(&self) -> &str {
        &self.campaign.hash
    }

    #[getter]
    fn text(&self) -> &str {
        &self.campaign.text
    }

    /// Sentences of the requirements, by id.
    #[getter]
    fn requirements(&self) -> Vec<(String, String)> {
        let single = self.campaign.requirements.iter().map(|one| (one.id.clone(), one.sentence()));
        single.chain(self.campaign.agreement.iter().map(|one| (one.id.clone(), one.sentence()))).collect()
    }

    /// Report of `softdock check` as JSON and as text.
    fn check(&self, py: Python<'_>, draws: u64, step_runs: Option<u64>) -> PyResult<(String, String)> {
        interruptible(py, (None, None), |context| {
            let stepped = step(&self.campaign, step_runs, choice_of(&self.campaign), context).map_err(of_farm)?;
            let mut json = check_json(&self.campaign, draws).map_err(of_farm)?;
            json["stepped"] = stepped.json();
            let text = check_text(&self.campaign, draws).map_err(of_farm)? + &stepped.text();
            Ok((json.to_string(), text))
        })?
    }

    /// Runs the campaign; returns the results folder, and why it is incomplete if it is.
    #[pyo3(signature = (out, *, backend, threads, fresh, progress, note))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn run(
        &self,
        py: Python<'_>,
        out: Option<PathBuf>,
        backend: Option<&str>,
        threads: Option<usize>,
        fresh: bool,
        progress: Option<Py<PyAny>>,
        note: Option<Py<PyAny>>,
    ) -> PyResult<(PathBuf, Option<String>)> {
        let choice = backend.map_or_else(|| Ok(choice_of(&self.campaign)), choice_named)?;
        let pool = threads.map(|threads| {
            let threads = if threads == 0 { Err("threads is 0; write 1 or more".to_owned()) } else { Ok(threads) };
            let pool = threads.and_then(|threads| {
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())
            });
            pool.map_err(PyValueError::new_err)
        });
        let pool = pool.transpose()?;
        let out = self.selection.results(out.as_deref(), &self.campaign.id);
        let options = RunOptions { choice, is_fresh: fresh, ..RunOptions::default() };
        let ended = interruptible(py, (progress.as_ref(), note.as_ref()), |context| {
            let run = || softdock_farm::run(self.campaign.clone(), &out, &options, context);
            pool.map_or_else(run, |pool| pool.install(run))
        })?;
        let ended = ended.map_err(of_farm)?;
        Ok((ended.results, ended.incomplete.map(|incomplete| incomplete.to_string())))
    }
}

fn choice_named(word: &str) -> PyResult<Choice> {
    let found = Choice::NAMED.iter().find(|(name, ..)| *name == word);
    found.map(|(.., choice)| *choice).ok_or_else(|| {
        let words: Vec<&str> = Choice::NAMED.iter().map(|(name, ..)| *name).collect();
        PyValueError::new_err(format!("backend is {word:?}; write one of: {}", words.join(", ")))
    })
}

/// The text of a file with the keys of a JSON object, in their order.
#[pyfunction]
pub(crate) fn toml_text(json: &str) -> PyResult<String> {
    let table: toml::Table = serde_json::from_str(json).map_err(|error| SoftdockError::new_err(error.to_string()))?;
    toml::to_string_pretty(&table).map_err(|error| SoftdockError::new_err(error.to_string()))
}
