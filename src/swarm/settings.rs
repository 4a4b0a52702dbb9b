//! Settings of the swarms, validated in one place.

use crate::error::{Error, Result};

/// A coefficient that may change over the run.
#[derive(Clone, Copy, Debug, PartialEq)]
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
    /// The value `share` of the way through the run.
    pub fn at(self, share: f64) -> f64 {
        match self {
            Self::Fixed(value) => value,
            Self::Linear { from, to } => from + (to - from) * share,
        }
    }

    fn ends(self) -> [f64; 2] {
        [self.at(0.0), self.at(1.0)]
    }
}

/// How many random numbers a particle draws for each pull.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Randomness {
    /// One for each dimension, as in the first papers and the thesis.
    PerDimension,
    /// One for all dimensions, which does not favour the axes.
    PerParticle,
}

/// What becomes of a particle that would leave its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundHandling {
    /// It stops at the bound and its velocity there becomes nought.
    Absorb,
    /// It stops at the bound and its velocity there is reversed and halved.
    Bounce,
}

/// Settings of [`super::Pso`].
#[derive(Clone, Debug, PartialEq)]
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
    /// Random numbers of the pulls.
    pub randomness: Randomness,
    /// Greatest speed, as a share of the range per iteration.
    pub speed_limit: f64,
    /// What happens at the bounds.
    pub bounds: BoundHandling,
    /// Share of the moves that are difference moves \[7\]: from a particle's best towards one of the swarm's best
    /// particles, plus the difference of two others' bests. They follow valleys that run across the axes, where
    /// the pulls of a swarm alone stall. Nought gives the plain swarm.
    pub difference_share: f64,
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
            randomness: Randomness::PerDimension,
            speed_limit: 0.5,
            bounds: BoundHandling::Bounce,
            difference_share: 0.8,
        }
    }
}

impl PsoSettings {
    /// The thesis's swarm: inertia 0.5 to 0.1, c1 1.5, c2 2.5, a random number per dimension.
    pub fn thesis() -> Self {
        Self {
            population: 50,
            iterations: 100,
            speed_limit: 1.0,
            bounds: BoundHandling::Absorb,
            difference_share: 0.0,
            ..Self::default()
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
        Ok(())
    }
}

/// How a particle of [`super::Mopso`] chooses whom to follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leaders {
    /// The less crowded of two archive members drawn at random \[5, 6\].
    CrowdingTournament,
    /// Any archive member.
    Random,
}

/// The exponent `mu` of the mutation's decline \[4\]: a particle mutates with probability
/// `(1 - t)^(1/mu)` at the share `t` of the run, in one dimension, within that share of the range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mutation {
    /// No mutation.
    None,
    /// A fixed `mu`.
    Fixed(f64),
    /// A `mu` drawn anew for each particle and iteration, between nought and one.
    Random,
}

/// Settings of [`super::Mopso`].
#[derive(Clone, Debug, PartialEq)]
pub struct MopsoSettings {
    /// The motion's settings; `difference_share` is not used.
    pub motion: PsoSettings,
    /// Most members of the archive.
    pub archive: usize,
    /// Choice of leaders.
    pub leaders: Leaders,
    /// Mutation.
    pub mutation: Mutation,
}

impl Default for MopsoSettings {
    fn default() -> Self {
        Self {
            motion: PsoSettings {
                difference_share: 0.0,
                ..PsoSettings::default()
            },
            archive: 100,
            leaders: Leaders::CrowdingTournament,
            mutation: Mutation::Fixed(0.3),
        }
    }
}

impl MopsoSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        self.motion.validate()?;
        if self.archive < 2 {
            return Err(setting("archive", self.archive.to_string(), "2 or more"));
        }
        if let Mutation::Fixed(mu) = self.mutation
            && !(mu > 0.0 && mu <= 10.0)
        {
            return Err(setting("mutation", mu.to_string(), "a number above 0 up to 10"));
        }
        Ok(())
    }
}

fn setting(name: &str, found: String, expected: &str) -> Error {
    Error::input("the swarm's settings", name, found, expected)
}
