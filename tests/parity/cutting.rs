//! Layer five: results do not depend on how the work is cut.

use crate::common::{UNKNOWNS, bundled_car, problem};
use crate::device::{device, the_device};
use lapswarm::evaluate::replay::{
    Batching, GpuEvaluator, Norm, ReplayProblem, SimdEvaluator, open_evaluator,
};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{BackendChoice, Evaluation, Evaluator, Failure};
use lapswarm::parity::Draws;
use lapswarm::parity::synthetic_lap::{Lap, candidates};

tests! {
    a_candidate_costs_the_same_alone_and_among_others: also_device,
    batches_and_chunks_do_not_show: device full,
    long_windows_are_driven_in_chunks_that_do_not_show: device,
    windows_longer_than_a_driver_bears_are_driven_to_their_end: device,
    more_steps_than_a_driver_bears_are_refused: device,
    windows_add_up: device,
}

fn bits(evaluation: &Evaluation) -> (Vec<u64>, Vec<Option<Failure>>) {
    let objectives = evaluation.objectives.iter().map(|x| x.to_bits()).collect();
    (objectives, evaluation.failures.clone())
}

/// A problem of 150 windows, which are two blocks and a part of one.
fn many_windows(norm: Norm) -> ReplayProblem {
    let lap = Lap {
        samples: 15_000,
        windows: 150,
        norm,
        ..Lap::default()
    };
    problem(bundled_car(), &UNKNOWNS, lap)
}

/// A population in which some candidates are no cars.
fn population(replay: &ReplayProblem, count: usize) -> Vec<f64> {
    let mut population = candidates(replay, count, 0.2, &mut Draws::new(3));
    let width = replay.dimensions();
    for candidate in (0..count).step_by(7) {
        // A combined-slip weight of this shape factor vanishes within the working slips.
        population[candidate * width + 2] = 9.0;
    }
    population[width] = f64::NAN;
    population
}

fn a_candidate_costs_the_same_alone_and_among_others() {
    let lap = Lap {
        samples: 1_500,
        ..Lap::default()
    };
    let replay = problem(bundled_car(), &UNKNOWNS, lap);
    let width = replay.dimensions();
    let population = population(&replay, 150);
    let mut backends: Vec<Box<dyn Evaluator>> = Vec::new();
    for set in InstructionSet::available() {
        backends.push(Box::new(SimdEvaluator::new(&replay, set)));
    }
    if let Some(context) = device() {
        backends.push(Box::new(
            GpuEvaluator::new(&replay, context).expect("the kernels compile"),
        ));
    }
    for backend in &mut backends {
        let name = backend.backend().device;
        let together = backend.evaluate(&population).expect("it runs");
        assert_eq!(together.failures[1], Some(Failure::NotFinite));
        assert!(
            matches!(together.failures[0], Some(Failure::IllFormedTyre(_))),
            "{:?}",
            together.failures[0]
        );
        assert!(together.failures.iter().flatten().count() < 60);
        assert_eq!(
            bits(&together),
            bits(&backend.evaluate(&population).expect("it runs")),
            "{name}, repeated"
        );
        for count in [1, 5, 64, 65, 149] {
            let fewer = backend.evaluate(&population[..count * width]).expect("it runs");
            let expected = Evaluation {
                objectives: together.objectives[..count * 4].to_vec(),
                failures: together.failures[..count].to_vec(),
                violations: Vec::new(),
            };
            assert_eq!(bits(&fewer), bits(&expected), "{name}, {count} candidates");
        }
        let none = backend.evaluate(&[]).expect("it runs");
        assert_eq!(none, Evaluation::default(), "{name}, no candidates");
    }
}

fn batches_and_chunks_do_not_show() {
    let context = the_device();
    for norm in [Norm::One, Norm::Infinity] {
        let replay = many_windows(norm);
        let population = population(&replay, 200);
        let mut evaluator = GpuEvaluator::new(&replay, context.clone()).expect("the kernels compile");
        let usual = evaluator.batching();
        let expected = evaluator.evaluate(&population).expect("it runs");
        assert!(expected.failures.iter().flatten().count() < 80);
        let few_lanes = 64 * 64;
        for batching in [
            Batching {
                lanes: 1 << 20,
                ..usual
            },
            // One workgroup of candidates by one block of windows at a time.
            Batching {
                lanes: few_lanes,
                ..usual
            },
            Batching {
                bytes: (few_lanes * 44) as u64,
                ..usual
            },
            // One block of samples at a time, and two workgroups of candidates.
            Batching {
                steps: Some(1),
                lanes: 2 * 150 * 64,
                ..usual
            },
            Batching {
                dispatch_ms: 5.0,
                ..usual
            },
            // Less than the least there can be.
            Batching { lanes: 1, ..usual },
        ] {
            evaluator = evaluator.with_batching(batching);
            let found = evaluator.evaluate(&population).expect("it runs");
            assert_eq!(bits(&found), bits(&expected), "{norm:?}, {batching:?}");
        }
    }
}

fn long_windows_are_driven_in_chunks_that_do_not_show() {
    let context = the_device();
    let lap = Lap {
        samples: 1_000,
        ..Lap::default()
    };
    let replay = problem(bundled_car(), &UNKNOWNS, lap);
    let population = candidates(&replay, 100, 0.2, &mut Draws::new(8));
    let mut evaluator = GpuEvaluator::new(&replay, context).expect("the kernels compile");
    let usual = evaluator.batching();
    let whole = Batching {
        dispatch_ms: 1e9,
        ..usual
    };
    evaluator = evaluator.with_batching(whole);
    evaluator.evaluate(&population).expect("it runs");
    let expected = evaluator.evaluate(&population).expect("it runs");
    assert_eq!(evaluator.statistics().dispatches, 1);
    for samples in [64, 128, 960] {
        evaluator = evaluator.with_batching(Batching {
            steps: Some(samples),
            ..whole
        });
        let found = evaluator.evaluate(&population).expect("it runs");
        assert_eq!(evaluator.statistics().dispatches, 1000usize.div_ceil(samples));
        assert_eq!(bits(&found), bits(&expected), "{samples} samples at a time");
    }
}

/// A software driver leaves all loops of a dispatch after 65,535 rounds without a word: however fast it is, no dispatch may take as
/// many. A graphics processor takes the whole lap in one.
fn windows_longer_than_a_driver_bears_are_driven_to_their_end() {
    let context = the_device();
    for substeps in [1, 3] {
        let lap = Lap {
            samples: 20_000,
            substeps,
            ..Lap::default()
        };
        let replay = problem(bundled_car(), &UNKNOWNS, lap);
        let population = candidates(&replay, 4, 0.2, &mut Draws::new(8));
        let mut evaluator = GpuEvaluator::new(&replay, context.clone()).expect("the kernels compile");
        let unhurried = Batching {
            dispatch_ms: 1e9,
            ..evaluator.batching()
        };
        evaluator = evaluator.with_batching(unhurried);
        evaluator.evaluate(&population).expect("it runs");
        // As fast as can be, from what the first evaluation taught.
        let found = evaluator.evaluate(&population).expect("it runs");
        assert_eq!(
            evaluator.statistics().dispatches > 1,
            !context.summary().kind.is_real()
        );
        evaluator = evaluator.with_batching(Batching {
            steps: Some(64),
            ..unhurried
        });
        let expected = evaluator.evaluate(&population).expect("it runs");
        assert_eq!(bits(&found), bits(&expected), "{substeps} steps a sample");
        assert!(expected.failures.iter().flatten().count() < 4);
    }
}

/// So many steps between samples that not one block of samples fits a software driver's loops: it says so, and lanes take over.
fn more_steps_than_a_driver_bears_are_refused() {
    let context = the_device();
    if context.summary().kind.is_real() {
        return;
    }
    let lap = Lap {
        samples: 200,
        substeps: 210,
        ..Lap::default()
    };
    let replay = problem(bundled_car(), &UNKNOWNS, lap);
    let refusal = GpuEvaluator::new(&replay, context).err().expect("too many");
    assert!(
        refusal.to_string().contains("144 steps between samples"),
        "{refusal}"
    );
    let mut evaluator = open_evaluator(&replay, BackendChoice::Gpu, None).expect("lanes take over");
    assert_eq!(evaluator.backend().backend, "simd");
    assert!(evaluator.device_faults()[0].contains("144 steps"));
    let population = candidates(&replay, 4, 0.2, &mut Draws::new(8));
    assert!(
        evaluator
            .evaluate(&population)
            .expect("it runs")
            .failures
            .contains(&None)
    );
}

/// A window costs the same whether it is scored alone or among others.
fn windows_add_up() {
    let context = the_device();
    let replay = many_windows(Norm::One);
    let population = candidates(&replay, 8, 0.2, &mut Draws::new(4));
    let all = GpuEvaluator::new(&replay, context.clone())
        .and_then(|mut e| e.evaluate(&population))
        .expect("it runs");
    let mut sums = vec![0.0; all.objectives.len()];
    for window in &replay.plan.windows {
        let mut alone = replay.clone();
        alone.plan.windows = vec![*window];
        let one = GpuEvaluator::new(&alone, context.clone())
            .and_then(|mut e| e.evaluate(&population))
            .expect("it runs");
        for (sum, cost) in sums.iter_mut().zip(&one.objectives) {
            *sum += cost;
        }
    }
    // Sums of up to 64 of 150 figures and of three such sums in single precision: 66 roundings of 6e-8 at worst.
    for (sum, cost) in sums.iter().zip(&all.objectives) {
        assert!((sum - cost).abs() <= 66.0 * 6e-8 * cost, "{sum} and {cost}");
    }
}
