//! The populations that a study has had evaluated, so that an interrupted run can be resumed.
//!
//! A study whose work is a sequence of populations is a function of its settings, of what it reads and of the answers to
//! these populations. Run again and given the answers it has had, it arrives at the place where it was interrupted with every
//! bit of its state, whatever that state is.

use super::state_file::{Origin, StateFile};
use super::{RunRecord, State};
use crate::error::{Error, Result};
use crate::evaluate::{
    BackendChoice, BackendInfo, DeviceFaults, Evaluation, Evaluator, Losses, OnDevice, Problem,
};
use crate::files::run_folder::STATE;
use crate::swarm::checkpoint::Checkpoint;
use crate::swarm::{FrontSwarm, Optimiser, Progress, SwarmAtWork, SwarmState};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// An answered population.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Answer {
    /// Of the population's bits.
    crc: u32,
    evaluation: Evaluation,
    /// What gave it.
    backend: BackendInfo,
    /// What has gone wrong with devices since the answer before.
    device_faults: Vec<String>,
}

/// The answers that a study has had, and what they belong to.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Journal {
    study: String,
    /// The study's settings, as `postcard` writes them.
    settings: Vec<u8>,
    origin: Option<Origin>,
    answers: Vec<Answer>,
    /// Swarms that live on a device, in their order, of which the last may not be done: the host does not know what they ask.
    residents: Vec<Resident>,
}

/// A swarm that lives on a device.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Resident {
    state: SwarmState,
    backend: BackendInfo,
}

impl Checkpoint for Journal {
    const KIND: &'static str = concat!("journal of a study, lapswarm ", env!("CARGO_PKG_VERSION"));
}

impl Journal {
    /// An empty one.
    ///
    /// # Errors
    /// [`Error::Study`] if the settings cannot be written down at all.
    pub fn new<S: Serialize + DeserializeOwned>(study: &str, settings: &S) -> Result<Self> {
        let mut journal = Self {
            study: study.to_owned(),
            settings: Vec::new(),
            origin: None,
            answers: Vec::new(),
            residents: Vec::new(),
        };
        journal.set_settings(settings)?;
        Ok(journal)
    }

    /// Keeps the resident swarm of that number.
    fn keep(&mut self, number: usize, state: SwarmState, backend: BackendInfo) {
        self.residents.truncate(number);
        self.residents.push(Resident { state, backend });
    }
}

impl<S: Serialize + DeserializeOwned> State<S> for Journal {
    fn settings(&self, study: &str) -> Result<S> {
        let refused = |found: String| Err(Error::input(STATE, "study", found, study));
        if self.study != study {
            return refused(self.study.clone());
        }
        match postcard::from_bytes(&self.settings) {
            Ok(settings) => Ok(settings),
            Err(error) => refused(format!("settings of {study} that cannot be read ({error})")),
        }
    }

    fn set_settings(&mut self, settings: &S) -> Result<()> {
        self.settings = postcard::to_allocvec(settings)
            .map_err(|e| Error::Study(format!("the settings of {} cannot be kept: {e}", self.study)))?;
        Ok(())
    }

    fn is_untouched(&self) -> bool {
        self.answers.is_empty() && self.residents.is_empty()
    }
}

/// Answers a study's populations from its journal as far as that goes, then has them evaluated and notes the answers.
pub struct Recorder<'k> {
    /// Nothing where nothing is kept.
    journal: Option<Journal>,
    next: usize,
    next_resident: usize,
    device_faults: Vec<String>,
    /// What gave the last answer.
    backend: Option<BackendInfo>,
    state_file: &'k mut StateFile,
}

impl<'k> Recorder<'k> {
    /// Goes by a journal, and has `state_file` keep it; notes nothing without one.
    pub fn new(journal: impl Into<Option<Journal>>, state_file: &'k mut StateFile) -> Self {
        Self {
            journal: journal.into(),
            next: 0,
            next_resident: 0,
            device_faults: Vec::new(),
            backend: None,
            state_file,
        }
    }

    /// Resumes by the journal of a study that was interrupted, or begins one. Where nothing is saved nothing is noted.
    ///
    /// # Errors
    /// As [`Journal::new`].
    pub fn of<S: Serialize + DeserializeOwned>(
        study: &str,
        settings: &S,
        journal: Option<Journal>,
        state_file: &'k mut StateFile,
    ) -> Result<Self> {
        if !state_file.saves() {
            return Ok(Self::idle(state_file));
        }
        let journal = journal.map_or_else(|| Journal::new(study, settings), Ok)?;
        Ok(Self::new(journal, state_file))
    }

    /// Has everything evaluated and notes nothing.
    pub fn idle(state_file: &'k mut StateFile) -> Self {
        Self::new(None::<Journal>, state_file)
    }

    /// What the answers depend on, to be said before the first of them: a sum over what the study has read, and what
    /// evaluates.
    ///
    /// # Errors
    /// [`Error::Input`] if the journal is of other inputs or another backend; [`Error::Io`] if it cannot be kept.
    pub fn begin(&mut self, inputs: String, backend: &BackendInfo) -> Result<()> {
        let now = Origin::new(inputs, backend);
        let Some(journal) = &mut self.journal else {
            return Ok(());
        };
        if let Some(began) = &journal.origin {
            self.state_file.check(began, &now)?;
        }
        journal.origin = Some(now);
        self.save()
    }

    /// Says in a record what gave the last answer and what went wrong with devices in all of them.
    pub(in crate::study) fn complete(&self, record: &mut RunRecord) {
        if let Some(backend) = &self.backend {
            record.moved_to(backend);
        }
        record.device_faults.clone_from(&self.device_faults);
    }

    /// Saves the journal.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be written; the one saved before is still there then.
    pub fn save(&mut self) -> Result<()> {
        match &self.journal {
            Some(journal) => self.state_file.save(journal),
            None => Ok(()),
        }
    }

    /// Runs a swarm on the device that evaluates `kind` until its planned iterations are done or `observe` returns `Break`. One that
    /// was interrupted goes on where it was; what was told until then is told again as one.
    ///
    /// # Errors
    /// As [`SwarmAtWork::step`].
    pub(in crate::study) fn run_on_device<K: OnDevice>(
        &mut self,
        kind: &K,
        swarm: FrontSwarm,
        place: (BackendChoice, Option<&str>),
        mut observe: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<FrontSwarm> {
        let number = self.next_resident;
        self.next_resident += 1;
        let begun = self.journal.as_ref();
        let begun = begun.and_then(|journal| journal.residents.get(number).cloned());
        let mut flow = ControlFlow::Continue(());
        let state = match begun {
            Some(Resident { state, backend }) => {
                let failures = state.losses.failures.clone();
                flow = observe(&Progress {
                    iteration: state.swarm.iteration(),
                    evaluations: state.swarm.evaluations(),
                    best: state.swarm.best(),
                    violation: state.swarm.violation(),
                    median: None,
                    failed: 0,
                    failures,
                });
                if state.swarm.done() {
                    self.backend = Some(backend);
                    self.device_faults.extend_from_slice(&state.losses.device_faults);
                    return Ok(state.swarm);
                }
                state
            }
            None => SwarmState {
                swarm,
                losses: Losses::default(),
            },
        };
        let mut at_work = SwarmAtWork::open(kind, state, true, place, &self.device_faults)?;
        while flow.is_continue() && !at_work.done() {
            flow = observe(&at_work.step()?);
            if let Some(journal) = &mut self.journal
                && self.state_file.due()
            {
                let state = at_work.state().clone();
                journal.keep(number, state, at_work.backend());
                self.state_file.save_or_warn(journal);
            }
        }
        let backend = at_work.backend();
        let mut state = at_work.finish()?;
        if state.swarm.done() {
            state.swarm.let_particles_go();
        }
        self.backend = Some(backend.clone());
        self.device_faults.extend_from_slice(&state.losses.device_faults);
        if let Some(journal) = &mut self.journal {
            journal.keep(number, state.clone(), backend);
        }
        Ok(state.swarm)
    }

    /// An evaluator whose answers are noted.
    pub fn over<'a>(&'a mut self, evaluator: &'a mut dyn Evaluator) -> Recorded<'a, 'k> {
        Recorded {
            recorder: self,
            faults: DeviceFaults::of(evaluator),
            evaluator,
        }
    }
}

/// An [`Evaluator`] whose answers are noted, or known already.
pub struct Recorded<'a, 'k> {
    recorder: &'a mut Recorder<'k>,
    evaluator: &'a mut dyn Evaluator,
    faults: DeviceFaults,
}

fn crc_of(population: &[f64]) -> u32 {
    crc32fast::hash(bytemuck::cast_slice(population))
}

impl Evaluator for Recorded<'_, '_> {
    fn problem(&self) -> &Problem {
        self.evaluator.problem()
    }

    fn backend(&self) -> BackendInfo {
        self.evaluator.backend()
    }

    fn device_faults(&self) -> &[String] {
        &self.recorder.device_faults
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let recorder = &mut *self.recorder;
        let crc = crc_of(population);
        let known = recorder
            .journal
            .as_ref()
            .and_then(|j| j.answers.get(recorder.next));
        if let Some(answer) = known {
            if answer.crc != crc {
                let expected = "the populations that the study asks for; it was begun with another build";
                return Err(Error::input(
                    STATE,
                    "answers",
                    "those to other populations",
                    expected,
                ));
            }
            recorder.next += 1;
            recorder.device_faults.extend_from_slice(&answer.device_faults);
            recorder.backend = Some(answer.backend.clone());
            return Ok(answer.evaluation.clone());
        }
        let evaluation = self.evaluator.evaluate(population)?;
        let device_faults = self.faults.since(self.evaluator, &recorder.device_faults);
        recorder.device_faults.extend_from_slice(&device_faults);
        let backend = self.evaluator.backend();
        recorder.backend = Some(backend.clone());
        if let Some(journal) = &mut recorder.journal {
            journal.answers.push(Answer {
                crc,
                evaluation: evaluation.clone(),
                backend,
                device_faults,
            });
            recorder.next += 1;
            if recorder.state_file.due() {
                recorder.state_file.save_or_warn(journal);
            }
        }
        Ok(evaluation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Objective, Variable};
    use crate::swarm::checkpoint;

    /// The squares of one variable, counted.
    struct Squares(Problem, usize);

    impl Squares {
        fn new() -> Self {
            let problem = Problem {
                variables: vec![Variable::new("x", "-", 0.0, 1.0)],
                objectives: vec![Objective::new("square", "-")],
            };
            Self(problem, 0)
        }
    }

    impl Evaluator for Squares {
        fn problem(&self) -> &Problem {
            &self.0
        }

        fn backend(&self) -> BackendInfo {
            BackendInfo::reference()
        }

        fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
            self.1 += 1;
            Ok(Evaluation {
                objectives: population.iter().map(|x| x * x).collect(),
                failures: vec![None; population.len()],
                violations: Vec::new(),
            })
        }
    }

    #[test]
    fn what_is_known_is_not_evaluated_again_and_other_questions_are_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join(STATE);
        let mut squares = Squares::new();
        let mut state_file = StateFile::new(folder.path());
        let mut recorder = Recorder::new(
            Journal::new("squares", &(3u32, 0.5)).expect("settings"),
            &mut state_file,
        );
        recorder
            .begin("a".to_owned(), &squares.backend())
            .expect("it begins");
        for x in [0.25, 0.5] {
            recorder.over(&mut squares).evaluate(&[x]).expect("a square");
        }
        recorder.save().expect("it is kept");
        assert_eq!(squares.1, 2);

        let journal: Journal = checkpoint::load(&file).expect("a journal");
        assert_eq!(
            State::<(u32, f64)>::settings(&journal, "squares").expect("settings"),
            (3, 0.5)
        );
        assert!(State::<(u32, f64)>::settings(&journal, "cubes").is_err());
        let mut state_file = StateFile::new(folder.path());
        let mut again = Recorder::new(journal.clone(), &mut state_file);
        again.begin("a".to_owned(), &squares.backend()).expect("the same");
        for (x, square) in [(0.25, 0.0625), (0.5, 0.25), (1.0, 1.0)] {
            let found = again.over(&mut squares).evaluate(&[x]).expect("a square");
            assert_eq!(found.objectives, [square]);
        }
        assert_eq!(squares.1, 3, "only the third was not known");

        let mut state_file = StateFile::new(folder.path());
        let mut other = Recorder::new(journal.clone(), &mut state_file);
        assert!(other.over(&mut squares).evaluate(&[0.75]).is_err());
        let mut elsewhere = Recorder::new(journal, &mut state_file);
        assert!(elsewhere.begin("b".to_owned(), &squares.backend()).is_err());
    }

    /// Squares on a device that fails at every evaluation from the second on, and opens with a fault.
    struct Failing(Squares, Vec<String>);

    impl Failing {
        fn new() -> Self {
            Self(Squares::new(), vec!["opened late".to_owned()])
        }
    }

    impl Evaluator for Failing {
        fn problem(&self) -> &Problem {
            self.0.problem()
        }

        fn backend(&self) -> BackendInfo {
            let backend = if self.1.len() > 1 { "simd" } else { "gpu" };
            BackendInfo {
                backend,
                ..self.0.backend()
            }
        }

        fn device_faults(&self) -> &[String] {
            &self.1
        }

        fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
            let found = self.0.evaluate(population)?;
            if self.0.1 > 1 {
                self.1.push("lost".to_owned());
            }
            Ok(found)
        }
    }

    #[test]
    fn faults_are_told_once_whether_or_not_the_run_was_broken_off() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut state_file = StateFile::new(folder.path());
        let journal = Journal::new("squares", &1u32).expect("settings");
        let mut recorder = Recorder::new(journal, &mut state_file);
        let mut device = Failing::new();
        for x in [0.25, 0.5, 0.75] {
            recorder.over(&mut device).evaluate(&[x]).expect("a square");
        }
        let told = ["opened late", "lost", "lost"];
        assert_eq!(recorder.device_faults, told);
        assert_eq!(recorder.backend.as_ref().map(|b| b.backend), Some("simd"));
        recorder.save().expect("it is kept");

        let journal: Journal = checkpoint::load(&folder.path().join(STATE)).expect("a journal");
        let mut state_file = StateFile::new(folder.path());
        let mut again = Recorder::new(journal, &mut state_file);
        let mut device = Failing::new();
        let mut recorded = again.over(&mut device);
        for x in [0.25, 0.5, 0.75] {
            recorded.evaluate(&[x]).expect("a square");
        }
        assert_eq!(recorded.device_faults(), told);
        recorded.evaluate(&[1.0]).expect("a square");
        assert_eq!(
            recorded.device_faults(),
            told,
            "it opens as late as before, and works"
        );
        recorded.evaluate(&[0.125]).expect("a square");
        assert_eq!(recorded.device_faults()[3..], ["lost"]);
    }
}
