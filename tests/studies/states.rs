//! What optimisers carry from one iteration to the next: checkpoints, islands, constraints, whole numbers.

use lapswarm::evaluate::point::{CallCost, Constraint, PointEvaluator};
use lapswarm::evaluate::{Evaluator, Objective, Problem, Variable};
use lapswarm::swarm::checkpoint::{Checkpoint, VERSION, from_bytes, load, save, to_bytes};
use lapswarm::swarm::{
    CooperativeSettings, CooperativeSwarm, CovarianceSettings, CovarianceSwarm, DifferenceSettings,
    DifferenceSwarm, HybridSettings, HybridSwarm, Islands, MANY, Migration, Moead, MoeadSettings, Mopso,
    MopsoSettings, Nsga2, Nsga2Settings, Nsga3, Nsga3Settings, Optimiser, OutOfBounds, Pso, PsoSettings,
    Restarts, WindowSettings, WindowSwarm,
};
use proptest::prelude::*;
use std::path::Path;

fn problem(objectives: usize) -> Problem {
    let bounds = [(0.0, 8.0), (-1.0, 3.0), (0.0, 2.0), (-0.5, 31.5), (1.5, 1.5)];
    Problem {
        variables: bounds
            .iter()
            .enumerate()
            .map(|(k, &(a, b))| Variable::new(format!("x{k}"), "-", a, b))
            .collect(),
        objectives: (0..objectives)
            .map(|k| Objective::new(format!("f{k}"), "-"))
            .collect(),
    }
}

fn distances(x: &[f64], f: &mut [f64]) {
    for (k, value) in f.iter_mut().enumerate() {
        let centre = |i: usize| if i == k { 1.0 } else { 0.25 };
        *value = x.iter().enumerate().map(|(i, x)| (x - centre(i)).powi(2)).sum();
    }
}

fn evaluator(objectives: usize) -> impl Evaluator {
    PointEvaluator::new(problem(objectives), CallCost::Cheap, distances)
}

fn steps(optimiser: &mut dyn Optimiser, evaluator: &mut dyn Evaluator, count: usize) {
    for _ in 0..count {
        let population = optimiser.ask();
        optimiser.tell(&evaluator.evaluate(&population).unwrap()).unwrap();
    }
}

/// `n` steps are the same as `k`, a file, and the rest: the whole state, byte for byte.
fn resumes<T: Checkpoint + Optimiser>(
    fresh: impl Fn(u64) -> T,
    objectives: usize,
    seed: u64,
    (k, n): (usize, usize),
) {
    let mut judge = evaluator(objectives);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state");
    let mut whole = fresh(seed);
    steps(&mut whole, &mut judge, n);
    let mut part = fresh(seed);
    steps(&mut part, &mut judge, k);
    // What was there before gives way.
    save(&path, &fresh(seed + 1)).unwrap();
    save(&path, &part).unwrap();
    drop(part);
    let mut part: T = load(&path).unwrap();
    steps(&mut part, &mut judge, n - k);
    assert_eq!(whole.ask(), part.ask(), "{}", T::KIND);
    assert!(
        to_bytes(&whole).unwrap() == to_bytes(&part).unwrap(),
        "{}",
        T::KIND
    );
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "nothing is left beside the file");
}

fn mopso(seed: u64, population: usize) -> Mopso {
    let default = MopsoSettings::default();
    let motion = PsoSettings {
        population,
        iterations: 60,
        seed,
        ..default.motion
    };
    Mopso::new(
        &problem(2),
        MopsoSettings {
            motion,
            archive: 20,
            ..default
        },
    )
    .unwrap()
}

fn pso(seed: u64) -> Pso {
    let settings = PsoSettings {
        population: 12,
        iterations: 60,
        seed,
        ..PsoSettings::default()
    };
    Pso::new(&problem(1), settings).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]
    #[test]
    fn every_optimiser_resumes_from_a_file(seed in 0u64..1 << 60, k in 0usize..40, more in 1usize..15) {
        let at = (k, k + more);
        let one = problem(1);
        let middle = [4.0, 1.0, 1.0, 15.0, 1.5];
        resumes(pso, 1, seed, at);
        resumes(|s| mopso(s, 24), 2, seed, at);
        resumes(|s| DifferenceSwarm::new(&one, DifferenceSettings { seed: s, ..Default::default() }).unwrap(), 1, seed, at);
        resumes(|s| Nsga2::new(&problem(2), Nsga2Settings { seed: s, population: 20, ..Default::default() }).unwrap(), 2, seed, at);
        resumes(|s| Moead::new(&problem(4), MoeadSettings { seed: s, population: 20, ..Default::default() }).unwrap(), 4, seed, at);
        resumes(|s| Nsga3::new(&problem(4), Nsga3Settings { seed: s, population: 20, ..Default::default() }).unwrap(), 4, seed, at);
        let cooperative = CooperativeSettings::default();
        resumes(|s| {
            let motion = PsoSettings { seed: s, ..cooperative.motion.clone() };
            CooperativeSwarm::new(&one, CooperativeSettings { motion, groups: 3 }).unwrap()
        }, 1, seed, at);
        // Exploring ends half-way.
        let hybrid = HybridSettings { iterations: 60, ..Default::default() };
        resumes(|s| HybridSwarm::new(&one, HybridSettings { seed: s, ..hybrid.clone() }).unwrap(), 1, seed, at);
        for (active, beyond, restarts) in [
            (false, OutOfBounds::Reflected, Restarts::None),
            (true, OutOfBounds::AsDrawn, Restarts::Alternating),
        ] {
            let settings = CovarianceSettings { active, beyond, restarts, ..Default::default() };
            resumes(|s| CovarianceSwarm::new(&one, &middle, CovarianceSettings { seed: s, ..settings.clone() }).unwrap(), 1, seed, at);
        }
        let windows = WindowSettings { strides: vec![2, 1], size: 2, turn: 3, ..Default::default() };
        resumes(|s| WindowSwarm::new(&one, &middle, WindowSettings { seed: s, ..windows.clone() }).unwrap(), 1, seed, at);
        resumes(|s| {
            let islands = (0..3).map(|i| mopso(s ^ i, 8)).collect();
            Islands::new(&problem(2), islands, Some(Migration { every: 4, count: 3 })).unwrap()
        }, 2, seed, at);
    }
}

#[test]
fn a_large_swarm_resumes_from_a_file() {
    resumes(|seed| mopso(seed, MANY + 3), 2, 5, (4, 7));
}

#[test]
fn what_is_no_checkpoint_of_it_is_refused() {
    let swarm = pso(1);
    let bytes = to_bytes(&swarm).unwrap();
    let file = Path::new("run/state");
    let refusal = |bytes: &[u8]| from_bytes::<Pso>(bytes, file).expect_err("refused");
    let says = |bytes: &[u8], word: &str| {
        let error = refusal(bytes);
        assert_eq!(error.exit_code(), 2);
        let message = error.to_string();
        assert!(
            message.contains("run/state") && message.contains(word),
            "{message}, not {word}"
        );
    };
    from_bytes::<Pso>(&bytes, file).unwrap();
    says(b"", "something else");
    says(b"PK\x03\x04 a zip file", "something else");
    let mut newer = bytes.clone();
    newer[8..12].copy_from_slice(&(VERSION + 1).to_le_bytes());
    says(&newer, &format!("version {VERSION}"));
    let other = to_bytes(&mopso(1, 8)).unwrap();
    says(&other, "multi-objective");
    // Torn at any place, or a bit turned in any byte.
    for end in 8..bytes.len() {
        refusal(&bytes[..end]);
    }
    for at in 0..bytes.len() {
        let mut spoilt = bytes.clone();
        spoilt[at] ^= 1 << (at % 8);
        refusal(&spoilt);
    }
    let nowhere = save(Path::new("/nonexistent-folder/state"), &swarm)
        .err()
        .map(|e| e.exit_code());
    assert_eq!(nowhere, Some(2));
    assert_eq!(
        load::<Pso>(Path::new("/nonexistent-folder/state"))
            .err()
            .map(|e| e.exit_code()),
        Some(2)
    );
}

/// Without migration each is what it would be alone; with it the last learns what the first knew.
#[test]
fn islands_are_their_swarms_and_migrants_arrive() {
    let mut judge = evaluator(2);
    let seeds = [3u64, 4, 5];
    let apart =
        |migration| Islands::new(&problem(2), seeds.map(|s| mopso(s, 10)).to_vec(), migration).unwrap();
    let mut together = apart(None);
    steps(&mut together, &mut judge, 30);
    for (island, seed) in together.islands().iter().zip(seeds) {
        let mut alone = mopso(seed, 10);
        steps(&mut alone, &mut judge, 30);
        assert_eq!(island.front(), alone.front());
    }
    assert_eq!((together.iteration(), together.evaluations()), (30, 900));

    let migration = Some(Migration { every: 5, count: 4 });
    let (mut one, mut two) = (apart(migration), apart(migration));
    steps(&mut one, &mut judge, 30);
    steps(&mut two, &mut judge, 30);
    assert_eq!(one.front(), two.front());
    assert_ne!(one.front(), together.front());
    let sent: Vec<Vec<f64>> = one.islands()[0].front().objectives;
    let arrived = |row: &&Vec<f64>| one.islands()[1].front().objectives.contains(row);
    assert!(sent.iter().filter(arrived).count() > 0);

    let singles: Vec<Pso> = seeds.map(pso).to_vec();
    let mut islands = Islands::new(&problem(1), singles, migration).unwrap();
    let mut judge = evaluator(1);
    steps(&mut islands, &mut judge, 31);
    let costs: Vec<f64> = islands.islands().iter().map(|i| i.best()[0]).collect();
    assert_eq!(
        islands.best()[0],
        costs.iter().copied().fold(f64::INFINITY, f64::min)
    );
    assert!(Islands::<Pso>::new(&problem(1), Vec::new(), None).is_err());
}

/// The optimum of the distances under `x0 + x1 >= 4`, and nothing at first that satisfies it for most.
fn constrained(objectives: usize) -> impl Evaluator {
    PointEvaluator::constrained(
        problem(objectives),
        vec![Constraint::at_most_zero()],
        CallCost::Cheap,
        move |x: &[f64], f: &mut [f64]| {
            distances(x, &mut f[..objectives]);
            f[objectives] = 4.0 - x[0] - x[1];
        },
    )
}

#[test]
fn constraints_are_kept_by_every_optimiser() {
    let one = problem(1);
    let middle = [4.0, 1.0, 1.0, 15.0, 1.5];
    let singles: Vec<Box<dyn Optimiser>> = vec![
        Box::new(pso(2)),
        Box::new(DifferenceSwarm::new(&one, DifferenceSettings::default()).unwrap()),
        Box::new(
            CooperativeSwarm::new(
                &one,
                CooperativeSettings {
                    groups: 2,
                    ..Default::default()
                },
            )
            .unwrap(),
        ),
        Box::new(
            HybridSwarm::new(
                &one,
                HybridSettings {
                    iterations: 150,
                    ..Default::default()
                },
            )
            .unwrap(),
        ),
        Box::new(CovarianceSwarm::new(&one, &middle, CovarianceSettings::default()).unwrap()),
        Box::new(
            WindowSwarm::new(
                &one,
                &middle,
                WindowSettings {
                    size: 5,
                    ..Default::default()
                },
            )
            .unwrap(),
        ),
    ];
    // Nearest to (1, 1/4) on the line: (2.375, 1.625).
    let optimum = 2.0 * 1.375f64.powi(2) + 1.25f64.powi(2);
    for (number, mut optimiser) in singles.into_iter().enumerate() {
        let mut judge = constrained(1);
        steps(optimiser.as_mut(), &mut judge, 150);
        let front = optimiser.front();
        let x = &front.candidates[0];
        assert!(x[0] + x[1] >= 4.0, "optimiser {number}: {x:?}");
        assert!(
            front.objectives[0][0] < optimum + 1.0,
            "optimiser {number}: {:?}",
            front.objectives
        );
    }
    for population in [40, MANY] {
        let mut swarm = mopso(1, population);
        steps(&mut swarm, &mut constrained(2), 40);
        assert_eq!(swarm.archive().violation(), 0.0);
        assert!(swarm.front().candidates.iter().all(|x| x[0] + x[1] >= 4.0));
        assert!(swarm.best()[0] < optimum + 1.0);
    }
    let mut genetic = Nsga2::new(
        &problem(2),
        Nsga2Settings {
            population: 40,
            ..Default::default()
        },
    )
    .unwrap();
    steps(&mut genetic, &mut constrained(2), 60);
    assert!(genetic.front().candidates.iter().all(|x| x[0] + x[1] >= 4.0));
}

/// Where nothing is feasible the least violation wins, and a cost says how large it is.
#[test]
fn without_anything_feasible_the_least_violation_is_kept() {
    let hopeless = |objectives: usize| {
        PointEvaluator::constrained(
            problem(objectives),
            vec![Constraint::at_most_zero(); 2],
            CallCost::Cheap,
            move |x: &[f64], f: &mut [f64]| {
                distances(x, &mut f[..objectives]);
                f[objectives] = 1.0 + x[0];
                f[objectives + 1] = -1.0;
            },
        )
    };
    for population in [40, MANY] {
        let mut swarm = mopso(1, population);
        let mut last = f64::INFINITY;
        for _ in 0..30 {
            steps(&mut swarm, &mut hopeless(2), 1);
            let violation = swarm.archive().violation();
            assert!(violation <= last && violation >= 1.0);
            last = violation;
        }
        assert!(last < 1.01, "{population}: {last}");
        assert!(swarm.front().candidates.iter().all(|x| 1.0 + x[0] == last));
    }
    let mut swarm = pso(1);
    steps(&mut swarm, &mut hopeless(1), 40);
    let violation = swarm.violation();
    assert!((1.0..1.1).contains(&violation), "{violation}");
    assert!(!swarm.front().is_feasible());
    let (x, mut f) = (&swarm.front().candidates[0], [0.0]);
    distances(x, &mut f);
    assert_eq!(swarm.best(), f, "the cost is the candidate's own");
    assert_eq!(violation, 1.0 + x[0]);
}

#[test]
fn whole_numbers_and_bad_bounds() {
    let mut mixed = problem(2);
    mixed.variables[1] = Variable::whole("gear", "-", 1, 6);
    let function = |x: &[f64], f: &mut [f64]| {
        distances(x, f);
        f[0] += (x[1] - 3.0).powi(2);
    };
    let mut seen = [0usize; 7];
    for population in [30, MANY] {
        let default = MopsoSettings::default();
        let motion = PsoSettings {
            population,
            iterations: 30,
            ..default.motion
        };
        let mut swarm = Mopso::new(&mixed, MopsoSettings { motion, ..default }).unwrap();
        swarm.start_from(&[vec![1.0, 5.0, 0.0, 0.0, 1.5]]).unwrap();
        assert_eq!(swarm.ask()[1], 5.0);
        let mut judge = PointEvaluator::new(mixed.clone(), CallCost::Cheap, function);
        let first = swarm.ask();
        for row in first.chunks_exact(5) {
            assert_eq!(row[1].fract(), 0.0);
            seen[row[1] as usize] += 1;
        }
        steps(&mut swarm, &mut judge, 30);
        assert!(
            swarm
                .front()
                .candidates
                .iter()
                .all(|x| [1.0, 2.0, 3.0].contains(&x[1]))
        );
    }
    // Each as likely as the others: six, of 4126 draws, within five standard deviations (24) of a sixth.
    assert!(
        seen[1..].iter().all(|n| (688i64 - *n as i64).abs() < 120),
        "{seen:?}"
    );
    let mut single = mixed.clone();
    single.objectives.truncate(1);
    let mut swarm = HybridSwarm::new(
        &single,
        HybridSettings {
            iterations: 60,
            ..Default::default()
        },
    )
    .unwrap();
    let mut judge = PointEvaluator::new(single.clone(), CallCost::Cheap, function);
    steps(&mut swarm, &mut judge, 59);
    assert_eq!(
        swarm.best_candidate().0[1],
        2.0,
        "4.06, where 1 has 4.56 and 3 has 7.56"
    );
    let refused = WindowSwarm::new(&single, &[1.0; 5], WindowSettings::default())
        .err()
        .map(|e| e.to_string());
    assert!(refused.is_some_and(|m| m.contains("gear")));
    mixed.variables[1].upper = 6.5;
    let refused = Mopso::new(&mixed, MopsoSettings::default())
        .err()
        .map(|e| e.to_string());
    assert!(refused.is_some_and(|m| m.contains("gear")));
}
