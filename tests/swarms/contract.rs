//! What evaluators and callers owe optimisers: what is missing is an error that names it, and costs nothing.

use lapswarm::evaluate::point::{CallCost, PointEvaluator};
use lapswarm::evaluate::{BackendInfo, Evaluation, Evaluator, Objective, Problem, Variable};
use lapswarm::swarm::comparison::optimiser;
use lapswarm::swarm::{
    CooperativeSettings, CooperativeSwarm, CovarianceSettings, CovarianceSwarm, DifferenceSettings,
    DifferenceSwarm, HybridSettings, HybridSwarm, Islands, MANY, MULTI_OBJECTIVE, Mopso, MopsoSettings,
    Nsga2, Nsga2Settings, Optimiser, Pso, PsoSettings, SINGLE_OBJECTIVE, Schedule, WindowSettings,
    WindowSwarm, run, step,
};
use std::ops::ControlFlow;

fn problem(objectives: usize) -> Problem {
    let objective = |k| Objective::new(format!("f{k}"), "-");
    Problem {
        variables: ["a", "b", "c"]
            .map(|name| Variable::new(name, "-", -2.0, 3.0))
            .to_vec(),
        objectives: (0..objectives).map(objective).collect(),
    }
}

fn mopso(problem: &Problem, population: usize) -> Mopso {
    let default = MopsoSettings::default();
    let motion = PsoSettings {
        population,
        ..default.motion
    };
    Mopso::new(problem, MopsoSettings { motion, ..default }).unwrap()
}

/// Every optimiser, with the problem that it is of.
fn everyone() -> Vec<(String, Problem, Box<dyn Optimiser>)> {
    let mut all: Vec<(String, Problem, Box<dyn Optimiser>)> = Vec::new();
    let names = SINGLE_OBJECTIVE.map(|name| (name, 1)).into_iter();
    for (name, objectives) in names.chain(MULTI_OBJECTIVE.map(|name| (name, 2))) {
        let problem = problem(objectives);
        let optimiser = optimiser(name, &problem, 1).unwrap();
        all.push((format!("{name}, {objectives}"), problem, optimiser));
    }
    let windows = WindowSwarm::new(&problem(1), &[0.0; 3], WindowSettings::default()).unwrap();
    all.push(("windows".to_owned(), problem(1), Box::new(windows)));
    let large = mopso(&problem(2), MANY);
    all.push(("large".to_owned(), problem(2), Box::new(large)));
    let swarms = vec![mopso(&problem(2), 10), mopso(&problem(2), 12)];
    let islands = Islands::new(&problem(2), swarms, None).unwrap();
    all.push(("islands".to_owned(), problem(2), Box::new(islands)));
    all
}

/// Squared distances to as many points as there are objectives.
fn distances(x: &[f64], f: &mut [f64]) {
    for (k, value) in f.iter_mut().enumerate() {
        *value = x.iter().map(|x| (x - k as f64).powi(2)).sum();
    }
}

/// An evaluator whose answers are spoilt.
struct Spoilt<'a> {
    problem: Problem,
    spoil: &'a dyn Fn(&mut Evaluation),
}

impl Evaluator for Spoilt<'_> {
    fn problem(&self) -> &Problem {
        &self.problem
    }

    fn backend(&self) -> BackendInfo {
        PointEvaluator::new(self.problem.clone(), CallCost::Cheap, distances).backend()
    }

    fn evaluate(&mut self, population: &[f64]) -> lapswarm::Result<Evaluation> {
        let mut answer =
            PointEvaluator::new(self.problem.clone(), CallCost::Cheap, distances).evaluate(population)?;
        (self.spoil)(&mut answer);
        Ok(answer)
    }
}

#[test]
fn an_evaluation_of_another_size_is_refused_and_names_what_is_wrong() {
    type Spoil = fn(&mut Evaluation);
    let wrong: [(&str, Spoil); 6] = [
        ("failures", |e| e.failures.clear()),
        ("failures", |e| e.failures.truncate(3)),
        ("objectives", |e| {
            let width = e.objectives.len() / e.failures.len();
            e.objectives.truncate(3 * width);
            e.failures.truncate(3);
        }),
        ("objectives", |e| e.objectives.push(0.0)),
        ("violations", |e| e.violations = vec![0.0]),
        ("objectives", |e| *e = Evaluation::default()),
    ];
    for (place, spoil) in wrong {
        for (name, problem, mut optimiser) in everyone() {
            let mut sound = PointEvaluator::new(problem.clone(), CallCost::Cheap, distances);
            let mut untouched = everyone()
                .into_iter()
                .find(|(other, ..)| *other == name)
                .unwrap()
                .2;
            let mut evaluator = Spoilt {
                problem,
                spoil: &spoil,
            };
            let error = run(optimiser.as_mut(), &mut evaluator, |_| ControlFlow::Continue(())).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            let said = error.to_string();
            assert!(
                said.contains("the evaluation") && said.contains(place),
                "{name}: {said}"
            );
            assert_eq!(optimiser.evaluations(), 0, "{name}");
            // It has not been told anything: it does what one does that was never told the wrong thing.
            for swarm in [&mut optimiser, &mut untouched] {
                step(swarm.as_mut(), &mut sound).unwrap();
            }
            assert_eq!(optimiser.ask(), untouched.ask(), "{name}");
        }
    }
}

#[test]
fn starts_are_a_finite_value_for_each_variable() {
    let two = problem(2);
    let genetic = || Nsga2::new(&two, Nsga2Settings::default()).unwrap();
    for (start, told) in [
        (vec![1.0, 2.0], "2 values"),
        (vec![0.0; 4], "4 values"),
        (Vec::new(), "0 values"),
        (vec![0.0, f64::NAN, 1.0], "2 of them finite"),
    ] {
        let starts = [vec![0.0; 3], start];
        for refused in [
            mopso(&two, 20).start_from(&starts),
            mopso(&two, MANY).start_from(&starts),
            genetic().start_from(&starts),
        ] {
            let said = refused.unwrap_err().to_string();
            assert!(said.contains("candidate 2") && said.contains(told), "{said}");
        }
    }
    let mut swarm = genetic();
    swarm.start_from(&[vec![0.0, 1.0, 9.0]]).unwrap();
    assert_eq!(swarm.ask()[..3], [0.0, 1.0, 3.0], "within the bounds");
}

#[test]
fn an_optimiser_of_one_objective_refuses_two() {
    let two = problem(2);
    let start = [0.0; 3];
    let refusals = [
        Pso::new(&two, PsoSettings::default()).err(),
        DifferenceSwarm::new(&two, DifferenceSettings::default()).err(),
        CooperativeSwarm::new(&two, CooperativeSettings::default()).err(),
        HybridSwarm::new(&two, HybridSettings::default()).err(),
        CovarianceSwarm::new(&two, &start, CovarianceSettings::default()).err(),
        WindowSwarm::new(&two, &start, WindowSettings::default()).err(),
    ];
    for refusal in refusals {
        let said = refusal.expect("refused").to_string();
        assert!(said.contains("2 objectives"), "{said}");
    }
}

/// A figure that is no number is a failure even if nobody says so, and is counted as one.
#[test]
fn failures_without_a_flag_are_counted() {
    for (name, problem, mut optimiser) in everyone() {
        let spoil = |e: &mut Evaluation| e.objectives[0] = f64::NAN;
        let mut evaluator = Spoilt {
            problem,
            spoil: &spoil,
        };
        let progress = step(optimiser.as_mut(), &mut evaluator).unwrap();
        assert_eq!(progress.failed, 1, "{name}");
        assert_eq!(progress.failures["objective_not_finite"], 1, "{name}");
    }
}

/// A run that goes on beyond what was planned keeps the values of its end.
#[test]
fn schedules_end_where_they_were_planned_to() {
    let inertia = Schedule::Linear { from: 0.5, to: 0.1 };
    assert_eq!(inertia.at(0.5), 0.3);
    let end = inertia.at(1.0);
    assert!((end - 0.1).abs() < 1e-15, "{end}");
    assert_eq!([inertia.at(1.5), inertia.at(20.0)], [end; 2]);
    assert_eq!(inertia.at(-1.0), 0.5);
}
