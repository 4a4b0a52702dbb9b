//! Layer three: a made-up lap, driven by cars about the one that logged it.

use super::synthetic_lap::{Lap, candidates, problem};
use super::{Agreement, Draws, Subject};
use crate::error::Result;
use crate::evaluate::replay::ReplayProblem;
use crate::evaluate::replay::{CHANNEL_NAMES, CpuEvaluator, GpuEvaluator, SimdEvaluator};
use crate::evaluate::{Evaluation, Evaluator};
use crate::study::identify::IdentifySettings;
use crate::vehicle::Car;
use std::sync::Arc;

/// Cars that drive the lap.
const COUNT: usize = 24;
/// Greatest share by which an unknown is off.
const SHARE: f64 = 0.3;
/// Cars next to each, every unknown up to a millionth off, whose costs in `f64` say how well the car's own is
/// determined. Single precision moves every figure by a sixteenth of that at the outset and the state by as much in every
/// step: where a millionth moves the reference itself by more than is allowed, the car stands at the edge of a spin,
/// neither answer is wrong, and the car is left out.
const NEIGHBOURS: usize = 4;
const NEXT_TO: f64 = 1e-6;
/// What single precision may add to a cost, as a share of it. A forward speed of 50 m/s in `f32` is off by up to
/// 2e-6 m/s, which is a slip of 4e-8 at all wheels alike; slip stiffness is some 25 times the load, so that accelerations
/// are off by 1e-5 m/s^2 however the rest is computed, and by a few times that with the rounding of what makes a slip.
/// Errors do not grow along the lap: wheels at given speeds and angles hold the car.
const TOLERANCE: f64 = 1e-4;
/// The same, absolute, for cars whose cost is small (m/s, m/s^2, m/s^2, rad/s): the error in the mean.
const FLOOR: [f64; 4] = [4e-6, 2e-5, 2e-5, 1e-6];

/// The cars, and what the reference says of them.
pub(super) struct Cases {
    replay: ReplayProblem,
    population: Vec<f64>,
    exact: Evaluation,
    /// The cars whose costs are determined.
    determined: Vec<bool>,
}

/// What a channel's cost may be off that is `exact` in `f64`.
pub fn allowed(channel: usize, exact: f64) -> f64 {
    TOLERANCE * exact + FLOOR[channel]
}

impl Cases {
    /// # Errors
    /// Those of reading the bundled lap.
    pub(super) fn new() -> Result<Self> {
        let unknowns = IdentifySettings::default().free;
        let names: Vec<&str> = unknowns.iter().map(|f| f.name.as_str()).collect();
        let replay = problem(Car::bundled()?, &names, Lap::default())?;
        let mut draws = Draws::new(3);
        let mut population = candidates(&replay, COUNT, SHARE, &mut draws);
        let mut near = Vec::with_capacity(NEIGHBOURS * population.len());
        for car in population.chunks_exact(replay.dimensions()) {
            for _ in 0..NEIGHBOURS {
                near.extend(car.iter().map(|x| x * (1.0 + draws.within(-NEXT_TO, NEXT_TO))));
            }
        }
        // One that cannot be evaluated, which every backend must say alike.
        population[replay.dimensions() * (COUNT - 1)] = f64::NAN;
        let mut reference = CpuEvaluator::new(&replay);
        let exact = reference.evaluate(&population)?;
        let near = reference.evaluate(&near)?;
        let channels = CHANNEL_NAMES.len();
        let determined = (0..COUNT)
            .map(|car| {
                car == COUNT - 1
                    || (car * NEIGHBOURS..(car + 1) * NEIGHBOURS).all(|other| {
                        near.failures[other] == exact.failures[car]
                            && (0..channels).all(|k| {
                                let own = exact.objectives[car * channels + k];
                                (near.objectives[other * channels + k] - own).abs() <= allowed(k, own)
                            })
                    })
            })
            .collect();
        Ok(Self {
            replay,
            population,
            exact,
            determined,
        })
    }

    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub(super) fn compare(&self, subject: &Subject) -> Result<Vec<Agreement>> {
        let replay = &self.replay;
        let found = match subject {
            Subject::Lanes(set) => SimdEvaluator::new(replay, *set).evaluate(&self.population)?,
            Subject::Device(context) => {
                GpuEvaluator::new(replay, Arc::clone(context))?.evaluate(&self.population)?
            }
        };
        let agreements = CHANNEL_NAMES.iter().enumerate().map(|(k, channel)| {
            let mut agreement = Agreement::new(&format!("replay, {channel}"), subject);
            // With half of the cars at the edge, there would be too little to say.
            let determined = self.determined.iter().filter(|d| **d).count();
            agreement.verdict(2 * determined > COUNT, || {
                format!("{determined} cars whose cost is determined")
            });
            for car in (0..COUNT).filter(|car| self.determined[*car]) {
                agreement.verdict(found.failures[car] == self.exact.failures[car], || {
                    format!(
                        "car {car}: {:?} for {:?}",
                        found.failures[car], self.exact.failures[car]
                    )
                });
                if self.exact.failures[car].is_none() {
                    let at = car * CHANNEL_NAMES.len() + k;
                    let exact = self.exact.objectives[at];
                    agreement.note(
                        found.objectives[at],
                        exact,
                        exact.abs(),
                        allowed(k, exact),
                        || format!("car {car}"),
                    );
                }
            }
            agreement
        });
        Ok(agreements.collect())
    }
}
