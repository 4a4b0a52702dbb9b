//! `lapswarm transient`.

use super::dry_run::Plan;
use super::{Common, backend_flag, print_json, progress, stop_flag};
use glam::DVec2;
use lapswarm::Error;
use lapswarm::Result;
use lapswarm::evaluate::BackendChoice;
use lapswarm::study::raceline::{self, RacelineSettings, set_up};
use lapswarm::study::run_folder;
use lapswarm::study::transient::{
    MOST_SETUPS, NamedLine, PopulationSettings, TransientSettings, drive_line, drive_population, read_line,
    summarise, summarise_population, table_of, write_population, write_results,
};
use lapswarm::vehicle::Car;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Flags of `transient`.
#[derive(clap::Args)]
#[command(
    after_help = "A driver needs room: half a metre on either side of the car, which a line found for a car one metre wider leaves.\n\nExample:\n  lapswarm raceline --car-width-m 3 --out fast\n  lapswarm transient --line fast/line_fastest.csv\n\nSeveral lines, or set-ups, are driven all at once, each with several shares of the grip; the fastest within the edges are listed:\n  lapswarm transient --line fast/line_fastest.csv --line fast/line_shortest.csv --setups 63 --parameters aero_balance_front,front_roll_moment_share"
)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The line to drive: a table that `raceline` wrote, or any with columns x_m and y_m; several times for several lines
    #[arg(long, value_name = "FILE", required = true)]
    line: Vec<PathBuf>,
    /// The circuit, for its edges: a bundled name, a shape, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "silverstone_gp")]
    track: String,
    /// The car: a bundled name (gt) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "gt")]
    car: String,
    /// The point mass's limits from a table instead of the car's own
    #[arg(long, value_name = "FILE")]
    envelope: Option<PathBuf>,
    /// Width of the car, m
    #[arg(long, value_name = "W", default_value_t = 2.0)]
    car_width_m: f64,
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
    /// What the circuit and the limits are set up from.
    fn raceline(&self) -> RacelineSettings {
        RacelineSettings {
            track: self.track.clone(),
            car: self.car.clone(),
            envelope: self.envelope.clone(),
            car_width_m: self.car_width_m,
            ..RacelineSettings::default()
        }
    }

    /// What would be driven: lines that leave room between the edges (m, right and left).
    fn plan(&self, road: &raceline::Setup, lines: &[NamedLine], edges_m: [&[DVec2]; 2]) -> Result<Plan> {
        let resolved = serde_json::json!({
            "line": self.line,
            "track": self.track,
            "car": self.car,
            "envelope": self.envelope,
            "car_width_m": self.car_width_m,
            "setups": self.setups,
            "parameters": self.parameters,
            "share": self.share,
        });
        lines
            .iter()
            .try_fold(Plan::with("transient", resolved).of_road(road), |plan, line| {
                let circuit = line.circuit(edges_m, self.car_width_m)?;
                Ok(plan.reads(format!("line {}, {:.1} m", line.name, circuit.length_m)))
            })
    }
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
fn run_population(arguments: &Arguments) -> Result<()> {
    let began = Instant::now();
    let names = names_of(&arguments.line).into_iter();
    let lines = names
        .zip(&arguments.line)
        .map(|(name, file)| {
            Ok(NamedLine {
                name,
                points_m: read_line(file)?,
            })
        })
        .collect::<Result<Vec<_>>>()?;
    let setup = set_up(&arguments.raceline())?;
    let car = Car::load(&arguments.car)?;
    let base = PopulationSettings::default();
    let settings = PopulationSettings {
        setups: arguments.setups.unwrap_or(0) as usize,
        parameters: arguments.parameters.clone().unwrap_or(base.parameters),
        share: arguments.share.unwrap_or(base.share),
        car_width_m: arguments.car_width_m,
        seed: arguments.common.seed.unwrap_or(base.seed),
        backend: arguments.backend.unwrap_or(base.backend),
        adapter: arguments.adapter.clone(),
        ..base
    };
    let edges = [setup.edges_m[0].as_slice(), setup.edges_m[1].as_slice()];
    if arguments.common.dry_run {
        settings.check(&car)?;
        return arguments
            .plan(&setup, &lines, edges)?
            .seed(settings.seed)
            .evaluations(settings.laps(lines.len()) as u64)
            .backend(settings.backend, settings.adapter.as_deref())?
            .tell(&arguments.common);
    }
    let folder = run_folder::create("transient", arguments.common.out.as_deref())?;
    let stop = stop_flag();
    let bar = progress::counting(arguments.common.quiet);
    let outcome = drive_population(&car, &setup.car, &lines, edges, &settings, |done, planned| {
        bar.set_length(planned as u64);
        bar.set_position(done as u64);
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })?;
    bar.finish_and_clear();
    let elapsed_s = began.elapsed().as_secs_f64();
    let summary = summarise_population(&car.name, &lines, &settings, &outcome, elapsed_s);
    write_population(&folder, &car, &lines, &outcome, &summary)?;
    if !arguments.common.quiet {
        print!("{}{}", table_of(&lines, &outcome), summary.to_text());
        println!("Results: {}", folder.display());
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
    let [line] = arguments.line.as_slice() else {
        return run_population(arguments);
    };
    if arguments.setups.is_some() {
        return run_population(arguments);
    }
    let elsewhere = matches!(arguments.backend, Some(BackendChoice::Simd | BackendChoice::Gpu));
    if elsewhere || arguments.adapter.is_some() {
        let expected = "--backend cpu, --setups N, or several lines: one line is driven in f64 alone";
        return Err(Error::input(
            "the command line",
            "--backend",
            "one line and no set-ups",
            expected,
        ));
    }
    let began = Instant::now();
    let points = read_line(line)?;
    let setup = set_up(&arguments.raceline())?;
    let car = Car::load(&arguments.car)?;
    let settings = TransientSettings {
        car_width_m: arguments.car_width_m,
        ..TransientSettings::default()
    };
    let edges = [setup.edges_m[0].as_slice(), setup.edges_m[1].as_slice()];
    if arguments.common.dry_run {
        let line = NamedLine {
            name: "the line".to_owned(),
            points_m: points,
        };
        return arguments
            .plan(&setup, &[line], edges)?
            .evaluations(settings.shares.len() as u64)
            .evaluated_by(BackendChoice::Cpu.would_be(None)?)
            .tell(&arguments.common);
    }
    let folder = run_folder::create("transient", arguments.common.out.as_deref())?;
    let outcome = drive_line(&car, &setup.car, &points, edges, &settings)?;
    let summary = summarise(&car.name, &outcome, began.elapsed().as_secs_f64());
    write_results(&folder, &outcome, &summary)?;
    if !arguments.common.quiet {
        print!("{}", summary.to_text());
        println!("Results: {}", folder.display());
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
