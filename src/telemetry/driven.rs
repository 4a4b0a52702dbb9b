//! The path of the car: one lap of a log with GPS.

use super::recording::{Channel, Clock, Format, Recording};
use super::{csv_native, motec_ld, text};
use crate::{Error, Place, Result};
use std::path::Path;

/// One lap as positions on the globe.
#[derive(Clone, Debug, PartialEq)]
pub struct DrivenLap {
    /// Latitudes (degrees), one for each sample of the channel.
    pub latitude_deg: Vec<f64>,
    /// Longitudes (degrees).
    pub longitude_deg: Vec<f64>,
    /// The file line of each sample; empty for binary files.
    pub lines: Vec<usize>,
    /// The lap's number, where the log has laps.
    pub number: Option<u32>,
}

/// Names of these channels, in lower case and without anything but letters and digits.
const LATITUDE: [&str; 5] = ["latitudedeg", "gpslatitude", "latitude", "gpslat", "lat"];
const LONGITUDE: [&str; 7] = [
    "longitudedeg",
    "gpslongitude",
    "longitude",
    "gpslong",
    "gpslon",
    "long",
    "lon",
];
const LAP: [&str; 4] = ["lap", "lapnumber", "lapnum", "lapno"];

impl Recording {
    /// Whether a file's content or extension is that of a log.
    pub(crate) fn looks_like_one(bytes: &[u8], path: &Path) -> bool {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ld")) || motec_ld::is_ld(bytes) {
            return true;
        }
        let start = &bytes[..bytes.len().min(1 << 16)];
        let text = text::decode(start);
        let first = text::Rows::new(&text, path, true).next();
        first.and_then(Result::ok).is_some_and(|row| {
            row.cells.iter().any(|c| c == csv_native::TIME) || row.cell(0).eq_ignore_ascii_case("Format")
        })
    }

    fn usual(&self, names: &[&str]) -> Option<&Channel> {
        let plain = |name: &str| -> String {
            let kept = name.chars().filter(char::is_ascii_alphanumeric);
            kept.map(|c| c.to_ascii_lowercase()).collect()
        };
        names
            .iter()
            .find_map(|wanted| self.channels.iter().find(|c| plain(&c.name) == *wanted))
    }

    /// Positions on one lap: that of this number, or the first complete one; the whole log where it has no laps.
    ///
    /// # Errors
    /// [`Error::Input`] when the log has no latitude and longitude, no such lap, or no number where one is needed.
    pub fn driven_lap(&self, lap: Option<u32>) -> Result<DrivenLap> {
        let find = |names: &[&str], what: &str| {
            self.usual(names).ok_or_else(|| {
                Error::input(
                    &self.source,
                    Place::default().channel(what),
                    "none",
                    format!("a channel called {}", names.join(", ")),
                )
            })
        };
        let (latitude, longitude) = (find(&LATITUDE, "latitude")?, find(&LONGITUDE, "longitude")?);
        if latitude.values.len() != longitude.values.len() {
            return Err(Error::input(
                &self.source,
                Place::default().channel(&longitude.name),
                format!("{} samples", longitude.values.len()),
                format!("{}, as {} has", latitude.values.len(), latitude.name),
            ));
        }
        let (number, range) = self.range_of_lap(lap, latitude)?;
        Ok(DrivenLap {
            latitude_deg: self.degrees(latitude, 90.0, range.clone())?,
            longitude_deg: self.degrees(longitude, 180.0, range.clone())?,
            lines: latitude
                .lines
                .as_ref()
                .map_or_else(Vec::new, |l| l[range].to_vec()),
            number,
        })
    }

    fn degrees(&self, channel: &Channel, most: f64, range: std::ops::Range<usize>) -> Result<Vec<f64>> {
        let unit = channel.unit.trim().trim_end_matches('.').to_lowercase();
        let factor = match unit.as_str() {
            "" | "deg" | "°" | "degrees" | "degree" => 1.0,
            "rad" => 1f64.to_degrees(),
            // Racelogic logs minutes of arc.
            "min" | "minutes" => 1.0 / 60.0,
            _ => {
                return Err(Error::input(
                    &self.source,
                    Place::default().channel(&channel.name),
                    text::shown(&channel.unit),
                    "deg, rad or min",
                ));
            }
        };
        range
            .map(|i| {
                let x = channel.values[i] * factor;
                if x.abs() <= most {
                    return Ok(x);
                }
                let found = match &channel.unreadable {
                    Some(unreadable) if unreadable.sample == i => text::shown(&unreadable.text),
                    _ => channel.values[i].to_string(),
                };
                let expected = format!("degrees from -{most} to {most}");
                Err(Error::input(&self.source, channel.place(i), found, expected))
            })
            .collect()
    }

    /// The lap's number and the samples of a channel that lie in it.
    fn range_of_lap(
        &self,
        asked: Option<u32>,
        of: &Channel,
    ) -> Result<(Option<u32>, std::ops::Range<usize>)> {
        let samples = of.values.len();
        // Times at which laps begin, each with its number; the last one is where the last complete lap ends.
        let mut cuts: Vec<(f64, u32)> = Vec::new();
        let mut first_number = None;
        if let Some(numbers) = self.usual(&LAP) {
            for (i, pair) in numbers.values.windows(2).enumerate() {
                if pair[0] != pair[1] && (0.0..=1e6).contains(&pair[1]) {
                    cuts.push((numbers.time_s(i + 1), pair[1] as u32));
                }
            }
            first_number = numbers.values.first().map(|n| n.clamp(0.0, 1e6) as u32);
        } else {
            let numbered = self.beacons_s.iter().zip(1..);
            cuts.extend(numbered.map(|(&time, number)| (time, number)));
        }
        let index = |time: f64| match &of.clock {
            Clock::Times(times) => times.partition_point(|&t| t < time - 1e-9).min(samples),
            Clock::Rate { start_s, rate_hz } => {
                let position = (time - start_s) * rate_hz - 1e-6;
                (position.ceil().max(0.0) as usize).min(samples)
            }
        };
        if cuts.is_empty() {
            return match (asked, first_number) {
                (None, number) => Ok((number, 0..samples)),
                (Some(asked), Some(number)) if asked == number => Ok((Some(asked), 0..samples)),
                (Some(asked), _) => Err(self.no_lap(asked, &[])),
            };
        }
        let mut laps: Vec<(u32, std::ops::Range<usize>)> = cuts
            .windows(2)
            .map(|c| (c[0].1, index(c[0].0)..index(c[1].0)))
            .collect();
        if let (Format::Native, Some(number)) = (self.format, first_number) {
            // Native files begin and end on the line.
            laps.insert(0, (number, 0..index(cuts[0].0)));
            let (time, last) = cuts[cuts.len() - 1];
            laps.push((last, index(time)..samples));
        }
        let complete = self.usual(&["lapcomplete"]);
        let is_complete = |range: &std::ops::Range<usize>| {
            let flag = complete.and_then(|c| c.values.get(range.start));
            flag.is_none_or(|flag| *flag != 0.0)
        };
        laps.retain(|(_, range)| !range.is_empty() && is_complete(range));
        let found = match asked {
            Some(asked) => laps.iter().find(|(number, _)| *number == asked),
            None => laps.first(),
        };
        let none = || self.no_lap(asked.unwrap_or(0), &laps);
        let (number, range) = found.ok_or_else(none)?;
        Ok((Some(*number), range.clone()))
    }

    fn no_lap(&self, asked: u32, laps: &[(u32, std::ops::Range<usize>)]) -> Error {
        let there: Vec<String> = laps.iter().map(|(n, _)| n.to_string()).collect();
        Error::input(
            &self.source,
            "laps",
            format!("no complete lap {asked}"),
            if there.is_empty() {
                "a log with laps, or no lap asked for".to_owned()
            } else {
                format!("one of {}", there.join(", "))
            },
        )
    }
}
