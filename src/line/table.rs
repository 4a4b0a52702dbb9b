//! Lines in tables.

use crate::config::read_text;
use crate::error::{Error, Place, Result};
use glam::DVec2;
use std::path::Path;

/// The fewest rows of a table.
const LEAST_ROWS: usize = 8;

/// The points of a line (m) from the columns `x` and `y` of a table, as `x (m)`, `x_m` or `x[m]`. Lines that begin with `#` are
/// comments.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Input`] naming the line of the file where it is no table of points.
pub fn read_line(path: &Path) -> Result<Vec<DVec2>> {
    let expected = "columns `x (m)` and `y (m)` of finite numbers, 8 rows or more";
    let rows = read_columns(path, ["x", "y"], expected)?;
    Ok(rows.into_iter().map(DVec2::from).collect())
}

/// The columns of these names from a table of eight rows or more, row by row. Units in the header are not read. Of a file that is not
/// `expected` the error says so.
///
/// # Errors
/// As [`read_line`].
pub fn read_columns<const N: usize>(path: &Path, names: [&str; N], expected: &str) -> Result<Vec<[f64; N]>> {
    let text = read_text(path)?;
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let refuse = |place: Place, found: String| Error::input(path, place, found, expected);
    let unreadable = |e: csv::Error| {
        let line = e.position().map_or(1, csv::Position::line);
        refuse(Place::line(line as usize), e.to_string())
    };
    let joined = |record: &csv::StringRecord| record.iter().collect::<Vec<_>>().join(",");
    let header = reader.headers().map_err(unreadable)?.clone();
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        let named = |h: &str| {
            let unit = h.strip_prefix(name);
            unit.is_some_and(|unit| unit.is_empty() || unit.starts_with(['_', ' ', '[']))
        };
        let found = header.iter().position(named);
        *column = found.ok_or_else(|| refuse(Place::line(1), joined(&header)))?;
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(unreadable)?;
        let number = |k: usize| record.get(k)?.parse().ok().filter(|v: &f64| v.is_finite());
        let mut row = [0.0; N];
        for (value, column) in row.iter_mut().zip(columns) {
            *value = number(column).ok_or_else(|| {
                let line = record.position().map_or(0, csv::Position::line);
                refuse(Place::line(line as usize), joined(&record))
            })?;
        }
        rows.push(row);
    }
    if rows.len() < LEAST_ROWS {
        return Err(refuse("rows".into(), rows.len().to_string()));
    }
    Ok(rows)
}

/// As [`read_line`], points at least `spacing_m` apart.
///
/// # Errors
/// As there.
pub fn read_line_apart(path: &Path, spacing_m: f64) -> Result<Vec<DVec2>> {
    let mut points: Vec<DVec2> = Vec::new();
    for point in read_line(path)? {
        if points.last().is_none_or(|last| last.distance(point) >= spacing_m) {
            points.push(point);
        }
    }
    // The end of a closed line may repeat its start.
    while points.len() > 3 && points[0].distance(points[points.len() - 1]) < 0.5 * spacing_m {
        points.pop();
    }
    Ok(points)
}
