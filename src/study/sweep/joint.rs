//! Fronts of several runs against the front of all of them together.

use super::KeptRow;
use crate::error::Result;
use crate::swarm::metrics::{MOST_OBJECTIVES, hypervolume, non_dominated};
use std::collections::BTreeMap;

/// The reference point, in ranges of the joint front from its best.
const REFERENCE: f64 = 1.1;
/// The figure that rows with a front are given.
pub(super) const SHARE: &str = "hypervolume_share";

/// Objectives in ranges of a front from its best point.
struct Ranges {
    best: Vec<f64>,
    range: Vec<f64>,
    /// Volume of the front.
    whole: f64,
}

impl Ranges {
    /// Those of the front of all these points together.
    fn of(points: &[Vec<f64>]) -> Result<Self> {
        let joint: Vec<&Vec<f64>> = non_dominated(points).into_iter().map(|i| &points[i]).collect();
        let over = |k: usize, f: fn(f64, f64) -> f64| joint.iter().map(|p| p[k]).reduce(f).unwrap_or(0.0);
        let width = points.first().map_or(0, Vec::len);
        let best: Vec<f64> = (0..width).map(|k| over(k, f64::min)).collect();
        let range = (0..width).map(|k| (over(k, f64::max) - best[k]).max(f64::MIN_POSITIVE));
        let mut ranges = Self {
            range: range.collect(),
            best,
            whole: 1.0,
        };
        let joint: Vec<Vec<f64>> = joint.into_iter().cloned().collect();
        ranges.whole = ranges.share(&joint)?;
        Ok(ranges)
    }

    /// The hypervolume of a front up to 1.1 of the ranges from the best point, as a share of that of all points.
    fn share(&self, points: &[Vec<f64>]) -> Result<f64> {
        let ranged = |p: &Vec<f64>| -> Vec<f64> {
            let each = p.iter().zip(&self.best).zip(&self.range);
            each.map(|((x, best), range)| (x - best) / range).collect()
        };
        let ranged: Vec<Vec<f64>> = points.iter().map(ranged).collect();
        Ok(hypervolume(&ranged, &vec![REFERENCE; self.best.len()])? / self.whole)
    }
}

/// Gives every row that has a front its hypervolume as a share of that of the front of all runs of the same problem, whatever
/// searched it; `problems` has the number of each run's. What a search had on its way has its share of the front that all searches
/// together end with: studies move what searches find before they show it.
///
/// # Errors
/// Those of [`hypervolume`].
pub(super) fn compare(rows: &mut [KeptRow], problems: &[usize]) -> Result<()> {
    let width_of = |kept: &KeptRow| {
        let first = kept.row.front.first();
        first
            .map(Vec::len)
            .filter(|width| (2..=MOST_OBJECTIVES).contains(width))
    };
    let mut of_problem: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (place, kept) in rows.iter().enumerate() {
        of_problem.entry(problems[kept.row.run]).or_default().push(place);
    }
    for mut members in of_problem.into_values() {
        let Some(width) = members.iter().find_map(|&i| width_of(&rows[i])) else {
            continue;
        };
        members.retain(|&i| width_of(&rows[i]) == Some(width));
        let together = |of: fn(&KeptRow) -> &[Vec<f64>]| -> Vec<Vec<f64>> {
            members.iter().flat_map(|&i| of(&rows[i])).cloned().collect()
        };
        let shown = Ranges::of(&together(|kept| &kept.row.front))?;
        // A sweep that was begun by an earlier version has rows without their searches' ways.
        let ends = together(|kept| kept.searched.reached.last().map_or(&[], |last| &last.front));
        let searched = if ends.is_empty() {
            None
        } else {
            Some(Ranges::of(&ends)?)
        };
        for i in members {
            let KeptRow {
                row, searched: way, ..
            } = &mut rows[i];
            row.figures
                .insert(SHARE.to_owned(), Some(shown.share(&row.front)?));
            for reached in &mut way.reached {
                reached.best = searched
                    .as_ref()
                    .map(|searched| searched.share(&reached.front))
                    .transpose()?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::Row;
    use super::*;
    use crate::swarm::Reached;

    fn row(run: usize, front: Vec<Vec<f64>>) -> KeptRow {
        let row = Row {
            run,
            front,
            ..Row::default()
        };
        KeptRow {
            row,
            ..KeptRow::default()
        }
    }

    /// Two runs that have half of a front of four each; a third of another problem is its own joint front. On its way a search had
    /// half of its own.
    #[test]
    fn shares_are_of_the_front_of_all_runs_of_a_problem() {
        let mut rows = [
            row(0, vec![vec![0.0, 3.0], vec![2.0, 1.0]]),
            row(2, vec![vec![1.0, 2.0], vec![3.0, 0.0]]),
            row(3, vec![vec![5.0, 6.0], vec![7.0, 5.0]]),
            row(4, vec![vec![2.0, 2.0, 2.0, 3.0]]),
            row(5, vec![vec![3.0, 3.0, 3.0, 2.0]]),
        ];
        let reached = |front: &[Vec<f64>]| Reached {
            front: front.to_vec(),
            ..Reached::default()
        };
        rows[0].searched.reached = vec![reached(&[vec![2.0, 1.0]]), reached(&rows[0].row.front)];
        rows[1].searched.reached = vec![reached(&rows[1].row.front)];
        // The run of number 1 has failed.
        compare(&mut rows, &[0, 0, 0, 1, 2, 2]).unwrap();
        let share = |i: usize| rows[i].row.figures[SHARE].unwrap();
        // On a scale of 3: the joint front's staircase under 3.3 has 0.3 + 1.3 + 2.3 + 3.3 columns less what lies beyond.
        let whole = 0.3 + 1.3 + 2.3 + 3.3 * 0.3;
        let [first, second] = [2.0 * 0.3 + 1.3 * 2.3, 2.0 * 1.3 + 0.3 * 3.3];
        assert!((share(0) - first / whole).abs() < 1e-12, "{}", share(0));
        assert!((share(1) - second / whole).abs() < 1e-12, "{}", share(1));
        assert_eq!(share(2), 1.0);
        let [long, short] = [1.1 * 1.1 * 1.1 * 0.1, 0.1 * 0.1 * 0.1 * 1.1];
        let four = long / (long + short - 0.1 * 0.1 * 0.1 * 0.1);
        assert!((share(3) - four).abs() < 1e-12, "{}", share(3));
        let half = rows[0].searched.reached[0].best.unwrap();
        assert!((half - 1.3 * 2.3 / whole).abs() < 1e-12, "{half}");
    }
}
