//! `lapswarm simulate`.

use super::study::{print_plan, print_results};
use super::{Common, to_json};
use lapswarm::evaluate::BackendChoice;
use lapswarm::files::run_folder::{self, MANIFEST, SUMMARY};
use lapswarm::report::Table;
use lapswarm::report::compare::{Run, compare};
use lapswarm::simulate::{SensorSettings, SimulateSettings, Simulated, simulate_lap};
use lapswarm::study::framework::{Head, Manifest, Plan, RunRecord, Subject, with_tyres, write_json};
use lapswarm::study::identify::lap_format;
use lapswarm::telemetry::write_native;
use lapswarm::track::Track;
use lapswarm::vehicle::Car;
use lapswarm::{Error, Result};
use serde::Serialize;

/// Flags of `simulate`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The car: a bundled name (gt) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "gt")]
    car: String,
    /// The circuit: a bundled name, a TOML file, a survey (CSV, GPX, KML, log) or a shape
    #[arg(long, value_name = "NAME|FILE", default_value = "silverstone_gp")]
    track: String,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Sample rate of the log, Hz
    #[arg(long, value_name = "HZ", default_value_t = 50.0)]
    rate: f64,
    /// Runge-Kutta steps per sample with which the logged outputs are worked out; as many as the car needs without it
    #[arg(long, value_name = "N")]
    substeps: Option<usize>,
    /// Share of the tyres' friction that the driver uses
    #[arg(long, value_name = "SHARE")]
    pace: Option<f64>,
    /// Standard deviations of the sensors' noise: vx (m/s), ax, ay (m/s^2), yaw rate (rad/s)
    #[arg(long, value_name = "VX,AX,AY,R", value_delimiter = ',')]
    noise: Option<Vec<f64>>,
    /// Delays of the sensors, 1 s at the most: vx, ax, ay, yaw rate (s)
    #[arg(long, value_name = "VX,AX,AY,R", value_delimiter = ',')]
    delay: Option<Vec<f64>>,
}

#[derive(Serialize)]
struct Summary {
    study: &'static str,
    seed: u64,
    lap_time_s: f64,
    samples: usize,
    top_speed_mps: f64,
    slowest_mps: f64,
    greatest_ay_mps2: f64,
    log: String,
}

/// Greatest standard deviation of a sensor's noise, in the channel's unit: more than the channels themselves have.
const GREATEST_NOISE: f64 = 100.0;
/// Greatest delay of a sensor (s): twice as long as `identify` looks for, and far beyond what filters and buses come to.
const LONGEST_DELAY_S: f64 = 1.0;

/// Four figures of a flag, each from zero to `most`.
fn four(flag: &str, values: Option<&Vec<f64>>, most: f64) -> Result<[f64; 4]> {
    let values = values.map_or(&[0.0; 4][..], Vec::as_slice);
    match <[f64; 4]>::try_from(values) {
        Ok(four) if four.iter().all(|x| (0.0..=most).contains(x)) => Ok(four),
        _ => {
            let expected = format!("four numbers from 0 to {most}: vx, ax, ay, yaw rate");
            Err(Error::input(
                "the command line",
                flag,
                format!("{values:?}"),
                expected,
            ))
        }
    }
}

/// Drives and logs.
pub fn run(arguments: &Arguments) -> Result<()> {
    let car = Car::load(&arguments.car)?;
    let circuit = Track::load(&arguments.track)?.circuit()?;
    let mut settings = SimulateSettings {
        rate_hz: arguments.rate,
        substeps: arguments.substeps,
        sensors: SensorSettings {
            noise: four("--noise", arguments.noise.as_ref(), GREATEST_NOISE)?,
            delay_s: four("--delay", arguments.delay.as_ref(), LONGEST_DELAY_S)?,
        },
        seed: arguments.seed,
        ..SimulateSettings::default()
    };
    if let Some(pace) = arguments.pace {
        if !(pace > 0.0 && pace <= 1.5) {
            let (found, expected) = (pace.to_string(), "a share above 0 up to 1.5");
            return Err(Error::input("the command line", "--pace", found, expected));
        }
        settings.driver.pace = pace;
    }
    if arguments.common.dry_run {
        settings.check(&circuit)?;
        let resolved = serde_json::json!({
            "car": arguments.car,
            "track": arguments.track,
            "rate_hz": settings.rate_hz,
            "substeps": settings.substeps,
            "pace": settings.driver.pace,
            "noise": settings.sensors.noise,
            "delay_s": settings.sensors.delay_s,
        });
        let plan = Plan::with("simulate", resolved)
            .reads(format!("car {}", car.name))
            .reads(format!("track {}, {:.1} m", circuit.name, circuit.length_m))
            .seed(settings.seed)
            .evaluations(1)
            .evaluated_by(BackendChoice::Cpu.would_be(None)?)
            .into_folder(arguments.common.out.as_deref())?;
        return print_plan(&arguments.common, &plan);
    }
    let Simulated {
        log,
        substeps,
        moments,
    } = simulate_lap(&car, &circuit, &settings)?;
    let folder = run_folder::create("simulate", arguments.common.out.as_deref())?;
    let path = folder.join("lap.csv");
    let step_ms = 1e3 * log.dt_s / substeps as f64;
    let comment = format!("{}; outputs worked out at a step of {step_ms:.3} ms", log.source);
    write_native(&log, &path, &lap_format().comment(comment))?;
    let tyres = Table::new()
        .numbers("time", "s", &log.time_s)
        .numbers("distance", "m", &log.distance_m);
    let moments: Vec<_> = moments.into_iter().map(Some).collect();
    with_tyres(tyres, &moments).write_csv(folder.join("tyres.csv"))?;
    car.write(&folder, "truth")?;
    let greatest = |values: &[f64]| values.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    let summary = Summary {
        study: "simulate",
        seed: settings.seed,
        lap_time_s: log.duration_s(),
        samples: log.samples(),
        top_speed_mps: greatest(&log.vx_mps),
        slowest_mps: log.vx_mps.iter().copied().fold(f64::INFINITY, f64::min),
        greatest_ay_mps2: greatest(&log.ay_mps2),
        log: path.display().to_string(),
    };
    write_json(&folder.join(SUMMARY), &summary)?;
    let backend = BackendChoice::Cpu.would_be(None)?;
    let head = Head {
        study: summary.study.to_owned(),
        subject: Subject::on_track(settings.seed, &car.name, &circuit.name),
        record: RunRecord::of(&backend),
    };
    // The page of runs beside each other, of this one alone, which reads the manifest; without the page the run is not whole.
    let file = folder.join(MANIFEST);
    write_json(&file, &Manifest::new(head, ""))?;
    let written = Run::read(&folder)
        .and_then(|run| compare(&[run]))
        .and_then(|page| page.write(folder.join("report.html")));
    if let Err(error) = written {
        // Best effort: the error is what counts.
        let _ = std::fs::remove_file(&file);
        return Err(error);
    }
    let text = format!(
        "{}: {:.2} s, {:.1} to {:.1} m/s, up to {:.1} m/s^2 sideways\nLog: {}\n",
        log.source,
        summary.lap_time_s,
        summary.slowest_mps,
        summary.top_speed_mps,
        summary.greatest_ay_mps2,
        summary.log
    );
    print_results(&arguments.common, &text, None, &to_json(&summary)?);
    Ok(())
}
