//! Multi-objective particle swarm with an archive of leaders.

mod few;
pub(super) mod filter;
pub(super) mod flock;
mod many;
pub(super) mod sieve;

use super::archive::Archive;
use super::settings::MopsoSettings;
use super::{Front, Optimiser, Welcome};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem};
use few::Few;
pub use flock::Generation;
use many::Many;
pub(super) use many::{leaders, learn_from};
use serde::{Deserialize, Serialize};

/// From this many particles on, a swarm of two or three objectives is kept in single precision and moved in lanes and
/// threads.
pub const MANY: usize = 4096;

/// A swarm that follows an archive of non-dominated solutions (references 4 and 5 of [`super`]).
///
/// With fewer than [`MANY`] particles it is kept in `f64` and told one candidate after the other. From there on it is
/// kept in `f32` (a coordinate to 6e-8 of its range), `4 (3 d + m)` bytes to a particle of `d` variables and `m`
/// objectives, and a generation costs time in proportion to the particles: moved in lanes and threads, filtered and
/// not ranked, the archive told only what may enter it. Results do not depend on the threads or the lanes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Mopso {
    kind: Kind,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum Kind {
    Few(Few),
    Many(Many),
}

impl Mopso {
    /// A swarm over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: MopsoSettings) -> Result<Self> {
        let many = settings.motion.population >= MANY
            && (2..=3).contains(&problem.objectives.len())
            && problem.variables.iter().any(|v| v.upper > v.lower);
        Ok(Self {
            kind: if many {
                Kind::Many(Many::new(problem, settings)?)
            } else {
                Kind::Few(Few::new(problem, settings)?)
            },
        })
    }

    /// Puts the first particles at these candidates (in the variables' units), before the first population is asked for.
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) {
        match &mut self.kind {
            Kind::Few(few) => few.start_from(candidates),
            Kind::Many(many) => many.start_from(candidates),
        }
    }

    /// The archive; its positions are in the unit cube, see [`Mopso::archive_candidates`].
    pub fn archive(&self) -> &Archive {
        match &self.kind {
            Kind::Few(few) => few.archive(),
            Kind::Many(many) => many.archive(),
        }
    }

    /// The archive's positions in the variables' units, one row per member.
    pub fn archive_candidates(&self) -> Vec<Vec<f64>> {
        self.front().candidates
    }

    /// Memory of the swarm's state, bytes to a particle; the archive is beside it.
    pub fn bytes_per_particle(&self) -> usize {
        match &self.kind {
            Kind::Few(few) => few.bytes_per_particle(),
            Kind::Many(many) => many.bytes_per_particle(),
        }
    }

    fn present(&self) -> &dyn Optimiser {
        match &self.kind {
            Kind::Few(few) => few,
            Kind::Many(many) => many,
        }
    }
}

impl Welcome for Mopso {
    fn violation(&self) -> f64 {
        self.archive().violation()
    }

    fn welcome(&mut self, migrants: &Front, violation: f64) {
        match &mut self.kind {
            Kind::Few(few) => few.welcome(migrants, violation),
            Kind::Many(many) => many.welcome(migrants, violation),
        }
    }
}

impl Optimiser for Mopso {
    fn ask(&mut self) -> Vec<f64> {
        match &mut self.kind {
            Kind::Few(few) => few.ask(),
            Kind::Many(many) => many.ask(),
        }
    }

    fn tell(&mut self, evaluation: &Evaluation) {
        match &mut self.kind {
            Kind::Few(few) => few.tell(evaluation),
            Kind::Many(many) => many.tell(evaluation),
        }
    }

    fn iteration(&self) -> usize {
        self.present().iteration()
    }

    fn planned_iterations(&self) -> usize {
        self.present().planned_iterations()
    }

    fn evaluations(&self) -> u64 {
        self.present().evaluations()
    }

    fn best(&self) -> Vec<f64> {
        self.present().best()
    }

    fn front(&self) -> Front {
        self.present().front()
    }
}
