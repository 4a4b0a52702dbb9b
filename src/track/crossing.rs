//! Where straight stretches cross one another, found through a tree of bounding boxes.

use glam::DVec2;

/// A straight stretch between two points (m).
pub(super) type Stretch = [DVec2; 2];

/// Most pairs of boxes that are compared, so that no file keeps the program busy for hours.
const BUDGET: u64 = 200_000_000;

/// The stretches are too tangled to be checked.
#[derive(Debug)]
pub(super) struct Tangled;

#[derive(Clone, Copy)]
struct Bounds {
    low: DVec2,
    high: DVec2,
}

impl Bounds {
    fn around(stretch: &Stretch) -> Self {
        Self {
            low: stretch[0].min(stretch[1]),
            high: stretch[0].max(stretch[1]),
        }
    }

    fn join(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

/// Whether two stretches have a point in common.
pub(super) fn meet(a: &Stretch, b: &Stretch) -> bool {
    let side = |s: &Stretch, p: DVec2| (s[1] - s[0]).perp_dot(p - s[0]);
    if !Bounds::around(a).meets(&Bounds::around(b)) {
        return false;
    }
    let across = |s: &Stretch, t: &Stretch| side(s, t[0]) * side(s, t[1]) <= 0.0;
    across(a, b) && across(b, a)
}

/// Pairs `(i, j)`, `i < j`, of stretches that have a point in common, up to `most` of them. Neighbours that share an end
/// do not count.
pub(super) fn crossings(stretches: &[Stretch], most: usize) -> Result<Vec<(usize, usize)>, Tangled> {
    let mut found = Vec::new();
    if stretches.len() < 2 {
        return Ok(found);
    }
    // Leaves of a full binary tree, in the order along the line, so that neighbours are together.
    let leaves = stretches.len().next_power_of_two();
    let nowhere = Bounds {
        low: DVec2::INFINITY,
        high: DVec2::NEG_INFINITY,
    };
    let mut tree = vec![nowhere; 2 * leaves];
    for (i, stretch) in stretches.iter().enumerate() {
        tree[leaves + i] = Bounds::around(stretch);
    }
    for node in (1..leaves).rev() {
        tree[node] = tree[2 * node].join(tree[2 * node + 1]);
    }
    let mut pending = vec![(1, 1)];
    let mut spent = 0;
    while let Some((a, b)) = pending.pop() {
        spent += 1;
        if spent > BUDGET {
            return Err(Tangled);
        }
        if a == b {
            if a < leaves {
                pending.extend([(2 * a, 2 * a), (2 * a + 1, 2 * a + 1), (2 * a, 2 * a + 1)]);
            }
        } else if tree[a].meets(&tree[b]) {
            if a < leaves {
                // Both nodes lie on one level.
                for child in [2 * a, 2 * a + 1] {
                    pending.extend([(child, 2 * b), (child, 2 * b + 1)]);
                }
                continue;
            }
            let (i, j) = (a - leaves, b - leaves);
            let (s, t) = (&stretches[i], &stretches[j]);
            let joined = s[1] == t[0] || t[1] == s[0];
            if !joined && meet(s, t) {
                found.push((i.min(j), i.max(j)));
                if found.len() >= most {
                    break;
                }
            }
        }
    }
    found.sort_unstable();
    Ok(found)
}

/// The stretches of a line, the closing one of a closed line included.
pub(super) fn stretches(points: &[DVec2], closed: bool) -> Vec<Stretch> {
    let mut all: Vec<Stretch> = points.windows(2).map(|p| [p[0], p[1]]).collect();
    if let (true, [first, .., last]) = (closed, points) {
        all.push([*last, *first]);
    }
    all
}

/// Where a line crosses itself, as on a bridge: both stations (m) of every crossing. `station_m` are those of the points.
pub(super) fn bridges(points: &[DVec2], station_m: &[f64], closed: bool) -> Vec<[f64; 2]> {
    // What is too tangled was refused when it was read.
    let crossed = crossings(&stretches(points, closed), MOST_BRIDGES).unwrap_or_default();
    crossed
        .into_iter()
        .map(|(i, j)| [station_m[i], station_m[j]])
        .collect()
}

/// Bridges that are told of.
const MOST_BRIDGES: usize = 100;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_tree_finds_what_trying_all_pairs_finds(
            points in prop::collection::vec((-5.0..5.0f64, -5.0..5.0f64), 3..60),
            closed: bool,
        ) {
            let points: Vec<DVec2> = points.into_iter().map(DVec2::from).collect();
            let all = stretches(&points, closed);
            let mut wanted = Vec::new();
            for i in 0..all.len() {
                for j in i + 1..all.len() {
                    let joined = all[i][1] == all[j][0] || all[j][1] == all[i][0];
                    if !joined && meet(&all[i], &all[j]) {
                        wanted.push((i, j));
                    }
                }
            }
            prop_assert_eq!(crossings(&all, usize::MAX).ok(), Some(wanted));
        }
    }

    #[test]
    fn a_figure_of_eight_crosses_once() {
        let points: Vec<DVec2> = (0..100)
            .map(|i| f64::from(i) * std::f64::consts::TAU / 100.0 + 0.01)
            .map(|t| DVec2::new(t.sin(), (2.0 * t).sin()))
            .collect();
        assert_eq!(
            crossings(&stretches(&points, true), 10).map(|c| c.len()).ok(),
            Some(1)
        );
    }
}
