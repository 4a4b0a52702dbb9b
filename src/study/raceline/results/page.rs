//! The interactive report of a racing-line study.

use super::pictures::{along, lap_delta, map_names};
use super::{LineFigures, Summary, told_lines};
use crate::error::Result;
use crate::evaluate::failures_in_words;
use crate::evaluate::line::LineObjective;
use crate::report::{
    Cells, Column, Curve, CurvePanel, Front, HtmlReport, LapLine, LapMap, LapPanel, LapTrace, LapView,
    Objective, Scale, ShadedSection,
};
use crate::study::raceline::{Outcome, RacelineSettings, ReportedLine, Setup};
use std::path::Path;

/// Rows of the traces, from the top.
const PANELS: [(&str, &str); 6] = [
    ("speed", "m/s"),
    ("time lost", "s"),
    ("ax", "m/s\u{b2}"),
    ("ay", "m/s\u{b2}"),
    ("curvature", "1/m"),
    ("steering", "deg"),
];

pub fn write(
    folder: &Path,
    settings: &RacelineSettings,
    setup: &Setup,
    outcome: &Outcome,
    summary: &Summary,
) -> Result<()> {
    let title = format!("{} with the {}", summary.track, summary.car);
    let mut page = HtmlReport::new("raceline", &title);
    // The fastest first: it colours the map, and time is lost on it.
    let mut lines = told_lines(outcome);
    lines.sort_by(|a, b| a.lap_time_fine_s().total_cmp(&b.lap_time_fine_s()));
    head(&mut page, outcome, summary, &lines);
    page.section(
        "Lines",
        "What is beside each other on the road stands above each other here: distances are those of the reference line.",
    );
    page.lap(&lap(setup, &lines))?;
    table(&mut page, summary)?;
    front(&mut page, outcome)?;
    convergence(&mut page, outcome)?;
    page.provenance("track", &summary.track);
    page.provenance("car", &summary.car);
    page.provenance("cuts across the track", summary.sections.to_string());
    page.provenance("seed", summary.seed.to_string());
    page.provenance("backend", summary.backend);
    page.provenance("adapter", &summary.adapter);
    page.provenance("driver", &summary.driver);
    page.provenance("lines evaluated", summary.evaluations.to_string());
    page.provenance("lines that failed", failures_in_words(&summary.failures));
    page.provenance("lines per second", format!("{:.0}", summary.evaluations_per_s));
    page.provenance(
        "swarms and local search",
        format!("{:.1} s", summary.search_elapsed_s),
    );
    page.provenance("exact solvers", format!("{:.1} s", summary.exact_elapsed_s));
    for (name, status) in &summary.exact_status {
        if let Some(status) = status {
            page.provenance(&format!("exact solver, {name}"), status);
        }
    }
    page.settings("study.toml, which repeats this run", settings.to_toml());
    page.write(folder.join("report.html"))
}

fn head(page: &mut HtmlReport, outcome: &Outcome, summary: &Summary, lines: &[&ReportedLine]) {
    if let Some(fastest) = lines.first() {
        let time = fastest.lap_time_fine_s();
        page.sentence(format!(
            "The quickest way round {} is the {} line: {time:.2} s over {:.0} m.",
            summary.track, fastest.name, fastest.fine.length_m
        ));
        page.tile("Lap time", format!("{time:.3}"), "s");
        page.tile("Length", format!("{:.1}", fastest.fine.length_m), "m");
        if let Some(lap) = &fastest.fine.lap {
            let most = |values: &[f64]| values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
            let cornering = lap.ay_mps2.iter().map(|a| a.abs()).fold(0.0, f64::max);
            page.sentence(format!(
                "The car runs between {:.1} and {:.1} m/s, corners at up to {cornering:.1} m/s\u{b2} and brakes at up to \
                 {:.1} m/s\u{b2}.",
                least(&lap.v_mps),
                most(&lap.v_mps),
                -least(&lap.ax_mps2)
            ));
            page.tile("Top speed", format!("{:.1}", most(&lap.v_mps)), "m/s");
            page.tile("Slowest corner", format!("{:.1}", least(&lap.v_mps)), "m/s");
        }
        let losses: Vec<String> = lines[1..]
            .iter()
            .filter(|line| line.lap_time_fine_s().is_finite())
            .map(|line| format!("the {} line {:.2} s", line.name, line.lap_time_fine_s() - time))
            .collect();
        if !losses.is_empty() {
            page.sentence(format!("Beside it, {} are lost.", losses.join(", ")));
        }
    }
    let gaps: Vec<String> = outcome
        .objectives
        .iter()
        .filter_map(|o| {
            let gap = summary
                .above_exact_percent
                .get(o.objective.name())
                .copied()
                .flatten()?;
            Some(format!("{} {gap:+.3} %", words(o.objective)))
        })
        .collect();
    if !gaps.is_empty() {
        page.sentence(format!("Against the exact solvers: {}.", gaps.join(", ")));
    }
    if let Some(volume) = summary.hypervolume {
        page.tile("Lines on the front", summary.front_size.to_string(), "");
        page.tile("Hypervolume", format!("{volume:.4}"), "of the box");
    }
    for warning in &summary.warnings {
        page.warning(warning);
    }
    if outcome.interrupted {
        page.warning("The run was interrupted; this is what it had reached.");
    }
}

fn words(objective: LineObjective) -> &'static str {
    match objective {
        LineObjective::Length => "length",
        LineObjective::LengthSquared => "squared length",
        LineObjective::Gamma => "second difference",
        LineObjective::Kappa2 => "squared curvature",
        LineObjective::LapTime => "lap time",
    }
}

fn lap<'a>(setup: &'a Setup, lines: &[&'a ReportedLine]) -> LapView<'a> {
    let road = &setup.road;
    let line = |line: &'a ReportedLine| {
        let x = along(setup, line);
        let trace = |panel, values| LapTrace {
            panel,
            values,
            band: None,
        };
        let mut traces = Vec::new();
        if let Some(lap) = &line.fine.lap {
            traces.push(trace(0, lap.v_mps.clone()));
            let shares: Vec<f64> = x.iter().map(|s| s / road.length_m).collect();
            traces.extend(
                lines
                    .first()
                    .and_then(|fastest| lap_delta(line, fastest, &shares))
                    .map(|lost| trace(1, lost)),
            );
            traces.push(trace(2, lap.ax_mps2.clone()));
            traces.push(trace(3, lap.ay_mps2.clone()));
            traces.push(trace(
                5,
                lap.steering_rad.iter().map(|a| a.to_degrees()).collect(),
            ));
        }
        traces.push(trace(4, line.fine.curvature_1pm.clone()));
        LapLine {
            name: &line.name,
            x,
            traces,
            place_m: line.fine.points_m.clone(),
            wide: false,
        }
    };
    LapView {
        title: "Speed and what limits it",
        note: "Time lost is against the first of the lines. Curvature and lateral acceleration are positive to the left.",
        x_label: "distance",
        x_unit: "m",
        panels: PANELS
            .iter()
            .map(|(label, unit)| LapPanel {
                label,
                unit,
                height: 1.0,
            })
            .collect(),
        lines: lines.iter().map(|l| line(l)).collect(),
        sections: road
            .sections
            .iter()
            .filter(|s| s.start_m < s.end_m)
            .map(|s| ShadedSection {
                name: &s.name,
                start: s.start_m,
                end: s.end_m,
            })
            .collect(),
        map: Some(LapMap {
            left_edge_m: &setup.edges_m[1],
            right_edge_m: &setup.edges_m[0],
            closed: road.closed,
            names: map_names(setup),
        }),
    }
}

fn table(page: &mut HtmlReport, summary: &Summary) -> Result<()> {
    let mut rows: Vec<(String, &LineFigures, f64)> = Vec::new();
    for (name, figures) in &summary.best {
        let gap = summary.above_exact_percent.get(name).copied().flatten();
        rows.push((format!("best {name}"), figures, gap.unwrap_or(f64::NAN)));
    }
    for (name, figures) in &summary.exact {
        rows.extend(figures.as_ref().map(|f| (format!("exact {name}"), f, f64::NAN)));
    }
    rows.extend(
        summary
            .compromise
            .as_ref()
            .map(|f| ("compromise".to_owned(), f, f64::NAN)),
    );
    rows.push(("reference".to_owned(), &summary.reference, f64::NAN));
    let names: Vec<String> = rows.iter().map(|(name, ..)| name.clone()).collect();
    let of = |f: &dyn Fn(&LineFigures) -> f64| rows.iter().map(|(_, line, _)| f(line)).collect::<Vec<f64>>();
    let figures = [
        ("lap time, fine", "s", of(&|l| l.lap_time_fine_s)),
        ("lap time, cuts", "s", of(&|l| l.lap_time_s)),
        ("above exact", "%", rows.iter().map(|(.., gap)| *gap).collect()),
        ("length, fine", "m", of(&|l| l.length_fine_m)),
        ("length, cuts", "m", of(&|l| l.length_m)),
        ("Gamma", "1/m", of(&|l| l.gamma_1pm)),
        (
            "curvature\u{b2}, fine",
            "1/m",
            of(&|l| l.integral_kappa2_fine_1pm),
        ),
        ("curvature\u{b2}, cuts", "1/m", of(&|l| l.integral_kappa2_1pm)),
        ("clearance", "m", of(&|l| l.clearance_m)),
    ];
    let mut columns = vec![Column {
        name: "line",
        unit: "",
        cells: Cells::Texts(&names),
    }];
    columns.extend(figures.iter().map(|(name, unit, values)| Column {
        name,
        unit,
        cells: Cells::Numbers(values),
    }));
    page.table(
        "Lines compared",
        "Through the cuts is what the solvers see; fine is on a spline at 1 m between them, and is the one to believe. \
         Clearance is the least distance from the car's sides to the edges.",
        &columns,
    )
}

fn front(page: &mut HtmlReport, outcome: &Outcome) -> Result<()> {
    let Some(front) = outcome.front.as_ref().filter(|f| !f.alpha.is_empty()) else {
        return Ok(());
    };
    let chosen = outcome
        .compromise
        .as_ref()
        .and_then(|line| front.alpha.iter().position(|alpha| *alpha == line.alpha));
    page.section(
        "The front",
        "No line here is better than another by every objective at once. Figures are through the cuts.",
    );
    page.front(&Front {
        title: "Lines on the front",
        objectives: outcome
            .objectives
            .iter()
            .map(|o| Objective {
                name: words(o.objective),
                unit: o.objective.unit(),
            })
            .collect(),
        points: &front.objectives,
        marked: chosen.map(|i| (i, "compromise")).into_iter().collect(),
        ..Front::default()
    })
}

fn convergence(page: &mut HtmlReport, outcome: &Outcome) -> Result<()> {
    let histories = outcome.objectives.iter().zip(&outcome.history);
    let mut first = true;
    for (o, history) in histories.filter(|(_, history)| !history.is_empty()) {
        if std::mem::take(&mut first) {
            page.section("Convergence of the swarms", "");
        }
        let panel = CurvePanel {
            title: &o.best.name,
            x_label: "lines evaluated",
            y_label: &format!("{} ({})", words(o.objective), o.objective.unit()),
            curves: vec![Curve {
                label: "",
                x: history.iter().map(|(n, _)| *n as f64).collect(),
                y: history.iter().map(|(_, best)| *best).collect(),
                shade: None,
            }],
        };
        page.curves(&panel, "", [Scale::Linear; 2])?;
    }
    Ok(())
}
