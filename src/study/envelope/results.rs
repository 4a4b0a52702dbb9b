//! Tables and figures of a car's g-g-v envelope.

mod page;
mod surface;

use super::{CarLimits, Outcome, SurfaceFigures};
use crate::error::Result;
use crate::report::{Curves, Panel, Table, write_whole};
use crate::study::framework::RunRecord;
use crate::vehicle::{EnvelopeRow, Trim};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The figures of the study; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EnvelopeSummary {
    /// `envelope`.
    pub study: String,
    /// Zero: nothing is drawn at random.
    pub seed: u64,
    /// The car.
    pub car: String,
    /// How the study ran; candidates are cars of the surface.
    #[serde(flatten)]
    pub record: RunRecord,
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
    /// The limits at each speed, for turns to the side on which the car can do less.
    pub limits: Vec<EnvelopeRow>,
    /// What the limits leave out or differ in, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The figures of the surface, if one was evaluated.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceFigures>,
}

/// Puts the figures together.
pub(super) fn summarise(car: &str, outcome: &Outcome) -> EnvelopeSummary {
    /// Standard gravity (m/s^2).
    const G: f64 = 9.806_65;
    let limits = &outcome.limits;
    EnvelopeSummary {
        study: "envelope".to_owned(),
        seed: 0,
        car: car.to_owned(),
        record: outcome.record.clone(),
        steady_states: limits.speeds.iter().map(|s| s.cornering.len()).sum(),
        top_speed_mps: limits.envelope.top_speed_mps(),
        understeer_gradient_deg_per_g: limits.handling.understeer_gradient.to_degrees() * G,
        stability_factor_s2_per_m2: limits.handling.stability_factor,
        characteristic_speed_mps: limits.handling.characteristic_speed_mps,
        critical_speed_mps: limits.handling.critical_speed_mps,
        limits: limits.envelope.rows().to_vec(),
        notes: notes(limits),
        surface: outcome.surface.as_ref().map(|s| s.summary.clone()),
    }
}

/// What a reader of the limits must know of them.
fn notes(limits: &CarLimits) -> Vec<String> {
    let mut notes = Vec::new();
    if !limits.left_out_mps.is_empty() {
        notes.push(format!(
            "The car has no steady state in bends at {}: these speeds are left out.",
            super::in_words(&limits.left_out_mps)
        ));
    }
    let left = |s: &super::SpeedLimits| s.cornering.iter().map(|t| t.ay_mps2).fold(0.0, f64::max);
    let uneven = limits.speeds.iter().map(|s| (s, left(s), s.right_mps2));
    let most = uneven.max_by(|a, b| (a.1 - a.2).abs().total_cmp(&(b.1 - b.2).abs()));
    if let Some((at, left, right)) = most
        && left != right
    {
        notes.push(format!(
            "The car's sides differ: at {:.1} m/s it corners at up to {left:.2} m/s^2 to the left and {right:.2} m/s^2 to the \
             right. The limits are the lesser of both.",
            at.row.v_mps
        ));
    }
    notes
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
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}: {} steady states in {:.2} s\n{}",
            self.car,
            self.steady_states,
            self.record.elapsed_s,
            Table::rows(&self.limits)
                .number("speed", "m/s", |r| r.v_mps)
                .number("cornering", "m/s^2", |r| r.ay_mps2)
                .number("braking grip", "m/s^2", |r| r.ax_grip_mps2)
                .number("drive", "m/s^2", |r| r.ax_drive_mps2)
                .number("drag", "m/s^2", |r| r.drag_mps2)
                .table()
                .to_text()
        );
        let balance = self.balance();
        text += &format!(
            "Understeer gradient {:.3} deg/g, stability factor {:.3e} s^2/m^2: {balance}\n",
            self.understeer_gradient_deg_per_g, self.stability_factor_s2_per_m2
        );
        for note in &self.notes {
            text += &format!("{note}\n");
        }
        if let Some(surface) = &self.surface {
            text += &surface::in_words(surface, &self.record);
        }
        text + &self.record.notes()
    }
}

/// Writes `envelope.csv` (as `--envelope` reads it), `cornering.csv`, `envelope.svg` and `report.html`; with a surface also `surface.csv`, `ridge.csv` and `surface.svg`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub(super) fn report(folder: &Path, outcome: &Outcome, summary: &EnvelopeSummary) -> Result<()> {
    let limits = &outcome.limits;
    write_whole(folder.join("envelope.csv"), limits.envelope.to_csv().as_bytes())?;
    write_cornering(&folder.join("cornering.csv"), limits)?;
    page::write(folder, outcome, summary)
}

fn write_cornering(path: &Path, limits: &CarLimits) -> Result<()> {
    let trims = limits
        .speeds
        .iter()
        .flat_map(|s| s.cornering.iter().map(|t| (s.row.v_mps, t)));
    Table::rows(trims)
        .number("v", "m/s", |(v, _)| *v)
        .number("steer", "rad", |(_, t)| t.steer_rad)
        .number("ay", "m/s^2", |(_, t)| t.ay_mps2)
        .number("yaw_rate", "rad/s", |(_, t)| t.yaw_rate_radps)
        .number("sideslip", "rad", |(_, t)| t.sideslip_rad)
        .number("roll", "rad", |(_, t)| t.roll_rad)
        .number("slip_ratio", "-", |(_, t)| t.slip_ratio)
        .table()
        .write_csv(path)
}

fn curves(limits: &CarLimits, car: &str) -> Curves {
    let speeds = &limits.speeds;
    let v: Vec<f64> = speeds.iter().map(|s| s.row.v_mps).collect();
    let over_speed = |f: &dyn Fn(&super::SpeedLimits) -> f64| speeds.iter().map(f).collect::<Vec<f64>>();
    let mut cornering = Panel::new("Steady-state cornering")
        .x("road-wheel angle", "deg")
        .y("lateral acceleration", "m/s\u{b2}");
    let mut diagram = Panel::new("g-g-v diagram, drag included")
        .x("lateral acceleration", "m/s\u{b2}")
        .y("longitudinal acceleration", "m/s\u{b2}");
    let mut sideslip = Panel::new("Sideslip in steady-state cornering")
        .x("lateral acceleration", "m/s\u{b2}")
        .y("sideslip", "deg");
    // A family of curves with every speed would be a smear.
    for i in (0..speeds.len()).rev().step_by(speeds.len().div_ceil(6)) {
        let shade = i as f64 / (speeds.len() - 1).max(1) as f64;
        let of = |f: &dyn Fn(&Trim) -> f64| speeds[i].cornering.iter().map(f).collect::<Vec<f64>>();
        let ay = of(&|t| t.ay_mps2);
        let steer = of(&|t| t.steer_rad.to_degrees());
        cornering = cornering.shaded(shade, format!("{:.0} m/s", v[i]), &steer, &ay);
        sideslip = sideslip.shaded(shade, "", &ay, &of(&|t| t.sideslip_rad.to_degrees()));
        let row = speeds[i].row;
        // Once round, from full drive over full cornering to full braking and back; drag taken off.
        let around = (0..=120).map(|k| std::f64::consts::TAU * f64::from(k) / 120.0);
        let (across, along): (Vec<f64>, Vec<f64>) = around
            .map(|a| {
                let push = (row.ax_grip_mps2 * a.cos()).min(row.ax_drive_mps2);
                (row.ay_mps2 * a.sin(), push - row.drag_mps2)
            })
            .unzip();
        diagram = diagram.shaded(shade, "", &across, &along);
    }
    let limits = Panel::new("Limits of the tyres and the engine")
        .x("speed", "m/s")
        .y("acceleration", "m/s\u{b2}")
        .curve("lateral", &v, &over_speed(&|s| s.row.ay_mps2))
        .curve("braking", &v, &over_speed(&|s| s.row.ax_grip_mps2))
        .curve("traction", &v, &over_speed(&|s| s.traction_mps2))
        .curve("engine", &v, &over_speed(&|s| s.engine_mps2))
        .curve("drag", &v, &over_speed(&|s| s.row.drag_mps2));
    Curves::new(
        format!("g-g-v envelope of the {car}"),
        [cornering, limits, diagram, sideslip],
    )
}
