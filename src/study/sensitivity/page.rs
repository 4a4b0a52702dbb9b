//! The interactive report of a sensitivity study, with its figures.

use super::results::{ParameterSensitivity, Summary, one_at_a_time_figure, parameter_table, sobol_figure};
use super::{LEVELS, Outcome, Sensitivity};
use crate::config::settings::Settings;
use crate::error::Result;
use crate::evaluate::replay::{CHANNEL_LABELS, CHANNEL_UNITS};
use crate::report::{HtmlReport, LapLine, LapView};
use crate::study::framework::Solved;
use crate::study::identify::Setup;
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
        &format!("Each parameter alone, {} % either way.", 100.0 * summary.share),
    );
    let changes = one_at_a_time_figure(summary);
    if !changes.is_empty() {
        page.figure(folder.join("one_at_a_time.svg"), &changes)?;
    }
    if let Some(cost) = summary.first_cost() {
        let note = format!("Changes and shares are those of the cost `{cost}`.");
        page.table("Parameters", &note, &parameter_table(summary, cost))?;
    }
    page.section("Along the lap", "");
    page.figure(folder.join("bands.svg"), &bands(setup, outcome))?;
    page.facts(&[("log", &setup.log.source), ("car", car), ("seed", &summary.seed)]);
    summary.record.provenance(&mut page, "candidates evaluated");
    page.settings("study.toml, which repeats this run", solved.settings.to_toml());
    page.write(folder.join("report.html"))
}

fn head(page: &mut HtmlReport, car: &str, summary: &Summary) {
    page.sentence(format!(
        "{} parameters of the {car} were moved by {} % either way, alone and together: {} laps in {:.1} s.",
        summary.parameters.len(),
        100.0 * summary.share,
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
                if cost == "all" {
                    "all channels together"
                } else {
                    cost
                },
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
    let band = &outcome.band;
    let circuit = setup.circuit.as_ref();
    let places = circuit
        .iter()
        .flat_map(|c| band.distance_m.iter().map(|s| c.position_at(*s)))
        .collect::<Vec<_>>();
    let line = |name: &str| LapLine::new(name, &band.distance_m[..]).at(&places[..]);
    let (mut greatest, mut least) = (line("greatest"), line("least"));
    for k in 0..CHANNEL_LABELS.len() {
        let change =
            |end: &[f64]| -> Vec<f64> { end.iter().zip(&band.base[k]).map(|(e, b)| e - b).collect() };
        let (low, high) = (change(&band.low[k]), change(&band.high[k]));
        greatest = greatest.trace(k, &high[..]).band(&low, &high);
        least = least.trace(k, low);
    }
    LapView::new(format!(
        "What {} parameters change along the lap, one at a time at {} steps",
        outcome.base.len(),
        LEVELS.len()
    ))
    .note("Output minus that of the base car: the least and the greatest over all parameters.")
    .panels((0..CHANNEL_LABELS.len()).map(|k| (CHANNEL_LABELS[k], CHANNEL_UNITS[k])))
    .line(greatest)
    .line(least)
    .circuit(circuit)
}
