//! `lapswarm check`: is this file what it should be?

mod car;
mod draw;
mod log;
mod tyres;

pub use draw::draw_bundled;

use crate::cli::output::{errln, outln};
use lapswarm::config::{Document, read_start, read_text};
use lapswarm::line::read_line;
use lapswarm::study::registry::{self, Registered, STUDIES};
use lapswarm::study::sweep::{self, SweepSettings};
use lapswarm::telemetry::ChannelMap;
use lapswarm::track::{Circuit, Track};
use lapswarm::vehicle::tyre::TyreFile;
use lapswarm::vehicle::{Car, CarFacts, Envelope};
use lapswarm::{Error, Result};
use std::cmp::Reverse;
use std::path::{Path, PathBuf};

/// Flags of `check`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  lapswarm check car.toml lap.csv\n  lapswarm check lap.csv --car car.toml\n  lapswarm check outing.ld --write-map channels.toml\n  lapswarm check car.toml --draw pictures\n  lapswarm check soft.tir hard.tir --draw compared\n  lapswarm check --kind track survey.csv"
)]
pub struct Arguments {
    /// The files
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Draw one car, or one or two tyres beside each other, into this folder: figures, tables and a page. What has their names
    /// there is replaced
    #[arg(long, value_name = "DIR")]
    draw: Option<PathBuf>,
    /// The car that drove the logs, a bundled name or a file: its steering ratio, wheelbase and rolling radii are used to read them
    /// [default: the bundled car]
    #[arg(long, value_name = "NAME|FILE")]
    car: Option<String>,
    /// Channel map of the logs
    #[arg(long, value_name = "FILE")]
    channel_map: Option<PathBuf>,
    /// Write a channel map of the log into this file, to be edited; refused if it exists
    #[arg(long, value_name = "FILE")]
    write_map: Option<PathBuf>,
    /// What they are [default: guessed from their names and heads]
    #[arg(long, value_parser = kind_flag)]
    kind: Option<Kind>,
}

/// What a file is.
#[derive(Clone, Copy)]
enum Kind {
    File(&'static FileKind),
    Study(&'static dyn Registered),
}

/// Files that are no studies'.
struct FileKind {
    name: &'static str,
    /// What messages call it.
    words: &'static str,
    /// Reads it, and says in a line what is in it.
    read: fn(&Path) -> Result<String>,
}

const fn file(name: &'static str, words: &'static str, read: fn(&Path) -> Result<String>) -> FileKind {
    FileKind { name, words, read }
}

static CAR: FileKind = file("car", "a car", |path| {
    let car = Car::load(&path.display().to_string())?;
    let engine = if car.powertrain.is_some() {
        ""
    } else {
        ", no powertrain"
    };
    let text = format!("a car, {}: {} kg{engine}", car.name, car.chassis.mass);
    Ok(match CarFacts::asked(path) {
        Ok(Some(facts)) => format!("{text}\n{}", car::compared(&car, &facts)),
        // A bundled car has no file.
        _ => text,
    })
});

static TYRE: FileKind = file("tyre", "a tyre", |path| {
    TyreFile::read(path)?;
    Ok("a tyre".to_owned())
});

static TRACK: FileKind = file("track", "a track", |path| {
    let circuit = Track::load(&path.display().to_string())?.circuit()?;
    let shape = if circuit.closed { "closed" } else { "open" };
    let bridges = circuit.bridges();
    let bridges = bridges
        .iter()
        .map(|[a, b]| format!(", with a bridge where {a:.0} m and {b:.0} m cross"));
    Ok(format!(
        "a {shape} track, {}: {:.1} m{}{}",
        circuit.name,
        circuit.length_m,
        bridges.collect::<String>(),
        relief_in_words(&circuit)
    ))
});

/// Height, banking and friction of a circuit in words; nothing of a level and dry one.
fn relief_in_words(circuit: &Circuit) -> String {
    let (Some(relief), Some(facts)) = (&circuit.relief, circuit.relief_facts()) else {
        return String::new();
    };
    let change = &relief.change;
    let friction = if relief.is_dry() {
        String::new()
    } else {
        let [least, most] = facts.friction;
        format!("\n  friction {least:.2} to {most:.2} of the car's own")
    };
    if relief.is_level() {
        return friction;
    }
    let mut text = format!(
        "\n  climbs {:.1} m a lap, {:.1} m between its lowest and its highest point; steepest {:.1}% at {:.0} m; banked {:.1} degrees \
         at the most, at {:.0} m\n  smoothing changed its height by {:.2} m at the most ({:.2} m rms), its banking by {:.2} degrees",
        facts.climb_m,
        facts.range_m,
        100.0 * facts.gradient,
        facts.gradient_at_m,
        facts.bank_rad.to_degrees(),
        facts.bank_at_m,
        change.height_m,
        change.height_rms_m,
        change.bank_rad.to_degrees()
    );
    if change.gap_m != 0.0 {
        text += &format!(
            "\n  its end is given {:.2} m above its start: that is spread over the lap",
            change.gap_m
        );
    }
    text + &friction
}

static LOG: FileKind = file("log", "a log", |path| {
    log::described(path, log::Reading::default())
});

static CHANNELS: FileKind = file("channels", "a channel map", |path| {
    let map = ChannelMap::read(path)?;
    Ok(format!("a channel map of {} channels", map.channels.len()))
});

static ENVELOPE: FileKind = file("envelope", "a g-g-v envelope", |path| {
    let envelope = Envelope::load(path)?;
    Ok(format!(
        "a g-g-v envelope at {} speeds up to {:.1} m/s",
        envelope.rows().len(),
        envelope.top_speed_mps()
    ))
});

static LINE: FileKind = file("line", "a line", |path| {
    Ok(format!("a line of {} points", read_line(path)?.len()))
});

static SWEEP: FileKind = file("sweep", "a sweep", |path| {
    let planned = sweep::plan(&SweepSettings::load(&path.display().to_string())?)?;
    Ok(format!("a sweep: {planned}"))
});

static FILES: [&FileKind; 8] = [&CAR, &TYRE, &TRACK, &LOG, &CHANNELS, &ENVELOPE, &LINE, &SWEEP];

/// Parses `--kind`.
fn kind_flag(name: &str) -> Result<Kind, String> {
    let file = FILES.iter().find(|file| file.name == name);
    let study = || registry::named(name).map(Kind::Study);
    file.map(|file| Kind::File(file)).or_else(study).ok_or_else(|| {
        let files = FILES.iter().map(|file| file.name);
        let all: Vec<&str> = files.chain(registry::names()).collect();
        format!("expected one of {}", all.join(", "))
    })
}

impl Kind {
    /// What messages call it.
    fn name(self) -> String {
        match self {
            Self::File(file) => file.words.to_owned(),
            Self::Study(study) => format!("a study of {}", study.name()),
        }
    }

    /// Whether it is this kind of file.
    fn is(self, wanted: &'static FileKind) -> bool {
        matches!(self, Self::File(file) if std::ptr::eq(file, wanted))
    }

    /// Reads a file as what it is, and says in a line what is in it.
    fn read(self, path: &Path) -> Result<String> {
        match self {
            Self::File(file) => (file.read)(path),
            Self::Study(study) => Ok(format!("{}: {}", self.name(), study.check(path)?)),
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
        "tir" => return Ok(Kind::File(&TYRE)),
        "ld" | "vbo" => return Ok(Kind::File(&LOG)),
        "gpx" | "kml" => return Ok(Kind::File(&TRACK)),
        _ => {}
    }
    if extension == "toml" {
        let text = read_text(path)?;
        let document = Document::parse(path, &text)?;
        let keys: Vec<String> = document.root().keys().map(str::to_owned).collect();
        let has = |names: &[&str]| names.iter().any(|n| keys.iter().any(|k| k == n));
        // A surface's grid is a number.
        if matches!(document.root().table("grid"), Ok(Some(_))) {
            return Ok(Kind::File(&SWEEP));
        }
        if has(&["chassis"]) {
            return Ok(Kind::File(&CAR));
        }
        if has(&["survey", "curvature"]) {
            return Ok(Kind::File(&TRACK));
        }
        if has(&["channels", "vehicle"]) {
            return Ok(Kind::File(&CHANNELS));
        }
        if has(&["study", "base"]) {
            return Ok(Kind::File(&SWEEP));
        }
        // The study that knows most of the file's keys; of several the first in this order.
        const ORDER: [&str; 8] = [
            "identify",
            "raceline",
            "hybrid",
            "surface",
            "sensitivity",
            "run",
            "transient",
            "envelope",
        ];
        let rank = |study: &&&'static dyn Registered| {
            let declared = study.declared();
            let known = |key: &&String| declared.iter().any(|d| d.table().unwrap_or(d.key) == **key);
            let place = ORDER.iter().position(|name| *name == study.name());
            (
                Reverse(keys.iter().filter(known).count()),
                place.unwrap_or(ORDER.len()),
            )
        };
        if let Some(study) = STUDIES.iter().min_by_key(rank) {
            return Ok(Kind::Study(*study));
        }
    }
    // A log may be larger than any text, and need not be UTF-8.
    let start = read_start(path, HEAD)?;
    let start = String::from_utf8_lossy(&start);
    // The header may be the last of the comments at the top.
    let is_comment = |line: &&str| line.starts_with('#');
    let header = start.lines().take_while(is_comment).last();
    let mut others = start
        .lines()
        .filter(|line| !is_comment(line) && !line.trim().is_empty());
    let first = others.next().unwrap_or_default();
    let is_row = first
        .split([',', ';', '\t'])
        .next()
        .is_some_and(|cell| cell.trim().parse::<f64>().is_ok());
    let head = header.filter(|_| is_row).unwrap_or(first).to_lowercase();
    let names: Vec<&str> = head
        .split([',', ';', '\t'])
        .map(|cell| cell.trim_matches(['#', '"', ' ', '\r']))
        .collect();
    // Whole names: a log's `g_lat` and `g_long` are no places.
    let has = |wanted: &[&str]| wanted.iter().all(|w| names.contains(w));
    let has_one = |wanted: &[&str]| wanted.iter().any(|w| names.contains(w));
    let begins = |start: &str| names.iter().any(|name| name.starts_with(start));
    let in_plane = has(&["x_m", "y_m"]) || has(&["left_x_m", "left_y_m"]);
    let on_globe = has_one(&["lat", "latitude", "latitude_deg"])
        && has_one(&["lon", "lng", "longitude", "longitude_deg"]);
    let timed = names
        .iter()
        .any(|name| *name == "t" || name.starts_with("t ") || name.contains("time"));
    Ok(if has(&["v_mps", "ay_mps2"]) {
        Kind::File(&ENVELOPE)
    } else if begins("station") && begins("alpha") || has(&["x_m", "y_m", "psi_rad"]) && !begins("w") {
        Kind::File(&LINE)
    } else if (in_plane || on_globe) && !timed {
        Kind::File(&TRACK)
    } else {
        Kind::File(&LOG)
    })
}

/// Checks them all; the first that is wrong ends the program, once all have been told of. What is right is drawn, where that is
/// asked for.
pub fn run(arguments: &Arguments) -> Result<()> {
    let drawing = arguments.draw.as_deref();
    let drawing = drawing.map(|folder| Ok((draw::Subject::of(&arguments.files, arguments.kind)?, folder)));
    let drawing = drawing.transpose()?;
    let mut wrong: Option<Error> = None;
    for path in &arguments.files {
        let found = arguments.kind.map_or_else(|| guess(path), Ok).and_then(|kind| {
            // Whoever meant another kind sees why it is found wrong.
            let found = if kind.is(&LOG) {
                let reading = log::Reading {
                    car: arguments.car.as_deref(),
                    map: arguments.channel_map.as_deref(),
                    write: arguments.write_map.as_deref(),
                };
                log::described(path, reading)
            } else {
                kind.read(path)
            };
            found.inspect_err(|_| errln!("{}: read as {}", path.display(), kind.name()))
        });
        match found {
            Ok(text) => outln!("{}: {text}", path.display()),
            Err(error) if wrong.is_none() => wrong = Some(error),
            Err(error) => errln!("{error}"),
        }
    }
    if let Some(error) = wrong {
        return Err(error);
    }
    if let Some((subject, folder)) = drawing {
        outln!("{}", subject.draw(folder)?);
    }
    Ok(())
}
