//! lapswarm for Python: the native half of the package `lapswarm`.

mod arrays;
mod arrow;
mod errors;
mod evaluator;
mod minimise;
mod optimiser;
mod problem;
mod study;

use pyo3::prelude::*;
use std::ffi::OsString;

/// Runs the command line with these arguments, of which the first is the program's name, and hands back its exit code. Wrong
/// flags and `--help` end the process.
#[pyfunction]
fn command_line(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| lapswarm::cli::run(&arguments))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("SINGLE_OBJECTIVE", lapswarm::swarm::SINGLE_OBJECTIVE.to_vec())?;
    module.add("MULTI_OBJECTIVE", lapswarm::swarm::MULTI_OBJECTIVE.to_vec())?;
    module.add("USUAL_MIB", lapswarm::study::framework::memory::USUAL_MIB)?;
    module.add_class::<problem::Problem>()?;
    module.add_class::<evaluator::Evaluator>()?;
    module.add_class::<evaluator::Evaluation>()?;
    module.add_class::<optimiser::Optimiser>()?;
    module.add_function(wrap_pyfunction!(arrow::arrow_columns, module)?)?;
    module.add_function(wrap_pyfunction!(problem::car_files, module)?)?;
    module.add_function(wrap_pyfunction!(command_line, module)?)?;
    module.add_function(wrap_pyfunction!(minimise::minimise, module)?)?;
    module.add_function(wrap_pyfunction!(optimiser::optimiser_from_bytes, module)?)?;
    module.add_function(wrap_pyfunction!(study::run_study, module)?)?;
    module.add_function(wrap_pyfunction!(study::studies, module)?)?;
    Ok(())
}
