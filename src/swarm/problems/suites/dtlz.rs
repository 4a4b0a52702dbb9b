//! The rest of the family DTLZ \[2\], with three objectives.

use super::{Definition, square};
use std::f64::consts::{FRAC_PI_2, PI};

pub(super) fn by_name(name: &str) -> Option<Definition> {
    type Formula = fn(&[f64], &mut [f64]);
    let (count, formula): (_, Formula) = match name {
        "dtlz3" => (12, dtlz3),
        "dtlz4" => (12, dtlz4),
        "dtlz5" => (12, |x, f| {
            bent(x, x[2..].iter().map(|x| square(x - 0.5)).sum(), f)
        }),
        "dtlz6" => (12, |x, f| bent(x, x[2..].iter().map(|x| x.powf(0.1)).sum(), f)),
        "dtlz7" => (22, dtlz7),
        _ => return None,
    };
    Some(Definition::free(vec![(0.0, 1.0); count], 3, formula))
}

/// A point of the octant of a sphere, at two angles in quarter turns.
fn octant(radius: f64, angles: [f64; 2], f: &mut [f64]) {
    let [(a_sin, a_cos), (b_sin, b_cos)] = angles.map(|a| (FRAC_PI_2 * a).sin_cos());
    f[0] = radius * a_cos * b_cos;
    f[1] = radius * a_cos * b_sin;
    f[2] = radius * a_sin;
}

fn dtlz3(x: &[f64], f: &mut [f64]) {
    let wave = |x: &f64| square(x - 0.5) - (20.0 * PI * (x - 0.5)).cos();
    let waves = x[2..].iter().map(wave).sum::<f64>();
    octant(1.0 + 100.0 * ((x.len() - 2) as f64 + waves), [x[0], x[1]], f);
}

pub(super) fn dtlz4(x: &[f64], f: &mut [f64]) {
    let distance: f64 = x[2..].iter().map(|x| square(x - 0.5)).sum();
    octant(1.0 + distance, [x[0].powi(100), x[1].powi(100)], f);
}

/// DTLZ5 and DTLZ6: the octant, which narrows to a curve as the distance vanishes.
fn bent(x: &[f64], distance: f64, f: &mut [f64]) {
    let second = (1.0 + 2.0 * distance * x[1]) / (2.0 * (1.0 + distance));
    octant(1.0 + distance, [x[0], second], f);
}

fn dtlz7(x: &[f64], f: &mut [f64]) {
    let tail = &x[2..];
    let size = 2.0 + 9.0 * tail.iter().sum::<f64>() / tail.len() as f64;
    let term = |x: &f64| x / size * (1.0 + (3.0 * PI * x).sin());
    f[..2].copy_from_slice(&x[..2]);
    f[2] = size * (3.0 - x[..2].iter().map(term).sum::<f64>());
}
