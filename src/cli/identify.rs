//! `lapswarm identify`.

use super::dry_run::Plan;
use super::progress::SearchBar;
use super::{Common, Memory, Resume, backend_flag, going_on, print_json, same_settings, stop_flag};
use crate::cli::said::{out, outln};
use lapswarm::evaluate::replay::{BackendChoice, Norm};
use lapswarm::study::identify::{
    Algorithm, IdentifySettings, ObjectiveChoice, SearchState, check_swarms, parse_algorithm, parse_norm,
    parse_objective, search_from, set_up, summarise, write_results, write_settings,
};
use lapswarm::study::memory::Size;
use lapswarm::study::run_folder;
use lapswarm::{Error, Result};
use std::path::PathBuf;

/// Flags of `identify`; a flag wins over the study file.
#[derive(clap::Args)]
pub struct Arguments {
    /// A study file; every flag has its twin in it
    study: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    resume: Resume,
    #[command(flatten)]
    memory: Memory,
    /// The car that fixed parameters come from: a bundled name (gt) or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    car: Option<String>,
    /// The log: our CSV, a MoTeC i2 CSV export or a MoTeC .ld file [default: the bundled lap]
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Channel names, units, signs and delays of the log, as TOML [default: guessed]
    #[arg(long, value_name = "FILE")]
    channel_map: Option<PathBuf>,
    /// The circuit that sections are named on: a bundled name, a TOML file, a survey (CSV, GPX, KML, log) or a shape
    #[arg(long, value_name = "NAME|FILE")]
    track: Option<String>,
    /// The car that drove the log, where known, to state the parameter error
    #[arg(long, value_name = "NAME|FILE")]
    truth: Option<String>,
    /// all, or channels to fit at once: vx,ax,ay,yaw_rate (more than one searches a Pareto front)
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = objective_flag)]
    objectives: Option<Vec<ObjectiveChoice>>,
    /// Norm of the costs: 1, 2, infinity or mse
    #[arg(long, value_parser = norm_flag)]
    norm: Option<Norm>,
    /// Score windows of this length that restart from the log, s [default: whole laps]
    #[arg(long, value_name = "SECONDS")]
    window_s: Option<f64>,
    /// Score only this section of the track
    #[arg(long, value_name = "NAME")]
    section: Option<String>,
    /// Laps to fit [default: all complete ones]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    laps: Option<Vec<u32>>,
    /// Laps to judge on, not to fit
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    holdout: Option<Vec<u32>>,
    /// The search: adaptive, pso, or thesis
    #[arg(long, value_parser = algorithm_flag)]
    algorithm: Option<Algorithm>,
    /// Particles
    #[arg(long, value_name = "N")]
    population: Option<usize>,
    /// Iterations
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Leave the least-squares polish out
    #[arg(long)]
    no_polish: bool,
    /// Hops to other minima that are tried after the polish where what is left over does not look like noise
    #[arg(long, value_name = "N")]
    hops: Option<usize>,
    /// Where to evaluate: auto, cpu, simd or gpu
    #[arg(long, value_name = "BACKEND", value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

fn objective_flag(name: &str) -> Result<ObjectiveChoice, String> {
    parse_objective(name).ok_or_else(|| "expected all, vx, ax, ay or yaw_rate".to_owned())
}

fn norm_flag(name: &str) -> Result<Norm, String> {
    parse_norm(name).ok_or_else(|| "expected 1, 2, infinity or mse".to_owned())
}

fn algorithm_flag(name: &str) -> Result<Algorithm, String> {
    parse_algorithm(name).ok_or_else(|| "expected adaptive, pso or thesis".to_owned())
}

impl Arguments {
    /// The settings of the study file, or of `base` where there is none, under the flags.
    fn settings(&self, base: IdentifySettings) -> Result<IdentifySettings> {
        let mut s = match &self.study {
            Some(path) => IdentifySettings::read(path)?,
            None => base,
        };
        let wrong = |flag: &str, found: f64, expected: &str| {
            Err(Error::input(
                "the command line",
                flag,
                found.to_string(),
                expected,
            ))
        };
        if let Some(window) = self.window_s
            && !(0.2..=1e5).contains(&window)
        {
            return wrong("--window-s", window, "a length from 0.2 to 100000 s");
        }
        set(&mut s.car, &self.car);
        set(&mut s.objectives, &self.objectives);
        set(&mut s.norm, &self.norm);
        set(&mut s.laps, &self.laps);
        set(&mut s.holdout, &self.holdout);
        set(&mut s.algorithm, &self.algorithm);
        set(&mut s.seed, &self.common.seed);
        set(&mut s.backend, &self.backend);
        set_some(&mut s.log, &self.log);
        set_some(&mut s.channel_map, &self.channel_map);
        set_some(&mut s.track, &self.track);
        set_some(&mut s.truth, &self.truth);
        set_some(&mut s.window_s, &self.window_s);
        set_some(&mut s.section, &self.section);
        set_some(&mut s.population, &self.population);
        set_some(&mut s.iterations, &self.iterations);
        set_some(&mut s.adapter, &self.adapter);
        s.polish &= !self.no_polish;
        s.hops = self.hops.unwrap_or(s.hops);
        s.absolute()
    }
}

impl Arguments {
    /// Whether the flags name a backend or an adapter.
    fn moves(&self) -> bool {
        self.backend.is_some() || self.adapter.is_some()
    }
}

fn set<T: Clone>(setting: &mut T, flag: &Option<T>) {
    if let Some(value) = flag {
        *setting = value.clone();
    }
}

fn set_some<T: Clone>(setting: &mut Option<T>, flag: &Option<T>) {
    if flag.is_some() {
        setting.clone_from(flag);
    }
}

/// Runs the study.
pub fn run(arguments: &Arguments) -> Result<()> {
    let limit_mib = arguments.memory.in_force();
    let out = arguments.common.out.as_deref();
    let (folder, state, settings) = if arguments.resume.resume {
        let (folder, mut state) = arguments.resume.open::<SearchState>("identify", out)?;
        let settings = arguments.settings(state.settings.clone())?;
        // Where it is evaluated may change, if that is said; what is evaluated may not.
        if arguments.moves() {
            state.settings.backend = settings.backend;
            state.settings.adapter.clone_from(&settings.adapter);
        }
        same_settings(&folder, &state.settings, &settings)?;
        (Some(folder), Some(state), settings)
    } else {
        (None, None, arguments.settings(IdentifySettings::default())?)
    };
    drop(settings.size().check(limit_mib)?);
    let setup = set_up(&settings)?;
    let size = Size {
        samples: setup.log.samples(),
        ..settings.size()
    };
    let _allowed = size.check(limit_mib)?;
    check_swarms(&settings, &setup)?;
    if arguments.common.dry_run {
        return Plan::new("identify", &settings.to_toml())
            .of_replay(&setup)
            .seed(settings.seed)
            .evaluations(settings.evaluations())
            .memory_mib(size.needed_mib())
            .backend(settings.backend, settings.adapter.as_deref())?
            .tell(&arguments.common);
    }
    // What cannot be set up leaves no folder.
    let folder = match folder {
        Some(folder) => folder,
        None => run_folder::create("identify", out)?,
    };
    write_settings(&folder, &settings)?;
    let stop = stop_flag();
    let mut keeper = arguments.resume.keeper(&folder, arguments.moves());
    let mut bar = SearchBar::new(arguments.common.quiet);
    let outcome = search_from(&settings, &setup, state, &mut keeper, |report| {
        bar.show(report);
        going_on(&stop)
    });
    let outcome = arguments
        .resume
        .or_nothing(outcome, &keeper, SearchState::is_untouched)?;
    bar.finish();
    let summary = summarise(&settings, &setup, &outcome);
    write_results(&folder, &settings, &setup, &outcome, &summary)?;
    if !outcome.interrupted {
        keeper.done()?;
    }
    if !arguments.common.quiet {
        for finding in &summary.calibration.findings {
            outln!("{finding}");
        }
        for note in &summary.calibration.notes {
            outln!("{note}");
        }
        out!("{}", summary.to_text(&settings));
        outln!("Results: {}", folder.display());
    }
    if arguments.common.json {
        print_json(&summary)?;
    }
    if outcome.interrupted {
        Err(Error::Interrupted(folder.to_path_buf()))
    } else {
        Ok(())
    }
}
