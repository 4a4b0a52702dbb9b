//! `lapswarm bench optimisers`: every algorithm on every problem of the suites.

use super::pages::of_optimisers;
use crate::cli::measurement::MeasurementFlags;
use crate::cli::output::{Columns, line_of, outln};
use lapswarm::files::write_whole;
use lapswarm::swarm::comparison::{Score, compare, quartiles};
use lapswarm::swarm::metrics::signed_rank;
use lapswarm::swarm::problems::{Half, SUITES, SuiteProblem};
use lapswarm::swarm::{MULTI_OBJECTIVE, SINGLE_OBJECTIVE};
use lapswarm::{Error, Result};
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Flags of `bench optimisers`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Runs of each algorithm, seeds 1 to N
    #[arg(long, value_name = "N", default_value_t = 11, value_parser = clap::value_parser!(u64).range(1..=60))]
    seeds: u64,
    /// Evaluations of each run [default: 25000 for several objectives, 100000 for one]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(100..))]
    evaluations: Option<u32>,
    /// Only these suites [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES", value_parser = SUITES.map(|(suite, _)| suite))]
    suites: Vec<String>,
    /// Only one half of each suite: chosen_on, on which settings are chosen, or published [default: both]
    #[arg(long, value_name = "HALF", value_parser = [Half::ChosenOn, Half::Published].map(Half::name))]
    half: Option<String>,
    /// Only these problems [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    problems: Vec<String>,
    /// Only these algorithms [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    algorithms: Vec<String>,
    /// Write every front that is found as CSV, for other programs to judge
    #[arg(long, value_name = "FILE")]
    fronts: Option<PathBuf>,
    #[command(flatten)]
    kept: MeasurementFlags,
}

/// One algorithm on one problem; hypervolume for several objectives, error for one.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) suite: &'static str,
    pub(super) half: Half,
    pub(super) problem: &'static str,
    pub(super) algorithm: &'static str,
    pub(super) seeds: u64,
    /// Seeds that found something feasible.
    pub(super) feasible_seeds: u64,
    pub(super) hypervolume_median: Option<f64>,
    pub(super) hypervolume_iqr: Option<f64>,
    pub(super) igd_plus_median: Option<f64>,
    pub(super) error_median: Option<f64>,
    pub(super) error_iqr: Option<f64>,
    pub(super) best_peer: Option<f64>,
    pub(super) best_peer_name: Option<&'static str>,
    pub(super) better_than_peer_p: Option<f64>,
}

impl Row {
    /// Whether it falls short of the best peer: by more than 0.3 % of the hypervolume; or by more than ten times the
    /// error, where that is above 1e-8.
    pub(super) fn falls_short(&self) -> bool {
        let Some(peer) = self.best_peer else {
            return false;
        };
        let volume = self.hypervolume_median.is_some_and(|v| v < (1.0 - 0.003) * peer);
        let error = self.error_median.is_some_and(|e| e > (10.0 * peer).max(1e-8));
        volume || error
    }
}

#[derive(Serialize)]
struct Table {
    study: &'static str,
    rows: Vec<Row>,
}

/// What other libraries' optimisers reach at the same budget; `benches/peers/run.py` writes it.
const PEERS: &str = include_str!("../../../benches/results/peers.csv");

/// The best median of other libraries on a problem, by optimiser: the largest hypervolume, or the least error of one
/// objective.
fn best_peer(problem: &str, single: bool) -> Option<(&'static str, f64)> {
    let rows = PEERS.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let medians = rows
        .filter(|cells| cells.get(1) == Some(&problem))
        .filter_map(|cells| Some((*cells.get(2)?, cells.get(5)?.parse::<f64>().ok()?)));
    let sign = if single { 1.0 } else { -1.0 };
    medians.min_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1)))
}

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    let names = SUITES.map(|(_, names)| names).concat();
    let algorithms = [MULTI_OBJECTIVE.as_slice(), &SINGLE_OBJECTIVE].concat();
    check("--problems", &arguments.problems, &names)?;
    check("--algorithms", &arguments.algorithms, &algorithms)?;
    let wanted = |chosen: &[String], name: &str| chosen.is_empty() || chosen.iter().any(|c| c == name);
    let keeping = arguments.kept.begin("bench optimisers", None)?;
    let mut rows = Vec::new();
    let mut fronts = String::from("problem,algorithm,seed,hypervolume,f1,f2,f3\n");
    if let Some(path) = &arguments.fronts {
        // A file that cannot be written is refused before hours of runs.
        write_whole(path, fronts.as_bytes())?;
    }
    outln!("medians and interquartile ranges of {} seeds", arguments.seeds);
    outln!("{}", line_of(COLUMNS, None));
    for problem in names
        .into_iter()
        .filter(|n| wanted(&arguments.problems, n))
        .filter_map(SuiteProblem::by_name)
        .filter(|p| wanted(&arguments.suites, p.suite()))
        .filter(|p| wanted(arguments.half.as_slice(), p.half().name()))
    {
        let single = problem.problem().objectives.len() == 1;
        let algorithms = if single {
            SINGLE_OBJECTIVE.as_slice()
        } else {
            &MULTI_OBJECTIVE
        };
        for algorithm in algorithms.iter().filter(|a| wanted(&arguments.algorithms, a)) {
            let evaluations = arguments.evaluations.map(|n| n as usize);
            let scores = compare(algorithm, &problem, arguments.seeds, evaluations)?;
            if arguments.fronts.is_some() && !single {
                add_fronts(&mut fronts, problem.name(), algorithm, &scores);
            }
            let row = row_of(&problem, algorithm, &scores);
            outln!("{}", line_of(COLUMNS, Some(&row)));
            rows.push(row);
        }
    }
    if let Some(path) = &arguments.fronts {
        write_whole(path, fronts.as_bytes())?;
    }
    let table = Table {
        study: "bench optimisers",
        rows,
    };
    keeping.finish(&table, ["cpu"], |folder| of_optimisers(folder, &table.rows))
}

/// A line for each member of each front.
fn add_fronts(text: &mut String, problem: &str, algorithm: &str, scores: &[Score]) {
    for (i, score) in scores.iter().enumerate() {
        for row in &score.front {
            let third = row.get(2).map_or(String::new(), f64::to_string);
            // Writing to a string does not fail.
            let _ = writeln!(
                text,
                "{problem},{algorithm},{},{},{},{},{third}",
                i + 1,
                score.quality,
                row[0],
                row[1]
            );
        }
    }
}

fn check(flag: &str, chosen: &[String], known: &[&str]) -> Result<()> {
    match chosen.iter().find(|c| !known.contains(&c.as_str())) {
        Some(name) => Err(Error::input(flag, "name", name, known.join(", "))),
        None => Ok(()),
    }
}

fn row_of(problem: &SuiteProblem, algorithm: &'static str, scores: &[Score]) -> Row {
    let values: Vec<f64> = scores.iter().map(|s| s.quality).collect();
    let distances: Vec<f64> = scores.iter().filter_map(|s| s.igd_plus).collect();
    let [low, median, high] = quartiles(&values);
    let single = problem.problem().objectives.len() == 1;
    let peer = best_peer(problem.name(), single);
    let better_than_peer_p = peer.and_then(|(_, figure)| {
        if single {
            let negated: Vec<f64> = values.iter().map(|x| -x).collect();
            signed_rank(&negated, -figure)
        } else {
            signed_rank(&values, figure)
        }
    });
    Row {
        suite: problem.suite(),
        half: problem.half(),
        problem: problem.name(),
        algorithm,
        seeds: scores.len() as u64,
        feasible_seeds: scores.iter().filter(|s| !s.front.is_empty()).count() as u64,
        hypervolume_median: (!single).then_some(median),
        hypervolume_iqr: (!single).then_some(high - low),
        igd_plus_median: (!distances.is_empty()).then(|| quartiles(&distances)[1]),
        error_median: single.then_some(median),
        error_iqr: single.then_some(high - low),
        best_peer: peer.map(|p| p.1),
        best_peer_name: peer.map(|p| p.0),
        better_than_peer_p,
    }
}

/// The table on a terminal.
const COLUMNS: &Columns<Row> = &[
    ("problem", -20, |r| r.problem.to_owned()),
    ("half", -11, |r| r.half.name().to_owned()),
    ("algorithm", -18, |r| r.algorithm.to_owned()),
    ("hypervolume", 12, |r| fixed(r.hypervolume_median)),
    ("IQR", 10, |r| short(r.hypervolume_iqr)),
    ("IGD+", 10, |r| fixed(r.igd_plus_median)),
    ("error", 12, |r| short(r.error_median)),
    ("IQR", 10, |r| short(r.error_iqr)),
    ("best peer", 12, |r| match r.hypervolume_median {
        Some(_) => fixed(r.best_peer),
        None => short(r.best_peer),
    }),
    (" ", -13, |r| format!(" {}", r.best_peer_name.unwrap_or(""))),
    ("p", 10, |r| short(r.better_than_peer_p)),
];

fn fixed(x: Option<f64>) -> String {
    x.map_or(String::new(), |x| format!("{x:.4}"))
}

fn short(x: Option<f64>) -> String {
    x.map_or(String::new(), |x| format!("{x:.1e}"))
}
