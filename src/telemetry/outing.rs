//! What can be said of a log that has too little for a model of its car: its laps and its speed, as of a kart with GPS alone.

use super::build::{check_samples, lap_numbers};
use super::channel_map::ChannelMap;
use super::laps::{Lap, Marks};
use super::path::{Path, start_line};
use super::recording::Recording;
use super::role::Role;
use crate::Result;

/// Speed and laps of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Outing {
    /// Times (s).
    pub time_s: Vec<f64>,
    /// Speed at each (m/s).
    pub speed_mps: Vec<f64>,
    /// Distance from the first sample (m).
    pub distance_m: Vec<f64>,
    /// Its laps, in order and without gaps.
    pub laps: Vec<Lap>,
    /// Where speed and laps come from, in words.
    pub notes: Vec<String>,
}

impl Outing {
    /// The outing of a recording: with its speed, or the speed of its positions. None where it has neither.
    ///
    /// # Errors
    /// [`crate::Error::Input`] for channels that the map names and that are not there, units that are not known, and samples
    /// that are no numbers.
    pub fn of(recording: &Recording, map: &ChannelMap) -> Result<Option<Self>> {
        let source = recording.source.display().to_string();
        let channel = |role| -> Result<Option<(Vec<f64>, Vec<f64>)>> {
            let Some(found) = map.find(role, recording)? else {
                return Ok(None);
            };
            let whole = found.channel.without_gaps().filter(|_| role != Role::Lap);
            let channel = whole.as_ref().unwrap_or(found.channel);
            if role != Role::Lap {
                check_samples(&source, channel)?;
            }
            let factor = found.unit.map_or(1.0, |unit| unit.factor) * found.sign.unwrap_or(1.0);
            let values: Vec<f64> = channel.values.iter().map(|v| v * factor).collect();
            let times = (0..values.len()).map(|i| channel.time_s(i)).collect();
            Ok(Some((times, values)))
        };
        let mut notes = Vec::new();
        let (time_s, speed_mps) = match (channel(Role::Vx)?, Path::of(recording, map)?) {
            (Some(logged), _) => logged,
            (None, Some(path)) => {
                notes.push(
                    "vx: no ground speed is logged; the change of position stands in for it".to_owned(),
                );
                let speeds = path.speeds_mps();
                (path.times_s, speeds)
            }
            (None, None) => return Ok(None),
        };
        let mut distance_m = vec![0.0];
        for (times, speeds) in time_s.windows(2).zip(speed_mps.windows(2)) {
            let step_m = (times[1] - times[0]) * (speeds[0] + speeds[1]) / 2.0;
            distance_m.push(distance_m[distance_m.len() - 1] + step_m);
        }
        let (lap, complete) = (channel(Role::Lap)?, channel(Role::LapComplete)?);
        // A distance that cannot be read tells of no laps.
        let distance = channel(Role::Distance).unwrap_or_default();
        let numbers = match (&lap, map.find(Role::Lap, recording)?) {
            (Some((times, values)), Some(found)) => {
                Some((&times[..], lap_numbers(&source, found.channel, values)?))
            }
            _ => None,
        };
        let line = start_line(recording, map, numbers.is_some())?;
        notes.extend(line.iter().map(|line| line.words.clone()));
        let marks = Marks {
            beacons_s: &recording.beacons_s,
            numbers,
            complete: complete.as_ref().map(|(t, v)| (&t[..], &v[..])),
            distance_m: distance.as_ref().map(|(t, v)| (&t[..], &v[..])),
            line: line.as_ref(),
            whole: recording.is_one_lap(),
        };
        let laps = marks.laps(&time_s, &distance_m);
        Ok(Some(Self {
            time_s,
            speed_mps,
            distance_m,
            laps,
            notes,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::path::testing::kart;
    use super::*;
    use std::fmt::Write as _;

    /// The kart's log as Racelogic, RaceChrono and AiM write it.
    fn logs() -> [(&'static str, String); 3] {
        let mut vbo = "File created on 01/08/2026 at 10:00:00\n\n[header]\nsatellites\ntime\nlatitude\nlongitude\n\n[column \
                       names]\nsats time lat long\n\n[data]\n"
            .to_owned();
        let mut chrono = "This file is created using RaceChrono v7.0 ( http://racechrono.com/ ).\nFormat,3\nSession \
                          title,\"Kart\"\n\ntimestamp,fragment_id,lap_number,elapsed_time,latitude,longitude,speed\nunix \
                          time,,,s,deg,deg,m/s\n,,,,100: gps,100: gps,100: gps\n"
            .to_owned();
        let mut aim =
            "\"Format\",\"AiM CSV File\"\n\"Venue\",\"Oval\"\n\"Sample Rate\",\"10\"\n\n\"Time\",\"GPS \
                       Latitude\",\"GPS Longitude\",\"GPS Speed\"\n\"s\",\"deg\",\"deg\",\"km/h\"\n\n"
                .to_owned();
        for (i, [lat, lon, speed, _]) in kart().iter().enumerate() {
            let t = i as f64 / 10.0;
            let (minute, second) = ((t / 60.0).floor(), t % 60.0);
            let _ = writeln!(
                vbo,
                "008 10{minute:02}{second:05.2} {:+.6} {:+.6}",
                60.0 * lat,
                -60.0 * lon
            );
            // The app gives no lap before the first line, and none where none is set.
            let _ = writeln!(chrono, "{:.3},0,,{t:.3},{lat:.8},{lon:.8},{speed:.3}", 1.8e9 + t);
            let _ = writeln!(aim, "{t:.1},{lat:.8},{lon:.8},{:.3}", 3.6 * speed);
        }
        [("a.vbo", vbo), ("session.csv", chrono), ("aim.csv", aim)]
    }

    #[test]
    fn a_kart_with_gps_alone_has_laps_in_every_format() {
        for (name, text) in logs() {
            let recording = Recording::parse(text.as_bytes(), name).expect(name);
            let outing = Outing::of(&recording, &ChannelMap::default())
                .expect(name)
                .expect(name);
            let complete: Vec<&Lap> = outing.laps.iter().filter(|lap| lap.complete).collect();
            assert_eq!(complete.len(), 4, "{name}: {:?}", outing.laps);
            assert!(!outing.laps[0].complete && outing.laps[0].number == 0, "{name}");
            for lap in complete {
                let length_m = outing.distance_m[lap.end] - outing.distance_m[lap.start];
                assert!((length_m - 400.0).abs() < 8.0, "{name}: {length_m}");
            }
            let speed_is_logged = name != "a.vbo";
            assert_eq!(
                outing.notes.len(),
                2 - usize::from(speed_is_logged),
                "{name}: {:?}",
                outing.notes
            );
            // What is found so is a road too.
            let lap = recording.driven_lap(None).expect(name);
            assert_eq!(lap.number, Some(1), "{name}");
        }
    }

    #[test]
    fn a_log_of_neither_speed_nor_place_is_no_outing() {
        let recording = Recording::parse(b"time (s),a\n0,1\n1,2\n", "a.csv").expect("a log");
        assert_eq!(
            Outing::of(&recording, &ChannelMap::default()).expect("nothing is wrong"),
            None
        );
    }
}
