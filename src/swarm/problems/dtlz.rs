//! Two of the family DTLZ \[2\], with three objectives.

use super::{Function, TestProblem, sum};
use crate::scalar::Real;

pub(super) fn by_name(name: &str) -> Option<TestProblem> {
    let unit = |count: usize| std::iter::repeat_n((0.0, 1.0), count);
    Some(match name {
        "dtlz1" => TestProblem::new("dtlz1", unit(7), 3, Function::Dtlz1, |n| {
            lattice(n).map(|p| p.map(|x| 0.5 * x).to_vec()).collect()
        }),
        "dtlz2" => TestProblem::new("dtlz2", unit(12), 3, Function::Dtlz2, |n| {
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

#[inline(always)]
pub(super) fn dtlz1<R: Real>(x: &[R], f: &mut [R]) {
    let (half, one) = (R::lit(0.5), R::lit(1.0));
    let tail = &x[2..];
    let waves = sum(tail, |x| {
        let y = x - half;
        y * y - (R::lit(20.0) * y).cos_pi()
    });
    let size = half * (one + R::lit(100.0) * (R::lit(tail.len() as f64) + waves));
    f[0] = size * x[0] * x[1];
    f[1] = size * x[0] * (one - x[1]);
    f[2] = size * (one - x[0]);
}

#[inline(always)]
pub(super) fn dtlz2<R: Real>(x: &[R], f: &mut [R]) {
    let half = R::lit(0.5);
    let size = R::lit(1.0) + sum(&x[2..], |x| (x - half) * (x - half));
    let (a, b) = (half * x[0], half * x[1]);
    f[0] = size * a.cos_pi() * b.cos_pi();
    f[1] = size * a.cos_pi() * b.sin_pi();
    f[2] = size * a.sin_pi();
}
