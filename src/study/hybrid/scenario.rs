//! Strategies set by hand.

use super::setup::HybridSetup;
use crate::error::Result;
use crate::evaluate::energy::HybridProblem;
use crate::line::energy::{EnergyLap, Gates, Mode, SegmentEnergy};
use crate::vehicle::hybrid::Store;
use crate::vehicle::powertrain::GRAVITY_MPS2;
use serde::{Deserialize, Serialize};

/// A strategy by its gates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scenario {
    /// Its name.
    pub name: String,
    /// Whether the motor takes the engine's place or adds to it.
    pub mode: Mode,
    /// Its gates.
    pub gates: Gates,
    /// State of charge at the start of its lap; the car's own if none.
    pub start_soc: Option<f64>,
}

/// The four scenarios of the thesis, with the motor in the engine's place: gates of steering (rad at the wheels) and speed
/// (m/s), then of charge or of energy. The charge that is sustained is half of the store, and one in the thesis: a full store
/// takes nothing of what the lap harvests.
pub fn published() -> Vec<Scenario> {
    let scenario = |name: &str, steer_rad: f64, speed_mps: f64, soc: f64, energy_mj: f64| Scenario {
        name: name.to_owned(),
        mode: Mode::Offset,
        gates: Gates {
            steer_rad,
            speed_mps,
            soc,
            energy_mj,
            ..Gates::OPEN
        },
        start_soc: None,
    };
    vec![
        scenario("charge_depleting", 0.02, 70.0, -10.0, 1000.0),
        Scenario {
            start_soc: Some(0.5),
            ..scenario("charge_sustaining", 0.02, 70.0, 0.5, 1000.0)
        },
        scenario("maximum_deployment", 0.15, 70.0, 0.0, 1000.0),
        scenario("maximum_permissible", 0.05, 60.0, 0.0, 5.3),
    ]
}

impl Scenario {
    /// Drives it on the study's line, from its own charge.
    ///
    /// # Errors
    /// As [`drive`].
    pub fn drive(&self, setup: &HybridSetup, mode: Mode) -> Result<ReportedLap> {
        let Some(start_soc) = self.start_soc else {
            return drive(setup, &self.name, mode, self.gates);
        };
        let mut hybrid = setup.car.hybrid.clone();
        hybrid.store.start_soc = start_soc;
        let charged = HybridSetup {
            car: setup.car.with_hybrid(hybrid)?,
            ..setup.clone()
        };
        drive(&charged, &self.name, mode, self.gates)
    }
}

/// A lap with everything that is told of it.
#[derive(Clone, Debug)]
pub struct ReportedLap {
    /// What it is.
    pub name: String,
    /// Whether the motor takes the engine's place or adds to it.
    pub mode: Mode,
    /// The sums.
    pub lap: EnergyLap<f64>,
    /// Every segment.
    pub segments: Vec<SegmentEnergy<f64>>,
    /// Distance from the start of each segment (m), in the plan view.
    pub station_m: Vec<f64>,
    /// Length of each segment (m), along the slope.
    pub length_m: Vec<f64>,
    /// Sine of each segment's gradient, positive uphill; empty on a level and dry road.
    pub gradient: Vec<f64>,
    /// The store, with its charge at the start.
    pub store: Store,
}

impl ReportedLap {
    /// The lap of a candidate.
    pub fn of(name: &str, problem: &HybridProblem, candidate: &[f64]) -> Self {
        let (lap, segments, course) = problem.lap(candidate);
        let length_m = course.length[..segments.len()].to_vec();
        let climbs = course.relief.iter().take(segments.len());
        let gradient: Vec<f64> = climbs.map(|[_, climb, ..]| climb / GRAVITY_MPS2).collect();
        let level =
            |(i, h): (usize, &f64)| h * gradient.get(i).map_or(1.0, |sine| (1.0 - sine * sine).sqrt());
        let station_m = length_m
            .iter()
            .enumerate()
            .map(level)
            .scan(0.0, |station, h| {
                let here = *station;
                *station += h;
                Some(here)
            })
            .collect();
        Self {
            name: name.to_owned(),
            mode: problem.energy().mode,
            lap,
            segments,
            station_m,
            length_m,
            gradient,
            store: problem.car().hybrid.store,
        }
    }

    /// State of charge after a change since the start of the lap (J).
    pub fn soc(&self, change_j: f64) -> f64 {
        self.store.start_soc + change_j / self.store.capacity_j
    }

    /// What the books do not balance by (J).
    pub fn balance_error_j(&self) -> f64 {
        self.lap.change - ((self.lap.harvested_k + self.lap.harvested_h) - self.lap.deployed)
    }

    /// Charge at the start of each segment above that at the start of the lap, and at the end (J).
    pub fn change_j(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let mut changes = vec![0.0];
        for s in &self.segments {
            sum += s.harvested_k + s.harvested_h - s.deployed;
            changes.push(sum);
        }
        changes
    }
}

/// Drives a lap by gates on the study's line, from the car's own charge.
///
/// # Errors
/// Those of [`HybridProblem::new`].
pub fn drive(setup: &HybridSetup, name: &str, mode: Mode, gates: Gates) -> Result<ReportedLap> {
    Ok(ReportedLap::of(name, &setup.gated(mode, gates)?, &[]))
}

/// Drives the lap of the engine alone.
///
/// # Errors
/// As [`drive`].
pub(super) fn drive_engine_alone(setup: &HybridSetup) -> Result<ReportedLap> {
    let none = Gates {
        energy_mj: 0.0,
        ..Gates::OPEN
    };
    drive(setup, "engine alone", Mode::Offset, none)
}
