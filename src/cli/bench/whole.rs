//! `lapswarm bench whole`: the time of a whole generation against the number of particles, and the share that is not kernels.

use super::pages::of_whole;
use super::scaling::{Bench, Case, measure_named, problems};
use crate::cli::backend_flag;
use crate::cli::measurement::MeasurementFlags;
use crate::cli::output::{Columns, line_of, outln};
use clap::builder::PossibleValuesParser;
use lapswarm::evaluate::gpu::{GpuContext, devices};
use lapswarm::evaluate::line::LineObjective;
use lapswarm::evaluate::{BackendChoice, Evaluator, GpuBackend, OnDevice, Problem};
use lapswarm::swarm::device::DeviceMopso;
use lapswarm::swarm::{Mopso, MopsoSettings, Optimiser};
use lapswarm::{Error, Result};
use serde::Serialize;
use std::time::{Duration, Instant};

/// How long generations are run before they are measured, and how long they are measured at the least: a card at rest takes a tenth of
/// a second to get up to speed.
const LEAST: Duration = Duration::from_millis(250);
/// The most of them, unless more are asked for.
const MOST: u32 = 500;

/// Flags of `bench whole`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Problems: those of `bench`, by three objectives
    #[arg(long, value_delimiter = ',', default_value = "replay,line,energy,drive,steady",
          value_parser = PossibleValuesParser::new(problems::<Generations<'_>>().map(|(name, _)| name)))]
    problems: Vec<String>,
    /// Particles to measure
    #[arg(long, value_delimiter = ',', default_value = "1000,10000,100000,1000000",
          value_parser = clap::value_parser!(u32).range(8..=4_194_304))]
    populations: Vec<u32>,
    /// Generations that are measured at the least, after others that compile kernels, fill caches and bring a card up to speed
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    generations: u32,
    /// Leave out generations that would take longer than this, s, by the rate of the population before
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    longest_s: f64,
    /// Only this backend [default: simd, and gpu where there is one]
    #[arg(long, value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long)]
    adapter: Option<String>,
    #[command(flatten)]
    kept: MeasurementFlags,
}

/// One population of one problem.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) problem: &'static str,
    pub(super) backend: &'static str,
    pub(super) adapter: String,
    /// Where the swarm is: `host` or `device`.
    pub(super) swarm: &'static str,
    pub(super) objectives: usize,
    pub(super) population: usize,
    /// Means of the generations.
    pub(super) generation_ms: f64,
    pub(super) kernel_ms: f64,
    pub(super) outside_kernels_share: f64,
}

#[derive(Serialize)]
struct Table {
    study: &'static str,
    threads: usize,
    generations: u32,
    rows: Vec<Row>,
}

/// The table on a terminal.
const COLUMNS: &Columns<Row> = &[
    ("problem", -8, |r| r.problem.to_owned()),
    ("backend", -8, |r| r.backend.to_owned()),
    ("swarm", -7, |r| r.swarm.to_owned()),
    ("objectives", 11, |r| r.objectives.to_string()),
    ("particles", 11, |r| r.population.to_string()),
    ("generation ms", 14, |r| format!("{:.2}", r.generation_ms)),
    ("kernel ms", 12, |r| format!("{:.2}", r.kernel_ms)),
    ("outside", 9, |r| {
        format!("{:.1}%", 100.0 * r.outside_kernels_share)
    }),
];

/// What has been measured so far.
struct Generations<'a> {
    arguments: &'a Arguments,
    rows: Vec<Row>,
}

/// The first particles of a swarm: the bench's candidates.
fn starts<K: OnDevice>(case: &Case<K>, population: usize) -> Vec<Vec<f64>> {
    let candidates = case.candidates(population);
    let rows = candidates.chunks_exact(case.about.len());
    rows.map(<[f64]>::to_vec).collect()
}

impl Bench for Generations<'_> {
    const LINE_OBJECTIVES: &'static [LineObjective] = &[
        LineObjective::Gamma,
        LineObjective::Length,
        LineObjective::LapTime,
    ];
    const FRONTS: bool = true;

    /// On every backend, with the swarm on the host and, of two or three objectives, on the device.
    fn measure_all<K: OnDevice>(&mut self, name: &'static str, case: &Case<K>) -> Result<()> {
        let choice = self.arguments.backend.unwrap_or_default();
        let adapter = self.arguments.adapter.as_deref();
        let problem = case.kind.problem();
        let arguments = self.arguments;
        for mut evaluator in case.evaluators(choice, adapter)? {
            let info = evaluator.backend();
            // The reference does not tell its kernels from the rest.
            if info.backend == "cpu" {
                continue;
            }
            self.measure(name, (info.backend, info.device), "host", problem, |population| {
                arguments.on_the_host(case, evaluator.as_mut(), population)
            })?;
        }
        let wanted = match choice {
            BackendChoice::Gpu => true,
            BackendChoice::Auto => adapter.is_some() || !devices().is_empty(),
            _ => false,
        };
        let width = problem.objectives.len();
        if wanted && (2..=3).contains(&width) {
            let context = GpuContext::shared(adapter)?;
            let mut evaluator = GpuBackend::new(&case.kind, context.clone())?;
            let info = evaluator.backend();
            self.measure(
                name,
                (info.backend, info.device),
                "device",
                problem,
                |population| {
                    let settings = arguments.settings(population);
                    let mut swarm = DeviceMopso::new(problem, settings, context.clone())?;
                    swarm.start_from(&starts(case, population))?;
                    arguments.timed(|| {
                        let before = context.dispatched_ms();
                        swarm.evaluate(&mut evaluator)?;
                        let kernels = context.dispatched_ms() - before;
                        swarm.learn_and_move()?;
                        // Or the next evaluation's kernels would have the time of the move.
                        context.settle()?;
                        Ok(kernels)
                    })
                },
            )?;
        }
        Ok(())
    }
}

impl Generations<'_> {
    /// Measures every population by `time`, which says how long a generation takes and of that its kernels, ms.
    fn measure(
        &mut self,
        name: &'static str,
        (backend, adapter): (&'static str, String),
        swarm: &'static str,
        problem: &Problem,
        mut time: impl FnMut(usize) -> Result<[f64; 2]>,
    ) -> Result<()> {
        let mut each_ms = 0.0;
        for &population in &self.arguments.populations {
            let population = population as usize;
            if each_ms * population as f64 > 1e3 * self.arguments.longest_s {
                continue;
            }
            let [generation_ms, kernel_ms] = time(population)?;
            each_ms = generation_ms / population as f64;
            let row = Row {
                problem: name,
                backend,
                adapter: adapter.clone(),
                swarm,
                objectives: problem.objectives.len(),
                population,
                generation_ms,
                kernel_ms,
                outside_kernels_share: (1.0 - kernel_ms / generation_ms).clamp(0.0, 1.0),
            };
            outln!("{}   {}", line_of(COLUMNS, Some(&row)), row.adapter);
            self.rows.push(row);
        }
        Ok(())
    }
}

impl Arguments {
    /// Means over the generations, ms: of a generation, and of its kernels, whose time `generation` returns.
    fn timed(&self, mut generation: impl FnMut() -> Result<f64>) -> Result<[f64; 2]> {
        let mut run = |least: u32| -> Result<[f64; 2]> {
            let began = Instant::now();
            let (mut kernels, mut count) = (0.0, 0);
            while count < least || (count < MOST && began.elapsed() < LEAST) {
                kernels += generation()?;
                count += 1;
            }
            let each = 1.0 / f64::from(count);
            Ok([began.elapsed().as_secs_f64() * 1e3 * each, kernels * each])
        };
        run(1)?;
        run(self.generations)
    }

    fn settings(&self, population: usize) -> MopsoSettings {
        MopsoSettings::default().with_size(population, (2 * MOST.max(self.generations)) as usize)
    }

    /// The swarm asked and told on the host.
    fn on_the_host<K: OnDevice>(
        &self,
        case: &Case<K>,
        evaluator: &mut dyn Evaluator,
        population: usize,
    ) -> Result<[f64; 2]> {
        let mut swarm = Mopso::new(case.kind.problem(), self.settings(population))?;
        swarm.start_from(&starts(case, population))?;
        self.timed(|| {
            let candidates = swarm.ask();
            let evaluation = evaluator.evaluate(&candidates)?;
            swarm.tell(&evaluation)?;
            Ok(evaluator.last_kernel_ms().unwrap_or(0.0))
        })
    }
}

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.backend == Some(BackendChoice::Cpu) {
        let expected = "simd or gpu: the reference does not tell its kernels from the rest";
        return Err(Error::input("--backend", "backend", "cpu", expected));
    }
    let keeping = arguments
        .kept
        .begin("bench whole", arguments.adapter.as_deref())?;
    let threads = rayon::current_num_threads();
    outln!("whole generations, {threads} threads");
    outln!("{}", line_of(COLUMNS, None));
    let mut bench = Generations {
        arguments,
        rows: Vec::new(),
    };
    measure_named(&mut bench, &arguments.problems)?;
    let table = Table {
        study: "bench whole",
        threads,
        generations: arguments.generations,
        rows: bench.rows,
    };
    let backends = table.rows.iter().map(|r| r.backend);
    keeping.finish(&table, backends, |folder| of_whole(folder, &table.rows))
}
