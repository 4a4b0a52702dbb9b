//! Layer four: lines round the bundled circuit, their shape and their lap time.

use super::cases::{Cases, Compared, layer_of};
use super::{Draws, Layer};
use crate::error::Result;
use crate::evaluate::line::{LineObjective, LineProblem};
use crate::line::{Parametrisation, PointMass, geometry, kernel};
use crate::scalar::{Counted, operations_of};
use crate::study::raceline::{RacelineSettings, set_up};
use crate::track::{CrossSections, FrictionAcross, SectionRelief};
use crate::vehicle::{Envelope, EnvelopeRow};
use std::f64::consts::TAU;

/// Lines by each parametrisation.
const COUNT: usize = 64;
/// Cross-sections of the circuit.
const SECTIONS: usize = 360;

/// Arithmetic operations of a line's shape and lap time; zero without a car.
pub fn work_of(line: &LineProblem) -> u64 {
    let plan = line.plan().stored::<Counted>();
    let middle = vec![Counted(0.5); line.dimensions()];
    line.envelope().map_or(0, |envelope| {
        let envelope = envelope.stored::<Counted>();
        operations_of(|| {
            let mut course = kernel::Course::default();
            let wanted = kernel::Wanted {
                integral: false,
                lap: true,
            };
            kernel::shape(&plan, wanted, &middle, &mut course);
            kernel::lap_time(
                &envelope,
                plan.closed,
                plan.start,
                Counted(plan.entry),
                &mut course,
            );
        })
    })
}

/// How far single precision may be off, absolute, for each of [`LineObjective::ALL`], on a line that costs `exact` in
/// `f64`; roads up to 14 m wide with bends of 30 m radius and more.
///
/// `alpha` is a sum of four rounded products and a constant: 5 roundings of 6e-8 of up to 1.25, so that a point is off by
/// 4e-7 of the 14 m road, and rounding of the steps between cross-sections adds 3e-8 of these: 6e-6 m in all. Across the road it
/// changes a length by no more than a third of it at either end, beside the 70 roundings of a sum in blocks of 64. A second
/// difference is off by four times that over the shortest spacing squared, and two roots of sums of squares differ by no
/// more than the root of the sum of the squared differences. Where corner speed decides, time goes with half the relative
/// error of the curvature, and no bend wider than 400 m slows any of the cars; 1e-4 is the limit of whole laps. Beside it,
/// on the lateral limit itself, what is left of the ellipse is the root of a difference that three roundings of 6e-8 can
/// fill: `sqrt(2 * 1.8e-7)` or 6e-4 of the grip `g`. Half of `2 h` times that, over a corner's speed squared `g r`, is off by `h
/// / r` times 6e-4, its root and so the time by half of that, in corners: 1.6e-4 at 16 m in bends of 30 m.
pub fn line_tolerances(problem: &LineProblem, exact: &[f64]) -> [f64; LineObjective::ALL.len()] {
    let cross_sections = problem.cross_sections();
    let n = cross_sections.len() as f64;
    let middle = geometry(
        &cross_sections.points(&vec![0.5; cross_sections.len()]),
        cross_sections.closed,
    );
    // Inside bends, points are closer than in the middle of the road.
    let shortest = 0.6 * middle.segment_m.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    let point = 6e-6;
    let bend = 4.0 * point / (shortest * shortest);
    let length = 70.0 * 6e-8 * exact[0] + n * 0.7 * point;
    let gamma = n.sqrt() * bend + 1e-5 * exact[2];
    let root = exact[3].sqrt();
    let integral = exact[0].sqrt() * bend + 1e-5 * root;
    let left = (2.0f64 * 3.0 * 6e-8).sqrt();
    let sharpest = (0..cross_sections.len())
        .map(|i| middle.curvature_1pm[i].abs() * middle.segment_m[i.min(middle.segment_m.len() - 1)])
        .fold(0.0, f64::max);
    let time = (1e-5 + 0.5 * bend * 400.0).min(1e-4) + 0.5 * sharpest.min(0.53) * left;
    [
        length,
        2.0 * exact[1] * length / exact[0] + 70.0 * 6e-8 * exact[1],
        gamma,
        2.0 * root * integral + integral * integral,
        time * exact[4],
    ]
}

impl Compared for LineProblem {
    const NOUN: &'static str = "line";

    fn limits(&self, _: &[f64], _: &Self::Outcome, exact: &[f64]) -> Option<Vec<[f64; 2]>> {
        let scales = exact.iter().map(|x| x.abs());
        Some(scales.zip(line_tolerances(self, exact)).map(Into::into).collect())
    }
}

/// A smooth line: it wanders over the road a few times a lap, as lines in a search do after its first moments.
fn line(dimensions: usize, draws: &mut Draws) -> Vec<f64> {
    let waves: Vec<(f64, f64, f64)> = (1..8)
        .map(|k| (f64::from(k), draws.within(0.0, 0.2), draws.within(0.0, TAU)))
        .collect();
    let points = (0..dimensions).map(|i| {
        let angle = TAU * i as f64 / dimensions as f64;
        let wave: f64 = waves.iter().map(|(k, a, p)| a * (k * angle + p).sin()).sum();
        (0.5 + wave).clamp(0.0, 1.0)
    });
    points.collect()
}

/// The envelope of a car that also has a DRS, and segments on which it may be open: some in bends, some on straights.
///
/// # Errors
/// None in practice: the made-up limits are within those of the car.
pub(super) fn with_drs(envelope: &Envelope, sections: usize) -> Result<(Envelope, Vec<bool>)> {
    let open = envelope.with_rows(envelope.name(), &|_, row| EnvelopeRow {
        ay_mps2: 0.96 * row.ay_mps2,
        ax_grip_mps2: 0.97 * row.ax_grip_mps2,
        drag_mps2: 0.8 * row.drag_mps2,
        ..*row
    })?;
    let drs = (0..sections).map(|i| i % 7 < 4).collect();
    Ok((envelope.clone().with_open(open)?, drs))
}

/// Cross-sections with made-up hills, banking and friction, and the car with made-up limits under loads.
///
/// # Errors
/// None in practice: the made-up limits are within those of the car.
pub fn in_relief(road: &CrossSections, car: &PointMass) -> Result<(CrossSections, PointMass)> {
    let n = road.len();
    let angle = |i: usize| TAU * i as f64 / n as f64;
    let relief = SectionRelief {
        foot_m: road.points(&vec![0.5; n]),
        z_m: (0..n)
            .map(|i| 15.0 * angle(i).sin() + 4.0 * (7.0 * angle(i)).cos())
            .collect(),
        bank_rad: (0..n).map(|i| 0.1 * (5.0 * angle(i)).sin()).collect(),
        friction: (0..n)
            .map(|i| {
                let half_m = 0.5 * road.right_m[i].distance(road.left_m[i]);
                let wave = |k: usize| 0.1 * (4.0 * angle(i) + 2.0 * k as f64).sin();
                FrictionAcross {
                    right_m: half_m,
                    left_m: half_m,
                    of: std::array::from_fn(|k| 0.8 + 0.15 * (3.0 * angle(i)).cos() + wave(k)),
                }
            })
            .collect(),
    };
    let under = |share: f64| {
        let grip = share.powf(0.9);
        let limits = car
            .envelope
            .with_rows(car.envelope.name(), &|_, row| EnvelopeRow {
                ay_mps2: grip * row.ay_mps2,
                ax_grip_mps2: grip * row.ax_grip_mps2,
                ..*row
            })?;
        Ok((share, limits))
    };
    let loads = [0.6, 1.0, 1.4].map(under).into_iter().collect::<Result<_>>()?;
    let road = CrossSections {
        relief: Some(relief),
        ..road.clone()
    };
    let car = PointMass {
        envelope: car.envelope.clone().with_loads(loads)?,
        relief: true,
        ..car.clone()
    };
    Ok((road, car))
}

/// The layer.
///
/// # Errors
/// Those of reading the bundled circuit and car.
pub(super) fn layer() -> Result<Layer> {
    let mut setup = set_up(&RacelineSettings {
        sections: Some(SECTIONS),
        ..RacelineSettings::default()
    })?;
    (setup.car.envelope, setup.cross_sections.drs) = with_drs(&setup.car.envelope, SECTIONS)?;
    let mut draws = Draws::new(4);
    let ways = [
        ("control points", Parametrisation::control_points(SECTIONS / 4)),
        ("sections", Parametrisation::sections()),
    ];
    let cases = ways.into_iter().map(|(way, parametrisation)| {
        let car = Some(setup.car.clone());
        let problem = LineProblem::new(
            setup.cross_sections.clone(),
            parametrisation,
            &LineObjective::ALL,
            car,
            30.0,
        )?;
        let dimensions = problem.dimensions();
        let lines = (0..COUNT).map(|_| line(dimensions, &mut draws)).collect();
        let names = LineObjective::ALL.map(|objective| format!("line, {}, {way}", objective.name()));
        Ok(Cases::new(names.to_vec(), problem, lines, &[]))
    });
    let mut cases = cases.collect::<Result<Vec<_>>>()?;
    let (cross_sections, car) = in_relief(&setup.cross_sections, &setup.car)?;
    let car = Some(car);
    let way = Parametrisation::control_points(SECTIONS / 4);
    let problem = LineProblem::new(cross_sections, way, &LineObjective::ALL, car, 30.0)?;
    let dimensions = problem.dimensions();
    let lines = (0..COUNT).map(|_| line(dimensions, &mut draws)).collect();
    let names = LineObjective::ALL.map(|objective| format!("line, {}, hills", objective.name()));
    cases.push(Cases::new(names.to_vec(), problem, lines, &[]));
    Ok(layer_of(cases))
}
