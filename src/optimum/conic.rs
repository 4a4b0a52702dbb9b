//! Quadratic and second-order cone programs, handed to Clarabel.

use crate::{Error, Result};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};

/// How a solver ended. It is displayed in plain words.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Status {
    /// Solved to the tolerances asked for.
    Solved,
    /// A solution of reduced accuracy, and why.
    Almost(String),
    /// No solution, and why.
    Failed(String),
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Solved => f.write_str("Solved"),
            Self::Almost(why) => write!(f, "Almost solved: {why}"),
            Self::Failed(why) => write!(f, "Failed: {why}"),
        }
    }
}

/// A cone solver's status in plain words.
fn in_words(status: SolverStatus) -> Status {
    let why = match status {
        SolverStatus::Solved => return Status::Solved,
        SolverStatus::AlmostSolved => return Status::Almost("a cone program of reduced accuracy".to_owned()),
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
            "no line or speed meets all bounds of a cone program"
        }
        SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => {
            "a cone program without a least value"
        }
        SolverStatus::MaxIterations => "a cone program that takes too many iterations",
        SolverStatus::MaxTime => "a cone program that takes too long",
        SolverStatus::NumericalError => "a cone program that rounding stops",
        SolverStatus::InsufficientProgress => "a cone program whose steps no longer lead on",
        _ => "a cone program that was not begun, or broken off",
    };
    Status::Failed(why.to_owned())
}

/// A step of an affine map: `constant + sum of coefficient * variable`.
#[derive(Clone, Debug, Default)]
pub(super) struct Affine {
    pub constant: f64,
    pub terms: Vec<(usize, f64)>,
}

impl Affine {
    /// A map without a constant.
    pub fn change(terms: Vec<(usize, f64)>) -> Self {
        Self { constant: 0.0, terms }.merged()
    }

    /// The same with one term for each variable.
    pub fn merged(mut self) -> Self {
        self.terms.sort_by_key(|(k, _)| *k);
        self.terms.dedup_by(|later, kept| {
            let same = later.0 == kept.0;
            if same {
                kept.1 += later.1;
            }
            same
        });
        self
    }
}

/// Minimise `sum of squares + linear terms` over a box, with rows that must lie in second-order cones.
#[derive(Debug)]
pub(super) struct ConicProgram {
    lower: Vec<f64>,
    upper: Vec<f64>,
    linear: Vec<f64>,
    squares: Vec<Affine>,
    nonnegatives: Vec<Affine>,
    cones: Vec<[Affine; 3]>,
    tolerance: f64,
    gap: f64,
}

/// What a solver returned.
#[derive(Debug)]
pub(super) struct Solution {
    pub x: Vec<f64>,
    pub status: Status,
    /// The dual objective: no feasible point is better, to the solver's tolerance.
    pub lower_bound: f64,
    pub iterations: usize,
}

/// Relative accuracy that is asked of the solver. A solution of less accuracy is reported as [`Status::Almost`].
const TOLERANCE: f64 = 1e-10;
/// Least accuracy of a solution.
const REDUCED_TOLERANCE: f64 = 1e-6;
/// From this relative accuracy of a program on, its linear systems are solved to the relative and absolute accuracy below. Closer
/// solutions take a fourth to a half more time, and lines and deployments are the same.
const LESS_ACCURATE: f64 = 1e-8;
const STEP_REFINEMENT: (f64, f64) = (1e-7, 1e-8);

impl ConicProgram {
    /// Variables between `lower` and `upper`; an infinite bound is no bound.
    pub fn new(lower: Vec<f64>, upper: Vec<f64>) -> Self {
        Self {
            linear: vec![0.0; lower.len()],
            lower,
            upper,
            squares: Vec::new(),
            nonnegatives: Vec::new(),
            cones: Vec::new(),
            tolerance: TOLERANCE,
            gap: TOLERANCE,
        }
    }

    /// Adds variables between bounds and returns the number of the first.
    pub fn add_variables(&mut self, bounds: impl Iterator<Item = (f64, f64)>) -> usize {
        let first = self.lower.len();
        for (lower, upper) in bounds {
            self.lower.push(lower);
            self.upper.push(upper);
            self.linear.push(0.0);
        }
        first
    }

    /// Adds `coefficient * variable` to the objective.
    pub fn add_linear(&mut self, variable: usize, coefficient: f64) {
        self.linear[variable] += coefficient;
    }

    /// Adds the square of an affine map to the objective.
    pub fn add_square(&mut self, square: Affine) {
        self.squares.push(square);
    }

    /// Demands `0 <= map`.
    pub fn add_nonnegative(&mut self, map: Affine) {
        self.nonnegatives.push(map);
    }

    /// Makes it a step of a sequence, which needs less accuracy: a relative `tolerance`, and the `gap` to the least value that may be
    /// left, in the objective's unit.
    pub fn for_step(mut self, tolerance: f64, gap: f64) -> Self {
        (self.tolerance, self.gap) = (tolerance, gap.max(tolerance));
        self
    }

    /// Demands `norm(cone[1], cone[2]) <= cone[0]`.
    pub fn add_cone(&mut self, cone: [Affine; 3]) {
        self.cones.push(cone);
    }

    /// The objective at `x` without the constant part of the squares.
    pub fn value(&self, x: &[f64]) -> f64 {
        let linear: f64 = self.linear.iter().zip(x).map(|(c, x)| c * x).sum();
        let square = |map: &Affine| {
            let change: f64 = map.terms.iter().map(|&(k, a)| a * x[k]).sum();
            change * (2.0 * map.constant + change)
        };
        linear + self.squares.iter().map(square).sum::<f64>()
    }

    /// Solves it.
    ///
    /// # Errors
    /// [`Error::Study`] if the solver refuses the problem.
    pub fn solve(&self) -> Result<Solution> {
        let n = self.lower.len();
        let mut linear = self.linear.clone();
        let (mut quadratic, mut constant) = (Vec::new(), 0.0);
        for square in &self.squares {
            constant += square.constant * square.constant;
            for &(i, a) in &square.terms {
                linear[i] += 2.0 * square.constant * a;
                // Clarabel minimises x'Px/2 and reads the upper triangle.
                let row = square.terms.iter().filter(|(j, _)| i <= *j);
                quadratic.extend(row.map(|&(j, b)| (i, j, 2.0 * a * b)));
            }
        }
        let mut rows = Rows::default();
        let fixed: Vec<bool> = self.lower.iter().zip(&self.upper).map(|(l, u)| l == u).collect();
        for i in (0..n).filter(|i| fixed[*i]) {
            rows.push(1.0, &[(i, 1.0)], self.lower[i]);
        }
        let zeros = rows.right.len();
        for i in (0..n).filter(|i| !fixed[*i]) {
            if self.lower[i].is_finite() {
                rows.push(-1.0, &[(i, 1.0)], -self.lower[i]);
            }
            if self.upper[i].is_finite() {
                rows.push(1.0, &[(i, 1.0)], self.upper[i]);
            }
        }
        for map in &self.nonnegatives {
            rows.push(-1.0, &map.terms, map.constant);
        }
        let nonnegatives = rows.right.len() - zeros;
        for map in self.cones.iter().flatten() {
            rows.push(-1.0, &map.terms, map.constant);
        }
        let mut cones = vec![
            SupportedConeT::ZeroConeT(zeros),
            SupportedConeT::NonnegativeConeT(nonnegatives),
        ];
        cones.extend(self.cones.iter().map(|_| SupportedConeT::SecondOrderConeT(3)));
        let mut settings = DefaultSettingsBuilder::<f64>::default();
        if self.tolerance >= LESS_ACCURATE {
            let (relative, absolute) = STEP_REFINEMENT;
            settings
                .iterative_refinement_reltol(relative)
                .iterative_refinement_abstol(absolute);
        }
        let settings = settings
            .verbose(false)
            .max_threads(1)
            .tol_gap_abs(self.gap)
            .tol_gap_rel(self.tolerance)
            .tol_feas(self.tolerance)
            .reduced_tol_gap_abs(REDUCED_TOLERANCE)
            .reduced_tol_gap_rel(REDUCED_TOLERANCE)
            .reduced_tol_feas(REDUCED_TOLERANCE)
            .build()
            .map_err(|e| Error::Study(format!("the conic solver refuses its settings: {e}")))?;
        let p = columns(n, n, quadratic);
        let a = columns(rows.right.len(), n, rows.entries);
        let mut solver = DefaultSolver::new(&p, &linear, &a, &rows.right, &cones, settings)
            .map_err(|e| Error::Study(format!("the conic solver refuses the problem: {e}")))?;
        solver.solve();
        let solution = &solver.solution;
        let status = in_words(solution.status);
        let inside = solution.x.iter().zip(&self.lower).zip(&self.upper);
        Ok(Solution {
            x: inside.map(|((x, l), u)| x.clamp(*l, *u)).collect(),
            status,
            lower_bound: solution.obj_val_dual + constant,
            iterations: solution.iterations as usize,
        })
    }
}

/// Rows of `right - matrix * x`, the form that Clarabel's cones hold.
#[derive(Default)]
struct Rows {
    entries: Vec<(usize, usize, f64)>,
    right: Vec<f64>,
}

impl Rows {
    fn push(&mut self, sign: f64, terms: &[(usize, f64)], right: f64) {
        let row = self.right.len();
        self.entries
            .extend(terms.iter().map(|&(j, a)| (row, j, sign * a)));
        self.right.push(right);
    }
}

/// A compressed matrix from entries, those in the same place added up in their order.
fn columns(height: usize, width: usize, entries: Vec<(usize, usize, f64)>) -> CscMatrix<f64> {
    let mut ends = vec![0; width];
    for &(_, column, _) in &entries {
        ends[column] += 1;
    }
    let mut first = 0;
    for end in &mut ends {
        first += std::mem::replace(end, first);
    }
    let mut placed = vec![(0, 0.0); entries.len()];
    for (row, column, value) in entries {
        placed[ends[column]] = (row, value);
        ends[column] += 1;
    }
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::<f64>::new());
    let mut first = 0;
    for end in ends {
        let own = &mut placed[first..end];
        own.sort_by_key(|(row, _)| *row);
        for &(row, value) in own.iter() {
            match (rows.last(), values.last_mut()) {
                (Some(last), Some(sum)) if *last == row && starts[starts.len() - 1] < rows.len() => {
                    *sum += value
                }
                _ => {
                    rows.push(row);
                    values.push(value);
                }
            }
        }
        starts.push(rows.len());
        first = end;
    }
    CscMatrix::new(height, width, starts, rows, values)
}
