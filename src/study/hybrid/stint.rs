//! Stints of several laps, and hybrids sized to another car's lap.

use super::scenario::{ReportedLap, drive};
use super::setup::HybridSetup;
use super::strategy::{MOST_MJ, budget_at, gate_speeds};
use crate::error::{Error, Result};
use crate::line::energy::{Gates, Mode};
use serde::Serialize;

/// A lap of a stint.
#[derive(Clone, Debug, Serialize)]
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

/// Drives `laps` with `fuel_kg` on board at first. Each lap deploys no more than it harvests, below the speed that makes it
/// fastest; the mass falls by the fuel burnt.
///
/// # Errors
/// [`Error::Input`] if the fuel does not last; those of laps.
pub fn stint(setup: &HybridSetup, laps: usize, fuel_kg: f64) -> Result<Vec<StintLap>> {
    let dry_kg = setup.car.car.chassis.mass;
    let density = setup.car.fuel_density_kgpl;
    let mut fuel = fuel_kg;
    let mut soc = setup.car.hybrid.store.start_soc;
    let mut rows = Vec::new();
    for _ in 0..laps {
        let mass_kg = dry_kg + fuel;
        let heavy = HybridSetup {
            car: setup.car.with_mass(mass_kg)?,
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
            let energy = budget_at(|mj| Ok(lap_with(speed, mj)?.lap.change))?;
            let tried = lap_with(speed, energy)?.lap;
            if tried.time < lap.time {
                (gate_mps, lap) = (speed, tried);
            }
        }
        let harvested = lap.harvested_k + lap.harvested_h;
        soc += lap.change / setup.car.hybrid.store.capacity_j;
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

/// A hybrid that laps like another car.
#[derive(Clone, Debug, Serialize)]
pub struct Sizing {
    /// Power of the motor (kW).
    pub power_kw: f64,
    /// Energy that it needs in a lap (MJ), deployed below the speed that needs least; `null` where no energy is enough.
    pub energy_mj: Option<f64>,
    /// What of it is harvested in the same lap (MJ).
    pub harvested_mj: f64,
    /// Time (s).
    pub lap_time_s: f64,
    /// Fuel (l).
    pub fuel_l: f64,
    /// Power of the engine, as a share of this car's, that a car without a motor laps as fast with; `null` where none within
    /// [`ENGINES`] does.
    pub engine_share: Option<f64>,
    /// Fuel that such a car burns more in a lap (l).
    pub fuel_saving_l: Option<f64>,
}

/// Engines that another car may have, as shares of this car's power. Of weaker ones the limits do not tell what they would
/// give where the tyres hold this one back.
pub const ENGINES: [f64; 2] = [1.0, 2.0];

/// The share of this car's engine with which it laps in `lap_time_s` without a motor, and the fuel (l) that it burns then.
/// Torque and fuel flow are taken to grow alike at every engine speed; the mass stays.
///
/// # Errors
/// Those of laps.
pub fn engine_only(setup: &HybridSetup, lap_time_s: f64) -> Result<Option<(f64, f64)>> {
    let lap_with = |share: f64| -> Result<ReportedLap> {
        let other = HybridSetup {
            car: setup.car.with_engine(share)?,
            ..setup.clone()
        };
        let none = Gates {
            energy_mj: 0.0,
            ..Gates::OPEN
        };
        drive(&other, "engine alone", Mode::Offset, none)
    };
    let [mut low, mut high] = ENGINES;
    if lap_with(low)?.lap.time < lap_time_s || lap_with(high)?.lap.time > lap_time_s {
        return Ok(None);
    }
    // To a thousandth of a horsepower.
    while high - low > 1e-6 {
        let middle = 0.5 * (low + high);
        if lap_with(middle)?.lap.time > lap_time_s {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(Some((
        high,
        lap_with(high)?.lap.fuel / setup.car.fuel_density_kgpl,
    )))
}

/// Motor powers of a sizing, as shares of the car's own.
const POWERS: [f64; 8] = [0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0];

/// The energy in a lap with which motors of several powers make this car lap in `lap_time_s`, and what fuel they save beside a
/// car that laps as fast by its engine alone.
///
/// # Errors
/// Those of laps.
pub fn size(setup: &HybridSetup, lap_time_s: f64) -> Result<Vec<Sizing>> {
    let mut rows = Vec::new();
    let other = engine_only(setup, lap_time_s)?;
    for share in POWERS {
        let mut hybrid = setup.car.hybrid.clone();
        hybrid.mgu_k.power_w *= share;
        for torque in &mut hybrid.mgu_k.torque_nm {
            *torque *= share;
        }
        let power_kw = hybrid.mgu_k.power_w / 1e3;
        let sized = HybridSetup {
            car: setup.car.with_hybrid(hybrid)?,
            ..setup.clone()
        };
        let lap_with = |speed_mps: f64, energy_mj: f64| -> Result<ReportedLap> {
            let gates = Gates {
                speed_mps,
                energy_mj,
                soc: -1e6,
                ..Gates::OPEN
            };
            drive(&sized, "sized", Mode::Additional, gates)
        };
        let mut best: Option<ReportedLap> = None;
        let mut fastest = lap_with(0.0, 0.0)?;
        for speed in gate_speeds() {
            let free = lap_with(speed, MOST_MJ)?;
            let enough = free.lap.time <= lap_time_s;
            if free.lap.time < fastest.lap.time {
                fastest = free;
            }
            if enough {
                let energy = budget_at(|mj| Ok(lap_with(speed, mj)?.lap.time - lap_time_s))?;
                let tried = lap_with(speed, energy)?;
                if best.as_ref().is_none_or(|b| tried.lap.deployed < b.lap.deployed) {
                    best = Some(tried);
                }
            }
        }
        let met = best.is_some();
        let lap = best.unwrap_or(fastest).lap;
        let fuel_l = lap.fuel / setup.car.fuel_density_kgpl;
        let rival = other.filter(|_| met);
        rows.push(Sizing {
            power_kw,
            energy_mj: met.then_some(lap.deployed / 1e6),
            harvested_mj: (lap.harvested_k + lap.harvested_h) / 1e6,
            lap_time_s: lap.time,
            fuel_l,
            engine_share: rival.map(|(share, _)| share),
            fuel_saving_l: rival.map(|(_, burnt_l)| burnt_l - fuel_l),
        });
    }
    Ok(rows)
}
