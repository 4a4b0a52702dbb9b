//! Tables and figures of a car's g-g-v envelope.

use super::measured::{self, Measured, Taken};
use super::{EnvelopeStudy, Outcome, SteadySurface, SurfaceFigures};
use crate::error::Result;
use crate::evaluate::{Failure, failures_in_words};
use crate::report::{Curves, HtmlReport, Levels, Panel, Surface, Table, write_whole};
use crate::study::framework::{Head, RunRecord, Solved};
use crate::vehicle::limits::{CarEnvelope, EnvelopeAtSpeed, Handling, in_words};
use crate::vehicle::modes::{SmallSteering, small_steering};
use crate::vehicle::{Envelope, EnvelopeRow, Reached, Trim};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The figures of the study; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct EnvelopeSummary {
    /// The study; candidates are cars of the surface, and nothing is drawn at random.
    #[serde(flatten)]
    pub head: Head,
    /// Steady states found.
    pub steady_states: usize,
    /// Greatest speed (m/s).
    pub top_speed_mps: f64,
    /// Handling in the middle of the range of speeds.
    #[serde(flatten)]
    pub handling: Handling,
    /// How the car answers to small steering at each speed.
    #[serde(default)]
    pub small_steering: Vec<SmallSteering>,
    /// The limits at each speed, for turns to the side on which the car can do less.
    pub limits: Vec<EnvelopeRow>,
    /// What the log supports of the limits, speed by speed, if the car was fitted to one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub supported: Vec<Supported>,
    /// How much of the limits the study's log takes, if it has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<Measured>,
    /// What the limits leave out or differ in, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The figures of the surface.
    #[serde(flatten)]
    pub surface: SurfaceFigures,
}

/// What a log reached at a speed of the limits. Limits beyond it are extrapolated by the tyre model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Supported {
    /// Speed (m/s).
    pub v_mps: f64,
    /// Greatest lateral acceleration in the log about this speed (m/s^2); nothing where the log has no such speed.
    pub ay_mps2: Option<f64>,
    /// Greatest deceleration in the log by the tyres (m/s^2), drag taken off.
    pub ax_grip_mps2: Option<f64>,
    /// Whether the limit of cornering is beyond it.
    pub ay_extrapolated: bool,
    /// Whether the limit of braking is beyond it.
    pub ax_extrapolated: bool,
}

impl Supported {
    fn of(reached: &Reached, row: &EnvelopeRow) -> Self {
        let at = reached.at(row.v_mps);
        let ay_mps2 = at.map(|at| at.ay_mps2);
        let ax_grip_mps2 = at.map(|at| (at.braking_mps2 - row.drag_mps2).max(0.0));
        Self {
            v_mps: row.v_mps,
            ay_mps2,
            ax_grip_mps2,
            ay_extrapolated: !Reached::supports(ay_mps2, row.ay_mps2),
            ax_extrapolated: !Reached::supports(ax_grip_mps2, row.ax_grip_mps2),
        }
    }
}

/// What of the limits is extrapolated, in words.
fn extrapolated(supported: &[Supported], limits: &[EnvelopeRow]) -> Option<String> {
    let share = |reached: Option<f64>, limit: f64| reached.map_or(0.0, |reached| reached / limit);
    let rows = || supported.iter().zip(limits);
    let greatest = |of: &dyn Fn(&Supported, &EnvelopeRow) -> f64| {
        100.0 * rows().map(|(s, row)| of(s, row)).fold(0.0, f64::max)
    };
    let ay = supported.iter().filter(|s| s.ay_extrapolated).count();
    let ax = supported.iter().filter(|s| s.ax_extrapolated).count();
    (ay + ax > 0).then(|| {
        format!(
            "The car was fitted to a log that reached {:.0} % of the cornering limit and {:.0} % of the braking limit at most. \
             Beyond what it reached the limits are extrapolated by the tyre model: cornering at {ay} of {n} speeds, braking at \
             {ax}.",
            greatest(&|s, row| share(s.ay_mps2, row.ay_mps2)),
            greatest(&|s, row| share(s.ax_grip_mps2, row.ax_grip_mps2)),
            n = supported.len()
        )
    })
}

/// Puts the figures together.
pub(super) fn summarise(solved: &Solved<'_, EnvelopeStudy>) -> EnvelopeSummary {
    let Outcome { limits, surface, .. } = solved.outcome;
    let rows = limits.envelope.rows();
    let reached = solved.prepared.car.reached.iter();
    let supported: Vec<Supported> = reached
        .flat_map(|reached| rows.iter().map(|row| Supported::of(reached, row)))
        .collect();
    let mut notes = notes(limits);
    notes.extend(extrapolated(&supported, rows));
    EnvelopeSummary {
        head: solved.head(),
        steady_states: limits.speeds.iter().map(|s| s.cornering.len()).sum(),
        top_speed_mps: limits.envelope.top_speed_mps(),
        handling: limits.handling,
        small_steering: steering_of(solved),
        limits: rows.to_vec(),
        supported,
        measured: solved
            .prepared
            .log
            .as_ref()
            .and_then(|log| Measured::of(log, &measured::taken(log, &limits.envelope))),
        notes,
        surface: surface.summary.clone(),
    }
}

/// How the car answers to small steering at the speeds of its limits.
fn steering_of(solved: &Solved<'_, EnvelopeStudy>) -> Vec<SmallSteering> {
    let car = &solved.prepared.car;
    let flat = car.to_flat();
    let speeds = solved.prepared.speeds.iter();
    speeds
        .filter_map(|speed| small_steering(&flat, car.tyre_model(), *speed))
        .collect()
}

/// What a reader of the limits must know of them.
fn notes(limits: &CarEnvelope) -> Vec<String> {
    let mut notes = Vec::new();
    if !limits.left_out_mps.is_empty() {
        notes.push(format!(
            "The car has no steady state in bends at {}: these speeds are left out.",
            in_words(&limits.left_out_mps)
        ));
    }
    let uneven = limits.speeds.iter().map(|s| (s, s.left_mps2, s.right_mps2));
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
        let handling = &self.handling;
        match (handling.characteristic_speed_mps, handling.critical_speed_mps) {
            (Some(v), _) => format!("understeers; characteristic speed {v:.1} m/s"),
            (_, Some(v)) => format!("oversteers; critical speed {v:.1} m/s"),
            _ => "steers neutrally".to_owned(),
        }
    }

    /// The limits by speed, with what a log reached of them.
    fn limits_table(&self) -> Table<'_> {
        let table = Table::rows(&self.limits)
            .number("speed", "m/s", |r| r.v_mps)
            .number("cornering", "m/s^2", |r| r.ay_mps2)
            .number("braking grip", "m/s^2", |r| r.ax_grip_mps2)
            .number("drive", "m/s^2", |r| r.ax_drive_mps2)
            .number("drag", "m/s^2", |r| r.drag_mps2)
            .table();
        with_support(table, &self.supported)
    }

    /// The figures in words.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}: {} steady states in {:.2} s\n{}",
            self.head.subject.car,
            self.steady_states,
            self.head.record.elapsed_s,
            self.limits_table().to_text()
        );
        let balance = self.balance();
        text += &format!(
            "Understeer gradient {:.3} deg/g, stability factor K {:.3e} s^2/m^2: {balance}\nYaw stiffness b Cr - a Cf {:.1} kN m/rad, \
             static margin {:.2}% of the wheelbase\n",
            self.handling.understeer_gradient_deg_per_g,
            self.handling.stability_factor_s2_per_m2,
            1e-3 * self.handling.yaw_stiffness_nm_per_rad,
            100.0 * self.handling.static_margin
        );
        for note in self
            .notes
            .iter()
            .cloned()
            .chain(self.measured.iter().map(Measured::to_text))
        {
            text += &format!("{note}\n");
        }
        text += &surface_in_words(&self.surface, &self.head.record);
        text + &self.head.record.notes()
    }
}

/// Writes `envelope.csv` (as `--envelope` reads it), `cornering.csv`, `handling.csv`, `surface.csv`, `ridge.csv`, with a log
/// `measured.csv`, figures and `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub(super) fn report(
    folder: &Path,
    solved: &Solved<'_, EnvelopeStudy>,
    summary: &EnvelopeSummary,
) -> Result<()> {
    let outcome = solved.outcome;
    let limits = &outcome.limits;
    write_whole(folder.join("envelope.csv"), limits.envelope.to_csv().as_bytes())?;
    write_cornering(&folder.join("cornering.csv"), limits)?;
    write_surface(folder, &outcome.surface)?;
    write_handling(&folder.join("handling.csv"), &summary.small_steering)?;
    let log = solved.prepared.log.iter();
    let taken: Vec<_> = log
        .flat_map(|log| measured::taken(log, &limits.envelope))
        .collect();
    if !taken.is_empty() {
        measured::write(&folder.join("measured.csv"), &taken)?;
    }
    write_page(folder, outcome, &taken, summary)
}

fn write_cornering(path: &Path, limits: &CarEnvelope) -> Result<()> {
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

fn write_handling(path: &Path, rows: &[SmallSteering]) -> Result<()> {
    let part = |k: usize, part: usize| move |r: &&SmallSteering| r.eigenvalues_1ps[k][part];
    let mut table = Table::rows(rows)
        .number("v", "m/s", |r| r.v_mps)
        .number("yaw_rate_gain", "1/s", |r| r.yaw_rate_gain_1ps)
        .number("ay_gain", "m/s^2", |r| r.ay_gain_mps2)
        .number("sideslip_gain", "-", |r| r.sideslip_gain)
        .number("stability_factor", "s^2/m^2", |r| r.stability_factor_s2_per_m2)
        .number("frequency", "Hz", |r| r.frequency_hz)
        .number("damping_ratio", "-", |r| r.damping_ratio)
        .number("slowest_decay", "1/s", |r| r.slowest_decay_1ps);
    for k in 0..4 {
        table = table
            .number(format!("eigenvalue_{}_real", k + 1), "1/s", part(k, 0))
            .number(format!("eigenvalue_{}_imaginary", k + 1), "1/s", part(k, 1));
    }
    table.table().write_csv(path)
}

/// Gains, damping and eigenvalues over speed.
fn handling_figure(rows: &[SmallSteering], car: &str) -> Curves {
    let of = |f: &dyn Fn(&SmallSteering) -> f64| rows.iter().map(f).collect::<Vec<f64>>();
    let v = of(&|r| r.v_mps);
    let gain = Panel::new("Yaw rate for each degree at the wheels")
        .x("speed", "m/s")
        .y("yaw rate", "deg/s")
        .curve("", &v, &of(&|r| r.yaw_rate_gain_1ps));
    let factor = Panel::new("Stability factor")
        .x("speed", "m/s")
        .y("K", "s\u{b2}/m\u{b2}")
        .curve("", &v, &of(&|r| r.stability_factor_s2_per_m2));
    let damping = Panel::new("Damping of the least damped oscillation")
        .x("speed", "m/s")
        .y("share of the critical damping", "")
        .curve("", &v, &of(&|r| r.damping_ratio.unwrap_or(f64::NAN)));
    let mut roots = Panel::new("Eigenvalues")
        .x("real part", "1/s")
        .y("imaginary part", "1/s");
    for i in (0..rows.len()).step_by(rows.len().div_ceil(6).max(1)) {
        let points = rows[i].eigenvalues_1ps.map(|[re, im]| (re, im));
        roots = roots.dots(format!("{:.0} m/s", v[i]), points);
    }
    let panels = [gain, factor, damping, roots].into_iter();
    // A car may have no motion that swings.
    Curves::new(format!("Small steering: {car}"), panels.filter(Panel::has_points))
}

/// The limit at a speed once round, from full drive over full cornering to full braking and back: lateral and longitudinal
/// accelerations (m/s^2), drag taken off.
pub(super) fn around(row: &EnvelopeRow, limits: &Envelope) -> (Vec<f64>, Vec<f64>) {
    let around = (0..=120).map(|k| std::f64::consts::TAU * f64::from(k) / 120.0);
    around
        .map(|a| {
            let tyres = row.ax_grip_mps2 * a.cos();
            let share = a.sin().abs();
            let driven = limits.traction_at(row.v_mps, share).unwrap_or(tyres);
            let engine = row.ax_drive_mps2 - limits.lost_at(row.v_mps, share);
            let push = tyres.min(driven).min(engine);
            (row.ay_mps2 * a.sin(), push - row.drag_mps2)
        })
        .unzip()
}

/// Steady-state cornering, the limits of tyres and engine, the g-g-v diagram and sideslip of a car of this name.
pub fn envelope_figure(limits: &CarEnvelope, car: &str) -> Curves {
    let speeds = &limits.speeds;
    let v: Vec<f64> = speeds.iter().map(|s| s.row.v_mps).collect();
    let over_speed = |f: &dyn Fn(&EnvelopeAtSpeed) -> f64| speeds.iter().map(f).collect::<Vec<f64>>();
    let mut cornering = Panel::new("Steady-state cornering")
        .x("road-wheel angle", "rad")
        .y("lateral acceleration", "m/s\u{b2}");
    let mut diagram = Panel::new("g-g-v diagram, drag included")
        .x("lateral acceleration", "m/s\u{b2}")
        .y("longitudinal acceleration", "m/s\u{b2}");
    let mut sideslip = Panel::new("Sideslip in steady-state cornering")
        .x("lateral acceleration", "m/s\u{b2}")
        .y("sideslip", "rad");
    // A family of curves with every speed would be a smear.
    for i in (0..speeds.len()).rev().step_by(speeds.len().div_ceil(6)) {
        let shade = i as f64 / (speeds.len() - 1).max(1) as f64;
        let of = |f: &dyn Fn(&Trim) -> f64| speeds[i].cornering.iter().map(f).collect::<Vec<f64>>();
        let ay = of(&|t| t.ay_mps2);
        let steer = of(&|t| t.steer_rad);
        cornering = cornering.shaded(shade, format!("{:.0} m/s", v[i]), &steer, &ay);
        sideslip = sideslip.shaded(shade, "", &ay, &of(&|t| t.sideslip_rad));
        let row = speeds[i].row;
        let (across, along) = around(&row, &limits.envelope);
        diagram = diagram.shaded(shade, "", &across, &along);
    }
    let limits_panel = Panel::new("Limits of the tyres and the engine")
        .x("speed", "m/s")
        .y("acceleration", "m/s\u{b2}")
        .curve("lateral", &v, &over_speed(&|s| s.row.ay_mps2))
        .curve("braking", &v, &over_speed(&|s| s.row.ax_grip_mps2))
        .curve("traction", &v, &over_speed(&|s| s.traction_mps2))
        .curve("engine", &v, &over_speed(&|s| s.engine_mps2))
        .curve("drag", &v, &over_speed(&|s| s.row.drag_mps2));
    let limits_panel = if speeds.iter().any(|s| s.with_motor_mps2.is_some()) {
        let both = over_speed(&|s| s.with_motor_mps2.unwrap_or(f64::NAN));
        limits_panel.curve("engine and motor", &v, &both)
    } else {
        limits_panel
    };
    Curves::new(
        format!("g-g-v envelope: {car}"),
        [cornering, limits_panel, diagram, sideslip],
    )
}

fn write_page(folder: &Path, outcome: &Outcome, taken: &[Taken], summary: &EnvelopeSummary) -> Result<()> {
    let limits = &outcome.limits;
    let (car, record) = (&summary.head.subject.car, &summary.head.record);
    let mut page = HtmlReport::new(&summary.head.study, &format!("g-g-v envelope: {car}"));
    if let (Some(slow), Some(fast)) = (limits.speeds.first(), limits.speeds.last()) {
        page.sentence(format!(
            "The {car} corners at up to {:.1} m/s\u{b2} at {:.0} m/s and {:.1} m/s\u{b2} at {:.0} m/s, brakes at up to {:.1} and \
             {:.1} m/s\u{b2}, and reaches {:.1} m/s.",
            slow.row.ay_mps2,
            slow.row.v_mps,
            fast.row.ay_mps2,
            fast.row.v_mps,
            slow.row.ax_grip_mps2,
            fast.row.ax_grip_mps2,
            summary.top_speed_mps
        ));
        page.tile("Cornering, slow", format!("{:.2}", slow.row.ay_mps2), "m/s\u{b2}");
        page.tile("Cornering, fast", format!("{:.2}", fast.row.ay_mps2), "m/s\u{b2}");
    }
    page.tile("Top speed", format!("{:.1}", summary.top_speed_mps), "m/s");
    let gradient = format!("{:.3}", summary.handling.understeer_gradient_deg_per_g);
    page.tile("Understeer gradient", gradient.replace('-', "\u{2212}"), "deg/g");
    page.sentence(format!("At small angles the car {}.", summary.balance()));
    for note in &summary.notes {
        page.sentence(note.clone());
    }
    page.section(
        "Limits",
        "From steady states of the 4DOF model at each speed. The engine's limit is that of its best gear.",
    );
    page.figure(folder.join("envelope.svg"), &envelope_figure(limits, car))?;
    if let Some(measured) = &summary.measured {
        page.section("The log", &measured.to_text());
        let figure = measured::figure(taken, &limits.envelope, car);
        page.figure(folder.join("measured.svg"), &figure)?;
    }
    if !summary.small_steering.is_empty() {
        page.section(
            "Handling",
            "The car running straight, linearised at each speed. An eigenvalue on the right of zero is a motion that grows. Above \
             the critical speed of a car that oversteers there is one.",
        );
        page.figure(
            folder.join("handling.svg"),
            &handling_figure(&summary.small_steering, car),
        )?;
    }
    page.section("The surface", ABOUT_SURFACE);
    page.paragraph(&surface_in_words(&summary.surface, record));
    if let Some(figure) = surface_figure(&outcome.surface, car) {
        page.figure(folder.join("surface.svg"), &figure)?;
    }
    page.table(
        "Limits at each speed",
        "Drive is the lesser of traction and engine, before the tyres take their part of it in bends. Drag reduces the drive and helps the brakes.",
        &with_support(speeds_table(limits), &summary.supported),
    )?;
    page.provenance("car", car);
    page.provenance("limits", "cpu, f64");
    page.provenance("steady states", summary.steady_states.to_string());
    record.provenance(&mut page, "cars of the surface");
    page.write(folder.join("report.html"))
}

/// A table of limits with what a log reached of them, where there is a log.
fn with_support<'a>(table: Table<'a>, supported: &[Supported]) -> Table<'a> {
    if supported.is_empty() {
        return table;
    }
    let of =
        |figure: fn(&Supported) -> Option<f64>| supported.iter().map(figure).map(|x| x.unwrap_or(f64::NAN));
    let mark = |s: &Supported| match (s.ay_extrapolated, s.ax_extrapolated) {
        (true, true) => "cornering, braking",
        (true, false) => "cornering",
        (false, true) => "braking",
        (false, false) => "",
    };
    table
        .numbers(
            "cornering in the log",
            "m/s^2",
            of(|s| s.ay_mps2).collect::<Vec<_>>(),
        )
        .numbers(
            "braking in the log",
            "m/s^2",
            of(|s| s.ax_grip_mps2).collect::<Vec<_>>(),
        )
        .texts("extrapolated", supported.iter().map(mark))
}

/// Accelerations by speed.
fn speeds_table(limits: &CarEnvelope) -> Table<'static> {
    Table::rows(&limits.speeds)
        .number("speed", "m/s", |s| s.row.v_mps)
        .number("cornering", "m/s^2", |s| s.row.ay_mps2)
        .number("braking grip", "m/s^2", |s| s.row.ax_grip_mps2)
        .number("drive", "m/s^2", |s| s.row.ax_drive_mps2)
        .number("traction", "m/s^2", |s| s.traction_mps2)
        .number("engine", "m/s^2", |s| s.engine_mps2)
        .number("engine and motor", "m/s^2", |s| s.with_motor_mps2)
        .number("drag", "m/s^2", |s| s.row.drag_mps2)
        .table()
        .without_empty()
}

/// What the surface is, in words.
const ABOUT_SURFACE: &str = "Lateral acceleration that a car settles at under a held steering angle and path speed, without drive \
                         along the path, and its ridge. Where nothing is drawn, no car settled.";

/// The surface's figures in words.
fn surface_in_words(p: &SurfaceFigures, record: &RunRecord) -> String {
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
fn write_surface(folder: &Path, surface: &SteadySurface) -> Result<()> {
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
fn surface_figure(surface: &SteadySurface, car: &str) -> Option<Surface> {
    let speeds = &surface.speeds;
    // The engine's end may lie nearer than a step; figures are even.
    let step = |i: usize| speeds[i + 1] - speeds[i];
    let uneven = speeds.len() > 2 && (step(speeds.len() - 2) - step(0)).abs() > 0.1 * step(0);
    let rows = speeds.len() - usize::from(uneven);
    let settled = surface.figures[0].iter().any(|ay| ay.is_finite());
    let marks = surface.ridge.iter().take(rows);
    (rows >= 2 && settled).then(|| Surface {
        title: format!("Lateral acceleration of the {car}, and its ridge"),
        x_label: "road-wheel angle (rad)".to_owned(),
        y_label: "speed (m/s)".to_owned(),
        z_label: "lateral acceleration (m/s\u{b2})".to_owned(),
        x: surface.steers.clone(),
        y: speeds[..rows].to_vec(),
        z: surface.figures[0][..rows * surface.steers.len()].to_vec(),
        levels: Levels::Even,
        marks: marks.map(|r| (String::new(), [r.steer_rad, r.v_mps])).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Figure;

    #[test]
    fn limits_beyond_the_log_are_marked() {
        let row = |v_mps: f64| EnvelopeRow {
            v_mps,
            ay_mps2: 14.4,
            ax_grip_mps2: 10.0,
            ax_drive_mps2: 4.0,
            drag_mps2: 0.5,
        };
        // 14 m/s^2 across and 10.2 along at 20 m/s, 6 and 3 at 30, and nothing at 40.
        let slow = vec![[22.0, -14.0, -10.2]; 100];
        let fast = vec![[31.0, 6.0, -3.0]; 100];
        let reached = Reached::of([&slow[..], &fast[..]].into_iter(), 0.02);
        let limits = [20.0, 30.0, 40.0].map(row);
        let supported = limits.map(|row| Supported::of(&reached, &row));
        assert_eq!(supported.map(|s| s.ay_extrapolated), [false, true, true]);
        assert_eq!(supported.map(|s| s.ax_extrapolated), [false, true, true]);
        assert_eq!(supported.map(|s| s.ay_mps2), [Some(14.0), Some(6.0), None]);
        assert_eq!(supported[1].ax_grip_mps2, Some(2.5));
        let said = extrapolated(&supported, &limits).unwrap();
        assert!(
            said.contains("97 %") && said.contains("cornering at 2 of 3"),
            "{said}"
        );
        assert_eq!(extrapolated(&supported[..1], &limits[..1]), None);
        let table = with_support(Table::new(), &supported).to_text();
        assert!(
            table.contains("cornering, braking") && table.contains("14"),
            "{table}"
        );
    }

    /// A car that leans far on soft springs with much damping has no motion that swings. It has a picture all the same.
    #[test]
    fn a_car_that_nowhere_swings_is_drawn() {
        let row = SmallSteering {
            v_mps: 20.0,
            yaw_rate_gain_1ps: 5.0,
            ay_gain_mps2: 100.0,
            sideslip_gain: 0.1,
            stability_factor_s2_per_m2: 1e-3,
            frequency_hz: None,
            damping_ratio: None,
            slowest_decay_1ps: 0.5,
            eigenvalues_1ps: [[-1.0, 0.0], [-2.0, 0.0], [-3.0, 0.0], [-4.0, 0.0]],
        };
        let rows = [row, SmallSteering { v_mps: 30.0, ..row }];
        let folder = tempfile::tempdir().unwrap();
        handling_figure(&rows, "car")
            .write_svg(&folder.path().join("handling.svg"))
            .unwrap();
    }
}
