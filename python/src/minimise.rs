//! `minimise` over a function of Python that takes whole populations.

use crate::arrays::{array, check_width, table};
use crate::errors::OrRaise;
use crate::problem::Problem;
use lapswarm::evaluate::point::Constraint;
use lapswarm::minimise_batch;
use lapswarm::swarm::{Indicators, Minimum, Stopped};
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::cell::RefCell;
use std::ops::ControlFlow;
use std::time::Duration;

/// Calls the function with an array of shape (n, d) and writes its rows of m objectives and constraints.
fn call(py: Python<'_>, function: &Bound<'_, PyAny>, x: &[f64], d: usize, f: &mut [f64]) -> PyResult<()> {
    let candidates = array(py, x.to_vec(), d)?;
    let count = x.len() / d;
    let width = f.len().checked_div(count).unwrap_or_default();
    let mut found = function.call1((candidates,))?;
    let numpy = py.import("numpy")?;
    if width == 1 && numpy.call_method1("ndim", (&found,))?.extract::<usize>()? == 1 {
        found = numpy.call_method1("reshape", (&found, (-1, 1)))?;
    }
    let rows = table(&found, "the function's result")?;
    check_width(&rows, "the function's result", width, "objective and constraint")?;
    if rows.shape()[0] != count {
        let found = format!("{} rows", rows.shape()[0]);
        let expected = format!("{count}, one for each candidate");
        return Err(crate::errors::refused(
            py,
            "the function's result",
            "shape",
            found,
            &expected,
        ));
    }
    f.copy_from_slice(rows.as_slice()?);
    Ok(())
}

fn indicators<'py>(py: Python<'py>, now: &Indicators) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("evaluations", now.evaluations)?;
    told.set_item("elapsed_s", now.elapsed_s)?;
    told.set_item("best", now.best.clone())?;
    told.set_item("violation", now.violation)?;
    told.set_item("members", now.members)?;
    told.set_item("hypervolume", now.hypervolume)?;
    told.set_item("median", now.median)?;
    told.set_item("failed", now.failed)?;
    Ok(told)
}

fn answer<'py>(
    py: Python<'py>,
    found: &Minimum,
    (dimensions, width): (usize, usize),
    interrupted: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("X", array(py, found.front.candidates.concat(), dimensions)?)?;
    told.set_item("F", array(py, found.front.objectives.concat(), width)?)?;
    told.set_item("violation", found.front.violation)?;
    told.set_item("evaluations", found.evaluations)?;
    told.set_item("failures", found.failures.clone())?;
    let stopped = match found.stopped {
        _ if interrupted => "interrupt",
        Stopped::Evaluations => "evaluations",
        Stopped::Target => "target",
        Stopped::Time => "time",
        Stopped::Stagnation => "stagnation",
        Stopped::Observer => "callback",
    };
    told.set_item("stopped", stopped)?;
    let history = found.history.iter().map(|now| indicators(py, now));
    told.set_item("history", history.collect::<PyResult<Vec<_>>>()?)?;
    Ok(told)
}

/// How a run of `minimise` is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Asked {
    algorithm: String,
    seed: u64,
    population: Option<usize>,
    evaluations: Option<usize>,
    archive: usize,
    inequalities: usize,
    equalities: usize,
    tolerance: f64,
    target: Option<f64>,
    time_s: Option<f64>,
    stagnation: Option<(u64, f64)>,
    reference: Option<Vec<f64>>,
}

/// Minimises a function of Python over the bounds of a problem; the package's `minimise` says what is asked.
#[pyfunction]
pub fn minimise<'py>(
    py: Python<'py>,
    problem: PyRef<'_, Problem>,
    function: &Bound<'py, PyAny>,
    asked: Asked,
    callback: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let problem = problem.kind.problem();
    let bounds: Vec<(f64, f64)> = problem.variables.iter().map(|v| (v.lower, v.upper)).collect();
    let (dimensions, width) = (bounds.len(), problem.objectives.len());
    // What the function or the callback has raised.
    let raised: RefCell<Option<PyErr>> = RefCell::new(None);
    let mut run = minimise_batch(&bounds, width, |x, f| {
        let already = raised.borrow().is_some();
        let outcome = if already {
            Ok(())
        } else {
            call(py, function, x, dimensions, f)
        };
        if already || outcome.is_err() {
            f.fill(f64::NAN);
        }
        if let Err(error) = outcome {
            raised.replace(Some(error));
        }
    })
    .variables(problem.variables.clone())
    .algorithm(&asked.algorithm)
    .seed(asked.seed)
    .archive(asked.archive)
    .constraints(
        [
            vec![Constraint::at_most_zero(); asked.inequalities],
            vec![Constraint::zero_within(asked.tolerance); asked.equalities],
        ]
        .concat(),
    );
    if let Some(population) = asked.population {
        run = run.population(population);
    }
    if let Some(evaluations) = asked.evaluations {
        run = run.evaluations(evaluations);
    }
    if let Some(target) = asked.target {
        run = run.target(target);
    }
    if let Some(seconds) = asked.time_s {
        run = run.time(Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX));
    }
    if let Some((evaluations, share)) = asked.stagnation {
        run = run.stagnation(evaluations, share);
    }
    if let Some(reference) = asked.reference {
        run = run.reference(reference);
    }
    let watched = |now: &Indicators| -> PyResult<bool> {
        py.check_signals()?;
        let Some(callback) = callback else { return Ok(true) };
        let said = callback.call1((indicators(py, now)?,))?;
        Ok(said.is_none() || said.is_truthy()?)
    };
    let found = run.run_watched(|now| {
        if raised.borrow().is_some() {
            return ControlFlow::Break(());
        }
        match watched(now) {
            Ok(true) => ControlFlow::Continue(()),
            Ok(false) => ControlFlow::Break(()),
            Err(error) => {
                raised.replace(Some(error));
                ControlFlow::Break(())
            }
        }
    });
    let raised = raised.into_inner();
    let interrupted = raised
        .as_ref()
        .is_some_and(|e| e.is_instance_of::<PyKeyboardInterrupt>(py));
    match raised {
        Some(error) if !interrupted => Err(error),
        _ => answer(py, &found.or_raise(py)?, (dimensions, width), interrupted),
    }
}
