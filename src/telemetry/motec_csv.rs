//! CSV exports of MoTeC i2: a block of `key,value` rows, a row of names, a row of units, then numbers.
//!
//! AiM Race Studio writes the same layout. No row has a fixed line: the row of names is the one that starts with `Time` and is
//! followed by a row that starts with a unit of time.

use std::collections::HashSet;
use std::path::Path;

use super::recording::{Format, Metadata, Reading, Recording};
use super::table::Table;
use super::text::{Row, Rows, shown};
use super::units::{Quantity, Unit};
use crate::{Error, Place, Result};

/// Reads an export from its text; `path` is its name in error messages.
pub(super) fn parse(text: &str, path: &Path, reading: &Reading<'_>) -> Result<Recording> {
    let mut rows = Rows::new(text, path, false);
    let mut metadata = Metadata::default();
    let mut beacons_s = Vec::new();
    let mut candidate: Option<Row<'_>> = None;
    let mut last_line = 1;
    let (names, units, time_unit) = loop {
        let Some(row) = rows.next().transpose()? else {
            return Err(Error::input(
                path,
                Place::line(last_line),
                "the end of the file",
                "a row of channel names that starts with \"Time\", and a row of their units under it",
            ));
        };
        last_line = row.line;
        let time_unit = Unit::parse(row.cell(0)).filter(|u| u.quantity == Quantity::Time);
        if let (Some(names), Some(unit)) = (&candidate, time_unit) {
            break (unique_names(names, path)?, row, unit);
        }
        describe(&row, path, &mut metadata, &mut beacons_s)?;
        let is_names = row.cell(0).eq_ignore_ascii_case("time");
        candidate = is_names.then_some(row);
    };
    let units = (0..names.len()).map(|i| units.cell(i).to_owned()).collect();
    let mut table = Table::new(path, text, (names, units), 0, (Format::MotecCsv, reading))?;
    for row in rows {
        table.push(&row?)?;
    }
    beacons_s.sort_by(f64::total_cmp);
    Ok(Recording {
        source: path.to_owned(),
        format: Format::MotecCsv,
        channels: table.finish(time_unit.factor)?,
        beacons_s,
        metadata,
    })
}

/// i2 writes a channel once for each worksheet that has it. The first one keeps its name; later ones get a number.
fn unique_names(row: &Row<'_>, path: &Path) -> Result<Vec<String>> {
    let end = row.cells.iter().rposition(|c| !c.is_empty()).unwrap_or(0);
    let mut seen = HashSet::new();
    let mut names = Vec::with_capacity(end + 1);
    for (index, cell) in row.cells.iter().take(end + 1).enumerate() {
        if cell.is_empty() {
            return Err(Error::input(
                path,
                Place::line(row.line).named(format!("column {}", index + 1)),
                "an empty cell",
                "a channel name",
            ));
        }
        let mut name = cell.to_string();
        let mut copy = 2;
        while !seen.insert(name.clone()) {
            name = format!("{cell} ({copy})");
            copy += 1;
        }
        names.push(name);
    }
    Ok(names)
}

fn describe(row: &Row<'_>, path: &Path, metadata: &mut Metadata, beacons_s: &mut Vec<f64>) -> Result<()> {
    if row.cell(0).eq_ignore_ascii_case("Beacon Markers") {
        for word in row.cells.iter().skip(1).flat_map(|c| c.split_whitespace()) {
            match word.parse::<f64>() {
                Ok(time) if time.is_finite() => beacons_s.push(time),
                _ => {
                    return Err(Error::input(
                        path,
                        Place::line(row.line).named("Beacon Markers"),
                        shown(word),
                        "times in seconds",
                    ));
                }
            }
        }
        return Ok(());
    }
    // A row holds one pair, or two with the second from its fifth cell on.
    for at in [0, 4] {
        let value = row.cell(at + 1);
        let field = match row.cell(at).to_ascii_lowercase().as_str() {
            "venue" => &mut metadata.venue,
            "vehicle" => &mut metadata.vehicle,
            "driver" | "racer" => &mut metadata.driver,
            "device" => &mut metadata.device,
            "session" => &mut metadata.session,
            "comment" => &mut metadata.comment,
            "log date" | "date" => &mut metadata.log_date,
            "log time" | "time" => &mut metadata.log_time,
            "range" => &mut metadata.range,
            _ => continue,
        };
        if !value.is_empty() && field.is_none() {
            *field = Some(value.to_owned());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SMALL: &str = "\"Format\",\"MoTeC CSV File\",,,\"Workbook\",\"\"\r\n\
        \"Venue\",\"Calder\",,,\"Worksheet\",\"\"\r\n\
        \"Comment\",\"warm, dry\",,,\"Session\",\"2\"\r\n\
        \"Beacon Markers\",\"2.5 1.5 \"\r\n\r\n\r\n\
        \"Time\",\"Speed\",\"Yaw\",\"Speed\"\r\n\"s\",\"km/h\",\"\u{b0}/s\",\"m/s\"\r\n\r\n\r\n\
        \"0.0\",\"36\",\"1\",\"10\"\r\n\"0.1\",\"72\",\"\",\"20\"\r\n";

    #[test]
    fn header_names_units_and_data() {
        let r = Recording::parse(SMALL.as_bytes(), "a.csv").unwrap();
        assert_eq!(r.metadata.venue.as_deref(), Some("Calder"));
        assert_eq!(r.metadata.comment.as_deref(), Some("warm, dry"));
        assert_eq!(r.metadata.session.as_deref(), Some("2"));
        assert_eq!(r.beacons_s, [1.5, 2.5]);
        let names: Vec<_> = r.channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["Speed", "Yaw", "Speed (2)"]);
        assert_eq!(r.channels[1].unit, "°/s");
        assert_eq!(r.channels[0].values, [36.0, 72.0]);
        assert_eq!(r.channels[1].unreadable.as_ref().unwrap().sample, 1);
        assert_eq!(r.channels[1].place(1).to_string(), "line 12, channel Yaw");
    }

    #[test]
    fn unquoted_latin_1_and_an_aim_wall_clock_row() {
        let mut bytes = b"Format,AiM CSV File\nTime,11:30\nBeacon Markers,1.5,2.5\n\nTime,Yaw\nsec,".to_vec();
        bytes.extend(b"\xB0/s\n\n0,1\n0.1,2\n");
        let r = Recording::parse(&bytes, "a.csv").unwrap();
        assert_eq!(r.metadata.log_time.as_deref(), Some("11:30"));
        assert_eq!(r.beacons_s, [1.5, 2.5]);
        assert_eq!(r.channels[0].unit, "°/s");
    }

    #[test]
    fn each_fault_names_its_line() {
        for (from, to, part) in [
            ("\"2.5 1.5 \"", "\"2.5 x\"", "line 4, Beacon Markers: found \"x\""),
            ("\"Time\"", "\"Tide\"", "line 12: found the end of the file"),
            ("\"0.1\",", "", "line 12: found 3 cells, expected 4"),
            ("\"0.1\"", "\"0,1\"", "line 12, channel Time: found \"0,1\""),
            ("\"Yaw\"", "\"\"", "line 7, column 3: found an empty cell"),
        ] {
            let text = SMALL.replacen(from, to, 1);
            let error = Recording::parse(text.as_bytes(), "a.csv")
                .unwrap_err()
                .to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    proptest! {
        #[test]
        fn never_panics_on_mutated_files(at in 0..SMALL.len(), byte: u8, cut in 0..SMALL.len()) {
            let mut bytes = SMALL.as_bytes().to_vec();
            bytes[at] = byte;
            let _ = Recording::parse(&bytes, "a.csv");
            bytes.truncate(cut);
            let _ = Recording::parse(&bytes, "a.csv");
        }

        #[test]
        fn never_panics_on_arbitrary_bytes(bytes: Vec<u8>) {
            let _ = Recording::parse(&bytes, "a.csv");
            let mut tail = b"Format\nTime,a\ns,m\n".to_vec();
            tail.extend(bytes);
            let _ = Recording::parse(&tail, "a.csv");
        }
    }
}
