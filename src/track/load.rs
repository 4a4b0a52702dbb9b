//! Reads circuits from TOML files with a curvature table or a survey beside them, bundled or the user's own.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::checker::{Checker, DrsZoneEntry, SectionEntry, parse_toml};
use super::circuit::Circuit;
use super::friction::{
    FRICTION_COLUMNS, FRICTION_NAMES, FRICTION_PLACES, FRICTIONS, FrictionAcross, FrictionColumns,
};
use super::from_curvature::{Closure, CurvatureRow, CurvatureTable};
use super::reference::Smoothing;
use super::relief::{Given, HEIGHTS_M, Relief, ReliefChange, STEEPEST_BANK_DEG, between_edges};
use super::survey::{Survey, SurveyOptions};
use crate::config::{Rows, folder_of, read_text};
use crate::{Error, Place, Result};

/// A circuit embedded in the crate: name, TOML and curvature table.
struct Bundled {
    name: &'static str,
    toml: &'static str,
    table: &'static str,
}

const EMBEDDED: [Bundled; 1] = [Bundled {
    name: BUNDLED[0],
    toml: include_str!("../../data/circuits/silverstone_gp.toml"),
    table: include_str!("../../data/circuits/silverstone_gp.csv"),
}];

/// Names that [`Circuit::bundled`] knows.
pub const BUNDLED: [&str; 1] = ["silverstone_gp"];

/// The TOML file, with the place of every value that can be out of range.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CircuitFile {
    name: Spanned<String>,
    #[serde(default = "yes")]
    closed: bool,
    curvature_table: Spanned<String>,
    length_m: Spanned<f64>,
    #[serde(default)]
    start_heading_deg: Option<Spanned<f64>>,
    #[serde(default)]
    width_m: Option<Spanned<f64>>,
    #[serde(default)]
    flat: bool,
    smoothing_height_m: Option<Spanned<f64>>,
    smoothing_bank_deg: Option<Spanned<f64>>,
    friction: Option<Spanned<f64>>,
    #[serde(default)]
    sections: Vec<SectionEntry>,
    #[serde(default)]
    drs_zones: Vec<DrsZoneEntry>,
}

fn yes() -> bool {
    true
}

impl Circuit {
    /// The Silverstone Grand Prix circuit, 5887 m clockwise and 15 m wide.
    ///
    /// # Errors
    /// None in practice: the embedded files are checked by a test.
    pub fn silverstone_gp() -> Result<Self> {
        Self::bundled(BUNDLED[0])
    }

    /// A circuit that comes with the crate, by its name in [`BUNDLED`].
    ///
    /// # Errors
    /// [`Error::Input`] listing the names when there is none of this name.
    pub fn bundled(name: &str) -> Result<Self> {
        let wanted = name.trim().to_lowercase().replace(['-', ' '], "_");
        let Some(found) = EMBEDDED.iter().find(|b| b.name == wanted) else {
            return Err(Error::input(
                "bundled circuits",
                "name",
                format!("`{name}`"),
                format!("one of {}", BUNDLED.join(", ")),
            ));
        };
        let toml_file = format!("bundled {}.toml", found.name);
        let table_file = format!("bundled {}.csv", found.name);
        let file = parse_toml(&toml_file, found.toml, "a circuit")?;
        let table = assemble(&toml_file, found.toml, file, &table_file, found.table)?;
        Ok(build(&table, &table_file)?.0)
    }

    /// A circuit from a TOML file, or from a survey (any file that [`Survey::read`] takes).
    ///
    /// A TOML file names a survey or a curvature table that lies beside it. Keys with a survey: `survey` (the file),
    /// `name`, `closed`, `width_m`, `lap` and `bridges` as in [`SurveyOptions`], `smoothing_line_m` and
    /// `smoothing_edges_m` as in [`Smoothing`], `[[sections]]` and `[[drs_zones]]` as below and `[[corners]]` with `name` and
    /// `station_m`.
    ///
    /// Keys with a curvature table: `name`, `curvature_table` (a CSV file with columns `station_m`, `curvature_1pm` and, if
    /// wanted, `width_left_m`, `width_right_m`, `corner`, `z_m`, `bank_deg`, and `friction` or those of places across the road as in
    /// [`Survey`]), `length_m`; `closed` (default true),
    /// `start_heading_deg` (0), `width_m` (of the whole road, where the table has no widths), `[[sections]]` with `name`,
    /// `start_m`, `end_m`, and `[[drs_zones]]` with `start_m` and `end_m`, where the DRS may be open; one whose end lies before
    /// its start passes the start line.
    ///
    /// Both have `smoothing_height_m` and `smoothing_bank_deg` as in [`Smoothing`], `friction` of the whole road (a share of the car's own)
    /// where no column tells it, and `flat`, which leaves height, banking and friction out.
    ///
    /// # Errors
    /// [`Error::Io`] when a file cannot be read; [`Error::Input`] with the file, line and field when
    /// something in it is unknown, missing or out of range.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        Ok(Self::load_with_closure(path)?.0)
    }

    /// As [`Circuit::load`], with the changes that close the lap.
    ///
    /// # Errors
    /// As [`Circuit::load`].
    pub fn load_with_closure(path: impl AsRef<Path>) -> Result<(Self, Closure)> {
        match CircuitSource::read(path.as_ref())? {
            CircuitSource::Curvature(circuit, closure) => Ok((circuit, closure)),
            CircuitSource::Survey(survey, smoothing) => survey.smoothed(&smoothing)?.circuit(),
        }
    }
}

/// The content of a circuit file.
pub(super) enum CircuitSource {
    Curvature(Circuit, Closure),
    Survey(Survey, Smoothing),
}

impl CircuitSource {
    /// Reads a TOML file with what it names, or a survey.
    ///
    /// # Errors
    /// [`Error::Io`] if a file cannot be read; [`Error::Input`] naming line and field for what it must not hold.
    pub fn read(path: &Path) -> Result<Self> {
        if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            let survey = Survey::read(path, &SurveyOptions::default())?;
            return Ok(Self::Survey(survey, Smoothing::default()));
        }
        let read = read_text;
        let toml_file = path.display().to_string();
        let text = read(path)?;
        if super::load_survey::is_survey(&text) {
            let (survey, smoothing) = super::load_survey::read(path, &text)?;
            return Ok(Self::Survey(survey, smoothing));
        }
        let file: CircuitFile = parse_toml(
            &toml_file,
            &text,
            "a circuit with name, curvature_table and length_m",
        )?;
        let table_path = folder_of(path).join(file.curvature_table.get_ref());
        let table_file = table_path.display().to_string();
        let csv = read(&table_path)?;
        let table = assemble(&toml_file, &text, file, &table_file, &csv)?;
        let (circuit, closure) = build(&table, &table_file)?;
        Ok(Self::Curvature(circuit, closure))
    }
}

/// Builds, naming the table's file where the library names the circuit.
fn build(table: &CurvatureTable, table_file: &str) -> Result<(Circuit, Closure)> {
    table.build().map_err(|error| error.of_file(table_file))
}

fn assemble(
    toml_file: &str,
    text: &str,
    file: CircuitFile,
    table_file: &str,
    csv: &str,
) -> Result<CurvatureTable> {
    let check = Checker {
        file: toml_file,
        text,
    };
    let length_m = check.within(&file.length_m, "length_m", 10.0, 200_000.0)?;
    let heading = file
        .start_heading_deg
        .as_ref()
        .map_or(Ok(0.0), |h| check.within(h, "start_heading_deg", -360.0, 360.0))?;
    let width_m = file
        .width_m
        .as_ref()
        .map(|w| check.within(w, "width_m", 1.0, 200.0))
        .transpose()?;
    let sections = check.sections(&file.sections, length_m)?;
    let usual = Smoothing::default();
    let smoothing = |value: &Option<Spanned<f64>>, field: &str, usual: f64| {
        let given = value.as_ref().map(|v| check.within(v, field, 0.0, 10.0));
        given.unwrap_or(Ok(usual))
    };
    let within = [
        smoothing(&file.smoothing_height_m, "smoothing_height_m", usual.height_m)?,
        smoothing(&file.smoothing_bank_deg, "smoothing_bank_deg", usual.bank_deg)?.to_radians(),
    ];
    let (rows, mut given) = parse_table(table_file, csv, length_m, file.closed, width_m)?;
    let friction = file
        .friction
        .as_ref()
        .map(|f| check.within(f, "friction", FRICTIONS.0, FRICTIONS.1))
        .transpose()?;
    if let Some(friction) = friction.filter(|_| given.friction.is_empty()) {
        given.friction = vec![[friction; FRICTION_PLACES]; rows.len()];
    }
    let mut table = CurvatureTable {
        rows,
        name: check.name(&file.name, "name")?,
        closed: file.closed,
        length_m,
        start_heading_rad: heading.to_radians(),
        sections,
        drs_zones_m: check.drs_zones(&file.drs_zones, length_m, file.closed)?,
        relief: None,
    };
    if !file.flat {
        table.relief = smooth_relief(&table, given, table_file, within)?;
    }
    Ok(table)
}

/// Height, banking and friction of a table's rows, closed and smoothed within these deviations (m, rad); nothing of a level road.
fn smooth_relief(
    table: &CurvatureTable,
    mut given: Given,
    file: &str,
    within: [f64; 2],
) -> Result<Option<Relief>> {
    let knots = table.knots();
    // A spline takes no fewer rows. The table says so where it is built.
    if table.rows.len() < 5 || given.is_level() {
        let level = given.is_level();
        return Ok((!level).then_some(Relief {
            z_m: given.z_m,
            bank_rad: given.bank_rad,
            friction: vec![FrictionAcross::DRY; table.rows.len()],
            change: ReliefChange::default(),
        }));
    }
    if table.closed {
        given.close(file, table.rows.len(), &knots, table.length_m)?;
    }
    let smooth = given.smoothed(&knots, table.closed, within);
    Ok(smooth.map(|smooth| {
        let at = |row: &CurvatureRow| {
            between_edges(smooth.at(row.station_m), [row.width_left_m, row.width_right_m])
        };
        let rows = table.rows.iter().map(at);
        Relief::of(rows, smooth.change)
    }))
}

const COLUMNS: [&str; 13] = [
    "station_m",
    "curvature_1pm",
    "width_left_m",
    "width_right_m",
    "corner",
    "z_m",
    "bank_deg",
    "friction",
    FRICTION_NAMES[0],
    FRICTION_NAMES[1],
    FRICTION_NAMES[2],
    FRICTION_NAMES[3],
    FRICTION_NAMES[4],
];

fn parse_table(
    file: &str,
    text: &str,
    length_m: f64,
    closed: bool,
    width_m: Option<f64>,
) -> Result<(Vec<CurvatureRow>, Given)> {
    let Rows {
        header: (header_line, header),
        records,
    } = Rows::of(file, text)?;
    let mut column = [None; COLUMNS.len()];
    for (i, found) in header.iter().enumerate() {
        match COLUMNS.iter().position(|&c| c == found) {
            Some(c) if column[c].is_none() => column[c] = Some(i),
            _ => {
                return Err(Error::input(
                    file,
                    Place::line(header_line).named(format!("column {}", i + 1)),
                    format!("`{found}`"),
                    format!("each of {} once at most", COLUMNS.join(", ")),
                ));
            }
        }
    }
    let [
        station,
        curvature,
        left,
        right,
        corner,
        height,
        bank,
        friction,
        across @ ..,
    ] = column;
    let missing = |name: &str, found: &str| {
        let place = Place::line(header_line).column(name);
        Error::input(file, place, found, "this column")
    };
    let station = station.ok_or_else(|| missing(COLUMNS[0], "nothing"))?;
    let curvature = curvature.ok_or_else(|| missing(COLUMNS[1], "nothing"))?;
    for (name, side) in [(COLUMNS[2], left), (COLUMNS[3], right)] {
        if side.is_none() && width_m.is_none() {
            return Err(missing(name, "neither it nor width_m in the TOML file"));
        }
    }

    let frictions = FrictionColumns::of(friction, across)
        .map_err(|found| Error::input(file, Place::line(header_line), found, FRICTION_COLUMNS))?;

    let mut rows: Vec<CurvatureRow> = Vec::new();
    let mut given = Given::default();
    for (line, record) in records {
        let number = |column: usize, (low, high): (f64, f64)| -> Result<f64> {
            let found = record.get(column).unwrap_or_default();
            match found.parse::<f64>() {
                Ok(x) if x >= low && x <= high => Ok(x),
                _ => Err(Error::input(
                    file,
                    Place::line(line).field(&header[column]),
                    format!("`{found}`"),
                    format!("a number from {low} to {high}"),
                )),
            }
        };
        let width = |column: Option<usize>| match (column, width_m) {
            (Some(c), _) => number(c, (0.0, 200.0)),
            (None, whole) => Ok(whole.unwrap_or_default() / 2.0),
        };
        let row = CurvatureRow {
            station_m: number(station, (0.0, length_m))?,
            curvature_1pm: number(curvature, (-1.0, 1.0))?,
            width_left_m: width(left)?,
            width_right_m: width(right)?,
            corner: corner.and_then(|c| record.get(c)).unwrap_or_default().to_owned(),
        };
        let fits = match rows.last() {
            None => row.station_m == 0.0,
            Some(last) => row.station_m > last.station_m && !(closed && row.station_m >= length_m),
        };
        if !fits {
            return Err(Error::input(
                file,
                Place::line(line).field("station_m"),
                row.station_m.to_string(),
                if rows.is_empty() {
                    "0 in the first row".to_owned()
                } else {
                    format!("a station beyond the row before and short of {length_m}")
                },
            ));
        }
        rows.push(row);
        if let Some(height) = height {
            given.z_m.push(number(height, HEIGHTS_M)?);
        }
        if let Some(bank) = bank {
            let bank_deg = number(bank, (-STEEPEST_BANK_DEG, STEEPEST_BANK_DEG))?;
            given.bank_rad.push(bank_deg.to_radians());
        }
        if let Some(columns) = frictions {
            given
                .friction
                .push(columns.read(|column| number(column, FRICTIONS))?);
        }
    }
    Ok((rows, given))
}
