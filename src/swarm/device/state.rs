//! A swarm off its device.

use crate::evaluate::resident::BLOCK;
use crate::swarm::Counters;
use crate::swarm::archive::Archive;
use crate::swarm::checkpoint::Checkpoint;
use crate::swarm::mopso::blocks::UNKNOWN;
use crate::swarm::mopso::earnings::Earnings;
use crate::swarm::mopso::relaxation::Pushing;
use crate::swarm::settings::MopsoSettings;
use crate::swarm::space::Space;
use serde::{Deserialize, Serialize};

/// The last row of blocks of `width` rows for `n` particles; infinite where nothing is known.
pub(super) fn last_row(blocks: &[f32], n: usize, width: usize) -> Vec<f64> {
    let rows = blocks.chunks_exact(BLOCK * width);
    let last = rows.flat_map(|block| &block[BLOCK * (width - 1)..]);
    let known = last.take(n).map(|x| {
        if *x < UNKNOWN {
            f64::from(x.max(0.0))
        } else {
            f64::INFINITY
        }
    });
    known.collect()
}

/// A swarm off its device, for [`crate::swarm::checkpoint`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DeviceState {
    pub(in crate::swarm) settings: MopsoSettings,
    pub(in crate::swarm) space: Space,
    pub(in crate::swarm) objectives: usize,
    pub(in crate::swarm) constrained: bool,
    pub(in crate::swarm) position: Vec<f32>,
    pub(in crate::swarm) velocity: Vec<f32>,
    pub(in crate::swarm) best_position: Vec<f32>,
    /// With a row for violations behind those of the objectives, if there are constraints.
    pub(in crate::swarm) best_objectives: Vec<f32>,
    pub(in crate::swarm) archive: Archive,
    pub(in crate::swarm) pushing: Pushing,
    pub(in crate::swarm) earnings: Earnings,
    pub(in crate::swarm) counters: Counters,
}

impl DeviceState {
    /// Rows of objectives of a particle.
    fn rows(&self) -> usize {
        self.objectives + usize::from(self.constrained)
    }

    /// The objectives of own bests, in blocks.
    pub(in crate::swarm) fn best_costs(&self) -> Vec<f32> {
        let blocks = self.best_objectives.chunks_exact(BLOCK * self.rows());
        blocks
            .flat_map(|block| &block[..BLOCK * self.objectives])
            .copied()
            .collect()
    }

    /// By how much own bests violate the constraints, if there are any.
    pub(in crate::swarm) fn best_violation(&self) -> Vec<f64> {
        if !self.constrained {
            return Vec::new();
        }
        last_row(
            &self.best_objectives,
            self.settings.motion.population,
            self.rows(),
        )
    }
}

impl Checkpoint for DeviceState {
    const KIND: &'static str = "swarm of a device";
}
