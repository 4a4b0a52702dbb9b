//! `lapswarm simulate`.

use super::{Common, circuit, print_json};
use lapswarm::Result;
use lapswarm::simulate::{SensorSettings, SimulateSettings, simulate_lap};
use lapswarm::study::identify::lap_format;
use lapswarm::study::run_folder;
use lapswarm::telemetry::write_native;
use lapswarm::vehicle::Car;
use serde::Serialize;

/// Flags of `simulate`.
#[derive(clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The car: a bundled name (gt) or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = "gt")]
    car: String,
    /// The circuit: a bundled name, a TOML file, a survey (CSV, GPX, KML, log) or a shape [default: silverstone_gp]
    #[arg(long, value_name = "NAME|FILE")]
    track: Option<String>,
    /// Sample rate of the log, Hz
    #[arg(long, value_name = "HZ", default_value_t = 50.0)]
    rate: f64,
    /// Runge-Kutta steps per sample with which the logged outputs are worked out
    #[arg(long, value_name = "N", default_value_t = 1)]
    substeps: usize,
    /// Share of the tyres' friction that the driver uses
    #[arg(long, value_name = "SHARE")]
    pace: Option<f64>,
    /// Standard deviations of the sensors' noise: vx (m/s), ax, ay (m/s^2), yaw rate (rad/s)
    #[arg(long, value_name = "VX,AX,AY,R", value_delimiter = ',')]
    noise: Option<Vec<f64>>,
    /// Delays of the sensors: vx, ax, ay, yaw rate (s)
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

/// Four figures of a flag, each at least nought.
fn four(flag: &str, values: Option<&Vec<f64>>) -> Result<[f64; 4]> {
    let values = values.map_or(&[0.0; 4][..], Vec::as_slice);
    match <[f64; 4]>::try_from(values) {
        Ok(four) if four.iter().all(|x| *x >= 0.0 && x.is_finite()) => Ok(four),
        _ => Err(lapswarm::Error::input(
            "the command line",
            flag,
            format!("{values:?}"),
            "four numbers of nought or more: vx, ax, ay, yaw rate",
        )),
    }
}

/// Drives and logs.
pub fn run(arguments: &Arguments) -> Result<()> {
    let car = Car::load(&arguments.car)?;
    let circuit = circuit(arguments.track.as_deref())?;
    let mut settings = SimulateSettings {
        rate_hz: arguments.rate,
        substeps: arguments.substeps,
        sensors: SensorSettings {
            noise: four("--noise", arguments.noise.as_ref())?,
            delay_s: four("--delay", arguments.delay.as_ref())?,
        },
        seed: arguments.common.seed.unwrap_or(1),
        ..SimulateSettings::default()
    };
    if let Some(pace) = arguments.pace {
        if !(pace > 0.0 && pace <= 1.5) {
            let found = pace.to_string();
            return Err(lapswarm::Error::input(
                "the command line",
                "--pace",
                found,
                "a share above 0 up to 1.5",
            ));
        }
        settings.driver.pace = pace;
    }
    let log = simulate_lap(&car, &circuit, &settings)?;
    let folder = run_folder::create("simulate", arguments.common.out.as_deref())?;
    let path = folder.join("lap.csv");
    let step_ms = 1e3 * log.dt_s / settings.substeps as f64;
    let comment = format!("{}; outputs worked out at a step of {step_ms:.3} ms", log.source);
    write_native(&log, &path, &lap_format().comment(comment))?;
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
    if !arguments.common.quiet {
        println!(
            "{}: {:.2} s, {:.1} to {:.1} m/s, up to {:.1} m/s^2 sideways\nLog: {}",
            log.source,
            summary.lap_time_s,
            summary.slowest_mps,
            summary.top_speed_mps,
            summary.greatest_ay_mps2,
            summary.log
        );
    }
    if arguments.common.json {
        print_json(&summary)
    } else {
        Ok(())
    }
}
