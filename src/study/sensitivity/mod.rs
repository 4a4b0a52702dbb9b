//! How much each parameter of a car matters to each channel of a lap: one at a time, and by shares of variance.
//!
//! The lap is replayed in short windows that restart from the log, so that the figures are of the parameters' own effect
//! and not of what a spin makes of it many corners later. All candidates are scored as populations.

mod page;
mod results;
mod sobol;

pub use results::{Summary, summarise, write_results};
pub use sobol::{DesignOutputs, MOST_SAMPLES, MOST_VARIABLES, SobolIndex, design, indices};

use crate::error::{Error, Result};
use crate::evaluate::gpu::DispatchWatch;
use crate::evaluate::replay::kernel::{CHANNELS, drive_window};
use crate::evaluate::replay::{CHANNEL_NAMES, ReplayProblem, Window, open_evaluator, trace};
use crate::evaluate::{BackendInfo, Evaluator, FailureCounts, add_failures};
use crate::study::identify::{FreeParameter, IdentifySettings, ObjectiveChoice, Setup, set_up};
use crate::study::journal::Recorder;
use crate::study::keeper::Keeper;
use crate::study::memory::{ANSWER, Kept};
use crate::study::run::Inputs;
use crate::vehicle::tyre::Tyre;
use crate::vehicle::{Car, CarModel, LinearTyre, MagicFormula, TyreModel};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// Settings of a sensitivity study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensitivitySettings {
    /// Car, log, windows, norm and backend, as an identification has them; of the free parameters only the names count.
    pub replay: IdentifySettings,
    /// How far every parameter goes either way, as a share of its value (of its range where it is nought).
    pub share: f64,
    /// Base samples of the variance-based indices: each costs as many evaluations as there are parameters, and two more.
    pub samples: usize,
    /// Resamples of their intervals.
    pub resamples: usize,
}

impl Default for SensitivitySettings {
    fn default() -> Self {
        Self {
            replay: IdentifySettings {
                window_s: Some(1.5),
                ..IdentifySettings::default()
            },
            share: 0.05,
            samples: 256,
            resamples: 400,
        }
    }
}

impl SensitivitySettings {
    /// Reads a study file: an identification's, with `share`, `samples` and `resamples` beside.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field for anything unknown or out of range.
    pub fn read(path: &Path) -> Result<Self> {
        let mut s = Self::default();
        let defaults = s.replay.clone();
        s.replay = IdentifySettings::read_beside(path, defaults, |root| {
            s.share = root.number("share", 1e-6, 1.0, "")?.unwrap_or(s.share);
            let count = |key: &str, most: usize, value: usize| -> Result<usize> {
                Ok(root.integer(key, 8, most as u64)?.map_or(value, |n| n as usize))
            };
            s.samples = count("samples", MOST_SAMPLES, s.samples)?;
            s.resamples = count("resamples", 100_000, s.resamples)?;
            Ok(())
        })?;
        Ok(s)
    }

    /// The study file that repeats this study.
    pub fn to_toml(&self) -> String {
        format!(
            "share = {:?}\nsamples = {}\nresamples = {}\n{}",
            self.share,
            self.samples,
            self.resamples,
            self.replay.to_toml()
        )
    }

    /// Cars that are driven: the base car, each parameter at each level, and the design of the indices.
    pub fn evaluations(&self) -> usize {
        let count = self.replay.free.len();
        1 + count * LEVELS.len() + self.samples * (count + 2)
    }

    /// What the study keeps: of every sample two rows of each car in the design and its costs, and the answer in a journal.
    pub fn kept(&self) -> [Kept; 1] {
        let variables = self.replay.free.len() as u64;
        let car = variables.saturating_mul(16).saturating_add(80 + ANSWER);
        [Kept {
            name: "samples",
            count: self.samples as u64,
            each: car.saturating_mul(variables + 2),
        }]
    }

    /// # Errors
    /// [`Error::Input`] naming the first setting that is out of its range.
    pub fn validate(&self) -> Result<()> {
        let refuse = |place: &str, found: String, expected: String| {
            Err(Error::input("the study", place, found, expected))
        };
        if !(self.share > 0.0 && self.share <= 1.0) {
            return refuse(
                "share",
                self.share.to_string(),
                "a share above 0 up to 1".to_owned(),
            );
        }
        if !(8..=MOST_SAMPLES).contains(&self.samples) {
            return refuse(
                "samples",
                self.samples.to_string(),
                format!("8 to {MOST_SAMPLES}"),
            );
        }
        let count = self.replay.free.len();
        if !(1..=MOST_VARIABLES).contains(&count) {
            return refuse("parameters", count.to_string(), format!("1 to {MOST_VARIABLES}"));
        }
        Ok(())
    }
}

/// Steps of the one-at-a-time study, as shares of how far a parameter goes.
pub const LEVELS: [f64; 4] = [-1.0, -0.5, 0.5, 1.0];

/// One evaluation of the one-at-a-time study.
#[derive(Clone, Debug, PartialEq)]
pub struct OneAtATime {
    /// The parameter, by its place among the free ones.
    pub parameter: usize,
    /// Its value.
    pub value: f64,
    /// The costs; nothing where the car did not drive.
    pub costs: Option<Vec<f64>>,
}

/// The least and greatest of an output at each sample, over all parameters at either end of their ranges.
#[derive(Clone, Debug, Default)]
pub struct Band {
    /// Along the lap (m).
    pub distance_m: Vec<f64>,
    /// The base car's output, channel by channel.
    pub base: Vec<Vec<f64>>,
    /// The least.
    pub low: Vec<Vec<f64>>,
    /// The greatest.
    pub high: Vec<Vec<f64>>,
}

/// The outcome of a study.
pub struct Outcome {
    /// Parameters with their ranges.
    pub ranges: Vec<FreeParameter>,
    /// Their values in the base car.
    pub base: Vec<f64>,
    /// The base car's costs, objective by objective.
    pub base_costs: Vec<f64>,
    /// One at a time, parameter by parameter and [level](LEVELS) by level.
    pub one_at_a_time: Vec<OneAtATime>,
    /// The indices, objective by objective and parameter by parameter.
    pub indices: Vec<Vec<SobolIndex>>,
    /// Base samples that were left out because one of their cars did not drive.
    pub left_out: usize,
    /// Outputs along the lap.
    pub band: Band,
    /// What evaluated in the end.
    pub backend: BackendInfo,
    /// What went wrong with devices and was got over.
    pub device_faults: Vec<String>,
    /// Candidates that failed, by reason.
    pub failures: FailureCounts,
    /// The longest that a dispatch kept the device (ms); nothing where none was at work.
    pub longest_dispatch_ms: Option<f64>,
    /// Candidates evaluated.
    pub evaluations: usize,
    /// Time that they took (s).
    pub elapsed_s: f64,
    /// Whether the observer broke the study off: then the indices are missing.
    pub interrupted: bool,
}

/// What is done of how much.
#[derive(Clone, Copy, Debug)]
pub struct SensitivityProgress {
    /// Candidates evaluated.
    pub evaluations: usize,
    /// Candidates in all.
    pub planned: usize,
}

/// The ranges of the parameters about the base car's values.
pub(crate) fn ranges_about(
    settings: &IdentifySettings,
    names: &[String],
    share: f64,
) -> Result<Vec<FreeParameter>> {
    let car = Car::load(&settings.car)?;
    let flat = car.to_flat();
    names
        .iter()
        .map(|name| {
            let parameter = car.known_parameter("the study", "parameters", name)?;
            let value = flat[parameter.slots[0]];
            let bounds = settings.free.iter().find(|f| f.name == *name);
            let reach = if value == 0.0 {
                bounds.map_or(1.0, |f| 0.5 * (f.upper - f.lower))
            } else {
                value.abs()
            };
            let info = parameter.info;
            Ok(FreeParameter {
                name: name.clone(),
                lower: (value - share * reach).max(info.minimum),
                upper: (value + share * reach).min(info.maximum),
            })
        })
        .collect()
}

/// Reads the car and the lap; objectives are all channels together, then each alone.
///
/// # Errors
/// As [`set_up`] and [`SensitivitySettings::validate`].
pub fn set_up_sensitivity(settings: &SensitivitySettings) -> Result<Setup> {
    let names: Vec<String> = settings.replay.free.iter().map(|f| f.name.clone()).collect();
    settings.validate()?;
    let channels = (0..CHANNEL_NAMES.len()).map(ObjectiveChoice::Channel);
    let mut setup = set_up(&IdentifySettings {
        free: ranges_about(&settings.replay, &names, settings.share)?,
        objectives: std::iter::once(ObjectiveChoice::All).chain(channels).collect(),
        ..settings.replay.clone()
    })?;
    start_as_base_drives(&mut setup.replay);
    Ok(setup)
}

/// Lets every window start from the state in which the base car comes there, lateral speed and roll with it, which no
/// log has: the base car's cost is then that of whole laps, and what others add is their own. A window that the base car
/// does not reach starts as before.
pub(crate) fn start_as_base_drives(replay: &mut ReplayProblem) {
    fn chained<T: Tyre<f64>>(replay: &mut ReplayProblem, car: &CarModel<f64, T>) {
        let mut before: Option<Window<f64>> = None;
        for k in 0..replay.plan.windows.len() {
            let window = replay.plan.windows[k];
            if let Some(before) = before.filter(|b| b.start < window.start) {
                let between = Window {
                    end: window.start + 1,
                    ..before
                };
                let (drives, state) =
                    drive_window(car, &replay.plan, &between, |_: usize, _: [f64; CHANNELS]| {});
                if drives {
                    replay.plan.windows[k].initial = state.to_array();
                }
            }
            before = Some(replay.plan.windows[k]);
        }
    }
    let base = replay.free.base().to_vec();
    match replay.tyre_model() {
        TyreModel::MagicFormula => {
            let car = CarModel::<f64, MagicFormula<f64>>::from_parameters(|i| base[i]);
            chained(replay, &car);
        }
        TyreModel::Linear => {
            let car = CarModel::<f64, LinearTyre<f64>>::from_parameters(|i| base[i]);
            chained(replay, &car);
        }
    }
}

/// Candidates of one call of the evaluator: enough to fill any device for a moment, few enough to be interrupted.
const BATCH: usize = 1024;

/// Costs of each candidate; nothing where one does not drive, which is counted by reason.
pub(crate) fn costs_of(
    evaluator: &mut dyn Evaluator,
    population: &[f64],
    failures: &mut FailureCounts,
    mut observe: impl FnMut(usize) -> ControlFlow<()>,
) -> Result<Option<Vec<Option<Vec<f64>>>>> {
    let dimensions = evaluator.problem().variables.len();
    let width = evaluator.problem().objectives.len();
    let mut costs = Vec::with_capacity(population.len() / dimensions);
    for batch in population.chunks(BATCH * dimensions) {
        let found = evaluator.evaluate(batch)?;
        add_failures(failures, &found.failure_counts());
        let rows = found.objectives.chunks_exact(width).zip(&found.failures);
        costs.extend(rows.map(|(row, failure)| failure.is_none().then(|| row.to_vec())));
        if observe(costs.len()).is_break() {
            return Ok(None);
        }
    }
    Ok(Some(costs))
}

/// Runs the study.
///
/// # Errors
/// [`Error::Study`] if the base car does not drive the lap, or too few of its neighbours do; those of the evaluator.
pub fn measure(
    settings: &SensitivitySettings,
    setup: &Setup,
    observe: impl FnMut(&SensitivityProgress) -> ControlFlow<()>,
) -> Result<Outcome> {
    measure_recorded(settings, setup, &mut Recorder::idle(&mut Keeper::idle()), observe)
}

/// What the costs of this setup depend on.
pub(crate) fn inputs_of(study: &str, setup: &Setup) -> String {
    let replay = &setup.replay;
    let mut inputs = Inputs::new(study);
    inputs.add(&(&replay.plan, &replay.problem, &replay.free.car));
    inputs.key()
}

/// As [`measure`], with the answers noted by `recorder`, or known to it.
///
/// # Errors
/// As [`measure`], and those of the recorder.
pub fn measure_recorded(
    settings: &SensitivitySettings,
    setup: &Setup,
    recorder: &mut Recorder<'_>,
    mut observe: impl FnMut(&SensitivityProgress) -> ControlFlow<()>,
) -> Result<Outcome> {
    let replay = &setup.replay;
    let began = Instant::now();
    let dimensions = replay.dimensions();
    let base: Vec<f64> = replay
        .free
        .parameters
        .iter()
        .map(|p| replay.free.base()[p.slots[0]])
        .collect();
    let variables = &replay.problem.variables;
    let ranges: Vec<FreeParameter> = variables
        .iter()
        .map(|v| FreeParameter {
            name: v.name.clone(),
            lower: v.lower,
            upper: v.upper,
        })
        .collect();

    // The base car, every parameter at every level, then the design of the indices.
    let mut population = base.clone();
    for (k, variable) in variables.iter().enumerate() {
        for level in LEVELS {
            let end = if level < 0.0 {
                variable.lower
            } else {
                variable.upper
            };
            let mut row = base.clone();
            row[k] += level.abs() * (end - base[k]);
            population.extend(row);
        }
    }
    let singles = population.len() / dimensions;
    for row in design(dimensions, settings.samples, settings.replay.seed).chunks_exact(dimensions) {
        population.extend(
            row.iter()
                .zip(variables)
                .map(|(u, v)| v.lower + u * (v.upper - v.lower)),
        );
    }
    let planned = population.len() / dimensions;
    let dispatches = DispatchWatch::begin();
    let mut evaluator = open_evaluator(
        replay,
        settings.replay.backend,
        settings.replay.adapter.as_deref(),
    )?;
    let mut watch = |done: usize, before: usize| {
        observe(&SensitivityProgress {
            evaluations: before + done,
            planned,
        })
    };
    let (first, rest) = population.split_at(singles * dimensions);
    let mut interrupted = false;
    recorder.begin(inputs_of("sensitivity", setup), &evaluator.backend())?;
    let backend = evaluator.backend();
    let mut evaluator = recorder.over(evaluator.as_mut());
    let mut failures = FailureCounts::new();
    let single = costs_of(&mut evaluator, first, &mut failures, |done| {
        interrupted |= watch(done, 0).is_break();
        ControlFlow::Continue(())
    })?
    .unwrap_or_default();
    let global = if interrupted {
        None
    } else {
        costs_of(&mut evaluator, rest, &mut failures, |done| watch(done, singles))?
    };
    interrupted |= global.is_none();
    if interrupted {
        recorder.keep()?;
    }

    let base_costs = single.first().cloned().flatten().ok_or_else(|| {
        Error::Study("the base car does not drive the lap: nothing to set changes against".to_owned())
    })?;
    let one_at_a_time = (0..dimensions * LEVELS.len())
        .map(|i| OneAtATime {
            parameter: i / LEVELS.len(),
            value: first[(i + 1) * dimensions + i / LEVELS.len()],
            costs: single[i + 1].clone(),
        })
        .collect();
    let mut indices = Vec::new();
    let mut left_out = 0;
    if let Some(global) = global {
        (indices, left_out) = indices_of(settings, &global, base_costs.len(), dimensions)?;
    }
    Ok(Outcome {
        ranges,
        base_costs,
        one_at_a_time,
        indices,
        left_out,
        band: band(setup, first, dimensions),
        base,
        backend: recorder.backend().cloned().unwrap_or(backend),
        device_faults: recorder.device_faults().to_vec(),
        failures,
        longest_dispatch_ms: dispatches.longest_ms(),
        evaluations: if interrupted { singles } else { planned },
        elapsed_s: began.elapsed().as_secs_f64(),
        interrupted,
    })
}

/// The indices of every objective from the costs of a design, and how many base samples were left out of it.
fn indices_of(
    settings: &SensitivitySettings,
    costs: &[Option<Vec<f64>>],
    objectives: usize,
    dimensions: usize,
) -> Result<(Vec<Vec<SobolIndex>>, usize)> {
    let n = settings.samples;
    let driven: Vec<usize> = (0..n)
        .filter(|row| (0..dimensions + 2).all(|part| costs[part * n + row].is_some()))
        .collect();
    if 2 * driven.len() < n {
        return Err(Error::Study(format!(
            "of {n} samples only {} drive with every change: a smaller --share keeps more of them on the road",
            driven.len()
        )));
    }
    let column = |part: usize, k: usize| -> Vec<f64> {
        driven
            .iter()
            .filter_map(|row| costs[part * n + row].as_ref().map(|c| c[k]))
            .collect()
    };
    let all = (0..objectives)
        .into_par_iter()
        .map(|k| {
            let outputs = DesignOutputs {
                a: column(0, k),
                b: column(1, k),
                ab: (0..dimensions).map(|d| column(2 + d, k)).collect(),
            };
            sobol::indices(&outputs, settings.resamples, settings.replay.seed)
        })
        .collect();
    Ok((all, n - driven.len()))
}

/// Outputs of the base car, and the least and greatest over the first rows of `candidates`, in `f64`.
fn band(setup: &Setup, candidates: &[f64], dimensions: usize) -> Band {
    let replay = &setup.replay;
    let samples = replay.plan.samples.len();
    let driven: Vec<Vec<[f64; 4]>> = candidates
        .par_chunks_exact(dimensions)
        .map(|candidate| outputs_of(replay, candidate, samples))
        .collect();
    let channel = |f: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        (0..CHANNEL_NAMES.len())
            .map(|k| (0..samples).map(|i| f(i, k)).collect())
            .collect()
    };
    let folded =
        |fold: fn(f64, f64) -> f64| channel(&|i, k| driven.iter().map(|d| d[i][k]).fold(f64::NAN, fold));
    Band {
        distance_m: setup.log.distance_m.clone(),
        base: channel(&|i, k| driven[0][i][k]),
        low: folded(f64::min),
        high: folded(f64::max),
    }
}

/// The four outputs of a candidate at each sample; not a number where no window drives.
fn outputs_of(replay: &ReplayProblem, candidate: &[f64], samples: usize) -> Vec<[f64; 4]> {
    let flat = replay.flat(candidate);
    let mut outputs = vec![[f64::NAN; 4]; samples];
    for window in &replay.plan.windows {
        let (driven, _) = trace(&flat, replay.tyre_model(), &replay.plan, window);
        for (i, output) in driven.into_iter().enumerate().skip(window.scored_from) {
            outputs[window.start + i] = output;
        }
    }
    outputs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::BackendChoice;
    use crate::evaluate::replay::Norm;

    #[test]
    fn a_study_file_repeats_its_study() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("study.toml");
        let settings = SensitivitySettings {
            replay: IdentifySettings {
                log: Some(folder.path().join("a \"log\".csv")),
                section: Some("Abbey".to_owned()),
                laps: vec![2],
                norm: Norm::One,
                backend: BackendChoice::Simd,
                seed: 7,
                free: vec![FreeParameter {
                    name: "front.rBy1".to_owned(),
                    lower: 1.0,
                    upper: 2.0,
                }],
                ..SensitivitySettings::default().replay
            },
            share: 0.03,
            samples: 64,
            resamples: 17,
        };
        std::fs::write(&path, settings.to_toml()).expect("a file");
        assert_eq!(
            SensitivitySettings::read(&path).expect("what was written"),
            settings
        );
    }
}
