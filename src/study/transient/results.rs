//! What a drive leaves behind.

use super::{AGREEMENT, INTERVAL_S, Outcome};
use crate::error::Result;
use crate::evaluate::BackendInfo;
use crate::report::{
    Cells, Column, Curve, CurvePanel, TrackMap, plot_curves, plot_track_map, write_csv, write_whole,
};
use crate::study::run_folder::{Manifest, write_json};
use glam::DVec2;
use serde::Serialize;
use std::path::Path;

/// The figures of a drive; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `transient`.
    pub study: &'static str,
    /// Seed of all random numbers: none are drawn.
    pub seed: u64,
    /// `cpu`: the drive is in `f64`.
    pub backend: &'static str,
    /// `f64 reference`.
    pub adapter: &'static str,
    /// Time taken (s).
    pub elapsed_s: f64,
    /// Laps driven.
    pub evaluations: usize,
    /// Laps per second.
    pub evaluations_per_s: f64,
    /// The car.
    pub car: String,
    /// The greatest share of the envelope's grip that was held.
    pub grip_share: f64,
    /// The driven lap (s).
    pub lap_time_s: f64,
    /// The point mass's lap on the same line with that share of the grip (s).
    pub point_mass_lap_time_s: f64,
    /// How far the driven lap is off the point mass's (%).
    pub disagreement_percent: f64,
    /// Whether that is within what is asked for.
    pub agrees: bool,
    /// By what the lap was chosen among those with other shares of the grip.
    pub rule: &'static str,
    /// Least room between the car's side and an edge (m).
    pub margin_m: f64,
    /// Greatest distance of the car from the line (m).
    pub greatest_offset_m: f64,
    /// What became of the car at the least share that failed.
    pub beyond: Option<String>,
}

/// Puts the figures together.
pub fn summarise(car: &str, outcome: &Outcome, elapsed_s: f64) -> Summary {
    let drives = outcome.failures.len() + 1;
    Summary {
        study: "transient",
        seed: 1,
        backend: "cpu",
        adapter: "f64 reference",
        elapsed_s,
        evaluations: drives,
        evaluations_per_s: drives as f64 / elapsed_s.max(1e-9),
        car: car.to_owned(),
        grip_share: outcome.grip_share,
        lap_time_s: outcome.lap_time_s,
        point_mass_lap_time_s: outcome.point_mass.lap_time_s().unwrap_or(f64::NAN),
        disagreement_percent: 100.0 * outcome.disagreement(),
        agrees: outcome.disagreement().abs() <= AGREEMENT,
        rule: if outcome.disagreement().abs() <= AGREEMENT {
            "the greatest share of the grip at which the driven lap and the point mass's agree to half a percent"
        } else {
            "the share of the grip at which the driven lap and the point mass's agree best, for they do to half a percent at none"
        },
        margin_m: outcome.margin_m,
        greatest_offset_m: outcome.drive.offset_m.iter().fold(0.0, |a, b| a.max(b.abs())),
        beyond: outcome.failures.last().map(|(_, why)| why.clone()),
    }
}

impl Summary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let beyond = self
            .beyond
            .as_ref()
            .map_or(String::new(), |why| format!("Beyond it {why}.\n"));
        format!(
            "{} drives the line in {:.3} s, with {:.0}% of the envelope's grip; the point mass with as much laps in {:.3} s \
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

/// Writes `summary.json`, `manifest.json`, `drive.csv`, `envelope_driven.csv`, `speeds.svg`, `map.svg` and `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub fn write_results(folder: &Path, outcome: &Outcome, summary: &Summary) -> Result<()> {
    write_json(&folder.join("summary.json"), summary)?;
    write_whole(
        folder.join("envelope_driven.csv"),
        outcome.envelope.to_csv().as_bytes(),
    )?;
    let drive = &outcome.drive;
    let state = |k: usize| -> Vec<f64> { drive.states.iter().map(|s| s[k]).collect() };
    let (vx, vy, yaw_rate, roll) = (state(0), state(1), state(2), state(3));
    let time: Vec<f64> = (0..vx.len()).map(|i| i as f64 * INTERVAL_S).collect();
    let steer: Vec<f64> = drive.inputs.iter().map(|(_, steer)| *steer).collect();
    let (x, y): (Vec<f64>, Vec<f64>) = driven_m(outcome).iter().map(|p| (p.x, p.y)).unzip();
    let table: [(&str, &str, &[f64]); 10] = [
        ("time", "s", &time),
        ("station", "m", &drive.station_m),
        ("offset", "m", &drive.offset_m),
        ("x", "m", &x),
        ("y", "m", &y),
        ("vx", "m/s", &vx),
        ("vy", "m/s", &vy),
        ("yaw_rate", "rad/s", &yaw_rate),
        ("roll", "rad", &roll),
        ("steering", "rad", &steer),
    ];
    let columns = table.map(|(name, unit, values)| Column {
        name,
        unit,
        cells: Cells::Numbers(values),
    });
    write_csv(folder.join("drive.csv"), &columns)?;

    let curve = |label, x: &[f64], y: &[f64]| Curve {
        label,
        x: x.to_vec(),
        y: y.to_vec(),
        shade: None,
    };
    let mut speeds = vec![curve("4DOF car and driver", &drive.station_m, &vx)];
    if let Some(lap) = &outcome.point_mass.lap {
        speeds.push(curve("point mass", &lap.station_m, &lap.v_mps));
    }
    let panel = |title, y_label, curves| CurvePanel {
        title,
        x_label: "distance along the line (m)",
        y_label,
        curves,
    };
    let panels = [
        panel("Speed", "speed (m/s)", speeds),
        panel(
            "Off the line",
            "distance to the left (m)",
            vec![curve("", &drive.station_m, &drive.offset_m)],
        ),
        panel(
            "Steering",
            "road-wheel angle (rad)",
            vec![curve("", &drive.station_m, &steer)],
        ),
        panel(
            "Lateral speed",
            "to the left (m/s)",
            vec![curve("", &drive.station_m, &vy)],
        ),
    ];
    plot_curves(folder.join("speeds.svg"), "The line, driven", &panels)?;
    plot_map(folder, outcome, &vx)?;
    let backend = BackendInfo {
        backend: summary.backend,
        device: summary.adapter.to_owned(),
        driver: String::new(),
    };
    // Flags say all there is to say.
    let manifest = Manifest {
        settings: "",
        ..Manifest::new("transient", summary.seed, &backend, &summary.car)
    };
    super::page::write(folder, outcome, summary, &driven_m(outcome))?;
    // Last: it says that the run is whole.
    write_json(&folder.join("manifest.json"), &manifest)
}

/// Where the car went (m).
fn driven_m(outcome: &Outcome) -> Vec<DVec2> {
    let (line, drive) = (&outcome.line, &outcome.drive);
    let places = drive.station_m.iter().zip(&drive.offset_m);
    places
        .map(|(station, offset)| {
            let heading = DVec2::from_angle(line.heading_at(*station));
            line.position_at(*station) + *offset * heading.perp()
        })
        .collect()
}

fn plot_map(folder: &Path, outcome: &Outcome, speed_mps: &[f64]) -> Result<()> {
    let line = &outcome.line;
    let driven = driven_m(outcome);
    plot_track_map(
        folder.join("map.svg"),
        &TrackMap {
            title: &format!("Driven in {:.2} s", outcome.lap_time_s),
            // Of the road, what the car's middle may use.
            left_edge_m: &line.left_edge(),
            right_edge_m: &line.right_edge(),
            line_m: &driven,
            values: speed_mps,
            value_label: "speed",
            value_unit: "m/s",
            closed: true,
            names: Vec::new(),
        },
    )
}
