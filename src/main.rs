//! The command line of lapswarm.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
