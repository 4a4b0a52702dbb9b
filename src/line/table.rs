//! Lines in tables.

use crate::config::{cells, read_text, with_commas};
use crate::error::{Error, Place, Result};
use glam::DVec2;
use std::borrow::Cow;
use std::path::Path;

/// The fewest rows of a table.
const LEAST_ROWS: usize = 8;

/// The points of a line (m) from the columns `x` and `y` of a table, as `x (m)`, `x_m` or `x[m]`. A last point that repeats the first
/// is left out.
///
/// # Errors
/// [`Error::Io`] if it cannot be read, [`Error::Input`] naming the line of the file where it is no table of points.
pub fn read_line(path: &Path) -> Result<Vec<DVec2>> {
    let expected = "columns `x (m)` and `y (m)` of finite numbers, 8 rows or more";
    let rows = read_columns(path, ["x", "y"], expected)?;
    let mut points: Vec<DVec2> = rows.into_iter().map(DVec2::from).collect();
    if points.last() == points.first() {
        points.pop();
    }
    Ok(points)
}

/// The columns of these names from a table of eight rows or more, row by row. Cells are separated by commas, semicolons or tabs. Units in
/// the header are not read. Lines that begin with `#` are comments, but the header may be one, as in the racetrack database. Of a file that
/// is not `expected` the error says so.
///
/// # Errors
/// As [`read_line`].
pub fn read_columns<const N: usize>(path: &Path, names: [&str; N], expected: &str) -> Result<Vec<[f64; N]>> {
    let text = read_text(path)?;
    let refuse = |place: Place, found: String| Error::input(path, place, found, expected);
    let text = with_commas(text.trim_start_matches('\u{feff}'));
    let numbered = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let mut lines = numbered.filter(|(_, line)| !line.is_empty());
    let (width, columns) = loop {
        let Some((number, line)) = lines.next() else {
            return Err(refuse(Place::line(1), "no header".to_owned()));
        };
        if let Some(header) = header_of(line.trim_start_matches('#'), names) {
            break header;
        }
        if !line.starts_with('#') {
            return Err(refuse(Place::line(number), line.to_owned()));
        }
    };
    let mut rows = Vec::new();
    for (line, text) in lines.filter(|(_, line)| !line.starts_with('#')) {
        let cells = cells(text);
        let wrong = || refuse(Place::line(line), text.to_owned());
        if cells.len() != width {
            return Err(wrong());
        }
        let mut row = [0.0; N];
        for (value, column) in row.iter_mut().zip(columns) {
            let number = cells[column].parse().ok();
            *value = number.filter(|v: &f64| v.is_finite()).ok_or_else(wrong)?;
        }
        rows.push(row);
    }
    if rows.len() < LEAST_ROWS {
        return Err(refuse("rows".into(), rows.len().to_string()));
    }
    Ok(rows)
}

/// How many cells a header has, and the places of its columns, if it has all of these names.
fn header_of<const N: usize>(header: &str, names: [&str; N]) -> Option<(usize, [usize; N])> {
    let cells = cells(header);
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        let named = |cell: &Cow<'_, str>| {
            let unit = cell.strip_prefix(name);
            unit.is_some_and(|unit| unit.is_empty() || unit.starts_with(['_', ' ', '[']))
        };
        *column = cells.iter().position(named)?;
    }
    Some((cells.len(), columns))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of eight points whose last repeats the first, as the racetrack database writes lines, as its optimiser does, and as this
    /// program does.
    #[test]
    fn lines_of_other_programs_are_read() {
        let square = [
            (0, 0),
            (1, 0),
            (2, 0),
            (2, 1),
            (2, 2),
            (1, 2),
            (0, 2),
            (0, 1),
            (0, 0),
        ];
        let rows = |of: &dyn Fn(i32, i32) -> String| square.map(|(x, y)| of(x, y)).join("\n");
        let database = format!("# x_m,y_m\n{}\n", rows(&|x, y| format!("{x}.0,{y}.0")));
        let optimiser = format!(
            "# 6a3f9c\n# 0b1e, of another file\n# s_m; x_m; y_m; psi_rad\n{}\n",
            rows(&|x, y| format!("0.5; {x}.0; {y}.0; 0.1"))
        );
        let own = format!(
            "\u{feff}station (m),\"x (m)\",y (m)\n{}",
            rows(&|x, y| format!("1,{x},{y}"))
        );
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("line.csv");
        for text in [database, optimiser, own] {
            std::fs::write(&path, &text).expect("a file");
            let points = read_line(&path).expect(&text);
            assert_eq!(points.len(), 8, "{text}");
            assert_eq!(points[3], DVec2::new(2.0, 1.0), "{text}");
        }
    }

    #[test]
    fn a_table_of_something_else_is_refused_by_its_place() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("line.csv");
        for (text, place) in [
            ("a,b\n1,2\n", "line 1"),
            ("x_m,y_m\n1,2\n3,oops\n", "line 3"),
            ("x_m,y_m\n1,2\n", "rows"),
            ("# x_m,y_m\n0,0\n# a remark\n1,nan\n", "line 4"),
            ("# a remark\n\n0,0\n1,1\n", "line 3"),
            ("# x_m;y_m\n0;0\n1;1;1\n", "line 3"),
            ("# only a remark\n", "line 1"),
        ] {
            std::fs::write(&path, text).expect("a file");
            let error = read_line(&path).expect_err(text).to_string();
            assert!(error.contains(place), "{text}: {error}");
        }
    }
}
