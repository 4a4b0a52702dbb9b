//! The shape that the layers of whole evaluations share: candidates, what the reference says of them, and how a subject's
//! figures compare.

use super::{Agreement, Draws, Layer, Subject};
use crate::error::Result;
use crate::evaluate::{CpuBackend, Failure, OnDevice, OutcomeOf};
use rayon::prelude::*;

/// How far the neighbours of a candidate are off, as a share of every figure: sixteen roundings of `f32`.
const NEXT_TO: f64 = 1e-6;

/// A kind of problem whose outcomes are compared.
pub(super) trait Compared: OnDevice + 'static {
    /// What a candidate is, in a word.
    const NOUN: &'static str;

    /// The figures of an outcome that are compared: its objectives, if nothing else is said.
    ///
    /// # Errors
    /// Why there are none.
    fn figures(&self, candidate: &[f64], outcome: &Self::Outcome) -> std::result::Result<Vec<f64>, Failure> {
        let (row, failure) = self.objective_row(candidate, Ok(outcome));
        failure.map_or(Ok(row), Err)
    }

    /// What the error of each of the `exact` figures is measured against, and what single precision may move it by. Nothing for
    /// a candidate that is left out. A candidate that failed has no figures.
    fn limits(&self, candidate: &[f64], outcome: &Self::Outcome, exact: &[f64]) -> Option<Vec<[f64; 2]>>;

    /// Whether an outcome has the bits of the plain `f32` scalar; nothing where that is not looked at.
    fn alike(&self, _candidate: &[f64], _found: &Self::Outcome) -> Option<bool> {
        None
    }
}

/// Figures of a candidate in `f64`, each with what its error is measured against and how far off it may be, or why there are
/// none.
type Exact = std::result::Result<Vec<[f64; 3]>, Failure>;

/// Candidates of one problem, and what the reference says of them.
pub(super) struct Cases<K> {
    /// The name of each figure's comparison.
    names: Vec<String>,
    pub problem: K,
    pub candidates: Vec<Vec<f64>>,
    /// Nothing for a candidate that is left out.
    exact: Vec<Option<Exact>>,
}

pub(super) fn slices(candidates: &[Vec<f64>]) -> Vec<&[f64]> {
    candidates.iter().map(Vec::as_slice).collect()
}

impl<K: Compared> Cases<K> {
    /// Evaluates the candidates in `f64`. `near` has as many neighbours of each. Where the reference itself moves by more from a
    /// candidate to its neighbours than is allowed, the candidate stands at the edge of something, neither answer is wrong, and
    /// it is left out.
    pub fn new(names: Vec<String>, problem: K, candidates: Vec<Vec<f64>>, near: &[Vec<f64>]) -> Self {
        let each = near.len() / candidates.len();
        let reference = CpuBackend::new(&problem);
        let figures = |candidate: &[f64], outcome: &OutcomeOf<K>| match outcome {
            Ok(outcome) => problem.figures(candidate, outcome),
            Err(failure) => Err(*failure),
        };
        let near_outcomes = reference.outcomes(&slices(near));
        let near: Vec<_> = near
            .iter()
            .zip(&near_outcomes)
            .map(|(c, o)| figures(c, o))
            .collect();
        let outcomes = reference.outcomes(&slices(&candidates));
        let exact = candidates
            .iter()
            .zip(&outcomes)
            .enumerate()
            .map(|(i, (candidate, outcome))| {
                let own = figures(candidate, outcome);
                let limits = match outcome {
                    Ok(outcome) => problem.limits(candidate, outcome, own.as_deref().unwrap_or(&[]))?,
                    Err(_) => Vec::new(),
                };
                let own: Exact = own.map(|figures| {
                    let both = figures.into_iter().zip(limits);
                    both.map(|(x, [scale, allowed])| [x, scale, allowed]).collect()
                });
                let alike = near[i * each..(i + 1) * each]
                    .iter()
                    .all(|near| match (&own, near) {
                        (Ok(own), Ok(near)) => own
                            .iter()
                            .zip(near)
                            .all(|([x, _, allowed], y)| (x - y).abs() <= *allowed),
                        (own, near) => own.as_ref().err() == near.as_ref().err(),
                    });
                alike.then_some(own)
            });
        Self {
            exact: exact.collect(),
            names,
            problem,
            candidates,
        }
    }

    /// As [`Cases::new`] with `each` neighbours of every candidate. The last candidate becomes one that cannot be evaluated,
    /// which every backend must say alike.
    pub fn among_neighbours(
        names: Vec<String>,
        problem: K,
        mut candidates: Vec<Vec<f64>>,
        each: usize,
        draws: &mut Draws,
    ) -> Self {
        if let Some(last) = candidates.last_mut() {
            last.fill(f64::NAN);
        }
        let mut near = Vec::with_capacity(each * candidates.len());
        for candidate in candidates.iter().flat_map(|c| std::iter::repeat_n(c, each)) {
            let off = |x: &f64| x * (1.0 + draws.within(-NEXT_TO, NEXT_TO));
            near.push(candidate.iter().map(off).collect());
        }
        Self::new(names, problem, candidates, &near)
    }

    /// Whether the reference has figures of every candidate.
    pub fn all_succeed(&self) -> bool {
        self.exact.iter().all(|exact| matches!(exact, Some(Ok(_))))
    }

    /// Every figure on `subject`.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn compare(&self, subject: &Subject) -> Result<Vec<Agreement>> {
        let problem = &self.problem;
        let outcomes = subject.outcomes(problem, &slices(&self.candidates))?;
        let alike = self
            .candidates
            .par_iter()
            .zip(&outcomes)
            .filter_map(|(candidate, found)| problem.alike(candidate, found.as_ref().ok()?))
            .reduce_with(|a, b| a && b);
        let mut agreements: Vec<Agreement> = self
            .names
            .iter()
            .map(|name| Agreement::new(name, subject))
            .collect();
        let determined = self.exact.iter().flatten().count();
        for agreement in &mut agreements {
            if let Some(alike) = alike {
                agreement.bits(alike, subject);
            }
            // With half of them at the edge, there would be too little to say.
            agreement.verdict(2 * determined > self.exact.len(), || {
                format!("{determined} candidates whose figures are determined")
            });
        }
        for (i, (exact, outcome)) in self.exact.iter().zip(&outcomes).enumerate() {
            let Some(exact) = exact else { continue };
            let found = match outcome {
                Ok(outcome) => problem.figures(&self.candidates[i], outcome),
                Err(failure) => Err(*failure),
            };
            let case = || format!("{} {i}", K::NOUN);
            for (k, agreement) in agreements.iter_mut().enumerate() {
                agreement.verdict(found.as_ref().err() == exact.as_ref().err(), || {
                    format!("{}: {found:?} for {exact:?}", case())
                });
                if let (Ok(found), Ok(exact)) = (&found, exact) {
                    let [exact, scale, allowed] = exact[k];
                    agreement.note(found[k], exact, scale, allowed, case);
                }
            }
        }
        Ok(agreements)
    }
}

/// The layer of several problems of a kind.
pub(super) fn layer_of<K: Compared>(all: Vec<Cases<K>>) -> Layer {
    Box::new(move |subject| {
        let each: Vec<_> = all
            .iter()
            .map(|cases| cases.compare(subject))
            .collect::<Result<_>>()?;
        Ok(each.concat())
    })
}
