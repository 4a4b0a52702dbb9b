//! A swarm of difference moves that finds its own scale: differential evolution.
//!
//! Each particle tries the sum of another's position and the scaled difference of two further ones, in some of its
//! coordinates, and stays where it was unless that is better. Scale and share of coordinates belong to the
//! particle, are redrawn now and then and kept when the move paid (Storn, Price, *Differential evolution*, J.
//! Global Optimization 11, 1997; Brest et al., *Self-adapting control parameters in differential evolution*, IEEE
//! TEC 10, 2006, with its constants). It explores many hollows where a swarm with one leader commits itself to one.
//!
//! Where little of the space is feasible, violations up to a level count as none. The level falls to zero (Takahama, Sakai,
//! *Constrained optimization by the epsilon constrained differential evolution*, CEC 2006), so that particles move across a narrow
//! feasible region, such as the surface of an equality, while it is still wide.

use super::checkpoint::to_bytes;
use super::motion::{Particles, Purpose, half_way_back};
use super::settings::setting;
use super::space::Space;
use super::{AcceptsMigrants, Counters, Front, Islands, Optimiser};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem, Worth};
use crate::random::Random;
use serde::{Deserialize, Serialize};

/// Settings of [`DifferenceSwarm`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DifferenceSettings {
    /// Particles.
    pub population: usize,
    /// Iterations, the first random population counted.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Probability that a particle redraws its scale, and that it redraws its share of coordinates.
    pub redraw: f64,
}

impl Default for DifferenceSettings {
    fn default() -> Self {
        Self {
            population: 40,
            iterations: 1000,
            seed: 1,
            redraw: 0.1,
        }
    }
}

impl DifferenceSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        if self.population < 4 {
            return Err(setting("population", self.population.to_string(), "4 or more"));
        }
        if self.iterations < 1 {
            return Err(setting("iterations", self.iterations.to_string(), "1 or more"));
        }
        if !(0.0..=1.0).contains(&self.redraw) {
            return Err(setting("redraw", self.redraw.to_string(), "a share from 0 to 1"));
        }
        Ok(())
    }
}

/// A swarm of self-adapted difference moves, for a single objective.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DifferenceSwarm {
    settings: DifferenceSettings,
    random: Random,
    /// Where the particles try next.
    particles: Particles,
    home: Vec<f64>,
    worth: Vec<Worth>,
    best: (Vec<f64>, Worth),
    /// The violation that counted as none at the beginning.
    level: f64,
    /// Scale and share of coordinates of each particle, and those of its present try.
    control: Vec<[f64; 2]>,
    tried: Vec<[f64; 2]>,
    counters: Counters,
}

/// The share of the first candidates whose violations are within the first level: where so many are feasible it is zero.
const WITHIN: f64 = 0.2;
/// The share of the iterations at which the level has fallen to zero, and the power by which it falls.
const FALLEN: f64 = 0.7;
const FALL: f64 = 3.0;

impl DifferenceSwarm {
    /// A swarm over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range, and for a problem of several objectives.
    pub fn new(problem: &Problem, settings: DifferenceSettings) -> Result<Self> {
        settings.validate()?;
        let random = Random::new(settings.seed);
        let space = Space::of_one_objective(problem)?;
        let particles = Particles::scattered_in(space, settings.population, random);
        Ok(Self {
            home: particles.position.clone(),
            worth: vec![Worth::FAILED; settings.population],
            best: (particles.position[particles.row(0)].to_vec(), Worth::FAILED),
            level: 0.0,
            control: vec![[0.5; 2]; settings.population],
            tried: vec![[0.5; 2]; settings.population],
            random,
            particles,
            settings,
            counters: Counters::default(),
        })
    }

    /// The best candidate so far, in the variables' units, and what it is worth.
    pub fn best_candidate(&self) -> (Vec<f64>, Worth) {
        let (position, worth) = &self.best;
        (self.particles.space.scaled(position, 1), *worth)
    }

    /// Root mean square distance of the particles from their mean along an axis, as a share of the ranges.
    pub fn spread(&self) -> f64 {
        let (d, n) = (self.particles.dimensions(), self.settings.population as f64);
        let variance = |k: usize| {
            let column = || self.home.iter().skip(k).step_by(d);
            let mean = column().sum::<f64>() / n;
            column().map(|x| (x - mean).powi(2)).sum::<f64>() / n
        };
        ((0..d).map(variance).sum::<f64>() / d.max(1) as f64).sqrt()
    }

    fn advance(&mut self) {
        let when = self.counters.iteration as u32;
        for particle in 0..self.settings.population {
            let who = particle as u32;
            let uniform = |index: usize| {
                self.random
                    .uniform(Purpose::Difference as u32, when, who, index as u32)
            };
            let redrawn = |k: usize, value: f64| {
                if uniform(k) < self.settings.redraw {
                    value
                } else {
                    self.control[particle][k]
                }
            };
            let [scale, share] = [redrawn(0, 0.1 + 0.9 * uniform(2)), redrawn(1, uniform(3))];
            self.tried[particle] = [scale, share];
            let [from, first, second] = self.three_others(particle);
            let row = self.particles.row(particle);
            let (d, at) = (row.len(), row.start);
            let always = (uniform(4) * d as f64) as usize;
            for k in 0..d {
                let own = self.home[at + k];
                let of = |p: usize| self.home[p * d + k];
                let moved = of(from) + scale * (of(first) - of(second));
                let take = k == always || uniform(5 + k) < share;
                self.particles.position[at + k] = if take { half_way_back(own, moved) } else { own };
            }
        }
    }

    /// The violation that counts as none in this iteration.
    fn level(&self) -> f64 {
        let fallen = self.counters.iteration as f64 / (FALLEN * self.settings.iterations as f64);
        self.level * (1.0 - fallen).max(0.0).powf(FALL)
    }

    /// Three different particles, none of them this one.
    fn three_others(&self, particle: usize) -> [usize; 3] {
        let (when, who) = (self.counters.iteration as u32, particle as u32);
        let mut taken = [particle, 0, 0, 0];
        for k in 0..3 {
            let free = self.settings.population - 1 - k;
            let mut other = self
                .random
                .below(free, Purpose::Leader as u32, when, who, k as u32);
            // The nth of those not taken yet.
            let mut passed = taken[..=k].to_vec();
            passed.sort_unstable();
            for p in passed {
                other += usize::from(other >= p);
            }
            taken[k + 1] = other;
        }
        [taken[1], taken[2], taken[3]]
    }
}

impl AcceptsMigrants for DifferenceSwarm {
    /// Each takes the home of the worst particle, if it is better.
    fn accept_migrants(&mut self, migrants: &Front) {
        for (candidate, worth) in migrants.singles() {
            let worst = (0..self.worth.len()).max_by(|&a, &b| self.worth[a].order(&self.worth[b]));
            if let Some(worst) = worst.filter(|&p| worth < self.worth[p]) {
                let place = self.particles.row(worst);
                let position = self.particles.space.position(candidate);
                self.home[place].copy_from_slice(&position);
                self.worth[worst] = worth;
                if worth < self.best.1 {
                    self.best = (position, worth);
                }
            }
        }
    }

    fn islands_to_checkpoint(islands: &Islands<Self>) -> Result<Vec<u8>> {
        to_bytes(islands)
    }
}

impl Optimiser for DifferenceSwarm {
    fn ask(&mut self) -> Vec<f64> {
        self.particles.candidates()
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        evaluation.check(self.settings.population, 1)?;
        let worths = evaluation.worths(1);
        if self.counters.iteration == 0 {
            let mut violations: Vec<f64> = worths.iter().map(|worth| worth.violation).collect();
            violations.sort_by(f64::total_cmp);
            let within = violations[(WITHIN * violations.len() as f64) as usize];
            self.level = if within.is_finite() { within } else { 0.0 };
        }
        let level = self.level();
        for (particle, worth) in worths.into_iter().enumerate() {
            let range = self.particles.row(particle);
            let position = &self.particles.position[range.clone()];
            if worth < self.best.1 {
                self.best = (position.to_vec(), worth);
            }
            if worth.within(level) <= self.worth[particle].within(level) {
                self.worth[particle] = worth;
                self.control[particle] = self.tried[particle];
                self.home[range].copy_from_slice(position);
            }
        }
        self.counters.told(self.settings.population);
        self.advance();
        Ok(())
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        to_bytes(self)
    }

    fn accepting(&mut self) -> Option<&mut dyn AcceptsMigrants> {
        Some(self)
    }

    fn planned_iterations(&self) -> usize {
        self.settings.iterations
    }

    fn front(&self) -> Front {
        Front::single(self.best_candidate())
    }

    fn best(&self) -> Vec<f64> {
        vec![self.best.1.cost]
    }
}
