//! The interactive report of a sensitivity study.

use super::results::{LABELS, ParameterSensitivity, Summary, one_at_a_time_panels, sobol_panels};
use super::{LEVELS, Outcome, SobolIndex};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::evaluate::replay::CHANNEL_UNITS;
use crate::report::{Cells, Column, HtmlReport, LapLine, LapPanel, LapTrace, LapView};
use crate::study::circuit_view;
use crate::study::identify::Setup;
use std::path::Path;

pub(super) fn write(
    folder: &Path,
    study_toml: &str,
    setup: &Setup,
    outcome: &Outcome,
    summary: &Summary,
) -> Result<()> {
    let car = &setup.replay.free.car.name;
    let mut page = HtmlReport::new("sensitivity", &format!("What matters of the {car}"));
    head(&mut page, car, summary);
    if !outcome.indices.is_empty() {
        page.section(
            "Shares of variance",
            "Sobol indices, all parameters moved at once: what each explains of a cost's variance alone, and together with \
             all that it acts with. Whiskers are 95 % intervals.",
        );
        sobol_panels(summary, |panels| {
            panels.iter().try_for_each(|panel| page.bars(panel, ""))
        })?;
    }
    page.section(
        "One at a time",
        &format!("Each parameter alone, {} % either way.", 100.0 * summary.share),
    );
    one_at_a_time_panels(summary, |panels| {
        panels.iter().try_for_each(|panel| page.bars(panel, ""))
    })?;
    table(&mut page, summary)?;
    page.section("Along the lap", "");
    bands(&mut page, setup, outcome)?;
    page.provenance("log", &setup.log.source);
    page.provenance("car", car);
    page.provenance("seed", summary.seed.to_string());
    page.provenance("backend", summary.backend);
    page.provenance("adapter", &summary.adapter);
    page.provenance("driver", &outcome.backend.driver);
    page.provenance("candidates evaluated", summary.evaluations.to_string());
    page.provenance("candidates that failed", failures_in_words(&summary.failures));
    page.provenance(
        "candidates per second",
        format!("{:.0}", summary.evaluations_per_s),
    );
    page.provenance("time", format!("{:.1} s", summary.elapsed_s));
    page.settings("study.toml, which repeats this run", study_toml);
    page.write(folder.join("report.html"))
}

/// The cost that the summary tells of: all channels together, if there is such a one.
fn first_cost(summary: &Summary) -> Option<&String> {
    let costs = &summary.base_costs;
    costs.keys().find(|n| *n == "all").or(costs.keys().next())
}

fn head(page: &mut HtmlReport, car: &str, summary: &Summary) {
    page.sentence(format!(
        "{} parameters of the {car} were moved by {} % either way, alone and together: {} laps in {:.1} s.",
        summary.parameters.len(),
        100.0 * summary.share,
        summary.evaluations,
        summary.elapsed_s
    ));
    if let Some(cost) = first_cost(summary) {
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
            "{} of {} samples are left out: a car of theirs did not drive.",
            summary.left_out, summary.samples
        ));
    }
    for warning in &summary.warnings {
        page.warning(warning);
    }
    if summary.interrupted {
        page.warning("The run was interrupted; this is what it had reached.");
    }
}

fn table(page: &mut HtmlReport, summary: &Summary) -> Result<()> {
    let Some(cost) = first_cost(summary) else {
        return Ok(());
    };
    let p = &summary.parameters;
    let names: Vec<String> = p.iter().map(|p| p.name.clone()).collect();
    let units: Vec<String> = p.iter().map(|p| p.unit.clone()).collect();
    let of = |f: &dyn Fn(&ParameterSensitivity) -> f64| p.iter().map(f).collect::<Vec<f64>>();
    let index = |f: fn(&SobolIndex) -> f64| of(&|p| p.sobol.get(cost).map_or(f64::NAN, f));
    let figures = [
        ("value", of(&|p| p.value)),
        ("from", of(&|p| p.range[0])),
        ("to", of(&|p| p.range[1])),
        (
            "change of cost",
            of(&|p| p.one_at_a_time[cost].unwrap_or(f64::NAN)),
        ),
        ("share alone", index(|i| i.first)),
        ("share in all", index(|i| i.total)),
        ("95 % from", index(|i| i.total_interval[0])),
        ("95 % to", index(|i| i.total_interval[1])),
    ];
    let mut columns: Vec<Column<'_>> = [("parameter", &names), ("unit", &units)]
        .map(|(name, cells)| Column {
            name,
            unit: "",
            cells: Cells::Texts(cells),
        })
        .into();
    columns.extend(figures.iter().map(|(name, values)| Column {
        name,
        unit: "",
        cells: Cells::Numbers(values),
    }));
    let note = format!("Changes and shares are those of the cost `{cost}`.");
    page.table("Parameters", &note, &columns)
}

/// The change that the parameters make at each place, least and greatest: the outputs themselves would hide it.
fn bands(page: &mut HtmlReport, setup: &Setup, outcome: &Outcome) -> Result<()> {
    let band = &outcome.band;
    let circuit = setup.circuit.as_ref();
    let edges = circuit.map(circuit_view::edges);
    let change = |ends: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let of = |(end, base): (&Vec<f64>, &Vec<f64>)| end.iter().zip(base).map(|(e, b)| e - b).collect();
        ends.iter().zip(&band.base).map(of).collect()
    };
    let (low, high) = (change(&band.low), change(&band.high));
    let line = |name, values: &[Vec<f64>], banded: bool| LapLine {
        name,
        x: band.distance_m.clone(),
        traces: (0..LABELS.len())
            .map(|k| LapTrace {
                panel: k,
                values: values[k].clone(),
                band: banded.then(|| [low[k].as_slice(), &high[k]]),
            })
            .collect(),
        place_m: circuit
            .iter()
            .flat_map(|c| band.distance_m.iter().map(|s| c.position_at(*s)))
            .collect(),
        wide: false,
    };
    page.lap(&LapView {
        title: "What the parameters change",
        note: &format!(
            "Fitted less base, the least and the greatest over {} parameters one at a time at {} steps.",
            outcome.ranges.len(),
            LEVELS.len()
        ),
        x_label: "distance",
        x_unit: "m",
        panels: (0..LABELS.len())
            .map(|k| LapPanel {
                label: LABELS[k],
                unit: CHANNEL_UNITS[k],
                height: 1.0,
            })
            .collect(),
        lines: vec![line("greatest", &high, true), line("least", &low, false)],
        sections: circuit.map_or(Vec::new(), circuit_view::sections),
        map: circuit
            .zip(edges.as_ref())
            .map(|(c, edges)| circuit_view::map(c, edges)),
    })
}
