//! What the log can and cannot tell about each parameter, from the Jacobian at the solution.

use super::setup::CHANNELS;
use crate::evaluate::Variable;
use crate::evaluate::replay::Residuals;
use nalgebra::{DMatrix, DVector};

/// What the log says of the free parameters.
#[derive(Clone, Debug)]
pub struct Identifiability {
    /// Singular values of the Jacobian, greatest first; rows in standard deviations of the noise, columns in
    /// ranges of the bounds.
    pub singular_values: Vec<f64>,
    /// Standard error of each parameter by the Cramer-Rao bound for white noise, in its unit; infinite where the
    /// log says nothing.
    pub standard_errors: Vec<f64>,
    /// Whether each parameter can be told at all.
    pub identifiable: Vec<bool>,
    /// Standard deviation of the errors that remain, per channel.
    pub noise: [f64; CHANNELS],
}

/// Singular values under this share of the greatest count as nought: the Jacobian's own rounding, about the square
/// root of its number of rows times the precision of a double, lies well below.
const NOUGHT: f64 = 1e-11;
/// A parameter with more than this share of itself in directions of nought cannot be told.
const NULL_SHARE: f64 = 1e-6;
/// Noise is taken for no less than this share of a channel's scale: the rounding of a simulated log's figures.
const LEAST_NOISE: f64 = 1e-10;

/// Standard deviation of each channel's errors, at least a trace of its scale.
pub fn noise_of(errors: &[f64], scales: &[f64; CHANNELS]) -> [f64; CHANNELS] {
    let count = (errors.len() / CHANNELS).max(1) as f64;
    std::array::from_fn(|k| {
        let squares: f64 = errors.iter().skip(k).step_by(CHANNELS).map(|e| e * e).sum();
        (squares / count).sqrt().max(LEAST_NOISE * scales[k])
    })
}

/// Judges the parameters at a solution with these residuals.
///
/// A parameter counts as not identifiable where the Jacobian is blind to it (a singular value of nought), or where
/// its standard error exceeds the standard deviation of a guess anywhere between its bounds (range / sqrt 12).
pub fn judge(residuals: &Residuals, variables: &[Variable], scales: &[f64; CHANNELS]) -> Identifiability {
    let noise = noise_of(&residuals.errors, scales);
    let d = variables.len();
    let ranges: Vec<f64> = variables.iter().map(|v| v.upper - v.lower).collect();
    let matrix = DMatrix::from_fn(residuals.errors.len(), d, |i, k| {
        residuals.columns[k][i] / noise[i % CHANNELS] * ranges[k]
    });
    // The triangular factor has the singular values and right vectors of the whole, and is small.
    let svd = matrix.qr().r().svd(false, true);
    let values = svd.singular_values;
    let vectors = svd.v_t.unwrap_or_else(|| DMatrix::identity(d, d));
    let greatest = values.iter().copied().fold(0.0, f64::max);
    let mut variance = DVector::<f64>::zeros(d);
    let mut null_share = DVector::<f64>::zeros(d);
    for (j, value) in values.iter().enumerate() {
        for k in 0..d {
            let share = vectors[(j, k)].powi(2);
            if *value > NOUGHT * greatest {
                variance[k] += share / (value * value);
            } else {
                null_share[k] += share;
            }
        }
    }
    let blind = |k: usize| null_share[k] > NULL_SHARE || ranges[k] == 0.0;
    let standard_errors: Vec<f64> = (0..d)
        .map(|k| {
            if blind(k) {
                f64::INFINITY
            } else {
                ranges[k] * variance[k].sqrt()
            }
        })
        .collect();
    let mut singular_values: Vec<f64> = values.iter().copied().collect();
    singular_values.sort_by(|a, b| b.total_cmp(a));
    Identifiability {
        identifiable: (0..d)
            .map(|k| standard_errors[k] < ranges[k] / 12f64.sqrt())
            .collect(),
        standard_errors,
        singular_values,
        noise,
    }
}
