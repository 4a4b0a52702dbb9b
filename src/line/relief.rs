//! Height and banking along one line, as laps on it need them.

use super::fine::FineLine;
use crate::track::interpolated;
use crate::vehicle::powertrain::GRAVITY_MPS2;

/// A line in three dimensions, at the points of a [`FineLine`].
#[derive(Clone, Debug, PartialEq)]
pub struct LineRelief {
    /// Height (m).
    pub z_m: Vec<f64>,
    /// Banking (rad), positive with the left side up.
    pub bank_rad: Vec<f64>,
    /// Sine of the gradient of each segment, positive uphill; one fewer than points on an open line.
    pub gradient: Vec<f64>,
    /// Length of each segment along the slope (m).
    pub length_m: Vec<f64>,
    /// Curvature along the surface at each point (1/m), positive in left turns.
    pub bend_1pm: Vec<f64>,
    /// At each point curvature square to the surface (1/m), and gravity along the segment after it, to the left and square to the
    /// surface (m/s^2), as a [`Course`](super::kernel::Course) has them.
    pub(super) course: Vec<[f64; 4]>,
}

impl LineRelief {
    /// From height (m) and banking (rad) at the points that `line` was laid through; smooth in between.
    pub fn along(line: &FineLine, given: &[[f64; 2]]) -> Self {
        let at = |k: usize| {
            let figures: Vec<f64> = given.iter().map(|figures| figures[k]).collect();
            let starts = line.section.iter().zip(&line.station_m);
            let mut knots: Vec<f64> = starts
                .filter(|((_, share), _)| *share == 0.0)
                .map(|(_, station)| *station)
                .collect();
            if line.closed {
                knots.push(line.length_m);
            }
            interpolated(&knots, &figures, line.closed, &line.station_m)
        };
        Self::of(&line.segment_m, &line.curvature_1pm, at(0), at(1))
    }

    /// From the lengths of segments (m) and curvatures (1/m) of the plan view, heights (m) and banking (rad). The line is closed if it
    /// has as many segments as points.
    pub fn of(segment_m: &[f64], curvature_1pm: &[f64], z_m: Vec<f64>, bank_rad: Vec<f64>) -> Self {
        let n = z_m.len();
        let closed = segment_m.len() == n;
        let rises = segment_m
            .iter()
            .enumerate()
            .map(|(i, _)| z_m[(i + 1) % n] - z_m[i]);
        let (length_m, gradient): (Vec<f64>, Vec<f64>) = segment_m
            .iter()
            .zip(rises)
            .map(|(level, rise)| {
                let length = level.hypot(rise);
                (length, rise / length)
            })
            .unzip();
        let (mut bend_1pm, mut course) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for i in 0..n {
            // The ends of an open line have their neighbours' curvature.
            let here = if closed { i } else { i.clamp(1, (n - 2).max(1)) };
            let (before, after) = (
                (here + segment_m.len() - 1) % segment_m.len(),
                here.min(segment_m.len() - 1),
            );
            let slope = 0.5 * (gradient[before] + gradient[after]);
            let level_squared = 1.0 - slope * slope;
            let spacing = 0.5 * (length_m[before] + length_m[after]);
            let turn = level_squared * curvature_1pm[i];
            let bow = (gradient[after] - gradient[before]) / spacing / level_squared.sqrt();
            let (sin, cos) = bank_rad[i].sin_cos();
            let gravity = GRAVITY_MPS2 * level_squared.sqrt();
            bend_1pm.push(turn * cos + bow * sin);
            course.push([
                bow * cos - turn * sin,
                GRAVITY_MPS2 * gradient[i.min(gradient.len() - 1)],
                gravity * sin,
                gravity * cos,
            ]);
        }
        Self {
            z_m,
            bank_rad,
            gradient,
            length_m,
            bend_1pm,
            course,
        }
    }

    /// Curvature square to the surface at a point (1/m), and gravity along the segment after it, to the left and square to the surface
    /// (m/s^2).
    pub(crate) fn place(&self, point: usize) -> [f64; 4] {
        self.course[point]
    }

    /// The specific forces of the road at each point (m/s^2), at these speeds (m/s) and accelerations (m/s^2): along the car,
    /// to its left, and square to the surface.
    pub fn forces_mps2(&self, v_mps: &[f64], ax_mps2: &[f64]) -> Vec<[f64; 3]> {
        let places = self.course.iter().zip(&self.bend_1pm);
        let motions = v_mps.iter().zip(ax_mps2);
        let at = |((course, bend), (v, ax)): ((&[f64; 4], &f64), (&f64, &f64))| {
            let [dip, climb, lean, press] = course;
            [ax + climb, v * v * bend + lean, v * v * dip + press]
        };
        places.zip(motions).map(at).collect()
    }
}
