//! A swarm that learns the shape of the valley it is in: covariance matrix adaptation.
//!
//! A plain swarm stalls where the cost is a long, narrow valley across the axes, as in any fit whose parameters
//! stand in for one another. Here the particles are drawn about a common centre from a normal distribution whose
//! covariance follows the steps that paid (Hansen, *The CMA evolution strategy: a tutorial*, arXiv:1604.00772,
//! 2016, with the default constants of its table 1). It starts from where an exploring swarm got to, as in Müller,
//! Baumgartner, Sbalzarini, *Particle swarm CMA evolution strategy*, CEC 2009.
//!
//! Where the distribution has collapsed it can start again elsewhere: with twice the particles each time (Auger,
//! Hansen, *A restart CMA evolution strategy with increasing population size*, CEC 2005), or by turns with these
//! and with few (Hansen, *Benchmarking a BI-population CMA-ES on the BBOB-2009 function testbed*, GECCO 2009).

mod distribution;

use super::checkpoint::to_bytes;
use super::space::Space;
use super::{Counters, Front, Optimiser};
use crate::error::{Error, Result};
use crate::evaluate::{Evaluation, Problem, Worth};
use crate::random::Random;
pub(super) use distribution::{Distribution, FEW};
use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// What a swarm does whose distribution has collapsed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Restarts {
    /// It continues.
    None,
    /// It restarts at a random place, with twice the particles of the previous start.
    Growing,
    /// It restarts either as `Growing` does, or with few particles and a random spread: whichever kind has had fewer
    /// evaluations.
    Alternating,
}

/// What the distribution learns from where particles lie beyond the bounds; they are evaluated where reflection at
/// the bounds puts them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum OutOfBounds {
    /// From where they lie: an optimum on a bound is one in the open, with its mirror image beyond. It is found to
    /// full precision.
    AsDrawn,
    /// From where reflection puts them. At a bound all steps then lead inwards, which keeps the distribution off
    /// it; an optimum in a corner of many bounds is missed.
    Reflected,
}

/// Settings of [`CovarianceSwarm`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CovarianceSettings {
    /// Particles at the start.
    pub population: usize,
    /// Iterations; their product with the population is the budget of evaluations.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Standard deviation at the start, as a share of the ranges.
    pub spread: f64,
    /// Whether the worst steps are unlearnt, besides the best being learnt.
    pub active: bool,
    /// What the distribution learns from of particles beyond the bounds.
    pub beyond: OutOfBounds,
    /// Restarts.
    pub restarts: Restarts,
}

impl Default for CovarianceSettings {
    fn default() -> Self {
        Self {
            population: 64,
            iterations: 800,
            seed: 1,
            spread: 0.1,
            active: false,
            beyond: OutOfBounds::AsDrawn,
            restarts: Restarts::None,
        }
    }
}

/// A swarm drawn from an adapted normal distribution, for a single objective.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CovarianceSwarm {
    settings: CovarianceSettings,
    space: Space,
    random: Random,
    distribution: Distribution,
    /// The present population over the plane that the unit cube tiles by reflection, see [`folded`].
    positions: Vec<DVector<f64>>,
    best: (DVector<f64>, Worth),
    /// The best of the last iterations since the last start.
    history: VecDeque<Worth>,
    /// Starts so far that doubled the particles.
    doublings: u32,
    /// Whether the present start is a small one, and the evaluations that small and other starts have had.
    small: bool,
    spent: [u64; 2],
    counters: Counters,
}

/// What the draws are for, in the counter.
const SAMPLE: u32 = 0xc0a;
const RESTART: u32 = 0xc0b;
/// Standard deviation of a restart, as a share of the ranges.
const RESTART_SPREAD: f64 = 0.3;
/// A distribution narrower than this share of the ranges has collapsed,
const COLLAPSED: f64 = 1e-15;
/// as has one of this ratio of variances,
const ILL_CONDITIONED: f64 = 1e14;
/// or one whose best costs agree to this share.
const SAME_COST: f64 = 1e-12;

impl CovarianceSwarm {
    /// A swarm over the variables of `problem` about `start` (in the variables' units).
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting that is out of its range, and for a problem of several objectives.
    pub fn new(problem: &Problem, start: &[f64], settings: CovarianceSettings) -> Result<Self> {
        let space = Space::of_one_objective(problem)?;
        let d = problem.variables.len();
        if settings.population < 4 || start.len() != d || start.iter().any(|x| !x.is_finite()) {
            let found = format!(
                "{} particles, {d} variables, a start of {}",
                settings.population,
                start.len()
            );
            let expected = "4 or more particles, and a start with a finite value for each of the variables";
            return Err(Error::input(
                "the swarm's settings",
                "population, start",
                found,
                expected,
            ));
        }
        if !(settings.spread > 0.0 && settings.spread <= 1.0) {
            let found = settings.spread.to_string();
            return Err(Error::input(
                "the swarm's settings",
                "spread",
                found,
                "a share above 0 up to 1",
            ));
        }
        let mean = DVector::from_vec(space.position(start));
        let mut swarm = Self {
            random: Random::new(settings.seed),
            best: (mean.clone(), Worth::FAILED),
            distribution: Distribution::new(mean, settings.spread),
            space,
            positions: Vec::new(),
            history: VecDeque::new(),
            doublings: 0,
            small: false,
            spent: [0; 2],
            counters: Counters::default(),
            settings,
        };
        swarm.sample(swarm.settings.population);
        Ok(swarm)
    }

    /// The best candidate so far, in the variables' units, and what it is worth.
    pub fn best_candidate(&self) -> (Vec<f64>, Worth) {
        let position: Vec<f64> = self.best.0.iter().copied().map(folded).collect();
        (self.space.scaled(&position, 1), self.best.1)
    }

    fn budget(&self) -> u64 {
        (self.settings.population as u64).saturating_mul(self.settings.iterations as u64)
    }

    fn sample(&mut self, count: usize) {
        let when = self.counters.iteration as u32;
        let draw = |particle: usize| {
            let normal = |k: usize| self.random.normal(SAMPLE, when, particle as u32, k as u32);
            let drawn = self.distribution.sample(normal);
            match self.settings.beyond {
                OutOfBounds::AsDrawn => drawn,
                OutOfBounds::Reflected => drawn.map(folded),
            }
        };
        self.positions = (0..count).into_par_iter().with_min_len(FEW).map(draw).collect();
    }

    /// Notes the iteration's best and says whether there is nothing left to gain from this start.
    fn collapsed(&mut self, best: Worth) -> bool {
        let kept = 10 + (30 * self.space.dimensions()).div_ceil(self.positions.len());
        self.history.push_back(best);
        if self.history.len() > kept {
            self.history.pop_front();
        }
        // Where something is infeasible the violation is what the swarm goes by.
        let feasible = self.history.iter().all(|w| w.violation == 0.0);
        let (least, most) = self
            .history
            .iter()
            .map(|w| if feasible { w.cost } else { w.violation })
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| {
                (low.min(c), high.max(c))
            });
        let level = self.history.len() == kept && most - least <= SAME_COST * least.abs();
        level || self.distribution.width() < COLLAPSED || self.distribution.condition() > ILL_CONDITIONED
    }

    /// Restarts at a random place; returns the number of particles.
    fn restart(&mut self) -> usize {
        let uniform = |index: usize| {
            self.random
                .uniform(RESTART, self.counters.iteration as u32, 0, index as u32)
        };
        let d = self.space.dimensions();
        let mean = DVector::from_fn(d, |k, _| uniform(2 + k));
        self.history.clear();
        let usual = self.settings.population;
        self.small = self.settings.restarts == Restarts::Alternating
            && self.doublings > 0
            && self.spent[1] < self.spent[0];
        let remaining = self.budget().saturating_sub(self.counters.evaluations).max(4) as usize;
        if self.small {
            let least = ((4.0 + 3.0 * (d as f64).ln()) as usize).min(usual);
            let large = (usual << self.doublings.min(20)) as f64;
            let ratio = 0.5 * large / least as f64;
            self.distribution = Distribution::new(mean, RESTART_SPREAD * 10f64.powf(-2.0 * uniform(0)));
            let count = least as f64 * ratio.max(1.0).powf(uniform(1).powi(2));
            return (count as usize).clamp(4, remaining);
        }
        self.doublings += 1;
        self.distribution = Distribution::new(mean, RESTART_SPREAD);
        // A population that the budget has no room for to converge is no use.
        (usual << self.doublings.min(20))
            .min((remaining / 50).max(usual))
            .min(remaining)
    }
}

/// A coordinate reflected into the unit cube.
fn folded(x: f64) -> f64 {
    let twice = x.rem_euclid(2.0);
    if twice > 1.0 { 2.0 - twice } else { twice }
}

impl Optimiser for CovarianceSwarm {
    fn ask(&mut self) -> Vec<f64> {
        let d = self.space.dimensions();
        let mut rows = vec![0.0; self.positions.len() * d];
        rows.par_chunks_exact_mut(d.max(1))
            .zip(&self.positions)
            .with_min_len(FEW)
            .for_each(|(row, position)| {
                for (x, drawn) in row.iter_mut().zip(position.iter()) {
                    *x = folded(*drawn);
                }
            });
        self.space.scaled(&rows, self.positions.len())
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        let mut count = self.positions.len();
        evaluation.check(count, 1)?;
        let worths = evaluation.worths(1);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| worths[a].order(&worths[b]));
        let Some(&first) = order.first() else {
            return Ok(());
        };
        if worths[first] < self.best.1 {
            self.best = (self.positions[first].clone(), worths[first]);
        }
        self.counters.evaluations += count as u64;
        self.spent[usize::from(self.small)] += count as u64;
        // A population that failed as a whole says nothing about where to go.
        if worths[first].succeeded() && self.space.dimensions() > 0 {
            let ranked: Vec<&DVector<f64>> = order.iter().map(|&i| &self.positions[i]).collect();
            self.distribution.adapt(&ranked, self.settings.active);
            if self.settings.restarts != Restarts::None && self.collapsed(worths[first]) {
                count = self.restart();
            }
        }
        self.counters.iteration += 1;
        self.sample(count);
        Ok(())
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        to_bytes(self)
    }

    fn planned_iterations(&self) -> usize {
        self.settings.iterations
    }

    fn done(&self) -> bool {
        self.counters.evaluations + self.positions.len() as u64 > self.budget()
    }

    fn front(&self) -> Front {
        Front::single(self.best_candidate())
    }

    fn best(&self) -> Vec<f64> {
        vec![self.best.1.cost]
    }
}
