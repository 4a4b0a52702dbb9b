//! What all swarms share: particles in the unit cube, their velocities, and the pulls on them.

use super::settings::{BoundHandling, PsoSettings, Randomness};
use crate::evaluate::Variable;
use crate::random::Random;

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
}

/// Positions and velocities, row-major, in shares of the ranges.
#[derive(Clone, Debug)]
pub(super) struct Particles {
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    lower: Vec<f64>,
    range: Vec<f64>,
}

impl Particles {
    /// Uniform over the cube, at rest.
    pub fn scattered(variables: &[Variable], count: usize, random: Random) -> Self {
        let d = variables.len();
        let draw = |i: usize| {
            random.uniform(
                Purpose::Start as u32,
                0,
                (i / d.max(1)) as u32,
                (i % d.max(1)) as u32,
            )
        };
        Self {
            position: (0..count * d).map(draw).collect(),
            velocity: vec![0.0; count * d],
            lower: variables.iter().map(|v| v.lower).collect(),
            range: variables.iter().map(|v| v.upper - v.lower).collect(),
        }
    }

    pub fn dimensions(&self) -> usize {
        self.lower.len()
    }

    /// Positions in the variables' units.
    pub fn scaled(&self, position: &[f64]) -> Vec<f64> {
        let bounds = self.lower.iter().zip(&self.range).cycle();
        position
            .iter()
            .zip(bounds)
            .map(|(x, (lower, range))| (lower + x * range).min(lower + range))
            .collect()
    }

    /// Moves one particle: inertia, a pull to its own best and a pull to its leader (equations 5.6-5.8 of the
    /// thesis; \[1, 2\]).
    pub fn pull(
        &mut self,
        particle: usize,
        (own, leader): (&[f64], &[f64]),
        settings: &PsoSettings,
        (share, iteration): (f64, usize),
        random: Random,
    ) {
        let d = self.dimensions();
        let (w, c1, c2) = (
            settings.inertia.at(share),
            settings.cognitive.at(share),
            settings.social.at(share),
        );
        let draw = |purpose: Purpose, k: usize| {
            let index = match settings.randomness {
                Randomness::PerDimension => k as u32,
                Randomness::PerParticle => 0,
            };
            random.uniform(purpose as u32, iteration as u32, particle as u32, index)
        };
        for k in 0..d {
            let i = particle * d + k;
            let x = self.position[i];
            let velocity = w * self.velocity[i]
                + c1 * draw(Purpose::Cognitive, k) * (own[k] - x)
                + c2 * draw(Purpose::Social, k) * (leader[k] - x);
            self.velocity[i] = velocity.clamp(-settings.speed_limit, settings.speed_limit);
            self.position[i] = x + self.velocity[i];
            self.confine(i, settings.bounds);
        }
    }

    /// Brings one coordinate back into the cube.
    pub fn confine(&mut self, i: usize, handling: BoundHandling) {
        let inside = self.position[i].clamp(0.0, 1.0);
        if inside != self.position[i] {
            self.position[i] = inside;
            self.velocity[i] *= match handling {
                BoundHandling::Absorb => 0.0,
                BoundHandling::Bounce => -0.5,
            };
        }
    }
}
