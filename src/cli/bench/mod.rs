//! `lapswarm bench`: evaluations per second against population, and how good the optimisers are.

mod machine;
mod optimisers;
mod pages;
mod scaling;
mod studies;
mod swarm;
mod tune;
mod whole;

use lapswarm::Result;

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
    /// Measure whole generations (ask, evaluate, tell) of every problem, and what of them is not kernels.
    Whole(whole::Arguments),
    /// Try how kernels are best dispatched on a GPU, and remember it.
    Tune(tune::Arguments),
}

/// Measures and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    match &arguments.what {
        Some(What::Optimisers(arguments)) => optimisers::run(arguments),
        Some(What::Studies(arguments)) => studies::run(arguments),
        Some(What::Swarm(arguments)) => swarm::run(arguments),
        Some(What::Whole(arguments)) => whole::run(arguments),
        Some(What::Tune(arguments)) => tune::run(arguments),
        None => scaling::run(&arguments.scaling),
    }
}
