//! Cooperating swarms in windows, for variables that follow one another along a curve.
//!
//! Where each variable matters only to its neighbours, as along a racing line, a swarm over all of them at once learns
//! far more than there is to know: its distribution has as many entries as pairs of variables, and it needs evaluations in
//! proportion. Here the variables are cut into windows of a few neighbours, each with a small swarm that adapts a
//! distribution of its own ([`super::CovarianceSwarm`]), in the context that the centres of all the others make: the
//! context vector of van den Bergh and Engelbrecht, *A cooperative approach to particle swarm optimization*, IEEE TEC 8
//! (2004), with covariance matrix adaptation in the place of velocities (Liu, Tang, *Scaling up covariance matrix
//! adaptation evolution strategy using cooperative coevolution*, IDEAL 2013). All windows are asked for in one population.
//!
//! The windows take turns with others that lie half a window further on, so that no border lasts, and with wider ones,
//! whose particles move smooth bumps of many variables: they find what is long, as a coarse grid does for a fine one
//! (Briggs, Henson, McCormick, *A multigrid tutorial*, 2nd ed., 2000).

use super::checkpoint::to_bytes;
use super::covariance::Distribution;
use super::settings::setting;
use super::space::Space;
use super::{Counters, Front, Optimiser};
use crate::error::{Error, Result};
use crate::evaluate::{Evaluation, Problem, Worth};
use crate::random::Random;
use nalgebra::DVector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Settings of [`WindowSwarm`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowSettings {
    /// Directions in which the swarm of one window moves.
    pub size: usize,
    /// Particles of one window.
    pub population: usize,
    /// Distances between the middles of the bumps that a window moves, in variables, each a turn of its own; at 1 it
    /// moves the variables themselves.
    pub strides: Vec<usize>,
    /// Iterations of a turn.
    pub turn: usize,
    /// Iterations in all.
    pub iterations: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Standard deviation at the start, as a share of the mean range of the variables.
    pub spread: f64,
    /// Whether the first variable follows the last.
    pub cyclic: bool,
}

impl Default for WindowSettings {
    fn default() -> Self {
        Self {
            size: 12,
            population: 16,
            strides: vec![1],
            turn: 8,
            iterations: 400,
            seed: 1,
            spread: 0.05,
            cyclic: true,
        }
    }
}

impl WindowSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        let counts = [
            ("size", self.size, 2),
            ("population", self.population, 4),
            ("strides", self.strides.iter().copied().min().unwrap_or(0), 1),
            ("turn", self.turn, 1),
            ("iterations", self.iterations, 1),
        ];
        for (name, value, least) in counts {
            if value < least {
                return Err(setting(name, value.to_string(), &format!("{least} or more")));
            }
        }
        if !(self.spread > 0.0 && self.spread <= 1.0) {
            return Err(setting(
                "spread",
                self.spread.to_string(),
                "a share above 0 up to 1",
            ));
        }
        Ok(())
    }
}

/// The swarm of one window.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Window {
    /// What each direction moves: variables and weights.
    bumps: Vec<Vec<(usize, f64)>>,
    /// Over the bumps' heights, from the context on.
    distribution: Distribution,
    /// The present particles.
    heights: Vec<DVector<f64>>,
}

impl Window {
    /// Adds the bumps at these heights to a row of variables.
    fn add(&self, heights: &DVector<f64>, row: &mut [f64]) {
        for (bump, height) in self.bumps.iter().zip(heights.iter()) {
            for &(variable, weight) in bump {
                row[variable] += weight * height;
            }
        }
    }
}

/// Windows of particles about a common context, for a single objective.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct WindowSwarm {
    settings: WindowSettings,
    /// Bounds of the variables; bumps and context are in the variables' own units.
    bounds: Vec<(f64, f64)>,
    random: Random,
    /// The windows of each turn; together they cover all variables.
    turns: Vec<Vec<Window>>,
    context: Vec<f64>,
    best: (Vec<f64>, Worth),
    counters: Counters,
}

/// What the draws are for, in the counter.
const SAMPLE: u32 = 0x3d0;
/// How much wider a window looks at the start of its next turn than it did at the end of the last, since the others have
/// moved on.
const REOPENED: f64 = 1.5;

impl WindowSwarm {
    /// A swarm over the variables of `problem` about `start` (in the variables' units). The variables stand for the same
    /// thing at one place after another, so one spread fits all.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting that is out of its range, and for a problem of several objectives.
    pub fn new(problem: &Problem, start: &[f64], settings: WindowSettings) -> Result<Self> {
        settings.validate()?;
        Space::of_one_objective(problem)?;
        if let Some(v) = problem.variables.iter().find(|v| v.whole) {
            let expected = "a swarm in windows moves real numbers only";
            return Err(Error::input("the problem", &v.name, "whole numbers", expected));
        }
        let n = problem.variables.len();
        if start.len() != n || start.iter().any(|x| !x.is_finite()) {
            return Err(Error::input(
                "the swarm's settings",
                "start",
                format!("{} values", start.len()),
                format!("{n} finite ones, one per variable"),
            ));
        }
        let bounds: Vec<(f64, f64)> = problem.variables.iter().map(|v| (v.lower, v.upper)).collect();
        let range = bounds.iter().map(|(lower, upper)| upper - lower).sum::<f64>() / n as f64;
        let mut turns = Vec::new();
        for &stride in &settings.strides {
            for shifted in [false, true] {
                let windows = windows(n, stride, settings.size, settings.cyclic, shifted);
                // A single window leaves no border to shift.
                if shifted && windows.len() == 1 {
                    continue;
                }
                let window = |bumps: Vec<Vec<(usize, f64)>>| Window {
                    distribution: Distribution::new(DVector::zeros(bumps.len()), settings.spread * range),
                    heights: Vec::new(),
                    bumps,
                };
                turns.push(windows.into_iter().map(window).collect());
            }
        }
        let held = start.iter().zip(&bounds);
        let context: Vec<f64> = held.map(|(x, (lower, upper))| x.clamp(*lower, *upper)).collect();
        let mut swarm = Self {
            random: Random::new(settings.seed),
            best: (context.clone(), Worth::FAILED),
            bounds,
            turns,
            context,
            counters: Counters::default(),
            settings,
        };
        swarm.sample();
        Ok(swarm)
    }

    /// The best candidate so far, in the variables' units, and what it is worth.
    pub fn best_candidate(&self) -> (Vec<f64>, Worth) {
        self.best.clone()
    }

    /// Turns of every kind that have been completed.
    pub fn rounds(&self) -> usize {
        self.counters.iteration / (self.settings.turn * self.turns.len())
    }

    fn turn(&self) -> usize {
        self.counters.iteration / self.settings.turn % self.turns.len()
    }

    fn sample(&mut self) {
        let (turn, when) = (self.turn(), self.counters.iteration as u32);
        let (random, count) = (self.random, self.settings.population);
        let sample = |(w, window): (usize, &mut Window)| {
            let draw = |particle: usize| {
                let who = (w * count + particle) as u32;
                window
                    .distribution
                    .sample(|k| random.normal(SAMPLE, when, who, k as u32))
            };
            window.heights = (0..count).map(draw).collect();
        };
        self.turns[turn].par_iter_mut().enumerate().for_each(sample);
    }

    /// Makes the context the row of one particle, by its window.
    fn place(&self, window: &Window, heights: &DVector<f64>, row: &mut [f64]) {
        window.add(heights, row);
        self.hold(row);
    }

    fn hold(&self, row: &mut [f64]) {
        for (x, (lower, upper)) in row.iter_mut().zip(&self.bounds) {
            *x = x.clamp(*lower, *upper);
        }
    }
}

/// The bumps of each window: middles `stride` variables apart, `size` of them in a window or as near to that as divides them
/// evenly, from half a window on if they are `shifted`.
fn windows(n: usize, stride: usize, size: usize, cyclic: bool, shifted: bool) -> Vec<Vec<Vec<(usize, f64)>>> {
    let count = n.div_ceil(stride);
    let parts = (count as f64 / size as f64).round().max(1.0) as usize;
    let half = if shifted { count.div_ceil(2 * parts) } else { 0 };
    let place = |k: usize| k * count / parts;
    let ranges: Vec<Vec<usize>> = if cyclic || !shifted {
        let shift = |k: usize| (k + half) % count;
        (0..parts)
            .map(|p| (place(p)..place(p + 1)).map(shift).collect())
            .collect()
    } else {
        // The ends of an open row are half windows of their own.
        let edges = (0..parts).map(|p| place(p) + half).chain([count]);
        let mut from = 0;
        edges
            .map(|to| {
                let to = to.min(count);
                (std::mem::replace(&mut from, to)..to).collect()
            })
            .collect()
    };
    let bumps = |middles: Vec<usize>| -> Vec<Vec<(usize, f64)>> {
        middles
            .into_iter()
            .map(|k| bump(k * stride, stride, n, cyclic))
            .collect()
    };
    ranges
        .into_iter()
        .filter(|range| !range.is_empty())
        .map(bumps)
        .collect()
}

/// A cubic B-spline about a variable, of knots `stride` variables apart; the variable alone if that is one.
fn bump(middle: usize, stride: usize, n: usize, cyclic: bool) -> Vec<(usize, f64)> {
    if stride == 1 {
        return vec![(middle, 1.0)];
    }
    let reach = (2 * stride as isize - 1).min((n as isize - 1) / 2);
    (-reach..=reach)
        .filter_map(|d| {
            let t = d.unsigned_abs() as f64 / stride as f64;
            let weight = if t < 1.0 {
                (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0
            } else {
                (2.0 - t).powi(3) / 6.0
            };
            let variable = middle as isize + d;
            let inside = (0..n as isize).contains(&variable);
            (cyclic || inside).then(|| (variable.rem_euclid(n as isize) as usize, weight))
        })
        .collect()
}

impl Optimiser for WindowSwarm {
    fn ask(&mut self) -> Vec<f64> {
        let (windows, count) = (&self.turns[self.turn()], self.settings.population);
        // The context comes first.
        let mut rows = self.context.repeat(1 + count * windows.len());
        let n = self.context.len();
        rows[n..]
            .par_chunks_exact_mut(count * n)
            .zip(windows)
            .for_each(|(rows, window)| {
                for (row, heights) in rows.chunks_exact_mut(n).zip(&window.heights) {
                    self.place(window, heights, row);
                }
            });
        rows
    }

    fn tell(&mut self, evaluation: &Evaluation) -> Result<()> {
        let (turn, count) = (self.turn(), self.settings.population);
        evaluation.check(1 + count * self.turns[turn].len(), 1)?;
        let worths = evaluation.worths(1);
        self.counters.evaluations += worths.len() as u64;
        let (own, worths) = (worths[0], &worths[1..]);
        if own < self.best.1 {
            self.best = (self.context.clone(), own);
        }
        let least = (0..worths.len()).min_by(|&a, &b| worths[a].order(&worths[b]));
        if let Some(i) = least.filter(|&i| worths[i] < self.best.1) {
            let window = &self.turns[turn][i / count];
            let mut row = self.context.clone();
            self.place(window, &window.heights[i % count], &mut row);
            self.best = (row, worths[i]);
        }
        let learn = |(window, worths): (&mut Window, &[Worth])| {
            let mut order: Vec<usize> = (0..count).collect();
            order.sort_by(|&a, &b| worths[a].order(&worths[b]));
            // A window that failed as a whole, or to which nothing matters, says nothing about where to go.
            let (best, worst) = (worths[order[0]], worths[order[count - 1]]);
            if !best.succeeded() || best == worst {
                return None;
            }
            let ranked: Vec<&DVector<f64>> = order.iter().map(|&i| &window.heights[i]).collect();
            window.distribution.adapt(&ranked, true);
            let d = window.bumps.len();
            Some(std::mem::replace(
                &mut window.distribution.mean,
                DVector::zeros(d),
            ))
        };
        let moves: Vec<Option<DVector<f64>>> = self.turns[turn]
            .par_iter_mut()
            .zip(worths.par_chunks_exact(count))
            .map(learn)
            .collect();
        let mut context = std::mem::take(&mut self.context);
        for (window, moved) in self.turns[turn].iter().zip(&moves) {
            if let Some(moved) = moved {
                window.add(moved, &mut context);
            }
        }
        self.hold(&mut context);
        self.context = context;
        self.counters.iteration += 1;
        if self.counters.iteration.is_multiple_of(self.settings.turn) {
            // All windows moved at once; what that has spoilt is taken back.
            self.context.clone_from(&self.best.0);
            let next = self.turn();
            for window in &mut self.turns[next] {
                window.distribution.widen(REOPENED);
            }
        }
        self.sample();
        Ok(())
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn to_checkpoint(&self) -> Result<Vec<u8>> {
        to_bytes(self)
    }

    fn planned_iterations(&self) -> usize {
        self.settings.iterations
    }

    fn front(&self) -> Front {
        Front::single(self.best_candidate())
    }

    fn best(&self) -> Vec<f64> {
        vec![self.best.1.cost]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Objective, Variable};

    /// Every variable is moved in every turn, and by as much: with bumps, splines add up to one where none is cut off.
    #[test]
    fn windows_cover_all_variables() {
        for (n, stride, size, cyclic) in [
            (361, 1, 12, true),
            (96, 8, 12, true),
            (50, 2, 7, false),
            (9, 1, 12, false),
        ] {
            for shifted in [false, true] {
                let windows = windows(n, stride, size, cyclic, shifted);
                let mut sum = vec![0.0; n];
                for (variable, weight) in windows.iter().flatten().flatten() {
                    sum[*variable] += weight;
                }
                let inner = if cyclic && n % stride == 0 || stride == 1 {
                    0..n
                } else {
                    2 * stride..n - 3 * stride
                };
                assert!(sum.iter().all(|s| *s > 0.0));
                assert!(
                    sum[inner].iter().all(|s| (s - 1.0).abs() < 1e-12),
                    "{n} {stride}: {sum:?}"
                );
            }
        }
    }

    /// A chain held at both ends that wants to be straight (sum of squared second differences, condition number of the
    /// order of n^4): zero at the optimum. That the waves of the start go, not how fast the longest ones do, is what is
    /// held here; how close lines come to their optima is tested where they are searched for.
    #[test]
    fn a_stiff_chain_straightens() {
        let n = 64;
        let problem = Problem {
            variables: (0..n)
                .map(|i| Variable::new(format!("x{i}"), "-", -1.0, 1.0))
                .collect(),
            objectives: vec![Objective::new("stiffness", "-")],
        };
        let cost = |x: &[f64]| {
            let bends: f64 = x.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2)).sum();
            bends + x[0].powi(2) + x[n - 1].powi(2)
        };
        let start: Vec<f64> = (0..n).map(|i| 0.5 * (i as f64 * 0.4).sin()).collect();
        let first = cost(&start);
        let settings = WindowSettings {
            strides: vec![8, 4, 2, 1],
            iterations: 1600,
            cyclic: false,
            ..WindowSettings::default()
        };
        let mut swarm = WindowSwarm::new(&problem, &start, settings).unwrap();
        while !swarm.done() {
            let rows = swarm.ask();
            let scored = rows.chunks_exact(n).map(|x| (vec![cost(x)], None)).collect();
            swarm.tell(&Evaluation::of_rows(scored)).unwrap();
        }
        let (x, best) = swarm.best_candidate();
        assert!(best.cost < 0.05 * first, "{first} to {best:?}");
        assert_eq!(best.cost, cost(&x));
    }
}
