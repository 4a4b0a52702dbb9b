//! Plain swarms over `alpha` at every cut, to set beside what the study does by itself.

use super::lines::Setup;
use super::search::{FoundLine, LevelRow};
use super::settings::{LineAlgorithm, RacelineSettings};
use super::state::Work;
use super::{StudyProgress, line_name};
use crate::error::Result;
use crate::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem, open_line_evaluator};
use crate::evaluate::{Evaluator, FailureCounts, add_failures};
use crate::line::Parametrisation;
use crate::swarm::{CooperativeSettings, CooperativeSwarm, Optimiser, Pso, PsoSettings, step};
use std::time::Instant;

/// The line that the settings' algorithm finds from a start at random.
pub(super) fn search_plainly(
    settings: &RacelineSettings,
    setup: &Setup,
    objective: LineObjective,
    work: &mut Work<'_>,
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
    let mut swarm: Box<dyn Optimiser> = match settings.algorithm {
        LineAlgorithm::Cooperative => {
            let usual = CooperativeSettings::default();
            let groups = settings.groups.min(setup.cuts.len());
            // The groups take turns, and each has the iterations that are asked for.
            let motion = PsoSettings {
                population: settings.population,
                iterations: settings.iterations.saturating_mul(groups),
                seed: settings.seed,
                ..usual.motion
            };
            Box::new(CooperativeSwarm::new(
                &problem.problem,
                CooperativeSettings { motion, groups },
            )?)
        }
        LineAlgorithm::Windows | LineAlgorithm::Thesis => {
            let motion = PsoSettings {
                population: settings.population,
                iterations: settings.iterations,
                seed: settings.seed,
                ..PsoSettings::thesis()
            };
            Box::new(Pso::new(&problem.problem, motion)?)
        }
    };
    let mut evaluator = open_line_evaluator(&problem, settings.backend, settings.adapter.as_deref())?;
    let mut failures = FailureCounts::new();
    let mut history = Vec::new();
    while !swarm.done() {
        let progress = step(swarm.as_mut(), evaluator.as_mut())?;
        add_failures(&mut failures, &progress.failures);
        history.push(LevelRow {
            controls: problem.dimensions(),
            sections: setup.cuts.len(),
            evaluations: progress.evaluations,
            best: progress.best[0],
            elapsed_s: before_s + began.elapsed().as_secs_f64(),
        });
        let told = StudyProgress {
            stage: line_name(objective).to_owned(),
            evaluations: progress.evaluations,
            best: format!("{:.4} {}", progress.best[0], objective.unit()),
        };
        // Nothing of such a search is kept: one that is broken off is done anew.
        if work.told(&told, |_| {})?.is_break() {
            break;
        }
    }
    let front = swarm.front();
    let alpha = problem.alpha(&front.candidates[0]);
    let cost = CpuLineEvaluator::new(&problem)
        .evaluate(&front.candidates[0])?
        .objectives[0];
    Ok(FoundLine {
        alpha,
        cost,
        evaluations: swarm.evaluations(),
        history,
        failures,
        device_faults: evaluator.device_faults().to_vec(),
    })
}
