//! Racing lines of a swarm that lives on the device, against the same lines asked for from the host.

use crate::common::Random;
use crate::common::line::{circuit, gt_car, lines};
use crate::device::{devices, the_device};
use glam::DVec2;
use lapswarm::evaluate::gpu::GpuContext;
use lapswarm::evaluate::line::{GpuLineEvaluator, LineObjective, LineProblem};
use lapswarm::evaluate::{Evaluation, Evaluator};
use lapswarm::line::Parametrisation;
use lapswarm::swarm::checkpoint::{from_bytes, to_bytes};
use lapswarm::swarm::device::DeviceMopso;
use lapswarm::swarm::metrics::{hypervolume, non_dominated};
use lapswarm::swarm::{MANY, Mopso, MopsoSettings, Optimiser, PsoSettings};
use std::path::Path;
use std::sync::Arc;

tests! {
    objectives_are_those_of_the_host: device,
    fronts_are_those_of_the_host: device,
    a_swarm_of_one_objective_moves_on_the_device_as_in_lanes: device,
}

/// A few more than a whole number of blocks.
const PARTICLES: usize = MANY + 5;
const GENERATIONS: usize = 12;

fn problem(objectives: &[LineObjective]) -> LineProblem {
    let cross_sections = circuit(120, 12.0, true, DVec2::new(300.0, -200.0), &mut Random(1));
    let way = Parametrisation::control_points(30).with_overshoot(0.25);
    LineProblem::new(cross_sections, way, objectives, Some(gt_car()), 0.0).expect("a sound problem")
}

fn start(line: &LineProblem) -> Vec<Vec<f64>> {
    let population = lines(line, PARTICLES, &mut Random(2));
    population
        .chunks_exact(line.dimensions())
        .map(<[f64]>::to_vec)
        .collect()
}

fn settings() -> MopsoSettings {
    let default = MopsoSettings::default();
    let motion = PsoSettings {
        population: PARTICLES,
        iterations: GENERATIONS,
        ..default.motion
    };
    MopsoSettings { motion, ..default }
}

fn swarm(line: &LineProblem, context: &Arc<GpuContext>) -> DeviceMopso {
    let mut swarm = DeviceMopso::new(&line.problem, settings(), Arc::clone(context)).unwrap();
    swarm.start_from(&start(line)).unwrap();
    swarm
}

/// The swarm in lanes is told what the device has measured. Where the device rounds as the processor does they stay together bit for
/// bit; elsewhere until the first move.
fn a_swarm_of_one_objective_moves_on_the_device_as_in_lanes() {
    let context = the_device();
    let line = problem(&[LineObjective::LapTime]);
    let settings = MopsoSettings {
        motion: PsoSettings {
            population: PARTICLES,
            iterations: GENERATIONS,
            seed: 4,
            ..PsoSettings::thesis()
        },
        ..MopsoSettings::thesis()
    };
    let mut here = Mopso::new(&line.problem, settings.clone()).unwrap();
    let mut there = DeviceMopso::new(&line.problem, settings, Arc::clone(&context)).unwrap();
    let mut judge = GpuLineEvaluator::new(&line, Arc::clone(&context)).unwrap();
    let exact = crate::swarm::rounds_like_the_processor(&context);
    let mut bests = Vec::new();
    for generation in 0..GENERATIONS {
        let candidates = here.ask();
        if exact || generation == 0 {
            assert!(candidates == there.candidates().unwrap(), "{generation}");
        }
        there.evaluate(&mut judge).unwrap();
        let told = Evaluation {
            objectives: there.objectives().unwrap(),
            failures: vec![None; PARTICLES],
            violations: Vec::new(),
        };
        here.tell(&told).unwrap();
        bests.push(there.learn_and_move().unwrap().best[0]);
        if exact {
            assert_eq!(there.best(), here.best(), "{generation}");
        }
    }
    assert_eq!(there.front().candidates.len(), 1);
    assert!(
        bests.is_sorted_by(|a, b| a >= b) && bests[GENERATIONS - 1] < bests[0],
        "{bests:?}"
    );
    let default = MopsoSettings::default().with_size(MANY, 1);
    let refused = DeviceMopso::new(&line.problem, default, context)
        .map(drop)
        .unwrap_err();
    assert!(refused.to_string().contains("difference_share"), "{refused}");
}

/// The device scales positions in `f32`: a control point is off by two spacings of a float beside one, 2.4e-7 of 12 m, which
/// between cross-sections 12 m apart is 8e-8 1/m of curvatures of some 0.01, and less of all else: under 2e-5 of any objective.
fn objectives_are_those_of_the_host() {
    let both = [
        &LineObjective::ALL[2..],
        &[LineObjective::LapTime, LineObjective::Length],
    ];
    let devices = devices();
    for (context, objectives) in devices
        .iter()
        .flat_map(|context| both.map(|objectives| (context, objectives)))
    {
        let line = problem(objectives);
        let mut judge = GpuLineEvaluator::new(&line, Arc::clone(context)).unwrap();
        let few = judge.batching();
        let mut judges = [
            GpuLineEvaluator::new(&line, Arc::clone(context)).unwrap(),
            // Several batches, and several dispatches to each.
            GpuLineEvaluator::new(&line, Arc::clone(context))
                .unwrap()
                .with_batching(lapswarm::evaluate::line::LineBatching {
                    bytes: 1 << 20,
                    lanes: 320,
                    ..few
                }),
        ];
        let mut swarm = swarm(&line, context);
        let expected = judge.evaluate(&swarm.candidates().unwrap()).unwrap().objectives;
        let asked: Vec<f64> = start(&line).concat();
        let given = swarm.candidates().unwrap();
        assert!(given.iter().zip(&asked).all(|(a, b)| (a - b).abs() < 1e-6));
        for judge in &mut judges {
            swarm.evaluate(judge).unwrap();
            let found = swarm.objectives().unwrap();
            assert_eq!(found.len(), expected.len());
            for (i, (a, b)) in found.iter().zip(&expected).enumerate() {
                assert!((a / b - 1.0).abs() < 2e-5, "{i}: {a} is not {b}");
            }
        }
    }
}

/// The swarm on the device comes as far as the one that is asked and told; what it keeps is worth what it says; and it goes
/// on from a file as if nothing had been.
fn fronts_are_those_of_the_host() {
    let context = the_device();
    let line = problem(&[
        LineObjective::Gamma,
        LineObjective::Length,
        LineObjective::LapTime,
    ]);
    let mut judge = GpuLineEvaluator::new(&line, Arc::clone(&context)).unwrap();
    let mut there = swarm(&line, &context);
    let mut stopped = None;
    for generation in 0..GENERATIONS {
        if generation == 4 {
            stopped = Some(to_bytes(&there.state().unwrap()).unwrap());
        }
        there.step(&mut judge).unwrap();
    }
    let state = from_bytes(&stopped.unwrap(), Path::new("state")).unwrap();
    let mut again = DeviceMopso::from_state(state, Arc::clone(&context)).unwrap();
    assert_eq!(
        (again.iteration(), again.evaluations()),
        (4, 4 * PARTICLES as u64)
    );
    for _ in 4..GENERATIONS {
        again.step(&mut judge).unwrap();
    }
    assert_eq!(again.front(), there.front());
    assert_eq!(again.candidates().unwrap(), there.candidates().unwrap());

    let mut here = Mopso::new(&line.problem, settings()).unwrap();
    here.start_from(&start(&line)).unwrap();
    let first = judge.evaluate(&here.ask()).unwrap().objectives;
    while !here.done() {
        let candidates = here.ask();
        here.tell(&judge.evaluate(&candidates).unwrap()).unwrap();
    }
    let found = there.front();
    assert_eq!(non_dominated(&found.objectives).len(), found.objectives.len());
    let scored = judge.evaluate(&found.candidates.concat()).unwrap().objectives;
    for (a, b) in found.objectives.concat().iter().zip(&scored) {
        assert!((a / b - 1.0).abs() < 2e-5, "{a} is not {b}");
    }
    // Shares of the box from the best of the host's front to the median first line.
    let column = |k: usize| first.iter().skip(k).step_by(3).copied();
    let reference: Vec<f64> = (0..3)
        .map(|k| lapswarm::swarm::comparison::quartiles(&column(k).collect::<Vec<_>>())[1])
        .collect();
    let volume = |rows: &[Vec<f64>]| {
        let best = here.best();
        let share = |row: &Vec<f64>| {
            (0..3)
                .map(|k| (row[k] - best[k]) / (reference[k] - best[k]))
                .collect()
        };
        let shares: Vec<Vec<f64>> = rows.iter().map(share).collect();
        hypervolume(&shares, &[1.0; 3]).unwrap()
    };
    let begun: Vec<Vec<f64>> = first.chunks_exact(3).map(<[f64]>::to_vec).collect();
    let (begun, here_found, there_found) = (
        volume(&begun),
        volume(&here.front().objectives),
        volume(&found.objectives),
    );
    assert!(here_found > begun + 0.02, "{begun} to {here_found}");
    // The swarms part ways at the first rounding that turns a comparison; seeds differ by as much.
    assert!(
        (here_found - there_found).abs() < 0.3 * (here_found - begun),
        "{here_found} and {there_found} from {begun}"
    );
}
