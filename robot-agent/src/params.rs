//! Parameters of a controller, as the scenario gives them.

use serde::de::DeserializeOwned;
use transport::codec::{self, CodecError};

/// The parameters of a robot's controller: bytes that only the controller understands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Params(pub(crate) Vec<u8>);

impl Params {
    /// The bytes as they came.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }

    /// Reads `params` of the scenario's `[[controller]]`, which come as JSON: `{}` where there are none.
    ///
    /// # Errors
    /// If they are not of this type.
    pub fn json<T: DeserializeOwned>(&self) -> Result<T, serde_json::Error> {
        serde_json::from_slice(&self.0)
    }

    /// Reads what was written by [`codec::encode`], with every bit of every number: the paper's laws come so.
    ///
    /// # Errors
    /// If another build wrote them, or another type.
    pub fn decode<T: DeserializeOwned>(&self) -> Result<T, CodecError> {
        codec::decode(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_keep_every_bit_in_either_form() {
        let value = 0.1 + 0.2;
        let json = Params(serde_json::to_vec(&vec![value]).unwrap());
        assert_eq!(json.json::<Vec<f64>>().unwrap(), [value]);
        assert_eq!(Params(codec::encode(&value)).decode::<f64>(), Ok(value));
        assert!(Params(b"{}".to_vec()).decode::<f64>().is_err());
        assert_eq!(Params(b"{}".to_vec()).bytes(), b"{}");
    }
}
