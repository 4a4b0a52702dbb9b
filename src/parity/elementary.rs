//! Layer one: our own elementary functions.

use super::{Agreement, Draws, Subject, map, spacing};
use crate::error::Result;
use crate::evaluate::simd::{LaneWork, dispatch};
use crate::scalar::elementary;
use crate::scalar::lanes::Lanes;

/// Inputs per function, a multiple of every width of lanes.
const COUNT: usize = 1 << 18;

/// A function, and the range of inputs that the physics puts into it with a wide margin.
pub struct Function {
    /// The function's name; shaders have `own_` before it.
    pub name: &'static str,
    /// Greatest size of an input.
    reach: f64,
    scalar: fn(f32) -> f32,
    reference: fn(f64) -> f64,
    /// Results smaller than this are measured in its spacing: functions that cross zero between representable
    /// arguments.
    floor: f64,
    /// Most ULP that our own polynomial is off: the sum of the roundings of its last operations, about one for the
    /// final sum, half for each factor, and its own error. At the top of the waves by half turns the last two factors
    /// and the term before them each round by a whole spacing, as those just below one are half of those above it.
    own_ulp: f64,
}

impl Function {
    const fn new(
        name: &'static str,
        reach: f64,
        (scalar, reference): (fn(f32) -> f32, fn(f64) -> f64),
        floor: f64,
        own_ulp: f64,
    ) -> Self {
        Self {
            name,
            reach,
            scalar,
            reference,
            floor,
            own_ulp,
        }
    }
}

fn sin_pi(x: f64) -> f64 {
    (std::f64::consts::PI * x).sin()
}

fn cos_pi(x: f64) -> f64 {
    (std::f64::consts::PI * x).cos()
}

/// All of them.
pub const FUNCTIONS: [Function; 7] = [
    Function::new("sin", 40.0, (elementary::sin, f64::sin), 1e-2, 3.0),
    Function::new("cos", 40.0, (elementary::cos, f64::cos), 1e-2, 3.0),
    Function::new("tan", 1.2, (elementary::tan, f64::tan), 1e-4, 4.0),
    Function::new("atan", 50.0, (elementary::atan, f64::atan), 1e-30, 3.0),
    Function::new("exp", 20.0, (elementary::exp, f64::exp), 1e-30, 2.5),
    Function::new("sin_pi", 12.0, (elementary::sin_pi, sin_pi), 1e-2, 4.0),
    Function::new("cos_pi", 12.0, (elementary::cos_pi, cos_pi), 1e-2, 4.0),
];

/// More that a device may be off that rounds otherwise, in ULP: each of the dozen operations of the longest function
/// may be off by one more, division by 2.5 (WGSL, "Floating Point Accuracy"), but all that act on a small correction of
/// the result count little.
const OTHER_DEVICES_ULP: f64 = 5.0;

/// Half evenly through the range, half over all magnitudes down to 1e-12.
fn inputs(reach: f64, seed: u64) -> Vec<f32> {
    let mut draws = Draws::new(seed);
    (0..COUNT)
        .map(|i| {
            let x = draws.within(-reach, reach);
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

/// Every function on `subject`: within a few ULP of `f64`, and where the subject rounds as the processor does, the bits
/// of the plain scalar.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn compare(subject: &Subject) -> Result<Vec<Agreement>> {
    FUNCTIONS
        .iter()
        .enumerate()
        .map(|(index, f)| {
            let x = inputs(f.reach, index as u64 + 1);
            let found = match subject {
                Subject::Lanes(set) => dispatch(*set, Mapped(index, &x)),
                Subject::Device(context) => map(context, &format!("own_{}", f.name), &x)?,
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
