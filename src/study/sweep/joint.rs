//! Fronts of several runs against the front of all of them together.

use super::Row;
use crate::error::Result;
use crate::swarm::metrics::{hypervolume, non_dominated};
use std::collections::BTreeMap;

/// The reference point, in ranges of the joint front from its best.
const REFERENCE: f64 = 1.1;
/// The figure that rows with a front are given.
pub(super) const SHARE: &str = "hypervolume_share";

/// Gives every row that has a front its hypervolume as a share of that of the front of all runs of the same problem, whatever
/// searched it; `problems` has the number of each run's. Objectives count in ranges of that joint front, and volumes are up to 1.1
/// of these from its best point.
///
/// # Errors
/// Those of [`hypervolume`].
pub(super) fn compare(rows: &mut [Row], problems: &[usize]) -> Result<()> {
    // Volumes are worked out in two and three dimensions.
    let width_of = |row: &Row| {
        row.front
            .first()
            .map(Vec::len)
            .filter(|width| (2..=3).contains(width))
    };
    let mut of_problem: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (place, row) in rows.iter().enumerate() {
        of_problem.entry(problems[row.run]).or_default().push(place);
    }
    for mut members in of_problem.into_values() {
        let Some(width) = members.iter().find_map(|&i| width_of(&rows[i])) else {
            continue;
        };
        members.retain(|&i| width_of(&rows[i]) == Some(width));
        let all: Vec<Vec<f64>> = members
            .iter()
            .flat_map(|&i| rows[i].front.iter().cloned())
            .collect();
        let joint: Vec<Vec<f64>> = non_dominated(&all).into_iter().map(|i| all[i].clone()).collect();
        let over = |k: usize, f: fn(f64, f64) -> f64| joint.iter().map(|p| p[k]).reduce(f).unwrap_or(0.0);
        let best: Vec<f64> = (0..width).map(|k| over(k, f64::min)).collect();
        let range: Vec<f64> = (0..width)
            .map(|k| (over(k, f64::max) - best[k]).max(f64::MIN_POSITIVE))
            .collect();
        let volume = |points: &[Vec<f64>]| -> Result<f64> {
            let scaled: Vec<Vec<f64>> = points
                .iter()
                .map(|p| (0..width).map(|k| (p[k] - best[k]) / range[k]).collect())
                .collect();
            hypervolume(&scaled, &vec![REFERENCE; width])
        };
        let whole = volume(&joint)?;
        for i in members {
            let share = volume(&rows[i].front)? / whole;
            rows[i].figures.insert(SHARE.to_owned(), Some(share));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(run: usize, front: Vec<Vec<f64>>) -> Row {
        Row {
            run,
            front,
            ..Row::default()
        }
    }

    /// Two runs that have half of a front of four each; a third of another problem is its own joint front.
    #[test]
    fn shares_are_of_the_front_of_all_runs_of_a_problem() {
        let mut rows = [
            row(0, vec![vec![0.0, 3.0], vec![2.0, 1.0]]),
            row(2, vec![vec![1.0, 2.0], vec![3.0, 0.0]]),
            row(3, vec![vec![5.0, 6.0], vec![7.0, 5.0]]),
        ];
        // The run of number 1 has failed.
        compare(&mut rows, &[0, 0, 0, 1]).unwrap();
        let share = |i: usize| rows[i].figures[SHARE].unwrap();
        // On a scale of 3: the joint front's staircase under 3.3 has 0.3 + 1.3 + 2.3 + 3.3 columns less what lies beyond.
        let whole = 0.3 + 1.3 + 2.3 + 3.3 * 0.3;
        let [first, second] = [2.0 * 0.3 + 1.3 * 2.3, 2.0 * 1.3 + 0.3 * 3.3];
        assert!((share(0) - first / whole).abs() < 1e-12, "{}", share(0));
        assert!((share(1) - second / whole).abs() < 1e-12, "{}", share(1));
        assert_eq!(share(2), 1.0);
    }
}
