//! Exact optima of racing lines, against closed forms, against chance, and on a surveyed circuit.

use crate::common::harness::survey;
use lapswarm::line::{FineLine, Parametrisation, PointMass, Spread, cross_sections_about};
use lapswarm::optimum::{
    Bounds, DescentSettings, LineMap, Optimum, PointMassEnvelope, ReferenceProblem, SegmentBend, Start,
    Status, Weights, descend, fastest, least_gamma, least_squared_length, minimum_curvature, polish_lines,
    shortest, spacing_m,
};
use lapswarm::random::Random;
use lapswarm::track::{CrossSections, Shape, Track};
use lapswarm::vehicle::{Envelope, EnvelopeRow};
use std::f64::consts::{PI, TAU};

tests! {
    shortest_round_a_circle_is_the_inner_polygon: everywhere,
    ends_of_an_open_road_may_be_held: everywhere,
    no_neighbour_beats_an_optimum: everywhere,
    mistakes_are_refused: everywhere,
    convex_optima_of_the_surveyed_silverstone: survey,
    fastest_lines_of_the_surveyed_silverstone: survey,
    control_points_are_polished: everywhere,
    every_start_ends_at_the_same_lap_of_the_bundled_circuit: everywhere,
    every_start_ends_at_the_same_lap_of_the_surveyed_silverstone: survey,
    sectors_summed_leave_the_links_out: everywhere,
    sectors_summed_of_the_survey_are_those_published: survey,
}

/// 1245 kg, 330 kW, CdA 0.9 m^2, 15 to 18 m/s^2 sideways and 14 to 18 lengthways over 25 to 65 m/s, 70 m/s.
fn racer() -> PointMass {
    let row = |v: f64| {
        let grip = |low: f64| (low + (18.0 - low) / 40.0 * (v - 25.0)).clamp(low, 18.0);
        EnvelopeRow {
            v_mps: v,
            ay_mps2: grip(15.0),
            ax_grip_mps2: grip(14.0),
            ax_drive_mps2: 330e3 / (1245.0 * v),
            drag_mps2: 0.5 * 1.2 * 0.9 / 1245.0 * v * v,
        }
    };
    let rows = (4..=280).map(|i| row(f64::from(i) * 0.25)).collect();
    PointMass::new(Envelope::new("racer", rows).unwrap(), 2.6)
}

fn shape(text: &str, cross_sections: usize) -> CrossSections {
    let shape = Shape::parse(text).unwrap().unwrap();
    shape.cross_sections(cross_sections).unwrap()
}

/// The surveyed Silverstone as it stands, for a car of this width (m).
fn silverstone(cross_sections: usize, car_width_m: f64) -> CrossSections {
    let cut = Track::read(survey().expect("the harness has looked"))
        .unwrap()
        .cross_sections(cross_sections, true);
    cut.unwrap().narrowed(car_width_m).unwrap()
}

/// Lines about `x`, moved by noise and by waves, within the road.
fn neighbours(x: &[f64], size: f64) -> Vec<Vec<f64>> {
    let random = Random::new(5);
    let near = |who: u32| {
        let moved = x.iter().enumerate().map(|(i, x)| {
            let t = TAU * i as f64 / 200.0;
            let change = if who.is_multiple_of(2) {
                random.normal(1, 0, who, i as u32)
            } else {
                (f64::from(who) * t + 6.0 * random.normal(2, 0, who, 0)).sin()
            };
            (x + size * change).clamp(0.0, 1.0)
        });
        moved.collect()
    };
    (0..60).map(near).collect()
}

fn start(x: &[f64], weights: Weights) -> Start {
    Start {
        x: x.to_vec(),
        weights,
    }
}

fn shortest_round_a_circle_is_the_inner_polygon() {
    let cross_sections = shape("circle:590:600", 361);
    let map = LineMap::at_every_cross_section(&cross_sections);
    let road = Bounds::road(361);
    let polygon = 2.0 * 361.0 * 590.0 * (PI / 361.0).sin();
    let optimum = shortest(&map, &road).unwrap();
    assert_eq!(optimum.status, Status::Solved);
    assert!((optimum.value / polygon - 1.0).abs() < 1e-9, "{optimum:?}");
    assert!((optimum.lower_bound.unwrap() / polygon - 1.0).abs() < 1e-8);
    // Squared length has the same optimum; least Gamma and curvature have the outer circle.
    let squared = least_squared_length(&map, &road).unwrap();
    assert!((squared.measures.length_m / polygon - 1.0).abs() < 1e-8);
    let curved = minimum_curvature(&map, &road, &[0.3; 361]).unwrap();
    assert!((curved.value * 600.0 / TAU - 1.0).abs() < 1e-4 && curved.status == Status::Solved);
    assert!(curved.x.iter().all(|alpha| *alpha > 0.999), "{:?}", curved.x);
}

fn ends_of_an_open_road_may_be_held() {
    let mut cross_sections = shape("circle:590:600", 361);
    cross_sections.closed = false;
    for (i, station) in cross_sections.station_m.iter().enumerate() {
        (cross_sections.right_m[i], cross_sections.left_m[i]) =
            ([*station, -5.0].into(), [*station, 5.0].into());
    }
    let map = LineMap::at_every_cross_section(&cross_sections);
    let held = Bounds::road(361).holding(0, 0.2).holding(360, 0.8);
    let straight = cross_sections.station_m[360].hypot(6.0);
    let optimum = shortest(&map, &held).unwrap();
    assert!((optimum.value / straight - 1.0).abs() < 1e-9, "{}", optimum.value);
    assert_eq!((optimum.x[0], optimum.x[360]), (0.2, 0.8));
    let gamma = least_gamma(&map, &spacing_m(&map, &[0.5; 361]), &held).unwrap();
    // The solver's 1e-10 is of the square.
    assert!(gamma.value < 1e-4, "{}", gamma.value);
}

/// No line near an optimum, and on the road, is better by more than the tolerance that it was sought to.
fn no_neighbour_beats_an_optimum() {
    let cross_sections = shape("ellipse:250:50:12", 200);
    let map = LineMap::at_every_cross_section(&cross_sections);
    let road = Bounds::road(200);
    let envelope = PointMassEnvelope::new(&racer()).unwrap();
    let spacing = spacing_m(&map, &[0.5; 200]);
    let problem = ReferenceProblem {
        envelope: Some(&envelope),
        spacing_m: Some(&spacing),
        ..ReferenceProblem::of(&map)
    };
    let none = Weights::default();
    let fine = DescentSettings {
        least_gain: 1e-7,
        ..DescentSettings::default()
    };
    let mixed = Weights {
        time: 1.0,
        length: 0.01,
        gamma: 3.0,
        curvature: 2.0,
        ..none
    };
    let optima: [(&str, Weights, Optimum); 6] = [
        (
            "shortest",
            Weights { length: 1.0, ..none },
            shortest(&map, &road).unwrap(),
        ),
        (
            "squared length",
            Weights {
                squared_length: 1.0,
                ..none
            },
            least_squared_length(&map, &road).unwrap(),
        ),
        (
            "Gamma",
            Weights { gamma: 1.0, ..none },
            least_gamma(&map, &spacing, &road).unwrap(),
        ),
        (
            "curvature",
            Weights {
                curvature: 1.0,
                ..none
            },
            minimum_curvature(&map, &road, &[0.5; 200]).unwrap(),
        ),
        (
            "time",
            Weights { time: 1.0, ..none },
            fastest(&problem, &road, &[0.5; 200], &fine).unwrap(),
        ),
        (
            "a sum",
            mixed,
            descend(&problem, &road, &start(&[0.5; 200], mixed), &fine).unwrap(),
        ),
    ];
    for (name, weights, optimum) in optima {
        println!(
            "{name}: {:?} {} {:.3} s",
            optimum.status, optimum.value, optimum.seconds
        );
        assert_eq!(optimum.status, Status::Solved, "{name}");
        for size in [1e-4, 1e-2] {
            for near in neighbours(&optimum.x, size) {
                let cost = problem.cost(&weights, &near).0;
                assert!(
                    cost >= optimum.value * (1.0 - 1e-6),
                    "{name}: {cost} < {}",
                    optimum.value
                );
            }
        }
        // A descent from there has nowhere to go, one from elsewhere gets there.
        let others = [start(&optimum.x, weights), start(&[0.25; 200], weights)];
        for other in polish_lines(&problem, &road, &others, &fine).unwrap() {
            assert!(
                (other.value / optimum.value - 1.0).abs() < 2e-5,
                "{name}: {}",
                other.value
            );
        }
    }
}

fn mistakes_are_refused() {
    let cross_sections = shape("ellipse:250:50:12", 60);
    let map = LineMap::at_every_cross_section(&cross_sections);
    let problem = ReferenceProblem::of(&map);
    let none = Weights::default();
    let refusal = |bounds: &Bounds, start: Start| {
        let settings = DescentSettings::default();
        descend(&problem, bounds, &start, &settings)
            .unwrap_err()
            .to_string()
    };
    let road = Bounds::road(60);
    let length = Weights { length: 1.0, ..none };
    assert!(refusal(&Bounds::road(59), start(&[0.5; 60], length)).contains("59 bounds"));
    assert!(refusal(&road, start(&[0.5; 59], length)).contains("59 variables"));
    assert!(refusal(&road, start(&[0.5; 60], none)).contains("weights"));
    assert!(refusal(&road, start(&[0.5; 60], Weights { time: 1.0, ..none })).contains("a car"));
    let crossed = Bounds {
        lower: vec![2.0; 60],
        ..road.clone()
    };
    assert!(refusal(&crossed, start(&[0.5; 60], length)).contains("bounds of variable 0"));
    assert!(least_gamma(&map, &[1.0; 59], &road).is_err());
    let mut square = racer();
    square.ellipse_exponent = 1.5;
    assert!(PointMassEnvelope::new(&square).is_err());
}

/// The figures that Clarabel gives through Python on the same cross-sections.
fn convex_optima_of_the_surveyed_silverstone() {
    for (car, length, gamma) in [(0.0, 5710.944, 0.12610), (2.0, 5734.241, 0.12884)] {
        let cross_sections = silverstone(360, car);
        let map = LineMap::at_every_cross_section(&cross_sections);
        let road = Bounds::road(360);
        let path = shortest(&map, &road).unwrap();
        println!("shortest, {car} m: {} m in {:.3} s", path.value, path.seconds);
        assert!((path.value - length).abs() < 1e-3 && path.status == Status::Solved);
        assert!((path.lower_bound.unwrap() - length).abs() < 1e-3);
        let even = vec![cross_sections.length_m / 360.0; 360];
        let least = least_gamma(&map, &even, &road).unwrap();
        println!(
            "least Gamma, {car} m: {} 1/m in {:.3} s",
            least.value, least.seconds
        );
        assert!((least.value - gamma).abs() < 1e-5 && least.status == Status::Solved);
    }
    // True curvature, from two starts; and its Gamma, which grows with the number of cross-sections.
    for (n, gamma) in [(360, 0.143), (720, 0.204), (1178, 0.262)] {
        let cross_sections = silverstone(n, 2.0);
        let map = LineMap::at_every_cross_section(&cross_sections);
        let road = Bounds::road(n);
        let two = [0.5, 0.1].map(|alpha| minimum_curvature(&map, &road, &vec![alpha; n]).unwrap());
        assert!((two[0].value / two[1].value - 1.0).abs() < 1e-8);
        assert!(
            (two[0].measures.gamma_1pm - gamma).abs() < 5e-4,
            "{:?}",
            two[0].measures
        );
    }
    let cross_sections = silverstone(1178, 0.0);
    let curved = minimum_curvature(
        &LineMap::at_every_cross_section(&cross_sections),
        &Bounds::road(1178),
        &[0.5; 1178],
    )
    .unwrap();
    println!("least curvature: {} 1/m in {:.3} s", curved.value, curved.seconds);
    assert!((curved.value / 0.3107 - 1.0).abs() < 1e-3);
}

/// A minimum-time optimal control solution elsewhere laps in 116.37 s at steps of 3 m. Ours is within 0.35% of it, worked
/// out anew on a fine spline. What makes it the optimum is that starts from 120 to 160 s end within 1e-5 of one another,
/// at points of the first order.
fn fastest_lines_of_the_surveyed_silverstone() {
    let car = racer();
    let envelope = PointMassEnvelope::new(&car).unwrap();
    let n = 1962;
    let cross_sections = silverstone(n, 2.0);
    let every = LineMap::at_every_cross_section(&cross_sections);
    let road = Bounds::road(n);
    let curved = minimum_curvature(&every, &road, &vec![0.5; n]).unwrap().x;
    let path = shortest(&every, &road).unwrap().x;
    let time = Weights {
        time: 1.0,
        ..Weights::default()
    };
    // Three cross-sections to a control: with two, ripples are left that a fine spline feels and the cross-sections do not.
    let controls = 654;
    let (map, bounds) = LineMap::spline_about(&cross_sections, &curved, controls);
    let problem = ReferenceProblem {
        envelope: Some(&envelope),
        ..ReferenceProblem::of(&map)
    };
    let offsets = |line: &[f64]| -> Vec<f64> {
        let at = |k: usize| {
            let i = k * n / controls;
            (line[i] - curved[i]) * cross_sections.left_m[i].distance(cross_sections.right_m[i])
        };
        (0..controls).map(at).collect()
    };
    let starts = [&curved, &path, &vec![0.5; n]].map(|line| start(&offsets(line), time));
    let ends = polish_lines(&problem, &bounds, &starts, &DescentSettings::default()).unwrap();
    let mut fine_times = Vec::new();
    for (start, end) in starts.iter().zip(&ends) {
        let before = problem.measures(&start.x).time_s;
        // At a quarter of a metre the passes' own error, of the first order, is 0.01 %.
        let fine = FineLine::new(&map.line(&end.x), true, 0.25, Some((&car, &[])), 0.0).unwrap();
        let again = fine.lap_time_s().unwrap();
        println!(
            "{before:.3} s to {:.5} s, on a fine spline {again:.5} s, {} programs, {:.2} s",
            end.value, end.programs, end.seconds
        );
        assert_eq!(end.status, Status::Solved);
        assert!((end.value / ends[0].value - 1.0).abs() < 1e-5);
        fine_times.push(again);
    }
    // The best of them is the reference; the others differ by ripples between cross-sections, less than a thousandth.
    let best = fine_times.iter().copied().fold(f64::INFINITY, f64::min);
    assert!((best / 116.37 - 1.0).abs() < 3.5e-3, "{best}");
    assert!(
        fine_times.iter().all(|time| time / best < 1.001),
        "{fine_times:?}"
    );
}

/// The variables of a study's lines: the sums at the sections are held where its kernel clamps them.
fn control_points_are_polished() {
    let cross_sections = shape("ellipse:250:50:12", 300);
    let few = Parametrisation::control_points(50);
    let (map, bounds) = LineMap::parametrised(&cross_sections, &few).unwrap();
    let envelope = PointMassEnvelope::new(&racer()).unwrap();
    let problem = ReferenceProblem {
        envelope: Some(&envelope),
        ..ReferenceProblem::of(&map)
    };
    let none = Weights::default();
    let weights = |k: usize| Weights {
        time: k as f64,
        length: 0.1 * (6 - k) as f64,
        ..none
    };
    // Some of them leave the road, from where they are brought back first.
    let starts: Vec<Start> = (0..7)
        .map(|k| start(&[k as f64 / 5.0 - 0.1; 50], weights(k)))
        .collect();
    let settings = DescentSettings::default();
    let ends = polish_lines(&problem, &bounds, &starts, &settings).unwrap();
    for (start, end) in starts.iter().zip(&ends) {
        let held = start.x.iter().map(|x| x.clamp(0.0, 1.0)).collect::<Vec<f64>>();
        let before = problem.cost(&start.weights, &held).0;
        assert!(end.value < before, "{before} {end:?}");
        for row in &bounds.rows {
            assert!(row.at(&end.x) > row.lower - 1e-6 && row.at(&end.x) < row.upper + 1e-6);
        }
    }
    // The more time counts, the less of it passes.
    assert!(
        ends.windows(2)
            .all(|pair| pair[1].measures.time_s < pair[0].measures.time_s + 1e-3)
    );
    let again = polish_lines(&problem, &bounds, &starts, &settings).unwrap();
    assert!(ends.iter().zip(&again).all(|(a, b)| a.x == b.x));
}

/// The fastest line from the middle, from both edges, from the shortest and the minimum-curvature line and from three waves at
/// random: where each ends, as splines about the minimum-curvature line.
fn from_many_starts(cross_sections: &CrossSections, car: &PointMass) -> (LineMap, Vec<Optimum>) {
    let n = cross_sections.len();
    let envelope = PointMassEnvelope::new(car).unwrap();
    let every = LineMap::at_every_cross_section(cross_sections);
    let road = Bounds::road(n);
    let curved = minimum_curvature(&every, &road, &vec![0.5; n]).unwrap().x;
    let path = shortest(&every, &road).unwrap().x;
    let random = Random::new(11);
    let wave = |who: u32| -> Vec<f64> {
        let part = |i: usize, k: u32| {
            let phase = TAU * random.uniform(1, who, k, 0);
            (TAU * f64::from(3 * k + 2) * i as f64 / n as f64 + phase).sin()
        };
        let at = |i: usize| 0.5 + 0.12 * (1..=4).map(|k| part(i, k)).sum::<f64>();
        (0..n).map(|i| at(i).clamp(0.0, 1.0)).collect()
    };
    let lines = [
        vec![0.5; n],
        vec![0.0; n],
        vec![1.0; n],
        path,
        curved.clone(),
        wave(1),
        wave(2),
        wave(3),
    ];
    // Three cross-sections to a control: with two, ripples are left that a fine spline feels and the cross-sections do not.
    let controls = n / 3;
    let (map, bounds) = LineMap::spline_about(cross_sections, &curved, controls);
    let problem = ReferenceProblem {
        envelope: Some(&envelope),
        ..ReferenceProblem::of(&map)
    };
    let time = Weights {
        time: 1.0,
        ..Weights::default()
    };
    let starts = lines.map(|line| {
        let at = |k: usize| {
            let i = k * n / controls;
            (line[i] - curved[i]) * cross_sections.left_m[i].distance(cross_sections.right_m[i])
        };
        start(&(0..controls).map(at).collect::<Vec<f64>>(), time)
    });
    let ends = polish_lines(&problem, &bounds, &starts, &DescentSettings::default()).unwrap();
    for (start, end) in starts.iter().zip(&ends) {
        println!(
            "{:.3} s to {:.5} s, {} programs, {:.2} s",
            problem.measures(&start.x).time_s,
            end.value,
            end.programs,
            end.seconds
        );
        assert_eq!(end.status, Status::Solved);
    }
    (map, ends)
}

/// Eight starts, one end: to the share that a descent gives up at, 1e-6 of the lap for each step, and some of them.
fn every_start_ends_at_the_same_lap_of_the_bundled_circuit() {
    let track = Track::load("silverstone_gp").unwrap();
    let cross_sections = track.cross_sections(480, true).unwrap();
    let (_, ends) = from_many_starts(&cross_sections.narrowed(2.0).unwrap(), &racer());
    let best = ends.iter().map(|e| e.value).fold(f64::INFINITY, f64::min);
    assert!(ends.iter().all(|e| e.value / best - 1.0 < 5e-5));
}

/// The same on the surveyed circuit, and then, which is the reference that swarms are held against, splines about the best of
/// these lines, across cross-sections square to it, ever closer together, down to a metre with a control every three. There the
/// lap is transcribed in two ways, one whose error takes time off it (segments with the mean bend of their ends) and one whose
/// error adds to it (with the tighter bend): the optimum is between the two, and so is either line's time on a fine spline.
/// Elsewhere a minimum-time optimal control solution laps in 116.37 s at 3 m, in 116.41 s at 5 m and in 116.49 s at 8 m, from
/// eight starts out of eight.
fn every_start_ends_at_the_same_lap_of_the_surveyed_silverstone() {
    let car = racer();
    let cross_sections = silverstone(981, 2.0);
    let (map, ends) = from_many_starts(&cross_sections, &car);
    let best = ends.iter().min_by(|a, b| a.value.total_cmp(&b.value)).unwrap();
    assert!(ends.iter().all(|e| e.value / best.value - 1.0 < 5e-5));
    let envelope = PointMassEnvelope::new(&car).unwrap();
    let mut points = map.line(&best.x);
    let lap = |points: &[glam::DVec2]| {
        let fine = FineLine::new(points, true, 0.25, Some((&car, &[])), 0.0).unwrap();
        fine.lap_time_s().unwrap()
    };
    let about = |points: &[glam::DVec2], count: usize, bend: SegmentBend| {
        let cross_sections = cross_sections_about(&cross_sections, points, Spread::Even(count)).unwrap();
        let (map, bounds) = LineMap::spline_about(&cross_sections, &cross_sections.reference, count / 3);
        let problem = ReferenceProblem {
            envelope: Some(&envelope),
            bend,
            ..ReferenceProblem::of(&map)
        };
        let start = vec![0.0; count / 3];
        let solved = fastest(&problem, &bounds, &start, &DescentSettings::default()).unwrap();
        let points = map.line(&solved.x);
        println!(
            "{count} cross-sections, {bend:?}: {:.3} s, on a fine spline {:.3} s",
            solved.value,
            lap(&points)
        );
        (solved.value, points)
    };
    let mut above = f64::INFINITY;
    for count in [1962, 2943, 5886] {
        (above, points) = about(&points, count, SegmentBend::Tighter);
    }
    let (below, other) = about(&points, 5886, SegmentBend::Mean);
    for line in [&points, &other] {
        let time = lap(line);
        assert!(below < time && time < above, "{below} {time} {above}");
        // The published solution is one of the first kind, at 3 m: below 116.42 s at a metre as it is below the rest.
        assert!((time / 116.37 - 1.0).abs() < 1.5e-3, "{time}");
    }
    // The optimum is known to this share.
    assert!(above / below - 1.0 < 2e-3, "{below} {above}");
    assert!((lap(&points) / lap(&other) - 1.0).abs() < 5e-4);
}

fn sectors_summed_leave_the_links_out() {
    let bundled = Track::load("silverstone_gp").unwrap();
    let cross_sections = bundled.cross_sections(360, true).unwrap();
    sectors_summed(&cross_sections, None);
}

fn sectors_summed_of_the_survey_are_those_published() {
    sectors_summed(&silverstone(360, 0.0), Some(5513.87));
}

/// Sectors that are solved each for itself and summed, as once published (5513.87 m of the surveyed circuit, twelve sectors
/// of thirty cross-sections): each sum lacks the twelve links from one sector to the next, and each sector ends where the next one
/// need not begin. With the links it is longer than the lap.
fn sectors_summed(cross_sections: &CrossSections, published: Option<f64>) {
    let lap = shortest(
        &LineMap::at_every_cross_section(cross_sections),
        &Bounds::road(360),
    )
    .unwrap()
    .value;
    let mut sum = 0.0;
    let mut ends: Vec<[glam::DVec2; 2]> = Vec::new();
    for sector in 0..12 {
        let part = cross_sections.stretch(30 * sector, 30).unwrap();
        let map = LineMap::at_every_cross_section(&part);
        let solved = shortest(&map, &Bounds::road(30)).unwrap();
        let points = map.line(&solved.x);
        sum += solved.value;
        ends.push([points[0], points[29]]);
    }
    let links: f64 = (0..12).map(|s| ends[s][1].distance(ends[(s + 1) % 12][0])).sum();
    println!(
        "{}: lap {lap:.2} m, sectors {sum:.2} m, links {links:.2} m",
        cross_sections.name
    );
    assert!(sum < lap && sum + links > lap);
    if let Some(published) = published {
        // Within 0.1 %: a swarm's, not an optimum.
        assert!((sum / published - 1.0f64).abs() < 1e-3, "{sum}");
    }
}
