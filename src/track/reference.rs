//! A smooth reference line with smoothed widths, made from a survey.

use super::circuit::{Circuit, Corner, Section};
use super::cross_sections::CrossSections;
use super::cutting::cross_sections;
use super::from_curvature::Closure;
use super::relief::{Given, ReliefChange, SmoothRelief, SurfaceAcross, between_edges};
use super::road::{Road, RoadFrame, circuit};
use super::spline::{Deviation, Spline};
use super::survey::Survey;
use crate::{Error, Result};
use glam::DVec2;

/// Largest deviations of a smoothed road from its survey.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// Greatest distance of the reference line from the surveyed centre points (m). The edges stay where they are:
    /// their distances are measured from the smooth line. With 0 the line passes through every point.
    pub line_m: f64,
    /// Greatest change of an edge's distance from the reference line (m). With 0 the edge passes through every point.
    pub edges_m: f64,
    /// Greatest change of the height (m). With 0 the height passes through every point.
    pub height_m: f64,
    /// Greatest change of the banking (degrees), likewise.
    pub bank_deg: f64,
}

impl Default for Smoothing {
    fn default() -> Self {
        Self {
            line_m: 0.25,
            edges_m: 0.25,
            height_m: 0.5,
            bank_deg: 0.5,
        }
    }
}

/// Features of the line longer than this (m) are kept, whatever deviation is allowed.
const LONGEST_WAVE_M: f64 = 100.0;
/// The same for the widths (m).
const LONGEST_WIDTH_WAVE_M: f64 = 200.0;
/// Distance between the cross-sections with which a road is checked (m).
const TRIED_EVERY_M: f64 = 5.0;
/// Largest deviation that may be allowed (m).
const MOST_SMOOTHING_M: f64 = 10.0;

/// Widths by the parameter of the line.
#[derive(Clone, Debug, PartialEq)]
enum Widths {
    /// Straight from point to point.
    Linear(Vec<f64>),
    Smooth(Spline<f64>),
}

/// A smooth line along a road, with the distances to its edges; both as functions of the distance along it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceLine {
    /// Name for titles.
    pub name: String,
    /// Distance of the line from the surveyed centre points.
    pub line_deviation: Deviation,
    /// Distance of the left edge from the surveyed one, across the road.
    pub left_deviation: Deviation,
    /// Distance of the right edge from the surveyed one, across the road.
    pub right_deviation: Deviation,
    source: String,
    closed: bool,
    line: Spline<DVec2>,
    /// Length of the line up to each knot (m).
    station_m: Vec<f64>,
    left: Widths,
    right: Widths,
    sections: Vec<Section>,
    corners: Vec<Corner>,
    drs_zones_m: Vec<[f64; 2]>,
    relief: Option<SmoothRelief>,
}

/// Nodes (from -1 to 1) and weights of Gauss and Legendre's quadrature with five points.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_47),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Length of a spline from a knot to a parameter in the interval after it (m).
fn arc(line: &Spline<DVec2>, interval: usize, to: f64) -> f64 {
    let half = 0.5 * (to - line.knots[interval]);
    GAUSS
        .iter()
        .map(|&(node, weight)| {
            let t = line.knots[interval] + half * (1.0 + node);
            weight * half * line.on(interval, t).first.length()
        })
        .sum()
}

impl Survey {
    /// The survey as it stands: the interpolating cubic spline through the centre points, by the length of the chords
    /// between them, and widths straight from point to point.
    ///
    /// # Errors
    /// [`Error::Input`] as [`Survey::check`] gives it.
    pub fn as_surveyed(&self) -> Result<ReferenceLine> {
        self.check()?;
        let (knots, line) = self.fit(0.0);
        let widths = |given: &[f64]| {
            let mut all = given.to_vec();
            if self.closed {
                all.push(given[0]);
            }
            Widths::Linear(all)
        };
        let relief = self.relief(&knots, [0.0; 2])?;
        Ok(self.reference(
            &knots,
            (line, relief),
            [widths(&self.left_m), widths(&self.right_m)],
            [Deviation::default(); 2],
        ))
    }

    /// The smoothest reference line and widths within the deviations allowed.
    ///
    /// # Errors
    /// [`Error::Input`] as [`Survey::check`] gives it, or for a smoothing out of range.
    pub fn smoothed(&self, smoothing: &Smoothing) -> Result<ReferenceLine> {
        for (field, value) in [
            ("line_m", smoothing.line_m),
            ("edges_m", smoothing.edges_m),
            ("height_m", smoothing.height_m),
            ("bank_deg", smoothing.bank_deg),
        ] {
            if !(0.0..=MOST_SMOOTHING_M).contains(&value) {
                return Err(Error::input(
                    &self.source,
                    format!("smoothing, {field}"),
                    value.to_string(),
                    format!("0 to {MOST_SMOOTHING_M}"),
                ));
            }
        }
        self.check()?;
        let (knots, line) = self.fit(smoothing.line_m);
        let (_, through) = self.fit(0.0);
        let n = self.centre_m.len();
        let mut left = Vec::with_capacity(n);
        let mut right = Vec::with_capacity(n);
        for (i, &knot) in knots.iter().enumerate().take(n) {
            // The surveyed edges belong to the surveyed points. Where the line has moved towards an edge, the distance to that
            // edge is smaller by as much.
            let here = line.at(knot);
            let normal = here.first.normalize_or_zero().perp();
            let moved = (here.value - through.at(knot).value).dot(normal);
            left.push(self.left_m[i] - moved);
            right.push(self.right_m[i] + moved);
        }
        let smooth = |data: &[f64]| {
            let fit = Spline::within(&knots, data, self.closed, smoothing.edges_m, LONGEST_WIDTH_WAVE_M);
            let deviation = fit.deviation(data);
            (Widths::Smooth(fit), deviation)
        };
        let ((left, left_deviation), (right, right_deviation)) = (smooth(&left), smooth(&right));
        let relief = self.relief(&knots, [smoothing.height_m, smoothing.bank_deg.to_radians()])?;
        let deviations = [left_deviation, right_deviation];
        Ok(self.reference(&knots, (line, relief), [left, right], deviations))
    }

    /// Chord lengths up to the points, and the line within a deviation of them.
    fn fit(&self, greatest_m: f64) -> (Vec<f64>, Spline<DVec2>) {
        let n = self.centre_m.len();
        let mut knots = vec![0.0];
        for i in 1..n + usize::from(self.closed) {
            let chord = self.centre_m[i % n].distance(self.centre_m[i - 1]);
            knots.push(knots[i - 1] + chord);
        }
        let line = if greatest_m > 0.0 {
            Spline::within(&knots, &self.centre_m, self.closed, greatest_m, LONGEST_WAVE_M)
        } else {
            Spline::smoothing(&knots, &self.centre_m, self.closed, 0.0)
        };
        (knots, line)
    }

    /// Height and banking over the knots, within these deviations (m, rad).
    fn relief(&self, knots: &[f64], within: [f64; 2]) -> Result<Option<SmoothRelief>> {
        let given = Given {
            z_m: self.z_m.clone(),
            bank_rad: self.bank_deg.iter().map(|bank| bank.to_radians()).collect(),
            friction: self.friction.clone(),
            gap_m: self.height_gap_m,
        };
        let relief = given.smoothed(knots, self.closed, within);
        if let Some(relief) = &relief {
            relief.check(&self.source)?;
        }
        Ok(relief)
    }

    fn reference(
        &self,
        knots: &[f64],
        (line, relief): (Spline<DVec2>, Option<SmoothRelief>),
        [left, right]: [Widths; 2],
        [left_deviation, right_deviation]: [Deviation; 2],
    ) -> ReferenceLine {
        let mut station_m = vec![0.0];
        for i in 0..knots.len() - 1 {
            station_m.push(station_m[i] + arc(&line, i, knots[i + 1]));
        }
        ReferenceLine {
            name: self.name.clone(),
            line_deviation: line.deviation(&self.centre_m),
            left_deviation,
            right_deviation,
            source: self.source.clone(),
            closed: self.closed,
            line,
            station_m,
            left,
            right,
            sections: self.sections.clone(),
            corners: self.corners.clone(),
            drs_zones_m: self.drs_zones_m.clone(),
            relief,
        }
    }
}

impl ReferenceLine {
    /// Whether the end joins the start.
    pub fn closed(&self) -> bool {
        self.closed
    }

    /// Length of the line (m).
    pub fn length_m(&self) -> f64 {
        self.station_m[self.station_m.len() - 1]
    }

    /// Position at a station (m).
    pub fn position_at(&self, station_m: f64) -> DVec2 {
        self.frame(station_m).position_m
    }

    /// Curvature at a station (1/m), positive in left turns.
    pub fn curvature_at(&self, station_m: f64) -> f64 {
        self.frame(station_m).curvature_1pm
    }

    /// Distance to the left and right edges at a station (m).
    pub fn widths_at(&self, station_m: f64) -> (f64, f64) {
        let frame = self.frame(station_m);
        (frame.left_m, frame.right_m)
    }

    /// Cross-sections across the road along the normals of the line; normals that cross are turned until they do not.
    ///
    /// # Errors
    /// [`Error::Input`] naming the station where the road overlaps itself or is wider than a bend allows, or for a
    /// spacing out of range.
    pub fn cross_sections(&self, count: usize) -> Result<CrossSections> {
        cross_sections(self, count)
    }

    /// A circuit along the line, and the changes that close it. Cross-sections every few metres are made first, so that an
    /// impossible road is refused here and not within a study.
    ///
    /// # Errors
    /// [`Error::Input`] naming the station where the line or its widths cannot be a road's.
    pub fn circuit(&self) -> Result<(Circuit, Closure)> {
        let cross_sections = (self.length_m() / TRIED_EVERY_M).ceil().max(8.0) as usize;
        self.cross_sections(cross_sections)?;
        circuit(self)
    }

    /// The interval and parameter of a station (m).
    fn locate(&self, station_m: f64) -> (usize, f64) {
        let length = self.length_m();
        let station = if self.closed {
            station_m.rem_euclid(length)
        } else {
            station_m.clamp(0.0, length)
        };
        let after = self.station_m.partition_point(|&s| s <= station);
        let i = after.clamp(1, self.station_m.len() - 1) - 1;
        let (start, end) = (self.line.knots[i], self.line.knots[i + 1]);
        let wanted = station - self.station_m[i];
        let whole = self.station_m[i + 1] - self.station_m[i];
        let mut t = start + (end - start) * wanted / whole;
        // The length is nearly linear in the parameter: Newton's method settles in three steps.
        for _ in 0..6 {
            let speed = self.line.on(i, t).first.length();
            let step = (wanted - arc(&self.line, i, t)) / speed.max(1e-3);
            t = (t + step).clamp(start, end);
            if step.abs() < 1e-12 * length {
                break;
            }
        }
        (i, t)
    }
}

impl Widths {
    fn at(&self, knots: &[f64], interval: usize, t: f64) -> f64 {
        match self {
            Self::Linear(values) => {
                let share = (t - knots[interval]) / (knots[interval + 1] - knots[interval]);
                values[interval] + share * (values[interval + 1] - values[interval])
            }
            Self::Smooth(spline) => spline.on(interval, t).value,
        }
    }
}

impl Road for ReferenceLine {
    fn name(&self) -> &str {
        &self.name
    }

    fn source(&self) -> &str {
        &self.source
    }

    fn closed(&self) -> bool {
        self.closed
    }

    fn length_m(&self) -> f64 {
        self.length_m()
    }

    fn frame(&self, station_m: f64) -> RoadFrame {
        let (i, t) = self.locate(station_m);
        let jet = self.line.on(i, t);
        let speed = jet.first.length();
        let [left_m, right_m] = [&self.left, &self.right].map(|side| side.at(&self.line.knots, i, t));
        RoadFrame {
            position_m: jet.value,
            tangent: jet.first.normalize_or_zero(),
            curvature_1pm: jet.first.perp_dot(jet.second) / speed.powi(3).max(1e-300),
            left_m,
            right_m,
            surface: self
                .relief
                .as_ref()
                .map_or(SurfaceAcross::LEVEL_AND_DRY, |relief| {
                    between_edges(relief.on(i, t), [left_m, right_m])
                }),
        }
    }

    fn sections(&self) -> &[Section] {
        &self.sections
    }

    fn corners(&self) -> &[Corner] {
        &self.corners
    }

    fn drs_zones_m(&self) -> &[[f64; 2]] {
        &self.drs_zones_m
    }

    fn relief_change(&self) -> Option<ReliefChange> {
        self.relief.as_ref().map(|relief| relief.change)
    }
}
