//! Properties that controllers in Python state.

use protocol::property::{PropertyKind, state};
use pyo3::{
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
    types::PyString,
};

/// States that a condition must hold whenever this is called, by any robot.
///
/// A run reports the first time that it did not, and goes on; `lamplight fuzz` takes it for a failure. It counts in the thread
/// that calls the controller.
///
/// Args:
///     condition: whether it holds.
///     name: how the property is called: up to 80 bytes, the same each time.
///
/// Raises:
///     ValueError: if the name is none, or the controller states more than 64 properties.
#[pyfunction]
pub(crate) fn always(condition: &Bound<'_, PyAny>, name: &Bound<'_, PyAny>) -> PyResult<()> {
    stated(PropertyKind::Always, condition, name)
}

/// States that a condition must hold at least once when this is called, by some robot.
///
/// A run reports the first time that it did; `lamplight fuzz` lists what no run has reached. Call it each time, and not only
/// where the condition holds: what is never called is never known. Otherwise as `always`.
#[pyfunction]
pub(crate) fn sometimes(condition: &Bound<'_, PyAny>, name: &Bound<'_, PyAny>) -> PyResult<()> {
    stated(PropertyKind::Sometimes, condition, name)
}

fn stated(kind: PropertyKind, condition: &Bound<'_, PyAny>, name: &Bound<'_, PyAny>) -> PyResult<()> {
    let name = name.cast::<PyString>().map_err(|_| {
        PyTypeError::new_err(format!(
            "the condition comes first, then a name, which is a string and not {name}"
        ))
    })?;
    state(kind, condition.is_truthy()?, name.to_str()?)
        .map_err(|error| PyValueError::new_err(error.to_string()))
}
