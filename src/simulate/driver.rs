//! A path-following driver: steering by preview and feedback, drive and brake by limited wheel slip.

use super::speed_plan::SpeedPlan;
use crate::error::{Error, Result};
use crate::track::Circuit;
use crate::vehicle::model::runge_kutta_step;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{Car, CarInput, CarModel, CarState, LinearTyre, MagicFormula, TyreModel};
use glam::DVec2;

/// How the driver drives.
#[derive(Clone, Debug, PartialEq)]
pub struct DriverSettings {
    /// Share of the tyres' friction that is used, 0 to 1.
    pub pace: f64,
    /// Greatest slip ratio, driven or braked.
    pub slip_limit: f64,
    /// Slip stiffness per load that the driver's feet reckon with: the lower, the more slip for a wanted force.
    pub slip_stiffness: f64,
    /// How far ahead the driver looks, s.
    pub preview_s: f64,
    /// Speed not to exceed, m/s.
    pub top_speed_mps: f64,
}

impl Default for DriverSettings {
    fn default() -> Self {
        Self {
            pace: 0.9,
            slip_limit: 0.14,
            slip_stiffness: 18.0,
            preview_s: 0.25,
            top_speed_mps: 70.0,
        }
    }
}

/// One driven lap: what the wheels and the steering did, at a uniform rate.
#[derive(Clone, Debug, Default)]
pub struct Drive {
    /// Wheel speeds FL FR RL RR and road-wheel angle at each sample, rad/s and rad.
    pub inputs: Vec<([f64; 4], f64)>,
    /// State at each sample, in the order of [`CarState::to_array`].
    pub states: Vec<[f64; 6]>,
    /// Distance driven along the centreline from the start line, m.
    pub station_m: Vec<f64>,
    /// Distance from the centreline, left positive, m.
    pub offset_m: Vec<f64>,
}

/// Integration step of the closed loop, s.
const STEP: f64 = 1e-3;
/// Time constant with which wheel slip follows the pedals, s.
const PEDAL_LAG: f64 = 0.06;
/// Time constant and greatest rate (rad/s) of the driver's arms.
const STEER_LAG: f64 = 0.04;
const STEER_RATE: f64 = 0.9;

/// Drives one flying lap and samples it every `interval_s` seconds.
///
/// # Errors
/// [`Error::Study`] if the car spins or leaves the track, saying where.
pub fn drive(car: &Car, circuit: &Circuit, settings: &DriverSettings, interval_s: f64) -> Result<Drive> {
    let flat = car.to_flat();
    match car.tyre_model() {
        TyreModel::MagicFormula => drive_model::<MagicFormula<f64>>(
            &CarModel::from_parameters(|i| flat[i]),
            car,
            circuit,
            settings,
            interval_s,
        ),
        TyreModel::Linear => drive_model::<LinearTyre<f64>>(
            &CarModel::from_parameters(|i| flat[i]),
            car,
            circuit,
            settings,
            interval_s,
        ),
    }
}

struct Driver<'a> {
    car: &'a Car,
    circuit: &'a Circuit,
    settings: &'a DriverSettings,
    plan: SpeedPlan,
    steer: f64,
    front_slip: f64,
    rear_slip: f64,
}

impl Driver<'_> {
    /// Moves arms and feet for one step, from the pose on the circuit.
    fn act(&mut self, state: &CarState<f64>, station: f64, offset: f64, heading_error: f64) {
        let c = &self.car.chassis;
        let v = state.body.vx.max(3.0);
        let wheelbase = c.cg_to_front + c.cg_to_rear;
        let ahead = station + self.settings.preview_s * v;
        let curvature = self.circuit.curvature_at(ahead);
        // Feed-forward: geometry plus the understeer of a car near its limit; feedback: offset, heading and
        // the yaw rate that the present curvature asks for.
        let understeer = 0.0025 * curvature * v * v / c.gravity * wheelbase;
        let heading = heading_error + offset * 0.9 / (v * 0.45 + 3.0);
        let yaw_lack = self.circuit.curvature_at(station + 0.08 * v) * v - state.body.yaw_rate;
        let wanted = wheelbase * curvature + understeer - 0.55 * heading + 0.045 * yaw_lack;
        let wanted = wanted.clamp(-self.car.max_steer_rad, self.car.max_steer_rad);
        let rate = ((wanted - self.steer) / STEER_LAG).clamp(-STEER_RATE, STEER_RATE);
        self.steer += rate * STEP;

        let planned = self.plan.speed_at(station + 0.1 * v);
        let wanted = self.plan.acceleration_at(station + 0.15 * v) + 1.8 * (planned - state.body.vx);
        let drag = 0.5 * c.air_density * c.drag_area * v * v;
        let force = c.mass * wanted + drag;
        let weight = c.mass * c.gravity + 0.5 * c.air_density * c.lift_area * v * v;
        let limit = self.settings.slip_limit;
        let (front, rear) = if force >= 0.0 {
            let most = self
                .car
                .powertrain
                .as_ref()
                .map_or(f64::INFINITY, |p| p.wheel_force(v, c.radius_rear));
            (
                0.0,
                (force.min(most) / (0.55 * weight * self.settings.slip_stiffness)).min(limit),
            )
        } else {
            let slip = (force / (weight * self.settings.slip_stiffness)).max(-limit);
            (slip, 0.75 * slip)
        };
        self.front_slip += (front - self.front_slip) * STEP / PEDAL_LAG;
        self.rear_slip += (rear - self.rear_slip) * STEP / PEDAL_LAG;
    }

    /// The wheel speeds that give the wheels the wanted slip.
    fn input(&self, state: &CarState<f64>) -> CarInput<f64> {
        let c = &self.car.chassis;
        let turned = (self.steer.cos(), self.steer.sin());
        let wheel = |x: f64, y: f64, direction: (f64, f64), slip: f64, radius: f64| {
            let hub = direction.0 * (state.body.vx - state.body.yaw_rate * y)
                + direction.1 * (state.body.vy + state.body.yaw_rate * x);
            (hub + slip * hub.abs().max(c.slip_speed_floor)) / radius
        };
        let (a, b) = (c.cg_to_front, c.cg_to_rear);
        let (wf, wr) = (c.half_track_front, c.half_track_rear);
        CarInput {
            wheel_speed: [
                wheel(a, wf, turned, self.front_slip, c.radius_front),
                wheel(a, -wf, turned, self.front_slip, c.radius_front),
                wheel(-b, wr, (1.0, 0.0), self.rear_slip, c.radius_rear),
                wheel(-b, -wr, (1.0, 0.0), self.rear_slip, c.radius_rear),
            ],
            steer: self.steer,
        }
    }
}

/// How long before the start line the flying lap begins, m.
const RUN_UP: f64 = 500.0;

fn drive_model<T: Tyre<f64>>(
    model: &CarModel<f64, T>,
    car: &Car,
    circuit: &Circuit,
    settings: &DriverSettings,
    interval_s: f64,
) -> Result<Drive> {
    let plan = SpeedPlan::new(car, circuit, settings.pace, settings.top_speed_mps);
    let begin = circuit.length_m - RUN_UP.min(0.4 * circuit.length_m);
    let mut state = CarState::straight(plan.speed_at(begin));
    let mut driver = Driver {
        car,
        circuit,
        settings,
        plan,
        steer: 0.0,
        front_slip: 0.0,
        rear_slip: 0.0,
    };
    let mut position: DVec2 = circuit.position_at(begin);
    let mut yaw = circuit.heading_at(begin);
    let mut station = begin;
    let mut travelled = begin;
    let mut log = Drive::default();
    let mut next_sample: Option<f64> = None;
    let mut time = 0.0;
    // A lap slower than this mean speed is no lap.
    let most_time = (2.0 * circuit.length_m) / 5.0;
    loop {
        let projection = circuit.project(position, station);
        let moved = (projection.station_m - station + 0.5 * circuit.length_m).rem_euclid(circuit.length_m)
            - 0.5 * circuit.length_m;
        station = projection.station_m;
        travelled += moved;
        let lap_distance = travelled - circuit.length_m;
        let offset = projection.lateral_offset_m;
        let (left, right) = circuit.widths_at(station);
        if !state.drives() || offset > left || -offset > right || time > most_time {
            let what = if state.drives() { "left the track" } else { "spun" };
            return Err(Error::Study(format!(
                "the driver {what} at station {station:.0} m of {} ({:.1} m/s); try a lower pace than {}",
                circuit.name, state.body.vx, settings.pace
            )));
        }
        driver.act(&state, station, offset, projection.heading_error_rad(yaw));
        let input = driver.input(&state);
        if lap_distance >= 0.0 {
            let due = *next_sample.get_or_insert(time);
            if time >= due - 0.5 * STEP {
                log.inputs.push((input.wheel_speed, input.steer));
                log.states.push(state.to_array());
                log.station_m.push(lap_distance);
                log.offset_m.push(offset);
                next_sample = Some(due + interval_s);
            }
        }
        if lap_distance >= circuit.length_m {
            return Ok(log);
        }
        let next = runge_kutta_step(model, &state, |_| input, STEP, |_| {});
        let middle_yaw = yaw + 0.25 * STEP * (state.body.yaw_rate + next.body.yaw_rate);
        let velocity = DVec2::new(
            0.5 * (state.body.vx + next.body.vx),
            0.5 * (state.body.vy + next.body.vy),
        );
        position += DVec2::from_angle(middle_yaw).rotate(velocity) * STEP;
        yaw += 0.5 * STEP * (state.body.yaw_rate + next.body.yaw_rate);
        state = next;
        time += STEP;
    }
}
