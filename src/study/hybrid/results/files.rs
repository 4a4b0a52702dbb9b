//! Tables and figures.

use super::{HybridSummary, told_laps};
use crate::error::Result;
use crate::files::stem;
use crate::report::{Cells, Column, write_csv};
use crate::study::hybrid::{HybridSetup, HybridStudySettings, Outcome, ReportedLap};
use crate::study::run_folder::{Manifest, write_json, write_study};
use std::path::Path;

/// Written last: it says that the run is whole.
pub fn write_manifest(
    folder: &Path,
    settings: &HybridStudySettings,
    setup: &HybridSetup,
    outcome: &Outcome,
) -> Result<()> {
    let manifest = Manifest {
        track: Some(&setup.raceline.track_name),
        interrupted: outcome.interrupted,
        device_faults: &outcome.device_faults,
        longest_dispatch_ms: outcome.longest_dispatch_ms,
        ..Manifest::new("hybrid", settings.seed, &outcome.backend, &setup.car.name)
    };
    write_json(&folder.join("manifest.json"), &manifest)
}

pub fn write(
    folder: &Path,
    settings: &HybridStudySettings,
    setup: &HybridSetup,
    outcome: &Outcome,
    summary: &HybridSummary,
) -> Result<()> {
    write_json(&folder.join("summary.json"), summary)?;
    write_study(folder, &settings.to_toml())?;
    setup.car.car.write(folder, "car")?;
    let (x, y): (Vec<f64>, Vec<f64>) = setup.points_m.iter().map(|p| (p.x, p.y)).unzip();
    write_table(&folder.join("line.csv"), &[("x", "m", x), ("y", "m", y)])?;
    for lap in told_laps(outcome) {
        write_lap(&folder.join(format!("lap_{}.csv", stem(&lap.name))), setup, lap)?;
    }
    if let Some(front) = outcome.optimised.as_ref().and_then(|o| o.swarm_front.as_ref()) {
        let column = |rows: &[Vec<f64>], k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
        let mut table: Vec<(&str, &str, Vec<f64>)> = settings
            .objectives
            .iter()
            .enumerate()
            .map(|(k, o)| (o.name(), o.unit(), column(&front.objectives, k)))
            .collect();
        table.extend(
            front
                .names
                .iter()
                .enumerate()
                .map(|(k, name)| (name.as_str(), "-", column(&front.candidates, k))),
        );
        write_table(&folder.join("front.csv"), &table)?;
    }
    Ok(())
}

fn write_table(path: &Path, table: &[(&str, &str, Vec<f64>)]) -> Result<()> {
    let columns: Vec<Column<'_>> = table
        .iter()
        .map(|(name, unit, values)| Column {
            name,
            unit,
            cells: Cells::Numbers(values),
        })
        .collect();
    write_csv(path, &columns)
}

/// A lap, segment by segment: place, speed, powers at the wheels, energies, charge, fuel.
fn write_lap(path: &Path, setup: &HybridSetup, lap: &ReportedLap) -> Result<()> {
    let mass = setup.car.table.mass;
    let each = |f: &dyn Fn(&crate::line::energy::SegmentEnergy<f64>) -> f64| {
        lap.segments.iter().map(f).collect::<Vec<f64>>()
    };
    // A force over the mass, over a segment's length, in its time.
    let power = |f: &dyn Fn(&crate::line::energy::SegmentEnergy<f64>) -> f64| -> Vec<f64> {
        lap.segments
            .iter()
            .zip(&lap.length_m)
            .map(|(s, h)| mass * f(s) * h / s.time / 1e3)
            .collect()
    };
    let store = &setup.car.hybrid.store;
    let soc = lap.change_j()[..lap.segments.len()]
        .iter()
        .map(|c| store.start_soc + c / store.capacity_j)
        .collect();
    write_table(
        path,
        &[
            ("station", "m", lap.station_m.clone()),
            ("v", "m/s", each(&|s| s.start.sqrt())),
            ("time", "s", each(&|s| s.time)),
            ("engine_power", "kW", power(&|s| s.engine)),
            ("motor_power", "kW", power(&|s| s.motor)),
            ("generator_power", "kW", power(&|s| s.generator)),
            ("brake_power", "kW", power(&|s| s.hydraulic)),
            ("load", "-", each(&|s| s.load)),
            ("deployed", "J", each(&|s| s.deployed)),
            ("harvested_k", "J", each(&|s| s.harvested_k)),
            ("harvested_h", "J", each(&|s| s.harvested_h)),
            ("soc", "-", soc),
            ("fuel", "kg", each(&|s| s.fuel)),
        ],
    )
}
