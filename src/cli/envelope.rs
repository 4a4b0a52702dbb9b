//! `lapswarm envelope`.

use super::dry_run::Plan;
use super::{Common, backend_flag, print_json};
use crate::cli::said::{out, outln};
use lapswarm::Result;
use lapswarm::evaluate::BackendChoice;
use lapswarm::study::envelope::{
    EnvelopeSettings, MOST_STEERS, PopulationSettings, car_limits, speeds_of, steady_surface, summarise,
    write_results,
};
use lapswarm::study::run_folder;
use lapswarm::vehicle::Car;
use std::path::PathBuf;
use std::time::Instant;

/// Flags of `envelope`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The car: a bundled name (gt) or a TOML file, such as the one that `identify` writes
    #[arg(long, value_name = "NAME|FILE", default_value = "gt")]
    car: String,
    /// Slowest speed, m/s
    #[arg(long, value_name = "MPS", default_value_t = EnvelopeSettings::default().from_mps)]
    from_mps: f64,
    /// Greatest speed, m/s, if the engine goes that far
    #[arg(long, value_name = "MPS", default_value_t = EnvelopeSettings::default().to_mps)]
    to_mps: f64,
    /// Step between speeds, m/s
    #[arg(long, value_name = "MPS", default_value_t = EnvelopeSettings::default().step_mps)]
    step_mps: f64,
    /// Steering angles of the surface, from straight on to the lock
    #[arg(long, value_name = "N", default_value_t = PopulationSettings::default().steers as u32,
          value_parser = clap::value_parser!(u32).range(4..=MOST_STEERS as i64))]
    steers: u32,
    /// Where the surface is evaluated: auto, cpu, simd or gpu; the limits are worked out in f64
    #[arg(long, value_name = "BACKEND", value_parser = backend_flag, default_value = "auto")]
    backend: BackendChoice,
    /// Part of the name of the GPU to use
    #[arg(long, value_name = "NAME")]
    adapter: Option<String>,
    /// The run folder; refused if it holds another run [default: the next runs/envelope-NNN]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object as the last thing on stdout
    #[arg(long)]
    json: bool,
    /// No table
    #[arg(long)]
    quiet: bool,
    /// Read the car, say what would be done, and write nothing
    #[arg(long)]
    dry_run: bool,
}

/// Runs the study.
pub fn run(arguments: &Arguments) -> Result<()> {
    let car = Car::load(&arguments.car)?;
    let settings = EnvelopeSettings {
        from_mps: arguments.from_mps,
        to_mps: arguments.to_mps,
        step_mps: arguments.step_mps,
    };
    if arguments.dry_run {
        let speeds = speeds_of(&car, &settings)?;
        let resolved = serde_json::json!({
            "car": arguments.car,
            "from_mps": settings.from_mps,
            "to_mps": settings.to_mps,
            "step_mps": settings.step_mps,
            "steers": arguments.steers,
            "backend": format!("{:?}", arguments.backend).to_lowercase(),
            "adapter": arguments.adapter,
        });
        return Plan::with("envelope", resolved)
            .reads(format!("car {}, {} speeds", car.name, speeds.len()))
            .evaluations(speeds.len() as u64 * u64::from(arguments.steers))
            .backend(arguments.backend, arguments.adapter.as_deref())?
            .tell(&Common {
                out: arguments.out.clone(),
                json: arguments.json,
                quiet: arguments.quiet,
                ..Common::default()
            });
    }
    let began = Instant::now();
    let limits = car_limits(&car, &settings)?;
    let population = PopulationSettings {
        backend: arguments.backend,
        adapter: arguments.adapter.clone(),
        steers: arguments.steers as usize,
    };
    let surface = steady_surface(&car, &limits, &population)?;
    let elapsed_s = began.elapsed().as_secs_f64();
    let summary = summarise(&car.name, &limits, Some(&surface), elapsed_s);
    let folder = run_folder::create("envelope", arguments.out.as_deref())?;
    write_results(&folder, &limits, Some(&surface), &summary)?;
    if !arguments.quiet {
        out!("{}", summary.to_text(&limits));
        outln!("Results: {}", folder.display());
    }
    if arguments.json {
        print_json(&summary)?;
    }
    Ok(())
}
