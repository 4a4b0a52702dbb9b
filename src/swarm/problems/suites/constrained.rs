//! Problems with constraints \[5\]. Figures are scaled as is usual: a violation of one is about one.

use super::super::dtlz::{dtlz1, dtlz2};
use super::{Definition, dtlz, square};

pub(super) fn by_name(name: &str) -> Option<Definition> {
    let unit = |count: usize| vec![(0.0, 1.0); count];
    Some(match name {
        "bnh" => Definition::free(vec![(0.0, 5.0), (0.0, 3.0)], 2, bnh).under(2),
        "osy" => {
            let (wide, narrow) = ((0.0, 10.0), (1.0, 5.0));
            Definition::free(vec![wide, wide, narrow, (0.0, 6.0), narrow, wide], 2, osy).under(6)
        }
        "tnk" => {
            // The angle has no value where both are zero.
            let pi = std::f64::consts::PI;
            Definition::free(vec![(0.0, pi), (1e-30, pi)], 2, tnk).under(2)
        }
        "welded_beam" => {
            let (thick, long) = ((0.125, 5.0), (0.1, 10.0));
            Definition::free(vec![thick, long, long, thick], 2, welded_beam).under(4)
        }
        "c1_dtlz1" => Definition::free(unit(7), 3, |x, f| {
            dtlz1(x, f);
            f[3] = f[2] / 0.6 + (f[0] + f[1]) / 0.5 - 1.0;
        })
        .under(1),
        "c2_dtlz2" => Definition::free(unit(12), 3, |x, f| {
            dtlz2(x, f);
            f[3] = islands(&f[..3]);
        })
        .under(1),
        "c3_dtlz4" => Definition::free(unit(7), 3, |x, f| {
            dtlz::dtlz4(x, f);
            let whole: f64 = f[..3].iter().map(|f| f * f).sum();
            for k in 0..3 {
                f[3 + k] = 1.0 - whole + 0.75 * square(f[k]);
            }
        })
        .under(3),
        _ => return None,
    })
}

fn bnh(x: &[f64], f: &mut [f64]) {
    let (a, b) = (x[0], x[1]);
    f[0] = 4.0 * (a * a + b * b);
    f[1] = square(a - 5.0) + square(b - 5.0);
    f[2] = (square(a - 5.0) + b * b - 25.0) / 25.0;
    f[3] = (7.7 - square(a - 8.0) - square(b + 3.0)) / 7.7;
}

fn osy(x: &[f64], f: &mut [f64]) {
    let centres = [2.0, 2.0, 1.0, 4.0, 1.0];
    let away: Vec<f64> = x.iter().zip(centres).map(|(x, c)| square(x - c)).collect();
    f[0] = -(25.0 * away[0] + away[1..].iter().sum::<f64>());
    f[1] = x.iter().map(|x| x * x).sum();
    f[2] = (2.0 - x[0] - x[1]) / 2.0;
    f[3] = (x[0] + x[1] - 6.0) / 6.0;
    f[4] = (x[1] - x[0] - 2.0) / 2.0;
    f[5] = (x[0] - 3.0 * x[1] - 2.0) / 2.0;
    f[6] = (square(x[2] - 3.0) + x[3] - 4.0) / 4.0;
    f[7] = (4.0 - square(x[4] - 3.0) - x[5]) / 4.0;
}

fn tnk(x: &[f64], f: &mut [f64]) {
    f[..2].copy_from_slice(x);
    f[2] = 1.0 + 0.1 * (16.0 * (x[0] / x[1]).atan()).cos() - x[0] * x[0] - x[1] * x[1];
    f[3] = 2.0 * (square(x[0] - 0.5) + square(x[1] - 0.5)) - 1.0;
}

/// Cost and deflection of a beam: weld thickness and length, width and thickness of the beam, inch; load 6000 lb at 14 inch.
fn welded_beam(x: &[f64], f: &mut [f64]) {
    let (h, l, t, b) = (x[0], x[1], x[2], x[3]);
    let (load, arm) = (6000.0, 14.0);
    f[0] = 1.10471 * h * h * l + 0.04811 * t * b * (arm + l);
    f[1] = 2.1952 / (b * t * t * t);
    let radius = (0.25 * (l * l + square(h + t))).sqrt();
    let inertia = std::f64::consts::SQRT_2 * h * l * (l * l / 12.0 + 0.25 * square(h + t));
    let primary = load / (std::f64::consts::SQRT_2 * h * l);
    let secondary = load * (arm + l / 2.0) * radius / inertia;
    let shear = (square(primary) + square(secondary) + primary * secondary * l / radius).sqrt();
    let bending = 6.0 * load * arm / (b * t * t);
    let buckling = 64746.022 * (1.0 - 0.0282346 * t) * t * b * b * b;
    f[2] = shear / 13600.0 - 1.0;
    f[3] = bending / 30000.0 - 1.0;
    f[4] = (h - b) / (5.0 - 0.125);
    f[5] = 1.0 - buckling / load;
}

/// Outside of balls about the axes' ends and about the middle of the front.
fn islands(f: &[f64]) -> f64 {
    let whole: f64 = f.iter().map(|f| f * f).sum();
    let ends = f.iter().map(|f| square(f - 1.0) + whole - f * f);
    let middle = f.iter().map(|f| square(f - 1.0 / 3f64.sqrt())).sum();
    ends.fold(middle, f64::min) - square(0.4)
}
