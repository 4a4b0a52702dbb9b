//! Tyres: the Magic Formula 5.2 with combined slip, and a linear tyre as the simplest alternative.

mod coefficients;
mod curves;
mod linear;
mod magic_formula;
mod prepared;
mod tir;
mod well_formed;

pub use coefficients::TyreCoefficients;
pub use curves::{AxleTyre, PeakFriction};
pub use linear::LinearTyre;
pub use prepared::MagicFormula;
pub use tir::TyreFile;
pub use well_formed::IllFormed;

use super::parameters::ParameterInfo;
use crate::scalar::Real;

/// Least load with which slopes are computed (N). It avoids 0/0 in slopes that are ratios of two quantities proportional to load.
/// The forces of an unloaded tyre are zero.
const LEAST_LOAD: f64 = 1e-3;

/// The inputs of a tyre.
#[derive(Clone, Copy, Debug)]
pub struct TyreInput<R> {
    /// Vertical load, N.
    pub load: R,
    /// Slip ratio, `(R omega - vx)/|vx|`.
    pub slip_ratio: R,
    /// Tangent of the slip angle, `vy/|vx|`.
    pub slip_tangent: R,
    /// `+1` on the left, `-1` on the right, where the axle's camber leans the other way.
    pub side: R,
}

impl<R: Real> TyreInput<R> {
    /// No force and no moment.
    #[inline(always)]
    pub fn zero() -> Self {
        let zero = R::lit(0.0);
        Self {
            load: zero,
            slip_ratio: zero,
            slip_tangent: zero,
            side: zero,
        }
    }
}

/// The forces of a tyre, in its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TyreForces<R> {
    /// Longitudinal force, N.
    pub x: R,
    /// Lateral force, N.
    pub y: R,
    /// Aligning moment, N m.
    pub aligning_moment: R,
}

/// A tyre model over a scalar, prepared for an axle. Each model has its twin module under `shaders/`.
pub trait Tyre<R: Real>: Copy + Send + Sync {
    /// Which model it is.
    const MODEL: TyreModel;
    /// Names of the figures of its prepared form, in order.
    const FIELDS: &'static [&'static str];

    /// Prepares the tyre for an axle whose left wheel leans to the right by `inclination` (rad). The model's parameters come in
    /// the order of [`TyreModel::parameters`].
    fn from_parameters(flat: &[R], inclination: R) -> Self;

    /// From the figures of the prepared form.
    fn from_flat(flat: &[R]) -> Self;

    /// To the figures of the prepared form.
    fn to_flat(&self) -> Vec<R>;

    /// Forces and aligning moment.
    fn forces(&self, input: TyreInput<R>) -> TyreForces<R>;

    /// Forces and aligning moments of the left and the right wheel of the axle.
    #[inline(always)]
    fn axle_forces(&self, inputs: [TyreInput<R>; 2]) -> [TyreForces<R>; 2] {
        let [left, right] = inputs;
        [self.forces(left), self.forces(right)]
    }

    /// The same on a road with this share of the tyres' own friction, none where that is theirs. By similarity: forces over the friction
    /// are those at slips over it, so that stiffness stays and peaks go with the friction (H. B. Pacejka, *Tyre and Vehicle Dynamics*,
    /// section 4.1).
    #[inline(always)]
    fn axle_forces_on(&self, mut inputs: [TyreInput<R>; 2], friction: Option<R>) -> [TyreForces<R>; 2] {
        // One call: the tyre's code would come twice otherwise, and leave the processor's instruction cache.
        if let Some(friction) = friction {
            let inverse = R::lit(1.0) / friction;
            for input in &mut inputs {
                input.slip_ratio = input.slip_ratio * inverse;
                input.slip_tangent = input.slip_tangent * inverse;
            }
        }
        let mut forces = self.axle_forces(inputs);
        if let Some(friction) = friction {
            for forces in &mut forces {
                forces.x = forces.x * friction;
                forces.y = forces.y * friction;
                forces.aligning_moment = forces.aligning_moment * friction;
            }
        }
        forces
    }
}

/// The tyre models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TyreModel {
    /// [`MagicFormula`].
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::{Car, CarModel};

    /// On a road of half the friction a tyre's greatest force is half, and its stiffness that of the dry road; for slips along and
    /// across.
    #[test]
    fn friction_lowers_the_peak_and_leaves_the_stiffness() {
        let flat = Car::bundled().unwrap().to_flat();
        let tyre = CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat).tyres[1];
        let wheel = |along: f64, across: f64| TyreInput {
            load: 3500.0,
            slip_ratio: along,
            slip_tangent: across,
            side: 1.0,
        };
        for [along, across] in [[1.0, 0.0], [0.0, 1.0]] {
            let force = |slip: f64, friction: Option<f64>| {
                let both = [wheel(slip * along, slip * across); 2];
                let forces = tyre.axle_forces_on(both, friction)[0];
                along * forces.x - across * forces.y
            };
            let greatest = |friction: Option<f64>| {
                let slips = (0..4000).map(|i| 1e-4 * f64::from(i));
                slips.map(|slip| force(slip, friction)).fold(0.0, f64::max)
            };
            let ratio = greatest(Some(0.5)) / greatest(None);
            assert!((ratio - 0.5).abs() < 1e-4, "{ratio}");
            let stiffness = |friction: Option<f64>| force(1e-6, friction) - force(-1e-6, friction);
            let ratio = stiffness(Some(0.5)) / stiffness(None);
            assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        }
    }
}
