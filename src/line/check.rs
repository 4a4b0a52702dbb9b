//! Whether a line stays on the road, measured against the edges themselves and by nothing that made the line.

use super::fine::FineLine;
use glam::DVec2;

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

/// The least clearance of a car of this width (m) on `line` between the edges, polylines in the direction of travel,
/// closed if the line is. Distances are to the nearest point of each edge, at every fine point; the side is the
/// nearest point's own.
pub fn check_line(line: &FineLine, right_m: &[DVec2], left_m: &[DVec2], car_width_m: f64) -> Clearance {
    let mut worst = Clearance {
        margin_m: f64::INFINITY,
        station_m: 0.0,
        left: false,
    };
    for (edge, left) in [(right_m, false), (left_m, true)] {
        for (point, station) in line.points_m.iter().zip(&line.station_m) {
            let leftward = leftward_distance(*point, edge, line.closed);
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

/// Distance from a polyline (m), positive to its left.
pub(crate) fn leftward_distance(point: DVec2, polyline: &[DVec2], closed: bool) -> f64 {
    let n = polyline.len();
    let segments = if closed { n } else { n.saturating_sub(1) };
    let mut nearest = f64::INFINITY;
    let mut leftward = 0.0;
    for i in 0..segments {
        let (from, to) = (polyline[i], polyline[(i + 1) % n]);
        let along = to - from;
        let square = along.length_squared();
        if square == 0.0 {
            continue;
        }
        let away = point - from;
        let share = (away.dot(along) / square).clamp(0.0, 1.0);
        let distance = (away - share * along).length_squared();
        // How squarely the point lies off the segment: where two segments share the nearest point, the one that
        // faces it tells the side.
        let facing = along.perp_dot(away) / square.sqrt();
        let same = (distance - nearest).abs() <= 1e-12 * nearest;
        if distance < nearest && !same || same && facing.abs() > f64::abs(leftward) {
            nearest = distance;
            leftward = facing;
        }
    }
    nearest.sqrt().copysign(leftward)
}
