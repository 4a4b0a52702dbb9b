//! Two of the family DTLZ \[2\], with three objectives.

use super::TestProblem;
use std::f64::consts::PI;

pub(super) fn by_name(name: &str) -> Option<TestProblem> {
    let unit = |count: usize| std::iter::repeat_n((0.0, 1.0), count);
    Some(match name {
        "dtlz1" => TestProblem::new("dtlz1", unit(7), 3, dtlz1, |n| {
            lattice(n).map(|p| p.map(|x| 0.5 * x).to_vec()).collect()
        }),
        "dtlz2" => TestProblem::new("dtlz2", unit(12), 3, dtlz2, |n| {
            let onto_sphere = |p: [f64; 3]| {
                let norm = p.iter().map(|x| x * x).sum::<f64>().sqrt();
                p.map(|x| x / norm).to_vec()
            };
            lattice(n).map(onto_sphere).collect()
        }),
        _ => return None,
    })
}

/// About `count` points of an even lattice on the plane where three numbers, none negative, add up to one (Das,
/// Dennis, 1998).
fn lattice(count: usize) -> impl Iterator<Item = [f64; 3]> {
    let steps = ((2.0 * count as f64).sqrt().round() as usize).max(2) - 1;
    let at = move |i: usize, j: usize| [i, j, steps - i - j].map(|s| s as f64 / steps as f64);
    (0..=steps).flat_map(move |i| (0..=steps - i).map(move |j| at(i, j)))
}

fn dtlz1(x: &[f64], f: &mut [f64]) {
    let tail = &x[2..];
    let waves = |x: &f64| (x - 0.5).powi(2) - (20.0 * PI * (x - 0.5)).cos();
    let g = 100.0 * (tail.len() as f64 + tail.iter().map(waves).sum::<f64>());
    let size = 0.5 * (1.0 + g);
    f[0] = size * x[0] * x[1];
    f[1] = size * x[0] * (1.0 - x[1]);
    f[2] = size * (1.0 - x[0]);
}

fn dtlz2(x: &[f64], f: &mut [f64]) {
    let size = 1.0 + x[2..].iter().map(|x| (x - 0.5).powi(2)).sum::<f64>();
    let (a, b) = (0.5 * PI * x[0], 0.5 * PI * x[1]);
    f[0] = size * a.cos() * b.cos();
    f[1] = size * a.cos() * b.sin();
    f[2] = size * a.sin();
}
