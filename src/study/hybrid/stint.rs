//! Stints of several laps.

use super::scenario::drive;
use super::setup::HybridSetup;
use super::strategy::{budget_at, gate_speeds};
use crate::error::{Error, Result};
use crate::line::energy::{Gates, Mode};
use crate::vehicle::MassLimits;
use serde::{Deserialize, Serialize};

/// A lap of a stint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StintLap {
    /// Mass at its start (kg).
    pub mass_kg: f64,
    /// Time (s).
    pub lap_time_s: f64,
    /// Fuel (l).
    pub fuel_l: f64,
    /// Energy out of the store (MJ).
    pub deployed_mj: f64,
    /// Energy into the store (MJ).
    pub harvested_mj: f64,
    /// State of charge at its end.
    pub soc_end: f64,
    /// Speed up to which the motor works (m/s).
    pub gate_mps: f64,
    /// Time of the engine alone with the same mass (s).
    pub engine_lap_time_s: f64,
    /// Fuel of the engine alone (l).
    pub engine_fuel_l: f64,
}

/// The greatest difference of the charge over a lap that counts as sustained, as a share of the energy used.
const SUSTAINED: f64 = 0.02;

/// A full store that is full again has changed by nothing: what a lap may lack so that it counts as sustained (J).
const SPARE_J: f64 = 1.0;

/// Drives `laps` with `fuel_kg` on board at first. Each lap deploys no more than it harvests, below the speed that makes it
/// fastest; the mass falls by the fuel burnt, and the
/// car's limits change with it.
///
/// # Errors
/// [`Error::Input`] if the fuel does not last; those of laps and of the sweep of limits.
pub fn stint(setup: &HybridSetup, laps: usize, fuel_kg: f64) -> Result<Vec<StintLap>> {
    if laps == 0 {
        return Ok(Vec::new());
    }
    let dry_kg = setup.car.car.chassis.mass;
    let masses_kg = [0.0, 0.5, 1.0].map(|share| dry_kg + share * fuel_kg);
    let limits = MassLimits::sweep(&setup.car.car, &masses_kg)?;
    let density = setup.car.fuel_density_kgpl;
    let mut fuel = fuel_kg;
    let mut hybrid = setup.car.hybrid.clone();
    let mut soc = hybrid.store.start_soc;
    let mut rows = Vec::new();
    for _ in 0..laps {
        let mass_kg = dry_kg + fuel;
        let heavy = HybridSetup {
            car: setup
                .car
                .with_hybrid(hybrid.clone())?
                .with_mass(mass_kg, &limits)?,
            ..setup.clone()
        };
        let lap_with = |speed_mps: f64, energy_mj: f64| {
            let gates = Gates {
                speed_mps,
                energy_mj,
                soc: -1e6,
                ..Gates::OPEN
            };
            drive(&heavy, "stint", Mode::Additional, gates)
        };
        let engine = lap_with(0.0, 0.0)?.lap;
        let (mut gate_mps, mut lap) = (0.0, engine);
        for speed in gate_speeds() {
            let energy = budget_at(|mj| Ok(lap_with(speed, mj)?.lap.change + SPARE_J))?;
            let tried = lap_with(speed, energy)?.lap;
            if tried.time < lap.time {
                (gate_mps, lap) = (speed, tried);
            }
        }
        let harvested = lap.harvested_k + lap.harvested_h;
        soc += lap.change / hybrid.store.capacity_j;
        hybrid.store.start_soc = soc;
        if lap.change < -SUSTAINED * harvested.max(1e4) {
            return Err(Error::Study(format!(
                "lap {} of the stint does not sustain its charge",
                rows.len() + 1
            )));
        }
        rows.push(StintLap {
            mass_kg,
            lap_time_s: lap.time,
            fuel_l: lap.fuel / density,
            deployed_mj: lap.deployed / 1e6,
            harvested_mj: harvested / 1e6,
            soc_end: soc,
            gate_mps,
            engine_lap_time_s: engine.time,
            engine_fuel_l: engine.fuel / density,
        });
        fuel -= lap.fuel;
        if fuel < 0.0 {
            return Err(Error::input(
                "the study",
                "stint_fuel_kg",
                format!("{fuel_kg} kg, which last {} laps", rows.len() - 1),
                format!("fuel for {laps} laps"),
            ));
        }
    }
    Ok(rows)
}
