//! The surface of lateral acceleration over speed and steering, and its ridge: a population of cars in steady-state cornering,
//! held against the curves of trims.

use super::{EnvelopeStudy, Outcome, Prepared};
use crate::error::Result;
use crate::evaluate::steady::{SteadyObjective, SteadyProblem, open_steady_evaluator};
use crate::evaluate::{Evaluation, Evaluator, Failure, add_failures};
use crate::study::framework::journal::Recorder;
use crate::study::framework::{Inputs, Progress, RunRecord, Study, Watch, Work};
use crate::vehicle::limits::{CarEnvelope, EnvelopeAtSpeed, STEER_TO_GRIP, car_envelope};
use crate::vehicle::{Car, steady_car};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Cars of one call of the evaluator: enough to fill any device for a moment, few enough to be interrupted.
const BATCH: usize = 1 << 14;
/// What is asked of each trim, in the order of [`SteadySurface::figures`].
pub(super) const OBJECTIVES: [SteadyObjective; 5] = SteadyObjective::ALL;

/// The most lateral acceleration at one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RidgePoint {
    /// Speed (m/s).
    pub v_mps: f64,
    /// Steering angle there (rad).
    pub steer_rad: f64,
    /// Lateral acceleration (m/s^2).
    pub ay_mps2: f64,
    /// What the grid's steps and the settling leave open of it (m/s^2); nothing where the grid does not surround the ridge: at
    /// the lock, or where cars beyond it spin.
    pub tolerance_mps2: Option<f64>,
    /// The same from the curve of trims (m/s^2), as far as the lock.
    pub exact_mps2: Option<f64>,
}

/// What the population found.
#[derive(Clone, Debug)]
pub struct SteadySurface {
    /// Speeds (m/s), those of the limits.
    pub speeds: Vec<f64>,
    /// Steering angles (rad), even.
    pub steers: Vec<f64>,
    /// Lateral acceleration (m/s^2), magnitudes of sideslip (rad), yaw rate (rad/s), roll (rad) and slip ratio, each row by row
    /// of speed; not a number where the car failed.
    pub figures: [Vec<f64>; 5],
    /// Why a car failed.
    pub failures: Vec<Option<Failure>>,
    /// The ridge, speed by speed.
    pub ridge: Vec<RidgePoint>,
    /// What it comes to.
    pub summary: SurfaceFigures,
}

/// How the surface compares with the curves of trims.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SurfaceFigures {
    /// Greatest difference of a lateral acceleration from the curves of trims (m/s^2), wherever the two have the same angle.
    pub surface_difference_mps2: Option<f64>,
    /// Speeds at which the grid surrounds the ridge.
    pub ridge_speeds: usize,
    /// Greatest difference there of the ridge from that of the curves (m/s^2).
    pub ridge_difference_mps2: Option<f64>,
    /// What the grid's steps and the settling leave open there (m/s^2).
    pub ridge_tolerance_mps2: Option<f64>,
    /// Whether the ridges differ by no more than that at any speed.
    pub ridge_agrees: bool,
}

/// The greatest of `values` over the ascending `x`: where, how much, and by how much a curve through them may be above it.
///
/// A parabola through the greatest and its neighbours gives place and figure. Where the curve is bent one way about its peak, it
/// lies below the chord of the two points before it and below that of the two points behind it, carried on.
fn ridge_of(x: &[f64], values: &[f64]) -> Option<(f64, f64, Option<f64>)> {
    let at = |i: usize| values.get(i).copied().filter(|z| z.is_finite());
    let top = (0..values.len())
        .filter(|i| values[*i].is_finite())
        .max_by(|i, j| values[*i].total_cmp(&values[*j]))?;
    let (Some(left), Some(right)) = (top.checked_sub(1).and_then(at), at(top + 1)) else {
        return Some((x[top], values[top], None));
    };
    let z = values[top];
    let slope = |i: usize, a: f64, b: f64| (b - a) / (x[i + 1] - x[i]);
    let (rise, fall) = (slope(top - 1, left, z), slope(top, z, right));
    // Divided differences: z + d rise + d (d + h) bend, about the top.
    let (before, after) = (x[top] - x[top - 1], x[top + 1] - x[top]);
    let bend = (fall - rise) / (before + after);
    let shift = if bend < 0.0 {
        (-0.5 * (rise / bend + before)).clamp(-before, after)
    } else {
        0.0
    };
    let peak = z + shift * rise + shift * (shift + before) * bend;
    // On either side, where the two chords meet.
    let above = |width: f64, up: f64, edge: f64, down: Option<f64>| match down {
        // From the top up, and from the far point of the cell up towards the top.
        Some(down) if up + down > 0.0 => {
            let share = ((edge - z + down * width) / ((up + down) * width)).clamp(0.0, 1.0);
            up * share * width
        }
        _ => up * width,
    };
    let beyond = at(top + 2).map(|z| -slope(top + 1, right, z));
    let behind = top.checked_sub(2).and_then(at).map(|z| slope(top - 2, z, left));
    let up_right = rise.max(0.0);
    let up_left = (-fall).max(0.0);
    let slack = above(after, up_right, right, beyond.map(|d| d.max(0.0))).max(above(
        before,
        up_left,
        left,
        behind.map(|d| d.max(0.0)),
    ));
    Some((x[top] + shift, peak.min(z + slack), Some(slack)))
}

/// Works the limits out and settles a population of their speeds by even steering angles up to the car's lock; nothing if the
/// observer ends it.
///
/// # Errors
/// As [`car_envelope`]; [`crate::Error::Input`] if the journal belongs to other inputs; those of the evaluator.
pub(super) fn measure(work: Work<'_, EnvelopeStudy>) -> Result<Option<Outcome>> {
    let watch = Watch::begin();
    let settings = work.settings;
    let Prepared { car, speeds, log } = work.prepared;
    // Refuses a car that has no drive at these speeds.
    let limits = car_envelope(car, &settings.range(Some(car)))?;
    let lock = car.max_steer_rad.min(STEER_TO_GRIP);
    let last = settings.steers - 1;
    let steers: Vec<f64> = (0..=last).map(|i| lock * i as f64 / last as f64).collect();
    let bounds = [speeds[0], speeds[speeds.len() - 1]];
    let problem = SteadyProblem::new(car.clone(), Vec::new(), bounds, [0.0, lock], &OBJECTIVES)?;
    let population: Vec<f64> = speeds
        .iter()
        .flat_map(|v| steers.iter().flat_map(|d| [*v, *d]))
        .collect();
    let all = (speeds.len() * steers.len()) as u64;
    let mut evaluator = open_steady_evaluator(&problem, settings.backend, settings.adapter.as_deref())?;
    let mut recorder = Recorder::of(EnvelopeStudy::NAME, settings, work.state, work.state_file)?;
    let mut inputs = Inputs::new(EnvelopeStudy::NAME);
    inputs.add(&(car, speeds, settings.steers));
    if let Some(log) = log {
        inputs.add(&(&log.vx_mps, &log.ay_mps2, &log.ax_mps2));
    }
    recorder.begin(inputs.key(), &evaluator.backend())?;
    let mut record = RunRecord::of(&evaluator.backend());
    let began = Instant::now();
    let mut found = Evaluation::default();
    for batch in population.chunks(2 * BATCH) {
        let done = found.failures.len() as u64;
        if (work.observe)(&Progress::counted(done, all)).is_break() {
            recorder.save()?;
            return Ok(None);
        }
        let answer = recorder.over(evaluator.as_mut()).evaluate(batch)?;
        add_failures(&mut record.failures, &answer.failure_counts());
        found.objectives.extend(answer.objectives);
        found.failures.extend(answer.failures);
    }
    let busy_s = began.elapsed().as_secs_f64();
    let surface = compared(car, &limits, &problem, steers, found);
    recorder.complete(&mut record);
    record.took(all, watch.elapsed_s(), busy_s);
    record.longest_dispatch_ms = watch.longest_dispatch_ms();
    Ok(Some(Outcome {
        limits,
        surface,
        record,
    }))
}

/// The surface beside the curves of trims.
fn compared(
    car: &Car,
    limits: &CarEnvelope,
    problem: &SteadyProblem,
    steers: Vec<f64>,
    found: Evaluation,
) -> SteadySurface {
    let lock = steers.last().copied().unwrap_or(STEER_TO_GRIP);
    let figure = |k: usize| -> Vec<f64> {
        let rows = found
            .objectives
            .chunks_exact(OBJECTIVES.len())
            .zip(&found.failures);
        rows.map(|(row, failure)| match failure {
            Some(_) => f64::NAN,
            // The first is a lateral acceleration with its sign changed.
            None if k == 0 => -row[k],
            None => row[k],
        })
        .collect()
    };
    let figures: [Vec<f64>; 5] = std::array::from_fn(figure);

    let steady = steady_car(car);
    let rows: Vec<(&EnvelopeAtSpeed, &[f64])> = limits
        .speeds
        .iter()
        .zip(figures[0].chunks_exact(steers.len()))
        .collect();
    let compared: Vec<(Option<RidgePoint>, Option<f64>)> = rows
        .par_iter()
        .map(|(limits, ay)| {
            let v = limits.row.v_mps;
            let curve = &limits.cornering;
            let at = |steer: f64| steady.trim_at(v, steer, curve);
            let off = steers
                .iter()
                .zip(ay.iter())
                .filter_map(|(steer, ay)| Some((at(*steer)?.ay_mps2 - ay).abs()))
                .filter(|off| off.is_finite())
                .reduce(f64::max);
            let exact = steady.greatest_cornering(v, lock, curve);
            let ridge = ridge_of(&steers, ay).map(|(steer_rad, ay_mps2, slack)| RidgePoint {
                v_mps: v,
                steer_rad,
                ay_mps2,
                tolerance_mps2: slack.and_then(|slack| Some(slack + problem.left_open_at(v, &exact?)?)),
                exact_mps2: exact.map(|t| t.ay_mps2),
            });
            (ridge, off)
        })
        .collect();
    let ridge: Vec<RidgePoint> = compared.iter().filter_map(|(r, _)| *r).collect();
    // Of those that the grid surrounds, difference and tolerance.
    let differences: Vec<[f64; 2]> = ridge
        .iter()
        .filter_map(|r| Some([(r.ay_mps2 - r.exact_mps2?).abs(), r.tolerance_mps2?]))
        .collect();
    let greatest = |k: usize| differences.iter().map(|d| d[k]).reduce(f64::max);
    let summary = SurfaceFigures {
        surface_difference_mps2: compared.iter().filter_map(|(_, off)| *off).reduce(f64::max),
        ridge_speeds: differences.len(),
        ridge_difference_mps2: greatest(0),
        ridge_tolerance_mps2: greatest(1),
        ridge_agrees: differences.iter().all(|[off, tolerance]| off <= tolerance),
    };
    SteadySurface {
        speeds: limits.speeds.iter().map(|s| s.row.v_mps).collect(),
        steers,
        figures,
        failures: found.failures,
        ridge,
        summary,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola is found exactly wherever its peak lies between the grid's points, and is never above what the slack allows.
    #[test]
    fn the_ridge_of_a_parabola_is_found_between_points() {
        for i in 0..20 {
            let peak = 0.31 + 0.01 * f64::from(i);
            let curve = |x: f64| 15.0 - 40.0 * (x - peak).powi(2);
            let x: Vec<f64> = (0..12).map(|i| 0.1 * f64::from(i)).collect();
            let z: Vec<f64> = x.iter().map(|x| curve(*x)).collect();
            let (at, top, slack) = ridge_of(&x, &z).unwrap();
            assert!(
                (at - peak).abs() < 1e-12 && (top - 15.0).abs() < 1e-12,
                "{at} {top}"
            );
            let greatest = z.iter().copied().fold(0.0, f64::max);
            let slack = slack.unwrap();
            // The chords' crossing is at most a cell's worth of slope above: 40 (0.15^2 - 0.05^2) for a step of 0.1.
            assert!(
                greatest + slack >= 15.0 && slack <= 0.8 + 1e-12,
                "{greatest} {slack}"
            );
        }
    }

    #[test]
    fn a_ridge_at_an_edge_is_not_resolved() {
        let x = [0.0, 1.0, 2.0, 3.0];
        let nan = f64::NAN;
        assert_eq!(ridge_of(&x, &[0.0, 1.0, 2.0, 3.0]), Some((3.0, 3.0, None)));
        assert_eq!(ridge_of(&x, &[0.0, 1.0, 2.0, nan]), Some((2.0, 2.0, None)));
        assert_eq!(ridge_of(&x, &[nan; 4]), None);
    }
}
