//! What the optimiser itself costs: a generation of the large swarm without its evaluations, and what it is made of, each
//! against the number of particles. Evaluations are made once, before the clock runs.
//!
//! `LAPSWARM_BENCH_QUICK=1` leaves out the largest for continuous integration.

use criterion::measurement::WallTime;
use criterion::{BatchSize, BenchmarkGroup, BenchmarkId, Criterion, SamplingMode, Throughput};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{Evaluation, Evaluator};
use lapswarm::minimise_several;
use lapswarm::random::Random;
use lapswarm::swarm::metrics::{contributions, hypervolume, non_dominated, ranks};
use lapswarm::swarm::problems::{SimdTestEvaluator, TestProblem};
use lapswarm::swarm::{
    Archive, Mopso, MopsoSettings, Nsga2, Nsga2Settings, Optimiser, PsoSettings, Truncation,
};
use std::f64::consts::PI;
use std::time::Duration;

/// Variables of the problems.
const VARIABLES: usize = 12;
/// Generations before the one that is measured: the archive is full then.
const BEFORE: usize = 5;

fn populations() -> Vec<usize> {
    let all = [1000, 10_000, 100_000];
    let quick = std::env::var("LAPSWARM_BENCH_QUICK").is_ok_and(|x| x == "1");
    all[..if quick { 2 } else { 3 }].to_vec()
}

/// Problems of two and three objectives.
fn problems() -> [TestProblem; 2] {
    ["zdt1", "dtlz2"].map(|name| TestProblem::sized(name, VARIABLES).expect("known"))
}

/// A group of few samples, since each takes long.
fn group<'a>(criterion: &'a mut Criterion, name: &str) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group
        .sampling_mode(SamplingMode::Flat)
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_secs(2));
    group
}

/// An optimiser in its stride, and what it is told next.
fn in_stride<T: Optimiser>(mut optimiser: T, problem: &TestProblem) -> (T, Evaluation) {
    let mut evaluator = SimdTestEvaluator::new(problem, InstructionSet::best());
    for _ in 0..BEFORE {
        let candidates = optimiser.ask();
        let evaluation = evaluator.evaluate(&candidates).expect("no device");
        optimiser.tell(&evaluation).expect("its own");
    }
    let candidates = optimiser.ask();
    let evaluation = evaluator.evaluate(&candidates).expect("no device");
    (optimiser, evaluation)
}

fn generations(criterion: &mut Criterion) {
    let mut group = group(criterion, "generation");
    for problem in problems() {
        let objectives = problem.problem().objectives.len();
        for population in populations() {
            group.throughput(Throughput::Elements(population as u64));
            let default = MopsoSettings::default();
            let motion = PsoSettings {
                population,
                ..default.motion
            };
            let swarm = Mopso::new(problem.problem(), MopsoSettings { motion, ..default }).expect("sound");
            let (swarm, told) = in_stride(swarm, &problem);
            let id = BenchmarkId::new(format!("mopso, {objectives} objectives"), population);
            group.bench_function(id, |bencher| {
                let generation = |mut swarm: Mopso| {
                    swarm.tell(&told).expect("its own");
                    (swarm.ask(), swarm)
                };
                bencher.iter_batched(|| swarm.clone(), generation, BatchSize::LargeInput);
            });
            let settings = Nsga2Settings {
                population,
                ..Nsga2Settings::default()
            };
            let genetic = Nsga2::new(problem.problem(), settings).expect("sound");
            let (genetic, told) = in_stride(genetic, &problem);
            let id = BenchmarkId::new(format!("nsga2, {objectives} objectives"), population);
            group.bench_function(id, |bencher| {
                let generation = |mut genetic: Nsga2| {
                    genetic.tell(&told).expect("its own");
                    (genetic.ask(), genetic)
                };
                bencher.iter_batched(|| genetic.clone(), generation, BatchSize::LargeInput);
            });
        }
    }
    group.finish();
}

/// Points of the unit cube.
fn cloud(count: usize, width: usize) -> Vec<Vec<f64>> {
    let random = Random::new(4);
    (0..count as u32)
        .map(|i| (0..width as u32).map(|k| random.uniform(1, 0, i, k)).collect())
        .collect()
}

/// Points of the unit sphere, none of which dominates another.
fn sphere(count: usize, width: usize) -> Vec<Vec<f64>> {
    let mut points = cloud(count, width);
    for point in &mut points {
        let radius = point.iter().map(|x| x * x).sum::<f64>().sqrt();
        point.iter_mut().for_each(|x| *x /= radius);
    }
    points
}

fn metrics(criterion: &mut Criterion) {
    let mut group = group(criterion, "metrics");
    for width in [2, 3] {
        for count in populations() {
            group.throughput(Throughput::Elements(count as u64));
            let (cloud, front) = (cloud(count, width), sphere(count, width));
            let reference = vec![1.1; width];
            let id = |what: &str| BenchmarkId::new(format!("{what}, {width} objectives"), count);
            group.bench_function(id("non-dominated of a cloud"), |bencher| {
                bencher.iter(|| non_dominated(&cloud));
            });
            group.bench_function(id("non-dominated of a front"), |bencher| {
                bencher.iter(|| non_dominated(&front));
            });
            group.bench_function(id("ranks of a cloud"), |bencher| bencher.iter(|| ranks(&cloud)));
            group.bench_function(id("hypervolume of a front"), |bencher| {
                bencher.iter(|| hypervolume(&front, &reference));
            });
        }
        let front = sphere(100, width);
        group.throughput(Throughput::Elements(100));
        let id = BenchmarkId::new(format!("contributions to a front, {width} objectives"), 100);
        group.bench_function(id, |bencher| {
            bencher.iter(|| contributions(&front, &vec![1.1; width]));
        });
    }
    // One point after the other into an archive: of a front that is a surface, and of one that is nearly a curve.
    let curve = |point: &Vec<f64>| {
        let across = (0.5 * (point[0].powi(2) + point[1].powi(2))).sqrt();
        vec![across, across + 1e-9 * point[0], point[2]]
    };
    let surface = sphere(1000, 3);
    let curve: Vec<Vec<f64>> = surface.iter().map(curve).collect();
    group.throughput(Throughput::Elements(1000));
    for (what, front) in [("surface", surface), ("curve", curve)] {
        group.bench_function(BenchmarkId::new(format!("archive of a {what}"), 100), |bencher| {
            bencher.iter(|| {
                let mut archive = Archive::new(100, Truncation::Contribution);
                front.iter().filter(|row| archive.insert(row, row)).count()
            });
        });
    }
    group.finish();
}

/// DTLZ2, to whose front the swarm comes at once, so that its archive is full of it; `far` from its front DTLZ1, whose extremes move for
/// long. Deb, Thiele, Laumanns, Zitzler, Scalable test problems for evolutionary multiobjective optimization, 2005.
fn dtlz(far: bool, x: &[f64], objectives: &mut [f64]) {
    let count = objectives.len();
    let (places, distances) = x.split_at(count - 1);
    let g: f64 = if far {
        let each = |x: &f64| (x - 0.5).powi(2) - (20.0 * PI * (x - 0.5)).cos();
        100.0 * (distances.len() as f64 + distances.iter().map(each).sum::<f64>())
    } else {
        distances.iter().map(|x| (x - 0.5).powi(2)).sum()
    };
    let along = |x: f64| if far { x } else { (0.5 * PI * x).cos() };
    let across = |x: f64| if far { 1.0 - x } else { (0.5 * PI * x).sin() };
    for (i, objective) in objectives.iter_mut().enumerate() {
        let before: f64 = places[..count - 1 - i].iter().copied().map(along).product();
        let last = if i > 0 { across(places[count - 1 - i]) } else { 1.0 };
        *objective = (1.0 + g) * before * last;
    }
}

/// The default's 25,000 evaluations, by the number of objectives. With four and more nearly all of the time is the archive's.
fn runs(criterion: &mut Criterion) {
    let mut group = group(criterion, "25,000 evaluations");
    let quick = std::env::var("LAPSWARM_BENCH_QUICK").is_ok_and(|x| x == "1");
    for (name, far) in [("dtlz1", true), ("dtlz2", false)] {
        for objectives in if quick { 2..=3 } else { 2..=5 } {
            group.bench_function(BenchmarkId::new(name, objectives), |bencher| {
                let bounds = vec![(0.0, 1.0); objectives + 9];
                bencher.iter(|| minimise_several(&bounds, objectives, |x, f| dtlz(far, x, f)).run());
            });
        }
    }
    group.finish();
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    generations(&mut criterion);
    runs(&mut criterion);
    metrics(&mut criterion);
    criterion.final_summary();
}
