//! NSGA-III: a genetic algorithm for three objectives and more, whose members spread along directions given before.
//!
//! Deb, Jain, *An evolutionary many-objective optimization algorithm using reference-point-based nondominated sorting
//! approach, part I*, and Jain, Deb, *part II: handling constraints*, IEEE TEC 18 (2014). Directions as in Das, Dennis,
//! *Normal-boundary intersection*, SIAM J. Optimization 8 (1998).

use super::Optimiser;
use super::front_scale::FrontScale;
use super::genetic::{self, Breeding, Generation, Member, fronts};
use super::lattice::directions;
use super::motion::Purpose;
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem};
use serde::{Deserialize, Serialize};

/// Settings of [`Nsga3`]; the defaults are those of the paper for three objectives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Nsga3Settings {
    /// Members of the population, an even number. There are at most as many directions: see [`Nsga3::new`].
    pub population: usize,
    /// Generations, the first random one counted.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Distribution index of the crossover: the greater, the nearer children are to their parents.
    pub crossover_index: f64,
    /// Distribution index of the polynomial mutation, which changes a variable with probability one over their
    /// number.
    pub mutation_index: f64,
}

impl Default for Nsga3Settings {
    fn default() -> Self {
        Self {
            population: 92,
            iterations: 250,
            seed: 1,
            crossover_index: 30.0,
            mutation_index: 20.0,
        }
    }
}

impl Nsga3Settings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        self.breeding().check(self.population, self.iterations)
    }

    fn breeding(&self) -> Breeding {
        Breeding {
            crossover: 1.0,
            crossover_index: self.crossover_index,
            mutation_index: self.mutation_index,
        }
    }
}

/// The population, the children it has been asked for, and the scale of the front so far.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Nsga3 {
    settings: Nsga3Settings,
    generation: Generation,
    scale: FrontScale,
}

impl Nsga3 {
    /// A population over the variables of `problem`. Its directions are all those whose parts are multiples of one over a
    /// whole number, as fine as the population has room for. Where none of them would have a part in every objective, a
    /// second layer of directions lies half-way to the middle.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: Nsga3Settings) -> Result<Self> {
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

    /// The members of the next generation; `fronts` are whole fronts, of which the last may not fit.
    fn survivors(&mut self, all: &[Member], mut fronts: Vec<Vec<usize>>) -> Vec<usize> {
        let violation = all[fronts[0][0]].violation;
        let alike = |front: &&Vec<usize>| all[front[0]].violation == violation;
        let rows = |fronts: &[Vec<usize>]| -> Vec<&[f64]> {
            let members = fronts.iter().filter(alike).flatten();
            members.map(|&i| all[i].objectives.as_slice()).collect()
        };
        let (whole, first) = (rows(&fronts), rows(&fronts[..1]));
        if violation.is_finite() {
            self.scale.update(violation, &whole);
        }
        let last = fronts.pop().unwrap_or_default();
        let mut kept: Vec<usize> = fronts.concat();
        let room = self.settings.population - kept.len();
        // What violates more, or failed, has no place on the front's scale.
        if last.len() <= room || !violation.is_finite() || !alike(&&last) {
            kept.extend(last.into_iter().take(room));
            return kept;
        }
        let directions = directions(self.generation.objectives, self.settings.population);
        let ranges = self.scale.ranges(&first, &whole);
        let nearest = |i: usize| {
            let place = self.scale.place(&all[i].objectives, &ranges);
            nearest(&directions, &place)
        };
        let mut crowd = vec![0_usize; directions.len()];
        for &i in &kept {
            crowd[nearest(i).0] += 1;
        }
        let mut waiting: Vec<Vec<(usize, f64)>> = vec![Vec::new(); directions.len()];
        for i in last {
            let (direction, distance) = nearest(i);
            waiting[direction].push((i, distance));
        }
        let when = self.generation.counters.iteration as u32;
        for pick in 0..room as u32 {
            let draw = |bound: usize, index| {
                let random = self.generation.random;
                random.below(bound, Purpose::Niche as u32, when, pick, index)
            };
            let mut open: Vec<usize> = (0..directions.len())
                .filter(|&k| !waiting[k].is_empty())
                .collect();
            let Some(least) = open.iter().map(|&k| crowd[k]).min() else {
                break;
            };
            open.retain(|&k| crowd[k] == least);
            let niche = open[draw(open.len(), 0)];
            let candidates = &mut waiting[niche];
            let by_distance = |a: &usize, b: &usize| candidates[*a].1.total_cmp(&candidates[*b].1);
            let chosen = match least {
                0 => (0..candidates.len()).min_by(by_distance).unwrap_or(0),
                _ => draw(candidates.len(), 1),
            };
            kept.push(candidates.swap_remove(chosen).0);
            crowd[niche] += 1;
        }
        kept
    }
}

/// The direction nearest to a point, and the square of their distance.
fn nearest(directions: &[Vec<f64>], point: &[f64]) -> (usize, f64) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let square = dot(point, point);
    let away = |direction: &Vec<f64>| square - dot(direction, point).powi(2);
    let distances = directions.iter().map(away).enumerate();
    distances
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, square))
}

/// Whether `b` is better than `a`. All that are left are equally good by their fronts; only constraints tell.
fn better(a: &Member, b: &Member) -> bool {
    b.violation < a.violation
}

impl Optimiser for Nsga3 {
    genetic::delegated!();

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        let mut all = self.generation.everyone(evaluation)?;
        let mut whole = fronts(&all);
        let mut members = 0;
        let before = |front: &Vec<usize>| {
            let starts = members;
            members += front.len();
            starts < self.settings.population
        };
        let count = whole.iter().map(before).take_while(|fits| *fits).count();
        whole.truncate(count);
        for (rank, front) in whole.iter().enumerate() {
            front.iter().for_each(|&i| all[i].rank = rank);
        }
        let kept = self.survivors(&all, whole);
        self.generation
            .succeed(all, kept, self.settings.breeding(), |g| g.in_turn(better));
        Ok(())
    }
}
