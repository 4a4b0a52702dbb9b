//! Which points of a set no other dominates.

use super::staircase::Staircase;
use std::cmp::Ordering;

/// Whether `a` is at least as good as `b` in every objective and better in one.
pub fn dominates(a: &[f64], b: &[f64]) -> bool {
    let mut better = false;
    for (x, y) in a.iter().zip(b) {
        if x > y {
            return false;
        }
        better |= x < y;
    }
    better
}

/// Indices of the points that no other dominates, ascending; of equal points the first. `O(n log n)` for up to
/// three objectives \[5\], `O(n m)` for a front of `m` beyond. Rows with a number that is not finite are left
/// out.
pub fn non_dominated(points: &[Vec<f64>]) -> Vec<usize> {
    let finite = |i: &usize| points[*i].iter().all(|x| x.is_finite());
    let mut order: Vec<usize> = (0..points.len()).filter(finite).collect();
    let width = order.first().map_or(0, |&i| points[i].len());
    order.sort_by(by_last(points));
    let mut front = Vec::new();
    match width {
        0 => front.extend(order.first()),
        1..=3 => {
            let mut stairs = Staircase::default();
            for i in order {
                let p = &points[i];
                let (x, y) = (p[0], if width == 3 { p[1] } else { 0.0 });
                if !stairs.covers(x, y) {
                    stairs.insert((x, y), (f64::INFINITY, f64::INFINITY));
                    front.push(i);
                }
            }
        }
        _ => {
            for i in order {
                let beaten = |&j: &usize| points[j] == points[i] || dominates(&points[j], &points[i]);
                if !front.iter().any(beaten) {
                    front.push(i);
                }
            }
        }
    }
    front.sort_unstable();
    front
}

/// The order by the last objective, then by the one before and so on, then by place: whatever dominates a point, or equals
/// it and came first, comes before it.
pub(super) fn by_last(points: &[Vec<f64>]) -> impl Fn(&usize, &usize) -> Ordering {
    |&a, &b| {
        let (p, q) = (&points[a], &points[b]);
        let unequal = p
            .iter()
            .zip(q)
            .rev()
            .map(|(x, y)| x.partial_cmp(y).unwrap_or(Ordering::Equal));
        unequal.fold(Ordering::Equal, Ordering::then).then(a.cmp(&b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn brute_force() {
        let random = Random::new(9);
        for case in 0..300 {
            let width = 1 + case % 4;
            let count = random.below(60, 1, case, 0, 0) as u32;
            let points: Vec<Vec<f64>> = (0..count)
                .map(|i| {
                    (0..width)
                        .map(|k| random.below(9, 2, case, i, k) as f64 - 4.0)
                        .collect()
                })
                .collect();
            let expected: Vec<usize> = (0..points.len())
                .filter(|&i| {
                    !points.iter().any(|q| dominates(q, &points[i])) && !points[..i].contains(&points[i])
                })
                .collect();
            assert_eq!(non_dominated(&points), expected, "{points:?}");
        }
    }

    #[test]
    fn leaves_out_what_is_no_number() {
        let points = vec![vec![f64::NAN, 0.0], vec![1.0, 1.0], vec![f64::NEG_INFINITY, 0.0]];
        assert_eq!(non_dominated(&points), [1]);
    }
}
