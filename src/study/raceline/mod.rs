//! The racing line: shortest, least curved, fastest, and the front between them, beside the exact optima.
//!
//! Every objective has a swarm of its own ([`search_line`]), all together have one that looks for their front
//! ([`search_front`]), and the exact solvers ([`ExactSolvers`]) say how far from the optimum each is. Whatever is reported
//! is worked out anew on a fine spline and checked against the edges ([`Setup::report`]).

mod exact;
mod fast;
mod front;
mod lines;
mod plain;
mod results;
mod search;
mod settings;
mod state;
mod watched;

pub use exact::{ExactLine, ExactSolvers, WeightedLine};
pub use front::{LineFront, front_problem, search_front, starting_lines};
pub use lines::{FINE_M, ReportedLine, Setup, set_up};
pub use results::{LineFigures, Summary, summarise, write_results, write_settings};
pub use search::{
    FoundLine, LevelRow, LineProgress, LineSearch, LineSearchSettings, LineState, search_line,
    search_line_from,
};
pub use settings::{LineAlgorithm, OBJECTIVE_NAMES, RacelineSettings};
pub use state::LinesState;

use crate::error::Result;
use crate::evaluate::gpu::DispatchWatch;
use crate::evaluate::line::{LineObjective, LineProblem, open_line_evaluator};
use crate::evaluate::{BackendInfo, FailureCounts, add_failures};
use crate::line::Parametrisation;
use crate::study::keeper::{Keeper, Origin};
use crate::swarm::Progress;
use fast::search_objective;
use front::{FrontState, search_front_from};
use state::{FinishedObjective, Work, inputs_of};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use watched::watched;

/// What one objective came to.
#[derive(Clone, Debug)]
pub struct ObjectiveOutcome {
    /// The objective.
    pub objective: LineObjective,
    /// The best of the swarm's line, what the local search made of it and, with a warm start, the exact line that the
    /// swarm started from.
    pub best: ReportedLine,
    /// What the swarm alone reached through the cuts, in the objective's unit.
    pub swarm_cost: f64,
    /// The exact solver's line, where there is one.
    pub exact: Option<ReportedLine>,
    /// How the exact solver ended, and the time that it took (s).
    pub exact_status: Option<(String, f64)>,
}

/// The outcome of a study.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// One for each objective.
    pub objectives: Vec<ObjectiveOutcome>,
    /// The front between them, where there are several.
    pub front: Option<LineFront>,
    /// The compromise nearest to the ideal, each objective as a share of its range.
    pub compromise: Option<ReportedLine>,
    /// The reference line.
    pub reference: ReportedLine,
    /// What evaluated in the end.
    pub backend: BackendInfo,
    /// Lines that failed, by reason.
    pub failures: FailureCounts,
    /// What went wrong with devices and was got over.
    pub device_faults: Vec<String>,
    /// The longest that a dispatch kept the device (ms); nothing where none was at work.
    pub longest_dispatch_ms: Option<f64>,
    /// Lines evaluated by the swarms.
    pub evaluations: u64,
    /// Time of the swarms and the local search (s).
    pub search_s: f64,
    /// Time in which the swarms waited for the exact solvers (s).
    pub waited_s: f64,
    /// Time of the longest of the exact solvers (s), which work beside each other and beside the swarms.
    pub exact_s: f64,
    /// Best cost against evaluations of each objective's swarm.
    pub history: Vec<Vec<(u64, f64)>>,
    /// Whether the observer broke the study off.
    pub interrupted: bool,
}

/// What an observer is told.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyProgress {
    /// The objective, or the front.
    pub stage: String,
    /// Lines evaluated in this stage.
    pub evaluations: u64,
    /// The best so far, as text.
    pub best: String,
}

/// Name of the line that is best by an objective.
fn line_name(objective: LineObjective) -> &'static str {
    match objective {
        LineObjective::Length => "shortest",
        LineObjective::LengthSquared => "least squared length",
        LineObjective::Gamma => "least second difference",
        LineObjective::Kappa2 => "least curved",
        LineObjective::LapTime => "fastest",
    }
}

/// Raises a flag when it goes before the work is done.
struct Stopping<'a> {
    flag: &'a AtomicBool,
    done: bool,
}

impl Drop for Stopping<'_> {
    fn drop(&mut self) {
        self.flag.fetch_or(!self.done, Ordering::Relaxed);
    }
}

/// Runs a study.
///
/// # Errors
/// Those of the evaluators and the solvers.
pub fn find_lines(
    settings: &RacelineSettings,
    setup: &Setup,
    observe: impl FnMut(&StudyProgress) -> ControlFlow<()>,
) -> Result<Outcome> {
    find_lines_from(settings, setup, None, &mut Keeper::idle(), observe)
}

/// As [`find_lines`], from the state of a study of the same settings that was broken off, if one is given, and with the
/// state handed to `keeper` while it works.
///
/// # Errors
/// As [`find_lines`]; [`crate::Error::Input`] if the state belongs to other inputs or another backend;
/// [`crate::Error::Io`] if the state cannot be saved when the study is broken off.
pub fn find_lines_from(
    settings: &RacelineSettings,
    setup: &Setup,
    state: Option<LinesState>,
    keeper: &mut Keeper,
    mut observe: impl FnMut(&StudyProgress) -> ControlFlow<()>,
) -> Result<Outcome> {
    let dispatches = DispatchWatch::begin();
    // A small problem of the same kind says what it is that evaluates.
    let probe = LineProblem::new(
        setup.cuts.clone(),
        Parametrisation::sections(),
        &settings.objectives,
        Some(setup.car.clone()),
        settings.entry_mps,
    )?;
    let mut backend = open_line_evaluator(&probe, settings.backend, settings.adapter.as_deref())?.backend();
    let origin = Origin::new(inputs_of(setup), &backend);
    let state = match state {
        Some(state) => {
            keeper.check(&state.origin, &origin)?;
            state
        }
        None => LinesState {
            settings: settings.clone(),
            origin,
            elapsed_s: 0.0,
            finished: Vec::new(),
            steps: Vec::new(),
            search: None,
            plain: None,
            front: None,
        },
    };
    keeper.keep(&state)?;
    let before_s = state.elapsed_s;
    let mut work = Work {
        state,
        keeper,
        observe: &mut observe,
        interrupted: false,
    };

    let reference = setup.report("reference", &setup.cuts.reference, settings)?;
    let stop = Arc::new(AtomicBool::new(false));
    let solvers = ExactSolvers::stopped_by(setup, settings, Arc::clone(&stop))?;
    let began = Instant::now();
    let mut device_faults = Vec::new();
    let mut failures = FailureCounts::new();
    let mut evaluations = 0;
    let mut history = Vec::new();
    let mut objectives = Vec::new();
    let (mut waited_s, mut exact_s) = (0.0, 0.0f64);
    // The fastest line takes its solver seconds on one core: the swarms of the objectives before it need not wait.
    std::thread::scope(|scope| -> Result<()> {
        // An error ends the solvers as well, which the scope waits for.
        let mut stopping = Stopping {
            flag: &stop,
            done: false,
        };
        let exact: Vec<_> = settings
            .objectives
            .iter()
            .map(|objective| {
                let solvers = &solvers;
                scope.spawn(move || {
                    let began = Instant::now();
                    let solved = solvers.reference(*objective)?;
                    Ok((solved, began.elapsed().as_secs_f64()))
                })
            })
            .collect();
        for (k, (objective, exact)) in settings.objectives.iter().zip(exact).enumerate() {
            let waiting = Instant::now();
            let (exact, own_s) = watched(exact, &stop, || work.asked("exact"))?;
            waited_s += waiting.elapsed().as_secs_f64();
            exact_s = own_s.max(exact_s);
            let start = exact
                .as_ref()
                .filter(|_| settings.warm_start)
                .map(|o| o.alpha.as_slice());
            let (found, best) = match work.state.finished.get(k) {
                Some(finished) => (
                    finished.found.clone(),
                    setup.report(line_name(*objective), &finished.best, settings)?,
                ),
                None => {
                    let found = search_objective(settings, setup, *objective, start, &mut work)?;
                    let led = scope.spawn({
                        let (solvers, found, interrupted) = (&solvers, found.alpha.clone(), work.interrupted);
                        move || led_downhill(settings, *objective, &found, solvers, interrupted)
                    });
                    let led = watched(led, &stop, || work.asked("local search"))?;
                    let rivals: Vec<_> = start.map(<[f64]>::to_vec).into_iter().chain(led).collect();
                    let best = best_line(settings, setup, *objective, &found, &rivals)?;
                    let elapsed_s = before_s + began.elapsed().as_secs_f64() - waited_s;
                    work.finished(|state| {
                        state.finished.push(FinishedObjective {
                            found: found.clone(),
                            best: best.alpha.clone(),
                        });
                        state.steps.clear();
                        state.search = None;
                        state.plain = None;
                        state.elapsed_s = elapsed_s;
                    });
                    (found, best)
                }
            };
            evaluations += found.evaluations;
            device_faults.extend_from_slice(&found.device_faults);
            add_failures(&mut failures, &found.failures);
            if let Some(latest) = found.backend {
                backend = latest;
            }
            history.push(
                found
                    .history
                    .iter()
                    .map(|row| (row.evaluations, row.best))
                    .collect(),
            );
            let exact_line = exact
                .as_ref()
                .map(|o| setup.report(line_name(*objective), &o.alpha, settings))
                .transpose()?;
            objectives.push(ObjectiveOutcome {
                objective: *objective,
                best,
                swarm_cost: found.cost,
                exact: exact_line,
                exact_status: exact.as_ref().map(|o| (format!("{:?}", o.status), o.seconds)),
            });
            if work.interrupted {
                // Nor are the solvers still at work waited for.
                stop.store(true, Ordering::Relaxed);
                break;
            }
        }
        stopping.done = true;
        Ok(())
    })?;

    let mut front = None;
    let mut compromise = None;
    if settings.objectives.len() > 1 && !work.interrupted {
        let known: Vec<Vec<f64>> = objectives.iter().map(|o| o.best.alpha.clone()).collect();
        let front_state = work.state.front.take().map(|state| *state);
        let watch = |progress: &Progress, at: &FrontState| {
            let best: Vec<String> = progress.best.iter().map(|b| format!("{b:.4}")).collect();
            let told = StudyProgress {
                stage: "front".to_owned(),
                evaluations: progress.evaluations,
                best: best.join(" "),
            };
            work.told(&told, |state| {
                state.front = Some(Box::new(at.clone()));
                state.elapsed_s = before_s + began.elapsed().as_secs_f64() - waited_s;
            })
        };
        let found = search_front_from(
            setup,
            settings,
            &solvers,
            &known,
            front_state,
            &device_faults,
            watch,
        )?;
        evaluations += found.evaluations;
        device_faults.extend_from_slice(&found.device_faults);
        add_failures(&mut failures, &found.failures);
        backend = found.backend.clone().unwrap_or(backend);
        if let Some(nearest) = nearest_to_ideal(&found) {
            compromise = Some(setup.report("compromise", &found.alpha[nearest], settings)?);
        }
        front = Some(found);
    }
    Ok(Outcome {
        objectives,
        front,
        compromise,
        reference,
        backend,
        device_faults,
        longest_dispatch_ms: dispatches.longest_ms(),
        failures,
        evaluations,
        search_s: before_s + began.elapsed().as_secs_f64() - waited_s,
        waited_s,
        exact_s,
        history,
        interrupted: work.interrupted,
    })
}

/// What the local search makes of a line that was found.
fn led_downhill(
    settings: &RacelineSettings,
    objective: LineObjective,
    found: &[f64],
    solvers: &ExactSolvers,
    interrupted: bool,
) -> Result<Vec<Vec<f64>>> {
    if !settings.local_search || !solvers.solves(objective) || interrupted {
        return Ok(Vec::new());
    }
    if objective == LineObjective::LapTime
        && let Some(led) = solvers.fastest_about(found)?
    {
        return Ok(vec![led.x]);
    }
    solvers.polish(vec![(found.to_vec(), vec![(objective, 1.0)])], 60)
}

/// The best of what was found and its rivals: the line that the search started from, of which one that goes from coarse to fine
/// may lose a little, and what the local search makes of it.
fn best_line(
    settings: &RacelineSettings,
    setup: &Setup,
    objective: LineObjective,
    found: &FoundLine,
    rivals: &[Vec<f64>],
) -> Result<ReportedLine> {
    let mut best = setup.report(line_name(objective), &found.alpha, settings)?;
    for alpha in rivals {
        let line = setup.report(line_name(objective), alpha, settings)?;
        if line.worth(objective) < best.worth(objective) {
            best = line;
        }
    }
    Ok(best)
}

/// The member of a front nearest to the ideal, each objective as a share of the front's range.
fn nearest_to_ideal(front: &LineFront) -> Option<usize> {
    let rows = &front.objectives;
    let distance = |row: &[f64]| -> f64 {
        (0..row.len())
            .map(|k| {
                let worst = rows.iter().map(|r| r[k]).fold(front.ideal[k], f64::max);
                let range = worst - front.ideal[k];
                if range > 0.0 {
                    ((row[k] - front.ideal[k]) / range).powi(2)
                } else {
                    0.0
                }
            })
            .sum()
    };
    (0..rows.len()).min_by(|&i, &j| distance(&rows[i]).total_cmp(&distance(&rows[j])))
}
