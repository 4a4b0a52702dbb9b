//! Calibration of sensors from the log itself: signs, zero offsets and rolling radii. Delays have their own file.
//!
//! Nothing is taken off that the car can do. A sign follows from what a car cannot do otherwise; a zero offset from whole laps, on
//! which the car turns full circles and ends where it began, or from standstill; a rolling radius from wheels that roll freely.

use super::calibration::{CalibrationOptions, Declared, Finding, FindingKind, Switch};
use super::derived::{
    MOVING_MPS, STRAIGHT_YAW, SURE_OF_SIGN, UNBRAKED_AX, acceleration, front_difference, moving, product,
    unbraked,
};
use super::laps::Lap;
use super::log::{Log, Steering};
use super::role::Role;
use super::statistics::{Fit, derivative, fit, regression, smoothed};
use std::f64::consts::TAU;

/// Standing still, m/s.
const STANDSTILL_MPS: f64 = 0.3;
/// Shortest standstill that tells an offset, s.
const STANDSTILL_S: f64 = 2.0;
/// A lap drawn from speed and yaw rate ends where it began to within this share of its length. Laps miss by 0.001 to 0.004, and
/// what is no lap by 0.1 and more.
const CLOSED: f64 = 0.02;
/// Angle (rad) by which a lap's end may differ from its start, together with the error of the yaw rate's scale: this is the
/// standard error of a lap's sum.
const LAP_ANGLE: f64 = 0.04;
/// Least offset of yaw rate that is taken off, rad/s: 0.05 m/s^2 at 50 m/s.
const LEAST_YAW_OFFSET: f64 = 0.001;
/// Least offset of ay that is taken off, m/s^2: a bank of one per cent.
const LEAST_AY_OFFSET: f64 = 0.1;
/// Offsets are this many standard errors large, at least.
const SURE_OFFSET: f64 = 3.0;
/// Speed (m/s) below which wheel speeds are too coarse for a rolling radius.
const ROLLING_MPS: f64 = 12.0;
/// Least error of a radius that is corrected, as a share of it: of wheels that roll freely, and of driven ones, whose slip under
/// power looks like a smaller radius.
const LEAST_RADIUS: [f64; 2] = [0.002, 0.01];
/// Acceleration for each unit of slip (m/s^2) of a car with soft tyres, driven at one axle: 15 N for each newton of load on 55 % of the
/// weight.
const SOFT_MPS2: f64 = 80.0;
/// Half of the interval over which speed is differentiated for slip, s.
const SLIP_S: f64 = 0.3;
/// The steering wheel's angle is told from the road wheels' by this many standard errors, at least.
const SURE_RATIO: f64 = 4.0;
/// Radii are off by this many standard errors, at least.
const SURE_RADIUS: f64 = 4.0;

/// Estimates and applies signs, offsets and rolling radii, in this order; delays have been corrected before.
pub(super) fn apply(log: &mut Log, options: &CalibrationOptions, declared: &Declared) {
    if options.signs == Switch::On {
        signs(log, declared);
    }
    if options.offsets == Switch::On {
        offsets(log, declared);
    }
    if declared.made.contains(&Role::Ay) {
        log.ay_mps2 = product(&log.vx_mps, &log.yaw_rate_radps);
    }
    if options.rolling_radius == Switch::On {
        rolling_radii(log, declared);
    }
}

fn signs(log: &mut Log, declared: &Declared) {
    let (moving, accel) = (moving(log), acceleration(log));
    if let Some(difference) = front_difference(log) {
        let yaw = log.yaw_rate_radps.clone();
        let found = fit(&yaw, &difference, &unbraked(log, &accel));
        let evidence = match found {
            Some(f) => format!(
                "against the speed difference of the front wheels, which makes the front track about {:.1} m",
                f.slope.abs()
            ),
            None => String::new(),
        };
        sign(log, declared, Role::YawRate, found, &evidence);
    } else if let Some(found) = against_two(log, &moving) {
        // Of three channels the one that two contradict is the wrong one.
        let evidence = "against ay and steering, which agree with one another";
        sign(log, declared, Role::YawRate, Some(found), evidence);
    }
    let turning = product(&log.vx_mps, &log.yaw_rate_radps);
    for (role, reference, of) in [
        (Role::Ay, &turning, "ground speed times yaw rate"),
        (Role::Ax, &accel, "the change of ground speed"),
    ] {
        if declared.made.contains(&role) {
            continue;
        }
        let found = fit(reference, values_mut(log, role), &moving);
        sign(log, declared, role, found, &format!("against {of}"));
        gain(log, role, found, of);
    }
    let found = fit(&log.yaw_rate_radps, &log.steer_rad, &moving);
    sign(log, declared, Role::Steer, found, "against yaw rate");
}

/// The fit of yaw rate to ay, where both ay and steering contradict its sign.
fn against_two(log: &Log, moving: &[bool]) -> Option<Fit> {
    let contradicts = |found: &Fit| found.correlation <= -SURE_OF_SIGN;
    let turning = product(&log.vx_mps, &log.yaw_rate_radps);
    fit(&log.yaw_rate_radps, &log.steer_rad, moving).filter(contradicts)?;
    fit(&turning, &log.ay_mps2, moving).filter(contradicts)
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
        standard_error: None,
        threshold: None,
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
            standard_error: None,
            threshold: None,
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

/// Tells the steering wheel's angle from the road wheels': the yaw rate needs `L r / v` at the road wheels, and what understeer adds
/// goes with the lateral acceleration. What is nearer to the car's ratio than to one, by more than the standard errors, is the
/// steering wheel's, and is divided by that ratio, which is returned.
pub(super) fn steering_ratio(log: &mut Log, steering: Steering) -> Option<f64> {
    let moving = moving(log);
    let speeds = log.vx_mps.iter().zip(&log.yaw_rate_radps);
    let needed: Vec<f64> = speeds
        .map(|(&v, r)| steering.wheelbase_m * r / v.max(MOVING_MPS))
        .collect();
    let turning = product(&log.vx_mps, &log.yaw_rate_radps);
    let found = regression(&log.steer_rad, [&needed, &turning], &moving)?;
    let (value, standard_error) = (found.factors[0].abs(), found.standard_errors[0]);
    let threshold = steering.ratio.sqrt();
    let applied = steering.ratio > 1.0 && value - SURE_RATIO * standard_error > threshold;
    let evidence = format!(
        "against the yaw rate over speed; taken as the {}",
        if applied {
            format!(
                "steering wheel's angle and divided by the car's ratio of {}",
                steering.ratio
            )
        } else {
            "road wheels' angle".to_owned()
        }
    );
    log.calibration.findings.push(Finding {
        role: Role::Steer,
        kind: FindingKind::SteeringRatio,
        value,
        standard_error: Some(standard_error),
        threshold: Some(threshold),
        applied,
        correlation: None,
        samples: found.samples,
        evidence,
    });
    if !applied {
        return None;
    }
    for angle in &mut log.steer_rad {
        *angle /= steering.ratio;
    }
    Some(steering.ratio)
}

/// An offset with its standard error, what tells it, and the number of samples behind it.
struct Offset {
    value: f64,
    standard_error: f64,
    place: String,
    samples: usize,
}

/// How far the lap misses its own start when it is drawn from speed and yaw rate less `offset`, as a share of its length.
fn misses(log: &Log, lap: &Lap, offset: f64) -> f64 {
    let (mut heading, mut x, mut y, mut length) = (0.0f64, 0.0, 0.0, 0.0);
    for i in lap.start..lap.end {
        heading += (log.yaw_rate_radps[i] - offset) * log.dt_s;
        let step = log.vx_mps[i] * log.dt_s;
        x += step * heading.cos();
        y += step * heading.sin();
        length += step.abs();
    }
    if length > 0.0 { x.hypot(y) / length } else { 1.0 }
}

/// Complete laps that end where they began, each with the yaw rate's offset for which it turns full circles.
fn closed_laps(log: &Log) -> Vec<(Lap, f64)> {
    let laps = log.laps.iter().filter(|lap| lap.complete && lap.end > lap.start);
    laps.filter_map(|lap| {
        let turned: f64 = log.yaw_rate_radps[lap.start..lap.end].iter().sum::<f64>() * log.dt_s;
        let full = TAU * (turned / TAU).round();
        let offset = (turned - full) / ((lap.end - lap.start) as f64 * log.dt_s);
        (misses(log, lap, offset) < CLOSED).then(|| (lap.clone(), offset))
    })
    .collect()
}

fn laps_said(laps: usize) -> String {
    if laps == 1 {
        "a whole lap".to_owned()
    } else {
        format!("{laps} whole laps")
    }
}

/// Yaw rate's offset from whole laps: a lap turns the car by full circles.
fn offset_of_laps(log: &Log, laps: &[(Lap, f64)]) -> Option<Offset> {
    let count = laps.len() as f64;
    let time_s: f64 = laps
        .iter()
        .map(|(lap, _)| (lap.end - lap.start) as f64 * log.dt_s)
        .sum();
    let mean = laps.iter().map(|(_, offset)| offset).sum::<f64>() / count;
    let spread = laps
        .iter()
        .map(|(_, offset)| (offset - mean).powi(2))
        .sum::<f64>();
    let scatter = (spread / (count - 1.0).max(1.0) / count).sqrt();
    (!laps.is_empty()).then(|| Offset {
        value: mean,
        standard_error: scatter.max(LAP_ANGLE * count / time_s),
        place: format!(
            "{}, which must turn full circles and end where it began",
            laps_said(laps.len())
        ),
        samples: laps.iter().map(|(lap, _)| lap.end - lap.start).sum(),
    })
}

/// Yaw rate's offset while the car stands.
fn offset_at_rest(log: &Log) -> Option<Offset> {
    let mut standing: Vec<bool> = log.vx_mps.iter().map(|v| v.abs() < STANDSTILL_MPS).collect();
    let least = (STANDSTILL_S / log.dt_s).ceil() as usize;
    let mut start = 0;
    for stretch in standing.chunk_by_mut(|a, b| a == b) {
        let end = start + stretch.len();
        // A logger that keeps running after its sensors are switched off repeats their last values.
        let values = &log.yaw_rate_radps[start..end];
        if stretch.len() < least || values.iter().all(|v| *v == values[0]) {
            stretch.fill(false);
        }
        start = end;
    }
    let one = vec![1.0; log.samples()];
    let found = regression(&log.yaw_rate_radps, [&one], &standing)?;
    Some(Offset {
        value: found.factors[0],
        standard_error: found.standard_errors[0],
        place: "standstill, where the car does not turn".to_owned(),
        samples: found.samples,
    })
}

/// Half of the time over which a car's sideways motion nearly cancels (s).
const SIDEWAYS_S: f64 = 2.0;

/// The offset of ay over whole laps, on which the car's own sideways motion begins and ends alike: what is left beside speed times
/// yaw rate, with whatever factor, is an offset or the road's mean bank. Both are smoothed: within seconds the sideways motion goes
/// with the turning, and would pass for a part of the factor.
fn ay_offset(log: &Log, laps: &[(Lap, f64)]) -> Option<Offset> {
    let mut mask = vec![false; log.samples()];
    for (lap, _) in laps {
        mask[lap.start..lap.end].fill(true);
    }
    for (allowed, moving) in mask.iter_mut().zip(moving(log)) {
        *allowed &= moving;
    }
    let half = (SIDEWAYS_S / log.dt_s).round() as usize;
    let turning = smoothed(&product(&log.vx_mps, &log.yaw_rate_radps), half);
    let one = vec![1.0; log.samples()];
    let found = regression(&smoothed(&log.ay_mps2, half), [&turning, &one], &mask)?;
    Some(Offset {
        value: found.factors[1],
        standard_error: found.standard_errors[1],
        place: format!(
            "{}, on which it must follow ground speed times yaw rate on average",
            laps_said(laps.len())
        ),
        samples: found.samples,
    })
}

fn offsets(log: &mut Log, declared: &Declared) {
    let laps = closed_laps(log);
    let of_yaw = offset_of_laps(log, &laps).or_else(|| offset_at_rest(log));
    take_off(log, Role::YawRate, of_yaw, LEAST_YAW_OFFSET);
    if !declared.made.contains(&Role::Ay) {
        let of_ay = ay_offset(log, &laps);
        take_off(log, Role::Ay, of_ay, LEAST_AY_OFFSET);
    }
}

fn take_off(log: &mut Log, role: Role, offset: Option<Offset>, least: f64) {
    let Some(offset) = offset else {
        let rest = if role == Role::YawRate {
            " and no standstill"
        } else {
            ""
        };
        log.calibration.notes.push(format!(
            "{}: no complete lap that ends where it began{rest} to tell its zero offset",
            role.key()
        ));
        return;
    };
    let threshold = least.max(SURE_OFFSET * offset.standard_error);
    let applied = offset.value.abs() >= threshold;
    if applied {
        values_mut(log, role).iter_mut().for_each(|v| *v -= offset.value);
    }
    let mut evidence = format!("from {}", offset.place);
    if !applied {
        evidence.push_str(&format!(
            "; below the threshold of {threshold:.4} {}",
            role.si_unit()
        ));
    }
    log.calibration.findings.push(Finding {
        role,
        kind: FindingKind::Offset,
        value: offset.value,
        standard_error: Some(offset.standard_error),
        threshold: Some(threshold),
        applied,
        correlation: None,
        samples: offset.samples,
        evidence,
    });
}

/// A share by which wheels turn too fast where nothing makes them slip.
struct Excess {
    value: f64,
    standard_error: f64,
    /// What slip explains of it, twice the root mean square: a smaller excess may be slip that goes with more than that.
    slip: f64,
    /// Mean slip of soft tyres at the accelerations of driven wheels. An engine at full power against the drag has about the same slip
    /// at all speeds, as a smaller radius has.
    power: f64,
    samples: usize,
}

/// The part of `excess` that neither turning nor, of driven wheels, slip explains. On straights slip goes with acceleration and
/// drag; in bends it depends on more than that.
fn steady(log: &Log, excess: &[f64], driven: bool) -> Option<Excess> {
    let free_rolling = unbraked(log, &acceleration(log));
    // Over so long that noise does not make slip look less than it is.
    let accel = derivative(&log.vx_mps, log.dt_s, (SLIP_S / log.dt_s).ceil() as usize);
    let straight = |i: usize| accel[i] > UNBRAKED_AX && log.yaw_rate_radps[i].abs() < STRAIGHT_YAW;
    let mask: Vec<bool> = (0..log.samples())
        .map(|i| free_rolling[i] && log.vx_mps[i] > ROLLING_MPS && (!driven || straight(i)))
        .collect();
    let one = vec![1.0; log.samples()];
    let per_metre = log.yaw_rate_radps.iter().zip(&log.vx_mps);
    let turning: Vec<f64> = per_metre.map(|(r, v)| r / v.max(1.0)).collect();
    let mut power = 0.0;
    let (value, standard_error, samples, slip) = if driven {
        // Power is needed against the drag as well, which grows with the square of speed.
        let drag: Vec<f64> = log.vx_mps.iter().map(|v| v * v).collect();
        let without = regression(excess, [&one, &turning, &accel], &mask)?;
        let found = regression(excess, [&one, &turning, &accel, &drag], &mask)?;
        let [of_all, _, of_accel, of_drag] = found.factors;
        let looked_at = (0..log.samples()).filter(|i| mask[*i]);
        let count = found.samples.max(1) as f64;
        let squares = looked_at
            .clone()
            .map(|i| (of_accel * accel[i] + of_drag * drag[i]).powi(2));
        let slip = 2.0 * (squares.sum::<f64>() / count).sqrt();
        power = looked_at.map(|i| accel[i].max(0.0)).sum::<f64>() / (count * SOFT_MPS2);
        // Noise makes too much of a drag that is not there. What counts is what is left either way.
        let least = of_all.abs().min(without.factors[0].abs());
        let value = if of_all * without.factors[0] > 0.0 {
            least.copysign(of_all)
        } else {
            0.0
        };
        let standard_error = found.standard_errors[0].max(without.standard_errors[0]);
        (value, standard_error, found.samples, slip)
    } else {
        let found = regression(excess, [&one, &turning], &mask)?;
        (found.factors[0], found.standard_errors[0], found.samples, 0.0)
    };
    Some(Excess {
        value,
        standard_error,
        slip,
        power,
        samples,
    })
}

/// Refers wheel speeds to the radius of their own axle. What both wheels of an axle have in common and what they differ by are
/// judged apart: slip is common to both, and a difference is not slip.
fn rolling_radii(log: &mut Log, declared: &Declared) {
    for (axle, [left, right]) in [[0, 1], [2, 3]].into_iter().enumerate() {
        let driven = (axle == 1) != declared.rear_is_undriven;
        if [left, right]
            .iter()
            .any(|wheel| log.wheel_speed_radps[*wheel].is_empty())
        {
            continue;
        }
        let reference_m = declared.rolling_radius_m.map(|radii| radii[axle]);
        let rim = |wheel: usize, i: usize| {
            log.wheel_speed_radps[wheel][i] * reference_m.unwrap_or(1.0) / log.vx_mps[i].max(1.0)
        };
        let of_wheels = |combined: fn(f64, f64) -> f64| -> Vec<f64> {
            (0..log.samples())
                .map(|i| combined(rim(left, i), rim(right, i)))
                .collect()
        };
        let common = steady(log, &of_wheels(|l, r| (l + r) / 2.0 - 1.0), driven);
        let half = steady(log, &of_wheels(|l, r| (r - l) / 2.0), driven);
        let (Some(common), Some(half)) = (common, half) else {
            log.calibration.notes.push(format!(
                "{}, {}: too little driving without braking to tell their rolling radii",
                Role::WHEELS[left].key(),
                Role::WHEELS[right].key()
            ));
            continue;
        };
        let free = declared.radius_is_free[axle];
        let of_axle = LEAST_RADIUS[usize::from(driven)]
            .max(SURE_RADIUS * common.standard_error)
            .max(common.slip)
            .max(if common.value > 0.0 { common.power } else { 0.0 });
        let of_sides = LEAST_RADIUS[0]
            .max(2.0 * SURE_RADIUS * half.standard_error)
            .max(2.0 * half.slip);
        let referred = reference_m.is_some();
        let common_applied = referred && !free && common.value.abs() >= of_axle;
        let sides_applied = referred && 2.0 * half.value.abs() >= of_sides;
        let straight = if driven { ", on straights" } else { "" };
        let mut evidence = format!("from ground speed where the car is not braked{straight}");
        evidence.push_str(&match (reference_m, common_applied, sides_applied) {
            (None, ..) => "; the car's radius is not known".to_owned(),
            (Some(radius), true, _) => format!("; wheel speeds are referred to the car's {radius} m"),
            (Some(_), false, true) => {
                "; what the wheels of the axle differ by is taken off, their mean is left".to_owned()
            }
            (Some(_), false, false) if free => String::new(),
            (Some(radius), false, false) => {
                format!(
                    "; the mean of the axle is within {:.1} % of the car's {radius} m",
                    100.0 * of_axle
                )
            }
        });
        if free {
            evidence.push_str("; the mean of the axle is left to the fit, which finds its radius");
        } else if driven && referred && !common_applied {
            evidence.push_str(
                "; slip under power looks like a smaller radius, and a free radius tells them apart",
            );
        }
        for (wheel, side) in [(left, -1.0), (right, 1.0)] {
            let taken = if common_applied { common.value } else { 0.0 }
                + if sides_applied { side * half.value } else { 0.0 };
            if taken != 0.0 {
                log.wheel_speed_radps[wheel]
                    .iter_mut()
                    .for_each(|w| *w /= 1.0 + taken);
            }
            let radius_m = reference_m.unwrap_or(1.0) / (1.0 + common.value + side * half.value);
            log.calibration.findings.push(Finding {
                role: Role::WHEELS[wheel],
                kind: FindingKind::RollingRadius,
                value: radius_m,
                standard_error: Some(radius_m * common.standard_error.hypot(half.standard_error)),
                threshold: reference_m.map(|_| of_axle),
                applied: common_applied || sides_applied,
                correlation: None,
                samples: common.samples,
                evidence: evidence.clone(),
            });
        }
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
        // The lag of ay is the car's own, as far as the log tells: it is declared.
        let log = read("[vehicle]\nrolling_radius_m = 0.325\n[channels.ay]\ndelay_s = 0.12");
        let c = &log.calibration;
        let delay = |role| {
            c.applied(role, FindingKind::Delay)
                .unwrap_or_else(|| panic!("{role:?}: {c:#?}"))
        };
        for (role, injected) in [
            (Role::Vx, 0.07),
            (Role::WheelSpeedFl, 0.03),
            (Role::WheelSpeedRr, 0.03),
            (Role::Ax, 0.12),
        ] {
            assert!(
                (delay(role) - injected).abs() < 0.006,
                "{role:?} {} for {injected}",
                delay(role)
            );
        }
        assert_eq!(c.finding(Role::Steer, FindingKind::Delay), None);
        assert_eq!(c.finding(Role::Ay, FindingKind::Delay), None);
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

    /// Wheels that drive against a drag and up to half a g slip by several per cent, and their radii are the car's.
    #[test]
    fn slip_under_power_is_no_radius() {
        let car = Car::default();
        let mut log = car.drive(200.0, 50.0);
        let accel: Vec<f64> = (0..log.samples())
            .map(|i| 2.0 * (0.2 * log.time_s[i]).sin())
            .collect();
        let mut v = 25.0;
        for (i, accel) in accel.into_iter().enumerate() {
            v += accel * log.dt_s;
            log.vx_mps[i] = v;
            log.ax_mps2[i] = accel;
            log.yaw_rate_radps[i] = 0.01 * (0.3 * log.time_s[i]).sin();
            let slip = (accel + 0.0006 * v * v) / 100.0;
            for (wheel, driven) in [0.0, 0.0, 1.0, 1.0].into_iter().enumerate() {
                log.wheel_speed_radps[wheel][i] = v * (1.0 + driven * slip) / 0.325;
            }
        }
        let declared = Declared {
            rolling_radius_m: Some([0.325; 2]),
            ..Declared::default()
        };
        rolling_radii(&mut log, &declared);
        for role in Role::WHEELS {
            let found = log.calibration.finding(role, FindingKind::RollingRadius).unwrap();
            assert!(!found.applied, "{found:?}");
            assert!((found.value / 0.325 - 1.0).abs() < 2e-3, "{found:?}");
        }
    }

    #[test]
    fn what_the_map_declares_is_left_alone() {
        let log = read(
            "[channels.steer]\nsign = -1\n[channels.ay]\nsign = -1\n[channels.ax]\ndelay_s = 0.12\n\
             [channels.yaw_rate]\nsign = 1\n",
        );
        let c = &log.calibration;
        assert_eq!(c.applied(Role::Steer, FindingKind::Sign), None);
        assert_eq!(c.finding(Role::Steer, FindingKind::Sign).unwrap().value, 1.0);
        let ax = c
            .finding(Role::Ax, FindingKind::Delay)
            .unwrap_or_else(|| panic!("{c:#?}"));
        assert!(!ax.applied && ax.value.abs() < 0.005, "{ax:?}");
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
