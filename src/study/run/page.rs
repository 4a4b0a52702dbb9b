//! The interactive report of a run, over those of its stages.

use super::summary::{RoundSummary, Summary};
use crate::error::Result;
use crate::report::compare::{LIMITS, limits, overlay, read_table};
use crate::report::{HtmlReport, Table};
use std::path::Path;

pub(super) fn write(folder: &Path, summary: &Summary) -> Result<()> {
    let mut page = HtmlReport::new("run", &format!("{}: from the log to a lap", summary.car));
    for line in summary.to_text().lines() {
        page.sentence(sentence(line));
    }
    if let Some(last) = summary.rounds.last() {
        page.tile("Driven lap", format!("{:.3}", last.driven_lap_time_s), "s");
        page.tile(
            "Quasi-steady-state lap with as much grip",
            format!("{:.3}", last.point_mass_lap_time_s),
            "s",
        );
        page.tile("Grip held", format!("{:.0}", 100.0 * last.grip_share), "%");
        page.tile("Least room", format!("{:.2}", last.margin_m), "m");
    }
    page.tile("Top speed", format!("{:.1}", summary.top_speed_mps), "m/s");
    if !summary.agrees {
        page.warning("The driven lap is more than half a percent behind the quasi-steady-state lap.");
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
    page.table("Lines, one after the other", "", &table(&summary.rounds))?;

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
            ("planned, quasi-steady-state", planned),
            ("driven by the 4DOF car", driven),
        ];
        overlay(&mut page, &laps, road.as_ref(), true)?;
    }
    let whole = read(2, "envelope", "envelope.csv")?;
    let held = read(line_of + 1, "transient", "envelope_driven.csv")?;
    page.section(
        "Limits",
        "What the car can do in steady states, and what of it was held on the line.",
    );
    let envelopes = [("the car's", whole.as_ref()), ("held", held.as_ref())];
    page.place(&limits("Limits", &LIMITS[..2], envelopes.into_iter()))?;
    page.facts(&[
        ("log", &summary.log),
        ("seed", &summary.seed),
        ("backend", &summary.record.backend),
        ("adapter", &summary.record.adapter),
        ("candidates of the identification", &summary.record.evaluations),
        ("time", &format!("{:.1} s", summary.record.elapsed_s)),
        ("stages taken from earlier runs", &summary.reused.join(", ")),
    ]);
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

fn table(rounds: &[RoundSummary]) -> Table<'static> {
    Table::rows(rounds.iter().enumerate())
        .number("line", "", |(i, _)| (i + 1) as f64)
        .number("length", "m", |(_, r)| r.length_m)
        .number("planned lap", "s", |(_, r)| r.planned_lap_time_s)
        .number("grip held", "%", |(_, r)| 100.0 * r.grip_share)
        .number("quasi-steady-state lap with that grip", "s", |(_, r)| {
            r.point_mass_lap_time_s
        })
        .number("driven lap", "s", |(_, r)| r.driven_lap_time_s)
        .number("driven against quasi-steady-state", "%", |(_, r)| {
            r.disagreement_percent
        })
        .number("least room", "m", |(_, r)| r.margin_m)
        .table()
}
