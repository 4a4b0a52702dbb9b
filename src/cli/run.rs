//! `lapswarm run`.

use super::dry_run::Plan;
use super::{Common, Memory, Resume, backend_flag, going_on, print_json, progress, stop_flag};
use crate::cli::said::{out, outln};
use lapswarm::evaluate::BackendChoice;
use lapswarm::study::memory::Size;
use lapswarm::study::run::{Means, RunSettings, prepare, run as run_all};
use lapswarm::study::run_folder;
use lapswarm::{Error, Result};
use std::path::PathBuf;

/// Flags of `run`; a flag wins over the study file.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm run\n  lapswarm run --log lap.csv --car start.toml --track circuit.csv\n\nA study \
                  file names study files of the stages: identify = \"identify.toml\", raceline = \"raceline.toml\"; \
                  margin_m and rounds are its own."
)]
pub struct Arguments {
    /// A study file
    study: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    resume: Resume,
    #[command(flatten)]
    memory: Memory,
    /// The log [default: the bundled lap]
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// The car that fixed parameters come from: a bundled name (gt) or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    car: Option<String>,
    /// The circuit: a bundled name, a shape, or a file
    #[arg(long, value_name = "NAME|FILE")]
    track: Option<String>,
    /// Room that the line leaves on either side of the car for the driver's errors, m [default: 0.5]
    #[arg(long, value_name = "M")]
    margin_m: Option<f64>,
    /// Most lines that are driven, each within the limits that the one before it left [default: 2]
    #[arg(long, value_name = "N")]
    rounds: Option<usize>,
    /// Where to evaluate: auto, cpu, simd or gpu
    #[arg(long, value_name = "BACKEND", value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// Where results of stages are kept for runs of the same inputs [default: runs/cache]
    #[arg(long, value_name = "DIR", conflicts_with = "no_cache")]
    cache: Option<PathBuf>,
    /// Do every stage anew, and keep none
    #[arg(long)]
    no_cache: bool,
}

impl Arguments {
    /// Whether the flags name a backend or an adapter.
    fn moves(&self) -> bool {
        self.backend.is_some() || self.adapter.is_some()
    }

    /// The settings of the study file, or of `base` where there is none, under the flags.
    fn settings(&self, base: Option<RunSettings>) -> Result<RunSettings> {
        let mut s = match &self.study {
            Some(path) => RunSettings::read(path)?,
            None => base.clone().unwrap_or_default(),
        };
        if self.log.is_some() {
            s.identify.log.clone_from(&self.log);
        }
        if let Some(car) = &self.car {
            s.identify.car.clone_from(car);
        }
        if let Some(track) = &self.track {
            s.identify.track = Some(track.clone());
            s.raceline.track.clone_from(track);
        }
        if let Some(backend) = self.backend {
            (s.identify.backend, s.raceline.backend) = (backend, backend);
        }
        if self.adapter.is_some() {
            s.identify.adapter.clone_from(&self.adapter);
            s.raceline.adapter.clone_from(&self.adapter);
        }
        if let Some(seed) = self.common.seed {
            (s.identify.seed, s.raceline.seed) = (seed, seed);
        }
        s.margin_m = self.margin_m.unwrap_or(s.margin_m);
        s.rounds = self.rounds.unwrap_or(s.rounds);
        if !(0.0..=5.0).contains(&s.margin_m) || !(1..=20).contains(&s.rounds) {
            let found = format!("{} m, {} rounds", s.margin_m, s.rounds);
            return Err(Error::input(
                "the flags",
                "--margin-m, --rounds",
                found,
                "0 to 5 m, 1 to 20 rounds",
            ));
        }
        // A run that is gone on with finds its stages where it left them.
        s.cache = match (&self.cache, base) {
            (Some(cache), _) => Some(cache.clone()),
            (None, Some(base)) => base.cache,
            (None, None) => (!self.no_cache).then(|| PathBuf::from("runs/cache")),
        };
        if let Some(cache) = &mut s.cache {
            *cache = std::path::absolute(&cache).map_err(|e| Error::io(&cache, "find", e))?;
        }
        s.identify = s.identify.absolute()?;
        s.raceline = s.raceline.absolute();
        Ok(s)
    }
}

/// Runs everything.
pub fn run(arguments: &Arguments) -> Result<()> {
    let limit_mib = arguments.memory.in_force();
    let stop = stop_flag();
    let out = arguments.common.out.as_deref();
    let moved: fn(&mut RunSettings, &RunSettings) = |kept, asked| {
        kept.identify.backend = asked.identify.backend;
        kept.raceline.backend = asked.raceline.backend;
        kept.identify.adapter.clone_from(&asked.identify.adapter);
        kept.raceline.adapter.clone_from(&asked.raceline.adapter);
    };
    let begun = arguments.resume.begin(
        "run",
        out,
        |base| arguments.settings(base),
        arguments.moves().then_some(moved),
    )?;
    let settings = begun.settings;
    // Each stage has the limit for itself; what none of them has room for is refused before the first.
    for size in [settings.identify.size(), settings.raceline.size()] {
        drop(size.check(limit_mib)?);
    }
    let prepared = prepare(&settings)?;
    let sizes = [prepared.identify_size(), settings.raceline.size()];
    drop(sizes[0].check(limit_mib)?);
    if arguments.common.dry_run {
        return Plan::new("run", &settings.to_toml())
            .of_replay(&prepared.setup)
            .of_road(&prepared.road)
            .seed(settings.identify.seed)
            .memory_mib(sizes.iter().map(Size::needed_mib).max().unwrap_or(0))
            .backend(settings.identify.backend, settings.identify.adapter.as_deref())?
            .tell(&arguments.common);
    }
    let folder = match begun.folder {
        Some(folder) => folder,
        None => run_folder::create("run", out)?,
    };
    let mut keeper = arguments.resume.keeper(&folder, arguments.moves());
    keeper.keep(&begun.journal)?;
    let bar = progress::saying(arguments.common.quiet);
    // Without a cache to share, a run that is broken off still finds its own stages again.
    let own = folder.join(".stages");
    let cache = settings.cache.as_ref().unwrap_or(&own);
    let means = Means {
        cache: Some(cache),
        every: keeper.interval(),
        memory_limit_mib: limit_mib,
    };
    let summary = run_all(&prepared, &folder, &means, |doing| {
        bar.set_message(doing.to_owned());
        bar.tick();
        going_on(&stop)
    })?;
    bar.finish_and_clear();
    if own.exists() {
        std::fs::remove_dir_all(&own).map_err(|e| Error::io(&own, "remove", e))?;
    }
    keeper.done()?;
    if !arguments.common.quiet {
        out!("{}", summary.to_text());
        outln!("Results: {}", folder.display());
    }
    if arguments.common.json {
        print_json(&summary)?;
    }
    if summary.agrees {
        return Ok(());
    }
    Err(Error::Study(
        "the driven lap and the point mass's differ by more than half a percent (see the story above)"
            .to_owned(),
    ))
}
