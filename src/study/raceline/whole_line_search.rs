//! Swarms over `alpha` at every cross-section, to set beside the study's own search in windows.

use super::line_name;
use super::settings::{LineAlgorithm, RacelineSettings};
use super::setup::Setup;
use super::state::Running;
use super::window_search::{FoundLine, LevelRow};
use crate::error::{Error, Result};
use crate::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem, open_line_evaluator};
use crate::evaluate::{Evaluator, FailureCounts, add_failures};
use crate::line::Parametrisation;
use crate::study::framework::{DeviceFaults, Progress};
use crate::swarm::{CooperativeSettings, CooperativeSwarm, Optimiser, Pso, PsoSettings, step};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// A swarm of whole lines.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum WholeLineSwarm {
    Cooperative(Box<CooperativeSwarm>),
    Thesis(Box<Pso>),
}

/// Where such a search is: all that it takes to resume it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct WholeLineState {
    swarm: WholeLineSwarm,
    history: Vec<LevelRow>,
    failures: FailureCounts,
    device_faults: Vec<String>,
}

impl WholeLineState {
    fn new(settings: &RacelineSettings, problem: &LineProblem) -> Result<Self> {
        let swarm = match settings.algorithm {
            LineAlgorithm::Cooperative => {
                let usual = CooperativeSettings::default();
                let groups = settings.groups.min(problem.dimensions());
                // The groups take turns, and each has the iterations that are asked for.
                let motion = PsoSettings {
                    population: settings.population,
                    iterations: settings.iterations.saturating_mul(groups),
                    seed: settings.seed,
                    ..usual.motion
                };
                let settings = CooperativeSettings { motion, groups };
                WholeLineSwarm::Cooperative(Box::new(CooperativeSwarm::new(&problem.problem, settings)?))
            }
            LineAlgorithm::Windows | LineAlgorithm::Thesis => {
                let motion = PsoSettings {
                    population: settings.population,
                    iterations: settings.iterations,
                    seed: settings.seed,
                    ..PsoSettings::thesis()
                };
                WholeLineSwarm::Thesis(Box::new(Pso::new(&problem.problem, motion)?))
            }
        };
        Ok(Self {
            swarm,
            history: Vec::new(),
            failures: FailureCounts::new(),
            device_faults: Vec::new(),
        })
    }
}

impl WholeLineSwarm {
    fn swarm(&self) -> &dyn Optimiser {
        match self {
            Self::Cooperative(swarm) => swarm.as_ref(),
            Self::Thesis(swarm) => swarm.as_ref(),
        }
    }

    fn swarm_mut(&mut self) -> &mut dyn Optimiser {
        match self {
            Self::Cooperative(swarm) => swarm.as_mut(),
            Self::Thesis(swarm) => swarm.as_mut(),
        }
    }
}

/// The line that the settings' algorithm finds from a start at random.
pub(super) fn search_whole_lines(
    settings: &RacelineSettings,
    setup: &Setup,
    objective: LineObjective,
    work: &mut Running<'_>,
) -> Result<FoundLine> {
    let began = Instant::now();
    let before_s = work.state.elapsed_s;
    let problem = LineProblem::new(
        setup.cuts.clone(),
        Parametrisation::sections(),
        &[objective],
        Some(setup.car.clone()),
        settings.entry_mps,
    )?;
    let mut evaluator = open_line_evaluator(&problem, settings.backend, settings.adapter.as_deref())?;
    let mut state = match work.state.whole_lines.take() {
        Some(state) => *state,
        None => WholeLineState::new(settings, &problem)?,
    };
    let known = work.state.device_faults();
    let mut faults = DeviceFaults::of(evaluator.as_ref());
    while !state.swarm.swarm().done() {
        let progress = step(state.swarm.swarm_mut(), evaluator.as_mut())?;
        add_failures(&mut state.failures, &progress.failures);
        let told = [&known[..], &state.device_faults].concat();
        state
            .device_faults
            .extend(faults.since(evaluator.as_ref(), &told));
        let elapsed_s = before_s + began.elapsed().as_secs_f64();
        state.history.push(LevelRow {
            controls: problem.dimensions(),
            sections: setup.cuts.len(),
            evaluations: progress.evaluations,
            best: progress.best[0],
            elapsed_s,
        });
        let best = format!("best {:.4} {}", progress.best[0], objective.unit());
        let told = Progress::reached(line_name(objective), progress.evaluations, best);
        let flow = work.told(&told, |kept| {
            kept.whole_lines = Some(Box::new(state.clone()));
            kept.elapsed_s = elapsed_s;
        })?;
        if flow.is_break() {
            break;
        }
    }
    let WholeLineState {
        swarm,
        history,
        failures,
        device_faults,
    } = state;
    let swarm = swarm.swarm();
    let front = swarm.front();
    let Some(best) = front.candidates.first() else {
        return Err(Error::Study(
            "none of the lines that were tried could be evaluated".to_owned(),
        ));
    };
    let alpha = problem.alpha(best);
    let cost = CpuLineEvaluator::new(&problem).evaluate(best)?.objectives[0];
    Ok(FoundLine {
        alpha,
        cost,
        evaluations: swarm.evaluations(),
        history,
        failures,
        device_faults,
        backend: Some(evaluator.backend()),
    })
}
