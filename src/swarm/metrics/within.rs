//! Volumes that are known as far as they were needed.

use serde::{Deserialize, Serialize};

/// How far a volume is to be known.
#[derive(Clone, Copy)]
pub(in crate::swarm) struct Asked {
    /// Until it is known to be more than this,
    pub enough: f64,
    /// or less than this.
    pub little: f64,
}

impl Asked {
    /// Exactly.
    pub const ALL: Self = Self {
        enough: f64::INFINITY,
        little: f64::NEG_INFINITY,
    };
}

/// What is known of a volume.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub(in crate::swarm) struct Within {
    /// It is no less than this,
    pub least: f64,
    /// and no more than this.
    pub most: f64,
}

impl Within {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self {
        least: 0.0,
        most: f64::INFINITY,
    };

    /// What is not a number, as the difference of two volumes that are too large for one, is nothing.
    pub fn exactly(volume: f64) -> Self {
        let volume = volume.max(0.0);
        Self {
            least: volume,
            most: volume,
        }
    }

    pub fn is_exact(self) -> bool {
        self.least >= self.most
    }
}
