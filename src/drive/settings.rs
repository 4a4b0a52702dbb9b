//! How the driver drives, and what the driver knows of the car.

use super::driver::PEDAL_LAG_S;
use super::plan::load_mps2;
use crate::error::{Error, Result};
use crate::vehicle::{Car, Turn, steady_car};
use nalgebra::{Matrix2, Vector2};

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

/// What a driver who knows the car computes with: its steady cornering. Without the slip of its axles the driver would run wide or
/// steer against the car's normal drift angle. Without the friction the driver would use grip for driving that the bend needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarKnowledge {
    /// Steering beyond the wheelbase times the curvature (rad), over the lateral acceleration (m/s^2): `p` and `q` of `p + q u^4`
    /// (rad s^2/m), where `u` is the share of the grip that is used.
    pub understeer: [f64; 2],
    /// Slip angle of the rear axle, which turns the car into the bend, likewise.
    pub rear_slip: [f64; 2],
    /// Lateral acceleration that the tyres give for every m/s^2 of load over mass: a coefficient of friction.
    pub friction: f64,
}

/// Speeds at which the car's steady cornering is looked at (m/s).
const SPEEDS_MPS: [f64; 5] = [15.0, 25.0, 40.0, 55.0, 70.0];
/// Share of the greatest lateral acceleration up to which it is: beyond it the axle that gives way first takes any angle.
const MOST_SHARE: f64 = 0.96;

impl CarKnowledge {
    /// From the car's steady states in bends, up to 0.96 of the greatest lateral acceleration.
    ///
    /// # Errors
    /// [`Error::Study`] if the car has none.
    pub fn of_car(car: &Car) -> Result<Self> {
        let c = &car.chassis;
        let wheelbase = c.cg_to_front + c.cg_to_rear;
        let steady = steady_car(car);
        let mut friction = f64::INFINITY;
        // Lateral acceleration, what the tyres carry, understeer and slip of the rear axle.
        let mut states: Vec<[f64; 4]> = Vec::new();
        for speed in SPEEDS_MPS {
            let trims = steady.cornering(speed, car.max_steer_rad.max(0.3), Turn::Left);
            let most = trims.iter().map(|t| t.ay_mps2).fold(0.0, f64::max);
            if most == 0.0 {
                continue;
            }
            let load = load_mps2(c, speed);
            friction = friction.min(most / load);
            let ridge = trims.iter().position(|t| t.ay_mps2 == most).unwrap_or(0);
            let before = trims.iter().take(ridge + 1);
            states.extend(before.filter(|t| t.ay_mps2 < MOST_SHARE * most).map(|t| {
                // Without slip the axles follow the path. That part of the angles is geometry.
                let bend = t.ay_mps2 / (speed * speed);
                let (understeer, rear_slip) = (
                    t.steer_rad - wheelbase * bend,
                    c.cg_to_rear * bend - t.sideslip_rad,
                );
                [t.ay_mps2, load, understeer, rear_slip]
            }));
        }
        // Least squares over the angles themselves.
        let fitted = |angle: usize| -> Option<[f64; 2]> {
            let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
            for state in &states {
                let share = (state[0] / (friction * state[1])).min(1.0);
                let terms = Vector2::new(state[0], state[0] * share.powi(4));
                normal += terms * terms.transpose();
                right += terms * state[angle];
            }
            normal.lu().solve(&right).map(Into::into)
        };
        match (fitted(2), fitted(3)) {
            (Some(understeer), Some(rear_slip)) => Ok(Self {
                understeer,
                rear_slip,
                friction,
            }),
            _ => Err(Error::Study(format!("{} has no steady state in bends", car.name))),
        }
    }
}

impl DriverSettings {
    /// A driver who knows the car and follows a line as closely as it can be followed.
    ///
    /// # Errors
    /// As [`CarKnowledge::of_car`].
    pub fn racing(car: &Car) -> Result<Self> {
        Ok(Self {
            heading_gain: 1.0,
            speed_gain_1ps: 6.0,
            // The acceleration leads by as much as the feet lag, so that a step of it leaves no error of speed. A driver who aims for
            // the speed ahead as well brakes early in every corner, and loses a hundredth of the lap.
            speed_ahead_s: 0.0,
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
