//! The interactive report of a hybrid study, with its figures.

use super::{HybridSummary, ScenarioFigures, SearchFigures, Site, figures, reported_laps, sizing_in_words};
use crate::config::settings::Settings;
use crate::error::Result;
use crate::files::stem;
use crate::report::{Figure, Front, HtmlReport, Table, significant};
use crate::study::framework::Solved;
use crate::study::hybrid::{Hybrid, Outcome, ReportedLap, StintLap};
use std::path::Path;

/// Draws figures into `folder`, and writes the page.
///
/// # Errors
/// [`crate::Error::Io`] if one cannot be written.
pub fn write(folder: &Path, solved: &Solved<'_, Hybrid>, summary: &HybridSummary) -> Result<()> {
    let (settings, outcome) = (solved.settings, solved.outcome);
    let subject = &summary.head.subject;
    let mut page = HtmlReport::new(&summary.head.study, &subject.words());
    head(&mut page, summary);
    page.section(
        "Laps",
        "Where the motor works and what it gains on the engine alone.",
    );
    page.figure(folder.join("traces.svg"), &figures::all_laps(outcome))?;
    pictures(folder, outcome)?;
    if !summary.scenarios.is_empty() {
        page.table(
            "Scenarios",
            "Added: by the same gates with the motor beside the engine.",
            &scenarios_table(summary),
        )?;
    }
    let motor = figures::motor_on(outcome);
    if !motor.is_empty() {
        page.figure(folder.join("motor_on.svg"), &motor)?;
    }
    if let Some(d) = summary.deployment.as_ref().filter(|d| !d.sites.is_empty()) {
        let note =
            "Where the swarm deploys. The allocation factor is a site's share of all that leaves the store.";
        page.table("Sites", note, &sites_table(&d.sites))?;
    }
    if !summary.searches.is_empty() {
        let note = "Zones and gates that swarms set: for the least lap time beside the engine, for the least fuel in its place.";
        page.table("Further searches", note, &searches_table(summary))?;
    }
    if let Some(figure) = figures::time_energy(outcome) {
        page.section(
            "Time against energy",
            "Each point of the curve is a reference optimum of its energy.",
        );
        page.figure(folder.join("time_energy.svg"), &figure)?;
    }
    if let Some(o) = outcome.optimised.as_ref().filter(|o| !o.worth.is_empty()) {
        page.figure(folder.join("worth.svg"), &figures::worth(outcome, &o.worth))?;
    }
    let front = outcome.optimised.as_ref().and_then(|o| o.swarm_front.as_ref());
    if let Some(found) = front.filter(|f| settings.objectives.len() > 1 && !f.objectives.is_empty()) {
        page.section(
            "The front",
            "No lap here is better than another by every objective at once.",
        );
        let front = Front::new("Laps on the front", &found.objectives);
        let named = settings.objectives.iter();
        let front = named.fold(front, |front, o| front.objective(o.words(), o.unit()));
        page.figure(folder.join("front.svg"), &front)?;
        figures::parallel(settings, found).write_svg(&folder.join("parallel.svg"))?;
    }
    if !outcome.stint.is_empty() {
        page.section("Stint", "");
        page.table("Laps of the stint", "", &stint_table(&outcome.stint))?;
    }
    page.facts(&[
        ("track", &subject.track_name()),
        ("car", &subject.car),
        ("line", &format!("{}, {:.1} m", summary.line, summary.length_m)),
        ("seed", &subject.seed),
    ]);
    summary.head.record.provenance(&mut page, "laps evaluated");
    page.settings("study.toml, which repeats this run", settings.to_toml());
    page.write(folder.join("report.html"))
}

/// Files of what the lap view of the page has in one: each lap, the scenarios, and the best deployment.
fn pictures(folder: &Path, outcome: &Outcome) -> Result<()> {
    let setup = &outcome.setup;
    for lap in reported_laps(outcome).into_iter().skip(1) {
        let name = format!("energy_{}.svg", stem(&lap.name));
        figures::lap(outcome, lap).write_svg(&folder.join(name))?;
    }
    let scenarios: Vec<&ReportedLap> = outcome.scenarios.iter().map(|s| &s.own).collect();
    if !scenarios.is_empty() {
        let title = format!("{}: scenarios", setup.raceline.track_name);
        figures::laps(outcome, &scenarios, title).write_svg(&folder.join("charge.svg"))?;
    }
    // The best deployment if there is one, else the last scenario.
    let shown = match &outcome.optimised {
        Some(o) => Some(&o.swarm.lap),
        None => scenarios.last().copied(),
    };
    if let Some(lap) = shown {
        figures::map(setup, lap).write_svg(folder.join("map.svg"))?;
        if let Some(sites) = figures::engine_sites(setup, &outcome.engine, lap) {
            sites.write_svg(folder.join("engine_sites.svg"))?;
        }
    }
    Ok(())
}

fn head(page: &mut HtmlReport, summary: &HybridSummary) {
    let (car, track) = (&summary.head.subject.car, summary.head.subject.track_name());
    page.sentence(format!(
        "By the engine alone the {car} laps {track} in {:.2} s with {:.2} l of fuel.",
        summary.engine_lap_time_s, summary.engine_fuel_l
    ));
    page.tile("Engine alone", format!("{:.3}", summary.engine_lap_time_s), "s");
    if let Some(d) = &summary.deployment {
        page.sentence(format!(
            "{:.2} MJ beside it, shared out by the swarm over {} zones, gain {:.2} s: {:.2} s. The reference optimum is {:.2} s, and \
             no more than {:.2} MJ are of use on this lap.",
            d.energy_mj, d.zones, d.gain_s, d.swarm_lap_time_s, d.exact_lap_time_s, d.binds_up_to_mj
        ));
        page.tile("With the motor", format!("{:.3}", d.swarm_lap_time_s), "s");
        page.tile("Gained", format!("{:.3}", d.gain_s), "s");
        page.tile("Reference optimum", format!("{:.3}", d.exact_lap_time_s), "s");
        page.tile("Energy out", format!("{:.2}", d.swarm_deployed_mj), "MJ");
    }
    for sizing in &summary.sizing {
        page.sentence(sizing_in_words(sizing));
    }
    page.warnings(&summary.warnings, summary.head.record.interrupted);
}

/// The figures of the scenarios.
pub fn scenarios_table(summary: &HybridSummary) -> Table<'static> {
    let of = |f: fn(&ScenarioFigures) -> f64| move |(_, s): &(&String, &ScenarioFigures)| f(s);
    Table::rows(&summary.scenarios)
        .text("scenario", |(name, _)| name.replace('_', " "))
        .text("mode", |(_, s)| s.mode.clone())
        .number("lap", "s", of(|s| s.lap_time_s))
        .number("lap, added", "s", of(|s| s.additional_lap_time_s))
        .number("out", "MJ", of(|s| s.deployed_mj))
        .number("MGU-K in", "MJ", of(|s| s.harvested_k_mj))
        .number("MGU-H in", "MJ", of(|s| s.harvested_h_mj))
        .number("charge at the end", "-", of(|s| s.soc_end))
        .number("motor on", "% of time", of(|s| 100.0 * s.motor_time_share))
        .number("fuel", "l", of(|s| s.fuel_l))
        .number("balance error", "J", of(|s| s.balance_error_j))
        .number("least charge", "-", of(|s| s.soc_least))
        .number("net out", "MJ", of(|s| s.net_deployed_mj))
        .number("fuel of the engine alone", "%", of(|s| s.fuel_percent))
        .table()
}

/// The stretches on which the motor works.
pub fn sites_table(sites: &[Site]) -> Table<'static> {
    Table::rows(sites.iter().enumerate())
        .number("site", "", |(i, _)| (i + 1) as f64)
        .number("from", "m", |(_, s)| s.start_m)
        .number("to", "m", |(_, s)| s.end_m)
        .number("out", "MJ", |(_, s)| s.deployed_mj)
        .number("allocation factor", "-", |(_, s)| s.allocation)
        .table()
}

/// What the further searches found.
pub fn searches_table(summary: &HybridSummary) -> Table<'static> {
    let of = |f: fn(&SearchFigures) -> f64| move |(_, s): &(&String, &SearchFigures)| f(s);
    Table::rows(&summary.searches)
        .text("search", |(name, _)| name.replace('_', " "))
        .number("lap", "s", of(|s| s.lap_time_s))
        .number("out", "MJ", of(|s| s.deployed_mj))
        .number("charge at the end", "-", of(|s| s.soc_end))
        .number("motor on", "% of time", of(|s| 100.0 * s.motor_time_share))
        .number("fuel", "l", of(|s| s.fuel_l))
        .number("fuel of the engine alone", "%", of(|s| s.fuel_percent))
        .text("set to", |(_, s)| {
            let set = s.variables.iter().filter(|(name, _)| !name.starts_with("zone"));
            let set: Vec<String> = set
                .map(|(name, x)| format!("{name} {}", significant(*x, 3)))
                .collect();
            set.join(", ")
        })
        .table()
}

/// The laps of a stint.
pub fn stint_table(laps: &[StintLap]) -> Table<'static> {
    Table::rows(laps.iter().enumerate())
        .number("lap", "", |(i, _)| (i + 1) as f64)
        .number("mass", "kg", |(_, l)| l.mass_kg)
        .number("time", "s", |(_, l)| l.lap_time_s)
        .number("engine alone", "s", |(_, l)| l.engine_lap_time_s)
        .number("fuel", "l", |(_, l)| l.fuel_l)
        .number("fuel, engine alone", "l", |(_, l)| l.engine_fuel_l)
        .number("out", "MJ", |(_, l)| l.deployed_mj)
        .number("in", "MJ", |(_, l)| l.harvested_mj)
        .number("charge at the end", "-", |(_, l)| l.soc_end)
        .table()
}
