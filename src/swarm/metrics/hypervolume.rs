//! Exact hypervolume.

use super::boxes::COLUMNS;
use super::columns::Columns;
use super::staircase::Staircase;
use crate::error::{Error, Result};

/// Most objectives of a [`hypervolume`]: the work multiplies with each.
pub const MOST_OBJECTIVES: usize = 8;

/// A point, of which the first objectives count.
pub(super) type Point = [f64; MOST_OBJECTIVES];

/// A row of objectives as a point.
pub(super) fn point(row: &[f64]) -> Point {
    std::array::from_fn(|k| row.get(k).copied().unwrap_or(0.0))
}

/// The volume of what the points dominate up to `reference`, for one to eight objectives. Points that are not better than the
/// reference in every objective add nothing. Up to three objectives it takes `O(n log n)` \[1\]. For each objective more, every point
/// takes a hypervolume of one objective less \[7\]: a hundred points of five objectives take less than a millisecond, spread over a sphere.
///
/// # Errors
/// [`Error::Input`] if the number of objectives is not one to eight or rows differ from the reference in width.
pub fn hypervolume(points: &[Vec<f64>], reference: &[f64]) -> Result<f64> {
    let width = reference.len();
    if !(1..=MOST_OBJECTIVES).contains(&width) || points.iter().any(|p| p.len() != width) {
        let found = points.iter().find(|p| p.len() != width).map_or(width, Vec::len);
        let found = format!("{found} objectives, a reference of {width}");
        return Err(Error::input(
            "hypervolume",
            "objectives",
            found,
            "one to eight, as many in every row and in the reference",
        ));
    }
    let better = |p: &&Vec<f64>| p.iter().zip(reference).all(|(x, r)| x < r);
    let mut inside: Vec<Point> = points.iter().filter(better).map(|row| point(row)).collect();
    Ok(volume(&mut inside, reference))
}

/// The volume of points that are all better than `reference`, in as many objectives as that has.
pub(super) fn volume(points: &mut [Point], reference: &[f64]) -> f64 {
    match *reference {
        [] => 0.0,
        [end] => points.iter().map(|p| end - p[0]).fold(0.0, f64::max),
        [right, top] => area(points, [right, top]),
        [right, top, ceiling] => sweep(points, [right, top], ceiling),
        [ref before @ .., end] if before.len() <= COLUMNS => {
            // Each point in turn, the best in the last objective first: those before it reach at least as far along it as the point
            // itself does.
            let last = before.len();
            points.sort_by(|a, b| a[last].total_cmp(&b[last]));
            let mut columns = Columns::default();
            let own = |(i, point): (usize, &Point)| {
                columns.push(&point[..last]);
                (end - point[last]) * columns.exclusive(i, before)
            };
            points.iter().enumerate().map(own).fold(0.0, |sum, own| sum + own)
        }
        [ref before @ .., end] => {
            // Each point in turn, the worst in the last objective first: those after it are no worse there, so that they all reach
            // as far along it as the point itself does.
            let last = before.len();
            points.sort_by(|a, b| b[last].total_cmp(&a[last]));
            let own = |i: usize| {
                let (point, others) = (&points[i], &points[i + 1..]);
                let whole = point.iter().zip(before).map(|(x, r)| r - x).product::<f64>();
                let mut bitten = bites(point, others.iter(), last);
                (end - point[last]) * (whole - volume(&mut bitten, before))
            };
            // A sum of nothing would be a zero with a sign.
            (0..points.len()).map(own).fold(0.0, |sum, own| sum + own)
        }
    }
}

/// The nearer corners of what `others` bite off the box of `point`, in so many objectives. From four on, those that lie within another's
/// bite are left out: a sweep passes over them faster than they are found.
pub(super) fn bites<'a>(point: &Point, others: impl Iterator<Item = &'a Point>, width: usize) -> Vec<Point> {
    let mut bites: Vec<Point> = Vec::new();
    let within = |a: &Point, b: &Point| (0..width).all(|k| a[k] >= b[k]);
    for other in others {
        let corner = std::array::from_fn(|k| point[k].max(other[k]));
        if width > 3 {
            if bites.iter().any(|bite| within(&corner, bite)) {
                continue;
            }
            bites.retain(|bite| !within(bite, &corner));
        }
        bites.push(corner);
    }
    bites
}

fn area(points: &mut [Point], [right, top]: [f64; 2]) -> f64 {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut ceiling = top;
    let mut area = 0.0;
    for p in points {
        if p[1] < ceiling {
            area += (right - p[0]) * (ceiling - p[1]);
            ceiling = p[1];
        }
    }
    area
}

fn sweep(points: &mut [Point], [right, top]: [f64; 2], ceiling: f64) -> f64 {
    points.sort_by(|a, b| a[2].total_cmp(&b[2]));
    let mut stairs = Staircase::default();
    let (mut area, mut volume) = (0.0, 0.0);
    let mut level = points.first().map_or(ceiling, |p| p[2]);
    for p in points {
        volume += area * (p[2] - level);
        level = p[2];
        if !stairs.covers(p[0], p[1]) {
            area += stairs.insert((p[0], p[1]), (right, top));
        }
    }
    volume + area * (ceiling - level)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Volume by inclusion and exclusion: exact, and exponential.
    fn brute(points: &[Vec<f64>], reference: &[f64]) -> f64 {
        (1u32..1 << points.len())
            .map(|set| {
                let volume: f64 = (0..reference.len())
                    .map(|k| {
                        let worst = (0..points.len())
                            .filter(|i| set >> i & 1 == 1)
                            .map(|i| points[i][k])
                            .fold(f64::NEG_INFINITY, f64::max);
                        (reference[k] - worst).max(0.0)
                    })
                    .product();
                if set.count_ones() % 2 == 1 {
                    volume
                } else {
                    -volume
                }
            })
            .sum()
    }

    #[test]
    fn by_hand() {
        let of = |points: &[&[f64]], reference: &[f64]| {
            let rows: Vec<Vec<f64>> = points.iter().map(|p| p.to_vec()).collect();
            hypervolume(&rows, reference).unwrap()
        };
        assert_eq!(of(&[], &[1.0, 1.0]), 0.0);
        assert_eq!(of(&[&[3.0], &[1.0]], &[4.0]), 3.0);
        // Boxes of 3 and 3 that share 1.
        assert_eq!(of(&[&[1.0, 3.0], &[3.0, 1.0]], &[4.0, 4.0]), 5.0);
        assert_eq!(of(&[&[1.0, 4.0], &[5.0, 0.0]], &[4.0, 4.0]), 0.0);
        assert_eq!(of(&[&[-1.0, -1.0], &[-1.0, -1.0]], &[1.0, 1.0]), 4.0);
        // A unit cube and a slab of 2 x 2 x 1/2 that shares half of it.
        assert_eq!(of(&[&[1.0, 1.0, 1.0], &[0.0, 0.0, 1.5]], &[2.0, 2.0, 2.0]), 2.5);
        // A tesseract of side 1 and a slab of 2 x 2 x 2 x 1/2 that shares half of it.
        let slab = &[0.0, 0.0, 0.0, 1.5];
        assert_eq!(of(&[&[1.0; 4], slab], &[2.0; 4]), 4.5);
        assert!(hypervolume(&[vec![0.0; 2]], &[1.0; 3]).is_err());
        assert!(hypervolume(&[], &[]).is_err() && hypervolume(&[], &[1.0; 9]).is_err());
    }

    /// Against inclusion and exclusion, with ties: coordinates are multiples of 1/8, so both sums are exact.
    #[test]
    fn brute_force() {
        let random = Random::new(11);
        for case in 0..300 {
            let width = 1 + case as usize % 6;
            let count = random.below(10, 1, case, 0, 0);
            let points: Vec<Vec<f64>> = (0..count as u32)
                .map(|i| {
                    (0..width as u32)
                        .map(|k| random.below(10, 2, case, i, k) as f64 / 8.0 - 0.25)
                        .collect()
                })
                .collect();
            let reference = vec![0.875; width];
            let found = hypervolume(&points, &reference).unwrap();
            assert_eq!(found, brute(&points, &reference), "{points:?}");
        }
    }
}
