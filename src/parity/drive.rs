//! Layer six: closed-loop laps of synthetic circuits, with grip to spare: one step of the driver, and whole laps.

pub use super::candidates;
use super::{Agreement, Draws, Subject, free_about, neighbours};
use crate::drive::driver::Pace;
use crate::drive::kernel::{DriveState, DrivenLap, STATE, World, drive_on, ending};
use crate::drive::{Course, DriverSettings, Line, SpeedPlan};
use crate::error::Result;
use crate::evaluate::Failure;
use crate::evaluate::drive::{
    CpuDriveEvaluator, DriveObjective, DriveProblem, DriveSettings, GpuDriveEvaluator, SimdDriveEvaluator,
};
use crate::scalar::{Counted, Lookup, operations_of};
use crate::track::Track;
use crate::vehicle::{Car, CarModel, MagicFormula};
use rayon::prelude::*;
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
/// Cars next to each, every figure up to a millionth off, whose laps in `f64` say how well the car's own is determined: a lap
/// that a millionth moves by more than is allowed says nothing of arithmetic and is left out.
const NEIGHBOURS: usize = 2;
const NEXT_TO: f64 = 1e-6;
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
    let circuits = circuits
        .iter()
        .map(|name| Track::load(name)?.circuit())
        .collect::<Result<Vec<_>>>()?;
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

fn figures(lap: &DrivenLap) -> [f64; 3] {
    [lap.time_s, lap.beyond_m, lap.steering_radps]
}

/// A lap, or why there is none.
type Driven = std::result::Result<DrivenLap, Failure>;

/// How a lap ended, in a form that compares.
fn verdict(lap: &Driven) -> std::result::Result<u64, Failure> {
    lap.map(|lap| lap.ending as u64)
}

/// The cars, and what the reference says of them.
pub struct Cases {
    problem: DriveProblem,
    cars: Vec<Vec<f64>>,
    exact: Vec<Driven>,
    determined: Vec<bool>,
    steps: Vec<Step>,
}

/// A state that a car was in on its lap, as `f32` has it, and what becomes of it in one step.
struct Step {
    car: usize,
    from: [f32; STATE],
    exact: [f64; STATE],
    single: [f32; STATE],
}

/// The figures of a state that one step of the driver and the path sets, and what their errors are measured against.
const OF_A_STEP: [(usize, &str); 9] = [
    (6, "steering"),
    (7, "front slip"),
    (8, "rear slip"),
    (11, "foot"),
    (12, "place along"),
    (13, "place across"),
    (14, "direction"),
    (17, "distance beyond the edge"),
    (19, "steering so far"),
];

/// Greatest error of a step's figures in [`scales`]: each is the sum of some ten terms, whose roundings of 6e-8 add up to a few
/// 1e-7 of what the terms amount to.
const STEP_TOLERANCE: f64 = 1e-6;

/// What the errors of a step's figures are measured against: what is added up in them.
///
/// *Arms and feet* move by the step over their lag times what is wanted of them: angles and curvatures through gains of about
/// one, that is at most the lock (0.2 rad), and forces in units of load over slip stiffness, the accelerations behind which are
/// differences of squared speeds, `2 v^2` over 8 m. *Places* are a few metres, added to by speed times step. *Directions* are
/// fractions of a radian.
fn scales(problem: &DriveProblem, state: &[f32; STATE]) -> [f64; OF_A_STEP.len()] {
    let d = problem.driver();
    let at = |k: usize| f64::from(state[k].abs());
    let v = at(0);
    let steer = at(6) + d.step / 0.04 * 0.2;
    let foot = at(11) + at(12) + at(13) + v * d.step;
    let wanted = (2.0 * v * v / 8.0 + d.speed_gain * v) / (9.81 * 0.55 * d.slip_stiffness);
    let slip = |k: usize| at(k) + d.step / 0.06 * wanted;
    [
        steer,
        slip(7),
        slip(8),
        foot,
        foot,
        foot,
        at(14) + at(2) * d.step + 1e-2,
        20.0,
        at(19) + 2.0 * steer,
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
    let ready = CarModel::<f64, MagicFormula<f64>>::from_parameters(|i| flat[i]).to_table();
    let car = CarModel::<R, MagicFormula<R>>::from_table(|i| R::lit(ready[i]));
    let road = problem.road().stored::<R>();
    let world = World {
        road: &road,
        driver: &problem.driver().stored::<R>(),
        torque: &problem.torque().stored::<R>(),
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

impl Cases {
    /// Drives them in `f64`.
    ///
    /// # Errors
    /// Those of reading the bundled car.
    pub fn new() -> Result<Self> {
        let problem = problem(Car::bundled()?, &CIRCUITS, &PACES, STEP)?;
        let mut draws = Draws::new(7);
        let mut cars = candidates(&problem, COUNT, &mut draws);
        let near = neighbours(&cars, NEIGHBOURS, NEXT_TO, &mut draws);
        // One that cannot be evaluated, which every backend must say alike.
        cars[COUNT - 1].fill(f64::NAN);
        let reference = CpuDriveEvaluator::new(&problem);
        let all: Vec<&[f64]> = cars.iter().chain(&near).map(Vec::as_slice).collect();
        let mut exact = reference.outcomes(&all);
        let near = exact.split_off(COUNT);
        let determined = (0..COUNT)
            .map(|car| {
                car == COUNT - 1
                    || near[car * NEIGHBOURS..(car + 1) * NEIGHBOURS]
                        .iter()
                        .all(|other| match (&exact[car], other) {
                            (Ok(own), Ok(other)) => {
                                let limits = allowed(&problem, own);
                                own.ending == other.ending
                                    && (0..3)
                                        .all(|k| (figures(own)[k] - figures(other)[k]).abs() <= limits[k])
                            }
                            _ => false,
                        })
            })
            .collect();
        let steps = (0..COUNT - 1)
            .into_par_iter()
            .flat_map_iter(|car| {
                let candidate = &cars[car];
                // From all over the lap, the run-up included.
                let (states, _) = trail::<f64>(&problem, candidate, None, (0..STEPS).map(|i| i * 431));
                let cases: Vec<Step> = states
                    .into_iter()
                    .filter(|state| state[STATE - 1] == ending::UNDER_WAY)
                    .map(|state| {
                        let from = state.map(|x| x as f32);
                        let once = 2..3;
                        Step {
                            car,
                            from,
                            exact: trail(&problem, candidate, Some(from.map(f64::from)), once.clone()).0[0],
                            single: trail(&problem, candidate, Some(from), once).0[0],
                        }
                    })
                    .collect();
                cases
            })
            .collect();
        Ok(Self {
            problem,
            cars,
            exact,
            determined,
            steps,
        })
    }

    /// Single steps of the driver and whole laps on `subject`.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn compare(&self, subject: &Subject) -> Result<Vec<Agreement>> {
        let problem = &self.problem;
        let all: Vec<&[f64]> = self.cars.iter().map(Vec::as_slice).collect();
        let stepped: Vec<&[f64]> = self.steps.iter().map(|s| all[s.car]).collect();
        let from: Vec<[f32; STATE]> = self.steps.iter().map(|s| s.from).collect();
        let (laps, steps) = match subject {
            Subject::Lanes(set) => {
                let evaluator = SimdDriveEvaluator::new(problem, *set);
                (evaluator.outcomes(&all), evaluator.advance(&stepped, &from, 1))
            }
            Subject::Device(context) => {
                let mut evaluator = GpuDriveEvaluator::new(problem, Arc::clone(context))?;
                (evaluator.outcomes(&all)?, evaluator.advance(&stepped, &from, 1)?)
            }
        };
        let mut agreements = vec![self.compare_steps(subject, &steps)];
        for (k, name) in ["time", "room", "steering"].into_iter().enumerate() {
            let mut agreement = Agreement::new(&format!("drive, {name}"), subject);
            let determined = self.determined.iter().filter(|d| **d).count();
            agreement.verdict(2 * determined > COUNT, || {
                format!("{determined} cars whose lap is determined")
            });
            for car in (0..COUNT).filter(|car| self.determined[*car]) {
                agreement.verdict(verdict(&laps[car]) == verdict(&self.exact[car]), || {
                    format!("car {car}: {:?} for {:?}", laps[car], self.exact[car])
                });
                if let (Ok(found), Ok(exact)) = (&laps[car], &self.exact[car])
                    && exact.ending == ending::FINISHED
                {
                    let limit = allowed(problem, exact)[k];
                    let (found, exact) = (figures(found)[k], figures(exact)[k]);
                    agreement.note(found, exact, exact.abs(), limit, || format!("car {car}"));
                }
            }
            agreements.push(agreement);
        }
        Ok(agreements)
    }

    fn compare_steps(&self, subject: &Subject, found: &[[f32; STATE]]) -> Agreement {
        let mut agreement = Agreement::new("drive, step of the driver", subject);
        let mut alike = true;
        for (number, (case, found)) in self.steps.iter().zip(found).enumerate() {
            alike &= case.single == *found;
            // In another row, or ended: the same in both.
            for k in [9, 10, STATE - 1] {
                agreement.verdict(f64::from(found[k]) == case.exact[k], || {
                    format!("figure {k} of case {number}")
                });
            }
            let scales = scales(&self.problem, &case.from);
            for ((k, name), scale) in OF_A_STEP.into_iter().zip(scales) {
                let allowed = STEP_TOLERANCE * scale;
                agreement.note(f64::from(found[k]), case.exact[k], scale, allowed, || {
                    format!("{name} of case {number}")
                });
            }
        }
        agreement.bits_as_scalar = Some(alike);
        if matches!(subject, Subject::Lanes(_)) {
            agreement.verdict(alike, || "lanes have other bits than one float".to_owned());
        }
        agreement
    }
}
