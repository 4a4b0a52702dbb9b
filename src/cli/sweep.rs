//! `lapswarm sweep`.

use super::study::{print_plan, print_results};
use super::{Common, Memory, progress::Bar, stop_flag, stopped, to_json};
use lapswarm::Result;
use lapswarm::config::limit_memory;
use lapswarm::files::run_folder;
use lapswarm::study::framework::Plan;
use lapswarm::study::sweep::{SWEEP_FILE, SweepSettings, plan, sweep};

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
    /// Resume the sweep that --out holds a part of
    #[arg(long, requires = "out", conflicts_with = "dry_run")]
    resume: bool,
}

/// Runs the sweep.
pub fn run(arguments: &Arguments) -> Result<()> {
    let common = &arguments.common;
    limit_memory(arguments.memory.memory_limit_mib);
    let settings = SweepSettings::load(&arguments.sweep)?;
    if common.dry_run {
        let planned = plan(&settings)?;
        let told = Plan::of_file("sweep", settings.text())
            .reads(planned.to_string())
            .memory_mib(planned.memory_mib)
            .on_device_of(&planned.plan);
        let told = match planned.evaluations {
            Some(evaluations) => told.evaluations(evaluations),
            None => told,
        };
        return print_plan(common, &told.into_folder(common.out.as_deref())?);
    }
    let folder = match (&common.out, arguments.resume) {
        (Some(folder), true) => run_folder::reopen_by(folder, SWEEP_FILE)?,
        (out, _) => run_folder::create("sweep", out.as_deref())?,
    };
    let stop = stop_flag();
    let mut bar = Bar::new(common.quiet);
    let summary = sweep(&settings, &folder, arguments.resume, |progress| {
        bar.show(progress);
        stopped(&stop)
    })?;
    bar.finish();
    print_results(common, &summary.to_text(), Some(&folder), &to_json(&summary)?);
    Ok(())
}
