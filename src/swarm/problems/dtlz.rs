//! Two of the family DTLZ \[2\], with three objectives.

use super::{Function, TestProblem, sum};
use crate::scalar::Real;
use crate::swarm::lattice;

/// About `count` points of an even lattice on the plane where three numbers, none negative, add up to one.
fn on_plane(count: usize) -> impl Iterator<Item = Vec<f64>> {
    let steps = ((2.0 * count as f64).sqrt().round() as u32).max(2) - 1;
    lattice(3, steps).into_iter()
}

pub(super) fn by_name(name: &str) -> Option<TestProblem> {
    let unit = |count: usize| std::iter::repeat_n((0.0, 1.0), count);
    Some(match name {
        "dtlz1" => TestProblem::new("dtlz1", unit(7), 3, Function::Dtlz1, |n| {
            on_plane(n).map(|p| p.iter().map(|x| 0.5 * x).collect()).collect()
        }),
        "dtlz2" => TestProblem::new("dtlz2", unit(12), 3, Function::Dtlz2, |n| {
            let onto_sphere = |p: Vec<f64>| {
                let norm = p.iter().map(|x| x * x).sum::<f64>().sqrt();
                p.iter().map(|x| x / norm).collect()
            };
            on_plane(n).map(onto_sphere).collect()
        }),
        _ => return None,
    })
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
