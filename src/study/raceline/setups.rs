//! Many set-ups of the car, each with an envelope and a fastest line of its own.
//!
//! Set-ups are solved in batches that double. Each starts from the line of the nearest set-up that is done, so that few programs are
//! left to solve. A sample of them is solved once more from the minimum-curvature line, as if nothing were known.

use super::setup::{Setup, envelope_on, point_mass};
use super::state::Running;
use super::{RacelineSettings, ReportedLine};
use crate::error::{Error, Result};
use crate::evaluate::line::LineObjective;
use crate::optimum::{ReferenceSolvers, interruptible};
use crate::study::framework::Progress;
use crate::study::framework::setups::{FreeParameter, car_of, free_parameters, setups_of};
use crate::vehicle::{Car, CarParameter};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Set-ups between two states that are saved, at the most.
const BATCH: usize = 32;
/// Set-ups whose line is set beside a reference optimum of their own.
const SAMPLE: usize = 4;

/// A set-up and its fastest line.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SolvedSetup {
    /// Values of the parameters.
    pub values: Vec<f64>,
    /// Its lap; nothing where the car has no limits or no lap.
    pub lap: Option<SetupLap>,
}

/// The fastest lap of a set-up, on the fine spline.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SetupLap {
    /// Share of the usable width at every cross-section.
    pub alpha: Vec<f64>,
    /// Lap time on its own line (s),
    pub lap_time_s: f64,
    /// and on that of the car as it is.
    pub on_first_line_s: f64,
    /// Least distance from the car to the edges (m).
    pub clearance_m: f64,
    /// Lap time of a reference optimum that knows no other line (s), for those of the sample.
    pub reference_s: Option<f64>,
}

/// All set-ups.
#[derive(Clone, Debug)]
pub struct SetupsOutcome {
    /// Parameters that set-ups move.
    pub parameters: Vec<CarParameter>,
    /// The car as it is, then the set-ups.
    pub solved: Vec<SolvedSetup>,
    /// Time that they took (s), the sample's reference optima aside.
    pub elapsed_s: f64,
}

/// What set-ups are solved with.
struct Batch<'a> {
    settings: &'a RacelineSettings,
    setup: &'a Setup,
    solvers: &'a ReferenceSolvers,
    car: Car,
    free: Vec<FreeParameter>,
    first: &'a ReportedLine,
}

/// Finds the fastest line of every set-up, from `first`, that of the car as it is.
///
/// # Errors
/// [`Error::Input`] for parameters that the car does not have; those of the solvers and of the state's file.
pub(super) fn solve_setups(
    (settings, setup): (&RacelineSettings, &Setup),
    solvers: &ReferenceSolvers,
    first: &ReportedLine,
    stop: &Arc<AtomicBool>,
    work: &mut Running<'_>,
) -> Result<SetupsOutcome> {
    let car = Car::load(&settings.car)?;
    let free = free_parameters(&car, &settings.parameters, settings.share)?;
    let setups = setups_of(&car, &free, settings.setups.unwrap_or(0), settings.seed);
    let batch = Batch {
        settings,
        setup,
        solvers,
        car,
        free,
        first,
    };
    let all = setups.len() as u64;
    while work.state.setups.len() < setups.len() && !work.interrupted {
        let done = work.state.setups.len();
        let end = (done + done.clamp(1, BATCH)).min(setups.len());
        let (known, began) = (work.state.setups.clone(), Instant::now());
        let solved: Vec<SolvedSetup> = in_batch(stop, work, || {
            let each = setups[done..end].par_iter();
            each.map(|values| batch.solved(values, &known)).collect()
        })?;
        work.finished(|state| {
            state.setups.extend(solved);
            state.setups_s += began.elapsed().as_secs_f64();
        });
        let told = Progress::counted(work.state.setups.len() as u64, all);
        if work.told(&told, |_| ())?.is_break() {
            break;
        }
    }
    let elapsed_s = work.state.setups_s;
    let with_lap: Vec<usize> = (0..work.state.setups.len())
        .filter(|k| work.state.setups[*k].lap.is_some())
        .collect();
    let sample: Vec<usize> = (0..SAMPLE.min(with_lap.len()))
        .map(|k| with_lap[k * with_lap.len() / SAMPLE.min(with_lap.len())])
        .collect();
    let missing = |work: &Running<'_>, k: usize| {
        work.state.setups[k]
            .lap
            .as_ref()
            .is_some_and(|lap| lap.reference_s.is_none())
    };
    for k in sample {
        if work.interrupted || !missing(work, k) {
            continue;
        }
        let values = work.state.setups[k].values.clone();
        let reference = in_batch(stop, work, || batch.reference_s(&values))?;
        work.finished(|state| {
            if let Some(lap) = &mut state.setups[k].lap {
                lap.reference_s = reference;
            }
        });
    }
    Ok(SetupsOutcome {
        parameters: batch.free.into_iter().map(|(parameter, ..)| parameter).collect(),
        solved: work.state.setups.clone(),
        elapsed_s,
    })
}

/// Works on another thread, so that whoever watches can break it off. What is broken off comes to nothing.
fn in_batch<T: Send>(
    stop: &Arc<AtomicBool>,
    work: &mut Running<'_>,
    solve: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    std::thread::scope(|scope| interruptible(scope.spawn(solve), stop, || work.asked("set-ups")))
}

impl Batch<'_> {
    /// The solvers of a set-up; nothing where it has no envelope.
    fn solvers_of(&self, values: &[f64]) -> Result<Option<ReferenceSolvers>> {
        let car = car_of(
            &self.car,
            self.free.iter().map(|(parameter, ..)| parameter),
            values,
        );
        let road = &self.setup.road;
        match envelope_on(road, &car) {
            Ok(envelope) => {
                let car = point_mass(road, &car, envelope, self.settings)?;
                self.solvers.of_car(&car).map(Some)
            }
            // A car that no speed suits is a set-up without a lap.
            Err(Error::Study(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The fastest line of a set-up, from that of the nearest of those that are known.
    fn solved(&self, values: &[f64], known: &[SolvedSetup]) -> Result<SolvedSetup> {
        let without = SolvedSetup {
            values: values.to_vec(),
            lap: None,
        };
        let Some(solvers) = self.solvers_of(values)? else {
            return Ok(without);
        };
        let distance = |other: &SolvedSetup| -> f64 {
            let each = self.free.iter().zip(values.iter().zip(&other.values));
            each.map(|((_, lower, upper), (a, b))| ((a - b) / (upper - lower)).powi(2))
                .sum()
        };
        let nearest = known
            .iter()
            .filter_map(|other| Some((distance(other), &other.lap.as_ref()?.alpha)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let start = nearest.map_or(&self.first.alpha, |(_, alpha)| alpha);
        let found = solvers.fastest_about(start)?;
        let alpha = found.map_or_else(|| start.clone(), |found| found.x);
        // What is solved is mended as any line is.
        let alpha = self.setup.brought_in(&alpha, self.settings)?.unwrap_or(alpha);
        let (Ok(own), Ok(on_first)) = (solvers.lap(&alpha), solvers.lap(&self.first.alpha)) else {
            return Ok(without);
        };
        // The line of the car as it is suits a set-up that is hardly another one.
        let (alpha, (lap_time_s, clearance_m)) = if on_first.0 < own.0 {
            (self.first.alpha.clone(), on_first)
        } else {
            (alpha, own)
        };
        Ok(SolvedSetup {
            lap: Some(SetupLap {
                alpha,
                lap_time_s,
                on_first_line_s: on_first.0,
                clearance_m,
                reference_s: None,
            }),
            ..without
        })
    }

    /// The lap time (s) of a set-up's reference optimum, from the minimum-curvature line.
    fn reference_s(&self, values: &[f64]) -> Result<Option<f64>> {
        let Some(solvers) = self.solvers_of(values)? else {
            return Ok(None);
        };
        let Some(best) = solvers.best(LineObjective::LapTime)? else {
            return Ok(None);
        };
        Ok(solvers.lap(&best.alpha).ok().map(|(time_s, _)| time_s))
    }
}
