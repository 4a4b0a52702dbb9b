//! The normal distribution that the particles are drawn from, and how it adapts.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;
use serde::{Deserialize, Deserializer, Serialize};

/// Centre, step size and covariance over the unit cube, with their evolution paths.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(in crate::swarm) struct Distribution {
    pub mean: DVector<f64>,
    pub step: f64,
    #[serde(deserialize_with = "square")]
    covariance: DMatrix<f64>,
    #[serde(deserialize_with = "square")]
    basis: DMatrix<f64>,
    scales: DVector<f64>,
    covariance_path: DVector<f64>,
    step_path: DVector<f64>,
    age: i32,
}

/// A square matrix as it is kept. `nalgebra` takes rows times columns without a look at how large they are.
fn square<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DMatrix<f64>, D::Error> {
    let (figures, rows, columns) = <(Vec<f64>, usize, usize)>::deserialize(deserializer)?;
    if rows != columns || rows.checked_mul(columns) != Some(figures.len()) {
        return Err(serde::de::Error::custom("a matrix that is not square"));
    }
    Ok(DMatrix::from_vec(rows, columns, figures))
}

/// Particles that are worth a thread.
pub(in crate::swarm) const FEW: usize = 64;

/// Eigenvalues of the covariance are kept above this.
const LEAST_VARIANCE: f64 = 1e-20;

impl Distribution {
    /// Round about `mean`, with the standard deviation `step` in every direction.
    pub fn new(mean: DVector<f64>, step: f64) -> Self {
        let d = mean.len();
        Self {
            mean,
            step,
            covariance: DMatrix::identity(d, d),
            basis: DMatrix::identity(d, d),
            scales: DVector::from_element(d, 1.0),
            covariance_path: DVector::zeros(d),
            step_path: DVector::zeros(d),
            age: 0,
        }
    }

    /// The point that standard normal deviates stand for, which may lie beyond the bounds.
    pub fn sample(&self, normal: impl Fn(usize) -> f64) -> DVector<f64> {
        let z = DVector::from_fn(self.mean.len(), |k, _| self.scales[k] * normal(k));
        &self.mean + &self.basis * z * self.step
    }

    /// Takes its steps so many times as wide.
    pub fn widen(&mut self, factor: f64) {
        self.step = (self.step * factor).min(1.0);
    }

    /// The greatest standard deviation in any direction.
    pub fn width(&self) -> f64 {
        self.step * self.scales.max()
    }

    /// The ratio of the greatest variance to the least.
    pub fn condition(&self) -> f64 {
        (self.scales.max() / self.scales.min()).powi(2)
    }

    /// One update of centre, step size and covariance from a population, best first; with `active`, the worse
    /// half is unlearnt (Jastrebski, Arnold 2006, in the form of the tutorial's equations 46 to 53).
    pub fn adapt(&mut self, ranked: &[&DVector<f64>], active: bool) {
        let n = self.mean.len() as f64;
        let lambda = ranked.len() as f64;
        let parents = ranked.len() / 2;
        let raw: Vec<f64> = (0..ranked.len())
            .map(|i| (0.5 * (lambda + 1.0)).ln() - (i as f64 + 1.0).ln())
            .collect();
        let sum: f64 = raw[..parents].iter().sum();
        let weights: Vec<f64> = raw[..parents].iter().map(|w| w / sum).collect();
        let effective = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let rate_path = (4.0 + effective / n) / (n + 4.0 + 2.0 * effective / n);
        let rate_step = (effective + 2.0) / (n + effective + 5.0);
        let rate_one = 2.0 / ((n + 1.3).powi(2) + effective);
        let rate_many =
            (1.0 - rate_one).min(2.0 * (effective - 2.0 + 1.0 / effective) / ((n + 2.0).powi(2) + effective));
        let damping = 1.0 + 2.0 * (((effective - 1.0) / (n + 1.0)).sqrt() - 1.0).max(0.0) + rate_step;
        let expected = n.sqrt() * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));

        let old = self.mean.clone();
        let steps: Vec<DVector<f64>> = ranked
            .par_iter()
            .with_min_len(FEW)
            .map(|&x| (x - &old) / self.step)
            .collect();
        let mut shift = DVector::zeros(old.len());
        for (y, w) in steps.iter().zip(&weights) {
            shift.axpy(*w, y, 1.0);
        }
        self.mean = old + &shift * self.step;

        // Along the axes of the covariance, in standard deviations.
        let across = self.basis.transpose();
        let whiten = |step: &DVector<f64>| (&across * step).component_div(&self.scales);
        let whitened = &self.basis * whiten(&shift);
        self.step_path = &self.step_path * (1.0 - rate_step)
            + whitened * (rate_step * (2.0 - rate_step) * effective).sqrt();
        self.age += 1;
        let young = 1.0 - (1.0 - rate_step).powi(2 * self.age);
        let steady = self.step_path.norm() / young.sqrt() < (1.4 + 2.0 / (n + 1.0)) * expected;
        let heaviside = if steady { 1.0 } else { 0.0 };
        self.covariance_path = &self.covariance_path * (1.0 - rate_path)
            + shift * (heaviside * (rate_path * (2.0 - rate_path) * effective).sqrt());

        let unlearnt = if active {
            negative_weights(&raw[parents..], (n, effective), (rate_one, rate_many))
        } else {
            Vec::new()
        };
        let balance = 1.0 + unlearnt.iter().sum::<f64>();
        let kept = 1.0 - rate_one - rate_many * balance
            + (1.0 - heaviside) * rate_one * rate_path * (2.0 - rate_path);
        // The lengths of the steps that are unlearnt are evened out, which keeps the matrix positive.
        let lengths: Vec<f64> = steps[parents..]
            .par_iter()
            .zip(&unlearnt)
            .with_min_len(FEW)
            .map(|(y, _)| whiten(y).norm_squared())
            .collect();
        self.covariance *= kept;
        self.covariance
            .ger(rate_one, &self.covariance_path, &self.covariance_path, 1.0);
        for (y, w) in steps.iter().zip(&weights) {
            self.covariance.ger(rate_many * w, y, y, 1.0);
        }
        for ((y, w), length) in steps[parents..].iter().zip(&unlearnt).zip(lengths) {
            if length > 0.0 {
                self.covariance.ger(rate_many * w * n / length, y, y, 1.0);
            }
        }
        let growth = (rate_step / damping) * (self.step_path.norm() / expected - 1.0);
        self.step = (self.step * growth.min(1.0).exp()).min(1.0);

        let eigen = SymmetricEigen::new(self.covariance.clone());
        self.scales = eigen.eigenvalues.map(|v| v.max(LEAST_VARIANCE).sqrt());
        self.basis = eigen.eigenvectors;
    }
}

/// The weights of the worse part of a population, none positive (equations 50 to 53 of the tutorial).
fn negative_weights(raw: &[f64], (n, effective): (f64, f64), (rate_one, rate_many): (f64, f64)) -> Vec<f64> {
    let sum: f64 = raw.iter().map(|w| w.min(0.0)).sum();
    let squares: f64 = raw.iter().map(|w| w.min(0.0).powi(2)).sum();
    if sum == 0.0 {
        return vec![0.0; raw.len()];
    }
    let opposed = sum * sum / squares;
    let balanced = 1.0 + rate_one / rate_many;
    let mass = 1.0 + 2.0 * opposed / (effective + 2.0);
    let positive = (1.0 - rate_one - rate_many) / (n * rate_many);
    let total = balanced.min(mass).min(positive);
    raw.iter().map(|w| w.min(0.0) * total / -sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_of_more_figures_than_it_has_is_refused() {
        let none = || DVector::<f64>::zeros(0);
        let written = |rows: usize, columns: usize| {
            let covariance = (Vec::<f64>::new(), rows, columns);
            let basis = DMatrix::<f64>::zeros(0, 0);
            let parts = (none(), 0.1, covariance, basis, none(), none(), none(), 0i32);
            postcard::to_allocvec(&parts).expect("bytes")
        };
        let read = |bytes: &[u8]| postcard::from_bytes::<Distribution>(bytes).map(drop);
        read(&written(0, 0)).expect("an empty one");
        // Rows times columns are zero where they are counted in 64 bits.
        assert!(read(&written(1 << 63, 2)).is_err());
        assert!(read(&written(1 << 32, 1 << 32)).is_err());
        assert!(read(&written(2, 2)).is_err());
    }
}
