//! `lapswarm bench studies`: every optimiser of several objectives on the studies' own problems, hypervolume against time.

use super::pages::{of_studies, qualities};
use crate::cli::backend_flag;
use crate::cli::measurement::MeasurementFlags;
use crate::cli::output::{Columns, line_of, outln};
use clap::builder::PossibleValuesParser;
use lapswarm::evaluate::line::{LineObjective, LineProblem};
use lapswarm::evaluate::replay::{CHANNEL_NAMES, ReplayProblem};
use lapswarm::evaluate::{BackendChoice, Evaluator, OnDevice, open_evaluator};
use lapswarm::random::Random;
use lapswarm::report::Figure;
use lapswarm::study::identify::{self, IdentifySettings, ObjectiveChoice};
use lapswarm::study::raceline::{self, RacelineSettings};
use lapswarm::swarm::comparison::quartiles;
use lapswarm::swarm::metrics::{Scale, hypervolume};
use lapswarm::swarm::{MULTI_OBJECTIVE, Optimiser, Sizes, several_by_name};
use lapswarm::{Error, Result};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

/// Flags of `bench studies`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Problems: identify (speed, lateral acceleration and yaw rate through Maggotts and Becketts, 22 unknowns), raceline
    /// (Gamma, length and lap time at Silverstone, from the reference optima)
    #[arg(long, value_delimiter = ',', default_value = "identify,raceline",
          value_parser = PossibleValuesParser::new(PROBLEMS.map(|(name, _)| name)))]
    problems: Vec<String>,
    /// Only these algorithms [default: all for several objectives]
    #[arg(long, value_delimiter = ',', value_parser = MULTI_OBJECTIVE)]
    algorithms: Vec<String>,
    /// Populations to compare
    #[arg(long, value_delimiter = ',', default_value = "100,1000,10000,100000",
          value_parser = clap::value_parser!(u32).range(4..=10_000_000))]
    populations: Vec<u32>,
    /// Evaluations of every run: so many generations as come nearest, one at least
    #[arg(long, value_name = "N", default_value_t = 200_000, value_parser = clap::value_parser!(u64).range(100..))]
    evaluations: u64,
    /// Members of the archive
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(8..=10_000))]
    archive: u32,
    /// Runs of each, seeds 1 to N
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=60))]
    seeds: u64,
    /// Cross-sections of the circuit that lines are driven on
    #[arg(long, value_name = "N", default_value_t = 480, value_parser = clap::value_parser!(u32).range(60..=100_000))]
    sections: u32,
    /// What evaluates
    #[arg(long, value_parser = backend_flag, default_value = "auto")]
    backend: BackendChoice,
    /// Part of the name of the GPU to use, or all for several
    #[arg(long)]
    adapter: Option<String>,
    /// Draw hypervolume against time into this SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    kept: MeasurementFlags,
}

/// Compares the optimisers on a problem.
type Compare = fn(&Arguments, &mut Table) -> Result<()>;

/// The problems, by name.
const PROBLEMS: [(&str, Compare); 2] = [
    ("identify", |arguments, table| {
        identify(arguments)?.compare(arguments, table)
    }),
    ("raceline", |arguments, table| {
        raceline(arguments)?.compare(arguments, table)
    }),
];
/// The part of the bundled lap that cars are identified on.
const SECTION: &str = "Maggotts/Becketts";
/// Random cars whose median costs are the reference point.
const RANDOM_CARS: usize = 1000;
/// Purpose of their draws in the counter.
const CARS: u32 = 0x57d1;
/// A hypervolume is noted down when so many times the evaluations are done as when the last was.
const SPACING: f64 = 1.03;

/// Lines or other candidates that a run begins with, for a population and a seed.
type Start<K> = Box<dyn Fn(&K, usize, u64) -> Result<Vec<Vec<f64>>>>;

/// A problem with the box that hypervolumes are shares of.
struct Case<K> {
    name: &'static str,
    kind: K,
    /// The first candidates, as the study would choose them.
    start: Start<K>,
    ideal: Vec<f64>,
    reference: Vec<f64>,
}

/// One algorithm with one population on one problem.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) problem: &'static str,
    pub(super) algorithm: String,
    pub(super) population: usize,
    pub(super) generations: usize,
    pub(super) evaluations: u64,
    pub(super) seeds: u64,
    pub(super) hypervolume_median: f64,
    pub(super) hypervolume_iqr: f64,
    pub(super) seconds_median: f64,
    /// Of these, those of the evaluations.
    pub(super) evaluation_s_median: f64,
    /// The run that comes nearest to the median.
    pub(super) history: History,
}

#[derive(Clone, Default, Serialize)]
pub(super) struct History {
    pub(super) evaluations: Vec<u64>,
    pub(super) seconds: Vec<f64>,
    pub(super) hypervolume: Vec<f64>,
}

/// The box of a problem.
#[derive(Serialize)]
struct Scored {
    problem: &'static str,
    variables: usize,
    objectives: Vec<String>,
    ideal: Vec<f64>,
    reference: Vec<f64>,
    backend: &'static str,
    device: String,
}

#[derive(Serialize)]
struct Table {
    study: &'static str,
    threads: usize,
    archive: u32,
    problems: Vec<Scored>,
    rows: Vec<Row>,
}

/// The box reaches from no error at all to the median costs of random cars that drive.
fn identify(arguments: &Arguments) -> Result<Case<ReplayProblem>> {
    let channels = ["vx", "ay", "yaw_rate"];
    let place = |name: &&str| CHANNEL_NAMES.iter().position(|c| c == name);
    let settings = IdentifySettings {
        section: Some(SECTION.to_owned()),
        objectives: channels
            .iter()
            .filter_map(place)
            .map(ObjectiveChoice::Channel)
            .collect(),
        ..IdentifySettings::default()
    };
    let replay = identify::set_up(&settings)?.replay;
    let random = Random::new(1);
    let cars: Vec<f64> = (0..RANDOM_CARS as u32)
        .flat_map(|car| {
            let variables = replay.problem.variables.iter().enumerate();
            variables
                .map(move |(k, v)| v.lower + random.uniform(CARS, 0, car, k as u32) * (v.upper - v.lower))
        })
        .collect();
    let costs = open_evaluator(&replay, arguments.backend, arguments.adapter.as_deref())?.evaluate(&cars)?;
    let width = channels.len();
    let reference: Vec<f64> = (0..width)
        .map(|k| {
            let cost = |car: usize| costs.success(car, width).map(|row| row[k]);
            quartiles(&(0..RANDOM_CARS).filter_map(cost).collect::<Vec<_>>())[1]
        })
        .collect();
    if reference.iter().any(|r| !r.is_finite()) {
        return Err(Error::Study("none of the random cars drives".to_owned()));
    }
    Ok(Case {
        name: "identify",
        ideal: vec![0.0; width],
        reference,
        start: Box::new(|_, _, _| Ok(Vec::new())),
        kind: replay,
    })
}

/// The box reaches from the best to the worst of each objective among the reference optima and the reference line.
fn raceline(arguments: &Arguments) -> Result<Case<LineProblem>> {
    let settings = RacelineSettings {
        sections: Some(arguments.sections as usize),
        objectives: vec![
            LineObjective::Gamma,
            LineObjective::Length,
            LineObjective::LapTime,
        ],
        ..RacelineSettings::default()
    };
    let setup = raceline::set_up(&settings)?;
    let solvers = setup.solvers(&settings, &Default::default())?;
    let mut known = Vec::new();
    for objective in &settings.objectives {
        known.extend(solvers.best(*objective)?.map(|line| line.alpha));
    }
    let problem = raceline::front_problem(&setup, &settings)?;
    let mut lines: Vec<f64> = problem.candidate(&setup.cross_sections.reference)?;
    for alpha in &known {
        lines.extend(problem.candidate(alpha)?);
    }
    let rows = open_evaluator(&problem, arguments.backend, arguments.adapter.as_deref())?
        .evaluate(&lines)?
        .objectives;
    let width = settings.objectives.len();
    let extreme = |from: f64, f: fn(f64, f64) -> f64| -> Vec<f64> {
        let column = |k: usize| rows.iter().skip(k).step_by(width).copied();
        (0..width).map(|k| column(k).fold(from, f)).collect()
    };
    Ok(Case {
        name: "raceline",
        ideal: extreme(f64::INFINITY, f64::min),
        reference: extreme(f64::NEG_INFINITY, f64::max),
        start: Box::new(move |problem, population, seed| {
            let settings = RacelineSettings {
                population,
                seed,
                ..settings.clone()
            };
            raceline::starting_lines(problem, &settings, &known)
        }),
        kind: problem,
    })
}

impl<K: OnDevice> Case<K> {
    fn evaluator(&self, arguments: &Arguments) -> Result<Box<dyn Evaluator + '_>> {
        open_evaluator(&self.kind, arguments.backend, arguments.adapter.as_deref())
    }

    /// Compares the optimisers on it.
    fn compare(&self, arguments: &Arguments, table: &mut Table) -> Result<()> {
        let backend = self.evaluator(arguments)?.backend();
        let problem = self.kind.problem();
        table.problems.push(Scored {
            problem: self.name,
            variables: problem.variables.len(),
            objectives: problem
                .objectives
                .iter()
                .map(|o| format!("{} ({})", o.name, o.unit))
                .collect(),
            ideal: self.ideal.clone(),
            reference: self.reference.clone(),
            backend: backend.backend,
            device: backend.device,
        });
        let algorithms = match &arguments.algorithms[..] {
            [] => MULTI_OBJECTIVE.to_vec(),
            chosen => chosen.iter().map(String::as_str).collect(),
        };
        for &population in &arguments.populations {
            for algorithm in &algorithms {
                let row = self.measure(algorithm, population as usize, arguments)?;
                outln!("{}", line_of(COLUMNS, Some(&row)));
                table.rows.push(row);
            }
        }
        Ok(())
    }

    fn measure(&self, algorithm: &str, population: usize, arguments: &Arguments) -> Result<Row> {
        // The genetic algorithm breeds pairs.
        let population = population.next_multiple_of(2);
        let generations = ((arguments.evaluations as f64 / population as f64).round() as usize).max(1);
        let mut runs = Vec::new();
        for seed in 1..=arguments.seeds {
            let sizes = Sizes {
                population,
                iterations: generations,
                archive: arguments.archive as usize,
                seed,
            };
            runs.push(self.follow(algorithm, sizes, arguments)?);
        }
        let last = |values: &[f64]| values.last().copied().unwrap_or(f64::NAN);
        let reached: Vec<f64> = runs.iter().map(|r| last(&r.0.hypervolume)).collect();
        let seconds: Vec<f64> = runs.iter().map(|r| last(&r.0.seconds)).collect();
        let evaluating: Vec<f64> = runs.iter().map(|r| r.1).collect();
        let [low, median, high] = quartiles(&reached);
        let nearest = (0..runs.len())
            .min_by(|&a, &b| f64::total_cmp(&(reached[a] - median).abs(), &(reached[b] - median).abs()));
        Ok(Row {
            problem: self.name,
            algorithm: algorithm.to_owned(),
            population,
            generations,
            evaluations: (population * generations) as u64,
            seeds: arguments.seeds,
            hypervolume_median: median,
            hypervolume_iqr: high - low,
            seconds_median: quartiles(&seconds)[1],
            evaluation_s_median: quartiles(&evaluating)[1],
            history: nearest.map(|i| runs[i].0.clone()).unwrap_or_default(),
        })
    }

    /// One run, and the seconds that its evaluations took.
    fn follow(&self, algorithm: &str, sizes: Sizes, arguments: &Arguments) -> Result<(History, f64)> {
        let mut evaluator = self.evaluator(arguments)?;
        let start = (self.start)(&self.kind, sizes.population, sizes.seed)?;
        let mut optimiser = several_by_name(algorithm, self.kind.problem(), sizes, &start)?;
        drop(start);
        let mut history = History::default();
        let (mut seconds, mut evaluating, mut noted) = (0.0, 0.0, 0.0);
        let most = (sizes.population * sizes.iterations) as u64;
        // Trials of mutation are evaluations too, and the budget is one for all.
        let over = |optimiser: &dyn Optimiser| optimiser.done() || optimiser.evaluations() >= most;
        while !over(optimiser.as_ref()) {
            let began = Instant::now();
            let population = optimiser.ask();
            let asked = began.elapsed().as_secs_f64();
            let evaluation = evaluator.evaluate(&population)?;
            evaluating += began.elapsed().as_secs_f64() - asked;
            optimiser.tell(&evaluation)?;
            seconds += began.elapsed().as_secs_f64();
            let done = optimiser.evaluations();
            if done as f64 >= SPACING * noted || over(optimiser.as_ref()) {
                noted = done as f64;
                history.evaluations.push(done);
                history.seconds.push(seconds);
                history
                    .hypervolume
                    .push(self.quality(&optimiser.front().objectives)?);
            }
        }
        Ok((history, evaluating))
    }

    /// Share of the box that a front dominates.
    fn quality(&self, front: &[Vec<f64>]) -> Result<f64> {
        let shares = Scale::between(&self.ideal, &self.reference).apply(front);
        hypervolume(&shares, &vec![1.0; self.ideal.len()])
    }
}

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    let keeping = arguments
        .kept
        .begin("bench studies", arguments.adapter.as_deref())?;
    let mut table = Table {
        study: "bench studies",
        threads: rayon::current_num_threads(),
        archive: arguments.archive,
        problems: Vec::new(),
        rows: Vec::new(),
    };
    outln!(
        "{} evaluations, archive of {}, {} threads, medians of {} seeds; hypervolume as a share of the problem's box",
        arguments.evaluations,
        arguments.archive,
        table.threads,
        arguments.seeds
    );
    outln!("{}", line_of(COLUMNS, None));
    for name in &arguments.problems {
        for (_, compare) in PROBLEMS.iter().filter(|(known, _)| known == name) {
            compare(arguments, &mut table)?;
        }
    }
    if let Some(path) = &arguments.plot {
        qualities(&table.rows).write_svg(path)?;
    }
    let backends = table.problems.iter().map(|p| p.backend);
    keeping.finish(&table, backends, |folder| of_studies(folder, &table.rows))
}

/// The table on a terminal.
const COLUMNS: &Columns<Row> = &[
    ("problem", -10, |r| r.problem.to_owned()),
    ("algorithm", -18, |r| r.algorithm.clone()),
    ("population", 11, |r| r.population.to_string()),
    ("generations", 12, |r| r.generations.to_string()),
    ("hypervolume", 13, |r| format!("{:.4}", r.hypervolume_median)),
    ("IQR", 10, |r| format!("{:.1e}", r.hypervolume_iqr)),
    ("seconds", 10, |r| format!("{:.2}", r.seconds_median)),
    ("evaluation s", 14, |r| format!("{:.2}", r.evaluation_s_median)),
];
