//! Racelogic's `.vbo`: sections in brackets, names of columns in one row, and numbers between spaces.
//!
//! Positions are in minutes of arc, with west positive; times are the hours, minutes and seconds of the day in one number.

use std::borrow::Cow;
use std::collections::HashSet;
use std::path::Path;

use super::recording::{Format, Metadata, Reading, Recording};
use super::table::Table;
use super::text::{Row, shown};
use crate::{Error, Place, Result};

/// Names and units of the columns that every receiver writes. Others are in the unit that the file gives, if it gives any.
const KNOWN: [(&str, &str, &str); 7] = [
    ("sats", "satellites", ""),
    ("lat", "latitude", "min"),
    ("long", "longitude", "min"),
    ("velocity", "velocity kmh", "km/h"),
    ("heading", "heading", "deg"),
    ("height", "height", "m"),
    ("vert-vel", "vertical velocity kmh", "km/h"),
];
const DAY_S: f64 = 86_400.0;

/// Whether a file is one.
pub(super) fn is_vbo(text: &str, path: &Path) -> bool {
    let has_extension = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("vbo"));
    let first = text
        .lines()
        .map(str::trim)
        .find(|line| !line.is_empty())
        .unwrap_or_default();
    has_extension || first.starts_with("File created on ") || first.eq_ignore_ascii_case("[header]")
}

/// Reads a file from its text; `path` is its name in error messages.
pub(super) fn parse(text: &str, path: &Path, reading: &Reading<'_>) -> Result<Recording> {
    let mut section = String::new();
    let (mut columns, mut units) = (Vec::new(), Vec::new());
    let mut comments = Vec::new();
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let mut last = 1;
    for (number, line) in lines.by_ref() {
        last = number;
        if let Some(name) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            section = name.trim().to_lowercase();
            if section == "data" {
                break;
            }
        } else if !line.is_empty() {
            match section.as_str() {
                "column names" => columns.extend(line.split_whitespace()),
                "channel units" => units.push(line),
                "comments" => comments.push(line),
                _ => {}
            }
        }
    }
    let refuse =
        |found: &str, expected: &str| Err(Error::input(path, Place::line(last), found.to_owned(), expected));
    let Some(time) = columns.iter().position(|name| name.eq_ignore_ascii_case("time")) else {
        return refuse("no column called time", "a row under [column names] with one");
    };
    if section != "data" {
        return refuse("no [data]", "the rows of numbers under it");
    }
    let named: Vec<(String, String)> = named(&columns, &units);
    let longitude = columns.iter().position(|name| name.eq_ignore_ascii_case("long"));
    let mut table = Table::new(
        path,
        text,
        named.into_iter().unzip(),
        time,
        (Format::Vbox, reading),
    )?;
    let (mut before_s, mut day_s) = (f64::NEG_INFINITY, 0.0);
    for (line, text) in lines.filter(|(_, text)| !text.is_empty()) {
        let mut cells: Vec<Cow<'_, str>> = text.split_whitespace().map(Cow::Borrowed).collect();
        if let Some(cell) = cells.get_mut(time) {
            let Some(seconds) = seconds_of_day(cell) else {
                let place = Place::line(line).channel("time");
                return Err(Error::input(
                    path,
                    place,
                    shown(cell),
                    "a time of day as HHMMSS.ss",
                ));
            };
            // Past midnight.
            if seconds + day_s < before_s - DAY_S / 2.0 {
                day_s += DAY_S;
            }
            before_s = seconds + day_s;
            *cell = Cow::Owned(before_s.to_string());
        }
        if let Some(cell) = longitude.and_then(|at| cells.get_mut(at)) {
            *cell = Cow::Owned(match cell.strip_prefix('-') {
                Some(west) => west.to_owned(),
                None => format!("-{}", cell.trim_start_matches('+')),
            });
        }
        table.push(&Row { line, cells })?;
    }
    Ok(Recording {
        source: path.to_owned(),
        format: Format::Vbox,
        channels: table.finish(1.0)?,
        beacons_s: Vec::new(),
        metadata: Metadata {
            comment: (!comments.is_empty()).then(|| comments.join("; ")),
            ..Metadata::default()
        },
    })
}

/// Names and units of the columns. Units that the file gives are those of its last columns, which are not the receiver's own.
fn named(columns: &[&str], units: &[&str]) -> Vec<(String, String)> {
    let own = columns.len().saturating_sub(units.len());
    let mut seen = HashSet::new();
    let mut all = Vec::with_capacity(columns.len());
    for (i, column) in columns.iter().enumerate() {
        let known = KNOWN.iter().find(|(name, ..)| name.eq_ignore_ascii_case(column));
        let (base, mut unit) = known.map_or((*column, ""), |(_, name, unit)| (*name, *unit));
        if unit.is_empty() && i >= own {
            unit = units[i - own];
        }
        let (mut name, mut copy) = (base.to_owned(), 2);
        while !seen.insert(name.clone()) {
            name = format!("{base} ({copy})");
            copy += 1;
        }
        all.push((name, unit.to_owned()));
    }
    all
}

/// Seconds since midnight of `HHMMSS.ss`.
fn seconds_of_day(cell: &str) -> Option<f64> {
    let value: f64 = cell.parse().ok()?;
    let (hours, minutes, seconds) = ((value / 1e4).floor(), (value / 1e2).floor() % 1e2, value % 1e2);
    let is_time = (0.0..24.0).contains(&hours) && minutes < 60.0 && (0.0..60.0).contains(&seconds);
    // Files have hundredths or thousandths, which a number of six digits before the point blurs.
    is_time.then(|| ((3600.0 * hours + 60.0 * minutes + seconds) * 1e4).round() / 1e4)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str = "File created on 05/07/2026 at 10:49:10\r\n\r\n[header]\r\nsatellites\r\ntime\r\nlatitude\r\nlongitude\r\n\
        velocity kmh\r\nlat accel\r\n\r\n[channel units]\r\ng\r\n\r\n[comments]\r\nkart 7\r\n\r\n[column names]\r\nsats time lat long \
        velocity LatAcc\r\n\r\n[data]\r\n008 235959.90 +3119.09973 +00058.49277 036.00 +0.500\r\n008 000000.00 +3119.10000 -00001.20000 \
        072.00 -0.500\r\n";

    #[test]
    fn sections_units_and_signs() {
        for name in ["a.vbo", "a.txt"] {
            let recording = Recording::parse(SMALL.as_bytes(), name).unwrap();
            assert_eq!(recording.format, Format::Vbox);
            assert_eq!(recording.metadata.comment.as_deref(), Some("kart 7"));
            let channel = |name: &str| recording.channel(name).unwrap();
            // West is positive in the file.
            assert_eq!(channel("longitude").values, [-58.49277, 1.2]);
            assert_eq!(
                (channel("latitude").unit.as_str(), channel("latitude").values[0]),
                ("min", 3119.09973)
            );
            assert_eq!(
                (
                    channel("velocity kmh").unit.as_str(),
                    &channel("velocity kmh").values[..]
                ),
                ("km/h", &[36.0, 72.0][..])
            );
            assert_eq!(
                (channel("LatAcc").unit.as_str(), channel("LatAcc").values[1]),
                ("g", -0.5)
            );
            let velocity = channel("velocity kmh");
            assert_eq!([velocity.time_s(0), velocity.time_s(1)], [86_399.9, 86_400.0]);
            let lap = recording.driven_lap(None).unwrap();
            assert!((lap.latitude_deg[0] - 51.984_995_5).abs() < 1e-9 && lap.longitude_deg[0] < -0.97);
        }
    }

    #[test]
    fn each_fault_names_its_line() {
        for (from, to, part) in [
            ("sats time", "sats tide", "no column called time"),
            ("[data]", "[dates]", "no [data]"),
            (
                "235959.90",
                "236059.90",
                "line 21, channel time: found \"236059.90\", expected a time of day",
            ),
            ("072.00 -0.500", "072.00", "line 22: found 5 cells, expected 6"),
        ] {
            let text = SMALL.replacen(from, to, 1);
            let error = Recording::parse(text.as_bytes(), "a.vbo")
                .unwrap_err()
                .to_string();
            assert!(error.contains(part), "{from}: {error}");
        }
    }
}
