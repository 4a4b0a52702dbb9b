//! Tables and figures.

use super::{Summary, told_lines};
use crate::error::Result;
use crate::files::stem;
use crate::report::{Cells, Column, write_csv, write_whole};
use crate::study::raceline::{Outcome, RacelineSettings, ReportedLine, Setup};
use crate::study::run_folder::{Manifest, write_json};
use std::path::Path;

/// Written last: it says that the run is whole.
pub fn write_manifest(
    folder: &Path,
    settings: &RacelineSettings,
    setup: &Setup,
    outcome: &Outcome,
) -> Result<()> {
    let manifest = Manifest {
        track: Some(&setup.track_name),
        interrupted: outcome.interrupted,
        device_faults: &outcome.device_faults,
        longest_dispatch_ms: outcome.longest_dispatch_ms,
        ..Manifest::new("raceline", settings.seed, &outcome.backend, &setup.car_name)
    };
    write_json(&folder.join("manifest.json"), &manifest)
}

pub fn write(
    folder: &Path,
    settings: &RacelineSettings,
    setup: &Setup,
    outcome: &Outcome,
    summary: &Summary,
) -> Result<()> {
    write_json(&folder.join("summary.json"), summary)?;
    super::write_settings(folder, settings)?;
    write_whole(
        folder.join("envelope.csv"),
        setup.car.envelope.to_csv().as_bytes(),
    )?;
    for line in told_lines(outcome) {
        let name = stem(&line.name);
        write_line(&folder.join(format!("line_{name}.csv")), setup, line)?;
        // Over what a run that was broken off has left: it is gone on with in the same folder.
        write_whole(
            folder.join(format!("racetrack_{name}.csv")),
            setup.cuts.line_to_racetrack_csv(&line.alpha).as_bytes(),
        )?;
    }
    write_front(folder, outcome)
}

/// The line on its fine spline: station, place, alpha, curvature, speed, accelerations, steering, time, and the gear that
/// gives most (from 1) where there is a gearbox.
fn write_line(path: &Path, setup: &Setup, line: &ReportedLine) -> Result<()> {
    let fine = &line.fine;
    let n = line.alpha.len();
    let alpha: Vec<f64> = fine
        .section
        .iter()
        .map(|&(section, share)| {
            let next = if fine.closed {
                (section + 1) % n
            } else {
                (section + 1).min(n - 1)
            };
            let here = section.min(n - 1);
            line.alpha[here] + share * (line.alpha[next] - line.alpha[here])
        })
        .collect();
    let (x, y): (Vec<f64>, Vec<f64>) = fine.points_m.iter().map(|p| (p.x, p.y)).unzip();
    let elapsed = fine.lap.as_ref().map(|lap| lap.elapsed_s());
    let mut table: Vec<(&str, &str, &[f64])> = vec![
        ("station", "m", &fine.station_m),
        ("x", "m", &x),
        ("y", "m", &y),
        ("alpha", "-", &alpha),
        ("curvature", "1/m", &fine.curvature_1pm),
    ];
    if let (Some(lap), Some(elapsed)) = (&fine.lap, &elapsed) {
        table.extend([
            ("v", "m/s", lap.v_mps.as_slice()),
            ("ax", "m/s^2", &lap.ax_mps2),
            ("ay", "m/s^2", &lap.ay_mps2),
            ("steering", "rad", &lap.steering_rad),
            ("time", "s", elapsed),
        ]);
    }
    let gears: Option<Vec<f64>> = fine
        .lap
        .as_ref()
        .zip(setup.gearbox.as_ref())
        .map(|(lap, gearbox)| {
            let (powertrain, radius_m) = gearbox;
            let gear = |v: &f64| powertrain.gear(*v, *radius_m);
            lap.v_mps
                .iter()
                .map(|v| gear(v).map_or(powertrain.gear_ratios.len(), |g| g.index + 1) as f64)
                .collect()
        });
    if let Some(gears) = &gears {
        table.push(("gear", "-", gears));
    }
    let columns: Vec<Column<'_>> = table
        .into_iter()
        .map(|(name, unit, values)| Column {
            name,
            unit,
            cells: Cells::Numbers(values),
        })
        .collect();
    write_csv(path, &columns)
}

/// Objectives of the front's lines, and their `alpha` at every cut.
fn write_front(folder: &Path, outcome: &Outcome) -> Result<()> {
    let Some(front) = outcome.front.as_ref().filter(|f| !f.alpha.is_empty()) else {
        return Ok(());
    };
    let column = |rows: &[Vec<f64>], k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
    let write = |path: &Path, names: &[(String, &str)], rows: &[Vec<f64>]| {
        let values: Vec<Vec<f64>> = (0..names.len()).map(|k| column(rows, k)).collect();
        let columns: Vec<Column<'_>> = names
            .iter()
            .zip(&values)
            .map(|((name, unit), values)| Column {
                name,
                unit,
                cells: Cells::Numbers(values),
            })
            .collect();
        write_csv(path, &columns)
    };
    let objectives: Vec<(String, &str)> = outcome
        .objectives
        .iter()
        .map(|o| (o.objective.name().to_owned(), o.objective.unit()))
        .collect();
    write(&folder.join("front.csv"), &objectives, &front.objectives)?;
    let cuts: Vec<(String, &str)> = (0..front.alpha[0].len())
        .map(|i| (format!("alpha_{i}"), "-"))
        .collect();
    write(&folder.join("front_lines.csv"), &cuts, &front.alpha)
}
