//! Racing lines: shape and lap time on every backend, against `f64`, and how the work is cut.

use crate::common::Random;
use crate::common::line::{circuit, gt_car, line_problem, lines, random_car, ring};
use crate::device::{device, the_device};
use glam::DVec2;
use lapswarm::evaluate::line::{
    CpuLineEvaluator, GpuLineEvaluator, LineBatching, LineObjective, LineProblem, SimdLineEvaluator,
};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{Evaluation, Evaluator, FAILED_COST, Failure};
use lapswarm::line::{Parametrisation, PointMass};
use lapswarm::parity::{in_relief, line_tolerances};

tests! {
    lines_cost_what_the_reference_says_on_every_backend: also_device,
    circles_have_the_shape_of_their_polygons_on_every_backend: also_device,
    lines_do_not_know_where_on_earth_they_are: also_device,
    a_line_costs_the_same_alone_and_among_others: also_device,
    batches_and_dispatches_of_lines_do_not_show: device,
    objectives_do_not_depend_on_each_other: also_device,
}

/// Objectives of a line.
const COUNT: usize = LineObjective::ALL.len();

/// The single-precision backends.
fn backends(problem: &LineProblem) -> Vec<(String, Box<dyn Evaluator + '_>)> {
    let mut backends: Vec<(String, Box<dyn Evaluator>)> = Vec::new();
    for set in InstructionSet::available() {
        backends.push((
            format!("simd {}", set.name()),
            Box::new(SimdLineEvaluator::new(problem, set)),
        ));
    }
    if let Some(context) = device() {
        let evaluator = GpuLineEvaluator::new(problem, context).expect("the kernel compiles");
        backends.push(("gpu".to_owned(), Box::new(evaluator)));
    }
    backends
}

/// Compares `found` with `f64` and hands back the largest relative error of each objective.
fn compare(name: &str, problem: &LineProblem, population: &[f64], found: &Evaluation) -> [f64; COUNT] {
    let expected = CpuLineEvaluator::new(problem)
        .evaluate(population)
        .expect("it runs");
    assert_eq!(found.failures, expected.failures, "{name}");
    let mut worst = [0.0f64; COUNT];
    let rows = found
        .objectives
        .chunks_exact(COUNT)
        .zip(expected.objectives.chunks_exact(COUNT));
    for (line, (found, expected)) in rows.enumerate() {
        let tolerances = line_tolerances(problem, expected);
        for k in 0..5 {
            let error = (found[k] - expected[k]).abs();
            assert!(
                error <= tolerances[k],
                "{name}, line {line}, {}: {} for {}, tolerance {:e}",
                LineObjective::ALL[k].name(),
                found[k],
                expected[k],
                tolerances[k]
            );
            worst[k] = worst[k].max(error / expected[k].abs());
        }
    }
    worst
}

/// Problems of every kind: open and closed, by sections and by control points, whole and in part.
fn problems() -> Vec<(&'static str, LineProblem)> {
    let mut random = Random(5);
    let mut made = |sections: usize, spacing: f64, closed: bool| {
        let centre = DVec2::new(random.within(-2e3, 2e3), random.within(-2e3, 2e3));
        let cross_sections = circuit(sections, spacing, closed, centre, &mut random);
        (cross_sections, random_car(&mut random))
    };
    let mut problems = Vec::new();
    for (closed, sections, spacing) in [
        (true, 360, 16.0),
        (false, 200, 10.0),
        (true, 1000, 5.0),
        (true, 75, 12.0),
    ] {
        let (cross_sections, car) = made(sections, spacing, closed);
        problems.push((
            "control points",
            line_problem(cross_sections, Parametrisation::control_points(sections / 4), car),
        ));
        let (cross_sections, car) = made(sections, spacing, closed);
        problems.push((
            "sections",
            line_problem(cross_sections, Parametrisation::sections(), car),
        ));
    }
    let (cross_sections, car) = made(360, 16.0, true);
    let part = Parametrisation::control_points(60).with_free((10..25).collect(), vec![0.4; 60]);
    problems.push(("a sector", line_problem(cross_sections, part, car)));
    let (cross_sections, car) = made(150, 12.0, false);
    let ends = Parametrisation::control_points(30).with_fixed_ends(vec![0.3; 30]);
    problems.push(("fixed ends", line_problem(cross_sections, ends, car)));
    for (closed, sections) in [(true, 360), (false, 150)] {
        let (cross_sections, car) = made(sections, 16.0, closed);
        let (cross_sections, car) = in_relief(&cross_sections, &car).expect("sound limits");
        let way = Parametrisation::control_points(sections / 4);
        problems.push(("hills", line_problem(cross_sections, way, car)));
        let (cross_sections, car) = made(sections, 16.0, closed);
        let (cross_sections, _) = in_relief(&cross_sections, &car).expect("sound limits");
        // Limits that were not swept go with the load.
        let car = PointMass { relief: true, ..car };
        let way = Parametrisation::sections();
        problems.push(("hills, scaled limits", line_problem(cross_sections, way, car)));
    }
    problems
}

fn lines_cost_what_the_reference_says_on_every_backend() {
    for (kind, problem) in problems() {
        let population = lines(&problem, 70, &mut Random(6));
        let mut lanes: Option<Evaluation> = None;
        for (name, mut backend) in backends(&problem) {
            let found = backend.evaluate(&population).expect("it runs");
            let worst = compare(&format!("{kind}, {name}"), &problem, &population, &found);
            println!(
                "{kind}, {} sections, {name}: {:?}",
                problem.cross_sections().len(),
                worst.map(|x| format!("{x:.0e}"))
            );
            if name.starts_with("simd") {
                // Every instruction set rounds alike.
                assert_eq!(*lanes.get_or_insert_with(|| found.clone()), found, "{name}");
            }
        }
    }
}

fn circles_have_the_shape_of_their_polygons_on_every_backend() {
    let cross_sections = ring(590.0, 600.0, 361);
    // Second differences are over the spacing of the cross-sections, whatever the radius of the line.
    let spacing = cross_sections.length_m / 361.0;
    let problem = line_problem(cross_sections, Parametrisation::sections(), gt_car());
    let population: Vec<f64> = [0.0, 0.5, 1.0].iter().flat_map(|a| vec![*a; 361]).collect();
    let mut backends = backends(&problem);
    backends.push(("cpu".to_owned(), Box::new(CpuLineEvaluator::new(&problem))));
    for (name, mut backend) in backends {
        let found = backend.evaluate(&population).expect("it runs");
        for (row, radius) in found.objectives.chunks_exact(COUNT).zip([600.0f64, 595.0, 590.0]) {
            let side = 2.0 * radius * (std::f64::consts::PI / 361.0).sin();
            let bend = side * side / (radius * spacing * spacing);
            let exact = [361.0 * side, 361.0 * side * side, 19.0 * bend];
            for (found, exact) in row.iter().zip(exact) {
                // Curvature is a difference of directions of 0.017, in which a rounding counts sixtyfold.
                let relative = if name == "cpu" { 1e-12 } else { 60.0 * 3.0 * 6e-8 };
                assert!(
                    (found / exact - 1.0).abs() < relative,
                    "{name}: {found} and {exact}"
                );
            }
        }
    }
}

/// A circuit far from the origin: its lines cost the same to the last bit that the differences have, because no backend
/// subtracts coordinates in single precision.
fn lines_do_not_know_where_on_earth_they_are() {
    let near = circuit(360, 16.0, true, DVec2::ZERO, &mut Random(9));
    let far = circuit(360, 16.0, true, DVec2::new(3e5, -5.2e6), &mut Random(9));
    let way = || Parametrisation::control_points(90);
    let (near, far) = (
        line_problem(near, way(), gt_car()),
        line_problem(far, way(), gt_car()),
    );
    let population = lines(&near, 40, &mut Random(10));
    for ((name, mut here), (_, mut there)) in backends(&near).into_iter().zip(backends(&far)) {
        let here = here.evaluate(&population).expect("it runs");
        let there = there.evaluate(&population).expect("it runs");
        for (row, (a, b)) in here
            .objectives
            .chunks_exact(COUNT)
            .zip(there.objectives.chunks_exact(COUNT))
            .enumerate()
        {
            for (k, tolerance) in line_tolerances(&near, a).into_iter().enumerate() {
                assert!(
                    (a[k] - b[k]).abs() <= tolerance,
                    "{name}, line {row}: {} {}",
                    a[k],
                    b[k]
                );
            }
        }
    }
}

fn bits(evaluation: &Evaluation) -> (Vec<u64>, Vec<Option<Failure>>) {
    let objectives = evaluation.objectives.iter().map(|x| x.to_bits()).collect();
    (objectives, evaluation.failures.clone())
}

fn a_line_costs_the_same_alone_and_among_others() {
    let cross_sections = circuit(300, 14.0, true, DVec2::ZERO, &mut Random(11));
    let problem = line_problem(cross_sections, Parametrisation::control_points(50), gt_car());
    let mut population = lines(&problem, 150, &mut Random(12));
    population[50 * 7 + 3] = f64::NAN;
    for (name, mut backend) in backends(&problem) {
        let together = backend.evaluate(&population).expect("it runs");
        assert_eq!(together.failures[7], Some(Failure::NotFinite));
        assert_eq!(together.objectives[7 * COUNT..8 * COUNT], [FAILED_COST; COUNT]);
        assert_eq!(together.failures.iter().flatten().count(), 1);
        let again = backend.evaluate(&population).expect("it runs");
        assert_eq!(bits(&again), bits(&together), "{name}, repeated");
        for count in [1, 5, 64, 65, 149] {
            let fewer = backend.evaluate(&population[..count * 50]).expect("it runs");
            let expected = Evaluation {
                objectives: together.objectives[..count * COUNT].to_vec(),
                failures: together.failures[..count].to_vec(),
                violations: Vec::new(),
            };
            assert_eq!(bits(&fewer), bits(&expected), "{name}, {count} lines");
        }
        assert_eq!(
            backend.evaluate(&[]).expect("it runs"),
            Evaluation::default(),
            "{name}, no lines"
        );
    }
}

fn batches_and_dispatches_of_lines_do_not_show() {
    let context = the_device();
    let cross_sections = circuit(120, 14.0, true, DVec2::ZERO, &mut Random(13));
    let problem = line_problem(cross_sections, Parametrisation::control_points(30), gt_car());
    let population = lines(&problem, 400, &mut Random(14));
    let mut evaluator = GpuLineEvaluator::new(&problem, context).expect("the kernel compiles");
    let usual = evaluator.batching();
    let expected = evaluator.evaluate(&population).expect("it runs");
    for batching in [
        LineBatching { lanes: 1, ..usual },
        LineBatching { lanes: 128, ..usual },
        // Less than the least there can be, and two workgroups.
        LineBatching { bytes: 1, ..usual },
        LineBatching {
            bytes: 2 * 64 * 2 * 120 * 4,
            ..usual
        },
        LineBatching {
            dispatch_ms: 0.1,
            ..usual
        },
    ] {
        evaluator = evaluator.with_batching(batching);
        let found = evaluator.evaluate(&population).expect("it runs");
        assert_eq!(bits(&found), bits(&expected), "{batching:?}");
    }
}

/// Each objective alone gives what it gives among all: kernels are specialised to what is asked for.
fn objectives_do_not_depend_on_each_other() {
    let cross_sections = circuit(100, 14.0, true, DVec2::ZERO, &mut Random(15));
    let all = line_problem(cross_sections.clone(), Parametrisation::sections(), gt_car());
    let population = lines(&all, 20, &mut Random(16));
    for (k, objective) in LineObjective::ALL.into_iter().enumerate() {
        let car = (objective == LineObjective::LapTime).then(gt_car);
        let one = LineProblem::new(
            cross_sections.clone(),
            Parametrisation::sections(),
            &[objective],
            car,
            0.0,
        )
        .expect("a sound problem");
        for ((name, mut alone), (_, mut among)) in backends(&one).into_iter().zip(backends(&all)) {
            let alone = alone.evaluate(&population).expect("it runs");
            let among = among.evaluate(&population).expect("it runs");
            for (found, row) in alone.objectives.iter().zip(among.objectives.chunks_exact(COUNT)) {
                assert_eq!(*found, row[k], "{name}, {}", objective.name());
            }
        }
    }
}
