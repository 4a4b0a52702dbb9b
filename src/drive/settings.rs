//! How the driver drives, and what the driver knows of the car.

use super::cornering::{CorneringMap, PREVIEW_S};
use super::driver::PEDAL_LAG_S;
use crate::error::Result;
use crate::vehicle::Car;

/// How the driver drives.
#[derive(Clone, Debug, PartialEq)]
pub struct DriverSettings {
    /// Share of the tyres' friction that is used, 0 to 1.
    pub pace: f64,
    /// Greatest slip ratio, driven or braked.
    pub slip_limit: f64,
    /// Slip stiffness per load with which the driver computes slip from force: the lower it is, the more slip a force takes.
    pub slip_stiffness: f64,
    /// How far ahead a driver looks who does not know the car, s.
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
    /// What the driver knows of the car, if anything: without the slip of its axles the driver would run wide or steer against the
    /// car's normal drift angle, and without its friction use grip for driving that the bend needs.
    pub knowledge: Option<CorneringMap<f64>>,
}

impl DriverSettings {
    /// How far ahead the driver looks for bends at the most (s).
    pub(super) fn furthest_s(&self) -> f64 {
        match self.knowledge {
            Some(_) => PREVIEW_S.1,
            None => self.preview_s.max(0.08),
        }
    }

    /// A driver who knows the car and follows a line as closely as it can be followed.
    ///
    /// # Errors
    /// As [`CorneringMap::of_car`].
    pub fn racing(car: &Car) -> Result<Self> {
        Ok(Self {
            heading_gain: 1.0,
            speed_gain_1ps: 6.0,
            // The acceleration leads by as much as the feet lag, so that a step of it leaves no error of speed. A driver who aims for
            // the speed ahead as well brakes early in every corner, and loses a hundredth of the lap.
            speed_ahead_s: 0.0,
            plan_ahead_s: PEDAL_LAG_S,
            knowledge: Some(CorneringMap::of_car(car)?),
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
