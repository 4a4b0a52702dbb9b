//! Refuses Magic Formula coefficients that describe no tyre. Each candidate is checked once in `f64`, before any integration, so
//! that every backend refuses the same candidates for the same reasons.

use super::{LEAST_LOAD, Tyre, TyreCoefficients, TyreInput};
pub use crate::evaluate::IllFormed;
use std::f64::consts::FRAC_PI_2;

/// Loads (in nominal loads) at which a tyre is checked: from a nearly lifted wheel to a loaded outer one.
const LOADS: [f64; 4] = [0.1, 0.5, 1.0, 2.0];
/// The least peak friction, a hundredth of that on wet ice; below it slopes divide by (nearly) zero.
const LEAST_FRICTION: f64 = 1e-3;
/// The least stiffness per load, a hundredth of a real tyre's. Other terms divide by stiffness, and a very small number in `f64`
/// may be zero in single precision.
const LEAST_STIFFNESS: f64 = 0.1;
/// The slip within which the weights must stay positive, as slip ratio and as tangent of the slip angle.
const WORKING_SLIP: f64 = 0.15;
/// The least denominator of a weight: below it the formula multiplies forces more than tenfold.
const LEAST_DENOMINATOR: f64 = 0.1;

impl TyreCoefficients<f64> {
    /// Whether the coefficients describe a tyre (the book, chapter Model, section 1).
    ///
    /// # Errors
    /// The reason why they do not.
    pub fn well_formed(&self) -> Result<(), IllFormed> {
        if self.to_flat().iter().any(|x| !x.is_finite()) {
            return Err(IllFormed::NotFinite);
        }
        // A weight's denominator is cos(c atan u). It is above `least`, and was all the way from u = 0, where |u| is below this.
        let reach = |c: f64, least: f64| {
            let angle = least.acos() / c.abs();
            if angle < FRAC_PI_2 {
                angle.tan()
            } else {
                f64::INFINITY
            }
        };
        let [denominator_x, denominator_y] =
            [self.rcx1, self.rcy1].map(|c| [reach(c, LEAST_DENOMINATOR), reach(c, 0.0)]);
        let within = |most: f64, b: f64, e: f64, x: f64| {
            let u = b * x - e.min(1.0) * (b * x - (b * x).atan());
            u.abs() < most
        };
        let tyre = self.prepare(0.0);
        for share in LOADS {
            let nominal = self.fnomin * self.lfz0;
            let dfz = share - 1.0;
            if !((self.pdx1 + self.pdx2 * dfz) * self.lmux > LEAST_FRICTION
                && (self.pdy1 + self.pdy2 * dfz) * self.lmuy > LEAST_FRICTION)
            {
                return Err(IllFormed::Friction);
            }
            let z = share / self.pky2;
            let slip_stiffness = (self.pkx1 + self.pkx2 * dfz) * (self.pkx3 * dfz).exp() * self.lkx;
            let cornering_stiffness = -self.pky1 * (2.0 * z / (1.0 + z * z)) * self.lky / share;
            if !(slip_stiffness > LEAST_STIFFNESS && cornering_stiffness > LEAST_STIFFNESS) {
                return Err(IllFormed::Stiffness);
            }
            let ex = self.rex1 + self.rex2 * dfz;
            let ey = self.rey1 + self.rey2 * dfz;
            let shift = self.rhy1 + self.rhy2 * dfz;
            // The slopes are steepest where the other slip is zero, so the denominators are least there.
            let bx = self.rbx1 * self.lxal;
            let by = self.rby1 * self.lyka;
            for (slip, which) in [(0.0, 0), (-WORKING_SLIP, 1), (WORKING_SLIP, 1)] {
                if !(within(denominator_x[which], bx, ex, slip + self.rhx1)
                    && within(denominator_y[which], by, ey, slip + shift))
                {
                    return Err(IllFormed::Weighting);
                }
            }
            let forces = tyre.forces(TyreInput {
                load: (share * nominal).max(LEAST_LOAD),
                slip_ratio: WORKING_SLIP,
                slip_tangent: WORKING_SLIP,
                side: 1.0,
            });
            if !(forces.x.is_finite() && forces.y.is_finite() && forces.aligning_moment.is_finite()) {
                return Err(IllFormed::NotFinite);
            }
        }
        Ok(())
    }
}
