use super::*;
use crate::vehicle::{Powertrain, Tyres};

/// A car on tyres whose side force is proportional to slip angle and load, with even aero and its loads even.
fn linear_car() -> Car {
    let mut car = Car::bundled().unwrap();
    let tyre = |stiffness: f64| LinearTyre {
        nominal_load: 3000.0,
        slip_stiffness: 60_000.0,
        cornering_stiffness: stiffness,
        trail: 0.0,
    };
    car.tyres = Tyres::Linear {
        front: tyre(40_000.0),
        rear: tyre(55_000.0),
    };
    car
}

#[test]
fn a_linear_car_steers_as_the_bicycle_model_has_it() {
    let mut car = linear_car();
    car.chassis.lift_area = 0.0;
    car.chassis.drag_area = 0.0;
    let c = car.chassis;
    let (a, b, speed) = (c.cg_to_front, c.cg_to_rear, 30.0);
    // Loads are static without aero or push, so an axle's stiffness is two tyres' at their static load.
    let weight = c.mass * c.gravity;
    let stiffness = |per_tyre: f64, share: f64| per_tyre * weight * share / 3000.0;
    let front = stiffness(40_000.0, b / (a + b));
    let rear = stiffness(55_000.0, a / (a + b));
    let gradient = c.mass / (a + b) * (b / front - a / rear);
    let trims = steady_car(&car).cornering(speed, 0.17, Turn::Left);
    let [side, yaw] = steady_car(&car).sideslip_stiffness(speed);
    assert!((side / (front + rear) - 1.0).abs() < 1e-9, "{side}");
    assert!((yaw / (b * rear - a * front) - 1.0).abs() < 1e-9, "{yaw}");
    let small = trims.iter().find(|t| t.ay_mps2 > 0.01).unwrap();
    let bicycle = (a + b) * small.ay_mps2 / speed.powi(2) + gradient * small.ay_mps2;
    // The first point lies at a few hundredths of a m/s^2: angles of 1e-3 rad, whose squares are a millionth,
    // and load transfer of 1e-3 of the load, which cancels across an axle of tyres linear in load.
    assert!(
        (small.steer_rad / bicycle - 1.0).abs() < 1e-4,
        "{} {bicycle}",
        small.steer_rad
    );
}

#[test]
fn trims_of_the_bundled_car_stand_still_and_reach_a_peak() {
    let car = Car::bundled().unwrap();
    let steady = steady_car(&car);
    for speed in [16.0, 25.0, 45.0, 65.0] {
        let trims = steady.cornering(speed, 0.1745, Turn::Left);
        let peak = trims.iter().map(|t| t.ay_mps2).fold(0.0, f64::max);
        assert!(trims.len() > 10 && peak > 10.0, "{speed}: {} {peak}", trims.len());
        // What the wheels carry is the car and its downforce.
        let aero = aero_forces(&car.chassis, speed * trims[5].sideslip_rad.cos(), 0.0);
        let carried: f64 = trims[5].wheel_load_n.iter().sum();
        let weight = car.chassis.mass * car.chassis.gravity + aero.downforce_front + aero.downforce_rear;
        assert!((carried / weight - 1.0).abs() < 1e-12);
    }
}

#[test]
fn braking_finds_both_axles_peaks() {
    let car = Car::bundled().unwrap();
    let steady = steady_car(&car);
    let found = steady.greatest_braking(40.0);
    let ready = Ready::<MagicFormula<f64>, MagicFormula<Exact>>::new(&car);
    let scanned = (0..=80)
        .flat_map(|i| (0..=80).map(move |j| [-0.005 * f64::from(i), -0.005 * f64::from(j)]))
        .map(|slip| -ready.push(40.0, slip))
        .fold(0.0, f64::max);
    // The scan is coarser than the search: it may fall short by the curvature of the peak over 0.005 of slip.
    assert!(found >= scanned && found < 1.002 * scanned, "{found} {scanned}");
    assert!(steady.greatest_traction(40.0) < found);
}

/// A car whose right tyres are the mirror image of its left ones.
fn mirrored_car() -> Car {
    let mut car = Car::bundled().unwrap();
    if let Tyres::MagicFormula { front, rear } = &mut car.tyres {
        (front.coefficients.tyre_side, rear.coefficients.tyre_side) = (1.0, 1.0);
    }
    car
}

/// In the widest of bends the wheels push as they do running straight, where the greatest push is found by a scan of the slip.
#[test]
fn a_straight_is_the_widest_bend() {
    let steady = steady_car(&mirrored_car());
    let ready = Ready::<MagicFormula<f64>, MagicFormula<Exact>>::new(&mirrored_car());
    for speed in [20.0, 60.0] {
        let curve = steady.cornering(speed, 0.6, Turn::Left);
        let bend = steady.greatest_drive(speed, 0.02, 0.6, &curve, 5.0).unwrap();
        let straight = steady.greatest_traction(speed);
        let pushed = bend.traction_mps2;
        assert!(
            (pushed / straight - 1.0).abs() < 1e-3,
            "{speed}: {pushed} {straight}"
        );
        // The slip at which the wheels make the power of 5 m/s^2.
        let (mut low, mut high) = (0.0, 0.06);
        for _ in 0..40 {
            let slip = 0.5 * (low + high);
            if (1.0 + slip) * ready.push(speed, [0.0, slip]) < 5.0 {
                low = slip
            } else {
                high = slip
            }
        }
        let wanted = ready.push(speed, [0.0, low]);
        assert!(
            (bend.engine_mps2 - wanted).abs() < 2e-3,
            "{speed}: {bend:?} {wanted}"
        );
    }
}

/// The side force `F` of an axle of stiffness `C` points back by its slip angle `F / C` and takes `F^2 / C`; the driven wheels turn
/// faster than the road passes by force over stiffness. To first order: angles are a tenth of a radian at most, whose squares are a
/// hundredth.
#[test]
fn a_bend_takes_the_drag_of_its_side_forces() {
    let mut car = linear_car();
    (car.chassis.lift_area, car.chassis.drag_area) = (0.0, 0.0);
    let c = car.chassis;
    let (a, b) = (c.cg_to_front, c.cg_to_rear);
    let weight = c.mass * c.gravity;
    let [front, rear] = [b / (a + b), a / (a + b)];
    let steady = steady_car(&car);
    let curve = steady.cornering(30.0, 0.6, Turn::Left);
    for ay in [3.0, 6.0] {
        let found = steady.greatest_drive(30.0, ay, 0.6, &curve, 1.0).unwrap();
        let side =
            |share: f64, per_tyre: f64| (c.mass * ay * share).powi(2) / (per_tyre * weight * share / 3000.0);
        // A slip ratio for each 60 kN on 3 kN of load.
        let slip = 1.0 / (20.0 * rear * c.gravity);
        let taken = (side(front, 40_000.0) + side(rear, 55_000.0)) / c.mass + slip;
        let lost = 1.0 - found.engine_mps2;
        assert!((lost / taken - 1.0).abs() < 0.03, "{ay}: {lost} {taken}");
    }
}

#[test]
fn both_sides_of_a_mirrored_car_push_alike() {
    let steady = steady_car(&mirrored_car());
    let [left, right] = [Turn::Left, Turn::Right].map(|turn| steady.cornering(40.0, 0.6, turn));
    let found = [(10.0, &left), (-10.0, &right)].map(|(ay, curve)| {
        let most = steady.greatest_drive(40.0, ay, 0.6, curve, 5.0);
        most.unwrap().traction_mps2
    });
    assert!((found[0] / found[1] - 1.0).abs() < 1e-6, "{found:?}");
    assert_eq!(steady.greatest_drive(40.0, 30.0, 0.6, &left, 5.0), None);
}

#[test]
fn the_engine_has_no_part_in_traction() {
    let mut car = Car::bundled().unwrap();
    let before = steady_car(&car).greatest_traction(30.0);
    car.powertrain = None::<Powertrain>;
    assert_eq!(steady_car(&car).greatest_traction(30.0), before);
}
