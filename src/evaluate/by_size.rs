//! Small populations in lanes, large ones on a device.

use super::{BackendInfo, Evaluation, Evaluator, Problem};
use crate::error::Result;

/// Populations of fewer candidates are evaluated in lanes where the choice of the backend is left open. A device takes as long for a
/// few candidates as for thousands. In the time that an NVIDIA H100 takes for a thousand, the AVX-512 lanes of 16 threads do 480 to
/// 640 cars, or 1,900 lines.
const FEW: usize = 512;

/// An evaluator on any backend.
type Boxed<'a> = Box<dyn Evaluator + 'a>;

/// Evaluates populations of fewer than [`FEW`] candidates in lanes and others on a device, which is opened for the first of them.
/// Where a population is evaluated does not depend on time, so that the same seed gives the same bytes.
pub(super) struct BySize<'a, O> {
    lanes: Boxed<'a>,
    open: O,
    device: Option<Boxed<'a>>,
    info: BackendInfo,
    kernel_ms: Option<f64>,
}

/// What evaluates where `device` takes the large populations.
pub(super) fn by_size(device: BackendInfo, lanes: &BackendInfo) -> BackendInfo {
    BackendInfo {
        device: format!("{}; {} below {FEW} candidates", device.device, lanes.device),
        ..device
    }
}

impl<'a, O: Fn() -> Result<Boxed<'a>>> BySize<'a, O> {
    /// With these `lanes`, and `device` once `open` has opened it.
    pub fn new(lanes: Boxed<'a>, device: BackendInfo, open: O) -> Self {
        Self {
            info: by_size(device, &lanes.backend()),
            lanes,
            open,
            device: None,
            kernel_ms: None,
        }
    }
}

impl<'a, O: Fn() -> Result<Boxed<'a>>> Evaluator for BySize<'a, O> {
    fn problem(&self) -> &Problem {
        self.lanes.problem()
    }

    fn backend(&self) -> BackendInfo {
        match &self.device {
            // Lanes have taken over.
            Some(device) if device.backend().backend != self.info.backend => device.backend(),
            _ => self.info.clone(),
        }
    }

    fn device_faults(&self) -> &[String] {
        self.device.as_ref().map_or(&[], |device| device.device_faults())
    }

    fn last_kernel_ms(&self) -> Option<f64> {
        self.kernel_ms
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let candidates = population.len() / self.problem().variables.len().max(1);
        let evaluator = if candidates < FEW {
            &mut self.lanes
        } else {
            match &mut self.device {
                Some(device) => device,
                none => none.insert((self.open)()?),
            }
        };
        let evaluation = evaluator.evaluate(population)?;
        self.kernel_ms = evaluator.last_kernel_ms();
        Ok(evaluation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::{Objective, Variable};
    use std::cell::Cell;

    /// Says where it was asked, as the objective.
    struct Place(Problem, &'static str, f64);

    impl Place {
        fn boxed(backend: &'static str, objective: f64) -> Boxed<'static> {
            let problem = Problem {
                variables: vec![
                    Variable::new("x", "-", 0.0, 1.0),
                    Variable::new("y", "-", 0.0, 1.0),
                ],
                objectives: vec![Objective::new("place", "-")],
            };
            Box::new(Self(problem, backend, objective))
        }
    }

    impl Evaluator for Place {
        fn problem(&self) -> &Problem {
            &self.0
        }

        fn backend(&self) -> BackendInfo {
            BackendInfo {
                backend: self.1,
                device: self.1.to_uppercase(),
                driver: String::new(),
            }
        }

        fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
            let rows = population.chunks_exact(2).map(|_| (vec![self.2], None));
            Ok(Evaluation::of_rows(rows.collect()))
        }
    }

    #[test]
    fn small_populations_go_to_lanes_and_a_device_is_opened_once_for_large_ones() {
        let opened = Cell::new(0);
        let device = |backend| {
            let opened = &opened;
            move || {
                opened.set(opened.get() + 1);
                Ok(Place::boxed(backend, 2.0))
            }
        };
        let card = Place::boxed("gpu", 2.0).backend();
        let mut evaluator = BySize::new(Place::boxed("simd", 1.0), card.clone(), device("gpu"));
        for (count, place, times) in [(FEW - 1, 1.0, 0), (FEW, 2.0, 1), (1, 1.0, 1), (4 * FEW, 2.0, 1)] {
            let found = evaluator.evaluate(&vec![0.5; 2 * count]).unwrap().objectives;
            assert_eq!(found, vec![place; count]);
            assert_eq!(opened.get(), times);
            assert_eq!(evaluator.backend().device, "GPU; SIMD below 512 candidates");
        }
        // Lanes that have taken over from the device say so.
        let mut taken_over = BySize::new(Place::boxed("simd", 1.0), card, device("simd"));
        taken_over.evaluate(&vec![0.5; 2 * FEW]).unwrap();
        assert_eq!(taken_over.backend().device, "SIMD");
    }
}
