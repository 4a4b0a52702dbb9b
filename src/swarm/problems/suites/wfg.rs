//! The toolkit WFG \[3\]: transformations of the unit cube, and shapes of fronts; 4 position and 20 distance variables.

use super::Definition;
use std::f64::consts::{FRAC_PI_2, PI};

/// Position variables, and all.
const POSITIONS: usize = 4;
const VARIABLES: usize = 24;

pub(super) fn by_position(position: usize, objectives: usize) -> Option<Definition> {
    type Transformation = fn(&mut [f64], usize) -> Vec<f64>;
    let problems: [Transformation; 9] = [wfg1, wfg2, wfg2, wfg4, wfg5, wfg6, wfg7, wfg8, wfg9];
    let transform = *problems.get(position)?;
    let number = position + 1;
    let formula = move |x: &[f64], f: &mut [f64]| {
        let mut y: Vec<f64> = x
            .iter()
            .enumerate()
            .map(|(i, x)| x / (2 * (i + 1)) as f64)
            .collect();
        let reduced = transform(&mut y, f.len());
        shaped(number, &reduced, f);
    };
    let bounds = (1..=VARIABLES).map(|i| (0.0, (2 * i) as f64));
    Some(Definition::free(bounds.collect(), objectives, formula))
}

/// Places the reduced variables, the last of which is the distance, on the front's shape.
fn shaped(number: usize, reduced: &[f64], f: &mut [f64]) {
    let angles = f.len() - 1;
    let distance = reduced[angles];
    let place = |(i, t): (usize, &f64)| {
        // The third problem's front is a line: all angles but the first vanish with the distance.
        let least = if number == 3 && i > 0 { 0.0 } else { 1.0 };
        distance.max(least) * (t - 0.5) + 0.5
    };
    let x: Vec<f64> = reduced[..angles].iter().enumerate().map(place).collect();
    let last = angles + 1;
    for (i, f) in f.iter_mut().enumerate() {
        let m = i + 1;
        let height = match number {
            1 if m == last => 1.0 - x[0] - (10.0 * PI * x[0] + FRAC_PI_2).cos() / (10.0 * PI),
            2 if m == last => 1.0 - x[0] * (5.0 * PI * x[0]).cos().powi(2),
            1 | 2 => shape(
                &x,
                i,
                |x| 1.0 - (FRAC_PI_2 * x).cos(),
                |x| 1.0 - (FRAC_PI_2 * x).sin(),
            ),
            3 => shape(&x, i, |x| x, |x| 1.0 - x),
            _ => shape(&x, i, |x| (FRAC_PI_2 * x).sin(), |x| (FRAC_PI_2 * x).cos()),
        };
        *f = distance + (2 * m) as f64 * height;
    }
}

/// The product over the leading angles, of which objective `i` has `i` fewer, and the factor of the angle behind them.
fn shape(x: &[f64], i: usize, leading: fn(f64) -> f64, behind: fn(f64) -> f64) -> f64 {
    let (first, rest) = x.split_at(x.len() - i);
    let product: f64 = first.iter().map(|x| leading(*x)).product();
    match rest.first() {
        Some(x) => product * behind(*x),
        None => product,
    }
}

fn linear(y: f64) -> f64 {
    (y - 0.35).abs() / ((0.35 - y).floor() + 0.35).abs()
}

fn deceptive(y: f64) -> f64 {
    let (a, b, c) = (0.35, 0.001, 0.05);
    let below = (y - a + b).floor() * (1.0 - c + (a - b) / b) / (a - b);
    let above = (a + b - y).floor() * (1.0 - c + (1.0 - a - b) / b) / (1.0 - a - b);
    in_unit(1.0 + ((y - a).abs() - b) * (below + above + 1.0 / b))
}

/// `hills` minima, with the best at 0.35, on a slope.
fn multi_modal(y: f64, hills: f64, slope: f64) -> f64 {
    let away = (y - 0.35).abs() / (2.0 * ((0.35 - y).floor() + 0.35));
    let wave = ((4.0 * hills + 2.0) * PI * (0.5 - away)).cos();
    in_unit((1.0 + wave + 4.0 * slope * away * away) / (slope + 2.0))
}

fn flat(y: f64) -> f64 {
    let (a, b, c) = (0.8, 0.75, 0.85);
    let below = (y - b).floor().min(0.0) * a * (b - y) / b;
    let above = (c - y).floor().min(0.0) * (1.0 - a) * (y - c) / (1.0 - c);
    in_unit(a + below - above)
}

/// A power of `y` between 0.02 and 50, by `u`.
fn dependent(y: f64, u: f64) -> f64 {
    let a = 0.98 / 49.98;
    let v = a - (1.0 - 2.0 * u) * ((0.5 - u).floor() + a).abs();
    in_unit(y.powf(0.02 + 49.98 * v))
}

/// Rounding may leave the unit interval.
fn in_unit(y: f64) -> f64 {
    y.clamp(0.0, 1.0)
}

fn mean(y: &[f64]) -> f64 {
    y.iter().sum::<f64>() / y.len() as f64
}

/// The reduction that no variable can be separated from, of the given degree.
fn bound_up(y: &[f64], degree: usize) -> f64 {
    let n = y.len();
    let apart = |j: usize| -> f64 { (1..degree).map(|k| (y[j] - y[(j + k) % n]).abs()).sum() };
    let sum: f64 = (0..n).map(|j| y[j] + apart(j)).sum();
    let half = degree.div_ceil(2) as f64;
    in_unit(sum / (n as f64 * half * (1.0 + 2.0 * degree as f64 - 2.0 * half) / degree as f64))
}

/// The position variables in groups, one for each angle, and the distance variables, each reduced to one.
fn reduced(y: &[f64], objectives: usize, reduce: impl Fn(&[f64], usize) -> f64) -> Vec<f64> {
    let gap = POSITIONS / (objectives - 1);
    let groups = y[..POSITIONS].chunks(gap).enumerate().map(|(i, g)| (g, i * gap));
    groups
        .chain([(&y[POSITIONS..], POSITIONS)])
        .map(|(group, first)| reduce(group, first))
        .collect()
}

fn each(y: &mut [f64], transform: impl Fn(f64) -> f64) {
    y.iter_mut().for_each(|y| *y = transform(*y));
}

fn wfg1(y: &mut [f64], objectives: usize) -> Vec<f64> {
    each(&mut y[POSITIONS..], |y| flat(linear(y)));
    each(y, |y| y.powf(0.02));
    reduced(y, objectives, |group, first| {
        let weight = |i: usize| (2 * (first + i + 1)) as f64;
        let sum: f64 = group.iter().enumerate().map(|(i, y)| weight(i) * y).sum();
        sum / (0..group.len()).map(weight).sum::<f64>()
    })
}

/// WFG2 and WFG3.
fn wfg2(y: &mut [f64], objectives: usize) -> Vec<f64> {
    each(&mut y[POSITIONS..], linear);
    let pairs = y[POSITIONS..].chunks(2).map(|pair| bound_up(pair, 2));
    let all: Vec<f64> = y[..POSITIONS].iter().copied().chain(pairs).collect();
    reduced(&all, objectives, |group, _| mean(group))
}

fn wfg4(y: &mut [f64], objectives: usize) -> Vec<f64> {
    each(y, |y| multi_modal(y, 30.0, 10.0));
    reduced(y, objectives, |group, _| mean(group))
}

fn wfg5(y: &mut [f64], objectives: usize) -> Vec<f64> {
    each(y, deceptive);
    reduced(y, objectives, |group, _| mean(group))
}

fn wfg6(y: &mut [f64], objectives: usize) -> Vec<f64> {
    each(&mut y[POSITIONS..], linear);
    reduced(y, objectives, |group, _| bound_up(group, group.len()))
}

fn wfg7(y: &mut [f64], objectives: usize) -> Vec<f64> {
    for i in 0..POSITIONS {
        y[i] = dependent(y[i], mean(&y[i + 1..]));
    }
    each(&mut y[POSITIONS..], linear);
    reduced(y, objectives, |group, _| mean(group))
}

fn wfg8(y: &mut [f64], objectives: usize) -> Vec<f64> {
    // From the last on, because each depends on those before it as they came.
    for i in (POSITIONS..y.len()).rev() {
        y[i] = dependent(y[i], mean(&y[..i]));
    }
    each(&mut y[POSITIONS..], linear);
    reduced(y, objectives, |group, _| mean(group))
}

fn wfg9(y: &mut [f64], objectives: usize) -> Vec<f64> {
    for i in 0..y.len() - 1 {
        y[i] = dependent(y[i], mean(&y[i + 1..]));
    }
    each(&mut y[..POSITIONS], deceptive);
    each(&mut y[POSITIONS..], |y| multi_modal(y, 30.0, 95.0));
    reduced(y, objectives, |group, _| bound_up(group, group.len()))
}
