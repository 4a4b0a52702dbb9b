//! `lapswarm bench`: evaluations per second against population on every backend.

use super::finish;
use super::machine::{forget_peak_memory, peak_memory_bytes, peak_operations_per_s};
use super::pages::{of_scaling, rates};
use crate::cli::backend_flag;
use crate::cli::measurement::Kept;
use crate::cli::output::outln;
use lapswarm::config::read_text;
use lapswarm::evaluate::drive::{CpuDriveEvaluator, DriveProblem, GpuDriveEvaluator, SimdDriveEvaluator};
use lapswarm::evaluate::gpu::{GpuContext, devices};
use lapswarm::evaluate::line::{
    CpuLineEvaluator, GpuLineEvaluator, LineObjective, LineProblem, SimdLineEvaluator,
};
use lapswarm::evaluate::replay::{BackendChoice, CpuEvaluator, GpuEvaluator, ReplayProblem, SimdEvaluator};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::steady::{
    CpuSteadyEvaluator, GpuSteadyEvaluator, SimdSteadyEvaluator, SteadyProblem,
};
use lapswarm::evaluate::{Evaluator, Problem};
use lapswarm::line::{Parametrisation, kernel};
use lapswarm::parity;
use lapswarm::random::Random;
use lapswarm::report::Figure;
use lapswarm::scalar::{Counted, operations_of};
use lapswarm::study::identify::{IdentifySettings, set_up};
use lapswarm::study::raceline::{self, RacelineSettings};
use lapswarm::vehicle::model::runge_kutta_step;
use lapswarm::vehicle::{Car, CarInput, CarModel, CarState, MagicFormula};
use lapswarm::{Error, Result};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Flags of `bench` itself.
#[derive(clap::Args)]
// They stand beside those of the subcommands, whose struct has the same name.
#[group(skip)]
pub struct Arguments {
    /// Problems: replay (the bundled lap, 22 unknowns), line (lap time, 360 cuts, 90 control points), drive (set-ups driven
    /// round a stadium of 840 m by the driver), steady (set-ups that settle on circles)
    #[arg(long, value_delimiter = ',', value_parser = ["replay", "line", "drive", "steady"], default_value = "replay,line")]
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
    kept: Kept,
    /// Print one JSON object as the last thing on stdout
    #[arg(long)]
    json: bool,
    /// No table
    #[arg(long)]
    quiet: bool,
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
/// Cuts of the circuit that lines are driven on.
const SECTIONS: usize = 360;

/// A problem with what is known of its arithmetic.
struct Case {
    name: &'static str,
    kind: Kind,
    /// Candidates are drawn this far about these, each variable on its own.
    about: Vec<(f64, f64)>,
    /// Runge-Kutta steps of an evaluation, if it has any.
    steps: Option<usize>,
    /// Arithmetic operations of an evaluation.
    operations: u64,
}

enum Kind {
    Replay(Box<ReplayProblem>),
    Line(Box<LineProblem>),
    Drive(Box<DriveProblem>),
    Steady(Box<SteadyProblem>),
}

/// The circuit that set-ups are driven round, with this share of the car's friction in steps of so many seconds.
const DRIVEN: (&str, f64, f64) = ("stadium:200:70:14", 0.6, 2e-3);

impl Case {
    fn replay() -> Result<Self> {
        let replay = set_up(&IdentifySettings::default())?.replay;
        let base = replay.free.base();
        let truth: Vec<f64> = replay.free.parameters.iter().map(|p| base[p.slots[0]]).collect();
        let samples: usize = replay.plan.windows.iter().map(|w| w.end - w.start - 1).sum();
        let steps = samples * replay.plan.fractions.len();
        let car = CarModel::<Counted, MagicFormula<Counted>>::from_parameters(|i| Counted(base[i] as f32));
        let window = &replay.plan.windows[0];
        let sample = &replay.plan.samples[window.start];
        let input = CarInput {
            wheel_speed: sample.wheel_speed.map(|x| Counted(x as f32)),
            steer: Counted(sample.steer as f32),
        };
        let state = CarState::from_array(window.initial.map(|x| Counted(x as f32)));
        let per_step = operations_of(|| {
            runge_kutta_step(&car, &state, |_| input, Counted(0.01), |_| {});
        });
        Ok(Self {
            name: "replay",
            about: truth.iter().map(|x| (*x, SPREAD * x.abs())).collect(),
            steps: Some(steps),
            operations: per_step * steps as u64,
            kind: Kind::Replay(Box::new(replay)),
        })
    }

    fn line() -> Result<Self> {
        let setup = raceline::set_up(&RacelineSettings {
            sections: SECTIONS,
            ..RacelineSettings::default()
        })?;
        let way = Parametrisation::control_points(SECTIONS / 4);
        let objectives = [LineObjective::LapTime];
        let line = LineProblem::new(setup.cuts, way, &objectives, Some(setup.car), 0.0)?;
        let dimensions = line.dimensions();
        let plan = line.plan().stored::<Counted>();
        let middle = vec![Counted(0.5); dimensions];
        let mut operations = 0;
        if let Some(limits) = line.limits() {
            let limits = limits.stored::<Counted>();
            operations = operations_of(|| {
                let mut course = kernel::Course::default();
                let wanted = kernel::Wanted {
                    integral: false,
                    lap: true,
                };
                kernel::shape(&plan, wanted, &middle, &mut course);
                kernel::lap_time(&limits, plan.closed, plan.start, Counted(plan.entry), &mut course);
            });
        }
        Ok(Self {
            name: "line",
            about: vec![(0.5, 0.3); dimensions],
            steps: None,
            operations,
            kind: Kind::Line(Box::new(line)),
        })
    }

    fn drive() -> Result<Self> {
        let (circuit, pace, step) = DRIVEN;
        let drive = parity::drive::problem(Car::bundled()?, &[circuit], &[pace], step)?;
        let middle: Vec<f64> = drive
            .problem
            .variables
            .iter()
            .map(|v| 0.5 * (v.lower + v.upper))
            .collect();
        let (steps, operations) = parity::drive::work_of_a_lap(&drive, &middle);
        Ok(Self {
            name: "drive",
            about: middle.iter().map(|x| (*x, SPREAD * x.abs())).collect(),
            steps: Some(steps),
            operations,
            kind: Kind::Drive(Box::new(drive)),
        })
    }

    fn steady() -> Result<Self> {
        let steady = parity::steady::problem(Car::bundled()?)?;
        let middle: Vec<f64> = steady
            .problem
            .variables
            .iter()
            .map(|v| 0.5 * (v.lower + v.upper))
            .collect();
        Ok(Self {
            name: "steady",
            about: middle.iter().map(|x| (*x, SPREAD * x.abs())).collect(),
            steps: Some(steady.plan().steps as usize),
            operations: parity::steady::work_of(&steady, &middle),
            kind: Kind::Steady(Box::new(steady)),
        })
    }

    fn problem(&self) -> &Problem {
        match &self.kind {
            Kind::Steady(steady) => &steady.problem,
            Kind::Drive(drive) => &drive.problem,
            Kind::Replay(replay) => &replay.problem,
            Kind::Line(line) => &line.problem,
        }
    }

    fn candidates(&self, count: usize) -> Vec<f64> {
        let random = Random::new(1);
        let mut all = Vec::with_capacity(count * self.about.len());
        for i in 0..count as u32 {
            let draws = self.about.iter().zip(&self.problem().variables).zip(0..);
            all.extend(draws.map(|(((middle, reach), variable), k)| {
                let off = 2.0 * random.uniform(CANDIDATES, 0, i, k) - 1.0;
                (middle + reach * off).clamp(variable.lower, variable.upper)
            }));
        }
        all
    }
}

/// A backend, and how long its kernels took where it can tell.
enum Backend<'a> {
    Any(Box<dyn Evaluator + 'a>),
    Replay(Box<GpuEvaluator<'a>>),
    Line(Box<GpuLineEvaluator<'a>>),
}

impl Backend<'_> {
    fn evaluator(&mut self) -> &mut dyn Evaluator {
        match self {
            Self::Any(evaluator) => evaluator.as_mut(),
            Self::Replay(evaluator) => evaluator.as_mut(),
            Self::Line(evaluator) => evaluator.as_mut(),
        }
    }

    fn kernel_ms(&self) -> Option<f64> {
        match self {
            Self::Replay(evaluator) => evaluator.last_kernel_ms(),
            _ => None,
        }
    }
}

fn backends<'a>(case: &'a Case, arguments: &Arguments) -> Result<Vec<Backend<'a>>> {
    let wanted = |choice| {
        let asked = arguments.backend.unwrap_or_default();
        asked == choice || asked == BackendChoice::Auto
    };
    let mut found: Vec<Backend<'a>> = Vec::new();
    if wanted(BackendChoice::Cpu) {
        found.push(Backend::Any(match &case.kind {
            Kind::Replay(replay) => Box::new(CpuEvaluator::new(replay)),
            Kind::Line(line) => Box::new(CpuLineEvaluator::new(line)),
            Kind::Drive(drive) => Box::new(CpuDriveEvaluator::new(drive)),
            Kind::Steady(steady) => Box::new(CpuSteadyEvaluator::new(steady)),
        }));
    }
    if wanted(BackendChoice::Simd) {
        let set = InstructionSet::best();
        found.push(Backend::Any(match &case.kind {
            Kind::Replay(replay) => Box::new(SimdEvaluator::new(replay, set)),
            Kind::Line(line) => Box::new(SimdLineEvaluator::new(line, set)),
            Kind::Drive(drive) => Box::new(SimdDriveEvaluator::new(drive, set)),
            Kind::Steady(steady) => Box::new(SimdSteadyEvaluator::new(steady, set)),
        }));
    }
    let asked = arguments.backend == Some(BackendChoice::Gpu) || arguments.adapter.is_some();
    if asked || (wanted(BackendChoice::Gpu) && !devices().is_empty()) {
        let context = GpuContext::shared(arguments.adapter.as_deref())?;
        found.push(match &case.kind {
            Kind::Replay(replay) => Backend::Replay(Box::new(GpuEvaluator::new(replay, context)?)),
            Kind::Line(line) => Backend::Line(Box::new(GpuLineEvaluator::new(line, context)?)),
            Kind::Drive(drive) => Backend::Any(Box::new(GpuDriveEvaluator::new(drive, context)?)),
            Kind::Steady(steady) => Backend::Any(Box::new(GpuSteadyEvaluator::new(steady, context)?)),
        });
    }
    Ok(found)
}

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    let other = arguments.against.as_deref().map(read_table).transpose()?;
    let folder = arguments.kept.folder("bench")?;
    let began = Instant::now();
    let threads = rayon::current_num_threads();
    let peak = threads as f64 * peak_operations_per_s(InstructionSet::best());
    let mut rows: Vec<Row> = Vec::new();
    if !arguments.quiet {
        outln!(
            "{threads} threads, {:.0} billion unfused {} operations per second at best",
            peak / 1e9,
            InstructionSet::best().name()
        );
        outln!(
            "{:<8}{:<8}{:>10}{:>15}{:>14}{:>12}{:>10}{:>8}{:>10}{}",
            "problem",
            "backend",
            "particles",
            "evaluations/s",
            "million steps",
            "ms",
            "kernel ms",
            "peak",
            "MiB",
            if other.is_some() { "   times the other" } else { "" }
        );
    }
    for name in &arguments.problems {
        let case = match name.as_str() {
            "replay" => Case::replay()?,
            "drive" => Case::drive()?,
            "steady" => Case::steady()?,
            _ => Case::line()?,
        };
        for mut backend in backends(&case, arguments)? {
            let mut rate: Option<f64> = None;
            for &population in &arguments.populations {
                let population = population as usize;
                if rate.is_some_and(|rate| population as f64 / rate > arguments.longest_s) {
                    continue;
                }
                let row = measure(&case, &mut backend, population, peak)?;
                rate = Some(row.evaluations_per_s);
                if !arguments.quiet {
                    print_row(&row, other.as_ref());
                }
                rows.push(row);
            }
        }
    }
    let evaluations = rows.iter().map(|r| r.population as u64).sum();
    let elapsed_s = began.elapsed().as_secs_f64();
    let mut names: Vec<&str> = rows.iter().map(|r| r.backend.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    let table = Table {
        study: "bench".to_owned(),
        seed: 1,
        backend: names.join(", "),
        adapter: rows
            .iter()
            .find(|r| r.backend == "gpu")
            .map(|r| r.adapter.clone()),
        elapsed_s,
        evaluations,
        evaluations_per_s: evaluations as f64 / elapsed_s,
        threads,
        rows,
    };
    if let Some(path) = &arguments.plot {
        rates(&table.rows).write_svg(path)?;
    }
    finish(
        ("bench", &table),
        folder.as_ref(),
        |folder| of_scaling(folder, &table, other.as_ref()),
        (
            table.rows.iter().map(|r| r.backend.as_str()),
            arguments.adapter.as_deref(),
        ),
        (!arguments.quiet, arguments.json),
    )
}

fn measure(case: &Case, backend: &mut Backend<'_>, population: usize, peak: f64) -> Result<Row> {
    let candidates = case.candidates(population);
    // The first call compiles kernels and fills caches.
    let few = population.min(64) * case.about.len();
    backend.evaluator().evaluate(&candidates[..few])?;
    forget_peak_memory();
    let began = Instant::now();
    backend.evaluator().evaluate(&candidates)?;
    let seconds = began.elapsed().as_secs_f64();
    let peak_memory_mib = peak_memory_bytes().map(|b| b as f64 / (1 << 20) as f64);
    let info = backend.evaluator().backend();
    let rate = population as f64 / seconds;
    Ok(Row {
        problem: case.name.to_owned(),
        backend: info.backend.to_owned(),
        adapter: info.device,
        population,
        evaluations_per_s: rate,
        particle_steps_per_s: case.steps.map(|s| rate * s as f64),
        kernel_ms: backend.kernel_ms(),
        generation_ms: seconds * 1e3,
        arithmetic_peak_share: (info.backend == "simd").then(|| rate * case.operations as f64 / peak),
        peak_memory_mib,
    })
}

fn print_row(row: &Row, other: Option<&Table>) {
    let or_dash = |x: Option<String>| x.unwrap_or("-".to_owned());
    let ratio = other.map_or(String::new(), |table| {
        table.like(row).map_or("   -".to_owned(), |r| {
            format!(
                "   {:.2}  {}",
                row.evaluations_per_s / r.evaluations_per_s,
                r.adapter
            )
        })
    });
    outln!(
        "{:<8}{:<8}{:>10}{:>15.1}{:>14}{:>12.1}{:>10}{:>8}{:>10}{ratio}   {}",
        row.problem,
        row.backend,
        row.population,
        row.evaluations_per_s,
        or_dash(row.particle_steps_per_s.map(|s| format!("{:.3}", s / 1e6))),
        row.generation_ms,
        or_dash(row.kernel_ms.map(|ms| format!("{ms:.1}"))),
        or_dash(row.arithmetic_peak_share.map(|s| format!("{:.0}%", 100.0 * s))),
        or_dash(row.peak_memory_mib.map(|m| format!("{m:.0}"))),
        row.adapter,
    );
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
