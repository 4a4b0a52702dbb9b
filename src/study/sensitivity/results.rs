//! What a sensitivity study leaves behind.

use super::{MOST_SAMPLES, OUTPUTS, Outcome, Outputs, Sensitivity, SobolIndex, output};
use crate::error::Result;
use crate::report::{BarPanel, Bars, Table};
use crate::study::framework::{RunRecord, Solved};
use crate::study::identify::Setup;
use crate::study::replayed::of_cost;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The figures of one parameter.
#[derive(Clone, Debug, Serialize, Deserialize)]
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
    /// Greatest root of the mean squared change of each output as the parameter alone is moved; nothing where no car then drives.
    #[serde(default)]
    pub rms_change: BTreeMap<String, Option<f64>>,
    /// Its share of each cost's variance; empty if the study was interrupted.
    pub sobol: BTreeMap<String, SobolIndex>,
}

/// The figures of the study; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// `sensitivity`.
    pub study: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How the study ran.
    #[serde(flatten)]
    pub record: RunRecord,
    /// How far every parameter without a range of its own went, as a share of its value.
    pub share: f64,
    /// The same in words, or that each has its own range.
    #[serde(skip)]
    pub(super) reach: String,
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
pub(super) fn summarise(solved: &Solved<'_, Sensitivity>) -> Summary {
    let (settings, outcome) = (solved.settings, solved.outcome);
    let problem = &solved.prepared.replay.problem;
    let names = || problem.objectives.iter().map(|o| o.name.clone());
    let each = problem.variables.iter().enumerate();
    let mut parameters: Vec<ParameterSensitivity> = each
        .map(|(k, variable)| ParameterSensitivity {
            name: variable.name.clone(),
            unit: variable.unit.clone(),
            value: outcome.base[k],
            range: [variable.lower, variable.upper],
            one_at_a_time: names()
                .zip((0..).map(|o| greatest_change(outcome, k, o)))
                .collect(),
            rms_change: (0..OUTPUTS)
                .map(|o| (output(o)[0].to_owned(), greatest_rms(outcome, k, o)))
                .collect(),
            sobol: names()
                .zip(outcome.indices.iter().map(|indices| indices[k]))
                .collect(),
        })
        .collect();
    let first = problem.objectives[0].name.clone();
    let rank = |p: &ParameterSensitivity| {
        let change = p.one_at_a_time[&first].map_or(f64::INFINITY, f64::abs);
        p.sobol.get(&first).map_or(change, |i| i.total)
    };
    parameters.sort_by(|a, b| rank(b).total_cmp(&rank(a)));
    Summary {
        study: "sensitivity".to_owned(),
        seed: settings.replay.seed,
        record: outcome.record.clone(),
        share: settings.share,
        reach: settings.reach(),
        samples: settings.samples,
        left_out: outcome.left_out,
        base_costs: names().zip(outcome.base_costs.clone()).collect(),
        cost_units: names()
            .zip(problem.objectives.iter().map(|o| o.unit.clone()))
            .collect(),
        warnings: doubts(&parameters, settings.samples).into_iter().collect(),
        parameters,
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

/// The greatest root of the mean squared change of an output, over the values of a parameter at which the car drives.
fn greatest_rms(outcome: &Outcome, parameter: usize, output: usize) -> Option<f64> {
    let [base, moved @ ..] = &outcome.outputs[..] else {
        return None;
    };
    let rows = outcome.one_at_a_time.iter().zip(moved);
    let own = rows.filter(|(row, _)| row.parameter == parameter && row.costs.is_some());
    let rms = |outputs: &Outputs| {
        let changes = outputs[output]
            .iter()
            .zip(&base[output])
            .map(|(a, b)| (a - b).powi(2));
        let (sum, count) = changes
            .filter(|c| c.is_finite())
            .fold((0.0, 0.0), |(sum, count), c| (sum + c, count + 1.0));
        (sum / count).sqrt()
    };
    own.map(|(_, outputs)| rms(outputs))
        .filter(|r| r.is_finite())
        .reduce(f64::max)
}

impl Summary {
    /// The cost that words tell of: all channels together, if there is such a one.
    pub(super) fn first_cost(&self) -> Option<&String> {
        let costs = &self.base_costs;
        costs.keys().find(|n| *n == "all").or(costs.keys().next())
    }

    /// The figures in words.
    pub fn to_text(&self) -> String {
        let table = match self.first_cost() {
            Some(cost) => parameter_table(self, cost),
            None => return String::new(),
        };
        let table = table.to_text();
        let left = if self.left_out > 0 {
            format!(
                "; {} of {} samples left out, because one of their cars did not drive",
                self.left_out, self.samples
            )
        } else {
            String::new()
        };
        let doubts: String = self.warnings.iter().map(|w| format!("Note: {w}\n")).collect();
        let record = &self.record;
        format!(
            "All channels together, each parameter {}:\n{table}{} evaluations in {:.1} s, {:.0}/s, {}{left}\n{}{doubts}",
            self.reach,
            record.evaluations,
            record.elapsed_s,
            record.evaluations_per_s,
            record.device(),
            record.notes()
        )
    }
}

pub(super) fn write_one_at_a_time(folder: &Path, setup: &Setup, outcome: &Outcome) -> Result<()> {
    let problem = &setup.replay.problem;
    let mut table = Table::rows(&outcome.one_at_a_time)
        .text("parameter", |r| &*problem.variables[r.parameter].name)
        .number("value", "", |r| r.value);
    for (k, o) in problem.objectives.iter().enumerate() {
        table = table.number(&*o.name, &*o.unit, |r| r.costs.as_ref().map(|c| c[k]));
    }
    table.table().write_csv(folder.join("one_at_a_time.csv"))
}

pub(super) fn write_sobol(folder: &Path, summary: &Summary) -> Result<()> {
    let all = summary.parameters.iter();
    Table::rows(all.flat_map(|p| p.sobol.iter().map(|(cost, index)| (&*p.name, &**cost, index))))
        .text("parameter", |(name, ..)| *name)
        .text("cost", |(_, cost, _)| *cost)
        .number("first", "", |(.., i)| i.first)
        .number("first_lower", "", |(.., i)| i.first_interval[0])
        .number("first_upper", "", |(.., i)| i.first_interval[1])
        .number("total", "", |(.., i)| i.total)
        .number("total_lower", "", |(.., i)| i.total_interval[0])
        .number("total_upper", "", |(.., i)| i.total_interval[1])
        .table()
        .write_csv(folder.join("sobol.csv"))
}

/// The parameters with their changes and shares of a cost.
pub(super) fn parameter_table(summary: &Summary, cost: &str) -> Table<'static> {
    let index = |f: fn(&SobolIndex) -> f64| move |p: &&ParameterSensitivity| p.sobol.get(cost).map(f);
    Table::rows(&summary.parameters)
        .text("parameter", |p| &*p.name)
        .text("unit", |p| &*p.unit)
        .number("value", "", |p| p.value)
        .number("from", "", |p| p.range[0])
        .number("to", "", |p| p.range[1])
        .number("change of cost", "", |p| p.one_at_a_time[cost])
        .number("share alone", "", index(|i| i.first))
        .number("share in all", "", index(|i| i.total))
        .number("95% from", "", index(|i| i.total_interval[0]))
        .number("95% to", "", index(|i| i.total_interval[1]))
        .table()
}

/// What the parameters change of each output.
pub(super) fn output_table(summary: &Summary) -> Table<'static> {
    let table = Table::rows(&summary.parameters).text("parameter", |p| &*p.name);
    let each = (0..OUTPUTS).map(output);
    let table = each.fold(table, |table, [name, label, unit]| {
        table.number(label, unit, |p| p.rms_change[name])
    });
    table.table()
}

/// Most parameters that a figure has room for.
const SHOWN: usize = 30;

fn shown(summary: &Summary) -> &[ParameterSensitivity] {
    &summary.parameters[..summary.parameters.len().min(SHOWN)]
}

/// The shares of variance, a panel for each cost.
pub(super) fn sobol_figure(summary: &Summary) -> Bars {
    let shown = shown(summary);
    let panels = summary.base_costs.keys().map(|cost| {
        let of = |f: fn(&SobolIndex) -> f64| shown.iter().map(move |p| f(&p.sobol[cost]));
        let interval = |f: fn(&SobolIndex) -> [f64; 2]| shown.iter().map(move |p| f(&p.sobol[cost]));
        BarPanel::new(
            of_cost(cost),
            "share of the cost's variance",
            shown.iter().map(|p| &*p.name),
        )
        .with_intervals("alone", of(|i| i.first), interval(|i| i.first_interval))
        .with_intervals(
            "with all that it acts with",
            of(|i| i.total),
            interval(|i| i.total_interval),
        )
    });
    Bars::new("Shares of variance (Sobol indices) with 95% intervals", panels)
}

/// The changes, a panel for each cost that has any.
pub(super) fn one_at_a_time_figure(summary: &Summary) -> Bars {
    let shown = shown(summary);
    let panels = summary.cost_units.iter().map(|(cost, unit)| {
        let label = format!("greatest change of the cost ({unit})");
        let changes = shown.iter().map(|p| p.one_at_a_time[cost].unwrap_or(f64::NAN));
        BarPanel::new(of_cost(cost), label, shown.iter().map(|p| &*p.name)).bars("", changes)
    });
    let title = format!("One parameter at a time, each {}", summary.reach);
    Bars::new(title, panels.filter(BarPanel::has_bars))
}
