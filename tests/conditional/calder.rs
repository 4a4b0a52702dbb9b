//! A real outing at Calder Park, read where it is at hand: as a MoTeC CSV export, and as the `.ld` it came from.

use crate::common::harness::{Case, outside};
use std::path::PathBuf;

use lapswarm::telemetry::{ChannelMap, FindingKind, Format, Log, LogOptions, Recording, Role};

pub fn tests() -> Vec<Case> {
    let case = |name, run| Case::new(module_path!(), name, run);
    vec![
        case("calder_export", calder_export).needing(|| export().map(drop)),
        case("calder_ld", calder_ld).needing(|| ld().map(drop)),
        case(
            "both_formats_hold_the_same_samples",
            both_formats_hold_the_same_samples,
        )
        .needing(|| export().and(ld()).map(drop)),
    ]
}

/// The CSV export of the outing.
fn export() -> Result<PathBuf, String> {
    outside(
        "motec_sample1_calder_i2style.csv",
        "the Calder outing, as i2 exports it",
    )
}

/// The `motec-i2` crate is published with the same outing as a `.ld`.
fn ld() -> Result<PathBuf, String> {
    let home = || std::env::home_dir().map(|home| home.join(".cargo"));
    let cargo = std::env::var_os("CARGO_HOME").map(PathBuf::from).or_else(home);
    let registries = cargo.and_then(|cargo| std::fs::read_dir(cargo.join("registry/src")).ok());
    registries
        .into_iter()
        .flatten()
        .flatten()
        .map(|registry| registry.path().join("motec-i2-0.2.0/samples/Sample1.ld"))
        .find(|file| file.is_file())
        .ok_or_else(|| "the sources of the crate motec-i2, with its sample, are not here".to_owned())
}

fn map() -> ChannelMap {
    ChannelMap::parse("[vehicle]\nrolling_radius_m = 0.325\n", "calder.toml").unwrap()
}

fn check_calibration(log: &Log) {
    let c = &log.calibration;
    assert_eq!(c.applied(Role::Steer, FindingKind::Sign), Some(-1.0));
    for role in [Role::YawRate, Role::Ay, Role::Ax] {
        assert_eq!(c.finding(role, FindingKind::Sign).unwrap().value, 1.0);
    }
    for (role, range) in [
        (Role::Vx, 0.03..0.08),
        (Role::Ax, 0.08..0.15),
        (Role::Ay, 0.08..0.15),
    ] {
        let delay = c.applied(role, FindingKind::Delay).unwrap();
        assert!(range.contains(&delay), "{role:?} {delay}");
    }
    // Its laps turn full circles without a correction; its accelerometer does not read zero.
    assert_eq!(c.applied(Role::YawRate, FindingKind::Offset), None);
    let ay = c.applied(Role::Ay, FindingKind::Offset).unwrap();
    assert!((0.5..0.75).contains(&ay), "{ay}");
    for role in Role::WHEELS {
        let radius = c.finding(role, FindingKind::RollingRadius).unwrap().value;
        assert!((radius - 0.325).abs() < 0.002, "{role:?} {radius}");
    }
}

fn calder_export() {
    let path = export().unwrap();
    let log = Log::read(&path, &map(), &LogOptions::default()).unwrap();
    assert_eq!(log.dt_s, 0.05);
    check_calibration(&log);
    let laps: Vec<_> = log
        .laps
        .iter()
        .filter(|lap| lap.complete)
        .map(|lap| (lap.number, (lap.end - lap.start) as f64 * log.dt_s))
        .collect();
    assert_eq!(log.laps.len(), 5);
    for ((number, time_s), (expected, beacons_s)) in laps.iter().zip([(1, 63.68), (2, 65.19), (3, 63.76)]) {
        assert_eq!(*number, expected);
        assert!((time_s - beacons_s).abs() <= log.dt_s, "lap {number}: {time_s} s");
        let lap = log.lap(*number).unwrap();
        // A clockwise circuit of 2.28 km.
        let turned = lap.yaw_rate_radps.iter().sum::<f64>() * lap.dt_s;
        assert!(
            (turned + std::f64::consts::TAU).abs() < 0.3,
            "lap {number}: {turned} rad"
        );
        let length = lap.distance_m.last().copied().unwrap();
        assert!((2200.0..2320.0).contains(&length), "lap {number}: {length} m");
    }
}

fn calder_ld() {
    let path = ld().unwrap();
    let recording = Recording::read(&path).unwrap();
    assert_eq!(recording.format, Format::MotecLd);
    assert_eq!(recording.metadata.venue.as_deref(), Some("Calder"));
    let log = Log::from_recording(&recording, &map(), &LogOptions::default()).unwrap();
    check_calibration(&log);
}

fn both_formats_hold_the_same_samples() {
    let (export, ld) = (export().unwrap(), ld().unwrap());
    let (export, ld) = (Recording::read(export).unwrap(), Recording::read(ld).unwrap());
    for (name, rounding) in [
        ("Ground Speed", 0.051),
        ("Wheel Speed FR", 0.051),
        ("Steered Angle", 0.051),
        ("G Force Lat", 0.0051),
        ("Gyro Yaw Velocity", 0.0051),
    ] {
        let (exported, logged) = (export.channel(name).unwrap(), ld.channel(name).unwrap());
        let mut compared = 0;
        for (i, value) in logged.values.iter().enumerate() {
            let time_s = logged.time_s(i);
            let row = (time_s * 20.0).round();
            if (row / 20.0 - time_s).abs() < 1e-9
                && let Some(other) = exported.values.get(row as usize)
            {
                assert!((value - other).abs() <= rounding, "{name} at {time_s} s");
                compared += 1;
            }
        }
        assert!(compared > 4000, "{name}: {compared}");
    }
}
