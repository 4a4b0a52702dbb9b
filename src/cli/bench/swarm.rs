//! `lapswarm bench swarm`: what a generation costs besides its evaluations, against the number of particles.

use super::pages::of_swarm;
use crate::cli::backend_flag;
use crate::cli::measurement::MeasurementFlags;
use crate::cli::output::{Columns, line_of, outln};
use lapswarm::evaluate::gpu::{GpuContext, devices};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{BackendChoice, Evaluator};
use lapswarm::swarm::device::DeviceMopso;
use lapswarm::swarm::metrics::{Scale, hypervolume};
use lapswarm::swarm::problems::{GpuTestEvaluator, SimdTestEvaluator, TestProblem};
use lapswarm::swarm::{MANY, Mopso, MopsoSettings, Optimiser};
use lapswarm::{Error, Result};
use serde::Serialize;
use std::time::Instant;

/// Flags of `bench swarm`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Particles to measure
    #[arg(long, value_delimiter = ',', default_value = "1000,10000,100000,1000000")]
    populations: Vec<usize>,
    /// Test problems; one with two and one with three objectives
    #[arg(long, value_delimiter = ',', default_value = "zdt1,dtlz2")]
    problems: Vec<String>,
    /// Variables of the problems; their own number if 0
    #[arg(long, default_value_t = 12)]
    variables: usize,
    /// Generations of a run
    #[arg(long, default_value_t = 25, value_parser = clap::value_parser!(u32).range(2..=1000))]
    generations: u32,
    /// Runs, of which the fastest counts
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    repeats: u32,
    /// Only the swarm on this backend, cpu and simd being one [default: all there are]
    #[arg(long, value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long)]
    adapter: Option<String>,
    #[command(flatten)]
    kept: MeasurementFlags,
}

/// One population on one problem.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) backend: &'static str,
    pub(super) device: String,
    pub(super) problem: &'static str,
    pub(super) objectives: usize,
    pub(super) variables: usize,
    pub(super) population: usize,
    pub(super) generation_ms: f64,
    pub(super) slowest_generation_ms: f64,
    pub(super) evaluation_ms: f64,
    pub(super) bytes_per_particle: usize,
    pub(super) hypervolume: f64,
}

/// How the time of a generation grows with the particles.
#[derive(Serialize)]
struct Growth {
    backend: &'static str,
    problem: &'static str,
    exponent: f64,
}

#[derive(Serialize)]
struct Table {
    study: &'static str,
    threads: usize,
    rows: Vec<Row>,
    growth: Vec<Growth>,
}

/// Reference point of the hypervolume on the true front's scale.
const REFERENCE: f64 = 1.1;

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    let keeping = arguments
        .kept
        .begin("bench swarm", arguments.adapter.as_deref())?;
    let mut table = Table {
        study: "bench swarm",
        threads: rayon::current_num_threads(),
        rows: Vec::new(),
        growth: Vec::new(),
    };
    outln!(
        "milliseconds per generation of the optimiser alone, {} threads",
        table.threads
    );
    outln!("{}", line_of(COLUMNS, None));
    for name in &arguments.problems {
        let own = TestProblem::by_name(name).filter(|p| p.problem().objectives.len() > 1);
        let own = own.ok_or_else(|| {
            let expected = "a test problem of two or three objectives";
            Error::input("--problems", "name", name, expected)
        })?;
        let problem = match arguments.variables {
            0 => own,
            variables => TestProblem::sized(name, variables).unwrap_or(own),
        };
        for here in [true, false] {
            let mut times = Vec::new();
            let wanted = match arguments.backend {
                None | Some(BackendChoice::Auto) => here || !devices().is_empty(),
                Some(choice) => (choice != BackendChoice::Gpu) == here,
            };
            for &population in arguments.populations.iter().filter(|_| wanted) {
                let row = measure(&problem, population, here, arguments)?;
                times.push((population as f64, row.generation_ms));
                outln!("{}   {}", line_of(COLUMNS, Some(&row)), row.device);
                table.rows.push(row);
            }
            if times.len() > 1 {
                let growth = Growth {
                    backend: if here { "host" } else { "gpu" },
                    problem: problem.name(),
                    exponent: slope(&times),
                };
                outln!(
                    "{:<8}{:<8} time grows as particles^{:.2}",
                    growth.backend,
                    growth.problem,
                    growth.exponent
                );
                table.growth.push(growth);
            }
        }
    }
    let backends = table.rows.iter().map(|r| r.backend);
    keeping.finish(&table, backends, |folder| of_swarm(folder, &table.rows))
}

/// The table on a terminal.
const COLUMNS: &Columns<Row> = &[
    ("backend", -8, |r| r.backend.to_owned()),
    ("problem", -8, |r| r.problem.to_owned()),
    ("objectives", 11, |r| r.objectives.to_string()),
    ("particles", 11, |r| r.population.to_string()),
    ("generation", 12, |r| format!("{:.3}", r.generation_ms)),
    ("slowest", 12, |r| format!("{:.3}", r.slowest_generation_ms)),
    ("evaluation", 12, |r| format!("{:.3}", r.evaluation_ms)),
    ("bytes each", 12, |r| r.bytes_per_particle.to_string()),
    ("hypervolume", 13, |r| format!("{:.4}", r.hypervolume)),
];

/// Seconds of one run: the optimiser's own, its slowest generation's, and the evaluations'.
#[derive(Default)]
struct Times {
    own: f64,
    slowest: f64,
    others: f64,
}

impl Times {
    fn note(&mut self, own: f64, others: f64) {
        self.own += own;
        self.slowest = self.slowest.max(own);
        self.others += others;
    }
}

/// Seconds that `work` takes, and what it yields.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let began = Instant::now();
    let result = work();
    (began.elapsed().as_secs_f64(), result)
}

/// What a run came to.
struct Run {
    backend: &'static str,
    device: String,
    times: Times,
    bytes_per_particle: usize,
    front: Vec<Vec<f64>>,
}

/// The best of the repeats.
fn measure(problem: &TestProblem, population: usize, here: bool, arguments: &Arguments) -> Result<Row> {
    let settings = MopsoSettings::default().with_size(population, arguments.generations as usize);
    let run = |_| {
        if here {
            on_the_host(problem, settings.clone())
        } else {
            on_a_device(problem, settings.clone(), arguments)
        }
    };
    let runs: Vec<Run> = (0..arguments.repeats).map(run).collect::<Result<_>>()?;
    let best = runs
        .into_iter()
        .min_by(|a, b| a.times.own.total_cmp(&b.times.own));
    let best = best.ok_or_else(|| Error::Study("nothing was measured".to_owned()))?;
    let truth = problem.front(2000);
    let width = problem.problem().objectives.len();
    let each = 1e3 / f64::from(arguments.generations);
    Ok(Row {
        backend: best.backend,
        device: best.device,
        problem: problem.name(),
        objectives: width,
        variables: problem.problem().variables.len(),
        population,
        generation_ms: best.times.own * each,
        slowest_generation_ms: best.times.slowest * 1e3,
        evaluation_ms: best.times.others * each,
        bytes_per_particle: best.bytes_per_particle,
        hypervolume: hypervolume(&Scale::of(&truth).apply(&best.front), &vec![REFERENCE; width])?,
    })
}

fn on_the_host(problem: &TestProblem, settings: MopsoSettings) -> Result<Run> {
    let (backend, device) = if settings.motion.population < MANY {
        ("cpu", "f64")
    } else {
        ("simd", InstructionSet::best().name())
    };
    let mut swarm = Mopso::new(problem.problem(), settings)?;
    let mut evaluator = SimdTestEvaluator::new(problem, InstructionSet::best());
    let mut times = Times::default();
    while !swarm.done() {
        let (asking, candidates) = timed(|| swarm.ask());
        let (others, evaluation) = timed(|| evaluator.evaluate(&candidates));
        let evaluation = evaluation?;
        let (telling, told) = timed(|| swarm.tell(&evaluation));
        told?;
        times.note(asking + telling, others);
    }
    Ok(Run {
        backend,
        device: device.to_owned(),
        times,
        bytes_per_particle: swarm.bytes_per_particle(),
        front: swarm.front().objectives,
    })
}

fn on_a_device(problem: &TestProblem, settings: MopsoSettings, arguments: &Arguments) -> Result<Run> {
    let context = GpuContext::shared(arguments.adapter.as_deref())?;
    let mut evaluator = GpuTestEvaluator::new(problem, context.clone())?;
    // The first generation of a swarm compiles its kernels.
    let mut first = DeviceMopso::new(problem.problem(), settings.clone(), context.clone())?;
    first.step(&mut evaluator)?;
    drop(first);
    let mut swarm = DeviceMopso::new(problem.problem(), settings, context.clone())?;
    let mut times = Times::default();
    for _ in 0..arguments.generations {
        let (others, evaluated) = timed(|| swarm.evaluate(&mut evaluator));
        evaluated?;
        let (own, moved) = timed(|| swarm.learn_and_move().and_then(|_| context.settle()));
        moved?;
        times.note(own, others);
    }
    let info = swarm.backend();
    Ok(Run {
        backend: info.backend,
        device: info.device,
        times,
        bytes_per_particle: swarm.bytes_per_particle(),
        front: swarm.front().objectives,
    })
}

/// Slope of the line through the logarithms of time against particles.
fn slope(times: &[(f64, f64)]) -> f64 {
    let n = times.len() as f64;
    let logs: Vec<(f64, f64)> = times.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|l| l.0), mean(|l| l.1));
    let covariance: f64 = logs.iter().map(|l| (l.0 - x) * (l.1 - y)).sum();
    covariance / logs.iter().map(|l| (l.0 - x).powi(2)).sum::<f64>()
}
