//! What the driven laps are made of: the path in the frame of its samples, and the torque over the wheels' speed.

mod common;

use common::{Random, bundled_car};
use glam::DVec2;
use lapswarm::drive::driver::{WheelTorque, torque_at};
use lapswarm::drive::{Course, DriverSettings, Line, Pose, Road, SpeedPlan, look};
use lapswarm::evaluate::drive::{DriveObjective, DriveProblem, DriveSettings, open_drive_evaluator};
use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::gpu::faults::{self, Fault};
use lapswarm::evaluate::{BackendChoice, FAILED_COST, Failure};
use lapswarm::parity::Draws;
use lapswarm::parity::drive::candidates;
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

/// The only test of this file with a device: faults are of the whole process.
#[test]
fn faults_of_devices_and_figures_that_are_no_car_come_to_no_harm() {
    let problem = lapswarm::parity::drive::problem(bundled_car(), &["stadium:150:60:14"], &[0.4, 0.55], 4e-3)
        .expect("a sound problem");
    let width = problem.dimensions();
    let sound = candidates(&problem, 3, &mut Draws::new(6)).concat();
    let mut choices = vec![BackendChoice::Cpu, BackendChoice::Simd];
    match GpuContext::shared(None) {
        Ok(_) => choices.push(BackendChoice::Gpu),
        Err(error) => {
            let required = std::env::var("LAPSWARM_REQUIRE_GPU").is_ok_and(|x| x == "1");
            assert!(!required, "LAPSWARM_REQUIRE_GPU=1, but {error}");
            eprintln!("IGNORED: no GPU adapter ({error})");
        }
    }
    // Finite here, and more or less than `f32` holds; nought, and what makes no sense.
    let evils = [
        f64::NAN,
        f64::NEG_INFINITY,
        f64::MAX,
        1e39,
        -1e39,
        5e-324,
        0.0,
        -1.0,
    ];
    let mut population = Vec::new();
    for evil in evils {
        for variable in 0..width {
            let mut candidate = sound[..width].to_vec();
            candidate[variable] = evil;
            population.extend(candidate);
        }
    }
    for &choice in &choices {
        let mut evaluator = open_drive_evaluator(&problem, choice, None).expect("it opens");
        let found = evaluator.evaluate(&population).expect("it runs");
        let objectives = problem.problem.objectives.len();
        for (i, failure) in found.failures.iter().enumerate() {
            let row = &found.objectives[i * objectives..(i + 1) * objectives];
            let evil = evils[i / width];
            assert!(row.iter().all(|x| x.is_finite()), "{choice:?}, {evil}: {row:?}");
            let failed = row.iter().all(|x| *x == FAILED_COST);
            assert_eq!(failure.is_some(), failed, "{choice:?}, {evil}: {row:?}");
            if !evil.is_finite() {
                assert_eq!(*failure, Some(Failure::NotFinite), "{choice:?}, {evil}");
            }
        }
    }
    if !choices.contains(&BackendChoice::Gpu) {
        return;
    }
    let open = || open_drive_evaluator(&problem, BackendChoice::Gpu, None).expect("it opens");
    let wanted = open().evaluate(&sound).expect("it runs");
    for (fault, submission) in [(Fault::Lost, 0), (Fault::OutOfMemory, 5), (Fault::Validation, 2)] {
        let mut evaluator = open();
        faults::inject(fault, submission, 1);
        let found = evaluator.evaluate(&sound).expect("it goes on");
        faults::end();
        assert_eq!(found, wanted, "{fault:?}");
        let told = evaluator.device_faults();
        assert_eq!(told.len(), 1, "{told:?}");
    }
}
