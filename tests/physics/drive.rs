//! What the driven laps are made of: the path in the frame of its samples, and the torque over the wheels' speed.

use crate::common::{Random, bundled_car};
use glam::DVec2;
use lapswarm::drive::driver::{WheelTorque, torque_at};
use lapswarm::drive::{
    CORNERING_SHARES, CORNERING_WIDTH, Course, Drive, DriverSettings, Line, Pose, Road, SpeedPlan, drive,
    drive_planned, look,
};
use lapswarm::evaluate::drive::{DriveObjective, DriveProblem, DriveSettings};
use lapswarm::track::{Circuit, CurvatureRow, CurvatureTable, FrictionAcross, Relief, ReliefChange, Track};
use lapswarm::vehicle::limits::SpeedRange;
use lapswarm::vehicle::model::runge_kutta_step_on;
use lapswarm::vehicle::wheels::moments_under;
use lapswarm::vehicle::{Car, CarFacts, CarInput, CarModel, CarState};
use std::f64::consts::PI;

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

/// A circle of this radius (m), driven to the left, banked by an angle (rad), its left side up.
fn banked(radius_m: f64, bank_rad: f64) -> Circuit {
    let mut circuit = CurvatureTable::circle(radius_m, 12.0, true)
        .build()
        .expect("a circle")
        .0;
    let n = circuit.station_m.len();
    circuit.relief = Some(Relief {
        z_m: vec![0.0; n],
        bank_rad: vec![bank_rad; n],
        friction: vec![FrictionAcross::DRY; n],
        change: ReliefChange::default(),
    });
    circuit
}

/// On a circle banked by `b`, right side up for a left-hander, at `v^2 = g R tan b`, the tyres bear no side force, the body does not
/// lean, and the wheels carry the weight over the cosine with the downforce. The drive goes along the map, where the car turns by
/// `v / R` in place of `v cos b / R`: its speed without side force is that of `sin b`, 1 % less at this banking. The driver holds his
/// speed to a percent, by which the side force is off by two of `g sin b`.
#[test]
fn a_banked_circle_is_driven_without_side_force_at_its_own_speed() {
    let car = bundled_car();
    let (radius, bank) = (200.0, 0.2f64);
    let circuit = banked(radius, -bank);
    let gravity = lapswarm::vehicle::powertrain::GRAVITY_MPS2;
    let speed = (gravity * radius * bank.sin()).sqrt();
    let plan = SpeedPlan::of_speeds(&[0.0], &[speed], circuit.length_m);
    let driven =
        drive_planned(&car, &circuit, plan, &DriverSettings::default(), 0.05).expect("it gets round");
    let last = driven.states.len() - 1;
    let (state, load) = (CarState::from_array(driven.states[last]), driven.loads_mps2[last]);
    assert!(
        (state.body.vx / speed - 1.0).abs() < 0.01,
        "{} for {speed}",
        state.body.vx
    );
    assert!((load * bank.cos() / gravity - 1.0).abs() < 2e-3, "{load}");
    let moment = moments_under(&car, &[(state, driven.inputs[last])], &[load])[0];
    assert!(
        moment.ay_mps2.abs() < 0.02 * gravity * bank.sin(),
        "{}",
        moment.ay_mps2
    );
    assert!(state.body.roll.abs() < 1e-3, "{}", state.body.roll);
    // Without banking the same bend takes all of `v^2 / R`.
    let plan = SpeedPlan::of_speeds(&[0.0], &[speed], circuit.length_m);
    let mut level = circuit;
    level.relief = None;
    let flat = drive_planned(&car, &level, plan, &DriverSettings::default(), 0.05).expect("it gets round");
    let last = flat.states.len() - 1;
    let state = CarState::from_array(flat.states[last]);
    let moment = moments_under(&car, &[(state, flat.inputs[last])], &[])[0];
    assert!(
        (moment.ay_mps2 / (speed * speed / radius) - 1.0).abs() < 0.03,
        "{}",
        moment.ay_mps2
    );
    assert!(flat.loads_mps2.is_empty());
}

/// A road in three dimensions that is level drives as the plane does, to rounding.
#[test]
fn a_road_of_no_height_drives_as_a_level_one() {
    let car = bundled_car();
    let level = circuit("stadium:200:70:14");
    let n = level.station_m.len();
    let mut zero = level.clone();
    zero.relief = Some(Relief {
        z_m: vec![40.0; n],
        bank_rad: vec![0.0; n],
        friction: vec![FrictionAcross::DRY; n],
        change: ReliefChange::default(),
    });
    let settings = DriverSettings {
        pace: 0.5,
        ..DriverSettings::default()
    };
    let (flat, found) = (
        drive(&car, &level, &settings, 0.05),
        drive(&car, &zero, &settings, 0.05),
    );
    let (flat, found) = (flat.expect("it gets round"), found.expect("it gets round"));
    assert_eq!(flat.states.len(), found.states.len());
    for (a, b) in flat.states.iter().zip(&found.states) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }
}

/// The front wheels of a driven car turn no faster than its file allows.
#[test]
fn a_driver_turns_the_wheels_no_faster_than_the_car_allows() {
    let circuit = circuit("stadium:200:70:14");
    let settings = DriverSettings {
        pace: 0.5,
        ..DriverSettings::default()
    };
    let fastest = |rate_radps: f64| {
        let mut car = bundled_car();
        car.max_steer_rate_radps = rate_radps;
        let drive = drive(&car, &circuit, &settings, 0.05).expect("it gets round");
        let turned = drive.inputs.windows(2);
        let rates = turned.map(|pair| (pair[1].steer - pair[0].steer).abs() / 0.05);
        rates.fold(0.0, f64::max)
    };
    let free = fastest(10.0);
    let slow = fastest(0.7 * free);
    assert!(
        slow < 0.7 * free + 1e-9 && slow > 0.6 * free,
        "{slow} of {free} rad/s"
    );
}

/// A circle of 100 m, driven to the left, of this friction on its middle that gains so much per metre to the left.
fn slippery(friction: [f64; 2]) -> Circuit {
    let mut circuit = banked(100.0, 0.0);
    let relief = circuit.relief.as_mut().expect("a surface");
    relief.friction.fill(FrictionAcross::linear(friction, [6.0; 2]));
    circuit
}

/// At half of the friction the bundled car no longer gets round a bend that asks for 10 m/s^2, and gets round one that asks for 5, with
/// wheels that push as hard as on the dry road and slip more.
#[test]
fn a_slippery_road_holds_less_and_slips_more() {
    let car = bundled_car();
    let driven = |friction: [f64; 2], ay: f64| {
        let circuit = slippery(friction);
        let plan = SpeedPlan::of_speeds(&[0.0], &[(ay * 100.0f64).sqrt()], circuit.length_m);
        drive_planned(&car, &circuit, plan, &DriverSettings::default(), 0.05)
    };
    assert!(driven([1.0, 0.0], 10.0).is_ok());
    assert!(driven([0.5, 0.0], 10.0).is_err());
    let [dry, wet] = [1.0, 0.5].map(|friction| {
        let drive = driven([friction, 0.0], 5.0).expect("it gets round");
        let last = drive.states.len() - 1;
        assert_eq!(drive.inputs[last].friction, Some(friction));
        let state = CarState::from_array(drive.states[last]);
        moments_under(&car, &[(state, drive.inputs[last])], &[drive.loads_mps2[last]])[0]
    });
    assert!((wet.ay_mps2 / dry.ay_mps2 - 1.0).abs() < 0.02, "{wet:?} {dry:?}");
    for (wet, dry) in wet.wheels.iter().zip(&dry.wheels) {
        let [pushes, slips] = [
            wet.lateral_n / dry.lateral_n,
            wet.slip_angle_rad / dry.slip_angle_rad,
        ];
        assert!((pushes - 1.0).abs() < 0.05 && slips > 1.05, "{pushes} {slips}");
    }
    // What the road gains to the left, the car has where it drives there.
    let leaning = driven([0.7, 0.05], 5.0).expect("it gets round");
    let last = leaning.states.len() - 1;
    let wanted = 0.7 + 0.05 * leaning.offset_m[last];
    let found = leaning.inputs[last].friction.expect("a friction");
    assert!((found - wanted).abs() < 2e-3, "{found} for {wanted}");
}

/// Rolling without drive or drag over a hill, the car loses the speed that the height takes: `v^2 = v0^2 - 2 g z`. Rolling
/// resistance is none of the model's; the driver's feet are held still.
#[test]
fn a_rolling_car_gives_speed_for_height() {
    let mut car = bundled_car();
    car.chassis.drag_area = 0.0;
    let gravity = car.chassis.gravity;
    let flat = car.to_flat();
    let model = CarModel::<f64, lapswarm::vehicle::MagicFormula<f64>>::from_parameters(&flat);
    let mut state = CarState::straight(40.0);
    let (mut height, mut length, step) = (0.0, 0.0, 1e-3);
    for _ in 0..2000 {
        // A slope that grows and falls.
        let slope = 0.08 * (length / 30.0f64).sin();
        let [front, rear] =
            [car.chassis.radius_front, car.chassis.radius_rear].map(|radius| state.body.vx / radius);
        let input = CarInput {
            wheel_speed: [front, front, rear, rear],
            steer: 0.0,
            flap: 0.0,
            friction: None,
        };
        let before = state.body.vx;
        state = runge_kutta_step_on(
            &model,
            &state,
            |_| input,
            Some([gravity * slope, 0.0]),
            step,
            |_| {},
        );
        let driven = 0.5 * step * (before + state.body.vx);
        length += driven;
        height += slope * driven;
    }
    let wanted = 1600.0 - 2.0 * gravity * height;
    // Wheels at the speed of the step before slip by what gravity takes in a step, 1e-3 m/s of 40, and pull by as much.
    let found = state.body.vx.powi(2);
    assert!(height.abs() > 0.5, "{height}");
    assert!(
        (found - wanted).abs() < 0.05 * (1600.0 - wanted).abs(),
        "{found} for {wanted}"
    );
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

/// A bend of 260 m at 65 m/s takes five sixths of the grip. A driver who knows how both axles slip there stays on his line. One who is
/// told no more than the slip at little of the grip runs wide.
#[test]
fn a_driver_who_knows_the_car_stays_on_his_line_in_long_fast_bends() {
    let car = bundled_car();
    let circuit = banked(260.0, 0.0);
    let off_m = |settings: &DriverSettings| {
        let plan = SpeedPlan::of_speeds(&[0.0], &[65.0], circuit.length_m);
        let driven = drive_planned(&car, &circuit, plan, settings, 0.05).expect("it gets round");
        driven.offset_m.last().expect("a sample").abs()
    };
    let knows = DriverSettings::racing(&car).expect("steady states");
    let mut told_less = knows.clone();
    let map = told_less.knowledge.as_mut().expect("what he knows");
    for row in map
        .figures
        .chunks_exact_mut((CORNERING_SHARES + 1) * CORNERING_WIDTH)
    {
        for (place, angle) in (2..=CORNERING_SHARES).flat_map(|place| [(place, 0), (place, 1)]) {
            row[place * CORNERING_WIDTH + angle] = place as f64 * row[CORNERING_WIDTH + angle];
        }
    }
    let (on_line, wide) = (off_m(&knows), off_m(&told_less));
    assert!(on_line < 0.1 && wide > 2.0 * on_line, "{on_line} m and {wide} m");
}

/// A light car with much downforce carries three times its weight at 70 m/s. The driver knows how it slips there and in slow bends, at
/// seven tenths of the grip in both.
#[test]
fn a_driver_knows_a_car_with_much_downforce_at_every_speed() {
    let facts = CarFacts {
        mass_kg: 680.0,
        downforce_area_m2: 3.2,
        corner_g: Some(2.6),
        cg_height_m: 0.3,
        power_kw: 380.0,
        top_speed_kmh: 300.0,
        ..CarFacts::default()
    };
    let car = facts.car().expect("a car");
    let settings = DriverSettings::racing(&car).expect("steady states");
    let off_m = |settings: &DriverSettings, [radius_m, speed_mps]: [f64; 2]| {
        let circuit = banked(radius_m, 0.0);
        let plan = SpeedPlan::of_speeds(&[0.0], &[speed_mps], circuit.length_m);
        let driven = drive_planned(&car, &circuit, plan, settings, 0.05).expect("it gets round");
        driven.offset_m.last().expect("a sample").abs()
    };
    let (slow, fast) = ([40.0, 25.0], [260.0, 70.0]);
    for bend in [slow, fast] {
        let off_m = off_m(&settings, bend);
        assert!(off_m < 0.1, "{off_m} m in {bend:?}");
    }
    // One who takes what it does at 70 m/s for what it does at any speed strays in slow bends.
    let mut of_one_speed = settings.clone();
    let map = of_one_speed.knowledge.as_mut().expect("what he knows");
    let row = (CORNERING_SHARES + 1) * CORNERING_WIDTH;
    let at_70 = map.figures[6 * row..7 * row].to_vec();
    map.figures = at_70.repeat(map.figures.len() / row);
    let strays_m = off_m(&of_one_speed, slow);
    assert!(strays_m > 0.2, "{strays_m} m");
}

/// Two straights of 600 m and two bends of 80 m radius, whose start line lies so far (m) beyond the middle of a bend.
fn two_bends(beyond_m: f64) -> Circuit {
    let (radius_m, clothoid_m, straight_m) = (80.0, 60.0, 600.0);
    let half_arc_m = 0.5 * (PI * radius_m - clothoid_m);
    let half_lap_m = straight_m + 2.0 * (half_arc_m + clothoid_m);
    let rows = (0..2 * half_lap_m as usize).map(|i| {
        let along_m = (i as f64 + beyond_m).rem_euclid(half_lap_m);
        let from_middle_m = along_m.min(half_lap_m - along_m);
        let curvature_1pm =
            ((half_arc_m + clothoid_m - from_middle_m) / clothoid_m).clamp(0.0, 1.0) / radius_m;
        CurvatureRow {
            station_m: i as f64,
            curvature_1pm,
            width_left_m: 6.0,
            width_right_m: 6.0,
            corner: String::new(),
        }
    });
    let table = CurvatureTable {
        length_m: 2.0 * half_lap_m,
        rows: rows.collect(),
        ..CurvatureTable::circle(radius_m, 12.0, true)
    };
    table.build().expect("two bends").0
}

/// At 34.5 m/s bends of 80 m take nine tenths of the grip. A car that does not turn yet spins in the middle of one. So the run-up
/// begins on the straight before, and the lap takes as long from any start line: a lap of 52.8 s ends within a step of 1 ms, and a car
/// that settles leaves another.
#[test]
fn a_run_up_begins_where_the_car_need_not_turn() {
    let car = bundled_car();
    let settings = DriverSettings::racing(&car).expect("steady states");
    let lap_s = |beyond_m: f64| {
        let circuit = two_bends(beyond_m);
        let plan = SpeedPlan::of_speeds(&[0.0], &[34.5], circuit.length_m);
        let driven = drive_planned(&car, &circuit, plan, &settings, 0.01).expect("it gets round");
        driven.lap_time_s(circuit.length_m, 0.01).expect("a lap")
    };
    // 500 m before the line there is the middle of a bend, or of a straight.
    let (bend_s, straight_s) = (lap_s(500.0), lap_s(500.0 + 455.0));
    assert!(
        (bend_s - straight_s).abs() < 2e-3,
        "{bend_s} s and {straight_s} s"
    );
}

/// In a wide bend the car drives at the top of its envelope. The drag of its tyres there, some 180 N over a slip stiffness of 410 kN,
/// takes 0.03 m/s. At the speed at which the rims would turn with no slip it cannot drive: its engine ends there.
#[test]
fn the_car_reaches_the_top_of_its_envelope() {
    let car = bundled_car();
    let settings = DriverSettings::racing(&car).expect("steady states");
    let speeds = SpeedRange::USUAL.speeds_of(&car).expect("speeds");
    let top_mps = *speeds.last().expect("a top speed");
    let short_mps = |planned_mps: f64| {
        let circuit = banked(600.0, 0.0);
        let plan = SpeedPlan::of_speeds(&[0.0], &[planned_mps], circuit.length_m);
        let driven = drive_planned(&car, &circuit, plan, &settings, 0.05).expect("it gets round");
        planned_mps - driven.states.last().expect("a sample")[0]
    };
    let short = short_mps(top_mps);
    assert!(short.abs() < 0.05, "{short} m/s below {top_mps} m/s");
    let rims_mps = 70.0;
    let short = short_mps(rims_mps);
    assert!(short > 0.4, "{short} m/s below {rims_mps} m/s");
}

/// Braking at 12 m/s^2 from 60 to 30 m/s on the arc of a large circle: half-way the driver is at the planned speed. One who aims for
/// the speed ahead of him has slowed down too early.
#[test]
fn the_driver_brakes_on_his_mark() {
    let car = bundled_car();
    let circuit = banked(600.0, 0.0);
    let braked = |station: f64| (3600.0 - 24.0 * (station - 1500.0).clamp(0.0, 112.5)).sqrt();
    let stations: Vec<f64> = (0..circuit.length_m as usize).map(|i| i as f64).collect();
    // Slowly back to where it began.
    let back =
        |station: f64| 30.0 + 30.0 * ((station - 1700.0) / (circuit.length_m - 1700.0)).clamp(0.0, 1.0);
    let plan_at = |station: f64| {
        if station < 1700.0 {
            braked(station)
        } else {
            back(station)
        }
    };
    let speeds: Vec<f64> = stations.iter().map(|s| plan_at(*s)).collect();
    let off_mps = |settings: &DriverSettings| {
        let plan = SpeedPlan::of_speeds(&stations, &speeds, circuit.length_m);
        let driven = drive_planned(&car, &circuit, plan, settings, 0.01).expect("it gets round");
        let middle = driven.station_m.partition_point(|s| *s < 1556.0);
        driven.states[middle][0] - plan_at(driven.station_m[middle])
    };
    let on_mark = DriverSettings::racing(&car).expect("steady states");
    let early = DriverSettings {
        speed_ahead_s: on_mark.plan_ahead_s,
        ..on_mark.clone()
    };
    let (on_mark, early) = (off_mps(&on_mark), off_mps(&early));
    assert!(
        on_mark.abs() < 0.3 && early < -0.6,
        "{on_mark} m/s and {early} m/s"
    );
}
