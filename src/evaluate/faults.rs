//! What goes wrong with devices and candidates over many evaluations, each fault told once.

use super::{Evaluator, FailureCounts, add_failures};
use serde::{Deserialize, Serialize};

/// What has been seen of an evaluator's [device faults](Evaluator::device_faults).
#[derive(Debug)]
pub struct DeviceFaults {
    /// How many were met when it was opened; zero once they are told.
    opening: usize,
    seen: usize,
    /// What has been told of before.
    known: Vec<String>,
}

impl DeviceFaults {
    /// Of an evaluator as it was opened.
    pub fn of(evaluator: &dyn Evaluator) -> Self {
        let met = evaluator.device_faults().len();
        Self {
            opening: met,
            seen: met,
            known: Vec::new(),
        }
    }

    /// The same where these have been told of before.
    pub fn beyond(known: &[String], evaluator: &dyn Evaluator) -> Self {
        let known = known.to_vec();
        Self {
            known,
            ..Self::of(evaluator)
        }
    }

    /// What has gone wrong since the last look. A study that opens one evaluator after the other, or is resumed, meets at
    /// every opening what it met at the first: of that, only what is not among those `told`.
    pub fn since(&mut self, evaluator: &dyn Evaluator, told: &[String]) -> Vec<String> {
        let met = evaluator.device_faults();
        let opening = &met[..std::mem::take(&mut self.opening)];
        let mut new: Vec<String> = opening
            .iter()
            .filter(|fault| !told.contains(fault) && !self.known.contains(fault))
            .cloned()
            .collect();
        new.extend_from_slice(&met[self.seen..]);
        self.seen = met.len();
        new
    }
}

/// What went wrong while candidates were evaluated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Losses {
    /// Candidates that failed, by reason.
    pub failures: FailureCounts,
    /// What went wrong with devices and was got over.
    pub device_faults: Vec<String>,
}

impl Losses {
    /// Adds the failures of an evaluation, and what has gone wrong with the device since the last.
    pub fn note(&mut self, failures: &FailureCounts, faults: &mut DeviceFaults, evaluator: &dyn Evaluator) {
        add_failures(&mut self.failures, failures);
        let met = faults.since(evaluator, &self.device_faults);
        self.device_faults.extend(met);
    }

    /// Adds those of another part of the work.
    pub fn add(&mut self, other: &Self) {
        add_failures(&mut self.failures, &other.failures);
        self.device_faults.extend_from_slice(&other.device_faults);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Result;
    use crate::evaluate::{BackendInfo, Evaluation, Problem};

    /// What has faults and evaluates nothing.
    struct Faulty(Problem, Vec<String>);

    impl Faulty {
        fn opened_with(faults: &[&str]) -> Self {
            let problem = Problem {
                variables: Vec::new(),
                objectives: Vec::new(),
            };
            Self(problem, faults.iter().map(|f| (*f).to_owned()).collect())
        }
    }

    impl Evaluator for Faulty {
        fn problem(&self) -> &Problem {
            &self.0
        }
        fn backend(&self) -> BackendInfo {
            BackendInfo::reference()
        }
        fn device_faults(&self) -> &[String] {
            &self.1
        }
        fn evaluate(&mut self, _: &[f64]) -> Result<Evaluation> {
            Ok(Evaluation::default())
        }
    }

    #[test]
    fn what_is_met_at_every_opening_is_told_once_and_all_else_as_often_as_it_happens() {
        let mut told: Vec<String> = Vec::new();
        for _ in 0..3 {
            let mut device = Faulty::opened_with(&["late"]);
            let mut faults = DeviceFaults::of(&device);
            told.extend(faults.since(&device, &told));
            device.1.push("lost".to_owned());
            told.extend(faults.since(&device, &told));
            told.extend(faults.since(&device, &told));
        }
        assert_eq!(told, ["late", "lost", "lost", "lost"]);
    }
}
