//! What the driven laps are made of: the path in the frame of its samples, and the torque over the wheels' speed.

use crate::common::{Random, bundled_car};
use glam::DVec2;
use lapswarm::drive::driver::{WheelTorque, torque_at};
use lapswarm::drive::{Course, Drive, DriverSettings, Line, Pose, Road, SpeedPlan, drive, look};
use lapswarm::evaluate::drive::{DriveObjective, DriveProblem, DriveSettings};
use lapswarm::track::{Circuit, Track};
use lapswarm::vehicle::Car;

fn circuit(name: &str) -> Circuit {
    Track::load(name).and_then(|t| t.circuit()).expect(name)
}

/// A place beside a circuit, seen from the row that the station lies in or from the one before it.
fn pose(circuit: &Circuit, station: f64, offset: f64, yaw_error: f64, guess: f64) -> (DVec2, Pose<f64>) {
    let heading = circuit.heading_at(station);
    let point = circuit.position_at(station) + offset * DVec2::from_angle(heading).perp();
    let row = ((guess / circuit.spacing_m()) as usize).min(circuit.station_m.len() - 1);
    let away = point - circuit.centreline_m[row];
    let (sin, cos) = circuit.heading_rad[row].sin_cos();
    let pose = Pose {
        row: row as f64,
        lap: 0.0,
        along: guess - row as f64 * circuit.spacing_m(),
        x: away.x * cos + away.y * sin,
        y: away.y * cos - away.x * sin,
        yaw: heading + yaw_error - circuit.heading_rad[row],
    };
    (point, pose)
}

/// The foot found in the frame of a row is the circuit's own projection. A car moves by 0.1 m in a step; twice
/// corrected the foot is then off by less than 1e-9 m, which curvature and its slope (0.1 and 0.01 at most) carry on.
#[test]
fn the_path_in_its_own_frames_is_the_circuit() {
    let car = bundled_car();
    let mut random = Random(4);
    for name in ["silverstone_gp", "ellipse:180:120:14", "stadium:200:70:14"] {
        let circuit = circuit(name);
        let plan = SpeedPlan::new(&car, &circuit, 0.5, 70.0);
        let line = Line {
            circuit: &circuit,
            plans: &[plan],
        };
        let road = Road::new(&[line], &DriverSettings::default(), 1e-3).expect("a closed circuit");
        let course = Course::at(&road, 0.0);
        for case in 0..2000 {
            let station = random.within(1.0, circuit.length_m - 1.0);
            let offset = random.within(-3.0, 3.0);
            let yaw_error = random.within(-0.3, 0.3);
            let guess = station - random.within(0.0, 0.1);
            let (point, pose) = pose(&circuit, station, offset, yaw_error, guess);
            let seen = look(&road.path, &course, &pose);
            let exact = circuit.project(point, station);
            let found = seen.pose.row * course.spacing + seen.pose.along;
            let (left, right) = circuit.widths_at(station);
            for (what, found, exact, allowed) in [
                ("station", found, exact.station_m, 2e-9),
                ("offset", seen.offset, exact.lateral_offset_m, 2e-9),
                ("heading", seen.heading_error, yaw_error, 2e-9),
                ("curvature", seen.bend, exact.curvature_1pm, 2e-9),
                ("beyond", seen.beyond, (offset - left).max(-offset - right), 2e-8),
            ] {
                assert!(
                    (found - exact).abs() < allowed,
                    "{name}, case {case}, {what}: {found} for {exact}"
                );
            }
        }
    }
}

/// Over the wheels' speed, the greatest torque of any gear is in straight stretches; they are the powertrain's own figures.
#[test]
fn the_torque_is_that_of_the_gear_that_gives_most() {
    for car in [bundled_car(), Car::bundled_hybrid().expect("bundled")] {
        let powertrain = car.powertrain.as_ref().expect("it has an engine");
        let torque = WheelTorque::of_car(&car).expect("few points");
        let radius = car.chassis.radius_rear;
        for i in 1..20_000 {
            let speed = f64::from(i) * 0.004;
            let found = torque_at(&torque, speed / radius) / radius;
            let exact = powertrain.wheel_force(speed, radius);
            assert!(
                (found - exact).abs() <= 1e-9 * exact,
                "{}, {speed} m/s: {found} for {exact}",
                car.name
            );
        }
        assert!(torque.stretches.len() < 80, "{}", torque.stretches.len());
    }
}

#[test]
fn problems_that_cannot_be_are_refused() {
    let car = bundled_car();
    let round = circuit("stadium:200:70:14");
    let plans: Vec<SpeedPlan> = [0.4, 0.5]
        .map(|pace| SpeedPlan::new(&car, &round, pace, 70.0))
        .to_vec();
    let mut open = round.clone();
    open.closed = false;
    let settings = DriveSettings::new(DriverSettings::default());
    let coarse = DriveSettings {
        step_s: 0.02,
        ..settings.clone()
    };
    let time = [DriveObjective::LapTime];
    let twice = [DriveObjective::LapTime; 2];
    let go = |circuit, shares: &[f64], settings, objectives: &[DriveObjective]| {
        let line = Line {
            circuit,
            plans: &plans[..shares.len().min(2)],
        };
        let made = DriveProblem::new(car.clone(), Vec::new(), &[line], shares, settings, objectives);
        made.map(|p| p.dimensions()).map_err(|e| e.to_string())
    };
    assert_eq!(go(&round, &[0.4, 0.5], &settings, &time), Ok(1));
    assert_eq!(go(&round, &[0.4], &settings, &time), Ok(0));
    for (outcome, place) in [
        (go(&open, &[0.4, 0.5], &settings, &time), "closed"),
        (go(&round, &[0.5, 0.4], &settings, &time), "shares"),
        (go(&round, &[0.3, 0.4, 0.5], &settings, &time), "shares"),
        (go(&round, &[0.4, 0.5], &coarse, &time), "step_s"),
        (go(&round, &[0.4, 0.5], &settings, &twice), "objectives"),
        (go(&round, &[0.4, 0.5], &settings, &[]), "objectives"),
        (go(&round, &[], &settings, &time), "line"),
    ] {
        let error = outcome.expect_err(place);
        assert!(error.contains(place), "{error}");
    }
    let none = DriveProblem::new(car, Vec::new(), &[], &[0.5], &settings, &time);
    assert_eq!(none.expect_err("no line").exit_code(), 2);
}

/// A headwind of 14 m/s at 35 m/s is 1.4 of the speed in still air: 1.96 of its forces. An open DRS sheds a quarter of the drag.
/// Cars with 1.96 and 0.75 of the areas are driven likewise, if the driver knows what the air does. At other speeds the
/// wind's forces differ a little. A driver who forgets the wind holds 0.3 m/s less.
#[test]
fn the_driver_knows_wind_and_drs() {
    let mut round = circuit("circle:190:204");
    let settings = DriverSettings {
        top_speed_mps: 35.0,
        pace: 0.9,
        ..DriverSettings::default()
    };
    let mut shedding = bundled_car();
    shedding.chassis.drag_area = 4.0;
    let mut small = shedding.clone();
    shedding.chassis.drs_drag = 25.0;
    small.chassis.drag_area = 3.0;
    // Without a zone the flap stays shut, and the car needs more slip to drive it.
    let shut = drive(&shedding, &round, &settings, 0.05).expect("a lap");
    round.drs_zones_m = vec![[0.0, round.length_m]];
    let [one, other] = [shedding, small].map(|car| drive(&car, &round, &settings, 0.05).expect("a lap"));
    assert!(
        shut.inputs.iter().all(|input| input.flap == 0.0) && one.inputs.iter().all(|input| input.flap == 1.0)
    );
    let slips = |lap: &Drive| lap.inputs[99].wheel_speed[2] / lap.states[99][0];
    assert!(slips(&shut) > slips(&one), "{} {}", slips(&shut), slips(&one));
    assert_eq!(one.states.len(), other.states.len());
    for (one, other) in one.states.iter().zip(&other.states) {
        assert!((one[0] - other[0]).abs() < 1e-6, "{one:?} {other:?}");
    }

    let round = circuit("stadium:200:70:14");
    let mut windy = bundled_car();
    windy.chassis.lift_area = 0.0;
    let mut still = windy.clone();
    windy.chassis.headwind = 14.0;
    still.chassis.drag_area *= 1.96;
    let [one, other] = [windy, still].map(|car| {
        let lap = drive(&car, &round, &settings, 0.05).expect("a lap");
        lap.states.iter().map(|state| state[0]).fold(0.0, f64::max)
    });
    assert!((one - other).abs() < 0.03, "{one} {other}");
}
