//! What the log can and cannot tell about each parameter, from the Jacobian at the solution.

use super::hops::looks_like_noise;
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
    /// How far a step of least squares would move a parameter that can be told and stands free of its bounds, in its
    /// standard errors, at most: zero at a minimum. Standard errors are of the neighbourhood of a minimum.
    pub step_in_errors: f64,
    /// Whether the errors that remain look like noise, for which standard errors take them, or are mere rounding.
    pub looks_like_noise: bool,
}

/// Singular values under this share of the greatest count as zero: the Jacobian's own rounding, about the square
/// root of its number of rows times the precision of a double, lies well below.
const ZERO: f64 = 1e-11;
/// A parameter with more than this share of itself in directions of zero cannot be told.
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

/// A value this share of the range from a bound is at it, of the logarithms' range where both bounds are positive.
const AT_BOUND: f64 = 1e-3;

pub(super) fn at_bound(value: f64, bounds: [f64; 2]) -> bool {
    let [x, low, high] = [value, bounds[0], bounds[1]].map(|x| if bounds[0] > 0.0 { x.ln() } else { x });
    (x - low).min(high - x) <= AT_BOUND * (high - low)
}

/// Judges the parameters at a candidate with these residuals.
///
/// A parameter counts as not identifiable where the Jacobian is blind to it (a singular value of zero), or where
/// its standard error exceeds the standard deviation of a guess anywhere between its bounds (range / sqrt 12).
pub fn judge(
    residuals: &Residuals,
    variables: &[Variable],
    candidate: &[f64],
    scales: &[f64; CHANNELS],
) -> Identifiability {
    let noise = noise_of(&residuals.errors, scales);
    let d = variables.len();
    if residuals.errors.len() < d {
        // Fewer figures than unknowns: any of them may be anything.
        return Identifiability {
            singular_values: Vec::new(),
            standard_errors: vec![f64::INFINITY; d],
            identifiable: vec![false; d],
            noise,
            step_in_errors: f64::INFINITY,
            looks_like_noise: false,
        };
    }
    let ranges: Vec<f64> = variables.iter().map(|v| v.upper - v.lower).collect();
    let matrix = DMatrix::from_fn(residuals.errors.len(), d, |i, k| {
        residuals.columns[k][i] / noise[i % CHANNELS] * ranges[k]
    });
    let errors = DVector::from_fn(residuals.errors.len(), |i, _| {
        residuals.errors[i] / noise[i % CHANNELS]
    });
    // The triangular factor has the singular values and right vectors of the whole, and is small.
    let svd = matrix.clone().qr().r().svd(false, true);
    let values = svd.singular_values;
    let vectors = svd.v_t.unwrap_or_else(|| DMatrix::identity(d, d));
    let greatest = values.iter().copied().fold(0.0, f64::max);
    let mut variance = DVector::<f64>::zeros(d);
    let mut null_share = DVector::<f64>::zeros(d);
    for (j, value) in values.iter().enumerate() {
        for k in 0..d {
            let share = vectors[(j, k)].powi(2);
            if *value > ZERO * greatest {
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
    let identifiable: Vec<bool> = (0..d)
        .map(|k| standard_errors[k] < ranges[k] / 12f64.sqrt())
        .collect();
    let free: Vec<usize> = (0..d)
        .filter(|&k| identifiable[k] && !at_bound(candidate[k], [variables[k].lower, variables[k].upper]))
        .collect();
    let factors = matrix.select_columns(&free).qr();
    let mut wanted = errors;
    factors.q_tr_mul(&mut wanted);
    let step = factors
        .r()
        .solve_upper_triangular(&wanted.rows(0, free.len()).into_owned());
    let step_in_errors = step.map_or(f64::INFINITY, |step| {
        free.iter()
            .zip(step.iter())
            .map(|(&k, s)| (s * ranges[k] / standard_errors[k]).abs())
            .fold(0.0, f64::max)
    });
    let at_rounding = (0..CHANNELS).all(|k| noise[k] <= LEAST_NOISE * scales[k]);
    Identifiability {
        identifiable,
        standard_errors,
        singular_values,
        noise,
        step_in_errors,
        looks_like_noise: at_rounding || looks_like_noise(&residuals.errors),
    }
}
