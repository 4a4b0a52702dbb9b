//! `lapswarm sensitivity`.

use super::dry_run::Plan;
use super::replay_flags::ReplayFlags;
use super::{Common, Memory, Resume, going_on, print_json, progress, stop_flag};
use crate::cli::said::{out, outln};
use lapswarm::study::journal::{Journal, Recorder};
use lapswarm::study::memory;
use lapswarm::study::run_folder;
use lapswarm::study::sensitivity::{
    SensitivitySettings, measure_recorded, set_up_sensitivity, summarise, write_results,
};
use lapswarm::{Error, Result};
use std::path::PathBuf;

/// Flags of `sensitivity`; a flag wins over the study file.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm sensitivity\n  lapswarm sensitivity --share 0.02 --samples 1024\n  lapswarm \
                  sensitivity --car runs/identify-001/car.toml --log lap.csv --parameters K,C,cg_height_m"
)]
pub struct Arguments {
    /// A study file, as `identify` reads it, with share, samples and resamples beside
    study: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    resume: Resume,
    #[command(flatten)]
    memory: Memory,
    #[command(flatten)]
    replay: ReplayFlags,
    /// Parameters to move [default: the 22 unknowns of `identify`]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    parameters: Option<Vec<String>>,
    /// How far each goes either way, as a share of its value [default: 0.05]
    #[arg(long, value_name = "SHARE")]
    share: Option<f64>,
    /// Base samples of the Sobol indices, each as many evaluations as there are parameters and two more [default: 256]
    #[arg(long, value_name = "N")]
    samples: Option<usize>,
}

impl Arguments {
    /// The settings of the study file, or of `base` where there is none, under the flags.
    fn settings(&self, base: Option<SensitivitySettings>) -> Result<SensitivitySettings> {
        let mut s = match &self.study {
            Some(path) => SensitivitySettings::read(path)?,
            None => base.unwrap_or_default(),
        };
        self.replay.apply(&self.common, &mut s.replay);
        if let Some(names) = &self.parameters {
            s.replay.free = super::named_parameters(&s.replay, names);
        }
        s.share = self.share.unwrap_or(s.share);
        s.samples = self.samples.unwrap_or(s.samples);
        s.validate()?;
        s.replay = s.replay.absolute()?;
        Ok(s)
    }
}

/// Runs the study.
pub fn run(arguments: &Arguments) -> Result<()> {
    let limit_mib = arguments.memory.in_force();
    let out = arguments.common.out.as_deref();
    let moves = arguments.replay.moves();
    let moved: fn(&mut SensitivitySettings, &SensitivitySettings) = |kept, asked| {
        kept.replay.backend = asked.replay.backend;
        kept.replay.adapter.clone_from(&asked.replay.adapter);
    };
    let begun = arguments.resume.begin(
        "sensitivity",
        out,
        |base| arguments.settings(base),
        moves.then_some(moved),
    )?;
    let settings = begun.settings;
    drop(memory::check(&settings.kept(), limit_mib)?);
    let setup = set_up_sensitivity(&settings)?;
    let [all] = settings.kept();
    let kept = [all, memory::log_kept(setup.log.samples())];
    let _allowed = memory::check(&kept, limit_mib)?;
    if arguments.common.dry_run {
        return Plan::new("sensitivity", &settings.to_toml())
            .of_replay(&setup)
            .seed(settings.replay.seed)
            .evaluations(settings.evaluations() as u64)
            .memory_mib(memory::needed_mib(&kept))
            .backend(settings.replay.backend, settings.replay.adapter.as_deref())?
            .tell(&arguments.common);
    }
    let folder = match begun.folder {
        Some(folder) => folder,
        None => run_folder::create("sensitivity", out)?,
    };
    let mut keeper = arguments.resume.keeper(&folder, moves);
    let mut recorder = Recorder::new(begun.journal, &mut keeper);
    let stop = stop_flag();
    let bar = progress::counting(arguments.common.quiet);
    let outcome = measure_recorded(&settings, &setup, &mut recorder, |p| {
        bar.set_length(p.planned as u64);
        bar.set_position(p.evaluations as u64);
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
