//! Drag and downforce with centre of pressure, headwind and DRS (the book, chapter Model,
//! section 2).

#![deny(clippy::disallowed_methods)]

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

impl Chassis<f64> {
    /// The car with its DRS held open, as a car without one: the same forces by other areas and another centre of pressure. `None`
    /// if it has no DRS.
    pub fn with_open_drs(&self) -> Option<Self> {
        if self.drs_drag == 0.0 && self.drs_lift == 0.0 {
            return None;
        }
        let left = 1.0 - self.drs_lift / 100.0;
        Some(Self {
            drag_area: self.drag_area * (1.0 - self.drs_drag / 100.0),
            lift_area: self.lift_area * left,
            // A flap that sheds all downforce leaves none to share out.
            pressure_centre: if left > 0.0 {
                self.pressure_centre / left
            } else {
                self.pressure_centre
            },
            drs_drag: 0.0,
            drs_lift: 0.0,
            ..*self
        })
    }
}

/// Drag `rho/2 CdA Vr |Vr|` and downforce `rho/2 ClA Vr^2` at `Vr = Vx + headwind`, shared by the centre of
/// pressure. `flap` is how far the DRS is open, from 0 to 1. Open, it sheds its share of the whole car's force, downforce from the
/// rear part alone.
#[inline(always)]
pub fn aero_forces<R: Real>(chassis: &Chassis<R>, vx: R, flap: R) -> AeroForces<R> {
    let airspeed = vx + chassis.headwind;
    let half_density = R::lit(0.5) * chassis.air_density;
    let drag = half_density * chassis.drag_area * (airspeed * airspeed.abs());
    let downforce = half_density * chassis.lift_area * (airspeed * airspeed);
    let open = R::lit(0.01) * flap;
    let rear_share = R::lit(1.0) - chassis.pressure_centre;
    AeroForces {
        drag: drag * (R::lit(1.0) - chassis.drs_drag * open),
        downforce_front: downforce * chassis.pressure_centre,
        // (1 - eta) (1 - T/(1 - eta)) written so that eta = 1 causes no division by zero.
        downforce_rear: downforce * (rear_share - chassis.drs_lift * open),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::Car;

    #[test]
    fn a_car_whose_flap_is_open_has_the_same_forces_as_one_with_other_areas() {
        let mut chassis = Car::bundled().unwrap().chassis;
        assert_eq!(chassis.with_open_drs(), None);
        (chassis.drs_drag, chassis.drs_lift) = (20.0, 15.0);
        let open = chassis.with_open_drs().unwrap();
        let [found, wanted] = [aero_forces(&open, 50.0, 0.0), aero_forces(&chassis, 50.0, 1.0)];
        for (found, wanted) in [
            (found.drag, wanted.drag),
            (found.downforce_front, wanted.downforce_front),
            (found.downforce_rear, wanted.downforce_rear),
        ] {
            assert!((found / wanted - 1.0).abs() < 1e-12, "{found} {wanted}");
        }
    }
}
