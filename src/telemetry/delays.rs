//! Delays of the channels relative to yaw rate.

use super::calibration::{Calibration, Declared, Finding, FindingKind};
use super::derived::{MOVING_MPS, SURE_OF_SIGN, acceleration, front_difference, moving, product, unbraked};
use super::log::Log;
use super::role::Role;
use super::statistics::{Lag, best_lag, least_error_lag};

/// Greatest delay in the search, s.
const MOST_DELAY_S: f64 = 0.5;
/// Least correlation for a delay.
const SURE_OF_DELAY: f64 = 0.6;
/// Acceleration above which wheels cannot be braked, m/s^2.
const DRIVING_AX: f64 = 0.3;
/// Delays shorter than this share of a sample interval are left alone: interpolating would blur more than it moves.
const LEAST_SHIFT: f64 = 0.1;

/// Delay of the wheel speeds relative to ground speed, samples, from the mean of both undriven wheels, in which
/// turning cancels.
///
/// Slip looks like a delay, since both grow with acceleration. An undriven wheel that is not braked has none, so only
/// such samples count, and an error above a limit counts no more than the limit.
fn wheel_lag(log: &Log, undriven: [usize; 2], accel: &[f64], most: usize) -> Option<Lag> {
    /// Limit of an error, m/s: larger ones are slip or spikes.
    const LIMIT: f64 = 1.0;
    let [left, right] = undriven.map(|w| &log.wheel_speed_radps[w]);
    let pairs = left.iter().zip(right);
    let mean: Vec<f64> = pairs.map(|(l, r)| (l + r) / 2.0).collect();
    let mask: Vec<bool> = log
        .vx_mps
        .iter()
        .zip(accel)
        .map(|(&v, &a)| v > MOVING_MPS && a > DRIVING_AX)
        .collect();
    least_error_lag(&log.vx_mps, &mean, &mask, most, LIMIT)
}

/// Delays of all channels relative to yaw rate, from a log that has not been corrected yet. `undriven` are the wheels
/// of the axle that is not driven, left and right.
pub(super) fn delays(log: &Log, declared: &Declared, undriven: [usize; 2], calibration: &mut Calibration) {
    let most = (MOST_DELAY_S / log.dt_s).ceil() as usize;
    let (moving, accel) = (moving(log), acceleration(log));
    let sure = |lag: &Lag| lag.correlation.abs() >= SURE_OF_DELAY;
    let front = front_difference(log).and_then(|difference| {
        let lag = best_lag(&log.yaw_rate_radps, &difference, &unbraked(log, &accel), most);
        lag.filter(|l| l.correlation.abs() >= SURE_OF_SIGN)
    });
    // All four wheel speeds come from one input board. The delay of the driven wheels cannot be told from slip.
    let wheels = wheel_lag(log, undriven, &accel, most).filter(sure);
    let mut report = |role: Role, lag: Option<(f64, &Lag)>, against: &str| {
        let Some((samples, lag)) = lag else {
            calibration
                .notes
                .push(format!("{}: no clear delay against {against}", role.key()));
            return;
        };
        let (applied, why) = if declared.delays.contains(&role) {
            (false, "; left alone: the channel map declares a delay")
        } else if samples.abs() < LEAST_SHIFT {
            (false, "; too short to correct")
        } else {
            (true, "")
        };
        calibration.findings.push(Finding {
            role,
            kind: FindingKind::Delay,
            value: samples * log.dt_s,
            applied,
            correlation: Some(lag.correlation),
            samples: lag.used,
            evidence: format!("against {against}{why}"),
        });
    };
    // Without the front wheels the speed channels cannot be compared with yaw rate. They are compared with each other.
    let front_samples = front.as_ref().map(|f| f.samples);
    let (wheel_samples, speed_samples) = match (front_samples, &wheels) {
        (Some(front), Some(wheels)) => (Some(front), front - wheels.samples),
        (Some(front), None) => (Some(front), 0.0),
        (None, wheels) => (wheels.as_ref().map(|w| w.samples), 0.0),
    };
    let against_yaw = "yaw rate, through the speed difference of the front wheels";
    let (wheel_evidence, wheel_against) = match &front {
        Some(front) => (Some(front), against_yaw),
        None => (
            wheels.as_ref(),
            "ground speed, on undriven wheels that are not braked",
        ),
    };
    for role in Role::WHEELS {
        report(role, wheel_samples.zip(wheel_evidence), wheel_against);
    }
    if !declared.speed_of_wheels {
        let lag = front_samples.and(wheels.as_ref());
        report(
            Role::Vx,
            lag.map(|l| (speed_samples, l)),
            "undriven wheels that are not braked, and through them yaw rate",
        );
    }
    let ax = best_lag(&accel, &log.ax_mps2, &moving, most).filter(sure);
    report(
        Role::Ax,
        ax.as_ref().map(|l| (l.samples + speed_samples, l)),
        "the change of ground speed",
    );
    let turning = product(&log.vx_mps, &log.yaw_rate_radps);
    let ay = best_lag(&turning, &log.ay_mps2, &moving, most).filter(sure);
    report(
        Role::Ay,
        ay.as_ref().map(|l| (l.samples, l)),
        "ground speed times yaw rate, which includes the few hundredths of a second by which side slip makes ay late",
    );
    let steer = best_lag(&log.yaw_rate_radps, &log.steer_rad, &moving, most).filter(sure);
    if let Some(steer) = steer {
        calibration.findings.push(Finding {
            role: Role::Steer,
            kind: FindingKind::Delay,
            value: steer.samples * log.dt_s,
            applied: false,
            correlation: Some(steer.correlation),
            samples: steer.used,
            evidence:
                "against yaw rate; left alone: a car answers its steering late, so this is not the sensor's \
                       delay alone (delay_s in the channel map sets it)"
                    .to_owned(),
        });
    }
}
