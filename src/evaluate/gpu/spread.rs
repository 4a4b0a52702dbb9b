//! One population on several devices.

use crate::error::{Error, Result};
use crate::evaluate::{BackendInfo, Evaluation, Evaluator, Problem};
use std::thread;

/// Scores populations on several devices at once, each with an equal share of the candidates. The shares do not depend on how fast
/// a device is, so that the same devices give the same bytes. Devices of one model and driver give those of one of them.
pub struct Spread<E> {
    first: E,
    others: Vec<E>,
}

/// Several devices, as evaluators report them: those of one name are counted.
pub(super) fn joined(devices: impl IntoIterator<Item = BackendInfo>) -> BackendInfo {
    let mut names: Vec<(String, usize)> = Vec::new();
    let mut drivers: Vec<String> = Vec::new();
    for BackendInfo { device, driver, .. } in devices {
        match names.iter_mut().find(|(name, _)| *name == device) {
            Some((_, count)) => *count += 1,
            None => names.push((device, 1)),
        }
        if !drivers.contains(&driver) {
            drivers.push(driver);
        }
    }
    let counted = names.into_iter().map(|(name, count)| match count {
        1 => name,
        _ => format!("{count} x {name}"),
    });
    BackendInfo {
        backend: "gpu",
        device: counted.collect::<Vec<_>>().join(", "),
        driver: drivers.join(", "),
    }
}

impl<E: Evaluator + Send> Spread<E> {
    /// Over evaluators of the same problem.
    ///
    /// # Errors
    /// [`Error::Device`] without any.
    pub fn new(evaluators: impl IntoIterator<Item = E>) -> Result<Self> {
        let mut evaluators = evaluators.into_iter();
        let first = evaluators.next();
        Ok(Self {
            first: first.ok_or_else(|| Error::Device("there is no device".to_owned()))?,
            others: evaluators.collect(),
        })
    }
}

impl<E: Evaluator + Send> Evaluator for Spread<E> {
    fn problem(&self) -> &Problem {
        self.first.problem()
    }

    fn backend(&self) -> BackendInfo {
        joined(
            [&self.first]
                .into_iter()
                .chain(&self.others)
                .map(Evaluator::backend),
        )
    }

    fn last_kernel_ms(&self) -> Option<f64> {
        let all = [&self.first].into_iter().chain(&self.others);
        all.filter_map(Evaluator::last_kernel_ms).reduce(f64::max)
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let variables = self.problem().variables.len().max(1);
        let candidates = population.len() / variables;
        let share = candidates.div_ceil(1 + self.others.len()).max(1) * variables;
        let (own, rest) = population.split_at(share.min(population.len()));
        thread::scope(|scope| {
            let at_work: Vec<_> = self
                .others
                .iter_mut()
                .zip(rest.chunks(share))
                .map(|(evaluator, part)| scope.spawn(move || evaluator.evaluate(part)))
                .collect();
            let mut whole = self.first.evaluate(own)?;
            for other in at_work {
                let broken = |_| Error::Device("a device's thread broke off".to_owned());
                whole.append(other.join().map_err(broken)??);
            }
            Ok(whole)
        })
    }
}
