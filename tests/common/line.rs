//! What the line tests and the line benchmark share: made-up circuits, cars and lines.

use super::Random;
use glam::DVec2;
use lapswarm::evaluate::line::{LineObjective, LineProblem};
use lapswarm::line::{Parametrisation, PointMass};
use lapswarm::track::CrossSections;
use lapswarm::vehicle::limits::LATERAL_SHARES;
use lapswarm::vehicle::{BendTraction, Envelope, EnvelopeRow};
use std::f64::consts::TAU;

/// A ring of circles, driven anticlockwise: the right edge is the outer one.
pub fn ring(inner_m: f64, outer_m: f64, sections: usize) -> CrossSections {
    let at = |radius: f64, i: usize| radius * DVec2::from_angle(TAU * i as f64 / sections as f64);
    let right_m = (0..sections).map(|i| at(outer_m, i)).collect();
    let left_m = (0..sections).map(|i| at(inner_m, i)).collect();
    cut("ring", right_m, left_m, true)
}

/// Cross-sections between edges, their stations along the middle.
fn cut(name: &str, right_m: Vec<DVec2>, left_m: Vec<DVec2>, closed: bool) -> CrossSections {
    let middle: Vec<DVec2> = right_m
        .iter()
        .zip(&left_m)
        .map(|(r, l)| 0.5 * (*r + *l))
        .collect();
    let mut station_m = vec![0.0];
    for pair in middle.windows(2) {
        station_m.push(station_m[station_m.len() - 1] + pair[0].distance(pair[1]));
    }
    let last = station_m[station_m.len() - 1];
    let length_m = if closed {
        last + middle[middle.len() - 1].distance(middle[0])
    } else {
        last
    };
    let count = right_m.len();
    CrossSections {
        name: name.to_owned(),
        closed,
        length_m,
        station_m,
        right_m,
        left_m,
        reference: vec![0.5; count],
        sections: Vec::new(),
        corners: Vec::new(),
        drs: Vec::new(),
        relief: None,
    }
}

/// A made-up circuit of about `spacing_m` between sections, with corners of some 30 m radius and more and a road 10 to
/// 14 m wide, laid out around `centre_m`.
pub fn circuit(
    sections: usize,
    spacing_m: f64,
    closed: bool,
    centre_m: DVec2,
    random: &mut Random,
) -> CrossSections {
    let radius = sections as f64 * spacing_m / TAU;
    let waves: Vec<(f64, f64, f64)> = (2..12)
        .map(|k| {
            let k = f64::from(k);
            // Curvature goes with the square of the frequency.
            let most = (0.12 * radius).min(radius * radius / (60.0 * k * k * 6.0));
            (k, random.within(0.0, most), random.within(0.0, TAU))
        })
        .collect();
    let at = |i: usize| {
        let angle = TAU * i as f64 / sections as f64;
        let wave: f64 = waves.iter().map(|(k, a, p)| a * (k * angle + p).sin()).sum();
        centre_m + (radius + wave) * DVec2::from_angle(angle)
    };
    let (mut right_m, mut left_m) = (Vec::new(), Vec::new());
    for i in 0..sections {
        let along = (at(i + 1) - at(i + sections - 1)).normalize();
        let width = 12.0 + 2.0 * (0.05 * i as f64).sin();
        right_m.push(at(i) - 0.5 * width * along.perp());
        left_m.push(at(i) + 0.5 * width * along.perp());
    }
    cut("made up", right_m, left_m, closed)
}

/// A GT car: 1245 kg, 330 kW, CdA 0.9 m^2, 15 m/s^2 across at 25 m/s and 18 at 65, 70 m/s at most.
pub fn gt_car() -> PointMass {
    car(15.0, 3.0, 330e3, 0.9, 70.0)
}

/// A car by its grip at 25 m/s and how much more it has at 65 (m/s^2), power (W), CdA (m^2) and greatest speed (m/s).
pub fn car(grip: f64, downforce: f64, power_w: f64, drag_area_m2: f64, top_mps: f64) -> PointMass {
    let rows = (1..=140).map(|i| {
        let v = top_mps * f64::from(i) / 140.0;
        let ay = grip + downforce * (v * v - 625.0) / 3600.0;
        EnvelopeRow {
            v_mps: v,
            ay_mps2: ay,
            ax_grip_mps2: 0.95 * ay,
            ax_drive_mps2: power_w / (1245.0 * v),
            drag_mps2: 0.6 * drag_area_m2 * v * v / 1245.0,
        }
    });
    PointMass::new(
        Envelope::new("made up", rows.collect()).expect("an envelope"),
        2.6,
    )
}

/// A car that races could see.
pub fn random_car(random: &mut Random) -> PointMass {
    let mut car = car(
        random.within(8.0, 20.0),
        random.within(0.0, 12.0),
        random.within(1e5, 6e5),
        random.within(0.3, 1.5),
        random.within(45.0, 95.0),
    );
    if random.within(0.0, 1.0) < 0.5 {
        car.ellipse_exponent = random.within(1.2, 2.6);
    }
    if random.within(0.0, 1.0) < 0.5 {
        car.max_steer_rad = Some(0.1745);
        // Slow enough to hold cars back in many a bend.
        car.max_steer_rate_radps = Some(0.12);
    }
    if random.within(0.0, 1.0) < 0.5 {
        let (driven, power) = (random.within(0.4, 0.9), random.within(0.5, 1.0));
        let row = |row: &EnvelopeRow| {
            let left = |share: &f64| driven * row.ax_grip_mps2 * (1.0 - share * share).powf(power);
            LATERAL_SHARES.iter().map(left).collect()
        };
        let lost = |_: &EnvelopeRow| {
            let at = |share: &f64| 0.1 + 2.0 * (1.0 - driven) * share * share;
            LATERAL_SHARES.iter().map(at).collect()
        };
        let in_bends = BendTraction {
            shares: LATERAL_SHARES.to_vec(),
            rows: car.envelope.rows().iter().map(row).collect(),
            lost: car.envelope.rows().iter().map(lost).collect(),
        };
        car.envelope = car.envelope.with_bend_traction(in_bends).expect("a table");
    }
    car
}

/// All objectives on `cross_sections`.
pub fn line_problem(cross_sections: CrossSections, way: Parametrisation, car: PointMass) -> LineProblem {
    LineProblem::new(cross_sections, way, &LineObjective::ALL, Some(car), 30.0).expect("a sound problem")
}

/// `count` smooth lines: they wander over the road a few times a lap, as lines in a search do after its first moments.
pub fn lines(problem: &LineProblem, count: usize, random: &mut Random) -> Vec<f64> {
    let n = problem.dimensions();
    let mut population = Vec::with_capacity(n * count);
    for _ in 0..count {
        let waves: Vec<(f64, f64, f64)> = (1..8)
            .map(|k| (f64::from(k), random.within(0.0, 0.2), random.within(0.0, TAU)))
            .collect();
        population.extend((0..n).map(|i| {
            let angle = TAU * i as f64 / n as f64;
            let wave: f64 = waves.iter().map(|(k, a, p)| a * (k * angle + p).sin()).sum();
            (0.5 + wave).clamp(0.0, 1.0)
        }));
    }
    population
}
