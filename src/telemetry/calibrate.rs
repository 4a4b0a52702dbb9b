//! Calibration of sensors from the log itself: signs, delays, zero offsets and rolling radii.
//!
//! Yaw rate is the reference for everything else. Its sign comes from the front wheels, whose speeds differ by track times yaw
//! rate; `ay` and steering follow yaw, `ax` follows the change of speed. Delays are relative to yaw rate: a delay that is common
//! to all channels cannot be seen and does not matter.

use super::calibration::{CalibrationOptions, Declared, Finding, FindingKind};
use super::derived::{
    LEAST_S, STRAIGHT_YAW, SURE_OF_SIGN, acceleration, front_difference, moving, product, unbraked,
};
use super::log::Log;
use super::recording::Format;
use super::role::Role;
use super::statistics::{Fit, fit, median, quantile};

/// Speed (m/s) below which wheel speeds are too coarse for a rolling radius.
const STRAIGHT_MPS: f64 = 12.0;
/// On a straight lateral acceleration (m/s^2) stays within this of its offset.
const STRAIGHT_AY: f64 = 1.0;
/// Wheels roll freely enough when |ax| (m/s^2) is below this.
const COASTING_AX: f64 = 1.0;
/// Standing still, m/s.
const STANDSTILL_MPS: f64 = 0.3;

/// Estimates and applies signs, offsets and rolling radii, in this order; delays have been corrected before.
pub(super) fn apply(log: &mut Log, options: &CalibrationOptions, format: Format, declared: &Declared) {
    if options.signs.is_on(format) {
        signs(log, declared);
    }
    if options.offsets.is_on(format) {
        offsets(log);
    }
    if options.rolling_radius.is_on(format) {
        rolling_radii(log, declared.rolling_radius_m);
    }
}

fn signs(log: &mut Log, declared: &Declared) {
    let (moving, accel) = (moving(log), acceleration(log));
    if let Some(difference) = front_difference(log) {
        let yaw = log.yaw_rate_radps.clone();
        let found = fit(&yaw, &difference, &unbraked(log, &accel), 0);
        let evidence = match found {
            Some(f) => format!(
                "against the speed difference of the front wheels, which makes the front track about {:.1} m",
                f.slope.abs()
            ),
            None => String::new(),
        };
        sign(log, declared, Role::YawRate, found, &evidence);
    }
    let turning = product(&log.vx_mps, &log.yaw_rate_radps);
    let found = fit(&turning, &log.ay_mps2, &moving, 0);
    sign(
        log,
        declared,
        Role::Ay,
        found,
        "against ground speed times yaw rate",
    );
    gain(log, Role::Ay, found, "ground speed times yaw rate");
    let found = fit(&accel, &log.ax_mps2, &moving, 0);
    sign(
        log,
        declared,
        Role::Ax,
        found,
        "against the change of ground speed",
    );
    gain(log, Role::Ax, found, "the change of ground speed");
    let found = fit(&log.yaw_rate_radps, &log.steer_rad, &moving, 0);
    sign(log, declared, Role::Steer, found, "against yaw rate");
}

fn sign(log: &mut Log, declared: &Declared, role: Role, found: Option<Fit>, evidence: &str) {
    let Some(found) = found.filter(|f| f.correlation.abs() >= SURE_OF_SIGN) else {
        log.calibration.notes.push(format!(
            "{}: the log does not tell its sign; taken as logged",
            role.key()
        ));
        return;
    };
    let value = found.correlation.signum();
    let is_declared = declared.signs.contains(&role);
    let mut evidence = evidence.to_owned();
    if is_declared && value < 0.0 {
        evidence.push_str("; left alone: the channel map declares the sign, and the log contradicts it");
    }
    let applied = !is_declared && value < 0.0;
    if applied {
        for v in values_mut(log, role) {
            *v = -*v;
        }
    }
    log.calibration.findings.push(Finding {
        role,
        kind: FindingKind::Sign,
        value,
        applied,
        correlation: Some(found.correlation),
        samples: found.samples,
        evidence,
    });
}

fn gain(log: &mut Log, role: Role, found: Option<Fit>, against: &str) {
    if let Some(found) = found {
        log.calibration.findings.push(Finding {
            role,
            kind: FindingKind::Gain,
            value: found.slope.abs(),
            applied: false,
            correlation: Some(found.correlation),
            samples: found.samples,
            evidence: format!("slope on {against}"),
        });
    }
}

fn values_mut(log: &mut Log, role: Role) -> &mut [f64] {
    match role {
        Role::Ax => &mut log.ax_mps2,
        Role::Ay => &mut log.ay_mps2,
        Role::Steer => &mut log.steer_rad,
        Role::YawRate => &mut log.yaw_rate_radps,
        _ => &mut [],
    }
}

/// Samples on straights, given the offsets of yaw rate and `ay`: stretches, because yaw rate also passes through
/// zero in the middle of an S.
fn straights(log: &Log, yaw_offset: f64, ay_offset: f64) -> Vec<bool> {
    let mut mask: Vec<bool> = (0..log.samples())
        .map(|i| {
            log.vx_mps[i] > STRAIGHT_MPS
                && (log.yaw_rate_radps[i] - yaw_offset).abs() < STRAIGHT_YAW
                && (log.ay_mps2[i] - ay_offset).abs() < STRAIGHT_AY
        })
        .collect();
    let least = (0.5 / log.dt_s).ceil() as usize;
    for stretch in mask.chunk_by_mut(|a, b| a == b) {
        if stretch.len() < least {
            stretch.fill(false);
        }
    }
    mask
}

fn chosen(values: &[f64], mask: &[bool]) -> Vec<f64> {
    let pairs = values.iter().zip(mask);
    pairs.filter(|(_, m)| **m).map(|(v, _)| *v).collect()
}

fn enough(mask: &[bool], dt_s: f64) -> bool {
    mask.iter().filter(|m| **m).count() as f64 * dt_s >= LEAST_S
}

fn offsets(log: &mut Log) {
    let (mut yaw, mut ay) = (0.0, 0.0);
    let mut mask = straights(log, yaw, ay);
    // On straights, yaw rate and ay are near their offsets, which are unknown. A few rounds of iteration find both.
    for _ in 0..8 {
        if let (Some(y), Some(a)) = (
            median(chosen(&log.yaw_rate_radps, &mask)),
            median(chosen(&log.ay_mps2, &mask)),
        ) {
            (yaw, ay) = (y, a);
        }
        mask = straights(log, yaw, ay);
    }
    let mut place = "on straights";
    if !enough(&mask, log.dt_s) {
        place = "at standstill";
        mask = log.vx_mps.iter().map(|v| v.abs() < STANDSTILL_MPS).collect();
    }
    for role in [Role::YawRate, Role::Ay] {
        let samples = chosen(values_mut(log, role), &mask);
        let varies = samples.windows(2).any(|pair| pair[0] != pair[1]);
        // A logger that keeps running after its sensors are switched off repeats their last values.
        let usable = enough(&mask, log.dt_s) && (place == "on straights" || varies);
        let (Some(value), true) = (mean_of_middle(samples.clone()), usable) else {
            log.calibration.notes.push(format!(
                "{}: too little straight running or standstill to tell its zero offset",
                role.key()
            ));
            continue;
        };
        for v in values_mut(log, role) {
            *v -= value;
        }
        log.calibration.findings.push(Finding {
            role,
            kind: FindingKind::Offset,
            value,
            applied: true,
            correlation: None,
            samples: samples.len(),
            evidence: place.to_owned(),
        });
    }
}

/// Mean of the middle half. It is as robust as the median here, and finer than the steps of a coarse sensor.
fn mean_of_middle(values: Vec<f64>) -> Option<f64> {
    let low = quantile(values.clone(), 0.25)?;
    let high = quantile(values.clone(), 0.75)?;
    let (mut n, mut sum) = (0_usize, 0.0);
    for v in values.into_iter().filter(|v| (low..=high).contains(v)) {
        n += 1;
        sum += v;
    }
    (n > 0).then(|| sum / n as f64)
}

fn rolling_radii(log: &mut Log, reference_m: Option<f64>) {
    let accel = acceleration(log);
    let mut mask = straights(log, 0.0, 0.0);
    for (m, a) in mask.iter_mut().zip(&accel) {
        *m &= a.abs() < COASTING_AX;
    }
    for (index, role) in Role::WHEELS.into_iter().enumerate() {
        let wheel = &log.wheel_speed_radps[index];
        let ratios: Vec<f64> = (0..log.samples())
            .filter(|&i| mask[i] && wheel[i] > 0.0)
            .map(|i| log.vx_mps[i] / wheel[i])
            .collect();
        let samples = ratios.len();
        let (Some(radius), true) = (
            mean_of_middle(ratios.clone()),
            samples as f64 * log.dt_s >= LEAST_S,
        ) else {
            log.calibration.notes.push(format!(
                "{}: too little coasting on straights to tell its rolling radius",
                role.key()
            ));
            continue;
        };
        let spread = match (quantile(ratios.clone(), 0.25), quantile(ratios, 0.75)) {
            (Some(low), Some(high)) => (high - low) / radius * 100.0,
            _ => 0.0,
        };
        let mut evidence = format!("on straights; the middle half of the samples within {spread:.2} %");
        // Speeds become those of a wheel of the reference radius: slip is computed with one radius for all wheels.
        if let Some(reference) = reference_m {
            let scale = radius / reference;
            for w in &mut log.wheel_speed_radps[index] {
                *w *= scale;
            }
        } else {
            evidence.push_str("; left alone: no rolling_radius_m to refer wheel speeds to");
        }
        log.calibration.findings.push(Finding {
            role,
            kind: FindingKind::RollingRadius,
            value: radius,
            applied: reference_m.is_some(),
            correlation: None,
            samples,
            evidence,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::synthetic::{Car, Faults, motec_text};
    use crate::telemetry::{ChannelMap, LogOptions, Recording, Switch};

    const FAULTS: Faults = Faults {
        vx_delay_s: 0.07,
        wheel_delay_s: 0.03,
        g_delay_s: 0.12,
        steer_sign: -1.0,
        ay_sign: -1.0,
        yaw_offset: 0.004,
        ay_offset: 0.3,
    };
    const RADII: [f64; 4] = [0.321, 0.324, 0.328, 0.331];

    fn read(map: &str) -> Log {
        let car = Car {
            radius_m: RADII,
            track_m: 1.64,
        };
        let text = motec_text(&car, &FAULTS, 70.0, 50.0);
        let recording = Recording::parse(text.as_bytes(), "a.csv").unwrap();
        let map = ChannelMap::parse(map, "m.toml").unwrap();
        Log::from_recording(&recording, &map, &LogOptions::default()).unwrap()
    }

    #[test]
    fn injected_faults_are_found_and_taken_off() {
        let log = read("[vehicle]\nrolling_radius_m = 0.325");
        let c = &log.calibration;
        let delay = |role| c.applied(role, FindingKind::Delay).unwrap();
        for (role, injected) in [
            (Role::Vx, 0.07),
            (Role::WheelSpeedFl, 0.03),
            (Role::WheelSpeedRr, 0.03),
            (Role::Ax, 0.12),
            (Role::Ay, 0.12),
        ] {
            assert!(
                (delay(role) - injected).abs() < 0.006,
                "{role:?} {} for {injected}",
                delay(role)
            );
        }
        assert_eq!(c.applied(Role::Steer, FindingKind::Delay), None);
        assert_eq!(c.applied(Role::Steer, FindingKind::Sign), Some(-1.0));
        assert_eq!(c.applied(Role::Ay, FindingKind::Sign), Some(-1.0));
        assert_eq!(c.finding(Role::YawRate, FindingKind::Sign).unwrap().value, 1.0);
        let yaw_offset = c.applied(Role::YawRate, FindingKind::Offset).unwrap();
        assert!((yaw_offset - FAULTS.yaw_offset).abs() < 1e-3, "{yaw_offset}");
        let ay_offset = c.applied(Role::Ay, FindingKind::Offset).unwrap();
        assert!((ay_offset + FAULTS.ay_offset).abs() < 0.03, "{ay_offset}");
        for (role, radius) in Role::WHEELS.into_iter().zip(RADII) {
            let found = c.applied(role, FindingKind::RollingRadius).unwrap();
            assert!((found / radius - 1.0).abs() < 1e-3, "{found} for {radius}");
        }
        let worst = (0..log.samples())
            .map(|i| {
                let (v, _, r) = Car::motion(log.time_s[i]);
                let slip = log.wheel_speed_radps[2][i] * 0.325 - (v - 0.82 * r);
                [
                    (log.yaw_rate_radps[i] - r).abs() * 10.0,
                    (log.ay_mps2[i] - v * r).abs(),
                    (log.vx_mps[i] - v).abs(),
                    slip.abs(),
                ]
                .into_iter()
                .fold(0.0, f64::max)
            })
            .fold(0.0, f64::max);
        assert!(worst < 0.15, "{worst}");
    }

    #[test]
    fn what_the_map_declares_is_left_alone() {
        let log = read(
            "[channels.steer]\nsign = -1\n[channels.ay]\nsign = -1\ndelay_s = 0.12\n\
             [channels.yaw_rate]\nsign = 1\n",
        );
        let c = &log.calibration;
        assert_eq!(c.applied(Role::Steer, FindingKind::Sign), None);
        assert_eq!(c.finding(Role::Steer, FindingKind::Sign).unwrap().value, 1.0);
        let ay = c.finding(Role::Ay, FindingKind::Delay).unwrap();
        assert!(!ay.applied && ay.value.abs() < 0.005, "{ay:?}");
        // Without a reference radius the radii are reported and nothing is scaled.
        let fl = c.finding(Role::WheelSpeedFl, FindingKind::RollingRadius).unwrap();
        assert!(!fl.applied && (fl.value / RADII[0] - 1.0).abs() < 1e-3);
    }

    #[test]
    fn off_means_off() {
        let text = motec_text(&Car::default(), &FAULTS, 30.0, 50.0);
        let recording = Recording::parse(text.as_bytes(), "a.csv").unwrap();
        let options = LogOptions {
            calibration: CalibrationOptions::all(Switch::Off),
            ..LogOptions::default()
        };
        let log = Log::from_recording(&recording, &ChannelMap::default(), &options).unwrap();
        assert!(log.calibration.findings.is_empty());
        assert!((log.yaw_rate_radps[0] - FAULTS.yaw_offset).abs() < 1e-12);
    }
}
