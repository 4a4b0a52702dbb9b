//! Laps on roads that are not level and dry, against cases worked by hand.

use super::ground::{Ground, Grounds, Sloped, SlopedRoad};
use super::kernel::{self, Course, Wanted, lap_time, shape};
use super::*;
use crate::track::{CrossSections, FrictionAcross, SectionRelief};
use crate::vehicle::powertrain::GRAVITY_MPS2;
use crate::vehicle::{BendTraction, Envelope, EnvelopeRow};
use glam::DVec2;
use std::f64::consts::{PI, TAU};

const LAP: Wanted = Wanted {
    integral: false,
    lap: true,
};

/// A car of these limits at every speed (m/s^2): lateral, grip, drive and drag.
fn car([ay_mps2, ax_grip_mps2, ax_drive_mps2, drag_mps2]: [f64; 4], top_mps: f64) -> PointMass {
    let row = |v_mps: f64| EnvelopeRow {
        v_mps,
        ay_mps2,
        ax_grip_mps2,
        ax_drive_mps2,
        drag_mps2,
    };
    let rows = (1..=10).map(|i| row(top_mps * f64::from(i) / 10.0)).collect();
    PointMass {
        relief: true,
        ..PointMass::new(Envelope::new("made up", rows).unwrap(), 2.6)
    }
}

/// A wavy ring road, driven anticlockwise, whose height and banking at an angle are given.
fn ring(
    sections: usize,
    radius_m: impl Fn(f64) -> f64,
    width_m: f64,
    relief: impl Fn(f64) -> [f64; 2],
) -> CrossSections {
    let angle = |i: usize| TAU * i as f64 / sections as f64;
    let at = |i: usize, out: f64| (radius_m(angle(i)) + out) * DVec2::from_angle(angle(i));
    let foot_m: Vec<DVec2> = (0..sections).map(|i| at(i, 0.0)).collect();
    let length_m = (0..sections)
        .map(|i| foot_m[i].distance(foot_m[(i + 1) % sections]))
        .sum();
    CrossSections {
        name: "ring".to_owned(),
        closed: true,
        length_m,
        station_m: (0..sections)
            .map(|i| length_m * i as f64 / sections as f64)
            .collect(),
        right_m: (0..sections).map(|i| at(i, 0.5 * width_m)).collect(),
        left_m: (0..sections).map(|i| at(i, -0.5 * width_m)).collect(),
        reference: vec![0.5; sections],
        sections: Vec::new(),
        corners: Vec::new(),
        drs: Vec::new(),
        relief: Some(SectionRelief {
            foot_m,
            z_m: (0..sections).map(|i| relief(angle(i))[0]).collect(),
            bank_rad: (0..sections).map(|i| relief(angle(i))[1]).collect(),
            friction: vec![FrictionAcross::DRY; sections],
        }),
    }
}

/// The course of a line (`alpha` at every cross-section).
fn course_of(road: &CrossSections, alpha: &[f64]) -> Course<f64> {
    let mut plan = LinePlan::of_cross_sections(&road.right_m, &road.left_m, road.closed).with_relief(road);
    Parametrisation::sections().apply(road, &mut plan).unwrap();
    let mut course = Course::default();
    shape::<f64>(&plan, LAP, alpha, &mut course);
    course
}

fn ground(course: &Course<f64>, section: usize) -> Sloped<f64> {
    SlopedRoad::at(course, section, section)
}

/// At `v^2 = g R tan b` a banked circle asks for no side force, and the road carries the weight over the cosine. With friction `m`
/// the corner speed squared is `g R (sin b + m cos b) / (cos b - m sin b)`. A left-hander is banked with its right side up, which is
/// negative.
#[test]
fn a_banked_circle_needs_no_side_force_at_its_own_speed() {
    let bank = 0.3f64;
    let friction = 1.2;
    let road = ring(360, |_| 100.0, 10.0, |_| [7.0, -bank]);
    let table = car([friction * GRAVITY_MPS2, 10.0, 5.0, 0.0], 80.0)
        .table()
        .unwrap();
    for (alpha, radius) in [(0.5, 100.0), (0.0, 105.0), (1.0, 95.0)] {
        let course = course_of(&road, &[alpha; 360]);
        let there = ground(&course, 17);
        let w = GRAVITY_MPS2 * radius * bank.tan();
        assert!(there.across(w).abs() < 1e-9, "{}", there.across(w));
        assert!((there.load(w) - GRAVITY_MPS2 / bank.cos()).abs() < 1e-9);
        let (sin, cos) = bank.sin_cos();
        let wanted = GRAVITY_MPS2 * radius * (sin + friction * cos) / (cos - friction * sin);
        let found = kernel::corner::<f64>(&table, there);
        assert!((found / wanted - 1.0).abs() < 1e-9, "{found} for {wanted}");
    }
    // Banked the wrong way it holds less: `(m cos b - sin b) / (cos b + m sin b)`.
    let course = course_of(&ring(360, |_| 100.0, 10.0, |_| [0.0, bank]), &[0.5; 360]);
    let (sin, cos) = bank.sin_cos();
    let wanted = GRAVITY_MPS2 * 100.0 * (friction * cos - sin) / (cos + friction * sin);
    let found = kernel::corner::<f64>(&table, ground(&course, 17));
    assert!((found / wanted - 1.0).abs() < 1e-9, "{found} for {wanted}");
}

/// A crest of radius `R` takes `v^2 / R` of the load, a dip adds it. On an arc of the radius in a vertical plane, at the top of which
/// gravity is square to the road.
#[test]
fn a_crest_unloads_by_the_speed_squared_over_its_radius() {
    let radius = 400.0f64;
    // Stations on the map, so that the points lie on the arc.
    let angles: Vec<f64> = (-40..=40).map(|i| f64::from(i) / 400.0).collect();
    let level: Vec<f64> = angles.iter().map(|a| radius * a.sin()).collect();
    let segment_m: Vec<f64> = level.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let n = angles.len();
    for (way, kind) in [(1.0, "crest"), (-1.0, "dip")] {
        let surface = angles
            .iter()
            .map(|a| [way * radius * (a.cos() - 1.0), 0.0, 1.0, 0.0]);
        let line = LineRelief::of(&segment_m, &vec![0.0; n], surface.collect());
        let forces = line.forces_mps2(&vec![40.0; n], &vec![0.0; n]);
        let [_, across, load, _] = forces[n / 2];
        let wanted = GRAVITY_MPS2 - way * 1600.0 / radius;
        // Chords of an arc of 2.5 mrad turn by its angle; their lengths are short by a part in a million.
        assert!((load - wanted).abs() < 1e-5, "{kind}: {load} for {wanted}");
        assert!(across.abs() < 1e-12);
    }
}

/// Uphill the engine's work is speed and height: `v^2 = v0^2 + 2 (a s - g z)`, whatever the profile. Curves are too wide to limit.
#[test]
fn a_hill_climb_balances_its_energy() {
    let n = 200;
    let level: Vec<f64> = (0..n).map(|i| 2.0 * i as f64).collect();
    let z_m: Vec<f64> = level.iter().map(|s| 12.0 * (s / 60.0).sin() + 0.03 * s).collect();
    let climbed = z_m[n - 1] - z_m[0];
    let surface = z_m.iter().map(|z| [*z, 0.0, 1.0, 0.0]).collect();
    let line = LineRelief::of(&vec![2.0; n - 1], &vec![0.0; n], surface);
    let (drive, start) = (3.0, 25.0);
    let car = car([200.0, 200.0, drive, 0.0], 200.0);
    let lap = lap_profile_on(
        &car,
        &car.table().unwrap(),
        (&vec![2.0; n - 1], &vec![0.0; n]),
        Some(&line),
        start,
        &[],
    )
    .unwrap();
    let along: f64 = line.length_m.iter().sum();
    let wanted = start * start + 2.0 * (drive * along - GRAVITY_MPS2 * climbed);
    let found = lap.v_mps[n - 1].powi(2);
    assert!((found / wanted - 1.0).abs() < 1e-12, "{found} for {wanted}");
    assert!(climbed > 5.0 && along > 2.0 * (n - 1) as f64);
    // The tyres push with what the engine gives, at every place.
    let pushed = lap.forces_mps2[..n - 1].iter().map(|f| (f[0] - drive).abs());
    assert!(pushed.fold(0.0, f64::max) < 1e-9);
}

/// A road that rises, falls and is banked, and a line that wanders over it.
fn hills() -> (CrossSections, Vec<f64>) {
    let road = ring(
        720,
        |a| 600.0 + 60.0 * (2.0 * a).sin() + 20.0 * (5.0 * a).cos(),
        12.0,
        |a| [20.0 * a.sin() + 4.0 * (6.0 * a).cos(), 0.12 * (3.0 * a).sin()],
    );
    let alpha = (0..720)
        .map(|i| 0.5 + 0.4 * (0.05 * PI * f64::from(i)).sin())
        .collect();
    (road, alpha)
}

/// What gravity gives downhill it takes uphill.
#[test]
fn gravity_does_no_work_on_a_closed_lap() {
    let (road, alpha) = hills();
    let course = course_of(&road, &alpha);
    let work = course
        .length
        .iter()
        .zip(&course.relief)
        .map(|(h, relief)| h * relief[1]);
    let most: f64 = work.clone().map(f64::abs).sum();
    let all: f64 = work.sum();
    assert!(most > 100.0 && all.abs() < 1e-12 * most, "{all} of {most}");
}

/// The frame is a frame: gravity's three parts have its size.
#[test]
fn gravity_keeps_its_size_in_the_frame_of_the_road() {
    let (road, alpha) = hills();
    let course = course_of(&road, &alpha);
    for i in 1..719 {
        let [_, climb, lean, press, _] = course.relief[i];
        let before = course.relief[i - 1][1];
        let size = (0.25 * (climb + before).powi(2) + lean * lean + press * press).sqrt();
        assert!((size / GRAVITY_MPS2 - 1.0).abs() < 1e-12, "{size} at {i}");
    }
}

/// A level road given as heights and banking of zero has the lap of the plane: to 1e-6, by which the table of corner speeds is off
/// from the corner speed itself, twice over. All its bends are to one side, because kernels of level roads know no signs: half-way from a
/// left bend to a right one they have the mean of both.
#[test]
fn height_and_banking_of_zero_are_the_level_lap() {
    let radius = |a: f64| 600.0 + 60.0 * (2.0 * a).sin();
    let zero = ring(720, radius, 12.0, |_| [3.0, 0.0]);
    let hilly = ring(720, radius, 12.0, |a| [20.0 * a.sin(), 0.05 * (3.0 * a).sin()]);
    let level = CrossSections {
        relief: None,
        ..zero.clone()
    };
    let table = car([9.0, 8.0, 6.0, 1.0], 90.0).table().unwrap();
    let time = |road: &CrossSections| {
        let mut course = course_of(road, &[0.5; 720]);
        let time = lap_time::<f64>(&table, true, 0, 0.0, &mut course);
        (time, course)
    };
    let ((flat_s, flat), (found_s, found)) = (time(&level), time(&zero));
    assert!((found_s / flat_s - 1.0).abs() < 2e-6, "{found_s} for {flat_s}");
    for i in 0..720 {
        assert!((flat.length[i] - found.length[i]).abs() < 1e-12);
        assert!((flat.curvature[i] - found.curvature[i]).abs() < 1e-12);
    }
    let (hilly_s, _) = time(&hilly);
    assert!(
        (hilly_s / flat_s - 1.0).abs() > 1e-3,
        "{hilly_s} on hills, {flat_s}"
    );
}

/// The lap through cross-sections is that of the fine spline, as on level roads: both see the same heights.
#[test]
fn the_fine_line_has_the_lap_of_the_cross_sections() {
    let (road, _) = hills();
    let alpha = vec![0.5; 720];
    let car = car([15.0, 14.0, 6.0, 1.0], 70.0);
    let table = car.table().unwrap();
    let mut course = course_of(&road, &alpha);
    let coarse_s = lap_time::<f64>(&table, true, 0, 0.0, &mut course);
    let points = road.points(&alpha);
    let relief = road.relief_of(&points).unwrap();
    let fine = FineLine::on(&points, Some(&relief), true, 1.0, Some((&car, &[])), 0.0).unwrap();
    let fine_s = fine.lap_time_s().unwrap();
    assert!((coarse_s / fine_s - 1.0).abs() < 1e-3, "{coarse_s} for {fine_s}");
    // Between the cross-sections heights are those of the road.
    let along = road.relief_along(&fine.points_m).unwrap();
    let own = fine.relief.as_ref().unwrap();
    let off = along
        .iter()
        .zip(&own.surface)
        .map(|(a, own)| (a[0] - own[0]).abs())
        .fold(0.0, f64::max);
    assert!(off < 0.02, "{off}");
}

/// Losses in bends that fall from 2 to 0.5 m/s^2 over the loads that were swept. Beyond these they fall to nothing, and give nothing
/// back.
#[test]
fn tyres_give_nothing_back_beyond_the_loads_that_were_swept() {
    let under = |lost: f64| {
        let limits = car([15.0, 14.0, 5.0, 1.0], 70.0).envelope;
        let rows = limits.rows().len();
        let in_bends = BendTraction {
            shares: vec![0.0, 1.0],
            rows: vec![vec![14.0, 0.0]; rows],
            lost: vec![vec![lost; 2]; rows],
        };
        limits.with_bend_traction(in_bends).unwrap()
    };
    let envelope = under(1.25).with_loads(vec![(0.6, under(2.0)), (1.0, under(1.25)), (1.4, under(0.5))]);
    let car = PointMass {
        relief: true,
        ..PointMass::new(envelope.unwrap(), 2.6)
    };
    let table = car.table().unwrap();
    for (share, wanted) in [(0.6, 2.0), (1.2, 0.875), (1.6, 0.125), (1.8, 0.0), (2.4, 0.0)] {
        let there = Sloped {
            bend: 0.0,
            dip: 0.0,
            climb: 0.0,
            lean: 0.0,
            press: share * GRAVITY_MPS2,
            friction: 1.0,
        };
        let [_, lost] = Ground::<f64>::left_for_driving(there, &table, 900.0, 1.0);
        assert!((lost - wanted).abs() < 1e-9, "{share}: {lost}");
    }
}

/// Swept limits are met at their own loads, and between them half-way.
#[test]
fn limits_under_a_load_are_those_that_were_swept() {
    let at = |ay: f64| {
        let limits = car([ay, 0.9 * ay, 5.0, 1.0], 70.0);
        limits.envelope
    };
    let envelope = at(15.0).with_loads(vec![(0.6, at(10.0)), (1.0, at(15.0)), (1.4, at(18.0))]);
    let car = PointMass {
        relief: true,
        ..PointMass::new(envelope.unwrap(), 2.6)
    };
    let table = car.table().unwrap();
    for (share, wanted) in [
        (0.6, 10.0),
        (0.8, 12.5),
        (1.0, 15.0),
        (1.4, 18.0),
        (0.2, 5.0),
        (1.8, 21.0),
    ] {
        let there = Sloped {
            bend: 0.0,
            dip: 0.0,
            climb: 0.0,
            lean: 0.0,
            press: share * GRAVITY_MPS2,
            friction: 1.0,
        };
        let ([lateral, grip, drive, drag], root) = Ground::<f64>::limits(there, &table, 900.0);
        assert!(
            (lateral - wanted).abs() < 1e-9 && (grip - 0.9 * wanted).abs() < 1e-9,
            "{share}: {lateral}"
        );
        assert!((drive - 5.0).abs() < 1e-9 && (drag - 1.0).abs() < 1e-9 && root == 1.0);
        let used = car.grip_used_under(30.0, [0.0, wanted, share * GRAVITY_MPS2, 1.0]);
        let across = used.powi(2) - (1.0 / (0.9 * wanted)).powi(2);
        assert!((across - 1.0).abs() < 1e-9, "{share}: {used}");
    }
}

/// A flat ring of 100 m whose friction is so much on the middle and gains so much per metre to the left, which is its inside.
fn slippery_ring(friction: [f64; 2]) -> CrossSections {
    let mut road = ring(360, |_| 100.0, 10.0, |_| [0.0, 0.0]);
    road.relief.as_mut().unwrap().friction = vec![FrictionAcross::linear(friction, [5.0; 2]); 360];
    road
}

/// On a circle the corner speed squared is `f m g R`; across the road `f` is that of the place.
#[test]
fn the_corner_speed_goes_with_the_friction_of_the_place() {
    let road = slippery_ring([0.7, -0.04]);
    let table = car([12.0, 10.0, 5.0, 0.0], 80.0).table().unwrap();
    for (alpha, radius, friction) in [(0.5, 100.0, 0.7), (0.0, 105.0, 0.9), (1.0, 95.0, 0.5)] {
        let there = ground(&course_of(&road, &[alpha; 360]), 17);
        assert!((there.friction - friction).abs() < 1e-12, "{}", there.friction);
        let wanted = friction * 12.0 * radius;
        let found = kernel::corner::<f64>(&table, there);
        assert!((found / wanted - 1.0).abs() < 1e-9, "{found} for {wanted}");
    }
    // A wet strip in the middle of the road is where it is for a car that uses less of it.
    let mut road = road;
    let strip = FrictionAcross {
        right_m: 5.0,
        left_m: 5.0,
        of: [1.0, 1.0, 0.5, 1.0, 0.9],
    };
    road.relief.as_mut().unwrap().friction = vec![strip; 360];
    let narrow = road.narrowed(2.0).unwrap();
    for (share, friction) in [(0.1, 1.0), (0.4, 0.7), (0.5, 0.5), (0.6, 0.7), (0.85, 0.96)] {
        for (road, alpha) in [(&road, share), (&narrow, (10.0 * share - 1.0) / 8.0)] {
            let there = ground(&course_of(road, &[alpha; 360]), 17);
            assert!(
                (there.friction - friction).abs() < 1e-9,
                "{share}: {}",
                there.friction
            );
        }
    }
}

/// Straight on, brakes and driven tyres have the friction's share of the grip, and the engine has what it had. In a bend at its limit
/// nothing is left, and what the tyres take from the drive goes with the square.
#[test]
fn brakes_and_traction_go_with_the_friction_and_the_engine_does_not() {
    let at = |friction: f64| Sloped {
        bend: 0.0,
        dip: 0.0,
        climb: 0.0,
        lean: 0.0,
        press: GRAVITY_MPS2,
        friction,
    };
    let (grip, engine, drag) = (10.0, 4.0, 0.5);
    let table = car([12.0, grip, engine, drag], 80.0).table().unwrap();
    for friction in [0.1, 0.3, 0.6, 1.0, 1.2] {
        let braking = kernel::deceleration::<f64>(&table, 900.0, at(friction));
        assert!(
            (braking - friction * grip - drag).abs() < 1e-9,
            "{friction}: {braking}"
        );
        let driving = kernel::acceleration::<f64>(&table, false, 900.0, at(friction));
        let wanted = engine.min(friction * grip) - drag;
        assert!((driving - wanted).abs() < 1e-9, "{friction}: {driving}");
        let bend = Sloped {
            bend: friction * 12.0 / 900.0,
            ..at(friction)
        };
        let braking = kernel::deceleration::<f64>(&table, 900.0, bend);
        assert!((braking - drag).abs() < 1e-6, "{friction}: {braking}");
    }
    let limits = car([12.0, 10.0, 5.0, 0.0], 80.0).envelope;
    let rows = limits.rows().len();
    let in_bends = BendTraction {
        shares: vec![0.0, 1.0],
        rows: vec![vec![10.0, 0.0]; rows],
        lost: vec![vec![0.8; 2]; rows],
    };
    let taking = PointMass {
        relief: true,
        ..PointMass::new(limits.with_bend_traction(in_bends).unwrap(), 2.6)
    };
    let table = taking.table().unwrap();
    let [_, lost] = Ground::<f64>::left_for_driving(at(0.5), &table, 900.0, 0.6);
    assert!((lost - 0.2).abs() < 1e-9, "{lost}");
}

/// A lap says that it uses all of the grip where it is at the limit, however slippery the road.
#[test]
fn the_grip_used_is_that_of_the_slippery_road() {
    let road = slippery_ring([0.6, 0.0]);
    let car = car([12.0, 10.0, 8.0, 0.0], 80.0);
    let points = road.points(&[0.5; 360]);
    let relief = road.relief_of(&points).unwrap();
    let fine = FineLine::on(&points, Some(&relief), true, 1.0, Some((&car, &[])), 0.0).unwrap();
    let lap = fine.lap.as_ref().unwrap();
    let wanted_s = TAU * 100.0 / (0.6f64 * 12.0 * 100.0).sqrt();
    assert!(
        (lap.time_s / wanted_s - 1.0).abs() < 1e-5,
        "{} for {wanted_s}",
        lap.time_s
    );
    for used in lap.grip_used(&car) {
        assert!((used - 1.0).abs() < 1e-3, "{used}");
    }
}
