//! One line for one objective, found by swarms alone: no gradients, and a cold start.
//!
//! The line is found from coarse to fine. The first level has few control points and few sections, and each level has
//! twice those of the level before, whose line it starts from; a [`WindowSwarm`] does each.

use crate::error::{Error, Result};
use crate::evaluate::line::{CpuLineEvaluator, LineObjective, LineProblem, open_line_evaluator};
use crate::evaluate::{BackendChoice, BackendInfo, DeviceFaults, Evaluator, Losses};
use crate::line::{Parametrisation, PointMass, SectionRow, TERMS};
use crate::swarm::{Optimiser, WindowSettings, WindowSwarm};
use crate::track::CrossSections;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::Instant;

/// What is to be found, and where lines are evaluated.
#[derive(Clone, Copy, Debug)]
pub struct LineSearch<'a> {
    /// The sections, which the middle of the car may use from end to end.
    pub cross_sections: &'a CrossSections,
    /// What is to be small.
    pub objective: LineObjective,
    /// The car, without which there are no lap times.
    pub car: Option<&'a PointMass>,
    /// Greatest speed at the start of an open circuit (m/s).
    pub entry_mps: f64,
    /// The line that the search starts about, `alpha` at every section; the reference line if there is none.
    pub start: Option<&'a [f64]>,
    /// The backend.
    pub backend: BackendChoice,
    /// Part of the name of the GPU to use.
    pub adapter: Option<&'a str>,
    /// What is known to go wrong with devices, and is not told again where another is opened.
    pub known_faults: &'a [String],
}

/// Settings of [`search_line`].
#[derive(Clone, Debug, PartialEq)]
pub struct LineSearchSettings {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Particles of one window.
    pub population: usize,
    /// Control points of one window.
    pub window: usize,
    /// Distances between the middles of the bumps that windows move, in control points, by turns.
    pub strides: Vec<usize>,
    /// Iterations of a turn.
    pub turn: usize,
    /// Most rounds of all turns on a level.
    pub rounds: usize,
    /// A level ends when a round gains less than this share of the cost, but for the last, which goes on to a fifth of it.
    pub least_gain: f64,
    /// Control points that the first level has at least, if the circuit has sections for them.
    pub first_controls: usize,
    /// Sections for each control point on the last level, 1 or more.
    pub sections_per_control: f64,
    /// Standard deviation at the start of the first level, as a share of the control points' range.
    pub spread: f64,
    /// How far beyond the road control points may reach, as a share of its width.
    pub overshoot: f64,
    /// Whether lines that leave the road are brought back by moving their control points, which keeps them smooth; else
    /// they are held at its edges.
    pub inside: bool,
}

/// What a line costs more, as a share, for each mean width squared that its control points had to be moved by to bring it
/// inside: enough that swarms do not wander off where nothing is to be told.
const MOVED_COST: f64 = 0.1;

impl Default for LineSearchSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            population: 16,
            window: 12,
            strides: vec![8, 4, 2, 1],
            turn: 16,
            rounds: 8,
            least_gain: 1e-4,
            first_controls: 60,
            sections_per_control: 1.0,
            spread: 0.1,
            overshoot: 0.25,
            inside: false,
        }
    }
}

impl LineSearchSettings {
    /// Checks every setting.
    ///
    /// # Errors
    /// [`Error::Input`] naming the setting.
    pub fn validate(&self) -> Result<()> {
        let wrong = |name: &str, found: String, expected: &str| {
            Err(Error::input("the line search's settings", name, found, expected))
        };
        self.windows(true, 0, self.strides.clone()).validate()?;
        if self.rounds == 0 {
            return wrong("rounds", "0".to_owned(), "1 or more");
        }
        if self.first_controls < TERMS {
            return wrong("first_controls", self.first_controls.to_string(), "4 or more");
        }
        let numbers = [
            ("least_gain", self.least_gain, 0.0, 1.0),
            ("sections_per_control", self.sections_per_control, 1.0, 1000.0),
            ("overshoot", self.overshoot, 0.0, 10.0),
        ];
        for (name, value, least, most) in numbers {
            if !(least..=most).contains(&value) {
                return wrong(name, value.to_string(), &format!("{least} to {most}"));
            }
        }
        Ok(())
    }

    /// The swarm's settings on a level.
    fn windows(&self, cyclic: bool, level: usize, strides: Vec<usize>) -> WindowSettings {
        // Later levels mend what the first has found.
        let spread = self.spread * if level == 0 { 1.0 } else { 0.3 };
        WindowSettings {
            size: self.window,
            population: self.population,
            turn: self.turn,
            // A round has two turns for each stride at most.
            iterations: self.rounds * self.turn * 2 * strides.len(),
            strides,
            // Levels draw from seeds of their own.
            seed: self.seed.wrapping_add((level as u64) << 32),
            spread,
            cyclic,
        }
    }
}

/// What was reached by the end of a level.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelRow {
    /// Control points.
    pub controls: usize,
    /// Sections that lines were evaluated on.
    pub sections: usize,
    /// Lines evaluated so far, on all levels.
    pub evaluations: u64,
    /// The objective over all sections, in `f64`.
    pub best: f64,
    /// Time so far (s).
    pub elapsed_s: f64,
}

/// The line that a search has found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FoundLine {
    /// `alpha` at every section.
    pub alpha: Vec<f64>,
    /// The objective, in `f64`.
    pub cost: f64,
    /// Lines evaluated.
    pub evaluations: u64,
    /// The levels.
    pub history: Vec<LevelRow>,
    /// What went wrong.
    pub losses: Losses,
    /// What evaluated in the end; nothing before anything was evaluated.
    pub backend: Option<BackendInfo>,
}

impl FoundLine {
    /// A line that is known, before anything is evaluated.
    pub(super) fn given(alpha: Vec<f64>, cost: f64) -> Self {
        Self {
            alpha,
            cost,
            ..Self::default()
        }
    }
}

/// Where a search is: all that it takes to resume it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct LineState {
    level: usize,
    /// `alpha` that the level started from, as the control points have it.
    sums: Vec<f64>,
    found: FoundLine,
    /// The level's swarm, once it has begun.
    swarm: Option<Box<WindowSwarm>>,
    /// The cost when the last round ended.
    before: f64,
    rounds: usize,
    elapsed_s: f64,
}

/// Looks for the line of the least objective until all levels are done or `observe` breaks off. Without a break the result
/// is a function of the search and its settings. A `state` is that of the same search that was interrupted. After each
/// iteration `observe` is told the lines evaluated so far, the least cost on the level, over its own sections, and the state.
///
/// # Errors
/// [`Error::Input`] for a setting out of its range or a start that does not fit, those of [`LineProblem::new`] and of
/// `observe`, and [`Error::Device`] if the device fails.
pub fn search_line(
    search: &LineSearch,
    settings: &LineSearchSettings,
    state: Option<LineState>,
    mut observe: impl FnMut(u64, f64, &LineState) -> Result<ControlFlow<()>>,
) -> Result<FoundLine> {
    settings.validate()?;
    let clock = Instant::now();
    let cross_sections = search.cross_sections;
    let n = cross_sections.len();
    let judge = problem(search, cross_sections.clone(), Parametrisation::sections())?;
    let mut state = match state {
        Some(state) => state,
        None => {
            // A line is handed on by its `alpha` as the control points have it, which may lie beyond the edges.
            let sums = judge.candidate(search.start.unwrap_or(&cross_sections.reference))?;
            LineState {
                found: FoundLine::given(sums.clone(), cost(&judge, &sums)?),
                sums,
                ..LineState::default()
            }
        }
    };
    let before_s = state.elapsed_s;
    let levels = levels(n, settings);
    while let Some(&(controls, sections)) = levels.get(state.level) {
        let level = state.level;
        let places = thinned_places(n, sections, cross_sections.closed);
        let way = Parametrisation::control_points(controls).with_overshoot(settings.overshoot);
        let line = problem(search, thinned(cross_sections, &places), way.clone())?;
        if state.swarm.is_none() {
            let start: Vec<f64> = places.iter().map(|&i| state.sums[i]).collect();
            let strides = strides(&settings.strides, controls);
            let windows = settings.windows(cross_sections.closed, level, strides);
            let swarm = WindowSwarm::new(&line.problem, &line.candidate(&start)?, windows)?;
            state.swarm = Some(Box::new(swarm));
            (state.before, state.rounds) = (f64::INFINITY, 0);
        }
        let mut evaluator = open_line_evaluator(&line, search.backend, search.adapter)?;
        let mut faults = DeviceFaults::beyond(search.known_faults, evaluator.as_ref());
        let last = level + 1 == levels.len();
        let least_gain = settings.least_gain * if last { 0.2 } else { 1.0 };
        let mut stopped = false;
        let mut settled = false;
        while let Some(swarm) = state.swarm.as_mut().filter(|s| !s.done())
            && !stopped
            && !settled
        {
            let mut candidates = swarm.ask();
            let mut moves = Vec::new();
            if settings.inside {
                let rows = candidates.par_chunks_mut(line.dimensions());
                rows.map(|row| line.bring_inside(row))
                    .collect_into_vec(&mut moves);
            }
            let mut evaluation = evaluator.evaluate(&candidates)?;
            for (cost, moved) in evaluation.objectives.iter_mut().zip(moves) {
                *cost *= 1.0 + MOVED_COST * moved;
            }
            swarm.tell(&evaluation)?;
            let losses = &mut state.found.losses;
            losses.note(&evaluation.failure_counts(), &mut faults, evaluator.as_ref());
            state.found.backend = Some(evaluator.backend());
            let best = swarm.best_candidate().1.cost;
            let evaluations = state.found.evaluations + swarm.evaluations();
            if swarm.rounds() > state.rounds {
                state.rounds = swarm.rounds();
                settled = state.before - best < least_gain * best.abs();
                state.before = best;
            }
            state.elapsed_s = before_s + clock.elapsed().as_secs_f64();
            // A settled level is left before anyone can break off: its swarm would go on if it were taken up again.
            if !settled {
                stopped = observe(evaluations, best, &state)?.is_break();
            }
        }
        let Some(swarm) = state.swarm.take() else { break };
        let found = &mut state.found;
        found.evaluations += swarm.evaluations();
        let whole = problem(search, cross_sections.clone(), way)?;
        let mut candidate = swarm.best_candidate().0;
        if settings.inside {
            line.bring_inside(&mut candidate);
        }
        // Control points count in mean widths of the road, and the mean is over other cross-sections here.
        let scale = mean_width_m(line.cross_sections()) / mean_width_m(cross_sections);
        let candidate: Vec<f64> = candidate.iter().map(|c| 0.5 + scale * (c - 0.5)).collect();
        let row = |row: &SectionRow<f64>| {
            let terms = row.weights.iter().zip(row.sources);
            let terms = terms.map(|(weight, source)| weight * candidate[source as usize]);
            row.constant + terms.sum::<f64>()
        };
        state.sums = whole.plan().rows.iter().map(row).collect();
        found.alpha = whole.alpha(&candidate);
        found.cost = cost(&judge, &found.alpha)?;
        found.history.push(LevelRow {
            controls,
            sections,
            evaluations: found.evaluations,
            best: found.cost,
            elapsed_s: before_s + clock.elapsed().as_secs_f64(),
        });
        if stopped {
            break;
        }
        state.level += 1;
    }
    Ok(state.found)
}

fn problem(search: &LineSearch, cross_sections: CrossSections, way: Parametrisation) -> Result<LineProblem> {
    let car = search.car.cloned();
    LineProblem::new(cross_sections, way, &[search.objective], car, search.entry_mps)
}

/// The objective of one candidate, in `f64`.
fn cost(line: &LineProblem, candidate: &[f64]) -> Result<f64> {
    Ok(CpuLineEvaluator::new(line).evaluate(candidate)?.objectives[0])
}

/// Control points and sections of each level.
fn levels(n: usize, settings: &LineSearchSettings) -> Vec<(usize, usize)> {
    let most = (n as f64 / settings.sections_per_control).round() as usize;
    let most = most.clamp(TERMS.min(n), n);
    let mut levels = vec![(most, n)];
    while levels[0].0 >= 2 * settings.first_controls {
        let controls = levels[0].0 / 2;
        // Two sections for each control point at least, so that no line gains by what lies between sections.
        let per_control = settings.sections_per_control.max(2.0);
        let sections = ((controls as f64 * per_control).ceil() as usize).min(n);
        levels.insert(0, (controls, sections));
    }
    levels
}

/// The strides that leave a window something to do.
fn strides(wanted: &[usize], controls: usize) -> Vec<usize> {
    let fit: Vec<usize> = wanted.iter().copied().filter(|s| controls >= 8 * s).collect();
    if fit.is_empty() { vec![1] } else { fit }
}

/// Which of `n` cross-sections are kept, evenly spread; of an open row both ends.
fn thinned_places(n: usize, kept: usize, closed: bool) -> Vec<usize> {
    let kept = kept.clamp(2, n);
    if closed {
        (0..kept).map(|i| i * n / kept).collect()
    } else {
        (0..kept).map(|i| i * (n - 1) / (kept - 1)).collect()
    }
}

/// Some of the cross-sections.
fn thinned(cross_sections: &CrossSections, places: &[usize]) -> CrossSections {
    CrossSections {
        station_m: places.iter().map(|&i| cross_sections.station_m[i]).collect(),
        right_m: places.iter().map(|&i| cross_sections.right_m[i]).collect(),
        left_m: places.iter().map(|&i| cross_sections.left_m[i]).collect(),
        reference: places.iter().map(|&i| cross_sections.reference[i]).collect(),
        drs: Vec::new(),
        relief: cross_sections
            .relief
            .as_ref()
            .map(|relief| relief.some(places.iter().copied())),
        ..cross_sections.clone()
    }
}

fn mean_width_m(cross_sections: &CrossSections) -> f64 {
    let ends = cross_sections.right_m.iter().zip(&cross_sections.left_m);
    ends.map(|(right, left)| right.distance(*left)).sum::<f64>() / cross_sections.len() as f64
}

#[cfg(test)]
mod tests;
