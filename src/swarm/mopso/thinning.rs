//! Thinning a front that is far larger than the archive: the best point of each of a number of boxes.
//!
//! The points are divided in two, again and again, until there are as many boxes as points are wanted. By turns the box
//! is divided that is the longest, as a share of the front's ranges, and the one of the greatest volume. The long ones
//! cover the front evenly, however few points lie there. The volumes follow what the front dominates: a point that stands
//! for a box gives up at the most the box's volume, and a few members far out do not change the volumes of the others.
//! A truncation in a few rounds of crowding gets worse as the swarm grows; the best of some [`PER_PLACE`] boxes per
//! place, from which members are then deleted one at a time, does not.

use super::filter::Point;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Boxes for each place in the archive.
pub const PER_PLACE: usize = 4;

/// Points that follow one another, and the box about them.
#[derive(Clone, Copy)]
struct Leaf {
    from: usize,
    to: usize,
    low: [f64; 3],
    high: [f64; 3],
}

impl Leaf {
    fn of(points: &[Point], from: usize, to: usize) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in &points[from..to] {
            for k in 0..3 {
                low[k] = low[k].min(p.at[k]);
                high[k] = high[k].max(p.at[k]);
            }
        }
        Self { from, to, low, high }
    }

    fn extent(&self, k: usize) -> f64 {
        self.high[k] - self.low[k]
    }

    /// The objective along which the box is longest, as a share of `whole`, and that share.
    fn longest(&self, whole: &Self, width: usize) -> (usize, f64) {
        let mut longest = (0, 0.0);
        for k in 0..width {
            let share = self.extent(k) / whole.extent(k);
            if share > longest.1 {
                longest = (k, share);
            }
        }
        longest
    }

    /// Puts the points of the lower half along objective `k` first; returns where the upper half begins. Both have points.
    fn divide(&self, points: &mut [Point], k: usize) -> usize {
        let middle = (0.5 * self.low[k] + 0.5 * self.high[k]).max(self.low[k]);
        let mut next = self.from;
        for i in self.from..self.to {
            let x = points[i].at[k];
            if x <= middle && x < self.high[k] {
                points.swap(i, next);
                next += 1;
            }
        }
        next
    }

    /// The point nearest the box's best corner, as shares of the box.
    fn best(&self, points: &[Point], width: usize) -> Option<Point> {
        let sum = |p: &Point| -> f64 {
            let along = (0..width).filter(|&k| self.extent(k) > 0.0);
            along.map(|k| (p.at[k] - self.low[k]) / self.extent(k)).sum()
        };
        let order = |a: &&Point, b: &&Point| sum(a).total_cmp(&sum(b)).then(a.who.cmp(&b.who));
        points[self.from..self.to].iter().min_by(order).copied()
    }
}

/// At most `wanted` of the points of a front, by number of the particle; the best in each objective are among them. Points
/// beyond `reference`, where one is given, are left out if others are not.
pub fn thinned(mut front: Vec<Point>, width: usize, wanted: usize, reference: Option<&[f64]>) -> Vec<Point> {
    if front.len() <= wanted {
        return front;
    }
    if let Some(reference) = reference {
        let within = |p: &Point| p.at.iter().zip(reference).all(|(x, end)| x < end);
        if front.iter().any(within) {
            front.retain(within);
        }
    }
    let whole = Leaf::of(&front, 0, front.len());
    let end = |k: usize| {
        let order = |a: &&Point, b: &&Point| a.at[k].total_cmp(&b.at[k]).then(a.who.cmp(&b.who));
        front.iter().min_by(order).copied()
    };
    let mut kept: Vec<Point> = (0..width).filter_map(end).collect();
    // Neither is negative, so that their bits have the order of the numbers.
    let measures = |leaf: &Leaf| {
        let along = (0..width).filter(|&k| whole.extent(k) > 0.0);
        let volume: f64 = along.map(|k| leaf.extent(k) / whole.extent(k)).product();
        [leaf.longest(&whole, width).1.to_bits(), volume.to_bits()]
    };
    let mut leaves = Vec::with_capacity(2 * wanted);
    leaves.push(whole);
    let mut by_measure = measures(&whole).map(|measure| BinaryHeap::from([(measure, Reverse(0))]));
    let mut divided = vec![false];
    let mut count = 1;
    while count + width < wanted {
        let heap = &mut by_measure[count % 2];
        let Some((_, Reverse(number))) = heap.pop() else {
            break;
        };
        if divided[number] {
            continue;
        }
        divided[number] = true;
        let leaf = leaves[number];
        let middle = leaf.divide(&mut front, leaf.longest(&whole, width).0);
        for (from, to) in [(leaf.from, middle), (middle, leaf.to)] {
            let half = Leaf::of(&front, from, to);
            if to - from > 1 {
                for (heap, measure) in by_measure.iter_mut().zip(measures(&half)) {
                    heap.push((measure, Reverse(leaves.len())));
                }
            }
            leaves.push(half);
            divided.push(false);
        }
        count += 1;
    }
    let whole_ones = leaves.iter().zip(divided).filter(|(_, divided)| !divided);
    kept.extend(whole_ones.filter_map(|(leaf, _)| leaf.best(&front, width)));
    kept.sort_unstable_by_key(|p| p.who);
    kept.dedup_by_key(|p| p.who);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn points(row: impl Fn(f64, f64) -> [f64; 3]) -> Vec<Point> {
        let random = Random::new(4);
        let draw = |i, k| random.uniform(1, 0, i, k);
        let point = |who| Point {
            at: row(draw(who, 0), draw(who, 1)),
            who,
        };
        (0..20_000).map(point).collect()
    }

    /// Of any front, with constant objectives and with plateaus.
    #[test]
    fn as_many_as_wanted_with_the_ends() {
        for (width, front) in [
            (2, points(|t, _| [t, 1.0 - t, 0.0])),
            (2, points(|t, _| [(20.0 * t).exp(), (-20.0 * t).exp(), 0.0])),
            (3, points(|t, s| [t, s, 2.0 - t - s])),
            (3, points(|t, _| [t, t, 1.0 - t])),
            (3, points(|t, s| [t, 1.0 - t, (3.0 * s).floor()])),
            (3, points(|t, _| [t, 1.0 - t, 7.0])),
            (3, points(|t, s| [1e300 * t, 1e-300 * s, -t - s])),
        ] {
            for wanted in [8, 100, 2000] {
                let kept = thinned(front.clone(), width, wanted, None);
                assert!(
                    kept.len() <= wanted && kept.len() + 2 * width >= wanted,
                    "{} of {wanted}",
                    kept.len()
                );
                assert!(kept.iter().all(|p| front[p.who as usize] == *p));
                assert!(kept.is_sorted_by(|a, b| a.who < b.who));
                for k in 0..width {
                    let least =
                        |points: &[Point]| points.iter().map(|p| p.at[k]).fold(f64::INFINITY, f64::min);
                    assert_eq!(least(&kept), least(&front));
                }
            }
        }
    }

    /// Half of the points lie in a hundredth of the front, and leave the rest of it no worse covered.
    #[test]
    fn a_crowd_takes_no_places_from_the_rest() {
        let front = points(|t, s| {
            let x = if s < 0.5 { 0.01 * t } else { t };
            [x, 1.0 - x, 0.0]
        });
        let mut along: Vec<f64> = thinned(front, 2, 400, None).iter().map(|p| p.at[0]).collect();
        along.sort_by(f64::total_cmp);
        let widest = along.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        assert!(widest < 0.01, "{widest}");
    }

    #[test]
    fn what_lies_beyond_the_reference_is_left_out() {
        let front = points(|t, _| [t, 1.0 - t, 0.0]);
        let kept = thinned(front.clone(), 2, 400, Some(&[0.6, 0.6]));
        assert!(kept.len() > 390 && kept.iter().all(|p| p.at[0] < 0.6 && p.at[1] < 0.6));
        // Where all of them do, that is no reason to have none.
        assert!(thinned(front, 2, 400, Some(&[0.0, 0.0])).len() > 390);
    }
}
