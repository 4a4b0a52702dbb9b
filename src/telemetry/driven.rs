//! The path of the car: one lap of a log with GPS.

use super::build::{check_samples, lap_numbers};
use super::channel_map::ChannelMap;
use super::laps::{Lap, Marks};
use super::path::start_line;
use super::recording::{Channel, Recording};
use super::role::Role;
use super::{csv_native, motec_ld, text, vbox};
use crate::config::with_commas;
use crate::{Error, Place, Result};
use std::ops::Range;
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

/// The earth's radius (m), for lengths of laps.
const RADIUS_M: f64 = 6.371e6;

impl Recording {
    /// Whether a file's content or extension is that of a log.
    pub(crate) fn looks_like_one(bytes: &[u8], path: &Path) -> bool {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ld")) || motec_ld::is_ld(bytes) {
            return true;
        }
        let start = &bytes[..bytes.len().min(1 << 16)];
        let text = text::decode(start);
        if vbox::is_vbo(&text, path) {
            return true;
        }
        let text = with_commas(&text);
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
        let find = |role: Role| {
            let names = role.usual_names();
            self.usual(names).ok_or_else(|| {
                Error::input(
                    &self.source,
                    Place::default().channel(role.key()),
                    "none",
                    format!("a channel called {}", names.join(", ")),
                )
            })
        };
        let (latitude, longitude) = (find(Role::Latitude)?, find(Role::Longitude)?);
        if latitude.values.len() != longitude.values.len() {
            return Err(Error::input(
                &self.source,
                Place::default().channel(&longitude.name),
                format!("{} samples", longitude.values.len()),
                format!("{}, as {} has", latitude.values.len(), latitude.name),
            ));
        }
        let factors = (in_degrees(self, latitude)?, in_degrees(self, longitude)?);
        let (number, range) = self.range_of_lap(lap, (latitude, longitude), factors)?;
        Ok(DrivenLap {
            latitude_deg: self.degrees(latitude, factors.0, 90.0, range.clone())?,
            longitude_deg: self.degrees(longitude, factors.1, 180.0, range.clone())?,
            lines: latitude
                .lines
                .as_ref()
                .map_or_else(Vec::new, |l| l[range].to_vec()),
            number,
        })
    }

    fn degrees(&self, channel: &Channel, factor: f64, most: f64, range: Range<usize>) -> Result<Vec<f64>> {
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

    /// The lap's number and its samples. A log that tells of no line is one road.
    fn range_of_lap(
        &self,
        asked: Option<u32>,
        (latitude, longitude): (&Channel, &Channel),
        factors: (f64, f64),
    ) -> Result<(Option<u32>, Range<usize>)> {
        let source = self.source.display().to_string();
        let times_of = |c: &Channel| -> Vec<f64> { (0..c.values.len()).map(|i| c.time_s(i)).collect() };
        let timed = |role: Role| {
            let channel = self.usual(role.usual_names()).filter(|c| !c.is_blank())?;
            let checked = match role {
                // Numbers may be left out.
                Role::Lap => Ok(()),
                _ => check_samples(&source, channel),
            };
            Some(checked.map(|()| (channel, times_of(channel))))
        };
        let numbers = timed(Role::Lap).transpose()?;
        let complete = timed(Role::LapComplete).transpose()?;
        // A distance that cannot be read tells of no laps.
        let distance = timed(Role::Distance).and_then(Result::ok);
        let numbered = numbers
            .as_ref()
            .map(|(channel, times)| Ok((&**times, lap_numbers(&source, channel, &channel.values)?)));
        let numbered = numbered.transpose()?;
        let line = start_line(self, &ChannelMap::default(), numbered.is_some())?;
        let marks = Marks {
            beacons_s: &self.beacons_s,
            line: line.as_ref(),
            numbers: numbered,
            complete: complete
                .as_ref()
                .map(|(channel, times)| (&**times, &*channel.values)),
            distance_m: distance
                .as_ref()
                .map(|(channel, times)| (&**times, &*channel.values)),
            whole: self.is_one_lap(),
        };
        let mut driven_m = Vec::with_capacity(latitude.values.len());
        let mut sum = 0.0;
        let mut last: Option<(f64, f64)> = None;
        for (lat, lon) in latitude.values.iter().zip(&longitude.values) {
            let here = ((lat * factors.0).to_radians(), (lon * factors.1).to_radians());
            if here.0.is_finite() && here.1.is_finite() {
                let (lat, lon) = last.unwrap_or(here);
                sum += RADIUS_M * (here.0 - lat).hypot((here.1 - lon) * here.0.cos());
                last = Some(here);
            }
            driven_m.push(sum);
        }
        let laps = marks.laps(&times_of(latitude), &driven_m);
        let line_told = !marks.beacons_s.is_empty() || laps.len() > 1;
        let number = marks
            .numbers
            .is_some()
            .then(|| laps.first().map(|lap| lap.number))
            .flatten();
        if !line_told && asked.is_none_or(|asked| number == Some(asked)) {
            return Ok((number, 0..latitude.values.len()));
        }
        let laps: Vec<Lap> = laps.into_iter().filter(|lap| line_told && lap.complete).collect();
        let found = match asked {
            Some(asked) => laps.iter().find(|lap| lap.number == asked),
            None => laps.first(),
        };
        let lap = found.ok_or_else(|| self.no_lap(asked, &laps))?;
        Ok((Some(lap.number), lap.start..lap.end))
    }

    fn no_lap(&self, asked: Option<u32>, laps: &[Lap]) -> Error {
        let there: Vec<String> = laps.iter().map(|lap| lap.number.to_string()).collect();
        Error::input(
            &self.source,
            "laps",
            match asked {
                Some(asked) => format!("no complete lap {asked}"),
                None => "no complete lap".to_owned(),
            },
            if there.is_empty() {
                "a lap from line to line, or a log of one road without laps".to_owned()
            } else {
                format!("one of {}", there.join(", "))
            },
        )
    }
}

/// What turns the values of a latitude or longitude into degrees.
///
/// # Errors
/// [`Error::Input`] for a unit that is not known.
pub(super) fn in_degrees(recording: &Recording, channel: &Channel) -> Result<f64> {
    let unit = channel.unit.trim().trim_end_matches('.').to_lowercase();
    Ok(match unit.as_str() {
        "" | "deg" | "°" | "degrees" | "degree" => 1.0,
        "rad" => 1f64.to_degrees(),
        // Racelogic logs minutes of arc.
        "min" | "minutes" => 1.0 / 60.0,
        _ => {
            return Err(Error::input(
                &recording.source,
                Place::default().channel(&channel.name),
                text::shown(&channel.unit),
                "deg, rad or min",
            ));
        }
    })
}
