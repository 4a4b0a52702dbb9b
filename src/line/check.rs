//! Whether a line stays on the road, measured against the edges themselves, independently of how the line was made.

use super::fine::FineLine;
use glam::DVec2;
use std::ops::Range;

/// Where a line comes closest to the edges, or goes furthest beyond them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Distance from the side of the car to the edge (m); negative beyond it.
    pub margin_m: f64,
    /// Distance along the line where that is (m).
    pub station_m: f64,
    /// Whether it is the left edge.
    pub left: bool,
}

/// The least clearance of a car of this width (m) on `line` between the edges, polylines in the direction of travel, closed if
/// the line is. Distances are to the nearest point of each edge, at every fine point; the side is that of the nearest point.
pub fn check_line(line: &FineLine, right_m: &[DVec2], left_m: &[DVec2], car_width_m: f64) -> Clearance {
    let mut worst = Clearance {
        margin_m: f64::INFINITY,
        station_m: 0.0,
        left: false,
    };
    for (edge, left) in [(right_m, false), (left_m, true)] {
        let edge = Polyline::new(edge, line.closed);
        for (point, station) in line.points_m.iter().zip(&line.station_m) {
            let leftward = edge.leftward_distance(*point);
            let inside = if left { -leftward } else { leftward };
            let margin_m = inside - 0.5 * car_width_m;
            if margin_m < worst.margin_m {
                worst = Clearance {
                    margin_m,
                    station_m: *station,
                    left,
                };
            }
        }
    }
    worst
}

/// A polyline that finds the stretches near a point quickly.
pub(crate) struct Polyline<'a> {
    points_m: &'a [DVec2],
    stretches: Vec<Stretch>,
}

/// Neighbouring segments, and a circle that holds them.
struct Stretch {
    segments: Range<usize>,
    centre_m: DVec2,
    radius_m: f64,
}

/// Segments of a stretch: about the root of a road's number of segments.
const STRETCH: usize = 48;

impl<'a> Polyline<'a> {
    pub(crate) fn new(points_m: &'a [DVec2], closed: bool) -> Self {
        let n = points_m.len();
        let segments = if closed { n } else { n.saturating_sub(1) };
        let stretches = (0..segments).step_by(STRETCH).map(|first| {
            let segments = first..(first + STRETCH).min(segments);
            let ends = || segments.clone().chain([segments.end]).map(|i| points_m[i % n]);
            let centre_m = ends().sum::<DVec2>() / (segments.len() + 1) as f64;
            let radius_m = ends().map(|p| p.distance(centre_m)).fold(0.0, f64::max);
            Stretch {
                segments,
                centre_m,
                radius_m,
            }
        });
        Self {
            points_m,
            stretches: stretches.collect(),
        }
    }

    /// Distance of a point from the polyline (m), positive to its left.
    pub(crate) fn leftward_distance(&self, point: DVec2) -> f64 {
        let n = self.points_m.len();
        let away_m = |stretch: &Stretch| point.distance(stretch.centre_m);
        // No stretch is further away than the far side of its circle. The small margin is for rounding.
        let reach_m = self
            .stretches
            .iter()
            .map(|s| away_m(s) + s.radius_m)
            .fold(f64::INFINITY, f64::min)
            * (1.0 + 1e-9);
        let mut nearest = f64::INFINITY;
        let mut leftward = 0.0;
        let near = self
            .stretches
            .iter()
            .filter(|s| away_m(s) - s.radius_m <= reach_m);
        for i in near.flat_map(|s| s.segments.clone()) {
            let (from, to) = (self.points_m[i], self.points_m[(i + 1) % n]);
            let along = to - from;
            let square = along.length_squared();
            if square == 0.0 {
                continue;
            }
            let away = point - from;
            let share = (away.dot(along) / square).clamp(0.0, 1.0);
            let distance = (away - share * along).length_squared();
            // How nearly the point lies at right angles to the segment. Where two segments share the nearest point, the one that
            // faces the point decides the side.
            let facing = along.perp_dot(away) / square.sqrt();
            let same = (distance - nearest).abs() <= 1e-12 * nearest;
            if distance < nearest && !same || same && facing.abs() > f64::abs(leftward) {
                nearest = distance;
                leftward = facing;
            }
        }
        nearest.sqrt().copysign(leftward)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn stretches_that_are_left_out_hold_nothing_nearer() {
        let random = Random::new(4);
        let draw = |i: u32, k: u32| random.normal(1, 0, i, k);
        // A jagged road, folded near itself.
        let points: Vec<DVec2> = (0..700u32)
            .map(|i| {
                let angle = f64::from(i) / 700.0 * std::f64::consts::TAU;
                let radius = 300.0 + 200.0 * (5.0 * angle).sin() + draw(i, 0);
                DVec2::new(radius * angle.cos(), 0.2 * radius * angle.sin() + draw(i, 1))
            })
            .collect();
        for closed in [false, true] {
            let edge = Polyline::new(&points, closed);
            for i in 0..500u32 {
                let point = DVec2::new(300.0 * draw(i, 2), 100.0 * draw(i, 3));
                let segments = points.len() - usize::from(!closed);
                let nearest = (0..segments)
                    .map(|k| {
                        let (from, along) = (points[k], points[(k + 1) % points.len()] - points[k]);
                        let share = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                        point.distance(from + share * along)
                    })
                    .fold(f64::INFINITY, f64::min);
                // Two ways to the same distance, a few roundings of coordinates of a kilometre apart.
                assert!((edge.leftward_distance(point).abs() - nearest).abs() < 1e-10);
            }
        }
    }
}
