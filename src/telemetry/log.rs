//! The log for an identification.

use std::ops::Range;

use super::calibration::{Calibration, CalibrationOptions};
use super::laps::Lap;
use crate::vehicle::Car;
use crate::{Error, Result};

/// How a recording is turned into a [`Log`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogOptions {
    /// Sample rate of the log, Hz; `None` for the highest rate among the channels that are needed.
    pub rate_hz: Option<f64>,
    /// The rolling radii (m) of the front and the rear wheels of the car being identified: wheel speeds are referred to them.
    pub rolling_radius_m: Option<[f64; 2]>,
    /// The steering of the car being identified: it tells a log of the steering wheel's angle from one of the road wheels', where the
    /// channel map gives no ratio.
    pub steering: Option<Steering>,
    /// Whether the study finds the radius of the front or the rear wheels itself: then their mean speed is left as logged.
    pub radius_is_free: [bool; 2],
    /// The corrections that are estimated from the log.
    pub calibration: CalibrationOptions,
}

/// What a car's steering does at low lateral acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// Steering-wheel angle over road-wheel angle.
    pub ratio: f64,
    /// Distance between the axles, m.
    pub wheelbase_m: f64,
}

impl LogOptions {
    /// For a log of a car: its rolling radii and its steering.
    pub fn of(car: &Car) -> Self {
        Self {
            rolling_radius_m: Some([car.chassis.radius_front, car.chassis.radius_rear]),
            steering: Some(Steering {
                ratio: car.steering_ratio,
                wheelbase_m: car.chassis.cg_to_front + car.chassis.cg_to_rear,
            }),
            ..Self::default()
        }
    }
}

/// A log on one uniform clock, in SI and ISO 8855: x forward, y left, yaw anticlockwise and steering to the left
/// positive. All arrays have as many values as `time_s`, save those of wheels that are not logged.
#[derive(Clone, Debug, PartialEq)]
pub struct Log {
    /// The file it came from.
    pub source: String,
    /// Sample interval, s.
    pub dt_s: f64,
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Distance from the start of the lap, m; integrated from speed where it is not logged.
    pub distance_m: Vec<f64>,
    /// Wheel speeds FL FR RL RR, rad/s; those of a wheel that is not logged are empty.
    pub wheel_speed_radps: [Vec<f64>; 4],
    /// Road-wheel angle, rad.
    pub steer_rad: Vec<f64>,
    /// How far the DRS is open, from 0 to 1; shut where it is not logged.
    pub drs: Vec<f64>,
    /// Forward speed, m/s.
    pub vx_mps: Vec<f64>,
    /// Longitudinal acceleration `dVx/dt - Vy r`, m/s^2.
    pub ax_mps2: Vec<f64>,
    /// Lateral acceleration `dVy/dt + Vx r`, m/s^2.
    pub ay_mps2: Vec<f64>,
    /// Yaw rate, rad/s.
    pub yaw_rate_radps: Vec<f64>,
    /// Its laps, in order and without gaps.
    pub laps: Vec<Lap>,
    /// What was estimated from the log and applied to it.
    pub calibration: Calibration,
}

impl Log {
    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.time_s.len()
    }

    /// Duration from the first sample to the last, s.
    pub fn duration_s(&self) -> f64 {
        self.samples().saturating_sub(1) as f64 * self.dt_s
    }

    /// Part of the log. Laps that are cut are no longer complete.
    ///
    /// # Errors
    /// [`Error::Input`] when the range is empty or reaches past the end.
    pub fn slice(&self, range: Range<usize>) -> Result<Self> {
        if range.start >= range.end || range.end > self.samples() {
            return Err(Error::input(
                &self.source,
                "samples",
                format!("{} to {}", range.start, range.end),
                format!("a range within 0 to {}", self.samples()),
            ));
        }
        let cut = |values: &[f64]| values[range.clone()].to_vec();
        let laps = self.laps.iter().filter_map(|lap| {
            let (start, end) = (lap.start.max(range.start), lap.end.min(range.end));
            (start < end).then(|| Lap {
                number: lap.number,
                start: start - range.start,
                end: end - range.start,
                complete: lap.complete && end - start == lap.end - lap.start,
            })
        });
        Ok(Self {
            source: self.source.clone(),
            dt_s: self.dt_s,
            time_s: cut(&self.time_s),
            distance_m: cut(&self.distance_m),
            wheel_speed_radps: [0, 1, 2, 3].map(|w| match &self.wheel_speed_radps[w][..] {
                [] => Vec::new(),
                logged => cut(logged),
            }),
            steer_rad: cut(&self.steer_rad),
            drs: cut(&self.drs),
            vx_mps: cut(&self.vx_mps),
            ax_mps2: cut(&self.ax_mps2),
            ay_mps2: cut(&self.ay_mps2),
            yaw_rate_radps: cut(&self.yaw_rate_radps),
            laps: laps.collect(),
            calibration: self.calibration.clone(),
        })
    }

    /// The lap with a number, as a log of its own.
    ///
    /// # Errors
    /// [`Error::Input`] when there is none.
    pub fn lap(&self, number: u32) -> Result<Self> {
        match self.laps.iter().find(|lap| lap.number == number) {
            Some(lap) => self.slice(lap.start..lap.end),
            None => Err(Error::input(
                &self.source,
                "lap",
                number.to_string(),
                format!(
                    "one of {}",
                    self.laps
                        .iter()
                        .map(|lap| lap.number.to_string())
                        .collect::<Vec<_>>()
                        .join(", ")
                ),
            )),
        }
    }

    /// Refuses a log that is shorter than a window of `window_s`.
    ///
    /// # Errors
    /// [`Error::Input`] with both lengths.
    pub fn check_length(&self, window_s: f64) -> Result<()> {
        // The time of the last sample is exact only to rounding.
        if self.duration_s() + 1e-6 * self.dt_s >= window_s {
            return Ok(());
        }
        Err(Error::input(
            &self.source,
            "time",
            format!("{:.3} s of log", self.duration_s()),
            format!("at least one window of {window_s} s"),
        ))
    }
}
