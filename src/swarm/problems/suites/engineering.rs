//! Designs from engineering, with two and three objectives \[6\]. The last objective of many is the sum of what the design's
//! own constraints are violated by.

// The published designs have their own roundings of pi.
#![allow(clippy::approx_constant)]

use super::{Definition, square};
use std::f64::consts::{FRAC_PI_4, PI, SQRT_2};

pub(super) fn by_name(name: &str) -> Option<Definition> {
    type Formula = fn(&[f64], &mut [f64]);
    let same = |count: usize, bounds: (f64, f64)| vec![bounds; count];
    let root = SQRT_2;
    let (bounds, objectives, formula): (Vec<(f64, f64)>, usize, Formula) = match name {
        "re21" => (
            vec![(1.0, 3.0), (root, 3.0), (root, 3.0), (1.0, 3.0)],
            2,
            four_bar_truss,
        ),
        "re22" => (vec![(0.2, 15.0), (0.0, 20.0), (0.0, 40.0)], 2, concrete_beam),
        "re23" => (
            vec![(1.0, 100.0), (1.0, 100.0), (10.0, 200.0), (10.0, 240.0)],
            2,
            pressure_vessel,
        ),
        "re24" => (vec![(0.5, 4.0), (0.5, 50.0)], 2, hatch_cover),
        "re25" => (vec![(1.0, 70.0), (0.6, 3.0), (0.09, 0.5)], 2, coil_spring),
        "re31" => (vec![(1e-5, 100.0), (1e-5, 100.0), (1.0, 3.0)], 3, two_bar_truss),
        "re32" => (
            vec![(0.125, 5.0), (0.1, 10.0), (0.1, 10.0), (0.125, 5.0)],
            3,
            welded_beam,
        ),
        "re33" => (
            vec![(55.0, 80.0), (75.0, 110.0), (1000.0, 3000.0), (11.0, 20.0)],
            3,
            disc_brake,
        ),
        "re34" => (same(5, (1.0, 3.0)), 3, crash),
        "re35" => {
            let first = [
                (2.6, 3.6),
                (0.7, 0.8),
                (17.0, 28.0),
                (7.3, 8.3),
                (7.3, 8.3),
                (2.9, 3.9),
                (5.0, 5.5),
            ];
            (first.to_vec(), 3, speed_reducer)
        }
        "re36" => (same(4, (12.0, 60.0)), 3, gear_train),
        "re37" => (same(4, (0.0, 1.0)), 3, rocket_injector),
        _ => return None,
    };
    Some(Definition::free(bounds, objectives, formula))
}

/// The sum of what figures that should not be negative lack.
fn lacking<const N: usize>(figures: [f64; N]) -> f64 {
    figures.iter().map(|g| (-g).max(0.0)).sum()
}

/// The value of a table that is nearest.
fn nearest(table: &[f64], x: f64) -> f64 {
    let away = |a: &&f64, b: &&f64| (*a - x).abs().total_cmp(&(*b - x).abs());
    table.iter().min_by(away).copied().unwrap_or(x)
}

/// Volume and displacement of a truss of four bars.
fn four_bar_truss(x: &[f64], f: &mut [f64]) {
    let (force, elasticity, length) = (10.0, 2e5, 200.0);
    f[0] = length * (2.0 * x[0] + SQRT_2 * x[1] + x[2].sqrt() + x[3]);
    let bars = 2.0 / x[0] + 2.0 * SQRT_2 / x[1] - 2.0 * SQRT_2 / x[2] + 2.0 / x[3];
    f[1] = force * length / elasticity * bars;
}

/// Areas of reinforcement that there are, square inches.
#[rustfmt::skip]
const REINFORCEMENT: [f64; 76] = [
    0.20, 0.31, 0.40, 0.44, 0.60, 0.62, 0.79, 0.80, 0.88, 0.93, 1.0, 1.20, 1.24, 1.32, 1.40, 1.55, 1.58, 1.60, 1.76,
    1.80, 1.86, 2.0, 2.17, 2.20, 2.37, 2.40, 2.48, 2.60, 2.64, 2.79, 2.80, 3.0, 3.08, 3.10, 3.16, 3.41, 3.52, 3.60,
    3.72, 3.95, 3.96, 4.0, 4.03, 4.20, 4.34, 4.40, 4.65, 4.74, 4.80, 4.84, 5.0, 5.28, 5.40, 5.53, 5.72, 6.0, 6.16,
    6.32, 6.60, 7.11, 7.20, 7.80, 7.90, 8.0, 8.40, 8.69, 9.0, 9.48, 10.27, 11.0, 11.06, 11.85, 12.0, 13.0, 14.0, 15.0,
];

/// Cost of a beam of reinforced concrete.
fn concrete_beam(x: &[f64], f: &mut [f64]) {
    let (area, width, depth) = (nearest(&REINFORCEMENT, x[0]), x[1], x[2]);
    f[0] = 29.4 * area + 0.6 * width * depth;
    f[1] = lacking([
        area * depth - 7.735 * area * area / width - 180.0,
        4.0 - depth / width,
    ]);
}

/// Cost of a pressure vessel, whose shell and head are of sixteenths of an inch.
fn pressure_vessel(x: &[f64], f: &mut [f64]) {
    let (shell, head) = (0.0625 * x[0].round(), 0.0625 * x[1].round());
    let (radius, length) = (x[2], x[3]);
    f[0] = 0.6224 * shell * radius * length
        + 1.7781 * head * radius * radius
        + 3.1661 * shell * shell * length
        + 19.84 * shell * shell * radius;
    f[1] = lacking([
        shell - 0.0193 * radius,
        head - 0.00954 * radius,
        PI * radius * radius * length + 4.0 / 3.0 * PI * radius * radius * radius - 1_296_000.0,
    ]);
}

/// Weight of a hatch cover.
fn hatch_cover(x: &[f64], f: &mut [f64]) {
    let (flange, height) = (x[0], x[1]);
    let elasticity = 700_000.0;
    let bending = 4500.0 / (flange * height);
    let critical = elasticity * flange * flange / 100.0;
    let deflection = 562_000.0 / (elasticity * flange * height * height);
    f[0] = flange + 120.0 * height;
    f[1] = lacking([
        1.0 - bending / 700.0,
        1.0 - 1800.0 / height / 450.0,
        1.0 - deflection / 1.5,
        1.0 - bending / critical,
    ]);
}

/// Wires that there are, diameters in inches.
#[rustfmt::skip]
const WIRES: [f64; 42] = [
    0.009, 0.0095, 0.0104, 0.0118, 0.0128, 0.0132, 0.014, 0.015, 0.0162, 0.0173, 0.018, 0.02, 0.023, 0.025, 0.028, 0.032,
    0.035, 0.041, 0.047, 0.054, 0.063, 0.072, 0.08, 0.092, 0.105, 0.12, 0.135, 0.148, 0.162, 0.177, 0.192, 0.207, 0.225,
    0.244, 0.263, 0.283, 0.307, 0.331, 0.362, 0.394, 0.4375, 0.5,
];

/// Volume of a coil spring.
fn coil_spring(x: &[f64], f: &mut [f64]) {
    let (coils, coil, wire) = (x[0].round(), x[1], nearest(&WIRES, x[2]));
    let (most, preload) = (1000.0, 300.0);
    let ratio = coil / wire;
    let stress = (4.0 * ratio - 1.0) / (4.0 * ratio - 4.0) + 0.615 / ratio;
    let rate = 11.5e6 * wire.powi(4) / (8.0 * coils * coil.powi(3));
    let solid = 1.05 * (coils + 2.0) * wire;
    let length = most / rate + solid;
    let (settled, travel) = (preload / rate, (most - preload) / rate);
    f[0] = PI * FRAC_PI_4 * coil * wire * wire * (coils + 2.0);
    f[1] = lacking([
        189_000.0 - 8.0 * stress * most * coil / (PI * wire.powi(3)),
        14.0 - length,
        ratio - 3.0,
        6.0 - settled,
        length - settled - travel - solid,
        1.25 - travel,
    ]);
}

/// Volume and stress of a truss of two bars.
fn two_bar_truss(x: &[f64], f: &mut [f64]) {
    let (long, short) = ((16.0 + x[2] * x[2]).sqrt(), (1.0 + x[2] * x[2]).sqrt());
    f[0] = x[0] * long + x[1] * short;
    f[1] = 20.0 * long / (x[0] * x[2]);
    f[2] = lacking([0.1 - f[0], 1e5 - f[1], 1e5 - 80.0 * short / (x[2] * x[1])]);
}

/// Cost and deflection of a welded beam.
fn welded_beam(x: &[f64], f: &mut [f64]) {
    let (h, l, t, b) = (x[0], x[1], x[2], x[3]);
    let (load, arm, elasticity, shear_modulus) = (6000.0, 14.0_f64, 30e6, 12e6);
    f[0] = 1.10471 * h * h * l + 0.04811 * t * b * (14.0 + l);
    f[1] = 4.0 * load * arm.powi(3) / (elasticity * b * t.powi(3));
    let lever = square((h + t) / 2.0);
    let radius = (l * l / 4.0 + lever).sqrt();
    let inertia = 2.0 * SQRT_2 * h * l * (l * l / 12.0 + lever);
    let primary = load / (SQRT_2 * h * l);
    let secondary = load * (arm + l / 2.0) * radius / inertia;
    let shear = (primary * primary + primary * secondary * l / radius + secondary * secondary).sqrt();
    let slender = t / (2.0 * arm) * (elasticity / (4.0 * shear_modulus)).sqrt();
    let buckling = 4.013 * elasticity * (t * t * b.powi(6) / 36.0).sqrt() / (arm * arm) * (1.0 - slender);
    f[2] = lacking([
        13_600.0 - shear,
        30_000.0 - 6.0 * load * arm / (b * t * t),
        b - h,
        buckling - load,
    ]);
}

/// Mass and stopping time of a disc brake.
fn disc_brake(x: &[f64], f: &mut [f64]) {
    let (inner, outer, force, surfaces) = (x[0], x[1], x[2], x[3]);
    let ring = outer * outer - inner * inner;
    let cube = outer.powi(3) - inner.powi(3);
    f[0] = 4.9e-5 * ring * (surfaces - 1.0);
    f[1] = 9.82e6 * ring / (force * surfaces * cube);
    f[2] = lacking([
        outer - inner - 20.0,
        // The suite's own value of pi.
        0.4 - force / (3.14 * ring),
        1.0 - 2.22e-3 * force * cube / (ring * ring),
        2.66e-2 * force * surfaces * cube / ring - 900.0,
    ]);
}

/// Mass, acceleration and intrusion of a car in a crash.
fn crash(x: &[f64], f: &mut [f64]) {
    let (a, b, c, d, e) = (x[0], x[1], x[2], x[3], x[4]);
    f[0] = 1640.2823 + 2.3573285 * a + 2.3220035 * b + 4.5688768 * c + 7.7213633 * d + 4.4559504 * e;
    f[1] = 6.5856 + 1.15 * a - 1.0427 * b + 0.9738 * c + 0.8364 * d - 0.3695 * a * d
        + 0.0861 * a * e
        + 0.3628 * b * d
        - 0.1106 * a * a
        - 0.3437 * c * c
        + 0.1764 * d * d;
    f[2] = -0.0551 + 0.0181 * a + 0.1024 * b + 0.0421 * c - 0.0073 * a * b + 0.024 * b * c
        - 0.0118 * b * d
        - 0.0204 * c * d
        - 0.008 * c * e
        - 0.0241 * b * b
        + 0.0109 * d * d;
}

/// Weight and stress of a speed reducer, whose pinion has a whole number of teeth.
fn speed_reducer(x: &[f64], f: &mut [f64]) {
    let (width, module, teeth) = (x[0], x[1], x[2].round());
    let (first, second, thin, thick) = (x[3], x[4], x[5], x[6]);
    f[0] = 0.7854 * width * module * module * (10.0 * teeth * teeth / 3.0 + 14.933 * teeth - 43.0934)
        - 1.508 * width * (thin * thin + thick * thick)
        + 7.477 * (thin.powi(3) + thick.powi(3))
        + 0.7854 * (first * thin * thin + second * thick * thick);
    let stress = |length: f64, level: f64, shaft: f64| {
        (square(745.0 * length / (module * teeth)) + level).sqrt() / (0.1 * shaft.powi(3))
    };
    f[1] = stress(first, 1.69e7, thin);
    f[2] = lacking([
        1.0 / 27.0 - 1.0 / (width * module * module * teeth),
        1.0 / 397.5 - 1.0 / (width * module * module * teeth * teeth),
        1.0 / 1.93 - first.powi(3) / (module * teeth * thin.powi(4)),
        1.0 / 1.93 - second.powi(3) / (module * teeth * thick.powi(4)),
        40.0 - module * teeth,
        12.0 - width / module,
        width / module - 5.0,
        first - 1.5 * thin - 1.9,
        second - 1.1 * thick - 1.9,
        1300.0 - f[1],
        1100.0 - stress(second, 1.575e8, thick),
    ]);
}

/// Error of a gear train's ratio, and its largest wheel.
fn gear_train(x: &[f64], f: &mut [f64]) {
    let teeth: Vec<f64> = x.iter().map(|x| x.round()).collect();
    f[0] = (6.931 - teeth[2] / teeth[0] * teeth[3] / teeth[1]).abs();
    f[1] = teeth.iter().copied().fold(0.0, f64::max);
    f[2] = lacking([0.5 - f[0] / 6.931]);
}

/// Greatest temperatures of a rocket injector's face and tip, and the distance from its inlet.
fn rocket_injector(x: &[f64], f: &mut [f64]) {
    let (a, h, o, t) = (x[0], x[1], x[2], x[3]);
    f[0] = 0.692 + 0.477 * a - 0.687 * h - 0.080 * o - 0.0650 * t - 0.167 * a * a - 0.0129 * h * a
        + 0.0796 * h * h
        - 0.0634 * o * a
        - 0.0257 * o * h
        + 0.0877 * o * o
        - 0.0521 * t * a
        + 0.00156 * t * h
        + 0.00198 * t * o
        + 0.0184 * t * t;
    f[1] = 0.153 - 0.322 * a + 0.396 * h + 0.424 * o + 0.0226 * t + 0.175 * a * a + 0.0185 * h * a
        - 0.0701 * h * h
        - 0.251 * o * a
        + 0.179 * o * h
        + 0.0150 * o * o
        + 0.0134 * t * a
        + 0.0296 * t * h
        + 0.0752 * t * o
        + 0.0192 * t * t;
    f[2] = 0.370 - 0.205 * a + 0.0307 * h + 0.108 * o + 1.019 * t - 0.135 * a * a
        + 0.0141 * h * a
        + 0.0998 * h * h
        + 0.208 * o * a
        - 0.0301 * o * h
        - 0.226 * o * o
        + 0.353 * t * a
        - 0.0497 * t * o
        - 0.423 * t * t
        + 0.202 * h * a * a
        - 0.281 * o * a * a
        - 0.342 * h * h * a
        - 0.245 * h * h * o
        + 0.281 * o * o * h
        - 0.184 * t * t * a
        - 0.281 * h * a * o;
}
