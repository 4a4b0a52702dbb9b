//! Layer three and four: whole laps on every `f32` backend against the `f64` reference.

use crate::common::{Random, UNKNOWNS, bundled_car, linear_car, problem};
use crate::device::{device, devices};
use lapswarm::evaluate::replay::kernel::{drive_window, score_window};
use lapswarm::evaluate::replay::{
    CHANNEL_NAMES, CpuEvaluator, GpuEvaluator, ModelTable, Norm, Plan, ReplayProblem, SimdEvaluator, trace,
};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{Evaluation, Evaluator, ProblemKind};
use lapswarm::parity::synthetic_lap::{INTERVAL_S, Lap, candidates};
use lapswarm::parity::{Draws, Subject, car_source};
use lapswarm::scalar::Real;
use lapswarm::vehicle::tyre::Tyre;
use lapswarm::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use std::fmt::Write as _;
use std::sync::Arc;

tests! {
    a_whole_lap_agrees_on_every_backend_in_every_norm: also_device,
    a_lap_at_the_limit_agrees_on_who_spins: also_device,
    windows_substeps_and_the_linear_tyre_agree: also_device,
}

/// Allowed difference of an objective, as a share of it.
///
/// A forward speed of 50 m/s in `f32` is off by up to 2e-6 m/s, which is a slip of 4e-8 at all wheels alike; slip
/// stiffness is some 25 times the load, so accelerations are off by 1e-5 m/s^2 however the rest is reckoned, and by
/// a few times that with the rounding of what makes a slip. Errors do not grow along the lap: wheels at given
/// speeds and angles hold the car. The made-up log has sensor noise of 0.15 m/s^2 in the mean (for speed and yaw
/// rate likewise some 1e4 times their rounding), under which no candidate's cost can fall. A systematic error of
/// 1.5e-5 m/s^2 is hence 1e-4 of the least cost.
const TOLERANCE: f64 = 1e-4;

/// What a single sample may be off by, channel by channel, which is all that the infinity norm sees; sums over a
/// lap average it out. The wheels pull the car back to their speed in 0.2 s (50 m/s over 25 times gravity): the
/// roundings of the speed in the 20 steps till then, 2e-6 m/s each, add up to 4e-5 m/s if they all have one sign.
/// That is a slip of 8e-7, which is 2e-4 m/s^2 by the same stiffness; yaw rate follows at the rate of that over
/// the speed.
const SINGLE_SAMPLE: [f64; 4] = [4e-5, 2e-4, 2e-4, 1e-5];

/// Errors of `car`, window by window; `None` if it does not drive to the end.
fn errors<R: Real<Mask = bool, Storage = R> + Into<f64>, T: Tyre<R>>(
    replay: &ReplayProblem,
    plan: &Plan<R>,
    car: &CarModel<R, T>,
) -> Option<[f64; 4]> {
    let mut total = [0.0; 4];
    for window in &plan.windows {
        let score = score_window(car, plan, window);
        if !score.drives {
            return None;
        }
        replay.accumulate(&mut total, score.errors.map(Into::into));
    }
    Some(total)
}

/// The `f32` scalar, window by window, as the lanes do it.
fn scalar(replay: &ReplayProblem, population: &[f64]) -> Evaluation {
    fn single<T: Tyre<f32>>(replay: &ReplayProblem, plan: &Plan<f32>, figures: &[f32]) -> Option<[f64; 4]> {
        errors(replay, plan, &CarModel::<f32, T>::from_table(figures))
    }
    let table = ModelTable::new(&replay.free, &replay.problem.variables);
    let plan = replay.plan.to_f32();
    let mut evaluation = Evaluation::default();
    for candidate in population.chunks_exact(replay.dimensions()) {
        let failure = replay.free.preliminary_failure(candidate);
        let errors = if failure.is_some() {
            None
        } else {
            let figures = figures(replay, &table, candidate);
            match replay.tyre_model() {
                TyreModel::MagicFormula => single::<MagicFormula<f32>>(replay, &plan, &figures),
                TyreModel::Linear => single::<LinearTyre<f32>>(replay, &plan, &figures),
            }
        };
        let (row, spun) = replay.objective_row(candidate, Ok(&errors));
        evaluation.objectives.extend(row);
        evaluation.failures.push(failure.or(spun));
    }
    evaluation
}

/// A candidate's ready figures as the `f32` backends see them.
fn figures(replay: &ReplayProblem, table: &ModelTable, candidate: &[f64]) -> Vec<f32> {
    let row = table.rows(&replay.free, &[candidate]);
    let place = |(base, source): (&f32, &Option<usize>)| source.map_or(*base, |figure| row[figure]);
    table.base.iter().zip(&table.sources).map(place).collect()
}

/// Outputs sample by sample in the `f32` scalar, whose bits the lanes share.
fn scalar_trace(replay: &ReplayProblem, candidate: &[f64]) -> Vec<[f32; 4]> {
    fn go<T: Tyre<f32>>(replay: &ReplayProblem, figures: &[f32]) -> Vec<[f32; 4]> {
        let plan = replay.plan.to_f32();
        let car = CarModel::<f32, T>::from_table(figures);
        let mut outputs = Vec::new();
        drive_window(&car, &plan, &plan.windows[0], |_, output| outputs.push(output));
        outputs
    }
    let figures = figures(
        replay,
        &ModelTable::new(&replay.free, &replay.problem.variables),
        candidate,
    );
    match replay.tyre_model() {
        TyreModel::MagicFormula => go::<MagicFormula<f32>>(replay, &figures),
        TyreModel::Linear => go::<LinearTyre<f32>>(replay, &figures),
    }
}

/// Outputs sample by sample on the device, for one step per sample.
fn device_trace(replay: &ReplayProblem, candidate: &[f64]) -> Vec<[f32; 4]> {
    let Some(context) = device() else {
        return Vec::new();
    };
    let figures = figures(
        replay,
        &ModelTable::new(&replay.free, &replay.problem.variables),
        candidate,
    );
    let entry = "
        fn given(i: u32) -> f32 { return figures[AFTER_FIGURES + i]; }
        @compute @workgroup_size(64) fn trace(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x > 0u { return; }
            let car = load_car(0u);
            var state = CarState(BodyState(given(0u), given(1u), given(2u), given(3u), given(4u)), given(5u));
            let step = given(6u);
            let last = arrayLength(&to_host) / 4u - 1u;
            for (var i = 0u; i <= last; i++) {
                let a = 7u + 5u * i;
                let b = 7u + 5u * min(i + 1u, last);
                let from_wheels = vec4<f32>(given(a), given(a + 1u), given(a + 2u), given(a + 3u));
                let to_wheels = vec4<f32>(given(b), given(b + 1u), given(b + 2u), given(b + 3u));
                var sum = state;
                var reached = state;
                for (var stage = 0u; stage < STAGES; stage++) {
                    let share = stage_input(vec4<f32>(0.0, 0.5, 1.0, 0.0), stage);
                    let input = CarInput(
                        from_wheels + share * (to_wheels - from_wheels),
                        given(a + 4u) + share * (given(b + 4u) - given(a + 4u)),
                    );
                    let rate = car_rate(car, reached, input);
                    if stage == 0u {
                        to_host[4u * i] = state.body.vx;
                        to_host[4u * i + 1u] = rate.ax;
                        to_host[4u * i + 2u] = rate.ay;
                        to_host[4u * i + 3u] = state.body.yaw_rate;
                    }
                    sum = carried(sum, step * stage_weight(stage), rate.state);
                    reached = carried(state, step * stage_reach(stage), rate.state);
                }
                if still_drives(sum) { state = sum; }
            }
        }";
    let plan = replay.plan.to_f32();
    let window = &plan.windows[0];
    let mut input = figures.clone();
    input.extend(window.initial);
    input.push(plan.step);
    let samples = &plan.samples[window.start..window.end];
    for sample in samples {
        input.extend(sample.wheel_speed);
        input.push(sample.steer);
    }
    let source = car_source((replay.tyre_model(), context.wheels()), figures.len(), 1, entry);
    let flat = context
        .run_array(&source, "trace", &input, samples.len() * 4, 1)
        .expect("the kernel runs");
    flat.chunks_exact(4)
        .map(|row| std::array::from_fn(|k| row[k]))
        .collect()
}

/// Writes both traces of `candidate`'s first window to a temporary folder and says where they first part.
fn report(replay: &ReplayProblem, backend: &str, candidate: &[f64]) -> String {
    let window = &replay.plan.windows[0];
    let reference = trace(&replay.flat(candidate), replay.tyre_model(), &replay.plan, window).outputs;
    let found = if backend == "gpu" {
        device_trace(replay, candidate)
    } else {
        scalar_trace(replay, candidate)
    };
    let mut text = format!("time_s,{0},{0}\n", CHANNEL_NAMES.join(","));
    let mut parted = None;
    for (i, (expected, found)) in reference.iter().zip(&found).enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{},{expected:?},{found:?}", i as f64 * INTERVAL_S);
        let apart = |k: usize| (f64::from(found[k]) - expected[k]).abs() > 1e-3 * (1.0 + expected[k].abs());
        if parted.is_none() && (0..4).any(apart) {
            parted = Some((i, *expected, *found));
        }
    }
    let folder = tempfile::tempdir().expect("a temporary folder").keep();
    let path = folder.join(format!("parity_{backend}.csv"));
    std::fs::write(&path, text.replace(['[', ']'], "")).expect("traces are written");
    let traces = path.display();
    match parted {
        Some((i, expected, found)) => {
            format!("they part at sample {i}: {expected:?} and {found:?}; traces in {traces}")
        }
        None => format!("they nowhere part by a thousandth; traces in {traces}"),
    }
}

/// What the reference says of cars next to `candidate`, all of whose parameters, free or not, are up to a millionth
/// off.
///
/// Single precision moves every figure by a sixteenth of that at the outset and the state by as much in every step.
/// Where a millionth changes the reference's own verdict, or its cost by more than the tolerance, the car stands at
/// the edge of a spin, and neither answer is wrong.
fn neighbours(replay: &ReplayProblem, candidate: &[f64]) -> Evaluation {
    fn near<T: Tyre<f64>>(replay: &ReplayProblem, flat: &[f64]) -> Option<[f64; 4]> {
        let car = CarModel::<f64, T>::from_parameters(flat);
        errors(replay, &replay.plan, &car)
    }
    let mut random = Random(99);
    let mut evaluation = Evaluation::default();
    for _ in 0..32 {
        let mut flat = replay.flat(candidate);
        for x in &mut flat {
            *x *= 1.0 + random.within(-1e-6, 1e-6);
        }
        let errors = match replay.tyre_model() {
            TyreModel::MagicFormula => near::<MagicFormula<f64>>(replay, &flat),
            TyreModel::Linear => near::<LinearTyre<f64>>(replay, &flat),
        };
        let (row, spun) = replay.objective_row(candidate, Ok(&errors));
        evaluation.objectives.extend(row);
        evaluation.failures.push(spun);
    }
    evaluation
}

/// What a comparison found.
#[derive(Debug, Default)]
struct Agreement {
    /// The largest difference of an objective as a share of it, cars at the edge apart.
    largest: f64,
    /// Cars at the edge of a spin, which were held to the reference's own spread.
    at_the_edge: usize,
}

/// Compares a backend with the reference.
fn compare(
    replay: &ReplayProblem,
    backend: &str,
    population: &[f64],
    expected: &Evaluation,
    found: &Evaluation,
) -> Agreement {
    let n = replay.objectives.len();
    let norm = replay.plan.norm;
    let mut agreement = Agreement::default();
    for (i, candidate) in population.chunks_exact(replay.dimensions()).enumerate() {
        let (e, f) = (expected.failures[i], found.failures[i]);
        let rows = i * n..(i + 1) * n;
        let (exact, single) = (&expected.objectives[rows.clone()], &found.objectives[rows]);
        let allowed = |k: usize| {
            let floor = if norm == Norm::Infinity {
                SINGLE_SAMPLE[k]
            } else {
                0.0
            };
            // A square is twice as sensitive as what is squared.
            let relative = if norm == Norm::MeanSquare {
                2.0 * TOLERANCE
            } else {
                TOLERANCE
            };
            relative * exact[k] + floor
        };
        // The costs of failures are infinite.
        let off = |k: usize| {
            if single[k] == exact[k] {
                0.0
            } else {
                (single[k] - exact[k]).abs()
            }
        };
        if e == f && (0..n).all(|k| off(k) <= allowed(k)) {
            if e.is_none() {
                agreement.largest = (0..n)
                    .map(|k| off(k) / exact[k])
                    .fold(agreement.largest, f64::max);
            }
            continue;
        }
        let near = neighbours(replay, candidate);
        let undecided =
            near.failures.iter().any(|f| f.is_some()) && near.failures.iter().any(|f| f.is_none());
        let spread = |k: usize| {
            let moved = near
                .objectives
                .iter()
                .skip(k)
                .step_by(n)
                .map(|x| (x - exact[k]).abs());
            moved.fold(0.0, f64::max)
        };
        let excused = undecided || (e == f && (0..n).all(|k| off(k) <= allowed(k).max(spread(k))));
        assert!(
            excused,
            "{backend}, {norm:?}, candidate {i}: {f:?} {single:?} for {e:?} {exact:?}; {}",
            report(replay, backend, candidate)
        );
        agreement.at_the_edge += 1;
    }
    agreement
}

/// Scores `count` candidates on every backend and compares; hands back how many of them failed.
fn all_backends(what: &str, replay: &ReplayProblem, count: usize, share: f64) -> usize {
    let population = candidates(replay, count, share, &mut Draws::new(5));
    let expected = CpuEvaluator::new(replay)
        .evaluate(&population)
        .expect("the reference runs");
    let failed = expected.failures.iter().flatten().count();
    let mut figures = Vec::new();
    let single = scalar(replay, &population);
    figures.push(("f32", compare(replay, "f32", &population, &expected, &single)));
    for set in InstructionSet::available() {
        let found = SimdEvaluator::new(replay, set)
            .evaluate(&population)
            .expect("lanes run");
        assert!(found == single, "{set:?} is not the f32 scalar bit for bit");
    }
    let mut in_one_order = None;
    for context in devices() {
        let subject = Subject::Device(Arc::clone(&context));
        let mut evaluator = GpuEvaluator::new(replay, context).expect("the kernels compile");
        let found = evaluator.evaluate(&population).expect("the device runs");
        figures.push(("gpu", compare(replay, "gpu", &population, &expected, &found)));
        let other = in_one_order.get_or_insert_with(|| found.clone());
        if subject.rounds_like_the_processor() {
            assert!(found == *other, "the order of wheels shows");
        }
    }
    let norm = replay.plan.norm;
    println!("{what}, {norm:?}: {failed} of {count} failed; {figures:?}");
    // An excuse that many need would be none.
    assert!(
        figures
            .iter()
            .all(|(_, agreement)| agreement.at_the_edge <= count / 12),
        "{figures:?}"
    );
    failed
}

const NORMS: [Norm; 4] = [Norm::One, Norm::Two, Norm::Infinity, Norm::MeanSquare];

fn a_whole_lap_agrees_on_every_backend_in_every_norm() {
    for norm in NORMS {
        let lap = Lap {
            norm,
            ..Lap::default()
        };
        let replay = problem(bundled_car(), &UNKNOWNS, lap);
        let failed = all_backends("a lap", &replay, 48, 0.3);
        assert!(failed < 48, "most candidates are to drive");
    }
}

fn a_lap_at_the_limit_agrees_on_who_spins() {
    let lap = Lap {
        grip: 14.0,
        ..Lap::default()
    };
    let free = ["front.pKy1", "rear.pDy1", "rear.pKy1", "cg_height_m"];
    let replay = problem(bundled_car(), &free, lap);
    let failed = all_backends("at the limit", &replay, 96, 0.35);
    assert!(
        (8..88).contains(&failed),
        "some candidates are to spin and some to drive, {failed} spun"
    );
}

fn windows_substeps_and_the_linear_tyre_agree() {
    let lap = Lap {
        windows: 24,
        substeps: 3,
        samples: 5_000,
        norm: Norm::One,
        ..Lap::default()
    };
    all_backends("windows", &problem(bundled_car(), &UNKNOWNS, lap), 24, 0.3);
    let free = [
        "mass_kg",
        "roll_stiffness_nm_per_rad",
        "cornering_stiffness_n_per_rad",
        "trail_m",
        "cg_height_m",
    ];
    let free: Vec<&str> = free
        .into_iter()
        .filter(|n| linear_car().parameter(n).is_some())
        .collect();
    for norm in NORMS {
        let lap = Lap {
            norm,
            ..Lap::default()
        };
        all_backends("linear tyres", &problem(linear_car(), &free, lap), 24, 0.2);
    }
}
