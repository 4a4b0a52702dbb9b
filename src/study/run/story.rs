//! What a run tells, in figures and in words.

use super::RunSettings;
use crate::error::{Error, Result};
use crate::report::write_whole;
use crate::study::identify::Setup;
use crate::study::run_folder::{Manifest, write_json};
use crate::study::transient::AGREEMENT;
use crate::vehicle::{Car, Envelope};
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// One line and its drive.
#[derive(Clone, Debug, Serialize)]
pub struct RoundSummary {
    /// The fastest line's lap by the point mass within the limits that it was found for (s).
    pub planned_lap_time_s: f64,
    /// Its length (m).
    pub length_m: f64,
    /// The share of the whole envelope's grip that the car held on it.
    pub grip_share: f64,
    /// The point mass's lap with that share (s).
    pub point_mass_lap_time_s: f64,
    /// The driven lap (s).
    pub driven_lap_time_s: f64,
    /// How far the driven lap is off the point mass's (%).
    pub disagreement_percent: f64,
    /// Least room between the car's side and an edge (m).
    pub margin_m: f64,
}

fn summary_of(folder: &Path) -> Result<Value> {
    let path = folder.join("summary.json");
    let text = std::fs::read_to_string(&path).map_err(|e| Error::io(&path, "read", e))?;
    serde_json::from_str(&text)
        .map_err(|e| Error::input(&path, "contents", e.to_string(), "a study's summary"))
}

fn number(value: &Value, path: &[&str]) -> f64 {
    let found = path.iter().try_fold(value, |v, key| v.get(key));
    found.and_then(Value::as_f64).unwrap_or(f64::NAN)
}

impl RoundSummary {
    /// From the summaries of a line and its drive.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Input`] if they cannot be read.
    pub(super) fn read(line: &Path, drive: &Path) -> Result<Self> {
        let (line, drive) = (summary_of(line)?, summary_of(drive)?);
        Ok(Self {
            planned_lap_time_s: number(&line, &["best", "lap_time", "lap_time_fine_s"]),
            length_m: number(&line, &["best", "lap_time", "length_m"]),
            grip_share: number(&drive, &["grip_share"]),
            point_mass_lap_time_s: number(&drive, &["point_mass_lap_time_s"]),
            driven_lap_time_s: number(&drive, &["lap_time_s"]),
            disagreement_percent: number(&drive, &["disagreement_percent"]),
            margin_m: number(&drive, &["margin_m"]),
        })
    }
}

/// What a hybrid's energy does on the line that was driven, within the limits that were held.
#[derive(Clone, Debug, Serialize)]
pub struct EnergySummary {
    /// The lap by the engine alone (s).
    pub engine_lap_time_s: f64,
    /// Its fuel (l).
    pub engine_fuel_l: f64,
    /// Fuel of the same lap with the charge sustained (l).
    pub sustaining_fuel_l: f64,
    /// The lap with the motor beside the engine, as the swarm deploys it (s).
    pub deployed_lap_time_s: f64,
    /// Energy that this takes (MJ).
    pub deployed_mj: f64,
    /// The same lap deployed exactly (s).
    pub exact_lap_time_s: f64,
}

impl EnergySummary {
    /// From the summary of a hybrid study.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Input`] if it cannot be read.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let found = summary_of(folder)?;
        Ok(Self {
            engine_lap_time_s: number(&found, &["engine_lap_time_s"]),
            engine_fuel_l: number(&found, &["engine_fuel_l"]),
            sustaining_fuel_l: number(&found, &["scenarios", "charge_sustaining", "fuel_l"]),
            deployed_lap_time_s: number(&found, &["deployment", "swarm_lap_time_s"]),
            deployed_mj: number(&found, &["deployment", "swarm_deployed_mj"]),
            exact_lap_time_s: number(&found, &["deployment", "exact_lap_time_s"]),
        })
    }
}

/// The figures of a run; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `run`.
    pub study: &'static str,
    /// Seed of all random numbers.
    pub seed: u64,
    /// What evaluated the cars.
    pub backend: String,
    /// Instruction set, or name of the adapter.
    pub adapter: String,
    /// Time taken (s).
    pub elapsed_s: f64,
    /// Cars evaluated by the identification's swarm.
    pub evaluations: u64,
    /// The same per second.
    pub evaluations_per_s: f64,
    /// The log.
    pub log: String,
    /// The car.
    pub car: String,
    /// Total parameter error of the identified car, where the truth is known.
    pub total_parameter_error: Option<f64>,
    /// Root mean square errors of the identified car, as its summary has them.
    pub rms_error: Value,
    /// Lateral acceleration that the car can hold at 25 and at 65 m/s (m/s^2).
    pub ay_mps2: [f64; 2],
    /// Greatest speed (m/s).
    pub top_speed_mps: f64,
    /// The lines, one after the other.
    pub rounds: Vec<RoundSummary>,
    /// What a hybrid's energy does; nothing for a car without.
    pub energy: Option<EnergySummary>,
    /// Whether the last driven lap agrees with the point mass's to half a percent.
    pub agrees: bool,
    /// Stages that were taken from earlier runs.
    pub reused: Vec<String>,
}

impl Summary {
    #[allow(clippy::too_many_arguments)] // One for each stage; they meet only here.
    pub(super) fn put_together(
        settings: &RunSettings,
        setup: &Setup,
        identified: &Path,
        car: &Car,
        envelope: &Envelope,
        rounds: Vec<RoundSummary>,
        reused: Vec<String>,
        elapsed_s: f64,
    ) -> Result<Self> {
        let found = summary_of(identified)?;
        let text = |key: &str| {
            found
                .get(key)
                .and_then(Value::as_str)
                .unwrap_or_default()
                .to_owned()
        };
        Ok(Self {
            study: "run",
            seed: settings.identify.seed,
            backend: text("backend"),
            adapter: text("adapter"),
            elapsed_s,
            evaluations: found.get("evaluations").and_then(Value::as_u64).unwrap_or(0),
            evaluations_per_s: number(&found, &["evaluations_per_s"]),
            log: setup.log.source.clone(),
            car: car.name.clone(),
            total_parameter_error: found.get("total_parameter_error").and_then(Value::as_f64),
            rms_error: found.get("rms_error").cloned().unwrap_or(Value::Null),
            ay_mps2: [25.0, 65.0].map(|v| envelope.at(v).ay_mps2),
            top_speed_mps: envelope.top_speed_mps(),
            agrees: rounds
                .last()
                .is_some_and(|r| r.disagreement_percent.abs() <= 100.0 * AGREEMENT),
            rounds,
            energy: None,
            reused,
        })
    }

    /// The figures in words.
    pub fn to_text(&self) -> String {
        let rms = |channel: &str| number(&self.rms_error, &[channel]);
        let mut text = format!("The car    {} drove {}.\n", self.car, self.log);
        text += &format!(
            "           Refitted, it follows the log to {:.2e} m/s, {:.2e} m/s^2 across and {:.2e} rad/s rms",
            rms("vx"),
            rms("ay"),
            rms("yaw_rate")
        );
        if let Some(error) = self.total_parameter_error {
            text += &format!("; its parameters are off the truth by {error:.1e} in all");
        }
        text += &format!(
            ".\nIts limits {:.1} m/s^2 across at 25 m/s, {:.1} at 65; {:.1} m/s at most.\n",
            self.ay_mps2[0], self.ay_mps2[1], self.top_speed_mps
        );
        for (number, r) in self.rounds.iter().enumerate() {
            text += &format!(
                "Line {}     {:.0} m, planned in {:.2} s. The car itself, driven, holds {:.0}% of its grip on it and laps in {:.2} s, \
                 {:+.2}% from the point mass with as much grip; {:.2} m left to the edge.\n",
                number + 1,
                r.length_m,
                r.planned_lap_time_s,
                100.0 * r.grip_share,
                r.driven_lap_time_s,
                r.disagreement_percent,
                r.margin_m
            );
        }
        if let Some(e) = &self.energy {
            text += &format!(
                "Energy     By the engine alone the line takes {:.2} s and {:.2} l; the same lap with the charge sustained {:.2} l. \
                 Deployed where it pays, {:.2} MJ buy {:.2} s (the exact optimum {:.2} s).\n",
                e.engine_lap_time_s,
                e.engine_fuel_l,
                e.sustaining_fuel_l,
                e.deployed_mj,
                e.engine_lap_time_s - e.deployed_lap_time_s,
                e.engine_lap_time_s - e.exact_lap_time_s
            );
        }
        if !self.reused.is_empty() {
            text += &format!("Taken from earlier runs: {}.\n", self.reused.join(", "));
        }
        text + &format!(
            "{:.1} s in all, {} {}.\n",
            self.elapsed_s, self.backend, self.adapter
        )
    }

    /// Writes `summary.json`, `manifest.json`, `story.txt` and `report.html`; the longest dispatch (ms) is that of all stages
    /// that were not taken from earlier runs.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be written.
    pub(super) fn write(&self, folder: &Path, longest_dispatch_ms: Option<f64>) -> Result<()> {
        write_json(&folder.join("summary.json"), self)?;
        write_whole(folder.join("story.txt"), self.to_text().as_bytes())?;
        let manifest = Manifest {
            program: "lapswarm",
            version: env!("CARGO_PKG_VERSION"),
            study: self.study,
            seed: self.seed,
            backend: &self.backend,
            adapter: &self.adapter,
            driver: "",
            log: Some(&self.log),
            track: None,
            car: &self.car,
            settings: "",
            interrupted: false,
            longest_dispatch_ms,
            device_faults: &[],
        };
        super::page::write(folder, self)?;
        // Last: it says that the run is whole.
        write_json(&folder.join("manifest.json"), &manifest)
    }
}
