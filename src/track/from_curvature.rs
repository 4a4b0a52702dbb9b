//! Builds a circuit from its curvature.
//!
//! Curvature that was measured on a map does not close exactly: the lap misses 360 degrees by a little, and its end misses its
//! start by metres. Shifting positions to hide that would leave a circuit whose curvature no longer describes its centreline.
//! Instead the curvature itself is changed, by the least amount (in the root mean square over the lap) that closes the lap;
//! heading and position are then its integrals and stay consistent, and so does the arc length.
//!
//! A small change `dk(s)` of curvature turns everything after `s`, so it moves the end by
//! `dk(s) ds * perp(P_end - P(s))` and turns it by `dk(s) ds`. The least change meeting three such
//! linear conditions is a combination of their three kernels: `dk(s) = c0 + c1 x(s) + c2 y(s)`, a
//! function affine in the position. Newton's method finds the three coefficients; its matrix is
//! singular only for a centreline that is a straight line.

use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::TAU;

use super::circuit::{Circuit, Corner, Section};
use super::clothoid::displacement;
use super::relief::{Given, Relief, between_edges};
use crate::{Error, Place, Result};

/// Distance between samples of a circuit (m), before rounding to a whole number of steps.
const SPACING_M: f64 = 1.0;
/// Greatest gap of a closed lap (m), where rounding allows it.
const CLOSED_TO_M: f64 = 1e-10;
/// A gap beyond this share of the length is a mistake in the table, not a measuring error.
const LARGEST_GAP: f64 = 0.03;
/// A total turn further than this from a whole number of turns is a mistake in the table (rad).
const LARGEST_TURN_ERROR: f64 = 0.5;

/// Fewest rows of a table with height, banking or friction.
const LEAST_RELIEF_ROWS: usize = 5;

/// One row of a [`CurvatureTable`].
#[derive(Debug, Clone, PartialEq)]
pub struct CurvatureRow {
    /// Distance along the centreline from the start (m).
    pub station_m: f64,
    /// Curvature (1/m), positive in left turns, linear to the next row.
    pub curvature_1pm: f64,
    /// Distance from the centreline to the left edge (m).
    pub width_left_m: f64,
    /// Distance from the centreline to the right edge (m).
    pub width_right_m: f64,
    /// The corner this row belongs to; empty on straights.
    pub corner: String,
}

/// Curvature against station, from which [`CurvatureTable::build`] makes a [`Circuit`].
#[derive(Debug, Clone, PartialEq)]
pub struct CurvatureTable {
    /// Name for titles and messages.
    pub name: String,
    /// Whether the end joins the start; if so, the last row runs linearly into the first.
    pub closed: bool,
    /// Length of the centreline (m).
    pub length_m: f64,
    /// Heading at station 0 (rad), anticlockwise from +x.
    pub start_heading_rad: f64,
    /// Rows in order of station, from 0 to less than the length (to the length on an open circuit).
    pub rows: Vec<CurvatureRow>,
    /// Named stretches.
    pub sections: Vec<Section>,
    /// Stretches where the DRS may be open, as a [`Circuit`] has them.
    pub drs_zones_m: Vec<[f64; 2]>,
    /// Height, banking and friction at the rows; none of a level and dry road.
    pub relief: Option<Relief>,
}

/// The changes that close a lap; all zero for an open circuit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Closure {
    /// Error of the table's total turn against a whole number of turns (rad).
    pub turn_error_rad: f64,
    /// Distance of the end from the start once the turn was corrected (m).
    pub gap_m: f64,
    /// Largest change of curvature (1/m).
    pub curvature_change_1pm: f64,
    /// Largest change of heading (rad).
    pub heading_change_rad: f64,
    /// Largest change of position (m), the start staying where it is.
    pub position_change_m: f64,
}

/// A centreline integrated from evenly spaced curvature; one more entry than curvature steps.
struct Integrated {
    heading: Vec<f64>,
    position: Vec<DVec2>,
}

impl Integrated {
    fn end(&self) -> (f64, DVec2) {
        let last = |h: Option<&f64>| h.copied().unwrap_or_default();
        (
            last(self.heading.last()) - last(self.heading.first()),
            self.position.last().copied().unwrap_or_default(),
        )
    }
}

fn integrate(curvature: &[f64], spacing: f64, closed: bool, start_heading: f64) -> Integrated {
    let n = curvature.len();
    let steps = if closed { n } else { n - 1 };
    let mut heading = Vec::with_capacity(steps + 1);
    let mut position = Vec::with_capacity(steps + 1);
    let (mut h, mut p) = (start_heading, DVec2::ZERO);
    heading.push(h);
    position.push(p);
    for i in 0..steps {
        let (k, next) = (curvature[i], curvature[(i + 1) % n]);
        p += displacement(h, k, (next - k) / spacing, spacing);
        h += 0.5 * (k + next) * spacing;
        heading.push(h);
        position.push(p);
    }
    Integrated { heading, position }
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let changes = a.iter().zip(b).map(|(x, y)| (x - y).abs());
    changes.fold(0.0, f64::max)
}

impl CurvatureTable {
    /// A table for a closed circle: a skid pad, or a test with a known answer.
    pub fn circle(radius_m: f64, width_m: f64, anticlockwise: bool) -> Self {
        let length_m = TAU * radius_m;
        let curvature = if anticlockwise { 1.0 } else { -1.0 } / radius_m;
        let rows = (0..4)
            .map(|i| CurvatureRow {
                station_m: length_m * f64::from(i) / 4.0,
                curvature_1pm: curvature,
                width_left_m: width_m / 2.0,
                width_right_m: width_m / 2.0,
                corner: String::new(),
            })
            .collect();
        Self {
            name: format!("circle of {radius_m} m radius"),
            closed: true,
            length_m,
            start_heading_rad: 0.0,
            rows,
            sections: Vec::new(),
            drs_zones_m: Vec::new(),
            relief: None,
        }
    }

    /// Builds the circuit, sampled about every metre, and returns the changes that close it.
    ///
    /// # Errors
    /// [`Error::Input`] naming the row when the table is out of order or out of range, or when it
    /// is too far from closing for measuring errors to be the reason.
    pub fn build(&self) -> Result<(Circuit, Closure)> {
        self.check()?;
        let steps = (self.length_m / SPACING_M).round().max(8.0) as usize;
        let spacing = self.length_m / steps as f64;
        let samples = steps + usize::from(!self.closed);
        let station_m: Vec<f64> = (0..samples).map(|i| i as f64 * spacing).collect();
        let sample = |value: &dyn Fn(&CurvatureRow) -> f64| self.sample(&station_m, value);
        let mut curvature = sample(&|r| r.curvature_1pm);

        let closure = if self.closed {
            self.close(&mut curvature, spacing)?
        } else {
            Closure::default()
        };
        let mut line = integrate(&curvature, spacing, self.closed, self.start_heading_rad);
        line.heading.truncate(samples);
        line.position.truncate(samples);
        let width_left_m = sample(&|r| r.width_left_m);
        let width_right_m = sample(&|r| r.width_right_m);
        let circuit = Circuit {
            relief: self.relief(&station_m, [&width_left_m, &width_right_m])?,
            name: self.name.clone(),
            closed: self.closed,
            length_m: self.length_m,
            width_left_m,
            width_right_m,
            station_m,
            centreline_m: line.position,
            heading_rad: line.heading,
            curvature_1pm: curvature,
            sections: self.sections.clone(),
            corners: self.corners(),
            drs_zones_m: self.drs_zones_m.clone(),
        };
        Ok((circuit, closure))
    }

    /// Height, banking and friction at the samples: smooth curves through those at the rows.
    fn relief(&self, station_m: &[f64], [left_m, right_m]: [&[f64]; 2]) -> Result<Option<Relief>> {
        let Some(relief) = &self.relief else {
            return Ok(None);
        };
        if self.rows.len() < LEAST_RELIEF_ROWS {
            let found = format!("{} rows", self.rows.len());
            let expected = format!("at least {LEAST_RELIEF_ROWS} rows with height, banking or friction");
            return self.refuse("curvature table", found, &expected);
        }
        let given = Given {
            z_m: relief.z_m.clone(),
            bank_rad: relief.bank_rad.clone(),
            friction: relief.friction.iter().map(|across| across.of).collect(),
            gap_m: relief.change.gap_m,
        };
        let Some(smooth) = given.smoothed(&self.knots(), self.closed, [0.0; 2]) else {
            return Ok(None);
        };
        smooth.check(&self.name)?;
        let stations = station_m.iter().zip(left_m.iter().zip(right_m));
        let surfaces =
            stations.map(|(station, (left, right))| between_edges(smooth.at(*station), [*left, *right]));
        Ok(Some(Relief::of(surfaces, relief.change)))
    }

    /// The stations of the rows (m), and of a closed road the end of the lap.
    pub(super) fn knots(&self) -> Vec<f64> {
        let rows = self.rows.iter().map(|row| row.station_m);
        rows.chain(self.closed.then_some(self.length_m)).collect()
    }

    fn refuse<T>(&self, place: impl Into<Place>, found: String, expected: &str) -> Result<T> {
        Err(Error::input(&self.name, place, found, expected))
    }

    fn check(&self) -> Result<()> {
        let length = self.length_m;
        if !(length.is_finite() && (10.0..=200_000.0).contains(&length)) {
            return self.refuse("length_m", length.to_string(), "10 to 200000 m");
        }
        if !self.start_heading_rad.is_finite() {
            let found = self.start_heading_rad.to_string();
            return self.refuse("start_heading_rad", found, "a finite angle");
        }
        if self.rows.len() < 3 {
            let found = format!("{} rows", self.rows.len());
            return self.refuse("curvature table", found, "at least 3 rows");
        }
        let mut last = f64::NEG_INFINITY;
        for (i, row) in self.rows.iter().enumerate() {
            let place = |field: &str| Place::row(i + 1).field(field);
            let s = row.station_m;
            let ends = if self.closed { s < length } else { s <= length };
            if !(s >= 0.0 && s > last && ends) {
                return self.refuse(
                    place("station_m"),
                    s.to_string(),
                    "stations that rise from 0 and stay within length_m",
                );
            }
            if i == 0 && s != 0.0 {
                return self.refuse(place("station_m"), s.to_string(), "0 in the first row");
            }
            last = s;
            if !(-1.0..=1.0).contains(&row.curvature_1pm) {
                let found = row.curvature_1pm.to_string();
                return self.refuse(place("curvature_1pm"), found, "-1 to 1 per metre");
            }
            for (field, width) in [
                ("width_left_m", row.width_left_m),
                ("width_right_m", row.width_right_m),
            ] {
                if !(0.0..=200.0).contains(&width) {
                    return self.refuse(place(field), width.to_string(), "0 to 200 m");
                }
            }
        }
        Ok(())
    }

    /// A column at even stations, linear between rows.
    fn sample(&self, station_m: &[f64], value: &dyn Fn(&CurvatureRow) -> f64) -> Vec<f64> {
        let mut next = 1;
        station_m
            .iter()
            .map(|&s| {
                while self.rows.get(next).is_some_and(|r| r.station_m <= s) {
                    next += 1;
                }
                let before = &self.rows[next - 1];
                let (end, after) = match self.rows.get(next) {
                    Some(row) => (row.station_m, value(row)),
                    None if self.closed => (self.length_m, value(&self.rows[0])),
                    None => return value(before),
                };
                let share = (s - before.station_m) / (end - before.station_m);
                value(before) + share * (after - value(before))
            })
            .collect()
    }

    /// Changes the curvature by the least amount that closes the lap (see the module's text).
    fn close(&self, curvature: &mut [f64], spacing: f64) -> Result<Closure> {
        let run = |k: &[f64]| integrate(k, spacing, true, self.start_heading_rad);
        let original = run(curvature);
        let (turn, _) = original.end();
        // A figure of eight turns by zero in all, a simple lap by one turn either way.
        let wanted = TAU * (turn / TAU).round().clamp(-1.0, 1.0);
        let turn_error_rad = turn - wanted;
        if turn_error_rad.abs() > LARGEST_TURN_ERROR {
            return self.refuse(
                "curvature table",
                format!("a total turn of {:.1} degrees", turn.to_degrees()),
                "within 30 degrees of -360, 0 or 360",
            );
        }
        let spread = turn_error_rad / self.length_m;
        let untwisted: Vec<f64> = curvature.iter().map(|k| k - spread).collect();
        let gap_m = run(&untwisted).end().1.length();
        if gap_m > LARGEST_GAP * self.length_m {
            return self.refuse(
                "curvature table",
                format!("an end {gap_m:.1} m away from the start"),
                "a lap that closes to within 3% of its length",
            );
        }

        let n = curvature.len() as f64;
        let lap = &original.position[..curvature.len()];
        let centre = lap.iter().sum::<DVec2>() / n;
        let size = (lap.iter().map(|p| p.distance_squared(centre)).sum::<f64>() / n).sqrt();
        let kernels: Vec<DVec3> = lap.iter().map(|&p| ((p - centre) / size).extend(1.0)).collect();
        // Each step rounds the heading by up to half of EPSILON of a turn. On a circle every step does so the same way, and the end
        // misses the start by n EPSILON / 2 times the length; positions round less.
        let closed_to = CLOSED_TO_M.max(f64::EPSILON * n * self.length_m);
        let table = curvature.to_vec();
        let mut line = run(curvature);
        let mut change = DVec3::ZERO;
        for _ in 0..30 {
            let (turn, end) = line.end();
            let miss = DVec3::new(end.x, end.y, turn - wanted);
            // The tolerance of the turn moves the far side of the circuit by as much as the gap.
            if end.length() < closed_to && miss.z.abs() * size < closed_to {
                let places = line.position.iter().zip(&original.position);
                return Ok(Closure {
                    turn_error_rad,
                    gap_m,
                    curvature_change_1pm: largest_difference(curvature, &table),
                    heading_change_rad: largest_difference(&line.heading, &original.heading),
                    position_change_m: places.map(|(a, b)| a.distance(*b)).fold(0.0, f64::max),
                });
            }
            let mut sensitivity = DMat3::ZERO;
            for (kernel, &p) in kernels.iter().zip(&line.position) {
                let moves = (end - p).perp().extend(1.0) * spacing;
                sensitivity += DMat3::from_cols(moves * kernel.x, moves * kernel.y, moves * kernel.z);
            }
            change -= sensitivity.inverse() * miss;
            for ((k, &k0), kernel) in curvature.iter_mut().zip(&table).zip(&kernels) {
                *k = k0 + change.dot(*kernel);
            }
            line = run(curvature);
        }
        self.refuse(
            "curvature table",
            format!("a lap with a gap of {gap_m:.1} m that no small change closes"),
            "a lap that nearly closes",
        )
    }

    /// Each run of rows with one corner's name, at its sharpest row.
    fn corners(&self) -> Vec<Corner> {
        self.rows
            .chunk_by(|a, b| a.corner == b.corner)
            .filter(|run| run.first().is_some_and(|r| !r.corner.is_empty()))
            .filter_map(|run| {
                run.iter()
                    .max_by(|a, b| a.curvature_1pm.abs().total_cmp(&b.curvature_1pm.abs()))
            })
            .map(|apex| Corner {
                name: apex.corner.clone(),
                station_m: apex.station_m,
            })
            .collect()
    }
}
