//! Identification: which car drove this lap?

mod choose;
mod descent;
mod hops;
mod identifiability;
mod notes;
mod page;
mod polish;
mod pool;
mod refine;
mod resident;
mod results;
mod search;
mod settings;
mod setup;
mod stand_in;
mod state;
mod verdict;

pub use choose::{Choice, Tried};
pub use identifiability::{Group, Identifiability, judge};
pub use polish::{Polished, polish};
pub use results::Summary;
pub use search::{Judged, Outcome, judge_candidate, search_with, total_parameter_error};
pub use settings::{Algorithm, FreeParameter, IdentifySettings, ModelChoice, ObjectiveChoice, Unknowns};
pub(in crate::study) use setup::set_up_until;
pub use setup::{Setup, cost_unit, lap_format, set_up};
pub(in crate::study) use setup::{planned, subject, without_laps};
pub use state::{Front, HistoryRow, SearchState};
pub use verdict::{Untold, Verdict};

use crate::config::settings::Settings;
use crate::error::Result;
use crate::evaluate::replay::{CHANNEL_LABELS, open_evaluator};
use crate::evaluate::{PackedClient, run_packed};
use crate::study::framework::memory::{MemoryItem, Size};
use crate::study::framework::state_file::StateFile;
use crate::study::framework::{
    Figures, Plan, Progress, RunRecord, Searched, Solved, Study, Subject, Work, resumed_or_new,
};
use crate::swarm::{Reached, SwarmPlace};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The study.
pub struct Identify;

/// A swarm of more particles than this fills a device by itself.
const SMALL: usize = 4096;

impl Study for Identify {
    const NAME: &'static str = "identify";
    const ABOUT: &'static str =
        "Find a car's unknown parameters from a logged lap; with no argument, on the bundled lap.";
    const DETAILS: &'static str = "Examples:\n  lapswarm identify\n  lapswarm identify study.toml --seed 7 --json\n  lapswarm \
        identify --log lap.csv --car start.toml --laps 1,2 --holdout 3\n  lapswarm identify --log lap.csv --free-from \
        runs/sensitivity-001 --most 12";
    type Settings = IdentifySettings;
    type State = SearchState;
    type Prepared = Setup;
    type Outcome = Outcome;
    type Summary = Summary;

    fn prepare(settings: &IdentifySettings) -> Result<Setup> {
        Self::prepare_until(settings, &AtomicBool::new(false))
    }

    fn prepare_until(settings: &IdentifySettings, stop: &AtomicBool) -> Result<Setup> {
        let setup = set_up_until(settings, stop)?;
        search::check_swarms(settings, &setup)?;
        Ok(setup)
    }

    fn size(settings: &IdentifySettings, prepared: Option<&Setup>) -> Vec<MemoryItem> {
        let samples = prepared.map_or(0, |setup| setup.log.samples());
        let size = settings.size();
        Size { samples, ..size }.memory_items()
    }

    fn plan(settings: &IdentifySettings, setup: &Setup, plan: Plan) -> Result<Plan> {
        let polish = refine::most_drives(settings);
        let plan = plan.evaluations(settings.evaluations()).polish_drives(polish);
        planned(settings, setup, plan)
    }

    fn solve(work: Work<'_, Self>) -> Result<Option<Outcome>> {
        let (settings, setup) = (work.settings, work.prepared);
        let mut evaluator = open_evaluator(&setup.replay, settings.backend, settings.adapter.as_deref())?;
        let begun = (work.state, work.state_file);
        search_with(settings, setup, evaluator.as_mut(), begun, work.observe).map(Some)
    }

    /// Eight swarms of fifty particles fill the lanes of a small device.
    fn together(settings: &IdentifySettings) -> usize {
        let on_host = settings.place != SwarmPlace::Device;
        if on_host && settings.size().population <= SMALL {
            8
        } else {
            1
        }
    }

    /// The swarms share an evaluator, and its calls.
    fn solve_together(
        studies: &[IdentifySettings],
        setup: &Setup,
        state_files: &mut [StateFile],
        observe: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
        stop: &Arc<AtomicBool>,
    ) -> Result<Vec<Result<Option<Outcome>>>> {
        let Some(first) = studies.first() else {
            return Ok(Vec::new());
        };
        let mut evaluator = open_evaluator(&setup.replay, first.backend, first.adapter.as_deref())?;
        let stopped = &**stop;
        let searches: Vec<_> = studies
            .iter()
            .zip(state_files)
            .map(|(settings, state_file)| {
                move |mut evaluator: PackedClient| -> Result<Option<Outcome>> {
                    let mut told = |_: &Progress| {
                        if stopped.load(Ordering::Relaxed) {
                            ControlFlow::Break(())
                        } else {
                            ControlFlow::Continue(())
                        }
                    };
                    resumed_or_new::<Self, _>(settings, state_file, true, |state, state_file| {
                        search_with(settings, setup, &mut evaluator, (state, state_file), &mut told)
                    })
                    .map(Some)
                }
            })
            .collect();
        Ok(run_packed(evaluator.as_mut(), searches, || {
            if observe(&Progress::default()).is_break() {
                stop.store(true, Ordering::Relaxed);
            }
        }))
    }

    fn record(outcome: &Outcome) -> &RunRecord {
        &outcome.record
    }

    fn record_mut(outcome: &mut Outcome) -> &mut RunRecord {
        &mut outcome.record
    }

    fn summarise(solved: &Solved<'_, Self>) -> Summary {
        results::summarise(solved.settings, solved.prepared, solved.outcome)
    }

    fn subject(settings: &IdentifySettings, setup: &Setup) -> Subject {
        subject(settings, setup)
    }

    fn report(folder: &Path, solved: &Solved<'_, Self>, summary: &Summary) -> Result<()> {
        let (setup, outcome) = (solved.prepared, solved.outcome);
        let mut car = setup.replay.free.candidate_car(&outcome.candidate);
        car.reached = Some(results::reached(&outcome.replay));
        car.write_with(folder, "car", &results::car_comment(&setup.log.source, summary))?;
        results::write_history(folder, outcome)?;
        results::write_parameters(folder, summary)?;
        if let Some(front) = &outcome.front {
            results::write_front(folder, setup, front)?;
        }
        let judged = judge_candidate(&outcome.replay, &outcome.candidate);
        results::write_traces(folder, setup, &judged)?;
        let tyres = results::Tyres::of(solved, &judged);
        tyres.write(folder, &setup.log)?;
        page::write(folder, solved, (&judged, &tyres), summary)
    }

    fn text(settings: &IdentifySettings, summary: &Summary) -> String {
        let calibration = &summary.calibration;
        let findings = calibration.findings.iter().map(|finding| format!("{finding}\n"));
        let notes = calibration.notes.iter().map(|note| format!("{note}\n"));
        findings.chain(notes).chain([summary.to_text(settings)]).collect()
    }

    fn check(path: &Path) -> Result<String> {
        let settings = IdentifySettings::read(path)?;
        let setup = set_up(&without_laps(&settings))?;
        Ok(format!(
            "{} free parameters",
            setup.replay.problem.variables.len()
        ))
    }

    fn figures(outcome: &Outcome, summary: &Summary) -> Figures {
        let best = outcome.history.last().and_then(|row| row.best.first().copied());
        let best = best.filter(|cost| cost.is_finite());
        let mut figures: Figures = [
            ("evaluations", Some(outcome.record.evaluations as f64)),
            ("best_cost", best),
            ("swarm_total_parameter_error", summary.swarm_total_parameter_error),
            ("total_parameter_error", summary.total_parameter_error),
        ]
        .map(|(name, figure)| (name.to_owned(), figure))
        .into();
        let costs = summary.costs.iter();
        figures.extend(costs.map(|(channel, cost)| (format!("cost_{channel}"), Some(*cost))));
        let errors = summary.rms_error.iter();
        for (channel, rms) in errors {
            figures.insert(format!("rms_error_{channel}"), Some(*rms));
            figures.insert(format!("mse_{channel}"), Some(rms * rms));
        }
        for parameter in &summary.parameters {
            let name = &parameter.name;
            figures.insert(format!("value_{name}"), Some(parameter.car_value));
            // A truth of zero has no relative error.
            if let Some(truth) = parameter.truth.filter(|truth| *truth != 0.0) {
                let error = parameter.car_value / truth - 1.0;
                figures.insert(format!("relative_error_{name}"), Some(error));
            }
        }
        figures
    }

    fn searched(solved: &Solved<'_, Self>) -> Searched {
        let outcome = solved.outcome;
        let objectives = solved
            .settings
            .objectives
            .iter()
            .map(|objective| match objective {
                ObjectiveChoice::All => "cost of all channels".to_owned(),
                ObjectiveChoice::Channel(k) => format!("cost of {}", CHANNEL_LABELS[*k]),
            });
        let (reached, front) = match &outcome.front {
            Some(front) => (front.reached.clone(), front.objectives.clone()),
            None => {
                let rows = outcome.history.iter();
                let best = |row: &HistoryRow| row.best.first().copied().unwrap_or(f64::NAN);
                let rows = rows.map(|row| Reached::best(row.evaluations, row.elapsed_s, best(row)));
                (rows.collect(), Vec::new())
            }
        };
        Searched {
            objectives: objectives.collect(),
            reached,
            front,
        }
    }
}
