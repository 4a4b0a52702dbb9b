//! Suites of published test problems, in double precision on the processor.
//!
//! Each suite is split in two by its order: settings are chosen on the first, third, fifth problem and so on, and results
//! are published on the others.
//!
//! References:
//! 1. Zitzler, Deb, Thiele, *Comparison of multiobjective evolutionary algorithms: empirical results*,
//!    Evolutionary Computation 8 (2000) (`zdt`).
//! 2. Deb, Thiele, Laumanns, Zitzler, *Scalable test problems for evolutionary multiobjective optimization*, 2005 (`dtlz`).
//! 3. Huband, Hingston, Barone, While, *A review of multiobjective test problems and a scalable test problem toolkit*,
//!    IEEE TEC 10 (2006) (`wfg2`, `wfg3`).
//! 4. Zhang et al., *Multiobjective optimization test instances for the CEC 2009 special session and competition*, 2009
//!    (`uf`).
//! 5. Binh, Korn, *MOBES: a multiobjective evolution strategy for constrained optimization problems*, Mendel 1997; Osyczka,
//!    Kundu, Structural Optimization 10 (1995); Tanaka et al., *GA-based decision support system for multicriteria
//!    optimization*, 1995; Deb, *An efficient constraint handling method for genetic algorithms*, 2000 (the welded beam);
//!    Jain, Deb, *An evolutionary many-objective optimization algorithm using reference-point based nondominated sorting
//!    approach, part II*, IEEE TEC 18 (2014) (`constrained`).
//! 6. Tanabe, Ishibuchi, *An easy-to-use real-world multi-objective optimization problem suite*, Applied Soft Computing 89
//!    (2020) (`engineering`).
//! 7. Suganthan et al., *Problem definitions and evaluation criteria for the CEC 2005 special session on real-parameter
//!    optimization* (`shifted`).
//! 8. Awad et al., *Problem definitions and evaluation criteria for the CEC 2017 special session and competition on single
//!    objective bound constrained real-parameter numerical optimization*, 2016 (`rotated`, with shifts and rotations of
//!    our own).

mod constrained;
mod dtlz;
mod engineering;
mod rotated;
mod uf;
mod wfg;

use super::TestProblem;
use crate::evaluate::point::{CallCost, Constraint, PointEvaluator};
use crate::evaluate::{Objective, Problem, Variable};
use crate::swarm::metrics::Scale;
use serde::Serialize;
use std::fmt;
use std::sync::Arc;

/// The suites and the names of their problems, in their order. Those of `wfg2` have two objectives, those of `wfg3` three.
#[rustfmt::skip]
pub const SUITES: [(&str, &[&str]); 9] = [
    ("zdt", &["zdt1", "zdt2", "zdt3", "zdt4", "zdt6"]),
    ("dtlz", &["dtlz1", "dtlz2", "dtlz3", "dtlz4", "dtlz5", "dtlz6", "dtlz7"]),
    ("wfg2", &["wfg1_2", "wfg2_2", "wfg3_2", "wfg4_2", "wfg5_2", "wfg6_2", "wfg7_2", "wfg8_2", "wfg9_2"]),
    ("wfg3", &["wfg1_3", "wfg2_3", "wfg3_3", "wfg4_3", "wfg5_3", "wfg6_3", "wfg7_3", "wfg8_3", "wfg9_3"]),
    ("uf", &["uf1", "uf2", "uf3", "uf4", "uf5", "uf6", "uf7", "uf8", "uf9", "uf10"]),
    ("constrained", &["bnh", "osy", "tnk", "welded_beam", "c1_dtlz1", "c2_dtlz2", "c3_dtlz4"]),
    ("engineering", &[
        "re21", "re22", "re23", "re24", "re25", "re31", "re32", "re33", "re34", "re35", "re36", "re37",
    ]),
    ("shifted", &["sphere", "rosenbrock", "rastrigin", "ackley", "griewank"]),
    ("rotated", &[
        "rotated_sphere", "rotated_bent_cigar", "rotated_rosenbrock", "rotated_rastrigin", "rotated_schwefel",
        "rotated_ackley", "rotated_griewank", "rotated_levy", "rotated_hybrid", "rotated_composition",
    ]),
];

/// What a problem is for: settings are chosen on one half of each suite, and results are published on the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Half {
    /// Settings are chosen on it.
    ChosenOn,
    /// Results are published on it; nothing is chosen by it.
    Published,
}

impl Half {
    /// Its name, as in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::ChosenOn => "chosen_on",
            Self::Published => "published",
        }
    }
}

/// Writes the objectives of a candidate, and behind them its constraints `G <= 0`.
type Formula = Arc<dyn Fn(&[f64], &mut [f64]) + Send + Sync>;

/// What a suite says of a problem.
struct Definition {
    bounds: Vec<(f64, f64)>,
    objectives: usize,
    constraints: usize,
    formula: Formula,
}

impl Definition {
    /// A problem without constraints.
    fn free(
        bounds: Vec<(f64, f64)>,
        objectives: usize,
        formula: impl Fn(&[f64], &mut [f64]) + Send + Sync + 'static,
    ) -> Self {
        Self {
            bounds,
            objectives,
            constraints: 0,
            formula: Arc::new(formula),
        }
    }

    fn under(self, constraints: usize) -> Self {
        Self { constraints, ..self }
    }
}

/// A problem of a suite.
#[derive(Clone)]
pub struct SuiteProblem {
    name: &'static str,
    suite: &'static str,
    half: Half,
    problem: Problem,
    constraints: usize,
    formula: Formula,
    scale: Scale,
    front: fn(usize) -> Vec<Vec<f64>>,
}

impl fmt::Debug for SuiteProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "SuiteProblem({})", self.name)
    }
}

impl SuiteProblem {
    /// The problem of that name, one of those in [`SUITES`].
    pub fn by_name(name: &str) -> Option<Self> {
        let place = |(_, names): &&(_, &[&str])| names.contains(&name);
        let (suite, names) = SUITES.iter().find(place)?;
        let position = names.iter().position(|n| *n == name)?;
        let everywhere = TestProblem::by_name(name);
        let front = everywhere.as_ref().map_or((|_| Vec::new()) as _, |p| p.front);
        let definition = match everywhere {
            Some(test) => Definition::free(
                test.problem
                    .variables
                    .iter()
                    .map(|v| (v.lower, v.upper))
                    .collect(),
                test.problem.objectives.len(),
                move |x, f| test.evaluate(x, f),
            ),
            None => match *suite {
                "dtlz" => dtlz::by_name(name)?,
                "wfg2" => wfg::by_position(position, 2)?,
                "wfg3" => wfg::by_position(position, 3)?,
                "uf" => uf::by_position(position)?,
                "constrained" => constrained::by_name(name)?,
                "engineering" => engineering::by_name(name)?,
                _ => rotated::by_position(position)?,
            },
        };
        let scale = if definition.objectives == 1 {
            Scale::of(&[vec![0.0]])
        } else {
            scale(name, definition.objectives)?
        };
        let variables = definition.bounds.iter().enumerate();
        let objectives = 1..=definition.objectives;
        Some(Self {
            name: names[position],
            suite,
            half: if position.is_multiple_of(2) {
                Half::ChosenOn
            } else {
                Half::Published
            },
            problem: Problem {
                variables: variables
                    .map(|(i, (lower, upper))| Variable::new(format!("x{}", i + 1), "-", *lower, *upper))
                    .collect(),
                objectives: objectives.map(|k| Objective::new(format!("f{k}"), "-")).collect(),
            },
            constraints: definition.constraints,
            formula: definition.formula,
            scale,
            front,
        })
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The suite that it belongs to.
    pub fn suite(&self) -> &'static str {
        self.suite
    }

    /// What it is for.
    pub fn half(&self) -> Half {
        self.half
    }

    /// Variables and objectives.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// How many constraints it has.
    pub fn constraints(&self) -> usize {
        self.constraints
    }

    /// The scale of its front, from the ideal point to the nadir point; for one objective, the distance from the optimum.
    pub fn scale(&self) -> &Scale {
        &self.scale
    }

    /// About `count` points of the true front, evenly over it, where the front has a formula here; else none.
    pub fn front(&self, count: usize) -> Vec<Vec<f64>> {
        (self.front)(count)
    }

    /// The objectives of `candidate`, and behind them its constraints `G <= 0`.
    pub fn evaluate(&self, candidate: &[f64]) -> Vec<f64> {
        let mut figures = vec![0.0; self.problem.objectives.len() + self.constraints];
        (self.formula)(candidate, &mut figures);
        figures
    }

    /// An evaluator on one thread.
    pub fn evaluator(&self) -> PointEvaluator<impl Fn(&[f64], &mut [f64]) + Sync> {
        let formula = Arc::clone(&self.formula);
        let function = move |x: &[f64], f: &mut [f64]| formula(x, f);
        let constraints = vec![Constraint::at_most_zero(); self.constraints];
        PointEvaluator::constrained(self.problem.clone(), constraints, CallCost::Cheap, function)
    }
}

/// The scale of the problem of that name, from the committed table.
fn scale(name: &str, objectives: usize) -> Option<Scale> {
    let mut rows = include_str!("../../../../benches/peers/scales.csv")
        .lines()
        .map(|line| line.split(','));
    let row = rows.find_map(|mut row| (row.next() == Some(name)).then_some(row))?;
    let figures: Vec<f64> = row.map(str::parse).collect::<Result<_, _>>().ok()?;
    let (ideal, nadir) = figures.split_at_checked(objectives)?;
    (nadir.len() == objectives).then(|| Scale::of(&[ideal.to_vec(), nadir.to_vec()]))
}

/// The square of a number.
fn square(x: f64) -> f64 {
    x * x
}
