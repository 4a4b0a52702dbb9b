//! The numbers that describe a line.

use super::plan::{LinePlan, TERMS};
use crate::error::{Error, Result};
use crate::evaluate::Variable;
use crate::track::CrossSections;
use clarabel::algebra::CscMatrix;
use clarabel::qdldl::{QDLDLFactorisation, QDLDLSettings};

/// The meaning of a line's coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Basis {
    /// `alpha` at every section.
    Sections,
    /// Control points of a uniform cubic B-spline over the station: periodic on a closed circuit, clamped at the ends of an open
    /// one (L. Piegl and W. Tiller, *The NURBS Book*, 2nd ed., 1997, ch. 2). It is the line's distance from the reference line,
    /// in mean widths of the road and from one half on: This is `alpha` where the road has an even width. Where the edges are
    /// jagged, the line is still as smooth as the reference line; a line with a smooth `alpha` would not be.
    ControlPoints { count: usize, overshoot: f64 },
}

/// How a line's `alpha` follows from a candidate's variables. The variables are all coefficients, or some of them; the others
/// keep their values of a context line.
#[derive(Clone, Debug, PartialEq)]
pub struct Parametrisation {
    basis: Basis,
    /// Free coefficients, and the values of all where they are not free.
    free: Option<(Vec<usize>, Vec<f64>)>,
}

/// How far beyond the road control points may reach by default, as a share of its width. A lone control point at 1.25
/// among neighbours at 0.5 brings the line just to the edge. A line beyond the edge is held there.
pub const OVERSHOOT: f64 = 0.25;

impl Parametrisation {
    /// `alpha` at every section.
    pub fn sections() -> Self {
        Self {
            basis: Basis::Sections,
            free: None,
        }
    }

    /// `count` control points, at least four, which may reach a quarter of its width beyond the road; the line is held within.
    pub fn control_points(count: usize) -> Self {
        Self {
            basis: Basis::ControlPoints {
                count,
                overshoot: OVERSHOOT,
            },
            free: None,
        }
    }

    /// How far beyond the road control points may reach, as a share of its width.
    pub fn with_overshoot(mut self, share: f64) -> Self {
        if let Basis::ControlPoints { overshoot, .. } = &mut self.basis {
            *overshoot = share;
        }
        self
    }

    /// Only the coefficients `free` are variables, in this order; `context` has the values of all, as
    /// [`Parametrisation::fit`] gives them.
    pub fn with_free(mut self, free: Vec<usize>, context: Vec<f64>) -> Self {
        self.free = Some((free, context));
        self
    }

    /// Both ends of an open line stay where `context` has them.
    pub fn with_fixed_ends(self, context: Vec<f64>) -> Self {
        let inner = (1..context.len().saturating_sub(1)).collect();
        self.with_free(inner, context)
    }

    /// Number of coefficients, free or not, of a line over `cross_sections`.
    pub fn coefficients(&self, cross_sections: &CrossSections) -> usize {
        match self.basis {
            Basis::Sections => cross_sections.len(),
            Basis::ControlPoints { count, .. } => count,
        }
    }

    /// # Errors
    /// [`Error::Input`] naming the setting that does not fit `cross_sections`.
    pub fn check(&self, cross_sections: &CrossSections) -> Result<()> {
        let wrong = |place: &str, found: String, expected: String| {
            Err(Error::input(
                &cross_sections.name,
                format!("line, {place}"),
                found,
                expected,
            ))
        };
        let all = self.coefficients(cross_sections);
        if let Basis::ControlPoints { count, overshoot } = self.basis {
            if count < TERMS || count > cross_sections.len() {
                return wrong(
                    "control points",
                    count.to_string(),
                    format!("{TERMS} to {}, the number of sections", cross_sections.len()),
                );
            }
            if !(0.0..=10.0).contains(&overshoot) {
                return wrong("overshoot", overshoot.to_string(), "0 to 10".to_owned());
            }
        }
        if let Some((free, context)) = &self.free {
            if context.len() != all || context.iter().any(|x| !x.is_finite()) {
                return wrong(
                    "context",
                    format!("{} values", context.len()),
                    format!("{all} finite ones"),
                );
            }
            let mut taken = vec![false; all];
            for &index in free {
                if index >= all || std::mem::replace(&mut taken[index], true) {
                    return wrong(
                        "free coefficients",
                        index.to_string(),
                        format!("each below {all}, once at most"),
                    );
                }
            }
        }
        Ok(())
    }

    /// The decision variables over `cross_sections`.
    pub fn variables(&self, cross_sections: &CrossSections) -> Vec<Variable> {
        let bounds = self.bounds(cross_sections);
        let name = match self.basis {
            Basis::Sections => "alpha",
            Basis::ControlPoints { .. } => "control",
        };
        let variable = |index: usize| Variable {
            name: format!("{name}_{index}"),
            unit: "-".to_owned(),
            lower: bounds[index].0,
            upper: bounds[index].1,
            whole: false,
        };
        match &self.free {
            None => (0..self.coefficients(cross_sections)).map(variable).collect(),
            Some((free, _)) => free.iter().copied().map(variable).collect(),
        }
    }

    /// Bounds of all coefficients: a control point may reach the furthest edge among the cross-sections that it moves the line
    /// on, and the overshoot beyond.
    fn bounds(&self, cross_sections: &CrossSections) -> Vec<(f64, f64)> {
        let Basis::ControlPoints { count, overshoot } = self.basis else {
            return vec![(0.0, 1.0); cross_sections.len()];
        };
        let mut bounds = vec![(0.5f64, 0.5f64); count];
        for (section, scale) in self.scales(cross_sections).into_iter().enumerate() {
            let reference = cross_sections.reference[section];
            let (right, left) = (0.5 - reference / scale, 0.5 + (1.0 - reference) / scale);
            for (index, weight) in self.weights_at(cross_sections, section) {
                if weight > 0.0 {
                    let (lower, upper) = &mut bounds[index];
                    *lower = lower.min(right - overshoot);
                    *upper = upper.max(left + overshoot);
                }
            }
        }
        bounds
    }

    /// Change of `alpha` at a section when the sum of its coefficients changes by one.
    fn scales(&self, cross_sections: &CrossSections) -> Vec<f64> {
        if self.basis == Basis::Sections {
            return vec![1.0; cross_sections.len()];
        }
        let ends = cross_sections.right_m.iter().zip(&cross_sections.left_m);
        let widths: Vec<f64> = ends.map(|(right, left)| right.distance(*left)).collect();
        let mean = widths.iter().sum::<f64>() / widths.len() as f64;
        widths.into_iter().map(|width| mean / width).collect()
    }

    /// `alpha` at a section when the sum of its coefficients is zero.
    fn origin(&self, cross_sections: &CrossSections, section: usize, scale: f64) -> f64 {
        match self.basis {
            Basis::Sections => 0.0,
            Basis::ControlPoints { .. } => cross_sections.reference[section] - 0.5 * scale,
        }
    }

    /// The coefficients that are summed for `alpha` at a section, and their weights.
    fn weights_at(&self, cross_sections: &CrossSections, section: usize) -> [(usize, f64); TERMS] {
        let Basis::ControlPoints { count, .. } = self.basis else {
            return [(section, 1.0), (section, 0.0), (section, 0.0), (section, 0.0)];
        };
        let station = cross_sections.station_m[section];
        if cross_sections.closed {
            let place = station / cross_sections.length_m * count as f64;
            let t = place.fract();
            let s = 1.0 - t;
            let weights = [
                s * s * s / 6.0,
                (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
                t * t * t / 6.0,
            ];
            let first = place as usize + count - 1;
            return std::array::from_fn(|j| ((first + j) % count, weights[j]));
        }
        let spans = count - 3;
        let last = cross_sections.station_m[cross_sections.len() - 1];
        let place = station / last * spans as f64;
        let span = (place as usize).min(spans - 1);
        // Knots are whole numbers, held at the ends.
        let knot = |i: isize| (span as isize + i).clamp(0, spans as isize) as f64;
        let mut weights = [1.0, 0.0, 0.0, 0.0];
        for degree in 1..4 {
            let mut saved = 0.0;
            for (j, weight) in weights[..degree].iter_mut().enumerate() {
                let (left, right) = (knot(j as isize + 1 - degree as isize), knot(j as isize + 1));
                let share = *weight / (right - left);
                *weight = saved + (right - place) * share;
                saved = (place - left) * share;
            }
            weights[degree] = saved;
        }
        std::array::from_fn(|j| (span + j, weights[j]))
    }

    /// Sets the `alpha` of `plan`, the plan of `cross_sections`.
    ///
    /// # Errors
    /// As [`Parametrisation::check`].
    pub fn apply(&self, cross_sections: &CrossSections, plan: &mut LinePlan<f64>) -> Result<()> {
        self.check(cross_sections)?;
        let all = self.coefficients(cross_sections);
        let mut sources: Vec<Option<usize>> = (0..all).map(Some).collect();
        if let Some((free, _)) = &self.free {
            sources.fill(None);
            for (variable, &index) in free.iter().enumerate() {
                sources[index] = Some(variable);
            }
        }
        plan.terms = if self.basis == Basis::Sections { 1 } else { TERMS };
        let scales = self.scales(cross_sections);
        for (section, row) in plan.rows.iter_mut().enumerate() {
            let scale = scales[section];
            (row.weights, row.sources) = ([0.0; TERMS], [0; TERMS]);
            row.constant = self.origin(cross_sections, section, scale);
            for (term, (index, weight)) in self.weights_at(cross_sections, section).into_iter().enumerate() {
                let weight = scale * weight;
                match (sources[index], &self.free) {
                    (Some(variable), _) => {
                        row.weights[term] = weight;
                        row.sources[term] = variable as u32;
                    }
                    (None, Some((_, context))) => row.constant += weight * context[index],
                    (None, None) => {}
                }
            }
        }
        if sources.iter().all(Option::is_none) {
            plan.terms = 0;
        }
        Ok(())
    }

    /// The coefficients, free or not, whose line comes closest to `alpha` at every section, held within their bounds.
    ///
    /// # Errors
    /// As [`Parametrisation::check`]; [`Error::Input`] if `alpha` does not have one value per section.
    pub fn fit(&self, cross_sections: &CrossSections, alpha: &[f64]) -> Result<Vec<f64>> {
        Ok(self.fit_all(cross_sections, &[alpha])?.swap_remove(0))
    }

    /// As [`Parametrisation::fit`], for several lines.
    ///
    /// # Errors
    /// As [`Parametrisation::fit`].
    pub fn fit_all(&self, cross_sections: &CrossSections, lines: &[&[f64]]) -> Result<Vec<Vec<f64>>> {
        self.check(cross_sections)?;
        let sound =
            |alpha: &&&[f64]| alpha.len() == cross_sections.len() && alpha.iter().all(|a| a.is_finite());
        if let Some(alpha) = lines.iter().find(|alpha| !sound(alpha)) {
            return Err(Error::input(
                &cross_sections.name,
                "line, alpha",
                format!("{} values", alpha.len()),
                format!("{} finite ones, one per section", cross_sections.len()),
            ));
        }
        let Basis::ControlPoints { count, .. } = self.basis else {
            let held = |alpha: &&[f64]| alpha.iter().map(|a| a.clamp(0.0, 1.0)).collect();
            return Ok(lines.iter().map(held).collect());
        };
        let scales = self.scales(cross_sections);
        // Normal equations plus a very small multiple of the identity, so that control points without a section stay in the
        // middle. Few entries are not zero: those of control points that are near one another.
        let (mut rows, mut columns): (Vec<usize>, Vec<usize>) = (0..count).map(|i| (i, i)).unzip();
        let mut values = vec![1e-9; count];
        let mut found = vec![vec![0.5e-9; count]; lines.len()];
        for section in 0..cross_sections.len() {
            let weights = self.weights_at(cross_sections, section);
            let origin = self.origin(cross_sections, section, scales[section]);
            for (i, weight) in weights {
                for (right, alpha) in found.iter_mut().zip(lines) {
                    right[i] += weight * ((alpha[section] - origin) / scales[section]);
                }
                for (j, other) in weights.into_iter().filter(|(j, _)| i <= *j) {
                    rows.push(i);
                    columns.push(j);
                    values.push(weight * other);
                }
            }
        }
        let matrix = CscMatrix::new_from_triplets(count, count, rows, columns, values);
        let exact = QDLDLSettings {
            regularize_enable: false,
            ..QDLDLSettings::default()
        };
        let factors = QDLDLFactorisation::new(&matrix, Some(exact)).ok();
        let Some(mut factors) = factors.filter(|f| f.positive_inertia() == count) else {
            return Err(Error::input(
                &cross_sections.name,
                "line, control points",
                count.to_string(),
                "a number that the sections determine",
            ));
        };
        let bounds = self.bounds(cross_sections);
        for row in &mut found {
            factors.solve(row);
            for (c, (lower, upper)) in row.iter_mut().zip(&bounds) {
                *c = c.clamp(*lower, *upper);
            }
        }
        Ok(found)
    }

    /// The variables among the coefficients that [`Parametrisation::fit`] gives.
    pub fn variables_of(&self, coefficients: &[f64]) -> Vec<f64> {
        match &self.free {
            None => coefficients.to_vec(),
            Some((free, _)) => free
                .iter()
                .filter_map(|&i| coefficients.get(i).copied())
                .collect(),
        }
    }
}
