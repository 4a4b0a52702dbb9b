//! Particle-steps per second of the backends, side by side in one run on one thread, so that their ratios hold
//! whatever else the machine does. One particle-step is one Runge-Kutta step of one candidate.
//!
//! A software adapter's threads are its own: set `LP_NUM_THREADS=1` to hold lavapipe to one as well.
//! `LAPSWARM_BENCH_QUICK=1` shrinks the laps for continuous integration.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{UNKNOWNS, bundled_car, problem};
use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput};
use lapswarm::evaluate::Evaluator;
use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::replay::{CpuEvaluator, GpuEvaluator, ReplayProblem, SimdEvaluator};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::parity::Draws;
use lapswarm::parity::synthetic_lap::{Lap, candidates};
use std::time::Duration;

fn backends(replay: &ReplayProblem) -> Vec<(String, usize, Box<dyn Evaluator + '_>)> {
    let mut backends: Vec<(String, usize, Box<dyn Evaluator>)> =
        vec![("cpu f64".to_owned(), 16, Box::new(CpuEvaluator::new(replay)))];
    for set in InstructionSet::available() {
        let evaluator = Box::new(SimdEvaluator::new(replay, set));
        let count = if set == InstructionSet::Portable { 32 } else { 256 };
        backends.push((format!("simd {}", set.name()), count, evaluator));
    }
    match GpuContext::shared(None).and_then(|context| GpuEvaluator::new(replay, context)) {
        Ok(mut evaluator) => {
            // The driver's compilation and the first chunk's timing are no part of the speed.
            let warm_up = candidates(replay, 64, 0.1, &mut Draws::new(1));
            if let Err(error) = evaluator.evaluate(&warm_up) {
                eprintln!("IGNORED: the GPU failed: {error}");
            } else {
                let name = format!("gpu {}", evaluator.backend().device);
                backends.push((name, 1024, Box::new(evaluator)));
            }
        }
        Err(error) => eprintln!("IGNORED: no GPU adapter ({error})"),
    }
    backends
}

fn replay(criterion: &mut Criterion) {
    let quick = std::env::var("LAPSWARM_BENCH_QUICK").is_ok_and(|x| x == "1");
    let lap = Lap {
        samples: if quick { 640 } else { 5_000 },
        ..Lap::default()
    };
    let problem = problem(bundled_car(), &UNKNOWNS, lap);
    let mut group = criterion.benchmark_group("replay");
    group
        .sampling_mode(SamplingMode::Flat)
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_secs(if quick { 1 } else { 5 }));
    for (name, count, mut backend) in backends(&problem) {
        let count = if quick { count.min(256) } else { count };
        let population = candidates(&problem, count, 0.1, &mut Draws::new(2));
        group.throughput(Throughput::Elements((count * lap.samples) as u64));
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| backend.evaluate(&population));
        });
    }
    group.finish();
}

fn main() {
    // The pool is global and this is its first use, so that nothing can have built it before.
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(1).build_global() {
        eprintln!("{error}");
    }
    let mut criterion = Criterion::default().configure_from_args();
    replay(&mut criterion);
    criterion.final_summary();
}
