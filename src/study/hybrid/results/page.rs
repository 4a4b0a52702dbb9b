//! The interactive report of a hybrid study.

use super::pictures::{map_names, power_kw, soc, speeds, summed, time_energy};
use super::{HybridSummary, ScenarioFigures, told_laps};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::report::{
    Cells, Column, Front, HtmlReport, LapLine, LapMap, LapPanel, LapTrace, LapView, Objective, Scale,
};
use crate::study::hybrid::{HybridSetup, HybridStudySettings, Outcome, ReportedLap, StintLap};
use std::path::Path;

/// Rows of the traces, from the top.
const PANELS: [(&str, &str); 6] = [
    ("speed", "m/s"),
    ("time gained", "s"),
    ("motor", "kW"),
    ("regeneration", "kW"),
    ("energy out", "MJ"),
    ("charge", ""),
];

pub fn write(
    folder: &Path,
    settings: &HybridStudySettings,
    setup: &HybridSetup,
    outcome: &Outcome,
    summary: &HybridSummary,
) -> Result<()> {
    let mut page = HtmlReport::new("hybrid", &format!("{} with the {}", summary.track, summary.car));
    head(&mut page, summary);
    page.section(
        "Laps",
        "Where the motor works and what it buys; time is gained on the engine alone.",
    );
    page.lap(&lap(setup, outcome))?;
    scenarios(&mut page, summary)?;
    let panels = time_energy(outcome);
    if !panels.is_empty() {
        page.section(
            "Time against energy",
            "Each point of the curve is an exact optimum of its energy.",
        );
        for panel in &panels {
            page.curves(panel, "", [Scale::Linear; 2])?;
        }
    }
    let front = outcome.optimised.as_ref().and_then(|o| o.swarm_front.as_ref());
    if let Some(front) = front.filter(|f| settings.objectives.len() > 1 && !f.objectives.is_empty()) {
        page.section(
            "The front",
            "No lap here is better than another by every objective at once.",
        );
        page.front(&Front {
            title: "Laps on the front",
            objectives: settings
                .objectives
                .iter()
                .map(|o| Objective {
                    name: o.words(),
                    unit: o.unit(),
                })
                .collect(),
            points: &front.objectives,
            ..Front::default()
        })?;
    }
    stint(&mut page, &outcome.stint)?;
    page.provenance("track", &summary.track);
    page.provenance("car", &summary.car);
    page.provenance("line", format!("{}, {:.1} m", summary.line, summary.length_m));
    page.provenance("seed", summary.seed.to_string());
    page.provenance("backend", summary.backend);
    page.provenance("adapter", &summary.adapter);
    page.provenance("driver", &summary.driver);
    page.provenance("laps evaluated", summary.evaluations.to_string());
    page.provenance("laps that failed", failures_in_words(&summary.failures));
    page.provenance("time", format!("{:.1} s", summary.elapsed_s));
    page.settings("study.toml, which repeats this run", settings.to_toml());
    page.write(folder.join("report.html"))
}

fn head(page: &mut HtmlReport, summary: &HybridSummary) {
    page.sentence(format!(
        "By the engine alone the {} laps {} in {:.2} s with {:.2} l of fuel.",
        summary.car, summary.track, summary.engine_lap_time_s, summary.engine_fuel_l
    ));
    page.tile("Engine alone", format!("{:.3}", summary.engine_lap_time_s), "s");
    if let Some(d) = &summary.deployment {
        page.sentence(format!(
            "{:.2} MJ beside it, shared out by the swarm over {} zones, gain {:.2} s: {:.2} s. The exact optimum is {:.2} s, and \
             no more than {:.2} MJ are of use on this lap.",
            d.energy_mj, d.zones, d.gain_s, d.swarm_lap_time_s, d.exact_lap_time_s, d.binds_up_to_mj
        ));
        page.tile("With the motor", format!("{:.3}", d.swarm_lap_time_s), "s");
        page.tile("Gained", format!("{:.3}", d.gain_s), "s");
        page.tile("Exact optimum", format!("{:.3}", d.exact_lap_time_s), "s");
        page.tile("Energy out", format!("{:.2}", d.swarm_deployed_mj), "MJ");
    }
    for sizing in &summary.sizing {
        page.sentence(match sizing.energy_mj {
            Some(mj) => format!(
                "A motor of {:.0} kW with {mj:.2} MJ a lap and a store of {:.2} MJ laps in {:.2} s with {:.2} l{}.",
                sizing.power_kw,
                sizing.store_mj,
                sizing.lap_time_s,
                sizing.fuel_l,
                match (sizing.engine_share, sizing.fuel_saving_l) {
                    (Some(share), Some(saving)) => format!(
                        ", {saving:.2} l less than a car without a motor whose engine has {share:.2} times the power"
                    ),
                    _ => String::new(),
                }
            ),
            None => format!(
                "A motor of {:.0} kW does not suffice: {:.2} s at best.",
                sizing.power_kw, sizing.lap_time_s
            ),
        });
    }
    for warning in &summary.warnings {
        page.warning(warning);
    }
    if summary.interrupted {
        page.warning("The run was interrupted; this is what it had reached.");
    }
}

fn lap<'a>(setup: &'a HybridSetup, outcome: &'a Outcome) -> LapView<'a> {
    let engine = &outcome.engine;
    let elapsed_s = |lap: &ReportedLap| summed(lap.segments.iter().map(|s| 1e6 * s.time));
    let alone = elapsed_s(engine);
    let line = |lap: &'a ReportedLap| {
        let trace = |panel, values| LapTrace {
            panel,
            values,
            band: None,
        };
        let gained = alone.iter().zip(elapsed_s(lap)).map(|(a, b)| a - b).collect();
        let mut traces = vec![trace(0, speeds(lap)), trace(1, gained)];
        // The engine alone has none of these.
        if !std::ptr::eq(lap, engine) {
            traces.extend([
                trace(2, power_kw(setup, lap, |s| s.motor)),
                trace(3, power_kw(setup, lap, |s| s.generator)),
                trace(4, summed(lap.segments.iter().map(|s| s.deployed))),
                trace(5, soc(setup, lap)),
            ]);
        }
        LapLine {
            name: &lap.name,
            x: lap.station_m[..lap.segments.len()].to_vec(),
            traces,
            place_m: setup.points_m[..lap.segments.len()].to_vec(),
            wide: false,
        }
    };
    let mut laps = told_laps(outcome);
    // The best deployment first: it colours the map.
    laps.sort_by(|a, b| a.lap.time.total_cmp(&b.lap.time));
    LapView {
        title: "Speed, power and charge",
        note: "Powers are at the wheels.",
        x_label: "distance",
        x_unit: "m",
        panels: PANELS
            .iter()
            .map(|(label, unit)| LapPanel {
                label,
                unit,
                height: 1.0,
            })
            .collect(),
        lines: laps.into_iter().map(line).collect(),
        map: Some(LapMap {
            left_edge_m: &setup.raceline.edges_m[1],
            right_edge_m: &setup.raceline.edges_m[0],
            closed: setup.closed,
            names: map_names(setup),
        }),
        ..LapView::default()
    }
}

fn scenarios(page: &mut HtmlReport, summary: &HybridSummary) -> Result<()> {
    if summary.scenarios.is_empty() {
        return Ok(());
    }
    let names: Vec<String> = summary.scenarios.keys().map(|n| n.replace('_', " ")).collect();
    let modes: Vec<String> = summary.scenarios.values().map(|s| s.mode.to_owned()).collect();
    let of = |f: &dyn Fn(&ScenarioFigures) -> f64| summary.scenarios.values().map(f).collect::<Vec<f64>>();
    let figures = [
        ("lap", "s", of(&|s| s.lap_time_s)),
        ("lap, added", "s", of(&|s| s.additional_lap_time_s)),
        ("out", "MJ", of(&|s| s.deployed_mj)),
        ("MGU-K in", "MJ", of(&|s| s.harvested_k_mj)),
        ("MGU-H in", "MJ", of(&|s| s.harvested_h_mj)),
        ("charge at the end", "-", of(&|s| s.soc_end)),
        ("motor on", "% of time", of(&|s| 100.0 * s.motor_time_share)),
        ("fuel", "l", of(&|s| s.fuel_l)),
        ("balance error", "J", of(&|s| s.balance_error_j)),
    ];
    let mut columns: Vec<Column<'_>> = [("scenario", &names), ("mode", &modes)]
        .map(|(name, cells)| Column {
            name,
            unit: "",
            cells: Cells::Texts(cells),
        })
        .into();
    columns.extend(numbers(&figures));
    page.table(
        "Scenarios",
        "Added: by the same gates with the motor beside the engine.",
        &columns,
    )
}

fn numbers<'a>(figures: &'a [(&'a str, &'a str, Vec<f64>)]) -> impl Iterator<Item = Column<'a>> {
    figures.iter().map(|(name, unit, values)| Column {
        name,
        unit,
        cells: Cells::Numbers(values),
    })
}

fn stint(page: &mut HtmlReport, laps: &[StintLap]) -> Result<()> {
    if laps.is_empty() {
        return Ok(());
    }
    let of = |f: &dyn Fn(&StintLap) -> f64| laps.iter().map(f).collect::<Vec<f64>>();
    let figures = [
        ("lap", "", (1..=laps.len()).map(|n| n as f64).collect()),
        ("mass", "kg", of(&|l| l.mass_kg)),
        ("time", "s", of(&|l| l.lap_time_s)),
        ("engine alone", "s", of(&|l| l.engine_lap_time_s)),
        ("fuel", "l", of(&|l| l.fuel_l)),
        ("fuel, engine alone", "l", of(&|l| l.engine_fuel_l)),
        ("out", "MJ", of(&|l| l.deployed_mj)),
        ("in", "MJ", of(&|l| l.harvested_mj)),
        ("charge at the end", "-", of(&|l| l.soc_end)),
    ];
    page.section("Stint", "");
    page.table("Laps of the stint", "", &numbers(&figures).collect::<Vec<_>>())
}
