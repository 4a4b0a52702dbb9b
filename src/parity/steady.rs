//! Layer seven: cars that settle in steady-state cornering.

pub use super::candidates;
use super::{Agreement, Draws, Subject, free_about, neighbours, spacing, step};
use crate::error::Result;
use crate::evaluate::Failure;
use crate::evaluate::steady::kernel::{Aim, INTEGRATED, STATE, Settling, ending, settle};
use crate::evaluate::steady::modes::{displaced, slopes};
use crate::evaluate::steady::{
    CpuSteadyEvaluator, GpuSteadyEvaluator, SETTLED, Settled, SimdSteadyEvaluator, SteadyObjective,
    SteadyProblem,
};
use crate::scalar::Counted;
use crate::scalar::{Real, operations_of};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{Car, CarModel, LinearTyre, MagicFormula, TyreModel};
use std::sync::Arc;

/// Parameters that random cars differ in, for either tyre model.
const PARAMETERS: [&[&str]; 2] = [
    &[
        "mass_kg",
        "front_roll_moment_share",
        "aero_balance_front",
        "roll_stiffness_nm_per_rad",
        "rBy1",
        "front.pKy1",
        "front.pDy1",
    ],
    &[
        "mass_kg",
        "front_roll_moment_share",
        "aero_balance_front",
        "front.cornering_stiffness_n_per_rad",
    ],
];
/// How far they go, as a share of themselves.
const SHARE: f64 = 0.1;
/// Path speeds, m/s.
const SPEEDS: [f64; 2] = [20.0, 70.0];
/// Cars, each with its own speed and steering.
const COUNT: usize = 96;
/// Cars next to each, every figure up to a millionth off, whose verdicts in `f64` must be the car's own; otherwise it says
/// nothing of arithmetic and is left out.
const NEIGHBOURS: usize = 2;
const NEXT_TO: f64 = 1e-6;
/// A trim that the roundings of `f32` may move by more than this (m/s^2) is next to none, and left out too: where steering turns
/// back along the curve of trims, nothing holds the car in its place.
const DETERMINED: f64 = 0.02;

/// The problem of steady-state cornering of `car`. Those of its parameters that its tyre model lists are free within a tenth about
/// themselves; steering goes as far as the wheels turn.
///
/// # Errors
/// [`crate::Error::Input`] naming a parameter that the car lacks.
pub fn problem(car: Car) -> Result<SteadyProblem> {
    let names = match car.tyre_model() {
        TyreModel::MagicFormula => PARAMETERS[0],
        TyreModel::Linear => PARAMETERS[1],
    };
    let free = free_about(&car, names, SHARE)?;
    let lock = car.max_steer_rad;
    SteadyProblem::new(car, free, SPEEDS, [-lock, lock], &SteadyObjective::ALL)
}

/// A candidate's car as kernels read it.
fn table(problem: &SteadyProblem, candidate: &[f64]) -> Vec<f64> {
    let flat = problem.free.flat(candidate);
    match problem.tyre_model() {
        TyreModel::MagicFormula => {
            CarModel::<f64, MagicFormula<f64>>::from_parameters(|i| flat[i]).to_table()
        }
        TyreModel::Linear => CarModel::<f64, LinearTyre<f64>>::from_parameters(|i| flat[i]).to_table(),
    }
}

fn settled_on<R: Real, T: Tyre<R>>(problem: &SteadyProblem, candidate: &[f64], steps: u32) -> Settling<R> {
    let table = table(problem, candidate);
    let car = CarModel::<R, T>::from_table(|i| R::lit(table[i]));
    let [speed, steer] = problem.aim_figures(candidate).map(R::lit);
    let mut plan = problem.plan().stored::<R>();
    plan.steps = plan.steps.min(steps);
    settle(&car, &plan, &Aim { speed, steer })
}

/// The last state of a candidate in the scalar `R`.
fn settled_in<R: Real>(problem: &SteadyProblem, candidate: &[f64]) -> Settling<R> {
    match problem.tyre_model() {
        TyreModel::MagicFormula => settled_on::<R, MagicFormula<R>>(problem, candidate, u32::MAX),
        TyreModel::Linear => settled_on::<R, LinearTyre<R>>(problem, candidate, u32::MAX),
    }
}

/// Arithmetic operations of a candidate of a car on Magic Formula tyres.
pub fn work_of(problem: &SteadyProblem, candidate: &[f64]) -> u64 {
    let count = |steps: u32| {
        operations_of(|| {
            settled_on::<Counted, MagicFormula<Counted>>(problem, candidate, steps);
        })
    };
    // All steps are alike.
    count(0) + u64::from(problem.plan().steps) * (count(2) - count(1))
}

/// What single precision may move of a trim: lateral acceleration (m/s^2), sideslip (rad), roll (rad) and slip ratio.
///
/// The rates of change are off by what the layer of steps allows, 1e-5 of what they are made of, and every step loses up to half
/// a spacing of each figure. The trim then moves by the inverse of the slopes there times that; what comes and goes may shake
/// it by as much again. Nothing of a trim that nothing holds the car in.
pub fn allowed(problem: &SteadyProblem, candidate: &[f64], state: &Settling<f64>) -> Option<[f64; 4]> {
    let [speed, steer] = problem.aim_figures(candidate);
    let [vy, yaw_rate, roll, roll_rate, pitch, slip] = state.figures;
    let vx = (speed * speed - vy * vy).max(0.0).sqrt();
    let plan = problem.plan();
    let case = step::Case {
        table: table(problem, candidate).iter().map(|x| *x as f32).collect(),
        state: [vx, vy, yaw_rate, roll, roll_rate, pitch].map(|x| x as f32),
        input: [0.0; 5],
    };
    let scales = step::scales(&case);
    let push = scales[0] + (vy * yaw_rate).abs();
    let of_rates = [scales[1], scales[2], 0.0, scales[4], scales[5], plan.gain * push];
    let figures = [vy, yaw_rate, roll, roll_rate, pitch, slip];
    let off: [f64; INTEGRATED] =
        std::array::from_fn(|k| step::TOLERANCE * of_rates[k] + 0.5 * spacing(figures[k]) / plan.step);
    let flat = problem.free.flat(candidate);
    let model = (problem.tyre_model(), flat.as_slice());
    let slopes = slopes(model, plan.gain, (speed, steer), state.figures);
    let moved = displaced(&slopes, &off)?.map(|x| 2.0 * x);
    Some([speed * moved[1], moved[0] / vx, moved[2], moved[5]])
}

/// Their names.
const FIGURES: [&str; 4] = ["lateral acceleration", "sideslip", "roll", "slip"];

fn figures(trim: &Settled) -> [f64; 4] {
    [trim.ay_mps2, trim.sideslip_rad, trim.roll_rad, trim.slip_ratio]
}

/// A trim, or why there is none.
type Found = std::result::Result<Settled, Failure>;

/// Cars on one tyre model, and what the reference says of them.
struct OneModel {
    name: &'static str,
    problem: SteadyProblem,
    cars: Vec<Vec<f64>>,
    exact: Vec<Found>,
    /// What may be off of a trim; nothing for a car that is left out.
    limits: Vec<Option<[f64; 4]>>,
    single: Vec<[f64; STATE]>,
}

impl OneModel {
    fn new(name: &'static str, car: Car) -> Result<Self> {
        let problem = problem(car)?;
        let mut draws = Draws::new(17);
        let mut cars = candidates(&problem, COUNT, &mut draws);
        // One that cannot be evaluated, which every backend must say alike.
        cars[COUNT - 1].fill(f64::NAN);
        let near = neighbours(&cars, NEIGHBOURS, NEXT_TO, &mut draws);
        let all: Vec<&[f64]> = cars.iter().chain(&near).map(Vec::as_slice).collect();
        let states = CpuSteadyEvaluator::new(&problem).outcomes(&all);
        let verdict = |place: usize| match &states[place] {
            Ok(state) => problem.settled(all[place], state),
            Err(failure) => Err(*failure),
        };
        let limits = (0..COUNT)
            .map(|car| {
                let own = verdict(car);
                let first = COUNT + car * NEIGHBOURS;
                let alike = (first..first + NEIGHBOURS).all(|n| verdict(n).err() == own.err());
                // A residual this near to the edge may fall on its other side.
                let near = |s: &Settling<f64>| {
                    s.ending == ending::SETTLING && (0.5 * SETTLED..2.0 * SETTLED).contains(&s.residual)
                };
                let limits = match &states[car] {
                    Ok(state) if own.is_ok() => allowed(&problem, all[car], state)?,
                    _ => [0.0; 4],
                };
                let clear = !states[car].as_ref().is_ok_and(near);
                (alike && clear && limits[0] < DETERMINED).then_some(limits)
            })
            .collect();
        Ok(Self {
            name,
            exact: (0..COUNT).map(verdict).collect(),
            single: all[..COUNT - 1]
                .iter()
                .map(|car| settled_in::<f32>(&problem, car).widened().to_array())
                .collect(),
            limits,
            problem,
            cars,
        })
    }

    fn compare(&self, subject: &Subject) -> Result<Vec<Agreement>> {
        let all: Vec<&[f64]> = self.cars.iter().map(Vec::as_slice).collect();
        let states = match subject {
            Subject::Lanes(set) => SimdSteadyEvaluator::new(&self.problem, *set).outcomes(&all),
            Subject::Device(context) => {
                GpuSteadyEvaluator::new(&self.problem, Arc::clone(context))?.outcomes(&all)?
            }
        };
        let bits = |figures: [f64; STATE]| figures.map(f64::to_bits);
        let alike = self.single.iter().zip(&states).all(|(single, found)| {
            found
                .as_ref()
                .is_ok_and(|found| bits(found.to_array()) == bits(*single))
        });
        let determined = self.limits.iter().flatten().count();
        let mut agreements = Vec::new();
        for (k, figure) in FIGURES.into_iter().enumerate() {
            let mut agreement = Agreement::new(&format!("steady, {}, {figure}", self.name), subject);
            agreement.bits_as_scalar = Some(alike);
            if matches!(subject, Subject::Lanes(_)) {
                agreement.verdict(alike, || "lanes have other bits than one float".to_owned());
            }
            agreement.verdict(2 * determined > COUNT, || {
                format!("{determined} cars whose trim is determined")
            });
            for car in 0..COUNT {
                let Some(limits) = &self.limits[car] else { continue };
                let found = match &states[car] {
                    Ok(state) => self.problem.settled(all[car], state),
                    Err(failure) => Err(*failure),
                };
                agreement.verdict(found.err() == self.exact[car].err(), || {
                    format!("car {car}: {found:?} for {:?}", self.exact[car])
                });
                if let (Ok(found), Ok(exact)) = (&found, &self.exact[car]) {
                    let (found, exact) = (figures(found)[k], figures(exact)[k]);
                    agreement.note(found, exact, exact.abs(), limits[k], || format!("car {car}"));
                }
            }
            agreements.push(agreement);
        }
        Ok(agreements)
    }
}

/// Random cars on both tyre models, and what the reference says of them.
pub struct Cases(Vec<OneModel>);

impl Cases {
    /// Settles them in `f64`.
    ///
    /// # Errors
    /// Those of reading the bundled car.
    pub fn new() -> Result<Self> {
        let car = Car::bundled()?;
        let linear = step::on_linear_tyres(&car);
        Ok(Self(vec![
            OneModel::new("Magic Formula", car)?,
            OneModel::new("linear tyre", linear)?,
        ]))
    }

    /// The trims on `subject`.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn compare(&self, subject: &Subject) -> Result<Vec<Agreement>> {
        let each: Vec<_> = self.0.iter().map(|m| m.compare(subject)).collect::<Result<_>>()?;
        Ok(each.concat())
    }
}
