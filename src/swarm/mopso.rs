//! Multi-objective particle swarm with an archive of leaders.

use super::Optimiser;
use super::archive::{Archive, dominates};
use super::motion::{Particles, Purpose};
use super::settings::{Leaders, MopsoSettings, Mutation};
use crate::error::Result;
use crate::evaluate::{Evaluation, FAILED_COST, Problem};
use crate::random::Random;

/// A swarm that follows an archive of non-dominated solutions (references 4 and 5 of [`super`]).
#[derive(Clone, Debug)]
pub struct Mopso {
    settings: MopsoSettings,
    random: Random,
    particles: Particles,
    objectives: usize,
    best_position: Vec<f64>,
    best_objectives: Vec<Vec<f64>>,
    archive: Archive,
    iteration: usize,
    evaluations: u64,
}

impl Mopso {
    /// A swarm over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: MopsoSettings) -> Result<Self> {
        settings.validate()?;
        let random = Random::new(settings.motion.seed);
        let particles = Particles::scattered(&problem.variables, settings.motion.population, random);
        Ok(Self {
            best_position: particles.position.clone(),
            best_objectives: vec![vec![f64::INFINITY; problem.objectives.len()]; settings.motion.population],
            objectives: problem.objectives.len(),
            archive: Archive::new(settings.archive),
            random,
            particles,
            settings,
            iteration: 0,
            evaluations: 0,
        })
    }

    /// The archive; its positions are in the unit cube, see [`Mopso::archive_candidates`].
    pub fn archive(&self) -> &Archive {
        &self.archive
    }

    /// The archive's positions in the variables' units, one row per member.
    pub fn archive_candidates(&self) -> Vec<Vec<f64>> {
        self.archive
            .positions
            .iter()
            .map(|p| self.particles.scaled(p))
            .collect()
    }

    fn leader(&self, crowding: &[f64], particle: usize) -> usize {
        let draw = |index| {
            let (when, who) = (self.iteration as u32, particle as u32);
            self.random
                .below(self.archive.len(), Purpose::Leader as u32, when, who, index)
        };
        let first = draw(0);
        match self.settings.leaders {
            Leaders::Random => first,
            Leaders::CrowdingTournament => {
                let second = draw(1);
                if crowding[second] > crowding[first] {
                    second
                } else {
                    first
                }
            }
        }
    }

    /// Redraws one coordinate within a range that shrinks over the run (equation 5.13 of the thesis; \[4\]).
    fn mutate(&mut self, particle: usize, share: f64) {
        let (when, who) = (self.iteration as u32, particle as u32);
        let uniform = |index| self.random.uniform(Purpose::Mutation as u32, when, who, index);
        let mu = match self.settings.mutation {
            Mutation::None => return,
            Mutation::Fixed(mu) => mu,
            Mutation::Random => uniform(0).max(1e-3),
        };
        let probability = (1.0 - share.min(1.0)).powf(1.0 / mu);
        let d = self.particles.dimensions();
        if d == 0 || uniform(1) >= probability {
            return;
        }
        let k = self.random.below(d, Purpose::Mutation as u32, when, who, 2);
        let i = particle * d + k;
        let x = self.particles.position[i];
        let (low, high) = ((x - probability).max(0.0), (x + probability).min(1.0));
        self.particles.position[i] = low + uniform(3) * (high - low);
    }

    fn advance(&mut self) {
        let share = self.iteration as f64 / (self.settings.motion.iterations.max(2) - 1) as f64;
        let d = self.particles.dimensions();
        let crowding = self.archive.crowding();
        for particle in 0..self.settings.motion.population {
            if !self.archive.is_empty() {
                let leader = self.archive.positions[self.leader(&crowding, particle)].clone();
                let own = self.best_position[particle * d..(particle + 1) * d].to_vec();
                let when = (share, self.iteration);
                self.particles.pull(
                    particle,
                    (&own, &leader),
                    &self.settings.motion,
                    when,
                    self.random,
                );
            }
            self.mutate(particle, share);
        }
    }
}

impl Optimiser for Mopso {
    fn ask(&mut self) -> Vec<f64> {
        self.particles.scaled(&self.particles.position)
    }

    fn tell(&mut self, evaluation: &Evaluation) {
        let d = self.particles.dimensions();
        let rows = evaluation
            .objectives
            .chunks_exact(self.objectives)
            .zip(&evaluation.failures);
        for (particle, (row, failure)) in rows.enumerate() {
            let range = particle * d..(particle + 1) * d;
            let position = self.particles.position[range.clone()].to_vec();
            let sound = failure.is_none() && row.iter().all(|x| x.is_finite() && *x < FAILED_COST);
            if sound {
                self.archive.insert(&position, row);
            }
            let best = &mut self.best_objectives[particle];
            let coin = self
                .random
                .uniform(Purpose::Coin as u32, self.iteration as u32, particle as u32, 0);
            if dominates(row, best) || (!dominates(best, row) && coin < 0.5) {
                best.copy_from_slice(row);
                self.best_position[range].copy_from_slice(&position);
            }
        }
        self.archive.truncate();
        self.evaluations += self.settings.motion.population as u64;
        self.iteration += 1;
        self.advance();
    }

    fn iteration(&self) -> usize {
        self.iteration
    }

    fn planned_iterations(&self) -> usize {
        self.settings.motion.iterations
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }

    fn best(&self) -> Vec<f64> {
        let least = |k: usize| {
            self.archive
                .objectives
                .iter()
                .map(|m| m[k])
                .fold(FAILED_COST, f64::min)
        };
        (0..self.objectives).map(least).collect()
    }
}
