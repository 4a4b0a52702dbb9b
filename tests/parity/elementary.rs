//! Layer one: our own functions, bit for bit.

use crate::common::Random;
use crate::device::{device, map, rounds_like_the_processor};
use lapswarm::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use lapswarm::scalar::elementary;
use lapswarm::scalar::lanes::Lanes;

/// Inputs per function.
const COUNT: usize = 1_000_000;

/// A function, its name in WGSL, and the range of inputs that the physics puts into it with a wide margin.
struct Function {
    shader: &'static str,
    range: (f64, f64),
    scalar: fn(f32) -> f32,
    reference: fn(f64) -> f64,
    /// Results smaller than this are measured in its spacing, as in the functions' own test.
    floor: f64,
    index: usize,
}

const FUNCTIONS: [Function; 7] = [
    Function {
        shader: "own_sin",
        range: (-40.0, 40.0),
        scalar: elementary::sin,
        reference: f64::sin,
        floor: 1e-2,
        index: 0,
    },
    Function {
        shader: "own_cos",
        range: (-40.0, 40.0),
        scalar: elementary::cos,
        reference: f64::cos,
        floor: 1e-2,
        index: 1,
    },
    Function {
        shader: "own_tan",
        range: (-1.2, 1.2),
        scalar: elementary::tan,
        reference: f64::tan,
        floor: 1e-4,
        index: 2,
    },
    Function {
        shader: "own_atan",
        range: (-60.0, 60.0),
        scalar: elementary::atan,
        reference: f64::atan,
        floor: 1e-30,
        index: 3,
    },
    Function {
        shader: "own_exp",
        range: (-87.0, 88.0),
        scalar: elementary::exp,
        reference: f64::exp,
        floor: 1e-30,
        index: 4,
    },
    Function {
        shader: "own_sin_pi",
        range: (-12.0, 12.0),
        scalar: elementary::sin_pi,
        reference: |x| (std::f64::consts::PI * x).sin(),
        floor: 1e-2,
        index: 5,
    },
    Function {
        shader: "own_cos_pi",
        range: (-12.0, 12.0),
        scalar: elementary::cos_pi,
        reference: |x| (std::f64::consts::PI * x).cos(),
        floor: 1e-2,
        index: 6,
    },
];

/// Half evenly through the range, half over all magnitudes down to 1e-12.
fn inputs((low, high): (f64, f64), seed: u64) -> Vec<f32> {
    let mut random = Random(seed);
    (0..COUNT)
        .map(|i| {
            let x = random.within(low, high);
            let shrink = if i % 2 == 0 {
                1.0
            } else {
                10f64.powf(random.within(-12.0, 0.0))
            };
            (x * shrink) as f32
        })
        .collect()
}

struct Mapped<'a>(usize, &'a [f32]);

impl LaneWork for Mapped<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Vec<f32> {
        let mut out = vec![0.0; self.1.len()];
        for (from, to) in self.1.chunks_exact(L::LANES).zip(out.chunks_exact_mut(L::LANES)) {
            let x = L::from_fn(|i| from[i]);
            let y = match self.0 {
                0 => x.sin(),
                1 => x.cos(),
                2 => x.tan(),
                3 => x.atan(),
                4 => x.exp(),
                5 => x.sin_pi(),
                _ => x.cos_pi(),
            };
            y.write(to);
        }
        out
    }
}

/// The first place where two results differ in their bits.
fn first_difference(a: &[f32], b: &[f32]) -> Option<usize> {
    a.iter().zip(b).position(|(a, b)| a.to_bits() != b.to_bits())
}

#[test]
fn lanes_are_the_scalar_bit_for_bit() {
    for f in &FUNCTIONS {
        let x = inputs(f.range, 1);
        let expected: Vec<f32> = x.iter().map(|x| (f.scalar)(*x)).collect();
        for set in InstructionSet::available() {
            let found = dispatch(set, Mapped(f.index, &x));
            if let Some(i) = first_difference(&expected, &found) {
                panic!(
                    "{} of {:e} on {set:?}: {:e} is not {:e}",
                    f.shader, x[i], found[i], expected[i]
                );
            }
        }
    }
}

/// Largest difference on a device that rounds otherwise, in spacings of f32 at the exact value: each of the dozen
/// operations of the longest function may be off by one more, division by 2.5 (WGSL, "Floating Point Accuracy"),
/// but all that act on a small correction of the result count little. Nought for devices that round alike.
const OTHER_DEVICES_ULP: f64 = 8.0;

#[test]
fn the_device_is_the_scalar_bit_for_bit_or_nearly() {
    let Some(context) = device() else { return };
    for f in &FUNCTIONS {
        let x = inputs(f.range, 2);
        let expected: Vec<f32> = x.iter().map(|x| (f.scalar)(*x)).collect();
        let found = map(&context, f.shader, &x);
        if rounds_like_the_processor(&context) {
            if let Some(i) = first_difference(&expected, &found) {
                panic!(
                    "{} of {:e}: {:e} is not {:e}",
                    f.shader, x[i], found[i], expected[i]
                );
            }
            continue;
        }
        for (x, y) in x.iter().zip(&found) {
            let exact = (f.reference)(f64::from(*x));
            let spacing = exact.abs().max(f.floor).log2().floor().exp2() * 2f64.powi(-23);
            let off = (f64::from(*y) - exact).abs() / spacing;
            assert!(
                off <= OTHER_DEVICES_ULP,
                "{} of {x:e}: {y:e} is {off} ULP from {exact:e}",
                f.shader
            );
        }
    }
}
