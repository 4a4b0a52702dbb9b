//! The swarm for a single objective of which nothing is known: explore, then gather.
//!
//! [`DifferenceSwarm`] explores, which finds the right hollow among many; [`CovarianceSwarm`] then gathers about
//! its best, which follows a valley to its end, and starts again elsewhere when it has got there.

use super::checkpoint::to_bytes;
use super::settings::setting;
use super::{
    Counters, CovarianceSettings, CovarianceSwarm, DifferenceSettings, DifferenceSwarm, Front, Optimiser,
    OutOfBounds, Restarts,
};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem, Worth};
use serde::{Deserialize, Serialize};

/// Settings of [`HybridSwarm`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HybridSettings {
    /// Particles.
    pub population: usize,
    /// Iterations; their product with the population is the budget of evaluations.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Share of the iterations that explore.
    pub explore: f64,
}

impl Default for HybridSettings {
    fn default() -> Self {
        Self {
            population: 40,
            iterations: 2500,
            seed: 1,
            explore: 0.4,
        }
    }
}

impl HybridSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        if !(0.0..=1.0).contains(&self.explore) {
            return Err(setting(
                "explore",
                self.explore.to_string(),
                "a share from 0 to 1",
            ));
        }
        self.exploring().validate()
    }

    fn exploring(&self) -> DifferenceSettings {
        let share = (self.explore * self.iterations as f64).round() as usize;
        DifferenceSettings {
            population: self.population,
            // One at least, so that there is somewhere to gather.
            iterations: share.max(1).min(self.iterations),
            seed: self.seed,
            ..DifferenceSettings::default()
        }
    }
}

/// An exploring swarm followed by a gathering one, for a single objective.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HybridSwarm {
    settings: HybridSettings,
    problem: Problem,
    explorers: DifferenceSwarm,
    gatherers: Option<CovarianceSwarm>,
}

/// The gathering swarm starts as wide as the exploring one ended, within these shares of the ranges: one that has
/// converged is given room to find the rest of the way, one that has not is given a centre.
const SPREAD: [f64; 2] = [1e-3, 0.2];

impl HybridSwarm {
    /// A swarm over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range, and for a problem of several objectives.
    pub fn new(problem: &Problem, settings: HybridSettings) -> Result<Self> {
        settings.validate()?;
        Ok(Self {
            explorers: DifferenceSwarm::new(problem, settings.exploring())?,
            problem: problem.clone(),
            gatherers: None,
            settings,
        })
    }

    /// The best candidate so far, in the variables' units, and what it is worth.
    pub fn best_candidate(&self) -> (Vec<f64>, Worth) {
        let explored = self.explorers.best_candidate();
        match self.gatherers.as_ref().map(CovarianceSwarm::best_candidate) {
            Some(gathered) if gathered.1 < explored.1 => gathered,
            _ => explored,
        }
    }

    fn present(&self) -> &dyn Optimiser {
        match &self.gatherers {
            Some(gatherers) => gatherers,
            None => &self.explorers,
        }
    }
}

impl Optimiser for HybridSwarm {
    fn ask(&mut self) -> Vec<f64> {
        match &mut self.gatherers {
            Some(gatherers) => gatherers.ask(),
            None => self.explorers.ask(),
        }
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        if let Some(gatherers) = &mut self.gatherers {
            return gatherers.tell(evaluation);
        }
        self.explorers.tell(evaluation)?;
        if self.explorers.done() && self.explorers.iteration() < self.settings.iterations {
            let settings = CovarianceSettings {
                population: self.settings.population,
                iterations: self.settings.iterations - self.explorers.iteration(),
                seed: self.settings.seed,
                spread: self.explorers.spread().clamp(SPREAD[0], SPREAD[1]),
                active: true,
                beyond: OutOfBounds::AsDrawn,
                restarts: Restarts::Alternating,
            };
            let (start, _) = self.explorers.best_candidate();
            self.gatherers = Some(CovarianceSwarm::new(&self.problem, &start, settings)?);
        }
        Ok(())
    }

    fn counters(&self) -> Counters {
        let (explorers, gatherers) = (self.explorers.counters(), self.gatherers.as_ref());
        let gatherers = gatherers.map(Optimiser::counters).unwrap_or_default();
        Counters {
            iteration: explorers.iteration + gatherers.iteration,
            evaluations: explorers.evaluations + gatherers.evaluations,
        }
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        to_bytes(self)
    }

    fn planned_iterations(&self) -> usize {
        self.settings.iterations
    }

    fn done(&self) -> bool {
        self.present().done()
    }

    fn front(&self) -> Front {
        Front::single(self.best_candidate())
    }

    fn best(&self) -> Vec<f64> {
        vec![self.best_candidate().1.cost]
    }
}
