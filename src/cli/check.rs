//! `lapswarm check`: is this file what it should be?

use crate::cli::said::{errln, outln};
use lapswarm::config::{Document, read_start, read_text};
use lapswarm::study::hybrid::{self, HybridStudySettings};
use lapswarm::study::identify::{self, IdentifySettings};
use lapswarm::study::memory::USUAL_MIB;
use lapswarm::study::raceline::{self, RacelineSettings};
use lapswarm::study::run::RunSettings;
use lapswarm::study::sensitivity::{SensitivitySettings, set_up_sensitivity};
use lapswarm::study::surface::{SurfaceSettings, set_up_surface};
use lapswarm::study::sweep::{self, SweepSettings};
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
    Hybrid,
    Run,
    Sensitivity,
    Surface,
    Sweep,
}

impl Kind {
    /// What messages call it.
    fn name(self) -> &'static str {
        match self {
            Self::Car => "a car",
            Self::Tyre => "a tyre",
            Self::Track => "a track",
            Self::Log => "a log",
            Self::Envelope => "limits",
            Self::Line => "a line",
            Self::Identify => "a study of identify",
            Self::Raceline => "a study of raceline",
            Self::Hybrid => "a study of hybrid",
            Self::Run => "a study of run",
            Self::Sensitivity => "a study of sensitivity",
            Self::Surface => "a study of surface",
            Self::Sweep => "a sweep",
        }
    }
}

/// Bytes of a file that tell what it is: the first line of any table.
const HEAD: u64 = 1 << 16;

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
    if extension == "toml" {
        let text = read_text(path)?;
        let document = Document::parse(path, &text)?;
        let keys: Vec<String> = document.root().keys().map(str::to_owned).collect();
        let has = |names: &[&str]| names.iter().any(|n| keys.iter().any(|k| k == n));
        // A surface's grid is a number.
        if matches!(document.root().table("grid"), Ok(Some(_))) {
            return Ok(Kind::Sweep);
        }
        // A kind's own keys, those of the kinds that share keys with later ones first.
        let own: [(Kind, &[&str]); 8] = [
            (Kind::Car, &["chassis"]),
            (Kind::Track, &["survey", "curvature"]),
            (Kind::Sweep, &["study", "base"]),
            (Kind::Sensitivity, &["samples", "resamples"]),
            (Kind::Surface, &["grid", "parameters"]),
            (Kind::Run, &["identify", "raceline", "margin_m", "rounds"]),
            (
                Kind::Hybrid,
                &[
                    "scenarios",
                    "optimise",
                    "energy_mj",
                    "budgets_mj",
                    "spacing_m",
                    "line",
                    "stint_laps",
                    "stint_fuel_kg",
                    "match_lap_time_s",
                ],
            ),
            (
                Kind::Raceline,
                &[
                    "sections",
                    "envelope",
                    "car_width_m",
                    "as_surveyed",
                    "ellipse_exponent",
                    "entry_mps",
                    "warm_start",
                    "local_search",
                    "algorithm",
                    "groups",
                    "population",
                    "iterations",
                    "archive",
                ],
            ),
        ];
        let of = own.iter().find(|(_, names)| has(names));
        return Ok(of.map_or(Kind::Identify, |(kind, _)| *kind));
    }
    // A log may be larger than any text, and need not be UTF-8.
    let start = read_start(path, HEAD)?;
    let start = String::from_utf8_lossy(&start);
    let head = start.lines().next().unwrap_or_default().to_lowercase();
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
            identify::set_up(&without_log(&settings))?;
            format!("{}: {} free parameters", kind.name(), settings.free.len())
        }
        Kind::Raceline => {
            let settings = RacelineSettings::read(path)?;
            raceline::set_up(&settings)?;
            format!(
                "{}: {}, {} sections",
                kind.name(),
                settings.track,
                settings.sections
            )
        }
        Kind::Hybrid => {
            let settings = HybridStudySettings::read(path)?;
            hybrid::read_inputs(&settings)?;
            let count = settings.scenarios.len();
            format!("{}: {}, {count} scenarios", kind.name(), settings.track)
        }
        Kind::Run => {
            let settings = RunSettings::read(path)?;
            identify::set_up(&without_log(&settings.identify))?;
            raceline::set_up(&settings.line_of(&settings.identify.car, None))?;
            format!("{}: at most {} rounds", kind.name(), settings.rounds)
        }
        Kind::Sensitivity => {
            let mut settings = SensitivitySettings::read(path)?;
            settings.replay = without_log(&settings.replay);
            set_up_sensitivity(&settings)?;
            let count = settings.replay.free.len();
            format!(
                "{}: {count} parameters, {} samples",
                kind.name(),
                settings.samples
            )
        }
        Kind::Surface => {
            let mut settings = SurfaceSettings::read(path)?;
            settings.replay = without_log(&settings.replay);
            set_up_surface(&settings)?;
            let [x, y] = &settings.parameters;
            format!("{}: {y} over {x}", kind.name())
        }
        Kind::Sweep => {
            let planned = sweep::plan(&SweepSettings::load(&name)?, USUAL_MIB)?;
            format!("{}: {planned}", kind.name())
        }
    })
}

/// A study whose log is given with `--log` names laps that the bundled lap has not: these are not looked for.
fn without_log(settings: &IdentifySettings) -> IdentifySettings {
    let mut settings = settings.clone();
    if settings.log.is_none() {
        settings.laps.clear();
        settings.holdout.clear();
    }
    settings
}

/// Checks them all; the first that is wrong ends the program, once all have been told of.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut wrong: Option<Error> = None;
    for path in &arguments.files {
        let found = arguments.kind.map_or_else(|| guess(path), Ok).and_then(|kind| {
            // Whoever meant another kind sees why it is found wrong.
            read(path, kind).inspect_err(|_| errln!("{}: read as {}", path.display(), kind.name()))
        });
        match found {
            Ok(text) => outln!("{}: {text}", path.display()),
            Err(error) if wrong.is_none() => wrong = Some(error),
            Err(error) => errln!("{error}"),
        }
    }
    wrong.map_or(Ok(()), Err)
}
