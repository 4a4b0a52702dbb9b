//! Tables and pictures of a car's limits.

mod page;
mod surface;

use super::{CarLimits, PopulationSummary, SteadySurface};
use crate::error::Result;
use crate::evaluate::BackendInfo;
use crate::report::{Cells, Column, Curve, CurvePanel, plot_curves, write_csv, write_whole};
use crate::study::run_folder::{Manifest, write_json};
use serde::Serialize;
use std::path::Path;

/// The figures of the study; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct EnvelopeSummary {
    /// `envelope`.
    pub study: &'static str,
    /// Nought: nothing is drawn at random.
    pub seed: u64,
    /// The car.
    pub car: String,
    /// Time taken (s).
    pub elapsed_s: f64,
    /// Steady states found.
    pub steady_states: usize,
    /// Greatest speed (m/s).
    pub top_speed_mps: f64,
    /// Understeer gradient at the wheels, small angles, in the middle of the range of speeds (deg per g).
    pub understeer_gradient_deg_per_g: f64,
    /// Stability factor (s^2/m^2).
    pub stability_factor_s2_per_m2: f64,
    /// Characteristic speed (m/s) of a car that understeers.
    pub characteristic_speed_mps: Option<f64>,
    /// Critical speed (m/s) of a car that oversteers.
    pub critical_speed_mps: Option<f64>,
    /// The population's figures, if one was evaluated.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub population: Option<PopulationSummary>,
}

/// Puts the figures together.
pub fn summarise(
    car: &str,
    limits: &CarLimits,
    surface: Option<&SteadySurface>,
    elapsed_s: f64,
) -> EnvelopeSummary {
    /// Standard gravity (m/s^2).
    const G: f64 = 9.806_65;
    EnvelopeSummary {
        study: "envelope",
        seed: 0,
        car: car.to_owned(),
        elapsed_s,
        steady_states: limits.speeds.iter().map(|s| s.cornering.len()).sum(),
        top_speed_mps: limits.envelope.top_speed_mps(),
        understeer_gradient_deg_per_g: limits.handling.understeer_gradient.to_degrees() * G,
        stability_factor_s2_per_m2: limits.handling.stability_factor,
        characteristic_speed_mps: limits.handling.characteristic_speed_mps,
        critical_speed_mps: limits.handling.critical_speed_mps,
        population: surface.map(|s| s.summary.clone()),
    }
}

impl EnvelopeSummary {
    /// Which way the car is balanced, in words.
    fn balance(&self) -> String {
        match (self.characteristic_speed_mps, self.critical_speed_mps) {
            (Some(v), _) => format!("understeers; characteristic speed {v:.1} m/s"),
            (_, Some(v)) => format!("oversteers; critical speed {v:.1} m/s"),
            _ => "steers neutrally".to_owned(),
        }
    }

    /// The figures in words.
    pub fn to_text(&self, limits: &CarLimits) -> String {
        let mut text = format!(
            "{}: {} steady states in {:.2} s\n   v m/s   ay m/s^2   grip m/s^2   drive m/s^2   drag m/s^2\n",
            self.car, self.steady_states, self.elapsed_s
        );
        for speed in &limits.speeds {
            let r = speed.row;
            text += &format!(
                "{:8.1}{:11.2}{:13.2}{:14.2}{:13.2}\n",
                r.v_mps, r.ay_mps2, r.ax_grip_mps2, r.ax_drive_mps2, r.drag_mps2
            );
        }
        let balance = self.balance();
        text += &format!(
            "Understeer gradient {:.3} deg/g, stability factor {:.3e} s^2/m^2: {balance}\n",
            self.understeer_gradient_deg_per_g, self.stability_factor_s2_per_m2
        );
        if let Some(population) = &self.population {
            text += &surface::in_words(population);
        }
        text
    }
}

/// Writes `envelope.csv` (as `--envelope` reads it), `cornering.csv`, `summary.json`, `manifest.json`, `envelope.svg` and
/// `report.html`; with a `surface` also `surface.csv`, `ridge.csv` and `surface.svg`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub fn write_results(
    folder: &Path,
    limits: &CarLimits,
    surface: Option<&SteadySurface>,
    summary: &EnvelopeSummary,
) -> Result<()> {
    write_whole(folder.join("envelope.csv"), limits.envelope.to_csv().as_bytes())?;
    let json = serde_json::to_string_pretty(summary).unwrap_or_default();
    write_whole(folder.join("summary.json"), json.as_bytes())?;
    write_cornering(&folder.join("cornering.csv"), limits)?;
    let alone = BackendInfo {
        backend: "cpu",
        device: "f64".to_owned(),
        driver: String::new(),
    };
    let backend = surface.map_or(&alone, |s| &s.backend);
    // Nothing here is drawn at random, and flags say all there is to say.
    let manifest = Manifest {
        settings: "",
        device_faults: surface.map_or(&[], |s| &s.summary.device_faults),
        longest_dispatch_ms: surface.and_then(|s| s.longest_dispatch_ms),
        ..Manifest::new("envelope", 0, backend, &summary.car)
    };
    if let Some(surface) = surface {
        surface::write(folder, surface, &summary.car)?;
    }
    with_panels(limits, |panels| {
        plot_curves(
            folder.join("envelope.svg"),
            &format!("Limits of the {}", summary.car),
            panels,
        )?;
        page::write(folder, (limits, surface), summary, panels)
    })?;
    // Last: it says that the run is whole.
    write_json(&folder.join("manifest.json"), &manifest)
}

fn write_cornering(path: &Path, limits: &CarLimits) -> Result<()> {
    let trims: Vec<_> = limits
        .speeds
        .iter()
        .flat_map(|s| s.cornering.iter().map(|t| (s.row.v_mps, *t)))
        .collect();
    let column = |f: &dyn Fn(&(f64, crate::vehicle::Trim)) -> f64| trims.iter().map(f).collect::<Vec<f64>>();
    let table = [
        ("v", "m/s", column(&|(v, _)| *v)),
        ("steer", "rad", column(&|(_, t)| t.steer_rad)),
        ("ay", "m/s^2", column(&|(_, t)| t.ay_mps2)),
        ("yaw_rate", "rad/s", column(&|(_, t)| t.yaw_rate_radps)),
        ("sideslip", "rad", column(&|(_, t)| t.sideslip_rad)),
        ("roll", "rad", column(&|(_, t)| t.roll_rad)),
        ("slip_ratio", "-", column(&|(_, t)| t.slip_ratio)),
    ];
    let columns: Vec<Column<'_>> = table
        .iter()
        .map(|(name, unit, values)| Column {
            name,
            unit,
            cells: Cells::Numbers(values),
        })
        .collect();
    write_csv(path, &columns)
}

/// Hands the curves on, which borrow their labels.
fn with_panels(limits: &CarLimits, show: impl FnOnce(&[CurvePanel<'_>]) -> Result<()>) -> Result<()> {
    let speeds = &limits.speeds;
    let v: Vec<f64> = speeds.iter().map(|s| s.row.v_mps).collect();
    let shade = |i: usize| Some(i as f64 / (speeds.len() - 1).max(1) as f64);
    // A family of curves with every speed would be a smear.
    let every = speeds.len().div_ceil(6);
    let labels: Vec<String> = v.iter().map(|v| format!("{v:.0} m/s")).collect();
    let shown = || (0..speeds.len()).rev().step_by(every);
    let cornering = shown().map(|i| Curve {
        label: &labels[i],
        x: speeds[i]
            .cornering
            .iter()
            .map(|t| t.steer_rad.to_degrees())
            .collect(),
        y: speeds[i].cornering.iter().map(|t| t.ay_mps2).collect(),
        shade: shade(i),
    });
    let over_speed = |label, f: &dyn Fn(&super::SpeedLimits) -> f64| Curve {
        label,
        x: v.clone(),
        y: speeds.iter().map(f).collect(),
        shade: None,
    };
    let diagram = shown().map(|i| {
        let row = speeds[i].row;
        // Once round, from full drive over full cornering to full braking and back; drag taken off.
        let around = (0..=120).map(|k| std::f64::consts::TAU * f64::from(k) / 120.0);
        let (x, y) = around
            .map(|a| {
                let push = (row.ax_grip_mps2 * a.cos()).min(row.ax_drive_mps2);
                (row.ay_mps2 * a.sin(), push - row.drag_mps2)
            })
            .unzip();
        Curve {
            label: "",
            x,
            y,
            shade: shade(i),
        }
    });
    let panels = [
        CurvePanel {
            title: "Steady cornering",
            x_label: "road-wheel angle (deg)",
            y_label: "lateral acceleration (m/s\u{b2})",
            curves: cornering.collect(),
        },
        CurvePanel {
            title: "Limits of the tyres and the engine",
            x_label: "speed (m/s)",
            y_label: "acceleration (m/s\u{b2})",
            curves: vec![
                over_speed("lateral", &|s| s.row.ay_mps2),
                over_speed("braking", &|s| s.row.ax_grip_mps2),
                over_speed("traction", &|s| s.traction_mps2),
                over_speed("engine", &|s| s.engine_mps2),
                over_speed("drag", &|s| s.row.drag_mps2),
            ],
        },
        CurvePanel {
            title: "g-g-v diagram, drag included",
            x_label: "lateral acceleration (m/s\u{b2})",
            y_label: "longitudinal acceleration (m/s\u{b2})",
            curves: diagram.collect(),
        },
        CurvePanel {
            title: "Sideslip in steady cornering",
            x_label: "lateral acceleration (m/s\u{b2})",
            y_label: "sideslip (deg)",
            curves: shown()
                .map(|i| Curve {
                    label: "",
                    x: speeds[i].cornering.iter().map(|t| t.ay_mps2).collect(),
                    y: speeds[i]
                        .cornering
                        .iter()
                        .map(|t| t.sideslip_rad.to_degrees())
                        .collect(),
                    shade: shade(i),
                })
                .collect(),
        },
    ];
    show(&panels)
}
