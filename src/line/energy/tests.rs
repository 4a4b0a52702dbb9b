use super::*;
use crate::evaluate::energy::{Free, HybridLine, HybridObjective, HybridProblem, Strategy};
use crate::vehicle::limits::{SpeedRange, car_envelope};
use crate::vehicle::{Car, EnvelopeRow};
use glam::DVec2;
use proptest::prelude::*;
use std::f64::consts::TAU;
use std::sync::OnceLock;

pub(super) fn car() -> &'static EnergyCar {
    static CAR: OnceLock<EnergyCar> = OnceLock::new();
    CAR.get_or_init(|| {
        let car = Car::load("gt_hybrid").unwrap();
        let coarse = SpeedRange {
            step_mps: 10.0,
            ..SpeedRange::USUAL
        };
        let limits = car_envelope(&car, &coarse).unwrap();
        let traction = limits.traction();
        EnergyCar::new(car, limits.envelope, traction, 2.0).unwrap()
    })
}

/// A bean of some 2 km with bends of all kinds.
fn bean() -> Vec<DVec2> {
    (0..250)
        .map(|i| {
            let angle = TAU * f64::from(i) / 250.0;
            let radius = 320.0 + 90.0 * (2.0 * angle).sin() + 25.0 * (5.0 * angle).cos();
            radius * DVec2::from_angle(angle)
        })
        .collect()
}

/// The car without its MGU-H.
pub(super) fn car_without_h() -> EnergyCar {
    let hybrid = crate::vehicle::Hybrid {
        mgu_h: None,
        ..car().hybrid.clone()
    };
    car().with_hybrid(hybrid).unwrap()
}

fn problem(mode: Mode) -> HybridProblem {
    problem_of(car().clone(), mode)
}

fn problem_of(car: EnergyCar, mode: Mode) -> HybridProblem {
    let points_m = bean();
    let n = points_m.len();
    let lengths: Vec<f64> = (0..n)
        .map(|i| points_m[i].distance(points_m[(i + 1) % n]))
        .collect();
    let plan = EnergyPlan::zoned(&lengths, &[10, 80, 140, 200], true, 220, mode);
    let free = [
        Free::Steer,
        Free::Speed,
        Free::Acceleration,
        Free::Soc,
        Free::Energy,
        Free::Motor,
    ];
    let strategy = Strategy {
        free: free.into_iter().chain((0..4).map(Free::Zone)).collect(),
        ..Strategy::fixed(Gates::OPEN, 4)
    };
    let line = HybridLine::Fixed {
        points_m,
        closed: true,
        drs: Vec::new(),
        surface: Vec::new(),
    };
    HybridProblem::new(line, car, plan, strategy, &HybridObjective::ALL, 10.0).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    /// Whatever the strategy: what is in the store at the end is what was there, was harvested and was not deployed; gates
    /// and limits hold on every segment; and a lap with the motor is none slower, if no MGU-H makes use of the space that it leaves
    /// in the store.
    #[test]
    fn books_balance_and_gates_hold(
        additional in any::<bool>(),
        steer in 0.0..0.15f64,
        speed in 15.0..80.0f64,
        ax in 0.0..4.0f64,
        soc in 0.6..1.05f64,
        energy in 0.0..3.0f64,
        motor_kw in 0.0..240.0f64,
        shares in prop::array::uniform4(0.0..1.0f64),
    ) {
        static PROBLEMS: OnceLock<[HybridProblem; 2]> = OnceLock::new();
        let problems = PROBLEMS.get_or_init(|| [problem(Mode::Offset), problem(Mode::Additional)]);
        let problem = &problems[usize::from(additional)];
        let mut candidate = vec![steer, speed, ax, soc, energy, motor_kw];
        candidate.extend(shares);
        let (lap, segments, course) = problem.lap(&candidate);
        let passed = lap.deployed + lap.harvested_k + lap.harvested_h;
        // A rounding of what has passed for every segment and sum.
        let bound = 4.0 * 250.0 * f64::EPSILON * passed.max(1.0);
        prop_assert!((lap.change - (lap.harvested_k + lap.harvested_h - lap.deployed)).abs() <= bound);
        prop_assert!(lap.deployed <= 1e6 * energy + 1e-6);
        let (mut change, mut least) = (0.0f64, 0.0f64);
        for (i, s) in segments.iter().enumerate() {
            if s.deployed > 0.0 {
                prop_assert!(s.start <= speed * speed * (1.0 + 1e-12));
                prop_assert!(course.curvature[i] * 2.6 <= steer * (1.0 + 1e-12));
                // The floor is only ever approached by deploying.
                let floor = (soc - 1.0) * 5.3e6;
                prop_assert!(change - s.deployed >= floor - 1e-6);
            }
            change += s.harvested_k + s.harvested_h - s.deployed;
            least = least.min(change);
            // The store begins full.
            prop_assert!(change <= 1e-6);
            // No more than the motor's power at the mean speed, one way or the other.
            let (joules, shaft) = (1245.0 * course.length[i], 1e3 * motor_kw * s.time * (1.0 + 1e-2));
            prop_assert!(joules * s.motor <= shaft && joules * s.generator * 0.95 <= shaft);
            prop_assert!(s.load <= 1.0 && s.time > 0.0 && s.fuel > 0.0);
            // The wheels' force is what moves the car: engine, motor and brakes against drag.
            prop_assert!(s.engine.min(s.generator + s.hydraulic) < 1e-9);
        }
        let closed = (segments[0].start / segments[249].end - 1.0).abs();
        prop_assert!(closed < 2e-3, "the lap ends {closed} off the speed that it began with");
        static WITHOUT: OnceLock<[HybridProblem; 2]> = OnceLock::new();
        let without = WITHOUT.get_or_init(|| {
            [Mode::Offset, Mode::Additional].map(|mode| problem_of(car_without_h(), mode))
        });
        let without = &without[usize::from(additional)];
        let motor = without.lap(&candidate).0;
        candidate[4] = 0.0;
        let engine = without.lap(&candidate).0;
        prop_assert!(motor.time <= engine.time * (1.0 + 1e-9) && engine.deployed == 0.0);
        prop_assert!(motor.harvested_h == 0.0);
    }
}

/// A share of the motor in a strategy is a car with that motor.
#[test]
fn a_share_of_the_motor_is_a_smaller_motor() {
    let lap = |mode: Mode, car: EnergyCar, motor_share: f64| {
        let whole = problem(mode);
        let gates = Gates {
            motor_share,
            ..Gates::OPEN
        };
        let (line, energy) = (whole.line().clone(), whole.energy().clone());
        let strategy = Strategy::fixed(gates, 4);
        let problem = HybridProblem::new(line, car, energy, strategy, &[HybridObjective::LapTime], 10.0);
        problem.unwrap().lap(&[]).0.to_array()
    };
    for mode in [Mode::Offset, Mode::Additional] {
        let mut hybrid = car().hybrid.clone();
        hybrid.mgu_k = hybrid.mgu_k.scaled(0.4);
        let smaller = lap(mode, car().with_hybrid(hybrid).unwrap(), 1.0);
        let share = lap(mode, car().clone(), 0.4);
        // Products in another order, a rounding or two for each of 250 segments.
        for (x, y) in smaller.iter().zip(share) {
            assert!((x - y).abs() <= 1e-9 * x.abs().max(1.0), "{smaller:?} {share:?}");
        }
        assert!(share[2] > 0.0);
    }
}

#[test]
fn tables_say_what_the_powertrain_says() {
    let car = car();
    let powertrain = car.car.powertrain.as_ref().unwrap();
    let engine = powertrain.engine.as_ref().unwrap();
    let (mass, radius) = (1245.0, 0.325);
    let rows = car.table.forces.len() / 8;
    let at = |table: &[f64], v: f64, column: usize| {
        let place = v * v * car.table.rows_per_speed_squared;
        let row = (place as usize).min(rows - 1);
        table[8 * row + column] + (place - row as f64) * table[8 * row + 4 + column]
    };
    for v in [22.0, 35.0, 48.0, 55.0, 63.0] {
        let gear = powertrain.gear(v, radius).unwrap();
        // Within what a step of 0.2 m/s rounds off a kink of the torque.
        assert!(
            (at(&car.table.forces, v, 0) / (gear.force_n / mass) - 1.0).abs() < 5e-3,
            "{v}"
        );
        // 120 kW less the gearbox's losses, over the speed.
        let motor = car.hybrid.mgu_k.power_at(gear.engine_speed_rpm) * 0.95 / (mass * v);
        assert!((at(&car.table.forces, v, 1) / motor - 1.0).abs() < 5e-3, "{v}");
        for (column, load) in [(0, 0.0), (1, 1.0 / 3.0), (2, 2.0 / 3.0), (3, 1.0)] {
            let power = load * gear.force_n * v;
            let flow = powertrain
                .operating_point(v, power, radius)
                .unwrap()
                .fuel_flow_kgph
                / 3600.0;
            assert!(
                (at(&car.table.flows, v, column) / flow - 1.0).abs() < 2e-2,
                "{v} {load}"
            );
        }
        // Between its four loads the flow is close to the map's.
        let power = 0.5 * gear.force_n * v;
        let flow = powertrain
            .operating_point(v, power, radius)
            .unwrap()
            .fuel_flow_kgph
            / 3600.0;
        let between = 0.5 * (at(&car.table.flows, v, 1) + at(&car.table.flows, v, 2));
        assert!((between / flow - 1.0).abs() < 2e-2, "{v}: {between} and {flow}");
    }
    assert_eq!(engine.fuel_density_kgpl, 0.748);
}

#[test]
fn zones_are_cut_by_distance() {
    // Two zones of four and two segments; the first reaches over the start line.
    let plan = EnergyPlan::zoned(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &[2, 4], true, 0, Mode::Offset);
    let row = |i: usize| {
        (
            plan.zones[i].zone,
            plan.zones[i].position,
            1.0 / plan.zones[i].per_share,
        )
    };
    let near =
        |a: (u32, f64, f64), b: (u32, f64, f64)| a.0 == b.0 && (a.1 - b.1).abs() + (a.2 - b.2).abs() < 1e-12;
    assert!(near(row(2), (0, 0.0, 3.0 / 7.0)) && near(row(3), (0, 3.0 / 7.0, 4.0 / 7.0)));
    assert!(near(row(4), (1, 0.0, 5.0 / 14.0)) && near(row(1), (1, 12.0 / 14.0, 2.0 / 14.0)));
    assert_eq!(plan.count(), 2);
}

/// On a straight at 66 m/s the engine is at full load: the MGU-H's 20 kW at the crank come off what drives the car, less the
/// gearbox's losses, and the fuel is that of the full load. Where the motor replaces the engine, the lap is that of the engine
/// alone, and the machine runs where it has power to spare, at the price of the map.
#[test]
fn the_turbocharger_s_generator_takes_its_power_from_the_crank() {
    let mut hybrid = car().hybrid.with_overflow();
    // The bundled rule lets it stand still at full load.
    let h = hybrid.mgu_h.as_mut().unwrap();
    (h.from_speed_mps, h.to_ax_mps2) = (30.0, 10.0);
    let (with, without) = (&car().with_hybrid(hybrid).unwrap(), car_without_h());
    let (v, h) = (66.0f64, 5.0);
    let reached = |car: &EnergyCar| {
        kernel::motors_step(&car.envelope_table, &car.table, v * v, h, ([0.0; 2], false), 0.0)[0]
    };
    // The flow at this speed is not the greatest, and so is not the power: its share is the map's.
    let powertrain = with.car.powertrain.as_ref().unwrap();
    let full = |v: f64| {
        let gear = powertrain.gear(v, 0.325).unwrap();
        let point = powertrain.operating_point(v, gear.force_n * v, 0.325).unwrap();
        point.fuel_flow_kgph
    };
    let greatest = (220..=690).map(|v| full(f64::from(v) / 10.0)).fold(0.0, f64::max);
    let crank_w = 20e3 * full(v) / greatest;
    let slower = crank_w * 0.95 / (v * 1245.0 * powertrain.rotating_mass_factor);
    let found = (reached(&without) - reached(with)) / (2.0 * h);
    // The table's steps over the speed, as in the test of the tables.
    assert!((found / slower - 1.0).abs() < 2e-2, "{found} and {slower} m/s^2");

    let lap = |car: &EnergyCar, mode: Mode, energy_mj: f64| {
        let gates = Gates {
            energy_mj,
            ..Gates::OPEN
        };
        let whole = problem_of(car.clone(), mode);
        let strategy = Strategy::fixed(gates, 4);
        let (line, energy) = (whole.line().clone(), whole.energy().clone());
        HybridProblem::new(
            line,
            car.clone(),
            energy,
            strategy,
            &[HybridObjective::LapTime],
            10.0,
        )
        .unwrap()
        .lap(&[])
    };
    for mode in [Mode::Offset, Mode::Additional] {
        for energy_mj in [0.0, 3.0] {
            let (plain, plain_segments, _) = lap(&without, mode, energy_mj);
            let (lap, segments, _) = lap(with, mode, energy_mj);
            assert!(segments.iter().all(|s| s.load <= 1.0), "{mode:?}");
            match mode {
                Mode::Offset => {
                    assert_eq!(lap.time, plain.time);
                    assert!(lap.harvested_h > 0.0);
                    for (s, plain) in segments.iter().zip(&plain_segments) {
                        // 20 kW at the crank for 40 kW, the engine's share of it at the map's price: some 200 to 400 g/kWh.
                        let (fuel, energy) = (s.fuel - plain.fuel, s.harvested_h);
                        assert!(plain.load < 1.0 || energy == 0.0);
                        assert!(
                            energy == 0.0 || (0.05..0.25).contains(&(fuel / energy * 3.6e6)),
                            "{}",
                            fuel / energy * 3.6e6
                        );
                    }
                }
                Mode::Additional => assert!(lap.harvested_h > 0.0 && lap.time > plain.time),
            }
        }
    }
}

/// The car whose MGU-H takes 60 kW out of the store below 55 m/s, for 20 kW at the crank: the published machine.
fn car_with_assist() -> EnergyCar {
    let mut hybrid = car().hybrid.clone();
    let h = hybrid.mgu_h.as_mut().unwrap();
    (h.motor_w, h.motor_gain_w, h.from_speed_mps) = (60e3, 20e3, 55.0);
    car().with_hybrid(hybrid).unwrap()
}

/// On a straight at 50 m/s engine and motor are joined by 20 kW at the crank, less the gearbox's losses. At 60 m/s the machine does not
/// drive, nor where the tyres leave no room, and of less than both give the MGU-K has the first part.
#[test]
fn the_turbocharger_s_motor_gives_what_its_file_says_at_the_price_that_it_says() {
    let (with, without) = (&car_with_assist(), car_without_h());
    let h = 5.0;
    let step = |car: &EnergyCar, v: f64, share: f64| {
        kernel::motors_step(
            &car.envelope_table,
            &car.table,
            v * v,
            h,
            ([0.0; 2], false),
            share,
        )
    };
    let rotating = with.table.rotating;
    // The table's steps over the speed, as in the test of the tables.
    let near = |found: f64, wanted: f64| (found - wanted).abs() <= 2e-2 * wanted;
    let by_hand = 20e3 * 0.95 / (50.0 * 1245.0);
    let ([end, motors, assist], [plain_end, motor, none]) =
        (step(with, 50.0, 1.0), step(&without, 50.0, 1.0));
    assert!(near(assist, by_hand) && none == 0.0, "{assist} and {by_hand}");
    assert!((motors - motor - assist).abs() < 1e-9);
    assert!(near((end - plain_end) / (2.0 * h), by_hand / rotating));
    let [_, half, assist] = step(with, 50.0, 0.5);
    assert!((half - 0.5 * motors).abs() < 1e-9 && assist == 0.0);
    let [_, most, assist] = step(with, 50.0, 0.95);
    assert!((most - assist - motor).abs() < 1e-9 && assist > 0.0);
    assert_eq!(step(with, 60.0, 1.0), step(&without, 60.0, 1.0));
    // At 20 m/s the tyres hardly leave the motor room.
    assert_eq!(step(with, 20.0, 1.0), step(&without, 20.0, 1.0));
}

/// Whatever the budget, the books of laps with it balance joule by joule, it works below its speed and at full load only, and
/// with energy enough the lap is faster than by the MGU-K alone.
#[test]
fn laps_with_the_turbocharger_s_motor_balance() {
    let lap = |car: EnergyCar, energy_mj: f64| {
        let gates = Gates {
            energy_mj,
            ..Gates::OPEN
        };
        let whole = problem_of(car.clone(), Mode::Additional);
        let strategy = Strategy::fixed(gates, 4);
        let (line, energy) = (whole.line().clone(), whole.energy().clone());
        HybridProblem::new(line, car, energy, strategy, &[HybridObjective::LapTime], 10.0)
            .unwrap()
            .lap(&[])
    };
    for energy_mj in [0.0, 0.3, 1.0, 5.0] {
        let (found, segments, course) = lap(car_with_assist(), energy_mj);
        assert!(found.deployed <= 1e6 * energy_mj + 1e-6, "{energy_mj}");
        let mut paid = 0.0;
        for (i, s) in segments.iter().enumerate() {
            let joules = 1245.0 * course.length[i];
            let crank = joules / 0.95;
            paid += crank * (s.motor - s.assist) + 3.0 * crank * s.assist;
            assert!(s.assist >= 0.0 && s.assist <= s.motor, "{i}");
            if s.assist > 1e-6 {
                assert!(s.start < 55.0f64.powi(2) && s.harvested_h == 0.0, "{i}");
            }
        }
        assert!(
            (paid - found.deployed).abs() < 1e-6 * paid.max(1.0),
            "{energy_mj}: {paid}"
        );
        let change = found.harvested_k + found.harvested_h - found.deployed;
        assert!((found.change - change).abs() < 1e-6, "{energy_mj}");
        let assisted: f64 = segments.iter().map(|s| s.assist).sum();
        assert_eq!(assisted > 0.0, energy_mj > 0.0);
        if energy_mj == 5.0 {
            let alone = lap(car_without_h(), energy_mj).0;
            assert!(
                found.time < alone.time - 1e-3,
                "{} and {}",
                found.time,
                alone.time
            );
        }
    }
}

/// Where the DRS is open the wheels push against what drag it leaves, else against all of it. All that they push less comes off
/// the fuel or the motor.
#[test]
fn an_open_drs_takes_its_share_off_the_drag_that_is_driven_against() {
    let shut = &car().point_mass.envelope;
    let open = shut.with_rows("open", &|_, row| EnvelopeRow {
        drag_mps2: 0.7 * row.drag_mps2,
        ..*row
    });
    let envelope = shut.clone().with_open(open.unwrap()).unwrap();
    let traction = envelope.straight_traction().unwrap();
    let flapped = EnergyCar::new(car().car.clone(), envelope, traction, 2.0).unwrap();
    let points_m = bean();
    let n = points_m.len();
    let lap = |drs: &[bool], mode: Mode| {
        let plan = EnergyPlan::whole(n, 220, mode);
        let line = HybridLine::Fixed {
            points_m: points_m.clone(),
            closed: true,
            drs: drs.to_vec(),
            surface: Vec::new(),
        };
        let strategy = Strategy::fixed(Gates::OPEN, 1);
        let problem = HybridProblem::new(
            line,
            flapped.clone(),
            plan,
            strategy,
            &[HybridObjective::LapTime],
            10.0,
        );
        let (lap, segments, course) = problem.unwrap().lap(&[]);
        (lap, segments, course.length)
    };
    let zones: Vec<bool> = (0..n).map(|i| i % 125 < 80).collect();
    for mode in [Mode::Offset, Mode::Additional] {
        let (with, segments, length) = lap(&zones, mode);
        let (without, ..) = lap(&[], mode);
        assert!(
            with.time < without.time,
            "{mode:?}: {} {}",
            with.time,
            without.time
        );
        let (mut opened, mut braked) = (0, 0);
        for (i, s) in segments.iter().enumerate() {
            let (mean, ax) = (0.5 * (s.start + s.end), 0.5 * (s.end - s.start) / length[i]);
            let drag = flapped.point_mass.envelope.at(mean.sqrt()).drag_mps2;
            let pushed = s.engine + s.motor - s.generator - s.hydraulic - flapped.table.rotating * ax;
            let open = zones[i] && s.engine + s.motor > 0.0;
            let wanted = s.lost + if open { 0.7 * drag } else { drag };
            // Rows of the tables are straight lines over the speed squared.
            if !(zones[i] && s.engine + s.motor + s.generator + s.hydraulic == 0.0) {
                assert!(
                    (pushed - wanted).abs() < 1e-3 * drag,
                    "{mode:?}, {i}: {pushed} {wanted}"
                );
            }
            opened += usize::from(open);
            braked += usize::from(zones[i] && s.generator + s.hydraulic > 0.0);
        }
        assert!(opened > 50 && braked > 5, "{opened} {braked}");
    }
}

/// A driven lap of moments worked by hand: the motor does what its plan says up to the demand, the engine the rest; the generator has
/// what the rear brakes shed, up to its power; the front brakes are lost to it; a slipping tyre takes more than moves the car.
#[test]
fn the_accounts_of_a_driven_lap_by_hand() {
    let car = car_without_h();
    let table = &car.table;
    let mass = table.mass;
    let plan = MotorPlan {
        station_m: vec![0.0, 100.0, 200.0],
        share: vec![1.0, 0.5, 1.0],
        length_m: 400.0,
    };
    let speed = 50.0;
    let [engine_most, motor_most, generator_most, _] = car.greatest_mps2(speed);
    let moment = |station_m: f64, wheels_w: [f64; 2]| DrivenMoment {
        time_s: 0.1,
        station_m,
        speed_mps: speed,
        ax_mps2: 0.0,
        climb_mps2: 0.0,
        wheels_w,
        drag_n: 1000.0,
    };
    let power = mass * speed;
    let moments = [
        // More than the motor gives, less than it gives, and more than engine and motor give.
        moment(10.0, [0.0, (motor_most + 1.0) * power]),
        moment(50.0, [0.0, 0.6 * motor_most * power]),
        moment(150.0, [0.0, (engine_most + motor_most) * power]),
        // Braking: a little at the rear, then more than the generator takes.
        moment(250.0, [-3.0 * power, -0.5 * generator_most * power]),
        moment(300.0, [-3.0 * power, -2.0 * generator_most * power]),
        // A sample beyond the line, which takes no time any more.
        DrivenMoment {
            time_s: 0.0,
            ..moment(401.0, [0.0, motor_most * power])
        },
    ];
    let driven = driven_energy(&car, &plan, &moments);
    let rolling = car.car.rolling_mps2();
    let forces = driven
        .segments
        .iter()
        .map(|s| [s.engine, s.motor, s.generator, s.hydraulic]);
    let expected = [
        [1.0 + rolling, motor_most, 0.0, 0.0],
        [0.0, 0.6 * motor_most + rolling, 0.0, 0.0],
        [
            engine_most + 0.5 * motor_most + rolling,
            0.5 * motor_most,
            0.0,
            0.0,
        ],
        [0.0, 0.0, 0.5 * generator_most - rolling, 3.0],
        [0.0, 0.0, generator_most, generator_most + 3.0 - rolling],
        [0.0; 4],
    ];
    for (i, (found, expected)) in forces.zip(expected).enumerate() {
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{i}: {found} and {expected}");
        }
    }
    let joules = mass * speed * 0.1;
    let lap = &driven.lap;
    let motor: f64 = driven.segments.iter().map(|s| s.motor).sum();
    assert!((lap.deployed - joules * motor * table.deploy_cost).abs() < 1e-6);
    let generator = 1.5 * generator_most - rolling;
    assert!((lap.harvested_k - joules * generator * table.harvest_gain).abs() < 1e-6);
    assert!((lap.change - (lap.harvested_k - lap.deployed)).abs() < 1e-9);
    // At one speed the car is moved against drag and rolling resistance alone.
    assert!((driven.moving_j - 5.0 * joules * (1000.0 / mass + rolling)).abs() < 1e-6);
    assert!((lap.time - 0.5).abs() < 1e-12 && (lap.motor_time - 0.3).abs() < 1e-12);
}

/// In a driven lap the MGU-H drives by the same plan, after the MGU-K, at its own price.
#[test]
fn the_accounts_of_a_driven_lap_with_the_turbocharger_s_motor() {
    let car = car_with_assist();
    let (mass, speed) = (car.table.mass, 50.0);
    let [_, own, _, assist] = car.greatest_mps2(speed);
    assert!((assist / (20e3 * 0.95 / (mass * speed)) - 1.0).abs() < 2e-2);
    assert_eq!(car.greatest_mps2(60.0)[3], 0.0);
    let plan = MotorPlan {
        station_m: vec![0.0],
        share: vec![0.95],
        length_m: 400.0,
    };
    let rolling = car.car.rolling_mps2();
    let moment = |force: f64| DrivenMoment {
        time_s: 0.1,
        station_m: 10.0,
        speed_mps: speed,
        ax_mps2: 0.0,
        climb_mps2: 0.0,
        wheels_w: [0.0, (force - rolling) * mass * speed],
        drag_n: 1000.0,
    };
    // More than both give by the plan, then half of what the MGU-H gives beyond the MGU-K, then less than the MGU-K gives.
    let moments = [
        moment(own + assist),
        moment(own + 0.25 * assist),
        moment(0.5 * own),
    ];
    let driven = driven_energy(&car, &plan, &moments);
    let joules = mass * speed * 0.1;
    let planned = 0.95 * (own + assist) - own;
    assert!(planned > 0.25 * assist);
    for (s, [k, h]) in driven
        .segments
        .iter()
        .zip([[own, planned], [own, 0.25 * assist], [0.5 * own, 0.0]])
    {
        assert!((s.assist - h).abs() < 1e-9 && (s.motor - s.assist - k).abs() < 1e-9);
        let paid = joules / 0.95 * (k + 3.0 * h);
        assert!((s.deployed - paid).abs() < 1e-6, "{} and {paid}", s.deployed);
    }
}

/// A plan repeats from lap to lap, and between two places it has the mean of what is there.
#[test]
fn a_motors_plan_by_station() {
    let plan = MotorPlan {
        station_m: vec![0.0, 100.0, 200.0],
        share: vec![1.0, 0.5, 0.0],
        length_m: 400.0,
    };
    assert_eq!(
        [-350.0, 0.0, 99.0, 100.0, 250.0, 500.0].map(|s| plan.at(s)),
        [1.0, 1.0, 1.0, 0.5, 0.0, 0.5]
    );
    assert!((plan.mean(50.0, 250.0) - (50.0 + 50.0) / 200.0).abs() < 1e-12);
    let twice = plan.stretched_to(800.0);
    assert_eq!((twice.at(199.0), twice.at(201.0)), (1.0, 0.5));
}
