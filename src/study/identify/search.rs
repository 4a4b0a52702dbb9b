//! The search itself: swarm, polish, judgement.

use super::coordinates::Logarithmic;
use super::identifiability::{Identifiability, judge, noise_of};
use super::polish::polish;
use super::settings::{Algorithm, IdentifySettings};
use super::setup::{CHANNELS, Setup};
use crate::error::{Error, Result};
use crate::evaluate::replay::{ReplayProblem, open_evaluator, trace};
use crate::evaluate::{BackendInfo, Evaluator, FAILED_COST};
use crate::swarm::{
    CovarianceSettings, CovarianceSwarm, Mopso, MopsoSettings, Progress, Pso, PsoSettings, run,
};
use std::ops::ControlFlow;
use std::time::Instant;

/// A stage of the work, for progress reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The exploring swarm.
    Explore,
    /// The swarm that learns the valley.
    Gather,
    /// The least-squares polish.
    Polish,
}

/// What an observer of the search is told.
pub struct Report<'a> {
    /// The stage.
    pub stage: Stage,
    /// Iterations that the stage plans.
    pub planned: usize,
    /// What the swarm did last; nothing during the polish.
    pub progress: Option<&'a Progress>,
}

/// One line of the convergence history.
#[derive(Clone, Debug, PartialEq)]
pub struct HistoryRow {
    /// Iterations over both stages.
    pub iteration: usize,
    /// Evaluations over both stages.
    pub evaluations: u64,
    /// Best value of each objective.
    pub best: Vec<f64>,
    /// Median of the first objective over the iteration's candidates that did not fail.
    pub median: Option<f64>,
    /// Candidates of the iteration that failed.
    pub failed: usize,
    /// Seconds since the search began.
    pub elapsed_s: f64,
}

/// Non-dominated candidates and their objectives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Front {
    /// One row per member.
    pub candidates: Vec<Vec<f64>>,
    /// One row per member.
    pub objectives: Vec<Vec<f64>>,
    /// The member nearest to the ideal point, each objective as a share of its range.
    pub chosen: usize,
}

/// The outcome of an identification.
pub struct Outcome {
    /// The swarm's best.
    pub swarm_candidate: Vec<f64>,
    /// The final candidate: polished, if asked for.
    pub candidate: Vec<f64>,
    /// The non-dominated front of a multi-objective search.
    pub front: Option<Front>,
    /// Convergence.
    pub history: Vec<HistoryRow>,
    /// What the log says of each parameter.
    pub identifiability: Identifiability,
    /// What evaluated.
    pub backend: BackendInfo,
    /// Candidates evaluated by the swarm.
    pub evaluations: u64,
    /// Time that the swarm took, s.
    pub swarm_s: f64,
    /// Time that the polish took, s.
    pub polish_s: f64,
    /// Drives that the polish took.
    pub polish_evaluations: usize,
    /// Whether the search was broken off by the observer.
    pub interrupted: bool,
}

/// Exploring swarm of the adaptive search: many particles for a short while.
const EXPLORE: (usize, usize) = (128, 50);
/// Gathering swarm of the adaptive search.
const GATHER: (usize, usize) = (64, 1500);

/// Runs the search.
///
/// # Errors
/// [`Error::Study`] if no candidate could be driven at all; those of the evaluator.
pub fn search(
    settings: &IdentifySettings,
    setup: &Setup,
    mut observe: impl FnMut(&Report<'_>) -> ControlFlow<()>,
) -> Result<Outcome> {
    let replay = &setup.replay;
    let mut evaluator = open_evaluator(replay, settings.backend, settings.adapter.as_deref())?;
    let began = Instant::now();
    let mut log = HistoryLog {
        rows: Vec::new(),
        began,
    };
    let mut interrupted = false;
    let motion = swarm_settings(settings);

    let (swarm_candidate, front) = if settings.objectives.len() > 1 {
        let mopso_settings = front_settings(settings, motion);
        let planned = mopso_settings.motion.iterations;
        let mut swarm = Mopso::new(&replay.problem, mopso_settings)?;
        run(&mut swarm, evaluator.as_mut(), |p| {
            let flow = log.watch(Stage::Explore, planned, p, &mut observe);
            interrupted |= flow.is_break();
            flow
        })?;
        let front = front_of(&swarm).ok_or_else(nothing_drives)?;
        (front.candidates[front.chosen].clone(), Some(front))
    } else {
        let planned = motion.iterations;
        let mut swarm = Pso::new(&replay.problem, motion.clone())?;
        run(&mut swarm, evaluator.as_mut(), |p| {
            let flow = log.watch(Stage::Explore, planned, p, &mut observe);
            interrupted |= flow.is_break();
            flow
        })?;
        let (mut best, mut cost) = swarm.best_candidate();
        if settings.algorithm == Algorithm::Adaptive && !interrupted {
            let gathering = CovarianceSettings {
                population: settings.population.unwrap_or(GATHER.0),
                iterations: settings.iterations.unwrap_or(GATHER.1),
                seed: settings.seed,
                // Along the valley what did not pay tells as much as what did: it halves the error that is left.
                active: true,
                ..CovarianceSettings::default()
            };
            let planned = gathering.iterations;
            let mut seen = Logarithmic::new(evaluator.as_mut());
            let start = seen.of_parameters(&best);
            let mut swarm = CovarianceSwarm::new(seen.problem(), &start, gathering)?;
            run(&mut swarm, &mut seen, |p| {
                let flow = log.watch(Stage::Gather, planned, p, &mut observe);
                interrupted |= flow.is_break();
                flow
            })?;
            let (gathered, least) = swarm.best_candidate();
            if least < cost {
                (best, cost) = (seen.to_parameters(&gathered), least);
            }
        }
        if cost >= FAILED_COST {
            return Err(nothing_drives());
        }
        (best, None)
    };
    let swarm_s = began.elapsed().as_secs_f64();
    let evaluations = log.rows.last().map_or(0, |row| row.evaluations);
    let backend = evaluator.backend();

    let polish_began = Instant::now();
    let mut candidate = swarm_candidate.clone();
    let mut polish_evaluations = 0;
    if settings.polish && !interrupted {
        let _ = observe(&Report {
            stage: Stage::Polish,
            planned: 0,
            progress: None,
        });
        // First with the channels' spreads for weights, then with the noise that this leaves: maximum likelihood
        // for white noise.
        let mut weights = setup.scales.map(|s| 1.0 / s);
        for _ in 0..2 {
            let Some(polished) = polish(replay, &candidate, weights) else {
                break;
            };
            polish_evaluations += polished.evaluations;
            candidate = polished.candidate;
            let Some(residuals) = replay.residuals(&candidate) else {
                break;
            };
            let noise = noise_of(&residuals.errors, &setup.scales);
            if (0..CHANNELS).all(|k| noise[k] < EXACT * setup.scales[k]) {
                break;
            }
            weights = noise.map(|n| 1.0 / n);
        }
    }
    let residuals = replay.residuals(&candidate).ok_or_else(nothing_drives)?;
    Ok(Outcome {
        identifiability: judge(&residuals, &replay.problem.variables, &setup.scales),
        polish_s: polish_began.elapsed().as_secs_f64(),
        swarm_candidate,
        candidate,
        front,
        history: log.rows,
        backend,
        evaluations,
        swarm_s,
        polish_evaluations,
        interrupted,
    })
}

/// Errors of every channel under this share of its spread are rounding, and there is no noise to weight by.
const EXACT: f64 = 1e-7;

fn nothing_drives() -> Error {
    Error::Study(
        "no candidate within the bounds drives the log to its end; narrow the bounds, or score shorter windows \
         (window_s)"
            .to_owned(),
    )
}

fn swarm_settings(settings: &IdentifySettings) -> PsoSettings {
    let base = match settings.algorithm {
        Algorithm::Thesis => PsoSettings::thesis(),
        _ => PsoSettings::default(),
    };
    let adaptive = settings.algorithm == Algorithm::Adaptive && settings.objectives.len() == 1;
    let (population, iterations) = if adaptive {
        EXPLORE
    } else {
        (
            settings.population.unwrap_or(base.population),
            settings.iterations.unwrap_or(base.iterations),
        )
    };
    PsoSettings {
        population,
        iterations,
        seed: settings.seed,
        inertia: settings.inertia.unwrap_or(base.inertia),
        cognitive: settings.cognitive.unwrap_or(base.cognitive),
        social: settings.social.unwrap_or(base.social),
        ..base
    }
}

/// The thesis's swarm, or the best there is; pulls that the study names make it a plain one with these.
fn front_settings(settings: &IdentifySettings, motion: PsoSettings) -> MopsoSettings {
    let named = [settings.inertia, settings.cognitive, settings.social];
    let base = match settings.algorithm {
        Algorithm::Thesis => MopsoSettings::thesis(),
        _ => MopsoSettings::default(),
    };
    let motion = if settings.algorithm == Algorithm::Thesis || named.iter().any(Option::is_some) {
        PsoSettings {
            difference_share: base.motion.difference_share,
            ..motion
        }
    } else {
        PsoSettings {
            population: motion.population,
            iterations: motion.iterations,
            seed: motion.seed,
            ..base.motion
        }
    };
    MopsoSettings {
        motion,
        archive: settings.archive,
        mutation: settings.mutation.unwrap_or(base.mutation),
        ..base
    }
}

struct HistoryLog {
    rows: Vec<HistoryRow>,
    began: Instant,
}

impl HistoryLog {
    /// Notes an iteration down; counts go on from the stage before.
    fn watch(
        &mut self,
        stage: Stage,
        planned: usize,
        progress: &Progress,
        observe: &mut impl FnMut(&Report<'_>) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let (iteration, evaluations) = self.rows.last().map_or((0, 0), |r| (r.iteration, r.evaluations));
        let done = if progress.iteration <= 1 {
            progress.evaluations
        } else {
            progress.evaluations / progress.iteration as u64
        };
        let best = match self.rows.last() {
            // A stage starts from the best of the one before.
            Some(row) => row
                .best
                .iter()
                .zip(&progress.best)
                .map(|(a, b)| a.min(*b))
                .collect(),
            None => progress.best.clone(),
        };
        self.rows.push(HistoryRow {
            iteration: iteration + 1,
            evaluations: evaluations + done,
            best,
            median: progress.median,
            failed: progress.failed,
            elapsed_s: self.began.elapsed().as_secs_f64(),
        });
        observe(&Report {
            stage,
            planned,
            progress: Some(progress),
        })
    }
}

fn front_of(swarm: &Mopso) -> Option<Front> {
    let objectives = swarm.archive().objectives.clone();
    let width = objectives.first()?.len();
    let bound = |k: usize, f: fn(f64, f64) -> f64, start: f64| objectives.iter().map(|o| o[k]).fold(start, f);
    let distance = |row: &Vec<f64>| -> f64 {
        (0..width)
            .map(|k| {
                let (low, high) = (
                    bound(k, f64::min, f64::INFINITY),
                    bound(k, f64::max, f64::NEG_INFINITY),
                );
                if high > low {
                    ((row[k] - low) / (high - low)).powi(2)
                } else {
                    0.0
                }
            })
            .sum()
    };
    let chosen = (0..objectives.len())
        .min_by(|&a, &b| distance(&objectives[a]).total_cmp(&distance(&objectives[b])))?;
    Some(Front {
        candidates: swarm.archive_candidates(),
        objectives,
        chosen,
    })
}

/// Figures of one candidate over one problem: what it does, and how far off that is.
pub struct Judged {
    /// The four outputs by sample of the log; not a number where no window drives.
    pub outputs: [Vec<f64>; CHANNELS],
    /// Cost of each channel in the study's norm.
    pub costs: [f64; CHANNELS],
    /// Root mean square error of each channel over the scored samples.
    pub rms_error: [f64; CHANNELS],
    /// Root mean square of each measured channel over the scored samples.
    pub rms_signal: [f64; CHANNELS],
    /// Windows in which the car was lost.
    pub lost_windows: usize,
}

/// Drives a candidate through all windows of a problem in `f64`.
pub fn judge_candidate(replay: &ReplayProblem, candidate: &[f64]) -> Judged {
    use crate::evaluate::replay::Norm;
    let samples = &replay.plan.samples;
    let flat = replay.flat(candidate);
    let mut outputs: [Vec<f64>; CHANNELS] = std::array::from_fn(|_| vec![f64::NAN; samples.len()]);
    let mut squares = [0.0; CHANNELS];
    let mut signal = [0.0; CHANNELS];
    let mut errors = [0.0; CHANNELS];
    let mut scored = 0usize;
    let mut lost_windows = 0;
    for window in &replay.plan.windows {
        let (driven, drives) = trace(&flat, replay.tyre_model(), &replay.plan, window);
        lost_windows += usize::from(!drives);
        for (i, output) in driven.iter().enumerate() {
            let sample = &samples[window.start + i];
            if i < window.scored_from {
                continue;
            }
            scored += 1;
            for k in 0..CHANNELS {
                let error = output[k] - sample.measured[k];
                outputs[k][window.start + i] = output[k];
                squares[k] += error * error;
                signal[k] += sample.measured[k].powi(2);
                errors[k] = match replay.plan.norm {
                    Norm::One => errors[k] + error.abs(),
                    Norm::Two | Norm::MeanSquare => errors[k] + error * error,
                    Norm::Infinity => f64::max(errors[k], error.abs()),
                };
            }
        }
    }
    let root = |sum: f64| (sum / scored.max(1) as f64).sqrt();
    Judged {
        outputs,
        costs: replay.channel_costs(&errors),
        rms_error: squares.map(root),
        rms_signal: signal.map(root),
        lost_windows,
    }
}

/// The sum of relative parameter errors (equation 5.14 of the thesis) over the parameters that count.
pub fn total_parameter_error(candidate: &[f64], truth: &[f64], counts: impl Fn(usize) -> bool) -> f64 {
    candidate
        .iter()
        .zip(truth)
        .enumerate()
        .filter(|(k, _)| counts(*k))
        .map(|(_, (x, t))| {
            if *t == 0.0 {
                (x - t).abs()
            } else {
                ((x - t) / t).abs()
            }
        })
        .sum()
}
