//! Single-objective classics with shifted optima \[3\].

use super::TestProblem;
use crate::random::Random;
use std::f64::consts::{E, PI};

pub(super) fn by_name(name: &str, dimensions: usize) -> Option<TestProblem> {
    type Function = fn(&[f64], &mut [f64]);
    let (name, bound, function): (_, f64, Function) = match name {
        "sphere" => ("sphere", 100.0, sphere),
        "rosenbrock" => ("rosenbrock", 30.0, rosenbrock),
        "rastrigin" => ("rastrigin", 5.12, rastrigin),
        "ackley" => ("ackley", 32.0, ackley),
        "griewank" => ("griewank", 600.0, griewank),
        _ => return None,
    };
    let bounds = std::iter::repeat_n((-bound, bound), dimensions);
    let mut problem = TestProblem::new(name, bounds, 1, function, |_| vec![vec![0.0]]);
    // Anywhere in the inner four fifths of the bounds, the same place for everyone.
    let random = Random::new(SHIFT_SEED);
    problem.shift = (0..dimensions)
        .map(|k| 0.8 * bound * (2.0 * random.uniform(0, 0, 0, k as u32) - 1.0))
        .collect();
    Some(problem)
}

const SHIFT_SEED: u64 = 2005;

fn sphere(x: &[f64], f: &mut [f64]) {
    f[0] = x.iter().map(|x| x * x).sum();
}

/// With its optimum moved from one to nought.
fn rosenbrock(x: &[f64], f: &mut [f64]) {
    let step = |w: &[f64]| {
        let (a, b) = (w[0] + 1.0, w[1] + 1.0);
        100.0 * (b - a * a).powi(2) + (1.0 - a).powi(2)
    };
    f[0] = x.windows(2).map(step).sum();
}

fn rastrigin(x: &[f64], f: &mut [f64]) {
    f[0] = x.iter().map(|x| x * x + 10.0 - 10.0 * (2.0 * PI * x).cos()).sum();
}

fn ackley(x: &[f64], f: &mut [f64]) {
    let n = x.len() as f64;
    let root = (x.iter().map(|x| x * x).sum::<f64>() / n).sqrt();
    let waves = x.iter().map(|x| (2.0 * PI * x).cos()).sum::<f64>() / n;
    f[0] = -20.0 * (-0.2 * root).exp() - waves.exp() + 20.0 + E;
}

fn griewank(x: &[f64], f: &mut [f64]) {
    let square = x.iter().map(|x| x * x).sum::<f64>() / 4000.0;
    let waves: f64 = (1u32..)
        .zip(x)
        .map(|(i, x)| (x / f64::from(i).sqrt()).cos())
        .product();
    f[0] = square - waves + 1.0;
}
