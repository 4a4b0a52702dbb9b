//! Surveys in columns of numbers.

use super::super::friction::{FRICTION_COLUMNS, FRICTION_NAMES, FRICTIONS, FrictionColumns};
use super::super::relief::{HEIGHTS_M, STEEPEST_BANK_DEG};
use super::check::FURTHEST_M;
use super::geographic::{self, Fix};
use super::{MOST_POINTS, Raw, WIDEST_M};
use crate::config::cells;
use crate::{Error, Place, Result};
use glam::DVec2;
use std::borrow::Cow;
use std::path::Path;

/// One edge of a road: its points, and the lines of the file they stand on.
#[derive(Default)]
pub(super) struct Edge {
    pub points: Vec<DVec2>,
    pub lines: Vec<usize>,
}

/// The content of a file.
pub(super) enum Content {
    Line(Raw),
    Edges { left: Edge, right: Edge },
}

/// What a column holds.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Column {
    X,
    Y,
    Latitude,
    Longitude,
    LeftWidth,
    RightWidth,
    Width,
    LeftX,
    LeftY,
    RightX,
    RightY,
    Height,
    Bank,
    Friction,
    /// Of a place of [`FRICTION_NAMES`].
    FrictionAt(usize),
}

const NAMES: [(&str, Column); 26] = [
    ("x_m", Column::X),
    ("y_m", Column::Y),
    ("latitude_deg", Column::Latitude),
    ("latitude", Column::Latitude),
    ("lat", Column::Latitude),
    ("longitude_deg", Column::Longitude),
    ("longitude", Column::Longitude),
    ("lon", Column::Longitude),
    ("lng", Column::Longitude),
    ("w_tr_left_m", Column::LeftWidth),
    ("width_left_m", Column::LeftWidth),
    ("w_tr_right_m", Column::RightWidth),
    ("width_right_m", Column::RightWidth),
    ("width_m", Column::Width),
    ("left_x_m", Column::LeftX),
    ("left_y_m", Column::LeftY),
    ("right_x_m", Column::RightX),
    ("right_y_m", Column::RightY),
    ("z_m", Column::Height),
    ("bank_deg", Column::Bank),
    ("friction", Column::Friction),
    (FRICTION_NAMES[0], Column::FrictionAt(0)),
    (FRICTION_NAMES[1], Column::FrictionAt(1)),
    (FRICTION_NAMES[2], Column::FrictionAt(2)),
    (FRICTION_NAMES[3], Column::FrictionAt(3)),
    (FRICTION_NAMES[4], Column::FrictionAt(4)),
];

/// The name of a column as the header spells it, shortened for messages.
fn shown(cell: &str) -> String {
    let mut short: String = cell.chars().take(40).flat_map(char::escape_debug).collect();
    if cell.chars().nth(40).is_some() {
        short.push_str("...");
    }
    format!("`{short}`")
}

struct Table<'a> {
    path: &'a Path,
    header: Vec<(usize, Column)>,
    width: usize,
}

impl Table<'_> {
    fn index(&self, column: Column) -> Option<usize> {
        self.header.iter().find(|(_, c)| *c == column).map(|(i, _)| *i)
    }

    fn both(&self, a: Column, b: Column) -> Option<[usize; 2]> {
        Some([self.index(a)?, self.index(b)?])
    }
}

/// The columns of a header line, or nothing if none is known.
fn header<'a>(line: &str, number: usize, path: &'a Path) -> Result<Option<Table<'a>>> {
    let text = line.trim_start_matches('#').trim();
    let mut header: Vec<(usize, Column)> = Vec::new();
    let mut width = 0;
    for (i, cell) in cells(text).iter().enumerate() {
        width = i + 1;
        let name = cell.to_lowercase();
        let Some(&(_, column)) = NAMES.iter().find(|(known, _)| *known == name) else {
            continue;
        };
        if header.iter().any(|(_, c)| *c == column) {
            return Err(Error::input(
                path,
                Place::line(number).named(format!("column {}", i + 1)),
                format!("a second column like {}", shown(cell)),
                "each column once",
            ));
        }
        header.push((i, column));
    }
    let table = Table { path, header, width };
    Ok((!table.header.is_empty()).then_some(table))
}

const EXPECTED: &str = "a header with x_m,y_m,w_tr_right_m,w_tr_left_m (or width_m), with \
                        left_x_m,left_y_m,right_x_m,right_y_m, or with latitude_deg,longitude_deg; or a GPX, KML or \
                        telemetry file";

/// Reads a table with a header, which may be a comment.
pub(super) fn read(text: &str, path: &Path) -> Result<Content> {
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let table = loop {
        let Some((number, line)) = lines.next() else {
            return Err(Error::input(path, Place::line(1), "no rows", EXPECTED));
        };
        if line.is_empty() {
            continue;
        }
        match header(line, number, path)? {
            Some(table) => break table,
            None if line.starts_with('#') => {}
            None => {
                return Err(Error::input(path, Place::line(number), shown(line), EXPECTED));
            }
        }
    };
    let rows = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let edges = table
        .both(Column::LeftX, Column::LeftY)
        .zip(table.both(Column::RightX, Column::RightY));
    if let Some((left, right)) = edges {
        let surface = [Column::Height, Column::Bank, Column::Friction];
        let across = (0..FRICTION_NAMES.len()).map(Column::FrictionAt);
        let mut surface = surface.into_iter().chain(across);
        if let Some(at) = surface.find_map(|column| table.index(column)) {
            return Err(Error::input(
                path,
                Place::from("header").named(format!("column {}", at + 1)),
                "height, banking or friction beside two edges",
                "a line with x_m,y_m, widths and z_m, bank_deg or friction",
            ));
        }
        return read_edges(&table, rows, left, right);
    }
    let plane = table.both(Column::X, Column::Y);
    let globe = table.both(Column::Latitude, Column::Longitude);
    let (place, is_plane) = match (plane, globe) {
        (Some(columns), _) => (columns, true),
        (None, Some(columns)) => (columns, false),
        _ => {
            return Err(Error::input(
                path,
                "header",
                "not all columns of a line",
                EXPECTED,
            ));
        }
    };
    read_line(&table, rows, place, is_plane).map(Content::Line)
}

/// The cells of a row, as many as the header has.
fn row<'a>(table: &Table<'_>, number: usize, line: &'a str) -> Result<Vec<Cow<'a, str>>> {
    let found = cells(line);
    let surplus = found.iter().skip(table.width).any(|cell| !cell.is_empty());
    if found.len() < table.width || surplus {
        return Err(Error::input(
            table.path,
            Place::line(number),
            format!("{} cells", found.len()),
            format!("{}, as the header has", table.width),
        ));
    }
    Ok(found)
}

fn number(
    table: &Table<'_>,
    line: usize,
    cells: &[Cow<'_, str>],
    at: usize,
    low: f64,
    high: f64,
) -> Result<f64> {
    match cells[at].parse::<f64>() {
        Ok(x) if x >= low && x <= high => Ok(x),
        _ => {
            let name = NAMES
                .iter()
                .find(|(_, c)| table.header.iter().any(|(i, d)| *i == at && d == c))
                .map_or("", |(name, _)| *name);
            Err(Error::input(
                table.path,
                Place::line(line).named(format!("column {} ({name})", at + 1)),
                shown(&cells[at]),
                format!("a number from {low} to {high}"),
            ))
        }
    }
}

/// Refuses more points than are allowed.
pub(super) fn bounded(path: &Path, place: impl Fn() -> Place, count: usize) -> Result<()> {
    if count < MOST_POINTS {
        return Ok(());
    }
    Err(Error::input(
        path,
        place(),
        format!("more than {MOST_POINTS} points"),
        format!("at most {MOST_POINTS}"),
    ))
}

fn read_line<'a>(
    table: &Table<'_>,
    rows: impl Iterator<Item = (usize, &'a str)>,
    place: [usize; 2],
    is_plane: bool,
) -> Result<Raw> {
    let sides = table.both(Column::LeftWidth, Column::RightWidth);
    let whole = table.index(Column::Width);
    let (height, bank) = (table.index(Column::Height), table.index(Column::Bank));
    let across = std::array::from_fn(|k| table.index(Column::FrictionAt(k)));
    let frictions = FrictionColumns::of(table.index(Column::Friction), across)
        .map_err(|found| Error::input(table.path, "header", found, FRICTION_COLUMNS))?;
    let mut raw = Raw::default();
    let mut fixes = Vec::new();
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for (line, text) in rows {
        let cells = row(table, line, text)?;
        let cell = |at: usize, low: f64, high: f64| number(table, line, &cells, at, low, high);
        bounded(table.path, || Place::line(line), raw.lines.len())?;
        if is_plane {
            let range = (-FURTHEST_M, FURTHEST_M);
            raw.points.push(DVec2::new(
                cell(place[0], range.0, range.1)?,
                cell(place[1], range.0, range.1)?,
            ));
        } else {
            fixes.push(Fix {
                latitude_deg: cell(place[0], -90.0, 90.0)?,
                longitude_deg: cell(place[1], -180.0, 180.0)?,
            });
        }
        raw.lines.push(line);
        if let Some(height) = height {
            raw.z_m.push(cell(height, HEIGHTS_M.0, HEIGHTS_M.1)?);
        }
        if let Some(bank) = bank {
            raw.bank_deg
                .push(cell(bank, -STEEPEST_BANK_DEG, STEEPEST_BANK_DEG)?);
        }
        if let Some(columns) = frictions {
            let at = |column: usize| cell(column, FRICTIONS.0, FRICTIONS.1);
            raw.friction.push(columns.read(at)?);
        }
        if let Some([l, r]) = sides {
            left.push(cell(l, 0.0, WIDEST_M)?);
            right.push(cell(r, 0.0, WIDEST_M)?);
        } else if let Some(whole) = whole {
            let half = 0.5 * cell(whole, 0.0, 2.0 * WIDEST_M)?;
            left.push(half);
            right.push(half);
        }
    }
    if !is_plane {
        raw.points = geographic::project(&fixes, table.path, &|i| super::place(&raw.lines, i))?;
    }
    raw.widths = (sides.is_some() || whole.is_some()).then_some((left, right));
    Ok(raw)
}

fn read_edges<'a>(
    table: &Table<'_>,
    rows: impl Iterator<Item = (usize, &'a str)>,
    left: [usize; 2],
    right: [usize; 2],
) -> Result<Content> {
    let (mut lefts, mut rights) = (Edge::default(), Edge::default());
    for (line, text) in rows {
        let cells = row(table, line, text)?;
        for (edge, columns) in [(&mut lefts, left), (&mut rights, right)] {
            // The cells of the shorter edge are empty in the last rows.
            if columns.iter().all(|&at| cells[at].is_empty()) {
                continue;
            }
            bounded(table.path, || Place::line(line), edge.points.len())?;
            let cell = |at: usize| number(table, line, &cells, at, -FURTHEST_M, FURTHEST_M);
            edge.points.push(DVec2::new(cell(columns[0])?, cell(columns[1])?));
            edge.lines.push(line);
        }
    }
    Ok(Content::Edges {
        left: lefts,
        right: rights,
    })
}
