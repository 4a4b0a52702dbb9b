//! `lapswarm transient`.

use super::dry_run::Plan;
use super::{
    Begun, Common, Memory, Resume, backend_flag, going_on, print_json, progress, same_settings, stop_flag,
};
use crate::cli::said::{out, outln};
use glam::DVec2;
use lapswarm::evaluate::BackendChoice;
use lapswarm::study::journal::{Journal, Recorder};
use lapswarm::study::memory;
use lapswarm::study::raceline::{self, set_up};
use lapswarm::study::run_folder::{self, RunFolder};
use lapswarm::study::transient::{
    DriveRequest, DriveState, MOST_SETUPS, NamedLine, TransientSettings, drive_line_from,
    drive_population_recorded, read_line, summarise, summarise_population, table_of, write_population,
    write_results,
};
use lapswarm::vehicle::Car;
use lapswarm::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Flags of `transient`.
#[derive(clap::Args)]
#[command(
    after_help = "A driver needs room: half a metre on either side of the car, which a line found for a car one metre wider leaves.\n\nExample:\n  lapswarm raceline --car-width-m 3 --out fast\n  lapswarm transient --line fast/line_fastest.csv\n\nSeveral lines, or set-ups, are driven all at once, each with several shares of the grip; the fastest within the edges are listed:\n  lapswarm transient --line fast/line_fastest.csv --line fast/line_shortest.csv --setups 63 --parameters aero_balance_front,front_roll_moment_share"
)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    resume: Resume,
    #[command(flatten)]
    memory: Memory,
    /// The line to drive: a table that `raceline` wrote, or any with columns x_m and y_m; several times for several lines
    #[arg(long, value_name = "FILE", required_unless_present = "resume")]
    line: Vec<PathBuf>,
    /// The circuit, for its edges: a bundled name, a shape, or a file [default: silverstone_gp]
    #[arg(long, value_name = "NAME|FILE")]
    track: Option<String>,
    /// The car: a bundled name (gt) or a TOML file [default: gt]
    #[arg(long, value_name = "NAME|FILE")]
    car: Option<String>,
    /// The point mass's limits from a table instead of the car's own
    #[arg(long, value_name = "FILE")]
    envelope: Option<PathBuf>,
    /// Width of the car, m [default: 2]
    #[arg(long, value_name = "W")]
    car_width_m: Option<f64>,
    /// Drive this many set-ups of the car beside the car as it is
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=MOST_SETUPS as i64))]
    setups: Option<u32>,
    /// Parameters that set-ups move [default: front_roll_moment_share,aero_balance_front]
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "setups")]
    parameters: Option<Vec<String>>,
    /// How far each goes either way, as a share of its value [default: 0.1]
    #[arg(long, value_name = "SHARE", requires = "setups")]
    share: Option<f64>,
    /// Where set-ups and several lines are driven: auto, cpu, simd or gpu; one line alone is driven in f64
    #[arg(long, value_name = "BACKEND", value_parser = backend_flag)]
    backend: Option<BackendChoice>,
    /// Part of the name of the GPU to use
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
}

impl Arguments {
    /// Whether the flags name a backend or an adapter.
    fn moves(&self) -> bool {
        self.backend.is_some() || self.adapter.is_some()
    }

    /// What the flags ask for, over what the run that is gone on with was begun with.
    fn request(&self, base: Option<DriveRequest>) -> Result<DriveRequest> {
        fn set<T: Clone>(setting: &mut T, flag: &Option<T>) {
            if let Some(value) = flag {
                setting.clone_from(value);
            }
        }
        let mut r = base.unwrap_or_default();
        if !self.line.is_empty() {
            r.lines.clone_from(&self.line);
        }
        set(&mut r.track, &self.track);
        set(&mut r.car, &self.car);
        set(&mut r.car_width_m, &self.car_width_m);
        if self.envelope.is_some() {
            r.envelope.clone_from(&self.envelope);
        }
        let several = self.setups.is_some() || r.lines.len() > 1 || r.population.is_some();
        if several {
            let p = r.population.get_or_insert_default();
            p.setups = self.setups.map_or(p.setups, |n| n as usize);
            set(&mut p.parameters, &self.parameters);
            set(&mut p.share, &self.share);
            set(&mut p.seed, &self.common.seed);
            set(&mut p.backend, &self.backend);
            if self.adapter.is_some() {
                p.adapter.clone_from(&self.adapter);
            }
            p.car_width_m = r.car_width_m;
        } else {
            let elsewhere = matches!(self.backend, Some(BackendChoice::Simd | BackendChoice::Gpu));
            if elsewhere || self.adapter.is_some() {
                let expected = "--backend cpu, --setups N, or several lines: one line is driven in f64 alone";
                return Err(Error::input(
                    "the command line",
                    "--backend",
                    "one line and no set-ups",
                    expected,
                ));
            }
        }
        Ok(r.absolute())
    }
}

/// What would be driven: lines that leave room between the edges (m, right and left).
fn plan_of(
    request: &DriveRequest,
    road: &raceline::Setup,
    lines: &[NamedLine],
    edges_m: [&[DVec2]; 2],
) -> Result<Plan> {
    let several = request.population.as_ref();
    let resolved = serde_json::json!({
        "line": request.lines,
        "track": request.track,
        "car": request.car,
        "envelope": request.envelope,
        "car_width_m": request.car_width_m,
        "setups": several.map(|p| p.setups),
        "parameters": several.map(|p| &p.parameters),
        "share": several.map(|p| p.share),
    });
    lines
        .iter()
        .try_fold(Plan::with("transient", resolved).of_road(road), |plan, line| {
            let circuit = line.circuit(edges_m, request.car_width_m)?;
            Ok(plan.reads(format!("line {}, {:.1} m", line.name, circuit.length_m)))
        })
}

/// What reports call the lines: their files' names, with the folders where these are not enough.
fn names_of(files: &[PathBuf]) -> Vec<String> {
    let text =
        |part: Option<&std::ffi::OsStr>| part.map_or(String::new(), |s| s.to_string_lossy().into_owned());
    let stem = |path: &Path| text(path.file_stem());
    let within = |path: &Path| format!("{}/{}", text(path.parent().and_then(Path::file_name)), stem(path));
    let whole = |path: &Path| path.display().to_string();
    let lone = |of: &dyn Fn(&Path) -> String, path: &Path| {
        let name = of(path);
        (files.iter().filter(|f| of(f) == name).count() == 1).then_some(name)
    };
    files
        .iter()
        .map(|path| {
            lone(&stem, path)
                .or_else(|| lone(&within, path))
                .unwrap_or_else(|| whole(path))
        })
        .collect()
}

/// Drives several lines or set-ups and prints.
fn run_population(arguments: &Arguments, stop: &AtomicBool, begun: Begun<DriveRequest>) -> Result<()> {
    let began = Instant::now();
    let request = begun.settings;
    let settings = request.population.clone().unwrap_or_default();
    let _allowed = memory::check(
        &settings.kept(request.lines.len()),
        arguments.memory.memory_limit_mib,
    )?;
    let names = names_of(&request.lines).into_iter();
    let lines = names
        .zip(&request.lines)
        .map(|(name, file)| {
            Ok(NamedLine {
                name,
                points_m: read_line(file)?,
            })
        })
        .collect::<Result<Vec<_>>>()?;
    let setup = set_up(&request.raceline())?;
    let car = Car::load(&request.car)?;
    settings.check(&car)?;
    let edges = [setup.edges_m[0].as_slice(), setup.edges_m[1].as_slice()];
    if arguments.common.dry_run {
        return plan_of(&request, &setup, &lines, edges)?
            .seed(settings.seed)
            .evaluations(settings.laps(lines.len()) as u64)
            .memory_mib(memory::needed_mib(&settings.kept(lines.len())))
            .backend(settings.backend, settings.adapter.as_deref())?
            .tell(&arguments.common);
    }
    let folder = match begun.folder {
        Some(folder) => folder,
        None => run_folder::create("transient", arguments.common.out.as_deref())?,
    };
    let mut keeper = arguments.resume.keeper(&folder, arguments.moves());
    keeper.keep(&begun.journal)?;
    let mut recorder = Recorder::new(begun.journal, &mut keeper);
    let bar = progress::counting(arguments.common.quiet);
    let observe = |done: usize, planned: usize| {
        bar.set_length(planned as u64);
        bar.set_position(done as u64);
        going_on(stop)
    };
    let driven =
        drive_population_recorded(&car, &setup.car, &lines, edges, &settings, &mut recorder, observe);
    bar.finish_and_clear();
    let driven = arguments
        .resume
        .or_nothing(driven, &keeper, Journal::is_untouched)?;
    let Some(outcome) = driven else {
        return Err(Error::Interrupted(folder.to_path_buf()));
    };
    let elapsed_s = began.elapsed().as_secs_f64();
    let summary = summarise_population(&car.name, &lines, &settings, &outcome, elapsed_s);
    write_population(&folder, &car, &lines, &outcome, &summary)?;
    if !outcome.interrupted {
        keeper.done()?;
    }
    if !arguments.common.quiet {
        out!("{}{}", table_of(&lines, &outcome), summary.to_text());
        outln!("Results: {}", folder.display());
    }
    if arguments.common.json {
        print_json(&summary)?;
    }
    if outcome.interrupted {
        return Err(Error::Interrupted(folder.to_path_buf()));
    }
    if summary.best.is_none() {
        return Err(Error::Study(
            "no set-up stays within the edges of any line with any share of the grip".to_owned(),
        ));
    }
    Ok(())
}

/// Drives and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.memory.in_force();
    let stop = stop_flag();
    let out = arguments.common.out.as_deref();
    if arguments.resume.resume {
        // Of a population there is a journal, of one line a state of its own.
        if let Ok((folder, state)) = arguments.resume.open::<DriveState>("transient", out) {
            let request = arguments.request(state.request.clone())?;
            same_settings(&folder, &state.request.as_ref(), &Some(&request))?;
            return run_line(arguments, &stop, request, (Some(folder), state));
        }
    } else {
        let request = arguments.request(None)?;
        if request.population.is_none() {
            let state = DriveState::of(request.clone());
            return run_line(arguments, &stop, request, (None, state));
        }
    }
    let moved: fn(&mut DriveRequest, &DriveRequest) = |kept, asked| {
        if let (Some(kept), Some(asked)) = (&mut kept.population, &asked.population) {
            kept.backend = asked.backend;
            kept.adapter.clone_from(&asked.adapter);
        }
    };
    let begun = arguments.resume.begin(
        "transient",
        out,
        |base| arguments.request(base),
        arguments.moves().then_some(moved),
    )?;
    run_population(arguments, &stop, begun)
}

/// Drives one line alone and prints.
fn run_line(
    arguments: &Arguments,
    stop: &AtomicBool,
    request: DriveRequest,
    (folder, state): (Option<RunFolder>, DriveState),
) -> Result<()> {
    let began = Instant::now();
    let Some(line) = request.lines.first() else {
        return Err(Error::input(
            "the command line",
            "--line",
            "none",
            "a line to drive",
        ));
    };
    let points = read_line(line)?;
    let setup = set_up(&request.raceline())?;
    let car = Car::load(&request.car)?;
    let settings = TransientSettings {
        car_width_m: request.car_width_m,
        ..TransientSettings::default()
    };
    let edges = [setup.edges_m[0].as_slice(), setup.edges_m[1].as_slice()];
    if arguments.common.dry_run {
        let line = NamedLine {
            name: "the line".to_owned(),
            points_m: points,
        };
        return plan_of(&request, &setup, &[line], edges)?
            .evaluations(settings.shares.len() as u64)
            .evaluated_by(BackendChoice::Cpu.would_be(None)?)
            .tell(&arguments.common);
    }
    let folder = match folder {
        Some(folder) => folder,
        None => run_folder::create("transient", arguments.common.out.as_deref())?,
    };
    let mut keeper = arguments.resume.keeper(&folder, false);
    let begun = (state, &mut keeper);
    let driven = drive_line_from(&car, &setup.car, &points, edges, &settings, begun, |_, _| {
        going_on(stop)
    });
    let driven = arguments
        .resume
        .or_nothing(driven, &keeper, DriveState::is_untouched)?;
    let Some(outcome) = driven else {
        return Err(Error::Interrupted(folder.to_path_buf()));
    };
    let summary = summarise(&car.name, &outcome, began.elapsed().as_secs_f64());
    write_results(&folder, &outcome, &summary)?;
    keeper.done()?;
    if !arguments.common.quiet {
        out!("{}", summary.to_text());
        outln!("Results: {}", folder.display());
    }
    if arguments.common.json {
        print_json(&summary)?;
    }
    if summary.agrees {
        return Ok(());
    }
    Err(Error::Study(format!(
        "the driven lap is {:+.2}% off the point mass's, more than half a percent",
        summary.disagreement_percent
    )))
}
