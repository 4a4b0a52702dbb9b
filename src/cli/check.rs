//! `lapswarm check`: is this file what it should be?

use lapswarm::config::{Document, read_text};
use lapswarm::study::identify::IdentifySettings;
use lapswarm::study::raceline::RacelineSettings;
use lapswarm::study::run::RunSettings;
use lapswarm::study::sensitivity::SensitivitySettings;
use lapswarm::study::surface::SurfaceSettings;
use lapswarm::study::transient::read_line;
use lapswarm::telemetry::{ChannelMap, Log, LogOptions};
use lapswarm::track::Track;
use lapswarm::vehicle::tyre::TyreFile;
use lapswarm::vehicle::{Car, Envelope};
use lapswarm::{Error, Result};
use std::path::{Path, PathBuf};

/// Flags of `check`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm check car.toml lap.csv\n  lapswarm check --kind track survey.csv"
)]
pub struct Arguments {
    /// The files
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// What they are [default: guessed from their names and heads]
    #[arg(long)]
    kind: Option<Kind>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    Car,
    Tyre,
    Track,
    Log,
    Envelope,
    Line,
    Identify,
    Raceline,
    Run,
    Sensitivity,
    Surface,
}

/// What a file seems to be.
fn guess(path: &Path) -> Result<Kind> {
    let extension = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_lowercase();
    match extension.as_str() {
        "tir" => return Ok(Kind::Tyre),
        "ld" => return Ok(Kind::Log),
        "gpx" | "kml" => return Ok(Kind::Track),
        _ => {}
    }
    let text = read_text(path)?;
    if extension == "toml" {
        let document = Document::parse(path, &text)?;
        let keys: Vec<String> = document.root().keys().map(str::to_owned).collect();
        let has = |names: &[&str]| names.iter().any(|n| keys.iter().any(|k| k == n));
        return Ok(if has(&["chassis"]) {
            Kind::Car
        } else if has(&["survey", "curvature"]) {
            Kind::Track
        } else if has(&["samples", "resamples"]) {
            Kind::Sensitivity
        } else if has(&["grid"]) {
            Kind::Surface
        } else if has(&["identify", "raceline", "margin_m", "rounds"]) {
            Kind::Run
        } else if has(&["sections", "envelope", "car_width_m", "local_search"]) {
            Kind::Raceline
        } else {
            Kind::Identify
        });
    }
    let head = text.lines().next().unwrap_or_default().to_lowercase();
    let has = |names: &[&str]| names.iter().all(|n| head.contains(n));
    Ok(if has(&["v_mps", "ay_mps2"]) {
        Kind::Envelope
    } else if has(&["station", "alpha"]) {
        Kind::Line
    } else if has(&["x_m", "y_m"]) || has(&["lat", "lon"]) {
        Kind::Track
    } else {
        Kind::Log
    })
}

/// Reads a file as what it is, and says in a line what is in it.
fn read(path: &Path, kind: Kind) -> Result<String> {
    let name = path.display().to_string();
    Ok(match kind {
        Kind::Car => {
            let car = Car::load(&name)?;
            let engine = if car.powertrain.is_some() {
                ""
            } else {
                ", no powertrain"
            };
            format!("a car, {}: {} kg{engine}", car.name, car.chassis.mass)
        }
        Kind::Tyre => {
            TyreFile::read(path)?;
            "a tyre".to_owned()
        }
        Kind::Track => {
            let circuit = Track::load(&name)?.circuit()?;
            let shape = if circuit.closed { "closed" } else { "open" };
            format!("a {shape} track, {}: {:.1} m", circuit.name, circuit.length_m)
        }
        Kind::Log => {
            // As for an identification of the bundled car.
            let options = LogOptions {
                rolling_radius_m: Some(Car::bundled()?.chassis.radius_front),
                ..LogOptions::default()
            };
            let log = Log::read(path, &ChannelMap::default(), &options)?;
            format!(
                "a log of {} laps: {} samples at {:.0} Hz",
                log.laps.len(),
                log.time_s.len(),
                1.0 / log.dt_s
            )
        }
        Kind::Envelope => {
            let envelope = Envelope::load(path)?;
            format!(
                "limits at {} speeds up to {:.1} m/s",
                envelope.rows().len(),
                envelope.top_speed_mps()
            )
        }
        Kind::Line => format!("a line of {} points", read_line(path)?.len()),
        Kind::Identify => {
            let settings = IdentifySettings::read(path)?;
            format!("a study of identify: {} free parameters", settings.free.len())
        }
        Kind::Raceline => {
            let settings = RacelineSettings::read(path)?;
            format!(
                "a study of raceline: {}, {} sections",
                settings.track, settings.sections
            )
        }
        Kind::Run => {
            let settings = RunSettings::read(path)?;
            format!("a study of run: at most {} rounds", settings.rounds)
        }
        Kind::Sensitivity => {
            let settings = SensitivitySettings::read(path)?;
            settings.validate()?;
            format!("a study of sensitivity: {} samples", settings.samples)
        }
        Kind::Surface => {
            let settings = SurfaceSettings::read(path)?;
            settings.validate()?;
            format!(
                "a study of surface: {} over {}",
                settings.parameters[1], settings.parameters[0]
            )
        }
    })
}

/// Checks them all; the first that is wrong ends the program, once all have been told of.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut wrong: Option<Error> = None;
    for path in &arguments.files {
        let found = arguments
            .kind
            .map_or_else(|| guess(path), Ok)
            .and_then(|kind| read(path, kind));
        match found {
            Ok(text) => println!("{}: {text}", path.display()),
            Err(error) if wrong.is_none() => wrong = Some(error),
            Err(error) => eprintln!("{error}"),
        }
    }
    wrong.map_or(Ok(()), Err)
}
