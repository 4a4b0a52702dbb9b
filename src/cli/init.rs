//! `lapswarm init`: commented files to start from.

use crate::cli::output::outln;
use clap::builder::PossibleValuesParser;
use lapswarm::files;
use lapswarm::study::registry;
use lapswarm::vehicle::Car;
use lapswarm::{Error, Result};
use std::path::{Path, PathBuf};

/// What can be written beside the files of studies.
const OTHERS: [&str; 4] = ["sweep", "car", "track", "channels"];

/// Flags of `init`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  lapswarm init car my_car.toml\n  lapswarm init identify study.toml")]
pub struct Arguments {
    /// What to write: a study's file, a sweep over a grid, a car with its tyre beside it, or a circuit from a survey, or a channel map
    #[arg(value_parser = PossibleValuesParser::new(registry::names().into_iter().chain(OTHERS)))]
    what: String,
    /// Where to [default: its name and .toml]; refused if it exists
    file: Option<PathBuf>,
}

/// Writes a file that must not be there yet.
fn write_new(path: &Path, text: &str) -> Result<()> {
    files::write_new(path, text.as_bytes()).map_err(|error| match error {
        Error::Io { source, .. } if source.kind() == std::io::ErrorKind::AlreadyExists => {
            let expected = "a file that does not exist: nothing is overwritten";
            Error::input(path, "FILE", "a file", expected)
        }
        error => error,
    })
}

/// Writes it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let what = arguments.what.as_str();
    let text = match what {
        "sweep" => include_str!("../../data/templates/sweep.toml").to_owned(),
        "track" => include_str!("../../data/templates/track.toml").to_owned(),
        "channels" => include_str!("../../data/templates/channels.toml").to_owned(),
        "car" => Car::BUNDLED_TOML.to_owned(),
        // The parser lets nothing else through.
        study => registry::named(study).map_or(String::new(), |study| study.template()),
    };
    let path = arguments
        .file
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{what}.toml")));
    if what == "car" {
        let tyre = path.with_file_name("gt_slick.tir");
        write_new(&tyre, Car::BUNDLED_TYRE)?;
        outln!("{}", tyre.display());
    }
    write_new(&path, &text)?;
    outln!("{}", path.display());
    Ok(())
}
