//! `lapswarm init`: commented files to start from.

use crate::cli::said::outln;
use lapswarm::files;
use lapswarm::vehicle::Car;
use lapswarm::{Error, Result};
use std::path::{Path, PathBuf};

/// Flags of `init`.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  lapswarm init car my_car.toml\n  lapswarm init identify study.toml")]
pub struct Arguments {
    /// What to write
    what: Template,
    /// Where to [default: its name and .toml]; refused if it exists
    file: Option<PathBuf>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Template {
    /// A study of `identify`
    Identify,
    /// A study of `raceline`
    Raceline,
    /// A study of `hybrid`
    Hybrid,
    /// A study of `sensitivity`
    Sensitivity,
    /// A study of `surface`
    Surface,
    /// A sweep of a study over a grid
    Sweep,
    /// A study of `run`
    Run,
    /// A car, with its tyre beside it
    Car,
    /// A circuit from a survey
    Track,
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
    let (name, text) = match arguments.what {
        Template::Identify => ("identify", include_str!("../../data/templates/identify.toml")),
        Template::Raceline => ("raceline", include_str!("../../data/templates/raceline.toml")),
        Template::Hybrid => ("hybrid", include_str!("../../data/templates/hybrid.toml")),
        Template::Sensitivity => (
            "sensitivity",
            include_str!("../../data/templates/sensitivity.toml"),
        ),
        Template::Surface => ("surface", include_str!("../../data/templates/surface.toml")),
        Template::Sweep => ("sweep", include_str!("../../data/templates/sweep.toml")),
        Template::Run => ("run", include_str!("../../data/templates/run.toml")),
        Template::Track => ("track", include_str!("../../data/templates/track.toml")),
        Template::Car => ("car", Car::BUNDLED_TOML),
    };
    let path = arguments
        .file
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{name}.toml")));
    if matches!(arguments.what, Template::Car) {
        let tyre = path.with_file_name("gt_slick.tir");
        write_new(&tyre, Car::BUNDLED_TYRE)?;
        outln!("{}", tyre.display());
    }
    write_new(&path, text)?;
    outln!("{}", path.display());
    Ok(())
}
