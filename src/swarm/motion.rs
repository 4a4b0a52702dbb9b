//! What all swarms share: particles in the unit cube, their velocities, and the pulls on them.

use super::settings::{BoundHandling, Constriction, DRAWN_PULLS, PsoSettings, Randomness};
use super::space::Space;
use crate::error::Result;
use crate::evaluate::Problem;
use crate::random::Random;
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

    /// Moves one particle: inertia, a pull to its own best and a pull to its leader (equations 5.6-5.8 of the
    /// thesis; \[1, 2\]), shortened as the settings say.
    pub fn pull(
        &mut self,
        particle: usize,
        (own, leader): (&[f64], &[f64]),
        settings: &PsoSettings,
        (share, iteration): (f64, usize),
        random: Random,
    ) {
        let uniform = |purpose: Purpose, index: usize| {
            random.uniform(purpose as u32, iteration as u32, particle as u32, index as u32)
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
        for k in 0..self.dimensions() {
            let index = match settings.randomness {
                Randomness::PerDimension => k,
                Randomness::PerParticle => 0,
            };
            let i = particle * self.dimensions() + k;
            let x = self.position[i];
            let velocity = w * self.velocity[i]
                + c1 * uniform(Purpose::Cognitive, index) * (own[k] - x)
                + c2 * uniform(Purpose::Social, index) * (leader[k] - x);
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
                BoundHandling::Reverse => -1.0,
            };
        }
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
