//! Cars in the form that the `f32` kernels read: a shared table of ready figures, and for each candidate only
//! those that the free parameters move.

use super::packs::Pack;
use super::{FreeCar, Variable};
use crate::random::Random;
use crate::scalar::lanes::Lanes;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;
use std::collections::HashMap;

/// Ready cars of one problem (see [`CarModel::to_table`]), worked out in `f64` and rounded once.
#[derive(Clone, Debug)]
pub struct ModelTable {
    /// The table of a candidate in the middle of the bounds; figures that do not vary hold for all.
    pub base: Vec<f32>,
    /// For each place of the table, which varying figure it is, if it varies. Places that always hold the same, such as a figure of
    /// both axles' tyres that one unknown moves, are one figure, which kernels read once and keep once.
    pub sources: Vec<Option<usize>>,
    /// For each varying figure, the first place of the table that holds it; ascending.
    pub varying: Vec<usize>,
}

/// Purpose of the probing draws in the counter.
const PROBE: u32 = 0x9b0be;
/// Random candidates that are compared to find which figures vary. Jointly random, because a figure may be a
/// product that vanishes while only one of its factors moves.
const PROBES: u32 = 8;

impl ModelTable {
    /// Finds the figures that the free parameters of `car` move between the bounds of `variables`, whose first they are.
    pub fn new(car: &FreeCar, variables: &[Variable]) -> Self {
        let at_share = |share: &dyn Fn(u32) -> f64| -> Vec<f64> {
            let variables = variables.iter().zip(0..);
            let candidate: Vec<f64> = variables
                .map(|(v, i)| v.lower + share(i) * (v.upper - v.lower))
                .collect();
            ready(car, &candidate)
        };
        let base = at_share(&|_| 0.5);
        let random = Random::new(0);
        let probes: Vec<Vec<f64>> = (0..PROBES)
            .map(|probe| at_share(&|i| random.uniform(PROBE, probe, 0, i)))
            .collect();
        let mut varying = Vec::new();
        let mut known = HashMap::new();
        let sources = (0..base.len())
            .map(|place| {
                let bits: Vec<u64> = probes.iter().map(|table| table[place].to_bits()).collect();
                let varies = bits.iter().any(|bits| *bits != base[place].to_bits());
                varies.then(|| {
                    *known.entry(bits).or_insert_with(|| {
                        varying.push(place);
                        varying.len() - 1
                    })
                })
            })
            .collect();
        Self {
            base: base.iter().map(|x| *x as f32).collect(),
            sources,
            varying,
        }
    }

    /// The varying figures of each candidate, row-major, candidates by [`ModelTable::varying`].
    pub fn rows(&self, car: &FreeCar, candidates: &[&[f64]]) -> Vec<f32> {
        let mut rows = vec![0.0; candidates.len() * self.varying.len()];
        if !self.varying.is_empty() {
            rows.par_chunks_exact_mut(self.varying.len())
                .zip(candidates)
                .for_each(|(row, candidate)| {
                    let table = ready(car, candidate);
                    for (out, &place) in row.iter_mut().zip(&self.varying) {
                        *out = table[place] as f32;
                    }
                });
        }
        rows
    }

    /// The cars of a pack; `rows` are those of all candidates, see [`ModelTable::rows`].
    #[inline(always)]
    pub(crate) fn cars<L: Lanes, T: Tyre<L>>(&self, rows: &[f32], pack: Pack) -> CarModel<L, T> {
        let width = self.varying.len();
        CarModel::from_table(|place| match self.sources[place] {
            Some(figure) => L::from_fn(|lane| rows[pack.candidate(lane) * width + figure]),
            None => L::load(self.base[place]),
        })
    }
}

/// A candidate's ready table in `f64`.
fn ready(car: &FreeCar, candidate: &[f64]) -> Vec<f64> {
    let flat = car.flat(candidate);
    match car.tyre_model() {
        TyreModel::MagicFormula => {
            CarModel::<f64, MagicFormula<f64>>::from_parameters(|i| flat[i]).to_table()
        }
        TyreModel::Linear => CarModel::<f64, LinearTyre<f64>>::from_parameters(|i| flat[i]).to_table(),
    }
}
