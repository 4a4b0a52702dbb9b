//! A synthetic outing with known truth, for the tests of this module.

use std::fmt::Write as _;

use super::calibration::Calibration;
use super::csv_native::COLUMNS;
use super::laps::Lap;
use super::log::Log;

/// A car whose channels are known in closed form.
pub(super) struct Car {
    pub radius_m: [f64; 4],
    pub track_m: f64,
}

impl Default for Car {
    fn default() -> Self {
        Self {
            radius_m: [0.325; 4],
            track_m: 1.6,
        }
    }
}

impl Car {
    /// Speed (m/s), acceleration (m/s^2) and yaw rate (rad/s) at a time: a straight at steady speed and a right-hand bend with the
    /// speed going down and up, twice in a lap of 40 s, which ends where it began.
    pub fn motion(time_s: f64) -> (f64, f64, f64) {
        use std::f64::consts::{PI, TAU};
        let t = time_s.rem_euclid(20.0);
        if t < 8.0 {
            return (44.0, 0.0, 0.0);
        }
        let x = TAU * (t - 8.0) / 12.0;
        // Smooth at both ends of the bend: speed from a squared cosine, yaw rate from an odd window. The bend is half a circle.
        let v = 36.0 + 8.0 * x.cos() + 2.0 * (2.0 * x).cos() - 2.0;
        let a = -(8.0 * x.sin() + 4.0 * (2.0 * x).sin()) * TAU / 12.0;
        let window = (x / 2.0).sin().powi(2);
        (v, a, window * (0.45 * (2.0 * x).sin() - PI / 6.0))
    }

    /// A log of `duration_s` at `rate_hz`, right in every respect.
    pub fn drive(&self, duration_s: f64, rate_hz: f64) -> Log {
        let samples = (duration_s * rate_hz) as usize;
        let dt_s = 1.0 / rate_hz;
        let time_s: Vec<f64> = (0..samples).map(|i| i as f64 * dt_s).collect();
        let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { time_s.iter().map(|t| f(*t)).collect() };
        let yaw = |t: f64| Self::motion(t).2;
        let vx = |t: f64| Self::motion(t).0;
        let wheel = |w: usize| {
            let side = if [0, 2].contains(&w) { -0.5 } else { 0.5 };
            of(&|t| (vx(t) + side * self.track_m * yaw(t)) / self.radius_m[w])
        };
        let mut distance = 0.0;
        Log {
            source: "synthetic".to_owned(),
            dt_s,
            distance_m: time_s
                .iter()
                .map(|t| {
                    let here = distance;
                    distance += vx(*t) * dt_s;
                    here
                })
                .collect(),
            wheel_speed_radps: [wheel(0), wheel(1), wheel(2), wheel(3)],
            // A car that answers 0.1 s after it is steered.
            drs: of(&|_| 0.0),
            steer_rad: of(&|t| 2.6 * yaw(t + 0.1) / vx(t + 0.1)),
            vx_mps: of(&vx),
            ax_mps2: of(&|t| Self::motion(t).1),
            ay_mps2: of(&|t| vx(t) * yaw(t)),
            yaw_rate_radps: of(&yaw),
            laps: vec![Lap {
                number: 1,
                start: 0,
                end: samples,
                complete: true,
            }],
            calibration: Calibration::default(),
            time_s,
        }
    }
}

/// A log as native CSV, without going through the writer.
pub(super) fn native_text(log: &Log) -> String {
    let mut text = COLUMNS.join(",") + "\n";
    for i in 0..log.samples() {
        let [fl, fr, rl, rr] = [0, 1, 2, 3].map(|w| log.wheel_speed_radps[w][i]);
        let _ = writeln!(
            text,
            "{},{},{fl},{fr},{rl},{rr},{},{},{},{},{}",
            log.time_s[i],
            log.distance_m[i],
            log.steer_rad[i],
            log.vx_mps[i],
            log.ax_mps2[i],
            log.ay_mps2[i],
            log.yaw_rate_radps[i],
        );
    }
    text
}

/// A log as a MoTeC export in the logger's units, each channel late by `delay_s` (speed, wheels, ax, ay), with the
/// lateral channels' signs and offsets as given.
pub(super) struct Faults {
    pub vx_delay_s: f64,
    pub wheel_delay_s: f64,
    pub g_delay_s: f64,
    pub steer_sign: f64,
    pub ay_sign: f64,
    pub yaw_offset: f64,
    pub ay_offset: f64,
}

pub(super) fn motec_text(car: &Car, faults: &Faults, duration_s: f64, rate_hz: f64) -> String {
    let mut text = "\"Format\",\"MoTeC CSV File\"\r\n\"Beacon Markers\",\"20.0 60.0\"\r\n\r\n\
        \"Time\",\"Ground Speed\",\"Wheel Speed FL\",\"Wheel Speed FR\",\"Wheel Speed RL\",\"Wheel Speed RR\",\
        \"Steered Angle\",\"G Force Lat\",\"G Force Long\",\"Gyro Yaw Velocity\"\r\n\
        \"s\",\"km/h\",\"rpm\",\"rpm\",\"rpm\",\"rpm\",\"deg\",\"G\",\"G\",\"deg/s\"\r\n\r\n"
        .to_owned();
    for i in 0..(duration_s * rate_hz) as usize {
        let t = i as f64 / rate_hz;
        let motion = |delay: f64| Car::motion(t - delay);
        let (v, _, r) = motion(faults.wheel_delay_s);
        let [fl, fr, rl, rr] = [0, 1, 2, 3].map(|w| {
            let side = if [0, 2].contains(&w) { -0.5 } else { 0.5 };
            (v + side * car.track_m * r) / car.radius_m[w] * 30.0 / std::f64::consts::PI
        });
        let (gv, ga, gr) = motion(faults.g_delay_s);
        let (sv, _, sr) = motion(-0.1);
        let _ = writeln!(
            text,
            "{t},{},{fl},{fr},{rl},{rr},{},{},{},{}\r",
            motion(faults.vx_delay_s).0 * 3.6,
            (faults.steer_sign * 2.6 * sr / sv).to_degrees(),
            (faults.ay_sign * gv * gr + faults.ay_offset) / 9.80665,
            ga / 9.80665,
            (motion(0.0).2 + faults.yaw_offset).to_degrees(),
        );
    }
    text
}
