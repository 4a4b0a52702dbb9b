//! The page that lays runs side by side.

use super::read::{Run, Trace};
use crate::error::{Error, Result};
use crate::report::{
    Cells, Column, Curve, CurvePanel, HtmlReport, LapLine, LapMap, LapPanel, LapTrace, LapView, Scale,
    significant,
};
use glam::DVec2;

/// Runs that a page takes at most: more lines than colours cannot be told apart.
const MOST_RUNS: usize = 24;
/// Figures worth a look first, by how their names begin.
const HEADLINES: [&str; 17] = [
    "total_parameter_error",
    "swarm_total_parameter_error",
    "rms_error",
    "holdout_rms_error",
    "best",
    "above_exact_percent",
    "hypervolume",
    "front_size",
    "lap_time_s",
    "point_mass_lap_time_s",
    "grip_share",
    "disagreement_percent",
    "scenarios",
    "top_speed_mps",
    "understeer_gradient_deg_per_g",
    "stability_factor_s2_per_m2",
    "elapsed_s",
];
/// Figures of a best line that are: those on the fine spline, where there are two.
const BEST: [&str; 4] = [
    "lap_time_fine_s",
    "length_fine_m",
    "integral_kappa2_fine_1pm",
    "gamma_1pm",
];
/// Traces that runs may share: names of their columns, label and unit.
const PANELS: [(&[&str], &str, &str); 7] = [
    (&["v", "vx_fitted", "vx"], "speed", "m/s"),
    (&["ax", "ax_fitted"], "ax", "m/s\u{b2}"),
    (&["ay", "ay_fitted"], "ay", "m/s\u{b2}"),
    (&["yaw_rate_fitted", "yaw_rate"], "yaw rate", "rad/s"),
    (&["curvature"], "curvature", "1/m"),
    (&["soc"], "state of charge", "MJ"),
    (&["steering", "steer"], "steering", "rad"),
];

/// Lays runs side by side: what they are, their figures, and their laps, limits and convergence over one another.
///
/// # Errors
/// [`Error::Input`] for no run, or more than can be told apart.
pub fn compare(runs: &[Run]) -> Result<HtmlReport> {
    if runs.is_empty() || runs.len() > MOST_RUNS {
        let expected = format!("1 to {MOST_RUNS}");
        return Err(Error::input(
            "the command line",
            "RUN",
            runs.len().to_string(),
            expected,
        ));
    }
    let names = distinct_names(runs);
    let title = match names.as_slice() {
        [one] => one.clone(),
        [first, second] => format!("{first} beside {second}"),
        [first, .., last] => format!("{} runs, {first} to {last}", runs.len()),
        [] => String::new(),
    };
    let mut page = HtmlReport::new("report", &title);
    head(&mut page, runs, &names);
    page.section("Runs", "");
    about(&mut page, runs, &names)?;
    figures(&mut page, runs, &names, true)?;
    laps(&mut page, runs, &names)?;
    limits(&mut page, runs, &names)?;
    convergence(&mut page, runs, &names)?;
    figures(&mut page, runs, &names, false)?;
    for (run, name) in runs.iter().zip(&names) {
        page.provenance(name, run.folder.display().to_string());
        if let Some(settings) = &run.settings {
            page.settings(&format!("study.toml of {name}"), settings);
        }
    }
    Ok(page)
}

/// Folders' names, with their paths where two are the same.
fn distinct_names(runs: &[Run]) -> Vec<String> {
    let twice = |name: &str| runs.iter().filter(|r| r.name == name).count() > 1;
    let named = |r: &Run| {
        if twice(&r.name) {
            r.folder.display().to_string()
        } else {
            r.name.clone()
        }
    };
    runs.iter().map(named).collect()
}

/// What a study is judged by, where one number says it: its name, words for it, its unit.
fn verdict(study: &str) -> Option<(&'static str, &'static str, &'static str)> {
    match study {
        "identify" => Some(("total_parameter_error", "total parameter error", "")),
        "raceline" => Some(("best / lap_time / lap_time_fine_s", "lap time", "s")),
        "transient" => Some(("lap_time_s", "driven lap", "s")),
        "simulate" => Some(("lap_time_s", "logged lap", "s")),
        "envelope" => Some(("top_speed_mps", "top speed", "m/s")),
        _ => None,
    }
}

fn head(page: &mut HtmlReport, runs: &[Run], names: &[String]) {
    let mut studies: Vec<&str> = runs.iter().map(|r| r.study.as_str()).collect();
    studies.sort_unstable();
    studies.dedup();
    for study in studies {
        let of = || runs.iter().zip(names).filter(|(r, _)| r.study == study);
        let count = of().count();
        let plural = if count == 1 { "run" } else { "runs" };
        let mut sentence = format!("{count} {plural} of {study}");
        if let Some((figure, words, unit)) = verdict(study) {
            let told: Vec<String> = of()
                .filter_map(|(r, name)| {
                    let value = significant(r.figure(figure)?, 6);
                    Some(format!("{name} {value} {unit}").trim_end().to_owned())
                })
                .collect();
            if !told.is_empty() {
                sentence += &format!(", by {words}: {}", told.join(", "));
            }
            for (r, name) in of() {
                if let Some(value) = r.figure(figure) {
                    page.tile(&format!("{name}, {words}"), significant(value, 6), unit);
                }
            }
        }
        page.sentence(sentence + ".");
    }
    for (run, name) in runs.iter().zip(names) {
        if run.said("interrupted") == Some("true") {
            page.warning(format!(
                "{name} was interrupted: its figures are what it had reached."
            ));
        }
    }
}

fn about(page: &mut HtmlReport, runs: &[Run], names: &[String]) -> Result<()> {
    let keys = [
        "study", "track", "car", "log", "seed", "backend", "adapter", "driver", "version",
    ];
    let said = |key: &str| -> Vec<String> {
        runs.iter()
            .map(|r| r.said(key).unwrap_or_default().to_owned())
            .collect()
    };
    let told: Vec<(&str, Vec<String>)> = keys.iter().map(|key| (*key, said(key))).collect();
    let mut columns = vec![Column {
        name: "run",
        unit: "",
        cells: Cells::Texts(names),
    }];
    let present = told
        .iter()
        .filter(|(_, cells)| cells.iter().any(|c| !c.is_empty()));
    columns.extend(present.map(|(name, cells)| Column {
        name,
        unit: "",
        cells: Cells::Texts(cells),
    }));
    page.table("What was run", "", &columns)
}

fn is_headline(name: &str) -> bool {
    let first = name.split(" / ").next().unwrap_or(name);
    let last = name.rsplit(" / ").next().unwrap_or(name);
    HEADLINES.contains(&first) && (first != "best" || BEST.contains(&last))
}

/// The numbers of the summaries: the headlines, or all others.
fn figures(page: &mut HtmlReport, runs: &[Run], names: &[String], headlines: bool) -> Result<()> {
    let mut rows: Vec<&str> = Vec::new();
    let mut known = std::collections::HashSet::new();
    for figure in runs.iter().flat_map(|r| &r.figures) {
        if known.insert(figure.name.as_str()) {
            rows.push(&figure.name);
        }
    }
    rows.retain(|name| is_headline(name) == headlines);
    if rows.is_empty() {
        return Ok(());
    }
    let by_name: Vec<std::collections::HashMap<&str, f64>> = runs
        .iter()
        .map(|r| r.figures.iter().map(|f| (f.name.as_str(), f.value)).collect())
        .collect();
    let labels: Vec<String> = rows.iter().map(|r| (*r).to_owned()).collect();
    let values: Vec<Vec<f64>> = by_name
        .iter()
        .map(|of| {
            rows.iter()
                .map(|row| of.get(row).copied().unwrap_or(f64::NAN))
                .collect()
        })
        .collect();
    let mut columns = vec![Column {
        name: "figure",
        unit: "",
        cells: Cells::Texts(&labels),
    }];
    columns.extend(names.iter().zip(&values).map(|(name, values)| Column {
        name,
        unit: "",
        cells: Cells::Numbers(values),
    }));
    // With two runs the difference is what one looks for.
    let change: Vec<f64> = match values.as_slice() {
        [a, b] => a.iter().zip(b).map(|(a, b)| 100.0 * (b - a) / a.abs()).collect(),
        _ => Vec::new(),
    };
    if !change.is_empty() {
        columns.push(Column {
            name: "second against first",
            unit: "%",
            cells: Cells::Numbers(&change),
        });
    }
    let note = "Units are the endings of the names.";
    if headlines {
        page.table("Headline figures", note, &columns)
    } else {
        page.folded_table("All other figures", note, &columns)
    }
}

/// A lap on the way into the page: what it has at places that rise.
struct Lap<'a> {
    trace: &'a Trace,
    /// Rows whose station is beyond all before it: what came from elsewhere may not rise.
    rows: Vec<usize>,
    station_m: Vec<f64>,
}

impl<'a> Lap<'a> {
    fn new(trace: &'a Trace) -> Option<Self> {
        let station = trace.column(&["station", "distance"])?;
        let mut rows = Vec::new();
        let mut last = f64::NEG_INFINITY;
        for (i, &s) in station.iter().enumerate() {
            if s > last {
                rows.push(i);
                last = s;
            }
        }
        let station_m: Vec<f64> = rows.iter().map(|&i| station[i]).collect();
        (rows.len() > 1).then_some(Self {
            trace,
            rows,
            station_m,
        })
    }

    fn column(&self, names: &[&str]) -> Option<Vec<f64>> {
        let values = self.trace.column(names)?;
        self.rows.iter().map(|&i| values.get(i).copied()).collect()
    }

    fn length_m(&self) -> f64 {
        self.station_m.last().copied().unwrap_or(f64::NAN)
    }

    /// Time since the start (s) where a share of the stations is behind.
    fn clock(&self) -> Option<impl Fn(f64) -> f64> {
        let (time, station, length) = (self.column(&["time"])?, self.station_m.clone(), self.length_m());
        Some(move |share: f64| {
            let at = share * length;
            let after = station.partition_point(|s| *s <= at).clamp(1, station.len() - 1);
            let (s0, s1) = (station[after - 1], station[after]);
            time[after - 1] + (at - s0) / (s1 - s0) * (time[after] - time[after - 1])
        })
    }
}

/// Lines of one circuit differ by less than this share in length.
const ONE_CIRCUIT: f64 = 0.06;

fn laps(page: &mut HtmlReport, runs: &[Run], names: &[String]) -> Result<()> {
    let best: Vec<(&Run, String, &Trace)> = runs
        .iter()
        .zip(names)
        .filter_map(|(run, name)| {
            let trace = run.traces.first()?;
            Some((run, format!("{name}: {}", said_of(&trace.name)), trace))
        })
        .collect();
    let Some((first, _, trace)) = best.first() else {
        return Ok(());
    };
    let length_m = Lap::new(trace).map_or(f64::NAN, |lap| lap.length_m());
    let track = first.said("track");
    let alike = |run: &Run, trace: &Trace| {
        let length = Lap::new(trace).map_or(f64::NAN, |lap| lap.length_m());
        run.said("track")
            .is_none_or(|t| track.is_none_or(|first| first == t))
            && (length / length_m - 1.0).abs() < ONE_CIRCUIT
    };
    let one_track = best.iter().all(|(run, _, trace)| alike(run, trace));
    let road = best.iter().find_map(|(run, ..)| run.road.as_ref());
    let labelled: Vec<(&str, &Trace)> = best.iter().map(|(_, label, t)| (label.as_str(), *t)).collect();
    page.section(
        "Laps",
        "The quickest line of each run, or what it fitted to its log.",
    );
    overlay(page, &labelled, road, one_track)
}

/// Lays laps over one another: the traces that two of them share, or the only one has, the time that each loses on the
/// first and, if all are of `one_track`, where they lie on the `road`.
pub(crate) fn overlay(
    page: &mut HtmlReport,
    named: &[(&str, &Trace)],
    road: Option<&Trace>,
    one_track: bool,
) -> Result<()> {
    let laps: Vec<(&str, Lap<'_>)> = named
        .iter()
        .filter_map(|(name, trace)| Some((*name, Lap::new(trace)?)))
        .collect();
    let enough = laps.len().min(2);
    let has = |panel: &usize| {
        let with = laps
            .iter()
            .filter(|(_, lap)| lap.trace.column(PANELS[*panel].0).is_some());
        with.count() >= enough
    };
    let panels: Vec<usize> = (0..PANELS.len()).filter(has).collect();
    let Some((_, first)) = laps.first().filter(|_| !panels.is_empty()) else {
        return Ok(());
    };
    let alone = laps.len() == 1;
    // A lap alone loses no time on another.
    let clock = if one_track && !alone { first.clock() } else { None };
    let lines: Vec<LapLine<'_>> = laps
        .iter()
        .map(|(name, lap)| {
            let stretch = if one_track {
                first.length_m() / lap.length_m()
            } else {
                1.0
            };
            let row = |(row, &panel): (usize, &usize)| {
                Some(LapTrace {
                    panel: row,
                    values: lap.column(PANELS[panel].0)?,
                    band: None,
                })
            };
            let mut traces: Vec<LapTrace<'_>> = panels.iter().enumerate().filter_map(row).collect();
            if let (Some(first), Some(mine)) = (&clock, lap.clock()) {
                let lost = |s: &f64| mine(s / lap.length_m()) - first(s / lap.length_m());
                traces.push(LapTrace {
                    panel: panels.len(),
                    values: lap.station_m.iter().map(lost).collect(),
                    band: None,
                });
            }
            let place = lap.column(&["x"]).zip(lap.column(&["y"])).filter(|_| one_track);
            LapLine {
                name,
                x: lap.station_m.iter().map(|s| s * stretch).collect(),
                traces,
                place_m: place.map_or(Vec::new(), |(x, y)| {
                    x.into_iter().zip(y).map(DVec2::from).collect()
                }),
                wide: false,
            }
        })
        .filter(|line| !line.traces.is_empty())
        .collect();
    let mut rows: Vec<LapPanel<'_>> = panels
        .iter()
        .map(|&panel| LapPanel {
            label: PANELS[panel].1,
            unit: PANELS[panel].2,
            height: 1.0,
        })
        .collect();
    rows.extend(clock.as_ref().map(|_| LapPanel {
        label: "time lost",
        unit: "s",
        height: 1.0,
    }));
    let mapped = lines.iter().any(|line| !line.place_m.is_empty());
    let edges = road.and_then(edges).unwrap_or_default();
    page.lap(&LapView {
        title: if alone { "The lap" } else { "Laps over one another" },
        note: if alone {
            ""
        } else if one_track {
            "Distances are stretched to the first lap's length, so that what is beside each other on the road stands above \
             each other; time lost is against that lap."
        } else {
            "The laps are of different tracks: only their distances are shared."
        },
        x_label: "distance",
        x_unit: "m",
        panels: rows,
        lines,
        map: mapped.then(|| LapMap {
            left_edge_m: &edges[0],
            right_edge_m: &edges[1],
            closed: true,
            names: Vec::new(),
        }),
        ..LapView::default()
    })
}

/// Left and right edge of a road (m), from its line and the widths at right angles to it.
fn edges(road: &Trace) -> Option<[Vec<DVec2>; 2]> {
    let [x, y] = [road.column(&["x_m"])?, road.column(&["y_m"])?];
    let [right, left] = [road.column(&["w_tr_right_m"])?, road.column(&["w_tr_left_m"])?];
    let n = [x.len(), y.len(), right.len(), left.len()].into_iter().min()?;
    let at = |i: usize| DVec2::new(x[i % n], y[i % n]);
    let edge = |widths: &[f64], side: f64| -> Vec<DVec2> {
        (0..n)
            .map(|i| at(i) + side * widths[i] * (at(i + 1) - at(i + n - 1)).normalize_or_zero().perp())
            .collect()
    };
    (n > 2).then(|| [edge(left, 1.0), edge(right, -1.0)])
}

/// What a file's name says of its line: `line_least_curved` is `least curved`.
fn said_of(stem: &str) -> String {
    match stem.strip_prefix("line_") {
        Some(line) => line.replace('_', " "),
        None if stem == "drive" => "driven".to_owned(),
        None if stem == "lap" => "logged".to_owned(),
        None => "fitted".to_owned(),
    }
}

fn curves_of<'a>(
    runs: &[Run],
    names: &'a [String],
    of: fn(&Run) -> Option<&Trace>,
    [x, y]: [&[&str]; 2],
) -> Vec<Curve<'a>> {
    let curve = |(run, name): (&Run, &'a String)| {
        let table = of(run)?;
        let (x, y) = (table.column(x)?.to_vec(), table.column(y)?.to_vec());
        (x.len() == y.len() && y.iter().any(|v| v.is_finite())).then_some(Curve {
            label: name,
            x,
            y,
            shade: None,
        })
    };
    runs.iter().zip(names).filter_map(curve).collect()
}

fn limits(page: &mut HtmlReport, runs: &[Run], names: &[String]) -> Result<()> {
    let panels = [
        ("Cornering", "ay_mps2"),
        ("Braking grip", "ax_grip_mps2"),
        ("Drive", "ax_drive_mps2"),
        ("Drag", "drag_mps2"),
    ];
    let mut begun = false;
    for (title, column) in panels {
        let curves = curves_of(runs, names, |r| r.envelope.as_ref(), [&["v_mps"], &[column]]);
        if curves.is_empty() {
            continue;
        }
        if !std::mem::replace(&mut begun, true) {
            page.section("Limits over speed", "");
        }
        let panel = CurvePanel {
            title,
            x_label: "speed (m/s)",
            y_label: "acceleration (m/s\u{b2})",
            curves,
        };
        page.curves(&panel, "", [Scale::Linear; 2])?;
    }
    Ok(())
}

fn convergence(page: &mut HtmlReport, runs: &[Run], names: &[String]) -> Result<()> {
    let curves = curves_of(
        runs,
        names,
        |r| r.convergence.as_ref(),
        [&["evaluations"], &["best"]],
    );
    if curves.is_empty() {
        return Ok(());
    }
    page.section("Convergence", "");
    let panel = CurvePanel {
        title: "Cost of the swarms' best",
        x_label: "candidates evaluated",
        y_label: "cost",
        curves,
    };
    page.curves(&panel, "", [Scale::Linear, Scale::Log])
}
