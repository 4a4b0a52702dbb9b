//! The road under a car that is driven: its load, the parts of gravity along and across it, and its friction. Twin of the same
//! functions in `shaders/path.wgsl`.
//!
//! The car stands on the road's surface. Its wheels carry `f_N = v^2 k_n + g e_z.N`, as if gravity were that strong, and gravity
//! pulls at its body by `g e_z.T` backwards and `g e_z.L` to the right. How the road's own pitch and roll turn the body is left out.
//! The friction is that under the car's middle; all wheels have it.

#![deny(clippy::disallowed_methods)]

use super::path::View;
use super::road::Course;
use crate::scalar::{Lookup, Real};
use crate::track::Circuit;
use crate::vehicle::powertrain::GRAVITY_MPS2;
use crate::vehicle::{CarModel, Chassis};

/// Figures of a row of the table of surfaces: gravity along and across the path and square to its surface (m/s^2), curvature square to
/// the surface (1/m), friction on the path as a share of the car's own and what it gains per metre to the left (1/m); two are spare.
pub const RELIEF_WIDTH: usize = 8;
/// Samples to either side from which gradient and curvature are taken: three metres, about a wheelbase.
const REACH: usize = 3;
/// Least friction, far off the path on a road that loses it sideways.
const LEAST_FRICTION: f64 = 0.05;
/// Least load over mass of a car that a crest lifts off the road (m/s^2). A driver divides by it.
const LEAST_LOAD: f64 = 0.5;

/// The road under a car, in the car's own directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footing<R> {
    /// Gravity against the car's forward direction (m/s^2), positive uphill.
    pub climb: R,
    /// Gravity against the car's left (m/s^2), positive where the left side is up.
    pub lean: R,
    /// Load over mass (m/s^2).
    pub load: R,
    /// Friction as a share of the car's own.
    pub friction: R,
}

/// The row of a sample of a circuit; of a level and dry one that of the plane.
pub(super) fn row_of(circuit: &Circuit, sample: usize) -> [f64; RELIEF_WIDTH] {
    let Some(relief) = &circuit.relief else {
        return [0.0, 0.0, GRAVITY_MPS2, 0.0, 1.0, 0.0, 0.0, 0.0];
    };
    let n = relief.z_m.len();
    let reach_m = REACH as f64 * circuit.spacing_m();
    let z = |i: usize| relief.z_m[i % n];
    let (before, here, after) = (z(sample + n - REACH % n), z(sample), z(sample + REACH));
    let slope = 0.5 * (after - before) / reach_m;
    let level = (1.0 + slope * slope).sqrt().recip();
    let bow = (after - 2.0 * here + before) / (reach_m * reach_m) * level.powi(3);
    let (sin, cos) = relief.bank_rad[sample].sin_cos();
    let turn = level * level * circuit.curvature_1pm[sample];
    let [friction, per_m] = relief.friction[sample].at(0.0);
    [
        GRAVITY_MPS2 * slope * level,
        GRAVITY_MPS2 * level * sin,
        GRAVITY_MPS2 * level * cos,
        bow * cos - turn * sin,
        friction,
        per_m,
        0.0,
        0.0,
    ]
}

/// The road under a car at a speed (m/s); `table` has a row for each of the path.
#[inline(always)]
pub fn footing<R: Lookup>(table: &[R::Storage], course: &Course<R>, view: &View<R>, speed: R) -> Footing<R> {
    let number = course.path_at + view.pose.row;
    let (place, _) = number.place(table.len() / RELIEF_WIDTH, RELIEF_WIDTH);
    let share = view.pose.along * course.per_metre;
    let mut figures = [R::lit(0.0); 6];
    for (column, figure) in figures.iter_mut().enumerate() {
        let here = R::pick(table, place, column);
        *figure = here + share * (R::pick(table, place, RELIEF_WIDTH + column) - here);
    }
    let [climb, lean, press, dip, friction, per_m] = figures;
    let load = press + speed * speed * dip;
    Footing {
        // The car points to the left of the path by a small angle.
        climb: climb + view.heading_error * lean,
        lean: lean - view.heading_error * climb,
        load: load.max(R::lit(LEAST_LOAD)),
        friction: (friction + view.offset * per_m).max(R::lit(LEAST_FRICTION)),
    }
}

impl<R: Real> Footing<R> {
    /// The car with the gravity that its wheels feel.
    #[inline(always)]
    pub fn under<T: Copy>(&self, car: &CarModel<R, T>) -> CarModel<R, T> {
        CarModel {
            chassis: Chassis {
                gravity: self.load,
                ..car.chassis
            },
            tyres: car.tyres,
        }
    }
}
