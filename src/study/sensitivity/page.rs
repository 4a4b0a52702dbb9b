//! The interactive report of a sensitivity study, with its figures.

use super::results::{
    ParameterSensitivity, Summary, one_at_a_time_figure, output_table, parameter_table, sobol_figure,
};
use super::{OUTPUTS, Outcome, Outputs, Sensitivity, output};
use crate::config::settings::Settings;
use crate::error::Result;
use crate::files::stem;
use crate::report::{HtmlReport, LapLine, LapView, significant};
use crate::study::framework::Solved;
use crate::study::identify::Setup;
use crate::study::replayed::of_cost;
use crate::track::Circuit;
use glam::DVec2;
use std::path::Path;

pub(super) fn write(folder: &Path, solved: &Solved<'_, Sensitivity>, summary: &Summary) -> Result<()> {
    let (setup, outcome) = (solved.prepared, solved.outcome);
    let car = &setup.replay.free.car.name;
    let mut page = HtmlReport::new("sensitivity", &format!("What matters of the {car}"));
    head(&mut page, car, summary);
    if !outcome.indices.is_empty() {
        page.section(
            "Shares of variance",
            "Sobol indices, all parameters moved at once: what each explains of a cost's variance alone, and together with \
             all that it acts with. Whiskers are 95 % intervals.",
        );
        page.figure(folder.join("sobol.svg"), &sobol_figure(summary))?;
    }
    page.section(
        "One at a time",
        &format!("Each parameter alone, {}.", summary.reach),
    );
    let changes = one_at_a_time_figure(summary);
    if !changes.is_empty() {
        page.figure(folder.join("one_at_a_time.svg"), &changes)?;
    }
    if let Some(cost) = summary.first_cost() {
        let note = format!("Changes and shares are those of the cost `{cost}`.");
        page.table("Parameters", &note, &parameter_table(summary, cost))?;
        let note = "Root of the mean squared change, where it is greatest. No log has the roll rate, so it has no cost.";
        page.table("Change of each output", note, &output_table(summary))?;
    }
    page.section("Along the lap", "");
    page.figure(folder.join("bands.svg"), &bands(setup, outcome))?;
    for (k, range) in solved.settings.ranges.iter().enumerate() {
        let file = format!("traces_{}.svg", stem(&range.name));
        page.figure(folder.join(file), &traces(setup, outcome, k))?;
    }
    page.facts(&[("log", &setup.log.source), ("car", car), ("seed", &summary.seed)]);
    summary.record.provenance(&mut page, "candidates evaluated");
    page.settings("study.toml, which repeats this run", solved.settings.to_toml());
    page.write(folder.join("report.html"))
}

fn head(page: &mut HtmlReport, car: &str, summary: &Summary) {
    page.sentence(format!(
        "{} parameters of the {car} were moved, alone and together, each {}: {} laps in {:.1} s.",
        summary.parameters.len(),
        summary.reach,
        summary.record.evaluations,
        summary.record.elapsed_s
    ));
    if let Some(cost) = summary.first_cost() {
        let mut ranked: Vec<(&ParameterSensitivity, f64)> = summary
            .parameters
            .iter()
            .filter_map(|p| Some((p, p.sobol.get(cost)?.total)))
            .collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
        let told: Vec<String> = ranked
            .iter()
            .take(3)
            .map(|(p, total)| format!("{} ({:.0} %)", p.name, 100.0 * total))
            .collect();
        if !told.is_empty() {
            page.sentence(format!(
                "Most of the variance of the cost of {} goes with {}.",
                of_cost(cost),
                told.join(", ")
            ));
        }
        for (p, total) in ranked.iter().take(3) {
            page.tile(&p.name, format!("{total:.2}"), "of variance");
        }
    }
    if summary.left_out > 0 {
        page.warning(format!(
            "{} of {} samples are left out, because one of their cars did not drive.",
            summary.left_out, summary.samples
        ));
    }
    page.warnings(&summary.warnings, summary.record.interrupted);
}

/// The change that the parameters make at each place, least and greatest: the outputs themselves would hide it.
fn bands(setup: &Setup, outcome: &Outcome) -> LapView {
    let circuit = setup.circuit.as_ref();
    let places = places(setup);
    let line = |name: &str| LapLine::new(name, &setup.log.distance_m[..]).at(&places[..]);
    let (mut greatest, mut least) = (line("greatest"), line("least"));
    for k in 0..OUTPUTS {
        let base = &outcome.outputs[0][k];
        let change = |fold: fn(f64, f64) -> f64| -> Vec<f64> {
            let end = |i: usize| outcome.outputs.iter().map(|o| o[k][i]).fold(f64::NAN, fold);
            (0..base.len()).map(|i| end(i) - base[i]).collect()
        };
        let (low, high) = (change(f64::min), change(f64::max));
        greatest = greatest.trace(k, &high[..]).band(&low, &high);
        least = least.trace(k, low);
    }
    LapView::new(format!(
        "What {} parameters change along the lap, one at a time",
        outcome.base.len(),
    ))
    .note("Output minus that of the base car: the least and the greatest over all parameters.")
    .panels(panels())
    .line(greatest)
    .line(least)
    .circuit(circuit)
}

/// Where the samples lie on the circuit, if it is known.
fn places(setup: &Setup) -> Vec<DVec2> {
    let along = |c: &Circuit| setup.log.distance_m.iter().map(|s| c.position_at(*s)).collect();
    setup.circuit.as_ref().map_or_else(Vec::new, along)
}

fn panels() -> impl Iterator<Item = (&'static str, &'static str)> {
    (0..OUTPUTS).map(output).map(|[_, label, unit]| (label, unit))
}

/// Most values of a parameter whose traces a figure has room for.
const MOST_TRACES: usize = 10;

/// The outputs along the lap at the values of one parameter, over those of the base car.
fn traces(setup: &Setup, outcome: &Outcome, parameter: usize) -> LapView {
    let name = &setup.replay.problem.variables[parameter].name;
    let line = |name: String, outputs: &Outputs| {
        let line = LapLine::new(name, &setup.log.distance_m[..]);
        (0..OUTPUTS).fold(line, |line, k| line.trace(k, &outputs[k][..]))
    };
    let rows = outcome.one_at_a_time.iter().zip(&outcome.outputs[1..]);
    let own: Vec<_> = rows.filter(|(row, _)| row.parameter == parameter).collect();
    let every = own.len().div_ceil(MOST_TRACES).max(1);
    let shown = own.iter().step_by(every);
    let lines = shown.map(|(row, outputs)| line(significant(row.value, 5), outputs));
    LapView::new(format!("The lap at values of {name}"))
        .panels(panels())
        .line(line("base car".to_owned(), &outcome.outputs[0]).wide())
        .lines(lines)
        .circuit(setup.circuit.as_ref())
}
