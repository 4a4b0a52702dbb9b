//! Settings of the swarms, validated in one place.

use super::archive::MOST_MEASURED;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// A coefficient that may change over the run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Schedule {
    /// The same throughout.
    Fixed(f64),
    /// Linear from the first to the last iteration.
    Linear {
        /// Value at the first iteration.
        from: f64,
        /// Value at the last.
        to: f64,
    },
}

impl Schedule {
    /// The value `share` of the way through the run; beyond its ends, the value there.
    pub fn at(self, share: f64) -> f64 {
        match self {
            Self::Fixed(value) => value,
            Self::Linear { from, to } => from + (to - from) * share.clamp(0.0, 1.0),
        }
    }

    fn ends(self) -> [f64; 2] {
        [self.at(0.0), self.at(1.0)]
    }
}

/// How many random numbers a particle draws for each pull.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Randomness {
    /// One for each dimension, as in the first papers and the thesis.
    PerDimension,
    /// One for all dimensions, which does not favour the axes.
    PerParticle,
}

/// What becomes of a particle that would leave its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum BoundHandling {
    /// It stops at the bound and its velocity there becomes zero.
    Absorb,
    /// It stops at the bound and its velocity there is reversed and halved.
    Bounce,
    /// It stops at the bound and its velocity there is reversed.
    Reverse,
}

/// Whether the step of a particle is shortened as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Constriction {
    /// By the inertia only.
    None,
    /// By the coefficient of Clerc and Kennedy \[3\] for the sum of the pulls; the inertia is then one.
    Clerc,
    /// As in SMPSO \[6\]: the pulls are drawn for each particle and iteration, uniformly between
    /// [`DRAWN_PULLS`], and the coefficient is used with its sign, which turns the step round where they add up to
    /// more than four.
    Signed,
}

/// Bounds of the pulls that [`Constriction::Signed`] draws.
pub const DRAWN_PULLS: [f64; 2] = [1.5, 2.5];

/// Settings of [`super::Pso`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PsoSettings {
    /// Particles.
    pub population: usize,
    /// Iterations, the first random population counted.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Inertia weight `w` \[2\].
    pub inertia: Schedule,
    /// Pull `c1` towards a particle's own best.
    pub cognitive: Schedule,
    /// Pull `c2` towards the swarm's best.
    pub social: Schedule,
    /// Shortening of the step.
    pub constriction: Constriction,
    /// Random numbers of the pulls.
    pub randomness: Randomness,
    /// Greatest speed, as a share of the range per iteration.
    pub speed_limit: f64,
    /// What happens at the bounds.
    pub bounds: BoundHandling,
    /// Share of the moves that are difference moves \[7\]: from a particle's best towards one of the swarm's best
    /// particles, plus the difference of two others' bests. They follow valleys that run across the axes, where
    /// the pulls of a swarm alone stall. Zero gives the plain swarm.
    pub difference_share: f64,
    /// Mutation.
    pub mutation: Mutation,
}

impl Default for PsoSettings {
    fn default() -> Self {
        Self {
            population: 128,
            iterations: 300,
            seed: 1,
            inertia: Schedule::Linear { from: 0.5, to: 0.1 },
            cognitive: Schedule::Fixed(1.5),
            social: Schedule::Fixed(2.5),
            constriction: Constriction::None,
            randomness: Randomness::PerDimension,
            speed_limit: 0.5,
            bounds: BoundHandling::Bounce,
            difference_share: 0.8,
            mutation: Mutation::None,
        }
    }
}

impl PsoSettings {
    /// The thesis's swarm for one objective of an identification: inertia 0.5 to 0.1, c1 and c2 2, a random number per dimension.
    pub fn thesis() -> Self {
        Self {
            population: 50,
            iterations: 100,
            cognitive: Schedule::Fixed(2.0),
            social: Schedule::Fixed(2.0),
            speed_limit: 1.0,
            bounds: BoundHandling::Absorb,
            difference_share: 0.0,
            ..Self::default()
        }
    }

    /// The thesis's swarm for one objective of a line: inertia 0.1 to 1, c1 3, c2 1, mutation with `mu` 0.95.
    pub fn thesis_lines() -> Self {
        Self {
            inertia: Schedule::Linear { from: 0.1, to: 1.0 },
            cognitive: Schedule::Fixed(3.0),
            social: Schedule::Fixed(1.0),
            mutation: Mutation::Fixed(0.95),
            ..Self::thesis()
        }
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        let counts = [
            ("population", self.population, 2),
            ("iterations", self.iterations, 1),
        ];
        for (name, value, least) in counts {
            if value < least {
                return Err(setting(name, value.to_string(), &format!("{least} or more")));
            }
        }
        let coefficients = [
            ("inertia", self.inertia),
            ("cognitive", self.cognitive),
            ("social", self.social),
        ];
        for (name, schedule) in coefficients {
            if schedule.ends().iter().any(|x| !(0.0..=10.0).contains(x)) {
                return Err(setting(name, format!("{schedule:?}"), "numbers from 0 to 10"));
            }
        }
        if !(self.speed_limit > 0.0 && self.speed_limit <= 10.0) {
            return Err(setting(
                "speed_limit",
                self.speed_limit.to_string(),
                "a number above 0 up to 10",
            ));
        }
        if !(0.0..=1.0).contains(&self.difference_share) {
            return Err(setting(
                "difference_share",
                self.difference_share.to_string(),
                "a share from 0 to 1",
            ));
        }
        match self.mutation {
            Mutation::Fixed(mu) if !(mu > 0.0 && mu <= 10.0) => {
                Err(setting("mutation", mu.to_string(), "a number above 0 up to 10"))
            }
            Mutation::Polynomial { share, index } if !((0.0..=1.0).contains(&share) && index >= 0.0) => {
                let found = format!("a share of {share}, an index of {index}");
                Err(setting("mutation", found, "a share from 0 to 1, an index from 0"))
            }
            _ => Ok(()),
        }
    }
}

/// How a particle of [`super::Mopso`] chooses whom to follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Leaders {
    /// Of two archive members drawn at random the one that the archive would miss more \[5, 6\].
    Tournament,
    /// Any archive member.
    Random,
}

/// The measure by which a full archive removes members, one at a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Truncation {
    /// The least crowding distance \[5\].
    Crowding,
    /// The least volume that a member alone dominates \[8\], for up to five objectives. In an archive of more than 1,000 members
    /// without a reference it is for up to four. Beyond, it is `MutualNearest`.
    Contribution,
    /// The least distance to the nearest neighbour, then to the next \[9\].
    MutualNearest,
}

/// What disturbs a particle after its move: the particle itself, or a trial beside it, which takes its place if it dominates it
/// (less violation, or no objective worse and one better). Each trial is an evaluation more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Mutation {
    /// Nothing.
    None,
    /// With probability `(1 - t)^(1/mu)` at the share `t` of the run, a trial in one dimension, drawn within that share of the
    /// range \[4\], with this exponent `mu`. For swarms on the host.
    Fixed(f64),
    /// The same with a `mu` drawn for each particle and iteration, between zero and one.
    Random,
    /// Polynomial mutation \[5\] of this share of the particles, each of whose dimensions is disturbed with
    /// probability one over their number.
    Polynomial {
        /// Share of the particles.
        share: f64,
        /// Distribution index: the greater, the smaller the disturbance.
        index: f64,
    },
}

impl Mutation {
    /// Whether it makes trials.
    pub(super) fn tries(self) -> bool {
        matches!(self, Self::Fixed(_) | Self::Random)
    }

    /// Polynomial mutation with the constants of SMPSO \[6\].
    pub const SMPSO: Self = Self::Polynomial {
        share: 1.0 / 6.0,
        index: 20.0,
    };
}

/// Settings of [`super::Mopso`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MopsoSettings {
    /// The motion's settings. A difference move goes from an archive member along the difference of two others
    /// \[7\]. Their share is where the swarm begins: it makes more or fewer of them by what they earn, and crossings of two members
    /// besides, as genetic algorithms do. A share of zero or one stays. In these moves the particles' own bests stand in for the members
    /// that the archive lacks, and for all of them while constraints leave it less than half full. In a swarm of [`super::MANY`] particles
    /// and more they do so only while constraints leave it less than half full, for those that it lacks.
    pub motion: PsoSettings,
    /// Most members of the archive.
    pub archive: usize,
    /// Which members leave a full archive.
    pub truncation: Truncation,
    /// The reference point of contributions, a value for each of up to five objectives. The archive's hypervolume up to this
    /// point then never falls. With `None` the archive chooses the point and keeps the ends of its front.
    pub reference: Option<Vec<f64>>,
    /// Choice of leaders. They are own bests while nothing counts as feasible: of two at random the one that violates less. Where
    /// members leave by contribution and no reference is given, the ends of the front win every tournament of a swarm of fewer
    /// than [`super::MANY`] particles.
    pub leaders: Leaders,
    /// Whether half of the particles ignore constraints at first and take them back step by step \[10\]. They ignore them for three
    /// tenths of the planned iterations at most, and take them back over half of these.
    pub push_and_pull: bool,
}

impl Default for MopsoSettings {
    /// The best found for two and three objectives over the test problems: the motion of SMPSO, some difference
    /// moves, and an archive by contribution.
    fn default() -> Self {
        let smpso = Self::smpso();
        Self {
            motion: PsoSettings {
                bounds: BoundHandling::Absorb,
                difference_share: 0.25,
                ..smpso.motion
            },
            truncation: Truncation::Contribution,
            push_and_pull: true,
            ..smpso
        }
    }
}

impl MopsoSettings {
    /// SMPSO \[6\], with the constants of its paper.
    pub fn smpso() -> Self {
        Self {
            motion: PsoSettings {
                population: 100,
                iterations: 250,
                seed: 1,
                inertia: Schedule::Fixed(0.1),
                cognitive: Schedule::Fixed(2.0),
                social: Schedule::Fixed(2.0),
                constriction: Constriction::Signed,
                randomness: Randomness::PerParticle,
                speed_limit: 0.5,
                bounds: BoundHandling::Reverse,
                difference_share: 0.0,
                mutation: Mutation::SMPSO,
            },
            archive: 100,
            truncation: Truncation::Crowding,
            reference: None,
            leaders: Leaders::Tournament,
            push_and_pull: false,
        }
    }

    /// The same with so many particles and iterations.
    #[must_use]
    pub fn with_size(mut self, population: usize, iterations: usize) -> Self {
        (self.motion.population, self.motion.iterations) = (population, iterations);
        self
    }

    /// The same from this seed.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.motion.seed = seed;
        self
    }

    /// For one objective, with an archive of the best alone: a plain particle swarm that can live on a device.
    pub(crate) fn of_one_objective(motion: PsoSettings) -> Self {
        Self {
            motion,
            archive: 2,
            ..Self::thesis()
        }
    }

    /// The thesis's swarm for several objectives: inertia 0.5 to 0.1, c1 1.5, c2 2.5, mutation with `mu` 0.3.
    pub fn thesis() -> Self {
        Self {
            motion: PsoSettings {
                cognitive: Schedule::Fixed(1.5),
                social: Schedule::Fixed(2.5),
                mutation: Mutation::Fixed(0.3),
                ..PsoSettings::thesis()
            },
            archive: 100,
            truncation: Truncation::Crowding,
            reference: None,
            leaders: Leaders::Tournament,
            push_and_pull: false,
        }
    }

    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        self.motion.validate()?;
        if self.archive < 2 {
            return Err(setting("archive", self.archive.to_string(), "2 or more"));
        }
        if let Some(reference) = &self.reference {
            let found = format!("{reference:?} with truncation by {:?}", self.truncation);
            let expected = "one to five numbers, with truncation by contribution";
            let numbers =
                (1..=MOST_MEASURED).contains(&reference.len()) && reference.iter().all(|x| x.is_finite());
            if !numbers || self.truncation != Truncation::Contribution {
                return Err(setting("reference", found, expected));
            }
        }
        Ok(())
    }
}

pub(super) fn setting(name: &str, found: String, expected: &str) -> Error {
    Error::input("the swarm's settings", name, found, expected)
}
