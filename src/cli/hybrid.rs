//! `lapswarm hybrid`.

use super::dry_run::Plan;
use super::{Common, Memory, Resume, backend_flag, going_on, print_json, stop_flag};
use crate::cli::said::{out, outln};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::hybrid::HybridObjective;
use lapswarm::study::hybrid::{
    FreePart, HYBRID_OBJECTIVES, HybridStudySettings, read_inputs, run_recorded, summarise, write_results,
};
use lapswarm::study::journal::{Journal, Recorder};
use lapswarm::study::run_folder;
use lapswarm::{Error, Result};
use std::path::PathBuf;

/// Flags of `hybrid`; a flag wins over the study file.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm hybrid\n  lapswarm hybrid --scenarios-only --json\n  lapswarm hybrid --energy-mj 2.1 \
                  --objectives lap_time_s,fuel_l --free both\n  lapswarm hybrid --line runs/raceline-001/line_fastest.csv\n  \
                  lapswarm hybrid --stint-laps 10\n  lapswarm hybrid --match-lap-time-s 113.5\n\nA study file has the same \
                  names, and scenarios of its own:\n  [scenarios.own]\n  mode = \"additional\"     # or offset: the motor takes \
                  the engine's place\n  steer_rad = 0.03        # greatest steering at the wheels\n  speed_mps = 60          # \
                  greatest speed\n  soc = 0.5               # the store is not led below\n  energy_mj = 3           # energy \
                  out of the store in a lap"
)]
pub struct Arguments {
    /// A study file; every flag has its twin in it
    study: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    resume: Resume,
    #[command(flatten)]
    memory: Memory,
    /// The circuit: a bundled name, a shape such as stadium:500:100:12, or a file
    #[arg(long, value_name = "NAME|FILE")]
    track: Option<String>,
    /// The car, with an engine map and a hybrid drive: a bundled name (gt_hybrid) or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    car: Option<String>,
    /// Limits from a table (v_mps, ay_mps2, ax_grip_mps2, ax_drive_mps2, drag_mps2) instead of the car's own
    #[arg(long, value_name = "FILE")]
    envelope: Option<PathBuf>,
    /// A line (CSV with columns x and y in m) instead of the fastest one
    #[arg(long, value_name = "FILE")]
    line: Option<PathBuf>,
    /// Cuts across the track that the fastest line is found through
    #[arg(long, value_name = "N")]
    sections: Option<usize>,
    /// Width of the car, m
    #[arg(long, value_name = "W")]
    car_width_m: Option<f64>,
    /// Drive the scenarios only
    #[arg(long)]
    scenarios_only: bool,
    /// Energy that may be deployed in a lap, MJ [default: what rules and store allow]
    #[arg(long, value_name = "MJ")]
    energy_mj: Option<f64>,
    /// lap_time_s, fuel_l, energy_used_mj, soc_swing: more than one for a front
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = objective_flag)]
    objectives: Option<Vec<HybridObjective>>,
    /// What the front's swarm may change: strategy, line or both
    #[arg(long, value_name = "PART", value_parser = free_flag)]
    free: Option<FreePart>,
    /// Laps of a stint that sustains its charge
    #[arg(long, value_name = "N")]
    stint_laps: Option<usize>,
    /// Fuel on board at the start of the stint, kg
    #[arg(long, value_name = "KG")]
    stint_fuel_kg: Option<f64>,
    /// Size motor and store so that the car laps in this time, s
    #[arg(long, value_name = "S")]
    match_lap_time_s: Option<f64>,
    /// Particles of the swarms
    #[arg(long, value_name = "N")]
    population: Option<usize>,
    /// Their iterations
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Where to evaluate: auto, cpu, simd or gpu
    #[arg(long, value_name = "BACKEND", value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

fn objective_flag(name: &str) -> Result<HybridObjective, String> {
    HybridObjective::named(name).ok_or_else(|| format!("expected one of {HYBRID_OBJECTIVES}"))
}

fn free_flag(name: &str) -> Result<FreePart, String> {
    FreePart::named(name).ok_or_else(|| "expected strategy, line or both".to_owned())
}

impl Arguments {
    /// The settings of the study file, or of `base` where there is none, under the flags.
    fn settings(&self, base: Option<HybridStudySettings>) -> Result<HybridStudySettings> {
        let mut s = match &self.study {
            Some(path) => HybridStudySettings::read(path)?,
            None => base.unwrap_or_default(),
        };
        fn set<T: Clone>(setting: &mut T, flag: &Option<T>) {
            if let Some(value) = flag {
                setting.clone_from(value);
            }
        }
        fn set_some<T: Clone>(setting: &mut Option<T>, flag: &Option<T>) {
            if flag.is_some() {
                setting.clone_from(flag);
            }
        }
        set(&mut s.track, &self.track);
        set(&mut s.car, &self.car);
        set(&mut s.sections, &self.sections);
        set(&mut s.car_width_m, &self.car_width_m);
        set(&mut s.objectives, &self.objectives);
        set(&mut s.free, &self.free);
        set(&mut s.stint_laps, &self.stint_laps);
        set(&mut s.stint_fuel_kg, &self.stint_fuel_kg);
        set(&mut s.population, &self.population);
        set(&mut s.iterations, &self.iterations);
        set(&mut s.backend, &self.backend);
        set(&mut s.seed, &self.common.seed);
        set_some(&mut s.envelope, &self.envelope);
        set_some(&mut s.line, &self.line);
        set_some(&mut s.energy_mj, &self.energy_mj);
        set_some(&mut s.match_lap_time_s, &self.match_lap_time_s);
        set_some(&mut s.adapter, &self.adapter);
        s.optimise &= !self.scenarios_only;
        s.validate()?;
        Ok(s.absolute())
    }
}

/// Runs the study.
pub fn run(arguments: &Arguments) -> Result<()> {
    let limit_mib = arguments.memory.in_force();
    let stop = stop_flag();
    let out = arguments.common.out.as_deref();
    let moves = arguments.backend.is_some() || arguments.adapter.is_some();
    let moved: fn(&mut HybridStudySettings, &HybridStudySettings) = |kept, asked| {
        kept.backend = asked.backend;
        kept.adapter.clone_from(&asked.adapter);
    };
    let begun = arguments.resume.begin(
        "hybrid",
        out,
        |base| arguments.settings(base),
        moves.then_some(moved),
    )?;
    let settings = begun.settings;
    // What no track has room for is refused before one is read.
    drop(settings.size().check(limit_mib)?);
    let inputs = read_inputs(&settings)?;
    let size = inputs.size(&settings);
    let _allowed = size.check(limit_mib)?;
    if arguments.common.dry_run {
        let line = match (&settings.line, inputs.given_points()) {
            (Some(path), Some(points)) => format!("{}, {points} points", path.display()),
            _ => "the fastest one, found first".to_owned(),
        };
        return Plan::new("hybrid", &settings.to_toml())
            .of_road(inputs.road())
            .reads(format!("hybrid drive of {}", inputs.car().name))
            .reads(format!("line: {line}"))
            .seed(settings.seed)
            .memory_mib(size.needed_mib())
            .backend(settings.backend, settings.adapter.as_deref())?
            .tell(&arguments.common);
    }
    let folder = match begun.folder {
        Some(folder) => folder,
        None => run_folder::create("hybrid", out)?,
    };
    let mut keeper = arguments.resume.keeper(&folder, moves);
    keeper.keep(&begun.journal)?;
    // Broken off, the search for the line is begun anew: it is a matter of seconds, and ends where it would have ended.
    let setup = inputs.with_line(&settings, &stop);
    let Some(setup) = arguments
        .resume
        .or_nothing(setup, &keeper, Journal::is_untouched)?
    else {
        return Err(Error::Interrupted(folder.to_path_buf()));
    };
    let mut recorder = Recorder::new(begun.journal, &mut keeper);
    let target = if arguments.common.quiet {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr()
    };
    let bar = ProgressBar::with_draw_target(None, target);
    if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix:12} {msg}") {
        bar.set_style(style);
    }
    let outcome = run_recorded(&settings, &setup, &mut recorder, |progress| {
        bar.set_prefix(progress.stage);
        bar.set_message(format!("{} laps, {}", progress.evaluations, progress.best));
        bar.tick();
        going_on(&stop)
    });
    let outcome = arguments
        .resume
        .or_nothing(outcome, &keeper, Journal::is_untouched)?;
    bar.finish_and_clear();
    let summary = summarise(&settings, &setup, &outcome);
    write_results(&folder, &settings, &setup, &outcome, &summary)?;
    if !outcome.interrupted {
        keeper.done()?;
    }
    if !arguments.common.quiet {
        out!("{}", summary.to_text());
        outln!("Results: {}", folder.display());
    }
    if arguments.common.json {
        print_json(&summary)?;
    }
    let matched = outcome.sizing.is_empty() || summary.sizing.iter().any(|s| s.energy_mj.is_some());
    if outcome.interrupted {
        Err(Error::Interrupted(folder.to_path_buf()))
    } else if !matched {
        let time_s = settings.match_lap_time_s.unwrap_or_default();
        Err(Error::Study(format!(
            "no motor that was tried makes the car lap in {time_s} s, whatever the energy (see the sizes above)"
        )))
    } else {
        Ok(())
    }
}
