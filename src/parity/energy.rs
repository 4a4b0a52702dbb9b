//! Layer five: laps with a hybrid's energy on a fixed line, their time, fuel and accounts.

use super::cases::{Cases, Compared, layer_of};
use super::lines::{in_relief, with_drs};
use super::{Draws, Layer};
use crate::config::kinds::Choice;
use crate::error::{Error, Result};
use crate::evaluate::Failure;
use crate::evaluate::energy::{Free, HybridLine, HybridObjective, HybridProblem, Strategy};
use crate::line::energy::{EnergyCar, EnergyLap, EnergyPlan, Gates, Mode};
use crate::line::{PointMass, geometry};
use crate::study::raceline::{RacelineSettings, set_up};
use crate::vehicle::Car;
use crate::vehicle::limits::{SpeedRange, car_envelope};

/// Strategies of each mode.
const COUNT: usize = 64;
/// Cross-sections of the circuit.
const SECTIONS: usize = 480;
/// Gates that every strategy sets, in this order.
const GATES: [Free; 6] = [
    Free::Steer,
    Free::Speed,
    Free::Acceleration,
    Free::Soc,
    Free::Energy,
    Free::Motor,
];
/// Least and greatest figures of these gates.
const RANGES: [(f64, f64); GATES.len()] = [
    (0.005, 0.15),
    (30.0, 75.0),
    (0.0, 3.0),
    (0.7, 1.0),
    (0.0, 4.0),
    (0.0, 240.0),
];

/// What single precision may move of a lap.
#[derive(Clone, Copy, Debug)]
pub struct Allowed {
    /// Of its time, s.
    pub time: f64,
    /// Of its fuel, kg.
    pub fuel: f64,
    /// Of what goes into the store or out of it, J.
    pub energy: f64,
}

/// What single precision may move of a lap with up to four zones that is `exact` in `f64`.
///
/// Times may be off as those of racing lines. Energies are forces over lengths, and forces are differences of speeds
/// squared: 2500 m^2/s^2 is off by 3e-4 after the roundings of a step, over 2 h of 10 m that is 3e-5 m/s^2 or 4 kJ on
/// a lap of 5 km whose signs all agree; a root of what the ellipse leaves is off by 6e-4 of 15 m/s^2 where a corner is
/// on the limit, an eighth of the lap at most: 7 kJ more. A gate flips on a rounding where a figure is on its threshold:
/// no more than a segment at either end of each of the four zones, and one at the budget's end, of 260 kW (the strongest motor
/// with what it loses) over h / v.
pub fn allowed(problem: &HybridProblem, exact: &EnergyLap<f64>) -> Allowed {
    let points = match problem.line() {
        HybridLine::Fixed { points_m, .. } => points_m.clone(),
        HybridLine::Free { cross_sections, .. } => cross_sections.points(&vec![0.5; cross_sections.len()]),
    };
    let segments = geometry(&points, true).segment_m;
    let spacing = segments.iter().fold(0.0, |a: f64, b| a.max(*b));
    let mean_speed = points.len() as f64 * spacing / exact.time;
    let energy = 11e3 + 9.0 * 260e3 * 2.0 * spacing / mean_speed;
    Allowed {
        time: 2.6e-4 * exact.time,
        fuel: 3e-4 * exact.fuel + energy * 2.0 * 0.27 / 3.6e6,
        energy,
    }
}

impl Compared for HybridProblem {
    const NOUN: &'static str = "strategy";

    fn figures(&self, _: &[f64], lap: &EnergyLap<f64>) -> std::result::Result<Vec<f64>, Failure> {
        let harvested = lap.harvested_k + lap.harvested_h;
        Ok(vec![lap.time, lap.fuel, lap.deployed, harvested])
    }

    fn limits(&self, _: &[f64], lap: &EnergyLap<f64>, _: &[f64]) -> Option<Vec<[f64; 2]>> {
        let Allowed { time, fuel, energy } = allowed(self, lap);
        // What passes through the store in a lap: an energy of zero is exact to a share of that.
        let passed = lap.deployed + lap.harvested_k + lap.harvested_h;
        let limits = [
            (lap.time, time),
            (lap.fuel, fuel),
            (passed, energy),
            (passed, 2.0 * energy),
        ];
        Some(limits.map(|(scale, allowed)| [scale.max(1.0), allowed]).to_vec())
    }
}

/// The layer, with a problem of each mode.
///
/// # Errors
/// Those of reading the bundled circuit and car.
pub(super) fn layer() -> Result<Layer> {
    let modes = [Mode::Offset, Mode::Additional];
    let mut draws = Draws::new(5);
    let mut all = Vec::new();
    for (road, hills) in [("energy", false), ("energy in hills", true)] {
        let problems = problems(SECTIONS, &modes, true, hills)?;
        all.extend(problems.into_iter().zip(modes).map(|of| (road, of)));
    }
    let cases = all.into_iter().map(|(road, (problem, mode))| {
        let zones = problem.dimensions() - GATES.len();
        let strategies = (0..COUNT).map(|_| {
            let mut strategy = RANGES.map(|(low, high)| draws.within(low, high)).to_vec();
            strategy.extend((0..zones).map(|_| draws.within(0.0, 1.0)));
            strategy
        });
        let strategies = strategies.collect();
        let figures = ["time", "fuel", "deployed", "harvested"];
        let names = figures.map(|what| format!("{road}, {}, {what}", mode.name()));
        let cases = Cases::new(names.to_vec(), problem, strategies, &[]);
        if cases.all_succeed() {
            Ok(cases)
        } else {
            Err(Error::Study(
                "a lap with energy is not driven to its end".to_owned(),
            ))
        }
    });
    Ok(layer_of(cases.collect::<Result<_>>()?))
}

/// Problems of deploying the bundled hybrid's energy on the bundled circuit's reference line, cut into so many cross-sections, a
/// problem of each mode. All gates and four zones are free. The car has a DRS if `drs` is set, and `hills` makes up the road's surface.
///
/// # Errors
/// Those of reading the bundled circuit and car.
pub fn problems(sections: usize, modes: &[Mode], drs: bool, hills: bool) -> Result<Vec<HybridProblem>> {
    let setup = set_up(&RacelineSettings {
        sections: Some(sections),
        ..RacelineSettings::default()
    })?;
    let points_m = setup.cross_sections.points(&setup.cross_sections.reference);
    let length_m = geometry(&points_m, true).segment_m;
    let car = Car::bundled_hybrid()?;
    let coarse = SpeedRange {
        step_mps: 8.0,
        ..SpeedRange::USUAL
    };
    let limits = car_envelope(&car, &coarse)?;
    let traction = limits.traction();
    let (envelope, drs) = if drs {
        with_drs(&limits.envelope, sections)?
    } else {
        (limits.envelope, Vec::new())
    };
    let mut car = EnergyCar::new(car, envelope, traction.clone(), 2.0)?;
    let mut surface = Vec::new();
    if hills {
        let (road, point_mass) = in_relief(&setup.cross_sections, &car.point_mass)?;
        // Steering that is too slow for the bends of the circuit.
        let point_mass = PointMass {
            max_steer_rate_radps: Some(0.05),
            ..point_mass
        };
        surface = road.relief_of(&points_m).unwrap_or_default();
        car = EnergyCar::of(car.car, point_mass, traction)?;
    }
    let zones = [2, 8, 15, 21].map(|part| part * sections / 24);
    let problems = modes.iter().map(|mode| {
        let plan = EnergyPlan::zoned(&length_m, &zones, true, sections / 2, *mode);
        let zones = (0..plan.count()).map(Free::Zone);
        let strategy = Strategy {
            free: GATES.into_iter().chain(zones).collect(),
            ..Strategy::fixed(Gates::OPEN, plan.count())
        };
        let line = HybridLine::Fixed {
            points_m: points_m.clone(),
            closed: true,
            drs: drs.clone(),
            surface: surface.clone(),
        };
        HybridProblem::new(line, car.clone(), plan, strategy, &HybridObjective::ALL, 30.0)
    });
    problems.collect()
}
