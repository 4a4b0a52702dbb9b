//! The surface of the road along one line, as laps on it need it.

use super::fine::FineLine;
use crate::track::{Surface, interpolated};
use crate::vehicle::powertrain::GRAVITY_MPS2;

/// A line on a road that is not level and dry, at the points of a [`FineLine`].
#[derive(Clone, Debug, PartialEq)]
pub struct LineRelief {
    /// Height (m), banking (rad, positive with the left side up), friction as a share of the car's own, and what that gains per metre
    /// to the left (1/m).
    pub surface: Vec<Surface>,
    /// Sine of the gradient of each segment, positive uphill; one fewer than points on an open line.
    pub gradient: Vec<f64>,
    /// Length of each segment along the slope (m).
    pub length_m: Vec<f64>,
    /// Curvature along the surface at each point (1/m), positive in left turns.
    pub bend_1pm: Vec<f64>,
    /// At each point curvature square to the surface (1/m), gravity along the segment after it, to the left and square to the surface
    /// (m/s^2), and friction, as a [`Course`](super::kernel::Course) has them.
    pub(super) course: Vec<[f64; 5]>,
}

impl LineRelief {
    /// From the surface at the points that `line` was laid through: height and banking smooth in between, friction linear.
    pub fn along(line: &FineLine, given: &[Surface]) -> Self {
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
        let smooth = at(0).into_iter().zip(at(1)).zip(&line.section);
        let surface = smooth.map(|((z, bank), (section, share))| {
            let (here, there) = (given[*section], given[(section + 1) % given.len()]);
            let [friction, per_m] = [2, 3].map(|k| here[k] + share * (there[k] - here[k]));
            [z, bank, friction, per_m]
        });
        Self::of(&line.segment_m, &line.curvature_1pm, surface.collect())
    }

    /// From the lengths of segments (m) and curvatures (1/m) of the plan view and the surface at the points. The line is closed if it
    /// has as many segments as points.
    pub fn of(segment_m: &[f64], curvature_1pm: &[f64], surface: Vec<Surface>) -> Self {
        let n = surface.len();
        let z_m: Vec<f64> = surface.iter().map(|surface| surface[0]).collect();
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
            let [_, bank_rad, friction, _] = surface[i];
            let (sin, cos) = bank_rad.sin_cos();
            let gravity = GRAVITY_MPS2 * level_squared.sqrt();
            bend_1pm.push(turn * cos + bow * sin);
            course.push([
                bow * cos - turn * sin,
                GRAVITY_MPS2 * gradient[i.min(gradient.len() - 1)],
                gravity * sin,
                gravity * cos,
                friction,
            ]);
        }
        Self {
            surface,
            gradient,
            length_m,
            bend_1pm,
            course,
        }
    }

    /// Curvature square to the surface at a point (1/m), gravity along the segment after it, to the left and square to the surface
    /// (m/s^2), and friction.
    pub(crate) fn place(&self, point: usize) -> [f64; 5] {
        self.course[point]
    }

    /// The specific forces of the road at each point (m/s^2), at these speeds (m/s) and accelerations (m/s^2): along the car,
    /// to its left, and square to the surface. The last figure is the friction.
    pub fn forces_mps2(&self, v_mps: &[f64], ax_mps2: &[f64]) -> Vec<[f64; 4]> {
        let places = self.course.iter().zip(&self.bend_1pm);
        let motions = v_mps.iter().zip(ax_mps2);
        let at = |((course, bend), (v, ax)): ((&[f64; 5], &f64), (&f64, &f64))| {
            let [dip, climb, lean, press, friction] = course;
            [ax + climb, v * v * bend + lean, v * v * dip + press, *friction]
        };
        places.zip(motions).map(at).collect()
    }
}
