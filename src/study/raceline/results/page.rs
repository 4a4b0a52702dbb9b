//! The figures of a racing-line study and its interactive report.

use super::{LineFigures, Summary, reported_lines, sectors, setups};
use crate::config::settings::Settings;
use crate::error::Result;
use crate::evaluate::BackendChoice;
use crate::evaluate::line::open_line_evaluator;
use crate::files::stem;
use crate::line::Parametrisation;
use crate::report::{
    CornerLap, Curves, Front, HtmlReport, LapLine, LapView, Levels, Panel, Road, Surface, Table, TrackMap,
    with_unit,
};
use crate::study::framework::Solved;
use crate::study::raceline::{ObjectiveOutcome, Outcome, Raceline, RacelineSettings, ReportedLine, Setup};
use glam::DVec2;
use std::path::Path;

/// Rows of the traces, from the top.
const PANELS: [(&str, &str); 6] = [
    ("speed", "m/s"),
    ("time lost", "s"),
    ("ax", "m/s\u{b2}"),
    ("ay", "m/s\u{b2}"),
    ("curvature", "1/m"),
    ("steering", "rad"),
];
/// Room before and behind a section in its close-up (m).
const ROOM_M: f64 = 60.0;
/// Values of each `alpha` of a surface.
const GRID: usize = 25;

/// Draws figures into `folder`, and writes the page.
///
/// # Errors
/// [`crate::Error::Io`] if one cannot be written.
pub fn write(folder: &Path, solved: &Solved<'_, Raceline>, summary: &Summary) -> Result<()> {
    let (setup, outcome) = (solved.prepared, solved.outcome);
    let (subject, record) = (&summary.head.subject, &summary.head.record);
    let mut page = HtmlReport::new(&summary.head.study, &subject.words());
    // The fastest first: it colours the map, and time is lost on it.
    let mut lines = reported_lines(outcome);
    lines.sort_by(|a, b| {
        let off_road = |line: &ReportedLine| !line.clearance.is_on_road();
        let times = a.lap_time_fine_s().total_cmp(&b.lap_time_fine_s());
        off_road(a).cmp(&off_road(b)).then(times)
    });
    head(&mut page, outcome, summary, &lines);
    page.section(
        "Lines",
        "Distances are those of the reference line, so that what lies side by side on the road stands one above the other here.",
    );
    let view = laps(setup, &lines);
    page.figure(folder.join("traces.svg"), &view)?;
    if let Some(fastest) = lines.first() {
        let (track, car, name) = (&setup.track_name, &setup.car_name, &fastest.name);
        let time_s = fastest.lap_time_fine_s();
        let title = format!("{track}, {name} line of the {car}: {time_s:.2} s");
        if let Some(map) = view.track_map(&*title) {
            map.write_svg(folder.join("map.svg"))?;
            close_ups(folder, setup, fastest, &map)?;
        }
    }
    corners(&mut page, setup, &lines)?;
    page.table(
        "Lines compared",
        "Values at the cross-sections are what the solvers see. Fine values are on a spline through them with \
         points 1 m apart at the most, and are the ones to believe. Clearance is the least distance from the car, its corners in bends \
         included, to the edges.",
        &lines_table(summary),
    )?;
    sectors::place(&mut page, &summary.sectors)?;
    if let (Some(found), Some(figures)) = (&outcome.setups, &summary.setups) {
        setups::report(&mut page, folder, found, figures)?;
    }
    front(&mut page, folder, outcome)?;
    let searched = outcome.objectives.iter().filter(|o| !o.history.is_empty());
    let panels = searched.map(|o| {
        Panel::new(&*o.best.name)
            .x("lines evaluated", "")
            .y(o.objective.words(), o.objective.unit())
            .points(
                "",
                o.history
                    .iter()
                    .map(|row| (row.evaluations as f64, row.best.unwrap_or(f64::NAN))),
            )
    });
    let convergence = Curves::new("Convergence of the swarms", panels);
    if !convergence.is_empty() {
        page.section("Convergence of the swarms", "");
        page.figure(folder.join("convergence.svg"), &convergence)?;
    }
    page.section(
        "Objectives about the best lines",
        if solved.settings.surface_sections.is_empty() {
            "Each over the line's place at the cross-section where it bends most and at the next."
        } else {
            "Each over the line's place at the two cross-sections that were asked for."
        },
    );
    for found in &outcome.objectives {
        if let Some(surface) = surface(solved.settings, setup, found)? {
            let name = format!("surface_{}.svg", found.best.stem());
            page.figure(folder.join(name), &surface)?;
        }
    }
    page.facts(&[
        ("track", &subject.track_name()),
        ("car", &subject.car),
        ("cross-sections", &summary.sections),
        ("seed", &subject.seed),
    ]);
    record.provenance(&mut page, "lines evaluated");
    let seconds = |s: f64| format!("{s:.1} s");
    page.provenance("swarms and local search", seconds(summary.search_elapsed_s));
    page.provenance("reference optima", seconds(summary.exact_elapsed_s));
    for (name, status) in &summary.exact_status {
        page.provenance(
            &format!("reference optimum, {name}"),
            status.as_deref().unwrap_or_default(),
        );
    }
    page.settings("study.toml, which repeats this run", solved.settings.to_toml());
    page.write(folder.join("report.html"))
}

fn head(page: &mut HtmlReport, outcome: &Outcome, summary: &Summary, lines: &[&ReportedLine]) {
    if let Some(fastest) = lines.first() {
        let time = fastest.lap_time_fine_s();
        page.sentence(format!(
            "The best lap of {} takes {time:.2} s, on the {} line of {:.0} m.",
            summary.head.subject.track_name(),
            fastest.name,
            fastest.fine.length_m
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
        let others = lines[1..]
            .iter()
            .filter(|line| line.lap_time_fine_s().is_finite());
        let losses: Vec<String> = others
            .map(|line| format!("the {} line {:.2} s", line.name, line.lap_time_fine_s() - time))
            .collect();
        if !losses.is_empty() {
            page.sentence(format!("Time lost by the others: {}.", losses.join(", ")));
        }
    }
    let gaps: Vec<String> = outcome
        .objectives
        .iter()
        .filter_map(|o| {
            let gap = summary.above_exact_percent.get(o.objective.name());
            Some(format!(
                "{} {:+.3} %",
                o.objective.words(),
                gap.copied().flatten()?
            ))
        })
        .collect();
    if !gaps.is_empty() {
        page.sentence(format!("Against the reference optima: {}.", gaps.join(", ")));
    }
    if let Some(volume) = summary.hypervolume {
        page.tile("Lines on the front", summary.front_size.to_string(), "");
        page.tile("Hypervolume", format!("{volume:.4}"), "of the box");
    }
    page.warnings(&summary.warnings, outcome.record.interrupted);
}

/// The lines over one another, the time that each loses being against the first.
fn laps(setup: &Setup, lines: &[&ReportedLine]) -> LapView {
    let road = &setup.road;
    let line = |line: &&ReportedLine| {
        // Lines differ in length: what is beside each other on the road stands above each other.
        let stretch = road.length_m / line.fine.length_m;
        let x: Vec<f64> = line.fine.station_m.iter().map(|s| s * stretch).collect();
        let shares: Vec<f64> = x.iter().map(|s| s / road.length_m).collect();
        let mut view = LapLine::new(&*line.name, x).at(&line.fine.points_m[..]);
        if let Some(lap) = &line.fine.lap {
            let lost = lines
                .first()
                .and_then(|fastest| line.fine.time_lost_s(&fastest.fine, &shares));
            view = view
                .trace(0, &lap.v_mps[..])
                .maybe(1, lost)
                .trace(2, &lap.ax_mps2[..])
                .trace(3, &lap.ay_mps2[..])
                .trace(5, &lap.steering_rad[..]);
        }
        view.trace(4, &line.fine.curvature_1pm[..])
    };
    let sections = road.sections.iter().filter(|s| s.start_m < s.end_m);
    LapView::new(format!("{}: lines of the {}", setup.track_name, setup.car_name))
        .note("Time lost is against the first line. Curvature and lateral acceleration are positive to the left.")
        .panels(PANELS)
        .lines(lines.iter().map(line))
        .sections(sections.map(|s| (s.name.clone(), s.start_m, s.end_m)))
        .road(Road::across(road, &setup.edges_m))
}

/// The lines by corner and sector, against the first.
fn corners(page: &mut HtmlReport, setup: &Setup, lines: &[&ReportedLine]) -> Result<()> {
    let laps = lines.iter().filter_map(|line| {
        let (fine, lap) = (&line.fine, line.fine.lap.as_ref()?);
        let stretch = setup.road.length_m / fine.length_m;
        let corners = CornerLap::new(&line.name, &fine.station_m, &lap.v_mps, &lap.ay_mps2, stretch)?;
        let corners = corners.grip_used(&lap.grip_used(&setup.car));
        Some(match setup.gears(&lap.v_mps) {
            Some(gear) => corners.gears(&gear),
            None => corners,
        })
    });
    let sections = setup.road.sections.iter();
    let sections: Vec<_> = sections.map(|s| (s.name.clone(), s.start_m, s.end_m)).collect();
    page.corners(&laps.collect::<Vec<_>>(), &sections)
}

/// A close-up of the map for each named section.
fn close_ups(folder: &Path, setup: &Setup, line: &ReportedLine, map: &TrackMap) -> Result<()> {
    let road = &setup.road;
    let inside = |station: f64, start: f64, end: f64| {
        if road.closed {
            (station - start).rem_euclid(road.length_m) <= (end - start).rem_euclid(road.length_m)
        } else {
            (start..=end).contains(&station)
        }
    };
    // A point of the fine line lies at its cross-section's station of the reference line, and so on to the next.
    let station_of = |i: usize| {
        let (section, share) = line.fine.section[i];
        let here = road.station_m[section.min(road.len() - 1)];
        let next = road.station_m.get(section + 1).copied().unwrap_or(road.length_m);
        here + share * (next - here)
    };
    // In order of travel, also where the stretch goes through the start line.
    let stretch = |count: usize, within: &dyn Fn(usize) -> bool| -> Vec<usize> {
        let first = (0..count).find(|&i| within(i) && !within((i + count - 1) % count));
        let ahead = (0..count).map(|k| (first.unwrap_or(0) + k) % count);
        ahead.take_while(|&i| within(i)).collect()
    };
    for section in &road.sections {
        let (start, end) = (section.start_m - ROOM_M, section.end_m + ROOM_M);
        if end - start >= road.length_m {
            continue;
        }
        let points = stretch(map.line_m.len(), &|i| inside(station_of(i), start, end));
        let dense = map.road.left_edge_m.len();
        let station = |i: usize| road.length_m * i as f64 / dense as f64;
        let edge = stretch(dense, &|i| inside(station(i), start, end));
        if points.len() < 2 || edge.len() < 2 {
            continue;
        }
        let of = |points: &[DVec2], which: &[usize]| which.iter().map(|&i| points[i]).collect::<Vec<_>>();
        let close_up = TrackMap {
            title: format!("{}: {}", section.name, map.title),
            road: Road {
                left_edge_m: of(&map.road.left_edge_m, &edge),
                right_edge_m: of(&map.road.right_edge_m, &edge),
                ..Road::default()
            },
            line_m: of(&map.line_m, &points),
            values: points.iter().map(|&i| map.values[i]).collect(),
            ..map.clone()
        };
        close_up.write_svg(folder.join(format!("section_{}.svg", stem(&section.name))))?;
    }
    Ok(())
}

/// The figures of the lines, those that a terminal has room for first.
pub fn lines_table(summary: &Summary) -> Table<'static> {
    let mut rows: Vec<(String, &LineFigures, Option<f64>)> = Vec::new();
    for (name, figures) in &summary.best {
        let gap = summary.above_exact_percent.get(name).copied().flatten();
        // What is less than a hundred-thousandth of a percent is rounding.
        let gap = gap.map(|percent| (1e5 * percent).round() / 1e5 + 0.0);
        rows.push((format!("best {name}"), figures, gap));
    }
    for (name, figures) in &summary.exact {
        rows.extend(figures.as_ref().map(|f| (format!("exact {name}"), f, None)));
    }
    let compromise = summary.compromise.as_ref();
    rows.extend(compromise.map(|f| ("compromise".to_owned(), f, None)));
    rows.push(("reference".to_owned(), &summary.reference, None));
    Table::rows(rows)
        .text("line", |r| r.0.clone())
        .number("lap time, fine", "s", |r| r.1.lap_time_fine_s)
        .number("lap time", "s", |r| r.1.lap_time_s)
        .number("above exact", "%", |r| r.2)
        .number("length", "m", |r| r.1.length_m)
        .number("Gamma", "1/m", |r| r.1.gamma_1pm)
        .number("curvature\u{b2}", "1/m", |r| r.1.integral_kappa2_1pm)
        .number("length, fine", "m", |r| r.1.length_fine_m)
        .number("curvature\u{b2}, fine", "1/m", |r| r.1.integral_kappa2_fine_1pm)
        .number("clearance", "m", |r| r.1.clearance_m)
        .number("steering rate", "deg/s", |r| r.1.steering_rate_deg_s)
        .table()
}

fn front(page: &mut HtmlReport, folder: &Path, outcome: &Outcome) -> Result<()> {
    let Some(found) = outcome.front.as_ref().filter(|f| !f.alpha.is_empty()) else {
        return Ok(());
    };
    page.section(
        "The front",
        "No line here is better than another by every objective at once. Values are those at the cross-sections.",
    );
    let mut front = Front::new("Lines on the front", &found.objectives);
    for o in &outcome.objectives {
        front = front.objective(o.objective.words(), o.objective.unit());
    }
    let compromise = outcome.compromise.as_ref();
    if let Some(chosen) =
        compromise.and_then(|line| found.alpha.iter().position(|alpha| *alpha == line.alpha))
    {
        front = front.mark(chosen, "compromise");
    }
    front.write_parallel(folder.join("parallel.svg"), "The front in parallel coordinates")?;
    page.figure(folder.join("front.svg"), &front)
}

/// An objective at the cross-section where its best line bends most and the next; none with fewer than two.
fn surface(settings: &RacelineSettings, setup: &Setup, found: &ObjectiveOutcome) -> Result<Option<Surface>> {
    let n = setup.cross_sections.len();
    let axis: Vec<f64> = (0..GRID).map(|i| i as f64 / (GRID - 1) as f64).collect();
    let line = &found.best;
    let bend = |i: usize| {
        let at = |place: &(usize, f64)| place.0 == i && place.1 == 0.0;
        let point = line.fine.section.iter().position(at);
        point.map_or(0.0, |p| line.fine.curvature_1pm[p].abs())
    };
    let bends = (0..n.saturating_sub(1)).map(|i| (i, bend(i)));
    let sharpest = bends.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| [i, i + 1]);
    let asked = match settings.surface_sections[..] {
        [a, b] => Some([a.min(b) as usize, a.max(b) as usize]),
        _ => sharpest,
    };
    let Some([across, up]) = asked else {
        return Ok(None);
    };
    let pair = Parametrisation::sections().with_free(vec![across, up], line.alpha.clone());
    let problem = setup.problem(pair, &[found.objective], settings)?;
    let grid: Vec<f64> = axis
        .iter()
        .flat_map(|y| axis.iter().flat_map(|x| [*x, *y]))
        .collect();
    // In f64: a surface's bottom is flatter than single precision.
    let mut evaluator = open_line_evaluator(&problem, BackendChoice::Cpu, None)?;
    let costs = evaluator.evaluate(&grid)?.worths(1).into_iter();
    let (name, unit) = (found.objective.name(), found.objective.unit());
    let label = |i: usize| format!("alpha at {:.1} m", setup.cross_sections.station_m[i]);
    Ok(Some(Surface {
        title: format!(
            "{}: {name} over the {} line's place on two cross-sections",
            setup.track_name, line.name
        ),
        x_label: label(across),
        y_label: label(up),
        z_label: with_unit(name, unit),
        y: axis.clone(),
        x: axis,
        z: costs
            .map(|worth| if worth.succeeded() { worth.cost } else { f64::NAN })
            .collect(),
        levels: Levels::Basin,
        marks: vec![(line.name.clone(), [line.alpha[across], line.alpha[up]])],
    }))
}
