//! NSGA-II, the genetic algorithm that swarms are compared with.
//!
//! Deb, Pratap, Agarwal, Meyarivan, *A fast and elitist multiobjective genetic algorithm: NSGA-II*, IEEE TEC 6
//! (2002).

use super::Optimiser;
use super::genetic::{self, Breeding, Generation, Member, fronts};
use super::nearness::crowding;
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem};
use serde::{Deserialize, Serialize};

/// Settings of [`Nsga2`]; the defaults are those of the paper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Nsga2Settings {
    /// Members of the population, an even number.
    pub population: usize,
    /// Generations, the first random one counted.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Probability that a pair of parents is crossed.
    pub crossover: f64,
    /// Distribution index of the crossover: the greater, the nearer children are to their parents.
    pub crossover_index: f64,
    /// Distribution index of the polynomial mutation, which changes a variable with probability one over their
    /// number.
    pub mutation_index: f64,
}

impl Default for Nsga2Settings {
    fn default() -> Self {
        Self {
            population: 100,
            iterations: 250,
            seed: 1,
            crossover: 0.9,
            crossover_index: 20.0,
            mutation_index: 20.0,
        }
    }
}

impl Nsga2Settings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        self.breeding().check(self.population, self.iterations)
    }

    fn breeding(&self) -> Breeding {
        Breeding {
            crossover: self.crossover,
            crossover_index: self.crossover_index,
            mutation_index: self.mutation_index,
        }
    }
}

/// The population and the children it has been asked for.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Nsga2 {
    settings: Nsga2Settings,
    generation: Generation,
}

impl Nsga2 {
    /// A population over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: Nsga2Settings) -> Result<Self> {
        settings.validate()?;
        Ok(Self {
            generation: Generation::first(problem, settings.population, settings.seed)?,
            settings,
        })
    }

    /// Puts the first members at these candidates (in the variables' units), before the first population is asked for.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming a candidate that is no finite value for each variable.
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) -> Result<()> {
        self.generation.start_from(candidates)
    }
}

/// Whether `b` is better than `a`: by front, then by crowding.
fn better(a: &Member, b: &Member) -> bool {
    b.rank < a.rank || (b.rank == a.rank && b.crowding > a.crowding)
}

impl Optimiser for Nsga2 {
    genetic::delegated!();

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        let mut all = self.generation.everyone(evaluation)?;
        let mut kept = Vec::new();
        for (rank, mut front) in fronts(&all).into_iter().enumerate() {
            let rows: Vec<&[f64]> = front.iter().map(|&i| all[i].objectives.as_slice()).collect();
            for (&i, distance) in front.iter().zip(crowding(&rows)) {
                all[i].rank = rank;
                all[i].crowding = distance;
            }
            front.sort_by(|&a, &b| all[b].crowding.total_cmp(&all[a].crowding));
            kept.extend(front);
            if kept.len() >= self.settings.population {
                break;
            }
        }
        self.generation
            .succeed(all, kept, self.settings.breeding(), |g| g.drawn(better));
        Ok(())
    }
}
