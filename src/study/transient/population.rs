//! Many set-ups of a car on many lines, all driven: which of them is the fastest within the edges.
//!
//! Every set-up drives every line at the speeds of point masses with different shares of the envelope's grip; what it is worth
//! is its fastest lap on which the car stays within the edges.

use super::{circuit_of_line, planned};
use crate::drive::{DriverSettings, Line};
use crate::error::{Error, Result};
use crate::evaluate::drive::{DriveObjective, DriveProblem, DriveSettings, open_drive_evaluator};
use crate::evaluate::gpu::DispatchWatch;
use crate::evaluate::{BackendChoice, BackendInfo, Evaluator, FailureCounts, add_failures};
use crate::line::{FineLine, PointMass};
use crate::study::journal::Recorder;
use crate::study::keeper::Keeper;
use crate::study::memory::{ANSWER, Kept};
use crate::study::run::Inputs;
use crate::track::Circuit;
use crate::vehicle::{Car, CarParameter};
use glam::DVec2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::Instant;

/// A line to drive.
#[derive(Clone, Debug)]
pub struct NamedLine {
    /// What reports call it.
    pub name: String,
    /// Its points (m).
    pub points_m: Vec<DVec2>,
}

impl NamedLine {
    /// The line between edges (m, right and left) as a circuit of its own (see [`circuit_of_line`]).
    ///
    /// # Errors
    /// [`Error::Input`] for a line that is no lap, or leaves no room for the car.
    pub fn circuit(&self, edges_m: [&[DVec2]; 2], car_width_m: f64) -> Result<Circuit> {
        let fine = FineLine::new(&self.points_m, true, 1.0, None, 0.0)?;
        circuit_of_line(&self.name, &fine, edges_m, car_width_m)
    }
}

/// Settings of a population.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PopulationSettings {
    /// Set-ups to drive beside the car as it is.
    pub setups: usize,
    /// Parameters that they move, as [`Car::parameter`] knows them.
    pub parameters: Vec<String>,
    /// How far each goes either way, as a share of its value.
    pub share: f64,
    /// Shares of the envelope's grip in the plans, rising.
    pub grip_shares: Vec<f64>,
    /// Width of the car (m), all of which stays within the edges.
    pub car_width_m: f64,
    /// Seed of the set-ups.
    pub seed: u64,
    /// Where laps are driven.
    pub backend: BackendChoice,
    /// Part of the name of the GPU to use.
    pub adapter: Option<String>,
}

impl Default for PopulationSettings {
    fn default() -> Self {
        Self {
            setups: 0,
            parameters: ["front_roll_moment_share", "aero_balance_front"]
                .map(str::to_owned)
                .to_vec(),
            share: 0.1,
            grip_shares: (0..21).map(|i| 0.8 + 0.01 * f64::from(i)).collect(),
            car_width_m: 2.0,
            seed: 1,
            backend: BackendChoice::Auto,
            adapter: None,
        }
    }
}

/// The most set-ups of a population.
pub const MOST_SETUPS: usize = 1 << 16;
/// The most parameters that set-ups move: those of the Sobol sequence.
const MOST_PARAMETERS: usize = 256;
/// Laps between two reports of progress, of which no backend is short.
const BATCH: usize = 1024;

/// A set-up on a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Driven {
    /// The line, by its place among those given.
    pub line: usize,
    /// The set-up: nought is the car as it is.
    pub setup: usize,
    /// Values of the parameters.
    pub values: Vec<f64>,
    /// The share of the grip with which it was fastest within the edges, and that lap; none where it never stayed within.
    pub best: Option<DrivenBest>,
}

/// A lap within the edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenBest {
    /// The share of the envelope's grip in its plan.
    pub grip_share: f64,
    /// Its time (s).
    pub lap_time_s: f64,
    /// Least room between the car's side and an edge (m).
    pub room_m: f64,
    /// Mean rate at which the road wheels were turned (rad/s).
    pub steering_radps: f64,
}

/// The outcome.
#[derive(Clone, Debug)]
pub struct PopulationOutcome {
    /// Parameters that set-ups move.
    pub parameters: Vec<CarParameter>,
    /// Every set-up on every line, the fastest first, those without a lap last.
    pub driven: Vec<Driven>,
    /// Laps driven.
    pub evaluations: usize,
    /// Time that took (s).
    pub driving_s: f64,
    /// Laps that failed, by reason.
    pub failures: FailureCounts,
    /// What drove them.
    pub backend: BackendInfo,
    /// What devices failed of and what was done about it.
    pub device_faults: Vec<String>,
    /// The longest that a dispatch kept the device (ms); nothing where none was at work.
    pub longest_dispatch_ms: Option<f64>,
    /// Whether it was broken off.
    pub interrupted: bool,
}

impl PopulationSettings {
    /// Laps of so many lines.
    pub fn laps(&self, lines: usize) -> usize {
        (self.setups + 1) * lines * self.grip_shares.len()
    }

    /// What the study's memory goes with, driven on so many lines.
    pub fn kept(&self, lines: usize) -> [Kept; 1] {
        let laps = [lines, self.grip_shares.len()].map(|n| n as u64);
        let variables = self.parameters.len() as u64 + 2;
        [Kept {
            name: "setups",
            count: self.setups as u64 + 1,
            each: (laps[0] * laps[1]).saturating_mul(ANSWER) + laps[0] * 3 * 8 * variables,
        }]
    }

    /// Checks every setting, and whether `car` has the parameters.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn check(&self, car: &Car) -> Result<()> {
        let refuse = |place: &str, found: String, expected: &str| {
            Err(Error::input("the drive", place, found, expected))
        };
        if self.setups > MOST_SETUPS {
            return refuse("setups", self.setups.to_string(), "at most 65536");
        }
        if !(self.share > 0.0 && self.share < 1.0) {
            return refuse("share", self.share.to_string(), "a share above 0 and below 1");
        }
        if self.setups > 0 && self.parameters.is_empty() || self.parameters.len() > MOST_PARAMETERS {
            let found = format!("{} of them", self.parameters.len());
            return refuse("parameters", found, "1 to 256");
        }
        self.free(car).map(|_| ())
    }

    /// Free parameters of `car` with their bounds, those of a value of nought left where no share of it moves them.
    fn free(&self, car: &Car) -> Result<Vec<(CarParameter, f64, f64)>> {
        if self.setups == 0 {
            return Ok(Vec::new());
        }
        let flat = car.to_flat();
        self.parameters
            .iter()
            .map(|name| {
                let parameter = car.known_parameter(&car.name, "parameters", name)?;
                let value = flat[parameter.slots[0]];
                if parameter.slots.iter().any(|slot| flat[*slot] != value) {
                    let expected = format!("front.{name} or rear.{name}, whose values differ");
                    return Err(Error::input(
                        &car.name,
                        "parameters",
                        format!("`{name}`"),
                        expected,
                    ));
                }
                if value == 0.0 {
                    let expected = "one that is not nought, which no share of itself moves";
                    return Err(Error::input(&car.name, name, "0", expected));
                }
                let reach = self.share * value.abs();
                let within = |x: f64| x.clamp(parameter.info.minimum, parameter.info.maximum);
                let (lower, upper) = (within(value - reach), within(value + reach));
                Ok((parameter, lower, upper))
            })
            .collect()
    }
}

/// Drives set-ups of `car` along `lines` between the edges (m, right and left), within the limits of `limits`. `observe` is
/// told how many laps of how many are driven, and may end it.
///
/// # Errors
/// [`Error::Input`] for settings out of range, unknown parameters and lines that are no laps; those of the backend.
pub fn drive_population(
    car: &Car,
    limits: &PointMass,
    lines: &[NamedLine],
    edges_m: [&[DVec2]; 2],
    settings: &PopulationSettings,
    observe: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<PopulationOutcome> {
    let mut keeper = Keeper::idle();
    let recorder = &mut Recorder::idle(&mut keeper);
    drive_population_recorded(car, limits, lines, edges_m, settings, recorder, observe)?
        .ok_or_else(|| Error::Study("broken off before the first lap".to_owned()))
}

/// As [`drive_population`], with the laps noted by `recorder`, or known to it; nothing if it was broken off while the lines were
/// planned.
///
/// # Errors
/// As [`drive_population`], and those of the recorder.
pub fn drive_population_recorded(
    car: &Car,
    limits: &PointMass,
    lines: &[NamedLine],
    edges_m: [&[DVec2]; 2],
    settings: &PopulationSettings,
    recorder: &mut Recorder<'_>,
    mut observe: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<PopulationOutcome>> {
    settings.check(car)?;
    let shares = &settings.grip_shares;
    let planned_laps = settings.laps(lines.len());
    let circuits = lines
        .iter()
        .map(|line| line.circuit(edges_m, settings.car_width_m))
        .collect::<Result<Vec<_>>>()?;
    let mut plans = Vec::with_capacity(lines.len());
    for line in lines {
        if observe(0, planned_laps).is_break() {
            recorder.keep()?;
            return Ok(None);
        }
        let of_line = shares
            .par_iter()
            .map(|share| planned(limits, &line.points_m, *share).map(|(_, _, plan)| plan))
            .collect::<Result<Vec<_>>>()?;
        plans.push(of_line);
    }
    let roads: Vec<Line<'_>> = circuits
        .iter()
        .zip(&plans)
        .map(|(circuit, plans)| Line { circuit, plans })
        .collect();
    let free = settings.free(car)?;
    let parameters: Vec<CarParameter> = free.iter().map(|(p, _, _)| p.clone()).collect();
    let driver = DriveSettings::new(DriverSettings::racing(car)?);
    let problem = DriveProblem::new(
        car.clone(),
        free.clone(),
        &roads,
        shares,
        &driver,
        &DriveObjective::ALL,
    )?;
    let flat = car.to_flat();
    let seed = (settings.seed ^ (settings.seed >> 32)) as u32;
    let setups: Vec<Vec<f64>> = (0..=settings.setups)
        .map(|setup| {
            free.iter()
                .zip(0..)
                .map(|((parameter, lower, upper), dimension)| match setup {
                    0 => flat[parameter.slots[0]],
                    _ => {
                        let point = sobol_burley::sample(setup as u32 - 1, dimension, seed);
                        lower + f64::from(point) * (upper - lower)
                    }
                })
                .collect()
        })
        .collect();
    let width = problem.dimensions();
    let cases: Vec<(usize, usize)> = (0..setups.len())
        .flat_map(|setup| (0..lines.len()).map(move |line| (setup, line)))
        .collect();
    let dispatches = DispatchWatch::begin();
    let mut evaluator = open_drive_evaluator(&problem, settings.backend, settings.adapter.as_deref())?;
    let mut inputs = Inputs::new("transient");
    inputs.add(&(car, limits, lines, edges_m));
    let opened = evaluator.backend();
    recorder.begin(inputs.key(), &opened)?;
    let began = Instant::now();
    let mut driven: Vec<Driven> = Vec::with_capacity(cases.len());
    let mut failures = FailureCounts::new();
    let mut evaluations = 0;
    let mut interrupted = false;
    for batch in cases.chunks((BATCH / shares.len()).max(1)) {
        let mut population = Vec::with_capacity(batch.len() * shares.len() * width);
        for (setup, line) in batch {
            for share in shares {
                population.extend(&setups[*setup]);
                if lines.len() > 1 {
                    population.push(*line as f64);
                }
                if shares.len() > 1 {
                    population.push(*share);
                }
            }
        }
        let evaluation = recorder.over(evaluator.as_mut()).evaluate(&population)?;
        add_failures(&mut failures, &evaluation.failure_counts());
        evaluations += evaluation.failures.len();
        let laps = evaluation
            .objectives
            .chunks_exact(DriveObjective::ALL.len() * shares.len());
        let failed = evaluation.failures.chunks_exact(shares.len());
        for (((setup, line), laps), failed) in batch.iter().zip(laps).zip(failed) {
            let best = laps
                .chunks_exact(DriveObjective::ALL.len())
                .zip(shares)
                .zip(failed)
                .filter(|((lap, _), failed)| failed.is_none() && lap[1] <= 0.0)
                .map(|((lap, share), _)| DrivenBest {
                    grip_share: *share,
                    lap_time_s: lap[0],
                    room_m: -lap[1],
                    steering_radps: lap[2],
                })
                .min_by(|a, b| a.lap_time_s.total_cmp(&b.lap_time_s));
            driven.push(Driven {
                line: *line,
                setup: *setup,
                values: setups[*setup].clone(),
                best,
            });
        }
        if observe(evaluations, planned_laps).is_break() && evaluations < planned_laps {
            recorder.keep()?;
            interrupted = true;
            break;
        }
    }
    let time = |d: &Driven| d.best.map_or(f64::INFINITY, |b| b.lap_time_s);
    driven.sort_by(|a, b| time(a).total_cmp(&time(b)));
    Ok(Some(PopulationOutcome {
        parameters,
        driven,
        evaluations,
        driving_s: began.elapsed().as_secs_f64(),
        failures,
        backend: recorder.backend().cloned().unwrap_or(opened),
        device_faults: recorder.device_faults().to_vec(),
        longest_dispatch_ms: dispatches.longest_ms(),
        interrupted,
    }))
}
