//! The two-objective family ZDT \[1\] without its fifth, which is of bits.

use super::{TestProblem, even};
use std::f64::consts::PI;

pub(super) fn by_name(name: &str) -> Option<TestProblem> {
    let unit = |count: usize| std::iter::repeat_n((0.0, 1.0), count);
    Some(match name {
        "zdt1" => TestProblem::new("zdt1", unit(30), 2, zdt1, convex),
        "zdt2" => TestProblem::new("zdt2", unit(30), 2, zdt2, |n| {
            even(n).map(|x| vec![x, 1.0 - x * x]).collect()
        }),
        "zdt3" => TestProblem::new("zdt3", unit(30), 2, zdt3, pieces),
        "zdt4" => {
            let bounds = unit(1).chain(std::iter::repeat_n((-5.0, 5.0), 9));
            TestProblem::new("zdt4", bounds, 2, zdt4, convex)
        }
        "zdt6" => TestProblem::new("zdt6", unit(10), 2, zdt6, |n| {
            even(n)
                .map(|s| ZDT6_LEAST + (1.0 - ZDT6_LEAST) * s)
                .map(|x| vec![x, 1.0 - x * x])
                .collect()
        }),
        _ => return None,
    })
}

/// Least first objective of ZDT6.
const ZDT6_LEAST: f64 = 0.280_775_318_829_036_8;

fn convex(count: usize) -> Vec<Vec<f64>> {
    even(count).map(|x| vec![x, 1.0 - x.sqrt()]).collect()
}

/// The pieces of ZDT3's front, by the first objective.
const PIECES: [(f64, f64); 5] = [
    (0.0, 0.083_001_534_9),
    (0.182_228_728_0, 0.257_762_363_4),
    (0.409_313_674_8, 0.453_882_104_1),
    (0.618_396_794_4, 0.652_511_703_8),
    (0.823_331_798_3, 0.851_832_865_4),
];

fn pieces(count: usize) -> Vec<Vec<f64>> {
    let piece = |&(from, to): &(f64, f64)| even(count / PIECES.len()).map(move |s| from + s * (to - from));
    let points: Vec<Vec<f64>> = PIECES
        .iter()
        .flat_map(piece)
        .map(|x| vec![x, 1.0 - x.sqrt() - x * (10.0 * PI * x).sin()])
        .collect();
    // The ends of the pieces are rounded, which may leave one a trifle behind the next.
    let front = crate::swarm::metrics::non_dominated(&points);
    front.into_iter().map(|i| points[i].clone()).collect()
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

fn zdt1(x: &[f64], f: &mut [f64]) {
    let g = 1.0 + 9.0 * mean(&x[1..]);
    f[0] = x[0];
    f[1] = g * (1.0 - (x[0] / g).sqrt());
}

fn zdt2(x: &[f64], f: &mut [f64]) {
    let g = 1.0 + 9.0 * mean(&x[1..]);
    f[0] = x[0];
    f[1] = g * (1.0 - (x[0] / g).powi(2));
}

fn zdt3(x: &[f64], f: &mut [f64]) {
    let g = 1.0 + 9.0 * mean(&x[1..]);
    f[0] = x[0];
    f[1] = g * (1.0 - (x[0] / g).sqrt() - x[0] / g * (10.0 * PI * x[0]).sin());
}

fn zdt4(x: &[f64], f: &mut [f64]) {
    let waves = |x: &f64| x * x - 10.0 * (4.0 * PI * x).cos();
    let g = 1.0 + 10.0 * (x.len() - 1) as f64 + x[1..].iter().map(waves).sum::<f64>();
    f[0] = x[0];
    f[1] = g * (1.0 - (x[0] / g).sqrt());
}

fn zdt6(x: &[f64], f: &mut [f64]) {
    let g = 1.0 + 9.0 * mean(&x[1..]).powf(0.25);
    f[0] = 1.0 - (-4.0 * x[0]).exp() * (6.0 * PI * x[0]).sin().powi(6);
    f[1] = g * (1.0 - (f[0] / g).powi(2));
}
