//! The unconstrained instances of CEC 2009 \[4\], in 30 variables.

use super::{Definition, square};
use std::f64::consts::{FRAC_PI_2, PI};

const VARIABLES: usize = 30;
const N: f64 = VARIABLES as f64;

type Formula = fn(&[f64], &mut [f64]);

pub(super) fn by_position(position: usize) -> Option<Definition> {
    #[rustfmt::skip]
    let problems: [(Formula, f64, f64); 10] = [
        (uf1, -1.0, 1.0), (uf2, -1.0, 1.0), (uf3, 0.0, 1.0), (uf4, -2.0, 2.0), (uf5, -1.0, 1.0),
        (uf6, -1.0, 1.0), (uf7, -1.0, 1.0), (uf8, -2.0, 2.0), (uf9, -2.0, 2.0), (uf10, -2.0, 2.0),
    ];
    let (formula, lower, upper) = *problems.get(position)?;
    let objectives = if position < 7 { 2 } else { 3 };
    let mut bounds = vec![(lower, upper); VARIABLES];
    bounds[..objectives - 1].fill((0.0, 1.0));
    Some(Definition::free(bounds, objectives, formula))
}

/// Distance variables of one objective: their number in the paper's count from one, and how far each is from its best.
type Group = Vec<(f64, f64)>;

/// Groups of the distance variables of two objectives: odd numbers, and even ones.
fn pair(x: &[f64], away: impl Fn(f64, f64) -> f64) -> [Group; 2] {
    let group = |rest: usize| {
        let numbers = (2..=x.len()).filter(move |j| j % 2 == rest);
        numbers.map(|j| (j as f64, away(j as f64, x[j - 1]))).collect()
    };
    [group(1), group(0)]
}

/// Away from a sine of the first variable.
fn sines(x: &[f64]) -> [Group; 2] {
    pair(x, |j, y| y - (6.0 * PI * x[0] + j * PI / N).sin())
}

/// Groups of three objectives, away from a sine of the first variable of the height of the second.
fn triple(x: &[f64]) -> [Group; 3] {
    [1, 2, 0].map(|rest| {
        let numbers = (3..=x.len())
            .filter(|j| j % 3 == rest)
            .map(|j| (j as f64, x[j - 1]));
        numbers
            .map(|(j, y)| (j, y - 2.0 * x[1] * (2.0 * PI * x[0] + j * PI / N).sin()))
            .collect()
    })
}

/// Twice the mean of a term.
fn mean(group: &[(f64, f64)], term: impl Fn(f64) -> f64) -> f64 {
    2.0 * group.iter().map(|(_, y)| term(*y)).sum::<f64>() / group.len() as f64
}

/// Squares with a product of cosines, as UF3 and UF6 have them.
fn waves(group: &[(f64, f64)]) -> f64 {
    let squares: f64 = group.iter().map(|(_, y)| y * y).sum();
    let cosine = |(j, y): &(f64, f64)| (20.0 * y * PI / j.sqrt()).cos();
    let product: f64 = group.iter().map(cosine).product();
    2.0 * (4.0 * squares - 2.0 * product + 2.0) / group.len() as f64
}

fn uf1(x: &[f64], f: &mut [f64]) {
    let [odd, even] = sines(x);
    f[0] = x[0] + mean(&odd, square);
    f[1] = 1.0 - x[0].sqrt() + mean(&even, square);
}

fn uf2(x: &[f64], f: &mut [f64]) {
    let [odd, even] = pair(x, |j, y| {
        let height = 0.3 * x[0] * x[0] * (24.0 * PI * x[0] + 4.0 * j * PI / N).cos() + 0.6 * x[0];
        let angle = 6.0 * PI * x[0] + j * PI / N;
        y - height * if j % 2.0 == 1.0 { angle.cos() } else { angle.sin() }
    });
    f[0] = x[0] + mean(&odd, square);
    f[1] = 1.0 - x[0].sqrt() + mean(&even, square);
}

fn uf3(x: &[f64], f: &mut [f64]) {
    let [odd, even] = pair(x, |j, y| y - x[0].powf(0.5 * (1.0 + 3.0 * (j - 2.0) / (N - 2.0))));
    f[0] = x[0] + waves(&odd);
    f[1] = 1.0 - x[0].sqrt() + waves(&even);
}

fn uf4(x: &[f64], f: &mut [f64]) {
    let [odd, even] = sines(x);
    let term = |y: f64| y.abs() / (1.0 + (2.0 * y.abs()).exp());
    f[0] = x[0] + mean(&odd, term);
    f[1] = 1.0 - x[0] * x[0] + mean(&even, term);
}

fn uf5(x: &[f64], f: &mut [f64]) {
    let [odd, even] = sines(x);
    let term = |y: f64| 2.0 * y * y - (4.0 * PI * y).cos() + 1.0;
    let bump = 0.15 * (20.0 * PI * x[0]).sin().abs();
    f[0] = x[0] + bump + mean(&odd, term);
    f[1] = 1.0 - x[0] + bump + mean(&even, term);
}

fn uf6(x: &[f64], f: &mut [f64]) {
    let [odd, even] = sines(x);
    let bump = (0.7 * (4.0 * PI * x[0]).sin()).max(0.0);
    f[0] = x[0] + bump + waves(&odd);
    f[1] = 1.0 - x[0] + bump + waves(&even);
}

fn uf7(x: &[f64], f: &mut [f64]) {
    let [odd, even] = sines(x);
    let root = x[0].powf(0.2);
    f[0] = root + mean(&odd, square);
    f[1] = 1.0 - root + mean(&even, square);
}

/// UF8 and UF10: the octant of a sphere.
fn octant(x: &[f64], f: &mut [f64], term: fn(f64) -> f64) {
    let groups = triple(x);
    let (first, second) = (FRAC_PI_2 * x[0], FRAC_PI_2 * x[1]);
    let place = [
        first.cos() * second.cos(),
        first.cos() * second.sin(),
        first.sin(),
    ];
    for ((f, place), group) in f.iter_mut().zip(place).zip(&groups) {
        *f = place + mean(group, term);
    }
}

fn uf8(x: &[f64], f: &mut [f64]) {
    octant(x, f, square);
}

fn uf9(x: &[f64], f: &mut [f64]) {
    let groups = triple(x);
    let bump = (1.1 * (1.0 - 4.0 * square(2.0 * x[0] - 1.0))).max(0.0);
    let place = [
        0.5 * (bump + 2.0 * x[0]) * x[1],
        0.5 * (bump - 2.0 * x[0] + 2.0) * x[1],
        1.0 - x[1],
    ];
    for ((f, place), group) in f.iter_mut().zip(place).zip(&groups) {
        *f = place + mean(group, square);
    }
}

fn uf10(x: &[f64], f: &mut [f64]) {
    octant(x, f, |y| 4.0 * y * y - (8.0 * PI * y).cos() + 1.0);
}
