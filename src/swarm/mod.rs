//! Swarms and other population-based optimisers for one objective and for several, by ask and tell or in one run.
//!
//! | Objectives | Optimiser | |
//! |---|---|---|
//! | one | [`HybridSwarm`] | explores, then gathers; the default choice for an unknown problem |
//! | one | [`Pso`] | particle swarm, with or without difference moves |
//! | one | [`CovarianceSwarm`] | CMA: learns the shape of a valley, with or without restarts |
//! | one | [`DifferenceSwarm`] | differential evolution that adapts itself |
//! | one | [`CooperativeSwarm`] | CPSO-S_K: a swarm to each group of variables |
//! | more | [`Mopso`] | particle swarm with an archive: the default, SMPSO and the thesis's are settings of it |
//! | more | [`device::DeviceMopso`] | the same on a device, for problems that are evaluated there |
//! | more | [`Nsga2`] | the genetic algorithm that swarms are compared with |
//!
//! [`Islands`] are several swarms in one population, with or without migration. [`checkpoint`] keeps the state of any
//! optimiser in a file. [`comparison`] runs optimisers on [`problems`] with known answers and judges them by [`metrics`].
//!
//! Positions live in the unit cube and are scaled to the bounds when asked for, so results do not depend on where the
//! bounds lie. Random numbers are functions of seed, iteration, particle and purpose ([`crate::random`]), so
//! the same seed gives the same run with any number of threads.
//!
//! References, as the settings cite them:
//! 1. Kennedy, Eberhart, *Particle swarm optimization*, ICNN 1995.
//! 2. Shi, Eberhart, *A modified particle swarm optimizer*, CEC 1998 (inertia, linear schedules).
//! 3. Clerc, Kennedy, *The particle swarm: explosion, stability, and convergence*, IEEE TEC 6 (2002).
//! 4. Coello Coello, Pulido, Lechuga, *Handling multiple objectives with particle swarm optimization*, IEEE TEC 8
//!    (2004) (archive, mutation that shrinks over the run).
//! 5. Deb et al., *A fast and elitist multiobjective genetic algorithm: NSGA-II*, IEEE TEC 6 (2002) (crowding).
//! 6. Nebro et al., *SMPSO*, MCDM 2009 (speed limit, reversed velocity at a bound).
//! 7. Storn, Price, *Differential evolution*, J. Global Optimization 11 (1997) (difference moves).
//! 8. Beume, Naujoks, Emmerich, *SMS-EMOA*, European J. Operational Research 181 (2007) (truncation by contribution).
//! 9. Zitzler, Laumanns, Thiele, *SPEA2*, TIK report 103 (2001) (truncation by the nearest neighbours).

mod archive;
pub mod checkpoint;
pub mod comparison;
mod cooperative;
mod covariance;
pub mod device;
mod difference;
mod islands;
pub mod metrics;
mod mopso;
mod motion;
mod nsga2;
pub mod problems;
mod pso;
mod settings;
mod space;
mod two_phase;
mod windows;

pub use archive::Archive;
pub use cooperative::{CooperativeSettings, CooperativeSwarm};
pub use covariance::{Beyond, CovarianceSettings, CovarianceSwarm, Restarts};
pub use difference::{DifferenceSettings, DifferenceSwarm};
pub use islands::{Islands, Migration, Welcome};
pub use mopso::{Generation, MANY, Mopso};
pub use nsga2::{Nsga2, Nsga2Settings};
pub use pso::Pso;
pub use settings::{
    BoundHandling, Constriction, DRAWN_PULLS, Leaders, MopsoSettings, Mutation, PsoSettings, Randomness,
    Schedule, Truncation,
};
pub use two_phase::{HybridSettings, HybridSwarm};
pub use windows::{WindowSettings, WindowSwarm};

use crate::error::Result;
use crate::evaluate::{Evaluation, Evaluator, FailureCounts};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// What an optimiser has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Iterations told.
    pub iteration: usize,
    /// Candidates evaluated.
    pub evaluations: u64,
}

impl Counters {
    /// Counts an iteration of so many candidates.
    fn told(&mut self, candidates: usize) {
        self.iteration += 1;
        self.evaluations += candidates as u64;
    }
}

/// A population-based optimiser: asked for candidates, then told their objectives.
pub trait Optimiser {
    /// The candidates to evaluate next: row-major, values within the bounds.
    fn ask(&mut self) -> Vec<f64>;

    /// Takes the objectives of the candidates last asked for.
    fn tell(&mut self, evaluation: &Evaluation);

    /// Iterations told and candidates evaluated so far.
    fn counters(&self) -> Counters;

    /// Iterations told so far.
    fn iteration(&self) -> usize {
        self.counters().iteration
    }

    /// Iterations that the settings plan for.
    fn planned_iterations(&self) -> usize;

    /// Whether the planned iterations are done.
    fn done(&self) -> bool {
        self.iteration() >= self.planned_iterations()
    }

    /// Candidates evaluated so far.
    fn evaluations(&self) -> u64 {
        self.counters().evaluations
    }

    /// The least value seen of each objective.
    fn best(&self) -> Vec<f64>;

    /// The result so far: the archive, or the one best candidate with its cost.
    fn front(&self) -> Front;
}

/// Candidates, none of which another dominates, and their objectives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Front {
    /// Rows of variables, in their units.
    pub candidates: Vec<Vec<f64>>,
    /// Rows of objectives.
    pub objectives: Vec<Vec<f64>>,
}

impl Front {
    fn single(candidate: Vec<f64>, cost: f64) -> Self {
        Self {
            candidates: vec![candidate],
            objectives: vec![vec![cost]],
        }
    }
}

/// What an observer of a run sees after each iteration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Iterations done.
    pub iteration: usize,
    /// Candidates evaluated.
    pub evaluations: u64,
    /// The least value seen of each objective.
    pub best: Vec<f64>,
    /// The median of the first objective over this iteration's candidates that did not fail, if any did not.
    pub median: Option<f64>,
    /// Candidates of this iteration that failed.
    pub failed: usize,
    /// The same by reason.
    pub failures: FailureCounts,
}

/// Asks, evaluates and tells once.
///
/// # Errors
/// Those of the evaluator. The optimiser has then been asked, but not told.
pub fn step(optimiser: &mut dyn Optimiser, evaluator: &mut dyn Evaluator) -> Result<Progress> {
    let width = evaluator.problem().objectives.len();
    let population = optimiser.ask();
    let evaluation = evaluator.evaluate(&population)?;
    optimiser.tell(&evaluation);
    let rows = evaluation
        .objectives
        .chunks_exact(width)
        .zip(&evaluation.failures);
    let mut costs: Vec<f64> = rows.filter(|(_, f)| f.is_none()).map(|(row, _)| row[0]).collect();
    let middle = costs.len() / 2;
    Ok(Progress {
        iteration: optimiser.iteration(),
        evaluations: optimiser.evaluations(),
        best: optimiser.best(),
        median: (!costs.is_empty()).then(|| *costs.select_nth_unstable_by(middle, f64::total_cmp).1),
        failed: evaluation.failures.iter().filter(|f| f.is_some()).count(),
        failures: evaluation.failure_counts(),
    })
}

/// Asks, evaluates and tells until the planned iterations are done or `observe` returns `Break`.
///
/// # Errors
/// Those of the evaluator.
pub fn run(
    optimiser: &mut dyn Optimiser,
    evaluator: &mut dyn Evaluator,
    mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<()> {
    while !optimiser.done() {
        let progress = step(optimiser, evaluator)?;
        if observe(&progress).is_break() {
            break;
        }
    }
    Ok(())
}
