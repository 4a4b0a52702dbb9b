//! The line of least integral of squared curvature, by a sequence of quadratic programs.

use super::bounds::{Bounds, check};
use super::conic::{Affine, ConicProgram, Status};
use super::convex::Optimum;
use super::geometry::{LineMap, Shape};
use crate::Result;
use std::time::Instant;

/// A sequence ends when a step gains less than this share of the integral.
const LEAST_GAIN: f64 = 1e-10;
/// Programs after which a sequence is given up.
const MOST_PROGRAMS: usize = 200;

/// The line of least integral of squared curvature (1/m), true turning angle over true spacing.
///
/// Gauss-Newton steps on the residuals `turn / sqrt(spacing)`, each a quadratic program within `bounds`, damped as by
/// Levenberg and Marquardt: a step that gains is followed by a bolder one, one that loses is taken back.
/// The problem is not convex, so this is a local optimum from `start`; several starts tell whether there are others.
///
/// # Errors
/// [`crate::Error::Input`] for bounds that do not fit, [`crate::Error::Study`] if the solver refuses.
pub fn least_curvature(map: &LineMap, bounds: &Bounds, start: &[f64]) -> Result<Optimum> {
    check(map, bounds)?;
    let clock = Instant::now();
    let mut x = bounds.inside(start);
    let mut shape = Shape::of(&map.line(&x), map.closed);
    let mut value = integral(&shape);
    let mut iterations = 0;
    let mut damping = 1e-3 * value / x.len() as f64;
    let mut status = Status::Failed(format!("{MOST_PROGRAMS} programs without an end"));
    for _ in 0..MOST_PROGRAMS {
        let lower = bounds.lower.iter().zip(&x).map(|(l, x)| l - x).collect();
        let upper = bounds.upper.iter().zip(&x).map(|(u, x)| u - x).collect();
        let mut program = ConicProgram::new(lower, upper);
        bounds.add_rows(&mut program, &x);
        for residual in residuals(map, &shape) {
            program.add_square(residual);
        }
        for k in 0..x.len() {
            program.add_square(Affine {
                constant: 0.0,
                terms: vec![(k, damping.sqrt())],
            });
        }
        let solution = program.solve()?;
        iterations += solution.iterations;
        let trial: Vec<f64> = x.iter().zip(&solution.x).map(|(x, d)| x + d).collect();
        let trial_shape = Shape::of(&map.line(&trial), map.closed);
        let trial_value = integral(&trial_shape);
        let gain = value - trial_value;
        if gain > 0.0 {
            (x, shape, value) = (trial, trial_shape, trial_value);
            damping *= 0.1;
        } else {
            damping *= 10.0;
        }
        if gain.abs() <= LEAST_GAIN * value {
            status = solution.status;
            break;
        }
        if let Status::Failed(_) = solution.status {
            status = solution.status;
            break;
        }
    }
    Ok(Optimum {
        x,
        value,
        lower_bound: None,
        status,
        iterations,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

fn integral(shape: &Shape) -> f64 {
    shape
        .turn_rad
        .iter()
        .zip(&shape.curvature_1pm)
        .map(|(turn, k)| turn * k)
        .sum()
}

/// `turn / sqrt(spacing)` at every point with two neighbours, linear in the change of the variables.
fn residuals<'a>(map: &'a LineMap, shape: &'a Shape) -> impl Iterator<Item = Affine> + 'a {
    let n = map.points();
    (0..n).filter_map(move |i| {
        let (Some(before), Some(after)) = shape.neighbours(i) else {
            return None;
        };
        let spacing = shape.spacing_m[i];
        let mut terms = Vec::new();
        shape.add_turn(map, i, 1.0 / spacing.sqrt(), &mut terms);
        for segment in [before, after] {
            // The spacing is half the sum of both lengths, and the residual has its root below.
            shape.add_length(
                map,
                segment,
                -0.25 * shape.turn_rad[i] * spacing.powf(-1.5),
                &mut terms,
            );
        }
        let map = Affine {
            constant: shape.turn_rad[i] / spacing.sqrt(),
            terms,
        };
        Some(map.merged())
    })
}
