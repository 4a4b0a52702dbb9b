//! What an identification leaves behind: figures for people and scripts, files, figures.

use super::identifiability::at_bound;
use super::search::{Judged, Outcome, judge_candidate, total_parameter_error};
use super::settings::IdentifySettings;
use super::setup::{CHANNELS, Setup};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::evaluate::replay::{CHANNEL_NAMES, CHANNEL_UNITS};
use crate::report::{ParameterRow, Table};
use crate::study::framework::RunRecord;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// One parameter's outcome.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ParameterSummary {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Bounds of the search.
    pub bounds: [f64; 2],
    /// What the swarm found.
    pub swarm_value: f64,
    /// The fitted value; nothing where the log cannot tell it.
    pub value: Option<f64>,
    /// Its standard error, where the log tells anything.
    pub standard_error: Option<f64>,
    /// The truth, where known.
    pub truth: Option<f64>,
    /// Whether the fitted value is at one of the bounds: the log would have it elsewhere.
    pub at_bound: bool,
}

/// The figures of an identification; `--json` prints this.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// `identify`.
    pub study: String,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How the study ran: search and polish, candidates of the swarm, and their rate while it worked.
    #[serde(flatten)]
    pub record: RunRecord,
    /// Swarm alone, s.
    pub swarm_elapsed_s: f64,
    /// Runge-Kutta steps of one candidate per second, over all candidates.
    pub particle_steps_per_s: f64,
    /// Sum of relative errors of the identifiable parameters (5.14); nothing without a truth.
    pub total_parameter_error: Option<f64>,
    /// The same for the swarm's best, before the polish.
    pub swarm_total_parameter_error: Option<f64>,
    /// Cost of each channel.
    pub costs: BTreeMap<String, f64>,
    /// Root mean square error of each channel, in its unit.
    pub rms_error: BTreeMap<String, f64>,
    /// Root mean square of each measured channel, in its unit.
    pub rms_signal: BTreeMap<String, f64>,
    /// Root mean square error on the laps held out; nothing without any.
    pub holdout_rms_error: Option<BTreeMap<String, f64>>,
    /// Root mean square of the measured channels on the laps held out.
    pub holdout_rms_signal: Option<BTreeMap<String, f64>>,
    /// Windows on the laps held out, and how many of them lost the car.
    pub holdout_lost_windows: Option<[usize; 2]>,
    /// Parameters that the log cannot tell.
    pub unidentifiable: Vec<String>,
    /// How far least squares would still move an identifiable parameter, in its standard errors, at most; zero at a minimum.
    pub step_in_standard_errors: Option<f64>,
    /// Whether the errors that remain look like noise, for which standard errors take them.
    pub errors_look_like_noise: bool,
    /// Hops from the polished minimum that were tried, and that led further down.
    pub hops: [usize; 2],
    /// Singular values of the scaled Jacobian, greatest first.
    pub singular_values: Vec<f64>,
    /// Standard deviation of the errors that remain, in the channel's unit.
    pub noise_estimate: BTreeMap<String, f64>,
    /// The parameters.
    pub parameters: Vec<ParameterSummary>,
    /// Sample interval, s.
    pub sample_interval_s: f64,
    /// Runge-Kutta steps per sample.
    pub substeps: usize,
    /// Windows fitted.
    pub windows: usize,
    /// What the telemetry's calibration found and applied.
    pub calibration: crate::telemetry::Calibration,
}

fn by_channel(values: [f64; CHANNELS]) -> BTreeMap<String, f64> {
    CHANNEL_NAMES.into_iter().map(str::to_owned).zip(values).collect()
}

/// The candidate to hand out: fitted values, but the starting car's where the log cannot tell.
pub(super) fn reported_candidate(setup: &Setup, outcome: &Outcome) -> Vec<f64> {
    let free = &setup.replay.free;
    let mut candidate = free.values_in(free.base());
    let told = outcome
        .candidate
        .iter()
        .zip(&outcome.identifiability.identifiable);
    for (x, (fitted, told)) in candidate.iter_mut().zip(told) {
        if *told {
            *x = *fitted;
        }
    }
    candidate
}

/// Works the figures out.
pub(super) fn summarise(settings: &IdentifySettings, setup: &Setup, outcome: &Outcome) -> Summary {
    let replay = &setup.replay;
    let judged = judge_candidate(replay, &outcome.candidate);
    let held = setup
        .holdout
        .as_ref()
        .map(|h| (judge_candidate(h, &outcome.candidate), h.plan.windows.len()));
    let identifiability = &outcome.identifiability;
    let told = |k: usize| identifiability.identifiable[k];
    let error_of = |candidate: &[f64]| {
        setup
            .truth
            .as_ref()
            .map(|t| total_parameter_error(candidate, t, told))
    };
    let steps: usize = replay
        .plan
        .windows
        .iter()
        .map(|w| (w.end - w.start - 1) * replay.plan.fractions.len())
        .sum();
    let parameters: Vec<ParameterSummary> = replay
        .problem
        .variables
        .iter()
        .enumerate()
        .map(|(k, v)| ParameterSummary {
            name: v.name.clone(),
            unit: v.unit.clone(),
            bounds: [v.lower, v.upper],
            swarm_value: outcome.swarm_candidate[k],
            value: told(k).then_some(outcome.candidate[k]),
            standard_error: Some(identifiability.standard_errors[k]).filter(|e| e.is_finite()),
            truth: setup.truth.as_ref().map(|t| t[k]),
            at_bound: told(k) && at_bound(outcome.candidate[k], [v.lower, v.upper]),
        })
        .collect();
    Summary {
        study: "identify".to_owned(),
        seed: settings.seed,
        record: outcome.record.clone(),
        swarm_elapsed_s: outcome.swarm_s,
        particle_steps_per_s: outcome.record.evaluations_per_s * steps as f64,
        total_parameter_error: error_of(&outcome.candidate),
        swarm_total_parameter_error: error_of(&outcome.swarm_candidate),
        costs: by_channel(judged.costs),
        rms_error: by_channel(judged.rms_error),
        rms_signal: by_channel(judged.rms_signal),
        holdout_rms_error: held.as_ref().map(|(h, _)| by_channel(h.rms_error)),
        holdout_rms_signal: held.as_ref().map(|(h, _)| by_channel(h.rms_signal)),
        holdout_lost_windows: held.as_ref().map(|(h, windows)| [h.lost_windows, *windows]),
        unidentifiable: parameters
            .iter()
            .filter(|p| p.value.is_none())
            .map(|p| p.name.clone())
            .collect(),
        step_in_standard_errors: Some(identifiability.step_in_errors).filter(|s| s.is_finite()),
        errors_look_like_noise: identifiability.looks_like_noise,
        hops: outcome.hops,
        singular_values: identifiability.singular_values.clone(),
        noise_estimate: by_channel(identifiability.noise),
        parameters,
        sample_interval_s: replay.interval_s,
        substeps: replay.plan.fractions.len(),
        windows: replay.plan.windows.len(),
        calibration: setup.log.calibration.clone(),
    }
}

pub(super) fn write_history(folder: &Path, outcome: &Outcome) -> Result<()> {
    let rows = &outcome.history;
    let width = rows.first().map_or(0, |r| r.best.len());
    let mut table = Table::rows(rows)
        .number("iteration", "", |r| r.iteration as f64)
        .number("evaluations", "", |r| r.evaluations as f64);
    for k in 0..width {
        let name = match width {
            1 => "best".to_owned(),
            _ => format!("best_{k}"),
        };
        // Nothing before a candidate has succeeded.
        table = table.number(name, "", |r| Some(r.best[k]).filter(|best| best.is_finite()));
    }
    table
        .number("median", "", |r| r.median)
        .number("failed", "", |r| r.failed as f64)
        .number("elapsed", "s", |r| r.elapsed_s)
        .table()
        .write_csv(folder.join("convergence.csv"))
}

pub(super) fn write_parameters(folder: &Path, summary: &Summary) -> Result<()> {
    Table::rows(&summary.parameters)
        .text("parameter", |p| &*p.name)
        .text("unit", |p| &*p.unit)
        .number("lower", "", |p| p.bounds[0])
        .number("upper", "", |p| p.bounds[1])
        .number("swarm_value", "", |p| p.swarm_value)
        .number("value", "", |p| p.value)
        .number("standard_error", "", |p| p.standard_error)
        .number("truth", "", |p| p.truth)
        .number("at_bound", "", |p| f64::from(u8::from(p.at_bound)))
        .table()
        .write_csv(folder.join("parameters.csv"))
}

/// The parameters as figures show them.
pub(super) fn parameter_rows(summary: &Summary) -> Vec<ParameterRow> {
    summary
        .parameters
        .iter()
        .map(|p| ParameterRow {
            name: p.name.clone(),
            unit: if p.unit == "-" {
                String::new()
            } else {
                p.unit.clone()
            },
            lower: p.bounds[0],
            upper: p.bounds[1],
            swarm: p.swarm_value,
            fitted: p.value.unwrap_or(p.swarm_value),
            standard_error: p.standard_error,
            truth: p.truth,
            identifiable: p.value.is_some(),
        })
        .collect()
}

pub(super) fn write_front(folder: &Path, setup: &Setup, front: &super::Front) -> Result<()> {
    let problem = &setup.replay.problem;
    let objectives = problem.objectives.iter().map(|o| (&o.name, &o.unit));
    let objectives = Table::rows(&front.objectives).each(objectives);
    objectives.table().write_csv(folder.join("FUN.csv"))?;
    let variables = problem.variables.iter().map(|v| (&v.name, &v.unit));
    let variables = Table::rows(&front.candidates).each(variables);
    variables.table().write_csv(folder.join("VAR.csv"))
}

/// One lap, the first that has a fitted sample: laps over one another would not be legible.
pub(super) fn traced_lap(log: &crate::telemetry::Log, judged: &Judged) -> std::ops::Range<usize> {
    let fitted = |i: usize| judged.outputs[0][i].is_finite();
    let mut laps = log.laps.iter().map(|l| l.start..l.end);
    laps.find(|r| r.clone().any(fitted)).unwrap_or(0..log.samples())
}

pub(super) fn write_traces(folder: &Path, setup: &Setup, judged: &Judged) -> Result<()> {
    let log = &setup.log;
    let measured = [&log.vx_mps, &log.ax_mps2, &log.ay_mps2, &log.yaw_rate_radps];
    let mut table = Table::new()
        .numbers("time", "s", &log.time_s)
        .numbers("distance", "m", &log.distance_m);
    for k in 0..CHANNELS {
        let (name, unit) = (CHANNEL_NAMES[k], CHANNEL_UNITS[k]);
        table = table
            .numbers(format!("{name}_measured"), unit, measured[k])
            .numbers(format!("{name}_fitted"), unit, &judged.outputs[k]);
    }
    table.write_csv(folder.join("traces.csv"))
}

/// Least squares may still move a parameter by this many of its standard errors at what counts as a minimum.
const AT_MINIMUM: f64 = 1.0;

impl Summary {
    /// Why the standard errors, and the verdict on what the log tells, are not to be taken at their word; nothing where they are.
    pub fn caution(&self) -> Option<String> {
        match self.step_in_standard_errors {
            Some(step) if step <= AT_MINIMUM => (!self.errors_look_like_noise).then(|| {
                "The residuals do not look like noise: the model lacks something of this car, and the standard errors are too \
                 small."
                    .to_owned()
            }),
            step => Some(format!(
                "This car is not at a minimum of the cost{}: standard errors and identifiability hold near a minimum only.",
                step.map_or(String::new(), |s| format!(
                    " (least squares would move a parameter by {s:.0} of its standard errors)"
                ))
            )),
        }
    }

    /// The parameter table and the errors, for a terminal.
    pub fn to_text(&self, settings: &IdentifySettings) -> String {
        let mut text = super::page::parameters(self).to_text();
        text.push('\n');
        text.push_str(&super::page::channels(settings, self).to_text());
        if self.unidentifiable.is_empty() {
            text.push_str("\nAll parameters are identifiable from this log.\n");
        } else {
            text.push_str(&format!(
                "\nNot identifiable from this log: {}. The starting car's values stand in their place.\n",
                self.unidentifiable.join(", ")
            ));
        }
        if let Some(caution) = self.caution() {
            text.push_str(&caution);
            text.push('\n');
        }
        if let [tried @ (1..), gained] = self.hops {
            text.push_str(&format!(
                "The residuals did not look like noise: {tried} hops to other minima, {gained} of which led to a lower cost.\n"
            ));
        }
        if let Some(error) = self.total_parameter_error {
            text.push_str(&format!(
                "Total parameter error (5.14): {error:.3e}; the swarm alone: {:.3}.\n",
                self.swarm_total_parameter_error.unwrap_or(f64::NAN)
            ));
        }
        text.push_str(&format!(
            "{} evaluations in {:.1} s on {} ({}): {:.0} per second, {:.2} million particle-steps per second; {:.1} s in all.\n",
            self.record.evaluations,
            self.swarm_elapsed_s,
            self.record.backend,
            self.record.adapter,
            self.record.evaluations_per_s,
            self.particle_steps_per_s / 1e6,
            self.record.elapsed_s
        ));
        if !self.record.failures.is_empty() {
            let told = failures_in_words(&self.record.failures);
            text.push_str(&format!("Candidates that failed: {told}.\n"));
        }
        text.push_str(&self.record.notes());
        text
    }
}
