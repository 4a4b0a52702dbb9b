//! Indicators that compare a set with a true front.

use crate::error::{Error, Result};

/// An affine map of each objective, which takes a front's best value to zero and its worst to one.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    least: Vec<f64>,
    range: Vec<f64>,
}

impl Scale {
    /// The scale of a front; an objective that does not vary over it is only shifted.
    pub fn of(front: &[Vec<f64>]) -> Self {
        let width = front.first().map_or(0, Vec::len);
        let fold = |k: usize, f: fn(f64, f64) -> f64, start| front.iter().map(|p| p[k]).fold(start, f);
        let least: Vec<f64> = (0..width).map(|k| fold(k, f64::min, f64::INFINITY)).collect();
        let range = (0..width)
            .map(|k| fold(k, f64::max, f64::NEG_INFINITY) - least[k])
            .map(|r| if r > 0.0 { r } else { 1.0 })
            .collect();
        Self { least, range }
    }

    /// The scale from the ideal point to a reference point that nowhere falls short of it.
    pub fn between(ideal: &[f64], reference: &[f64]) -> Self {
        Self::of(&[ideal.to_vec(), reference.to_vec()])
    }

    /// Points on this scale.
    pub fn apply(&self, points: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let value = |row: &Vec<f64>, k: usize| (row[k] - self.least[k]) / self.range[k];
        points
            .iter()
            .map(|row| {
                (0..row.len().min(self.least.len()))
                    .map(|k| value(row, k))
                    .collect()
            })
            .collect()
    }
}

/// The row nearest to the ideal point, each objective as a share of its range over the rows; nothing without rows.
pub fn nearest_to_ideal(rows: &[Vec<f64>]) -> Option<usize> {
    let shares = Scale::of(rows).apply(rows);
    let distance = |i: usize| shares[i].iter().map(|x| x * x).sum::<f64>();
    (0..rows.len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
}

/// Mean over the true front of how far the set is from dominating it \[2\]: zero at best. `O(n m)`.
///
/// # Errors
/// [`Error::Input`] if either is empty or rows differ in width.
pub fn igd_plus(points: &[Vec<f64>], front: &[Vec<f64>]) -> Result<f64> {
    check("IGD+", points, front)?;
    let short = |t: &Vec<f64>| {
        let to = |p: &Vec<f64>| {
            p.iter()
                .zip(t)
                .map(|(a, b)| (a - b).max(0.0).powi(2))
                .sum::<f64>()
        };
        points.iter().map(to).fold(f64::INFINITY, f64::min).sqrt()
    };
    Ok(front.iter().map(short).sum::<f64>() / front.len() as f64)
}

/// The least shift of the whole set, the same in every objective, with which it weakly dominates the true front
/// \[4\]. `O(n m)`.
///
/// # Errors
/// As [`igd_plus`].
pub fn epsilon(points: &[Vec<f64>], front: &[Vec<f64>]) -> Result<f64> {
    check("epsilon", points, front)?;
    let shift = |p: &Vec<f64>, t: &Vec<f64>| {
        p.iter()
            .zip(t)
            .map(|(a, b)| a - b)
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let nearest = |t: &Vec<f64>| points.iter().map(|p| shift(p, t)).fold(f64::INFINITY, f64::min);
    Ok(front.iter().map(nearest).fold(f64::NEG_INFINITY, f64::max))
}

/// The generalised spread \[3\]: how unequal the distances of the points to their nearest neighbours are, and how
/// far the set stays off the front's extremes. Zero for an even set that reaches them.
///
/// # Errors
/// As [`igd_plus`].
pub fn spread(points: &[Vec<f64>], front: &[Vec<f64>]) -> Result<f64> {
    check("spread", points, front)?;
    let distance = |a: &Vec<f64>, b: &Vec<f64>| {
        let square: f64 = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum();
        square.sqrt()
    };
    let least = |distances: &mut dyn Iterator<Item = f64>| distances.fold(f64::INFINITY, f64::min);
    let extremes: f64 = (0..front[0].len())
        .filter_map(|k| front.iter().max_by(|a, b| a[k].total_cmp(&b[k])))
        .map(|extreme| least(&mut points.iter().map(|p| distance(p, extreme))))
        .sum();
    let nearest: Vec<f64> = (0..points.len())
        .filter(|_| points.len() > 1)
        .map(|i| {
            let others = (0..points.len()).filter(|&j| j != i);
            least(&mut others.map(|j| distance(&points[i], &points[j])))
        })
        .collect();
    let mean = nearest.iter().sum::<f64>() / nearest.len().max(1) as f64;
    let uneven: f64 = nearest.iter().map(|d| (d - mean).abs()).sum();
    let whole = extremes + points.len() as f64 * mean;
    Ok(if whole > 0.0 {
        (extremes + uneven) / whole
    } else {
        0.0
    })
}

fn check(name: &str, points: &[Vec<f64>], front: &[Vec<f64>]) -> Result<()> {
    let width = front.first().map_or(0, Vec::len);
    if points.is_empty() || width == 0 || points.iter().chain(front).any(|p| p.len() != width) {
        let found = format!("{} points, {} of the front", points.len(), front.len());
        let expected = "one or more of each, all of the same number of objectives";
        return Err(Error::input(name, "points", found, expected));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(points: &[[f64; 2]]) -> Vec<Vec<f64>> {
        points.iter().map(|p| p.to_vec()).collect()
    }

    #[test]
    fn by_hand() {
        let front = rows(&[[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]);
        for f in [igd_plus, epsilon, spread] {
            assert_eq!(f(&front, &front).unwrap(), 0.0);
            assert!(f(&[], &front).is_err() && f(&front, &[]).is_err());
        }
        // (0.5, 0.9) is 0.5 right of the first, 0.4 above the second, 0.9 above the third, right being free there.
        let one = rows(&[[0.5, 0.9]]);
        let expected = (0.5 + 0.4 + 0.9) / 3.0;
        assert!((igd_plus(&one, &front).unwrap() - expected).abs() < 1e-15);
        assert!((epsilon(&one, &front).unwrap() - 0.9).abs() < 1e-15);
        // A set that dominates the whole front is better than it by the least margin.
        let better = rows(&[[-0.5, -0.25]]);
        assert_eq!(igd_plus(&better, &front).unwrap(), 0.0);
        assert!((epsilon(&better, &front).unwrap() + 0.25).abs() < 1e-15);
        // Nearest neighbours at 1, 1 and 2 on a line; the extremes are met: (1/3 + 1/3 + 2/3) / 4.
        let line = rows(&[[0.0, 3.0], [1.0, 3.0], [3.0, 3.0]]);
        let ends = rows(&[[3.0, 3.0], [0.0, 3.0]]);
        let found = spread(&line, &ends).unwrap();
        assert!((found - 1.0 / 3.0).abs() < 1e-12, "{found}");
    }

    #[test]
    fn scales_to_the_front() {
        let front = rows(&[[2.0, 5.0], [4.0, 5.0]]);
        let scaled = Scale::of(&front).apply(&rows(&[[3.0, 6.0]]));
        assert_eq!(scaled, rows(&[[0.5, 1.0]]));
    }
}
