//! Tables and figure of the surface of lateral acceleration.

use crate::error::Result;
use crate::evaluate::{Failure, failures_in_words};
use crate::report::{Levels, Surface, Table};
use crate::study::envelope::{SteadySurface, SurfaceFigures};
use crate::study::framework::RunRecord;
use std::path::Path;

/// What the surface is, in words.
pub const ABOUT: &str = "Lateral acceleration that a car settles at under a held steering angle and path speed, without drive \
                         along the path, and its ridge. Where nothing is drawn, no car settled.";

/// The surface's figures in words.
pub fn in_words(p: &SurfaceFigures, record: &RunRecord) -> String {
    let mut text = format!(
        "Surface of {} cars in steady-state cornering, {:.0}/s, {}; failed: {}\n",
        record.evaluations,
        record.evaluations_per_s,
        record.device(),
        failures_in_words(&record.failures)
    );
    if let Some(off) = p.surface_difference_mps2 {
        text += &format!("Off the curves of steady states by {off:.1e} m/s^2 at most");
        if let (Some(off), Some(tolerance)) = (p.ridge_difference_mps2, p.ridge_tolerance_mps2) {
            text += &format!(
                "; its ridge, which the grid surrounds at {} speeds, by {off:.1e} of the {tolerance:.1e} m/s^2 that its steps and the settling leave open",
                p.ridge_speeds
            );
        }
        text += "\n";
    }
    if !p.ridge_agrees {
        text += "Warning: the ridge differs from that of the curves by more than the grid explains; the limits are the curves'.\n";
    }
    text
}

/// Writes `surface.csv` and `ridge.csv`.
pub fn write_tables(folder: &Path, surface: &SteadySurface) -> Result<()> {
    let n = surface.steers.len();
    let rows = |of: fn(&SteadySurface, usize, usize) -> f64| -> Vec<f64> {
        let all = 0..surface.failures.len();
        all.map(|i| of(surface, i / n, i % n)).collect()
    };
    let word = |f: &Option<Failure>| f.map_or("", Failure::word);
    let [ay, sideslip, yaw_rate, roll, slip_ratio] = &surface.figures;
    Table::new()
        .numbers("v", "m/s", rows(|s, i, _| s.speeds[i]))
        .numbers("steer", "rad", rows(|s, _, k| s.steers[k]))
        .numbers("ay", "m/s^2", ay)
        .numbers("sideslip_magnitude", "rad", sideslip)
        .numbers("yaw_rate_magnitude", "rad/s", yaw_rate)
        .numbers("roll_magnitude", "rad", roll)
        .numbers("slip_ratio_magnitude", "-", slip_ratio)
        .texts("failure", surface.failures.iter().map(word))
        .write_csv(folder.join("surface.csv"))?;
    Table::rows(&surface.ridge)
        .number("v", "m/s", |r| r.v_mps)
        .number("steer", "rad", |r| r.steer_rad)
        .number("ay", "m/s^2", |r| r.ay_mps2)
        .number("tolerance", "m/s^2", |r| r.tolerance_mps2)
        .number("ay_of_curve", "m/s^2", |r| r.exact_mps2)
        .table()
        .write_csv(folder.join("ridge.csv"))
}

/// The surface, if enough of it settled.
pub fn figure(surface: &SteadySurface, car: &str) -> Option<Surface> {
    let speeds = &surface.speeds;
    // The engine's end may lie nearer than a step; figures are even.
    let step = |i: usize| speeds[i + 1] - speeds[i];
    let uneven = speeds.len() > 2 && (step(speeds.len() - 2) - step(0)).abs() > 0.1 * step(0);
    let rows = speeds.len() - usize::from(uneven);
    let settled = surface.figures[0].iter().any(|ay| ay.is_finite());
    let marks = surface.ridge.iter().take(rows);
    (rows >= 2 && settled).then(|| Surface {
        title: format!("Lateral acceleration of the {car}, and its ridge"),
        x_label: "road-wheel angle (deg)".to_owned(),
        y_label: "speed (m/s)".to_owned(),
        z_label: "lateral acceleration (m/s\u{b2})".to_owned(),
        x: surface.steers.iter().map(|d| d.to_degrees()).collect(),
        y: speeds[..rows].to_vec(),
        z: surface.figures[0][..rows * surface.steers.len()].to_vec(),
        levels: Levels::Even,
        marks: marks
            .map(|r| (String::new(), [r.steer_rad.to_degrees(), r.v_mps]))
            .collect(),
    })
}
