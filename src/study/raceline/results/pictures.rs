//! Maps, traces, lap deltas and the front.

use super::told_lines;
use crate::error::Result;
use crate::files::stem;
use crate::report::{
    Curve, CurvePanel, Objective, TrackMap, plot_curves, plot_parallel, plot_pareto, plot_track_map,
};
use crate::study::raceline::{Outcome, ReportedLine, Setup};
use glam::DVec2;
use std::path::Path;

/// Room before and behind a section in its close-up (m).
const ROOM_M: f64 = 60.0;
/// Points of a lap delta.
const DELTA_POINTS: usize = 2000;

pub fn draw(folder: &Path, setup: &Setup, outcome: &Outcome) -> Result<()> {
    let lines = told_lines(outcome);
    // The fastest of the lines told of is the one to look at.
    if let Some(fastest) = lines
        .iter()
        .min_by(|a, b| a.lap_time_fine_s().total_cmp(&b.lap_time_fine_s()))
    {
        draw_map(&folder.join("map.svg"), setup, fastest)?;
        draw_sections(folder, setup, fastest)?;
        draw_traces(&folder.join("traces.svg"), setup, &lines, fastest)?;
    }
    draw_convergence(&folder.join("convergence.svg"), outcome)?;
    draw_front(folder, outcome)
}

fn title(setup: &Setup, line: &ReportedLine) -> String {
    format!(
        "{}, {} line of the {}: {:.2} s",
        setup.track_name,
        line.name,
        setup.car_name,
        line.lap_time_fine_s()
    )
}

fn speeds(line: &ReportedLine) -> &[f64] {
    line.fine.lap.as_ref().map_or(&[], |lap| &lap.v_mps)
}

/// Names to write on a map, and their places (m).
pub fn map_names(setup: &Setup) -> Vec<(&str, DVec2)> {
    let road = &setup.road;
    let at = |station: f64| {
        let i = road
            .station_m
            .partition_point(|s| *s < station)
            .min(road.len() - 1);
        0.5 * (road.left_m[i] + road.right_m[i])
    };
    let corners = road.corners.iter().map(|c| (c.name.as_str(), at(c.station_m)));
    let sections = road
        .sections
        .iter()
        .map(|s| (s.name.as_str(), at(0.5 * (s.start_m + s.end_m))));
    if road.corners.is_empty() {
        sections.collect()
    } else {
        corners.collect()
    }
}

fn draw_map(path: &Path, setup: &Setup, line: &ReportedLine) -> Result<()> {
    plot_track_map(
        path,
        &TrackMap {
            title: &title(setup, line),
            left_edge_m: &setup.edges_m[1],
            right_edge_m: &setup.edges_m[0],
            line_m: &line.fine.points_m,
            values: speeds(line),
            value_label: "speed",
            value_unit: "m/s",
            closed: setup.road.closed,
            names: map_names(setup),
        },
    )
}

/// A close-up of each named section.
fn draw_sections(folder: &Path, setup: &Setup, line: &ReportedLine) -> Result<()> {
    let road = &setup.road;
    let inside = |station: f64, start: f64, end: f64| {
        let ahead = |s: f64| {
            if road.closed {
                s.rem_euclid(road.length_m)
            } else {
                s
            }
        };
        if road.closed {
            ahead(station - start) <= ahead(end - start)
        } else {
            (start..=end).contains(&station)
        }
    };
    // A point of the fine line lies at its cut's station of the reference line, and so on to the next.
    let station_of = |i: usize| {
        let (cut, share) = line.fine.section[i];
        let here = road.station_m[cut.min(road.len() - 1)];
        let next = road.station_m.get(cut + 1).copied().unwrap_or(road.length_m);
        here + share * (next - here)
    };
    // In order of travel, also where the stretch goes through the start line.
    let stretch = |count: usize, within: &dyn Fn(usize) -> bool| -> Vec<usize> {
        let first = (0..count)
            .find(|&i| within(i) && !within((i + count - 1) % count))
            .unwrap_or(0);
        (0..count)
            .map(|k| (first + k) % count)
            .take_while(|&i| within(i))
            .collect()
    };
    for section in &road.sections {
        let (start, end) = (section.start_m - ROOM_M, section.end_m + ROOM_M);
        if end - start >= road.length_m {
            continue;
        }
        let points = stretch(line.fine.points_m.len(), &|i| inside(station_of(i), start, end));
        let dense = setup.edges_m[0].len();
        let edge = stretch(dense, &|i| {
            inside(road.length_m * i as f64 / dense as f64, start, end)
        });
        if points.len() < 2 || edge.len() < 2 {
            continue;
        }
        let of = |points: &[DVec2], which: &[usize]| which.iter().map(|&i| points[i]).collect::<Vec<_>>();
        let v = speeds(line);
        plot_track_map(
            folder.join(format!("section_{}.svg", stem(&section.name))),
            &TrackMap {
                title: &format!("{}: {}", section.name, title(setup, line)),
                left_edge_m: &of(&setup.edges_m[1], &edge),
                right_edge_m: &of(&setup.edges_m[0], &edge),
                line_m: &of(&line.fine.points_m, &points),
                values: &points
                    .iter()
                    .map(|&i| v.get(i).copied().unwrap_or(f64::NAN))
                    .collect::<Vec<_>>(),
                value_label: "speed",
                value_unit: "m/s",
                closed: false,
                names: Vec::new(),
            },
        )?;
    }
    Ok(())
}

/// Distances (m) along the reference line. Lines differ in length: what is beside each other on the road is drawn above
/// each other.
pub fn along(setup: &Setup, line: &ReportedLine) -> Vec<f64> {
    let stretch = setup.road.length_m / line.fine.length_m;
    line.fine.station_m.iter().map(|s| s * stretch).collect()
}

/// Speed, accelerations and steering of every line against distance, and the time that each loses on the fastest.
fn draw_traces(path: &Path, setup: &Setup, lines: &[&ReportedLine], fastest: &ReportedLine) -> Result<()> {
    let panel = |title, y_label, of: &dyn Fn(&ReportedLine) -> Option<Vec<f64>>| CurvePanel {
        title,
        x_label: "distance along the reference line (m)",
        y_label,
        curves: lines
            .iter()
            .filter_map(|line| {
                Some(Curve {
                    label: "",
                    x: along(setup, line),
                    y: of(line)?,
                    shade: None,
                })
            })
            .collect(),
    };
    let lap = |line: &ReportedLine| line.fine.lap.clone();
    let mut panels = vec![
        panel("Speed", "speed (m/s)", &|l| lap(l).map(|lap| lap.v_mps)),
        panel("Lateral acceleration", "ay (m/s\u{b2})", &|l| {
            lap(l).map(|lap| lap.ay_mps2)
        }),
        panel("Longitudinal acceleration", "ax (m/s\u{b2})", &|l| {
            lap(l).map(|lap| lap.ax_mps2)
        }),
        panel("Curvature", "curvature (1/m)", &|l| {
            Some(l.fine.curvature_1pm.clone())
        }),
    ];
    // The only panel with names: colours are the same in all.
    let shares: Vec<f64> = (0..=DELTA_POINTS)
        .map(|i| i as f64 / DELTA_POINTS as f64)
        .collect();
    let delta = lines
        .iter()
        .filter_map(|line| {
            Some(Curve {
                label: &line.name,
                x: shares.iter().map(|share| share * setup.road.length_m).collect(),
                y: lap_delta(line, fastest, &shares)?,
                shade: None,
            })
        })
        .collect::<Vec<_>>();
    if !delta.is_empty() {
        panels.push(CurvePanel {
            title: "Time lost to the fastest line",
            x_label: "distance along the reference line (m)",
            y_label: "time (s)",
            curves: delta,
        });
    }
    plot_curves(
        path,
        &format!("{}: lines of the {}", setup.track_name, setup.car_name),
        &panels,
    )
}

/// The time that one line loses on another (s), after each share of the lap.
pub fn lap_delta(line: &ReportedLine, other: &ReportedLine, shares: &[f64]) -> Option<Vec<f64>> {
    let clock = |line: &ReportedLine| {
        let fine = &line.fine;
        let lap = fine.lap.as_ref()?;
        let (elapsed, end) = (lap.elapsed_s(), (fine.length_m, lap.time_s));
        let station = fine.station_m.clone();
        Some(move |share: f64| {
            let at = share * end.0;
            let after = station.partition_point(|s| *s <= at).max(1);
            let (s0, t0) = (station[after - 1], elapsed[after - 1]);
            let s1 = station.get(after).copied().unwrap_or(end.0);
            let t1 = elapsed.get(after).copied().unwrap_or(end.1);
            if s1 > s0 {
                t0 + (at - s0) / (s1 - s0) * (t1 - t0)
            } else {
                t0
            }
        })
    };
    let (mine, its) = (clock(line)?, clock(other)?);
    Some(shares.iter().map(|&share| mine(share) - its(share)).collect())
}

fn draw_convergence(path: &Path, outcome: &Outcome) -> Result<()> {
    let labels: Vec<String> = outcome
        .objectives
        .iter()
        .map(|o| format!("{} ({})", o.objective.name(), o.objective.unit()))
        .collect();
    let panels: Vec<CurvePanel<'_>> = outcome
        .objectives
        .iter()
        .zip(&outcome.history)
        .zip(&labels)
        .filter(|((_, history), _)| !history.is_empty())
        .map(|((o, history), label)| CurvePanel {
            title: &o.best.name,
            x_label: "lines evaluated",
            y_label: label,
            curves: vec![Curve {
                label: "",
                x: history.iter().map(|(n, _)| *n as f64).collect(),
                y: history.iter().map(|(_, best)| *best).collect(),
                shade: None,
            }],
        })
        .collect();
    if panels.is_empty() {
        return Ok(());
    }
    plot_curves(path, "Convergence of the swarms", &panels)
}

/// The front as scatters of every two objectives and as parallel coordinates.
fn draw_front(folder: &Path, outcome: &Outcome) -> Result<()> {
    let Some(front) = outcome.front.as_ref().filter(|f| !f.alpha.is_empty()) else {
        return Ok(());
    };
    let objectives: Vec<Objective<'_>> = outcome
        .objectives
        .iter()
        .map(|o| Objective {
            name: o.objective.name(),
            unit: o.objective.unit(),
        })
        .collect();
    let chosen = outcome
        .compromise
        .as_ref()
        .and_then(|line| front.alpha.iter().position(|alpha| *alpha == line.alpha));
    if objectives.len() <= 6 {
        plot_pareto(
            folder.join("front.svg"),
            "Lines on the front",
            &objectives,
            &front.objectives,
            chosen,
        )?;
    }
    if objectives.len() >= 2 {
        plot_parallel(
            folder.join("parallel.svg"),
            "The front in parallel coordinates",
            &objectives,
            &front.objectives,
            chosen,
        )?;
    }
    Ok(())
}
