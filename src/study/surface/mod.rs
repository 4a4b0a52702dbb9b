//! The costs of a lap over two parameters of a car: one population, a grid.

mod results;

pub use results::Summary;

use crate::config::kinds::{count, number, of, two_texts};
use crate::config::settings::{Settings, settings};
use crate::error::{Error, Result};
use crate::study::framework::journal::Journal;
use crate::study::framework::memory::{ANSWER, MemoryItem, log_item};
use crate::study::framework::{Plan, RunRecord, Solved, Study, Subject, Work};
use crate::study::identify::{IdentifySettings, Setup, planned, subject, without_laps};
use crate::study::ranges::{OwnRange, Ranges};
use crate::study::replayed::{drive, ranges_about, replay_settings, set_up_channels, windowed};
use std::path::Path;

/// The study.
pub struct Surface;

settings! {
    /// Settings of a surface study.
    pub struct SurfaceSettings {
        replay: IdentifySettings ["-"] = windowed(), replay_settings(&[]),
            "Car, log, windows, norm and backend, as an identification has them";
        parameters: [String; 2] ["-"] = ["rBy1", "rCy1"].map(str::to_owned), two_texts(),
            "The horizontal and the vertical parameter; front.rBy1 is that of one axle";
        share: f64 ["-"] = 0.2, number(1e-6, 1.0),
            "How far both go either way, as a share of their value";
        ranges: Vec<OwnRange> ["-"] = Vec::new(), of(Ranges).example("{ rBy1 = [5.0, 30.0] }"),
            "Ranges of their own in place of that, each [least, greatest]";
        grid: usize ["-"] = 41, count(2, 2000),
            "Values of each";
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
    /// How it ran.
    pub record: RunRecord,
}

impl Study for Surface {
    const NAME: &'static str = "surface";
    const ABOUT: &'static str = "Draw the costs of a lap over two parameters of a car.";
    const DETAILS: &'static str =
        "Examples:\n  lapswarm surface\n  lapswarm surface --parameters K,C --share 0.5 --grid 101";
    type Settings = SurfaceSettings;
    type State = Journal;
    type Prepared = Setup;
    type Outcome = Outcome;
    type Summary = Summary;

    fn prepare(settings: &SurfaceSettings) -> Result<Setup> {
        settings.validate()?;
        let replay = &settings.replay;
        let mut about = ranges_about(replay, &settings.parameters, settings.share)?;
        for range in &settings.ranges {
            let refuse = |found: &str, expected: String| {
                Err(Error::input(
                    "the study",
                    format!("ranges.{}", range.name),
                    found,
                    expected,
                ))
            };
            if range.step.is_some() {
                return refuse(
                    "a step",
                    "[least, greatest]; grid says how many values there are".to_owned(),
                );
            }
            match about.iter_mut().find(|free| free.name == range.name) {
                Some(free) => *free = range.free(),
                None => {
                    let expected = format!("one of {}", settings.parameters.join(", "));
                    return refuse("another parameter", expected);
                }
            }
        }
        set_up_channels(replay, about)
    }

    /// Of every candidate its two parameters, its costs, and the answer in a journal.
    fn size(settings: &SurfaceSettings, prepared: Option<&Setup>) -> Vec<MemoryItem> {
        let cars = settings.grid.saturating_mul(settings.grid);
        let grid = MemoryItem::new("grid, squared", cars, 2 * 8 + 2 * 80 + ANSWER);
        let log = prepared.map(|setup| log_item(setup.log.samples()));
        std::iter::once(grid).chain(log).collect()
    }

    fn plan(settings: &SurfaceSettings, prepared: &Setup, plan: Plan) -> Result<Plan> {
        let plan = plan.evaluations((settings.grid * settings.grid) as u64);
        planned(&settings.replay, prepared, plan)
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

    fn subject(settings: &SurfaceSettings, setup: &Setup) -> Subject {
        subject(&settings.replay, setup)
    }

    fn report(folder: &Path, solved: &Solved<'_, Self>, summary: &Summary) -> Result<()> {
        results::report(folder, solved, summary)
    }

    fn text(_: &SurfaceSettings, summary: &Summary) -> String {
        summary.to_text()
    }

    fn check(path: &Path) -> Result<String> {
        let mut settings = SurfaceSettings::read(path)?;
        settings.replay = without_laps(&settings.replay);
        Self::prepare(&settings)?;
        let [x, y] = &settings.parameters;
        Ok(format!("{y} over {x}"))
    }
}

/// Evaluates the grid.
///
/// # Errors
/// [`Error::Study`] if no candidate drives the lap; those of the evaluator.
fn measure(work: Work<'_, Surface>) -> Result<Outcome> {
    let (settings, setup) = (work.settings, work.prepared);
    let problem = &setup.replay.problem;
    let n = settings.grid;
    let axes = [0, 1].map(|k| -> Vec<f64> {
        let v = &problem.variables[k];
        (0..n)
            .map(|i| v.lower + (v.upper - v.lower) * i as f64 / (n - 1) as f64)
            .collect()
    });
    let population: Vec<f64> = axes[1]
        .iter()
        .flat_map(|y| axes[0].iter().flat_map(|x| [*x, *y]))
        .collect();
    let driven = drive(&settings.replay, &[&population], work)?;
    let rows = &driven.costs;
    if !driven.interrupted() && rows.iter().all(Option::is_none) {
        let text = "no car of the grid drives the lap to its end: smaller ranges, or shorter windows, keep more of them on the road";
        return Err(Error::Study(text.to_owned()));
    }
    // Of an interrupted study nothing is told.
    let cost = |i: usize, k: usize| match rows.get(i) {
        Some(Some(row)) if !driven.interrupted() => row[k],
        _ => f64::NAN,
    };
    let costs = (0..problem.objectives.len()).map(|k| (0..n * n).map(|i| cost(i, k)).collect());
    let costs = costs.collect();
    let free = &setup.replay.free;
    let base = free.values_in(free.base());
    Ok(Outcome {
        axes,
        base: [base[0], base[1]],
        costs,
        record: driven.record(),
    })
}
