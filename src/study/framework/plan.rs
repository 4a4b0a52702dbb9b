//! What a study would do, said and not done.

use crate::config::settings::Settings;
use crate::error::Result;
use crate::evaluate::{BackendChoice, BackendInfo};
use crate::files::run_folder;
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What a study would do. Whoever makes one has read and checked all that the study would read before it begins.
#[derive(Clone, Default, Serialize)]
pub struct Plan {
    study: &'static str,
    dry_run: bool,
    seed: Option<u64>,
    backend: Option<&'static str>,
    adapter: Option<String>,
    evaluations: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    polish_drives: Option<u64>,
    memory_mib: Option<u64>,
    folder: PathBuf,
    folder_exists: bool,
    reads: Vec<String>,
    settings: Value,
}

impl Plan {
    /// Of a study with these settings.
    pub fn of<S: Settings>(study: &'static str, settings: &S) -> Self {
        Self::of_file(study, &settings.to_toml())
    }

    /// Of a study whose settings are this file's.
    pub fn of_file(study: &'static str, toml: &str) -> Self {
        // A seed beyond what TOML holds leaves the text as it is.
        Self::with(
            study,
            toml::from_str(toml).unwrap_or_else(|_| Value::String(toml.to_owned())),
        )
    }

    /// Of a study of these settings.
    pub fn with(study: &'static str, settings: Value) -> Self {
        Self {
            study,
            dry_run: true,
            settings,
            ..Self::default()
        }
    }

    /// Random numbers begin with this.
    pub fn seed(self, seed: u64) -> Self {
        let seed = Some(seed);
        Self { seed, ..self }
    }

    /// Candidates would be evaluated there; the device is looked for.
    ///
    /// # Errors
    /// [`crate::Error::NoDevice`] if a GPU was asked for and none fits.
    pub fn backend(self, choice: BackendChoice, adapter: Option<&str>) -> Result<Self> {
        Ok(self.evaluated_by(choice.would_be(adapter)?))
    }

    /// Candidates would be evaluated by this.
    pub fn evaluated_by(self, backend: BackendInfo) -> Self {
        Self {
            backend: Some(backend.backend),
            adapter: Some(backend.device),
            ..self
        }
    }

    /// Candidates would be evaluated by what evaluates those of another plan.
    pub fn on_device_of(self, other: &Self) -> Self {
        Self {
            backend: other.backend,
            adapter: other.adapter.clone(),
            ..self
        }
    }

    /// So many at the most.
    pub fn evaluations(self, evaluations: u64) -> Self {
        let evaluations = Some(evaluations);
        Self { evaluations, ..self }
    }

    /// So many cars at the most are driven after the swarm, to polish what it found.
    pub fn polish_drives(self, drives: u64) -> Self {
        let polish_drives = (drives > 0).then_some(drives);
        Self {
            polish_drives,
            ..self
        }
    }

    /// How many those are; none where nothing is polished.
    pub fn most_polish_drives(&self) -> u64 {
        self.polish_drives.unwrap_or(0)
    }

    /// How many candidates are evaluated, where that is known.
    pub fn most_evaluations(&self) -> Option<u64> {
        self.evaluations
    }

    /// This much would be kept (MiB).
    pub fn memory_mib(self, memory_mib: u64) -> Self {
        let memory_mib = Some(memory_mib);
        Self { memory_mib, ..self }
    }

    /// This has been read, in words.
    pub fn reads(mut self, what: impl Into<String>) -> Self {
        self.reads.push(what.into());
        self
    }

    /// It would be done in this folder, which is looked at and not touched.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if the folder that was asked for holds anything.
    pub fn into_folder(mut self, asked: Option<&Path>) -> Result<Self> {
        self.folder = run_folder::would_be(self.study, asked)?;
        self.folder_exists = self.folder.is_dir();
        Ok(self)
    }

    /// The plan in words.
    pub fn to_text(&self) -> String {
        let mut text = format!("A dry run of {}: nothing is written.\n", self.study);
        let mut row = |name: &str, value: String| text += &format!("  {name:<12} {value}\n");
        for what in &self.reads {
            row("read", what.clone());
        }
        if let (Some(backend), Some(adapter)) = (self.backend, &self.adapter) {
            row("backend", format!("{backend}, {adapter}"));
        }
        let most = self.evaluations.map(|n| format!("{n} at the most"));
        let unknown = || "as many as the search comes to".to_owned();
        row("evaluations", most.unwrap_or_else(unknown));
        if let Some(drives) = self.polish_drives {
            row(
                "polish",
                format!(
                    "{drives} drives at the most after that, in f64, with the exact Jacobian of each step"
                ),
            );
        }
        if let Some(mib) = self.memory_mib {
            row("memory", format!("{mib} MiB kept, evaluators beside"));
        }
        let there = if self.folder_exists {
            "is there, and empty"
        } else {
            "would be made"
        };
        row("folder", format!("{}, {there}", self.folder.display()));
        text += "Settings:\n";
        settings_text(&mut text, "", &self.settings);
        text
    }
}

/// Settings as lines `name = value`, tables within by dotted names.
fn settings_text(text: &mut String, place: &str, value: &Value) {
    match value {
        Value::Object(table) => {
            for (key, value) in table {
                let dot = if place.is_empty() { "" } else { "." };
                settings_text(text, &format!("{place}{dot}{key}"), value);
            }
        }
        Value::String(whole) if place.is_empty() => *text += whole,
        value => *text += &format!("  {place} = {value}\n"),
    }
}
