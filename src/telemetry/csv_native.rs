//! This crate's own CSV: SI and ISO 8855, with the unit of each column at the end of its name.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write as _;
use std::path::Path;

use super::log::Log;
use super::recording::{Format, Metadata, Reading, Recording};
use super::table::Table;
use super::text::Rows;
use super::units::Unit;
use crate::files::write_whole;
use crate::{Error, Place, Result};

/// The column that every native file has.
pub(super) const TIME: &str = "time_s";

/// The columns of a native file, in the order they are written: time and distance, four wheel speeds, road-wheel
/// angle, forward speed, accelerations at the ground-level reference point (`ax = dVx/dt - Vy r`,
/// `ay = dVy/dt + Vx r`) and yaw rate. A file may have them in any order and hold others besides; `lap` (a whole
/// number), `lap_complete` (0 or 1) and `drs` (0 shut to 1 open) are understood.
pub const COLUMNS: [&str; 11] = [
    TIME,
    "distance_m",
    "wheel_speed_fl_radps",
    "wheel_speed_fr_radps",
    "wheel_speed_rl_radps",
    "wheel_speed_rr_radps",
    "steer_rad",
    "vx_mps",
    "ax_mps2",
    "ay_mps2",
    "yaw_rate_radps",
];

/// Reads a native file from its text; `path` is its name in error messages.
pub(super) fn parse(text: &str, path: &Path, reading: &Reading<'_>) -> Result<Recording> {
    let mut rows = Rows::new(text, path, true);
    let Some(header) = rows.next().transpose()? else {
        return Err(Error::input(path, Place::line(1), "no rows", "a header row"));
    };
    let names: Vec<String> = header.cells.iter().map(|c| c.to_string()).collect();
    let mut seen = HashSet::new();
    for (index, name) in names.iter().enumerate() {
        if name.is_empty() || !seen.insert(name) {
            return Err(Error::input(
                path,
                Place::line(header.line).named(format!("column {}", index + 1)),
                if name.is_empty() {
                    "an empty cell".to_owned()
                } else {
                    format!("a second {name}")
                },
                "a column name that occurs once",
            ));
        }
    }
    let Some(time_column) = names.iter().position(|n| n == TIME) else {
        return Err(Error::input(
            path,
            Place::line(header.line),
            format!("no {TIME} column"),
            format!("the columns {}", COLUMNS.join(",")),
        ));
    };
    let units = names.iter().map(|n| unit_in_name(n).to_owned()).collect();
    let mut table = Table::new(path, text, (names, units), time_column, (Format::Native, reading))?;
    for row in rows {
        table.push(&row?)?;
    }
    Ok(Recording {
        source: path.to_owned(),
        format: Format::Native,
        channels: table.finish(1.0)?,
        beacons_s: Vec::new(),
        metadata: Metadata::default(),
    })
}

fn unit_in_name(name: &str) -> &str {
    name.rsplit_once('_')
        .map(|(_, suffix)| suffix)
        .filter(|suffix| Unit::parse(suffix).is_some())
        .unwrap_or("")
}

/// How numbers are written. Some columns have a fixed number of decimals; the others have the fewest digits that read back as the
/// same number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NativeFormat {
    decimals: BTreeMap<String, usize>,
    comments: Vec<String>,
}

impl NativeFormat {
    /// Every column reads back bit for bit.
    pub fn exact() -> Self {
        Self::default()
    }

    /// Writes `column` (one of [`COLUMNS`]) rounded to `decimals` places.
    pub fn decimals(mut self, column: impl Into<String>, decimals: usize) -> Self {
        self.decimals.insert(column.into(), decimals);
        self
    }

    /// Adds a comment line above the header.
    pub fn comment(mut self, text: impl Into<String>) -> Self {
        self.comments.push(text.into());
        self
    }
}

/// Writes a log as a native CSV file. Laps are written as columns unless the log is one complete lap numbered 1, which a file
/// without such columns means.
///
/// # Errors
/// [`Error::Io`] when the file cannot be written; [`Error::Input`] when the log's arrays differ in length, a value is
/// not finite, the laps do not cover the log, or `format` names a column that does not exist.
pub fn write_native(log: &Log, path: impl AsRef<Path>, format: &NativeFormat) -> Result<()> {
    let path = path.as_ref();
    let text = render(log, path, format)?;
    write_whole(path, text.as_bytes())
}

fn render(log: &Log, path: &Path, format: &NativeFormat) -> Result<String> {
    if let Some(name) = format.decimals.keys().find(|n| !COLUMNS.contains(&n.as_str())) {
        return Err(Error::input(
            path,
            "decimals",
            format!("a column {name}"),
            COLUMNS.join(", "),
        ));
    }
    let columns = columns_of(log);
    let samples = log.samples();
    for (name, values) in COLUMNS.iter().zip(columns) {
        if values.len() != samples {
            return Err(Error::input(
                path,
                Place::default().column(name),
                format!("{} values", values.len()),
                format!("{samples}, as many as times"),
            ));
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(Error::input(
                path,
                Place::sample(at).column(name),
                values[at].to_string(),
                "a finite number",
            ));
        }
    }
    let mut covered = 0;
    for lap in &log.laps {
        if lap.start != covered || lap.end <= lap.start {
            break;
        }
        covered = lap.end;
    }
    if covered != samples {
        return Err(Error::input(
            path,
            "laps",
            format!("laps that cover samples 0 to {covered}"),
            format!("laps in order that cover all {samples} samples"),
        ));
    }
    let plain = matches!(&log.laps[..], [lap] if lap.number == 1 && lap.complete);
    let mut text = String::new();
    for line in format.comments.iter().flat_map(|c| c.lines()) {
        text.push_str("# ");
        text.push_str(line);
        text.push('\n');
    }
    text.push_str(&COLUMNS.join(","));
    let drs = log.drs.iter().any(|open| *open != 0.0);
    if drs {
        text.push_str(",drs");
    }
    text.push_str(if plain { "\n" } else { ",lap,lap_complete\n" });
    let decimals = COLUMNS.map(|name| format.decimals.get(name).copied());
    for lap in &log.laps {
        for sample in lap.start..lap.end {
            for (index, (values, decimals)) in columns.iter().zip(decimals).enumerate() {
                if index > 0 {
                    text.push(',');
                }
                push_number(&mut text, values[sample], decimals);
            }
            if drs {
                text.push(',');
                push_number(&mut text, log.drs[sample], None);
            }
            if !plain {
                let _ = write!(text, ",{},{}", lap.number, u8::from(lap.complete));
            }
            text.push('\n');
        }
    }
    Ok(text)
}

fn push_number(text: &mut String, value: f64, decimals: Option<usize>) {
    // Writing to a String cannot fail.
    let _ = match decimals {
        Some(decimals) => write!(text, "{value:.decimals$}"),
        None => write!(text, "{value}"),
    };
}

fn columns_of(log: &Log) -> [&[f64]; 11] {
    let [fl, fr, rl, rr] = &log.wheel_speed_radps;
    [
        &log.time_s,
        &log.distance_m,
        fl,
        fr,
        rl,
        rr,
        &log.steer_rad,
        &log.vx_mps,
        &log.ax_mps2,
        &log.ay_mps2,
        &log.yaw_rate_radps,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::telemetry::synthetic::{Car, native_text};
    use crate::telemetry::{ChannelMap, LogOptions};
    use proptest::prelude::*;

    fn log_of(text: &str) -> Result<Log> {
        let recording = Recording::parse(text.as_bytes(), "a.csv")?;
        Log::from_recording(&recording, &ChannelMap::default(), &LogOptions::default())
    }

    #[test]
    fn a_log_comes_back_bit_for_bit() {
        let mut log = Car::default().drive(3.0, 37.0);
        log.source = "a.csv".to_owned();
        let text = render(&log, Path::new("a.csv"), &NativeFormat::exact().comment("a\nb")).unwrap();
        assert!(text.starts_with("# a\n# b\ntime_s,distance_m,"), "{text:.60}");
        assert!(!text.contains("lap"));
        let mut back = log_of(&text).unwrap();
        back.calibration = log.calibration.clone();
        assert_eq!(back, log);
    }

    #[test]
    fn the_drs_comes_back_where_it_was_open() {
        let mut log = Car::default().drive(3.0, 20.0);
        log.drs[30..50].fill(1.0);
        log.drs[50] = 0.5;
        let text = render(&log, Path::new("a.csv"), &NativeFormat::exact()).unwrap();
        assert_eq!(log_of(&text).unwrap().drs, log.drs);
        let percent = text
            .replace(",drs\n", ",drs_%\n")
            .replace(",1\n", ",100\n")
            .replace(",0.5\n", ",50\n");
        assert_eq!(log_of(&percent).unwrap().drs, log.drs);
        // Some loggers count in other ways.
        let counted = text.replace(",1\n", ",3\n");
        let log = log_of(&counted).unwrap();
        assert!(log.drs.iter().all(|open| *open == 0.0));
        let said = log.calibration.notes.join(" ");
        assert!(
            said.contains("drs: left out") && said.contains("found 3"),
            "{said}"
        );
    }

    #[test]
    fn laps_come_back_with_their_state() {
        let mut log = Car::default().drive(3.0, 20.0);
        let lap = |number, start, end, complete| crate::telemetry::Lap {
            number,
            start,
            end,
            complete,
        };
        log.laps = vec![lap(0, 0, 7, false), lap(1, 7, 40, true), lap(2, 40, 60, false)];
        let text = render(&log, Path::new("a.csv"), &NativeFormat::exact()).unwrap();
        let back = log_of(&text).unwrap();
        assert_eq!(back.laps, log.laps);
        assert_eq!(back.distance_m, log.distance_m);
        log.laps.pop();
        let error = render(&log, Path::new("a.csv"), &NativeFormat::exact()).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("a.csv: laps: found laps that cover samples 0 to 40")
        );
    }

    #[test]
    fn decimals_are_per_column() {
        let log = Car::default().drive(1.0, 10.0);
        let format = NativeFormat::exact().decimals("vx_mps", 2);
        let text = render(&log, Path::new("a.csv"), &format).unwrap();
        let row: Vec<&str> = text.lines().nth(1).unwrap().split(',').collect();
        assert_eq!(row[7], "44.00");
        let wrong = NativeFormat::exact().decimals("speed", 2);
        assert!(render(&log, Path::new("a.csv"), &wrong).is_err());
        let mut broken = log.clone();
        broken.ax_mps2[3] = f64::NAN;
        let error = render(&broken, Path::new("a.csv"), &format).unwrap_err();
        assert!(error.to_string().contains("sample 3, column ax_mps2: found NaN"));
    }

    #[test]
    fn each_fault_names_line_and_channel() {
        let text = native_text(&Car::default().drive(0.3, 10.0));
        let line_3 = text.lines().nth(2).unwrap();
        let cell = |column: usize, value: &str| {
            let mut cells: Vec<&str> = line_3.split(',').collect();
            cells[column] = value;
            text.replace(line_3, &cells.join(","))
        };
        for (bad, part) in [
            (cell(10, "-"), "line 3, channel yaw_rate_radps: found \"-\""),
            (cell(0, "x"), "line 3, channel time_s: found \"x\""),
            (
                cell(0, "0"),
                "line 3, channel wheel_speed_fl_radps: found time 0 s after 0 s",
            ),
            (text.replace(line_3, "1,2"), "line 3: found 2 cells, expected 11"),
            (
                text.replace("vx_mps", "steer_rad"),
                "line 1, column 8: found a second steer_rad",
            ),
            (
                text.replace("ay_mps2", "ay_furlongs"),
                "channel ay_furlongs: found a unit that is not known, expected ay in m/s^2",
            ),
            (
                text.replace("yaw_rate_radps", "yaw_rate"),
                "channel yaw_rate: found the unit \"\"",
            ),
            ("time_s,vx_mps\n0,1\n".to_owned(), "data rows: found 1 of them"),
        ] {
            let error = log_of(&bad).unwrap_err().to_string();
            assert!(error.contains(part), "{error}");
        }
    }

    proptest! {
        #[test]
        fn any_numbers_survive(values in prop::collection::vec(-9.0..9.0_f64, 33)) {
            let mut log = Car::default().drive(0.3, 10.0);
            log.yaw_rate_radps.copy_from_slice(&values[..3]);
            log.ax_mps2.copy_from_slice(&values[3..6]);
            let text = render(&log, Path::new("a.csv"), &NativeFormat::exact()).unwrap();
            let back = log_of(&text).unwrap();
            prop_assert_eq!(back.yaw_rate_radps, log.yaw_rate_radps);
            prop_assert_eq!(back.ax_mps2, log.ax_mps2);
        }

        #[test]
        fn never_panics_on_mutated_files(patches in prop::collection::vec((0..600_usize, any::<u8>()), 1..6)) {
            let mut bytes = native_text(&Car::default().drive(0.4, 10.0)).into_bytes();
            for (at, value) in patches {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = value;
                }
            }
            for options in [LogOptions::default(), LogOptions {
                rate_hz: Some(25.0),
                rolling_radius_m: Some([0.3, 0.31]),
                radius_is_free: [false, true],
                steering: Some(crate::telemetry::Steering {
                    ratio: 14.0,
                    wheelbase_m: 2.6,
                }),
                calibration: crate::telemetry::CalibrationOptions::all(crate::telemetry::Switch::On),
            }] {
                if let Ok(recording) = Recording::parse(&bytes, "a.csv") {
                    let _ = Log::from_recording(&recording, &ChannelMap::default(), &options);
                }
            }
        }

        #[test]
        fn never_panics_on_arbitrary_bytes(bytes: Vec<u8>) {
            let mut all = b"time_s,vx_mps\n".to_vec();
            all.extend(bytes);
            let _ = Recording::parse(&all, "a.csv");
        }
    }
}
