//! The work of the study: a swarm for each objective beside the solvers of reference optima, then the front.

use super::front::{FrontState, search_front_from};
use super::objective_search::search_objective;
use super::solver_thread::watched;
use super::state::{FinishedObjective, Running, inputs_of};
use super::{
    FoundLine, LineFront, LinesState, ObjectiveOutcome, Outcome, RacelineSettings, ReferenceSolvers,
    ReportedLine, Setup, line_name,
};
use crate::error::Result;
use crate::evaluate::add_failures;
use crate::evaluate::line::{LineObjective, LineProblem, open_line_evaluator};
use crate::line::Parametrisation;
use crate::study::framework::state_file::Origin;
use crate::study::framework::{Progress, RunRecord, Watch, Work};
use crate::swarm;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

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

/// Runs the study, from the state of one of the same settings that was interrupted if there is one.
///
/// # Errors
/// Those of the evaluators and the solvers; [`crate::Error::Input`] if the state belongs to other inputs or another backend;
/// [`crate::Error::Io`] if the state cannot be saved when the study is interrupted.
pub(super) fn find_lines(
    settings: &RacelineSettings,
    setup: &Setup,
    work: Work<'_, LinesState>,
) -> Result<Outcome> {
    let watch = Watch::begin();
    // A small problem of the same kind says what evaluates.
    let probe = LineProblem::new(
        setup.cuts.clone(),
        Parametrisation::sections(),
        &settings.objectives,
        Some(setup.car.clone()),
        settings.entry_mps,
    )?;
    let backend = open_line_evaluator(&probe, settings.backend, settings.adapter.as_deref())?.backend();
    let mut record = RunRecord::of(&backend);
    let origin = Origin::new(inputs_of(setup), &backend);
    let Work {
        state_file, observe, ..
    } = work;
    let state = match work.state {
        Some(state) => {
            state_file.check(&state.origin, &origin)?;
            state
        }
        None => LinesState {
            settings: settings.clone(),
            origin,
            elapsed_s: 0.0,
            finished: Vec::new(),
            steps: Vec::new(),
            search: None,
            whole_lines: None,
            front: None,
        },
    };
    state_file.save(&state)?;
    let before_s = state.elapsed_s;
    let mut work = Running {
        state,
        state_file,
        observe,
        interrupted: false,
    };

    let reference = setup.report("reference", &setup.cuts.reference, settings)?;
    let stop = Arc::new(AtomicBool::new(false));
    let solvers = ReferenceSolvers::stopped_by(setup, settings, Arc::clone(&stop))?;
    let began = Instant::now();
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
            let (exact, own_s) = watched(exact, &stop, || work.asked("reference optimum"))?;
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
                        state.whole_lines = None;
                        state.elapsed_s = elapsed_s;
                    });
                    (found, best)
                }
            };
            evaluations += found.evaluations;
            record.device_faults.extend_from_slice(&found.device_faults);
            add_failures(&mut record.failures, &found.failures);
            if let Some(latest) = &found.backend {
                record.moved_to(latest);
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
        let tell = |progress: &swarm::Progress, at: &FrontState| {
            let best: Vec<String> = progress.best.iter().map(|b| format!("{b:.4}")).collect();
            let told = Progress::reached("front", progress.evaluations, format!("best {}", best.join(" ")));
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
            &record.device_faults,
            tell,
        )?;
        evaluations += found.evaluations;
        record.device_faults.extend_from_slice(&found.device_faults);
        add_failures(&mut record.failures, &found.failures);
        if let Some(latest) = &found.backend {
            record.moved_to(latest);
        }
        if let Some(nearest) = nearest_to_ideal(&found) {
            compromise = Some(setup.report("compromise", &found.alpha[nearest], settings)?);
        }
        front = Some(found);
    }
    let search_s = before_s + began.elapsed().as_secs_f64() - waited_s;
    record.took(evaluations, search_s + waited_s, search_s);
    record.longest_dispatch_ms = watch.longest_dispatch_ms();
    record.interrupted = work.interrupted;
    Ok(Outcome {
        objectives,
        front,
        compromise,
        reference,
        search_s,
        exact_s,
        history,
        record,
    })
}

/// What the local search makes of a line that was found.
fn led_downhill(
    settings: &RacelineSettings,
    objective: LineObjective,
    found: &[f64],
    solvers: &ReferenceSolvers,
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
