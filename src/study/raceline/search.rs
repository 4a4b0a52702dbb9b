//! One racing line for one objective, by swarms over ever more control points.

use crate::error::Result;
use crate::evaluate::BackendChoice;
use crate::evaluate::line::{LineObjective, LineProblem, open_line_evaluator};
use crate::line::{Parametrisation, PointMass};
use crate::swarm::{CovarianceSettings, CovarianceSwarm, run};
use crate::track::CrossSections;
use std::ops::ControlFlow;

/// Settings.
#[derive(Clone, Debug, PartialEq)]
pub struct LineSearchSettings {
    /// Seed.
    pub seed: u64,
}

impl Default for LineSearchSettings {
    fn default() -> Self {
        Self { seed: 1 }
    }
}

/// Progress.
#[derive(Clone, Debug, PartialEq)]
pub struct LineProgress {
    /// Evaluations.
    pub evaluations: u64,
    /// Best.
    pub best: f64,
}

/// Found.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundLine {
    /// Alpha.
    pub alpha: Vec<f64>,
    /// Cost.
    pub cost: f64,
    /// Evaluations.
    pub evaluations: u64,
    /// History.
    pub history: Vec<LineProgress>,
}

/// Searches.
#[allow(clippy::too_many_arguments)]
pub fn search_line(
    cuts: &CrossSections,
    objective: LineObjective,
    car: Option<&PointMass>,
    entry_mps: f64,
    start: Option<&[f64]>,
    backend: BackendChoice,
    adapter: Option<&str>,
    settings: &LineSearchSettings,
    mut observe: impl FnMut(&LineProgress) -> ControlFlow<()>,
) -> Result<FoundLine> {
    let mut alpha = start.map_or_else(|| cuts.reference.clone(), <[f64]>::to_vec);
    let mut history = Vec::new();
    let mut evaluations = 0;
    let mut cost = f64::INFINITY;
    for (controls, iterations, spread) in [(24, 100, 0.2), (48, 200, 0.05), (96, 300, 0.02)] {
        let way = Parametrisation::control_points(controls.min(cuts.len()));
        let line = LineProblem::new(cuts.clone(), way, &[objective], car.cloned(), entry_mps)?;
        let mut evaluator = open_line_evaluator(&line, backend, adapter)?;
        let covariance = CovarianceSettings {
            population: 64,
            iterations,
            seed: settings.seed,
            spread,
            active: true,
            ..CovarianceSettings::default()
        };
        let mut swarm = CovarianceSwarm::new(&line.problem, &line.candidate(&alpha)?, covariance)?;
        run(&mut swarm, evaluator.as_mut(), |p| {
            let row = LineProgress {
                evaluations: evaluations + p.evaluations,
                best: p.best[0],
            };
            history.push(row.clone());
            observe(&row)
        })?;
        let (best, value) = swarm.best_candidate();
        if value < cost {
            cost = value;
            alpha = line.alpha(&best);
        }
        evaluations += crate::swarm::Optimiser::evaluations(&swarm);
    }
    Ok(FoundLine {
        alpha,
        cost,
        evaluations,
        history,
    })
}
