//! A controller in Python, hosted as any other.

use coverage::neighbors::NeighborTable;
use protocol::{
    command,
    controller::{Controller, StageObserver},
    giving_up::give_up,
    packet::Body,
    params::Params,
    percept::{self, Delivery},
    robot_id::RobotId,
};
use pyo3::{
    exceptions::PyTypeError,
    intern,
    prelude::*,
    types::{PyDict, PyTuple},
};
use scenario::PythonSetup;

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
    neighbors: NeighborTable<Place>,
    /// Ticks between two cycles, as far as they have been seen: ages are told in cycles.
    cycles: Vec<percept::Tick>,
    /// Payloads of neighbors that are too long for their packets, in the order in which they came.
    long: LongPayloads,
}

/// Where a neighbor's payload lies, if not in its packet.
type Place = u32;

/// Long payloads of those who were heard lately.
#[derive(Debug, Default)]
struct LongPayloads {
    kept: std::collections::BTreeMap<Place, Box<[u8]>>,
    next: Place,
}

impl LongPayloads {
    fn keep(&mut self, payload: &[u8]) -> Place {
        let place = self.next;
        self.next = place.wrapping_add(1);
        self.kept.insert(place, payload.into());
        place
    }
}

impl PythonController {
    /// Makes an object of `class` for a life of a robot.
    ///
    /// # Errors
    /// If the class refuses its parameters.
    pub(crate) fn new(class: &Bound<'_, PyAny>, id: RobotId, params: &Params) -> PyResult<Self> {
        let py = class.py();
        let setup: PythonSetup = params.json().map_err(|error| PyTypeError::new_err(error.to_string()))?;
        let object = class.call_method1(intern!(py, "__new__"), (class,))?;
        object.setattr(intern!(py, "robot"), id.index)?;
        object.setattr(intern!(py, "life"), u32::from(id.incarnation) + 1)?;
        let params = py.import("json")?.call_method1("loads", (serde_json::Value::from(setup.params).to_string(),))?;
        object.getattr(intern!(py, "__init__"))?.call(PyTuple::empty(py), Some(params.cast::<PyDict>()?))?;
        let base = py.import("lamplight")?.getattr("Controller")?.getattr("notes")?;
        let has_notes = !class.getattr("notes")?.is(&base);
        Ok(Self {
            object: object.unbind(),
            has_notes,
            neighbors: NeighborTable::new(id, setup.neighbor_timeout_ticks),
            cycles: Vec::new(),
            long: LongPayloads::default(),
        })
    }

    /// Takes in what was heard, with long payloads.
    fn record(&mut self, percept: &percept::Percept) {
        let Self { neighbors, long, .. } = self;
        neighbors.follow(percept.odometry);
        let kept = |delivery: &Delivery| match delivery.packet.body() {
            Body::Inline(_) => Place::MAX,
            Body::Beside { .. } => long.keep(percept.payload(delivery)),
        };
        neighbors.record_with(percept.tick, percept.deliveries.iter().map(kept_with(kept)));
        if !self.long.kept.is_empty() {
            let used: std::collections::BTreeSet<Place> = self.neighbors.iter().map(|it| it.extra).collect();
            self.long.kept.retain(|place, _| used.contains(place));
        }
    }

    /// The percept as Python sees it.
    fn shown(&self, py: Python<'_>, percept: &percept::Percept) -> PyResult<Py<Percept>> {
        let count = self.neighbors.iter().count();
        let (mut rows, mut said) = (Vec::with_capacity(count), Said::default());
        said.ends.reserve(count);
        for neighbor in self.neighbors.iter() {
            let Delivery { packet, range, bearing, orientation } = &neighbor.delivery;
            rows.push(NeighborRow {
                range_m: range.get(),
                bearing_rad: bearing.get(),
                orientation_rad: orientation.get(),
                sender: packet.sender().index,
                age_cycles: self.age_cycles(neighbor.heard),
            });
            match packet.body() {
                Body::Inline(payload) => said.bytes.extend_from_slice(payload),
                Body::Beside { .. } => said.bytes.extend_from_slice(&self.long.kept[&neighbor.extra]),
            }
            said.ends.push(said.bytes.len());
        }
        Py::new(py, Percept::new(percept, Py::new(py, NeighborRows(rows))?, said))
    }

    /// Cycles that have begun since a tick.
    fn age_cycles(&self, heard: percept::Tick) -> u32 {
        self.cycles.iter().rev().take_while(|&&tick| tick > heard).count() as u32
    }

    /// Calls a method that gives a command.
    fn command(&self, py: Python<'_>, method: &'static str, percept: Option<Py<Percept>>) -> PyResult<command::Command> {
        let object = self.object.bind(py);
        let given = match percept {
            Some(percept) => object.call_method1(method, (percept,))?,
            None => object.call_method0(method)?,
        };
        let command = given.cast::<Command>().map_err(|_| {
            let kind = given.get_type().name().map_or_else(|_| "something else".into(), |name| name.to_string());
            PyTypeError::new_err(format!("{method} must return a lamplight.Command, and returned {kind}"))
        })?;
        Ok(command.get().0.clone())
    }
}

fn kept_with(mut kept: impl FnMut(&Delivery) -> Place) -> impl FnMut(&Delivery) -> (Delivery, Place) {
    move |delivery| (*delivery, kept(delivery))
}

/// Prints an error with its traceback, as Python does. It does not end the interpreter, which Python's own way does for
/// SystemExit.
pub(crate) fn print(py: Python<'_>, error: &PyErr) {
    let words = (error.get_type(py), error.value(py), error.traceback(py));
    let printed = py.import("traceback").and_then(|it| it.call_method1("print_exception", words));
    // Where that fails, there is nobody to tell.
    drop(printed);
}

/// Ends the controller's life: it has raised something in `method`. What it has printed and the traceback come first.
fn raised(py: Python<'_>, error: &PyErr, method: &str) -> ! {
    print(py, error);
    let flush = |stream: &str| py.import("sys").and_then(|sys| sys.getattr(stream)?.call_method0("flush"));
    let _ = (flush("stdout"), flush("stderr"));
    give_up(format!("its {method} raised {error}"))
}

impl Controller for PythonController {
    fn boot(&mut self) -> command::Command {
        Python::attach(|py| self.command(py, "boot", None).unwrap_or_else(|error| raised(py, &error, "boot")))
    }

    fn hear(&mut self, percept: &percept::Percept) {
        self.record(percept);
    }

    fn step(&mut self, percept: &percept::Percept, _: &mut dyn StageObserver) -> command::Command {
        self.record(percept);
        let remembered = self.neighbors.iter().map(|it| it.heard).min().unwrap_or(percept.tick);
        self.cycles.retain(|&tick| tick > remembered);
        self.cycles.push(percept.tick);
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
