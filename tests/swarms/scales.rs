//! Costs of any finite size are costs, and a violation of constraints is none.

use lapswarm::evaluate::point::{CallCost, Constraint, PointEvaluator};
use lapswarm::evaluate::{Evaluator, Objective, Problem, Variable};
use lapswarm::swarm::comparison::optimiser;
use lapswarm::swarm::metrics::hypervolume;
use lapswarm::swarm::problems::TestProblem;
use lapswarm::swarm::{
    Front, MANY, Mopso, MopsoSettings, Nsga2, Nsga2Settings, Optimiser, SINGLE_OBJECTIVE, WindowSettings,
    WindowSwarm, run,
};
use std::ops::ControlFlow;

fn problem(variables: usize, objectives: usize) -> Problem {
    let variable = |k| Variable::new(format!("x{k}"), "-", -5.0, 3.0);
    let objective = |k| Objective::new(format!("f{k}"), "-");
    Problem {
        variables: (0..variables).map(variable).collect(),
        objectives: (0..objectives).map(objective).collect(),
    }
}

fn mopso(problem: &Problem, population: usize, iterations: usize) -> Mopso {
    Mopso::new(
        problem,
        MopsoSettings::default().with_size(population, iterations),
    )
    .unwrap()
}

/// The swarms for several objectives.
fn several(problem: &Problem, iterations: usize) -> Vec<(&'static str, Box<dyn Optimiser>)> {
    let genetic = Nsga2Settings {
        iterations,
        ..Nsga2Settings::default()
    };
    vec![
        ("mopso", Box::new(mopso(problem, 100, iterations))),
        ("large mopso", Box::new(mopso(problem, MANY, iterations.min(20)))),
        ("nsga2", Box::new(Nsga2::new(problem, genetic).unwrap())),
    ]
}

/// Every optimiser for one objective.
fn single(problem: &Problem) -> Vec<(&'static str, Box<dyn Optimiser>)> {
    let mut all: Vec<(&'static str, Box<dyn Optimiser>)> = Vec::new();
    for name in SINGLE_OBJECTIVE {
        all.push((name, optimiser(name, problem, 3).unwrap()));
    }
    let start = vec![1.0; problem.variables.len()];
    let settings = WindowSettings {
        size: 4,
        iterations: 3000,
        ..WindowSettings::default()
    };
    let windows = WindowSwarm::new(problem, &start, settings).unwrap();
    all.push(("windows", Box::new(windows)));
    all
}

fn finish(optimiser: &mut dyn Optimiser, evaluator: &mut dyn Evaluator) -> Front {
    run(optimiser, evaluator, |_| ControlFlow::Continue(())).unwrap();
    optimiser.front()
}

/// A power of two changes no digit: every figure of the front is that many times as large, to the last bit.
#[test]
fn a_front_times_a_power_of_two_is_the_same_front() {
    let test = TestProblem::sized("zdt1", 10).unwrap();
    let fronts = |factor: f64| {
        let scaled = |x: &[f64], f: &mut [f64]| {
            test.evaluate(x, f);
            f.iter_mut().for_each(|f| *f *= factor);
        };
        let found = several(test.problem(), 60)
            .into_iter()
            .map(|(name, mut optimiser)| {
                let mut evaluator = PointEvaluator::new(test.problem().clone(), CallCost::Cheap, scaled);
                (name, finish(optimiser.as_mut(), &mut evaluator), optimiser.best())
            });
        found.collect::<Vec<_>>()
    };
    let usual = fronts(1.0);
    for factor in [2f64.powi(-40), 2f64.powi(31), 2f64.powi(50)] {
        for ((name, front, best), (_, scaled, scaled_best)) in usual.iter().zip(fronts(factor)) {
            assert!(front.objectives.len() > 20, "{name}");
            let times = |row: &Vec<f64>| row.iter().map(|f| f * factor).collect::<Vec<f64>>();
            let expected: Vec<Vec<f64>> = front.objectives.iter().map(times).collect();
            assert_eq!(scaled.objectives, expected, "{name} times {factor}");
            assert_eq!(scaled.candidates, front.candidates, "{name} times {factor}");
            assert_eq!(scaled_best, times(best), "{name} times {factor}");
        }
    }
}

/// The factors of costs in pascals and in money, and one beyond single precision, in which a large swarm keeps what it learns.
#[test]
fn fronts_of_large_costs_are_found() {
    let test = TestProblem::by_name("zdt1").unwrap();
    for factor in [2e9, 1e15, 1e60] {
        let scaled = |x: &[f64], f: &mut [f64]| {
            test.evaluate(x, f);
            f.iter_mut().for_each(|f| *f *= factor);
        };
        for (name, mut optimiser) in several(test.problem(), 250) {
            let mut evaluator = PointEvaluator::new(test.problem().clone(), CallCost::Cheap, scaled);
            let front = finish(optimiser.as_mut(), &mut evaluator);
            assert!(front.is_feasible(), "{name} times {factor}");
            let back = |row: &Vec<f64>| row.iter().map(|f| f / factor).collect();
            let rows: Vec<Vec<f64>> = front.objectives.iter().map(back).collect();
            let volume = hypervolume(&rows, &[1.1, 1.1]).unwrap();
            assert!(volume > 0.85, "{name} times {factor}: {volume}");
        }
    }
}

fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

fn bent_cigar(x: &[f64]) -> f64 {
    x[0] * x[0] + 1e6 * sphere(&x[1..])
}

#[test]
fn a_cost_times_a_power_of_two_is_minimised_as_well() {
    let problem = problem(6, 1);
    for (function, error) in [(sphere as fn(&[f64]) -> f64, 1e-6), (bent_cigar, 1e3)] {
        for (number, (name, mut usual)) in single(&problem).into_iter().enumerate() {
            let of = |factor: f64, optimiser: &mut dyn Optimiser| {
                let scaled = |x: &[f64], f: &mut [f64]| f[0] = factor * function(x);
                let mut evaluator = PointEvaluator::new(problem.clone(), CallCost::Cheap, scaled);
                finish(optimiser, &mut evaluator)
            };
            let expected = of(1.0, usual.as_mut());
            assert!(
                expected.objectives[0][0] < error,
                "{name}: {:?}",
                expected.objectives
            );
            let factor = 2f64.powi(40);
            let mut scaled = single(&problem).swap_remove(number).1;
            let found = of(factor, scaled.as_mut());
            assert_eq!(found.candidates, expected.candidates, "{name}");
            assert_eq!(
                found.objectives[0][0],
                factor * expected.objectives[0][0],
                "{name}"
            );
        }
    }
}

/// Where the least cost is 1e12, that is what is reported. It is known to a sum of squares of 1e-4, half a step of its last digit.
#[test]
fn a_large_minimum_is_reported_exactly() {
    let problem = problem(3, 1);
    for (name, mut optimiser) in single(&problem) {
        let function = |x: &[f64], f: &mut [f64]| f[0] = 1e12 + sphere(x);
        let mut evaluator = PointEvaluator::new(problem.clone(), CallCost::Cheap, function);
        let front = finish(optimiser.as_mut(), &mut evaluator);
        assert_eq!(front.objectives, [[1e12]], "{name}");
        assert_eq!(optimiser.best(), [1e12], "{name}");
        assert_eq!((front.violation, optimiser.violation()), (0.0, 0.0), "{name}");
    }
}

/// 6e8 and the sum of squares where the first variable is one at the least: 6e8 + 1.
#[test]
fn constraints_hold_at_any_cost() {
    let problem = problem(3, 1);
    for (name, mut optimiser) in single(&problem) {
        let function = |x: &[f64], f: &mut [f64]| (f[0], f[1]) = (6e8 + sphere(x), 1.0 - x[0]);
        let constraints = vec![Constraint::at_most_zero()];
        let mut evaluator =
            PointEvaluator::constrained(problem.clone(), constraints, CallCost::Cheap, function);
        let front = finish(optimiser.as_mut(), &mut evaluator);
        assert!(
            front.is_feasible() && front.candidates[0][0] >= 1.0,
            "{name}: {front:?}"
        );
        let beyond = front.objectives[0][0] - 6e8;
        // Groups of variables and windows meet the bound of the constraint from within.
        assert!((1.0..1.1).contains(&beyond), "{name}: {beyond}");
        assert_eq!(
            front.objectives[0][0],
            6e8 + sphere(&front.candidates[0]),
            "{name}"
        );
    }
}

/// Members that satisfy no constraint say so, and by how much not; their objectives are their own.
#[test]
fn an_infeasible_front_says_so() {
    let problem = problem(3, 2);
    // One constraint cannot be met: the first variable is -5 at the least.
    let function = |x: &[f64], f: &mut [f64]| {
        (f[0], f[1]) = (1e10 + sphere(x), x[1]);
        f[2] = 6.0 + x[0];
    };
    for (name, mut optimiser) in several(&problem, 40) {
        let constraints = vec![Constraint::at_most_zero().in_units_of(10.0)];
        let mut evaluator =
            PointEvaluator::constrained(problem.clone(), constraints, CallCost::Cheap, function);
        let front = finish(optimiser.as_mut(), &mut evaluator);
        assert!(!front.is_feasible() && !front.candidates.is_empty(), "{name}");
        assert!(
            (0.1..0.11).contains(&front.violation),
            "{name}: {}",
            front.violation
        );
        assert_eq!(optimiser.violation(), front.violation, "{name}");
        for (x, row) in front.candidates.iter().zip(&front.objectives) {
            let mut own = [0.0; 3];
            function(x, &mut own);
            assert_eq!(row[..], own[..2], "{name}");
            assert_eq!(own[2].max(0.0) / 10.0, front.violation, "{name}");
        }
    }
}

/// The best of each objective is that of the members that violate least, while others violate more and cost less.
#[test]
fn the_best_are_the_least_violating() {
    let problem = problem(3, 2);
    let function = |x: &[f64], f: &mut [f64]| {
        (f[0], f[1]) = (sphere(x), sphere(x) - 4.0 * x[1]);
        f[2] = 2.5 - x[0];
    };
    for (name, mut optimiser) in several(&problem, 8) {
        let constraints = vec![Constraint::at_most_zero()];
        let mut evaluator =
            PointEvaluator::constrained(problem.clone(), constraints, CallCost::Cheap, function);
        while !optimiser.done() {
            let population = optimiser.ask();
            optimiser.tell(&evaluator.evaluate(&population).unwrap()).unwrap();
            let front = optimiser.front();
            for (k, best) in optimiser.best().into_iter().enumerate() {
                let least = front
                    .objectives
                    .iter()
                    .map(|row| row[k])
                    .fold(f64::INFINITY, f64::min);
                assert_eq!(best, least, "{name}");
            }
        }
        assert!(optimiser.best()[0] >= 6.25, "{name}: {:?}", optimiser.best());
    }
}
