//! A percept as a controller in Python gets it.

use protocol::{
    granted, odometry,
    percept::{self, Stimulus},
};
use pyo3::{
    prelude::*,
    sync::PyOnceLock,
    types::{PyBytes, PyList},
};

use crate::arrays::{self, NeighborRows, WallRow, WallRows};

/// All that a robot gets in one neighbor cycle, in its body frame: x ahead, y to the left.
#[pyclass(frozen, module = "lamplight")]
pub(crate) struct Percept {
    /// Number of the tick, from 0.
    #[pyo3(get)]
    tick: u64,
    /// Whether the bump skirt was pressed during the last motion.
    #[pyo3(get)]
    bump: bool,
    /// The light where the robot stands.
    #[pyo3(get)]
    light: Light,
    /// The robot's own motion, if the scenario gives it odometry; else None.
    #[pyo3(get)]
    odometry: Option<Odometry>,
    /// Which way the robot faces in the arena, if the scenario grants it a compass; else None.
    #[pyo3(get)]
    compass: Option<Compass>,
    /// Where the robot is in the arena, if the scenario tells it; else None.
    #[pyo3(get)]
    position: Option<Position>,
    neighbors: Py<NeighborRows>,
    said: Said,
    walls: Vec<WallRow>,
    neighbors_array: PyOnceLock<Py<PyAny>>,
}

/// Payloads of neighbors, one behind the other: no memory for each.
#[derive(Debug, Default)]
pub(crate) struct Said {
    pub(crate) bytes: Vec<u8>,
    /// Where each ends.
    pub(crate) ends: Vec<usize>,
}

impl Said {
    fn of(&self, neighbor: usize) -> Option<&[u8]> {
        let end = *self.ends.get(neighbor)?;
        let begin = neighbor.checked_sub(1).map_or(0, |before| self.ends[before]);
        Some(&self.bytes[begin..end])
    }
}

impl Percept {
    pub(crate) fn new(percept: &percept::Percept, neighbors: Py<NeighborRows>, said: Said) -> Self {
        let wall = |wall: &percept::Wall| WallRow {
            distance_m: wall.distance.get(),
            bearing_rad: wall.bearing.get(),
        };
        Self {
            tick: percept.tick,
            bump: percept.bump,
            light: Light(percept.light),
            odometry: percept.odometry.map(Odometry),
            compass: percept.compass.map(Compass),
            position: percept.position.map(Position),
            neighbors,
            said,
            walls: percept.walls.iter().map(wall).collect(),
            neighbors_array: PyOnceLock::new(),
        }
    }
}

#[pymethods]
impl Percept {
    /// Neighbors that were heard lately, by sender: a structured array with the fields range_m, bearing_rad,
    /// orientation_rad (of the neighbor's heading), sender and age_cycles (0: heard in this cycle). It cannot be written to.
    #[getter]
    fn neighbors<'py>(&self, py: Python<'py>) -> PyResult<&Bound<'py, PyAny>> {
        let array = self
            .neighbors_array
            .get_or_try_init(py, || arrays::neighbors(self.neighbors.bind(py)).map(Bound::unbind));
        Ok(array?.bind(py))
    }

    /// Payloads of the neighbors, in their order: bytes.
    #[getter]
    fn payloads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let all = (0..self.said.ends.len()).filter_map(|neighbor| self.said.of(neighbor));
        PyList::new(py, all.map(|said| PyBytes::new(py, said)).collect::<Vec<_>>())
    }

    /// Walls that are sensed, where the scenario grants it: a structured array with the fields distance_m and bearing_rad
    /// (of the outward normal).
    #[getter]
    fn walls<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::walls(&Bound::new(py, WallRows(self.walls.clone()))?)
    }

    fn __repr__(&self) -> String {
        format!(
            "Percept(tick={}, neighbors={}, bump={})",
            self.tick,
            self.neighbors.get().0.len(),
            if self.bump { "True" } else { "False" }
        )
    }
}

/// Light where a robot stands.
#[pyclass(frozen, module = "lamplight")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light(percept::Light);

#[pymethods]
impl Light {
    /// φ at the robot.
    #[getter]
    fn value(&self) -> f64 {
        self.0.value
    }

    /// Bearing to where the light grows, radians; None where there is no such direction.
    #[getter]
    fn bearing_rad(&self) -> Option<f64> {
        match self.0.stimulus {
            Stimulus::None => None,
            Stimulus::Bearing(bearing) => Some(bearing.get()),
            Stimulus::Gradient(gradient) => (gradient.length() > 0.0).then(|| gradient.bearing()),
        }
    }

    /// The gradient of φ per meter, an array of two numbers; None where the sensor measures its direction alone.
    #[getter]
    fn gradient<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        match self.0.stimulus {
            Stimulus::Gradient(gradient) => arrays::vector(py, gradient.0.x, gradient.0.y).map(Some),
            Stimulus::None | Stimulus::Bearing(_) => Ok(None),
        }
    }

    /// The direction in which the light grows, an array of two numbers and of length 1; of length 0 where there is none.
    #[getter]
    fn direction<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (sin, cos) = self.bearing_rad().map_or((0.0, 0.0), libm::sincos);
        arrays::vector(py, cos, sin)
    }

    fn __repr__(&self) -> String {
        format!(
            "Light(value={:?}, bearing_rad={})",
            self.value(),
            self.bearing_rad().map_or("None".into(), |it| format!("{it:?}"))
        )
    }
}

/// A robot's own motion as its wheels believe, in the body frame of its beginning.
#[pyclass(frozen, module = "lamplight")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Odometry(odometry::Odometry);

#[pymethods]
impl Odometry {
    /// Meters.
    #[getter]
    fn x_m(&self) -> f64 {
        self.0.position.0.x
    }

    /// Meters.
    #[getter]
    fn y_m(&self) -> f64 {
        self.0.position.0.y
    }

    /// Radians.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.0.heading.get()
    }

    fn __repr__(&self) -> String {
        format!("Odometry(x_m={:?}, y_m={:?}, heading_rad={:?})", self.x_m(), self.y_m(), self.heading_rad())
    }
}

/// A compass's reading.
#[pyclass(frozen, module = "lamplight")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Compass(granted::Compass);

#[pymethods]
impl Compass {
    /// Heading in the arena, radians, counter-clockwise from its x axis.
    #[getter]
    fn heading_rad(&self) -> f64 {
        self.0.heading.get()
    }

    fn __repr__(&self) -> String {
        format!("Compass(heading_rad={:?})", self.heading_rad())
    }
}

/// A position's reading, in the arena: the origin is its lower left corner.
#[pyclass(frozen, module = "lamplight")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Position(granted::Position);

#[pymethods]
impl Position {
    /// Meters.
    #[getter]
    fn x_m(&self) -> f64 {
        self.0.x.get()
    }

    /// Meters.
    #[getter]
    fn y_m(&self) -> f64 {
        self.0.y.get()
    }

    fn __repr__(&self) -> String {
        format!("Position(x_m={:?}, y_m={:?})", self.x_m(), self.y_m())
    }
}
