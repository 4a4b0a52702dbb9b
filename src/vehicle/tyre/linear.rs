//! The linear tyre: forces proportional to slip and load. Twin of `shaders/tyre_linear.wgsl`.

#![deny(clippy::disallowed_methods)]

use super::{Tyre, TyreForces, TyreInput, TyreModel};
use crate::scalar::Real;
use crate::vehicle::parameters::parameters;

parameters! {
    /// A tyre without saturation, for small slips and for teaching.
    pub struct LinearTyre {
        nominal_load: "nominal_load_n" ["N"] 10.0..=1000000.0, None, "load at which the stiffnesses hold";
        slip_stiffness: "slip_stiffness_n" ["N"] 0.0..=10000000.0, None, "longitudinal force per slip ratio at nominal load";
        cornering_stiffness: "cornering_stiffness_n_per_rad" ["N/rad"] 0.0..=10000000.0, None, "side force per slip angle at nominal load";
        trail: "pneumatic_trail_m" ["m"] 0.0..=0.5, Some(0.0), "distance of the side force behind the contact centre";
    }
}

impl<R: Real> Tyre<R> for LinearTyre<R> {
    const MODEL: TyreModel = TyreModel::Linear;
    const FIELDS: &'static [&'static str] = LinearTyre::<R>::FIELDS;

    fn from_parameters(flat: &[R], _inclination: R) -> Self {
        LinearTyre::from_flat(flat)
    }

    fn from_flat(flat: &[R]) -> Self {
        LinearTyre::from_flat(flat)
    }

    fn to_flat(&self) -> Vec<R> {
        LinearTyre::to_flat(self)
    }

    #[inline(always)]
    fn forces(&self, input: TyreInput<R>) -> TyreForces<R> {
        let share = input.load.max(R::lit(0.0)) / self.nominal_load;
        let y = -(self.cornering_stiffness * input.slip_tangent.atan() * share);
        TyreForces {
            x: self.slip_stiffness * input.slip_ratio * share,
            y,
            aligning_moment: -(self.trail * y),
        }
    }
}
