//! The hybrid end to end: on a toy circuit with a known answer, on the bundled car and circuit, and its books.

use glam::DVec2;
use lapswarm::config::settings::Settings;
use lapswarm::evaluate::BackendChoice;
use lapswarm::evaluate::energy::HybridObjective;
use lapswarm::line::energy::{Gates, Mode};
use lapswarm::study::framework::journal::Recorder;
use lapswarm::study::framework::state_file::StateFile;
use lapswarm::study::framework::{Study, solve_unobserved, write_results};
use lapswarm::study::hybrid::{
    FreeGate, FreePart, Hybrid, HybridAlgorithm, HybridSetup, HybridStudySettings, ReportedLap, correlation,
    drive, engine_only, mean_worths, published, search_front, search_strategy, set_up, size, stint, worth,
};
use lapswarm::swarm::Mutation;
use lapswarm::swarm::metrics::non_dominated;
use std::f64::consts::PI;
use std::ops::ControlFlow;
use std::sync::OnceLock;

fn settings() -> HybridStudySettings {
    HybridStudySettings {
        sections: Some(480),
        spacing_m: 7.0,
        backend: BackendChoice::Simd,
        ..HybridStudySettings::default()
    }
}

fn bundled() -> &'static HybridSetup {
    static SETUP: OnceLock<HybridSetup> = OnceLock::new();
    SETUP.get_or_init(|| set_up(&settings()).unwrap())
}

/// The car's own envelope as a file has the traction that the sweep knows: the tyres leave the motor the same room.
#[test]
fn an_envelope_from_a_file_has_the_cars_traction() {
    let own = bundled();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("envelope.csv");
    let range = lapswarm::vehicle::limits::SpeedRange::USUAL;
    let limits = lapswarm::vehicle::limits::car_envelope(&own.car.car, &range).unwrap();
    std::fs::write(&path, limits.envelope.to_csv()).unwrap();
    let read = lapswarm::study::hybrid::read_inputs(&HybridStudySettings {
        envelope: Some(path),
        ..settings()
    })
    .unwrap();
    let (own, read) = (&own.car.table.boosts, &read.car.table.boosts);
    assert_eq!(own.len(), read.len());
    for (i, (own, read)) in own.iter().zip(read).enumerate() {
        assert!((own - read).abs() < 1e-9, "{i}: {own} {read}");
    }
    // At 18 m/s they leave it less than 2 m/s^2.
    assert!(read[1] < 2.0, "{}", read[1]);
}

const NO_MOTOR: Gates = Gates {
    energy_mj: 0.0,
    ..Gates::OPEN
};

/// A belt round two wheels, anticlockwise from the far side of the large one: two straights alike, one behind a slow bend and
/// one behind a fast bend. Returns the points and where the slow bend ends (m).
fn belt(small_m: f64, large_m: f64, apart_m: f64, spacing_m: f64) -> (Vec<DVec2>, f64) {
    let lean = ((large_m - small_m) / apart_m).asin();
    let large = DVec2::new(apart_m, 0.0);
    let arc = |points: &mut Vec<DVec2>, centre: DVec2, radius: f64, from: f64, to: f64| {
        let count = ((to - from) * radius / spacing_m).ceil() as usize;
        points.extend((0..count).map(|i| {
            let angle = from + (to - from) * i as f64 / count as f64;
            centre + radius * DVec2::from_angle(angle)
        }));
        (to - from) * radius
    };
    let straight = |points: &mut Vec<DVec2>, a: DVec2, b: DVec2| {
        let count = (a.distance(b) / spacing_m).ceil() as usize;
        points.extend((0..count).map(|i| a + (b - a) * (i as f64 / count as f64)));
        a.distance(b)
    };
    let (up, down) = (PI / 2.0 + lean, 1.5 * PI - lean);
    let at = |centre: DVec2, radius: f64, angle: f64| centre + radius * DVec2::from_angle(angle);
    let mut points = Vec::new();
    let mut slow_end = arc(&mut points, large, large_m, 0.0, up);
    slow_end += straight(&mut points, at(large, large_m, up), at(DVec2::ZERO, small_m, up));
    slow_end += arc(&mut points, DVec2::ZERO, small_m, up, down);
    straight(
        &mut points,
        at(DVec2::ZERO, small_m, down),
        at(large, large_m, down),
    );
    arc(&mut points, large, large_m, down, 2.0 * PI);
    (points, slow_end)
}

/// Energy out of the store between two distances from the start (J).
fn deployed_between(lap: &ReportedLap, from_m: f64, to_m: f64) -> f64 {
    let rows = lap.station_m.iter().zip(&lap.segments);
    rows.filter(|(station, _)| (from_m..to_m).contains(*station))
        .map(|(_, s)| s.deployed)
        .sum()
}

#[test]
fn on_two_straights_a_joule_is_worth_most_behind_the_slow_bend() {
    let (points, slow_end) = belt(22.0, 110.0, 700.0, 6.0);
    let setup = HybridSetup {
        run_in: points.len() - 3,
        points_m: points,
        closed: true,
        ..bundled().clone()
    };
    let engine = drive(&setup, "engine", Mode::Additional, NO_MOTOR).unwrap();
    let straight = 694.0;
    // An energy that the straight behind the slow bend has room for: both start at corner speed, 16 m/s against 40 m/s, and at
    // constant power the time that a joule saves over the rest of a straight falls with the cube of the speed.
    let energy_j = 0.1e6;
    let exact = setup.exact(energy_j, None).unwrap();
    let exact_lap = setup.exact_lap("exact", &exact.shares, energy_j).unwrap();
    let behind_slow = deployed_between(&exact_lap, slow_end - 10.0, slow_end + 0.5 * straight);
    assert!(
        behind_slow > 0.95 * exact_lap.lap.deployed && exact_lap.lap.deployed > 0.99 * energy_j,
        "{behind_slow} of {} J",
        exact_lap.lap.deployed
    );
    // The swarm knows of nothing but lap times.
    let quick = HybridStudySettings {
        population: 24,
        iterations: 60,
        ..settings()
    };
    let found = search_strategy(
        &setup,
        &quick,
        energy_j / 1e6,
        &mut Recorder::idle(&mut StateFile::idle()),
        |_| ControlFlow::Continue(()),
    )
    .unwrap();
    let behind_slow = deployed_between(&found.lap, slow_end - 10.0, slow_end + 0.5 * straight);
    assert!(behind_slow > 0.9 * found.lap.lap.deployed, "{behind_slow} J");
    assert!(found.lap.lap.time < exact.lap.time + 0.05);
    assert!(exact.lap.time < found.lap.lap.time + 1e-3);
    // The same energy behind the fast bend buys less.
    let mut elsewhere = vec![0.0; setup.points_m.len()];
    for (share, station) in elsewhere.iter_mut().zip(&engine.station_m) {
        *share = f64::from(*station < slow_end - 200.0);
    }
    let fast = setup.exact_lap("fast", &elsewhere, energy_j).unwrap();
    assert!(fast.lap.deployed > 0.99 * energy_j);
    let (slow_gain, fast_gain) = (engine.lap.time - exact.lap.time, engine.lap.time - fast.lap.time);
    assert!(slow_gain > 1.3 * fast_gain, "{slow_gain} s and {fast_gain} s");
}

#[test]
fn without_the_motor_the_lap_is_the_racing_lines() {
    use lapswarm::evaluate::Evaluator;
    use lapswarm::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem};
    let setup = bundled();
    let cross_sections = lapswarm::track::CrossSections {
        right_m: setup.points_m.clone(),
        left_m: setup.points_m.clone(),
        station_m: vec![0.0; setup.points_m.len()],
        reference: vec![0.5; setup.points_m.len()],
        ..setup.raceline.cross_sections.clone()
    };
    // Cross-sections without width through the line's points: the line itself.
    let plain = LineProblem::new(
        cross_sections,
        lapswarm::line::Parametrisation::sections(),
        &[LineObjective::LapTime],
        Some(setup.car.point_mass.clone()),
        10.0,
    )
    .unwrap();
    let time = CpuLineEvaluator::new(&plain)
        .evaluate(&vec![0.5; setup.points_m.len()])
        .unwrap()
        .objectives[0];
    for mode in [Mode::Offset, Mode::Additional] {
        let lap = drive(setup, "engine", mode, NO_MOTOR).unwrap();
        // One goes forwards first and the other backwards: they differ where a segment is both driven and braked on.
        assert!(
            (lap.lap.time / time - 1.0).abs() < 1e-5,
            "{} and {time}",
            lap.lap.time
        );
    }
}

#[test]
fn the_published_scenarios_are_of_their_kind() {
    // The published accounts let the charge pass one.
    let own = bundled();
    let setup = &HybridSetup {
        car: own.car.with_hybrid(own.car.hybrid.with_overflow()).unwrap(),
        ..own.clone()
    };
    let engine = drive(setup, "engine", Mode::Offset, NO_MOTOR).unwrap();
    let litres = |lap: &ReportedLap| lap.lap.fuel / 0.748;
    assert!((2.5..3.1).contains(&litres(&engine)), "{}", litres(&engine));
    let laps: Vec<ReportedLap> = published()
        .iter()
        .map(|s| s.drive(setup, s.mode).unwrap())
        .collect();
    for lap in &laps {
        assert!(lap.balance_error_j().abs() < 1e-6, "{}", lap.name);
        // The motor in the engine's place: the same lap for less fuel.
        assert!((lap.lap.time - engine.lap.time).abs() < 1e-9);
        assert!(litres(lap) < litres(&engine));
        assert!((1.5e6..3.5e6).contains(&lap.lap.harvested_k));
        // 0.23 MJ are published, at no cost to the lap. Here the generator takes what the engine has to spare, which is little: in bends
        // the tyres take from it too.
        assert!(
            (0.005e6..0.23e6).contains(&lap.lap.harvested_h),
            "{}",
            lap.lap.harvested_h
        );
        // Never more than the motor's power.
        for (s, h) in lap.segments.iter().zip(&lap.length_m) {
            let mean_speed = h / s.time;
            assert!(
                s.deployed / s.time < 120e3 * 1.01,
                "{} at {mean_speed} m/s",
                s.deployed / s.time
            );
            assert!(s.motor >= 0.0 && s.engine >= 0.0 && s.generator >= 0.0 && s.hydraulic >= -1e-9);
        }
    }
    let [depleting, sustaining, most, permissible] = &laps[..] else {
        panic!("four scenarios")
    };
    let soc = |lap: &ReportedLap| lap.soc(lap.lap.change);
    assert!(soc(depleting) < 0.6);
    assert!((soc(sustaining) - 0.5).abs() < 0.01);
    assert!((-1e-9..0.01).contains(&soc(most)));
    assert!((permissible.lap.deployed - 5.3e6).abs() < 1.0);
    // The gate of charge holds along the whole lap.
    let least = sustaining.change_j().into_iter().fold(f64::INFINITY, f64::min);
    assert!(least > -1e-3, "{least} J");
}

/// From a charge of 0.9 a store of 5.3 MJ takes 0.53 MJ and no more; from 1 it takes nothing. The lap is the same: what the store
/// does not take, the friction brakes do.
#[test]
fn a_full_store_takes_no_more() {
    let own = bundled();
    let lap = |start_soc: f64, overflow: bool| {
        let mut hybrid = own.car.hybrid.clone();
        hybrid.store.start_soc = start_soc;
        hybrid.store.overflow = overflow;
        let car = own.car.with_hybrid(hybrid).unwrap();
        let setup = HybridSetup { car, ..own.clone() };
        drive(&setup, "braking alone", Mode::Offset, NO_MOTOR).unwrap()
    };
    let (full, nearly, endless) = (lap(1.0, false), lap(0.9, false), lap(1.0, true));
    assert_eq!((full.lap.harvested_k, full.lap.harvested_h), (0.0, 0.0));
    assert!(
        (nearly.lap.change - 0.53e6).abs() < 1e-3,
        "{} J",
        nearly.lap.change
    );
    assert!(endless.lap.change > 1.5e6);
    for lap in [&full, &nearly] {
        assert!(lap.balance_error_j().abs() < 1e-6);
        let brakes = lap.segments.iter().zip(&endless.segments);
        for (s, other) in brakes {
            let shed = other.generator + other.hydraulic;
            assert!((s.generator + s.hydraulic - shed).abs() < 1e-9 && s.end == other.end);
        }
    }
    let most = nearly.change_j().into_iter().fold(0.0, f64::max);
    assert!(most <= 0.53e6 + 1e-3, "{most} J");
}

/// A scenario with a charge of its own at the start deploys what the lap harvests, though the car's store is full: as much as
/// accounts without a full store let it from any charge.
#[test]
fn a_sustained_charge_uses_what_is_harvested() {
    let own = bundled();
    let lap = |start: f64, overflow: bool| {
        let mut hybrid = own.car.hybrid.clone();
        hybrid.store.overflow = overflow;
        let car = own.car.with_hybrid(hybrid).unwrap();
        let setup = HybridSetup { car, ..own.clone() };
        let mut scenario = published().into_iter().nth(1).unwrap();
        assert_eq!(scenario.name, "charge_sustaining");
        (scenario.gates.soc, scenario.start_soc) = (start, Some(start));
        scenario.drive(&setup, Mode::Offset).unwrap()
    };
    let (half, published) = (lap(0.5, false), lap(1.0, true));
    assert!(half.lap.deployed > 1e6, "{} J", half.lap.deployed);
    assert!((half.lap.deployed - published.lap.deployed).abs() < 1.0);
    assert!((half.soc(half.lap.change) - 0.5).abs() < 0.01);
    assert_eq!(lap(1.0, false).lap.deployed, 0.0);
}

#[test]
#[ignore = "full tier: three whole searches"]
fn the_swarm_comes_within_hundredths_of_a_second_of_the_exact_deployment() {
    // As fine as users have it: stretches of use are told apart by gaps of a few metres.
    let settings = HybridStudySettings {
        backend: BackendChoice::Simd,
        ..HybridStudySettings::default()
    };
    let setup = &set_up(&settings).unwrap();
    let engine = drive(setup, "engine", Mode::Additional, NO_MOTOR).unwrap();
    let mut before = engine.lap.time;
    // Of five seeds the middle one. Measured are 0.0002 s and less: no less than what the exact deployment is held to. With 1 MJ two
    // of nine seeds end 0.013 s above it.
    for mj in [1.0, 2.1, 5.3] {
        let exact = setup.exact(1e6 * mj, None).unwrap();
        let mut swarms = [1, 2, 3, 4, 5].map(|seed| {
            search_strategy(
                setup,
                &HybridStudySettings {
                    seed,
                    ..settings.clone()
                },
                mj,
                &mut Recorder::idle(&mut StateFile::idle()),
                |_| ControlFlow::Continue(()),
            )
            .unwrap()
        });
        swarms.sort_by(|a, b| a.lap.lap.time.total_cmp(&b.lap.lap.time));
        let worst = swarms[4].lap.lap.time;
        assert!(worst < exact.lap.time + 0.02, "{mj} MJ: {worst} s");
        let [_, _, swarm, ..] = swarms;
        let time = swarm.lap.lap.time;
        println!(
            "{mj} MJ: swarm {time:.4} s, exact {:.4} s, bound {:?} s",
            exact.lap.time, exact.bound_s
        );
        assert!(
            time < exact.lap.time + 2e-3,
            "{mj} MJ: {time} s and {} s",
            exact.lap.time
        );
        assert!(
            exact.lap.time < time + 2e-3,
            "{mj} MJ: the exact {} s ({}) and {time} s",
            exact.lap.time,
            exact.status
        );
        assert!(exact.lap.deployed <= 1e6 * mj + 1.0 && swarm.lap.lap.deployed <= 1e6 * mj + 1.0);
        assert!(exact.lap.time < before);
        before = exact.lap.time;
        // Where a joule buys more by itself it is taken first.
        let rows = worth(setup, &engine, &swarm.lap).unwrap();
        let [taken, left] = mean_worths(&rows);
        println!(
            "{} stretches, correlation {:?}, {taken:?} taken, {left:?} left",
            rows.len(),
            correlation(&rows)
        );
        if mj < 3.0 {
            assert!(taken.unwrap() > left.unwrap(), "{mj} MJ: {taken:?} and {left:?}");
        }
        assert!(rows.iter().all(|r| r.s_per_mj > 0.0));
        assert!(correlation(&rows).unwrap() < 0.0);
        // Better than every strategy that was set by hand, of the same energy.
        for scenario in published() {
            let gates = Gates {
                energy_mj: mj.min(scenario.gates.energy_mj),
                ..scenario.gates
            };
            let by_hand = drive(setup, &scenario.name, Mode::Additional, gates).unwrap();
            assert!(time < by_hand.lap.time + 1e-3, "{} at {mj} MJ", scenario.name);
        }
    }
}

#[test]
#[ignore = "full tier: searches of many sizes"]
fn stints_sustain_their_charge_and_sizes_meet_their_lap() {
    let setup = bundled();
    let laps = stint(setup, 3, 40.0).unwrap();
    assert_eq!(laps.len(), 3);
    for pair in laps.windows(2) {
        let burnt_kg = pair[0].fuel_l * 0.748;
        assert!((pair[0].mass_kg - pair[1].mass_kg - burnt_kg).abs() < 1e-9);
        // Lighter is faster.
        assert!(pair[1].lap_time_s < pair[0].lap_time_s);
    }
    for lap in &laps {
        assert!((lap.soc_end - 1.0).abs() < 0.05, "{}", lap.soc_end);
        assert!(lap.lap_time_s < lap.engine_lap_time_s && lap.fuel_l < lap.engine_fuel_l);
    }
    assert!(
        stint(setup, 3, 1.0)
            .unwrap_err()
            .to_string()
            .contains("stint_fuel_kg")
    );

    let engine = drive(setup, "engine", Mode::Additional, NO_MOTOR).unwrap();
    // A fine line, as users have it: on a coarse one the exact deployment is not exact to less than hundredths of a second.
    let fine = HybridStudySettings {
        backend: BackendChoice::Simd,
        ..HybridStudySettings::default()
    };
    let fine_setup = set_up(&fine).unwrap();
    let goal = drive(&fine_setup, "engine", Mode::Additional, NO_MOTOR)
        .unwrap()
        .lap
        .time
        - 0.8;
    let (rows, _) = size(
        &fine_setup,
        &fine,
        goal,
        &mut Recorder::idle(&mut StateFile::idle()),
        |_| ControlFlow::Continue(()),
    )
    .unwrap();
    let sized: Vec<_> = rows.iter().filter(|r| r.energy_mj.is_some()).collect();
    for row in &rows {
        println!("{row:?}");
    }
    assert!(sized.len() >= 4, "{rows:?}");
    for row in &sized {
        // False position ends within 3 ms, or after eight energies, whose searches leave some thousandths to chance.
        assert!((row.lap_time_s - goal).abs() < 0.01, "{row:?}");
        // Measured are 0.0003 to 0.0048 s above the exact deployment of the same motor and energy, and 0.014 s with the least motor.
        assert!(
            (row.lap_time_s - row.exact_lap_time_s.unwrap()).abs() < 0.02,
            "{row:?}"
        );
        assert!(
            (0.0..=row.energy_mj.unwrap() + 1e-9).contains(&row.store_mj),
            "{row:?}"
        );
    }
    // The car itself is the one that laps like itself.
    let (share, fuel_l) = engine_only(setup, engine.lap.time).unwrap().unwrap();
    assert!((share - 1.0).abs() < 1e-4, "{share}");
    assert!((fuel_l / (engine.lap.fuel / 0.748) - 1.0).abs() < 1e-3);
    assert!(engine_only(setup, 60.0).unwrap().is_none());
    // A faster one has a greater engine, which burns more than the hybrid.
    for row in &sized {
        assert!(
            row.engine_share.unwrap() > 1.0 && row.fuel_saving_l.unwrap() > 0.0,
            "{row:?}"
        );
    }
    // A strong motor needs less energy: it spends it where the car is slowest.
    for pair in sized.windows(2) {
        assert!(pair[0].power_kw < pair[1].power_kw);
    }
    assert!(sized[sized.len() - 1].energy_mj < sized[0].energy_mj);
    // What no motor reaches is said with what the strongest does.
    let (none, _) = size(
        setup,
        &HybridStudySettings {
            population: 16,
            iterations: 10,
            ..settings()
        },
        60.0,
        &mut Recorder::idle(&mut StateFile::idle()),
        |_| ControlFlow::Continue(()),
    )
    .unwrap();
    assert_eq!(none.len(), 8);
    for row in &none {
        assert!(row.energy_mj.is_none() && row.exact_lap_time_s.is_none() && row.fuel_saving_l.is_none());
        assert!(
            row.lap_time_s > 60.0 && row.lap_time_s <= engine.lap.time + 1e-9,
            "{row:?}"
        );
    }
    let slower = size(
        setup,
        &settings(),
        engine.lap.time + 1.0,
        &mut Recorder::idle(&mut StateFile::idle()),
        |_| ControlFlow::Continue(()),
    )
    .unwrap_err();
    assert!(
        slower.exit_code() == 2 && slower.to_string().contains("match_lap_time_s"),
        "{slower}"
    );
}

/// The published swarms, NSGA-II and islands: the evaluations that were asked for, and laps none of which another betters.
#[test]
fn strategies_are_searched_by_the_swarm_that_is_asked_for() {
    let own = HybridStudySettings {
        population: 16,
        iterations: 24,
        ..settings()
    };
    let thesis = HybridStudySettings {
        algorithm: HybridAlgorithm::Thesis,
        mutation: Some(Mutation::None),
        ..own.clone()
    };
    let genetic = HybridStudySettings {
        algorithm: HybridAlgorithm::Nsga2,
        ..own.clone()
    };
    let islands = HybridStudySettings {
        islands: 2,
        ..own.clone()
    };
    let mut fronts: Vec<Vec<Vec<f64>>> = Vec::new();
    for (settings, evaluations) in [(own, 384), (thesis, 384), (genetic, 384), (islands, 768)] {
        let mut state_file = StateFile::idle();
        let mut recorder = Recorder::idle(&mut state_file);
        let front = search_front(bundled(), &settings, 2.1, &mut recorder, |_| {
            ControlFlow::Continue(())
        })
        .unwrap();
        assert_eq!(front.evaluations, evaluations, "{:?}", settings.algorithm);
        assert_eq!(non_dominated(&front.objectives).len(), front.objectives.len());
        assert!(!fronts.contains(&front.candidates), "{:?}", settings.algorithm);
        fronts.push(front.candidates);
    }
}

/// Gates and zones that swarms set. In the engine's place the lap takes as long as by the engine alone and burns less; beside it the
/// lap is faster. Sites share out all that leaves the store.
#[test]
fn gates_and_zones_are_searched_both_ways() {
    let settings = HybridStudySettings {
        track: "stadium:250:60:12".to_owned(),
        sections: Some(120),
        spacing_m: 6.0,
        population: 24,
        iterations: 30,
        budgets_mj: Vec::new(),
        energy_mj: Some(0.3),
        objectives: vec![
            HybridObjective::Gamma,
            HybridObjective::Length,
            HybridObjective::LapTime,
        ],
        free: FreePart::Both,
        offset: true,
        gates: vec![
            FreeGate::Steer,
            FreeGate::Speed,
            FreeGate::Acceleration,
            FreeGate::Charge,
        ],
        backend: BackendChoice::Simd,
        ..HybridStudySettings::default()
    };
    let inputs = Hybrid::prepare(&settings).unwrap();
    let outcome = solve_unobserved::<Hybrid>(&settings, &inputs).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let summary = write_results::<Hybrid>(folder.path(), &settings, &inputs, &outcome).unwrap();
    for name in [
        "lap_offset_zones.csv",
        "lap_offset_gates.csv",
        "lap_additional_gates.csv",
        "motor_on.svg",
    ] {
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    let searches = &summary.searches;
    let (zones, gates) = (&searches["offset_zones"], &searches["offset_gates"]);
    let beside = &searches["additional_gates"];
    for found in [zones, gates] {
        assert!(
            (found.lap_time_s - summary.engine_lap_time_s).abs() < 1e-9,
            "{found:?}"
        );
        assert!(
            found.fuel_l < summary.engine_fuel_l && found.fuel_percent < 100.0,
            "{found:?}"
        );
    }
    for found in searches.values() {
        assert!(
            found.deployed_mj <= 0.3 + 1e-6 && found.deployed_mj > 0.05,
            "{found:?}"
        );
    }
    assert!(beside.lap_time_s < summary.engine_lap_time_s - 0.05, "{beside:?}");
    let names: Vec<&str> = gates.variables.keys().map(String::as_str).collect();
    assert_eq!(names, ["ax", "soc", "speed", "steer"]);
    let deployment = summary.deployment.as_ref().unwrap();
    let (allocated, out): (f64, f64) = deployment.sites.iter().fold((0.0, 0.0), |sum, site| {
        (sum.0 + site.allocation, sum.1 + site.deployed_mj)
    });
    assert!((allocated - 1.0).abs() < 1e-9 && (out - deployment.swarm_deployed_mj).abs() < 1e-9);
    assert!(deployment.sites.len() > 1, "{:?}", deployment.sites);
    // The front's lengths are those of its lines: none is shorter than the inside of the road, and the shortest is not the fastest.
    let front = outcome.optimised.as_ref().unwrap().swarm_front.as_ref().unwrap();
    let least = |k: usize| {
        let all = front.objectives.iter();
        all.min_by(|a, b| a[k].total_cmp(&b[k])).unwrap().clone()
    };
    let (straight, short) = (least(0), least(1));
    assert!(
        short[1] > 500.0 + 2.0 * PI * 54.0 && short[1] < 500.0 + 2.0 * PI * 66.0,
        "{short:?}"
    );
    assert!(
        short[1] < straight[1] && straight[0] < short[0],
        "{straight:?} {short:?}"
    );

    let of_one_line = HybridStudySettings {
        free: FreePart::Strategy,
        ..settings
    };
    let error = of_one_line.validate().err().unwrap().to_string();
    assert!(
        error.contains("objectives") && error.contains("gamma_1pm"),
        "{error}"
    );
}

#[test]
fn a_study_writes_what_scripts_read_and_repeats() {
    let settings = HybridStudySettings {
        track: "stadium:250:60:12".to_owned(),
        sections: Some(120),
        spacing_m: 6.0,
        population: 16,
        iterations: 10,
        budgets_mj: vec![0.0, 0.2],
        energy_mj: Some(0.3),
        stint_laps: 1,
        objectives: vec![HybridObjective::LapTime, HybridObjective::Fuel],
        free: FreePart::Both,
        backend: BackendChoice::Simd,
        ..HybridStudySettings::default()
    };
    let inputs = Hybrid::prepare(&settings).unwrap();
    let outcome = solve_unobserved::<Hybrid>(&settings, &inputs).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let summary = write_results::<Hybrid>(folder.path(), &settings, &inputs, &outcome).unwrap();
    for name in [
        "summary.json",
        "manifest.json",
        "study.toml",
        "car.toml",
        "line.csv",
        "lap_swarm.csv",
        "lap_charge_sustaining.csv",
        "front.csv",
        "charge.svg",
        "map.svg",
        "traces.svg",
        "engine_sites.svg",
        "time_energy.svg",
        "worth.svg",
        "energy_maximum_permissible.svg",
        "parallel.svg",
    ] {
        assert!(folder.path().join(name).metadata().unwrap().len() > 0, "{name}");
    }
    let json = serde_json::to_value(&summary).unwrap();
    for name in [
        "charge_depleting",
        "charge_sustaining",
        "maximum_deployment",
        "maximum_permissible",
    ] {
        for key in [
            "deployed_mj",
            "harvested_k_mj",
            "harvested_h_mj",
            "soc_end",
            "fuel_l",
            "motor_time_share",
            "lap_time_s",
            "balance_error_j",
        ] {
            assert!(json["scenarios"][name][key].is_number(), "{name} {key}");
        }
    }
    for key in [
        "study",
        "seed",
        "backend",
        "adapter",
        "elapsed_s",
        "evaluations",
        "evaluations_per_s",
    ] {
        assert!(!json[key].is_null(), "{key}");
    }
    assert_eq!(
        HybridStudySettings::read(&folder.path().join("study.toml")).unwrap(),
        settings
    );
    // The line that was driven can be given back.
    let again = set_up(&HybridStudySettings {
        line: Some(folder.path().join("line.csv")),
        ..settings.clone()
    })
    .unwrap();
    assert!((again.length_m / outcome.setup.length_m - 1.0).abs() < 1e-3);

    let other = solve_unobserved::<Hybrid>(&settings, &inputs).unwrap();
    let shares = |o: &lapswarm::study::hybrid::Outcome| {
        let optimised = o.optimised.as_ref().unwrap();
        (
            optimised.swarm.shares.clone(),
            optimised.swarm_front.as_ref().unwrap().candidates.clone(),
        )
    };
    assert_eq!(shares(&outcome), shares(&other));
}
