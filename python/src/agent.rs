//! A robot's process whose controller is in Python.

use std::{ffi::OsString, iter, process::ExitCode};

use protocol::{params::Params, robot_id::RobotId};
use pyo3::{exceptions::PyOSError, prelude::*};
use rustix::process::{Signal, set_parent_process_death_signal};

use crate::controller::{PythonController, print};

/// Runs the agent of one robot until its run ends, and returns its exit status. `words` are its command line; `program` is
/// what messages call the controller, which is a class.
#[pyfunction]
pub(crate) fn run_agent(py: Python<'_>, words: Vec<OsString>, program: &str, class: Py<PyAny>) -> u8 {
    let new = |id: RobotId, params: &Params| {
        Python::attach(|py| {
            PythonController::new(class.bind(py), id, params).map_err(|error| {
                print(py, &error);
                error.to_string()
            })
        })
    };
    // Threads that a controller has started go on while it waits.
    let status = py.detach(|| robot_agent::run(iter::once("agent".into()).chain(words), program, new));
    u8::from(status != ExitCode::SUCCESS)
}

/// Has the operating system end this process as soon as the one that has started it has ended.
#[pyfunction]
pub(crate) fn die_with_parent() -> PyResult<()> {
    set_parent_process_death_signal(Some(Signal::KILL)).map_err(|error| PyOSError::new_err(error.to_string()))
}
