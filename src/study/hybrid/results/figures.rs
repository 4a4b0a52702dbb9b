//! Figures of laps, energies and engine sites.

use super::reported_laps;
use crate::config::kinds::Choice;
use crate::line::energy::SegmentEnergy;
use crate::report::{Curves, LapLine, LapView, Panel, Road, SiteMap, TrackMap};
use crate::study::hybrid::{HybridSetup, HybridStudySettings, Outcome, ReportedLap, StrategyFront, Worth};

/// Power at the wheels (kW) of a force over the mass (m/s^2), segment by segment.
pub fn power_kw(
    setup: &HybridSetup,
    lap: &ReportedLap,
    force: impl Fn(&SegmentEnergy<f64>) -> f64,
) -> Vec<f64> {
    let mass = setup.car.table.mass;
    let rows = lap.segments.iter().zip(&lap.length_m);
    rows.map(|(s, h)| mass * force(s) * h / s.time / 1e3).collect()
}

/// Running sum over the segments.
fn summed(lap: &ReportedLap, of: impl Fn(&SegmentEnergy<f64>) -> f64) -> Vec<f64> {
    lap.segments
        .iter()
        .scan(0.0, |sum, s| {
            *sum += of(s);
            Some(*sum)
        })
        .collect()
}

fn speeds(lap: &ReportedLap) -> Vec<f64> {
    lap.segments.iter().map(|s| s.start.sqrt()).collect()
}

fn less(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn words(lap: &ReportedLap) -> String {
    lap.name.replace('_', " ")
}

fn road(setup: &HybridSetup) -> Road {
    Road {
        closed: setup.closed,
        ..Road::across(&setup.raceline.road, &setup.raceline.edges_m)
    }
}

/// Laps over one another: what the motor does and what it gains on the engine alone.
pub fn laps(outcome: &Outcome, laps: &[&ReportedLap], title: String) -> LapView {
    let (setup, engine) = (&outcome.setup, &outcome.engine);
    let (alone_mps, alone_s) = (speeds(engine), summed(engine, |s| s.time));
    let line = |lap: &&ReportedLap| {
        let n = lap.segments.len();
        let line = LapLine::new(words(lap), &lap.station_m[..n])
            .at(&setup.points_m[..n])
            .trace(0, speeds(lap))
            .trace(3, power_kw(setup, lap, |s| s.engine));
        // The engine alone has none of these.
        if std::ptr::eq(*lap, engine) {
            return line;
        }
        let soc = lap.change_j()[1..]
            .iter()
            .map(|j| lap.soc(*j))
            .collect::<Vec<f64>>();
        line.trace(1, less(&speeds(lap), &alone_mps))
            .trace(2, less(&alone_s, &summed(lap, |s| s.time)))
            .trace(4, power_kw(setup, lap, |s| s.motor))
            .trace(5, power_kw(setup, lap, |s| s.generator))
            .trace(6, summed(lap, |s| s.deployed / 1e6))
            .trace(7, summed(lap, |s| s.harvested_k / 1e6))
            .trace(8, summed(lap, |s| s.harvested_h / 1e6))
            .trace(9, soc)
            .trace(
                10,
                summed(lap, |s| (s.deployed - s.harvested_k - s.harvested_h) / 1e6),
            )
    };
    let rules = setup.car.hybrid.rules.deployed_on(setup.length_m);
    let allowed = rules.map(|j| {
        let x = &engine.station_m[..engine.segments.len()];
        LapLine::new("allowed by the rules", x).trace(6, vec![j / 1e6; x.len()])
    });
    LapView::new(title)
        .note("Powers are at the wheels. Time and speed are gained on the engine alone.")
        .panel("speed", "m/s")
        .low_panel("speed gained", "m/s")
        .panel("time gained", "s")
        .panel("engine", "kW")
        .panel("motor", "kW")
        .panel("regeneration", "kW")
        .panel("energy out", "MJ")
        .panel("MGU-K in", "MJ")
        .panel("MGU-H in", "MJ")
        .panel("state of charge", "")
        .panel("net energy out", "MJ")
        .lines(laps.iter().map(line))
        .lines(allowed)
        .road(road(setup))
}

/// One lap beside the engine alone.
pub fn lap(outcome: &Outcome, lap: &ReportedLap) -> LapView {
    let setup = &outcome.setup;
    let title = format!(
        "{}, {} ({}): {:.3} s, {:.2} MJ out, {:.3} l",
        setup.raceline.track_name,
        words(lap),
        lap.mode.name(),
        lap.lap.time,
        lap.lap.deployed / 1e6,
        lap.lap.fuel / setup.car.fuel_density_kgpl
    );
    laps(outcome, &[lap, &outcome.engine], title)
}

/// All laps, the fastest first: it colours the map.
pub fn all_laps(outcome: &Outcome) -> LapView {
    let mut all = reported_laps(outcome);
    all.sort_by(|a, b| a.lap.time.total_cmp(&b.lap.time));
    let title = format!(
        "{}: speed, power and charge; {:.3} s by the engine alone",
        outcome.setup.raceline.track_name, outcome.engine.lap.time
    );
    laps(outcome, &all, title)
}

/// Deployment and harvest on the circuit.
pub fn map(setup: &HybridSetup, lap: &ReportedLap) -> TrackMap {
    let mut values = power_kw(setup, lap, |s| s.motor - s.generator);
    values.resize(setup.points_m.len(), f64::NAN);
    TrackMap {
        title: format!(
            "{}, {}: {:.2} MJ out, {:.2} MJ in",
            setup.raceline.track_name,
            words(lap),
            lap.lap.deployed / 1e6,
            (lap.lap.harvested_k + lap.lap.harvested_h) / 1e6
        ),
        road: road(setup),
        line_m: setup.points_m.clone(),
        values,
        value_label: "power".to_owned(),
        value_unit: "kW".to_owned(),
    }
}

/// Consumption beyond which the map is not told apart (g/kWh).
const MOST_GPKWH: f64 = 500.0;
/// Cells of the map of consumption, across and up.
const CELLS: (usize, usize) = (180, 120);
/// Segments for each dot.
const THINNED: usize = 3;

/// Where the engine works, over its specific consumption; nothing without an engine's map.
pub fn engine_sites(setup: &HybridSetup, alone: &ReportedLap, lap: &ReportedLap) -> Option<SiteMap> {
    let powertrain = setup.car.car.powertrain.as_ref()?;
    let engine = powertrain.engine.as_ref()?;
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
    let families = [sites(alone), sites(lap)];
    let speeds = &engine.engine_speed_rpm;
    let slowest = families.iter().flatten().map(|s| s.0).fold(speeds[0], f64::min);
    let x = ((slowest / 500.0).floor() * 500.0, speeds[speeds.len() - 1]);
    let most = speeds.iter().map(|rpm| engine.greatest_torque(*rpm).0);
    let y = (0.0, 1.04 * most.fold(0.0, f64::max));
    let cell = |i: usize, j: usize| {
        let torque = y.1 * (j as f64 + 0.5) / CELLS.1 as f64;
        let rpm = x.0 + (x.1 - x.0) * (i as f64 + 0.5) / CELLS.0 as f64;
        if torque > engine.greatest_torque(rpm).0 || rpm < speeds[0] {
            return f64::NAN;
        }
        let consumption = engine.bsfc_gpkwh(rpm, engine.throttle_for(rpm, torque));
        consumption.map_or(f64::NAN, |b| b.min(MOST_GPKWH))
    };
    let row = |j: usize| (0..CELLS.0).map(|i| cell(i, j)).collect();
    let cells = (0..CELLS.1).map(row).collect();
    let [alone, hybrid] = families;
    Some(SiteMap {
        title: "Where the engine works".to_owned(),
        x_label: "engine speed (rpm)".to_owned(),
        y_label: "torque (N m)".to_owned(),
        x,
        y,
        cells,
        value_label: "consumption".to_owned(),
        value_unit: "g/kWh".to_owned(),
        sites: vec![("engine alone".to_owned(), alone), (words(lap), hybrid)],
    })
}

/// Where the motor works by speed and acceleration, a panel for each lap with a motor.
pub fn motor_on(outcome: &Outcome) -> Curves {
    let panel = |lap: &&ReportedLap| {
        let dots = |on: bool| {
            let rows = lap.segments.iter().zip(&lap.length_m).step_by(THINNED);
            let rows = rows.filter(move |(s, _)| (s.deployed > 0.0) == on);
            rows.map(|(s, h)| ((0.5 * (s.start + s.end)).sqrt(), (s.end - s.start) / (2.0 * h)))
        };
        Panel::new(format!("{} ({})", words(lap), lap.mode.name()))
            .x("speed", "m/s")
            .y("acceleration", "m/s^2")
            .dots("motor off", dots(false))
            .dots("motor on", dots(true))
    };
    let laps = reported_laps(outcome);
    let with_motor = laps.iter().filter(|lap| lap.lap.deployed > 0.0);
    Curves::new("Where the motor works", with_motor.map(panel).collect::<Vec<_>>())
}

/// Time against energy: the reference optima, the swarm's lap, the scenarios with the motor beside the engine.
pub fn time_energy(outcome: &Outcome) -> Option<Curves> {
    let o = outcome.optimised.as_ref()?;
    let mut exact: Vec<(f64, f64)> = o
        .front
        .iter()
        .map(|p| (p.energy_mj, p.lap_time_s))
        .chain([(o.budget_j / 1e6, o.exact.lap.time)])
        .collect();
    exact.sort_by(|a, b| a.0.total_cmp(&b.0));
    let marginal: Vec<(f64, f64)> = exact
        .windows(2)
        .filter(|w| w[1].0 > w[0].0)
        .map(|w| (0.5 * (w[0].0 + w[1].0), (w[0].1 - w[1].1) / (w[1].0 - w[0].0)))
        .collect();
    let used = |lap: &ReportedLap| (lap.lap.deployed / 1e6, lap.lap.time);
    let mut panels = vec![
        Panel::new("Lap time against energy out of the store in a lap")
            .x("energy", "MJ")
            .y("lap time", "s")
            .points("reference optimum (energy allowed)", exact)
            .dots(
                "scenarios (energy used)",
                outcome.scenarios.iter().map(|s| used(&s.additional)),
            )
            .dots("swarm (energy used)", [used(&o.swarm.lap)]),
    ];
    if !marginal.is_empty() {
        panels.push(
            Panel::new("What a further megajoule buys")
                .x("energy allowed", "MJ")
                .y("time", "s/MJ")
                .points("", marginal),
        );
    }
    Some(Curves::new("Time against energy", panels))
}

/// What a megajoule buys by the speed at which it is deployed, and along the lap.
pub fn worth(outcome: &Outcome, worth: &[Worth]) -> Curves {
    let panel = |title, x: (&str, &str), along: fn(&Worth) -> f64| {
        let dots = |taken: bool| {
            let rows = worth.iter().filter(move |w| (w.taken >= 0.5) == taken);
            rows.map(move |w| (along(w), w.s_per_mj))
        };
        Panel::new(title)
            .x(x.0, x.1)
            .y("time gained", "s/MJ")
            .dots("the swarm deploys", dots(true))
            .dots("the swarm does not deploy", dots(false))
    };
    let title = format!(
        "The motor on one stretch at a time, {:.3} s without it",
        outcome.engine.lap.time
    );
    let speed = ("speed of the engine alone", "m/s");
    let panels = [
        panel("What a megajoule buys by speed", speed, |w| w.speed_mps),
        panel("What a megajoule buys along the lap", ("distance", "m"), |w| {
            w.station_m
        }),
    ];
    Curves::new(title, panels)
}

/// The front in parallel coordinates with the shares of its zones.
pub fn parallel(settings: &HybridStudySettings, front: &StrategyFront) -> Curves {
    let column = |rows: &[Vec<f64>], k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
    let objectives = settings.objectives.iter().enumerate();
    let mut label: Vec<String> = objectives.map(|(k, o)| format!("{k}: {}", o.words())).collect();
    let first = label.len();
    let mut columns: Vec<Vec<f64>> = (0..first).map(|k| column(&front.objectives, k)).collect();
    let zones = front.names.iter().enumerate();
    let zones = zones.filter(|(_, name)| name.starts_with("zone"));
    columns.extend(zones.map(|(k, _)| column(&front.candidates, k)));
    if columns.len() > first {
        label.push(format!("{first} to {}: shares of the zones", columns.len() - 1));
    }
    for values in &mut columns {
        let least = values.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        let most = values.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
        let range = (most - least).max(1e-12);
        values.iter_mut().for_each(|v| *v = (*v - least) / range);
    }
    let number: Vec<f64> = (0..columns.len()).map(|k| k as f64).collect();
    let panel = Panel::new("One curve a lap, coloured by the first objective")
        .x(&label.join("; "), "")
        .y("share of the front's range", "");
    let panel = (0..front.objectives.len()).fold(panel, |panel, i| {
        let along: Vec<f64> = columns.iter().map(|c| c[i]).collect();
        panel.shaded(columns[0][i], "", &number, &along)
    });
    Curves::new("The front in parallel coordinates", [panel])
}
