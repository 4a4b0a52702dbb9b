//! The work of the study: a swarm for each objective beside the solvers of reference optima, then the front.

use super::front::search_front;
use super::objective_search::search_objective;
use super::setups::solve_setups;
use super::state::{FinishedObjective, Running, inputs_of};
use super::{ObjectiveOutcome, Outcome, Raceline, RacelineSettings, ReportedLine, Setup};
use crate::error::{Error, Result};
use crate::evaluate::line::{LineObjective, open_line_evaluator};
use crate::line::Parametrisation;
use crate::optimum::{DescentSettings, OptimumLine, ReferenceSolvers, interruptible};
use crate::study::framework::state_file::Origin;
use crate::study::framework::{Progress, RunRecord, Watch, Work};
use crate::swarm::Reached;
use crate::swarm::metrics::nearest_to_ideal;
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
pub(super) fn find_lines(work: Work<'_, Raceline>) -> Result<Outcome> {
    let watch = Watch::begin();
    let (settings, setup) = (work.settings, work.prepared);
    // A small problem of the same kind says what evaluates.
    let probe = setup.problem(Parametrisation::sections(), &settings.objectives, settings)?;
    let backend = open_line_evaluator(&probe, settings.backend, settings.adapter.as_deref())?.backend();
    let mut record = RunRecord::of(&backend);
    let mut work = Running::begin(Origin::new(inputs_of(setup), &backend), work)?;
    let reference = setup.report("reference", &setup.cross_sections.reference, settings)?;
    let stop = Arc::new(AtomicBool::new(false));
    let solvers = setup.solvers(settings, &stop)?;
    work.began = Instant::now();
    let mut evaluations = 0;
    let mut objectives = Vec::new();
    let mut exact_s = 0.0f64;
    // The fastest line takes its solver seconds on one core: the swarms of the objectives before it need not wait.
    std::thread::scope(|scope| -> Result<()> {
        // An error ends the solvers as well, which the scope waits for.
        let mut stopping = Stopping {
            flag: &stop,
            done: false,
        };
        let solvers = &solvers;
        let solve = move |objective: LineObjective| -> Result<(Option<OptimumLine>, f64)> {
            let began = Instant::now();
            let solved = solvers.best(objective)?;
            Ok((solved, began.elapsed().as_secs_f64()))
        };
        let each = settings.objectives.iter();
        let exact: Vec<_> = each.map(|o| scope.spawn(move || solve(*o))).collect();
        for (k, (&objective, exact)) in settings.objectives.iter().zip(exact).enumerate() {
            let report = |alpha: &[f64]| setup.report(objective.line_name(), alpha, settings);
            let (exact, own_s) =
                work.waited(|work| interruptible(exact, &stop, || work.asked("reference optimum")))?;
            exact_s = own_s.max(exact_s);
            let start = exact.as_ref().filter(|_| settings.starts_warm());
            let start = start.map(|o| o.alpha.as_slice());
            let finished = match work.state.finished.get(k) {
                Some(finished) => finished.clone(),
                None => {
                    let found = search_objective(settings, setup, objective, start, &mut work)?;
                    // A search that goes from coarse to fine may lose a little of the line that it started from. That is a local
                    // optimum, so nothing is left to find downhill of it.
                    let mut best = report(&found.alpha)?;
                    let start = start.map(&report).transpose()?;
                    match start {
                        Some(start) if start.betters(&best, objective) => best = start,
                        Some(start) if !is_far_better(&best, &start, objective) => {}
                        _ => {
                            let led = scope.spawn({
                                let (found, interrupted) = (found.alpha.clone(), work.interrupted);
                                move || led_downhill(settings, objective, &found, solvers, interrupted)
                            });
                            for rival in interruptible(led, &stop, || work.asked("local search"))? {
                                let rival = report(&rival)?;
                                if rival.betters(&best, objective) {
                                    best = rival;
                                }
                            }
                        }
                    }
                    if !best.clearance.is_on_road() && !work.interrupted {
                        let on_road = setup.report_given_way(&best, settings)?;
                        best = on_road.ok_or_else(|| off_road(setup, &best))?;
                    }
                    let finished = FinishedObjective {
                        found,
                        best: best.alpha,
                        gave_way: best.gave_way,
                    };
                    work.finished(|state| {
                        state.finished.push(finished.clone());
                        state.steps.clear();
                        state.search = None;
                        state.whole_lines = None;
                    });
                    finished
                }
            };
            let found = &finished.found;
            evaluations += found.evaluations;
            record.add(&found.losses, found.backend.as_ref());
            let history = found.history.iter();
            let mut best = report(&finished.best)?;
            // A line that has given way is on the road, and says no more that it was not.
            best.gave_way = best.gave_way.or(finished.gave_way);
            objectives.push(ObjectiveOutcome {
                objective,
                best,
                swarm_cost: found.cost,
                exact: exact.as_ref().map(|o| report(&o.alpha)).transpose()?,
                exact_left: exact.as_ref().map(|o| o.left),
                exact_status: exact.map(|o| o.status.to_string()),
                history: history
                    .map(|row| Reached::best(row.evaluations, row.elapsed_s, row.best))
                    .collect(),
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
        let begun = (
            work.state.front.take().map(|state| *state),
            &record.device_faults[..],
        );
        let found = search_front(setup, settings, &solvers, &known, begun, |progress, now| {
            let best: Vec<String> = progress.best.iter().map(|b| format!("{b:.4}")).collect();
            let told = Progress::reached("front", progress.evaluations, format!("best {}", best.join(" ")));
            work.told(&told, |state| state.front = Some(Box::new(now())))
        })?;
        evaluations += found.evaluations;
        record.add(&found.losses, found.backend.as_ref());
        if let Some(nearest) = nearest_to_ideal(&found.objectives) {
            compromise = Some(setup.report("compromise", &found.alpha[nearest], settings)?);
        }
        front = Some(found);
    }
    let search_s = work.elapsed_s();
    let mut setups = None;
    if settings.setups.is_some() && !work.interrupted {
        let fastest = objectives.iter().find(|o| o.objective == LineObjective::LapTime);
        let first = &fastest.map_or(&reference, |o| &o.best);
        setups = Some(solve_setups(
            (settings, setup),
            &solvers,
            first,
            &stop,
            &mut work,
        )?);
    }
    record.took(evaluations, search_s + work.waited_s, search_s);
    record.longest_dispatch_ms = watch.longest_dispatch_ms();
    record.interrupted = work.interrupted;
    Ok(Outcome {
        objectives,
        front,
        compromise,
        setups,
        reference,
        search_s,
        exact_s,
        record,
    })
}

/// Share of an objective by which a swarm's line has to better the reference optimum that it started from. Less is what is left of
/// the optimum's own accuracy, and the line is not led downhill again.
const FAR_BETTER: f64 = 1e-4;

fn is_far_better(line: &ReportedLine, start: &ReportedLine, objective: LineObjective) -> bool {
    let gain = start.worth(objective) - line.worth(objective);
    !start.clearance.is_on_road() || gain > FAR_BETTER * start.worth(objective).abs()
}

/// A best line that leaves the road is none.
fn off_road(setup: &Setup, line: &ReportedLine) -> Error {
    Error::Study(format!(
        "the {} line leaves the road: the car is {:.2} m beyond {}, and no line near it is on the road between the {} \
         cross-sections: ask for more with --sections, or for a narrower car",
        line.name,
        -line.clearance.margin_m,
        line.clearance.place(),
        setup.cross_sections.len()
    ))
}

/// What the local search makes of a line that was found.
fn led_downhill(
    settings: &RacelineSettings,
    objective: LineObjective,
    found: &[f64],
    solvers: &ReferenceSolvers,
    interrupted: bool,
) -> Result<Vec<Vec<f64>>> {
    if !settings.searches_locally() || !solvers.solves(objective) || interrupted {
        return Ok(Vec::new());
    }
    if objective == LineObjective::LapTime
        && let Some(led) = solvers.fastest_about(found)?
    {
        return Ok(vec![led.x]);
    }
    solvers.polish(
        vec![(found.to_vec(), vec![(objective, 1.0)])],
        &DescentSettings::USUAL,
    )
}
