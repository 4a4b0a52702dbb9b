//! What a drive is asked to do, and how far it has come: all that it takes to go on.

use super::PopulationSettings;
use crate::study::raceline::RacelineSettings;
use crate::swarm::checkpoint::Checkpoint;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// What the flags ask for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveRequest {
    /// Files of the lines.
    pub lines: Vec<PathBuf>,
    /// The circuit, for its edges.
    pub track: String,
    /// The car.
    pub car: String,
    /// The point mass's limits from a table instead of the car's own.
    pub envelope: Option<PathBuf>,
    /// Width of the car (m).
    pub car_width_m: f64,
    /// Set-ups and several lines, driven all at once.
    pub population: Option<PopulationSettings>,
}

impl Default for DriveRequest {
    fn default() -> Self {
        Self {
            lines: Vec::new(),
            track: "silverstone_gp".to_owned(),
            car: "gt".to_owned(),
            envelope: None,
            car_width_m: 2.0,
            population: None,
        }
    }
}

impl DriveRequest {
    /// What the circuit and the limits are set up from.
    pub fn raceline(&self) -> RacelineSettings {
        RacelineSettings {
            track: self.track.clone(),
            car: self.car.clone(),
            envelope: self.envelope.clone(),
            car_width_m: self.car_width_m,
            ..RacelineSettings::default()
        }
    }

    /// The same with the paths of files absolute, so that they mean the same from every folder.
    pub fn absolute(mut self) -> Self {
        let placed = self.raceline().absolute();
        (self.track, self.car, self.envelope) = (placed.track, placed.car, placed.envelope);
        for line in &mut self.lines {
            if let Ok(path) = std::path::absolute(&line) {
                *line = path;
            }
        }
        self
    }
}

/// How far the search for the share of the grip that is held has come. Every share is driven by itself, so that going on ends
/// with the same bits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DriveState {
    /// What the flags asked for, where flags did.
    pub request: Option<DriveRequest>,
    /// A sum over what is read; nothing before the first drive.
    pub(super) inputs: Option<String>,
    /// Shares that were tried, from the first on.
    pub(super) tried: usize,
    /// What became of those that failed.
    pub(super) failures: Vec<(f64, String)>,
    /// The share with which the laps agreed best so far.
    pub(super) best: Option<f64>,
}

impl DriveState {
    /// Of a drive that is to begin.
    pub fn of(request: DriveRequest) -> Self {
        Self {
            request: Some(request),
            ..Self::default()
        }
    }

    /// Whether nothing has been driven yet.
    pub fn is_untouched(&self) -> bool {
        self.tried == 0
    }
}

impl Checkpoint for DriveState {
    const KIND: &'static str = concat!("drive of transient, lapswarm ", env!("CARGO_PKG_VERSION"));
}
