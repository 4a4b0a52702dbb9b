//! Errors of the library as exceptions of `lapswarm.errors`.

use lapswarm::Error;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The exception that an error is: its class, its message, and where it is.
pub fn exception(py: Python<'_>, error: &Error) -> PyErr {
    let class = match error {
        Error::Input { .. } => "InputError",
        Error::Memory { .. } => "MemoryLimitError",
        Error::Io { .. } => "FileError",
        Error::NoDevice(_) | Error::Device(_) => "DeviceError",
        Error::Interrupted(_) => "Interrupted",
        _ => "StudyError",
    };
    let made = || -> PyResult<PyErr> {
        let class = py.import("lapswarm.errors")?.getattr(class)?;
        let place = PyDict::new(py);
        place.set_item("file", error.file().map(|file| file.into_owned()))?;
        let at = error.place();
        place.set_item("line", at.as_ref().and_then(|at| at.line_number()))?;
        place.set_item("field", at.as_ref().and_then(|at| at.name()))?;
        if let Error::Interrupted(folder) = error {
            place.set_item("folder", folder.as_os_str())?;
        }
        let instance = class.call((error.to_string(),), Some(&place))?;
        Ok(PyErr::from_value(instance))
    };
    made().unwrap_or_else(|other| other)
}

/// Results of the library as those of Python.
pub trait OrRaise<T> {
    /// The same with an exception for an error.
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> OrRaise<T> for lapswarm::Result<T> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| exception(py, &error))
    }
}

/// An `InputError` about what a caller gave.
pub fn refused(py: Python<'_>, what: &str, field: &str, found: impl Into<String>, expected: &str) -> PyErr {
    exception(py, &Error::input(what, field, found, expected))
}
