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
    /// Whether each parameter can be told by itself.
    pub identifiable: Vec<bool>,
    /// The parameters that cannot, in groups that the log cannot tell apart.
    pub groups: Vec<Group>,
    /// Standard deviation of the errors that remain, per channel.
    pub noise: [f64; CHANNELS],
    /// How far a step of least squares would move a parameter that can be told and stands free of its bounds, in its
    /// standard errors, at most: zero at a minimum. Standard errors are of the neighbourhood of a minimum.
    pub step_in_errors: f64,
    /// Whether the errors that remain look like noise, for which standard errors take them, or are mere rounding.
    pub looks_like_noise: bool,
}

/// Parameters none of which the log tells by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Their places among the free parameters.
    pub members: Vec<usize>,
    /// How many independent combinations of them the log tells.
    pub combinations_told: usize,
}

/// Singular values under this share of the greatest count as zero: the Jacobian's own rounding, about the square
/// root of its number of rows times the precision of a double, lies well below.
const ZERO: f64 = 1e-11;
/// A parameter with more than this share of itself in directions of zero cannot be told.
const NULL_SHARE: f64 = 1e-6;
/// Noise is taken for no less than this share of a channel's scale: the rounding of a simulated log's figures.
const LEAST_NOISE: f64 = 1e-10;

/// Correlation of two parameters from which on they belong to one group. A combination of `n` equal parts leaves its members
/// correlated by `1/(n - 1)`.
const GROUPED: f64 = 0.2;

/// Standard deviation of each channel's errors that are left by a fit of this many unknowns, at least a trace of its scale. A fit
/// takes a degree of freedom for each unknown, an equal share from each channel.
pub fn noise_of(errors: &[f64], scales: &[f64; CHANNELS], unknowns: usize) -> [f64; CHANNELS] {
    let unknowns = unknowns as f64 / CHANNELS as f64;
    let count = ((errors.len() / CHANNELS) as f64 - unknowns).max(1.0);
    std::array::from_fn(|k| {
        let squares: f64 = errors.iter().skip(k).step_by(CHANNELS).map(|e| e * e).sum();
        (squares / count).sqrt().max(LEAST_NOISE * scales[k])
    })
}

/// By what least squares weights the errors of each channel, one over the channel's unit; `errors` are row-major, one column for each
/// channel, and `scales` the channels' spreads. Of errors that look like noise it is one over the noise: the maximum
/// likelihood for white noise. Of others it is one over the scale, as the cost does. What the model lacks is no noise, and weights
/// from its size would lead away from the cost that was asked for, to the channels that happen to fit best.
pub fn weights_of(errors: &[f64], scales: &[f64; CHANNELS], unknowns: usize) -> [f64; CHANNELS] {
    let noise = noise_of(errors, scales, unknowns);
    if is_noise(errors, scales, &noise) {
        noise.map(|n| 1.0 / n)
    } else {
        scales.map(|s| 1.0 / s)
    }
}

/// Whether the errors look like noise, or are mere rounding.
fn is_noise(errors: &[f64], scales: &[f64; CHANNELS], noise: &[f64; CHANNELS]) -> bool {
    let at_rounding = (0..CHANNELS).all(|k| noise[k] <= LEAST_NOISE * scales[k]);
    at_rounding || looks_like_noise(errors)
}

/// A value this share of the range from a bound is at it, of the logarithms' range where both bounds are positive.
const AT_BOUND: f64 = 1e-3;

pub(super) fn at_bound(value: f64, bounds: [f64; 2]) -> bool {
    let [x, low, high] = [value, bounds[0], bounds[1]].map(|x| if bounds[0] > 0.0 { x.ln() } else { x });
    (x - low).min(high - x) <= AT_BOUND * (high - low)
}

/// Groups parameters that are correlated, directly or through others, by their covariance in that of a guess.
fn groups_of(covariance: &DMatrix<f64>, untold: &[usize]) -> Vec<Group> {
    let grouped = |a: usize, b: usize| {
        covariance[(a, b)].powi(2) > GROUPED * GROUPED * covariance[(a, a)] * covariance[(b, b)]
    };
    let mut left = untold.to_vec();
    let mut groups = Vec::new();
    while let Some(first) = left.first().copied() {
        let mut members = vec![first];
        let mut next = 0;
        left.remove(0);
        while next < members.len() {
            let (with, without): (Vec<usize>, Vec<usize>) =
                left.iter().partition(|&&other| grouped(members[next], other));
            members.extend(with);
            left = without;
            next += 1;
        }
        members.sort_unstable();
        // Half of a guess's variance is left of a combination that is told as well as it was guessed.
        let own = covariance.select_rows(&members).select_columns(&members);
        let combinations_told = own.symmetric_eigenvalues().iter().filter(|v| **v < 0.5).count();
        groups.push(Group {
            members,
            combinations_told,
        });
    }
    groups
}

/// Judges the parameters at a candidate with these residuals.
///
/// A parameter counts as not identifiable where the Jacobian is blind to it (a singular value of zero), or where
/// its standard error exceeds the standard deviation of a guess anywhere between its bounds (range / sqrt 12). Of parameters that
/// have the same effect, none may be identifiable and their combination known well: [`Identifiability::groups`] says so.
pub fn judge(
    residuals: &Residuals,
    variables: &[Variable],
    candidate: &[f64],
    scales: &[f64; CHANNELS],
) -> Identifiability {
    let d = variables.len();
    let noise = noise_of(&residuals.errors, scales, d);
    if residuals.errors.len() < d {
        // Fewer figures than unknowns: any of them may be anything.
        return Identifiability {
            singular_values: Vec::new(),
            standard_errors: vec![f64::INFINITY; d],
            identifiable: vec![false; d],
            groups: vec![Group {
                members: (0..d).collect(),
                combinations_told: 0,
            }],
            noise,
            step_in_errors: f64::INFINITY,
            looks_like_noise: false,
        };
    }
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
    // What is below the rounding of the decomposition is zero.
    let rounding = f64::EPSILON * d as f64 * greatest;
    let exact = |value: &f64| if *value > rounding { *value } else { 0.0 };
    let mut singular_values: Vec<f64> = values.iter().map(exact).collect();
    singular_values.sort_by(|a, b| b.total_cmp(a));
    let identifiable: Vec<bool> = (0..d)
        .map(|k| standard_errors[k] < ranges[k] / 12f64.sqrt())
        .collect();
    // What is known of the parameters after the log, of a guess anywhere between their bounds before it.
    let guess = 12.0;
    let known = DMatrix::from_fn(d, d, |a, b| {
        let parts = (0..d).map(|j| vectors[(j, a)] * vectors[(j, b)] / (values[j].powi(2) + guess));
        parts.sum::<f64>()
    });
    let untold: Vec<usize> = (0..d).filter(|&k| !identifiable[k]).collect();
    let groups = groups_of(&(known * guess), &untold);
    let free: Vec<usize> = (0..d)
        .filter(|&k| identifiable[k] && !at_bound(candidate[k], [variables[k].lower, variables[k].upper]))
        .collect();
    // The step is that of the least squares that fitted the car, with its weights.
    let weights = weights_of(&residuals.errors, scales, d);
    let weighted = DMatrix::from_fn(residuals.errors.len(), free.len(), |i, k| {
        residuals.columns[free[k]][i] * weights[i % CHANNELS] * ranges[free[k]]
    });
    let factors = weighted.qr();
    let mut wanted = DVector::from_fn(residuals.errors.len(), |i, _| {
        residuals.errors[i] * weights[i % CHANNELS]
    });
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
    Identifiability {
        identifiable,
        groups,
        standard_errors,
        singular_values,
        noise,
        step_in_errors,
        looks_like_noise: is_noise(&residuals.errors, scales, &noise),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    const ROWS: usize = 50;

    /// Errors of these noises, and columns for unknowns of which each row's derivative is a draw.
    fn residuals(unknowns: usize) -> Residuals {
        let random = Random::new(5);
        let draws = |purpose: u32| -> Vec<f64> {
            let rows = 0..(ROWS * CHANNELS) as u32;
            rows.map(|i| random.normal(purpose, 0, i, 0)).collect()
        };
        Residuals {
            errors: draws(100),
            columns: (0..unknowns as u32).map(draws).collect(),
        }
    }

    fn variables(count: usize) -> Vec<Variable> {
        let variable = |k: usize| Variable {
            name: format!("x{k}"),
            unit: "-".to_owned(),
            lower: -1.0,
            upper: 1.0,
            whole: false,
        };
        (0..count).map(variable).collect()
    }

    fn judged(residuals: &Residuals) -> Identifiability {
        let count = residuals.columns.len();
        judge(residuals, &variables(count), &vec![0.0; count], &[1.0; CHANNELS])
    }

    #[test]
    fn a_fit_takes_a_degree_of_freedom_for_each_unknown() {
        // Eight rows of ones, of which sixteen unknowns take four from each channel.
        let noise = noise_of(&[1.0; 8 * CHANNELS], &[1.0; CHANNELS], 16);
        assert_eq!(noise, [2f64.sqrt(); CHANNELS]);
        // Least squares leaves the noise's own size over by that count: the mean over many draws of a fit of one unknown to two
        // rows of each channel.
        let random = Random::new(8);
        let (mut squares, draws) = (0.0, 4000);
        for draw in 0..draws {
            let normal = |purpose: u32, i: usize| random.normal(purpose, draw, i as u32, 0);
            let rows = 2 * CHANNELS;
            let column: Vec<f64> = (0..rows).map(|i| normal(1, i)).collect();
            let noise: Vec<f64> = (0..rows).map(|i| normal(2, i)).collect();
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let fitted = dot(&column, &noise) / dot(&column, &column);
            let left: Vec<f64> = noise.iter().zip(&column).map(|(n, c)| n - fitted * c).collect();
            let found = noise_of(&left, &[1.0; CHANNELS], 1);
            squares += found.iter().map(|n| n * n).sum::<f64>() / CHANNELS as f64;
        }
        // Its standard error is sqrt(2/7)/sqrt(4000), 0.8 %; that of division by all rows would be off by 12 %.
        assert!((squares / f64::from(draws) - 1.0).abs() < 0.03);
    }

    #[test]
    fn what_the_model_lacks_is_no_noise_to_weight_by() {
        let scales = [1.0, 2.0, 3.0, 4.0];
        let noise = residuals(0).errors;
        let weights = weights_of(&noise, &scales, 0);
        assert_eq!(weights, noise_of(&noise, &scales, 0).map(|n| 1.0 / n));
        let smooth: Vec<f64> = (0..ROWS * CHANNELS).map(|i| (0.01 * i as f64).sin()).collect();
        assert_eq!(weights_of(&smooth, &scales, 0), scales.map(|s| 1.0 / s));
    }

    #[test]
    fn parameters_of_the_same_effect_are_judged_together() {
        let mut residuals = residuals(6);
        // The second stands in for the first, the fourth and the fifth for the third; the sixth does nothing.
        residuals.columns[1] = residuals.columns[0].clone();
        residuals.columns[3] = residuals.columns[2].clone();
        residuals.columns[4] = residuals.columns[2].iter().map(|x| -x).collect();
        residuals.columns[5] = vec![0.0; residuals.errors.len()];
        let verdict = judged(&residuals);
        assert_eq!(verdict.identifiable, [false; 6]);
        let group = |members: &[usize], combinations_told| Group {
            members: members.to_vec(),
            combinations_told,
        };
        assert_eq!(
            verdict.groups,
            [group(&[0, 1], 1), group(&[2, 3, 4], 1), group(&[5], 0)]
        );

        residuals.columns.truncate(3);
        residuals.columns.remove(1);
        let verdict = judged(&residuals);
        assert!(verdict.identifiable == [true; 2] && verdict.groups.is_empty());
    }
}
