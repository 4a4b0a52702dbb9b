//! Speeds of wheels that a log does not have.

use crate::telemetry::{Axle, Log};
use crate::vehicle::chassis::BodyState;
use crate::vehicle::model::wheel_speeds;
use crate::vehicle::{Car, Chassis};

/// The greatest slip ratio (-) that is taken for a wheel whose speed is not logged: near a tyre's peak.
const GREATEST_SLIP: f64 = 0.1;
/// The slip ratio (-) at which a tyre's slip stiffness is read off.
const SMALL_SLIP: f64 = 1e-3;

/// What turns the logged motion into speeds of the wheels that are not logged: each follows the path of its hub, with the slip by
/// which the starting car's tyres give the logged longitudinal acceleration.
pub(super) struct StandIn<'a> {
    log: &'a Log,
    chassis: Chassis<f64>,
    /// Longitudinal force over slip ratio (N) of the front and the rear axle.
    stiffness_n: [f64; 2],
    /// The axle that only brakes: 0 in front, 1 at the rear.
    undriven: usize,
}

impl<'a> StandIn<'a> {
    pub fn new(log: &'a Log, car: &Car, undriven: Axle) -> Self {
        let chassis = car.chassis;
        let wheelbase = chassis.cg_to_front + chassis.cg_to_rear;
        let weight = chassis.mass * chassis.gravity;
        let loads = [chassis.cg_to_rear, chassis.cg_to_front].map(|arm| 0.5 * weight * arm / wheelbase);
        let tyres = car.axle_tyres();
        let stiffness_n = [0, 1].map(|axle| {
            let force = |slip: f64| tyres[axle].forces(loads[axle], slip, 0.0).x;
            (force(SMALL_SLIP) - force(-SMALL_SLIP)) / SMALL_SLIP
        });
        Self {
            log,
            chassis,
            stiffness_n,
            undriven: usize::from(undriven == Axle::Rear),
        }
    }

    /// Speeds FL FR RL RR (rad/s) at a sample: those that are logged, and what stands in for the others.
    pub fn wheel_speeds(&self, sample: usize) -> [f64; 4] {
        let logged = &self.log.wheel_speed_radps;
        if logged.iter().all(|wheel| !wheel.is_empty()) {
            return [0, 1, 2, 3].map(|wheel| logged[wheel][sample]);
        }
        let c = &self.chassis;
        let speed = self.log.vx_mps[sample];
        let body = BodyState {
            vx: speed,
            vy: 0.0,
            yaw_rate: self.log.yaw_rate_radps[sample],
            roll: 0.0,
            roll_rate: 0.0,
        };
        let drag = 0.5 * c.air_density * c.drag_area * (speed + c.headwind).powi(2);
        let force = c.mass * self.log.ax_mps2[sample] + drag;
        let [front, rear] = self.stiffness_n;
        // All wheels brake, one axle drives.
        let mut slips = [force / (front + rear); 2];
        if force > 0.0 {
            slips[self.undriven] = 0.0;
            slips[1 - self.undriven] = force / self.stiffness_n[1 - self.undriven];
        }
        let slips = slips.map(|slip| slip.clamp(-GREATEST_SLIP, GREATEST_SLIP));
        let angle = c.steer_scale * self.log.steer_rad[sample] + c.steer_offset;
        let turned = wheel_speeds(c, &body, (angle.cos(), angle.sin()), slips);
        [0, 1, 2, 3].map(|wheel| logged[wheel].get(sample).copied().unwrap_or(turned[wheel]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{IdentifySettings, set_up};
    use super::*;

    /// The lap of the bundled car, whose wheels are known: within one per cent on the root mean square.
    #[test]
    fn wheels_that_are_not_logged_turn_as_the_car_moves() {
        let setup = set_up(&IdentifySettings::default()).unwrap();
        let logged = &setup.log.wheel_speed_radps;
        let car = Car::bundled().unwrap();
        let mut without = setup.log.clone();
        without.wheel_speed_radps = Default::default();
        let stand_in = StandIn::new(&without, &car, Axle::Front);
        let mut squares = 0.0;
        for i in 0..without.samples() {
            let found = stand_in.wheel_speeds(i).into_iter().zip(logged);
            squares += found
                .map(|(found, logged)| (found / logged[i] - 1.0).powi(2))
                .sum::<f64>();
        }
        let rms = (squares / (4 * without.samples()) as f64).sqrt();
        assert!(rms < 0.01, "{rms}");

        let mut rear_only = without.clone();
        rear_only.wheel_speed_radps[2] = logged[2].clone();
        let found = StandIn::new(&rear_only, &car, Axle::Front).wheel_speeds(100);
        assert_eq!(found[2], logged[2][100]);
        assert_eq!(found[0], stand_in.wheel_speeds(100)[0]);
    }
}
