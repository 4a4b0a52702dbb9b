//! The line of least lap time: a direct transcription, solved as a sequence of cone programs.

use super::bounds::{Bounds, check};
use super::conic::{Affine, ConicProgram, Status};
use super::convex::Optimum;
use super::geometry::{LineMap, Shape};
use super::lap::{Lap, Limits};
use super::objective::LineProblem;
use crate::{Error, Result};
use std::time::Instant;

/// When to stop, and how far to trust a linearisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FastestSettings {
    /// Cone programs.
    pub programs: usize,
    /// The sequence ends when no step within reach promises more than this share of the time.
    pub least_gain: f64,
    /// First weight of the distance from the line that a step starts at.
    pub caution: f64,
}

impl Default for FastestSettings {
    fn default() -> Self {
        Self {
            programs: 60,
            least_gain: 1e-6,
            caution: 1.0,
        }
    }
}

/// Relative accuracy of a program.
const PROGRAM_TOLERANCE: f64 = 1e-8;
/// Share of the promise below which a step is taken back and the next one halved.
const LEAST_KEPT: f64 = 0.1;
/// Share of the promise above which the next step may be twice as long.
const WELL_KEPT: f64 = 0.7;
/// Caution beyond which nothing but rounding is left.
const MOST_CAUTION: f64 = 1e7;

/// The fastest line, from `start`: its value is the lap time (s).
///
/// Line and speeds are free together: the squares of the speeds at the points, tyres within the ellipse at the middle of each
/// segment, corner speeds at the points. The demand on the tyres, linear about the last line, stays inside the ellipse,
/// which is kept as the cone that it is, so that a step sees every limit that it may run into and kinks do no harm; the time's
/// second derivative by the speeds is kept too. Steps are judged by the exact lap of the line that they lead to.
/// The sequence ends where no step promises anything: a point that meets the first-order conditions.
///
/// Sources: Lewis, Wright, *A proximal method for composite minimization*, Mathematical Programming 158 (2016) (steps);
/// Perantoni, Limebeer, *Optimal control for a Formula One car with variable parameters*, Vehicle System Dynamics 52 (2014)
/// (minimum-time laps by transcription).
///
/// # Errors
/// [`Error::Input`] for bounds that do not fit or a problem without a car, [`Error::Study`] if the solver refuses.
pub fn fastest(
    problem: &LineProblem,
    bounds: &Bounds,
    start: &[f64],
    settings: &FastestSettings,
) -> Result<Optimum> {
    let map = problem.map;
    check(map, bounds)?;
    let limits = problem
        .limits
        .ok_or_else(|| Error::input("the line", "limits", "none", "a car, for its lap time"))?;
    let clock = Instant::now();
    let drive = |x: &[f64]| {
        let shape = Shape::of(&map.line(x), map.closed);
        let lap = Lap::of(&shape, limits, problem.start_mps);
        (shape, lap)
    };
    let mut x = bounds.inside(start);
    let (mut shape, mut lap) = drive(&x);
    let (mut iterations, mut caution) = (0, settings.caution);
    let mut status = Status::Failed(format!("{} programs without an end", settings.programs));
    for _ in 0..settings.programs {
        let program = step_program(map, limits, &shape, &lap, bounds, &x, caution);
        let solution = program.solve()?;
        iterations += solution.iterations;
        let step = &solution.x[..x.len()];
        let trial: Vec<f64> = x.iter().zip(step).map(|(x, d)| x + d).collect();
        let promise = -program.value(&solution.x);
        let (trial_shape, trial_lap) = drive(&trial);
        let gain = lap.time_s - trial_lap.time_s;
        if std::env::var("OPT_TRACE").is_ok() {
            println!(
                "{:?} {} {promise:.6} {gain:.6} caution {caution:.4} time {:.6}",
                solution.status, solution.iterations, lap.time_s
            );
        }
        if promise <= settings.least_gain * lap.time_s {
            status = solution.status;
            break;
        }
        if gain >= LEAST_KEPT * promise {
            (x, shape, lap) = (trial, trial_shape, trial_lap);
            if gain >= WELL_KEPT * promise {
                caution *= 0.4;
            }
        } else {
            caution *= 4.0;
        }
        if caution > MOST_CAUTION {
            status = Status::Almost("steps too short to tell a gain from rounding".to_owned());
            break;
        }
    }
    Ok(Optimum {
        x,
        value: lap.time_s,
        lower_bound: None,
        status,
        iterations,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// The best step of line and speeds from here. Variables: changes of the line's, then relative changes of the squared
/// speeds at its points.
fn step_program(
    map: &LineMap,
    limits: &dyn Limits,
    shape: &Shape,
    lap: &Lap,
    bounds: &Bounds,
    x: &[f64],
    caution: f64,
) -> ConicProgram {
    let (variables, n) = (x.len(), map.points());
    let speed: Vec<f64> = lap.square.iter().map(|e| e.sqrt()).collect();
    let top = limits.top_speed_mps().powi(2);
    let mut lower: Vec<f64> = bounds
        .lower
        .iter()
        .zip(x)
        .map(|(l, x)| (l - x).min(0.0))
        .collect();
    let mut upper: Vec<f64> = bounds
        .upper
        .iter()
        .zip(x)
        .map(|(u, x)| (u - x).max(0.0))
        .collect();
    for (i, e) in lap.square.iter().enumerate() {
        // The start of an open line is given, and so is a standstill.
        let held = *e <= 0.0 || (!map.closed && i == 0);
        lower.push(if held { 0.0 } else { -0.9 });
        upper.push(if held { 0.0 } else { top / e - 1.0 });
    }
    let mut program = ConicProgram::new(lower, upper).with_tolerance(PROGRAM_TOLERANCE);
    bounds.add_rows(&mut program, x);
    let square = |i: usize| variables + i;
    for (s, h) in shape.length_m.iter().enumerate() {
        let next = (s + 1) % n;
        let sum = speed[s] + speed[next];
        let mut by_length = Vec::new();
        shape.add_length(map, s, 2.0 / sum, &mut by_length);
        for (k, slope) in by_length {
            program.add_linear(k, slope);
        }
        // dT/de = -h/(S^2 v); half of d2T/de2 is the squares' sum.
        let both = (0.5 * h / sum.powi(3)).sqrt();
        let mut terms = Vec::new();
        for i in [s, next].into_iter().filter(|i| speed[*i] > 0.0) {
            program.add_linear(square(i), -h * speed[i] / (sum * sum));
            terms.push((square(i), both * speed[i]));
            program.add_square(Affine {
                constant: 0.0,
                terms: vec![(square(i), 0.5 * (h * speed[i]).sqrt() / sum)],
            });
        }
        program.add_square(Affine { constant: 0.0, terms });
    }
    for s in 0..shape.length_m.len() {
        add_segment(&mut program, map, limits, shape, &lap.square, s);
    }
    for i in 0..n {
        let grip = limits.at(speed[i].max(f64::MIN_POSITIVE)).lateral;
        let used = shape.curvature_1pm[i] * lap.square[i] / grip.value;
        let by_square = used * (1.0 - 0.5 * speed[i] * grip.by_speed / grip.value);
        // What a linear model of grip leaves out is the product of the relative changes of curvature and speed squared, and it
        // costs at most half the time spent here times that product; of which the squares are a bound.
        let time = shape.spacing_m[i] / speed[i].max(1.0);
        let weight = (0.25 * caution * time).sqrt();
        let mut bend = Vec::new();
        shape.add_curvature(map, i, weight * lap.square[i] / grip.value, &mut bend);
        for terms in [bend, vec![(square(i), weight)]] {
            let constant = 0.0;
            program.add_square(Affine { constant, terms }.merged());
        }
        // To either side: on a straight a step may bend the line both ways.
        for sign in [1.0, -1.0] {
            let mut terms = vec![(square(i), -sign * by_square)];
            shape.add_curvature(map, i, -sign * lap.square[i] / grip.value, &mut terms);
            let constant = (1.0 - sign * used).max(0.0);
            program.add_nonnegative(Affine { constant, terms }.merged());
        }
    }
    program
}

/// Keeps the tyres of segment `s` within the ellipse and the drive train within its power.
fn add_segment(
    program: &mut ConicProgram,
    map: &LineMap,
    limits: &dyn Limits,
    shape: &Shape,
    squares: &[f64],
    s: usize,
) {
    let (n, variables) = (map.points(), map.variables());
    let next = (s + 1) % n;
    let (e0, e1, h) = (squares[s], squares[next], shape.length_m[s]);
    let middle = 0.5 * (e0 + e1);
    let v = middle.sqrt().max(f64::MIN_POSITIVE);
    let grip = limits.at(v);
    let per_square = 0.5 / v;
    let curvature = 0.5 * (shape.curvature_1pm[s] + shape.curvature_1pm[next]);
    let acceleration = 0.5 * (e1 - e0) / h;
    let demand = acceleration + grip.drag.value;
    // Terms of a quantity that changes with the speeds at both ends, the segment's length and the curvature at both ends.
    let terms = |by_start: f64, by_end: f64, by_length: f64, by_curvature: f64| {
        let mut terms = vec![(variables + s, e0 * by_start), (variables + next, e1 * by_end)];
        shape.add_length(map, s, by_length, &mut terms);
        if by_curvature != 0.0 {
            shape.add_curvature(map, s, 0.5 * by_curvature, &mut terms);
            shape.add_curvature(map, next, 0.5 * by_curvature, &mut terms);
        }
        terms
    };
    let affine = |constant: f64, terms| Affine { constant, terms }.merged();
    let along = grip.longitudinal.value;
    // Half of what a change at the middle does belongs to each end.
    let slope = 0.5 * per_square * (grip.drag.by_speed - demand * grip.longitudinal.by_speed / along) / along;
    let by_length = -acceleration / (h * along);
    let longitudinal = affine(
        demand / along,
        terms(
            slope - 0.5 / (h * along),
            slope + 0.5 / (h * along),
            by_length,
            0.0,
        ),
    );
    let across = grip.lateral.value;
    let used = curvature * middle / across;
    let slope = 0.5 * (curvature / across - used * per_square * grip.lateral.by_speed / across);
    let lateral = affine(used, terms(slope, slope, 0.0, middle / across));
    // A segment beyond the ellipse by rounding, or by what the midpoint of a coasting one leaves, may stay there.
    let size = longitudinal.constant.hypot(lateral.constant).max(1.0);
    let whole = affine(size, Vec::new());
    program.add_cone([whole, longitudinal, lateral]);
    let slope = 0.5 * per_square * (grip.drive.by_speed - grip.drag.by_speed) / along;
    let spare = affine(
        ((grip.drive.value - demand) / along).max(0.0),
        terms(
            slope + 0.5 / (h * along),
            slope - 0.5 / (h * along),
            -by_length,
            0.0,
        ),
    );
    program.add_nonnegative(spare);
}
