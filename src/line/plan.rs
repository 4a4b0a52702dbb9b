//! The tables of a line's cross-sections that kernels read.

use crate::scalar::Real;
use crate::track::{CrossSections, FRICTION_PLACES, Surface};
use glam::DVec2;

/// Terms of the sum that gives `alpha` at a section.
pub const TERMS: usize = 4;

/// One section, in differences of coordinates. Absolute coordinates in single precision would lose the curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionRow<S> {
    /// From the right end of this cross-section to that of the next (m).
    pub step: [S; 2],
    /// From the right end of the cross-section to the left end (m).
    pub across: [S; 2],
    /// One over the spacing from this cross-section to the next by which second differences are computed (1/m).
    pub inverse_spacing: S,
    /// The part of `alpha` that no variable moves.
    pub constant: S,
    /// Weights of the variables that `alpha` is the sum of.
    pub weights: [S; TERMS],
    /// Which variables those are.
    pub sources: [u32; TERMS],
    /// Whether the DRS may be open from here to the next cross-section.
    pub drs: bool,
}

/// Even steps from edge to edge of a road on which the friction is linear.
pub const FRICTION_STEPS: usize = FRICTION_PLACES - 1;

/// The surface at one section: height in differences, banking and friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliefRow<S> {
    /// From the right end of this cross-section up to that of the next (m).
    pub step_rise: S,
    /// From the right end of the cross-section up to the left end (m).
    pub across_rise: S,
    /// Sine and cosine of the banking, positive with the left side up.
    pub sin: S,
    /// See above.
    pub cos: S,
    /// Friction at the right edge of the road, as a share of the car's own,
    pub friction: S,
    /// and what it gains on each of so many even steps from there to the left edge.
    pub friction_rises: [S; FRICTION_STEPS],
    /// How many of these steps the right end of the cross-section is from the edge,
    pub friction_from: S,
    /// and the left end from the right one.
    pub friction_across: S,
}

/// All sections, and the order in which a lap passes them.
#[derive(Clone, Debug, PartialEq)]
pub struct LinePlan<S> {
    /// Whether the last section is followed by the first.
    pub closed: bool,
    /// The section where a closed lap's passes start. Results do not depend on it; the work is least where the car is
    /// slowest.
    pub start: usize,
    /// Speed squared at the start of an open line (m^2/s^2).
    pub entry: S,
    /// Terms in use of [`TERMS`].
    pub terms: usize,
    /// The sections.
    pub rows: Vec<SectionRow<S>>,
    /// Height, banking and friction of the sections; empty on a level and dry road.
    pub relief: Vec<ReliefRow<S>>,
}

impl LinePlan<f64> {
    /// The plan of the cross-sections between `right_m` and `left_m`, with no variables for `alpha` yet and the spacing of
    /// their middles.
    pub fn of_cross_sections(right_m: &[DVec2], left_m: &[DVec2], closed: bool) -> Self {
        let n = right_m.len();
        let middle = |i: usize| 0.5 * (right_m[i] + left_m[i]);
        // As in the kernels, points that coincide count as a tenth of a millimetre apart.
        let spacing = |i: usize| middle(i).distance(middle((i + 1) % n)).max(1e-4);
        let rows = (0..n).map(|i| SectionRow {
            step: (right_m[(i + 1) % n] - right_m[i]).to_array(),
            across: (left_m[i] - right_m[i]).to_array(),
            inverse_spacing: spacing(i).recip(),
            constant: 0.0,
            weights: [0.0; TERMS],
            sources: [0; TERMS],
            drs: false,
        });
        Self {
            closed,
            start: 0,
            entry: 0.0,
            terms: 0,
            rows: rows.collect(),
            relief: Vec::new(),
        }
    }

    /// The plan with the surface of `cross_sections`, where that is not level and dry.
    pub fn with_relief(mut self, cross_sections: &CrossSections) -> Self {
        let ends = [&cross_sections.right_m, &cross_sections.left_m];
        let surfaces = ends.map(|points| cross_sections.relief_of(points));
        let (Some(relief), [Some(right), Some(left)]) = (&cross_sections.relief, surfaces) else {
            return self;
        };
        let n = right.len();
        let row = |i: usize| {
            let [z, bank, ..] = right[i];
            let friction = &relief.friction[i];
            let across = cross_sections.left_m[i] - cross_sections.right_m[i];
            let [from, to] = ends.map(|ends| {
                let left_m = (ends[i] - relief.foot_m[i]).dot(across.normalize_or_zero());
                friction.place(left_m)
            });
            ReliefRow {
                step_rise: right[(i + 1) % n][0] - z,
                across_rise: left[i][0] - z,
                sin: bank.sin(),
                cos: bank.cos(),
                friction: friction.of[0],
                friction_rises: std::array::from_fn(|k| friction.of[k + 1] - friction.of[k]),
                friction_from: from,
                friction_across: to - from,
            }
        };
        self.relief = (0..n).map(row).collect();
        self
    }

    /// The plan with the spacing (m) of every segment by which second differences are computed.
    pub fn spaced(mut self, spacing_m: &[f64]) -> Self {
        for (row, spacing) in self.rows.iter_mut().zip(spacing_m) {
            row.inverse_spacing = spacing.recip();
        }
        self
    }

    /// The plan with the segments on which the DRS may be open; none where `drs` is empty.
    pub fn with_drs(mut self, drs: &[bool]) -> Self {
        for (row, drs) in self.rows.iter_mut().zip(drs) {
            row.drs = *drs;
        }
        self
    }

    /// The plan of one fixed line.
    pub fn of_points(points_m: &[DVec2], closed: bool) -> Self {
        Self::of_cross_sections(points_m, points_m, closed)
    }

    /// The plan with the surface at each point of one fixed line; none on a level and dry road.
    pub fn with_surface(mut self, surface: &[Surface]) -> Self {
        let n = surface.len();
        let row = |(i, [z, bank, friction, _]): (usize, &Surface)| ReliefRow {
            step_rise: surface[(i + 1) % n][0] - z,
            across_rise: 0.0,
            sin: bank.sin(),
            cos: bank.cos(),
            friction: *friction,
            friction_rises: [0.0; FRICTION_STEPS],
            friction_from: 0.0,
            friction_across: 0.0,
        };
        self.relief = surface.iter().enumerate().map(row).collect();
        self
    }

    /// The plan in the precision that the scalar `R` stores tables in.
    pub fn stored<R: Real>(&self) -> LinePlan<R::Storage> {
        let store = R::store;
        LinePlan {
            closed: self.closed,
            start: self.start,
            entry: store(self.entry),
            terms: self.terms,
            rows: self
                .rows
                .iter()
                .map(|row| SectionRow {
                    step: row.step.map(store),
                    across: row.across.map(store),
                    inverse_spacing: store(row.inverse_spacing),
                    constant: store(row.constant),
                    weights: row.weights.map(store),
                    sources: row.sources,
                    drs: row.drs,
                })
                .collect(),
            relief: self
                .relief
                .iter()
                .map(|row| ReliefRow {
                    step_rise: store(row.step_rise),
                    across_rise: store(row.across_rise),
                    sin: store(row.sin),
                    cos: store(row.cos),
                    friction: store(row.friction),
                    friction_rises: row.friction_rises.map(store),
                    friction_from: store(row.friction_from),
                    friction_across: store(row.friction_across),
                })
                .collect(),
        }
    }
}

impl<S> LinePlan<S> {
    /// Figures that a candidate has of each section on a device: length, curvature and speed squared; on a road that is not level and
    /// dry six more.
    pub fn figures_each(&self) -> usize {
        if self.relief.is_empty() { 3 } else { 9 }
    }

    /// Number of segments: one per section, but for the last of an open line.
    pub fn segments(&self) -> usize {
        self.rows.len() - usize::from(!self.closed)
    }
}
