//! The shape of one line, in full.

use super::kernel::{Course, Wanted, shape};
use super::plan::LinePlan;
use glam::DVec2;

/// The shape of a line given by points.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// Length (m), the closing segment of a closed line included.
    pub length_m: f64,
    /// Sum of the squared lengths of the segments (m^2).
    pub length_squared_m2: f64,
    /// Root of the sum of the squared second differences (1/m). It grows with the number of points: never compare it
    /// across grids.
    pub gamma_1pm: f64,
    /// Integral of the curvature squared over the length (1/m).
    pub integral_kappa2_1pm: f64,
    /// Length of each segment (m), one fewer than points on an open line.
    pub segment_m: Vec<f64>,
    /// Second difference at each point (1/m), positive in left turns; the ends of an open line have their neighbours'.
    pub curvature_1pm: Vec<f64>,
}

/// The shape of the line through `points_m`, at least three if it is closed, else two.
pub fn geometry(points_m: &[DVec2], closed: bool) -> Geometry {
    let n = points_m.len();
    if n < 2 + usize::from(closed) {
        return Geometry {
            length_m: 0.0,
            length_squared_m2: 0.0,
            gamma_1pm: 0.0,
            integral_kappa2_1pm: 0.0,
            segment_m: Vec::new(),
            curvature_1pm: vec![0.0; n],
        };
    }
    let plan = LinePlan::of_points(points_m, closed);
    let wanted = Wanted {
        integral: true,
        lap: false,
    };
    let mut course = Course::default();
    let sums = shape::<f64>(&plan, wanted, &[], &mut course);
    let turn = |i: usize| {
        // The ends of an open line take their neighbours' sign, too.
        let i = if closed { i } else { i.clamp(1, (n - 2).max(1)) };
        let (before, here, after) = (points_m[(i + n - 1) % n], points_m[i], points_m[(i + 1) % n]);
        (here - before).perp_dot(after - here)
    };
    let mut curvature_1pm = course.curvature;
    for (i, curvature) in curvature_1pm.iter_mut().enumerate() {
        *curvature = curvature.copysign(turn(i));
    }
    course.length.truncate(plan.segments());
    Geometry {
        length_m: sums.length,
        length_squared_m2: sums.length_squared,
        gamma_1pm: sums.second_differences.sqrt(),
        integral_kappa2_1pm: sums.integral,
        segment_m: course.length,
        curvature_1pm,
    }
}
