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
//! | three and more | [`Nsga3`] | the genetic algorithm that spreads along given directions: for four objectives and more |
//! | three and more | [`Moead`] | a genetic algorithm that minimises along each of these directions, with its neighbours' help |
//!
//! [`minimise()`] runs one of them on a closure in one call, and [`by_name()`] makes one of its name. [`Islands`] are several
//! swarms in one population, with or without migration. [`checkpoint`] keeps the state of any optimiser in a file.
//! [`comparison`] runs optimisers on [`problems`] with known answers and judges them by [`metrics`].
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
//! 10. Fan et al., *Push and pull search for solving constrained multi-objective optimization problems*, Swarm and Evolutionary
//!     Computation 44 (2019) (constraints that are ignored at first).

mod archive;
#[cfg(feature = "studies")]
mod at_work;
mod by_name;
pub mod checkpoint;
pub mod comparison;
mod cooperative;
mod covariance;
#[cfg(feature = "gpu")]
pub mod device;
mod difference;
mod front_scale;
#[cfg(feature = "studies")]
mod front_swarm;
mod genetic;
mod islands;
mod lattice;
pub mod metrics;
mod minimise;
mod moead;
mod mopso;
mod motion;
mod nearness;
mod nsga2;
mod nsga3;
#[cfg(feature = "studies")]
mod place;
pub mod problems;
mod pso;
mod settings;
mod space;
#[cfg(feature = "studies")]
mod trail;
mod two_phase;
mod windows;

pub use archive::Archive;
#[cfg(feature = "studies")]
pub(crate) use at_work::{SwarmAtWork, SwarmState};
pub use by_name::{MULTI_OBJECTIVE, SINGLE_OBJECTIVE, Sizes, by_name, islands_by_name, several_by_name};
pub use cooperative::{CooperativeSettings, CooperativeSwarm};
pub use covariance::{CovarianceSettings, CovarianceSwarm, OutOfBounds, Restarts};
pub use difference::{DifferenceSettings, DifferenceSwarm};
#[cfg(feature = "studies")]
pub(crate) use front_swarm::{FrontSearch, FrontSwarm};
pub use islands::{AcceptsMigrants, Islands, Migration};
pub use lattice::lattice;
pub use minimise::{Indicators, Minimise, Minimum, Stopped, minimise, minimise_batch, minimise_several};
pub use moead::{Moead, MoeadSettings};
#[cfg(feature = "studies")]
pub(crate) use mopso::thinning::PER_PLACE;
pub use mopso::{Generation, MANY, Mopso};
pub use nsga2::{Nsga2, Nsga2Settings};
pub use nsga3::{Nsga3, Nsga3Settings};
#[cfg(feature = "studies")]
pub use place::SwarmPlace;
pub use pso::Pso;
pub use settings::{
    BoundHandling, Constriction, DRAWN_PULLS, Leaders, MopsoSettings, Mutation, PsoSettings, Randomness,
    Schedule, Truncation,
};
#[cfg(feature = "studies")]
pub use trail::Reached;
pub use two_phase::{HybridSettings, HybridSwarm};
pub use windows::{WindowSettings, WindowSwarm};

use crate::error::{Error, Result};
use crate::evaluate::{Evaluation, Evaluator, Failure, FailureCounts, Worth};
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
    ///
    /// # Errors
    /// [`Error::Input`] if the evaluation is not of these candidates, see [`Evaluation::check`]. The optimiser has then not
    /// been told.
    fn tell(&mut self, evaluation: &Evaluation) -> Result<()>;

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

    /// The least value of each objective among the candidates that violate the constraints least; infinite before any candidate
    /// has succeeded. [`Optimiser::violation`] says whether they are feasible.
    fn best(&self) -> Vec<f64>;

    /// By how much the result violates the constraints: zero once something feasible is known, infinite before any candidate has
    /// succeeded.
    fn violation(&self) -> f64 {
        self.front().violation
    }

    /// The result so far: the archive, or the one best candidate with its cost. It is empty before any candidate has succeeded.
    fn front(&self) -> Front;

    /// A checkpoint of its whole state, which [`checkpoint::load_optimiser`] reads. The optimisers of this crate have one.
    ///
    /// # Errors
    /// [`Error::Study`] if it has none.
    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        no_checkpoint()
    }

    /// The same as one that takes in solutions of others, if it does.
    fn accepting(&mut self) -> Option<&mut dyn AcceptsMigrants> {
        None
    }
}

fn no_checkpoint() -> Result<Vec<u8>> {
    Err(Error::Study("this optimiser has no checkpoint".to_owned()))
}

impl<O: Optimiser + ?Sized> Optimiser for Box<O> {
    fn ask(&mut self) -> Vec<f64> {
        (**self).ask()
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        (**self).tell(evaluation)
    }

    fn counters(&self) -> Counters {
        (**self).counters()
    }

    fn iteration(&self) -> usize {
        (**self).iteration()
    }

    fn planned_iterations(&self) -> usize {
        (**self).planned_iterations()
    }

    fn done(&self) -> bool {
        (**self).done()
    }

    fn evaluations(&self) -> u64 {
        (**self).evaluations()
    }

    fn best(&self) -> Vec<f64> {
        (**self).best()
    }

    fn violation(&self) -> f64 {
        (**self).violation()
    }

    fn front(&self) -> Front {
        (**self).front()
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        (**self).to_checkpoint()
    }

    fn accepting(&mut self) -> Option<&mut dyn AcceptsMigrants> {
        (**self).accepting()
    }
}

/// Candidates, none of which another dominates, and their objectives. All of them violate the constraints equally.
#[derive(Clone, Debug, PartialEq)]
pub struct Front {
    /// Rows of variables, in their units.
    pub candidates: Vec<Vec<f64>>,
    /// Rows of objectives.
    pub objectives: Vec<Vec<f64>>,
    /// By how much each of them violates the constraints: zero if they are feasible, infinite if there are none.
    pub violation: f64,
}

impl Default for Front {
    /// An empty one.
    fn default() -> Self {
        Self {
            candidates: Vec::new(),
            objectives: Vec::new(),
            violation: f64::INFINITY,
        }
    }
}

impl Front {
    /// The front of one candidate, empty if it did not succeed.
    fn single((candidate, worth): (Vec<f64>, Worth)) -> Self {
        if !worth.succeeded() {
            return Self::default();
        }
        Self {
            candidates: vec![candidate],
            objectives: vec![vec![worth.cost]],
            violation: worth.violation,
        }
    }

    /// Candidates of one objective, and what they are worth.
    fn singles(&self) -> impl Iterator<Item = (&Vec<f64>, Worth)> {
        let violation = self.violation;
        let worth = move |row: &Vec<f64>| Worth {
            violation,
            cost: row[0],
        };
        let rows = self.objectives.iter().map(worth);
        self.candidates.iter().zip(rows)
    }

    /// Whether there are candidates and they violate no constraint.
    pub fn is_feasible(&self) -> bool {
        self.violation == 0.0
    }
}

/// What an observer of a run sees after each iteration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// Iterations done.
    pub iteration: usize,
    /// Candidates evaluated.
    pub evaluations: u64,
    /// The least value of each objective, see [`Optimiser::best`].
    pub best: Vec<f64>,
    /// By how much the best violate the constraints, see [`Optimiser::violation`].
    pub violation: f64,
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
/// Those of the evaluator and of [`Optimiser::tell`]. The optimiser has then been asked, but not told.
pub fn step(optimiser: &mut dyn Optimiser, evaluator: &mut dyn Evaluator) -> Result<Progress> {
    let width = evaluator.problem().objectives.len();
    let population = optimiser.ask();
    let evaluation = evaluator.evaluate(&population)?;
    optimiser.tell(&evaluation)?;
    let first = |i: usize| evaluation.success(i, width).map(|row| row[0]);
    let candidates = evaluation.failures.len();
    let mut costs: Vec<f64> = (0..candidates).filter_map(first).collect();
    let failed = candidates - costs.len();
    let mut failures = evaluation.failure_counts();
    let unflagged = failed as u64 - failures.values().sum::<u64>();
    if unflagged > 0 {
        *failures.entry(Failure::Undefined.word().to_owned()).or_default() += unflagged;
    }
    let middle = costs.len() / 2;
    Ok(Progress {
        iteration: optimiser.iteration(),
        evaluations: optimiser.evaluations(),
        best: optimiser.best(),
        violation: optimiser.violation(),
        median: (!costs.is_empty()).then(|| *costs.select_nth_unstable_by(middle, f64::total_cmp).1),
        failed,
        failures,
    })
}

/// Asks, evaluates and tells until the planned iterations are done or `observe` returns `Break`.
///
/// # Errors
/// Those of [`step`].
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
