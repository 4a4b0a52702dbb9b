//! `lapswarm bench tune`: how kernels are best compiled and dispatched on the adapter at hand.

use super::pages::of_tune;
use super::scaling::{Bench, Case, measure_named, problems};
use crate::cli::measurement::FolderFlag;
use crate::cli::output::{Columns, line_of, outln};
use clap::builder::PossibleValuesParser;
use lapswarm::evaluate::gpu::{DeviceKind, GpuContext, Tuning};
use lapswarm::evaluate::line::LineObjective;
use lapswarm::evaluate::{Evaluator, GpuBackend, OnDevice};
use lapswarm::{Error, Result};
use serde::Serialize;
use std::time::Instant;

/// Flags of `bench tune`.
#[derive(clap::Args)]
#[command(
    after_help = "Tries workgroups of 32 to 256 lanes, loops with and without wgpu's own bound, and lanes in a dispatch. The best over \
                  the problems is remembered for the adapter with its driver in the user's cache folder, and used from then on. No \
                  result depends on it: a setting that changed a bit here is not chosen."
)]
pub struct Arguments {
    /// Problems: those of `bench`
    #[arg(long, value_delimiter = ',', default_value = "replay,line,energy,drive,steady",
          value_parser = PossibleValuesParser::new(problems::<Trials<'_>>().map(|(name, _)| name)))]
    problems: Vec<String>,
    /// The most particles of an evaluation
    #[arg(long, default_value_t = 1 << 20, value_parser = clap::value_parser!(u32).range(64..=4_194_304))]
    population: u32,
    /// Take fewer particles where an evaluation with the usual settings would take longer than this, s
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    longest_s: f64,
    /// Part of the name of the GPU to tune
    #[arg(long)]
    adapter: Option<String>,
    #[command(flatten)]
    kept: FolderFlag,
}

/// One setting on one problem.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) problem: &'static str,
    pub(super) workgroup: u32,
    pub(super) bounded_loops: bool,
    pub(super) lanes: usize,
    pub(super) population: usize,
    /// The least of the repetitions.
    pub(super) evaluation_ms: f64,
    /// How many times as fast as with the usual settings, measured by turns.
    pub(super) times_usual: f64,
    /// Whether all objectives have the bits that the usual settings give.
    pub(super) same_bits: bool,
}

#[derive(Serialize)]
struct Table {
    study: &'static str,
    adapter: String,
    rows: Vec<Row>,
    best: Best,
}

/// What is remembered.
#[derive(Serialize)]
struct Best {
    workgroup: u32,
    bounded_loops: bool,
    lanes: usize,
    /// Geometric mean over the problems.
    times_usual: f64,
    file: String,
}

const COLUMNS: &Columns<Row> = &[
    ("problem", -8, |r| r.problem.to_owned()),
    ("workgroup", 9, |r| r.workgroup.to_string()),
    ("loops", 10, |r| {
        if r.bounded_loops { "bounded" } else { "trusted" }.to_owned()
    }),
    ("lanes", 9, |r| r.lanes.to_string()),
    ("particles", 10, |r| r.population.to_string()),
    ("ms", 10, |r| format!("{:.2}", r.evaluation_ms)),
    ("times usual", 12, |r| format!("{:.3}", r.times_usual)),
    ("bits", 8, |r| {
        if r.same_bits { "same" } else { "others" }.to_owned()
    }),
];

/// Evaluations of a setting and of the usual one, of which the fastest count.
const REPETITIONS: usize = 5;
/// What a setting must gain over the usual one to take its place: less may be chance.
const GAIN: f64 = 1.05;

/// What has been measured so far.
struct Trials<'a> {
    arguments: &'a Arguments,
    kind: DeviceKind,
    rows: Vec<Row>,
}

impl Bench for Trials<'_> {
    const LINE_OBJECTIVES: &'static [LineObjective] = &[LineObjective::LapTime];

    fn measure_all<K: OnDevice>(&mut self, name: &'static str, case: &Case<K>) -> Result<()> {
        let adapter = self.arguments.adapter.as_deref();
        let open = |tuning| GpuBackend::new(&case.kind, GpuContext::with_tuning(adapter, tuning)?);
        let mut usual = open(Tuning::usual(self.kind))?;
        // As many as take so long, by the rate of the fewer before.
        let most = self.arguments.population as usize;
        let mut population = 64;
        let mut candidates = case.candidates(population);
        usual.evaluate(&candidates)?;
        loop {
            let (took_ms, _) = timed(&mut usual, &candidates)?;
            let fitting = (population as f64 * 1e3 * self.arguments.longest_s / took_ms) as usize;
            if population >= most || fitting < 2 * population {
                break;
            }
            population = fitting.min(16 * population).min(most);
            candidates = case.candidates(population);
        }
        let (_, expected) = timed(&mut usual, &candidates)?;
        let bits = |row: &[f64]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for tuning in Tuning::all(self.kind) {
            let mut evaluator = open(tuning)?;
            evaluator.evaluate(&candidates)?;
            let (mut usual_ms, mut evaluation_ms) = (f64::INFINITY, f64::INFINITY);
            let mut same_bits = true;
            // By turns, so that other work on the machine holds up both.
            for _ in 0..REPETITIONS {
                usual_ms = usual_ms.min(timed(&mut usual, &candidates)?.0);
                let (ms, objectives) = timed(&mut evaluator, &candidates)?;
                evaluation_ms = evaluation_ms.min(ms);
                same_bits &= bits(&objectives) == bits(&expected);
            }
            let row = Row {
                problem: name,
                workgroup: tuning.workgroup,
                bounded_loops: tuning.bounded_loops,
                lanes: tuning.lanes,
                population,
                evaluation_ms,
                times_usual: usual_ms / evaluation_ms,
                same_bits,
            };
            if !self.arguments.kept.json {
                outln!("{}", line_of(COLUMNS, Some(&row)));
            }
            self.rows.push(row);
        }
        Ok(())
    }
}

/// The time of an evaluation (ms), and its objectives.
fn timed(evaluator: &mut dyn Evaluator, candidates: &[f64]) -> Result<(f64, Vec<f64>)> {
    let began = Instant::now();
    let objectives = evaluator.evaluate(candidates)?.objectives;
    Ok((began.elapsed().as_secs_f64() * 1e3, objectives))
}

/// The setting that is the fastest over all problems, and by how much.
fn best(kind: DeviceKind, rows: &[Row]) -> (Tuning, f64) {
    let mut best = (Tuning::usual(kind), 1.0);
    for tuning in Tuning::all(kind) {
        let own = rows.iter().filter(|r| {
            (r.workgroup, r.bounded_loops, r.lanes) == (tuning.workgroup, tuning.bounded_loops, tuning.lanes)
        });
        let own: Vec<&Row> = own.collect();
        let logs: f64 = own.iter().map(|r| r.times_usual.ln()).sum();
        let mean = (logs / own.len().max(1) as f64).exp();
        if own.iter().all(|r| r.same_bits) && mean > best.1 && mean > GAIN {
            best = (tuning, mean);
        }
    }
    best
}

/// Measures, prints and remembers.
pub fn run(arguments: &Arguments) -> Result<()> {
    let adapter = arguments.adapter.as_deref();
    if lapswarm::evaluate::gpu::asks_for_all(adapter) {
        return Err(Error::input(
            "--adapter",
            "adapter",
            "all",
            "one adapter at a time",
        ));
    }
    let keeping = arguments.kept.begin("bench tune", adapter)?;
    let summary = GpuContext::shared(adapter)?.summary().clone();
    // Its device closes before others open.
    GpuContext::forget();
    if !arguments.kept.json {
        outln!("{summary}");
        outln!("{}", line_of(COLUMNS, None));
    }
    let mut trials = Trials {
        arguments,
        kind: summary.kind,
        rows: Vec::new(),
    };
    measure_named(&mut trials, &arguments.problems)?;
    let (tuning, times_usual) = best(summary.kind, &trials.rows);
    let file = tuning.remember(&summary)?.display().to_string();
    let told = format!(
        "Remembered in {file}: workgroups of {}, {} loops, {} lanes, {times_usual:.2} times as fast as usual.",
        tuning.workgroup,
        if tuning.bounded_loops {
            "bounded"
        } else {
            "trusted"
        },
        tuning.lanes
    );
    if !arguments.kept.json {
        outln!("{told}");
    }
    let table = Table {
        study: "bench tune",
        adapter: summary.to_string(),
        best: Best {
            workgroup: tuning.workgroup,
            bounded_loops: tuning.bounded_loops,
            lanes: tuning.lanes,
            times_usual,
            file,
        },
        rows: trials.rows,
    };
    keeping.finish(!arguments.kept.json, &table, ["gpu"], |folder| {
        of_tune(folder, &table.rows, told)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(tuning: Tuning, times_usual: f64, same_bits: bool) -> Row {
        Row {
            problem: "line",
            workgroup: tuning.workgroup,
            bounded_loops: tuning.bounded_loops,
            lanes: tuning.lanes,
            population: 64,
            evaluation_ms: 1.0,
            times_usual,
            same_bits,
        }
    }

    #[test]
    fn the_usual_stays_unless_another_is_faster_over_all_problems_with_the_same_bits() {
        let kind = DeviceKind::Discrete;
        let all = Tuning::all(kind);
        let table = |times: [[f64; 2]; 3], same: bool| {
            let rows = all.iter().zip(times);
            let rows: Vec<Row> = rows
                .flat_map(|(tuning, times)| times.map(|t| row(*tuning, t, same || *tuning == all[0])))
                .collect();
            best(kind, &rows).0
        };
        assert_eq!(table([[1.0, 1.0], [1.04, 1.04], [0.5, 0.9]], true), all[0]);
        assert_eq!(table([[1.0, 1.0], [1.5, 1.2], [3.0, 0.5]], true), all[1]);
        assert_eq!(table([[1.0, 1.0], [1.5, 1.2], [3.0, 0.5]], false), all[0]);
    }
}
