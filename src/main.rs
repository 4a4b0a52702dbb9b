//! The command line of lapswarm.

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().collect();
    ExitCode::from(lapswarm::cli::run(&arguments))
}
