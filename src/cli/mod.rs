//! Subcommands, their flags and their exit codes.

mod bench;
mod check;
mod devices;
mod dry_run;
mod envelope;
mod hybrid;
mod identify;
mod init;
mod kept;
mod parity;
mod progress;
mod raceline;
mod replay_flags;
mod report;
mod run;
mod said;
mod sensitivity;
mod simulate;
mod surface;
mod sweep;
mod transient;

use clap::{Args, CommandFactory, Parser, Subcommand};
use lapswarm::config::limit_memory;
use lapswarm::evaluate::replay::BackendChoice;
use lapswarm::study::identify::{FreeParameter, IdentifySettings, load_circuit, parse_backend};
use lapswarm::study::journal::Journal;
use lapswarm::study::keeper::Keeper;
use lapswarm::study::memory::USUAL_MIB;
use lapswarm::study::run_folder::{self, RunFolder};
use lapswarm::swarm::checkpoint::{self, Checkpoint};
use lapswarm::track::Circuit;
use lapswarm::{Error, Result};
use said::{errln, out, outln};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Evaluate whole swarms of race cars at once.
#[derive(Parser)]
#[command(
    version,
    after_help = "Exit codes: 0 done, 1 the study failed to reach what it was asked to, 2 bad input, 3 no usable \
                  device, 130 interrupted (what was reached is saved).\n\nExamples:\n  lapswarm identify\n  lapswarm \
                  identify study.toml --seed 7 --json\n  lapswarm simulate --rate 100 --out lap\n  lapswarm devices"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// The whole way from a log to a lap: the car, its limits, its line, and that line driven.
    Run(Box<run::Arguments>),
    /// Find a car's unknown parameters from a logged lap; with no argument, on the bundled lap.
    Identify(Box<identify::Arguments>),
    /// Drive a car round a circuit and log it.
    Simulate(simulate::Arguments),
    /// Find the line round a circuit: shortest, least curved, fastest, and the front between them.
    Raceline(Box<raceline::Arguments>),
    /// Find where a hybrid's energy goes on a lap and where it buys most: scenarios, swarm, exact optimum.
    Hybrid(Box<hybrid::Arguments>),
    /// Find a car's limits at each speed: the g-g-v diagram that racing lines are driven within.
    Envelope(envelope::Arguments),
    /// Find how much each parameter of a car matters to each channel of a lap.
    Sensitivity(Box<sensitivity::Arguments>),
    /// Lay runs side by side on one page: figures, laps, limits.
    Report(report::Arguments),
    /// Draw the costs of a lap over two parameters of a car.
    Surface(Box<surface::Arguments>),
    /// The same study over a grid of settings and seeds, with medians.
    Sweep(sweep::Arguments),
    /// Drive a racing line with the 4DOF car and a driver, and set its lap beside the point mass's.
    Transient(transient::Arguments),
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
    /// Hold the kernels that evaluate cars, lines and energies on this machine against the f64 reference.
    Parity(parity::Arguments),
    /// Measure evaluations per second against population on every backend present, or compare optimisers.
    Bench(bench::Arguments),
}

/// Flags that all studies share.
#[derive(Args, Clone, Default)]
pub struct Common {
    /// The run folder; refused if it holds another run [default: the next runs/STUDY-NNN]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Seed of all random numbers
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Print one JSON object as the last thing on stdout
    #[arg(long)]
    pub json: bool,
    /// No progress bar and no table
    #[arg(long)]
    pub quiet: bool,
    /// Read and check all that the study needs, say what it would do, and write nothing
    #[arg(long)]
    pub dry_run: bool,
}

/// The flag of studies that can be gone on with.
#[derive(Args, Clone)]
pub struct Resume {
    /// Go on with the run in --out that was broken off, with its own settings
    #[arg(long, requires = "out", conflicts_with = "dry_run")]
    pub resume: bool,
    /// Time between saves of the run's state, s
    #[arg(long, value_name = "SECONDS", default_value_t = 5.0, value_parser = pause_flag)]
    pub save_every_s: f64,
}

/// The flag of studies whose size is checked.
#[derive(Args, Clone)]
pub struct Memory {
    /// Memory that the study may take, MiB; populations are evaluated in portions to stay below, and what cannot be split
    /// and needs more is refused
    #[arg(long, value_name = "MIB", default_value_t = USUAL_MIB, value_parser = clap::value_parser!(u64).range(1..))]
    pub memory_limit_mib: u64,
}

fn pause_flag(text: &str) -> Result<f64, String> {
    let seconds = text
        .parse()
        .ok()
        .filter(|s| Duration::try_from_secs_f64(*s).is_ok());
    seconds.ok_or_else(|| "expected a time in seconds, 0 or more".to_owned())
}

impl Memory {
    /// Puts the limit in force, before anything large is read, and says it (MiB).
    fn in_force(&self) -> u64 {
        limit_memory(self.memory_limit_mib);
        self.memory_limit_mib
    }
}

impl Resume {
    /// What saves the run's state; `moves` if another backend may go on with it.
    fn keeper(&self, folder: &Path, moves: bool) -> Keeper {
        // The flag's parser has seen to what it can be.
        let interval = Duration::try_from_secs_f64(self.save_every_s).unwrap_or_default();
        let keeper = Keeper::new(folder).every(interval);
        if moves { keeper.may_move() } else { keeper }
    }

    /// What a study came to. Input that is refused only once the run has begun leaves nothing that stands in the way of the
    /// next: a new run's state in which nothing has been reached goes.
    fn or_nothing<T, S: Checkpoint>(
        &self,
        outcome: Result<T>,
        keeper: &Keeper,
        untouched: fn(&S) -> bool,
    ) -> Result<T> {
        let refused = matches!(
            outcome,
            Err(Error::Input { .. } | Error::Io { .. } | Error::NoDevice(_))
        );
        if refused && !self.resume && keeper.saved::<S>().is_some_and(|state| untouched(&state)) {
            keeper.done()?;
        }
        outcome
    }

    /// The run folder, and the state in it that is to be gone on with.
    fn open<T: Checkpoint>(&self, study: &str, out: Option<&Path>) -> Result<(RunFolder, T)> {
        let Some(out) = out else {
            let expected = format!("--out, the folder of a run of {study}");
            return Err(Error::input("the command line", "--resume", "no --out", expected));
        };
        let folder = run_folder::reopen(out)?;
        let state = checkpoint::load(&folder.join(run_folder::STATE))?;
        Ok((folder, state))
    }
}

/// A study that is begun, or gone on with by its journal.
struct Begun<S> {
    settings: S,
    journal: Journal,
    /// The folder of the run that is gone on with.
    folder: Option<RunFolder>,
}

impl Resume {
    /// Settings from study file and flags, over those that the run in `--out` was begun with if it is gone on with. `moved`
    /// puts the second settings' backend and adapter into the first.
    fn begin<S: Serialize + DeserializeOwned + PartialEq>(
        &self,
        study: &str,
        out: Option<&Path>,
        settings: impl FnOnce(Option<S>) -> Result<S>,
        moved: Option<fn(&mut S, &S)>,
    ) -> Result<Begun<S>> {
        if !self.resume {
            let settings = settings(None)?;
            let journal = Journal::new(study, &settings)?;
            return Ok(Begun {
                settings,
                journal,
                folder: None,
            });
        }
        let (folder, mut journal) = self.open::<Journal>(study, out)?;
        let mut kept: S = journal.settings(study)?;
        let asked = settings(Some(journal.settings(study)?))?;
        // Where candidates are evaluated may change, if that is said; what is evaluated may not.
        if let Some(moved) = moved {
            moved(&mut kept, &asked);
            journal.set_settings(&kept)?;
        }
        same_settings(&folder, &kept, &asked)?;
        Ok(Begun {
            settings: asked,
            journal,
            folder: Some(folder),
        })
    }
}

/// Flags and study files beside `--resume` may only say what the run was begun with.
fn same_settings<T: PartialEq>(folder: &Path, kept: &T, asked: &T) -> Result<()> {
    if kept == asked {
        return Ok(());
    }
    let file = folder.join(run_folder::STATE);
    let expected = "those that the run was begun with (study.toml beside it), or none";
    Err(Error::input(
        file,
        "settings",
        "other settings on the command line",
        expected,
    ))
}

/// Parses `--backend`.
fn backend_flag(name: &str) -> Result<BackendChoice, String> {
    parse_backend(name).ok_or_else(|| "expected auto, cpu, simd or gpu".to_owned())
}

/// Parameters by name, as free ones; bounds come from the settings where these have them.
fn named_parameters(settings: &IdentifySettings, names: &[String]) -> Vec<FreeParameter> {
    let known = |name: &String| settings.free.iter().find(|f| f.name == *name).cloned();
    names
        .iter()
        .map(|name| {
            known(name).unwrap_or(FreeParameter {
                name: name.clone(),
                lower: 0.0,
                upper: 1.0,
            })
        })
        .collect()
}

/// The circuit that comes with the program.
const BUNDLED_TRACK: &str = "silverstone_gp";

/// The circuit of a `--track`, or the bundled one.
fn circuit(track: Option<&str>) -> Result<Circuit> {
    load_circuit(track.unwrap_or(BUNDLED_TRACK))
}

/// Between a user's first request to stop and one that is another: those that come closer may be one that took two ways.
const INSISTENT: Duration = Duration::from_secs(2);

/// A flag that rises when the user or the system asks the program to stop. Who asks again later does not want to wait any
/// longer: what was saved last stays.
fn stop_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let raised = Arc::clone(&flag);
    let mut first: Option<Instant> = None;
    let set = ctrlc::set_handler(move || {
        raised.store(true, Ordering::Relaxed);
        if first.get_or_insert_with(Instant::now).elapsed() > INSISTENT {
            std::process::exit(130);
        }
    });
    if let Err(error) = set {
        tracing::warn!("an interrupt will end the program at once: {error}");
    }
    flag
}

/// What an observer answers while the flag of [`stop_flag`] is down, and once it is up.
fn going_on(stop: &AtomicBool) -> ControlFlow<()> {
    if stop.load(Ordering::Relaxed) {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

/// Runs the program.
pub fn run() -> ExitCode {
    // Clap ends with code 2 on bad flags and 0 on --help, as documented.
    let cli = Cli::parse();
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_max_level(tracing::Level::WARN)
        .init();
    // Lines are as wide as a terminal; where none is, whoever reads wants names and flags whole.
    let wraps = std::io::stderr().is_terminal();
    let _ = miette::set_hook(Box::new(move |_| {
        Box::new(miette::MietteHandlerOpts::new().wrap_lines(wraps).build())
    }));
    let outcome = match cli.command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Identify(arguments) => identify::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Raceline(arguments) => raceline::run(&arguments),
        Command::Hybrid(arguments) => hybrid::run(&arguments),
        Command::Envelope(arguments) => envelope::run(&arguments),
        Command::Sensitivity(arguments) => sensitivity::run(&arguments),
        Command::Report(arguments) => report::run(&arguments),
        Command::Surface(arguments) => surface::run(&arguments),
        Command::Sweep(arguments) => sweep::run(&arguments),
        Command::Transient(arguments) => transient::run(&arguments),
        Command::Init(arguments) => init::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "lapswarm", &mut script);
            out!("{}", String::from_utf8_lossy(&script));
            Ok(())
        }
        Command::Devices(arguments) => devices::run(&arguments),
        Command::Parity(arguments) => parity::run(&arguments),
        Command::Bench(arguments) => bench::run(&arguments),
    };
    // What went wrong before is the cause.
    match outcome.and_then(|()| said::finish()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = error.exit_code();
            let mut report = miette::MietteDiagnostic::new(error.to_string());
            report.help = advice(&error);
            errln!("{:?}", miette::Report::new(report));
            ExitCode::from(code)
        }
    }
}

/// What the user can do about an error, where that is known.
fn advice(error: &Error) -> Option<String> {
    Some(match error {
        Error::NoDevice(_) => {
            "`lapswarm devices` lists what there is; `--backend simd` needs no GPU".to_owned()
        }
        Error::Device(_) => "`--backend simd` runs the same study on the processor".to_owned(),
        _ => return None,
    })
}

/// Prints a serialisable value as one JSON object on stdout.
fn print_json(value: &impl serde::Serialize) -> Result<()> {
    let text = serde_json::to_string(value)
        .map_err(|e| Error::io("standard output", "write", std::io::Error::other(e)))?;
    outln!("{text}");
    Ok(())
}
