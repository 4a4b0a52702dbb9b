//! Tyres: the Magic Formula 5.2 with combined slip, and a linear tyre as the simplest alternative.

mod coefficients;
mod linear;
mod magic_formula;
mod tir;
mod well_formed;

pub use coefficients::TyreCoefficients;
pub use linear::LinearTyre;
pub use tir::TyreFile;
pub use well_formed::IllFormed;

use super::parameters::ParameterInfo;
use crate::scalar::Real;

/// The load under which slopes are reckoned as at this load (N); the forces of an unloaded tyre are nought.
/// It only keeps 0/0 out of slopes that are ratios of things proportional to load.
const LEAST_LOAD: f64 = 1e-3;

/// The static camber of one wheel with its sine, worked out once per car.
#[derive(Clone, Copy, Debug)]
pub struct Camber<R> {
    /// Inclination about the forward axis, positive with the top leaning to the right, rad.
    pub angle: R,
    /// Its sine.
    pub sine: R,
}

impl<R: Real> Camber<R> {
    /// From the angle in radians.
    #[inline(always)]
    pub fn new(angle: R) -> Self {
        Self {
            angle,
            sine: angle.sin(),
        }
    }
}

/// What a tyre feels.
#[derive(Clone, Copy, Debug)]
pub struct TyreInput<R> {
    /// Vertical load, N.
    pub load: R,
    /// Slip ratio, `(R omega - vx)/|vx|`.
    pub slip_ratio: R,
    /// Tangent of the slip angle, `vy/|vx|`.
    pub slip_tangent: R,
    /// Static camber.
    pub camber: Camber<R>,
}

/// What a tyre answers, in its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TyreForces<R> {
    /// Longitudinal force, N.
    pub x: R,
    /// Lateral force, N.
    pub y: R,
    /// Aligning moment, N m.
    pub aligning_moment: R,
}

/// A tyre model over a scalar. Each model has its twin module under `shaders/`.
pub trait Tyre<R: Real>: Copy + Send + Sync {
    /// The model's parameters, in the order of the flat form.
    const PARAMETERS: &'static [ParameterInfo];
    /// Which model it is.
    const MODEL: TyreModel;

    /// From the flat form, `at(i)` being the `i`-th parameter.
    fn from_flat(at: impl FnMut(usize) -> R) -> Self;

    /// Forces and aligning moment.
    fn forces(&self, input: TyreInput<R>) -> TyreForces<R>;
}

/// The tyre models there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TyreModel {
    /// [`TyreCoefficients`].
    MagicFormula,
    /// [`LinearTyre`].
    Linear,
}

impl TyreModel {
    /// The model's parameters, in the order of the flat form.
    pub fn parameters(self) -> &'static [ParameterInfo] {
        match self {
            Self::MagicFormula => TyreCoefficients::<f64>::PARAMETERS,
            Self::Linear => LinearTyre::<f64>::PARAMETERS,
        }
    }

    /// The parameters' names in code, in the same order.
    pub fn fields(self) -> &'static [&'static str] {
        match self {
            Self::MagicFormula => TyreCoefficients::<f64>::FIELDS,
            Self::Linear => LinearTyre::<f64>::FIELDS,
        }
    }
}
