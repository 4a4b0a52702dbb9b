//! This crate's own CSV: SI and ISO 8855, with the unit of each column at the end of its name.

use std::collections::{BTreeMap, HashSet};
use std::fmt::Write as _;
use std::path::Path;

use super::log::Log;
use super::recording::{Format, Metadata, Recording};
use super::table::Table;
use super::text::Rows;
use super::units::Unit;
use crate::{Error, Result};

/// The column every native file has.
pub(super) const TIME: &str = "time_s";

/// The columns of a native file, in the order they are written: time and distance, four wheel speeds, road-wheel
/// angle, forward speed, accelerations at the ground-level reference point (`ax = dVx/dt - Vy r`,
/// `ay = dVy/dt + Vx r`) and yaw rate. A file may have them in any order and hold others besides; `lap` (a whole
/// number) and `lap_complete` (0 or 1) are understood.
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
pub(super) fn parse(text: &str, path: &Path) -> Result<Recording> {
    let mut rows = Rows::new(text, path, true);
    let Some(header) = rows.next().transpose()? else {
        return Err(Error::input(path, "line 1", "no rows", "a header row"));
    };
    let names: Vec<String> = header.cells.iter().map(|c| c.to_string()).collect();
    let mut seen = HashSet::new();
    for (index, name) in names.iter().enumerate() {
        if name.is_empty() || !seen.insert(name) {
            return Err(Error::input(
                path,
                format!("line {}, column {}", header.line, index + 1),
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
            format!("line {}", header.line),
            format!("no {TIME} column"),
            format!("the columns {}", COLUMNS.join(",")),
        ));
    };
    let units = names.iter().map(|n| unit_in_name(n).to_owned()).collect();
    let mut table = Table::new(path, names, units, time_column);
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

/// How numbers are written: with a fixed number of decimals in some columns, and in the others with the fewest digits
/// that read back as the same number.
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

/// Writes a log as a native CSV file. Laps are written as columns unless the log is one complete lap numbered 1,
/// which is what a file without them means.
///
/// # Errors
/// [`Error::Io`] when the file cannot be written; [`Error::Input`] when the log's arrays differ in length, a value is
/// not finite, the laps do not cover the log, or `format` names a column that does not exist.
pub fn write_native(log: &Log, path: impl AsRef<Path>, format: &NativeFormat) -> Result<()> {
    let path = path.as_ref();
    let text = render(log, path, format)?;
    std::fs::write(path, text).map_err(|e| Error::io(path, "write", e))
}

fn render(log: &Log, path: &Path, format: &NativeFormat) -> Result<String> {
    if let Some(name) = format
        .decimals
        .keys()
        .find(|n| !COLUMNS.contains(&n.as_str()))
    {
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
                format!("column {name}"),
                format!("{} values", values.len()),
                format!("{samples}, as many as times"),
            ));
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(Error::input(
                path,
                format!("column {name}, sample {at}"),
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
