//! The costs of a lap over two parameters of a car: one population, a grid.

mod results;

pub use results::{Summary, summarise, write_results};

use crate::error::{Error, Result};
use crate::evaluate::gpu::DispatchWatch;
use crate::evaluate::replay::{CHANNEL_NAMES, open_evaluator};
use crate::evaluate::{BackendInfo, FailureCounts};
use crate::study::identify::{FreeParameter, IdentifySettings, ObjectiveChoice, Setup, set_up};
use crate::study::journal::Recorder;
use crate::study::keeper::Keeper;
use crate::study::memory::{ANSWER, Kept};
use crate::study::sensitivity::{costs_of, inputs_of, ranges_about, start_as_base_drives};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// Settings of a surface study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceSettings {
    /// Car, log, windows, norm and backend, as an identification has them. Of the free parameters the bounds of the two
    /// that are moved are taken, where they are among them and no share is given.
    pub replay: IdentifySettings,
    /// The horizontal and the vertical parameter.
    pub parameters: [String; 2],
    /// How far both go either way, as a share of their value; their bounds where not given.
    pub share: Option<f64>,
    /// Values of each.
    pub grid: usize,
}

impl Default for SurfaceSettings {
    fn default() -> Self {
        Self {
            replay: IdentifySettings {
                window_s: Some(1.5),
                ..IdentifySettings::default()
            },
            parameters: ["rBy1".to_owned(), "rCy1".to_owned()],
            share: Some(0.2),
            grid: 41,
        }
    }
}

impl SurfaceSettings {
    /// Reads a study file: an identification's, with `parameters`, `share` and `grid` beside.
    ///
    /// # Errors
    /// [`Error::Input`] naming line and field for anything unknown or out of range.
    pub fn read(path: &Path) -> Result<Self> {
        let mut s = Self::default();
        let defaults = s.replay.clone();
        s.replay = IdentifySettings::read_beside(path, defaults, |root| {
            s.share = root.number("share", 1e-6, 1.0, "")?.or(s.share);
            s.grid = root.integer("grid", 2, 2000)?.map_or(s.grid, |n| n as usize);
            if let Some(names) = root.strings("parameters")? {
                match names.as_slice() {
                    [x, y] => s.parameters = [(*x).to_owned(), (*y).to_owned()],
                    _ => return Err(root.refuse("parameters", "a list of two names")),
                }
            }
            Ok(())
        })?;
        Ok(s)
    }

    /// The study file that repeats this study.
    pub fn to_toml(&self) -> String {
        let mut text = format!("parameters = {:?}\ngrid = {}\n", self.parameters, self.grid);
        if let Some(share) = self.share {
            text += &format!("share = {share:?}\n");
        }
        text + &self.replay.to_toml()
    }

    /// What the study keeps: of every candidate its two parameters, its costs, and the answer in a journal.
    pub fn kept(&self) -> [Kept; 1] {
        [Kept {
            name: "grid, squared",
            count: (self.grid as u64).saturating_mul(self.grid as u64),
            each: 2 * 8 + 2 * 80 + ANSWER,
        }]
    }

    /// # Errors
    /// [`Error::Input`] naming the first setting that is out of its range.
    pub fn validate(&self) -> Result<()> {
        let refuse = |place: &str, found: String, expected: &str| {
            Err(Error::input("the study", place, found, expected))
        };
        if self.parameters[0] == self.parameters[1] {
            return refuse("parameters", self.parameters.join(", "), "two different ones");
        }
        if !(2..=2000).contains(&self.grid) {
            return refuse("grid", self.grid.to_string(), "2 to 2000");
        }
        if !self.share.is_none_or(|s| s > 0.0 && s <= 1.0) {
            let found = self.share.map_or(String::new(), |s| s.to_string());
            return refuse("share", found, "a share above 0 up to 1");
        }
        Ok(())
    }
}

/// The outcome of a study.
pub struct Outcome {
    /// Values of the horizontal and the vertical parameter.
    pub axes: [Vec<f64>; 2],
    /// The base car's values.
    pub base: [f64; 2],
    /// Costs over the grid, objective by objective, row by row of the vertical parameter; not a number where the car
    /// does not drive.
    pub costs: Vec<Vec<f64>>,
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
    /// Whether the observer broke the study off.
    pub interrupted: bool,
}

/// Reads the car and the lap; objectives are all channels together, then each alone.
///
/// # Errors
/// As [`set_up`] and [`SurfaceSettings::validate`].
pub fn set_up_surface(settings: &SurfaceSettings) -> Result<Setup> {
    settings.validate()?;
    let about = ranges_about(
        &settings.replay,
        &settings.parameters,
        settings.share.unwrap_or(0.2),
    )?;
    let free: Vec<FreeParameter> = about
        .into_iter()
        .map(|range| {
            let bounds = settings.replay.free.iter().find(|f| f.name == range.name);
            bounds
                .filter(|_| settings.share.is_none())
                .cloned()
                .unwrap_or(range)
        })
        .collect();
    let channels = (0..CHANNEL_NAMES.len()).map(ObjectiveChoice::Channel);
    let mut setup = set_up(&IdentifySettings {
        free,
        objectives: std::iter::once(ObjectiveChoice::All).chain(channels).collect(),
        ..settings.replay.clone()
    })?;
    start_as_base_drives(&mut setup.replay);
    Ok(setup)
}

/// Runs the study; `observe` is told how many of the grid's candidates are done.
///
/// # Errors
/// [`Error::Study`] if no candidate drives the lap; those of the evaluator.
pub fn measure(
    settings: &SurfaceSettings,
    setup: &Setup,
    observe: impl FnMut(usize) -> ControlFlow<()>,
) -> Result<Outcome> {
    measure_recorded(settings, setup, &mut Recorder::idle(&mut Keeper::idle()), observe)
}

/// As [`measure`], with the answers noted by `recorder`, or known to it.
///
/// # Errors
/// As [`measure`], and those of the recorder.
pub fn measure_recorded(
    settings: &SurfaceSettings,
    setup: &Setup,
    recorder: &mut Recorder<'_>,
    mut observe: impl FnMut(usize) -> ControlFlow<()>,
) -> Result<Outcome> {
    let replay = &setup.replay;
    let began = Instant::now();
    let n = settings.grid;
    let axis = |k: usize| -> Vec<f64> {
        let v = &replay.problem.variables[k];
        (0..n)
            .map(|i| v.lower + (v.upper - v.lower) * i as f64 / (n - 1) as f64)
            .collect()
    };
    let axes = [axis(0), axis(1)];
    let population: Vec<f64> = axes[1]
        .iter()
        .flat_map(|y| axes[0].iter().flat_map(|x| [*x, *y]))
        .collect();
    let dispatches = DispatchWatch::begin();
    let mut evaluator = open_evaluator(
        replay,
        settings.replay.backend,
        settings.replay.adapter.as_deref(),
    )?;
    recorder.begin(inputs_of("surface", setup), &evaluator.backend())?;
    let mut failures = FailureCounts::new();
    let mut recorded = recorder.over(evaluator.as_mut());
    let found = costs_of(&mut recorded, &population, &mut failures, &mut observe)?;
    let interrupted = found.is_none();
    if interrupted {
        recorder.keep()?;
    }
    let rows = found.unwrap_or_else(|| vec![None; n * n]);
    if !interrupted && rows.iter().all(Option::is_none) {
        let text = "no car of the grid drives the lap to its end: a smaller share, or shorter windows, keep more of them on the road";
        return Err(Error::Study(text.to_owned()));
    }
    let costs = (0..replay.problem.objectives.len())
        .map(|k| {
            rows.iter()
                .map(|row| row.as_ref().map_or(f64::NAN, |r| r[k]))
                .collect()
        })
        .collect();
    let base = replay.free.base();
    Ok(Outcome {
        axes,
        base: [0, 1].map(|k| base[replay.free.parameters[k].slots[0]]),
        costs,
        backend: recorder.backend().cloned().unwrap_or_else(|| evaluator.backend()),
        device_faults: recorder.device_faults().to_vec(),
        failures,
        longest_dispatch_ms: dispatches.longest_ms(),
        evaluations: n * n,
        elapsed_s: began.elapsed().as_secs_f64(),
        interrupted,
    })
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
        let settings = SurfaceSettings {
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
                ..SurfaceSettings::default().replay
            },
            parameters: ["K".to_owned(), "front.rBy1".to_owned()],
            share: Some(0.1),
            grid: 7,
        };
        std::fs::write(&path, settings.to_toml()).expect("a file");
        assert_eq!(SurfaceSettings::read(&path).expect("what was written"), settings);
    }
}
