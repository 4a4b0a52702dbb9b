//! Whether a car on a line stays on the road, measured against the edges themselves, independently of how the line was made.

use super::fine::FineLine;
use crate::track::CrossSections;
use glam::DVec2;
use std::ops::Range;

/// A car seen from above: a rectangle whose middle follows the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarPlan {
    /// Its width (m).
    pub width_m: f64,
    /// Its length (m), by which its corners swing out in bends; zero leaves them out.
    pub length_m: f64,
}

/// Where a car comes closest to the edges, or goes furthest beyond them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Distance from the car to the edge (m); negative beyond it.
    pub margin_m: f64,
    /// Distance along the line where that is (m).
    pub station_m: f64,
    /// Whether it is the left edge.
    pub left: bool,
}

/// How far a car may be beyond an edge and still count as on the road (m).
pub const ON_ROAD_M: f64 = 0.01;

impl Clearance {
    /// The least of the clearances at the points of a line, right and left at each.
    pub fn least(line: &FineLine, clearances_m: &[[f64; 2]]) -> Self {
        let mut worst = Self {
            margin_m: f64::INFINITY,
            station_m: 0.0,
            left: false,
        };
        for (margins, station) in clearances_m.iter().zip(&line.station_m) {
            for (margin_m, left) in margins.iter().zip([false, true]) {
                if *margin_m < worst.margin_m {
                    worst = Self {
                        margin_m: *margin_m,
                        station_m: *station,
                        left,
                    };
                }
            }
        }
        worst
    }

    /// Whether the car is on the road everywhere.
    pub fn is_on_road(&self) -> bool {
        self.margin_m >= -ON_ROAD_M
    }

    /// Which edge, and where, as in `the left edge at 310 m`.
    pub fn place(&self) -> String {
        let side = if self.left { "left" } else { "right" };
        format!("the {side} edge at {:.0} m", self.station_m)
    }
}

/// The least clearance of a car on `line` between the edges, as [`RoadEdges::clearances`] has it.
pub fn check_line(line: &FineLine, right_m: &[DVec2], left_m: &[DVec2], car: &CarPlan) -> Clearance {
    let edges = RoadEdges::new(right_m, left_m, line.closed);
    Clearance::least(line, &edges.clearances(line, car))
}

/// The edges of a road, as the ends of cross-sections one after the other.
///
/// A place on the road has a cross-section abreast of it, and its distances to the edges are those to the pieces near the ends of
/// that one. Another piece of road that comes near, above a bridge or beside a hairpin, does not matter.
#[derive(Clone, Debug)]
pub struct RoadEdges<'a> {
    right_m: &'a [DVec2],
    left_m: &'a [DVec2],
    closed: bool,
    /// Mean distance between neighbouring cross-sections (m).
    step_m: f64,
    /// The pieces of the right edge and of the left one.
    pieces: [Vec<Piece>; 2],
    /// Of the right edge, the left one, and the middles.
    boxes: [Boxes; 3],
}

/// A straight piece of an edge.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from: DVec2,
    /// Its direction, of length one; zero where the piece has no length.
    way: DVec2,
    length_m: f64,
}

impl Piece {
    /// The pieces of a closed edge.
    fn of(edge: &[DVec2]) -> Vec<Self> {
        let ends = edge.iter().cycle().skip(1);
        let piece = |(from, to): (&DVec2, &DVec2)| {
            let along = *to - *from;
            Self {
                from: *from,
                way: along.normalize_or_zero(),
                length_m: along.length(),
            }
        };
        edge.iter().zip(ends).map(piece).collect()
    }
}

/// The rectangles about [`TOGETHER`] pieces of a line each: where all of a rectangle is far, so are its pieces.
#[derive(Clone, Debug, Default)]
struct Boxes(Vec<[DVec2; 2]>);

/// Pieces of a line in one rectangle.
const TOGETHER: usize = 8;

impl Boxes {
    /// Those about the pieces between `n` points.
    fn about(n: usize, point: impl Fn(usize) -> DVec2) -> Self {
        let about = |first: usize| {
            let own = (first..=(first + TOGETHER).min(n)).map(|i| point(i % n));
            own.fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], p| {
                [low.min(p), high.max(p)]
            })
        };
        Self((0..n).step_by(TOGETHER).map(about).collect())
    }

    /// The square of the distance (m^2) of a point from the rectangle about piece `i`.
    fn distance_squared(&self, i: usize, point: DVec2) -> f64 {
        let [low, high] = self.0[i / TOGETHER];
        point.clamp(low, high).distance_squared(point)
    }
}

/// How far along the road the edge that a car comes near may be from the cross-section abreast of it (m).
const REACH_M: f64 = 40.0;
/// Distance (m) that a line of the wrong direction counts as further away, where its first place is looked for.
const TURNED_M: f64 = 50.0;
/// Share by which squares of distances from two pieces of an edge may differ that are one.
const SAME: f64 = 1e-12;
/// Swing of a car's corners that is left out (m).
const LEAST_SWING_M: f64 = 0.001;

impl<'a> RoadEdges<'a> {
    /// Edges from the ends of cross-sections (m), as many on the right as on the left.
    pub fn new(right_m: &'a [DVec2], left_m: &'a [DVec2], closed: bool) -> Self {
        let n = right_m.len().min(left_m.len());
        let mut edges = Self {
            right_m: &right_m[..n],
            left_m: &left_m[..n],
            closed,
            step_m: 1.0,
            pieces: [right_m, left_m].map(|edge| Piece::of(&edge[..n])),
            boxes: Default::default(),
        };
        let steps = n - usize::from(!closed && n > 0);
        let length_m: f64 = (0..steps)
            .map(|i| edges.middle(i).distance(edges.middle((i + 1) % n)))
            .sum();
        edges.step_m = (length_m / steps.max(1) as f64).max(1e-3);
        edges.boxes = [
            Boxes::about(n, |i| edges.right_m[i]),
            Boxes::about(n, |i| edges.left_m[i]),
            Boxes::about(n, |i| edges.middle(i)),
        ];
        edges
    }

    fn len(&self) -> usize {
        self.right_m.len()
    }

    fn middle(&self, i: usize) -> DVec2 {
        0.5 * (self.right_m[i] + self.left_m[i])
    }

    /// Cross-sections from `reach_m` before one to as far behind it, leaving out the last `less`. They come in runs of one rectangle
    /// each, the one's own first.
    fn around(&self, i: usize, reach_m: f64, less: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let reach = (reach_m / self.step_m).ceil() as usize + 1;
        let n = self.len();
        let (first, count) = if self.closed {
            let reach = reach.min(n / 2);
            (i + n - reach, 2 * reach + 1)
        } else {
            let first = i.saturating_sub(reach);
            (first, (i + reach).min(n - 1) - first + 1)
        };
        // Remainders would take more time than all the rest.
        let wrapped = move |i: usize| if i >= n { i - n } else { i };
        let (mut next, mut left) = (wrapped(first), count - less);
        let runs = std::iter::from_fn(move || {
            let end = (next + left).min((next / TOGETHER + 1) * TOGETHER).min(n);
            let run = next..end;
            left -= run.len();
            next = wrapped(end);
            (!run.is_empty()).then_some(run)
        });
        let own = runs.clone().find(|run| run.contains(&i));
        own.into_iter().chain(runs)
    }

    /// The cross-section abreast of each of these points (m), which follow one another along the road.
    pub fn abreast(&self, points_m: &[DVec2]) -> Vec<usize> {
        let [first, second, ..] = points_m else {
            return vec![0; points_m.len()];
        };
        let way = (*second - *first).normalize_or_zero();
        // Where one road crosses another, both are near: the line runs along its own.
        let away = |i: usize| {
            let n = self.len();
            let (before, after) = (self.middle((i + n - 1) % n), self.middle((i + 1) % n));
            let turned = 1.0 - (after - before).normalize_or_zero().dot(way);
            first.distance(self.middle(i)) + TURNED_M * turned
        };
        let mut at = (0..self.len())
            .min_by(|&i, &j| away(i).total_cmp(&away(j)))
            .unwrap_or(0);
        let mut last = *first;
        points_m
            .iter()
            .map(|point| {
                let near = self.around(at, REACH_M.max(2.0 * point.distance(last)), 0);
                last = *point;
                let mut nearest = f64::INFINITY;
                for run in near {
                    if self.boxes[2].distance_squared(run.start, *point) > nearest {
                        continue;
                    }
                    for i in run {
                        let distance = point.distance_squared(self.middle(i));
                        if distance < nearest {
                            (nearest, at) = (distance, i);
                        }
                    }
                }
                at
            })
            .collect()
    }

    /// Distance of a point inwards from an edge (m), near a cross-section; negative beyond the edge.
    pub fn inside(&self, point: DVec2, abreast: usize, left: bool) -> f64 {
        let (pieces, boxes) = (&self.pieces[usize::from(left)], &self.boxes[usize::from(left)]);
        let mut nearest = f64::MAX;
        let mut leftward = 0.0;
        for run in self.around(abreast, REACH_M, 1) {
            if boxes.distance_squared(run.start, point) > (1.0 + 2.0 * SAME) * nearest {
                continue;
            }
            for piece in &pieces[run] {
                let away = point - piece.from;
                // How nearly the point lies at right angles to the piece. Where two pieces share the nearest point, the one that
                // faces the point decides the side.
                let facing = piece.way.perp_dot(away);
                let along = piece.way.dot(away);
                let beyond = (along - piece.length_m).max(-along).max(0.0);
                let distance = facing * facing + beyond * beyond;
                let same = (distance - nearest).abs() <= SAME * nearest;
                if !(same || distance < nearest) || piece.length_m == 0.0 {
                    continue;
                }
                if !same || facing.abs() > f64::abs(leftward) {
                    nearest = distance;
                    leftward = facing;
                }
            }
        }
        let leftward = nearest.sqrt().copysign(leftward);
        if left { -leftward } else { leftward }
    }

    /// Distance from a car to the right and the left edge (m) at every point of a line; negative beyond an edge. It is that of
    /// the car's side and, in bends, of its outer corners.
    pub fn clearances(&self, line: &FineLine, car: &CarPlan) -> Vec<[f64; 2]> {
        let n = line.points_m.len();
        let abreast = self.abreast(&line.points_m);
        let half_width_m = 0.5 * car.width_m;
        let clearance = |i: usize, left: bool| {
            let (point, abreast) = (line.points_m[i], abreast[i]);
            let side = self.inside(point, abreast, left) - half_width_m;
            let bend = line.curvature_1pm[i];
            let swing_m = car.length_m * car.length_m * bend.abs() / 8.0;
            // The corners on the outside of a bend swing out.
            if swing_m < LEAST_SWING_M || left == (bend > 0.0) {
                return side;
            }
            let (before, after) = if line.closed {
                (line.points_m[(i + n - 1) % n], line.points_m[(i + 1) % n])
            } else {
                (line.points_m[i.max(1) - 1], line.points_m[(i + 1).min(n - 1)])
            };
            let ahead = (after - before).normalize_or_zero();
            let outwards = if left { ahead.perp() } else { -ahead.perp() };
            let corner = |along: f64| {
                let corner = point + half_width_m * outwards + 0.5 * along * car.length_m * ahead;
                self.inside(corner, abreast, left)
            };
            side.min(corner(1.0)).min(corner(-1.0))
        };
        (0..n)
            .map(|i| [clearance(i, false), clearance(i, true)])
            .collect()
    }

    /// Where a straight line from a point near a cross-section, in a direction of length one, meets an edge for the first time
    /// (m); nothing where it meets none.
    pub fn meets(&self, point: DVec2, way: DVec2, abreast: usize, left: bool) -> Option<f64> {
        let edge = if left { self.left_m } else { self.right_m };
        let meeting = |i: usize| {
            let (from, to) = (edge[i], edge[(i + 1) % edge.len()]);
            let (along, apart) = (to - from, from - point);
            let cross = way.perp_dot(along);
            let share = apart.perp_dot(way) / cross;
            let distance = apart.perp_dot(along) / cross;
            ((-1e-9..=1.0 + 1e-9).contains(&share) && distance >= 0.0).then_some(distance)
        };
        let pieces = self.around(abreast, REACH_M, 1).flatten();
        pieces.filter_map(meeting).min_by(f64::total_cmp)
    }

    /// Draws in the ends of cross-sections at which a car of this width (m) would be beyond an edge: where they slant, or where
    /// an edge bends round their ends. Half the car is taken off them already.
    pub fn draw_in(&self, cross_sections: &mut CrossSections, car_width_m: f64) {
        let middles = cross_sections.points(&vec![0.5; cross_sections.len()]);
        let reference_m = cross_sections.points(&cross_sections.reference);
        for (i, abreast) in self.abreast(&middles).into_iter().enumerate() {
            let ends = [cross_sections.right_m[i], cross_sections.left_m[i]];
            let across = (ends[1] - ends[0]).normalize_or_zero();
            let drawn = |left: bool| {
                let (mut end, inwards) = if left {
                    (ends[1], -across)
                } else {
                    (ends[0], across)
                };
                let room = |end: DVec2| self.inside(end, abreast, left) - 0.5 * car_width_m;
                if room(end) < -ON_ROAD_M {
                    // No step leads past the first place that is far enough from the edge: a distance changes no faster than a
                    // place.
                    for _ in 0..DRAWN_STEPS {
                        let short_m = -room(end);
                        if short_m <= 1e-4 {
                            break;
                        }
                        end += short_m * inwards;
                    }
                }
                end
            };
            let (right, left) = (drawn(false), drawn(true));
            // Where both ends meet, the line has nowhere else to go.
            if [right, left] != ends && (left - right).dot(across) > LEAST_ROOM_M {
                (cross_sections.right_m[i], cross_sections.left_m[i]) = (right, left);
                let share = (reference_m[i] - right).dot(across) / left.distance(right);
                cross_sections.reference[i] = share.clamp(0.0, 1.0);
            }
        }
    }
}

/// Steps in which an end is drawn in at most: each leaves at most half of what a slanting one lacks.
const DRAWN_STEPS: usize = 60;
/// Room that is left on a cross-section (m).
const LEAST_ROOM_M: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;

    fn fine(points: &[DVec2], closed: bool) -> FineLine {
        FineLine::new(points, closed, 1.0, None, 0.0).unwrap()
    }

    /// A road along a curve, 10 m wide.
    fn road(points: &[DVec2]) -> [Vec<DVec2>; 2] {
        let n = points.len();
        let left = |i: usize| (points[(i + 1) % n] - points[(i + n - 1) % n]).normalize().perp();
        [-5.0, 5.0].map(|out| (0..n).map(|i| points[i] + out * left(i)).collect())
    }

    #[test]
    fn a_bridge_has_two_decks() {
        // A figure of eight that crosses itself in the origin at a right angle.
        let eight: Vec<DVec2> = (0..800)
            .map(|i| (f64::from(i) + 0.5) * std::f64::consts::TAU / 800.0)
            .map(|t| DVec2::new(200.0 * t.sin(), 100.0 * (2.0 * t).sin()))
            .collect();
        let [right, left] = road(&eight);
        let car = CarPlan {
            width_m: 2.0,
            length_m: 0.0,
        };
        // From several starts, the crossing among them.
        for start in [0, 100, 399, 400, 401, 650] {
            let mut turned = eight.clone();
            turned.rotate_left(start);
            let found = check_line(&fine(&turned, true), &right, &left, &car);
            assert!((found.margin_m - 4.0).abs() < 0.01, "{start}: {found:?}");
        }
    }

    /// Pieces that are passed over are none of the nearest: on a winding road, distances are those from all of its edge, and the
    /// cross-section abreast is the nearest of all.
    #[test]
    fn what_is_passed_over_is_farther() {
        let n = 500;
        let middle: Vec<DVec2> = (0..n)
            .map(|i| f64::from(i) * std::f64::consts::TAU / f64::from(n))
            .map(|t| (150.0 + 20.0 * (7.0 * t).sin()) * DVec2::from_angle(t))
            .collect();
        let [right, left] = road(&middle);
        let edges = RoadEdges::new(&right, &left, true);
        let from_piece = |point: DVec2, from: DVec2, to: DVec2| {
            let along = to - from;
            let share = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            point.distance(from + share * along)
        };
        let points: Vec<DVec2> = (0..middle.len())
            .map(|i| left[i].lerp(right[i], 0.1 + 0.08 * (i % 11) as f64))
            .collect();
        for (point, abreast) in points.iter().zip(edges.abreast(&points)) {
            let nearest = (0..middle.len()).min_by(|&i, &j| {
                point
                    .distance(edges.middle(i))
                    .total_cmp(&point.distance(edges.middle(j)))
            });
            assert_eq!(Some(abreast), nearest);
            for (edge, is_left) in [(&right, false), (&left, true)] {
                let pieces = edge.iter().zip(edge.iter().skip(1).chain(&edge[..1]));
                let all = pieces.map(|(from, to)| from_piece(*point, *from, *to));
                let least = all.fold(f64::INFINITY, f64::min);
                let found = edges.inside(*point, abreast, is_left);
                assert!((found - least).abs() < 1e-9, "{point}: {found} and {least}");
            }
        }
    }

    /// A point on the edge itself, and points either side of it, on a straight where all pieces lie in one line.
    #[test]
    fn a_point_on_the_edge_is_no_distance_from_it() {
        let at = |y: f64| -> Vec<DVec2> { (0..40).map(|i| DVec2::new(f64::from(i), y)).collect() };
        let (right, left) = (at(-5.0), at(5.0));
        let edges = RoadEdges::new(&right, &left, false);
        for (y, is_left) in [(5.0, true), (-5.0, false), (5.25, true), (-4.0, false)] {
            let found = edges.inside(DVec2::new(20.3, y), 20, is_left);
            assert_eq!(found, if is_left { 5.0 - y } else { y + 5.0 });
        }
    }

    #[test]
    fn corners_swing_out_in_bends() {
        let circle = |radius: f64| -> Vec<DVec2> {
            (0..400)
                .map(|i| radius * DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 400.0))
                .collect()
        };
        // To the left about the origin: the right edge is outside.
        let (right, left) = (circle(15.0), circle(5.0));
        let line = fine(&circle(12.0), true);
        let margin = |length_m: f64| {
            let car = CarPlan {
                width_m: 2.0,
                length_m,
            };
            check_line(&line, &right, &left, &car)
        };
        assert!((margin(0.0).margin_m - 2.0).abs() < 0.01);
        let long = margin(5.0);
        let expected = 15.0 - 13.0f64.hypot(2.5);
        assert!((long.margin_m - expected).abs() < 0.01 && !long.left, "{long:?}");
    }

    #[test]
    fn ends_of_slanting_cross_sections_are_drawn_in() {
        // A straight road of 10 m with cross-sections at 45 degrees.
        let n = 60;
        let along = |y: f64, slant: f64| -> Vec<DVec2> {
            (0..n)
                .map(|i| DVec2::new(2.0 * f64::from(i) + slant, y))
                .collect()
        };
        let mut cross_sections = CrossSections {
            name: "slanting".to_owned(),
            closed: false,
            length_m: 118.0,
            station_m: (0..n).map(|i| 2.0 * f64::from(i)).collect(),
            right_m: along(-5.0, -5.0),
            left_m: along(5.0, 5.0),
            reference: vec![0.5; 60],
            sections: Vec::new(),
            corners: Vec::new(),
            drs: Vec::new(),
            relief: None,
        };
        let edges = cross_sections.clone();
        cross_sections = cross_sections.narrowed(2.0).unwrap();
        assert!(cross_sections.right_m[30].y < -4.2);
        RoadEdges::new(&edges.right_m, &edges.left_m, false).draw_in(&mut cross_sections, 2.0);
        for i in 10..50 {
            let ends = [cross_sections.right_m[i].y, cross_sections.left_m[i].y];
            assert!(
                (ends[0] + 4.0).abs() < ON_ROAD_M && (ends[1] - 4.0).abs() < ON_ROAD_M,
                "{ends:?}"
            );
            assert!((cross_sections.reference[i] - 0.5).abs() < 1e-3);
        }
    }
}
