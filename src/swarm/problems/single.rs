//! Single-objective classics with shifted optima \[3\].

use super::{Function, TestProblem, sum};
use crate::random::Random;
use crate::scalar::Real;
use std::f64::consts::E;

pub(super) fn by_name(name: &str, dimensions: usize) -> Option<TestProblem> {
    let (name, bound, function): (_, f64, Function) = match name {
        "sphere" => ("sphere", 100.0, Function::Sphere),
        "rosenbrock" => ("rosenbrock", 30.0, Function::Rosenbrock),
        "rastrigin" => ("rastrigin", 5.12, Function::Rastrigin),
        "ackley" => ("ackley", 32.0, Function::Ackley),
        "griewank" => ("griewank", 600.0, Function::Griewank),
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

#[inline(always)]
pub(super) fn sphere<R: Real>(x: &[R], f: &mut [R]) {
    f[0] = sum(x, |x| x * x);
}

/// With its optimum moved from one to zero.
#[inline(always)]
pub(super) fn rosenbrock<R: Real>(x: &[R], f: &mut [R]) {
    let (mut bends, mut squares) = (R::lit(0.0), R::lit(0.0));
    for pair in x.windows(2) {
        let bend = pair[1] - (pair[0] * pair[0] + (pair[0] + pair[0]));
        bends = bends + bend * bend;
        squares = squares + pair[0] * pair[0];
    }
    f[0] = R::lit(100.0) * bends + squares;
}

#[inline(always)]
pub(super) fn rastrigin<R: Real>(x: &[R], f: &mut [R]) {
    let cosines = sum(x, |x| (R::lit(2.0) * x).cos_pi());
    f[0] = sum(x, |x| x * x) + R::lit(10.0) * (R::lit(x.len() as f64) - cosines);
}

#[inline(always)]
pub(super) fn ackley<R: Real>(x: &[R], f: &mut [R]) {
    let n = R::lit(x.len() as f64);
    let root = (sum(x, |x| x * x) / n).sqrt();
    let waves = sum(x, |x| (R::lit(2.0) * x).cos_pi()) / n;
    f[0] = R::lit(-20.0) * (R::lit(-0.2) * root).exp() - waves.exp() + R::lit(20.0 + E);
}

#[inline(always)]
pub(super) fn griewank<R: Real>(x: &[R], f: &mut [R]) {
    let square = sum(x, |x| x * x) / R::lit(4000.0);
    let mut waves = R::lit(1.0);
    for (i, x) in x.iter().enumerate() {
        waves = waves * (*x / R::lit((i + 1) as f64).sqrt()).cos();
    }
    f[0] = square - waves + R::lit(1.0);
}
