//! Tables as numpy sees them: rows in memory of ours, of which an array is a view.
//!
//! By numpy's array interface and not by Python's buffer protocol, which the stable interface to Python has from 3.11 on
//! only.

use pyo3::{prelude::*, sync::PyOnceLock, types::PyDict};

/// One neighbor, as a row of `percept.neighbors`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct NeighborRow {
    pub(crate) range_m: f64,
    pub(crate) bearing_rad: f64,
    pub(crate) orientation_rad: f64,
    pub(crate) sender: u32,
    pub(crate) age_cycles: u32,
}
const _: () = assert!(size_of::<NeighborRow>() == 32);

/// One wall, as a row of `percept.walls`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct WallRow {
    pub(crate) distance_m: f64,
    pub(crate) bearing_rad: f64,
}
const _: () = assert!(size_of::<WallRow>() == 16);

/// The memory of `percept.neighbors`.
#[pyclass(frozen, module = "lamplight._lamplight")]
#[derive(Debug)]
pub(crate) struct NeighborRows(pub(crate) Vec<NeighborRow>);

/// The memory of `percept.walls`.
#[pyclass(frozen, module = "lamplight._lamplight")]
#[derive(Debug)]
pub(crate) struct WallRows(pub(crate) Vec<WallRow>);

#[pymethods]
impl NeighborRows {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        interface(py, &self.0)
    }
}

#[pymethods]
impl WallRows {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        interface(py, &self.0)
    }
}

/// Where `rows` lie, for numpy: it reads them as long as their owner lives, which the array holds, and never writes.
fn interface<'py, T>(py: Python<'py>, rows: &[T]) -> PyResult<Bound<'py, PyDict>> {
    const READ_ONLY: bool = true;
    let interface = PyDict::new(py);
    interface.set_item("version", 3)?;
    interface.set_item("shape", (rows.len(),))?;
    interface.set_item("typestr", format!("|V{}", size_of::<T>()))?;
    interface.set_item("data", (rows.as_ptr().addr(), READ_ONLY))?;
    Ok(interface)
}

static NUMPY: PyOnceLock<Numpy> = PyOnceLock::new();

/// Objects of numpy that are asked for again and again.
struct Numpy {
    asarray: Py<PyAny>,
    neighbors: Py<PyAny>,
    walls: Py<PyAny>,
}

impl Numpy {
    fn get(py: Python<'_>) -> PyResult<&'static Self> {
        NUMPY.get_or_try_init(py, || {
            let numpy = py.import("numpy")?;
            let dtype =
                |fields: Vec<(&str, &str)>| Ok::<_, PyErr>(numpy.call_method1("dtype", (fields,))?.unbind());
            Ok(Self {
                asarray: numpy.getattr("asarray")?.unbind(),
                neighbors: dtype(vec![
                    ("range_m", "<f8"),
                    ("bearing_rad", "<f8"),
                    ("orientation_rad", "<f8"),
                    ("sender", "<u4"),
                    ("age_cycles", "<u4"),
                ])?,
                walls: dtype(vec![("distance_m", "<f8"), ("bearing_rad", "<f8")])?,
            })
        })
    }
}

/// Returns the rows as a structured array that holds them.
pub(crate) fn neighbors<'py>(rows: &Bound<'py, NeighborRows>) -> PyResult<Bound<'py, PyAny>> {
    let numpy = Numpy::get(rows.py())?;
    numpy.asarray.bind(rows.py()).call1((rows,))?.call_method1("view", (numpy.neighbors.bind(rows.py()),))
}

/// Returns the rows as a structured array that holds them.
pub(crate) fn walls<'py>(rows: &Bound<'py, WallRows>) -> PyResult<Bound<'py, PyAny>> {
    let numpy = Numpy::get(rows.py())?;
    numpy.asarray.bind(rows.py()).call1((rows,))?.call_method1("view", (numpy.walls.bind(rows.py()),))
}

/// Returns a vector as an array of two numbers.
pub(crate) fn vector(py: Python<'_>, x: f64, y: f64) -> PyResult<Bound<'_, PyAny>> {
    Numpy::get(py)?.asarray.bind(py).call1(([x, y],))
}
