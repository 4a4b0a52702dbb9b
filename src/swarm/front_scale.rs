//! The scale of a front that is not known yet, for optimisers that spread along directions.
//!
//! Deb, Jain, *An evolutionary many-objective optimization algorithm using reference-point-based nondominated sorting
//! approach, part I*, IEEE TEC 18 (2014). Ranges where no plane goes through the extremes as in Blank, Deb, Roy,
//! *Investigating the normalization procedure of NSGA-III*, EMO 2019.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

/// From where and how far the front reaches in each objective, as far as it is known.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct FrontScale {
    /// By how much those violate the constraints that it is made of.
    violation: f64,
    /// The least value of each objective.
    ideal: Vec<f64>,
    /// For each objective, the point that is worst in it and good in all others.
    extremes: Vec<Vec<f64>>,
}

impl Default for FrontScale {
    fn default() -> Self {
        Self {
            violation: f64::INFINITY,
            ideal: Vec::new(),
            extremes: Vec::new(),
        }
    }
}

/// Share of the front's range up to which a point counts as on an axis.
const ON_AXIS: f64 = 1e-3;

impl FrontScale {
    /// Learns from points that violate the constraints by so much.
    pub fn update(&mut self, violation: f64, points: &[&[f64]]) {
        if violation < self.violation {
            *self = Self {
                violation,
                ..Self::default()
            };
        }
        let width = points[0].len();
        self.ideal.resize(width, f64::INFINITY);
        for point in points {
            for (least, x) in self.ideal.iter_mut().zip(*point) {
                *least = least.min(*x);
            }
        }
        let known = self
            .extremes
            .iter()
            .map(Vec::as_slice)
            .chain(points.iter().copied());
        let known: Vec<&[f64]> = known.collect();
        let span = |k: usize| known.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) - self.ideal[k];
        let spans: Vec<f64> = (0..width).map(span).collect();
        // How far a point is off the axis of an objective counts for much more than how far along. Objectives count alike,
        // whatever their units. Very little counts as none, as in pymoo: else a point of the first
        // generations that is closest to the axis and far from the front would stay for good.
        let off = |point: &[f64], axis: usize| {
            let share = |k: usize| match (point[k] - self.ideal[k]) / spans[k] {
                share if share >= ON_AXIS => share,
                _ => 0.0,
            };
            let weight = |k: usize| if k == axis { 1.0 } else { 1e6 };
            (0..width).map(|k| weight(k) * share(k)).fold(0.0, f64::max)
        };
        self.extremes = (0..width)
            .filter_map(|k| known.iter().min_by(|a, b| off(a, k).total_cmp(&off(b, k))))
            .map(|point| point.to_vec())
            .collect();
    }

    /// How far the front reaches in each objective: to where the plane through the extremes meets its axis, but no further
    /// than `all` do; where there is no such plane, as far as the first front. An objective that does not vary counts as it
    /// is.
    pub fn ranges(&self, first: &[&[f64]], all: &[&[f64]]) -> Vec<f64> {
        let reach = |points: &[&[f64]], k: usize| {
            let most = points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
            most - self.ideal[k]
        };
        let width = self.ideal.len();
        let whole: Vec<f64> = (0..width).map(|k| reach(all, k)).collect();
        let rows = self.extremes.iter().map(|point| {
            let shares = point.iter().zip(&self.ideal).zip(&whole);
            shares.map(|((x, least), whole)| (x - least) / whole).collect()
        });
        let range = |(k, share): (usize, Option<f64>)| {
            let range = match share {
                Some(share) => share.min(1.0) * whole[k],
                None => reach(first, k),
            };
            [range, whole[k]]
                .into_iter()
                .find(|r| *r > 0.0 && r.is_finite())
                .unwrap_or(1.0)
        };
        match intercepts(&rows.collect::<Vec<Vec<f64>>>()) {
            Some(shares) => shares.into_iter().map(Some).enumerate().map(range).collect(),
            None => (0..width).map(|k| range((k, None))).collect(),
        }
    }

    /// A point on the scale.
    pub fn place(&self, point: &[f64], ranges: &[f64]) -> Vec<f64> {
        let figures = point.iter().zip(&self.ideal).zip(ranges);
        figures.map(|((x, least), range)| (x - least) / range).collect()
    }
}

/// Where the plane through as many points as there are coordinates meets the axes; `None` unless it meets all of them above
/// zero.
fn intercepts(rows: &[Vec<f64>]) -> Option<Vec<f64>> {
    let n = rows.len();
    let points = DMatrix::from_fn(n, n, |i, k| rows[i][k]);
    let normal = points.lu().solve(&DVector::from_element(n, 1.0))?;
    let meets: Vec<f64> = normal.iter().map(|x| 1.0 / x).collect();
    meets.iter().all(|x| *x > 0.0 && x.is_finite()).then_some(meets)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::lattice::lattice;

    #[test]
    fn planes_meet_the_axes() {
        let found = intercepts(&[vec![0.0, 2.0, 0.0], vec![4.0, 0.0, 0.0], vec![2.0, 0.0, 0.25]]).unwrap();
        for (found, expected) in found.iter().zip([4.0, 2.0, 0.5]) {
            assert!((found - expected).abs() < 1e-14, "{found}");
        }
        // Twice the same point, and a plane that meets an axis below zero.
        assert!(intercepts(&[vec![1.0, 1.0], vec![1.0, 1.0]]).is_none());
        assert!(intercepts(&[vec![1.0, 1.0], vec![2.0, 3.0]]).is_none());
    }

    /// Points on a plane of unlike ranges, far from zero: the scale takes them to the simplex.
    #[test]
    fn the_scale_is_that_of_the_front() {
        let (ideal, range) = ([1e9, -5.0, 0.0], [1e6, 1e-3, 7.0]);
        let points: Vec<Vec<f64>> = lattice(3, 4)
            .iter()
            .map(|row| (0..3).map(|k| ideal[k] + range[k] * row[k]).collect())
            .collect();
        let rows: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let mut scale = FrontScale::default();
        scale.update(0.0, &rows);
        let ranges = scale.ranges(&rows, &rows);
        for (k, found) in ranges.iter().enumerate() {
            assert!((found / range[k] - 1.0).abs() < 1e-9, "{found}");
        }
        for (point, row) in points.iter().zip(lattice(3, 4)) {
            let place = scale.place(point, &ranges);
            assert!(
                place.iter().zip(&row).all(|(a, b)| (a - b).abs() < 1e-9),
                "{place:?}"
            );
        }
        // A front of one point: nothing varies.
        let mut scale = FrontScale::default();
        scale.update(0.0, &rows[..1]);
        assert_eq!(scale.ranges(&rows[..1], &rows[..1]), [1.0; 3]);
        // What violates less makes it anew.
        let before = scale.clone();
        scale.update(0.0, &rows[..1]);
        assert_eq!(scale.ideal, before.ideal);
        let mut scale = FrontScale::default();
        scale.update(2.0, &[&[0.0; 3]]);
        scale.update(1.0, &[&[1.0; 3]]);
        assert_eq!(scale.ideal, [1.0; 3]);
    }
}
