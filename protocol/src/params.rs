//! Parameters of a controller, as the scenario gives them.

use std::vec::Vec;

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::codec::{self, CodecError};

/// The parameters of a robot's controller: bytes that only the controller understands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Params(Vec<u8>);

impl Params {
    /// Parameters that are JSON.
    pub fn of_json(json: Vec<u8>) -> Self {
        Self(json)
    }

    /// Parameters that keep every bit of every number, for controllers of ours: [`decode`](Self::decode) reads them.
    pub fn encoded<T: Serialize>(value: &T) -> Self {
        Self(codec::encode(value))
    }

    /// Returns the bytes as they came.
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

    /// Reads what [`encoded`](Self::encoded) has written: the paper's laws come so.
    ///
    /// # Errors
    /// If another build wrote them, or another type.
    pub fn decode<T: DeserializeOwned>(&self) -> Result<T, CodecError> {
        codec::decode(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use std::vec;

    use super::*;

    #[test]
    fn parameters_keep_every_bit_in_either_form() {
        let value = 0.1 + 0.2;
        let json = Params::of_json(serde_json::to_vec(&vec![value]).unwrap());
        assert_eq!(json.json::<Vec<f64>>().unwrap(), [value]);
        assert_eq!(Params::encoded(&value).decode::<f64>(), Ok(value));
        assert!(Params::of_json(b"{}".to_vec()).decode::<f64>().is_err());
        assert_eq!(Params::of_json(b"{}".to_vec()).bytes(), b"{}");
    }
}
