//! What kernels must not do, checked on naga's representation.
//!
//! WGSL promises only 2^-11 for the built-in `sin` and `cos` and 4096 ULP for `atan`, and drivers differ by as
//! much: one candidate would have different costs on different machines. Kernels bring their own functions
//! (`shaders/elementary.wgsl`). Double precision is not in WGSL's core, and where drivers offer it, its
//! transcendentals return wrong values without an error.

use naga::{Expression, MathFunction, ScalarKind, TypeInner};
use std::fmt;

/// Something that a kernel must not contain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// The function it stands in, or `module` for declarations.
    pub place: String,
    /// What it is.
    pub what: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} in {}", self.what, self.place)
    }
}

/// Built-ins whose result WGSL leaves to the driver beyond the rounding of one operation.
fn is_loose(function: MathFunction) -> bool {
    use MathFunction as M;
    matches!(
        function,
        M::Cos | M::Cosh | M::Sin | M::Sinh | M::Tan | M::Tanh | M::Acos | M::Asin | M::Atan | M::Atan2
            | M::Asinh | M::Acosh | M::Atanh | M::Exp | M::Exp2 | M::Log | M::Log2 | M::Pow | M::Fma
            // Left to the driver in their order of operations, or made of the above.
            | M::InverseSqrt | M::Mix | M::SmoothStep | M::Dot | M::Length | M::Distance | M::Normalize
            | M::Reflect | M::Refract | M::FaceForward | M::Degrees | M::Radians
    )
}

/// Everything in `module` that a kernel must not contain.
pub fn lint(module: &naga::Module) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (_, ty) in module.types.iter() {
        let scalar = match ty.inner {
            TypeInner::Scalar(scalar)
            | TypeInner::Vector { scalar, .. }
            | TypeInner::Matrix { scalar, .. } => scalar,
            _ => continue,
        };
        if scalar.kind == ScalarKind::Float && scalar.width != 4 {
            findings.push(Finding {
                place: "module".to_owned(),
                what: format!("a {}-bit float type", u32::from(scalar.width) * 8),
            });
        }
    }
    let mut check = |place: &str, expressions: &naga::Arena<Expression>| {
        for (_, expression) in expressions.iter() {
            let what = match expression {
                Expression::Math { fun, .. } if is_loose(*fun) => format!("the built-in {fun:?}"),
                Expression::Literal(naga::Literal::F64(_)) => "an f64 literal".to_owned(),
                _ => continue,
            };
            findings.push(Finding {
                place: place.to_owned(),
                what,
            });
        }
    };
    check("module", &module.global_expressions);
    for (_, function) in module.functions.iter() {
        check(function.name.as_deref().unwrap_or("?"), &function.expressions);
    }
    for entry in &module.entry_points {
        check(&entry.name, &entry.function.expressions);
    }
    findings
}

/// Parses `source` and lints it.
///
/// # Errors
/// What is wrong with the source, or the findings, one per line.
pub fn check(source: &str) -> Result<naga::Module, String> {
    let module = naga::front::wgsl::parse_str(source).map_err(|e| e.emit_to_string(source))?;
    let findings = lint(&module);
    if findings.is_empty() {
        return Ok(module);
    }
    let lines: Vec<String> = findings.iter().map(Finding::to_string).collect();
    Err(lines.join("\n"))
}
