//! Exact hypervolume.

use super::staircase::Staircase;
use crate::error::{Error, Result};

/// The volume of what the points dominate up to `reference`, for one to three objectives, in `O(n log n)`
/// \[1\]. Points that are not better than the reference in every objective add nothing.
///
/// # Errors
/// [`Error::Input`] if the number of objectives is not one to three or rows differ in width.
pub fn hypervolume(points: &[Vec<f64>], reference: &[f64]) -> Result<f64> {
    let width = reference.len();
    if !(1..=3).contains(&width) || points.iter().any(|p| p.len() != width) {
        let found = points.iter().find(|p| p.len() != width).map_or(width, Vec::len);
        let found = format!("{found} objectives, a reference of {width}");
        return Err(Error::input(
            "hypervolume",
            "objectives",
            found,
            "one to three, as many in every row and in the reference",
        ));
    }
    let mut inside: Vec<&[f64]> = points
        .iter()
        .map(Vec::as_slice)
        .filter(|p| p.iter().zip(reference).all(|(x, r)| x < r))
        .collect();
    Ok(match width {
        1 => inside.iter().map(|p| reference[0] - p[0]).fold(0.0, f64::max),
        2 => {
            inside.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let mut ceiling = reference[1];
            let mut area = 0.0;
            for p in inside {
                if p[1] < ceiling {
                    area += (reference[0] - p[0]) * (ceiling - p[1]);
                    ceiling = p[1];
                }
            }
            area
        }
        _ => {
            inside.sort_by(|a, b| a[2].total_cmp(&b[2]));
            let corner = (reference[0], reference[1]);
            let mut stairs = Staircase::default();
            let (mut area, mut volume) = (0.0, 0.0);
            let mut level = inside.first().map_or(reference[2], |p| p[2]);
            for p in inside {
                volume += area * (p[2] - level);
                level = p[2];
                if !stairs.covers(p[0], p[1]) {
                    area += stairs.insert((p[0], p[1]), corner);
                }
            }
            volume + area * (reference[2] - level)
        }
    })
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
        assert!(hypervolume(&[vec![0.0; 4]], &[1.0; 4]).is_err());
        assert!(hypervolume(&[vec![0.0; 2]], &[1.0; 3]).is_err());
    }

    /// Against inclusion and exclusion, with ties: coordinates are multiples of 1/8, so both sums are exact.
    #[test]
    fn brute_force() {
        let random = Random::new(11);
        for case in 0..300 {
            let width = 1 + case as usize % 3;
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
