//! What all swarms share: particles in the unit cube, their velocities, and the pulls on them.

use super::metrics::dominates;
use super::settings::{BoundHandling, Constriction, DRAWN_PULLS, Mutation, PsoSettings, Randomness};
use super::space::Space;
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem};
use crate::random::Random;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// What random draws are for, the counter's last word.
#[derive(Clone, Copy)]
#[repr(u32)]
pub(super) enum Purpose {
    Start = 1,
    Cognitive,
    Social,
    Leader,
    Mutation,
    Difference,
    Coin,
    Pulls,
    Recombine,
    Niche,
}

/// Positions and velocities, row-major, in the unit cube.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Particles {
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    pub space: Space,
    pub count: usize,
}

impl Particles {
    /// Uniform over the cube, at rest.
    ///
    /// # Errors
    /// Those of [`Space::new`].
    pub fn scattered(problem: &Problem, count: usize, random: Random) -> Result<Self> {
        Ok(Self::scattered_in(Space::new(problem)?, count, random))
    }

    /// Uniform over the cube `space`, at rest.
    pub fn scattered_in(space: Space, count: usize, random: Random) -> Self {
        let d = space.dimensions();
        let draw = |i: usize| random.uniform(Purpose::Start as u32, 0, (i / d) as u32, (i % d) as u32);
        Self {
            position: (0..count * d).map(draw).collect(),
            velocity: vec![0.0; count * d],
            space,
            count,
        }
    }

    /// Puts a particle anywhere in the cube, at rest.
    pub fn rescatter(&mut self, particle: usize, iteration: usize, random: Random) {
        for (k, i) in self.row(particle).enumerate() {
            let (when, who) = (iteration as u32, particle as u32);
            self.position[i] = random.uniform(Purpose::Start as u32, when, who, k as u32);
            self.velocity[i] = 0.0;
        }
    }

    pub fn dimensions(&self) -> usize {
        self.space.dimensions()
    }

    /// Where the coordinates of a particle lie.
    pub fn row(&self, particle: usize) -> Range<usize> {
        let d = self.dimensions();
        particle * d..(particle + 1) * d
    }

    /// The candidates that the particles stand for.
    pub fn candidates(&self) -> Vec<f64> {
        self.space.scaled(&self.position, self.count)
    }

    /// Mutates one particle, or makes a trial beside it, at the share of the run and in the iteration.
    pub fn mutate(
        &mut self,
        particle: usize,
        mutation: Mutation,
        (share, iteration): (f64, usize),
        random: Random,
        trials: &mut Trials,
    ) {
        let (when, who) = (iteration as u32, particle as u32);
        let uniform = |index| random.uniform(Purpose::Mutation as u32, when, who, index);
        let d = self.dimensions();
        let mu = match mutation {
            Mutation::None => return,
            Mutation::Fixed(mu) => mu,
            Mutation::Random => uniform(0).max(1e-3),
            Mutation::Polynomial { share, index } => {
                if uniform(0) < share {
                    for (k, i) in self.row(particle).enumerate() {
                        if uniform(1 + 2 * k as u32) * (d as f64) < 1.0 {
                            self.position[i] = polynomial(self.position[i], uniform(2 + 2 * k as u32), index);
                        }
                    }
                }
                return;
            }
        };
        // A range that shrinks over the run (equation 5.13 of the thesis).
        let probability = (1.0 - share.min(1.0)).powf(1.0 / mu);
        if d == 0 || uniform(1) >= probability {
            return;
        }
        let k = random.below(d, Purpose::Mutation as u32, when, who, 2);
        let mut trial = self.position[self.row(particle)].to_vec();
        let (low, high) = (
            (trial[k] - probability).max(0.0),
            (trial[k] + probability).min(1.0),
        );
        trial[k] = low + uniform(3) * (high - low);
        trials.of.push(particle);
        trials.position.extend(trial);
    }

    /// A particle, to be moved.
    pub fn one(&mut self, particle: usize) -> Particle<'_> {
        let row = self.row(particle);
        Particle {
            number: particle,
            position: &mut self.position[row.clone()],
            velocity: &mut self.velocity[row],
        }
    }

    /// All particles, to be moved in threads.
    pub fn each(&mut self) -> impl IndexedParallelIterator<Item = Particle<'_>> {
        let d = self.dimensions().max(1);
        let rows = self
            .position
            .par_chunks_mut(d)
            .zip(self.velocity.par_chunks_mut(d));
        let each = rows.enumerate().map(|(number, (position, velocity))| Particle {
            number,
            position,
            velocity,
        });
        each.with_min_len((MOVED_TOGETHER / d).max(1))
    }
}

/// Coordinates that a thread moves in a row: fewer take no longer than to share them out.
const MOVED_TOGETHER: usize = 4096;

/// One particle.
pub(super) struct Particle<'a> {
    pub number: usize,
    pub position: &'a mut [f64],
    pub velocity: &'a mut [f64],
}

impl Particle<'_> {
    /// Moves it: inertia, a pull to its own best and a pull to its leader (equations 5.6-5.8 of the
    /// thesis; \[1, 2\]), shortened as the settings say.
    pub fn pull(
        &mut self,
        (own, leader): (&[f64], &[f64]),
        settings: &PsoSettings,
        (share, iteration): (f64, usize),
        random: Random,
    ) {
        let uniform = |purpose: Purpose, index: usize| {
            random.uniform(purpose as u32, iteration as u32, self.number as u32, index as u32)
        };
        let (w, c1, c2) = match settings.constriction {
            Constriction::None => (
                settings.inertia.at(share),
                settings.cognitive.at(share),
                settings.social.at(share),
            ),
            Constriction::Clerc => {
                let (c1, c2) = (settings.cognitive.at(share), settings.social.at(share));
                let chi = constriction(c1 + c2).abs();
                (chi, chi * c1, chi * c2)
            }
            Constriction::Signed => {
                let [least, most] = DRAWN_PULLS;
                let [c1, c2] = [0, 1].map(|k| least + (most - least) * uniform(Purpose::Pulls, k));
                let chi = constriction(c1 + c2);
                (chi * settings.inertia.at(share), chi * c1, chi * c2)
            }
        };
        for k in 0..self.position.len() {
            let index = match settings.randomness {
                Randomness::PerDimension => k,
                Randomness::PerParticle => 0,
            };
            let x = self.position[k];
            let velocity = w * self.velocity[k]
                + c1 * uniform(Purpose::Cognitive, index) * (own[k] - x)
                + c2 * uniform(Purpose::Social, index) * (leader[k] - x);
            let velocity = velocity.clamp(-settings.speed_limit, settings.speed_limit);
            let moved = x + velocity;
            let inside = moved.clamp(0.0, 1.0);
            let kept = match settings.bounds {
                _ if inside == moved => 1.0,
                BoundHandling::Absorb => 0.0,
                BoundHandling::Bounce => -0.5,
                BoundHandling::Reverse => -1.0,
            };
            self.velocity[k] = velocity * kept;
            self.position[k] = inside;
        }
    }
}

/// A coordinate that has moved, or half-way from the own one to the bound that was overstepped, which keeps the spread of the swarm.
pub(super) fn half_way_back(own: f64, moved: f64) -> f64 {
    if moved < 0.0 {
        0.5 * own
    } else if moved > 1.0 {
        0.5 * (own + 1.0)
    } else {
        moved
    }
}

/// Trials beside particles, for which an evaluation has rows after those of the particles.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Trials {
    of: Vec<usize>,
    position: Vec<f64>,
}

impl Trials {
    pub fn len(&self) -> usize {
        self.of.len()
    }

    /// The candidates that particles and trials stand for.
    pub fn candidates(&self, particles: &Particles) -> Vec<f64> {
        let mut candidates = particles.candidates();
        candidates.extend(particles.space.scaled(&self.position, self.len()));
        candidates
    }

    /// Puts particles where a trial dominates them, forgets all trials, and says for each particle which row of the evaluation
    /// is its own then.
    pub fn settle(
        &mut self,
        particles: &mut Particles,
        evaluation: &Evaluation,
        objectives: usize,
    ) -> Vec<usize> {
        let mut rows: Vec<usize> = (0..particles.count).collect();
        let Self { of, position } = std::mem::take(self);
        for (j, particle) in of.into_iter().enumerate() {
            let trial = particles.count + j;
            let Some(tried) = evaluation.success(trial, objectives) else {
                continue;
            };
            let better = evaluation.success(particle, objectives).is_none_or(|own| {
                let [before, after] = [particle, trial].map(|row| evaluation.violation(row));
                after < before || (after == before && dominates(tried, own))
            });
            if better {
                let d = particles.dimensions();
                let place = particles.row(particle);
                particles.position[place].copy_from_slice(&position[j * d..(j + 1) * d]);
                rows[particle] = trial;
            }
        }
        rows
    }
}

/// The coefficient of constriction of pulls that add up to `phi`, with its sign: one up to four, negative beyond
/// (\[3\], equation 4 of \[6\]).
pub(super) fn constriction(phi: f64) -> f64 {
    if phi > 4.0 {
        2.0 / (2.0 - phi - (phi * phi - 4.0 * phi).sqrt())
    } else {
        1.0
    }
}

/// Polynomial mutation of a coordinate of the unit cube that `uniform` disturbs (Deb, Agrawal 1999; the form of
/// \[5\] that keeps to the bounds).
pub(super) fn polynomial(x: f64, uniform: f64, index: f64) -> f64 {
    let power = 1.0 / (index + 1.0);
    let step = if uniform < 0.5 {
        let base = 2.0 * uniform + (1.0 - 2.0 * uniform) * (1.0 - x).powf(index + 1.0);
        base.powf(power) - 1.0
    } else {
        let base = 2.0 * (1.0 - uniform) + (2.0 * uniform - 1.0) * x.powf(index + 1.0);
        1.0 - base.powf(power)
    };
    (x + step).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Objective, Variable};

    /// At the start of a run every particle has a trial, in one dimension. Those that dominate take their particles' places.
    #[test]
    fn trials_take_the_places_of_what_they_dominate() {
        let problem = Problem {
            variables: ["a", "b"].map(|name| Variable::new(name, "-", 0.0, 1.0)).to_vec(),
            objectives: ["f", "g"].map(|name| Objective::new(name, "-")).to_vec(),
        };
        let random = Random::new(3);
        let mut particles = Particles::scattered(&problem, 4, random).expect("particles");
        let mut trials = Trials::default();
        for particle in 0..4 {
            particles.mutate(particle, Mutation::Fixed(0.5), (0.0, 1), random, &mut trials);
        }
        assert_eq!(trials.len(), 4);
        let candidates = trials.candidates(&particles);
        assert_eq!(candidates.len(), 2 * 8);
        let row = |k: usize| &candidates[2 * k..2 * k + 2];
        for particle in 0..4 {
            let moved = row(particle)
                .iter()
                .zip(row(4 + particle))
                .filter(|(a, b)| a != b);
            assert_eq!(moved.count(), 1, "one dimension of particle {particle}");
        }
        // Better in both, better in one, equal, and beside a particle that failed.
        let own = [[1.0, 1.0], [1.0, 1.0], [1.0, 1.0], [f64::NAN; 2]];
        let tried = [[0.5, 0.5], [0.5, 2.0], [1.0, 1.0], [9.0, 9.0]];
        let evaluation = Evaluation::of_rows(
            [own, tried]
                .concat()
                .iter()
                .map(|row| (row.to_vec(), None))
                .collect(),
        );
        let rows = trials.settle(&mut particles, &evaluation, 2);
        assert_eq!(rows, [4, 1, 2, 7]);
        assert_eq!(trials.len(), 0);
        let settled = particles.candidates();
        for (particle, of) in rows.into_iter().enumerate() {
            assert_eq!(&settled[2 * particle..2 * particle + 2], row(of));
        }
    }
}
