//! The suites against published implementations, and what their table says of them.

use lapswarm::swarm::problems::{Half, NAMES, SUITES, SuiteProblem};
use std::collections::BTreeSet;

/// All figures to 1e-10 of their size. Where terms cancel, what is left is held to the rounding of the terms: they are of the
/// order of one for several objectives, and up to 12,569 for one (Schwefel's constant), of which 1e-10 is some thirty
/// roundings.
#[test]
fn suites_agree_with_published_implementations() {
    let mut seen = BTreeSet::new();
    let rows = include_str!("reference_points.csv").lines();
    for row in rows.filter(|r| !r.starts_with('#')).skip(1) {
        let cells: Vec<&str> = row.split(',').collect();
        let [name, package, candidate, values] = cells[..] else {
            panic!("{row}")
        };
        let numbers = |cell: &str| -> Vec<f64> { cell.split(' ').map(|x| x.parse().unwrap()).collect() };
        let (candidate, expected) = (numbers(candidate), numbers(values));
        let problem = SuiteProblem::by_name(name).unwrap();
        let objectives = problem.problem().objectives.len();
        assert_eq!(candidate.len(), problem.problem().variables.len(), "{name}");
        for (x, v) in candidate.iter().zip(&problem.problem().variables) {
            assert!((v.lower..=v.upper).contains(x), "{name}: {x}");
        }
        let found = problem.evaluate(&candidate);
        assert_eq!(found.len(), objectives + problem.constraints(), "{name}");
        assert_eq!(found.len(), expected.len(), "{name}");
        let left = if objectives == 1 { 1e-10 } else { 1e-14 };
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let off = (found - expected).abs();
            assert!(
                off <= 1e-10 * expected.abs() + left,
                "{name}, figure {k}: {found}, but {package} has {expected} at {candidate:?}"
            );
        }
        seen.insert(name);
    }
    for (suite, names) in SUITES {
        assert!(names.iter().all(|name| seen.contains(name)), "{suite}");
    }
}

#[test]
fn suites_are_split_by_their_order() {
    for (suite, names) in SUITES {
        for (i, name) in names.iter().enumerate() {
            let problem = SuiteProblem::by_name(name).unwrap_or_else(|| panic!("{name}"));
            assert_eq!((problem.name(), problem.suite()), (*name, suite));
            assert_eq!(problem.half() == Half::ChosenOn, i % 2 == 0);
            assert_eq!(problem.front(100).is_empty(), !NAMES.contains(name), "{name}");
        }
    }
    assert!(SuiteProblem::by_name("zdt5").is_none());
}

/// Where a front has a formula, its ends are zero and one on the table's scale. Ends of ZDT3's pieces have ten digits.
#[test]
fn scales_are_those_of_the_fronts() {
    for name in &NAMES[..7] {
        let problem = SuiteProblem::by_name(name).unwrap();
        let front = problem.scale().apply(&problem.front(2000));
        for k in 0..problem.problem().objectives.len() {
            let least = front.iter().map(|f| f[k]).fold(f64::INFINITY, f64::min);
            let most = front.iter().map(|f| f[k]).fold(f64::NEG_INFINITY, f64::max);
            assert!(
                least.abs() < 1e-9 && (most - 1.0).abs() < 1e-9,
                "{name}: {least} to {most}"
            );
        }
    }
}
