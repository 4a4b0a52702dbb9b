//! Single-objective particle swarm.

use super::checkpoint::to_bytes;
use super::motion::{Particle, Particles, Purpose, Trials, half_way_back};
use super::settings::PsoSettings;
use super::space::Space;
use super::{AcceptsMigrants, Counters, Front, Islands, Optimiser};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem, Worth};
use crate::random::Random;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A swarm with one leader (references 1, 2 and 7 of [`super`]).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Pso {
    settings: PsoSettings,
    random: Random,
    particles: Particles,
    trials: Trials,
    best_position: Vec<f64>,
    best: Vec<Worth>,
    leader: usize,
    counters: Counters,
}

/// Share of the swarm, best first, from which difference moves take their leaders.
const ELITE_SHARE: f64 = 0.1;

impl Pso {
    /// A swarm over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range, and for a problem of several objectives.
    pub fn new(problem: &Problem, settings: PsoSettings) -> Result<Self> {
        settings.validate()?;
        let random = Random::new(settings.seed);
        let space = Space::of_one_objective(problem)?;
        let particles = Particles::scattered_in(space, settings.population, random);
        Ok(Self {
            best_position: particles.position.clone(),
            best: vec![Worth::FAILED; settings.population],
            random,
            particles,
            trials: Trials::default(),
            settings,
            leader: 0,
            counters: Counters::default(),
        })
    }

    /// The best candidate so far, in the variables' units, and what it is worth.
    pub fn best_candidate(&self) -> (Vec<f64>, Worth) {
        let row = &self.best_position[self.particles.row(self.leader)];
        (self.particles.space.scaled(row, 1), self.best[self.leader])
    }

    fn advance(&mut self) {
        let iteration = self.counters.iteration;
        let share = iteration as f64 / (self.settings.iterations.max(2) - 1) as f64;
        let mut order: Vec<usize> = (0..self.settings.population).collect();
        order.sort_by(|&a, &b| self.best[a].order(&self.best[b]));
        let elite = ((self.settings.population as f64 * ELITE_SHARE) as usize).max(2);
        let elite = &order[..elite.min(order.len())];
        let (settings, random) = (&self.settings, self.random);
        let (bests, leader) = (&self.best_position, self.leader);
        // No particle's move changes another's.
        self.particles.each().for_each(|mut particle| {
            let (when, who) = (iteration as u32, particle.number as u32);
            let coin = random.uniform(Purpose::Coin as u32, when, who, 0);
            if coin < settings.difference_share {
                difference_move(&mut particle, (bests, elite), settings.population, random, when);
            } else {
                let d = particle.position.len();
                let best = |p: usize| &bests[p * d..(p + 1) * d];
                let towards = (best(particle.number), best(leader));
                particle.pull(towards, settings, (share, iteration), random);
            }
        });
        for particle in 0..settings.population {
            let mutation = settings.mutation;
            self.particles
                .mutate(particle, mutation, (share, iteration), random, &mut self.trials);
        }
    }
}

/// From a particle's own best towards one of the elite, plus the difference of two others' bests; only some coordinates move, so that
/// what is good already is not all given up at once.
fn difference_move(
    particle: &mut Particle<'_>,
    (bests, elite): (&[f64], &[usize]),
    population: usize,
    random: Random,
    when: u32,
) {
    let who = particle.number as u32;
    let purpose = Purpose::Difference as u32;
    let d = particle.position.len();
    let uniform = |index: u32| random.uniform(purpose, when, who, index);
    let pick = |index: u32| random.below(population, purpose, when, who, index);
    let towards = elite[random.below(elite.len(), purpose, when, who, 0)];
    let (first, second) = (pick(1), pick(2));
    let scale = 0.4 + 0.5 * uniform(3);
    let crossover = if uniform(4) < 0.5 { 0.9 } else { 0.3 };
    let always = random.below(d, purpose, when, who, 5);
    for k in 0..d {
        let at = |p: usize| bests[p * d + k];
        let own = at(particle.number);
        let moved = own + scale * (at(towards) - own) + scale * (at(first) - at(second));
        let take = k == always || uniform(8 + k as u32) < crossover;
        let target = if take { half_way_back(own, moved) } else { own };
        particle.velocity[k] = target - particle.position[k];
        particle.position[k] = target;
    }
}

impl AcceptsMigrants for Pso {
    /// Each becomes the best of the particle whose best is worst, if it is better.
    fn accept_migrants(&mut self, migrants: &Front) {
        for (candidate, worth) in migrants.singles() {
            let worst = (0..self.best.len()).max_by(|&a, &b| self.best[a].order(&self.best[b]));
            let Some(worst) = worst.filter(|&p| worth < self.best[p]) else {
                continue;
            };
            let place = self.particles.row(worst);
            self.best_position[place].copy_from_slice(&self.particles.space.position(candidate));
            self.best[worst] = worth;
            if worth < self.best[self.leader] {
                self.leader = worst;
            }
        }
    }

    fn islands_to_checkpoint(islands: &Islands<Self>) -> Result<Vec<u8>> {
        to_bytes(islands)
    }
}

impl Optimiser for Pso {
    fn ask(&mut self) -> Vec<f64> {
        self.trials.candidates(&self.particles)
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        let asked = self.particles.count + self.trials.len();
        evaluation.check(asked, 1)?;
        let d = self.particles.dimensions();
        let worths = evaluation.worths(1);
        let rows = self.trials.settle(&mut self.particles, evaluation, 1);
        for (particle, worth) in rows.into_iter().map(|row| worths[row]).enumerate() {
            if worth < self.best[particle] {
                self.best[particle] = worth;
                let range = particle * d..(particle + 1) * d;
                self.best_position[range.clone()].copy_from_slice(&self.particles.position[range]);
            }
            if self.best[particle] < self.best[self.leader] {
                self.leader = particle;
            }
        }
        self.counters.told(asked);
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
        vec![self.best[self.leader].cost]
    }
}
