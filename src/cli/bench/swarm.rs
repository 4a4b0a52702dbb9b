//! `lapswarm bench swarm`: what a generation costs besides its evaluations, against the number of particles.

use crate::cli::print_json;
use lapswarm::Result;
use lapswarm::evaluate::Evaluator;
use lapswarm::swarm::metrics::{Scale, hypervolume};
use lapswarm::swarm::problems::TestProblem;
use lapswarm::swarm::{Mopso, MopsoSettings, Optimiser, PsoSettings};
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
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// One population on one problem.
#[derive(Serialize)]
struct Row {
    backend: &'static str,
    problem: &'static str,
    objectives: usize,
    variables: usize,
    population: usize,
    generation_ms: f64,
    slowest_generation_ms: f64,
    evaluation_ms: f64,
    bytes_per_particle: usize,
    hypervolume: f64,
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
    let mut table = Table {
        study: "bench swarm",
        threads: rayon::current_num_threads(),
        rows: Vec::new(),
        growth: Vec::new(),
    };
    if !arguments.json {
        println!(
            "milliseconds per generation of the optimiser alone, {} threads",
            table.threads
        );
        println!(
            "{:<8}{:<8}{:>11}{:>11}{:>12}{:>12}{:>12}{:>12}{:>13}",
            "backend",
            "problem",
            "objectives",
            "particles",
            "generation",
            "slowest",
            "evaluation",
            "bytes each",
            "hypervolume"
        );
    }
    for name in &arguments.problems {
        let problem = TestProblem::by_name(name)
            .filter(|p| p.problem().objectives.len() > 1)
            .ok_or_else(|| {
                lapswarm::Error::input(
                    "--problems",
                    "name",
                    name,
                    "a test problem of two or three objectives",
                )
            })?;
        let problem = if arguments.variables > 0 {
            TestProblem::sized(name, arguments.variables).unwrap_or(problem)
        } else {
            problem
        };
        let mut times = Vec::new();
        for &population in &arguments.populations {
            let row = measure(&problem, population, arguments)?;
            times.push((population as f64, row.generation_ms));
            if !arguments.json {
                println!(
                    "{:<8}{:<8}{:>11}{:>11}{:>12.3}{:>12.3}{:>12.3}{:>12}{:>13.4}",
                    row.backend,
                    row.problem,
                    row.objectives,
                    row.population,
                    row.generation_ms,
                    row.slowest_generation_ms,
                    row.evaluation_ms,
                    row.bytes_per_particle,
                    row.hypervolume
                );
            }
            table.rows.push(row);
        }
        if times.len() > 1 {
            let growth = Growth {
                backend: "simd",
                problem: problem.name(),
                exponent: slope(&times),
            };
            if !arguments.json {
                println!(
                    "{:<8}{:<8} time grows as particles^{:.2}",
                    growth.backend, growth.problem, growth.exponent
                );
            }
            table.growth.push(growth);
        }
    }
    if arguments.json {
        print_json(&table)?;
    }
    Ok(())
}

fn measure(problem: &TestProblem, population: usize, arguments: &Arguments) -> Result<Row> {
    let width = problem.problem().objectives.len();
    let mut best: Option<Row> = None;
    for _ in 0..arguments.repeats {
        let settings = MopsoSettings {
            motion: PsoSettings {
                population,
                iterations: arguments.generations as usize,
                ..MopsoSettings::default().motion
            },
            ..MopsoSettings::default()
        };
        let mut swarm = Mopso::new(problem.problem(), settings)?;
        let mut evaluator = problem.threaded_evaluator();
        let (mut own, mut slowest, mut others) = (0.0, 0.0f64, 0.0);
        while !swarm.done() {
            let began = Instant::now();
            let candidates = swarm.ask();
            let asked = began.elapsed().as_secs_f64();
            let began = Instant::now();
            let evaluation = evaluator.evaluate(&candidates)?;
            others += began.elapsed().as_secs_f64();
            let began = Instant::now();
            swarm.tell(&evaluation);
            let generation = asked + began.elapsed().as_secs_f64();
            own += generation;
            slowest = slowest.max(generation);
        }
        let front = problem.front(2000);
        let scale = Scale::of(&front);
        let found = scale.apply(&swarm.front().objectives);
        let each = 1e3 / f64::from(arguments.generations);
        let row = Row {
            backend: "simd",
            problem: problem.name(),
            objectives: width,
            variables: problem.problem().variables.len(),
            population,
            generation_ms: own * each,
            slowest_generation_ms: slowest * 1e3,
            evaluation_ms: others * each,
            bytes_per_particle: swarm.bytes_per_particle(),
            hypervolume: hypervolume(&found, &vec![REFERENCE; width])?,
        };
        if best.as_ref().is_none_or(|b| row.generation_ms < b.generation_ms) {
            best = Some(row);
        }
    }
    best.ok_or_else(|| lapswarm::Error::Study("nothing was measured".to_owned()))
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
