use super::*;
use crate::random::Random;
use crate::track::CrossSections;
use glam::DVec2;
use std::f64::consts::TAU;

/// Cuts across an ellipse with half axes `a` and `b` (m), driven anticlockwise, half a width to each side.
fn ellipse(a: f64, b: f64, half_width: f64, n: usize) -> CrossSections {
    let at = |i: usize| {
        let t = TAU * i as f64 / n as f64;
        let centre = DVec2::new(a * t.cos(), b * t.sin());
        let outward = DVec2::new(b * t.cos(), a * t.sin()).normalize();
        (centre, outward * half_width)
    };
    let centre: Vec<DVec2> = (0..n).map(|i| at(i).0).collect();
    let mut station_m = vec![0.0];
    let mut sum = 0.0;
    for i in 0..n {
        sum += centre[i].distance(centre[(i + 1) % n]);
        station_m.push(sum);
    }
    station_m.pop();
    CrossSections {
        name: "ellipse".to_owned(),
        closed: true,
        length_m: sum,
        station_m,
        right_m: (0..n).map(|i| at(i).0 + at(i).1).collect(),
        left_m: (0..n).map(|i| at(i).0 - at(i).1).collect(),
        sections: Vec::new(),
        corners: Vec::new(),
    }
}

/// A car of steady grip: 15 to 18 m/s^2 sideways over 25 to 65 m/s, 14 to 18 lengthways, 330 kW, CdA 0.9 m^2, 1245 kg.
struct Racer;

impl Limits for Racer {
    fn at(&self, v: f64) -> Grip {
        let line = |low: f64, high: f64| {
            let slope = (high - low) / 40.0;
            Slope {
                value: low + slope * (v - 25.0),
                by_speed: slope,
            }
        };
        let power = 330e3 / 1245.0;
        let drag = 0.5 * 1.2 * 0.9 / 1245.0;
        Grip {
            lateral: line(15.0, 18.0),
            longitudinal: line(14.0, 18.0),
            drive: Slope {
                value: power / v,
                by_speed: -power / (v * v),
            },
            drag: Slope {
                value: drag * v * v,
                by_speed: 2.0 * drag * v,
            },
        }
    }

    fn top_speed_mps(&self) -> f64 {
        70.0
    }
}

/// Smooth random lines, away from the edges.
fn random_line(n: usize, who: u32) -> Vec<f64> {
    let random = Random::new(11);
    let draw = |i: u32| random.normal(1, 0, who, i);
    let waves = |i: usize| {
        let t = TAU * i as f64 / n as f64;
        (1..9u32)
            .map(|k| draw(k) * (f64::from(k) * t + 6.0 * draw(20 + k)).sin())
            .sum::<f64>()
    };
    (0..n).map(|i| (0.5 + 0.1 * waves(i)).clamp(0.05, 0.95)).collect()
}

fn problem<'a>(map: &'a LineMap, limits: Option<&'a dyn Limits>) -> LineProblem<'a> {
    LineProblem {
        map,
        limits,
        start_mps: 20.0,
        spacing_m: None,
    }
}

/// Surveyed Silverstone, cut at even distances.
fn surveyed(n: usize, car: f64, raw: bool) -> CrossSections {
    let track = crate::track::Track::read("../shared/data/tracks/Silverstone.csv").unwrap();
    track
        .cross_sections(&crate::track::Spacing::equal(n), raw)
        .unwrap()
        .narrowed(car)
        .unwrap()
}

#[test]
fn explore() {
    for car in [0.0, 2.0] {
        let cuts = surveyed(360, car, true);
        let map = LineMap::at_every_cut(&cuts);
        let bounds = Bounds::road(map.variables());
        let o = shortest(&map, &bounds).unwrap();
        println!(
            "shortest {car} {} {:?} {:?} {} {:.3}",
            o.value, o.lower_bound, o.status, o.iterations, o.seconds
        );
        let o = least_squared_length(&map, &bounds).unwrap();
        println!(
            "squared {car} {} {:?} {:?} {} {:.3}",
            o.value, o.lower_bound, o.status, o.iterations, o.seconds
        );
        let h = spacing_m(&map, &vec![0.5; 360]);
        let even = vec![cuts.length_m / 360.0; 360];
        for h in [h, even] {
            let o = least_gamma(&map, &h, &bounds).unwrap();
            println!(
                "gamma {car} {} {:?} {:?} {} {:.3}",
                o.value, o.lower_bound, o.status, o.iterations, o.seconds
            );
            let own = problem(&map, None).measures(&o.x);
            println!("  its own {own:?}");
        }
    }
    for n in [720, 1178] {
        let cuts = surveyed(n, 2.0, true);
        let map = LineMap::at_every_cut(&cuts);
        let bounds = Bounds::road(map.variables());
        let even = vec![cuts.length_m / n as f64; n];
        let o = least_gamma(&map, &even, &bounds).unwrap();
        println!(
            "gamma {n} {} {:?} {:?} {} {:.3}",
            o.value, o.lower_bound, o.status, o.iterations, o.seconds
        );
        let own = problem(&map, None).measures(&o.x);
        println!("  its own {own:?}");
        let c = least_curvature(&map, &bounds, &o.x).unwrap();
        println!(
            "curvature {n} {} {:?} {} {:.3}",
            c.value, c.status, c.iterations, c.seconds
        );
        let c = least_curvature(&map, &bounds, &vec![0.5; n]).unwrap();
        println!(
            "curvature from centre {n} {} {:?} {} {:.3}",
            c.value, c.status, c.iterations, c.seconds
        );
    }
}

#[test]
fn gradients() {
    let cuts = ellipse(300.0, 60.0, 6.0, 200);
    let n = cuts.len();
    for map in [LineMap::at_every_cut(&cuts), LineMap::b_spline(&cuts, 40)] {
        let spacing = spacing_m(&map, &vec![0.5; map.variables()]);
        let mut all = problem(&map, Some(&Racer));
        for fixed in [false, true] {
            all.spacing_m = fixed.then_some(&spacing);
            for (name, weights) in [
                (
                    "time",
                    Weights {
                        time: 1.0,
                        ..Weights::default()
                    },
                ),
                (
                    "length",
                    Weights {
                        length: 1.0,
                        ..Weights::default()
                    },
                ),
                (
                    "squared",
                    Weights {
                        squared_length: 1.0,
                        ..Weights::default()
                    },
                ),
                (
                    "gamma",
                    Weights {
                        gamma: 1.0,
                        ..Weights::default()
                    },
                ),
                (
                    "curvature",
                    Weights {
                        curvature: 1.0,
                        ..Weights::default()
                    },
                ),
            ] {
                let x = random_line(map.variables(), 3);
                let (c, g) = all.cost(&weights, &x);
                let mut worst = 0.0f64;
                let most = g.iter().fold(0.0f64, |m, g| m.max(g.abs()));
                for k in 0..map.variables() {
                    let eps = 1e-6;
                    let (mut up, mut down) = (x.clone(), x.clone());
                    up[k] += eps;
                    down[k] -= eps;
                    let slope = (all.cost(&weights, &up).0 - all.cost(&weights, &down).0) / (2.0 * eps);
                    worst = worst.max((slope - g[k]).abs());
                    if (slope - g[k]).abs() > 1e-3 {
                        println!("   {k} {slope} {} {}", g[k], x[k]);
                    }
                }
                println!("{name} {fixed} {n} cost {c} gradient {most:e} worst {worst:e}");
            }
        }
    }
}

#[test]
fn time() {
    for raw in [false, true] {
        let full = surveyed(1964, 2.0, raw);
        for controls in [300, 1964] {
            let map = if controls == 1964 {
                LineMap::at_every_cut(&full)
            } else {
                LineMap::b_spline(&full, controls)
            };
            let p = problem(&map, Some(&Racer));
            let bounds = Bounds::road(map.variables());
            let clock = std::time::Instant::now();
            let c = if true {
                let weights = Weights {
                    curvature: 1.0,
                    ..Weights::default()
                };
                polish_lines(
                    &p,
                    &bounds,
                    &[Start {
                        x: vec![0.5; controls],
                        weights,
                    }],
                    &Budget::default(),
                )
                .unwrap()
                .remove(0)
            } else {
                unreachable!()
            };
            println!(
                "curvature {controls}: {:?} {:?} {} {:?}",
                c.measures,
                c.ending,
                c.evaluations,
                clock.elapsed()
            );
            let weights = Weights {
                time: 1.0,
                ..Weights::default()
            };
            for (name, x) in [("centre", vec![0.5; controls]), ("curved", c.x)] {
                let clock = std::time::Instant::now();
                println!("   start {}", p.measures(&x).time_s);
                let c = polish_lines(
                    &p,
                    &bounds,
                    &[Start { x, weights }],
                    &Budget {
                        evaluations: 6000,
                        least_gain: 1e-7,
                    },
                )
                .unwrap()
                .remove(0);
                println!(
                    "{name} {controls}: {:?} {:?} {} {:?}",
                    c.measures,
                    c.ending,
                    c.evaluations,
                    clock.elapsed()
                );
            }
        }
    }
}

#[test]
fn transcribed() {
    for (n, share) in [(720, 2), (1964, 3), (1964, 1)] {
        let cuts = surveyed(n, 2.0, false);
        let map = LineMap::at_every_cut(&cuts);
        for who in 0..2u32 {
            let mut road = Bounds::road(n);
            let random = Random::new(3);
            if who > 0 {
                for i in 0..n {
                    let t = TAU * i as f64 / n as f64;
                    let wave: f64 = (1..30u32)
                        .map(|k| {
                            random.normal(1, 0, who, k)
                                * (f64::from(k) * t + 6.0 * random.normal(2, 0, who, k)).sin()
                        })
                        .sum();
                    let middle = (0.5 + 0.1 * wave).clamp(0.2, 0.8);
                    road.lower[i] = middle - 0.15;
                    road.upper[i] = middle + 0.15;
                }
            }
            let curved = least_curvature(&map, &road, &vec![0.5; n]).unwrap();
            let controls = n / share;
            let (map, bounds) = if share > 1 {
                LineMap::spline_about(&cuts, &curved.x, controls)
            } else {
                (map.clone(), Bounds::road(n))
            };
            let p = problem(&map, Some(&Racer));
            let start = if share > 1 { vec![0.0; controls] } else { curved.x };
            println!("start {}", p.measures(&start).time_s);
            let o = fastest(&p, &bounds, &start, &FastestSettings::default()).unwrap();
            println!(
                "fastest {n} {share} {} {:?} {} {:.3} s {:?}",
                o.value,
                o.status,
                o.iterations,
                o.seconds,
                p.measures(&o.x)
            );
        }
    }
}
