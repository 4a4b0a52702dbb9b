//! Drag and downforce with centre of pressure, headwind and DRS (the book, chapter Model,
//! section 2).

use super::chassis::Chassis;
use crate::scalar::Real;

/// Aerodynamic forces at one speed, N.
#[derive(Clone, Copy, Debug)]
pub struct AeroForces<R> {
    /// Drag, against the direction of travel through the air.
    pub drag: R,
    /// Downforce on the front axle.
    pub downforce_front: R,
    /// Downforce on the rear axle.
    pub downforce_rear: R,
}

/// Drag `rho/2 CdA Vr |Vr|` and downforce `rho/2 ClA Vr^2` at `Vr = Vx + headwind`, shared by the centre of
/// pressure. An open DRS sheds its share of the whole car's force from the rear part alone.
#[inline(always)]
pub fn aero_forces<R: Real>(chassis: &Chassis<R>, vx: R) -> AeroForces<R> {
    let airspeed = vx + chassis.headwind;
    let half_density = R::lit(0.5) * chassis.air_density;
    let drag = half_density * chassis.drag_area * (airspeed * airspeed.abs());
    let downforce = half_density * chassis.lift_area * (airspeed * airspeed);
    let percent = R::lit(0.01);
    let rear_share = R::lit(1.0) - chassis.pressure_centre;
    AeroForces {
        drag: drag * (R::lit(1.0) - chassis.drs_drag * percent),
        downforce_front: downforce * chassis.pressure_centre,
        // (1 - eta) (1 - T/(1 - eta)) written so that eta = 1 causes no division by zero.
        downforce_rear: downforce * (rear_share - chassis.drs_lift * percent),
    }
}
