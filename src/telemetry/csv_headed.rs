//! Tables with a header, as spreadsheets, ROS, RaceChrono and scripts write them: names with their units in one row, as in
//! `time (s)`, `vx[km/h]` and `# time(s),vx(m/s)`, or units in a row of their own.

use std::collections::HashSet;
use std::path::Path;

use super::recording::{Format, Metadata, Reading, Recording};
use super::ros;
use super::table::Table;
use super::text::{Rows, shown};
use super::units::{Quantity, Unit};
use crate::{Error, Place, Result};

/// Names of the column of times, in lower case and without anything but letters.
const TIMES: [&str; 7] = [
    "time",
    "timestamp",
    "t",
    "elapsedtime",
    "logtime",
    "sessiontime",
    "rosbagtimestamp",
];
/// Times since 1970 of at least these are in these units: as seconds they would be thousands of years off.
const SINCE_1970: [(f64, &str); 3] = [(1e17, "ns"), (1e14, "us"), (1e11, "ms")];
/// Rows that may come before the header.
const MOST_ROWS_BEFORE: usize = 64;

/// Reads a table from its text; `path` is its name in error messages.
pub(super) fn parse(text: &str, path: &Path, reading: &Reading<'_>) -> Result<Recording> {
    let mut rows = Rows::new(text, path, false);
    let mut first = None;
    let mut header = None;
    for row in rows.by_ref().take(MOST_ROWS_BEFORE) {
        let row = row?;
        let heads: Vec<(String, String)> = row.cells.iter().map(|cell| head(cell)).collect();
        if let Some(time) = heads.iter().position(is_time) {
            header = Some((row.line, heads, time));
            break;
        }
        first.get_or_insert((row.line, shown(row.cell(0))));
    }
    let Some((line, mut heads, time)) = header else {
        let (line, found) = first.unwrap_or((1, "no rows".to_owned()));
        return Err(Error::input(
            path,
            Place::line(line),
            found,
            "a header row with a column of times, as in time_s or time (s); a MoTeC CSV export (first cell \"Format\"); or a .ld file",
        ));
    };
    let mut body = Vec::new();
    // Units and sources stand in rows without a time.
    for row in rows.by_ref() {
        let row = row?;
        if row.cell(time).parse::<f64>().is_ok() {
            body.push(row);
            break;
        }
        for ((_, unit), cell) in heads.iter_mut().zip(&row.cells) {
            let cell = cell
                .trim_start_matches('#')
                .trim()
                .trim_matches(['(', ')', '[', ']']);
            if unit.is_empty() && Unit::parse(cell).is_some() {
                *unit = cell.to_owned();
            }
        }
    }
    // Without the empty cells that a trailing comma leaves.
    let named = heads.iter().rposition(|(name, _)| !name.is_empty());
    let filled = body
        .first()
        .and_then(|row| row.cells.iter().rposition(|cell| !cell.is_empty()));
    heads.truncate(named.max(filled).map_or(0, |last| last + 1));
    ros::add_units(&mut heads);
    let began = body.first().and_then(|row| row.cell(time).parse::<f64>().ok());
    if let (Some(began), true) = (began, heads[time].1.is_empty())
        && let Some((_, unit)) = SINCE_1970.iter().find(|(least, _)| began >= *least)
    {
        heads[time].1 = (*unit).to_owned();
    }
    let names = unique(heads.iter().map(|(name, _)| name.as_str()));
    let units: Vec<String> = heads.into_iter().map(|(_, unit)| unit).collect();
    let second = Unit::parse(&units[time]).filter(|unit| unit.quantity == Quantity::Time);
    if second.is_none() && !units[time].is_empty() {
        return Err(Error::input(
            path,
            Place::line(line).channel(&names[time]),
            shown(&units[time]),
            Quantity::Time.described().replacen("a time", "a unit of time", 1),
        ));
    }
    let mut table = Table::new(path, text, (names, units), time, (Format::Headed, reading))?;
    for row in body {
        table.push(&row)?;
    }
    for row in rows {
        let row = row?;
        if !row.cell(0).starts_with('#') {
            table.push(&row)?;
        }
    }
    Ok(Recording {
        source: path.to_owned(),
        format: Format::Headed,
        channels: table.finish(second.map_or(1.0, |unit| unit.factor))?,
        beacons_s: Vec::new(),
        metadata: Metadata::default(),
    })
}

/// The name and the unit of a head: `vx (m/s)`, `vx[m/s]`, `vx_mps` or `vx`.
fn head(cell: &str) -> (String, String) {
    let cell = cell.trim_start_matches('#').trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((name, unit)) = cell.strip_suffix(close).and_then(|cell| cell.rsplit_once(open))
            && !name.trim().is_empty()
        {
            return (name.trim().to_owned(), unit.trim().to_owned());
        }
    }
    let known = cell
        .rsplit_once('_')
        .filter(|(_, unit)| Unit::parse(unit).is_some());
    // The name stays whole: maps know it by that.
    (
        cell.to_owned(),
        known.map_or(String::new(), |(_, unit)| unit.to_owned()),
    )
}

fn is_time((name, unit): &(String, String)) -> bool {
    let name = name.strip_suffix(&format!("_{unit}")).unwrap_or(name);
    let letters: String = name
        .chars()
        .filter(|c| c.is_alphabetic())
        .flat_map(char::to_lowercase)
        .collect();
    TIMES.contains(&letters.as_str())
}

/// Names of columns; those without one, and those that come again, get a number.
fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut seen = HashSet::new();
    let numbered = names.enumerate().map(|(index, name)| {
        let name = if name.is_empty() {
            format!("column {}", index + 1)
        } else {
            name.to_owned()
        };
        let mut own = name.clone();
        let mut copy = 2;
        while !seen.insert(own.clone()) {
            own = format!("{name} ({copy})");
            copy += 1;
        }
        own
    });
    numbered.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Recording> {
        Recording::parse(text.as_bytes(), "log.csv")
    }

    #[test]
    fn heads_of_every_kind_are_read() {
        for text in [
            "time (s),vx (km/h),ay\n0,36,1\n0.5,72,2\n",
            "# made by a script\n# time(s),vx(km/h),ay\n0,36,1\n0.5,72,2\n",
            "Time [ms],vx[km/h],ay,\n0,36,1,\n500,72,2,\n",
            "Timestamp,vx,ay\ns,km/h,\n0,36,1\n# a pause\n0.5,72,2\n",
            "This file was made by an app\n\nvx,elapsed_time,ay\nkm/h,s,\n100: gps,,\n36,0,1\n72,0.5,2\n",
        ] {
            let recording = read(text).unwrap();
            assert_eq!(recording.format, Format::Headed);
            let [vx, ay] = &recording.channels[..] else {
                panic!("{text}: {recording:?}")
            };
            assert_eq!(
                (vx.name.as_str(), vx.unit.as_str(), &vx.values[..]),
                ("vx", "km/h", &[36.0, 72.0][..]),
                "{text}"
            );
            assert_eq!((ay.name.as_str(), ay.unit.as_str()), ("ay", ""), "{text}");
            assert_eq!([vx.time_s(0), vx.time_s(1)], [0.0, 0.5], "{text}");
        }
    }

    /// As `rostopic echo -p` and PlotJuggler write them: paths, times since 1970, and no units.
    #[test]
    fn messages_of_ros_are_in_si() {
        use crate::telemetry::{ChannelList, ChannelMap, Role};
        for (text, steer) in [
            (
                "%time,field.header.seq,field.twist.twist.linear.x,field.twist.twist.angular.z,field.linear_acceleration.y,\
                 field.steering_angle\n1600000000000000000,1,12,0.1,1.2,0.02\n1600000000500000000,2,13,0.2,2.6,0.03\n",
                "field.steering_angle",
            ),
            (
                "__time,/odom/twist/twist/linear/x,/imu/angular_velocity/z,/imu/linear_acceleration/y,/steering_angle\n\
                 1600000000.0,12,0.1,1.2,0.02\n1600000000.5,13,0.2,2.6,0.03\n",
                "/steering_angle",
            ),
        ] {
            let recording = read(text).unwrap();
            let vx = &recording.channels[recording.channels.len() - 4];
            assert_eq!(vx.time_s(1) - vx.time_s(0), 0.5, "{text}");
            let list = ChannelList::of(&recording, &ChannelMap::default());
            let played = |role| {
                let found = list.channels.iter().find(|c| c.role == Some(role));
                found.map(|c| (c.name.as_str(), c.unit.as_str()))
            };
            assert_eq!(played(Role::Steer), Some((steer, "rad")));
            assert_eq!(played(Role::Vx).unwrap().1, "m/s");
            assert_eq!(played(Role::YawRate).unwrap().1, "rad/s");
            assert_eq!(played(Role::Ay).unwrap().1, "m/s^2");
        }
        // Two that could be it are for the user to choose from, and a dot makes no message of ROS.
        let twice = read("__time,/a/twist/linear/x,/b/twist/linear/x\n0,1,2\n1,1,2\n").unwrap();
        let list = ChannelList::of(&twice, &ChannelMap::default());
        let vx = list.missing.iter().find(|m| m.role == Role::Vx).unwrap();
        assert_eq!(vx.candidates.len(), 2);
        assert_eq!(read("t,car.speed\n0,1\n1,2\n").unwrap().channels[0].unit, "");
    }

    #[test]
    fn names_are_told_apart_and_what_is_no_log_is_refused() {
        let recording = read("t,v_mps,v_mps,,\n0,1,2,3\n1,1,2,3\n").unwrap();
        let names: Vec<&str> = recording.channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["v_mps", "v_mps (2)", "column 4"]);
        for (text, expected) in [
            ("a,b\n1,2\n", "a column of times"),
            ("1,2\n3,4\n", "a column of times"),
            ("time (m),v\n0,1\n1,2\n", "a unit of time"),
            ("time (s),v\n0,1\n", "at least two"),
            ("time (s),v\n0,1\nx,1\n", "line 3"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
