//! The middle of a road between two edges.
//!
//! The edges may have any numbers of points. Links across the road are drawn first, by always stepping on along the edge that
//! gives the shorter next link, like the two sides of a zip; their middles give a rough centreline. The normals of a smooth line
//! through these meet the edges. The centre points of the survey lie halfway between, and their distances to the edges are the
//! widths.

use super::super::spline::Spline;
use super::check::{check_crossings, check_line, close};
use super::csv_columns::Edge;
use super::{Survey, SurveyOptions, place, stem};
use crate::{Error, Place, Result};
use glam::DVec2;
use std::path::Path;

/// Steps along the edges and along the middle (m), longer on very long roads.
const STEP_M: f64 = 3.0;
/// Most steps along an edge, which bounds the work.
const MOST_STEPS: f64 = 6000.0;
/// Greatest deviation of the smooth line from the middles of the links (m).
const ROUGHNESS_M: f64 = 1.0;
/// Widest road (m).
const WIDEST_ROAD_M: f64 = 200.0;

/// A polyline with the length up to each of its points; a closed one ends where it starts.
struct Polyline {
    points: Vec<DVec2>,
    length: Vec<f64>,
}

impl Polyline {
    fn new(mut points: Vec<DVec2>, closed: bool) -> Self {
        if closed && let Some(&first) = points.first() {
            points.push(first);
        }
        let mut length = vec![0.0];
        for pair in points.windows(2) {
            length.push(length[length.len() - 1] + pair[0].distance(pair[1]));
        }
        Self { points, length }
    }

    fn total(&self) -> f64 {
        self.length[self.length.len() - 1]
    }

    /// Points at even steps, both ends included.
    fn resampled(&self, step: f64) -> Vec<DVec2> {
        let steps = (self.total() / step).ceil().max(8.0);
        (0..=steps as usize)
            .map(|i| {
                let wanted = self.total() * i as f64 / steps;
                let after = self.length.partition_point(|&s| s <= wanted);
                let after = after.clamp(1, self.points.len() - 1);
                let (from, to) = (self.length[after - 1], self.length[after]);
                let share = ((wanted - from) / (to - from).max(1e-12)).clamp(0.0, 1.0);
                self.points[after - 1].lerp(self.points[after], share)
            })
            .collect()
    }
}

/// Makes a survey from two edges.
pub(super) fn survey(left: &Edge, right: &Edge, path: &Path, options: &SurveyOptions) -> Result<Survey> {
    let source = path.display().to_string();
    let mut sides = Vec::new();
    let mut closed = Vec::new();
    for (side, edge) in [("left", left), ("right", right)] {
        let mut points = edge.points.clone();
        let is_closed = close(&mut points, &edge.lines, path, options.closed)?;
        let at = |i: usize| place(&edge.lines, i).named(format!("{side} edge"));
        check_line(&points, is_closed, &source, &at)?;
        check_crossings(&points, is_closed, options.bridges, &source, &at)?;
        sides.push(points);
        closed.push(is_closed);
    }
    if closed[0] != closed[1] {
        let state = |closed: bool| if closed { "closed" } else { "open" };
        return Err(Error::input(
            path,
            "edges",
            format!(
                "a {} left edge and a {} right one",
                state(closed[0]),
                state(closed[1])
            ),
            "both closed or both open",
        ));
    }
    let closed = closed[0];
    let (mut right_points, left_points) = (sides.pop().unwrap_or_default(), sides.pop().unwrap_or_default());
    if closed {
        let nearest = nearest(&right_points, left_points[0]);
        right_points.rotate_left(nearest);
    }
    let (lefts, rights) = (
        Polyline::new(left_points, closed),
        Polyline::new(right_points, closed),
    );
    let step = STEP_M.max(lefts.total().max(rights.total()) / MOST_STEPS);
    let (l, r) = (lefts.resampled(step), rights.resampled(step));
    check_sides(&l, &r, left, path)?;
    let middles = zip(&l, &r);
    let (centre_m, left_m, right_m) = measure(&middles, &lefts, &rights, closed, step, path)?;
    let survey = Survey {
        name: stem(path),
        source,
        closed,
        centre_m,
        left_m,
        right_m,
        lines: Vec::new(),
        sections: Vec::new(),
        corners: Vec::new(),
        drs_zones_m: Vec::new(),
        bridges: options.bridges,
        z_m: Vec::new(),
        bank_deg: Vec::new(),
        friction: Vec::new(),
        height_gap_m: 0.0,
    };
    survey.check()?;
    Ok(survey)
}

fn nearest(points: &[DVec2], to: DVec2) -> usize {
    let distance = |i: &usize| points[*i].distance_squared(to);
    (0..points.len())
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(0)
}

/// Refuses edges that run in opposite directions or are swapped.
fn check_sides(left: &[DVec2], right: &[DVec2], edge: &Edge, path: &Path) -> Result<()> {
    let mut against = 0;
    let mut swapped = Vec::new();
    for (i, pair) in left.windows(2).enumerate() {
        let along = pair[1] - pair[0];
        let j = nearest(right, pair[0]).min(right.len() - 2);
        against += usize::from(along.dot(right[j + 1] - right[j]) < 0.0);
        if along.perp_dot(right[j] - pair[0]) > 0.0 {
            swapped.push(i);
        }
    }
    let n = left.len() - 1;
    if 2 * against > n {
        return Err(Error::input(
            path,
            "right edge",
            "points that run against those of the left edge",
            "both edges in the direction of driving",
        ));
    }
    // Coarse points may cut a corner, which gives a few wrong sides.
    let (nearly_all, hardly_any) = (n - n / 10, n / 50);
    if swapped.len() > nearly_all {
        return Err(Error::input(
            path,
            "edges",
            "a left edge that lies to the right of the right one",
            "edges as the driver sees them: the two are swapped, or both run backwards",
        ));
    }
    if let Some(&i) = swapped.first()
        && swapped.len() > hardly_any
    {
        return Err(Error::input(
            path,
            place(&edge.lines, nearest(&edge.points, left[i])),
            "a left edge that lies to the right of the right one from here on",
            "edges that do not cross",
        ));
    }
    Ok(())
}

/// The middles of links across the road.
fn zip(left: &[DVec2], right: &[DVec2]) -> Vec<DVec2> {
    let (mut i, mut j) = (0, 0);
    let mut middles = vec![left[0].midpoint(right[0])];
    while i + 1 < left.len() || j + 1 < right.len() {
        let step_left = i + 1 < left.len()
            && (j + 1 == right.len() || left[i + 1].distance(right[j]) <= left[i].distance(right[j + 1]));
        if step_left {
            i += 1;
        } else {
            j += 1;
        }
        middles.push(left[i].midpoint(right[j]));
    }
    middles
}

/// Centre points and widths to the left and right.
type Measured = (Vec<DVec2>, Vec<f64>, Vec<f64>);

fn measure(
    middles: &[DVec2],
    left: &Polyline,
    right: &Polyline,
    closed: bool,
    step: f64,
    path: &Path,
) -> Result<Measured> {
    let too_short = || {
        Error::input(
            path,
            "edges",
            "a road too short or too crooked to have a middle",
            "edges that run side by side",
        )
    };
    let mut line = Polyline::new(middles.to_vec(), false).resampled(step);
    let (mut centre, mut widths) = (Vec::new(), Vec::new());
    // The second round starts from the middles of the first one.
    for round in 0..2 {
        if closed && round == 0 {
            line.pop();
        }
        line.dedup_by(|a, b| a.distance(*b) < 0.1 * step);
        if line.len() < 8 {
            return Err(too_short());
        }
        let mut knots = vec![0.0];
        for i in 1..line.len() + usize::from(closed) {
            knots.push(knots[i - 1] + line[i % line.len()].distance(line[i - 1]).max(1e-6));
        }
        let smooth = Spline::within(&knots, &line, closed, ROUGHNESS_M, 60.0);
        centre.clear();
        widths.clear();
        let mut hints = [0, 0];
        for (i, &t) in knots.iter().take(line.len()).enumerate() {
            let jet = smooth.at(t);
            let normal = jet.first.normalize_or_zero().perp();
            let mut reach = [0.0; 2];
            for (side, edge) in [left, right].into_iter().enumerate() {
                let way = if side == 0 { normal } else { -normal };
                let at_end = !closed && (i == 0 || i + 1 == line.len());
                let found = hit(edge, jet.value, way, &mut hints[side]);
                // At the ends of an open road a normal may pass the edge's end.
                let found = found.or_else(|| at_end.then(|| beside(edge, jet.value, way)).flatten());
                reach[side] = found.ok_or_else(|| {
                    let side = ["left", "right"][side];
                    Error::input(
                        path,
                        Place::station(t).named("both edges"),
                        format!("no {side} edge beside the middle of the road"),
                        format!("edges side by side, at most {WIDEST_ROAD_M} m apart"),
                    )
                })?;
            }
            centre.push(jet.value + normal * (0.5 * (reach[0] - reach[1])));
            widths.push(0.5 * (reach[0] + reach[1]));
        }
        line.clone_from(&centre);
    }
    Ok((centre, widths.clone(), widths))
}

/// Distance (m) from a point along a direction to an edge, searched around the last hit first.
fn hit(edge: &Polyline, from: DVec2, way: DVec2, hint: &mut usize) -> Option<f64> {
    let n = edge.points.len() - 1;
    let on = |k: usize| {
        let (a, b) = (edge.points[k] - from, edge.points[k + 1] - from);
        let (across_a, across_b) = (way.perp_dot(a), way.perp_dot(b));
        if across_a * across_b > 0.0 || across_a == across_b {
            return None;
        }
        let along = a.lerp(b, across_a / (across_a - across_b)).dot(way);
        // A centre a little outside a kinked edge still sees it, behind.
        (along > -2.0 && along < WIDEST_ROAD_M).then_some(along)
    };
    let nearest = |range: &mut dyn Iterator<Item = usize>| {
        range
            .filter_map(|k| on(k % n).map(|along| (along, k % n)))
            .min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
    };
    let around = (n / 50).max(20).min(n);
    let found = nearest(&mut (*hint + n - around..=*hint + n + around)).or_else(|| nearest(&mut (0..n)))?;
    *hint = found.1;
    Some(found.0)
}

/// Distance (m) across to the nearer end of an edge.
fn beside(edge: &Polyline, from: DVec2, way: DVec2) -> Option<f64> {
    let ends = [edge.points[0], edge.points[edge.points.len() - 1]];
    let near = if ends[0].distance(from) < ends[1].distance(from) {
        ends[0]
    } else {
        ends[1]
    };
    let across = (near - from).dot(way);
    (across > 0.0 && across < WIDEST_ROAD_M).then_some(across)
}
