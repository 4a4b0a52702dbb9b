//! A path-following driver: steering by preview and feedback, drive and brake by limited wheel slip.

use super::speed_plan::SpeedPlan;
use crate::error::{Error, Result};
use crate::track::Circuit;
use crate::vehicle::model::runge_kutta_step;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{Car, CarInput, CarModel, CarState, LinearTyre, MagicFormula, TyreModel, steady_car};
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
    /// How much the driver steers against an angle to the path, rad per rad.
    pub heading_gain: f64,
    /// Acceleration that the driver adds for every m/s that the plan is ahead, 1/s.
    pub speed_gain_1ps: f64,
    /// What the driver knows of the car, if anything.
    pub knowledge: Option<CarKnowledge>,
}

/// What a driver who knows the car reckons with: without it the car's own angle to its path looks like an error to steer
/// against, and a foot that is down in a bend takes grip that the bend needs.
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
            let trims = steady.cornering(speed, car.max_steer_rad.max(0.3));
            let most = trims.iter().map(|t| t.ay_mps2).fold(0.0, f64::max);
            let load = c.gravity + 0.5 * c.air_density * c.lift_area * speed * speed / c.mass;
            frictions.push(most / load);
            let ridge = trims.iter().position(|t| t.ay_mps2 == most).unwrap_or(0);
            slips.extend(
                trims[..=ridge.min(trims.len().saturating_sub(1))]
                    .iter()
                    .filter(|t| (0.6..0.9).contains(&(t.ay_mps2 / most)))
                    // Without slip the rear axle follows the path: its share of the angle is geometry.
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
            top_speed_mps: 70.0,
            heading_gain: 0.55,
            speed_gain_1ps: 1.8,
            knowledge: None,
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

impl Drive {
    /// Time of the lap (s), whose length (m) and sample interval (s) are given: the samples' own, less what the first
    /// was late and more what the last was short.
    pub fn lap_time_s(&self, length_m: f64, interval_s: f64) -> Option<f64> {
        let (first, last) = (self.station_m.first()?, self.station_m.last()?);
        let (from, to) = (self.states.first()?[0], self.states.last()?[0]);
        Some((self.states.len() - 1) as f64 * interval_s + (length_m - last) / to + first / from)
    }
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
    let plan = SpeedPlan::new(car, circuit, settings.pace, settings.top_speed_mps);
    drive_planned(car, circuit, plan, settings, interval_s).map_err(|error| match error {
        Error::Study(what) => Error::Study(format!("{what}; try a lower pace than {}", settings.pace)),
        other => other,
    })
}

/// As [`drive`], at the speeds of `plan` instead of the driver's own.
///
/// # Errors
/// As [`drive`].
pub fn drive_planned(
    car: &Car,
    circuit: &Circuit,
    plan: SpeedPlan,
    settings: &DriverSettings,
    interval_s: f64,
) -> Result<Drive> {
    let flat = car.to_flat();
    match car.tyre_model() {
        TyreModel::MagicFormula => drive_model::<MagicFormula<f64>>(
            &CarModel::from_parameters(|i| flat[i]),
            car,
            circuit,
            plan,
            settings,
            interval_s,
        ),
        TyreModel::Linear => drive_model::<LinearTyre<f64>>(
            &CarModel::from_parameters(|i| flat[i]),
            car,
            circuit,
            plan,
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
        let bend = self.circuit.curvature_at(station);
        let sideslip = self
            .settings
            .knowledge
            .map_or(0.0, |k| c.cg_to_rear * bend - k.rear_slip_per_ay * bend * v * v);
        let heading = heading_error + sideslip + offset * 0.9 / (v * 0.45 + 3.0);
        let yaw_lack = self.circuit.curvature_at(station + 0.08 * v) * v - state.body.yaw_rate;
        let wanted =
            wheelbase * curvature + understeer - self.settings.heading_gain * heading + 0.045 * yaw_lack;
        let wanted = wanted.clamp(-self.car.max_steer_rad, self.car.max_steer_rad);
        let rate = ((wanted - self.steer) / STEER_LAG).clamp(-STEER_RATE, STEER_RATE);
        self.steer += rate * STEP;

        let planned = self.plan.speed_at(station + 0.1 * v);
        let behind = planned - state.body.vx;
        let wanted = self.plan.acceleration_at(station + 0.15 * v) + self.settings.speed_gain_1ps * behind;
        let drag = 0.5 * c.air_density * c.drag_area * v * v;
        let force = c.mass * wanted + drag;
        let weight = c.mass * c.gravity + 0.5 * c.air_density * c.lift_area * v * v;
        // What a bend leaves of the tyres, by the friction circle.
        let left = self.settings.knowledge.map_or(1.0, |k| {
            let used = (state.body.yaw_rate * v / (k.friction * weight / c.mass))
                .abs()
                .min(1.0);
            (1.0 - used * used).max(0.01).sqrt()
        });
        let limit = self.settings.slip_limit * left;
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
    plan: SpeedPlan,
    settings: &DriverSettings,
    interval_s: f64,
) -> Result<Drive> {
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
                "the driver {what} at station {station:.0} m of {} ({:.1} m/s)",
                circuit.name, state.body.vx
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
