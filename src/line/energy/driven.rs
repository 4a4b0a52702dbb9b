//! The accounts of a lap that a car with four wheels drove: the motor does what its plan says, the engine the rest.

use super::EnergyCar;
use super::figures::{EnergyLap, SegmentEnergy};
use super::kernel::{Along, Car, State};
use super::plan::{EnergyPlan, Gates, Mode};
use crate::scalar::Lookup;

/// Where the motor works on a closed lap, by station: the share of its greatest force from each station to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorPlan {
    /// Rising stations (m), the first at the start line.
    pub station_m: Vec<f64>,
    /// The shares.
    pub share: Vec<f64>,
    /// Length of the lap (m).
    pub length_m: f64,
}

impl MotorPlan {
    /// The share at a station (m) before, on or after the lap.
    pub fn at(&self, station_m: f64) -> f64 {
        let along = station_m.rem_euclid(self.length_m);
        let after = self.station_m.partition_point(|s| *s <= along);
        self.share.get(after.max(1) - 1).copied().unwrap_or(0.0)
    }

    /// The mean share between two rising stations of one lap (m).
    pub fn mean(&self, from_m: f64, to_m: f64) -> f64 {
        let mut sum = 0.0;
        for (i, share) in self.share.iter().enumerate() {
            let end = self.station_m.get(i + 1).copied().unwrap_or(self.length_m);
            sum += share * (end.min(to_m) - self.station_m[i].max(from_m)).max(0.0);
        }
        sum / (to_m - from_m)
    }

    /// The same plan on a line of another length (m), place by place.
    #[must_use]
    pub fn stretched_to(&self, length_m: f64) -> Self {
        let scale = length_m / self.length_m;
        Self {
            station_m: self.station_m.iter().map(|s| scale * s).collect(),
            share: self.share.clone(),
            length_m,
        }
    }
}

/// A moment of a driven lap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrivenMoment {
    /// Time until the next moment (s); nothing happens in none.
    pub time_s: f64,
    /// Station along the line (m).
    pub station_m: f64,
    /// Speed (m/s).
    pub speed_mps: f64,
    /// Change of the speed (m/s^2).
    pub ax_mps2: f64,
    /// The part of gravity that the car climbs against (m/s^2), positive uphill.
    pub climb_mps2: f64,
    /// Power of the front and of the rear wheels on the road (W), negative when braking: force times the speed of the rim.
    pub wheels_w: [f64; 2],
    /// Drag of the air (N).
    pub drag_n: f64,
}

/// The accounts of a driven lap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrivenLapEnergy {
    /// The sums.
    pub lap: EnergyLap<f64>,
    /// From each moment to the next.
    pub segments: Vec<SegmentEnergy<f64>>,
    /// Work that moves the car along its way (J), where it is driven: against drag, rolling resistance, inertia and gravity. What engine and
    /// motor bring to the wheels beyond that is lost in the tyres, which slip and which drag in bends.
    pub moving_j: f64,
}

impl EnergyCar {
    /// The greatest forces of engine, motor, generator and of the MGU-H as a motor over the mass (m/s^2) at a speed (m/s), at the
    /// wheels.
    pub fn greatest_mps2(&self, speed_mps: f64) -> [f64; 4] {
        let table = &self.table;
        let square = speed_mps * speed_mps;
        let argument = square * table.rows_per_speed_squared;
        let [engine, motor, generator, _] = argument.between_rows(&table.forces);
        let assist = if table.assists && square < table.exhaust_from {
            table.rotating * argument.between_rows(&table.boosts)[3]
        } else {
            0.0
        };
        [engine, motor, generator, assist]
    }

    /// The greatest force of both motors over the mass (m/s^2) at a speed (m/s), at the wheels.
    pub fn greatest_motors_mps2(&self, speed_mps: f64) -> f64 {
        let [_, motor, _, assist] = self.greatest_mps2(speed_mps);
        motor + assist
    }
}

/// The accounts of a lap of `moments` by `plan`, moment by moment.
///
/// The force that engine and motor bring to the wheels moves the road under the tyres, the slip included, and turns the rotating
/// masses against the rolling resistance. On the brakes the generator takes from the rear wheels, which it turns with.
pub fn driven_energy(car: &EnergyCar, plan: &MotorPlan, moments: &[DrivenMoment]) -> DrivenLapEnergy {
    let table = &car.table;
    let figures = car.gate_figures(&Gates::of_zones(1e6));
    let kernel = Car {
        envelope: &car.envelope_table,
        table,
        plan: &EnergyPlan::whole(1, 0, Mode::Offset),
        strategy: &figures,
        drs: &[],
    };
    let mut state = State::at(0.0);
    let rolling = car.car.rolling_mps2();
    let mut driven = DrivenLapEnergy::default();
    let lap = &mut driven.lap;
    let (mut greatest_change, mut least_change) = (0.0f64, 0.0f64);
    for (i, moment) in moments.iter().enumerate() {
        let next = moments.get(i + 1).map_or(moment.speed_mps, |m| m.speed_mps);
        if moment.time_s <= 0.0 {
            driven.segments.push(SegmentEnergy::default());
            continue;
        }
        let v = 0.5 * (moment.speed_mps + next);
        let length = v * moment.time_s;
        let per_mass = 1.0 / (table.mass * moment.speed_mps);
        let turning = rolling + (table.rotating - 1.0) * moment.ax_mps2;
        let force = (moment.wheels_w[0] + moment.wheels_w[1]) * per_mass + turning;
        let front_brakes = (-moment.wheels_w[0] * per_mass).max(0.0);
        let [demand, braking] = [force, -force].map(|f| f.max(0.0));
        let shed = (braking - front_brakes).max(0.0);
        let [engine_most, motor_most, generator_most, assist_most] = car.greatest_mps2(v);
        let share = plan.at(moment.station_m);
        let reach = kernel.reach(kernel.left(&state), 1.0 / length);
        let wanted = ((motor_most + assist_most) * share).min(demand);
        let own = wanted.min(motor_most).min(reach);
        let assist = (wanted - motor_most)
            .max(0.0)
            .min((reach - own) * table.assist_share);
        let along = Along {
            ends: [moment.speed_mps, next].map(|v| v * v),
            mean: v * v,
            ax: moment.ax_mps2,
            length,
            time: moment.time_s,
        };
        let space = table.store_room - state.change;
        let mut segment = kernel.accounts(
            &mut state,
            &along,
            [demand, shed, own + assist, assist],
            [engine_most, generator_most],
            space,
        );
        segment.hydraulic += braking - shed;
        let ax = 0.5 * (next * next - moment.speed_mps.powi(2)) / length;
        let moving = table.rotating * ax + moment.drag_n / table.mass + rolling + moment.climb_mps2;
        driven.moving_j += table.mass * length * moving.max(0.0);
        lap.time += segment.time;
        lap.fuel += segment.fuel;
        lap.deployed += segment.deployed;
        lap.harvested_k += segment.harvested_k;
        lap.harvested_h += segment.harvested_h;
        lap.motor_time += if segment.deployed > 0.0 { segment.time } else { 0.0 };
        greatest_change = greatest_change.max(state.change);
        least_change = least_change.min(state.change);
        driven.segments.push(segment);
    }
    lap.change = state.change;
    lap.swing = greatest_change - least_change;
    driven
}
