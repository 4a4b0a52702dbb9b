//! The path that is followed, in the frame of its samples, and the car's place relative to it. Twin of `shaders/path.wgsl`.

#![deny(clippy::disallowed_methods)]

use super::road::{Course, PATH_WIDTH};
use crate::scalar::Lookup;

/// One sample of the path with what lies up to the next one: curvature linear, heading its integral.
#[derive(Clone, Copy, Debug)]
pub struct Row<R> {
    /// Curvature at the sample (1/m), positive in left turns.
    pub curvature: R,
    /// Rise of the curvature per metre (1/m^2).
    pub slope: R,
    /// The next sample's place ahead of this one in its direction (m).
    pub next_x: R,
    /// The next sample's place to the left (m).
    pub next_y: R,
    /// Turn of the heading from this sample to the next (rad).
    pub turn: R,
    /// Distance to the left edge (m).
    pub left: R,
    /// Rise of that distance up to the next sample (m).
    pub left_rise: R,
    /// Distance to the right edge (m).
    pub right: R,
    /// Rise of that distance up to the next sample (m).
    pub right_rise: R,
    /// The cell of the plan that the sample lies in, a whole number.
    pub cell: R,
    /// Position of the sample within that cell, as a share of its length.
    pub cell_share: R,
    /// 1 where the driver opens the DRS, else 0.
    pub flap: R,
}

impl<R: Lookup> Row<R> {
    /// The row of this number, a whole one, from the table of all paths.
    #[inline(always)]
    pub fn at(path: &[R::Storage], row: R) -> Self {
        let (place, _) = row.place(path.len() / PATH_WIDTH, PATH_WIDTH);
        let at = |column: usize| R::pick(path, place, column);
        Self {
            curvature: at(0),
            slope: at(1),
            next_x: at(2),
            next_y: at(3),
            turn: at(4),
            left: at(5),
            left_rise: at(6),
            right: at(7),
            right_rise: at(8),
            cell: at(9),
            cell_share: at(10),
            flap: at(11),
        }
    }
}

/// Position of a car relative to a row of the path. The row's sample is the origin and its direction the first axis.
#[derive(Clone, Copy, Debug)]
pub struct Pose<R> {
    /// The row, a whole number.
    pub row: R,
    /// Laps since the start line was crossed first, a whole number: -1 before the first crossing.
    pub lap: R,
    /// Distance of the car's foot on the path from the sample (m).
    pub along: R,
    /// Place ahead (m).
    pub x: R,
    /// Place to the left (m).
    pub y: R,
    /// Direction of the car (rad).
    pub yaw: R,
}

/// The path at a distance behind a row's sample, in its frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame<R> {
    /// Place ahead (m).
    pub x: R,
    /// Place to the left (m).
    pub y: R,
    /// Direction (rad).
    pub heading: R,
    /// Curvature (1/m).
    pub curvature: R,
}

/// Nodes and weights of Gauss and Legendre for three points on 0 to 1. A row of a metre turns by a tenth of a radian at most,
/// over which they are exact to 1e-12 m.
const NODES: [(f64, f64); 3] = [
    (0.112_701_665_379_258_3, 0.277_777_777_777_777_8),
    (0.5, 0.444_444_444_444_444_4),
    (0.887_298_334_620_741_7, 0.277_777_777_777_777_8),
];

/// The path `along` metres behind the sample of `row`; a little beyond either end will do.
#[inline(always)]
pub fn frame_at<R: Lookup>(row: &Row<R>, along: R) -> Frame<R> {
    let half_slope = R::lit(0.5) * row.slope;
    let heading = |s: R| s * (row.curvature + half_slope * s);
    let mut x = R::lit(0.0);
    let mut y = R::lit(0.0);
    for (node, weight) in NODES {
        let angle = heading(R::lit(node) * along);
        x = x + R::lit(weight) * angle.cos();
        y = y + R::lit(weight) * angle.sin();
    }
    Frame {
        x: x * along,
        y: y * along,
        heading: heading(along),
        curvature: row.curvature + row.slope * along,
    }
}

/// How far the car at `pose` is ahead of the path's place `frame` and to the left of it (m).
#[inline(always)]
fn resolve<R: Lookup>(frame: &Frame<R>, pose: &Pose<R>) -> (R, R) {
    let (cos, sin) = (frame.heading.cos(), frame.heading.sin());
    let (x, y) = (pose.x - frame.x, pose.y - frame.y);
    (x * cos + y * sin, y * cos - x * sin)
}

/// Longest step of Newton's method (m), so that the foot stays on its part of the path.
const LONGEST_STEP_M: f64 = 10.0;

/// One step of Newton's method towards the foot of the perpendicular from the car.
#[inline(always)]
fn nearer<R: Lookup>(row: &Row<R>, pose: &Pose<R>) -> R {
    let frame = frame_at(row, pose.along);
    let (ahead, left) = resolve(&frame, pose);
    // Beyond the centre of curvature the distance has no minimum to converge to.
    let stretch = (R::lit(1.0) - frame.curvature * left).max(R::lit(0.2));
    pose.along
        + (ahead / stretch)
            .max(R::lit(-LONGEST_STEP_M))
            .min(R::lit(LONGEST_STEP_M))
}

/// What a driver sees of the path.
#[derive(Clone, Copy, Debug)]
pub struct View<R> {
    /// The row of the path that the car is in.
    pub row: Row<R>,
    /// Position of the car, with its foot on the path.
    pub pose: Pose<R>,
    /// The lanes in which the car has just moved on to this row.
    pub passed: R,
    /// Distance from the path, left positive (m).
    pub offset: R,
    /// How far the car points to the left of the path (rad).
    pub heading_error: R,
    /// Curvature of the path at the foot (1/m).
    pub bend: R,
    /// How far the car is beyond the nearer edge (m), negative within the road.
    pub beyond: R,
}

/// Finds the foot of a car that has moved by less than a row since it was found last, and brings the car into the row that
/// it lies in.
///
/// Twice corrected, the foot of a car that has moved by 0.1 m is off by no more than 1e-9 m three metres off a path whose
/// curvature changes by 0.014 1/m in a metre, as where an arc of 70 m radius begins at once.
#[inline(always)]
pub fn look<R: Lookup>(path: &[R::Storage], course: &Course<R>, pose: &Pose<R>) -> View<R> {
    let one = R::lit(1.0);
    let zero = R::lit(0.0);
    let row = Row::at(path, course.path_at + pose.row);
    let along = nearer(&row, pose);

    let stays = along.less_than(course.spacing);
    let (x, y) = (pose.x - row.next_x, pose.y - row.next_y);
    let (cos, sin) = (row.turn.cos(), row.turn.sin());
    let after = pose.row + one;
    let ends = !after.less_than(course.rows);
    let mut pose = Pose {
        row: R::select(stays, pose.row, R::select(ends, zero, after)),
        lap: R::select(!stays & ends, pose.lap + one, pose.lap),
        along: R::select(stays, along, along - course.spacing),
        x: R::select(stays, pose.x, x * cos + y * sin),
        y: R::select(stays, pose.y, y * cos - x * sin),
        yaw: R::select(stays, pose.yaw, pose.yaw - row.turn),
    };

    let row = Row::at(path, course.path_at + pose.row);
    pose.along = nearer(&row, &pose);
    let frame = frame_at(&row, pose.along);
    let (_, offset) = resolve(&frame, &pose);
    let share = pose.along * course.per_metre;
    let left = row.left + share * row.left_rise;
    let right = row.right + share * row.right_rise;
    View {
        row,
        pose,
        passed: R::select(stays, zero, one),
        offset,
        heading_error: pose.yaw - frame.heading,
        bend: frame.curvature,
        beyond: (offset - left).max(-(offset + right)),
    }
}

/// Curvature of the path (1/m) `ahead` metres ahead of the foot.
#[inline(always)]
pub fn curvature_ahead<R: Lookup>(path: &[R::Storage], course: &Course<R>, pose: &Pose<R>, ahead: R) -> R {
    let distance = pose.along + ahead;
    let rows = (distance * course.per_metre).whole(course.rows_ahead);
    let past = distance - rows * course.spacing;
    let number = course.path_at + pose.row + rows;
    let (place, _) = number.place(path.len() / PATH_WIDTH, PATH_WIDTH);
    R::pick(path, place, 0) + R::pick(path, place, 1) * past
}
