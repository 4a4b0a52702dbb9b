//! Cars in the form that the `f32` kernels read: a shared table of ready figures, and for each candidate only
//! those that the free parameters move.

use super::packs::Pack;
use super::{FreeCar, Variable};
use crate::random::Random;
use crate::scalar::lanes::Lanes;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{CarModel, Chassis, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;

/// Ready cars of one problem (see [`CarModel::to_table`]), worked out in `f64` and rounded once.
#[derive(Clone, Debug)]
pub struct ModelTable {
    /// The table of a candidate in the middle of the bounds; figures that do not vary hold for all.
    pub base: Vec<f32>,
    /// For each place of the table, which varying figure it is, if it varies. One that both axles' tyres share is one figure, which
    /// kernels read once and keep once.
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
        let probe = |probe: u32| at_share(&|i| random.uniform(PROBE, probe, 0, i));
        let probes: Vec<Vec<f64>> = (0..PROBES).map(probe).collect();
        let mut varies = vec![false; base.len()];
        for table in &probes {
            for ((varies, a), b) in varies.iter_mut().zip(table).zip(&base) {
                *varies |= a.to_bits() != b.to_bits();
            }
        }
        let [front, rear] = axles(base.len());
        let mut varying: Vec<usize> = Vec::new();
        let mut sources = vec![None; base.len()];
        for place in (0..base.len()).filter(|&i| varies[i]) {
            // The same tyre on both axles is one figure: kernels read it once. Both are made by the same formula, so that what is
            // equal for random cars is equal for all.
            let twin = (place >= rear).then(|| front + place - rear);
            let same = |twin: &usize| {
                probes
                    .iter()
                    .all(|table| table[place].to_bits() == table[*twin].to_bits())
            };
            sources[place] = twin.filter(same).and_then(|twin| sources[twin]).or_else(|| {
                varying.push(place);
                Some(varying.len() - 1)
            });
        }
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
        let mut table = Vec::with_capacity(self.base.len());
        for (base, source) in self.base.iter().zip(&self.sources) {
            table.push(match source {
                Some(figure) => L::from_fn(|lane| rows[pack.candidate(lane) * width + figure]),
                None => L::load(*base),
            });
        }
        CarModel::from_table(&table)
    }
}

/// Where the figures of the front and of the rear tyres begin in a table of so many: behind those of the chassis.
fn axles(figures: usize) -> [usize; 2] {
    let front = Chassis::<f64>::FIELDS.len();
    [front, front + (figures - front) / 2]
}

/// A candidate's ready table in `f64`.
fn ready(car: &FreeCar, candidate: &[f64]) -> Vec<f64> {
    let flat = car.flat(candidate);
    match car.tyre_model() {
        TyreModel::MagicFormula => CarModel::<f64, MagicFormula<f64>>::from_parameters(&flat).to_table(),
        TyreModel::Linear => CarModel::<f64, LinearTyre<f64>>::from_parameters(&flat).to_table(),
    }
}
