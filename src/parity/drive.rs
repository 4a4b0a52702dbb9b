//! Layer six: closed-loop laps of synthetic circuits, with grip to spare: one step of the driver, and whole laps.

pub use super::candidates;
use super::cases::{Cases, Compared};
use super::{Agreement, Draws, Layer, Subject, free_about};
use crate::drive::driver::Pace;
use crate::drive::kernel::{DriveState, DrivenLap, STATE, World, drive_on, ending};
use crate::drive::{Course, DriverSettings, Line, SpeedPlan};
use crate::error::Result;
use crate::evaluate::drive::{
    DriveObjective, DriveProblem, DriveSettings, GpuDriveEvaluator, SimdDriveEvaluator,
};
use crate::scalar::{Counted, Lookup, operations_of};
use crate::track::{Circuit, FrictionAcross, Relief, ReliefChange, Track};
use crate::vehicle::powertrain::GRAVITY_MPS2;
use crate::vehicle::{Car, CarModel, MagicFormula};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The circuits: bends of one radius between straights, and bends that tighten and open.
const CIRCUITS: [&str; 2] = ["stadium:200:70:14", "ellipse:180:120:14"];
/// Shares of the car's friction in the plans: far enough from the limit for a driver's errors to die away.
const PACES: [f64; 2] = [0.45, 0.6];
/// Parameters that set-ups move: of the body, the air and the tyres.
const PARAMETERS: [&str; 6] = [
    "mass_kg",
    "front_roll_moment_share",
    "aero_balance_front",
    "roll_stiffness_nm_per_rad",
    "rBy1",
    "front.pKy1",
];
/// How far they go, as a share of themselves.
const SHARE: f64 = 0.1;
/// Cars that drive a lap.
const COUNT: usize = 20;
/// Cars next to each, whose laps in `f64` say how well the car's own is determined.
const NEIGHBOURS: usize = 2;
/// Step of the closed loop, s.
const STEP: f64 = 2e-3;
/// Places of each car's lap from which a single step is compared.
const STEPS: u32 = 32;

/// The problem of driving `car` round these circuits with these shares of its friction, set-ups a tenth about it.
///
/// # Errors
/// [`crate::Error::Input`] naming a parameter that the car lacks, or a circuit that does not exist.
pub fn problem(car: Car, circuits: &[&str], paces: &[f64], step_s: f64) -> Result<DriveProblem> {
    problem_of(car, circuits, paces, step_s, &PARAMETERS)
}

/// As [`problem`], with these parameters free.
///
/// # Errors
/// As [`problem`].
pub fn problem_of(
    car: Car,
    circuits: &[&str],
    paces: &[f64],
    step_s: f64,
    parameters: &[&str],
) -> Result<DriveProblem> {
    problem_on(car, &circuits_of(circuits)?, paces, step_s, parameters)
}

fn circuits_of(names: &[&str]) -> Result<Vec<Circuit>> {
    let circuit = |name: &&str| {
        let mut circuit = Track::load(name)?.circuit()?;
        // On straights and in bends, and on the brakes, where the driver shuts the flap.
        circuit.drs_zones_m = vec![[0.1 * circuit.length_m, 0.6 * circuit.length_m]];
        Ok(circuit)
    };
    names.iter().map(circuit).collect()
}

/// A circuit with made-up hills, 6 m high, banking of up to four degrees, and friction from 0.75 to 1.
pub fn in_hills(mut circuit: Circuit) -> Circuit {
    let angle = |station: &f64| TAU * station / circuit.length_m;
    let stations = &circuit.station_m;
    let relief = Relief {
        z_m: stations
            .iter()
            .map(|s| 3.0 * angle(s).sin() + 0.5 * (4.0 * angle(s)).cos())
            .collect(),
        bank_rad: stations.iter().map(|s| 0.07 * (2.0 * angle(s)).sin()).collect(),
        friction: stations
            .iter()
            .map(|s| {
                let of = [
                    0.9 + 0.08 * (3.0 * angle(s)).cos(),
                    0.006 * (5.0 * angle(s)).sin(),
                ];
                FrictionAcross::linear(of, [6.0; 2])
            })
            .collect(),
        change: ReliefChange::default(),
    };
    circuit.relief = Some(relief);
    circuit
}

fn problem_on(
    car: Car,
    circuits: &[Circuit],
    paces: &[f64],
    step_s: f64,
    parameters: &[&str],
) -> Result<DriveProblem> {
    let driver = DriverSettings::racing(&car)?;
    let plans: Vec<Vec<SpeedPlan>> = circuits
        .iter()
        .map(|circuit| {
            paces
                .iter()
                .map(|pace| SpeedPlan::new(&car, circuit, *pace, driver.top_speed_mps))
                .collect()
        })
        .collect();
    let lines: Vec<Line<'_>> = circuits
        .iter()
        .zip(&plans)
        .map(|(circuit, plans)| Line { circuit, plans })
        .collect();
    let free = free_about(&car, parameters, SHARE)?;
    let settings = DriveSettings {
        step_s,
        ..DriveSettings::new(driver)
    };
    DriveProblem::new(car, free, &lines, paces, &settings, &DriveObjective::ALL)
}

/// What single precision may move of a lap's time, its distance to the edges and its steering rate.
///
/// *Speed* is the state that most is added to in most steps: of 32 to 64 m/s `f32` keeps 3.8e-6, half of which may be lost in
/// every step, always to the same side where the speed is steady; the driver makes up for `speed_gain` times the lack, so that
/// the car is at most `1.9e-6/(step speed_gain)` m/s off its plan, and forces that are off by 1e-5 of the loads (the layer of
/// steps) add 1e-4 m/s^2 over the same gain. *Way* is added up in rows of a metre or less, where half a spacing is 3e-8 m, to
/// steps of 0.04 m or more: 7.5e-7 of the time at worst.
///
/// *Place across*: what is lost in a step to one side drifts by half a spacing of a few decimetres (1.5e-8 m) in a step, against
/// which a driver steers back at some 0.5 1/s; a bend's own offset goes with the square of the speed (at most 1 m at 20 m/s,
/// 0.1 m for each m/s) and with the tyres' forces (1e-5 of it).
///
/// *Steering*: where the arms are still, they jitter by a spacing of 0.05 rad (3.7e-9) in each step; where they move, by the
/// share that the lap time is off and by the noise of what is looked up ahead: stations of up to 20 m in rows (1e-6 m) on
/// curvature that changes by less than 1e-3 1/m^2, through a wheelbase of 2.6 m and the arms' 0.04 s: 2.6e-9 in a step.
pub fn allowed(problem: &DriveProblem, lap: &DrivenLap) -> [f64; 3] {
    let driver = problem.driver();
    let (step, gain) = (driver.step, driver.speed_gain);
    let slower = 1.9e-6 / (step * gain) + 1e-4 / gain;
    let slowest = 15.0;
    let time = (slower / slowest + 7.5e-7) * lap.time_s;
    let across = 1.5e-8 / (step * 0.5) + 0.1 * slower + 1e-5;
    let steering = (3.7e-9 + 2.6e-9) / step + slower / slowest * lap.steering_radps;
    [time, across, steering]
}

impl Compared for DriveProblem {
    const NOUN: &'static str = "car";

    fn limits(&self, _: &[f64], lap: &DrivenLap, exact: &[f64]) -> Option<Vec<[f64; 2]>> {
        let scales = exact.iter().map(|x| x.abs());
        Some(scales.zip(allowed(self, lap)).map(Into::into).collect())
    }
}

/// A state that a car was in on its lap, as `f32` has it, and what becomes of it in one step.
struct Step {
    car: usize,
    from: [f32; STATE],
    exact: [f64; STATE],
    single: [f32; STATE],
}

/// The figures of a state that one step of the driver and the path sets, and what their errors are measured against.
const OF_A_STEP: [(usize, &str); 11] = [
    (6, "steering"),
    (7, "front slip"),
    (8, "rear slip"),
    (9, "force of the rear wheels"),
    (10, "gain in speed"),
    (13, "foot"),
    (14, "place along"),
    (15, "place across"),
    (16, "direction"),
    (19, "distance beyond the edge"),
    (21, "steering so far"),
];

/// Greatest error of a step's figures in [`scales`]: each is the sum of some ten terms, whose roundings of 6e-8 add up to a few
/// 1e-7 of what the terms amount to.
const STEP_TOLERANCE: f64 = 1e-6;

/// Force of the rear wheels for each slip ratio (N): some 40 times their load of up to 20 kN.
const STIFFNESS_N: f64 = 8e5;
/// Mass of the lightest car that is tried here (kg).
const LIGHTEST_KG: f64 = 500.0;

/// What the errors of a step's figures are measured against: what is added up in them.
///
/// *Arms and feet* move by the step over their lag times what is wanted of them: angles and curvatures through gains of about
/// one, that is at most the lock (0.2 rad), and forces in units of load over slip stiffness, the accelerations behind which are
/// differences of squared speeds, `2 v^2` over 8 m. The *force* of the wheels comes from a slip ratio, which is the difference of two
/// speeds of about the same size. *Places* are a few metres, added to by speed times step. *Directions* are
/// fractions of a radian.
fn scales(problem: &DriveProblem, state: &[f32; STATE]) -> [f64; OF_A_STEP.len()] {
    let d = problem.driver();
    let at = |k: usize| f64::from(state[k].abs());
    let v = at(0);
    let steer = at(6) + d.step / 0.04 * 0.2;
    let foot = at(13) + at(14) + at(15) + v * d.step;
    let wanted = (2.0 * v * v / 8.0 + d.speed_gain * v) / (GRAVITY_MPS2 * 0.55 * d.slip_stiffness);
    let slip = |k: usize| at(k) + d.step / 0.06 * wanted;
    [
        steer,
        slip(7),
        slip(8),
        STIFFNESS_N,
        2.0 * STIFFNESS_N / LIGHTEST_KG,
        foot,
        foot,
        foot,
        at(16) + at(2) * d.step + 1e-2,
        20.0,
        at(21) + 2.0 * steer,
    ]
}

/// The states of a candidate after these numbers of steps, rising, from `from` or from the start of its run-up, in the scalar
/// `R`, and how many steps there were at most. Steps from `from` count on from one.
fn trail<R: Lookup>(
    problem: &DriveProblem,
    candidate: &[f64],
    from: Option<[R; STATE]>,
    stops: impl Iterator<Item = u32>,
) -> (Vec<[R; STATE]>, u32) {
    let flat = problem.free.flat(candidate);
    let ready = CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat).to_table();
    let ready: Vec<R> = ready.into_iter().map(R::lit).collect();
    let car = CarModel::<R, MagicFormula<R>>::from_table(&ready);
    let road = problem.road().stored::<R>();
    let world = World {
        road: &road,
        driver: &problem.driver().stored::<R>(),
        torque: &problem.torque().stored::<R>(),
        cornering: &problem.cornering().stored::<R>(),
    };
    let [line, plan, share] = problem.lap_figures(candidate).map(R::lit);
    let course = Course::at(&road, line);
    let pace = Pace { plan, share };
    let (mut state, mut number) = match from {
        Some(figures) => (DriveState::from_array(figures), 1),
        None => (DriveState::begin(&world, &course, &pace), 0),
    };
    let states = stops
        .map(|stop| {
            drive_on(&car, &world, (&course, &pace), &mut state, &mut number, stop);
            state.to_array()
        })
        .collect();
    (states, number)
}

/// Steps that a candidate's lap takes with its run-up, and arithmetic operations of all of them.
pub fn work_of_a_lap(problem: &DriveProblem, candidate: &[f64]) -> (usize, u64) {
    let count = |steps: u32| {
        operations_of(|| {
            trail::<Counted>(problem, candidate, None, std::iter::once(steps));
        })
    };
    let (_, steps) = trail::<f32>(problem, candidate, None, std::iter::once(u32::MAX));
    (steps as usize, u64::from(steps) * (count(1000) - count(0)) / 1000)
}

/// Steps from all over the laps of cars, their run-ups included.
fn steps_of(problem: &DriveProblem, cars: &[Vec<f64>]) -> Vec<Step> {
    let of_car = |(car, candidate): (usize, &Vec<f64>)| {
        let (states, _) = trail::<f64>(problem, candidate, None, (0..STEPS).map(|i| i * 431));
        let under_way = states
            .into_iter()
            .filter(|state| state[STATE - 1] == ending::UNDER_WAY);
        let steps: Vec<Step> = under_way
            .map(|state| {
                let from = state.map(|x| x as f32);
                let once = 2..3;
                Step {
                    car,
                    from,
                    exact: trail(problem, candidate, Some(from.map(f64::from)), once.clone()).0[0],
                    single: trail(problem, candidate, Some(from), once).0[0],
                }
            })
            .collect();
        steps
    };
    cars.par_iter().enumerate().flat_map_iter(of_car).collect()
}

/// The layer: single steps of the driver, and whole laps.
///
/// # Errors
/// Those of reading the bundled car.
pub fn layer() -> Result<Layer> {
    let mut car = Car::bundled()?;
    (car.chassis.drs_drag, car.chassis.drs_lift) = (20.0, 10.0);
    let level = circuits_of(&CIRCUITS)?;
    let hills: Vec<Circuit> = level.iter().cloned().map(in_hills).collect();
    let mut draws = Draws::new(7);
    let mut roads = Vec::new();
    for (road, circuits) in [("drive", level), ("drive in hills", hills)] {
        let problem = problem_on(car.clone(), &circuits, &PACES, STEP, &PARAMETERS)?;
        let cars = candidates(&problem, COUNT, &mut draws);
        let names = ["time", "room", "steering"].map(|name| format!("{road}, {name}"));
        let cases = Cases::among_neighbours(names.to_vec(), problem, cars, NEIGHBOURS, &mut draws);
        // The last car is none that drives.
        let steps = steps_of(&cases.problem, &cases.candidates[..COUNT - 1]);
        roads.push((road, cases, steps));
    }
    Ok(Box::new(move |subject| {
        let mut agreements = Vec::new();
        for (road, cases, steps) in &roads {
            let name = format!("{road}, step of the driver");
            agreements.push(compare_steps(&name, cases, steps, subject)?);
            agreements.extend(cases.compare(subject)?);
        }
        Ok(agreements)
    }))
}

fn compare_steps(
    name: &str,
    cases: &Cases<DriveProblem>,
    steps: &[Step],
    subject: &Subject,
) -> Result<Agreement> {
    let problem = &cases.problem;
    let cars: Vec<&[f64]> = steps.iter().map(|s| &*cases.candidates[s.car]).collect();
    let from: Vec<[f32; STATE]> = steps.iter().map(|s| s.from).collect();
    let found = match subject {
        Subject::Lanes(set) => SimdDriveEvaluator::new(problem, *set).advance(&cars, &from, 1),
        Subject::Device(context) => {
            GpuDriveEvaluator::new(problem, Arc::clone(context))?.advance(&cars, &from, 1)?
        }
    };
    let mut agreement = Agreement::new(name, subject);
    for (number, (case, found)) in steps.iter().zip(&found).enumerate() {
        // In another row, or ended: the same in both.
        for k in [11, 12, STATE - 1] {
            agreement.verdict(f64::from(found[k]) == case.exact[k], || {
                format!("figure {k} of case {number}")
            });
        }
        for ((k, name), scale) in OF_A_STEP.into_iter().zip(scales(problem, &case.from)) {
            let allowed = STEP_TOLERANCE * scale;
            agreement.note(f64::from(found[k]), case.exact[k], scale, allowed, || {
                format!("{name} of case {number}")
            });
        }
    }
    let alike = steps
        .iter()
        .zip(&found)
        .all(|(case, found)| case.single == *found);
    agreement.bits(alike, subject);
    Ok(agreement)
}
