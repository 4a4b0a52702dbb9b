//! Tables and pictures of the surface of lateral acceleration.

use crate::error::Result;
use crate::evaluate::{Failure, failures_in_words};
use crate::report::{Cells, Column, Levels, SurfaceFigure, plot_surface, write_csv};
use crate::study::envelope::{PopulationSummary, SteadySurface};
use std::path::Path;

/// What the surface is, in words.
pub const ABOUT: &str = "Lateral acceleration that a car settles at under a held steering angle and path speed, no push along \
                         the path, and its ridge. Where nothing is drawn, no car settled.";

/// The population's figures in words.
pub fn in_words(p: &PopulationSummary) -> String {
    let mut text = format!(
        "Surface of {} cars settled on circles, {:.0}/s, {} {}",
        p.evaluations, p.evaluations_per_s, p.backend, p.adapter
    );
    text += &format!("; failed: {}\n", failures_in_words(&p.failures));
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
    text + &p
        .device_faults
        .iter()
        .map(|f| format!("Note: {f}\n"))
        .collect::<String>()
}

/// Writes `surface.csv`, `ridge.csv` and `surface.svg`.
pub fn write(folder: &Path, surface: &SteadySurface, car: &str) -> Result<()> {
    let (n, m) = (surface.steers.len(), surface.failures.len());
    let v: Vec<f64> = (0..m).map(|i| surface.speeds[i / n]).collect();
    let steer: Vec<f64> = (0..m).map(|i| surface.steers[i % n]).collect();
    let word = |f: &Option<Failure>| f.map_or("", Failure::word).to_owned();
    let failures: Vec<String> = surface.failures.iter().map(word).collect();
    let [ay, sideslip, yaw_rate, roll, slip_ratio] = &surface.figures;
    let numbers = |name, unit, values| Column {
        name,
        unit,
        cells: Cells::Numbers(values),
    };
    let columns = [
        numbers("v", "m/s", &v),
        numbers("steer", "rad", &steer),
        numbers("ay", "m/s^2", ay),
        numbers("sideslip_magnitude", "rad", sideslip),
        numbers("yaw_rate_magnitude", "rad/s", yaw_rate),
        numbers("roll_magnitude", "rad", roll),
        numbers("slip_ratio_magnitude", "-", slip_ratio),
        Column {
            name: "failure",
            unit: "",
            cells: Cells::Texts(&failures),
        },
    ];
    write_csv(folder.join("surface.csv"), &columns)?;
    let of = |f: &dyn Fn(&super::super::RidgePoint) -> f64| surface.ridge.iter().map(f).collect::<Vec<f64>>();
    let table = [
        ("v", "m/s", of(&|r| r.v_mps)),
        ("steer", "rad", of(&|r| r.steer_rad)),
        ("ay", "m/s^2", of(&|r| r.ay_mps2)),
        (
            "tolerance",
            "m/s^2",
            of(&|r| r.tolerance_mps2.unwrap_or(f64::NAN)),
        ),
        ("ay_of_curve", "m/s^2", of(&|r| r.exact_mps2.unwrap_or(f64::NAN))),
    ];
    let columns: Vec<Column<'_>> = table
        .iter()
        .map(|(name, unit, values)| numbers(name, unit, values))
        .collect();
    write_csv(folder.join("ridge.csv"), &columns)?;
    with_figure(surface, car, |figure| {
        plot_surface(folder.join("surface.svg"), figure)
    })
}

/// Hands the figure on, which borrows what it is made of.
pub fn with_figure(
    surface: &SteadySurface,
    car: &str,
    show: impl FnOnce(&SurfaceFigure<'_>) -> Result<()>,
) -> Result<()> {
    let speeds = &surface.speeds;
    // The engine's end may lie nearer than a step; pictures are even.
    let step = |i: usize| speeds[i + 1] - speeds[i];
    let uneven = speeds.len() > 2 && (step(speeds.len() - 2) - step(0)).abs() > 0.1 * step(0);
    let rows = speeds.len() - usize::from(uneven);
    let settled = surface.figures[0].iter().any(|ay| ay.is_finite());
    if rows < 2 || !settled {
        return Ok(());
    }
    let degrees: Vec<f64> = surface.steers.iter().map(|d| d.to_degrees()).collect();
    let marks = surface.ridge.iter().take(rows);
    let figure = SurfaceFigure {
        title: &format!("Lateral acceleration of the {car}, and its ridge"),
        x_label: "road-wheel angle (deg)",
        y_label: "speed (m/s)",
        z_label: "lateral acceleration (m/s\u{b2})",
        x: &degrees,
        y: &speeds[..rows],
        z: &surface.figures[0][..rows * degrees.len()],
        levels: Levels::Even,
        marks: marks.map(|r| ("", [r.steer_rad.to_degrees(), r.v_mps])).collect(),
    };
    show(&figure)
}
