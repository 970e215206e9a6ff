//! A robot's process whose controller is in Python.

use std::{
    ffi::{CString, OsString},
    iter,
    process::ExitCode,
};

use protocol::{params::Params, robot_id::RobotId};
use pyo3::{exceptions::PyOSError, prelude::*};
use rustix::{
    process::{Signal, set_parent_process_death_signal},
    thread::set_name,
};

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
    name_process(&words);
    // Threads that a controller has started go on while it waits.
    let status = py.detach(|| robot_agent::run(iter::once("agent".into()).chain(words), program, new));
    u8::from(status != ExitCode::SUCCESS)
}

/// Lets `ps` and `top` call this process `robot-7`: its command line is that of whoever has forked it.
fn name_process(words: &[OsString]) {
    let robot = words.iter().skip_while(|word| *word != "--robot").nth(1).and_then(|word| word.to_str());
    let name = robot.and_then(|robot| CString::new(format!("robot-{robot}")).ok());
    // It is for who looks.
    let _ = name.map(|name| set_name(&name));
}

/// Has the operating system end this process as soon as the one that has started it has ended.
#[pyfunction]
pub(crate) fn die_with_parent() -> PyResult<()> {
    set_parent_process_death_signal(Some(Signal::KILL)).map_err(|error| PyOSError::new_err(error.to_string()))
}
