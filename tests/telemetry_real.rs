//! A real outing, read where it is at hand.

use lapswarm::telemetry::{ChannelMap, Log, LogOptions};
use std::path::PathBuf;

fn shared() -> PathBuf {
    std::env::var_os("LAPSWARM_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"),
        PathBuf::from,
    )
}

#[test]
fn calder() {
    let path = shared().join("data/telemetry/motec_sample1_calder_i2style.csv");
    let map = ChannelMap::parse("[vehicle]\nrolling_radius_m = 0.325", "m.toml").unwrap();
    let log = Log::read(&path, &map, &LogOptions::default()).unwrap();
    for f in &log.calibration.findings {
        eprintln!("{f:?}");
    }
    for n in &log.calibration.notes {
        eprintln!("{n}");
    }
    eprintln!("{:?} {} {}", log.laps, log.dt_s, log.samples());
    for lap in &log.laps {
        let l = log.slice(lap.start..lap.end).unwrap();
        let turn: f64 = l.yaw_rate_radps.iter().sum::<f64>() * l.dt_s;
        eprintln!(
            "{} {:.2} s {:.1} m turn {turn:.3}",
            lap.number,
            l.samples() as f64 * l.dt_s,
            l.distance_m.last().unwrap()
        );
    }
}
