//! `lapswarm bench`: evaluations per second against population, and how good the optimisers are.

mod machine;
mod optimisers;
mod pages;
mod scaling;
mod studies;
mod swarm;

use crate::cli::measurement::keep;
use crate::cli::output::outln;
use crate::cli::print_json;
use lapswarm::Result;
use lapswarm::report::HtmlReport;
use lapswarm::study::framework::run_folder::RunFolder;
use serde::Serialize;
use std::path::Path;

/// Flags of `bench`.
#[derive(clap::Args)]
#[command(
    args_conflicts_with_subcommands = true,
    after_help = "Examples:\n  lapswarm bench\n  lapswarm bench --problems line --populations 1024,32768,1048576 --json > \
                  here.json\n  lapswarm bench --against here.json\n  lapswarm bench optimisers --seeds 11"
)]
pub struct Arguments {
    #[command(subcommand)]
    what: Option<What>,
    #[command(flatten)]
    scaling: scaling::Arguments,
}

#[derive(clap::Subcommand)]
enum What {
    /// Compare the optimisers on problems whose answers are known.
    Optimisers(optimisers::Arguments),
    /// Compare the optimisers of several objectives on the studies' own problems, by hypervolume against time.
    Studies(studies::Arguments),
    /// Measure what the optimiser itself costs, from a thousand particles to a million.
    Swarm(swarm::Arguments),
}

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        Some(What::Optimisers(arguments)) => optimisers::run(arguments),
        Some(What::Studies(arguments)) => studies::run(arguments),
        Some(What::Swarm(arguments)) => swarm::run(arguments),
        None => scaling::run(&arguments.scaling),
    }
}

/// Keeps what was measured with its page, if a folder is asked for, and prints it as JSON, if that is; `told` says whether
/// words go to the terminal.
fn finish<'a>(
    (study, table): (&'static str, &impl Serialize),
    folder: Option<&RunFolder>,
    page: impl FnOnce(&Path) -> Result<HtmlReport>,
    measured_by: (impl IntoIterator<Item = &'a str>, Option<&str>),
    (told, json): (bool, bool),
) -> Result<()> {
    if let Some(folder) = folder {
        keep(folder, study, table, page(folder)?, measured_by)?;
        if told {
            outln!("Results: {}", folder.display());
        }
    }
    if json {
        print_json(table)?;
    }
    Ok(())
}
