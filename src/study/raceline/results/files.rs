//! Tables and figures.

use super::reported_lines;
use crate::error::Result;
use crate::files::stem;
use crate::report::{Table, write_whole};
use crate::study::raceline::{Outcome, ReportedLine, Setup};
use std::path::Path;

pub fn write(folder: &Path, setup: &Setup, outcome: &Outcome) -> Result<()> {
    write_whole(
        folder.join("envelope.csv"),
        setup.car.envelope.to_csv().as_bytes(),
    )?;
    for line in reported_lines(outcome) {
        let name = stem(&line.name);
        write_line(&folder.join(format!("line_{name}.csv")), setup, line)?;
        // Replaces what an interrupted run has left, since it is resumed in the same folder.
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
    let mut table = Table::new()
        .numbers("station", "m", &fine.station_m)
        .numbers("x", "m", x)
        .numbers("y", "m", y)
        .numbers("alpha", "-", alpha)
        .numbers("curvature", "1/m", &fine.curvature_1pm);
    if let Some(lap) = &fine.lap {
        table = table
            .numbers("v", "m/s", &lap.v_mps)
            .numbers("ax", "m/s^2", &lap.ax_mps2)
            .numbers("ay", "m/s^2", &lap.ay_mps2)
            .numbers("steering", "rad", &lap.steering_rad)
            .numbers("time", "s", lap.elapsed_s());
        if let Some((powertrain, radius_m)) = &setup.gearbox {
            let gear = |v: &f64| {
                let gear = powertrain.gear(*v, *radius_m);
                gear.map_or(powertrain.gear_ratios.len(), |g| g.index + 1) as f64
            };
            table = table.numbers("gear", "-", lap.v_mps.iter().map(gear).collect::<Vec<f64>>());
        }
    }
    table.write_csv(path)
}

/// Objectives of the front's lines, and their `alpha` at every cross-section.
fn write_front(folder: &Path, outcome: &Outcome) -> Result<()> {
    let Some(front) = outcome.front.as_ref().filter(|f| !f.alpha.is_empty()) else {
        return Ok(());
    };
    let mut objectives = Table::rows(&front.objectives);
    for (k, o) in outcome.objectives.iter().enumerate() {
        objectives = objectives.number(o.objective.name(), o.objective.unit(), |row| row[k]);
    }
    objectives.table().write_csv(folder.join("front.csv"))?;
    let mut lines = Table::rows(&front.alpha);
    for i in 0..front.alpha[0].len() {
        lines = lines.number(format!("alpha_{i}"), "-", |row| row[i]);
    }
    lines.table().write_csv(folder.join("front_lines.csv"))
}
