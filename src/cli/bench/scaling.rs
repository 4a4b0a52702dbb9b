//! `lapswarm bench`: evaluations per second against population on every backend.

use super::machine::{forget_peak_memory, peak_memory_bytes, peak_operations_per_s};
use super::pages::{of_scaling, rates};
use crate::cli::backend_flag;
use crate::cli::measurement::{MeasurementFlags, distinct};
use crate::cli::output::{Columns, line_of, outln};
use clap::builder::PossibleValuesParser;
use lapswarm::config::read_text;
use lapswarm::evaluate::drive::DriveProblem;
use lapswarm::evaluate::energy::{Free, HybridObjective, HybridProblem, Strategy};
use lapswarm::evaluate::gpu::{GpuContext, devices};
use lapswarm::evaluate::line::{LineObjective, LineProblem};
use lapswarm::evaluate::replay::ReplayProblem;
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::steady::{SteadyObjective, SteadyProblem};
use lapswarm::evaluate::{BackendChoice, CpuBackend, Evaluator, GpuBackend, OnDevice, Problem, SimdBackend};
use lapswarm::line::Parametrisation;
use lapswarm::line::energy::{Gates, Mode};
use lapswarm::parity;
use lapswarm::random::Random;
use lapswarm::report::Figure;
use lapswarm::scalar::{Counted, operations_of};
use lapswarm::study::identify::{IdentifySettings, ObjectiveChoice, set_up};
use lapswarm::study::raceline::{self, RacelineSettings};
use lapswarm::vehicle::Car;
use lapswarm::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Flags of `bench` itself.
#[derive(clap::Args)]
// They stand beside those of the subcommands, whose struct has the same name.
#[group(skip)]
pub struct Arguments {
    /// Problems: replay (the bundled lap, 22 unknowns), line (lap time, 360 cross-sections, 90 control points), drive (set-ups driven
    /// round a stadium of 840 m by the driver), steady (set-ups that settle on circles), energy (strategies of a hybrid on one line)
    #[arg(long, value_delimiter = ',', default_value = "replay,line",
          value_parser = PossibleValuesParser::new(problems::<Rates<'_>>().map(|(name, _)| name)))]
    problems: Vec<String>,
    /// Populations to measure
    #[arg(long, value_delimiter = ',', default_value = "64,256,1024,4096,16384",
          value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    populations: Vec<u32>,
    /// Leave out what would take longer than this, s, by the rate of the population before
    #[arg(long, value_name = "S", default_value_t = 20.0)]
    longest_s: f64,
    /// Only this backend [default: all there are]
    #[arg(long, value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long)]
    adapter: Option<String>,
    /// Draw the rates into this SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// What `bench --json` printed on another machine, to lay beside this one
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    #[command(flatten)]
    kept: MeasurementFlags,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Row {
    pub(super) problem: String,
    pub(super) backend: String,
    pub(super) adapter: String,
    pub(super) population: usize,
    pub(super) evaluations_per_s: f64,
    pub(super) particle_steps_per_s: Option<f64>,
    pub(super) kernel_ms: Option<f64>,
    pub(super) generation_ms: f64,
    /// Share of what the cores' lanes can do at best; `None` for devices, whose best is not measured.
    pub(super) arithmetic_peak_share: Option<f64>,
    /// Memory of the whole process at its greatest while it evaluated, MiB.
    pub(super) peak_memory_mib: Option<f64>,
}

#[derive(Serialize, Deserialize)]
pub(super) struct Table {
    pub(super) study: String,
    pub(super) seed: u64,
    pub(super) backend: String,
    pub(super) adapter: Option<String>,
    pub(super) elapsed_s: f64,
    pub(super) evaluations: u64,
    pub(super) evaluations_per_s: f64,
    pub(super) threads: usize,
    pub(super) rows: Vec<Row>,
}

impl Table {
    /// The row of the same problem, backend and population.
    pub(super) fn like(&self, row: &Row) -> Option<&Row> {
        let key = |r: &Row| (r.problem.clone(), r.backend.clone(), r.population);
        self.rows.iter().find(|r| key(r) == key(row))
    }
}

/// Purpose of the draws of candidates in the counter.
const CANDIDATES: u32 = 0xbe0c;
/// Cars lie within this share of the truth, so that all of them drive and none ends early.
const SPREAD: f64 = 0.02;
/// Cross-sections of the circuit that lines are driven on, and that energy is deployed on.
const SECTIONS: usize = 360;
/// Energy that fronts may deploy in a lap, MJ.
const DEPLOYED_MJ: f64 = 4.0;

/// A problem with what is known of its arithmetic.
pub(super) struct Case<K> {
    pub(super) kind: K,
    /// Candidates are drawn this far about these, each variable on its own.
    pub(super) about: Vec<(f64, f64)>,
    /// Runge-Kutta steps of an evaluation, if it has any.
    steps: Option<usize>,
    /// Arithmetic operations of an evaluation.
    operations: u64,
}

/// What measures problems.
pub(super) trait Bench {
    /// What lines are measured by.
    const LINE_OBJECTIVES: &'static [LineObjective];
    /// Whether problems are measured by two or three objectives; else by as many as they have.
    const FRONTS: bool = false;

    /// Measures a problem with every population.
    fn measure_all<K: OnDevice>(&mut self, name: &'static str, case: &Case<K>) -> Result<()>;
}

/// A problem's name, and how it is measured.
pub(super) type Measured<B> = (&'static str, fn(&mut B) -> Result<()>);

/// The problems.
pub(super) fn problems<B: Bench>() -> [Measured<B>; 5] {
    [
        ("replay", |bench| bench.measure_all("replay", &replay(B::FRONTS)?)),
        ("line", |bench| {
            bench.measure_all("line", &line(B::LINE_OBJECTIVES)?)
        }),
        ("drive", |bench| bench.measure_all("drive", &drive()?)),
        ("steady", |bench| bench.measure_all("steady", &steady(B::FRONTS)?)),
        ("energy", |bench| bench.measure_all("energy", &energy(B::FRONTS)?)),
    ]
}

/// Measures the problems of these names.
pub(super) fn measure_named<B: Bench>(bench: &mut B, names: &[String]) -> Result<()> {
    let wanted = |name: &String| problems::<B>().into_iter().find(|(known, _)| known == name);
    names
        .iter()
        .filter_map(wanted)
        .try_for_each(|(_, measure)| measure(bench))
}

/// The circuit that set-ups are driven round, with this share of the car's friction in steps of so many seconds.
const DRIVEN: (&str, f64, f64) = ("stadium:200:70:14", 0.6, 2e-3);

/// Every value, and how far candidates are off it.
fn spread(values: &[f64]) -> Vec<(f64, f64)> {
    values.iter().map(|x| (*x, SPREAD * x.abs())).collect()
}

/// The middle of the bounds.
fn middle(problem: &Problem) -> Vec<f64> {
    let variables = problem.variables.iter();
    variables.map(|v| 0.5 * (v.lower + v.upper)).collect()
}

pub(super) fn replay(front: bool) -> Result<Case<ReplayProblem>> {
    let mut settings = IdentifySettings::default();
    if front {
        settings.objectives = [0, 2, 3].map(ObjectiveChoice::Channel).to_vec();
    }
    let replay = set_up(&settings)?.replay;
    let (steps, operations) = parity::laps::work_of(&replay);
    Ok(Case {
        about: spread(&replay.free.values_in(replay.free.base())),
        steps: Some(steps),
        operations,
        kind: replay,
    })
}

pub(super) fn line(objectives: &[LineObjective]) -> Result<Case<LineProblem>> {
    let setup = raceline::set_up(&RacelineSettings {
        sections: Some(SECTIONS),
        ..RacelineSettings::default()
    })?;
    let way = Parametrisation::control_points(SECTIONS / 4);
    let line = LineProblem::new(setup.cross_sections, way, objectives, Some(setup.car), 0.0)?;
    let dimensions = line.dimensions();
    Ok(Case {
        about: vec![(0.5, 0.3); dimensions],
        steps: None,
        operations: parity::lines::work_of(&line),
        kind: line,
    })
}

pub(super) fn drive() -> Result<Case<DriveProblem>> {
    let (circuit, pace, step) = DRIVEN;
    let drive = parity::drive::problem(Car::bundled()?, &[circuit], &[pace], step)?;
    let middle = middle(&drive.problem);
    let (steps, operations) = parity::drive::work_of_a_lap(&drive, &middle);
    Ok(Case {
        about: spread(&middle),
        steps: Some(steps),
        operations,
        kind: drive,
    })
}

pub(super) fn steady(front: bool) -> Result<Case<SteadyProblem>> {
    let objectives = if front {
        &SteadyObjective::ALL[..3]
    } else {
        &SteadyObjective::ALL[..]
    };
    let steady = parity::steady::problem_by(Car::bundled()?, objectives)?;
    let middle = middle(&steady.problem);
    Ok(Case {
        about: spread(&middle),
        steps: Some(steady.plan().steps as usize),
        operations: parity::steady::work_of(&steady, &middle),
        kind: steady,
    })
}

pub(super) fn energy(front: bool) -> Result<Case<HybridProblem>> {
    let mut problems = parity::energy::problems(SECTIONS, &[Mode::Additional], false, false)?;
    let mut hybrid = problems.remove(0);
    if front {
        // As the study searches for a front: shares of zones, without gates.
        let zones = hybrid.energy().count();
        let strategy = Strategy {
            free: (0..zones).map(Free::Zone).collect(),
            ..Strategy::fixed(Gates::of_zones(DEPLOYED_MJ), zones)
        };
        let (line, car, plan) = (
            hybrid.line().clone(),
            hybrid.car().clone(),
            hybrid.energy().clone(),
        );
        hybrid = HybridProblem::new(line, car, plan, strategy, &HybridObjective::ALL[..3], 30.0)?;
    }
    let middle = middle(&hybrid.problem);
    Ok(Case {
        about: spread(&middle),
        steps: None,
        operations: operations_of(|| {
            hybrid.lap_in::<Counted>(&middle);
        }),
        kind: hybrid,
    })
}

impl<K: OnDevice> Case<K> {
    pub(super) fn candidates(&self, count: usize) -> Vec<f64> {
        let random = Random::new(1);
        let mut all = Vec::with_capacity(count * self.about.len());
        for i in 0..count as u32 {
            let draws = self.about.iter().zip(&self.kind.problem().variables).zip(0..);
            all.extend(draws.map(|(((middle, reach), variable), k)| {
                let off = 2.0 * random.uniform(CANDIDATES, 0, i, k) - 1.0;
                (middle + reach * off).clamp(variable.lower, variable.upper)
            }));
        }
        all
    }

    /// Evaluators of the backends that are asked for.
    pub(super) fn evaluators(
        &self,
        choice: BackendChoice,
        adapter: Option<&str>,
    ) -> Result<Vec<Box<dyn Evaluator + '_>>> {
        let wanted = |backend| choice == backend || choice == BackendChoice::Auto;
        let mut found: Vec<Box<dyn Evaluator + '_>> = Vec::new();
        if wanted(BackendChoice::Cpu) {
            found.push(Box::new(CpuBackend::new(&self.kind)));
        }
        if wanted(BackendChoice::Simd) {
            found.push(Box::new(SimdBackend::new(&self.kind, InstructionSet::best())));
        }
        let asked = choice == BackendChoice::Gpu || adapter.is_some();
        if asked || (wanted(BackendChoice::Gpu) && !devices().is_empty()) {
            let context = GpuContext::shared(adapter)?;
            found.push(Box::new(GpuBackend::new(&self.kind, context)?));
        }
        Ok(found)
    }
}

/// The table on a terminal.
const COLUMNS: &Columns<Row> = &[
    ("problem", -8, |r| r.problem.clone()),
    ("backend", -8, |r| r.backend.clone()),
    ("particles", 10, |r| r.population.to_string()),
    ("evaluations/s", 15, |r| format!("{:.1}", r.evaluations_per_s)),
    ("million steps", 14, |r| {
        or_dash(r.particle_steps_per_s.map(|s| format!("{:.3}", s / 1e6)))
    }),
    ("ms", 12, |r| format!("{:.1}", r.generation_ms)),
    ("kernel ms", 10, |r| {
        or_dash(r.kernel_ms.map(|ms| format!("{ms:.1}")))
    }),
    ("peak", 8, |r| {
        or_dash(r.arithmetic_peak_share.map(|s| format!("{:.0}%", 100.0 * s)))
    }),
    ("MiB", 10, |r| {
        or_dash(r.peak_memory_mib.map(|m| format!("{m:.0}")))
    }),
];

pub(super) fn or_dash(text: Option<String>) -> String {
    text.unwrap_or("-".to_owned())
}

/// What has been measured so far.
struct Rates<'a> {
    arguments: &'a Arguments,
    /// What another machine had.
    other: Option<Table>,
    /// Operations per second at best.
    peak: f64,
    rows: Vec<Row>,
}

impl Bench for Rates<'_> {
    const LINE_OBJECTIVES: &'static [LineObjective] = &[LineObjective::LapTime];

    /// On every backend.
    fn measure_all<K: OnDevice>(&mut self, name: &'static str, case: &Case<K>) -> Result<()> {
        let choice = self.arguments.backend.unwrap_or_default();
        for mut evaluator in case.evaluators(choice, self.arguments.adapter.as_deref())? {
            let mut rate: Option<f64> = None;
            for &population in &self.arguments.populations {
                let population = population as usize;
                if rate.is_some_and(|rate| population as f64 / rate > self.arguments.longest_s) {
                    continue;
                }
                let row = self.measure(name, case, evaluator.as_mut(), population)?;
                rate = Some(row.evaluations_per_s);
                self.print(&row);
                self.rows.push(row);
            }
        }
        Ok(())
    }
}

impl Rates<'_> {
    fn measure<K: OnDevice>(
        &self,
        name: &str,
        case: &Case<K>,
        evaluator: &mut dyn Evaluator,
        population: usize,
    ) -> Result<Row> {
        let candidates = case.candidates(population);
        // The first call compiles kernels and fills caches.
        let few = population.min(64) * case.about.len();
        evaluator.evaluate(&candidates[..few])?;
        forget_peak_memory();
        let began = Instant::now();
        evaluator.evaluate(&candidates)?;
        let seconds = began.elapsed().as_secs_f64();
        let peak_memory_mib = peak_memory_bytes().map(|b| b as f64 / (1 << 20) as f64);
        let info = evaluator.backend();
        let rate = population as f64 / seconds;
        let share = rate * case.operations as f64 / self.peak;
        Ok(Row {
            problem: name.to_owned(),
            backend: info.backend.to_owned(),
            adapter: info.device,
            population,
            evaluations_per_s: rate,
            particle_steps_per_s: case.steps.map(|s| rate * s as f64),
            kernel_ms: evaluator.last_kernel_ms(),
            generation_ms: seconds * 1e3,
            arithmetic_peak_share: (info.backend == "simd").then_some(share),
            peak_memory_mib,
        })
    }

    fn print(&self, row: &Row) {
        let ratio = self.other.as_ref().map_or(String::new(), |table| {
            table.like(row).map_or("   -".to_owned(), |r| {
                let times = row.evaluations_per_s / r.evaluations_per_s;
                format!("   {times:.2}  {}", r.adapter)
            })
        });
        outln!("{}{ratio}   {}", line_of(COLUMNS, Some(row)), row.adapter);
    }
}

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    let other = arguments.against.as_deref().map(read_table).transpose()?;
    let keeping = arguments.kept.begin("bench", arguments.adapter.as_deref())?;
    let began = Instant::now();
    let threads = rayon::current_num_threads();
    let peak = threads as f64 * peak_operations_per_s(InstructionSet::best());
    outln!(
        "{threads} threads, {:.0} billion unfused {} operations per second at best",
        peak / 1e9,
        InstructionSet::best().name()
    );
    let times = if other.is_some() { "   times the other" } else { "" };
    outln!("{}{times}", line_of(COLUMNS, None));
    let mut bench = Rates {
        arguments,
        other,
        peak,
        rows: Vec::new(),
    };
    measure_named(&mut bench, &arguments.problems)?;
    let Rates { other, rows, .. } = bench;
    let evaluations = rows.iter().map(|r| r.population as u64).sum();
    let elapsed_s = began.elapsed().as_secs_f64();
    let gpu = rows.iter().find(|r| r.backend == "gpu");
    let table = Table {
        study: "bench".to_owned(),
        seed: 1,
        backend: distinct(rows.iter().map(|r| r.backend.as_str())).join(", "),
        adapter: gpu.map(|r| r.adapter.clone()),
        elapsed_s,
        evaluations,
        evaluations_per_s: evaluations as f64 / elapsed_s,
        threads,
        rows,
    };
    if let Some(path) = &arguments.plot {
        rates(&table.rows).write_svg(path)?;
    }
    let backends = table.rows.iter().map(|r| r.backend.as_str());
    keeping.finish(&table, backends, |folder| {
        of_scaling(folder, &table, other.as_ref())
    })
}

fn read_table(path: &Path) -> Result<Table> {
    let text = read_text(path)?;
    // A redirected run may have its table above the JSON, which is the last line.
    let last = text.lines().rev().find(|l| !l.trim().is_empty()).unwrap_or("");
    serde_json::from_str(last)
        .or_else(|_| serde_json::from_str(&text))
        .map_err(|e| {
            Error::input(
                path,
                "--against",
                e.to_string(),
                "what `lapswarm bench --json` printed",
            )
        })
}
