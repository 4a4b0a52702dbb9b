//! Local optima of curvature, lap time and weighted sums, by sequences of cone programs.

use super::bounds::{Bounds, check};
use super::conic::{Affine, ConicProgram, Status};
use super::convex::Optimum;
use super::geometry::{LineMap, Shape};
use super::lap::Lap;
use super::objective::{Measures, ReferenceProblem, Weights};
use super::time_model::add_time;
use crate::{Error, Result};
use glam::DVec2;
use rayon::prelude::*;
use std::time::Instant;

/// When to stop, and how large the first step may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DescentSettings {
    /// Most cone programs. Three bring a smooth line within some parts in a thousand of its optimum.
    pub programs: usize,
    /// The sequence ends when no step predicts a gain above this share of the cost.
    pub least_gain: f64,
    /// First weight of the distance from the line that a step starts at. At 1 it outweighs, for lap time, what a step's
    /// model leaves out.
    pub caution: f64,
    /// What changes of lateral acceleration count beside the lap time (s), where that counts: so much for one of 1 g within 10 m. Where
    /// the tyres have grip to spare, a line may turn to and fro at no cost; with a little of this it does not.
    pub roughness_s: f64,
}

impl DescentSettings {
    /// Those that lead any line to its optimum.
    pub const USUAL: Self = Self {
        programs: 60,
        least_gain: 1e-6,
        caution: 1.0,
        roughness_s: 0.0,
    };
}

impl Default for DescentSettings {
    fn default() -> Self {
        Self::USUAL
    }
}

/// A line and the weights that judge it.
#[derive(Clone, Debug)]
pub struct Start {
    /// The line's variables.
    pub x: Vec<f64>,
    /// What counts, and how much.
    pub weights: Weights,
}

/// Relative accuracy of a program at the least, and as a share of the gain that ends the sequence.
const PROGRAM_TOLERANCE: f64 = 1e-8;
const TOLERANCE_OF_GAIN: f64 = 0.025;
/// What a program may leave to gain, as a share of the gain that ends the sequence.
const GAP_OF_GAIN: f64 = 0.05;
/// Share of the predicted gain below which a step is rejected.
const LEAST_KEPT: f64 = 0.1;
/// Share of the predicted gain above which the penalty on the next step is reduced.
const WELL_KEPT: f64 = 0.7;
/// Factors on the penalty after a rejected step and after a good one.
const CAUTION: (f64, f64) = (4.0, 0.4);
/// Penalty at which a small promise means that the first-order conditions are met. A greater one makes any promise small.
const UNIT_CAUTION: f64 = 1.0;
/// Parts of a step that are tried where the whole of it loses, besides half of it.
const PARTS: [f64; 4] = [0.25, 0.0625, 0.015_625, 0.003_906_25];
/// Programs of unit caution that judge a line at most: each whose step gains is followed by others.
const JUDGED: usize = 3;
/// Share of the cost that parts of a rejected step may gain where the line counts as solved: a hundredth of the 0.05 % that a
/// line is asked to be near the optimum.
const JUDGED_GAIN: f64 = 5e-6;
/// Penalty beyond which only rounding is left to gain.
const MOST_CAUTION: f64 = 1e7;
/// Weight of the squared step of a variable at a penalty of 1, as a share of the cost over the number of variables.
const DAMPING: f64 = 1e-3;

/// Improves a line from `x` until no step predicts a gain: a point that meets the first-order conditions.
///
/// Each step solves a cone program in line and speeds together. The tyres' demand, linear about the last line, stays inside the
/// friction ellipse. The ellipse is kept as a cone, so a step sees every limit that it may meet, and kinks do no harm. The other
/// measures have their exact gradient and a positive semidefinite part of their second derivative (Gauss-Newton). A penalty on
/// the distance from the last line accounts for what the model leaves out. Steps are judged by the exact measures of the new
/// line, so no line ends worse than it starts.
///
/// The optimum's value is the weighted cost.
///
/// Sources: Lewis, Wright, *A proximal method for composite minimization*, Mathematical Programming 158 (2016) (steps);
/// Perantoni, Limebeer, *Optimal control for a Formula One car with variable parameters*, Vehicle System Dynamics 52
/// (2014) (minimum-time laps by transcription).
///
/// # Errors
/// [`Error::Input`] for bounds or weights that do not fit, or time without a car; [`Error::Study`] if the solver refuses.
pub fn descend(
    problem: &ReferenceProblem,
    bounds: &Bounds,
    start: &Start,
    settings: &DescentSettings,
) -> Result<Optimum> {
    check((problem.map.variables(), problem.map.points()), bounds)?;
    check_start(problem, start)?;
    let clock = Instant::now();
    let weights = &start.weights;
    let judge = Judge {
        problem,
        weights,
        roughness_s: settings.roughness_s,
    };
    let mut here = judge.place(bounds.inside(&start.x)?);
    let (mut iterations, mut programs, mut caution) = (0, 0, settings.caution);
    // How the sequence ended before its last program, how the latest program failed, and what the latest of the others promised.
    let (mut ended, mut failure, mut promise) = (None, None, 0.0f64);
    // Whether the next program says that the first-order conditions are met, and how many have been asked to.
    let (mut judging, mut judged) = (false, 0);
    if !here.cost.is_finite() {
        let found = "two points in one place, or a car that stands still";
        return Err(Error::input(
            "the line",
            "start",
            found,
            "a line that can be driven",
        ));
    }
    while programs < settings.programs {
        if problem.stopped() {
            ended = Some(Status::Failed("interrupted".to_owned()));
            break;
        }
        let tolerance = PROGRAM_TOLERANCE.max(TOLERANCE_OF_GAIN * settings.least_gain);
        let gap = GAP_OF_GAIN * settings.least_gain * here.cost.abs();
        let program = here.program(&judge, bounds, caution).for_step(tolerance, gap);
        let solution = program.solve()?;
        programs += 1;
        iterations += solution.iterations;
        let failed = matches!(solution.status, Status::Failed(_));
        failure = failed.then(|| solution.status.clone());
        if !failed {
            promise = -program.value(&solution.x);
        }
        if failed && judging {
            break;
        }
        if !failed && promise <= settings.least_gain * here.cost.abs() {
            if caution <= UNIT_CAUTION {
                ended = Some(solution.status);
                break;
            }
            if judged == JUDGED {
                ended = Some(Status::Almost(format!(
                    "steps of unit caution still gained after {JUDGED} trials"
                )));
                break;
            }
            // A great caution makes any promise small: the step of unit caution judges.
            (caution, judging) = (UNIT_CAUTION, true);
            judged += 1;
            continue;
        }
        let moved = here
            .x
            .iter()
            .zip(&solution.x)
            .zip(bounds.lower.iter().zip(&bounds.upper));
        let trial: Vec<f64> = moved.map(|((x, d), (l, u))| (x + d).clamp(*l, *u)).collect();
        let mut there = judge.place(trial);
        let whole = here.cost - there.cost;
        let well_kept = !failed && whole >= WELL_KEPT * promise;
        let kept = !failed && whole >= LEAST_KEPT * promise;
        // Where the whole step loses what its model leaves out, parts of it may gain: they cost nothing beside a program.
        if !failed && !kept {
            let part = here.part_of(&judge, &there.x);
            if part.cost < there.cost {
                there = part;
            }
        }
        let gain = here.cost - there.cost;
        let gained = gain / here.cost.abs();
        if !failed && gain > 0.0 {
            here = there;
        }
        if judging && !kept {
            ended = Some(if gained <= settings.least_gain.max(JUDGED_GAIN) {
                solution.status
            } else {
                Status::Almost(format!(
                    "a part of the last step still gained {gained:.1e} of the cost"
                ))
            });
            break;
        }
        judging = false;
        if well_kept {
            caution *= CAUTION.1;
        } else if !kept {
            caution *= CAUTION.0;
        }
        if caution > MOST_CAUTION {
            if !failed {
                ended = Some(Status::Almost(
                    "steps too short to tell a gain from rounding".to_owned(),
                ));
            }
            break;
        }
    }
    let left = promise.max(0.0) / here.cost.abs();
    let status = ended.or(failure).unwrap_or_else(|| {
        Status::Almost(format!(
            "{programs} cone programs at the most, the last of which promised a gain of {:.2} %",
            100.0 * left
        ))
    });
    Ok(Optimum {
        measures: problem.measures(&here.x),
        value: weights.sum(&here.measures),
        x: here.x,
        lower_bound: None,
        promise,
        status,
        programs,
        iterations,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// [`descend`] for many lines at once. The results keep the order of the starts and do not depend on the threads.
///
/// # Errors
/// Those of [`descend`].
pub fn polish_lines(
    problem: &ReferenceProblem,
    bounds: &Bounds,
    starts: &[Start],
    settings: &DescentSettings,
) -> Result<Vec<Optimum>> {
    let polish = |start: &Start| descend(problem, bounds, start, settings);
    starts.par_iter().map(polish).collect()
}

/// The fastest line from `x`. Its value is the lap time (s).
///
/// # Errors
/// Those of [`descend`].
pub fn fastest(
    problem: &ReferenceProblem,
    bounds: &Bounds,
    x: &[f64],
    settings: &DescentSettings,
) -> Result<Optimum> {
    let weights = Weights {
        time: 1.0,
        ..Weights::default()
    };
    descend(
        problem,
        bounds,
        &Start {
            x: x.to_vec(),
            weights,
        },
        settings,
    )
}

/// The line of least integral of squared curvature from `x`: true turning angle over true spacing. Its value is the
/// integral (1/m).
///
/// # Errors
/// Those of [`descend`].
pub fn minimum_curvature(map: &LineMap, bounds: &Bounds, x: &[f64]) -> Result<Optimum> {
    minimum_curvature_of(&ReferenceProblem::of(map), bounds, x)
}

/// The same of a problem that may be [stopped](ReferenceProblem::stop).
///
/// # Errors
/// Those of [`descend`].
pub fn minimum_curvature_of(problem: &ReferenceProblem, bounds: &Bounds, x: &[f64]) -> Result<Optimum> {
    let weights = Weights {
        curvature: 1.0,
        ..Weights::default()
    };
    let settings = DescentSettings {
        programs: 200,
        least_gain: 1e-10,
        ..DescentSettings::default()
    };
    descend(
        problem,
        bounds,
        &Start {
            x: x.to_vec(),
            weights,
        },
        &settings,
    )
}

fn check_start(problem: &ReferenceProblem, start: &Start) -> Result<()> {
    let n = problem.map.variables();
    if start.x.len() != n {
        let found = format!("{} variables", start.x.len());
        return Err(Error::input("the line", "start", found, format!("{n} variables")));
    }
    let w = start.weights;
    let all = [w.time, w.length, w.squared_length, w.gamma, w.curvature];
    if !all.iter().all(|w| *w >= 0.0 && w.is_finite()) || all.iter().all(|w| *w == 0.0) {
        let expected = "weights of zero or more, one of them more";
        return Err(Error::input("the line", "weights", format!("{w:?}"), expected));
    }
    if w.time > 0.0 && problem.envelope.is_none() {
        return Err(Error::input(
            "the line",
            "envelope",
            "none",
            "a car, for its lap time",
        ));
    }
    Ok(())
}

/// A line that a step starts from or leads to.
struct Place {
    x: Vec<f64>,
    shape: Shape,
    lap: Option<Lap>,
    measures: Measures,
    cost: f64,
}

/// What lines are judged by.
struct Judge<'a> {
    problem: &'a ReferenceProblem<'a>,
    weights: &'a Weights,
    roughness_s: f64,
}

/// The change of lateral acceleration that counts as [`DescentSettings::roughness_s`] (m/s^2), and the distance within which (m).
const ROUGH_MPS2: f64 = 9.80665;
const ROUGH_M: f64 = 10.0;

impl Judge<'_> {
    fn place(&self, x: Vec<f64>) -> Place {
        let (shape, lap, measures) = self.problem.judged(self.weights, &x);
        let rough: f64 = lap.as_ref().map_or(0.0, |lap| {
            let each = (0..shape.length_m.len()).map(|s| self.roughness(&shape, lap, s).1);
            each.map(|rough| rough * rough).sum()
        });
        let cost = self.weights.sum(&measures) + rough;
        Place {
            cost: if cost.is_finite() { cost } else { f64::INFINITY },
            x,
            shape,
            lap,
            measures,
        }
    }

    /// The square of the second is what segment `s` costs for its roughness (s); the first is its derivative by the difference of
    /// its ends' curvature.
    fn roughness(&self, shape: &Shape, lap: &Lap, s: usize) -> (f64, f64) {
        let next = (s + 1) % lap.square.len();
        let middle = 0.5 * (lap.square[s] + lap.square[next]);
        let scale = (self.roughness_s * ROUGH_M / shape.length_m[s]).sqrt() * middle / ROUGH_MPS2;
        (
            scale,
            scale * (shape.curvature_1pm[next] - shape.curvature_1pm[s]),
        )
    }
}

impl Place {
    /// The best of the lines on the way to another.
    fn part_of(&self, judge: &Judge, there: &[f64]) -> Self {
        let part = |share: &f64| {
            let ends = self.x.iter().zip(there);
            judge.place(ends.map(|(x, t)| x + share * (t - x)).collect())
        };
        let parts = PARTS.iter().map(part);
        parts.fold(
            part(&0.5),
            |best, next| if next.cost < best.cost { next } else { best },
        )
    }

    /// The program of the best step from here. Its variables are changes of the line's and, where time counts, relative
    /// changes of the squared speeds at its points.
    fn program(&self, judge: &Judge, bounds: &Bounds, caution: f64) -> ConicProgram {
        let (problem, weights) = (judge.problem, judge.weights);
        let (map, shape, x) = (problem.map, &self.shape, &self.x);
        let lower = bounds.lower.iter().zip(x).map(|(l, x)| (l - x).min(0.0));
        let upper = bounds.upper.iter().zip(x).map(|(u, x)| (u - x).max(0.0));
        let mut program = ConicProgram::new(lower.collect(), upper.collect());
        bounds.add_rows(&mut program, x);
        let smooth = Weights {
            time: 0.0,
            ..*weights
        };
        let (smooth_cost, gradient) = problem.cost(&smooth, x);
        for (k, slope) in gradient.into_iter().enumerate() {
            program.add_linear(k, slope);
        }
        let damping = (caution * DAMPING * smooth_cost / x.len() as f64).sqrt();
        if damping > 0.0 {
            for k in 0..x.len() {
                program.add_square(Affine::change(vec![(k, damping)]));
            }
        }
        let mut square = |terms| program.add_square(Affine::change(terms));
        for (s, h) in shape.length_m.iter().enumerate() {
            if weights.length > 0.0 {
                let mut terms = Vec::new();
                shape.add_heading(map, s, (0.5 * weights.length * h).sqrt(), &mut terms);
                square(terms);
            }
            for axis in [DVec2::X, DVec2::Y] {
                if weights.squared_length > 0.0 {
                    let mut terms = Vec::new();
                    Shape::add_step(map, s, axis * weights.squared_length.sqrt(), &mut terms);
                    square(terms);
                }
            }
        }
        let spacing = problem.spacing_m.unwrap_or(&shape.length_m);
        for i in 0..map.points() {
            let (Some(before), Some(after)) = shape.neighbours(i) else {
                continue;
            };
            if weights.curvature > 0.0 {
                // The residual whose square is summed is turn / sqrt(spacing).
                let (own, root) = (shape.spacing_m[i], weights.curvature.sqrt());
                let mut terms = Vec::new();
                shape.add_turn(map, i, root / own.sqrt(), &mut terms);
                for segment in [before, after] {
                    let scale = -0.25 * root * shape.turn_rad[i] * own.powf(-1.5);
                    shape.add_length(map, segment, scale, &mut terms);
                }
                square(terms);
            }
            if weights.gamma > 0.0 && self.measures.gamma_1pm > 0.0 {
                // A root lies below its tangent: G <= (G^2/G0 + G0)/2.
                let (h0, h1) = (spacing[before], spacing[after]);
                let scale = (0.5 * weights.gamma / self.measures.gamma_1pm).sqrt() * 2.0 / (h0 + h1);
                for axis in [DVec2::X, DVec2::Y] {
                    let mut terms = Vec::new();
                    Shape::add_step(map, after, axis * (scale / h1), &mut terms);
                    Shape::add_step(map, before, axis * (-scale / h0), &mut terms);
                    square(terms);
                }
            }
        }
        if let (Some(lap), Some(envelope)) = (&self.lap, problem.envelope) {
            add_time(&mut program, map, envelope, shape, lap, weights.time, caution);
            for s in (0..shape.length_m.len()).filter(|_| judge.roughness_s > 0.0) {
                let (scale, constant) = judge.roughness(shape, lap, s);
                let mut terms = Vec::new();
                shape.add_curvature(map, (s + 1) % map.points(), scale, &mut terms);
                shape.add_curvature(map, s, -scale, &mut terms);
                program.add_square(Affine { constant, terms }.merged());
            }
        }
        program
    }
}
