//! NSGA-III and MOEA/D where there are many objectives, and with constraints.

use lapswarm::evaluate::point::{CallCost, Constraint, PointEvaluator};
use lapswarm::evaluate::{Objective, Problem, Variable};
use lapswarm::swarm::metrics::hypervolume;
use lapswarm::swarm::{Moead, MoeadSettings, Optimiser, Sizes, by_name, run};
use std::f64::consts::FRAC_PI_2;
use std::ops::ControlFlow;

/// DTLZ2 with ten distance variables. Its front is the part of the unit sphere whose objectives are not negative.
fn dtlz2(x: &[f64], f: &mut [f64]) {
    let angles = f.len() - 1;
    let distance: f64 = x[angles..].iter().map(|x| (x - 0.5).powi(2)).sum();
    for (k, value) in f.iter_mut().enumerate() {
        let (cosines, sine) = x[..angles].split_at(angles - k);
        *value = 1.0 + distance;
        cosines.iter().for_each(|x| *value *= (FRAC_PI_2 * x).cos());
        sine.iter().take(1).for_each(|x| *value *= (FRAC_PI_2 * x).sin());
    }
}

fn problem(variables: usize, objectives: usize) -> Problem {
    Problem {
        variables: (0..variables)
            .map(|k| Variable::new(format!("x{k}"), "-", 0.0, 1.0))
            .collect(),
        objectives: (0..objectives)
            .map(|k| Objective::new(format!("f{k}"), "-"))
            .collect(),
    }
}

/// Points of the sphere that come from the simplex whose coordinates are multiples of one over `parts`.
fn targets(objectives: usize, parts: usize) -> Vec<Vec<f64>> {
    let base = parts + 1;
    let digits = |code: usize| (0..objectives as u32).map(move |k| code / base.pow(k) % base);
    let all = (0..base.pow(objectives as u32)).filter(|&code| digits(code).sum::<usize>() == parts);
    all.map(|code| {
        let length = digits(code).map(|x| (x * x) as f64).sum::<f64>().sqrt();
        digits(code).map(|x| x as f64 / length).collect()
    })
    .collect()
}

/// The mean distance of the targets from the nearest point.
fn igd(points: &[Vec<f64>], targets: &[Vec<f64>]) -> f64 {
    let distance = |a: &[f64], b: &[f64]| {
        let square: f64 = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum();
        square.sqrt()
    };
    let nearest = |t: &Vec<f64>| {
        points
            .iter()
            .map(|p| distance(p, t))
            .fold(f64::INFINITY, f64::min)
    };
    targets.iter().map(nearest).sum::<f64>() / targets.len() as f64
}

/// Deb and Jain's table for DTLZ2: with 5 objectives, 212 members and 350 generations the worst of their 20 runs ends at an IGD of
/// 5.862e-3 from the 210 points that the directions aim at. Five runs of pymoo 0.6.2 end at 4.917e-3 at worst, which the median is
/// held to, and at most 3.763e-3 off the front in the mean. The paper's table has no 4 objectives: the worst run is held to the same,
/// a quarter more than the median of pymoo's five runs, 2.021e-3, is let pass in the median, and half of the worst IGD off the front.
/// The swarms and NSGA-II aim at no points, so they are compared on points of a finer simplex that nobody aims at.
#[test]
fn many_objectives() {
    for (objectives, population, finer, [typical, worst, off_front]) in [
        (4, 84, 11, [1.25 * 2.021e-3, 5.862e-3, 0.5 * 5.862e-3]),
        (5, 212, 9, [4.917e-3, 5.862e-3, 3.763e-3]),
    ] {
        let problem = problem(objectives + 9, objectives);
        let found = |name: &str, seed: u64| {
            let sizes = Sizes {
                population,
                iterations: 350,
                archive: population,
                seed,
            };
            let mut optimiser = by_name(name, &problem, sizes).unwrap();
            let mut evaluator = PointEvaluator::new(problem.clone(), CallCost::Cheap, dtlz2);
            run(optimiser.as_mut(), &mut evaluator, |_| ControlFlow::Continue(())).unwrap();
            optimiser.front().objectives
        };
        let fronts: Vec<Vec<Vec<f64>>> = (1..=5).map(|seed| found("nsga3", seed)).collect();
        let aims = targets(objectives, 6);
        let mut aimed: Vec<f64> = fronts.iter().map(|front| igd(front, &aims)).collect();
        aimed.sort_by(f64::total_cmp);
        let radius = |f: &Vec<f64>| f.iter().map(|f| f * f).sum::<f64>().sqrt() - 1.0;
        let mean = |front: &Vec<Vec<f64>>| front.iter().map(radius).sum::<f64>() / front.len() as f64;
        let off = fronts.iter().map(mean).fold(0.0, f64::max);
        println!("{objectives} objectives: IGD {aimed:?} from the aims, at most {off:.2e} off the front");
        assert!(aimed[2] < typical, "{objectives}: {aimed:?}");
        assert!(aimed[4] < worst, "{objectives}: {aimed:?}");
        assert!(off < off_front, "{objectives}: {off}");
        let finer = targets(objectives, finer);
        let reached = igd(&fronts[2], &finer);
        for other in ["default", "nsga2"] {
            let theirs = igd(&found(other, 3), &finer);
            println!("{objectives} objectives: IGD {reached:.4}, {other} {theirs:.4}");
            assert!(reached < theirs, "{objectives}, {other}: {reached}, {theirs}");
        }
    }
}

/// The default truncates an archive of four objectives by hypervolume. Up to 1.1, DTLZ2's whole front has `1.1^4 - pi^2 / 32`, 1.1557. A
/// hundred members came to 1.0437 to 1.0438 of it in three runs of 25,000 evaluations, and those of NSGA-III to 1.010 to 1.012.
#[test]
fn the_default_covers_the_volume_of_four_objectives() {
    let problem = problem(13, 4);
    let volume = |name: &str| {
        let sizes = Sizes {
            population: 100,
            iterations: 250,
            archive: 100,
            seed: 4,
        };
        let mut optimiser = by_name(name, &problem, sizes).unwrap();
        let mut evaluator = PointEvaluator::new(problem.clone(), CallCost::Cheap, dtlz2);
        run(optimiser.as_mut(), &mut evaluator, |_| ControlFlow::Continue(())).unwrap();
        hypervolume(&optimiser.front().objectives, &[1.1; 4]).unwrap()
    };
    let (own, genetic) = (volume("default"), volume("nsga3"));
    println!("hypervolume {own:.4}, NSGA-III {genetic:.4}");
    assert!(own > 1.043 && own < 1.1557, "{own}");
    assert!(own > genetic + 0.025, "{own} {genetic}");
}

/// With objectives measured as they are, each run is held to the worst of six of pymoo 0.6.2 with the same settings, 8.161e-4. With
/// objectives in units that differ by powers of ten, it is held to the worst of five runs of pymoo's NSGA-III without such units:
/// 1.645e-3 with three objectives and 4.917e-3 with five.
#[test]
fn many_objectives_by_decomposition() {
    for (objectives, population, iterations, parts, scaled, bar) in [
        (3, 92, 250, 12, false, 8.161e-4),
        (3, 92, 250, 12, true, 1.645e-3),
        (5, 212, 350, 6, true, 4.917e-3),
    ] {
        let problem = problem(objectives + 9, objectives);
        let unit = |k: usize| if scaled { 10f64.powi(k as i32) } else { 1.0 };
        for seed in 1..=3 {
            let settings = MoeadSettings {
                population,
                iterations,
                seed,
                scaled,
                ..MoeadSettings::default()
            };
            let mut genetic = Moead::new(&problem, settings).unwrap();
            let mut evaluator = PointEvaluator::new(problem.clone(), CallCost::Cheap, |x, f| {
                dtlz2(x, f);
                f.iter_mut().enumerate().for_each(|(k, f)| *f *= unit(k));
            });
            run(&mut genetic, &mut evaluator, |_| ControlFlow::Continue(())).unwrap();
            let mut front = genetic.front().objectives;
            for row in &mut front {
                row.iter_mut().enumerate().for_each(|(k, f)| *f /= unit(k));
            }
            let aimed = igd(&front, &targets(objectives, parts));
            println!("{objectives} objectives, scaled: {scaled}, seed {seed}: {aimed:.2e}");
            assert!(aimed < bar, "{objectives}, {scaled}, {seed}: {aimed}");
        }
    }
}

/// The front of DTLZ2 where the first objective is at most a half. It starts where nearly nothing is feasible, and it ends with all
/// members feasible, some of them at the limit, and with the least of each objective near zero.
#[test]
fn constraints_come_first() {
    ["nsga3", "moead"].into_iter().for_each(keeps_to_constraints);
}

fn keeps_to_constraints(name: &str) {
    let sizes = Sizes {
        population: 92,
        iterations: 150,
        archive: 92,
        seed: 1,
    };
    let mut genetic = by_name(name, &problem(12, 3), sizes).unwrap();
    let limits = vec![Constraint::at_most_zero(); 2];
    let mut evaluator = PointEvaluator::constrained(problem(12, 3), limits, CallCost::Cheap, |x, f| {
        dtlz2(x, &mut f[..3]);
        f[3] = f[0] - 0.5;
        f[4] = f[..3].iter().map(|f| f * f).sum::<f64>() - 1.21;
    });
    let mut last = f64::INFINITY;
    run(genetic.as_mut(), &mut evaluator, |p| {
        assert!(p.violation <= last, "{} after {last}", p.violation);
        last = p.violation;
        ControlFlow::Continue(())
    })
    .unwrap();
    let front = genetic.front();
    assert!(front.is_feasible());
    assert!(front.objectives.iter().all(|f| f[0] <= 0.5));
    let most = front.objectives.iter().map(|f| f[0]).fold(0.0, f64::max);
    assert!(most > 0.49, "{most}");
    assert!(
        genetic.best().iter().all(|least| *least < 0.01),
        "{:?}",
        genetic.best()
    );
}
