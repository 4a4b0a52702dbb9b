//! Gradients and step models, by differences.

use super::*;
use crate::line::Parametrisation;
use crate::random::Random;
use crate::track::{CrossSections, Shape};

fn ellipse(cross_sections: usize) -> CrossSections {
    let shape = Shape::parse("ellipse:300:60:12").unwrap().unwrap();
    shape.cross_sections(cross_sections).unwrap()
}

/// Grip that grows with speed, constant power, drag.
struct Racer;

impl GripEnvelope for Racer {
    fn at(&self, v: f64) -> Grip {
        let line = |value: f64, by_speed: f64| Slope {
            value: value + by_speed * v,
            by_speed,
        };
        Grip {
            lateral: line(13.0, 0.075),
            longitudinal: line(11.5, 0.1),
            drive: Slope {
                value: 265.0 / v,
                by_speed: -265.0 / (v * v),
            },
            drag: Slope {
                value: 4.3e-4 * v * v,
                by_speed: 8.6e-4 * v,
            },
        }
    }

    fn top_speed_mps(&self) -> f64 {
        70.0
    }
}

/// The same car driven on one axle: it has more than the engine gives on straights only.
struct DrivenByTwo;

impl GripEnvelope for DrivenByTwo {
    fn at(&self, v: f64) -> Grip {
        Racer.at(v)
    }

    fn traction(&self, v: f64, root: f64, _: f64) -> Option<BendGrip> {
        Some(BendGrip {
            value: (8.5 + 0.03 * v) * root * root,
            by_speed: 0.03 * root * root,
            by_root: 2.0 * (8.5 + 0.03 * v) * root,
        })
    }

    fn top_speed_mps(&self) -> f64 {
        70.0
    }
}

/// The same car with a DRS, open.
struct Open;

impl GripEnvelope for Open {
    fn at(&self, v: f64) -> Grip {
        let shut = Racer.at(v);
        let part = |slope: Slope, share: f64| Slope {
            value: share * slope.value,
            by_speed: share * slope.by_speed,
        };
        Grip {
            lateral: part(shut.lateral, 0.96),
            longitudinal: part(shut.longitudinal, 0.97),
            drag: part(shut.drag, 0.6),
            ..shut
        }
    }

    fn top_speed_mps(&self) -> f64 {
        70.0
    }
}

/// The same car with a DRS.
struct WithDrs;

impl GripEnvelope for WithDrs {
    fn at(&self, v: f64) -> Grip {
        Racer.at(v)
    }

    fn open(&self) -> Option<&dyn GripEnvelope> {
        Some(&Open)
    }

    fn top_speed_mps(&self) -> f64 {
        70.0
    }
}

/// The same car, whose steering is slow.
struct Steered;

impl GripEnvelope for Steered {
    fn at(&self, v: f64) -> Grip {
        Racer.at(v)
    }

    fn top_speed_mps(&self) -> f64 {
        70.0
    }

    fn curvature_rate(&self) -> f64 {
        0.05
    }
}

/// A line that wanders over the middle of the road.
fn wandering(variables: usize) -> Vec<f64> {
    let random = Random::new(11);
    let phase: Vec<f64> = (0..9).map(|k| 6.3 * random.uniform(1, 0, 0, k)).collect();
    let waves = |i: usize| {
        let t = std::f64::consts::TAU * i as f64 / variables as f64;
        let wave = |(k, phase): (usize, &f64)| (k as f64 * t + phase).sin();
        0.5 + 0.05 * phase.iter().enumerate().map(wave).sum::<f64>()
    };
    (0..variables).map(waves).collect()
}

fn weights() -> [(&'static str, Weights); 5] {
    let none = Weights::default();
    [
        ("time", Weights { time: 1.0, ..none }),
        ("length", Weights { length: 1.0, ..none }),
        (
            "squared length",
            Weights {
                squared_length: 1.0,
                ..none
            },
        ),
        ("Gamma", Weights { gamma: 1.0, ..none }),
        (
            "curvature",
            Weights {
                curvature: 1.0,
                ..none
            },
        ),
    ]
}

/// Central differences over 1e-6 of the road's width leave 1e-12 of third derivatives and 1e-5 of the rounding of the
/// lap's Newton steps; what a wrong term would do is of the size of the gradient itself.
#[test]
fn gradients_are_those_of_differences() {
    let mut cross_sections = ellipse(200);
    cross_sections.drs = (0..200).map(|i| i < 120).collect();
    let (spline, _) = LineMap::parametrised(&cross_sections, &Parametrisation::control_points(40)).unwrap();
    for map in [LineMap::at_every_cross_section(&cross_sections), spline] {
        let spacing = spacing_m(&map, &vec![0.5; map.variables()]);
        let spacings = [None, Some(&spacing[..]), None, None];
        let cars: [&dyn GripEnvelope; 4] = [&Racer, &DrivenByTwo, &WithDrs, &Steered];
        for (spacing_m, car) in spacings.into_iter().zip(cars) {
            let problem = ReferenceProblem {
                envelope: Some(car),
                spacing_m,
                ..ReferenceProblem::of(&map)
            };
            let x = wandering(map.variables());
            for (name, weights) in weights() {
                let (_, gradient) = problem.cost(&weights, &x);
                let most = gradient.iter().fold(0.0f64, |most, g| most.max(g.abs()));
                for (k, slope) in gradient.iter().enumerate() {
                    let at = |step: f64| {
                        let mut x = x.clone();
                        x[k] += step;
                        problem.cost(&weights, &x).0
                    };
                    let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
                    assert!(
                        (difference - slope).abs() < 1e-4 * most,
                        "{name}, variable {k}: {difference} and {slope}"
                    );
                }
            }
        }
    }
}

/// On a line that a free car drives, one with slow steering takes longer, nowhere turns its wheels faster than it may, and is
/// quicker on the line that the search finds for it.
#[test]
fn the_search_knows_how_fast_the_car_can_steer() {
    let cross_sections = ellipse(200);
    let (map, bounds) = LineMap::parametrised(&cross_sections, &Parametrisation::control_points(40)).unwrap();
    let of = |car| ReferenceProblem {
        envelope: Some(car),
        bend: SegmentBend::Mean,
        ..ReferenceProblem::of(&map)
    };
    let (free, steered) = (of(&Racer), of(&Steered));
    let time = weights()[0].1;
    let found = |problem: &ReferenceProblem| {
        let start = vec![0.5; map.variables()];
        fastest(problem, &bounds, &start, &DescentSettings::USUAL)
            .unwrap()
            .x
    };
    let (fast, steady) = (found(&free), found(&steered));
    let [of_free, of_fast, of_steady] = [
        free.cost(&time, &fast).0,
        steered.cost(&time, &fast).0,
        steered.cost(&time, &steady).0,
    ];
    assert!(
        of_free < of_steady && of_steady < of_fast - 0.01,
        "{of_free}, {of_steady}, {of_fast} s"
    );
    let shape = map.shape(&steady);
    let v = steered.speeds_mps(&steady);
    let mut bound = 0;
    for (s, h) in shape.length_m.iter().enumerate() {
        let next = (s + 1) % v.len();
        let change = shape.curvature_1pm[next].abs() - shape.curvature_1pm[s].abs();
        let rate = change.abs() / h * v[next];
        assert!(rate < 0.05 * (1.0 + 1e-9), "{s}: {rate}");
        bound += usize::from(rate > 0.0499);
    }
    assert!(bound > 0, "{bound}");
}

/// An open road, too: entry speed given, one fewer segment than points.
#[test]
fn gradients_on_an_open_road() {
    let mut cross_sections = ellipse(200);
    cross_sections.closed = false;
    let map = LineMap::at_every_cross_section(&cross_sections);
    let problem = ReferenceProblem {
        envelope: Some(&DrivenByTwo),
        start_mps: 10.0,
        ..ReferenceProblem::of(&map)
    };
    let x = wandering(200);
    let (cost, gradient) = problem.cost(&weights()[0].1, &x);
    assert!((problem.speeds_mps(&x)[0] - 10.0).abs() < 1e-12 && cost == problem.measures(&x).time_s);
    let most = gradient.iter().fold(0.0f64, |most, g| most.max(g.abs()));
    for k in [0, 1, 2, 50, 101, 150, 198, 199] {
        let at = |step: f64| {
            let mut x = x.clone();
            x[k] += step;
            problem.measures(&x).time_s
        };
        let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
        assert!(
            (difference - gradient[k]).abs() < 1e-4 * most,
            "{k}: {difference} {}",
            gradient[k]
        );
    }
}

/// A great caution makes every promise small. That is no optimum.
#[test]
fn a_cautious_search_does_not_end_before_the_others() {
    let cross_sections = ellipse(120);
    let (map, bounds) = LineMap::parametrised(&cross_sections, &Parametrisation::control_points(30)).unwrap();
    let problem = ReferenceProblem {
        envelope: Some(&Racer),
        ..ReferenceProblem::of(&map)
    };
    let start = vec![0.5; map.variables()];
    let led = |caution: f64| {
        let settings = DescentSettings {
            caution,
            ..DescentSettings::default()
        };
        fastest(&problem, &bounds, &start, &settings).unwrap()
    };
    let (usual, cautious) = (led(1.0), led(1e6));
    println!(
        "{} {}, {} {}",
        usual.value, usual.status, cautious.value, cautious.status
    );
    // Both gain something to speak of.
    let middle = problem.measures(&start).time_s;
    assert!(usual.value < 0.99 * middle, "{middle} {}", usual.value);
    assert!(
        (cautious.value / usual.value - 1.0).abs() < 1e-4,
        "{} {}",
        cautious.value,
        usual.value
    );
}

/// The model of a step knows the traction in bends: the search ends at one line from the middle of the road and from the line
/// that is fastest for the ellipse, and that line is faster than this.
#[test]
fn the_search_knows_the_traction_in_bends() {
    let cross_sections = ellipse(120);
    let (map, bounds) = LineMap::parametrised(&cross_sections, &Parametrisation::control_points(30)).unwrap();
    let of = |car| ReferenceProblem {
        envelope: Some(car),
        ..ReferenceProblem::of(&map)
    };
    let settings = DescentSettings::default();
    let middle = vec![0.5; map.variables()];
    let by_four = fastest(&of(&Racer), &bounds, &middle, &settings).unwrap();
    let problem = of(&DrivenByTwo);
    let found = [&middle, &by_four.x].map(|start| fastest(&problem, &bounds, start, &settings).unwrap());
    let [from_middle, from_ellipse] = &found;
    println!(
        "{} {} {}",
        from_middle.value, from_ellipse.value, from_middle.status
    );
    assert!(
        (from_middle.value / from_ellipse.value - 1.0).abs() < 1e-4,
        "{found:?}"
    );
    let kept = problem.measures(&by_four.x).time_s;
    assert!(
        from_middle.value < kept && by_four.value < 0.999 * kept,
        "{kept} {}",
        by_four.value
    );
}

#[test]
fn statuses_are_in_plain_words() {
    for status in [
        Status::Solved,
        Status::Almost("a cone program of reduced accuracy".to_owned()),
        Status::Failed("interrupted".to_owned()),
    ] {
        let text = status.to_string();
        assert!(!text.contains(['"', '(', '\\']), "{text}");
    }
}

/// On a circle the fastest steady speed is where the ellipse leaves just the drag: `(a_x/g_x)^2 + (v^2/(r g_y))^2 = 1`.
#[test]
fn a_steady_circle_is_driven_at_the_ellipse() {
    let circle = Shape::parse("circle:95:105").unwrap().unwrap();
    let map = LineMap::at_every_cross_section(&circle.cross_sections(360).unwrap());
    let problem = ReferenceProblem {
        envelope: Some(&Racer),
        ..ReferenceProblem::of(&map)
    };
    for v in problem.speeds_mps(&[0.5; 360]) {
        let grip = Racer.at(v);
        // The polygon's curvature is that of its corners' circle to (pi/360)^2.
        let used = (grip.drag.value / grip.longitudinal.value).powi(2)
            + (v * v / 100.0 / grip.lateral.value).powi(2);
        assert!((used - 1.0).abs() < 1e-4, "{v} {used}");
    }
}
