//! What each tyre does at a moment of a drive: load, slip and forces of the 4DOF car as [`CarModel::rate`] has them.

use super::aero::aero_forces;
use super::loads::wheel_loads;
use super::model::wheel_slip;
use super::tyre::{LinearTyre, MagicFormula, Tyre, TyreInput, TyreModel};
use super::{Car, CarInput, CarModel, CarState};

/// One tyre at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// Vertical load (N); negative of a wheel that has lifted.
    pub load_n: f64,
    /// Slip ratio (-), positive when driven.
    pub slip_ratio: f64,
    /// Slip angle (rad), positive when the wheel drifts to its left.
    pub slip_angle_rad: f64,
    /// Force along the wheel (N).
    pub longitudinal_n: f64,
    /// Force across the wheel (N), positive to the left.
    pub lateral_n: f64,
}

impl Wheel {
    /// Force over load (-): the friction that is used. NaN of a wheel that has lifted.
    pub fn friction(&self) -> f64 {
        if self.load_n > 0.0 {
            self.longitudinal_n.hypot(self.lateral_n) / self.load_n
        } else {
            f64::NAN
        }
    }
}

/// Names of the four wheels, in the order of all that has four.
pub const WHEELS: [&str; 4] = ["fl", "fr", "rl", "rr"];

/// A car at a moment of a drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The tyres FL FR RL RR.
    pub wheels: [Wheel; 4],
    /// Longitudinal acceleration (m/s^2), as the replay compares it with logs,
    pub ax_mps2: f64,
    /// and lateral acceleration of the roll axis, positive to the left.
    pub ay_mps2: f64,
}

/// A car at each moment of a drive, from its states and inputs: as many as `driven` has, in its order.
pub fn moments_of(car: &Car, driven: &[(CarState<f64>, CarInput<f64>)]) -> Vec<Moment> {
    moments_under(car, driven, &[])
}

/// As [`moments_of`], on a road in three dimensions: `loads_mps2` is the car's load over its mass at each moment (m/s^2). The
/// accelerations are then those that sensors on the car read, with gravity's parts along and across it. Empty on a level road.
pub fn moments_under(
    car: &Car,
    driven: &[(CarState<f64>, CarInput<f64>)],
    loads_mps2: &[f64],
) -> Vec<Moment> {
    let flat = car.to_flat();
    match car.tyre_model() {
        TyreModel::MagicFormula => at(
            &CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat),
            driven,
            loads_mps2,
        ),
        TyreModel::Linear => at(
            &CarModel::<f64, LinearTyre<f64>>::from_parameters(&flat),
            driven,
            loads_mps2,
        ),
    }
}

fn at<T: Tyre<f64>>(
    car: &CarModel<f64, T>,
    driven: &[(CarState<f64>, CarInput<f64>)],
    loads_mps2: &[f64],
) -> Vec<Moment> {
    let chassis = &car.chassis;
    let sides = [1.0, -1.0];
    let places = [
        (
            chassis.cg_to_front,
            chassis.half_track_front,
            chassis.radius_front,
        ),
        (-chassis.cg_to_rear, chassis.half_track_rear, chassis.radius_rear),
    ];
    let moments = driven.iter().enumerate().map(|(i, (state, input))| {
        // A load is a gravity that the wheels feel.
        let mut car = *car;
        car.chassis.gravity = loads_mps2.get(i).copied().unwrap_or(car.chassis.gravity);
        let chassis = &car.chassis;
        let body = &state.body;
        let aero = aero_forces(chassis, body.vx, input.flap);
        let loads = wheel_loads(chassis, body, state.pitch_acceleration, &aero);
        let steer = input.steer * chassis.steer_scale + chassis.steer_offset;
        let axles = [0, 1].map(|axle| {
            let (x, half_track, radius) = places[axle];
            let turned = if axle == 0 {
                (steer.cos(), steer.sin())
            } else {
                (1.0, 0.0)
            };
            let inputs = [0, 1].map(|half| {
                let rim_speed = input.wheel_speed[2 * axle + half] * radius;
                let place = (x, half_track * sides[half]);
                let slip = wheel_slip(body, place, turned, rim_speed, chassis.slip_speed_floor);
                TyreInput {
                    load: loads[2 * axle + half],
                    slip_ratio: slip.ratio,
                    slip_tangent: slip.tangent,
                    side: sides[half],
                }
            });
            let forces = car.tyres[axle].axle_forces_on(inputs, input.friction);
            [0, 1].map(|half| Wheel {
                load_n: inputs[half].load,
                slip_ratio: inputs[half].slip_ratio,
                slip_angle_rad: inputs[half].slip_tangent.atan(),
                longitudinal_n: forces[half].x,
                lateral_n: forces[half].y,
            })
        });
        let [[fl, fr], [rl, rr]] = axles;
        let rate = car.rate(state, input);
        Moment {
            wheels: [fl, fr, rl, rr],
            ax_mps2: rate.ax,
            ay_mps2: rate.ay,
        }
    });
    moments.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::chassis::BodyState;

    /// The tyres' forces are those that move the car: with the drag they make its acceleration.
    #[test]
    fn forces_add_up_to_the_acceleration() {
        let mut car = Car::load("gt").unwrap();
        (car.chassis.drs_drag, car.chassis.drs_lift) = (20.0, 30.0);
        let flat = car.to_flat();
        let model = CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat);
        let state = CarState {
            body: BodyState {
                vx: 40.0,
                vy: -0.6,
                yaw_rate: 0.2,
                roll: 0.0,
                roll_rate: 0.0,
            },
            pitch_acceleration: 0.0,
        };
        let input = CarInput {
            wheel_speed: [40.0 / 0.33, 40.5 / 0.33, 41.0 / 0.33, 41.5 / 0.33],
            steer: 0.03,
            flap: 1.0,
            friction: None,
        };
        let [moment] = moments_of(&car, &[(state, input)])[..] else {
            panic!("one moment")
        };
        let [fl, fr, rl, rr] = moment.wheels;
        let chassis = &model.chassis;
        let steer = input.steer * chassis.steer_scale + chassis.steer_offset;
        let front = |w: &Wheel| w.longitudinal_n * steer.cos() - w.lateral_n * steer.sin();
        let drag = aero_forces(chassis, 40.0, 1.0).drag;
        let total = front(&fl) + front(&fr) + rl.longitudinal_n + rr.longitudinal_n - drag;
        let rate = model.rate(&state, &input);
        let ax = rate.ax;
        assert!(
            (total / chassis.mass - ax).abs() < 1e-9,
            "{total} N and {ax} m/s^2"
        );
        let side = |w: &Wheel| w.longitudinal_n * steer.sin() + w.lateral_n * steer.cos();
        let across = side(&fl) + side(&fr) + rl.lateral_n + rr.lateral_n;
        // Upright, the car's mass moves against its roll axis as the roll rate changes.
        let ay = across / chassis.mass + chassis.cg_height * rate.state.body.roll_rate;
        assert!((ay - moment.ay_mps2).abs() < 1e-9, "{ay} and {moment:?}");
        let downforce = aero_forces(chassis, 40.0, 1.0);
        let weight = chassis.mass * chassis.gravity + downforce.downforce_front + downforce.downforce_rear;
        let loads = fl.load_n + fr.load_n + rl.load_n + rr.load_n;
        assert!((loads - weight).abs() < 1e-6, "{loads} of {weight}");
        // It turns left: the tyres push to the left, within what rubber holds.
        for wheel in [fl, fr, rl, rr] {
            assert!(
                wheel.lateral_n > 0.0 && (0.01..3.0).contains(&wheel.friction()),
                "{wheel:?}"
            );
        }
        let lifted = Wheel { load_n: -1.0, ..fl };
        assert!(lifted.friction().is_nan());
    }
}
