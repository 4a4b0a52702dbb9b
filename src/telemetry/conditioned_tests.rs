//! A log whose truth is known, as it comes out of calibration: right as it is, with noise, and with faults put in.

use std::fmt::Write as _;
use std::sync::OnceLock;

use super::statistics::smoothed;
use super::{
    Calibration, CalibrationOptions, ChannelMap, FindingKind, Log, LogOptions, Recording, Role, Switch,
};
use crate::random::Random;
use crate::vehicle::Car;

/// The car that drove the bundled lap.
const RADII: [f64; 2] = [0.325, 0.325];

fn read(text: &str, map: &str, options: &LogOptions) -> Log {
    let recording = Recording::parse(text.as_bytes(), "lap.csv").unwrap();
    Log::from_recording(&recording, &ChannelMap::parse(map, "m.toml").unwrap(), options).unwrap()
}

fn options() -> LogOptions {
    let of_car = LogOptions::of(&Car::bundled().unwrap());
    assert_eq!(of_car.rolling_radius_m, Some(RADII));
    of_car
}

fn as_logged() -> LogOptions {
    LogOptions {
        calibration: CalibrationOptions::all(Switch::Off),
        ..options()
    }
}

const BUNDLED: &str = include_str!("../../data/laps/gt_silverstone.csv");

/// The bundled lap: the car's own model drove it, without noise.
fn perfect() -> Log {
    static LAP: OnceLock<Log> = OnceLock::new();
    LAP.get_or_init(|| read(BUNDLED, "", &as_logged())).clone()
}

/// A log as i2 would export it, in the logger's units.
fn exported(log: &Log) -> String {
    let mut text = "\"Format\",\"MoTeC CSV File\"\n\"Range\",\"Lap 1\"\n\n\"Time\",\"Ground Speed\",\"Wheel Speed FL\",\
        \"Wheel Speed FR\",\"Wheel Speed RL\",\"Wheel Speed RR\",\"Steered Angle\",\"G Force Lat\",\"G Force Long\",\
        \"Gyro Yaw Velocity\"\n\"s\",\"km/h\",\"rpm\",\"rpm\",\"rpm\",\"rpm\",\"deg\",\"G\",\"G\",\"deg/s\"\n\n"
        .to_owned();
    for i in 0..log.samples() {
        let [fl, fr, rl, rr] =
            [0, 1, 2, 3].map(|w| log.wheel_speed_radps[w][i] * 30.0 / std::f64::consts::PI);
        let _ = writeln!(
            text,
            "{},{},{fl},{fr},{rl},{rr},{},{},{},{}",
            log.time_s[i],
            3.6 * log.vx_mps[i],
            log.steer_rad[i].to_degrees(),
            log.ay_mps2[i] / 9.80665,
            log.ax_mps2[i] / 9.80665,
            log.yaw_rate_radps[i].to_degrees(),
        );
    }
    text
}

/// The log, calibrated, through an export.
fn conditioned(log: &Log) -> Log {
    read(&exported(log), "", &options())
}

/// As [`conditioned`], where the logger knows no wheels.
fn without_wheels(log: &Log) -> Log {
    read(&exported(log).replace("Wheel Speed ", "Board "), "", &options())
}

fn channels(log: &Log) -> [(Role, &Vec<f64>); 9] {
    let [fl, fr, rl, rr] = &log.wheel_speed_radps;
    [
        (Role::WheelSpeedFl, fl),
        (Role::WheelSpeedFr, fr),
        (Role::WheelSpeedRl, rl),
        (Role::WheelSpeedRr, rr),
        (Role::Steer, &log.steer_rad),
        (Role::Vx, &log.vx_mps),
        (Role::Ax, &log.ax_mps2),
        (Role::Ay, &log.ay_mps2),
        (Role::YawRate, &log.yaw_rate_radps),
    ]
}

fn channel(log: &mut Log, role: Role) -> &mut Vec<f64> {
    match role {
        Role::WheelSpeedFl => &mut log.wheel_speed_radps[0],
        Role::WheelSpeedFr => &mut log.wheel_speed_radps[1],
        Role::WheelSpeedRl => &mut log.wheel_speed_radps[2],
        Role::WheelSpeedRr => &mut log.wheel_speed_radps[3],
        Role::Steer => &mut log.steer_rad,
        Role::Vx => &mut log.vx_mps,
        Role::Ax => &mut log.ax_mps2,
        Role::Ay => &mut log.ay_mps2,
        _ => &mut log.yaw_rate_radps,
    }
}

/// Noise of usual sensors, white.
fn noisy(mut log: Log, seed: u64) -> Log {
    let random = Random::new(seed);
    for (who, (role, size)) in [
        (Role::Vx, 0.1),
        (Role::Ax, 0.5),
        (Role::Ay, 0.5),
        (Role::YawRate, 0.01),
        (Role::Steer, 0.002),
        (Role::WheelSpeedFl, 0.1),
        (Role::WheelSpeedFr, 0.1),
        (Role::WheelSpeedRl, 0.1),
        (Role::WheelSpeedRr, 0.1),
    ]
    .into_iter()
    .enumerate()
    {
        for (i, v) in channel(&mut log, role).iter_mut().enumerate() {
            *v += size * random.normal(1, 0, who as u32, i as u32);
        }
    }
    log
}

fn delayed(mut log: Log, roles: &[Role], delay_s: f64) -> Log {
    let dt = log.dt_s;
    for role in roles {
        let truth = channel(&mut log, *role).clone();
        for (i, v) in channel(&mut log, *role).iter_mut().enumerate() {
            let place = (i as f64 - delay_s / dt).max(0.0);
            let (from, share) = (place as usize, place.fract());
            let next = truth[(from + 1).min(truth.len() - 1)];
            *v = truth[from] + share * (next - truth[from]);
        }
    }
    log
}

/// What was applied, in words.
fn applied(calibration: &Calibration) -> Vec<String> {
    let applied = calibration.findings.iter().filter(|f| f.applied);
    applied.map(|f| f.to_string()).collect()
}

fn assert_nothing_applied(log: &Log) {
    assert_eq!(applied(&log.calibration), Vec::<String>::new());
}

#[test]
fn a_log_that_is_right_comes_through_bit_for_bit() {
    let truth = perfect();
    let native = read(BUNDLED, "", &options());
    assert_nothing_applied(&native);
    for ((role, before), (_, after)) in channels(&truth).into_iter().zip(channels(&native)) {
        assert_eq!(before, after, "{role:?}");
    }
    // What was looked for is told all the same.
    for kind in [
        FindingKind::Delay,
        FindingKind::Offset,
        FindingKind::Sign,
        FindingKind::Gain,
    ] {
        assert!(
            native.calibration.findings.iter().any(|f| f.kind == kind),
            "{kind:?}"
        );
    }
    let other = conditioned(&truth);
    assert_nothing_applied(&other);
    assert_eq!(other.samples(), truth.samples());
    for ((role, before), (_, after)) in channels(&truth).into_iter().zip(channels(&other)) {
        let worst = before
            .iter()
            .zip(after)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(worst < 1e-11, "{role:?} {worst}");
    }
}

#[test]
fn noise_is_no_fault() {
    for seed in 1..6 {
        assert_nothing_applied(&conditioned(&noisy(perfect(), seed)));
    }
    // Nor are the steps of a coarse logger.
    let mut coarse = perfect();
    for role in Role::WHEELS {
        channel(&mut coarse, role)
            .iter_mut()
            .for_each(|v| *v = (v.abs() * 10.0).round() / 10.0);
    }
    coarse
        .ay_mps2
        .iter_mut()
        .for_each(|v| *v = (*v * 10.0).round() / 10.0);
    coarse
        .vx_mps
        .iter_mut()
        .for_each(|v| *v = (*v * 36.0).round() / 36.0);
    assert_nothing_applied(&conditioned(&coarse));
}

#[test]
fn a_late_channel_is_found_and_no_other_is_moved() {
    const LATE_S: f64 = 0.14;
    for roles in [
        &[Role::Vx][..],
        &[Role::Ax],
        &[Role::Ax, Role::Ay],
        &[Role::YawRate],
        &[Role::WheelSpeedFl],
        &[Role::WheelSpeedRr],
        &Role::WHEELS,
    ] {
        for (log, tolerance) in [(perfect(), 0.006), (noisy(perfect(), 4), 0.01)] {
            let truth = log.clone();
            let found = conditioned(&delayed(log, roles, LATE_S));
            for (role, _) in channels(&truth) {
                let delay = found.calibration.applied(role, FindingKind::Delay);
                if roles.contains(&role) {
                    let delay =
                        delay.unwrap_or_else(|| panic!("{role:?} of {roles:?}: {:#?}", found.calibration));
                    assert!((delay - LATE_S).abs() < tolerance, "{role:?} {delay}");
                } else {
                    assert_eq!(delay, None, "{role:?} beside {roles:?}");
                }
            }
            let others = found.calibration.findings.iter();
            assert!(
                others.clone().all(|f| !f.applied || f.kind == FindingKind::Delay),
                "{:?}",
                applied(&found.calibration)
            );
        }
    }
}

/// What the car does between steering and yaw, and between yaw and sideways acceleration, is not a sensor's delay.
#[test]
fn the_lags_of_the_car_are_left() {
    let log = conditioned(&delayed(perfect(), &[Role::Ay, Role::Steer], 0.1));
    assert_nothing_applied(&log);
    assert!(
        log.calibration
            .notes
            .iter()
            .any(|n| n.starts_with("ay, steer: no delay"))
    );
}

#[test]
fn offsets_are_found_and_small_ones_are_left() {
    for (log, tolerance) in [(perfect(), [2e-5, 0.02]), (noisy(perfect(), 2), [2e-4, 0.1])] {
        let mut off = log.clone();
        off.yaw_rate_radps.iter_mut().for_each(|r| *r += 0.005);
        off.ay_mps2.iter_mut().for_each(|a| *a += 0.3);
        let found = conditioned(&off);
        for (role, value, tolerance) in [
            (Role::YawRate, 0.005, tolerance[0]),
            (Role::Ay, 0.3, tolerance[1]),
        ] {
            let offset = found.calibration.applied(role, FindingKind::Offset).unwrap();
            assert!((offset - value).abs() < tolerance, "{role:?} {offset}");
        }
        assert_eq!(applied(&found.calibration).len(), 2);
        let mut hardly = log;
        hardly.yaw_rate_radps.iter_mut().for_each(|r| *r += 4e-4);
        hardly.ay_mps2.iter_mut().for_each(|a| *a += 0.03);
        assert_nothing_applied(&conditioned(&hardly));
    }
}

/// A driver who weaves: within two seconds, sideways motion takes three tenths of the turning off the lateral acceleration. Smoothed
/// signals have an offset of -0.03 m/s^2. Those as they are have -0.10, of a log that is right.
#[test]
fn sideways_motion_is_no_offset() {
    let mut log = perfect();
    let turning: Vec<f64> = log
        .vx_mps
        .iter()
        .zip(&log.yaw_rate_radps)
        .map(|(v, r)| v * r)
        .collect();
    let slow = smoothed(&turning, (1.0 / log.dt_s) as usize);
    for (ay, (turning, slow)) in log.ay_mps2.iter_mut().zip(turning.iter().zip(slow)) {
        *ay -= 0.3 * (turning - slow);
    }
    let found = conditioned(&log).calibration;
    let offset = found.finding(Role::Ay, FindingKind::Offset).unwrap();
    assert!(!offset.applied && offset.value.abs() < 0.05, "{offset:?}");
}

/// Part of a lap turns by any angle: that is no offset.
#[test]
fn what_is_no_lap_tells_no_offset() {
    let lap = perfect();
    for range in [0..3500, 500..5300, 923..6164, 1691..4881] {
        let found = conditioned(&lap.slice(range).unwrap());
        assert_nothing_applied(&found);
        assert!(
            found
                .calibration
                .notes
                .iter()
                .any(|n| n.starts_with("yaw_rate: no complete lap"))
        );
    }
}

#[test]
fn swapped_signs_are_found() {
    for role in [Role::Steer, Role::Ay, Role::Ax, Role::YawRate] {
        let mut log = noisy(perfect(), 3);
        channel(&mut log, role).iter_mut().for_each(|v| *v = -*v);
        for found in [conditioned(&log), without_wheels(&log)] {
            assert_eq!(found.calibration.applied(role, FindingKind::Sign), Some(-1.0));
            let applied = applied(&found.calibration);
            assert_eq!(applied.len(), 1, "{applied:?}");
        }
    }
}

/// The bundled car's ratio is 14; the logger's own scale may be a tenth off. The road wheels' angle is never divided:
/// `a_log_that_is_right_comes_through_bit_for_bit`.
#[test]
fn the_steering_wheels_angle_is_told_from_the_road_wheels() {
    for (ratio, seed) in [(14.0, 1), (-14.0, 2), (12.6, 3), (15.4, 4)] {
        let mut log = noisy(perfect(), seed);
        let at_the_wheels = log.steer_rad.clone();
        for angle in &mut log.steer_rad {
            *angle *= ratio;
        }
        let found = conditioned(&log);
        let finding = found
            .calibration
            .finding(Role::Steer, FindingKind::SteeringRatio)
            .unwrap();
        assert!(finding.applied, "{finding}");
        // What is left of understeer in it is a fifth.
        assert!((finding.value / ratio.abs() - 1.0).abs() < 0.2, "{finding}");
        for (angle, before) in found.steer_rad.iter().zip(&at_the_wheels) {
            assert!((angle - before * ratio.abs() / 14.0).abs() < 1e-9);
        }
    }
}

#[test]
fn a_ratio_of_the_channel_map_is_not_judged() {
    let mut log = perfect();
    for angle in &mut log.steer_rad {
        *angle *= 3.0;
    }
    let log = read(&exported(&log), "[vehicle]\nsteering_ratio = 3.0\n", &options());
    assert!(
        log.calibration
            .finding(Role::Steer, FindingKind::SteeringRatio)
            .is_none()
    );
    assert!((log.steer_rad[700] - perfect().steer_rad[700]).abs() < 1e-9);
}

/// A lateral acceleration that is computed from speed and yaw rate follows what is found of these, and has no findings of its own.
#[test]
fn an_acceleration_that_is_computed_has_no_faults_of_its_own() {
    let mut log = perfect();
    log.yaw_rate_radps.iter_mut().for_each(|r| *r = 0.01 - *r);
    let found = read(&exported(&log).replace("G Force Lat", "Board G"), "", &options());
    let of_ay = found.calibration.findings.iter().filter(|f| f.role == Role::Ay);
    assert_eq!(of_ay.count(), 0);
    let sign = found.calibration.finding(Role::YawRate, FindingKind::Sign);
    let offset = found.calibration.finding(Role::YawRate, FindingKind::Offset);
    assert!(sign.unwrap().applied && offset.unwrap().applied);
    let places = found.ay_mps2.iter().zip(&found.vx_mps).zip(&found.yaw_rate_radps);
    assert!(places.into_iter().all(|((ay, v), r)| *ay == v * r));
    assert!((found.yaw_rate_radps[700] - perfect().yaw_rate_radps[700]).abs() < 5e-4);
}

#[test]
fn a_log_without_wheel_speeds_is_read() {
    let log = perfect();
    let found = without_wheels(&log);
    assert!(found.wheel_speed_radps.iter().all(Vec::is_empty));
    assert_nothing_applied(&found);
    let said = "wheel_speed_fl, wheel_speed_fr, wheel_speed_rl, wheel_speed_rr: not logged";
    assert!(found.calibration.notes.iter().any(|note| note.starts_with(said)));
    for (a, b) in found.yaw_rate_radps.iter().zip(&log.yaw_rate_radps) {
        assert!((a - b).abs() < 1e-12);
    }
    assert!(found.slice(10..20).unwrap().wheel_speed_radps[0].is_empty());

    // The front wheels alone: theirs are the speeds that are judged.
    let text = exported(&log).replace("Wheel Speed R", "Board R");
    let found = read(&text, "", &options());
    assert!(found.wheel_speed_radps.map(|wheel| wheel.is_empty()) == [false, false, true, true]);
    assert!(applied(&found.calibration).is_empty());
    let radius = |role| found.calibration.finding(role, FindingKind::RollingRadius);
    assert!(radius(Role::WheelSpeedFl).is_some() && radius(Role::WheelSpeedRl).is_none());

    // Neither ground speed nor the speeds of the wheels that would stand in for it.
    let text = text
        .replace("Wheel Speed F", "Board F")
        .replace("Ground Speed", "Board");
    let recording = Recording::parse(text.as_bytes(), "lap.csv").unwrap();
    let refused = Log::from_recording(&recording, &ChannelMap::default(), &options());
    let said = refused.unwrap_err().to_string();
    assert!(
        said.contains("channel vx") && said.contains("front wheels"),
        "{said}"
    );
}

/// The wheels of a car whose axles have radii of their own, known or not.
/// The perfect lap as a file of its own columns, with the cells changed by row, column and value.
fn with_cells(change: impl Fn(usize, &str, &str) -> Option<&'static str>) -> String {
    let mut names: Vec<&str> = Vec::new();
    let (mut text, mut row) = (String::new(), 0);
    for line in BUNDLED.lines().filter(|line| !line.starts_with('#')) {
        let cells: Vec<&str> = line.split(',').collect();
        if names.is_empty() {
            names = cells;
            text.push_str(line);
        } else {
            let changed = cells.iter().zip(&names).map(|(cell, name)| {
                let value = change(row, name, cell);
                value.unwrap_or(cell)
            });
            text.push_str(&changed.collect::<Vec<_>>().join(","));
            row += 1;
        }
        text.push('\n');
    }
    text
}

#[test]
fn samples_that_are_missing_are_joined() {
    let truth = perfect();
    // Two dropouts, of two rows and of one, and a channel that is logged at every fifth row.
    let dropped = |row: usize| matches!(row, 1000 | 1001 | 3000);
    let text = with_cells(|row, name, _| match name {
        "yaw_rate_radps" if dropped(row) => Some(""),
        "vx_mps" if dropped(row) => Some("NaN"),
        "steer_rad" if row % 5 != 0 => Some(""),
        _ => None,
    });
    let log = read(&text, "", &as_logged());
    assert_eq!(log.samples(), truth.samples() - (truth.samples() - 1) % 5);
    assert!((log.dt_s - truth.dt_s).abs() < 1e-12);
    let notes = log.calibration.notes.join("\n");
    for said in [
        "\"yaw_rate_radps\": 3 of",
        "\"vx_mps\": 3 of",
        "\"steer_rad\": 5675 of",
        "straight lines join the others",
    ] {
        assert!(notes.contains(said), "{said}: {notes}");
    }
    for i in 0..log.samples() {
        let near = |a: f64, b: f64, bar: f64| assert!((a - b).abs() < bar, "sample {i}: {a} {b}");
        // Times are sums, and the line between two samples a rounding off at them.
        near(log.ax_mps2[i], truth.ax_mps2[i], 1e-6);
        let (before, after) = match i {
            1000 | 1001 => (999, 1002),
            3000 => (2999, 3001),
            _ => (i, i),
        };
        let line = |values: &[f64]| {
            let share = if after > before {
                (i - before) as f64 / (after - before) as f64
            } else {
                0.0
            };
            values[before] + share * (values[after] - values[before])
        };
        near(log.yaw_rate_radps[i], line(&truth.yaw_rate_radps), 1e-6);
        near(log.vx_mps[i], line(&truth.vx_mps), 1e-6);
        let fifth = i - i % 5;
        let share = (i - fifth) as f64 / 5.0;
        let next = truth.steer_rad[(fifth + 5).min(truth.samples() - 1)];
        let steered = truth.steer_rad[fifth] + share * (next - truth.steer_rad[fifth]);
        near(log.steer_rad[i], steered, 1e-6);
    }
}

#[test]
fn long_dropouts_and_other_text_are_refused() {
    let refused = |text: &str| {
        let recording = Recording::parse(text.as_bytes(), "lap.csv").unwrap();
        let error = Log::from_recording(&recording, &ChannelMap::default(), &as_logged());
        error.unwrap_err().to_string()
    };
    let long =
        with_cells(|row, name, _| (name == "yaw_rate_radps" && (100..110).contains(&row)).then_some(""));
    let said = refused(&long);
    assert!(
        said.contains("channel yaw_rate_radps: found a gap of 0.2"),
        "{said}"
    );
    let text = with_cells(|row, name, _| match (name, row) {
        ("vx_mps", 50) => Some(""),
        ("vx_mps", 70) => Some("off"),
        _ => None,
    });
    let said = refused(&text);
    assert!(
        said.contains("channel vx_mps: found \"off\", expected a finite number"),
        "{said}"
    );
}

#[test]
fn what_is_computed_of_missing_samples_is_missing() {
    let text = with_cells(|row, name, _| (name == "yaw_rate_radps" && row == 500).then_some(""));
    let map =
        "[channels.yaw_rate]\nexpression = \"2 * {yaw_rate_radps} - {yaw_rate_radps}\"\nunit = \"rad/s\"\n";
    let log = read(&text, map, &as_logged());
    let truth = perfect();
    let middle = (truth.yaw_rate_radps[499] + truth.yaw_rate_radps[501]) / 2.0;
    assert!((log.yaw_rate_radps[500] - middle).abs() < 1e-6);
}

#[test]
fn each_axle_has_its_own_radius() {
    const OTHER: [f64; 2] = [0.325, 0.328];
    let truth = perfect();
    let mut log = truth.clone();
    for wheel in 0..4 {
        let scale = RADII[wheel / 2] / OTHER[wheel / 2];
        log.wheel_speed_radps[wheel].iter_mut().for_each(|w| *w *= scale);
    }
    let known = LogOptions {
        rolling_radius_m: Some(OTHER),
        ..LogOptions::default()
    };
    let text = exported(&log);
    let found = read(&text, "", &known);
    assert_nothing_applied(&found);
    let front = found
        .calibration
        .finding(Role::WheelSpeedFl, FindingKind::RollingRadius)
        .unwrap();
    assert!((front.value / OTHER[0] - 1.0).abs() < 5e-4, "{front}");
    // Logged in km/h, the wheels' rims are as fast as logged, whatever the radius.
    let rim: Vec<f64> = log.wheel_speed_radps[2].iter().map(|w| w * OTHER[1]).collect();
    let mut linear = text.replace("\"rpm\"", "\"km/h\"");
    let rows: String = (0..log.samples())
        .map(|i| {
            let speed = |w: usize| log.wheel_speed_radps[w][i] * OTHER[w / 2] * 3.6;
            format!(
                "{},{},{},{},{},{},{},{},{},{}\n",
                log.time_s[i],
                3.6 * log.vx_mps[i],
                speed(0),
                speed(1),
                speed(2),
                speed(3),
                log.steer_rad[i].to_degrees(),
                log.ay_mps2[i] / 9.80665,
                log.ax_mps2[i] / 9.80665,
                log.yaw_rate_radps[i].to_degrees()
            )
        })
        .collect();
    linear.truncate(linear.find("\n\n0,").unwrap() + 2);
    let found = read(&(linear + &rows), "", &known);
    assert_nothing_applied(&found);
    for (w, rim) in found.wheel_speed_radps[2].iter().zip(&rim) {
        assert!((w * OTHER[1] - rim).abs() < 1e-9);
    }
}

#[test]
fn other_radii_are_found_where_slip_does_not_explain_them() {
    let turned = |scales: [f64; 4]| {
        let mut log = noisy(perfect(), 5);
        for (wheel, scale) in log.wheel_speed_radps.iter_mut().zip(scales) {
            wheel.iter_mut().for_each(|w| *w /= scale);
        }
        log
    };
    // Both front wheels larger by one per cent, and the left rear one by half a per cent.
    let log = turned([1.01, 1.01, 1.005, 1.0]);
    let found = conditioned(&log);
    for role in [Role::WheelSpeedFl, Role::WheelSpeedFr] {
        let radius = found
            .calibration
            .applied(role, FindingKind::RollingRadius)
            .unwrap();
        assert!((radius / 0.325 - 1.01).abs() < 1e-3, "{radius}");
    }
    let of = |role| {
        found
            .calibration
            .applied(role, FindingKind::RollingRadius)
            .unwrap()
    };
    let ratio = of(Role::WheelSpeedRl) / of(Role::WheelSpeedRr);
    assert!((ratio - 1.005).abs() < 1e-3, "{ratio}");
    // A radius that the study finds is left to it.
    let free = LogOptions {
        radius_is_free: [true, true],
        ..options()
    };
    let found = read(&exported(&turned([1.01, 1.01, 1.0, 1.0])), "", &free);
    assert_nothing_applied(&found);
}
