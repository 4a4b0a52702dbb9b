//! The shape of a study.

use super::life::{Answer, Request, resumed_or_new, run};
use super::memory::MemoryItem;
use super::state_file::StateFile;
use super::{Plan, RunRecord};
use crate::config::settings::{Declared, Role, Settings};
use crate::error::{Error, Result};
use crate::swarm::Reached;
use crate::swarm::checkpoint::{self, Checkpoint};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::marker::PhantomData;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Figures by name; nothing where one does not apply.
pub type Figures = BTreeMap<String, Option<f64>>;

/// What an observer of a study is told.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// What is being done.
    pub stage: String,
    /// How much of it is done: iterations or candidates.
    pub done: u64,
    /// How much there is to do, where that is known.
    pub planned: Option<u64>,
    /// What was reached so far, in words.
    pub reached: String,
}

impl Progress {
    /// So many candidates of so many.
    pub fn counted(done: u64, planned: u64) -> Self {
        Self {
            stage: "evaluating".to_owned(),
            done,
            planned: Some(planned),
            reached: String::new(),
        }
    }

    /// A stage of unknown length, with what it has reached.
    pub fn reached(stage: impl Into<String>, done: u64, reached: impl Into<String>) -> Self {
        Self {
            stage: stage.into(),
            done,
            planned: None,
            reached: reached.into(),
        }
    }
}

/// The state of a study: all that it takes to resume it.
pub trait State<S>: Checkpoint {
    /// What files of it say that they are.
    const KINDS: &'static [&'static str] = &[Self::KIND];

    /// Reads a saved state.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Input`] if it cannot be read.
    fn load(file: &Path) -> Result<Self> {
        checkpoint::load(file)
    }

    /// The settings that the study was begun with.
    ///
    /// # Errors
    /// [`Error::Input`] if they are those of another study.
    fn settings(&self, study: &str) -> Result<S>;

    /// Puts others in their place: the study is resumed elsewhere.
    ///
    /// # Errors
    /// [`Error::Study`] if they cannot be kept.
    fn set_settings(&mut self, settings: &S) -> Result<()>;

    /// Whether nothing has been evaluated yet.
    fn is_untouched(&self) -> bool;
}

/// What a study works with.
pub struct Work<'a, S: Study> {
    /// Its settings.
    pub settings: &'a S::Settings,
    /// What it has read.
    pub prepared: &'a S::Prepared,
    /// The state to resume from, if there is one.
    pub state: Option<S::State>,
    /// What saves the state.
    pub state_file: &'a mut StateFile,
    /// Is told of the progress and may end the study.
    pub observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    /// Raised when the study is to end, for work that tells nobody of its progress.
    pub stop: Arc<AtomicBool>,
}

/// A study that is solved: what its results are made of.
pub struct Solved<'a, S: Study> {
    /// Its settings.
    pub settings: &'a S::Settings,
    /// What it has read.
    pub prepared: &'a S::Prepared,
    /// What it has found.
    pub outcome: &'a S::Outcome,
}

impl<S: Study> Solved<'_, S> {
    /// The head of its summary, and of its manifest.
    pub fn head(&self) -> Head {
        Head {
            study: S::NAME.to_owned(),
            subject: S::subject(self.settings, self.prepared),
            record: S::record(self.outcome).clone(),
        }
    }
}

/// A study: from settings to results.
///
/// A new study is a type that implements this and a line in [`crate::study::registry`].
pub trait Study: Sized + 'static {
    /// Its name: the subcommand, and the prefix of its run folders.
    const NAME: &'static str;
    /// What it does, in a line.
    const ABOUT: &'static str;
    /// Examples and what else its help says.
    const DETAILS: &'static str;
    /// Its settings.
    type Settings: Settings + Serialize + DeserializeOwned;
    /// Its state.
    type State: State<Self::Settings>;
    /// All that it reads.
    type Prepared: Sync;
    /// What it finds.
    type Outcome;
    /// Its figures: what `--json` prints and `summary.json` holds.
    type Summary: Serialize + DeserializeOwned;

    /// Reads and checks all that the study needs.
    ///
    /// # Errors
    /// [`Error::Io`] and [`Error::Input`] for what cannot be read or used.
    fn prepare(settings: &Self::Settings) -> Result<Self::Prepared>;

    /// The same, where part of it takes long and ends with what it has once `stop` is raised.
    ///
    /// # Errors
    /// Those of [`Study::prepare`].
    fn prepare_until(settings: &Self::Settings, _: &AtomicBool) -> Result<Self::Prepared> {
        Self::prepare(settings)
    }

    /// What it keeps in memory: before anything is read, and with what was read.
    fn size(settings: &Self::Settings, prepared: Option<&Self::Prepared>) -> Vec<MemoryItem>;

    /// Says what it has read and what it would do.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where there is no device that it is to use.
    fn plan(settings: &Self::Settings, prepared: &Self::Prepared, plan: Plan) -> Result<Plan>;

    /// Does the work. An interrupted study says so in its record; one that has nothing to report then gives nothing.
    ///
    /// # Errors
    /// Those of evaluators and solvers; [`Error::Input`] if the state belongs to something else.
    fn solve(work: Work<'_, Self>) -> Result<Option<Self::Outcome>>;

    /// How many studies of one problem like this may be solved together; see [`Study::solve_together`].
    fn together(_: &Self::Settings) -> usize {
        1
    }

    /// Solves several studies of one problem, each from the state that an earlier run has left with its state_file. Each has a
    /// result of its own. They end in order once `stop` is raised.
    ///
    /// # Errors
    /// Those that concern all of them.
    fn solve_together(
        studies: &[Self::Settings],
        prepared: &Self::Prepared,
        state_files: &mut [StateFile],
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
        stop: &Arc<AtomicBool>,
    ) -> Result<Vec<Result<Option<Self::Outcome>>>> {
        let mut each = |settings: &Self::Settings, state_file: &mut StateFile| {
            resumed_or_new::<Self, _>(settings, state_file, true, |state, state_file| {
                Self::solve(Work {
                    settings,
                    prepared,
                    state,
                    state_file,
                    observe: &mut *observe,
                    stop: Arc::clone(stop),
                })
            })
        };
        let all = studies.iter().zip(state_files);
        Ok(all
            .map(|(settings, state_file)| each(settings, state_file))
            .collect())
    }

    /// How it ran.
    fn record(outcome: &Self::Outcome) -> &RunRecord;

    /// As [`Study::record`], to add to it.
    fn record_mut(outcome: &mut Self::Outcome) -> &mut RunRecord;

    /// Works the figures out.
    fn summarise(solved: &Solved<'_, Self>) -> Self::Summary;

    /// What it was about, for the manifest.
    fn subject(settings: &Self::Settings, prepared: &Self::Prepared) -> Subject;

    /// Writes tables, pictures and the page. `study.toml` and `summary.json` are written before, the manifest after.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be written.
    fn report(folder: &Path, solved: &Solved<'_, Self>, summary: &Self::Summary) -> Result<()>;

    /// The figures in words.
    fn text(settings: &Self::Settings, summary: &Self::Summary) -> String;

    /// What the user must be told whatever is printed.
    fn warnings(_: &Self::Summary) -> Vec<String> {
        Vec::new()
    }

    /// Whether the study reached what it was asked to reach.
    ///
    /// # Errors
    /// [`Error::Study`] saying what it did not reach.
    fn verdict(_: &Self::Settings, _: &Self::Summary) -> Result<()> {
        Ok(())
    }

    /// Reads a study file with all that it names and says in a few words what it asks for.
    ///
    /// # Errors
    /// As [`Settings::read`] and [`Study::prepare`].
    fn check(path: &Path) -> Result<String>;

    /// Its columns in a sweep: by default all numbers of the summary but those of the clock.
    fn figures(_: &Self::Outcome, summary: &Self::Summary) -> Figures {
        let mut figures = Figures::new();
        if let Ok(value) = serde_json::to_value(summary) {
            add_numbers(&mut figures, "", &value);
        }
        figures
    }

    /// What its search was for and what it came to, for a sweep to set searches beside one another; nothing where none was made.
    fn searched(_: &Solved<'_, Self>) -> Searched {
        Searched::default()
    }
}

/// A search of a study.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Searched {
    /// What it made small, each in words with its unit.
    pub objectives: Vec<String>,
    /// What it had come to on its way.
    pub reached: Vec<Reached>,
    /// The front at its end, a row of costs for each member; empty for one objective.
    pub front: Vec<Vec<f64>>,
}

/// What a study was about.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Subject {
    /// Seed of all random numbers.
    pub seed: u64,
    /// The car.
    pub car: String,
    /// The log, if one was read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log: Option<String>,
    /// The track, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub track: Option<String>,
}

impl Subject {
    /// A car on a track.
    pub fn on_track(seed: u64, car: &str, track: &str) -> Self {
        Self {
            seed,
            car: car.to_owned(),
            log: None,
            track: Some(track.to_owned()),
        }
    }

    /// Track and car in words.
    pub fn words(&self) -> String {
        format!("{} with the {}", self.track_name(), self.car)
    }

    /// The track's name.
    pub fn track_name(&self) -> &str {
        self.track.as_deref().unwrap_or_default()
    }
}

/// The head of a summary, and of the manifest: what the study was about, and how it ran.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Head {
    /// The study.
    pub study: String,
    /// What it was about.
    #[serde(flatten)]
    pub subject: Subject,
    /// How it ran.
    #[serde(flatten)]
    pub record: RunRecord,
}

/// Ends of keys whose figures depend on the clock.
const CLOCK: [&str; 3] = ["elapsed_s", "_per_s", "dispatch_ms"];

/// Adds the numbers of a JSON value, those within objects by dotted names.
fn add_numbers(figures: &mut Figures, place: &str, value: &serde_json::Value) {
    match value {
        serde_json::Value::Object(entries) => {
            for (key, value) in entries {
                let dot = if place.is_empty() { "" } else { "." };
                add_numbers(figures, &format!("{place}{dot}{key}"), value);
            }
        }
        // The seed is one of the settings.
        serde_json::Value::Number(number)
            if place != "seed" && !CLOCK.iter().any(|end| place.ends_with(end)) =>
        {
            figures.insert(place.to_owned(), number.as_f64());
        }
        _ => {}
    }
}

/// A study, whichever it is.
pub trait AnyStudy: Sync {
    /// [`Study::NAME`].
    fn name(&self) -> &'static str;
    /// [`Study::ABOUT`].
    fn about(&self) -> &'static str;
    /// [`Study::DETAILS`].
    fn details(&self) -> &'static str;
    /// What is declared of its settings.
    fn declared(&self) -> Vec<Declared>;
    /// Whether a flag's value can be understood.
    ///
    /// # Errors
    /// What is expected, in words.
    fn check_flag(&self, key: &str, text: &str) -> Result<(), String>;
    /// Its default value as TOML, for help texts.
    fn default_of(&self, key: &str) -> Option<String>;
    /// A commented study file with every setting at its default.
    fn template(&self) -> String;
    /// [`Study::check`].
    ///
    /// # Errors
    /// As there.
    fn check(&self, path: &Path) -> Result<String>;
    /// Whether a file holds its settings. Files that these name are not read.
    ///
    /// # Errors
    /// As [`Settings::read`].
    fn read_settings(&self, path: &Path) -> Result<()>;
    /// [`State::KINDS`].
    fn state_kinds(&self) -> &'static [&'static str];
    /// Reads a saved state and gives the bytes of a checkpoint of it.
    ///
    /// # Errors
    /// As [`State::load`].
    fn read_state(&self, file: &Path) -> Result<Vec<u8>>;
    /// Runs it as a request says.
    ///
    /// # Errors
    /// Those of the study.
    fn run(&self, request: Request<'_>) -> Result<Answer>;
}

/// A study's place in the registry.
pub struct Entry<S>(PhantomData<fn() -> S>);

impl<S> Entry<S> {
    /// The place.
    pub const NEW: Self = Self(PhantomData);
}

impl<S: Study> AnyStudy for Entry<S> {
    fn name(&self) -> &'static str {
        S::NAME
    }

    fn about(&self) -> &'static str {
        S::ABOUT
    }

    fn details(&self) -> &'static str {
        S::DETAILS
    }

    fn declared(&self) -> Vec<Declared> {
        S::Settings::settings().into_iter().map(|s| s.declared).collect()
    }

    fn check_flag(&self, key: &str, text: &str) -> Result<(), String> {
        let settings = S::Settings::settings();
        let setting = settings.iter().find(|s| s.declared.key == key);
        setting.map_or(Ok(()), |s| s.parse(&mut S::Settings::default(), text))
    }

    fn default_of(&self, key: &str) -> Option<String> {
        use crate::config::settings::Written;
        let settings = S::Settings::settings();
        let setting = settings.iter().find(|s| s.declared.key == key)?;
        match setting.write(&S::Settings::default())? {
            Written::Value(value) => Some(value),
            Written::Table(_) | Written::Within(_) => None,
        }
    }

    fn template(&self) -> String {
        let (name, about) = (S::NAME, S::ABOUT);
        S::Settings::template(&format!(
            "A study of `lapswarm {name}`. {about}\n  lapswarm {name} this_file.toml\n\
             Every setting stands at its default; those without one are commented out. Files are relative to this one."
        ))
    }

    fn check(&self, path: &Path) -> Result<String> {
        S::check(path)
    }

    fn read_settings(&self, path: &Path) -> Result<()> {
        S::Settings::read(path).map(drop)
    }

    fn state_kinds(&self) -> &'static [&'static str] {
        S::State::KINDS
    }

    fn read_state(&self, file: &Path) -> Result<Vec<u8>> {
        checkpoint::to_bytes(&S::State::load(file)?)
    }

    fn run(&self, request: Request<'_>) -> Result<Answer> {
        run::<S>(request)
    }
}

/// Whether any of these settings says where candidates are evaluated.
pub(super) fn moves<S: Settings>(keys: &[(String, String)]) -> bool {
    S::settings()
        .iter()
        .filter(|s| s.declared.role == Role::Place)
        .any(|s| keys.iter().any(|(key, _)| key == s.declared.key))
}

/// Sets what flags say.
///
/// # Errors
/// [`Error::Input`] naming the setting.
pub(super) fn apply<S: Settings>(settings: &mut S, flags: &[(String, String)]) -> Result<()> {
    let declared = S::settings();
    for (key, text) in flags {
        let Some(setting) = declared.iter().find(|s| s.declared.key == key) else {
            continue;
        };
        setting
            .parse(settings, text)
            .map_err(|expected| Error::input("the study", key, text.clone(), expected))?;
    }
    Ok(())
}
