//! What set-ups with lines of their own leave behind.

use crate::error::Result;
use crate::report::{Curves, HtmlReport, Panel, Table};
use crate::study::raceline::{SetupLap, SetupsOutcome, SolvedSetup};
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// What a parameter is worth, by least squares over all set-ups.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ParameterWorth {
    /// Least and greatest value among the set-ups.
    pub range: [f64; 2],
    /// Lap time (s) for each percent of the parameter more.
    pub lap_time_s_per_percent: f64,
}

/// A set-up in figures.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SetupFigures {
    /// The set-up: zero is the car as it is.
    pub setup: usize,
    /// Values of the parameters, by name.
    pub values: BTreeMap<String, f64>,
    /// Fine lap time on its own line (s).
    pub lap_time_s: f64,
    /// What that line gains on the line of the car as it is (s).
    pub own_line_gains_s: f64,
    /// Least distance from the car to the edges (m).
    pub clearance_m: f64,
    /// How far the lap is above a reference optimum of the set-up's own (%); `null` outside the sample.
    pub above_exact_percent: Option<f64>,
}

/// The figures of all set-ups.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SetupsSummary {
    /// Parameters that set-ups move.
    pub parameters: Vec<String>,
    /// How far, as a share of their values.
    pub share: f64,
    /// Set-ups with a lap, the car as it is among them.
    pub solved: usize,
    /// Those without.
    pub failed: usize,
    /// Fastest laps found in a second.
    pub laps_per_s: f64,
    /// What each parameter is worth; none with too few set-ups to tell.
    pub worth: BTreeMap<String, ParameterWorth>,
    /// How far the laps that the worths give are from those found, root mean square (s).
    pub worth_rms_s: Option<f64>,
    /// The ten fastest.
    pub fastest: Vec<SetupFigures>,
    /// The greatest distance of a lap of the sample from its reference optimum (%).
    pub greatest_above_exact_percent: Option<f64>,
}

/// Set-ups that are listed.
const LISTED: usize = 10;

fn laps(outcome: &SetupsOutcome) -> impl Iterator<Item = (usize, &SolvedSetup, &SetupLap)> {
    let each = outcome.solved.iter().enumerate();
    each.filter_map(|(number, setup)| Some((number, setup, setup.lap.as_ref()?)))
}

fn above_exact_percent(lap: &SetupLap) -> Option<f64> {
    Some(100.0 * (lap.lap_time_s / lap.reference_s? - 1.0))
}

/// Puts the figures together.
pub(super) fn summarise(outcome: &SetupsOutcome, share: f64) -> SetupsSummary {
    let names: Vec<String> = outcome.parameters.iter().map(|p| p.name.clone()).collect();
    let figures = |(setup, solved, lap): (usize, &SolvedSetup, &SetupLap)| SetupFigures {
        setup,
        values: names.iter().cloned().zip(solved.values.iter().copied()).collect(),
        lap_time_s: lap.lap_time_s,
        own_line_gains_s: lap.on_first_line_s - lap.lap_time_s,
        clearance_m: lap.clearance_m,
        above_exact_percent: above_exact_percent(lap),
    };
    let mut fastest: Vec<SetupFigures> = laps(outcome).map(figures).collect();
    let solved = fastest.len();
    fastest.sort_by(|a, b| a.lap_time_s.total_cmp(&b.lap_time_s));
    fastest.truncate(LISTED);
    let (worth, worth_rms_s) = worths(outcome).unwrap_or_default();
    SetupsSummary {
        share,
        solved,
        failed: outcome.solved.len() - solved,
        laps_per_s: outcome.solved.len() as f64 / outcome.elapsed_s.max(1e-9),
        worth: names.iter().cloned().zip(worth).collect(),
        worth_rms_s,
        parameters: names,
        fastest,
        greatest_above_exact_percent: laps(outcome)
            .filter_map(|(.., lap)| above_exact_percent(lap))
            .reduce(f64::max),
    }
}

/// What each parameter is worth, and how well that says the laps; nothing with fewer set-ups than twice the unknowns.
fn worths(outcome: &SetupsOutcome) -> Option<(Vec<ParameterWorth>, Option<f64>)> {
    let own = &outcome.solved.first()?.values;
    let rows: Vec<_> = laps(outcome).collect();
    let (n, m) = (rows.len(), own.len() + 1);
    if n < 2 * m {
        return None;
    }
    let percent = |row: usize, k: usize| 100.0 * (rows[row].1.values[k] / own[k] - 1.0);
    let matrix = DMatrix::from_fn(n, m, |row, k| if k == 0 { 1.0 } else { percent(row, k - 1) });
    let times = DVector::from_fn(n, |row, _| rows[row].2.lap_time_s);
    let slopes = (matrix.transpose() * &matrix)
        .cholesky()?
        .solve(&(matrix.transpose() * &times));
    let worth = |k: usize| {
        let values = rows.iter().map(|row| row.1.values[k]);
        ParameterWorth {
            range: [
                values.clone().fold(f64::INFINITY, f64::min),
                values.fold(f64::NEG_INFINITY, f64::max),
            ],
            lap_time_s_per_percent: slopes[k + 1],
        }
    };
    let left = (matrix * &slopes - times).norm() / (n as f64).sqrt();
    Some(((0..own.len()).map(worth).collect(), Some(left)))
}

impl SetupsSummary {
    /// The figures in words.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "Fastest lines of {} set-ups, {:.1} a second\n{}",
            self.solved,
            self.laps_per_s,
            worth_table(self).to_text()
        );
        if let Some(fastest) = self.fastest.first() {
            text += &format!(
                "The fastest is set-up {} in {:.3} s; its own line gains {:.3} s on that of the car as it is\n",
                fastest.setup, fastest.lap_time_s, fastest.own_line_gains_s
            );
        }
        if let Some(percent) = self.greatest_above_exact_percent {
            text += &format!(
                "Laps of a sample are {percent:.3} % above reference optima of their own at the most\n"
            );
        }
        if self.failed > 0 {
            text += &format!(
                "{} set-ups have no lap: their cars have no steady states in bends\n",
                self.failed
            );
        }
        text
    }
}

fn worth_table(summary: &SetupsSummary) -> Table<'static> {
    Table::rows(
        summary
            .worth
            .iter()
            .map(|(name, worth)| (name.clone(), worth.clone()))
            .collect::<Vec<_>>(),
    )
    .text("parameter", |(name, _)| name.clone())
    .number("from", "", |(_, worth)| worth.range[0])
    .number("to", "", |(_, worth)| worth.range[1])
    .number("lap time", "s/%", |(_, worth)| worth.lap_time_s_per_percent)
    .table()
}

/// Writes `setups.csv`, `setup_worth.csv` and `setups.svg`, and their part of the page.
///
/// # Errors
/// [`crate::Error::Io`] if a file cannot be written.
pub(super) fn report(
    page: &mut HtmlReport,
    folder: &Path,
    outcome: &SetupsOutcome,
    summary: &SetupsSummary,
) -> Result<()> {
    let numbered = outcome.solved.iter().enumerate().collect::<Vec<_>>();
    let lap = |row: &(usize, &SolvedSetup), of: fn(&SetupLap) -> Option<f64>| row.1.lap.as_ref().and_then(of);
    let mut table = Table::rows(numbered)
        .number("set-up", "", |row| row.0 as f64)
        .number("lap time", "s", |row| lap(row, |lap| Some(lap.lap_time_s)))
        .number("gained by its own line", "s", |row| {
            lap(row, |lap| Some(lap.on_first_line_s - lap.lap_time_s))
        })
        .number("clearance", "m", |row| lap(row, |lap| Some(lap.clearance_m)))
        .number("above exact", "%", |row| lap(row, above_exact_percent));
    for (k, parameter) in outcome.parameters.iter().enumerate() {
        let unit = parameter.info.unit.trim_matches('-');
        table = table.number(&*parameter.name, unit, |row| row.1.values[k]);
    }
    let table = table.table();
    table.write_csv(folder.join("setups.csv"))?;
    page.section("Set-ups", "Each has an envelope and a fastest line of its own.");
    if !summary.worth.is_empty() {
        let worth = worth_table(summary);
        worth.write_csv(folder.join("setup_worth.csv"))?;
        let note = "Lap time for each percent of a parameter more, by least squares over all set-ups.";
        page.table("What parameters are worth", note, &worth)?;
    }
    let panels = outcome.parameters.iter().enumerate().map(|(k, parameter)| {
        let points = laps(outcome).map(|(_, setup, lap)| (setup.values[k], lap.lap_time_s));
        Panel::new(format!("Lap time over {}", parameter.name))
            .x(&parameter.name, parameter.info.unit.trim_matches('-'))
            .y("lap time", "s")
            .dots("", points)
    });
    let scatters = Curves::new("Fastest laps of the set-ups", panels.filter(Panel::has_points));
    if !scatters.is_empty() {
        page.figure(folder.join("setups.svg"), &scatters)?;
    }
    page.folded_table("All set-ups", "", &table)
}
