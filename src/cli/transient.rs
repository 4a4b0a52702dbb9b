//! `lapswarm transient`.

use super::{Common, print_json};
use lapswarm::Error;
use lapswarm::Result;
use lapswarm::study::raceline::{RacelineSettings, set_up};
use lapswarm::study::run_folder;
use lapswarm::study::transient::{TransientSettings, drive_line, read_line, summarise, write_results};
use lapswarm::vehicle::Car;
use std::path::PathBuf;
use std::time::Instant;

/// Flags of `transient`.
#[derive(clap::Args)]
#[command(
    after_help = "A driver needs room: half a metre on either side of the car, which a line found for a car one metre wider leaves.\n\nExample:\n  lapswarm raceline --car-width-m 3 --out fast\n  lapswarm transient --line fast/line_fastest.csv"
)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The line to drive: a table that `raceline` wrote, or any with columns x_m and y_m
    #[arg(long, value_name = "FILE")]
    line: PathBuf,
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
}

/// Drives and prints.
pub fn run(arguments: &Arguments) -> Result<()> {
    let began = Instant::now();
    let points = read_line(&arguments.line)?;
    let setup = set_up(&RacelineSettings {
        track: arguments.track.clone(),
        car: arguments.car.clone(),
        envelope: arguments.envelope.clone(),
        car_width_m: arguments.car_width_m,
        ..RacelineSettings::default()
    })?;
    let car = Car::load(&arguments.car)?;
    let folder = run_folder::create("transient", arguments.common.out.as_deref())?;
    let settings = TransientSettings {
        car_width_m: arguments.car_width_m,
        ..TransientSettings::default()
    };
    let edges = [setup.edges_m[0].as_slice(), setup.edges_m[1].as_slice()];
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
