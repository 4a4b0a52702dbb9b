//! What a sensitivity study leaves behind.

use super::{LEVELS, MOST_SAMPLES, Outcome, SensitivitySettings, SobolIndex};
use crate::error::Result;
use crate::evaluate::FailureCounts;
use crate::evaluate::replay::CHANNEL_UNITS;
use crate::report::{
    BarPanel, BarSeries, Cells, Column, Curve, CurvePanel, plot_bars, plot_curves, text_table, write_csv,
};
use crate::study::identify::Setup;
use crate::study::run_folder::{Manifest, write_json, write_study};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The figures of one parameter.
#[derive(Clone, Debug, Serialize)]
pub struct ParameterSensitivity {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its value in the base car.
    pub value: f64,
    /// The range that it was moved over.
    pub range: [f64; 2],
    /// Greatest change of each cost as the parameter alone goes to the ends of its range, in the cost's unit; nothing
    /// where the car then no longer drives.
    pub one_at_a_time: BTreeMap<String, Option<f64>>,
    /// Its share of each cost's variance; empty if the study was broken off.
    pub sobol: BTreeMap<String, SobolIndex>,
}

/// The figures of the study; `--json` prints this.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `sensitivity`.
    pub study: &'static str,
    /// Seed of all random numbers.
    pub seed: u64,
    /// `cpu`, `simd` or `gpu`.
    pub backend: &'static str,
    /// Instruction set, or name of the adapter.
    pub adapter: String,
    /// What went wrong with devices and was got over; the study's figures hold all the same.
    pub device_faults: Vec<String>,
    /// Time taken (s).
    pub elapsed_s: f64,
    /// Candidates evaluated.
    pub evaluations: usize,
    /// Candidates that failed, by reason.
    pub failures: FailureCounts,
    /// Candidates per second.
    pub evaluations_per_s: f64,
    /// How far every parameter went, as a share of its value.
    pub share: f64,
    /// Base samples of the indices, and how many of these were left out because a car of theirs did not drive.
    pub samples: usize,
    /// See `samples`.
    pub left_out: usize,
    /// The base car's costs.
    pub base_costs: BTreeMap<String, f64>,
    /// Units of the costs.
    pub cost_units: BTreeMap<String, String>,
    /// The parameters, the one with the greatest share of the first cost's variance first.
    pub parameters: Vec<ParameterSensitivity>,
    /// What a reader must know before believing the figures.
    pub warnings: Vec<String>,
    /// Whether the study was broken off.
    pub interrupted: bool,
}

/// Width of an interval that is sure enough to tell what matters from what does not.
const SURE: f64 = 0.25;
/// Width beyond which the shares of a study are said to be unsure.
const UNSURE: f64 = 0.5;

/// What is wrong with shares from so many samples, where they say little: intervals wider than half of all there is, or a
/// share above the whole that is more than rounding.
fn doubts(parameters: &[ParameterSensitivity], samples: usize) -> Option<String> {
    let shares = parameters.iter().flat_map(|p| {
        p.sobol.iter().flat_map(|(cost, index)| {
            [
                (&p.name, cost, index.first, index.first_interval),
                (&p.name, cost, index.total, index.total_interval),
            ]
        })
    });
    let width = |interval: [f64; 2]| interval[1] - interval[0];
    let (name, cost, share, interval) =
        shares.max_by(|(_, _, _, a), (_, _, _, b)| width(*a).total_cmp(&width(*b)))?;
    if width(interval) <= UNSURE {
        return None;
    }
    // Intervals narrow with the root of the number of samples.
    let needed = samples as f64 * (width(interval) / SURE).powi(2);
    let needed = (needed as usize).next_power_of_two().min(MOST_SAMPLES);
    Some(format!(
        "{samples} samples are too few to believe the shares of variance, which may even come out above 1 or below 0: that of \
         {name} in the cost of {cost} is {share:.2}, and 95% sure only to lie between {:.2} and {:.2}; try --samples {needed}",
        interval[0], interval[1]
    ))
}

/// Puts the figures together.
pub fn summarise(settings: &SensitivitySettings, setup: &Setup, outcome: &Outcome) -> Summary {
    let problem = &setup.replay.problem;
    let names: Vec<&String> = problem.objectives.iter().map(|o| &o.name).collect();
    let mut parameters: Vec<ParameterSensitivity> = outcome
        .ranges
        .iter()
        .enumerate()
        .map(|(k, range)| ParameterSensitivity {
            name: range.name.clone(),
            unit: problem.variables[k].unit.clone(),
            value: outcome.base[k],
            range: [range.lower, range.upper],
            one_at_a_time: names
                .iter()
                .enumerate()
                .map(|(o, name)| ((*name).clone(), greatest_change(outcome, k, o)))
                .collect(),
            sobol: names
                .iter()
                .zip(&outcome.indices)
                .map(|(name, indices)| ((*name).clone(), indices[k]))
                .collect(),
        })
        .collect();
    let first = names[0].clone();
    let rank = |p: &ParameterSensitivity| {
        let change = p.one_at_a_time[&first].map_or(f64::INFINITY, f64::abs);
        p.sobol.get(&first).map_or(change, |i| i.total)
    };
    parameters.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
    Summary {
        study: "sensitivity",
        seed: settings.replay.seed,
        backend: outcome.backend.backend,
        adapter: outcome.backend.device.clone(),
        device_faults: outcome.device_faults.clone(),
        elapsed_s: outcome.elapsed_s,
        evaluations: outcome.evaluations,
        evaluations_per_s: outcome.evaluations as f64 / outcome.elapsed_s.max(1e-9),
        share: settings.share,
        samples: settings.samples,
        left_out: outcome.left_out,
        base_costs: names
            .iter()
            .map(|n| (*n).clone())
            .zip(outcome.base_costs.clone())
            .collect(),
        cost_units: problem
            .objectives
            .iter()
            .map(|o| (o.name.clone(), o.unit.clone()))
            .collect(),
        warnings: doubts(&parameters, settings.samples).into_iter().collect(),
        parameters,
        failures: outcome.failures.clone(),
        interrupted: outcome.interrupted,
    }
}

/// The change of a cost at that end of the parameter's range where it is greater.
fn greatest_change(outcome: &Outcome, parameter: usize, objective: usize) -> Option<f64> {
    let mut greatest: Option<f64> = Some(0.0);
    for row in outcome.one_at_a_time.iter().filter(|r| r.parameter == parameter) {
        let change = row
            .costs
            .as_ref()
            .map(|c| c[objective] - outcome.base_costs[objective]);
        greatest = greatest
            .zip(change)
            .map(|(g, c)| if c.abs() > g.abs() { c } else { g });
    }
    greatest
}

impl Summary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let first = self
            .base_costs
            .keys()
            .find(|n| *n == "all")
            .or(self.base_costs.keys().next());
        let Some(first) = first else {
            return String::new();
        };
        let names: Vec<String> = self.parameters.iter().map(|p| p.name.clone()).collect();
        let change: Vec<f64> = self
            .parameters
            .iter()
            .map(|p| p.one_at_a_time[first].unwrap_or(f64::NAN))
            .collect();
        let index = |f: fn(&SobolIndex) -> f64| -> Vec<f64> {
            let of = |p: &ParameterSensitivity| p.sobol.get(first).map_or(f64::NAN, f);
            self.parameters.iter().map(of).collect()
        };
        let (alone, total) = (index(|i| i.first), index(|i| i.total));
        let (low, high) = (index(|i| i.total_interval[0]), index(|i| i.total_interval[1]));
        let column = |name, cells| Column {
            name,
            unit: "",
            cells,
        };
        let table = text_table(&[
            column("parameter", Cells::Texts(&names)),
            column("change of cost", Cells::Numbers(&change)),
            column("share alone", Cells::Numbers(&alone)),
            column("share in all", Cells::Numbers(&total)),
            column("95% from", Cells::Numbers(&low)),
            column("to", Cells::Numbers(&high)),
        ]);
        let left = if self.left_out > 0 {
            format!(
                "; {} of {} samples left out, a car of theirs did not drive",
                self.left_out, self.samples
            )
        } else {
            String::new()
        };
        let faults: String = self
            .device_faults
            .iter()
            .map(|f| format!("Note: {f}\n"))
            .collect();
        let doubts: String = self.warnings.iter().map(|w| format!("Note: {w}\n")).collect();
        format!(
            "All channels together, each parameter {:.3}% either way:\n{table}{} evaluations in {:.1} s, {:.0}/s, {} {}{left}\n{faults}{doubts}",
            100.0 * self.share,
            self.evaluations,
            self.elapsed_s,
            self.evaluations_per_s,
            self.backend,
            self.adapter
        )
    }
}

/// Labels of the channels in pictures.
pub(super) const LABELS: [&str; 4] = [
    "speed",
    "longitudinal acceleration",
    "lateral acceleration",
    "yaw rate",
];

/// Writes `summary.json`, `manifest.json`, `study.toml`, `sobol.csv`, `one_at_a_time.csv`, and the pictures `sobol.svg`,
/// `one_at_a_time.svg` and `bands.svg`, and `report.html`.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub fn write_results(
    folder: &Path,
    settings: &SensitivitySettings,
    setup: &Setup,
    outcome: &Outcome,
    summary: &Summary,
) -> Result<()> {
    write_json(&folder.join("summary.json"), summary)?;
    let manifest = Manifest {
        log: Some(&setup.log.source),
        interrupted: outcome.interrupted,
        device_faults: &outcome.device_faults,
        longest_dispatch_ms: outcome.longest_dispatch_ms,
        ..Manifest::new(
            "sensitivity",
            settings.replay.seed,
            &outcome.backend,
            &setup.replay.free.car.name,
        )
    };
    let study = settings.to_toml();
    write_study(folder, &study)?;
    write_one_at_a_time(folder, setup, outcome)?;
    plot_one_at_a_time(folder, summary)?;
    if !outcome.indices.is_empty() {
        write_sobol(folder, summary)?;
        plot_sobol(folder, summary)?;
    }
    plot_bands(folder, outcome)?;
    super::page::write(folder, &study, setup, outcome, summary)?;
    // Last: it says that the run is whole.
    write_json(&folder.join("manifest.json"), &manifest)
}

fn write_one_at_a_time(folder: &Path, setup: &Setup, outcome: &Outcome) -> Result<()> {
    let objectives = &setup.replay.problem.objectives;
    let rows = &outcome.one_at_a_time;
    let names: Vec<String> = rows
        .iter()
        .map(|r| outcome.ranges[r.parameter].name.clone())
        .collect();
    let values: Vec<f64> = rows.iter().map(|r| r.value).collect();
    let costs: Vec<Vec<f64>> = (0..objectives.len())
        .map(|k| {
            rows.iter()
                .map(|r| r.costs.as_ref().map_or(f64::NAN, |c| c[k]))
                .collect()
        })
        .collect();
    let mut columns = vec![
        Column {
            name: "parameter",
            unit: "",
            cells: Cells::Texts(&names),
        },
        Column {
            name: "value",
            unit: "",
            cells: Cells::Numbers(&values),
        },
    ];
    columns.extend(objectives.iter().zip(&costs).map(|(o, c)| Column {
        name: &o.name,
        unit: &o.unit,
        cells: Cells::Numbers(c),
    }));
    write_csv(folder.join("one_at_a_time.csv"), &columns)
}

fn write_sobol(folder: &Path, summary: &Summary) -> Result<()> {
    let mut names = Vec::new();
    let mut costs = Vec::new();
    let mut figures: [Vec<f64>; 6] = Default::default();
    for p in &summary.parameters {
        for (cost, i) in &p.sobol {
            names.push(p.name.clone());
            costs.push(cost.clone());
            let row = [
                i.first,
                i.first_interval[0],
                i.first_interval[1],
                i.total,
                i.total_interval[0],
                i.total_interval[1],
            ];
            for (column, x) in figures.iter_mut().zip(row) {
                column.push(x);
            }
        }
    }
    let heads = [
        "first",
        "first_lower",
        "first_upper",
        "total",
        "total_lower",
        "total_upper",
    ];
    let column = |name, cells| Column {
        name,
        unit: "",
        cells,
    };
    let mut columns = vec![
        column("parameter", Cells::Texts(&names)),
        column("cost", Cells::Texts(&costs)),
    ];
    columns.extend(
        heads
            .into_iter()
            .zip(&figures)
            .map(|(name, c)| column(name, Cells::Numbers(c))),
    );
    write_csv(folder.join("sobol.csv"), &columns)
}

/// Most parameters that a picture has room for.
const SHOWN: usize = 30;

fn plot_sobol(folder: &Path, summary: &Summary) -> Result<()> {
    let title = "Shares of variance (Sobol indices) with 95% intervals";
    sobol_panels(summary, |panels| {
        plot_bars(folder.join("sobol.svg"), title, panels)
    })
}

/// Hands on the panels of the indices, one for each cost.
pub(super) fn sobol_panels(
    summary: &Summary,
    show: impl FnOnce(&[BarPanel<'_>]) -> Result<()>,
) -> Result<()> {
    let shown = &summary.parameters[..summary.parameters.len().min(SHOWN)];
    let panels: Vec<BarPanel<'_>> = summary
        .base_costs
        .keys()
        .map(|cost| {
            let series =
                |label, value: fn(&SobolIndex) -> f64, interval: fn(&SobolIndex) -> [f64; 2]| BarSeries {
                    label,
                    values: shown.iter().map(|p| value(&p.sobol[cost])).collect(),
                    intervals: shown.iter().map(|p| interval(&p.sobol[cost])).collect(),
                };
            BarPanel {
                title: cost,
                x_label: "share of the cost's variance",
                names: shown.iter().map(|p| p.name.as_str()).collect(),
                series: vec![
                    series("alone", |i| i.first, |i| i.first_interval),
                    series("with all that it acts with", |i| i.total, |i| i.total_interval),
                ],
            }
        })
        .collect();
    show(&panels)
}

fn plot_one_at_a_time(folder: &Path, summary: &Summary) -> Result<()> {
    let title = format!(
        "One parameter at a time, {:.3}% either way",
        100.0 * summary.share
    );
    one_at_a_time_panels(summary, |panels| {
        if panels.is_empty() {
            return Ok(());
        }
        plot_bars(folder.join("one_at_a_time.svg"), &title, panels)
    })
}

/// Hands on the panels of the changes, one for each cost that has any.
pub(super) fn one_at_a_time_panels(
    summary: &Summary,
    show: impl FnOnce(&[BarPanel<'_>]) -> Result<()>,
) -> Result<()> {
    let shown = &summary.parameters[..summary.parameters.len().min(SHOWN)];
    let labels: Vec<(String, String)> = summary
        .cost_units
        .iter()
        .map(|(name, unit)| (name.clone(), format!("greatest change of the cost ({unit})")))
        .collect();
    let panels: Vec<BarPanel<'_>> = labels
        .iter()
        .map(|(cost, label)| BarPanel {
            title: cost,
            x_label: label,
            names: shown.iter().map(|p| p.name.as_str()).collect(),
            series: vec![BarSeries {
                label: "",
                values: shown
                    .iter()
                    .map(|p| p.one_at_a_time[cost].unwrap_or(f64::NAN))
                    .collect(),
                intervals: Vec::new(),
            }],
        })
        .filter(|panel| panel.series[0].values.iter().any(|v| v.is_finite()))
        .collect();
    show(&panels)
}

/// The change that the parameters make at each place, least and greatest: the outputs themselves would hide it.
fn plot_bands(folder: &Path, outcome: &Outcome) -> Result<()> {
    let band = &outcome.band;
    let labels: Vec<String> = (0..LABELS.len())
        .map(|k| format!("change ({})", CHANNEL_UNITS[k]))
        .collect();
    let curve = |label, y: &[f64], base: &[f64]| Curve {
        label,
        x: band.distance_m.clone(),
        y: y.iter().zip(base).map(|(y, b)| y - b).collect(),
        shade: None,
    };
    let panels: Vec<CurvePanel<'_>> = (0..LABELS.len())
        .map(|k| CurvePanel {
            title: LABELS[k],
            x_label: "distance (m)",
            y_label: &labels[k],
            curves: vec![
                curve("least of all", &band.low[k], &band.base[k]),
                curve("greatest of all", &band.high[k], &band.base[k]),
            ],
        })
        .collect();
    let title = format!(
        "What {} parameters change along the lap, one at a time at {} steps",
        outcome.ranges.len(),
        LEVELS.len()
    );
    plot_curves(folder.join("bands.svg"), &title, &panels)
}
