//! Optimisers by ask and tell.

use crate::arrays::{array, check_width, table};
use crate::errors::{OrRaise, exception, refused};
use crate::evaluator::{Evaluation, first_not_finite};
use crate::problem::Problem;
use lapswarm::evaluate::{self, Failure};
use lapswarm::swarm::{self, Front, Migration, Sizes, by_name, checkpoint, islands_by_name};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

type Boxed = Box<dyn swarm::Optimiser + Send>;

/// An optimiser that is asked for candidates and told what they are worth.
///
/// name: one of ``SINGLE_OBJECTIVE`` or ``MULTI_OBJECTIVE``. population: candidates of a generation; iterations: generations.
/// archive: the most that are kept for several objectives. islands: so many swarms side by side, each of that population, asked
/// together, with seeds from ``seed`` on; of ``pso``, ``thesis`` and ``difference`` for one objective, of the swarms for several.
/// Every ``migrate_every`` iterations up to ``migrants`` solutions of each go to the next; without it none ever does.
#[pyclass(frozen, module = "lapswarm._native")]
pub struct Optimiser {
    inner: Mutex<Boxed>,
    dimensions: usize,
    width: usize,
}

impl Optimiser {
    fn inner(&self) -> MutexGuard<'_, Boxed> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Rows of objectives and violations that were worked out elsewhere. A row that is not finite is one that failed.
fn told(
    objectives: &Bound<'_, PyAny>,
    violations: Option<&Bound<'_, PyAny>>,
    width: usize,
) -> PyResult<evaluate::Evaluation> {
    let py = objectives.py();
    let mut given = objectives.clone();
    // One objective may come as a list of numbers.
    let numpy = py.import("numpy")?;
    if width == 1 && numpy.call_method1("ndim", (objectives,))?.extract::<usize>()? == 1 {
        given = numpy.call_method1("reshape", (objectives, (-1, 1)))?;
    }
    let rows = table(&given, "F")?;
    check_width(&rows, "F", width, "objective")?;
    let rows = rows.as_slice()?;
    let failed = |row: &[f64]| row.iter().any(|f| !f.is_finite()).then_some(Failure::Undefined);
    let violations = match violations {
        None => Vec::new(),
        Some(given) => {
            let column = numpy.call_method1("reshape", (given, (-1, 1)))?;
            table(&column, "violations")?.as_slice()?.to_vec()
        }
    };
    Ok(evaluate::Evaluation {
        objectives: rows.to_vec(),
        failures: rows.chunks_exact(width).map(failed).collect(),
        violations,
    })
}

#[pymethods]
impl Optimiser {
    #[new]
    #[pyo3(signature = (problem, name="default", *, population=100, iterations=250, archive=100, seed=1, islands=None,
        migrate_every=None, migrants=2))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        py: Python<'_>,
        problem: PyRef<'_, Problem>,
        name: &str,
        population: usize,
        iterations: usize,
        archive: usize,
        seed: u64,
        islands: Option<usize>,
        migrate_every: Option<usize>,
        migrants: usize,
    ) -> PyResult<Self> {
        let problem = problem.kind.problem();
        let sizes = Sizes {
            population,
            iterations,
            archive,
            seed,
        };
        let migration = migrate_every.map(|every| Migration {
            every,
            count: migrants,
        });
        let inner = match islands {
            Some(count) => islands_by_name(name, problem, sizes, (count, migration)),
            None => by_name(name, problem, sizes),
        };
        Ok(Self {
            inner: Mutex::new(inner.or_raise(py)?),
            dimensions: problem.variables.len(),
            width: problem.objectives.len(),
        })
    }

    /// The candidates to evaluate next: an array of shape (n, d), values within their bounds.
    fn ask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let candidates = py.detach(|| self.inner().ask());
        array(py, candidates, self.dimensions)
    }

    /// Takes what the candidates last asked for are worth: an Evaluation, or an array of objectives of shape (n, m) in which a row
    /// that is not finite has failed. violations: an array of shape (n,), the sum of what each candidate exceeds its constraints by.
    #[pyo3(signature = (evaluation, violations=None))]
    fn tell(
        &self,
        py: Python<'_>,
        evaluation: &Bound<'_, PyAny>,
        violations: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let found = match evaluation.cast::<Evaluation>() {
            Ok(found) if violations.is_none() => found.get().to_library(py)?,
            Ok(found) => told(&found.getattr("F")?, violations, self.width)?,
            Err(_) => told(evaluation, violations, self.width)?,
        };
        py.detach(|| self.inner().tell(&found)).or_raise(py)
    }

    /// Takes in candidates that were evaluated elsewhere, such as those of another swarm or rows that were known before: X of shape
    /// (n, d) in the units of the variables, F of shape (n, m), violations of shape (n,) as for ``tell``. A row whose objectives are
    /// not finite has failed, and is left out. Each is taken where it beats what the swarm has: for one objective it becomes the
    /// best of the particle whose best is worst, for several it joins the archive. Every island takes them. They count as no
    /// evaluations. ``pso``, ``thesis`` and ``difference`` take them for one objective, the swarms for several.
    #[pyo3(signature = (X, F, violations=None))]
    #[allow(non_snake_case)]
    fn accept(
        &self,
        py: Python<'_>,
        X: &Bound<'_, PyAny>,
        F: &Bound<'_, PyAny>,
        violations: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let candidates = table(X, "X")?;
        check_width(&candidates, "X", self.dimensions, "variable")?;
        let rows = candidates.as_slice()?;
        if let Some(at) = first_not_finite(rows) {
            let found = format!("{} in row {} (from 0)", rows[at], at / self.dimensions);
            return Err(refused(py, "X", "value", found, "finite numbers"));
        }
        let found = told(F, violations, self.width)?;
        found
            .check(rows.len() / self.dimensions, self.width)
            .or_raise(py)?;
        let mut inner = self.inner();
        let Some(accepting) = inner.accepting() else {
            let expected = "a particle swarm or difference";
            return Err(refused(
                py,
                "accept",
                "optimiser",
                "one that takes in no candidates of others",
                expected,
            ));
        };
        let known: Vec<usize> = (0..found.failures.len())
            .filter(|&i| found.success(i, self.width).is_some())
            .collect();
        // Together go those that violate the constraints equally.
        for equal in known.chunk_by(|&a, &b| found.violation(a) == found.violation(b)) {
            let of = |rows: &[f64], width: usize| -> Vec<Vec<f64>> {
                equal
                    .iter()
                    .map(|&i| rows[i * width..(i + 1) * width].to_vec())
                    .collect()
            };
            accepting.accept_migrants(&Front {
                candidates: of(rows, self.dimensions),
                objectives: of(&found.objectives, self.width),
                violation: found.violation(equal[0]),
            });
        }
        Ok(())
    }

    /// Whether the planned iterations are done.
    #[getter]
    fn done(&self) -> bool {
        self.inner().done()
    }

    /// Iterations told so far.
    #[getter]
    fn iteration(&self) -> usize {
        self.inner().iteration()
    }

    /// Candidates evaluated so far.
    #[getter]
    fn evaluations(&self) -> u64 {
        self.inner().evaluations()
    }

    /// The least value of each objective so far: an array of shape (m,), infinite before any candidate has succeeded.
    #[getter]
    fn best<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.inner().best())
    }

    /// By how much the result violates the constraints: zero once something feasible is known.
    #[getter]
    fn violation(&self) -> f64 {
        self.inner().violation()
    }

    /// The result so far: candidates of shape (k, d) and their objectives of shape (k, m), none of which another dominates.
    #[getter]
    #[allow(clippy::type_complexity)]
    fn front<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let front = self.inner().front();
        Ok((
            array(py, front.candidates.concat(), self.dimensions)?,
            array(py, front.objectives.concat(), self.width)?,
        ))
    }

    /// The whole state in bytes. What was asked for and not yet told is part of it.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let state = self.inner().to_checkpoint().or_raise(py)?;
        let mut bytes = Vec::with_capacity(state.len() + 16);
        bytes.extend((self.dimensions as u64).to_le_bytes());
        bytes.extend((self.width as u64).to_le_bytes());
        bytes.extend(state);
        Ok(PyBytes::new(py, &bytes))
    }

    /// The optimiser whose state this is, to the bit.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, state: &[u8]) -> PyResult<Self> {
        optimiser_from_bytes(py, state)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let py = slf.py();
        let read = py.import("lapswarm._native")?.getattr("optimiser_from_bytes")?;
        Ok((read, (slf.get().to_bytes(py)?,)))
    }

    fn __repr__(&self) -> String {
        let inner = self.inner();
        format!(
            "<optimiser of {} variables and {} objectives after {} evaluations>",
            self.dimensions,
            self.width,
            inner.evaluations()
        )
    }
}

/// The optimiser whose state these bytes are, to the bit.
#[pyfunction]
pub fn optimiser_from_bytes(py: Python<'_>, state: &[u8]) -> PyResult<Optimiser> {
    let short = || {
        refused(
            py,
            "state",
            "length",
            state.len().to_string(),
            "the bytes of an optimiser's state",
        )
    };
    let number = |at: usize| {
        let bytes = state.get(at..at + 8)?.try_into().ok()?;
        usize::try_from(u64::from_le_bytes(bytes)).ok()
    };
    let (dimensions, width) = number(0).zip(number(8)).ok_or_else(short)?;
    let inner = checkpoint::optimiser_from_bytes(&state[16..], Path::new("state"))
        .map_err(|error| exception(py, &error))?;
    Ok(Optimiser {
        inner: Mutex::new(inner),
        dimensions,
        width,
    })
}
