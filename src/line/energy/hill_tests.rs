//! Laps with energy on roads that are not level and dry, against cases worked by hand.

use super::tests::{car, car_without_h};
use super::*;
use crate::evaluate::energy::{HybridLine, HybridObjective, HybridProblem, Strategy};
use crate::line::{LineRelief, PointMass, geometry, lap_profile_on};
use crate::track::Surface;
use crate::vehicle::Traction;
use crate::vehicle::limits::{SpeedRange, car_envelope};
use crate::vehicle::powertrain::GRAVITY_MPS2;
use glam::DVec2;
use std::f64::consts::TAU;

/// A car for roads that are not level, of which a part of the accelerated mass rotates: a tenth of the car's own.
fn climber(car: EnergyCar) -> EnergyCar {
    let mut own = car.car;
    if let Some(powertrain) = &mut own.powertrain {
        powertrain.rotating_mass_factor = 1.1;
    }
    let coarse = SpeedRange {
        step_mps: 4.0,
        ..SpeedRange::USUAL
    };
    let envelope = car_envelope(&own, &coarse).unwrap().envelope;
    let traction = Traction::of(&own, &envelope);
    let point_mass = PointMass {
        envelope,
        relief: true,
        rotating_mass_factor: 1.1,
        ..car.point_mass
    };
    EnergyCar::of(own, point_mass, traction).unwrap()
}

/// An oval with all bends to the left, of some 2 km.
fn oval() -> Vec<DVec2> {
    let at = |i: i32| TAU * f64::from(i) / 300.0;
    (0..300)
        .map(|i| DVec2::new(450.0 * at(i).cos(), 180.0 * at(i).sin()))
        .collect()
}

/// The lap of a strategy that is open everywhere.
fn lap_of(
    car: &EnergyCar,
    (points_m, closed): (&[DVec2], bool),
    surface: &[Surface],
    (mode, energy_mj): (Mode, f64),
    entry_mps: f64,
) -> (EnergyLap<f64>, Vec<SegmentEnergy<f64>>, Vec<f64>) {
    let n = points_m.len();
    let line = HybridLine::Fixed {
        points_m: points_m.to_vec(),
        closed,
        drs: Vec::new(),
        surface: surface.to_vec(),
    };
    let gates = Gates {
        energy_mj,
        ..Gates::OPEN
    };
    let plan = EnergyPlan::whole(n, n / 2, mode);
    let strategy = Strategy::fixed(gates, 1);
    let objectives = [HybridObjective::LapTime];
    let problem = HybridProblem::new(line, car.clone(), plan, strategy, &objectives, entry_mps).unwrap();
    let (lap, segments, course) = problem.lap(&[]);
    (lap, segments, course.length)
}

/// The road to heights (m) at the ends of segments, straight on, 10 m apart in the plan view.
fn straight(z_m: &[f64]) -> (Vec<DVec2>, Vec<Surface>) {
    let points = (0..z_m.len()).map(|i| DVec2::new(10.0 * i as f64, 0.0)).collect();
    (points, z_m.iter().map(|z| [*z, 0.0, 1.0, 0.0]).collect())
}

/// A level and dry road that is given as one of heights has the lap and the accounts of the plane: to 1e-6 and what the passes make of
/// it, as corner speeds are from a table on a level road.
#[test]
fn a_surface_without_height_changes_nothing() {
    let climber = climber(car().clone());
    let road = (&oval()[..], true);
    let flat = vec![[7.0, 0.0, 1.0, 0.0]; 300];
    for what in [(Mode::Offset, 1.0), (Mode::Additional, 1.0)] {
        let (level, ..) = lap_of(&climber, road, &[], what, 0.0);
        let (found, ..) = lap_of(&climber, road, &flat, what, 0.0);
        for (found, level) in found.to_array().iter().zip(level.to_array()) {
            assert!(
                (found - level).abs() <= 1e-5 * level.abs().max(1e4),
                "{found} for {level}"
            );
        }
        assert!((found.time / level.time - 1.0).abs() < 4e-6);
    }
}

/// What engine, motor and brakes do at the wheels is what the air and the tyres take, what the car gains in speed, and what it gains in
/// height, whatever the hills: the height comes from the survey, not from the kernel.
#[test]
fn a_climb_takes_its_height_from_the_wheels() {
    let z = |i: i32| 0.07 * 10.0 * f64::from(i) + 12.0 * (f64::from(i) / 25.0).sin();
    let z_m: Vec<f64> = (0..200).map(z).collect();
    let (points, surface) = straight(&z_m);
    let car = climber(car().clone());
    let (mass, envelope) = (car.table.mass, &car.point_mass.envelope);
    for what in [(Mode::Offset, 0.5), (Mode::Additional, 0.5)] {
        let (lap, segments, length) = lap_of(&car, (&points, false), &surface, what, 25.0);
        assert!(lap.deployed > 0.4e6, "{}", lap.deployed);
        let (mut wheels_j, mut taken_j) = (0.0, 0.0);
        for (s, h) in segments.iter().zip(&length) {
            let mean = (0.5 * (s.start + s.end)).sqrt();
            wheels_j += mass * h * (s.engine + s.motor - s.generator - s.hydraulic);
            taken_j += mass * h * (s.lost + envelope.at(mean).drag_mps2);
        }
        let (first, last) = (segments[0].start, segments[segments.len() - 1].end);
        let speed_j = 0.5 * 1.1 * mass * (last - first);
        let height_j = mass * GRAVITY_MPS2 * (z_m[199] - z_m[0]);
        assert!(height_j > 1e6);
        // Rows of the tables are straight lines over the speed squared, which the drag is not between two speeds of the envelope.
        let error = wheels_j - taken_j - speed_j - height_j;
        assert!(error.abs() < 2e-3 * taken_j, "{error} J of {wheels_j} J");
    }
}

/// On a long climb the car comes to the speed at which the engine at full load gives what the air takes and what lifts the car. The
/// mass that rotates has no part in it.
#[test]
fn a_long_climb_ends_at_the_speed_that_the_engine_can_hold() {
    let sine = 0.2;
    let rise = 10.0 * sine / f64::sqrt(1.0 - sine * sine);
    let z_m: Vec<f64> = (0..900).map(|i| rise * f64::from(i)).collect();
    let (points, surface) = straight(&z_m);
    let car = climber(car_without_h());
    let (_, segments, _) = lap_of(&car, (&points, false), &surface, (Mode::Offset, 0.0), 40.0);
    let last = segments[segments.len() - 1];
    let speed = last.end.sqrt();
    // What it would gain on the level, less what the driven tyres take: on the level all that rotates gains speed, too.
    let limits = car.point_mass.envelope.at(speed);
    let gained = limits.ax_drive_mps2 - limits.drag_mps2 - last.lost;
    let spare = 1.1 * gained - GRAVITY_MPS2 * sine;
    assert!(spare.abs() < 2e-3, "{spare} m/s^2 of {gained} at {speed} m/s");
    // Between its rows of 4 m/s the envelope's drive is straight, and the engine's is not.
    assert!(last.load > 0.98, "{}", last.load);
}

/// The same stretch takes more time and fuel uphill than on the level, and less time downhill.
#[test]
fn a_climb_takes_time_and_fuel() {
    let car = climber(car_without_h());
    let of = |per_m: f64| {
        let z_m: Vec<f64> = (0..100).map(|i| per_m * 10.0 * f64::from(i)).collect();
        let (points, surface) = straight(&z_m);
        lap_of(&car, (&points, false), &surface, (Mode::Offset, 0.0), 50.0)
    };
    let (up, level, down) = (of(0.06), of(0.0), of(-0.06));
    assert!(up.0.time > level.0.time && level.0.time > down.0.time);
    assert!(up.0.fuel > level.0.fuel, "{} {}", up.0.fuel, level.0.fuel);
}

/// The lap of the engine alone is the quasi-steady-state lap of the line's kernel on hills, banking and a slippery road: both passes of
/// that against braking first and driving after. On the oval they are the same to second order in its 7 m steps. So they are with a
/// car whose steering is too slow for its speed.
#[test]
fn the_engine_alone_has_the_lap_of_the_line_on_any_road() {
    let points = oval();
    let n = points.len();
    let surface: Vec<Surface> = (0..n)
        .map(|i| {
            let angle = TAU * i as f64 / n as f64;
            let friction = 0.8 + 0.15 * (2.0 * angle).cos();
            [14.0 * angle.sin(), 0.06 * (3.0 * angle).cos(), friction, 0.0]
        })
        .collect();
    let usual = climber(car_without_h());
    let shape = geometry(&points, true);
    let relief = LineRelief::of(&shape.segment_m, &shape.curvature_1pm, surface.clone());
    let view = (&shape.segment_m[..], &shape.curvature_1pm[..]);
    let laps = |car: &EnergyCar| {
        let of_line = |relief: Option<&LineRelief>| {
            lap_profile_on(&car.point_mass, &car.envelope_table, view, relief, 0.0, &[])
                .unwrap()
                .time_s
        };
        let alone = |surface: &[Surface]| {
            let what = (Mode::Offset, 0.0);
            lap_of(car, (&points, true), surface, what, 0.0).0.time
        };
        let (level, found) = (alone(&[]), alone(&surface));
        assert!((level / of_line(None) - 1.0).abs() < 1e-3, "{level}");
        assert!(
            (found / of_line(Some(&relief)) - 1.0).abs() < 1e-3,
            "{found} for {}",
            of_line(Some(&relief))
        );
        [level, found]
    };
    let [level, found] = laps(&usual);
    assert!(
        found > 1.01 * level,
        "{found} s on a slippery road, {level} s on a dry one"
    );
    let slow = PointMass {
        max_steer_rate_radps: Some(0.002),
        ..usual.point_mass.clone()
    };
    let traction = Traction::of(&usual.car, &slow.envelope);
    let slow = EnergyCar::of(usual.car.clone(), slow, traction).unwrap();
    for (slow, usual) in laps(&slow).iter().zip([level, found]) {
        assert!(
            *slow > 1.01 * usual,
            "{slow} s with slow steering, {usual} s else"
        );
    }
}

/// A surface that is not one for each point, or a car that knows no loads, is refused.
#[test]
fn a_surface_asks_for_a_car_that_knows_loads() {
    let (points, surface) = straight(&[0.0; 20]);
    let refused = |car: &EnergyCar, surface: &[Surface]| {
        let line = HybridLine::Fixed {
            points_m: points.clone(),
            closed: false,
            drs: Vec::new(),
            surface: surface.to_vec(),
        };
        let (plan, strategy) = (
            EnergyPlan::whole(20, 10, Mode::Offset),
            Strategy::fixed(Gates::OPEN, 1),
        );
        let objectives = [HybridObjective::LapTime];
        HybridProblem::new(line, car.clone(), plan, strategy, &objectives, 20.0).is_err()
    };
    let climber = climber(car().clone());
    assert!(!refused(&climber, &surface) && refused(&climber, &surface[..19]));
    assert!(refused(car(), &surface) && !refused(car(), &[]));
}
