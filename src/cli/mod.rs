//! Subcommands, their flags and their exit codes.

mod bench;
mod check;
mod devices;
mod export;
mod init;
mod measurement;
mod output;
mod parity;
mod progress;
mod report;
mod reproduce;
mod simulate;
mod study;
mod sweep;

use clap::error::{ContextKind, ContextValue};
use clap::{ArgMatches, Args, Command, FromArgMatches, Subcommand};
use lapswarm::config::kinds::Choice;
use lapswarm::error::Field;
use lapswarm::evaluate::BackendChoice;
use lapswarm::hold::{self, Point};
use lapswarm::study::framework::memory::USUAL_MIB;
use lapswarm::study::registry::{self, STUDIES};
use lapswarm::{Error, Result};
use output::{errln, out};
use std::ffi::OsString;
use std::num::{ParseFloatError, ParseIntError};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// What there is beside the studies.
#[derive(Subcommand)]
enum Tool {
    /// Run the same study over a grid of settings and seeds, with medians.
    Sweep(sweep::Arguments),
    /// Make the thesis's tables, chapter by chapter, with the published figures beside ours.
    Reproduce(reproduce::Arguments),
    /// Drive a car round a circuit and log it.
    Simulate(simulate::Arguments),
    /// Lay runs side by side on one page: figures, laps, g-g-v envelopes.
    Report(report::Arguments),
    /// Write laps of runs for MoTeC i2: .ld, .ldx and CSV.
    Export(export::Arguments),
    /// Write a commented study, car or track file to start from.
    Init(init::Arguments),
    /// Read files as the studies do, and say what is in them or what is wrong.
    Check(check::Arguments),
    /// Print a shell's completions.
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// List the GPUs that evaluations can run on, with their limits.
    Devices(devices::Arguments),
    /// Compare the kernels of this machine with the f64 reference.
    Parity(parity::Arguments),
    /// Measure evaluations per second against population on every backend present, or compare optimisers.
    Bench(bench::Arguments),
}

/// The whole command line.
fn command() -> Command {
    let studies = STUDIES.iter().map(|study| study::command(*study));
    let command = Tool::augment_subcommands(Command::new("lapswarm").subcommands(studies));
    command
        .version(env!("CARGO_PKG_VERSION"))
        // After the tools, which bring words of their own.
        .about("Evaluate whole swarms of race cars at once")
        .subcommand_required(true)
        .arg_required_else_help(true)
        .after_help(
            "Exit codes: 0 done, 1 the study failed to reach what it was asked to, 2 bad input, 3 no usable device, 130 \
             interrupted (what was reached is saved).\n\nExamples:\n  lapswarm run\n  lapswarm identify study.toml --seed 7 \
             --json\n  lapswarm simulate --rate 100 --out lap\n  lapswarm devices",
        )
}

/// Flags of everything that writes into a run folder.
#[derive(Args, Clone, Default)]
pub struct Common {
    /// The run folder; refused if it holds another run [default: the next runs/STUDY-NNN]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print one JSON object on stdout; tables go to stderr
    #[arg(long)]
    pub json: bool,
    /// No progress bar and no table
    #[arg(long)]
    pub quiet: bool,
    /// Read and check all that is needed, say what would be done, and write nothing
    #[arg(long)]
    pub dry_run: bool,
}

/// The flag of studies whose size is checked.
#[derive(Args, Clone)]
pub struct Memory {
    /// Memory that the study may take, MiB; populations are evaluated in portions to stay below, and what cannot be split
    /// and needs more is refused
    #[arg(long, value_name = "MIB", default_value_t = USUAL_MIB, value_parser = clap::value_parser!(u64).range(1..))]
    pub memory_limit_mib: u64,
}

/// Parses `--backend`.
fn backend_flag(name: &str) -> Result<BackendChoice, String> {
    BackendChoice::named(name).ok_or_else(|| format!("expected {}", BackendChoice::names()))
}

/// A second request to stop counts after this time: two that come closer may be one that took two ways.
const INSISTENT: Duration = Duration::from_secs(2);

/// A flag that rises when the user or the system asks the program to stop. A second request ends the program at once; what was
/// saved last stays.
fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    let mut first: Option<Instant> = None;
    let set = ctrlc::set_handler(move || {
        raised.store(true, Ordering::Relaxed);
        hold::release();
        if first.get_or_insert_with(Instant::now).elapsed() > INSISTENT {
            std::process::exit(130);
        }
    });
    if let Err(error) = set {
        tracing::warn!("an interrupt will end the program at once: {error}");
    }
    flag
}

/// What an observer answers: it ends the study once the flag of [`stop_flag`] is up.
fn stopped(stop: &AtomicBool) -> ControlFlow<()> {
    hold::pass(Point::Step);
    if stop.load(Ordering::Relaxed) {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

/// Runs the program with its arguments, of which the first is its name. Hands back its exit code; wrong flags and `--help` end
/// the process.
pub fn run(arguments: &[OsString]) -> u8 {
    let matches = match command().try_get_matches_from(arguments) {
        Ok(matches) => matches,
        Err(error) => refuse_flags(in_words(error), arguments),
    };
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_max_level(tracing::Level::WARN)
        .init();
    let json = asks_for_json(&matches);
    if json {
        output::set_words_aside();
    }
    let asked = matches
        .subcommand()
        .and_then(|(name, matches)| Some((registry::named(name)?, matches)));
    let outcome = match asked {
        Some((study, matches)) => study::run(study, matches),
        None => match Tool::from_arg_matches(&matches) {
            Ok(tool) => run_tool(&tool),
            Err(error) => error.exit(),
        },
    };
    // What went wrong before is the cause.
    match outcome.and_then(|()| output::finish()) {
        Ok(()) => 0,
        Err(error) => {
            let code = error.exit_code();
            if json {
                print_error_json(&error);
            }
            errln!("error: {error}");
            let whole = command();
            let asked = matches
                .subcommand_name()
                .and_then(|name| whole.find_subcommand(name));
            if let Some(advice) = asked.and_then(|asked| advice(&error, asked)) {
                errln!("help: {advice}");
            }
            code
        }
    }
}

/// Whether JSON is asked for, of a command or of one within it.
fn asks_for_json(matches: &ArgMatches) -> bool {
    let here = matches!(matches.try_get_one::<bool>("json"), Ok(Some(true)));
    here || matches
        .subcommand()
        .is_some_and(|(_, within)| asks_for_json(within))
}

/// An error of flags without the words of number parsers.
fn in_words(error: clap::Error) -> clap::Error {
    let expected = match std::error::Error::source(&error) {
        Some(cause) if cause.is::<ParseIntError>() => "expected a whole number of 0 or more",
        Some(cause) if cause.is::<ParseFloatError>() => "expected a number",
        _ => return error,
    };
    let said = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => text.clone(),
        _ => String::new(),
    };
    let (flag, value) = (said(ContextKind::InvalidArg), said(ContextKind::InvalidValue));
    let told = format!("invalid value '{value}' for '{flag}': {expected}\n");
    clap::Error::raw(error.kind(), told).with_cmd(&command())
}

/// Ends the program as clap does: with code 2 on bad flags, which are an object where JSON is asked for, and with 0 on --help.
fn refuse_flags(error: clap::Error, arguments: &[OsString]) -> ! {
    if error.use_stderr() && arguments.iter().any(|argument| argument == "--json") {
        let told = error.to_string();
        let told = told
            .lines()
            .next()
            .unwrap_or_default()
            .trim_start_matches("error: ");
        print_error_json(&Error::input(
            "the command line",
            "flags",
            told,
            "those of --help",
        ));
    }
    error.exit()
}

fn run_tool(tool: &Tool) -> Result<()> {
    match tool {
        Tool::Sweep(arguments) => sweep::run(arguments),
        Tool::Reproduce(arguments) => reproduce::run(arguments),
        Tool::Simulate(arguments) => simulate::run(arguments),
        Tool::Report(arguments) => report::run(arguments),
        Tool::Export(arguments) => export::run(arguments),
        Tool::Init(arguments) => init::run(arguments),
        Tool::Check(arguments) => check::run(arguments),
        Tool::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut command(), "lapswarm", &mut script);
            out!("{}", String::from_utf8_lossy(&script));
            Ok(())
        }
        Tool::Devices(arguments) => devices::run(arguments),
        Tool::Parity(arguments) => parity::run(arguments),
        Tool::Bench(arguments) => bench::run(arguments),
    }
}

/// What the user can do about an error, where that is known.
fn advice(error: &Error, command: &Command) -> Option<String> {
    Some(match error {
        Error::NoDevice(_) => {
            "`lapswarm devices` lists what there is; `--backend simd` needs no GPU".to_owned()
        }
        Error::Device(_) => "`--backend simd` runs the same study on the processor".to_owned(),
        Error::Memory { .. } => format!("`--{}` sets the limit", flag_of(command, "memory_limit_mib")?),
        Error::Input { place, .. } => {
            let Some(Field::Named(setting)) = &place.field else {
                return None;
            };
            format!("`--{}` sets it", flag_of(command, setting)?)
        }
        _ => return None,
    })
}

/// The flag of a setting. A setting of a table goes by its key within it.
fn flag_of<'a>(command: &'a Command, setting: &str) -> Option<&'a str> {
    let of_table = |id: &str| id.rsplit('.').next() == Some(setting);
    let mut flags = command.get_arguments();
    flags
        .find(|flag| flag.get_id() == setting || of_table(flag.get_id().as_str()))?
        .get_long()
}

/// Whether the JSON object that was asked for stands on stdout.
static JSON_TOLD: AtomicBool = AtomicBool::new(false);

/// A serialisable value as one JSON object.
fn to_json(value: &impl serde::Serialize) -> Result<String> {
    let failed = |e| Error::io("standard output", "write", std::io::Error::other(e));
    serde_json::to_string(value).map_err(failed)
}

/// Writes files that must not be there yet: none if one of them is.
fn write_new(files: &[(PathBuf, &[u8])]) -> Result<()> {
    let there = |path: &Path| {
        let expected = "a file that does not exist: nothing is overwritten";
        Error::input(path, "FILE", "a file", expected)
    };
    if let Some((path, _)) = files.iter().find(|(path, _)| path.symlink_metadata().is_ok()) {
        return Err(there(path));
    }
    for (path, bytes) in files {
        lapswarm::files::write_new(path, bytes).map_err(|error| match error {
            Error::Io { source, .. } if source.kind() == std::io::ErrorKind::AlreadyExists => there(path),
            error => error,
        })?;
    }
    Ok(())
}

/// Prints a serialisable value as one JSON object on stdout.
fn print_json(value: &impl serde::Serialize) -> Result<()> {
    print_json_text(&to_json(value)?);
    Ok(())
}

/// As [`print_json`], of what is JSON already.
fn print_json_text(text: &str) {
    output::to_stdout(format_args!("{text}\n"));
    JSON_TOLD.store(true, Ordering::Relaxed);
}

/// Prints an error as a JSON object, where JSON was asked for and nothing else has been told.
fn print_error_json(error: &Error) {
    let place = error.place();
    let line = place.as_ref().and_then(|p| p.line_number());
    let field = place.as_ref().and_then(|p| p.name());
    let told = serde_json::json!({"error": {
        "message": error.to_string(),
        "file": error.file(),
        "line": line,
        "field": field,
    }});
    if !JSON_TOLD.load(Ordering::Relaxed) {
        // The error itself is what counts.
        let _ = print_json(&told);
        let _ = output::finish();
    }
}
