//! Charge, power, energy, engine sites, maps and traces.

use super::told_laps;
use crate::error::Result;
use crate::files::stem;
use crate::report::{
    Curve, CurvePanel, Objective, SiteMap, TrackMap, plot_curves, plot_pareto, plot_site_map, plot_track_map,
};
use crate::study::hybrid::{HybridSetup, HybridStudySettings, Outcome, ReportedLap, StrategyFront, Worth};
use glam::DVec2;
use std::path::Path;

const DISTANCE: &str = "distance (m)";

pub fn draw(
    folder: &Path,
    settings: &HybridStudySettings,
    setup: &HybridSetup,
    outcome: &Outcome,
) -> Result<()> {
    for lap in told_laps(outcome).into_iter().skip(1) {
        draw_lap(
            &folder.join(format!("energy_{}.svg", stem(&lap.name))),
            setup,
            outcome,
            lap,
        )?;
    }
    draw_charges(&folder.join("charge.svg"), setup, outcome)?;
    // The best deployment if there is one, else the last scenario.
    let shown = match &outcome.optimised {
        Some(o) => Some(&o.swarm.lap),
        None => outcome.scenarios.last().map(|s| &s.own),
    };
    if let Some(lap) = shown {
        draw_map(&folder.join("map.svg"), setup, lap)?;
        draw_traces(&folder.join("traces.svg"), setup, outcome, lap)?;
        draw_sites(&folder.join("engine_sites.svg"), setup, &outcome.engine, lap)?;
    }
    if let Some(o) = &outcome.optimised {
        draw_time_energy(&folder.join("time_energy.svg"), outcome)?;
        if !o.worth.is_empty() {
            draw_worth(&folder.join("worth.svg"), outcome, &o.worth)?;
        }
        if let Some(front) = o.swarm_front.as_ref().filter(|f| f.objectives.len() > 1) {
            draw_front(folder, settings, front)?;
        }
    }
    Ok(())
}

/// Power at the wheels (kW) of a force over the mass (m/s^2), segment by segment.
pub fn power_kw(
    setup: &HybridSetup,
    lap: &ReportedLap,
    force: impl Fn(&crate::line::energy::SegmentEnergy<f64>) -> f64,
) -> Vec<f64> {
    let mass = setup.car.table.mass;
    let rows = lap.segments.iter().zip(&lap.length_m);
    rows.map(|(s, h)| mass * force(s) * h / s.time / 1e3).collect()
}

pub fn soc(setup: &HybridSetup, lap: &ReportedLap) -> Vec<f64> {
    let store = &setup.car.hybrid.store;
    lap.change_j()[1..]
        .iter()
        .map(|change| store.start_soc + change / store.capacity_j)
        .collect()
}

/// Running sum, MJ.
pub fn summed(values: impl Iterator<Item = f64>) -> Vec<f64> {
    values
        .scan(0.0, |sum, x| {
            *sum += x / 1e6;
            Some(*sum)
        })
        .collect()
}

fn curve<'a>(label: &'a str, lap: &ReportedLap, y: Vec<f64>) -> Curve<'a> {
    Curve {
        label,
        x: lap.station_m.clone(),
        y,
        shade: None,
    }
}

/// Charge, motor and regeneration power, cumulated flows and speed of one lap.
fn draw_lap(path: &Path, setup: &HybridSetup, outcome: &Outcome, lap: &ReportedLap) -> Result<()> {
    let rules = setup
        .car
        .hybrid
        .rules
        .deployed_on(setup.length_m)
        .map(|j| j / 1e6);
    let mut flows = vec![
        curve("out", lap, summed(lap.segments.iter().map(|s| s.deployed))),
        curve(
            "MGU-K in",
            lap,
            summed(lap.segments.iter().map(|s| s.harvested_k)),
        ),
        curve(
            "MGU-H in",
            lap,
            summed(lap.segments.iter().map(|s| s.harvested_h)),
        ),
    ];
    if let Some(most) = rules {
        flows.push(curve("allowed out", lap, vec![most; lap.segments.len()]));
    }
    let panels = [
        CurvePanel {
            title: "State of charge",
            x_label: DISTANCE,
            y_label: "share of the store",
            curves: vec![curve("", lap, soc(setup, lap))],
        },
        CurvePanel {
            title: "Power at the wheels",
            x_label: DISTANCE,
            y_label: "power (kW)",
            curves: vec![
                curve("motor", lap, power_kw(setup, lap, |s| s.motor)),
                curve("regeneration", lap, power_kw(setup, lap, |s| -s.generator)),
            ],
        },
        CurvePanel {
            title: "Energy since the start line",
            x_label: DISTANCE,
            y_label: "energy (MJ)",
            curves: flows,
        },
        CurvePanel {
            title: "Speed",
            x_label: DISTANCE,
            y_label: "speed (m/s)",
            curves: vec![
                curve("engine alone", &outcome.engine, speeds(&outcome.engine)),
                curve("with the motor", lap, speeds(lap)),
            ],
        },
    ];
    let title = format!(
        "{}, {} ({}): {:.3} s, {:.2} MJ out, {:.3} l",
        setup.raceline.track_name,
        lap.name.replace('_', " "),
        lap.mode.name(),
        lap.lap.time,
        lap.lap.deployed / 1e6,
        lap.lap.fuel / setup.car.fuel_density_kgpl
    );
    plot_curves(path, &title, &panels)
}

pub fn speeds(lap: &ReportedLap) -> Vec<f64> {
    lap.segments.iter().map(|s| s.start.sqrt()).collect()
}

/// The charge of every scenario.
fn draw_charges(path: &Path, setup: &HybridSetup, outcome: &Outcome) -> Result<()> {
    let laps: Vec<&ReportedLap> = outcome.scenarios.iter().map(|s| &s.own).collect();
    if laps.is_empty() {
        return Ok(());
    }
    let names: Vec<String> = laps.iter().map(|l| l.name.replace('_', " ")).collect();
    let panel = CurvePanel {
        title: "State of charge",
        x_label: DISTANCE,
        y_label: "share of the store",
        curves: laps
            .iter()
            .enumerate()
            .map(|(i, lap)| curve(&names[i], lap, soc(setup, lap)))
            .collect(),
    };
    let out = CurvePanel {
        title: "Energy out of the store",
        x_label: DISTANCE,
        y_label: "energy (MJ)",
        curves: laps
            .iter()
            .enumerate()
            .map(|(i, lap)| curve(&names[i], lap, summed(lap.segments.iter().map(|s| s.deployed))))
            .collect(),
    };
    plot_curves(
        path,
        &format!("{}: scenarios", setup.raceline.track_name),
        &[panel, out],
    )
}

/// Names to write on a map, and their places (m).
pub fn map_names(setup: &HybridSetup) -> Vec<(&str, DVec2)> {
    let road = &setup.raceline.road;
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

/// Deployment and harvest on the circuit.
fn draw_map(path: &Path, setup: &HybridSetup, lap: &ReportedLap) -> Result<()> {
    let mut values = power_kw(setup, lap, |s| s.motor - s.generator);
    values.resize(setup.points_m.len(), f64::NAN);
    plot_track_map(
        path,
        &TrackMap {
            title: &format!(
                "{}, {}: {:.2} MJ out, {:.2} MJ in",
                setup.raceline.track_name,
                lap.name.replace('_', " "),
                lap.lap.deployed / 1e6,
                (lap.lap.harvested_k + lap.lap.harvested_h) / 1e6
            ),
            left_edge_m: &setup.raceline.edges_m[1],
            right_edge_m: &setup.raceline.edges_m[0],
            line_m: &setup.points_m,
            values: &values,
            value_label: "power",
            value_unit: "kW",
            closed: setup.closed,
            names: map_names(setup),
        },
    )
}

/// Speed of engine alone and hybrid, the time between them, and what of the power the motor gives.
fn draw_traces(path: &Path, setup: &HybridSetup, outcome: &Outcome, lap: &ReportedLap) -> Result<()> {
    let engine = &outcome.engine;
    let elapsed = |lap: &ReportedLap| summed(lap.segments.iter().map(|s| 1e6 * s.time));
    let gained: Vec<f64> = elapsed(engine)
        .iter()
        .zip(elapsed(lap))
        .map(|(a, b)| a - b)
        .collect();
    let faster: Vec<f64> = speeds(lap)
        .iter()
        .zip(speeds(engine))
        .map(|(a, b)| a - b)
        .collect();
    let name = lap.name.replace('_', " ");
    let total = power_kw(setup, lap, |s| s.engine + s.motor);
    let most = total.iter().fold(1.0, |a: f64, b| a.max(*b));
    let share = |values: Vec<f64>| values.into_iter().map(|p| p / most).collect::<Vec<f64>>();
    let panels = [
        CurvePanel {
            title: "Speed",
            x_label: DISTANCE,
            y_label: "speed (m/s)",
            curves: vec![
                curve("engine alone", engine, speeds(engine)),
                curve(&name, lap, speeds(lap)),
            ],
        },
        CurvePanel {
            title: "Faster than by the engine alone",
            x_label: DISTANCE,
            y_label: "speed (m/s)",
            curves: vec![curve("", lap, faster)],
        },
        CurvePanel {
            title: "Time gained on the engine alone",
            x_label: DISTANCE,
            y_label: "time (s)",
            curves: vec![curve("", lap, gained)],
        },
        CurvePanel {
            title: "Power as a share of its greatest",
            x_label: DISTANCE,
            y_label: "share",
            curves: vec![
                curve("both", lap, share(total)),
                curve("motor", lap, share(power_kw(setup, lap, |s| s.motor))),
            ],
        },
    ];
    let title = format!(
        "{}: {:.3} s by the engine alone, {:.3} s as {name}",
        setup.raceline.track_name, engine.lap.time, lap.lap.time
    );
    plot_curves(path, &title, &panels)
}

/// Consumption beyond which the map is not told apart (g/kWh).
const MOST_GPKWH: f64 = 500.0;
/// Cells of the map of consumption, across and up.
const CELLS: (usize, usize) = (180, 120);
/// Segments for each dot.
const THINNED: usize = 3;

/// Where the engine works, over its specific consumption.
fn draw_sites(path: &Path, setup: &HybridSetup, engine_lap: &ReportedLap, lap: &ReportedLap) -> Result<()> {
    let Some(powertrain) = &setup.car.car.powertrain else {
        return Ok(());
    };
    let Some(engine) = &powertrain.engine else {
        return Ok(());
    };
    let radius = setup.car.car.chassis.radius_rear;
    let sites = |lap: &ReportedLap| -> Vec<(f64, f64)> {
        let power = power_kw(setup, lap, |s| s.engine);
        let rows = lap.segments.iter().zip(power).filter(|(_, p)| *p > 1.0);
        rows.step_by(THINNED)
            .filter_map(|(s, kilowatts)| {
                let v = (0.5 * (s.start + s.end)).sqrt();
                let point = powertrain.operating_point(v, 1e3 * kilowatts, radius)?;
                Some((point.gear.engine_speed_rpm, point.torque_nm))
            })
            .collect()
    };
    let families = [sites(engine_lap), sites(lap)];
    let speeds = &engine.engine_speed_rpm;
    let slowest = families.iter().flatten().map(|s| s.0).fold(speeds[0], f64::min);
    let x = ((slowest / 500.0).floor() * 500.0, speeds[speeds.len() - 1]);
    let greatest = speeds
        .iter()
        .map(|rpm| engine.greatest_torque(*rpm).0)
        .fold(0.0, f64::max);
    let y = (0.0, 1.04 * greatest);
    let cells: Vec<Vec<f64>> = (0..CELLS.1)
        .map(|j| {
            let torque = y.1 * (j as f64 + 0.5) / CELLS.1 as f64;
            (0..CELLS.0)
                .map(|i| {
                    let rpm = x.0 + (x.1 - x.0) * (i as f64 + 0.5) / CELLS.0 as f64;
                    if torque > engine.greatest_torque(rpm).0 || rpm < speeds[0] {
                        return f64::NAN;
                    }
                    let throttle = engine.throttle_for(rpm, torque);
                    engine
                        .bsfc_gpkwh(rpm, throttle)
                        .map_or(f64::NAN, |b| b.min(MOST_GPKWH))
                })
                .collect()
        })
        .collect();
    let name = lap.name.replace('_', " ");
    let [alone, hybrid] = families;
    plot_site_map(
        path,
        &SiteMap {
            title: "Where the engine works",
            x_label: "engine speed (rpm)",
            y_label: "torque (N m)",
            x,
            y,
            cells: &cells,
            value_label: "consumption",
            value_unit: "g/kWh",
            sites: vec![("engine alone", alone), (&name, hybrid)],
        },
    )
}

/// Time against energy: the exact optima, the swarm's front, the scenarios with the motor beside the engine.
fn draw_time_energy(path: &Path, outcome: &Outcome) -> Result<()> {
    plot_curves(path, "Time against energy", &time_energy(outcome))
}

/// Its panels; none without a deployment.
pub fn time_energy(outcome: &Outcome) -> Vec<CurvePanel<'static>> {
    let Some(o) = &outcome.optimised else {
        return Vec::new();
    };
    let mut exact: Vec<(f64, f64)> = o
        .front
        .iter()
        .map(|p| (p.budget_j, p.deployment.lap.time))
        .chain([(o.budget_j, o.exact.lap.time)])
        .collect();
    exact.sort_by(|a, b| a.0.total_cmp(&b.0));
    let line = |label, points: Vec<(f64, f64)>| Curve {
        label,
        x: points.iter().map(|p| p.0 / 1e6).collect(),
        y: points.iter().map(|p| p.1).collect(),
        shade: None,
    };
    // A curve of gaps is dots.
    let dots = |label, points: Vec<(f64, f64)>| {
        let spaced = points.iter().flat_map(|p| [*p, (p.0, f64::NAN)]).collect();
        line(label, spaced)
    };
    let scenarios = outcome
        .scenarios
        .iter()
        .map(|s| (s.additional.lap.deployed, s.additional.lap.time));
    let marginal: Vec<(f64, f64)> = exact
        .windows(2)
        .filter(|w| w[1].0 > w[0].0)
        .map(|w| {
            (
                0.5 * (w[0].0 + w[1].0),
                (w[0].1 - w[1].1) / (w[1].0 - w[0].0) * 1e6,
            )
        })
        .collect();
    let mut panels = vec![CurvePanel {
        title: "Lap time against energy out of the store in a lap",
        x_label: "energy (MJ)",
        y_label: "lap time (s)",
        curves: vec![
            line("exact optimum (energy allowed)", exact),
            dots("scenarios (energy used)", scenarios.collect()),
            dots(
                "swarm (energy used)",
                vec![(o.swarm.lap.lap.deployed, o.swarm.lap.lap.time)],
            ),
        ],
    }];
    if !marginal.is_empty() {
        panels.push(CurvePanel {
            title: "What a further megajoule buys",
            x_label: "energy allowed (MJ)",
            y_label: "time (s/MJ)",
            curves: vec![line("", marginal)],
        });
    }
    panels
}

/// What a megajoule buys by the speed at which it is deployed, and along the lap.
fn draw_worth(path: &Path, outcome: &Outcome, worth: &[Worth]) -> Result<()> {
    let dots = |label, along: fn(&Worth) -> f64, chosen: &dyn Fn(&Worth) -> bool| {
        let rows = worth.iter().filter(|w| chosen(w));
        // A curve of gaps is dots.
        let points: Vec<(f64, f64)> = rows
            .flat_map(|w| [(along(w), w.s_per_mj), (along(w), f64::NAN)])
            .collect();
        Curve {
            label,
            x: points.iter().map(|p| p.0).collect(),
            y: points.iter().map(|p| p.1).collect(),
            shade: None,
        }
    };
    let panel = |title, x_label, along: fn(&Worth) -> f64| CurvePanel {
        title,
        x_label,
        y_label: "time gained (s/MJ)",
        curves: vec![
            dots("the swarm deploys", along, &|w| w.taken >= 0.5),
            dots("the swarm does not", along, &|w| w.taken < 0.5),
        ],
    };
    let panels = [
        panel(
            "What a megajoule buys by speed",
            "speed of the engine alone (m/s)",
            |w| w.speed_mps,
        ),
        panel("Along the lap", DISTANCE, |w| w.station_m),
    ];
    let title = format!(
        "The motor on one stretch at a time, {:.3} s without it",
        outcome.engine.lap.time
    );
    plot_curves(path, &title, &panels)
}

/// The swarm's front as scatters of every two objectives and in parallel coordinates with its variables.
fn draw_front(folder: &Path, settings: &HybridStudySettings, front: &StrategyFront) -> Result<()> {
    let objectives: Vec<Objective<'_>> = settings
        .objectives
        .iter()
        .map(|o| Objective {
            name: o.words(),
            unit: o.unit(),
        })
        .collect();
    plot_pareto(
        folder.join("front.svg"),
        "Laps on the front",
        &objectives,
        &front.objectives,
        None,
    )?;
    // Objectives, then the shares of the zones.
    let shares = front
        .names
        .iter()
        .enumerate()
        .filter(|(_, name)| name.starts_with("zone"));
    let columns: Vec<(String, Vec<f64>)> = objectives
        .iter()
        .enumerate()
        .map(|(k, o)| {
            (
                o.name.to_owned(),
                front.objectives.iter().map(|row| row[k]).collect(),
            )
        })
        .chain(shares.map(|(k, name)| (name.clone(), front.candidates.iter().map(|row| row[k]).collect())))
        .collect();
    let scaled: Vec<Vec<f64>> = columns
        .iter()
        .map(|(_, values)| {
            let least = values.iter().fold(f64::INFINITY, |a, b| a.min(*b));
            let most = values.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
            let range = (most - least).max(1e-12);
            values.iter().map(|v| (v - least) / range).collect()
        })
        .collect();
    let zones = columns.len() - objectives.len();
    let mut label: Vec<String> = columns[..objectives.len()]
        .iter()
        .enumerate()
        .map(|(k, (name, _))| format!("{k}: {name}"))
        .collect();
    if zones > 0 {
        label.push(format!(
            "{} to {}: shares of the zones",
            objectives.len(),
            columns.len() - 1
        ));
    }
    let panel = CurvePanel {
        title: "One curve a lap, coloured by the first objective",
        x_label: &label.join("; "),
        y_label: "share of the front's range",
        curves: (0..front.objectives.len())
            .map(|i| Curve {
                label: "",
                x: (0..columns.len()).map(|k| k as f64).collect(),
                y: scaled.iter().map(|column| column[i]).collect(),
                shade: Some(scaled[0][i]),
            })
            .collect(),
    };
    plot_curves(
        folder.join("parallel.svg"),
        "The front in parallel coordinates",
        &[panel],
    )
}
