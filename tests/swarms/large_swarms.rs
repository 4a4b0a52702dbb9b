//! Swarms of thousands: how good, that nothing is lost, and that threads change nothing.

use lapswarm::evaluate::point::{CallCost, PointEvaluator};
use lapswarm::evaluate::simd::InstructionSet;
use lapswarm::evaluate::{Evaluation, Evaluator, FAILED_COST, Objective, Problem, Variable};
use lapswarm::random::Random;
use lapswarm::swarm::metrics::{Scale, hypervolume, non_dominated};
use lapswarm::swarm::problems::{SimdTestEvaluator, SuiteProblem, TestProblem};
use lapswarm::swarm::{
    BoundHandling, Constriction, Leaders, MANY, Mopso, MopsoSettings, Mutation, Optimiser, PsoSettings,
    Randomness, Truncation, run,
};
use std::ops::ControlFlow;

fn settings(population: usize, iterations: usize) -> MopsoSettings {
    let default = MopsoSettings::default();
    MopsoSettings {
        motion: PsoSettings {
            population,
            iterations,
            ..default.motion
        },
        ..default
    }
}

/// Hypervolume, reference 1.1 on the true front's scale, of what a swarm finds in 25 generations.
fn quality(name: &str, population: usize) -> f64 {
    let test = TestProblem::by_name(name).unwrap();
    let mut swarm = Mopso::new(test.problem(), settings(population, 25)).unwrap();
    let mut evaluator = SimdTestEvaluator::new(&test, InstructionSet::best());
    run(&mut swarm, &mut evaluator, |_| ControlFlow::Continue(())).unwrap();
    let front = test.front(2000);
    let found = Scale::of(&front).apply(&swarm.front().objectives);
    assert!(found.len() <= 100 && non_dominated(&found).len() == found.len());
    hypervolume(&found, &vec![1.1; front[0].len()]).unwrap()
}

/// The archive does not get worse as the swarm grows.
#[test]
fn large_swarms_find_good_fronts_in_25_generations() {
    for population in [10_000, 100_000] {
        for (name, bar) in [("zdt4", 0.871), ("dtlz2", 0.755)] {
            let found = quality(name, population);
            assert!(found >= bar, "{name}, {population} particles: {found}");
        }
    }
}

/// A front whose ends lie far out: 10^u and 10^-u, u from -4 to 4. What 30 generations of such a swarm keep of it: the hypervolume
/// up to 25, a knee of a four-hundredth of the ranges, and the members there.
fn knee(population: usize, reference: Option<Vec<f64>>) -> (f64, usize) {
    let problem = Problem {
        variables: vec![Variable::new("u", "-", -4.0, 4.0)],
        ..unconstrained(0, 2)
    };
    let settings = MopsoSettings {
        reference,
        ..settings(population, 30)
    };
    let mut swarm = Mopso::new(&problem, settings).unwrap();
    let mut evaluator = PointEvaluator::new(problem, CallCost::Cheap, |x: &[f64], f: &mut [f64]| {
        f.copy_from_slice(&[10f64.powf(x[0]), 10f64.powf(-x[0])]);
    });
    run(&mut swarm, &mut evaluator, |_| ControlFlow::Continue(())).unwrap();
    let found = swarm.front().objectives;
    let near = found.iter().filter(|row| row.iter().all(|x| *x < 25.0)).count();
    (hypervolume(&found, &[25.0; 2]).unwrap(), near)
}

#[test]
fn a_large_swarm_keeps_the_knee_of_a_front_with_long_tails() {
    for (reference, least) in [(None, 30), (Some(vec![25.0; 2]), 99)] {
        let (small, members) = knee(MANY - 1, reference.clone());
        assert!(members >= least, "{members} of a small swarm");
        for population in [MANY, 4 * MANY] {
            let (large, members) = knee(population, reference.clone());
            assert!(
                large > 0.999 * small,
                "{population}, {reference:?}: {large} after {small}"
            );
            assert!(members >= least, "{population}, {reference:?}: {members}");
        }
    }
}

/// Where pulls and differences alone stay behind, a swarm that is large enough for lanes makes crossings as a small one does.
#[test]
fn a_large_swarm_is_as_good_as_a_small_one_where_crossings_count() {
    for name in ["wfg4_2", "wfg4_3"] {
        let found = |population: usize| {
            let suite = SuiteProblem::by_name(name).unwrap();
            let mut swarm = Mopso::new(suite.problem(), settings(population, 40)).unwrap();
            run(&mut swarm, &mut suite.evaluator(), |_| ControlFlow::Continue(())).unwrap();
            let front = suite.scale().apply(&swarm.front().objectives);
            hypervolume(&front, &vec![1.1; front[0].len()]).unwrap()
        };
        let (small, large) = (found(MANY - 1), found(MANY));
        // Without crossings it is 0.954 and 0.952 of the small one's.
        assert!(large > 0.98 * small, "{name}: {large} after {small}");
    }
}

fn unconstrained(variables: usize, objectives: usize) -> Problem {
    Problem {
        variables: (0..variables)
            .map(|k| Variable::new(format!("x{k}"), "-", -1.0, 3.0))
            .collect(),
        objectives: (0..objectives)
            .map(|k| Objective::new(format!("f{k}"), "-"))
            .collect(),
    }
}

/// What is told of random candidates, on a coarse grid so that there are ties and duplicates; some fail.
fn synthetic_evaluation(count: usize, width: usize, when: u32) -> Evaluation {
    let random = Random::new(77);
    let mut evaluation = Evaluation::default();
    for i in 0..count as u32 {
        let draw = |k: u32| random.below(400, 1, when, i, k) as f64 / 8.0;
        let mut row: Vec<f64> = (0..width as u32).map(draw).collect();
        match random.below(50, 2, when, i, 0) {
            0 => row[0] = f64::NAN,
            1 => row[width - 1] = f64::INFINITY,
            2 => row.fill(FAILED_COST),
            3 => row[0] = f64::NEG_INFINITY,
            _ => {}
        }
        evaluation.objectives.extend(row);
        evaluation.failures.push(None);
    }
    evaluation
}

/// With room for all, the archive is exactly what nothing that was ever told dominates, one of each.
#[test]
fn nothing_is_lost_but_by_truncation() {
    for width in [2, 3] {
        let mut swarm = Mopso::new(
            &unconstrained(3, width),
            MopsoSettings {
                archive: 5000,
                ..settings(MANY + 100, 10)
            },
        )
        .unwrap();
        let mut told: Vec<Vec<f64>> = Vec::new();
        for when in 0..5 {
            swarm.ask();
            let evaluation = synthetic_evaluation(MANY + 100, width, when);
            let rows = evaluation.objectives.chunks_exact(width);
            told.extend(
                rows.filter(|r| r.iter().all(|x| x.is_finite() && *x < FAILED_COST))
                    .map(<[f64]>::to_vec),
            );
            swarm.tell(&evaluation).unwrap();
            let mut expected: Vec<_> = non_dominated(&told)
                .into_iter()
                .map(|i| told[i].clone())
                .collect();
            let mut found = swarm.front().objectives;
            let key = |a: &Vec<f64>, b: &Vec<f64>| a.partial_cmp(b).unwrap();
            expected.sort_by(key);
            found.sort_by(key);
            assert!(found == expected, "{width} objectives, generation {when}");
        }
    }
}

/// Every combination that the settings have, on one thread and on three: the same candidates and the same front.
#[test]
fn threads_change_nothing() {
    let test = TestProblem::sized("dtlz2", 5).unwrap();
    let variants = [
        settings(MANY + 1, 10),
        MopsoSettings {
            motion: PsoSettings {
                mutation: Mutation::None,
                ..MopsoSettings::thesis().motion
            },
            ..MopsoSettings::thesis()
        },
        MopsoSettings {
            motion: PsoSettings {
                constriction: Constriction::Clerc,
                randomness: Randomness::PerDimension,
                bounds: BoundHandling::Bounce,
                mutation: Mutation::None,
                ..MopsoSettings::smpso().motion
            },
            leaders: Leaders::Random,
            truncation: Truncation::MutualNearest,
            archive: 30,
            reference: None,
            push_and_pull: false,
        },
    ];
    for variant in variants {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let motion = PsoSettings {
                    population: 2 * MANY + 70,
                    iterations: 10,
                    ..variant.motion.clone()
                };
                let mut swarm = Mopso::new(
                    test.problem(),
                    MopsoSettings {
                        motion,
                        ..variant.clone()
                    },
                )
                .unwrap();
                let mut evaluator = test.threaded_evaluator();
                while !swarm.done() {
                    let population = swarm.ask();
                    assert!(population.iter().all(|x| (0.0..=1.0).contains(x)));
                    swarm.tell(&evaluator.evaluate(&population).unwrap()).unwrap();
                }
                (swarm.ask(), swarm.front())
            })
        };
        let (one, three) = (with(1), with(3));
        assert!(one == three, "{variant:?}");
        assert!(one.1.objectives.len() > 20);
    }
}

/// Bounds that do not lie about zero, moved: the same swarm. The function sees coordinates on a grid that the rounding
/// of moved bounds does not reach.
#[test]
fn translation_changes_nothing_and_corners_are_reached() {
    const GRID: f64 = 65536.0;
    let bounds = [(0.0, 8.0), (-1.0, 3.0), (2.5, 2.5), (-0.5, 31.5)];
    let from = |shift: f64| {
        let problem = Problem {
            variables: bounds
                .iter()
                .map(|(a, b)| Variable::new("x", "-", a + shift, b + shift))
                .collect(),
            ..unconstrained(0, 2)
        };
        let function = move |x: &[f64], f: &mut [f64]| {
            let back: Vec<f64> = x.iter().map(|x| ((x - shift) * GRID).round() / GRID).collect();
            for (k, f) in f.iter_mut().enumerate() {
                *f = back
                    .iter()
                    .enumerate()
                    .map(|(i, x)| (x - if i == k { 0.0 } else { 0.25 }).powi(2))
                    .sum();
            }
        };
        let mut evaluator = PointEvaluator::new(problem.clone(), CallCost::Expensive, function);
        let mut swarm = Mopso::new(&problem, settings(MANY, 20)).unwrap();
        run(&mut swarm, &mut evaluator, |_| ControlFlow::Continue(())).unwrap();
        assert!(swarm.front().candidates.iter().all(|c| c[2] == 2.5 + shift));
        swarm.front().objectives
    };
    let found = from(0.0);
    assert_eq!(found, from(1024.0));
    // The fixed variable is 2.25 away from where each objective would have it; the rest can be met.
    let least = found.iter().map(|f| f[0]).fold(f64::INFINITY, f64::min);
    assert!(least < 2.25f64.powi(2) + 0.01, "{least}");
}

#[test]
fn nothing_that_can_be_evaluated_is_survived() {
    let problem = unconstrained(3, 2);
    let mut swarm = Mopso::new(&problem, settings(MANY, 5)).unwrap();
    let mut evaluator = PointEvaluator::new(problem, CallCost::Expensive, |_: &[f64], f: &mut [f64]| {
        f.fill(f64::NAN)
    });
    run(&mut swarm, &mut evaluator, |_| ControlFlow::Continue(())).unwrap();
    assert!(swarm.front().objectives.is_empty());
    assert_eq!(swarm.best(), [f64::INFINITY; 2]);
    assert_eq!(swarm.violation(), f64::INFINITY);
}

/// The published mutation is a trial beside a particle, an evaluation more: it is the same in a swarm of many particles, which is
/// then kept in double precision, and a swarm in single precision refuses it.
#[test]
fn published_mutation_makes_trials_in_swarms_of_any_size() {
    let test = TestProblem::sized("zdt1", 5).unwrap();
    for population in [50, MANY] {
        let settings = MopsoSettings::thesis().with_size(population, 6);
        let mut swarm = Mopso::new(test.problem(), settings).unwrap();
        let mut evaluator = test.threaded_evaluator();
        let mut rows = Vec::new();
        while !swarm.done() {
            let asked = swarm.ask();
            rows.push(asked.len() / 5);
            swarm.tell(&evaluator.evaluate(&asked).unwrap()).unwrap();
        }
        assert_eq!(swarm.evaluations(), rows.iter().sum::<usize>() as u64);
        // Nobody has moved at first. Then (1 - t)^(1 / 0.3) of the particles have a trial, and none at the end.
        assert_eq!((rows[0], rows[5]), (population, population));
        for (t, rows) in [(0.2, rows[1]), (0.4, rows[2])] {
            let expected = (1.0f64 - t).powf(1.0 / 0.3) * population as f64;
            let trials = (rows - population) as f64;
            // Five standard deviations of a count.
            assert!(
                (trials - expected).abs() <= 5.0 * expected.sqrt(),
                "{trials} trials, {expected} expected"
            );
        }
    }
}
