//! What genetic algorithms share: the population, its children, and how they are bred.
//!
//! Simulated binary crossover as in Deb, Agrawal, *Simulated binary crossover for continuous search space*, Complex
//! Systems 9 (1995), in the form that keeps to the bounds, and polynomial mutation.

use super::metrics::{non_dominated, ranks};
use super::motion::{Particles, Purpose, polynomial};
use super::settings::setting;
use super::{Counters, Front};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem, Worth};
use crate::random::Random;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// What every optimiser that breeds leaves to its `generation`: all of [`Optimiser`](super::Optimiser) but `tell`.
macro_rules! delegated {
    () => {
        fn ask(&mut self) -> Vec<f64> {
            self.generation.candidates()
        }

        fn counters(&self) -> $crate::swarm::Counters {
            self.generation.counters
        }

        fn to_checkpoint(&self) -> $crate::Result<Vec<u8>> {
            $crate::swarm::checkpoint::to_bytes(self)
        }

        fn planned_iterations(&self) -> usize {
            self.settings.iterations
        }

        fn best(&self) -> Vec<f64> {
            self.generation.best()
        }

        fn violation(&self) -> f64 {
            self.generation.violation()
        }

        fn front(&self) -> $crate::swarm::Front {
            self.generation.front()
        }
    };
}
pub(super) use delegated;

/// How children are made of their parents.
#[derive(Clone, Copy)]
pub(super) struct Breeding {
    /// Probability that a pair of parents is crossed.
    pub crossover: f64,
    /// Distribution index of the crossover.
    pub crossover_index: f64,
    /// Distribution index of the mutation.
    pub mutation_index: f64,
}

impl Breeding {
    /// Checks these settings and the sizes of a run.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting.
    pub fn check(&self, population: usize, iterations: usize) -> Result<()> {
        if population < 4 || !population.is_multiple_of(2) {
            let found = population.to_string();
            return Err(setting("population", found, "an even number, 4 or more"));
        }
        if iterations < 1 {
            return Err(setting("iterations", iterations.to_string(), "1 or more"));
        }
        if !(0.0..=1.0).contains(&self.crossover) {
            let found = self.crossover.to_string();
            return Err(setting("crossover", found, "a share from 0 to 1"));
        }
        for (name, value) in [
            ("crossover_index", self.crossover_index),
            ("mutation_index", self.mutation_index),
        ] {
            if !(0.0..=1000.0).contains(&value) {
                return Err(setting(name, value.to_string(), "a number from 0 to 1000"));
            }
        }
        Ok(())
    }
}

/// One solution, with the number of the front that it is in and, for NSGA-II, its crowding there.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Member {
    position: Vec<f64>,
    pub objectives: Vec<f64>,
    /// By how much it violates the constraints; infinite if it failed.
    pub violation: f64,
    pub rank: usize,
    pub crowding: f64,
}

/// The parents, and the children that were asked for.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Generation {
    pub random: Random,
    children: Particles,
    pub objectives: usize,
    pub parents: Vec<Member>,
    pub counters: Counters,
}

impl Generation {
    /// Children all over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming what is wrong with the problem.
    pub fn first(problem: &Problem, population: usize, seed: u64) -> Result<Self> {
        let random = Random::new(seed);
        Ok(Self {
            children: Particles::scattered(problem, population, random)?,
            objectives: problem.objectives.len(),
            parents: Vec::new(),
            random,
            counters: Counters::default(),
        })
    }

    /// Puts the first children at these candidates.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming a candidate that is no finite value for each variable.
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) -> Result<()> {
        let starts = self.children.space.starts(candidates, self.children.count)?;
        for (member, position) in starts.iter().enumerate() {
            let row = self.children.row(member);
            self.children.position[row].copy_from_slice(position);
        }
        Ok(())
    }

    /// The candidates that the children stand for.
    pub fn candidates(&self) -> Vec<f64> {
        self.children.candidates()
    }

    /// The members of the first front, unless they failed.
    fn first_front(&self) -> impl Iterator<Item = &Member> {
        let first = |m: &&Member| m.rank == 0 && m.violation.is_finite();
        self.parents.iter().filter(first)
    }

    /// The least value of each objective over the first front.
    pub fn best(&self) -> Vec<f64> {
        let column = |k: usize| self.first_front().map(move |m| m.objectives[k]);
        (0..self.objectives)
            .map(|k| column(k).fold(f64::INFINITY, f64::min))
            .collect()
    }

    /// By how much the first front violates the constraints.
    pub fn violation(&self) -> f64 {
        self.first_front().next().map_or(f64::INFINITY, |m| m.violation)
    }

    /// The first front.
    pub fn front(&self) -> Front {
        let members: Vec<&Member> = self.first_front().collect();
        let rows: Vec<Vec<f64>> = members.iter().map(|m| m.objectives.clone()).collect();
        let mut front = Front {
            violation: self.violation(),
            ..Front::default()
        };
        // One of those that are worth the same.
        for i in non_dominated(&rows) {
            let position = &members[i].position;
            front.candidates.push(self.children.space.scaled(position, 1));
            front.objectives.push(rows[i].clone());
        }
        front
    }

    /// The parents and the children with what they are worth. Copies are left out: they bring nothing and would crowd out
    /// what they are copies of.
    ///
    /// # Errors
    /// Those of [`Evaluation::check`].
    pub fn everyone(&mut self, evaluation: &Evaluation) -> Result<Vec<Member>> {
        let children = self.evaluated(evaluation)?;
        let mut known = Known::default();
        let mut all = Vec::with_capacity(2 * children.len());
        for parent in std::mem::take(&mut self.parents) {
            known.is_new(&parent.position, &parent.objectives, &all);
            all.push(parent);
        }
        for child in children {
            if known.is_new(&child.position, &child.objectives, &all) {
                all.push(child);
            }
        }
        Ok(all)
    }

    /// The children with what they are worth.
    ///
    /// # Errors
    /// Those of [`Evaluation::check`].
    pub fn evaluated(&self, evaluation: &Evaluation) -> Result<Vec<Member>> {
        evaluation.check(self.children.count, self.objectives)?;
        let member = |child: usize| {
            let (objectives, violation) = match evaluation.success(child, self.objectives) {
                Some(row) => (row.to_vec(), evaluation.violation(child)),
                None => (vec![Worth::FAILED.cost; self.objectives], Worth::FAILED.violation),
            };
            Member {
                position: self.children.position[self.children.row(child)].to_vec(),
                objectives,
                violation,
                rank: 0,
                crowding: 0.0,
            }
        };
        Ok((0..self.children.count).map(member).collect())
    }

    /// Goes on with the members at these places of `all`, no more than there are children, and breeds from those that `mates`
    /// names by their places: two for each pair of children.
    pub fn succeed(
        &mut self,
        all: Vec<Member>,
        kept: Vec<usize>,
        breeding: Breeding,
        mates: impl Fn(&Self) -> Vec<usize>,
    ) {
        let mut all: Vec<Option<Member>> = all.into_iter().map(Some).collect();
        let kept = kept.into_iter().take(self.children.count);
        self.go_on(kept.filter_map(|i| all[i].take()).collect(), breeding, mates);
    }

    /// As [`Generation::succeed`], with parents of any number.
    pub fn go_on(&mut self, parents: Vec<Member>, breeding: Breeding, mates: impl Fn(&Self) -> Vec<usize>) {
        self.parents = parents;
        self.counters.told(self.children.count);
        let mates = mates(self);
        self.breed(breeding, &mates);
    }

    /// Of two parents that are drawn at random, the better, as often as one is needed. `better` says whether the second is better
    /// than the first.
    pub fn drawn(&self, better: fn(&Member, &Member) -> bool) -> Vec<usize> {
        let when = self.counters.iteration as u32;
        let draw = |place: u32, index: u32| {
            let (who, index) = (place / 2, 2 * (place % 2) + index);
            let purpose = Purpose::Leader as u32;
            self.random.below(self.parents.len(), purpose, when, who, index)
        };
        let places = 0..self.children.count as u32;
        let pairs = places.map(|place| (draw(place, 0), draw(place, 1)));
        pairs.map(|pair| self.winner(pair, better)).collect()
    }

    /// As [`Generation::drawn`], but every parent has its turn before one has two. Where none is better than another, all of them
    /// mate equally often.
    pub fn in_turn(&self, better: fn(&Member, &Member) -> bool) -> Vec<usize> {
        let (first, second) = (self.shuffled(0), self.shuffled(1));
        let pairs = first.into_iter().zip(second).cycle();
        pairs
            .take(self.children.count)
            .map(|pair| self.winner(pair, better))
            .collect()
    }

    fn winner(&self, (a, b): (usize, usize), better: fn(&Member, &Member) -> bool) -> usize {
        match better(&self.parents[a], &self.parents[b]) {
            true => b,
            false => a,
        }
    }

    /// The places of all parents in a random order.
    fn shuffled(&self, index: u32) -> Vec<usize> {
        let when = self.counters.iteration as u32;
        let mut order: Vec<usize> = (0..self.parents.len()).collect();
        for i in (1..order.len()).rev() {
            let purpose = Purpose::Leader as u32;
            order.swap(i, self.random.below(i + 1, purpose, when, i as u32, index));
        }
        order
    }

    fn breed(&mut self, breeding: Breeding, mates: &[usize]) {
        let d = self.children.dimensions();
        let when = self.counters.iteration as u32;
        for (pair, mates) in mates.chunks_exact(2).enumerate() {
            let uniform = |index: u32| {
                self.random
                    .uniform(Purpose::Recombine as u32, when, pair as u32, index)
            };
            let (a, b) = (&self.parents[mates[0]], &self.parents[mates[1]]);
            let (mut first, mut second) = (a.position.clone(), b.position.clone());
            if uniform(0) < breeding.crossover {
                for k in 0..d {
                    let index = 1 + 3 * k as u32;
                    if uniform(index) < 0.5 {
                        let swap = uniform(index + 2) < 0.5;
                        let (x, y) = cross(a.position[k], b.position[k], uniform(index + 1), {
                            breeding.crossover_index
                        });
                        (first[k], second[k]) = if swap { (y, x) } else { (x, y) };
                    }
                }
            }
            for (child, position) in [(2 * pair, first), (2 * pair + 1, second)] {
                for (k, (i, x)) in self.children.row(child).zip(position).enumerate() {
                    let uniform = |index: u32| {
                        self.random
                            .uniform(Purpose::Mutation as u32, when, child as u32, index)
                    };
                    let mutates = uniform(2 * k as u32) * (d as f64) < 1.0;
                    self.children.position[i] = if mutates {
                        polynomial(x, uniform(2 * k as u32 + 1), breeding.mutation_index)
                    } else {
                        x
                    };
                }
            }
        }
    }
}

/// Two children of two coordinates of the unit cube.
pub(super) fn cross(a: f64, b: f64, uniform: f64, index: f64) -> (f64, f64) {
    let (low, high) = (a.min(b), a.max(b));
    let gap = high - low;
    if gap < 1e-14 {
        return (a, b);
    }
    let spread = |to_bound: f64| {
        let beta = 1.0 + 2.0 * to_bound / gap;
        let alpha = 2.0 - beta.powf(-(index + 1.0));
        let base = if uniform <= 1.0 / alpha {
            uniform * alpha
        } else {
            1.0 / (2.0 - uniform * alpha)
        };
        base.powf(1.0 / (index + 1.0))
    };
    let middle = 0.5 * (low + high);
    let below = middle - 0.5 * spread(low) * gap;
    let above = middle + 0.5 * spread(1.0 - high) * gap;
    (below.clamp(0.0, 1.0), above.clamp(0.0, 1.0))
}

/// The fronts of a set, best first: by what solutions violate, then by dominance (Deb's rules).
pub(super) fn fronts(members: &[Member]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..members.len()).collect();
    order.sort_by(|&a, &b| members[a].violation.total_cmp(&members[b].violation));
    let mut found: Vec<Vec<usize>> = Vec::new();
    for alike in order.chunk_by(|&a, &b| members[a].violation == members[b].violation) {
        let rows: Vec<Vec<f64>> = alike.iter().map(|&i| members[i].objectives.clone()).collect();
        let before = found.len();
        for (&i, rank) in alike.iter().zip(ranks(&rows)) {
            if found.len() <= before + rank {
                found.resize(before + rank + 1, Vec::new());
            }
            found[before + rank].push(i);
        }
    }
    found
}

/// Solutions that are known, to find copies of them by.
#[derive(Default)]
struct Known {
    /// Places of solutions by a digest of their numbers.
    places: HashMap<u64, Vec<usize>>,
}

impl Known {
    /// Notes down where a solution will stand, unless it is a copy of one of `all`.
    fn is_new(&mut self, position: &[f64], objectives: &[f64], all: &[Member]) -> bool {
        let mut digest = DefaultHasher::new();
        for x in position.iter().chain(objectives) {
            // Zero has two signs and one place.
            (x + 0.0).to_bits().hash(&mut digest);
        }
        let places = self.places.entry(digest.finish()).or_default();
        let copy = |&i: &usize| all[i].objectives == objectives && all[i].position == position;
        let new = !places.iter().any(copy);
        if new {
            places.push(all.len());
        }
        new
    }
}
