//! The search itself: swarm, polish, judgement.

use super::identifiability::{Identifiability, judge};
use super::refine::{refine, restarted};
use super::resident::Resident;
use super::settings::{Algorithm, EXPLORE, FRONT, GATHER, IdentifySettings};
use super::setup::{CHANNELS, Setup};
use super::state::{Front, HistoryRow, Place, SearchState, inputs_of};
use crate::error::{Error, Result};
use crate::evaluate::replay::{ReplayProblem, Residuals, Window, trace};
use crate::evaluate::{DeviceFaults, Evaluator, FailureCounts, Logarithmic, add_failures};
use crate::study::framework::state_file::{Origin, StateFile};
use crate::study::framework::{Progress as Told, RunRecord, State, Watch};
use crate::swarm::metrics::nearest_to_ideal;
use crate::swarm::{
    CovarianceSettings, CovarianceSwarm, FrontSwarm, MopsoSettings, Optimiser, Progress, Pso, PsoSettings,
    SwarmPlace,
};
use std::ops::ControlFlow;
use std::time::Instant;

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
    /// How it ran.
    pub record: RunRecord,
    /// Time that the swarm took, s.
    pub swarm_s: f64,
    /// Hops to other minima that were tried, and that led further down.
    pub hops: [usize; 2],
    /// The laps to fit, with windows that start where the final candidate comes.
    pub replay: ReplayProblem,
    /// The same of the laps held out, if any.
    pub holdout: Option<ReplayProblem>,
}

/// Searches on an evaluator that is open: one of `setup`'s replay. Starts from the state of an interrupted search of the same
/// settings if one is given, and hands the state to `state_file` while it works.
///
/// # Errors
/// [`Error::Study`] if no candidate could be driven at all; those of the evaluator; [`Error::Input`] if the state belongs to
/// other inputs or another backend; [`Error::Io`] if the state cannot be saved when the search is interrupted.
pub fn search_with(
    settings: &IdentifySettings,
    setup: &Setup,
    evaluator: &mut dyn Evaluator,
    (state, state_file): (Option<SearchState>, &mut StateFile),
    observe: &mut dyn FnMut(&Told) -> ControlFlow<()>,
) -> Result<Outcome> {
    let watch = Watch::begin();
    let origin = Origin::new(inputs_of(setup), &evaluator.backend());
    let mut state = match state {
        // What to find may have been chosen in less time than it is now, where the search had not begun.
        Some(state) if !state.is_untouched() => {
            state_file.check(&state.origin, &origin)?;
            state
        }
        _ => SearchState {
            settings: settings.clone(),
            origin,
            history: Vec::new(),
            elapsed_s: 0.0,
            failures: FailureCounts::new(),
            device_faults: Vec::new(),
            place: begin(settings, setup, evaluator)?,
        },
    };
    state_file.save(&state)?;
    let before_s = state.elapsed_s;
    let mut faults = DeviceFaults::of(evaluator);
    let began = Instant::now();
    let mut interrupted = setup.choice.as_ref().is_some_and(|choice| choice.cut_short);
    let mut resident = Resident::of(settings, setup, &state)?;
    let mut swarm_backend = None;
    while !interrupted && !matches!(state.place, Place::Searched { .. }) {
        if matches!(state.place, Place::Gather { .. }) && agrees(&state.history) {
            state.place = next_place(state.place, settings, evaluator)?;
            state_file.save_or_warn(&state);
            continue;
        }
        let advanced = match &mut resident {
            Some(resident) => resident.advance()?,
            None => state.place.advance(evaluator)?,
        };
        let Some((doing, planned, progress)) = advanced else {
            if let Some(resident) = resident.take() {
                swarm_backend = Some(resident.finish(&mut state)?);
            }
            state.place = next_place(state.place, settings, evaluator)?;
            state_file.save_or_warn(&state);
            continue;
        };
        state.elapsed_s = before_s + began.elapsed().as_secs_f64();
        state.note(&progress);
        let met = faults.since(evaluator, &state.device_faults);
        state.device_faults.extend(met);
        let best: Vec<String> = progress.best.iter().map(|b| format!("{b:.3e}")).collect();
        let flow = observe(&Told {
            stage: doing.to_owned(),
            done: progress.iteration as u64,
            planned: Some(planned as u64),
            reached: format!("best {}, {} failed", best.join(" "), progress.failed),
        });
        if flow.is_break() {
            if let Some(resident) = resident.take() {
                swarm_backend = Some(resident.finish(&mut state)?);
            }
            state_file.save(&state)?;
            interrupted = true;
            break;
        }
        if state_file.due() {
            match &mut resident {
                Some(resident) => state_file.save_or_warn(&resident.kept(&state)),
                None => state_file.save_or_warn(&state),
            }
        }
    }
    let swarm_s = before_s + began.elapsed().as_secs_f64();
    let evaluations = state.history.last().map_or(0, |row| row.evaluations);
    let backend = swarm_backend.unwrap_or_else(|| evaluator.backend());
    let (swarm_candidate, front) = if interrupted {
        best_of_interrupted(setup, &state.place, evaluator)?
    } else {
        best_so_far(&state.place, evaluator)?
    };

    let polish_began = Instant::now();
    let mut refined = None;
    if settings.polish && !interrupted {
        let mut told = || {
            observe(&Told::reached(
                "polishing",
                0,
                "least squares on the exact Jacobian",
            ))
        };
        let mut found = refine(settings, setup, evaluator, &swarm_candidate, &mut told)?;
        if !found.interrupted {
            (found.candidate, found.interrupted) = restarted(setup, found.candidate, &mut told);
        }
        interrupted |= found.interrupted;
        refined = Some(found);
    }
    let (candidate, hops) = match refined {
        Some(r) => (r.candidate, [r.hops, r.hops_gained]),
        None => (swarm_candidate.clone(), [0, 0]),
    };
    let own_starts = |replay: &ReplayProblem| {
        let mut own = replay.clone();
        own.start_as_driven_by(&own.flat(&candidate));
        own
    };
    let own = own_starts(&setup.replay);
    let (replay, residuals) = match (own.residuals(&candidate), setup.replay.residuals(&candidate)) {
        (Some(residuals), _) => (own, residuals),
        (None, Some(residuals)) => (setup.replay.clone(), residuals),
        (None, None) if interrupted => {
            let residuals = residuals_of_driven(&own, &candidate);
            (own, residuals)
        }
        (None, None) => return Err(nothing_drives()),
    };
    let holdout = setup.holdout.as_ref().map(own_starts);
    let (candidate, residuals) = as_given_without_effect(&replay, candidate, residuals);
    let polish_s = polish_began.elapsed().as_secs_f64();
    let mut record = RunRecord::of(&backend);
    record.failures = state.failures;
    record.device_faults = state.device_faults;
    record.longest_dispatch_ms = watch.longest_dispatch_ms();
    record.interrupted = interrupted;
    record.took(evaluations, swarm_s + polish_s, swarm_s);
    Ok(Outcome {
        identifiability: judge(&residuals, &replay.problem.variables, &candidate, &setup.scales),
        swarm_candidate,
        candidate,
        front,
        history: state.history,
        record,
        swarm_s,
        hops,
        replay,
        holdout,
    })
}

/// Where a search begins: about the values that the choice of what to find has come to, if these drive the log, and else with the
/// first swarm.
fn begin(settings: &IdentifySettings, setup: &Setup, evaluator: &mut dyn Evaluator) -> Result<Place> {
    if settings.algorithm == Algorithm::Adaptive
        && settings.objectives.len() == 1
        && let Some(best) = chosen_values(setup)
    {
        let worth = evaluator.evaluate(&best)?.worths(1)[0];
        if worth.succeeded() {
            let seen = Logarithmic::new(evaluator);
            let swarm =
                CovarianceSwarm::new(seen.problem(), &seen.of_parameters(&best), gathering(settings))?;
            return Ok(Place::Gather {
                best,
                worth,
                swarm: Box::new(swarm),
            });
        }
    }
    first_place(settings, setup)
}

/// The candidate that the choice of what to find has come to.
fn chosen_values(setup: &Setup) -> Option<Vec<f64>> {
    setup.choice.as_ref()?.candidate(&setup.replay)
}

/// What an interrupted search hands on: the best that it has come to, or what it began from where that drives the log better. Where
/// the truth is known, a search that has a best of its own is not given the starting car, which may be it.
fn best_of_interrupted(
    setup: &Setup,
    place: &Place,
    evaluator: &mut dyn Evaluator,
) -> Result<(Vec<f64>, Option<Front>)> {
    let replay = &setup.replay;
    let given = replay.free.values_in(replay.free.base());
    let own = best_so_far(place, evaluator).ok();
    if own.is_some() && (setup.truth.is_some() || replay.problem.objectives.len() > 1) {
        return own.ok_or_else(nothing_drives);
    }
    let own = own.map(|(candidate, _)| candidate);
    let candidates: Vec<Vec<f64>> = [own, chosen_values(setup), Some(given)]
        .into_iter()
        .flatten()
        .collect();
    let worths = evaluator
        .evaluate(&candidates.concat())?
        .worths(replay.problem.objectives.len());
    // Of those that are lost the last, the starting car.
    let better = |a: usize, b: usize| {
        if worths[b] < worths[a] || !worths[a].succeeded() {
            b
        } else {
            a
        }
    };
    let best = (0..candidates.len()).reduce(better).unwrap_or(0);
    Ok((candidates[best].clone(), None))
}

/// Residuals over the windows that a candidate drives to their end; none where it drives no window.
fn residuals_of_driven(replay: &ReplayProblem, candidate: &[f64]) -> Residuals {
    let flat = replay.flat(candidate);
    let mut driven = replay.clone();
    let drives = |w: &Window<f64>| trace(&flat, replay.tyre_model(), &replay.plan, w).drives;
    driven.plan.windows.retain(drives);
    let found = if driven.plan.windows.is_empty() {
        None
    } else {
        driven.residuals(candidate)
    };
    found.unwrap_or_else(|| Residuals {
        errors: Vec::new(),
        columns: vec![Vec::new(); replay.dimensions()],
    })
}

/// The first swarm.
fn first_place(settings: &IdentifySettings, setup: &Setup) -> Result<Place> {
    let problem = &setup.replay.problem;
    let motion = swarm_settings(settings);
    Ok(if settings.objectives.len() > 1 {
        let swarm = front_settings(settings, motion);
        Place::Front(settings.front_search().begin(problem, swarm, settings.place)?)
    } else if on_device(settings, setup)? {
        let swarm = front_settings(settings, motion);
        Place::Front(
            settings
                .front_search()
                .begin(problem, swarm, SwarmPlace::Device)?,
        )
    } else {
        Place::Explore(Box::new(Pso::new(problem, motion)?))
    })
}

/// Whether the first swarm lives on the device.
///
/// # Errors
/// [`Error::Input`] with the reason if it is asked to and cannot.
pub(super) fn on_device(settings: &IdentifySettings, setup: &Setup) -> Result<bool> {
    let swarm = front_settings(settings, swarm_settings(settings));
    let backend = (settings.backend, settings.adapter.as_deref());
    let problem = &setup.replay.problem;
    settings
        .front_search()
        .on_device(settings.place, problem, &swarm, backend)
}

/// Checks that the swarms which the search is to have can be.
///
/// # Errors
/// [`Error::Input`] naming the setting.
pub fn check_swarms(settings: &IdentifySettings, setup: &Setup) -> Result<()> {
    let first = first_place(settings, setup)?;
    on_device(settings, setup)?;
    if let Place::Explore(_) = first
        && settings.algorithm == Algorithm::Adaptive
    {
        let problem = &setup.replay.problem;
        let middle: Vec<f64> = problem
            .variables
            .iter()
            .map(|v| 0.5 * (v.lower + v.upper))
            .collect();
        CovarianceSwarm::new(problem, &middle, gathering(settings))?;
    }
    Ok(())
}

/// The swarm that gathers.
fn gathering(settings: &IdentifySettings) -> CovarianceSettings {
    CovarianceSettings {
        population: settings.population.unwrap_or(GATHER.0),
        iterations: settings.gathering(),
        seed: settings.seed,
        // Along the valley what did not pay tells as much as what did: it halves the error that is left.
        active: true,
        ..CovarianceSettings::default()
    }
}

/// What comes after a stage that is done.
fn next_place(place: Place, settings: &IdentifySettings, evaluator: &mut dyn Evaluator) -> Result<Place> {
    if let Place::Explore(swarm) = &place
        && settings.algorithm == Algorithm::Adaptive
    {
        let (best, worth) = swarm.best_candidate();
        let seen = Logarithmic::new(evaluator);
        let swarm = CovarianceSwarm::new(seen.problem(), &seen.of_parameters(&best), gathering(settings))?;
        return Ok(Place::Gather {
            best,
            worth,
            swarm: Box::new(swarm),
        });
    }
    let (best, front) = best_so_far(&place, evaluator)?;
    Ok(Place::Searched { best, front })
}

/// The best candidate that a search has come to, and the front of a search that has one.
fn best_so_far(place: &Place, evaluator: &mut dyn Evaluator) -> Result<(Vec<f64>, Option<Front>)> {
    let (best, worth) = match place {
        Place::Searched { best, front } => return Ok((best.clone(), front.clone())),
        Place::Front(swarm) => {
            let front = front_of(swarm).ok_or_else(nothing_drives)?;
            let best = front.candidates[front.chosen].clone();
            let several = front.objectives[front.chosen].len() > 1;
            return Ok((best, several.then_some(front)));
        }
        Place::Explore(swarm) => swarm.best_candidate(),
        Place::Gather { best, worth, swarm } => {
            let (gathered, least) = swarm.best_candidate();
            if least < *worth {
                (Logarithmic::new(evaluator).to_parameters(&gathered), least)
            } else {
                (best.clone(), *worth)
            }
        }
    };
    if !worth.succeeded() {
        return Err(nothing_drives());
    }
    Ok((best, None))
}

/// The candidate with the starting car's value of each parameter that changes nothing on this log: the search left it anywhere
/// between its bounds.
fn as_given_without_effect(
    replay: &ReplayProblem,
    candidate: Vec<f64>,
    residuals: Residuals,
) -> (Vec<f64>, Residuals) {
    let given = replay.free.values_in(replay.free.base());
    let mut changed = candidate.clone();
    for (k, v) in replay.problem.variables.iter().enumerate() {
        let without_effect = residuals.columns[k].iter().all(|slope| *slope == 0.0);
        if without_effect && (v.lower..=v.upper).contains(&given[k]) {
            changed[k] = given[k];
        }
    }
    if changed == candidate {
        return (candidate, residuals);
    }
    match replay.residuals(&changed) {
        Some(same) if same.errors == residuals.errors => (changed, same),
        _ => (candidate, residuals),
    }
}

fn nothing_drives() -> Error {
    Error::Study(
        "no candidate within the bounds drives the log to its end; narrow the bounds, or score shorter windows \
         (window_s)"
            .to_owned(),
    )
}

impl IdentifySettings {
    /// Cars that the swarms drive at the most.
    pub fn evaluations(&self) -> u64 {
        let cars =
            |population: usize, iterations: usize| (population as u64).saturating_mul(iterations as u64);
        let first = swarm_settings(self);
        let gathered = if self.algorithm == Algorithm::Adaptive && self.objectives.len() == 1 {
            let population = self.population.unwrap_or(GATHER.0);
            cars(population, self.gathering())
        } else {
            0
        };
        cars(first.population, first.iterations)
            .saturating_mul(self.islands as u64)
            .saturating_add(gathered)
    }
}

fn swarm_settings(settings: &IdentifySettings) -> PsoSettings {
    let several = settings.objectives.len() > 1;
    let base = match settings.algorithm {
        Algorithm::Thesis if several => MopsoSettings::thesis().motion,
        Algorithm::Thesis => PsoSettings::thesis(),
        _ => PsoSettings::default(),
    };
    let (population, iterations) = match settings.algorithm {
        Algorithm::Adaptive if !several => {
            let most =
                |given: Option<usize>, times: usize| given.map_or(usize::MAX, |n| n.saturating_mul(times));
            let population = EXPLORE.0.min(most(settings.population, 2));
            (population, EXPLORE.1.min(most(settings.iterations, 1)))
        }
        algorithm => {
            let own = several && algorithm != Algorithm::Thesis;
            let usual = if own {
                FRONT
            } else {
                (base.population, base.iterations)
            };
            (
                settings.population.unwrap_or(usual.0),
                settings.iterations.unwrap_or(usual.1),
            )
        }
    };
    settings.coefficients().apply(PsoSettings {
        population,
        iterations,
        seed: settings.seed,
        ..base
    })
}

/// The thesis's swarm, or the best there is; pulls that the study names make it a plain one with these.
fn front_settings(settings: &IdentifySettings, motion: PsoSettings) -> MopsoSettings {
    if settings.objectives.len() == 1 {
        return MopsoSettings::of_one_objective(motion);
    }
    let named = settings.coefficients();
    let base = match settings.algorithm {
        Algorithm::Thesis => MopsoSettings::thesis(),
        _ => MopsoSettings::default(),
    };
    let motion = if settings.algorithm == Algorithm::Thesis || named.names_motion() {
        PsoSettings {
            difference_share: base.motion.difference_share,
            mutation: named.mutation.unwrap_or(base.motion.mutation),
            ..motion
        }
    } else {
        PsoSettings {
            population: motion.population,
            iterations: motion.iterations,
            seed: motion.seed,
            mutation: named.mutation.unwrap_or(base.motion.mutation),
            ..base.motion
        }
    };
    MopsoSettings {
        motion,
        archive: settings.archive,
        ..base
    }
}

/// Iterations over which a gathering swarm must agree,
const AGREED_FOR: usize = 10;
/// and the share of the cost within which half of it must lie. Least squares goes on from there.
const AGREED_WITHIN: f64 = 1e-3;

/// Whether a gathering swarm with this history has nothing left to find that least squares does not: half of its candidates cost the
/// same but for a thousandth, and none is lost. Where the log can be driven exactly, the costs fall together and this never is.
fn agrees(history: &[HistoryRow]) -> bool {
    let last = history.len().saturating_sub(AGREED_FOR);
    let agree = |row: &HistoryRow| {
        let costs = row.median.zip(row.best.first());
        row.failed == 0 && costs.is_some_and(|(median, best)| median - best <= AGREED_WITHIN * best)
    };
    history.len() >= AGREED_FOR && history[last..].iter().all(agree)
}

impl SearchState {
    /// Records an iteration; counts continue from the stage before.
    fn note(&mut self, progress: &Progress) {
        let last = self.history.last();
        let (iteration, evaluations) = last.map_or((0, 0), |r| (r.iteration, r.evaluations));
        let done = if progress.iteration <= 1 {
            progress.evaluations
        } else {
            progress.evaluations / progress.iteration as u64
        };
        let best = match last {
            // A stage starts from the best of the one before.
            Some(row) => row
                .best
                .iter()
                .zip(&progress.best)
                .map(|(a, b)| a.min(*b))
                .collect(),
            None => progress.best.clone(),
        };
        self.history.push(HistoryRow {
            iteration: iteration + 1,
            evaluations: evaluations + done,
            best,
            median: progress.median,
            failed: progress.failed,
            elapsed_s: self.elapsed_s,
        });
        add_failures(&mut self.failures, &progress.failures);
    }
}

/// The front that a swarm has come to.
fn front_of(swarm: &FrontSwarm) -> Option<Front> {
    let front = swarm.front();
    Some(Front {
        chosen: nearest_to_ideal(&front.objectives)?,
        candidates: front.candidates,
        objectives: front.objectives,
        reached: swarm.reached().to_vec(),
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
        let driven = trace(&flat, replay.tyre_model(), &replay.plan, window);
        lost_windows += usize::from(!driven.drives);
        for (i, output) in driven.outputs.iter().enumerate() {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn row(best: f64, median: Option<f64>, failed: usize) -> HistoryRow {
        HistoryRow {
            iteration: 1,
            evaluations: 64,
            best: vec![best],
            median,
            failed,
            elapsed_s: 0.0,
        }
    }

    #[test]
    fn a_swarm_agrees_once_its_costs_are_the_same() {
        let mut history = vec![row(0.3, Some(0.9), 2)];
        history.extend((0..AGREED_FOR).map(|_| row(0.2, Some(0.2001), 0)));
        assert!(agrees(&history));
        assert!(!agrees(&history[..AGREED_FOR]));
        for other in [
            row(0.2, Some(0.21), 0),
            row(0.2, Some(0.2001), 1),
            row(0.2, None, 0),
        ] {
            history.push(other);
            assert!(!agrees(&history));
            history.pop();
        }
        // Costs that fall together towards an exact fit.
        let falling: Vec<HistoryRow> = (0..50)
            .map(|i| 0.5f64.powi(i))
            .map(|x| row(x, Some(1.5 * x), 0))
            .collect();
        assert!(!agrees(&falling));
    }
}
