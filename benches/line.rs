//! Whole-lap evaluations per second of the backends, side by side in one run on one thread, so that their ratios hold
//! whatever else the machine does, and how the cost grows with lines and with sections.
//!
//! A software adapter's threads are its own: set `LP_NUM_THREADS=1` to hold lavapipe to one as well.
//! `LAPSWARM_BENCH_QUICK=1` shrinks the populations for continuous integration.

#[path = "../tests/common/mod.rs"]
mod common;

use common::Random;
use common::line::{circuit, gt_car, lines};
use criterion::{BenchmarkId, Criterion, SamplingMode, Throughput};
use glam::DVec2;
use lapswarm::config::Choice;
use lapswarm::evaluate::Evaluator;
use lapswarm::evaluate::energy::{
    CpuHybridEvaluator, GpuHybridEvaluator, HybridLine, HybridObjective, HybridProblem, SimdHybridEvaluator,
    Strategy,
};
use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::line::{
    CpuLineEvaluator, GpuLineEvaluator, LineObjective, LineProblem, SimdLineEvaluator,
};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::line::Parametrisation;
use lapswarm::line::energy::{EnergyCar, EnergyPlan, Gates, Mode};
use lapswarm::vehicle::Car;
use lapswarm::vehicle::limits::{SpeedRange, car_envelope};
use std::time::Duration;

/// Lap times on a circuit of `sections`, lines by a control point for every four of them.
fn problem(sections: usize) -> LineProblem {
    let cross_sections = circuit(
        sections,
        5760.0 / sections as f64,
        true,
        DVec2::ZERO,
        &mut Random(1),
    );
    let way = Parametrisation::control_points(sections / 4);
    LineProblem::new(
        cross_sections,
        way,
        &[LineObjective::LapTime],
        Some(gt_car()),
        0.0,
    )
    .expect("a sound problem")
}

fn gpu(problem: &LineProblem) -> Option<(String, Box<dyn Evaluator + '_>)> {
    match GpuContext::shared(None).and_then(|context| GpuLineEvaluator::new(problem, context)) {
        Ok(mut evaluator) => {
            // The driver's compilation and the first dispatches' timing are no part of the speed.
            let warm_up = lines(problem, 4096, &mut Random(1));
            match evaluator.evaluate(&warm_up) {
                Ok(_) => {
                    let name = format!("gpu {}", evaluator.backend().device);
                    return Some((name, Box::new(evaluator)));
                }
                Err(error) => eprintln!("IGNORED: the GPU failed: {error}"),
            }
        }
        Err(error) => eprintln!("IGNORED: no GPU adapter ({error})"),
    }
    None
}

fn backends(problem: &LineProblem) -> Vec<(String, Box<dyn Evaluator + '_>)> {
    let mut backends: Vec<(String, Box<dyn Evaluator>)> =
        vec![("cpu f64".to_owned(), Box::new(CpuLineEvaluator::new(problem)))];
    for set in InstructionSet::available() {
        backends.push((
            format!("simd {}", set.name()),
            Box::new(SimdLineEvaluator::new(problem, set)),
        ));
    }
    backends.extend(gpu(problem));
    backends
}

fn laps(criterion: &mut Criterion) {
    let quick = std::env::var("LAPSWARM_BENCH_QUICK").is_ok_and(|x| x == "1");
    let mut bench = |title: &str, cases: &[(usize, usize)], fast_only: bool| {
        let mut group = criterion.benchmark_group(title);
        group
            .sampling_mode(SamplingMode::Flat)
            .sample_size(10)
            .warm_up_time(Duration::from_millis(100))
            .measurement_time(Duration::from_secs(if quick { 1 } else { 3 }));
        for &(sections, count) in cases {
            let problem = problem(sections);
            for (name, mut backend) in backends(&problem) {
                if fast_only
                    && !(name == format!("simd {}", InstructionSet::best().name()) || name.starts_with("gpu"))
                {
                    continue;
                }
                let count = if name.starts_with("cpu") {
                    count.div_ceil(16)
                } else {
                    count
                };
                let count = if quick { count.div_ceil(8) } else { count };
                let population = lines(&problem, count, &mut Random(2));
                group.throughput(Throughput::Elements(count as u64));
                group.bench_function(BenchmarkId::new(name, format!("{count}x{sections}")), |bencher| {
                    bencher.iter(|| backend.evaluate(&population));
                });
            }
        }
        group.finish();
    };
    bench("laps", &[(360, 8192)], false);
    bench("laps by lines", &[(360, 1024), (360, 4096), (360, 16_384)], true);
    bench(
        "laps by sections",
        &[(180, 4096), (720, 4096), (1440, 4096)],
        true,
    );
}

/// A lap time alone, and with the accounts of a hybrid in either mode, on the same lines.
fn energy(criterion: &mut Criterion) {
    let sections = 720;
    let plain = problem(sections);
    let car = hybrid_car();
    let with_energy = [Mode::Offset, Mode::Additional].map(|mode| {
        let line = HybridLine::Free {
            cross_sections: Box::new(plain.cross_sections().clone()),
            parametrisation: plain.parametrisation().clone(),
        };
        let plan = EnergyPlan::whole(sections, sections - 60, mode);
        let gates = Gates {
            energy_mj: 1.5,
            ..Gates::OPEN
        };
        let objectives = [HybridObjective::LapTime, HybridObjective::Fuel];
        let strategy = Strategy::fixed(gates, 1);
        HybridProblem::new(line, car.clone(), plan, strategy, &objectives, 0.0).expect("a sound problem")
    });
    // The same car's lap without energy.
    let plain = LineProblem::new(
        plain.cross_sections().clone(),
        plain.parametrisation().clone(),
        &[LineObjective::LapTime],
        Some(car.point_mass.clone()),
        0.0,
    )
    .expect("a sound problem");
    let count = 512;
    let population = lines(&plain, count, &mut Random(2));
    let mut group = criterion.benchmark_group("energy");
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_secs(2))
        .throughput(Throughput::Elements(count as u64));
    let set = InstructionSet::best();
    let mut run = |name: String, evaluator: &mut dyn Evaluator| {
        group.bench_function(name, |bencher| bencher.iter(|| evaluator.evaluate(&population)));
    };
    run("cpu lap time".to_owned(), &mut CpuLineEvaluator::new(&plain));
    run(
        "simd lap time".to_owned(),
        &mut SimdLineEvaluator::new(&plain, set),
    );
    if let Some((name, mut evaluator)) = gpu(&plain) {
        run(format!("{name} lap time"), evaluator.as_mut());
    }
    for problem in &with_energy {
        let mode = problem.energy().mode.name();
        run(format!("cpu {mode}"), &mut CpuHybridEvaluator::new(problem));
        run(
            format!("simd {mode}"),
            &mut SimdHybridEvaluator::new(problem, set),
        );
        if let Ok(mut evaluator) =
            GpuContext::shared(None).and_then(|context| GpuHybridEvaluator::new(problem, context))
        {
            run(format!("gpu {mode}"), &mut evaluator);
        }
    }
    group.finish();
}

fn hybrid_car() -> EnergyCar {
    let car = Car::load("gt_hybrid").expect("bundled");
    let limits = car_envelope(&car, &SpeedRange::USUAL).expect("limits");
    let traction = limits.traction();
    EnergyCar::new(car, limits.envelope, traction, 2.0).expect("a hybrid")
}

fn main() {
    // The pool is global and this is its first use, so that nothing can have built it before.
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(1).build_global() {
        eprintln!("{error}");
    }
    let mut criterion = Criterion::default().configure_from_args();
    laps(&mut criterion);
    energy(&mut criterion);
    criterion.final_summary();
}
