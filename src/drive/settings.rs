//! How the driver drives, and what the driver knows of the car.

use super::driver::PEDAL_LAG_S;
use super::plan::load_mps2;
use crate::error::{Error, Result};
use crate::vehicle::{Car, Turn, steady_car};

/// How the driver drives.
#[derive(Clone, Debug, PartialEq)]
pub struct DriverSettings {
    /// Share of the tyres' friction that is used, 0 to 1.
    pub pace: f64,
    /// Greatest slip ratio, driven or braked.
    pub slip_limit: f64,
    /// Slip stiffness per load with which the driver computes slip from force: the lower it is, the more slip a force takes.
    pub slip_stiffness: f64,
    /// How far ahead the driver looks, s.
    pub preview_s: f64,
    /// How far ahead in the plan the driver takes the speed to aim for, s,
    pub speed_ahead_s: f64,
    /// and the acceleration.
    pub plan_ahead_s: f64,
    /// Speed not to exceed, m/s.
    pub top_speed_mps: f64,
    /// How much the driver steers against an angle to the path, rad per rad.
    pub heading_gain: f64,
    /// Acceleration that the driver adds for every m/s that the plan is ahead, 1/s.
    pub speed_gain_1ps: f64,
    /// What the driver knows of the car, if anything.
    pub knowledge: Option<CarKnowledge>,
}

/// What a driver who knows the car computes with. Without the first figure the driver would steer against the car's normal drift
/// angle. Without the second the driver would use grip for driving that the bend needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarKnowledge {
    /// Slip angle of the rear axle for every m/s^2 of lateral acceleration (rad s^2/m): it turns the car into the bend.
    pub rear_slip_per_ay: f64,
    /// Lateral acceleration that the tyres give for every m/s^2 of load over mass: a coefficient of friction.
    pub friction: f64,
}

impl CarKnowledge {
    /// From the car's steady states in bends at 60% to 90% of the greatest lateral acceleration.
    ///
    /// # Errors
    /// [`Error::Study`] if the car has none.
    pub fn of_car(car: &Car) -> Result<Self> {
        let c = &car.chassis;
        let steady = steady_car(car);
        let mut slips = Vec::new();
        let mut frictions = Vec::new();
        for speed in [25.0f64, 40.0, 55.0] {
            let trims = steady.cornering(speed, car.max_steer_rad.max(0.3), Turn::Left);
            let most = trims.iter().map(|t| t.ay_mps2).fold(0.0, f64::max);
            if most == 0.0 {
                continue;
            }
            let load = load_mps2(c, speed);
            frictions.push(most / load);
            let ridge = trims.iter().position(|t| t.ay_mps2 == most).unwrap_or(0);
            slips.extend(
                trims
                    .iter()
                    .take(ridge + 1)
                    .filter(|t| (0.6..0.9).contains(&(t.ay_mps2 / most)))
                    // Without slip the rear axle follows the path. That part of the angle is geometry.
                    .map(|t| c.cg_to_rear / (speed * speed) - t.sideslip_rad / t.ay_mps2),
            );
        }
        if slips.is_empty() {
            return Err(Error::Study(format!("{} has no steady state in bends", car.name)));
        }
        Ok(Self {
            rear_slip_per_ay: slips.iter().sum::<f64>() / slips.len() as f64,
            friction: frictions.iter().copied().fold(f64::INFINITY, f64::min),
        })
    }
}

impl DriverSettings {
    /// A driver who knows the car and follows a line as closely as it can be followed.
    ///
    /// # Errors
    /// As [`CarKnowledge::of_car`].
    pub fn racing(car: &Car) -> Result<Self> {
        Ok(Self {
            heading_gain: 0.8,
            speed_gain_1ps: 3.0,
            // What the feet lag behind: who looks further brakes early in every corner, for a hundredth of the lap.
            speed_ahead_s: PEDAL_LAG_S,
            plan_ahead_s: PEDAL_LAG_S,
            knowledge: Some(CarKnowledge::of_car(car)?),
            ..Self::default()
        })
    }
}

impl Default for DriverSettings {
    fn default() -> Self {
        Self {
            pace: 0.9,
            slip_limit: 0.14,
            slip_stiffness: 18.0,
            preview_s: 0.25,
            speed_ahead_s: 0.1,
            plan_ahead_s: 0.15,
            top_speed_mps: 70.0,
            heading_gain: 0.55,
            speed_gain_1ps: 1.8,
            knowledge: None,
        }
    }
}
