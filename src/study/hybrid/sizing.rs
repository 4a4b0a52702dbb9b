//! Hybrids sized to another car's lap: the powers and energies with which this car laps as fast, found by a swarm.

use super::scenario::{ReportedLap, drive, drive_engine_alone};
use super::settings::HybridStudySettings;
use super::setup::HybridSetup;
use super::spending::{Sharing, Spending};
use super::strategy::MOST_MJ;
use crate::error::{Error, Result};
use crate::evaluate::energy::{Free, HybridObjective, HybridProblem, open_hybrid_evaluator};
use crate::line::energy::{Gates, Mode};
use crate::scalar::try_bisected;
use crate::study::framework::journal::Recorder;
use crate::swarm::{
    CovarianceSettings, CovarianceSwarm, HybridSettings, HybridSwarm, Optimiser, Progress, run,
};
use crate::vehicle::Hybrid;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// A hybrid that laps like another car.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sizing {
    /// Power of the motor (kW).
    pub power_kw: f64,
    /// Energy that the swarm deploys with it in a lap (MJ); `null` where no energy was enough.
    pub energy_mj: Option<f64>,
    /// What of it is harvested in the same lap (MJ).
    pub harvested_mj: f64,
    /// Greatest fall of the charge along the lap (MJ): the least that a store has to hold.
    pub store_mj: f64,
    /// Time (s), within some thousandths of the one asked for where the motor suffices; else the best there is.
    pub lap_time_s: f64,
    /// Time of the exact deployment of as much energy by the same motor (s); `null` where no energy was enough.
    pub exact_lap_time_s: Option<f64>,
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
        drive_engine_alone(&other)
    };
    let [least, most] = ENGINES;
    if lap_with(least)?.lap.time < lap_time_s || lap_with(most)?.lap.time > lap_time_s {
        return Ok(None);
    }
    // To a thousandth of a horsepower.
    let slower = |share: f64| Ok(lap_with(share)?.lap.time > lap_time_s);
    let [_, share] = try_bisected(ENGINES, 1e-6, slower)?;
    Ok(Some((
        share,
        lap_with(share)?.lap.fuel / setup.car.fuel_density_kgpl,
    )))
}

/// The motor's place among the variables.
const MOTOR: usize = 0;
/// Ranges of the motor's power that are looked through, alike in width.
const RANGES: usize = 8;
/// Laps this close to the one asked for are as fast (s), and no more energies are tried.
const CLOSE_S: f64 = 3e-3;
/// Energies that are tried in a range, at most.
const ENERGIES: usize = 8;
/// Searches after the first begin about the best before, with this standard deviation as a share of the ranges, and take this
/// share of its iterations: the energy has changed by little.
const SPREAD: f64 = 0.03;
const SHARE_OF_ITERATIONS: usize = 4;

/// Hybrids that lap in `lap_time_s`, by rising power. The power and the share of every zone are the variables of a swarm that
/// looks for the fastest lap with an energy, once for each range of powers; the energy is brought by false position to what
/// the lap time takes. Beside it stands what the exact deployment makes of the same motor and energy, and the fuel that a car
/// burns more which laps as fast by its engine alone. Also returns the laps that were evaluated.
///
/// # Errors
/// Those of laps, of the evaluator and of the solver.
pub fn size(
    setup: &HybridSetup,
    settings: &HybridStudySettings,
    lap_time_s: f64,
    recorder: &mut Recorder<'_>,
    mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<(Vec<Sizing>, u64)> {
    // The charge sizes the store: a full one must not hold it back.
    let setup = &HybridSetup {
        car: setup.car.with_hybrid(setup.car.hybrid.with_overflow())?,
        ..setup.clone()
    };
    let zoned = |energy_mj| setup.zone_problem(&[Free::Motor], energy_mj, &[HybridObjective::LapTime]);
    let whole = zoned(MOST_MJ)?;
    let upper: Vec<f64> = whole.problem.variables.iter().map(|v| v.upper).collect();
    let step_kw = upper[MOTOR] / RANGES as f64;
    let engine_s = drive(setup, "engine alone", Mode::Additional, Gates::of_zones(0.0))?
        .lap
        .time;
    if engine_s <= lap_time_s {
        return Err(Error::input(
            "the study",
            "match_lap_time_s",
            format!("{lap_time_s} s"),
            format!("less than the {engine_s:.3} s of the engine alone"),
        ));
    }
    let mut evaluations = 0;
    let mut found: Vec<Found> = Vec::new();
    let mut interrupted = false;
    for range in 0..RANGES {
        let bounds_kw = [range, range + 1].map(|step| step_kw * step as f64);
        // The greatest motor of the range, wherever it is of use: no lap of the range is faster.
        let mut best = upper.clone();
        best[MOTOR] = bounds_kw[1];
        let mut lap = ReportedLap::of("sized", &whole, &best);
        // Energies (MJ) that are too small and more than enough, and by how much (s).
        let mut few = (0.0, engine_s - lap_time_s);
        let mut many = (lap.lap.deployed / 1e6, lap.lap.time - lap_time_s);
        let suffices = many.1 <= CLOSE_S;
        for round in 0..ENERGIES {
            if interrupted || many.1 >= -CLOSE_S {
                break;
            }
            let energy_mj = few.0 + (many.0 - few.0) * few.1 / (few.1 - many.1);
            let mut problem = zoned(energy_mj)?;
            let motor = &mut problem.problem.variables[MOTOR];
            [motor.lower, motor.upper] = bounds_kw;
            let (population, seed) = (settings.population, settings.seed.wrapping_add(range as u64));
            let swarm: Box<dyn Optimiser> = if round == 0 {
                Box::new(HybridSwarm::new(
                    &problem.problem,
                    HybridSettings {
                        population,
                        iterations: settings.iterations,
                        seed,
                        ..HybridSettings::default()
                    },
                )?)
            } else {
                Box::new(CovarianceSwarm::new(
                    &problem.problem,
                    &best,
                    CovarianceSettings {
                        population,
                        iterations: settings.iterations.div_ceil(SHARE_OF_ITERATIONS),
                        seed: seed.wrapping_add((RANGES * round) as u64),
                        spread: SPREAD,
                        ..CovarianceSettings::default()
                    },
                )?)
            };
            let spending = Spending::of(setup, &problem, energy_mj, Some(bounds_kw[1]))?;
            let mut swarm = Sharing { swarm, spending };
            let mut evaluator =
                open_hybrid_evaluator(&problem, settings.backend, settings.adapter.as_deref())?;
            run(&mut swarm, &mut recorder.over(evaluator.as_mut()), |p| {
                let flow = observe(&Progress {
                    evaluations: evaluations + p.evaluations,
                    ..p.clone()
                });
                interrupted |= flow.is_break();
                flow
            })?;
            evaluations += swarm.evaluations();
            if let Some(found) = swarm.front().candidates.first() {
                best.clone_from(found);
            }
            lap = ReportedLap::of("sized", &problem, &best);
            let late_s = lap.lap.time - lap_time_s;
            if late_s.abs() <= CLOSE_S {
                break;
            }
            // The end that stays counts for half as much (Illinois), so that it does not stay for ever.
            if late_s > 0.0 {
                few = (energy_mj, late_s);
                many.1 *= 0.5;
            } else {
                many = (energy_mj, late_s);
                few.1 *= 0.5;
            }
        }
        // What a range had come to when it was interrupted is no answer.
        if interrupted {
            break;
        }
        found.push(Found {
            candidate: best,
            lap,
            suffices,
        });
    }
    let rival = engine_only(setup, lap_time_s)?;
    let mut rows: Vec<Sizing> = Vec::new();
    // The solver takes seconds for each; the study may be interrupted between them too.
    for some in found.chunks(2) {
        let told = Progress {
            evaluations,
            best: rows.iter().map(|row| row.lap_time_s).take(1).collect(),
            ..Progress::default()
        };
        if observe(&told).is_break() {
            break;
        }
        let solved: Vec<Sizing> = some
            .par_iter()
            .map(|found| row_of(setup, &whole, found, rival))
            .collect::<Result<_>>()?;
        rows.extend(solved);
    }
    Ok((rows, evaluations))
}

/// The strategy of a range, and whether its strongest motor suffices at all.
struct Found {
    candidate: Vec<f64>,
    lap: ReportedLap,
    suffices: bool,
}

fn row_of(
    setup: &HybridSetup,
    problem: &HybridProblem,
    found: &Found,
    rival: Option<(f64, f64)>,
) -> Result<Sizing> {
    let (candidate, met) = (&found.candidate, found.suffices);
    let (mut most_j, mut store_j) = (0.0f64, 0.0f64);
    for charge_j in found.lap.change_j() {
        most_j = most_j.max(charge_j);
        store_j = store_j.max(most_j - charge_j);
    }
    let lap = &found.lap.lap;
    let rival = rival.filter(|_| met);
    let share = problem.strategy_of(candidate).0.motor_share;
    let hybrid = Hybrid {
        mgu_k: setup.car.hybrid.mgu_k.scaled(share),
        ..setup.car.hybrid.clone()
    };
    let fuel_l = lap.fuel / setup.car.fuel_density_kgpl;
    let power_kw = hybrid.mgu_k.power_w / 1e3;
    let exact_lap_time_s = || -> Result<f64> {
        let sized = HybridSetup {
            car: setup.car.with_hybrid(hybrid)?,
            ..setup.clone()
        };
        Ok(sized.exact(lap.deployed, None)?.lap.time)
    };
    Ok(Sizing {
        power_kw,
        energy_mj: met.then_some(lap.deployed / 1e6),
        harvested_mj: (lap.harvested_k + lap.harvested_h) / 1e6,
        store_mj: store_j / 1e6,
        lap_time_s: lap.time,
        exact_lap_time_s: met.then(exact_lap_time_s).transpose()?,
        fuel_l,
        engine_share: rival.map(|(share, _)| share),
        fuel_saving_l: rival.map(|(_, burnt_l)| burnt_l - fuel_l),
    })
}
