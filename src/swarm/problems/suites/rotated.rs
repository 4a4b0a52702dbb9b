//! Single-objective functions in 30 variables, shifted and rotated \[8\]. Each optimum is zero.

use super::Definition;
use crate::random::Random;
use std::f64::consts::{E, PI};

const VARIABLES: usize = 30;
const SEED: u64 = 2014;

pub(super) fn by_position(position: usize) -> Option<Definition> {
    let number = position as u32;
    let core: Core = match position {
        0 => sphere,
        1 => bent_cigar,
        2 => rosenbrock,
        3 => rastrigin,
        4 => schwefel,
        5 => ackley,
        6 => griewank,
        7 => levy,
        8 => |y| bent_cigar(&y[..6]) + rosenbrock(&y[6..18]) + rastrigin(&y[18..]),
        9 => return Some(composition(number)),
        _ => return None,
    };
    let frame = Frame::of(number, 0);
    Some(Definition::free(bounds(), 1, move |x, f| {
        f[0] = core(&frame.turned(&frame.away(x)));
    }))
}

/// A function of turned coordinates whose optimum, zero, lies at zero.
type Core = fn(&[f64]) -> f64;

fn bounds() -> Vec<(f64, f64)> {
    vec![(-100.0, 100.0); VARIABLES]
}

/// Where the optimum of a part of a problem lies: anywhere in the inner four fifths of the bounds.
fn shift(number: u32, part: u32) -> Vec<f64> {
    let random = Random::new(SEED);
    let place = |k| 80.0 * (2.0 * random.uniform(0, number, part, k) - 1.0);
    (0..VARIABLES as u32).map(place).collect()
}

/// Where a function stands and how it is turned.
struct Frame {
    shift: Vec<f64>,
    rows: Vec<Vec<f64>>,
}

impl Frame {
    /// Rows are normal deviates, each freed from those before it and scaled to one.
    fn of(number: u32, part: u32) -> Self {
        let random = Random::new(SEED);
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for i in 0..VARIABLES as u32 {
            let deviate = |k| random.normal(1 + part, number, i, k);
            let mut row: Vec<f64> = (0..VARIABLES as u32).map(deviate).collect();
            for other in &rows {
                let along = dot(&row, other);
                row.iter_mut().zip(other).for_each(|(x, o)| *x -= along * o);
            }
            let length = dot(&row, &row).sqrt();
            rows.push(row.iter().map(|x| x / length).collect());
        }
        Self {
            shift: shift(number, part),
            rows,
        }
    }

    fn away(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.shift).map(|(x, s)| x - s).collect()
    }

    fn turned(&self, away: &[f64]) -> Vec<f64> {
        self.rows.iter().map(|row| dot(row, away)).collect()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Three functions at places of their own, each the stronger the nearer: the first holds the optimum.
fn composition(number: u32) -> Definition {
    /// Function, height, width and level.
    const PARTS: [(Core, f64, f64, f64); 3] = [
        (rosenbrock, 1.0, 10.0, 0.0),
        (bent_cigar, 1e-6, 20.0, 100.0),
        (rastrigin, 1.0, 30.0, 200.0),
    ];
    let frames = [0, 1, 2].map(|part| Frame::of(number, part));
    Definition::free(bounds(), 1, move |x, f| {
        let (mut total, mut weights) = (0.0, 0.0);
        for ((core, height, width, level), frame) in PARTS.iter().zip(&frames) {
            let away = frame.away(x);
            let square = dot(&away, &away);
            if square == 0.0 {
                f[0] = *level;
                return;
            }
            let weight = (-square / (2.0 * VARIABLES as f64 * width * width)).exp() / square.sqrt();
            total += weight * (height * core(&frame.turned(&away)) + level);
            weights += weight;
        }
        f[0] = total / weights;
    })
}

fn sphere(y: &[f64]) -> f64 {
    dot(y, y)
}

fn bent_cigar(y: &[f64]) -> f64 {
    y[0] * y[0] + 1e6 * dot(&y[1..], &y[1..])
}

fn rosenbrock(y: &[f64]) -> f64 {
    let at = |y: f64| 0.02048 * y + 1.0;
    let term = |pair: &[f64]| {
        let (a, b) = (at(pair[0]), at(pair[1]));
        100.0 * (a * a - b).powi(2) + (a - 1.0).powi(2)
    };
    y.windows(2).map(term).sum()
}

fn rastrigin(y: &[f64]) -> f64 {
    let term = |y: &f64| {
        let z = 0.0512 * y;
        z * z - 10.0 * (2.0 * PI * z).cos() + 10.0
    };
    y.iter().map(term).sum()
}

/// Beyond 500 it folds back, and rises with the square of the distance.
fn schwefel(y: &[f64]) -> f64 {
    let n = y.len() as f64;
    let term = |y: &f64| {
        let z = 10.0 * y + 420.968_746_227_503_6;
        if z.abs() <= 500.0 {
            return -z * z.abs().sqrt().sin();
        }
        let folded = 500.0 - z.abs() % 500.0;
        let beyond = (z.abs() - 500.0) / 100.0;
        beyond * beyond / n - z.signum() * folded * folded.sqrt().sin()
    };
    y.iter().map(term).sum::<f64>() + 418.982_887_272_433_8 * n
}

fn ackley(y: &[f64]) -> f64 {
    let n = y.len() as f64;
    let waves = y.iter().map(|y| (2.0 * PI * y).cos()).sum::<f64>() / n;
    20.0 + E - 20.0 * (-0.2 * (dot(y, y) / n).sqrt()).exp() - waves.exp()
}

fn griewank(y: &[f64]) -> f64 {
    let cosine = |(i, y): (usize, &f64)| (6.0 * y / ((i + 1) as f64).sqrt()).cos();
    let product: f64 = y.iter().enumerate().map(cosine).product();
    36.0 * dot(y, y) / 4000.0 - product + 1.0
}

fn levy(y: &[f64]) -> f64 {
    let w: Vec<f64> = y.iter().map(|y| 1.0 + 0.0512 * y / 4.0).collect();
    let last = w[w.len() - 1];
    let term = |w: &f64| (w - 1.0).powi(2) * (1.0 + 10.0 * (PI * w + 1.0).sin().powi(2));
    (PI * w[0]).sin().powi(2)
        + w[..w.len() - 1].iter().map(term).sum::<f64>()
        + (last - 1.0).powi(2) * (1.0 + (2.0 * PI * last).sin().powi(2))
}
