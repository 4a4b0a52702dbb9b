//! Arrays of numpy as rows of numbers.

use crate::errors::refused;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// What is given as an array of doubles whose rows lie one after the other: itself if it is one, else a copy.
///
/// # Errors
/// `InputError` if it is no table of numbers.
pub fn table<'py>(given: &Bound<'py, PyAny>, name: &str) -> PyResult<PyReadonlyArray2<'py, f64>> {
    let py = given.py();
    let numpy = py.import("numpy")?;
    // The conversion would drop a part of each.
    if numpy.call_method1("iscomplexobj", (given,))?.extract()? {
        return Err(refused(
            py,
            name,
            "type",
            "complex numbers",
            "an array of real numbers",
        ));
    }
    let array = numpy
        .call_method1("ascontiguousarray", (given, "float64"))
        .map_err(|error| {
            refused(
                py,
                name,
                "type",
                error.value(py).to_string(),
                "an array of numbers",
            )
        })?;
    match array.cast_into::<PyArray2<f64>>() {
        Ok(array) => Ok(array.readonly()),
        Err(error) => {
            let shape = error.into_inner().getattr("shape")?.to_string();
            let found = format!("an array of shape {shape}");
            Err(refused(
                py,
                name,
                "shape",
                found,
                "two dimensions: a row for each candidate",
            ))
        }
    }
}

/// Checks the number of columns.
///
/// # Errors
/// `InputError` telling both numbers.
pub fn check_width(table: &PyReadonlyArray2<'_, f64>, name: &str, width: usize, of: &str) -> PyResult<()> {
    let found = table.shape()[1];
    if found == width {
        return Ok(());
    }
    let expected = format!("{width}, one for each {of}");
    Err(refused(
        table.py(),
        name,
        "shape",
        format!("{found} columns"),
        &expected,
    ))
}

/// Rows of numbers as an array of `width` columns.
pub fn array(py: Python<'_>, rows: Vec<f64>, width: usize) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let count = rows.len().checked_div(width).unwrap_or_default();
    PyArray1::from_vec(py, rows).reshape([count, width])
}
