//! The cost of a line, with its gradient.

use super::geometry::{LineMap, Shape};
use super::lap::{GripEnvelope, Lap, SegmentBend};
use crate::hold::{self, Point};
use glam::DVec2;
use std::sync::atomic::{AtomicBool, Ordering};

/// Weight of each measure of a line; zero leaves a measure out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weights {
    /// Lap time (s).
    pub time: f64,
    /// Length (m).
    pub length: f64,
    /// Sum of the squared lengths of the segments (m^2).
    pub squared_length: f64,
    /// Gamma, the root of the sum of squared second differences (1/m).
    pub gamma: f64,
    /// Integral of squared curvature over the line (1/m).
    pub curvature: f64,
}

/// The measures of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Lap time (s); zero without a car, or if its weight is zero in a weighted sum.
    pub time_s: f64,
    /// Length (m).
    pub length_m: f64,
    /// Sum of the squared lengths of the segments (m^2).
    pub squared_length_m2: f64,
    /// Root of the sum of squared second differences (1/m).
    pub gamma_1pm: f64,
    /// Integral of squared curvature (1/m): turned angle over true spacing, squared, times spacing.
    pub curvature_1pm: f64,
}

impl Weights {
    /// The weighted sum of `measures`.
    pub fn sum(&self, measures: &Measures) -> f64 {
        self.time * measures.time_s
            + self.length * measures.length_m
            + self.squared_length * measures.squared_length_m2
            + self.gamma * measures.gamma_1pm
            + self.curvature * measures.curvature_1pm
    }
}

/// The lines and the car of a reference optimum.
#[derive(Clone, Copy)]
pub struct ReferenceProblem<'a> {
    /// The map from a line's variables to its points.
    pub map: &'a LineMap,
    /// Envelope of the car; needed only for lap times.
    pub envelope: Option<&'a dyn GripEnvelope>,
    /// Speed at the start of an open line (m/s).
    pub start_mps: f64,
    /// Spacing (m) for the second differences of Gamma, one for each segment: that of the reference line.
    /// `None` takes the line's own, which changes with it.
    pub spacing_m: Option<&'a [f64]>,
    /// The curvature that a lap takes for each segment.
    pub bend: SegmentBend,
    /// A flag that, once raised, ends a sequence of programs after the present one.
    pub stop: Option<&'a AtomicBool>,
}

impl<'a> ReferenceProblem<'a> {
    /// The problem of lines without a car.
    pub fn of(map: &'a LineMap) -> Self {
        Self {
            map,
            envelope: None,
            start_mps: 0.0,
            spacing_m: None,
            bend: SegmentBend::default(),
            stop: None,
        }
    }

    /// Whether the present sequence is to end.
    pub(super) fn stopped(&self) -> bool {
        self.stop.is_some_and(|stop| {
            hold::pass(Point::Solver);
            stop.load(Ordering::Relaxed)
        })
    }

    /// Shape, lap (where time counts) and measures of line `x`; all measures infinite where it has two points in one place.
    pub(super) fn judged(&self, weights: &Weights, x: &[f64]) -> (Shape, Option<Lap>, Measures) {
        let shape = self.map.shape(x);
        if shape.stands_still() {
            let far = f64::INFINITY;
            let measures = Measures {
                time_s: far,
                length_m: far,
                squared_length_m2: far,
                gamma_1pm: far,
                curvature_1pm: far,
            };
            return (shape, None, measures);
        }
        let envelope = self.envelope.filter(|_| weights.time != 0.0);
        let lap =
            envelope.map(|envelope| Lap::of(&shape, envelope, self.start_mps, (self.bend, &self.map.drs)));
        let measures = self.measured(&shape, lap.as_ref());
        (shape, lap, measures)
    }

    /// The measures of line `x`.
    pub fn measures(&self, x: &[f64]) -> Measures {
        let time = Weights {
            time: 1.0,
            ..Weights::default()
        };
        self.judged(&time, x).2
    }

    /// Speeds (m/s) at the points of line `x`; none without a car.
    pub fn speeds_mps(&self, x: &[f64]) -> Vec<f64> {
        let shape = self.map.shape(x);
        let lap = self
            .envelope
            .map(|envelope| Lap::of(&shape, envelope, self.start_mps, (self.bend, &self.map.drs)));
        lap.map_or_else(Vec::new, |lap| lap.square.iter().map(|e| e.sqrt()).collect())
    }

    fn measured(&self, shape: &Shape, lap: Option<&Lap>) -> Measures {
        let spacing = self.spacing_m.unwrap_or(&shape.length_m);
        let differences = (0..shape.turn_rad.len()).filter_map(|i| second_difference(shape, spacing, i));
        Measures {
            time_s: lap.map_or(0.0, |lap| lap.time_s),
            length_m: shape.length_m.iter().sum(),
            squared_length_m2: shape.length_m.iter().map(|h| h * h).sum(),
            gamma_1pm: differences.map(DVec2::length_squared).sum::<f64>().sqrt(),
            curvature_1pm: shape
                .turn_rad
                .iter()
                .zip(&shape.curvature_1pm)
                .map(|(turn, k)| turn * k)
                .sum(),
        }
    }

    /// The weighted cost of line `x` and its gradient; an infinite cost where a line has two points in one place.
    pub fn cost(&self, weights: &Weights, x: &[f64]) -> (f64, Vec<f64>) {
        let (shape, lap, measures) = self.judged(weights, x);
        if !measures.length_m.is_finite() {
            return (f64::INFINITY, vec![0.0; x.len()]);
        }
        let mut by_length: Vec<f64> = shape
            .length_m
            .iter()
            .map(|h| weights.length + 2.0 * weights.squared_length * h)
            .collect();
        let mut by_curvature = vec![0.0; shape.turn_rad.len()];
        if weights.curvature != 0.0 {
            for (i, bar) in by_curvature.iter_mut().enumerate() {
                // kappa^2 s with the spacing s of its own: at fixed kappa, the derivative by spacing is kappa^2.
                *bar += 2.0 * weights.curvature * shape.turn_rad[i];
                let (before, after) = shape.neighbours(i);
                for segment in [before, after].into_iter().flatten() {
                    by_length[segment] += 0.5 * weights.curvature * shape.curvature_1pm[i].powi(2);
                }
            }
        }
        if let Some(lap) = &lap {
            let (l, c) = lap.gradient(&shape);
            for (bar, by) in by_length.iter_mut().zip(l).chain(by_curvature.iter_mut().zip(c)) {
                *bar += weights.time * by;
            }
        }
        let mut by_point = shape.pull_back(&by_length, &by_curvature);
        if weights.gamma != 0.0 && measures.gamma_1pm > 0.0 {
            self.add_gamma(&shape, weights.gamma / measures.gamma_1pm, &mut by_point);
        }
        (weights.sum(&measures), self.map.pull_back(&by_point))
    }

    /// Adds `scale` times the derivative of half the sum of squared second differences.
    fn add_gamma(&self, shape: &Shape, scale: f64, by_point: &mut [DVec2]) {
        let own = self.spacing_m.is_none();
        let spacing = self.spacing_m.unwrap_or(&shape.length_m);
        let n = by_point.len();
        let mut by_length = vec![0.0; shape.length_m.len()];
        for i in 0..n {
            let (Some(z), (Some(before), Some(after))) =
                (second_difference(shape, spacing, i), shape.neighbours(i))
            else {
                continue;
            };
            let (h0, h1) = (spacing[before], spacing[after]);
            let bar = z * (2.0 * scale / (h0 + h1));
            by_point[after] -= bar / h1;
            by_point[(after + 1) % n] += bar / h1;
            by_point[before] += bar / h0;
            by_point[(before + 1) % n] -= bar / h0;
            if own {
                let mean = -scale * z.length_squared() / (h0 + h1);
                by_length[after] += mean - bar.dot(shape.step_m[after]) / (h1 * h1);
                by_length[before] += mean + bar.dot(shape.step_m[before]) / (h0 * h0);
            }
        }
        if own {
            let further = shape.pull_back(&by_length, &vec![0.0; n]);
            for (bar, more) in by_point.iter_mut().zip(further) {
                *bar += more;
            }
        }
    }
}

/// The second difference at point `i` over `spacing` (m) of the segments, with two different neighbours:
/// `2/(h0 + h1) (step1/h1 - step0/h0)`.
fn second_difference(shape: &Shape, spacing: &[f64], i: usize) -> Option<DVec2> {
    let (Some(before), Some(after)) = shape.neighbours(i) else {
        return None;
    };
    let (h0, h1) = (spacing[before], spacing[after]);
    Some((shape.step_m[after] / h1 - shape.step_m[before] / h0) * (2.0 / (h0 + h1)))
}
