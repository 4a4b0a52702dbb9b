//! The interactive report of an identification.

use super::results::{LABELS, Summary, parameter_rows, traced_lap};
use super::search::{Judged, Outcome};
use super::settings::IdentifySettings;
use super::setup::{CHANNELS, Setup};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::evaluate::replay::{CHANNEL_NAMES, CHANNEL_UNITS};
use crate::report::{
    Cells, Column, Curve, CurvePanel, Front, HtmlReport, LapLine, LapPanel, LapTrace, LapView, Objective,
    Scale, significant,
};
use crate::study::circuit_view;
use std::path::Path;

pub(super) fn write(
    folder: &Path,
    settings: &IdentifySettings,
    setup: &Setup,
    outcome: &Outcome,
    judged: &Judged,
    summary: &Summary,
) -> Result<()> {
    let source = Path::new(&setup.log.source)
        .file_name()
        .map_or_else(|| setup.log.source.clone(), |n| n.to_string_lossy().into_owned());
    let car = &setup.replay.free.car.name;
    let mut page = HtmlReport::new("identify", &format!("{car} identified from {source}"));
    head(&mut page, car, &source, outcome, summary);
    page.section("Lap", "What was measured, and what the fitted car does when it is driven by the same steering and wheel speeds.");
    let edges = setup.circuit.as_ref().map(circuit_view::edges);
    let mut view = lap(setup, judged);
    let circuit = setup.circuit.as_ref().zip(edges.as_ref());
    view.map = circuit.map(|(c, edges)| circuit_view::map(c, edges));
    page.lap(&view)?;
    channels(&mut page, summary)?;
    parameters(&mut page, summary)?;
    if let Some(front) = &outcome.front {
        let objectives = &setup.replay.problem.objectives;
        page.section(
            "Compromises",
            "Each candidate is the best known for some weighting of the channels.",
        );
        page.front(&Front {
            title: "Pareto front of the channels' costs",
            objectives: objectives
                .iter()
                .map(|o| Objective {
                    name: &o.name,
                    unit: &o.unit,
                })
                .collect(),
            points: &front.objectives,
            marked: vec![(front.chosen, "chosen")],
            ..Front::default()
        })?;
    }
    convergence(&mut page, outcome)?;
    let calibration = &summary.calibration;
    if !(calibration.findings.is_empty() && calibration.notes.is_empty()) {
        page.section(
            "Telemetry",
            "What the log says of its own channels, and what was corrected.",
        );
        for finding in &calibration.findings {
            page.paragraph(&finding.to_string());
        }
        for note in &calibration.notes {
            page.paragraph(note);
        }
    }
    page.provenance("log", &setup.log.source);
    page.provenance("starting car", car);
    page.provenance("seed", summary.seed.to_string());
    page.provenance("backend", summary.backend);
    page.provenance("adapter", &summary.adapter);
    page.provenance("driver", &summary.driver);
    page.provenance("candidates evaluated", summary.evaluations.to_string());
    page.provenance("candidates that failed", failures_in_words(&summary.failures));
    page.provenance(
        "candidates per second",
        format!("{:.0}", summary.evaluations_per_s),
    );
    page.provenance(
        "Runge-Kutta steps per second",
        format!("{:.2} million", summary.particle_steps_per_s / 1e6),
    );
    page.provenance("swarm", format!("{:.1} s", summary.swarm_elapsed_s));
    page.provenance("swarm and polish", format!("{:.1} s", summary.elapsed_s));
    page.settings("study.toml, which repeats this run", settings.to_toml());
    page.write(folder.join("report.html"))
}

fn head(page: &mut HtmlReport, car: &str, source: &str, outcome: &Outcome, summary: &Summary) {
    let count = summary.parameters.len();
    let told = count - summary.unidentifiable.len();
    let share = |name: &str| 100.0 * summary.rms_error[name] / summary.rms_signal[name];
    let parts: Vec<String> = (0..CHANNELS)
        .map(|k| {
            let name = CHANNEL_NAMES[k];
            format!(
                "{} to {} {}",
                LABELS[k],
                significant(summary.rms_error[name], 3),
                CHANNEL_UNITS[k].replace("^2", "\u{b2}")
            )
        })
        .collect();
    page.sentence(format!(
        "{count} unknowns of the {car} were fitted to {source} in {:.0} s on {} ({}). Driven by the logged steering and \
         wheel speeds, the fitted car follows the log's {} (root mean square).",
        summary.elapsed_s,
        summary.backend,
        summary.adapter,
        parts.join(", ")
    ));
    page.sentence(if summary.unidentifiable.is_empty() {
        format!("The log tells all {count} parameters.")
    } else {
        format!(
            "The log tells {told} of {count} parameters; it cannot tell {}, where the starting car's values stand.",
            summary.unidentifiable.join(", ")
        )
    });
    if let Some(caution) = summary.caution() {
        page.sentence(caution);
    }
    let bounds: Vec<&str> = summary
        .parameters
        .iter()
        .filter(|p| p.at_bound)
        .map(|p| p.name.as_str())
        .collect();
    if !bounds.is_empty() {
        page.sentence(format!(
            "At their bounds: {}. The log would have them elsewhere, or they stand in for something that the model lacks.",
            bounds.join(", ")
        ));
    }
    if let [tried @ (1..), gained] = summary.hops {
        page.sentence(format!(
            "What the polish left over did not look like noise, so that it was tried from {tried} places more: {gained} led \
             further down."
        ));
    }
    if let Some(error) = summary.total_parameter_error {
        page.sentence(format!(
            "The car that drove the log is known: the told parameters are off by {} in all, as a sum of shares \
             of their values; the swarm alone, before the least-squares polish, ended at {}.",
            significant(error, 3),
            significant(summary.swarm_total_parameter_error.unwrap_or(f64::NAN), 3)
        ));
        page.tile("Total parameter error", significant(error, 3), "");
    }
    page.tile("Parameters told", format!("{told} of {count}"), "");
    for (k, label) in LABELS.iter().enumerate() {
        page.tile(
            &format!("Error of {label}"),
            significant(share(CHANNEL_NAMES[k]), 2),
            "% of signal, rms",
        );
    }
    page.tile("Time", format!("{:.0}", summary.elapsed_s), "s");
    if let (Some(held), Some(signal)) = (&summary.holdout_rms_error, &summary.holdout_rms_signal) {
        let [lost, windows] = summary.holdout_lost_windows.unwrap_or([0, 0]);
        let parts: Vec<String> = (0..CHANNELS)
            .map(|k| {
                let name = CHANNEL_NAMES[k];
                format!(
                    "{} {} of {} {}",
                    LABELS[k],
                    significant(held[name], 3),
                    significant(signal[name], 3),
                    CHANNEL_UNITS[k].replace("^2", "\u{b2}")
                )
            })
            .collect();
        page.sentence(format!(
            "On laps that the fit never saw (rms error of rms signal): {}; the car was lost in {lost} of {windows} \
             windows.",
            parts.join(", ")
        ));
    }
    if outcome.interrupted {
        page.warning("The run was interrupted; this is what it had reached.");
    }
}

fn lap<'a>(setup: &'a Setup, judged: &Judged) -> LapView<'a> {
    let log = &setup.log;
    let measured = [&log.vx_mps, &log.ax_mps2, &log.ay_mps2, &log.yaw_rate_radps];
    let range = traced_lap(log, judged);
    let distance_m = &log.distance_m[range.clone()];
    let place_m: Vec<_> = setup
        .circuit
        .iter()
        .flat_map(|circuit| distance_m.iter().map(|s| circuit.position_at(*s)))
        .collect();
    let line = |name, values: &dyn Fn(usize, usize) -> f64, first: usize, placed: bool| LapLine {
        name,
        wide: placed,
        x: distance_m.to_vec(),
        traces: (0..CHANNELS)
            .map(|k| LapTrace {
                panel: 2 * k + first,
                values: range.clone().map(|i| values(k, i)).collect(),
                band: None,
            })
            .collect(),
        place_m: if placed { place_m.clone() } else { Vec::new() },
    };
    let panel = |k: usize| {
        [(LABELS[k], 1.0), ("error", 0.5)].map(|(label, height)| LapPanel {
            label,
            unit: CHANNEL_UNITS[k],
            height,
        })
    };
    LapView {
        title: "Measured and fitted",
        note: "Error is fitted less measured. Gaps are samples that no window scores.",
        x_label: "distance",
        x_unit: "m",
        panels: (0..CHANNELS).flat_map(panel).collect(),
        lines: vec![
            line("measured", &|k, i| measured[k][i], 0, true),
            line("fitted", &|k, i| judged.outputs[k][i], 0, false),
            line("error", &|k, i| judged.outputs[k][i] - measured[k][i], 1, false),
        ],
        sections: setup.circuit.as_ref().map_or(Vec::new(), circuit_view::sections),
        map: None,
    }
}

fn channels(page: &mut HtmlReport, summary: &Summary) -> Result<()> {
    let texts = |words: [&str; CHANNELS]| words.map(str::to_owned);
    let (names, units) = (texts(LABELS), texts(CHANNEL_UNITS));
    let of = |values: &std::collections::BTreeMap<&'static str, f64>| CHANNEL_NAMES.map(|name| values[name]);
    let (signal, error, noise) = (
        of(&summary.rms_signal),
        of(&summary.rms_error),
        of(&summary.noise_estimate),
    );
    let held = summary.holdout_rms_error.as_ref().map(of);
    let text = |name, cells| Column {
        name,
        unit: "",
        cells: Cells::Texts(cells),
    };
    let number = |name, cells| Column {
        name,
        unit: "channel's unit",
        cells: Cells::Numbers(cells),
    };
    let mut columns = vec![
        text("channel", &names),
        text("unit", &units),
        number("rms signal", &signal),
        number("rms error", &error),
        number("noise estimate", &noise),
    ];
    if let Some(held) = &held {
        columns.push(number("rms error, held out", held));
    }
    page.table("Channels", "", &columns)
}

fn parameters(page: &mut HtmlReport, summary: &Summary) -> Result<()> {
    page.section("Parameters", "");
    page.parameters(
        "Parameters within their bounds",
        "Grey: the log does not tell it. Whiskers are one standard error, where it is wide enough to be seen.",
        &parameter_rows(summary),
    );
    let p = &summary.parameters;
    let names: Vec<String> = p.iter().map(|p| p.name.clone()).collect();
    let units: Vec<String> = p.iter().map(|p| p.unit.clone()).collect();
    let gap = |x: Option<f64>| x.unwrap_or(f64::NAN);
    let value: Vec<f64> = p.iter().map(|p| gap(p.value)).collect();
    let error: Vec<f64> = p.iter().map(|p| gap(p.standard_error)).collect();
    let truth: Vec<f64> = p.iter().map(|p| gap(p.truth)).collect();
    let off: Vec<f64> = value
        .iter()
        .zip(&truth)
        .map(|(v, t)| 100.0 * (v / t - 1.0))
        .collect();
    let swarm: Vec<f64> = p.iter().map(|p| p.swarm_value).collect();
    let lower: Vec<f64> = p.iter().map(|p| p.bounds[0]).collect();
    let upper: Vec<f64> = p.iter().map(|p| p.bounds[1]).collect();
    let text = |name, cells| Column {
        name,
        unit: "",
        cells: Cells::Texts(cells),
    };
    let number = |name, unit, cells| Column {
        name,
        unit,
        cells: Cells::Numbers(cells),
    };
    let mut columns = vec![
        text("parameter", &names),
        text("unit", &units),
        number("fitted", "", &value),
        number("standard error", "", &error),
        number("swarm", "", &swarm),
        number("lower bound", "", &lower),
        number("upper bound", "", &upper),
    ];
    if p.iter().any(|p| p.truth.is_some()) {
        columns.insert(4, number("truth", "", &truth));
        columns.insert(5, number("off by", "%", &off));
    }
    page.table("Parameters", "Each row in the unit of its parameter.", &columns)
}

fn convergence(page: &mut HtmlReport, outcome: &Outcome) -> Result<()> {
    let rows = &outcome.history;
    let width = rows.first().map_or(0, |r| r.best.len());
    if width == 0 {
        return Ok(());
    }
    let curve = |label, of: &dyn Fn(&super::HistoryRow) -> f64| Curve {
        label,
        x: rows.iter().map(|r| r.evaluations as f64).collect(),
        y: rows.iter().map(of).collect(),
        shade: None,
    };
    let labels: Vec<String> = (0..width)
        .map(|k| {
            if width == 1 {
                "best".to_owned()
            } else {
                format!("best of objective {k}")
            }
        })
        .collect();
    let mut curves: Vec<Curve<'_>> = (0..width).map(|k| curve(&labels[k], &|r| r.best[k])).collect();
    if rows.iter().any(|r| r.median.is_some()) {
        curves.push(curve("median of the swarm", &|r| r.median.unwrap_or(f64::NAN)));
    }
    page.section("Convergence", "");
    page.curves(
        &CurvePanel {
            title: "Cost of the swarm's best",
            x_label: "candidates evaluated",
            y_label: "cost, channels' errors over their spread",
            curves,
        },
        "",
        [Scale::Linear, Scale::Log],
    )
}
