//! What studies of a replayed lap share: settings, ranges of parameters, costs of candidates.

use crate::config::kinds::{Shared, shared};
use crate::config::settings::{Declared, Flag, Role};
use crate::error::Result;
use crate::evaluate::replay::{CHANNEL_LABELS, CHANNEL_NAMES, open_evaluator};
use crate::evaluate::{Evaluator, add_failures};
use crate::study::framework::journal::{Journal, Recorder};
use crate::study::framework::{Inputs, Progress, RunRecord, Study, Watch, Work};
use crate::study::identify::{FreeParameter, IdentifySettings, ObjectiveChoice, Setup, set_up};
use crate::vehicle::Car;

/// The settings of an identification as another study of a replayed lap shares them. What concerns the search alone has no flag
/// there.
pub(in crate::study) fn replay_settings(
    renamed: &'static [(&'static str, Flag)],
) -> Shared<IdentifySettings> {
    const OTHER: [&str; 7] = [
        "truth",
        "model",
        "objectives",
        "holdout",
        "free",
        "free_from",
        "most",
    ];
    let without = |d: &Declared| (d.role == Role::Search && d.key != "seed") || OTHER.contains(&d.key);
    shared().without_flags(without).renamed(renamed)
}

/// The usual settings with windows of a second and a half: figures are of the parameters' own effect, and not of what a spin makes
/// of it many corners later.
pub(in crate::study) fn windowed() -> IdentifySettings {
    IdentifySettings {
        window_s: Some(1.5),
        settle_s: Some(0.5),
        ..IdentifySettings::default()
    }
}

/// Reads car and lap. Objectives are all channels together, then each alone; windows start as the base car comes there.
///
/// # Errors
/// As [`set_up`].
pub(in crate::study) fn set_up_channels(
    settings: &IdentifySettings,
    free: Vec<FreeParameter>,
) -> Result<Setup> {
    let channels = (0..CHANNEL_NAMES.len()).map(ObjectiveChoice::Channel);
    let mut setup = set_up(&IdentifySettings {
        free: free.into(),
        free_from: None,
        objectives: std::iter::once(ObjectiveChoice::All).chain(channels).collect(),
        ..settings.clone()
    })?;
    setup.replay.start_as_base_drives();
    Ok(setup)
}

/// What a cost is of, in words.
pub(in crate::study) fn of_cost(objective: &str) -> &str {
    match CHANNEL_NAMES.iter().position(|name| *name == objective) {
        Some(channel) => CHANNEL_LABELS[channel],
        None if objective == "all" => "all channels",
        None => objective,
    }
}

/// The ranges of the parameters about the base car's values.
pub(in crate::study) fn ranges_about(
    settings: &IdentifySettings,
    names: &[String],
    share: f64,
) -> Result<Vec<FreeParameter>> {
    let car = settings.model.of(Car::load(&settings.car)?);
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

/// Candidates of one call of the evaluator: enough to fill any device for a moment, few enough to be interrupted.
const BATCH: usize = 1024;

/// Candidates that were driven through a log.
pub(in crate::study) struct Driven {
    /// Costs of each candidate up to where the study was interrupted, if it was; nothing where one does not drive.
    pub costs: Vec<Option<Vec<f64>>>,
    record: RunRecord,
    watch: Watch,
}

impl Driven {
    /// Whether the study was interrupted.
    pub fn interrupted(&self) -> bool {
        self.record.interrupted
    }

    /// How the study ran, which ends now.
    pub fn record(mut self) -> RunRecord {
        let elapsed_s = self.watch.elapsed_s();
        self.record.took(self.costs.len() as u64, elapsed_s, elapsed_s);
        self.record.longest_dispatch_ms = self.watch.longest_dispatch_ms();
        self.record
    }
}

/// Drives the candidates of several populations through a log, one after the other, and keeps a journal of the answers.
///
/// # Errors
/// Those of the evaluator and of the journal.
pub(in crate::study) fn drive<S: Study<Prepared = Setup, State = Journal>>(
    replay: &IdentifySettings,
    populations: &[&[f64]],
    work: Work<'_, S>,
) -> Result<Driven> {
    let watch = Watch::begin();
    let setup = work.prepared;
    let mut evaluator = open_evaluator(&setup.replay, replay.backend, replay.adapter.as_deref())?;
    let mut recorder = Recorder::of(S::NAME, work.settings, work.state, work.state_file)?;
    recorder.begin(inputs_of(S::NAME, setup), &evaluator.backend())?;
    let mut record = RunRecord::of(&evaluator.backend());
    let mut recorded = recorder.over(evaluator.as_mut());
    let dimensions = setup.replay.dimensions();
    let width = setup.replay.problem.objectives.len();
    let planned = populations.concat().len() / dimensions;
    let mut costs = Vec::with_capacity(planned);
    for batch in populations.iter().flat_map(|p| p.chunks(BATCH * dimensions)) {
        let found = recorded.evaluate(batch)?;
        add_failures(&mut record.failures, &found.failure_counts());
        let rows = found.objectives.chunks_exact(width).zip(&found.failures);
        costs.extend(rows.map(|(row, failure)| failure.is_none().then(|| row.to_vec())));
        let progress = Progress::counted(costs.len() as u64, planned as u64);
        if (work.observe)(&progress).is_break() {
            record.interrupted = true;
            recorder.save()?;
            break;
        }
    }
    recorder.complete(&mut record);
    Ok(Driven { costs, record, watch })
}

/// What the costs of this setup depend on.
fn inputs_of(study: &str, setup: &Setup) -> String {
    let replay = &setup.replay;
    let mut inputs = Inputs::new(study);
    inputs.add(&(&replay.plan, &replay.problem, &replay.free.car));
    inputs.key()
}
