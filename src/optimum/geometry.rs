//! Points of a line, its segments and curvature, and the derivatives of both in reverse.

use super::bounds::{Bounds, RowBound};
use crate::Result;
use crate::line::{LinePlan, LineRelief, Parametrisation, SectionRow};
use crate::track::{CrossSections, SectionRelief};
use crate::vehicle::powertrain::GRAVITY_MPS2;
use glam::DVec2;

/// The points of a line as a linear function of its variables: `point_j = origin_j + sum of reach_jk x_k`.
///
/// All usual descriptions of a line have this form: its position on every cross-section, the controls of a B-spline, the points
/// of an interpolating spline.
#[derive(Clone, Debug, PartialEq)]
pub struct LineMap {
    /// Whether the last point is followed by the first.
    pub closed: bool,
    variables: usize,
    origin_m: Vec<DVec2>,
    starts: Vec<usize>,
    reach: Vec<(usize, DVec2)>,
    /// Whether the DRS may be open from each point to the next; nowhere if empty.
    pub(super) drs: Vec<bool>,
    /// The surface of the cross-section that each point lies on, and its direction to the left; none on a level and dry road.
    relief: Option<(SectionRelief, Vec<DVec2>)>,
}

impl LineMap {
    /// From the origin of every point (m) and its reach (m) for each variable that moves it.
    pub fn new(
        closed: bool,
        variables: usize,
        points: impl IntoIterator<Item = (DVec2, Vec<(usize, DVec2)>)>,
    ) -> Self {
        let mut map = Self {
            closed,
            variables,
            origin_m: Vec::new(),
            starts: vec![0],
            reach: Vec::new(),
            drs: Vec::new(),
            relief: None,
        };
        for (origin, reach) in points {
            map.origin_m.push(origin);
            map.reach.extend(reach);
            map.starts.push(map.reach.len());
        }
        map
    }

    /// One variable for each cross-section: the line's `alpha` there.
    pub fn at_every_cross_section(cross_sections: &CrossSections) -> Self {
        let points = (0..cross_sections.len()).map(|i| {
            (
                cross_sections.right_m[i],
                vec![(i, cross_sections.left_m[i] - cross_sections.right_m[i])],
            )
        });
        Self::new(cross_sections.closed, cross_sections.len(), points).on(cross_sections)
    }

    /// The variables of a parametrisation, and the bounds that keep them and the line within theirs.
    ///
    /// # Errors
    /// [`crate::Error::Input`] if the parametrisation does not fit the cross-sections.
    pub fn parametrised(
        cross_sections: &CrossSections,
        parametrisation: &Parametrisation,
    ) -> Result<(Self, Bounds)> {
        let mut plan = LinePlan::of_cross_sections(
            &cross_sections.right_m,
            &cross_sections.left_m,
            cross_sections.closed,
        );
        parametrisation.apply(cross_sections, &mut plan)?;
        let variables = parametrisation.variables(cross_sections);
        let shares = |row: &SectionRow<f64>| {
            let terms = row.sources.iter().zip(&row.weights).take(plan.terms);
            let used = terms.filter(|(_, weight)| **weight != 0.0);
            used.map(|(source, weight)| (*source as usize, *weight))
                .collect::<Vec<_>>()
        };
        let points = plan.rows.iter().enumerate().map(|(i, row)| {
            let across = cross_sections.left_m[i] - cross_sections.right_m[i];
            let reach = shares(row).into_iter().map(|(k, share)| (k, share * across));
            (cross_sections.right_m[i] + row.constant * across, reach.collect())
        });
        let map = Self::new(cross_sections.closed, variables.len(), points).on(cross_sections);
        // A single variable at a section has its own bounds.
        let sums = plan.rows.iter().filter(|_| plan.terms > 1);
        let rows = sums.map(|row| RowBound {
            terms: shares(row),
            lower: -row.constant,
            upper: 1.0 - row.constant,
        });
        let bounds = Bounds {
            lower: variables.iter().map(|v| v.lower).collect(),
            upper: variables.iter().map(|v| v.upper).collect(),
            rows: rows.collect(),
        };
        Ok((map, bounds))
    }

    /// A line `base` (its `alpha` on every cross-section) moved along the cross-sections by a cubic B-spline with `controls` (m,
    /// to the left), and the bounds that keep it on the road at every cross-section. If the base is smooth, so are all such
    /// lines, however jagged the edges are. Lines whose `alpha` is a spline lack that property. The base itself may lie off the
    /// road.
    pub fn spline_about(cross_sections: &CrossSections, base: &[f64], controls: usize) -> (Self, Bounds) {
        let points = cross_sections.points(base);
        let across = |i: usize| (cross_sections.left_m[i] - cross_sections.right_m[i]).normalize();
        let reaches = (0..cross_sections.len()).map(|i| {
            let reach = spline_shares(cross_sections, controls, i).into_iter();
            (
                points[i],
                reach.map(|(k, share)| (k, share * across(i))).collect(),
            )
        });
        let rows = (0..cross_sections.len()).map(|i| RowBound {
            terms: spline_shares(cross_sections, controls, i),
            lower: (cross_sections.right_m[i] - points[i]).dot(across(i)),
            upper: (cross_sections.left_m[i] - points[i]).dot(across(i)),
        });
        let bounds = Bounds {
            lower: vec![f64::NEG_INFINITY; controls],
            upper: vec![f64::INFINITY; controls],
            rows: rows.collect(),
        };
        let map = Self::new(cross_sections.closed, controls, reaches).on(cross_sections);
        (map, bounds)
    }

    /// The map of a line with a point at every cross-section, which has the DRS open where these allow it and their surface.
    fn on(mut self, cross_sections: &CrossSections) -> Self {
        self.drs.clone_from(&cross_sections.drs);
        let ends = cross_sections.right_m.iter().zip(&cross_sections.left_m);
        let left = ends.map(|(right, left)| (*left - *right).normalize_or_zero());
        self.relief = cross_sections
            .relief
            .clone()
            .map(|relief| (relief, left.collect()));
        self
    }

    /// Number of variables.
    pub fn variables(&self) -> usize {
        self.variables
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.origin_m.len()
    }

    /// The variables that move point `j`, with their reaches (m).
    pub fn reach(&self, j: usize) -> &[(usize, DVec2)] {
        &self.reach[self.starts[j]..self.starts[j + 1]]
    }

    /// The points (m) of line `x`.
    pub fn line(&self, x: &[f64]) -> Vec<DVec2> {
        let point = |j: usize| {
            let moved = self.reach(j).iter().map(|&(k, reach)| reach * x[k]);
            moved.fold(self.origin_m[j], |sum, step| sum + step)
        };
        (0..self.points()).map(point).collect()
    }

    /// The shape of line `x`.
    pub(super) fn shape(&self, x: &[f64]) -> Shape {
        let points = self.line(x);
        let mut shape = Shape::of(&points, self.closed);
        if let Some((relief, left)) = self.relief.as_ref().filter(|_| !shape.stands_still()) {
            let places = points.iter().zip(left).enumerate();
            let surface = places.map(|(i, (point, left))| relief.at(i, *left, *point));
            let (segments, curvature) = (&shape.length_m, &shape.curvature_1pm);
            shape.relief = Some(LineRelief::of(segments, curvature, surface.collect()));
        }
        shape
    }

    /// Carries derivatives with respect to the points back to the variables.
    pub(super) fn pull_back(&self, by_point: &[DVec2]) -> Vec<f64> {
        let mut by_x = vec![0.0; self.variables];
        for (j, bar) in by_point.iter().enumerate() {
            for &(k, reach) in self.reach(j) {
                by_x[k] += reach.dot(*bar);
            }
        }
        by_x
    }
}

/// Weights of `controls` controls of a cubic B-spline at cross-section `i`: the controls are as many cross-sections apart all along.
/// On an open circuit the outer controls also stand for those that would lie beyond the ends.
fn spline_shares(cross_sections: &CrossSections, controls: usize, i: usize) -> Vec<(usize, f64)> {
    let (n, last) = (cross_sections.len(), controls as isize - 1);
    let place = if cross_sections.closed {
        (i * controls) as f64 / n as f64
    } else {
        i as f64 * last as f64 / (n - 1) as f64
    };
    let t = place - place.floor();
    let weights = [
        (1.0 - t).powi(3) / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t.powi(3)) / 6.0,
        (1.0 + 3.0 * t + 3.0 * t * t - 3.0 * t.powi(3)) / 6.0,
        t.powi(3) / 6.0,
    ];
    let mut row: Vec<(usize, f64)> = Vec::with_capacity(4);
    for (weight, offset) in weights.into_iter().zip(-1..) {
        let k = place.floor() as isize + offset;
        let k = if cross_sections.closed {
            k.rem_euclid(last + 1)
        } else {
            k.clamp(0, last)
        } as usize;
        match row.iter_mut().find(|(other, _)| *other == k) {
            Some((_, sum)) => *sum += weight,
            None => row.push((k, weight)),
        }
    }
    row
}

/// Segments and curvature of a line.
#[derive(Clone, Debug)]
pub(super) struct Shape {
    pub closed: bool,
    /// From each point to the next (m); one fewer than points on an open line.
    pub step_m: Vec<DVec2>,
    /// Lengths of the segments (m).
    pub length_m: Vec<f64>,
    /// Angle turned through at each point (rad), left positive; zero at the ends of an open line.
    pub turn_rad: Vec<f64>,
    /// Half the length of the segments on both sides of each point (m).
    pub spacing_m: Vec<f64>,
    /// Turn over spacing (1/m).
    pub curvature_1pm: Vec<f64>,
    /// The surface along it; none on a level and dry road.
    pub relief: Option<LineRelief>,
}

impl Shape {
    pub fn of(points: &[DVec2], closed: bool) -> Self {
        let n = points.len();
        let segments = if closed { n } else { n.saturating_sub(1) };
        let step_m: Vec<DVec2> = (0..segments).map(|i| points[(i + 1) % n] - points[i]).collect();
        let length_m: Vec<f64> = step_m.iter().map(|d| d.length()).collect();
        let mut shape = Self {
            closed,
            length_m,
            turn_rad: vec![0.0; n],
            spacing_m: vec![0.0; n],
            curvature_1pm: vec![0.0; n],
            relief: None,
            step_m,
        };
        for i in 0..n {
            let (before, after) = shape.neighbours(i);
            let lengths = [before, after].into_iter().flatten().map(|s| shape.length_m[s]);
            shape.spacing_m[i] = 0.5 * lengths.sum::<f64>();
            if let (Some(before), Some(after)) = (before, after) {
                let (d, e) = (shape.step_m[before], shape.step_m[after]);
                shape.turn_rad[i] = d.perp_dot(e).atan2(d.dot(e));
                shape.curvature_1pm[i] = shape.turn_rad[i] / shape.spacing_m[i];
            }
        }
        shape
    }

    /// The segments before and after point `i`.
    pub fn neighbours(&self, i: usize) -> (Option<usize>, Option<usize>) {
        let segments = self.step_m.len();
        let before = if i > 0 {
            Some(i - 1)
        } else {
            self.closed.then(|| segments - 1)
        };
        (before, (i < segments).then_some(i))
    }

    /// Whether the line has two points in one place, where its heading is undefined.
    pub fn stands_still(&self) -> bool {
        !self.length_m.iter().all(|length| *length > 0.0)
    }

    /// Adds the change of segment `s` in `direction`, times the direction's length, by the variables to `terms`.
    pub fn add_step(map: &LineMap, s: usize, direction: DVec2, terms: &mut Vec<(usize, f64)>) {
        for (point, bar) in [((s + 1) % map.points(), direction), (s, -direction)] {
            terms.extend(map.reach(point).iter().map(|&(k, reach)| (k, reach.dot(bar))));
        }
    }

    /// Adds `scale` times the change of segment `s`'s length.
    pub fn add_length(&self, map: &LineMap, s: usize, scale: f64, terms: &mut Vec<(usize, f64)>) {
        Self::add_step(map, s, self.step_m[s] * (scale / self.length_m[s]), terms);
    }

    /// Adds `scale` times the change of segment `s`'s heading.
    pub fn add_heading(&self, map: &LineMap, s: usize, scale: f64, terms: &mut Vec<(usize, f64)>) {
        let across = self.step_m[s].perp();
        Self::add_step(map, s, across * (scale / self.length_m[s].powi(2)), terms);
    }

    /// Adds `scale` times the change of the turn at point `i`; zero at the ends of an open line.
    pub fn add_turn(&self, map: &LineMap, i: usize, scale: f64, terms: &mut Vec<(usize, f64)>) {
        if let (Some(before), Some(after)) = self.neighbours(i) {
            self.add_heading(map, after, scale, terms);
            self.add_heading(map, before, -scale, terms);
        }
    }

    /// Adds `scale` times the change of the curvature at point `i`.
    pub fn add_curvature(&self, map: &LineMap, i: usize, scale: f64, terms: &mut Vec<(usize, f64)>) {
        let spacing = self.spacing_m[i];
        self.add_turn(map, i, scale / spacing, terms);
        if let (Some(before), Some(after)) = self.neighbours(i) {
            for segment in [before, after] {
                self.add_length(
                    map,
                    segment,
                    -0.5 * scale * self.curvature_1pm[i] / spacing,
                    terms,
                );
            }
        }
    }

    /// Adds `scale` times the relative change of the friction at point `i`.
    pub fn add_friction(&self, map: &LineMap, i: usize, scale: f64, terms: &mut Vec<(usize, f64)>) {
        let (Some(relief), Some((_, left))) = (&self.relief, &map.relief) else {
            return;
        };
        let [.., friction, per_m] = relief.surface[i];
        if per_m != 0.0 {
            let bar = left[i] * (scale * per_m / friction);
            terms.extend(map.reach(i).iter().map(|&(k, reach)| (k, reach.dot(bar))));
        }
    }

    /// Adds `scale` times the change of gravity along segment `s` (m/s^2), whose ends rise and fall as they move across a banked road.
    pub fn add_climb(&self, map: &LineMap, s: usize, scale: f64, terms: &mut Vec<(usize, f64)>) {
        let (Some(relief), Some((_, left))) = (&self.relief, &map.relief) else {
            return;
        };
        let per_rise = scale * GRAVITY_MPS2 / relief.length_m[s];
        for (point, sign) in [((s + 1) % map.points(), 1.0), (s, -1.0)] {
            let [_, bank_rad, ..] = relief.surface[point];
            let bar = left[point] * (sign * per_rise * bank_rad.tan());
            terms.extend(map.reach(point).iter().map(|&(k, reach)| (k, reach.dot(bar))));
        }
    }

    /// Derivatives with respect to the points, from those with respect to segment lengths and curvature.
    pub fn pull_back(&self, by_length: &[f64], by_curvature: &[f64]) -> Vec<DVec2> {
        let n = self.turn_rad.len();
        let mut by_length = by_length.to_vec();
        let mut by_heading = vec![0.0; self.step_m.len()];
        for (i, by_curvature) in by_curvature.iter().enumerate() {
            if let (Some(before), Some(after)) = self.neighbours(i) {
                let by_turn = by_curvature / self.spacing_m[i];
                by_heading[after] += by_turn;
                by_heading[before] -= by_turn;
                let by_spacing = -by_turn * self.curvature_1pm[i];
                by_length[after] += 0.5 * by_spacing;
                by_length[before] += 0.5 * by_spacing;
            }
        }
        let mut by_point = vec![DVec2::ZERO; n];
        for (s, step) in self.step_m.iter().enumerate() {
            let length = self.length_m[s];
            // A change along the step changes its length, and a change across it turns it.
            let along = *step * (by_length[s] / length);
            let across = step.perp() * (by_heading[s] / (length * length));
            by_point[(s + 1) % n] += along + across;
            by_point[s] -= along + across;
        }
        by_point
    }
}
