//! Swarms over `alpha` at every cross-section, to set beside the study's own search in windows.

use super::settings::{LineAlgorithm, RacelineSettings};
use super::setup::Setup;
use super::state::{LinesState, Running};
use super::window_search::{FoundLine, LevelRow};
use crate::error::{Error, Result};
use crate::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem, open_line_evaluator};
use crate::evaluate::{DeviceFaults, Evaluator, Losses};
use crate::line::Parametrisation;
use crate::study::framework::Progress;
use crate::swarm::{CooperativeSettings, CooperativeSwarm, Optimiser, Pso, PsoSettings, step};
use serde::{Deserialize, Serialize};

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
    losses: Losses,
}

impl WholeLineState {
    fn new(settings: &RacelineSettings, problem: &LineProblem) -> Result<Self> {
        let sized = |motion: PsoSettings, turns: usize| {
            settings.coefficients().apply(PsoSettings {
                population: settings.population,
                iterations: settings.iterations.saturating_mul(turns),
                seed: settings.seed,
                ..motion
            })
        };
        let swarm = if settings.algorithm == LineAlgorithm::Cooperative {
            // The groups take turns, and each has the iterations that are asked for.
            let groups = settings.groups.min(problem.dimensions());
            let motion = sized(CooperativeSettings::default().motion, groups);
            let settings = CooperativeSettings { motion, groups };
            WholeLineSwarm::Cooperative(Box::new(CooperativeSwarm::new(&problem.problem, settings)?))
        } else {
            let motion = sized(PsoSettings::thesis_lines(), 1);
            WholeLineSwarm::Thesis(Box::new(Pso::new(&problem.problem, motion)?))
        };
        Ok(Self {
            swarm,
            history: Vec::new(),
            losses: Losses::default(),
        })
    }
}

impl WholeLineSwarm {
    fn swarm(&mut self) -> &mut dyn Optimiser {
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
    let problem = setup.problem(Parametrisation::sections(), &[objective], settings)?;
    let mut evaluator = open_line_evaluator(&problem, settings.backend, settings.adapter.as_deref())?;
    let mut state = match work.state.whole_lines.take() {
        Some(state) => *state,
        None => WholeLineState::new(settings, &problem)?,
    };
    let mut faults = DeviceFaults::beyond(&work.state.device_faults(), evaluator.as_ref());
    while !state.swarm.swarm().done() {
        let progress = step(state.swarm.swarm(), evaluator.as_mut())?;
        let losses = &mut state.losses;
        losses.note(&progress.failures, &mut faults, evaluator.as_ref());
        state.history.push(LevelRow {
            controls: problem.dimensions(),
            sections: setup.cross_sections.len(),
            evaluations: progress.evaluations,
            best: progress.best[0],
            elapsed_s: work.elapsed_s(),
        });
        let best = format!("best {:.4} {}", progress.best[0], objective.unit());
        let told = Progress::reached(objective.line_name(), progress.evaluations, best);
        let update = |kept: &mut LinesState| kept.whole_lines = Some(Box::new(state.clone()));
        if work.told(&told, update)?.is_break() {
            break;
        }
    }
    let swarm = state.swarm.swarm();
    let front = swarm.front();
    let Some(best) = front.candidates.first() else {
        return Err(Error::Study(
            "none of the lines that were tried could be evaluated".to_owned(),
        ));
    };
    Ok(FoundLine {
        alpha: problem.alpha(best),
        cost: CpuLineEvaluator::new(&problem).evaluate(best)?.objectives[0],
        evaluations: swarm.evaluations(),
        history: state.history,
        losses: state.losses,
        backend: Some(evaluator.backend()),
    })
}
