//! The whole way from a log to a lap: the car that drove it, its g-g-v envelope, the line that suits it, that line driven by the
//! car itself, whose grip is fed back into the envelope until both laps agree, and a hybrid's energy on it.

mod page;
mod settings;
mod stage;
mod summary;

pub use settings::RunSettings;
pub use stage::Stages;
pub use summary::{EnergySummary, RoundSummary, Summary};

use crate::config::settings::Settings;
use crate::error::{Error, Result};
use crate::files::run_folder::SUMMARY;
use crate::line::energy::hybrid_parts;
use crate::line::read_line;
use crate::report::write_whole;
use crate::study::envelope::{EnvelopeSettings, EnvelopeStudy};
use crate::study::framework::journal::Journal;
use crate::study::framework::memory::{self, MemoryItem};
use crate::study::framework::{
    Inputs, Plan, Progress, RunRecord, Solved, Study, Subject, Watch, Work, resumed_or_new, write_results,
};
use crate::study::hybrid::{Hybrid, HybridStudySettings};
use crate::study::identify::{self, Identify, planned, without_laps};
use crate::study::raceline::{self, Raceline, RacelineSettings, road_read};
use crate::study::transient::{self, NamedLine, Transient, TransientSettings};
use crate::vehicle::{Car, Envelope};
use serde::de::DeserializeOwned;
use std::fmt::Debug;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The study.
pub struct Run;

/// Change of the grip's share from one line to the next below which another line would be the same.
const SETTLED: f64 = 0.015;

/// Speeds for which the story tells the car's limits (m/s); its top speed instead of one that is beyond it.
const SPEEDS_TOLD_MPS: [f64; 2] = [25.0, 65.0];

/// What a run begins with: all that it reads, and could refuse.
pub struct Prepared {
    /// Log and car.
    pub setup: identify::Setup,
    /// Track and envelope, that of the car which the identification begins with.
    pub road: raceline::Setup,
}

impl Study for Run {
    const NAME: &'static str = "run";
    const ABOUT: &'static str =
        "The whole way from a log to a lap: the car, its g-g-v envelope, its line, and that line driven.";
    const DETAILS: &'static str = "Examples:\n  lapswarm run\n  lapswarm run --log lap.csv --car start.toml --track circuit.csv\n\n\
        A study file names study files of the stages, or has their settings in tables: identify = \"identify.toml\", [raceline].";
    type Settings = RunSettings;
    type State = Journal;
    type Prepared = Prepared;
    type Outcome = Summary;
    type Summary = Summary;

    fn prepare(settings: &RunSettings) -> Result<Prepared> {
        Self::prepare_until(settings, &AtomicBool::new(false))
    }

    fn prepare_until(settings: &RunSettings, stop: &AtomicBool) -> Result<Prepared> {
        let setup = Identify::prepare_until(&settings.identify, stop)?;
        let road = raceline::set_up(&settings.line_of(&settings.identify.car, None))?;
        let car = Car::load(&settings.identify.car)?;
        if car.hybrid.is_some() {
            // What the last stage is to need shows before the first.
            hybrid_parts(&car)?;
        }
        Ok(Prepared { setup, road })
    }

    /// Each stage has the memory for itself: the one that needs most counts.
    fn size(settings: &RunSettings, prepared: Option<&Prepared>) -> Vec<MemoryItem> {
        let setup = prepared.map(|prepared| &prepared.setup);
        let identify = Identify::size(&settings.identify, setup);
        let raceline = Raceline::size(&settings.raceline, None);
        if memory::needed_mib(&identify) >= memory::needed_mib(&raceline) {
            identify
        } else {
            raceline
        }
    }

    fn plan(settings: &RunSettings, prepared: &Prepared, plan: Plan) -> Result<Plan> {
        let plan = planned(&settings.identify, &prepared.setup, plan)?;
        Ok(road_read(plan, &prepared.road))
    }

    fn solve(work: Work<'_, Self>) -> Result<Option<Summary>> {
        run(work).map(Some)
    }

    fn record(summary: &Summary) -> &RunRecord {
        &summary.record
    }

    fn record_mut(summary: &mut Summary) -> &mut RunRecord {
        &mut summary.record
    }

    fn summarise(solved: &Solved<'_, Self>) -> Summary {
        solved.outcome.clone()
    }

    fn subject(settings: &RunSettings, prepared: &Prepared) -> Subject {
        Subject {
            seed: settings.identify.seed,
            car: prepared.setup.replay.free.car.name.clone(),
            log: Some(prepared.setup.log.source.clone()),
            track: None,
        }
    }

    fn report(folder: &Path, _: &Solved<'_, Self>, summary: &Summary) -> Result<()> {
        write_whole(folder.join("story.txt"), summary.to_text().as_bytes())?;
        page::write(folder, summary)
    }

    fn text(_: &RunSettings, summary: &Summary) -> String {
        summary.to_text()
    }

    fn verdict(_: &RunSettings, summary: &Summary) -> Result<()> {
        if summary.agrees {
            return Ok(());
        }
        let text = "the driven lap is more than half a percent behind the quasi-steady-state lap (see the story above)";
        Err(Error::Study(text.to_owned()))
    }

    fn check(path: &Path) -> Result<String> {
        let settings = RunSettings::read(path)?;
        identify::set_up(&without_laps(&settings.identify))?;
        raceline::set_up(&settings.line_of(&settings.identify.car, None))?;
        Ok(format!("at most {} rounds", settings.rounds))
    }
}

/// A run at work.
struct Going<'a> {
    stages: Stages,
    folder: PathBuf,
    memory_limit_mib: u64,
    observe: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    stop: Arc<AtomicBool>,
    /// Names of stages that were taken from earlier runs.
    reused: Vec<String>,
}

impl Going<'_> {
    /// A stage: its folder, and its figures. Stages of the same `inputs` find the same.
    fn stage<S: Study>(
        &mut self,
        (number, doing): (usize, String),
        inputs: &impl Debug,
        settings: &S::Settings,
        prepared: &S::Prepared,
    ) -> Result<(PathBuf, S::Summary)> {
        let (observe, stop, folder) = (&mut *self.observe, &self.stop, &self.folder);
        let limit_mib = self.memory_limit_mib;
        let name = format!("{number}_{}", S::NAME);
        let mut key = Inputs::of_program(S::NAME);
        key.add(inputs);
        let interrupted = || Error::Interrupted(folder.clone());
        if observe(&Progress::reached(&*doing, 0, "")).is_break() {
            return Err(interrupted());
        }
        let (at, reused) = self.stages.run(&name, &key, |to, state_file| {
            let _allowed = memory::check(&S::size(settings, Some(prepared)), limit_mib)?;
            let mut told = |progress: &Progress| {
                let mut progress = progress.clone();
                progress.stage = format!("{doing}: {}", progress.stage);
                observe(&progress)
            };
            // Where the stage's file lies is the run's matter: whatever state was left for these inputs is used.
            let outcome = resumed_or_new::<S, _>(settings, state_file, false, |state, state_file| {
                S::solve(Work {
                    settings,
                    prepared,
                    state,
                    state_file,
                    observe: &mut told,
                    stop: Arc::clone(stop),
                })
            });
            // The run's folder is what is resumed, wherever the stage's state is.
            let outcome = match outcome {
                Err(Error::Interrupted(_)) => None,
                outcome => outcome?,
            };
            let outcome = outcome.filter(|outcome| !S::record(outcome).interrupted);
            write_results::<S>(to, settings, prepared, &outcome.ok_or_else(interrupted)?).map(drop)
        })?;
        if reused {
            self.reused.push(S::NAME.to_owned());
        }
        let summary = read_summary(&at)?;
        Ok((at, summary))
    }
}

/// The figures of a stage.
fn read_summary<T: DeserializeOwned>(folder: &Path) -> Result<T> {
    let path = folder.join(SUMMARY);
    let text = std::fs::read_to_string(&path).map_err(|e| Error::io(&path, "read", e))?;
    serde_json::from_str(&text)
        .map_err(|e| Error::input(&path, "contents", e.to_string(), "the summary of a stage"))
}

/// Runs everything into the folder of the state_file.
///
/// # Errors
/// Those of the stages; [`Error::Interrupted`] if the run was interrupted.
fn run(work: Work<'_, Run>) -> Result<Summary> {
    let watch = Watch::begin();
    let settings = work.settings;
    let journal = work.state.map_or_else(|| Journal::new(Run::NAME, settings), Ok)?;
    work.state_file.save(&journal)?;
    let folder = work.state_file.folder().to_owned();
    // Without a cache to share, an interrupted run still finds its own stages again.
    let own = folder.join(".stages");
    let cache = settings.cache.as_ref().unwrap_or(&own);
    let mut going = Going {
        stages: Stages::new(&folder, cache, work.state_file.interval()),
        folder,
        memory_limit_mib: memory::limit_mib(),
        observe: work.observe,
        stop: work.stop,
        reused: Vec::new(),
    };
    let outcome = run_stages(settings, work.prepared, &mut going, &watch)?;
    if own.exists() {
        std::fs::remove_dir_all(&own).map_err(|e| Error::io(&own, "remove", e))?;
    }
    Ok(outcome)
}

/// The stages, one after the other.
fn run_stages(
    settings: &RunSettings,
    prepared: &Prepared,
    going: &mut Going<'_>,
    watch: &Watch,
) -> Result<Summary> {
    let setup = &prepared.setup;
    let inputs = (
        &settings.identify,
        &setup.log,
        &setup.replay.free.car,
        &setup.truth,
    );
    let (identified, fitted) =
        going.stage::<Identify>((1, "the car".to_owned()), &inputs, &settings.identify, setup)?;
    let car_path = identified.join("car.toml").display().to_string();
    let car = Car::load(&car_path)?;

    let envelope = EnvelopeSettings {
        car: car_path.clone(),
        ..EnvelopeSettings::default()
    };
    let envelope_of = EnvelopeStudy::prepare(&envelope)?;
    let (at, _) =
        going.stage::<EnvelopeStudy>((2, "its envelope".to_owned()), &car, &envelope, &envelope_of)?;
    let whole = Envelope::load(at.join("envelope.csv"))?;

    let mut rounds: Vec<RoundSummary> = Vec::new();
    let mut driven_within: Option<PathBuf> = None;
    let mut last_line: Option<PathBuf> = None;
    for round in 1..=settings.rounds {
        let line = settings.line_of(&car_path, driven_within.clone());
        let road = raceline::set_up(&line)?;
        // The car is in its envelope; where its file lies does not matter.
        let alike = RacelineSettings {
            car: String::new(),
            envelope: None,
            ..line.clone()
        };
        let car = (road.car.envelope.figures(), road.car.curvature_rate());
        let inputs = (alike, &road.cross_sections, car);
        let stage = (1 + 2 * round, format!("line {round}"));
        let (at, found) = going.stage::<Raceline>(stage, &inputs, &line, &road)?;
        let line_path = at.join("line_fastest.csv");

        let drive = TransientSettings {
            line: vec![line_path.clone()],
            track: Some(line.track.clone()),
            car: car_path.clone(),
            car_width_m: Some(settings.raceline.car_width_m),
            steering_rate_deg_s: settings.raceline.steering_rate_deg_s,
            ..TransientSettings::default()
        };
        let points_m = read_line(&line_path)?;
        let width_m = settings.raceline.car_width_m;
        let name = "fastest".to_owned();
        let fastest = NamedLine::new(name, points_m, &road, width_m)?;
        let mut road = road;
        road.car.envelope = whole.clone();
        let driven = transient::Prepared {
            car: drive.read_car()?,
            road,
            lines: vec![fastest],
            motor: None,
        };
        let (line, road) = (&driven.lines[0], &driven.road);
        let inputs = (
            &driven.car,
            drive.car_width_m,
            whole.figures(),
            &road.edges_m,
            &line.points_m,
            &line.circuit.drs_zones_m,
        );
        let stage = (2 + 2 * round, format!("line {round}, driven by the car"));
        let (at, lap) = going.stage::<Transient>(stage, &inputs, &drive, &driven)?;
        driven_within = Some(at.join("envelope_driven.csv"));
        last_line = Some(line_path);
        let found = RoundSummary::of(&found, &lap)?;
        // The first line is driven within the whole envelope.
        let before = rounds.last().map_or(1.0, |before| before.grip_share);
        let settled = (before - found.grip_share).abs() <= SETTLED;
        rounds.push(found);
        if settled {
            break;
        }
    }
    let mut energy = None;
    if car.hybrid.is_some() {
        let deployed = HybridStudySettings {
            track: settings.raceline.track.clone(),
            car: car_path,
            envelope: driven_within,
            line: last_line,
            car_width_m: settings.raceline.car_width_m,
            steering_rate_deg_s: settings.raceline.steering_rate_deg_s,
            seed: settings.raceline.seed,
            backend: settings.raceline.backend,
            adapter: settings.raceline.adapter.clone(),
            ..HybridStudySettings::default()
        };
        let line = deployed.line.as_deref().map(read_line).transpose()?;
        let within = deployed.envelope.as_deref().map(Envelope::load).transpose()?;
        let place = (&deployed.backend, &deployed.adapter, deployed.seed);
        let road = (
            line,
            within.as_ref().map(Envelope::figures),
            &deployed.track,
            deployed.car_width_m,
        );
        let inputs = (&car, road, place);
        let prepared = Hybrid::prepare(&deployed)?;
        let stage = (3 + 2 * rounds.len(), "energy".to_owned());
        let (_, found) = going.stage::<Hybrid>(stage, &inputs, &deployed, &prepared)?;
        energy = Some(EnergySummary::of(&found)?);
    }
    let mut record = fitted.record.clone();
    record.elapsed_s = watch.elapsed_s();
    record.longest_dispatch_ms = watch.longest_dispatch_ms();
    let told_at_mps = SPEEDS_TOLD_MPS.map(|v| v.min(whole.top_speed_mps()));
    Ok(Summary {
        study: Run::NAME.to_owned(),
        seed: settings.identify.seed,
        record,
        log: setup.log.source.clone(),
        car: car.name.clone(),
        total_parameter_error: fitted.total_parameter_error,
        rms_error: fitted.rms_error,
        told_at_mps,
        ay_mps2: told_at_mps.map(|v| whole.at(v).ay_mps2),
        ay_in_the_log_mps2: told_at_mps.map(|v| Some(car.reached.as_ref()?.at(v)?.ay_mps2)),
        top_speed_mps: whole.top_speed_mps(),
        agrees: rounds.last().is_some_and(RoundSummary::agrees),
        rounds,
        energy,
        reused: std::mem::take(&mut going.reused),
    })
}
