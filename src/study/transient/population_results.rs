//! What a population of drives leaves behind.

use super::population::{Driven, DrivenBest, PopulationOutcome};
use super::results::{lap_of, place_laps};
use super::{INTERVAL_S, Prepared, Transient, planned};
use crate::drive::{Drive, DriverSettings, drive_planned};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::report::{Curves, HtmlReport, Panel, Table};
use crate::study::framework::setups::car_of;
use crate::study::framework::{Head, Solved};
use crate::vehicle::{Car, Traction};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// A set-up on a line, in figures.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Entry {
    /// The line.
    pub line: String,
    /// The set-up: zero is the car as it is.
    pub setup: usize,
    /// Values of the parameters, by name.
    pub values: BTreeMap<String, f64>,
    /// Its fastest lap within the edges.
    #[serde(flatten)]
    pub best: DrivenBest,
}

/// The figures of a population; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PopulationSummary {
    /// The study; candidates are laps, and the seed is that of the set-ups.
    #[serde(flatten)]
    pub head: Head,
    /// Lines.
    pub lines: Vec<String>,
    /// Parameters that set-ups move.
    pub parameters: Vec<String>,
    /// How far, as a share of their values.
    pub share: f64,
    /// Set-ups on lines that stayed within the edges with some share of the grip.
    pub within_edges: usize,
    /// All set-ups on all lines.
    pub driven: usize,
    /// The fastest, none where no lap stayed within the edges.
    pub best: Option<Entry>,
    /// The car as it is on the line where it is fastest.
    pub as_it_is: Option<Entry>,
    /// The ten fastest.
    pub fastest: Vec<Entry>,
    /// By what the lap of each set-up was chosen among those with other shares of the grip.
    pub rule: String,
}

/// Puts the figures together.
pub(super) fn summarise(
    head: Head,
    solved: &Solved<'_, Transient>,
    outcome: &PopulationOutcome,
) -> PopulationSummary {
    let prepared = solved.prepared;
    let names = || outcome.parameters.iter().map(|p| p.name.clone());
    let entry = |driven: &Driven| {
        Some(Entry {
            line: prepared.lines[driven.line].name.clone(),
            setup: driven.setup,
            values: names().zip(driven.values.iter().copied()).collect(),
            best: driven.best?,
        })
    };
    // The fastest first.
    let within = || outcome.driven.iter().filter(|d| d.best.is_some());
    let rule = "the fastest lap within the edges, whether or not it agrees with the quasi-steady-state lap; one line alone is held \
                to that agreement";
    PopulationSummary {
        head,
        lines: prepared.lines.iter().map(|l| l.name.clone()).collect(),
        parameters: names().collect(),
        share: solved.settings.share,
        within_edges: within().count(),
        driven: outcome.driven.len(),
        best: within().next().and_then(entry),
        as_it_is: within().find(|d| d.setup == 0).and_then(entry),
        fastest: within().take(PRINTED).filter_map(entry).collect(),
        rule: rule.to_owned(),
    }
}

/// Rows of the table that is printed.
const PRINTED: usize = 10;

impl PopulationSummary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let record = &self.head.record;
        let mut text = format!(
            "{} laps of {} driven on {} ({:.0} a second); {} of {} set-ups and lines stay within the edges.\n",
            record.evaluations,
            self.head.subject.car,
            record.adapter,
            record.evaluations_per_s,
            self.within_edges,
            self.driven
        );
        if let (Some(best), Some(own)) = (&self.best, &self.as_it_is) {
            let (fastest, time) = (best.best.lap_time_s, own.best.lap_time_s);
            text += &format!(
                "The fastest laps in {fastest:.3} s, {:.3} s less than the car as it is on its best line ({time:.3} s).\n",
                time - fastest
            );
        }
        text += &if self.best.is_some() {
            format!("Chosen of each set-up on each line: {}.\n", self.rule)
        } else {
            format!(
                "None does with any share of the grip ({}); a line found for a wider car has more room.\n",
                failures_in_words(&record.failures)
            )
        };
        text + &record.notes()
    }

    /// The fastest as a table of text.
    pub fn table(&self) -> String {
        let table = Table::rows(&self.fastest)
            .text("line", |e| &*e.line)
            .number("set-up", "", |e| e.setup as f64)
            .number("lap time", "s", |e| e.best.lap_time_s)
            .number("room", "m", |e| e.best.room_m)
            .number("grip share", "", |e| e.best.grip_share);
        let parameters = self.parameters.iter();
        parameters
            .fold(table, |table, p| {
                table.number(p, "", |e| e.values.get(p).copied())
            })
            .table()
            .to_text()
    }
}

/// The best lap of a set-up, driven once more in `f64`; nothing where the car does not come to its end there.
fn driven_again(prepared: &Prepared, car: &Car, driven: &Driven) -> Result<Option<Drive>> {
    let Some(best) = driven.best else {
        return Ok(None);
    };
    let (limits, line) = (&prepared.road.car, &prepared.lines[driven.line]);
    let traction = Traction::of(&prepared.car, &limits.envelope);
    // Every set-up has the plans and the driver of the car as it is.
    let (.., plan) = planned(limits, &traction, line, best.grip_share)?;
    let driver = DriverSettings::racing(&prepared.car)?;
    Ok(drive_planned(car, &line.circuit, plan, &driver, INTERVAL_S).ok())
}

/// The fastest set-up beside the car as it is, on the line of the fastest: traces, a map, a table by corner.
fn place_fastest(
    page: &mut HtmlReport,
    folder: &Path,
    prepared: &Prepared,
    outcome: &PopulationOutcome,
) -> Result<()> {
    let all = &outcome.driven;
    let Some(fastest) = all.first() else {
        return Ok(());
    };
    let line = &prepared.lines[fastest.line];
    let own = all.iter().find(|d| d.setup == 0 && d.line == fastest.line);
    let shown = [Some(fastest), own.filter(|own| own.setup != fastest.setup)];
    let name = |driven: &Driven| match driven.setup {
        0 => "the car as it is".to_owned(),
        setup => format!("set-up {setup}"),
    };
    let shown: Vec<_> = shown.into_iter().flatten().map(|d| (name(d), d)).collect();
    let mut laps = (Vec::new(), Vec::new());
    let mut times = Vec::new();
    for (name, driven) in &shown {
        let car = car_of(&prepared.car, &outcome.parameters, &driven.values);
        if let Some(drive) = driven_again(prepared, &car, driven)? {
            let (lap, corners) = lap_of(name, (&car, &prepared.road.car), &drive, &line.circuit);
            laps.0.push(lap);
            laps.1.extend(corners);
            let time_s = drive.lap_time_s(line.circuit.length_m, INTERVAL_S);
            times.extend(time_s.map(|time_s| format!("{name} in {time_s:.3} s")));
        }
    }
    if laps.0.is_empty() {
        return Ok(());
    }
    let times = format!("Driven once more, in double precision: {}.", times.join(", "));
    page.section("Fastest lap", &times);
    let titles = (
        &*format!("On the line {}", line.name),
        "The fastest lap".to_owned(),
    );
    place_laps(page, folder, titles, &line.circuit, laps)
}

/// Writes `setups.csv`, the fastest car as `car.toml`, `speeds.svg`, `map.svg` and `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub(super) fn report(
    folder: &Path,
    prepared: &Prepared,
    outcome: &PopulationOutcome,
    summary: &PopulationSummary,
) -> Result<()> {
    let Prepared { car, lines, .. } = prepared;
    let all = &outcome.driven;
    let mut table = Table::rows(all)
        .text("line", |d| &*lines[d.line].name)
        .number("set-up", "", |d| d.setup as f64)
        .number("lap time", "s", |d| Some(d.best?.lap_time_s))
        .number("room", "m", |d| Some(d.best?.room_m))
        .number("grip share", "", |d| Some(d.best?.grip_share))
        .number("steering rate", "rad/s", |d| Some(d.best?.steering_radps));
    for (k, parameter) in outcome.parameters.iter().enumerate() {
        let unit = match parameter.info.unit {
            "-" => "",
            unit => unit,
        };
        table = table.number(&*parameter.name, unit, |d| d.values[k]);
    }
    let table = table.table();
    table.write_csv(folder.join("setups.csv"))?;
    if let Some(best) = all.first().filter(|d| d.best.is_some()) {
        car_of(car, &outcome.parameters, &best.values).write(folder, "car")?;
    }

    let title = format!("Set-ups of the {}, driven", car.name);
    let mut page = HtmlReport::new(&summary.head.study, &title);
    for sentence in summary.to_text().lines() {
        page.sentence(sentence);
    }
    if let Some(best) = summary.best.as_ref().map(|entry| entry.best) {
        page.tile("Fastest lap", format!("{:.3}", best.lap_time_s), "s");
        page.tile("Least room", format!("{:.2}", best.room_m), "m");
        page.tile("Grip held", format!("{:.0}", 100.0 * best.grip_share), "%");
    }
    page.section("Set-ups", "");
    let note = "Each with the share of the envelope's grip with which it was fastest within the edges.";
    page.table("All set-ups on all lines", note, &table)?;
    let scatter = |label: &str, unit: &str, of: &dyn Fn(&Driven) -> Option<f64>| {
        let points = all.iter().filter_map(|d| Some((of(d)?, d.best?.lap_time_s)));
        let panel = Panel::new(format!("Lap time over {label}"));
        panel.x(label, unit).y("lap time", "s").dots("", points)
    };
    let parameters = outcome.parameters.iter().enumerate().map(|(k, parameter)| {
        let unit = parameter.info.unit.trim_matches('-');
        scatter(&parameter.name, unit, &|d| Some(d.values[k]))
    });
    let panels = [scatter("room to the edge", "m", &|d| Some(d.best?.room_m))];
    let scatters = Curves::new(
        "Set-ups",
        panels.into_iter().chain(parameters).filter(Panel::has_points),
    );
    if !scatters.is_empty() {
        page.place(&scatters)?;
    }
    place_fastest(&mut page, folder, prepared, outcome)?;
    page.provenance("car", &car.name);
    summary.head.record.provenance(&mut page, "laps driven");
    page.write(folder.join("report.html"))
}
