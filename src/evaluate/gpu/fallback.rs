//! Evaluation on a device that may fail: the device is reopened once, then lanes on the processor replace it.

use super::GpuContext;
use crate::error::{Error, Result};
use crate::evaluate::{BackendChoice, BackendInfo, Evaluation, Evaluator, Problem};

/// An evaluator on any backend.
type Boxed<'a> = Box<dyn Evaluator + 'a>;

/// Scores populations on a device as long as the device works. A device that fails is reopened and given the same population. If
/// it fails again, lanes on the processor take over for good. The scores agree within the backends' parity either way.
pub struct FallbackEvaluator<'a> {
    problem: &'a Problem,
    /// `None` only while one evaluator replaces another.
    current: Option<Boxed<'a>>,
    on_device: bool,
    open: Box<dyn Fn() -> Result<Boxed<'a>> + 'a>,
    lanes: Box<dyn Fn() -> Boxed<'a> + 'a>,
    faults: Vec<String>,
}

impl<'a> FallbackEvaluator<'a> {
    /// An evaluator that `open` opens on a device, with that of `lanes` to take over.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if there is no device. With [`BackendChoice::Auto`] and no `adapter`, or if the process had the device
    /// before, lanes take over instead. So they do from a device that is present and fails.
    pub fn new(
        problem: &'a Problem,
        (choice, adapter): (BackendChoice, Option<&str>),
        open: impl Fn() -> Result<Boxed<'a>> + 'a,
        lanes: impl Fn() -> Boxed<'a> + 'a,
    ) -> Result<Self> {
        let mut evaluator = Self {
            problem,
            current: None,
            on_device: false,
            open: Box::new(open),
            lanes: Box::new(lanes),
            faults: Vec::new(),
        };
        match (evaluator.open)() {
            Ok(device) => {
                evaluator.current = Some(device);
                evaluator.on_device = true;
            }
            // A study that had its device finishes without it.
            Err(error @ Error::NoDevice(_))
                if (choice == BackendChoice::Auto && adapter.is_none()) || GpuContext::was_open(adapter) =>
            {
                evaluator.take_over(error.to_string());
            }
            Err(Error::Device(message)) => evaluator.open_anew(message),
            Err(error) => return Err(error),
        }
        Ok(evaluator)
    }

    fn note(&mut self, fault: String) {
        tracing::warn!("{fault}");
        self.faults.push(fault);
    }

    /// Reopens the device, or takes over.
    fn open_anew(&mut self, message: String) {
        // The failed one closes first.
        self.current = None;
        GpuContext::forget();
        match (self.open)() {
            Ok(device) => {
                self.note(format!("the device failed ({message}) and was opened anew"));
                self.current = Some(device);
                self.on_device = true;
            }
            Err(error) => self.take_over(format!(
                "the device failed ({message}) and does not open again ({error})"
            )),
        }
    }

    fn take_over(&mut self, reason: String) {
        self.note(format!("{reason}; the backend simd takes over"));
        self.current = Some((self.lanes)());
        self.on_device = false;
    }

    fn try_once(&mut self, population: &[f64]) -> Result<Evaluation> {
        match &mut self.current {
            Some(current) => current.evaluate(population),
            None => Err(Error::Device("there is no device".to_owned())),
        }
    }
}

impl Evaluator for FallbackEvaluator<'_> {
    fn problem(&self) -> &Problem {
        self.problem
    }

    fn backend(&self) -> BackendInfo {
        match &self.current {
            Some(current) => current.backend(),
            None => (self.lanes)().backend(),
        }
    }

    fn device_faults(&self) -> &[String] {
        &self.faults
    }

    fn evaluate(&mut self, population: &[f64]) -> Result<Evaluation> {
        let first = match self.try_once(population) {
            Err(Error::Device(message)) if self.on_device => message,
            outcome => return outcome,
        };
        self.open_anew(first);
        match self.try_once(population) {
            Err(Error::Device(message)) if self.on_device => {
                // The failed device closes before its successor works.
                self.current = None;
                GpuContext::forget();
                self.take_over(format!("the device failed again ({message})"));
                self.try_once(population)
            }
            outcome => outcome,
        }
    }
}
