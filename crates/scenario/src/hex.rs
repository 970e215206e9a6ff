//! Bytes as a scenario file holds them: `"00c07f45"`.

use std::{borrow::Cow, fmt::Write as _};

use protocol::payload::{PAYLOAD_BYTES_MAX, Payload};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize, Serializer};

/// Bytes of a payload: two hexadecimal digits each, at least one byte.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct PayloadHex(Payload);

/// Why a text is no bytes of a payload.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "must be 1 to {PAYLOAD_BYTES_MAX} bytes of two hexadecimal digits each, such as \"00c07f45\", got `{0}`"
)]
pub struct PayloadHexError(String);

impl PayloadHex {
    /// These bytes; `None` for none at all, or more than any payload has.
    pub(crate) fn of(bytes: &[u8]) -> Option<Self> {
        Some(bytes)
            .filter(|bytes| !bytes.is_empty())
            .and_then(|bytes| Payload::try_from(bytes).ok())
            .map(Self)
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.0
    }
}

impl TryFrom<String> for PayloadHex {
    type Error = PayloadHexError;

    fn try_from(text: String) -> Result<Self, PayloadHexError> {
        let digit = |digit: u8| char::from(digit).to_digit(16).map(|value| value as u8);
        let byte = |pair: &[u8; 2]| Some(16 * digit(pair[0])? + digit(pair[1])?);
        let (pairs, rest) = text.as_bytes().as_chunks();
        let bytes: Option<Vec<u8>> = pairs.iter().map(byte).collect();
        bytes
            .filter(|bytes| rest.is_empty() && !bytes.is_empty())
            .and_then(|bytes| Payload::try_from(&bytes[..]).ok())
            .map(Self)
            .ok_or(PayloadHexError(text))
    }
}

impl Serialize for PayloadHex {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut text = String::new();
        for byte in self.bytes() {
            write!(text, "{byte:02x}").expect("a string takes all there is");
        }
        serializer.serialize_str(&text)
    }
}

impl JsonSchema for PayloadHex {
    fn schema_name() -> Cow<'static, str> {
        "PayloadHex".into()
    }

    fn inline_schema() -> bool {
        true
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "pattern": format!("^([0-9a-fA-F]{{2}}){{1,{PAYLOAD_BYTES_MAX}}}$") })
    }
}
