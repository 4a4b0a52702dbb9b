//! The interactive report of a run, over those of its stages.

use super::story::{RoundSummary, Summary};
use crate::error::Result;
use crate::report::{Cells, Column, Curve, CurvePanel, HtmlReport, Scale};
use crate::study::compare::{Trace, overlay, read_table};
use std::path::Path;

pub(super) fn write(folder: &Path, summary: &Summary) -> Result<()> {
    let mut page = HtmlReport::new("run", &format!("{}: from the log to a lap", summary.car));
    for line in summary.to_text().lines() {
        page.sentence(sentence(line));
    }
    if let Some(last) = summary.rounds.last() {
        page.tile("Driven lap", format!("{:.3}", last.driven_lap_time_s), "s");
        page.tile(
            "Point mass with as much grip",
            format!("{:.3}", last.point_mass_lap_time_s),
            "s",
        );
        page.tile("Grip held", format!("{:.0}", 100.0 * last.grip_share), "%");
        page.tile("Least room", format!("{:.2}", last.margin_m), "m");
    }
    page.tile("Top speed", format!("{:.1}", summary.top_speed_mps), "m/s");
    if !summary.agrees {
        page.warning("The driven lap and the point mass's differ by more than half a percent.");
    }
    // Identification, limits, then a line and its drive for each round.
    let rounds = summary.rounds.len();
    let stage = |number: usize, name: &str| format!("{number}_{name}");
    let mut stages = vec![stage(1, "identify"), stage(2, "envelope")];
    stages.extend((1..=rounds).flat_map(|r| [stage(1 + 2 * r, "raceline"), stage(2 + 2 * r, "transient")]));
    if let Some(energy) = &summary.energy {
        let gain = energy.engine_lap_time_s - energy.deployed_lap_time_s;
        page.tile("Gained by deployed energy", format!("{gain:.2}"), "s");
        stages.push(stage(3 + 2 * rounds, "hybrid"));
    }
    page.section("Stages", "Each has a report of its own.");
    page.reports_within(&stages);
    table(&mut page, &summary.rounds)?;

    let read =
        |number: usize, name: &str, file: &str| read_table(&folder.join(stage(number, name)).join(file));
    let line_of = 1 + 2 * rounds;
    let planned = read(line_of, "raceline", "line_fastest.csv")?;
    let driven = read(line_of + 1, "transient", "drive.csv")?;
    let road = read(line_of, "raceline", "racetrack_reference.csv")?;
    if let (Some(planned), Some(driven)) = (&planned, &driven) {
        page.section(
            "Lap",
            "The last line as it was planned, and as the car itself drives it.",
        );
        let laps = [
            ("planned by the point mass", planned),
            ("driven by the 4DOF car", driven),
        ];
        overlay(&mut page, &laps, road.as_ref(), true)?;
    }
    let whole = read(2, "envelope", "envelope.csv")?;
    let held = read(line_of + 1, "transient", "envelope_driven.csv")?;
    limits(&mut page, [whole.as_ref(), held.as_ref()])?;
    page.provenance("log", &summary.log);
    page.provenance("seed", summary.seed.to_string());
    page.provenance("backend", &summary.backend);
    page.provenance("adapter", &summary.adapter);
    page.provenance(
        "candidates of the identification",
        summary.evaluations.to_string(),
    );
    page.provenance("time", format!("{:.1} s", summary.elapsed_s));
    page.provenance("stages taken from earlier runs", summary.reused.join(", "));
    page.write(folder.join("report.html"))
}

/// A line of the story without the label before it, where what follows says the same.
fn sentence(line: &str) -> String {
    let words = line
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
        .replace("^2", "\u{b2}");
    let told = words.strip_prefix("The car ").unwrap_or(&words);
    for label in ["Its limits ", "Energy "] {
        if let Some(rest) = told.strip_prefix(label) {
            return format!("{}: {rest}", label.trim_end());
        }
    }
    told.to_owned()
}

fn table(page: &mut HtmlReport, rounds: &[RoundSummary]) -> Result<()> {
    let of = |f: &dyn Fn(&RoundSummary) -> f64| rounds.iter().map(f).collect::<Vec<f64>>();
    let number: Vec<f64> = (1..=rounds.len()).map(|n| n as f64).collect();
    let figures = [
        ("line", "", number),
        ("length", "m", of(&|r| r.length_m)),
        ("planned lap", "s", of(&|r| r.planned_lap_time_s)),
        ("grip held", "%", of(&|r| 100.0 * r.grip_share)),
        ("point mass with that grip", "s", of(&|r| r.point_mass_lap_time_s)),
        ("driven lap", "s", of(&|r| r.driven_lap_time_s)),
        ("driven against point mass", "%", of(&|r| r.disagreement_percent)),
        ("least room", "m", of(&|r| r.margin_m)),
    ];
    let columns: Vec<Column<'_>> = figures
        .iter()
        .map(|(name, unit, values)| Column {
            name,
            unit,
            cells: Cells::Numbers(values),
        })
        .collect();
    page.table("Lines, one after the other", "", &columns)
}

/// The limits of the car, and those that the driver held.
fn limits(page: &mut HtmlReport, tables: [Option<&Trace>; 2]) -> Result<()> {
    page.section(
        "Limits",
        "What the car can do in steady states, and what of it was held on the line.",
    );
    for (title, column) in [("Cornering", "ay_mps2"), ("Braking grip", "ax_grip_mps2")] {
        let curve = |(label, table): (&'static str, Option<&Trace>)| {
            let table = table?;
            Some(Curve {
                label,
                x: table.column(&["v_mps"])?.to_vec(),
                y: table.column(&[column])?.to_vec(),
                shade: None,
            })
        };
        let panel = CurvePanel {
            title,
            x_label: "speed (m/s)",
            y_label: "acceleration (m/s\u{b2})",
            curves: ["the car's", "held"]
                .into_iter()
                .zip(tables)
                .filter_map(curve)
                .collect(),
        };
        page.curves(&panel, "", [Scale::Linear; 2])?;
    }
    Ok(())
}
