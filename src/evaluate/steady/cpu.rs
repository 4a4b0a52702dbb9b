//! The reference backend: `f64`, one car after another, threads by rayon.

use super::kernel::{Aim, Settling, settle};
use super::problem::{Settled, SteadyProblem};
use crate::error::Result;
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Failure, Problem};
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// Settles cars in `f64`.
pub struct CpuSteadyEvaluator<'a> {
    steady: &'a SteadyProblem,
}

impl<'a> CpuSteadyEvaluator<'a> {
    /// An evaluator of `steady`.
    pub fn new(steady: &'a SteadyProblem) -> Self {
        Self { steady }
    }

    fn settle_on<T: Tyre<f64>>(&self, candidate: &[f64]) -> Settling<f64> {
        let flat = self.steady.free.flat(candidate);
        let car = CarModel::<f64, T>::from_parameters(|i| flat[i]);
        let [speed, steer] = self.steady.aim_figures(candidate);
        settle(&car, self.steady.plan(), &Aim { speed, steer })
    }

    /// The last states of candidates, or why there are none.
    pub fn states(&self, candidates: &[&[f64]]) -> Vec<std::result::Result<Settling<f64>, Failure>> {
        candidates
            .par_iter()
            .map(|candidate| match self.steady.preliminary_failure(candidate) {
                Some(failure) => Err(failure),
                None => Ok(match self.steady.tyre_model() {
                    TyreModel::MagicFormula => self.settle_on::<MagicFormula<f64>>(candidate),
                    TyreModel::Linear => self.settle_on::<LinearTyre<f64>>(candidate),
                }),
            })
            .collect()
    }

    /// The trims of candidates, or why there are none.
    pub fn trims(&self, candidates: &[&[f64]]) -> Vec<std::result::Result<Settled, Failure>> {
        self.steady.trims_of(candidates, self.states(candidates))
    }
}

impl Evaluator for CpuSteadyEvaluator<'_> {
    fn problem(&self) -> &Problem {
        &self.steady.problem
    }

    fn backend(&self) -> BackendInfo {
        BackendInfo::reference()
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates: Vec<&[f64]> = population.chunks_exact(self.steady.dimensions()).collect();
        Ok(self.steady.evaluation_of(self.trims(&candidates)))
    }
}
