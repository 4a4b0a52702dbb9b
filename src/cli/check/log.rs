//! A log: its channels, what they are taken for, what is missing, and a channel map to edit.

use crate::cli::output::outln;
use crate::cli::write_new;
use lapswarm::Result;
use lapswarm::telemetry::{ChannelList, ChannelMap, Lap, Log, LogOptions, Outing, Recording};
use lapswarm::vehicle::Car;
use std::path::Path;

/// How a log is read.
#[derive(Clone, Copy, Default)]
pub struct Reading<'a> {
    /// The car that drove it, by name or file; the bundled one where none is given.
    pub car: Option<&'a str>,
    /// A channel map.
    pub map: Option<&'a Path>,
    /// Where a channel map is to be written.
    pub write: Option<&'a Path>,
}

/// Reads a log as an identification of the car does, and says what is in it. Where something is missing its channels are printed
/// nonetheless, so that a map can be written.
pub fn described(path: &Path, reading: Reading<'_>) -> Result<String> {
    let Reading { map, write, .. } = reading;
    let car = reading.car.map_or_else(Car::bundled, Car::load)?;
    let map = map.map_or_else(|| Ok(ChannelMap::default()), ChannelMap::read)?;
    let recording = Recording::read(path)?;
    let recording = map.computed(&recording)?;
    let list = ChannelList::of(&recording, &map);
    let mut text = list.table();
    if let Some(file) = write {
        write_new(&[(file.to_owned(), list.map_text().as_bytes())])?;
        text += &format!("  channel map: {}\n", file.display());
    }
    text += &read_for(&car, reading.car.is_some());
    let options = LogOptions::of(&car);
    let told = || {
        outln!("{}: {} channels", path.display(), list.channels.len());
        outln!("{}", text.trim_end());
    };
    if list.is_of_places_alone() {
        let outing = Outing::of(&recording, &map).inspect_err(|_| told())?;
        if let Some(outing) = outing {
            let mut text = text.clone();
            for note in &outing.notes {
                text += &format!("  {note}\n");
            }
            text += &laps(&outing.laps, |sample| {
                outing.time_s[sample.min(outing.time_s.len() - 1)]
            });
            return Ok(format!(
                "a log of {} laps: {} samples; it lacks what a model of the car is driven by, and tells laps and speed\n{}",
                outing.laps.len(),
                outing.time_s.len(),
                text.trim_end()
            ));
        }
    }
    let log = Log::from_recording(&recording, &map, &options).inspect_err(|_| told())?;
    text += &laps(&log.laps, |sample| sample as f64 * log.dt_s);
    let of_laps = log
        .calibration
        .notes
        .iter()
        .filter(|note| note.starts_with("laps: "));
    text.extend(of_laps.map(|note| format!("  {note}\n")));
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

/// What the log's reading takes from the car.
fn read_for(car: &Car, is_given: bool) -> String {
    let radii = [car.chassis.radius_front, car.chassis.radius_rear];
    let other = if is_given {
        ""
    } else {
        "; --car names the car that drove"
    };
    format!(
        "  read for the car {}: steering ratio {}, rolling radii {} m in front and {} m at the rear{other}\n",
        car.name, car.steering_ratio, radii[0], radii[1]
    )
}

/// The laps with their times, a line each; `time_s` is that of a sample.
fn laps(laps: &[Lap], time_s: impl Fn(usize) -> f64) -> String {
    let line = |lap: &Lap| {
        let seconds = time_s(lap.end) - time_s(lap.start);
        let state = if lap.complete {
            ""
        } else {
            ", not from line to line"
        };
        format!("  lap {}: {seconds:.2} s{state}\n", lap.number)
    };
    laps.iter().map(line).collect()
}
