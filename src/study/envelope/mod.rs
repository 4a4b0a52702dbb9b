//! What a car can do at each speed, from its 4DOF model: the g-g-v envelope that racing lines are driven within.
//!
//! At every speed the steady states of the car ([`crate::vehicle::steady`]) give lateral acceleration over steering and
//! its ridge, straight-line running the greatest braking and traction, and the powertrain what the engine can give
//! through the gears. The rows make an [`Envelope`]; the small-angle end of the curves gives the handling figures.
//!
//! The surface of lateral acceleration over speed and steering also comes from a population of cars in steady-state cornering
//! ([`crate::evaluate::steady`]), on any backend; the limits stay those of the curves, which are exact.

mod population;
mod results;

pub use population::{RidgePoint, SteadySurface, SurfaceFigures};
pub use results::EnvelopeSummary;

use crate::config::kinds::{choice, count, name_or_file, number, optional, text};
use crate::config::settings::{Settings, settings};
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
use crate::study::framework::journal::Journal;
use crate::study::framework::memory::{ANSWER, MemoryItem};
use crate::study::framework::{Plan, RunRecord, Study, Subject, Work};
use crate::vehicle::{Car, Envelope, EnvelopeRow, Trim, Turn, steady_car};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The study.
pub struct EnvelopeStudy;

settings! {
    /// Settings of an envelope study.
    pub struct EnvelopeSettings {
        car: String ["-"] = "gt".to_owned(), name_or_file(),
            "The car: a bundled name (gt) or a TOML file, such as the one that identify writes";
        from_mps: f64 ["m/s"] = 18.0, number(3.0, 150.0),
            "Slowest speed; below it the limits are taken to be its";
        to_mps: f64 ["m/s"] = 77.0, number(4.0, 160.0),
            "Greatest speed, if the engine goes that far";
        step_mps: f64 ["m/s"] = 2.0, number(0.05, 50.0),
            "Step between speeds";
        steers: usize ["-"] = 128, count(4, 10_000),
            "Steering angles of the surface, from straight on to the lock";
        backend: BackendChoice ["-"] = BackendChoice::Auto, choice().place(),
            "Where the surface is evaluated; the limits are worked out in f64";
        adapter: Option<String> ["-"] = None, optional(text()).place().example("\"llvmpipe\""),
            "Part of the name of the GPU to use";
    }

    fn consistent(&self) -> Result<()> {
        let least = self.from_mps + 1.0;
        if self.to_mps < least {
            let expected = format!("{least} m/s or more, as from_mps is {}", self.from_mps);
            return Err(Error::input("the study", "to_mps", self.to_mps.to_string(), expected));
        }
        Ok(())
    }
}

/// All that the study reads.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The car.
    pub car: Car,
    /// Speeds that its limits are looked for at (m/s).
    pub speeds: Vec<f64>,
}

/// What the study finds.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The limits.
    pub limits: CarEnvelope,
    /// The surface of lateral acceleration.
    pub surface: SteadySurface,
    /// How the study ran; candidates are those of the surface.
    pub record: RunRecord,
}

/// Bytes of a car of the surface, with its tables, cells of a picture and places on a page.
const CAR: u64 = (4 << 10) + ANSWER;

impl Study for EnvelopeStudy {
    const NAME: &'static str = "envelope";
    const ABOUT: &'static str =
        "Find a car's limits at each speed: the g-g-v envelope that racing lines are driven within.";
    const DETAILS: &'static str =
        "Examples:\n  lapswarm envelope\n  lapswarm envelope --car runs/identify-001/car.toml --step-mps 5";
    type Settings = EnvelopeSettings;
    type State = Journal;
    type Prepared = Prepared;
    type Outcome = Outcome;
    type Summary = EnvelopeSummary;

    fn prepare(settings: &EnvelopeSettings) -> Result<Prepared> {
        let car = Car::load(&settings.car)?;
        let speeds = speeds_of(&car, settings)?;
        Ok(Prepared { car, speeds })
    }

    fn size(settings: &EnvelopeSettings, prepared: Option<&Prepared>) -> Vec<MemoryItem> {
        let speeds = prepared.map_or_else(|| settings.most_speeds(), |prepared| prepared.speeds.len());
        vec![MemoryItem {
            name: "steers, at each speed",
            count: (settings.steers as u64).saturating_mul(speeds as u64),
            each: CAR,
        }]
    }

    fn plan(settings: &EnvelopeSettings, prepared: &Prepared, plan: Plan) -> Result<Plan> {
        let Prepared { car, speeds } = prepared;
        plan.reads(format!("car {}, {} speeds", car.name, speeds.len()))
            .evaluations((speeds.len() * settings.steers) as u64)
            .backend(settings.backend, settings.adapter.as_deref())
    }

    fn solve(
        settings: &EnvelopeSettings,
        prepared: &Prepared,
        work: Work<'_, Journal>,
    ) -> Result<Option<Outcome>> {
        population::measure(settings, prepared, work)
    }

    fn record(outcome: &Outcome) -> &RunRecord {
        &outcome.record
    }

    fn record_mut(outcome: &mut Outcome) -> &mut RunRecord {
        &mut outcome.record
    }

    fn summarise(settings: &EnvelopeSettings, prepared: &Prepared, outcome: &Outcome) -> EnvelopeSummary {
        results::summarise(Self::head(settings, prepared, outcome), outcome)
    }

    fn subject(_: &EnvelopeSettings, prepared: &Prepared) -> Subject {
        Subject {
            car: prepared.car.name.clone(),
            ..Subject::default()
        }
    }

    fn report(
        folder: &Path,
        _: &EnvelopeSettings,
        _: &Prepared,
        outcome: &Outcome,
        summary: &EnvelopeSummary,
    ) -> Result<()> {
        results::report(folder, outcome, summary)
    }

    fn text(_: &EnvelopeSettings, summary: &EnvelopeSummary) -> String {
        summary.to_text()
    }

    fn check(path: &Path) -> Result<String> {
        let settings = EnvelopeSettings::read(path)?;
        let prepared = Self::prepare(&settings)?;
        Ok(format!("{}, {} speeds", prepared.car.name, prepared.speeds.len()))
    }
}

impl EnvelopeSettings {
    /// Speeds in even steps, as many as there are whatever the engine does.
    fn most_speeds(&self) -> usize {
        ((self.to_mps - self.from_mps) / self.step_mps + 1e-9).floor() as usize + 1
    }
}

/// What the car does at one speed.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvelopeAtSpeed {
    /// The row of the envelope.
    pub row: EnvelopeRow,
    /// Greatest lateral acceleration to the right (m/s^2). The row has the lesser of both sides.
    pub right_mps2: f64,
    /// Steady cornering to the left, in order along the curve of steady states.
    pub cornering: Vec<Trim>,
    /// Greatest acceleration by the driven tyres (m/s^2).
    pub traction_mps2: f64,
    /// Greatest acceleration by the engine in its best gear (m/s^2).
    pub engine_mps2: f64,
}

/// How the car steers at small lateral acceleration (R. Gillespie, *Fundamentals of Vehicle Dynamics*, 1992, ch. 6).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Handling {
    /// Steering at the wheels beyond what geometry asks for, over lateral acceleration (deg per g); positive
    /// understeers.
    pub understeer_gradient_deg_per_g: f64,
    /// `K` in `steer = L kappa (1 + K v^2)` (s^2/m^2).
    pub stability_factor_s2_per_m2: f64,
    /// Speed at which an understeering car answers most to the steering wheel (m/s).
    pub characteristic_speed_mps: Option<f64>,
    /// Speed at which an oversteering car becomes unstable (m/s).
    pub critical_speed_mps: Option<f64>,
}

/// A car's limits.
#[derive(Clone, Debug, PartialEq)]
pub struct CarEnvelope {
    /// Limits by rising speed.
    pub speeds: Vec<EnvelopeAtSpeed>,
    /// Handling in the middle of the range.
    pub handling: Handling,
    /// The envelope.
    pub envelope: Envelope,
    /// Speeds at which the car has no steady state in a bend (m/s). The envelope goes on between its neighbours there.
    pub left_out_mps: Vec<f64>,
}

/// Steering up to which the tyres' own limit is looked for (rad): a car whose lock is reached first still has it.
const STEER_TO_GRIP: f64 = 0.6;

/// Sweeps the car over speed and steering.
///
/// # Errors
/// [`Error::Input`] for settings out of range and for a car without a powertrain, [`Error::Study`] for one that has a steady
/// state in bends at fewer than two of the speeds.
pub fn car_envelope(car: &Car, settings: &EnvelopeSettings) -> Result<CarEnvelope> {
    let speeds = speeds_of(car, settings)?;
    let force = engine_of(car)?;
    let steady = steady_car(car);
    // The two sides of a car with even loads are each other's mirror image.
    let even = car.chassis.left_share_front == 0.5 && car.chassis.left_share_rear == 0.5;
    let found: Vec<EnvelopeAtSpeed> = speeds
        .into_par_iter()
        .map(|speed| {
            let cornering = steady.cornering(speed, STEER_TO_GRIP, Turn::Left);
            let peak = |trims: &[Trim]| trims.iter().map(|t| t.ay_mps2.abs()).fold(0.0, f64::max);
            let right_mps2 = match even {
                true => peak(&cornering),
                false => peak(&steady.cornering(speed, STEER_TO_GRIP, Turn::Right)),
            };
            let traction_mps2 = steady.greatest_traction(speed);
            let engine_mps2 = force(speed) / car.chassis.mass;
            EnvelopeAtSpeed {
                row: EnvelopeRow {
                    v_mps: speed,
                    ay_mps2: peak(&cornering).min(right_mps2),
                    ax_grip_mps2: steady.greatest_braking(speed),
                    ax_drive_mps2: traction_mps2.min(engine_mps2),
                    drag_mps2: steady.drag(speed),
                },
                right_mps2,
                cornering,
                traction_mps2,
                engine_mps2,
            }
        })
        .collect();
    let corners = |l: &EnvelopeAtSpeed| l.row.ay_mps2 > 0.0 && l.row.ax_grip_mps2 > 0.0;
    let (limits, left_out): (Vec<_>, Vec<_>) = found.into_iter().partition(corners);
    let left_out_mps: Vec<f64> = left_out.iter().map(|l| l.row.v_mps).collect();
    if limits.len() < 2 {
        return Err(Error::Study(format!(
            "{} has no steady state in bends at {} of {} speeds ({}): its tyres cannot hold it on the road there",
            car.name,
            left_out_mps.len(),
            left_out_mps.len() + limits.len(),
            in_words(&left_out_mps)
        )));
    }
    let envelope = Envelope::new(&car.name, limits.iter().map(|l| l.row).collect())?;
    let wheelbase = car.chassis.cg_to_front + car.chassis.cg_to_rear;
    Ok(CarEnvelope {
        handling: handling(&limits[limits.len() / 2], wheelbase),
        speeds: limits,
        envelope,
        left_out_mps,
    })
}

/// Speeds (m/s) in words.
fn in_words(speeds_mps: &[f64]) -> String {
    let words: Vec<String> = speeds_mps.iter().map(|v| format!("{v:.1}")).collect();
    format!("{} m/s", words.join(", "))
}

/// The speeds that a car's limits are looked for at (m/s), the last of them where its engine ends.
///
/// # Errors
/// [`Error::Input`] for settings out of range and for a car without a powertrain.
pub fn speeds_of(car: &Car, settings: &EnvelopeSettings) -> Result<Vec<f64>> {
    settings.validate()?;
    let force = engine_of(car)?;
    let mut speeds: Vec<f64> = Vec::new();
    let count = settings.most_speeds();
    for i in 0..count {
        let speed = settings.from_mps + settings.step_mps * i as f64;
        if force(speed) <= 0.0 {
            break;
        }
        speeds.push(speed);
    }
    if let Some(&last) = speeds.last()
        && speeds.len() < count
    {
        // The engine ends between two speeds: that is the car's greatest.
        let (mut low, mut high) = (last, last + settings.step_mps);
        while high - low > 1e-6 {
            let middle = 0.5 * (low + high);
            if force(middle) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        if low - last > 1e-3 {
            speeds.push(low);
        }
    }
    Ok(speeds)
}

/// The engine's force at the wheels (N) by speed (m/s), in the best gear.
fn engine_of(car: &Car) -> Result<impl Fn(f64) -> f64 + Sync> {
    let Some(powertrain) = &car.powertrain else {
        return Err(Error::input(
            &car.name,
            "[powertrain]",
            "none",
            "an engine and gears, for what the car can accelerate by",
        ));
    };
    Ok(move |speed: f64| powertrain.wheel_force(speed, car.chassis.radius_rear))
}

/// The slope of steering over lateral acceleration, between the two steady states nearest to 0 and 2 m/s^2: small
/// against any tyre's limit, large against rounding.
fn handling(limits: &EnvelopeAtSpeed, wheelbase: f64) -> Handling {
    /// Standard gravity (m/s^2).
    const G: f64 = 9.806_65;
    let first = limits.cornering.first();
    let second = limits
        .cornering
        .iter()
        .find(|t| t.ay_mps2 >= 2.0)
        .or(limits.cornering.last());
    let v = limits.row.v_mps;
    let slope = match (first, second) {
        (Some(a), Some(b)) if b.ay_mps2 > a.ay_mps2 => (b.steer_rad - a.steer_rad) / (b.ay_mps2 - a.ay_mps2),
        _ => f64::NAN,
    };
    let understeer_gradient = slope - wheelbase / v.powi(2);
    let stability_factor = understeer_gradient / wheelbase;
    Handling {
        understeer_gradient_deg_per_g: understeer_gradient.to_degrees() * G,
        stability_factor_s2_per_m2: stability_factor,
        characteristic_speed_mps: (stability_factor > 0.0).then(|| stability_factor.recip().sqrt()),
        critical_speed_mps: (stability_factor < 0.0).then(|| (-stability_factor).recip().sqrt()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bundled_car_corners_as_it_was_made_to() {
        let car = Car::bundled().unwrap();
        let limits = car_envelope(&car, &EnvelopeSettings::default()).unwrap();
        let envelope = &limits.envelope;
        // What the bundled car was made for: up to 15 m/s^2 at 25 m/s and 18 at 65, within a tenth.
        assert!((envelope.at(25.0).ay_mps2 / 15.0 - 1.0).abs() < 0.1);
        assert!((envelope.at(65.0).ay_mps2 / 18.0 - 1.0).abs() < 0.1);
        // Sixth gear ends at 8500 rpm: 70 m/s.
        let top = 8500.0 * std::f64::consts::TAU / 60.0 / (1.2915 * 3.2) * 0.325;
        assert!((envelope.top_speed_mps() - top).abs() < 1e-3);
        // The engine limits where the tyres could do more, and the other way round.
        let fast = limits.speeds.last().unwrap();
        assert_eq!(fast.row.ax_drive_mps2, fast.engine_mps2);
        assert!(
            limits
                .speeds
                .iter()
                .all(|s| s.row.ax_drive_mps2 <= s.traction_mps2)
        );
        assert!(limits.handling.stability_factor_s2_per_m2.abs() < 0.01);
    }

    #[test]
    fn a_car_without_an_engine_and_absurd_settings_are_refused() {
        let mut car = Car::bundled().unwrap();
        let backwards = EnvelopeSettings {
            to_mps: 10.0,
            ..EnvelopeSettings::default()
        };
        assert!(
            car_envelope(&car, &backwards)
                .unwrap_err()
                .to_string()
                .contains("to")
        );
        car.powertrain = None;
        let error = car_envelope(&car, &EnvelopeSettings::default()).unwrap_err();
        assert!(error.to_string().contains("[powertrain]"));
    }
}
