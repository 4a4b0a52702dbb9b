//! What an identification leaves behind: figures for people and scripts, files, figures.

use super::Identify;
use super::choose::Choice;
use super::identifiability::at_bound;
use super::notes::notes;
use super::search::{Judged, Outcome, judge_candidate, total_parameter_error};
use super::settings::IdentifySettings;
use super::setup::{CHANNELS, Setup};
use super::verdict::{Untold, Verdict};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::evaluate::replay::{CHANNEL_NAMES, CHANNEL_UNITS, ReplayProblem, Sample, trace};
use crate::report::{ParameterRow, Table};
use crate::study::framework::{RunRecord, Solved, with_tyres};
use crate::telemetry::Log;
use crate::vehicle::Reached;
use crate::vehicle::wheels::{Moment, moments_of};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;
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
    /// The value in the car that was judged and written, whether the log tells it or not.
    pub car_value: f64,
    /// Its standard error, where the log tells anything.
    pub standard_error: Option<f64>,
    /// The truth, where known.
    pub truth: Option<f64>,
    /// Whether the car's value is at one of the bounds: the log would have it elsewhere.
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
    /// What may be said of the unknowns: the strictest of what applies.
    pub verdict: Verdict,
    /// The same in words, with all that applies.
    pub verdict_text: String,
    /// Parameters that the log cannot tell, each by itself.
    pub unidentifiable: Vec<String>,
    /// The same in groups that the log cannot tell apart.
    pub untold_groups: Vec<Untold>,
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
    /// Steps per sample that the car needs which was found.
    pub substeps_needed: usize,
    /// Windows fitted.
    pub windows: usize,
    /// Time that each window is driven before it is scored, s.
    pub settle_s: f64,
    /// How the free parameters were chosen, where the log chose them (`free` with `auto`).
    pub choice: Option<Choice>,
    /// What limits these results, in words.
    pub notes: Vec<String>,
    /// What the telemetry's calibration found and applied.
    pub calibration: crate::telemetry::Calibration,
}

fn by_channel(values: [f64; CHANNELS]) -> BTreeMap<String, f64> {
    CHANNEL_NAMES.into_iter().map(str::to_owned).zip(values).collect()
}

/// Works the figures out.
pub(super) fn summarise(settings: &IdentifySettings, setup: &Setup, outcome: &Outcome) -> Summary {
    let replay = &outcome.replay;
    let judged = judge_candidate(replay, &outcome.candidate);
    let held = outcome
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
            car_value: outcome.candidate[k],
            standard_error: Some(identifiability.standard_errors[k]).filter(|e| e.is_finite()),
            truth: setup.truth.as_ref().map(|t| t[k]),
            at_bound: at_bound(outcome.candidate[k], [v.lower, v.upper]),
        })
        .collect();
    let untold_groups = identifiability.groups.iter().map(|group| Untold {
        parameters: group
            .members
            .iter()
            .map(|k| parameters[*k].name.clone())
            .collect(),
        combinations_told: group.combinations_told,
    });
    let mut summary = Summary {
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
        verdict: Verdict::AllTold,
        verdict_text: String::new(),
        untold_groups: untold_groups.collect(),
        parameters,
        sample_interval_s: replay.interval_s,
        substeps: replay.plan.fractions.len(),
        substeps_needed: replay.steps_needed(&replay.flat(&outcome.candidate)),
        windows: replay.plan.windows.len(),
        settle_s: setup.settle_s,
        choice: setup.choice.clone(),
        notes: Vec::new(),
        calibration: setup.log.calibration.clone(),
    };
    summary.notes = notes(setup, &summary);
    (summary.verdict, summary.verdict_text) = Verdict::of(&summary);
    summary
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
        .number("car_value", "", |p| p.car_value)
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
            fitted: p.car_value,
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

/// What `car.toml` says of itself: where it comes from, and what the log does not tell of it.
pub(super) fn car_comment(source: &str, summary: &Summary) -> String {
    let mut text = format!(
        "Found by lapswarm identify from {source}.\n{}\n",
        summary.verdict_text
    );
    for p in &summary.parameters {
        let told = match (&p.value, p.at_bound) {
            (None, _) => "not told by the log",
            (Some(_), true) => "at a bound of the search",
            (Some(_), false) => continue,
        };
        let error = match p.standard_error {
            Some(error) => format!("standard error {error:.3e} {}", p.unit),
            None => format!("anywhere from {} to {} {}", p.bounds[0], p.bounds[1], p.unit),
        };
        text.push_str(&format!("{}: {told}, {}\n", p.name, error.trim_end_matches(" -")));
    }
    text
}

/// What the car holds in the windows that were fitted.
pub(super) fn reached(replay: &ReplayProblem) -> Reached {
    let plan = &replay.plan;
    let stretches: Vec<Vec<[f64; 3]>> = plan
        .windows
        .iter()
        .map(|w| {
            let scored = &plan.samples[w.start + w.scored_from..w.end];
            let figures = scored
                .iter()
                .map(|s| [s.measured[0], s.measured[2], s.measured[1]]);
            figures.collect()
        })
        .collect();
    Reached::of(stretches.iter().map(Vec::as_slice), replay.interval_s)
}

/// One lap, the first that has a fitted sample: laps over one another would not be legible.
pub(super) fn traced_lap(log: &crate::telemetry::Log, judged: &Judged) -> std::ops::Range<usize> {
    let fitted = |i: usize| judged.outputs[0][i].is_finite();
    let mut laps = log.laps.iter().map(|l| l.start..l.end);
    laps.find(|r| r.clone().any(fitted)).unwrap_or(0..log.samples())
}

/// What the fitted car's tyres do on the lap that is drawn.
pub(super) struct Tyres {
    /// Samples of the lap.
    pub lap: Range<usize>,
    /// At each of them; nothing where no window is scored.
    pub moments: Vec<Option<Moment>>,
}

impl Tyres {
    /// Of the car that was judged.
    pub fn of(solved: &Solved<'_, Identify>, judged: &Judged) -> Self {
        let (replay, candidate) = (&solved.outcome.replay, &solved.outcome.candidate);
        let lap = traced_lap(&solved.prepared.log, judged);
        let mut moments = vec![None; lap.len()];
        let (car, flat) = (replay.free.candidate_car(candidate), replay.flat(candidate));
        let windows = &replay.plan.windows;
        for window in windows.iter().filter(|w| w.start < lap.end && w.end > lap.start) {
            let driven = trace(&flat, replay.tyre_model(), &replay.plan, window);
            let samples = replay.plan.samples[window.start..].iter().map(Sample::input);
            let driven: Vec<_> = driven.states.into_iter().zip(samples).collect();
            for (i, moment) in moments_of(&car, &driven).into_iter().enumerate() {
                let at = window.start + i;
                if i >= window.scored_from && lap.contains(&at) {
                    moments[at - lap.start] = Some(moment);
                }
            }
        }
        Self { lap, moments }
    }

    /// Writes `tyres.csv`.
    ///
    /// # Errors
    /// [`crate::Error::Io`] if it cannot be written.
    pub fn write(&self, folder: &Path, log: &Log) -> Result<()> {
        let table = Table::new()
            .numbers("time", "s", &log.time_s[self.lap.clone()])
            .numbers("distance", "m", &log.distance_m[self.lap.clone()]);
        with_tyres(table, &self.moments).write_csv(folder.join("tyres.csv"))
    }
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

impl Summary {
    /// The parameter table and the errors, for a terminal.
    pub fn to_text(&self, settings: &IdentifySettings) -> String {
        let mut text = super::page::parameters(self).to_text();
        text.push('\n');
        text.push_str(&super::page::channels(settings, self).to_text());
        text.push_str(&format!("\n{}\n", self.verdict_text));
        text.extend(self.notes.iter().map(|note| format!("Note: {note}\n")));
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
