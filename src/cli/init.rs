//! `lapswarm init`: commented files to start from.

use super::write_new;
use crate::cli::output::{errln, outln, to_stderr};
use clap::builder::PossibleValuesParser;
use lapswarm::config::settings::{Settings, Written};
use lapswarm::study::registry;
use lapswarm::vehicle::{Car, CarFacts};
use lapswarm::{Error, Result};
use std::io::BufRead;
use std::path::{Path, PathBuf};

/// What can be written beside the files of studies.
const OTHERS: [&str; 4] = ["sweep", "car", "track", "channels"];

/// Flags of `init`.
#[derive(clap::Args)]
#[command(after_help = after_help())]
pub struct Arguments {
    /// What to write: a study's file, a sweep over a grid, a car with its tyre beside it, a circuit from a survey, or a channel map
    #[arg(value_parser = PossibleValuesParser::new(registry::names().into_iter().chain(OTHERS)))]
    what: String,
    /// Where to [default: its name and .toml]; refused if it exists
    file: Option<PathBuf>,
    /// For a car: a fact that it is made from; several are separated by commas
    #[arg(long, value_name = "FACT=VALUE", value_delimiter = ',')]
    set: Vec<String>,
    /// For a car: ask for each fact that is not set; a line left empty takes what is shown
    #[arg(long)]
    ask: bool,
}

fn after_help() -> String {
    let mut text = "Facts of a car, for --set and --ask:\n".to_owned();
    for setting in CarFacts::settings() {
        let declared = &setting.declared;
        text += &format!("  {:<22} {}\n", declared.key, declared.described());
    }
    text + "\nExamples:\n  lapswarm init identify study.toml\n  lapswarm init car gt.toml\n  \
            lapswarm init car my_car.toml --ask\n  \
            lapswarm init car kart.toml --set mass_kg=160,wheelbase_m=1.04,corner_g=1.9,power_kw=22,top_speed_kmh=115"
}

/// What is known of a car, from `--set` and from answers.
fn facts(arguments: &Arguments) -> Result<CarFacts> {
    let mut facts = CarFacts::default();
    let settings = CarFacts::settings();
    let mut known: Vec<&str> = Vec::new();
    for given in &arguments.set {
        let Some((key, value)) = given.split_once('=') else {
            let expected = "FACT=VALUE, as in mass_kg=900";
            return Err(Error::input(
                "the command line",
                "--set",
                format!("`{given}`"),
                expected,
            ));
        };
        let (key, value) = (key.trim(), value.trim());
        let Some(setting) = settings.iter().find(|s| s.declared.key == key) else {
            let all: Vec<&str> = settings.iter().map(|s| s.declared.key).collect();
            let expected = format!("one of {}", all.join(", "));
            return Err(Error::input(
                "the command line",
                "--set",
                format!("`{key}`"),
                expected,
            ));
        };
        let parsed = setting.parse(&mut facts, value);
        parsed.map_err(|expected| Error::input("the command line", key, format!("`{value}`"), expected))?;
        known.push(setting.declared.key);
    }
    if arguments.ask {
        let mut lines = std::io::stdin().lock().lines();
        for setting in settings.iter().filter(|s| !known.contains(&s.declared.key)) {
            loop {
                let default = match setting.write(&facts) {
                    Some(Written::Value(value)) => value.trim_matches('"').to_owned(),
                    _ => "not known".to_owned(),
                };
                to_stderr(format_args!("{} [{default}]: ", setting.declared.described()));
                // Where answers end, what is shown is taken.
                let answer = lines.next().and_then(Result::ok).unwrap_or_default();
                let answer = answer.trim();
                let mut answered = facts.clone();
                if answer.is_empty() {
                    break;
                }
                match setting.parse(&mut answered, answer) {
                    Ok(()) => match answered.validate() {
                        Ok(()) => {
                            facts = answered;
                            break;
                        }
                        Err(error) => errln!("{}", error.of_file(Path::new("the answer"))),
                    },
                    Err(expected) => errln!("found `{answer}`, {expected}"),
                }
            }
        }
    }
    let place = Path::new("the command line");
    facts.validate().map_err(|error| error.of_file(place))?;
    Ok(facts)
}

/// Makes a car of what is known, and writes it with its tyre.
fn make_car(path: &Path, arguments: &Arguments) -> Result<()> {
    let facts = facts(arguments)?;
    let car = facts.car()?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut files = car.files(&stem);
    if let Some((_, text)) = files.last_mut() {
        *text += &format!(
            "\n# What the car was made from. `lapswarm check` compares the car with it.\n[asked]\n{}",
            facts.to_toml()
        );
    }
    let count = files.len();
    let placed = files.iter().enumerate().map(|(k, (name, text))| {
        let place = if k + 1 == count {
            path.to_owned()
        } else {
            path.with_file_name(name)
        };
        (place, text.as_bytes())
    });
    write_all(&placed.collect::<Vec<_>>())
}

/// Writes files that are not there yet, and names them.
fn write_all(files: &[(PathBuf, &[u8])]) -> Result<()> {
    write_new(files)?;
    for (path, _) in files {
        outln!("{}", path.display());
    }
    Ok(())
}

/// Writes it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let what = arguments.what.as_str();
    let facts_given = arguments.ask || !arguments.set.is_empty();
    if facts_given && what != "car" {
        let expected = "`init car`: no other file is made from facts";
        return Err(Error::input(
            "the command line",
            "--set or --ask",
            format!("`init {what}`"),
            expected,
        ));
    }
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
    if facts_given {
        return make_car(&path, arguments);
    }
    let mut files = Vec::new();
    if what == "car" {
        files.push((path.with_file_name("gt_slick.tir"), Car::BUNDLED_TYRE.as_bytes()));
    }
    files.push((path, text.as_bytes()));
    write_all(&files)
}
