//! Variance-based sensitivity indices.
//!
//! First-order indices after A. Saltelli et al., *Variance based sensitivity analysis of model output*, Comput. Phys.
//! Commun. 181 (2010), table 2 (b); total indices after M. J. W. Jansen, *Analysis of variance designs for model
//! output*, Comput. Phys. Commun. 117 (1999). Intervals by the bootstrap (B. Efron and R. Tibshirani, *An Introduction to
//! the Bootstrap*, 1993, ch. 13).

use crate::random::Random;

/// What of an output's variance comes from one variable.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SobolIndex {
    /// By the variable alone.
    pub first: f64,
    /// 95% interval of that.
    pub first_interval: [f64; 2],
    /// By the variable and all that it acts together with.
    pub total: f64,
    /// 95% interval of that.
    pub total_interval: [f64; 2],
}

/// Outputs of a Saltelli design of `n` base samples.
#[derive(Clone, Debug, Default)]
pub struct DesignOutputs {
    /// `n` outputs of the first sample matrix.
    pub a: Vec<f64>,
    /// `n` outputs of the second.
    pub b: Vec<f64>,
    /// For each variable, `n` outputs of the first matrix with that variable's column from the second.
    pub ab: Vec<Vec<f64>>,
}

/// Purpose of the draws of resamples in the counter.
const RESAMPLE: u32 = 0x50b0;

/// The rows of a Saltelli design over the unit cube: `n (d + 2)` of `dimensions` numbers from zero to one, the first
/// matrix, the second, then the mixed one of each variable. From an Owen-scrambled Sobol sequence.
pub fn design(dimensions: usize, n: usize, seed: u64) -> Vec<f64> {
    let seed = (seed ^ (seed >> 32)) as u32;
    let point = |row: usize, column: usize| {
        // The sequence has 256 dimensions; a design needs two for each variable.
        f64::from(sobol_burley::sample(row as u32, column as u32, seed))
    };
    let mut rows = Vec::with_capacity(n * (dimensions + 2) * dimensions);
    for mixed in 0..dimensions + 2 {
        for row in 0..n {
            rows.extend((0..dimensions).map(|k| {
                let second = mixed == 1 || mixed == k + 2;
                point(row, if second { dimensions + k } else { k })
            }));
        }
    }
    rows
}

/// Most variables of a [`design`].
pub const MOST_VARIABLES: usize = 128;
/// Most base samples of a [`design`].
pub const MOST_SAMPLES: usize = 1 << 16;

/// The indices of every variable; an output that never varies has none of either kind.
pub fn indices(outputs: &DesignOutputs, resamples: usize, seed: u64) -> Vec<SobolIndex> {
    let n = outputs.a.len();
    let all: Vec<usize> = (0..n).collect();
    let random = Random::new(seed);
    let samples: Vec<Vec<usize>> = (0..resamples as u32)
        .map(|r| {
            (0..n as u32)
                .map(|i| random.below(n, RESAMPLE, r, i, 0))
                .collect()
        })
        .collect();
    (0..outputs.ab.len())
        .map(|k| {
            let (first, total) = estimate(outputs, k, &all);
            let (mut firsts, mut totals): (Vec<f64>, Vec<f64>) =
                samples.iter().map(|rows| estimate(outputs, k, rows)).unzip();
            SobolIndex {
                first,
                first_interval: interval(&mut firsts, first),
                total,
                total_interval: interval(&mut totals, total),
            }
        })
        .collect()
}

/// First and total index of variable `k` over some of the rows.
fn estimate(outputs: &DesignOutputs, k: usize, rows: &[usize]) -> (f64, f64) {
    let (a, b, ab) = (&outputs.a, &outputs.b, &outputs.ab[k]);
    let n = rows.len() as f64;
    let mean = rows.iter().map(|i| a[*i] + b[*i]).sum::<f64>() / (2.0 * n);
    let variance = rows
        .iter()
        .map(|i| (a[*i] - mean).powi(2) + (b[*i] - mean).powi(2))
        .sum::<f64>()
        / (2.0 * n);
    if variance.is_nan() || variance <= 0.0 {
        return (0.0, 0.0);
    }
    // Taking the mean off changes nothing of the estimate's expectation and much of its spread.
    let first = rows
        .iter()
        .map(|i| (b[*i] - mean) * (ab[*i] - a[*i]))
        .sum::<f64>()
        / n;
    let total = rows.iter().map(|i| (a[*i] - ab[*i]).powi(2)).sum::<f64>() / (2.0 * n);
    (first / variance, total / variance)
}

/// The middle 95% of some figures; the figure itself where there are none.
fn interval(figures: &mut [f64], alone: f64) -> [f64; 2] {
    if figures.is_empty() {
        return [alone, alone];
    }
    figures.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| figures[((figures.len() - 1) as f64 * share).round() as usize];
    [at(0.025), at(0.975)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn evaluated(dimensions: usize, n: usize, f: impl Fn(&[f64]) -> f64) -> DesignOutputs {
        let y: Vec<f64> = design(dimensions, n, 3).chunks_exact(dimensions).map(f).collect();
        let mut parts = y.chunks_exact(n).map(<[f64]>::to_vec);
        DesignOutputs {
            a: parts.next().expect("the first matrix"),
            b: parts.next().expect("the second"),
            ab: parts.collect(),
        }
    }

    /// The function of T. Ishigami and T. Homma (1990), whose indices are known in closed form.
    #[test]
    fn the_indices_of_ishigami() {
        let n = 4096;
        let outputs = evaluated(3, n, |u| {
            let x: Vec<f64> = u.iter().map(|u| PI * (2.0 * u - 1.0)).collect();
            x[0].sin() + 7.0 * x[1].sin().powi(2) + 0.1 * x[2].powi(4) * x[0].sin()
        });
        let (a, b) = (7.0f64, 0.1f64);
        let (v1, v2) = (0.5 * (1.0 + b * PI.powi(4) / 5.0).powi(2), a * a / 8.0);
        let v13 = b * b * PI.powi(8) * (1.0 / 18.0 - 1.0 / 50.0);
        let v = v1 + v2 + v13;
        let exact = [(v1 / v, (v1 + v13) / v), (v2 / v, v2 / v), (0.0, v13 / v)];
        let found = indices(&outputs, 200, 1);
        for (found, (first, total)) in found.iter().zip(exact) {
            // Plain sampling of 4096 rows has a standard error of about 1/64; a Sobol sequence does better.
            assert!((found.first - first).abs() < 1.0 / 64.0, "{found:?}, {first}");
            assert!((found.total - total).abs() < 1.0 / 64.0, "{found:?}, {total}");
            assert!(found.first_interval[0] <= found.first && found.first <= found.first_interval[1]);
            assert!(found.total_interval[0] <= found.total && found.total <= found.total_interval[1]);
        }
    }

    #[test]
    fn a_sum_has_no_interactions_and_a_constant_no_indices() {
        let outputs = evaluated(2, 1024, |u| u[0] + 2.0 * u[1]);
        let found = indices(&outputs, 50, 1);
        for (found, share) in found.iter().zip([0.2, 0.8]) {
            assert!(
                (found.first - share).abs() < 0.02 && (found.total - share).abs() < 0.02,
                "{found:?}"
            );
        }
        let flat = indices(&evaluated(2, 64, |_| 3.0), 10, 1);
        assert!(flat.iter().all(|i| i.first == 0.0 && i.total == 0.0));
    }
}
