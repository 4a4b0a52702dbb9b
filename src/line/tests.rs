use super::kernel::{Course, Wanted, lap_time, shape};
use super::*;
use crate::optimum::{GripEnvelope, PointMassEnvelope};
use crate::scalar::Dual;
use crate::track::CrossSections;
use crate::vehicle::limits::{SpeedRange, car_envelope};
use crate::vehicle::{BendTraction, Car, Envelope, EnvelopeRow};
use glam::DVec2;
use std::f64::consts::{PI, TAU};

/// A ring road driven anticlockwise: the right edge is the outer one.
fn ring(inner_m: f64, outer_m: f64, sections: usize) -> CrossSections {
    let at = |radius: f64, i: usize| radius * DVec2::from_angle(TAU * i as f64 / sections as f64);
    let length_m = PI * (inner_m + outer_m);
    CrossSections {
        name: "ring".to_owned(),
        closed: true,
        length_m,
        station_m: (0..sections)
            .map(|i| length_m * i as f64 / sections as f64)
            .collect(),
        right_m: (0..sections).map(|i| at(outer_m, i)).collect(),
        left_m: (0..sections).map(|i| at(inner_m, i)).collect(),
        reference: vec![0.5; sections],
        sections: Vec::new(),
        corners: Vec::new(),
        drs: Vec::new(),
        relief: None,
    }
}

fn car(limits: impl Fn(f64) -> [f64; 4], top_mps: f64) -> PointMass {
    let rows = (1..=280).map(|i| {
        let v_mps = top_mps * f64::from(i) / 280.0;
        let [ay_mps2, ax_grip_mps2, ax_drive_mps2, drag_mps2] = limits(v_mps);
        EnvelopeRow {
            v_mps,
            ay_mps2,
            ax_grip_mps2,
            ax_drive_mps2,
            drag_mps2,
        }
    });
    PointMass::new(Envelope::new("test car", rows.collect()).unwrap(), 2.6)
}

/// A GT car: 1245 kg, 330 kW, CdA 0.9 m^2, with downforce.
fn gt_car() -> PointMass {
    car(
        |v| {
            let share = (v * v - 625.0) / (4225.0 - 625.0);
            let drive = 330e3 / (1245.0 * v);
            [
                15.0 + 3.0 * share,
                14.0 + 4.0 * share,
                drive,
                0.5 * 1.2 * 0.9 / 1245.0 * v * v,
            ]
        },
        70.0,
    )
}

#[test]
fn circles_have_the_length_and_curvature_of_their_polygons() {
    let cross_sections = ring(590.0, 600.0, 361);
    for (alpha, radius) in [(0.0, 600.0), (1.0, 590.0), (0.5, 595.0)] {
        let found = geometry(&cross_sections.points(&vec![alpha; 361]), true);
        let side = 2.0 * radius * (PI / 361.0).sin();
        assert!((found.length_m - 361.0 * side).abs() < 1e-9, "{}", found.length_m);
        assert!((found.length_squared_m2 - 361.0 * side * side).abs() < 1e-9 * 361.0 * side);
        assert!(
            found
                .curvature_1pm
                .iter()
                .all(|k| (k * radius - 1.0).abs() < 1e-9)
        );
        assert!((found.gamma_1pm - 19.0 / radius).abs() < 1e-9);
        let integral = 361.0 * (TAU / 361.0).powi(2) / side;
        assert!((found.integral_kappa2_1pm - integral).abs() < 1e-9);
    }
}

#[test]
fn a_lap_at_constant_grip_takes_what_it_must() {
    let car = car(|_| [12.0, 10.0, 5.0, 0.0], 100.0);
    let table = car.table().unwrap();
    let shape = geometry(&ring(590.0, 600.0, 361).points(&[0.5; 361]), true);
    let lap = lap_profile(&car, &table, &shape.segment_m, &shape.curvature_1pm, 0.0, &[]).unwrap();
    let speed = (12.0f64 * 595.0).sqrt();
    assert!(
        lap.v_mps.iter().all(|v| (v - speed).abs() < 1e-8 * speed),
        "{}",
        lap.v_mps[0]
    );
    assert!((lap.time_s - shape.length_m / speed).abs() < 1e-8 * lap.time_s);
    assert!((lap.ay_mps2[0] - 12.0).abs() < 1e-7 && lap.ax_mps2[0].abs() < 1e-9);
    assert!((lap.steering_rad[0] - 2.6 / 595.0).abs() < 1e-12);
}

#[test]
fn a_straight_is_left_at_the_speed_of_constant_acceleration() {
    let car = car(|_| [12.0, 10.0, 5.0, 0.0], 100.0);
    let table = car.table().unwrap();
    let points: Vec<DVec2> = (0..50).map(|i| DVec2::new(7.0 * f64::from(i), 3.0)).collect();
    let shape = geometry(&points, false);
    let lap = lap_profile(&car, &table, &shape.segment_m, &shape.curvature_1pm, 20.0, &[]).unwrap();
    let distance = 7.0 * 49.0;
    let speed = (400.0f64 + 2.0 * 5.0 * distance).sqrt();
    assert!((lap.v_mps[49] - speed).abs() < 1e-9);
    assert!((lap.time_s - (speed - 20.0) / 5.0).abs() < 1e-9);
    assert!(lap.ax_mps2.iter().all(|a| (a - 5.0).abs() < 1e-9));
    assert!((lap.elapsed_s()[49] - lap.time_s).abs() < 1e-12);
}

#[test]
fn corner_speed_meets_the_lateral_limit_or_never_binds() {
    let car = gt_car();
    let table = car.table().unwrap();
    for radius in [8.0, 20.0, 77.7, 150.0, 240.0, 260.0] {
        let w = kernel::corner::<f64>(&table, 1.0 / radius);
        let limit = car.envelope.at(w.sqrt()).ay_mps2;
        // Half a table step bends by 1e-6 of the whole; the limits' own steps add as much.
        assert!((w / radius - limit).abs() < 2e-4 * limit, "{radius}: {w}");
    }
    // Lateral grip at 70 m/s is 18.6 m/s^2, so that no bend wider than 264 m slows the car.
    assert_eq!(kernel::corner::<f64>(&table, 1.0 / 300.0), 4900.0);
    assert_eq!(kernel::corner::<f64>(&table, 0.0), 4900.0);
    let locked = PointMass {
        max_steer_rad: Some(0.1745),
        ..car
    };
    let locked = locked.table().unwrap();
    let at = |table: &EnvelopeTable<f64>, radius: f64| kernel::corner::<f64>(table, 1.0 / radius);
    assert_eq!(at(&table, 20.0), at(&locked, 20.0));
    assert!(at(&locked, 10.0) < 0.3 * at(&table, 10.0));
}

/// A clothoid of 0.0002 1/m per metre between a straight and a bend of 50 m, in and out. A steering rate of 0.0104 rad/s over 2.6 m is
/// 0.004 1/(m s): 20 m/s, where the bend itself is taken at 27 m/s.
#[test]
fn slow_steering_holds_the_car_back_where_curvature_changes() {
    let free = gt_car();
    let steered = PointMass {
        max_steer_rate_radps: Some(0.0104),
        ..free.clone()
    };
    let ramp = (0..20).map(|i| 0.001 * f64::from(i));
    let bend = std::iter::repeat_n(0.02, 40);
    let straight = std::iter::repeat_n(0.0, 100);
    let curvature: Vec<f64> = straight
        .chain(ramp.clone())
        .chain(bend)
        .chain(ramp.rev())
        .collect();
    // To the other side, too.
    for sign in [1.0, -1.0] {
        let curvature: Vec<f64> = curvature.iter().map(|k| sign * k).collect();
        let lap = |car: &PointMass| {
            let table = car.table().unwrap();
            lap_profile(car, &table, &vec![5.0; curvature.len()], &curvature, 10.0, &[]).unwrap()
        };
        let (free, steered) = (lap(&free), lap(&steered));
        assert!(
            free.steering_rate_radps() > 0.0135,
            "{}",
            free.steering_rate_radps()
        );
        assert!((steered.steering_rate_radps() - 0.0104).abs() < 1e-9);
        assert!(free.time_s + 1.0 < steered.time_s);
        assert!((steered.v_mps[110] - 20.0).abs() < 1e-9, "{}", steered.v_mps[110]);
        assert!(steered.v_mps[140] > 24.0 && steered.v_mps[50] > 40.0);
    }
    let bad = PointMass {
        max_steer_rate_radps: Some(0.0),
        ..gt_car()
    };
    assert!(
        bad.table()
            .unwrap_err()
            .to_string()
            .contains("max_steer_rate_radps")
    );
}

#[test]
fn other_exponents_bulge_the_ellipse() {
    let table = |exponent| {
        let car = PointMass {
            ellipse_exponent: exponent,
            ..gt_car()
        };
        car.table().unwrap()
    };
    let half = |exponent: f64| {
        let table = table(exponent);
        let brake = kernel::deceleration::<f64>(&table, 900.0, 0.5 * 15.229 / 900.0);
        (brake - 0.5 * 1.2 * 0.9 / 1245.0 * 900.0) / 14.3056
    };
    for exponent in [1.0f64, 1.5, 2.0, 2.5] {
        let expected = (1.0 - 0.5f64.powf(exponent)).powf(1.0 / exponent);
        assert!(
            (half(exponent) - expected).abs() < 1e-4,
            "{exponent}: {}",
            half(exponent)
        );
    }
    let bad = PointMass {
        ellipse_exponent: 0.5,
        ..gt_car()
    };
    assert!(bad.table().unwrap_err().to_string().contains("ellipse_exponent"));
}

/// A wavy ring: corners of many radii.
fn wavy(sections: usize) -> Vec<DVec2> {
    (0..sections)
        .map(|i| {
            let angle = TAU * i as f64 / sections as f64;
            let radius = 300.0 + 60.0 * (3.0 * angle).sin() + 25.0 * (8.0 * angle).cos();
            radius * DVec2::from_angle(angle)
        })
        .collect()
}

#[test]
fn a_closed_lap_does_not_depend_on_where_its_passes_start() {
    let table = gt_car().table().unwrap();
    let shape = geometry(&wavy(400), true);
    let time = |start: usize| {
        let mut course = Course {
            length: shape.segment_m.clone(),
            curvature: shape.curvature_1pm.iter().map(|k| k.abs()).collect(),
            ..Course::default()
        };
        let time = lap_time::<f64>(&table, true, start, 0.0, &mut course);
        (time, course.speed_squared)
    };
    let first = time(0);
    assert!(first.0 > 20.0 && first.0 < 80.0);
    for start in [1, 57, 200, 399] {
        assert_eq!(time(start), first);
    }
}

#[test]
fn coarse_grids_come_close_to_fine_ones() {
    let car = gt_car();
    let time = |sections| {
        let line = FineLine::new(&wavy(sections), true, 1000.0, Some((&car, &[])), 0.0).unwrap();
        line.lap_time_s().unwrap()
    };
    let reference = time(12_800);
    let errors = [200, 400, 800].map(|n| (time(n) - reference).abs() / reference);
    println!("{reference} s, relative errors {errors:?}");
    // From 9 m between sections to 2 m; a first-order pass would fall to a quarter at best.
    assert!(errors[0] < 1e-2 && errors[2] < errors[0] / 4.0, "{errors:?}");
}

#[test]
fn duals_give_the_gradient_of_the_lap_time() {
    let car = gt_car();
    let table = car.table().unwrap();
    let right = wavy(200);
    let left: Vec<DVec2> = right.iter().map(|p| *p * 0.97).collect();
    let cross_sections = CrossSections {
        right_m: right,
        left_m: left,
        ..ring(290.0, 300.0, 200)
    };
    let way = Parametrisation::control_points(40);
    let mut plan = LinePlan::of_cross_sections(&cross_sections.right_m, &cross_sections.left_m, true);
    way.apply(&cross_sections, &mut plan).unwrap();
    let wanted = Wanted {
        integral: true,
        lap: true,
    };
    let middle = vec![0.5; 40];
    let at = |shift: f64| {
        let mut variables = middle.clone();
        variables[7] += shift;
        let mut course = Course::default();
        let sums = shape::<f64>(&plan, wanted, &variables, &mut course);
        let time = lap_time::<f64>(&table, true, 0, 0.0, &mut course);
        [sums.length, sums.integral, time]
    };
    let mut variables: Vec<Dual<1>> = middle.iter().map(|x| Dual::constant(*x)).collect();
    variables[7] = Dual::variable(0.5, 0);
    let mut course = Course::default();
    let sums = shape(&plan, wanted, &variables, &mut course);
    let time = lap_time(&table, true, 0, Dual::constant(0.0), &mut course);
    let step = 1e-5;
    let (plus, minus) = (at(step), at(-step));
    for (i, found) in [sums.length, sums.integral, time].into_iter().enumerate() {
        let expected = (plus[i] - minus[i]) / (2.0 * step);
        assert!(
            (found.gradient[0] - expected).abs() < 1e-4 * (1.0 + expected.abs()),
            "{i}: {} and {expected}",
            found.gradient[0]
        );
    }
}

#[test]
fn control_points_give_lines_and_lines_control_points() {
    let closed = ring(590.0, 600.0, 100);
    let mut open = closed.clone();
    open.closed = false;
    for cross_sections in [&closed, &open] {
        let way = Parametrisation::control_points(17);
        let mut plan = LinePlan::of_cross_sections(
            &cross_sections.right_m,
            &cross_sections.left_m,
            cross_sections.closed,
        );
        way.apply(cross_sections, &mut plan).unwrap();
        for row in &plan.rows {
            assert!((row.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert!(row.weights.iter().all(|w| *w >= 0.0));
        }
        let coefficients: Vec<f64> = (0..17).map(|i| 0.5 + 0.4 * f64::from(i).sin()).collect();
        let alpha: Vec<f64> = plan
            .rows
            .iter()
            .map(|row| kernel::alpha(row, plan.terms, &coefficients))
            .collect();
        let back = way.fit(cross_sections, &alpha).unwrap();
        for (a, b) in back.iter().zip(&coefficients) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        // Third differences of a cubic spline are small: it is smooth.
        let rough = alpha
            .windows(4)
            .map(|a| (a[3] - 3.0 * a[2] + 3.0 * a[1] - a[0]).abs());
        assert!(rough.fold(0.0, f64::max) < 0.02);

        let some = way.with_free(vec![3, 16], coefficients.clone());
        assert_eq!(some.variables(cross_sections)[1].name, "control_16");
        some.apply(cross_sections, &mut plan).unwrap();
        let variables = some.variables_of(&coefficients);
        for (row, alpha) in plan.rows.iter().zip(&alpha) {
            assert!((kernel::alpha(row, plan.terms, &variables) - alpha).abs() < 1e-12);
        }
    }
    let ends = Parametrisation::control_points(9).with_fixed_ends(vec![0.25; 9]);
    let mut plan = LinePlan::of_cross_sections(&open.right_m, &open.left_m, false);
    ends.apply(&open, &mut plan).unwrap();
    assert!((kernel::alpha::<f64>(&plan.rows[0], 4, &[1.0; 7]) - 0.25).abs() < 1e-12);
    assert!((kernel::alpha::<f64>(&plan.rows[99], 4, &[1.0; 7]) - 0.25).abs() < 1e-12);
    for bad in [
        Parametrisation::control_points(3),
        Parametrisation::control_points(101),
        Parametrisation::sections().with_free(vec![1, 1], vec![0.5; 100]),
        Parametrisation::sections().with_free(vec![1], vec![0.5; 99]),
    ] {
        assert!(bad.apply(&open, &mut plan).is_err());
    }
}

#[test]
fn a_fine_line_knows_the_circle_that_its_points_lie_on() {
    let points = ring(590.0, 600.0, 360).points(&[0.5; 360]);
    let line = FineLine::new(&points, true, 1.0, None, 0.0).unwrap();
    assert!((line.length_m - TAU * 595.0).abs() < 1e-4, "{}", line.length_m);
    assert!(line.curvature_1pm.iter().all(|k| (k * 595.0 - 1.0).abs() < 1e-4));
    assert!((line.integral_kappa2_1pm - TAU / 595.0).abs() < 1e-6);
    assert!(line.segment_m.iter().all(|h| *h <= 1.0 + 1e-9));
    assert_eq!(line.points_m.len(), line.segment_m.len());

    let half: Vec<DVec2> = points[..181].to_vec();
    let line = FineLine::new(&half, false, 1.0, None, 0.0).unwrap();
    assert!((line.length_m - PI * 595.0).abs() < 1e-3, "{}", line.length_m);
    assert_eq!(line.points_m.len(), line.segment_m.len() + 1);
    assert!(line.curvature_1pm.iter().all(|k| (k * 595.0 - 1.0).abs() < 0.01));
    assert!(FineLine::new(&points[..2], true, 1.0, None, 0.0).is_err());
    assert!(FineLine::new(&[points[0], points[0]], false, 1.0, None, 0.0).is_err());
}

#[test]
fn clearance_is_the_distance_to_the_edges() {
    let cross_sections = ring(590.0, 600.0, 720);
    for (alpha, expected, left) in [(0.5, 4.0, true), (0.9, 0.0, true), (0.02, -0.8, false)] {
        let line = FineLine::new(&cross_sections.points(&[alpha; 720]), true, 1.0, None, 0.0).unwrap();
        let car = CarPlan {
            width_m: 2.0,
            length_m: 0.0,
        };
        let found = check_line(&line, &cross_sections.right_m, &cross_sections.left_m, &car);
        // The edges are polygons: at half a side they are 6 mm nearer the middle than the circle.
        assert!((found.margin_m - expected).abs() < 0.008, "{found:?}");
        assert!(found.left == left || alpha == 0.5);
    }
}

/// An engine of 4 m/s^2, of which the tyres take 0.2 running straight, 1 at 0.8 of the limit and 2 on it: 0.6 of the limit leaves 0.8
/// of the root, half-way from 0.8 to 1.
#[test]
fn tyres_take_from_the_engine_in_bends() {
    let free = car(|_| [12.0, 10.0, 4.0, 0.0], 100.0);
    let rows = free.envelope.rows().len();
    let in_bends = BendTraction {
        shares: vec![0.0, 0.8, 1.0],
        rows: vec![vec![10.0, 9.0, 0.0]; rows],
        lost: vec![vec![0.2, 1.0, 2.0]; rows],
    };
    let driven = PointMass {
        envelope: free.envelope.clone().with_bend_traction(in_bends).unwrap(),
        ..free
    };
    let table = driven.table().unwrap();
    let solvers = PointMassEnvelope::new(&driven).unwrap();
    for (share, wanted) in [(0.0, 3.8), (0.6, 3.4), (0.8, 3.0)] {
        let kernel = kernel::acceleration::<f64>(&table, false, 900.0, share * 12.0 / 900.0);
        let root = (1.0f64 - share * share).sqrt();
        let solver = solvers.traction(30.0, root, 1.0).unwrap().value;
        // Cells of a thirty-second of the root cut the corner at 0.6.
        assert!((kernel - wanted).abs() < 0.02, "{share}: {kernel}");
        assert!((solver - wanted).abs() < 1e-9, "{share}: {solver}");
    }
    // Half of the grip: half of the lateral acceleration at each share, and the engine of before.
    let half = driven
        .envelope
        .with_grip_share(0.5, &driven.envelope.straight_traction().unwrap())
        .unwrap();
    // Half of 0.8 leaves the root of 1 - 0.16.
    let wanted = 0.2 + 0.8 * (1.0 - 0.84f64.sqrt()) / 0.4;
    assert!(
        (half.lost_at(30.0, 0.8) - wanted).abs() < 1e-9,
        "{}",
        half.lost_at(30.0, 0.8)
    );
}

/// With 12 m/s^2 across, 10 along and a traction of 6, 5 and 0 at shares of 0, 0.8 and 1: 0.8 of the limit leaves 5, where the
/// ellipse leaves 6, and 0.6 leaves 0.8 of the root, half-way from 0.6 to 1. Braking has the ellipse.
#[test]
fn driven_tyres_have_less_in_bends() {
    let free = car(|_| [12.0, 10.0, 9.0, 0.0], 100.0);
    let rows = vec![vec![6.0, 5.0, 0.0]; free.envelope.rows().len()];
    let in_bends = BendTraction::without_losses(vec![0.0, 0.8, 1.0], rows);
    let driven = PointMass {
        envelope: free.envelope.clone().with_bend_traction(in_bends).unwrap(),
        ..free.clone()
    };
    let tables = [free, driven].map(|car| car.table().unwrap());
    for (share, ellipse, wanted) in [
        (0.0, 9.0, 6.0),
        (0.6, 8.0, 5.5),
        (0.8, 6.0, 5.0),
        (0.96, 2.8, 2.8 * 5.0 / 6.0),
        (1.0, 0.0, 0.0),
    ] {
        let at = |table| kernel::acceleration::<f64>(table, false, 900.0, share * 12.0 / 900.0);
        let [by_ellipse, by_table] = [at(&tables[0]), at(&tables[1])];
        // Cells of a thirty-second of the root cut the corner at 0.6.
        assert!((by_ellipse - ellipse).abs() < 1e-6, "{share}: {by_ellipse}");
        assert!((by_table - wanted).abs() < 0.05, "{share}: {by_table}");
        let brake = |table| kernel::deceleration::<f64>(table, 900.0, share * 12.0 / 900.0);
        assert_eq!(brake(&tables[0]), brake(&tables[1]));
    }
}

/// A bend of 25 m that opens within 60 m on to a straight. The bundled car is driven at the rear: with the ellipse of all four
/// tyres it leaves the bend faster than it can.
#[test]
fn a_car_driven_at_the_rear_leaves_corners_more_slowly() {
    let car = Car::bundled().unwrap();
    let swept = car_envelope(&car, &SpeedRange::USUAL).unwrap().envelope;
    let ellipse = Envelope::new("ellipse", swept.rows().to_vec()).unwrap();
    let bend = |i: usize| (2.0 - i as f64 / 30.0).clamp(0.0, 1.0) / 25.0;
    let curvature: Vec<f64> = (0..100).map(bend).collect();
    let [slow, fast] = [swept, ellipse].map(|envelope| {
        let car = PointMass::new(envelope, 2.6);
        let table = car.table().unwrap();
        lap_profile(&car, &table, &[2.0; 100], &curvature, 100.0, &[]).unwrap()
    });
    assert_eq!(slow.v_mps[0], fast.v_mps[0]);
    let lost = |i: usize| fast.v_mps[i] - slow.v_mps[i];
    let most = (0..100).map(lost).fold(0.0, f64::max);
    assert!(most > 0.5 && (0..100).all(|i| lost(i) > -1e-9), "{most}");
    assert!(
        slow.time_s > fast.time_s + 0.05,
        "{} {}",
        slow.time_s,
        fast.time_s
    );
}

/// The lap with the limits of each segment's start, forwards and backwards, which the kernel does not do.
fn first_order_time(shape: &Geometry) -> f64 {
    let table = gt_car().table().unwrap();
    let bend: Vec<f64> = shape.curvature_1pm.iter().map(|k| k.abs()).collect();
    let (n, h) = (bend.len(), &shape.segment_m);
    let mut w: Vec<f64> = bend.iter().map(|k| kernel::corner::<f64>(&table, *k)).collect();
    for i in 0..2 * n {
        let (here, next) = (i % n, (i + 1) % n);
        let drive = kernel::acceleration::<f64>(&table, false, w[here], bend[here]);
        w[next] = w[next].min(w[here] + 2.0 * h[here] * drive);
    }
    for i in (0..2 * n).rev() {
        let (here, next) = (i % n, (i + 1) % n);
        let brake = kernel::deceleration::<f64>(&table, w[next], bend[next]);
        w[here] = w[here].min(w[next] + 2.0 * h[here] * brake);
    }
    (0..n)
        .map(|i| 2.0 * h[i] / (w[i].sqrt() + w[(i + 1) % n].sqrt()))
        .sum()
}

#[test]
fn limits_of_start_and_middle_beat_those_of_the_start() {
    let car = gt_car();
    let table = car.table().unwrap();
    let reference = FineLine::new(&wavy(6400), true, 1000.0, Some((&car, &[])), 0.0).unwrap();
    let reference = reference.lap_time_s().unwrap();
    let off = |sections: usize| {
        let shape = geometry(&wavy(sections), true);
        let lap = lap_profile(&car, &table, &shape.segment_m, &shape.curvature_1pm, 0.0, &[]).unwrap();
        (lap.time_s - reference, first_order_time(&shape) - reference)
    };
    for sections in [200, 400, 800, 1600] {
        let (second, first) = off(sections);
        println!("{sections} sections: {second:.4} s of {reference:.3} s off, start alone {first:.4} s");
        assert!(second.abs() < 0.6 * first.abs(), "{second} {first}");
    }
}

/// An envelope of 15 m/s^2 of grip, 5 of drive and 2 of drag. The open DRS leaves 1 of the drag and 12 of the grip.
fn car_with_drs() -> PointMass {
    let shut = car(|_| [15.0, 15.0, 5.0, 2.0], 70.0);
    let open = |_: &Envelope, row: &EnvelopeRow| EnvelopeRow {
        ay_mps2: 12.0,
        ax_grip_mps2: 12.0,
        drag_mps2: 1.0,
        ..*row
    };
    let open = shut.envelope.with_rows("open", &open).unwrap();
    PointMass::new(shut.envelope.with_open(open).unwrap(), 2.6)
}

/// On a straight the car gains 3 m/s^2, and 4 where its flap is open. It brakes for the bend at the end with 17, whatever the zone
/// says. In a bend that takes nearly all of its grip it goes faster with the flap shut.
#[test]
fn the_drs_is_open_where_it_may_be_and_gains_speed_and_shut_on_the_brakes() {
    let car = car_with_drs();
    let table = car.table().unwrap();
    let mut curvature = vec![0.0; 101];
    curvature[100] = 15.0 / 100.0;
    let drs: Vec<bool> = (0..100).map(|i| i >= 40).collect();
    let lap = |drs: &[bool]| lap_profile(&car, &table, &[2.0; 100], &curvature, 20.0, drs).unwrap();
    let (with, without) = (lap(&drs), lap(&[]));
    // On the segment between driving and braking the car does both.
    let change = with.ax_mps2.iter().skip(60).position(|ax| *ax < 3.9).unwrap() + 60;
    assert!((62..90).contains(&change), "{change}");
    for i in (0..98).filter(|i| *i != change) {
        let wanted = match i {
            _ if i > change => -17.0,
            40.. => 4.0,
            _ => 3.0,
        };
        assert!(
            (with.ax_mps2[i] - wanted).abs() < 1e-6,
            "{i}: {}",
            with.ax_mps2[i]
        );
        assert_eq!(with.drs_open[i], (40..change).contains(&i), "{i}");
    }
    assert!(without.ax_mps2[..60].iter().all(|ax| (ax - 3.0).abs() < 1e-6));
    assert!(without.drs_open.iter().all(|open| !open) && with.time_s < without.time_s);
    // At 11.9 of 15 m/s^2 the shut car has 9.1 for driving, more than its engine; with the flap open 1.5 would be left.
    let bend = kernel::driving_at::<f64>(&table, 900.0, 11.9 / 900.0);
    let chosen = kernel::driving_with_drs::<f64>(&table, true, 900.0, 11.9 / 900.0);
    assert_eq!(chosen, bend);
    let straight = kernel::driving_with_drs::<f64>(&table, true, 900.0, 0.0);
    assert_eq!(straight, [12.0, 5.0, 1.0, 0.0]);
}

/// A line of other points than the cross-sections has the zones of the road that it is on.
#[test]
fn zones_follow_a_line_along_the_road() {
    let mut road = ring(180.0, 220.0, 400);
    road.drs = (0..400).map(|i| (100..250).contains(&i)).collect();
    let line: Vec<DVec2> = (0..1000)
        .map(|i| {
            (195.0 + 10.0 * (TAU * 3.0 * f64::from(i) / 1000.0).sin())
                * DVec2::from_angle(TAU * f64::from(i) / 1000.0)
        })
        .collect();
    let drs = road.drs_along(&line);
    for (i, open) in drs.iter().enumerate() {
        // The cross-section that is nearest to a point may be half a step ahead of it.
        let at = i as f64 * 0.4;
        if (at - 100.0).abs() > 1.0 && (at - 250.0).abs() > 1.0 {
            assert_eq!(*open, (100.0..250.0).contains(&at), "{i}");
        }
    }
    road.drs.clear();
    assert!(road.drs_along(&line).is_empty());
}
