//! Evaluators: each works in a thread of its own, so that Python goes on meanwhile.

use crate::arrays::{array, check_width, table};
use crate::errors::{OrRaise, exception, refused};
use crate::problem::Problem;
use lapswarm::config::kinds::Choice;
use lapswarm::evaluate::{self, BackendChoice, BackendInfo, Failure};
use lapswarm::{Error, Result};
use numpy::{PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyRuntimeWarning;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::ffi::CString;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time between two looks for an interrupt.
pub const LOOK: Duration = Duration::from_millis(50);

/// Candidates that stay where their owner has them.
struct Rows {
    data: *const f64,
    count: usize,
}

// SAFETY: whoever sends rows to the thread of an evaluator keeps them borrowed until that thread has answered or has ended, and
// the thread only reads them.
unsafe impl Send for Rows {}

impl Rows {
    fn of(rows: &[f64]) -> Self {
        Self {
            data: rows.as_ptr(),
            count: rows.len(),
        }
    }

    /// The rows.
    ///
    /// # Safety
    /// Their owner must still have them.
    unsafe fn get(&self) -> &[f64] {
        // SAFETY: pointer and length are those of a slice, which lives as the caller promises.
        unsafe { std::slice::from_raw_parts(self.data, self.count) }
    }
}

/// What a thread answers: the evaluation, the time that it took (s), and what did the work.
type Reply = Result<(evaluate::Evaluation, f64, BackendInfo, Vec<String>)>;

/// A population to evaluate, and where the answer goes.
type Task = (Rows, Sender<Reply>);

/// Evaluates whole populations on a backend: `auto`, `cpu` (f64), `simd` (f32 lanes) or `gpu`.
#[pyclass(frozen, module = "lapswarm._native")]
pub struct Evaluator {
    problem: Py<Problem>,
    tasks: Mutex<Sender<Task>>,
    backend: Mutex<(BackendInfo, Vec<String>)>,
}

/// Waits for an answer and lets Python go on meanwhile. An interrupt is raised once the answer is there: until then the other side
/// may read what it was sent.
pub fn wait<T: Send>(py: Python<'_>, answers: &mut Receiver<T>) -> PyResult<Option<T>> {
    let mut interrupt = Ok(());
    loop {
        let receiver = &mut *answers;
        let found = py.detach(move || receiver.recv_timeout(LOOK));
        match found {
            Ok(answer) => return interrupt.map(|()| Some(answer)),
            Err(RecvTimeoutError::Disconnected) => return interrupt.map(|()| None),
            Err(RecvTimeoutError::Timeout) => interrupt = interrupt.and(py.check_signals()),
        }
    }
}

/// The work of the thread: opens the evaluator, says whether it did, and evaluates until its owner is gone.
fn work(
    problem: &Problem,
    (choice, adapter): (BackendChoice, Option<String>),
    opened: &Sender<Result<BackendInfo>>,
    tasks: &Receiver<Task>,
) {
    let mut evaluator = match problem.kind.open(choice, adapter.as_deref()) {
        Ok(evaluator) => evaluator,
        Err(error) => {
            // An owner that is gone wants no answer.
            let _ = opened.send(Err(error));
            return;
        }
    };
    let _ = opened.send(Ok(evaluator.backend()));
    while let Ok((rows, reply)) = tasks.recv() {
        // SAFETY: the owner waits for the answer, and keeps the rows until then.
        let began = Instant::now();
        let found = evaluator.evaluate(unsafe { rows.get() });
        let elapsed_s = began.elapsed().as_secs_f64();
        let answer = found.map(|found| {
            let faults = evaluator.device_faults().to_vec();
            (found, elapsed_s, evaluator.backend(), faults)
        });
        let _ = reply.send(answer);
    }
}

/// Where the first number is that is not finite. Whole blocks are looked at first: they take many numbers at once.
pub fn first_not_finite(rows: &[f64]) -> Option<usize> {
    const BLOCK: usize = 512;
    let all_are = |block: &[f64]| block.iter().fold(true, |all, x| all & x.is_finite());
    let block = BLOCK * rows.chunks(BLOCK).position(|block| !all_are(block))?;
    let within = rows[block..].iter().position(|x| !x.is_finite())?;
    Some(block + within)
}

fn gone() -> Error {
    Error::Device("the thread of the evaluator has ended".to_owned())
}

#[pymethods]
impl Evaluator {
    #[new]
    #[pyo3(signature = (problem, backend="auto", adapter=None))]
    fn new(py: Python<'_>, problem: Py<Problem>, backend: &str, adapter: Option<String>) -> PyResult<Self> {
        let choice = BackendChoice::named(backend)
            .ok_or_else(|| refused(py, "Evaluator", "backend", backend, &BackendChoice::names()))?;
        let shared = Problem {
            kind: Arc::clone(&problem.get().kind),
        };
        let (tasks, queue) = channel();
        let (said, mut opened) = channel();
        std::thread::spawn(move || work(&shared, (choice, adapter), &said, &queue));
        let info = wait(py, &mut opened)?
            .ok_or_else(|| exception(py, &gone()))?
            .or_raise(py)?;
        if choice == BackendChoice::Auto && info.backend != "gpu" {
            let said = format!(
                "no GPU with a driver of its own was found; the processor evaluates ({}, {}), which backend=\"{}\" asks for outright",
                info.backend, info.device, info.backend
            );
            let said = CString::new(said)?;
            PyErr::warn(py, &py.get_type::<PyRuntimeWarning>(), &said, 1)?;
        }
        Ok(Self {
            problem,
            tasks: Mutex::new(tasks),
            backend: Mutex::new((info, Vec::new())),
        })
    }

    /// The objectives of every candidate. X: an array of shape (n, d), a row for each candidate in the units of the variables;
    /// rows of float64 one after the other are read where they lie.
    #[pyo3(signature = (X, /))]
    #[allow(non_snake_case)]
    fn evaluate(&self, py: Python<'_>, X: &Bound<'_, PyAny>) -> PyResult<Evaluation> {
        let problem = self.problem.get().kind.problem();
        let (dimensions, width) = (problem.variables.len(), problem.objectives.len());
        let population = table(X, "X")?;
        check_width(&population, "X", dimensions, "variable")?;
        let rows = population.as_slice()?;
        if let Some(at) = first_not_finite(rows) {
            let found = format!("{} in row {} (from 0)", rows[at], at / dimensions);
            let name = &problem.variables[at % dimensions].name;
            return Err(refused(py, "X", name, found, "finite numbers"));
        }
        if population.shape()[0] == 0 {
            return Evaluation::new(py, evaluate::Evaluation::default(), width, 0.0);
        }
        let (reply, mut answers) = channel();
        let tasks = self.tasks.lock().unwrap_or_else(PoisonError::into_inner);
        let sent = tasks.send((Rows::of(rows), reply));
        drop(tasks);
        sent.map_err(|_| exception(py, &gone()))?;
        // The rows stay borrowed until the answer is there or the thread has ended.
        let answer = wait(py, &mut answers)?.ok_or_else(|| exception(py, &gone()))?;
        let (found, elapsed_s, info, faults) = answer.or_raise(py)?;
        *self.backend.lock().unwrap_or_else(PoisonError::into_inner) = (info, faults);
        Evaluation::new(py, found, width, elapsed_s)
    }

    /// The problem.
    #[getter]
    fn problem(&self, py: Python<'_>) -> Py<Problem> {
        self.problem.clone_ref(py)
    }

    /// What evaluates: `cpu`, `simd` or `gpu`.
    #[getter]
    fn backend(&self) -> &'static str {
        self.backend
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .0
            .backend
    }

    /// The adapter's name, or the instruction set.
    #[getter]
    fn device(&self) -> String {
        self.backend
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .0
            .device
            .clone()
    }

    /// Faults of devices that evaluation has recovered from, in words.
    #[getter]
    fn device_faults(&self) -> Vec<String> {
        self.backend
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .1
            .clone()
    }

    fn __repr__(&self) -> String {
        format!("<evaluator on {}: {}>", self.backend(), self.device())
    }
}

/// What a population is worth.
#[pyclass(frozen, module = "lapswarm._native")]
pub struct Evaluation {
    objectives: Py<PyArray2<f64>>,
    pub failures: Vec<Option<Failure>>,
    /// Time that the evaluation itself took, without the way there and back (s).
    #[pyo3(get)]
    elapsed_s: f64,
}

impl Evaluation {
    fn new(py: Python<'_>, found: evaluate::Evaluation, width: usize, elapsed_s: f64) -> PyResult<Self> {
        Ok(Self {
            objectives: array(py, found.objectives, width)?.unbind(),
            failures: found.failures,
            elapsed_s,
        })
    }

    /// The same as the library has it.
    pub fn to_library(&self, py: Python<'_>) -> PyResult<evaluate::Evaluation> {
        Ok(evaluate::Evaluation {
            objectives: self.objectives.bind(py).to_vec()?,
            failures: self.failures.clone(),
            violations: Vec::new(),
        })
    }
}

#[pymethods]
impl Evaluation {
    /// Objectives: an array of shape (n, m), a row for each candidate, infinite where it failed.
    #[getter(F)]
    fn objectives(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.objectives.clone_ref(py)
    }

    /// Why each candidate failed, in a word; None where it did not.
    #[getter]
    fn failures(&self) -> Vec<Option<&'static str>> {
        self.failures
            .iter()
            .map(|failure| failure.map(Failure::word))
            .collect()
    }

    /// How many candidates failed, by the word.
    #[getter]
    fn failure_counts(&self) -> BTreeMap<&'static str, usize> {
        let mut counts = BTreeMap::new();
        for failure in self.failures.iter().flatten() {
            *counts.entry(failure.word()).or_default() += 1;
        }
        counts
    }

    fn __len__(&self) -> usize {
        self.failures.len()
    }

    fn __repr__(&self) -> String {
        let failed = self.failures.iter().flatten().count();
        format!(
            "<evaluation of {} candidates, {failed} of which failed>",
            self.failures.len()
        )
    }
}
