//! `lapswarm bench optimisers`: every algorithm on every test problem.

use super::pages::of_optimisers;
use crate::cli::measurement::FolderFlag;
use crate::cli::output::{Columns, line_of, outln};
use lapswarm::swarm::comparison::{compare, quartiles};
use lapswarm::swarm::metrics::signed_rank;
use lapswarm::swarm::problems::{NAMES, TestProblem};
use lapswarm::swarm::{MULTI_OBJECTIVE, SINGLE_OBJECTIVE};
use lapswarm::{Error, Result};
use serde::Serialize;

/// Flags of `bench optimisers`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Runs of each algorithm, seeds 1 to N
    #[arg(long, value_name = "N", default_value_t = 11, value_parser = clap::value_parser!(u64).range(1..=60))]
    seeds: u64,
    /// Only these problems [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    problems: Vec<String>,
    /// Only these algorithms [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    algorithms: Vec<String>,
    #[command(flatten)]
    kept: FolderFlag,
}

/// One algorithm on one problem; hypervolume for several objectives, error for one.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) problem: &'static str,
    pub(super) algorithm: &'static str,
    pub(super) seeds: u64,
    pub(super) hypervolume_median: Option<f64>,
    pub(super) hypervolume_iqr: Option<f64>,
    pub(super) igd_plus_median: Option<f64>,
    pub(super) error_median: Option<f64>,
    pub(super) error_iqr: Option<f64>,
    pub(super) best_peer: Option<f64>,
    pub(super) better_than_peer_p: Option<f64>,
}

#[derive(Serialize)]
struct Table {
    study: &'static str,
    rows: Vec<Row>,
}

/// The best median that another library's optimiser reaches at the same budget, measured with `jmetalpy` (SMPSO),
/// `pymoo` (NSGA-II, SMS-EMOA, MOPSO-CD, PSO) and `pygmo` (PSO): hypervolume, or the error for one objective.
const PEERS: [(&str, f64); 11] = [
    ("zdt1", 0.8719),
    ("zdt2", 0.5386),
    ("zdt3", 0.7255),
    ("zdt4", 0.8714),
    ("zdt6", 0.6114),
    ("dtlz2", 0.757),
    ("sphere", 0.0),
    ("rosenbrock", 17.0),
    ("rastrigin", 4.0),
    ("ackley", 7e-11),
    ("griewank", 0.0),
];

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    check("--problems", &arguments.problems, &NAMES)?;
    let algorithms = [MULTI_OBJECTIVE.as_slice(), &SINGLE_OBJECTIVE].concat();
    check("--algorithms", &arguments.algorithms, &algorithms)?;
    let wanted = |chosen: &[String], name: &str| chosen.is_empty() || chosen.iter().any(|c| c == name);
    let keeping = arguments.kept.begin("bench optimisers", None)?;
    let mut rows = Vec::new();
    if !arguments.kept.json {
        outln!("medians and interquartile ranges of {} seeds", arguments.seeds);
        outln!("{}", line_of(COLUMNS, None));
    }
    for problem in NAMES
        .into_iter()
        .filter(|n| wanted(&arguments.problems, n))
        .filter_map(TestProblem::by_name)
    {
        let single = problem.problem().objectives.len() == 1;
        let algorithms = if single {
            SINGLE_OBJECTIVE.as_slice()
        } else {
            &MULTI_OBJECTIVE
        };
        for algorithm in algorithms.iter().filter(|a| wanted(&arguments.algorithms, a)) {
            let row = measure(&problem, algorithm, arguments.seeds)?;
            if !arguments.kept.json {
                outln!("{}", line_of(COLUMNS, Some(&row)));
            }
            rows.push(row);
        }
    }
    let table = Table {
        study: "bench optimisers",
        rows,
    };
    keeping.finish(!arguments.kept.json, &table, ["cpu"], |folder| {
        of_optimisers(folder, &table.rows)
    })
}

fn check(flag: &str, chosen: &[String], known: &[&str]) -> Result<()> {
    match chosen.iter().find(|c| !known.contains(&c.as_str())) {
        Some(name) => Err(Error::input(flag, "name", name, known.join(", "))),
        None => Ok(()),
    }
}

fn measure(problem: &TestProblem, algorithm: &'static str, seeds: u64) -> Result<Row> {
    let scores = compare(algorithm, problem, seeds)?;
    let values: Vec<f64> = scores.iter().map(|s| s.quality).collect();
    let distances: Vec<f64> = scores.iter().filter_map(|s| s.igd_plus).collect();
    let [low, median, high] = quartiles(&values);
    let single = distances.is_empty();
    let best_peer = PEERS.iter().find(|p| p.0 == problem.name()).map(|p| p.1);
    let better_than_peer_p = best_peer.and_then(|figure| {
        if single {
            let negated: Vec<f64> = values.iter().map(|x| -x).collect();
            signed_rank(&negated, -figure)
        } else {
            signed_rank(&values, figure)
        }
    });
    Ok(Row {
        problem: problem.name(),
        algorithm,
        seeds,
        hypervolume_median: (!single).then_some(median),
        hypervolume_iqr: (!single).then_some(high - low),
        igd_plus_median: (!single).then(|| quartiles(&distances)[1]),
        error_median: single.then_some(median),
        error_iqr: single.then_some(high - low),
        best_peer,
        better_than_peer_p,
    })
}

/// The table on a terminal.
const COLUMNS: &Columns<Row> = &[
    ("problem", -12, |r| r.problem.to_owned()),
    ("algorithm", -18, |r| r.algorithm.to_owned()),
    ("hypervolume", 14, |r| fixed(r.hypervolume_median)),
    ("IQR", 10, |r| short(r.hypervolume_iqr)),
    ("IGD+", 12, |r| fixed(r.igd_plus_median)),
    ("error", 14, |r| short(r.error_median)),
    ("IQR", 10, |r| short(r.error_iqr)),
    ("best peer", 12, |r| match r.hypervolume_median {
        Some(_) => fixed(r.best_peer),
        None => short(r.best_peer),
    }),
    ("p", 12, |r| short(r.better_than_peer_p)),
];

fn fixed(x: Option<f64>) -> String {
    x.map_or(String::new(), |x| format!("{x:.4}"))
}

fn short(x: Option<f64>) -> String {
    x.map_or(String::new(), |x| format!("{x:.1e}"))
}
