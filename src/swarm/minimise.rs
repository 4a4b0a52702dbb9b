//! One call to minimise a function of one's own: bounds and a closure in, the best out.

use super::metrics::hypervolume;
use super::settings::setting;
use super::{Front, Optimiser, Progress, Sizes, by_name, step};
use crate::error::Result;
use crate::evaluate::point::{BatchEvaluator, Constraint, SequentialEvaluator};
use crate::evaluate::{Evaluator, FailureCounts, Objective, Problem, Variable, Worth, add_failures};
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// Reads candidates and writes their objectives.
type Function<'f> = Box<dyn FnMut(&[f64], &mut [f64]) + 'f>;

/// Minimises `function` over a box, a pair of bounds for each variable. The function may keep a state: it is called for one
/// candidate after the other. Where it is not finite, the candidate has failed.
///
/// ```
/// let found = lapswarm::minimise(&[(-5.0, 5.0); 4], |x| x.iter().map(|x| (x - 1.0).powi(2)).sum())
///     .evaluations(20_000)
///     .seed(3)
///     .run()?;
/// let (x, cost) = found.best().ok_or("nothing was found")?;
/// assert!(cost < 1e-12 && (x[0] - 1.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn minimise<'f>(bounds: &[(f64, f64)], mut function: impl FnMut(&[f64]) -> f64 + 'f) -> Minimise<'f> {
    minimise_several(bounds, 1, move |x, f| f[0] = function(x))
}

/// Minimises several objectives at once: `function` reads a candidate and writes its objectives, then the figures of its
/// [`Minimise::constraints`], if there are any. One objective will do as well.
pub fn minimise_several<'f>(
    bounds: &[(f64, f64)],
    objectives: usize,
    function: impl FnMut(&[f64], &mut [f64]) + 'f,
) -> Minimise<'f> {
    Minimise::new(bounds, objectives, Calls::Each(Box::new(function)))
}

/// As [`minimise_several`], for a function that is given all candidates of a generation at once, row-major, and writes a row for
/// each. What is in it may run in threads or on another machine.
pub fn minimise_batch<'f>(
    bounds: &[(f64, f64)],
    objectives: usize,
    function: impl FnMut(&[f64], &mut [f64]) + 'f,
) -> Minimise<'f> {
    Minimise::new(bounds, objectives, Calls::Batch(Box::new(function)))
}

/// How a function is called.
enum Calls<'f> {
    Each(Function<'f>),
    Batch(Function<'f>),
}

/// Why a run stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// The evaluations are spent.
    Evaluations,
    /// A feasible candidate costs no more than the target.
    Target,
    /// The time is up.
    Time,
    /// Nothing was gained for as long as was allowed.
    Stagnation,
    /// Whoever watched it stopped it.
    Observer,
}

/// Where a run was after a generation.
#[derive(Clone, Debug, PartialEq)]
pub struct Indicators {
    /// Candidates evaluated.
    pub evaluations: u64,
    /// Seconds since the run began.
    pub elapsed_s: f64,
    /// The least value of each objective, see [`Optimiser::best`].
    pub best: Vec<f64>,
    /// By how much the best violate the constraints, see [`Optimiser::violation`].
    pub violation: f64,
    /// Members of the front.
    pub members: usize,
    /// Hypervolume of the front up to the reference, if there is one; zero while nothing is feasible.
    pub hypervolume: Option<f64>,
    /// The median of the first objective over the generation's candidates that did not fail, if any did not.
    pub median: Option<f64>,
    /// Candidates of the generation that failed.
    pub failed: usize,
}

/// What a run found.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// The candidates and their objectives: one for a single objective, none if every candidate failed.
    pub front: Front,
    /// Candidates evaluated.
    pub evaluations: u64,
    /// Those that failed, by reason.
    pub failures: FailureCounts,
    /// Why the run stopped.
    pub stopped: Stopped,
    /// Generation after generation.
    pub history: Vec<Indicators>,
}

impl Minimum {
    /// The candidate of the least first objective, and that; nothing if every candidate failed.
    pub fn best(&self) -> Option<(&[f64], f64)> {
        let rows = self.front.candidates.iter().zip(&self.front.objectives);
        let least = rows.min_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        least.map(|(candidate, row)| (candidate.as_slice(), row[0]))
    }

    /// Whether something was found and it violates no constraint; by how much it does is `front.violation`.
    pub fn is_feasible(&self) -> bool {
        self.front.is_feasible()
    }
}

/// A function to minimise, and how; [`Minimise::run`] runs it. Whatever is not said has the usual value.
pub struct Minimise<'f> {
    problem: Problem,
    constraints: Vec<Constraint>,
    calls: Calls<'f>,
    algorithm: String,
    seed: u64,
    population: Option<usize>,
    evaluations: usize,
    archive: usize,
    target: Option<f64>,
    time: Option<Duration>,
    stagnation: Option<(u64, f64)>,
    reference: Option<Vec<f64>>,
}

impl<'f> Minimise<'f> {
    fn new(bounds: &[(f64, f64)], objectives: usize, calls: Calls<'f>) -> Self {
        let variable = |(k, (lower, upper)): (usize, &(f64, f64))| {
            Variable::new(format!("x{}", k + 1), "-", *lower, *upper)
        };
        let objective = |k: usize| Objective::new(format!("f{k}"), "-");
        Self {
            problem: Problem {
                variables: bounds.iter().enumerate().map(variable).collect(),
                objectives: (1..=objectives).map(objective).collect(),
            },
            constraints: Vec::new(),
            calls,
            algorithm: "default".to_owned(),
            seed: 1,
            population: None,
            evaluations: if objectives > 1 { 25_000 } else { 100_000 },
            archive: 100,
            target: None,
            time: None,
            stagnation: None,
            reference: None,
        }
    }

    /// The seed of all random numbers; 1 unless it is said.
    pub fn seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// Candidates of a generation; 40 for one objective and 100 for several unless it is said.
    pub fn population(self, population: usize) -> Self {
        Self {
            population: Some(population),
            ..self
        }
    }

    /// The most evaluations; 100,000 for one objective and 25,000 for several unless it is said.
    pub fn evaluations(self, evaluations: usize) -> Self {
        Self { evaluations, ..self }
    }

    /// The most members of the front of several objectives; 100 unless it is said.
    pub fn archive(self, archive: usize) -> Self {
        Self { archive, ..self }
    }

    /// The optimiser, by its name in [`super::SINGLE_OBJECTIVE`] or [`super::MULTI_OBJECTIVE`].
    pub fn algorithm(self, name: &str) -> Self {
        Self {
            algorithm: name.to_owned(),
            ..self
        }
    }

    /// Constraints, whose figures the function writes behind the objectives.
    pub fn constraints(self, constraints: Vec<Constraint>) -> Self {
        Self { constraints, ..self }
    }

    /// Variables with names and units, and perhaps whole numbers, in the place of the bounds.
    pub fn variables(mut self, variables: Vec<Variable>) -> Self {
        self.problem.variables = variables;
        self
    }

    /// Stops once a feasible candidate costs no more than this, for one objective.
    pub fn target(self, cost: f64) -> Self {
        Self {
            target: Some(cost),
            ..self
        }
    }

    /// Stops after the generation in which this time is up. How far it gets then depends on the machine.
    pub fn time(self, time: Duration) -> Self {
        Self {
            time: Some(time),
            ..self
        }
    }

    /// Stops when so many evaluations have gained no more than this share: of the best cost, or of the hypervolume for several
    /// objectives, which takes a [`Minimise::reference`]. A smaller violation of the constraints is a gain.
    pub fn stagnation(self, evaluations: u64, share: f64) -> Self {
        Self {
            stagnation: Some((evaluations, share)),
            ..self
        }
    }

    /// The point up to which the history tells the hypervolume.
    pub fn reference(self, reference: Vec<f64>) -> Self {
        Self {
            reference: Some(reference),
            ..self
        }
    }

    /// Runs until the evaluations are spent or a reason to stop is met.
    ///
    /// # Errors
    /// [`crate::Error::Input`] naming the bound or the setting that is out of its range.
    pub fn run(self) -> Result<Minimum> {
        self.run_watched(|_| ControlFlow::Continue(()))
    }

    /// As [`Minimise::run`]; `observe` is told of each generation and may stop the run.
    ///
    /// # Errors
    /// As [`Minimise::run`].
    pub fn run_watched(self, mut observe: impl FnMut(&Indicators) -> ControlFlow<()>) -> Result<Minimum> {
        let sizes = self.sizes()?;
        let mut optimiser = by_name(&self.algorithm, &self.problem, sizes)?;
        let limits = Limits {
            began: Instant::now(),
            target: self.target,
            time: self.time,
            stagnation: self.stagnation,
            reference: self.reference,
        };
        let mut evaluator: Box<dyn Evaluator + 'f> = match self.calls {
            Calls::Each(function) => {
                Box::new(SequentialEvaluator::new(self.problem, self.constraints, function))
            }
            Calls::Batch(function) => Box::new(BatchEvaluator::new(self.problem, self.constraints, function)),
        };
        let mut failures = FailureCounts::new();
        let mut history: Vec<Indicators> = Vec::new();
        let mut gained = Gained::default();
        let stopped = loop {
            if optimiser.done() {
                break Stopped::Evaluations;
            }
            let progress = step(&mut optimiser, evaluator.as_mut())?;
            add_failures(&mut failures, &progress.failures);
            let now = limits.indicators(progress, &optimiser)?;
            let watched = observe(&now);
            let reason = limits.reason(&now, &mut gained);
            history.push(now);
            if let Some(reason) = reason {
                break reason;
            }
            if watched.is_break() {
                break Stopped::Observer;
            }
        };
        Ok(Minimum {
            front: optimiser.front(),
            evaluations: optimiser.evaluations(),
            failures,
            stopped,
            history,
        })
    }

    fn sizes(&self) -> Result<Sizes> {
        let several = self.problem.objectives.len() > 1;
        let usual = if several { 100 } else { 40 };
        let population = self.population.unwrap_or(usual.min(self.evaluations));
        if population > self.evaluations {
            let expected = format!("at most the {} evaluations", self.evaluations);
            return Err(setting("population", population.to_string(), &expected));
        }
        if self.target.is_some() && several {
            return Err(setting(
                "target",
                "several objectives".to_owned(),
                "one objective",
            ));
        }
        if let Some((_, share)) = self.stagnation
            && !(0.0..1.0).contains(&share)
        {
            let expected = "a share from 0 to below 1";
            return Err(setting("stagnation", share.to_string(), expected));
        }
        if self.stagnation.is_some() && several && self.reference.is_none() {
            let expected = "a point up to which the hypervolume is measured, to stop when it stagnates";
            return Err(setting("reference", "none".to_owned(), expected));
        }
        if let Some(reference) = &self.reference
            && reference.len() != self.problem.objectives.len()
        {
            let expected = format!(
                "a number for each of {} objectives",
                self.problem.objectives.len()
            );
            return Err(setting("reference", format!("{reference:?}"), &expected));
        }
        Ok(Sizes {
            population,
            iterations: self.evaluations / population.max(1),
            archive: self.archive,
            seed: self.seed,
        })
    }
}

/// What ends a run before its evaluations are spent.
struct Limits {
    began: Instant,
    target: Option<f64>,
    time: Option<Duration>,
    stagnation: Option<(u64, f64)>,
    reference: Option<Vec<f64>>,
}

/// The last gain that counted: when, and what was reached. A hypervolume counts as a cost with its sign turned.
struct Gained {
    evaluations: u64,
    reached: Worth,
}

impl Default for Gained {
    fn default() -> Self {
        Self {
            evaluations: 0,
            reached: Worth::FAILED,
        }
    }
}

impl Limits {
    fn indicators(&self, progress: Progress, optimiser: &dyn Optimiser) -> Result<Indicators> {
        let front = optimiser.front();
        let volume = |reference: &Vec<f64>| match front.is_feasible() {
            true => hypervolume(&front.objectives, reference),
            false => Ok(0.0),
        };
        Ok(Indicators {
            evaluations: progress.evaluations,
            elapsed_s: self.began.elapsed().as_secs_f64(),
            best: progress.best,
            violation: progress.violation,
            members: front.objectives.len(),
            hypervolume: self.reference.as_ref().map(volume).transpose()?,
            median: progress.median,
            failed: progress.failed,
        })
    }

    fn reason(&self, now: &Indicators, gained: &mut Gained) -> Option<Stopped> {
        let hit = |target: f64| now.violation == 0.0 && now.best[0] <= target;
        if self.target.is_some_and(hit) {
            return Some(Stopped::Target);
        }
        if self.time.is_some_and(|time| self.began.elapsed() >= time) {
            return Some(Stopped::Time);
        }
        let (most, share) = self.stagnation?;
        let reached = Worth {
            violation: now.violation,
            cost: now.hypervolume.map_or(now.best[0], |volume| -volume),
        };
        let before = gained.reached;
        let less = before.cost - share * before.cost.abs();
        let same = reached.violation == before.violation && reached.cost < less;
        if reached.violation < before.violation || same {
            *gained = Gained {
                evaluations: now.evaluations,
                reached,
            };
        }
        (now.evaluations - gained.evaluations >= most).then_some(Stopped::Stagnation)
    }
}
