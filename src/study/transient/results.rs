//! What a drive leaves behind.

use super::drive::{AGREEMENT, DrivenLine, INTERVAL_S};
use super::{Prepared, TransientSettings};
use crate::error::Result;
use crate::report::{Table, write_whole};
use crate::study::framework::RunRecord;
use glam::DVec2;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The figures of one line alone; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct LineSummary {
    /// `transient`.
    pub study: String,
    /// Seed of all random numbers: none are drawn.
    pub seed: u64,
    /// How the study ran: the drive is in `f64`, and candidates are laps.
    #[serde(flatten)]
    pub record: RunRecord,
    /// The car.
    pub car: String,
    /// The greatest share of the envelope's grip that was held.
    pub grip_share: f64,
    /// The driven lap (s).
    pub lap_time_s: f64,
    /// The quasi-steady-state lap on the same line with that share of the grip (s).
    pub point_mass_lap_time_s: f64,
    /// How far the driven lap is off that (%).
    pub disagreement_percent: f64,
    /// Whether that is within what is asked for.
    pub agrees: bool,
    /// By what the lap was chosen among those with other shares of the grip.
    pub rule: String,
    /// Least room between the car's side and an edge (m).
    pub margin_m: f64,
    /// Greatest distance of the car from the line (m).
    pub greatest_offset_m: f64,
    /// What became of the car at the least share that failed.
    pub beyond: Option<String>,
}

/// Puts the figures together.
pub(super) fn summarise(
    settings: &TransientSettings,
    prepared: &Prepared,
    outcome: &DrivenLine,
) -> LineSummary {
    let agrees = outcome.disagreement().abs() <= AGREEMENT;
    let rule = if agrees {
        "the greatest share of the grip at which the driven lap and the quasi-steady-state lap agree to half a percent"
    } else {
        "the share of the grip at which the driven lap and the quasi-steady-state lap agree best, for they do to half a percent at none"
    };
    LineSummary {
        study: "transient".to_owned(),
        seed: settings.seed,
        record: outcome.record.clone(),
        car: prepared.car.name.clone(),
        grip_share: outcome.grip_share,
        lap_time_s: outcome.lap_time_s,
        point_mass_lap_time_s: outcome.point_mass.lap_time_s().unwrap_or(f64::NAN),
        disagreement_percent: 100.0 * outcome.disagreement(),
        agrees,
        rule: rule.to_owned(),
        margin_m: outcome.margin_m,
        greatest_offset_m: outcome.drive.offset_m.iter().fold(0.0, |a, b| a.max(b.abs())),
        beyond: outcome.failures.last().map(|(_, why)| why.clone()),
    }
}

impl LineSummary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let beyond = self
            .beyond
            .as_ref()
            .map_or(String::new(), |why| format!("Beyond it {why}.\n"));
        format!(
            "{} drives the line in {:.3} s, with {:.0}% of the envelope's grip; the quasi-steady-state lap with as much takes {:.3} s \
             ({:+.2}%{}).\n{beyond}Chosen: {}.\nAt most {:.2} m off the line; {:.2} m left between the car's side and the edge.\n",
            self.car,
            self.lap_time_s,
            100.0 * self.grip_share,
            self.point_mass_lap_time_s,
            self.disagreement_percent,
            if self.agrees {
                ""
            } else {
                ", more than the half percent asked for"
            },
            self.rule,
            self.greatest_offset_m,
            self.margin_m
        )
    }
}

/// Writes `drive.csv`, `envelope_driven.csv`, `speeds.svg`, `map.svg` and `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub(super) fn report(folder: &Path, outcome: &DrivenLine, summary: &LineSummary) -> Result<()> {
    write_whole(
        folder.join("envelope_driven.csv"),
        outcome.envelope.to_csv().as_bytes(),
    )?;
    let drive = &outcome.drive;
    let driven_m = driven_m(outcome);
    let state = |k: usize| -> Vec<f64> { drive.states.iter().map(|s| s[k]).collect() };
    let (x, y): (Vec<f64>, Vec<f64>) = driven_m.iter().map(|p| (p.x, p.y)).unzip();
    let steer: Vec<f64> = drive.inputs.iter().map(|(_, steer)| *steer).collect();
    let time = (0..drive.states.len()).map(|i| i as f64 * INTERVAL_S);
    Table::new()
        .numbers("time", "s", time.collect::<Vec<f64>>())
        .numbers("station", "m", &drive.station_m)
        .numbers("offset", "m", &drive.offset_m)
        .numbers("x", "m", x)
        .numbers("y", "m", y)
        .numbers("vx", "m/s", state(0))
        .numbers("vy", "m/s", state(1))
        .numbers("yaw_rate", "rad/s", state(2))
        .numbers("roll", "rad", state(3))
        .numbers("steering", "rad", steer)
        .write_csv(folder.join("drive.csv"))?;
    super::page::write(folder, outcome, summary, &driven_m)
}

/// Where the car went (m).
fn driven_m(outcome: &DrivenLine) -> Vec<DVec2> {
    let (line, drive) = (&outcome.line, &outcome.drive);
    let places = drive.station_m.iter().zip(&drive.offset_m);
    places
        .map(|(station, offset)| {
            let heading = DVec2::from_angle(line.heading_at(*station));
            line.position_at(*station) + *offset * heading.perp()
        })
        .collect()
}
