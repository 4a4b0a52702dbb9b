//! What each point of a set alone dominates.

use super::boxes::COLUMNS;
use super::columns::Columns;
use super::hypervolume::{Point, bites, hypervolume, point, volume};
use crate::error::Result;

/// The volume, up to `reference`, that each of `points` dominates and no other does. Zero for a point that another equals or
/// dominates, or that is not better than the reference.
///
/// # Errors
/// As [`hypervolume`].
pub fn contributions(points: &[Vec<f64>], reference: &[f64]) -> Result<Vec<f64>> {
    // It checks the widths.
    hypervolume(points, reference)?;
    if reference.len() > COLUMNS {
        let shares = (0..points.len()).map(|i| exclusive_of(points, i, reference));
        return Ok(shares.collect());
    }
    let mut columns = Columns::default();
    points.iter().for_each(|row| columns.push(row));
    Ok((0..points.len())
        .map(|i| columns.exclusive(i, reference))
        .collect())
}

/// The volume that point `i` alone dominates, where there are more objectives than [`Columns`] hold: its box less what the others bite
/// off.
fn exclusive_of(points: &[Vec<f64>], i: usize, reference: &[f64]) -> f64 {
    let better = |corner: &Point| corner.iter().zip(reference).all(|(x, end)| x < end);
    let own = point(&points[i]);
    if !better(&own) {
        return 0.0;
    }
    let others: Vec<Point> = points.iter().map(|row| point(row)).collect();
    let others = others.iter().enumerate().filter(|(j, _)| *j != i);
    let mut bitten = bites(&own, others.map(|(_, other)| other), reference.len());
    if bitten.contains(&own) {
        return 0.0;
    }
    bitten.retain(better);
    let whole: f64 = own.iter().zip(reference).map(|(x, end)| end - x).product();
    (whole - volume(&mut bitten, reference)).max(0.0)
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

    /// Against the difference of two hypervolumes; coordinates are multiples of 1/8, so both are exact.
    #[test]
    fn is_the_difference() {
        let random = Random::new(5);
        for case in 0..400 {
            let width = 1 + case as usize % 6;
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
            for (i, share) in found.into_iter().enumerate() {
                let mut rest = points.clone();
                rest.remove(i);
                let difference = whole - hypervolume(&rest, &reference).unwrap();
                assert_eq!(share, difference, "{i} of {points:?}");
            }
        }
    }

    /// What comes or leaves touches exactly the shares that change, by no more than is said; on a curve its neighbours'. No share
    /// is more than it is at the most.
    #[test]
    fn touches_what_changes() {
        let random = Random::new(6);
        let columns = |points: &[Vec<f64>]| {
            let mut columns = Columns::default();
            points.iter().for_each(|row| columns.push(row));
            columns
        };
        for case in 0..400 {
            let width = 1 + case as usize % 5;
            let count = 2 + random.below(14, 1, case, 0, 0);
            let draw = |i: u32, k: u32| random.below(10, 2, case, i, k) as f64 / 8.0 - 0.25;
            let row = |i: u32| (0..width as u32).map(|k| draw(i, k)).collect();
            let points: Vec<Vec<f64>> = (0..count as u32).map(row).collect();
            let reference = vec![0.875; width];
            let (last, rest) = points.split_last().unwrap();
            let share = |points: &[Vec<f64>], i: usize| columns(points).exclusive(i, &reference);
            for i in 0..points.len() {
                assert!(columns(&points).exclusive_at_most(i, &reference) >= share(&points, i));
            }
            let changes = |i: usize| (share(rest, i) - share(&points, i)).abs();
            for (points, came) in [(points.as_slice(), Some(rest.len())), (rest, None)] {
                let touched = columns(points).touched(last, came, &reference);
                for i in 0..rest.len() {
                    match touched.iter().find(|(who, _)| *who == i) {
                        Some((_, most)) => assert!((0.0..=*most).contains(&changes(i)) && changes(i) > 0.0),
                        None => assert_eq!(changes(i), 0.0, "{i} of {points:?}"),
                    }
                }
            }
        }
        let on = |t: f64| vec![t, t + 1e-9 * (1e3 * t).sin(), 1.0 - t * t];
        let curve: Vec<Vec<f64>> = (0..100).map(|i| on(f64::from(i) / 99.0)).collect();
        let members = columns(&curve);
        for i in 0..99 {
            let new = on((f64::from(i) + 0.5) / 99.0);
            let touched = members.touched(&new, None, &[1.1, 1.1, 1.1]);
            assert!((1..=2).contains(&touched.len()), "{touched:?} at {i}");
        }
    }
}
