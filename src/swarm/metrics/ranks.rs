//! Which front of a set each point is in.

use super::non_dominated::{by_last, dominates};
use super::staircase::Staircase;

/// The number of the front that each point is in: zero for those that no other dominates, one for those that no other
/// dominates once these are gone, and so on \[5, 6\]. Equal points are in the same front; rows with a number that is not
/// finite are in one of their own after all others. `O(n log n log k)` for up to three objectives and `k` fronts,
/// `O(n^2)` at worst beyond.
pub fn ranks(points: &[Vec<f64>]) -> Vec<usize> {
    let finite = |i: &usize| points[*i].iter().all(|x| x.is_finite());
    let mut order: Vec<usize> = (0..points.len()).filter(finite).collect();
    order.sort_by(by_last(points));
    let width = order.first().map_or(0, |&i| points[i].len());
    let mut ranks = vec![usize::MAX; points.len()];
    let mut fronts: Vec<SortedFront> = Vec::new();
    let mut last: Option<usize> = None;
    for i in order {
        // What equals a point comes right after it.
        let rank = match last.filter(|&j| points[j] == points[i]) {
            Some(j) => ranks[j],
            None => {
                // Whatever a front dominates, so do all fronts before it.
                let rank = fronts.partition_point(|front| front.beats(points, width, i));
                if rank == fronts.len() {
                    fronts.push(SortedFront::default());
                }
                fronts[rank].insert(points, width, i);
                rank
            }
        };
        ranks[i] = rank;
        last = Some(i);
    }
    for rank in &mut ranks {
        *rank = (*rank).min(fronts.len());
    }
    ranks
}

/// A front that is told its points by their last objective.
#[derive(Default)]
struct SortedFront {
    stairs: Staircase,
    /// Instead of the stairs, for more than three objectives.
    members: Vec<usize>,
}

fn place(point: &[f64], width: usize) -> (f64, f64) {
    let at = |k: usize| if k + 1 < width { point[k] } else { 0.0 };
    (at(0), at(1))
}

impl SortedFront {
    /// Whether it dominates a point that comes later and equals none of it.
    fn beats(&self, points: &[Vec<f64>], width: usize, i: usize) -> bool {
        if width <= 3 {
            let (x, y) = place(&points[i], width);
            return self.stairs.covers(x, y);
        }
        // The latest are the nearest.
        let mut members = self.members.iter().rev();
        members.any(|&j| dominates(&points[j], &points[i]))
    }

    fn insert(&mut self, points: &[Vec<f64>], width: usize, i: usize) {
        if width <= 3 {
            let corner = (f64::INFINITY, f64::INFINITY);
            self.stairs.insert(place(&points[i], width), corner);
        } else {
            self.members.push(i);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::swarm::metrics::non_dominated;

    /// Front after front taken away, of points on a coarse grid with many ties.
    #[test]
    fn fronts_peel_off() {
        let random = Random::new(12);
        for case in 0..300 {
            let width = 1 + case % 5;
            let count = random.below(80, 1, case, 0, 0) as u32;
            let draw = |i: u32, k: u32| random.below(7, 2, case, i, k) as f64 - 3.0;
            let points: Vec<Vec<f64>> = (0..count)
                .map(|i| (0..width).map(|k| draw(i, k)).collect())
                .collect();
            let found = ranks(&points);
            let mut left = points.clone();
            for rank in 0.. {
                if left.is_empty() {
                    break;
                }
                let front: Vec<Vec<f64>> = non_dominated(&left)
                    .into_iter()
                    .map(|i| left[i].clone())
                    .collect();
                left.retain(|p| !front.contains(p));
                for (point, found) in points.iter().zip(&found) {
                    assert_eq!(front.contains(point), *found == rank, "{points:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_no_number_comes_last() {
        let points = vec![
            vec![f64::NAN, 0.0],
            vec![1.0, 1.0],
            vec![2.0, 1.0],
            vec![2.0, 2.0],
        ];
        assert_eq!(ranks(&points), [3, 0, 1, 2]);
        assert!(ranks(&[]).is_empty());
    }
}
