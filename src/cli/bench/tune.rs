//! `lapswarm bench tune`: how kernels are best dispatched on the adapter at hand.

use super::pages::of_tune;
use super::scaling::{Bench, Case, measure_named, problems};
use crate::cli::measurement::MeasurementFlags;
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
    after_help = "Tries workgroups of 32 to 256 lanes, and lanes in a dispatch. The best over the problems is remembered for the \
                  adapter with its driver in the user's cache folder, and used from then on. No result depends on it: a setting that \
                  changed a bit here is not chosen."
)]
pub struct Arguments {
    /// Problems: those of `bench`
    #[arg(long, value_delimiter = ',', default_value = "replay,line,energy,drive,steady",
          value_parser = PossibleValuesParser::new(problems::<Trials<'_>>().map(|(name, _)| name)))]
    problems: Vec<String>,
    /// The most particles of an evaluation
    #[arg(long, default_value_t = 1 << 20, value_parser = clap::value_parser!(u32).range(64..=4_194_304))]
    population: u32,
    /// Take fewer particles where they fill the device and an evaluation with the usual settings would take longer than this, s
    #[arg(long, value_name = "S", default_value_t = 0.5)]
    longest_s: f64,
    /// Part of the name of the GPU to tune
    #[arg(long)]
    adapter: Option<String>,
    #[command(flatten)]
    kept: MeasurementFlags,
}

/// One setting on one problem.
#[derive(Serialize)]
pub(super) struct Row {
    pub(super) problem: &'static str,
    pub(super) workgroup: u32,
    pub(super) lanes: usize,
    pub(super) population: usize,
    /// Time of the kernels of an evaluation, the least of the repetitions.
    pub(super) kernel_ms: f64,
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
    lanes: usize,
    /// Geometric mean over the problems.
    times_usual: f64,
    file: String,
}

const COLUMNS: &Columns<Row> = &[
    ("problem", -8, |r| r.problem.to_owned()),
    ("workgroup", 9, |r| r.workgroup.to_string()),
    ("lanes", 9, |r| r.lanes.to_string()),
    ("particles", 10, |r| r.population.to_string()),
    ("kernel ms", 10, |r| format!("{:.2}", r.kernel_ms)),
    ("times usual", 12, |r| format!("{:.3}", r.times_usual)),
    ("bits", 8, |r| {
        if r.same_bits { "same" } else { "others" }.to_owned()
    }),
];

/// Evaluations of a setting and of the usual one, of which the fastest count.
const REPETITIONS: usize = 3;
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
        let most = self.arguments.population as usize;
        let longest_ms = 1e3 * self.arguments.longest_s;
        let mut population = most.min(64);
        let mut candidates = case.candidates(population);
        usual.evaluate(&candidates)?;
        let mut timing = Timed::of(&mut usual, &candidates)?;
        while population < most {
            let more = (4 * population).min(most);
            let others = case.candidates(more);
            let of_more = Timed::of(&mut usual, &others)?;
            // A device that is not full takes hardly longer for more.
            let full = of_more.whole_ms > 2.0 * timing.whole_ms;
            if full && of_more.whole_ms > longest_ms {
                break;
            }
            (population, candidates, timing) = (more, others, of_more);
        }
        // As fresh as those that it is compared with.
        usual = open(Tuning::usual(self.kind))?;
        usual.evaluate(&candidates)?;
        let bits = |row: &[f64]| row.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        for tuning in Tuning::all(self.kind) {
            let mut evaluator = open(tuning)?;
            evaluator.evaluate(&candidates)?;
            let (mut usual_ms, mut kernel_ms) = (f64::INFINITY, f64::INFINITY);
            let mut same_bits = true;
            // By turns, so that other work on the machine holds up both.
            for _ in 0..REPETITIONS {
                usual_ms = usual_ms.min(Timed::of(&mut usual, &candidates)?.kernel_ms);
                let found = Timed::of(&mut evaluator, &candidates)?;
                kernel_ms = kernel_ms.min(found.kernel_ms);
                same_bits &= bits(&found.objectives) == bits(&timing.objectives);
            }
            let row = Row {
                problem: name,
                workgroup: tuning.workgroup,
                lanes: tuning.lanes,
                population,
                kernel_ms,
                times_usual: usual_ms / kernel_ms,
                same_bits,
            };
            outln!("{}", line_of(COLUMNS, Some(&row)));
            self.rows.push(row);
        }
        Ok(())
    }
}

/// An evaluation and the time that it took.
struct Timed {
    whole_ms: f64,
    kernel_ms: f64,
    objectives: Vec<f64>,
}

impl Timed {
    fn of(evaluator: &mut dyn Evaluator, candidates: &[f64]) -> Result<Self> {
        let began = Instant::now();
        let objectives = evaluator.evaluate(candidates)?.objectives;
        let whole_ms = began.elapsed().as_secs_f64() * 1e3;
        Ok(Self {
            whole_ms,
            kernel_ms: evaluator.last_kernel_ms().unwrap_or(whole_ms),
            objectives,
        })
    }
}

/// The setting that is the fastest over all problems, and by how much.
fn best(kind: DeviceKind, rows: &[Row]) -> (Tuning, f64) {
    let mut best = (Tuning::usual(kind), 1.0);
    for tuning in Tuning::all(kind) {
        let own = rows
            .iter()
            .filter(|r| (r.workgroup, r.lanes) == (tuning.workgroup, tuning.lanes));
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
    outln!("{summary}");
    outln!("{}", line_of(COLUMNS, None));
    let mut trials = Trials {
        arguments,
        kind: summary.kind,
        rows: Vec::new(),
    };
    measure_named(&mut trials, &arguments.problems)?;
    let (tuning, times_usual) = best(summary.kind, &trials.rows);
    let file = tuning.remember(&summary)?.display().to_string();
    let told = format!(
        "Remembered in {file}: workgroups of {}, {} lanes, {times_usual:.2} times as fast as usual.",
        tuning.workgroup, tuning.lanes
    );
    outln!("{told}");
    let table = Table {
        study: "bench tune",
        adapter: summary.to_string(),
        best: Best {
            workgroup: tuning.workgroup,
            lanes: tuning.lanes,
            times_usual,
            file,
        },
        rows: trials.rows,
    };
    keeping.finish(&table, ["gpu"], |folder| of_tune(folder, &table.rows, told))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(tuning: Tuning, times_usual: f64, same_bits: bool) -> Row {
        Row {
            problem: "line",
            workgroup: tuning.workgroup,
            lanes: tuning.lanes,
            population: 64,
            kernel_ms: 1.0,
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
