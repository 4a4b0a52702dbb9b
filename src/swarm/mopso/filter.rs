//! The points of a swarm that may enter the archive: those that no member and no other point dominates.
//!
//! A swarm is filtered, never ranked. Points that a member of the archive dominates or equals go first, then those that
//! a few good points of their part of the swarm dominate; what is left of each part, and then of all parts together, is
//! swept exactly (Kung, Luccio, Preparata, *On finding the maxima of a set of vectors*, J. ACM 22, 1975): sorting and a
//! running minimum for one and two objectives, a staircase for three. The parts have a fixed size, so that the outcome does
//! not depend on the threads.

use crate::evaluate::resident::BLOCK;
use crate::swarm::metrics::Staircase;
use rayon::prelude::*;

/// Objectives (zero for those beyond the number of objectives) and the number of the particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub at: [f64; 3],
    pub who: u32,
}

/// A row of objectives as a point.
pub fn point(row: &[f64], who: u32) -> Point {
    let mut at = [0.0; 3];
    for (x, value) in at.iter_mut().zip(row) {
        *x = *value;
    }
    Point { at, who }
}

/// The sound rows of a part of the swarm that no member and no other row of the part dominates or equals; `first` is the number of
/// the part's first particle.
#[inline(always)]
pub fn part(
    rows: &[f64],
    width: usize,
    first: u32,
    sound: impl Fn(usize) -> bool,
    members: &[[f64; 3]],
) -> Vec<Point> {
    let mut open = Vec::new();
    for (number, block) in rows.chunks(BLOCK * width).enumerate() {
        let mut at = [[0.0; BLOCK]; 3];
        let mut alive = [false; BLOCK];
        for (lane, row) in block.chunks_exact(width).enumerate() {
            alive[lane] = sound(number * BLOCK + lane);
            for (column, value) in at.iter_mut().zip(row) {
                column[lane] = *value;
                alive[lane] &= value.is_finite();
            }
        }
        for some in members.chunks(8) {
            for member in some {
                for lane in 0..BLOCK {
                    let beaten =
                        (member[0] <= at[0][lane]) & (member[1] <= at[1][lane]) & (member[2] <= at[2][lane]);
                    alive[lane] &= !beaten;
                }
            }
            if !alive.contains(&true) {
                break;
            }
        }
        for lane in (0..BLOCK).filter(|&lane| alive[lane]) {
            open.push(Point {
                at: [at[0][lane], at[1][lane], at[2][lane]],
                who: first + (number * BLOCK + lane) as u32,
            });
        }
    }
    front(open, width)
}

/// Fewer points than this are swept as they are.
const FEW: usize = 32;
/// More points than this are swept in parts first, each in a thread.
const MANY: usize = 4096;

/// The points that no other dominates, by number of the particle; of equal points the first. `O(n log n)`.
pub fn front(mut points: Vec<Point>, width: usize) -> Vec<Point> {
    if points.len() > MANY {
        let parts = points.par_chunks(MANY);
        points = parts.flat_map_iter(|part| front(part.to_vec(), width)).collect();
    }
    if points.len() > FEW {
        for pivot in pivots(&points, width) {
            points.retain(|p| !beats(&pivot, &p.at));
        }
    }
    let kept = if width <= 2 {
        let key = |p: &Point| (p.at[0], p.at[1]);
        points.par_sort_unstable_by(|a, b| order(&key(a), &key(b)).then(a.who.cmp(&b.who)));
        let mut least = f64::INFINITY;
        points.retain(|p| {
            let better = p.at[1] < least;
            least = if better { p.at[1] } else { least };
            better
        });
        points
    } else {
        let key = |p: &Point| (p.at[2], p.at[1], p.at[0]);
        points.par_sort_unstable_by(|a, b| order(&key(a), &key(b)).then(a.who.cmp(&b.who)));
        let mut stairs = Staircase::default();
        points.retain(|p| {
            let better = !stairs.covers(p.at[0], p.at[1]);
            if better {
                stairs.insert((p.at[0], p.at[1]), (f64::INFINITY, f64::INFINITY));
            }
            better
        });
        points
    };
    let mut kept = kept;
    kept.par_sort_unstable_by_key(|p| p.who);
    kept
}

/// As the numbers compare, so that zero has one place whatever its sign. There is no NaN among them.
fn order<T: PartialOrd>(a: &T, b: &T) -> std::cmp::Ordering {
    a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal)
}

fn beats(a: &[f64; 3], b: &[f64; 3]) -> bool {
    (a[0] <= b[0]) & (a[1] <= b[1]) & (a[2] <= b[2]) & (a != b)
}

/// Points that dominate many others: the least by a few weighted sums of the objectives, each as a share of its range.
fn pivots(points: &[Point], width: usize) -> Vec<[f64; 3]> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    for p in points {
        for k in 0..3 {
            low[k] = low[k].min(p.at[k]);
            high[k] = high[k].max(p.at[k]);
        }
    }
    let scale: [f64; 3] = std::array::from_fn(|k| {
        if high[k] > low[k] && k < width {
            1.0 / (high[k] - low[k])
        } else {
            0.0
        }
    });
    const WEIGHTS: [[f64; 3]; 7] = [
        [1.0, 1.0, 1.0],
        [4.0, 1.0, 1.0],
        [1.0, 4.0, 1.0],
        [1.0, 1.0, 4.0],
        [4.0, 4.0, 1.0],
        [4.0, 1.0, 4.0],
        [1.0, 4.0, 4.0],
    ];
    let weights = if width == 2 { &WEIGHTS[..3] } else { &WEIGHTS[..] };
    let mut best = [(f64::INFINITY, [0.0; 3]); 7];
    for p in points {
        let share: [f64; 3] = std::array::from_fn(|k| (p.at[k] - low[k]) * scale[k]);
        for (best, w) in best.iter_mut().zip(weights) {
            let sum = share[0] * w[0] + share[1] * w[1] + share[2] * w[2];
            if sum < best.0 {
                *best = (sum, p.at);
            }
        }
    }
    best[..weights.len()].iter().map(|b| b.1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// More points than a part has, some of them equal, in another order: the same front, and no point of it is beaten.
    #[test]
    fn the_front_of_many_points_does_not_depend_on_their_order() {
        let random = Random::new(1);
        for width in [2, 3] {
            let points: Vec<Point> = (0..3 * MANY as u32)
                .map(|who| {
                    let draw = |k: u32| random.uniform(1, 0, who / 2, k);
                    let mut at = [draw(0), draw(1), 0.0];
                    if width == 3 {
                        at[2] = (2.0 - at[0] - at[1]).max(0.0) + 0.01 * draw(2);
                    }
                    Point { at, who }
                })
                .collect();
            let mut turned = points.clone();
            turned.reverse();
            let found = front(points.clone(), width);
            assert_eq!(found, front(turned, width));
            assert!(
                found.len() > if width == 2 { 3 } else { MANY / 4 },
                "{}",
                found.len()
            );
            let of_pairs = |p: &Point| p.who.is_multiple_of(2);
            assert!(found.iter().all(of_pairs), "of equal points the first");
            for p in points.iter().filter(|p| of_pairs(p)) {
                let open = !points.iter().any(|other| beats(&other.at, &p.at));
                assert_eq!(found.contains(p), open);
            }
        }
    }
}
