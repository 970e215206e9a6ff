//! The command `lamplight` in an interpreter, which plays controllers in Python in a plain loop.

use std::{ffi::OsString, iter};

use lamplight::{PythonConstructor, PythonHost};
use protocol::{controller::Controller, params::Params, robot_id::RobotId};
use pyo3::prelude::*;
use scenario::PythonSpec;

use crate::controller::{PythonController, print};

/// This interpreter.
struct Interpreter;

impl PythonHost for Interpreter {
    fn constructor(&self, python: &PythonSpec) -> Result<Box<PythonConstructor>, String> {
        Python::attach(|py| {
            let loading =
                py.import("lamplight._controller").and_then(|it| it.getattr("load")?.call1((python.name(),)));
            let class = loading.map_err(|error| error.value(py).to_string())?.unbind();
            Ok(Box::new(move |id: RobotId, params: &Params| {
                Python::attach(|py| match PythonController::new(class.bind(py), id, params) {
                    Ok(controller) => Ok(Box::new(controller) as Box<dyn Controller>),
                    Err(error) => {
                        print(py, &error);
                        Err(error.to_string())
                    }
                })
            }) as Box<PythonConstructor>)
        })
    }
}

/// Does what the words of a command line of `lamplight` say, and returns the exit status.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, words: Vec<OsString>) -> u8 {
    let words = iter::once("lamplight".into()).chain(words);
    py.detach(|| lamplight::main(words, Some(Box::new(Interpreter)))).0
}
