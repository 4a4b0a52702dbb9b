//! Minimisation in a box: limited-memory BFGS on the variables that are free to move.
//!
//! Sources: Bertsekas, *Projected Newton methods for optimization problems with simple constraints*, SIAM J. Control Optim. 20
//! (1982) (free variables, search along the projected path); Nocedal, Wright, *Numerical optimization*, 2nd ed., alg. 7.4
//! (two loops). The crates at hand do without bounds or without a line search that survives kinks.

use std::collections::VecDeque;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Evaluations of cost and gradient.
    pub evaluations: usize,
    /// A minimisation ends when [`PATIENCE`] steps together gain less than this share of the cost.
    pub least_gain: f64,
}

impl Default for Budget {
    fn default() -> Self {
        Self {
            evaluations: 2000,
            least_gain: 1e-7,
        }
    }
}

/// Steps over which the gain is judged.
pub const PATIENCE: usize = 10;
/// Pairs of steps and gradient changes that are remembered.
const MEMORY: usize = 20;
/// Share of the slope's promise that a step must keep (Armijo).
const KEPT: f64 = 1e-4;
/// Halvings of a step before its direction is given up.
const HALVINGS: usize = 25;

/// How a minimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// No free variable's gradient, or no gain worth the name, was left.
    Converged,
    /// No step downhill was found, as at a kink.
    Stuck,
    /// The budget was spent.
    Spent,
}

/// A minimum.
#[derive(Clone, Debug)]
pub(super) struct Minimum {
    pub x: Vec<f64>,
    pub cost: f64,
    pub ending: Ending,
    pub evaluations: usize,
}

struct Pair {
    step: Vec<f64>,
    change: Vec<f64>,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Minimises from `x` between `lower` and `upper`. `first_step` is the largest change of a variable in the first step.
pub(super) fn minimise(
    mut evaluate: impl FnMut(&[f64]) -> (f64, Vec<f64>),
    x: &[f64],
    lower: &[f64],
    upper: &[f64],
    first_step: f64,
    budget: &Budget,
) -> Minimum {
    let project = |x: Vec<f64>| -> Vec<f64> {
        let inside = x.into_iter().zip(lower).zip(upper);
        inside.map(|((x, l), u)| x.clamp(*l, *u)).collect()
    };
    let mut x = project(x.to_vec());
    let (mut cost, mut gradient) = evaluate(&x);
    let mut evaluations = 1;
    let mut pairs: VecDeque<Pair> = VecDeque::new();
    let mut costs = VecDeque::from([cost]);
    let ending = loop {
        let free: Vec<bool> = (0..x.len())
            .map(|i| !(x[i] <= lower[i] && gradient[i] >= 0.0 || x[i] >= upper[i] && gradient[i] <= 0.0))
            .collect();
        let reduced: Vec<f64> = gradient
            .iter()
            .zip(&free)
            .map(|(g, f)| if *f { *g } else { 0.0 })
            .collect();
        let largest = reduced.iter().fold(0.0f64, |most, g| most.max(g.abs()));
        if largest == 0.0 || !cost.is_finite() {
            break Ending::Converged;
        }
        let steepest = |scale: f64| reduced.iter().map(|g| -g * scale).collect::<Vec<f64>>();
        let mut direction =
            two_loops(&pairs, &reduced, &free).unwrap_or_else(|| steepest(first_step / largest));
        if dot(&direction, &reduced) >= 0.0 {
            pairs.clear();
            direction = steepest(first_step / largest);
        }
        let mut length = 1.0;
        let mut found = None;
        for _ in 0..HALVINGS {
            if evaluations >= budget.evaluations {
                break;
            }
            let trial = project(x.iter().zip(&direction).map(|(x, d)| x + length * d).collect());
            let (c, g) = evaluate(&trial);
            evaluations += 1;
            let promise: f64 = gradient
                .iter()
                .zip(trial.iter().zip(&x))
                .map(|(g, (t, x))| g * (t - x))
                .sum();
            if c <= cost + KEPT * promise && promise < 0.0 {
                found = Some((trial, c, g));
                break;
            }
            length *= 0.5;
        }
        let Some((trial, c, g)) = found else {
            if evaluations >= budget.evaluations {
                break Ending::Spent;
            }
            if pairs.is_empty() {
                break Ending::Stuck;
            }
            pairs.clear();
            continue;
        };
        let step: Vec<f64> = trial.iter().zip(&x).map(|(t, x)| t - x).collect();
        let change: Vec<f64> = g.iter().zip(&gradient).map(|(a, b)| a - b).collect();
        if dot(&step, &change) > 1e-10 * dot(&step, &step).sqrt() * dot(&change, &change).sqrt() {
            if pairs.len() == MEMORY {
                pairs.pop_front();
            }
            pairs.push_back(Pair { step, change });
        }
        (x, cost, gradient) = (trial, c, g);
        costs.push_back(cost);
        if costs.len() > PATIENCE {
            let before = costs.pop_front().unwrap_or(cost);
            if before - cost <= budget.least_gain * cost.abs() {
                break Ending::Converged;
            }
        }
    };
    Minimum {
        x,
        cost,
        ending,
        evaluations,
    }
}

/// The quasi-Newton direction among the free variables; `None` without a usable pair.
fn two_loops(pairs: &VecDeque<Pair>, gradient: &[f64], free: &[bool]) -> Option<Vec<f64>> {
    let masked = |a: &[f64], b: &[f64]| -> f64 {
        let terms = a.iter().zip(b).zip(free).filter(|(_, free)| **free);
        terms.map(|((a, b), _)| a * b).sum()
    };
    let mut direction: Vec<f64> = gradient.iter().map(|g| -g).collect();
    let mut used = Vec::with_capacity(pairs.len());
    for pair in pairs.iter().rev() {
        let curvature = masked(&pair.step, &pair.change);
        if curvature > 0.0 {
            let weight = masked(&pair.step, &direction) / curvature;
            for (d, y) in direction.iter_mut().zip(&pair.change) {
                *d -= weight * y;
            }
            used.push((pair, weight, curvature));
        }
    }
    let (latest, _, curvature) = used.first()?;
    let scale = curvature / masked(&latest.change, &latest.change);
    for (d, free) in direction.iter_mut().zip(free) {
        *d = if *free { *d * scale } else { 0.0 };
    }
    for (pair, weight, curvature) in used.iter().rev() {
        let correction = weight - masked(&pair.change, &direction) / curvature;
        for ((d, s), free) in direction.iter_mut().zip(&pair.step).zip(free) {
            if *free {
                *d += correction * s;
            }
        }
    }
    Some(direction)
}
