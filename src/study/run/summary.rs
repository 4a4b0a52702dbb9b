//! What a run tells, in figures and in words.

use crate::error::{Error, Result};
use crate::evaluate::line::LineObjective;
use crate::study::framework::RunRecord;
use crate::study::hybrid::HybridSummary;
use crate::study::raceline;
use crate::study::transient::{self, keeps_up};
use crate::vehicle::Reached;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One line and its drive.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RoundSummary {
    /// The quasi-steady-state lap of the fastest line within the limits that it was found for (s).
    pub planned_lap_time_s: f64,
    /// Its length (m).
    pub length_m: f64,
    /// The share of the whole envelope's grip that the car held on it.
    pub grip_share: f64,
    /// The quasi-steady-state lap with that share (s).
    pub point_mass_lap_time_s: f64,
    /// The driven lap (s).
    pub driven_lap_time_s: f64,
    /// How far the driven lap is off the quasi-steady-state lap (%).
    pub disagreement_percent: f64,
    /// Least room between the car's side and an edge (m).
    pub margin_m: f64,
}

impl RoundSummary {
    /// From the figures of a line and its drive.
    ///
    /// # Errors
    /// [`Error::Study`] if there is no fastest line, or several were driven.
    pub(super) fn of(line: &raceline::Summary, drive: &transient::Summary) -> Result<Self> {
        let fastest = line.best.get(LineObjective::LapTime.name());
        let (Some(fastest), transient::Summary::Line(drive)) = (fastest, drive) else {
            let text = "a run needs the fastest line: objectives of raceline without lap_time";
            return Err(Error::Study(text.to_owned()));
        };
        Ok(Self {
            planned_lap_time_s: fastest.lap_time_fine_s,
            length_m: fastest.length_m,
            grip_share: drive.grip_share,
            point_mass_lap_time_s: drive.point_mass_lap_time_s,
            driven_lap_time_s: drive.lap_time_s,
            disagreement_percent: drive.disagreement_percent,
            margin_m: drive.margin_m,
        })
    }

    /// Whether the driven lap keeps up with the quasi-steady-state lap.
    pub(super) fn agrees(&self) -> bool {
        keeps_up(0.01 * self.disagreement_percent)
    }
}

/// What a hybrid's energy does on the line that was driven, within the limits that were held.
#[derive(Clone, Debug, Serialize, Deserialize)]
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
    /// From the figures of a hybrid study.
    ///
    /// # Errors
    /// [`Error::Study`] if it has no lap with the charge sustained, or deployed nothing.
    pub(super) fn of(found: &HybridSummary) -> Result<Self> {
        let sustaining = found.scenarios.get("charge_sustaining");
        let (Some(sustaining), Some(deployment)) = (sustaining, &found.deployment) else {
            let text = "the hybrid study of a run has no charge_sustaining scenario or no deployment";
            return Err(Error::Study(text.to_owned()));
        };
        Ok(Self {
            engine_lap_time_s: found.engine_lap_time_s,
            engine_fuel_l: found.engine_fuel_l,
            sustaining_fuel_l: sustaining.fuel_l,
            deployed_lap_time_s: deployment.swarm_lap_time_s,
            deployed_mj: deployment.swarm_deployed_mj,
            exact_lap_time_s: deployment.exact_lap_time_s,
        })
    }
}

/// The figures of a run; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// `run`.
    pub study: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How the run ran: cars evaluated by the identification's swarm, and the time of all stages.
    #[serde(flatten)]
    pub record: RunRecord,
    /// The log.
    pub log: String,
    /// The car.
    pub car: String,
    /// Total parameter error of the identified car, where the truth is known.
    pub total_parameter_error: Option<f64>,
    /// Root mean square errors of the identified car, as its summary has them.
    pub rms_error: BTreeMap<String, f64>,
    /// Speeds for which the limits are told: 25 and 65 m/s, or the top speed (m/s).
    #[serde(default = "speeds_told")]
    pub told_at_mps: [f64; 2],
    /// Lateral acceleration that the car can hold at these speeds (m/s^2).
    pub ay_mps2: [f64; 2],
    /// What the log reached about these speeds (m/s^2), where it came to them: limits beyond it are extrapolated.
    #[serde(default)]
    pub ay_in_the_log_mps2: [Option<f64>; 2],
    /// Greatest speed (m/s).
    pub top_speed_mps: f64,
    /// The lines, one after the other.
    pub rounds: Vec<RoundSummary>,
    /// What a hybrid's energy does; nothing for a car without.
    pub energy: Option<EnergySummary>,
    /// Whether the last driven lap is half a percent behind the quasi-steady-state lap at most.
    pub agrees: bool,
    /// Stages that were taken from earlier runs.
    pub reused: Vec<String>,
}

/// The speeds of summaries that do not say.
fn speeds_told() -> [f64; 2] {
    super::SPEEDS_TOLD_MPS
}

impl Summary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let rms = |channel: &str| self.rms_error.get(channel).copied().unwrap_or(f64::NAN);
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
            ".\nIts limits {:.1} m/s^2 across at {:.0} m/s, {:.1} at {:.0}; {:.1} m/s at most.\n",
            self.ay_mps2[0], self.told_at_mps[0], self.ay_mps2[1], self.told_at_mps[1], self.top_speed_mps
        );
        let beyond = [0, 1].map(|k| !Reached::supports(self.ay_in_the_log_mps2[k], self.ay_mps2[k]));
        if beyond.contains(&true) {
            let in_the_log = |k: usize| {
                let reached: Option<f64> = self.ay_in_the_log_mps2[k];
                reached.map_or("nothing".to_owned(), |ay| format!("{ay:.1} m/s^2"))
            };
            text += &format!(
                "           The log reached {} and {} at these speeds: limits beyond are extrapolated by the tyre model.\n",
                in_the_log(0),
                in_the_log(1)
            );
        }
        for (number, r) in self.rounds.iter().enumerate() {
            text += &format!(
                "Line {}     {:.0} m, planned in {:.2} s. The car itself, driven, holds {:.0}% of its grip on it and laps in {:.2} s, \
                 {:+.2}% from the quasi-steady-state lap with as much grip; {:.2} m left to the edge.\n",
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
                 Deployed where it pays, {:.2} MJ buy {:.2} s (the reference optimum {:.2} s).\n",
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
            self.record.elapsed_s, self.record.backend, self.record.adapter
        )
    }
}
