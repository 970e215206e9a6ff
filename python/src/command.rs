//! A command as a controller in Python gives it.

use protocol::{
    command::{self, within_reason},
    frame::BodyVector,
    payload::Payload,
};
use pyo3::{
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
};

/// A controller's decision: where to go, and what to say next.
///
/// Args:
///     velocity: two numbers, meters per second, body frame (x ahead, y to the left).
///     payload: what the next packet says: bytes, up to `channel.payload_bytes_max`.
///     estimated_error: two numbers, meters, body frame: how far the robot believes to be from its goal; None if it does
///         not know.
///
/// Raises:
///     ValueError: if a number is not finite or beyond all reason, or the payload is longer than any packet's.
#[pyclass(frozen, module = "lamplight")]
#[derive(Clone, Debug)]
pub(crate) struct Command(pub(crate) command::Command);

#[pymethods]
impl Command {
    #[new]
    #[pyo3(signature = (velocity = None, payload = None, estimated_error = None))]
    fn new(
        velocity: Option<&Bound<'_, PyAny>>,
        payload: Option<&Bound<'_, PyAny>>,
        estimated_error: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let velocity = velocity.map_or(Ok(BodyVector::HERE), |velocity| vector("velocity", velocity))?;
        let estimated_error = estimated_error.map(|error| vector("estimated error", error)).transpose()?;
        let payload = payload.map_or(Ok(&[][..]), |payload| bytes(payload))?;
        let payload = Payload::try_from(payload).map_err(|error| PyValueError::new_err(error.to_string()))?;
        Ok(Self(command::Command { estimated_error, velocity, payload }))
    }

    /// Meters per second, body frame.
    #[getter]
    fn velocity(&self) -> (f64, f64) {
        components(self.0.velocity)
    }

    /// Payload of the next packet.
    #[getter]
    fn payload(&self) -> &[u8] {
        &self.0.payload
    }

    /// Meters, body frame; None if the robot does not know.
    #[getter]
    fn estimated_error(&self) -> Option<(f64, f64)> {
        self.0.estimated_error.map(components)
    }

    fn __repr__(&self) -> String {
        let (x, y) = self.velocity();
        let error = self.estimated_error().map_or("None".into(), |(x, y)| format!("({x:?}, {y:?})"));
        format!(
            "Command(velocity=({x:?}, {y:?}), payload={} bytes, estimated_error={error})",
            self.payload().len()
        )
    }
}

fn components(vector: BodyVector) -> (f64, f64) {
    (vector.0.x, vector.0.y)
}

fn bytes<'a>(payload: &'a Bound<'_, PyAny>) -> PyResult<&'a [u8]> {
    payload.extract().map_err(|_| {
        let kind =
            payload.get_type().name().map_or_else(|_| "something else".into(), |name| name.to_string());
        PyTypeError::new_err(format!("a payload must be bytes, such as \"hi\".encode(), not {kind}"))
    })
}

/// Reads two numbers from a tuple, a list, an array or anything else with two places.
fn vector(what: &'static str, value: &Bound<'_, PyAny>) -> PyResult<BodyVector> {
    let wrong = || {
        let given = value.repr().map_or_else(|_| "something else".into(), |text| text.to_string());
        PyTypeError::new_err(format!("{what} must be two numbers, got {given}"))
    };
    if value.len().map_err(|_| wrong())? != 2 {
        return Err(wrong());
    }
    let component = |at: usize| value.get_item(at).and_then(|it| it.extract::<f64>()).map_err(|_| wrong());
    let vector = BodyVector::new(component(0)?, component(1)?);
    within_reason(what, vector).map_err(|error| PyValueError::new_err(error.to_string()))
}
