//! Layer seven: cars that settle on circles, on every backend against `f64`.

use crate::common::{bundled_car, linear_car};
use crate::device::{device, devices, subjects};
use lapswarm::evaluate::drive::DriveBatching;
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::steady::kernel::Settling;
use lapswarm::evaluate::steady::{
    CpuSteadyEvaluator, GpuSteadyEvaluator, SimdSteadyEvaluator, SteadyObjective, SteadyProblem,
};
use lapswarm::evaluate::{Evaluator, FAILED_COST, Failure};
use lapswarm::parity::Draws;
use lapswarm::parity::steady::{candidates, layer, problem};
use lapswarm::vehicle::{Car, Tyres};

tests! {
    trims_agree_on_every_backend: also_device,
    a_trim_is_the_same_alone_and_among_others_however_it_is_cut: also_device,
    cars_that_fail_say_why: also_device,
}

fn trims_agree_on_every_backend() {
    let layer = layer().expect("the bundled car settles");
    for subject in subjects() {
        for found in layer(&subject).expect("the kernel runs") {
            println!(
                "{}: {} figures, {:.1e} off, {:.1}% of what may be, bits as the scalar's: {:?}; {}",
                found.key(),
                found.figures,
                found.max_relative,
                100.0 * found.share_of_tolerance,
                found.bits_as_scalar,
                found.worst
            );
            assert!(found.pass, "{}: {}", found.key(), found.worst);
        }
    }
}

fn slices(candidates: &[Vec<f64>]) -> Vec<&[f64]> {
    candidates.iter().map(Vec::as_slice).collect()
}

fn bits(states: &[Result<Settling<f64>, Failure>]) -> Vec<Result<[u64; 8], Failure>> {
    states
        .iter()
        .map(|state| state.map(|s| s.to_array().map(f64::to_bits)))
        .collect()
}

/// How the work is cut does not show, nor does the company; instruction sets have the same bits, and so has a second time.
fn a_trim_is_the_same_alone_and_among_others_however_it_is_cut() {
    for car in [bundled_car(), linear_car()] {
        let problem = problem(car).expect("a sound problem");
        let all = candidates(&problem, 70, &mut Draws::new(5));
        let all = slices(&all);
        let mut same: Option<Vec<_>> = None;
        for set in InstructionSet::available() {
            let evaluator = SimdSteadyEvaluator::new(&problem, set);
            let together = bits(&evaluator.outcomes(&all));
            assert_eq!(
                bits(&evaluator.outcomes(&all[33..34])),
                together[33..34],
                "{set:?}"
            );
            assert_eq!(*same.get_or_insert_with(|| together.clone()), together, "{set:?}");
        }
        let Some(context) = device() else { continue };
        let mut evaluator = GpuSteadyEvaluator::new(&problem, context.clone()).expect("the kernel compiles");
        let whole = bits(&evaluator.outcomes(&all).expect("it runs"));
        assert_eq!(bits(&evaluator.outcomes(&all).expect("it runs")), whole);
        for (lanes, steps) in [(64, Some(77)), (128, None)] {
            let batching = DriveBatching {
                lanes,
                steps,
                bytes: u64::MAX,
                dispatch_ms: 70.0,
            };
            let mut cut = GpuSteadyEvaluator::new(&problem, context.clone())
                .expect("the kernel compiles")
                .with_batching(batching);
            assert_eq!(bits(&cut.outcomes(&all).expect("it runs")), whole, "{batching:?}");
        }
        let alone = evaluator.outcomes(&all[33..34]).expect("it runs");
        assert_eq!(bits(&alone), whole[33..34]);
    }
}

/// The failures of each backend, in its order; every failed row costs the most.
fn failures(problem: &SteadyProblem, all: &[Vec<f64>]) -> Vec<(String, Vec<Option<Failure>>)> {
    let mut backends: Vec<Box<dyn Evaluator + '_>> = vec![Box::new(CpuSteadyEvaluator::new(problem))];
    for set in InstructionSet::available() {
        backends.push(Box::new(SimdSteadyEvaluator::new(problem, set)));
    }
    for context in devices() {
        backends.push(Box::new(
            GpuSteadyEvaluator::new(problem, context).expect("the kernel compiles"),
        ));
    }
    let width = problem.problem.objectives.len();
    let each = backends.iter_mut().map(|backend| {
        let found = backend.evaluate(&all.concat()).expect("it runs");
        let name = backend.backend().device;
        for (row, failure) in found.objectives.chunks_exact(width).zip(&found.failures) {
            assert_eq!(
                row.iter().all(|x| *x == FAILED_COST),
                failure.is_some(),
                "{name}: {row:?}"
            );
        }
        (name, found.failures)
    });
    each.collect()
}

fn on_circles(car: Car) -> SteadyProblem {
    SteadyProblem::new(car, Vec::new(), [15.0, 70.0], [-0.3, 0.3], &SteadyObjective::ALL)
        .expect("a sound problem")
}

/// Cars that do not come to rest cost the most and say why, alike on every backend.
fn cars_that_fail_say_why() {
    // Rear tyres that hold less than the front ones: beyond its critical speed the car turns round.
    let mut loose = linear_car();
    let mut slippery = linear_car();
    if let (Tyres::Linear { front, rear }, Tyres::Linear { rear: spinning, .. }) =
        (&mut loose.tyres, &mut slippery.tyres)
    {
        (front.cornering_stiffness, rear.cornering_stiffness) = (60_000.0, 40_000.0);
        // Driven wheels that have no grip along the car: nothing holds its speed.
        spinning.slip_stiffness = 0.0;
    }
    let aims = [vec![20.0, 0.002], vec![60.0, 0.05], vec![f64::NAN, 0.0]];
    for (name, found) in failures(&on_circles(loose), &aims) {
        assert_eq!(
            found,
            [None, Some(Failure::Spun), Some(Failure::NotFinite)],
            "{name}"
        );
    }
    for (name, found) in failures(&on_circles(slippery), &[vec![40.0, 0.03]]) {
        assert_eq!(found, [Some(Failure::OffTheEnvelope)], "{name}");
    }
}
