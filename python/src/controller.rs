//! A controller in Python, hosted as any other.

use std::{
    collections::BTreeSet,
    sync::{Mutex, PoisonError},
};

use neighborhood::{Neighbor, Neighborhood, Setup};
use protocol::{
    command,
    controller::{Controller, StageObserver},
    giving_up::give_up,
    params::Params,
    percept,
    robot_id::RobotId,
};
use pyo3::{
    exceptions::PyTypeError,
    intern,
    prelude::*,
    types::{PyDict, PyTuple},
};

use crate::{
    arrays::{NeighborRow, NeighborRows},
    command::Command,
    percept::{Percept, Said},
};

/// One robot's controller in Python, with the table of its neighbors that its percepts show.
pub(crate) struct PythonController {
    object: Py<PyAny>,
    /// Whether its class tells notes.
    has_notes: bool,
    neighborhood: Neighborhood,
}

impl PythonController {
    /// Makes an object of `class` for a life of a robot.
    ///
    /// # Errors
    /// If the class refuses its parameters.
    pub(crate) fn new(class: &Bound<'_, PyAny>, id: RobotId, params: &Params) -> PyResult<Self> {
        let py = class.py();
        let setup: Setup = params.json().map_err(|error| PyTypeError::new_err(error.to_string()))?;
        let object = class.call_method1(intern!(py, "__new__"), (class,))?;
        object.setattr(intern!(py, "robot"), id.index)?;
        object.setattr(intern!(py, "life"), u32::from(id.incarnation) + 1)?;
        let params =
            py.import("json")?.call_method1("loads", (serde_json::Value::from(setup.params).to_string(),))?;
        object.getattr(intern!(py, "__init__"))?.call(PyTuple::empty(py), Some(params.cast::<PyDict>()?))?;
        let base = py.import("lamplight")?.getattr("Controller")?.getattr("notes")?;
        let has_notes = !class.getattr("notes")?.is(&base);
        Ok(Self {
            object: object.unbind(),
            has_notes,
            neighborhood: Neighborhood::new(id, setup.neighbor_timeout_ticks),
        })
    }

    /// The percept as Python sees it.
    fn shown(&self, py: Python<'_>, percept: &percept::Percept) -> PyResult<Py<Percept>> {
        let count = self.neighborhood.iter().count();
        let (mut rows, mut said) = (Vec::with_capacity(count), Said::default());
        said.ends.reserve(count);
        for Neighbor { delivery, age_cycles, payload } in self.neighborhood.iter() {
            rows.push(NeighborRow {
                range_m: delivery.range.get(),
                bearing_rad: delivery.bearing.get(),
                orientation_rad: delivery.orientation.get(),
                sender: delivery.packet.sender().index,
                age_cycles,
            });
            said.bytes.extend_from_slice(payload);
            said.ends.push(said.bytes.len());
        }
        Py::new(py, Percept::new(percept, Py::new(py, NeighborRows(rows))?, said))
    }

    /// Calls a method that gives a command.
    fn command(
        &self,
        py: Python<'_>,
        method: &'static str,
        percept: Option<Py<Percept>>,
    ) -> PyResult<command::Command> {
        let object = self.object.bind(py);
        let given = match percept {
            Some(percept) => object.call_method1(method, (percept,))?,
            None => object.call_method0(method)?,
        };
        let command = given.cast::<Command>().map_err(|_| {
            let kind =
                given.get_type().name().map_or_else(|_| "something else".into(), |name| name.to_string());
            PyTypeError::new_err(format!("{method} must return a lamplight.Command, and returned {kind}"))
        })?;
        Ok(command.get().0.clone())
    }
}

/// Prints an error with its traceback, as Python does. It does not end the interpreter, which Python's own way does for
/// SystemExit.
pub(crate) fn print(py: Python<'_>, error: &PyErr) {
    let words = (error.get_type(py), error.value(py), error.traceback(py));
    let printed = py.import("traceback").and_then(|it| it.call_method1("print_exception", words));
    // Where that fails, there is nobody to tell.
    drop(printed);
}

/// Tracebacks that a process shows: where controllers of many robots are in one, they raise the same again and again.
const TRACEBACKS_MAX: usize = 10;

/// Whether a traceback has not been shown yet, and there are not too many.
fn is_new(py: Python<'_>, error: &PyErr) -> bool {
    static SHOWN: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let traceback = error.traceback(py).and_then(|traceback| traceback.format().ok()).unwrap_or_default();
    let mut shown = SHOWN.lock().unwrap_or_else(PoisonError::into_inner);
    shown.len() < TRACEBACKS_MAX && shown.insert(traceback)
}

/// Ends the controller's life: it has raised something in `method`. What it has printed and the traceback come first.
fn raised(py: Python<'_>, error: &PyErr, method: &str) -> ! {
    if is_new(py, error) {
        print(py, error);
    }
    let flush = |stream: &str| py.import("sys").and_then(|sys| sys.getattr(stream)?.call_method0("flush"));
    let _ = (flush("stdout"), flush("stderr"));
    give_up(format!("its {method} raised {error}"))
}

impl Controller for PythonController {
    fn boot(&mut self) -> command::Command {
        Python::attach(|py| self.command(py, "boot", None).unwrap_or_else(|error| raised(py, &error, "boot")))
    }

    fn hear(&mut self, percept: &percept::Percept) {
        self.neighborhood.hear(percept);
    }

    fn step(&mut self, percept: &percept::Percept, _: &mut dyn StageObserver) -> command::Command {
        self.neighborhood.begin_cycle(percept);
        Python::attach(|py| {
            let command = self.shown(py, percept).and_then(|shown| self.command(py, "step", Some(shown)));
            command.unwrap_or_else(|error| raised(py, &error, "step"))
        })
    }

    fn notes(&self, note: &mut dyn FnMut(&str, f64)) {
        if !self.has_notes {
            return;
        }
        Python::attach(|py| {
            let told = self.object.bind(py).call_method0("notes").and_then(|told| {
                for (name, value) in told.cast::<PyDict>()? {
                    note(&name.extract::<String>()?, value.extract()?);
                }
                Ok(())
            });
            told.unwrap_or_else(|error| raised(py, &error, "notes"));
        });
    }
}
