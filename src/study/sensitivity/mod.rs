//! How much each parameter of a car matters to each channel of a lap: one at a time, and by shares of variance.
//!
//! The lap is replayed in short windows that restart from the log, so that the figures are of the parameters' own effect
//! and not of what a spin makes of it many corners later. All candidates are scored as populations.

mod page;
mod results;
mod sobol;

pub use results::Summary;
pub use sobol::{DesignOutputs, MOST_SAMPLES, MOST_VARIABLES, SobolIndex, design, indices};

use crate::config::kinds::{count, number, of};
use crate::config::settings::{Flag, Settings, settings};
use crate::error::{Error, Result};
use crate::evaluate::replay::{CHANNEL_LABELS, CHANNEL_NAMES, CHANNEL_UNITS, trace};
use crate::study::framework::journal::Journal;
use crate::study::framework::memory::{ANSWER, MemoryItem, log_item};
use crate::study::framework::{Plan, RunRecord, Solved, Study, Subject, Work};
use crate::study::identify::{IdentifySettings, Setup, planned, subject, without_laps};
use crate::study::ranges::{OwnRange, Ranges};
use crate::study::replayed::{drive, ranges_about, replay_settings, set_up_channels, windowed};
use rayon::prelude::*;
use std::path::Path;

/// The study.
pub struct Sensitivity;

settings! {
    /// Settings of a sensitivity study.
    pub struct SensitivitySettings {
        replay: IdentifySettings ["-"] = windowed(), replay_settings(&[("free", Flag::List("parameters"))]),
            "Car, log, windows, norm and backend, as an identification has them; of the free parameters only the names count";
        share: f64 ["-"] = 0.05, number(1e-6, 1.0),
            "How far each parameter goes either way, as a share of its value; of its range where its value is zero";
        ranges: Vec<OwnRange> ["-"] = Vec::new(), of(Ranges).example("{ K = [5e4, 2e5, 1e4], C = [5e3, 4e4] }"),
            "Ranges of one's own, each [least, greatest] or [least, greatest, step]; with them these are the parameters";
        samples: usize ["-"] = 256, count(8, MOST_SAMPLES as u64),
            "Base samples of the Sobol indices; each costs as many evaluations as there are parameters, and two more";
        resamples: usize ["-"] = 400, count(8, 100_000),
            "Resamples of the indices' intervals";
    }

    fn consistent(&self) -> Result<()> {
        let count = self.count();
        if !(1..=MOST_VARIABLES).contains(&count) {
            let expected = format!("1 to {MOST_VARIABLES}");
            return Err(Error::input("the study", "parameters", count.to_string(), expected));
        }
        Ok(())
    }
}

impl SensitivitySettings {
    /// Parameters that are moved.
    fn count(&self) -> usize {
        if self.ranges.is_empty() {
            self.replay.free.len()
        } else {
            self.ranges.len()
        }
    }

    /// Cars that are driven: the base car, each parameter at each of its values, and the design of the indices.
    pub fn evaluations(&self) -> usize {
        let count = self.count();
        let values = if self.ranges.is_empty() {
            count * LEVELS.len()
        } else {
            self.ranges.iter().map(|range| range.values().len()).sum()
        };
        1 + values + self.samples * (count + 2)
    }

    /// How far each parameter goes, in words.
    fn reach(&self) -> String {
        if self.ranges.is_empty() {
            format!("{:.3} % either way", 100.0 * self.share)
        } else {
            "over its own range".to_owned()
        }
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

/// The outputs of a car at every sample: those that are compared with logs, and the roll rate, which no log has.
pub type Outputs = [Vec<f64>; OUTPUTS];

/// Outputs of a car.
pub const OUTPUTS: usize = CHANNEL_NAMES.len() + 1;

/// Name, label and unit of an output.
pub fn output(k: usize) -> [&'static str; 3] {
    match CHANNEL_NAMES.get(k) {
        Some(name) => [name, CHANNEL_LABELS[k], CHANNEL_UNITS[k]],
        None => ["roll_rate", "roll rate", "rad/s"],
    }
}

/// The outcome of a study.
pub struct Outcome {
    /// The parameters' values in the base car.
    pub base: Vec<f64>,
    /// The base car's costs, objective by objective.
    pub base_costs: Vec<f64>,
    /// One at a time, parameter by parameter and value by value: the [levels](LEVELS), or those of its own range.
    pub one_at_a_time: Vec<OneAtATime>,
    /// The indices, objective by objective and parameter by parameter.
    pub indices: Vec<Vec<SobolIndex>>,
    /// Base samples that were left out because one of their cars did not drive.
    pub left_out: usize,
    /// Outputs along the lap, of the base car and of the cars of `one_at_a_time`, in their order.
    pub outputs: Vec<Outputs>,
    /// How it ran; where it was interrupted the indices are missing.
    pub record: RunRecord,
}

impl Study for Sensitivity {
    const NAME: &'static str = "sensitivity";
    const ABOUT: &'static str = "Find how much each parameter of a car matters to each channel of a lap.";
    const DETAILS: &'static str = "Examples:\n  lapswarm sensitivity\n  lapswarm sensitivity --share 0.02 --samples 1024\n  \
        lapswarm sensitivity --car runs/identify-001/car.toml --log lap.csv --parameters K,C,cg_height_m";
    type Settings = SensitivitySettings;
    type State = Journal;
    type Prepared = Setup;
    type Outcome = Outcome;
    type Summary = Summary;

    fn prepare(settings: &SensitivitySettings) -> Result<Setup> {
        settings.validate()?;
        let replay = &settings.replay;
        if !settings.ranges.is_empty() {
            let own = settings.ranges.iter().map(OwnRange::free).collect();
            return set_up_channels(replay, own);
        }
        let names: Vec<String> = replay.free.iter().map(|f| f.name.clone()).collect();
        set_up_channels(replay, ranges_about(replay, &names, settings.share)?)
    }

    /// Of every sample two rows of each car in the design and its costs, and the answer in a journal.
    fn size(settings: &SensitivitySettings, prepared: Option<&Setup>) -> Vec<MemoryItem> {
        let variables = settings.count() as u64;
        let car = variables.saturating_mul(16).saturating_add(80 + ANSWER);
        let samples = MemoryItem::new("samples", settings.samples, car.saturating_mul(variables + 2));
        let log = prepared.map(|setup| log_item(setup.log.samples()));
        std::iter::once(samples).chain(log).collect()
    }

    fn plan(settings: &SensitivitySettings, setup: &Setup, plan: Plan) -> Result<Plan> {
        planned(
            &settings.replay,
            setup,
            plan.evaluations(settings.evaluations() as u64),
        )
    }

    fn solve(work: Work<'_, Self>) -> Result<Option<Outcome>> {
        measure(work).map(Some)
    }

    fn record(outcome: &Outcome) -> &RunRecord {
        &outcome.record
    }

    fn record_mut(outcome: &mut Outcome) -> &mut RunRecord {
        &mut outcome.record
    }

    fn summarise(solved: &Solved<'_, Self>) -> Summary {
        results::summarise(solved)
    }

    fn subject(settings: &SensitivitySettings, setup: &Setup) -> Subject {
        subject(&settings.replay, setup)
    }

    /// Writes `sobol.csv`, `one_at_a_time.csv`, the figures `sobol.svg`, `one_at_a_time.svg` and `bands.svg`, and `report.html`.
    fn report(folder: &Path, solved: &Solved<'_, Self>, summary: &Summary) -> Result<()> {
        results::write_one_at_a_time(folder, solved.prepared, solved.outcome)?;
        if !solved.outcome.indices.is_empty() {
            results::write_sobol(folder, summary)?;
        }
        page::write(folder, solved, summary)
    }

    fn text(_: &SensitivitySettings, summary: &Summary) -> String {
        summary.to_text()
    }

    fn check(path: &Path) -> Result<String> {
        let mut settings = SensitivitySettings::read(path)?;
        settings.replay = without_laps(&settings.replay);
        Self::prepare(&settings)?;
        let count = settings.count();
        Ok(format!("{count} parameters, {} samples", settings.samples))
    }
}

/// Evaluates the design.
///
/// # Errors
/// [`Error::Study`] if the base car does not drive the lap, or too few of its neighbours do; those of the evaluator.
fn measure(work: Work<'_, Sensitivity>) -> Result<Outcome> {
    let (settings, setup) = (work.settings, work.prepared);
    let replay = &setup.replay;
    let dimensions = replay.dimensions();
    let base = replay.free.values_in(replay.free.base());
    let variables = &replay.problem.variables;
    // The base car and every parameter at every level, then the design of the indices.
    let moved = |k: usize| -> Vec<f64> {
        if let Some(range) = settings.ranges.get(k) {
            return range.values();
        }
        let variable = &variables[k];
        let at = |level: f64| {
            let end = if level < 0.0 {
                variable.lower
            } else {
                variable.upper
            };
            base[k] + level.abs() * (end - base[k])
        };
        LEVELS.map(at).to_vec()
    };
    let values: Vec<(usize, f64)> = (0..dimensions)
        .flat_map(|k| moved(k).into_iter().map(move |value| (k, value)))
        .collect();
    let mut first = base.clone();
    for (k, value) in &values {
        let mut row = base.clone();
        row[*k] = *value;
        first.extend(row);
    }
    let shares = design(dimensions, settings.samples, settings.replay.seed);
    let within = shares.iter().zip(variables.iter().cycle());
    let rest: Vec<f64> = within.map(|(u, v)| v.lower + u * (v.upper - v.lower)).collect();
    // The first are few enough to be driven whole, however soon the study is interrupted.
    let driven = drive(&settings.replay, &[&first, &rest], work)?;
    let (single, global) = driven.costs.split_at(first.len() / dimensions);
    let base_costs = single[0].clone().ok_or_else(|| {
        Error::Study("the base car does not drive the lap: nothing to set changes against".to_owned())
    })?;
    let one_at_a_time = values
        .into_iter()
        .zip(&single[1..])
        .map(|((parameter, value), costs)| OneAtATime {
            parameter,
            value,
            costs: costs.clone(),
        })
        .collect();
    let (indices, left_out) = if driven.interrupted() {
        (Vec::new(), 0)
    } else {
        indices_of(settings, global, base_costs.len(), dimensions)?
    };
    Ok(Outcome {
        base,
        base_costs,
        one_at_a_time,
        indices,
        left_out,
        outputs: first
            .par_chunks_exact(dimensions)
            .map(|candidate| outputs(setup, candidate))
            .collect(),
        record: driven.record(),
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
            "of {n} samples only {} drive with every change: smaller ranges keep more of them on the road",
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

/// Outputs of a car in `f64`: not a number where windows settle, and where it does not drive.
fn outputs(setup: &Setup, candidate: &[f64]) -> Outputs {
    let replay = &setup.replay;
    let flat = replay.flat(candidate);
    let mut outputs = std::array::from_fn(|_| vec![f64::NAN; replay.plan.samples.len()]);
    for window in &replay.plan.windows {
        let driven = trace(&flat, replay.tyre_model(), &replay.plan, window);
        let moments = driven.outputs.iter().zip(&driven.states).enumerate();
        for (i, (channels, state)) in moments.skip(window.scored_from) {
            for (k, value) in channels.iter().chain([&state.body.roll_rate]).enumerate() {
                outputs[k][window.start + i] = *value;
            }
        }
    }
    outputs
}
