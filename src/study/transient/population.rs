//! Many set-ups of a car on many lines, all driven: which of them is the fastest within the edges.
//!
//! Every set-up drives every line at the speeds of quasi-steady-state laps with different shares of the envelope's grip; what it is
//! worth is its fastest lap on which the car stays within the edges.

use super::{Prepared, Transient, TransientSettings, TransientState, planned};
use crate::drive::{DriverSettings, Line};
use crate::error::Result;
use crate::evaluate::drive::{DriveObjective, DriveProblem, DriveSettings, open_drive_evaluator};
use crate::evaluate::{Evaluator, add_failures};
use crate::study::framework::journal::Recorder;
use crate::study::framework::setups::setups_of;
use crate::study::framework::{Inputs, Progress, RunRecord, Study, Watch, Work};
use crate::vehicle::{CarParameter, Traction};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::Instant;

/// Laps between two reports of progress, of which no backend is short.
const BATCH: usize = 1024;

/// A set-up on a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Driven {
    /// The line, by its place among those given.
    pub line: usize,
    /// The set-up: zero is the car as it is.
    pub setup: usize,
    /// Values of the parameters.
    pub values: Vec<f64>,
    /// The share of the grip with which it was fastest within the edges, and that lap; none where it never stayed within.
    pub best: Option<DrivenBest>,
}

/// A lap within the edges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

/// What a population comes to.
#[derive(Clone, Debug)]
pub struct PopulationOutcome {
    /// Parameters that set-ups move.
    pub parameters: Vec<CarParameter>,
    /// Every set-up on every line, the fastest first, those without a lap last.
    pub driven: Vec<Driven>,
    /// How it ran; candidates per second are laps, plans and files aside.
    pub record: RunRecord,
}

/// The problem of driving set-ups on lines with shares of the grip; nothing if `proceed`, which is asked before each line is
/// planned, ends it.
///
/// # Errors
/// [`crate::Error::Input`] for unknown parameters, and those of [`DriveProblem::new`].
pub fn drive_problem(
    settings: &TransientSettings,
    prepared: &Prepared,
    mut proceed: impl FnMut() -> ControlFlow<()>,
) -> Result<Option<DriveProblem>> {
    let Prepared { car, road, lines, .. } = prepared;
    let shares = settings.shares();
    let traction = Traction::of(car, &road.car.envelope);
    let mut plans = Vec::with_capacity(lines.len());
    for line in lines {
        if proceed().is_break() {
            return Ok(None);
        }
        let of_line = shares
            .par_iter()
            .map(|share| planned(&road.car, &traction, line, *share).map(|(_, _, plan)| plan))
            .collect::<Result<Vec<_>>>()?;
        plans.push(of_line);
    }
    let roads: Vec<Line<'_>> = lines
        .iter()
        .zip(&plans)
        .map(|(line, plans)| Line {
            circuit: &line.circuit,
            plans,
        })
        .collect();
    let driver = DriveSettings::new(DriverSettings::racing(car)?);
    let free = settings.free(car)?;
    DriveProblem::new(car.clone(), free, &roads, &shares, &driver, &DriveObjective::ALL).map(Some)
}

/// Drives all set-ups on all lines; nothing if the observer ends it while the lines are planned.
///
/// # Errors
/// [`crate::Error::Input`] for unknown parameters and if the state belongs to other inputs; those of the backend.
pub(super) fn drive(work: Work<'_, Transient>) -> Result<Option<PopulationOutcome>> {
    let watch = Watch::begin();
    let Prepared { car, road, lines, .. } = work.prepared;
    let limits = &road.car;
    let Work {
        settings,
        state,
        state_file,
        observe,
        ..
    } = work;
    let journal = state.map(TransientState::population).transpose()?;
    let mut recorder = Recorder::of(Transient::NAME, settings, journal, state_file)?;
    recorder.save()?;
    let shares = settings.shares();
    let all = settings.laps() as u64;
    let planned = drive_problem(settings, work.prepared, || observe(&Progress::counted(0, all)))?;
    let Some(problem) = planned else {
        return Ok(None);
    };
    let free = settings.free(car)?;
    let parameters: Vec<CarParameter> = free.iter().map(|(p, _, _)| p.clone()).collect();
    let setups = setups_of(car, &free, settings.setups.unwrap_or(0), settings.seed);
    let width = problem.dimensions();
    let cases: Vec<(usize, usize)> = (0..setups.len())
        .flat_map(|setup| (0..lines.len()).map(move |line| (setup, line)))
        .collect();
    let mut evaluator = open_drive_evaluator(&problem, settings.backend, settings.adapter.as_deref())?;
    let mut inputs = Inputs::new("transient");
    inputs.add(&(car, limits, lines, &shares));
    recorder.begin(inputs.key(), &evaluator.backend())?;
    let mut record = RunRecord::of(&evaluator.backend());
    let began = Instant::now();
    let mut driven: Vec<Driven> = Vec::with_capacity(cases.len());
    let mut evaluations = 0;
    for batch in cases.chunks((BATCH / shares.len()).max(1)) {
        let mut population = Vec::with_capacity(batch.len() * shares.len() * width);
        for (setup, line) in batch {
            for share in &shares {
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
        add_failures(&mut record.failures, &evaluation.failure_counts());
        evaluations += evaluation.failures.len() as u64;
        let laps = evaluation
            .objectives
            .chunks_exact(DriveObjective::ALL.len() * shares.len());
        let failed = evaluation.failures.chunks_exact(shares.len());
        for (((setup, line), laps), failed) in batch.iter().zip(laps).zip(failed) {
            let best = laps
                .chunks_exact(DriveObjective::ALL.len())
                .zip(&shares)
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
        if observe(&Progress::counted(evaluations, all)).is_break() && evaluations < all {
            recorder.save()?;
            record.interrupted = true;
            break;
        }
    }
    let time = |d: &Driven| d.best.map_or(f64::INFINITY, |b| b.lap_time_s);
    driven.sort_by(|a, b| time(a).total_cmp(&time(b)));
    recorder.complete(&mut record);
    record.took(evaluations, watch.elapsed_s(), began.elapsed().as_secs_f64());
    record.longest_dispatch_ms = watch.longest_dispatch_ms();
    Ok(Some(PopulationOutcome {
        parameters,
        driven,
        record,
    }))
}
