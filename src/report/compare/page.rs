//! The page that lays runs side by side.

use super::read::{Run, Trace};
use crate::error::{Error, Result};
use crate::report::{
    CornerLap, Curves, HtmlReport, LapLine, LapView, Panel, Road, Scale, Table, significant,
};
use glam::DVec2;
use std::collections::{HashMap, HashSet};

/// Runs that a page takes at most: more lines than colours cannot be told apart.
const MOST_RUNS: usize = 24;
/// Figures worth a look first, by how their names begin.
const HEADLINES: [&str; 18] = [
    "total_parameter_error",
    "swarm_total_parameter_error",
    "rms_error",
    "holdout_rms_error",
    "best",
    "above_exact_percent",
    "hypervolume",
    "front_size",
    "lap_time_s",
    "clearance_m",
    "point_mass_lap_time_s",
    "grip_share",
    "disagreement_percent",
    "scenarios",
    "top_speed_mps",
    "understeer_gradient_deg_per_g",
    "stability_factor_s2_per_m2",
    "static_margin",
];
/// Figures of a best line that are: those on the fine spline, where there are two.
const BEST: [&str; 5] = [
    "lap_time_fine_s",
    "clearance_m",
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

/// A run, and its name on the page.
type Named<'a> = (String, &'a Run);

/// Lays runs side by side: what they are, their figures, and their laps, limits and convergence over one another.
///
/// # Errors
/// [`Error::Input`] for no run, or more than can be told apart.
pub fn compare(runs: &[Run]) -> Result<HtmlReport> {
    if runs.is_empty() || runs.len() > MOST_RUNS {
        let (found, expected) = (runs.len().to_string(), format!("1 to {MOST_RUNS}"));
        return Err(Error::input("the comparison", "runs", found, expected));
    }
    let runs = &named(runs)[..];
    let title = match runs {
        [(one, _)] => one.clone(),
        [(first, _), (second, _)] => format!("{first} beside {second}"),
        [(first, _), .., (last, _)] => format!("{} runs, {first} to {last}", runs.len()),
        [] => String::new(),
    };
    let mut page = HtmlReport::new("report", &title);
    head(&mut page, runs);
    laps(&mut page, runs)?;
    page.section("Runs", "");
    page.table("What was run", "", &about(runs))?;
    let note = "Units are the endings of the names.";
    if let Some(table) = figures(runs, true) {
        page.table("Headline figures", note, &table)?;
    }
    let envelopes = runs.iter().map(|(name, run)| (&**name, run.envelope.as_ref()));
    let limits = limits("Limits over speed", &LIMITS, envelopes);
    if !limits.is_empty() {
        page.section("Limits over speed", "");
        page.place(&limits)?;
    }
    convergence(&mut page, runs)?;
    if let Some(table) = figures(runs, false) {
        page.folded_table("All other figures", note, &table)?;
    }
    for (name, run) in runs {
        page.provenance(name, run.folder.display().to_string());
        if let Some(settings) = &run.settings {
            page.settings(&format!("study.toml of {name}"), settings);
        }
    }
    Ok(page)
}

/// Runs by their folders' names, with their paths where two are the same.
fn named(runs: &[Run]) -> Vec<Named<'_>> {
    let twice = |name: &str| runs.iter().filter(|r| r.name == name).count() > 1;
    let name = |r: &Run| match twice(&r.name) {
        true => r.folder.display().to_string(),
        false => r.name.clone(),
    };
    runs.iter().map(|run| (name(run), run)).collect()
}

/// What a run is judged by, where one number says it: its name, words for it, its unit.
fn verdict(run: &Run) -> Option<(&'static str, &'static str, &'static str)> {
    match run.study.as_str() {
        "identify" => Some(("total_parameter_error", "total parameter error", "")),
        "raceline" => Some(("best / lap_time / lap_time_fine_s", "lap time", "s")),
        // Of set-ups, the fastest.
        "transient" if run.figure("best / lap_time_s").is_some() => {
            Some(("best / lap_time_s", "fastest driven lap", "s"))
        }
        "transient" => Some(("lap_time_s", "driven lap", "s")),
        "simulate" => Some(("lap_time_s", "logged lap", "s")),
        "envelope" => Some(("top_speed_mps", "top speed", "m/s")),
        _ => None,
    }
}

/// How far beyond an edge a car counts as off the road (m).
const OFF_ROAD_M: f64 = 0.01;

/// Best lines of a run that leave the road: by which objective, and how far (m).
fn off_road(run: &Run) -> Vec<(&str, f64)> {
    let beyond = run.figures.iter().filter_map(|figure| {
        let line = figure
            .name
            .strip_prefix("best / ")?
            .strip_suffix(" / clearance_m")?;
        (figure.value < -OFF_ROAD_M).then_some((line, -figure.value))
    });
    beyond.collect()
}

fn head(page: &mut HtmlReport, runs: &[Named<'_>]) {
    let mut studies: Vec<&str> = runs.iter().map(|(_, r)| r.study.as_str()).collect();
    studies.sort_unstable();
    studies.dedup();
    for study in studies {
        let of: Vec<&Named<'_>> = runs.iter().filter(|(_, r)| r.study == study).collect();
        let plural = if of.len() == 1 { "run" } else { "runs" };
        let mut sentence = format!("{} {plural} of {study}", of.len());
        let judged = of.iter().filter_map(|(name, r)| {
            let (figure, words, unit) = verdict(r)?;
            let off = if off_road(r).is_empty() {
                ""
            } else {
                " off the road"
            };
            let unit = format!("{unit}{off}");
            Some((name, words, significant(r.figure(figure)?, 6), unit))
        });
        let mut said = "";
        for (name, words, value, unit) in judged {
            sentence += &if words == said {
                ", ".to_owned()
            } else {
                format!(", by {words}: ")
            };
            said = words;
            sentence += format!("{name} {value} {unit}").trim_end();
            page.tile(&format!("{name}, {words}"), value, &unit);
        }
        page.sentence(sentence + ".");
    }
    for (name, run) in runs {
        for (line, beyond_m) in off_road(run) {
            page.warning(format!(
                "{name}: on the best line by {line} the car is {beyond_m:.2} m off the road. Its figures are those of no lap."
            ));
        }
    }
    for (name, _) in runs
        .iter()
        .filter(|(_, r)| r.manifest_text("interrupted") == Some("true"))
    {
        page.warning(format!(
            "{name} was interrupted. Its figures are the results that it had reached."
        ));
    }
}

fn about(runs: &[Named<'_>]) -> Table<'static> {
    let keys = [
        "study", "track", "car", "log", "seed", "backend", "adapter", "driver", "version",
    ];
    let table = Table::rows(runs).text("run", |(name, _)| name);
    let table = keys.iter().fold(table, |t, key| {
        t.text(*key, |(_, r)| r.manifest_text(key).unwrap_or(""))
    });
    table.table().without_empty()
}

fn is_headline(name: &str) -> bool {
    let first = name.split(" / ").next().unwrap_or(name);
    let last = name.rsplit(" / ").next().unwrap_or(name);
    HEADLINES.contains(&first) && (first != "best" || BEST.contains(&last))
}

/// The numbers of the summaries: the headlines, or all others; nothing if there are none.
fn figures(runs: &[Named<'_>], headlines: bool) -> Option<Table<'static>> {
    let mut known = HashSet::new();
    let all = runs.iter().flat_map(|(_, r)| &r.figures).map(|f| f.name.as_str());
    let table = Table::rows(all.filter(|name| known.insert(*name) && is_headline(name) == headlines))
        .text("figure", |name| *name);
    if table.is_empty() {
        return None;
    }
    let by_name: Vec<HashMap<&str, f64>> = runs
        .iter()
        .map(|(_, r)| r.figures.iter().map(|f| (f.name.as_str(), f.value)).collect())
        .collect();
    let table = runs.iter().zip(&by_name).fold(table, |table, ((name, _), of)| {
        table.number(name, "", |row| of.get(row).copied())
    });
    // With two runs the difference is what one looks for.
    Some(match by_name.as_slice() {
        [a, b] => table
            .number("second against first", "%", |row| {
                let (a, b) = (a.get(row)?, b.get(row)?);
                Some(100.0 * (b - a) / a.abs())
            })
            .table(),
        _ => table.table(),
    })
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

fn laps(page: &mut HtmlReport, runs: &[Named<'_>]) -> Result<()> {
    let best: Vec<(&Run, String, &Trace)> = runs
        .iter()
        .filter_map(|(name, run)| {
            let trace = run.traces.first()?;
            Some((*run, format!("{name}: {}", words_of(&trace.name)), trace))
        })
        .collect();
    let Some((first, _, trace)) = best.first() else {
        return Ok(());
    };
    let length_of = |trace| Lap::new(trace).map_or(f64::NAN, |lap| lap.length_m());
    let (length_m, track) = (length_of(trace), first.manifest_text("track"));
    let alike = |run: &Run, trace| {
        let other_track = run
            .manifest_text("track")
            .zip(track)
            .is_some_and(|(own, first)| own != first);
        !other_track && (length_of(trace) / length_m - 1.0).abs() < ONE_CIRCUIT
    };
    let one_track = best.iter().all(|(run, _, trace)| alike(run, trace));
    let road = best.iter().find_map(|(run, ..)| run.road.as_ref());
    let labelled: Vec<(&str, &Trace)> = best.iter().map(|(_, label, t)| (label.as_str(), *t)).collect();
    page.section(
        "Laps",
        "The quickest line of each run, or what it fitted to its log.",
    );
    if one_track {
        corners(page, &labelled, length_m)?;
    }
    overlay(page, &labelled, road, one_track)
}

/// Laps of one track by corner and sector, against the first.
fn corners(page: &mut HtmlReport, named: &[(&str, &Trace)], length_m: f64) -> Result<()> {
    let laps = named.iter().filter_map(|(name, trace)| {
        let lap = Lap::new(trace)?;
        let v = lap.column(PANELS[0].0)?;
        let ay = lap.column(PANELS[2].0).or_else(|| {
            let yaw_rate = lap.column(PANELS[3].0)?;
            Some(yaw_rate.iter().zip(&v).map(|(r, v)| r * v).collect())
        })?;
        let corners = CornerLap::new(name, &lap.station_m, &v, &ay, length_m / lap.length_m())?;
        let gear = lap.column(&["gear"]).unwrap_or_default();
        let grip = lap.column(&["grip_used"]).unwrap_or_default();
        Some(corners.gears(&gear).grip_used(&grip))
    });
    page.corners(&laps.collect::<Vec<_>>(), &[])
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
    let mut placed = false;
    let lines: Vec<LapLine> = laps
        .iter()
        .map(|(name, lap)| {
            let length_m = lap.length_m();
            let stretch = if one_track {
                first.length_m() / length_m
            } else {
                1.0
            };
            let place = lap.column(&["x"]).zip(lap.column(&["y"])).filter(|_| one_track);
            placed |= place.is_some();
            let place = place.into_iter().flat_map(|(x, y)| x.into_iter().zip(y));
            let x: Vec<f64> = lap.station_m.iter().map(|s| s * stretch).collect();
            let line = LapLine::new(*name, x).at(place.map(DVec2::from).collect::<Vec<_>>());
            let line = panels.iter().enumerate().fold(line, |line, (row, &panel)| {
                line.maybe(row, lap.column(PANELS[panel].0))
            });
            let lost = clock.as_ref().zip(lap.clock()).map(|(first, mine)| {
                let shares = lap.station_m.iter().map(|s| s / length_m);
                shares.map(|share| mine(share) - first(share)).collect()
            });
            line.maybe(panels.len(), lost)
        })
        .filter(|line| !line.is_empty())
        .collect();
    let title = if alone { "The lap" } else { "Laps over one another" };
    let note = if alone {
        ""
    } else if one_track {
        "Distances are stretched to the length of the first lap, so that what lies side by side on the road stands one above \
         the other. Time lost is against that lap."
    } else {
        "The laps are of different tracks. Only their distances are shared."
    };
    let [left_edge_m, right_edge_m] = road.and_then(edges).unwrap_or_default();
    let road = Road {
        left_edge_m,
        right_edge_m,
        closed: true,
        names: Vec::new(),
    };
    page.place(
        &LapView::new(title)
            .note(note)
            .panels(panels.iter().map(|&panel| (PANELS[panel].1, PANELS[panel].2)))
            .panels(clock.as_ref().map(|_| ("time lost", "s")))
            .lines(lines)
            .road(placed.then_some(road)),
    )
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

/// What a file's name says of its line.
fn words_of(stem: &str) -> String {
    match stem.strip_prefix("line_") {
        Some("least_curved") => "minimum-curvature".to_owned(),
        Some(line) => line.replace('_', " "),
        None if stem == "drive" => "driven".to_owned(),
        None if stem == "lap" => "logged".to_owned(),
        None => "fitted".to_owned(),
    }
}

/// A panel of a column over another, a curve for each table that has both.
fn over<'a>(
    panel: Panel,
    tables: impl Iterator<Item = (&'a str, Option<&'a Trace>)>,
    [x, y]: [&str; 2],
) -> Panel {
    tables.fold(panel, |panel, (name, table)| {
        let columns = table.and_then(|table| table.column(&[x]).zip(table.column(&[y])));
        let sound = |(x, y): &(&[f64], &[f64])| x.len() == y.len() && y.iter().any(|v| v.is_finite());
        match columns.filter(sound) {
            Some((x, y)) => panel.curve(name, x, y),
            None => panel,
        }
    })
}

/// What a g-g-v envelope has over speed: a title, and the name of its column.
pub(crate) const LIMITS: [(&str, &str); 4] = [
    ("Cornering", "ay_mps2"),
    ("Braking grip", "ax_grip_mps2"),
    ("Drive", "ax_drive_mps2"),
    ("Drag", "drag_mps2"),
];

/// Some of the [`LIMITS`] of several envelopes over speed.
pub(crate) fn limits<'a>(
    title: &str,
    of: &[(&str, &str)],
    envelopes: impl Iterator<Item = (&'a str, Option<&'a Trace>)> + Clone,
) -> Curves {
    let panels = of.iter().map(|(title, column)| {
        let panel = Panel::new(*title)
            .x("speed", "m/s")
            .y("acceleration", "m/s\u{b2}");
        over(panel, envelopes.clone(), ["v_mps", column])
    });
    Curves::new(title, panels.filter(Panel::has_points))
}

fn convergence(page: &mut HtmlReport, runs: &[Named<'_>]) -> Result<()> {
    let panel = Panel::new("Cost of the swarms' best")
        .x("candidates evaluated", "")
        .y("cost", "")
        .scales(Scale::Linear, Scale::Log);
    let tables = runs.iter().map(|(name, run)| (&**name, run.convergence.as_ref()));
    let panel = over(panel, tables, ["evaluations", "best"]);
    if !panel.has_points() {
        return Ok(());
    }
    page.section("Convergence", "");
    page.place(&Curves::new("Convergence", [panel]))
}
