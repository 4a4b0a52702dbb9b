//! A log: its channels, what they are taken for, what is missing, and a channel map to edit.

use crate::cli::output::outln;
use crate::cli::write_new;
use lapswarm::Result;
use lapswarm::telemetry::{ChannelList, ChannelMap, Log, LogOptions, Recording};
use lapswarm::vehicle::Car;
use std::path::Path;

/// Reads a log as an identification of the bundled car does, and says what is in it. Where something is missing its channels are
/// printed nonetheless, so that a map can be written.
pub fn described(path: &Path, map: Option<&Path>, write: Option<&Path>) -> Result<String> {
    let map = map.map_or_else(|| Ok(ChannelMap::default()), ChannelMap::read)?;
    let recording = Recording::read(path)?;
    let list = ChannelList::of(&recording, &map);
    let mut text = list.table();
    if let Some(file) = write {
        write_new(&[(file.to_owned(), list.map_text().as_bytes())])?;
        text += &format!("  channel map: {}\n", file.display());
    }
    let car = Car::bundled()?;
    let options = LogOptions {
        rolling_radius_m: Some([car.chassis.radius_front, car.chassis.radius_rear]),
        ..LogOptions::default()
    };
    let log = Log::from_recording(&recording, &map, &options).inspect_err(|_| {
        outln!("{}: {} channels", path.display(), list.channels.len());
        outln!("{}", text.trim_end());
    })?;
    for lap in &log.laps {
        let seconds = (lap.end - lap.start) as f64 * log.dt_s;
        let state = if lap.complete {
            ""
        } else {
            ", not from line to line"
        };
        text += &format!("  lap {}: {seconds:.2} s{state}\n", lap.number);
    }
    for finding in log.calibration.findings.iter().filter(|finding| finding.applied) {
        text += &format!("  {finding}\n");
    }
    Ok(format!(
        "a log of {} laps: {} samples at {:.0} Hz\n{}",
        log.laps.len(),
        log.time_s.len(),
        1.0 / log.dt_s,
        text.trim_end()
    ))
}
