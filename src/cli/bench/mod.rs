//! `lapswarm bench`: evaluations per second against population, and how good the optimisers are.

mod optimisers;
mod swarm;

use super::{backend_flag, print_json};
use lapswarm::Result;
use lapswarm::evaluate::Evaluator;
use lapswarm::evaluate::gpu::{GpuContext, devices};
use lapswarm::evaluate::replay::{BackendChoice, CpuEvaluator, GpuEvaluator, SimdEvaluator};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::random::Random;
use lapswarm::report::{ScalingSeries, plot_scaling};
use lapswarm::study::identify::{IdentifySettings, set_up};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Flags of `bench`.
#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Arguments {
    #[command(subcommand)]
    what: Option<What>,
    /// Populations to measure
    #[arg(long, value_delimiter = ',', default_value = "64,256,1024,4096")]
    populations: Vec<usize>,
    /// Only this backend [default: all there are]
    #[arg(long, value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long)]
    adapter: Option<String>,
    /// Draw the rates into this SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(clap::Subcommand)]
enum What {
    /// Compare the optimisers on problems whose answers are known.
    Optimisers(optimisers::Arguments),
    /// Measure what the optimiser itself costs, from a thousand particles to a million.
    Swarm(swarm::Arguments),
}

#[derive(Serialize)]
struct Row {
    problem: &'static str,
    backend: &'static str,
    adapter: String,
    population: usize,
    evaluations_per_s: f64,
    particle_steps_per_s: f64,
    kernel_ms: Option<f64>,
}

#[derive(Serialize)]
struct Table {
    study: &'static str,
    threads: usize,
    rows: Vec<Row>,
}

/// Purpose of the draws of candidates in the counter.
const CANDIDATES: u32 = 0xbe0c;
/// Candidates lie within this share of the truth, so that all of them drive and none ends early.
const SPREAD: f64 = 0.02;
/// The reference is given no more candidates than this: it is slow, and its rate does not depend on them.
const MOST_FOR_CPU: usize = 64;

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        Some(What::Optimisers(arguments)) => return optimisers::run(arguments),
        Some(What::Swarm(arguments)) => return swarm::run(arguments),
        None => {}
    }
    let setup = set_up(&IdentifySettings::default())?;
    let replay = &setup.replay;
    let base = replay.base();
    let truth: Vec<f64> = replay.parameters.iter().map(|p| base[p.slots[0]]).collect();
    let random = Random::new(1);
    let candidates = |count: usize| -> Vec<f64> {
        let value = |i: usize, k: usize| {
            truth[k] * (1.0 + SPREAD * (2.0 * random.uniform(CANDIDATES, 0, i as u32, k as u32) - 1.0))
        };
        (0..count)
            .flat_map(|i| (0..truth.len()).map(move |k| (i, k)))
            .map(|(i, k)| value(i, k))
            .collect()
    };
    let steps: usize = replay
        .plan
        .windows
        .iter()
        .map(|w| (w.end - w.start - 1) * replay.plan.fractions.len())
        .sum();
    let wanted = |choice| {
        arguments
            .backend
            .is_none_or(|b| b == choice || b == BackendChoice::Auto)
    };
    let mut rows = Vec::new();

    let mut measure = |evaluator: &mut dyn Evaluator, population: usize| -> Result<f64> {
        let candidates = candidates(population);
        // The first call compiles kernels and fills caches.
        evaluator.evaluate(&candidates[..truth.len() * population.min(64)])?;
        let began = Instant::now();
        evaluator.evaluate(&candidates)?;
        let seconds = began.elapsed().as_secs_f64();
        let info = evaluator.backend();
        let rate = population as f64 / seconds;
        rows.push(Row {
            problem: "replay",
            backend: info.backend,
            adapter: info.device,
            population,
            evaluations_per_s: rate,
            particle_steps_per_s: rate * steps as f64,
            kernel_ms: None,
        });
        Ok(seconds)
    };
    let mut kernel_ms = Vec::new();
    for &population in &arguments.populations {
        if wanted(BackendChoice::Cpu) && population <= MOST_FOR_CPU {
            measure(&mut CpuEvaluator::new(replay), population)?;
        }
        if wanted(BackendChoice::Simd) {
            measure(
                &mut SimdEvaluator::new(replay, InstructionSet::best()),
                population,
            )?;
        }
        if wanted(BackendChoice::Gpu) && (arguments.backend.is_some() || !devices().is_empty()) {
            let context = GpuContext::shared(arguments.adapter.as_deref())?;
            let mut evaluator = GpuEvaluator::new(replay, context)?;
            measure(&mut evaluator, population)?;
            kernel_ms.push((population, evaluator.last_kernel_ms()));
        }
    }
    for row in rows.iter_mut().filter(|r| r.backend == "gpu") {
        row.kernel_ms = kernel_ms
            .iter()
            .find(|(p, _)| *p == row.population)
            .and_then(|(_, ms)| *ms);
    }
    let table = Table {
        study: "bench",
        threads: rayon::current_num_threads(),
        rows,
    };
    if let Some(path) = &arguments.plot {
        draw(path, &table)?;
    }
    if arguments.json {
        return print_json(&table);
    }
    println!("one lap of {steps} Runge-Kutta steps, {} threads", table.threads);
    println!(
        "{:<8}{:>12}{:>18}{:>26}{:>12}",
        "backend", "population", "evaluations/s", "million particle-steps/s", "kernel ms"
    );
    for r in &table.rows {
        let kernel = r.kernel_ms.map_or("-".to_owned(), |ms| format!("{ms:.1}"));
        println!(
            "{:<8}{:>12}{:>18.1}{:>26.3}{:>12}   {}",
            r.backend,
            r.population,
            r.evaluations_per_s,
            r.particle_steps_per_s / 1e6,
            kernel,
            r.adapter
        );
    }
    Ok(())
}

fn draw(path: &std::path::Path, table: &Table) -> Result<()> {
    let mut backends: Vec<&str> = table.rows.iter().map(|r| r.backend).collect();
    backends.dedup();
    backends.sort_unstable();
    backends.dedup();
    let columns: Vec<(&str, Vec<f64>, Vec<f64>)> = backends
        .into_iter()
        .map(|b| {
            let of = |f: &dyn Fn(&Row) -> f64| table.rows.iter().filter(|r| r.backend == b).map(f).collect();
            (b, of(&|r| r.population as f64), of(&|r| r.evaluations_per_s))
        })
        .collect();
    let series: Vec<ScalingSeries<'_>> = columns
        .iter()
        .map(|(label, population, rate)| ScalingSeries {
            label,
            population,
            evaluations_per_s: rate,
        })
        .collect();
    plot_scaling(path, "Evaluations per second against population", &series)
}
