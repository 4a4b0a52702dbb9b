//! Tables and figures.

use super::figures::power_kw;
use super::reported_laps;
use crate::error::Result;
use crate::files::stem;
use crate::line::energy::SegmentEnergy;
use crate::report::Table;
use crate::study::hybrid::{HybridSetup, HybridStudySettings, Outcome, ReportedLap};
use std::path::Path;

pub fn write(
    folder: &Path,
    settings: &HybridStudySettings,
    setup: &HybridSetup,
    outcome: &Outcome,
) -> Result<()> {
    setup.car.car.write(folder, "car")?;
    let (x, y): (Vec<f64>, Vec<f64>) = setup.points_m.iter().map(|p| (p.x, p.y)).unzip();
    let line = Table::new().numbers("x", "m", x).numbers("y", "m", y);
    line.write_csv(folder.join("line.csv"))?;
    for lap in reported_laps(outcome) {
        write_lap(&folder.join(format!("lap_{}.csv", stem(&lap.name))), setup, lap)?;
    }
    if let Some(front) = outcome.optimised.as_ref().and_then(|o| o.swarm_front.as_ref()) {
        let mut table = Table::rows(front.objectives.iter().zip(&front.candidates));
        for (k, o) in settings.objectives.iter().enumerate() {
            table = table.number(o.name(), o.unit(), |(objectives, _)| objectives[k]);
        }
        for (k, name) in front.names.iter().enumerate() {
            table = table.number(name, "-", |(_, candidate)| candidate[k]);
        }
        table.table().write_csv(folder.join("front.csv"))?;
    }
    Ok(())
}

/// A lap, segment by segment: place, speed, powers at the wheels, energies, charge, fuel.
fn write_lap(path: &Path, setup: &HybridSetup, lap: &ReportedLap) -> Result<()> {
    let each = |f: fn(&SegmentEnergy<f64>) -> f64| lap.segments.iter().map(f).collect::<Vec<f64>>();
    let power = |f: fn(&SegmentEnergy<f64>) -> f64| power_kw(setup, lap, f);
    let store = &setup.car.hybrid.store;
    let change_j = lap.change_j();
    let soc = change_j[..lap.segments.len()]
        .iter()
        .map(|c| store.start_soc + c / store.capacity_j);
    Table::new()
        .numbers("station", "m", &lap.station_m)
        .numbers("v", "m/s", each(|s| s.start.sqrt()))
        .numbers("time", "s", each(|s| s.time))
        .numbers("engine_power", "kW", power(|s| s.engine))
        .numbers("motor_power", "kW", power(|s| s.motor))
        .numbers("generator_power", "kW", power(|s| s.generator))
        .numbers("brake_power", "kW", power(|s| s.hydraulic))
        .numbers("load", "-", each(|s| s.load))
        .numbers("deployed", "J", each(|s| s.deployed))
        .numbers("harvested_k", "J", each(|s| s.harvested_k))
        .numbers("harvested_h", "J", each(|s| s.harvested_h))
        .numbers("soc", "-", soc.collect::<Vec<f64>>())
        .numbers("fuel", "kg", each(|s| s.fuel))
        .write_csv(path)
}
