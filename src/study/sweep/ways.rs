//! The ways of searches: what each setting had reached by what it had cost, as medians and quartiles over its seeds.

use super::KeptRow;
use crate::error::Result;
use crate::report::{Curves, Panel, Rows, Scale, Table, with_unit};
use crate::swarm::Reached;
use crate::swarm::comparison::quartiles;
use std::path::Path;

/// Points of a curve at the most.
const POINTS: usize = 240;
/// Greatest reach over the least, above which costs are drawn by ratios.
const BY_RATIOS: f64 = 20.0;

/// A setting, in words, and its runs.
pub(super) struct Ways<'a> {
    pub name: String,
    pub runs: Vec<&'a KeptRow>,
}

/// What a search costs: candidates, or time.
type Cost = fn(&Reached) -> f64;

impl Ways<'_> {
    /// Costs, and quartiles over the runs of what each had reached by then; from where all have reached something.
    fn quartiles(&self, cost: Cost) -> (Vec<f64>, [Vec<f64>; 3]) {
        let ways: Vec<&[Reached]> = self.runs.iter().map(|kept| &*kept.searched.reached).collect();
        let mut at: Vec<f64> = ways.iter().flat_map(|way| way.iter().map(cost)).collect();
        at.sort_by(f64::total_cmp);
        at.dedup();
        let every = at.len().div_ceil(POINTS).max(1);
        let last = at.last().copied();
        let mut at: Vec<f64> = at.into_iter().step_by(every).collect();
        at.extend(last.filter(|last| at.last() != Some(last)));
        let (mut costs, mut curves) = (Vec::new(), [const { Vec::new() }; 3]);
        for cost_now in at {
            let by_then = |way: &&[Reached]| {
                let reached = way.partition_point(|reached| cost(reached) <= cost_now);
                way[..reached].iter().rev().find_map(|reached| reached.best)
            };
            let reached: Option<Vec<f64>> = ways.iter().map(by_then).collect();
            let Some(reached) = reached.filter(|reached| !reached.is_empty()) else {
                continue;
            };
            costs.push(cost_now);
            for (curve, value) in curves.iter_mut().zip(quartiles(&reached)) {
                curve.push(value);
            }
        }
        (costs, curves)
    }
}

/// What the settings had reached, against candidates and against time.
pub(super) fn figure(ways: &[Ways<'_>], label: &str) -> Curves {
    let costs: [(&str, &str, Cost); 2] = [
        ("candidates evaluated", "", |reached| reached.evaluations as f64),
        ("time of the search", "s", |reached| reached.elapsed_s),
    ];
    let panels = costs.map(|(name, unit, cost)| {
        let curves: Vec<_> = ways.iter().map(|way| way.quartiles(cost)).collect();
        let all = curves
            .iter()
            .flat_map(|(_, [low, _, high])| low.iter().chain(high));
        let (least, most) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(*v), high.max(*v))
        });
        let scale = if least > 0.0 && most / least > BY_RATIOS {
            Scale::Log
        } else {
            Scale::Linear
        };
        let panel = Panel::new(format!("Against {}", with_unit(name, unit)))
            .x(name, unit)
            .y(label, "")
            .scales(Scale::Linear, scale);
        let named = ways.iter().zip(&curves);
        named.fold(panel, |panel, (way, (x, [below, median, above]))| {
            panel.band(&*way.name, x, median, [below, above])
        })
    });
    Curves::new("Convergence", panels.into_iter().filter(Panel::has_points))
}

/// The fronts of the settings over one another, by every two of the objectives.
pub(super) fn fronts(ways: &[Ways<'_>], objectives: &[String]) -> Curves {
    let n = objectives.len();
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    let panels = pairs.map(|(i, j)| {
        let panel = Panel::new(format!("{} against {}", objectives[j], objectives[i]));
        let panel = panel.x(&objectives[i], "").y(&objectives[j], "");
        ways.iter().fold(panel, |panel, way| {
            let members = way.runs.iter().flat_map(|kept| &kept.row.front);
            panel.dots(&*way.name, members.map(|member| (member[i], member[j])))
        })
    });
    Curves::new("Fronts over one another", panels.filter(Panel::has_points))
}

/// Writes what every run had reached by what it had cost.
pub(super) fn write(path: &Path, kept: &[KeptRow]) -> Result<()> {
    let rows: Vec<(usize, &Reached)> = kept
        .iter()
        .flat_map(|kept| {
            kept.searched
                .reached
                .iter()
                .map(|reached| (kept.row.run, reached))
        })
        .collect();
    if rows.is_empty() {
        return Ok(());
    }
    Table::rows(rows)
        .number("run", "", |(run, _)| *run as f64)
        .number("evaluations", "", |(_, reached)| reached.evaluations as f64)
        .number("elapsed", "s", |(_, reached)| reached.elapsed_s)
        .number("reached", "", |(_, reached)| reached.best)
        .table()
        .write_csv(path)
}

/// Time and processor time of every run, and the machine that it ran on.
pub(super) fn times(kept: &[KeptRow]) -> Rows<&KeptRow> {
    Table::rows(kept)
        .number("run", "", |kept| kept.row.run as f64)
        .number("elapsed", "s", |kept| kept.elapsed_s)
        .number("processor_elapsed", "s", |kept| kept.processor_elapsed_s)
        .text("machine", |kept| &*kept.machine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::framework::Searched;

    /// Two runs that are looked at after other numbers of candidates: between its looks a run has what it had at the last one.
    #[test]
    fn quartiles_are_of_what_each_run_had_reached_by_then() {
        let run = |reached: &[(u64, f64)]| KeptRow {
            searched: Searched {
                reached: reached
                    .iter()
                    .map(|(n, best)| Reached::best(*n, 0.0, *best))
                    .collect(),
                ..Searched::default()
            },
            ..KeptRow::default()
        };
        let kept = [
            run(&[(1, 9.0), (3, 5.0)]),
            run(&[(2, 7.0), (3, f64::INFINITY), (4, 1.0)]),
        ];
        let ways = Ways {
            name: String::new(),
            runs: kept.iter().collect(),
        };
        let (at, [_, median, _]) = ways.quartiles(|reached| reached.evaluations as f64);
        assert_eq!(at, [2.0, 3.0, 4.0]);
        assert_eq!(median, [8.0, 6.0, 3.0]);
    }
}
