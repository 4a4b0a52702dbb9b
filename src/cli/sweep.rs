//! `lapswarm sweep`.

use super::dry_run::Plan;
use super::{Common, Memory, going_on, print_json, progress, stop_flag};
use crate::cli::said::{out, outln};
use lapswarm::Result;
use lapswarm::study::run_folder;
use lapswarm::study::sweep::{SWEEP_FILE, SweepSettings, plan, sweep_within};

/// Flags of `sweep`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm sweep thesis_inertia --out tuning\n  lapswarm sweep my_sweep.toml --out s1\n  lapswarm \
                  sweep my_sweep.toml --out s1 --resume\n\nA sweep file:\n  study = \"identify\"\n  [base]\n  polish = \
                  false\n  [grid]\n  \"swarm.population\" = [25, 50, 100]\n  seed = [1, 2, 3]"
)]
pub struct Arguments {
    /// A sweep file, or a bundled sweep: thesis_inertia, thesis_population, thesis_lines, front, norms, sections
    sweep: String,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    memory: Memory,
    /// Go on with the sweep that --out holds a part of
    #[arg(long, requires = "out", conflicts_with = "dry_run")]
    resume: bool,
}

/// Runs the sweep.
pub fn run(arguments: &Arguments) -> Result<()> {
    let limit_mib = arguments.memory.in_force();
    let settings = SweepSettings::load(&arguments.sweep)?;
    if arguments.common.dry_run {
        let planned = plan(&settings, limit_mib)?;
        let mut told = Plan::new("sweep", settings.text())
            .reads(planned.to_string())
            .memory_mib(planned.memory_mib)
            .evaluated_by(planned.backend);
        if let Some(evaluations) = planned.evaluations {
            told = told.evaluations(evaluations);
        }
        return told.tell(&arguments.common);
    }
    let folder = match (&arguments.common.out, arguments.resume) {
        (Some(folder), true) => run_folder::reopen_by(folder, SWEEP_FILE)?,
        (out, _) => run_folder::create("sweep", out.as_deref())?,
    };
    let stop = stop_flag();
    let bar = progress::saying(arguments.common.quiet);
    let summary = sweep_within(&settings, &folder, arguments.resume, limit_mib, |p| {
        let point: Vec<String> = p
            .point
            .settings
            .iter()
            .map(|(key, value)| format!("{key} {value}"))
            .collect();
        bar.set_message(format!(
            "run {} of {}: {}",
            p.done + 1,
            p.planned,
            point.join(", ")
        ));
        bar.tick();
        going_on(&stop)
    })?;
    bar.finish_and_clear();
    if !arguments.common.quiet {
        out!("{}", summary.to_text());
        outln!("Results: {}", folder.display());
    }
    if arguments.common.json {
        print_json(&summary)?;
    }
    Ok(())
}
