//! `lapswarm surface`.

use super::dry_run::Plan;
use super::replay_flags::ReplayFlags;
use super::{Common, Memory, Resume, going_on, print_json, progress, stop_flag};
use crate::cli::said::{out, outln};
use lapswarm::study::journal::{Journal, Recorder};
use lapswarm::study::memory;
use lapswarm::study::run_folder;
use lapswarm::study::surface::{SurfaceSettings, measure_recorded, set_up_surface, summarise, write_results};
use lapswarm::{Error, Result};
use std::path::PathBuf;

/// Flags of `surface`; a flag wins over the study file.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm surface\n  lapswarm surface --parameters K,C --share 0.5 --grid 101"
)]
pub struct Arguments {
    /// A study file, as `identify` reads it, with parameters, share and grid beside
    study: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    resume: Resume,
    #[command(flatten)]
    memory: Memory,
    #[command(flatten)]
    replay: ReplayFlags,
    /// The horizontal and the vertical parameter [default: rBy1,rCy1]
    #[arg(long, value_name = "X,Y", value_delimiter = ',', num_args = 1)]
    parameters: Option<Vec<String>>,
    /// How far each goes either way, as a share of its value [default: 0.2]
    #[arg(long, value_name = "SHARE")]
    share: Option<f64>,
    /// Values of each [default: 41]
    #[arg(long, value_name = "N")]
    grid: Option<usize>,
}

impl Arguments {
    /// The settings of the study file, or of `base` where there is none, under the flags.
    fn settings(&self, base: Option<SurfaceSettings>) -> Result<SurfaceSettings> {
        let mut s = match &self.study {
            Some(path) => SurfaceSettings::read(path)?,
            None => base.unwrap_or_default(),
        };
        self.replay.apply(&self.common, &mut s.replay);
        if let Some(names) = &self.parameters {
            s.parameters = <[String; 2]>::try_from(names.clone()).map_err(|names| {
                Error::input(
                    "the flags",
                    "--parameters",
                    names.join(","),
                    "two names with a comma between",
                )
            })?;
        }
        s.share = self.share.or(s.share);
        s.grid = self.grid.unwrap_or(s.grid);
        s.replay = s.replay.absolute()?;
        Ok(s)
    }
}

/// Runs the study.
pub fn run(arguments: &Arguments) -> Result<()> {
    let limit_mib = arguments.memory.in_force();
    let out = arguments.common.out.as_deref();
    let moves = arguments.replay.moves();
    let moved: fn(&mut SurfaceSettings, &SurfaceSettings) = |kept, asked| {
        kept.replay.backend = asked.replay.backend;
        kept.replay.adapter.clone_from(&asked.replay.adapter);
    };
    let begun = arguments.resume.begin(
        "surface",
        out,
        |base| arguments.settings(base),
        moves.then_some(moved),
    )?;
    let settings = begun.settings;
    drop(memory::check(&settings.kept(), limit_mib)?);
    let setup = set_up_surface(&settings)?;
    let [all] = settings.kept();
    let kept = [all, memory::log_kept(setup.log.samples())];
    let _allowed = memory::check(&kept, limit_mib)?;
    if arguments.common.dry_run {
        return Plan::new("surface", &settings.to_toml())
            .of_replay(&setup)
            .seed(settings.replay.seed)
            .evaluations((settings.grid * settings.grid) as u64)
            .memory_mib(memory::needed_mib(&kept))
            .backend(settings.replay.backend, settings.replay.adapter.as_deref())?
            .tell(&arguments.common);
    }
    let folder = match begun.folder {
        Some(folder) => folder,
        None => run_folder::create("surface", out)?,
    };
    let mut keeper = arguments.resume.keeper(&folder, moves);
    let mut recorder = Recorder::new(begun.journal, &mut keeper);
    let stop = stop_flag();
    let bar = progress::counting(arguments.common.quiet);
    bar.set_length((settings.grid * settings.grid) as u64);
    let outcome = measure_recorded(&settings, &setup, &mut recorder, |done| {
        bar.set_position(done as u64);
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
    if outcome.interrupted {
        return Err(Error::Interrupted(folder.to_path_buf()));
    }
    Ok(())
}
