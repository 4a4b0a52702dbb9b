//! Brake balance: how the front and the rear axle share the braking force of a car that brakes straight on.

use super::aero::aero_forces;
use super::chassis::BodyState;
use super::loads::wheel_loads;
use super::powertrain::GRAVITY_MPS2;
use super::tyre::AxleTyre;
use super::{Car, TyreModel};

/// The axles of a car that brakes straight on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrakedAxles {
    /// Deceleration of the car, drag included (m/s^2).
    pub deceleration_mps2: f64,
    /// Vertical loads of the front and the rear axle (N).
    pub load_n: [f64; 2],
    /// The greatest braking forces of their tyres under these loads (N). `None` for linear tyres.
    pub peak_n: Option<[f64; 2]>,
}

/// The front's part of two.
fn front_share([front, rear]: [f64; 2]) -> f64 {
    front / (front + rear)
}

impl BrakedAxles {
    /// The front's share of the braking force with which both axles use the same share of their load (R. Gillespie, *Fundamentals of
    /// Vehicle Dynamics*, 1992, ch. 3).
    pub fn equal_use(&self) -> f64 {
        front_share(self.load_n)
    }

    /// The front's share with which the tyres of both axles come to their peak at once. `None` for linear tyres.
    pub fn equal_peaks(&self) -> Option<f64> {
        self.peak_n.map(front_share)
    }
}

/// The axles at a speed (m/s) and a deceleration (m/s^2), drag included.
fn axles(car: &Car, tyres: &[AxleTyre; 2], speed_mps: f64, deceleration_mps2: f64) -> BrakedAxles {
    let body = BodyState {
        vx: speed_mps,
        vy: 0.0,
        yaw_rate: 0.0,
        roll: 0.0,
        roll_rate: 0.0,
    };
    let aero = aero_forces(&car.chassis, speed_mps, 0.0);
    // A lifted wheel carries nothing.
    let wheels = wheel_loads(&car.chassis, &body, -deceleration_mps2, &aero).map(|load| load.max(0.0));
    let axle = |k: usize| [wheels[2 * k], wheels[2 * k + 1]];
    let peak =
        |k: usize| -> Option<f64> { axle(k).iter().map(|load| tyres[k].greatest_braking(*load)).sum() };
    BrakedAxles {
        deceleration_mps2,
        load_n: [0, 1].map(|k| axle(k).iter().sum()),
        peak_n: peak(0).zip(peak(1)).map(Into::into),
    }
}

/// A car that brakes straight on at a speed (m/s), from rolling freely to the greatest deceleration of its tyres, in `steps` even
/// steps. With linear tyres, which have no greatest force, it goes to 1 g.
pub fn brake_balance(car: &Car, speed_mps: f64, steps: usize) -> Vec<BrakedAxles> {
    let tyres = car.axle_tyres();
    let drag = aero_forces(&car.chassis, speed_mps, 0.0).drag / car.chassis.mass;
    let mut most = drag + GRAVITY_MPS2;
    if car.tyre_model() == TyreModel::MagicFormula {
        // Load transfer changes the tyres' sum by a small part of what it moves, so that this settles.
        for _ in 0..40 {
            let peak = axles(car, &tyres, speed_mps, most).peak_n;
            most = drag + peak.map_or(0.0, |[front, rear]| front + rear) / car.chassis.mass;
        }
    }
    (0..=steps)
        .map(|i| drag + (most - drag) * i as f64 / steps as f64)
        .map(|deceleration| axles(car, &tyres, speed_mps, deceleration))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::{LinearTyre, Tyres, steady_car};

    /// The front carries b/L at rest. At 4.9 m/s^2 m a h / L of load moves to it, which is 0.08 of the weight for h/L = 0.16.
    #[test]
    fn a_standing_car_brakes_by_its_load_and_a_braking_one_by_its_transfer() {
        let mut car = Car::bundled().unwrap();
        car.chassis.cg_height = 0.16 * 2.6;
        let at_rest = brake_balance(&car, 0.0, 10)[0];
        assert_eq!(at_rest.deceleration_mps2, 0.0);
        assert!((at_rest.equal_use() - 1.17 / 2.6).abs() < 1e-12);
        let braked = axles(&car, &car.axle_tyres(), 0.0, 0.5 * car.chassis.gravity);
        assert!((braked.equal_use() - (1.17 / 2.6 + 0.08)).abs() < 1e-12);
        // Friction falls with load: at equal loads per tyre both shares are one, and the heavier axle has less of the force.
        let peaks = braked.equal_peaks().unwrap();
        assert!(
            braked.equal_use() > 0.5 && peaks < braked.equal_use() && peaks > 0.5,
            "{peaks}"
        );
    }

    #[test]
    fn it_ends_at_the_greatest_braking_of_the_steady_states() {
        let car = Car::bundled().unwrap();
        for speed in [20.0, 60.0] {
            let steady = steady_car(&car);
            let wanted = steady.greatest_braking(speed) + steady.drag(speed);
            let last = *brake_balance(&car, speed, 4).last().unwrap();
            assert!(
                (last.deceleration_mps2 / wanted - 1.0).abs() < 1e-3,
                "{speed}: {last:?}"
            );
        }
    }

    #[test]
    fn linear_tyres_have_the_share_of_the_loads_alone() {
        let mut car = Car::bundled().unwrap();
        let tyre = LinearTyre {
            nominal_load: 3000.0,
            slip_stiffness: 60_000.0,
            cornering_stiffness: 40_000.0,
            trail: 0.0,
        };
        car.tyres = Tyres::Linear {
            front: tyre,
            rear: tyre,
        };
        let last = *brake_balance(&car, 0.0, 4).last().unwrap();
        assert_eq!((last.deceleration_mps2, last.equal_peaks()), (GRAVITY_MPS2, None));
        assert!(last.equal_use() > 0.5);
    }
}
