//! Whether a sample lies above a figure by more than chance.

/// The probability that a sample symmetric about `figure` lies as far above it as `values` do: the one-sided
/// signed-rank test (Wilcoxon, *Individual comparisons by ranking methods*, Biometrics Bulletin 1, 1945), exact,
/// for up to 60 values. Values equal to the figure are left out, ties share their ranks. `None` if nothing is left
/// or there are too many.
pub fn signed_rank(values: &[f64], figure: f64) -> Option<f64> {
    let mut gaps: Vec<f64> = values.iter().map(|x| x - figure).filter(|g| *g != 0.0).collect();
    let n = gaps.len();
    if n == 0 || n > 60 || gaps.iter().any(|g| !g.is_finite()) {
        return None;
    }
    gaps.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    // Twice the ranks, so that shared ones are whole.
    let mut ranks = vec![0usize; n];
    let mut from = 0;
    while from < n {
        let same = gaps[from..]
            .iter()
            .take_while(|g| g.abs() == gaps[from].abs())
            .count();
        ranks[from..from + same].fill(2 * from + same + 1);
        from += same;
    }
    let above: usize = gaps
        .iter()
        .zip(&ranks)
        .filter(|(g, _)| **g > 0.0)
        .map(|(_, r)| r)
        .sum();
    // Of all 2^n choices of signs, how many give each sum.
    let mut ways = vec![0u64; n * (n + 1) + 1];
    ways[0] = 1;
    for r in ranks {
        for sum in (r..ways.len()).rev() {
            ways[sum] += ways[sum - r];
        }
    }
    let as_far: u64 = ways[above..].iter().sum();
    Some(as_far as f64 / 2f64.powi(n as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All choices of signs counted by hand.
    #[test]
    fn by_hand() {
        // Of 2^3 only the choice with all above reaches 6; with the least below, also the whole: 5 and 6.
        assert_eq!(signed_rank(&[1.0, 2.0, 3.0], 0.0), Some(1.0 / 8.0));
        assert_eq!(signed_rank(&[-1.0, 2.0, 3.0], 0.0), Some(2.0 / 8.0));
        assert_eq!(signed_rank(&[-1.0, -2.0, -3.0], 0.0), Some(1.0));
        // Two equal ranks of 1.5: sums 0, 1.5, 1.5, 3.
        assert_eq!(signed_rank(&[1.0, -1.0, 0.0], 0.0), Some(3.0 / 4.0));
        assert_eq!(signed_rank(&[5.0], 5.0), None);
    }
}
