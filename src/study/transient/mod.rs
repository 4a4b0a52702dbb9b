//! A racing line driven by the 4DOF car and a driver: what of the point mass's limits can be held, and what lap comes of
//! it.
//!
//! The driver is given the speeds of a point mass whose grip is a share of the envelope's. The greatest share is looked for
//! at which the car gets round within the edges and as fast as the point mass, to half a percent; with it the limits are
//! fed back, and both laps are set side by side.

mod page;
mod population;
mod population_results;
mod results;
mod state;

pub use population::{
    Driven, DrivenBest, MOST_SETUPS, NamedLine, PopulationOutcome, PopulationSettings, drive_population,
    drive_population_recorded,
};
pub use population_results::{PopulationSummary, summarise_population, table_of, write_population};
pub use results::{Summary, summarise, write_results};
pub use state::{DriveRequest, DriveState};

use crate::config::read_text;
use crate::error::{Error, Result};
use crate::line::{FineLine, PointMass, Polyline};
use crate::simulate::{Drive, DriverSettings, SpeedPlan, drive_planned};
use crate::study::keeper::Keeper;
use crate::study::run::Inputs;
use crate::study::run_folder::STATE;
use crate::track::Circuit;
use crate::vehicle::{Car, Envelope, EnvelopeRow};
use glam::DVec2;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::path::Path;

/// Settings of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct TransientSettings {
    /// Width of the car (m), all of which stays within the edges.
    pub car_width_m: f64,
    /// The driver; one who knows the car where not given. The pace is that of the plan that is being tried.
    pub driver: Option<DriverSettings>,
    /// Shares of the envelope's grip to try, greatest first.
    pub shares: Vec<f64>,
}

impl Default for TransientSettings {
    fn default() -> Self {
        Self {
            car_width_m: 2.0,
            driver: None,
            shares: (0..41).map(|i| 1.0 - 0.01 * f64::from(i)).collect(),
        }
    }
}

/// Sample interval of the drive that is kept (s).
pub const INTERVAL_S: f64 = 0.01;
/// Agreement of the two laps that is asked for.
pub const AGREEMENT: f64 = 0.005;

/// The outcome.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The greatest share of the envelope's grip that the car and the driver held; where the laps agree with none, the
    /// share with which they agree best.
    pub grip_share: f64,
    /// The envelope with that share.
    pub envelope: Envelope,
    /// The point mass's lap within it.
    pub point_mass: FineLine,
    /// The lap that was driven.
    pub drive: Drive,
    /// Its time (s).
    pub lap_time_s: f64,
    /// The line as a circuit of its own, its widths the room that the car's side has to the edges.
    pub line: Circuit,
    /// Least room left between the car's side and an edge (m).
    pub margin_m: f64,
    /// Why greater shares failed: the share and what became of the car.
    pub failures: Vec<(f64, String)>,
}

impl Outcome {
    /// How far the driven lap is off the point mass's, as a share of it.
    pub fn disagreement(&self) -> f64 {
        let point_mass = self.point_mass.lap_time_s().unwrap_or(f64::NAN);
        self.lap_time_s / point_mass - 1.0
    }
}

/// An envelope with a share of the grip; drive and drag are the car's own.
pub fn with_grip_share(envelope: &Envelope, share: f64) -> Result<Envelope> {
    let rows = envelope.rows().iter().map(|row| EnvelopeRow {
        ay_mps2: share * row.ay_mps2,
        ax_grip_mps2: share * row.ax_grip_mps2,
        ..*row
    });
    Envelope::new(
        format!("{}, {share:.3} of its grip", envelope.name()),
        rows.collect(),
    )
}

/// A line between edges as a circuit whose centreline it is. Widths are from the line to the edges less half the car.
///
/// # Errors
/// [`Error::Input`] if the line is open or leaves no room for the car.
pub fn circuit_of_line(
    name: &str,
    line: &FineLine,
    edges_m: [&[DVec2]; 2],
    car_width_m: f64,
) -> Result<Circuit> {
    if !line.closed {
        return Err(Error::input(
            name,
            "line",
            "an open one",
            "a closed line: the lap driven is a flying one",
        ));
    }
    let n = line.points_m.len();
    let count = line.length_m.round().max(16.0) as usize;
    let spacing = line.length_m / count as f64;
    let mut heading = Vec::with_capacity(n + 1);
    for i in 0..n {
        let along = line.points_m[(i + 1) % n] - line.points_m[(i + n - 1) % n];
        let angle = along.y.atan2(along.x);
        let before = heading.last().copied().unwrap_or(angle);
        heading.push(
            before + (angle - before + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
                - std::f64::consts::PI,
        );
    }
    let mut circuit = Circuit {
        name: name.to_owned(),
        closed: true,
        length_m: line.length_m,
        station_m: (0..count).map(|i| i as f64 * spacing).collect(),
        centreline_m: Vec::with_capacity(count),
        heading_rad: Vec::with_capacity(count),
        curvature_1pm: Vec::with_capacity(count),
        width_left_m: Vec::new(),
        width_right_m: Vec::new(),
        sections: Vec::new(),
        corners: Vec::new(),
    };
    let mut at = 0;
    for station in &circuit.station_m {
        while at + 1 < n && line.station_m[at + 1] <= *station {
            at += 1;
        }
        let next = (at + 1) % n;
        let share = ((station - line.station_m[at]) / line.segment_m[at]).clamp(0.0, 1.0);
        let mix = |a: f64, b: f64| a + share * (b - a);
        let turned = (heading[next] - heading[at] + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU)
            - std::f64::consts::PI;
        circuit
            .centreline_m
            .push(line.points_m[at].lerp(line.points_m[next], share));
        circuit.heading_rad.push(heading[at] + share * turned);
        circuit
            .curvature_1pm
            .push(mix(line.curvature_1pm[at], line.curvature_1pm[next]));
    }
    let room = |edge: &[DVec2], side: f64| -> Vec<f64> {
        let edge = Polyline::new(edge, true);
        circuit
            .centreline_m
            .par_iter()
            .map(|p| side * edge.leftward_distance(*p) - 0.5 * car_width_m)
            .collect()
    };
    let (right, left) = (room(edges_m[0], 1.0), room(edges_m[1], -1.0));
    let least = right.iter().chain(&left).fold(f64::INFINITY, |a, b| a.min(*b));
    // What the line's own report allows: the spline between cuts may pass an edge by a hair.
    if least < -0.5 {
        let found = format!("a line that leaves the car's side {:.2} m beyond an edge", -least);
        return Err(Error::input(name, "line", found, "a line within the edges"));
    }
    (circuit.width_right_m, circuit.width_left_m) = (right, left);
    Ok(circuit)
}

/// What a point mass with a share of the envelope's grip does on a line of points (m): its limits, its lap, and its speeds
/// as a plan.
fn planned(limits: &PointMass, points_m: &[DVec2], share: f64) -> Result<(Envelope, FineLine, SpeedPlan)> {
    let envelope = with_grip_share(&limits.envelope, share)?;
    let point_mass = PointMass {
        envelope: envelope.clone(),
        ..limits.clone()
    };
    let fine = FineLine::new(points_m, true, 1.0, Some(&point_mass), 0.0)?;
    let Some(lap) = &fine.lap else {
        return Err(Error::Study("the point mass has no lap on this line".to_owned()));
    };
    let plan = SpeedPlan::of_speeds(&lap.station_m, &lap.v_mps, fine.length_m);
    Ok((envelope, fine, plan))
}

/// Drives `car` along a line of points (m) between the edges (m, right and left), within the limits of `limits`.
///
/// # Errors
/// [`Error::Study`] if the car gets round with none of the shares; [`Error::Input`] for a line that is no lap.
pub fn drive_line(
    car: &Car,
    limits: &PointMass,
    points_m: &[DVec2],
    edges_m: [&[DVec2]; 2],
    settings: &TransientSettings,
) -> Result<Outcome> {
    let begun = (DriveState::default(), &mut Keeper::idle());
    let found = drive_line_from(car, limits, points_m, edges_m, settings, begun, |_, _| {
        ControlFlow::Continue(())
    })?;
    found.ok_or_else(|| Error::Study("the drive was broken off".to_owned()))
}

/// As [`drive_line`], from the state of the same drive that was broken off, with the state handed to `keeper`. `observe` is told
/// how many shares of how many were tried, and may end it; there is no outcome then.
///
/// # Errors
/// As [`drive_line`]; [`Error::Input`] if the state belongs to other inputs; [`Error::Io`] if it cannot be saved when the drive
/// is broken off.
pub fn drive_line_from(
    car: &Car,
    limits: &PointMass,
    points_m: &[DVec2],
    edges_m: [&[DVec2]; 2],
    settings: &TransientSettings,
    (mut state, keeper): (DriveState, &mut Keeper),
    mut observe: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<Outcome>> {
    let line = FineLine::new(points_m, true, 1.0, None, 0.0)?;
    let circuit = circuit_of_line("the line", &line, edges_m, settings.car_width_m)?;
    let driver = match &settings.driver {
        Some(driver) => driver.clone(),
        None => DriverSettings::racing(car)?,
    };
    let mut inputs = Inputs::new("transient");
    inputs.add(&(car, limits, points_m, edges_m, settings));
    let inputs = inputs.key();
    if state.inputs.as_ref().is_some_and(|began| *began != inputs) {
        let expected = "the files that the drive reads as they were when it began";
        return Err(Error::input(STATE, "inputs of the study", "others", expected));
    }
    state.inputs = Some(inputs);
    keeper.keep(&state)?;
    let attempt = |share: f64| -> Result<(Envelope, FineLine, Drive)> {
        let (envelope, fine, plan) = planned(limits, points_m, share)?;
        let drive = drive_planned(car, &circuit, plan, &driver, INTERVAL_S)?;
        Ok((envelope, fine, drive))
    };
    let outcome_of = |share: f64, (envelope, point_mass, drive): (Envelope, FineLine, Drive), failures| {
        let lap_time_s = drive.lap_time_s(circuit.length_m, INTERVAL_S)?;
        Some(Outcome {
            grip_share: share,
            envelope,
            point_mass,
            lap_time_s,
            margin_m: least_room(&circuit, &drive),
            drive,
            line: circuit.clone(),
            failures,
        })
    };
    let mut best = match state.best {
        Some(share) => {
            let before = state.failures.iter().take_while(|(failed, _)| *failed != share);
            outcome_of(share, attempt(share)?, before.cloned().collect())
        }
        None => None,
    };
    let planned = settings.shares.len();
    // A few at once: the greatest that works ends the search.
    let together = rayon::current_num_threads().max(2);
    while state.tried < planned {
        if observe(state.tried, planned).is_break() {
            keeper.keep(&state)?;
            return Ok(None);
        }
        let end = planned.min(state.tried + together);
        let batch = &settings.shares[state.tried..end];
        let found: Vec<_> = batch.par_iter().map(|share| (*share, attempt(*share))).collect();
        for (share, driven) in found {
            match driven {
                Ok(driven) => {
                    let Some(outcome) = outcome_of(share, driven, state.failures.clone()) else {
                        continue;
                    };
                    let off = outcome.disagreement();
                    if off.abs() <= AGREEMENT {
                        return Ok(Some(outcome));
                    }
                    // It gets round, but more slowly than its plan: the limits are not held yet.
                    let why = format!("the driven lap is {:+.2}% off the point mass's", 100.0 * off);
                    state.failures.push((share, why));
                    let nearer = best
                        .as_ref()
                        .is_none_or(|b: &Outcome| off.abs() < b.disagreement().abs());
                    if nearer {
                        state.best = Some(share);
                        best = Some(outcome);
                    }
                }
                Err(error @ Error::Input { .. }) => return Err(error),
                Err(error) => state.failures.push((share, error.to_string())),
            }
        }
        state.tried = end;
        if keeper.due() {
            keeper.keep_or_warn(&state);
        }
    }
    if let Some(best) = best {
        return Ok(Some(best));
    }
    let last = state
        .failures
        .last()
        .map_or(String::new(), |(share, why)| format!(" (at {share:.2}: {why})"));
    Err(Error::Study(format!(
        "the car does not get round the line with any share of the envelope's grip that was tried{last}; a line with more room \
         to the edges (found for a wider car), or through more sections, is easier to drive"
    )))
}

/// Least room between the car's side and an edge over a drive (m).
fn least_room(circuit: &Circuit, drive: &Drive) -> f64 {
    drive
        .station_m
        .iter()
        .zip(&drive.offset_m)
        .map(|(station, offset)| {
            let (left, right) = circuit.widths_at(*station);
            (left - offset).min(right + offset)
        })
        .fold(f64::INFINITY, f64::min)
}

/// The points of a line's table, as `raceline` writes it (columns `x (m)` and `y (m)`).
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Input`] naming the line of the file where it is no table of points.
pub fn read_line(path: &Path) -> Result<Vec<DVec2>> {
    let text = read_text(path)?;
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let refuse = |place: String, found: String| {
        Err(Error::input(
            path,
            place,
            found,
            "columns `x (m)` and `y (m)` of finite numbers, 8 rows or more",
        ))
    };
    let headers = match reader.headers() {
        Ok(headers) => headers.clone(),
        Err(e) => return refuse("line 1".to_owned(), e.to_string()),
    };
    let column = |names: [&str; 2]| headers.iter().position(|h| names.contains(&h.trim()));
    let (Some(x), Some(y)) = (column(["x (m)", "x_m"]), column(["y (m)", "y_m"])) else {
        return refuse("line 1".to_owned(), headers.iter().collect::<Vec<_>>().join(","));
    };
    let mut points = Vec::new();
    for (row, record) in reader.records().enumerate() {
        let place = || format!("line {}", row + 2);
        let record = match record {
            Ok(record) => record,
            Err(e) => return refuse(place(), e.to_string()),
        };
        let number = |k: usize| {
            record
                .get(k)
                .and_then(|c| c.trim().parse::<f64>().ok())
                .filter(|v| v.is_finite())
        };
        match (number(x), number(y)) {
            (Some(x), Some(y)) => points.push(DVec2::new(x, y)),
            _ => return refuse(place(), record.iter().collect::<Vec<_>>().join(",")),
        }
    }
    if points.len() < 8 {
        return refuse("rows".to_owned(), points.len().to_string());
    }
    Ok(points)
}
