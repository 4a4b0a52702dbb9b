//! Fewer points that look alike.

/// Points of a trace that go into a page at most: more than a screen has columns, so that a zoom still shows more.
pub(in crate::report) const POINTS: usize = 3000;

/// Which of the points to draw so that all series over a common axis look as they did: in each of `limit` buckets the one
/// that spans the largest triangles with its neighbours, taken over all series (Steinarsson, *Downsampling Time Series
/// for Visual Representation*, 2013, there for one series). The ends of gaps are kept.
pub(in crate::report) fn thinned(x: &[f64], series: &[&[f64]], limit: usize) -> Vec<usize> {
    let n = x.len();
    if n <= limit || limit < 3 {
        return (0..n).collect();
    }
    let scales: Vec<f64> = series.iter().map(|s| 1.0 / spread(s)).collect();
    let finite = |i: usize, s: &&[f64]| s.get(i).is_some_and(|v| v.is_finite());
    let buckets = limit - 2;
    let start = |bucket: usize| 1 + bucket * (n - 2) / buckets;
    let mut kept = vec![0];
    let mut last = 0;
    for bucket in 0..buckets {
        let (from, to) = (start(bucket), start(bucket + 1));
        // The middle of the next bucket, or the last point, stands for what comes after.
        let next = if bucket + 1 < buckets {
            (start(bucket + 1) + start(bucket + 2)) / 2
        } else {
            n - 1
        };
        let area = |i: usize| -> f64 {
            let of = |(s, scale): (&&[f64], &f64)| {
                if finite(i, s) && finite(last, s) && finite(next, s) {
                    let across = (x[last] - x[next]) * (s[i] - s[last]);
                    let up = (x[last] - x[i]) * (s[next] - s[last]);
                    (across - up).abs() * scale
                } else {
                    0.0
                }
            };
            series.iter().zip(&scales).map(of).sum()
        };
        let chosen = (from..to).max_by(|&a, &b| area(a).total_cmp(&area(b)));
        if let Some(chosen) = chosen {
            kept.push(chosen);
            last = chosen;
        }
    }
    kept.push(n - 1);
    let gap_ends = (1..n).filter(|&i| series.iter().any(|s| finite(i, s) != finite(i - 1, s)));
    let gap_ends: Vec<usize> = gap_ends.flat_map(|i| [i - 1, i]).collect();
    // A channel that drops out all the time would bring back every point.
    if gap_ends.len() <= limit / 4 {
        kept.extend(gap_ends);
        kept.sort_unstable();
        kept.dedup();
    }
    kept
}

fn spread(values: &[f64]) -> f64 {
    let finite = || values.iter().copied().filter(|v| v.is_finite());
    let least = finite().fold(f64::INFINITY, f64::min);
    let range = finite().fold(f64::NEG_INFINITY, f64::max) - least;
    if range > 0.0 { range } else { 1.0 }
}

/// The chosen entries of `values`.
pub(in crate::report) fn picked<T: Copy>(values: &[T], which: &[usize]) -> Vec<T> {
    which.iter().filter_map(|&i| values.get(i).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_ends_and_gaps_survive() {
        let n = 14_000;
        let x: Vec<f64> = (0..n).map(f64::from).collect();
        let mut spiky: Vec<f64> = x.iter().map(|v| (v * 0.001).sin()).collect();
        spiky[7001] = 3.0;
        let mut broken: Vec<f64> = x.iter().map(|v| (v * 0.0007).cos()).collect();
        broken[9000..9003].fill(f64::NAN);
        let kept = thinned(&x, &[&spiky, &broken], 1000);
        assert!(kept.len() <= 1004, "{}", kept.len());
        assert!(kept.windows(2).all(|w| w[0] < w[1]));
        for expected in [0, 7001, 8999, 9000, 9002, 9003, 13_999] {
            assert!(kept.contains(&expected), "{expected}");
        }
        assert_eq!(thinned(&x[..500], &[&spiky[..500]], 1000).len(), 500);
    }
}
