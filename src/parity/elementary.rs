//! Layer one: our own elementary functions.

use super::{Agreement, Draws, Subject, map, spacing};
use crate::error::Result;
use crate::evaluate::simd::{InstructionSet, LaneWork, dispatch};
use crate::scalar::elementary;
use crate::scalar::lanes::Lanes;

/// Inputs per function, a multiple of every width of lanes.
const COUNT: usize = 1 << 18;

/// A function, its name in WGSL, and the range of inputs that the physics puts into it with a wide margin.
pub struct Function {
    /// The function's name.
    pub name: &'static str,
    /// Its name in the shaders.
    pub shader: &'static str,
    range: (f64, f64),
    scalar: fn(f32) -> f32,
    reference: fn(f64) -> f64,
    /// Results smaller than this are measured in its spacing: functions that cross zero between representable
    /// arguments.
    floor: f64,
    /// Most ULP that our own polynomial is off: the sum of the roundings of its last operations, about one for the
    /// final sum, half for each factor, and its own error. At the top of the waves by half turns the last two factors
    /// and the term before them each round by a whole spacing, as those just below one are half of those above it.
    own_ulp: f64,
    index: usize,
}

/// All of them.
pub const FUNCTIONS: [Function; 7] = [
    Function {
        name: "sin",
        shader: "own_sin",
        range: (-40.0, 40.0),
        scalar: elementary::sin,
        reference: f64::sin,
        floor: 1e-2,
        own_ulp: 3.0,
        index: 0,
    },
    Function {
        name: "cos",
        shader: "own_cos",
        range: (-40.0, 40.0),
        scalar: elementary::cos,
        reference: f64::cos,
        floor: 1e-2,
        own_ulp: 3.0,
        index: 1,
    },
    Function {
        name: "tan",
        shader: "own_tan",
        range: (-1.2, 1.2),
        scalar: elementary::tan,
        reference: f64::tan,
        floor: 1e-4,
        own_ulp: 4.0,
        index: 2,
    },
    Function {
        name: "atan",
        shader: "own_atan",
        range: (-50.0, 50.0),
        scalar: elementary::atan,
        reference: f64::atan,
        floor: 1e-30,
        own_ulp: 3.0,
        index: 3,
    },
    Function {
        name: "exp",
        shader: "own_exp",
        range: (-20.0, 20.0),
        scalar: elementary::exp,
        reference: f64::exp,
        floor: 1e-30,
        own_ulp: 2.5,
        index: 4,
    },
    Function {
        name: "sin_pi",
        shader: "own_sin_pi",
        range: (-12.0, 12.0),
        scalar: elementary::sin_pi,
        reference: |x| (std::f64::consts::PI * x).sin(),
        floor: 1e-2,
        own_ulp: 4.0,
        index: 5,
    },
    Function {
        name: "cos_pi",
        shader: "own_cos_pi",
        range: (-12.0, 12.0),
        scalar: elementary::cos_pi,
        reference: |x| (std::f64::consts::PI * x).cos(),
        floor: 1e-2,
        own_ulp: 4.0,
        index: 6,
    },
];

/// More that a device may be off that rounds otherwise, in ULP: each of the dozen operations of the longest function
/// may be off by one more, division by 2.5 (WGSL, "Floating Point Accuracy"), but all that act on a small correction of
/// the result count little.
const OTHER_DEVICES_ULP: f64 = 5.0;

/// Half evenly through the range, half over all magnitudes down to 1e-12.
fn inputs((low, high): (f64, f64), seed: u64) -> Vec<f32> {
    let mut draws = Draws::new(seed);
    (0..COUNT)
        .map(|i| {
            let x = draws.within(low, high);
            let shrink = if i % 2 == 0 {
                1.0
            } else {
                10f64.powf(draws.within(-12.0, 0.0))
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

fn in_lanes(set: InstructionSet, function: &Function, inputs: &[f32]) -> Vec<f32> {
    dispatch(set, Mapped(function.index, inputs))
}

/// Every function on `subject`: within a few ULP of `f64`, and where the subject rounds as the processor does, the bits
/// of the plain scalar.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn compare(subject: &Subject) -> Result<Vec<Agreement>> {
    FUNCTIONS
        .iter()
        .map(|f| {
            let x = inputs(f.range, f.index as u64 + 1);
            let found = match subject {
                Subject::Lanes(set) => in_lanes(*set, f, &x),
                Subject::Device(context) => map(context, f.shader, &x)?,
            };
            let alike = subject.rounds_like_the_processor();
            let ulp = f.own_ulp + if alike { 0.0 } else { OTHER_DEVICES_ULP };
            let mut agreement = Agreement::new(f.name, subject);
            for (x, y) in x.iter().zip(&found) {
                let exact = (f.reference)(f64::from(*x));
                let scale = exact.abs().max(f.floor);
                agreement.note(f64::from(*y), exact, scale, ulp * spacing(scale), || {
                    format!("{}({x:e})", f.name)
                });
            }
            let parted = x
                .iter()
                .zip(&found)
                .find(|(x, y)| (f.scalar)(**x).to_bits() != y.to_bits());
            agreement.bits_as_scalar = Some(parted.is_none());
            if alike {
                agreement.verdict(parted.is_none(), || {
                    parted.map_or(String::new(), |(x, y)| {
                        format!(
                            "{}({x:e}): {y:e} has other bits than {:e}",
                            f.name,
                            (f.scalar)(*x)
                        )
                    })
                });
            }
            Ok(agreement)
        })
        .collect()
}
