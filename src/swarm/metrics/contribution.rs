//! What each point of a set alone dominates.

use super::hypervolume::hypervolume;
use crate::error::Result;

/// The volume, up to `reference`, that each of `points` dominates and no other does, for one to three
/// objectives. Nought for a point that another equals or dominates, or that is not better than the reference.
///
/// # Errors
/// As [`hypervolume`].
pub fn contributions(points: &[Vec<f64>], reference: &[f64]) -> Result<Vec<f64>> {
    // It checks the widths.
    hypervolume(points, reference)?;
    Ok((0..points.len())
        .map(|i| exclusive(points, i, reference).0)
        .collect())
}

/// The exclusive volume of point `i` among `points` of up to three objectives, and the far corner of the least
/// box from the point that holds it. Another point changes the volume only if it is at or below that corner in
/// every objective.
///
/// A sweep along the third objective over a window that the others leave in the first two. The window is small
/// in a set of non-dominated points, so that nearly all of the others are dismissed by two comparisons: some
/// `n` steps for a point instead of the `n log n` of a whole hypervolume.
pub(in crate::swarm) fn exclusive(points: &[Vec<f64>], i: usize, reference: &[f64]) -> (f64, [f64; 3]) {
    let at = |row: &[f64], k: usize| row.get(k).copied().unwrap_or(0.0);
    let point = &points[i];
    let (x, y, z) = (at(point, 0), at(point, 1), at(point, 2));
    // Missing objectives are nought against a reference of one.
    let end = |k: usize| reference.get(k).copied().unwrap_or(1.0);
    let (mut right, mut top, ceiling) = (end(0), end(1), end(2));
    let nothing = (0.0, [x, y, z]);
    if !(x < right && y < top && z < ceiling) {
        return nothing;
    }
    // The window at the point's own level.
    for (j, other) in points.iter().enumerate() {
        if j == i || at(other, 2) > z {
            continue;
        }
        let (u, v) = (at(other, 0), at(other, 1));
        match (u <= x, v <= y) {
            (true, true) => return nothing,
            (true, false) => top = top.min(v),
            (false, true) => right = right.min(u),
            (false, false) => {}
        }
    }
    // Points inside the window bite its far corner off, now or from their level on.
    let mut inside: Vec<(f64, f64, f64)> = Vec::new();
    let mut above: Vec<(f64, f64, f64)> = Vec::new();
    for (j, other) in points.iter().enumerate() {
        let (u, v, w) = (at(other, 0), at(other, 1), at(other, 2));
        if j == i || u >= right || v >= top || w >= ceiling {
            continue;
        }
        if w > z {
            above.push((w, u, v));
        } else {
            inside.push((u, v, w));
        }
    }
    above.sort_by(|a, b| a.0.total_cmp(&b.0));
    let far = (right, top);
    let mut area = window(&mut inside, (x, y), (right, top));
    let (mut level, mut volume) = (z, 0.0);
    for (w, u, v) in above {
        if u >= right || v >= top {
            continue;
        }
        volume += area * (w - level);
        level = w;
        match (u <= x, v <= y) {
            (true, true) => return (volume, [far.0, far.1, w]),
            (true, false) => top = v,
            (false, true) => right = u,
            (false, false) => inside.push((u, v, w)),
        }
        area = window(&mut inside, (x, y), (right, top));
    }
    (volume + area * (ceiling - level), [far.0, far.1, ceiling])
}

/// The area of the window from `(x, y)` to `(right, top)` less what the points inside dominate; drops points
/// that are no longer inside or dominate nothing of their own.
fn window(inside: &mut Vec<(f64, f64, f64)>, (x, y): (f64, f64), (right, top): (f64, f64)) -> f64 {
    inside.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut ceiling = top;
    inside.retain(|&(u, v, _)| {
        let counts = u < right && v < ceiling;
        if counts {
            ceiling = v;
        }
        counts
    });
    let mut from = x;
    let mut height = top - y;
    let mut area = 0.0;
    for &(u, v, _) in inside.iter() {
        area += (u - from) * height;
        from = u;
        height = v - y;
    }
    area + (right - from) * height
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn by_hand() {
        let points = vec![vec![1.0, 3.0], vec![2.0, 2.0], vec![3.0, 1.0], vec![3.0, 3.0]];
        assert_eq!(contributions(&points, &[4.0, 4.0]).unwrap(), [1.0, 1.0, 1.0, 0.0]);
        assert_eq!(
            contributions(&[vec![1.0], vec![3.0]], &[4.0]).unwrap(),
            [2.0, 0.0]
        );
        let corner = vec![vec![0.0, 0.0, 1.5], vec![1.0, 1.0, 1.0]];
        assert_eq!(contributions(&corner, &[2.0; 3]).unwrap(), [1.5, 0.5]);
    }

    /// Against the difference of two hypervolumes; coordinates are multiples of 1/8, so both are exact. The box
    /// is held against what it claims: points beyond its corner change nothing.
    #[test]
    fn is_the_difference() {
        let random = Random::new(5);
        for case in 0..400 {
            let width = 1 + case as usize % 3;
            let count = 1 + random.below(14, 1, case, 0, 0);
            let points: Vec<Vec<f64>> = (0..count as u32)
                .map(|i| {
                    (0..width as u32)
                        .map(|k| random.below(10, 2, case, i, k) as f64 / 8.0 - 0.25)
                        .collect()
                })
                .collect();
            let reference = vec![0.875; width];
            let whole = hypervolume(&points, &reference).unwrap();
            let found = contributions(&points, &reference).unwrap();
            for i in 0..count {
                let mut rest = points.clone();
                rest.remove(i);
                let difference = whole - hypervolume(&rest, &reference).unwrap();
                assert_eq!(found[i], difference, "{i} of {points:?}");
                let (volume, corner) = exclusive(&points, i, &reference);
                let mut near = vec![points[i].clone()];
                let touches = |p: &&Vec<f64>| p.iter().zip(&corner).all(|(x, c)| x <= c);
                near.extend(rest.iter().filter(touches).cloned());
                assert_eq!(exclusive(&near, 0, &reference).0, volume);
            }
        }
    }
}
