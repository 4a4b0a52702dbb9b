//! Which parameters a log can tell: as many as still make the car drive better what was not fitted.

use super::polish::polish_observed;
use super::setup::CHANNELS;
use crate::error::Result;
use crate::evaluate::replay::{ReplayProblem, Residuals, Window, trace};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// A number of parameters that was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tried {
    /// Parameters found at once.
    pub parameters: usize,
    /// Error over the windows that were not fitted, as a share of the channels' spread: root mean square.
    pub held_out_error: f64,
}

/// What a choice came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The parameters, those that explain most first.
    pub names: Vec<String>,
    /// How many there were to choose from.
    pub among: usize,
    /// Error of the starting car over the windows that were looked at.
    pub starting_error: Option<f64>,
    /// The numbers that were tried, in ascending order.
    pub tried: Vec<Tried>,
    /// Why all of them are found, where nothing could be chosen.
    pub not_chosen: Option<String>,
    /// The values that they were fitted to, in the order of the names; none where nothing could be chosen.
    #[serde(skip)]
    pub values: Vec<f64>,
    /// Whether the time was over before the choice was finished.
    #[serde(skip)]
    pub cut_short: bool,
}

impl Choice {
    /// The values that it came to, as a candidate of this problem; nothing where nothing could be chosen.
    pub(super) fn candidate(&self, replay: &ReplayProblem) -> Option<Vec<f64>> {
        let value = |name: &str| {
            let place = self.names.iter().position(|n| n == name)?;
            self.values.get(place).copied()
        };
        replay.problem.variables.iter().map(|v| value(&v.name)).collect()
    }

    /// The choice in words.
    pub fn to_text(&self) -> String {
        let listed = self.names.join(", ");
        if let Some(reason) = &self.not_chosen {
            return format!("All {} parameters are to be found, since {reason}.", self.among);
        }
        let ended = if self.cut_short {
            " The time was over before the choice was finished."
        } else {
            ""
        };
        let errors = self
            .tried
            .iter()
            .map(|t| format!("{} {:.4}", t.parameters, t.held_out_error));
        let errors: Vec<String> = errors.collect();
        format!(
            "Of {} parameters the log chose {}: {listed}. Errors on windows that were not fitted, as a share of the channels' \
             spread, by the number of parameters: 0 {:.4}, {}.{ended}",
            self.among,
            self.names.len(),
            self.starting_error.unwrap_or(f64::NAN),
            errors.join(", ")
        )
    }
}

/// Numbers of parameters that are tried, besides all of them.
const LADDER: [usize; 12] = [1, 2, 3, 4, 6, 8, 11, 15, 20, 30, 45, 70];
/// Scored time that the choice looks at, s: as many windows as that, spread over the log.
const LOOKS_AT_S: f64 = 120.0;
/// Runge-Kutta steps of one drive through all of these, at the most.
const LOOKS_AT_STEPS: f64 = 20_000.0;
/// Steps of each polish.
const STEPS: usize = 10;
/// A longer list must lower the error by this share, or the shorter one is taken.
const WORTH: f64 = 0.005;
/// Share of the windows that were not fitted which a list has to drive. A window that it loses, such as one in which the car was already
/// beyond its limit, does not count, neither for the list nor for the one that it is compared with.
const LEAST_DRIVEN: f64 = 0.9;
/// Lists that are tried beyond the best one.
const PATIENCE: usize = 3;
/// An error under this share of the spread is rounding.
const EXACT: f64 = 1e-7;
/// Of a column, the part that those before it do not explain must be more than this share of it.
const INDEPENDENT: f64 = 1e-3;

/// A list on the way: which parameters of the pool are free, and the value of each of the pool.
struct Path<'a> {
    pool: &'a ReplayProblem,
    weights: [f64; CHANNELS],
    chosen: Vec<usize>,
    values: Vec<f64>,
    /// Whether the time is over.
    over: bool,
}

impl<'a> Path<'a> {
    /// The starting car, whose figures may be outside the bounds as long as they are not free.
    fn begin(pool: &'a ReplayProblem, weights: [f64; CHANNELS]) -> Self {
        Self {
            pool,
            weights,
            chosen: Vec::new(),
            values: pool.free.values_in(pool.free.base()),
            over: false,
        }
    }

    /// Adds parameters until there are `count`, those first that lower the error most by the present derivatives, and fits all of
    /// them. `false` if the car is lost or nothing more can be told.
    fn extend_to(&mut self, count: usize, watch: &mut dyn FnMut() -> ControlFlow<()>) -> Result<bool> {
        self.over |= watch().is_break();
        if self.over {
            return Ok(false);
        }
        let Some(residuals) = self.pool.residuals(&self.values) else {
            return Ok(false);
        };
        let before = self.chosen.len();
        self.add(count, &residuals);
        if self.chosen.len() == before {
            return Ok(false);
        }
        let part = part_of(self.pool, &self.chosen)?;
        let from: Vec<f64> = self.chosen.iter().map(|&k| self.values[k]).collect();
        if let Some(polished) = polish_observed(&part, &from, self.weights, STEPS, watch) {
            self.over |= polished.interrupted;
            for (&k, x) in self.chosen.iter().zip(polished.candidate) {
                self.values[k] = x;
            }
        }
        Ok(true)
    }

    fn add(&mut self, count: usize, residuals: &Residuals) {
        let variables = &self.pool.problem.variables;
        let weighted = |values: &[f64], by: f64| -> Vec<f64> {
            let values = values.iter().enumerate();
            values.map(|(i, x)| x * self.weights[i % CHANNELS] * by).collect()
        };
        let mut left = weighted(&residuals.errors, 1.0);
        let noise = dot(&left, &left) / left.len().max(1) as f64;
        let mut columns: Vec<Vec<f64>> = (0..variables.len())
            .map(|k| weighted(&residuals.columns[k], variables[k].upper - variables[k].lower))
            .collect();
        let whole: Vec<f64> = columns.iter().map(|c| dot(c, c)).collect();
        let mut order = self.chosen.clone();
        for place in 0..count {
            if place == order.len() {
                let gain = |k: usize| -> f64 {
                    let own = dot(&columns[k], &columns[k]);
                    // Its standard error is below that of a guess anywhere between the bounds.
                    let told = own > 12.0 * noise && own > INDEPENDENT * INDEPENDENT * whole[k];
                    if order.contains(&k) || !told {
                        return 0.0;
                    }
                    let v = &variables[k];
                    let share = (self.values[k] - v.lower) / (v.upper - v.lower);
                    let along = dot(&columns[k], &left);
                    let step = (-along / own).clamp(-share, 1.0 - share);
                    -(2.0 * step * along + step * step * own)
                };
                let best = (0..variables.len())
                    .map(|k| (k, gain(k)))
                    .max_by(|a, b| a.1.total_cmp(&b.1));
                match best {
                    Some((k, gain)) if gain > 0.0 => order.push(k),
                    _ => break,
                }
            }
            // What the parameter explains is taken from the errors and from the others.
            let column = columns[order[place]].clone();
            let own = dot(&column, &column);
            if own <= 0.0 {
                continue;
            }
            take_off(&mut left, &column, own);
            for (k, other) in columns.iter_mut().enumerate() {
                if !order[..=place].contains(&k) {
                    take_off(other, &column, own);
                }
            }
        }
        self.chosen = order;
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn take_off(from: &mut [f64], column: &[f64], own: f64) {
    let share = dot(from, column) / own;
    for (x, c) in from.iter_mut().zip(column) {
        *x -= share * c;
    }
}

/// The pool's problem with some of its parameters free.
fn part_of(pool: &ReplayProblem, chosen: &[usize]) -> Result<ReplayProblem> {
    let variables = &pool.problem.variables;
    let free = chosen.iter().map(|&k| {
        let v = &variables[k];
        (pool.free.parameters[k].clone(), v.lower, v.upper)
    });
    ReplayProblem::new(
        pool.free.car.clone(),
        free.collect(),
        pool.plan.samples.clone(),
        pool.plan.windows.clone(),
        (pool.interval_s, pool.plan.fractions.len()),
        pool.plan.norm,
        pool.objectives.clone(),
    )
}

/// The numbers that are tried of so many parameters.
fn ladder(all: usize) -> impl Iterator<Item = usize> {
    LADDER.into_iter().filter(move |n| *n < all).chain([all])
}

/// Chooses among the parameters of `pool` by cross-validation on its windows: lists of rising length are fitted to one half of them
/// and judged on the other, and the other way round. Nothing is random. `watch` is asked before each drive and may break the choice
/// off: it is then that of the lists which were tried.
///
/// # Errors
/// Those of putting a problem together.
pub(super) fn choose(
    pool: &ReplayProblem,
    scales: &[f64; CHANNELS],
    watch: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Choice> {
    let weights = scales.map(|s| 1.0 / s);
    let windows = looked_at(pool);
    let with = |windows: Vec<Window<f64>>| {
        let mut pool = pool.clone();
        pool.plan.windows = windows;
        pool
    };
    let half = |which: usize| -> Vec<Window<f64>> {
        let each = windows.iter().enumerate();
        each.filter(|(i, _)| i % 2 == which).map(|(_, w)| *w).collect()
    };
    let all = pool.dimensions();
    let name = |k: usize| pool.problem.variables[k].name.clone();
    let every_one = |starting_error: Option<f64>, reason: &str| Choice {
        names: (0..all).map(name).collect(),
        among: all,
        starting_error,
        tried: Vec::new(),
        not_chosen: Some(reason.to_owned()),
        values: Vec::new(),
        cut_short: false,
    };
    let halves = [with(half(0)), with(half(1))];
    if halves.iter().any(|half| half.plan.windows.is_empty()) {
        return Ok(every_one(
            None,
            "the starting car drives fewer than two windows to their end",
        ));
    }
    let judged = |paths: &[Path<'_>; 2]| -> Vec<Square> {
        let each = paths.iter().zip([1, 0]);
        each.flat_map(|(path, other)| squares(&halves[other], &path.values, &weights))
            .collect()
    };
    let mut paths = [0, 1].map(|half| Path::begin(&halves[half], weights));
    let start = judged(&paths);
    let Some(starting_error) = error_over(&start, &start) else {
        return Ok(every_one(None, "the starting car is lost"));
    };
    if starting_error < EXACT {
        return Ok(every_one(
            Some(starting_error),
            "the starting car drives the log exactly",
        ));
    }
    let mut tried: Vec<Tried> = Vec::new();
    let mut best = (1, start);
    // What the first half came to with the best list: it stands where the time does not reach to fit all windows.
    let mut found = (Vec::new(), Vec::new());
    let mut cut_short = false;
    let mut since = 0;
    for count in ladder(all) {
        let mut longer = false;
        for path in &mut paths {
            longer |= path.extend_to(count, watch)?;
        }
        cut_short = paths.iter().any(|path| path.over);
        if cut_short {
            break;
        }
        if !longer {
            break;
        }
        since += 1;
        let own = judged(&paths);
        let driven = own.iter().flatten().count();
        if driven as f64 >= LEAST_DRIVEN * own.len() as f64
            && let Some(held_out_error) = error_over(&own, &own)
        {
            tried.push(Tried {
                parameters: count,
                held_out_error,
            });
            let [here, there] = [error_over(&own, &best.1), error_over(&best.1, &own)];
            let (here, there) = here.zip(there).unwrap_or((f64::INFINITY, 0.0));
            if here < there * (1.0 - WORTH) {
                best = (count, own);
                found = (paths[0].chosen.clone(), paths[0].values.clone());
                since = 0;
            }
        }
        if since > PATIENCE || error_over(&best.1, &best.1).is_some_and(|error| error < EXACT) {
            break;
        }
    }
    let whole = with(windows.clone());
    let mut path = Path::begin(&whole, weights);
    for count in ladder(all).take_while(|n| *n < best.0).chain([best.0]) {
        path.extend_to(count, watch)?;
    }
    cut_short |= path.over;
    if !cut_short {
        found = (path.chosen, path.values);
    }
    let (chosen, values) = found;
    if chosen.is_empty() {
        let reason = if cut_short {
            "the time was over before the log chose among them"
        } else {
            "the log tells none of them by itself"
        };
        return Ok(Choice {
            cut_short,
            ..every_one(Some(starting_error), reason)
        });
    }
    Ok(Choice {
        values: chosen.iter().map(|&k| values[k]).collect(),
        cut_short,
        names: chosen.into_iter().map(name).collect(),
        among: all,
        starting_error: Some(starting_error),
        tried,
        not_chosen: None,
    })
}

/// Sum of the squared weighted errors over one window, and their number; none if the car is lost there.
type Square = Option<[f64; 2]>;

/// Those of each window.
fn squares(problem: &ReplayProblem, values: &[f64], weights: &[f64; CHANNELS]) -> Vec<Square> {
    let mut one = problem.clone();
    let mut square = |window: &Window<f64>| {
        one.plan.windows = vec![*window];
        let errors = one.residuals(values)?.errors;
        let squares = errors
            .iter()
            .enumerate()
            .map(|(i, e)| (e * weights[i % CHANNELS]).powi(2));
        Some([squares.sum(), errors.len() as f64])
    };
    problem.plan.windows.iter().map(&mut square).collect()
}

/// The error over those windows that `others` drive, too: root mean square. None where there is no such window.
fn error_over(of: &[Square], others: &[Square]) -> Option<f64> {
    let both = of.iter().zip(others).filter_map(|(own, other)| other.and(*own));
    let [sum, count] = both.fold([0.0, 0.0], |sum, s| [sum[0] + s[0], sum[1] + s[1]]);
    (count > 0.0).then(|| (sum / count).sqrt())
}

/// As many windows as [`LOOKS_AT_S`] and [`LOOKS_AT_STEPS`] have room for, evenly spread, of those that the starting car drives to their
/// end.
fn looked_at(pool: &ReplayProblem) -> Vec<Window<f64>> {
    let drives = |w: &&Window<f64>| trace(pool.free.base(), pool.tyre_model(), &pool.plan, w).drives;
    let windows: Vec<Window<f64>> = pool.plan.windows.iter().filter(drives).copied().collect();
    let scored = |w: &Window<f64>| (w.end - w.start - w.scored_from) as f64 * pool.interval_s;
    let total: f64 = windows.iter().map(scored).sum();
    let samples: usize = windows.iter().map(|w| w.end - w.start).sum();
    let steps = (samples * pool.plan.fractions.len()) as f64;
    let every = (total / LOOKS_AT_S).max(steps / LOOKS_AT_STEPS).ceil().max(1.0) as usize;
    // Pairs, so that both halves have windows side by side.
    let pairs = windows.chunks(2).step_by(every);
    pairs.flatten().copied().collect()
}

#[cfg(test)]
mod tests {
    use super::super::settings::Unknowns;
    use super::super::{IdentifySettings, search_with, set_up_until};
    use crate::evaluate::replay::open_evaluator;
    use crate::study::framework::state_file::StateFile;
    use crate::vehicle::Car;
    use std::ops::ControlFlow;
    use std::sync::atomic::AtomicBool;

    /// A window that one of two lists loses counts for neither.
    #[test]
    fn lists_are_compared_on_the_windows_that_both_drive() {
        let one = [Some([4.0, 1.0]), Some([9.0, 1.0]), None];
        let other = [None, Some([1.0, 1.0]), Some([100.0, 1.0])];
        assert_eq!(super::error_over(&one, &other), Some(3.0));
        assert_eq!(super::error_over(&other, &one), Some(1.0));
        assert_eq!(super::error_over(&one, &one), Some(6.5f64.sqrt()));
        assert_eq!(super::error_over(&one, &[None; 3]), None);
    }

    /// A study that is stopped before anything is chosen or driven ends with the car that it began from, judged.
    #[test]
    fn a_choice_without_time_leaves_the_starting_car() {
        let folder = tempfile::tempdir().unwrap();
        let mut car = Car::bundled().unwrap();
        car.chassis.inertia_yaw *= 1.3;
        car.write(folder.path(), "other").unwrap();
        let settings = IdentifySettings {
            car: folder.path().join("other.toml").display().to_string(),
            free: Unknowns {
                among: Vec::new(),
                auto: true,
                unsaid: false,
            },
            ..IdentifySettings::default()
        };
        let setup = set_up_until(&settings, &AtomicBool::new(true)).unwrap();
        let choice = setup.choice.as_ref().unwrap();
        assert!(choice.names.len() == choice.among && choice.among > 10);
        let mut evaluator = open_evaluator(&setup.replay, settings.backend, None).unwrap();
        let mut observe = |_: &_| ControlFlow::Continue(());
        let state = (None, &mut StateFile::idle());
        let outcome = search_with(&settings, &setup, evaluator.as_mut(), state, &mut observe).unwrap();
        assert!(outcome.record.interrupted && outcome.history.is_empty());
        let replay = &setup.replay;
        assert_eq!(outcome.candidate, replay.free.values_in(replay.free.base()));
    }
}
