//! The two-objective family ZDT \[1\] without its fifth, which is of bits.

use super::{Function, TestProblem, even, sum};
use crate::scalar::Real;
use std::f64::consts::PI;

pub(super) fn by_name(name: &str) -> Option<TestProblem> {
    let unit = |count: usize| std::iter::repeat_n((0.0, 1.0), count);
    Some(match name {
        "zdt1" => TestProblem::new("zdt1", unit(30), 2, Function::Zdt1, convex),
        "zdt2" => TestProblem::new("zdt2", unit(30), 2, Function::Zdt2, |n| {
            even(n).map(|x| vec![x, 1.0 - x * x]).collect()
        }),
        "zdt3" => TestProblem::new("zdt3", unit(30), 2, Function::Zdt3, pieces),
        "zdt4" => {
            let bounds = unit(1).chain(std::iter::repeat_n((-5.0, 5.0), 9));
            TestProblem::new("zdt4", bounds, 2, Function::Zdt4, convex)
        }
        "zdt6" => TestProblem::new("zdt6", unit(10), 2, Function::Zdt6, |n| {
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

#[inline(always)]
fn mean<R: Real>(x: &[R]) -> R {
    sum(x, |x| x) / R::lit(x.len() as f64)
}

/// What the distance variables of most of the family add up to.
#[inline(always)]
fn distance<R: Real>(x: &[R]) -> R {
    R::lit(1.0) + R::lit(9.0) * mean(&x[1..])
}

#[inline(always)]
pub(super) fn zdt1<R: Real>(x: &[R], f: &mut [R]) {
    let g = distance(x);
    f[0] = x[0];
    f[1] = g * (R::lit(1.0) - (x[0] / g).sqrt());
}

#[inline(always)]
pub(super) fn zdt2<R: Real>(x: &[R], f: &mut [R]) {
    let g = distance(x);
    let share = x[0] / g;
    f[0] = x[0];
    f[1] = g * (R::lit(1.0) - share * share);
}

#[inline(always)]
pub(super) fn zdt3<R: Real>(x: &[R], f: &mut [R]) {
    let g = distance(x);
    let share = x[0] / g;
    f[0] = x[0];
    f[1] = g * (R::lit(1.0) - share.sqrt() - share * (R::lit(10.0) * x[0]).sin_pi());
}

#[inline(always)]
pub(super) fn zdt4<R: Real>(x: &[R], f: &mut [R]) {
    let squares = sum(&x[1..], |x| x * x);
    let cosines = sum(&x[1..], |x| (R::lit(4.0) * x).cos_pi());
    let count = R::lit((x.len() - 1) as f64);
    let g = R::lit(1.0) + (squares + R::lit(10.0) * (count - cosines));
    f[0] = x[0];
    f[1] = g * (R::lit(1.0) - (x[0] / g).sqrt());
}

#[inline(always)]
pub(super) fn zdt6<R: Real>(x: &[R], f: &mut [R]) {
    let g = R::lit(1.0) + R::lit(9.0) * mean(&x[1..]).sqrt().sqrt();
    let s = (R::lit(6.0) * x[0]).sin_pi();
    let s2 = s * s;
    f[0] = R::lit(1.0) - (R::lit(-4.0) * x[0]).exp() * (s2 * s2 * s2);
    let share = f[0] / g;
    f[1] = g * (R::lit(1.0) - share * share);
}
