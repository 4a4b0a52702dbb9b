//! One lap, driven in `f64` and recorded.

use super::driver::{DriverTable, Pace, WheelTorque, cornering_of};
use super::kernel::{DriveState, World, drive_step, ending};
use super::plan::SpeedPlan;
use super::road::{Course, Line, Road};
use super::settings::DriverSettings;
use crate::error::{Error, Result};
use crate::track::Circuit;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{Car, CarInput, CarModel, LinearTyre, MagicFormula, TyreModel};
use glam::DVec2;

/// One driven lap: what the wheels and the steering did, at a uniform rate.
#[derive(Clone, Debug, Default)]
pub struct Drive {
    /// What the wheels, the steering and the DRS did at each sample.
    pub inputs: Vec<CarInput<f64>>,
    /// State at each sample, in the order of [`crate::vehicle::CarState::to_array`].
    pub states: Vec<[f64; 6]>,
    /// Distance driven along the centreline from the start line, m.
    pub station_m: Vec<f64>,
    /// Distance from the centreline, left positive, m.
    pub offset_m: Vec<f64>,
    /// Load over mass at each sample (m/s^2) on a road that is not level and dry; empty on one that is.
    pub loads_mps2: Vec<f64>,
}

impl Drive {
    /// Time (s) of a lap of this length (m), sampled at this interval (s). The first sample lies behind the start line and the
    /// last one before the finish line: the time is corrected for both. None of a drive that did not reach the finish line.
    pub fn lap_time_s(&self, length_m: f64, interval_s: f64) -> Option<f64> {
        let (first, last) = (self.station_m.first()?, self.station_m.last()?);
        let (from, to) = (self.states.first()?[0], self.states.last()?[0]);
        let left_s = (length_m - last) / to;
        // The next sample would lie behind the finish line.
        let finished = left_s.abs() < 2.0 * interval_s;
        finished.then(|| (self.states.len() - 1) as f64 * interval_s + left_s + first / from)
    }

    /// Least room between the car's side and an edge (m), of a circuit whose widths are the room that the side has.
    pub fn least_room_m(&self, circuit: &Circuit) -> f64 {
        let places = self.station_m.iter().zip(&self.offset_m);
        let room = |(station, offset): (&f64, &f64)| {
            let (left, right) = circuit.widths_at(*station);
            (left - offset).min(right + offset)
        };
        places.map(room).fold(f64::INFINITY, f64::min)
    }

    /// Where the car went on the circuit that it was driven round (m).
    pub fn points_m(&self, circuit: &Circuit) -> Vec<DVec2> {
        let places = self.station_m.iter().zip(&self.offset_m);
        let point = |(station, offset): (&f64, &f64)| {
            let heading = DVec2::from_angle(circuit.heading_at(*station));
            circuit.position_at(*station) + *offset * heading.perp()
        };
        places.map(point).collect()
    }
}

/// Integration step of the closed loop, s.
pub(super) const STEP: f64 = 1e-3;

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

/// Where and how a car was lost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lost {
    /// Station along the line (m).
    pub station_m: f64,
    /// Speed (m/s).
    pub speed_mps: f64,
    /// What the driver did, in words.
    pub how: &'static str,
}

/// As [`drive`], at the speeds of `plan` instead of the driver's own.
///
/// # Errors
/// As [`drive`]; [`Error::Input`] for a circuit that [`Road::new`] refuses.
pub fn drive_planned(
    car: &Car,
    circuit: &Circuit,
    plan: SpeedPlan,
    settings: &DriverSettings,
    interval_s: f64,
) -> Result<Drive> {
    drive_with_motor(car, circuit, plan, settings, interval_s, None)
}

/// As [`drive_planned`], by a car that may have a motor beside its engine.
///
/// # Errors
/// As [`drive_planned`].
pub fn drive_with_motor(
    car: &Car,
    circuit: &Circuit,
    plan: SpeedPlan,
    settings: &DriverSettings,
    interval_s: f64,
    motor: Option<MotorTorque<'_>>,
) -> Result<Drive> {
    match drive_until_lost(car, circuit, plan, settings, interval_s, motor)? {
        (drive, None) => Ok(drive),
        (_, Some(lost)) => Err(Error::Study(format!(
            "the driver {} at station {:.0} m of {} ({:.1} m/s)",
            lost.how, lost.station_m, circuit.name, lost.speed_mps
        ))),
    }
}

/// Torque (N m) that a motor brings to the driven wheels beside the engine, at a station along the line (m) and a speed (m/s).
pub type MotorTorque<'a> = &'a dyn Fn(f64, f64) -> f64;

/// As [`drive_with_motor`], with the part of the lap that was driven before the car was lost.
///
/// # Errors
/// [`Error::Input`] for a circuit that [`Road::new`] refuses.
pub fn drive_until_lost(
    car: &Car,
    circuit: &Circuit,
    plan: SpeedPlan,
    settings: &DriverSettings,
    interval_s: f64,
    motor: Option<MotorTorque<'_>>,
) -> Result<(Drive, Option<Lost>)> {
    let line = Line {
        circuit,
        plans: &[plan],
    };
    let road = Road::new(&[line], settings, STEP)?;
    let world = World {
        road: &road,
        driver: &DriverTable::new(settings, car, STEP, 0.0),
        torque: &WheelTorque::of_car(car)?,
        cornering: &cornering_of(settings, car),
    };
    let flat = car.to_flat();
    Ok(match car.tyre_model() {
        TyreModel::MagicFormula => {
            let car = CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat);
            record(&car, &world, interval_s, motor)
        }
        TyreModel::Linear => {
            let car = CarModel::<f64, LinearTyre<f64>>::from_parameters(&flat);
            record(&car, &world, interval_s, motor)
        }
    })
}

fn record<T: Tyre<f64>>(
    car: &CarModel<f64, T>,
    world: &World<'_, f64>,
    interval_s: f64,
    motor: Option<MotorTorque<'_>>,
) -> (Drive, Option<Lost>) {
    let course = Course::at(world.road, 0.0);
    let pace = Pace {
        plan: 0.0,
        share: 0.0,
    };
    let mut state = DriveState::begin(world, &course, &pace);
    let mut log = Drive::default();
    let mut next_sample: Option<f64> = None;
    let mut time = 0.0;
    let mut number = 0.0;
    // What engine and motor give together: the motor's torque holds for a step.
    let mut both = world.torque.clone();
    while state.under_way() {
        if let Some(torque_nm) = motor {
            let pose = &state.pose;
            let station_m = (pose.lap * course.rows + pose.row) * course.spacing + pose.along;
            let added = torque_nm(station_m, state.car.body.vx);
            for (both, engine) in both.stretches.iter_mut().zip(&world.torque.stretches) {
                both[1] = engine[1] + added;
            }
        }
        let world = &World {
            torque: &both,
            ..*world
        };
        state = drive_step(car, world, (&course, &pace), number, &state, |moment| {
            let pose = &moment.view.pose;
            if pose.lap < 0.0 {
                return;
            }
            let due = *next_sample.get_or_insert(time);
            if time >= due - 0.5 * STEP {
                log.inputs.push(*moment.input);
                log.states.push(moment.car.to_array());
                log.station_m
                    .push((pose.lap * course.rows + pose.row) * course.spacing + pose.along);
                log.offset_m.push(moment.view.offset);
                log.loads_mps2.extend(moment.footing.map(|footing| footing.load));
                next_sample = Some(due + interval_s);
            }
        });
        time += STEP;
        number += 1.0;
    }
    let how = if state.ending == ending::FINISHED {
        return (log, None);
    } else if state.ending == ending::LEFT_ROAD {
        "left the track"
    } else if state.ending == ending::TOO_LATE {
        "did not get round in time"
    } else {
        "spun"
    };
    let lost = Lost {
        station_m: state.pose.row * course.spacing + state.pose.along,
        speed_mps: state.car.body.vx,
        how,
    };
    (log, Some(lost))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lap of 100 m at 50 m/s takes 2 s, and a drive that ends on its way has no time.
    #[test]
    fn only_a_whole_lap_has_a_time() {
        let whole = Drive {
            states: vec![[50.0, 0.0, 0.0, 0.0, 0.0, 0.0]; 20],
            station_m: (0..20).map(|i| 2.5 + 5.0 * f64::from(i)).collect(),
            ..Drive::default()
        };
        let time_s = whole.lap_time_s(100.0, 0.1).unwrap();
        assert!((time_s - 2.0).abs() < 1e-12, "{time_s}");
        let mut lost = whole;
        lost.states.truncate(12);
        lost.station_m.truncate(12);
        assert_eq!(lost.lap_time_s(100.0, 0.1), None);
        assert_eq!(Drive::default().lap_time_s(100.0, 0.1), None);
    }
}
