//! What a car can do at each speed, from its 4DOF model: the g-g-v envelope that racing lines are driven within.
//!
//! The limits come of the car's steady states ([`crate::vehicle::limits`]). The surface of lateral acceleration over speed and steering also comes from a population of cars in steady-state cornering
//! ([`crate::evaluate::steady`]), on any backend; the limits stay those of the curves, which are exact.

mod measured;
mod population;
mod results;

pub use measured::Measured;
pub use population::{RidgePoint, SteadySurface, SurfaceFigures};
pub use results::{EnvelopeSummary, Supported, envelope_figure};

use crate::config::kinds::{choice, count, file, name_or_file, number, optional, text};
use crate::config::settings::{Settings, settings};
use crate::error::{Error, Result};
use crate::evaluate::BackendChoice;
use crate::study::framework::journal::Journal;
use crate::study::framework::memory::{ANSWER, MemoryItem};
use crate::study::framework::shared_settings::{adapter, channel_map};
use crate::study::framework::{Plan, RunRecord, Solved, Study, Subject, Work};
use crate::telemetry::{ChannelMap, Log, LogOptions};
use crate::vehicle::Car;
use crate::vehicle::limits::{CarEnvelope, SpeedRange};
use std::path::{Path, PathBuf};

/// The study.
pub struct EnvelopeStudy;

settings! {
    /// Settings of an envelope study.
    pub struct EnvelopeSettings {
        car: String ["-"] = "gt".to_owned(), name_or_file(),
            "The car: a bundled name (gt) or a TOML file, such as the one that identify writes";
        log: Option<PathBuf> ["-"] = None, optional(file()).example("\"lap.csv\""),
            "A log that is held against the limits: CSV (ours, MoTeC i2, RaceChrono, others), MoTeC .ld or VBOX .vbo";
        channel_map: Option<PathBuf> = channel_map;
        from_mps: Option<f64> ["m/s"] = None, optional(number(3.0, 150.0)).example("18.0"),
            "Slowest speed, below which the limits are taken to be its; without it 18, or less where the lock leaves the limit to the tyres";
        to_mps: f64 ["m/s"] = SpeedRange::USUAL.to_mps, number(4.0, 160.0),
            "Greatest speed, if the engine goes that far";
        step_mps: f64 ["m/s"] = SpeedRange::USUAL.step_mps, number(0.05, 50.0),
            "Step between speeds";
        steers: usize ["-"] = 128, count(4, 10_000),
            "Steering angles of the surface, from straight on to the lock";
        backend: BackendChoice ["-"] = BackendChoice::Auto, choice().place(),
            "Where the surface is evaluated; the limits are worked out in f64";
        adapter: Option<String> = adapter;
    }

    fn consistent(&self) -> Result<()> {
        if let (None, Some(map)) = (&self.log, &self.channel_map) {
            let found = format!("{}, without a log", map.display());
            return Err(Error::input("the study", "channel_map", found, "a log beside it"));
        }
        if let Some(from_mps) = self.from_mps.filter(|from| self.to_mps < from + 1.0) {
            let expected = format!("{} m/s or more, as from_mps is {from_mps}", from_mps + 1.0);
            return Err(Error::input("the study", "to_mps", self.to_mps.to_string(), expected));
        }
        Ok(())
    }
}

/// All that the study reads.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The car.
    pub car: Car,
    /// Speeds that its limits are looked for at (m/s).
    pub speeds: Vec<f64>,
    /// A log that is held against them.
    pub log: Option<Log>,
}

/// What the study finds.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The limits.
    pub limits: CarEnvelope,
    /// The surface of lateral acceleration.
    pub surface: SteadySurface,
    /// How the study ran; candidates are those of the surface.
    pub record: RunRecord,
}

/// Bytes of a car of the surface, with its tables, cells of a picture and places on a page.
const CAR: u64 = (4 << 10) + ANSWER;

impl Study for EnvelopeStudy {
    const NAME: &'static str = "envelope";
    const ABOUT: &'static str =
        "Find a car's limits at each speed: the g-g-v envelope that racing lines are driven within.";
    const DETAILS: &'static str =
        "Examples:\n  lapswarm envelope\n  lapswarm envelope --car runs/identify-001/car.toml --log lap.csv";
    type Settings = EnvelopeSettings;
    type State = Journal;
    type Prepared = Prepared;
    type Outcome = Outcome;
    type Summary = EnvelopeSummary;

    fn prepare(settings: &EnvelopeSettings) -> Result<Prepared> {
        let car = Car::load(&settings.car)?;
        settings.validate()?;
        let speeds = settings.range(Some(&car)).speeds_of(&car)?;
        let log = settings.log.as_deref().map(|path| settings.read_log(path, &car));
        let log = log.transpose()?;
        Ok(Prepared { car, speeds, log })
    }

    fn size(settings: &EnvelopeSettings, prepared: Option<&Prepared>) -> Vec<MemoryItem> {
        let speeds = prepared.map_or_else(|| settings.range(None).most(), |prepared| prepared.speeds.len());
        let cars = settings.steers.saturating_mul(speeds);
        vec![MemoryItem::new("steers, at each speed", cars, CAR)]
    }

    fn plan(settings: &EnvelopeSettings, prepared: &Prepared, plan: Plan) -> Result<Plan> {
        let Prepared { car, speeds, log } = prepared;
        let plan = plan.reads(format!("car {}, {} speeds", car.name, speeds.len()));
        let samples = log
            .iter()
            .map(|log| format!("{}: {} samples", log.source, log.samples()));
        samples
            .fold(plan, Plan::reads)
            .evaluations((speeds.len() * settings.steers) as u64)
            .backend(settings.backend, settings.adapter.as_deref())
    }

    fn solve(work: Work<'_, Self>) -> Result<Option<Outcome>> {
        population::measure(work)
    }

    fn record(outcome: &Outcome) -> &RunRecord {
        &outcome.record
    }

    fn record_mut(outcome: &mut Outcome) -> &mut RunRecord {
        &mut outcome.record
    }

    fn summarise(solved: &Solved<'_, Self>) -> EnvelopeSummary {
        results::summarise(solved)
    }

    fn subject(_: &EnvelopeSettings, prepared: &Prepared) -> Subject {
        Subject {
            car: prepared.car.name.clone(),
            ..Subject::default()
        }
    }

    fn report(folder: &Path, solved: &Solved<'_, Self>, summary: &EnvelopeSummary) -> Result<()> {
        results::report(folder, solved, summary)
    }

    fn text(_: &EnvelopeSettings, summary: &EnvelopeSummary) -> String {
        summary.to_text()
    }

    fn check(path: &Path) -> Result<String> {
        let settings = EnvelopeSettings::read(path)?;
        let prepared = Self::prepare(&settings)?;
        Ok(format!("{}, {} speeds", prepared.car.name, prepared.speeds.len()))
    }
}

impl EnvelopeSettings {
    /// The log at `path`, as one of this car.
    fn read_log(&self, path: &Path, car: &Car) -> Result<Log> {
        let map = self.channel_map.as_deref().map(ChannelMap::read).transpose()?;
        Log::read(path, &map.unwrap_or_default(), &LogOptions::of(car))
    }

    /// The speeds that limits are looked for at, those of `car` if it is known.
    fn range(&self, car: Option<&Car>) -> SpeedRange {
        let usual = car.map_or(SpeedRange::USUAL, SpeedRange::of);
        SpeedRange {
            from_mps: self.from_mps.unwrap_or(usual.from_mps),
            to_mps: self.to_mps,
            step_mps: self.step_mps,
        }
    }
}
