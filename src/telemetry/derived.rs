//! References for calibration and audit, computed from the log.

use super::log::Log;
use super::statistics::{derivative, median, quantile};

/// Speed (m/s) below which a car gives little evidence about its sensors.
pub(super) const MOVING_MPS: f64 = 8.0;
/// Half of the interval over which speed is differentiated, s: long enough to smooth steps of 0.1 km/h.
const DERIVATIVE_S: f64 = 0.1;
/// Limit of the front wheels' speed difference, in multiples of its 90 % quantile.
const CLIP: f64 = 2.0;
/// Value of ax (m/s^2) above which the brakes are hardly on.
pub(super) const UNBRAKED_AX: f64 = -1.0;
/// On a straight yaw rate (rad/s) stays within this of its offset.
pub(super) const STRAIGHT_YAW: f64 = 0.03;
/// Evidence from a straight or standstill needs this much of it, s.
pub(super) const LEAST_S: f64 = 2.0;
/// Least correlation for a sign.
pub(super) const SURE_OF_SIGN: f64 = 0.4;

/// Samples at which the car moves.
pub(super) fn moving(log: &Log) -> Vec<bool> {
    log.vx_mps.iter().map(|&v| v > MOVING_MPS).collect()
}

/// Products, sample by sample.
pub(super) fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(x, y)| x * y).collect()
}

/// Samples to each side over which speed is differentiated.
pub(super) fn acceleration_span(log: &Log) -> usize {
    (DERIVATIVE_S / log.dt_s).round().max(1.0) as usize
}

/// Change of ground speed, m/s^2.
pub(super) fn acceleration(log: &Log) -> Vec<f64> {
    derivative(&log.vx_mps, log.dt_s, acceleration_span(log))
}

/// Front right minus front left wheel speed, m/s.
pub(super) fn front_difference(log: &Log) -> Option<Vec<f64>> {
    let [left, right, ..] = &log.wheel_speed_radps;
    let (left, right) = (linear_speed(log, left)?, linear_speed(log, right)?);
    let pairs = right.iter().zip(&left);
    let mut difference: Vec<f64> = pairs.map(|(r, l)| r - l).collect();
    // A spike or a locked wheel counts no more than a tight corner.
    let most = CLIP * quantile(difference.iter().map(|d| d.abs()).collect(), 0.9)?;
    for d in &mut difference {
        *d = d.clamp(-most, most);
    }
    Some(difference)
}

/// Samples on which the front wheels' difference is that of their paths: not where one of them may be locking.
pub(super) fn unbraked(log: &Log, accel: &[f64]) -> Vec<bool> {
    let pairs = log.vx_mps.iter().zip(accel);
    pairs.map(|(&v, &a)| v > MOVING_MPS && a > UNBRAKED_AX).collect()
}

/// Speed of a wheel in m/s, with a rolling radius that is good enough to compare wheels. It is estimated where the car hardly
/// turns, since a wheel that is inside in most corners would look too large. Without such stretches all samples are used.
fn linear_speed(log: &Log, wheel: &[f64]) -> Option<Vec<f64>> {
    if wheel.is_empty() {
        return None;
    }
    let radius = |most_yaw: f64| {
        let ratios: Vec<f64> = (0..log.samples())
            .filter(|&i| {
                log.vx_mps[i] > MOVING_MPS && wheel[i] > 0.0 && log.yaw_rate_radps[i].abs() < most_yaw
            })
            .map(|i| log.vx_mps[i] / wheel[i])
            .collect();
        (ratios.len() as f64 * log.dt_s >= LEAST_S).then(|| median(ratios))?
    };
    let radius = radius(STRAIGHT_YAW).or_else(|| radius(f64::INFINITY))?;
    Some(wheel.iter().map(|w| w * radius).collect())
}
