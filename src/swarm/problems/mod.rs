//! Problems to test optimisers and backends on.
//!
//! A [`TestProblem`] has a known answer and runs on every backend. A [`SuiteProblem`] is one of the [`SUITES`] that
//! optimisers are compared on, in double precision; the test problems are among them.
//!
//! References:
//! 1. Zitzler, Deb, Thiele, *Comparison of multiobjective evolutionary algorithms: empirical results*,
//!    Evolutionary Computation 8 (2000) (ZDT1 to ZDT4 and ZDT6).
//! 2. Deb, Thiele, Laumanns, Zitzler, *Scalable test problems for evolutionary multiobjective optimization*, 2005
//!    (DTLZ1, DTLZ2).
//! 3. Suganthan et al., *Problem definitions and evaluation criteria for the CEC 2005 special session on
//!    real-parameter optimization* (the single-objective functions and that their optima are shifted).

#[cfg(feature = "gpu")]
mod device;
mod dtlz;
mod lanes;
mod single;
mod suites;
mod zdt;

#[cfg(feature = "gpu")]
pub use device::GpuTestEvaluator;
pub use lanes::SimdTestEvaluator;
pub use suites::{Half, SUITES, SuiteProblem};

use crate::evaluate::point::{CallCost, PointEvaluator};
use crate::evaluate::{Objective, Problem, Variable};
use crate::scalar::Real;

/// A problem with a known answer, with variables and objectives without units.
#[derive(Clone, Debug)]
pub struct TestProblem {
    name: &'static str,
    problem: Problem,
    function: Function,
    /// Taken off a candidate before it is evaluated: where the optimum lies, or nothing.
    shift: Vec<f64>,
    /// What the objectives are multiplied by.
    factor: f32,
    front: fn(usize) -> Vec<Vec<f64>>,
}

/// Names of the problems that run on every backend, those with several objectives first.
pub const NAMES: [&str; 12] = [
    "zdt1",
    "zdt2",
    "zdt3",
    "zdt4",
    "zdt6",
    "dtlz1",
    "dtlz2",
    "sphere",
    "rosenbrock",
    "rastrigin",
    "ackley",
    "griewank",
];

/// The functions, in the order of [`NAMES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Function {
    Zdt1,
    Zdt2,
    Zdt3,
    Zdt4,
    Zdt6,
    Dtlz1,
    Dtlz2,
    Sphere,
    Rosenbrock,
    Rastrigin,
    Ackley,
    Griewank,
}

impl Function {
    /// Writes the objectives of one candidate, or of one in each lane.
    #[inline(always)]
    fn evaluate<R: Real>(self, x: &[R], f: &mut [R]) {
        match self {
            Self::Zdt1 => zdt::zdt1(x, f),
            Self::Zdt2 => zdt::zdt2(x, f),
            Self::Zdt3 => zdt::zdt3(x, f),
            Self::Zdt4 => zdt::zdt4(x, f),
            Self::Zdt6 => zdt::zdt6(x, f),
            Self::Dtlz1 => dtlz::dtlz1(x, f),
            Self::Dtlz2 => dtlz::dtlz2(x, f),
            Self::Sphere => single::sphere(x, f),
            Self::Rosenbrock => single::rosenbrock(x, f),
            Self::Rastrigin => single::rastrigin(x, f),
            Self::Ackley => single::ackley(x, f),
            Self::Griewank => single::griewank(x, f),
        }
    }
}

/// The sum over a row, from the first to the last.
#[inline(always)]
fn sum<R: Real>(x: &[R], term: impl Fn(R) -> R) -> R {
    let mut sum = R::lit(0.0);
    for x in x {
        sum = sum + term(*x);
    }
    sum
}

impl TestProblem {
    /// The problem of that name, one of [`NAMES`], in the size of the references: 30 variables (10 for ZDT4 and
    /// ZDT6), 7 for DTLZ1 and 12 for DTLZ2 with three objectives; 30 for the single-objective ones.
    pub fn by_name(name: &str) -> Option<Self> {
        zdt::by_name(name)
            .or_else(|| dtlz::by_name(name))
            .or_else(|| single::by_name(name, 30))
    }

    /// The problem of that name in so many variables, two or three at least. Where the front or the optimum lies does
    /// not depend on it.
    pub fn sized(name: &str, dimensions: usize) -> Option<Self> {
        let mut problem = Self::by_name(name)?;
        if problem.problem.objectives.len() == 1 {
            return Self::single(name, dimensions);
        }
        let least = problem.problem.objectives.len();
        let last = problem.problem.variables.last()?.clone();
        let named = |i: usize| Variable {
            name: format!("x{}", i + 1),
            ..last.clone()
        };
        let count = problem.problem.variables.len();
        problem.problem.variables.truncate(dimensions.max(least));
        problem.problem.variables.extend((count..dimensions).map(named));
        Some(problem)
    }

    /// The single-objective problem of that name in `dimensions` variables.
    pub fn single(name: &str, dimensions: usize) -> Option<Self> {
        single::by_name(name, dimensions)
    }

    fn new(
        name: &'static str,
        bounds: impl Iterator<Item = (f64, f64)>,
        objectives: usize,
        function: Function,
        front: fn(usize) -> Vec<Vec<f64>>,
    ) -> Self {
        let variables = bounds
            .enumerate()
            .map(|(i, (lower, upper))| Variable::new(format!("x{}", i + 1), "-", lower, upper));
        Self {
            name,
            problem: Problem {
                variables: variables.collect(),
                objectives: (1..=objectives)
                    .map(|k| Objective::new(format!("f{k}"), "-"))
                    .collect(),
            },
            function,
            shift: Vec::new(),
            factor: 1.0,
            front,
        }
    }

    /// The same with objectives `factor` times as large, on every backend.
    pub fn times(self, factor: f32) -> Self {
        Self { factor, ..self }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Variables and objectives.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// About `count` points of the true front, evenly over it; the least value for a single objective.
    pub fn front(&self, count: usize) -> Vec<Vec<f64>> {
        let mut front = (self.front)(count);
        self.enlarge(front.iter_mut().flatten());
        front
    }

    fn enlarge<'a>(&self, objectives: impl Iterator<Item = &'a mut f64>) {
        objectives.for_each(|f| *f *= f64::from(self.factor));
    }

    /// Where the optimum of a single-objective problem lies; nothing for the others.
    pub fn optimum(&self) -> Option<&[f64]> {
        (self.problem.objectives.len() == 1).then_some(&self.shift)
    }

    /// Writes the objectives of `candidate`.
    pub fn evaluate(&self, candidate: &[f64], objectives: &mut [f64]) {
        if self.shift.is_empty() {
            self.function.evaluate(candidate, objectives);
        } else {
            let moved: Vec<f64> = candidate.iter().zip(&self.shift).map(|(x, s)| x - s).collect();
            self.function.evaluate(&moved, objectives);
        }
        self.enlarge(objectives.iter_mut());
    }

    /// An evaluator on one thread.
    pub fn evaluator(&self) -> PointEvaluator<impl Fn(&[f64], &mut [f64]) + Sync> {
        self.evaluator_on(CallCost::Cheap)
    }

    /// An evaluator on all threads, for populations that are worth it.
    pub fn threaded_evaluator(&self) -> PointEvaluator<impl Fn(&[f64], &mut [f64]) + Sync> {
        self.evaluator_on(CallCost::Expensive)
    }

    fn evaluator_on(&self, cost: CallCost) -> PointEvaluator<impl Fn(&[f64], &mut [f64]) + Sync> {
        let problem = self.clone();
        let function = move |x: &[f64], f: &mut [f64]| problem.evaluate(x, f);
        PointEvaluator::new(self.problem.clone(), cost, function)
    }
}

/// `count` numbers from zero to one, ends included.
fn even(count: usize) -> impl Iterator<Item = f64> {
    let last = count.max(2) - 1;
    (0..=last).map(move |i| i as f64 / last as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::Evaluator;
    use crate::swarm::metrics::{hypervolume, non_dominated};

    #[test]
    fn fronts_are_reached_and_non_dominated() {
        for name in NAMES {
            let problem = TestProblem::by_name(name).unwrap();
            let front = problem.front(200);
            assert_eq!(non_dominated(&front).len(), front.len(), "{name}");
            assert!(
                front
                    .iter()
                    .all(|p| p.len() == problem.problem().objectives.len()),
                "{name}"
            );
        }
        assert!(TestProblem::by_name("zdt5").is_none());
    }

    /// On the true front all distance variables stand at their best values: candidates there give points of it.
    #[test]
    fn candidates_of_the_front() {
        let near = |name: &str, candidate: &[f64], expected: &[f64]| {
            let problem = TestProblem::by_name(name).unwrap();
            let found = problem.evaluator().evaluate(candidate).unwrap().objectives;
            for (f, e) in found.iter().zip(expected) {
                assert!((f - e).abs() < 1e-14, "{name}: {found:?}, not {expected:?}");
            }
        };
        let padded = |first: &[f64], rest: f64, count: usize| {
            let mut row = first.to_vec();
            row.resize(count, rest);
            row
        };
        near("zdt1", &padded(&[0.25], 0.0, 30), &[0.25, 0.5]);
        near("zdt2", &padded(&[0.5], 0.0, 30), &[0.5, 0.75]);
        near("zdt3", &padded(&[0.25], 0.0, 30), &[0.25, 0.25]);
        near("zdt4", &padded(&[0.25], 0.0, 10), &[0.25, 0.5]);
        // Off the front: g = 1 + 9 = 10 (ZDT1), 1 + 10 * 9 + 9 * (1 - 10) = 10 (ZDT4).
        near("zdt1", &padded(&[0.0], 1.0, 30), &[0.0, 10.0]);
        near("zdt4", &padded(&[0.0], 1.0, 10), &[0.0, 10.0]);
        near("zdt6", &padded(&[1.0], 0.0, 10), &[1.0, 0.0]);
        near("dtlz1", &padded(&[0.5, 0.5], 0.5, 7), &[0.125, 0.125, 0.25]);
        near(
            "dtlz2",
            &padded(&[0.5, 1.0], 0.5, 12),
            &[0.0, 0.5f64.sqrt(), 0.5f64.sqrt()],
        );
    }

    /// Volumes by integration of the fronts' formulas, reference 1.1: 1.21 less the area under the front.
    #[test]
    fn volumes_under_fronts() {
        let of = |name: &str| {
            let front = TestProblem::by_name(name).unwrap().front(4000);
            let width = front[0].len();
            hypervolume(&front, &vec![1.1; width]).unwrap()
        };
        assert!((of("zdt1") - (1.21 - 1.0 / 3.0)).abs() < 1e-3);
        assert!((of("zdt2") - (1.21 - 2.0 / 3.0)).abs() < 1e-3);
        // The cube less an eighth of a ball, a lattice of some 90 by 90 being coarser.
        assert!((of("dtlz2") - (1.331 - std::f64::consts::PI / 6.0)).abs() < 1.5e-2);
    }

    #[test]
    fn optima_are_optimal_and_inside() {
        for name in &NAMES[7..] {
            let problem = TestProblem::by_name(name).unwrap();
            let optimum = problem.optimum().unwrap();
            let mut value = [1.0];
            problem.evaluate(optimum, &mut value);
            // Ackley's cancels exp(1) only to rounding.
            assert!(value[0].abs() < 1e-14, "{name}: {}", value[0]);
            for (x, v) in optimum.iter().zip(&problem.problem().variables) {
                assert!(*x > v.lower && *x < v.upper);
            }
            let aside: Vec<f64> = optimum.iter().map(|x| x + 0.01).collect();
            problem.evaluate(&aside, &mut value);
            assert!(value[0] > 1e-5);
        }
    }
}
