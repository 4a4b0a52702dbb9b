//! What a population of drives leaves behind.

use super::population::{Driven, DrivenBest, NamedLine, PopulationOutcome, PopulationSettings};
use crate::error::Result;
use crate::evaluate::{FailureCounts, failures_in_words};
use crate::report::{Cells, Column, HtmlReport, write_csv};
use crate::study::run_folder::{Manifest, write_json};
use crate::vehicle::Car;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// A set-up on a line, in figures.
#[derive(Clone, Debug, Serialize)]
pub struct Entry {
    /// The line.
    pub line: String,
    /// The set-up: nought is the car as it is.
    pub setup: usize,
    /// Values of the parameters, by name.
    pub values: BTreeMap<String, f64>,
    /// The share of the envelope's grip in the plan of its fastest lap within the edges.
    pub grip_share: Option<f64>,
    /// That lap (s).
    pub lap_time_s: Option<f64>,
    /// Least room between the car's side and an edge on it (m).
    pub room_m: Option<f64>,
    /// Mean rate at which the road wheels were turned on it (rad/s).
    pub steering_radps: Option<f64>,
}

/// The figures of a population; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct PopulationSummary {
    /// `transient`.
    pub study: &'static str,
    /// Seed of the set-ups.
    pub seed: u64,
    /// `cpu`, `simd` or `gpu`.
    pub backend: String,
    /// Instruction set, or name of the adapter.
    pub adapter: String,
    /// Time taken (s).
    pub elapsed_s: f64,
    /// Laps driven.
    pub evaluations: usize,
    /// Laps per second, plans and files aside.
    pub evaluations_per_s: f64,
    /// The car.
    pub car: String,
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
    /// By what the lap of each set-up was chosen among those with other shares of the grip.
    pub rule: &'static str,
    /// Laps that failed, by reason.
    pub failures: FailureCounts,
    /// What devices failed of and what was done about it.
    pub device_faults: Vec<String>,
    /// Whether it was broken off.
    pub interrupted: bool,
}

fn entry(outcome: &PopulationOutcome, lines: &[NamedLine], driven: &Driven) -> Entry {
    let names = outcome.parameters.iter().map(|p| p.name.clone());
    let figure = |of: fn(&DrivenBest) -> f64| driven.best.as_ref().map(of);
    Entry {
        line: lines[driven.line].name.clone(),
        setup: driven.setup,
        values: names.zip(driven.values.iter().copied()).collect(),
        grip_share: figure(|b| b.grip_share),
        lap_time_s: figure(|b| b.lap_time_s),
        room_m: figure(|b| b.room_m),
        steering_radps: figure(|b| b.steering_radps),
    }
}

/// Puts the figures together.
pub fn summarise_population(
    car: &str,
    lines: &[NamedLine],
    settings: &PopulationSettings,
    outcome: &PopulationOutcome,
    elapsed_s: f64,
) -> PopulationSummary {
    let within = |d: &&Driven| d.best.is_some();
    PopulationSummary {
        study: "transient",
        seed: settings.seed,
        backend: outcome.backend.backend.to_owned(),
        adapter: outcome.backend.device.clone(),
        elapsed_s,
        evaluations: outcome.evaluations,
        evaluations_per_s: outcome.evaluations as f64 / outcome.driving_s.max(1e-9),
        car: car.to_owned(),
        lines: lines.iter().map(|l| l.name.clone()).collect(),
        parameters: outcome.parameters.iter().map(|p| p.name.clone()).collect(),
        share: settings.share,
        within_edges: outcome.driven.iter().filter(within).count(),
        driven: outcome.driven.len(),
        best: outcome
            .driven
            .first()
            .filter(within)
            .map(|d| entry(outcome, lines, d)),
        as_it_is: outcome
            .driven
            .iter()
            .find(|d| d.setup == 0 && d.best.is_some())
            .map(|d| entry(outcome, lines, d)),
        rule: "the fastest lap within the edges, whether or not it agrees with the point mass's; one line alone is held to that \
               agreement",
        failures: outcome.failures.clone(),
        device_faults: outcome.device_faults.clone(),
        interrupted: outcome.interrupted,
    }
}

/// Rows of the table that is printed.
const PRINTED: usize = 10;

impl PopulationSummary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{} laps of {} driven on {} ({:.0} a second); {} of {} set-ups and lines stay within the edges.\n",
            self.evaluations, self.car, self.adapter, self.evaluations_per_s, self.within_edges, self.driven
        );
        if let (Some(best), Some(own)) = (&self.best, &self.as_it_is)
            && let (Some(fastest), Some(time)) = (best.lap_time_s, own.lap_time_s)
        {
            text.push_str(&format!(
                "The fastest laps in {fastest:.3} s, {:.3} s less than the car as it is on its best line ({time:.3} s).\n",
                time - fastest
            ));
        }
        if self.best.is_some() {
            text.push_str(&format!("Chosen of each set-up on each line: {}.\n", self.rule));
        }
        if self.best.is_none() {
            let counts: Vec<String> = self
                .failures
                .iter()
                .map(|(why, n)| format!("{why} {n}"))
                .collect();
            text.push_str(&format!(
                "None does with any share of the grip ({}); a line found for a wider car has more room.\n",
                counts.join(", ")
            ));
        }
        text
    }
}

/// The fastest set-ups as a table of text.
pub fn table_of(lines: &[NamedLine], outcome: &PopulationOutcome) -> String {
    // As wide as the longest name.
    let names = lines.iter().map(|l| l.name.chars().count());
    let width = names.max().unwrap_or(0).max(4) + 2;
    let mut text = format!(
        "{:>4}  {:<width$}{:>6}{:>10}{:>8}{:>6}",
        "", "line", "set-up", "lap s", "room m", "grip"
    );
    for parameter in &outcome.parameters {
        text.push_str(&format!("  {}", parameter.name));
    }
    text.push('\n');
    let best = outcome.driven.iter().filter_map(|d| d.best.map(|b| (d, b)));
    for (rank, (driven, best)) in best.take(PRINTED).enumerate() {
        text.push_str(&format!(
            "{:>4}  {:<width$}{:>6}{:>10.3}{:>8.2}{:>6.2}",
            rank + 1,
            lines[driven.line].name,
            driven.setup,
            best.lap_time_s,
            best.room_m,
            best.grip_share
        ));
        for (parameter, value) in outcome.parameters.iter().zip(&driven.values) {
            let width = parameter.name.len() + 2;
            // Short names leave no room for six figures.
            text.push_str(&format!("{:>width$}", format!(" {value:.6}")));
        }
        text.push('\n');
    }
    text
}

/// Writes `summary.json`, `setups.csv`, the fastest car as `car.toml`, `report.html` and `manifest.json`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub fn write_population(
    folder: &Path,
    car: &Car,
    lines: &[NamedLine],
    outcome: &PopulationOutcome,
    summary: &PopulationSummary,
) -> Result<()> {
    write_json(&folder.join("summary.json"), summary)?;
    let all = &outcome.driven;
    let names: Vec<String> = all.iter().map(|d| lines[d.line].name.clone()).collect();
    let setups: Vec<f64> = all.iter().map(|d| d.setup as f64).collect();
    let figure = |of: fn(&DrivenBest) -> f64| -> Vec<f64> {
        all.iter().map(|d| d.best.as_ref().map_or(f64::NAN, of)).collect()
    };
    let times = figure(|b| b.lap_time_s);
    let rooms = figure(|b| b.room_m);
    let grips = figure(|b| b.grip_share);
    let steering = figure(|b| b.steering_radps);
    let values: Vec<Vec<f64>> = (0..outcome.parameters.len())
        .map(|k| all.iter().map(|d| d.values[k]).collect())
        .collect();
    let mut columns = vec![Column {
        name: "line",
        unit: "",
        cells: Cells::Texts(&names),
    }];
    let numbers: [(&str, &str, &[f64]); 5] = [
        ("set-up", "", &setups),
        ("lap time", "s", &times),
        ("room", "m", &rooms),
        ("grip share", "", &grips),
        ("steering rate", "rad/s", &steering),
    ];
    let own = outcome
        .parameters
        .iter()
        .zip(&values)
        .map(|(p, values)| (p.name.as_str(), p.info.unit, values.as_slice()));
    columns.extend(numbers.into_iter().chain(own).map(|(name, unit, values)| Column {
        name,
        unit: if unit == "-" { "" } else { unit },
        cells: Cells::Numbers(values),
    }));
    write_csv(folder.join("setups.csv"), &columns)?;
    if let Some(best) = all.first().filter(|d| d.best.is_some()) {
        let mut flat = car.to_flat();
        for (parameter, value) in outcome.parameters.iter().zip(&best.values) {
            for slot in &parameter.slots {
                flat[*slot] = *value;
            }
        }
        car.with_flat(&flat).write(folder, "car")?;
    }

    let mut page = HtmlReport::new("transient", &format!("Set-ups of the {}, driven", summary.car));
    for sentence in summary.to_text().lines() {
        page.sentence(sentence);
    }
    if let Some(best) = &summary.best {
        let of = |x: Option<f64>, decimals: usize| x.map_or(String::new(), |x| format!("{x:.decimals$}"));
        page.tile("Fastest lap", of(best.lap_time_s, 3), "s");
        page.tile("Least room", of(best.room_m, 2), "m");
        page.tile("Grip held", of(best.grip_share.map(|g| 100.0 * g), 0), "%");
    }
    page.section("Set-ups", "");
    let note = "Each with the share of the envelope's grip with which it was fastest within the edges.";
    page.table("All set-ups on all lines", note, &columns)?;
    page.provenance("car", &summary.car);
    page.provenance("backend", &summary.backend);
    page.provenance("adapter", &summary.adapter);
    page.provenance("laps driven", summary.evaluations.to_string());
    page.provenance("laps that failed", failures_in_words(&summary.failures));
    page.provenance("time", format!("{:.1} s", summary.elapsed_s));
    page.write(folder.join("report.html"))?;
    // Last: it says that the run is whole.
    let manifest = Manifest {
        settings: "",
        interrupted: outcome.interrupted,
        device_faults: &outcome.device_faults,
        longest_dispatch_ms: outcome.longest_dispatch_ms,
        ..Manifest::new("transient", summary.seed, &outcome.backend, &summary.car)
    };
    write_json(&folder.join("manifest.json"), &manifest)
}
