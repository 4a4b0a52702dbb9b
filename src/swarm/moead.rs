//! MOEA/D: a genetic algorithm in which each member minimises along a direction of its own, and neighbours help each other.
//!
//! Zhang, Li, *MOEA/D: a multiobjective evolutionary algorithm based on decomposition*, IEEE TEC 11 (2007), with boundary
//! intersection by a penalty. It differs in that a generation is bred before any of its children takes a place, so that all of
//! them can be evaluated together.

use super::Optimiser;
use super::front_scale::FrontScale;
use super::genetic::{self, Breeding, Generation, Member, fronts};
use super::lattice::directions;
use super::motion::Purpose;
use super::settings::setting;
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem};
use serde::{Deserialize, Serialize};

/// Settings of [`Moead`]; the defaults are those of the paper for three objectives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MoeadSettings {
    /// Children of a generation, an even number. There are at most as many directions, and a member to each: see
    /// [`super::Nsga3::new`].
    pub population: usize,
    /// Generations, the first random one counted.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Members whose directions are nearest to a member's own, itself among them. They mate with each other, and a child takes
    /// the place of each of them that it is better for.
    pub neighbours: usize,
    /// What the distance from a direction costs beside the distance along it.
    pub penalty: f64,
    /// Whether objectives are measured by how far the front reaches in each, as far as it is known. Otherwise they are measured
    /// as they are, from the least value of each, as in the paper's tables.
    pub scaled: bool,
    /// Distribution index of the crossover: the greater, the nearer children are to their parents.
    pub crossover_index: f64,
    /// Distribution index of the polynomial mutation, which changes a variable with probability one over their
    /// number.
    pub mutation_index: f64,
}

impl Default for MoeadSettings {
    fn default() -> Self {
        Self {
            population: 300,
            iterations: 250,
            seed: 1,
            neighbours: 20,
            penalty: 5.0,
            scaled: true,
            crossover_index: 20.0,
            mutation_index: 20.0,
        }
    }
}

impl MoeadSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        if self.neighbours < 2 {
            return Err(setting("neighbours", self.neighbours.to_string(), "2 or more"));
        }
        if !(0.0..=1e6).contains(&self.penalty) {
            return Err(setting(
                "penalty",
                self.penalty.to_string(),
                "a number from 0 to 1e6",
            ));
        }
        self.breeding().check(self.population, self.iterations)
    }

    fn breeding(&self) -> Breeding {
        Breeding {
            crossover: 1.0,
            crossover_index: self.crossover_index,
            mutation_index: self.mutation_index,
        }
    }

    /// The member that a pair of children is bred for, of so many. Members have their turns one after the other, from one
    /// generation to the next.
    fn turn(&self, iteration: usize, pair: usize, members: usize) -> usize {
        (iteration * (self.population / 2) + pair) % members
    }

    /// The directions nearest to one of them, that one among them.
    fn neighbourhood(&self, directions: &[Vec<f64>], of: usize) -> Vec<usize> {
        let near: Vec<f64> = directions.iter().map(|d| dot(d, &directions[of])).collect();
        let mut all: Vec<usize> = (0..directions.len()).collect();
        if self.neighbours < all.len() {
            all.select_nth_unstable_by(self.neighbours, |&a, &b| {
                near[b].total_cmp(&near[a]).then(a.cmp(&b))
            });
            all.truncate(self.neighbours);
            all.sort_unstable();
        }
        all
    }

    /// Two different neighbours for each pair of children.
    fn mates(&self, generation: &Generation, directions: &[Vec<f64>]) -> Vec<usize> {
        let when = generation.counters.iteration;
        let pair = |pair: usize| {
            let near = self.neighbourhood(directions, self.turn(when, pair, directions.len()));
            let draw = |bound: usize, index: u32| {
                let (purpose, when) = (Purpose::Leader as u32, when as u32);
                generation.random.below(bound, purpose, when, pair as u32, index)
            };
            let first = draw(near.len(), 0);
            let second = (first + 1 + draw((near.len() - 1).max(1), 1)) % near.len();
            [near[first], near[second]]
        };
        (0..self.population / 2).flat_map(pair).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A member to each direction, the children that were asked for, and the scale of the front so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Moead {
    settings: MoeadSettings,
    generation: Generation,
    scale: FrontScale,
}

impl Moead {
    /// A population over the variables of `problem`. Its directions are those of [`super::Nsga3::new`].
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: MoeadSettings) -> Result<Self> {
        settings.validate()?;
        Ok(Self {
            generation: Generation::first(problem, settings.population, settings.seed)?,
            scale: FrontScale::default(),
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

    /// Lets the scale learn from all that violate the constraints least, and says how far the front reaches in each objective.
    fn ranges(&mut self, members: &[Member], children: &[Member]) -> Vec<f64> {
        let all = || members.iter().chain(children);
        let least = all().map(|m| m.violation).fold(f64::INFINITY, f64::min);
        if !least.is_finite() {
            return Vec::new();
        }
        let alike: Vec<&[f64]> = all()
            .filter(|m| m.violation == least)
            .map(|m| m.objectives.as_slice())
            .collect();
        self.scale.update(least, &alike);
        match self.settings.scaled {
            true => self.scale.ranges(&alike, &alike),
            false => vec![1.0; self.generation.objectives],
        }
    }
}

impl Optimiser for Moead {
    genetic::delegated!();

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        let children = self.generation.evaluated(evaluation)?;
        let directions = directions(self.generation.objectives, self.settings.population);
        let mut members = std::mem::take(&mut self.generation.parents);
        let ranges = self.ranges(&members, &children);
        let mut newcomers = 0;
        if members.is_empty() {
            members = children.iter().cycle().take(directions.len()).cloned().collect();
            newcomers = directions.len();
        }
        let cost = |member: &Member, direction: &[f64]| {
            let place = self.scale.place(&member.objectives, &ranges);
            let along = dot(&place, direction);
            let aside = (dot(&place, &place) - along * along).max(0.0).sqrt();
            along + self.settings.penalty * aside
        };
        let when = self.generation.counters.iteration;
        for (pair, both) in children.chunks_exact(2).enumerate().skip(newcomers.div_ceil(2)) {
            let turn = self.settings.turn(when, pair, directions.len());
            for near in self.settings.neighbourhood(&directions, turn) {
                let (member, direction) = (&mut members[near], &directions[near]);
                for child in both {
                    let same = child.violation == member.violation && child.violation.is_finite();
                    let better = child.violation < member.violation
                        || (same && cost(child, direction) < cost(member, direction));
                    if better {
                        *member = child.clone();
                    }
                }
            }
        }
        for (rank, front) in fronts(&members).iter().enumerate() {
            front.iter().for_each(|&i| members[i].rank = rank);
        }
        let settings = &self.settings;
        let mates = |generation: &Generation| settings.mates(generation, &directions);
        self.generation.go_on(members, settings.breeding(), mates);
        Ok(())
    }
}
