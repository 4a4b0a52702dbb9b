//! Layer seven: cars that settle in steady-state cornering.

pub use super::candidates;
use super::cases::{Cases, Compared, layer_of};
use super::{Draws, Layer, free_about, spacing, step};
use crate::error::Result;
use crate::evaluate::Failure;
use crate::evaluate::steady::kernel::{Aim, INTEGRATED, Settling, ending, settle};
use crate::evaluate::steady::modes::{displaced, slopes};
use crate::evaluate::steady::{SETTLED, SteadyObjective, SteadyProblem};
use crate::scalar::{Counted, Real, operations_of};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{Car, CarModel, LinearTyre, MagicFormula, TyreModel};

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
/// Cars next to each, whose trims in `f64` say how well the car's own is determined.
const NEIGHBOURS: usize = 2;
/// A trim that the roundings of `f32` may move by more than this (m/s^2) is next to none, and left out too: where steering turns
/// back along the curve of trims, nothing holds the car in its place.
const DETERMINED: f64 = 0.02;

/// The problem of steady-state cornering of `car`. Those of its parameters that its tyre model lists are free within a tenth about
/// themselves; steering goes as far as the wheels turn.
///
/// # Errors
/// [`crate::Error::Input`] naming a parameter that the car lacks.
pub fn problem(car: Car) -> Result<SteadyProblem> {
    problem_by(car, &SteadyObjective::ALL)
}

/// The same by these objectives.
///
/// # Errors
/// As [`problem`].
pub fn problem_by(car: Car, objectives: &[SteadyObjective]) -> Result<SteadyProblem> {
    let names = match car.tyre_model() {
        TyreModel::MagicFormula => PARAMETERS[0],
        TyreModel::Linear => PARAMETERS[1],
    };
    let free = free_about(&car, names, SHARE)?;
    let lock = car.max_steer_rad;
    SteadyProblem::new(car, free, SPEEDS, [-lock, lock], objectives)
}

/// A candidate's car as kernels read it.
fn table(problem: &SteadyProblem, candidate: &[f64]) -> Vec<f64> {
    let flat = problem.free.flat(candidate);
    match problem.tyre_model() {
        TyreModel::MagicFormula => CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat).to_table(),
        TyreModel::Linear => CarModel::<f64, LinearTyre<f64>>::from_parameters(&flat).to_table(),
    }
}

fn settled_on<R: Real, T: Tyre<R>>(problem: &SteadyProblem, candidate: &[f64], steps: u32) -> Settling<R> {
    let table: Vec<R> = table(problem, candidate).into_iter().map(R::lit).collect();
    let car = CarModel::<R, T>::from_table(&table);
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
        input: [0.0; 7],
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

impl Compared for SteadyProblem {
    const NOUN: &'static str = "car";

    fn figures(&self, candidate: &[f64], state: &Settling<f64>) -> std::result::Result<Vec<f64>, Failure> {
        let trim = self.settled(candidate, state)?;
        Ok(vec![
            trim.ay_mps2,
            trim.sideslip_rad,
            trim.roll_rad,
            trim.slip_ratio,
        ])
    }

    fn limits(&self, candidate: &[f64], state: &Settling<f64>, exact: &[f64]) -> Option<Vec<[f64; 2]>> {
        // A residual this near to the edge may fall on its other side.
        let near = (0.5 * SETTLED..2.0 * SETTLED).contains(&state.residual);
        if state.ending == ending::SETTLING && near {
            return None;
        }
        if exact.is_empty() {
            return Some(Vec::new());
        }
        let limits = allowed(self, candidate, state)?;
        let scales = exact.iter().map(|x| x.abs());
        (limits[0] < DETERMINED).then(|| scales.zip(limits).map(Into::into).collect())
    }

    fn alike(&self, candidate: &[f64], found: &Settling<f64>) -> Option<bool> {
        let bits = |state: Settling<f64>| state.to_array().map(f64::to_bits);
        Some(bits(settled_in::<f32>(self, candidate).widened()) == bits(*found))
    }
}

/// The layer: random cars on both tyre models.
///
/// # Errors
/// Those of reading the bundled car.
pub fn layer() -> Result<Layer> {
    let car = Car::bundled()?;
    let linear = step::on_linear_tyres(&car);
    let cases = [("Magic Formula", car), ("linear tyre", linear)].map(|(tyre, car)| {
        let problem = problem(car)?;
        let mut draws = Draws::new(17);
        let cars = candidates(&problem, COUNT, &mut draws);
        let figures = ["lateral acceleration", "sideslip", "roll", "slip"];
        let names = figures.map(|figure| format!("steady, {tyre}, {figure}")).to_vec();
        Ok(Cases::among_neighbours(
            names, problem, cars, NEIGHBOURS, &mut draws,
        ))
    });
    Ok(layer_of(cases.into_iter().collect::<Result<_>>()?))
}
