//! The reference backend: `f64`, one car after another, threads by rayon.

use super::kernel::{Aim, Settling, settle};
use super::problem::SteadyProblem;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

fn settle_on<T: Tyre<f64>>(steady: &SteadyProblem, candidate: &[f64]) -> Settling<f64> {
    let flat = steady.free.flat(candidate);
    let car = CarModel::<f64, T>::from_parameters(&flat);
    let [speed, steer] = steady.aim_figures(candidate);
    settle(&car, steady.plan(), &Aim { speed, steer })
}

/// The last states of candidates in `f64`.
pub(super) fn settled(steady: &SteadyProblem, candidates: &[&[f64]]) -> Vec<Settling<f64>> {
    let settle = match steady.tyre_model() {
        TyreModel::MagicFormula => settle_on::<MagicFormula<f64>>,
        TyreModel::Linear => settle_on::<LinearTyre<f64>>,
    };
    candidates
        .par_iter()
        .map(|candidate| settle(steady, candidate))
        .collect()
}
