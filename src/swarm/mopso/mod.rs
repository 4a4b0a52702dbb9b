//! Multi-objective particle swarm with an archive of leaders.

pub(super) mod blocks;
pub(super) mod earnings;
pub(super) mod filter;
pub(super) mod large_swarm;
pub(super) mod relaxation;
mod small_swarm;
pub(super) mod stand_ins;
pub(super) mod thinning;

use super::archive::Archive;
use super::checkpoint::to_bytes;
#[cfg(feature = "gpu")]
use super::device::DeviceState;
use super::settings::MopsoSettings;
use super::{AcceptsMigrants, Counters, Front, Islands, Optimiser};
use crate::error::Result;
use crate::evaluate::{Evaluation, Problem};
pub use blocks::Generation;
use large_swarm::LargeSwarm;
use serde::{Deserialize, Serialize};
use small_swarm::SmallSwarm;

/// From this many particles on, a swarm of two or three objectives, or of one and pulls alone, is kept in single precision and moved
/// in lanes and threads.
pub const MANY: usize = 4096;

/// A swarm that follows an archive of non-dominated solutions (references 4 and 5 of [`super`]).
///
/// With fewer than [`MANY`] particles, or with trials of mutation, the swarm is kept in `f64` and told one candidate after the
/// other. A larger swarm is
/// kept in `f32` (a coordinate to 6e-8 of its range): `4 (3 d + m)` bytes for a particle of `d` variables and `m`
/// objectives. Its generations take time in proportion to the particles: they are moved in lanes and threads and filtered
/// instead of ranked, and the archive is told only what may enter it. Results depend neither on threads nor on lanes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Mopso {
    kind: Kind,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
enum Kind {
    Small(SmallSwarm),
    Large(LargeSwarm),
}

impl Mopso {
    /// A swarm over the variables of `problem`.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub fn new(problem: &Problem, settings: MopsoSettings) -> Result<Self> {
        let motion = &settings.motion;
        let fits = match problem.objectives.len() {
            1 => motion.difference_share <= 0.0,
            objectives => (2..=3).contains(&objectives),
        };
        let many = fits
            && motion.population >= MANY
            && !motion.mutation.tries()
            && problem.variables.iter().any(|v| v.upper > v.lower);
        Ok(Self {
            kind: if many {
                Kind::Large(LargeSwarm::new(problem, settings)?)
            } else {
                Kind::Small(SmallSwarm::new(problem, settings)?)
            },
        })
    }

    /// The same in single precision, however few particles it has: a swarm that can go to a device.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the setting that is out of its range.
    pub(crate) fn in_single_precision(problem: &Problem, settings: MopsoSettings) -> Result<Self> {
        let kind = Kind::Large(LargeSwarm::new(problem, settings)?);
        Ok(Self { kind })
    }

    /// What a device holds of the swarm, if one can hold it.
    #[cfg(feature = "gpu")]
    pub(super) fn to_device(&self) -> Option<DeviceState> {
        match &self.kind {
            Kind::Small(_) => None,
            Kind::Large(swarm) => swarm.to_device(),
        }
    }

    /// The swarm that a device has held.
    #[cfg(feature = "gpu")]
    pub(super) fn from_device(state: DeviceState) -> Self {
        let kind = Kind::Large(LargeSwarm::from_device(state));
        Self { kind }
    }

    /// Lets go of the particles of a large swarm that is done.
    #[cfg(feature = "studies")]
    pub(super) fn let_particles_go(&mut self) {
        if let Kind::Large(swarm) = &mut self.kind {
            swarm.let_particles_go();
        }
    }

    /// Puts the first particles at these candidates (in the variables' units), before the first population is asked for.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming a candidate that is no finite value for each variable.
    pub fn start_from(&mut self, candidates: &[Vec<f64>]) -> Result<()> {
        match &mut self.kind {
            Kind::Small(swarm) => swarm.start_from(candidates),
            Kind::Large(swarm) => swarm.start_from(candidates),
        }
    }

    /// The archive; its positions are in the unit cube, see [`Mopso::archive_candidates`].
    pub fn archive(&self) -> &Archive {
        match &self.kind {
            Kind::Small(swarm) => swarm.archive(),
            Kind::Large(swarm) => swarm.archive(),
        }
    }

    /// The archive's positions in the variables' units, one row per member.
    pub fn archive_candidates(&self) -> Vec<Vec<f64>> {
        self.front().candidates
    }

    /// Memory of the swarm's state, bytes for each particle, without the archive.
    pub fn bytes_per_particle(&self) -> usize {
        match &self.kind {
            Kind::Small(swarm) => swarm.bytes_per_particle(),
            Kind::Large(swarm) => swarm.bytes_per_particle(),
        }
    }

    fn present(&self) -> &dyn Optimiser {
        match &self.kind {
            Kind::Small(swarm) => swarm,
            Kind::Large(swarm) => swarm,
        }
    }
}

impl AcceptsMigrants for Mopso {
    fn accept_migrants(&mut self, migrants: &Front) {
        match &mut self.kind {
            Kind::Small(swarm) => swarm.accept_migrants(migrants),
            Kind::Large(swarm) => swarm.accept_migrants(migrants),
        }
    }

    fn islands_to_checkpoint(islands: &Islands<Self>) -> Result<Vec<u8>> {
        to_bytes(islands)
    }
}

impl Optimiser for Mopso {
    fn ask(&mut self) -> Vec<f64> {
        match &mut self.kind {
            Kind::Small(swarm) => swarm.ask(),
            Kind::Large(swarm) => swarm.ask(),
        }
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        match &mut self.kind {
            Kind::Small(swarm) => swarm.tell(evaluation),
            Kind::Large(swarm) => swarm.tell(evaluation),
        }
    }

    fn counters(&self) -> Counters {
        self.present().counters()
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        to_bytes(self)
    }

    fn accepting(&mut self) -> Option<&mut dyn AcceptsMigrants> {
        Some(self)
    }

    fn planned_iterations(&self) -> usize {
        self.present().planned_iterations()
    }

    fn best(&self) -> Vec<f64> {
        self.present().best()
    }

    fn violation(&self) -> f64 {
        self.present().violation()
    }

    fn front(&self) -> Front {
        self.present().front()
    }
}
