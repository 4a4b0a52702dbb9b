//! What an identification leaves behind: figures for people and scripts, files, pictures.

use super::identifiability::at_bound;
use super::search::{Judged, Outcome, judge_candidate, total_parameter_error};
use super::settings::IdentifySettings;
use super::setup::{CHANNELS, Setup, cost_unit};
use super::study_file::write_settings;
use crate::error::Result;
use crate::evaluate::replay::{CHANNEL_NAMES, CHANNEL_UNITS};
use crate::evaluate::{FailureCounts, failures_in_words};
use crate::report::{
    Cells, Column, ConvergenceRun, Objective, ParameterRow, ShadedSection, TraceFigure, TracePanel, TrackMap,
    plot_convergence, plot_parameters, plot_pareto, plot_traces, plot_track_map, write_csv,
};
use crate::study::run_folder::{Manifest, write_json};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// One parameter's outcome.
#[derive(Clone, Debug, Serialize)]
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
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// `identify`.
    pub study: &'static str,
    /// Seed of all random numbers.
    pub seed: u64,
    /// `cpu`, `simd` or `gpu`.
    pub backend: &'static str,
    /// Instruction set, or name of the adapter.
    pub adapter: String,
    /// Driver of the adapter.
    pub driver: String,
    /// Search and polish, s.
    pub elapsed_s: f64,
    /// Swarm alone, s.
    pub swarm_elapsed_s: f64,
    /// Whether the search or the polish was broken off.
    pub interrupted: bool,
    /// Candidates that the swarm evaluated.
    pub evaluations: u64,
    /// Candidates that failed, by reason.
    pub failures: FailureCounts,
    /// What went wrong with devices and was got over; the study's figures hold all the same.
    pub device_faults: Vec<String>,
    /// Candidates per second of the swarm.
    pub evaluations_per_s: f64,
    /// Runge-Kutta steps of one candidate per second, over all candidates.
    pub particle_steps_per_s: f64,
    /// Sum of relative errors of the identifiable parameters (5.14); nothing without a truth.
    pub total_parameter_error: Option<f64>,
    /// The same for the swarm's best, before the polish.
    pub swarm_total_parameter_error: Option<f64>,
    /// Cost of each channel.
    pub costs: BTreeMap<&'static str, f64>,
    /// Root mean square error of each channel, in its unit.
    pub rms_error: BTreeMap<&'static str, f64>,
    /// Root mean square of each measured channel, in its unit.
    pub rms_signal: BTreeMap<&'static str, f64>,
    /// Root mean square error on the laps held out; nothing without any.
    pub holdout_rms_error: Option<BTreeMap<&'static str, f64>>,
    /// Root mean square of the measured channels on the laps held out.
    pub holdout_rms_signal: Option<BTreeMap<&'static str, f64>>,
    /// Windows on the laps held out, and how many of them lost the car.
    pub holdout_lost_windows: Option<[usize; 2]>,
    /// Parameters that the log cannot tell.
    pub unidentifiable: Vec<String>,
    /// How far least squares would still move a told parameter, in its standard errors, at most; nought at a minimum.
    pub step_in_standard_errors: Option<f64>,
    /// Whether the errors that remain look like noise, for which standard errors take them.
    pub errors_look_like_noise: bool,
    /// Hops from the polished minimum that were tried, and that led further down.
    pub hops: [usize; 2],
    /// Singular values of the scaled Jacobian, greatest first.
    pub singular_values: Vec<f64>,
    /// Standard deviation of the errors that remain, in the channel's unit.
    pub noise_estimate: BTreeMap<&'static str, f64>,
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

fn by_channel(values: [f64; CHANNELS]) -> BTreeMap<&'static str, f64> {
    CHANNEL_NAMES.into_iter().zip(values).collect()
}

/// The candidate to hand out: fitted values, but the starting car's where the log cannot tell.
fn told_candidate(setup: &Setup, outcome: &Outcome) -> Vec<f64> {
    let base = setup.replay.free.base();
    outcome
        .candidate
        .iter()
        .enumerate()
        .map(|(k, x)| {
            if outcome.identifiability.identifiable[k] {
                *x
            } else {
                base[setup.replay.free.parameters[k].slots[0]]
            }
        })
        .collect()
}

/// Works the figures out.
pub fn summarise(settings: &IdentifySettings, setup: &Setup, outcome: &Outcome) -> Summary {
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
    let rate = outcome.evaluations as f64 / outcome.swarm_s.max(1e-9);
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
        study: "identify",
        seed: settings.seed,
        backend: outcome.backend.backend,
        adapter: outcome.backend.device.clone(),
        driver: outcome.backend.driver.clone(),
        elapsed_s: outcome.swarm_s + outcome.polish_s,
        swarm_elapsed_s: outcome.swarm_s,
        interrupted: outcome.interrupted,
        evaluations: outcome.evaluations,
        failures: outcome.failures.clone(),
        device_faults: outcome.device_faults.clone(),
        evaluations_per_s: rate,
        particle_steps_per_s: rate * steps as f64,
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

/// Writes all files of a run into `folder`.
///
/// # Errors
/// [`crate::Error::Io`] if one cannot be written.
pub fn write_results(
    folder: &Path,
    settings: &IdentifySettings,
    setup: &Setup,
    outcome: &Outcome,
    summary: &Summary,
) -> Result<()> {
    let replay = &setup.replay;
    write_json(&folder.join("summary.json"), summary)?;
    write_settings(folder, settings)?;
    let manifest = Manifest {
        log: Some(&setup.log.source),
        interrupted: outcome.interrupted,
        device_faults: &outcome.device_faults,
        longest_dispatch_ms: outcome.longest_dispatch_ms,
        ..Manifest::new("identify", settings.seed, &outcome.backend, &replay.free.car.name)
    };
    replay
        .free
        .candidate_car(&told_candidate(setup, outcome))
        .write(folder, "car")?;
    write_history(folder, outcome)?;
    write_parameters(folder, summary)?;
    if let Some(front) = &outcome.front {
        write_front(folder, setup, front)?;
    }
    let judged = judge_candidate(replay, &outcome.candidate);
    write_traces(folder, setup, &judged, summary)?;
    super::page::write(folder, settings, setup, outcome, &judged, summary)?;
    // Last: it says that the run is whole.
    write_json(&folder.join("manifest.json"), &manifest)
}

fn write_history(folder: &Path, outcome: &Outcome) -> Result<()> {
    let rows = &outcome.history;
    let of = |f: &dyn Fn(&super::HistoryRow) -> f64| rows.iter().map(f).collect::<Vec<f64>>();
    let iteration = of(&|r| r.iteration as f64);
    let evaluations = of(&|r| r.evaluations as f64);
    let median = of(&|r| r.median.unwrap_or(f64::NAN));
    let failed = of(&|r| r.failed as f64);
    let elapsed = of(&|r| r.elapsed_s);
    let width = rows.first().map_or(0, |r| r.best.len());
    let best: Vec<Vec<f64>> = (0..width).map(|k| of(&|r| r.best[k])).collect();
    let names: Vec<String> = (0..width)
        .map(|k| {
            if width == 1 {
                "best".into()
            } else {
                format!("best_{k}")
            }
        })
        .collect();
    let number = |name, unit, values| Column {
        name,
        unit,
        cells: Cells::Numbers(values),
    };
    let mut columns = vec![
        number("iteration", "", &iteration),
        number("evaluations", "", &evaluations),
    ];
    columns.extend(
        names
            .iter()
            .zip(&best)
            .map(|(name, values)| number(name.as_str(), "", values)),
    );
    columns.extend([
        number("median", "", &median),
        number("failed", "", &failed),
        number("elapsed", "s", &elapsed),
    ]);
    write_csv(folder.join("convergence.csv"), &columns)?;
    if width == 1 {
        plot_convergence(
            folder.join("convergence.svg"),
            "Convergence",
            "cost relative to the channels' spread (-)",
            &[ConvergenceRun {
                label: "swarm",
                evaluations: &evaluations,
                best: &best[0],
                median: Some(&median),
            }],
        )?;
    }
    Ok(())
}

fn write_parameters(folder: &Path, summary: &Summary) -> Result<()> {
    let p = &summary.parameters;
    let texts = |f: &dyn Fn(&ParameterSummary) -> String| p.iter().map(f).collect::<Vec<String>>();
    let numbers = |f: &dyn Fn(&ParameterSummary) -> f64| p.iter().map(f).collect::<Vec<f64>>();
    let (names, units) = (texts(&|p| p.name.clone()), texts(&|p| p.unit.clone()));
    let figures: [(&str, Vec<f64>); 7] = [
        ("lower", numbers(&|p| p.bounds[0])),
        ("upper", numbers(&|p| p.bounds[1])),
        ("swarm_value", numbers(&|p| p.swarm_value)),
        ("value", numbers(&|p| p.value.unwrap_or(f64::NAN))),
        (
            "standard_error",
            numbers(&|p| p.standard_error.unwrap_or(f64::NAN)),
        ),
        ("truth", numbers(&|p| p.truth.unwrap_or(f64::NAN))),
        ("at_bound", numbers(&|p| f64::from(u8::from(p.at_bound)))),
    ];
    let mut columns = vec![
        Column {
            name: "parameter",
            unit: "",
            cells: Cells::Texts(&names),
        },
        Column {
            name: "unit",
            unit: "",
            cells: Cells::Texts(&units),
        },
    ];
    columns.extend(figures.iter().map(|(name, values)| Column {
        name,
        unit: "",
        cells: Cells::Numbers(values),
    }));
    write_csv(folder.join("parameters.csv"), &columns)?;
    plot_parameters(
        folder.join("parameters.svg"),
        "Parameters within their bounds",
        &parameter_rows(summary),
    )
}

/// The parameters as figures show them.
pub(super) fn parameter_rows(summary: &Summary) -> Vec<ParameterRow<'_>> {
    summary
        .parameters
        .iter()
        .map(|p| ParameterRow {
            name: &p.name,
            unit: if p.unit == "-" { "" } else { &p.unit },
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

fn write_front(folder: &Path, setup: &Setup, front: &super::Front) -> Result<()> {
    let problem = &setup.replay.problem;
    let columns_of = |rows: &[Vec<f64>], width: usize| -> Vec<Vec<f64>> {
        (0..width)
            .map(|k| rows.iter().map(|row| row[k]).collect())
            .collect()
    };
    let objectives = columns_of(&front.objectives, problem.objectives.len());
    let variables = columns_of(&front.candidates, problem.variables.len());
    let column = |name, unit, values| Column {
        name,
        unit,
        cells: Cells::Numbers(values),
    };
    let fun: Vec<_> = problem
        .objectives
        .iter()
        .zip(&objectives)
        .map(|(o, c)| column(o.name.as_str(), o.unit.as_str(), c))
        .collect();
    let var: Vec<_> = problem
        .variables
        .iter()
        .zip(&variables)
        .map(|(v, c)| column(v.name.as_str(), v.unit.as_str(), c))
        .collect();
    write_csv(folder.join("FUN.csv"), &fun)?;
    write_csv(folder.join("VAR.csv"), &var)?;
    let named: Vec<Objective<'_>> = problem
        .objectives
        .iter()
        .map(|o| Objective {
            name: &o.name,
            unit: &o.unit,
        })
        .collect();
    plot_pareto(
        folder.join("pareto.svg"),
        "Pareto front",
        &named,
        &front.objectives,
        Some(front.chosen),
    )
}

/// Labels of the channels in pictures.
pub(super) const LABELS: [&str; CHANNELS] = [
    "speed",
    "longitudinal acceleration",
    "lateral acceleration",
    "yaw rate",
];

/// One lap, the first that has a fitted sample: laps over one another would not be legible.
pub(super) fn traced_lap(log: &crate::telemetry::Log, judged: &Judged) -> std::ops::Range<usize> {
    let fitted = |i: usize| judged.outputs[0][i].is_finite();
    let mut laps = log.laps.iter().map(|l| l.start..l.end);
    laps.find(|r| r.clone().any(fitted)).unwrap_or(0..log.samples())
}

fn write_traces(folder: &Path, setup: &Setup, judged: &Judged, summary: &Summary) -> Result<()> {
    let log = &setup.log;
    let measured = [&log.vx_mps, &log.ax_mps2, &log.ay_mps2, &log.yaw_rate_radps];
    let range = traced_lap(log, judged);
    let distance = &log.distance_m[range.clone()];
    let mut columns = vec![
        Column {
            name: "time",
            unit: "s",
            cells: Cells::Numbers(&log.time_s),
        },
        Column {
            name: "distance",
            unit: "m",
            cells: Cells::Numbers(&log.distance_m),
        },
    ];
    let names: Vec<[String; 2]> = CHANNEL_NAMES
        .iter()
        .map(|n| [format!("{n}_measured"), format!("{n}_fitted")])
        .collect();
    for k in 0..CHANNELS {
        columns.push(Column {
            name: &names[k][0],
            unit: CHANNEL_UNITS[k],
            cells: Cells::Numbers(measured[k]),
        });
        columns.push(Column {
            name: &names[k][1],
            unit: CHANNEL_UNITS[k],
            cells: Cells::Numbers(&judged.outputs[k]),
        });
    }
    write_csv(folder.join("traces.csv"), &columns)?;
    let sections = setup.circuit.as_ref().map_or(Vec::new(), |circuit| {
        circuit
            .sections
            .iter()
            .map(|s| ShadedSection {
                name: &s.name,
                start: s.start_m,
                end: s.end_m,
            })
            .collect()
    });
    // The file's name alone: a long path would run into the legend.
    let source = Path::new(&log.source)
        .file_name()
        .map_or_else(|| log.source.clone().into(), |n| n.to_string_lossy());
    let title = format!(
        "{source}, fitted in {:.0} s on {}",
        summary.elapsed_s, summary.backend
    );
    plot_traces(
        folder.join("traces.svg"),
        &TraceFigure {
            title: &title,
            x_label: "distance (m)",
            x: distance,
            panels: (0..CHANNELS)
                .map(|k| TracePanel {
                    label: LABELS[k],
                    unit: CHANNEL_UNITS[k],
                    measured: &measured[k][range.clone()],
                    fitted: &judged.outputs[k][range.clone()],
                })
                .collect(),
            sections,
        },
    )?;
    if let Some(circuit) = &setup.circuit {
        let line: Vec<_> = distance.iter().map(|s| circuit.position_at(*s)).collect();
        plot_track_map(
            folder.join("map.svg"),
            &TrackMap {
                title: &circuit.name,
                left_edge_m: &circuit.left_edge(),
                right_edge_m: &circuit.right_edge(),
                line_m: &line,
                values: &log.vx_mps[range],
                value_label: "speed",
                value_unit: "m/s",
                closed: circuit.closed,
                names: circuit
                    .sections
                    .iter()
                    .map(|s| (s.name.as_str(), circuit.position_at(0.5 * (s.start_m + s.end_m))))
                    .collect(),
            },
        )?;
    }
    Ok(())
}

/// Least squares may still move a parameter by this many of its standard errors at what counts as a minimum.
const AT_MINIMUM: f64 = 1.0;

impl Summary {
    /// Why the standard errors, and the verdict on what the log tells, are not to be taken at their word; nothing where they are.
    pub fn caution(&self) -> Option<String> {
        match self.step_in_standard_errors {
            Some(step) if step <= AT_MINIMUM => (!self.errors_look_like_noise).then(|| {
                "The errors that remain do not look like noise: the model lacks something that this car did, and the standard \
                 errors, which take them for noise, are too small."
                    .to_owned()
            }),
            step => Some(format!(
                "This car is at no minimum of the errors{}: standard errors, and what the log tells, hold near one only.",
                step.map_or(String::new(), |s| format!(
                    " (least squares would move a parameter by {s:.0} of its standard errors)"
                ))
            )),
        }
    }

    /// The parameter table and the errors, for a terminal.
    pub fn to_text(&self, settings: &IdentifySettings) -> String {
        let mut text = format!(
            "{:<28}{:>14}{:>14}{:>14}\n",
            "parameter", "fitted", "std. error", "truth"
        );
        let shown = |x: Option<f64>, none: &str| x.map_or(none.to_owned(), |x| format!("{x:.6}"));
        for p in &self.parameters {
            text.push_str(&format!(
                "{:<28}{:>14}{:>14}{:>14}{}\n",
                format!("{} ({})", p.name, p.unit),
                shown(p.value, "not told"),
                p.standard_error.map_or("-".to_owned(), |e| format!("{e:.2e}")),
                shown(p.truth, "-"),
                if p.at_bound { "   at its bound" } else { "" },
            ));
        }
        text.push_str(&format!(
            "\n{:<28}{:>14}{:>14}{:>14}{:>14}\n",
            "channel", "cost", "rms error", "rms signal", "held out"
        ));
        for (k, name) in CHANNEL_NAMES.iter().enumerate() {
            text.push_str(&format!(
                "{:<28}{:>14.3e}{:>14.3e}{:>14.3e}{:>14}   cost in {}\n",
                format!("{name} ({})", CHANNEL_UNITS[k]),
                self.costs[name],
                self.rms_error[name],
                self.rms_signal[name],
                self.holdout_rms_error
                    .as_ref()
                    .map_or("-".to_owned(), |h| format!("{:.3e}", h[name])),
                cost_unit(settings.norm, CHANNEL_UNITS[k]),
            ));
        }
        if self.unidentifiable.is_empty() {
            text.push_str("\nThe log tells all parameters.\n");
        } else {
            text.push_str(&format!(
                "\nThe log cannot tell: {}. The starting car's values stand in their place.\n",
                self.unidentifiable.join(", ")
            ));
        }
        if let Some(caution) = self.caution() {
            text.push_str(&caution);
            text.push('\n');
        }
        if let [tried @ (1..), gained] = self.hops {
            text.push_str(&format!(
                "What was left over did not look like noise: {tried} hops to other minima, {gained} of which led further down.\n"
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
            self.evaluations,
            self.swarm_elapsed_s,
            self.backend,
            self.adapter,
            self.evaluations_per_s,
            self.particle_steps_per_s / 1e6,
            self.elapsed_s
        ));
        if !self.failures.is_empty() {
            let told = failures_in_words(&self.failures);
            text.push_str(&format!("Candidates that failed: {told}.\n"));
        }
        for fault in &self.device_faults {
            text.push_str(&format!("Note: {fault}\n"));
        }
        text
    }
}
