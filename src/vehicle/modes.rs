//! How fast a car's own motions are, how fine the steps of its integration must be, how long it takes to settle, and how it
//! answers to small steering.

use super::chassis::BodyState;
use super::model::{CarInput, CarModel, CarState, wheel_speeds};
use super::tyre::{LinearTyre, MagicFormula, Tyre, TyreModel};
use nalgebra::{Complex, Matrix4, Matrix6, Vector4, Vector6};
use serde::{Deserialize, Serialize};

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

/// How a car whose wheels roll freely answers to small steering at a held speed: its linearised equations of motion, as (3.5) to (3.7)
/// of the thesis have them in matrices.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SmallSteering {
    /// Speed (m/s).
    pub v_mps: f64,
    /// Yaw rate once it has settled, for each radian at the wheels (1/s).
    pub yaw_rate_gain_1ps: f64,
    /// Lateral acceleration once it has settled, for each radian at the wheels (m/s^2).
    pub ay_gain_mps2: f64,
    /// Sideslip at the centre of gravity once it has settled, for each radian at the wheels.
    pub sideslip_gain: f64,
    /// `K` in `yaw rate = v steer / (L (1 + K v^2))` (s^2/m^2); negative oversteers.
    pub stability_factor_s2_per_m2: f64,
    /// Natural frequency of the least damped oscillation (Hz); nothing where none oscillates.
    pub frequency_hz: Option<f64>,
    /// Its damping, as a share of the critical one.
    pub damping_ratio: Option<f64>,
    /// Rate at which the slowest motion dies out (1/s); below zero it grows.
    pub slowest_decay_1ps: f64,
    /// The eigenvalues of sideslip, yaw and roll (1/s), real and imaginary part.
    #[serde(skip)]
    pub eigenvalues_1ps: [[f64; 2]; 4],
}

/// How a car that rolls straight ahead at `speed` (m/s) answers to small steering; nothing for figures that are no car, and where it
/// settles nowhere. `flat` is the car in flat form.
pub fn small_steering(flat: &[f64], tyre: TyreModel, speed: f64) -> Option<SmallSteering> {
    let (linear, wheelbase) = linearised(flat, tyre, speed, Wheels::RollFreely)?;
    // Lateral speed, yaw rate, roll and roll rate; the speed is held, and the car's pitch has no part in them.
    let states: Matrix4<f64> = linear.states.fixed_view::<4, 4>(1, 1).into();
    let steer: Vector4<f64> = linear.steer.fixed_rows::<4>(1).into();
    // Settled: 0 = A x + B steer.
    let settled = states.lu().solve(&-steer)?;
    let eigenvalues = states.complex_eigenvalues();
    let oscillates = |x: &&Complex<f64>| x.im > 1e-6 * x.norm();
    let damping = |x: &Complex<f64>| -x.re / x.norm();
    let least = eigenvalues
        .iter()
        .filter(oscillates)
        .min_by(|a, b| damping(a).total_cmp(&damping(b)));
    let gain = settled[1];
    let stability_factor = (speed / (wheelbase * gain) - 1.0) / speed.powi(2);
    let decay = eigenvalues.iter().map(|x| -x.re).fold(f64::INFINITY, f64::min);
    let finite = settled
        .iter()
        .chain(&[stability_factor, decay])
        .all(|x| x.is_finite());
    finite.then(|| SmallSteering {
        v_mps: speed,
        yaw_rate_gain_1ps: gain,
        ay_gain_mps2: speed * gain,
        sideslip_gain: settled[0] / speed,
        stability_factor_s2_per_m2: stability_factor,
        frequency_hz: least.map(|x| x.norm() / std::f64::consts::TAU),
        damping_ratio: least.map(damping),
        slowest_decay_1ps: decay,
        eigenvalues_1ps: std::array::from_fn(|k| [eigenvalues[k].re, eigenvalues[k].im]),
    })
}

/// The eigenvalues (1/s) of a car that rolls straight ahead; nothing for figures that are no car.
fn modes(flat: &[f64], tyre: TyreModel, speed: f64) -> Option<[Complex<f64>; 6]> {
    let (linear, _) = linearised(flat, tyre, speed, Wheels::Turn)?;
    Some(linear.states.complex_eigenvalues().into())
}

/// What the wheels of a linearised car do.
#[derive(Clone, Copy, PartialEq)]
enum Wheels {
    /// They turn as fast as straight ahead, as a log has them: whatever the car does, they hold it.
    Turn,
    /// They roll without slip.
    RollFreely,
}

/// Slopes of the rates of a car's states: longitudinal and lateral speed, yaw rate, roll, roll rate, lagged acceleration.
struct Linearised {
    /// By the states (`A`).
    states: Matrix6<f64>,
    /// By the steering at the wheels (`B`).
    steer: Vector6<f64>,
}

/// A car that rolls straight ahead, linearised, and its wheelbase (m); nothing for figures that are no car.
fn linearised(flat: &[f64], tyre: TyreModel, speed: f64, wheels: Wheels) -> Option<(Linearised, f64)> {
    match tyre {
        TyreModel::MagicFormula => linearised_on::<MagicFormula<f64>>(flat, speed, wheels),
        TyreModel::Linear => linearised_on::<LinearTyre<f64>>(flat, speed, wheels),
    }
}

/// As [`linearised`], with tyres of this model.
fn linearised_on<T: Tyre<f64>>(flat: &[f64], speed: f64, wheels: Wheels) -> Option<(Linearised, f64)> {
    let car = CarModel::<f64, T>::from_parameters(flat);
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
    let rate = |x: [f64; 6], steer: f64| {
        let (rolling, turned) = match wheels {
            Wheels::Turn => (straight, 0.0),
            Wheels::RollFreely => (x, steer),
        };
        let wheel_speed = wheel_speeds(
            &car.chassis,
            &state(rolling).body,
            (turned.cos(), turned.sin()),
            [0.0; 2],
        );
        let rate = car
            .rate(
                &state(x),
                &CarInput {
                    wheel_speed,
                    steer,
                    flap: 0.0,
                    friction: None,
                },
            )
            .state;
        let body = rate.body;
        Vector6::new(
            body.vx,
            body.vy,
            body.yaw_rate,
            body.roll,
            body.roll_rate,
            rate.pitch_acceleration,
        )
    };
    // Central differences: a state's unit is a tenth or more of what the car has in a corner.
    let step = 1e-5;
    let mut states = Matrix6::zeros();
    for k in 0..6 {
        let [mut above, mut below] = [straight; 2];
        above[k] += step;
        below[k] -= step;
        states.set_column(k, &((rate(above, 0.0) - rate(below, 0.0)) / (2.0 * step)));
    }
    let steer = (rate(straight, step) - rate(straight, -step)) / (2.0 * step);
    let finite = states.iter().chain(&steer).all(|x| x.is_finite());
    let wheelbase = car.chassis.cg_to_front + car.chassis.cg_to_rear;
    finite.then_some((Linearised { states, steer }, wheelbase))
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
    fn small_steering_turns_a_slow_car_by_its_geometry_and_a_fast_one_by_its_balance() {
        let car = Car::load("gt").unwrap();
        let at = |speed: f64| small_steering(&car.to_flat(), car.tyre_model(), speed).expect("a car");
        let wheelbase = car.chassis.cg_to_front + car.chassis.cg_to_rear;
        // Slow cars follow their wheels.
        let slow = at(3.0);
        assert!(
            (slow.yaw_rate_gain_1ps / (3.0 / wheelbase) - 1.0).abs() < 0.01,
            "{slow:?}"
        );
        assert!(
            (slow.sideslip_gain / (car.chassis.cg_to_rear / wheelbase) - 1.0).abs() < 0.05,
            "{slow:?}"
        );
        for speed in [20.0, 45.0, 65.0] {
            let now = at(speed);
            assert!(
                now.eigenvalues_1ps.iter().all(|x| x[0] < 0.0) && now.slowest_decay_1ps > 0.0,
                "{now:?}"
            );
            assert!(
                now.damping_ratio
                    .is_none_or(|damping| (0.1..1.0).contains(&damping)),
                "{now:?}"
            );
            let k = (speed / (wheelbase * now.yaw_rate_gain_1ps) - 1.0) / speed.powi(2);
            assert_eq!(now.stability_factor_s2_per_m2, k);
        }
        // More weight in front understeers, more behind oversteers.
        let moved = |metres: f64| {
            let mut car = Car::load("gt").unwrap();
            let chassis = &mut car.chassis;
            (chassis.cg_to_front, chassis.cg_to_rear) =
                (chassis.cg_to_front - metres, chassis.cg_to_rear + metres);
            small_steering(&car.to_flat(), car.tyre_model(), 30.0)
                .expect("a car")
                .stability_factor_s2_per_m2
        };
        assert!(moved(0.2) > 0.0 && moved(0.2) > moved(0.0) && moved(0.0) > moved(-0.2) && moved(-0.2) < 0.0);
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
