//! Layer five: laps with a hybrid's energy on a fixed line, their time, fuel and accounts.

use super::{Agreement, Draws, Subject};
use crate::error::{Error, Result};
use crate::evaluate::OutcomeOf;
use crate::evaluate::energy::{
    CpuHybridEvaluator, Free, GpuHybridEvaluator, HybridLine, HybridObjective, HybridProblem,
    SimdHybridEvaluator, Strategy,
};
use crate::line::energy::{EnergyCar, EnergyLap, EnergyPlan, Gates, Mode, Traction};
use crate::line::geometry;
use crate::study::envelope::{EnvelopeSettings, car_limits};
use crate::study::raceline::{RacelineSettings, set_up};
use crate::vehicle::Car;
use std::sync::Arc;

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

/// The laps of candidates, none of which may fail.
fn driven(laps: Vec<OutcomeOf<HybridProblem>>) -> Result<Vec<EnergyLap<f64>>> {
    let laps = laps.into_iter().collect::<std::result::Result<_, _>>();
    laps.map_err(|failure| Error::Study(format!("a lap with energy: {failure}")))
}

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
        HybridLine::Free { cuts, .. } => cuts.points(&vec![0.5; cuts.len()]),
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

/// Problems of both modes, strategies, and what the reference says of them.
pub(super) struct Cases(Vec<Case>);

struct Case {
    mode: &'static str,
    problem: HybridProblem,
    strategies: Vec<Vec<f64>>,
    exact: Vec<EnergyLap<f64>>,
}

impl Cases {
    /// # Errors
    /// Those of reading the bundled circuit and car.
    pub(super) fn new() -> Result<Self> {
        let setup = set_up(&RacelineSettings {
            sections: SECTIONS,
            ..RacelineSettings::default()
        })?;
        let points_m = setup.cuts.points(&setup.cuts.reference);
        let length = geometry(&points_m, true).segment_m;
        let car = Car::bundled_hybrid()?;
        let limits = car_limits(
            &car,
            &EnvelopeSettings {
                step_mps: 8.0,
                ..EnvelopeSettings::default()
            },
        )?;
        let rows = limits
            .speeds
            .iter()
            .map(|s| (s.row.v_mps, s.traction_mps2))
            .collect();
        let car = EnergyCar::new(car, limits.envelope, Traction { rows }, 2.0)?;
        let mut draws = Draws::new(5);
        let modes = [("offset", Mode::Offset), ("additional", Mode::Additional)];
        let cases = modes.into_iter().map(|(name, mode)| {
            let plan = EnergyPlan::zoned(&length, &[40, 160, 300, 420], true, SECTIONS / 2, mode);
            let strategy = Strategy {
                free: GATES
                    .into_iter()
                    .chain((0..plan.count()).map(Free::Zone))
                    .collect(),
                ..Strategy::fixed(Gates::OPEN, plan.count())
            };
            let line = HybridLine::Fixed {
                points_m: points_m.clone(),
                closed: true,
            };
            let problem = HybridProblem::new(line, car.clone(), plan, strategy, &HybridObjective::ALL, 30.0)?;
            let candidates: Vec<Vec<f64>> = (0..COUNT)
                .map(|_| {
                    let mut candidate = vec![
                        draws.within(0.005, 0.15),
                        draws.within(30.0, 75.0),
                        draws.within(0.0, 3.0),
                        draws.within(0.7, 1.0),
                        draws.within(0.0, 4.0),
                        draws.within(0.0, 240.0),
                    ];
                    candidate.extend((6..problem.dimensions()).map(|_| draws.within(0.0, 1.0)));
                    candidate
                })
                .collect();
            let slices: Vec<&[f64]> = candidates.iter().map(Vec::as_slice).collect();
            let exact = driven(CpuHybridEvaluator::new(&problem).outcomes(&slices))?;
            Ok(Case {
                mode: name,
                problem,
                strategies: candidates,
                exact,
            })
        });
        Ok(Self(cases.collect::<Result<_>>()?))
    }

    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub(super) fn compare(&self, subject: &Subject) -> Result<Vec<Agreement>> {
        let mut agreements = Vec::new();
        for Case {
            mode,
            problem,
            strategies,
            exact,
        } in &self.0
        {
            let slices: Vec<&[f64]> = strategies.iter().map(Vec::as_slice).collect();
            let found = driven(match subject {
                Subject::Lanes(set) => SimdHybridEvaluator::new(problem, *set).outcomes(&slices),
                Subject::Device(context) => {
                    GpuHybridEvaluator::new(problem, Arc::clone(context))?.outcomes(&slices)?
                }
            })?;
            let named = |what: &str| Agreement::new(&format!("energy, {mode}, {what}"), subject);
            let mut all = [
                named("time"),
                named("fuel"),
                named("deployed"),
                named("harvested"),
            ];
            for (number, (lap, exact)) in found.iter().zip(exact).enumerate() {
                let Allowed { time, fuel, energy } = allowed(problem, exact);
                // What passes through the store in a lap: an energy of zero is exact to a share of that.
                let passed = exact.deployed + exact.harvested_k + exact.harvested_h;
                let figures = [
                    (lap.time, exact.time, exact.time, time),
                    (lap.fuel, exact.fuel, exact.fuel, fuel),
                    (lap.deployed, exact.deployed, passed, energy),
                    (
                        lap.harvested_k + lap.harvested_h,
                        exact.harvested_k + exact.harvested_h,
                        passed,
                        2.0 * energy,
                    ),
                ];
                for (agreement, (found, exact, scale, allowed)) in all.iter_mut().zip(figures) {
                    agreement.note(found, exact, scale.max(1.0), allowed, || {
                        format!("strategy {number}")
                    });
                }
            }
            agreements.extend(all);
        }
        Ok(agreements)
    }
}
