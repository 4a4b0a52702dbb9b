//! Curves of one tyre: its force over slip under a load, its peak friction, and the most that it gives in every direction.

use super::{LinearTyre, MagicFormula, Tyre, TyreFile, TyreForces, TyreInput};
use crate::vehicle::steady::{GREATEST_SLIP, greatest};
use std::f64::consts::TAU;

/// A tyre of either model, prepared for an axle.
#[derive(Clone, Debug, PartialEq)]
pub enum AxleTyre {
    /// A Magic Formula tyre, on this side: `+1` left, `-1` right.
    MagicFormula(Box<MagicFormula<f64>>, f64),
    /// A linear tyre.
    Linear(LinearTyre<f64>),
}

/// The greatest force over the load, in each of three directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeakFriction {
    /// To the side where it is greater (-), without slip ratio.
    pub side: f64,
    /// Driving (-), without slip angle.
    pub driving: f64,
    /// Braking (-), without slip angle.
    pub braking: f64,
}

/// Slip angle up to which peaks are looked for (rad): 30 degrees.
const GREATEST_ANGLE: f64 = TAU / 12.0;

impl AxleTyre {
    /// The tyre of a file, upright, on the side on which it was measured.
    pub fn of_file(file: &TyreFile) -> Self {
        let side = if file.coefficients.tyre_side < 0.0 {
            -1.0
        } else {
            1.0
        };
        Self::MagicFormula(Box::new(file.coefficients.prepare(0.0)), side)
    }

    /// Forces under a load (N) at a slip ratio and a slip angle (rad).
    pub fn forces(&self, load: f64, slip_ratio: f64, slip_angle: f64) -> TyreForces<f64> {
        let input = |side| TyreInput {
            load,
            slip_ratio,
            slip_tangent: slip_angle.tan(),
            side,
        };
        match self {
            Self::MagicFormula(tyre, side) => tyre.forces(input(*side)),
            Self::Linear(tyre) => tyre.forces(input(1.0)),
        }
    }

    /// The greatest braking force (N) under a load (N), up to a slip ratio of 0.4. `None` for a linear tyre, whose force has no peak.
    pub fn greatest_braking(&self, load: f64) -> Option<f64> {
        matches!(self, Self::MagicFormula(..)).then(|| {
            let force = |slip: f64| -self.forces(load, slip, 0.0).x;
            force(greatest(-GREATEST_SLIP, 0.0, force))
        })
    }

    /// The peak friction under a load (N), up to a slip angle of 30 degrees and a slip ratio of 0.4. `None` for a linear tyre.
    pub fn peak_friction(&self, load: f64) -> Option<PeakFriction> {
        let braking = self.greatest_braking(load)? / load;
        let along = |slip: f64| self.forces(load, slip, 0.0).x;
        let across = |angle: f64| self.forces(load, 0.0, angle).y.abs();
        let sides = [
            greatest(-GREATEST_ANGLE, 0.0, across),
            greatest(0.0, GREATEST_ANGLE, across),
        ];
        Some(PeakFriction {
            side: across(sides[0]).max(across(sides[1])) / load,
            driving: along(greatest(0.0, GREATEST_SLIP, along)) / load,
            braking,
        })
    }

    /// The greatest force in each direction under a load (N), once round: forces to the left and forward (N). Slip angles go to 30
    /// degrees, slip ratios to 0.4. `None` for a linear tyre.
    pub fn friction_limit(&self, load: f64) -> Option<Vec<[f64; 2]>> {
        /// Slip angles either way, slip ratios either way, and directions.
        const ANGLES: i32 = 60;
        const RATIOS: i32 = 80;
        const DIRECTIONS: i32 = 120;
        if matches!(self, Self::Linear(_)) {
            return None;
        }
        let force = |a: i32, s: i32| {
            let angle = GREATEST_ANGLE * f64::from(a) / f64::from(ANGLES);
            let force = self.forces(load, GREATEST_SLIP * f64::from(s) / f64::from(RATIOS), angle);
            [force.y, force.x]
        };
        // Curves of one slip angle meet every direction but those along the car, which curves of one slip ratio meet.
        let of_angle = |a| (-RATIOS..=RATIOS).map(|s| force(a, s)).collect();
        let of_ratio = |s| (-ANGLES..=ANGLES).map(|a| force(a, s)).collect();
        let curves: Vec<Vec<[f64; 2]>> = (-ANGLES..=ANGLES)
            .map(of_angle)
            .chain((-RATIOS..=RATIOS).map(of_ratio))
            .collect();
        let around = (0..=DIRECTIONS).map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(DIRECTIONS)).sin_cos();
            // How far out a piece of a curve crosses the ray into this direction.
            let crossing = |piece: &[[f64; 2]]| {
                let across = |p: [f64; 2]| cos * p[1] - sin * p[0];
                let along = |p: [f64; 2]| cos * p[0] + sin * p[1];
                let (a, b) = (across(piece[0]), across(piece[1]));
                let share = a / (a - b);
                (0.0..=1.0)
                    .contains(&share)
                    .then(|| along(piece[0]) + share * (along(piece[1]) - along(piece[0])))
            };
            let crossings = curves
                .iter()
                .flat_map(|curve| curve.windows(2).filter_map(crossing));
            let most = crossings.fold(0.0, f64::max);
            [most * cos, most * sin]
        });
        Some(around.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::Car;

    fn slick() -> AxleTyre {
        let file = TyreFile::parse("slick.tir".as_ref(), Car::BUNDLED_TYRE).unwrap();
        AxleTyre::of_file(&file)
    }

    /// 60 kN/rad and 80 kN at 4 kN: at 2 kN and 0.05 rad 1500 N to the right, at a slip ratio of 0.02 800 N forward.
    #[test]
    fn a_linear_tyre_has_straight_curves_and_no_peak() {
        let tyre = AxleTyre::Linear(LinearTyre {
            nominal_load: 4000.0,
            slip_stiffness: 80_000.0,
            cornering_stiffness: 60_000.0,
            trail: 0.0,
        });
        assert!((tyre.forces(2000.0, 0.0, 0.05).y + 1500.0).abs() < 1e-9);
        assert!((tyre.forces(2000.0, 0.02, 0.0).x - 800.0).abs() < 1e-9);
        assert_eq!(tyre.peak_friction(2000.0), None);
        assert_eq!(tyre.greatest_braking(2000.0), None);
        assert_eq!(tyre.friction_limit(2000.0), None);
    }

    /// The file's pDx1 and pDx2, pDy1 and pDy2: 1.6 and 1.55 at 4 kN, a tenth less at 8 kN. Its longitudinal curve has no shift.
    #[test]
    fn friction_peaks_at_the_coefficients_and_falls_with_load() {
        let [nominal, double] = [4000.0, 8000.0].map(|load| slick().peak_friction(load).unwrap());
        assert!((nominal.driving - 1.6).abs() < 1e-4, "{nominal:?}");
        assert!((nominal.braking - 1.6).abs() < 1e-4, "{nominal:?}");
        assert!((double.driving - 1.5).abs() < 1e-4, "{double:?}");
        assert!((nominal.side - 1.55).abs() < 0.01, "{nominal:?}");
        assert!((nominal.side - double.side - 0.1).abs() < 0.01, "{double:?}");
    }

    #[test]
    fn the_limit_has_the_peaks_on_its_axes_and_all_forces_within() {
        let (tyre, load) = (slick(), 4000.0);
        let peak = tyre.peak_friction(load).unwrap();
        let limit = tyre.friction_limit(load).unwrap();
        assert_eq!(limit.len(), 121);
        // The file's combined slip has its greatest weight at a small slip angle, not at none (rHx1).
        let most = |sign: f64| limit.iter().map(|p| sign * p[1]).fold(0.0, f64::max) / load;
        for (found, pure) in [(most(1.0), peak.driving), (most(-1.0), peak.braking)] {
            assert!((0.998..1.01).contains(&(found / pure)), "{found} {pure}");
        }
        let side = limit[0][0].max(-limit[60][0]) / load;
        assert!((side / peak.side - 1.0).abs() < 2e-3, "{side} {peak:?}");
        let out = |p: [f64; 2]| p[0].hypot(p[1]);
        for (slip, angle) in [(0.05, 0.05), (-0.1, 0.03), (0.02, -0.12), (-0.3, 0.3)] {
            let force = tyre.forces(load, slip, angle);
            let direction = force.x.atan2(force.y).rem_euclid(TAU) / TAU * 120.0;
            let around = &limit[direction as usize..direction as usize + 2];
            let most = out(around[0]).max(out(around[1]));
            assert!(out([force.y, force.x]) <= 1.002 * most, "{slip} {angle}");
        }
    }

    #[test]
    fn a_tyre_measured_on_the_right_is_drawn_as_it_was_measured() {
        let mut file = TyreFile::parse("slick.tir".as_ref(), Car::BUNDLED_TYRE).unwrap();
        let unknown = AxleTyre::of_file(&file).forces(4000.0, 0.0, 0.03);
        file.coefficients.tyre_side = -1.0;
        assert_eq!(AxleTyre::of_file(&file).forces(4000.0, 0.0, 0.03), unknown);
    }
}
