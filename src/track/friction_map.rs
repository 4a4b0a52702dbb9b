//! Friction of a road as points of a map, as the friction maps beside TUM's racetrack database have it.

use super::friction::{FRICTION_PLACES, FRICTIONS};
use super::survey::Survey;
use crate::config::{read_text, with_commas};
use crate::error::{Error, Place, Result};
use glam::DVec2;
use nalgebra::{SMatrix, SVector};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// How a map's file and that of its values end, where it has the points alone.
const POINTS: &str = "_tpamap.csv";
const VALUES: &str = "_tpadata.json";
/// Distance (m) beyond which a point of the map says nothing of a place.
const REACH_M: f64 = 5.0;
/// Places from edge to edge at which a map is read.
const ACROSS: usize = 21;

/// Points of a plane with the friction at each.
pub(super) struct FrictionMap {
    file: PathBuf,
    points_m: Vec<DVec2>,
    friction: Vec<f64>,
    /// The points in each square of [`REACH_M`].
    squares: HashMap<[i64; 2], Vec<usize>>,
}

impl FrictionMap {
    /// Reads a map: a table of `x_m`, `y_m` and friction; or of the first two, whose file ends in `_tpamap.csv`, with the friction of
    /// each in the file beside it that ends in `_tpadata.json`: an object of a list for each number of a point, counted from 0.
    ///
    /// # Errors
    /// [`Error::Input`] naming the line of what is no map, and [`Error::Io`] for files that cannot be read.
    pub fn load(file: &Path) -> Result<Self> {
        let refused = |line: usize, found: &str, expected: &str| {
            Err(Error::input(file, Place::line(line), found, expected))
        };
        let (mut points_m, mut friction) = (Vec::new(), Vec::new());
        for (i, row) in with_commas(&read_text(file)?).lines().enumerate() {
            if row.trim().is_empty() || row.starts_with('#') || (i == 0 && row.starts_with('x')) {
                continue;
            }
            let cells = row
                .split(',')
                .map(|cell| cell.trim().parse().ok().filter(|x: &f64| x.is_finite()));
            let cells: Vec<f64> = cells.collect::<Option<_>>().unwrap_or_default();
            let (point, of) = match cells[..] {
                [x, y] => (DVec2::new(x, y), None),
                [x, y, of] => (DVec2::new(x, y), Some(of)),
                _ => return refused(i + 1, row, "numbers: x_m, y_m and, if wanted, friction"),
            };
            if let Some(of) = of.filter(|of| !is_friction(*of)) {
                return refused(i + 1, &of.to_string(), &allowed());
            }
            if !points_m.is_empty() && of.is_some() == friction.is_empty() {
                return refused(i + 1, row, "as many columns as in the rows before");
            }
            points_m.push(point);
            friction.extend(of);
        }
        if points_m.is_empty() {
            return refused(1, "no point", "x_m, y_m and friction of points on the road");
        }
        if friction.is_empty() {
            friction = values_beside(file, points_m.len())?;
        }
        let mut squares: HashMap<_, Vec<usize>> = HashMap::new();
        for (i, point) in points_m.iter().enumerate() {
            squares.entry(square(*point)).or_default().push(i);
        }
        Ok(Self {
            file: file.to_owned(),
            points_m,
            friction,
            squares,
        })
    }

    /// The friction at the point that is nearest to a place (m); nothing where none is near.
    fn at(&self, place: DVec2) -> Option<f64> {
        let [x, y] = square(place);
        let about = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| [x, y]));
        let points = about.filter_map(|square| self.squares.get(&square)).flatten();
        let near = points.map(|&i| (self.points_m[i].distance_squared(place), i));
        let (distance, i) = near.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (distance <= REACH_M * REACH_M).then(|| self.friction[i])
    }

    /// Friction from the right edge to the left beside each point of a survey, as
    /// [`FrictionAcross::of`](super::FrictionAcross::of): what is nearest, by least squares, to what the map has from edge to edge, held
    /// within the range of that. Where the map has no point within 5 m, the friction is `elsewhere`.
    ///
    /// # Errors
    /// [`Error::Input`] for a map that has no point on the road.
    pub fn beside(&self, survey: &Survey, elsewhere: f64) -> Result<Vec<[f64; FRICTION_PLACES]>> {
        let (n, centre_m) = (survey.centre_m.len(), &survey.centre_m);
        let fit = fitting();
        let mut met = false;
        let mut row = |i: usize| {
            let (before, after) = if survey.closed {
                (centre_m[(i + n - 1) % n], centre_m[(i + 1) % n])
            } else {
                (centre_m[i.max(1) - 1], centre_m[(i + 1).min(n - 1)])
            };
            let left = (after - before).normalize_or_zero().perp();
            let found = SVector::<f64, ACROSS>::from_fn(|k, _| {
                let at_m = k as f64 / (ACROSS - 1) as f64 * (survey.left_m[i] + survey.right_m[i]);
                let found = self.at(centre_m[i] + (at_m - survey.right_m[i]) * left);
                met |= found.is_some();
                found.unwrap_or(elsewhere)
            });
            let (least, most) = (found.min(), found.max());
            let of: [f64; FRICTION_PLACES] = (fit * found).into();
            of.map(|f| f.clamp(least, most))
        };
        let rows = (0..n).map(&mut row).collect();
        if !met {
            let found = format!("no point within {REACH_M} m of the road of {}", survey.source);
            return Err(Error::input(
                &self.file,
                Place::default(),
                found,
                "a map of this road",
            ));
        }
        Ok(rows)
    }
}

/// What makes of the friction at [`ACROSS`] places that at [`FRICTION_PLACES`], by least squares.
fn fitting() -> SMatrix<f64, FRICTION_PLACES, ACROSS> {
    let of_places = SMatrix::<f64, ACROSS, FRICTION_PLACES>::from_fn(|k, j| {
        let place = k as f64 / (ACROSS - 1) as f64 * (FRICTION_PLACES - 1) as f64;
        (1.0 - (place - j as f64).abs()).max(0.0)
    });
    let squares = of_places.transpose() * of_places;
    // Each place has more than its own share of the row.
    squares.try_inverse().unwrap_or_default() * of_places.transpose()
}

/// The square of [`REACH_M`] that a place is in.
fn square(place: DVec2) -> [i64; 2] {
    (place / REACH_M).floor().as_i64vec2().to_array()
}

/// The friction of so many points, from the file beside theirs.
fn values_beside(points: &Path, count: usize) -> Result<Vec<f64>> {
    let name = points.file_name().unwrap_or_default().to_string_lossy();
    let Some(stem) = name.strip_suffix(POINTS) else {
        let expected =
            format!("a column of friction, or a name that ends in {POINTS} and its {VALUES} beside it");
        return Err(Error::input(
            points,
            Place::default(),
            "points without friction",
            expected,
        ));
    };
    let file = points.with_file_name(format!("{stem}{VALUES}"));
    let refused = |found: String, expected: String| Error::input(&file, Place::default(), found, expected);
    let values: HashMap<usize, Vec<f64>> = serde_json::from_str(&read_text(&file)?).map_err(|e| {
        let expected = "an object with a list of one friction for each number of a point";
        refused(e.to_string(), expected.to_owned())
    })?;
    let of = |i: usize| match values.get(&i).and_then(|list| list.first()) {
        Some(of) if is_friction(*of) => Ok(*of),
        Some(of) => Err(refused(format!("{of} at point {i}"), allowed())),
        None => Err(refused(
            format!("no friction of point {i}"),
            format!("one of each of {count} points"),
        )),
    };
    (0..count).map(of).collect()
}

fn is_friction(of: f64) -> bool {
    (FRICTIONS.0..=FRICTIONS.1).contains(&of)
}

fn allowed() -> String {
    format!("a friction of {} to {}", FRICTIONS.0, FRICTIONS.1)
}
