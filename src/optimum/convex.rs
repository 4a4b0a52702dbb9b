//! The convex optima: shortest path, least squared length, least second difference.

use super::bounds::{Bounds, check};
use super::conic::{Affine, ConicProgram, Status};
use super::geometry::{LineMap, Shape};
use super::objective::{Measures, ReferenceProblem};
use crate::{Error, Result};
use glam::DVec2;
use std::time::Instant;

/// A reference optimum: exact where the problem is convex, else a first-order point.
#[derive(Clone, Debug)]
pub struct Optimum {
    /// The line's variables.
    pub x: Vec<f64>,
    /// The objective, computed from the line itself.
    pub value: f64,
    /// A bound on the objective that no line passes, if the problem is convex.
    pub lower_bound: Option<f64>,
    /// What the last cone program of a sequence promised still to gain, in the objective's unit; zero without one.
    pub promise: f64,
    /// How the solver ended.
    pub status: Status,
    /// The line's measures.
    pub measures: Measures,
    /// Cone programs solved.
    pub programs: usize,
    /// Steps of the solver in all of them.
    pub iterations: usize,
    /// Elapsed time (s).
    pub seconds: f64,
}

impl Optimum {
    /// What may be left to gain, as a share of the value: down to the lower bound where the problem is convex, and otherwise what the last
    /// cone program promised, which no step need keep.
    pub fn left(&self) -> f64 {
        let left = self.lower_bound.map_or(self.promise, |bound| self.value - bound);
        left.max(0.0) / self.value.abs()
    }
}

/// The shortest line: a second-order cone program, one cone for each segment. Its value is the length (m).
///
/// # Errors
/// [`Error::Input`] for bounds that do not fit, [`Error::Study`] if the solver refuses.
pub fn shortest(map: &LineMap, bounds: &Bounds) -> Result<Optimum> {
    check((map.variables(), map.points()), bounds)?;
    let n = map.variables();
    let (mut lower, mut upper) = (bounds.lower.clone(), bounds.upper.clone());
    let steps = steps(map);
    lower.extend(steps.iter().map(|_| f64::NEG_INFINITY));
    upper.extend(steps.iter().map(|_| f64::INFINITY));
    let mut program = ConicProgram::new(lower, upper);
    bounds.add_rows(&mut program, &vec![0.0; n]);
    for (s, [x, y]) in steps.into_iter().enumerate() {
        program.add_linear(n + s, 1.0);
        let length = Affine {
            constant: 0.0,
            terms: vec![(n + s, 1.0)],
        };
        program.add_cone([length, x, y]);
    }
    solve(map, &program, |problem, x| problem.measures(x).length_m)
}

/// The line of least squared length: a quadratic program. Its value is the sum of squares (m^2).
///
/// Source: Braghin, Cheli, Melzi, Sabbioni, *Race driver model*, Computers and Structures 86 (2008).
///
/// # Errors
/// [`Error::Input`] for bounds that do not fit, [`Error::Study`] if the solver refuses.
pub fn least_squared_length(map: &LineMap, bounds: &Bounds) -> Result<Optimum> {
    check((map.variables(), map.points()), bounds)?;
    let mut program = ConicProgram::new(bounds.lower.clone(), bounds.upper.clone());
    bounds.add_rows(&mut program, &vec![0.0; map.variables()]);
    for square in steps(map).into_iter().flatten() {
        program.add_square(square);
    }
    solve(map, &program, |problem, x| problem.measures(x).squared_length_m2)
}

/// The line of least Gamma, `sqrt(sum |z_i|^2)` with second differences `z_i` over a fixed `spacing_m` of the
/// segments: a quadratic program. Its value is Gamma (1/m).
///
/// The spacing is fixed while the steps of the line are not, so a line may gain by uneven steps. [`super::minimum_curvature`]
/// does not allow that gain.
///
/// # Errors
/// [`Error::Input`] for bounds or spacing that do not fit, [`Error::Study`] if the solver refuses.
pub fn least_gamma(map: &LineMap, spacing_m: &[f64], bounds: &Bounds) -> Result<Optimum> {
    check((map.variables(), map.points()), bounds)?;
    let steps = steps(map);
    if spacing_m.len() != steps.len() || !spacing_m.iter().all(|h| *h > 0.0) {
        return Err(Error::input(
            "the line",
            "spacing_m",
            format!("{} lengths", spacing_m.len()),
            format!("{} lengths above zero", steps.len()),
        ));
    }
    let mut program = ConicProgram::new(bounds.lower.clone(), bounds.upper.clone());
    bounds.add_rows(&mut program, &vec![0.0; map.variables()]);
    let pairs = (0..map.points()).filter_map(|i| {
        let before = if i > 0 {
            Some(i - 1)
        } else {
            map.closed.then(|| steps.len() - 1)
        };
        before.filter(|_| i < steps.len()).map(|before| (before, i))
    });
    for (before, after) in pairs {
        let (h0, h1) = (spacing_m[before], spacing_m[after]);
        let mean = 0.5 * (h0 + h1);
        for (there, here) in steps[after].iter().zip(&steps[before]) {
            let mut square = scaled(there, 1.0 / (h1 * mean));
            let other = scaled(here, -1.0 / (h0 * mean));
            square.constant += other.constant;
            square.terms.extend(other.terms);
            program.add_square(square.merged());
        }
    }
    let mut optimum = solve(map, &program, |problem, x| {
        let problem = ReferenceProblem {
            spacing_m: Some(spacing_m),
            ..*problem
        };
        problem.measures(x).gamma_1pm
    })?;
    // The program minimises the square.
    optimum.lower_bound = optimum.lower_bound.map(|square| square.max(0.0).sqrt());
    Ok(optimum)
}

/// Both coordinates of each segment (m) as affine functions of the variables.
fn steps(map: &LineMap) -> Vec<[Affine; 2]> {
    let n = map.points();
    let origins = map.line(&vec![0.0; map.variables()]);
    let axes = [|v: DVec2| v.x, |v: DVec2| v.y];
    let segments = if map.closed { n } else { n - 1 };
    let step = |s: usize| {
        let next = (s + 1) % n;
        axes.map(|axis| {
            let there = map.reach(next).iter().map(|&(k, reach)| (k, axis(reach)));
            let here = map.reach(s).iter().map(|&(k, reach)| (k, -axis(reach)));
            Affine {
                constant: axis(origins[next] - origins[s]),
                terms: there.chain(here).collect(),
            }
            .merged()
        })
    };
    (0..segments).map(step).collect()
}

fn scaled(map: &Affine, by: f64) -> Affine {
    Affine {
        constant: by * map.constant,
        terms: map.terms.iter().map(|&(k, a)| (k, by * a)).collect(),
    }
}

fn solve(
    map: &LineMap,
    program: &ConicProgram,
    value: impl Fn(&ReferenceProblem, &[f64]) -> f64,
) -> Result<Optimum> {
    let start = Instant::now();
    let mut solution = program.solve()?;
    solution.x.truncate(map.variables());
    let problem = ReferenceProblem::of(map);
    Ok(Optimum {
        measures: problem.measures(&solution.x),
        programs: 1,
        value: value(&problem, &solution.x),
        x: solution.x,
        lower_bound: Some(solution.lower_bound),
        promise: 0.0,
        status: solution.status,
        iterations: solution.iterations,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// The lengths (m) of the segments of line `x`.
pub fn spacing_m(map: &LineMap, x: &[f64]) -> Vec<f64> {
    Shape::of(&map.line(x), map.closed).length_m
}
