//! How fast a car's own motions are, how fine the steps of its integration must be, and how long it takes to settle.

use super::chassis::BodyState;
use super::model::{CarInput, CarModel, CarState, wheel_speeds};
use super::tyre::{LinearTyre, MagicFormula, Tyre, TyreModel};
use nalgebra::{Complex, Matrix6};

/// The greatest product of a mode's rate (1/s) and a step (s). The classical Runge-Kutta method is stable up to 2.78 on the negative
/// real axis and 2.82 on the imaginary one (E. Hairer and G. Wanner, *Solving Ordinary Differential Equations II*, 1996, ch. IV.2).
/// The rest is a margin for a car that corners.
pub const STABLE_STEP: f64 = 2.4;
/// Most steps per sample, as many as the setting `substeps` admits. A car that needs more is lost, which its study says.
const MOST_STEPS: usize = 1000;

/// The greatest magnitude (1/s) of the eigenvalues of a car that rolls straight ahead at `speed` (m/s), its wheels free of slip:
/// tyres, roll and the pitch lag. `flat` is the car in flat form ([`super::Car::to_flat`]). Not finite for figures that are no car.
pub fn fastest_mode(flat: &[f64], tyre: TyreModel, speed: f64) -> f64 {
    let modes = modes(flat, tyre, speed);
    modes.map_or(f64::NAN, |modes| {
        modes.iter().map(|x| x.norm()).fold(0.0, f64::max)
    })
}

/// The rate (1/s) at which the slowest of the same motions dies out. It is negative where one of them grows, as that of an
/// oversteering car beyond its critical speed. Not finite for figures that are no car.
pub fn slowest_decay(flat: &[f64], tyre: TyreModel, speed: f64) -> f64 {
    let modes = modes(flat, tyre, speed);
    modes.map_or(f64::NAN, |modes| {
        modes.iter().map(|x| -x.re).fold(f64::INFINITY, f64::min)
    })
}

/// The eigenvalues (1/s) of a car that rolls straight ahead; nothing for figures that are no car.
fn modes(flat: &[f64], tyre: TyreModel, speed: f64) -> Option<[Complex<f64>; 6]> {
    match tyre {
        TyreModel::MagicFormula => modes_of::<MagicFormula<f64>>(flat, speed),
        TyreModel::Linear => modes_of::<LinearTyre<f64>>(flat, speed),
    }
}

fn modes_of<T: Tyre<f64>>(flat: &[f64], speed: f64) -> Option<[Complex<f64>; 6]> {
    let car = CarModel::<f64, T>::from_parameters(|i| flat[i]);
    let state = |x: [f64; 6]| CarState {
        body: BodyState {
            vx: x[0],
            vy: x[1],
            yaw_rate: x[2],
            roll: x[3],
            roll_rate: x[4],
        },
        pitch_acceleration: x[5],
    };
    let straight = [speed, 0.0, 0.0, 0.0, 0.0, 0.0];
    let input = CarInput {
        wheel_speed: wheel_speeds(&car.chassis, &state(straight).body, (1.0, 0.0), [0.0; 2]),
        steer: 0.0,
    };
    let rate = |x: [f64; 6]| {
        let rate = car.rate(&state(x), &input).state;
        let body = rate.body;
        [
            body.vx,
            body.vy,
            body.yaw_rate,
            body.roll,
            body.roll_rate,
            rate.pitch_acceleration,
        ]
    };
    // Central differences: a state's unit is a tenth or more of what the car has in a corner.
    let step = 1e-5;
    let mut jacobian = Matrix6::zeros();
    for k in 0..6 {
        let [mut above, mut below] = [straight; 2];
        above[k] += step;
        below[k] -= step;
        let (above, below) = (rate(above), rate(below));
        for row in 0..6 {
            jacobian[(row, k)] = (above[row] - below[row]) / (2.0 * step);
        }
    }
    let finite = jacobian.iter().all(|x| x.is_finite());
    finite.then(|| jacobian.complex_eigenvalues().into())
}

/// Runge-Kutta steps in which a car with modes up to `fastest` (1/s) is integrated over `interval_s` (s): 1 to 1000.
pub fn stable_steps(interval_s: f64, fastest: f64) -> usize {
    ((interval_s * fastest / STABLE_STEP).ceil() as usize).clamp(1, MOST_STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::Car;

    fn mode(change: impl Fn(&mut Car), speed: f64) -> f64 {
        let mut car = Car::load("gt").unwrap();
        change(&mut car);
        fastest_mode(&car.to_flat(), car.tyre_model(), speed)
    }

    #[test]
    fn slow_cars_and_stiff_springs_are_fast_modes() {
        let chassis = Car::load("gt").unwrap().chassis;
        // The tyres hold a car the faster, the slower it goes.
        assert!(mode(|_| (), 5.0) > 1.3 * mode(|_| (), 10.0));
        // At speed the dampers are the fastest: their rate is damping over inertia, of which the spring takes its part.
        let damped = chassis.roll_damping / chassis.inertia_roll;
        assert!((mode(|_| (), 70.0) / damped - 1.0).abs() < 0.1);
        // A spring a hundred times as stiff is a mode ten times as fast, once it is the fastest of all.
        let stiff = |factor: f64| mode(|car| car.chassis.roll_stiffness *= factor, 40.0);
        let ratio = stiff(1e6) / stiff(1e4);
        assert!((ratio - 10.0).abs() < 0.5, "{ratio}");
    }

    #[test]
    fn a_car_settles_as_fast_as_its_slowest_motion_dies_out() {
        let decay = |change: &dyn Fn(&mut Car), speed: f64| {
            let mut car = Car::load("gt").unwrap();
            change(&mut car);
            slowest_decay(&car.to_flat(), car.tyre_model(), speed)
        };
        // An overdamped roll creeps back at the rate of spring over damper, to within what tyres and inertia add.
        let damped = |car: &mut Car| car.chassis.roll_damping *= 20.0;
        let chassis = Car::load("gt").unwrap().chassis;
        let weight = chassis.mass * chassis.gravity * chassis.cg_height;
        let creeping = (chassis.roll_stiffness - weight) / (20.0 * chassis.roll_damping);
        assert!((decay(&damped, 20.0) / creeping - 1.0).abs() < 0.1);
        // The tyres damp yaw and sideslip the less, the faster the car goes.
        assert!(decay(&|_| (), 200.0) < 0.8 * decay(&|_| (), 70.0));
        // With its weight far behind, the car spins by itself at speed.
        let heavy_tail = |car: &mut Car| {
            let c = &mut car.chassis;
            (c.cg_to_front, c.cg_to_rear) = (c.cg_to_front + 0.8, c.cg_to_rear - 0.8);
        };
        assert!(decay(&heavy_tail, 70.0) < 0.0);
    }

    #[test]
    fn steps_stay_within_what_is_stable() {
        assert_eq!(stable_steps(0.02, 100.0), 1);
        assert_eq!(stable_steps(0.02, 130.0), 2);
        assert_eq!(stable_steps(0.02, 0.0), 1);
        assert_eq!(
            [f64::NAN, f64::INFINITY].map(|fastest| stable_steps(0.02, fastest)),
            [1, 1000]
        );
    }
}
