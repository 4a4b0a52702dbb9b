//! `lapswarm raceline`.

use super::dry_run::Plan;
use super::{Common, Memory, Resume, backend_flag, going_on, print_json, same_settings, stop_flag};
use crate::cli::said::{out, outln};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::line::LineObjective;
use lapswarm::study::raceline::{
    LineAlgorithm, LinesState, OBJECTIVE_NAMES, RacelineSettings, find_lines_from, set_up, summarise,
    write_results, write_settings,
};
use lapswarm::study::run_folder;
use lapswarm::{Error, Result};
use std::path::PathBuf;

/// Flags of `raceline`; a flag wins over the study file.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm raceline\n  lapswarm raceline --track my_circuit.csv --car runs/identify-001/car.toml\n  \
                  lapswarm raceline --section Abbey --objectives lap_time\n\nLines are looked for through the cuts. Through too \
                  few of them the best one may leave the road in between: that is warned of on stderr, the JSON names the \
                  objectives in off_road, and the exit code stays 0, for it is the best line through these cuts."
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
    /// The circuit: a bundled name, a shape such as circle:590:600, or a file (TOML, CSV, GPX, KML, a log with GPS)
    #[arg(long, value_name = "NAME|FILE")]
    track: Option<String>,
    /// The car whose limits are swept: a bundled name (gt) or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    car: Option<String>,
    /// Limits from a table (v_mps, ay_mps2, ax_grip_mps2, ax_drive_mps2, drag_mps2) instead of the car's own
    #[arg(long, value_name = "FILE")]
    envelope: Option<PathBuf>,
    /// Only a named stretch of the track, such as Abbey, as an open road
    #[arg(long, value_name = "NAME")]
    section: Option<String>,
    /// Cuts across the track
    #[arg(long, value_name = "N")]
    sections: Option<usize>,
    /// Smooth a surveyed track's line and edges, within 0.25 m
    #[arg(long)]
    smoothed: bool,
    /// Width of the car, m; 0 lets its middle use the whole road
    #[arg(long, value_name = "W")]
    car_width_m: Option<f64>,
    /// Exponent of the friction ellipse
    #[arg(long, value_name = "P")]
    ellipse_exponent: Option<f64>,
    /// Greatest speed at the start of an open track, m/s
    #[arg(long, value_name = "MPS")]
    entry_mps: Option<f64>,
    /// length, length_squared, gamma, kappa2, lap_time: any of them, more than one for a front
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = objective_flag)]
    objectives: Option<Vec<LineObjective>>,
    /// Start the swarms cold, from no known line
    #[arg(long)]
    no_warm_start: bool,
    /// Leave the local search by gradients out
    #[arg(long)]
    no_local_search: bool,
    /// What looks for the best line by one objective: windows, cooperative (CPSO-S_K) or thesis; the last two start at random
    #[arg(long, value_name = "NAME", value_parser = algorithm_flag)]
    algorithm: Option<LineAlgorithm>,
    /// Groups of neighbouring cuts of the cooperative algorithm
    #[arg(long, value_name = "K")]
    groups: Option<usize>,
    /// Particles of the swarm that looks for the front between several objectives; with --algorithm cooperative or thesis
    /// also of the swarm of each objective. The windows' swarms have sizes of their own
    #[arg(long, value_name = "N")]
    population: Option<usize>,
    /// Iterations of these swarms; with one objective and the windows neither flag changes anything
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Where to evaluate: auto, cpu, simd or gpu
    #[arg(long, value_name = "BACKEND", value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

fn objective_flag(name: &str) -> Result<LineObjective, String> {
    LineObjective::named(name).ok_or_else(|| format!("expected one of {OBJECTIVE_NAMES}"))
}

fn algorithm_flag(name: &str) -> Result<LineAlgorithm, String> {
    LineAlgorithm::named(name).ok_or_else(|| "expected windows, cooperative or thesis".to_owned())
}

impl Arguments {
    /// Whether the flags name a backend or an adapter.
    fn moves(&self) -> bool {
        self.backend.is_some() || self.adapter.is_some()
    }

    /// The settings of the study file, or of `base` where there is none, under the flags.
    fn settings(&self, base: RacelineSettings) -> Result<RacelineSettings> {
        let mut s = match &self.study {
            Some(path) => RacelineSettings::read(path)?,
            None => base,
        };
        fn set<T: Clone>(setting: &mut T, flag: &Option<T>) {
            if let Some(value) = flag {
                setting.clone_from(value);
            }
        }
        set(&mut s.track, &self.track);
        set(&mut s.car, &self.car);
        set(&mut s.sections, &self.sections);
        set(&mut s.car_width_m, &self.car_width_m);
        set(&mut s.ellipse_exponent, &self.ellipse_exponent);
        set(&mut s.entry_mps, &self.entry_mps);
        set(&mut s.objectives, &self.objectives);
        set(&mut s.algorithm, &self.algorithm);
        set(&mut s.groups, &self.groups);
        set(&mut s.population, &self.population);
        set(&mut s.iterations, &self.iterations);
        set(&mut s.backend, &self.backend);
        set(&mut s.seed, &self.common.seed);
        if self.section.is_some() {
            s.section.clone_from(&self.section);
        }
        if self.envelope.is_some() {
            s.envelope.clone_from(&self.envelope);
        }
        if self.adapter.is_some() {
            s.adapter.clone_from(&self.adapter);
        }
        s.as_surveyed &= !self.smoothed;
        s.warm_start &= !self.no_warm_start;
        s.local_search &= !self.no_local_search;
        s.validate()?;
        Ok(s.absolute())
    }
}

/// Runs the study.
pub fn run(arguments: &Arguments) -> Result<()> {
    let limit_mib = arguments.memory.in_force();
    let out = arguments.common.out.as_deref();
    let (folder, state, settings) = if arguments.resume.resume {
        let (folder, mut state) = arguments.resume.open::<LinesState>("raceline", out)?;
        let settings = arguments.settings(state.settings.clone())?;
        // Where lines are evaluated may change, if that is said; what is evaluated may not.
        if arguments.moves() {
            state.settings.backend = settings.backend;
            state.settings.adapter.clone_from(&settings.adapter);
        }
        same_settings(&folder, &state.settings, &settings)?;
        (Some(folder), Some(state), settings)
    } else {
        (None, None, arguments.settings(RacelineSettings::default())?)
    };
    let _allowed = settings.size().check(limit_mib)?;
    let setup = set_up(&settings)?;
    if arguments.common.dry_run {
        return Plan::new("raceline", &settings.to_toml())
            .of_road(&setup)
            .seed(settings.seed)
            .memory_mib(settings.size().needed_mib())
            .backend(settings.backend, settings.adapter.as_deref())?
            .tell(&arguments.common);
    }
    // What cannot be set up leaves no folder.
    let folder = match folder {
        Some(folder) => folder,
        None => run_folder::create("raceline", out)?,
    };
    write_settings(&folder, &settings)?;
    let mut keeper = arguments.resume.keeper(&folder, arguments.moves());
    let stop = stop_flag();
    let target = if arguments.common.quiet {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr()
    };
    let bar = ProgressBar::with_draw_target(None, target);
    if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix:24} {msg}") {
        bar.set_style(style);
    }
    let outcome = find_lines_from(&settings, &setup, state, &mut keeper, |progress| {
        bar.set_prefix(progress.stage.clone());
        bar.set_message(format!("{} lines, best {}", progress.evaluations, progress.best));
        bar.tick();
        going_on(&stop)
    });
    let outcome = arguments
        .resume
        .or_nothing(outcome, &keeper, LinesState::is_untouched)?;
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
    if !summary.off_road.is_empty() {
        // Said whatever is printed, and no failure: the line is the best through the cuts that were asked for.
        tracing::warn!("{}", summary.off_road_text());
    }
    if outcome.interrupted {
        Err(Error::Interrupted(folder.to_path_buf()))
    } else {
        Ok(())
    }
}
