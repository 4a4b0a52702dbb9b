//! `--dry-run`: what a study would do, said and not done.

use super::{Common, print_json};
use crate::cli::said::out;
use lapswarm::Result;
use lapswarm::evaluate::{BackendChoice, BackendInfo};
use lapswarm::study::run_folder;
use lapswarm::study::{identify, raceline};
use serde::Serialize;
use serde_json::Value;
use std::path::PathBuf;

/// What a study would do. Whoever makes one has read and checked all that the study would read before it begins.
#[derive(Serialize)]
pub struct Plan {
    study: &'static str,
    dry_run: bool,
    seed: Option<u64>,
    backend: Option<&'static str>,
    adapter: Option<String>,
    evaluations: Option<u64>,
    memory_mib: Option<u64>,
    folder: PathBuf,
    folder_exists: bool,
    reads: Vec<String>,
    settings: Value,
}

impl Plan {
    /// Of a study whose settings are this study file.
    pub fn new(study: &'static str, toml: &str) -> Self {
        // Seeds beyond what TOML holds leave the text as it is.
        let settings = toml::from_str(toml).unwrap_or_else(|_| Value::String(toml.to_owned()));
        Self::with(study, settings)
    }

    /// Of a study of these settings.
    pub fn with(study: &'static str, settings: Value) -> Self {
        Self {
            study,
            dry_run: true,
            seed: None,
            backend: None,
            adapter: None,
            evaluations: None,
            memory_mib: None,
            folder: PathBuf::new(),
            folder_exists: false,
            reads: Vec::new(),
            settings,
        }
    }

    /// Random numbers begin with this.
    pub fn seed(self, seed: u64) -> Self {
        let seed = Some(seed);
        Self { seed, ..self }
    }

    /// Candidates would be evaluated there; the device is looked for.
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

    /// So many at the most.
    pub fn evaluations(self, evaluations: u64) -> Self {
        let evaluations = Some(evaluations);
        Self { evaluations, ..self }
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

    /// A car and a log have been read.
    pub fn of_replay(self, setup: &identify::Setup) -> Self {
        let (log, replay) = (&setup.log, &setup.replay);
        let plan = self.reads(format!("car {}", replay.free.car.name)).reads(format!(
            "log {}: {} samples at {:.0} Hz, {} windows",
            log.source,
            log.samples(),
            1.0 / log.dt_s,
            replay.plan.windows.len()
        ));
        match &setup.circuit {
            Some(circuit) => plan.reads(format!("track {}, {:.1} m", circuit.name, circuit.length_m)),
            None => plan,
        }
    }

    /// A track and a car's limits have been read.
    pub fn of_road(self, setup: &raceline::Setup) -> Self {
        let (road, limits) = (&setup.road, &setup.car.envelope);
        self.reads(format!(
            "track {}, {:.1} m, {} cuts",
            setup.track_name,
            road.length_m,
            road.len()
        ))
        .reads(format!(
            "limits of {} at {} speeds up to {:.1} m/s",
            setup.car_name,
            limits.rows().len(),
            limits.top_speed_mps()
        ))
    }

    /// Says it. The folder is looked at and not touched.
    pub fn tell(mut self, common: &Common) -> Result<()> {
        self.folder = run_folder::would_be(self.study, common.out.as_deref())?;
        self.folder_exists = self.folder.is_dir();
        if !common.quiet {
            out!("{}", self.to_text());
        }
        if common.json {
            print_json(&self)?;
        }
        Ok(())
    }

    fn to_text(&self) -> String {
        let mut text = format!("A dry run of {}: nothing is written.\n", self.study);
        let mut row = |name: &str, value: String| text += &format!("  {name:<12} {value}\n");
        for what in &self.reads {
            row("read", what.clone());
        }
        if let (Some(backend), Some(adapter)) = (self.backend, &self.adapter) {
            row("backend", format!("{backend}, {adapter}"));
        }
        row(
            "evaluations",
            self.evaluations.map_or_else(
                || "as many as the search comes to".to_owned(),
                |n| format!("{n} at the most"),
            ),
        );
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
