//! `lapswarm report`.

use super::print_json;
use crate::cli::output::outln;
use lapswarm::report::compare::{Run, compare};
use lapswarm::{Error, Result};
use std::path::PathBuf;

/// Flags of `report`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folders of runs, as in runs/raceline-001
    #[arg(value_name = "RUN", required = true)]
    runs: Vec<PathBuf>,
    /// The page to write; refused if it is there already
    #[arg(long, value_name = "FILE", default_value = "comparison.html")]
    out: PathBuf,
    /// Print one JSON object on stdout; words go to stderr
    #[arg(long)]
    json: bool,
    /// Say nothing
    #[arg(long)]
    quiet: bool,
}

#[derive(serde::Serialize)]
struct Written<'a> {
    study: &'static str,
    runs: &'a [PathBuf],
    file: &'a PathBuf,
}

/// Writes the page.
pub fn run(arguments: &Arguments) -> Result<()> {
    let out = &arguments.out;
    if out.exists() {
        let expected = "a new file: nothing is overwritten";
        return Err(Error::input(
            out,
            "--out",
            "a file that is there already",
            expected,
        ));
    }
    let runs = arguments
        .runs
        .iter()
        .map(|folder| Run::read(folder))
        .collect::<Result<Vec<Run>>>()?;
    compare(&runs)?.write(out)?;
    if !arguments.quiet {
        outln!("Written: {}", out.display());
    }
    if arguments.json {
        print_json(&Written {
            study: "report",
            runs: &arguments.runs,
            file: out,
        })?;
    }
    Ok(())
}
