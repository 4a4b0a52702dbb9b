//! The interactive report of an identification, with its figures.

use super::Identify;
use super::results::{Summary, Tyres, parameter_rows, traced_lap};
use super::search::{Judged, Outcome};
use super::settings::IdentifySettings;
use super::setup::{CHANNELS, Setup, cost_unit};
use super::verdict::Verdict;
use crate::config::settings::Settings;
use crate::error::Result;
use crate::evaluate::replay::{CHANNEL_LABELS, CHANNEL_NAMES, CHANNEL_UNITS};
use crate::report::{
    CornerLap, Curves, Figure, Front, HtmlReport, LapLine, LapView, Panel, Parameters, Scale, Table,
    significant,
};
use crate::study::framework::{Solved, tyre_view};
use std::path::Path;

pub(super) fn write(
    folder: &Path,
    solved: &Solved<'_, Identify>,
    (judged, tyres): (&Judged, &Tyres),
    summary: &Summary,
) -> Result<()> {
    let (setup, outcome) = (solved.prepared, solved.outcome);
    // The file's name alone: a long path would run out of the figures.
    let source = Path::new(&setup.log.source)
        .file_name()
        .map_or_else(|| setup.log.source.clone(), |n| n.to_string_lossy().into_owned());
    let car = &setup.replay.free.car.name;
    let mut page = HtmlReport::new("identify", &format!("{car} identified from {source}"));
    head(&mut page, car, &source, outcome, summary);
    page.section(
        "Lap",
        "The measured lap, and the lap of the fitted car driven by the same steering and wheel speeds.",
    );
    let title = format!(
        "{source}, fitted in {:.0} s on {}",
        summary.record.elapsed_s, summary.record.backend
    );
    let view = lap(setup, judged, title);
    page.figure(folder.join("traces.svg"), &view)?;
    if let Some(map) = setup.circuit.as_ref().and_then(|c| view.track_map(&*c.name)) {
        map.write_svg(folder.join("map.svg"))?;
    }
    corners(&mut page, setup, judged)?;
    page.table("Channels", "", &channels(solved.settings, summary))?;
    page.section("Tyres", "What the tyres of the fitted car do on this lap.");
    let distance_m = &setup.log.distance_m[tyres.lap.clone()];
    page.place(&tyre_view(distance_m, &tyres.moments))?;
    page.section("Parameters", "");
    let figure = Parameters {
        title: "Parameters within their bounds".to_owned(),
        note: "Grey: not identifiable from this log. Whiskers are one standard error, where it is wide enough to be seen."
            .to_owned(),
        rows: parameter_rows(summary),
    };
    page.figure(folder.join("parameters.svg"), &figure)?;
    page.table(
        "Parameters",
        "Each row in the unit of its parameter.",
        &parameters(summary),
    )?;
    if let Some(found) = &outcome.front {
        page.section(
            "Compromises",
            "Each candidate is the best known for some weighting of the channels.",
        );
        let objectives = setup.replay.problem.objectives.iter();
        let front = Front::new("Pareto front of the channels' costs", &found.objectives);
        let front = objectives.fold(front, |front, o| front.objective(&*o.name, &*o.unit));
        page.figure(folder.join("pareto.svg"), &front.mark(found.chosen, "chosen"))?;
    }
    convergence(&mut page, folder, outcome)?;
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
    page.facts(&[
        ("log", &setup.log.source),
        ("starting car", car),
        ("seed", &summary.seed),
    ]);
    summary.record.provenance(&mut page, "candidates evaluated");
    page.facts(&[
        (
            "Runge-Kutta steps per second",
            &format!("{:.2} million", summary.particle_steps_per_s / 1e6),
        ),
        ("swarm", &format!("{:.1} s", summary.swarm_elapsed_s)),
    ]);
    page.settings("study.toml, which repeats this run", solved.settings.to_toml());
    page.write(folder.join("report.html"))
}

fn head(page: &mut HtmlReport, car: &str, source: &str, outcome: &Outcome, summary: &Summary) {
    let count = summary.parameters.len();
    let sound = summary
        .parameters
        .iter()
        .filter(|p| p.value.is_some() && !p.at_bound);
    let sound = match summary.verdict {
        Verdict::NotAtMinimum => "not known".to_owned(),
        _ => format!("{} of {count}", sound.count()),
    };
    let share = |name: &str| 100.0 * summary.rms_error[name] / summary.rms_signal[name];
    page.sentence(format!(
        "{count} unknowns of the {car} were fitted to {source} in {:.0} s on {} ({}). Driven by the logged steering and \
         wheel speeds, the fitted car follows the log's {} (root mean square).",
        summary.record.elapsed_s,
        summary.record.backend,
        summary.record.adapter,
        by_channel(|name| format!("to {}", significant(summary.rms_error[name], 3)))
    ));
    page.sentence(summary.verdict_text.clone());
    for note in &summary.notes {
        page.sentence(note.clone());
    }
    if let [tried @ (1..), gained] = summary.hops {
        page.sentence(format!(
            "The residuals after the polish did not look like noise. It was repeated from {tried} other places, {gained} of which \
             led to a lower cost."
        ));
    }
    if let Some(error) = summary.total_parameter_error {
        page.sentence(format!(
            "The car that drove the log is known. The total relative error of the identifiable parameters is {}; that of the \
             swarm alone, before the least-squares polish, was {}.",
            significant(error, 3),
            significant(summary.swarm_total_parameter_error.unwrap_or(f64::NAN), 3)
        ));
        page.tile("Total parameter error", significant(error, 3), "");
    }
    page.tile("Parameters told", sound, "");
    for (k, label) in CHANNEL_LABELS.iter().enumerate() {
        page.tile(
            &format!("Error of {label}"),
            significant(share(CHANNEL_NAMES[k]), 2),
            "% of signal, rms",
        );
    }
    page.tile("Time", format!("{:.0}", summary.record.elapsed_s), "s");
    if let (Some(held), Some(signal)) = (&summary.holdout_rms_error, &summary.holdout_rms_signal) {
        let [lost, windows] = summary.holdout_lost_windows.unwrap_or([0, 0]);
        let parts = by_channel(|name| {
            format!(
                "{} of {}",
                significant(held[name], 3),
                significant(signal[name], 3)
            )
        });
        page.sentence(format!(
            "On laps held out of the fit (rms error of rms signal): {parts}; the car was lost in {lost} of {windows} windows."
        ));
    }
    page.warnings(&[], outcome.record.interrupted);
}

/// `part [unit]` of each channel in words.
fn by_channel(of: impl Fn(&str) -> String) -> String {
    let unit = |k: usize| CHANNEL_UNITS[k].replace("^2", "\u{b2}");
    let part = |k: usize| format!("{} {} {}", CHANNEL_LABELS[k], of(CHANNEL_NAMES[k]), unit(k));
    (0..CHANNELS).map(part).collect::<Vec<_>>().join(", ")
}

/// One lap as it was measured and as the fitted car drives it.
fn lap(setup: &Setup, judged: &Judged, title: String) -> LapView {
    let log = &setup.log;
    let measured = [&log.vx_mps, &log.ax_mps2, &log.ay_mps2, &log.yaw_rate_radps];
    let range = traced_lap(log, judged);
    let distance_m = &log.distance_m[range.clone()];
    let circuit = setup.circuit.as_ref();
    let places = circuit
        .iter()
        .flat_map(|c| distance_m.iter().map(|s| c.position_at(*s)));
    let line = |name: &str| LapLine::new(name, distance_m);
    let (mut logged, mut fitted, mut error) = (line("measured"), line("fitted"), line("error"));
    let mut view = LapView::new(title);
    for k in 0..CHANNELS {
        let (own, model) = (&measured[k][range.clone()], &judged.outputs[k][range.clone()]);
        let errors: Vec<f64> = model.iter().zip(own).map(|(f, m)| f - m).collect();
        view = view
            .panel(CHANNEL_LABELS[k], CHANNEL_UNITS[k])
            .low_panel("error", CHANNEL_UNITS[k])
            .panel_note(rms_text(&errors, CHANNEL_UNITS[k]));
        logged = logged.trace(2 * k, own);
        fitted = fitted.trace(2 * k, model);
        error = error.trace(2 * k + 1, errors);
    }
    view.note("Error is fitted minus measured. Gaps are samples that no window scores.")
        .line(logged.wide().at(places.collect::<Vec<_>>()))
        .line(fitted)
        .line(error)
        .circuit(circuit)
}

/// The measured lap by corner and sector, and the fitted car's against it.
fn corners(page: &mut HtmlReport, setup: &Setup, judged: &Judged) -> Result<()> {
    let log = &setup.log;
    let range = traced_lap(log, judged);
    let station = &log.distance_m[range.clone()];
    let lap = |name, v: &[f64], ay: &[f64]| {
        CornerLap::new(name, station, &v[range.clone()], &ay[range.clone()], 1.0)
    };
    let measured = lap("measured", &log.vx_mps, &log.ay_mps2);
    // The fitted car is driven where windows are, and a time is told of a whole lap only.
    let whole = range.clone().all(|i| judged.outputs[0][i].is_finite());
    let fitted = lap("fitted", &judged.outputs[0], &judged.outputs[2]).filter(|_| whole);
    let sections = setup.circuit.iter().flat_map(|c| &c.sections);
    let sections: Vec<_> = sections.map(|s| (s.name.clone(), s.start_m, s.end_m)).collect();
    page.corners(&measured.into_iter().chain(fitted).collect::<Vec<_>>(), &sections)
}

fn rms_text(errors: &[f64], unit: &str) -> String {
    let finite = || errors.iter().filter(|e| e.is_finite());
    let count = finite().count();
    if count == 0 {
        return "no common samples".to_owned();
    }
    let rms = (finite().map(|e| e * e).sum::<f64>() / count as f64).sqrt();
    format!("rms error {} {unit}", significant(rms, 3))
}

/// Errors of the channels, in the channels' units.
pub(super) fn channels(settings: &IdentifySettings, summary: &Summary) -> Table<'static> {
    let held = |name| summary.holdout_rms_error.as_ref().map(|h| h[name]);
    let table = Table::rows(0..CHANNELS)
        .text("channel", |k| CHANNEL_LABELS[*k])
        .text("unit", |k| CHANNEL_UNITS[*k])
        .number("rms signal", "", |k| summary.rms_signal[CHANNEL_NAMES[*k]])
        .number("rms error", "", |k| summary.rms_error[CHANNEL_NAMES[*k]])
        .number("noise estimate", "", |k| {
            summary.noise_estimate[CHANNEL_NAMES[*k]]
        })
        .number("rms error, held out", "", |k| held(CHANNEL_NAMES[*k]))
        .number("cost", "", |k| summary.costs[CHANNEL_NAMES[*k]])
        .text("cost in", |k| cost_unit(settings.norm, CHANNEL_UNITS[*k]));
    table.table().without_empty()
}

/// The parameters, each in its unit.
pub(super) fn parameters(summary: &Summary) -> Table<'static> {
    Table::rows(&summary.parameters)
        .text("parameter", |p| &*p.name)
        .text("unit", |p| &*p.unit)
        .number("fitted", "", |p| p.car_value)
        .number("standard error", "", |p| p.standard_error)
        .number("truth", "", |p| p.truth)
        .number("off by", "%", |p| Some(100.0 * (p.value? / p.truth? - 1.0)))
        .number("swarm", "", |p| p.swarm_value)
        .number("lower bound", "", |p| p.bounds[0])
        .number("upper bound", "", |p| p.bounds[1])
        .text("at a bound", |p| if p.at_bound { "yes" } else { "" })
        .text("told", |p| if p.value.is_some() { "" } else { "no" })
        .table()
        .without_empty()
}

fn convergence(page: &mut HtmlReport, folder: &Path, outcome: &Outcome) -> Result<()> {
    // Before any candidate drives there is nothing to draw.
    let drives = |r: &&super::HistoryRow| r.best.iter().all(|best| best.is_finite());
    let rows: Vec<&super::HistoryRow> = outcome.history.iter().filter(drives).collect();
    let width = rows.first().map_or(0, |r| r.best.len());
    if width == 0 {
        return Ok(());
    }
    let curve = |of: &dyn Fn(&super::HistoryRow) -> f64| -> Vec<(f64, f64)> {
        rows.iter().map(|r| (r.evaluations as f64, of(r))).collect()
    };
    let mut panel = Panel::new("Cost of the swarm's best")
        .x("candidates evaluated", "")
        .y("cost, channels' errors over their spread", "")
        .scales(Scale::Linear, Scale::Log);
    for k in 0..width {
        let label = match width {
            1 => "best".to_owned(),
            _ => format!("best of objective {k}"),
        };
        panel = panel.points(label, curve(&|r| r.best[k]));
    }
    if rows.iter().any(|r| r.median.is_some()) {
        panel = panel.points("median of the swarm", curve(&|r| r.median.unwrap_or(f64::NAN)));
    }
    page.section("Convergence", "");
    let figure = Curves::new("Convergence", [panel]);
    if width == 1 {
        figure.write_svg(&folder.join("convergence.svg"))?;
    }
    page.place(&figure)
}
