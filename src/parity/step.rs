//! Layer two: one derivative and one Runge-Kutta step of random cars in random states.
//!
//! The reference gets the very figures that the subject has, rounded to `f32`, so that only arithmetic differs.

use super::{Agreement, Draws, Subject, car_source};
use crate::error::Result;
use crate::evaluate::gpu::GpuContext;
use crate::evaluate::simd::{LaneWork, dispatch};
use crate::scalar::Real;
use crate::scalar::lanes::Lanes;
use crate::vehicle::model::runge_kutta_step;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{
    Car, CarInput, CarModel, CarState, Chassis, LinearTyre, MagicFormula, TyreCoefficients, TyreModel, Tyres,
};

/// Step of integration, s.
const STEP: f32 = 0.01;
/// Rates of the six states, the two accelerations, the six states after a step.
pub const OUTPUTS: usize = 14;

/// A car's figures, a state and an input, all exact in `f32`.
#[derive(Clone, Debug)]
pub struct Case {
    /// The car's ready figures, as kernels read them.
    pub table: Vec<f32>,
    /// The state (m/s, m/s, rad/s, rad, rad/s, m/s^2).
    pub state: [f32; 6],
    /// Wheel speeds (rad/s), steering (rad), how far the DRS is open, and the road's friction.
    pub input: [f32; 7],
}

/// A case from the car `model` with every parameter up to a fifth off, and a state that races see. `None` if the
/// tyres came out ill-formed.
fn case(model: TyreModel, base: &Car, random: &mut Draws) -> Option<Case> {
    let car = match model {
        TyreModel::MagicFormula => base.clone(),
        TyreModel::Linear => on_linear_tyres(base),
    };
    let flat: Vec<f64> = car
        .to_flat()
        .iter()
        .map(|x| x * random.within(0.8, 1.2))
        .collect();
    let table = match model {
        TyreModel::MagicFormula => {
            let (chassis, tyre) = (Chassis::<f64>::PARAMETERS.len(), model.parameters().len());
            for axle in 0..2 {
                let tyre = TyreCoefficients::from_flat(&flat[chassis + axle * tyre..]);
                tyre.well_formed().ok()?;
            }
            CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat).to_table()
        }
        TyreModel::Linear => CarModel::<f64, LinearTyre<f64>>::from_parameters(&flat).to_table(),
    };
    let vx = random.within(10.0, 70.0);
    let state = [
        vx,
        random.within(-2.0, 2.0),
        random.within(-0.6, 0.6),
        random.within(-0.05, 0.05),
        random.within(-0.3, 0.3),
        random.within(-12.0, 12.0),
    ];
    let radius = car.chassis.radius_front;
    let mut rim = || vx / radius * random.within(0.92, 1.06);
    let input = [
        rim(),
        rim(),
        rim(),
        rim(),
        random.within(-0.12, 0.12),
        random.within(0.0, 1.0),
        random.within(0.3, 1.2),
    ];
    Some(Case {
        table: table.iter().map(|x| *x as f32).collect(),
        state: state.map(|x| x as f32),
        input: input.map(|x| x as f32),
    })
}

/// `base` on linear tyres.
pub(super) fn on_linear_tyres(base: &Car) -> Car {
    let tyre = |cornering_stiffness| LinearTyre {
        nominal_load: 3000.0,
        slip_stiffness: 60_000.0,
        cornering_stiffness,
        trail: 0.03,
    };
    Car {
        tyres: Tyres::Linear {
            front: tyre(52_000.0),
            rear: tyre(60_000.0),
        },
        ..base.clone()
    }
}

/// `count` random cases about the bundled car.
///
/// # Errors
/// Those of reading the bundled car.
pub fn cases(model: TyreModel, count: usize, seed: u64) -> Result<Vec<Case>> {
    let mut base = Car::bundled()?;
    (base.chassis.drs_drag, base.chassis.drs_lift) = (20.0, 15.0);
    let mut random = Draws::new(seed);
    Ok(std::iter::repeat_with(|| case(model, &base, &mut random))
        .flatten()
        .take(count)
        .collect())
}

impl Case {
    /// Everything in a row: state, input, table.
    pub fn row(&self) -> Vec<f32> {
        [&self.state[..], &self.input, &self.table].concat()
    }
}

/// The outputs in the scalar `R` of a [`Case::row`].
#[inline(always)]
fn outputs<R: Real, T: Tyre<R>>(row: &[R]) -> [R; OUTPUTS] {
    let car = CarModel::<R, T>::from_table(&row[13..]);
    let state = CarState::from_array(std::array::from_fn(|i| row[i]));
    let input = CarInput {
        wheel_speed: std::array::from_fn(|i| row[6 + i]),
        steer: row[10],
        flap: row[11],
        friction: Some(row[12]),
    };
    // A loop as in the kernel, whose count the compiler does not know: it would unroll a lone step of many lanes
    // until it ran out of stack.
    let mut rate = car.rate(&state, &input);
    let mut next = state;
    for _ in 0..std::hint::black_box(1) {
        next = runge_kutta_step(
            &car,
            &next,
            |_| input,
            R::lit(f64::from(STEP)),
            |first| rate = *first,
        );
    }
    let slopes = rate.state.to_array();
    let reached = next.to_array();
    std::array::from_fn(|i| match i {
        0..6 => slopes[i],
        6 => rate.ax,
        7 => rate.ay,
        _ => reached[i - 8],
    })
}

/// The outputs of a case in the scalar `R`.
pub fn evaluated<R: Real>(model: TyreModel, case: &Case) -> [R; OUTPUTS] {
    let row: Vec<R> = case.row().iter().map(|x| R::lit(f64::from(*x))).collect();
    match model {
        TyreModel::MagicFormula => outputs::<R, MagicFormula<R>>(&row),
        TyreModel::Linear => outputs::<R, LinearTyre<R>>(&row),
    }
}

struct InLanes<'a>(TyreModel, &'a [Vec<f32>]);

impl LaneWork for InLanes<'_> {
    type Output = Vec<[f32; OUTPUTS]>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let mut all = Vec::new();
        for pack in self.1.chunks(L::LANES) {
            let row: Vec<L> = (0..pack[0].len())
                .map(|i| L::from_fn(|lane| pack[lane.min(pack.len() - 1)][i]))
                .collect();
            let lanes = match self.0 {
                TyreModel::MagicFormula => outputs::<L, MagicFormula<L>>(&row),
                TyreModel::Linear => outputs::<L, LinearTyre<L>>(&row),
            };
            let mut columns = [[0.0f32; 32]; OUTPUTS];
            for (column, lanes) in columns.iter_mut().zip(lanes) {
                lanes.write(column);
            }
            all.extend((0..pack.len()).map(|lane| columns.map(|column| column[lane])));
        }
        all
    }
}

fn on_device(context: &GpuContext, model: TyreModel, cases: &[Case]) -> Result<Vec<[f32; OUTPUTS]>> {
    let lanes = cases.len();
    let figures = cases[0].table.len();
    let entry = "
        fn given(row: u32, lane: u32) -> f32 { return figures[AFTER_FIGURES + row * stretch.stride + lane]; }
        @compute @workgroup_size(64) fn one_step(@builtin(global_invocation_id) id: vec3<u32>) {
            let lane = id.x;
            if lane >= stretch.stride { return; }
            let car = load_car(lane);
            let state = CarState(
                BodyState(given(0u, lane), given(1u, lane), given(2u, lane), given(3u, lane), given(4u, lane)),
                given(5u, lane),
            );
            let wheels = vec4<f32>(given(6u, lane), given(7u, lane), given(8u, lane), given(9u, lane));
            let input = CarInput(wheels, given(10u, lane), given(11u, lane), given(12u, lane));
            let step = given(13u, lane);
            var first: CarRate;
            var sum = state;
            var reached = state;
            for (var stage = 0u; stage < STAGES; stage++) {
                let rate = car_rate(car, reached, input);
                if stage == 0u { first = rate; }
                sum = carried(sum, step * stage_weight(stage), rate.state);
                reached = carried(state, step * stage_reach(stage), rate.state);
            }
            let out = array<f32, 14>(
                first.state.body.vx, first.state.body.vy, first.state.body.yaw_rate, first.state.body.roll,
                first.state.body.roll_rate, first.state.pitch_acceleration, first.ax, first.ay,
                sum.body.vx, sum.body.vy, sum.body.yaw_rate, sum.body.roll, sum.body.roll_rate,
                sum.pitch_acceleration,
            );
            for (var i = 0u; i < 14u; i++) { to_host[i * stretch.stride + lane] = out[i]; }
        }";
    let mut rows: Vec<f32> = Vec::new();
    for figure in 0..figures {
        rows.extend(cases.iter().map(|c| c.table[figure]));
    }
    for i in 0..6 {
        rows.extend(cases.iter().map(|c| c.state[i]));
    }
    for i in 0..7 {
        rows.extend(cases.iter().map(|c| c.input[i]));
    }
    rows.extend(cases.iter().map(|_| STEP));
    let source = car_source((model, context.wheels()), figures, lanes, entry);
    let out = context.run_array(&source, "one_step", &rows, OUTPUTS * lanes, lanes)?;
    Ok((0..lanes)
        .map(|lane| std::array::from_fn(|i| out[i * lanes + lane]))
        .collect())
}

/// What an error of each output is measured against: the sum of the magnitudes of what it is made of.
///
/// Slip is a difference of speeds, so it carries three roundings of 6e-8 of one; slip stiffness is at most 30 times
/// the load (50 at 1.2^2 of the bundled tyre, in the linear one 20), so a wheel's force is off by about 5e-6 of its
/// load, and the formula's own two dozen roundings, which partly cancel, add as much again. Forces are hence
/// measured against the loads, and 1e-5 is the limit. A step's error is that of the rates times the step, which the
/// stages may double, plus the rounding of the state.
pub fn scales(case: &Case) -> [f64; OUTPUTS] {
    let f = |x: f32| f64::from(x);
    let car = Chassis::from_flat(&case.table.iter().map(|x| f(*x)).collect::<Vec<f64>>());
    let [vx, vy, r, phi, p, pitch] = case.state.map(f);
    let downforce = car.air_density / 2.0 * (car.lift_area + car.drag_area) * vx * vx;
    let force = car.mass * car.gravity + downforce;
    let mass = force / car.mass;
    let yaw = force * (car.cg_to_front + car.cg_to_rear) / car.inertia_yaw;
    let moment = car.cg_height * force
        + car.roll_stiffness * phi.abs()
        + car.roll_damping * p.abs()
        + car.mass * car.gravity * car.cg_height * phi.abs();
    let roll = moment / car.inertia_roll;
    let x = mass + (vy * r).abs();
    let y = mass + (vx * r).abs() + car.cg_height * roll;
    let lagged = (mass + pitch.abs()) / car.pitch_lag;
    let rates = [x, y, yaw, p.abs().max(1e-3), roll, lagged];
    let step = 2.0 * f64::from(STEP);
    let mut scales = [0.0; OUTPUTS];
    scales[..6].copy_from_slice(&rates);
    scales[6] = x + (vy * r).abs();
    scales[7] = y + (vx * r).abs();
    for (i, state) in [vx, vy, r, phi, p, pitch].into_iter().enumerate() {
        // Roll's rate in a step is that of the roll rate reached within it.
        let rate = if i == 3 { rates[3] + step * roll } else { rates[i] };
        scales[8 + i] = state.abs() + step * rate;
    }
    scales
}

/// Greatest error in [`scales`].
pub const TOLERANCE: f64 = 1e-5;

/// Cases per tyre model.
const COUNT: usize = 2048;
/// The tyre models and the kernel that each makes of the step.
const MODELS: [(TyreModel, &str); 2] = [
    (TyreModel::MagicFormula, "step, Magic Formula"),
    (TyreModel::Linear, "step, linear tyre"),
];

/// Random cars of both tyre models on `subject`.
///
/// # Errors
/// [`crate::Error::Device`] if the device fails.
pub fn compare(subject: &Subject) -> Result<Vec<Agreement>> {
    MODELS
        .iter()
        .map(|(model, name)| {
            let cases = cases(*model, COUNT, 11)?;
            let found = match subject {
                Subject::Lanes(set) => {
                    let rows: Vec<_> = cases.iter().map(Case::row).collect();
                    dispatch(*set, InLanes(*model, &rows))
                }
                Subject::Device(context) => on_device(context, *model, &cases)?,
            };
            let mut agreement = Agreement::new(name, subject);
            let mut alike = true;
            for (number, (case, found)) in cases.iter().zip(&found).enumerate() {
                let expected = evaluated::<f64>(*model, case);
                for (i, scale) in scales(case).into_iter().enumerate() {
                    agreement.note(f64::from(found[i]), expected[i], scale, TOLERANCE * scale, || {
                        format!("output {i} of case {number}")
                    });
                }
                alike &= evaluated::<f32>(*model, case) == *found;
            }
            agreement.bits(alike, subject);
            Ok(agreement)
        })
        .collect()
}
